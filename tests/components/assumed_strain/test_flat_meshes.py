"""Plane sections from gmsh: areas, named curves, and what is refused."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

from cases.paths import ROOT
from cases.refusals import refuses
from rom.components import assumed_strain as sheets
from rom.components.assumed_strain import Metal, sheet
from rom.components.assumed_strain.space import bending
from rom.errors import ConfigError, MeshError, TagError, UnsafeFileError
from rom.fe.mesh import read_triangles

pytestmark = pytest.mark.fenicsx
BILLET = ROOT / "meshes" / "billet.geo"
RING = """SetFactory("OpenCASCADE");
Disk(1) = {0, 0, 0, 2.0};
Disk(2) = {0, 0, 0, 1.0};
BooleanDifference(3) = { Surface{1}; Delete; }{ Surface{2}; Delete; };
Mesh.CharacteristicLengthMax = 0.12;
Physical Curve("bore") = {2};
Physical Surface("ring") = {3};
"""

DISC = """SetFactory("OpenCASCADE");
Disk(1) = {0, 0, 0, 1};
Mesh.CharacteristicLengthMax = 0.1;
"""


@pytest.fixture
def drawn(tmp_path):
    def meshed(text):
        (tmp_path / "drawn.geo").write_text(text)
        return read_triangles(tmp_path / "drawn.geo")

    return meshed


def test_a_billet_has_its_area_and_its_curves():
    mesh = read_triangles(BILLET, parameters={"lc": 0.6, "radius": 2.0}, scale=1e-3)
    body = sheet(mesh.points, mesh.triangles)
    assert body.area.sum() == pytest.approx((100 - 4 + np.pi) * 1e-6, rel=1e-3)
    outer = {tuple(side) for side in sheets.outer_sides(body).tolist()}
    assert set(mesh.curves) == {"middle", "side", "top", "axis"}
    assert {tuple(s) for sides in mesh.curves.values() for s in sides.tolist()} == outer
    assert_allclose(mesh.points[mesh.nodes("top"), 1], 0.01)
    assert_allclose(mesh.points[mesh.nodes("axis"), 0], 0.0, atol=1e-12)
    assert mesh.provenance["parameters"]["radius"] == 2.0


FOUR = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
1
1 7 "low"
$EndPhysicalNames
$Nodes
4
1 0 0 0
2 3 0 0
3 3 2 0
4 0 2 0
$EndNodes
$Elements
3
1 1 2 7 1 {low}
2 2 2 9 1 {first}
3 2 2 9 1 {second}
$EndElements
"""


@pytest.mark.parametrize("low", ["1 2", "2 1"])
@pytest.mark.parametrize(("first", "second"), [
    ("1 2 3", "1 3 4"), ("1 3 2", "1 4 3"), ("1 2 3", "4 3 1")])  # fmt: skip
def test_triangles_that_go_clockwise_are_turned(tmp_path, low, first, second):
    (tmp_path / "four.msh").write_text(FOUR.format(low=low, first=first, second=second))
    mesh = read_triangles(tmp_path / "four.msh")
    body = sheet(mesh.points, mesh.triangles)
    assert_allclose(body.area, 3.0)
    side = np.diff(mesh.points[mesh.curves["low"][0]], axis=0)[0]
    assert_allclose(side, [3.0, 0.0])
    assert_allclose(sheets.outer_sides(body)[:, 0].sum(), 0 + 1 + 2 + 3)


