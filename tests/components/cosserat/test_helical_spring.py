"""Springs as rods: rigidities against the wire itself, Haringx, buckling."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cases.refusals import refuses
from rom.components import cosserat
from rom.components.cosserat import clamped, equilibrium, linearised, loads, reference
from rom.components.cosserat.helical_spring import HelicalSpring, plate_compliance, spring_rod
from rom.errors import ModelError

MM = 1e-3


def spring(wire, diameter, coils, length):
    return HelicalSpring(wire * MM, diameter * MM, coils, length * MM)


def test_rigidities_stress_and_clearance_of_the_bench_spring():
    one = spring(1, 10, 6, 15)
    rigidities = [one.axial, one.bending, one.shear, one.torsion]
    assert_allclose(rigidities, [24.0385, 6.79348e-4, 62.5, 7.8125e-4], rtol=2e-6)
    assert_allclose([one.stiffness, one.bending / one.length], [1602.56, 0.0452899], rtol=4e-6)
    shear, bending = one.wire_stress(10.0, 0.01)
    assert_allclose([shear, bending], [42 / 37 * 0.8 / np.pi * 1e9, 0.32 / np.pi * 1e9], rtol=1e-12)
    assert_allclose(one.clearance(14 * MM, -0.5), (14 - 2.75 - 6) * MM)


WIRE = {  # wire, diameter, coils, length [mm]: stiffness, bending, sideways, twist over the wire's
    (1, 10, 10, 20): (1.004, 1.001, 0.999, 0.999),
    (1, 10, 10, 40): (1.008, 0.996, 0.995, 0.990),
    (0.5, 10, 10, 20): (1.000, 1.001, 0.999, 0.999),
    (1, 8, 6, 15): (1.008, 1.000, 0.996, 0.995),
}


@pytest.mark.parametrize("size", WIRE)
def test_closed_forms_are_those_of_the_wire(size):
    """The helix as a rod of 40 segments a coil; the forms leave out the slope of the wire."""
    one = spring(*size)
    wire = plate_compliance(cosserat.wire_rod(one), (0, 0, one.length)).diagonal()
    ratio = one.compliance().diagonal() / wire
    axial, bending, sideways, twist = WIRE[size]
    expected = [sideways, sideways, 1 / axial, bending, bending, twist]
    assert_allclose(ratio, expected, atol=3.5e-3)
    assert_allclose(ratio[:5], 1.0, atol=0.0105)


def test_a_short_rod_has_the_compliance_of_the_spring_and_shortens_in_proportion():
    one = spring(1, 10, 6, 15)
    C = one.compliance()
    size = np.sqrt(np.outer(C.diagonal(), C.diagonal()))
    ours = plate_compliance(spring_rod(one, 64), (0, 0, one.length))
    assert_allclose(ours / size, C / size, atol=2e-4)
    rod = spring_rod(one, 8)
    shape = equilibrium(rod, loads(rod, tip=(0, 0, -10.0)))
    assert_allclose(reference(rod).x[-1, 2] - shape.x[-1, 2], 10 / one.stiffness, rtol=1e-9)


def guided(one, share, n):
    """Sideways tangent stiffness of a rod between parallel plates under compression."""
    rod = spring_rod(one, n)
    free = clamped(rod)
    free[-3:] = False
    load = loads(rod, tip=(0, 0, -share * one.axial))
    still = free.copy()
    still[0::6] = still[1::6] = still[2::6] = False  # compress straight, beyond buckling too
    still[3::6] = still[4::6] = False
    K = linearised(rod, equilibrium(rod, load, free=still), load)[1][np.ix_(free, free)]
    C = np.linalg.inv(K)
    tip = np.flatnonzero(np.flatnonzero(free) == free.size - 6)[0]
    return 1 / C[tip, tip]


def test_a_compressed_rod_is_the_column_of_haringx():
    one = spring(1, 10, 8, 24)
    shares = np.array([0.02, 0.08, 0.16, 0.24, 0.32, 0.40])
    formula = one.lateral_stiffness(shares)
    assert_allclose(formula, [569, 546, 513, 479, 445, 412], rtol=1.5e-3)
    assert_allclose([guided(one, share, 48) for share in shares], formula, rtol=2e-3)
    assert_allclose(one.lateral_stiffness(1e-7), one.lateral_stiffness(0.0), rtol=1e-5)


def test_buckling():
    """The formula, the sign of the stiffness of the rod, and the constants of Shigley's book."""
    one = spring(1, 10, 8, 40)
    critical = one.critical_compression(1.0)
    assert_allclose(critical, 0.1986, rtol=1e-4)
    assert guided(one, critical - 0.001, 64) > 0 > guided(one, critical + 0.001, 64)
    assert spring(1, 10, 8, 26).critical_compression(1.0) == np.inf  # below 2.62 diameters
    short = spring(1, 10, 8, 26.3)
    assert_allclose(short.critical_compression(1.0), 0.8125, rtol=0.1)


def test_impossible_springs_are_named():
    refuses(ModelError, r"must be below diameter = 0\.01", spring, 10, 10, 1, 15)
    refuses(ModelError, r"free length 0\.006 m is not above the solid length", spring, 1, 10, 6, 6)
