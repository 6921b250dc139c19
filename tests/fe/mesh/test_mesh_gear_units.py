"""Geometries of gear units: shafts with wheels, housings of two stages, carriers of planets."""

import numpy as np
import pytest

import rom
from rom.errors import ConfigError

pytestmark = pytest.mark.fenicsx
SHAFT = {"z_w": 0.12, "b": 0.04, "D": 0.09, "z_2": 0.24, "b_2": 0.05, "D_2": 0.06}
STAGES = {"a": 0.13, "a_2": 0.17, "L": 0.5, "lc": 0.02}


def body(name, parameters, degree=1):
    steel = rom.Material(E=206e9, nu=0.3, rho=7850.0)
    return rom.fe.model(f"meshes/{name}.geo", material=steel, parameters=parameters, degree=degree)


def test_a_shaft_with_two_wheels_has_their_mass_and_rims():
    model = body("gear_shaft", SHAFT, degree=2)
    rest = (0.4 - 0.04 - 0.05) * 0.04**2
    volume = np.pi / 4 * (rest + 0.04 * 0.09**2 + 0.05 * 0.06**2)
    assert model.mass() == pytest.approx(7850 * volume, rel=0.01)  # chords of circles
    for name, z, radius in (("wheel", 0.12, 0.045), ("wheel_2", 0.24, 0.03), ("end_b", 0.4, 0.02)):
        face = model.interfaces[name]
        assert face.origin == pytest.approx([0, 0, z], abs=1e-9)
        assert np.hypot(*face.points.T[:2]).max() == pytest.approx(radius, rel=1e-6)


def test_a_housing_of_two_stages_has_six_seats_on_three_axes():
    seats = body("housing", STAGES).interfaces
    found = {name: face.origin[0] for name, face in seats.items() if name != "feet"}
    assert found == {
        f"{shaft}_{side}": pytest.approx(x, abs=1e-9)
        for shaft, x in (("input", -0.15), ("middle", -0.02), ("output", 0.15))
        for side in ("front", "back")
    }


def test_a_carrier_has_its_mass_its_pins_and_its_journals():
    model = body("carrier", {"n": 4, "lc": 0.012}, degree=2)
    disc, shaft = 0.012 * (0.128**2 - 0.034**2), (0.116 - 0.024) * (0.05**2 - 0.034**2)
    rest = 4 * 0.024 * 0.02**2 + 2 * 0.016 * (0.056**2 - 0.05**2)
    assert model.mass() == pytest.approx(7850 * np.pi / 4 * (disc + shaft + rest), rel=0.01)
    at = {f"pin_{k + 1}": (0.048 * x, 0.048 * y, 0)
          for k, (x, y) in enumerate(((1, 0), (0, 1), (-1, 0), (0, -1)))}  # fmt: skip
    at |= {"front": (0, 0, -0.04), "back": (0, 0, -0.1)}
    assert {name: pytest.approx(x, abs=1e-9) for name, x in at.items()} == {
        name: face.origin for name, face in model.interfaces.items()
    }


@pytest.mark.parametrize(("name", "parameters", "message"), [
    ("gear_shaft", SHAFT | {"z_2": 0.16}, "the wheels at z_w = 0.12 and z_2 = 0.16 overlap"),
    ("gear_shaft", SHAFT | {"D_2": 0.03}, "thinner than the shaft"),
    ("gear_shaft", SHAFT | {"z_2": 0.33}, "must lie apart"),
    ("housing", STAGES | {"a": 0.07}, "the seats overlap: shafts 0.07 apart"),
    ("housing", STAGES | {"L": 0.36}, "seats do not fit"),
    ("carrier", {"n": 2.5}, "n = 2.5: a carrier needs a whole number"),
    ("carrier", {"a": 0.06}, "3 pins of d_p = 0.02 at a = 0.06 do not fit"),
    ("carrier", {"z_f": 0.03}, "z_f = 0.03 and z_b = 0.1 do not fit on the shaft"),
])  # fmt: skip
def test_sizes_that_do_not_fit_are_named(name, parameters, message):
    with pytest.raises(ConfigError, match=message):
        body(name, parameters)
