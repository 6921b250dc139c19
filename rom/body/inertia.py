"""Inertia integrals of shapes, exact to second order in the elastic coordinates.

For displacement elements M = M_s (x) I_3 with one scalar matrix M_s, so that every integral is a
3 x 3 product S(U, V) = U^T M_s V of nodal fields U, V among {1, x, phi_k}. One product of the mass
with all fields gives them all; no lumping is involved.

Source:
    Zwoelfer and Gerstmayr, A concise nodal-based derivation of the floating frame of reference
    formulation, Acta Mech. 230 (2019) 3965, for the idea.

Where nodes turn, component a of a displacement has at a node a value u_a and a gradient, row a of
skew(theta). The mass between two nodes is read as that of matter about them: its part between
displacement and rotation, -skew(d), has the first moment d, its part J between rotations the second
moments P = tr(J) I / 2 - J. This is exact for rigid bodies on nodes, beside them as well, and errs
by the square of the size of elements for beams and shells. Mass, inertia, momentum and angular
momentum of shapes and their mass matrix follow from M alone and are exact.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, identity, kron

from rom.eigen.verbs import Operators, column_blocks, dofs_of, given_rigid_motions
from rom.model import Array, FEModel
from rom.rotation import axial, crossed, skew_tensor


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


def turning_integrals(model: FEModel, ops: Operators, Psi: Array) -> InertiaIntegrals:
    """Integrals of a model whose nodes may turn, or with coordinates without a place."""
    n, r, R = model.points.size, Psi.shape[1], given_rigid_motions(ops)
    D, P, theta = _moments(model, Psi)
    MPsi, rigid = ops.apply_M(Psi), ops.gram(R, ops.apply_M(R))
    U, V = Psi[:n].reshape(n // 3, -1), MPsi[:n].reshape(n // 3, -1)
    G = np.einsum("aec,jck->jeak", skew_tensor(), theta).reshape(-1, 3 * r)
    Y = D.T @ U + P @ G  # of the gradients, with values and gradients
    S_kl = (U.T @ V + G.T @ Y).reshape(3, r, 3, r).transpose(0, 2, 1, 3)
    S_kl = 0.5 * (S_kl + S_kl.transpose(1, 0, 3, 2))
    rest = ops.gram(Psi, MPsi) - np.einsum("aakl->kl", S_kl)
    Ibar = (model.points.T @ V + Y.reshape(-1, 3, 3 * r).sum(axis=0)).reshape(3, 3, r)
    turning = ops.gram(R[:, 3:], MPsi) - crossed(Ibar)
    return InertiaIntegrals(
        mass=float(np.trace(rigid[:3, :3])) / 3,
        first_moment=axial(rigid[3:, :3]),
        inertia=0.5 * (rigid[3:, 3:] + rigid[3:, 3:].T),
        S=ops.gram(R[:, :3], MPsi),
        Ibar_kl=Ibar - 0.5 * np.einsum("abc,ck->abk", skew_tensor(), turning),
        S_kl=S_kl + np.eye(3)[:, :, None, None] * (rest + rest.T) / 6,
    )


def _moments(model: FEModel, Psi: Array) -> tuple[csr_matrix, csr_matrix, Array]:
    """First moments D (k, 3 k), second P (3 k, 3 k), and rotations of nodes (k, 3, r) by shapes."""
    n, turning = model.points.size, model.rotations
    A = csr_matrix((n, model.n_dofs))  # from dofs to rotation vectors
    if turning is not None:
        place = dofs_of(turning.nodes), np.repeat(turning.dofs, 3)
        A = csr_matrix((turning.axes.ravel(), place), shape=A.shape)
    C, J = coo_matrix(model.M[:n] @ A.T), coo_matrix(A @ model.M @ A.T)
    (i, a), (j, b) = np.divmod(C.row, 3), np.divmod(C.col, 3)
    sign = np.where((b - a) % 3 == 1, 0.5, -0.5) * (a != b)
    D = csr_matrix((sign * C.data, (i, 3 * j + (3 - a - b) % 3)), shape=(n // 3, n))
    (i, a), (j, b) = np.divmod(J.row, 3), np.divmod(J.col, 3)
    trace = csr_matrix((J.data * (a == b), (i, j)), shape=(n // 3, n // 3))
    turned = csr_matrix((J.data, (3 * i + b, 3 * j + a)), shape=(n, n))
    P = csr_matrix(0.5 * kron(trace, identity(3)) - turned)
    return D, P, (A @ Psi).reshape(n // 3, 3, -1)


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
