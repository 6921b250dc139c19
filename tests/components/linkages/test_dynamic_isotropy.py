"""Isotropic configurations of planar linkages: closed forms, the multibody core, topology."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import root

from cases.refusals import refused, refuses
from rom.components import linkages
from rom.components.linkages import angle_grid, closed_loci, isotropic_configurations
from rom.components.linkages.dynamic_isotropy import christoffel
from rom.components.linkages.two_dof_linkages import FiveBar, Link, TwoLink, rigid_link, rod
from rom.errors import ConfigError, ModelError, SolverError

FIVE = FiveBar(0.7, (rod(2.0, 0.3),) * 2, (rod(1.0, 0.8),) * 2, payload=0.5)
TWO = TwoLink(rod(1.0, 0.5), rod(2.0, 0.4))
# computed on grids of 200, 400 and 800 cells per turn: angles [deg], winding, inertia [kg m^2]
TABLE = np.array(
    [
        [13.30724, 246.80342, 1, 0.094396],
        [19.68505, 227.82258, 1, 0.090000],
        [64.08864, 115.91136, -1, 0.094096],
        [71.44700, 108.55300, -1, 0.090000],
        [135.72310, 44.27690, -1, 0.224984],
        [225.57300, 314.42700, -1, 0.090000],
        [293.19658, 166.69276, 1, 0.094396],
        [312.17742, 160.31495, 1, 0.090000],
    ]
)


@pytest.fixture(scope="module")
def found():
    return isotropic_configurations(FIVE.inertia)


def test_best_index_of_the_two_link_chain_is_at_right_angles():
    index = linkages.isotropy_index(TWO.inertia(*angle_grid(360)))
    assert index.max() == pytest.approx(0.723026, abs=1e-6)
    i, j = np.unravel_index(np.argmax(index), index.shape)
    assert abs(i - j) in (90, 270)
    assert not isotropic_configurations(TWO.inertia, n=90).winding.size


def test_equal_diagonal_makes_a_curve_of_isotropy():
    """a = c, reached by a payload, which adds m l1^2 and m l2^2."""
    m2, l1, l2 = 0.4, 0.3, 0.5
    links = rigid_link(1.0, l1, (0.1, 0.0), 0.02), rod(m2, l2)
    a, c = 0.02 + 0.01 + m2 * l1**2, m2 * l2**2 / 3
    chain = TwoLink(*links, payload=(a - c) / (l2**2 - l1**2))
    found = isotropic_configurations(chain.inertia, n=60)
    apart = np.degrees(np.ptp(found.q, axis=1))
    assert len(apart) > 60 and not found.winding.any()
    assert_allclose(np.minimum(apart, 360 - apart), 90.0, atol=1e-6)


def test_relative_angles_need_twice_the_inertia():
    """a = 2 c and cos q2 = -c / b, whatever q1; b^2 < a c, as for any real links."""
    second, l1 = rod(1.0, 0.3), 0.22
    c, b = 0.03, l1 * 0.15
    first = rigid_link(1.0, l1, (0.1, 0.0), 2 * c - 0.01 - l1**2 + 0.3)
    a = first.M[2, 2] + l1**2
    assert a != pytest.approx(2 * c)
    assert not isotropic_configurations(TwoLink(first, second, relative=True).inertia, n=60).q.size
    light = replace(first, M=first.M - np.diag([0, 0, a - 2 * c]))
    found = isotropic_configurations(TwoLink(light, second, relative=True).inertia, n=60)
    assert_allclose(np.cos(found.q[:, 1]), -c / b, atol=1e-9)
    assert np.unique(np.round(found.q[:, 0], 6)).size > 30


def test_five_bar_has_the_eight_isotropic_configurations_of_the_table(found):
    assert_allclose(np.degrees(found.q), TABLE[:, :2], atol=6e-6)
    assert_allclose(found.winding, TABLE[:, 2])
    assert_allclose(found.inertia, TABLE[:, 3], atol=6e-7)
    A = FIVE.inertia(*found.q.T)
    assert_allclose(A, found.inertia[:, None, None] * np.eye(2), atol=1e-11)
    mirrored = np.mod(np.pi - found.q[:, ::-1], 2 * np.pi)
    mirrored = mirrored[np.lexsort(mirrored.T[::-1])]
    assert_allclose(mirrored, found.q, atol=1e-9)
    again = isotropic_configurations(lambda a, b: 1e4 * FIVE.inertia(a, b), n=200)
    assert_allclose(again.q, found.q, atol=1e-9)
    assert_allclose(again.inertia, 1e4 * found.inertia, rtol=1e-9)


@pytest.mark.parametrize("n", [60, 120, 200, 800])
def test_the_number_of_configurations_does_not_depend_on_the_grid(found, n):
    assert_allclose(isotropic_configurations(FIVE.inertia, n=n).q, found.q, atol=1e-9)


def test_other_lengths_have_other_numbers_of_configurations():
    short = FiveBar(0.65, (rod(2.0, 0.3),) * 2, (rod(1.0, 0.7),) * 2, payload=0.5)
    assert 2 * 0.7 > 0.65 + 2 * 0.3 and 0.65 > 2 * 0.3
    for n in (150, 300):
        found = isotropic_configurations(short.inertia, n=n)
        assert found.winding.size == 12 and found.winding.sum() == 0


ORDINARY = FiveBar(0.7, (rod(2.0, 0.3),) * 2, (rod(1.0, 0.4),) * 2, payload=0.5)


@pytest.mark.parametrize("side", [1, -1])
def test_cranks_of_limited_range_have_maps_points_and_closed_loci(side):
    five = replace(ORDINARY, side=side)
    refuses(ModelError, "elbows are", lambda: five.inertia(*angle_grid(40)))
    found = isotropic_configurations(five.inertia, n=300, assembles=five.assembles)
    A = five.inertia(*found.q.T)
    assert_allclose(A, found.inertia[:, None, None] * np.eye(2), atol=1e-10)
    l1, l2, d, still = 0.3, 0.4, five.base, []  # no motor moves the tip: cranks, couplers in line
    for one, other, up in np.array(np.meshgrid([1, -1], [1, -1], [1, -1])).reshape(3, -1).T:
        a, b = l2 + one * l1, l2 + other * l1  # of the tip from both pivots
        x = (d * d + a * a - b * b) / (2 * d)
        if x * x < a * a:
            tip = np.array([x, up * np.sqrt(a * a - x * x)])
            arms = one * tip, other * (tip - [d, 0])
            q = np.array([np.arctan2(arm[1], arm[0]) for arm in arms]) % (2 * np.pi)
            if np.allclose(five.posture(*q)[2], tip):  # else it is the other side's
                still.append(q)
    assert len(still) >= 2
    for q in still:
        k = np.abs(found.q - q).max(axis=1).argmin()
        assert_allclose(found.q[k], q, atol=1e-8)
        assert found.inertia[k] == pytest.approx((2.0 + 1.0) * 0.3**2 / 3)
    again = isotropic_configurations(five.inertia, n=500, assembles=five.assembles)
    assert_allclose(again.q, found.q, atol=1e-8)
    mirror = replace(five, side=-side)
    other = isotropic_configurations(mirror.inertia, n=300, assembles=five.assembles)
    mirrored = np.mod(-other.q, 2 * np.pi)  # in the line of the pivots
    assert_allclose(mirrored[np.lexsort(mirrored.T[::-1])], found.q, atol=1e-8)
    index = linkages.index_map(five.inertia, n=200, assembles=five.assembles)
    there = five.assembles(*angle_grid(200))
    assert 0.3 < there.mean() < 0.9 and np.all(index[~there] == 0) and np.all(index[there] > 0)
    for curve in closed_loci(index, 0.6):
        assert_allclose((curve[-1] - curve[0]) % (2 * np.pi) % (2 * np.pi - 1e-9), 0, atol=1e-8)


def test_another_search_finds_the_points_of_limited_cranks():
    """From random starts, by the solver of another library."""
    found = isotropic_configurations(ORDINARY.inertia, n=300, assembles=ORDINARY.assembles)

    def out(q):
        if not ORDINARY.assembles(*q):
            return np.array([1e3, 1e3])
        A = ORDINARY.inertia(*q)
        return np.array([A[0, 0] - A[1, 1], 2 * A[0, 1]]) / np.trace(A)

    rng, met = np.random.default_rng(0), []
    for q in rng.uniform(0, 2 * np.pi, (300, 2)):
        if ORDINARY.assembles(*q):
            got = root(out, q, tol=1e-12)
            if np.abs(got.fun).max() < 1e-10:
                met.append(np.mod(got.x, 2 * np.pi))
    apart = [np.abs((found.q - q + np.pi) % (2 * np.pi) - np.pi).max(axis=1).min() for q in met]
    assert len(met) > 40 and max(apart) < 1e-6


def test_cranks_that_cannot_assemble_are_named():
    far = FiveBar(2.0, (rod(2.0, 0.3),) * 2, (rod(1.0, 0.4),) * 2)
    for search in (isotropic_configurations, linkages.index_map):
        with pytest.raises(ModelError, match="none of 40 by 40 positions of the cranks"):
            search(far.inertia, n=40, assembles=far.assembles)


def test_principal_directions_make_half_a_turn_around_each_point(found):
    """Eigenvectors of A have no sign: followed around a circle they come back turned by pi."""
    angle = np.linspace(0, 2 * np.pi, 721)
    for q, winding in zip(found.q, found.winding, strict=True):
        A = FIVE.inertia(*(q[:, None] + 0.01 * np.array([np.cos(angle), np.sin(angle)])))
        easy = np.linalg.eigh(A)[1][:, :, 0]
        direction = np.unwrap(np.arctan2(easy[:, 1], easy[:, 0]), period=np.pi)
        assert direction[-1] - direction[0] == pytest.approx(winding * np.pi, abs=1e-6)


def test_four_configurations_do_not_move_the_tip(found):
    """There each motor moves its own coupler end: (m1 + m2) l1^2 / 3, whatever the payload."""
    still = TABLE[:, 3] == 0.09
    assert_allclose(found.inertia[still], (2.0 + 1.0) * 0.3**2 / 3, rtol=1e-10)
    heavy = replace(FIVE, payload=7.0)
    assert_allclose(heavy.inertia(*found.q[still].T), FIVE.inertia(*found.q[still].T), atol=1e-9)


def test_every_locus_closes():
    index = linkages.isotropy_index(FIVE.inertia(*angle_grid(400)))
    for level in (0.3, 0.5, 0.7, 0.9, 0.97, 0.99, 0.9999):
        curves = closed_loci(index, level)
        assert curves
        for curve in curves:
            around = (curve[-1] - curve[0]) / (2 * np.pi)
            assert_allclose(around, np.round(around), atol=1e-12)
            assert np.abs(np.diff(curve, axis=0)).max() <= 2 * np.pi / 400 * (1 + 1e-9)
            on = linkages.isotropy_index(FIVE.inertia(*curve.T))
            assert_allclose(on, level, atol=5e-4)


@pytest.mark.long
def test_loci_near_one_surround_the_isotropic_points_one_by_one(found):
    n = 800
    curves = closed_loci(linkages.isotropy_index(FIVE.inertia(*angle_grid(n))), 0.9999)
    centres = np.mod(np.array([c[:-1].mean(axis=0) for c in curves]), 2 * np.pi)
    assert len(curves) == 8
    centres = centres[np.lexsort(centres.T[::-1])]
    assert_allclose(centres, found.q, atol=0.02)


def test_loci_of_the_chain_go_around_the_torus():
    """The index depends on q1 - q2: straight lines of slope one that leave through the seam."""
    curves = closed_loci(linkages.isotropy_index(TWO.inertia(*angle_grid(100))), 0.7)
    assert len(curves) == 4
    for curve in curves:
        assert_allclose(np.abs(curve[-1] - curve[0]), 2 * np.pi, atol=1e-12)
        assert np.ptp(curve[:, 0] - curve[:, 1]) < 1e-12


def test_saddles_between_four_hills_are_joined_once():
    """cos x cos y at level zero: every cell beside a crossing is a saddle on an odd grid."""
    q1, q2 = angle_grid(9)
    for level in (-0.02, 0.0, 0.03):
        curves = closed_loci(np.cos(q1) * np.cos(q2), level)
        inside = np.cos(q1) * np.cos(q2) >= level
        edges = sum((inside != np.roll(inside, 1, axis=a)).sum() for a in (0, 1))
        assert sum(len(c) - 1 for c in curves) == edges


def test_equal_cranks_that_bend_keep_the_isotropic_postures(found):
    """They see mass at elbows alone; (3 s^2 - s^3) / 2 has integrals 3/8, 11/40 and 33/140."""
    M = np.zeros((4, 4))
    M[:3, :3] = rod(2.0, 0.3).M
    M[3] = M[:, 3] = 2.0 * np.array([0.0, 3 / 8, 0.3 * 11 / 40, 33 / 140])
    bending = Link(0.3, M, np.array([[0.0], [1.0]]), np.ones((1, 1)))
    five = replace(FIVE, cranks=(bending, bending))
    bent = isotropic_configurations(lambda a, b: five.inertia(a, b, elastic="free"), n=200)
    assert_allclose(bent.q, found.q, atol=1e-8)
    # sums of the mass m that each elbow carries with the crank: by hand
    m = (found.inertia - 0.06) / 0.3**2
    J, S, E = 0.06 + m * 0.09, 2 * 0.3 * 11 / 40 + m * 0.3, 2 * 33 / 140 + m
    assert_allclose(bent.inertia, J - S**2 / E, rtol=1e-9)


def test_a_balanced_chain_is_dynamically_uniform():
    """Mass centre of the second link on the elbow: constant inertia, no Coriolis terms."""
    balanced = TwoLink(rod(1.0, 0.5), rigid_link(2.0, 0.4, (0.0, 0.0), 0.02))
    assert np.abs(christoffel(balanced.inertia, (0.3, 1.0))).max() < 1e-11
    symbols = christoffel(TWO.inertia, (0.3, 1.0))
    h = 2.0 * 0.5 * 0.2 * np.sin(0.3 - 1.0)
    assert_allclose(symbols[0, 1, 1], h, rtol=1e-8)
    assert_allclose(symbols[1, 0, 0], -h, rtol=1e-8)
    assert_allclose([symbols[0, 0, 0], symbols[0, 0, 1], symbols[1, 1, 1]], 0.0, atol=1e-10)


def test_a_characteristic_length_makes_units_equal():
    """Arm that turns and slides, A = diag(J + m x^2, m): isotropic where J + m x^2 = m L^2."""
    J, m, x = 0.3, 2.0, 0.4
    A = np.diag([J + m * x**2, m])
    assert linkages.isotropy_index(A, lengths=(np.sqrt(J / m + x**2), 1.0)) == pytest.approx(1.0)
    lowest, highest = np.linalg.eigvalsh(A)
    mu = lowest / highest
    assert linkages.isotropy_index(A) == pytest.approx(2 * np.sqrt(mu) / (1 + mu))


def test_missed_configurations_are_not_passed_over(found):
    def torn(q1, q2):
        A = FIVE.inertia(q1, q2)
        hidden = np.hypot(q1 - found.q[4, 0], q2 - found.q[4, 1]) < 0.2
        A[hidden] = np.diag([2.0, 1.0])
        return A

    refuses(SolverError, "add up to 1, not 0", isotropic_configurations, torn, n=100)


test_what_is_no_linkage_is_refused = refused(
    (lambda: isotropic_configurations(lambda a, b: np.eye(3)), ModelError, r"not \(3, 3\)"),
    (lambda: linkages.isotropy_index(np.diag([1.0, -0.5])), ModelError, "no kinetic energy"),
    (lambda: closed_loci(np.zeros((3, 4)), 0.1), ConfigError, r"a field \(3, 4\)"),
    (lambda: closed_loci(np.full((4, 4), np.nan), 0.1), ConfigError, "finite values"),
)
