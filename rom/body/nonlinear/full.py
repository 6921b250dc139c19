"""Full models at finite strain, motions of their interfaces held."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import bmat, csc_matrix, csr_matrix, identity, lil_matrix, vstack
from scipy.sparse.linalg import LinearOperator, eigs, eigsh, splu

from rom.body.nonlinear.ranges import Load
from rom.eigen.connection import Connection
from rom.eigen.verbs import Matrix, mean_motion
from rom.eigen.workers import ONE_PROCESS, Workers
from rom.model import Array, FEModel, Index, Interface
from rom.paths.load_steps import load_steps

N_TANGENT = 3  # lowest frequencies compared there
MAX_ITERATIONS = 30  # of Newton's method on the full model
INCREMENT_RTOL = 1e-8  # last increment of it; the next one is its square
COVARIANCE_STEP = 1e-6  # of differences [1]
MIN_LOAD_STEP = 2.0**-10  # at which a path of the full model is given up


@dataclass(frozen=True)
class TurningSection:
    """An interface that takes its moments with it as it turns, as markers of mechanisms do.

    With B = sum x w^T = P R over its nodes, P = P^T, its angular velocity is
    (tr P - P)^-1 sum R w x (rate of x), by which moments act.
    """

    dofs: Index  # (3 k,) of its nodes in the solid
    points: Array  # (k, 3) its nodes from their centre [m]
    weights: Array  # (k, 3) w [1/m]

    @classmethod
    def of(cls, interface: Interface, dofs: Index) -> "TurningSection":
        """That of an interface."""
        area = np.asarray(interface.surface_mass.sum(axis=0)).ravel()
        X = interface.points - area @ interface.points / area.sum()
        weights = interface.surface_mass @ X
        return cls(dofs, X, weights / float((X * weights).sum()))

    def covariance(self, u: Array) -> Array:
        """(3, 3) B at a displacement (n,) of the solid [1]."""
        return (self.points + u[self.dofs].reshape(-1, 3)).T @ self.weights

    def force(self, B: Array, moment: Array) -> Array:
        """(3 k,) forces of a moment (3,), axes at rest, on the nodes [N]."""
        R = nearest_rotation(B)
        P = B @ R.T
        x = np.linalg.solve(np.trace(P) * np.eye(3) - P, moment)
        return np.cross(x, self.weights @ R.T).ravel()

    def stiffness(self, u: Array, moment: Array) -> tuple[Array, Array]:
        """X and Y (n, 9): X Y^T is the derivative of the forces at a displacement [N/m]."""
        B, X, Y = self.covariance(u), np.zeros((u.size, 9)), np.zeros((u.size, 9))
        for k, E in enumerate(COVARIANCE_STEP * np.eye(9).reshape(9, 3, 3)):
            change = self.force(B + E, moment) - self.force(B - E, moment)
            X[self.dofs, k] = change / (2 * COVARIANCE_STEP)
            a, b = divmod(k, 3)
            Y[self.dofs[a::3], k] = self.weights[:, b]
        return X, Y


def nearest_rotation(B: Array) -> Array:
    """(3, 3) rotation nearest to a matrix, R of B = P R."""
    U, _, Vt = np.linalg.svd(B)
    return U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt


class HeldSolid:
    """A full model at finite strain, motions of its interfaces held in the mean.

    The solid has ``force`` and ``tangent``, its displacements are u = T a, T (n, m), or a itself
    for None; M (n, n) is its mass [kg], C (h, n) motions that are held. On sections moments act
    that turn with them: a load (n + 3 s,) has their moments behind the nodal forces. Every process
    of ``comm`` has all of it; ``workers`` factor the stiffness.
    """

    def __init__(
        self,
        solid: Any,
        M: Matrix,
        C: Matrix,
        T: Matrix = None,
        comm: Any = None,
        sections: Sequence[TurningSection] = (),
        workers: Workers = ONE_PROCESS,
    ):
        self.solid, self.comm, self.sections, self.workers = solid, comm, sections, workers
        self.T = csr_matrix(identity(M.shape[0]) if T is None else T)
        self.M, self.C = self.T.T @ M @ self.T, csr_matrix(C) @ self.T
        self.inside = splu(csc_matrix(self.T.T @ self.T))

    @classmethod
    def of(
        cls, model: FEModel, connection: Connection, reference: str, held: list[Load], **law: bool
    ) -> "HeldSolid":
        """That of a model in interface coordinates, its reference and further motions held."""
        ops: Any = connection.ops
        C = lil_matrix((6 + len(held), model.n_dofs))
        for k, load in enumerate([*(Load(reference, k) for k in range(6)), *held]):
            interface = model.interfaces[load.interface]
            C[k, interface.dofs] = mean_motion(interface)[load.component]
        T = None if ops.T is None else rows_of(ops.T)
        solid = model.stresses.finite_strain(**law)
        M = ops.gathered(model.operators.M)
        return cls(solid, M, C, T, ops.comm, workers=model.operators.workers)

    def whole(self, E: Array) -> Array:
        """(n, r) all rows of shapes (n_local, r)."""
        return np.vstack(self.comm.allgather(E))

    def state(self, u: Array, W: Array) -> Array | None:
        """(m,) equilibrium in a under a load W [N, N m] near u (n,); None if not found."""
        if (found := self._newton(self.inside.solve(self.T.T @ u), W)) is not None:
            return found

        def ahead(a: Array, share: float) -> Array | None:
            return self._newton(a, share * W)

        rest = np.zeros(self.T.shape[1])
        done, a = load_steps(ahead, rest, least=MIN_LOAD_STEP, first=0.25)
        return a if done == 1.0 else None

    def _newton(self, a: Array, W: Array) -> Array | None:
        """The equilibrium near a (m,), None if Newton's method does not find it."""
        for _ in range(MAX_ITERATIONS):
            u, soft = self.T @ a, self.softness(a, W)
            if soft is None:
                return None
            pushed = W[: u.size].copy()
            for section, moment in self._moments(u, W):
                pushed[section.dofs] += section.force(section.covariance(u), moment)
            gap = self.T.T @ (pushed - self.solid.force(u))
            step = soft(np.r_[gap, -self.C @ a])
            a, size = a + step, np.linalg.norm(step)
            if not np.isfinite(size):
                return None
            if size <= INCREMENT_RTOL * np.linalg.norm(a):
                return a
        return None

    def _moments(self, u: Array, W: Array | None) -> Iterator[tuple[TurningSection, Array]]:
        if W is None or W.size == u.size:
            return iter(())
        return zip(self.sections, W[u.size :].reshape(-1, 3), strict=True)

    def reached(self, u: Array, a: Array) -> float:
        """Part of a displacement (n,) along the state a, as a share of it."""
        Ma = self.M @ a
        return float((self.inside.solve(self.T.T @ u) @ Ma) / (a @ Ma))

    def distance(self, u: Array, a: Array) -> float:
        """Distance of a displacement (n,) from the state a, in the mean square, relative."""
        gap = self.inside.solve(self.T.T @ u) - a
        return float(np.sqrt((gap @ self.M @ gap) / (a @ self.M @ a)))

    def softness(self, a: Array, W: Array | None = None) -> Callable[[Array], Array] | None:
        """Displacement (m,) by forces and motions of what is held (m + h,), about a state (m,).

        Moments that turn, of the load W that the state bears, have a stiffness of low rank, X Y^T,
        which is not symmetric. None where there is no stiffness.

        Source:
            Woodbury's formula, Golub and Van Loan, Matrix Computations (2013), section 2.1.4.
        """
        u = self.T @ a
        K = self.T.T @ self.solid.tangent(u) @ self.T
        scale = np.abs(K.diagonal()).mean() / abs(self.C).max()
        bordered = bmat([[K, scale * self.C.T], [scale * self.C, None]])
        factor = self.workers.factor(bordered, pivoting=True)
        if factor is None:
            return None

        def still(f: Array) -> Array:
            return np.asarray(factor.solve(f)[: a.size])

        turned = [(section, moment) for section, moment in self._moments(u, W) if moment.any()]
        pairs = [section.stiffness(u, moment) for section, moment in turned]
        if not pairs:
            return still
        X, Y = (self.T.T @ np.hstack(part) for part in zip(*pairs, strict=True))
        held = np.zeros(self.C.shape[0])
        soft = np.column_stack([still(np.r_[x, held]) for x in X.T])
        small = np.linalg.inv(np.eye(X.shape[1]) - Y.T @ soft)

        def turning(f: Array) -> Array:
            x = still(f)
            return np.asarray(x + soft @ (small @ (Y.T @ x)))

        return turning

    def frequencies(
        self, soft: Callable[[Array], Array] | None, *, symmetric: bool = True
    ) -> Array:
        """(k,) lowest frequencies [rad/s]; not symmetric under moments that turn."""
        n, held = self.M.shape[0], np.zeros(self.C.shape[0])
        if soft is None:
            return np.zeros(N_TANGENT)

        def inverse(of: Callable[[Array], Array]) -> LinearOperator:
            return LinearOperator((n, n), matvec=lambda x: soft(np.r_[of(x), held]))

        start = np.sin(1.0 + np.arange(n))  # the same on all ranks, which solve together
        options: dict[str, Any] = {"v0": start, "return_eigenvectors": False}
        if not symmetric:
            squares = 1 / eigs(inverse(self.M.dot), N_TANGENT, **options).real
        else:
            options |= {"sigma": 0.0, "OPinv": inverse(lambda x: x)}
            squares = eigsh(self.M, N_TANGENT, self.M, **options)
        return np.sqrt(np.sort(np.maximum(squares, 0.0)))

    def compliances(self, soft: Callable[[Array], Array] | None, F: Array) -> Array:
        """(k,) displacements of unit forces F (n, k) along themselves about a state [m/N]."""
        if soft is None:
            return np.full(F.shape[1], np.inf)
        held, forces = np.zeros(self.C.shape[0]), self.T.T @ F
        return np.array([f @ soft(np.r_[f, held]) for f in forces.T])


def rows_of(A: Matrix) -> csr_matrix:
    """All rows of a distributed PETSc matrix, on every rank, as a SciPy matrix."""
    starts, columns, values = A.getValuesCSR()
    mine = csr_matrix((values, columns, starts), shape=(len(starts) - 1, A.getSize()[1]))
    return csr_matrix(vstack(A.comm.tompi4py().allgather(mine)))
