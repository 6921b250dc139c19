"""Closed loops: few and many constraints that repeat or contradict others; states of others."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import null_space

import rom
from cases.long import few
from cases.mbs.mechanisms import prepared, random_body, simulate_quietly
from cases.mbs.parts import X, Y, Z, on_axle, slender
from cases.refusals import refuses
from rom.errors import ConfigError, ModelError, RomWarning
from rom.mbs.equations import equations, packing

pytestmark = pytest.mark.filterwarnings("ignore:.*constraints repeat others")
# crank, coupler, rocker, distance of the pivots [m]; start angle [rad], speed [rad/s]
A, B, C, D = 0.1, 0.4, 0.3, 0.35
START, SPEED = 0.6, 20.0
GRAVITY = (3.0, 0.0, -9.81)
LOOPS = 7  # 126 coordinates: the fewest in blocks are 100


def elbow(phi):
    """Position of both crank pins (n, 2) of the four-bar: intersection of two circles."""
    pin = A * np.stack([np.cos(phi), np.sin(phi)], axis=-1)
    reach = np.array([D, 0.0]) - pin
    far = np.linalg.norm(reach, axis=-1, keepdims=True)
    along = (far**2 + B**2 - C**2) / (2 * far)
    across = np.stack([-reach[..., 1], reach[..., 0]], axis=-1) / far
    return pin, pin + along * reach / far + np.sqrt(B**2 - along**2) * across


def four_bar(*, repeated=True):
    """Four hinges, or hinges, a ball and a Cardan joint that only just hold it in its plane."""
    mech = rom.Mechanism(gravity=(0, -9.81, 0))
    pin, knee = elbow(np.array(START))
    crank = slender(mech, "crank", (0, 0), pin, 0.4)
    coupler = slender(mech, "coupler", pin, knee, 1.0)
    rocker = slender(mech, "rocker", (D, 0), knee, 0.8)
    mech.revolute("O", mech.ground.marker((0, 0, 0)), crank.marker("a"), axis=Z)
    if repeated:
        mech.revolute("A", crank.marker("b"), coupler.marker("a"), axis=Z)
        mech.revolute("B", coupler.marker("b"), rocker.marker("b"), axis=Z)
    else:
        mech.universal("A", crank.marker("b"), coupler.marker("a"), axis1=Z, axis2=X)
        mech.spherical("B", coupler.marker("b"), rocker.marker("b"))
    mech.revolute("C", mech.ground.marker((D, 0, 0)), rocker.marker("a"), axis=Z)
    mech.drive("motor", "O", lambda t: SPEED * t)
    return mech


def test_four_bar_of_hinges_warns_by_name_and_moves_as_its_closed_form():
    with pytest.warns(RomWarning, match="3 of 21 constraints .* joints O, A, B, C share"):
        sol = rom.simulate(four_bar(), t_end=0.4, dt=1e-3)
    pin, knee = elbow(START + SPEED * sol.t)
    assert_allclose(sol.position("crank", "b")[:, :2], pin, atol=1e-9)
    assert_allclose(sol.position("rocker", "b")[:, :2], knee, atol=1e-9)
    assert np.ptp(knee, axis=0).min() > 0.05
    assert sol.statistics["rank"] == 18
    assert sol.statistics["redundant"] == 3


def test_loads_of_the_repeated_four_bar_are_those_of_the_one_that_repeats_nothing():
    """In the plane equilibrium decides; out of it the least loads are none at all."""
    repeated = simulate_quietly(four_bar(), t_end=0.2, dt=1e-3)
    single = rom.simulate(four_bar(repeated=False), t_end=0.2, dt=1e-3)
    assert single.statistics["redundant"] == 0
    for joint in "OABC":
        force, wanted = repeated.reaction(joint), single.reaction(joint)
        size = np.abs(wanted[:, :3]).max()
        assert_allclose(force[:, :2], wanted[:, :2], atol=1e-6 * size)
        assert np.abs(force[:, 2:5]).max() < 1e-9 * size
    torque = repeated.reaction("motor")[:, 5]
    assert_allclose(torque, single.reaction("motor")[:, 5], atol=1e-6 * np.abs(torque).max())


@pytest.mark.parametrize("method", ["generalized-alpha", "dop853"])
def test_multipliers_stay_those_of_least_norm_while_the_hinges_tumble(method):
    """They have no share in the loads that the hinges could exchange among themselves."""
    mech = rom.Mechanism(gravity=(0, 0, 0))  # frame and leaf tumble across the line of the hinges
    points = {"low": (0, 0, -0.8), "high": (0, 0, 0.8)}
    frame = mech.add_rigid("frame", mass=30.0, inertia=(9.0, 8.0, 4.0), at=(0, 0, 0),
                           markers=points, omega=(2.0, 1.0, 0.5))  # fmt: skip
    leaf = mech.add_rigid("leaf", mass=20.0, inertia=(3.0, 2.0, 1.2), at=(0.4, 0, 0.1),
                          omega=(2.0, 1.0, 3.0))  # fmt: skip
    for name, at in points.items():
        end = leaf.marker(np.array(at) - [0.4, 0, 0.1])
        mech.revolute(name, frame.marker(name), end, axis=Z)
    sol = simulate_quietly(mech, t_end=1.0, dt=2e-3, method=method, save_every=50)
    packed, W = prepared(mech)
    for q, v, lam in zip(sol.q, sol.v, sol.lam, strict=True):
        equations.linearize_constraints(packed.system, W, q, v)
        among = null_space(W.G.T, rcond=1e-8)
        assert among.shape[1] == 5
        assert np.abs(among.T @ lam).max() < 1e-6 * np.abs(lam).max()
    turned = sol.axes("frame", "low")[-1] @ Z
    assert turned @ Z < 0.5


def hinge_and_ball(*drives):
    """A box on a hinge with every given drive, and a flexible body at rest on a ball joint."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    box = mech.add_rigid("box", mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0))
    body = random_body(np.random.default_rng(1))
    bar = mech.add_flexible("bar", body, at=X - np.asarray(body.markers["a"].point))
    mech.revolute("hinge", mech.ground.marker((0, 0, 0)), box.marker((0, 0, 0)), axis=Z)
    mech.spherical("ball", box.marker(X), bar.marker("a"))
    for k, function in enumerate(drives):
        mech.drive(f"motor {k}", "hinge", function)
    return mech


@pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")
@pytest.mark.parametrize(
    ("drives", "words"),
    [((lambda t: t, lambda t: 2 * t), r"'motor [01]' misses 0\.5"),
     ((lambda t: 0.0, lambda t: 0.1), r"'(motor [01]|hinge)' stays open by")],
)  # fmt: skip
def test_drives_of_different_speed_or_position_are_refused_by_name(drives, words):
    """Rows of the ball joint are at rest: their round-off must not hide the drives."""
    refuses(ModelError, words, rom.simulate, hinge_and_ball(*drives), t_end=0.01, dt=1e-3)


def test_drives_that_part_on_the_way_are_seen_by_the_audit():
    sol = simulate_quietly(hinge_and_ball(lambda t: t**2, lambda t: 2 * t**2), t_end=0.05, dt=1e-3)
    assert [r.quantity for r in rom.audit(sol).failures] == ["largest gap in a joint / size"]


def coil():
    mech = rom.Mechanism(gravity=(0, 0, 0))
    on_axle(mech, omega=(0, 0, 40.0))
    mech.rotational_spring("coil", "axle", stiffness=2.0)
    return mech


@pytest.mark.parametrize("build", [hinge_and_ball, coil])
def test_a_state_of_the_same_bodies_with_other_joints_is_refused(build):
    """Compiled code would write beyond the end of its arrays."""
    joined = build()
    free = rom.Mechanism(gravity=(0, 0, 0))
    free.parts.update(joined.parts)
    for one, other in ((joined, free), (free, joined)):
        state = rom.simulate(one, t_end=0.01, dt=1e-3).final
        with pytest.raises(ConfigError, match=r"the state has \d+ coordinates.* constraints; this"):
            rom.simulate(other, t_end=0.02, dt=1e-3, state=state)


def test_a_state_without_the_coil_is_refused():
    bare = coil()
    bare.turns.clear()
    state = rom.simulate(bare, t_end=0.01, dt=1e-3).final
    words = "0 followed joint coordinates and remembered numbers; this mechanism has 1"
    refuses(ConfigError, words, rom.simulate, coil(), t_end=0.02, dt=1e-3, state=state)


