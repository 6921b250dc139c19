"""Best matching against momentum, the mean-axis frame, and Newton's motion of a few bodies."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh, expm
from scipy.optimize import brentq, minimize

import rom
from cases.refusals import refused
from cases.solid import block, reduced
from rom import rotation
from rom.body.reference import reference_motion, rigid_elastic, rigid_mass
from rom.components import best_matching
from rom.components.best_matching import Bodies, ShapeSphere, frame, match, stacked
from rom.errors import ConfigError, ModelError, SolverError

MASS = np.array([1.0, 1.5, 2.0])
X0 = np.array([(1, 0.2, 0), (-0.7, 0.5, 0), (0.1, -0.9, 0)])
START = X0, np.array([(0.3, -0.5, 0), (0.2, 0.6, 0), (-0.4, 0.1, 0)])
CORNERS = np.array([(np.cos(a), np.sin(a), 0) for a in 2 * np.pi * np.arange(3) / 3]) / np.sqrt(3)


def cloud(n=7, seed=0):
    rng = np.random.default_rng(seed)
    return rng.uniform(0.5, 2, n), rng.normal(size=(n, 3)), rng.normal(size=(n, 3))


def turned(angles):
    return rotation.matrix(rotation.exp(angles))


def projector(m, x, **keep):
    R = best_matching.generators(x, **keep)
    return R @ best_matching.rigid_part(m, R, np.eye(len(R)))


@pytest.mark.parametrize("scale", [False, True])
def test_matched_energy_is_kinetic_energy_without_momenta(scale):
    m, x, v = cloud()
    X = x - m @ x / m.sum()
    P, L, D = m @ v, m @ np.cross(X, v), m @ (X * v).sum(axis=1)
    size = m @ (X**2).sum(axis=1)
    inertia = size * np.eye(3) - np.einsum("i,ia,ib->ab", m, X, X)
    expected = 0.5 * m @ (v**2).sum(axis=1) - P @ P / (2 * m.sum())
    expected -= 0.5 * L @ np.linalg.solve(inertia, L) + scale * D**2 / (2 * size)
    found = match(m, x, v, scale=scale)
    assert found.energy == pytest.approx(expected, rel=1e-12)
    assert_allclose(m @ found.rest, 0, atol=1e-12)
    assert_allclose(m @ np.cross(x, found.rest), 0, atol=1e-12)
    assert_allclose(found.motion[3:6], np.linalg.solve(inertia, L), rtol=1e-9)
    assert_allclose(found.motion[6:], [D / size] * scale, rtol=1e-9)


@pytest.mark.parametrize(("scale", "rank"), [(False, 6), (True, 7)])
def test_matching_is_a_projection_along_the_generators(scale, rank):
    m, x, _ = cloud()
    Q = projector(m, x, scale=scale)
    assert_allclose(Q @ Q, Q, atol=1e-12)
    assert np.linalg.matrix_rank(Q) == rank
    MQ = np.repeat(m, 3)[:, None] * Q
    assert_allclose(MQ, MQ.T, atol=1e-12)  # orthogonal in the mass


@pytest.mark.parametrize("scale", [False, True])
def test_moving_frames_change_nothing(scale):
    """x' = s (A x + r) with A, r, s functions of time: the matched energy grows with s^2 alone."""
    m, x, v = cloud(seed=3)
    A, spin = turned([0.3, -1.2, 0.5]), np.array([2.0, -1.0, 0.7])
    s, growth = (1.7, -0.9) if scale else (1.0, 0.0)
    y = s * (x @ A.T + [5.0, -2.0, 1.0])
    dy = growth / s * y + s * (v @ A.T + np.cross(spin, x @ A.T) + [-3.0, 4.0, 9.0])
    here, there = (match(m, *motion, scale=scale) for motion in ((x, v), (y, dy)))
    assert there.energy == pytest.approx(s**2 * here.energy, rel=1e-11)
    assert_allclose(there.rest, s * here.rest @ A.T, atol=1e-11)


def test_points_on_a_line_do_not_turn_about_it():
    x = np.outer([-1.0, 0.5, 2.0], [1.0, 2.0, 2.0]) + np.array([10.0, 0.0, -3.0])
    v = np.cross([0.2, -0.4, 0.1], x)
    assert match(MASS, x, v).energy < 1e-20
    assert np.linalg.matrix_rank(projector(MASS, x), tol=1e-9) == 5


