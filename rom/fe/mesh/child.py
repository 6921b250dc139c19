"""Reads a mesh in a process of its own.

gmsh stops the whole process on several broken files, a hostile one can exhaust the memory, and its
compiled loops do not hear Ctrl-C. All of that ends with the child; the parent reports it as a
typed error. The result returns as an ``.npz`` without pickles.
"""

import json
import math
import sys
from importlib import import_module
from pathlib import Path

import numpy as np

from rom import errors
from rom.arguments import not_negative
from rom.errors import (
    ConfigError,
    FileFormatError,
    ResourceError,
    RomError,
    UnsafeFileError,
    in_file,
)
from rom.fe import GMSH_LIBRARIES
from rom.fe.mesh.solid import GEOMETRIES, Read, Request
from rom.fe.mesh.sources.builder import unmeshable
from rom.process import child
from rom.process.memory import total_bytes

BYTES_PER_MEGABYTE, BYTES_PER_GIGABYTE = 2**20, 1e9
MESHER_TIME_LIMIT = 1800.0  # [s]
WRITE_AGAIN = "The file is damaged; write it again."
MAX_MEMORY_SHARE = 0.8  # of the memory of the machine, for a mesher
# LC_ALL: gmsh reads decimal points with the locale of the process
VARIABLES = {"OMP_NUM_THREADS": "1", "LC_ALL": "C.UTF-8"}


def read_apart(
    request: Request,
    *,
    where: str,
    size: int,
    time_limit: float | None = None,
    memory_limit: float | None = None,
) -> Read:
    """Run `read` in a child process: what a request asks for that fits into JSON.

    The size of the file [bytes] sets the limits for finished meshes, the others are those of a
    mesher, 0 or infinity for none. Raised is what the reader raised, or what its end means.
    """
    limits = _limits(request["reader"], size, time_limit, memory_limit)
    with child.scratch("mesh") as folder, in_file(where):
        try:
            text = json.dumps(request | {"folder": str(folder)}, default=_plain)
        except TypeError as error:
            raise ConfigError(f"parameters must be numbers or text: {error}.") from None
        (folder / "request.json").write_text(text)
        command = child.python("rom.fe.mesh.child", str(folder))
        done = child.run(command, limits=limits, variables=VARIABLES)
        return _result(folder, done, request, limits)


def _plain(value: object) -> object:
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    raise TypeError(f"got {value!r}")


def _limits(
    reader: str, size: int, time_limit: float | None, memory_limit: float | None
) -> child.Limits:
    """Those of a mesher are chosen; those of a finished mesh follow from its size."""
    if reader in GEOMETRIES:
        seconds = _chosen("time_limit", time_limit, MESHER_TIME_LIMIT)
        return child.Limits(
            seconds=seconds,
            # of what a killed parent has left behind, where nothing else ends it
            processor=2 * math.ceil(seconds),
            memory=int(_chosen("memory_limit", memory_limit, MAX_MEMORY_SHARE * total_bytes())),
        )
    # measured: 0.08 s per megabyte and 10 bytes per byte; the rest is reserve
    return child.Limits(
        processor=10 + 3 * size // BYTES_PER_MEGABYTE, memory=2048 * BYTES_PER_MEGABYTE + 100 * size
    )


def _chosen(name: str, value: float | None, default: float) -> float:
    """A limit; 0 for none."""
    if value is None:
        return default
    return 0.0 if value == math.inf else not_negative(name, value)


def _result(folder: Path, done: child.Ended, request: Request, limits: child.Limits) -> Read:
    answer = folder / "answer.json"
    if not answer.exists():
        raise _died(done, request, limits)
    notes = json.loads(answer.read_text())
    if notes.get("error") == MemoryError.__name__:
        raise _too_large(request, limits)
    if "error" in notes:
        raise getattr(errors, notes.pop("error"))(notes.pop("message"), **notes)
    with np.load(folder / "arrays.npz", allow_pickle=False) as arrays:
        return dict(arrays), notes


