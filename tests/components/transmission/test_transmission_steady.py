"""Motions that repeat with the mesh, against motion through time and the linearised unit."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cases.gear_unit import repeating, unit
from rom.components.gear_mesh import Correction
from rom.components.transmission import rest, simulate, steady, sweep, whirl
from rom.errors import ModelError

STEPS = 60


@pytest.fixture(scope="module")
def lossy():
    """Shafts with so much damping that motion through time settles soon."""
    return rest(unit(torque=300.0, speed=150.0, loss=1e-4))


@pytest.fixture(scope="module")
def found(lossy):
    return steady(lossy, steps=STEPS)


@pytest.mark.once
@pytest.mark.long
def test_it_is_where_motion_through_time_settles(lossy, found):
    """But for the little that its steps damp."""
    run = simulate(lossy, periods=8, steps=STEPS)
    last, size = slice(-STEPS - 1, None), np.ptp(found.error)
    assert_allclose(run.error[last], found.error, atol=0.025 * size)
    assert_allclose(run.teeth[last], found.teeth, atol=0.05 * found.teeth.max())
    first = np.abs(run.error[: STEPS + 1] - found.error).max()
    assert first > 0.05 * size  # it has settled, it did not start there
    assert found.error_rms == pytest.approx(np.std(run.error[last][1:]), rel=0.02)
    top = run.teeth[last].max() / run.teeth[last][1:].mean()
    assert found.load_factor == pytest.approx(top, rel=0.03)


@pytest.mark.long
def test_it_ends_as_it_began(found):
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


@pytest.mark.long
def test_it_is_the_motion_of_another_program(lossy, found):
    """With its derivatives; but for friction in them, and for how the methods damp a step."""
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
    """The same unit whirls at rest, see `test_fast_and_lightly_loaded_journals_whirl`."""
    light = unit(torque=8.0, clearance=90e-6)
    for speed in (200.0, 2200.0):
        state = rest(replace(light, speed=speed))
        assert steady(state, steps=STEPS).stable == whirl(state).stable == (speed < 1000)


@pytest.mark.long
def test_a_sweep_goes_on_from_speed_to_speed(lossy, found):
    """From another speed to the same motion."""
    passed = sweep(lossy.unit, [144.0, 150.0], steps=STEPS)
    assert [s.unit.speed for s in passed] == [144.0, 150.0]
    assert_allclose(passed[1].teeth, found.teeth, rtol=1e-3)
    assert np.abs(passed[0].error - passed[1].error).max() > 1e-8


@pytest.mark.long
def test_one_step_more_finds_the_same_motion(found):
    """From the motion itself."""
    again = steady(found, steps=STEPS + 1)
    assert again.t.size == STEPS + 2 and again.passes < found.passes
    assert again.error_rms == pytest.approx(found.error_rms, rel=0.02)


def test_pitch_errors_repeat_with_no_tooth(lossy):
    mesh = replace(lossy.unit.mesh, correction=Correction(pitch=(np.zeros(26), ())))
    with pytest.raises(ModelError, match="no motion repeats with every tooth"):
        steady(replace(lossy, unit=replace(lossy.unit, mesh=mesh)))
