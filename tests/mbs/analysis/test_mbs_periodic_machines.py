"""Motions of machines that repeat while shafts advance, against equations of their own."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

import rom
from cases.beam import stiffened_beam
from cases.mbs.parts import ORIGIN, Z, on_axle
from cases.refusals import refused, refuses
from rom.components.gear_mesh import Correction, GearPair
from rom.errors import ModelError

EXACT = {"rtol": 1e-11, "atol": 1e-13, "method": "DOP853"}
PAIR = GearPair((26, 40), 4e-3, 0.03, thinning=5e-5)
TURNS = {"pinion axle": 2 * np.pi / 26, "gear axle": -2 * np.pi / 40}
BALLS = rom.mbs.BallBearing(9, 12.7e-3, 65e-3, clearance=20e-6)


def geared(speed, inertia=((1e-3, 1e-3, 2e-3), (5e-3, 5e-3, 9e-3)), torque=80.0, **more):
    """A pinion that runs at constant speed and drives a gear against a torque."""
    mech, ends = rom.Mechanism(gravity=(0, 0, 0)), []
    spins = speed, -speed * 26 / 40
    for name, x, J, w in zip(("pinion", "gear"), (0.0, PAIR.distance), inertia, spins, strict=True):
        moving = {"at": (x, 0, 0), "omega": (0, 0, w)}
        ends.append(on_axle(mech, name, inertia=J, axle=f"{name} axle", **moving))
    flanks = Correction(relief=(1e-5, 1e-5), extent=(2e-3, 2e-3))
    mech.gear_mesh("mesh", *ends, axis=Z, pair=PAIR,
                   **{"stiffness": 1.3e10, "entry": 0.05, "damping": 5e-6, "conservative": False,
                      "correction": flanks} | more)  # fmt: skip
    mech.drive("speed", "pinion axle", lambda t: speed * t, rate=lambda t: speed + 0 * t,
               acceleration=lambda t: 0 * t)  # fmt: skip
    mech.torque("brake", ends[1], (0, 0, torque))
    return mech


def meshing(speed, **more):
    """The motion that repeats with every tooth."""
    options = {"turns": TURNS, "steps": 120, "settle": 10}
    mech = geared(speed)
    return rom.periodic_motion(mech, period=2 * np.pi / 26 / speed, **options | more)


def deviation(motion, speed):
    """Angle of the gear against that of ideal teeth."""
    s = motion.solution
    return s.joint("gear axle").angle + speed * 26 / 40 * (s.t - s.t[0])


def test_a_gear_pair_repeats_with_every_tooth():
    speed = 300.0
    one = meshing(speed)
    assert one.stable and one.gap < 1e-9
    assert_allclose(one.turns, list(TURNS.values()))
    long = rom.simulate(one.solution.mechanism, state=one.solution.final, dt=one.period / 120,
                        t_end=6 * one.period, rho_inf=0.8)  # fmt: skip
    angle = long.joint("gear axle").angle + speed * 26 / 40 * (long.t - one.solution.t[0])
    for k in range(4):
        part = angle[120 * k : 120 * k + 121]
        assert_allclose(part, deviation(one, speed), atol=1e-3 * np.ptp(deviation(one, speed)))
    three = rom.periodic_motion(one.solution.mechanism, period=3 * one.period, steps=360, start=one,
                                turns={k: 3 * x for k, x in TURNS.items()})  # fmt: skip
    assert_allclose(np.ptp(deviation(three, speed)), np.ptp(deviation(one, speed)), rtol=1e-3)
    assert_allclose(np.sort(np.abs(three.multipliers)), np.sort(np.abs(one.multipliers)) ** 3,
                    atol=1e-4)  # fmt: skip


@pytest.mark.parametrize("conservative", [False, True])
def test_multipliers_of_three_teeth_are_those_of_one_to_the_third_power(conservative):
    """But for the steps, by their square; motions beside begin so near that no line comes between.

    A line that comes or goes at the end of a step between two motions that are compared bends
    their difference: with forces that follow their energy 2.5 % were off.
    """
    mech, apart = geared(300.0, conservative=conservative), []
    given = {"period": 2 * np.pi / 26 / 300.0, "turns": TURNS, "settle": 10}
    for steps in (120, 240):
        one = rom.periodic_motion(mech, steps=steps, **given)
        three = rom.periodic_motion(mech, period=3 * one.period, steps=3 * steps, start=one,
                                    turns={k: 3 * x for k, x in TURNS.items()})  # fmt: skip
        apart.append(np.abs(three.multipliers / one.multipliers**3).max() - 1)
    assert apart[0] == pytest.approx(0.0, abs=3e-4)
    assert apart[0] / apart[1] == pytest.approx(4.0, rel=0.1)


def through(turns, share=1.0, **more):
    """Ask for the motion of a part of a tooth."""
    mech, period = geared(300.0, **more), share * 2 * np.pi / 26 / 300.0
    return lambda: rom.periodic_motion(mech, period=period, turns=turns)


test_gears_that_are_others_after_their_turns_are_refused = refused(
    (through({"pinion axle": TURNS["pinion axle"]}, damping=2e-5), "other forces act on"),
    (through(None), "'speed' does not repeat with the period"),
    (through({k: 0.7 * x for k, x in TURNS.items()}, 0.7), r"'mesh' has gone on by 0\.7 teeth"),
    (
        through(TURNS, inertia=((1e-3, 2e-3, 2e-3), (5e-3, 5e-3, 9e-3))),
        "the body 'pinion' is another one: its inertia",
    ),
    error=ModelError,
)


def test_a_flexible_body_takes_whole_turns_only():
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_flexible("blade", stiffened_beam(n_modes=2, stiffened=False))
    mech.revolute("axle", "ground", "blade.root", axis=Z)
    mech.drive("speed", "axle", lambda t: 0.1 * t)
    with pytest.raises(ModelError, match=r"1.5708 rad .*'blade' is another one: it is flexible"):
        rom.periodic_motion(mech, period=5 * np.pi, turns={"axle": np.pi / 2})


def test_a_wheel_beside_its_axis_is_refused():
    mech = rom.Mechanism(gravity=(0, 0, 0))
    wheel = mech.add_rigid("wheel", mass=1.0, inertia=(1, 1, 2), at=(0.1, 0, 0))
    mech.revolute("axle", mech.ground.marker(ORIGIN), wheel.marker((-0.1, 0, 0)), axis=Z)
    mech.drive("speed", "axle", lambda t: t)
    with pytest.raises(ModelError, match="its mass centre is beside the axis"):
        rom.periodic_motion(mech, period=1.0, turns={"axle": 1.0})
    assert rom.periodic_motion(mech, period=2 * np.pi).gap < 1e-9  # a whole turn
    whole = rom.periodic_motion(mech, period=2 * np.pi, turns={"axle": -2 * np.pi})
    assert whole.gap < 1e-9 and whole.turns == ()


def rotor(spin, mass=2.0, stiffness=800.0, damping=3.0, away=0.0):
    """A disc in the plane z = 0, driven about z, its mass centre beside the axis."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_rigid("disc", mass=mass, inertia=(0.5, 0.5, 1.0), at=(away, 0, 0),
                   markers={"axis": (-away, 0, 0)})  # fmt: skip
    mech.planar("plane", "ground", "disc.axis", normal=Z)
    mech.drive("spin", "plane", lambda t: spin * t, rate=lambda t: spin + 0 * t,
               acceleration=lambda t: 0 * t)  # fmt: skip
    if stiffness:
        across = np.array([1.0, 1.0, 0, 0, 0, 0])
        both = {"stiffness": stiffness * across, "damping": damping * across}
        mech.bushing("shaft", "ground", "disc.axis", **both)
    return mech


