"""Broken and hostile mesh files and geometries: the right class of error, the culprit named, fast.

Each case writes one bad file. Several of them bring gmsh or dolfinx down when they are let near.
"""

import os
import socket
import time
import warnings
import zipfile
from pathlib import Path

import numpy as np
import pytest

import rom
from cases.boxes import BOX_GEO as GEO
from cases.files.cells import blocks_of, solid, write_msh
from cases.files.damage import WAYS
from cases.long import ROM_LONG, few
from rom.errors import ConfigError, FileFormatError, MeshError, RomError, TagError, UnsafeFileError
from rom.fe.mesh.read import read_mesh
from rom.process import child

pytest.importorskip("gmsh", reason="gmsh is not installed")
pytestmark = pytest.mark.fenicsx
SECONDS = 30.0
MUTANTS = 60 if ROM_LONG else 10

BOX = solid()
BLOCKS, NAMES = blocks_of(BOX)


def text(content):
    data = content if isinstance(content, bytes) else content.encode()
    return lambda path: path.write_bytes(data)


def msh(points=BOX.points, blocks=BLOCKS, names=NAMES):
    return lambda path: write_msh(path, points, blocks, names)


def cut(fraction):
    def make(path):
        data = write_msh(path, BOX.points, BLOCKS, NAMES).read_bytes()
        path.write_bytes(data[: int(fraction * len(data))])

    return make


def zipped(path):
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("box.msh", "$MeshFormat")


def replaced(old, new):
    def make(path):
        content = write_msh(path, BOX.points, BLOCKS, NAMES).read_text()
        assert old in content
        path.write_text(content.replace(old, new, 1))

    return make


def cells(*more):
    return [("tet4", 1, 1, np.array([*BOX.cells, *more])), *BLOCKS[1:]]


