"""The compressor blade: its geometry, its first mode, and what its flanks need as interfaces."""

import runpy
import sys

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from numpy.testing import assert_allclose
from scipy.linalg import block_diag, eigh
from scipy.sparse import coo_matrix, identity, kron
from scipy.sparse.linalg import eigsh

import rom
from cases.long import ROM_LONG
from cases.measures import areas
from cases.paths import ROOT
from cases.solid import reduced
from rom.errors import RomWarning
from rom.fe.mesh.quality import aspect_ratio, scaled_jacobian
from rom.fe.mesh.read import read_mesh
from rom.reduction.interfaces.polynomial import Polynomial, interface_functions

pytestmark = [pytest.mark.fenicsx, pytest.mark.long]
GEOMETRY = ROOT / "meshes" / "compressor_blade.geo"
TITANIUM = rom.Material(E=114e9, nu=0.33, rho=4430.0)
BED = 114e9 / 0.010  # of the disk [N/m^3]
COARSE = {"lc": 0.010, "lc_flank": 0.0033}
FLANKS = ("flank_left", "flank_right")
# the crowned blade has the harder flanks; the plane one, half a minute more, is left to `make long`
CROWNS = {"plane": 0.0, "crowned": 0.03} if ROM_LONG else {"crowned": 0.03}


@pytest.fixture(scope="module", params=CROWNS.values(), ids=CROWNS)
def blade(request):
    """(model, its ten frequencies [Hz] on an elastic bed, radius of its flanks)."""
    sizes = COARSE | {"crown": request.param}
    model = rom.fe.model(GEOMETRY, material=TITANIUM, parameters=sizes, order=2)
    K = model.K.tocsc()
    for name in FLANKS:
        S = kron(model.interfaces[name].surface_mass, identity(3), "coo")
        dofs = model.interfaces[name].dofs
        K = K + BED * coo_matrix((S.data, (dofs[S.row], dofs[S.col])), shape=K.shape).tocsc()
    lam = eigsh(K, 10, model.M.tocsc(), sigma=0.0, return_eigenvectors=False)
    return model, np.sqrt(np.sort(lam)) / (2 * np.pi), request.param


def seated(body):
    """Ten frequencies [Hz] on the bed; orthonormal functions feel it each for itself."""
    M, K = body.full_matrices()
    for name in FLANKS:
        H = body.marker(name).hold
        K = K + BED * H.T @ H
    return np.sqrt(eigh(K, M, eigvals_only=True, subset_by_index=(0, 9))) / (2 * np.pi)


def test_the_mesh_is_accepted_without_a_remark_fit_for_use_and_always_the_same(blade):
    told = blade[0].provenance
    assert blade[0].interface_names == FLANKS
    assert told["warnings"] == told["gmsh_warnings"] == []
    mesh, again = (read_mesh(GEOMETRY) for _ in range(2))
    assert np.array_equal(mesh.points, again.points) and np.array_equal(mesh.cells, again.cells)
    assert scaled_jacobian(mesh).min() > 0.01
    assert aspect_ratio(mesh).max() < 20
    assert mesh.region_names == {1: "blade"}
    assert 10e3 < 3 * len(read_mesh(GEOMETRY, parameters=COARSE, order=2).points) < 20e3


