"""The start of a motion: positions that fit, velocities that fit, accelerations."""

from collections.abc import Container, Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import bmat, csr_matrix, diags, identity

from rom.errors import ModelError, SolverError, warn
from rom.mbs.elements.family import apply_laws
from rom.mbs.equations.equations import evaluate, linearize_constraints, rates, retract
from rom.mbs.equations.linear_solve import factorise_bordered, gradient_times, solve_bordered
from rom.mbs.equations.packing import Packed
from rom.mbs.equations.sparse_solve import Constrained, Pattern, signature, unit_rows
from rom.mbs.kernels.system import ROLL
from rom.mbs.kernels.work import Work, workspace
from rom.mbs.parts.signals import Signal, Span, sampled
from rom.mbs.results.state import State
from rom.model import Array, Integers
from rom.notebook import listed

# relative singular value below which a constraint counts as a copy of others: assembled
# mechanisms show 1e-12 and less, independent constraints 1e-4 and more
RANK_TOLERANCE = 1e-8
# the same of pivots, which are squares, where rows of length one are eliminated by blocks: copies
# leave 1e-11 in linkages of dozens of bodies
RANK_PIVOT_RTOL = 1e-9
# a gap that rigid motion can close is not closed by deformation: elastic coordinates weigh so much
# that they do not move, and only where a gap stays open, less
ELASTIC_WEIGHTS = (1e24, 1e8)
# change of the start by joints and drives, of the size and of given velocities, from which it is
# told, and from which it is no slip of a drawing any more and refused
WARNING_RTOL, REFUSAL_RTOL = 1e-6, 1e-2
LED_WEIGHT = 1e4  # of the motion of bodies that were given no velocity
GAP_TOLERANCE = 1e-9
MAX_ASSEMBLY = 60
N_PROBES = 4  # gaps by which constraints that repeat others are found


def initial_state(
    packed: Packed,
    t: float = 0.0,
    spacing: float = 1e-6,
    *,
    assemble: bool = False,
    placing: bool = False,
) -> State:
    """Positions and velocities nearest to the given ones that satisfy all joints and drives.

    Bodies are moved as they are, and strained where that does not suffice. Drives are sampled
    with a spacing [s] of finite differences. With ``assemble`` gaps of any size are closed, and
    given velocities change by as much as it takes; with ``placing`` drives say where bodies are and
    how they move: what was given contradicts nothing.
    """
    table = prescribed(packed.signals, np.array([t]), (t, np.inf), spacing)
    return _start(packed, table[0], t, (assemble, placing))


def prescribed(
    signals: tuple[Signal, ...], t: Array, span: Span, spacing: float, step: float | None = None
) -> Array:
    """(n, s, 3) signals at all times, as `sampled`; refused where one of them fails."""
    table, failure = sampled(signals, t, span, spacing, step)
    if failure is not None:
        raise failure
    return table


def _start(packed: Packed, signal: Array, t: float, asked: tuple[bool, bool]) -> State:
    """The state at the start, by whole matrices if the rank of the constraints needs them."""
    W = workspace(packed.system, len(packed.signals))
    W.signal[:] = signal
    surely = packed.by_blocks and not packed.shares
    if surely and not _independent(packed, W, packed.q):
        return _start(packed.sharing(), signal, t, asked)
    q = assembled(packed, W, packed.q)
    if surely and not _independent(packed, W, q):
        return _start(packed.sharing(), signal, t, asked)
    rank = W.value.size if surely else _rank(packed, W, q)
    _check_start(packed, W, q, rank)
    v = fitting_velocity(packed, W, q, packed.v, led=True)
    closed, lam = _told(packed, W, q, v, *asked), np.zeros(W.value.size)
    evaluate(packed.system, W, q, v)
    apply_laws(packed.asked, W, t)
    return with_accelerations(packed, W, State(t, q, v, v * 0, lam, rank, closed=closed))


