"""Curved cells: mass, frequencies, interfaces and pictures of round bodies against closed forms."""

from functools import cache

import numpy as np
import pytest
from numpy.polynomial import Legendre, Polynomial
from numpy.polynomial.legendre import leggauss
from numpy.testing import assert_allclose, assert_array_equal

import rom
from cases.files.cells import second_order, solid
from cases.long import few
from cases.paths import RANKS, ROOT
from cases.ranks.environment import written_on_each
from cases.refusals import refuses
from cases.solid import STEEL
from rom import rotation
from rom.eigen.verbs import rigid_motions
from rom.errors import MeshError

pytest.importorskip("dolfinx", reason="dolfinx is not installed")
pytestmark = [pytest.mark.fenicsx, pytest.mark.filterwarnings("ignore:linear tetrahedra")]

from rom.fe.elasticity import assemble, model  # noqa: E402
from rom.fe.forms import region  # noqa: E402
from rom.fe.mesh.input_deck import input_deck  # noqa: E402
from rom.fe.mesh.quality import cell_volumes  # noqa: E402
from rom.fe.mesh.read import read_mesh, to_dolfinx  # noqa: E402

HEAD = """
SetFactory("OpenCASCADE");
DefineConstant[ lc = {0.01, Name "lc"} ];
Mesh.MeshSizeMin = lc; Mesh.MeshSizeMax = lc;
"""
PLATE = """
Box(1) = {-0.03, -0.025, 0, 0.08, 0.05, 0.016};
Cylinder(2) = {0, 0, -0.01, 0, 0, 0.03, 0.02};
BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
Physical Surface("bore") = Surface In BoundingBox{-0.021, -0.021, -1, 0.021, 0.021, 1};
Physical Surface("end") = Surface In BoundingBox{0.049, -1, -1, 0.051, 1, 1};
Physical Volume("body") = {3};
"""
TUBE = """
DefineConstant[ L = {0.1, Name "L"} ];
Cylinder(1) = {0, 0, 0, 0, 0, L, 0.04};
Cylinder(2) = {0, 0, -0.1, 0, 0, 1, 0.02};
BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
Physical Volume("body") = {3};
"""
ROD = 'Cylinder(1) = {0, 0, 0, 0, 0, 0.1, 0.01}; Physical Volume("body") = {1};\n'
BALL = 'Sphere(1) = {0, 0, 0, 0.02}; Physical Volume("body") = {1};\n'


def written(folder, text):
    path = folder / "body.geo"
    path.write_text(HEAD + text)
    return path


def round_bore(n, radius=0.02):
    """Element size with n edges round a bore."""
    return {"lc": 2 * np.pi * radius / n}


def cylinder(r, h):
    volume = np.pi * r * r * h
    across = volume * (3 * r * r + h * h) / 12
    return volume, np.array([across, across, volume * r * r / 2])


def plate_with_a_bore():
    """Volume, and moments of inertia over the density about the mass centre."""
    (v, i), V = cylinder(0.02, 0.016), 0.08 * 0.05 * 0.016
    I = V / 12 * np.array([0.05**2 + 0.016**2, 0.08**2 + 0.016**2, 0.08**2 + 0.05**2])
    centre = V * 0.01 / (V - v)  # the box stands 10 mm from the bore
    shift = V * 0.01**2 - (V - v) * centre**2
    return V - v, I - i + shift * np.array([0, 1, 1])


def tube(L):
    (V, I), (v, i) = cylinder(0.04, L), cylinder(0.02, L)
    return V - v, I - i


def ball(r):
    volume = 4 / 3 * np.pi * r**3
    return volume, np.full(3, 0.4 * volume * r * r)


