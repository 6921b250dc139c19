"""Screws, gears, rods, points on lines and planes, balls and wheels that roll."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.mbs.mechanisms import prepared, random_pose, random_state, simulate_quietly, two_soft
from cases.mbs.parts import X, Y, Z, boxed, on_axle, on_guide, refused_on
from cases.mbs.tangents import GRAVITY, check_tangents, constraint_derivatives
from cases.refusals import refuses
from rom.errors import ModelError, SolverError
from rom.mbs.equations.equations import evaluate, linearize_constraints
from rom.mbs.kernels.system import ROLL

AXIS, ACROSS = np.array([1.0, 2.0, 2.0]) / 3, np.array([2.0, 1.0, -2.0]) / 3
BALL = (0.2, 0.2, 0.2)


@pytest.mark.parametrize("seed", range(3))
def test_gradient_and_convective_term_are_derivatives(seed):
    """dG/dt = 0 along every motion: the gradient times the velocity is the rate of the residual."""
    rng = np.random.default_rng(seed)
    mech, one, two = two_soft(rng, GRAVITY)
    box = mech.add_rigid("box", mass=2.0, inertia=(1.0, 1.5, 2.0),
                         markers={"a": (0.3, 0.2, -0.1)}, **random_pose(rng))  # fmt: skip
    m1, m2, m3 = one.marker("a"), two.marker("b"), box.marker("a")
    mech.screw("screw", m1, m2, axis=AXIS, pitch=0.4)
    mech.planar("planar", m2, m3, normal=ACROSS)
    mech.point_on_line("line", m3, one.marker("b"), axis=AXIS)
    mech.point_on_plane("plane", mech.ground.marker((0, 1, 1)), m1, normal=Z)
    mech.distance("rod", two.marker("a"), m3)
    mech.rolling("ball", m1, m3, normal=ACROSS, radius=0.3)
    mech.rolling("wheel", m2, one.marker("b"), normal=AXIS, radius=0.4, axis=ACROSS)
    mech.gear("pinion", "screw", "planar", ratio=-0.7)
    mech.gear("rack", "screw", "line", ratio=0.3, coordinate1="way")
    packed, W = prepared(mech)
    s, (q, v, _, _) = packed.system, random_state(rng, packed)
    rolls = s.rows.kind == ROLL
    evaluate(s, W, q, v)
    W.base[:] = W.x
    G, convective = constraint_derivatives(packed, W, q, v)
    linearize_constraints(s, W, q, v)
    assert_allclose(W.G[~rolls], G[~rolls], atol=2e-8 * np.abs(G).max())
    assert_allclose(W.value[rolls], (W.G @ v)[rolls], atol=1e-12 * np.abs(v).max())
    assert_allclose(W.gamma, convective, atol=1e-7 * np.abs(convective).max())
    assert np.abs(W.G).max(axis=1).min() > 0.01


STIFF = {  # kind -> what joins places of two flexible bodies
    "distance": lambda m, a, b, *_: m.distance("rod", a, b),
    "roll": lambda m, a, b, *_: m.rolling("roll", a, b, normal=AXIS, radius=0.3),
    "wheel": lambda m, a, b, *_: m.rolling("roll", a, b, normal=AXIS, radius=0.3, axis=ACROSS),
    "line": lambda m, a, b, *_: m.point_on_line("line", a, b, axis=AXIS),
    "rack": lambda m, a, b, c, d: (
        m.point_on_line("line", a, b, axis=AXIS), m.point_on_line("other", c, d, axis=ACROSS),
        m.gear("rack", "line", "other", ratio=0.3)),
}  # fmt: skip


@pytest.mark.parametrize("kind", STIFF)
def test_constraint_stiffness_is_the_derivative_of_the_constraint_forces(kind):
    rng = np.random.default_rng(7)
    mech, one, two = two_soft(rng, GRAVITY)
    STIFF[kind](mech, one.marker("a"), two.marker("b"), two.marker("a"), one.marker("b"))
    packed, W = prepared(mech)
    packed.system.markers.twist[:] *= 1e-3
    check_tangents(packed, W, random_state(rng, packed), np.eye(packed.v.size), 1e-6)


def gear_pair(ratio, torque, speed=0.0):
    """Two wheels on parallel axles a metre apart, the first one driven by a torque."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    for name, x, J, turns in (("pinion", 0.0, 0.02, 1.0), ("wheel", 1.0, 0.3, ratio)):
        on_axle(mech, name, inertia=(J, J, J), at=(x, 0, 0), axle=f"axle of {name}",
                omega=(0, 0, turns * speed))  # fmt: skip
    mech.gear("teeth", "axle of pinion", "axle of wheel", ratio=ratio)
    mech.torque("engine", mech.parts["pinion"].marker((0, 0, 0)), (0, 0, torque))
    return mech


