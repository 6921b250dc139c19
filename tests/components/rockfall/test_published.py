"""What is published of tests and rules, by models and after adjustment.

Rock sheds of full size: Saeki, Kon-No, Kurihashi and Kishi, JSCE 69th annual meeting (2014) I-268:
largest forces of the weight on sand and on gravel about 4500 and 7500 kN, half sines of about
50 ms, equivalent to Lame constants of about 1200 and 4000 kN/m^2 in the handbook's formula. The
abstract read does not have mass and height; both forces together with the formula give one number,
and 10 t from 20 m have it. They are inferred here, and so is the radius, of a ball of rock.

Sand of 90 cm under 30 kN: manufacturer JSP, page on triple cushions, calculated there after
J. Struct. Eng. 42A (1996).

Factors of bearing capacity after Vesic: tables at geotechnicalinfo.com.
"""

import numpy as np
import pytest

from cases.refusals import refused
from rom.components import rockfall
from rom.components.rockfall import Cushion, calibrate, strike
from rom.errors import ConfigError

STILL = rockfall.Slab.of_mass(1e3, 1e11, damping=0.0)
RIGID = {"shear": rockfall.Shear(1e11, damping=0.0), "slab": STILL}
WEIGHT, HEIGHT, RADIUS = 1e4, 20.0, 0.972  # inferred
SAND, GRAVEL, DURATION = 4.5e6, 7.5e6, 0.05  # measured
STRENGTH = ["strength of the cushion"]
FLAT = {"deflection": rockfall.History(np.arange(9.0), np.ones(9))}


def full_size(cushion):
    """The weight of the full-size tests on a shed that does not give way."""
    return rockfall.Gallery(WEIGHT, HEIGHT, 1e3, cushion, **RIGID)


def granular(friction_deg):
    """0.9 m of it; the modulus hardly matters where the contact fails."""
    strength = rockfall.bearing_pressure(np.radians(friction_deg), RADIUS)
    return rockfall.Layer(30e6, RADIUS, 0.9, strength=strength)


def contact_time(got):
    F = got.forces[:, 0]
    return np.ptp(got.t[F > 0.05 * F.max()])


@pytest.mark.parametrize(("height", "kilonewton"), [(20, 1945), (30, 2485), (40, 2954)])
def test_sand_of_90_cm_under_30_kn(height, kilonewton):
    mass = 30e3 / 9.81
    g = rockfall.Gallery(mass, height, 1e3, Cushion.of_sand(mass, 1e6), weight=False, **RIGID)
    assert strike(g).peaks[0] == pytest.approx(1e3 * kilonewton, rel=2e-3)


def test_mass_height_and_rebound_follow_from_forces_and_duration():
    """2.108 (m g)^(2/3) lame^(2/5) H^(3/5) in t, m, kN."""
    for force, lame in ((SAND, 1200), (GRAVEL, 4000)):
        product = force / 1e3 / 2.108 / lame**0.4
        assert product == pytest.approx((9.81 * 10) ** (2 / 3) * 20**0.6, rel=0.03)
    # m v (1 + e) is the impulse of the half sine less the weight's: e = 0.18, e^2 = 0.03
    impulse = 2 / np.pi * GRAVEL * DURATION - WEIGHT * 9.81 * DURATION
    e = impulse / (WEIGHT * np.sqrt(2 * 9.81 * HEIGHT)) - 1
    assert e**2 == pytest.approx(0.033, abs=0.002)
    assert e**2 == pytest.approx(Cushion(1.0).recovery, rel=0.15)
    assert e**2 == pytest.approx(rockfall.Layer(1e6, 1.0, 1.0).recovery, rel=0.15)


def test_forces_on_sand_and_gravel_are_as_their_equivalent_constants():
    """Free of the mass and the height: the ratio is measured as 1.67."""
    cushions = (Cushion.of_sand(WEIGHT, lame) for lame in (1.2e6, 4e6))
    sand, gravel = (strike(full_size(cushion)).peaks[0] for cushion in cushions)
    assert gravel / sand == pytest.approx(GRAVEL / SAND, rel=0.05)
    assert sand == pytest.approx(SAND, rel=0.06)
    assert gravel == pytest.approx(GRAVEL, rel=0.02)


