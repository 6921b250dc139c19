"""Modes of a bladed disk by one reduced sector, one full sector, and the whole wheel."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from benchmarks.models import TITANIUM
from benchmarks.timing import Row, timed
from rom.components.wheels.modes import wheel_modes
from rom.components.wheels.reduced import reduce_sector
from rom.components.wheels.sector import CyclicSector
from rom.eigen.scipy import SciPyOperators
from rom.model import Array
from rom.process.memory import peak_bytes
from rom.reduction.interfaces.polynomial import Polynomial

WHEEL_SIZES = {
    "width": 0.016, "chord": 0.015, "chord_tip": 0.012, "t": 0.003, "t_tip": 0.002,
    "stagger": 20, "lc": 0.010, "lc_blade": 0.0065,
}  # fmt: skip


def measured(
    geometry: Path, families: int, parameters: dict[str, float] | None = None
) -> Iterator[Row]:
    """Case, quantity, value, unit and aim.

    Args:
        geometry: of a sector, gmsh, held at its bore.
        families: modes for each number of nodal diameters.
        parameters: of the geometry.
    """
    from rom.fe import model as read_model

    model = read_model(geometry, material=TITANIUM, parameters=parameters or WHEEL_SIZES)
    sector = CyclicSector.from_model(model, fixed=("bore",))
    case, N = f"{sector.n_wheel} dofs, {sector.n_sectors} sectors", sector.n_sectors
    yield case, "mesh and matrices: peak memory", _peak(), "GiB", ""
    f, taken = {}, {}
    ways: dict[str, Callable[[], Array]] = {
        "reduced sector": lambda: _waves(
            reduce_sector(sector, n_modes=60, functions=Polynomial(7)), families
        ),
        "sector": lambda: _waves(sector, families),
        "wheel": lambda: _whole(sector, families * N),
    }
    for name, compute in ways.items():
        taken[name], f[name] = timed(compute)
        yield case, f"{name}: processor time", taken[name], "s", ""
        yield case, f"{name}: peak memory so far", _peak(), "GiB", ""
    for name in ("reduced sector", "sector"):
        yield case, f"{name}: times as fast", taken["wheel"] / taken[name], "", ""
    what = f"{families} families at {len(sector.diameters)} nodal diameters"
    error = float((f["reduced sector"] / f["sector"] - 1).max())
    yield case, f"reduced sector above sector: {what}", error, "", "below 0.001"
    every = _below_the_next(sector, f["sector"])
    error = float(np.abs(every / f["wheel"][: every.size] - 1).max())
    yield case, f"sector against wheel: {every.size} frequencies", error, "", "below 1e-08"


def _waves(sector: CyclicSector, families: int) -> Array:
    """(diameters, families) circular frequencies [rad/s]."""
    return np.array([modes.omega for modes in wheel_modes(sector, families)])


def _whole(sector: CyclicSector, m: int) -> Array:
    """(m,) lowest circular frequencies of the whole wheel [rad/s]."""
    ops = SciPyOperators(*sector.wheel())
    return ops.modes(np.zeros(0, dtype=np.int64), m)[0]


def _below_the_next(sector: CyclicSector, f: Array) -> Array:
    """Ascending, as often as the wheel has them: all below the first of a family left out."""
    often = [1 if sector.standing(n) else 2 for n in sector.diameters]
    every = np.repeat(f, often, axis=0).ravel()
    return np.sort(every[every < f[:, -1].min()])


def _peak() -> float:
    """Largest memory of the process so far [GiB]."""
    return peak_bytes() / 1024**3
