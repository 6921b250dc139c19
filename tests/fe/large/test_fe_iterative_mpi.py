"""The path without a factor finds the same on any number of processes, and as a factor does."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cases.long import SHARED_BY
from cases.paths import RANKS
from cases.ranks.environment import written_on

pytest.importorskip("dolfinx", reason="dolfinx is not installed")
pytestmark = [pytest.mark.fenicsx, pytest.mark.mpi]


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """{case: what was found}, by a factor in one process, and without by one and more."""
    folder, found = tmp_path_factory.mktemp("iterative"), {}
    script = str(RANKS / "iterative_under_mpi.py")
    for solver, ranks in (("direct", 1), *(("iterative", n) for n in (1, *SHARED_BY))):
        file = folder / f"{solver}{ranks}.npz"
        found[solver, ranks] = written_on(ranks, file, script, solver, file, timeout=300)
    return found


@pytest.mark.parametrize("n", (1, *SHARED_BY))
@pytest.mark.parametrize("against", ["iterative", "direct"])
def test_frequencies_and_stiffness_do_not_depend_on_how_many_solve(runs, n, against):
    one, many = runs[against, 1], runs["iterative", n]
    for name in ("free", "modes", "held"):
        assert one[name].size >= 6
        assert_allclose(many[name], one[name], rtol=1e-9, err_msg=name)
    springs = one["springs"]
    assert_allclose(many["springs"], springs, atol=1e-9 * np.abs(springs).max())


@pytest.mark.parametrize("n", (1, *SHARED_BY))
def test_each_says_how_surely_no_mode_is_missed(runs, n):
    assert 0.0 < runs["iterative", n]["missed"] < 1e-9
