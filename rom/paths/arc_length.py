"""Any path of solutions over a parameter, followed by its arc length.

Source:
    Riks, An incremental approach to the solution of snapping and buckling problems, Int. J. Solids
    Struct. 15 (1979) 529: corrections at right angles to the direction in which the path leaves.
"""

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from scipy.optimize import brentq

from rom.errors import SolverError
from rom.model import Array

MAX_PASSES = 25
MAX_PREDICTION = 0.3  # of a step, in the size of the problem: beyond it linear equations say little
CORRECTION_TOL = 1e-12
STALLED_TOL = 1e-7  # below it, corrections that no longer shrink are round-off
MAX_DEVIATION_RATIO = 0.5  # of a corrected point from its prediction, of the arc length
MIN_COSINE = 0.9  # between the directions of neighbouring points
LOCATION_RTOL = 1e-12  # of a step, to which a point with some property is found
AIM_PASSES = 5  # corrections per point at which the step keeps its length
FIRST_STEP_RATIO, MIN_STEP_RATIO = 0.1, 1e-5  # of the longest one


class Problem(Protocol):
    """Equations F(u, p) = 0 whose solutions u form a path over a parameter p."""

    def corrections(self, at: Any, p: float) -> tuple[Array, Array]:
        """(k,) Newton's correction at the same p, and (k,) change of the solution per p."""

    def moved(self, at: Any, step: Array, p: float) -> Any:
        """The solution after a change (k,)."""

    def inner(self, a: Array, b: Array) -> float:
        """Product of two changes; a change of size one is the longest of which one speaks."""

    def size(self, step: Array) -> float:
        """Largest part of a change, one for what linear equations cannot describe."""


@dataclass(frozen=True)
class Point:
    """A point of a path."""

    at: Any  # the solution
    p: float  # the parameter
    step: Array  # (k,) change of the solution per arc length
    rate: float  # change of the parameter per arc length
    passes: int = 0  # corrections that it took


@dataclass(frozen=True)
class Curve:
    """A path."""

    problem: Problem  # its equations
    unit: float  # change of the parameter that counts like a change of size one of the solution
    tol: float = CORRECTION_TOL  # size of a correction that no longer matters

    def length(self, step: Array, rate: float) -> float:
        """Arc length of a change of solution and parameter."""
        return float(np.sqrt(self.problem.inner(step, step) + (rate / self.unit) ** 2))

    def point(self, at: Any, p: float, slope: Array, towards: tuple[Array, float]) -> Point:
        """The point with its direction, on the side of another direction."""
        length = self.length(slope, 1.0)
        along = self.problem.inner(slope, towards[0]) + towards[1] / self.unit**2
        sign = 1.0 if along >= 0.0 else -1.0
        return Point(at, p, sign / length * slope, sign / length)

    def start(self, at: Any, p: float, forwards: bool) -> Point:
        """The first point, from which the parameter grows or falls."""
        slope = self.problem.corrections(at, p)[1]
        return self.point(at, p, slope, (0.0 * slope, 1.0 if forwards else -1.0))

    def ahead(self, point: Point, h: float) -> Point:
        """The point of the path at an arc length h further; a SolverError if that is too far."""
        if not self.problem.size(h * point.step) < MAX_PREDICTION:
            raise SolverError("the path is steeper than its points are close.")
        p, last, away = point.p + h * point.rate, np.inf, 0.0
        at = self.problem.moved(point.at, h * point.step, p)
        for k in range(MAX_PASSES):
            newton, slope = self.problem.corrections(at, p)
            across = self.problem.inner(point.step, slope) + point.rate / self.unit**2
            dp = -self.problem.inner(point.step, newton) / across
            step = newton + dp * slope
            size = max(self.problem.size(step), abs(dp) / self.unit)
            away += self.length(step, dp)
            if not away < MAX_DEVIATION_RATIO * abs(h):
                break
            at, p = self.problem.moved(at, step, p + dp), p + dp
            if size < self.tol or (size < STALLED_TOL and size > 0.5 * last):
                return replace(self.point(at, p, slope, (point.step, point.rate)), passes=k + 1)
            last = size
        raise SolverError("no point of the path was found.")

    def steps(self, point: Point, longest: float) -> Iterator[tuple[Point, float, Point]]:
        """Neighbouring points, and the arc length between them, without end; or a SolverError."""
        h = FIRST_STEP_RATIO * longest
        while True:
            try:
                new = self.ahead(point, h)
                goes = self.smooth(point, new) or h <= MIN_STEP_RATIO * longest
            except SolverError:
                goes = False
                if h < 2 * MIN_STEP_RATIO * longest:
                    raise
            if goes:
                yield point, h, new
                point, h = new, min(longest, h * np.clip(AIM_PASSES / new.passes, 0.5, 2.0))
            else:
                h /= 2

    def smooth(self, one: Point, two: Point) -> bool:
        """Whether the path keeps its direction between two points; a branch only begins to."""
        along = self.problem.inner(one.step, two.step) + one.rate * two.rate / self.unit**2
        return bool(along > MIN_COSINE or one.rate == 0.0)

    def located(
        self, point: Point, h: float, test: Callable[[Point], float], rtol: float = LOCATION_RTOL
    ) -> tuple[float, Point]:
        """Arc length, up to h and to rtol of it, and point at which a test changes its sign."""
        known: dict[float, tuple[float, Point]] = {0.0: (test(point), point)}

        def value(x: float) -> float:
            if x not in known:
                there = self.ahead(point, x)
                known[x] = test(there), there
            return known[x][0]

        if value(0.0) * value(h) < 0.0:
            with suppress(SolverError):  # of round-off, where equations are singular
                brentq(value, 0.0, h, xtol=rtol * h, rtol=1e-15)
            h = min(known, key=lambda x: abs(known[x][0]))
        elif not value(0.0):
            h = 0.0
        return h, known[h][1]
