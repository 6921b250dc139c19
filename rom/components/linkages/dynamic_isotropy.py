"""Dynamic isotropy: where two motors feel the same inertia, whatever the direction.

The kinetic energy of a mechanism with two degrees of freedom is q'^T A(q) q' / 2. It is isotropic
where A is a multiple of the identity: a11 = a22 and a12 = 0. Two equations for two angles leave
isolated points in general. The index 2 sqrt(det A) / tr A is one there and smaller elsewhere; on
the torus of both angles its level curves are closed, within strokes some go from limit to limit.
Around an isolated isotropic point the vector ((a11 - a22) / 2, a12) winds once, to the left or to
the right, and on the torus these windings add up to zero.

Source:
    After Di Gregorio, Cammarata and Sinatra on the dynamic isotropy of two-dof mechanisms; their
    index was not available, the one here has the same loci as the ratio of the eigenvalues.
"""

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rom.arguments import shortened, typed
from rom.arguments.quantities import Count, Positive
from rom.errors import ConfigError, ModelError, SolverError
from rom.model import Array, Index
from rom.process.spreading import spread

# angles of equal shape (...) -> (...) true or false
Assembles = Callable[[Array, Array], npt.ArrayLike]
Inertia = Callable[[Array, Array], Array]  # angles of equal shape (...) -> (..., 2, 2)
Range = tuple[float, float] | None  # of a coordinate [rad or m]; None: a whole turn
Ranges = tuple[Range, Range]
TURNS: Ranges = (None, None)
Lengths = Annotated[npt.ArrayLike, Positive("1", (2,))]
Cells = Annotated[int, Count(4)]  # of a turn or a range
DIFFERENCE_STEP = 1e-5  # of central differences [rad]
# least Jacobian of the normalised equations for an isotropic point that stands alone
MIN_JACOBIAN = 1e-6
SETTLED_ATOL = 1e-9  # of both equations: nearer, a step that does not halve them is round-off
DETERMINANT_RTOL = 1e-12  # of the squared trace: round-off by which a determinant is negative


@typed
def isotropy_index(A: Array, *, lengths: Lengths = (1.0, 1.0)) -> Array:
    """(...,) index 2 sqrt(det A) / tr A [1], one where isotropic; independent of the scale of A.

    Args:
        A: (..., 2, 2) generalised inertia [kg m^2].
        lengths: (2,) by which the coordinates are multiplied first [1 or m]: (1, 1) for two angles,
            (L, 1) with a characteristic length L for an angle beside a displacement.

    Raises:
        ConfigError, ModelError: for lengths that are not positive; for an inertia that is not.
    """
    _, trace, determinant = _positive(A / np.multiply.outer(lengths, lengths))
    return 2 * np.sqrt(np.maximum(determinant, 0.0)) / trace


@typed
def christoffel(inertia: Inertia, q: npt.ArrayLike) -> Array:
    """(2, 2, 2) symbols of the first kind: motors give A q'' + sum_jk symbols[:, j, k] q'_j q'_k.

    All are zero where the mechanism is dynamically uniform. By central differences.
    """
    D = derivatives(inertia, np.asarray(q, dtype=float)[None])[0]  # D[:, :, k] = dA / dq_k
    return 0.5 * (D + D.transpose(0, 2, 1) - D.transpose(2, 0, 1))


def derivatives(function: Inertia, q: Array) -> Array:
    """(k, ..., 2) central differences of a function at (k, 2), its unit over that [rad or m]."""
    ends = [[function(*(q + s * e).T) for s in (1, -1)] for e in DIFFERENCE_STEP * np.eye(2)]
    return np.stack([up - down for up, down in ends], axis=-1) / (2 * DIFFERENCE_STEP)


@typed
def angle_grid(n: Cells, ranges: Ranges = TURNS) -> tuple[Array, Array]:
    """(n, n), (n, n) coordinates of both drives [rad or m], the first along the rows.

    There are n nodes along each; a turn ends one node before it repeats, a range at both its ends.
    Ranges are (low, high) of each coordinate [rad or m]; None for an angle that makes whole turns.
    """
    at = (
        2 * np.pi * np.arange(n) / n if r is None else np.linspace(*r, n) for r in checked(ranges)
    )
    q1, q2 = np.meshgrid(*at, indexing="ij")
    return q1, q2


