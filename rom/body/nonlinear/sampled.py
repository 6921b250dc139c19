"""Strain energy of a few weighted elements, for material whose energy is no polynomial.

Neo-Hookean material, with F = 1 + grad u and J = det F::

    W = mu (F : F - 3) / 2 - mu ln J + lam (ln J)^2 / 2,    P = mu (F - F^-T) + lam ln J F^-T

Elements e and weights x_e >= 0 are chosen so that sum x_e f_e is the force on the coordinates in
all states of a training, to a tolerance. As energy is summed with the same weights, forces are its
exact slopes, and energy and momentum are kept as with all elements.

Source:
    Farhat, Avery, Chapman and Cortial, Dimensional reduction of nonlinear finite element dynamic
    models with finite rotations and energy-based mesh sampling and weighting, Int. J. Numer. Meth.
    Engng. 98 (2014) 625; Bonet and Wood, Nonlinear Continuum Mechanics for Finite Element Analysis,
    Cambridge (2008), chapter 6.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import nnls

from rom.body.nonlinear.quartic import Energy
from rom.body.nonlinear.ranges import Geometric
from rom.body.nonlinear.statics import follow
from rom.errors import ConfigError, ModelError, ParallelError
from rom.model import Array, Index

ISOTROPIC_RTOL = 1e-9  # of the stiffness: how far it may lie from that of two constants
STEP_SHARES = (0.1, 0.4, 0.7, 1.0)  # of the loads at which states are trained


@dataclass(frozen=True)
class Sampled(Energy):
    """Strain energy of elastic coordinates q (r,), summed over weighted points."""

    K: Array  # (r, r) stiffness of the body at small deflection [N/m]
    # (p, 9, r) displacement gradient per unit of each coordinate, row by row [1/m]
    gradients: Array
    weights: Array  # (p,) volume for which a point stands [m^3]
    lame: Array  # (p, 2) constants lam and mu there [Pa]

    def fits(self, r: int) -> bool:
        """Whether it is an energy of r coordinates."""
        p = len(self.weights)
        return self.K.shape == (r, r) and self.gradients.shape == (p, 9, r)

    def energies(self, Q: Array) -> Array:
        """(t,) strain energies [J] at the coordinates (t, r)."""
        return np.array([self.energy(q) for q in Q])

    def expansion(self, q: Array) -> tuple[float, Array, Array]:
        """Energy [J], force (r,) [N] and tangent (r, r) [N/m]; infinite where J <= 0."""
        H, inverse, log, P = self._states(q)
        if not np.isfinite(log).all():
            return np.inf, np.full(self.n, np.nan), np.eye(self.n)
        (lam, mu), w = self.lame.T, self.weights
        square = 2 * np.trace(H, axis1=1, axis2=2) + (H * H).sum(axis=(1, 2))
        U = w @ (0.5 * mu * square - mu * log + 0.5 * lam * log**2)
        G = self.gradients
        Y = np.einsum("pij,pjkr->pikr", inverse, G.reshape(-1, 3, 3, self.n))
        trace = np.einsum("piir->pr", Y)
        other = Y.transpose(0, 2, 1, 3).reshape(G.shape) * (w * (mu - lam * log))[:, None, None]
        K = np.tensordot(G * (w * mu)[:, None, None], G, ((0, 1), (0, 1)))
        K += np.tensordot(Y.reshape(G.shape), other, ((0, 1), (0, 1)))
        K += (trace.T * (w * lam)) @ trace
        return float(U), self.forces(P).sum(axis=0), 0.5 * (K + K.T)

    def forces(self, P: Array) -> Array:
        """(p, r) forces of the points [N] at stresses P (p, 3, 3)."""
        return np.einsum("pk,pkr->pr", P.reshape(-1, 9) * self.weights[:, None], self.gradients)

    def forces_at(self, q: Array) -> Array:
        """(p, r) forces of the points [N] at the coordinates (r,)."""
        return self.forces(self._states(q)[3])

    def _states(self, q: Array) -> tuple[Array, Array, Array, Array]:
        """Gradient H, inverse of F, ln J and stress P at the points."""
        H = (self.gradients @ q).reshape(-1, 3, 3)
        trace = np.trace(H, axis1=1, axis2=2)
        minors = 0.5 * (trace**2 - np.einsum("pij,pji->p", H, H))
        grown = trace + minors + np.linalg.det(H)  # det F - 1 would leave small strains no digits
        with np.errstate(invalid="ignore", divide="ignore"):
            log = np.log1p(grown)
        F = np.eye(3) + H
        inverse = np.linalg.inv(np.where(np.isfinite(log)[:, None, None], F, np.eye(3)))
        lam, mu = self.lame.T[:, :, None, None]
        turned = inverse.swapaxes(1, 2)
        return H, inverse, log, mu * (F - turned) + lam * log[:, None, None] * turned


def sampled_energy(
    body: Any, geometric: Geometric, energy: Any, E: Array
) -> tuple[Sampled, dict[str, float]]:
    """Energy of a body of nodal shapes E (n, r) by a few elements, and how it was trained."""
    if energy.mesh.comm.size > 1:
        raise ParallelError("elements are sampled on one process only; leave mpirun out.")
    if np.any(geometric.spin):
        raise ConfigError("sampling and spin do not go together; leave sampling out of what turns.")
    G, w, cell, C = energy.at_points(E)
    every = Sampled(body.K, G, w, np.column_stack([C[:, 0, 1], C[:, 3, 3]]))
    _refuse_grain(C, every.lame)
    sixes = [(x.interface, x.largest * np.eye(6)[x.component]) for x in geometric.components()]
    units = np.array([body.forces_on({name: six}) for name, six in sixes])
    still, cases = body.mean_rows(geometric.fixed), geometric.load_cases()
    paths = [follow(every, np.outer(STEP_SHARES, case @ units), still) for case in cases]
    states = np.vstack(paths)
    assert geometric.sampling is not None
    share, error = chosen(every, cell, states, geometric.sampling)
    kept = share[cell] > 0
    few = replace(every, gradients=G[kept], weights=(w * share[cell])[kept], lame=every.lame[kept])
    return few, {
        "states": len(states),
        "error of forces": error,
        "elements": int(np.count_nonzero(share)),
        "of": share.size,
        "volume": float(few.weights.sum() / w.sum()),
    }


def chosen(every: Sampled, cell: Index, states: Array, tol: float) -> tuple[Array, float]:
    """(cells,) weights of the elements, most of them zero, and the error of forces that is left.

    That which explains most of what is missing joins until the relative error in the states (s, r)
    is below tol; weights are non-negative least squares. ``cell`` (p,) has the element of points.
    """
    starts = np.flatnonzero(np.r_[True, np.diff(cell) > 0])
    # forces on coordinates are as unlike as their stiffness: energies of all count alike
    cells = [
        np.add.reduceat(every.forces_at(q), starts, axis=0) / np.sqrt(np.diag(every.K))
        for q in states
    ]
    A = np.vstack([forces.T / np.linalg.norm(forces.sum(axis=0)) for forces in cells])
    b, size = A.sum(axis=1), np.linalg.norm(A, axis=0)
    weights, active = np.zeros(A.shape[1]), np.zeros(A.shape[1], dtype=bool)
    error = 1.0
    while error > tol and not active.all():
        missing = np.where(active, -np.inf, (b - A @ weights) @ A / np.maximum(size, 1e-300))
        active[np.argmax(missing)] = True
        weights[:] = 0.0
        weights[active] = nnls(A[:, active], b)[0]
        error = float(np.linalg.norm(b - A @ weights) / np.linalg.norm(b))
    return weights, error


def _refuse_grain(C: Array, lame: Array) -> None:
    expected = np.zeros_like(C)
    expected[:, :3, :3] = lame[:, :1, None]
    expected[:, range(3), range(3)] += 2 * lame[:, 1:]
    expected[:, range(3, 6), range(3, 6)] = lame[:, 1:]
    if np.abs(C - expected).max() > ISOTROPIC_RTOL * np.abs(C).max():
        text = "neo-Hookean material is isotropic, and that of the model is not"
        raise ModelError(f"{text}; leave sampling out, or give a rom.Material.")
