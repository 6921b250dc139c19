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
    nodes, triangles = _outside(model, WORDS["hidden"])
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


def test_a_wheel_and_its_sectors_are_things_with_their_displacements():
    """A rotation about the axis moves each point by its radius times the angle."""
    model = block((0.3, 0.1, 0.08), (3, 2, 2), origin=(-0.15, 0.2, 0.0))
    hidden, N, angle = WORDS["hidden"], 6, 1e-3
    whole = view.wheel([model] * N, hidden=hidden)
    one = view.wheel([model] * N, sectors=[2], hidden=hidden)
    assert len(whole.cells) == N * len(one.cells)
    assert whole.values is None
    middle = np.array([0.0, 0.25])  # of the block, turned by 120 degrees
    c, s = np.cos(2 * np.pi / 3), np.sin(2 * np.pi / 3)
    centre = (one.points.min(axis=0) + one.points.max(axis=0)) / 2
    np.testing.assert_allclose(centre[:2], [c * middle[0] - s * middle[1],
                                            s * middle[0] + c * middle[1]], atol=1e-12)  # fmt: skip
    shape = []
    for at in 2 * np.pi * np.arange(N) / N:
        turn = np.array([[np.cos(at), -np.sin(at), 0], [np.sin(at), np.cos(at), 0], [0, 0, 1]])
        shape.append(np.cross([0, 0, angle], model.points @ turn.T))
    turned = view.wheel([model] * N, shape=shape, magnify=2.0, scale=1e3, hidden=hidden)
    radius = np.linalg.norm(whole.points[:, :2], axis=1)
    np.testing.assert_allclose(turned.values, 1e3 * angle * radius, rtol=1e-12)
    step = turned.points - whole.points
    np.testing.assert_allclose(np.linalg.norm(step, axis=1), 2 * angle * radius, rtol=1e-9)
    np.testing.assert_allclose(np.sum(step * whole.points, axis=1), 0.0, atol=1e-15)
    with pytest.raises(ConfigError, match="numbers per sector"):
        view.wheel([model] * N, shape=shape[:5], hidden=hidden)
    with pytest.raises(ConfigError, match=r"sectors \[6\] must be from 0 to 5"):
        view.wheel([model] * N, sectors=[6], hidden=hidden)


def test_what_cannot_be_drawn_is_named(tmp_path):
    model = block()
    with pytest.raises(ConfigError, match="one mode of the wheel"):
        view.wheel_modes(model, {}, tmp_path / "w.png", **WORDS)
    with pytest.raises(ConfigError, match=f"needs {model.n_dofs} numbers per sector"):
        view.wheel_modes(model, {"one": np.zeros((6, 5))}, tmp_path / "w.png", **WORDS)