def checked(ranges: Ranges) -> Ranges:
    """The ranges (low, high) [rad or m] if they can be."""
    for r in ranges:
        if r is not None and not (np.isfinite(r).all() and r[0] < r[1]):
            raise ConfigError(f"a range {r!r} must be (low, high), low < high, or None for a turn.")
    return ranges


@dataclass(frozen=True, slots=True)
class Isotropic:
    """Isotropic configurations.

    Attributes:
        q: (k, 2) angles from 0 to below 2 pi [rad], ascending.
        inertia: (k,) the inertia both motors feel [kg m^2].
        winding: (k,) 1 or -1 for an isolated point, 0 for a point of a curve of isotropy.
    """

    q: Array
    inertia: Array
    winding: Index


@typed
def index_map(
    inertia: Inertia,
    ranges: Ranges = TURNS,
    *,
    lengths: Lengths = (1.0, 1.0),
    n: Cells = 400,
    assembles: Assembles | None = None,
    executor: Executor | None = None,
) -> Array:
    """(n, n) isotropy index on `angle_grid` [1], zero where the mechanism cannot be assembled.

    At the border of what can be assembled a motor feels an unbounded inertia: the index goes to
    zero there, and its loci stay closed.

    Args:
        inertia: function of two arrays of coordinates (...) that returns (..., 2, 2).
        ranges: (low, high) of each coordinate [rad or m]; None for an angle that makes whole turns.
        lengths: (2,) as in `isotropy_index` [1 or m]: (L, 1) for an angle before a displacement.
        n: number of nodes along each coordinate.
        assembles: function of the same coordinates that says where there is an inertia; None:
            everywhere.
        executor: of `concurrent.futures`, whose workers share the nodes; None for none.

    Raises:
        ConfigError, ModelError: for ranges that cannot be; if it can be assembled nowhere, or the
            function returns no inertia.
    """
    q1, q2 = angle_grid(n, ranges)
    there, index = _there(assembles, q1, q2, n), np.zeros((n, n))
    parts = np.array_split(np.stack([q1[there], q2[there]]), 1 if executor is None else n, axis=1)
    A = np.concatenate(spread(partial(_inertia_at, inertia), parts, executor))
    index[there] = isotropy_index(A, lengths=lengths)
    return index


def _inertia_at(inertia: Inertia, q: Array) -> Array:
    return inertia_at(inertia, *q)


def _there(assembles: Assembles | None, q1: Array, q2: Array, n: int) -> Array:
    """(n, n) where the mechanism can be assembled, if there is such a place."""
    there = np.ones(q1.shape, bool) if assembles is None else np.asarray(assembles(q1, q2), bool)
    if not there.any():
        text = f"none of {n} by {n} positions of the cranks can be assembled"
        raise ModelError(f"{text}; lengthen the couplers, or bring the pivots closer.")
    return there


@typed
def isotropic_configurations(
    inertia: Inertia, *, n: Cells = 400, assembles: Assembles | None = None
) -> Isotropic:
    """All isotropic configurations on the torus of two angles, or on a part of it.

    Cells of an n by n grid in which both equations may change sign are refined by Newton.

    Args:
        inertia: function of two arrays of angles (...) that returns (..., 2, 2).
        n: number of cells per turn; points closer than a cell may be taken for one.
        assembles: function of the same angles that says where there is an inertia, as
            `FiveBar.assembles`; None: everywhere. Cells that its border crosses are left out, and
            the windings of a part need not add up to zero.

    Raises:
        ModelError: if the mechanism can be assembled nowhere, or the function returns no inertia.
        SolverError: if the windings of isolated points do not add up to zero: some were missed.
    """
    q1, q2 = angle_grid(n)
    there = _there(assembles, q1, q2, n)
    f = np.full((n, n, 2), np.nan)
    f[there] = anisotropy(inertia, q1[there], q2[there])
    start = _suspects(f)
    q = _refined(inertia, 2 * np.pi * (start + 0.5) / n, assembles)
    q = _distinct(q[np.abs(anisotropy(inertia, *q.T)).max(axis=1, initial=0.0) < 1e-11])
    turn = np.linalg.det(anisotropy_gradient(inertia, q))
    winding = np.where(np.abs(turn) > MIN_JACOBIAN, np.sign(turn), 0).astype(int)
    if there.all() and winding.all() and winding.sum():
        text = f"the windings of {winding.size} isotropic points add up to {winding.sum()}, not 0."
        raise SolverError(text, hint=f"Take a finer grid than {n} cells per turn.")
    return Isotropic(q, inertia(*q.T)[:, 0, 0], winding)