def _told(packed: Packed, W: Work, q: Array, v: Array, assemble: bool, placing: bool) -> float:
    """Largest change of what was given, of the size or of velocities, after telling it.

    What has to change by more than a slip of the pen is refused, unless asked for. Bodies that were
    given no velocity have the one that joints and drives give them.
    """
    given = v if placing else packed.v
    changes = [_opened(packed, W, placing), *_bent_and_hurried(packed, W, q, v, given)]
    moved = [(what, where) for change, what, where in changes if change > WARNING_RTOL]
    largest = max(change for change, *_ in changes)
    if assemble or not moved:
        return largest
    summary = f"{'; '.join(what for what, _ in moved)}."
    if largest > REFUSAL_RTOL:
        text = f"the start contradicts joints and drives: {summary}"
        hint = "Let places, velocities and drives fit, or the start be moved: assemble=True."
        raise ModelError(text, where=moved[0][1], hint=hint)
    warn(
        f"the start was moved to fit joints and drives: {summary} Draw the bodies so that "
        "joints are closed and drives begin where they are, or ask for it (assemble=True)."
    )
    return largest


def _opened(packed: Packed, W: Work, placing: bool) -> tuple[float, str, str]:
    """Largest gap where bodies were added, over the size, in words, and whose joint it is."""
    evaluate(packed.system, W, packed.q, packed.v)
    rows = packed.system.rows
    free = (rows.kind == ROLL) | (placing & (rows.signal >= 0))
    gap, where, size = _largest(packed, np.where(free, 0.0, W.value / packed.row_scale))
    return gap, f"{where!r} was open by {size}", where


def _bent_and_hurried(
    packed: Packed, W: Work, q: Array, v: Array, given: Array
) -> Iterator[tuple[float, str, str]]:
    """How far each body is strained, of the size, and its velocity changed, of the largest given.

    Lengths and speeds are means by mass.
    """
    linearize_constraints(packed.system, W, q, v)
    bodies, unit = packed.system.bodies, _weights(packed, W, 1.0)
    mine = [slice(at, at + 6 + r) for at, r in zip(bodies.v_at, bodies.r, strict=True)]
    size = np.repeat(np.sqrt(bodies.mass), 6 + bodies.r) * unit
    speed, change = (
        [float(np.linalg.norm((x / size)[k])) for k in mine] for x in (given, v - given)
    )
    for b, (name, at, k) in enumerate(zip(packed.names, bodies.q_at, mine, strict=True)):
        strain = (q - packed.q)[at + 7 : at + 1 + k.stop - k.start] / unit[k][6:]
        bent = float(np.linalg.norm(strain) / np.sqrt(packed.mass) / packed.length)
        yield bent, f"it bends {name!r} by {bent:.2g} of the size", name
        share = change[b] / max(speed) if speed[b] else 0.0
        yield share, f"the velocity of {name!r} changes by {share:.2g} of the largest given", name


def _largest(packed: Packed, gaps: Array) -> tuple[float, str, str]:
    """Largest gap, over the size, whose joint it is, and its size in words."""
    if not gaps.size:
        return 0.0, "", ""
    k = int(np.argmax(np.abs(gaps)))
    gap = float(abs(gaps[k]))
    size = f"{gap * packed.length:.3g} m (size {packed.length:.3g} m), or as a rotation"
    return gap, packed.row_owner[k], f"{size} by {gap:.3g} rad"


def _independent(packed: Packed, W: Work, q: Array) -> bool:
    """Whether the elimination by blocks meets no joint that could repeat others."""
    linearize_constraints(packed.system, W, q, np.zeros(packed.v.size))
    _weigh(packed, W, _weights(packed, W))
    return factorised(packed, W, RANK_TOLERANCE**1.5)


def independent(packed: Packed) -> bool:
    """Whether no joint of a mechanism in blocks repeats others where its bodies were added."""
    return _independent(packed, workspace(packed.system, len(packed.signals)), packed.q)


def with_accelerations(packed: Packed, W: Work, state: State) -> State:
    """The state with consistent accelerations and multipliers, where there are any."""
    a, lam = np.zeros(state.v.size), np.zeros(state.lam.size)
    y = np.concatenate([state.q, state.v, np.zeros(3)])
    rows = packed.rows_solved(state.rank)
    if not rates(packed.system, W, y, rows, True, a, lam, np.zeros_like(y)):
        where = f"at t = {state.t:.9g} s{packed.broken_laws}"
        raise SolverError(f"the equations of motion are singular {where}.")
    return replace(state, a=a, lam=lam, base=W.base.copy())