@pytest.mark.parametrize("crown", [0.0, 0.03])
@pytest.mark.parametrize("change", [{}, {"beta": 60.0, "l_root": 0.040, "R": 0.001}])
def test_flanks_are_planes_or_cylinders_where_the_dovetail_has_them(crown, change):
    p = {"beta": 50.0, "l_root": 0.044, "R": 0.0015} | change
    mesh = read_mesh(GEOMETRY, parameters=p | {"crown": crown}, order=2)
    beta = np.radians(p["beta"])
    width = 0.006 / np.sin(beta) - 2 * p["R"] * np.tan(beta / 2)
    middle = np.array([0.009, -0.009 - 0.003 / np.tan(beta)])  # of the right flank in (y, z)
    outward = np.array([np.cos(beta), np.sin(beta)])
    arc = width if crown == 0 else 2 * crown * np.arcsin(width / 2 / crown)
    for name, side in zip(FLANKS, (-1, 1), strict=True):
        nodes = mesh.points[np.unique(mesh.facets[name])] * [1, side, 1]
        assert_allclose((nodes[:, 0].min(), nodes[:, 0].max()), np.array([-0.5, 0.5]) * p["l_root"])
        if crown:
            centre = middle - np.sqrt(crown**2 - width**2 / 4) * outward
            assert_allclose(np.linalg.norm(nodes[:, 1:] - centre, axis=1), crown, rtol=1e-6)
        else:
            assert_allclose((nodes[:, 1:] - middle) @ outward, 0.0, atol=1e-9)
        assert areas(mesh)[name] == pytest.approx(arc * p["l_root"], rel=2e-3)


@pytest.mark.parametrize(("stagger", "twist"), [(20.0, 30.0), (10.0, -25.0)])
def test_the_tip_is_turned_by_stagger_and_twist(stagger, twist):
    p = {"stagger": stagger, "twist": twist, "camber": 0.0}
    mesh = read_mesh(GEOMETRY, parameters=COARSE | p)
    tip = mesh.points[mesh.points[:, 2] > 0.12 - 1e-9, :2]
    angle = np.radians(stagger + twist)
    along, across = tip @ [np.cos(angle), np.sin(angle)], tip @ [-np.sin(angle), np.cos(angle)]
    assert_allclose((along.min(), along.max()), (-0.020, 0.020), rtol=1e-6)
    assert_allclose(np.abs(across).max(), 0.0012, rtol=0.05)


def test_mass_is_that_of_profiles_platform_and_dovetail(blade):
    """Fillets add above the flanks what they take below; a crown adds a segment of its circle."""
    model, _, crown = blade
    z, w = (leggauss(5)[0] + 1) / 2, leggauss(5)[1] / 2
    chord, thick, edge = 0.045 - 0.005 * z, 0.0045 - 0.0021 * z, 0.001
    airfoil = 0.120 * w @ (chord * (edge + 2 / 3 * (thick - edge)))
    beta = np.radians(50)
    dovetail = 0.012 * 0.004 + 0.024 * 0.004 + 0.018 * 0.006 / np.tan(beta)
    if crown:
        angle = 2 * np.arcsin((0.006 / np.sin(beta) - 0.003 * np.tan(beta / 2)) / 2 / crown)
        dovetail += crown**2 * (angle - np.sin(angle))
    volume = airfoil + 0.052 * 0.032 * 0.005 + 0.044 * dovetail
    assert model.mass() == pytest.approx(volume * TITANIUM.rho, rel=2e-4)


def cantilever(span=0.12, stagger=20.0, twist=30.0, n=30):
    """First bending frequencies [Hz] of the airfoil as a twisted, tapered Euler-Bernoulli beam."""
    h, (u, wu), (x4, w4) = span / n, leggauss(20), leggauss(4)
    K, M = np.zeros((2, 4 * n + 4, 4 * n + 4))
    for e in range(n):
        for x, w in zip((x4 + 1) / 2, w4 * h / 2, strict=True):
            r = (e + x) / n
            c, f = 0.045 - 0.005 * r, (0.045 - 0.005 * r) / 4 * np.tan(np.radians(15 - 7.5 * r))
            half = 0.0005 + (0.0035 - 0.0021 * r) / 2 * (1 - u**2)
            dA, mean = wu * c * half, f * (2 / 3 - u**2)
            mean = mean - dA @ mean / dA.sum()
            flap, edge = dA @ (half**2 / 3 + mean**2), dA @ (u * c / 2) ** 2
            angle = np.radians(stagger + twist * r)
            along = np.array([np.cos(angle), np.sin(angle)])
            across = np.array([-np.sin(angle), np.cos(angle)])
            EI = TITANIUM.E * (edge * np.outer(along, along) + flap * np.outer(across, across))
            N = [1 - 3 * x**2 + 2 * x**3, h * (x - 2 * x**2 + x**3), 3 * x**2 - 2 * x**3,
                 h * (x**3 - x**2)]  # fmt: skip
            B = np.array([12 * x - 6, h * (6 * x - 4), 6 - 12 * x, h * (6 * x - 2)]) / h**2
            s = slice(4 * e, 4 * e + 8)
            K[s, s] += w * np.kron(np.outer(B, B), EI)
            M[s, s] += w * TITANIUM.rho * dA.sum() * np.kron(np.outer(N, N), np.eye(2))
    return np.sqrt(eigh(K[4:, 4:], M[4:, 4:], eigvals_only=True)[:2]) / (2 * np.pi)


