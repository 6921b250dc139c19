"""Helical springs as short rods: four rigidities in closed form, buckling, coil bind.

All four rigidities grow in proportion to the length of the spring now, as pitch does. A rod with
constant rigidities per reference length does the same, so it is the column of Haringx, at any
compression and deflection.

Source:
    Haringx, On highly compressible helical springs and rubber rods, Philips Res. Rep. 3 (1948) 401;
    rigidities as in Timoshenko and Gere, Theory of Elastic Stability, 1961.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rom import rotation
from rom.arguments import Positive, Size, typed
from rom.components.cosserat import Rod, along, clamped, linearised, reference, straight
from rom.errors import ModelError
from rom.model import Array


@typed
@dataclass(frozen=True)
class HelicalSpring:
    """A compression spring of round wire.

    Attributes:
        wire: diameter of the wire [m].
        diameter: of the helix, centre line to centre line [m].
        coils: number of active coils [1].
        length: free length [m].
        E, nu: Young's modulus [Pa] and Poisson's ratio [1] of the wire.
        total_coils: coils that lie on each other in a solid spring [1]; None for the active ones.

    Raises:
        ModelError: if a size is not positive, or the coils touch already when it is free.
    """

    wire: Size
    diameter: Size
    coils: Annotated[float, Positive(error=ModelError)]
    length: Size
    E: Annotated[float, Positive("Pa", error=ModelError)] = 200e9
    nu: float = 0.3
    total_coils: float | None = None

    def __post_init__(self) -> None:
        wire, solid = self.wire, self.solid_length
        if self.diameter <= wire:
            raise ModelError(f"wire = {wire:g} m must be below diameter = {self.diameter:g} m.")
        if self.length <= solid:
            text = f"free length {self.length:g} m is not above the solid length {solid:g} m"
            raise ModelError(f"{text}; take fewer coils.")

    @property
    def G(self) -> float:
        """Shear modulus [Pa]."""
        return self.E / (2 * (1 + self.nu))

    @property
    def _area_moment(self) -> float:
        return np.pi * self.wire**4 / 64

    @property
    def axial(self) -> float:
        """Rigidity against compression A0 = G d^4 l / (64 R^3 n) [N]."""
        return self.G * self.wire**4 * self.length / (8 * self.diameter**3 * self.coils)

    @property
    def bending(self) -> float:
        """Rigidity against bending B0 = 2 E G I l / (n pi R (2 G + E)) [N m^2]."""
        per_coil = np.pi * self.diameter / 2 * (2 * self.G + self.E)
        return 2 * self.E * self.G * self._area_moment * self.length / (self.coils * per_coil)

    @property
    def shear(self) -> float:
        """Rigidity against shear S0 = E I l / (pi n R^3) [N]."""
        radius = self.diameter / 2
        return self.E * self._area_moment * self.length / (np.pi * self.coils * radius**3)

    @property
    def torsion(self) -> float:
        """Rigidity against torsion T0 = E I l / (2 pi n R) [N m^2]."""
        return self.E * self._area_moment * self.length / (np.pi * self.coils * self.diameter)

    @property
    def stiffness(self) -> float:
        """Axial stiffness [N/m]."""
        return self.axial / self.length

    @property
    def solid_length(self) -> float:
        """Length when all coils touch [m]."""
        return (self.coils if self.total_coils is None else self.total_coils) * self.wire

    def clearance(self, length: float, angle: float) -> float:
        """Way left on the inner side until coils touch [m].

        The length is that of the centre line [m], the angle between the plates at both ends [rad].
        """
        return length - (self.diameter + self.wire) / 2 * abs(angle) - self.solid_length

    def rigidities(self) -> dict[str, tuple[float, float, float]]:
        """Keywords ``stretch`` [N] and ``bend`` [N m^2] of a rod."""
        return {
            "stretch": (self.shear, self.shear, self.axial),
            "bend": (self.bending, self.bending, self.torsion),
        }

    def compliance(self) -> Array:
        """(6, 6) motion of the end per load on it, about the free spring.

        Displacements [m], then rotations [rad]; forces [N], then moments [N m]; third axis along.
        """
        l, B, S = self.length, self.bending, self.shear
        across, turned = l**3 / (3 * B) + l / S, l / B
        C = np.diag([across, across, l / self.axial, turned, turned, l / self.torsion])
        C[0, 4] = C[4, 0] = l**2 / (2 * B)
        C[1, 3] = C[3, 1] = -(l**2) / (2 * B)
        return C

    def lateral_stiffness(self, compression: npt.ArrayLike) -> Array:
        """(k,) or scalar sideways stiffness [N/m] between parallel plates, after Haringx.

        Compression (k,), or a scalar, is the share of the free length, 0 to below 1 [1]; beyond
        buckling the stiffness is negative.
        """
        share = np.asarray(compression, dtype=float)
        now = 1 - share
        P, l = self.axial * share, self.length * now
        B, S = self.bending * now, self.shear * now
        q = np.sqrt(P / B * (1 + P / S))
        with np.errstate(divide="ignore", invalid="ignore"):
            k = P**2 / (2 * q * B * np.tan(q * l / 2) - P * l)
        return np.where(share > 0, k, 1 / (l**3 / (12 * B) + l / S))

    def critical_compression(self, end: float = 0.5) -> float:
        """Share of the free length at which the spring buckles [1]; infinite if it never does.

        The end is effective length over length [1], 1/2 between fixed plates, 1 if one plate is
        free to move sideways, 2 if it is also free to turn.
        """
        first = self.E / (2 * (self.E - self.G))
        second = 2 * np.pi**2 * (self.E - self.G) / (2 * self.G + self.E)
        slender = (end * self.length / self.diameter) ** 2
        return float(first * (1 - np.sqrt(1 - second / slender))) if second < slender else np.inf

    def wire_stress(self, force: float, moment: float = 0.0) -> tuple[float, float]:
        """Shear stress, after Bergstraesser, and bending stress of the wire [Pa].

        The force is along the axis [N], the moment across it [N m].
        """
        C = self.diameter / self.wire
        shear = (4 * C + 2) / (4 * C - 3) * 8 * force * self.diameter / (np.pi * self.wire**3)
        return shear, 32 * moment / (np.pi * self.wire**3)


def spring_rod(spring: HelicalSpring, n: int = 16, **options: npt.ArrayLike) -> Rod:
    """The spring as a rod of n segments; options as for `cosserat.straight`."""
    return straight(spring.length, n, **spring.rigidities(), **options)


def wire_rod(spring: HelicalSpring, per_coil: int = 40) -> Rod:
    """The wire itself as a rod along its helix, for checks of the closed forms.

    The wire starts on the first axis beside the centre line, which is the third axis. Beyond its
    ends it has no arms: a load on the centre of a plate is one on the end of the wire and a couple.
    """
    R, pitch = spring.diameter / 2, spring.length / spring.coils
    rise = pitch / (2 * np.pi)
    slope = np.hypot(R, rise)

    def place(angle: float) -> tuple[Array, Array]:
        c, s = np.cos(angle), np.sin(angle)
        tangent = np.array([-R * s, R * c, rise]) / slope
        outward = np.array([c, s, 0.0])
        axes = np.column_stack([outward, np.cross(tangent, outward), tangent])
        return np.array([R * c, R * s, rise * angle]), axes

    stations = np.linspace(0, 2 * np.pi * spring.coils, round(per_coil * spring.coils) + 1)
    area, EI = np.pi * spring.wire**2 / 4, spring.E * np.pi * spring.wire**4 / 64
    GA, bend = 0.9 * spring.G * area, (EI, EI, EI / (1 + spring.nu))
    return along(place, stations, stretch=(GA, GA, spring.E * area), bend=bend)


def plate_compliance(rod: Rod, centre: npt.ArrayLike) -> Array:
    """(6, 6) motion of a plate at a rod's end per load at its centre [m/N, rad/N; m/N/m, rad/N/m].

    About the reference of the rod; the centre (3,) is where the motion is measured, too [m].
    """
    free = clamped(rod)
    K = linearised(rod, reference(rod))[1][np.ix_(free, free)]
    A, arm = rotation.matrix(rod.p[-1]), np.asarray(centre, dtype=float) - rod.x[-1]
    T = np.zeros((len(K), 6))  # loads on x_N and the plate per load at the centre
    T[-6:-3, :3] = np.eye(3)
    T[-3:, :3] = A.T @ rotation.skew(arm)
    T[-3:, 3:] = A.T
    return T.T @ np.linalg.solve(K, T)
