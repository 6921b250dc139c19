"""Shapes for pictures are closed, face outwards, and have the volumes of closed forms."""

import numpy as np
import pytest

from cases.long import few
from cases.mbs.drawn import volume
from cases.refusals import refused
from rom import view
from rom.errors import ConfigError
from rom.view.canvas.scene import sharp_edges
from rom.view.canvas.solids import gear_outline

MODULE, WIDTH, ANGLE = 2e-3, 1e-2, np.deg2rad(20.0)
FINE = 2000


def is_closed(mesh):
    """Each edge belongs to two triangles, which run along it in opposite directions."""
    edges = mesh[1][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    directed = {tuple(edge) for edge in edges.tolist()}
    return len(directed) == len(edges) and all((b, a) in directed for a, b in directed)


def involute(angle):
    return np.tan(angle) - angle


def gear_area(teeth, module, angle):
    """Sectors under involutes, tips, roots and the lines between base and root circle.

    Under an involute dA = r^2 d(theta) / 2 with r = r_b / cos(a), theta = tan(a) - a, so that
    A = r_b^2 tan(a)^3 / 6.
    """
    pitch, top, root = (module * (teeth / 2 + x) for x in (0.0, 1.0, -1.25))
    base = pitch * np.cos(angle)
    half = np.pi / (2 * teeth) + involute(angle)
    highest, lowest = np.arccos(base / top), np.arccos(min(1.0, base / max(base, root)))
    tooth = 2 * base**2 / 6 * (np.tan(highest) ** 3 - np.tan(lowest) ** 3)
    tooth += top**2 * (half - involute(highest))
    foot = half - involute(lowest)
    if root < base:
        wider = 0.25 * (np.pi / teeth - foot)
        tooth += base * root * np.sin(wider)
        foot += wider
    return teeth * (tooth + root**2 * (np.pi / teeth - foot))


HELIX_LENGTH = np.hypot(1.0, 4 * np.pi * 0.5)
SHAPES = {
    "box": (view.box((1, 2, 3), (5, 5, 5)), 6.0),
    "cylinder": (view.cylinder((0, 1, 0), (0, 3, 0), 2.0, sides=FINE), 2 * np.pi),
    "ring": (view.ring((1, 0, 0), (1, 0, 2), 1.0, 2.0, sides=FINE), 2 * np.pi * (1 - 0.25)),
    "ellipsoid": (view.ellipsoid((1, 2, 3), (4, 0, 0), sides=200), 8 * np.pi),
    "plate": (view.extruded([(1, -1), (1, 1), (-1, 1), (-1, -1)], 0.5), 2.0),
    "gear": (view.gear(20, MODULE, WIDTH, points=200), WIDTH * gear_area(20, MODULE, ANGLE)),
    "gear whose root is outside its base circle": (
        view.gear(60, MODULE, WIDTH, points=200), WIDTH * gear_area(60, MODULE, ANGLE)),
    "gear with a bore": (
        view.gear(20, MODULE, WIDTH, bore=0.01, points=200),
        WIDTH * (gear_area(20, MODULE, ANGLE) - np.pi * 0.01**2 / 4)),
}  # fmt: skip


@pytest.mark.once
@pytest.mark.parametrize("name", few(2, SHAPES))
def test_solids_are_closed_and_face_outwards(name):
    mesh, expected = SHAPES[name]
    assert is_closed(mesh)
    assert volume(mesh) == pytest.approx(expected, rel=1e-3 if name == "ellipsoid" else 2e-5)


def test_wires_of_coils_and_springs_have_the_volume_of_their_length():
    """Section times length of the helix (Pappus), sections being polygons of 12 sides."""
    mesh = view.coil((0, 0, 0), (0, 0, 1), 0.5, 0.05, turns=4)
    section = 12 / 2 * (0.05 / 2) ** 2 * np.sin(2 * np.pi / 12)
    assert is_closed(mesh)
    assert volume(mesh) == pytest.approx(section * HELIX_LENGTH, rel=0.02)  # chords for arcs
    points = mesh[0]
    assert np.hypot(*points[:, :2].T).max() == pytest.approx(0.275, rel=1e-2)
    assert points[:, 2].min() > -0.05 and points[:, 2].max() < 1.05
    # A quarter of a circle of radius 1: the wire is as long as a helix on a torus
    u = np.linspace(0.0, np.pi / 2, 60)
    line = np.column_stack([np.cos(u), np.sin(u), 0 * u])
    points, triangles = view.wound(line, 0.2, 0.01, turns=8)
    ring = np.linalg.norm(points[:, :2], axis=1) - 1.0
    away = np.hypot(ring, points[:, 2])[:-2]  # from the middle line, without the middles of ends
    assert abs(away - 0.1).max() < 0.0055
    s = np.linspace(0.0, 1.0, 20001)
    turn = 16 * np.pi * s
    around, along = 16 * np.pi * 0.1, np.pi / 2 * (1 + 0.1 * np.cos(turn))
    length = np.hypot(around, along).mean()
    assert abs(volume((points, triangles)) / (np.pi / 4 * 0.01**2 * length) - 1) < 0.06


def test_a_tube_round_a_corner_keeps_its_ends_and_joined_meshes_their_triangles():
    points, triangles = view.tube([(0, 0, 0), (1, 0, 0), (1, 1, 0)], 0.1)
    assert is_closed((points, triangles))
    np.testing.assert_allclose(points[-2:], [(0, 0, 0), (1, 1, 0)])
    one, two = view.box((1, 1, 1)), view.box((1, 1, 2), (5, 0, 0))
    both = view.joined([one, two])
    assert is_closed(both) and volume(both) == pytest.approx(3.0)


def test_teeth_are_half_a_pitch_thick_and_a_bore_shows_its_rim_alone():
    outline = gear_outline(18, MODULE, ANGLE, 2000)
    radius, angle = np.linalg.norm(outline, axis=1), np.arctan2(*outline.T[::-1])
    crossing = np.flatnonzero(np.diff(np.sign(radius - 9 * MODULE)))
    at = np.sort(angle[crossing])
    np.testing.assert_allclose(np.diff(at), np.pi / 18, rtol=2e-3)
    assert np.abs(at).min() == pytest.approx(np.pi / 36, rel=2e-3)  # a space is on the x axis
    assert (radius.max(), radius.min()) == pytest.approx((10 * MODULE, 7.75 * MODULE))
    points, triangles = view.gear(12, MODULE, WIDTH, bore=0.006)
    ends = points[sharp_edges(points, triangles)]
    radii = np.linalg.norm(ends[..., :2], axis=2)
    inner = np.isclose(radii, 0.003)
    assert (inner[:, 0] == inner[:, 1]).all() and inner.any() and not inner.all()


test_shapes_that_cannot_be_are_refused = refused(
    (lambda: view.ring((0, 0, 0), (0, 0, 1), 2.0, 1.0), "a bore of 2 m must be smaller"),
    (lambda: view.ring((0, 0, 1), (0, 0, 1), 1.0, 2.0), "in one place"),
    (lambda: view.tube([(0, 0, 0)], 0.1), "line of a tube = 1 must"),
    (lambda: view.tube([(0, 0, 0)] * 2, 0.1), "in one place"),
    (lambda: view.coil((0, 0, 0), (0, 0, 1), 0.1, 0.2), "a wire of 0.2 m must be thinner"),
    (lambda: view.wound([(0, 0, 0), (0, 0, 0)], 0.2, 0.1), "are in one place"),
    (lambda: view.extruded([(0, 0), (1, 0)], 1.0), "outline = 2 must"),
    (lambda: view.extruded([(1, 0), (0, -1), (-1, 0)], 1.0), "counter-clockwise"),
    (lambda: view.extruded([(1, -1), (1, 1), (-1, 1), (-1, -1)], 1.0, bore=2.0), "bore = 2"),
    (lambda: view.gear(5, 1e-3, 1e-2), "5 teeth of a pressure angle of 20 degrees"),
    (lambda: view.gear(20, 1e-3, 1e-2, pressure_angle=0.7), "40.1.* degrees are pointed"),
    (lambda: view.gear(20, 1e-3, 1e-2, bore=0.02), "bore = 0.02 must be"),
    (lambda: view.bar((0, 0, 0), (1, 0, 0), (0.1, 0.1), (1, 0, 0)), "a direction across the bar"),
    error=ConfigError,
)


def test_a_bar_has_its_section_across_its_length():
    """Volume by the divergence theorem; the broad side lies where it is said to."""
    a, b = np.array([0.1, 0.2, 0.3]), np.array([0.4, 0.6, 0.3])  # 0.5 m long
    points, triangles = view.bar(a, b, (0.06, 0.02), (0, 0, 1))
    assert volume((points, triangles)) == pytest.approx(0.5 * 0.06 * 0.02)
    np.testing.assert_allclose(points.mean(axis=0), (a + b) / 2, atol=1e-15)
    assert np.ptp(points[:, 2]) == pytest.approx(0.06)
    assert np.ptp(points @ (b - a)) == pytest.approx(0.25)
