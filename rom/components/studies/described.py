"""The motion of a mechanism file as a measure: which of its keys vary, and what is kept of it."""

import json
import re
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rom import errors
from rom.components.studies.worker import Unmeasurable
from rom.config.component import read_component
from rom.config.component_keys import TABLE
from rom.config.mechanism import read_mechanism
from rom.errors import ConfigError
from rom.io.history import asked
from rom.model import Array
from rom.names import named
from rom.process.child import python, run
from rom.process.launcher import ranks
from rom.process.patience import Turns

if TYPE_CHECKING:
    from rom.body.flexible import FlexibleBody
    from rom.config.mechanism import MechanismFile
    from rom.model import FEModel

Changes = dict[tuple[str, ...], Any]
KEY_WORDS = re.compile(r'"([^"]*)"|([^."]+)')  # of a key, joints."main bearing"
CALL = re.compile(r"\s*(\w+)\s*\((.*)\)\s*", re.DOTALL)
AXIS = re.compile(r" (x|y|z|p[0-3]|q\d+)$")  # of a column, behind its quantity
OF_COMPONENTS = {key.name for key in TABLE.keys} - {"name"}
FUNCTIONS: dict[str, Callable[[Array], Any]] = {
    "max": np.max,
    "min": np.min,
    "mean": np.mean,
    "range": np.ptp,
    "rms": lambda x: np.sqrt(np.mean(x**2)),
    "last": lambda x: x[-1],
}
WRITE = f'Write it as "max(abs(crank pin force))"; there are abs, {named(FUNCTIONS)}.'
TURNS = Turns()


@dataclass(frozen=True)
class MotionOf:
    """What is kept of the motion that a file describes, with the keys that are given changed.

    Keys are those of the mechanism; behind ``bodies.NAME`` also those of the component file of that
    body. ``mesh.NAME`` is a parameter of its geometry, and without a body in front of it that of
    all geometries.
    """

    file: str
    kept: tuple[str, ...]
    folder: str  # of bodies that are made, each once
    trust: bool = False  # run what is written in Python

    def __call__(self, **given: Any) -> dict[str, Any]:
        """Move it, and say what is kept."""
        own, parts = self.sorted(given)
        for name, (place, changes) in parts.items():
            made = body_of(place, tuple(changes.items()), self.folder, self.trust)
            own["bodies", name, "file"] = made
        solution = read_mechanism(self.file, own, trust=self.trust).simulate()
        return {text: value_of(text, solution) for text in self.kept}

    @cached_property
    def components(self) -> dict[str, Path]:
        """Component files by body, as the file is when a study begins."""
        bodies = read_mechanism(self.file).values["bodies"]
        files = {name: values["file"] for name, values in bodies.items() if "file" in values}
        return {name: place for name, place in files.items() if place.suffix == ".toml"}

    @property
    def name(self) -> str:
        """By which a study knows the files, as they are now, and what is kept."""
        files = sorted({Path(self.file), *self.components.values()})
        digest = _digest("".join(sha256(path.read_bytes()).hexdigest() for path in files))
        return "; ".join([f"{Path(self.file).name} {digest}", *self.kept])

    def sorted(self, given: Mapping[str, Any]) -> tuple[Changes, dict[str, tuple[str, Changes]]]:
        """Changes of the mechanism, and component file and changes by body."""
        parts = {name: (str(place), Changes()) for name, place in self.components.items()}
        own = Changes()
        for text, value in given.items():
            match key_path(text):
                case ["mesh", *rest] if parts:
                    for _, changes in parts.values():
                        changes["geometry", "parameters", *rest] = value
                case ["bodies", body, "mesh", *rest] if body in parts:
                    parts[body][1]["geometry", "parameters", *rest] = value
                case ["bodies", body, section, *rest] if body in parts and section in OF_COMPONENTS:
                    parts[body][1][section, *rest] = value
                case path:
                    own[path] = value
        return own, parts

    def check(self, given: Mapping[str, Any]) -> "MechanismFile":
        """The file with such changes, if it and its components may be changed so.

        Raises:
            ConfigError: for a key that does not exist, or a value it cannot have.
        """
        own, parts = self.sorted(given)
        file = read_mechanism(self.file, own, trust=self.trust)
        for name, (place, changes) in parts.items():
            component = read_component(place, changes, trust=self.trust)
            if not (component.kinds or file.values["bodies"][name]["rigid"]):
                component.body()  # says that it has no interface
        return file


