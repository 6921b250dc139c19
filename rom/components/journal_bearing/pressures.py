"""Pressure in the oil of journal bearings, cell by cell, during a motion."""

from typing import Any

import numpy as np

from rom.arguments import typed
from rom.components.journal_bearing.films.cells import CLEARANCE, RADIUS
from rom.components.journal_bearing.films.journal_bearings import JOURNAL_BEARINGS_FAMILY
from rom.errors import ConfigError
from rom.mbs.results.interface_loads import at_instants
from rom.mbs.results.solution import Solution
from rom.model import Array
from rom.names import offered


@typed
def film_pressures(solution: Solution, name: str) -> Array:
    """The pressure in a film at each instant; of an equilibrium after `rom.mbs.snapshot`.

    Args:
        solution: the motion.
        name: of the journal bearing.

    Returns:
        (n_t, nt, nz) in nt columns around the bush, the first one in the direction from which
        angles count, and nz cells along its axis; of an aligned film half the width [Pa].

    Raises:
        ConfigError: if there is no such bearing, or its film is read from a table.
    """
    names = solution.packed.element_names.get(JOURNAL_BEARINGS_FAMILY, ())
    if name not in names:
        raise ConfigError(f"no journal bearing {name!r}; there are {offered(names, name)}.")
    k, table = names.index(name), solution.packed.elements[JOURNAL_BEARINGS_FAMILY]
    if table.number[k] >= 0:
        raise ConfigError(
            f"the film of {name!r} is read from a table, which has no pressure in cells.",
            hint="Leave out tabulated=True.",
        )
    return np.array([_of_table(table, k) for _ in at_instants(solution)])


def _of_table(table: Any, k: int) -> Array:
    """(nt, nz) what the last residual found [Pa]."""
    films, (nt, nz) = table.films, table.films.shape[k]
    unit = table.viscosity[k] * (films.size[k, RADIUS] / films.size[k, CLEARANCE]) ** 2
    pressure: Array = unit * films.P[k, : nt * nz].reshape(nt, nz)
    return pressure
