"""Hydrodynamic journal bearings: the film, what carries the load, heat, and stability of whirl."""

from rom.components.journal_bearing.bearing import Groove, JournalBearing
from rom.components.journal_bearing.closed_forms import (
    long_force,
    long_pressure,
    short_attitude,
    short_coefficients,
    short_eccentricity,
    short_force,
    short_sommerfeld,
)
from rom.components.journal_bearing.oil import Oil, Warm, iso_vg, warm_bearing, warm_equilibrium
from rom.components.journal_bearing.oil_film import Film, film
from rom.components.journal_bearing.statics import (
    Stability,
    coefficients,
    equilibrium,
    stability,
    threshold_speed,
)

__all__ = [
    "Film",
    "Groove",
    "JournalBearing",
    "Oil",
    "Stability",
    "Warm",
    "coefficients",
    "equilibrium",
    "film",
    "iso_vg",
    "long_force",
    "long_pressure",
    "short_attitude",
    "short_coefficients",
    "short_eccentricity",
    "short_force",
    "short_sommerfeld",
    "stability",
    "threshold_speed",
    "warm_bearing",
    "warm_equilibrium",
]
