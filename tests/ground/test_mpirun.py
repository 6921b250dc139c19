"""Which program starts ranks, told by programs that say what launchers say."""

import sys
from pathlib import Path

import pytest

from rom.errors import ResourceError
from rom.process import mpirun

OPEN_MPI = "mpirun (Open MPI) 4.1.4\n\nReport bugs to http://www.open-mpi.org/community/help/\n"
HYDRA = "HYDRA build details:\n    Version:                                 5.0.2\n    CC: gcc\n"


def fake(folder, said, code=0):
    """A launcher that says its version."""
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


def test_the_launcher_beside_this_python_comes_before_that_of_the_system(places):
    """Wheels of MPI bring their own, also into an environment that nobody has activated."""
    beside, system = places
    theirs = fake(system, OPEN_MPI)
    assert mpirun.found() == theirs
    ours = fake(beside, HYDRA)
    assert mpirun.found() == ours
    Path(ours).chmod(0o644)
    assert mpirun.found() == theirs


def test_only_open_mpi_is_told_that_there_may_be_more_processes_than_cores(places):
    """MPICH allows it, and does not know the word."""
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
