"""Reduction methods as small records: what `rom.reduce` is asked to do."""

from dataclasses import dataclass, field, replace
from typing import Annotated, Any, Literal, Protocol

import numpy as np

from rom.arguments import Between, Modes, Positive, finite, not_both, one_of, typed, whole
from rom.eigen.band import modes_up_to
from rom.eigen.verbs import Held, Operators, whole_clusters, without_dependent
from rom.errors import ConfigError, warn
from rom.model import Array, Basis, Index
from rom.reduction.bases.fixed_interface import (
    Columns,
    Constrained,
    Counted,
    numbered,
    projected,
    residual_shapes,
)
from rom.reduction.bases.selection import Wanted, enough_modes
from rom.rows import FREQUENCY_RTOL

FIRST_BATCH = 16  # modes computed first where their number is looked for
ENOUGH_RTOL = 0.5 * FREQUENCY_RTOL  # the estimate is none below half the limit of certificates
LANCZOS_SEARCH: Literal["lanczos"] = "lanczos"
SUBSTRUCTURE_SEARCH = "substructures"
SUBSTRUCTURE_RTOL = 1e-3  # of frequencies, by their bounds; most are far better


class Method(Protocol):
    """What `rom.reduce` needs of a method."""

    def basis(self, ops: Operators, boundary: Index, labels: tuple[str, ...]) -> Basis:
        """The basis in interface coordinates; columns of the boundary (n_b,) first."""


@typed
@dataclass(frozen=True, slots=True)
class Guyan(Constrained):
    """Constraint modes alone: exact statics, mass condensed to the interfaces.

    Source:
        Guyan, Reduction of stiffness and mass matrices, AIAA J. 3 (1965) 380.
    """

    def _completed(self, ops: Operators, held: Held, Psi_b: Array, boundary: Index) -> Columns:
        return Psi_b, np.zeros(0), ()


@typed
@dataclass(frozen=True, slots=True)
class CraigBampton(Constrained):
    """Constraint modes of the interface coordinates and fixed-interface normal modes.

    Without a number or a band, the fewest modes are kept with which the six lowest elastic
    frequencies of the body, free and held by each of its interfaces, are accurate: those that its
    certificate compares.

    Attributes:
        n_modes: number of fixed-interface modes; a repeated frequency is kept whole.
        f_max: alternatively, keep all fixed-interface modes up to this frequency [Hz].
        tol: keep instead the fewest modes whose estimated error [1] of every natural frequency of
            the free body up to f_max is at most this, e.g. 1e-3; without f_max, of the lowest
            six in every support, 5e-4 if not given.
        search: how modes up to f_max are found: "lanczos", in batches of twice the number, or
            "substructures", which counts them first: for hundreds of them, in one process.
        supports: columns of the interfaces that are held for this, which `rom.reduce` fills in.

    Raises:
        ConfigError: for both n_modes and f_max, or substructures without f_max or with tol.

    Source:
        Craig and Bampton, Coupling of substructures for dynamic analyses, AIAA J. 6 (1968) 1313.

    Example:
        >>> rom.CraigBampton(f_max=3e3, tol=1e-3)  # as few modes as that takes
        CraigBampton(n_modes=None, f_max=3000.0, tol=0.001, search='lanczos')
    """

    n_modes: Modes | None = None
    f_max: Annotated[float, Positive("Hz")] | None = None
    tol: Annotated[float, Between(0, 1, "()")] | None = None
    search: Literal["lanczos", "substructures"] = LANCZOS_SEARCH
    supports: tuple[Index, ...] = field(default=(), repr=False, compare=False)

    def __post_init__(self) -> None:
        not_both("CraigBampton", n_modes=self.n_modes, f_max=self.f_max)
        not_both("CraigBampton", n_modes=self.n_modes, tol=self.tol)
        if self.search == SUBSTRUCTURE_SEARCH and (self.f_max is None or self.tol is not None):
            raise ConfigError('search="substructures" needs f_max, and takes no tol.')

    @property
    def chooses(self) -> bool:
        """Whether the number of modes follows from estimated errors."""
        return self.n_modes is None and (self.f_max is None or self.tol is not None)

    def _completed(self, ops: Operators, held: Held, Psi_b: Array, boundary: Index) -> Columns:
        if self.chooses:
            omega, Phi = enough_modes(ops, held, Psi_b, self._wanted(), FIRST_BATCH)
        else:
            omega, Phi = self._normal_modes(ops, held)
        return np.hstack([Psi_b, Phi]), omega, numbered("fixed-interface", omega.size)

    def _wanted(self) -> Wanted:
        if self.f_max is not None and self.tol is not None:
            return Wanted(self.tol, 2 * np.pi * self.f_max)
        return Wanted(ENOUGH_RTOL if self.tol is None else self.tol, supports=self.supports)

    def _normal_modes(self, ops: Operators, held: Held) -> tuple[Array, Array]:
        if self.search == SUBSTRUCTURE_SEARCH and self.f_max is not None:
            found = modes_up_to(ops, held, self.f_max, SUBSTRUCTURE_RTOL)
            return found.omega, found.shapes
        if self.n_modes is not None:
            whole("n_modes", self.n_modes, 0, held.n_free, reason="the dofs off the interfaces")
            return lowest_modes(ops, held, int(self.n_modes))
        limit = 2 * np.pi * (np.inf if self.f_max is None else self.f_max)
        m = min(FIRST_BATCH, held.n_free)
        omega, Phi = ops.modes(held, m)
        while omega.size and omega[-1] <= limit and m < held.n_free:
            m = min(2 * m, held.n_free)
            omega, Phi = ops.modes(held, m)
        keep = int(np.searchsorted(omega, limit, side="right"))
        return omega[:keep], Phi[:, :keep]


