"""Faces with their labels: each is seen from one of two opposite sides, and labels can be read."""

import numpy as np
import pytest

pytest.importorskip("pyvista", reason="pictures need pyvista")
pytest.importorskip("matplotlib", reason="pictures need matplotlib")

from cases.refusals import refuses
from rom import view
from rom.errors import ConfigError
from rom.view.canvas.scene import aimed
from rom.view.scenes import faces as scene

SIZE = (0.3, 0.2, 0.1)


def box_patches():
    points, triangles = view.box(SIZE)
    at = points[triangles]
    return points, {
        f"{'xyz'[k]}{'+-'[sign < 0]}": triangles[(sign * at[..., k] > 0).all(axis=1)]
        for k in range(3)
        for sign in (-1, 1)
    }


def test_a_box_shows_three_faces_to_each_side():
    points, patches = box_patches()
    camera = aimed(points, 200)
    both = np.stack([points, scene._turned(points, camera)])
    spots = [scene._spots(n, list(patches)) for n in scene._numbers(both, patches, camera)]
    seen = [{spot.label for spot in side} for side in spots]
    toward = {"xyz"[k] + ("-" if camera.toward[k] < 0 else "+") for k in range(3)}
    assert seen == [toward, set(patches) - toward]
    right = np.cross(camera.up, camera.toward)
    for spot in spots[0]:  # in the middle of the face as it is projected, columns to the right
        middle = points[np.unique(patches[spot.label])].mean(axis=0) - camera.focus
        pixel = camera.size[1] / camera.height * np.array([middle @ right, -middle @ camera.up])
        wanted = pixel + 0.5 * np.array(camera.size)
        assert np.linalg.norm(wanted - spot.at) < 0.2 * spot.room + 3


def test_labels_do_not_cover_each_other_and_stay_in_the_picture():
    spots = [scene.Spot(str(k), (50 + k % 4, 50 + k // 4), 3.0) for k in range(12)]
    spots.append(scene.Spot("edge", (399, 1), 3.0))
    placed = scene._placed(spots, (400, 300))
    assert {spot.label for spot, _ in placed} == {spot.label for spot in spots}
    boxes = []
    for spot, (x, y) in placed:
        wide = scene.LETTER_SIZE[0] * len(spot.label)
        a = x - wide / 2, y - 10, x + wide / 2, y + 10
        assert a[0] >= 0 and a[1] >= 0 and a[2] <= 400 and a[3] <= 300
        assert not any(a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3] for b in boxes)
        boxes.append(a)


def test_what_is_hidden_is_named_below_and_without_faces_there_is_no_picture():
    points, patches = box_patches()
    spot = scene.Spot("x+", (0, 0), 5.0)
    words = scene._words(points, patches | {"": patches["x-"]}, [[(spot, (0, 0))], []])
    assert "300 mm x 200 mm x 100 mm" in words
    assert words.endswith("Not seen, or too small: x-, y+, y-, z+, z-.")
    refuses(ConfigError, "no face to draw", view.faces, points, {"a": np.zeros((0, 3), dtype=int)})
