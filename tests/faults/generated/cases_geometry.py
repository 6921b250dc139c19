"""Geometries are programs: they end, within time and memory, or are stopped by name."""

from generated.case import Silent, Warned, Works, case, edit, require, write
from generated.stock import GEO
from rom.errors import (
    ConfigError,
    FileFormatError,
    MeshError,
    ResourceError,
    RomError,
    TagError,
    UnsafeFileError,
)
from rom.fe.mesh import read_mesh

ENDLESS = {
    "a loop": "For i In {1 : 1e9}\n  x = Sqrt(i);\nEndFor",
    "loops in loops": "For i In {1 : 1e5}\nFor j In {1 : 1e5}\n  x = i + j;\nEndFor\nEndFor",
    "a macro that calls itself": "Macro m\n  x = 1;\n  Call m;\nReturn\nCall m;",
    "a file that includes itself": 'Include "box.geo";',
}
LARGE = {
    "a tiny element size": "lc = 1e-4;",
    "a list that grows": "x() = {1 : 1e5};\nFor i In {1 : 1e5}\n  x() = {x(), x()};\nEndFor",
    "a huge list": "x() = {1 : 4e9};",
}
STATEMENTS = {  # one statement more, and what is told
    "no brace": ("Box(2) = {0, 0, 0;", (FileFormatError,), "box.geo"),
    "no semicolon": ("x = 1", (FileFormatError,), "box.geo"),
    "an unknown variable": ("x = yy + 1;", (FileFormatError,), "yy"),
    "an unknown function": ("x = Foo(1);", (FileFormatError,), "Foo"),
    "a box twice": ("Box(1) = {0, 0, 0, 1, 1, 1};", (FileFormatError, MeshError), "box.geo"),
    "a box without volume": (
        "Box(2) = {0, 0, 0, 0, 1, 1};",
        (FileFormatError, MeshError),
        "box.geo",
    ),
    "a surface that is not there": (
        'Physical Surface("a", 12) = {99};',
        (FileFormatError, TagError, MeshError),
        "'a'",
    ),
    "a volume that is not there": (
        'Physical Volume("a", 12) = {99};',
        (FileFormatError, TagError, MeshError),
        "'a'",
    ),
    "an empty surface": ('Physical Surface("pin", 12) = {};', (TagError, FileFormatError), "pin"),
    "a name twice": ('Physical Surface("root", 12) = {2};', (TagError, FileFormatError), ("root", "surface 11")),
    "a volume in two groups": ('Physical Volume("liner", 2) = {1};', (TagError,), "liner"),
    "a file that is not there": ('Include "nope.geo";', (FileFormatError,), "nope.geo"),
    "a merged file that is not there": (
        'Merge "nope.step";',
        (FileFormatError, UnsafeFileError),
        ("nope.step", "Merge"),
    ),
    "an error of its own": ('Error("too thin");', (FileFormatError,), "too thin"),
    "the end": ("Exit;", (FileFormatError, MeshError, TagError, Silent, Warned), "box.geo"),
    "abort": ("Abort;", (FileFormatError, MeshError, TagError, Silent, Warned), "box.geo"),
    "a division by zero": (
        "x = 1/0; Box(2) = {5, 0, 0, x, 1, 1};",
        (FileFormatError, MeshError),
        "box.geo",
    ),
    "a mesh of its own": ("Mesh 3;", (FileFormatError, MeshError, Silent, Warned), "box.geo"),
    "deletes all": ("Delete All;", (FileFormatError, MeshError, TagError), "box.geo"),
    "another algorithm": ("Mesh.Algorithm3D = 10;", (Silent, Warned), "Algorithm"),
    "an order of nine": (
        "Mesh.ElementOrder = 9;",
        (FileFormatError, MeshError, Silent, Warned),
        "box.geo",
    ),
}
PARAMETERS = {
    "unknown": ("-p lcc=1", ConfigError, "lcc"),
    "text for a number": ("-p lc=small", ConfigError, "lc"),
    "zero": ("-p lc=0", (ConfigError, MeshError, FileFormatError, Silent, Warned), "lc"),
    "negative": ("-p lc=-1", (ConfigError, MeshError, FileFormatError, Silent, Warned), "lc"),
    "not a number": ("-p lc=nan", ConfigError, "lc"),
    "infinite": ("-p lc=inf", ConfigError, "lc"),
    "without a name": ("-p =1", ConfigError, "=1"),
    "code": ("""-p 'lc=1;SystemCall "touch pwned";'""", ConfigError, "lc"),
    "code in the name": ("""-p 'lc=1;SystemCall"touch pwned";//=1'""", ConfigError, "lc"),
}


def geometry(line):
    """One more statement in the geometry."""
    return edit("box.geo", "Mesh.MeshSizeMin", f"{line}\nMesh.MeshSizeMin")


def within(**limits):
    """A mesh within a limit given in Python."""
    return lambda folder: read_mesh(folder / "box.geo", **limits)


def again(folder):
    """A mesher that was stopped leaves the next one alone."""
    try:
        read_mesh(folder / "box.geo", parameters={"lc": 1e-4}, time_limit=1.0)
    except RomError:
        require(len(read_mesh(folder / "box.geo").cells) == 24, "another mesh")


CASES = [
    *(case(name, "mesh box.geo --time-limit 2", (ResourceError, FileFormatError), "box.geo", fe=True,
           given=geometry(line)) for name, line in ENDLESS.items()),
    *(case(f"{name} within time", "mesh box.geo --time-limit 2", (ResourceError, FileFormatError),
           "box.geo", fe=True, given=geometry(line)) for name, line in LARGE.items()),
    *(case(f"{name} within memory", "mesh box.geo --memory-limit 0.7 --time-limit 5",
           (ResourceError, FileFormatError), "box.geo", fe=True, given=geometry(line))
      for name, line in LARGE.items()),
    *(case(name, "mesh box.geo", accept, word, fe=True, given=geometry(line))
      for name, (line, accept, word) in STATEMENTS.items()),
    *(case(f"a parameter: {name}", f"mesh box.geo {words} --time-limit 5", accept, word, fe=True)
      for name, (words, accept, word) in PARAMETERS.items()),
    case("a time limit in Python", within(time_limit=1.0, parameters={"lc": 1e-4}), ResourceError,
         "box.geo", fe=True),
    case("a memory limit in Python", within(memory_limit=7e8), ResourceError, "box.geo", fe=True,
         given=geometry(LARGE["a huge list"])),
    case("a mesh after one that was stopped", again, Works, fe=True),
    *(case(f"a time limit of {x}", f"mesh box.geo --time-limit={x}", ConfigError, x, fe=True)
      for x in ("-1", "nan", "soon")),
    *(case(f"a memory limit of {x}", f"mesh box.geo --memory-limit={x}", ConfigError, x, fe=True)
      for x in ("-1", "nan", "2GB")),
    case("no limits", "mesh box.geo --time-limit 0 --memory-limit 0", Silent, fe=True),
    case("a geometry cut in a word", "mesh box.geo", (FileFormatError, MeshError), "box.geo", fe=True,
         given=write("box.geo", GEO[:60])),
    case("a geometry of zeros", "mesh box.geo", (FileFormatError, MeshError), "box.geo", fe=True,
         given=write("box.geo", b"\0" * 1000)),
    case("an empty geometry", "mesh box.geo", (FileFormatError, MeshError), "box.geo", fe=True,
         given=write("box.geo", "")),
]  # fmt: skip
