"""Materials, errors, units and rotations: exact numbers, and refusals that name the dimension."""

import itertools
import pickle

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm

import rom
from cases.refusals import refused
from cases.solid import block
from rom import rotation
from rom.errors import ConfigError, MaterialError, MeshError
from rom.units import UNITS, in_si, unit, unit_system

WOOD = {"E": (12e9, 0.8e9, 0.5e9), "nu": (0.4, 0.4, 0.3), "G": (0.7e9, 0.6e9, 0.06e9), "rho": 450.0}


test_numbers_that_no_solid_can_have_are_refused = refused(
    *(
        (lambda nu=nu: rom.Material(210e9, nu, 7850.0), rf"nu = {nu:g} is outside \(-1, 0.5\)")
        for nu in (0.6, -1.2, 0.5, -1.0)
    ),
    (lambda: rom.Orthotropic(**(WOOD | {"nu": (5.0, 0.4, 0.3)})), "negative eigenvalue"),
    (lambda: rom.Orthotropic(**WOOD, axes=np.ones((3, 3))), "orthonormal rows"),
    (lambda: rom.Orthotropic(**(WOOD | {"E": (1.0, 2.0)})), "E has shape"),
    error=MaterialError,
)


def test_an_orthotropic_solid_has_its_moduli_along_its_axes_and_may_be_isotropic():
    """Uniaxial stress along axis 1, wherever it points, sees E1; across, the shear sees G23."""
    quarter = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])  # axis 1 along y
    compliance = np.linalg.inv(rom.Orthotropic(**WOOD, axes=quarter).stiffness)
    assert_allclose(1 / compliance[1, 1], 12e9)
    assert_allclose(1 / compliance[0, 0], 0.8e9)
    assert_allclose(1 / compliance[4, 4], 0.06e9)  # xz is the plane of axes 2 and 3
    assert_allclose(-compliance[0, 1] / compliance[1, 1], 0.4)
    E, nu = 70e9, 0.33
    Q = rotation.matrix(rotation.exp([0.3, -0.7, 1.1]))
    solid = rom.Orthotropic((E,) * 3, (nu,) * 3, (E / (2 + 2 * nu),) * 3, 2700.0, axes=Q)
    assert_allclose(solid.stiffness, rom.Material(E, nu, 2700.0).stiffness, atol=1e-6 * E * 1e-6)


def test_an_error_survives_the_way_to_another_rank():
    error = MeshError("cell 7 has no volume.", where="rod.msh", hint="Mesh again.")
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again)) == (MeshError, "rod.msh: cell 7 has no volume. Mesh again.")
    assert again.exit_code == 3


def test_units_and_their_systems_are_consistent():
    tonne = unit_system("mm-t-s")
    assert_allclose(tonne.force, 1.0)
    assert_allclose(tonne.pressure, 1e6)
    assert_allclose(7.85e-9 * tonne.density, 7850.0)
    crash = unit_system("mm-kg-ms")
    assert_allclose([crash.force, crash.pressure], [1e3, 1e9])  # kN, GPa
    with pytest.raises(ConfigError, match=r"unit system = 'inch' does not exist; known are .*'SI'"):
        unit_system("inch")
    for name, expected in UNITS.items():
        found = unit(name)
        assert found.dimension == expected.dimension and found.factor == expected.factor


def test_modes_of_everything_are_one_record():
    body = rom.reduce(block(), method=rom.CraigBampton(6), interfaces={"root": "rbe2"})
    pair = rom.Assembly({"one": body, "two": body}, [])
    for modes in (rom.modes(block(), 8), body.modes(8), pair.modes(8)):
        omega, shapes = modes
        assert isinstance(modes, rom.Modes) and modes[0] is omega and modes[1] is shapes
        assert_allclose(modes.frequencies, omega / (2 * np.pi))
        assert modes.omega is omega and omega.shape == (8,)
        assert "8 modes" in repr(modes) and "frequency [Hz]" in modes._repr_html_()
    assert issubclass(rom.CyclicModes, rom.Modes) and issubclass(rom.TravellingModes, rom.Modes)


IN_SI = """
210 GPa = 210e9 Pa, 4 mm = 0.004 m, 5.5mm = 0.0055 m, 7.85 g/cm^3 = 7850 kg/m^3,
7.85 t/m³ = 7850 kg/m^3, 1 N/mm^2 = 1e6 Pa, 2 kN/mm = 2e6 N/m, 36 km/h = 10 m/s,
9.81 m s^-2 = 9.81 m/s^2, 3 N m = 3 N m, 3 Nm/rad = 3 N m/rad, 3 N m = 3 N m/rad,
180 deg = 3.141592653589793 rad, 3000 rpm = 314.1592653589793 rad/s,
1 rev/s = 6.283185307179586 rad/s, 3 µm = 3e-6 m, 3 μs = 3e-6 s, 3 kHz = 3000 Hz, 1 % = 0.01 1,
2 = 2 1, 1 kg*mm^2 = 1e-6 kg m^2, 12 in = 0.3048 m, -1.5e-3 s = -0.0015 s, 5 1/s = 5 1/s,
1 lbf = 4.4482216152605 N
"""


@pytest.mark.parametrize("row", IN_SI.split(","))
def test_a_quantity_in_si(row):
    """Decimal units are exact: the nearest double of the true value, not of a product."""
    text, _, wanted = row.strip().partition(" = ")
    value, _, unit = wanted.partition(" ")
    in_turns = pytest.approx(float(value), rel=1e-15)
    assert in_si(text, unit) == (in_turns if "rad" in unit else float(value))


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


def test_rotations_are_the_matrix_exponential_whose_products_they_have():
    vectors = [*np.random.default_rng(1).normal(size=(20, 3)), np.zeros(3), np.array([np.pi, 0, 0])]
    for theta in vectors:
        p = rotation.exp(theta)
        assert_allclose(rotation.matrix(p), expm(rotation.skew(theta)), atol=1e-14)
        back = rotation.matrix(rotation.exp(rotation.log(p)))
        assert_allclose(back, rotation.matrix(p), atol=1e-14)
    for theta in [*(np.eye(3) * 3.0).tolist(), [0.1, 0.2, 0.3], [0, 0, 0]]:
        A = expm(rotation.skew(theta))
        assert_allclose(rotation.matrix(rotation.quaternion(A)), A, atol=1e-14)
    for a, b in itertools.pairwise(vectors):
        p, q = rotation.exp(a), rotation.exp(b)
        product = rotation.matrix(rotation.multiply(p, q))
        assert_allclose(product, rotation.matrix(p) @ rotation.matrix(q), atol=1e-14)
        assert_allclose(rotation.skew(a) @ b, np.cross(a, b))
        assert_allclose(rotation.axial(rotation.skew(a)), a)
