"""Geometric stiffness per unit load, read as displacements of second order.

A prestressed body resists bending: the load l adds K_l = integral of sigma_l : grad(phi)^T
grad(phi) to its stiffness. The same matrix says how far the load moves when the body bends,
because to second order a material point is displaced by::

    u = sum_k phi_k q_k + 1/2 sum_kl psi_kl q_k q_l,    load l . psi_kl = -K_l[k, l]

(foreshortening). Loads of unit acceleration of a body with density rho thereby give the integrals
of rho psi and rho X psi, loads by the inertia of its shapes those of rho phi psi, loads on an
interface the displacements psi of its marker. Body forces of the moving frame, gravity, joints and
springs then stiffen the body by their virtual work on psi, whatever they are, and energy and
momentum stay exactly balanced.

Names of the loads: "omega_x^2" and "omega_x omega_y" for centrifugal force, "domega_x" for angular
acceleration, "a_x" for acceleration of the frame, "ddq_1" for that of the first elastic coordinate,
each per unit of the quantity and as the force -rho times acceleration it stands for; "tip f_x" and
"tip m_x" for force and moment on the interface "tip". A load left out has no geometric stiffness.

Source:
    Wallrapp and Schwertassek, Representation of geometric stiffening in multibody system
    simulation, Int. J. Numer. Meth. Engng. 32 (1991) 1833.
"""

from dataclasses import dataclass, replace

import numpy as np

from rom.arguments import matrix, symmetric
from rom.body.records import BodyData, Marker, motion_of
from rom.body.recovery import AXIS_NAMES, CENTRIFUGAL_LOADS, PRODUCTS
from rom.body.reference import (
    moved_integrals,
    moved_marker,
    reference_motion,
    second_moment,
    turns_of,
)
from rom.errors import ConfigError
from rom.model import Array
from rom.names import check_known
from rom.rotation import crossed, skew_tensor

ROUND_OFF = 1e-11  # of the largest displacement of second order
ANGULAR_LOADS = tuple(f"domega_{axis}" for axis in AXIS_NAMES)
LINEAR_LOADS = tuple(f"a_{axis}" for axis in AXIS_NAMES)
ELASTIC_LOAD = "ddq_"  # before the number of the coordinate


def elastic_loads(r: int) -> tuple[str, ...]:
    """Names of the accelerations of r elastic coordinates."""
    return tuple(f"{ELASTIC_LOAD}{k + 1}" for k in range(r))


def interface_loads(name: str) -> tuple[str, ...]:
    """Names of the six unit loads of an interface: force, then moment."""
    return tuple(f"{name} {kind}_{axis}" for kind in "fm" for axis in AXIS_NAMES)


def known_loads(body: BodyData) -> tuple[str, ...]:
    """All loads a body can have a geometric stiffness for."""
    interfaces = (load for name in body.markers for load in interface_loads(name))
    elastic = elastic_loads(body.n_modes)
    return (*CENTRIFUGAL_LOADS, *ANGULAR_LOADS, *LINEAR_LOADS, *interfaces, *elastic)


@dataclass(frozen=True, slots=True)
class SecondOrder:
    """Displacements psi_kl of second order, as far as loads see them."""

    S: Array  # (3, r, r) integral of rho psi_kl [kg m]
    Ibar: Array  # (3, 3, r, r) entry [a, b, k, l] is the integral of rho X_a psi_kl,b [kg m^2]
    N: Array  # (r, r, r) entry [m, k, l] is the integral of rho phi_m . psi_kl
    # {interface: (6, r, r) translation and rotation vector of its marker}
    markers: dict[str, Array]

    @classmethod
    def of(cls, body: BodyData) -> "SecondOrder":
        """Read from the matrices of a body, of the right shape and symmetric."""
        _check(body)
        r = body.n_modes
        K = {load: np.asarray(body.K_geo.get(load, np.zeros((r, r)))) for load in known_loads(body)}
        squares = np.array([K[load] for load in CENTRIFUGAL_LOADS[:3]])
        symmetric = np.zeros((3, 3, r, r))
        for (i, j), load in zip(PRODUCTS, CENTRIFUGAL_LOADS, strict=True):
            # omega_x^2 pulls along y and z, so that K = -(Ibar_yy + Ibar_zz)
            half = K[load] - 0.5 * squares.sum(axis=0) if i == j else 0.5 * K[load]
            symmetric[i, j] = symmetric[j, i] = half
        loads = LINEAR_LOADS, ANGULAR_LOADS, elastic_loads(r), *map(interface_loads, body.markers)
        S, turns, N, *six = (np.array([K[load] for load in some]) for some in loads)
        turning = 0.5 * np.einsum("abc,ckl->bakl", skew_tensor(), turns)
        markers = {m: -of for m, of in zip(body.markers, six, strict=True)}
        return cls(S, symmetric + turning, N.reshape(r, r, r), markers)

    def without_round_off(self, mass: float, size: float) -> "SecondOrder":
        """Zeros where a frame leaves nothing: on its own support, or of the mean motion."""
        scale = np.r_[np.ones(3), np.full(3, size)][:, None, None]
        parts = [self.S / mass, self.Ibar / (mass * size)]
        parts += [motion * scale for motion in self.markers.values()]
        limit = ROUND_OFF * max(np.abs(part).max(initial=0.0) for part in parts)
        S = np.where(np.abs(self.S).max(initial=0.0) > limit * mass, self.S, 0.0)
        turning = 0.5 * (self.Ibar - self.Ibar.swapaxes(0, 1))
        keep = np.abs(turning).max(initial=0.0) > limit * mass * size
        markers = {
            name: np.where(np.abs(motion * scale).max(initial=0.0) > limit, motion, 0.0)
            for name, motion in self.markers.items()
        }
        return replace(self, S=S, Ibar=self.Ibar if keep else self.Ibar - turning, markers=markers)

    def matrices(self) -> dict[str, Array]:
        """Geometric stiffness per unit load; loads without any are left out."""
        X, K = self.Ibar, dict(zip(LINEAR_LOADS, self.S, strict=True))
        K |= dict(zip(elastic_loads(len(self.N)), self.N, strict=True))
        for (i, j), load in zip(PRODUCTS, CENTRIFUGAL_LOADS, strict=True):
            K[load] = X[i, i] - np.einsum("aakl->kl", X) if i == j else X[i, j] + X[j, i]
        K |= dict(zip(ANGULAR_LOADS, crossed(X), strict=True))
        for name, motion in self.markers.items():
            K |= dict(zip(interface_loads(name), -motion, strict=True))
        return {load: 0.5 * (A + A.T) for load, A in K.items() if np.any(A)}


