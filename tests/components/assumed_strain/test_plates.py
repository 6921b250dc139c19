"""Bending of sheets without rotations: closed forms, and plates by polynomials of Ritz."""

import numpy as np
import pytest
from numpy.polynomial.legendre import Legendre, leggauss
from numpy.testing import assert_allclose
from scipy.linalg import eigh
from scipy.sparse.linalg import eigsh
from scipy.spatial import Delaunay

import rom
from cases.refusals import refuses
from cases.sheets import distorted, strip
from rom.components.assumed_strain import Metal, in_space, mass, rectangle, sheet
from rom.components.assumed_strain.space import bending
from rom.errors import InterfaceError

SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]
STEEL = Metal(210e9, 0.3, 7850.0)
STIFFNESS = 210e9 * 0.01**3 / 12 / (1 - 0.3**2)
UNIT = np.sqrt(210e9 * 0.002**2 / 12 / 7850) / 0.4**2 / (2 * np.pi)  # of strips of 0.4 m [Hz]


def bent(body, metal):
    K, M = bending(body, metal).toarray(), mass(body, metal)[::2, ::2].toarray()
    return np.sqrt(np.abs(eigh(K, M, eigvals_only=True))) / (2 * np.pi)


def meshed(kind, n):
    """Unit square: diagonals one way, crossed, or Delaunay's triangles between random points."""
    if kind != "Delaunay":
        return rectangle((n, n), SQUARE, kind)
    X, _ = distorted((n, n), 0.3)
    T = Delaunay(X).simplices
    u, v = X[T[:, 1]] - X[T[:, 0]], X[T[:, 2]] - X[T[:, 0]]
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    T[area < 0] = T[area < 0][:, ::-1]
    return X, T[np.abs(area) > 1e-10]


def square(fixed=False, degree=13, nu=0.3):
    """omega sqrt(rho t / D) of a square plate by Ritz: polynomials, free or clamped at x = 1."""
    z, w = leggauss(2 * degree)
    legendre = [Legendre.basis(k) for k in range(degree)]
    clamp = Legendre.fromroots([1, 1]) if fixed else Legendre([1])
    x = [np.array([(p * clamp).deriv(m)(z) for p in legendre]) * 2**m for m in range(3)]
    y = [np.array([p.deriv(m)(z) for p in legendre]) * 2**m for m in range(3)]
    A = [[(f * w / 2) @ g.T for g in x] for f in x]
    B = [[(f * w / 2) @ g.T for g in y] for f in y]
    K = np.kron(A[2][2], B[0][0]) + np.kron(A[0][0], B[2][2])
    K += nu * (np.kron(A[2][0], B[0][2]) + np.kron(A[0][2], B[2][0]))
    K += 2 * (1 - nu) * np.kron(A[1][1], B[1][1])
    lam = eigh(K, np.kron(A[0][0], B[0][0]), eigvals_only=True, subset_by_index=(0, 9))
    return np.sqrt(np.abs(lam))


@pytest.mark.parametrize("kind", ["/", "x", "Delaunay"])
def test_frequencies_of_a_square_converge_on_every_mesh(kind):
    """Ritz: 13.47, 19.60, 24.27, 34.80 twice; Leissa (1973) has 13.49, 19.79, 24.43, 35.02."""
    exact = square()[3:8]
    assert_allclose(exact, [13.49, 19.79, 24.43, 35.02, 35.02], rtol=1e-2)
    errors = []
    for n in (8, 16, 32):
        body = sheet(*meshed(kind, n), thickness=0.01)
        lam = eigsh(bending(body, STEEL), 8, mass(body, STEEL)[::2, ::2], sigma=-1.0)[0]
        omega = np.sqrt(np.abs(np.sort(lam)))
        assert np.all(omega[:3] < 0.1)
        errors.append(np.abs(omega[3:] / np.sqrt(STIFFNESS / 78.5) / exact - 1).max())
    assert errors[0] < 1.1e-2 and errors[2] < 1e-3
    assert np.log2(errors[0] / errors[2]) > 3.5  # of the order h^2 over two halvings


