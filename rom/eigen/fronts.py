"""Block elimination of sparse matrices along a tree of substructures, in dense blocks."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve, eigh, solve_triangular
from scipy.linalg.lapack import dpotrf, dsysv
from scipy.sparse import csr_matrix

from rom.eigen.dissection import Substructure, dissected
from rom.errors import InterfaceError, ResourceError, SolverError
from rom.model import Array
from rom.process.memory import free_bytes

MAX_PART_DOFS = 128  # smaller parts cost more calls, larger ones more work on dense matrices

FRONT_COPIES = 6  # of stiffness and mass, and what they become


class SubstructuredBody:
    """Stiffness and mass of a body, transformed to modes of its substructures.

    The stiffness is eliminated block by block, K = L D L^T with u = L^-T u', which the mass
    follows. In each diagonal block the modes up to a cut-off are kept. The columns of T, what they
    are in dofs, have K-norm one and are K-orthogonal to each other.

    Args:
        K: (n, n) stiffness [N/m], positive definite.
        M: (n, n) mass [kg].
        cutoff: largest eigenvalue of a substructure that is kept [rad^2/s^2].

    Attributes:
        couplings: of T^T M T [s^2/rad^2], where T^T K T is one: the rows that modes of each
            substructure are coupled to, the last of them its own, and the values.
        n_kept: number r of modes of all substructures.

    Raises:
        InterfaceError: if K is not positive definite.
        ResourceError: if the blocks are foreseen not to fit into memory.
    """

    def __init__(self, K: csr_matrix, M: csr_matrix, cutoff: float):
        self.order, self.parts = dissected(csr_matrix(abs(K) + abs(M)), MAX_PART_DOFS)
        refuse_beyond(blocks_bytes(self.parts), f"eliminating {K.shape[0]} dofs in dense blocks")
        self.K, self.M = (csr_matrix(A[self.order][:, self.order]) for A in (K, M))
        self.factors: list[Any] = []
        self.shapes: list[Array] = []
        self.static: list[Array] = []
        self.couplings: list[tuple[slice, Array]] = []
        self._transform(cutoff)

    def _transform(self, cutoff: float) -> None:
        below: dict[int, list[tuple[Substructure, int, Array]]] = {}
        stiffness, mass = Extended(self.K, self.parts), Extended(self.M, self.parts)
        n_kept = 0
        for k, part in enumerate(self.parts):
            (K, K_sb, K_bb), (M, M_sb, M_bb) = stiffness.front(k), mass.front(k)
            factor = _cholesky(K)
            Psi = -cho_solve(factor, K_sb, check_finite=False)
            moved = M @ Psi
            cross = Psi.T @ (M_sb + 0.5 * moved)
            stiffness.hand_on(k, K_bb + K_sb.T @ Psi)
            mass.hand_on(k, M_bb + cross + cross.T)
            mu, Phi = _modes_of_block(factor[0], K, M, cutoff)
            first, C = _couplings(part, below.pop(k, []), n_kept)
            own = slice(n_kept, n_kept + mu.size)
            n_kept = own.stop
            C_s = C[:, : part.size]
            self.couplings.append((slice(first, n_kept), np.vstack([C_s @ Phi, np.diag(mu)])))
            C = np.vstack([C[:, part.size :] + C_s @ Psi, Phi.T @ (M_sb + moved)])
            below.setdefault(part.parent, []).append((part, first, C))
            self.factors.append(factor)
            self.shapes.append(Phi)
            self.static.append(Psi)
        self.n_kept = n_kept

    @property
    def compliance(self) -> Array:
        """(r,) diagonal of T^T M T, 1/lambda of each mode of a substructure [s^2/rad^2]."""
        return np.concatenate([np.diag(values[-values.shape[1] :]) for _, values in self.couplings])

    def apply_mass(self, Y: Array) -> Array:
        """T^T M T Y, (r, k) of coordinates (r, k)."""
        MY = np.zeros(Y.shape)
        for rows, values in self.couplings:
            below = rows.stop - values.shape[1]
            MY[rows] += values @ Y[below : rows.stop]
            MY[below : rows.stop] += values[: below - rows.start].T @ Y[rows.start : below]
        return MY

    def expand(self, Y: Array) -> Array:
        """T Y, (n, k) displacements of coordinates (r, k)."""
        X, end = np.empty((self.order.size, Y.shape[1])), Y.shape[0]
        for part, Phi, Psi in self._backwards(self.shapes, self.static):
            first = end - Phi.shape[1]
            X[part.first : part.end] = Phi @ Y[first:end] + Psi @ X[part.boundary]
            end = first
        return self._as_given(X)

    def solve(self, F: Array) -> Array:
        """K^-1 F, (n, k)."""
        X = F[self.order]
        for part, Psi in zip(self.parts, self.static, strict=True):
            X[part.boundary] += Psi.T @ X[part.first : part.end]
        for part, factor, Psi in self._backwards(self.factors, self.static):
            own = slice(part.first, part.end)
            X[own] = cho_solve(factor, X[own]) + Psi @ X[part.boundary]
        return self._as_given(X)

    def count(self, shift: float) -> int:
        """Number of eigenvalues below a shift, from the inertia of K - shift M (Sylvester).

        Raises:
            SolverError: if the shift is an eigenvalue to the last digit.
        """
        A, n_negative = Extended(csr_matrix(self.K - shift * self.M), self.parts), 0
        for k in range(len(self.parts)):
            D, B, C = A.front(k)
            pivots, kinds, X, info = dsysv(D, B, lower=1)
            if info:
                raise SolverError(f"K - {shift:.6g} M is singular: the shift is an eigenvalue.")
            single = kinds > 0  # the others are pivots of two rows, one negative, one positive
            n_negative += int(np.count_nonzero(np.diag(pivots)[single] < 0))
            n_negative += int(np.count_nonzero(~single)) // 2
            A.hand_on(k, C - B.T @ X)
        return n_negative

    def _backwards(self, *blocks: list[Any]) -> Iterator[Any]:
        return zip(*(reversed(block) for block in (self.parts, *blocks)), strict=True)

    def _as_given(self, X: Array) -> Array:
        Y = np.empty_like(X)
        Y[self.order] = X
        return Y


class Extended:
    """Fronts of a matrix: its rows of a substructure and what earlier ones have handed on."""

    def __init__(self, A: csr_matrix, parts: list[Substructure]):
        A.eliminate_zeros()  # the substructures do not know them
        self.A, self.parts = A, parts
        self.handed: dict[int, list[tuple[Substructure, Array]]] = {}

    def front(self, k: int) -> tuple[Array, Array, Array]:
        """The blocks of a substructure: its own, with its boundary, and of the boundary."""
        part, places = self.parts[k], self.parts[k].places
        rows = self.A[part.first : part.end].tocoo()
        kept = rows.col >= part.first
        F = np.zeros((places.size, places.size), order="F")
        columns = np.searchsorted(places, rows.col[kept])
        F[rows.row[kept], columns] = rows.data[kept]
        for child, values in self.handed.pop(k, []):
            at = np.searchsorted(places, child.boundary)
            F[np.ix_(at, at)] += values
        s = part.size
        return F[:s, :s], F[:s, s:], F[s:, s:]

    def hand_on(self, k: int, values: Array) -> None:
        """Give the substructure that comes next on the boundary what is left there."""
        self.handed.setdefault(self.parts[k].parent, []).append((self.parts[k], values))


def blocks_bytes(parts: list[Substructure]) -> float:
    """Memory of the factor in dense blocks, and of fronts and what they hand on [bytes]."""
    kept, waiting, most = 0, 0, 0
    handed = [0] * (len(parts) + 1)
    for k, part in enumerate(parts):
        s, b = part.size, part.boundary.size
        most = max(most, kept + 2 * waiting + FRONT_COPIES * (s + b) ** 2)
        waiting += b**2 - handed[k]
        handed[part.parent] += b**2
        kept += s * (s + b)
    return 8.0 * most


def refuse_beyond(need: float, what: str) -> None:
    """Raise ResourceError where something takes more memory [bytes] than there is."""
    there = free_bytes()
    if need > there:
        raise ResourceError(
            f"{what} takes {need / 2**30:.3g} GiB; {there / 2**30:.3g} GiB are free.",
            hint="Ask for modes up to a lower frequency, or for a number of modes, which Lanczos "
            "finds; or use a coarser mesh.",
        )


def _couplings(
    part: Substructure, below: list[tuple[Substructure, int, Array]], n_kept: int
) -> tuple[int, Array]:
    """Mass between the modes kept below a substructure and its front, and the first mode's number.

    The rows go on to the last mode kept so far.
    """
    first = min((start for _, start, _ in below), default=n_kept)
    C = np.zeros((n_kept - first, part.size + part.boundary.size))
    for child, start, values in below:
        at = np.searchsorted(part.places, child.boundary)
        C[start - first : start - first + values.shape[0], at] += values
    return first, C


def _cholesky(K: Array) -> Any:
    try:
        return cho_factor(K, lower=True)
    except LinAlgError as error:
        raise InterfaceError(
            "a substructure is not held by what surrounds it: the stiffness is not positive "
            "definite.",
            hint="Hold the body, or give the rigid motions of a free one; parts of the mesh may "
            "not be connected.",
        ) from error


def _modes_of_block(L: Array, K: Array, M: Array, cutoff: float) -> tuple[Array, Array]:
    """1/lambda and modes with K-norm one of a block with K = L L^T, for lambda <= cutoff."""
    if dpotrf(K - cutoff * M, lower=1)[1] == 0:  # positive definite: all of them are larger
        return np.zeros(0), np.zeros((L.shape[0], 0))
    S = solve_triangular(L, M, lower=True, check_finite=False)
    S = solve_triangular(L, S.T, lower=True, check_finite=False)
    mu, V = eigh(0.5 * (S + S.T), subset_by_value=(1.0 / cutoff, np.inf), driver="evr")
    return mu, solve_triangular(L, V, lower=True, trans="T", check_finite=False)
