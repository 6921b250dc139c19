"""Isotropic sets of two-dof mechanisms by closed forms, and the figure that compares them."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad
from scipy.optimize import brentq

import rom
from cases.mbs import linkages
from cases.mbs.linkages import five_bar_of_the_core, two_link_of_the_core
from cases.refusals import refused, refuses
from rom.components.linkages import Driven, FiveBar, TwoLink, isotropic_set, rigid_link, rod
from rom.components.linkages.dynamic_isotropy import angle_grid, closed_loci, index_map
from rom.components.linkages.isotropic_sets import tool_isotropy
from rom.components.linkages.prismatic_linkages import CrossSlides, PolarArm, SlideArm, SlideFiveBar
from rom.errors import ConfigError, ModelError

RAILS = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
MU, PAYLOAD, REACH = 0.8, 0.5, 0.6
GLIDE = SlideFiveBar(RAILS, (1.3, 1.3), (rod(MU, REACH),) * 2, PAYLOAD)
SPAN = ((0.0, 0.2), (0.3, 1.5))
ARM = PolarArm(guide=0.05, slide=2.0, spin=0.01)
FIVE = FiveBar(0.7, (rod(2.0, 0.3),) * 2, (rod(1.0, 0.8),) * 2, payload=0.5)


def along(a, b):
    """Gauss points of a rod: two carry its exact kinetic energy."""
    return a + (0.5 + np.array([[-1], [1]]) / np.sqrt(12)) * (b - a)


def points_of_arm(q1, q2):
    u, n = np.array([np.cos(q1), np.sin(q1)]), np.array([-np.sin(q1), np.cos(q1)])
    centre, half = q2 * u + 0.03 * n, np.sqrt(0.01 / 2.0)
    return np.array([np.sqrt(0.05) * u, centre + half * u, centre - half * u])


def points_of_slide_arm(q1, q2):
    o = np.array([q1, 0.0])
    e = o + 0.4 * np.array([np.cos(q2), np.sin(q2)])
    return np.vstack([o, along(o, e), e])


def points_of_glide(q1, q2):
    ends, tip = TILTED._elbows(np.array(q1), np.array(q2)), TILTED.tip(q1, q2)
    return np.vstack([*ends, *(along(end, tip) for end in ends), tip])


RODS = rod(MU, REACH), rod(MU, 0.5)
TILTED = SlideFiveBar(((0, 0, 0.4), (0.8, 0.1, 2.0)), (1.3, 0.7), RODS, PAYLOAD, -1)
CASES = {
    "PP": (
        CrossSlides((3.0, 2.0), 1.1, (0.0, 0.0)),
        lambda a, b: np.array([[a, 0.0], [a + b * np.cos(1.1), b * np.sin(1.1)]]),
        [3.0, 2.0],
    ),
    "RP": (replace(ARM, offset=0.03), points_of_arm, [1.0, 1.0, 1.0]),
    "PR": (SlideArm(1.5, rod(0.9, 0.4), 0.3), points_of_slide_arm, [1.5, 0.45, 0.45, 0.3]),
    "PRRRP": (TILTED, points_of_glide, [1.3, 0.7, *[MU / 2] * 4, PAYLOAD]),
}


@pytest.mark.parametrize("name", CASES)
def test_inertia_of_linkages_with_slides_is_that_of_moving_points(name):
    linkage, posture, masses = CASES[name]
    rng, h = np.random.default_rng(2), 1e-6
    for q in rng.uniform(0.1, 0.4, (5, 2)):
        A, rate = linkage.inertia(*q), rng.normal(size=2)
        v = (posture(*(q + h * rate)) - posture(*(q - h * rate))) / (2 * h)
        expected = 0.5 * np.array(masses) @ np.square(v).sum(axis=1)
        assert 0.5 * rate @ A @ rate == pytest.approx(expected, rel=1e-7)


def test_the_tool_of_the_polar_arm_lies_beside_its_guide_and_rotors_add_to_their_coordinate():
    middle = points_of_arm(0.7, 0.4)[1:].mean(axis=0)
    assert_allclose(replace(ARM, offset=0.03).tip(0.7, 0.4), middle, atol=1e-15)

    A = CrossSlides((1.0, 2.0), motors=(0.5, 0.25)).inertia(0.0, np.zeros(3))
    assert_allclose(A, np.tile(np.diag([3.5, 2.25]), (3, 1, 1)), atol=1e-15)
    assert replace(ARM, motor=0.7).inertia(0.0, 0.2)[1, 1] == pytest.approx(2.7)


def test_two_slides_are_isotropic_everywhere_or_nowhere():
    """Everywhere if the guides are square and the rotor of the second makes up for the first."""
    span = ((0.0, 0.5), (0.0, 0.3))
    alike = CrossSlides((1.0, 2.0), motors=(0.2, 1.2))
    found = isotropic_set(alike.inertia, span, n=20)
    assert found.kind == "everywhere" and len(found.q) == 19**2
    assert_allclose(found.inertia, 3.2, rtol=1e-14)
    assert_allclose([found.q.min(axis=0), found.q.max(axis=0)], [[0, 0], [0.5, 0.3]], atol=1e-12)
    for other in (replace(alike, angle=1.5), replace(alike, motors=(0.2, 1.3))):
        assert isotropic_set(other.inertia, span, n=20).kind == "none"


def test_a_polar_arm_is_isotropic_on_a_circle():
    """s^2 = L^2 - J / m; no circle if L^2 < J / m, none with an offset, whatever L."""
    L = 0.3
    s = ARM.isotropic_reach(L)
    assert s == pytest.approx(np.sqrt(L**2 - 0.06 / 2.0), rel=1e-14)
    found = isotropic_set(ARM.inertia, (None, (0.05, 0.6)), lengths=(L, 1.0), n=60)
    assert found.kind == "curves" and not found.winding.any()
    assert_allclose(found.q[:, 1], s, rtol=1e-9)
    assert np.ptp(found.q[:, 0]) > 6
    assert_allclose(found.inertia, 2.0, rtol=1e-9)
    assert ARM.isotropic_reach(0.17) is None
    geared = replace(ARM, motor=0.7)
    A = geared.inertia(0.0, geared.isotropic_reach(L))
    assert_allclose(A, 2.7 * np.diag([L**2, 1.0]), rtol=1e-12)
    short = isotropic_set(ARM.inertia, (None, (0.05, 0.6)), lengths=(0.17, 1.0), n=60)
    aside = replace(ARM, offset=0.02)
    wide = isotropic_set(aside.inertia, (None, (0.05, 0.6)), lengths=(L, 1.0), n=60)
    assert short.kind == wide.kind == "none" and aside.isotropic_reach(L) is None


def test_a_slide_with_an_arm_is_isotropic_on_lines_or_everywhere():
    """sin q2 = 0 if (m1 + m2) L^2 is the inertia of the arm; everywhere if balanced besides."""
    span, arm = ((0.0, 0.4), None), rod(0.9, 0.4)
    L = np.sqrt(0.9 * 0.4**2 / 3 / 2.4)
    found = isotropic_set(SlideArm(1.5, arm).inertia, span, lengths=(1.0, L), n=60)
    assert found.kind == "curves"
    assert_allclose(np.sin(found.q[:, 1]), 0.0, atol=1e-9)
    assert np.cos(found.q[:, 1]).min() < -0.99 < 0.99 < np.cos(found.q[:, 1]).max()
    other = isotropic_set(SlideArm(1.5, arm).inertia, span, lengths=(1.0, 1.1 * L), n=60)
    assert other.kind == "none"
    balanced = SlideArm(1.5, rigid_link(0.9, 0.4, (0.0, 0.0), 0.02))
    L = np.sqrt(0.02 / 2.4)
    assert isotropic_set(balanced.inertia, span, lengths=(1.0, L), n=20).kind == "everywhere"


# cot^2 of the couplers' slope = (4/3 mu + M) / (2/3 mu + M); 45 degrees without their mass
COT = np.sqrt((4 / 3 * MU + PAYLOAD) / (2 / 3 * MU + PAYLOAD))
SPREAD = 2 * REACH * COT / np.hypot(1, COT)


def test_equal_sides_on_one_rail_are_isotropic_at_one_spread():
    for mass in (0.0, 1.3, 20.0):  # whatever both slides weigh
        glide = replace(GLIDE, slides=(mass, mass))
        found = isotropic_set(glide.inertia, SPAN, n=60, assembles=GLIDE.assembles)
        assert found.kind == "curves"
        assert_allclose(found.q[:, 1] - found.q[:, 0], SPREAD, rtol=1e-8)
    unequal = replace(GLIDE, slides=(1.3, 1.0))
    assert isotropic_set(unequal.inertia, SPAN, n=60, assembles=GLIDE.assembles).kind == "none"


def test_two_links_are_isotropic_everywhere_on_curves_or_nowhere():
    """In angles to the ground: a = c and cos(q1 - q2) = 0, or no coupling at all."""
    even = TwoLink(rigid_link(1.0, 0.3, (0.1, 0.0), 0.02), rigid_link(0.4, 0.5, (0, 0), 0.066))
    assert even.first.M[2, 2] + 0.4 * 0.3**2 == pytest.approx(0.066)
    assert isotropic_set(even.inertia, n=40).kind == "everywhere"
    leaning = TwoLink(even.first, rigid_link(0.4, 0.5, (0.2, 0.0), 0.066 - 0.4 * 0.2**2))
    found = isotropic_set(leaning.inertia, n=40)
    assert found.kind == "curves"
    assert_allclose(np.cos(found.q[:, 0] - found.q[:, 1]), 0.0, atol=1e-9)
    turned = [replace(one, relative=True) for one in (even, leaning)]
    geared = replace(even, first=rigid_link(1.0, 0.3, (0.1, 0.0), 0.086), relative=True)
    A = geared.inertia(0.0, 0.0)  # without coupling of the links, a = 2 c: still the elbow's motor
    assert_allclose(A, [[3 * 0.066, 0.066], [0.066, 0.066]])
    for one in (*turned, geared):
        assert isotropic_set(one.inertia, n=40).kind == "none"
    heavier = TwoLink(rigid_link(1.1, 0.3, (0.1, 0.0), 0.02), leaning.second)
    assert isotropic_set(heavier.inertia, n=40).kind == "none"


def test_points_stay_under_small_changes_where_curves_vanish():
    """Rank two is stable: each posture of the five-bar moves by about the change of a mass."""
    one = isotropic_set(FIVE.inertia, n=120)
    other = isotropic_set(replace(FIVE, payload=0.501).inertia, n=120)
    assert one.kind == other.kind == "points" and len(one.q) == len(other.q) == 8
    assert 1e-6 < np.abs(one.q - other.q).max() < 1e-2
    part = isotropic_set(FIVE.inertia, ((0.5, 3.0), (0.5, 3.0)), n=120)
    assert_allclose(part.q, one.q[2:5], atol=1e-9)
    assert_allclose(part.winding, one.winding[2:5])


def test_a_double_point_is_no_curve():
    """f = (x^2 - y^2, 2 x y) up to order three: rank zero at the origin, winding two."""

    def inertia(x, y):
        f = 0.2 * np.stack([np.cos(y) - np.cos(x), np.sin(x) * np.sin(y)])
        return np.stack([[1 + f[0], f[1]], [f[1], 1 - f[0]]]).transpose(2, 0, 1)

    found = isotropic_set(inertia, ((-1.0, 1.1), (-1.0, 1.05)), n=40)
    assert found.kind == "points" and not found.winding.any()
    assert_allclose(found.q, 0.0, atol=1e-4)


def test_slides_and_the_polar_arm_have_the_tool_isotropy_of_their_closed_forms():
    """The tool feels m along and m + J / s^2 across; integrated over s ds by w = 2 m s^2 + J."""
    m, J, (s1, s2) = 2.0, 0.06, (0.1, 0.6)

    def primitive(s):
        w = 2 * m * s * s + J
        return np.sqrt(w * w - J * J) - J * np.arccos(J / w)

    expected = (primitive(s2) - primitive(s1)) / (2 * m * (s2**2 - s1**2))
    by_quad = quad(lambda s: 2 * np.sqrt(m * (m + J / s**2)) / (2 * m + J / s**2) * s, s1, s2)[0]
    assert expected == pytest.approx(by_quad * 2 / (s2**2 - s1**2), rel=1e-9)
    found = tool_isotropy(ARM.inertia, ARM.tip, (None, (s1, s2)), n=300)
    assert found.mean == pytest.approx(expected, rel=1e-5)
    assert found.area == pytest.approx(np.pi * (s2**2 - s1**2), rel=1e-9)
    # of slides in any coordinates of the plane, on any rectangle
    m1, m2 = 3.0, 2.0
    slides = CrossSlides((m1, m2))
    found = tool_isotropy(slides.inertia, slides.tip, ((0, 0.5), (-1, 2)), n=10)
    assert found.mean == pytest.approx(2 * np.sqrt(m2 * (m1 + m2)) / (m1 + 2 * m2), rel=1e-9)
    assert found.area == pytest.approx(1.5, rel=1e-9)


def test_a_tool_without_a_machine_is_isotropic():
    """Links of no mass: every linkage is one point mass, and the figure is one."""
    thin = rigid_link(1e-12, 0.3, (0.0, 0.0), 0.0)
    for linkage, span in (
        (TwoLink(thin, thin, 2.0), (None, (0.5, 2.5))),
        (SlideFiveBar(RAILS, (0.0, 0.0), (thin, thin), 2.0), ((0, 0.1), (0.2, 0.5))),
        (SlideArm(0.0, thin, 1.0), ((0, 0.2), (0.3, 2.8))),
    ):
        assert tool_isotropy(linkage.inertia, linkage.tip, span, n=20).mean == pytest.approx(1.0)


def test_units_gears_and_coordinates_do_not_matter():
    chain = TwoLink(rod(1.0, 0.5), rod(2.0, 0.4), 0.3)
    turned = replace(chain, relative=True)
    large = TwoLink(rod(7.0, 1.0), rod(14.0, 0.8), 2.1)
    plain = tool_isotropy(chain.inertia, chain.tip)
    relative = tool_isotropy(turned.inertia, turned.tip)
    assert relative.mean == pytest.approx(plain.mean, rel=3e-4)  # kinks of |det J| on the grid
    grown = tool_isotropy(large.inertia, large.tip)
    assert grown.mean == pytest.approx(plain.mean, rel=1e-9)
    assert grown.area == pytest.approx(4 * plain.area, rel=1e-9)
    geared = tool_isotropy(lambda a, b: chain.inertia(a / 3, b) / np.array([[9, 3], [3, 1]]),
                           lambda a, b: chain.tip(a / 3, b), ((0, 6 * np.pi), None))  # fmt: skip
    assert geared.mean == pytest.approx(plain.mean, rel=1e-8)


def polar_of_the_core():
    mech = rom.Mechanism(gravity=(0, 0, 0))
    guide = mech.add_rigid("guide", mass=1.0, inertia=(0.05,) * 3, at=(0, 0, 0))
    slide = mech.add_rigid("slide", mass=2.0, inertia=(0.01,) * 3, at=(0.3, 0, 0))
    mech.revolute("pin", mech.ground.marker((0, 0, 0)), guide.marker((0, 0, 0)), axis=(0, 0, 1))
    mech.prismatic("rail", guide.marker((0, 0, 0)), slide.marker((0, 0, 0)), axis=(1, 0, 0))
    mech.drive("turn", "pin", lambda t: 0.0)
    mech.drive("feed", "rail", lambda t: 0.0)
    return mech


def test_a_mechanism_of_bodies_and_joints_has_the_set_and_the_figure_of_its_formula():
    core, L = Driven(polar_of_the_core(), ("turn", "feed"), tool="slide"), 0.3
    q = np.array([[0.2, 0.1], [2.5, -0.2], [5.0, 0.2]])
    shift = core.tip(0.0, 0.1)[0] - 0.1  # of the coordinate of the rail
    assert_allclose(core.inertia(*q.T), ARM.inertia(q[:, 0], q[:, 1] + shift), rtol=1e-8, atol=1e-9)
    assert_allclose(core.tip(*q.T), ARM.tip(q[:, 0], q[:, 1] + shift), atol=1e-9)
    span = ((0.0, 1.0), (-0.2, 0.2))
    found = isotropic_set(core.inertia, span, lengths=(L, 1.0), n=6, assembles=core.assembles)
    assert found.kind == "curves"
    assert_allclose(found.q[:, 1] + shift, ARM.isotropic_reach(L), rtol=1e-7)
    one = tool_isotropy(core.inertia, core.tip, span, n=4, assembles=core.assembles)
    other = tool_isotropy(ARM.inertia, ARM.tip, (span[0], (-0.2 + shift, 0.2 + shift)), n=4)
    assert one.mean == pytest.approx(other.mean, rel=1e-6)


def test_cross_slides_of_the_core_are_isotropic_everywhere_or_nowhere():
    """The first slide carries the second: everywhere only without a mass of its own."""
    span = ((-0.1, 0.2), (-0.1, 0.3))
    light, square = (1e-12, 2.0), np.pi / 2
    for masses, angle, kind in (
        ((1.0, 2.0), square, "none"), (light, 1.4, "none"), (light, square, "everywhere"),
    ):  # fmt: skip
        core = Driven(linkages.cross_slides_of_the_core(masses, angle), ("x", "y"), tool="b")
        formula = CrossSlides(masses, angle)
        assert_allclose(core.inertia(0.1, -0.2), formula.inertia(0.1, -0.2), atol=1e-8)
        assert_allclose(core.tip(0.1, -0.2), formula.tip(0.1, -0.2), atol=1e-12)
        assert isotropic_set(core.inertia, span, n=4).kind == kind
    mean = tool_isotropy(core.inertia, core.tip, span, n=2).mean
    assert mean == pytest.approx(1.0)  # of a point, whatever its guides


def test_a_slide_with_an_arm_of_the_core_is_isotropic_where_the_arm_lies_along_the_rail():
    L = np.sqrt(0.9 * 0.4**2 / 3 / 2.4)
    core = Driven(linkages.slide_arm_of_the_core(1.5, (0.9, 0.4), 0.3), ("x", "turn"), tool="arm")
    formula = SlideArm(1.5, rod(0.9, 0.4))
    q = np.array([[0.1, 0.5], [-0.2, -1.1]])
    assert_allclose(core.inertia(*q.T), formula.inertia(q[:, 0], q[:, 1] + 0.3), rtol=1e-8)
    assert_allclose(core.tip(0.0, 0.0), 0.2 * np.array([np.cos(0.3), np.sin(0.3)]), atol=1e-12)
    span = ((-0.1, 0.1), (-0.9, 0.5))  # turns from where it was added, at 0.3
    found = isotropic_set(core.inertia, span, lengths=(1.0, L), n=6)
    assert found.kind == "curves"
    assert_allclose(found.q[:, 1], -0.3, atol=1e-7)
    assert isotropic_set(core.inertia, span, lengths=(1.0, 1.2 * L), n=6).kind == "none"


def test_two_links_of_the_core_are_isotropic_where_the_elbow_has_its_closed_form():
    """Motor on the elbow, a = 2 c: cos q2 = -c / b; the shoulder does not matter."""
    l1, m2, l2 = 0.3, 1.0, 0.45
    c, b = m2 * l2**2 / 3, m2 * l1 * l2 / 2
    m1 = (2 * c - m2 * l1**2) * 3 / l1**2
    core = Driven(two_link_of_the_core((m1, l1), (m2, l2), (0.2, 2.8)), ("shoulder", "elbow"))
    formula = TwoLink(rod(m1, l1), rod(m2, l2), relative=True)
    assert_allclose(core.inertia(0.4, 0.1), formula.inertia(0.6, 2.9), rtol=1e-7)
    bend = np.arccos(-c / b) - 2.8
    found = isotropic_set(core.inertia, ((-0.2, 0.2), (bend - 0.11, bend + 0.17)), n=6)
    assert found.kind == "curves" and not found.winding.any()
    # the anisotropy is (q2 - bend)^2 / 2, whose round-off leaves the root of a root open
    assert_allclose(found.q[:, 1], bend, atol=1e-6)


def test_two_slides_of_the_core_are_isotropic_at_one_spread():
    rail = linkages.rail_of_the_core(1.3, (MU, REACH), PAYLOAD, 0.9)
    core = Driven(rail, ("left", "right"), tool="tool")
    assert_allclose(core.inertia(0.1, 0.05), GLIDE.inertia(0.1, 0.95), rtol=1e-7)
    assert_allclose(core.tip(0.1, 0.05), GLIDE.tip(0.1, 0.95), atol=1e-9)
    span = ((-0.05, 0.05), (-0.1, 0.1))
    found = isotropic_set(core.inertia, span, n=6, assembles=core.assembles)
    assert found.kind == "curves"
    assert_allclose(0.9 + found.q[:, 1] - found.q[:, 0], SPREAD, atol=1e-7)
    assert core.assembles([0.0, 0.0], [0.0, 0.4]).tolist() == [True, False]  # 1.3 m apart


def test_a_five_bar_of_the_core_has_a_point_of_the_table():
    start = np.array([2.3, 0.8])
    mech = five_bar_of_the_core(start, [(2.0, 0.3)] * 2, [(1.0, 0.8)] * 2, FIVE.posture(*start))
    core = Driven(mech, ("left", "right"), tool="ball")
    found = isotropic_set(core.inertia, ((-0.1, 0.2), (-0.1, 0.15)), n=6)
    assert found.kind == "points" and found.winding.tolist() == [-1]
    assert_allclose(np.degrees(found.q[0] + start), [135.72310, 44.27690], atol=1e-5)
    assert found.inertia[0] == pytest.approx(0.224984, abs=1e-6)
    assert_allclose(core.tip(0.1, 0.05), FIVE.tip(2.4, 0.85), atol=1e-9)


def test_postures_far_from_where_bodies_were_added_are_followed_there():
    """Half a turn and more, where both couplers could also meet on the other side."""
    start = np.array([1.0, 2.2])
    mech = five_bar_of_the_core(start, [(2.0, 0.3)] * 2, [(1.0, 0.8)] * 2, FIVE.posture(*start))
    turns = np.array([[2.9, -2.6], [-3.0, 3.1], [6.2, 0.4]])
    core = Driven(mech, ("left", "right"), tool="ball")
    assert_allclose(core.inertia(*turns.T), FIVE.inertia(*(start + turns).T), rtol=1e-6)
    assert_allclose(core.tip(*turns.T), FIVE.tip(*(start + turns).T), atol=1e-8)
    swapped = Driven(mech, ("right", "left")).inertia(*turns[0, ::-1])
    assert_allclose(swapped, core.inertia(*turns[0])[::-1, ::-1], rtol=1e-6)


def test_mechanisms_of_more_than_two_motions_are_refused():
    mech = two_link_of_the_core((1.0, 0.3), (1.0, 0.4), (0.2, 1.0))
    linkages.ball(mech, "loose", 0.1, (1.0, 1.0))
    core = Driven(mech, ("shoulder", "elbow"))
    refuses(ModelError, "the joints leave 8 motions", core.inertia, 0.1, 0.2)
    assert not core.assembles(0.1, 0.2)


def index_of_the_rail(spread):
    """Energies of the mean and of the difference of both speeds, by hand."""
    cot2 = spread**2 / (4 * REACH**2 - spread**2)
    mean = (2 * 1.3 + 2 * MU + PAYLOAD) / 2
    apart = 1.3 + MU / 3 * (1 + cot2) + PAYLOAD / 2 * cot2
    return 2 * np.sqrt(mean * apart) / (mean + apart)


def test_loci_of_two_slides_run_from_limit_to_limit():
    """The index knows the spread alone: lines of slope one, which end where a stroke does."""
    stroke = ((0.0, 0.3), (0.75, 1.15))
    index = index_map(GLIDE.inertia, stroke, n=60)
    q = np.stack(angle_grid(60, stroke))
    assert_allclose([q[0, 0, 0], q[0, -1, 0], q[1, 0, 0], q[1, 0, -1]], [0, 0.3, 0.75, 1.15])
    assert_allclose(index, index_of_the_rail(q[1] - q[0]), rtol=1e-10)
    level, between = 0.995, ((0.3, SPREAD), (SPREAD, 1.19))
    expected = [brentq(lambda s: index_of_the_rail(s) - level, *ends) for ends in between]
    curves = closed_loci(index, level, stroke)
    assert len(curves) == 2
    spreads = [curve[:, 1] - curve[:, 0] for curve in curves]
    assert_allclose(sorted(np.mean(s) for s in spreads), expected, atol=2e-4)
    for curve, spread in zip(curves, spreads, strict=True):
        assert np.ptp(spread) < 5e-4
        for end in curve[[0, -1]]:
            assert any(np.isclose(end[k], stroke[k], atol=1e-12).any() for k in (0, 1))
        assert np.abs(np.diff(curve, axis=0)).max() <= 0.4 / 59 * (1 + 1e-9)


def test_loci_of_a_polar_arm_close_around_a_turn_of_its_guide():
    L, stroke, level = 0.3, (None, (0.05, 0.6)), 0.97
    index = index_map(ARM.inertia, stroke, lengths=(L, 1.0), n=80)
    ratio = ((2 - level**2 + s * 2 * np.sqrt(1 - level**2)) / level**2 for s in (1, -1))
    expected = [np.sqrt(L**2 * r - 0.06 / 2.0) for r in ratio]
    curves = closed_loci(index, level, stroke)
    assert len(curves) == 2
    for curve in curves:
        assert abs(curve[-1, 0] - curve[0, 0]) == pytest.approx(2 * np.pi, abs=1e-12)
        assert np.ptp(curve[:, 1]) < 1e-9
    assert_allclose(sorted(c[0, 1] for c in curves), sorted(expected), atol=2e-3)


def test_loci_within_a_window_are_those_of_the_torus():
    centre, level = np.radians([225.573, 314.427]), 0.99
    whole = closed_loci(index_map(FIVE.inertia, n=720), level)
    near = min(whole, key=lambda c: np.abs(c.mean(axis=0) - centre).max())
    reach = np.abs(near - centre).max(axis=0)
    wide = [(c - 1.5 * r, c + 1.4 * r) for c, r in zip(centre, reach, strict=True)]
    curves = closed_loci(index_map(FIVE.inertia, tuple(wide), n=80), level, tuple(wide))
    closed = [c for c in curves if np.array_equal(c[0], c[-1])]
    assert len(closed) == 1
    size = 0.5 * np.abs(np.cross(closed[0][:-1] - centre, closed[0][1:] - centre).sum())
    expected = 0.5 * np.abs(np.cross(near[:-1] - centre, near[1:] - centre).sum())
    assert size == pytest.approx(expected, rel=0.02)
    cut = ((centre[0], wide[0][1]), wide[1])
    halves = closed_loci(index_map(FIVE.inertia, cut, n=80), level, cut)
    assert all(np.allclose(end[0], centre[0]) for c in halves for end in c[[0, -1]]
               if np.abs(c - centre).max() < 1.2 * reach.max())  # fmt: skip
    assert not any(np.array_equal(c[0], c[-1]) for c in halves)


NOWHERE = ((0, 0.1), (1.3, 1.5))


def glided(search, *functions, **options):
    return search(GLIDE.inertia, *functions, NOWHERE, assembles=GLIDE.assembles, **options)


def core_of(*drives, **tool):
    return Driven(polar_of_the_core(), drives, **tool)


test_what_is_no_linkage_is_refused = refused(
    (lambda: CrossSlides((1.0, 1.0), angle=np.pi), ModelError, "parallel"),
    (lambda: replace(GLIDE, side=0), ModelError, "needed is 1 or -1"),
    (lambda: GLIDE.inertia(0.0, 1.3), ModelError, "do not meet"),
    (lambda: glided(isotropic_set, n=10), ModelError, "none of 10 by 10"),
    (lambda: glided(tool_isotropy, GLIDE.tip), ModelError, "reaches nothing"),
    (lambda: isotropic_set(ARM.inertia, (None, (1, 1))), ConfigError, "low < high"),
    (
        lambda: tool_isotropy(ARM.inertia, lambda a, s: ARM.tip(0 * a, s), (None, (0.1, 1))),
        ModelError,
        "along a line",
    ),
    (lambda: core_of("turn", "feed", tool="x"), ConfigError, "none of"),
    (lambda: core_of("turn", "feed").tip(0, 0), ConfigError, "no tool"),
    (lambda: core_of("turn", "x"), ConfigError, "x"),
    (lambda: core_of("turn", "feed", "feed"), ConfigError, "must be two"),
    (lambda: core_of("turn"), ConfigError, "must be two"),
)


def eyes(q1, q2):
    return np.tile(np.eye(2), (*np.shape(q1), 1, 1))


test_what_is_no_mechanism_is_named_where_it_is_given = refused(
    (lambda: index_map(lambda a, b: np.eye(2), n=4), r"for arrays of angles .16,. it must"),
    (lambda: index_map(lambda a, b: "a", n=4), "inertia returns 'a'"),
    (lambda: isotropic_set(lambda a, b: 0 * a), "inertia returns"),
    (lambda: closed_loci(np.eye(4), 0.5, (None, (1, 0))), "low < high"),
    (lambda: index_map(eyes, ((0, 0), None), n=4), "low < high"),
    (lambda: closed_loci(np.zeros((0, 0)), 1.0), r"a field \(0, 0\)"),
    (lambda: tool_isotropy(eyes, lambda a, b: a), r"tip returns the shape \(40000,\)"),
    error=(ConfigError, ModelError),
)  # fmt: skip
