"""Few functions for the full interfaces of one body, computed from its own constraint modes."""

import logging
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.linalg import eigh, null_space, orth
from scipy.sparse import identity, kron

from rom.eigen import Operators, rigid_motions, whole_clusters
from rom.errors import ConfigError
from rom.model import Array, Interface
from rom.reduction.method import Guyan, Method
from rom.reduction.polynomial import orthonormal_in

if TYPE_CHECKING:
    from rom.reduction.interface import Connection

log = logging.getLogger("rom")


@dataclass(frozen=True, slots=True)
class Characteristic:
    """A method whose full interfaces follow characteristic constraint modes.

    With the constraint modes Psi_b of the full interfaces, K_bb = Psi_b^T K Psi_b and M_bb alike,
    the lowest modes of K_bb chi = lambda M_bb chi are the motions of the interfaces that matter at
    low frequency. Every interface takes its part of them after the six rigid motions; interfaces
    of other kinds are held meanwhile and keep their coordinates. All constraint modes are solved
    once to find the functions, which costs what polynomials spare. Two bodies would choose
    different functions for an interface they share: couple full ones, `Assembly.reduced`.

    Attributes:
        method: what reduces the body then, for example ``CraigBampton(20)``.
        n: number of functions of every full interface, six rigid motions among them.

    Source:
        Castanier, Tan and Pierre, Characteristic constraint modes for component mode synthesis,
        AIAA J. 39 (2001) 1182.
    """

    method: Method
    n: int

    def __post_init__(self) -> None:
        if isinstance(self.n, bool) or int(self.n) != self.n or self.n < 6:
            raise ConfigError(
                f"n = {self.n!r}: needed is a whole number from 6; the rigid motions count."
            )

    def kinds(self, connection: "Connection", interfaces: dict[str, Any]) -> dict[str, Any]:
        """The kinds of all interfaces, functions in the place of "full".

        Args:
            connection: the model in the coordinates of its interfaces.
            interfaces: {name: kind} it was made with.

        Raises:
            ConfigError: without a full interface, or if n exceeds the dofs of one.
            InterfaceError: if the interfaces leave a rigid motion free.
        """
        names = [name for name, tie in connection.ties.items() if tie.label == "full"]
        if not names:
            raise ConfigError(
                "Characteristic reduces full interfaces, and none is given.",
                hint='Name one, for example interfaces={"pin_a": "full"}.',
            )
        sizes = [connection.parts[name].size for name in names]
        if self.n > min(sizes):
            raise ConfigError(
                f"n = {self.n}, but interface {names[int(np.argmin(sizes))]!r} has {min(sizes)} "
                "coordinates."
            )
        ops, full = connection.ops, np.concatenate([connection.parts[name] for name in names])
        basis = Guyan().basis(ops, connection.boundary, connection.labels)
        rigid = ops.rows(ops.rigid, connection.boundary[full])
        chi = self._modes(ops, basis.Psi[:, full], rigid)
        parts = np.split(chi, np.cumsum(sizes)[:-1])
        return interfaces | {
            name: CharacteristicFunctions(part) for name, part in zip(names, parts, strict=True)
        }

    def _modes(self, ops: Operators, Psi: Array, rigid: Array) -> Array:
        """(b, n - 6) lowest modes of the interfaces that are M-orthogonal to rigid motion."""
        K, M = ops.gram(Psi, ops.apply_K(Psi)), ops.gram(Psi, ops.apply_M(Psi))
        R = orth(rigid / np.linalg.norm(rigid, axis=0), rcond=1e-9)
        Z = null_space(R.T @ M)
        lam, V = eigh(Z.T @ K @ Z, Z.T @ M @ Z)
        m = min(self.n - 6, lam.size)
        kept = whole_clusters(lam, m) if m else 0
        if kept > m and ops.first == 0:
            repeated = np.sqrt(lam[kept - 1]) / (2 * np.pi)
            log.info("%d functions instead of %d, %.4g Hz is repeated", kept + 6, self.n, repeated)
        return Z @ V[:, :kept]


@dataclass(frozen=True, slots=True, eq=False)
class CharacteristicFunctions:
    """Motions of one interface in the modes of all.

    Attributes:
        values: (3k, m) displacements of the dofs of the surface.
    """

    values: Array

    def functions(self, interface: Interface) -> Array:
        """(3k, n) rigid motions, then the modes; orthonormal over the area, none dependent."""
        S = kron(interface.surface_mass, identity(3), format="csr")
        motions = rigid_motions(interface.points - interface.points.mean(axis=0))
        return orthonormal_in(S, np.hstack([motions, self.values]))