def assembled(packed: Packed, W: Work, q: Array) -> Array:
    """Coordinates that satisfy the constraints, by weighted Gauss-Newton corrections."""
    if not W.value.size:
        return q.copy()
    for elastic in ELASTIC_WEIGHTS:
        try:
            closed = _closed(packed, W, q.copy(), elastic)
        except SolverError:  # as rigid as that, bodies leave joints no way
            if elastic == ELASTIC_WEIGHTS[-1]:
                raise
            continue
        evaluate(packed.system, W, closed, np.zeros(packed.v.size))
        gap = W.value / packed.row_scale
        if np.abs(gap).max() <= GAP_TOLERANCE or not packed.system.bodies.r.any():
            break
    largest, where, size = _largest(packed, gap)
    if not np.isfinite(gap).all() or largest > GAP_TOLERANCE:
        text = f"the mechanism cannot be assembled: {where!r} stays open by {size}."
        hint = "Joints contradict each other: check positions, axes and drives."
        raise ModelError(text, where=where, hint=hint)
    return closed


def _closed(packed: Packed, W: Work, q: Array, elastic: float) -> Array:
    """Coordinates with the least gaps, elastic ones weighing so much more."""
    scale, held = packed.row_scale, np.flatnonzero(packed.system.rows.kind != ROLL)
    weight, v = None, np.zeros(packed.v.size)
    for _ in range(MAX_ASSEMBLY):
        linearize_constraints(packed.system, W, q, v)
        weight = _weights(packed, W, elastic) if weight is None else weight
        step = -_least_change(packed, W, W.value, weight, held)
        largest = np.abs(step / weight).max() / np.sqrt(packed.mass) / packed.length
        # at most by half a radian, or the size of the mechanism
        most = max([1.0, *(max(turn / 0.5, shift) for turn, shift in _reach(packed, step))])
        retract(packed.system, q.copy(), step / most, q)
        if largest < 1e-15 or not np.isfinite(largest):
            break
        if largest < 1e-12 and np.abs(W.value / scale).max() < 1e-14:
            break
    return q


def _reach(packed: Packed, step: Array) -> Iterator[tuple[float, float]]:
    """How far each body turns [rad], and shifts in lengths of the mechanism."""
    for t in packed.system.bodies.v_at:
        turn, shift = (float(np.linalg.norm(step[i : i + 3])) for i in (t + 3, t))
        yield turn, shift / packed.length


def _weights(packed: Packed, W: Work, elastic: float = ELASTIC_WEIGHTS[-1]) -> Array:
    """(n,) inverse square root of what a unit of each velocity coordinate costs."""
    bodies = packed.system.bodies
    mass: Array = W.S[_diagonal(packed)]
    for b, t in enumerate(bodies.v_at):
        mass[t + 3 : t + 6] = np.maximum(mass[t + 3 : t + 6], 1e-3 * np.trace(W.J[b]))
        mass[t + 6 : t + 6 + bodies.r[b]] *= elastic
    return 1 / np.sqrt(mass)


def _least_change(packed: Packed, W: Work, gap: Array, weight: Array, rows: Integers) -> Array:
    """Solution x of G x = gap in some rows, with the least weighted norm."""
    if packed.by_blocks and rows.size < gap.size:
        A, size = unit_rows(Pattern(packed).gradient(W.G)[rows] @ diags(weight))
        closing = Constrained(identity(weight.size), A, redundant=True)
        return weight * closing.solve(0 * weight, gap[rows] / size)[0]
    if packed.by_blocks:
        _weigh(packed, W, weight)
        if not factorised(packed, W, 0.0):
            raise SolverError("constraints that were independent became dependent.")
        return least_motion(packed, W, gap)
    scale = packed.row_scale[rows]
    A, gap = W.G[rows] / scale[:, None] * weight, gap[rows] / scale
    size = np.linalg.norm(A, axis=1)
    size = np.where(size > 0, size, 1.0)
    return weight * np.linalg.lstsq(A / size[:, None], gap / size, rcond=RANK_TOLERANCE)[0]


