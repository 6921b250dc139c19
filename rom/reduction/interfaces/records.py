"""What a model in interface coordinates is, and how each interface governs its dofs."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rom.eigen.verbs import Operators
from rom.model import Array, Index


@dataclass(frozen=True, slots=True)
class Tie:
    """One interface: dofs that leave, and how they follow from masters and dofs that stay.

    Attributes:
        label: name of the kind.
        names: (m,) what each coordinate is.
        coordinates: (m, 3k) map L from the dofs of the surface to its coordinates.
        removed: (d,) dofs replaced; none when the coordinates are the dofs themselves.
        by_masters: (d, m) how they follow from the coordinates.
        kept: (s,) dofs that stay and take part.
        by_kept: (d, s) how the removed ones follow from them.
    """

    label: str
    names: tuple[str, ...]
    coordinates: Any
    removed: Index
    by_masters: Array
    kept: Index
    by_kept: Array

    @property
    def n_masters(self) -> int:
        """Number of new dofs."""
        return self.by_masters.shape[1] if self.removed.size else 0


@dataclass(frozen=True, slots=True)
class Connection:
    """A model written in interface coordinates.

    Attributes:
        ops: operators in the coordinates a of u = T a; ``ops.expand`` leads back.
        boundary: (n_b,) dof numbers in a of all interface coordinates, interface by interface.
        parts: {interface: positions in ``boundary``}.
        labels: (n_b,) what each coordinate is, e.g. "pin_a rbe2 uz".
        ties: {interface: how its coordinates govern its dofs}.
    """

    ops: Operators
    boundary: Index
    parts: dict[str, Index]
    labels: tuple[str, ...]
    ties: dict[str, Tie]

    def held(self, names: tuple[str, ...]) -> Index:
        """Dof numbers that are zero when these interfaces are held."""
        known = [self.parts[name] for name in names]
        return self.boundary[np.concatenate(known)] if known else np.zeros(0, dtype=np.int64)