@typed
@dataclass(frozen=True, slots=True)
class EnhancedCraigBampton(Counted, Constrained):
    """Craig-Bampton of the same size, its columns corrected to first order in the eigenvalue.

    With F_rs the flexibility of the fixed-interface modes left out and T_r = F_rs M Psi_b, the
    substitution of the eigenvalue by H = M_0^-1 K_0 gives T_1 = T_0 + T_r H. Low frequencies of
    the free body gain orders of magnitude; supports and statics under interface loads lose, and the
    certificate says so. In an assembly or joints H had to be that of the whole, which a body made
    by itself cannot know: its frequencies are off by per cents there, and `rom.Assembly` warns.
    `MomentMatching` ``((0.0,), 2)`` has T_r as columns of their own, which serve everywhere.

    Attributes:
        n_modes: number of fixed-interface modes.

    Source:
        Kim and Lee, An enhanced Craig-Bampton method, Int. J. Numer. Meth. Eng. 103 (2015) 79.
    """

    def _completed(self, ops: Operators, held: Held, Psi_b: Array, boundary: Index) -> Columns:
        omega, Phi = ops.modes(held, self.n_modes)
        T0 = np.hstack([Psi_b, Phi])
        K0, M0 = projected(ops, T0)
        H = np.linalg.solve(M0, K0)
        T0 += residual_shapes(ops, held, Psi_b, omega, Phi) @ H[: boundary.size]
        return T0, omega, numbered("enhanced", omega.size)


@typed
@dataclass(frozen=True, slots=True)
class WithLoads:
    """A method whose basis also answers loads that do not come through the interfaces.

    The answers with the interfaces held, K_ii^-1 F, join the basis as far as it does not contain
    them; truncated modes then leave no static error under these loads (static correction).

    Attributes:
        method: a method with constraint modes, for example ``CraigBampton(20)``.
        loads: (n_local, k) nodal forces [N], row 3*node + axis, the rows of this process; or
            "gravity" for a uniform acceleration along each axis.

    Source:
        Wilson, Yuan and Dickens, Dynamic analysis by direct superposition of Ritz vectors,
        Earthq. Eng. Struct. Dyn. 10 (1982) 813.
    """

    method: Method
    loads: Any = "gravity"

    def basis(self, ops: Operators, boundary: Index, labels: tuple[str, ...]) -> Basis:
        """The basis: columns of the interface dofs (n_b,), answers to loads, columns of the method.

        Raises:
            ConfigError: if the loads do not fit the body, or it has no geometry to weigh.
        """
        F, n_b = self._forces(ops), boundary.size
        basis = self.method.basis(ops, boundary, labels)
        if basis.labels[:n_b] != labels:
            raise ConfigError(f"{self.method!r} has no constraint modes; use rom.CraigBampton.")
        outer, inner = basis.Psi[:, :n_b], basis.Psi[:, n_b:]
        held = ops.hold(boundary) if basis.held is None else basis.held
        both, kept = without_dependent(ops, np.hstack([inner, held(F)]))
        new = both[:, [k >= inner.shape[1] for k in kept]]
        names = (*labels, *numbered("load", new.shape[1]), *basis.labels[n_b:])
        return Basis(np.hstack([outer, new, inner]), basis.omega, names, held)

    def _forces(self, ops: Operators) -> Array:
        if isinstance(self.loads, str):
            one_of("loads", self.loads, ["gravity"])
            if ops.rigid is None:
                raise ConfigError("gravity needs the coordinates of the nodes.")
            return ops.apply_M(ops.rigid[:, :3])
        n = ops.expand(np.zeros((ops.n_local, 1))).shape[0]
        return ops.restrict(finite("loads", self.loads, (n, None)))


def judged_in(method: Any, supports: tuple[Index, ...]) -> Any:
    """The method; if it chooses the number of its modes, so that they serve all supports."""
    inner = getattr(method, "method", None)
    if inner is not None:
        return replace(method, method=judged_in(inner, supports))
    chooses = isinstance(method, CraigBampton) and method.chooses
    return replace(method, supports=supports) if chooses else method


def lowest_modes(ops: Operators, held: Held, n_modes: int) -> tuple[Array, Array]:
    """The lowest fixed-interface modes, and those beyond that share the last frequency.

    Which member of a repeated frequency comes first is an accident of round-off; a basis that cut
    it in two would differ from run to run.
    """
    if n_modes == 0:
        return ops.modes(held, 0)
    n, keep = n_modes, n_modes
    while keep == n and n < held.n_free:  # the last frequency may go on beyond the modes computed
        n = min(n + 1 if n == n_modes else n + 4, held.n_free)
        omega, Phi = ops.modes(held, n, finished=True)
        keep = whole_clusters(omega**2, n_modes)
    if n == n_modes:  # there are no others
        return ops.modes(held, n, finished=True)
    if keep > n_modes and ops.first == 0:
        warn(
            f"{keep} fixed-interface modes are kept instead of {n_modes}: the last ones share the "
            f"frequency {omega[n_modes - 1] / (2 * np.pi):.6g} Hz."
        )
    return omega[:keep], Phi[:, :keep]