@pytest.mark.parametrize("spin", [12.0, 30.0])
def test_jeffcott_s_rotor_whirls_on_its_circle(spin):
    """e w^2 / (k/m - w^2 + i c w / m), below and above its critical speed of 20 rad/s."""
    away = 1e-3
    found = rom.periodic_motion(rotor(spin, away=away), period=2 * np.pi / spin, steps=400)
    s = found.solution
    axis = s.position("disc", "axis")
    exact = away * spin**2 / (400 - spin**2 + 1.5j * spin) * np.exp(1j * spin * s.t)
    assert_allclose(axis[:, 0] + 1j * axis[:, 1], exact, atol=2e-3 * abs(exact[0]))
    decay = np.exp(-0.75 * found.period)
    assert found.stable
    assert_allclose(np.abs(found.multipliers), decay, rtol=1e-4)


def test_a_shaft_in_a_ball_bearing_vibrates_as_balls_pass():
    """Against equations of two coordinates with the balls where the cage has them."""
    spin, mass, load, damping = 200.0, 2.0, 400.0, 900.0
    mech = rotor(spin, mass=mass, stiffness=0.0)
    mech.rolling_bearing("bearing", "disc.axis", "ground", axis=Z, bearing=BALLS)
    six = damping, damping, 0, 0, 0, 0
    mech.bushing("damper", "ground", "disc.axis", stiffness=np.zeros(6), damping=six)
    mech.force("load", "disc.axis", (load, 0, 0))
    passing = 2 * np.pi / BALLS.balls / BALLS.cage
    T = passing / spin
    found = rom.periodic_motion(mech, period=T, turns={"plane": passing}, steps=400)
    assert found.stable and found.gap < 1e-9
    s = found.solution

    def rates(t, y):
        angles = BALLS.cage * spin * t + 2 * np.pi / BALLS.balls * np.arange(BALLS.balls)
        depth = y[0] * np.cos(angles) + y[1] * np.sin(angles) - 0.5 * BALLS.clearance
        push = BALLS.stiffness * np.maximum(depth, 0) ** 1.5
        a = load - damping * y[2] - push @ np.cos(angles), -damping * y[3] - push @ np.sin(angles)
        return [y[2], y[3], a[0] / mass, a[1] / mass]

    start = np.concatenate([s.position("disc")[0, :2], s.velocity("disc")[0, :2]])
    run = solve_ivp(rates, (0, 11 * T), start, max_step=T / 50, dense_output=True, **EXACT)
    quarters = (run.sol((9 + x) * T + s.t)[:2].T for x in (0.0, 0.25, 0.5, 0.75))
    apart = [np.abs(x - s.position("disc")[:, :2]).max() for x in quarters]  # of the first ball
    assert min(apart) < 2e-3 * np.ptp(s.position("disc")[:, 1])


