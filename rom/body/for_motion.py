"""The fewest modes that a motion needs, chosen by what each is worth to it."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.linalg import null_space

from rom.body.frame import on_normal_modes, recombined
from rom.body.records import Body
from rom.body.recovery import N_FRAME_LOADS, PRODUCTS, StressRecovery
from rom.body.reference import moved_integrals
from rom.eigen.verbs import dofs_of
from rom.errors import ConfigError, ModelError
from rom.model import Array, Mask

LOOKS = 400  # instants that are compared
POINTS = 400  # of the surface, those of largest stress or spread over it


@dataclass(frozen=True)
class Held:
    """Modes of a body with its interfaces held, and what they do in a motion."""

    omega: Array  # (m,) [rad/s]
    V: Array  # (6 + r, m) rigid and elastic part
    y: Array  # (n_t, m) amplitudes
    ydd: Array  # (n_t, m) their second rates


def for_motion(body: Body, motion: Any, name: str, goal: str, tol: float) -> Body:
    """The body with the modes that matter, see `FlexibleBody.for_motion`."""
    if body.quartic is not None or motion.mechanism.part(name).r != body.n_modes:
        text = f"body {name!r} of the motion has not the coordinates of body {body.name!r}"
        raise ConfigError(f"{text}; give a motion of it, or `motion` of its rom.certify_motion.")
    if not body.has_static_shapes:
        text = "has free-free modes only, which its interfaces do not tell apart"
        raise ModelError(f"body {body.name!r} {text}; reduce it by CraigBampton.")
    held = _held(body, motion, name)
    felt = _stress_felt if goal == "stress" else _deformation_felt
    kept, worth = _chosen(*felt(body, motion, name, held), tol)
    return _with_modes(body, held, kept, worth, goal)


def _held(body: Body, motion: Any, name: str) -> Held:
    rows = np.unique(np.linspace(0, motion.t.size - 1, LOOKS).astype(int))
    omega, V = body.modes(fixed=tuple(body.markers))  # type: ignore[attr-defined]
    omega, V = omega[omega > 0], V[:, omega > 0]
    by = body.K @ V[6:] / omega**2
    b = motion.packed.names.index(name)
    at = motion.packed.system.bodies.v_at[b] + 6
    return Held(
        omega, V, motion.elastic(name)[rows] @ by, motion.a[rows, at : at + body.n_modes] @ by
    )


def _deformation_felt(body: Body, motion: Any, name: str, held: Held) -> tuple[Array, Array, float]:
    """(n_t, m) what of each mode is missed without it, (p, m) where, and the largest of all."""
    if body.surface is None:
        raise ModelError(f"body {name!r} carries no surface.")
    nodes = np.unique(np.linspace(0, len(body.surface.points) - 1, POINTS).astype(int))
    shape = body.surface.shape[dofs_of(nodes)]
    whole = motion.elastic(name) @ shape.T
    return held.y, shape @ held.V[6:], float(np.abs(whole).max())


def _stress_felt(body: Body, motion: Any, name: str, held: Held) -> tuple[Array, Array, float]:
    """As above; what is left out follows its load without delay, where the body tells that."""
    recovery = body.stress
    if not isinstance(recovery, StressRecovery):
        raise ConfigError(f"the stress of body {name!r} is not known; reduce it with stress=True.")
    operator = recovery.operator.reshape(len(recovery.points), 6, -1)
    q = motion.elastic(name)
    rows = np.unique(np.linspace(0, motion.t.size - 1, LOOKS // 8).astype(int))
    largest = np.abs(np.einsum("psr,tr->tps", operator, q[rows])).max(axis=(0, 2))
    hot = operator[np.argsort(largest)[-POINTS:]].reshape(-1, q.shape[1])
    missed = held.y if recovery.inertial is None else -held.ydd / held.omega**2
    return missed, hot @ held.V[6:], float(np.abs(q @ hot.T).max())


def _chosen(missed: Array, where: Array, size: float, tol: float) -> tuple[Mask, Array]:
    """The modes to be kept, and what each is worth; fewest, those of most worth first."""
    worth = np.abs(missed).max(axis=0) * np.abs(where).max(axis=0) / (size or 1.0)
    kept = np.zeros(worth.size, dtype=bool)
    for k in np.argsort(-worth):
        if np.abs(missed[:, ~kept] @ where[:, ~kept].T).max(initial=0.0) <= tol * size:
            break
        kept[k] = True
    return kept, worth


def _with_modes(body: Body, held: Held, kept: Mask, worth: Array, goal: str) -> Body:
    """The static shapes of the body and some of its modes with interfaces held."""
    V = held.V[6:]
    T = np.hstack([null_space((body.K @ V).T), V[:, kept]])
    smaller = recombined(body, T)
    recovery = body.stress
    if isinstance(recovery, StressRecovery):
        smaller = replace(smaller, stress=_with_static_share(body, recovery, held, ~kept, T))
    smaller = on_normal_modes(smaller)[0]
    rows = zip(held.omega / (2 * np.pi), worth, kept, strict=True)
    table = [[float(f), float(w), bool(k)] for f, w, k in rows]
    told = {"goal": goal, "modes: frequency, worth, kept": table}
    return replace(smaller, provenance=body.provenance | {"for motion": told}, certificate=None)


def _with_static_share(
    body: Body, recovery: StressRecovery, held: Held, out: Mask, T: Array
) -> StressRecovery:
    """The stress of the smaller body, with that of modes left out as statics of their loads."""
    if recovery.inertial is None:
        return recovery.recombined(T)
    V, M = held.V[:, out], body.full_matrices()[0]  # type: ignore[attr-defined]
    _, Ibar = moved_integrals(recombined(body, V[6:]), -V[:6])
    pull = np.array(
        [np.trace(Ibar) - Ibar[i, i] if i == j else -(Ibar[i, j] + Ibar[j, i]) for i, j in PRODUCTS]
    )
    loads = np.hstack([-V.T @ M[:, :6], pull.T, -V.T @ M[:, 6:] @ T])
    whole = np.zeros((N_FRAME_LOADS + len(T), N_FRAME_LOADS + T.shape[1]))
    whole[:N_FRAME_LOADS, :N_FRAME_LOADS] = np.eye(N_FRAME_LOADS)
    whole[N_FRAME_LOADS:, N_FRAME_LOADS:] = T
    inertial = recovery.inertial @ whole
    inertial += recovery.operator @ (V[6:] / held.omega[out] ** 2) @ loads
    return StressRecovery(recovery.points, recovery.operator @ T, inertial)