def _diagonal(packed: Packed) -> tuple[Integers, Integers]:
    """Rows and columns (n,) of W.S where the masses of all velocity coordinates stand."""
    graph, count = packed.graph, 6 + packed.system.bodies.r
    body = np.repeat(np.arange(count.size), count)
    within = np.arange(body.size) - np.repeat(np.cumsum(count) - count, count)
    own = graph.own[body]
    return graph.x[own] + within, graph.y[own] + within


def _weigh(packed: Packed, W: Work, weight: Array) -> None:
    """Set W.S to the diagonal matrix with the inverse squares of the weights (n,)."""
    W.S[:] = 0.0
    W.S[_diagonal(packed)] = weight**-2


def factorised(packed: Packed, W: Work, least: float) -> bool:
    """Factorise [S G^T; G 0] by blocks; whether no pivot of a joint is below ``least``."""
    P, n, m = packed.graph.plan, W.residual.size, W.G.shape[0]
    W.UG[:], W.UGT[:] = W.G, W.G
    if not factorise_bordered(packed.system, W, m) or W.by_blocks[0] == 0:
        return False
    joints = np.flatnonzero(np.isin(P.start, P.position[n:]))
    pivots = [P.pivot[k] + np.arange(P.size[k]) * (P.size[k] + 1) for k in joints]
    return bool(np.all(np.abs(W.factor[np.concatenate([*pivots, joints[:0]])]) > least))


def least_motion(packed: Packed, W: Work, gap: Array) -> Array:
    """The motion x (n,) with G x = gap (m,) and the least x^T S x, factorised before."""
    x = np.zeros(W.residual.size)
    W.rhs[:] = 0.0
    W.part[:] = gap
    solve_bordered(packed.system, W, gap.size, x, W.dlam)
    return x


def fitting_velocity(packed: Packed, W: Work, q: Array, v: Array, *, led: bool = False) -> Array:
    """The velocities nearest to v (n,) that satisfy joints and drives.

    ``led``: bodies that were given none are led by the others, and do not slow them down.
    """
    if not W.value.size:
        return v.copy()
    linearize_constraints(packed.system, W, q, v)
    weight, wanted = _weights(packed, W), _prescribed(packed, W)
    now, every, given = np.zeros_like(wanted), np.arange(wanted.size), v
    if led:
        bodies = packed.system.bodies
        for at, r in zip(bodies.v_at, bodies.r, strict=True):
            weight[at : at + 6 + r] *= 1.0 if v[at : at + 6 + r].any() else LED_WEIGHT
    for _ in range(2):  # the second pass removes the round-off of the first
        gradient_times(packed.system, W, v, False, now)
        v = v + _least_change(packed, W, wanted - now, weight, every)
    check_velocity(packed, W, v, given)
    return v


def check_velocity(packed: Packed, W: Work, v: Array, given: Array | None = None) -> None:
    """Refuse velocities v (n,) that do not satisfy joints and drives as linearised last.

    They were fitted from given ones (n,): where all come to rest, v is their round-off.
    """
    wanted = _prescribed(packed, W)
    now, size = np.zeros_like(wanted), np.zeros_like(wanted)
    gradient_times(packed.system, W, v, False, now)
    gradient_times(packed.system, W, v, True, size)
    miss, size = np.abs(now - wanted), size + np.abs(wanted)
    size = np.maximum(size, 1e-3 * size.max())  # rows at rest hold nothing but round-off
    if given is not None:
        gradient_times(packed.system, W, given, True, now)
        size = np.maximum(size, 1e-3 * now.max())
    k = int(np.argmax(miss / np.maximum(size, 1e-300)))
    if miss[k] > 1e-8 * size[k]:
        where = packed.row_owner[k]
        text = "the velocities of joints and drives contradict each other"
        hint = "Let drives go as fast as what was given, or leave them out."
        raise ModelError(f"{text}: {where!r} misses {miss[k]:.3g}.", where=where, hint=hint)