def test_a_spring_that_is_wound_up_does_not_repeat():
    mech = rotor(30.0)
    mech.rotational_spring("coil", "plane", stiffness=5.0)
    with pytest.raises(ModelError, match=r"other forces act on 'disc' in the same place: 31.4"):
        rom.periodic_motion(mech, period=2 * np.pi / 30)


def test_a_round_rotor_closes_after_any_angle_of_its_spin():
    """A balanced rotor that is shaken along x while it turns by no part of a turn."""
    spin, w, F = 17.0, 5.0, 0.2
    mech = rotor(spin)
    mech.force("shaker", "disc.axis", lambda t: (F * np.cos(w * t), 0, 0))
    refuses(ModelError, "'spin' does not repeat", rom.periodic_motion, mech, period=2 * np.pi / w)
    exact = F / (800 - 2 * w**2 + 3j * w)
    for turns in ({"plane": None}, {"disc": spin * 2 * np.pi / w}):
        found = rom.periodic_motion(mech, period=2 * np.pi / w, turns=turns)
        x = found.solution.position("disc")[:, 0]
        assert_allclose(x, (exact * np.exp(1j * w * found.solution.t)).real, atol=2e-3 * abs(exact))


def test_a_joint_whose_second_side_is_the_ground_counts_the_other_way():
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_rigid("wheel", mass=1.0, inertia=(1, 1, 2), at=ORIGIN)
    mech.revolute("axle", "wheel", "ground", axis=Z)
    mech.drive("speed", "axle", lambda t: 2.0 * t)
    found = rom.periodic_motion(mech, period=0.4, turns={"axle": 0.8})
    assert found.turns == (-0.8,) and found.gap < 1e-9
    assert_allclose(found.solution.omega("wheel")[0], (0, 0, -2.0), atol=1e-9)


