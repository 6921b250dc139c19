"""Measured structures: models still give what was predicted before the measurements were opened."""

import numpy as np
import pytest
from measured import record, rods
from numpy.testing import assert_allclose

ALL = [pytest.param(one, id=one.name) for one in rods.RODS]


@pytest.mark.parametrize("structure", ALL)
def test_the_model_gives_what_was_predicted(structure):
    """A model that drifts would compare something else than what was said beforehand."""
    kept, (now, _) = record.read(structure.name), record.nominal(structure)
    assert kept.keys() == now.keys()
    for name, one in kept.items():
        assert abs(now[name] - one.value) <= 1e-3 * max(abs(one.value), one.high - one.value), name


@pytest.mark.long
@pytest.mark.parametrize("structure", ALL)
def test_bands_follow_from_the_spreads(structure):
    kept, again = record.read(structure.name), record.predict(structure)
    for name, one in kept.items():
        assert_allclose((one.low, one.high), (again[name].low, again[name].high), rtol=0.02,
                        atol=0.02 * (one.high - one.low))  # fmt: skip
        widths = (one.high - one.low) / 2, np.linalg.norm([*one.parts.values()])
        assert_allclose(*widths, rtol=1e-3, atol=2e-5 * abs(one.value))
        assert one.parts.keys() == {"mesh", *structure.parameters}


def test_a_strip_at_rest_vibrates_as_euler_and_saint_venant_say():
    """Three bending frequencies, and twist about the long axis by GJ and the polar inertia."""
    given = {name: value for name, (value, _) in rods.EPPS_CHANDRA.parameters.items()}
    E, rho, t, length = given["E"], given["density"], given["thickness"], 0.9525
    k = np.array([1.875104, 4.694091, 7.854757]) / length
    kept = record.read("epps_chandra")
    found = [kept[f"sweep 0, flap {n}, 0 rpm [Hz]"].value for n in (1, 2, 3)]
    assert_allclose(found, k**2 * t * np.sqrt(E / 12 / rho) / 2 / np.pi, rtol=1e-3)
    J, polar = 0.0254 * t**3 / 3 * (1 - 0.63 * t / 0.0254), 0.0254 * t * (0.0254**2 + t**2) / 12
    twist = np.sqrt(E / 2 / 1.325 * J / rho / polar) / 4 / length
    # the propeller moment adds the square of the speed; the steady stretch next to nothing
    assert_allclose(kept["sweep 0, coupled 2, 750 rpm [Hz]"].value,
                    np.hypot(twist, 750 / 60), rtol=2e-3)  # fmt: skip


@pytest.mark.parametrize(("beam", "angle"), [(1, 0), (2, 0), (2, 45), (3, 45)])
def test_a_laminate_bends_by_its_compliance_under_a_small_weight(beam, angle):
    """Twist and bending by the inverse of their 2 x 2 stiffness, axes turned by hand."""
    force, length = 1e-4, 0.55
    one = rods.laminate(44, beam, angle, length, 0.0, 1.0, 1.0)
    shape = rods.hung(one, force / rods.GRAVITY)
    EA, _, _, GJ, EIy, EIz, C45, C14 = rods.LAMINATES[beam]
    flexible = np.linalg.inv([[GJ, C14, C45], [C14, EA, 0.0], [C45, 0.0, EIy]])
    twist, bend = flexible[0, 2], flexible[2, 2]
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    down, side = c * c * bend + s * s / EIz, c * s * (bend - 1 / EIz)
    cube, square = force * length**3 / 3, force * length**2 / 2
    assert_allclose((shape.x - one.x)[-1, 1:], (cube * side, -cube * down), rtol=2e-3, atol=1e-9)
    turn = shape.frame(-1) @ one_frame(one).T  # small; about x it is the twist
    assert_allclose((turn[2, 1] - turn[1, 2]) / 2, square * c * twist, rtol=2e-3, atol=1e-9)


def one_frame(one):
    """Section axes before loading."""
    return rods.rotation.matrix(one.p[-1])
