"""The operator verbs all reductions are written on, and the lowest modes of a model.

Rows of tall matrices belong to this process; small matrices are equal on all ranks. The SciPy
implementation below holds all rows; ``rom.fe.operators.petsc`` distributes them.
"""

from collections.abc import Callable
from typing import Any, Protocol, TypeVar

import numpy as np
import numpy.typing as npt
from scipy.linalg import eigh, qr
from scipy.sparse import csr_matrix, identity, kron

from rom.errors import InterfaceError, ModelError
from rom.model import Array, Index, Interface, Mask
from rom.model import rigid_motions as rigid_motions

Value = TypeVar("Value")
Product = Callable[[Array, Array], Array]
Matrix = Any  # of SciPy, dense or sparse, or of PETSc, neither of which has types
Weighted = tuple[float, list[tuple[float, Matrix]]]
CLUSTER_RTOL = 1e-5  # relative distance of eigenvalues that belong to one space
DEPENDENT_RTOL = 1e-9  # share of a column that is new, below which it is dropped
CANCELLING_RATIO = 0.7  # length after over before a projection that may have left a part of it
COLUMNS_AT_ONCE = 32  # as many as factors solve for together
ON_A_LINE = 1e-12  # smallest over largest moment of a surface that counts as a line


class Factor(Protocol):
    """What solves with a matrix that was factored."""

    def solve(self, F: Array) -> Array:
        """(n_local, k) A^-1 F of (n_local, k), in units of F over those of A."""


class Held(Protocol):
    """A stiffness matrix with some dofs held, factored once."""

    n_free: int

    def __call__(self, F: Array) -> Array:
        """Solve K_ii X_i = F_i for (n_local, k) loads; rows of held dofs come back zero."""


class Mass(Protocol):
    """What a scalar product with the mass needs of `Operators`."""

    def apply_M(self, X: Array) -> Array:
        """M X, (n_local, k), in units of M times those of X (n_local, k)."""

    def gram(self, X: Array, Y: Array) -> Array:
        """(k, l) X^T Y summed over the ranks, in units of their product.

        Both (n_local, k) and (n_local, l) have equally distributed rows.
        """


class Operators(Mass, Protocol):
    """Stiffness and mass of one body, wherever their rows live.

    Attributes:
        n: number of dofs of the whole model.
        first: global number of this process's first row.
        n_local: number of this process's rows.
        last: True on the process that owns the end of the rows, and stays so after `transform`.
        affordable: True when modes of the whole model cost a few factorisations, not hours.
        rigid: (n_local, 6) rigid motions [1, m] (three translations, three rotations about the
            origin of coordinates), or None when there is no geometry.
    """

    n: int
    first: int
    n_local: int
    last: bool
    affordable: bool
    rigid: Array | None

    def apply_K(self, X: Array) -> Array:
        """K X, (n_local, k), in units of K times those of X (n_local, k)."""

    def comparison_pays(self, n_supports: int, n_interface: int, n_modes: int) -> bool:
        """Whether full modes in so many supports cost less than this reduction did, or little."""

    def hold(self, dofs: npt.ArrayLike, shift: float = 0.0) -> Held:
        """Eliminate the held dofs (global numbers, equal on all ranks) and factor the rest.

        With a shift [rad^2/s^2] the matrix factored is K - shift M, for answers at a frequency.

        Raises:
            InterfaceError: if a rigid motion stays free.
            SolverError: if the shift is an eigenvalue to the last digit.
            ResourceError: if the factor is predicted not to fit into memory.
        """

    def modes(
        self,
        held: npt.ArrayLike | Held,
        m: int,
        sigma: float | None = None,
        *,
        finished: bool = False,
    ) -> tuple[Array, Array]:
        """Lowest m modes with dofs (k,) held, or by what `hold` returned, to use its factor again.

        A support of a condensed body serves as well. With ``finished`` nobody else will use the
        factor, and its memory may be used for counting; a shift sigma [rad^2/s^2] is chosen where
        none is given. With nothing held the six rigid motions come first, omega exactly zero.
        Returned are omega (m,) [rad/s], ascending, and Phi (n_local, m), mass-normalised, largest
        entry positive [kg^-1/2].

        Raises:
            ModesMissedError: if an inertia count says a mode was skipped.
        """

    def transform(self, T: Matrix, rigid: Array) -> "Operators":
        """The same body in new coordinates u = T a, with K_a = T^T K T and M_a = T^T M T.

        T has the rows (n_local, n_a) of this process, sparse, global columns: those of kept dofs
        stay on the rank that owns them, in their order; further ones come last, on the last rank.
        ``rigid`` (n_local_a, 6) has the rigid motions in units of a, all rows of this rank.
        """

    def expand(self, A: Array) -> Array:
        """T A (n_parent, k), in units of the parent, of A (n_local, k) behind `transform`."""

    def restrict(self, F: Array) -> Array:
        """T^T F (n_local, k), in units of F times those of T, of loads F (n_parent, k)."""

    def rows(self, X: Array, dofs: npt.ArrayLike) -> Array:
        """X[dofs] (k, l), in units of X (n_local, l), of global dofs (k,) equal on all ranks."""

    def plus_mass(self, dM: Matrix) -> "Operators":
        """The same body with more mass: M + dM, dM sparse (n_local, n) with global columns."""

    def on_springs(self, dK: Matrix) -> "Operators":
        """The body held by springs to the ground, K + dK, dK like dM of `plus_mass`.

        It has no rigid motions then; those that no spring stops come out with almost no frequency.
        """

    def product(self, A: Matrix, X: Array) -> Array:
        """A X for a matrix with the layout of K, (n_local, k), in units of A times those of X."""

    def varied(
        self, stiffness: Weighted, mass: Weighted, rigid: Array | None = None
    ) -> "Operators":
        """Another body on the same dofs: K' = k K + sum k_i K_i, M' = m M + sum m_i M_i.

        Given are (k, [(k_i, K_i), ...]), matrices with the layout of K, and the same of the mass;
        ``rigid`` (n_local, 6) are its rigid motions [1, m], None if they are the same.
        """


