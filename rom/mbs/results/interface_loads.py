"""What acts on the markers of bodies during a motion, and on what drives it."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from rom import rotation
from rom.mbs.equations.equations import residual
from rom.mbs.equations.python_laws import apply_laws
from rom.mbs.kernels.work import Work, workspace
from rom.mbs.parts.bodies import GROUND
from rom.mbs.results.recomputed import evaluate_at
from rom.model import Array


def marker_loads(solution: Any) -> Array:
    """Loads on all k markers along a motion.

    Returns:
        (n_t, k, 6) force [N] and moment about the marker [N m], world, of joints, drives, loads
        and all elements together.
    """
    return np.array([W.wrench.copy() for W in at_instants(solution)])


def at_instants(solution: Any) -> Iterator[Work]:
    """The memory after the equations of motion were evaluated at each instant, one by one."""
    packed, system = solution.packed, solution.packed.seen
    W, forces = workspace(system, len(packed.signals)), packed.asked
    rows = zip(
        *(solution.t, solution.q, solution.v, solution.a, solution.lam),
        *(solution.signals, packed.places.before(solution.base)),
        strict=True,
    )
    for t, q, v, a, lam, signals, base in rows:
        evaluate_at(system, W, q, v, base, signals)
        apply_laws(forces, W, float(t))
        residual(system, W, q, v, a, lam)
        yield W


def of_body(solution: Any, body: str, wrench: Array, frame: str) -> dict[Any, Array]:
    """{place: (n_t, 6)} loads on the markers of one body that carry any, in the axes asked for."""
    turned, found = frame == "body" and body != GROUND, {}
    axes: Any = rotation.matrix(solution.orientation(body).T) if turned else None
    for marker, k in solution.packed.markers.items():
        if marker.body == body and wrench[:, k].any():
            both = wrench[:, k].reshape(-1, 2, 3)
            if turned:
                both = np.einsum("ban,nsb->nsa", axes, both)
            found[marker.place] = both.reshape(-1, 6)
    return found
