"""Few functions for the full interfaces of one body, computed from its own constraint modes."""

import logging
import re
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh, null_space, orth

from rom.eigen import Operators, whole_clusters
from rom.errors import ConfigError, InterfaceError
from rom.model import Array, Basis, Index
from rom.reduction.method import Method

FULL = re.compile(r" full node \d+ u[xyz]$")  # label of a dof that an interface keeps
log = logging.getLogger("rom")


@dataclass(frozen=True, slots=True)
class Characteristic:
    """A method whose full interfaces are reduced to characteristic constraint modes.

    The constraint modes Psi_b of the interfaces are replaced by Psi_b chi, with the lowest modes
    chi of their own eigenproblem K_bb chi = lambda M_bb chi; rigid motions come first. Interfaces
    of other kinds keep their coordinates and are held in that eigenproblem. For bodies that are
    coupled to each other use `Assembly.reduced`: here each side would choose other functions.

    Attributes:
        method: a method with interface columns first, for example ``CraigBampton(20)``.
        n: number of functions for all full interfaces together, six rigid motions among them.

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

    def basis(self, ops: Operators, boundary: Index, labels: tuple[str, ...]) -> Basis:
        """The basis; kept interface coordinates, characteristic modes, then the other columns.

        Raises:
            ConfigError: without a full interface, or if n exceeds its dofs.
            InterfaceError: if the model knows no rigid motions.
        """
        full = np.array([bool(FULL.search(label)) for label in labels], dtype=bool)
        if not full.any():
            raise ConfigError(
                "Characteristic reduces full interfaces, and none is given.",
                hint='Name one, for example interfaces={"pin_a": "full"}.',
            )
        if self.n > np.count_nonzero(full):
            raise ConfigError(
                f"n = {self.n}, but the full interfaces have {np.count_nonzero(full)} dofs."
            )
        if ops.rigid is None:
            raise InterfaceError("the model has no geometry: its rigid motions are unknown.")
        basis = self.method.basis(ops, boundary, labels)
        Psi, n_b = basis.Psi, boundary.size
        chi = self._functions(ops, Psi[:, :n_b][:, full], ops.rows(ops.rigid, boundary[full]))
        functions = [f"characteristic {k + 1}" for k in range(chi.shape[1])]
        kept = [label for label, dof in zip(labels, full, strict=True) if not dof]
        columns = [Psi[:, :n_b][:, ~full], Psi[:, :n_b][:, full] @ chi, Psi[:, n_b:]]
        return Basis(np.hstack(columns), basis.omega, (*kept, *functions, *basis.labels[n_b:]))

    def _functions(self, ops: Operators, Psi: Array, rigid: Array) -> Array:
        """(b, n) rigid motions and the lowest modes that are M-orthogonal to them."""
        K, M = ops.gram(Psi, ops.apply_K(Psi)), ops.gram(Psi, ops.apply_M(Psi))
        M, K = 0.5 * (M + M.T), 0.5 * (K + K.T)
        R = orth(rigid / np.linalg.norm(rigid, axis=0), rcond=1e-9)
        Z = null_space(R.T @ M)
        lam, V = eigh(Z.T @ K @ Z, Z.T @ M @ Z)
        m = self.n - R.shape[1]
        kept = whole_clusters(lam, m) if m > 0 else 0
        if kept > m and ops.first == 0:
            repeated = np.sqrt(lam[kept - 1]) / (2 * np.pi)
            log.info(
                "%d functions instead of %d, %.4g Hz is repeated",
                kept + R.shape[1],
                self.n,
                repeated,
            )
        return np.hstack([R, Z @ V[:, :kept]])