def test_a_bored_ring_under_pressure_is_that_of_lame(drawn):
    """Plane strain; the bore grows by (1 + nu) p a / E ((1 - 2 nu) a^2 + b^2) / (b^2 - a^2)."""
    mesh = drawn(RING)
    body = sheet(mesh.points, mesh.triangles, state="plane strain")
    places = [1.0, 0.0], [0, 2.0], [0, -2.0]
    right, top, low = (np.abs(mesh.points - x).sum(axis=1).argmin() for x in places)
    held, bore, p = [2 * right + 1, 2 * top, 2 * low], mesh.curves["bore"], 1e-4
    pressed = sheets.Actions(held, tractions=[sheets.Traction(bore, p)])
    course = sheets.quasi_static(body, Metal(1.0, 0.3), pressed, [0, 1])
    nodes = mesh.nodes("bore")
    grown = np.linalg.norm(course.x[-1, nodes], axis=1) - np.linalg.norm(mesh.points[nodes], axis=1)
    assert grown.mean() == pytest.approx(1.3 * p * (0.4 + 4) / 3, rel=0.02)


def test_a_free_disc_bends_as_in_the_book(drawn):
    """Leissa: lambda^2 = 5.358 twice, 9.003 and 12.44 twice, for nu = 0.3; round edge of chords."""
    mesh = drawn(DISC)
    body, metal = sheet(mesh.points, mesh.triangles, thickness=0.01), Metal(1.0, 0.3, 1.0)
    K, M = bending(body, metal).toarray(), sheets.mass(body, metal)[::2, ::2].toarray()
    found = np.sqrt(np.abs(eigh(K, M, eigvals_only=True)[3:8]))
    unit = np.sqrt(0.01**2 / 12 / (1 - 0.3**2))
    assert_allclose(found / unit, [5.358, 5.358, 9.003, 12.44, 12.44], rtol=0.01)


def test_a_billet_from_gmsh_is_upset_with_friction():
    """The pressure lies between that without friction and Prandtl's between rough platens."""
    mesh = read_triangles(BILLET, parameters={"lc": 1.2})
    body = sheet(mesh.points, mesh.triangles, element="F1", state="plane strain")
    held = np.r_[2 * mesh.nodes("axis"), 2 * mesh.nodes("middle") + 1]
    way = ((0, 1), ((0, 0), (0, -2.0)))
    pressures = {}
    for friction in (0.0, 0.2):
        platen = sheets.Tool("platen", [(-1, 10), (40, 10), (40, 20), (-1, 20)], friction, way)
        actions, metal = sheets.Actions(held, tools=[platen]), Metal(200e3, 0.3, 1.0, 500.0)
        course = sheets.quasi_static(body, metal, actions, np.linspace(0, 1, 21))
        x = course.x[-1]
        wide = x[x[:, 1] > 8 - 1e-3, 0].max()
        pressures[friction] = -course.tool_forces[-1, 0, 1] / wide / (2 / np.sqrt(3) * 500)
        assert body.points[:, 1].max() == 10 and x[:, 1].max() < 8.01
    assert 0.98 < pressures[0.0] < 1.12  # the rounded edge hangs over: the contact is narrower
    assert pressures[0.0] < pressures[0.2] < 0.75 + wide / (4 * 8) + 0.15


def test_what_is_no_section_is_named(drawn, tmp_path):
    for name, error, words in (
        ("a.step", ConfigError, r"suffix '\.step' holds no plane section"),
        ("a.py", UnsafeFileError, "Python program"),
    ):
        (tmp_path / name).write_text("ISO")
        refuses(error, words, read_triangles, tmp_path / name)
    refuses(ConfigError, "depth", read_triangles, BILLET, parameters={"depth": 1.0})
    line = "Point(1) = {0, 0, 0};\nPoint(2) = {1, 0, 0};\nLine(1) = {1, 2};\n"
    refuses(MeshError, "no triangles: the geometry has no plane surface", drawn, line)
    square = 'SetFactory("OpenCASCADE");\nRectangle(1) = {0, 0, %s, 1, 1};\n%s\n'
    refuses(MeshError, r"by 0\.3 m", drawn, square % ("0.3", ""))
    quads = square % ("0", "Recombine Surface {1};")
    refuses(MeshError, "Quadrilateral 4: triangles", drawn, quads)
    refuses(TagError, r"no curve 'edge'; there are", drawn(square % ("0", "")).nodes, "edge")
