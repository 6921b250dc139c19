"""Does a motion stay where linear elasticity in a floating frame holds? If not, it says so."""

from functools import partial
from typing import Any

import numpy as np
from scipy.linalg import eigh

from rom import rotation
from rom.errors import warn
from rom.mbs.kernels.system import ANGLE
from rom.mbs.parts.bodies import GROUND
from rom.mbs.results.solution import Solution
from rom.model import BUCKLING_LOADS, Array

# of the size of the body: beyond a tenth, linear elasticity is no longer to be trusted
MAX_DEFORMATION = 0.1
MAX_PRESSURE = 0.1  # of the load that buckles: a frequency is lower by a twentieth there
# of an interface against the frame [rad]: there exp(sin x) falls short of the angle x by 1.5 %
MAX_MARKER_TURN = 0.3


def warn_of_limits(solution: Solution) -> None:
    """Warn of bodies and elements that left the range where what is said of them holds."""
    _warn_of_lost_turns(solution)
    axes = partial(_axes, solution)
    for name, (family, element) in solution.mechanism.elements.items():
        if family.hooks.beyond is not None:
            warn(family.hooks.beyond(name, element, solution.t, axes))
    for name, part in solution.mechanism.parts.items():
        if not part.r:
            continue
        if getattr(part.flexible, "quartic", None) is not None:
            _warn_of_turned_markers(solution, name)
            if found := part.flexible.beyond_range(solution.elastic(name)):
                when = f"at {solution.t[found[0]]:.4g} s: {found[1]}"
                warn(f"body {name!r} left the range of its certificate {when}")
            continue
        share, bent = softening(solution, name), deformation(solution, name, surface=False)
        if share >= 1.0:
            top = np.linalg.norm(_omega(solution, name), axis=1).max()
            warn(
                f"body {name!r} turned at {top:.3g} rad/s; at {top / share:.3g} rad/s centrifugal "
                "force has used up the stiffness of a body without geometric stiffness, which this "
                "one lacks: its deformation is wrong. Reduce it with stiffening=True."
            )
        if bent > MAX_DEFORMATION:
            warn(
                f"body {name!r} deformed by {bent:.2g} of its size and left the range of small "
                "elastic deformation; its motion is no longer to be trusted. Divide it into "
                "several bodies, or look for a load or drive that is too large."
            )


def warn_of_range(mechanism: Any, packed: Any, state: Any) -> None:
    """Warn of bodies of large deflection that are beyond their certificates at one instant."""
    bodies = packed.system.bodies
    for name, at in zip(packed.names, bodies.q_at, strict=True):
        part = mechanism.parts[name]
        if getattr(part.flexible, "quartic", None) is None:
            continue
        if found := part.flexible.beyond_range(state.q[at + 7 : at + 7 + part.r][None]):
            warn(f"body {name!r} is beyond the range of its certificate: {found[1]}")


def pressed(solution: Solution, name: str) -> float | None:
    """Largest force that presses two interfaces of a body together, over what buckles it there [1].

    As on hinges, with a warning of too much. Zero where geometric stiffness is known to the motion,
    None where the body does not know its buckling loads.
    """
    body: Any = solution.mechanism.parts[name].flexible
    if body.K_geo or body.quartic is not None:
        return 0.0
    known = body.provenance.get(BUCKLING_LOADS)
    if known is None or not all({one, two} <= set(body.markers) for one, two, _ in known):
        return None
    loads, share = solution.interface_loads(name) if known else {}, 0.0
    for one, two, most in known:
        if one in loads and two in loads:
            line = solution.position(name, two) - solution.position(name, one)
            e = line / np.linalg.norm(line, axis=1, keepdims=True)
            along = [np.einsum("ta,ta->t", e, loads[end][:, :3]) for end in (one, two)]
            share = max(share, float(np.nanmax(np.minimum(along[0], -along[1]))) / most)
    if share > MAX_PRESSURE:
        warn(
            f"body {name!r} is pressed by {share:.2g} of the load that buckles it between two of "
            "its interfaces: it bends more and vibrates more slowly than a body without geometric "
            "stiffness knows. Reduce it with stiffening=True."
        )
    return share


def _warn_of_turned_markers(solution: Solution, name: str) -> None:
    """Axes of markers that are not fitted to a surface follow the linear rotation, a sine."""
    q = solution.elastic(name)
    for marker, m in solution.mechanism.parts[name].flexible.markers.items():
        if m.covariance is not None:
            continue
        turn = np.linalg.norm(q @ np.asarray(m.rotation).T, axis=1)
        if np.nanmax(turn, initial=0.0) > MAX_MARKER_TURN:
            k = int(np.nanargmax(turn > MAX_MARKER_TURN))
            warn(
                f"interface {marker!r} of body {name!r} turned by more than {MAX_MARKER_TURN} rad "
                f"against the frame at {solution.t[k]:.4g} s: the axes of what is joined to it "
                "fall short of that angle. Its place, and forces on it, are exact; reduce the body "
                "again, for joints that hold its direction: its file is of an older version."
            )


