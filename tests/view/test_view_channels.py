"""Plans and tests on their bodies: where a channel points, and how far off it was given."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rom import view
from rom.errors import ConfigError

BOX = view.box((1.0, 0.1, 0.08))


def test_a_bar_points_along_its_channel():
    """From its point, nine hundredths of the body long; what lies on the surface has no gap."""
    x = BOX[0][[0]]
    scene = view.channels(BOX, {"sensors": (x, [[0, 3, 4]])}, title="plan")
    assert list(scene.things) == ["body", "sensors"]
    points = scene.things["sensors"][0] - x
    along = points @ [0, 0.6, 0.8]
    assert_allclose(along.max(), 0.09, rtol=1e-6)
    far = points[along > 0.05]
    assert np.linalg.norm(far - along[along > 0.05, None] * [0, 0.6, 0.8], axis=1).max() < 0.005


def test_a_point_off_the_body_is_led_to_the_one_that_is_taken():
    x = BOX[0][[1]] + [0.0, 0.0, 0.2]
    scene = view.channels(BOX, {"test": (x, [[0, 0, 1]])})
    line = scene.things["test, off the surface"][0]
    ends = np.linalg.norm(line - x, axis=1).min(), np.linalg.norm(line - BOX[0][1], axis=1).min()
    assert max(ends) < 0.005


@pytest.mark.once
def test_the_scene_is_drawn(tmp_path):
    pytest.importorskip("matplotlib", reason="a picture is drawn")
    scene = view.channels(
        BOX, {"sensors": (BOX[0][:3], np.eye(3)), "forces": (BOX[0][4:5], [[0, 0, 1]])}
    )
    path = tmp_path / "plan.png"
    view.plane([scene], path, title="plan", caption="words")
    assert path.stat().st_size > 5000


def test_wrong_groups_are_named():
    with pytest.raises(ConfigError, match=r"'sensors': \(1, 3\) points, \(2, 3\)"):
        view.channels(BOX, {"sensors": ([[0, 0, 0]], [[0, 0, 1]] * 2)})
    with pytest.raises(ConfigError, match="'sensors'"):
        view.channels(BOX, {"sensors": ([[0, 0, 0]], [[0, 0, 0]])})
