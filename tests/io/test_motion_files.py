"""Histories and films of a motion, read back by other programs."""

import csv
import json
import struct
import sys
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import rom
from cases.command import ran
from cases.mbs.mechanisms import random_body
from cases.refusals import refuses
from cases.solid import block, reduced
from rom.errors import ConfigError, ResourceError
from rom.io.fields.gltf import upright
from rom.io.fields.vtkhdf import write_vtkhdf
from rom.io.files import h5py
from rom.io.history import quoted
from rom.rotation import matrix

BOX = (
    np.array([[0, 0, 0], [0.2, 0, 0], [0, 0.1, 0], [0, 0, 0.05]]),
    np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
)
WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}
LOAD_BOTH = """
import rom.fe.elasticity
from mpi4py import MPI
import dolfinx, numpy, sys
from dolfinx.io import XDMFFile
from rom.io.fields.vtkhdf import write_vtkhdf
import rom.io.files
cube = dolfinx.mesh.create_unit_cube(MPI.COMM_WORLD, 1, 1, 1)
with XDMFFile(MPI.COMM_WORLD, "cube.xdmf", "w") as file:
    file.write_mesh(cube)
corners = numpy.array([[[0.0, 0, 0], [1, 0, 0], [0, 2, 0]]])
write_vtkhdf(corners, numpy.array([[0, 1, 2]]), [0.0], "corner.vtkhdf", fields={})
open_file = rom.io.files.h5py("").File
with open_file("corner.vtkhdf") as file, open_file("cube.h5") as cube:
    sys.stdout.write(f"{file['VTKHDF/Points'][:].tolist()} {cube['Mesh/mesh/geometry'].shape}")
"""


@pytest.fixture(scope="module")
def motion():
    model = block(cells=(4, 1, 1), material=rom.Material(E=2e6, nu=0.3, rho=1100.0))
    body = reduced(2, model, reference="root")
    mech = rom.Mechanism(gravity=(0.0, 0.0, -9.81))
    rod = mech.add_flexible("rod", body)
    at = rod.point(rod.marker("tip")) + np.array([0.1, 0.0, 0.0])
    pin = {"pin": (-0.1, 0.0, 0.0)}
    bob = mech.add_rigid("bob", mass=0.5, inertia=(1e-3, 2e-3, 2e-3), at=at, markers=pin)
    root = rod.point(rod.marker("root"))
    mech.revolute("hinge", mech.ground.marker(root), rod.marker("root"), axis=(0, 1, 0))
    mech.spherical("wrist", rod.marker("tip"), bob.marker("pin"))
    return rom.simulate(mech, t_end=0.2, dt=2e-3)


def test_the_table_has_units_in_its_head_and_every_quantity(motion, tmp_path):
    with rom.write_history(motion, tmp_path / "m.csv").open(newline="") as file:
        head, *rows = csv.reader(file)
    assert all(name.endswith("]") and "[" in name for name in head)
    assert len(set(head)) == len(head)
    values = np.array(rows, dtype=float)

    def named(start, unit, axes="xyz"):
        return values[:, [head.index(f"{start} {x} [{unit}]") for x in axes]]

    assert_array_equal(values[:, head.index("t [s]")], motion.t)
    assert_array_equal(named("rod markers tip position", "m"), motion.position("rod", "tip"))
    assert_array_equal(named("bob velocity", "m/s"), motion.velocity("bob"))
    assert_array_equal(named("hinge force", "N"), motion.reaction("hinge")[:, :3])
    assert_array_equal(named("hinge moment", "N m"), motion.reaction("hinge")[:, 3:])
    q = named("rod elastic", "m sqrt(kg)", [f"q{k + 1}" for k in range(8)])
    assert_array_equal(q, motion.elastic("rod"))
    assert_array_equal(values[:, head.index("strain [J]")], motion.energy.strain)


@pytest.fixture(scope="module")
def mixed():
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    body = mech.add_flexible("one", random_body(np.random.default_rng(3)), omega=(0, 0, 1.0))
    a = body.marker("a")
    mech.cylindrical("pin", mech.ground.marker(mech.design_point(a)), a, axis=(0, 0, 1))
    mech.add_rigid("ball", mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0), velocity=(1, 0, 0))
    return rom.simulate(mech, t_end=0.02, dt=1e-3, assemble=True)


