"""What acts on the markers of bodies during a motion, and on what drives it."""

from typing import Any

import numpy as np

from rom.mbs.equations.equations import evaluate, residual
from rom.mbs.equations.python_laws import apply_laws, laws
from rom.mbs.kernels.work import Work, workspace
from rom.model import Array


def marker_loads(solution: Any) -> tuple[Array, Array]:
    """Loads on all markers along a motion, and their axes.

    Returns:
        (n_t, k, 6) force [N] and moment about the marker [N m], world, of joints, drives, loads
        and all elements together; (n_t, k, 3, 3) axes of the body.
    """
    packed = solution.packed
    W = workspace(packed.system, len(packed.signals))
    forces = laws(solution.mechanism, packed)
    n, k = solution.t.size, packed.system.markers.body.size
    wrench, axes = np.zeros((n, k, 6)), np.tile(np.eye(3), (n, k, 1, 1))
    on_bodies = packed.system.markers.body >= 0
    for i in range(n):
        _at(solution, W, forces, i)
        wrench[i] = W.wrench
        axes[i, on_bodies] = W.A[packed.system.markers.body[on_bodies]]
    return wrench, axes


def _at(solution: Any, W: Work, forces: Any, i: int) -> None:
    """Evaluate the equations of motion at one instant; W.wrench is then complete."""
    q, v = solution.q[i], solution.v[i]
    W.signal[:], W.base[:] = solution.signals[i], solution.base[i]
    evaluate(solution.packed.system, W, q, v)
    apply_laws(forces, W, float(solution.t[i]))
    residual(solution.packed.system, W, q, v, solution.a[i], solution.lam[i])


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
