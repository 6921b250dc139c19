"""A sector shared among ranks is the sector of one process, on each of them."""

import json
import subprocess
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cases.paths import RANKS, ROOT
from rom.process.mpirun import mpirun

pytest.importorskip("dolfinx", reason="dolfinx is not installed")
from cases.ranks.environment import ENVIRONMENT
from cases.ranks.sectors_under_mpi import wheel

pytestmark = [
    pytest.mark.fenicsx, pytest.mark.mpi,
    pytest.mark.filterwarnings("ignore::rom.errors.RomWarning"),
]  # fmt: skip
SCRIPT = RANKS / "sectors_under_mpi.py"


@pytest.fixture(scope="module")
def every(tmp_path_factory):
    file = tmp_path_factory.mktemp("sectors") / "ranks.json"
    done = subprocess.run(
        [*mpirun(3), sys.executable, str(SCRIPT), str(file)],
        env=ENVIRONMENT, timeout=600, capture_output=True, text=True, check=False,
        cwd=ROOT,
    )  # fmt: skip
    assert file.exists(), done.stderr
    return json.loads(file.read_text())


@pytest.mark.long
def test_three_ranks_find_the_waves_of_one_process(every, monkeypatch):
    monkeypatch.chdir(ROOT)
    one, _ = wheel()
    assert len(every) == 3 and len(one) == 8
    for found, _ in every:
        assert set(found) == set(one)
        for name, values in one.items():
            assert_allclose(found[name], values, rtol=1e-9, err_msg=name)
    assert np.all(np.array(one["loaded"]) < one["at rest"])


@pytest.mark.long
def test_all_ranks_refuse_alike(every):
    said = [errors for _, errors in every]
    assert said[0] == said[1] == said[2]
    assert said[0]["interface"].startswith("InterfaceError: the model has no interface 'rim'")
    assert said[0]["region"].startswith("ConfigError: the sector has no region 'rim'")
    assert said[0]["memory"].startswith("ResourceError: each of 3 ranks needs all")
