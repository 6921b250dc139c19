"""The same deformations seen from another floating frame."""

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.linalg import eigh

from rom.body.records import Body
from rom.body.reference import moved_frame, reference_motion
from rom.body.stiffening import moved_stiffening
from rom.errors import ModelError
from rom.model import Array


def seen_from(body: Body, reference: Any) -> Body:
    """The body in another frame, see `FlexibleBody.with_reference`."""
    X = reference_motion(body, reference)
    moved = moved_frame(body, X)
    stress = None if body.stress is None else body.stress.moved(X)
    stiffening = moved_stiffening(body, moved, X, reference)
    moved = replace(moved, K_geo=stiffening, stress=stress)
    omega, V = _normal_modes(moved.K, moved.M)
    return _recombined(moved, V, omega, reference_label(reference))


def reference_label(reference: Any) -> str:
    """How a reference condition is written in labels and files."""
    if isinstance(reference, str):
        return "mean-axis" if reference == "free" else reference
    return ("pins " if len(reference) == 2 else "3-2-1 ") + " ".join(reference)


def _normal_modes(K: Array, M: Array) -> tuple[Array, Array]:
    smallest = np.linalg.eigvalsh(M).min(initial=np.inf)
    if smallest <= 0:
        raise ModelError(
            f"the elastic mass matrix has the eigenvalue {smallest:.3g}: the elastic coordinates "
            "contain a rigid motion, which the floating frame already describes.",
            hint="Choose a reference condition that stops all six rigid motions.",
        )
    lam, V = eigh(K, M)
    signs = np.sign(V[np.argmax(np.abs(V), axis=0), np.arange(V.shape[1])])
    return np.sqrt(np.maximum(lam, 0.0)), V * signs


def _recombined(body: Body, V: Array, omega: Array, reference: str) -> Body:
    """New elastic coordinates q = V q_new."""
    markers = {
        name: replace(
            m,
            translation=m.translation @ V,
            rotation=m.rotation @ V,
            hold=np.hstack([m.hold[:, :6], m.hold[:, 6:] @ V]),
        )
        for name, m in body.markers.items()
    }
    surface = body.surface
    if surface is not None:
        surface = replace(surface, shape=surface.shape @ V)
    stress = body.stress
    if stress is not None:
        stress = stress.recombined(V)
    S_kl = np.einsum("abkl,km,ln->abmn", body.S_kl, V, V, optimize=True)
    return replace(
        body,
        S=body.S @ V,
        Ibar_kl=body.Ibar_kl @ V,
        S_kl=0.5 * (S_kl + S_kl.transpose(1, 0, 3, 2)),
        K=np.diag(omega**2),
        D=_symmetric(V.T @ body.D @ V),
        K_geo={load: _symmetric(V.T @ A @ V) for load, A in body.K_geo.items()},
        markers=markers,
        surface=surface,
        stress=stress,
        omega=omega,
        labels=tuple(f"mode {k + 1}, {reference} frame" for k in range(omega.size)),
        reference=reference,
    )


def _symmetric(A: Array) -> Array:
    return 0.5 * (A + A.T)
