"""Inertia integrals of shapes, exact to second order in the elastic coordinates.

For displacement elements M = M_s (x) I_3 with one scalar matrix M_s, so that every integral is a
3 x 3 product S(U, V) = U^T M_s V of nodal fields U, V among {1, x, phi_k}. One product of the mass
with all fields gives them all; no lumping is involved.

Source:
    Zwoelfer and Gerstmayr, A concise nodal-based derivation of the floating frame of reference
    formulation, Acta Mech. 230 (2019) 3965, for the idea.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rom.eigen.verbs import Operators, column_blocks
from rom.model import Array


@dataclass(frozen=True, slots=True)
class InertiaIntegrals:
    """Integrals over the undeformed body; names and units as in `FlexibleBody`."""

    mass: float
    first_moment: Array
    inertia: Array
    S: Array
    Ibar_kl: Array
    S_kl: Array

    def __add__(self, other: "InertiaIntegrals") -> "InertiaIntegrals":
        names = InertiaIntegrals.__slots__
        return InertiaIntegrals(*(getattr(self, n) + getattr(other, n) for n in names))


def fields_of(integrals: InertiaIntegrals) -> dict[str, Any]:
    """The integrals by their names, which bodies have as well."""
    return {name: getattr(integrals, name) for name in integrals.__slots__}


def of_body(body: Any) -> InertiaIntegrals:
    """The integrals that a body has."""
    return InertiaIntegrals(*(getattr(body, name) for name in InertiaIntegrals.__slots__))


def weighted(weights: Array, parts: Sequence[InertiaIntegrals]) -> InertiaIntegrals:
    """Integrals of bodies that share the shapes, their densities multiplied by the weights."""
    pairs = list(zip(weights, map(fields_of, parts), strict=True))
    return InertiaIntegrals(
        *(sum(w * part[name] for w, part in pairs) for name in InertiaIntegrals.__slots__)
    )


def inertia_integrals(
    ops: Operators, points: Array, Psi: Array, part: Any = None
) -> InertiaIntegrals:
    """Integrals of the finite element body, or of a part with the mass (n, n) [kg]."""
    fields = np.column_stack([np.ones(ops.n_local), points.reshape(-1), Psi])
    n, k = fields.shape[0] // 3, fields.shape[1]
    S = np.empty((3, k, 3, k))
    for some in column_blocks(k):
        X = fields[:, some]
        weighted = (ops.apply_M(X) if part is None else ops.product(part, X)).reshape(n, -1)
        S[..., some] = ops.gram(fields.reshape(n, 3 * k), weighted).reshape(3, k, 3, -1)
    return _split(S)


def point_integrals(points: Array, masses: Array, shapes: Array) -> InertiaIntegrals:
    """Integrals of point masses (p,) [kg] at points (p, 3) [m], displaced by shapes (3 p, r)."""
    fields = np.column_stack([np.ones(points.size), points.reshape(-1), shapes])
    fields = fields.reshape(points.shape[0], 3, -1)
    return _split(np.einsum("p,pak,pbl->akbl", masses, fields, fields, optimize=True))


def _split(S: Array) -> InertiaIntegrals:
    """From S[a, k, b, l] over the fields (1, x, phi_1, ...) to named integrals."""
    second = 0.5 * (S[:, 1, :, 1] + S[:, 1, :, 1].T)
    S_kl = S[:, 2:, :, 2:].transpose(0, 2, 1, 3)
    return InertiaIntegrals(
        mass=float(S[0, 0, 0, 0]),
        first_moment=S[0, 0, :, 1].copy(),
        inertia=np.trace(second) * np.eye(3) - second,
        S=S[0, 0, :, 2:].copy(),
        Ibar_kl=S[:, 1, :, 2:].copy(),
        S_kl=0.5 * (S_kl + S_kl.transpose(1, 0, 3, 2)),
    )
