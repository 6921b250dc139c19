"""Archives of Ansys and meshes of Salome: nodes, shapes, regions, components, materials."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cases.files.cells import solid
from cases.files.damage import changed, damaged, outcome
from cases.refusals import refuses
from rom.errors import FileFormatError, MeshError, RomError
from rom.fe.mesh import child
from rom.fe.mesh.cell_types import DECK_EDGES, READ_TYPES
from rom.fe.mesh.read import read_mesh

FOREIGN = Path(__file__).parents[2] / "reference" / "foreign"
LAWS = """MPTEMP,R5.0, 1, 1,  0.00000000    ,
MPDATA,R5.0, 1,EX  ,       1, 1,  210000.000    ,
MPDATA,R5.0, 1,PRXY,       1, 1, 0.300000000    ,
MPDATA,R5.0, 1,DENS,       1, 1, 7.850000000E-09,
MP,EX,2,100000.,  ! by hand
MP,NUXY,2,0.34
MP,DENS,2,8.5e-9
MP,KXX,2,60.,1.,2.
TB,BISO,2
TBDATA,1,235.
"""
BRICK = (0, 1, 2, 2, 3, 3, 3, 3)  # corners of a tetrahedron drawn as a brick
TYPES = {"tet4": 285, "tet10": 187, "hex8": 185, "hex20": 186}


def archive(kind, *, bricks=False, size=(2.0, 1.0, 1.0)):
    """Text of a box in mm, with the last cell of another material, and its mesh."""
    mesh = solid("hex27" if kind == "hex20" else kind, (2, 2, 2), size)
    type_ = READ_TYPES[kind]
    edges = type_.among(DECK_EDGES.get(kind, ()))
    used, cells = np.unique(mesh.cells[:, [*range(type_.n_corners), *edges]], return_inverse=True)
    points, cells = mesh.points[used], cells.reshape(-1, type_.n_nodes) + 1
    if bricks:
        cells = (
            cells[:, BRICK]
            if kind == "tet4"
            else cells[:, [*BRICK, 4, 5, 2, 6, *4 * [3], 7, 8, 9, 9]]
        )
    rows = [f"/PREP7\nET,       5,{TYPES[kind] if not bricks else 186}\nET,6,154",
            f"NBLOCK,6,SOLID,{len(points):9d},{len(points):9d}\n(3i9,6e21.13e3)"]  # fmt: skip
    for k, x in enumerate(points, 1):
        row = "".join(f"{v:21.13E}" for v in x)
        rows.append(f"{k:9d}{0:9d}{0:9d}{row}")
    rows.append(f"N,R5.3,LOC,       -1,\nEBLOCK,19,SOLID,{len(cells):10d}\n(19i10)")
    for k, cell in enumerate(cells, 1):
        head = (1 + (k == len(cells)), 5, 1, 1, 0, 0, 0, 0, len(cell), 0, k)
        words = [f"{n:10d}" for n in (*head, *cell)]
        rows += ["".join(words[:19])] + ["".join(words[19:])] * (len(words) > 19)
    root = np.flatnonzero(points[:, 0] == 0.0) + 1
    ranges = [root[0], *(-n if n == m + 1 else n for m, n in pairwise(root))]
    rows.append(f"        -1\nCMBLOCK,ROOT    ,NODE,{len(root):8d}  ! users node component\n(8i10)")
    rows += ["".join(f"{n:10d}" for n in ranges[k : k + 8]) for k in range(0, len(ranges), 8)]
    return "\n".join([*rows, LAWS]), mesh


@pytest.mark.parametrize(("kind", "bricks"), [
    ("tet4", False), ("tet10", False), ("hex8", False), ("hex20", False),
    ("tet4", True), ("tet10", True),
])  # fmt: skip
def test_archives_are_read_in_every_shape(kind, bricks, tmp_path):
    text, mesh = archive(kind, bricks=bricks)
    (tmp_path / "box.cdb").write_text(text)
    found = read_mesh(tmp_path / "box.cdb", units="mm-t-s")
    assert_allclose(found.points[found.cells], mesh.points[mesh.cells] * 1e-3, atol=1e-15)
    assert found.region_names == {1: "material_1", 2: "material_2"}
    assert_array_equal(np.flatnonzero(found.regions == 2), [len(mesh.cells) - 1])
    (root,) = found.facets.values()
    assert (found.points[root, 0] == 0.0).all() and root.shape == mesh.facets["root"].shape
    steel, brass = found.solids().values()
    assert_allclose((steel.E, steel.nu, steel.rho), (210e9, 0.3, 7850.0), rtol=1e-12)
    assert_allclose((brass.E, brass.nu, brass.rho), (100e9, 0.34, 8500.0), rtol=1e-12)


test_what_an_archive_would_lose_is_refused = changed(
    lambda: archive("hex8")[0], "a.cdb", lambda path: read_mesh(path, units="mm-t-s").solids(),
    ("ET,6,154", "ET,6,SHELL181", r"ET, SHELL181 \(1, a.cdb line 3"),
    ("ET,6,154", "ETBLOCK,1,1\n(2i9,19a9)\n 6 21\n -1", r"ET, 21 \(1.*Attachment"),
    ("/PREP7", "CE,R5.0,DEFI,2,1,0.", r"CE \(1, a.cdb line 1.*rbe2"),
    ("/PREP7", "CERIG,1,ALL,ALL\nRBE3,1,ALL,ALL", r"CERIG \(1.*RBE3 \(1"),
    ("/PREP7", "/INPUT,more,dat", "/INPUT"), ("/PREP7", "EN,1,1,2,3", r"EN \(1"),
    ("ET,       5,185", "", r"line \d+: EBLOCK .* element 1: no ET says what its type 5 is"),
    ("NUXY,2,0.34", "NUXY,2,0.34,1e-5", r"MP, NUXY \(1"), ("EX,2", "EY,2", r"MP, EY \(1"),
    ("DENS,2", "DENS,3", "material_2 has no 'DENS'"), ("TB,BISO", "TB,ELAS", r"TB, ELAS \(1"),
    ("MP,EX,2", "MP,EX,two", "line .*MP cannot be read: 'TWO' is no whole number"),
    ("(3i9,6e21.13e3)", "(free)", "'\\(FREE\\)' is no format"),
    ("(3i9,6e21.13e3)\n        1", "(3i9,6e21.13e3)\n      999", "node 1 is used but not defined"),
    ("(19i10)", "(19i9)", "EBLOCK cannot be read"),
    ("ROOT    ,NODE", "ROOT    ,NOD", "CMBLOCK cannot be read"),
    error=FileFormatError,
)  # fmt: skip


def test_wedges_and_cells_without_some_middles_are_refused(tmp_path):
    text, _ = archive("hex8")
    first = text.index("(19i10)\n") + 8 + 11 * 10
    (tmp_path / "a.cdb").write_text(
        text[: first + 30] + text[first + 20 : first + 30] + text[first + 40 :]
    )
    with pytest.raises(MeshError, match=r"\['hex8', 'wedge or pyramid'\]"):
        read_mesh(tmp_path / "a.cdb")


def test_damaged_archives_are_refused_or_harmless(tmp_path):
    path = tmp_path / "x.cdb"
    path.write_text(archive("tet4")[0])

    def read(path):
        try:
            child.read({"reader": "ansys", "path": str(path)})
        except RomError as error:
            raise type(error)(error.message, where=str(path)) from error

    assert outcome(read, path) is None
    data, refused = path.read_bytes(), 0
    for _, content in damaged(data, np.random.default_rng(5), 100):
        path.write_bytes(content)
        refused += outcome(read, path) is not None
    assert refused > 20


def test_a_mesh_of_salome_has_its_groups(tmp_path):
    """Two mirrored bricks of 20 nodes, written by MEDLoader 9.15 with overlapping groups."""
    pytest.importorskip("h5py", reason="h5py is not installed")
    mesh = read_mesh(FOREIGN / "box.med")
    assert mesh.cell_type == "hex27" and mesh.region_names == {1: "brass", 2: "steel"}
    centres = mesh.points[mesh.cells].mean(axis=1)
    assert_allclose(
        centres[np.argsort(mesh.regions)], [[0.5, 0.5, 0.5], [1.5, 0.5, 0.5]], atol=1e-14
    )
    places = {name: mesh.points[np.unique(rows)] for name, rows in mesh.facets.items()}
    assert (places["root"][:, 0] == 0.0).all() and (places["tip"][:, 0] == 2.0).all()
    assert {name: len(rows) for name, rows in mesh.facets.items()} == {
        "root": 1,
        "sides": 3,
        "tip": 1,
    }
    for data in (b"no HDF5", (FOREIGN / "box.med").read_bytes()[:9000]):
        (tmp_path / "a.med").write_bytes(data)
        refuses(FileFormatError, r"a\.med: is no MED file", read_mesh, tmp_path / "a.med")