def _refined(inertia: Inertia, q: Array, assembles: Assembles | None) -> Array:
    """Where Newton leads from angles (k, 2), as far as there is an inertia around."""
    before, settled = np.full(len(q), np.inf), np.zeros((0, 2))
    for _ in range(40):
        fits = np.ones(len(q), bool) if assembles is None else around(assembles, q)
        q, before = q[fits], before[fits]
        f = anisotropy(inertia, *q.T)
        left = np.abs(f).max(axis=1, initial=0.0)
        moves = (left > SETTLED_ATOL) | (left < 0.5 * before)
        settled = np.vstack([settled, q[~moves]])
        q, f, before = q[moves], f[moves], left[moves]
        if not len(q):
            break
        pinv = np.linalg.pinv(anisotropy_gradient(inertia, q), rcond=1e-9)
        step = -np.einsum("kij,kj->ki", pinv, f)
        q = q + step / np.maximum(np.abs(step).max(axis=1, initial=0.0) / 0.1, 1.0)[:, None]
    q = q if assembles is None else q[around(assembles, q)]
    return np.vstack([settled, q])


def around(assembles: Assembles, q: Array) -> npt.NDArray[np.bool_]:
    """(k,) whether a mechanism can be assembled at angles (k, 2) [rad] and beside them."""
    near = [q + s * e for e in DIFFERENCE_STEP * np.eye(2) for s in (-1, 1)]
    return np.all([np.asarray(assembles(*x.T), bool) for x in (q, *near)], axis=0)


def anisotropy(inertia: Inertia, q1: Array, q2: Array) -> Array:
    """(..., 2) half the difference of the diagonal, and the coupling, over half the trace."""
    A, trace, _ = _positive(inertia_at(inertia, q1, q2))
    return np.stack([(A[..., 0, 0] - A[..., 1, 1]) / trace, 2 * A[..., 0, 1] / trace], axis=-1)


def inertia_at(inertia: Inertia, q1: Array, q2: Array) -> Array:
    """(..., 2, 2) what a function returns at coordinates (...), if it is one inertia for each."""
    A, wanted = inertia(q1, q2), (*np.shape(q1), 2, 2)
    if np.shape(A) != wanted or np.asarray(A).dtype.kind not in "iuf":
        text = f"inertia returns {shortened(A)}; for arrays of angles {np.shape(q1)} it must return"
        raise ModelError(f"{text} numbers of the shape {wanted}, not {np.shape(A)}.")
    return np.asarray(A, dtype=float)


def _positive(A: Array) -> tuple[Array, Array, Array]:
    """A (..., 2, 2) if it can be an inertia, its positive trace and determinant, not negative."""
    if np.shape(A)[-2:] != (2, 2):
        raise ModelError(f"an inertia of two motors must be (..., 2, 2), not {np.shape(A)}.")
    trace = A[..., 0, 0] + A[..., 1, 1]
    determinant = A[..., 0, 0] * A[..., 1, 1] - A[..., 0, 1] * A[..., 1, 0]
    if not ((trace > 0) & (determinant > -DETERMINANT_RTOL * trace**2)).all():
        raise ModelError("the inertia must be positive, or some motion has no kinetic energy.")
    return A, trace, determinant


def anisotropy_gradient(inertia: Inertia, q: Array) -> Array:
    """(k, 2, 2) derivatives of `anisotropy` at angles (k, 2) [rad], by central differences."""
    return derivatives(partial(anisotropy, inertia), q)


def _suspects(f: Array) -> Index:
    """(k, 2) cells of a periodic grid (n, n, 2) in which both values may vanish."""
    corners = _corners(f)
    low, high = corners.min(axis=0), corners.max(axis=0)
    margin = 0.25 * (high - low) + 1e-12  # the values are curved between the corners
    return np.argwhere(((low <= margin) & (high >= -margin)).all(axis=-1))


def _corners(f: Array) -> Array:
    """(4, n, n, ...) values at the corners of each cell of a periodic grid, around it."""
    return np.stack([np.roll(f, s, axis=(0, 1)) for s in ((0, 0), (-1, 0), (-1, -1), (0, -1))])


def _distinct(q: Array) -> Array:
    """Angles modulo one turn, each configuration once, ascending."""
    q = np.mod(q, 2 * np.pi)
    kept: list[Array] = []
    for x in q[np.lexsort(q.T[::-1])]:
        apart = [np.abs((x - y + np.pi) % (2 * np.pi) - np.pi).max() for y in kept]
        if not apart or min(apart) > 1e-6:
            kept.append(x)
    return np.array(kept).reshape(-1, 2)