def test_a_gear_pair_accelerates_the_sum_of_its_inertias():
    """Alpha = T / (J1 + i^2 J2); the teeth turn the wheel with i J2 alpha. Ten turns and more."""
    ratio, torque = -0.37, 5.0
    sol = rom.simulate(gear_pair(ratio, torque), t_end=2.0, dt=2e-3)
    alpha = torque / (0.02 + ratio**2 * 0.3)
    assert_allclose(sol.omega("pinion")[:, 2], alpha * sol.t, rtol=1e-9, atol=1e-9)
    assert_allclose(sol.omega("wheel")[:, 2], ratio * alpha * sol.t, rtol=1e-9, atol=1e-9)
    assert 0.5 * alpha * sol.t[-1] ** 2 > 20 * np.pi
    assert_allclose(sol.reaction("teeth")[-1, 5], 0.3 * ratio * alpha, rtol=1e-8)
    assert_allclose(sol.base[-1], sol.base[-1, 1] * np.array([ratio, 1.0]), rtol=1e-9)


@pytest.mark.parametrize("method", ["generalized-alpha", "bdf"])
def test_a_gear_that_turns_by_half_a_turn_a_step_is_named_with_the_step_it_takes(method):
    """A wheel held at 1 rad/s drives one of 97 rad/s: below pi / 97 s all is well."""
    mech = gear_pair(97.0, 0.0, speed=1.0)
    mech.drive("speed", "axle of pinion", lambda t: t, rate=lambda t: 1.0)
    fits = rom.simulate(mech, t_end=1.0, dt=0.96 * np.pi / 97, method=method)
    assert_allclose(fits.base[-1], [97.0, 1.0], rtol=1e-6)
    with pytest.raises(SolverError, match=r"gap is .* in 'teeth'") as caught:
        rom.simulate(mech, t_end=1.0, dt=0.04, method=method)
    assert "Body 'wheel' turns by 3.88 rad a step against 'ground'" in caught.value.hint
    assert "take steps below 0.0324 s" in caught.value.hint


def test_a_gear_that_turns_slowly_is_not_blamed_for_a_force_that_breaks_down():
    mech = gear_pair(3.0, 0.0, speed=1.0)
    mech.motor("brake", "axle of pinion", lambda t, x, v: 0.0 if t < 0.1 else np.nan)
    with pytest.raises(SolverError, match="the law of 'brake' gives no finite number") as caught:
        rom.simulate(mech, t_end=1.0, dt=0.04)
    assert "Take a smaller step than 0.04 s" in caught.value.hint
    assert "turns" not in caught.value.hint


@pytest.mark.parametrize("ratio", [0.05, -0.2])
def test_a_pinion_drives_its_rack(ratio):
    """Way = ratio times angle: (J + m ratio^2) alpha = T, and the rack is pushed by m a."""
    J, m, torque = 0.02, 3.0, 0.7
    mech = rom.Mechanism(gravity=(0, 0, 0))
    pinion = on_axle(mech, "pinion", inertia=(J, J, J))
    on_guide(mech, "rack", mass=m, at=(0, -0.05, 0), base=(0, -0.05, 0), guide="rail")
    mech.gear("teeth", "axle", "rail", ratio=ratio)
    mech.torque("engine", pinion, (0, 0, torque))
    sol = rom.simulate(mech, t_end=1.0, dt=1e-2)
    alpha = torque / (J + m * ratio**2)
    assert_allclose(sol.omega("pinion")[:, 2], alpha * sol.t, rtol=1e-9, atol=1e-9)
    assert_allclose(sol.velocity("rack")[:, 0], ratio * alpha * sol.t, rtol=1e-9, atol=1e-9)
    assert_allclose(sol.reaction("teeth")[-1, 0], m * ratio * alpha, rtol=1e-8)


