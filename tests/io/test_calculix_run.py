"""The same mesh in CalculiX and here: stiffness, mass, frequencies and condensed stiffness.

Stiffness agrees to round-off. CalculiX takes the mass with the Gauss points of the stiffness (one
for C3D4, four for C3D10), which are exact for polynomials of degree 1 and 2 instead of 2 and 4:
with that quadrature the mass agrees to round-off too, and with ours frequencies differ.
"""

import json
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial import cKDTree

import rom
from cases.files.cells import solid
from cases.long import few
from cases.paths import ROOT
from rom.cli.main import main
from rom.errors import ConfigError, InterfaceError, MeshError, TagError
from rom.fe.mesh.input_deck import input_deck
from rom.fe.mesh.read import read_mesh
from rom.io.matrices.matrix_files import read_matrix
from rom.io.programs.interface_form import interface_form

BEAM = {"path": str(ROOT / "meshes" / "beam.geo"), "parameters": {"L": 0.3, "lc": 0.04}}
STEEL = rom.Material(E=210e9, nu=0.3, rho=7850.0)
WOOD = rom.Orthotropic(
    E=(12e9, 0.9e9, 0.5e9), nu=(0.35, 0.4, 0.3), G=(0.8e9, 0.7e9, 0.1e9), rho=500.0,
    axes=((0.6, 0.8, 0.0), (-0.8, 0.6, 0.0), (0.0, 0.0, 1.0)),
)  # fmt: skip
GAUSS = {1: 1, 2: 2}  # degree of the displacement: what CalculiX's points of the mass are exact for
needs_ccx = pytest.mark.skipif(
    shutil.which("ccx") is None, reason="CalculiX (ccx, Debian's calculix-ccx) is not installed"
)


def run(folder, deck):
    (folder / "job.inp").write_text(deck)
    done = subprocess.run(["ccx", "job"], cwd=folder, capture_output=True, text=True, timeout=600,
                          check=False)  # fmt: skip
    assert done.returncode == 0 and "*WARNING" not in done.stdout, done.stdout[-2000:]
    return (folder / "job.dat").read_text()


def frequencies(text):
    """(m,) the fourth column of the table [Hz], seven digits."""
    rows = [line.split() for line in text.partition("P A R T I C I P")[0].splitlines()]
    return np.array([float(row[3]) for row in rows if len(row) == 5 and row[0].isdecimal()])


def total_force(text):
    """(steps, 3) sums of the reactions [N]."""
    lines = text.splitlines()
    return np.array([lines[k + 2].split() for k, x in enumerate(lines) if "total force" in x],
                    dtype=float)  # fmt: skip


@pytest.fixture(scope="module")
def beam():
    return read_mesh(**BEAM)


@pytest.fixture
def same_quadrature(monkeypatch):
    """Assembly here takes the mass as CalculiX does."""
    from rom.fe.forms import region

    monkeypatch.setattr(region, "_mass_degree", lambda _mesh, degree: GAUSS[degree])


def model(degree, material=STEEL):
    return rom.fe.model(BEAM["path"], parameters=BEAM["parameters"], material=material,
                        degree=degree)  # fmt: skip


def order(theirs, ours):
    """(n,) dofs of a model in the order of another one with the same nodes."""
    apart, node = cKDTree(ours.points).query(theirs.points)
    assert apart.max() < 1e-13 and len(set(node)) == len(node)
    return (3 * node[:, None] + np.arange(3)).ravel()


def difference(A, B):
    return abs(A - B).max() / abs(B).max()


@needs_ccx
@pytest.mark.fenicsx
@pytest.mark.filterwarnings("ignore:.*linear tetrahedra lock")
@pytest.mark.parametrize(("degree", "material"), few(1, [(2, WOOD), (1, STEEL), (2, STEEL)]))
def test_stiffness_and_mass_are_equal(beam, degree, material, same_quadrature, tmp_path):
    run(tmp_path, input_deck(beam, material=material, degree=degree, step="matrices"))
    theirs = rom.read_model(tmp_path / "job.sti", tmp_path / "job.mas", nodes=tmp_path / "job.inp",
                            interfaces=["root", "tip"])  # fmt: skip
    ours = model(degree, material)
    p = order(theirs, ours)
    assert difference(theirs.K, ours.K[p][:, p]) < 1e-12
    assert difference(theirs.M, ours.M[p][:, p]) < 1e-12
    for name, interface in theirs.interfaces.items():
        assert_allclose(interface.points, ours.interfaces[name].points, atol=1e-14)


