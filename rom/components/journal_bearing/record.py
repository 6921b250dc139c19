"""What the oil film of a journal bearing was like along a motion."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rom.components.journal_bearing.films.cells import N_MOTIONS
from rom.components.journal_bearing.films.journal_bearings import OilFilm
from rom.components.journal_bearing.films.journals import (
    LARGEST,
    MOTION,
    POWER,
    SIDE_FLOW,
    TEMPERATURE,
    THINNEST,
)
from rom.components.journal_bearing.films.oil import Oil
from rom.errors import ConfigError
from rom.model import Array
from rom.names import offered


@dataclass(frozen=True)
class BearingRecord:
    """One journal bearing over time.

    Attributes:
        t: (n_t,) times [s].
        motion: (n_t, 4) of the journal in the bush: ex, ey [m], and tilts about X, Y [rad].
        thinnest: (n_t,) smallest film [m].
        pressure: (n_t,) largest pressure [Pa].
        temperature: (n_t,) of the film [degrees Celsius]; NaN where its viscosity stays.
        power: (n_t,) that turns into heat [W].
        side_flow: (n_t,) oil that leaves at both ends [m^3/s].
        bore: (nt, nz, m) functions in the cells by which an elastic bush opens its film, and
            (n_t, m) how far [m]; None of a rigid one.
    """

    t: Array
    motion: Array
    thinnest: Array
    pressure: Array
    temperature: Array
    power: Array
    side_flow: Array
    bore: tuple[Array, Array] | None = None

    @property
    def opening(self) -> Array | None:
        """(n_t, nt, nz) by which an elastic bush opens the film, beyond its mean motion [m]."""
        return None if self.bore is None else np.einsum("ijm,tm->tij", *self.bore)


def journal_bearing(self: Any, name: str) -> BearingRecord:
    """Film, pressure, temperature, losses and flow of one journal bearing over time.

    Raises:
        ConfigError: for a name that no journal bearing has.
    """
    films = self.mechanism.journal_bearings
    if name not in films:
        raise ConfigError(f"no journal bearing {name!r}; there are {offered(films, name)}.")
    packed, element = self.packed, films[name]
    first = len(packed.places.coordinates) + packed.places.memory(name, np.zeros(0))
    found = self.base[:, first:]
    temperature = found[:, TEMPERATURE] if isinstance(element.liquid, Oil) else np.nan * self.t
    return BearingRecord(
        self.t,
        found[:, MOTION : MOTION + N_MOTIONS],
        found[:, THINNEST],
        found[:, LARGEST],
        temperature,
        found[:, POWER],
        found[:, SIDE_FLOW],
        _bore(self, element),
    )


def _bore(solution: Any, element: OilFilm) -> tuple[Array, Array] | None:
    functions, amplitudes = element.bore
    if not functions.size:
        return None
    moved = solution.elastic(element.j.body) @ amplitudes.T
    return functions.reshape(*element.bearing.cells, -1), moved
