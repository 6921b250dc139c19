"""The operator verbs all reductions are written on, and the lowest modes of a model.

Rows of tall matrices belong to this process; small matrices are equal on all ranks. The SciPy
implementation below holds all rows; ``rom.fe.petsc`` distributes them.
"""

from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from rom.model import Array, Index


class Held(Protocol):
    """A stiffness matrix with some dofs held, factored once."""

    n_free: int

    def __call__(self, F: Array) -> Array:
        """Solve K_ii X_i = F_i for (n_local, k) loads; rows of held dofs come back zero."""


class Operators(Protocol):
    """Stiffness and mass of one body, wherever their rows live.

    Attributes:
        n: number of dofs of the whole model.
        first: global number of this process's first row.
        n_local: number of this process's rows.
        rank: number of this process; 0 when there is only one.
        rigid: (n_local, 6) rigid motions (three translations, three rotations about the origin of
            coordinates), or None when there is no geometry.
    """

    n: int
    first: int
    n_local: int
    rank: int
    rigid: Array | None

    def apply_K(self, X: Array) -> Array:
        """K X, (n_local, k)."""

    def apply_M(self, X: Array) -> Array:
        """M X, (n_local, k)."""

    def gram(self, X: Array, Y: Array) -> Array:
        """X^T Y summed over the ranks; any two arrays with equally distributed rows."""

    def hold(self, dofs: npt.ArrayLike) -> Held:
        """Eliminate the held dofs (global numbers, equal on all ranks) and factor the rest.

        Raises:
            InterfaceError: if a rigid motion stays free.
            ResourceError: if the factor is predicted not to fit into memory.
        """

    def modes(self, held: npt.ArrayLike | Held, m: int, sigma: float | None = None):
        """Lowest m modes with the given dofs held: (omega (m,), Phi (n_local, m)).

        Accepts what `hold` returned, to use its factor again. Mass-normalised, ascending, largest
        entry positive. The shift sigma is chosen from the model when not given. With nothing held
        the six rigid motions come first with omega exactly zero.

        Raises:
            ModesMissedError: if the inertia count says a mode was skipped.
        """

    def transform(self, T: Any, rigid: Array | None) -> "Operators":
        """The same body in new coordinates u = T a, with K_a = T^T K T and M_a = T^T M T.

        Args:
            T: sparse (n_local, n_a) rows of this process, global columns. The columns of kept
                dofs stay on the rank that owns them; the last ``n_masters`` columns on the last rank.
            rigid: (n_local_a, 6) the rigid motions in a.
        """

    def expand(self, A: Array) -> Array:
        """T A: from the coordinates of `transform` back to (rows of the parent, k)."""
