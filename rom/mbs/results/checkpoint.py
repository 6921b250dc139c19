"""Checkpoints: the state of a mechanism in a file, from which a run goes on bit for bit."""

from pathlib import Path
from typing import Any

from rom.arguments import typed
from rom.io.archive import MAX_BYTES, Kind, read_archive, stated, write_archive
from rom.mbs.results.state import Memory, State
from rom.model import Array

SCHEMA_NAME, VERSION = "rom-state", (2, 1)
MEAN_AXES_SINCE = 1  # minor version from which every linear body is counted on its mean axes
NEEDED_FIELDS = ("q", "v", "a", "lam")
STATE_KIND = Kind({SCHEMA_NAME: VERSION}, "state file", NEEDED_FIELDS)
OPTIONAL_FIELDS = ("algorithmic", "base")
MEMORY_PREFIX = "memory/"


@typed
def save_state(state: State, path: str | Path) -> Path:
    """Write a state with what its method remembers, whole or not at all.

    Args:
        state: e.g. ``sol.final``, or ``error.solution.final`` of an interrupted run.
        path: file name, usually ending in ``.state.npz``.

    Raises:
        ConfigError: if it is no state, or the folder is missing or not writable.
        QualityGateError: if the state holds a number that is not finite.
        ResourceError: if the disk is full.
    """
    return write_archive(path, *packed_state(state), "the state")


def packed_state(state: State) -> tuple[dict[str, Any], dict[str, Array]]:
    """Manifest and arrays of a state."""
    arrays: dict[str, Array] = {name: getattr(state, name) for name in NEEDED_FIELDS}
    given = {name: getattr(state, name) for name in OPTIONAL_FIELDS}
    arrays |= {name: A for name, A in given.items() if A is not None}
    manifest: dict[str, Any] = {"schema": SCHEMA_NAME, "version": list(VERSION)}
    manifest["t"] = float(state.t).hex()
    manifest["rank"] = int(state.rank)
    if state.memory is not None:
        m = state.memory
        arrays |= {MEMORY_PREFIX + name: A for name, A in m.arrays.items()}
        steps = {"h": float(m.h).hex(), "origin": float(m.origin).hex(), "taken": m.taken}
        manifest["memory"] = {"method": m.method, **steps}
    return manifest, dict(sorted(arrays.items()))


@typed
def load_state(path: str | Path, *, limit: int = MAX_BYTES) -> State:
    """Read a state to go on from: ``rom.simulate(mechanism, state=..., ...)``.

    Args:
        path: file written by `save_state`.
        limit: bytes the arrays may take in memory.

    Raises:
        FileFormatError: if the file is missing, cut, changed, or no state file.
        UnsafeFileError: if it asks for more memory than the limit or holds anything but numbers.
    """
    return unpacked_state(*read_archive(path, STATE_KIND, limit), path)


def unpacked_state(manifest: dict[str, Any], arrays: dict[str, Array], path: str | Path) -> State:
    """The state of a manifest and its arrays.

    Raises:
        FileFormatError: if something is missing.
    """
    with stated(path):
        fields: dict[str, Any] = {name: arrays[name] for name in NEEDED_FIELDS}
        fields |= {name: arrays.get(name) for name in OPTIONAL_FIELDS}
        memory = _memory(manifest.get("memory"), arrays)
        t, rank = float.fromhex(manifest["t"]), int(manifest["rank"])
        old = manifest["version"][1] < MEAN_AXES_SINCE
        return State(t=t, rank=rank, **fields, memory=memory, in_own_frames=old)


def _memory(manifest: dict[str, Any] | None, arrays: dict[str, Array]) -> Memory | None:
    if manifest is None:
        return None
    h, origin = (float.fromhex(manifest[name]) for name in ("h", "origin"))
    own = {
        k.removeprefix(MEMORY_PREFIX): A for k, A in arrays.items() if k.startswith(MEMORY_PREFIX)
    }
    return Memory(str(manifest["method"]), h, origin, int(manifest["taken"]), own)
