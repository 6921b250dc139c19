"""Structural damping of the elastic coordinates."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from rom.body.flexible import FlexibleBody
from rom.errors import ConfigError
from rom.model import Array


@dataclass(frozen=True, slots=True)
class Rayleigh:
    """D = alpha M + beta K.

    Attributes:
        alpha: factor of the mass [1/s].
        beta: factor of the stiffness [s].
    """

    alpha: float = 0.0
    beta: float = 0.0

    def matrix(self, body: FlexibleBody) -> Array:
        """(r, r) damping [N s/m]."""
        _refuse_negative("alpha", self.alpha)
        _refuse_negative("beta", self.beta)
        return self.alpha * body.M + self.beta * body.K


@dataclass(frozen=True, slots=True)
class ModalDamping:
    """D = diag(2 zeta omega) in the elastic coordinates of the body.

    Attributes:
        ratio: damping ratio zeta, one number or one per elastic coordinate.
    """

    ratio: npt.ArrayLike

    def matrix(self, body: FlexibleBody) -> Array:
        """(r, r) damping [N s/m]."""
        zeta = np.asarray(self.ratio, dtype=float)
        if zeta.ndim > 1 or (zeta.ndim == 1 and zeta.size != body.n_modes):
            raise ConfigError(
                f"ModalDamping has {zeta.size} ratios for {body.n_modes} elastic coordinates."
            )
        _refuse_negative("ratio", float(zeta.min(initial=0.0)))
        return np.diag(2 * zeta * body.omega)


def damped(body: FlexibleBody, damping: Rayleigh | ModalDamping) -> FlexibleBody:
    """The body with this damping in place of what it had.

    Raises:
        ConfigError: for a negative factor or a wrong number of ratios.
    """
    return replace(body, D=damping.matrix(body))


def _refuse_negative(name: str, value: float) -> None:
    if not value >= 0.0:
        raise ConfigError(f"damping {name} = {value:g} is negative: the body would gain energy.")