def ladder(n, *, repeated=True):
    """Parallelograms that hang from each other; all hinges, or of every loop one joint less bound.

    A hinge that closes a loop repeats three constraints; a point on a line beside two hinges and
    a ball repeats none.
    """
    mech = rom.Mechanism(gravity=GRAVITY)
    above = [mech.ground.marker((x, 0, 0)) for x in (0, 1)]
    for k in range(n):
        rung = mech.add_rigid(f"rung {k}", mass=1.0, inertia=(0.1,) * 3, at=(0.5, 0, -k - 1.0))
        for side, x in enumerate((0.0, 1.0)):
            rail = mech.add_rigid(f"rail {k}.{side}", mass=1.0, inertia=(0.1,) * 3,
                                  at=(x, 0, -k - 0.5))  # fmt: skip
            foot, end = rail.marker((0, 0, -0.5)), rung.marker((side - 0.5, 0, 0))
            mech.revolute(f"up {k}.{side}", above[side], rail.marker((0, 0, 0.5)), axis=(0, 1, 0))
            if side == 0 or repeated:
                mech.revolute(f"down {k}.{side}", foot, end, axis=(0, 1, 0))
            else:
                mech.point_on_line(f"down {k}.{side}", end, foot, axis=(0, 1, 0))
        mech.rotational_spring(f"damper {k}", f"up {k}.0", stiffness=2.0, damping=0.1)
        above = [rung.marker((x, 0, 0)) for x in (-0.5, 0.5)]
    return mech


METHODS = {
    "alpha": {"dt": 2e-3},
    "steps chosen": {"rtol": 1e-6},
    "stabilised": {"dt": 2e-3, "stabilised": True},
    "bdf": {"dt": 2e-3, "method": "bdf", "order": 3},
    "dop853": {"dt": 0.05, "method": "dop853", "rtol": 1e-9, "atol": 1e-11},
}


@pytest.mark.parametrize("method", few(3, METHODS))
def test_blocks_move_and_carry_as_whole_matrices(method, monkeypatch):
    options = {"t_end": 0.3, **METHODS[method]}
    words = "21 of 140 constraints repeat others; joints up 0.0, .* and 20 more"
    with pytest.warns(RomWarning, match=words):
        blocks = rom.simulate(ladder(LOOPS), **options)
    assert blocks.packed.by_blocks and blocks.statistics["redundant"] == 3 * LOOPS
    monkeypatch.setattr(packing, "MAX_SHARING_WHOLE", 10_000)
    other = rom.simulate(ladder(LOOPS), **options)
    assert not other.packed.by_blocks and other.statistics["rank"] == blocks.statistics["rank"]
    where = -1 if method == "steps chosen" else slice(None)
    tolerance = 1e-5 if method == "steps chosen" else 1e-8
    assert_allclose(blocks.q[where], other.q[where], atol=tolerance)
    assert_allclose(blocks.v[where], other.v[where], atol=100 * tolerance)
    assert_allclose(blocks.lam[where], other.lam[where], atol=1e3 * tolerance)
    assert rom.audit(blocks).ok


def test_many_loops_move_as_those_that_repeat_nothing():
    options = {"t_end": 0.5, "dt": 2e-3}
    repeated = rom.simulate(ladder(20), **options)
    other = rom.simulate(ladder(20, repeated=False), **options)
    assert repeated.statistics["redundant"] == 60 and other.statistics["redundant"] == 0
    last = repeated.position("rung 19")
    assert np.ptp(last[:, 0]) > 0.1
    assert_allclose(last, other.position("rung 19"), atol=1e-9)
    assert np.abs(repeated.gap).max() < 1e-9


def test_statics_and_small_motions_are_those_of_joints_that_repeat_nothing():
    here, there = (rom.equilibrium(ladder(20, repeated=repeated)) for repeated in (True, False))
    assert_allclose(here.q, there.q, atol=1e-9)
    found = rom.linearize(ladder(20), here, n=4).frequencies
    exact = rom.linearize(ladder(20, repeated=False), there, n=4).frequencies
    assert_allclose(found, exact, rtol=1e-8)


@pytest.mark.parametrize("others", [0, LOOPS])
def test_a_start_in_line_is_refused(others):
    """A parallelogram folded flat, alone or among others: it could go on either way."""
    mech = ladder(others) if others else rom.Mechanism(gravity=(0, 0, 0))
    ends = {"low": -X / 2, "high": X / 2, "far": 1.5 * X}
    for name, x in (("arm", 5.5), ("far", 7.5), ("bar", 6.5)):
        mech.add_rigid(name, mass=1.0, inertia=(0.1,) * 3, at=(x, 0, 0), markers=ends)
    mech.revolute("a", mech.ground.marker((5.0, 0, 0)), "arm.low", axis=Y)
    mech.revolute("b", mech.ground.marker((7.0, 0, 0)), "far.low", axis=Y)
    mech.revolute("c", "arm.high", "bar.low", axis=Y)
    mech.revolute("d", "far.high", "bar.far", axis=Y)
    refuses(ModelError, "singular position", rom.simulate, mech, t_end=0.1, dt=1e-3)