class Searched(Operators, Protocol):
    """What a search for modes knows of a body, beside the verbs.

    ``fixed`` (n_local,) are numbers that depend on the place of a dof, T is the map to the
    coordinates that K and M came from, or None, ``like`` has other matrices in the same ones.
    """

    fixed: Array
    K: Matrix
    M: Matrix
    T: Matrix
    like: Callable[..., Operators]
    part: Callable[[Index], "Searched"]
    plus: Callable[[Matrix, Matrix], Matrix]
    weighted: Callable[..., Matrix]
    from_all: Callable[[Value], list[Value]]
    signed: Callable[[Array], Array]
    shift_inverse: Callable[[float], Any]
    indefinite: Callable[[float], Any]
    first_elastic: Callable[[Array], float]
    count_below: Callable[..., int | None]
    where: Callable[..., str]
    all_finite: Callable[[Array], bool]
    largest: Callable[[], float]

    @property
    def n_massive(self) -> int:
        """Number of dofs of the whole body that have mass, and thereby of modes."""

    @property
    def stiffness_diagonal(self) -> Array:
        """(n_local,) diagonal of K."""

    @property
    def mass_diagonal(self) -> Array:
        """(n_local,) diagonal of M."""


def canonical_signs(Phi: Array) -> Array:
    """Turn each column so that its largest entry is positive; the first of equals decides.

    Columns Phi (n, m), in units of any kind, are changed in place and returned.
    """
    for phi in Phi.T:
        size = np.abs(phi)
        if phi[np.argmax(size >= (1 - 1e-6) * size.max(initial=0.0))] < 0:
            phi *= -1.0
    return Phi


def count_shift(lam: Array, m: int) -> tuple[int, float]:
    """Where to count: the widest relative gap behind the m-th of some more eigenvalues.

    Of ascending lam (k,) [rad^2/s^2], k > m, not all zero: the number of eigenvalues below the gap
    and a shift inside it [rad^2/s^2].
    """
    upper, lower = lam[m:], lam[m - 1 : -1]
    least = max(np.abs(lam[-1]) * 1e-12, np.finfo(float).tiny)
    j = int(np.argmax((upper - lower) / np.maximum(np.abs(upper), least)))
    return m + j, float(0.5 * (upper[j] + lower[j]))


def whole_clusters(lam: Array, m: int) -> int:
    """The least number of lowest modes, m or more, that cuts through no repeated eigenvalue.

    One of two equal modes would prefer a direction that the structure does not have. Of ascending
    lam (k,) [rad^2/s^2], 1 <= m <= k.
    """
    while m < lam.size and lam[m] - lam[m - 1] <= CLUSTER_RTOL * lam[m]:
        m += 1
    return m


def column_blocks(n: int) -> list[slice]:
    """Slices of n columns, few at a time: products of all of them at once would be copies."""
    return [slice(first, min(first + COLUMNS_AT_ONCE, n)) for first in range(0, n, COLUMNS_AT_ONCE)]


def quadratic(ops: Operators, apply: Callable[[Array], Array], X: Array) -> Array:
    """(k, k) X^T A X summed over the ranks; ``apply`` is the product with A, of few columns."""
    return np.hstack([ops.gram(X, apply(X[:, some])) for some in column_blocks(X.shape[1])])


def unit_motions(ops: Operators, boundary: Index) -> Array:
    """(n_local, n_b) columns of the identity: one boundary dof moved, everything else at rest."""
    E, mine = np.zeros((ops.n_local, boundary.size)), owned(ops, boundary)
    E[boundary[mine] - ops.first, np.flatnonzero(mine)] = 1.0
    return E