@pytest.mark.parametrize("pitch", [0.02, -0.02])
def test_a_screw_turns_torque_into_thrust(pitch):
    """Right- and left-hand: (J + m (p / 2 pi)^2) alpha = T; so many turns, so many pitches."""
    J, m, torque = 2e-3, 4.0, 0.5
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_rigid("bolt", mass=m, inertia=(J, J, J), at=(0, 0, 0))
    mech.screw("thread", "ground", "bolt", axis=X, pitch=pitch)
    mech.torque("spanner", "bolt", torque * X)
    sol = rom.simulate(mech, t_end=1.0, dt=1e-2)
    alpha = torque / (J + m * (pitch / (2 * np.pi)) ** 2)
    assert_allclose(sol.omega("bolt")[:, 0], alpha * sol.t, rtol=1e-9, atol=1e-8)
    turns = 0.5 * alpha * sol.t**2 / (2 * np.pi)
    assert_allclose(sol.position("bolt")[:, 0], pitch * turns, atol=1e-9)
    assert_allclose(sol.reaction("thread")[-1, 0], m * pitch / (2 * np.pi) * alpha, rtol=1e-7)
    assert abs(turns[-1]) > 10
    assert rom.audit(sol).ok, rom.audit(sol)


def test_a_planetary_gear_turns_as_willis_says():
    """Ring held, sun driven: the carrier turns with z_sun / (z_sun + z_ring) of the sun."""
    sun_teeth, ring_teeth = 20, 64
    planet_teeth = (ring_teeth - sun_teeth) // 2
    mech = rom.Mechanism(gravity=(0, 0, 0))
    for name, x in (("sun", 0.0), ("carrier", 0.0), ("planet", 0.3)):
        mech.add_rigid(name, mass=1.0, inertia=BALL, at=(x, 0, 0), markers={"p": (0.3, 0, 0)})
    mech.revolute("arm", "ground", "carrier", axis=Z)
    mech.revolute("sun axle", "carrier", "sun", axis=Z)
    mech.revolute("pin", "carrier.p", "planet", axis=Z)
    # seen from the carrier the ring, which is the ground, turns backwards
    mech.gear("ring", "arm", "pin", ratio=-ring_teeth / planet_teeth)
    mech.gear("teeth", "sun axle", "pin", ratio=-sun_teeth / planet_teeth)
    mech.torque("engine", "sun", (0, 0, 1.0))
    sol = rom.simulate(mech, t_end=2.0, dt=2e-3)
    share = sun_teeth / (sun_teeth + ring_teeth)
    sun = sol.omega("sun")[-1, 2]
    assert sun > 1.0
    assert_allclose(sol.omega("carrier")[-1, 2], share * sun, rtol=1e-8)


@pytest.mark.parametrize("method", ["generalized-alpha", "dop853"])
@pytest.mark.parametrize(("axis", "J"), [(None, 2 / 5), (Y, 1 / 2)])
def test_what_rolls_down_a_slope_has_the_acceleration_of_the_closed_form(axis, J, method):
    """A = g sin / (1 + J / (m r^2)): 5/7 for the ball, 2/3 for the disc."""
    mech = rom.Mechanism(gravity=(9.81 * np.sin(0.3), 0, -9.81 * np.cos(0.3)))
    mech.add_rigid("body", mass=1.0, inertia=(J * 0.2**2,) * 3, at=(0, 0, 0.2))
    mech.rolling("roll", "ground", "body", normal=Z, radius=0.2, axis=axis)
    sol = rom.simulate(mech, t_end=1.0, dt=1e-3, method=method)
    a = 9.81 * np.sin(0.3) / (1 + J)
    assert_allclose(sol.position("body")[:, 0], 0.5 * a * sol.t**2, atol=1e-8)
    assert_allclose(sol.omega("body")[:, 1], a / 0.2 * sol.t, atol=1e-7)
    friction = sol.reaction("roll")[-1]
    assert_allclose(friction[0], -J * a, rtol=1e-6)
    assert_allclose(friction[2], 9.81 * np.cos(0.3), rtol=1e-6)
    assert rom.audit(sol).ok, rom.audit(sol)
    assert "largest slip of what rolls / speed" in [row.quantity for row in rom.audit(sol).rows]


