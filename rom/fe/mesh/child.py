"""Reads a mesh in a process of its own.

gmsh stops the whole process on several broken files, a hostile one can exhaust the memory, and its
compiled loops do not hear Ctrl-C. All of that ends with the child; the parent reports it as a
typed error. The result returns as an ``.npz`` without pickles.
"""

import json
import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rom import errors
from rom.errors import (
    ConfigError,
    FileFormatError,
    ResourceError,
    RomError,
    UnsafeFileError,
    in_file,
)
from rom.fe.mesh.solid import GEOMETRIES, Read
from rom.fe.mesh.sources.builder import unmeshable
from rom.fe.mesh.sources.readers import read
from rom.process import child
from rom.process.memory import total_bytes

BYTES_PER_MEGABYTE, BYTES_PER_GIGABYTE = 2**20, 1e9
MESHER_TIME_LIMIT = 1800.0  # [s]
WRITE_AGAIN = "The file is damaged; write it again."
MAX_MEMORY_SHARE = 0.8  # of the memory of the machine, for a mesher
# LC_ALL: gmsh reads decimal points with the locale of the process
VARIABLES = {"OMP_NUM_THREADS": "1", "LC_ALL": "C.UTF-8"}


@dataclass(frozen=True, slots=True)
class Reading:
    """A request under its limits, for what is said when it fails.

    Attributes:
        geometry: whether the file is one, which is meshed here.
        given: whether it was given parameters.
        limits: what the reader may take.
    """

    geometry: bool
    given: bool
    limits: child.Limits


def read_apart(
    request: dict[str, Any],
    *,
    where: str,
    size: int,
    time_limit: float | None = None,
    memory_limit: float | None = None,
) -> Read:
    """Run a reader in a child process.

    Args:
        request: path, reader, parameters, faces, order; must fit into JSON.
        where: name of the file, for messages.
        size: size of the file [bytes]; sets the limits for finished meshes.
        time_limit: of a mesher [s]; 0 or infinity for none.
        memory_limit: of a mesher [bytes]; 0 or infinity for none.

    Returns:
        The arrays and the notes of `rom.fe.mesh.sources.readers.read`.

    Raises:
        RomError: of the class the reader raised.
        UnsafeFileError: the geometry tried to start a process.
        FileFormatError, MeshError: the reader crashed.
        ResourceError: it ran out of time or memory.
    """
    limits = _limits(request["reader"], size, time_limit, memory_limit)
    reading = Reading(request["reader"] in GEOMETRIES, bool(request["parameters"]), limits)
    with child.scratch("mesh") as folder, in_file(where):
        try:
            text = json.dumps(request | {"folder": str(folder)}, default=_plain)
        except TypeError as error:
            raise ConfigError(f"parameters must be numbers or text: {error}.") from None
        (folder / "request.json").write_text(text)
        command = child.python("rom.fe.mesh.child", str(folder))
        done = child.run(command, limits=limits, variables=VARIABLES)
        return _result(folder, done, reading)


def _plain(value: Any) -> Any:
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
    if isinstance(value, bool) or not isinstance(value, int | float) or not value >= 0:
        raise ConfigError(f"{name} = {value!r} must be a number from 0 on.", hint="0 is none.")
    return 0.0 if math.isinf(value) else float(value)


def _result(folder: Path, done: child.Ended, reading: Reading) -> Read:
    answer = folder / "answer.json"
    if not answer.exists():
        raise _died(done, reading)
    notes = json.loads(answer.read_text())
    if notes.get("error") == MemoryError.__name__:
        raise _too_large(reading)
    if "error" in notes:
        raise getattr(errors, notes.pop("error"))(notes.pop("message"), **notes)
    with np.load(folder / "arrays.npz", allow_pickle=False) as arrays:
        return dict(arrays), notes


def _died(done: child.Ended, reading: Reading) -> BaseException:
    """What a reader without an answer means."""
    if done.overtime or done.signal == "SIGXCPU":
        return _too_long(reading)
    if "bad_alloc" in done.err:
        return _too_large(reading)
    if done.signal == "SIGSYS":
        return UnsafeFileError(
            "tries to start a process, which a geometry may not.",
            hint="Read the file; take that command out, or mesh it in gmsh and give the .msh.",
        )
    if done.signal == "SIGINT":
        return KeyboardInterrupt()
    if done.signal in ("SIGKILL", "SIGTERM"):
        return ResourceError(
            "the mesh reader was killed, most likely for lack of memory.",
            hint="Use larger elements.",
        )
    if done.code > 0 and "Traceback" in done.err:
        return RuntimeError(f"the mesh reader failed:\n{done.err}")
    return _crashed(done.signal or f"exit code {done.code}", reading)


def _too_long(reading: Reading) -> RomError:
    if reading.geometry:
        return ResourceError(
            f"meshing did not end within the limit of {reading.limits.seconds:g} s.",
            hint="Does the geometry loop without end? Else use larger elements, or raise the limit "
            "by --time-limit SECONDS or time_limit=.",
        )
    text = "reading did not end within the time a file of this size needs."
    return FileFormatError(text, hint=WRITE_AGAIN)


def _too_large(reading: Reading) -> RomError:
    if reading.geometry:
        limit = reading.limits.memory / BYTES_PER_GIGABYTE
        return ResourceError(
            f"meshing needs more than the limit of {limit:.3g} GB.",
            hint="Use larger elements, or raise the limit by --memory-limit GIGABYTES or "
            "memory_limit= [bytes].",
        )
    return FileFormatError("asks for more memory than its size can need.", hint=WRITE_AGAIN)


def _crashed(how: str, reading: Reading) -> RomError:
    if reading.geometry:
        return unmeshable(how, given=reading.given)
    text = f"the reader crashed ({how}): the file is damaged."
    return FileFormatError(text, hint="Open it in gmsh and save it again.")


def main(folder: str) -> None:
    """Entry of the child: answer the request in the folder."""
    request = json.loads(Path(folder, "request.json").read_text())
    try:
        arrays, notes = read(request)
    except (RomError, MemoryError) as error:
        _answer(folder, _described(error))
        return
    np.savez(Path(folder, "arrays.npz"), **arrays)
    _answer(folder, notes)


def _described(error: RomError | MemoryError) -> dict[str, str]:
    """What the parent needs to raise the error again."""
    if isinstance(error, MemoryError):
        return {"error": MemoryError.__name__}
    return {"error": type(error).__name__, "message": error.message, "where": error.where,
            "hint": error.hint}  # fmt: skip


def _answer(folder: str, notes: dict[str, Any]) -> None:
    part = Path(folder, "answer.part")
    part.write_text(json.dumps(notes))
    part.rename(Path(folder, "answer.json"))


if __name__ == "__main__":
    main(sys.argv[1])
