"""Assumed-strain triangle: published problems, closed forms, and the reduction chain."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh
from scipy.sparse.linalg import eigsh, spsolve

import rom
from cases.long import few
from cases.paths import RANKS
from cases.ranks.environment import on_ranks
from cases.refusals import refused
from cases.sheets import distorted, dofs, strip
from rom.components import assumed_strain as sheets
from rom.components.assumed_strain import Metal, forces, mass, rectangle, sheet, tangent
from rom.errors import ConfigError, InterfaceError, MaterialError, MeshError, SolverError

COOK = [(0, 0), (48, 44), (48, 60), (0, 44)]
COOK_TABLE = {  # n: tip deflections of CST, F3, F1 with one diagonal, then with the other
    2: (6.7425, 9.8182, 13.9666, 11.9928, 17.6347, 22.8291),
    4: (11.2520, 18.8193, 22.3481, 18.2837, 22.7878, 24.5561),
    8: (17.3312, 22.9361, 23.7635, 22.0224, 23.7672, 24.1947),
    16: (21.5922, 23.7482, 23.9153, 23.4120, 23.9227, 24.0269),
    32: (23.2751, 23.9035, 23.9465, 23.8155, 23.9518, 23.9823),
}
STEEL = Metal(210e9, 0.3, 7850.0)
COPPER = Metal(117e9, 0.35, 8930.0, yield_stress=400e6, hardening=100e6)


def cook(n, diagonal, load, **options):
    """Sheet, dead loads on the right edge, held dofs, and the nodes at (48, 52) and (48, 60)."""
    X, T = rectangle((n, n), COOK, diagonal)
    right = np.flatnonzero(np.isclose(X[:, 0], 48))
    right, f = right[np.argsort(X[right, 1])], np.zeros_like(X)
    f[right, 1] = load / n
    f[right[[0, -1]], 1] /= 2
    seen = [int(np.abs(X - point).sum(axis=1).argmin()) for point in ((48, 52), (48, 60))]
    return sheet(X, T, **options), f, dofs(np.isclose(X[:, 0], 0)), seen


def hertz(body, metal, free, n):
    K, M = tangent(body, metal, body.points), mass(body, metal)
    return np.sqrt(eigsh(K[free][:, free], n, M[free][:, free], sigma=0.0)[0]) / (2 * np.pi)


def solved(body, metal, f, held):
    K, u = tangent(body, metal, body.points), np.zeros(f.size)
    free = np.setdiff1d(np.arange(f.size), held)
    u[free] = spsolve(K[free][:, free].tocsc(), f.ravel()[free])
    return u.reshape(-1, 2)


@pytest.mark.long
@pytest.mark.parametrize("n", few(1, COOK_TABLE))
def test_cooks_membrane(n):
    found = []
    for diagonal in ("/", "\\"):
        for element in ("CST", "F3", "F1"):
            body, f, held, seen = cook(n, diagonal, 1.0, element=element)
            found.append(solved(body, Metal(1.0, 1 / 3), f, held)[seen[0], 1])
    assert_allclose(found, COOK_TABLE[n], atol=1e-3)


@pytest.mark.long
@pytest.mark.parametrize(
    ("n", "element", "expected"),
    [(8, "CST", 2.5026), (16, "CST", 3.0770), (8, "F3", 3.2484), (16, "F3", 3.3648),
     (32, "F3", 3.3894), (8, "F1", 3.3602), (16, "F1", 3.3886), (32, "F1", 3.3960)],
)  # fmt: skip
def test_cooks_membrane_bent_far(n, element, expected):
    """St. Venant-Kirchhoff in plane strain, eight steps; last, what P2 elements give."""
    body, f, held, seen = cook(n, "/", 40.0, element=element, state="plane strain")
    x, _, iterations = sheets.equilibrium(body, Metal(240.565, 0.3, linear=True), f, held, steps=8)
    assert (x - body.points)[seen[0], 1] == pytest.approx(expected, abs=1e-4)
    assert iterations <= 4
    if n == 32:
        near, corner = (x - body.points)[seen]
        tolerance = 4e-3 if element == "F1" else 1.2e-2
        assert_allclose(near, [-1.6985, 3.3996], rtol=tolerance)
        assert_allclose(corner, [-2.8611, 3.4722], rtol=tolerance)


FREQUENCIES = {
    (10, 1): (1704.1, 9550.1, 1056.1, 6318.8, 638.0, 3963.0),
    (20, 2): (1119.3, 6617.1, 854.8, 5141.8, 763.8, 4610.1),
    (40, 4): (906.8, 5425.6, 827.1, 4965.8, 806.9, 4844.4),
}
P2 = np.array([822.10, 4931.8])


@pytest.mark.parametrize("n", FREQUENCIES)
def test_frequencies_of_a_cantilever(n):
    X, T = rectangle(n, [(0, 0), (100, 0), (100, 10), (0, 10)])
    metal, found = Metal(2.1e4, 0.3, 8e-10), []
    free = dofs(X[:, 0] > 1e-9)
    for element in ("CST", "F3", "F1"):
        found.append(hertz(sheet(X, T, element=element), metal, free, 2))
    assert_allclose(np.concatenate(found), FREQUENCIES[n], atol=0.06)
    if n[0] > 10:
        error = np.abs(np.array(found) / P2 - 1)
        assert np.all(error[1] < error[0] / 3)


def test_fine_triangles_have_the_frequencies_of_quadratic_ones():
    """Two of bending, one of stretching, two of bending, by another program and elements."""
    X, T = rectangle((160, 16), [(0, 0), (100, 0), (100, 10), (0, 10)])
    metal, free, found = Metal(2.1e4, 0.3, 8e-10), dofs(X[:, 0] > 1e-9), []
    for element in ("F3", "F1"):
        found.append(hertz(sheet(X, T, element=element), metal, free, 5))
    quadratic = [822.10, 4931.8, 12823.3, 12990.2, 23606.2]
    for f in found:
        assert_allclose(f, quadratic, rtol=1.5e-3)
    assert_allclose(found[0], quadratic, rtol=4e-4)


@pytest.mark.parametrize("state", ["plane stress", "plane strain"])
def test_patches_and_sides_give_the_same_stiffness(state):
    """The gradient at a side is the mean of its two triangles, weighted by area: ES-FEM."""
    X, T = distorted()
    body, metal = sheet(X, T, state=state, thickness=0.3), Metal(1.0, 0.3)
    K = sheets.stiffness_by_sides(body, metal).toarray()
    assert_allclose(tangent(body, metal, X).toarray(), K, rtol=0, atol=2e-9)  # by differences
    G, n = body.gradients[:, :, 0], 2 * len(X)
    E, nu = (1.0, 0.3) if state == "plane stress" else (1 / (1 - 0.3**2), 0.3 / 0.7)
    D = E / (1 - nu**2) * np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
    patches = np.zeros((n, n))
    for e, p in np.ndindex(G.shape[:2]):
        B = np.zeros((3, n))
        for i, node in enumerate(body.patch[e]):
            gx, gy = G[e, p, i]
            B[:, 2 * node : 2 * node + 2] += [[gx, 0], [0, gy], [gy, gx]]
        patches += body.weights[e, p] * B.T @ D @ B
    assert_allclose(patches, K, rtol=0, atol=1e-13)
    constant = sheet(X, T, element="CST").gradients[:, 0, 0]
    u = np.random.default_rng(0).normal(size=len(X))
    side = np.einsum("tsi,ti->ts", body.gradients[:, :, 0, :, 0], u[body.patch])
    own = np.einsum("ti,ti->t", constant[..., 0], u[body.patch])
    sides = [[frozenset((t[k - 1], t[k - 2])) for k in range(3)] for t in T]
    for t, k in ((5, 0), (9, 1), (20, 2)):
        both = [e for e in range(len(T)) if sides[t][k] in sides[e]]
        mean = (own[both] * body.area[both]).sum() / body.area[both].sum()
        assert side[t, k] == pytest.approx(mean, abs=1e-13)


def test_processes_share_the_sides():
    body, metal = sheet(*distorted((2, 1))), Metal(1.0, 0.3)
    K = sheets.stiffness_by_sides(body, metal)
    for n in (2, 3, 12):
        parts = [sheets.stiffness_by_sides(body, metal, share=(k, n)) for k in range(n)]
        assert abs(sum(parts) - K).max() < 1e-15
        assert abs(parts[0] - K).max() > 0.1


@pytest.mark.fenicsx
@pytest.mark.mpi
def test_two_processes_find_the_frequencies_of_one(tmp_path):
    assert on_ranks(2, RANKS / "sheet_under_mpi.py", tmp_path / "s").returncode == 0
    found = np.load(tmp_path / "s.npz")
    body, metal = sheet(*distorted((8, 6))), Metal(210e9, 0.3, 7850.0)
    lam = np.linalg.eigvalsh(tangent(body, metal, body.points).toarray())
    assert_allclose(found["spectrum"], lam, atol=1e-8 * lam[-1])
    one = sheets.stiffness_by_sides(body, metal).toarray()
    assert_allclose(found["spectrum"], np.linalg.eigvalsh(one), atol=1e-13 * lam[-1])
    assert len(found["work"]) == 2 and found["work"].max() < 0.9 * np.count_nonzero(one)


@pytest.mark.parametrize("element", ["F1", "F3", "CST"])
@pytest.mark.parametrize("state", ["plane stress", "plane strain"])
def test_uniform_deformation_loads_no_inner_node(element, state):
    """The patch test, finite: large stretch and shear of a distorted mesh."""
    X, T = distorted()
    body = sheet(X, T, element=element, state=state)
    f, _ = forces(body, Metal(10.0, 0.3), X @ np.array([[1.3, 0.2], [-0.4, 0.8]]))
    inside = np.all((X > 1e-9) & (X < 1 - 1e-9), axis=1)
    assert np.abs(f[inside]).max() < 1e-10 < np.abs(f[~inside]).max()
    edges = [(X[:, axis] == side, axis, 2 * side - 1) for axis in (0, 1) for side in (0, 1)]
    pulls = np.array([n * f[on & (X[:, 1 - axis] % 1 > 0)].sum(axis=0) for on, axis, n in edges])
    assert_allclose(pulls[[0, 2]], pulls[[1, 3]], atol=1e-10)  # tractions of one uniform stress


@pytest.mark.parametrize("element", ["F1", "F3"])
@pytest.mark.parametrize("n", [1, 2, 4])
def test_only_rigid_motions_cost_nothing_and_turns_make_no_force(element, n):
    body = sheet(*distorted((n, n)), element=element)
    x = body.points @ np.array([[0.0, 1.0], [-1.0, 0.0]])
    assert np.abs(forces(body, Metal(10.0, 0.3, yield_stress=0.1), x)[0]).max() < 1e-12
    lam = np.linalg.eigvalsh(tangent(body, Metal(1.0, 0.3), body.points).toarray())
    assert np.abs(lam[:3]).max() < 1e-9 and lam[3] > 1e-4


@pytest.mark.parametrize("element", ["F1", "F3"])
@pytest.mark.parametrize("state", ["plane stress", "plane strain", "axisymmetric"])
def test_the_tangent_is_the_derivative_of_the_forces(element, state):
    X, T = distorted((2, 2))
    X += (0.5, 0.0)
    rng = np.random.default_rng(3)
    for metal in (Metal(10.0, 0.3), Metal(10.0, 0.3, yield_stress=0.5, hardening=1.0)):
        body = sheet(X, T, element=element, state=state)
        x = X @ np.array([[1.2, 0.1], [-0.2, 0.9]]) + 0.02 * rng.normal(size=X.shape)
        K, step = tangent(body, metal, x).toarray(), 1e-6
        for dof in (0, 7, 8, 13):
            up, down = x.copy(), x.copy()
            up.reshape(-1)[dof] += step
            down.reshape(-1)[dof] -= step
            df = (forces(body, metal, up)[0] - forces(body, metal, down)[0]).ravel() / (2 * step)
            assert np.abs(K[:, dof] - df).max() < 1e-6 * np.abs(K).max()


def pulled(stretches, metal, state="plane stress"):
    """Force per initial area along a bar in one direction, for a path of stretches."""
    X, T = rectangle((2, 2), [(0, 0), (1, 0), (1, 1), (0, 1)])
    body, history, found = sheet(X, T, state=state), None, []
    low, right = dofs(X[:, 1] < 1e-9, (1,)), dofs(X[:, 0] > 1 - 1e-9, (0,))
    left = dofs(X[:, 0] < 1e-9, (0,))
    held = np.unique(np.concatenate([low, left, right]))
    free, x = np.setdiff1d(np.arange(2 * len(X)), held), X.copy()
    for stretch in stretches:
        x[:, 0] *= stretch / x[:, 0].max()
        for _ in range(30):
            f, new = forces(body, metal, x, history)
            if np.abs(f.ravel()[free]).max() < 1e-11 * metal.E:
                break
            K = tangent(body, metal, x, history)[free][:, free]
            x.reshape(-1)[free] -= spsolve(K.tocsc(), f.ravel()[free])
        history = new
        found.append((f.ravel()[right].sum(), x[:, 1].max(), history[0, 0, 4]))
    return np.array(found)


def test_bars_follow_the_closed_forms_of_hencky_and_of_yield():
    """Force over section E ln(stretch) / stretch; beyond yield (sy + H e E / E) E / (E + H)."""
    stretches = np.array([1.05, 1.3, 1.8, 0.7])
    force, width, _ = pulled(stretches, Metal(3.0, 0.3)).T
    assert_allclose(force, 3.0 * np.log(stretches) / stretches, rtol=1e-9)
    assert_allclose(width, stretches**-0.3, rtol=1e-9)
    E, sy, hard = 1000.0, 5.0, 50.0
    strains = np.array([0.004, 0.02, 0.2, 0.198])
    force, _, plastic = pulled(np.exp(strains), Metal(E, 0.3, 1.0, sy, hard)).T
    T = E * (sy + hard * strains[:3]) / (E + hard)
    T = np.r_[E * strains[0], T[1:], T[2] - E * 0.002]
    assert_allclose(force * np.exp(strains), T, rtol=1e-7)
    assert_allclose(plastic[1:], (strains - T / E)[1:], rtol=1e-6)


def test_plastic_stress_turns_with_the_body():
    """Simple shear beyond yield, then a turn: Cauchy stress turns, energy conjugates do not."""
    X, T = distorted((2, 2))
    metal, body = Metal(100.0, 0.3, 1.0, 1.0, 5.0), sheet(X, T, state="plane strain")
    sheared = X @ np.array([[1.0, 0.0], [0.4, 1.0]])
    f, history = forces(body, metal, sheared)
    turn = np.array([[np.cos(1.1), np.sin(1.1)], [-np.sin(1.1), np.cos(1.1)]])
    turned, other = forces(body, metal, sheared @ turn)
    assert_allclose(turned, f @ turn, atol=1e-12)
    assert_allclose(other, history, atol=1e-14)


def test_a_thick_ring_under_pressure_is_that_of_lame():
    a, b, p = 1.0, 2.0, 1e-4
    X, T = rectangle((24, 2), [(a, 0), (b, 0), (b, 0.1), (a, 0.1)])
    metal, errors = Metal(1.0, 0.3), {}
    bore = np.flatnonzero(np.isclose(X[:, 0], a))
    f = np.zeros_like(X)
    f[bore, 0] = 2 * np.pi * a * p * 0.05 * np.where(np.isclose(X[bore, 1] % 0.1, 0.05), 1, 0.5)
    r = X[:, 0]
    exact = p * a**2 / (b**2 - a**2) * (1.3 * 0.4 * r + 1.3 * b**2 / r)
    for element in ("F1", "F3"):
        body = sheet(X, T, element=element, state="axisymmetric")
        u = solved(body, metal, f, dofs(np.ones(len(X)), (1,)))
        errors[element] = np.abs(u[:, 0] / exact - 1).max()
    assert max(errors.values()) < 4e-3


def test_mass_is_that_of_the_solid_and_a_sheet_in_space_has_six_rigid_motions():
    flat = sheet(*distorted(), thickness=0.2)
    assert mass(flat, STEEL).sum() / 2 == pytest.approx(7850 * 0.2)
    round_ = sheet(*rectangle((3, 5), [(0, 0), (2, 0), (2, 3), (0, 3)]), state="axisymmetric")
    assert mass(round_, STEEL).sum() / 2 == pytest.approx(7850 * np.pi * 4 * 3)
    X, T = distorted((3, 3))
    model = sheets.in_space(sheet(X, T), Metal(1.0, 0.3), {"all": np.arange(len(X))})
    lam = np.linalg.eigvalsh(model.K.toarray())
    assert np.abs(lam[:6]).max() < 1e-9 and lam[6] > 1e-4
    assert model.mass() == pytest.approx(1.0)


def test_explicit_motion_keeps_its_energy():
    """A bar rings: its kinetic energy and the work of its forces cancel, its period is 4 L / c."""
    L, metal = 1.0, Metal(100.0, 0.0, 1.0)
    X, T = rectangle((40, 1), [(0, 0), (L, 0), (L, 0.02), (0, 0.02)])
    body = sheet(X, T, element="F1")
    v = np.zeros_like(X)
    v[:, 0] = 1e-4 * np.sin(np.pi * X[:, 0] / 2)
    held = np.concatenate([dofs(X[:, 0] < 1e-9), dofs(np.ones(len(X)), (1,))])
    flight = sheets.fly(body, metal, v, held, 0.8, pictures=81)  # two periods
    end = flight.x[:, np.argmax(X[:, 0]), 0] - L
    period = 4 * L / 10
    exact = 1e-4 * np.sin(2 * np.pi * flight.t / period) * period / (2 * np.pi)
    assert_allclose(end, exact, atol=3e-8)
    quarter = sheets.fly(body, metal, v, held, period / 4, pictures=2)
    kinetic = 0.5 * v.ravel() @ (mass(body, metal) @ v.ravel())
    assert quarter.work == pytest.approx(kinetic, rel=5e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("element", "length", "foot", "plastic"),
    [("CST", 21.325, 5.883, 3.17), ("F3", 21.319, 5.993, 1.70), ("F1", 21.448, 6.931, 2.87)],
)
def test_only_one_point_lets_the_foot_of_taylors_bar_flow(element, length, foot, plastic):
    """Another program's explicit steps: incompressible flow locks what has more points."""
    R, L = 3.2e-3, 32.4e-3
    X, T = rectangle((5, 50), [(0, 0), (R, 0), (R, L), (0, L)])
    body, v = sheet(X, T, element=element, state="axisymmetric"), np.zeros_like(X)
    held = np.concatenate([dofs(X[:, 0] < 1e-9, (0,)), dofs(X[:, 1] < 1e-9, (1,))])
    v[:, 1] = -227.0
    flight = sheets.fly(body, COPPER, v, held, 80e-6, pictures=2)
    r, z = flight.x[-1].max(axis=0) * 1e3
    assert z == pytest.approx(length, rel=1e-3)
    assert r == pytest.approx(foot, rel=0.025)
    assert flight.plastic[-1].max() == pytest.approx(plastic, rel=0.02)
    if element == "F1":
        a, b, c = (flight.x[-1][T[:, k]] for k in range(3))
        u, w = b - a, c - a  # single ones may turn over: only the mean of a patch counts
        area = 0.5 * (u[:, 0] * w[:, 1] - u[:, 1] * w[:, 0])
        now = 2 * np.pi * area @ flight.x[-1][T, 0].mean(axis=1)
        assert now == pytest.approx(np.pi * R**2 * L, rel=0.03)  # plastic flow keeps the volume
        lumped = mass(body, COPPER).sum() / 2
        assert flight.work == pytest.approx(0.5 * lumped * 227**2, rel=0.02)  # all was spent


