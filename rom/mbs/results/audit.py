"""Is a computed motion believable? Conservation, constraints, Newton, size of deformations."""

from dataclasses import replace
from typing import Any

import numpy as np

from rom.arguments import typed
from rom.errors import warn
from rom.mbs.kernels.system import ROLL
from rom.mbs.results.solution import Solution
from rom.mbs.results.validity import MAX_DEFORMATION, MAX_PRESSURE, deformation, pressed, softening
from rom.model import Report, Row

# limits; energy counts relative to the largest amount of energy that was exchanged
ENERGY_RTOL = 1e-2
ROUND_OFF_RTOL = 1e-12
GAP_RTOL = 1e-9
QUATERNION_ATOL = 1e-12
MOMENTUM_RTOL = 1e-5  # a second-order method conserves it to the error of its steps, not exactly
MAX_MEAN_CORRECTIONS = 8.0
CERTIFIED_RTOL = 1e-6  # of energy on the very edge of a range
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

    Args:
        solution: what `rom.simulate` returned.

    Returns:
        Report with a row per check.

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


def warn_of_failures(solution: Solution) -> None:
    """Warn once of a motion whose balances, joints or steps the audit finds wrong.

    Every fourth instant is looked at, which takes a few per cent of the time of the run. Of bodies
    that left their range `rom.mbs.results.validity` warns.
    """
    n = solution.t.size
    seen = np.unique([*range(0, n, LOOK_EVERY), n - 1])
    motion = {name: getattr(solution, name)[seen] for name in MOTION_ARRAYS}
    rows = _of_steps(replace(solution, **motion, _tracks={}))
    failures = [f"{row.quantity} {row.value:.2g}" for row in rows if not row.ok]
    if failures:
        warn(
            f"the motion does not pass its audit: {'; '.join(failures)}. Take smaller steps, or "
            "look for a load, stiffness or drive that they do not resolve; rom.audit has limits."
        )


def _of_steps(solution: Solution) -> list[Row]:
    """What one look at all instants tells of a motion as a whole."""
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
    packed, rows = solution.packed, []
    moving = max(np.sqrt(2 * packed.mass * solution.energy.kinetic.max()), 1e-300)
    for name, p, arm in zip(
        ("linear", "angular"), solution.momentum, (1.0, packed.length), strict=True
    ):
        size = max(np.abs(p).max(), moving * arm)
        rows.append(
            _row(f"change of {name} momentum", np.abs(p - p[0]).max() / size, MOMENTUM_RTOL)
        )
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
    statistics: dict[str, Any] = solution.statistics
    if "iterations" in statistics:
        mean = statistics["iterations"] / max(statistics["steps"], 1)
        rows.append(_row("Newton corrections per step", mean, MAX_MEAN_CORRECTIONS))
    return rows


def _certified(name: str, certificate: Report | None) -> list[Row]:
    """Whether a body stands for its full model, with the worst row by name where it does not."""
    if certificate is None:
        return []
    n = len(certificate.failures)
    worst = f", worst: {certificate.worst.quantity}" if n else ""
    return [_row(f"rows of the certificate of {name} that fail{worst}", n, 0)]


def _limits(solution: Solution, name: str, body: Any) -> list[Row]:
    """Whether a body stays within what it was made for."""
    bent = deformation(solution, name)
    certified = _certified(name, getattr(body, "certificate", None))
    if getattr(body, "quartic", None) is not None:
        rows = [*certified, Row(f"largest deformation of {name} / size", bent, "information", True)]
        most = body.certified_energy
        if np.isfinite(most):
            share = np.nanmax(body.energy().energies(solution.elastic(name))) / max(most, 1e-300)
            what = f"strain energy of {name} / most to which its certificate holds"
            rows.append(_row(what, share, 1 + CERTIFIED_RTOL))
        return rows
    rows = [*certified, _row(f"largest deformation of {name} / size", bent, MAX_DEFORMATION)]
    if share := softening(solution, name):
        rows.append(_row(f"speed of {name} / speed that softens it to nothing", share, 1.0))
    what, share = f"load that presses {name} / load that buckles it", pressed(solution, name)
    if share is None:
        rows.append(Row(f"{what}, unknown", 0.0, "information", True))
    elif not body.K_geo:
        rows.append(_row(what, share, MAX_PRESSURE))
    return rows
