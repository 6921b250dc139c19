"""A change of temperature of a solid: what it is where."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from rom.arguments import finite, number, typed
from rom.errors import ConfigError
from rom.model import Array, FEModel
from rom.names import check_known

Temperature = float | Mapping[str, float] | npt.ArrayLike | Callable[[Array], Any]


@typed
@dataclass(frozen=True)
class Heat:
    """Free thermal expansion of a solid, alpha dT in all directions.

    Attributes:
        expansion: coefficient of linear expansion alpha [1/K], or {region: alpha}; regions left
            out do not expand.
        temperature: change of temperature since the solid was free of stress [K], negative where
            it cooled: one number, {region: number} with regions left out at zero, (n / 3,) numbers
            at the nodes of the model, or a function of points (k, 3) [m].

    Raises:
        ConfigError: if one of the two is missing.
    """

    expansion: float | Mapping[str, float] | None = None
    temperature: Temperature | None = None

    def __post_init__(self) -> None:
        if self.expansion is None:
            raise ConfigError(
                "a temperature is given without a coefficient of expansion.",
                hint="Steel has expansion=12e-6 per kelvin.",
            )
        if self.temperature is None:
            raise ConfigError(
                "a coefficient of expansion is given without a change of temperature.",
                hint="Give temperature=... in kelvin.",
            )

    def on(self, model: FEModel) -> tuple[dict[str, float], dict[str, float], Array]:
        """Expansion [1/K] and temperature [K] of each region; what nodes (n / 3,) add to this [K].

        Raises:
            ConfigError: if a region is unknown, numbers are not finite or do not fit the nodes.
        """
        names, cold = tuple(model.regions), np.zeros(len(model.points))
        alpha = _by_region("expansion", self.expansion, names)
        given = self.temperature
        if not callable(given) and (isinstance(given, Mapping) or np.ndim(given) == 0):
            return alpha, _by_region("temperature", given, names), cold
        values = given(model.points) if callable(given) else given
        values = finite("the temperature at the nodes", values, cold.shape)
        return alpha, dict.fromkeys(names, 0.0), values

    def largest_strain(self, model: FEModel) -> float:
        """Largest free expansion [1], of region and nodes together."""
        alpha, by_region, at_nodes = self.on(model)
        more = float(np.abs(at_nodes).max(initial=0.0))
        return max((abs(alpha[r]) * (abs(T) + more) for r, T in by_region.items()), default=0.0)

    def described(self, share: float) -> str:
        """A share [1] of the temperature, for messages."""
        given = self.temperature
        if not isinstance(given, Mapping) and not callable(given) and np.ndim(given) == 0:
            return f"a temperature change of {share * float(given):.5g} K"  # type: ignore[arg-type]
        return f"{share:.4g} times the temperature change given"


def _by_region(what: str, given: Any, names: tuple[str, ...]) -> dict[str, float]:
    table = dict(given) if isinstance(given, Mapping) else dict.fromkeys(names, given)
    for name, value in table.items():
        check_known(name, names, f"the {what} names the region {name!r}; the model has")
        number(f"the {what} of region {name!r}", value)
    return {name: float(table.get(name, 0.0)) for name in names}
