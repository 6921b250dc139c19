"""The motion of a mechanism file as a measure: which of its keys vary, and what is kept of it."""

import hashlib
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import rom
from rom.errors import ConfigError
from rom.io.history import asked
from rom.model import Array
from rom.names import check_known, named

KEY_WORDS = re.compile(r'"([^"]*)"|([^."]+)')  # of a key, "joints"."main bearing"
CALL = re.compile(r"\s*(\w+)\s*\((.*)\)\s*", re.DOTALL)
FUNCTIONS: dict[str, Callable[[Array], Any]] = {
    "max": np.max,
    "min": np.min,
    "mean": np.mean,
    "range": np.ptp,
    "rms": lambda x: np.sqrt(np.mean(x**2)),
    "last": lambda x: x[-1],
}
WRITE = f'Write it as "max(abs(crank pin force))"; there are abs, {named(FUNCTIONS)}.'


@dataclass(frozen=True)
class MotionOf:
    """What is kept of the motion that a file describes, with the keys that are given changed."""

    file: str
    kept: tuple[str, ...]
    bodies: Mapping[str, str]  # {body: file of it, reduced already}
    trust: bool = False  # run functions in Python of the file

    def __call__(self, **given: float) -> dict[str, Any]:
        """Move it, and say what is kept."""
        changes: dict[tuple[str, ...], object] = {
            ("bodies", name, "file"): place for name, place in self.bodies.items()
        }
        changes |= {key_path(name): value for name, value in given.items()}
        solution = rom.read_mechanism(self.file, changes, trust=self.trust).simulate()
        return {text: value_of(text, solution) for text in self.kept}

    @property
    def name(self) -> str:
        """By which a study knows this file, as it is now, and what is kept of it."""
        digest = hashlib.sha256(Path(self.file).read_bytes()).hexdigest()[:16]
        return "; ".join([f"{Path(self.file).name} {digest}", *self.kept])


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
    check_known(function, ("abs", *FUNCTIONS), f"there is no function {function!r}; there are")
    x = value_of(inner, solution)
    if function == "abs":
        return np.abs(x) if np.ndim(x) < 2 else np.linalg.norm(x, axis=1)
    if np.ndim(x) != 1:
        raise ConfigError(f"{function}({inner}) is of no single column over time.", hint=WRITE)
    return FUNCTIONS[function](x)


def _column(name: str, solution: Any) -> Array:
    """(n_t,) or (n_t, c) values of a quantity."""
    for channel in asked(solution, ["_"] if not name else [_without_axis(name)]):
        values = channel.values.reshape(len(solution.t), -1)
        if name in channel.names:
            return np.asarray(values[:, channel.names.index(name)])
        if " ".join(channel.path[1:]).replace(" markers ", " ") == name:
            return values if values.shape[1] > 1 else values[:, 0]
    raise ConfigError(f"the motion has no quantity {name!r}.", hint=WRITE)


def _without_axis(name: str) -> str:
    return re.sub(r" (x|y|z|p[0-3]|q\d+)$", "", name)


def reduced(file: "rom.config.mechanism.MechanismFile", folder: Path) -> dict[str, str]:
    """{body: file} of the bodies that component files describe, meshed and reduced once."""
    found = dict[str, str]()
    for name, values in file.values["bodies"].items():
        place = values.get("file")
        if place is not None and place.suffix == ".toml":
            path = folder / f"body{len(found)}.rom.npz"
            rom.save(rom.read_component(place, **file.meshing).body(), path)
            found[name] = str(path)
    return found