def constraint_modes(ops: Operators, held: Held, boundary: Index) -> Array:
    """(n_local, n_b) static shapes: one boundary dof moved by one, the other boundary dofs held."""
    return static_shapes(ops, held, unit_motions(ops, boundary))


def static_shapes(ops: Operators, held: Held, E: Array) -> Array:
    """(n_local, k) static answers to motions E (n_local, k) of what is held, zero elsewhere [m].

    The motions themselves become the answers, in their place.
    """
    for some in column_blocks(E.shape[1]):
        E[:, some] -= held(ops.apply_K(E[:, some]))
    return E


def orthonormal(ops: Mass, X: Array) -> Array:
    """M-orthonormal columns (n_local, l) [kg^-1/2] with the span of X (n_local, k), in its order.

    The length of columns in units of any kind does not matter; the mass of ``ops`` is the weight.
    """
    return without_dependent(ops, X)[0]


def without_dependent(ops: Mass, X: Array) -> tuple[Array, list[int]]:
    """Columns of X, mass-orthonormal in their order, and which; the others add nothing."""
    return independent(X, lambda A, B: ops.gram(A, ops.apply_M(B)))


def orthonormal_in(S: Matrix, V: Array) -> Array:
    """S-orthonormal columns (n, l) with the span of V (n, k), in its order; sums over one process.

    The length of columns in units of any kind does not matter; S (n, n) is a symmetric positive
    weight.
    """
    return independent(V, lambda A, B: A.T @ (S @ B))[0]


def independent(X: Array, product: Product) -> tuple[Array, list[int]]:
    """Columns of X, orthonormal in their order, and the numbers of those that add something.

    The order makes bases of growing degree nested, so that frequencies fall with it.
    """
    Q, kept = X[:, :0], list[int]()
    for k in range(X.shape[1]):
        x, share = new_part(Q, X[:, k : k + 1], product)
        if share:
            Q, kept = np.hstack([Q, x]), [*kept, k]
    return Q, kept


def new_part(Q: Array, x: Array, product: Product) -> tuple[Array, float]:
    """What orthonormal columns Q do not contain of x (n_local, 1), of length one, and its share.

    A share that is round-off is zero. Gram-Schmidt, again while cancellation takes digits.
    """
    before, size = np.inf, _length(x, product)
    least = DEPENDENT_RTOL * size
    whole = size
    while least < size < CANCELLING_RATIO * before:
        x = x - Q @ product(Q, x)
        before, size = size, _length(x, product)
    return (x / size, size / whole) if size > least else (x, 0.0)


def _length(x: Array, product: Product) -> float:
    return float(np.sqrt(max(product(x, x).item(), 0.0)))


def owned(ops: Operators, dofs: Index) -> Mask:
    """(k,) whether dofs of the model are rows of this rank."""
    return (dofs >= ops.first) & (dofs < ops.first + ops.n_local)


def held_rows(ops: Operators, dofs: Index) -> Mask:
    """(n_local,) whether rows of this rank are among some dofs of the model."""
    return np.isin(np.arange(ops.first, ops.first + ops.n_local), dofs)


def coupled(shape: tuple[int, int], first: int, dofs: Index, block: Array) -> csr_matrix:
    """(n_local, n) rows from one on of a matrix that is a block (k, k) between dofs (k,)."""
    mine = (dofs >= first) & (dofs < first + shape[0])
    rows, columns = np.repeat(dofs[mine] - first, dofs.size), np.tile(dofs, int(mine.sum()))
    return csr_matrix((block[mine].ravel(), (rows, columns)), shape=shape)


def own_rows(ops: Operators, X: Array) -> Array:
    """(n_local, k) rows of this rank, of all (n, k) of any units."""
    return X[ops.first : ops.first + ops.n_local]


