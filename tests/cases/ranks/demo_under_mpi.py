"""Run by test_demos.py under mpirun: a demo as users run it, its numbers into a file."""

import json
import runpy
import sys
from pathlib import Path

from mpi4py import MPI

file, *sys.argv = sys.argv[1:]
results = runpy.run_path(sys.argv[0], run_name="__main__")["results"]
if MPI.COMM_WORLD.rank == 0:
    Path(file).write_text(json.dumps(results, default=float))
