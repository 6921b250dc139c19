"""Things in space beside curves, wheels, channels, films, and legends that hide nothing."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("pyvista", reason="pictures need pyvista")
pytest.importorskip("matplotlib", reason="pictures need matplotlib")
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from numpy.testing import assert_allclose

from cases.figures.pictures import crowded, written_in
from cases.mbs.drawn import volume
from cases.refusals import refused, refuses
from cases.solid import block
from rom import view
from rom.errors import ConfigError
from rom.model import SurfaceMesh
from rom.view.canvas.scene import aimed
from rom.view.figures.curves import LINES
from rom.view.figures.things import COLOURS, _seen, actors_of
from rom.view.scenes.meshes import in_sight
from rom.view.scenes.mode_shapes import _joined, _outside

X = np.linspace(0.0, 1.0, 20)
BOX = view.box((0.3, 0.2, 0.1))
LONG_NAMES = [f"a curve with quite a long name, {k}" for k in range(5)]


def no_words_overlap_or_leave_the_page(figure):
    """All words of a figure that draws them where they can be read."""
    figure.canvas.draw()
    corners = [text for axes in figure.axes if not axes.axison for text in axes.texts]
    assert crowded(figure, corners) == []
    return {text.get_text() for text in (*written_in(figure), *corners)}


def test_legends_stand_above_the_curves_hide_nothing_and_stand_once():
    curves = {name: (X, X**k) for k, name in enumerate(LONG_NAMES)}
    panels = [[view.Panel("Many names", "x [m]", "y [m]", curves),
               view.Panel("One name", "x", "y", {"short": (X, X)})],
              [view.Panel("Below", "x", "z", {"other": (X, X)}, {"seen": (X, X)})]]  # fmt: skip
    figure = view.panels(panels, title="Heading", caption="Words. " * 60)
    found = no_words_overlap_or_leave_the_page(figure)
    assert {*LONG_NAMES, "short", "other", "seen", "Heading"} <= set(found)
    for axes in figure.axes:
        for text in axes.get_legend().get_texts():
            assert text.get_window_extent().y0 >= axes.get_window_extent().y1
        low, high = axes.get_ylim()
        values = np.concatenate([line.get_ydata() for line in axes.lines])
        assert np.ptp(values) > 0.85 * (high - low)  # no room is kept for a legend
    many, one, _ = figure.axes
    assert many._left_title.get_window_extent().y0 == one._left_title.get_window_extent().y0
    same = {"one": X, "two": X**2}
    figure = view.history(
        X, [("a [m]", same), ("b [m]", same), ("c [m]", {"third": X})], title="T", caption="C"
    )
    legends = [axes.get_legend() for axes in figure.axes]
    assert legends[1] is None
    assert [t.get_text() for t in legends[0].get_texts()] == ["one", "two"]
    assert [t.get_text() for t in legends[2].get_texts()] == ["third"]
    no_words_overlap_or_leave_the_page(figure)


def test_thin_lines_take_no_colour_and_names_of_bars_stay_on_the_page():
    guides = {f"_{k}": (X, k * X) for k in range(4)}
    figure = view.panels([[view.Panel("P", "x", "y", {**guides, "first": (X, X)})]])
    (axes,) = figure.axes
    assert to_hex(axes.lines[-1].get_color()) == LINES[0]
    assert axes.lines[-1].get_linestyle() == "-"
    bars = {"a parameter with a long name": (-1.0, 2.0), "b": (-0.5, 0.5)}
    left = view.Panel("Left", "x", "y", {"one": (X, X)}, {"seen": (X, 1 - X)})
    figure = view.panels([[left, view.Panel("Bars", "change [%]", bars=bars)]])
    no_words_overlap_or_leave_the_page(figure)
    label = figure.axes[1].get_yticklabels()[0].get_window_extent()
    assert label.x0 > figure.axes[0].get_window_extent().x1
    assert [bar.get_width() for bar in figure.axes[1].patches] == [3.0, 1.0]
    assert [len(line.get_xdata()) for line in figure.axes[0].lines] == [20, 20]


def test_things_have_edges_and_colours_in_turn_and_cameras_look_at_nothing_else():
    scene = view.Scene("Two", {"a": BOX, "mine": view.Thing(*BOX, colour="#123456"), "b": BOX,
                               "_line": view.Thing(BOX[0], [[0, 1], [1, 2]])})  # fmt: skip
    actors = actors_of(scene)
    assert [actor.cells.shape for actor in actors] == [(12, 3), (12, 2)] * 3 + [(2, 2)]
    assert [actors[k].colour for k in (0, 2, 4, 6)] == [
        COLOURS[0], "#123456", COLOURS[1], COLOURS[2]]  # fmt: skip
    points, triangles = BOX
    beside = np.vstack([points, [[9.0, 9.0, 9.0]]])
    alone, more = (_seen(actors_of(view.Scene("A box", {"_a": (X, triangles)})))
                   for X in (points, beside))  # fmt: skip
    assert np.abs(more).max() == np.abs(alone).max() < 1.0


@pytest.mark.long
def test_a_scene_stands_beside_curves_or_in_axes_of_the_caller():
    scene = view.Scene("Body", {"steel": BOX, "loaded": view.Thing(*BOX, values=np.arange(8.0))},
                       "stress [MPa]")  # fmt: skip
    panel = view.Panel("Curve", "x [m]", "y [m]", {"one": (X, X)})
    for figure in (
        view.panels([[panel, scene]], title="T", caption="C"),
        view.history(X, [("y [m]", {"one": X})], title="T", caption="C", beside=scene),
    ):
        found = no_words_overlap_or_leave_the_page(figure)
        assert {"steel", "x", "y", "z", "Body"} <= set(found)
        assert {"50 mm", "100 mm"} & set(found)  # a round length that fits the room
        assert "loaded" not in found  # the colour bar explains it
        bars = [axes for axes in figure.axes if axes.get_title() == "stress [MPa]"]
        assert [axes.get_xlim() for axes in bars] == [(0.0, 7.0)]
        (picture,) = [axes for axes in figure.axes if axes.get_title(loc="left") == "Body"]
        height, width = picture.images[0].get_array().shape[:2]
        box = picture.get_window_extent()  # a pixel of the picture is one of the page
        assert abs(width - box.width) < 2
        assert abs(height / np.ptp(picture.get_ylim()) - height / box.height) < 0.01
    scene = view.Scene("Body", {"steel": BOX})
    figure = Figure(figsize=(12, 4))
    one, two = figure.subplots(1, 2)
    assert view.history(X, [("y [m]", {"one": X})], beside=scene, ax=[one, two]) is figure
    assert one.lines and two.images
    with pytest.raises(ConfigError, match="must be 2 Axes"):
        view.history(X, [("y [m]", {"one": X})], beside=scene, ax=one)


def film(*times, **things):
    return lambda: view.film(times, view.Scene("S", things))


test_wrong_things_and_films_of_nothing_are_refused_by_name = refused(
    (film(0.0, odd=view.Thing(np.zeros((3, 2)), [[0, 1, 2]])), r"'odd'.*points must be \(n, 3\)"),
    (film(0.0, odd=view.Thing(np.zeros((3, 3)), [[0, 1, 3]])), "'odd'.*from 0 to 2"),
    (film(0.0, odd=view.Thing(np.zeros((3, 3)), [[0, 1, -1]])), "'odd'.*from 0 to 2"),
    (film(0.0, odd=view.Thing(np.zeros((3, 3)), [[0.0, 1.0]])), "'odd'.*from 0 to 2"),
    (film(0.0, odd=view.Thing(np.zeros((4, 3)), [[0, 1, 2, 3]])), "'odd'.*from 0 to 3"),
    (film(0.0, odd=view.Thing(*BOX, values=[1.0, 2.0])), r"'odd'.* needed are \(1, 8\)"),
    (film(0.0, odd=view.Thing(*BOX, edges=[[0, 8]])), "'odd'.*edges must be pairs from 0 to 7"),
    (film(0.0, 1.0, box=view.Thing(BOX[0] + np.zeros((3, 1, 1)), BOX[1])), "2 times for 3.*'S'"),
    (film(0.0), "nothing to draw in 'S'"),
    error=ConfigError,
)


def test_a_film_shows_what_moves_from_one_place_and_leaves_the_rest():
    way = np.array([0.0, 0.2, 0.4])[:, None, None] * [1.0, 0, 0]
    scene = view.Scene(
        "S", {"ground": view.box((1.0, 0.02, 0.3), (0.2, -0.2, 0)),
              "box": view.Thing(BOX[0] + way, BOX[1], "#ff0000")},
        view=(0, 0, 1), up=(0, 1, 0))  # fmt: skip
    film = view.film([0.0, 1.0, 2.0], scene, caption="Words.")
    assert film.pages.shape[0] == 3
    pages = film.pages[:, 40:-200].astype(int)
    red = pages[..., 0] - pages[..., 1] > 60
    places = [np.nonzero(frame)[1].mean() for frame in red]
    steps = np.diff(places)
    metre = 0.94 * film.pages.shape[2] / 1.0  # the ground is a metre wide, with margins of 3 %
    assert_allclose(steps, 0.2 * metre, rtol=0.02)


def test_plates_are_their_outlines_made_thick_and_move_with_them():
    square = np.array([[0.0, 0], [0.4, 0], [0.4, 0.2], [0, 0.2]])
    other = square + np.array([1.0, 0.5])
    frames = [[square, other], [square, other + np.array([0.0, 0.3])]]
    thing = view.plates(frames, 0.5, values=[1.0, 2.0])
    assert volume((thing.points[0], thing.cells)) == pytest.approx(2 * 0.4 * 0.2 * 0.5)
    second = thing.values == 2.0
    step = thing.points[1] - thing.points[0]
    assert_allclose(step[second], [(0.0, 0.3, 0.0)] * second.sum(), atol=1e-15)
    np.testing.assert_array_equal(step[~second], 0.0)
    assert np.ptp(thing.points[..., 2]) == pytest.approx(0.5)
    refuses(ConfigError, r"1 values for 2 plates", view.plates, frames, 0.5, values=[1.0])
    refuses(ConfigError, "at least one plate", view.plates, [[square], [square, other]], 0.5)


def test_changes_of_an_update_are_bars_and_what_is_left_has_a_scale_of_its_own():
    """Error bars are two standard deviations long, and fill their diagram."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0]])
    structure = points, np.array([[0, 1], [1, 2]]), points, points[:1]
    changes = {"one": (0.4, 0.401, 0.0005), "two": (-0.3, -0.3, 0.0002)}
    fine = np.linspace(0.0, 1.0, 200)
    curves, more = {"test": 1 / (3 - X)}, {"structure": structure, "label": "u [m]"}
    both = curves | {"before": (fine, 1 / (2 - fine))}
    figure = view.updating(X, both, changes, **more, title="T", caption="C")
    found = no_words_overlap_or_leave_the_page(figure)
    assert {"found", "true", "sensors", "exciters"} <= set(found)
    (bars,) = [a for a in figure.axes if a.get_xlabel() == "change [%]"]
    assert_allclose([bar.get_width() for bar in bars.patches], [40.0, -30.0])
    (errors,) = [a for a in figure.axes if a.get_xlabel() == "found - true [%]"]
    ends = [segment[:, 0] for segment in errors.collections[0].get_segments()]
    assert_allclose(ends, [(0.0, 0.2), (-0.04, 0.04)], atol=1e-12)
    assert np.ptp(errors.get_xlim()) < 0.3
    responses = figure.axes[0].lines
    assert [line.get_xdata().size for line in responses] == [X.size, fine.size]
    refuses(ConfigError, "20 values of 'test' for 19", view.updating, X[1:], curves, {}, **more)


