"""A flexible body as Standard Input Data, and back."""

from typing import Any

import numpy as np
from scipy.linalg import eigh

from rom.arguments import symmetric
from rom.body.flexible import FlexibleBody
from rom.body.inertia import InertiaIntegrals
from rom.body.records import Marker
from rom.body.recovery import CENTRIFUGAL_LOADS, PRODUCTS
from rom.body.reference import rigid_marker
from rom.body.stiffening import ANGULAR_LOADS, LINEAR_LOADS, SecondOrder, interface_loads
from rom.errors import ConfigError, QualityGateError
from rom.io.sid.dialect import by_mode, first
from rom.io.sid.format import StandardInput, Taylor
from rom.model import FILE_FRAME, Array
from rom.rotation import crossed, skew_tensor

Rigid = tuple[float, Array, Array]  # mass, first moment (3,), inertia (3, 3) about the origin
Nodes = dict[str, tuple[Array, Array, Array]]  # point (3,), translation, rotation (3, r)
EPS = -skew_tensor()  # of Levi-Civita
PRODUCT_NAMES = ("xx", "yy", "zz", "xy", "yz", "xz")  # of angular velocities: columns of Oe
UNEVEN_RTOL = 1e-6  # share of Oe1 below which its asymmetry is round-off of the writer
STIFFENING_RTOL = 1e-9  # share of Me below which the trace of Oe1 counts as inertia alone


def standard_input(body: FlexibleBody) -> StandardInput:
    """The blocks of a body, its geometric stiffness included; interfaces become nodes.

    Left out is what SID has no place for: terms of second order in J and Gr, surface and stress.
    Geometric stiffness acts on Oe1 (rotation), Ct1, Cr1 (acceleration), phi1, psi1 (node loads).
    """
    K = {load: np.asarray(A) for load, A in body.K_geo.items()}
    SecondOrder.of(body)  # refuses loads that are not known
    hertz = body.omega / (2 * np.pi)
    return StandardInput(
        title=f"{body.name}, {body.reference} frame, {body.units}",
        name=body.name,
        mass=body.mass,
        coordinates=tuple(f"Eigen Mode {k + 1:4d} : {f:.6g} Hz" for k, f in enumerate(hertz)),
        nodes={name: _node(marker, K) for name, marker in body.markers.items()},
        blocks=_blocks(body, K),
    )


def invariants(body: FlexibleBody | InertiaIntegrals) -> dict[str, Array]:
    """Integrals of the shapes phi_k, with x~ the matrix of the cross product with the position x.

    Inv3 (3, r) of phi_k, Inv4 (3, r) of x x phi_k, Inv8 (3, r, 3) of -x~ phi~_j, Inv5 (3, r, r) of
    phi_j x phi_k, Inv9 (3, r, r, 3) of phi~_j phi~_k, with the numbers of MBDyn.
    """
    eye = np.eye(3)
    dot = np.einsum("aak->k", body.Ibar_kl)
    both = np.einsum("aajk->jk", body.S_kl)
    return {
        "Inv3": body.S,
        "Inv4": crossed(body.Ibar_kl),
        "Inv8": np.einsum("j,ac->ajc", dot, eye) - body.Ibar_kl.transpose(1, 2, 0),
        "Inv5": crossed(body.S_kl),
        # phi~_j phi~_k = phi_k phi_j^T - (phi_j . phi_k) 1
        "Inv9": body.S_kl.transpose(1, 2, 3, 0) - np.einsum("jk,ac->ajkc", both, eye),
    }


