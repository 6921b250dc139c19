"""Predictions of measured structures: made first, kept in a file, then compared and never tuned.

A model is a function of its mesh and of named parameters that gives numbers by name, the unit in
brackets. Two meshes, one twice as fine, are extrapolated with second order. Each parameter has a
spread, twice its standard deviation; the band of a prediction is the root of the sum of squares of
what the spreads do to first order, by central differences on the coarse mesh, and of what the
extrapolation adds. ``predicted/*.toml`` is committed before ``found/*.toml`` exists, which holds
what was measured.
"""

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

PREDICTED, FOUND = (Path(__file__).with_name(name) for name in ("predicted", "found"))
Numbers = dict[str, float]


@dataclass(frozen=True)
class Structure:
    """What is predicted.

    Attributes:
        name: of its files.
        model: function of a mesh and of the parameters.
        parameters: {name: (value, spread)}.
        meshes: coarse, and twice as fine.
        note: what is assumed where the source says nothing.
        span: of which displacements deviate by parts, in their unit; None for what was measured.
    """

    name: str
    model: Callable[..., Numbers]
    parameters: Mapping[str, tuple[float, float]]
    meshes: tuple[int, int]
    note: str
    span: float | None = None


@dataclass(frozen=True)
class Prediction:
    """One number.

    Attributes:
        value, low, high: the number and its band.
        parts: {what makes the band: half of its width}.
    """

    value: float
    low: float
    high: float
    parts: Numbers


@dataclass(frozen=True)
class Verdict:
    """A prediction beside what was measured; deviation in percent, see `of`."""

    prediction: Prediction
    measured: float
    deviation: float

    @property
    def inside(self) -> bool:
        """Whether the measured number lies in the band."""
        return self.prediction.low <= self.measured <= self.prediction.high


def on_mesh(structure: Structure, mesh: int, **other: float) -> Numbers:
    """Numbers of the model, some parameters changed."""
    given = {name: value for name, (value, _) in structure.parameters.items()}
    return structure.model(mesh, **given | other)


def nominal(structure: Structure) -> tuple[Numbers, Numbers]:
    """Numbers extrapolated over both meshes, and what this added to those of the finer."""
    coarse, fine = (on_mesh(structure, mesh) for mesh in structure.meshes)
    added = {name: (fine[name] - coarse[name]) / 3 for name in fine}
    return {name: fine[name] + more for name, more in added.items()}, added


def predict(structure: Structure) -> dict[str, Prediction]:
    """All numbers of a structure with their bands."""
    values, added = nominal(structure)
    parts = {name: {"mesh": abs(more)} for name, more in added.items()}
    for parameter, (value, spread) in structure.parameters.items():
        less, more = (
            on_mesh(structure, structure.meshes[0], **{parameter: value + sign * spread})
            for sign in (-1, 1)
        )
        for name, part in parts.items():
            part[parameter] = abs(more[name] - less[name]) / 2
    width = {name: float(np.linalg.norm([*part.values()])) for name, part in parts.items()}
    return {
        name: Prediction(value, value - width[name], value + width[name], parts[name])
        for name, value in values.items()
    }


def write(structure: Structure, date: str) -> None:
    """Keep a prediction; one line a number."""
    lines = [f'date = "{date}"', f'note = """{structure.note}"""', "", "[parameters]"]
    lines += [f"{name} = [{v!r}, {s!r}]" for name, (v, s) in structure.parameters.items()]
    lines += ["", "[numbers]"]
    for name, one in predict(structure).items():
        held = {"value": one.value, "low": one.low, "high": one.high, **one.parts}
        inner = ", ".join(f"{key} = {float(f'{x:.6g}')!r}" for key, x in held.items())
        lines.append(f'"{name}" = {{{inner}}}')
    PREDICTED.joinpath(f"{structure.name}.toml").write_text("\n".join([*lines, ""]))


def read(name: str) -> dict[str, Prediction]:
    """A prediction that was kept."""
    numbers = tomllib.loads(PREDICTED.joinpath(f"{name}.toml").read_text())["numbers"]
    return {
        key: Prediction(row.pop("value"), row.pop("low"), row.pop("high"), row)
        for key, row in numbers.items()
    }


def compare(structure: Structure) -> dict[str, Verdict]:
    """What was kept beside what was measured."""
    predicted = read(structure.name)
    measured = tomllib.loads(FOUND.joinpath(f"{structure.name}.toml").read_text())["numbers"]
    return {
        name: Verdict(
            predicted[name], x, 100 * (predicted[name].value - x) / of(structure, name, x)
        )
        for name, x in measured.items()
    }


def of(structure: Structure, name: str, measured: float) -> float:
    """What a deviation is a part of: the span for displacements, else what was measured."""
    return structure.span if structure.span and "[deg]" not in name else abs(measured)
