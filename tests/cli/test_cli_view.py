"""rom view: a window where there is a display, a picture where there is none."""

import sys

import numpy as np
import pytest

import rom
from cases.command import python
from cases.files.toml_files import CRANK
from cases.solid import block, reduced
from rom.cli.main import main
from rom.view.scenes import window


@pytest.fixture(scope="module")
def bar():
    return reduced(6, block(cells=(6, 1, 1)), reference="root", name="bar")


@pytest.fixture
def folder(bar, tmp_path, monkeypatch):
    rom.save(bar, tmp_path / "rod.rom.npz")
    (tmp_path / "crank.toml").write_text(CRANK)
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    return tmp_path


def test_without_a_display_it_draws_and_says_so(folder, capsys, monkeypatch):
    asked = []
    monkeypatch.setattr(
        "rom.view.scenes.mode_shapes.mode_shapes", lambda *a, **how: asked.append((a, how))
    )
    assert main(["view", "rod.rom.npz", "-n", "1", "--fixed", "root"]) == 0
    said = capsys.readouterr().out
    assert said == "rod.png: modes of body bar; there is no display for a window\n"
    ((body, path), how) = asked[0]
    assert (body.name, str(path), how) == ("bar", "rod.png", {"n": 1, "fixed": ("root",)})


@pytest.mark.once
def test_a_mechanism_is_drawn_with_its_names(folder, capsys):
    pytest.importorskip("pyvista", reason="VTK comes with the pictures")
    assert main(["view", "crank.toml", "-o", "start.png", "--json"]) == 0
    assert '"output": "start.png"' in capsys.readouterr().out
    assert (folder / "start.png").read_bytes()[:4] == b"\x89PNG"


def test_with_a_display_it_opens_a_window(folder, bar, monkeypatch, capsys):
    seen = []
    monkeypatch.setenv("DISPLAY", ":7")
    monkeypatch.setattr(window, "show", seen.extend)
    assert main(["view", "rod.rom.npz", "-n", "3"]) == 0
    assert capsys.readouterr().out == "modes of body bar, in a window\n"
    free = bar.frequencies(9)[6:]
    titles = [f"bar, mode {k + 1}: {f:.5g} Hz" for k, f in enumerate(free)]
    assert [scene.title for scene in seen] == titles
    assert not list(folder.glob("*.png"))
    assert main(["view", "crank.toml"]) == 0 and seen[-1].title == "crank"


def test_a_mode_swings_about_the_shape_at_rest(bar):
    scene = window.mode_scenes(bar, 1, ("root",))[0]
    X, moved = bar.surface.points, scene.things["moving"].points
    np.testing.assert_allclose(moved.mean(axis=0), X, atol=1e-12)
    largest = np.linalg.norm(moved - X, axis=2).max()
    np.testing.assert_allclose(largest, 0.08 * np.ptp(X, axis=0).max(), rtol=1e-9)
    tip = X[:, 0] > 0.99
    assert np.linalg.norm(moved[6] - X, axis=1)[tip].min() > 0.9 * largest  # a cantilever


CODE = """
import sys
import numpy as np
from pathlib import Path
from rom.view.scenes.window import Window

window = Window(Path(sys.argv[1]), off_screen=True)
window.plotter.show(auto_close=False)
look = lambda: window.plotter.screenshot(return_img=True).astype(int)
pictures = [look()]
for step in (0, 1, 1):
    window.go(step) if step else [window.tick() for _ in range(6)]
    window.plotter.render()
    pictures.append(look())
drawn = [(p < 250).any(axis=2).mean() > 0.01 for p in pictures]
moved = [np.abs(a - b).max() > 50 for a, b in zip(pictures, pictures[1:])]
print(all(drawn), all(moved), np.abs(pictures[0] - pictures[3]).max() < 50, window.at)
"""


@pytest.mark.once
def test_keys_and_time_change_what_the_window_shows(bar, tmp_path):
    pytest.importorskip("pyvista", reason="VTK comes with the pictures")
    window.leave(window.mode_scenes(bar, 2), tmp_path)
    done = python("-c", CODE, tmp_path, timeout=600)
    assert done.stdout.split() == ["True", "True", "True", "0"], done.stderr
