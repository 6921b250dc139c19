"""Every method gives the same frequencies on one, two and three processes."""

import numpy as np
import pytest

from cases.long import SHARED_BY
from cases.paths import RANKS
from cases.ranks.environment import written_on

pytest.importorskip("dolfinx", reason="dolfinx is not installed")
pytestmark = [pytest.mark.fenicsx, pytest.mark.mpi]
SCRIPT = RANKS / "methods_under_mpi.py"


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    files = {n: tmp_path_factory.mktemp("methods") / f"{n}.json" for n in (1, *SHARED_BY)}
    return {n: written_on(n, file, SCRIPT, file) for n, file in files.items()}


@pytest.mark.long
@pytest.mark.parametrize("n", SHARED_BY)
def test_every_method_is_blind_to_the_number_of_processes(found, n):
    assert len(found[1]) == 18
    for name, one in found[1].items():
        many = np.array(found[n][name])
        assert len(one) >= 4, name
        assert many == pytest.approx(np.array(one), rel=1e-9), name