def _check(body: BodyData) -> None:
    known, r = known_loads(body), body.n_modes
    for load, A in body.K_geo.items():
        text = f"body {body.name!r} has a geometric stiffness for the unknown load {load!r}; use"
        check_known(load, known, text)
        name = f"the geometric stiffness {load!r} of body {body.name!r}"
        symmetric(name, matrix(name, np.asarray(A), (r, r)), 1e-9, error=ConfigError)


def moved_stiffening(old: BodyData, new: BodyData, X: Array, reference: object) -> dict[str, Array]:
    """Geometric stiffness seen from another frame, without the rigid motion X (6, r) of its shapes.

    Rotations compose; what the reference condition sees of the second order is rigid too.
    """
    if not old.K_geo:
        return {}
    psi, t, W, P = SecondOrder.of(old), X[:3], turns_of(X), second_moment(old)
    WW = _symmetrised(np.einsum("abk,bcl->ackl", W, W))
    S = psi.S - _symmetrised(2 * np.einsum("abk,bl->akl", W, new.S))
    S -= np.einsum("abkl,b->akl", WW, old.first_moment)
    Ibar = psi.Ibar - _symmetrised(2 * np.einsum("bck,acl->abkl", W, new.Ibar_kl))
    Ibar -= np.einsum("ac,bckl->abkl", P, WW)
    N = psi.N - np.einsum("am,akl->mkl", t, psi.S) - np.einsum("bam,abkl->mkl", W, psi.Ibar)
    N -= _symmetrised(2 * np.einsum("abk,abml->mkl", W, new.S_kl))
    N -= np.einsum("ackl,cam->mkl", WW, new.Ibar_kl)
    markers = {m: _turned(psi.markers[m], old.markers[m], new.markers[m], W) for m in old.markers}
    found = _without_rigid(new, SecondOrder(S, Ibar, N, markers), reference)
    return found.without_round_off(old.mass, old.size).matrices()


def _turned(motion: Array, old: Marker, new: Marker, W: Array) -> Array:
    """Second-order motion of a marker seen from a frame that turns by W q."""
    shift = _symmetrised(2 * np.einsum("abk,bl->akl", W, new.translation))
    WW = _symmetrised(np.einsum("abk,bcl->ackl", W, W))
    shift += np.einsum("abkl,b->akl", WW, old.point)
    turn = _symmetrised(np.einsum("abk,bl->akl", W, old.rotation))  # exp(-w) exp(theta)
    return motion - np.concatenate([shift, turn])


def recombined_stiffening(K_geo: dict[str, Array], V: Array) -> dict[str, Array]:
    """Geometric stiffness for other elastic coordinates, q = V q_new."""
    found = {load: V.T @ A @ V for load, A in K_geo.items()}
    old, new = elastic_loads(len(V)), elastic_loads(V.shape[1])
    if given := [k for k, load in enumerate(old) if load in found]:
        N = np.einsum("mn,mkl->nkl", V[given], [found.pop(old[k]) for k in given])
        found |= dict(zip(new, N, strict=True))
    return {load: 0.5 * (A + A.T) for load, A in found.items()}


def _without_rigid(body: BodyData, psi: SecondOrder, reference: object) -> SecondOrder:
    """Every pair k, l counts as one shape of a body, whose frame obeys the reference condition."""
    r = body.n_modes
    flat, none = {m: motion.reshape(6, -1) for m, motion in psi.markers.items()}, (0, 6 + r * r)
    markers = {
        m: replace(old, translation=flat[m][:3], rotation=flat[m][3:], hold=np.zeros(none))
        for m, old in body.markers.items()
    }
    S, Ibar = psi.S.reshape(3, -1), psi.Ibar.reshape(3, 3, -1)
    K = np.broadcast_to(0.0, (r * r, r * r))
    pairs = replace(body, S=S, Ibar_kl=Ibar, K=K, markers=markers)
    X = reference_motion(pairs, reference)
    S, Ibar = moved_integrals(pairs, X)
    N = psi.N.reshape(r, -1) - body.S.T @ X[:3]
    N = N - np.einsum("bap,abm->mp", turns_of(X), body.Ibar_kl)
    moved = [moved_marker(marker, X) for marker in pairs.markers.values()]
    motions = {m.name: motion_of(m).reshape(6, r, r) for m in moved}
    return SecondOrder(S.reshape(3, r, r), Ibar.reshape(3, 3, r, r), N.reshape(r, r, r), motions)


def _symmetrised(A: Array) -> Array:
    """Mean of an array and itself with the last two axes exchanged."""
    return 0.5 * (A + np.swapaxes(A, -1, -2))
