"""Orders of arguments of earlier versions still work, and say so."""

import numpy as np
import pytest

from rom import view
from rom.deprecated import path_came_first
from rom.report import html


@path_came_first(1, 2, 0)
def draw(t, panels, path, *, title=""):
    """What was handed over."""
    return t, panels, path, title


@path_came_first(1, 0, suffix=".fmu")
def export(script, path):
    return script, path


def test_the_earlier_order_gives_the_same_and_warns():
    t = np.arange(3.0)
    with pytest.warns(DeprecationWarning, match="draw takes the path behind"):
        found = draw("a.png", t, ["p"], title="x")
    assert found[0] is t and found[1:] == (["p"], "a.png", "x")
    assert draw(t, ["p"], "a.png", title="x")[1:] == (["p"], "a.png", "x")
    with pytest.warns(DeprecationWarning, match="export takes the path behind"):
        assert export("m.fmu", "m.py") == ("m.py", "m.fmu")
    assert export("m.py", "m.fmu") == ("m.py", "m.fmu")
    assert draw.__doc__ == "What was handed over."


@pytest.mark.once
def test_a_report_and_a_picture_in_the_earlier_order(tmp_path):
    with pytest.warns(DeprecationWarning, match="write_report takes the path behind"):
        html.write_report(tmp_path / "old.html", "title", {"one": ["<p>x</p>"]})
    html.write_report({"one": ["<p>x</p>"]}, tmp_path / "new.html", "title")
    assert (tmp_path / "old.html").read_text() == (tmp_path / "new.html").read_text()
    pytest.importorskip("matplotlib", reason="matplotlib is not installed")
    curve = [("x [m]", {"a": np.arange(3.0)})]
    with pytest.warns(DeprecationWarning, match="history takes the path behind"):
        view.history(tmp_path / "a.png", np.arange(3.0), curve, title="t", caption="c")
    view.history(np.arange(3.0), curve, tmp_path / "b.png", title="t", caption="c")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
