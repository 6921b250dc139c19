"""Every demo with finite elements runs unchanged on two processes, and ends in the same numbers."""

import json
import subprocess
import sys

import pytest

from rom.process.mpirun import mpirun

pytest.importorskip("dolfinx", reason="demos start from finite elements")
from cases.files.demos import DEMOS, LONG_DEMOS, MESHED, ON_TWO_PROCESSES, check
from cases.long import ROM_LONG
from cases.paths import RANKS
from cases.ranks.environment import ENVIRONMENT

# another test file may run on the same two cores
pytestmark = [
    pytest.mark.fenicsx, pytest.mark.slow, pytest.mark.mpi, pytest.mark.timeout(1800),
]  # fmt: skip
SHARED = [demo for demo in MESHED if ROM_LONG or demo.stem in ON_TWO_PROCESSES]


@pytest.mark.parametrize("demo", SHARED, ids=lambda path: path.stem)
def test_demo_runs_unchanged_on_two_processes(demo, tmp_path):
    out, file = tmp_path / "out", tmp_path / "results.json"
    done = subprocess.run(
        [*mpirun(2), sys.executable, str(RANKS / "demo_under_mpi.py"),
         str(file), str(demo), "--quiet", "--out", str(out)],
        env=ENVIRONMENT, capture_output=True, text=True, timeout=1740, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("mass [kg]: ") == 1
    check(demo, json.loads(file.read_text()), out)


def test_what_runs_on_two_processes_has_a_mesh():
    """A name that is none would let a demo run nowhere, or only alone."""
    assert {demo.stem for demo in MESHED} >= ON_TWO_PROCESSES
    assert {demo.stem for demo in DEMOS} > LONG_DEMOS
    assert not LONG_DEMOS & ON_TWO_PROCESSES