PIN = (2, 40, "pin")
OTHERS = {  # name: file name, maker, error, what the message must contain beside the file
    "unknown suffix": ("box.stl", text("solid"), ConfigError, "'.stl'"),
    "zip renamed to step": ("box.step", zipped, FileFormatError, "ISO-10303-21"),
    "cut step": ("box.step", text("ISO-10303-21;\nHEADER;\n"), (FileFormatError, MeshError)),
    "not UTF-8 inp": ("box.inp", text(b"*NODE\n1, \xff\xfe\n"), FileFormatError, "line 2: *NODE"),
    "empty inp": ("box.inp", text(""), MeshError, "no volume cells"),
}  # fmt: skip
MSH = {  # the same of box.msh
    "a folder": (lambda p: p.mkdir(), FileFormatError, "folder"),
    "a socket": (lambda p: socket.socket(socket.AF_UNIX).bind(str(p)), FileFormatError),
    "a pipe": (os.mkfifo, FileFormatError, "no such file"),
    "missing": (lambda p: None, FileFormatError, "no such file"),
    "empty msh": (text(""), FileFormatError, "$MeshFormat"),
    "text renamed to msh": (text("hello\n"), UnsafeFileError, "$MeshFormat"),
    "zip renamed to msh": (zipped, UnsafeFileError, "b'PK"),
    "not UTF-8": (text(b"\xff\xfe$\x00M\x00"), UnsafeFileError, "xff"),
    "bytes after the header": (text(b"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n\xff\xfe\n"),
        FileFormatError, "cut"),
    "unknown version": (replaced("2.2 0 8", "9.9 0 8"), FileFormatError, "9.9"),
    "half": (cut(0.5), FileFormatError, "cut"),
    "only a header": (cut(0.02), FileFormatError, "cut"),
    "claims a billion nodes": (replaced("$Nodes\n36", "$Nodes\n999999999999"), FileFormatError),
    "claims more cells": (replaced("$Elements\n88", "$Elements\n99999"), FileFormatError),
    "letters for numbers": (replaced("1 0.0 0.0 0.0", "1 0.0 zero 0.0"), FileFormatError),
    "volume in two groups, msh": (
        msh(blocks=[*BLOCKS, ("tet4", 2, 1, BOX.cells)], names=[*NAMES, (3, 2, "liner")]),
        TagError, "'body' and 'liner'"),
    "only surfaces tagged, msh": (msh(blocks=BLOCKS[1:], names=NAMES[1:]), MeshError, "'root'"),
    "one name on two tags": (msh(names=[*NAMES[:2], (2, 12, "root")]), TagError, "surface 12"),
    "groups gmsh cannot tell apart": (
        msh(blocks=[BLOCKS[0], *(("tri3", tag, 5, rows) for _, tag, _, rows in BLOCKS[1:])]),
        TagError, "share their elementary number"),
    "declared and absent": (msh(names=[*NAMES, PIN]), TagError, "'pin' is empty"),
    "facets of another type": (
        msh(blocks=[*BLOCKS, ("quad4", 40, 40, [[0, 1, 2, 3]])], names=[*NAMES, PIN]),
        TagError, "'pin' has 1 facets of 4 nodes"),
    "surface mesh": (msh(blocks=[("tri3", 1, 1, BLOCKS[1][3])], names=[(2, 1, "skin")]), MeshError),
    "not meshed": (msh(blocks=[], names=[]), MeshError, "not meshed"),
    "mixed cells": (msh(blocks=[*BLOCKS, ("hex8", 1, 1, [range(8)])]), MeshError, "several types"),
    # what is wrong with a mesh however it comes is refused in tests/fe/mesh/test_mesh_validate.py
    "duplicate cell": (msh(blocks=cells(BOX.cells[7])), MeshError, "cells 8, 73"),
    "node beyond the end": (msh(blocks=cells([0, 1, 2, 5000])), FileFormatError, "5001"),
    "negative node": (msh(blocks=cells([0, 1, 2, -7])), FileFormatError, "-6"),
}  # fmt: skip
GEOS = {  # text of box.geo
    "geo syntax error": (GEO + "Box(2) = {0, 0, 0\n", FileFormatError, "line 6"),
    "geo unknown variable": (GEO + "Box(2) = {q, 0, 0, 1, 1, 1};\n", FileFormatError, "'q'"),
    "geo of a lost surface": (GEO + 'Physical Surface("a", 12) = {99};\n', TagError, "'a'"),
    "geo of a lost volume": (GEO + 'Physical Volume("a", 12) = {99};\n', TagError, "'a'"),
    "geo of a group below zero": (GEO.replace('"body", 1', '"body", -3'), TagError, "volume 1"),
    "geo of a lost file": (GEO + 'Include "nope.geo";\n', FileFormatError, "nope.geo"),
    "geo that merges a lost file": (GEO + 'Merge "nope.step";\n', FileFormatError),
    "geo that deletes all": (GEO + "Delete All;\n", (FileFormatError, TagError, MeshError)),
    "geo of cells of no size": (GEO + "Mesh.MeshSizeMax = 0; Mesh.MeshSizeMin = 0;\n", MeshError),
    "geo that exits": (GEO + "Exit;\n", MeshError),
    "geo that refuses": ('Error("too thin");\n', FileFormatError, "too thin"),
    "geo without volume": ("Point(1) = {0, 0, 0};\n", MeshError, "no volume"),
    "geo of zero size": (GEO.replace("1, 1, 1}", "1, 1, 0}"), (FileFormatError, MeshError)),
    "geo without a last newline": (GEO + "Box(2) = {1, 0, 0, 1, 1, 1};", FileFormatError, "last"),
    "empty geo": ("\n", MeshError, "no volume"),
    "geo with an empty surface": (
        GEO + 'Physical Surface("pin", 12) = Surface In BoundingBox{5, 5, 5, 6, 6, 6};\n',
        TagError, "physical surface 'pin' is empty"),
    "volume in two groups": (GEO + 'Physical Volume("liner", 2) = {1};\n', TagError, "'liner'"),
    "one of two bodies tagged": (GEO + "Box(2) = {1, 0, 0, 1, 1, 1}; Coherence;\n", TagError,
        "volume 2"),
    "only surfaces tagged, geo": (GEO.replace('Physical Volume("body", 1) = {1};', ""), TagError,
        "['root']"),
    "one name on two tags, geo": (GEO + 'Physical Surface("root", 12) = {2};\n', FileFormatError,
        "surface 11"),
    "one name on two dimensions": (GEO + 'Physical Surface("body", 12) = {2};\n', TagError,
        "surface 12 and physical volume 1"),
    "two bodies, geo": (GEO + 'Box(2) = {1, 0, 0, 1, 1, 1}; Physical Volume("b", 2) = {2};\n',
        MeshError, "BooleanFragments"),
}  # fmt: skip
BUILDERS = {  # text of box.py
    "builder with a syntax error": ("def build(gmsh:\n", FileFormatError, "line 1"),
    "builder without build": ("x = 1\n", FileFormatError, "build(gmsh"),
    "builder that fails": ("def build(gmsh):\n    1 / 0\n", MeshError, "line 2"),
    "builder that needs a value": ("def build(gmsh, lc):\n    pass\n", ConfigError, "'lc'"),
    "builder that dies": ("import os\ndef build(gmsh):\n    os.abort()\n", MeshError, "SIGABRT"),
}  # fmt: skip
CASES = OTHERS | {name: ("box.msh", *row) for name, row in MSH.items()}
for file, table in {"box.geo": GEOS, "box.py": BUILDERS}.items():
    CASES |= {name: (file, text(made), *row) for name, (made, *row) in table.items()}


