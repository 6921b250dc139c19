"""How wrong a motion is because of the shapes that its bodies do not have.

The motion is written in the coordinates of richer bodies, which contain the shapes of those that
moved. It obeys their equations but for a residual in the shapes that are new, and what that moves
in the whole mechanism, see `rom.mbs.analysis.small_errors`, is its error to first order.
"""

from collections.abc import Callable, Iterator, Mapping
from copy import copy
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Annotated, Any, NamedTuple

import numpy as np
from scipy.linalg import block_diag

from rom.arguments import AnyBody, AnySolution, Between, Count, typed
from rom.errors import ConfigError, ModelError
from rom.mbs.analysis.small_errors import axes_of_bodies, corrected
from rom.mbs.equations.packing import pack
from rom.mbs.parts.bodies import Part
from rom.mbs.results.audit import at_rows
from rom.mbs.results.recomputed import residuals_along
from rom.mbs.results.solution import Solution
from rom.model import Array, Index, Report, Row
from rom.names import check_known

NESTED_RTOL = 1e-4  # distance of a shape from the span of richer ones that still counts as none
REPLAY_RTOL = 1e-5  # of elastic forces, by which the motion may miss its own equations
MAX_INSTANTS = 2000  # to which longer motions are thinned out
MIN_PIECES = 25  # of a motion
HOT_INSTANTS, DRAWN_POINTS = 60, 50  # where large stress is looked for; of deformations
Goal = Callable[[Any], Array]  # of a motion: (n_t,) or (n_t, k)


class Curve(NamedTuple):
    """What a goal has over time, and its error."""

    t: Array  # (n_t,) [s]
    value: Array  # (n_t,) or (n_t, k) as recorded
    error: Array  # what the richer bodies would add

    @property
    def relative(self) -> float:
        """Largest error of the largest value."""
        size, error = (
            np.linalg.norm(x.reshape(self.t.size, -1), axis=1).max()
            for x in (self.value + self.error, self.error)
        )
        return float(error / size) if size else float(error > 0)


@dataclass(frozen=True, slots=True, weakref_slot=True)
class MotionReport(Report):
    """A report on a motion.

    Attributes:
        curves: {goal: its value and error over time}.
        motion: the motion as richer bodies would make it, to first order.
    """

    curves: Mapping[str, Curve] = field(default_factory=dict, compare=False, repr=False)
    motion: Any = field(default=None, compare=False, repr=False)


