"""Rotors at rest on films: tables of bearings, stability of whirl, and heat, by equilibria."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.components.bearings import INLETS, LUND_THOMSEN, RAIMONDI_BOYD, SIDES, TWO_LOBED, bearing
from cases.components.bearings import load as load_along
from cases.long import few
from cases.mbs.films import SPEED, VISCOSITY, held_rotor, resting
from cases.refusals import refused
from rom.components import journal_bearing as component
from rom.mbs import Groove, JournalBearing, iso_vg


def rotor(b, W, **more):
    return held_rotor(b, (W, 0.0), speed=SPEED, oil=VISCOSITY, **more)


def assert_rests(place, b, e, attitude, within=1.0):
    """At an eccentricity, within 0.01 clearances, and an angle [degrees]."""
    x, y = place / b.clearance
    assert np.hypot(x, y) == pytest.approx(e, abs=0.01)
    assert np.degrees(np.arctan2(y, x)) == pytest.approx(attitude, abs=within)


def threshold(K, C, W, c=1e-4):
    """Speed times sqrt(c/g) at which a rigid rotor of that weight begins to whirl."""
    found = component.stability(K, C, SPEED)
    return SPEED * np.sqrt(found.critical_mass * c / W)


@pytest.mark.parametrize("row", [RAIMONDI_BOYD[k] for k in (3, 4, 9, 12, 15, 17)], ids=str)
def test_a_rotor_rests_where_raimondi_and_boyd_say(row):
    """A full bearing whose film begins where it is thickest: a groove there, found by iteration."""
    slender, e, S, attitude, friction, flow, share, _ = row
    turn = np.radians(attitude) + np.pi
    b = bearing(slender, [Groove(turn)], (240, 12))
    W = load_along(b, S)[0]
    mech = rotor(b, W)
    state = rom.equilibrium(mech, spin={"turn": SPEED})
    found = rom.mbs.snapshot(mech, state).journal_bearing("film")
    assert_rests(found.motion[0, :2], b, e, attitude)
    assert found.thinnest[0] == pytest.approx(b.clearance * (1 - e), rel=0.05)
    torque = found.power[0] / SPEED
    # of the oil there is: the table has shear all around, as this film
    assert torque / (W * b.clearance) == pytest.approx(friction, rel=0.02)
    unit = b.radius * b.clearance * b.length * SPEED / (2 * np.pi)
    assert found.side_flow[0] / unit == pytest.approx(share * flow, rel=0.02)


@pytest.mark.parametrize("row", [LUND_THOMSEN[k] for k in (0, 2, 4, 5, 7, 9)], ids=str)
def test_coefficients_of_lund_and_thomsen(row):
    b = bearing(row[0], SIDES)
    W = load_along(b, row[1])[0]
    state, K, C = resting(rotor(b, W), SPEED)
    assert_rests(state.q[:2], b, *row[2:4])
    assert_allclose(K.ravel() * 1e-4 / W, row[4:8], atol=0.05, rtol=0.04)
    assert_allclose(C[[0, 0, 1], [0, 1, 1]] * 1e-4 * SPEED / W, row[8:11], atol=0.05, rtol=0.04)
    assert C[0, 1] == pytest.approx(C[1, 0], rel=1e-6)
    assert threshold(K, C, W) == pytest.approx(row[11], rel=0.02)


def test_coefficients_are_those_of_the_component():
    b = bearing(0.5, [Groove(2.0, 0.3, 1e5)], (60, 6))
    alone = component.equilibrium(b, (3000.0, 0.0), speed=SPEED, viscosity=VISCOSITY)
    state, K, C = resting(rotor(b, 3000.0), SPEED)
    assert_allclose(state.q[:2], alone.motion[:2], rtol=1e-8)
    assert_allclose(K, alone.stiffness[:2, :2], rtol=1e-6)
    assert_allclose(C, alone.damping[:2, :2], rtol=1e-6)


def test_a_short_bearing_has_the_numbers_of_friswell_and_ross():
    """D = 100, L = 30 mm, c = 0.1 mm, 0.1 Pa s, 525 N, 1500 rpm; Ocvirk's film is shorter yet."""
    speed = 1500 * np.pi / 30
    b = JournalBearing(0.1, 0.03, 1e-4, (), cells=(240, 12), aligned=True)
    mech = held_rotor(b, (525.0, 0.0), speed=speed, oil=0.1)
    state, K, C = resting(mech, speed)
    assert np.hypot(*state.q[:2]) / 1e-4 == pytest.approx(0.266298, rel=0.1)
    # as L / D falls the film becomes Ocvirk's: the same load over (L / D)^2
    short = replace(b, length=1e-3)
    W = 525.0 / 30**3
    state, K, C = resting(held_rotor(short, (W, 0.0), speed=speed, oil=0.1, mass=1e-4), speed)
    assert np.hypot(*state.q[:2]) / 1e-4 == pytest.approx(0.266298, rel=5e-3)
    K, C = (x[::-1, ::-1] * [[1, -1], [-1, 1]] * 30**3 for x in (K, C))
    assert_allclose(K / 1e6, [[12.80796, 16.393593], [-25.060393, 8.815303]], rtol=2e-2)
    assert_allclose(C[0] / 1e3, [232.89693, -81.924371], rtol=2e-2)
    assert C[1, 1] / 1e3 == pytest.approx(294.911619, rel=2e-2)


