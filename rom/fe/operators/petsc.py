"""The operator verbs on PETSc, MUMPS and SLEPc, distributed over the ranks.

Modes of a model in a given support come from SLEPc and are counted. The normal modes of a reduction
and the modes it is compared with, whose stiffness is factored already, come from our block Lanczos,
which asks for many solutions at a time, needs half the time and says how surely it is complete.
"""

from functools import cached_property
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_matrix

from rom.eigen.held import HeldBody, moves_most
from rom.eigen.scipy import ENTRY_HINT
from rom.eigen.search import N_SPARE_MODES, ModeSearch, shift_is_eigenvalue
from rom.errors import ConfigError, SolverError
from rom.fe.costs import comparison_pays, cost_of
from rom.fe.operators.aij import aij, chosen, gathered, symmetrized, weighted
from rom.fe.operators.factor import Corrected, Factor, count_below, dense_rows, transposed_rows
from rom.fe.operators.foreseen import check_factor_memory
from rom.fe.operators.iterative.gradients import ConjugateGradients, Inverse, refined
from rom.fe.operators.iterative.multigrid import multigrid
from rom.fe.operators.iterative.search import lowest_modes
from rom.fe.operators.memory import give_back
from rom.fe.operators.solver import DIRECT_SOLVER, Solver
from rom.fe.operators.spectrum import first_elastic, fixed_vector, krylov_schur, signed
from rom.fe.operators.substructures.shared import substructured
from rom.fe.operators.workers import AllRanks
from rom.model import Array, Index

COARSE_RTOL = 1e-2  # residual of solutions that only show whether there is stiffness
MAX_CARRIED_DOFS = 100  # each costs two solutions; more are worked into the matrix


class HeldPETSc(HeldBody):
    """K with the held dofs eliminated, factored once by MUMPS; call it to solve."""

    def __init__(self, ops: "PETScOperators", held: Index, shift: float = 0.0):
        super().__init__(ops, held, shift)
        self.factorable = not ops.solver.out_of_core
        if self.inner is not None:
            R = ops.rigid if ops.solver.iterative else None  # which would only run on
            if R is not None and np.linalg.matrix_rank(ops.rows(R, held), tol=1e-9) < R.shape[1]:
                raise self.singular(np.zeros((self.mine.size, 1)))
            self.make()
            if not shift:
                self.refuse_free_motion()

    def make(self) -> None:
        """Factor the stiffness, or K - shift M."""
        if self.shift:
            self.factor = self.inner.indefinite(self.shift)
            return
        near_null = None if self.ops.rigid is None else self.ops.rigid[self.mine]
        self.factor = self.inner.stiffness_inverse(near_null, self.held.size)
        self.ops.counted = getattr(self.factor, "counted", None)

    def coarsely_solved(self, F: Array) -> Array:
        """K_ii^-1 F, by iteration only so well that motions without stiffness show."""
        if self.ops.solver.iterative:
            return np.asarray(self.factor.solve(F, COARSE_RTOL))
        return super().coarsely_solved(F)


