"""What a reader trips over in a figure is found, each fault by its own words."""

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="pictures need matplotlib")

from matplotlib.figure import Figure

from cases.figures.pictures import faults
from rom import view
from rom.mbs.analysis.campbell import Campbell
from rom.view.figures import things
from rom.view.figures.curves import line_look

X = np.linspace(0.0, 1.0, 9)


def diagram(**names):
    figure = Figure(figsize=(6, 4), dpi=100)
    axes = figure.subplots()
    axes.set(xlabel="time [s]", ylabel="angle [rad]", **names)
    return figure, axes


def bare(axes):
    axes.set_axis_off()
    picture = np.full((400, 400, 3), 255)
    picture[:, 190:210] = 0
    axes.imshow(picture, aspect="auto")


def two_scales(axes):
    axes.plot(X, X)
    axes.figure.set_size_inches(6, 8)
    other = axes.figure.add_axes((0.125, 1.2 / 8, 0.775, 2 / 8))
    axes.set_position((0.125, 4.4 / 8, 0.775, 3 / 8))
    other.plot(X, 3 * X)
    other.set(xlabel=axes.get_xlabel(), ylabel=axes.get_ylabel())


def squeezed(axes):
    two_scales(axes)
    axes.lines[0].set_data(X / 5, X / 5)
    for one in axes.figure.axes:
        one.set(xlim=(-0.1, 1.1), ylim=(-0.1, 3.1))


def two(axes, y, look):
    axes.plot(X, X, "r--", label="one")
    axes.plot(X, y, look, label="other")


def words(axes, x, y, text, **more):
    axes.plot(X, X, "o" if more else "-")
    axes.text(x, y, text, ha="center", va="center", **more)


FAULTS = {  # words of a fault: what is drawn
    "'one' and 'other' look the same": lambda axes: two(axes, X**2, "r--"),
    "takes 10% of the height": lambda axes: (axes.plot(X, X), axes.set_ylim(-5.0, 5.0)),
    "'other' hides 'one'": lambda axes: two(axes, X, "b-"),
    "are compared and have two scales": two_scales,
    "is compared with what is far smaller": squeezed,
    "things take 6% of their room": bare,
    "the horizontal axis has no name": lambda axes: (axes.plot(X, X), axes.set_xlabel("")),
    "'6x' leaves the diagram": lambda axes: (
        axes.plot(X, X),
        axes.annotate("6x", (1.06, 0.5), annotation_clip=False),
    ),
    "a curve runs through '6x'": lambda axes: words(axes, 0.5, 0.5, "6x"),
    "'here' hides a point": lambda axes: words(axes, 0.5, 0.5, "here", bbox={"fc": "white"}),
    "'the end of the line' stands away": lambda axes: words(axes, 0.3, 0.9, "the end of the line"),
    "'first words' lies on 'others'": lambda axes: (
        words(axes, 0.5, 0.32, "first words"),
        axes.text(0.42, 0.32, "others", va="center"),
    ),
    "leaves the page": lambda axes: (axes.plot(X, X), axes.set_title("A title too long " * 8)),
}


@pytest.mark.parametrize("said", FAULTS)
def test_a_fault_is_found(said):
    figure, axes = diagram()
    FAULTS[said](axes)
    found = faults(figure)
    assert len(found) == 1
    assert said in found[0]


def test_many_curves_are_told_apart_and_those_without_a_name_stay_thin():
    figure, axes = diagram()
    for k in range(24):
        axes.plot(X, X * k, label=f"curve {k}", **line_look(k))
    assert not faults(figure)
    curves = {f"curve {k}": (X, X) for k in range(5)}
    assert not faults(view.panels([[view.Panel("Five", "x [m]", "y [m]", curves)]]))
    curves = {f"_blade {k}": (X, 0 * X) for k in range(11)} | {"short": (X, X)}
    figure = view.panels([[view.Panel("Tips", "f [Hz]", "u [m]", curves)]])
    assert max(line.get_linewidth() for line in figure.axes[0].lines) < 3.0
    assert not faults(figure)