@pytest.mark.parametrize("row", [INLETS[k] for k in (0, 1, 3, 5, 6, 7, 9)], ids=str)
def test_where_oil_comes_in_matters_when_oil_is_conserved(row):
    b = bearing(0.5, [Groove(np.radians(row[0]), np.radians(20))], cavitation=row[1])
    W = load_along(b, 0.5)[0]
    state, K, _ = resting(rotor(b, W), SPEED)
    assert_rests(state.q[:2], b, *row[2:4], within=1.5)
    assert_allclose(K.ravel() * 1e-4 / W, row[4:8], atol=0.2)


@pytest.mark.parametrize("row", TWO_LOBED)
def test_an_elliptical_bore_is_one_of_two_lobes(row):
    b = bearing(1.0, SIDES, (120, 8), bore=rom.mbs.multilobe(2, 0.5))
    W = load_along(b, row[0])[0]
    state, K, C = resting(rotor(b, W), SPEED)
    assert_allclose(K.ravel() * 1e-4 / W, row[3:7], atol=0.3, rtol=0.05)
    assert_allclose(C[[0, 0, 1], [0, 1, 1]] * 1e-4 * SPEED / W, row[7:], atol=0.3, rtol=0.05)
    halves = bearing(1.0, SIDES, (120, 8), preload=0.5)
    assert_allclose(b.grid.bore, halves.grid.bore, atol=1e-15)
    again, *_ = resting(rotor(halves, W), SPEED)
    assert_allclose(again.q[:2], state.q[:2], rtol=1e-9)


def test_lobes_begin_where_they_are_told():
    """Narrow in the middle of each arc, as wide as the clearance where the arcs meet at two."""
    bore = rom.mbs.multilobe(3, 0.4, first=0.3)
    middles = 0.3 + 2 * np.pi * np.arange(3) / 3
    assert_allclose(bore(middles), 0.6, rtol=1e-12)
    assert_allclose(bore(middles + np.pi / 3), 1 - 0.4 * np.cos(np.pi / 3), rtol=1e-12)


test_lobes_that_leave_no_room_are_named = refused(
    (lambda: rom.mbs.multilobe(0, 0.4), "must be at least 1"),
    (lambda: bearing(bore=lambda angles: 0 * angles), "bore must be > 0"),
    (lambda: bearing(bore=rom.mbs.multilobe(3, 0.4), preload=0.5), "a bore of its own"),
    error=rom.ModelError,
)


def test_three_lobes_are_alike():
    b = bearing(1.0, [Groove(2 * np.pi * (k + 0.5) / 3, 0.2) for k in range(3)], (120, 8),
                bore=rom.mbs.multilobe(3, 0.4))  # fmt: skip
    turn = np.array([[-0.5, -np.sqrt(0.75)], [np.sqrt(0.75), -0.5]])
    loads = np.array([3000.0, 500.0]), turn @ [3000.0, 500.0]
    found = [resting(held_rotor(b, W, speed=SPEED, oil=VISCOSITY), SPEED)[0] for W in loads]
    assert_allclose(found[1].q[:2], turn @ found[0].q[:2], rtol=1e-8)
    assert b.grid.bore.min() == pytest.approx(0.6, abs=1e-12)


