"""Where the project lies; nobody else counts folders upwards."""

import os
from pathlib import Path

ROOT = Path(__file__).parents[2]
TESTS = ROOT / "tests"
RANKS = TESTS / "cases" / "ranks"  # programs that run under mpirun
# of processes that a test starts, for the project and for what tests share
PYTHONPATH = os.pathsep.join([str(ROOT), str(TESTS)])