def test_a_data_frame_is_the_table_of_the_file(mixed, tmp_path):
    pytest.importorskip("pandas", reason="pandas is not installed")
    frame = mixed.to_pandas(every=2)
    lines = list(csv.reader(rom.write_history(mixed, tmp_path / "a.csv", every=2).open()))
    assert [frame.index.name, *frame.columns] == lines[0]
    numbers = np.array(lines[1:], dtype=float)
    assert_allclose(frame.index, numbers[:, 0], rtol=0)
    assert_allclose(frame.to_numpy(), numbers[:, 1:], rtol=0)
    assert_allclose(frame["ball position x [m]"], mixed.t[::2], atol=1e-12)
    assert_allclose(frame["pin displacement rate [m/s]"], -9.81 * mixed.t[::2], atol=1e-2)


def test_a_data_set_has_units_and_names(mixed):
    pytest.importorskip("xarray", reason="xarray is not installed")
    data = mixed.to_xarray()
    assert data.t.attrs["units"] == "s"
    assert data["ball velocity"].dims == ("t", "axis")
    assert data["ball velocity"].attrs["units"] == "m/s"
    assert_allclose(data["ball velocity"].sel(axis="x"), 1.0, rtol=1e-12)
    assert_allclose(data["one elastic"], mixed.elastic("one"), rtol=0)
    assert_allclose(data["pin angle"], mixed.joint("pin").angle, rtol=0)
    assert data["ball orientation"].sizes["quaternion"] == 4
    assert_allclose(data["kinetic"].sel(t=0.01, method="nearest"), mixed.energy.kinetic[10], rtol=0)
    assert data.attrs["status"] == mixed.status


@pytest.mark.parametrize("name", ["pandas", "xarray"])
def test_what_is_missing_is_named_with_the_cure(name, mixed, monkeypatch):
    monkeypatch.setitem(sys.modules, name, None)
    cure = f"{name} is not installed.*pip install {name}"
    refuses(ResourceError, cure, getattr(mixed, f"to_{name}"))


@pytest.mark.once
def test_the_tree_is_read_by_h5py(motion, tmp_path):
    hdf5 = pytest.importorskip("h5py", reason="h5py is not installed")
    path = rom.write_history(motion, tmp_path / "m.h5", every=5)
    with hdf5.File(path) as file:
        assert_array_equal(file["time"], motion.t[::5])
        tip = file["bodies/rod/markers/tip/position"]
        assert_array_equal(tip, motion.position("rod", "tip")[::5])
        assert tip.attrs["unit"] == "m" and list(tip.attrs["columns"]) == ["x", "y", "z"]
        assert_array_equal(file["joints/wrist/force"], motion.reaction("wrist")[::5, :3])
        assert_array_equal(file["energy/total"], motion.energy.total[::5])
        assert file["bodies/rod/elastic"].attrs["unit"] == "m sqrt(kg)"
        datasets = []
        file.visititems(lambda _, x: datasets.append(x) if isinstance(x, hdf5.Dataset) else None)
        assert len(datasets) > 20 and all("unit" in x.attrs for x in datasets)


def test_names_with_slashes_and_dots_stay_apart(tmp_path):
    assert len({quoted(name) for name in ("a/b", "a%2Fb", "a", ".", "..", "a.b")}) == 6
    assert not any("/" in quoted(name) for name in ("a/b", "/", "."))
    assert quoted("rod 1") == "rod 1" and quoted("..") == "%2E%2E"


def test_what_cannot_be_written_is_named(motion, tmp_path):
    for write, name, how, message in (
        (rom.write_history, "m.xls", {}, r"ending '.xls'; known: .csv, .h5, .hdf5"),
        (rom.write_history, "none/m.csv", {}, "does not exist"),
        (rom.write_animation, "m.fbx", {}, r"'.fbx' is unknown"),
        (rom.write_animation, "m.glb", {"shapes": {"rood": BOX}},
         r"no body 'rood'; there are \['bob', 'rod'\]"),
        (rom.write_animation, "m.glb", {"frames": 1}, "got 1 in"),
        (rom.write_animation, "m.glb", {"up": (0, 0, 0)}, "has length zero"),
    ):  # fmt: skip
        refuses(ConfigError, message, write, motion, tmp_path / name, **how)
    assert not list(tmp_path.iterdir())


def world_points(motion, step, magnify=1.0):
    """Surfaces of bob and rod in the world, one below the other, by rotation matrices."""
    rod = motion.mechanism.parts["rod"].flexible.surface
    u = (rod.shape @ motion.elastic("rod")[step]).reshape(-1, 3)
    out = {"bob": BOX[0], "rod": rod.points + magnify * u}
    return {
        name: motion.position(name)[step] + X @ matrix(motion.orientation(name)[step]).T
        for name, X in out.items()
    }