def _blocks(body: FlexibleBody, K: dict[str, Array]) -> dict[str, Taylor]:
    r, X, S, integrals = body.n_modes, body.Ibar_kl, body.S_kl, invariants(body)
    C4 = -integrals["Inv8"].swapaxes(0, 1)  # (r, 3, 3)
    cross = integrals["Inv5"].transpose(1, 2, 0)  # of phi_j x phi_i
    Oe0 = np.stack([_product(X, a, b) for a, b in PRODUCTS], axis=1)
    Oe1 = np.stack([_product(S, a, b) for a, b in PRODUCTS], axis=-1)  # (r, r, 6), by j and i
    cross = 0.5 * (cross - cross.swapaxes(0, 1))  # to the last digit: it must do no work
    return {
        "mdCM": Taylor(body.first_moment[:, None], body.S.T[:, :, None]),
        "J": Taylor(body.inertia, -(C4 + C4.swapaxes(1, 2))),
        "Ct": Taylor(body.S.T, _loads(K, LINEAR_LOADS, r) if K.keys() & LINEAR_LOADS else None),
        "Cr": Taylor(integrals["Inv4"].T, cross + _loads(K, ANGULAR_LOADS, r)),
        "Gr": Taylor(-2 * _by_axis(C4)),
        "Ge": Taylor(2 * _by_axis(cross)),
        "Oe": Taylor(Oe0, Oe1 + _loads(K, CENTRIFUGAL_LOADS, r)),
        "Me": Taylor(body.M),
        "ksigma": Taylor(np.zeros((r, 1))),
        "Ke": Taylor(body.K),
        "De": Taylor(body.D),
    }


def _product(X: Array, a: int, b: int) -> Array:
    """Share of the product omega_a omega_b in the integral of phi . omega x (omega x X)."""
    return X[a, a] - np.einsum("cc...->...", X) if a == b else X[a, b] + X[b, a]


def _by_axis(A: Array) -> Array:
    """(n, 3 r) columns axis by axis from (r, n, 3)."""
    return A.transpose(1, 2, 0).reshape(A.shape[1], -1)


def _loads(K: dict[str, Array], names: tuple[str, ...], r: int) -> Array:
    """(r, r, k) geometric stiffness of k loads."""
    return np.stack([K.get(name, np.zeros((r, r))) for name in names], axis=-1)


def _node(marker: Marker, K: dict[str, Array]) -> dict[str, Taylor]:
    """A force moves with the node: the work on displacements of second order, K_l = -l . psi."""
    r, loads = marker.translation.shape[1], interface_loads(marker.name)
    shift = turn = None
    if K.keys() & loads:
        motion = _loads(K, loads, r)  # (j, i, 6)
        shift, turn = -motion[..., :3].swapaxes(1, 2), -motion[..., 3:].swapaxes(1, 2)
    tilt = np.einsum("abc,bk->kac", EPS, marker.rotation)
    return {
        "origin": Taylor(marker.point[:, None], marker.translation.T[:, :, None]),
        "phi": Taylor(marker.translation, shift),
        "psi": Taylor(marker.rotation, turn),
        "AP": Taylor(np.eye(3), tilt if tilt.any() else None),
    }


def from_invariants(found: dict[str, Array], M: Array) -> tuple[Array, Array, Array]:
    """S, Ibar_kl and S_kl from `invariants`, of which files may lack some, and the mass M (r, r).

    Inv4 and Inv5 are parts of Inv8 and Inv9. What none of them says is zero, but the trace of S_kl
    is M; what is left of it acts alike along all axes.
    """
    eye, r = np.eye(3)[..., None], len(M)
    C, B = found.get("Inv8", np.zeros((3, r, 3))), found.get("Inv9", np.zeros((3, r, r, 3)))
    X = _turned(0.5 * eye * np.einsum("aja->j", C) - C.transpose(2, 0, 1), found.get("Inv4"))
    S = _turned(B.transpose(3, 0, 1, 2), found.get("Inv5"))
    S = 0.5 * (S + S.transpose(1, 0, 3, 2))
    S = S + eye[..., None] * (M - np.einsum("aakl->kl", S)) / 3
    return found.get("Inv3", np.zeros((3, r))), X, S


def _turned(A: Array, wanted: Array | None) -> Array:
    """(3, 3, ...) integrals of u_a v_b with another integral (3, ...) of u x v, if there is one."""
    return A if wanted is None else A + 0.5 * np.einsum("cab,c...->ab...", EPS, wanted - crossed(A))


