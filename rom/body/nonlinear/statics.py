"""Deflections of a body on its supports under loads that keep their direction."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from scipy.linalg import eigh, null_space

from rom.body.nonlinear.quartic import Energy
from rom.errors import ModelError, SolverError
from rom.model import Array
from rom.paths.arc_length import Curve, Point
from rom.paths.load_steps import load_steps

MAX_ITERATIONS = 60  # of Newton's method in one step of load
INCREMENT_RTOL = 1e-10  # last increment, of the coordinates in the norm of the energy
MIN_STEP = 2.0**-20  # of an increment, where a descent is given up
MIN_LOAD_STEP = 2.0**-6  # of the loads, at which a path is followed by its arc length instead
SUFFICIENT_DESCENT = 1e-4  # share of the slope that a step has to keep (Armijo)
LONGEST_STEP = 0.2  # of the deflection that small loads would cause
LOCATION_RTOL = 1e-7  # of a step, to which a stiffness that vanishes is found
MAX_POINTS = 400  # of a path between two loads


class Held(Energy):
    """The strain energy of a body with motions N (r, m) left of all its coordinates, q = N y."""

    def __init__(self, whole: Energy, N: Array):
        self.whole, self.N, self.K = whole, N, N.T @ whole.K @ N

    def expansion(self, y: Array) -> tuple[float, Array, Array]:
        """Energy [J], force (m,) [N] and tangent (m, m) [N/m] at y (m,) at once."""
        U, force, K = self.whole.expansion(self.N @ y)
        return U, self.N.T @ force, self.N.T @ K @ self.N


def free_motions(rows: Array) -> Array:
    """(r, m) motions for which rows (h, r) of coordinates vanish."""
    scale = np.abs(rows).max(axis=1, initial=0.0)
    rows = rows[scale > 0] / scale[scale > 0, None]
    return null_space(rows) if len(rows) else np.eye(rows.shape[1])


def follow(energy: Energy, loads: Array, held: Array | None = None) -> Array:
    """(s, r) equilibria with loads (s, r) [N] from rest, where rows (h, r) are held at zero."""
    return np.array([passed[-1] for passed in passages(energy, loads, held)])


def passages(energy: Energy, loads: Array, held: Array | None = None) -> list[Array]:
    """For each load the states (k, r) on the way to it, by arc length if it snaps; itself last."""
    body = Held(energy, free_motions(np.zeros((0, energy.n)) if held is None else held))
    y, at, found = np.zeros(body.n), np.zeros(body.n), []
    for load in loads @ body.N:
        passed = _led_to(body, y, at, load)
        y, at = passed[-1], load
        found.append(np.array(passed) @ body.N.T)
    return found


def _led_to(body: Held, y: Array, start: Array, end: Array) -> list[Array]:
    """The equilibrium at the end of a stretch of load, halved where Newton's method fails."""

    def ahead(y: Array, share: float) -> Array | None:
        return newton(body, y, start + share * (end - start))

    done, y = load_steps(ahead, y, least=MIN_LOAD_STEP, growth=2.0)
    return [y] if done == 1.0 else _beyond(body, y, (start, end), done)


def _beyond(body: Held, y: Array, stretch: tuple[Array, Array], done: float) -> list[Array]:
    """States on the path by arc length, from a share of a stretch of load to its end."""
    path, passed = Stretch(body, *stretch), list[Array]()
    with _found_beyond(done):
        for curve, one, h, two in path.steps(y, done):
            if two.p < 1.0:
                passed.append(two.at)
                continue
            _, last = curve.located(one, h, lambda x: x.p - 1.0)
            stable = newton(body, last.at, stretch[1])
            if stable is not None and path.size(stable - last.at) < LONGEST_STEP:
                return [*passed, stable]
            break
        raise SolverError("the path leads past the load.")


@contextmanager
def _found_beyond(done: float) -> Iterator[None]:
    """Where no path leads from a share of a load to its end, there is no equilibrium."""
    try:
        yield
    except SolverError as error:
        text = f"no stable equilibrium was found beyond {done:.4g} of a step of load"
        hint = "Ask for smaller loads, or cut a slender body into more pieces (rom.fe.pieces)."
        raise ModelError(f"{text}: the body buckles or gives way.", hint=hint) from error


