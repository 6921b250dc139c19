"""Few functions for the full interfaces of one body, computed from its own constraint modes."""

import logging
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from scipy.linalg import null_space, orth
from scipy.sparse import identity, kron

from rom.arguments import Count, typed, whole
from rom.eigen.connection import Connection
from rom.eigen.verbs import (
    given_rigid_motions,
    modes_within,
    orthonormal_in,
    rigid_motions,
    whole_clusters,
)
from rom.errors import ConfigError
from rom.model import Array, Interface
from rom.reduction.bases.method import Guyan, Method

log = logging.getLogger("rom")


@typed
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
    n: Annotated[int, Count(6)]

    def kinds(self, connection: Connection, interfaces: dict[str, Any]) -> dict[str, object]:
        """The kinds of all interfaces of a model, {name: kind}, functions in the place of "full".

        Raises:
            ConfigError: without a full interface, or if n exceeds the dofs of one.
            InterfaceError: if the interfaces leave a rigid motion free.
            ModelError: if the model does not know its rigid motions.
        """
        names = [name for name, tie in connection.ties.items() if tie.label == "full"]
        if not names:
            text = "Characteristic reduces full interfaces, and none is given."
            raise ConfigError(text, hint='Name one, for example interfaces={"pin_a": "full"}.')
        sizes = [connection.parts[name].size for name in names]
        least = names[int(np.argmin(sizes))]
        whole("n", self.n, 0, min(sizes), reason=f"the coordinates of interface {least!r}")
        ops, full = connection.ops, np.concatenate([connection.parts[name] for name in names])
        basis = Guyan().basis(ops, connection.boundary, connection.labels)
        rigid = ops.rows(given_rigid_motions(ops), connection.boundary[full])
        Psi = basis.Psi[:, full]
        K, M = ops.gram(Psi, ops.apply_K(Psi)), ops.gram(Psi, ops.apply_M(Psi))
        # motions of the interfaces that are M-orthogonal to rigid ones
        R = orth(rigid / np.linalg.norm(rigid, axis=0), rcond=1e-9)
        lam, chi = modes_within(null_space(R.T @ M), K, M)
        ends, found = np.cumsum(sizes)[:-1], {}
        for name, part, R in zip(names, np.split(chi, ends), np.split(rigid, ends), strict=True):
            m = self._number(part, R)
            kept = whole_clusters(lam, m) if m else 0
            found[name] = CharacteristicFunctions(part[:, :kept])
            if kept > m and ops.first == 0:
                repeated = np.sqrt(lam[m - 1]) / (2 * np.pi)
                text = "interface %r: more than %d functions, %.4g Hz is repeated"
                log.info(text, name, self.n, repeated)
        return interfaces | found

    def _number(self, part: Array, rigid: Array) -> int:
        """How many modes give an interface n functions; mirrored ends see some modes twice."""
        X = np.hstack([rigid, part])
        X = X / np.maximum(np.linalg.norm(X, axis=0), 1e-300)
        m = self.n - 6
        while m < part.shape[1] and np.linalg.matrix_rank(X[:, : 6 + m], tol=1e-8) < self.n:
            m += 1
        return m


@dataclass(frozen=True, slots=True, eq=False)
class CharacteristicFunctions:
    """Motions of one interface in the modes of all."""

    values: Array  # (3k, m) displacements of the dofs of the surface

    def functions(self, interface: Interface) -> Array:
        """(3k, n) rigid motions, then the modes; orthonormal over the area, none dependent."""
        S = kron(interface.surface_mass, identity(3), format="csr")
        motions = rigid_motions(interface.points - interface.points.mean(axis=0))
        return orthonormal_in(S, np.hstack([motions, self.values]))


class GivenFunctions(CharacteristicFunctions):
    """Functions that are orthonormal over the area already, and taken as they are."""

    __slots__ = ()

    def functions(self, interface: Interface) -> Array:
        """(3k, m) the values."""
        return self.values
