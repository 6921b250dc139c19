"""Ranks that wait leave their core to others, and a small model says that it needs but one."""

import json

import pytest

from cases.paths import RANKS
from cases.ranks.environment import ENVIRONMENT, on_ranks
from rom.process.launcher import YIELD_VARIABLE
from rom.process.mpirun import OPEN_MPI, found, version

pytest.importorskip("dolfinx", reason="dolfinx is not installed")
pytestmark = [pytest.mark.fenicsx, pytest.mark.mpi]
WORK_SECONDS = 0.6  # of the first rank


@pytest.fixture(scope="module", params=["rom", "MPI"])
def run(request, tmp_path_factory):
    """Two ranks with rom or MPI imported first, and nothing in the environment that helps them."""
    file = tmp_path_factory.mktemp("waits") / "found.json"
    plain = {name: value for name, value in ENVIRONMENT.items() if name != YIELD_VARIABLE}
    words = (RANKS / "waits_under_mpi.py", request.param, file)
    done = on_ranks(2, *words, env=plain, timeout=120)
    assert file.exists(), done.stderr
    return json.loads(file.read_text()), done.stderr


def test_whoever_waits_for_the_first_rank_sleeps(run):
    first, other = run[0]["spent"]
    assert first > WORK_SECONDS
    assert other < 0.25 * WORK_SECONDS


def test_open_mpi_is_told_to_let_others_run(run):
    """By the variable before it starts, by a call after that."""
    if not version(found()).startswith(OPEN_MPI):
        pytest.skip("another MPI, which has no such word")
    assert run[0]["told"] == [[True], [True]]


def test_a_small_model_says_that_one_process_is_faster(run):
    assert run[1].count("one process is faster") == 1
    assert "dofs are shared by 2 processes; below 30000" in run[1]
