"""Every demo with finite elements runs unchanged on two processes, and ends in the same numbers."""

import json
import subprocess
import sys

import pytest

from rom.process.mpirun import mpirun

pytest.importorskip("dolfinx", reason="demos start from finite elements")
from cases.files.demos import MESHED, check
from cases.paths import RANKS
from cases.ranks.environment import ENVIRONMENT

# another test file may run on the same two cores
pytestmark = [
    pytest.mark.fenicsx, pytest.mark.long, pytest.mark.mpi, pytest.mark.timeout(1800),
]  # fmt: skip


@pytest.mark.parametrize("demo", MESHED, ids=lambda path: path.stem)
def test_demo_runs_unchanged_on_two_processes(demo, tmp_path):
    out, file = tmp_path / "out", tmp_path / "results.json"
    done = subprocess.run(
        [*mpirun(2), sys.executable, str(RANKS / "demo_under_mpi.py"),
         str(file), str(demo), "--quiet", "--out", str(out)],
        env=ENVIRONMENT, capture_output=True, text=True, timeout=1740, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    results = json.loads(file.read_text())
    said = [line.rpartition(": ")[0] for line in done.stdout.splitlines()]
    assert [said.count(name) for name in results] == [1] * len(results)
    check(demo, results, out)
