"""What a reader trips over in a figure is found, each fault by its own words."""

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="pictures need matplotlib")

from matplotlib.figure import Figure

from cases.figures.pictures import faults
from rom.view.figures.curves import line_look

X = np.linspace(0.0, 1.0, 9)


def diagram(**names):
    figure = Figure(figsize=(6, 4), dpi=100)
    axes = figure.subplots()
    axes.set(xlabel="time [s]", ylabel="angle [rad]", **names)
    return figure, axes


def alike(axes):
    axes.plot(X, X, "r--", label="one")
    axes.plot(X, X**2, "r--", label="other")


def empty(axes):
    axes.plot(X, X)
    axes.set_ylim(-5.0, 5.0)


def without_name(axes):
    axes.plot(X, X)
    axes.set_xlabel("")


def stray(axes):
    axes.plot(X, X)
    axes.annotate("6x", (1.06, 0.5), annotation_clip=False)


def crowded(axes):
    axes.plot(X, X)
    axes.text(0.4, 0.5, "first words")
    axes.text(0.42, 0.5, "others")


def off_the_page(axes):
    axes.plot(X, X)
    axes.set_title("A title that is longer than the page is wide, and then some more " * 2)


@pytest.mark.parametrize(
    "fault, words",
    [
        (alike, "'one' and 'other' look the same"),
        (empty, "takes 10% of the height"),
        (without_name, "the horizontal axis has no name"),
        (stray, "'6x' leaves the diagram"),
        (crowded, "'first words' lies on 'others'"),
        (off_the_page, "leaves the page"),
    ],
)
def test_a_fault_is_found(fault, words):
    figure, axes = diagram()
    fault(axes)
    found = faults(figure)
    assert len(found) == 1
    assert words in found[0]


def test_two_dozen_curves_all_look_different():
    figure, axes = diagram()
    for k in range(24):
        axes.plot(X, X * k, label=f"curve {k}", **line_look(k))
    assert not faults(figure)
