"""A gear unit as a mechanism, of shafts that spin in frames which do not, by other programs."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from benchmarks.units import as_mechanism
from cases.gear_unit import SIZES, SPAN, repeating, resting, rigid_unit, unit, with_inlets
from cases.refusals import refuses
from rom.components.gear_mesh import Correction
from rom.components.transmission import rest, simulate, steady, sweep, whirl
from rom.errors import ModelError
from rom.rotation import log

HELIX = float(np.radians(12.5))
STEPS = 60


@cache
def both(theta=0.4, **more):
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
    found, wanted = coordinates(unit, rom.equilibrium(as_mechanism(unit))), rest(unit).q
    assert_allclose(found, wanted, atol=1e-7 * np.abs(wanted).max())
    assert not recwarn.list


@pytest.mark.parametrize("beyond", [-60, -45])
def test_wheels_beside_the_middle_find_their_films_where_oil_comes_in_before_the_load(beyond):
    """Seats bear 7 to 3 within a hundredth, as teeth press harder on one end of their face."""
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
    both_values = rom.linearize(mech, state).eigenvalues, whirl(there).values
    found, wanted = (x[x.imag > 1e-6 * np.abs(x).max()] for x in both_values)
    assert_allclose(found[np.argsort(found.imag)], wanted[np.argsort(wanted.imag)], rtol=rtol)


def test_it_runs_through_its_speeds_as_another_program():
    """At every step, but for forces that turn with the line of centres, and what steps leave."""
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


@pytest.fixture(scope="module")
def lossy():
    return rest(unit(torque=300.0, speed=150.0, loss=1e-4))


@pytest.fixture(scope="module")
def found(lossy):
    return steady(lossy, steps=STEPS)


@pytest.mark.long
def test_it_is_where_motion_through_time_settles(lossy, found):
    run = simulate(lossy, periods=8, steps=STEPS)
    last, size = slice(-STEPS - 1, None), np.ptp(found.error)
    assert_allclose(run.error[last], found.error, atol=0.025 * size)
    assert_allclose(run.teeth[last], found.teeth, atol=0.05 * found.teeth.max())
    assert np.abs(run.error[: STEPS + 1] - found.error).max() > 0.05 * size  # it did not start so
    assert found.error_rms == pytest.approx(np.std(run.error[last][1:]), rel=0.02)
    top = run.teeth[last].max() / run.teeth[last][1:].mean()
    assert found.load_factor == pytest.approx(top, rel=0.03)


@pytest.mark.long
def test_it_ends_as_it_began_and_is_the_motion_of_another_program(lossy, found):
    assert found.t[-1] == pytest.approx(found.unit.mesh_period)
    assert found.q.shape == (STEPS + 1, found.unit.load.size)
    assert_allclose(found.q[-1], found.q[0], atol=1e-6 * np.abs(found.q).max())
    assert np.ptp(found.orbits, axis=1).max() > 1e-3 * 50e-6
    assert found.orbits.shape == (4, STEPS + 1, 2)
    assert_allclose(found.orbits[0], found.q[:, :2])  # first node of the pinion
    assert found.stable and found.apart == 0
    assert found.motion.runs < 40  # also on films of half a micrometre
    mean = 300.0 / found.unit.mesh.pair.rb[0]
    assert found.teeth[1:].mean() == pytest.approx(mean, rel=0.01)  # but for friction
    # with its derivatives; but for friction in them, and for how the methods damp a step
    q, teeth, multipliers = repeating(lossy, STEPS)
    assert_allclose(found.q, q, atol=1e-3 * np.abs(q).max())
    assert_allclose(found.teeth, teeth, atol=0.02 * teeth.max())
    first = [1 - np.abs(values[:8]) for values in (found.multipliers, multipliers)]
    assert_allclose(first[0], first[1], rtol=5e-3)


@pytest.mark.long
def test_multipliers_are_those_of_the_linearised_unit():
    """The slowest vibrations, in which teeth count by their mean stiffness."""
    state = rest(unit(torque=300.0, speed=300.0))
    motion, period = steady(state, steps=STEPS), state.unit.mesh_period
    at_rest = whirl(state).values
    slow = at_rest[np.abs(at_rest.imag) * period < 1.0][:4]
    for value in slow:
        assert np.abs(motion.multipliers - np.exp(value * period)).min() < 3e-3
    assert np.abs(1 - np.exp(slow * period)).max() > 0.02


@pytest.mark.long
def test_beyond_the_threshold_the_motion_is_not_stable():
    light = unit(torque=8.0, clearance=90e-6)
    for speed in (200.0, 2200.0):
        state = rest(replace(light, speed=speed))
        assert steady(state, steps=STEPS).stable == whirl(state).stable == (speed < 1000)


@pytest.mark.long
def test_a_sweep_and_one_step_more_find_the_same_motion(lossy, found):
    passed = sweep(lossy.unit, [144.0, 150.0], steps=STEPS)
    assert [s.unit.speed for s in passed] == [144.0, 150.0]
    assert_allclose(passed[1].teeth, found.teeth, rtol=1e-3)
    assert np.abs(passed[0].error - passed[1].error).max() > 1e-8
    again = steady(found, steps=STEPS + 1)
    assert again.t.size == STEPS + 2 and again.passes < found.passes
    assert again.error_rms == pytest.approx(found.error_rms, rel=0.02)


def test_pitch_errors_repeat_with_no_tooth(lossy):
    mesh = replace(lossy.unit.mesh, correction=Correction(pitch=(np.zeros(26), ())))
    broken = replace(lossy, unit=replace(lossy.unit, mesh=mesh))
    refuses(ModelError, "no motion repeats with every tooth", steady, broken)
