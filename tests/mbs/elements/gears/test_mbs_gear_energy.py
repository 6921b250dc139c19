"""Teeth whose forces follow their energy: gradients, momentum, balance, tangents."""

from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.components.geared import ORIGIN, Z, free_wheels
from cases.mbs.mechanisms import prepared
from cases.mbs.parts import on_axle
from cases.mbs.tangents import assert_forces_are_the_gradient, by_position, by_velocity, shifted
from rom.components.gear_mesh import Correction, GearPair, Hertz
from rom.components.gear_mesh.gears.meshes import GEAR_MESHES_FAMILY

K = 1.3e10
PAIRS = {
    "spur": GearPair((26, 40), 4e-3, 0.03, thinning=5e-5),
    "helical": GearPair((26, 40), 4e-3, 0.05, helix=0.35, thinning=5e-5),
    "left": GearPair((26, 40), 4e-3, 0.03, helix=-0.2, thinning=5e-5),
    "internal": GearPair((24, -72), 2e-3, 0.02, thinning=2e-5),
}
STEEP = Hertz(((1e-4, 1e-4), (5e-3, 5e-3), (1e-4, 5e-4)))


def waves(seed, *shape):
    """Smooth map of micrometres."""
    rng = np.random.default_rng(seed)
    return 1e-6 * rng.random(shape)


RELIEVED = Correction(relief=(15e-6, 10e-6), extent=(4e-3, 3e-3), power=1.5, crowning=4e-6,
                      slope=5e-6, pitch=(1e-6 * np.arange(26) % 7, ()))  # fmt: skip
OPTIONS = {
    "plain": {},
    "relieved": {"correction": RELIEVED},
    "measured": {"correction": Correction(
        maps=(waves(0, 4, 3), waves(1, 40, 5, 2)), back_maps=(waves(2, 26, 3, 3), waves(3, 2, 1)),
        run_out=((2e-6, 0.4), (3e-6, -1.1)))},
    "hertz": {"hertz": Hertz(((2e-3, 5e-3), (4e-3, 3e-3), (5e-3, 2e-3)))},
    "coupled": {"coupling": 4e-3, "correction": Correction(crowning=2e-5, slope=2e-5)},
    "both": {"coupling": 4e-3, "correction": Correction(crowning=2e-5, slope=2e-5),
             "hertz": Hertz((4e-3, 3e-3))},
}  # fmt: skip
LOSSES = {"damping": 1e-6, "friction": 0.1, "transition_speed": 0.1}
TABLE = K * np.array([0.6, 0.9, 1.1, 0.7])
CASES = [("spur", "plain"), ("spur", "relieved"), ("spur", "measured"), ("helical", "plain"),
         ("helical", "relieved"), ("helical", "measured"), ("helical", "hertz"),
         ("helical", "coupled"), ("helical", "both"), ("left", "relieved"), ("left", "coupled"),
         ("internal", "plain"), ("internal", "hertz")]  # fmt: skip


def wheels(kind, options, **more):
    given = {"stiffness": TABLE, "entry": 0.1, "cells": 7} | OPTIONS[options] | more
    return free_wheels(PAIRS[kind], **given)


def placed(packed, pair, back, seed, tilts=3e-4):
    """Coordinates of wheels that were turned, shifted and tilted, working or back flanks loaded."""
    rng, delta = np.random.default_rng(seed), np.zeros(12)
    delta[[0, 1, 2, 6, 7, 8]] = 2e-5 * rng.normal(size=6)
    delta[[3, 4, 9, 10]] = tilts * rng.normal(size=4)
    turn = 0.3 * rng.random()
    delta[5], delta[11] = turn, -turn * pair.rb[0] / pair.rb[1]
    delta[5] += -1e-3 - pair.backlash / pair.rb[0] if back else 1e-3
    return shifted(packed, packed.q, delta)


@pytest.mark.parametrize(("kind", "options"), CASES)
@pytest.mark.parametrize("back", [False, True], ids=["working", "back"])
def test_forces_are_the_gradient_of_the_energy(kind, options, back):
    packed, W = prepared(wheels(kind, options))
    pair, mesh = PAIRS[kind], packed.elements[GEAR_MESHES_FAMILY]
    for seed in range(3):
        assert_forces_are_the_gradient(packed, W, mesh, placed(packed, pair, back, seed))


@pytest.mark.parametrize(("kind", "options"), [c for c in CASES if c[1] != "measured"])
@pytest.mark.parametrize("losses", [{}, LOSSES], ids=["elastic", "lossy"])
def test_tangents_are_differences_of_forces(kind, options, losses):
    """But for how gaps are curved, and how tilts turn the forces: to the deflection over radii."""
    fast = {"transition_speed": 1e-3} if losses else {}
    packed, W = prepared(wheels(kind, options, **losses | fast))
    q = placed(packed, PAIRS[kind], False, 1)
    v = 1e-3 * np.random.default_rng(5).normal(size=12)
    found, stiff = by_position(packed, W, q, v)
    assert_allclose(found, stiff, atol=1e-3 * np.abs(stiff).max())
    found, loss = by_velocity(packed, W, q, v)
    assert_allclose(found, loss, atol=1e-6 * max(np.abs(loss).max(), 1.0))


