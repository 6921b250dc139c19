"""Materials, errors and units."""

import pickle

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.solid import block
from rom import rotation
from rom.errors import ConfigError, MaterialError, MeshError
from rom.model import Material, Orthotropic, Report, Row
from rom.units import unit_system

WOOD = {"E": (12e9, 0.8e9, 0.5e9), "nu": (0.4, 0.4, 0.3), "G": (0.7e9, 0.6e9, 0.06e9), "rho": 450.0}


@pytest.mark.parametrize(
    ("numbers", "message"),
    [
        ({"nu": 0.6}, r"nu = 0.6 is outside \(-1, 0.5\)"),
        ({"nu": -1.2}, "nu = -1.2 is outside"),
        ({"nu": 0.5}, "nu = 0.5 is outside"),
        ({"nu": -1.0}, "nu = -1 is outside"),
    ],
)
def test_message_for_numbers_no_solid_can_have(numbers, message):
    with pytest.raises(MaterialError, match=message):
        Material(**({"E": 210e9, "nu": 0.3, "rho": 7850.0} | numbers))


def test_message_for_an_orthotropic_stiffness_that_releases_energy():
    with pytest.raises(MaterialError, match="negative eigenvalue"):
        Orthotropic(**(WOOD | {"nu": (5.0, 0.4, 0.3)}))
    with pytest.raises(MaterialError, match="orthonormal rows"):
        Orthotropic(**WOOD, axes=np.ones((3, 3)))
    with pytest.raises(MaterialError, match="E needs three numbers"):
        Orthotropic(**(WOOD | {"E": (1.0, 2.0)}))


def test_an_isotropic_orthotropic_solid_is_isotropic_in_any_axes():
    E, nu = 70e9, 0.33
    Q = rotation.matrix(rotation.exp([0.3, -0.7, 1.1]))
    solid = Orthotropic((E,) * 3, (nu,) * 3, (E / (2 + 2 * nu),) * 3, 2700.0, axes=Q)
    assert_allclose(solid.stiffness, Material(E, nu, 2700.0).stiffness, atol=1e-6 * E * 1e-6)


def test_stiffness_along_a_principal_axis_after_turning_the_axes():
    """Uniaxial stress along axis 1, wherever it points, sees E1; across, the shear sees G23."""
    quarter = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])  # axis 1 along y
    compliance = np.linalg.inv(Orthotropic(**WOOD, axes=quarter).stiffness)
    assert_allclose(1 / compliance[1, 1], 12e9)
    assert_allclose(1 / compliance[0, 0], 0.8e9)
    assert_allclose(1 / compliance[4, 4], 0.06e9)  # xz is the plane of axes 2 and 3
    assert_allclose(-compliance[0, 1] / compliance[1, 1], 0.4)


def test_an_error_survives_the_way_to_another_rank():
    error = MeshError("cell 7 has no volume.", where="rod.msh", hint="Mesh again.")
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again)) == (MeshError, "rod.msh: cell 7 has no volume. Mesh again.")
    assert again.exit_code == 3


def test_report_prints_what_failed():
    report = Report("rod", (Row("mass", 1.0, "> 0", True), Row("residual", 0.5, "<= 0.1", False)))
    assert not report.ok
    assert [row.quantity for row in report.failures] == ["residual"]
    assert "rod: 1 of 2 failed" in str(report)


def test_unit_systems_are_consistent():
    tonne = unit_system("mm-t-s")
    assert_allclose(tonne.force, 1.0)
    assert_allclose(tonne.pressure, 1e6)
    assert_allclose(7.85e-9 * tonne.density, 7850.0)
    crash = unit_system("mm-kg-ms")
    assert_allclose([crash.force, crash.pressure], [1e3, 1e9])  # kN, GPa
    with pytest.raises(ConfigError, match="unit system = 'inch' is none of 'SI', "):
        unit_system("inch")


def test_modes_of_everything_are_one_record():
    """Whoever solves for modes gives omega, frequencies and shapes, which also unpack."""
    body = rom.reduce(block(), method=rom.CraigBampton(6), interfaces={"root": "rbe2"})
    pair = rom.Assembly({"one": body, "two": body}, [])
    for modes in (rom.modes(block(), 8), body.modes(8), pair.modes(8)):
        omega, shapes = modes
        assert isinstance(modes, rom.Modes) and modes[0] is omega and modes[1] is shapes
        assert_allclose(modes.frequencies, omega / (2 * np.pi))
        assert modes.omega is omega and omega.shape == (8,)
        assert "8 modes" in repr(modes) and "frequency [Hz]" in modes._repr_html_()
    assert issubclass(rom.CyclicModes, rom.Modes) and issubclass(rom.TravellingModes, rom.Modes)