class PETScOperators(ModeSearch):
    """Stiffness and mass of one body, rows distributed over the ranks.

    K and M (n, n) are PETSc AIJ of one layout, symmetric; ``rigid`` (n_local, 6) are rigid motions,
    node by node, unless these are new coordinates; T (n_parent, n) is the map to those these came
    from, which the operators ``parent`` are in. ``fixed`` (n_local,) is a vector that does not
    depend on the partition, made from the rigid motions when not given.
    """

    held_kind = HeldPETSc
    counted: tuple[float, float] | None = None  # flops and entries of the last factor

    def __init__(
        self,
        K: PETSc.Mat,
        M: PETSc.Mat,
        rigid: Array | None = None,
        *,
        T: PETSc.Mat | None = None,
        fixed: Array | None = None,
        parent: "PETScOperators | None" = None,
        solver: Solver = DIRECT_SOLVER,
    ):
        self.K, self.M, self.rigid, self.T, self.parent = K, M, rigid, T, parent
        self.solver, self.affordable = solver, not solver.iterative
        self.comm = K.comm.tompi4py()
        self.n = K.getSize()[0]
        self.first, end = K.getOwnershipRange()
        self.n_local = end - self.first
        self.last = self.comm.rank == self.comm.size - 1
        for name, A in (("K", K), ("M", M)):
            if not np.isfinite(A.norm()):
                raise SolverError(f"{name} has an entry that is not finite.", hint=ENTRY_HINT)
        if fixed is None:
            fixed = fixed_vector(self.comm, rigid, self.first, self.n_local)
        self.fixed = fixed

    def comparison_pays(self, n_supports: int, n_interface: int, n_modes: int) -> bool:
        """By what the last factor has cost; one that was shared or compressed, by its size."""
        cost = None if self.counted is None else cost_of(*self.counted)
        return self.affordable and comparison_pays(self.n, n_supports, n_interface, n_modes, cost)

    def gram(self, X: Array, Y: Array) -> Array:
        """X^T Y summed over the ranks."""
        product = np.ascontiguousarray(X.T @ Y)
        self.comm.Allreduce(MPI.IN_PLACE, product)
        return product

    def rows(self, X: Array, dofs: npt.ArrayLike) -> Array:
        """X[dofs] on all ranks."""
        dofs = np.asarray(dofs, dtype=np.int64)
        out = np.zeros((dofs.size, X.shape[1]))
        mine = (dofs >= self.first) & (dofs < self.first + self.n_local)
        out[mine] = X[dofs[mine] - self.first]
        self.comm.Allreduce(MPI.IN_PLACE, out)
        return out

    def part(self, rows: Index) -> "PETScOperators":
        """The body with all dofs held but these: numbers on this rank."""
        some = chosen(self.first + rows, self.n, self.comm)
        K, M = (A.createSubMatrix(some, some) for A in (self.K, self.M))
        return PETScOperators(K, M, fixed=self.fixed[rows], solver=self.solver)

    def transform(self, T: Any, rigid: Array) -> "PETScOperators":
        """The same body in the coordinates a of u = T a."""
        return TiedOperators(self, csr_matrix(T), rigid)

    def restrict(self, F: Array) -> Array:
        """T^T F."""
        return F if self.T is None else transposed_rows(self.T, F)

    def plus(self, A: PETSc.Mat, dA: Any) -> PETSc.Mat:
        """A + dA, the rows of this rank."""
        B, size = A.copy(), (self.n_local, self.n)
        B.axpy(1.0, aij(csr_matrix(dA), (size, size), self.comm))
        return B

    @property
    def geometric(self) -> bool:
        """Whether the rigid motions tell where the nodes are."""
        return self.rigid is not None

    @property
    def workers(self) -> AllRanks:
        """Who solves with matrices that `gathered` has given to all ranks."""
        return AllRanks(self.comm.size, WholeOperators)

    gathered = staticmethod(gathered)
    product = staticmethod(dense_rows)
    weighted = staticmethod(weighted)

    def solved_by(self, solver: Solver) -> "PETScOperators":
        """The same body, its equations solved another way."""
        return self.like(self.K, self.M, self.rigid, solver)

    def like(
        self, K: PETSc.Mat, M: PETSc.Mat, rigid: Array | None, solver: Solver | None = None
    ) -> "PETScOperators":
        """Other matrices in the same coordinates."""
        fields: dict[str, Any] = {"T": self.T, "fixed": self.fixed, "parent": self.parent}
        return PETScOperators(K, M, rigid, **fields, solver=solver or self.solver)

    def inverse(self, A: PETSc.Mat, near_null: Array | None, n_columns: int = 0) -> Inverse:
        """A^-1 of a positive definite matrix by the solver chosen.

        Multigrid needs rigid motions (n_local, 6) on its rows, near_null; beside a factor so many
        dense columns of that length will be kept.
        """
        if self.solver.iterative:
            if near_null is None:
                raise ConfigError("the iterative solver needs the coordinates of the nodes.")
            return multigrid(A, near_null)
        check_factor_memory(A, n_columns, self.solver)
        shared = substructured(A, self.solver)
        if shared is not None:
            return shared
        factor = Factor(A, definite=True, solver=self.solver)
        return refined(factor) if self.solver.low_rank and factor.ok else factor

    def stiffness_inverse(self, near_null: Array | None, n_columns: int = 0) -> Inverse | Corrected:
        """K^-1 of a body that cannot move as a whole, see `inverse`."""
        return self.inverse(self.K, near_null, n_columns)

    def indefinite(self, shift: float) -> Factor:
        """(K - shift M)^-1 for a shift among the eigenvalues."""
        if self.solver.iterative:
            raise ConfigError(
                "answers at a frequency above zero need a factor.",
                hint='Use solver="direct" or "out-of-core", or frequencies=(0.0,).',
            )
        factor = Factor(self.shifted(shift), definite=False, solver=DIRECT_SOLVER)
        if not factor.ok:
            raise shift_is_eigenvalue(shift)
        return factor

    def shifted(self, sigma: float) -> PETSc.Mat:
        """K - sigma M."""
        A = self.K.copy()
        A.axpy(-sigma, self.M, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        return A

    def shift_inverse(self, sigma: float) -> Inverse:
        """(K - sigma M)^-1 for a shift below all eigenvalues, see `inverse`."""
        return self.inverse(self.shifted(sigma), self.rigid)

    def lowest(
        self, k: int, sigma: float, inverse: Inverse | Corrected, deflated: Array
    ) -> tuple[Array, Array]:
        """The k eigenvalues above sigma beside the deflated columns, and their modes."""
        if self.solver.iterative and isinstance(inverse, ConjugateGradients):
            spare = min(N_SPARE_MODES, k - 1)
            return lowest_modes(self, inverse, sigma, deflated, k - spare, spare)
        if isinstance(inverse, ConjugateGradients):
            return super().lowest(k, sigma, inverse, deflated)
        return krylov_schur(self, inverse, sigma, deflated, k)

    def by_blocks(
        self, m: int, sigma: float, inverse: Any, deflated: Array
    ) -> tuple[Array, Array, bool]:
        """Some more than m eigenpairs; without a factor, by another search of blocks."""
        if self.solver.iterative and isinstance(inverse, ConjugateGradients):
            return *self.lowest(m + N_SPARE_MODES, sigma, inverse, deflated), False
        return super().by_blocks(m, sigma, inverse, deflated)

    first_elastic = first_elastic
    count_below = count_below
    signed = signed

    def where(self, Phi: Array, rows: Index | None = None) -> str:
        """Words for the place that moves most."""
        return moves_most(self, Phi, rows) if self.geometric else ""

    def from_all(self, mine: Any) -> list[Any]:
        """What each rank has."""
        return self.comm.allgather(mine)

    @cached_property
    def stiffness_diagonal(self) -> Array:
        """(n_local,) diagonal of K."""
        return self.K.getDiagonal().array.copy()

    @cached_property
    def mass_diagonal(self) -> Array:
        """(n_local,) diagonal of M."""
        return self.M.getDiagonal().array.copy()


class WholeOperators(PETScOperators):
    """All rows on one rank, in coordinates of any kind; all eigenvalues may be double."""

    geometric = False
    lowest = ModeSearch.lowest  # by blocks, which find equal eigenvalues together


class TiedOperators(PETScOperators):
    """A body in the coordinates a of u = T a.

    T^T K T is formed when it is needed. A reduction whose interface coordinates are all held needs
    the rows of dofs that T leaves alone, and those stand in K already. T (n_local of u, n of a) has
    the rows of this rank, the rigid motions (n_local, 6) are in the coordinates a.
    """

    parent: PETScOperators
    T: PETSc.Mat

    def __init__(self, parent: PETScOperators, T: csr_matrix, rigid: Array):
        self.parent, self.rigid, self.comm, self.solver = parent, rigid, parent.comm, parent.solver
        self.affordable = parent.affordable
        sizes = ((parent.n_local, parent.n), (rigid.shape[0], T.shape[1]))
        self.T = aij(T, sizes, self.comm)
        self.n = T.shape[1]
        self.first, end = self.T.getOwnershipRangeColumn()
        self.n_local, self.last = end - self.first, parent.last
        self.fixed = self.restrict(parent.fixed[:, None])[:, 0]
        self.own = self._own(T)

    def _own(self, T: csr_matrix) -> Index:
        """(n_local,) row of the parent that is this coordinate and nothing else, or -1.

        Kept dofs stay on their rank, so that their rows are here.
        """
        alone = np.flatnonzero(np.diff(T.indptr) == 1)
        alone = alone[T.data[T.indptr[alone]] == 1.0]
        column = T.indices[T.indptr[alone]]
        here = (column >= self.first) & (column < self.first + self.n_local)
        own = np.full(self.n_local, -1)
        own[column[here] - self.first] = alone[here]
        return own

    def part(self, rows: Index) -> PETScOperators:
        """The body with all coordinates held but these."""
        own = self.own[rows]
        every = np.arange(self.parent.n_local) + self.parent.first
        T = self.T.createSubMatrix(
            chosen(every, self.parent.n, self.comm), chosen(self.first + rows, self.n, self.comm)
        )
        others = np.diff(T.getValuesCSR()[0]) > 0
        others[own[own >= 0]] = False
        n_others = self.comm.allreduce(np.count_nonzero(others))
        if not self.comm.allreduce(bool((own >= 0).all()), op=MPI.LAND):
            return super().part(rows)
        if not n_others:
            return self.parent.part(own)
        if n_others > MAX_CARRIED_DOFS or self.solver.iterative or self.solver.low_rank:
            return super().part(rows)
        return CarryingOperators(self, T, own, np.flatnonzero(others))

    @cached_property
    def stiffness_diagonal(self) -> Array:
        """(n_local,) diagonal of T^T diag(K) T: near that of the stiffness, which is not formed."""
        return self._squared(self.parent.stiffness_diagonal)

    @cached_property
    def mass_diagonal(self) -> Array:
        """(n_local,) the same of the mass."""
        return self._squared(self.parent.mass_diagonal)

    def _squared(self, diagonal: Array) -> Array:
        """(n_local,) diagonal of T^T D T, of a diagonal D of the parent."""
        squares = self.T.copy()
        starts, columns, values = squares.getValuesCSR()
        squares.setValuesCSR(starts, columns, values**2)
        squares.assemble()
        found = transposed_rows(squares, diagonal[:, None])[:, 0]
        squares.destroy()
        return found

    def apply_K(self, X: Array) -> Array:
        """T^T K T X."""
        return self.restrict(self.parent.apply_K(self.expand(X)))

    def apply_M(self, X: Array) -> Array:
        """T^T M T X."""
        return self.restrict(self.parent.apply_M(self.expand(X)))

    @cached_property
    def K(self) -> PETSc.Mat:
        """T^T K T."""
        return self._projected(self.parent.K)

    @cached_property
    def M(self) -> PETSc.Mat:
        """T^T M T."""
        return self._projected(self.parent.M)

    def _projected(self, A: PETSc.Mat) -> PETSc.Mat:
        projected = symmetrized(A.ptap(self.T))
        give_back()
        return projected


class CarryingOperators(TiedOperators):
    """The inside of a body, dofs u = P a, that carries a few more, d = E a.

    The stiffness P^T K P + P^T K E + E^T K P + E^T K E has dense blocks, one for each interface of
    averaged motion; the first term is as sparse as K, and is all that is factored. T is P + E, with
    the rows ``own`` of P and ``carried`` of E on this rank.
    """

    def __init__(self, whole: TiedOperators, T: PETSc.Mat, own: Index, carried: Index):
        self.parent, self.comm, self.solver = whole.parent, whole.comm, whole.solver
        self.affordable, self.T, self.rigid, self.last = whole.affordable, T, None, whole.last
        self.n, (self.first, _) = T.getSize()[1], T.getOwnershipRangeColumn()
        self.n_local = own.size
        self.own_rows, self.carried, self.bare = own, carried, self.parent.part(own)
        self.own, self.fixed = np.full(own.size, -1), self.bare.fixed

    @cached_property
    def stiffness_diagonal(self) -> Array:
        """(n_local,) diagonal of K, without what is carried."""
        return self.bare.stiffness_diagonal

    def stiffness_inverse(self, near_null: Array | None, n_columns: int = 0) -> Inverse | Corrected:
        """K^-1 by the factor of P^T K P and a correction of low rank."""
        counts = self.comm.allgather(self.carried.size)
        before, n = sum(counts[: self.comm.rank]), sum(counts)
        factor = self.bare.stiffness_inverse(near_null, n_columns + 2 * n)
        if not factor.ok:
            return factor
        unit = np.zeros((self.parent.n_local, n))
        unit[self.carried, before + np.arange(self.carried.size)] = 1.0
        K_d = self.parent.apply_K(unit)
        K_dd = self.parent.gram(unit, K_d)
        return Corrected(factor, self.gram, K_d[self.own_rows], self.restrict(unit), K_dd)
