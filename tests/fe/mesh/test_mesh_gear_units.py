"""Geometries of gear units: shafts with wheels of their own, housings of two stages."""

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


@pytest.mark.parametrize(("name", "parameters", "message"), [
    ("gear_shaft", SHAFT | {"z_2": 0.16}, "the wheels at z_w = 0.12 and z_2 = 0.16 overlap"),
    ("gear_shaft", SHAFT | {"D_2": 0.03}, "thinner than the shaft"),
    ("gear_shaft", SHAFT | {"z_2": 0.33}, "must lie apart"),
    ("housing", STAGES | {"a": 0.07}, "the seats overlap: shafts 0.07 apart"),
    ("housing", STAGES | {"L": 0.36}, "seats do not fit"),
])  # fmt: skip
def test_sizes_that_do_not_fit_are_named(name, parameters, message):
    with pytest.raises(ConfigError, match=message):
        body(name, parameters)
