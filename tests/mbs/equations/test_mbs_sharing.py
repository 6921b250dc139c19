"""Many joints that repeat others: by blocks as by whole matrices, and as joints that do not."""

import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.long import few
from rom.errors import ModelError, RomWarning
from rom.mbs.equations import packing

GRAVITY = (3.0, 0.0, -9.81)
LOOPS = 7  # 126 coordinates: the fewest in blocks are 100


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
            top, foot, end = (
                above[side], rail.marker((0, 0, -0.5)), rung.marker((side - 0.5, 0, 0))
            )  # fmt: skip
            mech.revolute(f"up {k}.{side}", top, rail.marker((0, 0, 0.5)), axis=(0, 1, 0))
            if side == 0 or repeated:
                mech.revolute(f"down {k}.{side}", foot, end, axis=(0, 1, 0))
            else:
                mech.point_on_line(f"down {k}.{side}", end, foot, axis=(0, 1, 0))
        mech.rotational_spring(f"damper {k}", f"up {k}.0", stiffness=2.0, damping=0.1)
        above = [rung.marker((x, 0, 0)) for x in (-0.5, 0.5)]
    return mech


def quietly(f, *args, **options):
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*constraints repeat others")
        return f(*args, **options)


@pytest.fixture
def whole(monkeypatch):
    """Lets mechanisms of any size have whole matrices."""
    return lambda: monkeypatch.setattr(packing, "MAX_SHARING_WHOLE", 10_000)


METHODS = {
    "alpha": {"dt": 2e-3},
    "steps chosen": {"rtol": 1e-6},
    "stabilised": {"dt": 2e-3, "stabilised": True},
    "bdf": {"dt": 2e-3, "method": "bdf", "order": 3},
    "dop853": {"dt": 0.05, "method": "dop853", "rtol": 1e-9, "atol": 1e-11},
}


@pytest.mark.parametrize("method", few(3, METHODS))
def test_blocks_move_and_carry_as_whole_matrices(method, whole):
    """Positions, velocities and the reactions of least norm."""
    options = {"t_end": 0.3, **METHODS[method]}
    blocks = quietly(rom.simulate, ladder(LOOPS), **options)
    assert blocks.packed.by_blocks and blocks.statistics["redundant"] == 3 * LOOPS
    whole()
    other = quietly(rom.simulate, ladder(LOOPS), **options)
    assert not other.packed.by_blocks and other.statistics["rank"] == blocks.statistics["rank"]
    where = -1 if method == "steps chosen" else slice(None)
    tolerance = 1e-5 if method == "steps chosen" else 1e-8
    assert_allclose(blocks.q[where], other.q[where], atol=tolerance)
    assert_allclose(blocks.v[where], other.v[where], atol=100 * tolerance)
    assert_allclose(blocks.lam[where], other.lam[where], atol=1e3 * tolerance)
    assert rom.audit(blocks).ok


def test_many_loops_move_as_those_that_repeat_nothing():
    """Twenty parallelograms: their planar loads, too."""
    options = {"t_end": 0.5, "dt": 2e-3}
    repeated = quietly(rom.simulate, ladder(20), **options)
    other = rom.simulate(ladder(20, repeated=False), **options)
    assert repeated.statistics["redundant"] == 60 and other.statistics["redundant"] == 0
    last = repeated.position("rung 19")
    assert np.ptp(last[:, 0]) > 0.1
    assert_allclose(last, other.position("rung 19"), atol=1e-9)
    assert np.abs(repeated.gap).max() < 1e-9


def test_statics_and_small_motions_are_those_of_joints_that_repeat_nothing():
    here, there = (
        quietly(rom.equilibrium, ladder(20, repeated=repeated)) for repeated in (True, False)
    )
    assert_allclose(here.q, there.q, atol=1e-9)
    found = [
        quietly(rom.linearize, ladder(20, repeated=repeated), state, n=4).frequencies
        for repeated, state in ((True, here), (False, there))
    ]
    assert_allclose(*found, rtol=1e-8)


def test_joints_that_share_loads_are_named_in_large_mechanisms():
    with pytest.warns(
        RomWarning, match="21 of 140 constraints repeat others; joints up 0.0, .* and 20 more"
    ):
        rom.simulate(ladder(LOOPS), t_end=1e-3, dt=1e-3)


def test_a_large_mechanism_in_a_singular_position_is_refused():
    """A parallelogram laid flat among others: it could fold either way."""
    mech = ladder(LOOPS)
    arm = mech.add_rigid("arm", mass=1.0, inertia=(0.1,) * 3, at=(5.5, 0, 0))
    far = mech.add_rigid("far", mass=1.0, inertia=(0.1,) * 3, at=(7.5, 0, 0))
    bar = mech.add_rigid("bar", mass=1.0, inertia=(0.1,) * 3, at=(6.5, 0, 0))
    ground = [mech.ground.marker((x, 0, 0)) for x in (5.0, 7.0)]
    mech.revolute("a", ground[0], arm.marker((-0.5, 0, 0)), axis=(0, 1, 0))
    mech.revolute("b", ground[1], far.marker((-0.5, 0, 0)), axis=(0, 1, 0))
    mech.revolute("c", arm.marker((0.5, 0, 0)), bar.marker((-0.5, 0, 0)), axis=(0, 1, 0))
    mech.revolute("d", far.marker((0.5, 0, 0)), bar.marker((1.5, 0, 0)), axis=(0, 1, 0))
    with pytest.raises(ModelError, match="singular position"):
        quietly(rom.simulate, mech, t_end=0.1, dt=1e-3)


