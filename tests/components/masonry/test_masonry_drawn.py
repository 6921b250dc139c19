"""Stones from gmsh geometries; a vault on buttresses against the statics of its mechanism."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq

import rom
from cases.components.masonry import box
from cases.paths import ROOT
from cases.refusals import refuses
from rom.components.masonry import PointLoad, Rock, drawn, ramp, reduced_stone, simulate, stands
from rom.errors import ConfigError, ModelError
from rom.fe.mesh import read_triangles

pytestmark = pytest.mark.fenicsx
R, T, H = 5.0, 0.8, 4.0


def vault(**parameters):
    mesh = read_triangles(ROOT / "meshes" / "buttressed_vault.geo", parameters=parameters)
    return drawn(mesh.points, mesh.triangles, mesh.surfaces, held=("ground",), rock=Rock())


def test_stones_of_a_vault_are_the_surfaces_with_their_corners():
    plain, fine = vault(), vault(chords=8.0)
    assert len(plain.stones) == 27 and plain.held == (0,)
    assert [len(s.outline) for s in plain.stones] == 27 * [4]
    assert [len(s.outline) for s in fine.stones[1:17]] == 16 * [18]
    for model, chords in ((plain, 1), (fine, 8)):
        sector = np.sin(np.pi / 16 / chords) * 16 * chords / np.pi  # of its area, within chords
        arch = sum(s.M[0, 0] for s in model.stones[1:17])
        assert arch == pytest.approx(2000 * np.pi * R * T * sector, rel=1e-9)
    course = plain.stones[17]
    assert_allclose(course.outline.min(axis=0), [-4.6 - 2.4, 0.0], atol=1e-9)
    assert_allclose(course.outline.max(axis=0), [-4.6, 0.8], atol=1e-9)


def test_a_buttress_tips_at_the_width_that_statics_says():
    """Virtual work of Heyman's mechanism, linear programming, and motion: one width."""
    # half tips about its outer foot: largest thrust at the crown with hinges on the inner face
    Ri, Ro = R - T / 2, R + T / 2
    half, thrust = vault().stones[9:17], 0.0
    W, x = np.array([s.M[0, 0] for s in half]), np.array([s.centre[0] for s in half])
    for k in range(1, 9):
        angle = k * np.pi / 16
        moment = (W[:k] * (Ri * np.sin(angle) - x[:k])).sum()
        thrust = max(thrust, moment / (Ro - Ri * np.cos(angle)))

    def spare(b):
        return (W * (Ri + b - x)).sum() + 2000 * b * H * b / 2 - thrust * (H + Ro)

    b = brentq(spare, 0.1, 5.0)
    assert T < b < 2.4
    assert stands(vault(b=1.0005 * b)) and not stands(vault(b=0.9995 * b))
    for factor, stays in ((1.05, True), (0.95, False)):
        motion = simulate(vault(b=factor * b), t_end=3.0, dt=2e-3, damping=15.0, save_every=1500)
        assert bool(np.abs(motion.v[-1]).max() < 1e-4) is stays


def stones_of(*outlines):
    first = 4 * np.arange(len(outlines))[:, None]
    T = np.hstack([first, first + 1, first + 2, first, first + 2, first + 3]).reshape(-1, 3)
    return np.vstack(outlines), T, {f"stone {k}": [2 * k, 2 * k + 1] for k in range(len(outlines))}


RING = [(0, 1, 5), (0, 5, 4), (1, 2, 6), (1, 6, 5), (2, 3, 7), (2, 7, 6), (3, 0, 4), (3, 4, 7)]


