"""What acts on a sheet as time goes on: loads, pressure that follows, driven nodes, rigid tools.

Source:
    Tools with Coulomb's friction: Wriggers, Computational Contact Mechanics, 2nd ed. (2006).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rom.arguments import (
    Count,
    Length,
    Number,
    check_places,
    finite,
    not_negative,
    number,
    typed,
    whole,
)
from rom.components.assumed_strain.triangles import Sheet, sides_of, whole_numbers
from rom.components.histories import History, straightened
from rom.errors import ConfigError, MeshError
from rom.model import Array, Index
from rom.names import check_once, check_text

SHEAR_RATIO = 0.1  # stiffness along a face before a node slides, over that across
TOUCH_RTOL = 1e-6  # depth over the longest side of the outline that counts as touching at the start


@dataclass(frozen=True, slots=True)
class Load:
    """Dead forces.

    Attributes:
        forces: (n, 2) [N]; per radian times 2 pi, that is of the whole ring, with axial symmetry.
        history: factor [1]: a number, a function of times, or times [s] and factors (m,).
    """

    forces: npt.ArrayLike
    history: History = 1.0


@dataclass(frozen=True, slots=True)
class Traction:
    """Pressure and shear on outer sides; both turn and grow with the sides.

    Attributes:
        sides: (k, 2) node numbers, rows of `outer_sides` [1].
        pressure: into the solid [Pa].
        shear: along the sides, with the solid on the left [Pa].
        history: factor, as of `Load` [1].
    """

    sides: npt.ArrayLike
    pressure: float = 0.0
    shear: float = 0.0
    history: History = 1.0


@dataclass(frozen=True, slots=True)
class Drive:
    """Prescribed displacements.

    Attributes:
        dofs: (k,) dof numbers, 2 * node + axis.
        history: displacements from the start [m]: a function of times (m,) [s] that returns (m,) or
            (m, k), or times [s] and such displacements.
    """

    dofs: npt.ArrayLike
    history: History


@dataclass(frozen=True, slots=True)
class Tool:
    """A rigid convex body that the nodes of the sheet cannot enter.

    Attributes:
        name: of messages.
        outline: (k, 2) corners, counter-clockwise [m]; `disc` makes a round one.
        friction: Coulomb's coefficient [1]; infinite for a rough tool that holds what it touches.
        history: displacements of the tool [m]: a function of times (m,) [s] that returns (m, 2), or
            times [s] and displacements (m, 2).
    """

    name: str
    outline: npt.ArrayLike
    friction: float = 0.0
    history: History = ((0.0,), ((0.0, 0.0),))


@typed
@dataclass(frozen=True, slots=True)
class Actions:
    """All that acts on a sheet.

    Attributes:
        held: (k,) dof numbers that do not move.
        loads: dead ones.
        tractions: pressure and shear.
        drives: prescribed motion.
        tools: rigid ones.
    """

    held: npt.ArrayLike = ()
    loads: Sequence[Load] = ()
    tractions: Sequence[Traction] = ()
    drives: Sequence[Drive] = ()
    tools: Sequence[Tool] = ()


@dataclass(frozen=True, slots=True)
class Prepared:
    """Actions as arrays; columns of the table are factors, displacements, and places of tools."""

    times: Array  # (m,) [s] at which a history has a corner
    table: Array  # (m, c) loads, tractions, driven dofs, two for each tool
    loads: Array  # (q, n, 2) [N]
    sides: Index  # (w, 2), with the solid on the left
    stress: Array  # (w, 2) pressure and shear [Pa]
    of_side: Index  # (w,) column of the factor
    driven: Index  # (k,) dof numbers, the held ones last
    columns: Index  # (k,) of these; -1 for held ones
    faces: Array  # (f, 7) corner, unit tangent and outer normal of each face of a tool, its length
    first: Index  # (tools + 1,) where the faces of each tool begin
    friction: Array  # (tools,) [1]
    names: tuple[str, ...]  # of the tools

    @property
    def forces(self) -> tuple[Array, Index, Array, Index]:
        """What `kernels.applied` takes."""
        return self.loads, self.sides, self.stress, self.of_side

    def faces_of(self, k: int) -> Array:
        """(f, 7) faces of a tool."""
        return self.faces[self.first[k] : self.first[k + 1]]

    def at(self, t: float) -> Array:
        """(c,) values of all histories [1 or m]."""
        k = int(np.clip(np.searchsorted(self.times, t, "right") - 1, 0, len(self.times) - 2))
        s = (t - self.times[k]) / (self.times[k + 1] - self.times[k])
        s = min(max(s, 0.0), 1.0)
        return np.asarray((1 - s) * self.table[k] + s * self.table[k + 1])

    def displacements(self, t: float) -> Array:
        """(k,) of the driven dofs [m]."""
        return np.where(self.columns < 0, 0.0, np.append(self.at(t), 0.0)[self.columns])

    def places(self, t: float) -> Array:
        """(tools, 2) displacements of the tools [m]."""
        tools = len(self.friction)
        return self.at(t)[self.table.shape[1] - 2 * tools :].reshape(tools, 2)


@dataclass(frozen=True, slots=True)
class Touch:
    """What a tool does to nodes."""

    forces: Array  # (n, 2) on the nodes [N]
    slip: Array  # (n,) elastic slip, which the friction holds [m]
    entries: tuple[Index, Array]  # nodes (k,) and their stiffness (k, 2, 2) [N/m]


def touch(
    x: Array, moved: Array, slip: Array, faces: Array, friction: float, stiff: Array
) -> Touch:
    """Penalty of a tool of faces (f, 7), as `Prepared` has them, and friction by return mapping.

    Positions x (n, 2) [m] are seen from the tool, along which they ``moved`` (n, 2) in this step,
    with the elastic slip (n,) before it; ``stiff`` (n,) is the stiffness across a face [N/m].
    """
    gaps = np.einsum("nfa,fa->nf", x[:, None] - faces[:, :2], faces[:, 4:6])
    face, depth = gaps.argmax(axis=1), np.maximum(-gaps.max(axis=1), 0.0)
    along, normal, inside = faces[face, 2:4], faces[face, 4:6], depth > 0
    pressed, hold = stiff * depth, SHEAR_RATIO * stiff
    shear = -hold * np.where(inside, slip + (moved * along).sum(axis=1), 0.0)
    limit = np.zeros(len(x))
    limit[inside] = friction * pressed[inside]
    slides = np.abs(shear) >= limit
    shear[slides] = np.sign(shear[slides]) * limit[slides]
    forces = pressed[:, None] * normal + shear[:, None] * along
    i = np.flatnonzero(inside)
    n, s, K = normal[i], along[i], stiff[i, None, None]
    turn = np.where(slides[i], friction * np.sign(shear[i]), 0.0) if friction < np.inf else 0 * i
    A = K * (n + turn[:, None] * s)[:, :, None] * n[:, None, :]
    A = A + np.where(slides[i], 0.0, SHEAR_RATIO)[:, None, None] * K * s[:, :, None] * s[:, None, :]
    return Touch(forces, -shear / hold, (i, A))


@typed
def outer_sides(body: Sheet) -> Index:
    """(k, 2) nodes of the sides at the edge of a sheet, the solid on the left."""
    return sides_of(body.triangles)[(body.patch[:, 3:] == body.triangles).T.ravel()]


@typed
def disc(
    center: Annotated[npt.ArrayLike, Number("m", (2,))],
    radius: Length,
    *,
    n: Annotated[int, Count(3)] = 120,
) -> Array:
    """(n, 2) corners of a round outline; flat between them, they lie on the circle [m].

    The center is (2,) [m].
    """
    angle = 2 * np.pi * np.arange(n) / n
    return np.asarray(center) + radius * np.column_stack([np.cos(angle), np.sin(angle)])


def prepared(body: Sheet, actions: Actions, span: tuple[float, float] = (0.0, 1.0)) -> Prepared:
    """Check actions and put them into arrays; histories become lines over a span of time [s]."""
    loads = np.zeros((len(actions.loads), *body.points.shape))
    for k, load in enumerate(actions.loads):
        loads[k] = nodal(f"forces of load {k}", load.forces, body)
    sides = [_outer(body, k, traction) for k, traction in enumerate(actions.tractions)]
    of = np.repeat(np.arange(len(sides)), [len(s) for s in sides])
    stress = np.array([[x.pressure, x.shear] for x in actions.tractions], dtype=float)
    pressed = np.vstack([np.zeros((0, 2), dtype=np.int64), *sides]), stress.reshape(-1, 2)[of]
    moved = [dofs_of(x.dofs, body, f"drive {k}:") for k, x in enumerate(actions.drives)]
    driven = _driven(dofs_of(actions.held, body), moved, len(loads) + len(sides))
    lines = _table(actions, [m.size for m in moved], span)
    faces = [np.zeros((0, 7)), *(_faces(tool) for tool in actions.tools)]
    tools = np.vstack(faces), np.cumsum([len(f) for f in faces])
    friction = np.array([tool.friction for tool in actions.tools], dtype=float)
    names = tuple(tool.name for tool in actions.tools)
    made = Prepared(*lines, loads, *pressed, len(loads) + of, *driven, *tools, friction, names)
    _refuse_overlap(body, made)
    return made


def _driven(held: Index, moved: list[Index], first: int) -> tuple[Index, Index]:
    """Dofs of all drives, then held ones; their columns of the table, -1 for held ones."""
    by_drives = np.concatenate([*moved, np.zeros(0, dtype=np.int64)])
    check_once(by_drives.tolist(), "drives: dof")
    driven = np.concatenate([by_drives, np.setdiff1d(held, by_drives)])
    columns = np.full(driven.size, -1)
    columns[: by_drives.size] = first + np.arange(by_drives.size)
    return driven, columns


def nodal(name: str, values: npt.ArrayLike, body: Sheet) -> Array:
    """Finite values (n, 2) at the nodes of the sheet; kernels check no bounds."""
    return np.ascontiguousarray(finite(name, values, body.points.shape))


def dofs_of(held: npt.ArrayLike, body: Sheet, name: str = "held") -> Index:
    """Numbers of dofs, 2 * node + axis."""
    dofs = whole_numbers(f"{name} dofs", held).ravel()
    check_places(f"{name} dofs (2 * node + axis)", dofs, body.points.size)
    return dofs


def _outer(body: Sheet, k: int, traction: Traction) -> Index:
    """Sides of a traction; each must be at the edge, and turned as there."""
    wanted = whole_numbers(f"traction {k}: sides", traction.sides, (None, 2))
    for what in ("pressure", "shear"):
        number(f"traction {k}: {what}", getattr(traction, what))
    there = {tuple(side) for side in outer_sides(body).tolist()}
    if strange := [side for side in wanted.tolist() if tuple(side) not in there]:
        a, b = strange[0]
        text = f"traction {k}: the side {a}-{b} is not an outer one with the solid on the left"
        raise ConfigError(f"{text}; take rows of outer_sides.")
    return wanted


def _faces(tool: Tool) -> Array:
    """(f, 7) corner, tangent, outer normal, length; a tool must be convex."""
    name = f"tool {check_text(tool.name, 'a tool')!r}"
    X = finite(f"{name}: the outline", tool.outline, (None, 2))
    whole(f"{name}: corners of the outline", len(X), 3)
    not_negative(f"{name}: friction", tool.friction, infinite=True)
    along = np.roll(X, -1, axis=0) - X
    length = np.linalg.norm(along, axis=1)
    if not length.min() > 0:
        raise ConfigError(f"{name}: a corner of the outline is there twice; use it once.")
    t = along / length[:, None]
    turn = np.roll(t, -1, axis=0)
    if np.any(t[:, 0] * turn[:, 1] - t[:, 1] * turn[:, 0] < -1e-9):
        text = f"{name}: the outline is not convex, or clockwise"
        raise ConfigError(f"{text}; make a hollow tool of several, counter-clockwise ones.")
    return np.column_stack([X, t, t[:, 1], -t[:, 0], length])


def _table(actions: Actions, moved: list[int], span: tuple[float, float]) -> tuple[Array, Array]:
    """Times and values of all histories together, constant before the first and after the last."""
    asked = [(f"load {k}", x.history, 1) for k, x in enumerate(actions.loads)]
    asked += [(f"traction {k}", x.history, 1) for k, x in enumerate(actions.tractions)]
    asked += [(f"drive {k}", x.history, moved[k]) for k, x in enumerate(actions.drives)]
    asked += [(f"tool {x.name!r}", x.history, 2) for x in actions.tools]
    lines = [straightened(n, h, span, k, rows=n.startswith("tool")) for n, h, k in asked]
    times = np.unique(np.concatenate([[0.0], *(t for t, _ in lines)]))
    times = np.append(times, times[-1] + 1.0)
    columns = [np.interp(times, t, column) for t, y in lines for column in y.T]
    return times, np.array(columns).T.reshape(len(times), -1).copy()


def _refuse_overlap(body: Sheet, made: Prepared) -> None:
    """No node in a tool at the start, and no corner of a tool in a triangle."""
    X = body.points
    for k, (name, offset) in enumerate(zip(made.names, made.places(0.0), strict=True)):
        faces = made.faces_of(k)
        gap = np.einsum("nfa,fa->nf", X[:, None] - offset - faces[:, :2], faces[:, 4:6]).max(axis=1)
        if gap.min() < -TOUCH_RTOL * faces[:, 6].max():
            text = f"tool {name!r} starts {-gap.min():.3g} m inside the sheet"
            raise MeshError(f"{text} at node {gap.argmin()}; move it until it only touches.")
        corner = _covered(body, faces[:, :2] + offset)
        if corner >= 0:
            raise MeshError(f"corner {corner} of tool {name!r} starts inside the sheet; move it.")


def _covered(body: Sheet, places: Array) -> int:
    """Number of a place inside a triangle by more than a touch; -1 if there is none."""
    a, b, c = (body.points[body.triangles[:, k]] for k in range(3))
    sides = (a, b), (b, c), (c, a)
    for k, p in enumerate(places):
        parts = [np.linalg.det(np.stack([v - u, p - u], axis=-1)) for u, v in sides]
        if np.any(np.min(parts, axis=0) > 2 * 1e-3 * body.area):
            return k
    return -1
