"""Geometry of ball and roller bearings, and what one of their balls or rollers bears.

Source:
    Harris and Kotzalas, Rolling Bearing Analysis, 5th ed. (2007), chapters 2 and 6; Palmgren,
    Grundlagen der Waelzlagertechnik (1964), for rollers.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from rom.arguments import Angle, Between, Count, Number, Positive, Size, between, typed
from rom.errors import ModelError
from rom.model import Array

Balls = Annotated[int, Count(3, error=ModelError)]
PALMGREN_STIFFNESS = 8.06e4 * 1e3 ** (10 / 9 + 8 / 9)  # [N/m^2], of steel rollers between two races


@typed
@dataclass(frozen=True)
class BallBearing:
    """A row of balls between two grooved races.

    Attributes:
        balls: number.
        ball_diameter, pitch_diameter: [m].
        conformity: (2,) radius of the groove of inner and outer race over the ball's diameter [1].
        contact_angle: without load [rad]; positive if the inner ring bears thrust along the axis.
        clearance: radial play, from end to end [m]; negative for a bearing that is pressed.
        E: Young's modulus of balls and races [Pa].
        nu: Poisson's ratio of them [1].

    Raises:
        ModelError: for numbers that no bearing has.
    """

    exponent: ClassVar[float] = 1.5  # of the depth in the force [1]
    balls: Balls
    ball_diameter: Size
    pitch_diameter: Size
    conformity: tuple[float, float] = (0.52, 0.52)
    contact_angle: Angle = 0.0
    clearance: Annotated[float, Number("m")] = 0.0
    E: Annotated[float, Positive("Pa", error=ModelError)] = 206e9
    nu: Annotated[float, Between(-1, 0.5, "(]", error=ModelError)] = 0.3

    def __post_init__(self) -> None:
        _check_row(self.balls, self.ball_diameter, self.pitch_diameter, self.clearance)
        if not 0.5 < min(self.conformity) <= max(self.conformity) <= 1.0:
            text = f"conformity {self.conformity} must be above 0.5 and at most 1"
            raise ModelError(f"{text}: a groove is a little wider than its ball, by 0.52.")
        if not abs(self.contact_angle) < 1.4:
            text = f"contact angle {self.contact_angle:g} rad is not below 80 degrees"
            raise ModelError(f"{text}; angles are in radians, and thrust bearings none of these.")

    @property
    def count(self) -> int:
        """Number of balls."""
        return self.balls

    @property
    def curvature_distance(self) -> float:
        """Of the centres of both grooves while ball and races just touch [m]."""
        return (sum(self.conformity) - 1.0) * self.ball_diameter

    @property
    def offset(self) -> tuple[float, float]:
        """Radial and axial part of that distance in the middle of the play [m]."""
        A, alpha = self.curvature_distance, self.contact_angle
        return A * np.cos(alpha) - 0.5 * self.clearance, A * np.sin(alpha)

    @property
    def radius(self) -> float:
        """At which the curvature of the inner groove has its centre [m]."""
        groove = (self.conformity[0] - 0.5) * self.ball_diameter
        return 0.5 * self.pitch_diameter + groove * np.cos(self.contact_angle)

    @property
    def cage(self) -> float:
        """Speed of the cage over that of the inner ring while the outer one stands [1]."""
        return 0.5 * (1 - self._slenderness)

    @cached_property
    def stiffness(self) -> float:
        """Force per depth^1.5 of a ball between both races [N/m^1.5]."""
        inner, outer = (self.race_stiffness(race) for race in (0, 1))
        return float((inner ** (-2 / 3) + outer ** (-2 / 3)) ** -1.5)

    def race_stiffness(self, race: int) -> float:
        """Force per depth^1.5 of a ball on the inner race, 0, or the outer one, 1 [N/m^1.5]."""
        side, g = (1.0, -1.0)[race], self._slenderness
        across, along = side * g / (1 - side * g), -0.5 / self.conformity[race]
        curvatures = 2 / self.ball_diameter * np.array([1.0, 1.0, across, along])
        return elliptic_stiffness(curvatures, 0.5 * self.E / (1 - self.nu**2))

    @property
    def _slenderness(self) -> float:
        return self.ball_diameter * np.cos(self.contact_angle) / self.pitch_diameter


@typed
@dataclass(frozen=True)
class RollerBearing:
    """A row of cylindrical steel rollers, which bear no thrust and no tilt.

    Attributes:
        rollers: number.
        roller_diameter, length, pitch_diameter: [m].
        clearance: radial play, from end to end [m]; negative for a bearing that is pressed.

    Raises:
        ModelError: for numbers that no bearing has.
    """

    exponent: ClassVar[float] = 10 / 9  # of the depth in the force [1]
    curvature_distance: ClassVar[float] = 0.0  # the races are straight
    rollers: Balls
    roller_diameter: Size
    length: Size
    pitch_diameter: Size
    clearance: Annotated[float, Number("m")] = 0.0

    def __post_init__(self) -> None:
        _check_row(self.rollers, self.roller_diameter, self.pitch_diameter, self.clearance)

    @property
    def count(self) -> int:
        """Number of rollers."""
        return self.rollers

    @property
    def offset(self) -> tuple[float, float]:
        """Radial overlap in the middle of the play, and none along the axis [m]."""
        return -0.5 * self.clearance, 0.0

    @property
    def radius(self) -> float:
        """Of the circle on which the rollers are [m]."""
        return 0.5 * self.pitch_diameter

    @property
    def cage(self) -> float:
        """Speed of the cage over that of the inner ring while the outer one stands [1]."""
        return 0.5 * (1 - self.roller_diameter / self.pitch_diameter)

    @property
    def stiffness(self) -> float:
        """Force per depth^(10/9) of a roller between both races, after Palmgren [N/m^(10/9)]."""
        return float(PALMGREN_STIFFNESS * self.length ** (8 / 9))


def elliptic_stiffness(curvatures: Array, modulus: float) -> float:
    """Force per depth^1.5 of two bodies that touch in a point [N/m^1.5].

    Curvatures (4,) are of the one body and of the other in two planes, the first and third in one
    plane [1/m], negative for a hollow; the modulus is 1 / ((1 - nu1^2) / E1 + (1 - nu2^2) / E2).

    Source:
        Hertz, J. reine angew. Math. 92 (1881) 156, with complete elliptic integrals.
    """
    total = float(np.sum(curvatures))
    difference = abs(curvatures[0] + curvatures[2] - curvatures[1] - curvatures[3]) / total
    m = 0.0 if difference < 1e-12 else brentq(_difference, 1e-14, 1 - 1e-15, (difference,))
    depth = 2 * ellipk(m) / np.pi * (np.pi * (1 - m) / (2 * ellipe(m))) ** (1 / 3)
    return float(modulus * np.sqrt(32 / total) / (3 * depth**1.5))


def _difference(m: float, wanted: float) -> float:
    """Curvature difference of an ellipse of contact with this square of its eccentricity."""
    F, E = ellipk(m), ellipe(m)
    k2 = 1 / (1 - m)  # square of the ratio of its axes
    return float(((k2 + 1) * E - 2 * F) / ((k2 - 1) * E) - wanted)


def _check_row(number: int, diameter: float, pitch: float, clearance: float) -> None:
    """Refuse balls or rollers that do not fit on their circle."""
    if not pitch > diameter:
        text = f"{number} balls or rollers of {diameter:g} m on one of {pitch:g} m"
        raise ModelError(f"no bearing has {text}.")
    if diameter > pitch * np.sin(np.pi / number):
        text = f"{number} balls or rollers of {diameter * 1e3:.4g} mm do not fit on a circle of"
        room = f"there is room for {int(np.pi / np.arcsin(diameter / pitch))}"
        raise ModelError(f"{text} {pitch * 1e3:.4g} mm; {room}.")
    between("clearance", clearance, -0.1 * diameter, 0.1 * diameter, "()", error=ModelError)
