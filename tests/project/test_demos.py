"""Every demo runs and ends in numbers that agree with what is known, on two processes too."""

import json
import runpy
import sys

import pytest

pytest.importorskip("dolfinx", reason="demos start from finite elements")
pytest.importorskip("matplotlib", reason="pictures need matplotlib")

from cases.figures.pictures import faults
from cases.files.demos import DEMOS, LONG_DEMOS, MESHED, check
from cases.long import ROM_LONG
from cases.paths import RANKS
from cases.ranks.environment import on_ranks
from rom.view.canvas.picture import Picture

pytestmark = [pytest.mark.fenicsx, pytest.mark.slow]
ALONE = [demo for demo in DEMOS if ROM_LONG or demo.stem not in LONG_DEMOS]


@pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")
@pytest.mark.parametrize("demo", ALONE, ids=lambda path: path.stem)
def test_demo_ends_in_the_numbers_expected(demo, tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", [str(demo), "--quiet", "--out", str(tmp_path)])
    found, save = [], Picture.save

    def looked_at(picture, path):
        found.extend(f"{path}: {fault}" for fault in faults(picture))
        return save(picture, path)

    monkeypatch.setattr(Picture, "save", looked_at)
    check(demo, runpy.run_path(str(demo), run_name="__main__")["results"], tmp_path)
    assert not found


@pytest.mark.long
@pytest.mark.mpi
@pytest.mark.timeout(1800)  # another test file may run on the same two cores
@pytest.mark.parametrize("demo", MESHED, ids=lambda path: path.stem)
def test_demo_runs_unchanged_on_two_processes(demo, tmp_path):
    out, file = tmp_path / "out", tmp_path / "results.json"
    words = (RANKS / "demo_under_mpi.py", file, demo, "--quiet", "--out", out)
    done = on_ranks(2, *words, timeout=1740)
    assert done.returncode == 0, done.stderr
    results = json.loads(file.read_text())
    said = [line.rpartition(": ")[0] for line in done.stdout.splitlines()]
    assert [said.count(name) for name in results] == [1] * len(results)
    check(demo, results, out)
