"""Linear elastic solids, and whether one has such numbers."""

from dataclasses import dataclass
from math import sqrt
from typing import Annotated, Any, ClassVar

import numpy as np
import numpy.typing as npt

from rom.arguments import Number, finite, number, orthonormal, plain, positive
from rom.errors import MaterialError, warn
from rom.plausible import (
    FOAM_SPEED,
    HEAVY_DENSITY,
    HEAVY_SPEED,
    LIGHT_SPEED,
    SOLID_DENSITY,
    STIFF_DENSITY,
    WAVE_SPEED,
)
from rom.units import SYSTEMS, UnitSystem, unit_system

Array = npt.NDArray[np.float64]


def _doubt(solid: "Material | Orthotropic") -> str:
    """What is unusual about the numbers, in a sentence, or nothing.

    Speed of sound or density that no solid has, and the unit system that may be meant.
    """
    numbers = f"the solid with E = {solid.E}, rho = {solid.rho:g}"
    density = STIFF_DENSITY if solid.wave_speed > LIGHT_SPEED else SOLID_DENSITY
    message = WAVE_SPEED.doubt(solid.wave_speed, numbers) or density.doubt(solid.rho, numbers)
    if not message and solid.rho > HEAVY_DENSITY:
        message = HEAVY_SPEED.doubt(solid.wave_speed, numbers)
    if not message:
        return ""
    system = next((name for name, unit in SYSTEMS.items() if _is_stiff(solid, unit)), "")
    kind = type(solid).__name__
    cure = f" Units of {system}? {kind}.from_units({system!r}, …), of a deck units={system!r}."
    return message + cure * bool(system)


def _is_stiff(solid: "Material | Orthotropic", unit: UnitSystem) -> bool:
    """Whether the numbers are those of a metal, mineral or wood in a unit system."""
    speed, rho = solid.wave_speed * unit.length / unit.time, solid.rho * unit.density
    return speed > FOAM_SPEED and not (WAVE_SPEED.doubt(speed) or STIFF_DENSITY.doubt(rho))


@dataclass(frozen=True, slots=True)
class Material:
    """Isotropic linear elastic solid; ``Material.steel`` and others of `SOLIDS` are ready made.

    Attributes:
        E: Young's modulus [Pa]. Here and below a text such as "210 GPa" will do.
        nu: Poisson's ratio [1].
        rho: density [kg/m^3].

    Raises:
        MaterialError: for E <= 0, rho <= 0, nu outside (-1, 0.5), or a number that is not finite.

    Warns:
        RomWarning: if sound would travel in it as in no solid: wrong units.

    Example:
        >>> steel = rom.Material.from_units("mm-t-s", E=210e3, nu=0.3, rho=7.85e-9)
        >>> round(steel.rho, 6)
        7850.0
    """

    E: Annotated[float, Number("Pa")]
    nu: float
    rho: Annotated[float, Number("kg/m^3")]
    aluminium: ClassVar["Material"]
    nylon: ClassVar["Material"]
    steel: ClassVar["Material"]
    titanium: ClassVar["Material"]

    def __post_init__(self) -> None:
        for name, unit in (("E", "Pa"), ("rho", "kg/m^3")):
            object.__setattr__(self, name, plain(name, getattr(self, name), unit))
            positive(name, getattr(self, name), error=MaterialError)
        number("nu", self.nu, error=MaterialError)
        if not -1.0 < self.nu < 0.5:
            text = f"nu = {self.nu:g} is outside (-1, 0.5): the strain energy would be negative"
            raise MaterialError(f"{text}; metals have 0.27 to 0.35.")
        warn(self.doubt)

    @classmethod
    def from_units(cls, units: str, *, E: float, nu: float, rho: float) -> "Material":
        """The solid with numbers in another unit system, e.g. "mm-t-s": MPa and t/mm^3.

        Args:
            units: name of the unit system.
            E: Young's modulus, in units of the system.
            nu: Poisson's ratio [1].
            rho: density, in units of the system.

        Raises:
            ConfigError: if the unit system is unknown.
            MaterialError: as for numbers in SI.
        """
        unit = unit_system(units)
        E, rho = (number(name, x, error=MaterialError) for name, x in (("E", E), ("rho", rho)))
        return cls(E * unit.pressure, nu, rho * unit.density)

    doubt = property(_doubt)

    @property
    def stiffness(self) -> Array:
        """(6, 6) stiffness [Pa]; rows xx, yy, zz, yz, xz, xy with engineering shear strains."""
        mu = self.E / (2 * (1 + self.nu))
        lam = self.E * self.nu / ((1 + self.nu) * (1 - 2 * self.nu))
        C = np.diag([2 * mu] * 3 + [mu] * 3)
        C[:3, :3] += lam
        return C

    @property
    def wave_speed(self) -> float:
        """Speed of a longitudinal wave in a thin bar [m/s]."""
        return sqrt(self.E / self.rho)