def _prescribed(packed: Packed, W: Work) -> Array:
    """(m,) rates of the drives, zero for constraints that none prescribes."""
    signal = packed.system.rows.signal
    if not W.signal.shape[0]:
        return np.zeros(signal.size)
    return np.where(signal >= 0, W.signal[np.maximum(signal, 0), 1], 0.0)


@dataclass(frozen=True)
class _Constraints:
    """Constraints at one position, rows of length one, motions in units that cost the same."""

    rank: int  # number of independent ones
    share: Array  # (m,) how much each takes part in what repeats others
    step: Array  # (n,) a motion along free directions, in units of the coordinates


def _constraints(packed: Packed, W: Work, q: Array) -> _Constraints:
    linearize_constraints(packed.system, W, q, np.zeros(packed.v.size))
    weight = _weights(packed, W)
    return _by_blocks(packed, W, weight) if packed.by_blocks else _by_matrix(W.G * weight, weight)


def _by_matrix(A: Array, weight: Array) -> _Constraints:
    norms = np.linalg.norm(A, axis=1)
    U, s, V = np.linalg.svd(A / np.where(norms > 0, norms, 1.0)[:, None])
    rank = int((s > RANK_TOLERANCE * s.max(initial=0.0)).sum())
    share = np.abs(U[:, rank:]).max(axis=1, initial=0.0)
    return _Constraints(rank, share, weight * V[rank:].sum(axis=0))


def _by_blocks(packed: Packed, W: Work, weight: Array) -> _Constraints:
    """The same from sparse matrices; probes take the place of singular vectors."""
    pattern = Pattern(packed)
    A, _ = unit_rows(pattern.gradient(W.G) @ diags(weight))
    m, n = A.shape
    whole = bmat([[identity(n), A.T], [A, csr_matrix((m, m))]], format="csc")
    rank = m - signature(whole, pattern.groups, RANK_PIVOT_RTOL).zero
    equations = Constrained(identity(n), A, redundant=True)
    gaps = np.sin(np.outer(1.0 + np.arange(m), 1.0 + np.arange(N_PROBES)))
    closing = equations.solve(np.zeros((n, N_PROBES)), gaps)[0]
    share = np.abs(gaps - A @ closing).max(axis=1)
    return _Constraints(rank, share, weight * equations.solve(np.sin(1.0 + np.arange(n)))[0])


def _rank(packed: Packed, W: Work, q: Array) -> int:
    """Number of independent constraints; warns of redundant ones by the names of their joints."""
    m = W.value.size
    if not m:
        return 0
    found = _constraints(packed, W, q)
    rank, share = found.rank, found.share
    if rank < m:
        names = dict.fromkeys(o for o, x in zip(packed.row_owner, share, strict=True) if x > 1e-6)
        _refuse_shared_friction(packed, names)
        warn(
            f"{m - rank} of {m} constraints repeat others; joints {listed(names)} share loads "
            "that only their deformation could divide. The motion is exact, the reactions are "
            "those of least norm."
        )
    return rank


def _refuse_shared_friction(packed: Packed, names: Container[str]) -> None:
    for first in packed.loaded_rows:
        if packed.row_owner[first] in names:
            text = "friction depends on a load that its joint shares with others in no known way."
            hint = "Let the joints repeat nothing, or give friction a constant level (coulomb)."
            raise ModelError(text, where=packed.row_owner[first], hint=hint)


def _check_start(packed: Packed, W: Work, q: Array, rank: int) -> None:
    """Refuse a singular position: where a small motion along free directions raises the rank."""
    if rank in (0, W.value.size, packed.v.size):
        return
    step, beside = _constraints(packed, W, q).step, np.empty_like(q)
    reach = max([1e-300, *(max(far) for far in _reach(packed, step))])
    retract(packed.system, q, step * (1e-2 / reach), beside)
    try:
        beside = assembled(packed, W, beside)
    except ModelError:
        return
    raised = _constraints(packed, W, beside).rank
    if raised > rank:
        text = f"the mechanism starts in a singular position: {rank} independent constraints there"
        hint = "Start from a position in which the parts are not all in line."
        raise ModelError(f"{text}, {raised} beside it; its motion could branch.", hint=hint)
