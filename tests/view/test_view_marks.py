"""What is written and drawn so that diagrams are read: notes, levels, marks, rows, scenes."""

import numpy as np
import pytest

pytest.importorskip("pyvista", reason="pictures need pyvista")
pytest.importorskip("matplotlib", reason="pictures need matplotlib")
from matplotlib.figure import Figure

from cases.mbs.drawn import lattice_bar, swinging
from rom import view
from rom.mbs.analysis.campbell import Campbell
from rom.mbs.analysis.motion_certificate import Curve
from rom.view.canvas.picture import ScaledTicks
from rom.view.figures.things import actors_of

X = np.linspace(0.0, 1.0, 41)


def test_notes_stand_right_of_their_places_and_a_speed_is_marked():
    panel = view.Panel("Path", "x", "y", {"_path": (X, X)}, notes={"25": (0.5, 0.5), "a": (0, 1)})
    figure = view.panels([[panel]])
    figure.canvas.draw()
    (axes,) = figure.axes
    for note in axes.texts:
        x, y = axes.transData.transform(note.xy)
        box = note.get_window_extent()
        assert x < box.x0 < x + 25 and box.y0 < y < box.y1
    assert [note.get_text() for note in axes.texts] == ["25", "a"]
    speeds = np.linspace(0.0, 100.0, 3)
    diagram = Campbell(speeds, (60j + 0.1j * speeds)[:, None], np.ones((2, 1)))
    (axes,) = view.campbell(diagram, marks={"rated": 10 * np.pi}).axes
    (mark,) = [line for line in axes.lines if line.get_label() == "rated"]
    np.testing.assert_allclose(mark.get_xdata(), 300.0)  # 10 pi rad/s, in turns a minute
    assert "rated" in [t.get_text() for t in axes.get_legend().get_texts()]


def test_ticks_have_as_many_decimals_and_do_not_overlap_on_short_logarithmic_axes():
    ticks = ScaledTicks(1e-3)
    ticks.set_locs([0.0, 500.0, 1000.0, 1500.0])
    assert [ticks(x) for x in (0.0, 500.0, 1000.0)] == ["0.0", "0.5", "1.0"]
    ticks.set_locs([-2000.0, 0.0, 2000.0])
    assert [ticks(x) for x in (-2000.0, 0.0, 2000.0)] == ["\u22122", "0", "2"]
    ticks.set_locs([0.0, 250.0, 500.0])
    assert [ticks(x) for x in (0.0, 250.0, 500.0)] == ["0.00", "0.25", "0.50"]
    panel = view.Panel("E", "step [s]", "error [m]", {"a": (0.002 + 0.018 * X, 1e-9 + X)}, log=True)
    figure = view.panels([[panel, panel]])
    figure.canvas.draw()
    axis = figure.axes[0].xaxis
    assert [t.get_text() for t in axis.get_ticklabels()] == ["0.002", "0.005", "0.01", "0.02"]
    assert not any(t.get_text() for t in axis.get_ticklabels(minor=True))
    above = figure.axes[0].yaxis  # of many decades: powers of ten, as ever
    assert {axis.get_scale(), above.get_scale()} == {"log"}
    assert all(np.log10(tick) % 1 == 0 for tick in above.get_ticklocs())


def test_numbers_are_levels_words_are_rows_and_a_name_has_one_colour():
    words = ["none"] * 20 + ["all"] * 11 + ["none"] * 10
    speeds = {"rotor": 12 * X, "rated": 12.1}
    figure = view.history(X, [("speed", speeds), ("group", {"": words})])
    speed, group = figure.axes
    rotor, rated = speed.lines
    np.testing.assert_array_equal(rated.get_ydata(), np.full(41, 12.1))
    assert rated.get_linestyle() == "-." and rotor.get_linestyle() == "-"
    assert [t.get_text() for t in speed.get_legend().get_texts()] == ["rotor", "rated"]
    assert [t.get_text() for t in group.get_yticklabels()] == ["none", "all"]
    np.testing.assert_array_equal(group.lines[0].get_ydata()[[0, 25, 40]], [0, 1, 0])
    upper = {"a": X, "b": X, "c": X, "d": X}
    lower = {"d": X, "new": X, "a": X}
    figure = view.history(X, [("one", upper), ("two", lower)])
    one, two = ({line.get_label(): line.get_color() for line in axes.lines} for axes in figure.axes)
    assert len(set(one.values())) == 4 and len(set(two.values())) == 3
    assert two["a"] == one["a"] and two["d"] == one["d"]