@pytest.mark.parametrize("consistent", [False, True])
def test_what_differs_obeys_the_conditions_of_eckart(consistent):
    m, X, u = cloud(seed=5)
    if consistent:  # a mass matrix that couples particles, as that of finite elements
        m = np.diag(m) + 0.1 * np.eye(7, k=1) + 0.1 * np.eye(7, k=-1)
    x = X + 0.4 * u
    M = m if consistent else np.diag(m)
    r, A = frame(m, X, x)
    differs = (x - r) @ A - X
    assert_allclose(np.linalg.det(A), 1.0)
    assert np.abs(M.sum(axis=0) @ differs).max() < 1e-12
    assert np.abs(np.einsum("ij,ija->a", M, np.cross(X[:, None], differs[None]))).max() < 1e-12
    left = np.trace(differs.T @ M @ differs)
    for axis in np.eye(3):  # and is the least there is
        for angle in (1e-3, -1e-3, 2.5):
            B = A @ turned(angle * axis)
            other = (x - M.sum(axis=0) @ (x - X @ B.T) / M.sum()) @ B - X
            assert np.trace(other.T @ M @ other) > left


def test_a_frame_in_the_plane_does_not_flip_a_triangle():
    mirrored = CORNERS * [1.0, -1.0, 1.0]
    assert frame(MASS, CORNERS, mirrored)[1][2, 2] == pytest.approx(-1.0)
    with pytest.raises(ModelError, match="no rotation in the plane is better"):
        frame(np.ones(3), CORNERS, mirrored, plane=True)
    A = frame(MASS, CORNERS, CORNERS @ turned([0, 0, 1.1]).T, plane=True)[1]
    assert_allclose(A, turned([0, 0, 1.1]), atol=1e-12)


def test_tisserand_and_eckart_turn_alike_to_second_order():
    m, X, u = cloud(seed=8)
    w = cloud(seed=9)[2]
    u, w = (match(m, X, field).rest for field in (u, w))  # both vanish at eps = 0

    def gap(eps, h=1e-5):
        after, before = (frame(m, X, X + eps * (u + s * h * w))[1] for s in (1, -1))
        rate = rotation.axial((after - before) / (2 * h))
        return np.linalg.norm(rate - match(m, X + eps * u, eps * w).motion[3:])

    assert gap(1e-2) / gap(5e-3) == pytest.approx(4.0, rel=0.1)
    assert gap(1e-2) > 1e-6


@pytest.mark.parametrize("colatitude", [0.4, 1.0, 1.9, 2.6])
def test_a_loop_of_shapes_turns_the_whole_by_half_its_solid_angle(colatitude):
    """A falling cat of three bodies; the sphere of shapes has radius 1/2."""
    J = np.linalg.pinv(ShapeSphere(Bodies(MASS))._to_jacobi())
    longitude = np.linspace(0.0, 2 * np.pi, 1501)
    z = [np.full(1501, np.cos(colatitude / 2)), np.sin(colatitude / 2) * np.exp(1j * longitude)]
    z = (J @ np.array(z)).T
    film = np.stack([z.real, z.imag, 0 * z.real], axis=-1)
    assert_allclose(film[-1], film[0], atol=1e-12)
    A = frame(MASS, film[0], stacked(MASS, film, plane=True)[-1], plane=True)[1]
    solid_angle = 2 * np.pi * (1 - np.cos(colatitude))
    assert_allclose(A, turned([0, 0, -solid_angle / 2]), atol=2e-5)


MODEL = block(cells=(8, 1, 1))  # all nodes lie on the surface, and a reduced body knows each


@pytest.fixture(scope="module")
def bodies():
    at_root = reduced(10, MODEL, reference="root")
    return at_root, at_root.with_reference("mean-axis")


def test_matched_energy_is_that_of_elastic_modes_and_of_what_the_integrals_of_a_body_leave(bodies):
    modes = rom.modes(MODEL, 3 * len(MODEL.points))
    v = np.random.default_rng(2).normal(size=3 * len(MODEL.points))
    amplitudes = modes.shapes.T @ (MODEL.M @ v)
    found = match(MODEL.M, MODEL.points, v.reshape(-1, 3))
    assert found.energy == pytest.approx(0.5 * (amplitudes[6:] ** 2).sum(), rel=1e-9)
    # M_ff - M_fr M_rr^-1 M_rf of the small record against T_bm of all nodes
    at_root, _ = bodies
    qd = np.random.default_rng(4).normal(size=at_root.n_modes)
    C = rigid_elastic(at_root)
    left = at_root.M - C.T @ np.linalg.solve(rigid_mass(at_root), C)
    found = match(MODEL.M, MODEL.points, (at_root.surface.shape @ qd).reshape(-1, 3))
    assert found.energy == pytest.approx(0.5 * qd @ left @ qd, rel=1e-9)