@pytest.mark.parametrize("kind", ["/", "x", "Delaunay"])
def test_a_cantilever_plate_by_its_reduced_body(kind):
    """Two held rows clamp; what is free behind them vibrates like Ritz's clamped square."""
    n = 24
    X, T = meshed(kind, n)
    last = np.abs(X[:, 0] * n - (n - 1)) < 0.45  # before the held strip, one cell wide
    X[last, 0] = 1 - 1 / n
    X[:, 0] *= n / (n - 1)
    root = np.flatnonzero(X[:, 0] > 1 - 1e-9)
    model = in_space(sheet(X, T, thickness=0.01), STEEL, {"root": root})
    found = rom.modes(model, 5, fixed=("root",)).frequencies * 2 * np.pi
    exact = square(fixed=True)[:5]
    assert_allclose(exact[:2], [3.492, 8.525], rtol=7e-3)  # Leissa (1973), from above
    assert_allclose(found, exact * np.sqrt(STIFFNESS / 78.5), rtol=4e-3)


@pytest.mark.parametrize("kind", ["/", "x", "Delaunay"])
def test_a_twisted_square_is_held_at_its_corners_and_uniform_curvature_loads_no_inner_node(kind):
    """w = x y: Kirchhoff's corner forces 2 D (1 - nu), and no other node is loaded."""
    X, T = meshed(kind, 7)
    f = bending(sheet(X, T, thickness=0.01), STEEL) @ (X[:, 0] * X[:, 1])
    corner = np.all((X < 1e-9) | (X > 1 - 1e-9), axis=1)
    expected = 2 * STIFFNESS * 0.7 * np.where(np.isclose(X[:, 0], X[:, 1]), 1, -1)
    assert_allclose(f[corner], expected[corner], rtol=1e-9)
    assert np.abs(f[~corner]).max() < 1e-8 * STIFFNESS
    X, T = meshed(kind, 12)
    K = bending(sheet(X, T, thickness=0.01), STEEL)
    inside = np.all((X > 0.3) & (X < 0.7), axis=1)
    for w in (X[:, 0] ** 2, X[:, 0] * X[:, 1], X[:, 1] ** 2 - 3 * X[:, 0] ** 2):
        assert np.abs((K @ w)[inside]).max() < 1e-8 * STIFFNESS


@pytest.mark.parametrize("n", [(1, 1), (2, 1), (20, 1), (3, 3)])
@pytest.mark.parametrize("diagonal", ["/", "x"])
def test_only_planes_cost_nothing_even_without_a_quadratic(n, diagonal):
    """Two rows of nodes lie on a conic: planes stay free of energy, all else costs some."""
    X, T = rectangle(n, [(0, 0), (0.4, 0), (0.4, 0.1), (0, 0.1)], diagonal)
    lam = np.linalg.eigvalsh(bending(sheet(X, T, thickness=0.01), STEEL).toarray())
    assert np.abs(lam[:3]).max() < 1e-9 * lam[-1] and lam[3] > 1e-6 * lam[-1]


@pytest.mark.parametrize("diagonal", ["/", "x"])
def test_a_strip_twists_like_a_free_bar_and_bends_like_a_free_beam_in_spite_of_poisson(diagonal):
    """G J = G b t^3 / 3; E I, as edges are free; Euler and Bernoulli without Poisson's ratio."""
    body, metal, _ = strip(diagonal=diagonal)
    f = bent(body, metal)[:8]
    twist = np.sqrt(210e9 / 2.6 * 4 * 0.002**2 / 0.04**2 / 7850) / (2 * 0.4)
    assert_allclose(f[3:5], np.array([4.730041, 7.853205]) ** 2 * UNIT, rtol=4e-3)
    assert np.abs(f[5:] / twist - 1).min() < 0.03
    body, metal, _ = strip(nu=0.0, diagonal=diagonal)
    f = bent(body, metal)[:5]
    assert np.all(f[:3] < 0.01)
    assert_allclose(f[3:], np.array([4.730041, 7.853205]) ** 2 * UNIT, rtol=6e-4)


@pytest.mark.parametrize(("diagonal", "soft"), [("/", 0.02), ("x", 0.003)])
def test_one_row_of_triangles_bends_a_little_softly(diagonal, soft):
    """Slopes of sides that run across the strip are fitted to four nodes on two lines."""
    X, T = rectangle((40, 1), [(0, 0), (0.4, 0), (0.4, 0.04), (0, 0.04)], diagonal)
    body, metal = sheet(X, T, thickness=0.002), Metal(210e9, 0.0, 7850.0)
    f = bent(body, metal)[3:5]
    error = f / (np.array([4.730041, 7.853205]) ** 2 * UNIT) - 1
    assert np.all(error < 0) and -soft < error.min() < -soft / 4


def test_interfaces_that_name_no_node_of_the_sheet():
    body, edge = sheet(*distorted()), {"edge": np.array([0, 1, 99])}
    refuses(InterfaceError, "interface 'edge': 99 must be from", in_space, body, STEEL, edge)
