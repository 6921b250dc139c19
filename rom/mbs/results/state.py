"""A mechanism at one instant, with what a method remembers beside it, from which runs go on.

In a file it is whole, and a run goes on from it bit for bit.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from rom.arguments import typed
from rom.errors import ConfigError
from rom.io.archive import MAX_BYTES, Kind, read_archive, stated, write_archive
from rom.mbs.equations.packing import Packed
from rom.model import OWN_FRAME, Array
from rom.names import named

SCHEMA_NAME, VERSION = "rom-state", (2, 1)
MEAN_AXES_SINCE = 1  # minor version from which every linear body is counted on its mean axes
NEEDED_FIELDS = ("q", "v", "a", "lam")
STATE_KIND = Kind({SCHEMA_NAME: VERSION}, "state file", NEEDED_FIELDS)
OPTIONAL_FIELDS = ("algorithmic", "base")
MEMORY_PREFIX = "memory/"


@dataclass(frozen=True)
class Memory:
    """What an implicit method remembers beside the state: with it, a run goes on bit for bit."""

    method: str
    h: float  # length of the last step [s]
    origin: float  # time from which steps are counted [s]
    taken: int  # steps since then
    # the factorised iteration matrix and what belongs to it
    arrays: dict[str, Array] = field(repr=False)


@typed
@dataclass(frozen=True)
class State:
    """A mechanism at one instant.

    Attributes:
        t: time [s].
        q: (n_q,) per body: origin (3) [m], quaternion (4) [1], elastic coordinates (r); the origin
            and axes of a flexible body are its mean ones, at large deflection those of its frame.
        v: (n,) per body: velocity of the origin, world (3) [m/s], angular velocity, body frame (3)
            [rad/s], elastic rates (r).
        a: (n,) rates of v [m/s^2, rad/s^2].
        lam: (m,) multipliers of the constraints [N, N m].
        rank: number of independent constraints.
        algorithmic: (n,) acceleration-like variable of generalised-alpha [m/s^2, rad/s^2], None at
            a fresh start.
        base: (c,) joint coordinates that forces or couplings act on [m, rad], angles counted over
            whole turns; None: as measured.
        memory: of the method that arrived here; None at a fresh start.
        closed: largest change of what was given by joints and drives at a fresh start, of the size
            of the mechanism or of given velocities [1].
        in_own_frames: read from a file in which bodies without geometric stiffness stand in the
            frames they were given.
    """

    t: float
    q: Array
    v: Array
    a: Array
    lam: Array
    rank: int
    algorithmic: Array | None = None
    base: Array | None = None
    memory: Memory | None = None
    closed: float = 0.0
    in_own_frames: bool = False


def check_state(state: State, packed: Packed, *, joints: bool = True) -> None:
    """Refuse a state of other bodies or joints, or of bodies in frames of an older version."""
    needed = (packed.q.size, packed.v.size, packed.system.rows.kind.size)
    sizes = tuple(np.size(getattr(state, x, 0.0)) for x in ("q", "v", "lam"))
    if not isinstance(state, State) or sizes[: 2 + joints] != needed[: 2 + joints]:
        has = "the state has {} coordinates, {} velocities and {} constraints".format(*sizes)
        text = "{}; this mechanism has {}, {} and {}: their bodies differ.".format(has, *needed)
        raise ConfigError(text, hint="Take one of the same mechanism: sol.final, rom.equilibrium.")
    stiffened = dict(zip(packed.names, packed.system.bodies.stiffened, strict=True))
    moved = [m.body for m in packed.markers if m.place == OWN_FRAME and not stiffened[m.body]]
    if state.in_own_frames and moved:
        text = f"the state counts {named(moved)} in the frame of its reference, as an older"
        hint = "Compute the motion up to there again."
        raise ConfigError(f"{text} version did; motions now are on mean axes.", hint=hint)


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
    given = {name: getattr(state, name) for name in (*NEEDED_FIELDS, *OPTIONAL_FIELDS)}
    arrays = {name: A for name, A in given.items() if A is not None}
    manifest: dict[str, Any] = {"schema": SCHEMA_NAME, "version": list(VERSION)}
    manifest |= {"t": float(state.t).hex(), "rank": int(state.rank)}
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
    """The state of a manifest and its arrays."""
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
    own = {k.partition("/")[2]: A for k, A in arrays.items() if k.startswith(MEMORY_PREFIX)}
    return Memory(str(manifest["method"]), h, origin, int(manifest["taken"]), own)