@pytest.mark.parametrize(
    ("drawing", "held", "words"),
    [
        (stones_of(box(), box(at=(0, 1.0))), ("floor",), r"held is 'floor', .* \['stone 0'"),
        (stones_of(box(), box(at=(0, 0.4))), ("stone 0",), "'stone 0' and 'stone 1' overlap"),
        (stones_of(box(), box(at=(0, 0.99))), ("stone 0",), "overlap by 0.01 m"),
        (stones_of(box(), box(at=(0, 1.01))), ("stone 0",),
         "'stone 1' touches no other; the nearest is 0.01 m away"),
        (stones_of(box(), box(at=(0, 3.0))), ("stone 0",), "none is near"),
        ((np.vstack([box(3.0, 3.0), box(at=(1, 1))]), RING, {"ring": range(8)}), (),
         "'ring' of 8 triangles is not one piece without holes: .* 4 of 8 sides"),
        ((*stones_of(box(), box(at=(5, 0)))[:2], {"both": range(4)}), (),
         "'both' of 4 triangles is not one piece"),
        ((*stones_of(box())[:2], {"none": []}), (), "'none' of 0 triangles"),
        ((*stones_of(box())[:2], {"far": [2]}), (), "stone 'far': 2 must be .* 0 to 1"),
        ((box(), [(0, 1, 4)], {"far": [0]}), (), "triangles: 4 must be .* 0 to 3"),
        (stones_of(box()), ("stone 0",), "all stones are held: stone 0; leave one free"),
        (stones_of(box(), box(at=(0, 1.0))), ("stone",), "held: stone 0, stone 1"),
        ((*stones_of(box())[:2], {}), (), "all stones are held: there is none"),
        ((np.ones((4, 3)), [(0, 1, 2)], {"one": [0]}), (), r"points has shape \(4, 3\)"),
        ((box(), [(0, 1, 2, 3)], {"one": [0]}), (), r"triangles has shape \(1, 4\)"),
        ((box(), [(0, 1, 2)], {"one": [0.5]}), (), "'one': 0.5 must be a whole number"),
    ],
)  # fmt: skip
def test_drawings_that_are_no_masonry_are_named(drawing, held, words):
    refuses((ConfigError, ModelError), words, drawn, *drawing, held=held)


@pytest.mark.parametrize("k", [1, 8])
def test_a_voussoir_in_space_takes_the_place_of_a_drawn_one(k):
    drawing, rock = vault(), Rock()
    sizes = {"k": float(k), "n_across": 3.0, "n_along": 3.0, "n_deep": 1.0}
    material, file = rom.Material(rock.E, rock.nu, rock.rho), ROOT / "meshes" / "voussoir.geo"
    solid = rom.fe.model(file, material=material, parameters=sizes)
    assert solid.mass() == pytest.approx(drawing.stones[k].M[0, 0], rel=1e-9)
    joints = {"left": "rbe3", "right": "rbe3"}
    assert set(joints) < set(solid.interfaces)
    body = rom.reduce(solid, method=rom.CraigBampton(8), interfaces=joints, certify=False)
    fine = reduced_stone(body, drawing.stones[k].outline)
    assert_allclose(fine.M[:3, :3], drawing.stones[k].M[:3, :3], rtol=1e-2, atol=1e-6)
    assert_allclose(fine.centre, drawing.stones[k].centre, atol=1e-9)
    mixed = replace(drawing, stones=(*drawing.stones[:k], fine, *drawing.stones[k + 1 :]))
    load = PointLoad(8, (0.0, H + R + T / 2), (0.0, -20e3), ramp(0.5))
    run = {"t_end": 2.0, "dt": 2e-3, "damping": 15.0, "save_every": 1000, "actions": [load]}
    one, other = (simulate(model, **run) for model in (drawing, mixed))
    assert np.abs(other.v[-1]).max() < 1e-6
    left = (k - 1, k) if k > 1 else (1, 21)
    carried = [motion.joints()[left][1][1] for motion in (one, other)]
    assert carried[1] == pytest.approx(carried[0], rel=1e-2)
    sag = [motion.q[-1, 8, 1] - motion.q[0, 8, 1] for motion in (one, other)]
    assert sag[1] == pytest.approx(sag[0], rel=0.3) and sag[0] < -1e-5


@pytest.mark.parametrize(("aside", "corners"), [(0.0, 4), (2e-7, 4), (-2e-7, 4), (2e-5, 5)])
def test_a_node_aside_of_a_side_by_round_off_is_no_corner(aside, corners):
    """A node in the middle of the lower side of 1 m: its turn is four times how far it lies off."""
    points = np.vstack([box(), [[0.5, -aside]], box(at=(0.0, 1.0))])
    triangles = [(0, 4, 3), (4, 2, 3), (4, 1, 2), (5, 6, 7), (5, 7, 8)]
    stones = {"stone": [0, 1, 2], "ceiling": [3, 4]}
    model = drawn(points, triangles, stones, held=("ceiling",))
    assert len(model.stones[0].outline) == corners
