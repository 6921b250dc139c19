"""The temperature that a film makes for itself.

Source:
    The effective temperature as in Raimondi and Boyd, ASLE Trans. 1 (1958) 159.
"""

from dataclasses import dataclass, replace

import numpy.typing as npt

from rom.components.journal_bearing.films.bearing import JournalBearing
from rom.components.journal_bearing.films.oil import Oil
from rom.components.journal_bearing.oil_film import Film
from rom.components.journal_bearing.statics import equilibrium
from rom.errors import ModelError, SolverError


@dataclass(frozen=True, slots=True)
class Warm:
    """A film at the temperature it makes.

    Attributes:
        film: at rest under the load.
        temperature: that its viscosity belongs to [degrees Celsius].
        rise: of the oil from inlet to outlet [K].
        power: that is lost [W].
    """

    film: Film
    temperature: float
    rise: float
    power: float


def warm_equilibrium(
    bearing: JournalBearing,
    load: npt.ArrayLike,
    oil: Oil,
    *,
    speed: float,
    inlet: float,
    carried: float = 0.9,
    felt: float = 0.5,
) -> Warm:
    """The loaded film, its viscosity that of oil warmed by the film itself.

    Power lost warms the oil that leaves at the ends; fixed point, half of each change.

    Args:
        bearing: the bearing.
        load: (2,) on the journal [N].
        oil: in it.
        speed: [rad/s].
        inlet: temperature of the oil that comes in [degrees Celsius].
        carried: share of the heat that leaves with the oil [1].
        felt: share of the rise that the effective viscosity feels [1]; 0.5 is the mean of inlet and
            outlet, as Raimondi and Boyd take it.

    Raises:
        SolverError: if no film carries the load, or the temperature does not settle.
        ModelError: without a load.
    """
    T, start = inlet, None
    for _ in range(60):
        mu = float(oil.viscosity(T))
        film = equilibrium(bearing, load, speed=speed, viscosity=mu, start=start)
        power, start = film.dissipated, film.motion[:2]
        rise = carried * power / (oil.density * oil.heat * film.side_flow)
        change = inlet + felt * rise - T
        if abs(change) < 1e-6:
            return Warm(film, T, rise, power)
        T += 0.5 * change
    raise SolverError(
        f"the temperature of the film does not settle; it is {T:.1f} degrees Celsius and still "
        f"changes by {change:.2g} K.", hint="Check the flow of oil: little flow, great heat.",
    )  # fmt: skip


def warm_bearing(
    bearing: JournalBearing,
    *,
    bush: float,
    shaft: float,
    expansion: tuple[float, float] = (11.7e-6, 11.7e-6),
    free: float = 1.0,
) -> JournalBearing:
    """The bearing with the clearance it has when bush and shaft are warm.

    Args:
        bearing: cold.
        bush: how much warmer it is [K].
        shaft: how much warmer it is [K].
        expansion: coefficients of bush and shaft [1/K].
        free: share of its expansion that the fit lets the bush have [1].

    Raises:
        ModelError: if no clearance is left.
    """
    growth = bearing.radius * (expansion[0] * bush * free - expansion[1] * shaft)
    if bearing.clearance + growth <= 0:
        raise ModelError(
            f"the shaft seizes: {shaft} K on the shaft and {bush} K on the bush change the "
            f"clearance of {bearing.clearance * 1e6:.3g} micrometres by {growth * 1e6:.3g}.",
            hint="Warm the bush too, or fit with more clearance.",
        )
    return replace(bearing, clearance=bearing.clearance + growth)
