"""Sizes beyond all bounds are refused at once, before memory or time are spent."""

import zipfile

import numpy as np

import rom
from generated.case import case, write
from generated.stock import MATRICES, pendulum
from rom.errors import ConfigError, FileFormatError, InterfaceError, MeshError, ResourceError

HUGE = 10**12
SIZES = (ConfigError, ResourceError, rom.ModelError)
REDUCE = f"reduce {MATRICES} -o a.npz"
LINES = {
    "modes": (REDUCE.replace("-m 4", f"-m {HUGE}"), f"{HUGE}"),
    "modes of five thousand digits": (REDUCE.replace("-m 4", "-m " + 5000 * "9"), "999"),
    "labels beyond integers": (f"{REDUCE} --set root={10**30}", "1000000"),
    "characteristic modes": (f"{REDUCE} --characteristic {HUGE}".replace("rbe2", "full"), f"{HUGE}"),
    "polynomials": (REDUCE.replace("rbe2", f"polynomial:{HUGE}"), f"order {HUGE} on interface 'root'"),
    "harmonics": (REDUCE.replace("rbe2", f"fourier:{HUGE},1"), f"{HUGE} harmonics"),
    "steps": ("simulate pendulum.toml --t-end 1e9 --dt 1e-9 -o out", "1e+18"),
    "an end beyond numbers": ("simulate pendulum.toml --t-end 1e308 -o out", "t_end"),
}  # fmt: skip
CALLS = {
    "mass": (lambda: moved(mass=1e308), ("bob", "mass", "t = ")),
    "distances": (lambda: moved(at=(1e200, 0, 0)), ("bob", "hinge")),
    "speeds": (lambda: moved(omega=(0, 0, 1e200)), ("t = ", "omega")),
    "gravity": (lambda: falling(1e300), ("gravity", "t = ")),
}  # fmt: skip
HEADER = "%%MatrixMarket matrix coordinate real general\n"
TEXTS = {
    "a dense matrix": (HEADER.replace("coordinate", "array") + f"{10**6} {10**6}\n1.0\n", "K.mtx"),
    "a line": (HEADER + "9" * 10**6 + "\n", "K.mtx"),
}


def moved(**bob):
    """The pendulum, with other numbers, after a tenth of a second."""
    return rom.simulate(pendulum(**bob), t_end=0.1, dt=0.01)


def falling(g):
    """A stone that falls, faster than numbers go."""
    mech = rom.Mechanism(gravity=(0, 0, -g))
    mech.add_rigid("stone", mass=1e10, inertia=(1.0,) * 3, at=(0, 0, 0))
    return rom.simulate(mech, t_end=0.1, dt=0.01)


def bomb(folder):
    """A gigabyte of zeros in a megabyte."""
    with zipfile.ZipFile(folder / "good.npz", "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive, \
            archive.open("K.npy", "w", force_zip64=True) as file:  # fmt: skip
        np.lib.format.write_array_header_1_0(
            file, {"descr": "<f8", "fortran_order": False, "shape": (2**27,)}
        )
        for _ in range(2**6):
            file.write(bytes(2**24))


def members(folder):
    """A body of twenty thousand arrays."""
    with zipfile.ZipFile(folder / "good.npz", "w") as archive:
        for k in range(20_000):
            archive.writestr(f"a{k}.npy", b"")


def sparse(name):
    """A file of ten gigabytes that takes no place."""

    def prepare(folder):
        with (folder / name).open("wb") as file:
            file.truncate(10**10)

    return prepare


REFUSED = (FileFormatError, rom.UnsafeFileError, ConfigError, MeshError, ResourceError)
CASES = [
    *(case(f"{name} on a line", line, (*SIZES, InterfaceError, FileFormatError), *words)
      for name, (line, *words) in LINES.items()),
    *(case(f"{name} in a call", lambda folder, f=f: f(), (*SIZES, InterfaceError, rom.errors.SolverError), *words)
      for name, (f, *words) in CALLS.items()),
    *(case(f"{name} in a matrix file", REDUCE, REFUSED, *words,
           given=write("K.mtx", text)) for name, (text, *words) in TEXTS.items()),
    case("a body that unpacks to a gigabyte", "check good.npz", REFUSED, "good.npz", given=bomb),
    case("a body of many arrays", "check good.npz", REFUSED, "good.npz", given=members),
    *(case(f"ten gigabytes as {name}", line, REFUSED, name, given=sparse(name), fe="mesh" in line)
      for name, line in {"good.npz": "check good.npz", "good.SID_FEM": "check good.SID_FEM",
                         "pendulum.toml": "simulate pendulum.toml -o out",
                         "K.mtx": REDUCE, "box.msh": "mesh box.msh",
                         "deck.inp": REDUCE}.items()),
]  # fmt: skip
