"""Faces of STEP files: how they are picked, and what the CAD knows of them."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cases.files import step_parts
from cases.files.step_parts import step_box, step_part, step_plate
from cases.paths import ROOT
from cases.refusals import refuses
from rom.errors import ConfigError, MeshError, TagError
from rom.fe.mesh.picks import picks
from rom.fe.mesh.read import read_mesh
from rom.fe.mesh.sources.cad_faces import Picker, pick
from rom.fe.mesh.sources.gmsh_session import session
from rom.fe.mesh.sources.step import make
from rom.fe.mesh.summary import surface_triangles
from rom.rotation import exp, matrix

gmsh = pytest.importorskip("gmsh", reason="gmsh is not installed")
pytestmark = pytest.mark.fenicsx


@pytest.fixture(scope="module")
def parts(tmp_path_factory):
    folder = tmp_path_factory.mktemp("parts")
    step_plate(folder / "plate.step")
    step_plate(folder / "turned.step", turned=True)
    step_parts.in_inches(folder / "plate.step", folder / "inches.step")
    return folder


def turned(x):
    """A place of the plate [m] after the turn and the shift of the whole."""
    axis = np.array(step_parts.TURN_AXIS) / np.linalg.norm(step_parts.TURN_AXIS)
    return matrix(exp(step_parts.TURN_ANGLE * axis)) @ x + 1e-3 * np.array(step_parts.SHIFT)


def listed(path, **options):
    return read_mesh(path, parameters={"lc": 0.02}, faces={"face": "every"}, **options).faces


def one(faces, **wanted):
    found = [f for f in faces if all(getattr(f, k) == v for k, v in wanted.items())]
    assert len(found) == 1
    return found[0]


@pytest.mark.parametrize("file", ["plate", "turned"])
def test_kinds_radii_axes_and_areas_are_those_of_the_drawing(parts, file):
    """To 1e-12 of the size, 0.12 m, whatever the mesh: of the bore it has nine facets around."""
    place = turned if file == "turned" else np.array
    faces = listed(parts / f"{file}.step")
    assert [face.number for face in faces] == list(range(1, len(faces) + 1))
    assert sorted(face.kind for face in faces) == 3 * ["cylinder"] + 6 * ["plane"]
    z = place([0, 0, 1]) - place([0, 0, 0])
    for face in (face for face in faces if face.kind == "cylinder"):
        x, r, arc = (0.03, 0.006, 2) if face.radius < 0.008 else (0.07, 0.01, 1)
        assert face.radius == pytest.approx(r, abs=1.2e-13)
        assert_allclose(np.abs(z @ face.axis), 1, rtol=1e-12)
        assert max(face.axis, key=abs) > 0 and face.normal is None
        assert_allclose(np.cross(z, face.axis), 0, atol=1e-11)
        assert_allclose(face.point, place([x, 0.03, 0.005]), rtol=0, atol=2.5e-13)
        assert face.area == pytest.approx(arc * np.pi * r * 0.01, rel=1e-9)
    holes = np.pi * (0.006**2 + 0.01**2)
    planes = {(0, 0, 1): (0.05, 0.03, 0.01), (0, 0, -1): (0.05, 0.03, 0),
              (1, 0, 0): (0.1, 0.03, 0.005), (-1, 0, 0): (0, 0.03, 0.005),
              (0, 1, 0): (0.05, 0.06, 0.005), (0, -1, 0): (0.05, 0, 0.005)}  # fmt: skip
    for normal, middle in planes.items():
        outward = place(np.array(normal)) - place(np.zeros(3))
        face = next(f for f in faces if f.normal and np.dot(f.normal, outward) > 0.9)
        assert_allclose(face.normal, outward, atol=1e-12)
        area = np.prod([(0.1, 0.06, 0.01)[k] for k in range(3) if not normal[k]])
        if normal[2]:
            middle = np.array(middle)
            middle[0] = (0.05 * area - np.pi * (0.03 * 0.006**2 + 0.07 * 0.01**2)) / (area - holes)
            area -= holes
        assert face.area == pytest.approx(area, rel=1e-9)
        assert_allclose(face.middle, place(middle), atol=1e-9)


def test_other_kinds_have_radius_and_axis_too(tmp_path):
    with step_part(tmp_path / "round.step") as occ:
        block = occ.addBox(-40, -40, 0, 80, 80, 30)
        tools = [occ.addSphere(20, 20, 30, 8), occ.addCone(-20, -20, 10, 0, 0, 30, 4, 10),
                 occ.addTorus(-15, 15, 30, 12, 3)]  # fmt: skip
        occ.cut([(3, block)], [(3, tool) for tool in tools])
    faces = listed(tmp_path / "round.step")
    sphere, cone, torus = (one(faces, kind=k) for k in ("sphere", "cone", "torus"))
    assert sphere.radius == pytest.approx(0.008, rel=1e-12) and sphere.axis is None
    assert_allclose(sphere.point, (0.02, 0.02, 0.03), atol=1e-14)
    assert sphere.area == pytest.approx(2 * np.pi * 0.008**2, rel=1e-9)
    assert torus.radius == pytest.approx(0.003, rel=1e-12)
    assert_allclose(torus.point, (-0.015, 0.015, 0.03), atol=1e-14)
    assert_allclose((cone.axis, torus.axis), 2 * [(0, 0, 1)], atol=1e-12)
    assert cone.radius is None and cone.point[:2] == pytest.approx((-0.02, -0.02), abs=1e-14)


def test_normals_point_out_of_the_solid_whatever_the_file_says(tmp_path):
    """The walls of a closed room inside of a part look into the room."""
    with step_part(tmp_path / "room.step") as occ:
        part = occ.addBox(0, 0, 0, 40, 40, 40)
        room = occ.addBox(10, 10, 10, 10, 10, 10)
        occ.cut([(3, part)], [(3, room)])
    for face in listed(tmp_path / "room.step"):
        k = int(np.argmax(np.abs(face.normal)))
        high = 0.04 if face.area > 1e-3 else 0.01
        assert face.normal[k] == pytest.approx(1 if abs(face.middle[k] - high) < 1e-9 else -1)


AREAS = {  # of what is picked
    "radius:0.006": 2 * np.pi * 0.006 * 0.01,
    "radius:0.010": 2 * np.pi * 0.01 * 0.01,
    "radius:0.006+radius:0.01": 2 * np.pi * 0.016 * 0.01,
    "normal:0,0,2": 0.1 * 0.06 - np.pi * (0.006**2 + 0.01**2),
    "normal:1e-3,0,-1": 0.1 * 0.06 - np.pi * (0.006**2 + 0.01**2),
    "normal:-1,0,0": 0.06 * 0.01,
    "normal:-1,0,0 + 0.1,0.03,0.005": 2 * 0.06 * 0.01,
}


@pytest.fixture
def meshed(parts):
    with session(gmsh):
        make(gmsh, parts / "plate.step", {"parameters": {"lc": 0.02}})
        gmsh.model.mesh.generate(3)
        yield gmsh


@pytest.mark.parametrize(("text", "area"), AREAS.items())
def test_what_is_picked_has_its_area(meshed, text, area):
    picker = Picker(meshed)
    tags = {tag for wish in picks(text) for tag in picker.found(wish)}
    assert sum(meshed.model.occ.getMass(2, tag) for tag in tags) == pytest.approx(area)


def test_numbers_are_those_of_the_list(parts):
    faces = {"bore": "radius:0.01", "face": "every"}
    mesh = read_mesh(parts / "plate.step", faces=faces)
    numbers = [f.number for f in mesh.faces if f.radius and f.radius > 0.008]
    assert [f.number for f in mesh.faces if f.name == "bore"] == numbers
    again = read_mesh(parts / "plate.step", faces={"bore": "+".join(map(str, numbers))})
    assert np.array_equal(mesh.facets["bore"], again.facets["bore"])
    r = np.hypot(*(mesh.points[np.unique(mesh.facets["bore"]), :2] - (0.07, 0.03)).T)
    assert_allclose(r, 0.01, rtol=1e-9)


REFUSED = {
    "99": "'a': there is no face 99; the part has 9 faces, numbered 1 to 9",
    "0": "there is no face 0",
    "radius:6": r"radius 6 m\. The nearest radii are 0.01 \(2 faces\), 0.006 \(1 face\) m",
    "radius:0.00601": r"0.00601 m\. The nearest radii are 0.006 \(1 face\), 0.01 \(2 faces\) m",
    "normal:0,1,1": r"no plane face has the outward normal 0,1,1\. The nearest are \d \(",
    "normal:0.01,0,1": r"no plane face has the outward normal 0.01,0,1\. The nearest are",
    "0,0,1": "the nearest face is 0.99 m from the point 0,0,1, the body 0.117 m long",
    "0,0,0": r"faces \d and \d are equally near to the point 0,0,0.* or a number",
    (0, 0, 0, 1e-5, 1e-5, 1e-5): "'a': no face lies inside of the box",
    "1,2,3": r"Faces of these numbers are '1\+2\+3'",
}


@pytest.mark.parametrize(("text", "said"), REFUSED.items())
def test_what_is_not_there_is_refused_with_what_is(meshed, text, said):
    refuses(TagError, said, pick, meshed, {"a": text}, "plate.step")


def test_two_planes_of_one_normal_are_listed(tmp_path):
    """A step: the upper one and the lower one both look up."""
    with step_part(tmp_path / "step.step") as occ:
        low, high = occ.addBox(0, 0, 0, 40, 20, 10), occ.addBox(0, 0, 0, 20, 20, 20)
        occ.fuse([(3, low)], [(3, high)])
    with pytest.raises(TagError, match=r"step.step: face 'top'.* step.step --faces") as caught:
        read_mesh(tmp_path / "step.step", faces={"top": "normal:0,0,1"})
    said = str(caught.value)
    for middle in ("0.01,0.01,0.02", "0.03,0.01,0.01"):
        assert f"(middle {middle} m)" in said
    both = re.search(r"several as (\d+\+\d+)", said)[1]
    mesh = read_mesh(tmp_path / "step.step", faces={"top": both})
    heights = np.unique(mesh.points[np.unique(mesh.facets["top"]), 2].round(9))
    assert heights.tolist() == [0.01, 0.02]


def test_wishes_that_no_face_fulfils_are_refused(parts, tmp_path):
    box, plate = tmp_path / "box.step", parts / "plate.step"
    step_box(box, 10, 10, 10)
    refuses(TagError, "no cylinder face", read_mesh, box, faces={"bore": "radius:1e-3"})
    twice, wrong = {"a": 3, "b": "normal:-1,0,0", "c": "3+4"}, {"a": "here"}
    refuses(TagError, "face 3 is to be called 'a' and 'c'", read_mesh, plate, faces=twice)
    refuses(ConfigError, "'here' is no face", read_mesh, plate, faces=wrong, time_limit=1e-3)


@pytest.mark.parametrize(("file", "scale"), [("plate", 1.0), ("turned", 1.0), ("inches", 25.4)])
def test_the_axis_of_a_bore_is_that_of_the_drawing(parts, file, scale):
    """Of two halves as of one face, to 1e-12 of the size; the flat face has none."""
    place = turned if file == "turned" else np.array
    faces = {"small": f"radius:{0.006 * scale}", "large": f"radius:{0.01 * scale}", "flat": 1}
    mesh = read_mesh(parts / f"{file}.step", parameters={"lc": 0.02 * scale}, faces=faces)
    assert set(mesh.axes) == {"small", "large"}
    if file != "turned":
        assert_allclose(np.ptp(mesh.points, axis=0) / scale, (0.1, 0.06, 0.01), rtol=1e-9)
    for name, x, r in (("small", 0.03, 0.006), ("large", 0.07, 0.01)):
        axis = mesh.axes[name]
        exact = scale * place([x, 0.03, 0.005])
        assert_allclose(axis.point, exact, rtol=0, atol=1e-12 * mesh.size + 2e-13)
        assert axis.radius == pytest.approx(r * scale, rel=1e-11)
        z = place([0, 0, 1]) - place([0, 0, 0])
        assert_allclose(axis.direction, z, atol=1e-11)


def test_faces_about_two_lines_or_of_less_than_a_quarter_turn_have_no_axis(tmp_path):
    """An edge rounded by 90 degrees has the axis of its fillet; a shallow arch has none."""
    with step_part(tmp_path / "arch.step") as occ:
        block = occ.addBox(0, 0, 0, 40, 40, 20)
        tools = [occ.addCylinder(20, -1, 45, 0, 42, 0, 30), occ.addCylinder(0, -1, 0, 0, 42, 0, 5)]
        occ.cut([(3, block)], [(3, tool) for tool in tools])
    faces = {"arch": "radius:0.03", "corner": "radius:0.005"}
    assert set(read_mesh(tmp_path / "arch.step", faces=faces).axes) == {"corner"}
    both = {"both": "radius:0.03+radius:0.005"}
    assert read_mesh(tmp_path / "arch.step", faces=both).axes == {}


def test_a_stepped_bore_has_an_axis_and_no_radius(tmp_path):
    """Its point is the middle of both together: z from 0 to 20 mm."""
    with step_part(tmp_path / "stepped.step") as occ:
        block = occ.addBox(0, 0, 0, 40, 40, 20)
        bores = [occ.addCylinder(15, 20, -1, 0, 0, 30, 4), occ.addCylinder(15, 20, 12, 0, 0, 9, 6)]
        occ.cut([(3, block)], [(3, bore) for bore in bores])
    faces = {"bore": "radius:0.004+radius:0.006"}
    axis = read_mesh(tmp_path / "stepped.step", faces=faces).axes["bore"]
    assert_allclose(axis.point, (0.015, 0.02, 0.01), atol=1e-14)
    assert axis.radius is None


def test_geometries_of_gmsh_with_cylinders_have_axes(tmp_path):
    """In the OpenCASCADE kernel, also scaled; the built-in kernel and finished meshes know none."""
    mesh = read_mesh(ROOT / "meshes" / "connecting_rod.geo", parameters={"lc": 8e-3}, scale=2.0)
    assert_allclose(mesh.axes["pin_b"].point, (0.4, 0, 0), atol=1e-14)
    assert mesh.axes["pin_b"].radius == pytest.approx(0.016, rel=1e-12)
    (tmp_path / "plain.geo").write_text(
        "Point(1) = {0,0,0,1}; Point(2) = {1,0,0,1}; Point(3) = {0,1,0,1}; Point(4) = {-1,0,0,1};\n"
        "Circle(1) = {2,1,3}; Circle(2) = {3,1,4}; Line(3) = {4,2}; Curve Loop(1) = {1,2,3};\n"
        "Plane Surface(1) = {1};\n"
        "out[] = Extrude {0,0,1} { Surface{1}; };\n"
        'Physical Volume("body") = {out[1]}; Physical Surface("side") = {out[2]};\n'
    )
    assert read_mesh(tmp_path / "plain.geo").axes == {}


@pytest.mark.parametrize(
    "boxes",
    [[(0, 0, 0, 10, 10, 10), (20, 0, 0, 10, 10, 20)],
     [(0, 0, 0, 10, 10, 10), (10, 0, 0, 10, 10, 20)],
     [(0, 0, 0, 10, 10, 10), (10, 10, 0, 10, 10, 20)]],
    ids=["apart", "touching", "edge to edge"],
)  # fmt: skip
def test_solids_that_share_no_face_are_refused_with_their_volumes(tmp_path, boxes):
    path = tmp_path / "two.step"
    with step_part(path) as occ:
        for box in boxes:
            occ.addBox(*box)
    said = r"2 solids, of 2e-06, 1e-06 m\^3, that share no face"
    refuses(MeshError, said, read_mesh, path, time_limit=100)


def test_loose_surfaces_are_no_solid_and_no_face_of_one(tmp_path):
    with step_part(tmp_path / "sheet.step") as occ:
        occ.addRectangle(0, 0, 0, 10, 10)
    refuses(MeshError, "no solid, only 1 loose face", read_mesh, tmp_path / "sheet.step")
    with step_part(tmp_path / "loose.step") as occ:
        occ.addBox(0, 0, 0, 10, 10, 10)
        occ.addRectangle(0, 0, 30, 10, 10)
    mesh = read_mesh(tmp_path / "loose.step", faces={"face": "every"})
    assert len(mesh.faces) == 6 and len(mesh.facets) == 6
    assert np.ptp(mesh.points[:, 2]) == pytest.approx(0.01)


def test_faces_are_drawn_as_round_as_the_mesh_is(parts):
    """A chord of an edge would leave 3 to 5 % of the area of a bore away, a quarter of that now."""
    mesh = read_mesh(parts / "plate.step", faces={"face": "every"})
    patches = surface_triangles(mesh)
    for face in mesh.faces:
        a, b, c = np.moveaxis(mesh.points[patches[f"face {face.number}"]], 1, 0)
        normals = 0.5 * np.cross(b - a, c - a)
        area = np.linalg.norm(normals, axis=1).sum()
        assert area == pytest.approx(face.area, rel=8e-3 if face.radius else 4e-3)
        if face.normal:
            assert np.linalg.norm(normals.sum(axis=0)) == pytest.approx(area, rel=1e-12)
