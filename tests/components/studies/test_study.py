"""Studies: the same table by every engine, rows that fail, files that survive, indices."""

import itertools
import os
import re
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from scipy import stats
from scipy.stats import qmc

import rom
from cases.command import ROOT, environment, python
from cases.refusals import refused
from cases.studied import Worse, fails, histories, ishigami, told
from rom.components.studies import design, indices_design, read_study
from rom.errors import ConfigError, FileFormatError, ResourceError, RomWarning
from rom.process.mpirun import mpirun

pytestmark = pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")
X = {"x": np.linspace(0.0, 1.0, 12)}
BY_MPI = """
import sys
from mpi4py.futures import MPIPoolExecutor
import numpy as np, rom
from cases.studied import histories
if __name__ == "__main__":
    with MPIPoolExecutor() as executor:
        rom.study(histories, {"x": np.linspace(0.0, 1.0, 12)}, executor=executor, into=sys.argv[1])
"""


def same(one, other):
    """Whether two studies hold the same bits."""
    assert one.failed == other.failed and one.warned == other.warned
    assert one.values.keys() == other.values.keys()
    for name, x in one.values.items():
        assert x.tobytes() == other.values[name].tobytes()


def rng(seed=1):
    return np.random.default_rng(seed)


def test_processes_threads_and_this_process_give_one_table(tmp_path):
    here = rom.study(histories, X, workers=0)
    good = np.sqrt(X["x"][:11])
    assert np.array_equal(here.values["root"][:11], good) and np.isnan(here.values["root"][11])
    assert here.failed == {11: "ValueError: too large"} and list(here.warned) == [0, 1]
    assert here.values["wave"].shape == (12, 5)
    for n in (1, 2):
        same(here, rom.study(histories, X, workers=n, into=tmp_path / f"{n}"))
        same(here, read_study(tmp_path / f"{n}"))
    with ThreadPoolExecutor(2) as executor:
        same(here, rom.study(histories, X, executor=executor))


