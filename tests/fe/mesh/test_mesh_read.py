"""Reading and making meshes through gmsh: formats, names, parameters, provenance."""

import hashlib
import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cases.files.cells import blocks_of, solid, write_msh
from cases.measures import areas, volume
from cases.paths import ROOT
from cases.refusals import refused, refuses
from rom.errors import ConfigError, RomWarning
from rom.fe.mesh.quality import scaled_jacobian
from rom.fe.mesh.read import read_mesh
from rom.fe.mesh.sources.gmsh_session import session

gmsh = pytest.importorskip("gmsh", reason="gmsh is not installed")
pytestmark = pytest.mark.fenicsx
MESHES = ROOT / "meshes"
TWO_BODIES = """
SetFactory("OpenCASCADE");
Box(1) = {0, 0, 0, 1, 1, 1};
Box(2) = {1, 0, 0, 1, 1, 1};
Coherence;
Physical Volume("steel", 7) = {1};
Physical Volume("liner", 3) = {2};
Physical Surface("root", 11) = Surface In BoundingBox{-0.1, -0.1, -0.1, 0.1, 1.1, 1.1};
Physical Surface("skin", 12) = Surface In BoundingBox{-0.1, -0.1, -0.1, 2.1, 1.1, 0.1};
Physical Surface("both", 13) = {Surface In BoundingBox{-0.1, -0.1, -0.1, 0.1, 1.1, 1.1},
  Surface In BoundingBox{-0.1, -0.1, -0.1, 2.1, 1.1, 0.1}};
Mesh.MeshSizeMin = 0.5; Mesh.MeshSizeMax = 0.5;
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("meshes")
    (folder / "two.geo").write_text(TWO_BODIES)
    with session(gmsh):
        gmsh.open(str(folder / "two.geo"))
        gmsh.model.mesh.generate(3)
        for version in (2.2, 4.1):
            for binary in (0, 1):
                gmsh.option.setNumber("Mesh.MshFileVersion", version)
                gmsh.option.setNumber("Mesh.Binary", binary)
                gmsh.write(str(folder / f"{version}-{binary}.msh"))
        gmsh.clear()
        gmsh.model.occ.addBox(0, 0, 0, 100, 20, 10)  # STEP from here is in millimetres
        hole = gmsh.model.occ.addCylinder(50, 10, 0, 0, 0, 10, 4)
        gmsh.model.occ.cut([(3, 1)], [(3, hole)])
        gmsh.model.occ.synchronize()
        gmsh.write(str(folder / "plate.step"))
    return folder


def volumes(mesh):
    a, b, c, d = np.moveaxis(mesh.points[mesh.corners], 1, 0)
    volume = np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a)) / 6
    return {name: volume[mesh.regions == tag].sum() for tag, name in mesh.region_names.items()}


@pytest.mark.parametrize("name", ["two.geo", "2.2-0.msh", "2.2-1.msh", "4.1-0.msh", "4.1-1.msh"])
def test_every_version_gives_the_same_regions_and_overlapping_surfaces(folder, name):
    """dolfinx's own reader keeps one tag of a facet in two groups, in silence."""
    mesh = read_mesh(folder / name)
    assert mesh.region_names == {7: "steel", 3: "liner"}
    assert volumes(mesh) == pytest.approx({"steel": 1.0, "liner": 1.0}, rel=1e-12)
    assert areas(mesh) == pytest.approx({"root": 1.0, "skin": 2.0, "both": 3.0}, rel=1e-12)
    assert mesh.warnings == ()


def test_a_geometry_gives_the_same_mesh_whatever_the_user_has_set(folder, tmp_path, monkeypatch):
    """gmsh reads .gmshrc of the home folder unless told not to."""
    for name in (".gmshrc", ".gmsh-options"):
        (tmp_path / name).write_text("Mesh.MeshSizeFactor = 0.3;\n")
    first = read_mesh(folder / "two.geo")
    monkeypatch.setenv("HOME", str(tmp_path))
    second = read_mesh(folder / "two.geo")
    assert_array_equal(first.points, second.points)
    assert_array_equal(first.cells, second.cells)


