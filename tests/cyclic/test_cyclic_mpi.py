"""A sector shared among ranks is the sector of one process, on each of them."""

import json
from itertools import chain

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cases.long import MESHED
from cases.paths import RANKS, ROOT
from cases.ranks.environment import on_ranks

pytest.importorskip("dolfinx", reason="dolfinx is not installed")
from cases.ranks.sectors_under_mpi import wheel
from rom.fe.operators.workers import shared_out

pytestmark = [*MESHED, pytest.mark.mpi]


@pytest.fixture(scope="module", params=[2, 3])
def every(tmp_path_factory, request):
    file = tmp_path_factory.mktemp("sectors") / "ranks.json"
    done = on_ranks(request.param, RANKS / "sectors_under_mpi.py", file)
    assert file.exists(), done.stderr
    return json.loads(file.read_text())


@pytest.fixture(scope="module")
def one():
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        return wheel()[0]


@pytest.mark.long
def test_ranks_find_the_waves_of_one_process(every, one):
    assert len(one) == 19
    for found, *_ in every:
        assert set(found) == set(one)
        for name, values in one.items():
            assert_allclose(found[name], values, rtol=1e-9, err_msg=name)
    assert np.all(np.array(one["loaded"]) < one["at rest"])

    shares = [mine for _, _, mine in every]  # each number of diameters is of one rank
    together = sorted(chain.from_iterable(shares))
    assert all(shares) and together == list(range(len(together))) and len(together) > 4


@pytest.mark.long
def test_all_ranks_refuse_alike(every):
    said = [errors for _, errors, _ in every]
    assert all(other == said[0] for other in said)
    for where, words in (
        ("interface", "InterfaceError: the model has no interface 'rim'"),
        ("region", "ConfigError: the sector has no region 'rim'"),
        ("memory", f"ResourceError: each of {len(said)} ranks needs all"),
        ("diameter", "ConfigError: diameter = 99 must be"),
        ("one rank", "ModesMissedError: 3 modes were found."),
        ("bug", "IndexError"),
    ):
        assert words in said[0][where]


@pytest.mark.parametrize("n_ranks", [1, 2, 3, 7])
def test_every_item_has_one_rank_and_none_works_much_longer_than_another(n_ranks):
    costs = [1.0, 4.0, 4.0, 4.0, 4.0, 4.0, 1.0]
    work = np.bincount(shared_out(costs, n_ranks), costs, minlength=n_ranks)
    assert work.sum() == sum(costs)
    assert work.max() <= 4 / 3 * max(4.0, sum(costs) / n_ranks)