@typed
def closed_loci(index: Array, level: float, ranges: Ranges = TURNS) -> list[Array]:
    """Curves of one value of a field, closed, or within ranges from one limit to another.

    Args:
        index: (n, n) values on `angle_grid`, in units of the field.
        level: the value, in units of the field.
        ranges: (low, high) of each coordinate, as of that grid [rad or m]; None for whole turns.

    Returns:
        (k, 2) coordinates of each curve [rad or m], continuous; the last point of a closed one is
        the first one, moved by whole turns if the curve goes around the torus.

    Raises:
        ConfigError: if the field is no square grid or has gaps; for ranges that cannot be.
    """
    square = np.ndim(index) == 2 and np.shape(index)[0] == np.shape(index)[1] > 1
    if not square or not np.isfinite(index).all():
        raise ConfigError(f"a field {np.shape(index)}: (n, n) finite values are needed.")
    names, neighbours = _joined(index, level, checked(ranges))
    nodes, fresh, curves = _crossings(index, level, names), np.ones(len(names), dtype=bool), []
    ends = np.flatnonzero(neighbours[:, 1] < 0)
    for start in [*ends, *range(len(names))]:
        if not fresh[start]:
            continue
        path, before, at = [start], start, neighbours[start, 0]
        while at not in (start, -1):
            path.append(at)
            one, other = neighbours[at]
            before, at = at, other if one == before else one
        fresh[path] = False
        curves.append(_placed(nodes[[*path, start] if at == start else path], ranges, len(index)))
    return curves


def _placed(nodes: Array, ranges: Ranges, n: int) -> Array:
    """(k, 2) continuous coordinates of places (k, 2) counted in nodes of the grid."""
    columns = [
        2 * np.pi / n * np.unwrap(x, period=n) if r is None else r[0] + (r[1] - r[0]) * x / (n - 1)
        for x, r in zip(nodes.T, ranges, strict=True)
    ]
    return np.column_stack(columns)


def _joined(index: Array, level: float, ranges: Ranges) -> tuple[Index, Index]:
    """Grid edges that the level crosses (k,), and the two crossings next to each (k, 2).

    Each edge belongs to two cells and every cell joins its crossings in pairs: curves cannot end
    but at the limit of a range, whose edges have one cell: their second neighbour is -1.
    """
    n = len(index)
    along = np.arange(n * n).reshape(n, n)  # edge from node (i, j) to (i + 1, j)
    up = n * n + along  # to (i, j + 1)
    sides = np.stack([along, np.roll(up, -1, axis=0), np.roll(along, -1, axis=1), up])
    corners = _corners(index)
    inside = corners >= level
    cut = inside != np.roll(inside, -1, axis=0)
    cut[:, -1:, :] &= ranges[0] is None  # no cells beyond the last node of a range
    cut[:, :, -1:] &= ranges[1] is None
    plain, saddle = cut.sum(axis=0) == 2, cut.all(axis=0)
    pairs = sides[:, plain].T[cut[:, plain].T].reshape(-1, 2)
    bottom, right, top, left = sides[:, saddle]
    through = inside[0, saddle] == (corners.mean(axis=0) >= level)[saddle]
    one = np.column_stack([bottom, np.where(through, right, left)])
    other = np.column_stack([top, np.where(through, left, right)])
    pairs = np.vstack([pairs, one, other])
    ends = np.vstack([pairs, pairs[:, ::-1]])
    ends = ends[np.argsort(ends[:, 0], kind="stable")]
    names, first, count = np.unique(ends[:, 0], return_index=True, return_counts=True)
    neighbours = np.full((len(names), 2), -1)
    neighbours[:, 0] = np.searchsorted(names, ends[first, 1])
    inner = count == 2
    neighbours[inner, 1] = np.searchsorted(names, ends[first[inner] + 1, 1])
    return names, neighbours


def _crossings(index: Array, level: float, names: Index) -> Array:
    """(k, 2) places where the level crosses grid edges, in nodes, linearly interpolated."""
    n = len(index)
    up, node = np.divmod(names, n * n)
    i, j = np.divmod(node, n)
    here, there = index[i, j], index[(i + 1 - up) % n, (j + up) % n]
    share = (level - here) / (there - here)
    return np.column_stack([i + share * (1 - up), j + share * up])
