"""A body in the coordinates of its interfaces, as programs with superelements want it."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh, null_space, solve

from rom.body.flexible import FlexibleBody
from rom.errors import ConfigError, ModelError
from rom.model import Array, Index
from rom.names import named

FIRST_SCALAR = 1001
MOST_INTERFACES = FIRST_SCALAR - 1


@dataclass(frozen=True, slots=True)
class InterfaceForm:
    """Craig-Bampton form: interface motions first, then modes with all interfaces held.

    Attributes:
        K, M, D: (n, n) stiffness, mass, damping of small motions, in units of the body, rigid ones
            included.
        dofs: (n, 2) label and component: interfaces are 1, 2, … in their order, with components 1
            to 3 translations [m] and 4 to 6 rotations [rad]; modes are 1001, … with component 0.
        points: {label: (3,) position of the interface [m]}.
        names: (i,) interfaces in the order of their labels.
        omega: (m,) frequencies with all interfaces held [rad/s].
    """

    K: Array
    M: Array
    D: Array
    dofs: Index
    points: dict[int, Array]
    names: tuple[str, ...]
    omega: Array


def interface_form(body: FlexibleBody) -> InterfaceForm:
    """The same body and the same motions in other coordinates.

    Raises:
        ConfigError: if there is no interface, or one without six coordinates (rbe2, rbe3).
        ModelError: if the shapes of the body do not let its interfaces move one by one.
    """
    names = body.interface_names
    odd = [m.name for m in body.markers.values() if m.hold.shape[0] != 6]
    if not names or len(names) > MOST_INTERFACES or odd:
        what = f"interface {named(odd)} has other coordinates" if odd else f"it has {len(names)}"
        text = f"body {body.name!r} needs interfaces of six coordinates each: {what}"
        raise ConfigError(f"{text}; reduce it with rbe2 or rbe3 interfaces.")
    body.check_support(names)
    M, K = body.full_matrices()
    D = np.zeros_like(K)
    D[6:, 6:] = body.D
    T, omega = _coordinates(body, np.vstack([body.marker(name).hold for name in names]), K, M)
    n_b = 6 * len(names)
    labels = np.r_[np.repeat(np.arange(len(names)) + 1, 6), FIRST_SCALAR + np.arange(omega.size)]
    components = np.r_[np.tile(np.arange(1, 7), len(names)), np.zeros(omega.size, dtype=int)]
    A, B, C = (0.5 * (X + X.T) for X in (T.T @ Y @ T for Y in (K, M, D)))
    A[:n_b, n_b:], A[n_b:, :n_b] = 0.0, 0.0  # by the choice of the coordinates
    points = {k + 1: body.marker(name).point for k, name in enumerate(names)}
    return InterfaceForm(A, B, C, np.column_stack([labels, components]), points, names, omega)


def _coordinates(body: FlexibleBody, H: Array, K: Array, M: Array) -> tuple[Array, Array]:
    """(6 + r, n) motions: each interface coordinate alone, in static balance; held modes."""
    scale = np.r_[np.ones(3), np.full(3, 1 / body.size), np.ones(body.n_modes)]
    rows = 1 / np.maximum(np.linalg.norm(H * scale, axis=1), 1e-300)
    G = rows[:, None] * H * scale
    if np.linalg.matrix_rank(G, tol=1e-9) < len(G):
        text = f"the {body.n_modes} shapes of body {body.name!r} tie its {len(G)} interface"
        hint = "Reduce it with CraigBampton, whose shapes move each interface alone."
        raise ModelError(f"{text} coordinates to each other.", hint=hint)
    N = scale[:, None] * null_space(G, rcond=1e-10)
    particular = scale[:, None] * np.linalg.pinv(G) * rows
    if not N.size:
        return particular, np.zeros(0)
    lam, V = eigh(N.T @ K @ N, N.T @ M @ N)
    held = N @ V
    static = particular - held @ solve(np.diag(lam), held.T @ K @ particular)
    return np.hstack([static, held]), np.sqrt(lam)
