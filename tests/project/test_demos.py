"""Every demo runs and ends in numbers that agree with what is known."""

import runpy
import sys

import pytest

from cases.demos import DEMOS, LEFT_BEHIND

pytest.importorskip("dolfinx", reason="demos start from finite elements")
pytestmark = [pytest.mark.fenicsx, pytest.mark.slow]


@pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")
@pytest.mark.parametrize("demo", DEMOS, ids=lambda path: path.stem)
def test_demo_ends_in_the_numbers_expected(demo, tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", [str(demo), "--quiet", "--out", str(tmp_path)])
    results = runpy.run_path(str(demo), run_name="__main__")["results"]
    assert len(results) >= 4
    for name, (value, expected, tolerance) in results.items():
        assert value == pytest.approx(expected, rel=tolerance, abs=0), name
    assert {path.name for path in tmp_path.iterdir()} == LEFT_BEHIND[demo.stem]