def own_points(ops: Operators, points: Array) -> Array:
    """(n_local / 3, 3) nodes of this rank, of all (n / 3, 3) [m]."""
    return points[ops.first // 3 : (ops.first + ops.n_local) // 3]


def every_row(ops: Operators, X: Array) -> Array:
    """(n, k) rows of all ranks, on each of them, of (n_local, k) of any units."""
    return ops.rows(X, np.arange(ops.n))


def given_rigid_motions(ops: Operators) -> Array:
    """The (n_local, 6) rigid motions of a body: translations [1] and rotations [m].

    Raises:
        ModelError: if its operators were made without geometry.
    """
    if ops.rigid is None:
        hint = "Make them with rigid=rom.eigen.verbs.rigid_motions(points)."
        raise ModelError("the operators of the model do not know its rigid motions.", hint=hint)
    return ops.rigid


def dofs_of(nodes: Index) -> Index:
    """(3k,) dofs of nodes."""
    return (3 * nodes[:, None] + np.arange(3)).ravel()


def modes_within(N: Array, K: Array, M: Array) -> tuple[Array, Array]:
    """Eigenvalues (m,) [rad^2/s^2], ascending, and modes (k, m) of small matrices (k, k).

    Among the motions N (k, m) alone, which constraints leave, in units of any kind.
    """
    try:
        lam, V = eigh(N.T @ K @ N, N.T @ M @ N)
    except np.linalg.LinAlgError:
        raise massless("the body") from None
    return lam, N @ V


def massless(of: str) -> ModelError:
    """The error of a motion that has stiffness and no mass."""
    hint = "Give its nodes an inertia, or let the interface move as a whole, as rbe2 and rbe3 do."
    text = f"a motion of {of} has stiffness and no mass"
    return ModelError(f"{text}: it would be infinitely fast.", hint=hint)


def pins(motions: Array) -> Index:
    """(p,) rows of motions (k, m) that, held at zero, stop all combinations of them."""
    if not motions.shape[1]:
        return np.zeros(0, dtype=np.int64)
    scaled = motions / np.linalg.norm(motions, axis=0)
    R, order = qr(scaled.T, mode="r", pivoting=True)
    size = np.abs(np.diag(R))
    return np.sort(order[: np.count_nonzero(size > DEPENDENT_RTOL * size[0])]).astype(np.int64)


def on_a_line(interface: Interface) -> InterfaceError:
    """The error of an interface that does not know its rotation."""
    text = f"the {interface.nodes.size} nodes of interface {interface.name!r} lie on a line"
    hint = "Choose a surface with an area, or hold another interface."
    return InterfaceError(f"{text} or in one point: its rotation is undetermined.", hint=hint)


def mean_motion(interface: Interface) -> Array:
    """(6, 3k + t) translation [1] and rotation [1/m] of a surface, least squares over its area.

    C = (R^T S R)^-1 R^T S with R the rigid motions about the origin of the interface and S the
    surface mass: the rigid motion c = C u leaves the smallest integral of |u - R c|^2. Rotations of
    nodes count where these lie on a line or in one point, each as a displacement at their mean
    distance from the origin.

    Raises:
        InterfaceError: if the nodes lie on a line, whose rotation about itself no node feels.

    Source:
        MSC Nastran Quick Reference Guide, RBE3, for the length that weighs rotations.
    """
    x = interface.points - interface.origin
    size = np.linalg.norm(x, axis=1).max(initial=0.0) or 1.0
    R = interface.rigid_motions(interface.origin) / np.r_[np.ones(3), np.full(3, size)]
    area = np.asarray(interface.surface_mass.sum(axis=1)).ravel()
    SR, n = np.zeros(R.shape), x.size
    SR[:n] = kron(interface.surface_mass, identity(3)) @ R[:n]
    gram = R.T @ SR
    if _undetermined(gram) and (turning := interface.rotations) is not None:
        arm = float(area @ np.linalg.norm(x, axis=1) / area.sum()) or size
        SR[n:] = (arm**2 * area[turning.nodes])[:, None] * R[n:]
        gram = R.T @ SR
    if _undetermined(gram):
        raise on_a_line(interface)
    return np.linalg.solve(gram, SR.T) / np.r_[np.ones(3), np.full(3, size)][:, None]


def _undetermined(gram: Array) -> bool:
    spectrum = np.linalg.eigvalsh(gram)
    return not spectrum[0] > ON_A_LINE * spectrum[-1]


def mac(ops: Operators, Phi: Array, Psi: Array) -> Array:
    """Modal assurance criterion with the mass as weight, (k, l) between 0 and 1 [1].

    Of shapes Phi (n_local, k) and Psi (n_local, l), in units of any length, as each is normalised.
    """
    cross = ops.gram(Phi, ops.apply_M(Psi))
    return cross**2 / np.outer(*(np.diag(ops.gram(X, ops.apply_M(X))) for X in (Phi, Psi)))


def residual_errors(
    ops: Operators, inverse: Held, X: Array, *, seen_in: Operators | None = None
) -> Array:
    """(k,) relative frequency errors [1] of modes of a basis, r^T K^-1 r / (2 x^T K x).

    With the residual r = K x - lambda M x of shapes X (n_local, k) [m]; asymptotically exact, not a
    bound. The inverse is of the dofs on which the basis leaves a residual; ``seen_in`` are other
    coordinates of the same model, in which equilibrium is asked for and those of the inverse.
    """
    KX, MX = ops.apply_K(X), ops.apply_M(X)
    energy = np.diag(ops.gram(X, KX))
    residual = KX - MX * (energy / np.diag(ops.gram(X, MX)))
    if seen_in is not None:
        ops, residual = seen_in, seen_in.restrict(residual)
    return np.diag(ops.gram(residual, inverse(residual))) / (2 * energy)
