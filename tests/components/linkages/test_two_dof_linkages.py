"""Inertia of planar linkages: closed forms, moving points, and the multibody core."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from cases.mbs.linkages import five_bar_of_the_core, rail_of_the_core
from cases.mbs.mechanisms import simulate_quietly
from cases.refusals import refuses
from cases.solid import STEEL, block, reduced
from rom.components import linkages
from rom.components.linkages import Driven, FiveBar, TwoLink, mechanism_inertia, rod
from rom.components.linkages.dynamic_isotropy import christoffel, index_map
from rom.errors import ConfigError, ModelError
from rom.mbs.mechanism import Mechanism

FIVE = FiveBar(0.7, (rod(2.0, 0.3),) * 2, (rod(1.0, 0.8),) * 2, payload=0.5)
TWO = TwoLink(rod(1.0, 0.5), rod(2.0, 0.4))


@pytest.fixture(scope="module")
def bar():
    """A slender steel block with faces "root" and "tip", its axis aside from its frame."""
    return reduced(4, block(size=(0.3, 0.02, 0.02), cells=(6, 2, 2), origin=(0.1, -0.03, 0.0)))


def test_two_link_chain_has_its_textbook_inertia_also_with_a_mass_centre_aside():
    """In absolute angles; uniform links turn about their ends by a third of m l^2."""
    A, b = TWO.inertia(0.4, 1.3), 2.0 * 0.5 * 0.2 * np.cos(0.4 - 1.3)
    assert_allclose(A, [[0.5**2 / 3 + 2.0 * 0.5**2, b], [b, 2.0 * 0.4**2 / 3]], rtol=1e-14)
    assert_allclose(np.diag(A), [0.583333, 0.106667], atol=1e-6)
    # velocity of the centre: l1 e1' + (x e2' - y e2), primes for a quarter turn ahead
    m, l1, x, y, J = 2.0, 0.5, 0.15, 0.08, 0.03
    chain = TwoLink(rod(1.0, l1), linkages.rigid_link(m, 0.4, (x, y), J))
    A, turn = chain.inertia(0.4, 1.3), 1.3 - 0.4
    assert_allclose(A[0, 1], m * l1 * (x * np.cos(turn) - y * np.sin(turn)), rtol=1e-13)
    assert_allclose(np.diag(A), [l1**2 / 3 + m * l1**2, J + m * (x**2 + y**2)], rtol=1e-13)


def test_kinetic_energy_of_the_five_bar_from_moving_points():
    """Uniform rods as three points (Simpson is exact for them), moved by finite differences."""
    rng = np.random.default_rng(2)
    q, rate, h = rng.uniform(0, 2 * np.pi, (20, 2)), rng.normal(size=(20, 2)), 1e-6
    P = [FIVE.posture(*(q + s * h * rate).T) for s in (1, -1)]
    V = (P[0] - P[1]) / (2 * h)
    energy = 0.25 * (V[:, 2] ** 2).sum(axis=1)
    for (i, j), m in {(0, 1): 2.0, (1, 2): 1.0, (2, 3): 1.0, (3, 4): 2.0}.items():
        for point, share in ((V[:, i], 1), (V[:, i] + V[:, j], 1), (V[:, j], 1)):
            energy += m / 12 * share * (point**2).sum(axis=1)
    A = FIVE.inertia(*q.T)
    assert_allclose(0.5 * np.einsum("ki,kij,kj->k", rate, A, rate), energy, rtol=1e-8)
    assert (np.linalg.eigvalsh(A) > 0).all()


def five_of_the_core(q):
    return five_bar_of_the_core(q, [(2.0, 0.3)] * 2, [(1.0, 0.8)] * 2, FIVE.posture(*q))


def test_closed_form_equals_the_mass_matrix_of_the_multibody_core():
    for q in np.random.default_rng(3).uniform(0, 2 * np.pi, (4, 2)):
        core = mechanism_inertia(five_of_the_core(q), ("left", "right"))
        assert_allclose(core, FIVE.inertia(*q), rtol=1e-7, atol=1e-9)
    turn = np.array([0.3, -0.2])  # from where the bodies were added
    core = mechanism_inertia(five_of_the_core(q), ("left", "right"), angles=turn)
    assert_allclose(core, FIVE.inertia(*(q + turn)), rtol=1e-7)


@pytest.mark.parametrize(("base", "cranks", "couplers", "start", "turn"), [
    (0.884, (0.548, 0.400), (0.989, 0.949), (5.132, 1.752), (-3.249, 2.956)),
    (0.497, (0.539, 0.286), (0.658, 0.885), (1.584, 3.499), (3.224, -2.560)),
    (0.642, (0.325, 0.446), (0.579, 0.774), (0.014, 4.312), (4.384, 4.304)),
])  # fmt: skip
def test_cranks_that_turn_far_keep_the_tip_on_its_side(base, cranks, couplers, start, turn):
    """Assembled at once, couplers would meet on the other side, 0.9 m and more away."""
    sizes = [[(1.0, length) for length in pair] for pair in (cranks, couplers)]
    five = FiveBar(base, *(tuple(rod(*size) for size in pair) for pair in sizes), payload=0.5)
    start, end = np.array(start), np.add(start, turn)
    mech = five_bar_of_the_core(start, *sizes, five.posture(*start))
    core = Driven(mech, ("left", "right"), tool="ball")
    assert np.linalg.norm(five.tip(*end) - replace(five, side=-1).tip(*end)) > 0.8
    assert_allclose(core.tip(*turn), five.tip(*end), atol=1e-8)
    assert_allclose(core.inertia(*turn), five.inertia(*end), rtol=1e-6)


def test_slides_of_a_small_mechanism_travel_many_of_its_sizes():
    core = Driven(rail_of_the_core(1.3, (0.9, 4e-3), 0.4, 5e-3), ("left", "right"), tool="tool")
    travel = 0.2
    there = core.tip([0.0, travel], [1e-3, travel + 1e-3])
    height = np.sqrt(4e-3**2 - 3e-3**2)
    assert_allclose(there, [[3e-3, height], [3e-3 + travel, height]], rtol=1e-9)
    inertia = core.inertia([0.0, travel], [1e-3, travel + 1e-3])
    assert_allclose(inertia[1], inertia[0], rtol=1e-7)


@pytest.mark.parametrize("elastic", ["held", "free"])
def test_flexible_links_agree_with_the_core(bar, elastic):
    link = linkages.reduced_link(bar, "root", "tip")
    for q in ([1.2, 1.6], [0.3, 1.2]):
        five = FiveBar(0.5, (rod(0.4, 0.25), link), (link, rod(0.5, 0.35)), payload=0.5)
        cranks, couplers = [(0.4, 0.25), bar], [bar, (0.5, 0.35)]
        mech = five_bar_of_the_core(q, cranks, couplers, five.posture(*q))
        core = mechanism_inertia(mech, ("left", "right"), elastic=elastic)
        # the core measures the angle of a flexible crank on its root marker
        assert_allclose(five.inertia(*q, elastic=elastic), core, rtol=1e-6, atol=1e-9)


def test_free_links_feel_lighter_whatever_the_direction_and_their_frame(bar):
    link = linkages.reduced_link(bar, "root", "tip")
    chain = TwoLink(link, link, payload=0.3)
    held, free = (chain.inertia(0.3, 1.4, elastic=e) for e in ("held", "free"))
    assert (np.linalg.eigvalsh(held - free) > 0).all() and (np.linalg.eigvalsh(free) > 0).all()
    steel = rod(0.3 * 0.02**2 * 7850, 0.3)
    J = steel.M[2, 2] + steel.M[0, 0] * 0.02**2 / 12
    assert link.M[2, 2] == pytest.approx(J, rel=1e-9)
    assert link.length == pytest.approx(0.3)
    other = linkages.reduced_link(bar.with_reference(("root", "tip")), "root", "tip")
    fives = (FiveBar(0.2, (rod(0.4, 0.25),) * 2, (one,) * 2) for one in (link, other))
    assert_allclose(*(five.inertia(1.0, 2.2, elastic="free") for five in fives), rtol=1e-10)


def apparent_inertia(L, mu, EI, w):
    """Torque over acceleration of a uniform beam at its driven end; y'''' = k^4 y, y' = 1 there."""
    k = (mu * w**2 / EI) ** 0.25
    c, s, C, S = np.cos(k * L), np.sin(k * L), np.cosh(k * L), np.sinh(k * L)
    # y = a (cos - cosh) + b sin + d sinh of k x; no moment and no force at the end
    A = np.array([[-c - C, -s, S], [s - S, -c, C], [0, k, k]])
    a, _, _ = np.linalg.solve(A, [0, 0, 1])
    return -2 * a * k**2 * EI / w**2


def test_inertia_at_a_frequency_is_that_of_a_beam_and_converges_with_its_modes():
    L, side, w = 0.5, 0.02, 2 * np.pi * 40.0
    mu, EI = STEEL.rho * side**2, STEEL.E * side**4 / 12
    found, free = [], []
    model = block((L, side, side), (120, 1, 1), replace(STEEL, nu=0.0))
    for n in (1, 4, 12):
        body = reduced(n, model)
        arm = TwoLink(rod(1.0, 0.3), linkages.reduced_link(body, "root", "tip"))
        found.append(arm.inertia(0.0, 1.0, elastic=w)[1, 1])
        free.append(arm.inertia(0.0, 1.0, elastic="free")[1, 1])
        assert_allclose(arm.inertia(0.0, 1.0, elastic=1e-3 * w), arm.inertia(0.0, 1.0), rtol=1e-5)
        assert_allclose(arm.inertia(0.0, 1.0, elastic=1e6 * w)[1, 1], free[-1], rtol=1e-5)
    exact, rigid = apparent_inertia(L, mu, EI, w), mu * L**3 / 3
    assert apparent_inertia(L, mu, EI, 1.0) == pytest.approx(rigid, rel=1e-4)
    assert found[2] == pytest.approx(exact, rel=0.02) and abs(exact - rigid) > 0.1 * rigid
    assert found[1] == pytest.approx(found[2], rel=1e-3)
    assert free[2] < 0.8 * free[1] < 0.64 * free[0]


def test_above_the_first_frequency_on_held_drives_there_is_no_inertia(bar):
    """A link that swings against its motor has less than none, which no index may hide."""
    arm = TwoLink(rod(1.0, 0.3), linkages.reduced_link(bar, "root", "tip"))
    first = bar.frequencies(1, fixed=("root",))[0]
    below, above = (2 * np.pi * share * first for share in (0.9, 1.1))
    index_map(lambda a, b: arm.inertia(a, b, elastic=below), n=4)
    with pytest.raises(ModelError, match="inertia must be positive"):
        index_map(lambda a, b: arm.inertia(a, b, elastic=above), n=4)


def test_inertia_and_christoffel_symbols_reproduce_the_free_motion_of_the_core():
    q0, rate = np.array([1.0, 2.2]), np.array([3.0, -2.0])
    mech = five_of_the_core(q0)
    mech.drives.clear()
    step = 1e-7
    ends = {"crank 0": (0, 1), "crank 1": (4, 3), "coupler 0": (1, 2), "coupler 1": (3, 2)}
    for name, pair in (ends | {"ball": (2, 2)}).items():
        P = [FIVE.posture(*(q0 + s * step * rate))[list(pair)] for s in (1, -1)]
        arm = [np.arctan2(*(p[1] - p[0])[::-1]) for p in P]
        v = np.r_[(P[0] - P[1]).mean(axis=0) / (2 * step), 0.0]
        spin = np.array([0, 0, (arm[0] - arm[1]) / (2 * step)])
        mech.parts[name] = replace(mech.parts[name], velocity=v, omega=spin)
    sol = simulate_quietly(mech, t_end=0.2, dt=0.01, method="dop853", rtol=1e-8, atol=1e-10)

    def rhs(t, y):
        force = np.einsum("ijk,j,k->i", christoffel(FIVE.inertia, y[:2]), y[2:], y[2:])
        return np.r_[y[2:], np.linalg.solve(FIVE.inertia(*y[:2]), -force)]

    y = solve_ivp(rhs, (0, 0.2), [*q0, *rate], "DOP853", sol.t, rtol=1e-9, atol=1e-11).y
    tip = FIVE.posture(*y[:2])[:, 2]
    assert np.ptp(tip, axis=0).min() > 0.01
    assert_allclose(sol.position("ball")[:, :2], tip, atol=2e-6)


def test_what_cannot_be_is_refused():
    with pytest.raises(ModelError, match=r"1.3 m apart; couplers of 0.3 m and 0.3 m do not meet"):
        FiveBar(0.7, (rod(2.0, 0.3),) * 2, (rod(1.0, 0.3),) * 2).inertia(np.pi, [0.0, 1.0])
    for frequency in (0.0, -1.0):
        refuses(ConfigError, "must be positive", TWO.inertia, 0.0, 1.0, elastic=frequency)
    mech = Mechanism()
    mech.add_rigid("box", mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0))
    refuses(ConfigError, "must be two of the drives", mechanism_inertia, mech, ("left", "right"))