@pytest.mark.mpi
@pytest.mark.fenicsx
def test_ranks_of_mpi_give_the_same_table(tmp_path):
    script, file = tmp_path / "by_mpi.py", tmp_path / "x.study"
    script.write_text(BY_MPI)
    paths = environment()["PYTHONPATH"] + os.pathsep + str(ROOT / "tests")
    launcher = [*mpirun(3), sys.executable, "-m", "mpi4py.futures"]
    done = subprocess.run(
        [*launcher, script, file], env=environment(PYTHONPATH=paths), timeout=120,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    same(rom.study(histories, X, workers=0), read_study(file))


@pytest.mark.slow
def test_a_cluster_of_dask_gives_the_same_table_and_may_die(tmp_path):
    distributed = pytest.importorskip("distributed", reason="dask's cluster is not installed")
    alone, file = rom.study(histories, X, workers=0), tmp_path / "x.study"
    how = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with distributed.LocalCluster(**how) as cluster, distributed.Client(cluster) as client:
        client.run(lambda path: sys.path.insert(0, path), str(ROOT / "tests"))
        same(alone, rom.study(histories, X, executor=client.get_executor()))
        log = str(tmp_path / "log")
        more = X | {"log": np.array(12 * [log]), "seconds": np.full(12, 0.1)}
        executor = client.get_executor()
        with pytest.raises(ResourceError, match="executor broke"), ThreadPoolExecutor(1) as beside:
            beside.submit(_close_when, client, tmp_path / "log")
            rom.study(told, more, executor=executor, into=file)
    kept = int(np.sum(read_study(file).seconds > 0))
    assert kept > 0
    same(alone, rom.study(told, more, workers=1, into=file, resume=True))


def _close_when(client, log):
    while not log.exists() or len(log.read_text().split()) < 5:
        time.sleep(0.01)
    client.close()


@pytest.mark.slow
def test_samples_that_fail_in_any_way_are_rows(tmp_path):
    with pytest.warns(RomWarning, match="8 of 10 samples failed"):
        found = rom.study(
            fails, {"x": np.r_[0.0, 9.0, 2.0:9.0, 1.0]}, workers=2, time_limit=1.0, memory_limit=8.0
        )
    kinds = {k: text.partition(":")[0] for k, text in found.failed.items()}
    expected = "Overtime MemoryError ConfigError ConfigError ArithmeticError TypeError ModelError"
    assert kinds == dict(zip(range(2, 9), expected.split(), strict=True)) | {9: "Killed"}
    assert np.array_equal(found.values["y"][:2], [0.0, 9.0])


def test_a_study_killed_at_any_time_goes_on_and_repeats_nothing(tmp_path):
    whole, file, log = rom.study(histories, X, workers=0), tmp_path / "x.study", tmp_path / "log"
    code = (
        "import numpy as np, rom; from cases.studied import told\nif __name__ == '__main__':\n"
        f"    x = {{'x': np.linspace(0.0, 1.0, 12), 'log': 12 * [{str(log)!r}], "
        "'seconds': 12 * [0.02]}\n"
        f"    rom.study(told, x, workers=1, into={str(file)!r}, resume=True)\n"
    )
    script = tmp_path / "run.py"
    script.write_text(code)
    paths = environment()["PYTHONPATH"] + os.pathsep + str(ROOT / "tests")
    generator, done, starts = rng(3), False, 0
    while not done and starts < 10:
        run = subprocess.Popen([sys.executable, script], env=environment(PYTHONPATH=paths))
        before, wanted = _lines(log), int(generator.integers(1, 5))
        while run.poll() is None and _lines(log) < before + wanted:
            time.sleep(0.003)
        done = run.poll() == 0
        run.send_signal(signal.SIGKILL)
        run.wait()
        starts += 1
    assert done or python(script, env=environment(PYTHONPATH=paths)).returncode == 0
    assert starts > 2
    same(whole, read_study(file))
    # what was under way, or was done but not yet written, when a kill came is done again
    assert _lines(log) <= 12 + 2 * starts


def _lines(path):
    return path.read_text().count("\n") if path.exists() else 0


def test_a_file_cut_anywhere_goes_on_to_the_same_bits_and_damage_is_named(tmp_path):
    file = tmp_path / "x.study"
    whole = rom.study(histories, X, workers=0, into=file)
    content = file.read_bytes()
    first = content.index(b"\n") + 1
    for end in rng().integers(first, len(content), 8):
        file.write_bytes(content[:end])
        same(whole, rom.study(histories, X, workers=0, into=file, resume=True))
    last = content[: content.rindex(b"\n", 0, -1) + 1]
    file.write_bytes(last + b'01234567 {"sample":11,' + 500 * b" ")
    same(whole, rom.study(histories, X, workers=0, into=file, resume=True))
    same(whole, read_study(file))
    for place in rng().integers(first, len(content) - 1, 8):
        damaged = bytearray(content)
        damaged[place] ^= 4
        file.write_bytes(damaged)
        if content[place : place + 1] != b"\n":
            with pytest.raises(FileFormatError, match=f"line {content[:place].count(10) + 1}"):
                read_study(file)


def test_a_full_disk_keeps_what_was_measured(tmp_path):
    with pytest.raises(ResourceError, match="No space left"):
        rom.study(histories, X, workers=0, into="/dev/full")


def _refused_beside(tmp_path, samples, measure=histories):
    file = tmp_path / "x.study"
    rom.study(histories, X, workers=0, into=file)
    return rom.study(measure, samples, workers=0, into=file, resume=True)


@pytest.mark.parametrize(("samples", "measure", "words"), [
    ({"x": np.linspace(0.0, 1.1, 12)}, histories, "other samples"),
    (X, fails, "another measure"),
])  # fmt: skip
def test_a_file_of_another_study_is_refused_and_stays(samples, measure, words, tmp_path):
    with pytest.raises(ConfigError, match=words):
        _refused_beside(tmp_path, samples, measure)
    assert len(read_study(tmp_path / "x.study").seconds) == 12
    with pytest.raises(ConfigError, match="exists already"):
        rom.study(histories, X, workers=0, into=tmp_path / "x.study")


def test_two_studies_never_write_one_file(tmp_path):
    def measure(x):
        with pytest.raises(ResourceError, match="another study is writing"):
            rom.study(histories, X, workers=0, into=tmp_path / "x.study", resume=True)
        return {"y": x}

    assert not rom.study(measure, {"x": [1.0]}, workers=0, into=tmp_path / "x.study").failed


test_of_bad_calls = refused(
    (lambda: rom.study(lambda x: {"y": x}, X, workers=2), "cannot be sent to another process"),
    (lambda: rom.study(Worse(), X, workers=1), "cannot be loaded by workers"),
    (lambda: rom.study(histories, {}), "samples are one list"),
    (lambda: rom.study(histories, {"x": [1.0], "y": [1.0, 2.0]}), r"all as long: 'x' \(1,\), 'y'"),
    (lambda: rom.study(histories, {"x": [np.nan]}), "'x' are finite"),
    (lambda: rom.study(histories, {"x": [None]}), "'x' are finite"),
    (lambda: rom.study(histories, X, workers=0, time_limit=1.0), "leave out workers=0"),
    (lambda: rom.study(histories, X, workers=0, into="/no/x.study"), "/no/x.study cannot be"),
    (lambda: rom.study(histories, X, workers=0, into="/proc"), "/proc cannot be written"),
    (lambda: rom.study(histories, X, keep="max(x)"), "keep= is of a mechanism file"),
    (lambda: design({"x": (1.0, 0.0)}, 4, rng=rng()), r"'x' is \(1.0, 0.0\)"),
    (lambda: design({"x": (0.0, 1.0)}, 4, log=["x"], rng=rng()), "'x' begins at 0: no logarithm"),
    (lambda: design({"x": (0.0, 1.0)}, 4, log=["y"], rng=rng()), "names no parameter"),
    (lambda: design({"x": stats.norm()}, 4, "grid"), "no ends for the distribution of 'x'"),
    (lambda: design({"x": stats.norm()}, 4, log=["x"], rng=rng()), "leave it out of log="),
    (lambda: design({}, 4, rng=rng()), "no parameter to vary"),
    (lambda: design({"x": (0.0, 1.0)}, 4), "rng=numpy.random.default_rng"),
    (lambda: rom.study(histories, X, workers=0).indices("root", rng=rng()), "indices_design"),
    (lambda: rom.study(histories, X, workers=0).quantiles("rot"), "'rot'; there are"),
    (lambda: rom.study(histories, X, workers=0).on_clock("root"), "'root' is no history"),
    error=ConfigError,
)  # fmt: skip


def test_designs_fill_their_ranges():
    ranges = {"a": (2.0, 4.0), "b": (1e-3, 1e1), "c": stats.norm(5.0, 2.0)}
    latin = design(ranges, 50, log=["b"], rng=rng())
    for x, low, high in ((latin["a"], 2.0, 4.0), (np.log(latin["b"]), np.log(1e-3), np.log(10.0))):
        bins = np.floor(50 * (x - low) / (high - low))
        assert np.array_equal(np.sort(bins), np.arange(50))  # one in each of 50 layers
    assert stats.kstest(latin["c"], stats.norm(5.0, 2.0).cdf).pvalue > 0.5
    sobol = design({"a": (0.0, 1.0), "b": (0.0, 1.0)}, 256, "sobol", rng=rng())
    even = design({"a": (0.0, 1.0), "b": (0.0, 1.0)}, 256, "random", rng=rng())
    spread = [qmc.discrepancy(np.transpose([*x.values()])) for x in (sobol, even)]
    assert spread[0] < 0.1 * spread[1]
    grid = design({"a": (0.0, 1.0), "b": (1.0, 100.0)}, 3, "grid", log=["b"])
    expected = np.array(list(itertools.product((0.0, 0.5, 1.0), (1.0, 10.0, 100.0))))
    assert np.transpose([*grid.values()]) == pytest.approx(expected)


def test_indices_are_those_of_ishigami_in_closed_form():
    # Ishigami and Homma 1990, a = 7, b = 0.1: variances of the parts
    a, b, pi = 7.0, 0.1, np.pi
    v1, v2, v13 = 0.5 * (1 + b * pi**4 / 5) ** 2, a**2 / 8, b**2 * pi**8 * 8 / 225
    whole = v1 + v2 + v13
    X = indices_design({f"x{k}": (-pi, pi) for k in (1, 2, 3)}, 2**13, rng=rng())
    found = rom.study(ishigami, X, workers=0, progress=False).indices("y", rng=rng(2))
    first, total = np.array([v1, v2, 0]) / whole, np.array([v1 + v13, v2, v13]) / whole
    # two standard errors that random points would have: 0.012 of the first, 0.017 of the total
    assert found.first == pytest.approx(first, abs=0.024)
    assert found.total == pytest.approx(total, abs=0.034)
    assert np.all((found.total_ends[:, 0] < total) & (total < found.total_ends[:, 1]))
    assert re.search(r"x2 +0\.44\d", str(found))


def test_intervals_of_quantiles_hold_as_often_as_they_say():
    generator, hits = rng(4), []
    for _ in range(400):
        x = generator.exponential(size=60)
        made = rom.components.studies.Study({"x": x}, {"y": x}, {}, {}, np.zeros(60))
        quantile, ends = made.quantiles("y", (0.5,), 0.9)
        hits.append(ends[0, 0] <= np.log(2) <= ends[0, 1])
        assert ends[0, 0] <= quantile[0] <= ends[0, 1]
    assert 0.87 < np.mean(hits) < 0.97
    x = np.arange(60.0)
    made = rom.components.studies.Study({"x": x}, {"y": x}, {}, {}, np.zeros(60))
    low, high = made.quantiles("y", (0.5,), 0.9)[1][0] + 1  # ranks of the ends
    sure = stats.binom(60, 0.5).cdf
    assert sure(high - 1) - sure(low - 1) >= 0.9 > sure(high - 2) - sure(low)
    assert sure(low - 1) <= 0.05 and sure(high - 1) >= 0.95 > sure(high - 2)
    few = rom.components.studies.Study({"x": x[:5]}, {"y": x[:5]}, {}, {}, np.zeros(5))
    assert np.isinf(few.quantiles("y", (0.01,))[1][0, 0])


def test_tables_and_histories_go_to_pandas_and_xarray():
    pytest.importorskip("pandas", reason="pandas is not installed")
    pytest.importorskip("xarray", reason="xarray is not installed")
    found = rom.study(histories, X, workers=0)
    assert list(found.table.columns) == ["x", "root", "failed"]
    assert found.table["failed"][11] == "ValueError: too large"
    data = found.to_xarray()
    assert data["wave"].dims == ("sample", "t") and np.array_equal(data["t"], np.linspace(0, 1, 5))
    assert float(data["wave"].sel(sample=5, t=0.5)) == found.values["wave"][5, 2]


def test_nothing_is_told_where_nothing_failed(recwarn):
    rom.study(histories, {"x": [0.5, 0.6]}, workers=0)
    assert not recwarn