def _warn_of_lost_turns(solution: Solution) -> None:
    """Angles of joints are followed from step to step, which cannot tell more than half a turn."""
    steps = solution.statistics.get("steps", 0)
    if not steps:
        return
    h = (solution.t[-1] - solution.t[0]) / steps
    C, body = solution.packed.system.coordinates, solution.packed.system.markers.body
    for k in np.flatnonzero(C.kind == ANGLE):
        i, j = int(body[C.i[k]]), int(body[C.j[k]])
        if h * (_top(solution, i) + _top(solution, j)) < np.pi:
            continue
        rate = np.linalg.norm(_spin(solution, j) - _spin(solution, i), axis=1)
        rate = rate[np.isfinite(rate)].max(initial=0.0)
        if rate * h >= np.pi:
            names = [solution.packed.names[b] if b >= 0 else "ground" for b in (i, j)]
            warn(
                f"body {names[1]!r} turned by {rate * h:.3g} rad a step against {names[0]!r}: the "
                "angle of their joint loses whole turns beyond pi, and with it the spring, motor, "
                f"gear or stop that acts on it is wrong. Take steps below {np.pi / rate:.3g} s."
            )


def _axes(solution: Solution, body: str) -> Array:
    """(n_t, 3, 3) axes of a body in the world."""
    if body == GROUND:
        return np.broadcast_to(np.eye(3), (solution.t.size, 3, 3))
    return np.moveaxis(rotation.matrix(solution.orientation(body).T), -1, 0)


def _top(solution: Solution, body: int) -> float:
    """Largest angular speed of a body, -1 for the ground."""
    if body < 0:
        return 0.0
    omega = _omega(solution, solution.packed.names[body])
    return float(np.nanmax(np.linalg.norm(omega, axis=1), initial=0.0))


def _omega(solution: Solution, name: str) -> Array:
    """(n_t, 3) angular velocity of the frame that is integrated, in its axes [rad/s]."""
    packed = solution.packed
    at = packed.system.bodies.v_at[packed.names.index(name)] + 3
    return solution.v[:, at : at + 3]


def _spin(solution: Solution, body: int) -> Array:
    """(n_t, 3) angular velocity of a body in the world, -1 for the ground."""
    if body < 0:
        return np.zeros((solution.t.size, 3))
    name = solution.packed.names[body]
    return np.einsum("tij,tj->ti", _axes(solution, name), solution.omega(name))


def softening(solution: Solution, name: str) -> float:
    """Largest angular speed over the one that makes K - omega^2 (M - S_ee) singular.

    S_ee is the mass along the axis. Zero for a body with geometric stiffness, which rotation
    stiffens more than it softens.
    """
    part = solution.mechanism.parts[name]
    body, omega = part.flexible, _omega(solution, name)
    omega = omega[np.isfinite(omega).all(axis=1)]
    if body.K_geo or not omega.size:
        return 0.0
    w = omega[np.argmax(np.linalg.norm(omega, axis=1))]
    pull = w @ w * np.asarray(body.M) - np.einsum("a,abkl,b->kl", w, body.S_kl, w)
    try:
        largest = eigh(0.5 * (pull + pull.T), body.K, eigvals_only=True)[-1]
    except np.linalg.LinAlgError:  # a shape without stiffness
        return 0.0
    return float(np.sqrt(max(largest, 0.0)))


def deformation(solution: Solution, name: str, *, surface: bool = True) -> float:
    """Largest elastic displacement relative to the size of the body.

    Of all points of the outer surface, or of the interfaces alone.
    """
    part: Any = solution.mechanism.parts[name]
    body, q = part.flexible, solution.elastic(name)
    shapes: list[Array] = [np.asarray(m.translation) for m in body.markers.values()]
    drawn = getattr(body, "surface", None)
    if surface and drawn is not None:
        shapes += [np.asarray(drawn.shape).reshape(-1, 3, part.r)]
    table = np.concatenate([np.zeros((1, 3, part.r)), *(s.reshape(-1, 3, part.r) for s in shapes)])
    size = body.size if hasattr(body, "size") else solution.packed.length
    largest = 0.0
    for block in np.array_split(q, max(1, q.shape[0] * table.size // 10_000_000)):
        u = np.einsum("pak,tk->tpa", table, block)
        largest = max(largest, np.linalg.norm(u, axis=2).max(initial=0.0))
    return largest / size
