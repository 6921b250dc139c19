"""What a process under mpirun is started with."""

import json
import os

import numpy as np

from cases.command import python
from cases.paths import PYTHONPATH, ROOT
from rom.process.mpirun import mpirun

ENVIRONMENT = os.environ | {
    "PYTHONPATH": PYTHONPATH,
    "OMP_NUM_THREADS": "1",
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_mpi_yield_when_idle": "1",
}


def on_ranks(n, *words, **options):
    """A finished process of Python on n ranks, its texts captured."""
    options = {"env": ENVIRONMENT, "cwd": ROOT, "timeout": 600} | options
    return python(*words, launcher=mpirun(n), **options)


def written_on(n, file, *words, load=None, **options):
    """What a script on n ranks, whose words name the file, has written into it, .npz or .json."""
    done = on_ranks(n, *words, **options)
    assert file.exists(), done.stderr
    if load:
        return load(file)
    return json.loads(file.read_text()) if file.suffix == ".json" else dict(np.load(file))


def written_on_each(ranks, folder, *words, ending="npz", **options):
    """{number of ranks: what a script, whose last word is the file, has written}."""
    files = {n: folder / f"{n}.{ending}" for n in ranks}
    return {n: written_on(n, file, *words, file, **options) for n, file in files.items()}
