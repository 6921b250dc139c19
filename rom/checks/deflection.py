"""Large deflection of a reduced body against that of its finite elements.

Each component of the load range alone, of either sign, and all of them together: the states of the
full model under the largest loads, its displacement, and its frequencies about that state.
"""

from typing import Any

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import bmat, csc_matrix, csr_matrix, identity
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from rom.body.flexible import FlexibleBody
from rom.body.nonlinear.geometric import Geometric
from rom.body.nonlinear.quartic import Quartic
from rom.body.nonlinear.statics import follow
from rom.eigen.verbs import mean_motion
from rom.errors import ModelError
from rom.model import Array, FEModel, Row
from rom.rows import row

DISPLACEMENT_RTOL = 5e-3  # of the largest load, in the mean square over the mass
TANGENT_RTOL = 2e-2  # small errors of stress are large ones of the stiffness it gives a thin body
FORCES = ("f_x", "f_y", "f_z", "m_x", "m_y", "m_z")
N_TANGENT = 3  # lowest frequencies compared there
MAX_ITERATIONS = 30  # of Newton's method on the full model
INCREMENT_RTOL = 1e-8  # last increment of it; the next one is its square
MIN_LOAD_STEP = 2.0**-8  # at which a path of the full model is given up


def deflection_rows(
    geometric: Geometric, model: FEModel, connection: Any, body: FlexibleBody, E: Array
) -> tuple[list[Row], dict[str, Any]]:
    """Rows of the certificate, and a table {load case: its loads and errors}.

    Args:
        geometric: the range of loads.
        model: the full model.
        connection: the same in interface coordinates, so that like is compared with like.
        body: the reduced body, seen from its reference interface.
        E: (n_local, r) its nodal shapes.
    """
    if connection.ops.comm.size > 1:
        ranks = connection.ops.comm.size
        return [Row("ranks; large deflection is compared on one", ranks, "--", True)], {}
    full, quartic = HeldSolid(model, connection, body.reference), energy_of(body)
    units = [nodal_load(model, *component) for component in geometric.components()]
    share, rows, table = np.linspace(0.25, 1.0, 4), list[Row](), dict[str, Any]()
    for name, case in load_cases(geometric).items():
        W = case @ np.array(units)
        q = follow(quartic, np.outer(share, W @ E))[-1]
        a = full.state(E @ q, W)
        rows.append(row(f"{name}: full states found", float(a is not None), 0.5, above=True))
        if a is None:
            continue
        error = full.distance(E @ q, a)
        gaps = np.abs(tangent_frequencies(body, q) / full.frequencies(a) - 1)
        rows.append(row(f"{name}: displacement", error, DISPLACEMENT_RTOL))
        rows.append(row(f"{name}: frequencies about it", gaps.max(), TANGENT_RTOL))
        table[name] = {"case": case.tolist(), "displacement": error, "frequencies": gaps.tolist()}
    return rows, table


def load_cases(geometric: Geometric) -> dict[str, Array]:
    """{name: share of each component of the range (l,)}."""
    components = geometric.components()
    units = np.eye(len(components))
    named = {
        f"{name} {FORCES[k]}": unit for (name, k, _), unit in zip(components, units, strict=True)
    }
    cases = {f"{sign}{name}": value * unit for name, unit in named.items()
             for sign, value in (("", 1.0), ("-", -1.0))}  # fmt: skip
    if len(named) > 1:
        cases["all together"] = units.sum(axis=0) / np.sqrt(len(named))
    return cases


def nodal_load(model: FEModel, name: str, component: int, largest: float) -> Array:
    """(n,) forces of one component of the load on an interface [N]."""
    interface, W = model.interfaces[name], np.zeros(model.n_dofs)
    W[interface.dofs] = largest * mean_motion(interface)[component]
    return W


def tangent_frequencies(body: FlexibleBody, q: Array) -> Array:
    """(k,) lowest frequencies about the state q (r,), on the reference interface [rad/s]."""
    lam = eigh(energy_of(body).tangent(q), body.M, eigvals_only=True)[:N_TANGENT]
    return np.sqrt(np.maximum(lam, 0.0))


