"""Structural damping of the elastic coordinates."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from rom.arguments import typed
from rom.body.flexible import FlexibleBody
from rom.errors import ConfigError
from rom.model import Array
from rom.plausible import DAMPING_RATIO, check_damping_ratio, refuse_negative, warn_outside


@typed
@dataclass(frozen=True, slots=True)
class Rayleigh:
    """D = alpha M + beta K.

    Attributes:
        alpha: factor of the mass [1/s].
        beta: factor of the stiffness [s].

    Raises:
        ConfigError: for a factor that is negative or not finite.
    """

    alpha: float = 0.0
    beta: float = 0.0

    def __post_init__(self) -> None:
        for name in ("alpha", "beta"):
            refuse_negative(f"damping {name}", getattr(self, name))

    def matrix(self, body: FlexibleBody) -> Array:
        """(r, r) damping [N s/m]."""
        self._warn_of_strong(body)
        return self.alpha * body.M + self.beta * body.K

    def _warn_of_strong(self, body: FlexibleBody) -> None:
        """Of the lowest coordinate: high ones are often damped beyond one on purpose."""
        omega = body.omega[body.omega > 0]
        if omega.size:
            low = float(omega.min())
            ratio = 0.5 * (self.alpha / low + self.beta * low)
            of = f"the lowest coordinate of body {body.name!r}, at {low / (2 * np.pi):.4g} Hz,"
            warn_outside(DAMPING_RATIO, ratio, of)


@typed
@dataclass(frozen=True, slots=True)
class ModalDamping:
    """D = diag(2 zeta omega) in the elastic coordinates of the body.

    Attributes:
        ratio: damping ratio zeta [1], a scalar or (r,) one per elastic coordinate; 0.02 is two per
            cent. Nothing vibrates from one on: a ratio beyond is refused as a mistake for per
            cent, and one itself, by which residual shapes are stilled, is taken at its word.

    Raises:
        ConfigError: for a ratio outside 0 to 1.

    Warns:
        RomWarning: for a ratio that no structure has.

    Example:
        >>> rom.ModalDamping(0.02).ratio
        0.02
    """

    ratio: npt.ArrayLike

    def __post_init__(self) -> None:
        for value in dict.fromkeys(np.ravel(self.ratio).tolist()):
            check_damping_ratio(value)

    def matrix(self, body: FlexibleBody) -> Array:
        """(r, r) damping [N s/m].

        Raises:
            ConfigError: if there is not one ratio per elastic coordinate of the body.
        """
        zeta = np.asarray(self.ratio, dtype=float)
        if zeta.ndim > 1 or (zeta.ndim == 1 and zeta.size != body.n_modes):
            raise ConfigError(f"ModalDamping has {zeta.size} ratios; {body.n_modes} are needed.")
        return np.diag(2 * zeta * body.omega)


def damped(body: FlexibleBody, damping: Rayleigh | ModalDamping) -> FlexibleBody:
    """The body with this damping in place of what it had.

    Raises:
        ConfigError: for a wrong number of ratios.

    Warns:
        RomWarning: for factors that damp the lowest coordinate as no structure is damped.
    """
    return replace(body, D=damping.matrix(body))
