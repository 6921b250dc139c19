"""Quantities with units: exact numbers, and refusals that name the dimension."""

import math

import pytest

from rom.errors import ConfigError
from rom.units import UNITS, in_si


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("210 GPa", "Pa", 210e9),
        ("4 mm", "m", 0.004),
        ("5.5mm", "m", 0.0055),
        ("7.85 g/cm^3", "kg/m^3", 7850.0),
        ("7.85 t/m³", "kg/m^3", 7850.0),
        ("1 N/mm^2", "Pa", 1e6),
        ("2 kN/mm", "N/m", 2e6),
        ("36 km/h", "m/s", 10.0),
        ("9.81 m s^-2", "m/s^2", 9.81),
        ("3 N m", "N m", 3.0),
        ("3 Nm/rad", "N m/rad", 3.0),
        ("3 N m", "N m/rad", 3.0),
        ("180 deg", "rad", math.pi),
        ("3000 rpm", "rad/s", 100 * math.pi),
        ("1 rev/s", "rad/s", 2 * math.pi),
        ("3 µm", "m", 3e-6),
        ("3 μs", "s", 3e-6),
        ("3 kHz", "Hz", 3000.0),
        ("1 %", "1", 0.01),
        ("2", "1", 2.0),
        ("1 kg*mm^2", "kg m^2", 1e-6),
        ("12 in", "m", 0.3048),
        ("-1.5e-3 s", "s", -0.0015),
        ("5 1/s", "1/s", 5.0),
        ("1 lbf", "N", 4.4482216152605),
    ],
)
def test_a_quantity_in_si(text, unit, value):
    """Decimal units are exact: the nearest double of the true value, not of a product."""
    assert in_si(text, unit) == (value if "rad" not in unit else pytest.approx(value, rel=1e-15))


@pytest.mark.parametrize(
    ("text", "unit", "words"),
    [
        ("210 mm", "Pa", "is a length; a pressure or stress [Pa] is wanted"),
        ("50 Hz", "rad/s", "is a frequency; an angular speed [rad/s] is wanted"),
        ("3 %", "rad", "is a number; an angle [rad] is wanted"),
        ("30 deg", "1", "is an angle; a number without unit"),
        ("1 m^5 kg", "N", "kg m^5; a force"),
        ("210", "Pa", "has no unit; Pa is wanted"),
        ("1 gpa", "Pa", "'gpa' in 'gpa' is no unit. Did you mean GPa?"),
        ("1 N/m s", "N s/m", "several factors behind a /"),
        ("3,5 mm", "m", "a decimal point is needed"),
        ("steel", "Pa", "does not begin with a number"),
        ("1e400 m", "m", "too large"),
        ("1e9999999 m", "m", "is no unit"),
        ("1 m^99", "m", "is no unit"),
        ("1 m//s", "m/s", "is no unit"),
    ],
)
def test_what_is_no_such_quantity_is_refused(text, unit, words):
    with pytest.raises(ConfigError) as refused:
        in_si(text, unit)
    assert words in str(refused.value)


def test_every_unit_is_understood_by_itself():
    from rom.units import unit

    for name, expected in UNITS.items():
        found = unit(name)
        assert found.dimension == expected.dimension and found.factor == expected.factor