@pytest.mark.parametrize(("w", "after"), few(2, [(2.50, 0.00054), (2.65, 0.126), (2.55, 0.0033)]))
def test_a_rigid_rotor_whirls_beyond_the_threshold(w, after):
    """Short bearing at 0.457 clearances, threshold 2.53; own computation of 600 rad elsewhere."""
    b = bearing(0.02, cells=(120, 3))
    W = component.film(b, [0.457e-4, 0.0], speed=SPEED, viscosity=VISCOSITY).force
    W = float(np.hypot(*W[:2]))
    mass = W * w**2 / (1e-4 * SPEED**2)  # W = m g, speed sqrt(c / g) = w
    mech = rotor(b, W, mass=mass)
    state = rom.equilibrium(mech, spin={"turn": SPEED})
    q = state.q.copy()
    q[[0, 7, 14]] += 2e-3 * b.clearance
    sol = rom.simulate(mech, t_end=6.0, dt=1e-3, state=replace(state, q=q), progress=False)
    away = (sol.journal_bearing("film").motion[:, :2] - state.q[:2]) / b.clearance
    assert np.hypot(*away[-500:].T).max() == pytest.approx(after, rel=0.12)


@pytest.mark.parametrize("pressure", [0.0, 2e5])
def test_the_temperature_is_the_one_that_the_film_makes(pressure):
    oil = iso_vg(46)
    b = bearing(0.5, [Groove(2.0, 0.3, pressure)], (60, 6))
    alone = component.warm_equilibrium(b, (3000.0, 0.0), oil, speed=300.0, inlet=40.0)
    mech = held_rotor(b, (3000.0, 0.0), speed=300.0, oil=oil, inlet=40.0)
    state, K, _ = resting(mech, 300.0)
    found = rom.mbs.snapshot(mech, state).journal_bearing("film")
    assert found.temperature[0] == pytest.approx(alone.temperature, abs=5e-6)
    assert found.power[0] == pytest.approx(alone.power, rel=1e-6)
    assert found.side_flow[0] == pytest.approx(alone.film.side_flow, rel=1e-6)
    assert_allclose(state.q[:2], alone.film.motion[:2], rtol=1e-6)
    assert found.temperature[0] > 45.0
    # small motions are faster than heat: those of the film at this temperature
    assert_allclose(K, alone.film.stiffness[:2, :2], rtol=1e-6)


def test_the_temperature_follows_with_its_time():
    oil, b, lag = iso_vg(46), bearing(0.5, [Groove(2.0, 0.3)], (40, 4)), 0.2
    moves = (lambda t: 0.4e-4, lambda t: 0.3e-4)
    mech = held_rotor(b, (0, 0), speed=300.0, oil=oil, inlet=40.0, thermal_time=lag, moves=moves)
    sol = rom.simulate(mech, t_end=12 * lag, dt=2e-3, progress=False)
    found = sol.journal_bearing("film")
    T = found.temperature
    warm = component.film(b, (0.4e-4, 0.3e-4), speed=300.0, viscosity=float(oil.viscosity(T[-1])))
    rise = 0.45 * warm.dissipated / (oil.density * oil.heat * warm.side_flow)
    assert T[0] == 40.0 and T[-1] == pytest.approx(40.0 + rise, abs=1e-3) and rise > 5.0
    aim = 40.0 + 0.45 * found.power / (870 * 2000 * found.side_flow)
    rate = np.gradient(T, sol.t)
    assert_allclose(rate[2:-2], ((aim - T) / lag)[2:-2], atol=0.02 * rate.max())


def test_each_film_has_its_own_oil():
    b = bearing(0.5, [Groove(np.pi, 0.3)], (60, 6))
    mech = held_rotor(b, (4000.0, 0.0), speed=300.0, oil=1.0)
    mech.elements.pop("film")
    shaft = mech.part("shaft")
    for name, z, inlet in (("cool", 0.1, 40.0), ("hot", -0.1, 70.0)):
        mech.journal_bearing(name, shaft.marker((0, 0, z)), mech.ground.marker((0, 0, z)),
                             axis=(0, 0, 1), bearing=b, oil=iso_vg(46), inlet=inlet)  # fmt: skip
    found = rom.mbs.snapshot(mech, rom.equilibrium(mech, spin={"turn": 300.0}))
    cool, hot = (found.journal_bearing(name) for name in ("cool", "hot"))
    assert_allclose(cool.motion, hot.motion, atol=1e-15)
    assert hot.temperature[0] > 70.0 and 40.0 < cool.temperature[0] < 70.0
    ratio = cool.pressure[0] / hot.pressure[0]
    oil_ratio = iso_vg(46).viscosity(cool.temperature[0]) / iso_vg(46).viscosity(hot.temperature[0])
    assert ratio == pytest.approx(float(oil_ratio), rel=1e-9)