@typed
def certify_motion(
    solution: AnySolution,
    richer: Mapping[str, AnyBody],
    *,
    goals: Mapping[str, Goal] | None = None,
    tol: Annotated[float, Between(0, 1, "()")] = 0.01,
    coarser: AnySolution | None = None,
    every: Annotated[int, Count(1)] | None = None,
    pieces: Annotated[int, Count(1)] = MIN_PIECES,
) -> MotionReport:
    """How far a motion is from that of bodies with more shapes, without a second run.

    A good richer body has twice the modes, and the static shapes of inertia:
    ``rom.reduce(model, method=rom.WithLoads(rom.CraigBampton(2 * n)), ...)``; one whose interfaces
    deform, ``Polynomial`` in place of "rbe2", tells whether they are as rigid as was assumed.

    Args:
        solution: of `rom.simulate`.
        richer: {body: the same with more shapes, of the same mesh}.
        goals: {name: function of a motion that gives (n_t,) or (n_t, k) numbers}; if missing, of
            each body deformation, strain energy and largest stress, and reactions of its joints.
        tol: largest error of a goal, over its largest value [1].
        coarser: the same run with steps twice as long, for the error of the steps beside it.
        every: of so many saved instants one is used; if missing, of long motions as few as 2000.
        pieces: at least so many have equations of their own; more where teeth or contacts come and
            go than joints turn.

    Returns:
        MotionReport: an error for each goal, and which mode left out has the largest share.

    Raises:
        ConfigError: for a body that is not there, is rigid or of large deflection, or for a goal
            that does not give numbers over time.
        ModelError: if a richer body does not contain the shapes of the other, or the motion does
            not obey its own equations.

    Source:
        The residual in an enriched space as an estimate of the error: Bank and Smith, A posteriori
        error estimates based on hierarchical bases, SIAM J. Numer. Anal. 30 (1993) 921.
    """
    step = every or max(1, -(-solution.t.size // MAX_INSTANTS))
    seen = at_rows(solution, np.arange(0, solution.t.size, step))
    into = dict(_nested(seen, richer))
    rich = _embedded(seen, richer, into)
    R = residuals_along(rich)
    for name, E in into.items():
        _check_replay(rich, name, E, seen.mechanism.part(name).moving.D, R)
    moved = corrected(rich, R, pieces)
    asked = dict(usual_goals(seen, moved, tuple(richer))) if goals is None else goals
    curves = {name: _curve(name, goal, seen, moved) for name, goal in asked.items()}
    rows = [_row(f"{name}, error by shapes left out", x, tol) for name, x in curves.items()]
    if coarser is not None:
        other = coarser.at(seen.t)
        steps = {name: _curve(name, goal, other, seen) for name, goal in asked.items()}
        steps = {name: x._replace(error=x.error / 3) for name, x in steps.items()}
        rows += [_row(f"{name}, error by time steps", x, tol) for name, x in steps.items()]
    rows += [_loudest(rich, moved, name, E) for name, E in into.items()]
    return MotionReport(f"errors of {np.ptp(seen.t):g} s of motion", tuple(rows), curves, moved)


def _row(text: str, curve: Curve, tol: float) -> Row:
    return Row(text, curve.relative, f"<= {tol:g}", curve.relative <= tol)


def _curve(name: str, goal: Goal, less: Solution, more: Solution) -> Curve:
    value, better = (np.asarray(goal(motion), dtype=float) for motion in (less, more))
    if value.shape != better.shape or value.shape[:1] != less.t.shape:
        text = f"goal {name!r} gives shapes {value.shape} and {better.shape} at {less.t.size} times"
        raise ConfigError(f"{text}; it must give (n_t,) or (n_t, k) numbers.")
    return Curve(less.t, value, better - value)


def _nested(solution: Solution, richer: Mapping[str, AnyBody]) -> Iterator[tuple[str, Array]]:
    """{body: (r+, r) its coordinates in those of the richer one}, both on mean axes."""
    for name, body in richer.items():
        check_known(name, solution.packed.names, f"no body {name!r}; there are")
        part = solution.mechanism.part(name)
        if not part.r or part.moving.quartic is not None or body.quartic is not None:
            text = f"body {name!r} is rigid or of large deflection"
            raise ConfigError(f"{text}; only flexible ones of small deflection have richer ones.")
        part.refuse_spin("richer", "gyroscopic forces of its shapes stand in an element")
        for other, (_, element) in solution.mechanism.elements.items():
            if getattr(element, "body", None) == name:
                text = f"{other!r} acts on the shapes of body {name!r} one by one"
                raise ConfigError(f"{text}, which a richer one has more of; leave it out.")
        less, more = part.moving.surface, body.in_units("SI").on_mean_axes().surface
        if less is None or more is None or less.points.shape != more.points.shape:
            raise ModelError(f"body {name!r} and the richer one need the surface of one mesh.")
        E = np.linalg.lstsq(more.shape, less.shape, rcond=None)[0]
        gap = np.linalg.norm(less.shape - more.shape @ E, axis=0)
        miss = float((gap / np.linalg.norm(less.shape, axis=0)).max())
        if miss > NESTED_RTOL:
            text = f"shapes of body {name!r} are not among those of the richer one, by {miss:.1e}"
            hint = "Reduce the same model by the same method and interfaces, with more modes."
            raise ModelError(f"{text} of their size.", where=name, hint=hint)
        yield name, E


def _embedded(
    solution: Solution, richer: Mapping[str, AnyBody], into: dict[str, Array]
) -> Solution:
    """The same motion of the same mechanism, whose bodies could deform in more ways."""
    mechanism = copy(solution.mechanism)
    mechanism.parts = dict(mechanism.parts)
    for name, E in into.items():
        part, body = mechanism.parts[name], richer[name].in_units("SI")
        more = {"flexible": body, "moving": body.on_mean_axes(), "q": E @ part.q, "qd": E @ part.qd}
        mechanism.parts[name] = replace(part, **more)
    packed, sizes = pack(mechanism, sampled=True, whole=True), solution.packed.system.bodies.r
    elastic = [into.get(x, np.eye(r)) for x, r in zip(packed.names, sizes, strict=True)]
    of_rates = block_diag(*(block_diag(np.eye(6), E) for E in elastic))
    rates = {x: getattr(solution, x) @ of_rates.T for x in ("v", "a")}
    q = solution.q @ block_diag(*(block_diag(np.eye(7), E) for E in elastic)).T
    return replace(solution, mechanism=mechanism, packed=packed, q=q, **rates, _tracks={})


def _check_replay(rich: Solution, name: str, E: Array, D: Array, R: Array) -> None:
    """The motion obeys the equations of the shapes it had, or something else is compared.

    Damping D (r, r) of the body that moved may be another: modal damping is one of its own modes.
    """
    rows, body = _elastic_rows(rich, name), rich.mechanism.part(name).moving
    force, rate = rich.elastic(name) @ body.K @ E, rich.v[:, rows] @ np.linalg.pinv(E).T
    left = R[:, rows] @ E - rate @ (E.T @ body.D @ E - D)
    size, miss = np.abs(force).max(initial=0.0), np.abs(left).max(initial=0.0)
    if miss > REPLAY_RTOL * size and size > 0.0:
        text = f"the motion of body {name!r} misses its own equations by {miss / size:.1e}"
        hint = "The body that moved and the richer one differ in more than shapes, or steps that "
        raise ModelError(f"{text} of elastic forces.", where=name, hint=hint + "change too fast.")


def _elastic_rows(solution: Solution, name: str) -> slice:
    b, bodies = solution.packed.names.index(name), solution.packed.system.bodies
    return slice(bodies.v_at[b] + 6, bodies.v_at[b] + 6 + bodies.r[b])


def _loudest(rich: Solution, moved: Solution, name: str, E: Array) -> Row:
    """Of what the body had not, modes with interfaces held or interfaces that deform, the most.

    By the share of the strain energy of all that it had not.
    """
    part = rich.mechanism.part(name)
    K, q = part.moving.K, moved.elastic(name)
    omega, V = part.moving.modes(fixed=part.names if part.moving.has_static_shapes else ())
    omega, V = omega[omega > 0], V[6:, omega > 0]
    had = E @ np.linalg.solve(E.T @ K @ E, E.T @ K)
    new = np.einsum("ik,ij,jk->k", had @ V, K, had @ V) < 0.5 * omega**2
    left = q - q @ had.T
    total = float(np.einsum("ti,ij,tj->", left, K, left)) or 1.0
    shares = np.square(q @ K @ V / omega).sum(axis=0) * new / total
    k, others = int(shares.argmax()), max(0.0, 1.0 - float(shares.sum()))
    what, share = f"the mode at {omega[k] / (2 * np.pi):.4g} Hz", float(shares[k])
    if others > share:
        what, share = "interfaces that deform", others
    text = f"{name}: share of {what} in the energy of shapes left out"
    return Row(text, share, "information", True)


def usual_goals(
    less: Solution, more: Solution, names: tuple[str, ...]
) -> Iterator[tuple[str, Goal]]:
    """Deformation, strain energy and stress of bodies; reactions of their joints."""
    for name in names:
        yield f"{name}: deformation", partial(deformation, body=name)
        yield f"{name}: strain energy", partial(strain_energy, body=name)
        parts = [motion.mechanism.part(name) for motion in (less, more)]
        if all(part.moving.stress is not None for part in parts):
            hot = np.unique(np.r_[hot_points(less, name), hot_points(more, name)])
            yield f"{name}: largest stress", partial(largest_stress, body=name, points=hot)
    for joint, found in less.mechanism.joints.items():
        if any(marker.body in names for marker in found.markers):
            yield f"{joint}: force", partial(joint_force, joint=joint)


def deformation(motion: Solution, body: str) -> Array:
    """(n_t, 3 k) elastic displacements of points of its surface, mean squares of them [m]."""
    surface = motion.mechanism.part(body).moving.surface
    points = np.linspace(0, len(surface.points) - 1, DRAWN_POINTS).astype(int)
    rows = (3 * points[:, None] + np.arange(3)).ravel()
    return motion.elastic(body) @ surface.shape[rows].T / np.sqrt(points.size)


def strain_energy(motion: Solution, body: str) -> Array:
    """(n_t,) elastic energy of a body [J]."""
    q = motion.elastic(body)
    return 0.5 * np.einsum("ti,ij,tj->t", q, motion.mechanism.part(body).moving.K, q)


def joint_force(motion: Solution, joint: str) -> Array:
    """(n_t, 3) force of a joint on its second body, world [N]."""
    return motion.reaction(joint)[:, :3]


def largest_stress(motion: Solution, body: str, points: Index) -> Array:
    """(n_t,) largest equivalent stress of some points of its surface [Pa]."""
    return _equivalent(motion, body, slice(None), points).max(axis=1)


def hot_points(motion: Solution, body: str) -> Index:
    """Points of the surface whose stress is the largest at some instant."""
    rows = np.unique(np.linspace(0, motion.t.size - 1, HOT_INSTANTS).astype(int))
    found: Index = np.unique(_equivalent(motion, body, rows, slice(None)).argmax(axis=1))
    return found


def _equivalent(motion: Solution, body: str, rows: Any, points: Any) -> Array:
    """(n_t, p) equivalent stress [Pa], with what modes left out follow without delay."""
    part: Part = motion.mechanism.part(body)
    recovery, mine = part.moving.stress, _elastic_rows(motion, body)
    q, a, v = motion.elastic(body)[rows], motion.a[rows], motion.v[rows]
    A = axes_of_bodies(motion)[rows, motion.packed.names.index(body)]
    at = mine.start - 6
    pull = np.einsum("tab,ta->tb", A, a[:, at : at + 3] - np.asarray(motion.mechanism.gravity))
    shares = [(recovery.operator, q)]
    if recovery.inertial is not None:
        turn = a[:, at + 3 : at + 6].T, v[:, at + 3 : at + 6].T
        shares.append((recovery.inertial, recovery.accelerations(pull.T, *turn, a[:, mine].T).T))
    stress = sum(
        x @ operator.reshape(-1, 6, x.shape[1])[points].reshape(-1, x.shape[1]).T
        for operator, x in shares
    )
    xx, yy, zz, yz, xz, xy = np.moveaxis(stress.reshape(len(q), -1, 6), -1, 0)
    normal = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
    return np.sqrt(0.5 * normal + 3 * (yz**2 + xz**2 + xy**2))
