"""Geared shafts on journal bearings: where they rest, whether they whirl, how they vibrate."""

from rom.components.transmission.housing import Housing
from rom.components.transmission.motion import Run, Whirl, linearised, simulate, threshold, whirl
from rom.components.transmission.response import Response, mesh_response
from rom.components.transmission.shaft import Disc, Shaft
from rom.components.transmission.solid_shaft import SolidShaft
from rom.components.transmission.steady import Steady, steady, sweep
from rom.components.transmission.supports import (
    ShaftWhirl,
    Support,
    critical_speeds,
    shaft_whirl,
)
from rom.components.transmission.unit import Forces, Rest, Rotor, Transmission, rest

__all__ = [
    "Disc",
    "Forces",
    "Housing",
    "Response",
    "Rest",
    "Rotor",
    "Run",
    "Shaft",
    "ShaftWhirl",
    "SolidShaft",
    "Steady",
    "Support",
    "Transmission",
    "Whirl",
    "critical_speeds",
    "linearised",
    "mesh_response",
    "rest",
    "shaft_whirl",
    "simulate",
    "steady",
    "sweep",
    "threshold",
    "whirl",
]
