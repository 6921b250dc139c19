"""What shows that a reduced sector, or a wheel made of it, stands for the full sector."""

from dataclasses import replace
from itertools import chain
from typing import Any

import numpy as np

from rom.components.wheels.modes import cyclic_modes, wheel_modes
from rom.components.wheels.sector import CyclicSector, each_diameter
from rom.model import Array, Report, Row
from rom.rows import FREQUENCY_RTOL, N_COMPARED, frequency_rows

N_FAMILIES = 2  # modes per number of nodal diameters, whose union is compared with a wheel
STIFFER_BLADES = 0.05  # of all blades: the wheel stays cyclic, so that its truth is one sector


def sector_certificate(small: CyclicSector, full: CyclicSector) -> Report:
    """Frequencies of a reduced sector against the full one, for a few numbers of diameters."""
    diameters = list(small.diameters)
    chosen = sorted({0, 1, len(diameters) // 2, diameters[-1]} & set(diameters))

    def rows(d: int) -> list[Row]:
        n = min(N_COMPARED, small.harmonic(d).shape[1])
        reduced, exact = (cyclic_modes(sector, d, n).frequencies for sector in (small, full))
        return _rows(f"{d} nodal diameters", reduced, exact)

    found = each_diameter(full, rows, chosen)
    return Report("certificate of the sector", tuple(chain.from_iterable(found)))


def wheel_certificate(frequencies: Array, full: CyclicSector) -> Report:
    """Frequencies [Hz] of a wheel of equal blades, ascending, against the full sector."""
    return Report("certificate of the wheel", tuple(_of_wheel("equal blades", frequencies, full)))


def mistuned_certificate(wheel: Any) -> Report:
    """Frequencies of a wheel whose blades are all a little stiffer, or softer, against its sector.

    Args:
        wheel: the `MistunedWheel`.
    """
    rows: list[Row] = []
    for change in (STIFFER_BLADES, -STIFFER_BLADES):
        exact = replace(wheel.sector, K=wheel.sector.K + change * wheel.blade_stiffness)
        found = wheel.modes(np.full(wheel.sector.n_sectors, change)).frequencies
        rows += _of_wheel(f"all blades {100 * change:+g} %", found, exact, wheel.speed)
    return Report("certificate of the mistuned wheel", tuple(rows))


def _of_wheel(what: str, found: Array, sector: CyclicSector, speed: float = 0.0) -> list[Row]:
    """The lowest frequencies of a wheel against the union of those of its sector."""
    exact, complete = [], np.inf
    for modes in wheel_modes(sector, N_FAMILIES, speed=speed):
        exact += [*modes.frequencies] * modes.multiplicity
        complete = min(complete, modes.frequencies[-1])  # above it some diameters miss theirs
    union = np.sort([f for f in exact if f <= complete * (1 + FREQUENCY_RTOL)])
    return _rows(what, found[: union.size], union)


def _rows(what: str, reduced: Array, exact: Array) -> list[Row]:
    """Elastic frequencies compared; rigid motions are zero in both."""
    elastic = exact > 0
    table = {"reduced": reduced[elastic].tolist(), "full": exact[elastic].tolist()}
    return frequency_rows(what, table) if elastic.any() else []
