"""Laws of force along the line between two markers, from a formula of t, its length x and rate v.

A positive force pushes the markers apart. Without the time in it, F(x, 0) stores energy,
U(x) = -integral of F(s, 0) from the length at the start to x, and what v adds is lost power,
-(F(x, v) - F(x, 0)) v; so all of it balances. The integral is that of a formula given for it, or
comes from Lobatto points on intervals halved until it is exact to round-off. With the time in it,
the work is that of an applied force.
"""

import math
from functools import cache

import numpy as np
import numpy.typing as npt
from numba import carray

from rom.errors import ConfigError
from rom.mbs.elements.formulas.codes import MAX_STACK
from rom.mbs.elements.formulas.programs import Formula, piecewise
from rom.mbs.elements.formulas.taylor import run
from rom.mbs.elements.law_calls import LAW_TYPES, compiled_entry
from rom.mbs.kernels.compiled import inner
from rom.mbs.parts.bodies import Marker
from rom.mbs.parts.foreign import Entry
from rom.mbs.parts.joints import Whole
from rom.model import Array

# of Lobatto: with the ends among the points no jump hides between the last one and the end
_LEGENDRE_SEVENTH = np.polynomial.Legendre.basis(7)
POINTS = np.concatenate([[-1.0], np.sort(_LEGENDRE_SEVENTH.deriv().roots()), [1.0]])
WEIGHTS = 1.0 / (28.0 * _LEGENDRE_SEVENTH(POINTS) ** 2)
INTEGRAL_RTOL = 1e-14  # of the largest force times the length of an interval
SMALLEST_SHARE = 2.0**-46  # of the way: smaller intervals hold a jump, and are left as they are
MOST_INTERVALS = 1000  # a force that needs more has a pole on the way
HEAD_SIZE = 4  # numbers before the programs: length of all, stores or not, start, second program
AT_REST = (0.0, 0.0, 0.0)
SLOPE_RTOL = 1e-12  # of the steepest chord: a slope below it is the round-off of a level end


@inner
def interval(program, a, b, stack, most):
    """Integral of a program of x from a to b by Lobatto; most[0] is the largest value so far."""
    half, middle, total = 0.5 * (b - a), 0.5 * (a + b), 0.0
    for k in range(8):
        f = run(program, AT_REST, (middle + half * POINTS[k], 0.0, 0.0), AT_REST, stack)[0]
        most[0] = max(most[0], abs(f))
        total += WEIGHTS[k] * f
    return half * total


@inner
def integral(program, a, b, stack, space):
    """Integral of a program of x from a to b; not a number where it does not settle."""
    most, span, total, count = space[0], abs(b - a), 0.0, 1
    most[0] = 0.0
    space[1, 0], space[1, 1], space[1, 2] = a, b, interval(program, a, b, stack, most)
    for _ in range(MOST_INTERVALS):
        low, high, before = space[count, 0], space[count, 1], space[count, 2]
        count -= 1
        middle = 0.5 * (low + high)
        left = interval(program, low, middle, stack, most)
        right = interval(program, middle, high, stack, most)
        miss = abs(left + right - before)
        width = abs(high - low)
        if miss <= INTEGRAL_RTOL * most[0] * width or width <= SMALLEST_SHARE * span:
            total += left + right
        elif not miss < math.inf:
            return math.nan
        else:
            space[count + 1, 0], space[count + 1, 1], space[count + 1, 2] = low, middle, left
            space[count + 2, 0], space[count + 2, 1], space[count + 2, 2] = middle, high, right
            count += 2
        if count == 0:
            return total
    return math.nan


@inner
def line_of(motion, e):
    """Length and its rate; e becomes the direction from the first marker to the second."""
    x = v = 0.0
    for p in range(3):
        e[p] = motion[3 + p] - motion[p]
        x += e[p] * e[p]
    x = math.sqrt(x)
    for p in range(3):
        e[p] /= x
        v += e[p] * (motion[27 + p] - motion[24 + p])
    return x, v


def line_force(t, parameters, motion, memory, out):
    """The law, as `rom.mbs.elements.laws` asks for it."""
    given = carray(parameters, (int(carray(parameters, (1,))[0]),))
    stack, e, answer = np.empty((MAX_STACK, 3)), np.empty(3), carray(out, (14,))
    x, v = line_of(carray(motion, (36,)), e)
    program, start = given[HEAD_SIZE:], given[2]
    force = run(program, (t, 0.0, 0.0), (x, 0.0, 0.0), (v, 0.0, 0.0), stack)[0]
    for p in range(3):
        answer[p], answer[3 + p] = -force * e[p], force * e[p]
    if given[1] == 0.0:
        return
    resting = run(program, AT_REST, (x, 0.0, 0.0), AT_REST, stack)[0]
    if given[3] > 0.0:
        second = given[int(given[3]) :]
        now = run(second, AT_REST, (x, 0.0, 0.0), AT_REST, stack)[0]
        answer[12] = run(second, AT_REST, (start, 0.0, 0.0), AT_REST, stack)[0] - now
    else:
        answer[12] = -integral(program, start, x, stack, np.empty((MAX_STACK + 8, 3)))
    answer[13] = -(force - resting) * v


