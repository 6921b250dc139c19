"""Processes: memory they may take, how ranks are started, and how SIGTERM ends them."""

import os
import signal
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from cases.command import python
from rom.cli.main import translated
from rom.errors import ResourceError
from rom.process import memory, mpirun
from rom.process.interruption import terminable


@pytest.mark.parametrize(("limit", "use", "cache"), memory.GROUP_FILES)
def test_a_control_group_of_either_version_leaves_its_rest(tmp_path, limit, use, cache):
    assert memory.group_bytes(tmp_path / "none") == memory.NO_LIMIT
    (tmp_path / limit).write_text("1000000\n")
    (tmp_path / use).write_text("900000\n")
    (tmp_path / "memory.stat").write_text(f"anon 500000\n{cache} 400000\n")
    assert memory.group_bytes(tmp_path) == 500_000.0
    (tmp_path / limit).write_text("max\n")
    assert memory.group_bytes(tmp_path) == memory.NO_LIMIT


def test_the_least_limit_counts(monkeypatch):
    monkeypatch.setattr(
        memory.resource, "getrlimit", lambda _: (int(memory.machine_free_bytes()), 0)
    )
    assert memory.free_bytes() < memory.machine_free_bytes()
    monkeypatch.setattr(memory, "address_bytes", lambda: 9.0)
    monkeypatch.setattr(memory, "group_bytes", lambda _: 7.0)
    assert memory.free_bytes() == 7.0


def test_running_out_says_what_was_asked_and_what_there_is(monkeypatch):
    with pytest.raises(MemoryError) as caught:
        np.empty((2**30, 2**22))  # 2^52 numbers: 32 PiB
    monkeypatch.setattr(memory, "group_bytes", lambda _: 2.0**30)
    monkeypatch.setattr(memory, "machine_free_bytes", lambda: 2.0**33)
    error = translated(caught.value)
    assert isinstance(error, ResourceError)
    assert "for 3.36e+07 GiB, 1073741824 x 4194304 numbers" in error.message
    assert "may take 1 GiB more" in error.message
    assert "memory ran out; this process may take" in translated(MemoryError()).message


OPEN_MPI = "mpirun (Open MPI) 4.1.4\n\nReport bugs to http://www.open-mpi.org/community/help/\n"
HYDRA = "HYDRA build details:\n    Version:                                 5.0.2\n    CC: gcc\n"


def fake(folder, said, code=0):
    folder.mkdir(exist_ok=True)
    path = folder / "mpirun"
    path.write_text(f"#!/bin/sh\ncat <<'EOF'\n{said}EOF\nexit {code}\n")
    path.chmod(0o755)
    return str(path)


@pytest.fixture
def places(tmp_path, monkeypatch):
    """A folder with a Python that has no launcher beside it yet, and one on the path."""
    beside, system = tmp_path / "environment", tmp_path / "system"
    beside.mkdir()
    system.mkdir()
    (beside / "python").symlink_to(sys.executable)  # which starts every other program
    monkeypatch.setattr(sys, "executable", str(beside / "python"))
    monkeypatch.setenv("PATH", f"{system}:/usr/bin:/bin")
    return beside, system


@pytest.mark.parametrize(
    ("said", "version"),
    [(OPEN_MPI, "Open MPI 4.1.4"), (HYDRA, "MPICH 5.0.2"), ("some other launcher 7\n", "")],
    ids=["Open MPI", "MPICH", "another"],
)
def test_a_launcher_is_known_by_what_it_says(tmp_path, said, version):
    assert mpirun.version(fake(tmp_path, said)) == version


def test_a_launcher_that_cannot_be_started_has_no_version(tmp_path):
    (tmp_path / "mpirun").write_text("no program")
    assert mpirun.version(str(tmp_path / "mpirun")) == ""


def test_the_launcher_beside_this_python_comes_first_and_is_told_what_it_knows(places):
    beside, system = places
    theirs = fake(system, OPEN_MPI)
    assert mpirun.found() == theirs
    ours = fake(beside, HYDRA)
    assert mpirun.found() == ours
    Path(ours).chmod(0o644)
    assert mpirun.found() == theirs
    beside, system = places
    theirs = fake(system, OPEN_MPI)
    assert mpirun.mpirun(3) == [theirs, "--oversubscribe", "-n", "3"]
    ours = fake(beside, HYDRA)
    assert mpirun.mpirun(2) == [ours, "-n", "2"]


def test_no_launcher_is_said(places, monkeypatch):
    monkeypatch.setenv("PATH", str(places[1]))
    assert mpirun.found() == ""
    with pytest.raises(ResourceError, match=r"mpirun is not installed\. `rom doctor`"):
        mpirun.mpirun(2)


def test_a_handler_of_the_user_and_another_thread_are_left_alone():
    heard = []
    signal.signal(signal.SIGTERM, lambda *_: heard.append(1))
    try:
        with terminable():
            os.kill(os.getpid(), signal.SIGTERM)
        assert heard == [1]
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
    seen = []

    def work():
        with terminable():
            seen.append(signal.getsignal(signal.SIGTERM))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [signal.SIG_DFL]


def test_ctrl_c_raises_inside_though_a_library_lets_it_end_the_process():
    before = signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        with pytest.raises(KeyboardInterrupt), terminable():
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(1.0)
        assert signal.getsignal(signal.SIGINT) is signal.SIG_DFL
    finally:
        signal.signal(signal.SIGINT, before)


def test_the_process_cleans_up_and_ends_by_sigterm():
    code = (
        "import os, signal\nfrom rom.process.interruption import terminable\n"
        "with terminable():\n    try:\n        os.kill(os.getpid(), signal.SIGTERM)\n"
        "        signal.pause()\n    finally:\n        print('clean', flush=True)\n"
    )
    done = python("-c", code, timeout=60)
    assert (done.returncode, done.stdout) == (-signal.SIGTERM, "clean\n"), done.stderr


@pytest.mark.parametrize("number", ["SIGINT", "SIGTERM"])
def test_a_signal_dropped_in_a_callback_comes_again(number):
    code = (
        "import os, signal, time\n"
        "from rom.process.interruption import heed_lost_signals, terminable\n"
        "heed_lost_signals()\n"
        "class Last:\n"
        f"    def __del__(self): os.kill(os.getpid(), signal.{number}); time.sleep(0.01)\n"
        "with terminable():\n    x = Last(); del x\n    time.sleep(20)"
    )
    done = python("-c", code, timeout=15)
    assert done.returncode == -getattr(signal, number), done.stderr
