"""Geometries are programs: they end, or are stopped by name; and damaged meshes crash nothing."""

import numpy as np

from cases.files.cells import blocks_of, solid, write_msh
from cases.files.damage import WAYS
from generated.case import Silent, Warned, Works, case, edit, geometry, mutated, require, write
from generated.stock import GEO, deck
from rom.errors import ConfigError, FileFormatError, MeshError, RomError, TagError, UnsafeFileError
from rom.fe.mesh.read import read_mesh

BROKEN, LOST = (FileFormatError, MeshError), (FileFormatError, TagError, MeshError)
STATEMENTS = {  # one statement more, and what is told
    "a box twice": ("Box(1) = {0, 0, 0, 1, 1, 1};", BROKEN, "box.geo"),
    "a surface that is not there": ('Physical Surface("a", 12) = {99};', LOST, "'a'"),
    "a volume that is not there": ('Physical Volume("a", 12) = {99};', LOST, "'a'"),
    "a file that is not there": ('Include "nope.geo";', FileFormatError, "nope.geo"),
    "a merged file that is not there": ('Merge "nope.step";', FileFormatError, ("nope.step", "Merge")),
    "a division by zero": ("x = 1/0; Box(2) = {5, 0, 0, x, 1, 1};", BROKEN, "box.geo"),
    "a mesh of its own": ("Mesh 3;", (*BROKEN, Silent, Warned), "box.geo"),
    "deletes all": ("Delete All;", LOST, "box.geo"),
    "another algorithm": ("Mesh.Algorithm3D = 10;", (Silent, Warned), "Algorithm"),
    "an order of nine": ("Mesh.ElementOrder = 9;", (*BROKEN, Silent, Warned), "box.geo"),
}  # fmt: skip
PARAMETERS = {
    "text for a number": ("-p lc=small", ConfigError, "lc"),
    "zero": ("-p lc=0", (ConfigError, MeshError, FileFormatError, Silent, Warned), "lc"),
    "negative": ("-p lc=-1", (ConfigError, MeshError, FileFormatError, Silent, Warned), "lc"),
    "not a number": ("-p lc=nan", ConfigError, "lc"),
    "infinite": ("-p lc=inf", ConfigError, "lc"),
    "without a name": ("-p =1", ConfigError, "=1"),
    "code": ("""-p 'lc=1;SystemCall "touch pwned";'""", ConfigError, "lc"),
    "code in the name": ("""-p 'lc=1;SystemCall"touch pwned";//=1'""", ConfigError, "lc"),
}


def again(folder):
    """A mesher that was stopped leaves the next one alone."""
    try:
        read_mesh(folder / "box.geo", parameters={"lc": 1e-4}, time_limit=1.0)
    except RomError:
        require(len(read_mesh(folder / "box.geo").cells) == 24, "another mesh")


BOX = solid()
BLOCKS, NAMES = blocks_of(BOX)
CELLS = BOX.cells
BELOW = next(k for k, row in enumerate(CELLS) if set(BLOCKS[1][3][0]) <= set(row))
FILE = (FileFormatError, MeshError, TagError, UnsafeFileError)
MUTANTS = 3  # of each format
TEXTS = {  # text of the mesh of the stock, another one, and what it is
    "no format": ("$MeshFormat", "$MshFormat"),
    "no end": ("$EndElements", ""),
    "no nodes": ("$Nodes", "$Notes"),
    "a node too many": ("$Nodes\n36", "$Nodes\n37"),
    "nodes without number": ("$Nodes\n36", "$Nodes\nmany"),
    "a negative number of nodes": ("$Nodes\n36", "$Nodes\n-36"),
    "a decimal comma": ("1 0.0 0.0 0.0", "1 0,0 0,0 0,0"),
}
ROWS = {  # cells in place of those of the box
    "one cell less, below a named facet": (np.delete(CELLS, BELOW, axis=0), "root"),
    "an inverted cell": (np.vstack([CELLS[:-1], CELLS[-1:, [1, 0, 2, 3]]]), "box.msh"),
}


def msh(points=BOX.points, blocks=BLOCKS, names=NAMES):
    return lambda folder: write_msh(folder / "box.msh", points, blocks, names)


def cells(rows):
    return msh(blocks=[("tet4", 1, 1, rows), *BLOCKS[1:]])


def moved(node, x):
    points = BOX.points.copy()
    points[node] = x
    return msh(points)


def valid(name):
    """A mesh that is read is one of finite numbers."""

    def act(folder):
        mesh = read_mesh(folder / name)
        require(np.isfinite(mesh.points).all() and len(mesh.cells), "no mesh")

    return act


CASES = [
    *(case(name, "mesh box.geo", accept, word, fe=True, given=geometry(line))
      for name, (line, accept, word) in STATEMENTS.items()),
    *(case(f"a parameter: {name}", f"mesh box.geo {words} --time-limit 5", accept, word, fe=True)
      for name, (words, accept, word) in PARAMETERS.items()),
    case("a parameter: a number for a text", "mesh box.geo -p word=7", ConfigError, "word", fe=True,
         given=geometry('DefineConstant[ w = {"a", Name "word"} ];')),
    case("a parameter: a text for a text", "mesh box.geo -p word=b", Silent, fe=True,
         given=geometry('DefineConstant[ w = {"a", Name "word"} ];')),
    case("a mesh after one that was stopped", again, Works, fe=True),
    case("no limits", "mesh box.geo --time-limit 0 --memory-limit 0", Silent, fe=True),
    case("a geometry cut in a word", "mesh box.geo", (FileFormatError, MeshError), "box.geo", fe=True,
         given=write("box.geo", GEO[:60])),
    case("a geometry of zeros", "mesh box.geo", (FileFormatError, MeshError), "box.geo", fe=True,
         given=write("box.geo", b"\0" * 1000)),
    *(case(name, "mesh box.msh", FILE, "box.msh", given=edit("box.msh", *texts), fe=True)
      for name, texts in TEXTS.items()),
    *(case(name, "mesh box.msh", (MeshError, FileFormatError, TagError), word, given=cells(rows),
           fe=True) for name, (rows, word) in ROWS.items() if name != "an inverted cell"),
    case("an inverted cell", "mesh box.msh", (MeshError, Silent, Warned), "box.msh",
         given=cells(ROWS["an inverted cell"][0]), fe=True),
    case("a coordinate of 1e308", "mesh box.msh", FILE, "box.msh", given=moved(9, [1e308, 0, 0]), fe=True),
    *(case(f"damaged deck, {k}", valid("box.inp"), (*FILE, Silent, Warned, ConfigError), "box.inp",
           given=mutated("box.inp", WAYS[k % 5], k), fe=True) for k in range(MUTANTS)),
    case("a deck as a mesh", "mesh box.msh", FILE, "box.msh", fe=True,
         given=lambda folder: deck(folder / "box.msh", BOX)),
]  # fmt: skip