def _died(done: child.Ended, request: Request, limits: child.Limits) -> BaseException:
    """What a reader without an answer means."""
    if done.overtime or done.signal == "SIGXCPU":
        return _too_long(request, limits)
    if "bad_alloc" in done.err:
        return _too_large(request, limits)
    if done.signal == "SIGSYS":
        return UnsafeFileError(
            "tries to start a process, which a geometry may not.",
            hint="Read the file; take that command out, or mesh it in gmsh and give the .msh.",
        )
    if done.signal == "SIGINT":
        return KeyboardInterrupt()
    if done.signal in ("SIGKILL", "SIGTERM"):
        text = "the mesh reader was killed, most likely for lack of memory."
        return ResourceError(text, hint="Use larger elements.")
    if done.code > 0 and "Traceback" in done.err:
        return RuntimeError(f"the mesh reader failed:\n{done.err}")
    how = done.signal or f"exit code {done.code}"
    if request["reader"] in GEOMETRIES:
        return unmeshable(how, given=bool(request["parameters"]))
    text = f"the reader crashed ({how}): the file is damaged."
    return FileFormatError(text, hint="Open it in gmsh and save it again.")


def _too_long(request: Request, limits: child.Limits) -> RomError:
    if request["reader"] in GEOMETRIES:
        text = f"meshing did not end within the limit of {limits.seconds:g} s."
        hint = "Does the geometry loop without end? Else use larger elements, or raise the limit by"
        return ResourceError(text, hint=f"{hint} --time-limit SECONDS or time_limit=.")
    text = "reading did not end within the time a file of this size needs."
    return FileFormatError(text, hint=WRITE_AGAIN)


def _too_large(request: Request, limits: child.Limits) -> RomError:
    if request["reader"] in GEOMETRIES:
        size = limits.memory / BYTES_PER_GIGABYTE
        text = f"meshing needs more than the limit of {size:.3g} GB."
        hint = "Use larger elements, or raise the limit by --memory-limit GIGABYTES or"
        return ResourceError(text, hint=f"{hint} memory_limit= [bytes].")
    return FileFormatError("asks for more memory than its size can need.", hint=WRITE_AGAIN)


def main(folder: str) -> None:
    """Entry of the child: answer the request in the folder."""
    request = json.loads(Path(folder, "request.json").read_text())
    try:
        arrays, notes = read(request)
        np.savez(Path(folder, "arrays.npz"), **arrays)
    except MemoryError:
        notes = {"error": MemoryError.__name__}
    except RomError as error:  # what the parent needs to raise it again
        notes = {name: getattr(error, name) for name in ("message", "where", "hint")}
        notes["error"] = type(error).__name__
    part = Path(folder, "answer.part")
    part.write_text(json.dumps(notes))
    part.rename(Path(folder, "answer.json"))


def read(request: Request) -> Read:
    """Arrays and notes of the mesh a request asks for, in the form of `packed`, in the child."""
    reader = request["reader"]
    try:
        if reader in ("abaqus", "nastran", "ansys", "med"):  # only its own libraries are loaded
            return import_module(f"rom.fe.mesh.sources.{reader}").read(request["path"])
        return import_module("rom.fe.mesh.sources.gmsh_session").run(request)
    except (RomError, MemoryError):
        raise
    except ModuleNotFoundError as error:
        raise ResourceError(
            f"reading this file needs {error.name}, which is not installed.",
            hint=f"On Debian: apt-get install python3-{error.name}; else pip install {error.name}.",
        ) from error
    except OSError as error:
        if reader not in GEOMETRIES or ".so" not in str(error):
            raise
        raise ResourceError(
            f"gmsh cannot be loaded: {error}.", hint=f"On Debian: apt-get install {GMSH_LIBRARIES}."
        ) from error
    except Exception as error:  # parsers raise whatever the broken line provokes
        if reader in GEOMETRIES:
            raise
        raise FileFormatError(
            f"is not a readable {request['reader']} file ({type(error).__name__}: {error})."
        ) from error


if __name__ == "__main__":
    main(sys.argv[1])
