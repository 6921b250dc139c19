"""Geometries are programs: they end, or are stopped by name."""

from generated.case import Silent, Warned, Works, case, geometry, require, write
from generated.stock import GEO, STEEL
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


CASES = [
    *(case(name, "mesh box.geo", accept, word, fe=True, given=geometry(line))
      for name, (line, accept, word) in STATEMENTS.items()),
    *(case(f"a parameter: {name}", f"mesh box.geo {words} --time-limit 30", accept, word, fe=True)
      for name, (words, accept, word) in PARAMETERS.items()),
    case("a parameter: a number for a text", "mesh box.geo -p word=7", ConfigError, "word", fe=True,
         given=geometry('DefineConstant[ w = {"a", Name "word"} ];')),
    case("a parameter: a text for a text", "mesh box.geo -p word=b", Silent, fe=True,
         given=geometry('DefineConstant[ w = {"a", Name "word"} ];')),
    *(case(f"a builder, rom {line}", f"{line} {STEEL}", UnsafeFileError, "trust", fe=True)
      for line in ("modes build.py", "reduce build.py -i root=rbe2 -o a.npz")),
    case("a builder, rom swing", "swing build.py --hinge root -o out", UnsafeFileError, "trust", fe=True),
    case("a mesh after one that was stopped", again, Works, fe=True),
    case("no limits", "mesh box.geo --time-limit 0 --memory-limit 0", Silent, fe=True),
    case("a geometry cut in a word", "mesh box.geo", (FileFormatError, MeshError), "box.geo", fe=True,
         given=write("box.geo", GEO[:60])),
    case("a geometry of zeros", "mesh box.geo", (FileFormatError, MeshError), "box.geo", fe=True,
         given=write("box.geo", b"\0" * 1000)),
]  # fmt: skip
