"""Steps one by one: the bits of a run, states to come back to, what inputs and outputs mean."""

import re
from dataclasses import replace
from itertools import cycle

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import rom
from cases.beam import stiffened_beam
from cases.mbs.mechanisms import simulate_quietly, slider_crank
from cases.mbs.motions import four_links, hub_and_panel, pendulum, sampled, swing
from cases.mbs.parts import on_guide
from cases.paths import ROOT
from cases.refusals import refused
from rom.body.recovery import StressRecovery
from rom.mbs.control.stepper import AHEAD

pytestmark = pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")
N = 40  # steps


def arm(torque=0.0, push=(0.0, 0.0, 0.0)):
    """A flexible arm on a hinge with friction, between stops, under gravity."""
    mech, body = rom.Mechanism(gravity=(0, -9.81, 0)), stiffened_beam(EI=50.0, n_modes=4)
    rng = np.random.default_rng(5)
    stress = StressRecovery(rng.normal(size=(3, 3)), rng.normal(size=(18, 4)),
                            rng.normal(size=(18, 16)))  # fmt: skip
    part = mech.add_flexible("arm", replace(body, stress=stress))
    mech.revolute("hinge", "ground", part.marker("root"), axis=(0, 0, 1))
    mech.friction("rub", "hinge", coulomb=0.05, transition_speed=0.05)
    mech.stop("stop", "hinge", rom.mbs.Impact(500.0), upper=0.04)
    mech.motor("servo", "hinge", lambda t, x, v: torque)
    mech.force("push", part.marker("tip"), push)
    return mech


def turning(acceleration=7.0):
    """A crank by a drive that knows its rates, its joints repeating each other."""
    mech = slider_crank()
    mech.drives.clear()
    mech.drive("motor", "main", lambda t: t * (50.0 + t * acceleration / 2),
               rate=lambda t: 50.0 + t * acceleration,
               acceleration=lambda t: acceleration + 0.0 * t)  # fmt: skip
    return mech


def bumping(stiffness=2e3):
    """A ball on a table, and a law with a parameter."""
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    ball = mech.add_rigid("ball", mass=1, inertia=(1, 1, 1), at=(0, 0, 0.11), velocity=(1, 0, 0))
    law = rom.mbs.Impact(1e4, mu=0.3)
    mech.sphere_on_plane(
        "table", "ground", ball.marker((0, 0, 0)), law, radius=0.1, normal=(0, 0, 1)
    )

    def pull(t, parameters, motion, memory, out):
        out.force[0, 0] = -parameters[0] * motion.position[0, 0]

    mech.law("coil", pull, "ball", parameters=[stiffness])
    return mech


CASES = {  # mechanism as it is to be, the one that steps, its inputs and their values, step
    "arm": (lambda: arm(3.0, (0, 0.5, 0)), arm, ("servo", "push"), (3.0, 0, 0.5, 0), 1e-3),
    "drive": (turning, lambda: turning(0.0), ("motor",), (7.0,), 1e-3),
    "contact": (bumping, lambda: bumping(0.0), ("coil",), (2e3,), 1e-3),
    "laws": (swing, swing, (), (), 1e-2),
    "blocks": (four_links, four_links, (), (), 1e-3),
    "samples": (sampled, sampled, (), (), 2.5e-3),
}


def stand(stepper, t, q, v, lam):
    state = stepper.state
    assert state.t == t
    for name, x in (("q", q), ("v", v), ("lam", lam)):
        assert_array_equal(getattr(state, name), x, err_msg=name)