@pytest.mark.long
def test_an_interface_on_the_far_side_is_said_to_be_turned_away():
    model = block()
    points, triangles = model.points[model.surface.nodes], model.surface.triangles
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    inward = np.sum(np.cross(b - a, c - a) * (a - points.mean(axis=0)), axis=1) < 0
    outward = np.where(inward[:, None], triangles[:, ::-1], triangles)
    unknown, model = model, replace(model, surface=SurfaceMesh(model.surface.nodes, outward))
    faces = {name: aimed(model.points, 100, view=v, up=(0, 0, 1))
             for name, v in (("left", (-1, 0.2, 0.1)), ("right", (1, 0.2, 0.1)))}  # fmt: skip
    near = "root" if model.points[model.interfaces["root"].nodes, 0].mean() < 0.1 else "tip"
    far = {"root": "tip", "tip": "root"}[near]
    assert in_sight(model, near, faces["left"]) and not in_sight(model, far, faces["left"])
    assert in_sight(model, far, faces["right"]) and not in_sight(model, near, faces["right"])
    assert all(in_sight(unknown, n, face) for n in ("root", "tip") for face in faces.values())
    figure = view.mesh(model, view=(-1, 0.2, 0.1), up=(0, 0, 1))
    assert f"{far} (turned away)" in [text.get_text() for text in figure.texts]


