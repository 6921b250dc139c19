"""Pictures of wheels."""

import numpy as np
import pytest

from cases.solid import block
from rom import view
from rom.errors import ConfigError

pytest.importorskip("pyvista", reason="pyvista is not installed")
WORDS = {"title": "Wheel", "caption": "A test.", "hidden": ("root", "tip")}


@pytest.mark.long
def test_a_wheel_is_drawn_from_one_sector(tmp_path):
    """Waves that differ give pictures that differ; faces inside the wheel are left out."""
    from rom.view.scenes.wheels import _joined, _outside

    model = block((0.3, 0.1, 0.08), (3, 2, 2), origin=(-0.15, 0.2, 0.0))
    nodes, triangles = _outside(model, model.surface, WORDS["hidden"])
    inside = np.concatenate([model.interfaces[name].nodes for name in WORDS["hidden"]])
    assert not np.isin(nodes[triangles], inside).all(axis=1).any()
    assert len(triangles) == len(model.surface.triangles) - 2 * 8
    rng = np.random.default_rng(0)
    shapes = {f"mode {k}": rng.normal(size=(6, model.n_dofs)) for k in (1, 2)}
    one, two = (tmp_path / f"{name}.png" for name in ("one", "two"))
    view.wheel_modes(model, shapes, one, **WORDS)
    shapes["mode 2"] = shapes["mode 1"]
    view.wheel_modes(model, shapes, two, **WORDS)
    assert one.read_bytes() != two.read_bytes()
    first, joined = _joined(np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 1e-9]]), np.array([[0, 1, 2]]))
    assert sorted(first) == [0, 1]
    assert joined[0, 0] == joined[0, 2] != joined[0, 1]


def test_what_cannot_be_drawn_is_named(tmp_path):
    model = block()
    with pytest.raises(ConfigError, match="no mode of the wheel"):
        view.wheel_modes(model, {}, tmp_path / "w.png", **WORDS)
    with pytest.raises(ConfigError, match=f"needs {model.n_dofs} numbers per sector"):
        view.wheel_modes(model, {"one": np.zeros((6, 5))}, tmp_path / "w.png", **WORDS)
