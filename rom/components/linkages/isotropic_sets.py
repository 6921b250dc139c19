"""Two-dof mechanisms by their isotropic sets, and one figure that compares them.

The inertia A(q) is isotropic where f = (a11 - a22, 2 a12) / tr A vanishes. By the rank of the
derivative of f a mechanism has no such posture, points (rank 2, each with a winding), curves
(rank 1) or is isotropic everywhere. Where A has an analytic formula, as of all linkages, f vanishes
on a whole piece of the plane only if it does everywhere.

Isotropy of drives compares motors. What a tool feels is the inertia J^-T A J^-1 [kg], with the
velocities J of the tool per unit of both rates: its index knows neither gears nor the kind of
drives. `tool_isotropy` is the mean over the area which the tool reaches.

Source:
    After Di Gregorio, Cammarata and Sinatra on the dynamic isotropy of two-dof mechanisms; the
    inertia at the tool is that of Khatib, IEEE J. Robotics Automation 3 (1987) 43. The figure of
    merit is derived here.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt

from rom.arguments import typed
from rom.arguments.quantities import Count
from rom.components.linkages.dynamic_isotropy import (
    TURNS,
    Assembles,
    Cells,
    Inertia,
    Lengths,
    Ranges,
    angle_grid,
    anisotropy,
    anisotropy_gradient,
    around,
    checked,
    derivatives,
    inertia_at,
    isotropic_configurations,
    isotropy_index,
)
from rom.errors import ModelError
from rom.model import Array, Index

Tip = Callable[[Array, Array], Array]  # coordinates of equal shape (...) -> (..., 2)
EVERYWHERE_ATOL = 1e-9  # of f: below it in all postures, A is a multiple of the identity
CURVE_STEP = 0.01  # along a curve of isotropy, to see whether it goes on [rad]


@dataclass(frozen=True, slots=True)
class IsotropicSet:
    """Where a mechanism is isotropic.

    Attributes:
        kind: "none", "points", "curves" (and points beside them, if any) or "everywhere".
        q: (k, 2) isotropic configurations, on curves one per cell of the search [rad or m].
        inertia: (k,) of both drives there, per square of the lengths [kg m^2 or kg].
        winding: (k,) 1 or -1 for an isolated point, 0 for one of a curve.
    """

    kind: Literal["none", "points", "curves", "everywhere"]
    q: Array
    inertia: Array
    winding: Index


@typed
def isotropic_set(
    inertia: Inertia,
    ranges: Ranges = TURNS,
    *,
    lengths: Lengths = (1.0, 1.0),
    n: Cells = 120,
    assembles: Assembles | None = None,
) -> IsotropicSet:
    """The isotropic postures of a mechanism, and of what kind they are.

    Args:
        inertia: function of two arrays (...) of coordinates that returns (..., 2, 2).
        ranges: (low, high) of each coordinate [rad or m]; None for an angle that makes whole turns.
        lengths: (2,) by which coordinates are multiplied, as in `isotropy_index` [1 or m]: (L, 1)
            for an angle before a displacement. The set depends on this characteristic length.
        n: cells of the search along each coordinate.
        assembles: function of the same coordinates that says where there is an inertia; None:
            everywhere.

    Raises:
        ConfigError: for ranges or lengths that cannot be, or a grid of less than four cells.
        ModelError: if the mechanism can be assembled nowhere or has no inertia.
        SolverError: if the windings of isolated points of a torus do not add up to zero.
    """
    q1, q2 = angle_grid(n)
    there = _Stretched(checked(ranges), n, inertia, lengths, assembles)
    inside = there.assembles(q1, q2)
    if inside.any():
        q = np.column_stack([q1[inside], q2[inside]])
        if np.abs(anisotropy(there.inertia, *q.T)).max() < EVERYWHERE_ATOL:
            A = there.inertia(*q.T)[:, 0, 0]
            return IsotropicSet("everywhere", there.coordinates(q), A, np.zeros(len(q), int))
    whole = ranges == TURNS and assembles is None
    inside_of = None if whole else there.assembles
    found = isotropic_configurations(there.inertia, n=n, assembles=inside_of)
    goes_on = _goes_on(there, found.q[found.winding == 0])
    kind: Literal["none", "points", "curves"] = "points" if len(found.q) else "none"
    kind = "curves" if goes_on.any() else kind
    return IsotropicSet(kind, there.coordinates(found.q), found.inertia, found.winding)


def _goes_on(there: "_Stretched", q: Array) -> npt.NDArray[np.bool_]:
    """(k,) whether isotropy goes on beside configurations (k, 2), along what f does not see."""
    along = np.linalg.svd(anisotropy_gradient(there.inertia, q))[2][:, 1] if len(q) else q
    result = np.zeros(len(q), bool)
    for sign in (1, -1):
        x = q + sign * CURVE_STEP * along
        fits = around(there.assembles, x)
        for _ in range(6):
            fits = fits & around(there.assembles, x)
            at = x[fits]
            J, f = anisotropy_gradient(there.inertia, at), anisotropy(there.inertia, *at.T)
            x[fits] = at - np.einsum("kij,kj->ki", np.linalg.pinv(J, rcond=1e-4), f)
        fits = fits & around(there.assembles, x)
        f = anisotropy(there.inertia, *x[fits].T)
        far = np.linalg.norm(x - q, axis=1)[fits] > 0.5 * CURVE_STEP
        result[fits] |= (np.abs(f).max(axis=1, initial=0.0) < EVERYWHERE_ATOL) & far
    return result


@dataclass(frozen=True, slots=True)
class ToolIsotropy:
    """How equal a tool feels the inertia of a mechanism in all directions.

    Attributes:
        mean: index over the reached area, from 0 to 1 [1].
        best: the largest in a cell [1].
        area: which the tool reaches, counted once for each posture that does [m^2].
    """

    mean: float
    best: float
    area: float


@typed
def tool_isotropy(
    inertia: Inertia,
    tip: Tip,
    ranges: Ranges = TURNS,
    *,
    n: Annotated[int, Count(1)] = 200,
    assembles: Assembles | None = None,
) -> ToolIsotropy:
    """Mean isotropy of the inertia at the tool, weighted by the area it reaches.

    The mean of 2 sqrt(det L) / tr L for L = J^-T A J^-1, each posture weighing |det J|. It is the
    same in other units and coordinates, for angles and displacements, and for a mechanism made
    larger or heavier as a whole: so it compares mechanisms of different topology. Where the tool
    cannot move in some direction it counts as zero.

    Args:
        inertia: function of two arrays (...) of coordinates that returns (..., 2, 2).
        tip: function of the same coordinates that returns the place of the tool (..., 2) [m].
        ranges: (low, high) of each coordinate [rad or m]; None for an angle that makes whole turns.
        n: cells of the midpoint rule along each coordinate.
        assembles: function of the same coordinates that says where there is an inertia; None:
            everywhere.

    Raises:
        ConfigError: for ranges that cannot be, or no cell.
        ModelError: if it can be assembled nowhere, has no inertia or place of the tool, or the tool
            moves along a line.
    """
    there = _Stretched(checked(ranges), n, inertia, (1.0, 1.0), assembles, closed=True)
    middles = 2 * np.pi * (np.arange(n) + 0.5) / n
    q = np.stack(np.meshgrid(middles, middles, indexing="ij"), axis=-1).reshape(-1, 2)
    q = q[around(there.assembles, q)]
    if not len(q):
        raise ModelError("none of the postures can be assembled: the tool reaches nothing.")
    J = derivatives(lambda *at: _place(tip, there.coordinates(np.column_stack(at))), q)
    weight = np.abs(np.linalg.det(J)) * (2 * np.pi / n) ** 2
    if weight.sum() <= 1e-9 * np.square(J).sum() * (2 * np.pi / n) ** 2:
        raise ModelError("the tool moves along a line; its two drives must move it in a plane.")
    q, J, weight = q[weight > 0], J[weight > 0], weight[weight > 0]
    # a positive matrix of two rows has the index of its inverse
    A = there.inertia(*q.T) * np.multiply.outer(there.slopes(), there.slopes())
    index = isotropy_index(J @ np.linalg.solve(A, np.swapaxes(J, -1, -2)))
    return ToolIsotropy(
        float(index @ weight / weight.sum()), float(index.max()), float(weight.sum())
    )


def _place(tip: Tip, q: Array) -> Array:
    """(k, 2) the tool at coordinates (k, 2), if the function gives one place for each."""
    if np.shape(x := tip(*q.T)) != q.shape:
        text = f"tip returns the shape {np.shape(x)} for {len(q)} postures, not {q.shape}"
        raise ModelError(f"{text}; write it for arrays, a place is two numbers.")
    return x


@dataclass(frozen=True, slots=True)
class _Stretched:
    """Coordinates within ranges as two angles of one turn, which a grid of n cells covers.

    A range that is no turn ends one node before the last, so that no cell of the grid closes over
    its ends; ``closed`` for midpoints, which need no nodes: it fills the turn.
    """

    ranges: Ranges
    n: int
    of: Inertia
    lengths: npt.ArrayLike
    there: Assembles | None
    closed: bool = False

    def coordinates(self, angles: Array) -> Array:
        """(k, 2) coordinates [rad or m] of angles (k, 2) [rad]."""
        columns = [
            a if r is None else r[0] + (r[1] - r[0]) * a / self._end()
            for a, r in zip(angles.T, self.ranges, strict=True)
        ]
        return np.column_stack(columns)

    def inertia(self, q1: Array, q2: Array) -> Array:
        """Inertia for the rates of both coordinates, multiplied by lengths."""
        q = self.coordinates(np.column_stack([np.ravel(q1), np.ravel(q2)]))
        A = inertia_at(self.of, *q.T).reshape(*np.shape(q1), 2, 2)
        return A / np.multiply.outer(self.lengths, self.lengths)

    def assembles(self, q1: Array, q2: Array) -> npt.NDArray[np.bool_]:
        """Whether angles (...) lie within the ranges, and the mechanism can be assembled."""
        inside, limit = np.ones(np.shape(q1), bool), self._end() * (1 + 1e-12)
        for a, r in zip((q1, q2), self.ranges, strict=True):
            inside &= (r is None) | ((a >= 0) & (a <= limit))
        if self.there is not None:
            q = self.coordinates(np.column_stack([q1[inside], q2[inside]]))
            inside[inside] = self.there(*q.T)
        return inside

    def slopes(self) -> Array:
        """(2,) coordinates per angle [1 or m]."""
        return np.array([1.0 if r is None else (r[1] - r[0]) / self._end() for r in self.ranges])

    def _end(self) -> float:
        return 2 * np.pi * (1.0 if self.closed else 1 - 2 / self.n)
