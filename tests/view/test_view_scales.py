"""Numbers on axes: prefixes, degrees, and round-off that is no signal."""

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="pictures need matplotlib")
from matplotlib.figure import Figure

from rom import view
from rom.view.canvas import scales
from rom.view.canvas.scales import clock_texts, prefixed, readable, without_round_off, written

READ_AS = """
0.00012 m = 120 µm, 2.1e11 Pa = 210 GPa, 1500 N = 1.5 kN, 0.02 N m = 20 mN m, 5e3 N/m = 5 kN/m,
2.5e4 Hz = 25 kHz, 0.05 s = 50 ms, 5e4 s = 5e4 s, 7e6 m = 7000 km, 3e6 W = 3 MW, 4e-7 J = 400 nJ,
1e-15 m = 1e-3 pm, 1000 m = 1 km, 999 m = 999 m, 3.141592653589793 rad = 180 deg, 400 rad = 400 rad,
1e-5 rad = 10 µrad, 0 m = 0 m, 1e-6 1 = 1e-6 1, 1e6 % = 1e6 %, 1e6 mm = 1e6 mm, 1e6 m^2 = 1e6 m^2,
1e6 min = 1e6 min, 1e6 kg = 1e6 kg, 1e6 1/min = 1e6 1/min
"""


@pytest.mark.parametrize("row", READ_AS.split(","))
def test_sizes_are_read_between_one_and_a_thousand(row):
    (size, unit), (value, shown) = (side.split(maxsplit=1) for side in row.split(" = "))
    factor, found = prefixed(float(size), unit)
    assert found == shown.strip() and float(size) * factor == pytest.approx(float(value), rel=1e-12)


def labels(axis):
    """{place: what stands there} with signs that `float` understands."""
    axis.figure.canvas.draw()
    texts = [text.get_text().replace("\u2212", "-") for text in axis.get_ticklabels()]
    return dict(zip(axis.get_ticklocs().tolist(), texts, strict=True))


def drawn(x, y, xlabel, ylabel):
    axes = Figure().subplots()
    axes.plot(x, y)
    axes.set_xlabel(xlabel)
    axes.set_ylabel(ylabel)
    return axes


def test_ticks_are_round_in_the_unit_that_is_read_but_on_logarithms_and_ratios():
    axes = drawn([0.0, 2.1e11], [-np.pi, np.pi], "stress [Pa]", "angle of the crank [rad]")
    readable(axes)
    assert axes.get_xlabel() == "stress [GPa]"
    assert axes.get_ylabel() == "angle of the crank [deg]"
    across, upwards = labels(axes.xaxis), labels(axes.yaxis)
    assert {"0", "100", "200"} <= set(across.values())
    for at, text in across.items():
        assert float(text) == pytest.approx(1e-9 * at, abs=1e-9)
    assert {"-100", "0", "100"} <= set(upwards.values())
    for at, text in upwards.items():
        assert float(text) == pytest.approx(np.rad2deg(at), abs=1e-6)
        assert float(text) % 5 == 0
    axes = drawn([1e-3, 1e3], [1e-6, 1e-3], "frequency [Hz]", "relative error")
    axes.set_xscale("log")
    before = labels(axes.xaxis), labels(axes.yaxis)
    readable(axes)
    assert (labels(axes.xaxis), labels(axes.yaxis)) == before
    assert axes.get_xlabel() == "frequency [Hz]"


def test_axes_of_one_scale_have_one_unit_and_near_ticks_digits_that_tell_them_apart():
    axes = drawn([0.0, 1.0], [2.10001e11, 2.10002e11], "x", "E [Pa]")
    readable(axes)
    texts = labels(axes.yaxis).values()
    assert len(set(texts)) == len(texts) > 3
    axes = drawn([0.0, 2.0], [0.0, 0.02], "x [m]", "y [m]")
    readable(axes, alike=True)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [m]", "y [m]")
    readable(axes)
    assert axes.get_ylabel() == "y [mm]"


@pytest.mark.parametrize(
    "label", ["log10 of the gap [m]", "way [m], angle [rad]", "way", "way [mm]", "count [1]", "[%]"]
)
def test_labels_that_do_not_end_with_one_unit_of_the_axis_are_left_alone(label):
    axes = drawn([0.0, 1.0], [0.0, 1e-4], "x", label)
    before = labels(axes.yaxis)
    readable(axes)
    assert axes.get_ylabel() == label and labels(axes.yaxis) == before


def test_round_off_is_flat_also_in_a_panel_and_what_is_larger_as_it_is():
    noise = 1e-16 * np.array([1.0, -2.0, 3.0])
    signal = np.array([0.0, 1.0, 2.0])
    flat, kept, gap = without_round_off([noise, signal, np.array([3.0, np.nan, 3.0 + 1e-12])])
    np.testing.assert_array_equal(flat, 0.0)
    np.testing.assert_array_equal(kept, signal)
    np.testing.assert_array_equal(gap[[0, 2]], gap[0])
    assert np.isnan(gap[1]) and gap[0] == pytest.approx(3.0)
    small = 1e-8 * signal
    np.testing.assert_array_equal(without_round_off([small, signal])[0], small)
    np.testing.assert_array_equal(without_round_off([noise])[0], noise)  # nothing to compare with
    one, two = without_round_off([np.full(3, 5.0), np.full(3, 5.0 + 1e-12)])
    assert set(one) == set(two) and len(set(one)) == 1
    assert without_round_off([]) == []
    t = np.linspace(0.0, 0.01, 50)
    wave = 2.1e11 * (1 + 1e-13 * np.sin(900 * t))
    axes = Figure().subplots()
    view.history(t, [("stress [Pa]", {"one": wave})], ax=axes)
    (line,) = axes.lines
    assert np.ptp(line.get_ydata()) == 0.0
    low, high = axes.get_ylim()
    assert high - low > 1e-2 * 2.1e11
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time [ms]", "stress [GPa]")
    np.testing.assert_array_equal(line.get_xdata(), t)  # data stays in SI


def test_clocks_have_one_unit_and_lengths_are_round():
    assert clock_texts(np.array([0.0, 5e-7, 2e-6])) == ["t = 0.000 µs", "t = 0.500 µs",
                                                        "t = 2.000 µs"]  # fmt: skip
    assert clock_texts(np.array([10.0, 30.0])) == ["t = 10.00 s", "t = 30.00 s"]
    assert clock_texts(np.zeros(1)) == ["t = 0.000 s"]
    assert [scales.round_length(x) for x in (1.0, 1.9, 4.99, 0.051, 730.0)] == [1, 1, 2, 0.05, 500]
    assert written(0.02, "m") == "20 mm" and written(-3e5, "N") == "-300 kN"