def test_the_handbook_is_consistent_with_the_force_on_sand_but_not_its_duration():
    """At its 1 MPa 1 % low on sand, by which the boulder is inferred; 41 % low on gravel."""
    got = strike(full_size(Cushion.of_sand(WEIGHT, 1e6)))
    assert got.peaks[0] == pytest.approx(SAND, rel=0.02)
    assert got.peaks[0] / GRAVEL == pytest.approx(0.59, abs=0.01)
    assert 1.5 < contact_time(got) / DURATION < 2.0
    # no more arrives than strikes; published 1.1 to 1.2 times on 70 cm, twice on 90 cm, by waves
    assert got.peaks[1] / got.peaks[0] == pytest.approx(1.0, abs=1e-3)


def test_geometry_and_strength_predict_force_and_duration_on_gravel():
    """For the boulder so inferred: very dense gravel, 45 degrees; and adjusted to the half sine."""
    blind = strike(full_size(granular(45)))
    assert blind.peaks[0] / GRAVEL == pytest.approx(0.89, abs=0.01)
    assert contact_time(blind) == pytest.approx(DURATION, rel=0.1)
    t = np.linspace(0, DURATION, 101)
    pulse = rockfall.History(t, GRAVEL * np.sin(np.pi * t / DURATION))
    found = calibrate(full_size(granular(45)), {"force in the cushion": pulse}, STRENGTH)
    adjusted = strike(found.gallery)
    assert adjusted.peaks[0] / GRAVEL == pytest.approx(1.06, abs=0.01)
    assert found.factors["strength of the cushion"] == pytest.approx(1.32, abs=0.02)
    assert found.deviations["strength of the cushion"] == pytest.approx(0.0105, abs=0.002)
    assert found.residuals["force in the cushion"] == pytest.approx(0.15, abs=0.01)


def test_dense_sand_of_40_degrees_would_be_pressed_through_and_42_bear():
    """Blind the strength of slow loading is too small by a third; adjusted the force is met."""
    assert rockfall.design_check(full_size(granular(40))).state == "through"
    by_its_weight = full_size(granular(40.3))  # the fall alone is taken up
    assert by_its_weight.cushion.penetration(by_its_weight.energy) < 0.9
    assert rockfall.design_check(by_its_weight).state == "through"
    lasting = rockfall.Layer(2.5e6, RADIUS, 0.9)  # it does not fail
    assert strike(full_size(lasting)).peaks[0] > 2 * SAND
    got = strike(full_size(granular(42)))
    assert got.peaks[0] == pytest.approx(SAND, rel=0.01)
    assert contact_time(got) / DURATION == pytest.approx(1.48, abs=0.05)


def test_a_fit_passes_by_parameters_that_stop_no_boulder():
    """A pulse asks for a third of the strength of 41 degrees; 0.85 of it lets through."""
    t = np.linspace(0, 0.04, 81)
    third = strike(full_size(granular(41)), t_end=0.04)
    history = rockfall.History(t, np.interp(t, third.t, third.forces[:, 0]) / 3)
    start = full_size(granular(41))
    found = calibrate(start, {"force in the cushion": history}, STRENGTH)
    assert 0.84 < found.factors["strength of the cushion"] < 0.9


@pytest.mark.parametrize(("degrees", "factor"), [(30, 22.4), (40, 109.4), (42, 155.6), (44, 224.6)])
def test_sand_bears_as_vesic_says(degrees, factor):
    pressure = rockfall.bearing_pressure(np.radians(degrees), 0.5, 1700.0)
    assert pressure == pytest.approx(0.6 * 1700 * 9.81 * 0.5 * factor, rel=1e-3)


test_bad_numbers_are_named = refused(
    (lambda: calibrate(full_size(granular(40)), FLAT, STRENGTH), "pressed through"),
    (lambda: calibrate(full_size(Cushion(1e6)), {}, STRENGTH), "nothing is measured"),
    (lambda: calibrate(full_size(Cushion(1e6)), FLAT, STRENGTH), "needs a cushion of type Layer"),
    error=ConfigError,
)  # fmt: skip
