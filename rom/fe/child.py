"""Reads a mesh in a process of its own.

gmsh stops the whole process on several broken files, a hostile one can exhaust the memory, and its
compiled loops do not hear Ctrl-C. All of that ends with the child; the parent reports it as a
typed error. The result returns as an ``.npz`` without pickles.
"""

import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from rom import errors
from rom.errors import ConfigError, FileFormatError, ResourceError, RomError
from rom.fe.readers import GEOMETRIES, Read, read

MEGABYTE = 2**20
# The launcher of MPI recognises its processes by these; the child is none of them.
MPI_VARIABLES = ("OMPI_", "PMIX_", "PMI_", "MPI_", "PRTE_", "HYDRA_", "SLURM_")


def read_apart(request: dict[str, Any], *, where: str, size: int) -> Read:
    """Run a reader in a child process.

    Args:
        request: path, reader, parameters, faces, order; must fit into JSON.
        where: name of the file, for messages.
        size: size of the file [bytes]; sets the limits for finished meshes.

    Returns:
        The arrays and the notes of `rom.fe.readers.read`.

    Raises:
        RomError: of the class the reader raised.
        FileFormatError: the reader crashed, or ran out of time or memory.
    """
    with tempfile.TemporaryDirectory(prefix="rom-mesh-") as folder:
        request = request | {"folder": folder, "limits": _limits(request["reader"], size)}
        try:
            Path(folder, "request.json").write_text(json.dumps(request, default=_plain))
        except TypeError as error:
            raise ConfigError(
                f"parameters must be numbers or text: {error}.", where=where
            ) from None
        done = subprocess.run(
            [sys.executable, "-m", "rom.fe.child", folder],
            env=_environment(),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            check=False,
        )
        return _result(Path(folder), done, where)


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    raise TypeError(f"got {value!r}")


def _limits(reader: str, size: int) -> dict[str, int]:
    """CPU seconds and address space for files whose cost follows from their size."""
    if reader in GEOMETRIES:
        return {}
    # measured: 0.08 s per megabyte and 10 bytes per byte; the rest is reserve
    return {"seconds": 10 + 3 * size // MEGABYTE, "bytes": 2048 * MEGABYTE + 100 * size}


def _environment() -> dict[str, str]:
    kept = {k: v for k, v in os.environ.items() if not k.startswith(MPI_VARIABLES)}
    root = str(Path(__file__).resolve().parents[2])
    path = os.pathsep.join(filter(None, (root, kept.get("PYTHONPATH", ""))))
    # LC_ALL: gmsh reads decimal points with the locale of the process
    return kept | {"PYTHONPATH": path, "OMP_NUM_THREADS": "1", "LC_ALL": "C.UTF-8"}


def _result(folder: Path, done: subprocess.CompletedProcess[bytes], where: str) -> Read:
    answer = folder / "answer.json"
    if not answer.exists():
        raise _died(done, where)
    notes = json.loads(answer.read_text())
    if "error" in notes:
        raise getattr(errors, notes["error"])(
            notes["message"], where=notes["where"] or where, hint=notes["hint"]
        )
    with np.load(folder / "arrays.npz", allow_pickle=False) as arrays:
        return dict(arrays), notes


def _died(done: subprocess.CompletedProcess[bytes], where: str) -> BaseException:
    if done.returncode > 0:
        return RuntimeError(f"the mesh reader failed:\n{done.stderr.decode(errors='replace')}")
    name = signal.Signals(-done.returncode).name
    if name == "SIGINT":
        return KeyboardInterrupt()
    if name == "SIGXCPU":
        return FileFormatError(
            "reading did not end within the time a file of this size needs.",
            where=where,
            hint="The file is damaged; write it again.",
        )
    if name == "SIGKILL":
        return ResourceError(
            "the mesh reader was killed, most likely for lack of memory.",
            where=where,
            hint="Use larger elements.",
        )
    return FileFormatError(
        f"the reader crashed ({name}): the file is damaged.",
        where=where,
        hint="Open it in gmsh and save it again.",
    )


def main(folder: str) -> None:
    """Entry of the child: answer the request in the folder."""
    request = json.loads(Path(folder, "request.json").read_text())
    _restrict(request["limits"])
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
        error = FileFormatError(
            "asks for more memory than a file of its size can need.",
            hint="The file is damaged; write it again.",
        )
    return {"error": type(error).__name__, "message": error.message, "where": error.where,
            "hint": error.hint}  # fmt: skip


def _answer(folder: str, notes: dict[str, Any]) -> None:
    part = Path(folder, "answer.part")
    part.write_text(json.dumps(notes))
    part.rename(Path(folder, "answer.json"))


def _restrict(limits: dict[str, int]) -> None:
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if limits:
        resource.setrlimit(resource.RLIMIT_CPU, (limits["seconds"], limits["seconds"] + 1))
        resource.setrlimit(resource.RLIMIT_AS, (limits["bytes"], limits["bytes"]))


if __name__ == "__main__":
    main(sys.argv[1])
