"""Deflections of a body on its reference interface under loads that keep their direction."""

import numpy as np

from rom.body.nonlinear.quartic import Quartic
from rom.errors import ModelError
from rom.model import Array

MAX_ITERATIONS = 60  # of Newton's method in one step of load
INCREMENT_RTOL = 1e-10  # last increment, of the coordinates in the norm of the energy
MIN_STEP = 2.0**-20  # of an increment, where a descent is given up
MIN_LOAD_STEP = 2.0**-10  # of the loads, where a path is given up
SUFFICIENT_DESCENT = 1e-4  # share of the slope that a step has to keep (Armijo)


def follow(energy: Quartic, loads: Array) -> Array:
    """(s, r) coordinates in equilibrium with loads (s, r) [N], one after the other from rest.

    Raises:
        ModelError: if no stable equilibrium is found on the way to a load.
    """
    q, at, found = np.zeros(energy.n), np.zeros(energy.n), []
    for load in loads:
        q = _led_to(energy, q, at, load)
        at = load
        found.append(q)
    return np.array(found)


def _led_to(energy: Quartic, q: Array, start: Array, end: Array) -> Array:
    """The equilibrium at the end of a stretch of load, halved where Newton's method fails."""
    done, step = 0.0, 1.0
    while done < 1.0:
        step = min(step, 1.0 - done)
        near = newton(energy, q, start + (done + step) * (end - start))
        if near is None:
            step /= 2
            if step < MIN_LOAD_STEP:
                raise ModelError(
                    f"no stable equilibrium was found beyond {done:.4g} of a step of load.",
                    hint="Ask for smaller loads: the body may snap through or buckle before.",
                )
        else:
            q, done, step = near, done + step, 2 * step
    return q


def newton(energy: Quartic, q: Array, load: Array) -> Array | None:
    """The minimum (r,) of energy less work of a load (r,) [N] near q (r,); None if there is none.

    Newton's method with a search along each increment.
    """
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
    energy: Quartic, q: Array, load: Array, step: Array, slope: float, start: float
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
