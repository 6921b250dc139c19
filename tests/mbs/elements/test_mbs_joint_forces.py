"""Motors, friction and stops along joint coordinates, against closed forms; the power balance."""

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

import rom
from cases.mbs import mechanisms
from cases.mbs.mechanisms import simulate_quietly, slider_crank
from cases.mbs.parts import X, Y, Z, on_axle, on_guide, refused_on
from cases.mbs.tangents import by_position, by_velocity, difference, forces_at
from cases.refusals import refuses
from rom.errors import ConfigError, ModelError, SolverError
from rom.mbs.elements import motors
from rom.mbs.elements.contact.impact import Impact
from rom.mbs.equations.equations import load_columns
from rom.mbs.integrate.simulation import simulate
from rom.mbs.kernels.constraints import constraint_gradient

METHODS = ("generalized-alpha", "dop853")
g = 9.81


@njit
def columns_at(s, W, lam):
    constraint_gradient(s, W)
    W.UG[:] = W.G
    load_columns(s, W, lam, lam.size)


def wheel(J=0.5, omega=0.0):
    mech = rom.Mechanism(gravity=(0, 0, 0))
    on_axle(mech, inertia=(J, J, J), omega=(0, 0, omega))
    return mech


def block(mass=2.0, speed=0.0, gravity=g):
    mech = rom.Mechanism(gravity=(0, 0, -gravity))
    on_guide(mech, "block", mass=mass, velocity=(speed, 0, 0))
    return mech


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("compiled", [True, False])
def test_a_motor_with_a_straight_characteristic_runs_up_exponentially(method, compiled):
    """Omega = w0 (1 - exp(-T0 t / (J w0)))."""
    mech = wheel(J=0.5)
    mech.motor("motor", "axle", lambda t, angle, rate: 3.0 * (1 - rate / 20.0), compiled=compiled)
    sol = simulate(mech, t_end=2.0, dt=5e-3, method=method)
    exact = 20.0 * (1 - np.exp(-3.0 / (0.5 * 20.0) * sol.t))
    assert_allclose(sol.omega("wheel")[:, 2], exact, atol=1e-5)
    assert_allclose(sol.energy.drives[-1], 0.25 * exact[-1] ** 2, rtol=1e-5)
    assert rom.audit(sol).ok, rom.audit(sol)


def test_a_law_of_time_and_angle_is_compiled_when_it_can_be_and_agrees_with_python():
    def law(t, angle, rate):
        return 2.0 * np.sin(3.0 * t) - 4.0 * angle - 0.1 * rate

    runs = []
    for compiled in (None, False):
        mech = wheel()
        mech.motor("motor", "axle", law, compiled=compiled)
        assert (mech.motors["motor"].address != 0) == (compiled is None)
        runs.append(simulate(mech, t_end=2.0, dt=5e-3))
    assert_allclose(runs[0].v, runs[1].v, atol=1e-9)
    exact = solve_ivp(lambda t, y: (y[1], law(t, *y) / 0.5), (0, 2), (0, 0), t_eval=runs[0].t,
                      rtol=1e-10, atol=1e-12).y  # fmt: skip
    assert_allclose(runs[0].base[:, 0], exact[0], atol=1e-4)
    assert runs[0].statistics["iterations"] < 3 * runs[0].statistics["steps"]


class Controller:
    """A control law with a state of its own: the target it last gave."""

    def __call__(self, t, angle, rate):
        self.target = 0.5 * t
        return -50.0 * (angle - self.target) - 1.0 * rate

    def about_z(self, t, _parameters, motion, _memory, out):
        """The same as a law between the markers of the joint."""
        (a, b), (one, other) = motion.axes[:, :2, 0], motion.omega[:, 2]
        moment = self(t, np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b), other - one)
        out.moment[:, 2] = -moment, moment

    def pair(self, t, b, a):
        """The same as a force on the second marker, back on the first."""
        angle = np.arctan2(a.axes[0, 0] * b.axes[1, 0] - a.axes[1, 0] * b.axes[0, 0],
                           a.axes[:, 0] @ b.axes[:, 0])  # fmt: skip
        return np.zeros(3), (0.0, 0.0, self(t, angle, b.omega[2] - a.omega[2]))