def test_provenance_tells_file_parameters_and_version():
    path = MESHES / "beam.geo"
    mesh = read_mesh(path, parameters={"L": 0.5}, scale=0.1)
    assert mesh.provenance["sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()
    assert (mesh.provenance["path"], mesh.provenance["scale"]) == (str(path), 0.1)
    used = mesh.provenance["parameters"]
    assert (used["L"], used["h"]) == (0.5, 0.03)  # the second by default
    assert mesh.provenance["gmsh"].startswith("4.")
    assert np.ptp(mesh.points[:, 0]) == pytest.approx(0.05)


def test_order_two_puts_the_mid_side_nodes_on_the_curved_surface():
    """The middle of a straight edge lies up to 1 % of the radius inside the crank pin."""
    radius = 0.015
    straight = read_mesh(MESHES / "crank.geo")
    edges = straight.points[straight.facets["pin"][:, :2]].mean(axis=1)
    assert np.hypot(*(edges[:, :2] - (0.04, 0.0)).T).min() < 0.99 * radius
    curved = read_mesh(MESHES / "crank.geo", order=2)
    nodes = curved.points[np.unique(curved.facets["pin"])]
    assert curved.cell_type == "tet10"
    assert_allclose(np.hypot(*(nodes[:, :2] - (0.04, 0.0)).T), radius, rtol=1e-9)


@pytest.mark.parametrize("start", [1, 0, 10**6])
def test_node_numbers_with_gaps_give_the_same_mesh(tmp_path, start):
    """dolfinx takes the numbers for positions: wrong coordinates, or a crash."""
    mesh = solid()
    ids = start + 3 * np.arange(len(mesh.points)) + 7
    blocks, names = blocks_of(mesh)  # facets first: the cells start at 17
    found = read_mesh(write_msh(tmp_path / "gaps.msh", mesh.points, blocks[::-1], names, ids))
    assert found.cell_ids.min() == 17 and found.cell_ids.max() == 16 + len(mesh.cells)
    assert_allclose(found.points, mesh.points)
    assert_array_equal(found.cells, mesh.cells)
    assert_array_equal(found.facets["tip"], mesh.facets["tip"])


def test_bodies_without_a_name_and_curves_with_one_are_warned_of(tmp_path):
    mesh = solid()
    path = write_msh(tmp_path / "plain.msh", mesh.points, [("tet4", 0, 1, mesh.cells)])
    with pytest.warns(RomWarning, match="no physical volume is named"):
        found = read_mesh(path)
    assert found.region_names == {1: "body"} and set(found.regions) == {1}
    assert "plain.msh" not in found.warnings[0] and len(found.warnings) == 1
    (tmp_path / "c.geo").write_text(TWO_BODIES + 'Physical Curve("edge", 5) = {1};\n')
    with pytest.warns(RomWarning, match="physical curve 'edge' is ignored"):
        read_mesh(tmp_path / "c.geo")


def test_a_short_parameter_name_finds_the_long_one(tmp_path):
    named = 'DefineConstant[q = {1, Name "Geometry/q"}];\nBox(2) = {1, 0, 0, q'
    text = TWO_BODIES.replace("Box(2) = {1, 0, 0, 1", named)
    (tmp_path / "named.geo").write_text(text.replace("2.1, 1.1, 0.1", "q + 1.1, 1.1, 0.1"))
    mesh = read_mesh(tmp_path / "named.geo", parameters={"q": 3.0})
    assert np.ptp(mesh.points[:, 0]) == pytest.approx(4.0)


BUILDER = """
def build(gmsh, length=1.0, *, lc=0.5):
    gmsh.model.occ.addBox(0, 0, 0, length, 1, 1)
    gmsh.model.occ.synchronize()
    gmsh.model.setPhysicalName(3, gmsh.model.addPhysicalGroup(3, [1]), "body")
    gmsh.model.setPhysicalName(2, gmsh.model.addPhysicalGroup(2, [1]), "root")
    gmsh.option.setNumber("Mesh.MeshSizeMax", lc)
"""


def test_a_builder_gets_its_parameters(tmp_path):
    (tmp_path / "bar.py").write_text(BUILDER)
    mesh = read_mesh(tmp_path / "bar.py", parameters={"length": 2.0}, trust=True)
    assert volumes(mesh) == pytest.approx({"body": 2.0})
    assert areas(mesh) == pytest.approx({"root": 1.0})
    assert mesh.provenance["parameters"] == {"length": 2.0, "lc": 0.5}


def test_step_is_read_in_metres_and_faces_are_picked(folder):
    faces = {"left": (0.0, 0.01, 0.005), "bore": (0.046, 0.0101, 0.0049)}  # on it, near it
    mesh = read_mesh(folder / "plate.step", parameters={"lc": 0.004}, faces=faces)
    assert_allclose(np.ptp(mesh.points, axis=0), (0.1, 0.02, 0.01), rtol=1e-6)
    found = areas(mesh)
    assert found["left"] == pytest.approx(2e-4, rel=1e-9)
    assert found["bore"] == pytest.approx(2 * np.pi * 0.004 * 0.01, rel=0.05)
    assert mesh.region_names == {1: "body"} and mesh.warnings == ()
    ends = [[-1e-3, -1e-3, -1e-3, 1e-3, 0.03, 0.02], [0.1, 0.011, 0.004]]  # a box, a point
    mesh = read_mesh(folder / "plate.step", parameters={"lc": 0.004}, faces={"ends": ends})
    assert areas(mesh) == pytest.approx({"ends": 4e-4}, rel=1e-9)


@pytest.mark.parametrize(("lc", "culprit"), [(1e-6, "lc = 1e-06 m"), (0, "lc = 0"), ("a", "'a'")])
def test_impossible_element_size_is_refused(folder, lc, culprit):
    """Metres and millimetres mixed up would mesh for hours."""
    refuses(ConfigError, culprit, read_mesh, folder / "plate.step", parameters={"lc": lc})


def test_faces_named_in_the_step_file_are_found(folder, tmp_path):
    """gmsh does not read these names; the bore is the seventh face, x = 0 the first."""
    parts = (folder / "plate.step").read_text().split("ADVANCED_FACE(''")
    text = parts[0]
    for number, part in enumerate(parts[1:], 1):
        text += f"ADVANCED_FACE('{({1: 'left', 7: 'bore'}).get(number, '')}'" + part
    (tmp_path / "named.step").write_text(text)
    mesh = read_mesh(tmp_path / "named.step", parameters={"lc": 0.004})
    assert set(mesh.facets) == {"left", "bore"}
    assert areas(mesh)["left"] == pytest.approx(2e-4, rel=1e-9)
    r = np.hypot(*(mesh.points[np.unique(mesh.facets["bore"]), :2] - (0.05, 0.01)).T)
    assert_allclose(r, 0.004, rtol=1e-6)


def test_hexahedra_of_both_orders():
    for order, kind, nodes in ((1, "hex8", 5 * 3 * 3), (2, "hex27", 9 * 5 * 5)):
        mesh = read_mesh(MESHES / "beam.geo", parameters={"hex": 1, "nx": 4}, order=order)
        assert (mesh.cell_type, len(mesh.cells), len(mesh.points)) == (kind, 16, nodes)
        assert scaled_jacobian(mesh).min() > 0


def test_reading_is_silent(capfd, folder):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read_mesh(folder / "two.geo")
        read_mesh(folder / "plate.step")
    assert capfd.readouterr() == ("", "")


def beam(**options):
    return lambda: read_mesh(MESHES / "beam.geo", **options)


BEAM_NAMES = r"\['L', 'b', 'h', 'hex', 'lc', 'nx', 'ny', 'nz'\]"
test_wrong_options_are_refused = refused(
    (beam(parameters={"lcc": 1.0}), f"no parameter 'lcc'.*{BEAM_NAMES}"),
    (beam(parameters={"L": np.nan}), "'L'"),
    (beam(parameters={"L": object()}), "numbers or text"),
    (beam(order=3), "order=3"),
    (beam(faces={"pin": (0, 0, 0)}), "'pin'"),
    error=ConfigError,
)
PIN = """
SetFactory("OpenCASCADE");
Cylinder(1) = {0, 0, 0, 0, 0, %g, %g};
Mesh.MeshSizeMin = 0.006; Mesh.MeshSizeMax = 0.006;
Physical Volume("body") = {1};
"""


@pytest.mark.long
@pytest.mark.parametrize("way", ["geo", "meshed by itself", "step"])
def test_nodes_of_a_pin_lie_on_its_surface_whoever_meshes_it(tmp_path, way):
    """By default and with order=2; straight edges with order=1 cut off more than 1.5 %."""
    path = tmp_path / "pin.geo"
    path.write_text(PIN % (0.03, 0.01) + ("Mesh 3;\n" if way == "meshed by itself" else ""))
    if way == "step":
        path.write_text(PIN % (30, 10))  # gmsh says millimetre in the STEP files it writes
        with session(gmsh):
            gmsh.open(str(path))
            gmsh.write(str(path.with_suffix(".step")))
        path = path.with_suffix(".step")
    how = {"parameters": {"lc": 0.006}} if way == "step" else {}
    mesh, same, straight = (read_mesh(path, order=k, **how) for k in (None, 2, 1))
    assert (mesh.cell_type, straight.cell_type) == ("tet10", "tet4")
    assert_array_equal(mesh.points, same.points)
    exact = np.pi * 0.01**2 * 0.03
    assert volume(mesh) == pytest.approx(exact, rel=2e-3)
    assert volume(straight) < 0.985 * exact
    assert np.hypot(*mesh.points[:, :2].T).max() == pytest.approx(0.01, rel=1e-9)
