"""Blocks in contact: closed forms of falling, sliding, rocking; arches at their limit; statics."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

import rom
from cases.components.masonry import GROUND, SOFT, G, box, on_the_ground, turned
from cases.refusals import refused, refuses
from cases.solid import STEEL, block
from rom.components.masonry.block_contact import SLIDES
from rom.components.masonry.limits import Rock, stands
from rom.components.masonry.motion import simulate
from rom.components.masonry.stones import Masonry, polygon_moments, reduced_stone, stone, touching
from rom.eigen.verbs import rigid_motions
from rom.errors import ConfigError, ModelError

STEEL_BOX = {"E": STEEL.E, "nu": STEEL.nu, "rho": STEEL.rho, "thickness": 0.2}
SKEW = np.array([[0, 0], [1.2, 0.1], [1.5, 0.9], [0.3, 0.7]])
SCHEME = [(0.1, 0.997509, 1.0011), (0.5, 0.942809, 1.0273), (1.0, 0.816497, 1.0968)]
FREE = Masonry((stone(box(), **SOFT),), (), 1e10, 0.0, (0.0, 0.0))  # no ground and no weight


def uniform_strains(points):
    X, Y, _ = (points - points.mean(axis=0)).T
    U = np.zeros((len(X), 3, 3))
    U[:, 0, 0], U[:, 1, 1], U[:, 0, 2], U[:, 1, 2] = X, Y, Y / 2, X / 2
    return U.reshape(-1, 3)


def test_mass_of_a_block_is_that_of_finite_elements():
    model = block(size=(0.6, 0.3, 0.2), cells=(3, 2, 1))
    x = model.points - model.points.mean(axis=0)
    U = np.hstack([rigid_motions(x)[:, [0, 1, 5]], uniform_strains(x)])
    one = stone(box(0.6, 0.3), **STEEL_BOX, state="plane strain")
    assert_allclose(one.M, U.T @ (model.M @ U), atol=1e-10 * one.M.max())
    assert_allclose(one.K, (U.T @ (model.K @ U))[3:, 3:], atol=1e-9 * one.K.max())


def test_mass_and_mean_axes_of_a_skew_block():
    """Integrals of T^T T at random points; vibrations with rotation, and in mean axes without."""
    one = stone(SKEW, **SOFT)
    area, _, S = polygon_moments(SKEW)
    x = np.random.default_rng(0).uniform(SKEW.min(axis=0), SKEW.max(axis=0), (400_000, 2))
    edges = zip(SKEW, np.roll(SKEW, -1, axis=0) - SKEW, strict=True)
    left = [e[0] * (x[:, 1] - c[1]) - e[1] * (x[:, 0] - c[0]) > 0 for c, e in edges]
    X, Y = (x[np.all(left, axis=0)] - one.centre).T
    zero, unit = 0 * X, 1 + 0 * X
    T = np.array([[unit, zero, -Y, X, zero, Y / 2], [zero, unit, X, zero, Y, X / 2]])
    exact = 2000.0 * area * np.einsum("aik,ajk->ij", T, T) / X.size
    assert_allclose(one.M, exact, atol=0.01 * one.M.max())
    assert one.M[2, 3] == -2000.0 * S[0, 1] and abs(S[0, 1]) > 0.005
    K = np.zeros((6, 6))
    K[3:, 3:] = one.K
    with_frame = np.sqrt(eigh(K, one.M, eigvals_only=True)[3:])
    M = one.M[3:, 3:] - np.outer(one.M[2, 3:], one.M[2, 3:]) / one.M[2, 2]
    assert_allclose(with_frame, np.sqrt(eigh(one.K, M, eigvals_only=True)), rtol=1e-9)
    square = stone(box(), **SOFT)
    assert_allclose(square.M[:3, 3:], 0.0, atol=1e-12 * square.M.max())


@pytest.mark.long
@pytest.mark.parametrize(("Omega", "factor", "period"), SCHEME)
def test_vibrations_decay_by_the_factor_of_the_scheme(Omega, factor, period):
    (one,) = FREE.stones
    lam, V = eigh(one.K, one.M[3:, 3:])
    omega, q = np.sqrt(lam[0]), np.zeros((1, 6))
    q[0, :2], q[0, 3:] = one.centre, 1e-6 * V[:, 0]
    dt = Omega / omega
    motion = simulate(FREE, t_end=40 * dt, dt=dt, q=q)
    p = (V[:, 0] @ one.M[3:, 3:]) @ motion.q[:, 0, 3:].T / 1e-6
    r = (V[:, 0] @ one.M[3:, 3:]) @ motion.v[:, 0, 3:].T / 1e-6 / omega
    Z = np.array([p, r])  # two rows of the propagation from two pairs of states
    z = np.linalg.eigvals(Z[:, 1:] @ np.linalg.pinv(Z[:, :-1]))
    assert_allclose(np.abs(z), (1 + Omega**2 / 2) ** -0.5, rtol=1e-9)
    assert abs(z[0]) == pytest.approx(factor, abs=1e-6)
    assert Omega / abs(np.angle(z[0])) == pytest.approx(period, abs=1e-4)


def test_free_fall_is_exact_and_a_turned_block_keeps_its_stress():
    motion = simulate(Masonry((stone(box(), **SOFT),), (), 1e10, 0.0, reach=10.0), t_end=1, dt=0.01)
    assert motion.q[-1, 0, 1] - motion.q[0, 0, 1] == pytest.approx(-G / 2, rel=1e-13)
    assert motion.v[-1, 0, 1] == pytest.approx(-G, rel=1e-13)
    assert motion.cuts == 0
    # elastic coordinates live in body axes: a block that turns by 90 degrees feels nothing
    motion = simulate(FREE, t_end=1, dt=0.01, v=np.pi / 2 * np.eye(6)[[2]])
    assert np.abs(motion.q[-1, 0, 3:]).max() < 1e-12
    assert_allclose(motion.outlines()[0][0], [1.0, 0.0], atol=1e-9)
    assert polygon_moments(motion.outlines()[0])[0] == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize(
    ("phi", "tolerance"), [(0, 1e-12), (10, 1e-6), (20, 4e-6), (29, 0.03), (31, None)]
)
def test_a_block_slides_down_a_slope_of_30_degrees(phi, tolerance):
    """Near the angle of friction the settling at the start, which sticks at times, counts."""
    slope, mu = np.radians(30), np.tan(np.radians(phi))
    one = stone(box() @ turned(slope).T, **SOFT)
    model = on_the_ground(one, friction=mu, slope=slope)
    motion = simulate(model, t_end=1, dt=2e-3, save_every=500)
    down = -(motion.q[-1, 1, :2] - motion.q[0, 1, :2]) @ turned(slope)[:, 0]
    if tolerance is None:
        assert 0 < down < 2e-4
    else:
        exact = G / 2 * (np.sin(slope) - np.cos(slope) * mu)
        assert down == pytest.approx(exact, rel=tolerance)
        C, law = motion.contacts, motion.masonry.law  # springs along slipping edges stay stretched
        n = C.used[0]
        drag = C.way[:n] * mu * C.force[:n]
        assert n and (C.state[:n] == SLIDES).all()
        assert_allclose(law.shear * C.slip[:n], drag, atol=1e-4 * 2000 * G)


def test_friction_turns_round_with_the_motion():
    """Thrown up the slope: deceleration g (sin + mu cos), then down with g (sin - mu cos)."""
    slope, mu, speed = np.radians(30), np.tan(np.radians(20)), 2.0
    one = stone(box() @ turned(slope).T, **SOFT)
    up, down = (G * (np.sin(slope) + s * mu * np.cos(slope)) for s in (1, -1))
    v = np.zeros((2, 6))
    v[1, :2] = speed * turned(slope)[:, 0]
    motion = simulate(on_the_ground(one, friction=mu, slope=slope), t_end=1, dt=5e-4, v=v)
    way = (motion.q[:, 1, :2] - motion.q[0, 1, :2]) @ turned(slope)[:, 0]
    assert way.max() == pytest.approx(speed**2 / (2 * up), rel=0.01)
    exact = speed**2 / (2 * up) - down / 2 * (1 - speed / up) ** 2
    assert way[-1] == pytest.approx(exact, abs=0.02 * speed**2 / (2 * up))


def test_two_blocks_collide_with_their_momenta():
    stones = [stone(box(), **SOFT), stone(box(at=(1.05, 0.4)) @ turned(0.02).T, **SOFT)]
    v = np.zeros((2, 6))
    v[:, 0] = 1.0, -2.0
    model = Masonry(tuple(stones), (), 1e10, 0.3, (0.0, 0.0))
    motion = simulate(model, t_end=0.1, dt=1e-4, v=v)
    M = np.array([s.M for s in stones])
    momentum = np.einsum("bij,tbj->tbi", M, motion.v)
    assert np.abs(momentum[-1, 0] - momentum[0, 0]).max() > 1000
    total = momentum[:, :, :2].sum(axis=1)
    assert_allclose(total, total[:1].repeat(len(total), 0), atol=1e-9 * 6000)
    r, (px, py, spins) = motion.q, np.moveaxis(momentum[..., :3], 2, 0)
    spin = (r[..., 0] * py - r[..., 1] * px + spins).sum(axis=1)
    assert abs(momentum[-1, 0, 2]) > 100
    assert_allclose(spin, spin[0], atol=0.01 * abs(momentum[-1, 0, 2]))
    E = motion.energy[1:]
    assert np.diff(E).max() <= 1e-6 * E[0] and E[-1] < 0.99 * E[0]


def test_column_under_its_own_weight():
    """Uniform strain carries the mean stress rho g H / 2, the ground the weight."""
    model, weight = on_the_ground(stone(box(1.0, 4.0), **SOFT)), 2000 * G * 4.0
    motion = simulate(model, t_end=2, dt=0.02, damping=np.inf)
    assert_allclose(motion.stress()[1], [0, -weight / 2, 0], atol=1e-6 * weight)
    ((_, force),) = motion.joints().values()
    assert_allclose(force, [0, -weight], atol=1e-6 * weight)


def test_a_rocking_block_strikes_in_time_and_loses_as_much_as_housner_says_or_less():
    """1 m by 4 m, let go at half its stability angle: d theta over the speed, p^2 = 3 g / (4 R)."""
    alpha, p = np.arctan(0.25), np.sqrt(3 * G / (4 * np.hypot(0.5, 2.0)))
    assert p == pytest.approx(1.8892, abs=1e-4)
    assert np.arccosh(2.0) / p == pytest.approx(0.69711, abs=1e-5)
    s = np.linspace(0, 1, 20001)[1:] - 0.5 / 20000  # theta = theta0 (1 - s^2) removes the root
    speed = p * np.sqrt(2 * (np.cos(alpha / 2) - np.cos(alpha - alpha / 2 * (1 - s**2))))
    assert (alpha * s / speed).mean() == pytest.approx(0.69834, abs=1e-5)
    assert 1 - 1.5 * np.sin(alpha) ** 2 == pytest.approx(0.9118, abs=1e-4)
    rock = {"E": 1e10, "nu": 0.2, "rho": 2000.0}
    one = stone((box(1.0, 4.0, (-1.0, 0.0))) @ turned(-alpha / 2).T, **rock)
    model = Masonry((stone(GROUND, **rock), one), (0,), 20e10, 0.84)
    for dt in (4e-3, 1e-3):
        motion = simulate(model, t_end=1.0, dt=dt)
        k = int(np.argmax(motion.q[:, 1, 2] > alpha / 2))
        assert motion.t[k] == pytest.approx(0.69834, abs=dt), dt
        after = slice(k + round(0.02 / dt), k + round(0.1 / dt))
        line = np.polyfit(motion.t[after] - motion.t[k], motion.v[after, 1, 2], 1)
        assert 0.88 < line[1] / motion.v[k - 1, 1, 2] < 0.97


@pytest.fixture(scope="module")
def meshed():
    """A steel box 0.6 x 0.3 x 0.2 m of finite elements, reduced so that it knows uniform stress."""
    model = block(size=(0.6, 0.3, 0.2), cells=(6, 3, 2))
    x = model.points - model.points.mean(axis=0)
    nu, u = STEEL.nu, np.zeros((3, len(x), 3))
    u[0] = x * (1, -nu, -nu)
    u[1] = x * (-nu, 1, -nu)
    u[2, :, 0], u[2, :, 1] = (1 + nu) * x[:, 1], (1 + nu) * x[:, 0]
    loads = np.column_stack([model.K @ (s.ravel() / STEEL.E) for s in u])  # unit stresses
    method = rom.WithLoads(rom.CraigBampton(6), loads)
    body = rom.reduce(model, method=method, interfaces={"root": "full"}, certify=False)
    return model, loads, body


def test_a_meshed_stone_answers_uniform_stress_like_a_block_of_uniform_strain(meshed):
    model, loads, body = meshed
    corners = box(0.6, 0.3)
    fine = reduced_stone(body, corners)
    plain = stone(corners, **STEEL_BOX)
    body = body.with_reference("mean-axis")
    outer = (3 * model.surface.nodes[:, None] + np.arange(3)).ravel()
    force = body.surface.shape.T @ loads[outer]
    moved = fine.shapes @ np.linalg.solve(fine.K, force)
    simple = plain.shapes @ np.linalg.solve(plain.K, 0.6 * 0.3 * 0.2 * np.eye(3))
    turn = np.column_stack([-(corners - plain.centre)[:, 1], (corners - plain.centre)[:, 0]])
    for k in range(3):
        gap = moved[:, :, k] - simple[:, :, k]
        gap = gap - (gap * turn).sum() / (turn**2).sum() * turn
        assert np.abs(gap).max() < 1e-8 * np.abs(simple[:, :, k]).max()
    assert_allclose(fine.M[:3, :3], plain.M[:3, :3], rtol=1e-9, atol=1e-9)
    assert_allclose(fine.centre, plain.centre, atol=1e-12)


class UniformStrain:
    """A basis of rigid motions and the three uniform strains in a plane."""

    def __init__(self, points):
        self.Psi = np.hstack([rigid_motions(points), uniform_strains(points)])

    def basis(self, ops, boundary, labels):
        names = (*(f"rigid {k}" for k in range(6)), "strain xx", "strain yy", "strain xy")
        return rom.Basis(self.Psi, np.zeros(0), names)


def test_a_block_is_a_flexible_body_whose_modes_are_uniform_strains():
    model = block(size=(0.6, 0.3, 0.2), cells=(3, 2, 1))
    method = UniformStrain(model.points)
    body = rom.reduce(model, method=method, interfaces={"root": "full"}, certify=False)
    corners = box(0.6, 0.3, (0.0, 0.0))
    plain = stone(corners, **STEEL_BOX, state="plane strain")
    K = np.zeros((6, 6))
    K[3:, 3:] = plain.K
    omega = np.sqrt(eigh(K, plain.M, eigvals_only=True)[3:])
    assert_allclose(2 * np.pi * body.frequencies()[6:], omega, rtol=1e-10)
    assert np.abs(plain.M[2, 3:]).max() > 0.01 * plain.M[2, 2]  # its own frame is none of mean axes
    films = []
    for one in (plain, reduced_stone(body, corners)):
        ground = stone(GROUND - [0, 0.002], **SOFT)
        model = Masonry((ground, one), (0,), 10 * SOFT["E"], 0.4)
        v = np.zeros((2, 6))
        v[1, :3] = 0.3, -1.0, 0.5
        motion = simulate(model, t_end=0.02, dt=2e-5, v=v, save_every=50)
        films.append(np.array([motion.outlines(k)[1] for k in range(len(motion.t))]))
    assert_allclose(films[1], films[0], rtol=0, atol=1e-8)  # frames differ at second order
    assert films[0][-1, :, 1].mean() > films[0][:, :, 1].mean(axis=1).min() + 1e-3  # came back up


def test_meshed_and_plain_stones_stand_on_each_other(meshed):
    _, _, body = meshed
    corners = box(0.6, 0.3)
    plain, ground = stone(box(0.6, 0.3, (0.0, 0.3)), **STEEL_BOX), stone(GROUND, **STEEL_BOX)
    model = Masonry((ground, reduced_stone(body, corners), plain), (0,), 10 * STEEL.E * 0.2, 0.5)
    motion = simulate(model, t_end=0.4, dt=0.02, damping=np.inf, save_every=20)
    weight = plain.M[0, 0] * G
    joints = motion.joints()
    assert_allclose(joints[0, 1][1], [0, -2 * weight], atol=1e-4 * weight)
    assert_allclose(joints[1, 2][1], [0, -weight], atol=1e-4 * weight)
    assert np.abs(motion.v[-1]).max() < 1e-12


def test_stones_meet_corner_on_corner():
    bricks = [stone(box(at=(x, y)), **SOFT) for y in (0.0, 1.0) for x in (-1.0, 0.0)]
    model = Rock().masonry([stone(GROUND, **SOFT), *bricks], (0,))
    C = touching(model)
    pairs = {tuple(sorted(p)) for p in C.who[:, [0, 2]].tolist()}
    assert {(0, 1), (0, 2), (1, 2), (1, 3), (2, 4), (3, 4)} <= pairs
    for k in np.flatnonzero((C.who[:, [0, 2]] == (1, 4)).all(axis=1)):
        o = np.flatnonzero((C.who[:, [0, 2]] == (4, 1)).all(axis=1))
        assert_allclose(C.along[o, 1:3], -C.along[[k], 1:3].repeat(len(o), 0), atol=1e-12)
    assert stands(model)
    motion = simulate(model, t_end=0.5, dt=5e-3, damping=np.inf, save_every=100)
    assert_allclose(motion.q[-1, :, :2], model.start()[:, :2], atol=5e-5)


ONE = Masonry((stone(box(), **SOFT),), (), 1e10, 0.0)
test_what_cannot_be_is_refused = refused(
    (lambda: stone(box()[::-1], **SOFT), ModelError, "encloses -1 m2"),
    (lambda: simulate(ONE, t_end=1.0, dt=0.1, q=[0.0, 1.0]), ConfigError, r"q has shape \(2,\)"),
    (lambda: simulate(ONE, t_end=0.01, dt=0.1), ConfigError, "0 steps"),
    (lambda: simulate(ONE, t_end=1.0, dt=0.1, damping=-1.0), ConfigError, "damping = -1.0 1/s"),
    (lambda: simulate(ONE, t_end=1.0, dt=0.1, damping=np.nan), ConfigError, "damping = nan"),
    (lambda: Masonry(ONE.stones * 2, (2,), 1e9, 0.1), ConfigError, "held: stone 2 must be from"),
)  # fmt: skip


def test_a_corner_without_a_node_is_refused(meshed):
    refuses(ModelError, r"corner \[0.61, 0.0\]", reduced_stone, meshed[2], box(0.61, 0.3))
    bare = replace(meshed[2], surface=None)
    refuses(ModelError, "no surface", reduced_stone, bare, box(0.6, 0.3))