@pytest.mark.parametrize("spin", [30.0, -30.0])
def test_a_gyroscope_precesses_as_a_rotating_moment_has_it(spin):
    """(k - I w^2 + J W w + i c w) u = F for the tip of a disc that spins freely on a ball joint."""
    k, c, I, J, w, F = 900.0, 20.0, 1.0, 1.6, 11.0, 0.05
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_rigid("disc", mass=1.0, inertia=(I, I, J), at=ORIGIN, omega=(0, 0, spin),
                   markers={"tip": (0, 0, 1)})  # fmt: skip
    mech.spherical("socket", "ground", "disc")
    for name, end in (("x", (-1e3, 0, 1)), ("y", (0, -1e3, 1))):
        mech.spring_damper(name, mech.ground.marker(end), "disc.tip", stiffness=k, damping=c)
    mech.force("push", "disc.tip", lambda t: (F * np.cos(w * t), F * np.sin(w * t), 0))
    T = 2 * np.pi / w
    found = rom.periodic_motion(mech, period=T, turns={"disc": abs(spin) * T}, steps=400)
    s = found.solution
    u = s.position("disc", "tip")[:, 0] + 1j * s.position("disc", "tip")[:, 1]
    exact = F / (k - I * w**2 + J * spin * w + 1j * c * w) * np.exp(1j * w * s.t)
    assert_allclose(u, exact, atol=3e-3 * abs(exact[0]))
    poles = np.roots([I, c - 1j * J * spin, k])  # and their conjugates
    decays = np.sort(np.abs(np.exp(np.repeat(poles, 2) * T)))
    assert_allclose(np.sort(np.abs(found.multipliers))[:4], decays, rtol=2e-2, atol=1e-6)


def test_a_gear_that_is_hit_at_its_start_still_comes_to_its_motion():
    """Newton's method from the first blow leads nowhere: time goes on in between."""
    speed = 300.0
    still = geared(speed, damping=1e-5)
    still.parts["gear"] = replace(still.parts["gear"], omega=np.zeros(3))
    one, other = (rom.periodic_motion(mech, period=2 * np.pi / 26 / speed, turns=TURNS, steps=120)
                  for mech in (still, geared(speed, damping=1e-5)))  # fmt: skip
    assert one.passes > other.passes
    size = np.ptp(deviation(other, speed))
    assert_allclose(deviation(one, speed), deviation(other, speed), atol=1e-5 * size)


def test_a_path_over_the_speed_of_gears_is_measured_by_their_vibration():
    """Not by their speed, which is ten thousand times larger: few steps lead a long way."""
    path = rom.periodic_path(geared, (1100.0, 1000.0), period=lambda w: 2 * np.pi / 26 / w,
                             turns=TURNS, steps=60, settle=20, n=25)  # fmt: skip
    assert path.p[-1] == pytest.approx(1000.0) and path.stable.all()
    sizes = [np.ptp(deviation(m, w)) for m, w in zip(path.motions, path.p, strict=True)]
    alone = meshing(1000.0, steps=60, settle=20)
    assert sizes[-1] == pytest.approx(np.ptp(deviation(alone, 1000.0)), rel=1e-4)
    assert np.all(np.diff(sizes) > 0.0)