class HeldSolid:
    """The full model at finite strain, one of its interfaces held in the mean.

    Args:
        model: with finite elements, on one process.
        connection: the same in interface coordinates a, u = T a.
        reference: the interface that is held.
    """

    def __init__(self, model: FEModel, connection: Any, reference: str):
        ops, interface = connection.ops, model.interfaces[reference]
        self.solid = model.stresses.finite_strain()
        self.T = csr_matrix(identity(model.n_dofs) if ops.T is None else rows_of(ops.T))
        self.M = self.T.T @ ops.gathered(model.operators.M) @ self.T
        self.C = csr_matrix(mean_motion(interface)) @ self.T[interface.dofs]
        self.inside = splu(csc_matrix(self.T.T @ self.T))

    def state(self, u: Array, W: Array) -> Array | None:
        """(m,) equilibrium in a under nodal loads W (n,) [N] near u (n,); None if not found."""
        near = self.inside.solve(self.T.T @ u)
        found = self._newton(near, W)
        return self._from_rest(W) if found is None else found

    def _from_rest(self, W: Array) -> Array | None:
        """The same by steps of the load, halved where Newton's method fails."""
        a, done, step = np.zeros(self.T.shape[1]), 0.0, 0.25
        while done < 1.0:
            step = min(step, 1.0 - done)
            ahead = self._newton(a, (done + step) * W)
            if ahead is not None:
                a, done = ahead, done + step
            elif step < MIN_LOAD_STEP:
                return None
            else:
                step /= 2
        return a

    def _newton(self, a: Array, W: Array) -> Array | None:
        """The equilibrium near a (m,), None if Newton's method does not find it."""
        for _ in range(MAX_ITERATIONS):
            gap = self.T.T @ (W - self.solid.force(self.T @ a))
            step = self._bordered(a).solve(np.r_[gap, -self.C @ a])[: a.size]
            a = a + step
            size = np.linalg.norm(step)
            if not np.isfinite(size):
                return None
            if size <= INCREMENT_RTOL * np.linalg.norm(a):
                return a
        return None

    def _bordered(self, a: Array) -> Any:
        """Factor of the stiffness at a (m,) with the interface held by multipliers."""
        K = self.T.T @ self.solid.tangent(self.T @ a) @ self.T
        scale = np.abs(K.diagonal()).mean() / np.abs(self.C).max()
        return splu(csc_matrix(bmat([[K, scale * self.C.T], [scale * self.C, None]])))

    def distance(self, u: Array, a: Array) -> float:
        """Distance of a displacement (n,) from the state a, in the mean square, relative."""
        gap = self.inside.solve(self.T.T @ u) - a
        return float(np.sqrt((gap @ self.M @ gap) / (a @ self.M @ a)))

    def frequencies(self, a: Array) -> Array:
        """(k,) lowest frequencies about the state a (m,) [rad/s]."""
        n, factor = a.size, self._bordered(a)
        inverse = LinearOperator(
            (n, n), matvec=lambda x: factor.solve(np.r_[x, np.zeros(self.C.shape[0])])[:n]
        )
        lam = eigsh(self.M, N_TANGENT, self.M, sigma=0.0, OPinv=inverse, return_eigenvectors=False)
        return np.sqrt(np.sort(np.maximum(lam, 0.0)))


def rows_of(A: Any) -> csr_matrix:
    """A PETSc matrix on one process as a SciPy one."""
    starts, columns, values = A.getValuesCSR()
    return csr_matrix((values, columns, starts), shape=A.getSize())


def energy_of(body: FlexibleBody) -> Quartic:
    """The energy of a body of large deflection.

    Raises:
        ModelError: for a body of small deflection.
    """
    if body.quartic is None:
        raise ModelError(f"body {body.name!r} is one of small deflection.")
    return body.quartic