@cache
def body_of(place: str, changes: tuple[Any, ...], folder: str, trust: bool) -> str:
    """File of the reduced body of a component, made by one process for all that ask for it."""
    path = Path(folder) / f"{_digest(repr((place, sorted(changes))))}.rom.npz"
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        if not path.exists():
            TURNS.take(path)
        if not path.exists():
            _make(place, dict(changes), path, trust)
    finally:
        TURNS.end(path)
    return str(path)


def _make(place: str, changes: Changes, path: Path, trust: bool) -> None:
    """Mesh and reduce; where this process is one of several, by one that is alone."""
    if ranks()[1] == 1:
        from rom.io.native import save

        component = read_component(place, changes, trust=trust)
        save(component.body() if component.kinds else _rigid(component.model()), path)
        return
    given = json.dumps([place, list(changes.items()), str(path), trust])
    ended = run(python("rom.components.studies.described", given))
    if ended.code:
        kind, _, text = ended.out.partition("\n")
        raise getattr(errors, kind, errors.SolverError)(text.strip() or ended.last)


def _rigid(model: "FEModel") -> "FlexibleBody":
    """Mass and places of a component without kinds, in the file of a body that does not bend."""
    from rom.reduction.bases.method import CraigBampton
    from rom.workflow import reduce

    kinds = dict.fromkeys(model.interfaces, "rbe3")
    return reduce(model, method=CraigBampton(0), interfaces=kinds, certify=False)


def key_path(text: str) -> tuple[str, ...]:
    """A key of a file, outermost table first."""
    return tuple(quoted or plain for quoted, plain in KEY_WORDS.findall(text))


def value_of(text: str, solution: Any) -> Any:
    """A column of the table of a motion, or what functions make of it; abs of a vector is its size.

    Raises:
        ConfigError: for another function, or a name that is no quantity of the motion.
    """
    call = CALL.fullmatch(text)
    if call is None:
        return _column(text.strip(), solution)
    function, inner = call[1], call[2]
    if function not in ("abs", *FUNCTIONS):
        raise Unmeasurable(f"there is no function {function!r}.", hint=WRITE)
    x = value_of(inner, solution)
    if function == "abs":
        return np.abs(x) if np.ndim(x) < 2 else np.linalg.norm(x, axis=1)
    if np.ndim(x) != 1:
        raise Unmeasurable(f"{function}({inner}) is of no single column over time.", hint=WRITE)
    return FUNCTIONS[function](x)


def _column(name: str, solution: Any) -> Array:
    """(n_t,) or (n_t, c) values of a quantity; t is the time."""
    if name == "t":
        return np.asarray(solution.t)
    try:
        channels = asked(solution, [AXIS.sub("", name)])
    except ConfigError as error:
        raise Unmeasurable(error.message, hint=error.hint) from error
    for channel in channels:
        words = [f"{channel.said} {x}".strip() for x in channel.columns]
        if name in (channel.said, *words):
            values = channel.values.reshape(len(solution.t), -1)
            return values[:, words.index(name)] if name in words else values
    raise Unmeasurable(f"the motion has no quantity {name!r}.", hint=WRITE)


def _digest(text: str) -> str:
    return sha256(text.encode()).hexdigest()[:24]


if __name__ == "__main__":
    place, changes, path, trust = json.loads(sys.argv[1])
    try:
        _make(place, {tuple(key): value for key, value in changes}, Path(path), trust)
    except errors.RomError as error:
        sys.stdout.write(f"{type(error).__name__}\n{error}")
        sys.exit(1)
