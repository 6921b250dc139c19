"""One order for all pictures: what is drawn, then the path, then words by name."""

import inspect
from base64 import b64encode
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from cases.refusals import refuses

pytest.importorskip("pyvista", reason="pictures need pyvista")
pytest.importorskip("matplotlib", reason="pictures need matplotlib")

from matplotlib.figure import Figure

from cases.figures.pictures import faults
from cases.long import few
from cases.mbs.drawn import lattice_bar, squeezed, swinging
from cases.solid import block
from rom import view
from rom.errors import ConfigError
from rom.mbs.analysis.campbell import Campbell

X = np.linspace(0.0, 1.0, 5)
WORDS = {"title": "Title", "caption": "What a stranger has to know."}
POINTS = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 1]])
STRUCTURE = (POINTS, np.array([[0, 1], [1, 2], [0, 3]]), POINTS, POINTS[:1])
SPEEDS = np.linspace(0.0, 100.0, 3)


@cache
def moved():
    return swinging(lattice_bar())


def wheel():
    model = block((0.3, 0.1, 0.08), (3, 2, 2), origin=(-0.15, 0.2, 0.0))
    return model, {"mode 1": np.ones((6, model.n_dofs)) * np.arange(6)[:, None]}


PICTURES = {  # function -> what is drawn, words
    "campbell": lambda: (
        [Campbell(SPEEDS, (-2.0 + 60j + 0.1j * SPEEDS)[:, None], np.ones((2, 1)))], WORDS),
    "convergence": lambda: (
        [[("error", {"one": ([1, 2, 4], [1e-1, 1e-2, 1e-3])})]], WORDS | {"xlabel": "modes"}),
    "deformed": lambda: (
        [{"coarse": ([1, 2, 4], [0.2, 0.7, 0.9])}, [squeezed(0.5)]],
        WORDS | {"limit": ("exact", 1.0), "xlabel": "size", "ylabel": "answer"}),
    "faces": lambda: ([POINTS, {"1": [[0, 1, 2]], "2": [[0, 1, 3]]}], {}),
    "frequencies": lambda: ([{"free": {"full": [1.0, 2.0], "reduced": [1.0001, 2.01]}}],
                            {"title": "Title"}),
    "history": lambda: ([X, [("angle [rad]", {"one": np.sin(X)})]], WORDS),
    "instants": lambda: ([*moved()], {"times": [0.05]}),
    "mesh": lambda: ([block()], {}),
    "mode_shapes": lambda: ([lattice_bar()], {"n": 4}),
    "panels": lambda: ([[[view.Panel("Path", "x [m]", "y [m]", {"one": (X, X)})]]], WORDS),
    "plane": lambda: (
        [[view.Drawing("stone", "x [m]", "y [m]", polygons=[POINTS[:3, :2]])]], WORDS),
    "start": lambda: ([moved()[0]], {}),
    "updating": lambda: (
        [X, {"test": 1 / (3 - X)}, {"mass": (-0.1, -0.1, 0.01)}],
        WORDS | {"structure": STRUCTURE, "label": "displacement per force [m/N]"}),
    "wheel_modes": lambda: ([*wheel()], WORDS | {"hidden": ("root", "tip")}),
}  # fmt: skip
ALONE = "convergence", "frequencies", "history", "panels", "plane"
AXES = dict.fromkeys(ALONE, 1) | {"campbell": 2, "deformed": 2, "updating": 4}  # that each wants
FILMS = {
    "animate": lambda: ([*moved()], {"frames": 2}),
    "film": lambda: ([np.array([0.0]), view.Scene("box", {"steel": view.box((0.1, 0.1, 0.2))})],
                     {"caption": "What a stranger has to know."}),
    "flow": lambda: ([np.array([0.0, 1e-6]), [squeezed(0.0), squeezed(0.5)]],
                     {"caption": "What a stranger has to know."}),
}  # fmt: skip
# seconds each; "mesh" and "start" are drawn by a child process in `make test`, too
DRAWN_BY_A_CHILD = "faces instants mesh mode_shapes start updating wheel_modes".split()


def parameters(name):
    return inspect.signature(getattr(view, name)).parameters


def test_every_function_of_view_that_takes_a_path_or_axes_is_tried_here():
    functions = [name for name in view.__all__ if inspect.isfunction(getattr(view, name))]
    assert {name for name in functions if "path" in parameters(name)} == {*PICTURES, *FILMS}
    assert {name for name in (*PICTURES, *FILMS) if "ax" in parameters(name)} == set(AXES)


def each(names):
    return [pytest.param(n, marks=[pytest.mark.long] * (n in DRAWN_BY_A_CHILD)) for n in names]


@pytest.mark.parametrize("name", each(PICTURES))
def test_a_picture_is_the_same_seen_and_written(name, tmp_path):
    (things, words), draw, file = PICTURES[name](), getattr(view, name), tmp_path / "a.png"
    seen = draw(*things, **words)
    assert isinstance(seen, Figure) and seen.path is None and not list(tmp_path.iterdir())
    assert not faults(seen)
    written = draw(*things, file, **words)
    assert isinstance(written, Figure) and Path(written) == written.path == file
    assert file.read_bytes()[:4] == b"\x89PNG"
    assert seen._repr_png_() == seen.save(tmp_path / "b.png").read_bytes() == file.read_bytes()


@pytest.mark.parametrize("name", each(AXES))
def test_curves_are_drawn_into_axes_of_the_caller(name, tmp_path):
    (things, words), draw = PICTURES[name](), getattr(view, name)
    words = {key: word for key, word in words.items() if key != "caption"}
    figure = Figure(figsize=(12, 4))
    own = figure.subplots(1, AXES[name] + 1, squeeze=False)[0]
    given = own[0] if AXES[name] == 1 else own[:-1]
    assert draw(*things, **words, ax=given) is figure and not list(tmp_path.iterdir())
    assert all(a.lines or a.collections or a.images or a.patches for a in own[:-1])
    assert not own[-1].has_data() and own[-1].get_title() == ""
    assert draw(*things, tmp_path / "a.png", **words, ax=given) is figure
    assert (tmp_path / "a.png").read_bytes()[:4] == b"\x89PNG"
    for wrong in ("axes", own if AXES[name] == 1 else own[0]):
        with pytest.raises(ConfigError, match=rf"{name}: ax = .* must be {AXES[name]} Axes"):
            draw(*things, **words, ax=wrong)


@pytest.mark.parametrize("name", few(0, FILMS))
def test_a_film_is_the_same_seen_and_written(name, tmp_path):
    (things, words), draw, file = FILMS[name](), getattr(view, name), tmp_path / "a.gif"
    seen = draw(*things, **words)
    assert isinstance(seen, view.Film) and seen.path is None and not list(tmp_path.iterdir())
    assert Path(draw(*things, file, **words)) == file
    assert file.read_bytes()[:3] == b"GIF"
    assert seen.save(tmp_path / "c.gif").read_bytes() == file.read_bytes()
    assert b64encode(file.read_bytes()).decode() in seen._repr_html_()


def test_a_picture_is_no_path_before_it_is_saved_which_is_refused_in_the_same_words(tmp_path):
    seen = view.history(*PICTURES["history"]()[0], **WORDS)
    refuses(ConfigError, r"picture was not written yet.*picture\.save", Path, seen)
    refuses(ConfigError, r"ending '\.jpg' is unknown", seen.save, tmp_path / "a.jpg")
    assert not list(tmp_path.iterdir())
