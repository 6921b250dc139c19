"""What the oil film of a journal bearing was like along a motion, and its pressure in cells."""

from dataclasses import dataclass

import numpy as np

from rom.arguments import typed
from rom.components.journal_bearing.films import journals as col
from rom.components.journal_bearing.films.cells import CLEARANCE, N_MOTIONS, RADIUS
from rom.components.journal_bearing.films.journal_bearings import JOURNAL_BEARINGS_FAMILY
from rom.components.journal_bearing.films.oil import Oil
from rom.errors import ConfigError
from rom.mbs.results.recomputed import at_instants
from rom.mbs.results.solution import Solution
from rom.model import Array
from rom.names import check_known


@typed
def film_pressures(solution: Solution, name: str) -> Array:
    """(n_t, nt, nz) pressure in a film [Pa]; of an equilibrium after `rom.mbs.snapshot`.

    Of nt columns around the bush the first one is in the direction from which angles count; nz
    cells are along its axis, of an aligned film half the width.

    Raises:
        ConfigError: if there is no such bearing, or its film is read from a table.
    """
    names = solution.packed.element_names.get(JOURNAL_BEARINGS_FAMILY, ())
    check_known(name, names, f"no journal bearing {name!r}; there are")
    k, table = names.index(name), solution.packed.elements[JOURNAL_BEARINGS_FAMILY]
    if table.number[k] >= 0:
        text = f"the film of {name!r} is read from a table, which has no pressure in cells"
        raise ConfigError(f"{text}; leave out tabulated=True.")
    films, (nt, nz) = table.films, table.films.shape[k]
    ratio2 = (films.size[k, RADIUS] / films.size[k, CLEARANCE]) ** 2
    pressure = [table.viscosity[k] * ratio2 * films.P[k] for _ in at_instants(solution)]
    return np.array(pressure)[:, : nt * nz].reshape(-1, nt, nz)


@dataclass(frozen=True)
class BearingRecord:
    """One journal bearing over time."""

    t: Array  # (n_t,) times [s]
    motion: Array  # (n_t, 4) of the journal in the bush: ex, ey [m], and tilts about X, Y [rad]
    thinnest: Array  # (n_t,) smallest film [m]
    pressure: Array  # (n_t,) largest pressure [Pa]
    temperature: Array  # (n_t,) of the film [degrees Celsius]; NaN where its viscosity stays
    power: Array  # (n_t,) that turns into heat [W]
    side_flow: Array  # (n_t,) oil that leaves at both ends [m^3/s]
    # (nt, nz, m) functions in the cells by which an elastic bush opens its film, and (n_t, m) how
    # far [m]; None of a rigid one
    bore: tuple[Array, Array] | None = None

    @property
    def opening(self) -> Array | None:
        """(n_t, nt, nz) by which an elastic bush opens the film, beyond its mean motion [m]."""
        return None if self.bore is None else np.einsum("ijm,tm->tij", *self.bore)


def journal_bearing(self: Solution, name: str) -> BearingRecord:
    """Film, pressure, temperature, losses and flow of one journal bearing over time.

    Raises:
        ConfigError: for a name that no journal bearing has.
    """
    films = self.mechanism.journal_bearings
    check_known(name, films, f"no journal bearing {name!r}; there are")
    packed, element = self.packed, films[name]
    first = len(packed.places.coordinates) + packed.places.memory(name, np.zeros(0))
    found = self.base[:, first:]
    temperature = found[:, col.TEMPERATURE] if isinstance(element.liquid, Oil) else np.nan * self.t
    motion = found[:, col.MOTION : col.MOTION + N_MOTIONS]
    thinnest, largest = found.T[[col.THINNEST, col.LARGEST]]
    power, flow = found.T[[col.POWER, col.SIDE_FLOW]]
    bore, (functions, amplitudes) = None, element.bore
    if functions.size:
        moved = self.elastic(element.j.body) @ amplitudes.T
        bore = functions.reshape(*element.bearing.cells, -1), moved
    return BearingRecord(self.t, motion, thinnest, largest, temperature, power, flow, bore)