@pytest.mark.parametrize("kind", ["spur", "helical", "internal"])
@pytest.mark.parametrize("more", [{}, {"hertz": STEEP}], ids=["linear", "hertz"])
def test_tangents_without_tilts_know_how_forces_turn(kind, more):
    """All of them, of ways of the wheels in space and turns about their axes.

    What ways in the plane do to the moments that tilt the pinion is small of second order.
    """
    packed, W = prepared(wheels(kind, "plain", entry=0.5, **more))
    q, moves = placed(packed, PAIRS[kind], False, 1, tilts=0.0), [0, 1, 2, 5, 6, 7, 8, 11]
    found, stiff = by_position(packed, W, q, np.zeros(12))
    size = np.where(np.arange(12) % 6 < 3, 1.0, 1 / PAIRS[kind].rb[0])
    error = np.outer(size, size) * np.abs(found - stiff) / np.abs(stiff[:3]).max()
    limit = 2e-4 if kind == "helical" else 5e-5
    assert error[np.ix_(moves, moves)].max() < limit
    assert error[np.ix_([3, 4], [0, 1, 6, 7])].max() < limit


@pytest.mark.parametrize("kind", PAIRS)
@pytest.mark.parametrize("losses", [{}, LOSSES], ids=["elastic", "lossy"])
def test_wheels_that_hit_and_part_keep_energy_and_momentum(kind, losses):
    pitch = (1e-6 * np.arange(PAIRS[kind].teeth[0]) % 7, ())
    flanks = Correction((15e-6, 10e-6), (4e-3, 3e-3), 2.0, 4e-6, 5e-6, pitch,
                        run_out=((2e-6, 0.4), (0.0, 0.0)))  # fmt: skip
    omega = 40.0, -40.0 * PAIRS[kind].rb[0] / PAIRS[kind].rb[1] + 2.0
    given = {"inertia": (2e-3, 2e-3, 3e-3), "omega": omega, "stiffness": TABLE, "cells": 7}
    mech = free_wheels(PAIRS[kind], correction=flanks, phase=0.1, **given, **losses)
    run = partial(rom.simulate, mech, t_end=6e-4, dt=2e-6, method="dop853", progress=False)
    sol = run(rtol=1e-10)
    force = np.linalg.norm(sol.element("mesh").force[:, 0], axis=1)
    assert force.max() > 300
    assert (force == 0).any()
    # dampers set in with a jump, which the error estimate of a step may miss (up to 3e-6, in no
    # order of tolerances): steps of another length meet it elsewhere
    found = [sol] if not losses else [sol, run(rtol=1e-9)]
    gaps = [np.abs(x.energy.balance).max() / x.energy.strain.max() for x in found]
    assert min(gaps) < 1e-6 and max(gaps) < 1e-5
    for of_all in sol.momentum:  # [N s, N m s]; a blow passes 1e-3 from one wheel to the other
        assert np.ptp(of_all, axis=0).max() < 1e-13
    if losses:
        assert (np.diff(sol.energy.damping) > -1e-12).all() and sol.energy.damping[-1] > 1e-6
    assert rom.audit(sol).ok, rom.audit(sol)


def test_a_pinion_in_oil_films_whose_teeth_rub_hit_and_part_keeps_the_energy():
    pair, mech = GearPair((26, 40), 4e-3, 0.03, 0.2, thinning=5e-6), rom.Mechanism()
    pinion = mech.add_rigid("pinion", mass=4.0, inertia=(8e-3, 8e-3, 5e-3), at=ORIGIN,
                            omega=(0, 0, 100.0))  # fmt: skip
    turning = {"at": (pair.distance, 0, 0), "omega": (0, 0, 3.0 - 65.0)}
    on_axle(mech, "gear", mass=9.0, inertia=(0.02,) * 3, **turning)
    film = rom.mbs.JournalBearing(0.04, 0.02, 8e-5, [rom.mbs.Groove(np.pi / 2, 0.3)], cells=(24, 4))
    for name, z in (("front", -0.03), ("back", 0.03)):
        ends = pinion.marker((0, 0, z)), mech.ground.marker((0, 0, z))
        mech.journal_bearing(name, *ends, axis=Z, bearing=film, oil=0.02)
    mech.bushing("thrust", "ground", "pinion", stiffness=(0, 0, 1e6, 0, 0, 0))
    law = {"stiffness": K, "cells": 7, "entry": 0.1} | LOSSES
    mech.gear_mesh("mesh", "pinion", "gear", axis=Z, pair=pair, **law)
    mech.torque("motor", "pinion", (0, 0, 20.0))
    sol = rom.simulate(mech, t_end=8e-4, dt=2e-6, method="dop853", rtol=1e-11, progress=False)
    load = np.linalg.norm(sol.element("mesh").force[:, 0], axis=1)
    touching, energy = load > 0, sol.energy
    assert np.flatnonzero(np.diff(touching)).size >= 6
    assert load.max() > 5000
    assert np.abs(sol.element("front").force[:, 0]).max() > 50
    lost = np.diff(energy.damping)
    apart = ~(touching[1:] | touching[:-1])
    assert lost[~apart].mean() > 1.2 * lost[apart].mean() > 0
    for part in (energy.strain, energy.damping, energy.forces, energy.kinetic):
        assert np.abs(energy.balance).max() < 1e-6 * np.ptp(part)
    assert rom.audit(sol).ok, rom.audit(sol)