@pytest.mark.parametrize("case", CASES)
def test_constant_inputs_give_the_bits_of_one_run(case, tmp_path):
    """After a reset, from a kept state and from one in a file, and `simulate` goes on from it."""
    wanted, build, inputs, values, dt = CASES[case]
    sol = simulate_quietly(wanted(), t_end=N * dt, dt=dt, rho_inf=0.7)
    stepper = rom.Stepper(build(), dt=dt, inputs=inputs, rho_inf=0.7)
    other = rom.Stepper(build(), dt=dt, inputs=inputs, rho_inf=0.7, every=5 * dt)
    end = (sol.t[-1], sol.q[-1], sol.v[-1], sol.lam[-1])
    for _ in range(2):
        for k in range(N):
            if k == 15:
                kept = stepper.state
            stepper.step(values)
        stand(stepper, *end)
        stepper.reset()
        stand(stepper, 0.0, sol.q[0], sol.v[0], stepper.state.lam)
    for state in (kept, rom.load_state(rom.save_state(kept, tmp_path / "k.state.npz"))):
        for one in (stepper, other):
            one.reset(state)
            for _ in range((N - 15) // one.count):
                one.step(values)
            stand(one, *end)
    more = simulate_quietly(wanted(), t_end=N * dt, dt=dt, rho_inf=0.7, state=kept)
    assert_array_equal(more.q[-1], sol.q[-1])


@pytest.mark.parametrize("repeated", [False, True])
def test_an_input_that_jumps_moves_a_mass_as_it_does_by_hand(repeated):
    """Forces held over steps give a mass parabolas, which the method has exactly."""
    mech, values = rom.Mechanism(gravity=(0, 0, 0)), np.random.default_rng(1).normal(size=50)
    on_guide(mech, mass=2.0)
    if repeated:  # the same guide once more: the loads of both are shared
        (part,) = mech.parts.values()
        mech.prismatic("again", "ground", part.marker((0.0, 0.0, 0.0)), axis=(1, 0, 0))
    mech.motor("engine", "guide", lambda t, x, v: 0.0)
    stepper, x, v = rom.Stepper(mech, dt=0.1, inputs=["engine"], outputs=["guide"]), 0.0, 0.0
    for force in values:
        found = stepper.step([force])
        x, v = x + 0.1 * v + force / 4 * 0.01, v + 0.1 * force / 2
        assert_allclose(found, [x, v], rtol=0, atol=1e-13)


def test_outputs_are_what_the_motion_says_at_its_end():
    dt, names = 1e-3, [
        "arm.tip", "hinge", "arm tip position y", "arm.tip.velocity", "arm orientation",
        "arm omega",
        "arm elastic", "arm elastic q2", "arm position", "hinge force", "hinge moment z",
        "hinge angle rate", "arm stress 1", "arm stress 2 xy",
    ]  # fmt: skip
    stepper = rom.Stepper(arm(3.0), dt=dt, outputs=names)
    for _ in range(N):
        found = stepper.step()
    sol = simulate_quietly(arm(3.0), t_end=N * dt, dt=dt)
    place, speed = sol.position("arm", "tip")[-1], sol.velocity("arm", "tip")[-1]
    joint, load, elastic = sol.joint("hinge"), sol.reaction("hinge")[-1], sol.elastic("arm")[-1]
    turn = [joint.angle[-1], joint.angle_rate[-1]]
    axes = rom.rotation.quaternion(sol.axes("arm", "tip")[-1])
    spin = sol._seen("arm", "tip").twist[-1, 3:]
    frame = sol.omega("arm")[-1]
    stress = sol.stress("arm", -1)
    expected = [
        *place, *speed, *axes, *spin, *turn, place[1], *speed, *sol.orientation("arm")[-1], *frame,
        *elastic, elastic[1], *sol.position("arm")[-1], *load[:3], load[5], turn[1], *stress[1],
        stress[2, 5],
    ]  # fmt: skip
    assert_allclose(found, expected, rtol=1e-9, atol=1e-12)
    assert len(stepper.output_names) == found.size


def test_turns_are_counted_over_a_long_step_and_come_back_with_a_state():
    """A wheel at 30 rad/s turns five times in a second, which one call covers."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_rigid("wheel", mass=1, inertia=(1, 1, 1), at=(0, 0, 0), omega=(0, 0, 30.0))
    mech.revolute("hinge", "ground", "wheel", axis=(0, 0, 1))
    stepper = rom.Stepper(mech, dt=0.02, every=1.0, outputs=["hinge"])
    assert_allclose(stepper.step(), [30.0, 30.0])
    state = stepper.state
    assert_allclose(stepper.step(), [60.0, 30.0])
    stepper.reset(state)
    assert_allclose(stepper.step(), [60.0, 30.0])
    # a run does not follow the hinge, and starts to count from where it sees it
    sol = rom.simulate(mech, t_end=1.0, dt=0.02)
    assert_allclose(stepper.reset(sol.final)[0] % (2 * np.pi), 30.0 % (2 * np.pi))


def pushed():
    """A pendulum in the wind, whose law fails, or finds no end, under a parameter."""
    mech, sides = pendulum(), cycle((1, -1))

    def grip(t, parameters, motion, memory, out):
        if parameters[0] > 3:
            raise RuntimeError("too much")
        noise = 1e4 * next(sides) if parameters[0] > 1 else 0.0
        out.force[0, 0] = parameters[0] - motion.velocity[0, 0] + noise

    mech.law("grip", grip, "bob.tip", parameters=[0.0], compiled=False)
    mech.force("wind", "bob.tip", lambda t: (np.sin(9 * t), 0, 0))
    mech.force("gust", "bob.tip", (0, 0, 0))
    return mech


def fresh():
    return rom.Stepper(pushed(), dt=1e-2, every=3e-2, inputs=["grip", "gust"], outputs=["hinge"])


@pytest.mark.parametrize("wrong", [(4, 0, 0, 0), (2, 0, 0, 0), (0, 1e200, 0, 0)])
def test_a_step_that_fails_leaves_all_as_it_was(wrong):
    gust = [0.5, 0.3, 0, 0]
    steppers = [fresh(), fresh()]
    for k in range(12):
        if k % 4 == 2:
            before = steppers[0].state
            with pytest.raises(rom.SolverError):
                steppers[0].step(wrong)
            stand(steppers[0], before.t, before.q, before.v, before.lam)
        found = [one.step(np.multiply(gust, np.sin(k))).copy() for one in steppers]
        assert_array_equal(*found)
        assert steppers[0].t == steppers[1].t
    steppers[0].reset()
    assert_array_equal(steppers[0].step(gust), fresh().step(gust))


def test_a_failure_where_functions_of_time_are_asked_anew_leaves_their_times_as_they_were():
    steppers = [fresh(), fresh()]
    for one in steppers:
        one.reset()
        one.advance(AHEAD - 4, 1e-2)
    steppers[0].inputs.values[0] = 2.0
    with pytest.raises(rom.SolverError):
        steppers[0].advance(10, 1e-2)
    steppers[0].inputs.values[0] = 0.0
    for one in steppers:
        one.advance(1, 1e-2)
    assert steppers[0].t == steppers[1].t
    assert_array_equal(*(one.read() for one in steppers))


def test_two_steppers_of_one_mechanism_and_a_run_do_not_know_of_each_other():
    mech = arm()
    one, two = (rom.Stepper(mech, dt=1e-3, inputs=["servo"], outputs=["hinge"]) for _ in range(2))
    found = [one.step([1.0]).copy() for _ in range(5)]
    for _ in range(3):
        two.step([-4.0])
    one.reset()
    assert_array_equal([one.step([1.0]).copy() for _ in range(5)], found)
    sol = simulate_quietly(mech, t_end=5e-3, dt=1e-3)
    assert_array_equal(sol.q[-1], simulate_quietly(arm(), t_end=5e-3, dt=1e-3).q[-1])


def test_a_state_of_a_run_begins_anew_under_inputs_and_goes_on_without():
    sol = simulate_quietly(hub_and_panel(), t_end=0.05, dt=1e-3)
    whole = simulate_quietly(hub_and_panel(), t_end=0.07, dt=1e-3)
    stepper = rom.Stepper(hub_and_panel(), dt=1e-3)
    stepper.reset(sol.final)
    for _ in range(20):
        stepper.step()
    assert_array_equal(stepper.state.q, whole.q[-1])
    stepper = rom.Stepper(arm(), dt=1e-3, inputs=["servo"])
    rest = rom.equilibrium(arm())
    stepper.reset(rest)
    for _ in range(20):
        stepper.step([0.0])
    assert_allclose(stepper.state.q, rest.q, atol=1e-6)


def test_a_function_of_time_fails_when_its_time_has_come_not_before():
    def until(t):
        if t > 0.1:
            raise ValueError("no data")
        return (0.0, 1.0, 0.0)

    mech = pendulum()
    mech.force("wind", "bob.tip", until)
    stepper = rom.Stepper(mech, dt=0.01)
    for _ in range(10):
        stepper.step()
    state = stepper.state
    with pytest.raises(rom.SolverError, match=r"wind.*t = 0.11 s.*no data"):
        stepper.step()
    assert stepper.state.t == state.t == pytest.approx(0.1)
    mech = pendulum()
    mech.drive("jerk", "hinge", lambda t: 0.0 if t < 0.05 else 0.3)
    stepper = rom.Stepper(mech, dt=0.01)
    with pytest.raises(rom.ModelError, match=r"jerk.*jumps by 0.3"):
        for _ in range(10):
            stepper.step()
    assert 0.03 < stepper.t < 0.055


def test_the_environment_of_the_page_about_laws_is_one_by_the_checker_of_gymnasium():
    pytest.importorskip("gymnasium", reason="gymnasium is not installed")
    from gymnasium.utils.env_checker import check_env

    page, space = (ROOT / "docs" / "laws.md").read_text(), {}
    (text,) = (x for x in re.findall(r"```python\n(.*?)```", page, re.S) if "gymnasium" in x)
    exec(text, space)
    swing, seen = space["Swing"](arm()), []
    check_env(swing, skip_render_check=True)
    for _ in range(2):
        first, _ = swing.reset(seed=3)
        seen.append([first, *(swing.step(np.array([np.sin(k)]))[0] for k in range(5))])
    assert_array_equal(*seen)
    assert np.ptp(seen[0], axis=0)[[0, 1, 3, 4, 6]].min() > 0


def changed():
    mech = pendulum()
    stepper = rom.Stepper(mech, dt=1e-2)
    mech.rotational_spring("late", "hinge", stiffness=1.0)
    stepper.reset()


def ended():
    mech = pendulum()
    mech.event("end", lambda t, x: x.position("bob")[0], terminal=True)
    rom.Stepper(mech, dt=1e-2)


def stepped(*values, **options):
    return lambda: rom.Stepper(arm(), **{"dt": 1e-3, "inputs": ["servo", "push"]} | options).step(
        *values
    )


test_wrong_calls_are_refused = refused(
    (stepped(inputs=["sevro"]), r"no input 'sevro'.*'servo'"),
    (stepped(inputs=["rub"]), "no input 'rub'"),
    (stepped(inputs=["servo", "servo"]), "the input 'servo' is given twice"),
    (stepped(outputs=["arm.tap"]), r"no output 'arm.tap'.*'arm.tip'"),
    (stepped(outputs=["hinge angel"]), r"no output 'hinge angel'.*'hinge angle'"),
    (stepped(outputs=["arm stress 3"]), "no output 'arm stress 3'"),
    (stepped(dt=-1.0), "dt = -1.* must be positive"),
    (stepped(every=2.5e-3), "every = 0.0025 s must be a multiple of dt = 0.001 s"),
    (stepped(every=1e-4), "every = 0.0001 s must be a multiple"),
    (stepped(rho_inf=1.5), "rho_inf"),
    (stepped([1.0, 2.0, 3.0]), "values .*4"),
    (stepped(1.0), "values .*4"),
    (stepped([[1.0, 2.0, 3.0, 4.0]]), "values .*4"),
    (stepped([1.0, 2.0, np.nan, 3.0]), "values.*finite"),
    (stepped([1.0, 2.0, np.inf, 3.0]), "values.*finite"),
    (stepped("four"), "values"),
    (changed, "the mechanism was changed since its stepper was made"),
    (ended, "event 'end' would end the motion"),
    (lambda: rom.Stepper(pendulum(), dt=1e-2).reset(rom.equilibrium(arm())), "bodies differ"),
    error=rom.ConfigError,
)
