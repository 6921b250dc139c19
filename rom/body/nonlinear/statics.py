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
    for _ in range(MAX_ITERATIONS):
        gap = (energy.force(q) - load) / scale
        lam, V = np.linalg.eigh(energy.tangent(q) / np.outer(scale, scale))
        floor = 1e-12 * np.abs(lam).max()
        step = -(V @ ((V.T @ gap) / np.maximum(np.abs(lam), floor))) / scale
        size = np.linalg.norm(scale * step)
        if size <= INCREMENT_RTOL * np.linalg.norm(scale * q):
            return q + step if lam[0] > 0 else None
        share = _descent(energy, q, load, step)
        if not share:
            return q if size <= 1e4 * INCREMENT_RTOL * np.linalg.norm(scale * q) else None
        q = q + share * step
    return None


def _descent(energy: Quartic, q: Array, load: Array, step: Array) -> float:
    """Share of a step that lowers the potential enough; 0 if there is none."""
    start, slope = energy.energy(q) - load @ q, (energy.force(q) - load) @ step
    share = 1.0
    while share > MIN_STEP:
        ahead = q + share * step
        if energy.energy(ahead) - load @ ahead <= start + SUFFICIENT_DESCENT * share * slope:
            return share
        share /= 2
    return 0.0
