"""The odd cases of the table of faults up to meshes, each by its number there."""

import os

import numpy as np

from cases.files.cells import blocks_of, solid, write_msh
from generated.case import Silent, Warned, Works, case, changed, edit, require, write
from generated.cases_reliability_models import one_thread, scaled
from generated.stock import STEEL
from rom.cli.main import main
from rom.errors import (
    ConfigError,
    FileFormatError,
    MeshError,
    TagError,
)
from rom.fe.mesh.read import read_mesh

BOX, CURVED = solid(), solid("tet10")
BLOCKS, NAMES = blocks_of(BOX)
FILES = (FileFormatError, MeshError)


def msh(points=BOX.points, blocks=BLOCKS, names=NAMES):
    return lambda folder: write_msh(folder / "box.msh", points, blocks, names)


def cells(rows):
    return msh(blocks=[("tet4", 1, 1, np.asarray(rows)), *BLOCKS[1:]])


def moved(node, x, points=BOX.points, blocks=BLOCKS):
    points = points.copy()
    points[node] = x
    return msh(points, blocks)


def pulled():
    """A middle node so far out that its cell turns inside out."""
    cell = CURVED.cells[5]
    return moved(cell[4], 2 * CURVED.points[cell[3]] - CURVED.points[cell[0]], CURVED.points,
                 blocks_of(CURVED)[0])  # fmt: skip


def joined(at, nodes):
    """A second box that shares only some nodes with the first."""
    number = np.arange(len(BOX.points)) + len(BOX.points)
    for k, x in enumerate(BOX.points + at):
        same = np.flatnonzero(np.abs(BOX.points - x).max(axis=1) < 1e-9)
        if same.size and (x[2] == 0 or nodes > 1):
            number[k] = same[0]
    return msh(np.vstack([BOX.points, BOX.points + at]),
               [("tet4", 1, 1, np.vstack([BOX.cells, number[BOX.cells]]))], NAMES[:1])  # fmt: skip


def gaps(folder):
    """Labels of nodes with gaps: the same mesh."""
    lines = (folder / "box.msh").read_text().splitlines()
    start, cells_at = lines.index("$Nodes") + 2, lines.index("$Elements") + 2
    for k in range(start, lines.index("$EndNodes")):
        first, *rest = lines[k].split()
        lines[k] = " ".join([str(7 * int(first) + 3), *rest])
    for k in range(cells_at, lines.index("$EndElements")):
        words = lines[k].split()
        head = 3 + int(words[2])
        lines[k] = " ".join(words[:head] + [str(7 * int(x) + 3) for x in words[head:]])
    plain = read_mesh(folder / "box.msh")
    (folder / "box.msh").write_text("\n".join(lines) + "\n")
    require(np.allclose(read_mesh(folder / "box.msh").points, plain.points), "another mesh")


def orphan(folder):
    """A node of no cell: the same mesh."""
    msh(np.vstack([BOX.points, [[9, 9, 9]]]))(folder)
    require(len(read_mesh(folder / "box.msh").points) == 36, "another mesh")


def elsewhere(folder):
    """Paths in a file start where the file is."""
    (folder / "other").mkdir()
    os.chdir(folder / "other")
    code = main(["reduce", "../part.toml", "-o", "../a.npz", "-q"])
    os.chdir(folder)
    require(code == 0 and (folder / "a.npz").is_file(), f"exit code {code}")


THIN = solid(counts=(10, 10, 1), size=(1.0, 1.0, 1e-2))
CASES = [
    case("A01", "reduce part.toml -o a.npz", ConfigError, "certificat", "Did you mean certificate?",
         given=edit("part.toml", "certificate =", "certificat =")),
    case("A03", "reduce part.toml -o a.npz", ConfigError, "mass", "part.toml:5",
         given=edit("part.toml", 'mass = "M.mtx"', 'mass = "M.mtx"\nmass = "M.mtx"')),
    case("A07", "reduce solid.toml -o a.npz", ConfigError, "E", given=edit("solid.toml", '"210 GPa"', '"2.1e11"')),
    case("A11", elsewhere, Works),
    case("A13", "reduce part.toml -o a.npz", (ConfigError, FileFormatError), ("part.toml",),
         given=write("part.toml", b"\x7fELF" + bytes(99))),
    case("B01", "mesh nope.msh", FileFormatError, "nope.msh", fe=True),
    case("B03", "mesh box.msh", FILES, "box.msh", fe=True,
         given=changed("box.msh", lambda data: data[:1300])),
    case("B05", "mesh box.msh", FILES, "box.msh", given=write("box.msh", b"PK\3\4zip"), fe=True),
    case("B07", "mesh box.msh", Silent, fe=True),
    case("B09", "mesh box.msh", (Warned, TagError, Silent), "group", given=msh(blocks=BLOCKS[:1], names=[]), fe=True),
    case("B11", "mesh box.geo", TagError, "'body' and 'liner'", fe=True,
         given=edit("box.geo", "Mesh.", 'Physical Volume("liner", 2) = {1};\nMesh.')),
    case("B13", "mesh box.geo", (TagError, Silent), "'left'", fe=True,
         given=edit("box.geo", "Mesh.", 'Physical Surface("left", 12) = {1};\nMesh.')),
    case("B15 two tags", "mesh box.msh", TagError, "root", given=msh(names=[*NAMES[:2], (2, 12, "root")]), fe=True),
    case("B15 two dimensions", "mesh box.msh", TagError, "body", given=msh(names=[*NAMES[:2], (2, 12, "body")]), fe=True),
    case("B17", "mesh box.msh", MeshError, "box.msh", given=msh(blocks=[], names=[]), fe=True),
    case("B19", gaps, Works, fe=True),
    case("B21", "mesh box.msh", MeshError, "box.msh", fe=True,
         given=msh(blocks=[("tri3", 1, 1, BLOCKS[1][3])], names=[(2, 1, "skin")])),
    case("B23", "mesh a.stl", (ConfigError, FileFormatError), "a.stl", given=write("a.stl", "solid\nendsolid\n"), fe=True),
    case("C01", "mesh box.msh", MeshError, "73", given=cells(np.vstack([BOX.cells, BOX.cells[7:8]])), fe=True),
    case("C03", "mesh box.msh", MeshError, "cells 6", fe=True,
         given=moved(BOX.cells[5, 3], BOX.points[BOX.cells[5, :3]].mean(axis=0))),
    case("C05 beyond", "mesh box.msh", FILES, "5001", given=cells(np.vstack([BOX.cells, [[0, 1, 2, 5000]]])), fe=True),
    case("C05 negative", "mesh box.msh", FILES, "-6", given=cells(np.vstack([BOX.cells, [[0, 1, 2, -7]]])), fe=True),
    case("C07", "mesh box.msh", MeshError, "inverted", given=pulled(), fe=True),
    case("C09", orphan, Works, fe=True),
    case("C11 point", "mesh box.msh", (MeshError, Warned), "point", given=joined((3, 1, 1), 9), fe=True),
    case("C11 edge", "mesh box.msh", (MeshError, Warned), "edge", given=joined((3, 1, 0), 9), fe=True),
    case("C13 small", scaled(1e-9), Works),
    case("C13 large", scaled(1e6), Works),
    case("C15", one_thread(3), Works, fe=True, seconds=60),
    case("C17", f"modes box.msh {STEEL} --degree 1 -n 7", Warned, "lock", fe=True,
         given=lambda folder: write_msh(folder / "box.msh", THIN.points, *blocks_of(THIN))),
]  # fmt: skip