def test_a_sheet_goes_through_the_reduction_chain():
    body, metal, model = strip()
    kinds = {"root": "rbe2", "tip": "rbe2"}
    full = rom.modes(model, 8, fixed=("root",), interfaces=kinds).frequencies
    reduced = rom.reduce(model, method=rom.CraigBampton(30), interfaces=kinds, reference="root")
    error = reduced.frequencies(8, fixed=("root",)) / full - 1
    assert np.all((error > -1e-8) & (error < 1e-3))
    assert reduced.certificate.ok, str(reduced.certificate)
    assert rom.check(reduced).ok
    # in its plane the cantilever behind the held rows is that of the plane matrices
    plane = hertz(body, metal, dofs(body.points[:, 0] > 0.0101), 1)
    held = rom.modes(model, 12, fixed=("root",)).frequencies
    assert np.abs(held / plane[0] - 1).min() < 1e-8


def test_plane_matrices_reduce_as_they_are():
    X, T = rectangle((40, 4), [(0, 0), (100, 0), (100, 10), (0, 10)])
    body, metal = sheet(X, T), Metal(2.1e4, 0.3, 8e-10)
    K, M = tangent(body, metal, X), mass(body, metal)
    ends = dofs((X[:, 0] < 1e-9) | (X[:, 0] > 100 - 1e-9))
    basis = rom.craig_bampton(K, M, ends, 12)
    left = np.isin(np.arange(len(basis.labels)), np.flatnonzero(X[ends // 2, 0] < 1e-9))
    K_r, M_r = (basis.project(A)[np.ix_(~left, ~left)] for A in (K, M))
    reduced = np.sqrt(eigh(K_r, M_r, eigvals_only=True)[:5]) / (2 * np.pi)
    full = hertz(body, metal, dofs(X[:, 0] > 1e-9), 5)
    assert np.all((reduced / full - 1 > -1e-9) & (reduced / full - 1 < 1e-3))


X, T = distorted((2, 2))
SMALL, SOFT = sheet(X, T), Metal(1.0, 0.3)


def torn():
    body, f, held, _ = cook(2, "/", 1e6, state="plane strain")
    return sheets.equilibrium(body, Metal(240.0, 0.3), f, held)


test_messages_name_what_is_wrong = refused(
    (torn, SolverError, "instant 1"),
    (lambda: Metal(1.0, 0.5), MaterialError, "nu = 0.5 must be above -1 and below 0.5"),
    (lambda: Metal(-1.0, 0.3), MaterialError, "E = -1 must be positive"),
    (lambda: Metal(1.0, 0.3, 1.0, 1.0, -2.0), MaterialError, "hardening = -2 must not be negative"),
    (lambda: sheet(SMALL.points, SMALL.triangles + 5), MeshError, "13 must be from 0 to 8"),
    (lambda: sheet(SMALL.points.T, SMALL.triangles), MeshError, r"points \(2, 9\)"),
    (lambda: sheet(SMALL.points - 2, SMALL.triangles, state="axisymmetric"), MeshError,
     "-2 m of node 0, is a radius"),
    (lambda: forces(SMALL, SOFT, SMALL.points[:3]), ConfigError, r"has shape \(3, 2\)"),
    (lambda: tangent(SMALL, SOFT, np.nan * SMALL.points), ConfigError, "is not finite"),
    (lambda: sheets.fly(SMALL, SOFT, np.zeros((3, 2)), [0], 1.0), ConfigError, "velocities has"),
    (lambda: sheets.fly(SMALL, SOFT, 0 * SMALL.points, [18], 1.0), ConfigError, "dofs .* 18 must"),
    (lambda: sheets.equilibrium(SMALL, SOFT, np.zeros(3), [0]), ConfigError, "forces of load 0"),
    (lambda: sheet(X, T[:, ::-1]), MeshError, "triangle 0 has the area"),
    (lambda: sheet(np.vstack([X, X[:1] - 1]), [*T, T[0], T[0]]), MeshError, "belongs to 4"),
    (lambda: sheets.in_space(sheet(X, T, state="plane strain"), STEEL, {}), ConfigError, "strain"),
    (lambda: sheets.in_space(SMALL, STEEL, {"edge": np.flatnonzero(X[:, 0] < 1e-9)}),
     InterfaceError, "'edge' has no triangle"),
    (lambda: sheets.stiffness_by_sides(SMALL, STEEL, share=(2, 2)), ConfigError, "share 2 of 2"),
    (lambda: sheets.stiffness_by_sides(sheet(X, T, state="axisymmetric"), STEEL),
     ConfigError, "axisymm"),
)  # fmt: skip