WAYS = {
    "compiled": lambda m, name, joint, _: m.motor(
        name, joint, lambda t, x, v: -50.0 * (x - 0.5 * t) - 1.0 * v, compiled=True
    ),
    "motor": lambda m, name, joint, _: m.motor(name, joint, Controller()),
    "law": lambda m, name, _, ends: m.law(name, Controller().about_z, *ends, compiled=False),
    "force": lambda m, name, _, ends: m.user_force(name, Controller().pair, *ends[::-1]),
}


def controlled_arm(way):
    """Two light links that bend, hinged to the ground and to each other, both hinges controlled."""
    body = mechanisms.lattice_body(mechanisms.lattice(stiffness=4e4, length=0.4, mass=0.02))
    mech = rom.Mechanism(gravity=(0, -g, 0))
    upper = mech.add_flexible("upper", body)
    lower = mech.add_flexible("lower", body, at=(0.4, 0, 0))
    shoulder = mech.ground.marker(mech.design_point(upper.marker("n0"))), upper.marker("n0")
    elbow = upper.marker("n12"), lower.marker("n0")
    for joint, ends in (("shoulder", shoulder), ("elbow", elbow)):
        mech.revolute(joint, *ends, axis=Z)
        WAYS[way](mech, f"control of {joint}", joint, ends)
    return mech


@pytest.mark.parametrize("dt", [1e-3, 1e-4])
@pytest.mark.parametrize("way", ["motor", "law", "force"])
def test_controllers_in_python_step_as_compiled_ones_do(way, dt):
    """Their derivatives are in Newton's matrix: stiff ones diverged, weak ones took many."""
    runs = [simulate(controlled_arm(one), t_end=50 * dt, dt=dt) for one in ("compiled", way)]
    assert_allclose(runs[0].q, runs[1].q, atol=1e-9)
    for count in ("steps", "iterations", "factorisations"):
        assert runs[0].statistics[count] == runs[1].statistics[count]


def test_controllers_in_python_choose_steps_and_small_motions_as_compiled_ones_do():
    sizes, modes = [], []
    for way in WAYS:
        mech = controlled_arm(way)
        sizes.append(simulate(mech, t_end=0.01).statistics["steps"])
        modes.append(rom.linearize(mech, rom.equilibrium(mech, t=0.0)).eigenvalues)
    assert len(set(sizes)) == 1
    for found in modes[1:]:
        assert_allclose(found, modes[0], rtol=1e-6, atol=1e-6 * np.abs(modes[0]).max())


def test_a_law_that_keeps_newton_from_ending_is_named():
    noise = np.random.default_rng(0)
    mech = wheel(J=1e-3)
    mech.motor("calm", "axle", lambda t, x, v: 1.0)
    mech.motor("servo", "axle", lambda t, x, v: noise.normal(), compiled=False)
    refuses(SolverError, "the law of 'servo' still changes by", simulate, mech, t_end=1.0, dt=1e-2)


def test_a_law_with_a_memory_is_left_to_python():
    """An integral controller; Numba cannot compile the object that remembers."""
    memory = {"t": 0.0, "integral": 0.0}

    def law(t, angle, rate):
        memory["integral"] += (t - memory["t"]) * (1.0 - angle)
        memory["t"] = t
        return 5.0 * (1.0 - angle) - 2.0 * rate + 2.0 * memory["integral"] - 1.0

    mech = wheel()
    mech.motor("motor", "axle", law)
    assert mech.motors["motor"].address == 0
    sol = simulate(mech, t_end=15.0, dt=5e-3)
    assert abs(sol.base[-1, 0] - 1.0) < 1e-2