@dataclass(frozen=True)
class Stretch:
    """Equilibria between two loads on a body, as `rom.paths.arc_length` asks for them."""

    body: Held  # on its supports
    start: Array  # (m,) loads [N]; the parameter is the share of the way from these
    end: Array  # (m,) to these [N]

    def steps(self, y: Array, done: float) -> Iterator[tuple[Curve, Point, float, Point]]:
        """The path from a state on, and its neighbouring points, with the arc length between."""
        curve = Curve(self, 1.0)
        steps = curve.steps(curve.start(y, done, forwards=True), LONGEST_STEP)
        for _, step in zip(range(MAX_POINTS), steps, strict=False):
            yield curve, *step
        raise SolverError(f"the path is longer than {MAX_POINTS} points.")

    def corrections(self, at: Array, p: float) -> tuple[Array, Array]:
        """Newton's correction, and the change of the state per share of the load."""
        _, force, K = self.body.expansion(at)
        rate = self.end - self.start
        try:
            found = np.linalg.solve(K, np.column_stack([self.start + p * rate - force, rate]))
        except np.linalg.LinAlgError as error:  # at a limit point to the last bit
            raise SolverError("the stiffness is singular.") from error
        return found[:, 0], found[:, 1]

    def stiffness(self, at: Array) -> Array:
        """(m,) stiffness, of that at rest, in its principal motions [1], ascending."""
        return eigh(self.body.expansion(at)[2], self.body.K, eigvals_only=True)

    def stiffness_of(self, k: int, point: Point) -> float:
        """That of the motion with k softer ones, at a point of the path."""
        return float(self.stiffness(point.at)[k])

    def moved(self, at: Array, step: Array, p: float) -> Array:
        """The state after a change of the coordinates."""
        return at + step

    def inner(self, a: Array, b: Array) -> float:
        """Product of two changes, the energy of the deflection by small loads as unit."""
        return float(a @ self.body.K @ b / self._unit)

    def size(self, step: Array) -> float:
        """Largest part of a change, in deflections by small loads."""
        return float(np.sqrt(self.inner(step, step)))

    @cached_property
    def _unit(self) -> float:
        largest = max(self.start, self.end, key=lambda load: float(load @ load))
        return float(largest @ np.linalg.solve(self.body.K, largest))


@_found_beyond(0.0)
def critical_shares(energy: Energy, load: Array, held: Array) -> Array:
    """(k,) shares, at most one, of a load (r,) [N] at which a stiffness vanishes on the way."""
    body = Held(energy, free_motions(held))
    rest = np.zeros(body.n)
    path, found = Stretch(body, rest, load @ body.N), list[float]()
    for curve, one, h, two in path.steps(rest, 0.0):
        below = [int(np.count_nonzero(path.stiffness(x.at) < 0)) for x in (one, two)]
        points = [
            curve.located(one, h, partial(path.stiffness_of, k), LOCATION_RTOL)
            for k in range(min(below), max(below))
        ]
        found += [point.p for _, point in sorted(points, key=lambda x: x[0])]
        if two.p >= 1.0:
            break
    return np.array([p for p in found if p <= 1.0])


def newton(energy: Energy, q: Array, load: Array) -> Array | None:
    """The minimum (r,) of energy less work of a load (r,) [N] near q (r,), or None."""
    scale = np.sqrt(np.diag(energy.K))
    U, force, K = energy.expansion(q)
    for _ in range(MAX_ITERATIONS):
        gap = force - load
        lam, V = np.linalg.eigh(K / np.outer(scale, scale))
        floor = 1e-12 * np.abs(lam).max()
        step = -(V @ ((V.T @ (gap / scale)) / np.maximum(np.abs(lam), floor))) / scale
        size = np.linalg.norm(scale * step)
        if size <= INCREMENT_RTOL * np.linalg.norm(scale * q):
            return q + step if lam[0] > 0 else None
        slope = SUFFICIENT_DESCENT * float(gap @ step)
        ahead = _descent(energy, q, load, step, slope, float(U - load @ q))
        if ahead is None:
            return q if size <= 1e4 * INCREMENT_RTOL * np.linalg.norm(scale * q) else None
        q, (U, force, K) = ahead
    return None


def _descent(
    energy: Energy, q: Array, load: Array, step: Array, slope: float, start: float
) -> tuple[Array, tuple[float, Array, Array]] | None:
    """Where a step, or a half of it and so on, falls from a start by a slope; None if nowhere."""
    share = 1.0
    while share > MIN_STEP:
        ahead = q + share * step
        found = energy.expansion(ahead)
        if found[0] - load @ ahead <= start + share * slope:
            return ahead, found
        share /= 2
    return None