@pytest.mark.parametrize(
    ("text", "more", "exact", "limit"),
    few(1, [(PLATE, {}, plate_with_a_bore(), 1e-5), (TUBE, {"L": 0.02}, tube(0.02), 1e-5),
            (BALL, {}, ball(0.02), 2e-4)]),
    ids=["plate with a bore", "hollow cylinder", "sphere"],
)  # fmt: skip
def test_mass_and_inertia_of_round_bodies_are_of_order_four(tmp_path, text, more, exact, limit):
    """12, 16 and 24 edges round the bore or the equator; the limit is for the last."""
    path, counts, errors = written(tmp_path, text), (12, 16, 24), []
    for n in counts:
        made = model(path, material=STEEL, parameters=more | round_bore(n))
        found = rom.mass_properties(made)
        inertia = found.inertia / STEEL.rho
        errors.append([found.mass / (STEEL.rho * exact[0]) - 1,
                       np.abs(np.diag(inertia) / exact[1] - 1).max()])  # fmt: skip
        off = np.abs(inertia - np.diag(np.diag(inertia))).max()
        assert n < 24 or off < limit * exact[1].max()
    errors = np.abs(errors)
    assert errors[-1].max() < limit, errors
    orders = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert orders.min() > 3.5 and orders.max() < 5, orders


@pytest.mark.parametrize(("n", "limit"), [(12, 0.1), (24, 0.03)])
def test_a_sphere_errs_by_what_its_triangles_leave_out(tmp_path, n, limit):
    """With edges L on the unit sphere the volume is 11 L^4 / 640 too small, see curved_cells.md."""
    mesh = read_mesh(written(tmp_path, BALL + 'Physical Surface("skin") = Surface{:};\n'),
                     parameters=round_bore(n))  # fmt: skip
    corners = mesh.points[mesh.facets["skin"][:, :3]] / 0.02
    lengths = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    error = cell_volumes(mesh).sum() / ball(0.02)[0] - 1
    assert error == pytest.approx(-11 / 640 * (lengths**4).mean(), rel=limit)


def harmonic(a, b, L, n, N):
    """Free frequencies [Hz] of a hollow or solid cylinder with n waves around, by Ritz."""
    # (f(r) cos, g(r) sin, h(r) cos)(n theta) times Legendre along the axis; degree N, smooth at 0
    x, w = leggauss(2 * N)
    r, z = (a + b) / 2 + (b - a) / 2 * x, x
    columns = []
    for Z in (Legendre.basis(k) for k in range(N + 1)):
        along, slope = Z(z), Z.deriv()(z) * 2 / L
        for f, g, h in radial(a, b, n, N):
            terms = [(f.deriv()(r), along), ((f(r) + n * g(r)) / r, along), (h(r), slope),
                     (g(r), slope), (-n * h(r) / r, along), (f(r), slope), (h.deriv()(r), along),
                     (g.deriv()(r) - (g(r) + n * f(r)) / r, along),
                     (f(r), along), (g(r), along), (h(r), along)]  # fmt: skip
            e = [np.outer(*term).ravel() for term in terms]
            columns.append([*e[:3], e[3] + e[4], e[5] + e[6], *e[7:]])
    weights = np.outer(w * r, w).ravel()
    B, U = np.array(columns)[:, :6], np.array(columns)[:, 6:]
    K = np.einsum("aig,ij,bjg,g->ab", B, STEEL.stiffness, B, weights, optimize=True)
    M = np.einsum("aig,big,g->ab", U, STEEL.rho * U, weights, optimize=True)
    scale = np.diag(M) ** -0.5
    lam, V = np.linalg.eigh(M * scale * scale[:, None])
    V = scale[:, None] * (V / np.sqrt(np.abs(lam)))[:, lam > 1e-13 * lam[-1]]
    return np.sqrt(np.abs(np.linalg.eigvalsh(V.T @ K @ V))) / (2 * np.pi)


