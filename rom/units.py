"""Declared unit systems. Numbers are converted at the border, never guessed."""

from dataclasses import dataclass

from rom.errors import ConfigError


@dataclass(frozen=True, slots=True)
class UnitSystem:
    """A consistent system of units.

    Attributes:
        name: as written in files.
        length: its unit of length [m].
        mass: its unit of mass [kg].
        time: its unit of time [s].
    """

    name: str
    length: float
    mass: float
    time: float

    @property
    def force(self) -> float:
        """Its unit of force [N]."""
        return self.mass * self.length / self.time**2

    @property
    def pressure(self) -> float:
        """Its unit of stress [Pa]."""
        return self.force / self.length**2

    @property
    def density(self) -> float:
        """Its unit of density [kg/m^3]."""
        return self.mass / self.length**3


SYSTEMS = {
    s.name: s
    for s in (
        UnitSystem("SI", 1.0, 1.0, 1.0),
        UnitSystem("mm-t-s", 1e-3, 1e3, 1.0),  # N, MPa: the habit of Abaqus and Nastran users
        UnitSystem("mm-kg-ms", 1e-3, 1.0, 1e-3),  # kN, GPa: the habit of crash users
    )
}


def unit_system(name: str) -> UnitSystem:
    """The unit system of that name.

    Raises:
        ConfigError: listing the names that exist.
    """
    if name not in SYSTEMS:
        raise ConfigError(f"the unit system {name!r} is unknown; known: {sorted(SYSTEMS)}.")
    return SYSTEMS[name]