SOLIDS = {  # handbook values: E [Pa], nu, rho [kg/m^3]
    "aluminium": (70e9, 0.33, 2700.0),
    "nylon": (2.8e9, 0.4, 1140.0),
    "steel": (210e9, 0.3, 7850.0),
    "titanium": (114e9, 0.34, 4430.0),
}


@dataclass(frozen=True, slots=True)
class Orthotropic:
    """Orthotropic linear elastic solid with principal axes 1, 2, 3.

    Attributes:
        E: (3,) Young's moduli E1, E2, E3 [Pa].
        nu: (3,) Poisson's ratios nu12, nu13, nu23 [1]; nu_ij = -eps_j / eps_i under stress along i.
        G: (3,) shear moduli G12, G13, G23 [Pa].
        rho: density [kg/m^3].
        axes: (3, 3) rows are the principal axes in the frame of the geometry [1].

    Raises:
        MaterialError: if the stiffness is not positive definite or the axes are not orthonormal.
        ConfigError: if the axes are no (3, 3) finite numbers.

    Warns:
        RomWarning: if sound would travel in it as in no solid: wrong units.
    """

    E: Annotated[tuple[float, float, float], Number("Pa", (3,))]
    nu: tuple[float, float, float]
    G: Annotated[tuple[float, float, float], Number("Pa", (3,))]
    rho: Annotated[float, Number("kg/m^3")]
    axes: Any = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

    def __post_init__(self) -> None:
        for name in ("E", "G"):
            object.__setattr__(self, name, plain(name, getattr(self, name), "Pa"))
        for name in ("E", "nu", "G"):
            lowest = finite(name, getattr(self, name), (3,), error=MaterialError).min()
            if name != "nu":
                positive(name, lowest, error=MaterialError)
        object.__setattr__(self, "rho", plain("rho", self.rho, "kg/m^3"))
        positive("rho", self.rho, error=MaterialError)
        orthonormal("axes", finite("axes", self.axes, None), error=MaterialError)
        lowest = np.linalg.eigvalsh(self._compliance()).min()
        if lowest <= 0:
            raise MaterialError(
                f"the orthotropic compliance has the negative eigenvalue {lowest:.3g} 1/Pa: "
                "some load would release energy.",
                hint="Check that |nu_ij| < sqrt(E_i / E_j).",
            )
        warn(self.doubt)

    @classmethod
    def from_units(
        cls, units: str, *, E: Any, nu: Any, G: Any, rho: float, axes: Any = None
    ) -> "Orthotropic":
        """The solid with numbers in another unit system, e.g. "mm-t-s": MPa and t/mm^3.

        Args:
            units: name of the unit system.
            E: (3,) Young's moduli, in units of the system.
            nu: (3,) Poisson's ratios [1], as for numbers in SI.
            G: (3,) shear moduli, in units of the system.
            rho: density, in units of the system.
            axes: (3, 3) rows are the principal axes [1]; None for those of the geometry.

        Raises:
            ConfigError: if the unit system is unknown.
            MaterialError: as for numbers in SI.
        """
        unit = unit_system(units)
        rho = number("rho", rho, error=MaterialError) * unit.density
        E, G = (
            tuple((finite(name, x, (3,), error=MaterialError) * unit.pressure).tolist())
            for name, x in (("E", E), ("G", G))
        )
        return cls(E, nu, G, rho, **({} if axes is None else {"axes": axes}))

    doubt = property(_doubt)

    def _compliance(self) -> Array:
        (E1, E2, E3), (n12, n13, n23), (G12, G13, G23) = self.E, self.nu, self.G
        C = np.diag([1 / E1, 1 / E2, 1 / E3, 1 / G23, 1 / G13, 1 / G12])
        C[0, 1] = C[1, 0] = -n12 / E1
        C[0, 2] = C[2, 0] = -n13 / E1
        C[1, 2] = C[2, 1] = -n23 / E2
        return C

    @property
    def stiffness(self) -> Array:
        """(6, 6) stiffness [Pa] in the geometry frame; order and shear as in `Material`."""
        T = _strain_rotation(np.asarray(self.axes, dtype=float))
        return T.T @ np.linalg.inv(self._compliance()) @ T

    @property
    def wave_speed(self) -> float:
        """Largest speed of a longitudinal wave in a thin bar [m/s]."""
        return sqrt(max(self.E) / self.rho)


PAIRS = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))  # xx yy zz yz xz xy


def _strain_rotation(Q: Array) -> Array:
    """(6, 6) map of engineering strains from the geometry frame to the axes in the rows of Q."""
    T = np.empty((6, 6))
    for row, (i, j) in enumerate(PAIRS):
        for column, (k, m) in enumerate(PAIRS):
            value = Q[i, k] * Q[j, m] + (Q[i, m] * Q[j, k] if k != m else 0.0)
            T[row, column] = value * (1.0 if i == j else 2.0) / (1.0 if k == m else 2.0)
    return T


for _name, _numbers in SOLIDS.items():
    setattr(Material, _name, Material(*_numbers))
