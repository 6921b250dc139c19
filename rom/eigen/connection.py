"""What a model in interface coordinates is, and how each interface governs its dofs."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from rom.eigen.supports import SIX_KINDS, Fixed, held_coordinates, supports
from rom.eigen.verbs import Operators, coupled
from rom.errors import InterfaceError
from rom.model import Array, Index


@dataclass(frozen=True, slots=True)
class Tie:
    """One interface: dofs that leave, and how they follow from masters and dofs that stay."""

    label: str  # name of the kind
    names: tuple[str, ...]  # (m,) what each coordinate is
    coordinates: Any  # (m, 3k) map L from the dofs of the surface to its coordinates
    removed: Index  # (d,) dofs replaced; none when the coordinates are the dofs themselves
    # (d, m) how they follow from the coordinates; sparse where a function moves one direction only
    by_masters: Any
    kept: Index  # (s,) dofs that stay and take part
    by_kept: Array  # (d, s) how the removed ones follow from them

    @property
    def n_masters(self) -> int:
        """Number of new dofs."""
        return self.by_masters.shape[1] if self.removed.size else 0


@dataclass(frozen=True, slots=True)
class Connection:
    """A model written in interface coordinates."""

    ops: Operators  # operators in the coordinates a of u = T a; ``ops.expand`` leads back
    boundary: Index  # (n_b,) dof numbers in a of all interface coordinates, interface by interface
    parts: dict[str, Index]  # {interface: positions in ``boundary``}
    labels: tuple[str, ...]  # (n_b,) what each coordinate is, e.g. "pin_a rbe2 uz"
    ties: dict[str, Tie]  # {interface: how its coordinates govern its dofs}

    def held(self, fixed: Fixed) -> Index:
        """Dof numbers that are zero when these interfaces are held."""
        return self.boundary[self.held_parts(fixed)]

    def on_springs(self, stiffness: dict[str, Array]) -> "Connection":
        """The model on springs to the ground: {interface: (6, 6)} for its six coordinates."""
        ops = self.ops
        dK = csr_matrix((ops.n_local, ops.n))
        for name, k in stiffness.items():
            if self.ties[name].label not in SIX_KINDS:
                text = f"interface {name!r} has the kind {self.ties[name].label!r}; a spring acts"
                raise InterfaceError(f'{text} on six coordinates: give it "rbe2" or "rbe3".')
            dK = dK + coupled(dK.shape, ops.first, self.boundary[self.parts[name]], k)
        return replace(self, ops=ops.on_springs(dK))

    def held_parts(self, fixed: Fixed) -> Index:
        """The same as positions in ``boundary``."""
        found = [np.zeros(0, dtype=np.int64)]
        for name, directions in supports(fixed, self.parts).items():
            part, tie = self.parts[name], self.ties[name]
            found.append(part[held_coordinates(name, tie.label, part.size, directions)])
        return np.concatenate(found)
