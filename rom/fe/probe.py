"""Child process of the doctor: load one library after the other and say what was found.

Each answer is a JSON line of its own, so that those before a crash are not lost.
"""

import json
import os
import re
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from rom.process.memory import mapped_files


def main(arguments: list[str]) -> None:
    """Write one JSON line per library."""
    for name, look in LIBRARIES.items():
        _write(name, partial(_version, look))
    _write("forms", lambda: _forms("--fix" in arguments))
    _write("mapped", lambda: {"value": mapped_files()})


def _version(look: Callable[[], str]) -> dict[str, Any]:
    return {"version": look()}


def _write(name: str, look: Callable[[], dict[str, Any]]) -> None:
    try:
        found = look()
    except ModuleNotFoundError as error:
        found = {"missing": error.name}
    except Exception as error:
        found = {"error": f"{type(error).__name__}: {error}"}
    sys.stdout.write(json.dumps({"name": name, **found}) + "\n")
    sys.stdout.flush()


def _mpi() -> str:
    from mpi4py import MPI

    line = MPI.Get_library_version().split(",")[0].split("\n")[0].strip("\0 ")
    library = re.sub(r" Version:\s+", " ", line)  # as MPICH says it
    return f"{library}, mpi4py {_package('mpi4py')}"


def _petsc() -> str:
    from petsc4py import PETSc

    scalar = PETSc.ScalarType().dtype.name
    return f"{_dotted(PETSc.Sys.getVersion())} ({scalar}, {PETSc.IntType().dtype.name})"


def _mumps() -> str:
    """Factor a matrix of two dofs, then read the version off the file name of the library."""
    from petsc4py import PETSc

    A = PETSc.Mat().createAIJ((2, 2), nnz=2, comm=PETSc.COMM_SELF)
    A.setValues([0, 1], [0, 1], [2.0, 1.0, 1.0, 2.0])
    A.assemble()
    pc = PETSc.PC().create(comm=PETSc.COMM_SELF)
    pc.setOperators(A)
    pc.setType("cholesky")
    pc.setFactorSolverType("mumps")
    pc.setUp()
    named = re.search(r"libdmumps[^/]*?-(\d[\d.]*\d)", "\n".join(mapped_files()))
    return named.group(1) if named else "works"


def _slepc() -> str:
    from slepc4py import SLEPc

    return _dotted(SLEPc.Sys.getVersion())


def _gmsh() -> str:
    import gmsh

    gmsh.initialize([], False)
    try:
        return gmsh.option.getString("General.Version")
    finally:
        gmsh.finalize()


def _package(name: str) -> str:
    return __import__(name).__version__


def _dotted(version: tuple[int, ...]) -> str:
    return ".".join(map(str, version))


LIBRARIES: dict[str, Callable[[], str]] = {
    "MPI": _mpi,
    "PETSc": _petsc,
    "MUMPS": _mumps,
    "SLEPc": _slepc,
    "dolfinx": lambda: _package("dolfinx"),
    "gmsh": _gmsh,
    "h5py": lambda: _package("h5py"),
}


def _forms(fix: bool) -> dict[str, Any]:
    """The cache of compiled forms."""
    from rom.fe.jit import cache_directory, clear_stale_cache, stale_sources

    path = cache_directory()
    stale = clear_stale_cache() if fix else stale_sources()
    writable = os.access(path if path.exists() else Path.home(), os.W_OK)
    return {"path": str(path), "stale": [str(s) for s in stale], "writable": writable}


if __name__ == "__main__":
    main(sys.argv[1:])