def line_tangents(t, parameters, motion, memory, D):
    """Its derivatives by motions and by velocities."""
    given = carray(parameters, (int(carray(parameters, (1,))[0]),))
    stack, e, moved = np.empty((MAX_STACK, 3)), np.empty(3), carray(motion, (36,))
    x, v = line_of(moved, e)
    program, time, out = given[HEAD_SIZE:], (t, 0.0, 0.0), carray(D, (2, 12, 12))
    force, by_x, _ = run(program, time, (x, 1.0, 0.0), (v, 0.0, 0.0), stack)
    by_v = run(program, time, (x, 0.0, 0.0), (v, 1.0, 0.0), stack)[1]
    for p in range(3):
        for q in range(3):
            across = (moved[27 + q] - moved[24 + q] - v * e[q]) / x
            same = 1.0 if p == q else 0.0
            radial = e[p] * (by_x * e[q] + by_v * across)
            stiff, damping = radial + force / x * (same - e[p] * e[q]), by_v * e[p] * e[q]
            for k, value in enumerate((stiff, damping)):
                out[k, p, q] = out[k, 6 + p, 6 + q] = value
                out[k, p, 6 + q] = out[k, 6 + p, q] = -value


@cache
def entries() -> tuple[Entry, Entry]:
    """The compiled law and its tangents."""
    return compiled_entry(line_force, LAW_TYPES), compiled_entry(line_tangents, LAW_TYPES)


def line_law(
    mechanism: Whole,
    name: str,
    m1: Marker,
    m2: Marker,
    force: Formula,
    potential: Formula | None = None,
) -> None:
    """Add a force of t, length x [m] and rate v [m/s] that pushes two markers apart [N] as a law.

    Its potential is the integral of the force over x, if it is known [N m].
    """
    start = float(np.linalg.norm(mechanism.design_point(m2) - mechanism.design_point(m1)))
    if start == 0.0:
        text = f"both markers of {name!r} are in one place at the start: the force has no direction"
        raise ConfigError(f"{text}; take points that are apart, or a bushing.")
    stores = "t" not in force.names
    second = np.zeros(0) if potential is None else potential.program
    at = HEAD_SIZE + force.program.size if potential is not None else 0
    numbers = np.concatenate([[0.0, stores, start, at], force.program, second])
    numbers[0] = numbers.size
    law, tangents = entries()
    mechanism.law(name, law, m1, m2, parameters=numbers, energy=stores, tangents=tangents)


def through_points(
    x: npt.ArrayLike, values: npt.ArrayLike, interpolation: str
) -> tuple[Formula, Formula]:
    """A curve through points (n,), x ascending, straight beyond its ends, and its integral.

    "monotone" nowhere leaves the range of neighbours, "cubic" is a spline of continuous curvature.

    Source:
        Fritsch, Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300, for the monotone one.
    """
    from scipy.interpolate import CubicSpline, PchipInterpolator

    x, values = np.asarray(x, dtype=float), np.asarray(values, dtype=float)
    if x.size == 2:
        slope = (values[1] - values[0]) / (x[1] - x[0])
        C = np.array([[0.0, 0.0, slope, values[0]]])
        ends = np.array([slope, slope])
    else:
        curve = (PchipInterpolator if interpolation == "monotone" else CubicSpline)(x, values)
        C, ends = curve.c.T, curve(x[[0, -1]], 1)
        ends[np.abs(ends) < SLOPE_RTOL * np.abs(np.diff(values) / np.diff(x)).max()] = 0.0
    before, behind = ([0.0, 0.0, s, y] for s, y in zip(ends, values[[0, -1]], strict=True))
    C, centres = np.vstack([before, C, behind]), np.concatenate([x[:1], x[:-1], x[-1:]])
    return piecewise(x, centres, C), piecewise(x, centres, _integrals(x, C))


def _integrals(x: Array, C: Array) -> Array:
    """(n, 5) coefficients of the integrals of cubic pieces, zero at the first knot."""
    high = np.column_stack([C / [4.0, 3.0, 2.0, 1.0], np.zeros(len(C))])
    pieces = [np.polyval(c, h) for c, h in zip(high[1:-1], np.diff(x), strict=True)]
    high[1:, 4] = np.concatenate([[0.0], np.cumsum(pieces)])
    return high