def test_the_held_blade_bends_like_a_twisted_beam():
    """Below it, for root and platform give way and the beam does not shear; torsion is no beam."""
    for stagger, twist in ((20.0, 30.0), (20.0, 0.0)):
        turned = COARSE | {"stagger": stagger, "twist": twist}
        model = rom.fe.model(GEOMETRY, material=TITANIUM, parameters=turned)
        f = rom.modes(model, 2, fixed=FLANKS).frequencies
        beam = cantilever(stagger=stagger, twist=twist)
        assert 150 < f[0] < 600
        assert 0.94 * beam[0] < f[0] < beam[0]
        assert 0.88 * beam[1] < f[1] < beam[1]


def test_a_tenth_of_the_dofs_gives_ten_modes(blade):
    """From above and nested: frequencies fall with the order, towards those of finite elements."""
    model, exact, crown = blade
    orders = (1, 2) if crown else (1, 2, 3, 4)
    ends = [dict.fromkeys(FLANKS, f"polynomial:{p}") for p in orders]
    bodies = [reduced(30, model, interfaces=kinds) for kinds in ends]
    f = np.array([seated(body) for body in bodies])
    assert np.all(np.diff(f, axis=0) <= 1e-9 * f[1:])
    assert np.all(f >= exact * (1 - 1e-8))
    error = np.abs(f / exact - 1).max(axis=1)
    assert error[0] > 1e-2  # the bed is soft enough to tell
    assert error[-1] < (1e-3 if crown else 5e-4)
    # a crown costs the functions of a quadric
    ranks = [{len(body.marker(name).hold) // 3 for name in FLANKS} for body in bodies]
    assert ranks == ([{4}, {9}] if crown else [{3}, {6}, {10}, {15}])
    columns = sum(len(bodies[-1].marker(name).hold) for name in FLANKS)
    assert columns < 0.1 * sum(model.interfaces[name].dofs.size for name in FLANKS)
    free = rom.modes(model, 12).frequencies[6:]
    assert_allclose(bodies[1].frequencies(12)[6:], free, rtol=1e-3)
    assert np.all(bodies[1].frequencies(12)[6:] > free * (1 - 1e-9))


@pytest.fixture(scope="module")
def compared(tmp_path_factory):
    """What `demo_compressor_blade.py` has found on a blade of 1872 dofs, 186 of them on flanks."""
    coarse = ("--lc", "0.014", "--lc-flank", "0.005", "--degree", "1")
    out, demo = tmp_path_factory.mktemp("blade"), ROOT / "demos" / "demo_compressor_blade.py"
    with pytest.MonkeyPatch.context() as patch, pytest.warns(RomWarning, match="linear tetra"):
        patch.setattr(sys, "argv", [str(demo), "--quiet", "--out", str(out), *coarse])
        return runpy.run_path(str(demo), run_name="__main__")


@pytest.fixture(scope="module")
def dense(compared):
    """Of the same blade, by dense matrices: those on the bed and of the flanks, and all modes."""
    model, n = compared["alone"], compared["alone"].n_dofs
    K, K_bed, M = (A.toarray() for A in (model.K, compared["K_bed"], model.M))
    b = np.concatenate([model.interfaces[name].dofs for name in FLANKS])
    i = np.setdiff1d(np.arange(n), b)
    Psi = np.zeros((n, b.size))
    Psi[b] = np.eye(b.size)
    Psi[i] = -np.linalg.solve(K[np.ix_(i, i)], K[np.ix_(i, b)])
    Phi = np.zeros((n, 60))
    Phi[i] = eigh(K[np.ix_(i, i)], M[np.ix_(i, i)], subset_by_index=(0, 59))[1]
    exact = eigh(K_bed, M, eigvals_only=True, subset_by_index=(0, 9))
    return K, K_bed, M, Psi, Phi, b, exact


def worst_seated(dense, W):
    """Worst error of ten frequencies on the bed where the flanks follow the columns of W."""
    _, K_bed, M, Psi, Phi, _, exact = dense
    T = np.hstack([Psi @ W, Phi])
    lam = eigh(T.T @ K_bed @ T, T.T @ M @ T, eigvals_only=True)[:10]
    return np.abs(np.sqrt(lam / exact) - 1).max()


def test_polynomials_of_the_comparison_are_those_of_dense_matrices(compared, dense):
    for order in (1, 3):
        found = [interface_functions(Polynomial(order), compared["alone"].interfaces[name])
                 for name in FLANKS]  # fmt: skip
        W = block_diag(*(np.kron(Q, np.eye(3)) for Q in found))
        row = compared["table"][f"polynomial:{order}"]
        assert row["coordinates"] == row["solutions"] == W.shape[1]
        assert row["seated"] == pytest.approx(worst_seated(dense, W), rel=1e-5)


@pytest.mark.parametrize("n", [12, 24, 60])
@pytest.mark.parametrize("level", ["system", "local", "alone"])
def test_characteristic_modes_compared_are_those_of_dense_matrices(compared, dense, level, n):
    """Condensed to the flanks by hand; the rigid motions beside them, as in the demo."""
    K, K_bed, M, Psi, _, b, _ = dense
    K_b, M_b = (Psi.T @ A @ Psi for A in (K if level == "alone" else K_bed, M))
    if level == "local":
        half, m = np.split(np.arange(b.size), 2), (n - 6) // 2
        chi = block_diag(*(eigh(K_b[np.ix_(d, d)], M_b[np.ix_(d, d)])[1][:, :m] for d in half))
    else:
        first = 6 if level == "alone" else 0
        chi = eigh(K_b, M_b)[1][:, first : first + n - 6]
    rigid = rom.eigen.rigid_motions(compared["alone"].points)[b]
    row = compared["table"][f"characteristic, {level} {n}"]
    assert (row["coordinates"], row["solutions"]) == (n, b.size)
    assert row["seated"] == pytest.approx(worst_seated(dense, np.hstack([rigid, chi])), rel=1e-4)


def test_the_comparison_puts_the_kinds_of_flanks_in_their_order(compared):
    """What knows more of blade and bed needs fewer functions; polynomials need fewest solutions."""
    table = {label: row["seated"] for label, row in compared["table"].items()}
    assert table["all dofs"] <= min(table.values()) * (1 + 1e-9)
    for kind in ("polynomial:{}", "Fourier-Legendre {0} {0}"):
        few, many = table[kind.format(1)], table[kind.format(4)]
        assert table["all dofs"] < many < few < table["rbe2"]
    for n in (24, 60):
        by_level = {level: f"characteristic, {level} {n}" for level in ("system", "local", "alone")}
        system, local, alone = (table[name] for name in by_level.values())
        assert system < table[f"snapshots {n}"] < local < alone
    lost = {label: row["lost"] for label, row in compared["table"].items()}
    assert lost["polynomial:4"] < lost["polynomial:2"] < lost["polynomial:1"] < lost["rbe2"]
    taken = compared["table"]
    assert taken["polynomial:3"]["solutions"] < taken["snapshots 60"]["solutions"] < 186
    assert taken["polynomial:3"]["MB"] < taken["all dofs"]["MB"]