WORDS = {"title": "Wheel", "caption": "A test.", "hidden": ("root", "tip")}


def sector():
    return block((0.3, 0.1, 0.08), (3, 2, 2), origin=(-0.15, 0.2, 0.0))


@pytest.mark.long
def test_a_wheel_is_drawn_from_one_sector():
    model = sector()
    nodes, triangles = _outside(model, WORDS["hidden"])
    inside = np.concatenate([model.interfaces[name].nodes for name in WORDS["hidden"]])
    assert not np.isin(nodes[triangles], inside).all(axis=1).any()
    assert len(triangles) == len(model.surface.triangles) - 2 * 8
    rng = np.random.default_rng(0)
    shapes = {f"mode {k}": rng.normal(size=(6, model.n_dofs)) for k in (1, 2)}
    one = view.wheel_modes(model, shapes, **WORDS)._repr_png_()
    shapes["mode 2"] = shapes["mode 1"]
    assert view.wheel_modes(model, shapes, **WORDS)._repr_png_() != one
    first, joined = _joined(np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 1e-9]]), np.array([[0, 1, 2]]))
    assert sorted(first) == [0, 1]
    assert joined[0, 0] == joined[0, 2] != joined[0, 1]


def test_a_wheel_and_its_sectors_are_things_with_their_displacements():
    """A rotation about the axis moves each point by its radius times the angle."""
    model = sector()
    hidden, N, angle = WORDS["hidden"], 6, 1e-3
    whole = view.wheel([model] * N, hidden=hidden)
    one = view.wheel([model] * N, sectors=[2], hidden=hidden)
    assert len(whole.cells) == N * len(one.cells)
    assert whole.values is None
    middle = np.array([0.0, 0.25])  # of the block, turned by 120 degrees
    c, s = np.cos(2 * np.pi / 3), np.sin(2 * np.pi / 3)
    centre = (one.points.min(axis=0) + one.points.max(axis=0)) / 2
    assert_allclose(centre[:2], [[c, -s], [s, c]] @ middle, atol=1e-12)
    shape = []
    for at in 2 * np.pi * np.arange(N) / N:
        turn = np.array([[np.cos(at), -np.sin(at), 0], [np.sin(at), np.cos(at), 0], [0, 0, 1]])
        shape.append(np.cross([0, 0, angle], model.points @ turn.T))
    turned = view.wheel([model] * N, shape=shape, magnify=2.0, scale=1e3, hidden=hidden)
    radius = np.linalg.norm(whole.points[:, :2], axis=1)
    assert_allclose(turned.values, 1e3 * angle * radius, rtol=1e-12)
    step = turned.points - whole.points
    assert_allclose(np.linalg.norm(step, axis=1), 2 * angle * radius, rtol=1e-9)
    assert_allclose(np.sum(step * whole.points, axis=1), 0.0, atol=1e-15)
    each, wheel = [model] * N, {"one": np.zeros((6, 5))}
    for words, draw in {
        "numbers per sector": lambda: view.wheel(each, hidden=hidden, shape=shape[:5]),
        r"sectors \[6\] must be from 0 to 5": lambda: view.wheel(each, hidden=hidden, sectors=[6]),
        "one mode of the wheel": lambda: view.wheel_modes(model, {}, **WORDS),
        f"needs {model.n_dofs} numbers per": lambda: view.wheel_modes(model, wheel, **WORDS),
    }.items():
        refuses(ConfigError, words, draw)