def test_levels_are_named_away_from_points_and_fields_share_the_colours_asked_for():
    turn = 2 * np.pi * X
    circles = {r: [r * np.column_stack([np.cos(turn), np.sin(turn)])] for r in (0.5, 0.9)}
    outside = {7.0: [np.array([[5.0, 5.0], [6.0, 6.0]])]}
    points = {"seen": np.array([[0.5, 0.0]]), "other": np.array([[-0.9, 0.0]])}
    drawing = view.Drawing("Field", "x", "y", (-1.0, 1.0, -1.0, 1.0), np.zeros((5, 5)), "value",
                           points=points, levels=circles | outside)  # fmt: skip
    axes = view.plane([drawing]).axes[0]
    names = {text.get_text(): np.array(text.get_position()) for text in axes.texts}
    assert set(names) == {"0.5", "0.9"}  # the third one is not in the drawing
    for name, place in names.items():
        np.testing.assert_allclose(np.linalg.norm(place), float(name), rtol=1e-9)
        assert min(np.linalg.norm(place - xy) for xy in np.vstack(list(points.values()))) > 0.5
    seen, other = axes.collections
    assert not np.allclose(seen.get_facecolor(), other.get_facecolor())
    assert not np.allclose(other.get_facecolor(), other.get_edgecolor())
    fields = [view.Drawing("Field", "x", "y", (0.0, 1.0, 0.0, 1.0), value * np.eye(3), "load",
                           limits=(0.0, 5.0)) for value in (2.0, 5.0)]  # fmt: skip
    square = view.Drawing("Stone", "x", "y", polygons=[np.array([[0, 0], [1, 0], [1, 1.0]])],
                          values=np.array([3.0]), label="load", limits=(0.0, 5.0))  # fmt: skip
    figure = view.plane([*fields, square])
    drawn = [a.images[0] for a in figure.axes if a.images]
    drawn += [c for a in figure.axes if a.get_title(loc="left") == "Stone" for c in a.collections]
    assert [image.get_clim() for image in drawn] == [(0.0, 5.0)] * 3


def test_a_mechanism_is_posed_as_the_film_shows_it_then():
    mechanism, solution = swinging(lattice_bar())
    scene = view.posed(mechanism, solution, 0.0502, title="Then", up=(0, 0, 1))
    (bar,) = [a for a in actors_of(scene) if a.values is not None]
    for node in ("n0", "n8"):
        place = solution.position("bar", node)[50]
        assert np.linalg.norm(place - solution.position("bar", node)[0]) > 0.01
        assert np.linalg.norm(bar.points[0] - place, axis=1).min() < 1e-9
    assert bar.values.shape == bar.points.shape[:2]
    late = view.posed(mechanism, solution, 0.0, up=(0, 0, 1))
    assert late.limits == scene.limits  # colours of the whole motion
    assert scene.limits[1] >= bar.values.max() > 0.0 and scene.label.startswith("deformation [")


@pytest.mark.long
def test_several_scenes_stand_below_each_other_beside_curves():
    scenes = [view.Scene(f"Box {k}", {"steel": view.box((0.3, 0.2, 0.1))}) for k in range(2)]
    figure = view.history(X, [("a [m]", {"one": X}), ("b [m]", {"one": X})], beside=scenes)
    one, two = (next(a for a in figure.axes if a.get_title(loc="left") == s.title) for s in scenes)
    upper, lower = one.get_window_extent(), two.get_window_extent()
    assert lower.y1 + 20 < upper.y0 and lower.x0 == upper.x0 and lower.height > 100
    page = Figure(figsize=(12, 4))
    areas = page.subplots(1, 3)
    view.history(X, [("a [m]", {"one": X})], beside=scenes, ax=list(areas))
    assert [len(axes.images) for axes in areas] == [0, 1, 1]


def test_a_curve_with_an_error_has_a_band_as_wide():
    """Of what `rom.certify_motion` gives: above and below, whatever the sign of the error."""
    value, error = np.sin(X), 0.1 * np.cos(X)
    figure = view.history(X, [("energy [1]", {"rod": Curve(X, value, error)})])
    (band,) = figure.axes[0].collections
    x, y = band.get_paths()[0].vertices.T
    for k in (5, 20, 30):
        edges = y[np.isclose(x, X[k])]
        size = abs(error[k])
        np.testing.assert_allclose([edges.min(), edges.max()], [value[k] - size, value[k] + size])
