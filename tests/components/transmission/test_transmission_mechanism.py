"""A gear unit as a mechanism, of shafts that spin in frames which do not, by other programs."""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from benchmarks.units import as_mechanism
from cases.gear_unit import repeating, resting, with_inlets
from cases.mbs.geared_rotors import SIZES, SPAN, rigid_unit
from rom.components.transmission import rest, steady, whirl
from rom.rotation import log

HELIX = float(np.radians(12.5))


@cache
def both(theta=0.4, **more):
    """The unit at rest by its own program, and as a mechanism with its state."""
    unit = rigid_unit(**more)
    mech = as_mechanism(unit)
    return rest(unit, theta), mech, rom.equilibrium(mech, t=theta / unit.speed)


def coordinates(unit, state):
    """(12,) motions and rotations of both shafts in the axes of the unit."""
    parts = []
    for k in range(2):
        q = state.q[7 * k : 7 * k + 7]
        parts += [*(q[:3] - [k * unit.mesh.pair.distance, 0, SPAN / 2]), *log(q[3:])]
    return np.array(parts)


@pytest.mark.parametrize("more", [{}, {"torque": 40.0, "speed": 500.0}, {"torque": 450.0}], ids=str)
def test_shafts_rest_on_films_and_teeth_where_they_do_in_the_unit(more):
    there, _, state = both(**more)
    wanted = resting(there.unit, there.theta)
    for found in (coordinates(there.unit, state), there.q):
        assert_allclose(found[[0, 1, 5, 6, 7, 11]], wanted[[0, 1, 5, 6, 7, 11]], rtol=1e-8)
        assert_allclose(found, wanted, atol=1e-8 * np.abs(wanted).max())


def oiled(beyond, **more):
    return with_inlets(rigid_unit(gravity=(0.0, -9.81), **more), beyond)


@pytest.mark.parametrize("beyond", [-90, 90, 150])
def test_shafts_rest_on_films_that_conserve_their_oil_wherever_it_comes_in(beyond, recwarn):
    """From the middle of the bushes, where films begin to fill; they are no unstable springs."""
    unit = oiled(beyond)
    mech = as_mechanism(unit)
    found = coordinates(unit, rom.equilibrium(mech))
    wanted = rest(unit).q
    assert_allclose(found, wanted, atol=1e-7 * np.abs(wanted).max())
    assert not recwarn.list


@pytest.mark.parametrize("beyond", [-60, -45])
def test_wheels_beside_the_middle_find_their_films_where_oil_comes_in_before_the_load(beyond):
    """From the middle they run dry on the way to the load. Near and far seats bear 7 to 3.

    Within a hundredth, as teeth press harder on one end of their face.
    """
    seats, unit = (-0.06, 0.14), oiled(beyond, speed=60.0)
    mech = as_mechanism(unit, seats=seats)
    still = rom.mbs.snapshot(mech, rom.equilibrium(mech))
    for name, side, size in zip(("pinion", "gear"), (-1, 1), SIZES, strict=True):
        near, far = (still.element(f"{name} {end}").force[0, 0, :2] for end in ("low", "high"))
        teeth = still.element("mesh").force[0, 0, :2] * -side
        weight = np.array([0.0, -9.81 * size[0]])
        assert_allclose(near + far, -teeth - weight, rtol=1e-8)
        assert_allclose(near, 0.7 * (near + far), atol=0.01 * np.hypot(*teeth))


def test_helical_wheels_tilt_as_in_the_unit():
    """But for the arms of axial forces, which the unit takes at the datum."""
    there, _, state = both(helix=HELIX)
    found, wanted = coordinates(there.unit, state), there.q
    assert np.abs(wanted[[3, 4, 9, 10]]).min() > 1e-6
    assert_allclose(found, wanted, rtol=5e-3, atol=1e-9)


def test_films_and_teeth_of_the_mechanism_say_what_they_bear():
    there, mech, state = both()
    still = rom.mbs.snapshot(mech, state)
    load = rom.mbs.tooth_loads(still, "mesh")[0].force.sum()
    assert load == pytest.approx(there.forces.mesh.load.sum(), rel=1e-8)
    for name, film in zip(("pinion low", "gear high"), there.forces.films[::3], strict=True):
        found = still.journal_bearing(name)
        assert found.power[0] == pytest.approx(film.dissipated, rel=1e-7)
        assert found.pressure[0] == pytest.approx(film.pressure.max(), rel=1e-7)


@pytest.mark.parametrize(("more", "rtol"), [({}, 3e-4), ({"helix": HELIX}, 2e-3)], ids=str)
def test_it_whirls_and_vibrates_as_the_unit(more, rtol):
    """But for forces that turn with the line of centres, which the unit leaves out."""
    there, mech, state = both(**more)
    wanted = whirl(there).values
    found = rom.linearize(mech, state).eigenvalues
    wanted = wanted[wanted.imag > 1e-6 * np.abs(wanted).max()]
    found = found[found.imag > 1e-6 * np.abs(found).max()]
    order = np.argsort(found.imag), np.argsort(wanted.imag)
    assert_allclose(found[order[0]], wanted[order[1]], rtol=rtol)


def test_it_runs_through_its_speeds_as_another_program():
    """Errors of transmission and forces of teeth at every step.

    But for forces that turn with the line of centres, and for what the methods leave of each step.
    """
    motion = None
    for speed in (725.0, 750.0):
        unit = rigid_unit(torque=300.0, speed=speed)
        mech = as_mechanism(unit)
        q, own_teeth, values = repeating(rest(unit), 60)
        own_error = (q @ unit.wheels[[5, 11]].T) @ unit.mesh.pair.rb
        start = rom.equilibrium(mech) if motion is None else motion
        motion = rom.periodic_motion(mech, period=unit.mesh_period, steps=60, start=start)
        turned = np.array([[log(q[3:7])[2], log(q[10:14])[2]] for q in motion.solution.q])
        error = turned @ unit.mesh.pair.rb
        teeth = np.array([x.force.sum() for x in rom.mbs.tooth_loads(motion.solution, "mesh")])
        assert_allclose(error, own_error, atol=2e-3 * np.ptp(own_error))
        assert_allclose(teeth, own_teeth, atol=1e-3 * own_teeth.max())
        assert np.ptp(teeth) > 0.5 * teeth.mean() and motion.gap < 1e-9
        largest = np.abs(motion.multipliers[0]), np.abs(values[0])
        assert 1 - largest[0] == pytest.approx(1 - largest[1], rel=3e-3)
        found = steady(rest(unit), steps=60)
        assert_allclose(found.error, own_error, atol=2e-3 * np.ptp(own_error))
        assert_allclose(found.teeth, own_teeth, atol=1e-3 * own_teeth.max())