def test_names_of_rays_stand_in_the_diagram_and_on_no_line():
    speeds = np.linspace(0.0, 1.5, 15)
    f = np.array([0.32, 0.5, 0.62, 0.68, 1.05, 1.2]) + np.outer(speeds, [0, -0.05, 0, 0.1, -0.1, 0])
    diagram = Campbell(speeds, 2j * np.pi * f, np.ones((14, 6)))
    figure = view.campbell(diagram, orders=(1, 3, 6), marks={"rated": 1.45})
    assert [text.get_text() for text in figure.axes[0].texts] == ["1x", "3x", "6x"]
    assert not faults(figure)


def panel(title, size):
    return view.Panel(title, "time [s]", "force [N]", {"one": (X, size * X)})


@pytest.mark.parametrize(
    "draw",
    [
        lambda: view.panels([[panel("first", 1.0), panel("second", 1.8)], [panel("third", -0.5)]]),
        lambda: view.plane([
            view.Drawing(title, "x [m]", "y [m]", equal=False,
                         curves={"way": [np.outer(X, (1, size))]})
            for title, size in (("first", 1.0), ("second", 1.8))
        ]),
        lambda: view.history(X, [("angle [rad]", {"one": X}), ("angle [rad]", {"two": 1.8 * X})]),
    ],
    ids=["panels", "plane", "history"],
)  # fmt: skip
def test_what_is_compared_has_one_scale(draw):
    figure = draw()
    limits = {(*axes.get_xlim(), *axes.get_ylim()) for axes in figure.axes}
    assert len(limits) == 1
    assert not faults(figure)


def test_windows_with_nothing_in_common_keep_their_own_range():
    panels = [view.Panel(f"{x:g}", "f [Hz]", "u [m]", {"one": (x + X, X)}) for x in (0.0, 9.0)]
    figure = view.panels([panels])
    (first, second) = (axes.get_xlim() for axes in figure.axes)
    assert first[1] < second[0]
    assert len({axes.get_ylim() for axes in figure.axes}) == 1
    assert not faults(figure)


def box_at(x, **more):
    return view.Thing(*view.box((1.0, 1.0, 1.0), (x, 0.0, 0.0)), **more)


def test_the_same_things_from_the_same_side_have_one_scale(monkeypatch):
    seen, real = [], things.seen
    monkeypatch.setattr(things, "seen", lambda *a, **k: seen.append(real(*a, **k)) or seen[-1])
    blank = lambda self, **_: np.full((1, *self.camera.size[::-1], 3), 128, np.uint8)  # noqa: E731
    monkeypatch.setattr(things.View, "drawn", blank)
    scenes = [
        view.Scene(f"{x}", {"fixed": box_at(0.0), "moved": box_at(x)}, view=side, up=(0, 0, 1))
        for x, side in ((2.0, (0, -1, 0)), (5.0, (0, -1, 0)), (2.0, (0, -1, 1)))
    ]
    view.plane(scenes, columns=3)
    metres = [one.camera.metre for one in seen]
    assert metres[0] == pytest.approx(metres[1], rel=1e-12)
    assert metres[2] > 1.5 * metres[0]


@pytest.mark.parametrize("size, coloured", [(20.0, False), (60.0, True)])
def test_colours_of_a_few_pixels_are_left_out(size, coloured):
    """Of a picture 900 pixels wide, 10 m are seen; the thing with values is that many large."""
    small = view.box((size / 90,) * 3)
    values = np.arange(len(small[0]), dtype=float)
    both = {"wide": view.box((10.0, 1.0, 1.0)), "small": view.Thing(*small, values=values)}
    scene = view.Scene("", both, view=(0, -1, 0), up=(0, 0, 1))
    assert things.seen(scene, 900).coloured is coloured
