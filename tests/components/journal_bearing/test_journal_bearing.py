"""Journal bearings against tables, closed forms, and the balance of oil and power."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad, solve_ivp

from cases.components import bearings
from cases.components.bearings import RUN, bearing
from cases.refusals import refused
from rom.components import journal_bearing
from rom.components.journal_bearing import Groove, JournalBearing, coefficients, equilibrium, film
from rom.components.journal_bearing.closed_forms import short_coefficients, short_force
from rom.errors import ConfigError, ModelError, SolverError


@pytest.mark.parametrize("row", bearings.RAIMONDI_BOYD, ids=lambda r: f"{r[0]}-{r[1]}")
def test_a_full_bearing_has_the_numbers_of_raimondi_and_boyd(row):
    slender, e, S, attitude, friction, flow, side, peak = row
    b = bearing(slender, [Groove(np.pi)], (240, 16))
    f = film(b, [e * b.clearance, 0.0], **RUN)
    F, nominal = f.force, b.radius * b.clearance * RUN["speed"] / (2 * np.pi) * b.length
    rough = {0.97: 0.03, 0.4: 0.017}.get(e, 0.012)
    assert f.sommerfeld == pytest.approx(S, rel=rough)
    assert np.degrees(np.arctan2(F[1], -F[0])) == pytest.approx(attitude, abs=0.6)
    assert f.friction() == pytest.approx(friction, rel=rough)
    into = f.flow_around[len(f.P) // 2]
    assert into / nominal == pytest.approx(flow, rel=0.008)
    assert f.side_flow / into == pytest.approx(side, rel=0.008)
    mean = np.hypot(*F[:2]) / (b.diameter * b.length)
    coarse = {0.8: 0.03, 0.9: 0.025, 0.97: 0.075}.get(e, 0.015)
    assert mean / f.pressure.max() == pytest.approx(peak, rel=coarse)


def agree(values, printed):
    values, printed = np.asarray(values), np.asarray(printed)
    off = np.abs(values - printed)
    assert np.all((off < 0.055) | (off < 0.045 * np.abs(printed))), values


@pytest.mark.parametrize("row", bearings.LUND_THOMSEN, ids=lambda r: f"{r[0]}-{r[1]}")
def test_two_grooves_have_the_coefficients_of_lund_and_thomsen(row):
    b = bearing(row[0], bearings.SIDES)
    f = equilibrium(b, bearings.load(b, row[1]), **RUN)
    K, C = coefficients(f)
    assert f.eccentricity == pytest.approx(row[2], abs=0.006)
    assert np.degrees(np.arctan2(*f.motion[[1, 0]])) == pytest.approx(row[3], abs=1.0)
    agree([*K.ravel(), C[0, 0], C[0, 1], C[1, 0], C[1, 1]], [*row[4:10], row[9], row[10]])
    assert journal_bearing.threshold_speed(f) == pytest.approx(row[11], rel=0.02)


@pytest.mark.parametrize("row", bearings.TWO_LOBED)
def test_a_two_lobed_bearing_has_the_coefficients_of_lund_and_thomsen(row):
    b = bearing(1.0, bearings.SIDES, preload=0.5)
    f = equilibrium(b, bearings.load(b, row[0]), **RUN)
    K, C = coefficients(f)
    assert f.eccentricity == pytest.approx(row[1], abs=0.006)
    assert np.degrees(np.arctan2(*f.motion[[1, 0]])) == pytest.approx(row[2], abs=1.0)
    agree([*K.ravel(), C[0, 0], C[0, 1], C[1, 1]], row[3:])


# eccentricity, S (L/D)^2, attitude [deg], Kxx Kxy Kyx Kyy, Cxx, Cxy, Cyy, whirl ratio, threshold
SHORT = [bearings.numbers(line) for line in """
.1 .989979 82.708 1.3284 10.3811 -9.7577 2.5308 20.4872 2.5325 19.7905 .5029 2.7413
.3 .272176 68.178 1.7949 4.4825 -2.6246 2.4126 8.1530 2.4270 6.0612 .5194 2.6058
.5 .106049 53.680 2.9233 3.9766 -.8577 2.2099 6.6148 2.2450 3.0539 .5146 2.5417
.7 .032964 38.704 5.6594 4.5347 .1734 1.9695 7.0987 2.0267 1.6240 .3446 3.6278
.9 .003315 20.826 19.0955 7.2637 1.4213 1.7294 10.9978 1.8059 .6869 0 inf
""".strip().splitlines()]  # fmt: skip


def short_rest(e):
    attitude = journal_bearing.short_attitude(e)
    return e * np.array([np.cos(attitude), np.sin(attitude)])


@pytest.mark.parametrize("row", SHORT, ids=lambda r: f"{r[0]}")
def test_short_bearings_have_their_closed_form_by_quadrature_too(row):
    e, S, attitude, *rest = row
    assert_allclose(journal_bearing.short_sommerfeld(e), S, atol=6e-7)
    assert_allclose(np.degrees(journal_bearing.short_attitude(e)), attitude, atol=6e-4)
    assert journal_bearing.short_eccentricity(S) == pytest.approx(e, rel=3e-5)
    K, C = short_coefficients(e)
    assert_allclose([*K.ravel(), C[0, 0], C[0, 1], C[1, 1]], rest[:7], atol=6e-5)
    s = journal_bearing.stability(K, C, 1.0)
    assert_allclose([s.whirl_ratio, np.sqrt(s.critical_mass)], rest[7:], atol=6e-5)
    x = short_rest(e)
    W, h, still = -short_force(x, (0, 0)), 1e-5, np.zeros(2)
    assert_allclose(W, [1 / (4 * np.pi * S), 0.0], atol=2e-4 * W[0])
    for k, d in enumerate(h * np.eye(2)):
        by_x = short_force(x - d, still) - short_force(x + d, still)
        by_v = short_force(x, still - d) - short_force(x, still + d)
        assert_allclose(K[:, k], by_x / (2 * h * W[0]), rtol=1e-5, atol=1e-5)
        assert_allclose(C[:, k], by_v / (2 * h * W[0]), rtol=1e-5, atol=1e-5)


def test_the_short_bearing_of_friswell():
    """100 mm, 30 mm long, 0.1 mm of clearance, 525 N at 1500 rpm: numbers of ROSS."""
    S = 0.1 * 25 * 0.03 * 0.1 / 525 * 500**2 * 0.3**2
    e = journal_bearing.short_eccentricity(S)
    assert e == pytest.approx(0.266298, abs=1e-6)
    assert journal_bearing.short_eccentricity(S * 2000 / 1500) == pytest.approx(0.212571, abs=1e-6)
    K, C = (a[::-1, ::-1] * [[1, -1], [-1, 1]] * 525 / 1e-4 for a in short_coefficients(e))
    assert_allclose(K / 1e6, [[12.80796, 16.393593], [-25.060393, 8.815303]], rtol=1e-6)
    assert_allclose(C[0] * 1e-3 / (50 * np.pi), [232.89693, -81.924371], rtol=1e-6)
    assert_allclose(C[1, 1] * 1e-3 / (50 * np.pi), 294.911619, rtol=1e-6)


def test_the_film_of_a_short_bearing_is_ocvirks():
    b = bearing(0.02, cells=(360, 20))
    f = film(b, [0.5e-4, 0.0], **RUN)
    assert f.sommerfeld * 0.02**2 == pytest.approx(0.106049, rel=2e-3)
    K, C = coefficients(f)
    short = short_coefficients(0.5)
    assert_allclose(K, short[0], atol=0.02)
    assert_allclose(C, short[1], atol=0.03)


def test_the_film_of_a_long_bearing_is_sommerfelds():
    b = bearing(40.0, [Groove(np.pi)], (360, 8), cavitation="none")
    f = film(b, [0.5e-4, 0.0], **RUN)
    theta = np.linspace(0, 2 * np.pi, 361)[:-1]
    P, exact = f.P[:, 0], journal_bearing.long_pressure(theta - np.pi, 0.5)
    assert_allclose(P, exact, atol=4e-4 * exact.max())
    for k, turn in ((0, lambda t: -np.cos(t)), (1, np.sin)):
        F = quad(lambda t, turn=turn: journal_bearing.long_pressure(t, 0.5) * turn(t), 0, np.pi)[0]
        assert journal_bearing.long_force(0.5)[k] == pytest.approx(F, rel=1e-9)
    for e, S in ((0.2, 0.167359), (0.5, 0.061770), (0.8, 0.025491)):
        assert 1 / (np.pi * np.hypot(*journal_bearing.long_force(e))) == pytest.approx(S, rel=2e-5)


STATE = np.array([0.4e-4, 0.3e-4, 1e-4, -2e-4])
RATE = np.array([5e-4, 2e-4, -0.3e-2, 0.4e-2])


@pytest.mark.parametrize("law", ["none", "reynolds", "jfo"])
def test_stiffness_and_damping_are_the_derivatives_of_the_force(law):
    b = bearing(1.0, [Groove(1.2, 0.3, 1e5, share=0.7)], (60, 8), False, cavitation=law)
    f = film(b, STATE, RATE, **RUN)
    for k, d in enumerate(1e-6 * np.diag(b.scale)):
        K = film(b, STATE - d, RATE, **RUN).force - film(b, STATE + d, RATE, **RUN).force
        size = np.abs(f.stiffness[:, k]).max()
        assert_allclose(f.stiffness[:, k], K / (2 * d[k]), atol=1e-6 * size)
        d = 100 * d
        C = film(b, STATE, RATE - d, **RUN).force - film(b, STATE, RATE + d, **RUN).force
        assert_allclose(f.damping[:, k], C / (2 * d[k]), atol=1e-6 * np.abs(f.damping[:, k]).max())


def test_pressure_and_void_complement_each_other():
    b = bearing(1.0, [Groove(1.2, 0.3)], (60, 8), False, cavitation="jfo")
    f = film(b, STATE, RATE, **RUN)
    assert f.P.min() >= 0 and 0 <= f.fill.min() < 0.8 and f.fill.max() <= 1 + 1e-12
    assert np.abs(f.P * (1 - f.fill)).max() < 1e-12
    start = np.random.default_rng(2).integers(0, 2, f.active.shape)
    assert_allclose(film(b, STATE, RATE, **RUN, warm=start).P, f.P, atol=1e-12)


def test_oil_is_conserved_and_both_laws_agree_when_it_comes_in_at_the_largest_gap():
    b = bearing(1.0, [Groove(np.pi)], cavitation="jfo")
    f = film(b, [0.5e-4, 0.0], **RUN)
    into, out = f.flow_around[[90, 89]]
    assert into - out == pytest.approx(f.side_flow, rel=1e-10)
    void = ~np.any(f.active, axis=1) & (np.arange(180) != 90)
    assert void.sum() > 40
    assert_allclose(f.flow_around[void], out, rtol=1e-10)
    laws = (bearing(1.0, [Groove(np.pi)], cavitation=law) for law in ("reynolds", "jfo"))
    one, other = (film(b, [0.6e-4, 0.0], **RUN) for b in laws)
    assert_allclose(one.P, other.P, atol=1e-12)
    assert one.fill.min() == 1 and other.fill.min() < 0.9


def test_power_is_lost_in_shear_and_in_flow():
    b = bearing(0.8, [Groove(-2.0)], (90, 12), False, cavitation="jfo")
    f = film(b, STATE, RATE, **RUN)
    h, p, mu = f.thickness, f.pressure, f.viscosity
    cell = b.radius * 2 * np.pi / 90 * b.length / 12
    shear = np.sum(mu * (f.speed * b.radius) ** 2 * f.fill / h) * cell
    grid, (x, y, a, c) = f.bearing.grid, STATE
    theta, z = 2 * np.pi * (np.arange(90) + 0.5) / 90, grid.Z * b.length

    def gap(theta, z):
        return b.clearance - (x + z * c) * np.cos(theta) - (y - z * a) * np.sin(theta)

    around = np.diff(np.vstack([p, p[:1]]), axis=0) / (b.radius * 2 * np.pi / 90)
    flow = np.sum(gap(theta[:, None], z) ** 3 * around**2) / (12 * mu) * cell
    faces, dz = grid.Z_face * b.length, b.length / 12
    along = np.diff(np.hstack([np.zeros((90, 1)), p, np.zeros((90, 1))]), axis=1) / dz
    share = np.array([2.0, *[1.0] * 11, 2.0])  # the drop to the ends takes half a cell
    nodes = 2 * np.pi * np.arange(90) / 90
    flow += np.sum(share * gap(nodes[:, None], faces) ** 3 * along**2) / (12 * mu) * cell
    assert f.dissipated == pytest.approx(shear + flow, rel=1e-11)


def test_a_tilted_journal_is_carried_from_both_ends_alike():
    b = bearing(1.0, (), (90, 8), False)
    f = film(b, [0.4e-4, 0.0, 0.0, 3e-4], **RUN).force
    other = film(b, [0.4e-4, 0.0, 0.0, -3e-4], **RUN).force
    assert_allclose(f, other * [1, 1, -1, -1], atol=1e-9 * np.abs(f).max())
    assert f[3] * 3e-4 < 0  # it is turned back
    half = film(bearing(1.0, (), (90, 4)), [0.4e-4, 0.0], **RUN).force
    assert_allclose(film(b, [0.4e-4, 0.0], **RUN).force, half, atol=1e-9 * np.abs(half).max())


def test_the_force_converges_with_the_square_of_the_cells():
    cells = [(60, 5), (120, 10), (240, 20)]
    F = [film(bearing(1.0, [Groove(np.pi)], c), [0.5e-4, 0], **RUN).force[1] for c in cells]
    assert 1.7 < np.log2((F[0] - F[1]) / (F[1] - F[2])) < 2.3


@pytest.mark.parametrize("row", bearings.INLETS, ids=lambda r: f"{r[0]}-{r[1]}")
def test_where_oil_comes_in_matters_when_oil_is_conserved(row):
    b = bearing(0.5, [Groove(np.radians(row[0]), np.radians(20))], cavitation=row[1])
    f = equilibrium(b, bearings.load(b, 0.5), **RUN)
    assert f.eccentricity == pytest.approx(row[2], abs=0.01)
    assert np.degrees(np.arctan2(*f.motion[[1, 0]])) == pytest.approx(row[3], abs=1.5)
    assert_allclose(coefficients(f)[0].ravel(), row[4:8], atol=0.2)
    assert journal_bearing.threshold_speed(f) == pytest.approx(row[8], rel=0.03)


# torque on a pinion of 26 teeth, module 4: eccentricity, attitude [deg], travel along the load and
# across [micrometres], Kxx [N/m]
PINION = [
    (50, .4648, 51.82, 14.37, 18.27, 2.64e7), (100, .6129, 42.90, 22.45, 20.86, 7.61e7),
    (200, .7328, 35.35, 29.88, 21.20, 2.22e8), (500, .8454, 27.24, 37.58, 19.35, 9.37e8),
    (1000, .9019, 22.24, 41.74, 17.07, 2.83e9),
]  # fmt: skip


@pytest.mark.parametrize("row", PINION, ids=lambda r: f"{r[0]} N m")
def test_the_bearings_of_a_pinion_let_it_travel(row):
    b = JournalBearing(0.05, 0.025, 50e-6, bearings.SIDES, cells=(180, 12), aligned=True)
    W = row[0] / (0.052 * np.cos(np.radians(20))) / 2
    f = equilibrium(b, (W, 0.0), speed=100 * np.pi, viscosity=0.02)
    assert f.eccentricity == pytest.approx(row[1], abs=1.5e-3)
    assert np.degrees(np.arctan2(*f.motion[[1, 0]])) == pytest.approx(row[2], abs=0.2)
    assert_allclose(1e6 * f.motion[:2], row[3:5], atol=0.1)
    assert f.stiffness[0, 0] == pytest.approx(row[5], rel=0.02)


def short_critical_mass(e):
    return journal_bearing.stability(*short_coefficients(e), 1.0).critical_mass


def test_short_bearings_whirl_least_willingly_up_to_a_speed():
    e = np.linspace(0.40, 0.52, 121)
    speed = np.sqrt([short_critical_mass(x) for x in e])
    assert min(speed) == pytest.approx(2.53171, abs=1e-5)
    assert e[np.argmin(speed)] == pytest.approx(0.4570, abs=1e-3)
    assert np.isfinite(short_critical_mass(0.756)) and np.isinf(short_critical_mass(0.7561))


@pytest.mark.parametrize(("speed", "grows"), [(2.50, False), (2.55, True)])
def test_a_rotor_in_short_bearings_whirls_beyond_the_threshold(speed, grows):
    e = 0.457
    rest = short_rest(e)
    W = short_force(rest, (0, 0))

    def motion(_, s):
        force = short_force(s[:2], s[2:]) / -W[0]
        return [*s[2:], *((np.array([1.0, 0.0]) + force) / speed**2)]

    s = solve_ivp(motion, (0, 300), [rest[0] + 2e-3, rest[1], 0, 0], rtol=1e-8, atol=1e-10)
    away = np.hypot(*(s.y[:2] - rest[:, None]))
    early, late = away[(s.t > 50) & (s.t < 100)].max(), away[s.t > 250].max()
    assert (late > 1.02 * early) == grows
    turned = np.unwrap(np.arctan2(*(s.y[:2] - rest[:, None])[::-1]))[s.t > 150]
    whirl = (turned[-1] - turned[0]) / np.ptp(s.t[s.t > 150])
    expected = journal_bearing.stability(*short_coefficients(e), 1.0).whirl_ratio
    assert whirl == pytest.approx(expected, abs=0.01) == pytest.approx(0.5, abs=0.03)


@pytest.mark.parametrize(("grade", "A", "B", "nu"), [
    (32, 9.5308, 3.7466, 15.19), (46, 9.4180, 3.6844, 20.62), (68, 9.3097, 3.6244, 28.66),
])  # fmt: skip
def test_oil_thins_by_walthers_law(grade, A, B, nu):
    oil = journal_bearing.iso_vg(grade)
    assert_allclose(oil.law(), (A, B), atol=6e-5)
    assert_allclose(oil.viscosity([40, 60]), np.array([grade, nu]) * 870e-6, rtol=4e-4)


def test_the_heat_that_leaves_is_the_heat_that_is_made():
    b, oil = bearing(1.0, [Groove(np.pi)], (120, 8)), journal_bearing.iso_vg(46)
    given = {"speed": 300.0, "inlet": 40.0, "carried": 1.0}
    w = journal_bearing.warm_equilibrium(b, (3000.0, 0.0), oil, **given)
    assert w.film.viscosity == pytest.approx(float(oil.viscosity(w.temperature)), rel=1e-6)
    assert 40 < w.temperature == pytest.approx(40 + w.rise / 2, abs=1e-5)
    assert oil.density * oil.heat * w.film.side_flow * w.rise == pytest.approx(w.power, rel=1e-9)
    assert w.power == pytest.approx(w.film.friction_torque * 300.0, rel=1e-12)


def test_raimondi_and_boyds_rise_of_temperature():
    f = film(bearing(1.0, [Groove(np.pi)], (240, 16)), [0.6e-4, 0.0], **RUN)
    flow, side = f.flow_around[120], f.side_flow
    pressure = np.hypot(*f.force[:2]) / 0.1**2
    assert f.dissipated / (flow - side / 2) / pressure == pytest.approx(14.2, rel=0.01)


def test_heat_closes_and_opens_the_clearance():
    b, warm = bearing(), journal_bearing.warm_bearing
    assert warm(b, bush=20, shaft=20).clearance == pytest.approx(b.clearance)
    assert warm(b, bush=0, shaft=20).clearance == pytest.approx(1e-4 - 0.05 * 11.7e-6 * 20)


DRY = bearing(0.5, [Groove(np.radians(20), np.radians(20))], cavitation="jfo")  # where it bears

test_what_cannot_be_is_said = refused(
    (lambda: equilibrium(DRY, bearings.load(DRY, 0.05), **RUN), SolverError, "grooves at 20 deg"),
    (lambda: journal_bearing.warm_bearing(bearing(), bush=0, shaft=200), "the shaft seizes"),
    (lambda: JournalBearing(0.1, 0.1, 0.1), "a film is thin"),
    (lambda: bearing(cavitation="jfo"), "without a groove has no oil"),
    (lambda: bearing(cells=(8, 8)), "too few"),
    (lambda: film(bearing(), [1.1e-4, 0], **RUN), "touches the bush"),
    (lambda: film(bearing(), [0, 0, 1e-4, 0], **RUN), "bearing is aligned"),
    (lambda: film(bearing(), [0, 0], speed=-1.0, viscosity=0.1), "from its other end"),
    (lambda: equilibrium(bearing(), [0, 0], **RUN), "presses the journal nowhere"),
    (lambda: journal_bearing.short_sommerfeld(1.2), "must lie between 0 and 1"),
    (lambda: journal_bearing.short_eccentricity(0.0), "sommerfeld = "),
    (lambda: journal_bearing.stability(np.eye(2), -np.eye(2), 1.0), "feeds the whirl"),
    (lambda: journal_bearing.Oil(5.0, 40.0), "hot oil is thinner"),
    (lambda: journal_bearing.iso_vg(10), "ISO VG 10"),
    error=(ConfigError, ModelError),
)
