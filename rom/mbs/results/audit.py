"""Is a computed motion believable? Conservation, constraints, Newton; what bodies are made for."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from scipy.linalg import eigh

from rom.arguments import typed
from rom.errors import warn
from rom.mbs.equations.packing import Packed
from rom.mbs.kernels.system import ANGLE, ROLL
from rom.mbs.mechanism import Mechanism
from rom.mbs.results.recomputed import axes_of
from rom.mbs.results.solution import Solution
from rom.mbs.results.state import State
from rom.model import BUCKLING_LOADS, Array, Index, Report, Row

# limits; energy counts relative to the largest amount of energy that was exchanged
ENERGY_RTOL = 1e-2
ROUND_OFF_RTOL = 1e-12
GAP_RTOL = 1e-9
QUATERNION_ATOL = 1e-12
MOMENTUM_RTOL = 1e-5  # a second-order method conserves it to the error of its steps, not exactly
MAX_MEAN_CORRECTIONS = 8.0
CERTIFIED_RTOL = 1e-6  # of energy on the very edge of a range
# of the size of the body: beyond a tenth, linear elasticity is no longer to be trusted
MAX_DEFORMATION = 0.1
MAX_PRESSURE = 0.1  # of the load that buckles: a frequency is lower by a twentieth there
# of an interface against the frame [rad]: there exp(sin x) falls short of the angle x by 1.5 %
MAX_MARKER_TURN = 0.3
LOOK_EVERY = 4  # instants, where a run looks at its own motion
MOTION_ARRAYS = ("t", "q", "v", "a", "lam", "work", "base", "signals")  # a row for each instant


@typed
def audit(solution: Solution) -> Report:
    """Check a motion.

    Energy and its drift, momentum of free mechanisms, gaps in the joints relative to the size of
    the mechanism, length of the quaternions, Newton corrections per step, and the largest elastic
    displacement relative to the size of its body: beyond a tenth, linear elasticity in a floating
    frame is no longer to be trusted. A body without geometric stiffness may not turn so fast that
    centrifugal force uses up its stiffness, nor be pressed between two interfaces by more than a
    tenth of what buckles it there, of which there is a warning, too. A body of large deflection
    may store as much energy as the load cases to which its certificate holds. No row of a
    certificate may fail.

    Geometric stiffness enters through the kinetic energy and the work of forces, see
    `rom.mbs.kernels.second_order`: the balance of energy holds with it as it does without.

    Example:
        >>> mech = rom.Mechanism(gravity=(0, 0, -9.81))
        >>> ball = mech.add_rigid("ball", mass=1.0, inertia=(1e-3,) * 3, at=(0, 0, 0))
        >>> rom.audit(rom.simulate(mech, t_end=1.0, dt=1e-2)).ok
        True
    """
    rows = _of_steps(solution)
    for name, part in solution.mechanism.parts.items():
        if part.r:
            rows += _limits(solution, name, part.flexible)
    return Report(f"audit of {solution.t[-1] - solution.t[0]:g} s of motion", tuple(rows))


def at_rows(solution: Solution, rows: Index) -> Solution:
    """The motion at some of its instants alone."""
    motion = {name: getattr(solution, name)[rows] for name in MOTION_ARRAYS}
    return replace(solution, **motion, _tracks={})


def warn_of_failures(solution: Solution) -> None:
    """Warn once of a motion whose balances, joints or steps the audit finds wrong."""
    n = solution.t.size
    seen = np.unique([*range(0, n, LOOK_EVERY), n - 1])
    rows = _of_steps(at_rows(solution, seen))
    failures = [f"{row.quantity} {row.value:.2g}" for row in rows if not row.ok]
    if failures:
        warn(
            f"the motion does not pass its audit: {'; '.join(failures)}. Take smaller steps, or "
            "look for a load, stiffness or drive that they do not resolve; rom.audit has limits."
        )


def _of_steps(solution: Solution) -> list[Row]:
    return [*_energy(solution), *_momentum(solution), *_joints(solution), *_numbers(solution)]


def _row(quantity: str, value: float, limit: float) -> Row:
    return Row(quantity, float(value), f"<= {limit:g}", bool(value <= limit))


def _energy(solution: Solution) -> list[Row]:
    e = solution.energy
    parts = (e.kinetic, e.strain, e.potential, e.drives, e.forces, e.damping)
    turnover = max(np.ptp(part) for part in parts)
    scale = max(turnover, np.abs(e.kinetic).max(), np.abs(e.strain).max(), _at_rest(solution))
    rows = [_row("energy balance / energy", np.abs(e.balance).max() / scale, ENERGY_RTOL)]
    if solution.t.size > 3:
        t = solution.t - solution.t.mean()
        slope = (t @ e.balance) / (t @ t) * np.ptp(solution.t)
        rows.append(_row("drift of energy / energy", abs(slope) / scale, ENERGY_RTOL))
    return rows


def _at_rest(solution: Solution) -> float:
    """Energy that is round-off: of the largest one, of the weight or of a way in the time [J]."""
    e, packed, T = solution.energy, solution.packed, np.ptp(solution.t)
    weight = np.linalg.norm(packed.system.bodies.gravity) * packed.length
    crossing = (packed.length / T) ** 2 if T else 0.0
    largest = max(np.abs(part).max() for part in (e.potential, e.drives, e.forces, e.damping))
    return ROUND_OFF_RTOL * (largest + packed.mass * (weight + crossing)) or 1e-300


def _momentum(solution: Solution) -> list[Row]:
    mechanism = solution.mechanism
    grounded = any(m.body == "ground" for j in mechanism.joints.values() for m in j.markers)
    pushed = np.any(mechanism.gravity) or any(f.pushes(x) for f, x in mechanism.elements.values())
    if grounded or pushed:
        return []
    # what starts at rest has no momentum as a whole: its parts have, as much as their energy allows
    packed, (linear, angular), rows = solution.packed, solution.momentum, []
    moving = max(np.sqrt(2 * packed.mass * solution.energy.kinetic.max()), 1e-300)
    for name, p, arm in (("linear", linear, 1.0), ("angular", angular, packed.length)):
        change = np.abs(p - p[0]).max() / max(np.abs(p).max(), moving * arm)
        rows.append(_row(f"change of {name} momentum", change, MOMENTUM_RTOL))
    return rows


def _joints(solution: Solution) -> list[Row]:
    if not solution.lam.shape[1]:
        return []
    packed = solution.packed
    rolling = packed.system.rows.kind == ROLL
    gap = np.abs(solution.gap / packed.row_scale)
    rows = [_row("largest gap in a joint / size", gap[:, ~rolling].max(initial=0.0), GAP_RTOL)]
    if rolling.any():
        speed = max(np.sqrt(2 * solution.energy.kinetic.max() / packed.mass), 1e-300)
        slip = np.abs(solution.gap[:, rolling]).max() / speed
        rows.append(_row("largest slip of what rolls / speed", slip, GAP_RTOL))
    return rows


def _numbers(solution: Solution) -> list[Row]:
    p = solution.q[:, solution.packed.system.bodies.q_at[:, None] + np.arange(3, 7)]
    stretched = np.abs(np.linalg.norm(p, axis=2) - 1).max()
    rows = [_row("quaternion length - 1", stretched, QUATERNION_ATOL)]
    if "iterations" in solution.statistics:
        mean = solution.statistics["iterations"] / max(solution.statistics["steps"], 1)
        rows.append(_row("Newton corrections per step", mean, MAX_MEAN_CORRECTIONS))
    return rows


def _limits(solution: Solution, name: str, body: Any) -> list[Row]:
    """Whether a body stays within what it was made for."""
    bent = deformation(solution, name)
    rows, certificate = list[Row](), getattr(body, "certificate", None)
    if certificate is not None:
        n = len(certificate.failures)
        worst = f", worst: {certificate.worst.quantity}" if n else ""
        rows = [_row(f"rows of the certificate of {name} that fail{worst}", n, 0)]
    if getattr(body, "quartic", None) is not None:
        rows += [Row(f"largest deformation of {name} / size", bent, "information", True)]
        most = body.certified_energy
        if np.isfinite(most):
            share = np.nanmax(body.energy().energies(solution.elastic(name))) / max(most, 1e-300)
            what = f"strain energy of {name} / most to which its certificate holds"
            rows.append(_row(what, share, 1 + CERTIFIED_RTOL))
        return rows
    rows += [_row(f"largest deformation of {name} / size", bent, MAX_DEFORMATION)]
    if share := softening(solution, name):
        rows.append(_row(f"speed of {name} / speed that softens it to nothing", share, 1.0))
    what, share = f"load that presses {name} / load that buckles it", pressed(solution, name)
    if share is None:
        rows.append(Row(f"{what}, unknown", 0.0, "information", True))
    elif not body.K_geo:
        rows.append(_row(what, share, MAX_PRESSURE))
    return rows


def warn_of_limits(solution: Solution) -> None:
    """Warn of bodies and elements that left the range where what is said of them holds."""
    _warn_of_lost_turns(solution)
    axes = partial(axes_of, solution)
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
            top = np.linalg.norm(solution._rates(name, 3, 6), axis=1).max()
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


def warn_of_range(mechanism: Mechanism, packed: Packed, state: State) -> None:
    """Warn of bodies of large deflection that are beyond their certificates at one instant."""
    bodies = packed.system.bodies
    for name, at in zip(packed.names, bodies.q_at, strict=True):
        part = mechanism.parts[name]
        if getattr(part.flexible, "quartic", None) is None:
            continue
        if found := part.flexible.beyond_range(state.q[at + 7 : at + 7 + part.r][None]):
            warn(f"body {name!r} is beyond the range of its certificate: {found[1]}")


def pressed(solution: Solution, name: str) -> float | None:
    """Largest force that presses two interfaces together, over what buckles it; None if unknown."""
    body = solution.mechanism.parts[name].flexible
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


def _top(solution: Solution, body: int) -> float:
    """Largest angular speed of a body, -1 for the ground."""
    if body < 0:
        return 0.0
    omega = solution._rates(solution.packed.names[body], 3, 6)
    return float(np.nanmax(np.linalg.norm(omega, axis=1), initial=0.0))


def _spin(solution: Solution, body: int) -> Array:
    """(n_t, 3) angular velocity of a body in the world, -1 for the ground."""
    if body < 0:
        return np.zeros((solution.t.size, 3))
    name = solution.packed.names[body]
    return np.einsum("tij,tj->ti", axes_of(solution, name), solution.omega(name))


def softening(solution: Solution, name: str) -> float:
    """Largest angular speed over the one that makes K - omega^2 (M - S_ee) singular.

    S_ee is the mass along the axis. Zero for a body with geometric stiffness, which rotation
    stiffens more than it softens.
    """
    part = solution.mechanism.parts[name]
    body, omega = part.flexible, solution._rates(name, 3, 6)
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
    """Largest elastic displacement, of the outer surface or the interfaces alone, over the size."""
    part = solution.mechanism.parts[name]
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
