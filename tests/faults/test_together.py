"""Several processes at once: kernels, forms, files, folders of runs, and threads under mpirun."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

import rom
from cases.command import environment, ran, wait_until
from cases.command import rom as command
from cases.long import few
from cases.paths import TESTS
from cases.solid import block, reduced
from rom.cli.main import main
from rom.io.files import write_whole
from rom.io.ours import LOCK_NAME, claimed
from rom.process.mpirun import found, mpirun
from rom.process.patience import Turns

pytestmark = pytest.mark.once

FORK = multiprocessing.get_context("fork")
WRITES = 40
PENDULUM = ["simulate", "b.npz", "--hinge", "root", "--t-end", "2e-6", "--dt", "1e-6"]


def together(work, *cases):
    """Run work(case) in a process of its own for each case; yields while any of them runs."""
    processes = [FORK.Process(target=work, args=(case,)) for case in cases]
    for process in processes:
        process.start()
    while any(process.is_alive() for process in processes):
        yield
    assert [process.exitcode for process in processes] == [0] * len(cases)


@pytest.fixture(scope="module")
def body():
    return reduced(2, block(cells=(4, 1, 1)), name="b")


def test_a_file_of_two_writers_is_always_one_of_both_also_if_one_is_killed(body, tmp_path):
    path, seen = tmp_path / "b.npz", set()
    rom.save(replace(body, name="one"), path)

    def work(name):
        for _ in range(WRITES):
            rom.save(replace(body, name=name), path)

    for _ in together(work, "one", "two"):
        seen.add(rom.load(path).name)  # compares all checksums
    assert seen <= {"one", "two"} and os.listdir(tmp_path) == ["b.npz"]
    path = tmp_path / "x.bin"
    path.write_bytes(b"whole")

    def work(_):
        write_whole(path, lambda file: (file.write(b"half"), file.flush(), time.sleep(60)))

    process = FORK.Process(target=work, args=(0,))
    process.start()
    wait_until(lambda: len(os.listdir(tmp_path)) > 1)
    os.kill(process.pid, signal.SIGKILL)
    process.join()
    assert path.read_bytes() == b"whole"


def hold(folder):
    with claimed(folder):
        time.sleep(60)


@pytest.fixture
def held(tmp_path):
    """A folder that another process has claimed, and that process."""
    folder = tmp_path / "out"
    process = FORK.Process(target=hold, args=(folder,))
    process.start()
    lock = folder / LOCK_NAME
    wait_until(lambda: lock.exists() and f"process {process.pid} on" in lock.read_text())
    yield folder, process
    process.kill()
    process.join()


def test_a_folder_that_is_written_names_who_does_it(held, body, capsys, monkeypatch):
    folder, process = held
    with pytest.raises(rom.ResourceError, match=f"process {process.pid} on"), claimed(folder):
        pass
    rom.save(body, folder.parent / "b.npz")
    monkeypatch.chdir(folder.parent)
    assert main([*PENDULUM, "-o", "out"]) == 6
    assert f"process {process.pid} on" in capsys.readouterr().err
    assert os.listdir(folder) == [LOCK_NAME]


@pytest.mark.parametrize("ending", [signal.SIGKILL, signal.SIGTERM])
def test_the_claim_of_a_process_that_is_gone_is_taken_over(held, ending):
    folder, process = held
    os.kill(process.pid, ending)
    process.join()
    with claimed(folder):
        assert f"process {os.getpid()} on" in (folder / LOCK_NAME).read_text()
    assert not (folder / LOCK_NAME).exists()


def test_a_lock_of_a_crash_is_taken_over_and_a_link_is_not_followed(tmp_path):
    (tmp_path / LOCK_NAME).write_text("process 1 on elsewhere")
    with claimed(tmp_path):
        pass
    assert not os.listdir(tmp_path)
    (tmp_path / "mine").write_text("text")
    (tmp_path / "out").mkdir()
    os.symlink(tmp_path / "mine", tmp_path / "out" / LOCK_NAME)
    with pytest.raises(rom.ConfigError, match="is not writable"), claimed(tmp_path / "out"):
        pass
    assert (tmp_path / "mine").read_text() == "text"


@pytest.mark.parametrize("made_before", [True, False])
def test_a_claim_leaves_a_folder_as_it_was(made_before, tmp_path):
    folder = tmp_path / "out"
    if made_before:
        folder.mkdir()
    with pytest.raises(ZeroDivisionError), claimed(folder):
        assert folder.is_dir()
        raise ZeroDivisionError
    assert folder.exists() == made_before
    with claimed(folder):
        (folder / "x").touch()
    assert os.listdir(folder) == ["x"]


def test_one_at_a_time_has_the_folder_however_many_want_it(tmp_path):
    folder, counter = tmp_path / "out", tmp_path / "counter"
    counter.write_text("0")

    def work(_):
        for _ in range(WRITES):
            while True:
                try:
                    with claimed(folder):
                        counter.write_text(str(int(counter.read_text()) + 1))
                except rom.ResourceError:
                    continue
                break

    for _ in together(work, 1, 2, 3):
        time.sleep(0.01)
    assert counter.read_text() == str(3 * WRITES)


TOY = """
import os, pathlib, sys, time
from rom.mbs.compiler.cache import COMPILED_FUNCTIONS
from rom.mbs.kernels.compiled import inner, kernel

@inner
def twice(x):
    return 2 * x

@kernel
def outer(x):
    return 2 * twice(x)

if __name__ == "__main__":
    import toy
    here = pathlib.Path(toy.__file__).parent
    (here / f"{os.getpid()}.here").touch()
    while len(list(here.glob("*.here"))) < 3:
        time.sleep(0.001)
    assert toy.outer(3) == 12 and toy.outer(3.0) == 12.0
    hits = sum(toy.outer.stats.cache_hits.values())
    sys.stdout.write(f"{hits} {len(COMPILED_FUNCTIONS)}\\n")
