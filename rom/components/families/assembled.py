"""Families coupled where they touch: an assembly with parameters."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from rom.arguments import typed
from rom.assembly.assembly import Assembly
from rom.assembly.coupling import Place
from rom.components.families.family import BodyFamily
from rom.components.families.parameters import Parameter, complete
from rom.errors import ConfigError
from rom.names import check_text, named


@typed
@dataclass(frozen=True)
class FamilyAssembly:
    """Families of bodies that share interfaces; `at` gives the assembly for their values.

    Attributes:
        families: {name: family}, all in one system of coordinates and in SI units.
        couplings: ((body, interface), (body, interface)) pairs that move together, see
            `rom.Assembly`. What is joined by springs alone is not coupled.
        projection: functions that couple interfaces whose nodes differ, see `rom.Assembly`.

    Raises:
        ConfigError: without families, for one in other units or without a name, or where two
            parameters get one name.
        ConfigError, InterfaceError: see `rom.Assembly`.
    """

    families: dict[str, BodyFamily]
    couplings: tuple[tuple[Place, Place], ...] = ()
    projection: Any = None

    def __post_init__(self) -> None:
        other = [name for name, family in self.families.items() if family.body.units != "SI"]
        if other or not self.families:
            text = f"families {named(other)} are not in SI units" if other else "there is no family"
            raise ConfigError(f"{text}; reduce the models of all parts in SI units.")
        for name in self.families:
            check_text(name, "a family")
        if len(self.parameters) < sum(len(f.parameters) for f in self.families.values()):
            text = f"two parameters have one name among {named(self.parameters)}"
            raise ConfigError(f"{text}; give families names without a dot.")
        _ = self.nominal  # refuses couplings that cannot be

    @cached_property
    def nominal(self) -> Assembly:
        """The bodies of the families in the coordinates of their shares, coupled."""
        bodies = {name: family.body for name, family in self.families.items()}
        return Assembly(bodies, self.couplings, self.projection)

    @property
    def parameters(self) -> dict[str, Parameter]:
        """{"body.parameter": parameter} of all families."""
        return {
            f"{name}.{own}": parameter
            for name, family in self.families.items()
            for own, parameter in family.parameters.items()
        }

    def at(self, **values: float) -> Assembly:
        """The assembly at values {"body.parameter": factor}; one for those not given.

        Raises:
            ParameterError: if a name is unknown, or a factor outside its range.
        """
        point = complete(self.parameters, values)
        bodies = {}
        for name, family in self.families.items():
            own = {key: point[f"{name}.{key}"] for key in family.parameters}
            bodies[name] = family.at(extrapolate=False, **own)
        return Assembly(bodies, self.couplings, self.projection)
