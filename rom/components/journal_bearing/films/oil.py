"""Viscosity of oil over temperature.

Source:
    Walther's equation as in ASTM D341; grades of ISO 3448.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rom.arguments import Positive, typed
from rom.errors import ModelError
from rom.model import Array
from rom.names import check_known

CELSIUS_ZERO = 273.15  # [K]
AT_100 = {32: 5.4, 46: 6.8, 68: 8.7}  # usual mineral oils of these grades [mm^2/s]


@typed
@dataclass(frozen=True, slots=True)
class Oil:
    """A mineral oil; log log (nu + 0.7) is linear in log T (Walther, ASTM D341).

    Attributes:
        nu_40, nu_100: kinematic viscosity at 40 and 100 degrees Celsius [mm^2/s].
        density: [kg/m^3].
        heat: specific heat [J/(kg K)].

    Raises:
        ModelError: for numbers that no oil has.
    """

    nu_40: float
    nu_100: float
    density: Annotated[float, Positive("kg/m^3", error=ModelError)] = 870.0
    heat: Annotated[float, Positive("J/(kg K)", error=ModelError)] = 2000.0

    def __post_init__(self) -> None:
        if not self.nu_40 > self.nu_100 > 0.3:
            text = f"no oil has {self.nu_40} mm2/s at 40 C and {self.nu_100} mm2/s at 100 C"
            raise ModelError(f"{text}: hot oil is thinner; needed are nu_40 > nu_100 > 0.3.")

    def law(self) -> tuple[float, float]:
        """A and B of log10 log10 (nu + 0.7) = A - B log10 T, nu in mm^2/s and T in kelvin [1]."""
        cold, hot = (np.log10(np.log10(nu + 0.7)) for nu in (self.nu_40, self.nu_100))
        T = np.log10([CELSIUS_ZERO + 40, CELSIUS_ZERO + 100])
        B = (cold - hot) / (T[1] - T[0])
        return float(cold + B * T[0]), float(B)

    def viscosity(self, celsius: npt.ArrayLike) -> Array:
        """(...,) dynamic viscosity [Pa s] at temperatures (...,) [degrees Celsius]."""
        A, B = self.law()
        nu = 10 ** (10 ** (A - B * np.log10(np.asarray(celsius, dtype=float) + CELSIUS_ZERO))) - 0.7
        return 1e-6 * self.density * nu


def iso_vg(grade: int) -> Oil:
    """A usual oil of grade 32, 46 or 68.

    Raises:
        ModelError: for other grades.
    """
    check_known(grade, AT_100, f"ISO VG {grade} is not listed; use Oil, there are", ModelError)
    return Oil(float(grade), AT_100[grade])