@needs_ccx
@pytest.mark.fenicsx
@pytest.mark.filterwarnings("ignore:.*linear tetrahedra lock")
@pytest.mark.parametrize("fixed", [(), ("root",)])
@pytest.mark.parametrize(("degree", "apart"), few(1, [(2, 2e-3), (1, 0.15)]))
def test_ten_frequencies_are_equal(beam, degree, apart, fixed, same_quadrature, tmp_path):
    """To the seven digits printed; exact mass moves them by less than `apart`, never up."""
    n_rigid = 0 if fixed else 6
    deck = input_deck(beam, material=STEEL, degree=degree, fixed=fixed, n_modes=n_rigid + 10)
    theirs = frequencies(run(tmp_path, deck))[n_rigid:]
    assert theirs.size == 10
    ours = rom.modes(model(degree), n_rigid + 10, fixed=fixed).frequencies[n_rigid:]
    assert_allclose(ours, theirs, rtol=1e-6)
    with pytest.MonkeyPatch.context() as patch:
        from rom.fe.forms import region

        patch.setattr(region, "_mass_degree", lambda *_: 2 * degree)
        exact = rom.modes(model(degree), n_rigid + 10, fixed=fixed).frequencies[n_rigid:]
    assert (exact < theirs).all() and 1e-5 < (theirs / exact - 1).max() < apart


@needs_ccx
@pytest.mark.fenicsx
def test_a_body_of_their_matrices_is_a_body_of_ours(beam, same_quadrature, tmp_path):
    run(tmp_path, input_deck(beam, material=STEEL, step="matrices"))
    theirs = rom.read_model(tmp_path / "job.sti", tmp_path / "job.mas", nodes=tmp_path / "job.inp",
                            interfaces=["root", "tip"])  # fmt: skip
    kinds = {"root": "rbe2", "tip": "rbe2"}
    bodies = [rom.reduce(m, method=rom.CraigBampton(6), interfaces=kinds, certify=m is theirs)
              for m in (theirs, model(2))]  # fmt: skip
    assert all(
        row.ok for row in bodies[0].certificate.rows if "reduced never below" in row.quantity
    )
    for fixed in ((), ("root",), ("root", "tip")):
        f, expected = (body.frequencies(6, fixed=fixed) for body in bodies)
        assert_allclose(f, expected, rtol=1e-9)
    assert_allclose(bodies[0].inertia, bodies[1].inertia, rtol=1e-9, atol=1e-12)


@needs_ccx
@pytest.mark.fenicsx
def test_guyan_stiffness_is_the_reaction_to_unit_motions(beam, tmp_path):
    """The tip moves as a rigid body by a unit along x, y, z; root held."""
    head, step = input_deck(beam, material=STEEL, fixed=("root",)).split("*STEP\n")
    assert step.startswith("*FREQUENCY")
    steps = [
        "*STEP\n*STATIC\n*BOUNDARY\n"
        + "".join(f"tip, {b + 1}, {b + 1}, {float(a == b)}\n" for b in range(3))
        + "*NODE PRINT, NSET=tip, TOTALS=ONLY\nRF\n*END STEP\n"
        for a in range(3)
    ]
    reactions = total_force(run(tmp_path, head + "".join(steps)))
    body = rom.reduce(model(2), method=rom.Guyan(), interfaces={"root": "rbe2", "tip": "rbe2"},
                      certify=False)  # fmt: skip
    expected = interface_form(body).K[6:9, 6:9]
    assert_allclose(reactions, expected, rtol=1e-6, atol=2e-6 * expected.max())


@needs_ccx
@pytest.mark.fenicsx
def test_a_substructure_is_not_condensed(beam, tmp_path):
    """CalculiX 2.20 writes rows and columns of the stiffness; a cure there will be seen here."""
    head = input_deck(beam, material=STEEL).split("*STEP\n")[0]
    corners = "*NSET, NSET=corners\n1, 2, 5, 6\n"
    step = ("*STEP\n*SUBSTRUCTURE GENERATE\n*RETAINED NODAL DOFS, SORTED=NO\ncorners, 1, 3\n"
            "*SUBSTRUCTURE MATRIX OUTPUT, STIFFNESS=YES, OUTPUT FILE=USER DEFINED, FILE NAME=part\n"
            "*END STEP\n")  # fmt: skip
    run(tmp_path, head + corners + step)
    found = read_matrix(tmp_path / "part.mtx")
    assert_array_equal(found.dofs[:, 0], np.repeat([1, 2, 5, 6], 3))
    ours = model(2)
    _, node = cKDTree(ours.points).query(beam.points[found.dofs[:, 0] - 1])
    rows = 3 * node + found.dofs[:, 1] - 1
    K_bb = ours.K[rows][:, rows].toarray()
    assert_allclose(found.A.toarray(), np.tril(K_bb), atol=1e-11 * np.abs(K_bb).max())


