"""Full models at finite strain, motions of their interfaces held."""

from typing import Any

import numpy as np
from scipy.sparse import bmat, csc_matrix, csr_matrix, identity, lil_matrix, vstack
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from rom.body.nonlinear.ranges import Load
from rom.eigen.verbs import mean_motion
from rom.eigen.workers import ONE_PROCESS, Workers
from rom.model import Array, FEModel

N_TANGENT = 3  # lowest frequencies compared there
MAX_ITERATIONS = 30  # of Newton's method on the full model
INCREMENT_RTOL = 1e-8  # last increment of it; the next one is its square
MIN_LOAD_STEP = 2.0**-8  # at which a path of the full model is given up


class HeldSolid:
    """A full model at finite strain, motions of its interfaces held in the mean.

    Args:
        solid: its ``force`` and ``tangent``.
        M: (n, n) mass [kg].
        C: (h, n) motions that are held.
        T: (n, m) its displacements u = T a; None for the identity.
        comm: of the processes, every one of which has all of it.
        workers: who factors its stiffness.
    """

    def __init__(
        self, solid: Any, M: Any, C: Any, T: Any = None, comm: Any = None,
        workers: Workers = ONE_PROCESS,
    ):  # fmt: skip
        self.solid, self.comm, self.workers = solid, comm, workers
        self.T = csr_matrix(identity(M.shape[0]) if T is None else T)
        self.M, self.C = self.T.T @ M @ self.T, csr_matrix(C) @ self.T
        self.inside = splu(csc_matrix(self.T.T @ self.T))

    @classmethod
    def of(
        cls, model: FEModel, connection: Any, reference: str, held: list[Load], *,
        neo_hookean: bool = False,
    ) -> "HeldSolid":  # fmt: skip
        """That of a model in interface coordinates, its reference and further motions held."""
        ops, C = connection.ops, lil_matrix((6 + len(held), model.n_dofs))
        for k, load in enumerate([*(Load(reference, k) for k in range(6)), *held]):
            interface = model.interfaces[load.interface]
            C[k, interface.dofs] = mean_motion(interface)[load.component]
        T = None if ops.T is None else rows_of(ops.T)
        solid = model.stresses.finite_strain(neo_hookean=neo_hookean)
        M = ops.gathered(model.operators.M)
        return cls(solid, M, C, T, ops.comm, model.operators.workers)

    def whole(self, E: Array) -> Array:
        """(n, r) all rows of shapes (n_local, r)."""
        return np.vstack(self.comm.allgather(E))

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
            factor = self._bordered(a)
            if factor is None:
                return None
            step = factor.solve(np.r_[gap, -self.C @ a])[: a.size]
            a = a + step
            size = np.linalg.norm(step)
            if not np.isfinite(size):
                return None
            if size <= INCREMENT_RTOL * np.linalg.norm(a):
                return a
        return None

    def _bordered(self, a: Array) -> Any:
        """Factor of the stiffness at a (m,) with the interface held by multipliers, if any."""
        K = self.T.T @ self.solid.tangent(self.T @ a) @ self.T
        scale = np.abs(K.diagonal()).mean() / abs(self.C).max()
        bordered = bmat([[K, scale * self.C.T], [scale * self.C, None]])
        return self.workers.factor(bordered, pivoting=True)

    def reached(self, u: Array, a: Array) -> float:
        """Part of a displacement (n,) along the state a, as a share of it."""
        Ma = self.M @ a
        return float((self.inside.solve(self.T.T @ u) @ Ma) / (a @ Ma))

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
        start = np.sin(1.0 + np.arange(n))  # the same on all ranks, which solve together
        lam = eigsh(
            self.M, N_TANGENT, self.M, sigma=0.0, OPinv=inverse, v0=start,
            return_eigenvectors=False,
        )  # fmt: skip
        return np.sqrt(np.sort(np.maximum(lam, 0.0)))


def rows_of(A: Any) -> csr_matrix:
    """All rows of a distributed PETSc matrix, on every rank, as a SciPy matrix."""
    starts, columns, values = A.getValuesCSR()
    mine = csr_matrix((values, columns, starts), shape=(len(starts) - 1, A.getSize()[1]))
    return csr_matrix(vstack(A.comm.tompi4py().allgather(mine)))
