"""The geometries in meshes/: volumes in closed form, bores in place, names, parameter ranges."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.long import ROM_LONG
from cases.measures import areas, volume
from cases.paths import ROOT
from cases.refusals import refuses
from rom.errors import ConfigError
from rom.fe.mesh.read import read_mesh

pytestmark = pytest.mark.fenicsx
MESHES = ROOT / "meshes"
ROD = {
    "L": 0.2, "d_a": 0.030, "D_a": 0.046, "t_a": 0.020, "d_b": 0.016, "D_b": 0.026, "t_b": 0.016,
    "h_a": 0.024, "h_b": 0.016, "w": 0.012, "t_web": 0.004, "t_flange": 0.003, "R": 0.006,
}  # fmt: skip


def rod_thickness(x, y, p):
    """Thickness of the rod along z at (x, y), from its description, not from its geometry file."""
    y = np.abs(y)
    slope = (p["h_b"] - p["h_a"]) / 2 / p["L"]
    n = np.hypot(1.0, slope)
    edge = p["h_a"] / 2 + slope * x
    r_a, r_b = np.hypot(x, y), np.hypot(x - p["L"], y)
    between = (x > 0) & (x < p["L"])
    # a ball of radius R rolling outside along edge and eye leaves the fillet below it
    fillet = np.zeros_like(between)
    for r, D, sign, x0 in ((r_a, p["D_a"], 1, 0.0), (r_b, p["D_b"], -1, p["L"])):
        cx, cy = rolling_centre(p, D, sign, x0, slope, n)
        foot = cx + p["R"] * slope / n
        inside = (np.minimum(x0, foot) < x) & (x < np.maximum(x0, foot)) & between
        below = y < cy + (x - cx) * cy / (cx - x0)  # beyond the line of centres lies the eye
        fillet |= inside & below & (np.hypot(x - cx, y - cy) > p["R"]) & (y < cy) & (r > D / 2)
    shank = between & ((y < edge) | fillet)
    t = np.where(shank, p["w"], 0.0)
    t = np.where(shank & in_pocket(x, y, p, slope, n), p["t_web"], t)
    t = np.where(r_b < p["D_b"] / 2, p["t_b"], t)
    t = np.where(r_a < p["D_a"] / 2, p["t_a"], t)
    return np.where((r_a < p["d_a"] / 2) | (r_b < p["d_b"] / 2), 0.0, t)


def rolling_centre(p, D, sign, x0, slope, n):
    """Centre of the ball that touches the upper edge and the eye about x0, by bisection."""
    height = lambda x: p["h_a"] / 2 + slope * x + p["R"] * n  # noqa: E731
    a, b = x0, x0 + sign * p["L"] / 2
    for _ in range(100):
        c = (a + b) / 2
        a, b = (c, b) if np.hypot(c - x0, height(c)) < D / 2 + p["R"] else (a, c)
    return c, height(c)


def in_pocket(x, y, p, slope, n):
    """Trapezium between the flanges with corners rounded to the radius of the pocket."""
    x1, x2 = p["D_a"] / 2 + p["R"], p["L"] - p["D_b"] / 2 - p["R"]
    top = lambda x: p["h_a"] / 2 + slope * x - p["t_flange"] * n  # noqa: E731
    radius = min(p["R"], 0.9 * top(x2))
    # distance to the trapezium shrunk by the radius
    a, b = x1 + radius, x2 - radius
    along = np.maximum(np.maximum(a - x, x - b), 0.0)
    across = np.maximum(y - (top(np.clip(x, a, b)) - radius * n), 0.0)
    inside = (along == 0.0) | (across == 0.0) | (np.hypot(along, across) < radius)
    return (x > x1) & (x < x2) & (y < top(x)) & inside


@pytest.mark.parametrize("change", [{}, {"L": 0.15, "h_b": 0.020, "R": 0.004, "t_web": 0.006}])
def test_volume_of_the_rod_agrees_with_its_description(change):
    p = ROD | change
    mesh = read_mesh(MESHES / "connecting_rod.geo", parameters=p | {"lc": 0.004}, order=2)
    x = np.linspace(-p["D_a"] / 2, p["L"] + p["D_b"] / 2, 6001)[1::2]
    y = np.linspace(0.0, p["D_a"] / 2, 2001)[1::2]
    t = rod_thickness(*np.meshgrid(x, y, indexing="ij"), p)
    assert volume(mesh) == pytest.approx(2 * t.sum() * (x[1] - x[0]) * (y[1] - y[0]), rel=1e-3)


def test_the_rod_has_cylindrical_bores_fillets_and_pockets():
    p, mesh = ROD, read_mesh(MESHES / "connecting_rod.geo")
    for name, x, d, t in (("pin_a", 0.0, 0.030, 0.020), ("pin_b", 0.2, 0.016, 0.016)):
        points = mesh.points[np.unique(mesh.facets[name])]
        assert_allclose(np.hypot(points[:, 0] - x, points[:, 1]), d / 2, rtol=1e-8)
        assert_allclose((points[:, 2].min(), points[:, 2].max()), (-t / 2, t / 2), rtol=1e-8)
        assert areas(mesh)[name] == pytest.approx(np.pi * d * t, rel=0.04)
    assert mesh.region_names == {1: "body"}
    slope = (p["h_b"] - p["h_a"]) / 2 / p["L"]
    for D, sign, x0 in ((p["D_a"], 1, 0.0), (p["D_b"], -1, p["L"])):
        cx, cy = rolling_centre(p, D, sign, x0, slope, np.hypot(1.0, slope))
        for side in (1, -1):
            r = np.hypot(mesh.points[:, 0] - cx, mesh.points[:, 1] - side * cy)
            assert (np.abs(r - p["R"]) < 1e-8).sum() > 6
            assert r.min() > p["R"] - 1e-8
    middle = (mesh.points[:, 0] > 0.05) & (mesh.points[:, 0] < 0.15)
    web = middle & (np.abs(mesh.points[:, 1]) < 0.004)
    assert_allclose(np.unique(np.abs(mesh.points[web, 2]).round(9)).max(), p["t_web"] / 2)


def test_volume_of_the_crank_is_that_of_hull_and_cylinders():
    r, R1, R2, t = 0.04, 0.028, 0.022, 0.014
    phi = np.arcsin((R1 - R2) / r)
    hull = (np.pi / 2 + phi) * R1**2 + (np.pi / 2 - phi) * R2**2 + r * np.cos(phi) * (R1 + R2)
    exact = hull * t + np.pi / 4 * (0.036**2 * 0.05 + 0.03**2 * 0.026)
    mesh = read_mesh(MESHES / "crank.geo", order=2)
    assert volume(mesh) == pytest.approx(exact, rel=2e-4)
    shaft, pin = (mesh.points[np.unique(mesh.facets[n])] for n in ("shaft", "pin"))
    assert_allclose(shaft[:, 2], -0.064)
    assert np.hypot(*shaft[:, :2].T).max() == pytest.approx(0.018)
    assert_allclose(np.hypot(pin[:, 0] - r, pin[:, 1]), 0.015)
    assert_allclose((pin[:, 2].min(), pin[:, 2].max()), (0.0, 0.026), atol=1e-12)


@pytest.mark.long
def test_parts_of_the_frame_meet_in_their_nodes_and_fill_the_whole():
    file = MESHES / "frame.geo"
    whole, left, beam, right = (read_mesh(file, parameters={"part": part}) for part in range(4))
    assert sum(map(volume, (left, beam, right))) == pytest.approx(volume(whole), rel=1e-9)
    exact = 2 * np.pi * 0.02**2 * 0.25 + 0.47 * 0.07 * 0.05
    assert volume(whole) == pytest.approx(exact, rel=3e-4)
    for column, bore, x in ((left, "bore_left", 0.0), (right, "bore_right", 0.4)):
        seat = column.points[np.unique(column.facets["seat"])]
        hole = beam.points[np.unique(beam.facets[bore])]
        assert_allclose(np.hypot(seat[:, 0] - x, seat[:, 1]), 0.02, rtol=1e-9)
        assert_allclose(*(y[np.lexsort(y.T.round(9))] for y in (seat, hole)), atol=1e-12)
        assert_allclose((seat[:, 2].min(), seat[:, 2].max()), (0.25, 0.3))
        assert (column.points[np.unique(column.facets["foot"]), 2] == 0.0).all()
        assert areas(column)["seat"] == pytest.approx(areas(beam)[bore], rel=1e-12)
    other = read_mesh(file, parameters={"part": 3, "n_right": 6, "n_along": 5})
    assert np.unique(other.facets["seat"][:, :3]).size == 12 * 6


@pytest.mark.parametrize("hexahedra", [0, 1])
def test_beam_is_a_box_with_two_ends(hexahedra):
    p = {"L": 0.7, "b": 0.04, "h": 0.1, "hex": hexahedra, "nx": 5, "ny": 3, "nz": 1}
    mesh = read_mesh(MESHES / "beam.geo", parameters=p)
    assert volume(mesh) == pytest.approx(0.7 * 0.04 * 0.1, rel=1e-12)
    assert (mesh.points[mesh.facets["root"], 0] == 0.0).all()
    assert_allclose(mesh.points[mesh.facets["tip"], 0], 0.7)
    if hexahedra:
        assert len(mesh.cells) == 5 * 3 * 1 and len(mesh.facets["root"]) == 3 * 1


@pytest.mark.parametrize("seed", range(8 if ROM_LONG else 3))
def test_the_rod_meshes_over_its_range(seed):
    """Within a third of the default, in proportion where dimensions must be."""
    rng = np.random.default_rng(seed)
    p = {name: value * rng.uniform(0.75, 1.33) for name, value in ROD.items()}
    for eye in "ab":
        p[f"d_{eye}"] = min(p[f"d_{eye}"], 0.8 * p[f"D_{eye}"])
        p[f"h_{eye}"] = min(p[f"h_{eye}"], 0.8 * p[f"D_{eye}"])
    p["w"] = min(p["w"], p["t_a"], p["t_b"])
    size = {"lc": 0.0055 * rng.uniform(0.9, 1.4)}
    mesh = read_mesh(MESHES / "connecting_rod.geo", parameters=p | size)
    assert set(mesh.facets) == {"pin_a", "pin_b"}


BLADE = {
    "span": 0.12, "chord_root": 0.045, "chord_tip": 0.04, "t_root": 0.0045, "t_tip": 0.0024,
    "t_edge": 0.001, "stagger": 20.0, "twist": 30.0, "camber": 30.0, "l_platform": 0.052,
    "w_platform": 0.032, "t_platform": 0.005, "l_root": 0.044, "w_neck": 0.012, "h_neck": 0.004,
    "w_dovetail": 0.024, "h_foot": 0.004, "beta": 50.0,
}  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("seed", range(5 if ROM_LONG else 2))
def test_the_blade_meshes_over_its_range(seed):
    """Parabolic profiles with blunt edges, platform, dovetail; fillets add nothing."""
    rng = np.random.default_rng(seed)
    p = {name: value * rng.uniform(0.85, 1.2) for name, value in BLADE.items()}
    p["l_platform"] = max(p["l_platform"], 1.2 * p["chord_root"], p["l_root"])
    p["w_platform"] = max(p["w_platform"], 0.8 * p["chord_root"], p["w_dovetail"])
    sizes = {"lc": 0.008, "lc_flank": 0.003, "sections": float(rng.integers(3, 8))}
    mesh = read_mesh(MESHES / "compressor_blade.geo", parameters=p | sizes)
    assert set(mesh.facets) == {"flank_left", "flank_right"}
    assert not mesh.warnings
    z = np.linspace(0.0, 1.0, 2001)[1::2]
    chord, t = (p[f"{a}_root"] + (p[f"{a}_tip"] - p[f"{a}_root"]) * z for a in ("chord", "t"))
    airfoil = p["span"] * (chord * (p["t_edge"] + 2 / 3 * (t - p["t_edge"]))).mean()
    depth = (p["w_dovetail"] - p["w_neck"]) / 2 / np.tan(np.radians(p["beta"]))
    root = p["w_neck"] * (p["h_neck"] + depth / 2) + p["w_dovetail"] * (p["h_foot"] + depth / 2)
    exact = airfoil + p["l_platform"] * p["w_platform"] * p["t_platform"] + p["l_root"] * root
    assert volume(mesh) == pytest.approx(exact, rel=4e-3)
    top, bottom = mesh.points[:, 2].max(), mesh.points[:, 2].min()
    foot = p["t_platform"] + p["h_neck"] + depth + p["h_foot"]
    assert_allclose((top, -bottom), (p["span"], foot), rtol=1e-9)


def test_the_hub_of_a_turbine_is_a_hollow_sphere_without_four_caps():
    """Volume of shells and caps in closed form; rings as wide as the wall leaves them."""
    mesh = read_mesh(MESHES / "turbine_hub.geo", parameters={"lc": 0.6}, order=2)
    R, t = np.hypot(1.5, 3.542 / 2), 0.16
    at = np.array([1.5, 1.5, 1.5, 1.95])
    caps = [np.pi / 3 * (r - at) ** 2 * (2 * r + at) for r in (R, R - t)]
    shell = 4 / 3 * np.pi * (R**3 - (R - t) ** 3) - np.sum(caps[0] - caps[1])
    assert_allclose(volume(mesh), shell, rtol=2e-3)


@pytest.mark.parametrize("L", [0.018, 0.010])
def test_the_phalanx_is_a_round_edged_cylinder_with_a_bore(L):
    """Edges after Pappus, plates without the bore, pad on the side of the palm."""
    D, R, d, e, l_pad, w_pad = 0.014, 0.00125, 0.0015, 0.0045, 0.005, 0.006
    mesh = read_mesh(MESHES / "phalanx.geo", parameters={"L": L}, order=2)
    a = D / 2 - R
    rim = np.pi * (a**2 * R + a * np.pi * R**2 / 2 + 2 * R**3 / 3)
    exact = np.pi * D**2 / 4 * (L - 2 * R) + 2 * rim - np.pi * d**2 / 4 * L
    assert volume(mesh) == pytest.approx(exact, rel=1.5e-3)
    ends = [mesh.points[np.unique(mesh.facets[name])] for name in ("proximal", "distal")]
    for points, z in zip(ends, (0.0, L), strict=True):
        assert_allclose(points[:, 2], z, atol=1e-12)
        assert np.hypot(*points[:, :2].T).max() == pytest.approx(a)
        assert np.hypot(points[:, 0] - e, points[:, 1]).min() == pytest.approx(d / 2)
    pad = mesh.points[np.unique(mesh.facets["pad"])]
    assert_allclose(np.hypot(pad[:, 0], pad[:, 1]), D / 2)
    assert_allclose((pad[:, 2].min(), pad[:, 2].max()), (L - 0.00725, L - 0.00225))
    assert_allclose(np.abs(pad[:, 1]).max(), w_pad / 2)
    assert pad[:, 0].min() > 0
    assert areas(mesh)["pad"] == pytest.approx(D * np.arcsin(w_pad / D) * l_pad, rel=0.01)
    assert 3 * len(mesh.points) < 12_000


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


IMPOSSIBLE = [
    ("connecting_rod", {"d_a": 0.05}, "d_a = 0.05 < D_a = 0.046"),
    ("connecting_rod", {"h_b": 0.03}, "h_b = 0.03 < D_b = 0.026"),
    ("connecting_rod", {"t_web": 0.02}, "t_web = 0.02 < w = 0.012"),
    ("connecting_rod", {"t_flange": 0.01}, "flanges of 0.01"),
    ("connecting_rod", {"L": 0.04}, "L = 0.04"),
    ("compressor_blade", {"sections": 1}, "sections = 1"),
    ("compressor_blade", {"t_edge": 0.003}, "t_edge = 0.003 < t_tip = 0.0024"),
    ("compressor_blade", {"camber": 90}, "camber = 90"),
    ("compressor_blade", {"beta": 80}, "beta = 80"),
    ("compressor_blade", {"chord_root": 0.06}, "over the platform of l_platform = 0.052"),
    ("compressor_blade", {"w_neck": 0.03}, "w_neck = 0.03 < w_dovetail = 0.024"),
    ("compressor_blade", {"R": 0.006}, "R = 0.006"),
    ("compressor_blade", {"crown": 0.005}, "crown = 0.005"),
    ("crank", {"d_pin": 0.05}, "d_pin = 0.05"),
    ("crank", {"r": 0.005}, "r = 0.005"),
    ("turbine_hub", {"t": 0.9}, "a wall of 0.9 leaves no rings"),
    ("phalanx", {"D": 0.012}, "radius D / 2 - R = 0.00475"),
    ("phalanx", {"w_pad": 0.02}, "w_pad = 0.02"),
    ("phalanx", {"L": 0.008}, "L = 0.008"),
    ("gear_shaft", SHAFT | {"z_2": 0.16}, "the wheels at z_w = 0.12 and z_2 = 0.16 overlap"),
    ("gear_shaft", SHAFT | {"D_2": 0.03}, "thinner than the shaft"),
    ("gear_shaft", SHAFT | {"z_2": 0.33}, "must lie apart"),
    ("gear_shaft", {"z_w": 0.06}, "must lie apart"),
    ("gallery_slab", {"patch": 4.0}, "patch = 4 < B = 3.5"),
    ("housing", STAGES | {"a": 0.07}, "the seats overlap: shafts 0.07 apart"),
    ("housing", STAGES | {"L": 0.36}, "seats do not fit"),
    ("carrier", {"n": 2.5}, "n = 2.5: a carrier needs a whole number"),
    ("carrier", {"a": 0.06}, "3 pins of d_p = 0.02 at a = 0.06 do not fit"),
    ("carrier", {"z_f": 0.03}, "z_f = 0.03 and z_b = 0.1 do not fit on the shaft"),
    ("bladed_disk", {"N": 7.5}, "whole number of sectors"),
    ("bladed_disk", {"r_rim": 0.3}, "r_rim = 0.3"),
    ("bladed_disk", {"chord": 0.05}, "foot of the blade"),
    ("rotor", {"N": 7.5}, "whole number of sectors"),
    ("rotor", {"d": 0.3}, "d = 0.3 < d_1 = 0.28"),
    ("rotor", {"w": 0.5}, "discs of width w = 0.5"),
]


@pytest.mark.parametrize(("name", "parameters", "culprit"), IMPOSSIBLE)
def test_impossible_dimensions_are_named(name, parameters, culprit):
    file = MESHES / f"{name}.geo"
    refuses(ConfigError, re.escape(culprit), read_mesh, file, parameters=parameters)