"""


@pytest.mark.parametrize("ranks", few(1, [pytest.param(3, marks=pytest.mark.mpi), 1]))
def test_kernels_asked_for_by_several_processes_at_once_are_compiled_once_and_kept(tmp_path, ranks):
    """A function for two types: two compilations, whoever makes them."""
    (tmp_path / "toy.py").write_text(TOY)
    command = [sys.executable, tmp_path / "toy.py"]
    launcher = mpirun(ranks) if ranks > 1 else []
    run = [subprocess.Popen([*launcher, *command], env=environment(), text=True,
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE)
           for _ in range(1 if launcher else 3)]  # fmt: skip
    said = [process.communicate(timeout=60) for process in run]
    assert not any(process.returncode for process in run), said
    counts = [int(line.split()[1]) for out, _ in said for line in out.splitlines()]
    assert len(counts) == 3 and sum(counts) == 2
    last = ran(*command, env=environment(), check=True)
    assert last.stdout.split() == ["2", "0"], "the last one has nothing to compile"


BROKEN = """
from rom.mbs.compiler.cache import CODE_FILES
from rom.mbs.kernels.compiled import kernel

@kernel
def broken(x):
    return x.nothing

if __name__ == "__main__":
    try:
        broken(1.0)
    except Exception as error:
        print(type(error).__name__)
    print(CODE_FILES[broken.py_func].path, flush=True)
    input()
"""


def test_a_kernel_that_cannot_be_compiled_is_left_to_others(tmp_path):
    (tmp_path / "broken.py").write_text(BROKEN)
    with subprocess.Popen([sys.executable, tmp_path / "broken.py"], env=environment(), text=True,
                          stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:  # fmt: skip
        assert process.stdout.readline() == "TypingError\n"
        path = Path(process.stdout.readline().strip())
        assert path.parent.parent == tmp_path
        assert Turns().take(path, wait=False)


FORM = """
import ufl
from mpi4py import MPI
from cases.boxes import box
from rom.fe import jit
from rom.fe.compat import assemble_matrix, lagrange
mesh, _ = box(cells=(1, 1, 1))
with jit.compiling(MPI.COMM_SELF):
    V = lagrange(mesh, 1)
    u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    print(round(assemble_matrix(3.0 * u[1] * v[2] * ufl.dx).norm(), 12))
"""


@pytest.mark.long
@pytest.mark.fenicsx
def test_forms_compiled_by_two_processes_at_once_are_the_same(tmp_path):
    (tmp_path / "fenics").mkdir()
    (tmp_path / "fenics" / "rom.lock").write_text("")  # of a process that is gone
    env = environment(XDG_CACHE_HOME=str(tmp_path))
    env["PYTHONPATH"] += f"{os.pathsep}{TESTS}"
    run = [subprocess.Popen([sys.executable, "-c", FORM], env=env, text=True,
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE)
           for _ in range(2)]  # fmt: skip
    said = [process.communicate(timeout=120) for process in run]
    assert [process.returncode for process in run] == [0, 0], said
    assert said[0][0] == said[1][0] != ""
    assert list((tmp_path / "fenics").glob("libffcx_forms_*.so"))


THREADS = """
import sys
if sys.argv[1] == "late":
    import numpy
import rom, numpy, ctypes
found = set()
for file in {line.split()[-1] for line in open("/proc/self/maps") if "openblas" in line}:
    library = ctypes.CDLL(file)
    for name in ("openblas_get_num_threads", "openblas_get_num_threads64_",
                 "scipy_openblas_get_num_threads64_"):
        if hasattr(library, name):
            found.add(getattr(library, name)())
print(*found)
"""


@pytest.mark.mpi
@pytest.mark.parametrize("numpy_comes", ["early", "late"])
@pytest.mark.parametrize("chosen", [None, "2"])
def test_a_rank_has_one_thread_unless_the_user_chooses(numpy_comes, chosen):
    if not found() or len(os.sched_getaffinity(0)) < 2:
        pytest.skip("needs mpirun and two cores")
    env = {k: v for k, v in environment().items() if not k.endswith("_NUM_THREADS")}
    env |= {} if chosen is None else {"OMP_NUM_THREADS": chosen}
    line = [sys.executable, "-c", THREADS, numpy_comes]
    alone = ran(*line, env=env, check=True)
    if alone.stdout.strip() != "2" and not (alone.stdout.strip() and chosen is None):
        pytest.skip("this NumPy has another BLAS than OpenBLAS")
    # the environment tells a rank what it is; mpirun itself would bind it to one core
    rank = env | {"OMPI_COMM_WORLD_RANK": "0", "OMPI_COMM_WORLD_SIZE": "2"}
    done = ran(*line, env=rank, check=True)
    assert done.stdout.strip() == (chosen or "1")


@pytest.mark.fenicsx
@pytest.mark.mpi
def test_two_ranks_are_one_writer(body, tmp_path):
    rom.save(body, tmp_path / "b.npz")
    assert command(*PENDULUM, "-o", "out", n=2, cwd=tmp_path).returncode in (0, 5)
    (tmp_path / "out" / "b.csv").write_text("my notes\n")
    done = command(*PENDULUM, "-o", "out", n=2, cwd=tmp_path)
    assert done.returncode == 2 and done.stderr.count("error: ") == 1, done.stderr
    assert (tmp_path / "out" / "b.csv").read_text() == "my notes\n"
    assert sorted(os.listdir(tmp_path / "out")) == ["b.csv", "run.json", "scene.json"]