def chunks(path):
    """JSON and buffer of a .glb, its lengths checked."""
    data = path.read_bytes()
    magic, version, length = struct.unpack_from("<4sII", data)
    n, kind = struct.unpack_from("<I4s", data, 12)
    m, other = struct.unpack_from("<I4s", data, 20 + n)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    assert (kind, other, 28 + n + m, n % 4, m % 4) == (b"JSON", b"BIN\0", len(data), 0, 0)
    return json.loads(data[20 : 20 + n]), data[28 + n :]


def numbers(film, data, accessor):
    a = film["accessors"][accessor]
    start, width = film["bufferViews"][a["bufferView"]]["byteOffset"], WIDTHS[a["type"]]
    return np.frombuffer(data, "<f4", a["count"] * width, start).reshape(a["count"], width)


def test_a_film_has_the_structure_of_gltf(motion, tmp_path):
    path = rom.write_animation(motion, tmp_path / "m.glb", frames=21, shapes={"bob": BOX})
    film, buffer = chunks(path)
    assert film["asset"]["version"] == "2.0" and film["buffers"][0]["byteLength"] <= len(buffer)
    sizes = {5126: 4, 5125: 4}
    for a in film["accessors"]:
        view = film["bufferViews"][a["bufferView"]]
        assert a["count"] * WIDTHS[a["type"]] * sizes[a["componentType"]] == view["byteLength"]
        assert view["byteOffset"] % 4 == 0
        assert view["byteOffset"] + view["byteLength"] <= film["buffers"][0]["byteLength"]
    (animation,) = film["animations"]
    kinds = [c["target"]["path"] for c in animation["channels"]]
    assert sorted(kinds) == ["rotation", "rotation", "translation", "translation", "weights"]
    clock = film["accessors"][animation["samplers"][0]["input"]]
    assert (clock["min"], clock["max"], clock["count"]) == ([0.0], [4.0], 21)
    rod = next(m for m in film["meshes"] if m["name"] == "rod")
    for c in animation["channels"]:
        out = film["accessors"][animation["samplers"][c["sampler"]]["output"]]
        times = len(rod["weights"]) if c["target"]["path"] == "weights" else 1
        assert out["count"] == 21 * times
    assert film["scenes"][0]["nodes"] == [0] and film["nodes"][0]["children"] == [1, 2]
    colours = [m["pbrMetallicRoughness"]["baseColorFactor"] for m in film["materials"]]
    assert np.shape(colours) == (2, 4) and 0 <= np.min(colours) and np.max(colours) <= 1


@pytest.mark.fenicsx
@pytest.mark.parametrize("magnify", [1.0, 3.0])
def test_vtk_plays_the_film_as_the_bodies_moved(motion, magnify, tmp_path):
    """VTK's own importer applies morph weights, rotations and the turn of z to y."""
    gltf = pytest.importorskip("vtkmodules.vtkIOGeometry", reason="VTK comes with the pictures")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    how = {"frames": 11, "shapes": {"bob": BOX}, "seconds": None, "magnify": magnify}
    path = rom.write_animation(motion, tmp_path / "m.glb", **how)
    reader = gltf.vtkGLTFReader()
    reader.SetFileName(str(path))
    reader.SetApplyDeformationsToGeometry(True)
    reader.SetFrameRate(50)  # times of the film are multiples of 1/50 s
    reader.UpdateInformation()
    reader.EnableAnimation(0)
    for instant in (0, 4, 7):
        reader.UpdateTimeStep(0.02 * instant)
        found, blocks = [], reader.GetOutput().NewIterator()
        while not blocks.IsDoneWithTraversal():
            found.append(vtk_to_numpy(blocks.GetCurrentDataObject().GetPoints().GetData()))
            blocks.GoToNextItem()
        expected = world_points(motion, 10 * instant, magnify)
        for name in ("rod", "bob"):
            X = expected[name] @ np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # z goes to y
            got = next(x for x in found if len(x) == len(X))
            assert_allclose(got, X, atol=3e-6)


