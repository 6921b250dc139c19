"""Families updated by what is left of their equations of motion at the sensors.

The model is condensed statically to the sensors, which is wrong by inertia between them however
good the data are; the verdict, of responses of the model that is not condensed, says how much.
"""

import numpy as np
from scipy.linalg import null_space, qr

from rom.arguments import whole
from rom.components.updating.family_model import FamilyModel
from rom.components.updating.methods import (
    Update,
    blocks,
    folded,
    solved,
    through_modes,
    update_by_input,
    weighted,
)
from rom.components.updating.models import AtSensors, Measurement
from rom.components.updating.normal_equations import Data, white
from rom.errors import ConfigError
from rom.model import Array, Index, Mask
from rom.names import named

SENSOR_RTOL = 1e-8  # singular value of sensors that follow others, over the largest
LAST_STEP = 1e-3  # in standard deviations
COLLOCATED_RTOL = 1e-8  # of the row of a sensor that measures what an input drives


def in_sensors(model: FamilyModel, x: Array, free: Mask) -> FamilyModel:
    """A family in coordinates of which the first are its sensors, the others no sensor sees.

    Args:
        model: with its sensors.
        x: (n_p,) logarithms of all factors, of which those that are not sought stay.
        free: (n_p,) which are sought.

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
    basis = np.hstack([np.linalg.pinv(S), null_space(S)])
    return model.reduced(basis, free, x, np.eye(len(S), S.shape[1]))


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
    lines = _whole_lines(data)
    inputs, signs = _collocated(model)
    m = int(np.count_nonzero(model.elastic(x) <= data.omega[lines[-1]] ** 2))
    n_s, needed = len(model.seen), m + model.n_rigid
    if n_s < needed:
        raise ConfigError(
            f"{n_s} sensors for {needed} modes up to the highest line, rigid ones included: "
            "equations at the sensors need one for each.",
            hint="Leave out the highest lines, or update by responses.",
        )
    H = np.exp(data.logarithm[lines]) * signs
    test = Measurement(data.omega[lines], H, inputs, data.weight[lines])
    inside = in_sensors(model, x, free)
    small = AtSensors(inside)
    rank = whole("rank", min(n_s, needed) if rank is None else rank, 1, n_s, reason="sensors")
    start = x[free], np.full(m, damping)
    return update_by_input(small, test, *start, rank=rank, limits=inside.ends, prior=prior[free])


def by_response_functions(
    model: FamilyModel,
    data: Data,
    x: Array,
    free: Mask,
    ratios: Array,
    *,
    prior: Array,
    prior_damping: tuple[float, float],
) -> Update:
    """Logarithms of factors, and damping ratios, by H - H_test = H dZ H_test, linear in each step.

    What is not measured of H_test follows its sensors as the model at the last step says, so that
    nothing is condensed; inputs need no sensors. Noise of H_test is in these derivatives too: they
    lead, and those of the model, which have none, say where the end is. All is divided by H_test,
    as the mean of H / H_test is one where errors are circular.

    Args:
        model: see `by_equations`.
        data: see `by_equations`.
        x: see `by_equations`.
        free: see `by_equations`.
        ratios: (m,) of the lowest elastic modes, the last one of all others too, to start from [1].
        prior: see `by_equations`.
        prior_damping: ratio before the test and standard deviation of its logarithm [1].

    Raises:
        ConfigError: if sensors follow from others, or no line counts for all of them.

    Source:
        Lin and Ewins, Analytical model improvement using frequency response functions, Mech. Syst.
        Signal Process. 8 (1994) 437; instruments: Soderstrom and Stoica, System identification
        (1989), chapter 8.
    """
    used = data.lines(_whole_lines(data))
    inside, n_s = in_sensors(model, x, free), len(model.seen)
    F = inside.driven.T

    def triangle(x: Array, ratios: Array) -> Array:
        here = inside.at(x)
        modes = model.modal(here, ratios)
        change = through_modes(here, modes, ratios.size, shared=True)
        MPhi = here.M @ modes.Phi
        driven, n = modes.Phi.T @ F, x.size + ratios.size
        C, R = (MPhi * modes.d) @ MPhi.T, np.zeros((0, 2 * n + 1))
        for block in blocks(used.omega.size):
            some = used.lines(block)
            w, test, g = some.omega, np.exp(some.logarithm), modes.g(some.omega)
            Z = here.K - w[:, None, None] ** 2 * here.M + 1j * w[:, None, None] * C
            unseen = np.linalg.solve(Z[:, n_s:, n_s:], F[n_s:] - Z[:, n_s:, :n_s] @ test)
            left = modes.Phi[:n_s] * g[:, None, :]
            H = left @ driven
            instruments = change(left, g[:, :, None] * driven, w) / H[..., None]
            J = change(left, MPhi.T @ np.concatenate([test, unseen], axis=1), w) / test[..., None]
            columns = np.concatenate([instruments, J, (1 - H / test)[..., None]], axis=-1)
            R = folded(R, weighted(1.0, white(columns, some.weight, some.common)))
        return R

    options = 2 * used.logarithm.size, inside.ends, prior[free], prior_damping
    return solved(triangle, (x[free], ratios), *options, enough=LAST_STEP)


def _whole_lines(data: Data) -> Index:
    """Numbers of the lines of which every value counts."""
    lines = np.flatnonzero((data.weight > 0).all(axis=(1, 2)))
    if not lines.size:
        raise ConfigError(
            "no line counts for all sensors and inputs.",
            hint="Leave out the sensor of low coherence, or update by responses.",
        )
    return lines


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
