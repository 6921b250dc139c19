"""Natural frequencies of a body that rotates steadily with its supports."""

import numpy as np
import numpy.typing as npt
from scipy.linalg import eigvals

from rom.arguments import finite, unit_vector
from rom.body.frame import seen_from
from rom.body.records import BodyData, rows_held, still_motions
from rom.body.stiffening import SecondOrder
from rom.eigen.supports import Fixed, supports
from rom.errors import ConfigError, ModelError, warn
from rom.model import Array
from rom.rotation import crossed

GROWTH_RATE_RTOL = 1e-6  # growth rate of an unstable motion, of the largest frequency


def rotating_frequencies(
    body: BodyData,
    speed: float,
    axis: npt.ArrayLike,
    *,
    fixed: Fixed,
    at: npt.ArrayLike = (0.0, 0.0, 0.0),
) -> Array:
    """(k,) frequencies [Hz] of a body in SI, as `FlexibleBody.rotating_frequencies` explains."""
    if body.quartic is not None:
        text = f"body {body.name!r} is one of large deflection, which rotation bends and stretches"
        raise ModelError(text, hint="Use rom.linearize(mech, rom.equilibrium(mech, spin=...)).")
    w, arm = speed * unit_vector("axis", axis), finite("at", at, (3,))
    if not fixed:
        raise ConfigError("a rotating body needs a support: name the interfaces in fixed=(...).")
    body.check_support(fixed)
    (first, directions), *others = supports(fixed, body.markers).items()
    if len(rows_held(body.marker(first), directions)) < len(body.marker(first).hold):
        why = f"interface {first!r} is held in part; name first a support that turns the body."
        raise ConfigError(why)
    if speed and not body.K_geo:
        warn(f"body {body.name!r} has no geometric stiffness: rotation softens it only.")
    seen = seen_from(body, first)  # in its frame the first support is at rest
    held = {name: rows_held(seen.marker(name), directions) for name, directions in others}
    H = np.vstack([_held(seen, rows) for rows in (seen.marker(first).hold, *held.values())])
    N = still_motions(H)
    K, G = rotating_matrices(seen, w, arm, held)
    M, K, G = (N.T @ A @ N for A in (seen.M, K, G))
    return _frequencies(M, K, G, f"body {body.name!r} at {speed:g} rad/s")


def _held(body: BodyData, rows: Array) -> Array:
    """(h, r) those of some coordinates (h', 6 + r) that its frame does not hold to round-off."""
    rigid = np.abs(rows[:, :6] * np.r_[np.ones(3), np.full(3, 1 / body.size)]).max()
    size = np.linalg.norm(rows[:, 6:] / np.sqrt(np.diag(body.M) / body.mass), axis=1)
    return rows[size > 1e-9 * rigid, 6:]


def rotating_matrices(
    body: BodyData, w: Array, at: Array, held: dict[str, Array] | None = None
) -> tuple[Array, Array]:
    """Stiffness and gyroscopic matrix (r, r) of small vibrations in a frame that turns steadily.

    The frame turns with w (3,) [rad/s] about an axis through a point (3,) [m], body frame;
    coordinates (h, 6 + r) of interfaces held besides it pull with the force they carry at rest.
    """
    psi = SecondOrder.of(body)
    a_origin = -np.cross(w, np.cross(w, at))  # acceleration of the body origin
    K = body.K + np.einsum("a,akl->kl", a_origin, psi.S)
    K = K + _centrifugal(psi.Ibar, w) + _centrifugal(body.S_kl, w)
    load = a_origin @ body.S + _centrifugal(body.Ibar_kl, w)
    for name, wrench in _reactions(body, load, held or {}).items():
        K -= np.einsum("p,pkl->kl", wrench, psi.markers[name])
    return 0.5 * (K + K.T), 2 * np.einsum("c,clk->kl", w, crossed(body.S_kl))


def _centrifugal(S: Array, w: Array) -> Array:
    """Integral of rho u . (w x (w x v)) from the nine integrals of rho u_a v_b."""
    return np.einsum("a,ab...,b->...", w, S, w) - w @ w * np.einsum("aa...->...", S)


def _reactions(body: BodyData, load: Array, held: dict[str, Array]) -> dict[str, Array]:
    """{support: (6,) force and moment at its marker} that hold it in place against a load."""
    if not held:
        return {}
    H = np.vstack([rows[:, 6:] for rows in held.values()])
    compliance = np.linalg.solve(body.K, H.T)
    lam = np.linalg.lstsq(H @ compliance, compliance.T @ load, rcond=1e-10)[0]
    found, first = {}, 0
    for name, rows in held.items():
        force = rows[:, :6].T @ lam[first : first + len(rows)]
        force[3:] -= np.cross(body.marker(name).point, force[:3])
        found[name], first = force, first + len(rows)
    return found


def _frequencies(M: Array, K: Array, G: Array, culprit: str) -> Array:
    r = M.shape[0]
    one, zero = np.eye(r), np.zeros((r, r))
    lam = eigvals(np.block([[zero, one], [-K, -G]]), np.block([[one, zero], [zero, M]]))
    if not np.isfinite(lam).all():
        raise ModelError(f"{culprit} has a singular mass; look for a node of a massless region.")
    if lam.real.max(initial=0.0) > GROWTH_RATE_RTOL * np.abs(lam).max(initial=0.0):
        warn(
            f"{culprit} is unstable: rotation has used up its stiffness; motions that run away "
            "count with their imaginary part, zero if they do not oscillate."
        )
    return np.sort(np.abs(lam.imag))[::2] / (2 * np.pi)