@pytest.mark.parametrize("case", few(24, CASES))
def test_bad_file_is_a_clear_error_within_seconds(case, tmp_path, monkeypatch, capfd):
    name, make, error, *culprit = CASES[case]
    monkeypatch.chdir(tmp_path)
    make(tmp_path / name)
    start = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rom.RomWarning)
        with pytest.raises(error) as caught:
            read_mesh(name, trust=True)
    assert time.perf_counter() - start < SECONDS
    assert all(word in str(caught.value) for word in culprit)
    places = name, str(Path(name).absolute())
    assert str(caught.value).startswith(places) and caught.value.message.endswith(".")
    assert isinstance(caught.value, RomError) and caught.value.exit_code in (2, 3)
    assert not Path("pwned").exists()
    assert capfd.readouterr() == ("", "")


def test_names_with_blanks_and_umlauts_work_and_a_script_beside_a_mesh_is_not_run(tmp_path):
    """Gmsh executes box.msh.opt when it opens box.msh."""
    folder = tmp_path / "Größe 1"
    folder.mkdir()
    (folder / "Würfel a.msh.opt").write_text(f'SystemCall "touch {tmp_path}/pwned";\n')
    names = [(3, 1, "Körper 1"), (2, 11, "root"), (2, 12, "tip")]
    mesh = read_mesh(write_msh(folder / "Würfel a.msh", BOX.points, BLOCKS, names))
    assert mesh.region_names == {1: "Körper 1"} and len(mesh.cells) == 72
    assert not (tmp_path / "pwned").exists()


def originals(folder):
    """The box in ASCII 2.2, and through gmsh in binary 2.2 and both forms of 4.1."""
    import gmsh

    first = write_msh(folder / "a.msh", BOX.points, BLOCKS, NAMES)
    made = [first]
    gmsh.initialize([], False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.merge(str(first))
        for version, binary in ((2.2, 1), (4.1, 0), (4.1, 1)):
            gmsh.option.setNumber("Mesh.MshFileVersion", version)
            gmsh.option.setNumber("Mesh.Binary", binary)
            made.append(folder / f"{version}-{binary}.msh")
            gmsh.write(str(made[-1]))
    finally:
        gmsh.finalize()
    return made


@pytest.mark.slow
def test_damaged_files_never_crash_or_hang(tmp_path):
    """Gmsh 4.8 dies of SIGSEGV on about one binary file in twenty.

    A changed coordinate is still a mesh: then the result must be a valid one of the same size.
    """
    rng, path = np.random.default_rng(20), tmp_path / "mutant.msh"
    made, refused = originals(tmp_path), 0
    for number in range(MUTANTS):
        path.write_bytes(WAYS[number % len(WAYS)](made[number % 4].read_bytes(), rng))
        start = time.perf_counter()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", rom.RomWarning)
                mesh = read_mesh(path)
        except RomError as error:
            refused += 1
            assert "mutant.msh" in str(error)
        else:
            assert len(mesh.cells) == 72 and np.isfinite(mesh.points).all()
        assert time.perf_counter() - start < SECONDS
    assert 2 / 3 * MUTANTS <= refused < MUTANTS


def test_a_reader_that_dies_is_a_typed_error(monkeypatch, tmp_path):
    """Signals of the child: crash, out of time, killed, Ctrl-C; a geometry is no damaged file."""
    mesh = write_msh(tmp_path / "box.msh", BOX.points, BLOCKS, NAMES)
    geometry = tmp_path / "box.geo"
    geometry.write_text(GEO)
    for signal, of_mesh, of_geometry in (
        (11, FileFormatError, MeshError),
        (24, FileFormatError, rom.ResourceError),
        (9, rom.ResourceError, rom.ResourceError),
        (31, UnsafeFileError, UnsafeFileError),
        (2, KeyboardInterrupt, KeyboardInterrupt),
    ):
        monkeypatch.setattr(child, "run", lambda *a, n=signal, **k: child.Ended(-n))
        for path, error in ((mesh, of_mesh), (geometry, of_geometry)):
            with pytest.raises(error) as caught:
                read_mesh(path)
            assert error is KeyboardInterrupt or str(caught.value).startswith(str(path))
            assert path is mesh or "damaged" not in str(caught.value)
