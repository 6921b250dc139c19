"""A folder in which a motion is kept while it is computed, and from which the run goes on.

Parts of the motion and the state behind the last of them are written at times, each file whole or
not at all: whatever ends the process, the motion up to the last part can be read, and a run that
goes on from there has the bits of one that was never interrupted.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from rom.arguments import typed
from rom.errors import ConfigError, FileFormatError
from rom.io.archive import Kind, digest, read_archive, stated, write_archive
from rom.mbs.equations.packing import Packed
from rom.mbs.integrate.events import Noted
from rom.mbs.kernels.tables import Table
from rom.mbs.results.state import STATE_KIND as STATE
from rom.mbs.results.state import Memory, State, packed_state, unpacked_state
from rom.model import Array

SCHEMA_NAME, VERSION = "rom-motion", (1, 0)
COLUMNS = ("t", "q", "v", "a", "lam", "work", "base")
PART_KIND = Kind({SCHEMA_NAME: VERSION}, "part of a motion", COLUMNS)
STATE_FILE = "state.npz"
EVENTS_PREFIX = "events/"
# seconds of stepping between two parts, and how many times longer than it takes to write one
MIN_INTERVAL, WRITE_TIME_FACTOR = 1.0, 60.0
# of the time spent so far: what a long run risks, so that it does not leave thousands of parts
MAX_LOSS_RATIO = 1 / 500

Block = tuple[Array, ...]


class Kept(NamedTuple):
    """What was read: from where steps are counted, the state and its memory, blocks, events."""

    origin: float | None
    taken: int
    state: State
    memory: Memory
    blocks: list[Block]
    noted: Noted | None


@typed
@dataclass
class Keeping:
    """The folder of one run.

    Attributes:
        folder: made when the first part is written.
        resume: whether to go on with what it holds.
        made_from: digests of what the mechanism was made from, by name; what differs when the run
            is to go on is refused by this name.
    """

    folder: Path
    resume: bool = False
    made_from: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.folder = Path(self.folder)
        self._parts, self._blocks = 0, 0
        self._first = self._next = perf_counter()
        self._manifest: dict[str, Any] = {}

    @property
    def state(self) -> Path:
        """The file to go on from."""
        return self.folder / STATE_FILE

    def check(self) -> None:
        """Refuse to write over a motion, or to go on with none; to be asked early.

        Raises:
            ConfigError: saying which.
        """
        if self.state.exists() == self.resume:
            return
        fault = f"{self.folder} holds the motion of a run that did not come to its end."
        cure = "Go on with it by --resume (resume=True), or remove the folder."
        if self.resume:
            fault = f"there is nothing to resume: {self.folder} holds no motion."
            cure = "A run that came to its end, or ended soon, leaves none. Leave out --resume."
        raise ConfigError(fault, hint=cure)

    def begin(self, origin: float | None, taken: int, digests: Mapping[str, str]) -> None:
        """Tell what the run is; to be called before `read` and `write`.

        Args:
            origin: time the steps are counted from [s], None for the start of the run.
            taken: steps since then.
            digests: of arguments and mechanism by name.
        """
        self.check()
        counted = [None if origin is None else float(origin).hex(), taken]
        self._manifest = {"counted": counted, "digests": {**self.made_from, **digests}}
        self._first = perf_counter()
        self._next = self._first + MIN_INTERVAL

    def read(self) -> Kept:
        """What is there.

        Raises:
            ConfigError: if it is of another run.
            FileFormatError: if a file is damaged.
        """
        manifest, arrays = read_archive(self.state, STATE)
        with stated(self.state):
            digests, (origin, taken) = manifest["digests"], manifest["counted"]
            self._parts = int(manifest["parts"])
            origin = None if origin is None else float.fromhex(origin)
            noted = _noted(manifest["signs"], arrays)
        ours = self._manifest["digests"]
        names = [name for name in {**ours, **digests} if ours.get(name) != digests.get(name)]
        if names:
            text = f"the interrupted run in {self.folder} had another {names[0]}: it cannot go on."
            hint = "Only t_end may differ from what it was begun with; or remove the folder."
            raise ConfigError(text, hint=hint)
        state = unpacked_state(manifest, arrays, self.state)
        if state.memory is None:
            raise FileFormatError("the state has no memory of its run.", where=str(self.state))
        parts = [read_archive(self._path(k), PART_KIND)[1] for k in range(1, self._parts + 1)]
        blocks = _joined([tuple(part[name] for name in COLUMNS) for part in parts], state.t)
        self._blocks = len(blocks)
        return Kept(origin, int(taken), state, state.memory, blocks, noted)

    def _path(self, k: int) -> Path:
        return self.folder / f"part-{k:06d}.npz"

    def due(self, now: float) -> bool:
        """Whether it is time to write; ``now`` by the clock of the writer [s]."""
        return now >= self._next

    def write(self, blocks: Sequence[Block], state: State, noted: Noted | None) -> None:
        """Write what is new since the last time; the state last, which counts the parts.

        Raises:
            ConfigError: if the folder cannot be made.
            ResourceError: if the disk is full.
            QualityGateError: if a number of the motion is not finite.
        """
        begun, count = perf_counter(), len(blocks)
        if state.memory is None:
            return  # there is nothing yet that would not begin anew
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            text = f"{self.folder} cannot be made: {error.strerror}; choose another folder."
            raise ConfigError(text) from error
        parts = self._parts
        if count > self._blocks:
            parts += 1
            columns = zip(*blocks[self._blocks :], strict=True)
            arrays = dict(zip(COLUMNS, map(np.concatenate, columns), strict=True))
            manifest = {"schema": SCHEMA_NAME, "version": list(VERSION)}
            write_archive(self._path(parts), manifest, arrays, "the motion")
        manifest, arrays = packed_state(state)
        signs = None if noted is None else [[k, float(x)] for k, x in noted.signs.items()]
        more = self._manifest | {"parts": parts, "signs": signs}
        events = {} if noted is None else _arrays(noted)
        write_archive(self.state, manifest | more, arrays | events, "the state")
        self._parts, self._blocks = parts, count
        now = perf_counter()
        least = WRITE_TIME_FACTOR * (now - begun), MAX_LOSS_RATIO * (now - self._first)
        self._next = now + max(MIN_INTERVAL, *least)

    def remove(self) -> None:
        """Remove what was kept, once the motion is written elsewhere."""
        self.state.unlink(missing_ok=True)
        # and what a kill in the middle of writing has left of them
        for path in (*self.folder.glob("part-*.npz"), *self.folder.glob(".*.npz.*.part")):
            path.unlink()
        if self.folder.is_dir() and not any(self.folder.iterdir()):
            self.folder.rmdir()


def digests_of(packed: Packed, arguments: Mapping[str, object]) -> dict[str, str]:
    """Digests by which a run is known: one of each argument, and one of the mechanism."""
    hashed = hashlib.sha256(repr((packed.names, packed.row_owner)).encode())
    hashed.update(repr([signal.name for signal in packed.signals]).encode())
    tables = (packed.system, *packed.elements.values())
    for A in (*(A for table in tables for A in _numbers(table)), packed.q, packed.v):
        hashed.update(digest(A).encode())
    return {**{name: repr(x) for name, x in arguments.items()}, "mechanism": hashed.hexdigest()}


def _numbers(table: Table) -> list[Array]:
    """All arrays of nested tables that tell a mechanism from another, its graph included."""
    found: list[Array] = []
    for name, value in table.items():
        if name != "graph" and name not in table._passing:
            found += _numbers(value) if isinstance(value, Table) else [np.asarray(value)]
    return found


def _joined(blocks: list[Block], end: float) -> list[Block]:
    """The blocks up to a time; what a failed step had kept gives way to what came instead."""
    found: list[Block] = []
    for block in reversed(blocks):
        found += [until(block, end)]
        end = np.nextafter(min(end, block[0][0]), -np.inf)
    return [block for block in reversed(found) if block[0].size]


def until(block: Block, t: float) -> Block:
    """The instants of a block up to a time."""
    return tuple(A[block[0] <= t] for A in block)


def _arrays(noted: Noted) -> dict[str, Array]:
    """What happened, by the names of the events."""
    happened = (items[: noted.counts[name]] for name, items in noted.found.items())
    return {
        f"{EVENTS_PREFIX}{k}/{what}": np.array([item[part] for item in items], dtype=float)
        for k, items in enumerate(happened)
        if items
        for part, what in enumerate("tqv")
    }


def _noted(signs: Sequence[tuple[str, float]] | None, arrays: Mapping[str, Array]) -> Noted | None:
    if signs is None:
        return None
    found: dict[str, list[tuple[float, Array, Array]]] = {}
    for k, (name, _) in enumerate(signs):
        columns = [arrays.get(f"{EVENTS_PREFIX}{k}/{what}", ()) for what in "tqv"]
        found[name] = [(float(t), q, v) for t, q, v in zip(*columns, strict=True)]
    return Noted(dict(signs), {name: len(items) for name, items in found.items()}, found)