BAR = view.box((1.0, 0.1, 0.08))


def test_a_bar_points_along_its_channel_and_a_line_leads_to_a_point_off_the_body():
    x = BAR[0][[0]]
    scene = view.channels(BAR, {"sensors": (x, [[0, 3, 4]])}, title="plan")
    assert list(scene.things) == ["body", "sensors"] and len(actors_of(scene)) == 4
    points = scene.things["sensors"][0] - x
    along = points @ [0, 0.6, 0.8]
    assert_allclose(along.max(), 0.09, rtol=1e-6)
    far = points[along > 0.05]
    assert np.linalg.norm(far - along[along > 0.05, None] * [0, 0.6, 0.8], axis=1).max() < 0.005
    x = BAR[0][[1]] + [0.0, 0.0, 0.2]
    scene = view.channels(BAR, {"test": (x, [[0, 0, 1]])})
    line = scene.things["test, off the surface"][0]
    ends = np.linalg.norm(line - x, axis=1).min(), np.linalg.norm(line - BAR[0][1], axis=1).min()
    assert max(ends) < 0.005
    for along, words in (([[0, 0, 1]] * 2, r"\(1, 3\) points, \(2, 3\)"), ([[0, 0, 0]], "")):
        with pytest.raises(ConfigError, match=f"'sensors': {words}"):
            view.channels(BAR, {"sensors": ([[0, 0, 0]], along)})
