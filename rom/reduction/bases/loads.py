"""Load-dependent vectors: statics under given loads inside the body, exact in any basis."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rom.arguments import typed
from rom.eigen.verbs import Operators, without_dependent
from rom.errors import ConfigError
from rom.model import Array, Basis, Index
from rom.reduction.bases.fixed_interface import numbered
from rom.reduction.bases.method import Method


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
        F = self._forces(ops)
        basis = self.method.basis(ops, boundary, labels)
        n_b = boundary.size
        if basis.labels[:n_b] != labels:
            raise ConfigError(f"{self.method!r} has no constraint modes; use rom.CraigBampton.")
        outer, inner = basis.Psi[:, :n_b], basis.Psi[:, n_b:]
        held = ops.hold(boundary) if basis.held is None else basis.held
        answers = held(F)
        both, kept = without_dependent(ops, np.hstack([inner, answers]))
        new = both[:, [k >= inner.shape[1] for k in kept]]
        names = numbered("load", new.shape[1])
        return Basis(
            np.hstack([outer, new, inner]),
            basis.omega,
            (*labels, *names, *basis.labels[n_b:]),
            held,
        )

    def _forces(self, ops: Operators) -> Array:
        if isinstance(self.loads, str):
            if self.loads != "gravity":
                raise ConfigError(f'loads = {self.loads!r}; the only word known is "gravity".')
            if ops.rigid is None:
                raise ConfigError("gravity needs the coordinates of the nodes.")
            return ops.apply_M(ops.rigid[:, :3])
        F = np.asarray(self.loads, dtype=float)
        n = ops.expand(np.zeros((ops.n_local, 1))).shape[0]
        if F.ndim != 2 or F.shape[0] != n or not np.isfinite(F).all():
            raise ConfigError(
                f"loads have the shape {F.shape}; needed are finite forces of the shape ({n}, k)."
            )
        return ops.restrict(F)