def test_joints_that_contradict_each_other_are_named_in_large_mechanisms():
    """The last rung is drawn a centimetre too long for its rails."""
    mech = ladder(LOOPS)
    last = mech.parts[f"rung {LOOPS - 1}"]
    wall = mech.ground.marker((2.0, 0.01, -float(LOOPS)))
    mech.revolute("wall", wall, last.marker((1.5, 0, 0)), axis=(0, 1, 0))
    with pytest.raises(ModelError, match="cannot be assembled"):
        quietly(rom.simulate, mech, t_end=0.1, dt=1e-3)


def train(n, slope=0.2, apart=0.0):
    """Wheels of a train that roll down a slope, their axles in a row of bars.

    Every third axle carries a wheel on either side, too: what holds all three upright repeats
    itself.
    """
    mech = rom.Mechanism(gravity=(9.81 * np.sin(slope), 0, -9.81 * np.cos(slope)))
    floor, behind = mech.ground.marker((0, 0, 0)), None
    for k in range(n):
        wheel = mech.add_rigid(f"wheel {k}", mass=2.0, inertia=(0.05, 0.1, 0.05), at=(k, 0, 0.3))
        mech.rolling(f"roll {k}", floor, wheel.marker((0, 0, 0)), normal=(0, 0, 1), radius=0.3,
                     axis=(0, 1, 0))  # fmt: skip
        bar = mech.add_rigid(f"bar {k}", mass=1.0, inertia=(0.1,) * 3,
                             at=(k + 0.5 + apart, 0, 0.3))  # fmt: skip
        mech.revolute(f"axle {k}", bar.marker((-0.5, 0, 0)), wheel.marker((0, 0, 0)),
                      axis=(0, 1, 0))  # fmt: skip
        if behind is not None:
            mech.spherical(f"link {k}", behind.marker((0.5, 0, 0)), bar.marker((-0.5, 0, 0)))
        for y in (-1, 1) if k % 3 == 2 else ():
            at = {"at": (k, y, 0.3), "inertia": (0.05, 0.1, 0.05)}
            other = mech.add_rigid(f"wheel {k}.{y}", mass=2.0, **at)
            centre = other.marker((0, 0, 0))
            mech.rolling(f"roll {k}.{y}", floor, centre, normal=(0, 0, 1), radius=0.3,
                         axis=(0, 1, 0))  # fmt: skip
            mech.revolute(f"axle {k}.{y}", bar.marker((-0.5, y, 0)), centre, axis=(0, 1, 0))
        behind = bar
    mech.point_on_plane("end", mech.ground.marker((0, 0, 0.3)), behind.marker((0.5, 0, 0)),
                        normal=(0, 0, 1))  # fmt: skip
    return mech


def test_many_wheels_roll_by_blocks_as_by_whole_matrices(whole):
    """Down the slope with g sin(a) (sum of masses) / (sum of masses + J / r^2)."""
    options = {"t_end": 0.2, "dt": 1e-3}
    blocks = quietly(rom.simulate, train(12), **options)
    whole()
    other = quietly(rom.simulate, train(12), **options)
    assert blocks.packed.by_blocks and blocks.statistics["redundant"] > 0
    assert not other.packed.by_blocks and other.statistics["rank"] == blocks.statistics["rank"]
    assert_allclose(blocks.q, other.q, atol=1e-9)
    assert_allclose(blocks.lam, other.lam, atol=1e-4)
    mass, rolling = 20 * 2.0 + 12 * 1.0, 20 * 0.1 / 0.3**2
    speed = 9.81 * np.sin(0.2) * mass / (mass + rolling) * 0.2
    assert_allclose(blocks.velocity("bar 11")[-1], [speed, 0, 0], atol=1e-7)


def test_gaps_of_what_rolls_are_closed_as_by_whole_matrices(whole):
    """Bars given a centimetre beside their axles: bodies come together, wheels may slip for it."""
    blocks = quietly(rom.simulate, train(12, apart=0.01), t_end=1e-3, dt=1e-3, assemble=True)
    whole()
    other = quietly(rom.simulate, train(12, apart=0.01), t_end=1e-3, dt=1e-3, assemble=True)
    assert blocks.packed.by_blocks and not other.packed.by_blocks
    assert np.abs(blocks.position("bar 3")[0] - [3.51, 0, 0.3]).max() > 1e-3
    assert_allclose(blocks.q[0], other.q[0], atol=1e-9)
