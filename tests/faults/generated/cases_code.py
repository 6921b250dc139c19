"""Code that lies in the working folder, or comes in a file that should hold none, is not run."""

import io
import zipfile

import numpy as np

from generated.case import Silent, arrays_changed, case
from generated.stock import STEEL
from rom.errors import ConfigError, FileFormatError, UnsafeFileError

OPENED = (UnsafeFileError, FileFormatError)


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


TRUST = ("trust",)
CASES = [
    case("a builder, rom modes", f"modes build.py {STEEL}", UnsafeFileError, *TRUST, fe=True),
    case("a builder, rom reduce", f"reduce build.py {STEEL} -i root=rbe2 -o a.npz",
         UnsafeFileError, *TRUST, fe=True),
    case("a builder, rom swing", "swing build.py --hinge root -o out", UnsafeFileError, *TRUST,
         fe=True),
    *(case(f"a pickle as {member}", "check good.npz", UnsafeFileError, "good.npz",
           given=pickled(member)) for member in ("K", "mass", "manifest")),
    case("a pickle that nothing names", "check good.npz", Silent, given=pickled("extra")),
    *(case(f"a member named {member}", "check good.npz", OPENED, "good.npz",
           given=renamed(member)) for member in ("../pwned.npy", "/nowhere/pwned.npy", "a\\b.npy")),
    case("a script as a body", "check build.py", FileFormatError, "build.py"),
    case("a script as a component", "reduce build.toml -o a.npz", (ConfigError, FileFormatError),
         "build.toml", given=lambda folder: (folder / "build.py").rename(folder / "build.toml")),
]  # fmt: skip
