"""How FEniCSx is loaded: the helper of its wheel first, and only ranks that know of each other."""

import os
from importlib.util import find_spec

import pytest

from cases.command import environment, python
from cases.command import rom as command
from rom.fe import HELPER_MODULE

PETSC = """
def ImportPETSc(arch=None):
    import petsc4py.PETSc as module
    print("PETSc")
    return module
"""
OPTIONS = "-skip_petscrc -no_signal_handler"
START = """
import rom.fe
print("rom")
from petsc4py.lib import ImportPETSc
ImportPETSc()
"""
HANGS_UP = """
import os, threading
import rom.fe.compat
reads, writes = os.pipe()
os.close(reads)
def write():
    try:
        os.write(writes, b"x")
    except OSError as error:
        print(type(error).__name__)
thread = threading.Thread(target=write)
thread.start()
thread.join()
"""


def started(folder, helper=None):
    """What is loaded, in order, with a PETSc that says so, and with a helper of this text."""
    package = folder / "petsc4py"
    (package / "lib").mkdir(parents=True)
    (package / "__init__.py").write_text("")
    (package / "lib" / "__init__.py").write_text(PETSC)
    (package / "PETSc.py").write_text("def _initialize(arguments): print(*arguments)\n")
    if helper is not None:
        (folder / f"{HELPER_MODULE}.py").write_text(helper)
    path = os.pathsep.join([str(folder), environment()["PYTHONPATH"]])
    return python("-c", START, env=environment(PYTHONPATH=path), timeout=60)


def test_the_helper_of_the_wheel_is_loaded_before_petsc_and_not_with_rom(tmp_path):
    """It starts MPI, which processes that only run gmsh must not."""
    done = started(tmp_path, "print('helper')\n")
    assert done.stdout.split("\n")[:4] == ["rom", "helper", "PETSc", f"rom {OPTIONS}"]


def test_petsc_of_the_system_has_no_helper_to_wait_for(tmp_path):
    if find_spec(HELPER_MODULE) is not None:
        pytest.skip("here the helper is installed, and refuses this PETSc")
    assert started(tmp_path).stdout.split("\n")[:3] == ["rom", "PETSc", f"rom {OPTIONS}"]


def test_what_the_helper_complains_of_is_not_passed_over(tmp_path):
    """It refuses environments with two builds of PETSc."""
    done = started(tmp_path, "raise ImportError('petsc4py would be imported from elsewhere')\n")
    assert done.returncode == 1 and "PETSc" not in done.stdout
    assert "petsc4py would be imported from elsewhere" in done.stderr


@pytest.mark.fenicsx
def test_a_thread_is_told_of_who_has_hung_up_where_petsc_has_started():
    """The handler of PETSc ends the process, or crashes in Python without the lock."""
    done = python("-c", HANGS_UP, timeout=60)
    assert (done.returncode, done.stdout) == (0, "BrokenPipeError\n"), done.stderr


@pytest.mark.fenicsx
def test_ranks_of_another_launcher_do_not_each_do_all_of_the_work():
    """Under the variables of a launcher that is not of the MPI which is loaded."""
    MPI = pytest.importorskip("mpi4py.MPI", reason="mpi4py is not installed")
    names = ("PMI_RANK", "PMI_SIZE")
    if not MPI.Get_library_version().startswith("Open MPI"):
        names = ("OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE")
    foreign = dict(zip(names, "02", strict=True))
    done = command("modes", "meshes/beam.geo", "--E", "210e9", "--nu", "0.3", "--rho", "7850",
                   env=environment(**foreign))  # fmt: skip
    assert done.returncode == 6 and done.stdout == ""
    assert "mpirun has started 2 processes, and each knows only itself" in done.stderr