@pytest.mark.fenicsx
def test_vtk_reads_the_series_in_one_file(motion, tmp_path):
    pytest.importorskip("h5py", reason="h5py is not installed")
    hdf = pytest.importorskip("vtkmodules.vtkIOHDF", reason="VTK comes with the pictures")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    shapes = {"bob": BOX}
    path = rom.write_animation(motion, tmp_path / "m.vtkhdf", frames=5, shapes=shapes, magnify=2.0)
    reader = hdf.vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == 5
    for step in (0, 3):
        reader.SetStep(step)
        reader.Update()
        grid = reader.GetOutput()
        expected = world_points(motion, 25 * step, magnify=2.0)
        order = list(motion.mechanism.parts)
        points = vtk_to_numpy(grid.GetPoints().GetData())
        assert_allclose(points, np.vstack([expected[name] for name in order]))
        rod = motion.mechanism.parts["rod"].flexible.surface
        u = np.linalg.norm((rod.shape @ motion.elastic("rod")[25 * step]).reshape(-1, 3), axis=1)
        field = vtk_to_numpy(grid.GetPointData().GetArray("displacement [m]"))
        body = vtk_to_numpy(grid.GetPointData().GetArray("body"))
        assert_allclose(np.linalg.norm(field, axis=1)[body == order.index("rod")], u, atol=1e-12)
        corners = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 3)
        shift = sum(len(expected[name]) for name in order[: order.index("rod")])
        mine = slice(None, len(rod.triangles)) if order[0] == "rod" else slice(len(BOX[1]), None)
        assert_array_equal(corners[mine], rod.triangles + shift)
        ends = vtk_to_numpy(grid.GetCells().GetOffsetsArray())
        assert_array_equal(np.diff(ends), 3)


@pytest.mark.parametrize("up", [(0, 1, 0), (0, -1, 0), (0, 0, 1), (1, 2, -0.5)])
def test_upright_becomes_y(up):
    p = upright(np.array(up, dtype=float))
    assert_allclose(matrix(p) @ up / np.linalg.norm(up), [0, 1, 0], atol=1e-12)


def test_quaternions_in_a_film_never_jump_and_a_body_at_rest_has_no_weights(motion, tmp_path):
    """Players interpolate the four numbers: a jump would turn the body once around."""
    signs = np.where(np.arange(len(motion.t)) % 3 == 1, -1.0, 1.0)[:, None]
    at = motion.packed.system.bodies.q_at[motion._number("rod")] + 3
    q = motion.q.copy()
    q[:, at : at + 4] *= signs
    film, data = chunks(rom.write_animation(replace(motion, q=q), tmp_path / "m.glb"))
    for c in film["animations"][0]["channels"]:
        if c["target"]["path"] == "rotation":
            p = numbers(film, data, film["animations"][0]["samplers"][c["sampler"]]["output"])
            assert np.einsum("fi,fi->f", p[1:], p[:-1]).min() > 0.9
    still = replace(motion, q=np.repeat(motion.q[:1], len(motion.t), axis=0))
    film, _ = chunks(rom.write_animation(still, tmp_path / "m.glb"))
    assert not any("weights" in mesh for mesh in film["meshes"])


class Broken:
    """Finds h5py and fails to load it."""

    def find_spec(self, name, path=None, target=None):
        if name == "h5py":
            raise ValueError("Not a datatype")


def test_an_h5py_that_is_missing_or_does_not_load_is_told_with_the_cure(monkeypatch, tmp_path):
    for name in [name for name in sys.modules if name.partition(".")[0] in ("h5py", "dolfinx")]:
        monkeypatch.delitem(sys.modules, name)
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "h5py", None)
        corner = np.zeros((1, 3, 3)), np.array([[0, 1, 2]]), np.zeros(1), tmp_path / "a.vtkhdf"
        cure = r"h5py is not installed.*rom doctor.*\.glb"
        refuses(ResourceError, cure, write_vtkhdf, *corner, fields={})
    assert not list(tmp_path.iterdir())
    monkeypatch.setattr(sys, "meta_path", [Broken(), *sys.meta_path])
    alone = r"cannot be loaded \(Not a datatype\)\. rom doctor.*\.csv needs nothing"
    refuses(ResourceError, alone, h5py, ".csv")
    monkeypatch.setitem(sys.modules, "dolfinx", sys)
    beside = r"dolfinx has loaded another HDF5 before \(Not a datatype\)\. Import h5py first"
    refuses(ResourceError, rf"{beside}.*\.csv needs nothing", h5py, ".csv")


@pytest.mark.fenicsx
def test_rom_and_dolfinx_write_hdf5_in_one_process(tmp_path):
    """Wheels bring an HDF5 each, and dolfinx shows its own to all that is loaded later."""
    done = ran(sys.executable, "-c", LOAD_BOTH, cwd=tmp_path)
    assert done.stdout == "[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0]] (8, 3)", done.stderr