def radial(a, b, n, N):
    """Radial functions of the three displacements."""
    zero, power = Polynomial([0.0]), [Polynomial([0.0] * k + [b**-k]) for k in range(n + N + 3)]
    if a > 0:
        every = [Legendre.basis(k, domain=(a, b)) for k in range(N + 1)]
        return [row for f in every for row in ((f, zero, zero), (zero, f, zero), (zero, zero, f))]
    if n == 0:
        pieces = ((power[2 * k + 1], power[2 * k]) for k in range(N // 2 + 1))
        return [row for f, h in pieces
                for row in ((f, zero, zero), (zero, f, zero), (zero, zero, h))]  # fmt: skip
    rows = []
    for k in range(n, n + N + 1, 2):
        f, g, h = power[k - 1], power[k + 1], power[k]
        rows += [(f, -f, zero), (g, g, zero), (zero, zero, h)]
    return rows


@cache
def spectrum(a, b, L, m, N=10):
    """First m elastic frequencies of a free cylinder, pairs twice."""
    found = [np.repeat(f[f > 1.0], 1 if n == 0 else 2)
             for n in range(6) for f in [harmonic(a, b, L, n, N)]]  # fmt: skip
    return np.sort(np.concatenate(found))[:m]


def errors(path, exact, **options):
    made = model(path, material=STEEL, **options)
    return rom.modes(made, 6 + len(exact)).frequencies[6:] / exact - 1


@pytest.mark.long
def test_reference_frequencies_of_cylinders_agree_with_closed_forms():
    """Torsion sqrt(G / rho) / 2L exactly, whatever the bore; bending by more functions."""
    torsion = np.sqrt(STEEL.stiffness[3, 3] / STEEL.rho) / (2 * 0.1)
    for a, b in ((0.0, 0.01), (0.02, 0.04)):
        found = spectrum(a, b, 0.1, 8)
        assert np.abs(found / torsion - 1).min() < 1e-9
        assert_allclose(spectrum(a, b, 0.1, 6, N=8), found[:6], rtol=2e-4)


@pytest.mark.long
def test_a_round_rod_bends_and_twists_as_it_should(tmp_path):
    """Chords of 12 edges make it thinner and 1.5 % slow in bending; curved edges 80 times less."""
    path, exact = written(tmp_path, ROD), spectrum(0.0, 0.01, 0.1, 6)
    size = round_bore(12, 0.01)
    straight, curved = (errors(path, exact, parameters=size, order=k) for k in (1, 2))
    assert np.all(straight[:2] < -0.012) and np.all(np.abs(curved[:2]) < 4e-4)  # bending
    assert np.abs(curved).max() < 1e-3 < 0.012 < np.abs(straight).max()
    assert_array_equal(errors(path, exact, parameters=size), curved)  # by default


def test_more_quadrature_would_change_nothing(tmp_path, monkeypatch):
    """The mass is exact on the quadratic geometry, the stiffness far better than the mesh."""
    path, size = written(tmp_path, ROD), round_bore(8, 0.01)
    made = model(path, material=STEEL, parameters=size)
    for name in ("degree_of_slopes", "_mass_degree"):
        monkeypatch.setattr(region, name, lambda *_: 12)
    fine = model(path, material=STEEL, parameters=size)
    assert abs(made.M - fine.M).max() < 1e-12 * abs(fine.M).max()
    assert 1e-12 * abs(fine.K).max() < abs(made.K - fine.K).max()  # it was another quadrature
    found, better = (rom.modes(m, 14).frequencies[6:] for m in (made, fine))
    assert_allclose(found, better, rtol=5e-5)


@pytest.mark.long
def test_a_tube_ovalises_and_twists_as_it_should(tmp_path):
    """A thick tube of 12 edges round the bore; conforming elements on the true shape are stiff."""
    path, exact = written(tmp_path, TUBE), spectrum(0.02, 0.04, 0.1, 12)
    size = round_bore(12)
    straight, curved = (errors(path, exact, parameters=size, order=k) for k in (1, 2))
    assert np.abs(curved).max() < 0.5 * np.abs(straight).max()
    assert np.all(curved > -1e-5) and curved.max() < 0.015


def test_cells_are_curved_where_the_body_is(tmp_path):
    """By default; a box keeps the very matrices of its straight cells."""
    path = written(tmp_path, PLATE)
    curved = model(path, material=STEEL, parameters=round_bore(12))
    assert curved.provenance["degree of the geometry"] == 2
    assert curved.provenance["curved cells"] > 0 == curved.provenance["straightened cells"]
    for options in ({"order": 1}, {"degree": 1}):
        assert model(path, material=STEEL, **options).provenance["degree of the geometry"] == 1
    beam = ROOT / "meshes" / "beam.geo"
    default, straight = (model(beam, material=STEEL, order=k) for k in (None, 1))
    assert (default.K != straight.K).nnz == 0 and (default.M != straight.M).nnz == 0


def test_displacements_of_degree_one_need_straight_edges(tmp_path):
    """On curved cells they would strain in a rotation; of nodes in the middle nothing is lost."""
    with pytest.raises(MeshError, match="curved edges of degree 2"):
        model(written(tmp_path, PLATE), material=STEEL, degree=1, order=2)
    from mpi4py import MPI

    mesh, _, _ = to_dolfinx(second_order(solid()), MPI.COMM_SELF)
    refuses(MeshError, "straight edges", assemble, mesh, material=STEEL, degree=1)


@pytest.mark.parametrize("degree", few(1, [2, 3]))
def test_linear_fields_are_exact_on_curved_cells(tmp_path, degree):
    """Stress 3 K e of a dilatation e, and A x gets 3 K e |skew A|^2 V; turns need no force."""
    file = written(tmp_path, PLATE)
    made = model(file, material=STEEL, degree=degree, parameters=round_bore(8))
    x, volume = made.points, made.mass() / STEEL.rho
    assert_allclose(volume, plate_with_a_bore()[0], rtol=1e-3)
    R = rigid_motions(x)
    assert np.abs(made.K @ R).max() < 1e-10 * abs(made.K).max()
    e, bulk = 1e-4, STEEL.E / (3 * (1 - 2 * STEEL.nu))
    u = (e * x).ravel()
    nodes = made.surface.nodes[::7]
    stress = made.stresses.at_nodes(u[:, None], nodes)[:, :, 0]
    assert_allclose(stress, 3 * bulk * e * np.array([1, 1, 1, 0, 0, 0]) * np.ones((len(nodes), 1)),
                    atol=1e-8 * bulk * e)  # fmt: skip
    A = np.array([[0.3, -1.0, 0.2], [0.5, 0.1, 0.7], [-0.4, 0.9, 0.6]])
    shape = (x @ A.T).reshape(-1, 1)
    exact = 3 * bulk * e * (0.25 * (A - A.T) ** 2).sum() * volume
    rtol = {2: 1e-9, 3: 1e-7}[degree]  # the tables of ffcx round near whole numbers
    assert_allclose(made.stresses.geometric_stiffness(u[:, None], shape), exact, rtol=rtol)
    assert_allclose(shape.T @ (made.stresses.prestress(u) @ shape), exact, rtol=rtol)
    finite = made.stresses.finite_strain()
    assert_allclose(shape.T @ (finite.geometric(u) @ shape), exact, rtol=rtol)
    turned = rotation.matrix(rotation.exp([0.3, -0.5, 0.8]))
    force = finite.force((x @ turned.T - x).ravel())
    assert np.abs(force).max() < 1e-10 * STEEL.E * volume ** (2 / 3)


def test_a_bore_is_an_interface_of_its_true_area(tmp_path):
    """2 pi R L with an error of fourth order, and its origin on the axis."""
    path, exact = written(tmp_path, PLATE), 2 * np.pi * 0.02 * 0.016
    found = [model(path, material=STEEL, parameters=round_bore(n)).interfaces["bore"]
             for n in (12, 24)]  # fmt: skip
    errors = np.abs([face.surface_mass.sum() / exact - 1 for face in found])
    assert errors[1] < 5e-6 and errors[0] / errors[1] > 10, errors
    assert_allclose(found[1].origin, [0, 0, 0.008], atol=1e-7)
    assert_allclose(np.hypot(*found[1].points[:, :2].T), 0.02, rtol=1e-9)


@pytest.mark.parametrize("kind", few(1, ["rbe2", "rbe3", "polynomial:2", "full"]))
def test_bodies_are_reduced_to_curved_interfaces(tmp_path, kind):
    made = model(written(tmp_path, PLATE), material=STEEL, parameters=round_bore(10))
    body = rom.reduce(made, method=rom.CraigBampton(40), interfaces={"bore": kind, "end": "rbe3"},
                      reference="bore" if kind != "full" else "mean-axis", stress=True,
                      stiffening=kind == "rbe2")  # fmt: skip
    named = ("static flexibility", "rigid motions", "mass", "never below")
    rows = [row for row in body.certificate.rows if any(n in row.quantity for n in named)]
    assert len(rows) > 5 and all(row.ok for row in rows), body.certificate
    assert next(r.value for r in body.certificate.rows if "free: worst error" in r.quantity) < 5e-3
    assert_allclose(body.mass, STEEL.rho * plate_with_a_bore()[0], rtol=2e-4)


def test_pictures_of_a_bore_are_round(tmp_path):
    """The triangles pass through the nodes amid the edges: a closed surface nearer to the body."""
    path = written(tmp_path, PLATE)
    defects = []
    for order in (1, 2):
        made = model(path, material=STEEL, parameters=round_bore(12), order=order)
        p = made.points[made.surface.nodes][made.surface.triangles]
        area = 0.5 * np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
        assert_allclose(area.sum(axis=0), 0, atol=1e-12)
        enclosed = np.einsum("ij,ij->", p.mean(axis=1), area) / 3
        defects.append(enclosed / plate_with_a_bore()[0] - 1)
    assert 3.5 < defects[0] / defects[1] < 4.5, defects


def test_second_order_meshes_come_back_from_decks_as_curved_or_straight_as_they_were(tmp_path):
    mesh = read_mesh(written(tmp_path, PLATE), parameters=round_bore(12))
    (tmp_path / "body.inp").write_text(input_deck(mesh))
    back = read_mesh(tmp_path / "body.inp")
    assert back.cell_type == "tet10"
    assert_allclose(cell_volumes(back), cell_volumes(mesh), rtol=1e-9)
    made = model(tmp_path / "body.inp", material=STEEL)
    assert made.provenance["degree of the geometry"] == 2
    assert_allclose(made.mass(), STEEL.rho * plate_with_a_bore()[0], rtol=1e-4)
    # nodes amid straight edges say nothing; elements of degree 1 can do without them
    box, fine = solid("tet4"), tmp_path / "box.inp"
    fine.write_text(input_deck(second_order(box)))
    made = {k: model(fine, material=STEEL, degree=k) for k in (1, 2)}
    assert {m.provenance["degree of the geometry"] for m in made.values()} == {1}
    assert made[1].n_dofs == 3 * len(box.points)


@pytest.mark.long
def test_curved_models_are_the_same_on_any_number_of_ranks(tmp_path):
    words, more = (RANKS / "curved_under_mpi.py", written(tmp_path, PLATE)), {"ending": "json"}
    found = written_on_each((1, 2, 3), tmp_path, *words, timeout=300, **more)
    for n in (2, 3):
        assert set(found[n]) == set(found[1])
        for name, values in found[1].items():
            assert_allclose(found[n][name], values, rtol=1e-8, err_msg=f"{name}, {n} ranks")
    assert_allclose(found[1]["mass"], STEEL.rho * plate_with_a_bore()[0], rtol=1e-4)
