"""One, two and three ranks: the same numbers, the same errors, no hang."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cases.long import SHARED_BY
from cases.paths import RANKS
from cases.ranks.environment import on_ranks, written_on, written_on_each
from rom.errors import MaterialError, RomError

pytest.importorskip("dolfinx", reason="dolfinx is not installed")
pytestmark = [pytest.mark.fenicsx, pytest.mark.mpi]

UNDER_MPI = RANKS / "under_mpi.py"


def run_model(folder, n, cells, degree):
    path = folder / f"{n}.npz"
    return written_on(n, path, UNDER_MPI, "model", path, cells, degree)


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ranks")
    return {n: run_model(folder, n, "6,2,2", 2) for n in (1, *SHARED_BY)}


@pytest.mark.parametrize("n", SHARED_BY)
def test_ranks_agree_with_one_process(runs, n):
    """Frequencies and mass to 1e-9, interfaces node by node, shapes with their signs.

    Entries of the mass that are zero are stored nowhere.
    """
    one, many = runs[1], runs[n]
    assert set(one) == set(many)
    for name in ("free", "fixed", "tied", "mass", "entries"):
        assert_allclose(many[name], one[name], rtol=1e-9)
    assert np.array_equal(many["triangles"], one["triangles"])
    for name in set(one) - {"free", "fixed", "tied", "triangles", "entries"}:
        tolerance = 1e-9 if "shapes" in name else 1e-11
        assert_allclose(many[name], one[name], atol=tolerance * np.abs(one[name]).max())
    assert np.all(one["tied"][6:] > 1.0002 * one["free"][6:10])  # other models: ends are stiff


@pytest.mark.long
def test_fewer_cells_than_ranks(tmp_path):
    """Six tetrahedra on eight ranks: some own nothing."""
    one = run_model(tmp_path, 1, "1,1,1", 1)
    many = run_model(tmp_path, 8, "1,1,1", 1)
    for name in ("free", "fixed", "mass"):
        assert_allclose(many[name], one[name], rtol=1e-9)


@pytest.mark.parametrize(
    ("kind", "code", "words"),
    [
        ("one", 4, "rank 1: MaterialError: rho = 0 on one rank."),
        ("bug", 1, "IndexError: nobody foresaw this"),
        ("together", 4, "MaterialError: rho = 0 on the last rank."),
        ("all", 4, "MaterialError: 2 ranks met: rank 1 failed: IndexError: list index out of"),
        ("root", 6, "ParallelError: rank 0 failed: ZeroDivisionError: division by zero"),
    ],
)
def test_a_rank_that_fails_ends_all_within_seconds(kind, code, words):
    done = on_ranks(2, UNDER_MPI, "fail", kind, timeout=60)
    assert done.returncode == code
    assert words in done.stderr
    assert done.stderr.count(words) == 1


def test_on_one_rank_errors_pass_as_they_are():
    from mpi4py import MPI

    from rom.fe.parallel import collective, on_root

    assert on_root(MPI.COMM_SELF, lambda a, b: a + b, 1, b=2) == 3
    with pytest.raises(ZeroDivisionError):
        on_root(MPI.COMM_SELF, lambda: 1 / 0)
    with pytest.raises(MaterialError), collective(MPI.COMM_SELF):
        raise MaterialError("no")
    assert issubclass(MaterialError, RomError)


@pytest.mark.parametrize("n", SHARED_BY)
def test_interfaces_of_one_rank_and_of_all_ranks(n, tmp_path):
    """All ranks ask for the interface of one of them; one of all is gathered from each."""
    one, many = (reduced_on(ranks, tmp_path) for ranks in (1, n))
    assert many["ranks of end"] < n
    assert many["ranks of side"] == n
    for name in set(one) - {"ranks of end", "ranks of side"}:
        assert_allclose(many[name], one[name], rtol=1e-9, err_msg=name)


def reduced_on(n, folder):
    path = folder / f"{n}.npz"
    return written_on(n, path, RANKS / "interfaces_under_mpi.py", path, timeout=120)


@pytest.fixture(scope="module")
def by_methods(tmp_path_factory):
    folder, script = tmp_path_factory.mktemp("methods"), RANKS / "methods_under_mpi.py"
    return written_on_each((1, *SHARED_BY), folder, script, ending="json")


@pytest.mark.long
@pytest.mark.parametrize("n", SHARED_BY)
def test_every_method_is_blind_to_the_number_of_processes(by_methods, n):
    assert len(by_methods[1]) == 18
    for name, one in by_methods[1].items():
        assert len(one) >= 4, name
        assert_allclose(by_methods[n][name], one, rtol=1e-9, err_msg=name)


def test_a_rank_that_dies_ends_the_others():
    """As when the machine kills the largest process: the others would wait for ever."""
    done = on_ranks(2, UNDER_MPI, "die", timeout=60)
    assert done.returncode != 0
    assert "signal 9 (Killed)" in done.stdout + done.stderr