def test_joints_that_contradict_each_other_are_named_in_large_mechanisms():
    mech = ladder(LOOPS)
    last = mech.parts[f"rung {LOOPS - 1}"]
    wall = mech.ground.marker((2.0, 0.01, -float(LOOPS)))
    mech.revolute("wall", wall, last.marker((1.5, 0, 0)), axis=(0, 1, 0))
    refuses(ModelError, "cannot be assembled", rom.simulate, mech, t_end=0.1, dt=1e-3)


def train(n, slope=0.2, apart=0.0):
    """Wheels of a train that roll down a slope, their axles in a row of bars.

    Every third axle carries a wheel on either side, too: what holds all three upright repeats
    itself.
    """
    mech = rom.Mechanism(gravity=(9.81 * np.sin(slope), 0, -9.81 * np.cos(slope)))
    floor, behind = mech.ground.marker((0, 0, 0)), None
    for k in range(n):
        wheel = mech.add_rigid(f"wheel {k}", mass=2.0, inertia=(0.05, 0.1, 0.05), at=(k, 0, 0.3))
        mech.rolling(f"roll {k}", floor, wheel.marker((0, 0, 0)), normal=Z, radius=0.3, axis=Y)
        bar = mech.add_rigid(f"bar {k}", mass=1.0, inertia=(0.1,) * 3, at=(k + 0.5 + apart, 0, 0.3))
        mech.revolute(f"axle {k}", bar.marker((-0.5, 0, 0)), wheel.marker((0, 0, 0)), axis=Y)
        if behind is not None:
            mech.spherical(f"link {k}", behind.marker((0.5, 0, 0)), bar.marker((-0.5, 0, 0)))
        for y in (-1, 1) if k % 3 == 2 else ():
            at = {"at": (k, y, 0.3), "inertia": (0.05, 0.1, 0.05)}
            centre = mech.add_rigid(f"wheel {k}.{y}", mass=2.0, **at).marker((0, 0, 0))
            mech.rolling(f"roll {k}.{y}", floor, centre, normal=Z, radius=0.3, axis=Y)
            mech.revolute(f"axle {k}.{y}", bar.marker((-0.5, y, 0)), centre, axis=(0, 1, 0))
        behind = bar
    end = behind.marker((0.5, 0, 0))
    mech.point_on_plane("end", mech.ground.marker((0, 0, 0.3)), end, normal=Z)
    return mech


def test_many_wheels_roll_by_blocks_as_by_whole_matrices(monkeypatch):
    """Down the slope with g sin(a) (sum of masses) / (sum of masses + J / r^2)."""
    options = {"t_end": 0.2, "dt": 1e-3}
    blocks = rom.simulate(train(12), **options)
    monkeypatch.setattr(packing, "MAX_SHARING_WHOLE", 10_000)
    other = rom.simulate(train(12), **options)
    assert blocks.packed.by_blocks and blocks.statistics["redundant"] > 0
    assert not other.packed.by_blocks and other.statistics["rank"] == blocks.statistics["rank"]
    assert_allclose(blocks.q, other.q, atol=1e-9)
    assert_allclose(blocks.lam, other.lam, atol=1e-4)
    mass, rolling = 20 * 2.0 + 12 * 1.0, 20 * 0.1 / 0.3**2
    speed = 9.81 * np.sin(0.2) * mass / (mass + rolling) * 0.2
    assert_allclose(blocks.velocity("bar 11")[-1], [speed, 0, 0], atol=1e-7)


def test_gaps_of_what_rolls_are_closed_as_by_whole_matrices(monkeypatch):
    """Bars given a centimetre beside their axles: bodies come together, wheels may slip for it."""
    blocks = rom.simulate(train(12, apart=0.01), t_end=1e-3, dt=1e-3, assemble=True)
    monkeypatch.setattr(packing, "MAX_SHARING_WHOLE", 10_000)
    other = rom.simulate(train(12, apart=0.01), t_end=1e-3, dt=1e-3, assemble=True)
    assert blocks.packed.by_blocks and not other.packed.by_blocks
    assert np.abs(blocks.position("bar 3")[0] - [3.51, 0, 0.3]).max() > 1e-3
    assert_allclose(blocks.q[0], other.q[0], atol=1e-9)
