"""Geared shafts in journal bearings against closed forms, statics and finer steps."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh, eigvals
from scipy.optimize import brentq

import rom
from cases.gear_unit import NODES, journal, resting, stepped, tilting, unit, with_inlets
from cases.long import few
from cases.refusals import refused, refuses
from rom.components import transmission
from rom.components.gear_mesh import Correction, GearPair
from rom.components.journal_bearing import equilibrium, stability
from rom.components.transmission import Disc, rest, simulate, whirl
from rom.components.transmission.mechanism import mechanism_of
from rom.components.transmission.shaft import vibrations
from rom.errors import ModelError, SolverError

E, RHO = 206e9, 7850.0
HELIX = float(np.radians(12.5))
HELICAL = GearPair((26, 157), 4e-3, 0.04, HELIX)
OVERLAPPING = HELICAL.base_pitch / np.tan(HELICAL.base_helix)  # width for an overlap of one


@pytest.fixture(scope="module")
def loaded():
    return rest(unit())


def test_a_free_shaft_twists_and_stretches_by_wave_speeds():
    """It bends as Timoshenko says: tests/cyclic/test_rotor.py."""
    l = 1.0
    s = transmission.Shaft(np.linspace(0, l, 21), 0.08)
    M, K, _ = s.matrices()
    free = np.setdiff1d(np.arange(s.n), [0, 1, 2, 5, 120, 121])
    omega = np.sqrt(eigh(K[np.ix_(free, free)], M[np.ix_(free, free)], eigvals_only=True))
    for modulus in (E, E / 2.6):
        assert np.abs(omega / (np.pi / 2 / l * np.sqrt(modulus / RHO)) - 1).min() < 4e-4


def test_a_free_rotor_precesses_by_the_ratio_of_its_inertias_and_a_ring_has_those_of_a_ring():
    solid = Disc.of_ring(0, outer=0.2, inner=0.0, width=1e-9)
    assert solid.polar == pytest.approx(2 * solid.diametral) == pytest.approx(solid.mass * 0.005)
    hole, ring = (Disc.of_ring(0, outer=d, inner=i, width=0.05) for d, i in ((0.1, 0), (0.2, 0.1)))
    whole = Disc.of_ring(0, outer=0.2, inner=0.0, width=0.05)
    for name in ("mass", "polar", "diametral"):
        assert getattr(hole, name) + getattr(ring, name) == pytest.approx(getattr(whole, name))
    s = transmission.Shaft(NODES, 0.05, [Disc.of_ring(2, outer=0.3, inner=0.05, width=0.04)])
    (M, K, G), speed = s.matrices(), 500.0
    turn, spin = np.zeros((2, s.n))
    turn[3::6], turn[1::6], spin[5::6] = 1.0, -(NODES - 0.1), 1.0
    ratio = (spin @ M @ spin) / (turn @ M @ turn)
    values = vibrations(M, speed * G, K)[0]
    assert np.abs(values - 1j * speed * ratio).min() < 5e-3 * speed * ratio
    across, volume = M[0::6, 0::6], np.pi / 4 * (0.05**2 * 0.2 + (0.3**2 - 0.05**2) * 0.04)
    assert np.trace(across) < across.sum() == pytest.approx(RHO * volume)


def test_both_journals_rest_where_a_journal_alone_would(loaded):
    u, F = loaded.unit, loaded.forces.mesh.force
    lone = equilibrium(journal(np.arctan2(F[1], F[0])), F[:2] / 2, speed=u.speed, viscosity=0.02)
    for f in loaded.forces.films[:2]:
        assert_allclose(f.motion[:2], lone.motion[:2], atol=2e-3 * 50e-6)
    teeth = loaded.forces.mesh.load.sum()
    assert teeth == pytest.approx(200 / u.mesh.pair.rb[0], rel=5e-3)
    own = np.array([1, -1]) * (loaded.unit.wheels @ loaded.q)[6:8]
    gear = loaded.forces.films[2].motion[:2]
    bent = teeth * 0.2**3 / (48 * E * np.pi * 0.05**4 / 64)
    assert np.hypot(*(own - gear)) == pytest.approx(bent, rel=0.15)  # and is sheared
    assert loaded.forces.films[2].eccentricity > loaded.forces.films[0].eccentricity


@pytest.mark.parametrize(
    ("torque", "beyond"), few(2, [(200.0, 60), (20.0, 75), (200.0, 90), (200.0, 45)])
)
def test_films_that_conserve_their_oil_carry_teeth_as_they_carry_a_load(torque, beyond):
    """On the way there, under less load, they run dry. Other than a lone journal, a shaft tilts."""
    u = with_inlets(unit(torque), beyond)
    found = rest(u)
    assert found.residual < 1e-9
    F = found.forces.mesh.force
    for f, bearing in zip(found.forces.films[:2], u.pinion.bearings.values(), strict=True):
        lone = equilibrium(bearing, F[:2] / 2, speed=u.speed, viscosity=0.02)
        assert_allclose(f.motion[:2], lone.motion[:2], atol=4e-3 * 50e-6)
        rich = equilibrium(bearing.oiled[1], F[:2] / 2, speed=u.speed, viscosity=0.02)
        assert f.eccentricity > rich.eccentricity + 1e-3


def test_without_oil_where_it_is_needed_nothing_rests():
    with pytest.raises(SolverError, match="does not come to rest under 1207") as caught:
        rest(with_inlets(unit(), 0.0))
    assert "inlets" in caught.value.hint


def test_rest_does_not_depend_on_the_way_there(loaded):
    for way in ((0.2, 1.0), (0.05, 0.5, 1.4, 1.0)):
        other = rest(loaded.unit, loads=way)
        assert_allclose(other.q, loaded.q, atol=1e-8 * np.abs(loaded.q).max())
    nearby = loaded.q * 0.97
    assert_allclose(rest(loaded.unit, start=nearby).q, loaded.q, atol=1e-8 * np.abs(loaded.q).max())


def test_relieved_teeth_are_closed_before_they_are_loaded(loaded):
    cut = replace(loaded.unit.mesh, correction=Correction(crowning=1e-6, slope=4e-5))
    late = rest(replace(loaded.unit, mesh=cut))
    assert late.forces.mesh.load.sum() == pytest.approx(loaded.forces.mesh.load.sum(), rel=1e-3)
    flat = replace(cut, correction=Correction(relief=(2e-5, 2e-5), extent=(0.02, 0.02)))
    assert flat.least_gap(0.0) > 5e-6
    moved = rest(replace(loaded.unit, mesh=flat)).q - loaded.q
    turned = loaded.unit.mesh.pair.rb @ (loaded.unit.wheels @ moved)[[5, 11]]
    assert turned > flat.least_gap(0.0)


def test_what_goes_in_comes_out_or_heats_the_oil(loaded):
    """But for moments about tilted axes, to which twists of 3e-3 add a hundredth."""
    given, taken, heat = loaded.powers
    assert heat > 100.0 and given - taken - heat == pytest.approx(tilting(loaded), rel=0.03)
    assert abs(tilting(loaded)) < 2e-7 * given
    assert taken == pytest.approx(200 * loaded.unit.speed, rel=1e-12)


def test_derivatives_of_all_forces_are_exact(loaded):
    u, q, rng = loaded.unit, loaded.q, np.random.default_rng(3)
    v = 1e-3 * rng.normal(size=q.size)
    f = u.forces(q, v, 0.0)
    films = np.flatnonzero(np.vstack([rows[:4] for rows, _, _ in u.journals]).any(axis=0))
    for _ in range(3):
        d = 1e-9 * rng.normal(size=q.size)
        by_q = u.forces(q - d, v, 0.0).force - u.forces(q + d, v, 0.0).force
        by_v = u.forces(q, v - 1e3 * d, 0.0).force - u.forces(q, v + 1e3 * d, 0.0).force
        assert_allclose(by_q[films] / 2, (f.stiffness @ d)[films], atol=1e-3 * np.abs(by_q).max())
        assert_allclose(by_v[films] / 2e3, (f.damping @ d)[films], atol=1e-5 * np.abs(by_v).max())


def test_a_stiff_unit_whirls_as_its_bearings_say():
    s = rest(unit(helix=HELIX, speed=100.0))
    film = s.forces.films[0]
    M, _, K = transmission.linearised(s)
    assert_allclose(M, M.T, atol=1e-12)
    assert np.abs(K - K.T).max() > 1e5  # films are not elastic
    i = np.argmax(s.unit.journals[0][0][:2], axis=1)
    assert_allclose((K - s.unit.matrices[1])[np.ix_(i, i)], film.stiffness[:2, :2], rtol=1e-9)


def test_a_rotor_alone_whirls_at_the_threshold_of_its_bearings():
    b, speed = journal(-np.pi / 2), 400.0
    f = equilibrium(b, (0.0, -200.0), speed=speed, viscosity=0.02)
    s = stability(f.stiffness[:2, :2], f.damping[:2, :2], speed)

    def growth(mass):
        K, C = f.stiffness[:2, :2], f.damping[:2, :2]
        A = np.block([[np.zeros((2, 2)), np.eye(2)], [-K / mass, -C / mass]])
        return eigvals(A).real.max()

    found = brentq(growth, 0.5 * s.critical_mass, 2 * s.critical_mass, xtol=1e-10)
    assert found == pytest.approx(s.critical_mass, rel=1e-9)
    assert s.whirl_ratio == pytest.approx(0.5, abs=0.03)


@pytest.mark.parametrize("helix", [0.0, HELIX])
def test_it_rests_as_another_program_says_and_whirls_as_its_mechanism(helix):
    """But for forces that turn with the line of centres, and products of turns: 1e-4 of turns."""
    state = rest(unit(helix=helix, speed=600.0, gravity=(0.0, -9.81)))
    assert_allclose(state.q, resting(state.unit), atol=1e-4 * np.abs(state.q).max())
    mech = mechanism_of(state.unit, state.q, 0.0 * state.q)
    found = rom.equilibrium(mech)
    both = whirl(state).values, rom.linearize(mech, found).eigenvalues
    own, others = (x[np.argsort(x.imag)][-np.sum(x.imag > 1.0) :] for x in both)
    assert_allclose(others, own, rtol=2e-3)


@pytest.mark.long
def test_fast_and_lightly_loaded_journals_whirl():
    light = unit(torque=8.0, clearance=90e-6)
    limit = transmission.threshold(light, 150.0, 2500.0, within=0.02)
    below, above = (rest(replace(light, speed=k * limit)) for k in (0.96, 1.04))
    assert whirl(below).stable and not whirl(above).stable
    first = whirl(above).values[0]
    ratios = np.abs(first.imag) / np.abs(above.unit.spins)
    assert np.abs(ratios - 0.5).min() < 0.08  # the shaft is not rigid
    refuses(ModelError, "above the threshold: the journals whirl", simulate, above, periods=1)
    stable = light, 0.9 * limit, 0.95 * limit
    refuses(ModelError, "threshold must lie between", transmission.threshold, *stable)


def test_teeth_of_constant_stiffness_excite_little():
    """Only the middle of the load wanders along the face."""
    s = rest(unit(helix=HELIX, width=OVERLAPPING))
    run = simulate(s, periods=0.5, steps=20)
    assert np.ptp(run.teeth) < 0.05 * run.teeth[0]
    assert np.abs(run.q - s.q).max() < 0.01 * np.abs(s.q).max()


@pytest.mark.long
def test_steps_converge_to_a_reference_of_a_tenth_of_the_step(loaded):
    fine = simulate(loaded, periods=0.4, steps=1000)
    coarse = simulate(loaded, periods=0.4, steps=100)
    assert np.ptp(fine.teeth) > 0.2 * fine.teeth[0]
    assert_allclose(coarse.error, fine.error[::10], rtol=0, atol=0.04 * np.ptp(fine.error))
    rms = [np.std(r.teeth) for r in (coarse, fine)]
    assert rms[0] == pytest.approx(rms[1], rel=0.02)
    assert coarse.balance < 1e-6 and fine.balance < 1e-6
    heat = fine.heat.mean() * fine.t[-1]
    assert -fine.work["films"][-1] == pytest.approx(heat, rel=0.01)  # but for spin of the films
    assert set(fine.work) == {"drive", "load", "films", "teeth", "shafts", "kinetic"}


def test_steps_are_those_of_another_program(loaded):
    """Through the loss and the gain of a pair of teeth; but for finite turns of the journals."""
    run = simulate(loaded, periods=0.5, steps=40)
    q, teeth, end, _ = stepped(loaded.unit, loaded.q, None, loaded.theta, 40, 20)
    assert_allclose(run.q, q, atol=1e-4 * np.abs(q).max())
    assert_allclose(run.teeth, teeth, atol=2e-3 * teeth.max())
    assert_allclose(run.v[-1], end[q.shape[1] :], atol=2e-2 * np.abs(run.v).max())
    assert np.ptp(teeth) > 0.1 * teeth[0] and run.balance < 1e-6


@pytest.mark.long
def test_the_response_to_the_mesh_is_where_a_motion_settles():
    """To first order; the motion also feels that the stiffness changes while it vibrates."""
    u = unit(torque=300.0, speed=150.0, loss=4e-5)
    state = rest(u)
    linear = transmission.mesh_response(state, harmonics=12)
    run = simulate(state, periods=6, steps=50)
    last = run.t > run.t[-1] - 2 * u.mesh_period
    assert linear.frequency == pytest.approx(150 / (2 * np.pi) * 26)
    assert linear.mean == pytest.approx(run.teeth[last].mean(), rel=0.01)
    assert linear.error_rms == pytest.approx(np.std(run.error[last]), rel=0.2)
    assert linear.load_factor - 1 == pytest.approx(np.std(run.teeth[last]) / linear.mean, rel=0.3)


@pytest.mark.long
@pytest.mark.parametrize(("helix", "rel"), few(1, [(0.0, 0.15), (HELIX, 0.25)]))
def test_slow_units_have_the_error_of_their_teeth(helix, rel):
    """The error is that of rest; but films resist the tilt of helical gears more when squeezed."""
    width = OVERLAPPING if helix else 0.04
    u = replace(unit(speed=20.0, torque=50.0, helix=helix, width=width), viscosity=0.2)
    linear = transmission.mesh_response(rest(u), harmonics=30, positions=128)
    still = [rest(u, t) for t in 2 * np.pi / 26 * np.arange(16) / 16]
    error = np.array([u.mesh.pair.rb @ (u.wheels @ s.q)[[5, 11]] for s in still])
    assert linear.error_rms == pytest.approx(np.std(error), rel=rel)


test_what_cannot_be_is_said = refused(
    (lambda: unit(torque=-5.0), "contact is lost: a load of"),
    (lambda: unit(speed=0.0), "must be positive"),
    (lambda: transmission.Shaft([0.0, 0.0], 0.05), "must ascend"),
    (lambda: transmission.Shaft([0.0, 0.1], 0.05, [Disc(2, 1.0, 1.0, 1.0)]), "from 0 to 1"),
    (lambda: replace(unit(), pinion=replace(unit().pinion, bearings={9: None})), "from 0 to 4"),
    (lambda: rest(replace(unit(5e3), viscosity=2e-4)), SolverError, "under .* gap of 'gear 0'"),
    error=ModelError,
)
