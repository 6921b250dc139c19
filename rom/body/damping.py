"""Structural damping: of the deformation, whatever the frame and without rigid motions."""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rom.arguments import NotNegative, one_each, typed
from rom.body.flexible import FlexibleBody
from rom.body.records import still_motions
from rom.body.reference import rigid_elastic, rigid_mass
from rom.eigen.supports import Fixed
from rom.eigen.verbs import modes_within
from rom.model import Array, Row
from rom.plausible import DAMPING_RATIO, check_damping_ratio, warn_outside


@typed
@dataclass(frozen=True, slots=True)
class Rayleigh:
    """D = alpha M + beta K, on the deformation: rigid motions are not damped.

    M is that of the deformation, without the momentum of the body: M_ee - M_er M_rr^-1 M_re, so
    that D does not depend on the frame. Modes of the free body have the damping ratios
    alpha / (2 omega) + beta omega / 2; supports change the part of alpha.

    Attributes:
        alpha: factor of the mass [1/s].
        beta: factor of the stiffness [s].
    """

    alpha: Annotated[float, NotNegative("1/s")] = 0.0
    beta: Annotated[float, NotNegative("s")] = 0.0

    def matrix(self, body: FlexibleBody) -> Array:
        """(r, r) damping [N s/m]."""
        omega, _ = _vibrations(body, ())
        if omega.size:  # high modes are often damped beyond one on purpose
            low = float(omega.min())
            ratio = 0.5 * (self.alpha / low + self.beta * low)
            of = f"the lowest mode of the free body {body.name!r}, at {low / (2 * np.pi):.4g} Hz,"
            warn_outside(DAMPING_RATIO, ratio, of)
        return self.alpha * _deformation_mass(body) + self.beta * body.K


@typed
@dataclass(frozen=True, slots=True)
class ModalDamping:
    """Damping ratios of the modes of the body in one support; rigid motions are not damped.

    D = B^-T diag(2 zeta omega) B^-1 with the mode shapes B, mass-normalised. It is the same in
    every frame, but a ratio belongs to a support: modes of the free body that have two per cent
    have 0.2 once the body is held by an end. Say in ``fixed`` how it is held where the ratios are
    known; the certificate has those of every support. Where several interfaces are held, static
    deflections of the others come after the modes, by their own stiffness and mass.

    Attributes:
        ratio: damping ratio zeta [1], a scalar or (r,) one per mode, lowest first; 0.02 is two per
            cent. Nothing vibrates from one on: a ratio beyond is refused as a mistake for per
            cent, and so is one of all modes doubted; one among others, by which residual shapes
            are stilled, is taken at its word.
        fixed: interfaces held where the ratios are meant, as in `FlexibleBody.frequencies`; without
            it they are those of the free body.

    Raises:
        ConfigError: for a ratio outside 0 to 1.

    Warns:
        RomWarning: for a ratio that no structure has.

    Example:
        >>> rom.ModalDamping(0.02, fixed=("root",)).ratio
        0.02
    """

    ratio: npt.ArrayLike
    fixed: Fixed = ()

    def __post_init__(self) -> None:
        ratios = list(dict.fromkeys(np.ravel(self.ratio).tolist()))
        for value in ratios:
            check_damping_ratio(value, stilled=len(ratios) > 1)

    def matrix(self, body: FlexibleBody) -> Array:
        """(r, r) damping [N s/m].

        Raises:
            ConfigError: if there is not one ratio per elastic coordinate, or for wrong directions.
            InterfaceError: if an interface is unknown.
            ModelError: if an interface of a basis of free-free modes alone is held.
        """
        zeta = np.asarray(self.ratio, dtype=float)
        if zeta.ndim > 1 or (zeta.ndim == 1 and zeta.size != body.n_modes):
            one_each("ratios of ModalDamping", zeta.shape, "elastic coordinates", (body.n_modes,))
        omega, B = _vibrations(body, self.fixed)
        if omega.size < body.n_modes:  # then the deformations that loads on held interfaces cause
            lam, W = modes_within(still_motions(B.T @ body.K), body.K, _deformation_mass(body))
            omega, B = np.concatenate([omega, np.sqrt(lam)]), np.hstack([B, W])
        shares = np.linalg.inv(B)
        return shares.T @ ((2 * zeta * omega)[:, None] * shares)


def _deformation_mass(body: FlexibleBody) -> Array:
    """(r, r) mass of the elastic coordinates without the momentum of the body."""
    coupling = rigid_elastic(body)
    return body.M - coupling.T @ np.linalg.solve(rigid_mass(body), coupling)


def _vibrations(body: FlexibleBody, fixed: Fixed) -> tuple[Array, Array]:
    """(k,) circular frequencies of the elastic modes in a support, and (r, k) their deformation."""
    omega, V = body.modes(fixed=fixed)
    return omega[omega > 0], V[6:, omega > 0]


def damping_rows(body: FlexibleBody, n: int) -> list[Row]:
    """The damping ratio of the n lowest elastic modes each, free and held by each interface."""
    if not body.D.any():
        return []
    held = body.markers if body.has_static_shapes else ()
    rows = []
    for support, fixed in {"free": (), **{f"{name} held": (name,) for name in held}}.items():
        omega, Q = _vibrations(body, fixed)
        ratios = np.einsum("ik,ij,jk->k", Q, body.D, Q) / (2 * omega)
        rows += [
            Row(f"{support}: damping ratio of mode {k}", float(ratio), "information", True)
            for k, ratio in enumerate(ratios[:n], 1)
        ]
    return rows


def damped(body: FlexibleBody, damping: Rayleigh | ModalDamping) -> FlexibleBody:
    """The body with this damping in place of what it had."""
    return replace(body, D=damping.matrix(body))
