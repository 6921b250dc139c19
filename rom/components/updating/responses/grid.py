"""Functions of single pairs of sensor and force side by side, at the points of a test."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from rom.components.updating.measured import Channels, Responses
from rom.errors import FileFormatError
from rom.io.fields.universal import FREQUENCY_RESPONSE, Function
from rom.model import Array
from rom.names import named

COHERENCE_KIND = 6  # of functions in universal files
LINES_RTOL = 1e-5  # of frequencies that are the same: files hold six digits
COHERENCE_STEP = 5e-6  # of the last of six digits, by which one may be rounded up to 1
MAX_NAMED = 5  # in a message
ENTITY_LENGTH = 10  # characters of a name in universal files
Dof = tuple[int, int, str]  # node, direction, name of the body or ""
Points = Mapping[int, Array]


def side_by_side(
    functions: tuple[Function, ...],
    points: Points,
    averages: int,
    coherence: float | None,
    bodies: "Bodies",
) -> Responses:
    """Responses of all sensors to all forces; pairs that are missing have the coherence zero.

    Functions, in SI units, are frequency responses and their coherences; one number instead is that
    of all values. Points are {node: (3,) [m]}.
    """
    bodies = bodies.of(functions)
    found = _by_pair([f for f in functions if f.kind == FREQUENCY_RESPONSE], bodies)
    coherences = _by_pair([f for f in functions if f.kind == COHERENCE_KIND], bodies)
    if not found:
        raise FileFormatError("there is no frequency response to a force.")
    if coherence is None and (silent := sorted(set(found) - set(coherences))):
        text = f"there is no coherence of {_some(silent)}."
        hint = "Give one number, coherence=..., from what is known of the noise."
        raise FileFormatError(text, hint=hint)
    sensors, inputs = (sorted({pair[k] for pair in found}) for k in (0, 1))
    x = next(iter(found.values())).x
    keep = x > 0  # no displacement follows from motion at 0 Hz
    H = np.full((len(sensors), len(inputs), x.size), np.nan, dtype=complex)
    c = np.zeros(H.shape)
    for (sensor, force), f in found.items():
        at = sensors.index(sensor), inputs.index(force)
        _check_lines(f, x)
        H[(*at, keep)] = replace(f, x=f.x[keep], y=f.y[keep]).receptance()
        if coherence is not None:
            c[at] = coherence
            continue
        _check_lines(own := coherences[sensor, force], x)
        c[at] = np.real(own.y)
        if not (c[at] >= 1).all():  # what rounding has made one is taken back by half a digit
            c[at][c[at] == 1] = 1 - COHERENCE_STEP
    where = [_channels(dofs, points) for dofs in (sensors, inputs)]
    H, c = (np.moveaxis(A, 2, 0)[keep] for A in (H, c))
    return Responses(x[keep], H, where[0], where[1], c, averages)


@dataclass(frozen=True, slots=True)
class Bodies:
    """To which bodies of an assembly nodes belong.

    Entities in universal files belong to a body by the first ten characters of its name.
    """

    of_nodes: Mapping[int, str]  # {node: body}
    names: Collection[str] = ()  # of all bodies; empty where no entity is one

    def of(self, functions: tuple[Function, ...]) -> "Bodies":
        """Without the names where the entities of no function are bodies."""
        entities = {entity.lower() for f in functions for entity in f.entities}
        return self if entities & {_entity(name) for name in self.names} else Bodies(self.of_nodes)

    def dof(self, dof: tuple[int, int], entity: str) -> Dof:
        """Node and direction with the name of the body, as which the entity counts."""
        node, axis = dof
        if node in self.of_nodes or not self.names:
            return node, axis, self.of_nodes.get(node, "")
        found = [name for name in self.names if _entity(name) == entity.lower()]
        if len(found) != 1 and entity.upper() not in ("", "NONE"):
            text = f"node {node} is of {entity!r}; bodies are {named(self.names)}."
            hint = "Name them as the file does, in ten characters that differ."
            raise FileFormatError(text, hint=hint)
        return node, axis, found[0] if found else ""


def _entity(name: str) -> str:
    return name[:ENTITY_LENGTH].strip().lower()


def _by_pair(functions: list[Function], bodies: Bodies) -> dict[tuple[Dof, Dof], Function]:
    known: dict[tuple[Dof, Dof], Function] = {}
    for f in functions:
        pair = bodies.dof(f.response, f.entities[0]), bodies.dof(f.reference, f.entities[1])
        if not all(1 <= abs(dof[1]) <= 3 for dof in pair):
            one, other = map(_dof, pair)
            raise FileFormatError(f"the function of {one} by {other} is no translation by a force.")
        if pair in known:
            text = f"{_some([pair])} is there twice."
            raise FileFormatError(text, hint="Keep one run, or average them before.")
        known[pair] = f
    return known


def _check_lines(f: Function, x: Array) -> None:
    if f.x.shape != x.shape or not np.allclose(f.x, x, rtol=LINES_RTOL, atol=0):
        pair = (*f.response, ""), (*f.reference, "")
        raise FileFormatError(f"{_some([pair])} has other lines than the first function.")


def _channels(dofs: list[Dof], points: Points) -> Channels:
    if missing := sorted({dof[0] for dof in dofs} - set(points)):
        text = f"nodes without coordinates: {', '.join(map(str, missing[:MAX_NAMED]))}."
        hint = "Universal files have them in dataset 15 or 2411; else name a file, points=..."
        raise FileFormatError(text, hint=hint)
    axes = np.array([np.sign(axis) * np.eye(3)[abs(axis) - 1] for _, axis, _ in dofs])
    owners = tuple(body for *_, body in dofs)
    if any(owners) and not all(owners):
        node = dofs[owners.index("")][0]
        text = f"node {node} has no body, others have one."
        raise FileFormatError(text, hint="Name the bodies of all nodes, or of none.")
    where = np.array([points[node] for node, *_ in dofs])
    return Channels(where, axes, owners if any(owners) else None)


def _dof(dof: Dof) -> str:
    node, axis, _ = dof
    return f"{node}{'+' if axis > 0 else '-'}{'0XYZ'[abs(axis)] if abs(axis) < 4 else abs(axis)}"


def _some(pairs: list[tuple[Dof, Dof]]) -> str:
    names = [f"{_dof(a)}/{_dof(b)}" for a, b in pairs[:MAX_NAMED]]
    return ", ".join(names) + (f" and {len(pairs) - MAX_NAMED} more" * (len(pairs) > MAX_NAMED))