@pytest.mark.once
@pytest.mark.parametrize("method", ["generalized-alpha", "dop853"])
def test_a_ball_on_a_turntable_circles_with_two_sevenths_of_its_speed(method):
    """The path of the centre is a circle run through with 2/7 of the speed of the table."""
    speed, radius = 3.0, 0.1
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    J = 0.4 * radius**2
    table = on_axle(mech, "table", inertia=(1, 1, 1))
    ball = mech.add_rigid("ball", mass=1.0, inertia=(J, J, J), at=(0.5, 0, radius),
                          velocity=(0.2, 0.3, 0))  # fmt: skip
    mech.rolling("roll", table, ball.marker((0, 0, 0)), normal=Z, radius=radius)
    mech.drive("motor", "axle", lambda t: speed * t)
    sol = rom.simulate(mech, t_end=4.0, dt=2e-3, method=method, assemble=True)
    w, v0, x0 = 2 / 7 * speed, sol.velocity("ball")[0], sol.position("ball")[0]
    centre = x0[:2] + np.array([-v0[1], v0[0]]) / w
    arm = x0[:2] - centre
    c, s = np.cos(w * sol.t), np.sin(w * sol.t)
    circle = centre + np.column_stack([c * arm[0] - s * arm[1], s * arm[0] + c * arm[1]])
    if method != "dop853":  # rows of velocity enter Newton's iteration in the right measure
        assert sol.statistics["iterations"] < 4 * sol.statistics["steps"]
    error = np.abs(sol.position("ball")[:, :2] - circle).max()
    assert error < (1e-7 if method == "dop853" else 1e-3)


def test_a_thrown_hoop_wobbles_without_loss_and_touches_the_plane():
    mech = rom.Mechanism()
    J = 0.5 * 0.3**2
    tilt = np.array([np.cos(0.1), np.sin(0.1), 0, 0])
    mech.add_rigid("hoop", mass=1.0, inertia=(J, 2 * J, J), orientation=tilt,
                   at=(0, 0, 0.3 * np.cos(0.2)), velocity=(2.0, 0, 0), omega=(0.2, 6.0, 0.5),
                   markers={"o": (0, 0, 0)})  # fmt: skip
    axle = np.array([0, np.cos(0.2), np.sin(0.2)])
    mech.rolling("roll", "ground", "hoop.o", normal=Z, radius=0.3, axis=axle)
    sol = rom.simulate(mech, t_end=2.0, dt=0.01, method="dop853", assemble=True)
    assert np.abs(sol.energy.balance).max() < 1e-8 * sol.energy.kinetic.max()
    s = np.einsum("tij,j->ti", sol.axes("hoop", "o"), [0, 1.0, 0])
    assert np.ptp(s[:, 2]) > 0.05
    assert_allclose(sol.position("hoop")[:, 2], 0.3 * np.sqrt(1 - s[:, 2] ** 2), atol=1e-9)
    slow = rom.simulate(mech, t_end=2.0, dt=1e-3, assemble=True)
    assert_allclose(slow.position("hoop")[-1], sol.position("hoop")[-1], atol=1e-4)


def jointed():
    mech, *ends = boxed()
    mech.revolute("hinge", *ends, axis=Z)
    mech.spherical("ball", *ends)
    mech.cylindrical("tube", *ends, axis=Z)
    return mech, *ends


test_wrong_connections_are_refused_by_name = refused_on(jointed, {
    "screw without pitch": (lambda m, a, b: m.screw("s", a, b, axis=Z, pitch=0.0), "pitch = 0"),
    "rod of length zero": (lambda m, a, b: m.distance("s", a, b), "coincide"),
    "flat wheel": (lambda m, a, b: m.rolling("s", a, b, normal=Z, radius=1, axis=Z), "lies flat"),
    "gear on itself": (lambda m, a, b: m.gear("s", "hinge", "hinge", ratio=2), "with itself"),
    "gear on nothing": (lambda m, a, b: m.gear("s", "hinge", "door", ratio=2), "no joint 'door'"),
    "gear that locks": (lambda m, a, b: m.gear("s", "hinge", "tube", ratio=0), "ratio = 0"),
    "way of a hinge": (lambda m, a, b: m.gear("s", "hinge", "tube", ratio=1, coordinate1="way"),
                       "no coordinate 'way'"),
})  # fmt: skip


def test_gears_that_contradict_each_other_are_refused():
    mech = gear_pair(2.0, 1.0)
    mech.gear("other teeth", "axle of pinion", "axle of wheel", ratio=3.0)
    mech.drive("motor", "axle of pinion", lambda t: t)
    refuses(ModelError, "misses", simulate_quietly, mech, t_end=0.1, dt=1e-3)
