"""Contact of teeth that gives way by Hertz, more slowly than the load grows."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rom.arguments import Between, Positive, typed
from rom.components.gear_mesh.gears.geometry import GearPair
from rom.components.gear_mesh.gears.racks import RackPair
from rom.errors import ModelError
from rom.model import Array

MIN_CURVATURE_RTOL = 1e-6  # radius over the path of contact: at the tangent points it is zero
N_PLACES = 41  # of the table along the path: its constant is a logarithm and changes slowly


@typed
@dataclass(frozen=True, slots=True)
class Hertz:
    """Line contact of two teeth, whose approach per load grows with the logarithm of the load.

    Attributes:
        depths: (2,) or (n, 2) from the flanks of pinion and gear to the axes of their teeth, at
            places from first to last contact [m].
        E: Young's modulus [Pa].
        nu: Poisson's ratio [1].

    Source:
        Weber and Banaschek, VDI-Bericht 1953.
    """

    depths: Annotated[npt.ArrayLike, Positive("m", (2,), (None, 2), error=ModelError)]
    E: Annotated[float, Positive("Pa", error=ModelError)] = 206e9
    nu: Annotated[float, Between(0, 0.5, "[)", error=ModelError)] = 0.3

    @property
    def compliance(self) -> float:
        """C = (1 - nu^2) / (pi E) [m^2/N]."""
        return (1 - self.nu**2) / (np.pi * self.E)

    def constants(self, pair: GearPair | RackPair) -> Array:
        """(n,) C of ``d = c F (C - 2 ln F)`` from first to last contact, F in N/m [1].

        With a^2 = A F the half width of the contact squared, C is the logarithm of
        (4 h_1 h_2 / A)^2, less 2 nu / (1 - nu).
        """
        h = np.atleast_2d(np.asarray(self.depths, dtype=float))
        share = np.linspace(0, 1, N_PLACES)
        h = np.stack([np.interp(share, np.linspace(0, 1, len(h)), column) for column in h.T])
        s = pair.path[0] + share * (pair.path[1] - pair.path[0])
        least = MIN_CURVATURE_RTOL * pair.path[1]
        one = np.maximum(s, least) / np.cos(pair.base_helix)
        two = pair.tangents - s
        two = np.where(np.abs(two) < least, least, two) / np.cos(pair.base_helix)
        A = 8 * self.compliance * one / (1 + one / two)
        return np.asarray(2 * np.log(4 * h[0] * h[1] / A) - 2 * self.nu / (1 - self.nu))
