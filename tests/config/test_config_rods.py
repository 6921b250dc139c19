"""Rods of a mechanism file: sections and curves in closed form, deflections of the elastica."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.beam import elastica
from cases.refusals import refuses
from rom import rotation
from rom.components.cosserat.bodies import body, shape_of
from rom.components.cosserat.shapes import straight

STEEL = 'material = { E = "210 GPa", nu = 0.3, rho = "7850 kg/m^3" }\n'
E, NU, RHO = 210e9, 0.3, 7850.0
G = E / 2 / (1 + NU)


def file_of(tmp_path, rod, more="", gravity="[0, 0, 0]", t_end=1.0, dt=0.01):
    text = f"gravity = {gravity}\n[rods.wire]\n{rod}\n{more}\n"
    (tmp_path / "w.toml").write_text(text + f"[simulation]\nt_end = {t_end}\ndt = {dt}\n")
    return rom.read_mechanism(tmp_path / "w.toml")


def rod_of(tmp_path, section, points="[[0, 0, 0], [2, 0, 0]]", more=STEEL):
    made = file_of(tmp_path, f"points = {points}\nsection = {section}\n{more}").mechanism()
    return made.nonlinear["wire"].body


CLAMP = """
[joints.clamp]
kind = "fixed"
between = [{ ground = [0, 0, 0] }, "wire.start"]
[forces.tip]
marker = "wire.end"
vector = [0, 0, 4]
"""
LATH = """
points = [[0, 0, 0], ["1 m", 0, 0]]
section.kind = "numbers"
section.stretch = [1e7, 1e7, 1e7]
section.bend = [1, 1, 1]
section.mass = 1
section.inertia = [1e-4, 1e-4, 2e-4]
elements = 80
"""


def test_a_lath_bends_as_the_elastica(tmp_path):
    made = file_of(tmp_path, LATH, CLAMP).mechanism()
    state = rom.equilibrium(made)
    sol = rom.simulate(made, t_end=1e-6, dt=1e-6, state=state)
    tip = sol.position("wire.81")[0]
    wanted = elastica(4.0)[1:]
    assert_allclose(wanted, [1 - 0.32894, 0.66996], atol=2e-5)  # as published by Mattiasson, 1981
    assert_allclose([tip[0], tip[2]], wanted, atol=3e-4)


def test_a_rod_of_a_file_is_that_of_python(tmp_path):
    rod = (
        LATH.replace("80", "8").replace("1e7", "1e4")
        + 'viscosity = "2 ms"\nat = [0, 0, "5 cm"]\nnormal = [0, 1, 0]\n'
    )
    more = CLAMP.replace('"wire.start"', '"wire.0"').replace("[0, 0, 0] }", "[0, 0, 0.05] }")
    how = {"gravity": '[0, 0, "-9.81 m/s^2"]', "t_end": 0.1, "dt": 2e-3}
    sol = file_of(tmp_path, rod, more, **how).simulate()
    frame = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    same = straight(1.0, 8, frame=frame, stretch=1e4, bend=1.0, mass=1.0, viscosity=2e-3,
                    inertia=(1e-4, 1e-4, 2e-4))  # fmt: skip
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    part = mech.add_nonlinear("wire", body(same), at=(0, 0, 0.05))
    mech.fixed("clamp", mech.ground.marker((0, 0, 0.05)), part.marker("start"))
    mech.force("tip", part.marker("end"), (0, 0, 4))
    other = rom.simulate(mech, t_end=0.1, dt=2e-3)
    assert_allclose(shape_of(sol, "wire").x, shape_of(other, "wire").x, atol=1e-8)
    assert np.abs(shape_of(sol, "wire").x[-1, 2] - 0.05) > 0.01


def torsion_of_a_rectangle(a, b):
    """J by its series in the other form, Timoshenko and Goodier, eq. 162: k1 a b^3."""
    n = np.arange(1, 2001, 2)
    series = (np.tanh(n * np.pi * a / 2 / b) / n**5).sum()
    return a * b**3 / 3 * (1 - 192 * b / np.pi**5 / a * series)


def test_sections_have_their_areas_moments_and_published_torsion(tmp_path):
    d, w = 0.02, 0.003
    for section, inner in (
        ('{ kind = "circle", diameter = "20 mm" }', 0.0),
        ('{ kind = "tube", diameter = "20 mm", thickness = "3 mm" }', d - 2 * w),
        ('{ kind = "tube", diameter = "20 mm", thickness = "10 mm" }', 0.0),
    ):
        found = rod_of(tmp_path, section)
        area, moment = np.pi * (d**2 - inner**2) / 4, np.pi * (d**4 - inner**4) / 64
        assert_allclose(found.rod.bend[0], [E * moment, E * moment, 2 * G * moment])
        assert_allclose(found.rod.stretch[0, 2], E * area)
        assert_allclose(found.frames.mass.sum(), RHO * area * 2.0)
        turning = RHO * moment * 2.0 * np.array([1, 1, 2])
        assert_allclose(found.frames.inertia.sum(axis=0), turning)
    shear = rod_of(tmp_path, '{ kind = "circle", diameter = 0.02 }').rod.stretch[0, 0]
    assert_allclose(shear / G / (np.pi * d**2 / 4), 6 * 1.3 / (7 + 1.8))  # Cowper, 1966
    thin = rod_of(tmp_path, '{ kind = "tube", diameter = 1, thickness = 1e-4 }').rod.stretch[0]
    assert_allclose(thin[0] * E / thin[2] / G, 2 * 1.3 / (4 + 0.9), rtol=1e-6)
    # 0.1406 of the fourth power of its side; 0.229 b^3 a at 2 : 1 (Timoshenko, Goodier)
    for width, height, factor in ((0.1, 0.1, 0.1406), (0.2, 0.1, 0.229), (0.1, 0.2, 0.229)):
        section = f'{{ kind = "rectangle", width = {width}, height = {height} }}'
        bend = rod_of(tmp_path, section).rod.bend[0]
        long, short = max(width, height), min(width, height)
        assert_allclose(bend[2] / G, factor * long * short**3, rtol=2e-3)
        assert_allclose(bend[2] / G, torsion_of_a_rectangle(long, short), rtol=1e-8)
        assert_allclose(bend[:2], [E * width * height**3 / 12, E * height * width**3 / 12])


def test_points_make_arcs_and_helices_whose_sections_turn_least(tmp_path):
    angles = np.linspace(0, np.pi / 2, 13)
    points = [[float(np.sin(a)), float(1 - np.cos(a)), 0.0] for a in angles]
    found = rod_of(tmp_path, '{ kind = "circle", diameter = 0.01 }', str(points),
                   STEEL + "normal = [0, 0, 3]\nelements = 30\n").rod  # fmt: skip
    chord = 2 * np.sin(np.pi / 120)
    assert_allclose(found.h, chord, rtol=1e-4)
    assert_allclose(found.x[[0, -1]], [[0, 0, 0], [1, 1, 0]], atol=1e-14)
    assert_allclose(np.hypot(found.x[:, 0], found.x[:, 1] - 1), 1.0, atol=1e-5)
    frames = np.array([rotation.matrix(p) for p in found.p])
    assert_allclose(frames[:, :, 0], np.tile([0.0, 0, 1], (32, 1)), atol=1e-12)
    assert_allclose(frames[[0, -1], :, 2], [[1, 0, 0], [0, 1, 0]], atol=5e-4)
    middle = np.pi / 60 * (np.arange(30) + 0.5)
    assert_allclose(frames[1:-1, :2, 2].T, [np.cos(middle), np.sin(middle)], atol=1e-3)
    # Frames that turn least stay behind the normal of the helix by torsion times length
    R, h = 1.0, 0.5
    turns = np.linspace(0, 2 * np.pi, 60)
    points = [[R * float(np.cos(a)), R * float(np.sin(a)), h * float(a)] for a in turns]
    found = rod_of(tmp_path, '{ kind = "circle", diameter = 0.01 }', str(points),
                   STEEL + "normal = [-1, 0, 0]\nelements = 200\n").rod  # fmt: skip
    last, size = rotation.matrix(found.p[-1]), np.hypot(R, h)
    assert_allclose(last[:, 2], [0, R / size, h / size], atol=1e-3)
    normal = np.array([-1.0, 0, 0])
    turn = np.arctan2(last[:, 1] @ normal, last[:, 0] @ normal)
    torsion = h / size**2 * 2 * np.pi * size
    assert_allclose(turn, torsion - 2 * np.pi * round(torsion / 2 / np.pi), atol=2e-3)


ROUND = 'points = [[0, 0, 0], [1, 0, 0]]\nsection = { kind = "circle", diameter = 0.01 }\n'
MISTAKES = {
    "one point": ("[[0, 0, 0]]", "[[0, 0, 0], [1, 0, 0]]", "1 points must be 2 to"),
    "two points in one": ("[[0, 0, 0], [1, 0, 0], [1, 0, 0]]", "[[0, 0, 0], [1, 0, 0]]",
                          "points 1 and 2 are one"),
    "sharp bend": ("[[0, 0, 0], [1, 0, 0], [0, 0.01, 0]]", "[[0, 0, 0], [1, 0, 0]]",
                   "turns back on itself. Take more elements"),
    "thick wall": ('kind = "tube", thickness = 0.006', 'kind = "circle"', "more than the radius"),
    "no material": ("", STEEL, "a section of kind circle needs a material"),
    "normal along": (STEEL + "normal = [2, 0, 0]\n", STEEL, "must not lie along the rod"),
}  # fmt: skip


@pytest.mark.parametrize("case", MISTAKES)
def test_a_mistake_of_a_rod_is_told_with_file_and_line(case, tmp_path):
    new, old, message = MISTAKES[case]
    assert old in ROUND + STEEL
    with pytest.raises(rom.RomError) as refused:
        file_of(tmp_path, (ROUND + STEEL).replace(old, new) + "\nat = [0, 0, 0]").mechanism()
    assert message in str(refused.value) and "w.toml:" in refused.value.where


def test_a_marker_that_no_rod_has_is_told(tmp_path):
    for marker, message in (
        ('"wire.tip"', "body 'wire' has no marker 'tip'"),
        ('"wire.22"', "body 'wire' has no marker '22'"),
        ("{ wire = [0, 0, 0] }", "rod 'wire' has no points of its own"),
    ):
        made = file_of(tmp_path, ROUND + STEEL, CLAMP.replace('"wire.end"', marker)).mechanism
        refuses(rom.RomError, message, made)
