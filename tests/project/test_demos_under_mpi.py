"""Every demo with finite elements runs unchanged on two processes."""

import os
import subprocess
import sys

import pytest

pytest.importorskip("dolfinx", reason="demos start from finite elements")
from cases.demos import DEMOS, LEFT_BEHIND

# another test file may run on the same two cores
pytestmark = [
    pytest.mark.fenicsx, pytest.mark.slow, pytest.mark.mpi, pytest.mark.timeout(1800),
]  # fmt: skip
MESHED = [path for path in DEMOS if "rom.fe" in path.read_text()]


@pytest.mark.parametrize("demo", MESHED, ids=lambda path: path.stem)
def test_demo_runs_unchanged_on_two_processes(demo, tmp_path):
    allow = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    done = subprocess.run(
        ["mpirun", "-n", "2", "--oversubscribe", sys.executable, str(demo), "-q", "--out",
         str(tmp_path)],
        env=os.environ | allow | {"OMP_NUM_THREADS": "1"},
        capture_output=True, text=True, timeout=1740, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("mass [kg]: ") == 1
    assert {path.name for path in tmp_path.iterdir()} == LEFT_BEHIND[demo.stem]