@pytest.mark.parametrize("method", METHODS)
def test_a_sliding_block_stops_after_v_over_mu_g(method):
    """With tanh for the sign: sinh(v / s) = sinh(v0 / s) exp(-mu g t / s)."""
    mu, v0, s = 0.3, 1.5, 0.02
    mech = block(speed=v0)
    mech.friction("shoes", "guide", mu=mu, transition_speed=s)
    sol = simulate(mech, t_end=0.6, dt=5e-4, method=method)
    v = sol.velocity("block")[:, 0]
    exact = s * np.arcsinh(0.5 * np.exp((v0 - mu * g * sol.t) / s))
    assert_allclose(v, exact, atol=2e-5)
    stop = v0 / (mu * g)
    assert np.interp(stop, sol.t, v) < s
    assert np.interp(0.9 * stop, sol.t, v) > 0.09 * v0
    assert_allclose(sol.position("block")[-1, 0], v0**2 / (2 * mu * g), rtol=2e-3)
    assert_allclose(sol.energy.damping[-1], 0.5 * 2.0 * v0**2, rtol=1e-4)
    assert rom.audit(sol).ok, rom.audit(sol)


@pytest.mark.once
@pytest.mark.parametrize("seed", range(2))
def test_tangents_are_derivatives_of_the_forces(seed):
    rng = np.random.default_rng(seed)
    mech, one, two = mechanisms.two_soft(rng, (0, 0, -g))
    mech.cylindrical("tube", one.marker("a"), two.marker("b"), axis=(1, 2, 2))
    mech.prismatic("guide", mech.ground.marker((0, 1, 0)), one.marker("b"), axis=X)
    mech.friction("pin", "tube", mu=0.3, radius=0.2, coulomb=0.4, static=1.5, stribeck_speed=2.0,
                  viscous=0.2, transition_speed=1.0)  # fmt: skip
    mech.friction("shoes", "guide", mu=0.2, transition_speed=0.5)
    law = Impact(3.0, exponent=2.0, damping=0.1)
    mech.stop("end", "tube", law, coordinate="way", lower=20.0)
    mech.stop("wall", "guide", law, upper=-20.0)
    mech.motor("motor", "tube", lambda t, x, v: 1.7, compiled=False)
    mech.motor("drive", "tube", lambda t, x, v: 1.5 - 4.0 * x**2 - 0.7 * v**3, coordinate="way")
    packed, W = mechanisms.prepared(mech)
    packed.system.markers.twist[:] *= 1e-3
    s, (q, v, a, lam) = packed.system, mechanisms.random_state(rng, packed)
    packed.elements[motors.MOTORS_FAMILY].answer[:] = 1.7
    found, C = by_velocity(packed, W, q, v, a, lam)
    assert_allclose(found, C, atol=1e-7 * np.abs(C).max())
    by_load = difference(lambda x: forces_at(packed, W, q, v, a, lam + x), lam.size)
    forces_at(packed, W, q, v, a, lam)
    columns_at(s, W, lam)
    assert_allclose(W.UG.T, by_load, atol=1e-6 * np.abs(by_load).max())
    assert np.abs(W.UG - W.G).max() > 0.01
    v[:] = 0.0  # the turning of a torque axis holds where the joint is closed
    packed.elements[motors.MOTORS_FAMILY].answer[:] = 0.0
    found, K = by_position(packed, W, q, v, a, lam, 1e-6)
    assert_allclose(found, K, atol=1e-6 * np.abs(K).max())


