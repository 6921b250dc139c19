"""Is a computed motion believable? Conservation, constraints, Newton, size of deformations."""

from typing import Any

import numpy as np

from rom.mbs.solution import Solution
from rom.model import Report, Row

# limits; energy counts relative to the largest amount of energy that was exchanged
ENERGY = 1e-2
GAP = 1e-9
QUATERNION = 1e-12
MOMENTUM = 1e-5  # a method of second order conserves it to the error of its steps, not exactly
CORRECTIONS = 8.0
DEFORMATION = 0.1


def audit(solution: Solution) -> Report:
    """Check a motion.

    Energy and its drift, momentum of free mechanisms, gaps in the joints relative to the size of
    the mechanism, length of the quaternions, Newton corrections per step, and the largest elastic
    displacement relative to the size of its body: beyond a tenth, linear elasticity in a floating
    frame is no longer to be trusted.

    Args:
        solution: what `rom.simulate` returned.

    Returns:
        Report with a row per check.
    """
    rows = [*_energy(solution), *_momentum(solution), *_joints(solution), *_numbers(solution)]
    return Report(f"audit of {solution.t[-1] - solution.t[0]:g} s of motion", tuple(rows))


def _row(quantity: str, value: float, limit: float) -> Row:
    return Row(quantity, float(value), f"<= {limit:g}", bool(value <= limit))


def _energy(solution: Solution) -> list[Row]:
    e = solution.energy
    parts = (e.kinetic, e.strain, e.potential, e.drives, e.forces, e.damping)
    turnover = max(np.ptp(part) for part in parts)
    scale = max(turnover, np.abs(e.kinetic).max(), np.abs(e.strain).max(), 1e-300)
    rows = [_row("energy balance / energy", np.abs(e.balance).max() / scale, ENERGY)]
    if solution.t.size > 3:
        t = solution.t - solution.t.mean()
        slope = (t @ e.balance) / (t @ t) * np.ptp(solution.t)
        rows.append(_row("drift of energy / energy", abs(slope) / scale, ENERGY))
    return rows


def _momentum(solution: Solution) -> list[Row]:
    mechanism = solution.mechanism
    grounded = any(m.body == "ground" for j in mechanism.joints.values() for m in j.markers)
    pushed = mechanism.loads or np.any(mechanism.gravity)
    pushed = pushed or any(u.j is None for u in mechanism.user_forces.values())
    for law in (*mechanism.springs.values(), *mechanism.user_forces.values()):
        pushed = pushed or "ground" in (law.i.body, law.j.body if law.j else "")
    if grounded or pushed:
        return []
    rows = []
    for name, p in zip(("linear", "angular"), solution.momentum, strict=True):
        size = max(np.abs(p).max(), 1e-300)
        rows.append(_row(f"change of {name} momentum", np.abs(p - p[0]).max() / size, MOMENTUM))
    return rows


def _joints(solution: Solution) -> list[Row]:
    if not solution.lam.shape[1]:
        return []
    packed = solution.packed
    scale = np.where(packed.system.rows.kind <= 1, packed.length, 1.0)
    return [_row("largest gap in a joint / size", np.abs(solution.gap / scale).max(), GAP)]


def _numbers(solution: Solution) -> list[Row]:
    norms = [
        np.abs(np.linalg.norm(solution.orientation(name), axis=1) - 1).max()
        for name in solution.packed.names
    ]
    rows = [_row("quaternion length - 1", max(norms), QUATERNION)]
    statistics: dict[str, Any] = solution.statistics
    if "iterations" in statistics:
        mean = statistics["iterations"] / max(statistics["steps"], 1)
        rows.append(_row("Newton corrections per step", mean, CORRECTIONS))
    for name, part in solution.mechanism.parts.items():
        if part.r:
            rows.append(_deformation(solution, name, part))
    return rows


def _deformation(solution: Solution, name: str, part: Any) -> Row:
    body, q = part.flexible, solution.elastic(name)
    shapes = [np.asarray(m.translation) for m in body.markers.values()]
    surface = getattr(body, "surface", None)
    if surface is not None:
        shapes += [np.asarray(surface.shape).reshape(-1, 3, part.r)]
    table = np.concatenate([s.reshape(-1, 3, part.r) for s in shapes])
    size = body.size if hasattr(body, "size") else solution.packed.length
    largest = 0.0
    for block in np.array_split(q, max(1, q.shape[0] * table.size // 10_000_000)):
        u = np.einsum("pak,tk->tpa", table, block)
        largest = max(largest, np.linalg.norm(u, axis=2).max(initial=0.0))
    return _row(f"largest deformation of {name} / size", largest / size, DEFORMATION)