@needs_ccx
@pytest.mark.fenicsx
def test_the_command_line_goes_to_calculix_and_back(tmp_path, capsys, same_quadrature):
    """Mesh here, matrices there, frequencies here."""
    steel = ("--E", "210e9", "--nu", "0.3", "--rho", "7850")
    mesh = (BEAM["path"], "-p", "L=0.3", "-p", "lc=0.04", *steel)
    assert main(["mesh", *mesh, "--save", str(tmp_path / "job.inp")]) == 0
    run(tmp_path, (tmp_path / "job.inp").read_text())
    files = [str(tmp_path / f"job{ending}") for ending in (".sti", ".mas", ".inp")]
    theirs = [files[0], "--mass", files[1], "--nodes", files[2]]
    capsys.readouterr()
    found = []
    for words in (theirs, mesh):
        assert main(["modes", *words, "--fixed", "root", "-n", "5", "--json"]) == 0
        found.append(json.loads(capsys.readouterr().out)["frequencies"])
    assert_allclose(*found, rtol=1e-9)


@pytest.mark.parametrize("kind", ["tet4", "tet10"])
def test_a_deck_is_read_back(kind, tmp_path):
    """Curved edges, two regions, a facet that belongs to two interfaces."""
    mesh = solid(kind, (2, 1, 1))
    points = mesh.points + 0.02 * np.sin(3 * mesh.points[:, [1, 2, 0]])
    facets = mesh.facets | {"lower half": mesh.facets["root"][:1]}
    mesh = replace(mesh, points=points, regions=np.arange(len(mesh.cells)) // 6 + 1,
                   region_names={1: "left", 2: "right"}, facets=facets)  # fmt: skip
    with pytest.raises(TagError, match="'lower half' is no name"):
        input_deck(mesh)
    mesh.facets["lower_half"] = mesh.facets.pop("lower half")
    path = tmp_path / "box.inp"
    path.write_text(input_deck(mesh, degree=1 if kind == "tet4" else 2))
    assert max(len(word) for word in path.read_text().replace("\n", ",").split(",")) <= 40
    found = read_mesh(path)
    assert found.cell_type == kind and list(found.region_names.values()) == ["left", "right"]
    assert_allclose(found.points[found.cells], mesh.points[mesh.cells], atol=1e-12)
    assert_array_equal(found.regions, mesh.regions)
    for name, rows in mesh.facets.items():
        same = [np.sort(x.points[f], axis=1).sum(axis=1) for x, f in
                ((found, found.facets[name]), (mesh, rows))]  # fmt: skip
        assert_allclose(*(x[np.lexsort(x.T)] for x in same), atol=1e-12)


def test_mid_edge_nodes_are_added_and_numbers_fit():
    """CalculiX reads no number beyond 20 characters."""
    mesh = solid("tet4", (1, 1, 1), (-1e-17, 1.0, 1.0))
    text = input_deck(mesh)
    nodes = text.split("*NODE\n")[1].split("*")[0].splitlines()
    assert len(nodes) == 27  # 8 corners, 12 + 6 edges and diagonals, one across
    assert max(len(word) for line in nodes for word in line.split(", ")) == 20
    assert "C3D10" in text and "*MATERIAL" not in text and "*STEP" not in text


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"step": "static"}, ConfigError, "none of 'frequencies', 'matrices'"),
        ({"fixed": ["bore"]}, InterfaceError, r"'bore' cannot be held; .*\['root', 'tip'\]"),
        ({"degree": 3}, ConfigError, "degree = 3"),
    ],
)
def test_what_a_deck_cannot_say_is_named(options, error, message):
    with pytest.raises(error, match=message):
        input_deck(solid("tet4"), **options)


def test_meshes_without_a_deck_are_named():
    with pytest.raises(MeshError, match="hex8 have other shape functions"):
        input_deck(solid("hex8"))
    with pytest.raises(MeshError, match="curved edges"):
        input_deck(solid("tet10"), degree=1)
    mesh = solid("tet4")
    with pytest.raises(TagError, match="'TIP' names two sets"):
        input_deck(replace(mesh, facets=mesh.facets | {"TIP": mesh.facets["root"]}))