def test_friction_by_load_takes_few_newton_passes():
    """The change of the friction with the multipliers is in the iteration matrix."""
    mech = block(speed=1.5)
    mech.friction("shoes", "guide", mu=0.3, transition_speed=0.05)
    mech.force("push", "block", lambda t: (0.0, 4.0 * np.sin(40 * t), 3 * t))
    sol = simulate(mech, t_end=0.3, dt=1e-3)
    assert sol.statistics["iterations"] < 3.2 * sol.statistics["steps"]


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_motor_pushes_the_second_body_and_holds_back_the_first(way):
    """Two blocks on one rail: equal and opposite momentum, and the work is force times way."""
    mech, force = block(mass=2.0, gravity=0.0), 3.0 * way
    mech.add_rigid("other", mass=5.0, inertia=(1, 1, 1), at=(1, 0, 0))
    mech.prismatic("rail", "block", "other", axis=X)
    mech.motor("jack", "rail", lambda t, x, rate: force)
    sol = simulate(mech, t_end=1.0, dt=1e-2)
    assert_allclose(sol.velocity("other")[:, 0], force / 5.0 * sol.t, atol=1e-9)
    assert_allclose(sol.velocity("block")[:, 0], -force / 2.0 * sol.t, atol=1e-9)
    apart = sol.position("other")[:, 0] - sol.position("block")[:, 0] - 1.0
    assert_allclose(sol.energy.drives, force * apart, atol=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_a_block_with_coulomb_friction_slides_down_a_slope(method):
    """A = g (sin - mu cos) with the level by the load, and with that level given."""
    mu, angle, s = 0.2, 0.5, 1e-3
    for level in ({"mu": mu}, {"coulomb": 2.0 * mu * g * np.cos(angle)}):
        mech = block(speed=1.0)
        mech.gravity = g * np.array([np.sin(angle), 0, -np.cos(angle)])
        mech.friction("shoes", "guide", transition_speed=s, **level)
        sol = simulate(mech, t_end=0.5, dt=1e-2, method=method)
        a = g * (np.sin(angle) - mu * np.cos(angle))
        assert_allclose(sol.velocity("block")[:, 0], 1.0 + a * sol.t, atol=1e-8)
        lost = 2.0 * mu * g * np.cos(angle) * sol.position("block")[:, 0]
        assert_allclose(sol.energy.damping, lost, atol=1e-3)


def test_an_oscillator_with_dry_friction_loses_four_f_over_k_per_cycle():
    k, F, x0 = 200.0, 2.0, 0.3
    mech = block(mass=2.0, gravity=0.0)
    hook = mech.ground.marker((-1, 0, 0))
    mech.spring_damper("spring", hook, "block", stiffness=k, free_length=1.0 - x0)
    mech.friction("shoes", "guide", coulomb=F, transition_speed=1e-3)
    sol = simulate(mech, t_end=3 * 2 * np.pi * np.sqrt(2.0 / k), dt=2e-4)
    x = sol.position("block")[:, 0] + x0
    tops = [i for i in range(1, x.size - 1) if x[i - 1] < x[i] >= x[i + 1]]
    peaks = np.r_[x0, x[tops]]
    assert len(peaks) >= 3
    assert_allclose(np.diff(peaks), -4 * F / k, rtol=5e-3)


def test_stribeck_friction_and_the_friction_of_a_loaded_pin():
    """Steady rotation under a torque: level and shape are read from the torque that holds it."""
    mu, radius, load, rate = 0.2, 0.05, 300.0, 0.4
    mech = wheel()
    mech.force("load", mech.parts["wheel"].marker((0, 0, 0)), (180.0, 240.0, 0.0))
    mech.friction("pin", "axle", mu=mu, radius=radius, coulomb=0.5, static=1.6,
                  stribeck_speed=0.5, viscous=0.3, transition_speed=0.1)  # fmt: skip
    mech.drive("motor", "axle", lambda t: rate * t)
    sol = simulate(mech, t_end=0.5, dt=1e-2)
    level = 0.5 + mu * radius * load
    fade = 1 + 0.6 * np.exp(-((rate / 0.5) ** 2))
    torque = level * np.tanh(rate / 0.1) * fade + 0.3 * rate
    assert_allclose(sol.reaction("motor")[-1, 5], torque, rtol=1e-9)
    assert_allclose(sol.energy.drives[-1], torque * rate * 0.5, rtol=1e-9)


def test_friction_by_load_among_joints_that_repeat_others_is_refused_and_of_a_given_level_is_not():
    mech = slider_crank()
    mech.friction("shoes", "guide", mu=0.1, transition_speed=0.1)
    refuses(ModelError, "shares with others", simulate_quietly, mech, t_end=0.1, dt=1e-3)
    mech = slider_crank()
    mech.friction("shoes", "guide", coulomb=1.0, transition_speed=0.1)
    sol = simulate_quietly(mech, t_end=0.05, dt=1e-4)
    assert sol.energy.damping[-1] > 0.01
    assert rom.audit(sol).ok, rom.audit(sol)


def spatial_crank():
    """Motor, drive, load-dependent friction, a screw and a bushing, nothing redundant."""
    mech = rom.Mechanism()
    on_axle(mech, "crank", inertia=(0.01, 0.01, 0.02), axle="main", omega=(0, 0, 10.0),
            markers={"a": (0.1, 0, 0)})  # fmt: skip
    mech.add_rigid("rod", mass=0.5, inertia=(1e-3, 4e-3, 4e-3), at=(0.25, 0, 0),
                   markers={"a": (-0.15, 0, 0), "b": (0.15, 0, 0)})  # fmt: skip
    for name, m, z in (("slider", 0.4, 0.0), ("nut", 0.3, 0.2)):
        mech.add_rigid(name, mass=m, inertia=(1e-3,) * 3, at=(0.4, 0, z))
    mech.universal("pin", "crank.a", "rod.a", axis1=Z, axis2=Y)
    mech.spherical("wrist", "rod.b", "slider")
    mech.prismatic("guide", "ground", "slider", axis=X)
    mech.screw("thread", "slider", "nut", axis=Z, pitch=0.1)
    mech.motor("motor", "main", lambda t, angle, rate: 2.0 * (10.0 - rate) + 0.2 * np.sin(5 * t))
    mech.friction("bearing", "main", mu=0.05, radius=0.02, transition_speed=0.5)
    mech.friction("shoes", "guide", mu=0.2, transition_speed=0.2, viscous=0.1, static=1.3,
                  stribeck_speed=0.5)  # fmt: skip
    damping = (0, 0, 1.0, 0, 0, 0.01)
    mech.bushing("rubber", "slider", "nut", stiffness=40.0 * np.eye(6)[2], damping=damping)
    return mech


def test_the_power_balance_closes_with_friction_motors_and_screws():
    """Energy gained + lost - driven = 0 to 1e-8, by a method of eighth order."""
    sol = simulate(spatial_crank(), t_end=1.0, dt=0.02, method="dop853", rtol=1e-11, atol=1e-12)
    e = sol.energy
    turnover = np.abs(e.drives).max()
    assert e.damping[-1] > 0.2 * turnover > 0.1
    assert np.abs(e.balance).max() < 1e-8 * turnover
    coarse = simulate(spatial_crank(), t_end=1.0, dt=5e-4)
    assert rom.audit(coarse).ok, rom.audit(coarse)
    assert_allclose(coarse.q[-1], sol.q[-1], atol=1e-3)
    assert_allclose(coarse.energy.damping[-1], e.damping[-1], rtol=1e-3)


def test_the_power_balance_closes_with_a_prescribed_motion():
    mech = spatial_crank()
    mech.motors.clear()
    mech.drive("drive", "main", lambda t: 10 * t, rate=lambda t: 10.0, acceleration=lambda t: 0.0)
    sol = simulate(mech, t_end=1.0, dt=0.02, method="dop853", rtol=1e-11, atol=1e-12)
    assert np.abs(sol.energy.balance).max() < 1e-8 * np.abs(sol.energy.drives).max()
    assert sol.energy.damping[-1] > 0.1


@pytest.mark.parametrize("method", METHODS)
def test_a_mass_between_stops_bounces_with_the_speed_and_time_of_the_closed_form(method):
    """Linear stops without loss: half a period pi sqrt(m / k) in each, free flight between."""
    m, k, v0 = 2.0, 5e4, 1.0
    mech = block(mass=m, speed=v0, gravity=0.0)
    mech.stop("buffers", "guide", Impact(k, exponent=1.0), lower=-0.05, upper=0.1)
    period = 2 * np.pi * np.sqrt(m / k) + 2 * 0.15 / v0
    sol = simulate(mech, t_end=3 * period, dt=2e-5 if method != "dop853" else 1e-3, method=method)
    x = sol.position("block")[:, 0]
    deep = v0 * np.sqrt(m / k)
    assert_allclose([x.max(), x.min()], [0.1 + deep, -0.05 - deep], atol=1e-4)
    assert_allclose(sol.velocity("block")[-1, 0], v0, atol=1e-4)
    assert_allclose(x[-1], 0.0, atol=1e-4)
    stored = 0.5 * k * np.maximum(np.maximum(x - 0.1, -0.05 - x), 0.0) ** 2
    assert_allclose(sol.energy.strain, stored, atol=1e-12)
    assert np.abs(sol.energy.balance).max() < 1e-5 * m * v0**2
    assert np.abs(sol.energy.damping).max() < 1e-9


def test_a_stop_on_an_angle_acts_after_whole_turns():
    mech = wheel(J=0.5, omega=10.0)
    law = Impact(1e4, exponent=1.0, restitution=0.5, impact_speed=10.0)
    mech.stop("pawl", "axle", law, upper=15.0)
    sol = simulate(mech, t_end=2.0, dt=1e-4)
    assert 15.0 < sol.base[:, 0].max() < 15.2
    assert_allclose(sol.omega("wheel")[-1, 2], -5.0, rtol=1e-3)
    assert_allclose(sol.energy.damping[-1], 0.25 * (10.0**2 - 5.0**2), rtol=2e-3)
    assert np.abs(sol.energy.balance).max() < 1e-3 * sol.energy.kinetic.max()


def joints_of_three_kinds():
    mech = wheel()
    mech.spherical("ball", "ground", "wheel")
    mech.cylindrical("tube", "ground", "wheel", axis=Z)
    return (mech,)


test_wrong_joint_forces_are_refused_by_name = refused_on(joints_of_three_kinds, {
    "motor on a ball": (lambda m: m.motor("s", "ball", np.sin), "'ball' is spherical"),
    "law that must compile": (lambda m: m.motor("s", "axle", lambda t, x, v: {}.get(t),
                                                compiled=True), "cannot be compiled"),
    "pin without radius": (lambda m: m.friction("s", "axle", mu=0.1, transition_speed=1), "radius"),
    "way with radius": (lambda m: m.friction("s", "tube", coordinate="way", radius=1, mu=0.1,
                                             transition_speed=1), "leave radius out"),
    "static alone": (lambda m: m.friction("s", "axle", static=2, transition_speed=1), "stribeck"),
    "stop without limit": (lambda m: m.stop("s", "axle", Impact(1.0)), "no limit"),
    "stop the wrong way": (lambda m: m.stop("s", "axle", Impact(1.0), lower=1, upper=0), "at most"),
    "restitution alone": (lambda m: Impact(1.0, restitution=0.5), "impact speed"),
    "restitution twice": (lambda m: Impact(1.0, damping=1, restitution=0.5, impact_speed=1),
                          "give only one"),
})  # fmt: skip


def test_laws_that_return_nonsense_are_named():
    mech = wheel()
    mech.motor("motor", "axle", lambda t, x, v: "full", compiled=False)
    refuses(ConfigError, "law of motor 'motor' returned 'full'", simulate, mech, t_end=0.1, dt=1e-2)
    mech = wheel()
    mech.motor("motor", "axle", lambda t, x, v: np.nan if t > 0.05 else 1.0, compiled=False)
    with pytest.raises(SolverError, match=r"'motor' gives nan at t = 0\.06") as caught:
        simulate(mech, t_end=0.1, dt=1e-2)
    assert caught.value.solution.t[-1] == pytest.approx(0.05)
