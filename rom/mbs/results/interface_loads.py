"""What acts on the markers of bodies during a motion, and on what drives it."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from rom.mbs.equations.equations import residual
from rom.mbs.equations.python_laws import apply_laws
from rom.mbs.kernels.work import Work, workspace
from rom.mbs.results.recomputed import evaluate_at
from rom.model import Array


def marker_loads(solution: Any) -> tuple[Array, Array]:
    """Loads on all markers along a motion, and their axes.

    Returns:
        (n_t, k, 6) force [N] and moment about the marker [N m], world, of joints, drives, loads
        and all elements together; (n_t, k, 3, 3) axes of the body.
    """
    markers = solution.packed.system.markers
    n, k, on_bodies = solution.t.size, markers.body.size, markers.body >= 0
    wrench, axes = np.zeros((n, k, 6)), np.tile(np.eye(3), (n, k, 1, 1))
    for i, W in enumerate(at_instants(solution)):
        wrench[i] = W.wrench
        axes[i, on_bodies] = W.A[markers.body[on_bodies]]
    return wrench, axes


def at_instants(solution: Any) -> Iterator[Work]:
    """The memory after the equations of motion were evaluated at each instant, one by one."""
    packed, system = solution.packed, solution.packed.system
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


def of_body(solution: Any, body: str, loads: tuple[Array, Array], frame: str) -> dict[Any, Array]:
    """{place: (n_t, 6)} loads on the markers of one body that carry any, in the axes asked for."""
    wrench, axes = loads
    found = {}
    for marker, k in solution.packed.markers.items():
        if marker.body == body and wrench[:, k].any():
            both = wrench[:, k].reshape(-1, 2, 3)
            if frame == "body":
                both = np.einsum("nba,nsb->nsa", axes[:, k], both)
            found[marker.place] = both.reshape(-1, 6)
    return found