def body_of(
    name: str, rigid: Rigid, found: dict[str, Array], *matrices: Array, nodes: Nodes, **more: Any
) -> FlexibleBody:
    """The body of a file of another program, in SI, by `invariants` and (r, r) matrices K, D, M.

    Raises:
        QualityGateError: if a matrix is not symmetric, or negative, or there is no mass.
    """
    names = ("stiffness", "damping", "modal mass", "inertia", "mass")
    for what, A in zip(names, (*matrices, rigid[2], np.eye(1) * rigid[0]), strict=True):
        symmetric(f"the {what}", A, UNEVEN_RTOL)
        lowest, size = np.linalg.eigvalsh(A).min(initial=np.inf), np.abs(A).max(initial=0.0)
        if lowest < -UNEVEN_RTOL * size or (lowest <= 0.0 and what.endswith("mass")):
            text = f"the {what} must be positive, but has the eigenvalue {lowest:.3g}."
            raise QualityGateError(text, hint="Look which motion has none, or less.")
    K, D, M, inertia = (0.5 * (A + A.T) for A in (*matrices, rigid[2]))
    omega = np.sqrt(np.maximum(eigh(K, M, eigvals_only=True), 0.0)) if len(K) else np.zeros(0)
    integrals = *rigid[:2], inertia, *from_invariants(found, M)
    markers = {label: rigid_marker(label, *node) for label, node in nodes.items()}
    more = {"labels": tuple(f"mode {k + 1}" for k in range(len(K)))} | more
    return FlexibleBody(name, *integrals, K, D, markers, omega, reference=FILE_FRAME, **more)


def sid_body(record: StandardInput) -> FlexibleBody:
    """The flexible body of Standard Input Data without geometric stiffness.

    Oe1 adds stiffening to inertia, which then cannot be told apart; such a file serves programs
    that take its blocks as they are.

    Raises:
        ConfigError: if the blocks contain geometric stiffness, or are no integrals of shapes.
        QualityGateError: if a matrix is not symmetric, or negative.
    """
    b, r = record.blocks, record.n_modes
    Me, Oe1, Cr1 = b["Me"].M0, first(b["Oe"], r), first(b["Cr"], r)
    _check_inertia(record, Me, Oe1)
    B = np.zeros((3, r, r, 3))
    for k, (a, c) in enumerate(PRODUCTS):
        B[a, ..., c] += 0.5 * Oe1[..., k]
        B[c, ..., a] += 0.5 * Oe1[..., k]
    C, cross = by_mode(b["Gr"].M0).swapaxes(0, 1), (Cr1 - Cr1.swapaxes(0, 1)).transpose(2, 0, 1)
    found = {"Inv3": b["Ct"].M0.T, "Inv8": 0.5 * C, "Inv5": 0.5 * cross, "Inv9": B}
    rigid = record.mass, b["mdCM"].M0[:, 0], b["J"].M0
    nodes = {name: (node["origin"].M0[:, 0], node["phi"].M0, node["psi"].M0)
             for name, node in record.nodes.items()}  # fmt: skip
    told = {"labels": record.coordinates, "provenance": {"from": record.title}}
    return body_of(record.name, rigid, found, b["Ke"].M0, b["De"].M0, Me, nodes=nodes, **told)


def _check_inertia(record: StandardInput, Me: Array, Oe1: Array) -> None:
    """Inertia alone has Oe1 xx + yy + zz = -2 Me and Oe1 symmetric, and no Ct1."""
    what, size = record.place("Oe"), max(np.abs(Me).max(initial=0.0), np.abs(Oe1).max(initial=0.0))
    uneven = np.abs(Oe1 - Oe1.swapaxes(0, 1)).max(axis=(0, 1), initial=0.0)
    each = zip(PRODUCT_NAMES, uneven, strict=True)
    if columns := [name for name, x in each if x > UNEVEN_RTOL * size]:
        raise ConfigError(
            f"{what} of the SID of {record.name!r} has in its columns {', '.join(columns)} a first "
            f"order that is not symmetric, by {uneven.max():.3g} of {size:.3g}: it is no integral "
            "of products of shapes, as files of PY_SID with several modes have it.",
            hint="rom.read_sid gives the blocks as they are; write the body by another program.",
        )
    excess = np.abs(Oe1[:, :, :3].sum(axis=2) + 2 * Me).max(initial=0.0)
    loaded = first(record.blocks["Ct"], record.n_modes).any()
    if loaded or excess > STIFFENING_RTOL * np.abs(Me).max(initial=0.0):
        raise ConfigError(
            f"{what} of the SID of {record.name!r} holds more than the inertia of its Me, by "
            f"{excess:.3g}: geometric stiffness in Oe, which cannot be told from inertia, or "
            "another mass than that of Me.",
            hint="Export without geometric stiffness; rom.read_sid gives the blocks as they are.",
        )