def test_matched_shapes_are_those_of_the_mean_axis_body(bodies):
    at_root, mean_axis = bodies
    R, Phi = best_matching.generators(MODEL.points), at_root.surface.shape
    X = best_matching.rigid_part(MODEL.M, R, Phi)
    assert_allclose(X, reference_motion(at_root, "mean-axis"), atol=1e-9 * np.abs(X).max())
    assert np.abs(X).max() > 0.1
    rest = Phi - R @ X
    lam, V = eigh(at_root.K, rest.T @ (MODEL.M @ rest))
    assert_allclose(np.sqrt(lam), mean_axis.omega, rtol=1e-9)
    shapes = rest @ V
    signs = np.sign((shapes * mean_axis.surface.shape).sum(axis=0))
    atol = 1e-8 * np.abs(shapes).max()
    assert_allclose(shapes * signs, mean_axis.surface.shape, atol=atol)


def floating(body, amplitude):
    """Nodes (k, n, 3) of a body that floats, turns and shakes; and its frame."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    shake = (MODEL.points[:, 0] - 0.2) ** 2
    v = np.column_stack([0 * shake, shake, 0.5 * shake]).ravel()
    Phi = body.surface.shape
    system = np.hstack([best_matching.generators(MODEL.points), Phi])
    start = np.linalg.lstsq(system, amplitude * v, rcond=None)[0]  # the same motion in any frame
    mech.add_flexible("beam", body, velocity=start[:3], omega=start[3:6], qd=start[6:])
    sol = rom.simulate(mech, t_end=4e-3, dt=2e-5, save_every=10)
    A = np.array([rotation.matrix(p) for p in sol.orientation("beam")])
    local = MODEL.points + (sol.elastic("beam") @ Phi.T).reshape(len(sol.t), -1, 3)
    return sol.position("beam")[:, None] + np.einsum("tab,tnb->tna", A, local), A


def test_a_floating_beam_has_the_same_best_frame_in_all_floating_frames(bodies):
    M_s = MODEL.M[::3][:, ::3]
    gaps, wobble = [], []
    for amplitude in (20.0, 10.0):
        films = [floating(body, amplitude) for body in bodies]
        best = [np.array([frame(M_s, MODEL.points, x)[1] for x in film]) for film, _ in films]
        assert_allclose(best[1], films[1][1], atol=1e-9)
        gaps.append(np.abs(best[0] - best[1]).max())
        wobble.append(np.abs(best[0] - films[0][1]).max())
    assert wobble[0] > 1e-3  # the frame on the root is another one
    assert gaps[0] < 0.05 * wobble[0]
    assert gaps[0] / gaps[1] == pytest.approx(4.0, rel=0.3)  # frames differ at second order
    assert wobble[0] / wobble[1] == pytest.approx(2.0, rel=0.1)


def test_a_beam_that_whirls_turns_back_like_a_falling_cat(bodies):
    """A loop of two bending shapes: -2 pi a^2 / (J_x + a^2), with masses of finite elements."""
    # slender, one shape both ways: int rho phi_y phi_z is one; J_x = m (b^2 + h^2) / 12
    M_s, Phi = MODEL.M[::3][:, ::3], bodies[1].surface.shape
    X, shapes = MODEL.points, Phi.reshape(len(MODEL.points), 3, -1)
    share = (shapes**2).sum(axis=0) / (shapes**2).sum(axis=(0, 1))
    y, z = (shapes[:, :, np.flatnonzero(share[axis] > 0.9)[0]] for axis in (1, 2))
    size = np.ptp(X, axis=0)
    J = M_s.sum() * (size[1] ** 2 + size[2] ** 2) / 12
    sign = np.sign((y[:, 1] * z[:, 2]).sum())
    for a in (2e-3 * np.sqrt(M_s.sum()) * size[1], -1e-3 * np.sqrt(M_s.sum()) * size[1]):
        s = np.linspace(0, 2 * np.pi, 41)
        steps = np.cos(s)[:, None, None] * y + np.sin(s)[:, None, None] * z
        film = X + abs(a) * steps[:: 1 if a > 0 else -1]
        A = frame(M_s, film[0], stacked(M_s, film)[-1])[1]
        expected = -sign * np.sign(a) * 2 * np.pi * a**2 / (J + a**2)
        assert A[2, 1] == pytest.approx(expected, rel=0.05)
        assert np.abs(A - A.T)[[0, 0], [1, 2]].max() < 0.02 * abs(expected)


def line(*places):
    return np.array([(p, 0.0, 0.0) for p in places])


# n: lowest complexity of n equal masses
SIMPLEST = {4: 0.2296397, 5: 0.2589745, 6: 0.2773689, 8: 0.3074264, 10: 0.3271667, 12: 0.3414254}
TETRAHEDRON = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)])


SQUARE = np.array([(1, 1, 0), (-1, 1, 0), (-1, -1, 0), (1, -1, 0)])
REGULAR = [(line(0, 3), 0.125), (line(-1, 0, 1), np.sqrt(6) * 2.5 / 27), (SQUARE, 0.2392767)]
REGULAR += [(CORNERS, 1 / (3 * np.sqrt(3))), (TETRAHEDRON, 0.2296397)]


@pytest.mark.parametrize(("x", "expected"), REGULAR)
def test_complexity_of_regular_shapes(x, expected):
    bodies = Bodies(np.full(len(x), 0.7))
    assert bodies.complexity(x) == pytest.approx(expected, rel=2e-7)
    moved = 4.2 * (x @ turned([1, 2, 0.3]).T) + [3, 1, -2]
    assert bodies.complexity(moved) == pytest.approx(expected, rel=2e-7)


@pytest.mark.parametrize(("n", "expected"), SIMPLEST.items())
def test_simplest_shapes_are_the_known_ones_and_collapse_in_themselves(n, expected):
    """By descent from random starts: a central configuration, accelerated to its centre."""
    bodies, rng = Bodies(np.ones(n)), np.random.default_rng(n)

    def complexity(y):
        x = y.reshape(-1, 3)
        slope = bodies.centred(x) / bodies.size(x) - bodies.acceleration(x) / bodies.potential(x)
        C = bodies.complexity(x)
        return C, C * slope.ravel()

    starts, how = rng.normal(size=(12, 3 * n)), {"jac": True, "options": {"gtol": 1e-9}}
    best = min((minimize(complexity, y, **how) for y in starts), key=lambda found: found.fun)
    assert best.fun == pytest.approx(expected, abs=1e-7)
    x = bodies.centred(best.x.reshape(-1, 3))
    pull = bodies.potential(x) / bodies.size(x)
    assert_allclose(bodies.acceleration(x), pull * x, atol=1e-5 * np.abs(pull * x).max())


@pytest.mark.long
def test_many_bodies_spread_evenly_over_a_ball_tend_to_its_complexity():
    assert 0.6**1.5 == pytest.approx(0.464758, abs=1e-6)
    grid = np.stack(np.meshgrid(*[np.arange(-10.0, 11.0)] * 3), axis=-1).reshape(-1, 3)
    errors = []
    for radius in (4.8, 9.6):
        ball = grid[(grid**2).sum(axis=1) <= radius**2]
        errors.append(Bodies(np.ones(len(ball))).complexity(ball) / 0.6**1.5 - 1)
    assert abs(errors[1]) < 0.007
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.2)  # self-energy of a cell


@pytest.fixture(scope="module")
def janus():
    """Three bodies with E = P = L = 0 over t = -6 ... 6."""
    bodies = Bodies(MASS)
    x, v = bodies.at_rest_as_a_whole(*START)
    t = np.linspace(0, 6, 301)
    later, earlier = bodies.move(x, v, t), bodies.move(x, v, -t)
    x, v = (np.concatenate([b[:0:-1], a]) for a, b in zip(later, earlier, strict=True))
    return bodies, np.concatenate([-t[:0:-1], t]), x, v


def test_energy_and_momenta_stay_while_complexity_grows_to_both_ends_but_not_steadily(janus):
    bodies, _, x, v = janus
    E = [bodies.energy(*state) for state in zip(x, v, strict=True)]
    L = np.einsum("i,tia->ta", MASS, np.cross(x, v))
    assert np.abs(E).max() < 5e-11
    assert np.abs(L).max() < 5e-11
    assert np.abs(MASS @ v).max() < 1e-11
    C = np.array([bodies.complexity(y) for y in x])
    assert_allclose(C[[0, -1]], [0.234, 0.325], atol=5e-4)
    assert C.min() == pytest.approx(0.18191, abs=1e-5)
    assert C.min() >= 1 / (3 * np.sqrt(3)) * 0.9


def test_growth_has_one_direction_and_one_zero_where_the_size_is_smallest(janus):
    bodies, t, x, v = janus
    D = np.array([bodies.growth(*state) for state in zip(x, v, strict=True)])
    size = np.array([bodies.size(y) for y in x])
    V = np.array([bodies.potential(y) for y in x])
    assert (np.diff(D) > 0).all()
    assert_allclose(np.gradient(D, t)[1:-1], -V[1:-1], rtol=0.02)  # Lagrange and Jacobi, E = 0
    assert (np.diff(size, 2) > 0).all()

    def at(time):
        moved = bodies.move(x[300], v[300], [0.0, time])
        return moved[0][-1], moved[1][-1]

    zero = brentq(lambda time: bodies.growth(*at(time)), -0.6, -0.5, xtol=1e-10)
    assert zero == pytest.approx(-0.569365, abs=1e-5)
    assert abs(t[size.argmin()] - zero) < 0.02
    assert bodies.complexity(at(zero)[0]) == pytest.approx(0.192874, abs=1e-5)


def test_shapes_alone_move_as_newton_says(janus):
    bodies, t, x, v = janus
    sphere = ShapeSphere(bodies)
    states = list(zip(x, v, strict=True))
    D = np.array([bodies.growth(*state) for state in states])
    n = np.array([sphere.shape(y) for y in x])
    p = np.array([sphere.momentum(*state) for state in states])
    assert_allclose((n * p).sum(axis=1), 0, atol=1e-12)
    found = sphere.move(n[0], p[0], D)
    assert np.abs(found[0] - n).max() < 2.9e-10
    assert_allclose(np.linalg.norm(found[0], axis=1), 1, atol=1e-10)
    k = np.searchsorted(t, 3.0 - 1e-9)
    R = sphere.size(found[0][k], found[1][k], D[k])
    assert pytest.approx(7.104722808, abs=2e-9) == R
    assert np.sqrt(bodies.size(x[k])) == pytest.approx(R, rel=1e-9)


def test_three_equal_bodies_fall_outward_as_the_closed_form(janus):
    """a = (27 G m / 2)^(1/3) t^(2/3) for the side of an equilateral triangle at energy zero."""
    bodies = Bodies(np.full(3, 2.0))
    side = lambda t: (13.5 * 2.0) ** (1 / 3) * t ** (2 / 3)  # noqa: E731
    t = np.linspace(1.0, 8.0, 9)
    x, v = bodies.move(side(1.0) * CORNERS, 2 / 3 * side(1.0) * CORNERS, t)
    assert abs(bodies.energy(x[0], v[0])) < 1e-12
    assert_allclose(np.linalg.norm(x[:, 0] - x[:, 1], axis=1), side(t), rtol=1e-9)
    assert_allclose([bodies.complexity(y) for y in x], 1 / (3 * np.sqrt(3)), rtol=1e-9)


def test_a_world_without_size_conserves_growth():
    """Degree -2: D stays where E = 0, and I = I_0 + 2 D t."""
    bodies = Bodies(MASS, degree=-2.0)
    x, v = bodies.at_rest_as_a_whole(*START)
    t = np.linspace(0.0, 0.3, 7)
    X, V = bodies.move(x, v, t)
    D = [bodies.growth(*state) for state in zip(X, V, strict=True)]
    assert_allclose(D, D[0], rtol=1e-9)
    assert_allclose([bodies.size(y) for y in X], bodies.size(x) + 2 * D[0] * t, rtol=1e-9)
    with pytest.raises(SolverError, match="two bodies come too close soon after"):
        bodies.move(x, v, np.linspace(0.0, 6.0, 121))


def test_the_figure_eight_closes():
    """Chenciner and Montgomery's orbit with Simo's digits: three bodies chase each other."""
    x = np.array([(0.97000436, -0.24308753, 0), (-0.97000436, 0.24308753, 0), (0, 0, 0)])
    w = np.array([-0.93240737, -0.86473146, 0])
    v = np.array([-w / 2, -w / 2, w])
    period = 6.32591398
    X, _ = Bodies(np.ones(3)).move(x, v, np.array([0.0, period / 3, period]))
    assert_allclose(X[2], x, atol=1e-6)
    order = [int(np.linalg.norm(x - y, axis=1).argmin()) for y in X[1]]
    assert sorted(order) == [0, 1, 2] and order != [0, 1, 2]
    assert_allclose(X[1], x[order], atol=1e-6)


def test_time_is_read_off_pictures_taken_by_anyone(janus):
    bodies, _, _, _ = janus
    x, v = bodies.at_rest_as_a_whole(*START)
    lam = np.linspace(0.0, 1.0, 11)
    t, rate = 0.3 + lam + lam**3, 1 + 3 * lam**2
    X, V = bodies.move(x, v, np.concatenate([[0.0], t]))
    spin = np.array([0.4, -3.0, 1.0])
    for k, s in enumerate(lam):
        A = turned(spin * s)
        dA = rotation.skew(spin) @ A
        y = X[k + 1] @ A.T + np.array([np.sin(9 * s), s**2, -s])
        dy = rate[k] * V[k + 1] @ A.T + X[k + 1] @ dA.T + [9 * np.cos(9 * s), 2 * s, -1]
        kinetic = -bodies.potential(y)
        assert best_matching.emergent_rate(MASS, y, dy, kinetic) == pytest.approx(rate[k], rel=1e-8)


def test_time_is_read_off_a_stack_of_pictures(janus):
    bodies, t, x, _ = janus
    rng = np.random.default_rng(7)
    turns = np.array([expm(rotation.skew([0, 0, a])) for a in rng.uniform(0, 6, len(x))])
    film = np.einsum("tab,tnb->tna", turns, x) + rng.normal(size=(len(x), 1, 3)) * [1, 1, 0]
    laid = stacked(MASS, film, plane=True)
    middle, step = (laid[1:] + laid[:-1]) / 2, np.diff(laid, axis=0)
    dt = [best_matching.emergent_rate(MASS, *pair, -bodies.potential(pair[0]))
          for pair in zip(middle, step, strict=True)]  # fmt: skip
    assert np.sum(dt) == pytest.approx(12.0, rel=1e-4)
    assert_allclose(dt, np.diff(t), rtol=5e-3)


test_messages_name_what_does_not_fit = refused(
    (lambda: Bodies([1.0, -1.0]), ConfigError, "needed are two or more masses > 0"),
    (lambda: Bodies([1.0, 1.0], degree=1.0), ConfigError, "must be negative, to attract"),
    (lambda: ShapeSphere(Bodies(np.ones(4))), ConfigError, "three bodies of degree -1"),
    (lambda: match(MASS, np.ones((3, 2)), np.ones((3, 2))), ConfigError, r"has shape \(3, 2\)"),
    (lambda: match(np.ones(2), CORNERS, CORNERS), ConfigError, r"shape \(2,\) must fit 9"),
    (lambda: match(MASS, CORNERS, CORNERS[:2]), ConfigError, "6 velocities for 9"),
    (lambda: frame(MASS, line(0, 1, 3), line(0, 1, 3)), ModelError, "no rotation is better"),
    (lambda: frame(MASS, CORNERS, CORNERS[:2]), ConfigError, "2 particles for"),
    (lambda: match(MASS, np.nan * CORNERS, CORNERS), ConfigError, "is not finite"),
    (lambda: stacked(MASS, CORNERS), ConfigError, r"the film has shape \(3, 3\)"),
    (lambda: best_matching.emergent_rate(MASS, CORNERS, CORNERS, -1.0), ModelError, "E - V = -1 J"),
    (lambda: Bodies(MASS).potential(CORNERS[:2]), ConfigError, "2 positions"),
    (lambda: Bodies(MASS).complexity(0 * CORNERS), ModelError, "in the same place"),
    (lambda: Bodies(MASS).move(CORNERS, CORNERS[:2], [0.0, 1.0]), ConfigError, "for 3 bodies"),
    (lambda: Bodies(MASS).at_rest_as_a_whole(CORNERS, np.ones((3, 3))), ModelError, "are a rigid"),
)  # fmt: skip
