"""Static correction: how the modes left out of a basis follow the inertia of the body."""

from typing import Any

import numpy as np

from rom.body.recovery import centrifugal
from rom.eigen.verbs import Operators
from rom.model import Array, Basis

COUPLING_RTOL = 1e-7  # round-off of the stiffness between constraint modes and inner columns


def residual_motion(
    ops: Operators, connection: Any, basis: Basis, holds: dict[str, Array], points: Array
) -> Array | None:
    """(n_local, 12 + r) displacement of the modes left out, in nodal dofs.

    With the interfaces held, the inner dofs answer inertia by -K_ii^-1 (M a)_i; what the inner
    columns of the basis can answer is taken out, because the elastic coordinates contain it.

    Args:
        ops: operators in nodal dofs.
        connection: the model in interface coordinates.
        basis: constraint modes first, then columns that vanish on the interfaces.
        holds: {interface: (n_c, 6 + r)} interface coordinates of rigid and elastic motion.
        points: (n_local / 3, 3) nodes of this process [m].

    Returns:
        None for a basis without constraint modes.
    """
    inner, n_b = connection.ops, connection.boundary.size
    Psi_b, Phi = basis.Psi[:, :n_b], basis.Psi[:, n_b:]
    if not n_b or basis.labels[:n_b] != connection.labels:
        return None
    K = inner.gram(basis.Psi, inner.apply_K(basis.Psi))
    size = np.sqrt(np.diag(K))
    if np.abs(K[:n_b, n_b:] / np.outer(size[:n_b], size[n_b:])).max(initial=0.0) > COUPLING_RTOL:
        return None
    r = next(iter(holds.values())).shape[1] - 6
    motion = np.zeros((n_b, 6 + r))
    for name, rows in connection.parts.items():
        motion[rows] = holds[name]
    F = inner.apply_M(Psi_b) @ motion
    pull = inner.restrict(ops.apply_M(centrifugal(points)))
    F = np.hstack([-F[:, :6], pull, -F[:, 6:]])
    answer = inner.hold(connection.boundary)(F)
    if Phi.shape[1]:
        answer -= Phi @ np.linalg.solve(K[n_b:, n_b:], inner.gram(Phi, F))
    return inner.expand(answer)
