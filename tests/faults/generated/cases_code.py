"""Code that lies in the working folder, or comes in a file that should hold none, is not run."""

import io
import json
import os
import zipfile
from importlib.util import find_spec

import numpy as np

import rom
from generated.case import (
    Silent,
    Warned,
    Works,
    arrays_changed,
    case,
    edit,
    geometry,
    require,
    write,
)
from generated.stock import PLANTED, STEEL
from rom.errors import ConfigError, FileFormatError, ResourceError, UnsafeFileError

PLANT = (
    f"import os\nopen(os.path.join({{folder!r}}, {PLANTED!r}), 'w').close()\nraise SystemExit(9)"
)
MESHING = ("numpy", "json", "resource", "signal", "tempfile", "gmsh", "random", "struct", "rom",
           "sitecustomize", "usercustomize", "logging", "re", "ctypes")  # fmt: skip
DRAWING = ("numpy", "pyvista", "vtk", "matplotlib", "json", "rom")
SHELLS = {  # how a geometry of gmsh runs a program, or writes a file
    "SystemCall": 'SystemCall "touch pwned";',
    "NonBlockingSystemCall": 'NonBlockingSystemCall "touch pwned";',
    "SystemCall in brackets": 'SystemCall("touch pwned");',
    "SystemCall in a branch": 'If (1)\n  SystemCall "touch pwned";\nEndIf',
    "SystemCall after a comment": '/* a */ SystemCall "touch pwned"; // b',
    "SystemCall in a macro": 'Macro m\n  SystemCall "touch pwned";\nReturn\nCall m;',
    "SystemCall over two lines": 'SystemCall\n  "touch pwned";',
    "SystemCall behind a string": 'Printf("a // b"); SystemCall "touch pwned";',
    "SystemCall from a string": 's = Str("touch pwned"); SystemCall s;',
    "OnelabRun": 'OnelabRun("touch", "touch pwned");',
}
WRITES = {
    "Printf into a file": 'Printf("a") > "pwned";',
    "Printf behind a file": 'Printf("a") >> "pwned";',
    "Save": 'Save "pwned.msh";',
    "Print": 'Print "pwned.msh";',
    "CreateDir": 'CreateDir "pwned";',
}
OPENED = (UnsafeFileError, FileFormatError)


def planted(*modules):
    """Modules of these names that leave a file when they are imported."""

    def prepare(folder):
        for name in modules:
            (folder / f"{name}.py").write_text(PLANT.format(folder=str(folder)))

    return prepare


def home(folder):
    """The folder as the home of the user, where gmsh looks for its options."""
    os.environ["HOME"] = str(folder)


def pickled(member):
    """An object array in the body file."""
    objects = np.array([{"a": 1}], dtype=object)
    return arrays_changed("good.npz", lambda arrays: arrays.update({member: objects}))


def renamed(member):
    """A member of another name in the body file."""

    def prepare(folder):
        with zipfile.ZipFile(folder / "good.npz", "a") as archive:
            data = io.BytesIO()
            np.save(data, np.ones(3))
            archive.writestr(member, data.getvalue())

    return prepare


def trusted(folder):
    """A builder that is trusted is run."""
    material = rom.Material(E=210e9, nu=0.3, rho=7850.0)
    require(rom.fe.model(folder / "build.py", material=material, degree=1, trust=True).n_dofs, "")


def untrusted(folder):
    material = rom.Material(E=210e9, nu=0.3, rho=7850.0)
    rom.fe.model(folder / "build.py", material=material, degree=1)


def compiled(folder):
    """What dolfinx reads from the working folder must not change how forms are compiled."""
    (folder / "dolfinx_jit_parameters.json").write_text(
        json.dumps({"cffi_extra_compile_args": ["-O3", "-fpwned"]})
    )


TRUST = ("trust",)
CASES = [
    *(case(f"{len(names)} modules beside {name}", f"mesh {name}", Silent, given=planted(*names), fe=True)
      for name, names in {"box.msh": MESHING, "box.inp": (*MESHING, "meshio"), "box.geo": MESHING}.items()),
    *(case(f"{name}.py beside a mesh", "mesh box.msh", Silent, given=planted(name), fe=True)
      for name in ("numpy", "gmsh", "rom", "sitecustomize")),
    case("all of them beside a picture", "view good.npz -o a.png",
         Silent if find_spec("pyvista") else ResourceError, given=planted(*DRAWING), seconds=40),
    case("all of them beside a report", "report good.npz -o a.html", Silent,
         given=planted(*DRAWING), seconds=40),
    *(case(f"{name} in a geometry", "mesh box.geo", UnsafeFileError, name.split()[0],
           given=geometry(line), fe=True) for name, line in SHELLS.items()),
    *(case(f"{name} in a geometry", "mesh box.geo", (UnsafeFileError, Works), name.split()[0],
           given=geometry(line), fe=True) for name, line in WRITES.items()),
    case("a geometry that speaks of SystemCall in a comment", "mesh box.geo", Silent,
         given=geometry("// SystemCall is refused"), fe=True),
    case("SystemCall in an included file", "mesh box.geo", UnsafeFileError, "SystemCall",
         given=(geometry('Include "more.geo";'), write("more.geo", SHELLS["SystemCall"] + "\n")),
         fe=True),
    case("SystemCall in a merged file", "mesh box.geo", UnsafeFileError, ("SystemCall", "Merge"),
         given=(geometry('Merge "more.geo";'), write("more.geo", SHELLS["SystemCall"] + "\n")),
         fe=True),
    *(case(f"{name} beside a mesh", "mesh box.msh", Silent, fe=True,
           given=(home, write(name, SHELLS["SystemCall"] + "\n")))
      for name in ("box.msh.opt", ".gmshrc", ".gmsh-options")),
    case("a builder, rom mesh", "mesh build.py", UnsafeFileError, *TRUST, fe=True),
    case("a builder, rom modes", f"modes build.py {STEEL}", UnsafeFileError, *TRUST, fe=True),
    case("a builder, rom reduce", f"reduce build.py {STEEL} -i root=rbe2 -o a.npz",
         UnsafeFileError, *TRUST, fe=True),
    case("a builder, rom swing", "swing build.py --hinge root -o out", UnsafeFileError, *TRUST,
         fe=True),
    case("a builder in a component file", "mesh solid.toml", UnsafeFileError, *TRUST, fe=True,
         given=edit("solid.toml", "box.msh", "build.py")),
    case("a builder in Python", untrusted, UnsafeFileError, *TRUST, fe=True),
    case("a builder with --trust", "mesh build.py --trust", Works, fe=True),
    case("a builder with trust=True", trusted, Works, fe=True),
    case("options of dolfinx beside a mesh", f"modes box.msh {STEEL} -n 7", (Works, Warned),
         given=compiled, fe=True),
    *(case(f"a pickle as {member}", "check good.npz", UnsafeFileError, "good.npz",
           given=pickled(member)) for member in ("K", "mass", "manifest")),
    case("a pickle that nothing names", "check good.npz", Silent, given=pickled("extra")),
    *(case(f"a member named {member}", "check good.npz", OPENED, "good.npz",
           given=renamed(member)) for member in ("../pwned.npy", "/nowhere/pwned.npy", "a\\b.npy")),
    case("a script as a body", "check build.py", FileFormatError, "build.py"),
    case("a script as a component", "reduce build.toml -o a.npz", (ConfigError, FileFormatError),
         "build.toml", given=lambda folder: (folder / "build.py").rename(folder / "build.toml")),
]  # fmt: skip
