"""One, two and three ranks: the same numbers and body files, the same errors, no hang, no rush."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.long import ROM_LONG, SHARED_BY
from cases.paths import RANKS, ROOT
from cases.ranks.environment import ENVIRONMENT, on_ranks, written_on_each
from rom.process.launcher import YIELD_VARIABLE
from rom.process.mpirun import OPEN_MPI, found, version

pytestmark = [pytest.mark.fenicsx, pytest.mark.mpi]
UNDER_MPI = RANKS / "under_mpi.py"


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    folder, words = tmp_path_factory.mktemp("ranks"), (UNDER_MPI, "model", "6,2,2", 2)
    return written_on_each((1, *SHARED_BY), folder, *words)


@pytest.mark.parametrize("n", SHARED_BY)
def test_ranks_agree_with_one_process(runs, n):
    """To 1e-9, node by node, with signs of shapes; zero entries of the mass are stored nowhere."""
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
    found = written_on_each((1, 8), tmp_path, UNDER_MPI, "model", "1,1,1", 1)
    for name in ("free", "fixed", "mass"):
        assert_allclose(found[8][name], found[1][name], rtol=1e-9)


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
    assert done.stderr.count(words) == 1


@pytest.mark.parametrize("n", SHARED_BY)
def test_interfaces_of_one_rank_and_of_all_ranks(n, tmp_path):
    script = RANKS / "interfaces_under_mpi.py"
    one, many = written_on_each((1, n), tmp_path, script, timeout=120).values()
    assert many["ranks of end"] < n
    assert many["ranks of side"] == n
    for name in set(one) - {"ranks of end", "ranks of side"}:
        assert_allclose(many[name], one[name], rtol=1e-9, err_msg=name)


@pytest.mark.long
def test_every_method_is_blind_to_the_number_of_processes(tmp_path):
    script = RANKS / "methods_under_mpi.py"
    found = written_on_each((1, *SHARED_BY), tmp_path, script, ending="json")
    assert len(found[1]) == 18
    for name, one in found[1].items():
        assert len(one) >= 4, name
        for n in SHARED_BY:
            assert_allclose(found[n][name], one, rtol=1e-9, err_msg=name)


def test_a_rank_that_dies_ends_the_others():
    """As when the machine kills the largest process: the others would wait for ever."""
    done = on_ranks(2, UNDER_MPI, "die", timeout=60)
    assert done.returncode != 0
    assert "signal 9 (Killed)" in done.stdout + done.stderr


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


def test_whoever_waits_for_the_first_rank_sleeps_and_is_told_that_one_is_faster(run):
    """Open MPI is told so by the variable before it starts, by a call after that."""
    first, other = run[0]["spent"]
    assert first > WORK_SECONDS
    assert other < 0.25 * WORK_SECONDS
    assert run[1].count("one process is faster") == 1
    assert "dofs are shared by 2 processes; below 30000" in run[1]
    if version(found()).startswith(OPEN_MPI):
        assert run[0]["told"] == [[True], [True]]


ROD = ROOT / "meshes" / "connecting_rod.geo"
# modes of nearly one frequency are defined to round-off over the distance of their eigenvalues: in
# none of these rods two are closer than 1e-3, with fourier:1,1 and rbe2 two are 1.3e-4 apart
SIZE = "8e-3" if ROM_LONG else "14e-3"
KINDS = {"average and functions": ["pin_a=rbe3", "pin_b=polynomial:1"]}
if ROM_LONG:
    KINDS["stiff and average"] = ["pin_a=rbe2", "pin_b=rbe3"]
    KINDS["functions"] = ["pin_a=polynomial:1", "pin_b=fourier:1,1"]


@pytest.fixture(scope="module", params=KINDS)
def bodies(request, tmp_path_factory):
    folder, written = tmp_path_factory.mktemp("bodies"), {}
    for n in (1, *SHARED_BY):
        written[n] = folder / f"{n}.rom.npz"
        command = ["-m", "rom", "reduce"]
        command += [str(ROD), "-p", f"lc={SIZE}", "--E", "210e9", "--nu", "0.3", "--rho", "7850"]
        command += [word for kind in KINDS[request.param] for word in ("-i", kind)]
        command += ["-m", "20", "--reference", "pin_a", "-q", "-o", str(written[n])]
        done = on_ranks(n, *command)
        assert written[n].exists(), done.stderr
    return {n: rom.load(path) for n, path in written.items()}


def contents(body):
    """(name, array, size against which it counts); a frame makes parts of markers zero."""
    shape = np.abs(body.surface.shape).max()
    turn = max(np.abs(marker.rotation).max() for marker in body.markers.values())
    for name in ("mass", "first_moment", "inertia", "S", "Ibar_kl", "S_kl", "K", "omega"):
        array = np.asarray(getattr(body, name))
        yield name, array, np.abs(array).max()
    for marker in body.markers.values():
        yield f"{marker.name} point", marker.point, body.size
        yield f"{marker.name} translation", marker.translation, shape
        yield f"{marker.name} rotation", marker.rotation, turn
        yield f"{marker.name} hold", marker.hold, np.abs(marker.hold).max()
    yield "surface", body.surface.points, body.size
    yield "triangles", body.surface.triangles, 0.0
    yield "shapes", body.surface.shape, shape


@pytest.mark.parametrize("n", SHARED_BY)
def test_the_body_has_the_same_content_on_any_number_of_processes(bodies, n):
    pairs = zip(contents(bodies[1]), contents(bodies[n]), strict=True)
    for (name, one, size), (_, many, _) in pairs:
        assert_allclose(many, one, rtol=0, atol=1e-9 * size, err_msg=name)
    assert bodies[n].labels == bodies[1].labels
    for one, many in zip(bodies[1].certificate.rows, bodies[n].certificate.rows, strict=True):
        assert (one.quantity, one.ok) == (many.quantity, many.ok)


def test_a_script_that_fails_on_one_rank_after_the_model_ends_on_all():
    """Nobody installed a hook: the model did."""
    script = (
        "from mpi4py import MPI; import rom; "
        f"model = rom.fe.model({str(ROD)!r}, material=rom.Material(E=2e11, nu=0.3, rho=7850.0), "
        "parameters={'lc': 0.012}); "
        "1 / (MPI.COMM_WORLD.rank - 1); MPI.COMM_WORLD.Barrier()"
    )
    done = on_ranks(3, "-c", script, timeout=60)
    assert done.returncode != 0
    assert done.stderr.count("ZeroDivisionError: division by zero") == 1
