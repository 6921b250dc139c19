"""Families updated by what is left of their equations of motion at the sensors.

The model is condensed statically to the sensors, which is wrong by inertia between them however
good the data are; the verdict, of responses of the model that is not condensed, says how much.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import null_space, qr

from rom.arguments import whole
from rom.errors import ConfigError
from rom.model import Array, Mask
from rom.names import named
from rom.updating.family_model import FamilyModel
from rom.updating.methods import Update, update_by_input
from rom.updating.models import AtSensors, Measurement, ParametricModel, modal
from rom.updating.normal_equations import Data

SENSOR_RTOL = 1e-8  # singular value of sensors that follow others, over the largest
COLLOCATED_RTOL = 1e-8  # of the row of a sensor that measures what an input drives


@dataclass(frozen=True, slots=True)
class InSensors:
    """A family in coordinates of which the first are its sensors; some parameters unknown.

    Attributes:
        model: with n_s sensors, none of which follows from others.
        x: (n_p,) logarithms of all factors; those that are sought are replaced.
        free: (n_p,) which are sought.
        basis: (n, n) coordinates of the family per sensor, and per motion that no sensor sees.
    """

    model: FamilyModel
    x: Array
    free: Mask
    basis: Array

    @staticmethod
    def of(model: FamilyModel, x: Array, free: Mask) -> "InSensors":
        """Coordinates from the rows of the sensors.

        Raises:
            ConfigError: if a sensor follows from others, or the family has too few coordinates.
        """
        S = model.seen
        if follow := sorted(_followers(S)):
            raise ConfigError(
                f"sensors {named(follow)} of {len(S)} follow from others in a family of "
                f"{S.shape[1]} coordinates: equations need independent ones.",
                hint="Leave them out, reduce with more modes, or update by responses.",
            )
        return InSensors(model, x, free, np.hstack([np.linalg.pinv(S), null_space(S)]))

    @property
    def sensors(self) -> Array:
        """(n_s, n) rows of the first coordinates."""
        return np.eye(len(self.model.seen), len(self.basis))

    def at(self, x: Array) -> ParametricModel:
        """The model at logarithms of the factors that are sought, with derivatives by them."""
        whole = self.x.copy()
        whole[self.free] = x
        here = self.model.at(whole)
        dK, dM = here.dK[self.free], here.dM[self.free]
        T = self.basis
        K, M, dK, dM = (T.T @ A @ T for A in (here.K, here.M, dK, dM))
        return ParametricModel(K, M, dK, dM, self.sensors, here.n_rigid)


def by_equations(
    model: FamilyModel,
    data: Data,
    x: Array,
    free: Mask,
    damping: float,
    *,
    prior: Array,
    rank: int | None,
) -> Update:
    """Logarithms of factors, and damping ratios of the modes up to the highest line.

    Lines with a value that does not count are left out.

    Args:
        model: the family with its sensors and inputs.
        data: what was measured.
        x: (n_p,) logarithms of the factors to start from.
        free: (n_p,) which are sought.
        damping: ratio to start from [1].
        prior: (n_p,) standard deviations of the logarithms about zero before the test [1].
        rank: of the basis that tests and models share; None for what the modes need.

    Raises:
        ConfigError: if an input has no sensor, sensors follow from others, or there are too few.
    """
    lines = np.flatnonzero((data.weight > 0).all(axis=(1, 2)))
    if not lines.size:
        raise ConfigError(
            "no line counts for all sensors and inputs.",
            hint="Leave out the sensor of low coherence, or update by responses.",
        )
    inputs, signs = _collocated(model)
    lam = modal(model.at(x), ()).lam
    m = int(np.count_nonzero(lam[model.n_rigid :] <= data.omega[lines[-1]] ** 2))
    n_s, needed = len(model.seen), m + model.n_rigid
    if n_s < needed:
        raise ConfigError(
            f"{n_s} sensors for {needed} modes up to the highest line, rigid ones included: "
            "equations at the sensors need one for each.",
            hint="Leave out the highest lines, or update by responses.",
        )
    H = np.exp(data.logarithm[lines]) * signs
    test = Measurement(data.omega[lines], H, inputs, data.weight[lines])
    limits = np.log(model.low[free]), np.log(model.high[free])
    small = AtSensors(InSensors.of(model, x, free))
    rank = whole("rank", min(n_s, needed) if rank is None else rank, 1, n_s, reason="sensors")
    start = x[free], np.full(m, damping)
    return update_by_input(small, test, *start, rank=rank, limits=limits, prior=prior[free])


def _followers(S: Array) -> list[int]:
    """Numbers of the rows (n_s, n) that follow from the others."""
    R, order = qr(S.T, mode="r", pivoting=True)
    size = np.abs(np.diag(R))
    rank = int(np.count_nonzero(size > SENSOR_RTOL * size[0]))
    return [int(k) for k in order[rank:]]


def _collocated(model: FamilyModel) -> tuple[tuple[int, ...], Array]:
    """Numbers of the sensors at which inputs act, and (n_e,) the signs of their directions."""
    found = []
    for k, row in enumerate(model.driven):
        signs = np.array([1.0, -1.0])[:, None]
        off = np.linalg.norm(model.seen[None] - signs[..., None] * row, axis=2)
        sign, sensor = np.unravel_index(off.argmin(), off.shape)
        if off.min() > COLLOCATED_RTOL * np.linalg.norm(row):
            raise ConfigError(
                f"input {k} has no sensor at its point and along its direction.",
                hint="Equations at the sensors need one there; update by responses without.",
            )
        found.append((int(sensor), signs[int(sign), 0]))
    return tuple(sensor for sensor, _ in found), np.array([sign for _, sign in found])
