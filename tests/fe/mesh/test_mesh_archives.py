"""Archives of Ansys and meshes of Salome: nodes, shapes, regions, components, materials."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cases.files.archives import TYPES, archive
from cases.files.damage import changed
from cases.refusals import refuses
from rom.errors import FileFormatError, MeshError
from rom.fe.mesh.read import read_mesh

FOREIGN = Path(__file__).parents[2] / "reference" / "foreign"
BOTH = [*((kind, False) for kind in TYPES), ("tet4", True), ("tet10", True)]


@pytest.mark.parametrize(("kind", "bricks"), BOTH)
def test_archives_are_read_in_every_shape(kind, bricks, tmp_path):
    text, mesh = archive(kind, bricks=bricks)
    (tmp_path / "box.cdb").write_text(text)
    found = read_mesh(tmp_path / "box.cdb", units="mm-t-s")
    assert_allclose(found.points[found.cells], mesh.points[mesh.cells] * 1e-3, atol=1e-15)
    assert found.region_names == {1: "material_1", 2: "material_2"}
    assert_array_equal(np.flatnonzero(found.regions == 2), [len(mesh.cells) - 1])
    (root,) = found.facets.values()
    assert (found.points[root, 0] == 0.0).all() and root.shape == mesh.facets["root"].shape
    read = [(one.E, one.nu, one.rho) for one in found.solids().values()]
    assert_allclose(read, [(210e9, 0.3, 7850.0), (100e9, 0.34, 8500.0)], rtol=1e-12)


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


@pytest.mark.once
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
