"""Memory and disk: foreseen from the analysis, and the way to solve chosen by them."""

import gc
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

import rom
from cases.command import python
from cases.long import few
from cases.measures import memory_taken
from cases.paths import RANKS, ROOT
from cases.ranks.environment import ENVIRONMENT
from cases.refusals import refuses
from cases.solid import STEEL, reduced
from rom.errors import ResourceError
from rom.process.mpirun import mpirun
from rom.reduction.full_model import operators

pytest.importorskip("dolfinx", reason="dolfinx is not installed")
pytestmark = pytest.mark.fenicsx

from mpi4py import MPI  # noqa: E402

from rom.fe import elasticity  # noqa: E402
from rom.fe.operators import disk, factor, foreseen, memory  # noqa: E402
from rom.fe.operators.foreseen import automatic  # noqa: E402
from rom.fe.operators.solver import DIRECT_SOLVER, parsed  # noqa: E402

SHAPES = {  # length, width, height, size of elements [m]
    "plate": (1.0, 1.0, 0.02, 0.05),
    "block": (1.0, 1.0, 1.0, 0.14),
    "rod": (8.0, 0.3, 0.2, 0.07),
    "large plate": (1.0, 1.0, 0.02, 0.02),
    "large block": (1.0, 1.0, 1.0, 0.08),
    "large rod": (16.0, 0.3, 0.2, 0.06),
}
GIB = 2.0**30
DISK_BYTES = 100_000_000  # of one on which a factor is tried that takes a fifth


def bar(size, solver="auto"):
    sizes = dict(zip(("L", "b", "h", "lc"), size, strict=True))
    return rom.fe.model("meshes/beam.geo", material=STEEL, parameters=sizes, solver=solver)


def taken_and_foreseen(shape, solver):
    """Memory of a reduction and what its analysis, or the matrix alone, said [bytes]."""
    model = bar(SHAPES[shape], solver)
    K = operators(model).K
    beside = foreseen.beside_factor(K, 12, foreseen.N_MATRICES)
    direct = solver == "direct"
    solved = foreseen.analysed(K).in_core if direct else foreseen.multigrid_bytes(K)
    reduced(20, bar((1.0, 0.1, 0.1, 0.1), solver))  # compiles what is not foreseen
    gc.collect()
    memory.collect(MPI.COMM_WORLD)
    Path("/proc/self/clear_refs").write_text("5")  # the largest so far is forgotten
    (before,) = memory_taken("VmRSS")
    reduced(20, model)
    return (memory_taken("VmHWM") - before)[0], beside + solved


REDUCED = few(1, [(shape, "direct") for shape in SHAPES])
REDUCED += few(0, [("plate", "iterative"), ("rod", "iterative")])


@pytest.mark.parametrize(("shape", "solver"), REDUCED)
def test_a_reduction_takes_the_memory_foreseen(shape, solver):
    """In a process of its own: what other tests leave in the heap is no part of it."""
    code = f"import test_fe_foreseen as t; print(*t.taken_and_foreseen{shape, solver})"
    here = f"{Path(__file__).parent}{os.pathsep}{ENVIRONMENT['PYTHONPATH']}"
    ran = python("-c", code, env=ENVIRONMENT | {"PYTHONPATH": here}, check=True)
    taken, expected = map(float, ran.stdout.split()[-2:])
    assert taken == pytest.approx(expected, rel=0.2)


@pytest.fixture(scope="module")
def block():
    return bar(SHAPES["block"])


@pytest.fixture(scope="module")
def needs(block):
    K = operators(block).K
    found, beside = foreseen.analysed(K), foreseen.beside_factor(K, 0, foreseen.N_MATRICES)
    return {"direct": beside + found.in_core, "out-of-core": beside + found.out_of_core,
            "iterative": beside + foreseen.multigrid_bytes(K), "disk": found.on_disk}  # fmt: skip


def limited(monkeypatch, memory_bytes, disk_bytes=1e15):
    """As if the machine had no more than that."""
    monkeypatch.setattr(memory, "MAX_MEMORY_SHARE", 1.0)
    monkeypatch.setattr(memory, "free_bytes", lambda: memory_bytes)
    monkeypatch.setattr(disk.shutil, "disk_usage", lambda _: SimpleNamespace(free=disk_bytes))


def test_the_first_way_that_fits_is_taken(block, needs, monkeypatch):
    ops = operators(block)
    assert block.provenance["solver"] == "direct"
    limited(monkeypatch, 1.001 * needs["direct"])
    how, why = automatic(ops)
    assert not (how.out_of_core or how.iterative)
    assert why.startswith(f"direct: {needs['direct'] / GIB:.2f} GiB foreseen")
    limited(monkeypatch, 0.999 * needs["direct"])
    how, why = automatic(ops)
    assert how.out_of_core
    sizes = f"{needs['out-of-core'] / GIB:.2f} GiB with {needs['disk'] / GIB:.2f} GiB on disk"
    assert why.startswith(f"out-of-core, {sizes}: a factor in memory would take ")
    limited(monkeypatch, 0.999 * needs["direct"], 0.999 * needs["disk"])
    how, why = automatic(ops)
    assert how.iterative
    assert why.startswith(f"iterative, {needs['iterative'] / GIB:.2f} GiB: ")


LARGEST = 2**31 - 1  # of the PETSc with 32-bit indices that Debian builds


@pytest.mark.parametrize(
    ("n_dofs", "n_entries", "words"),
    [
        (LARGEST + 1, 1, "2147483648 dofs are foreseen; 2147483647 is"),
        (1, LARGEST + 1, "2147483648 entries of the stiffness on one rank"),
        (LARGEST, LARGEST, ""),
    ],
)
def test_more_than_petsc_can_count_is_refused(n_dofs, n_entries, words, monkeypatch):
    monkeypatch.setattr(foreseen, "LARGEST_INDEX", LARGEST)
    if words:
        refuses(ResourceError, words, foreseen.check_indices, n_dofs, n_entries)
    else:
        foreseen.check_indices(n_dofs, n_entries)


@pytest.mark.parametrize("hexahedra", [0, 1])
def test_entries_are_foreseen_before_they_are_there(hexahedra, monkeypatch):
    """Of a block: a fifth more than there are, as nodes on its surface have fewer neighbours."""
    grid = {"hex": hexahedra, "nx": 9, "ny": 9, "nz": 9} | dict(L=1.0, b=1.0, h=1.0, lc=0.13)
    asked = []
    monkeypatch.setattr(elasticity, "check_indices", lambda *counts: asked.append(counts))
    model = rom.fe.model("meshes/beam.geo", material=STEEL, parameters=grid)
    ((n_dofs, n_entries),) = asked
    assert n_dofs == model.n_dofs
    assert 1.0 < n_entries / foreseen.stored_entries(model.operators.K) < 1.35
    monkeypatch.undo()
    monkeypatch.setattr(foreseen, "LARGEST_INDEX", n_dofs - 1)
    with pytest.raises(ResourceError, match=f"{n_dofs} dofs") as caught:
        rom.fe.model("meshes/beam.geo", material=STEEL, parameters=grid)
    assert "64-bit" in caught.value.hint


def test_what_fits_nowhere_is_refused_with_the_sizes(block, needs, monkeypatch):
    smallest = min(needs["out-of-core"], needs["iterative"])
    limited(monkeypatch, 0.999 * smallest)
    with pytest.raises(ResourceError) as caught:
        automatic(operators(block))
    for way in ("direct", "out-of-core", "disk", "iterative"):
        assert f"{needs[way] / GIB:.2f} GiB" in caught.value.message
    assert f"{block.n_dofs} dofs" in caught.value.message
    assert "coarser mesh" in caught.value.hint


def test_the_way_taken_is_kept_with_the_body(block, needs, monkeypatch):
    limited(monkeypatch, 0.99 * needs["direct"])
    model = bar(SHAPES["block"])
    monkeypatch.undo()
    assert model.operators.solver.out_of_core
    found, direct = (reduced(4, m) for m in (model, block))
    assert found.provenance["solver"] == model.provenance["solver"]
    assert found.frequencies()[6:] == pytest.approx(direct.frequencies()[6:], rel=1e-9)


def test_columns_of_interfaces_count_beside_the_factor(block, needs, monkeypatch):
    K = operators(block).K
    limited(monkeypatch, needs["direct"])
    check = foreseen.check_factor_memory
    check(K, 12, DIRECT_SOLVER)
    refuses(ResourceError, "is predicted to take", check, K, 10_000, DIRECT_SOLVER)


FULL_DISK = """
import resource
import rom
STEEL = rom.Material(E=210e9, nu=0.3, rho=7850.0)
block = dict(L=1.0, b=1.0, h=0.02, lc=0.1)
model = rom.fe.model("meshes/beam.geo", material=STEEL, parameters=block, solver="out-of-core")
resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
try:
    model.operators.hold(model.interfaces["root"].dofs)
except rom.errors.ResourceError as error:
    print(error.message)
"""


def test_a_disk_that_would_fill_is_named_with_folder_and_size(tmp_path, monkeypatch):
    """MUMPS itself would wait for its writer for ever."""
    tried, sizes = list[float](), list[int]()
    with monkeypatch.context() as context:
        context.setattr(disk, "MOST_FILE_BYTES", 1000)
        context.setattr(disk.os, "posix_fallocate", lambda file, start, size: sizes.append(size))
        disk.reserve_disk(2500.0, 10, MPI.COMM_SELF)
        context.setattr(disk, "_refusal", lambda size: tried.append(size) or "")
        disk.reserve_disk(3e6, 10, MPI.COMM_SELF)
    assert tried == [3e6] and sizes == [1000, 1000, 500]
    monkeypatch.setenv("MUMPS_OOC_TMPDIR", str(tmp_path))
    ran = python("-c", FULL_DISK, timeout=60)
    assert f"GiB on disk and cannot be kept in {tmp_path}: File too large" in ran.stdout, ran.stderr
    assert not list(tmp_path.iterdir())


DEAF_PROCESS = """
import ctypes
from rom.fe.operators import disk
disk.LEAST_FREE_BYTES = 1 << 60
with disk.watched():
    ctypes.PyDLL(None).sleep(60)  # as deaf as one that waits for a writer
"""


def test_a_process_that_waits_for_a_full_disk_is_ended_and_says_so(tmp_path, monkeypatch):
    """What counts as full is more than any disk has free."""
    monkeypatch.setenv("MUMPS_OOC_TMPDIR", str(tmp_path))
    ran = subprocess.run([sys.executable, "-c", DEAF_PROCESS], capture_output=True, timeout=60)
    assert ran.returncode < 0
    assert f"ResourceError: the disk of {tmp_path} filled while a".encode() in ran.stderr


@pytest.mark.mpi
@pytest.mark.parametrize("n_ranks", [1, 2])
def test_a_disk_that_another_fills_ends_all_ranks_by_name(tmp_path, n_ranks):
    """MUMPS complains, or waits for its writer for ever, and other ranks for that one."""
    mount = f'mount -t tmpfs -o size={DISK_BYTES} none "{tmp_path}" && exec "$@"'
    own_mounts = ["unshare", "--mount", "sh", "-c", mount, "sh"]
    if not shutil.which("unshare") or subprocess.run([*own_mounts, "true"], check=False).returncode:
        pytest.skip("a small disk of its own needs the right to mount one")
    script = RANKS / "full_disk_under_mpi.py"
    ran = subprocess.run(
        [*own_mounts, *mpirun(n_ranks), sys.executable, str(script), "0.08", "100000"],
        env=ENVIRONMENT | {"MUMPS_OOC_TMPDIR": str(tmp_path)}, timeout=120, capture_output=True,
        text=True, check=False, cwd=ROOT,
    )  # fmt: skip
    assert ran.returncode != 0 and "begins" in ran.stdout, ran.stderr
    assert "has a factor" not in ran.stdout
    named = rf"ResourceError: the (disk of|factor of \d+ dofs takes .* kept in) {tmp_path}"
    assert re.search(named, ran.stderr), ran.stderr


def test_the_disk_is_watched_while_a_factor_is_written_into_a_folder(block, monkeypatch, tmp_path):
    seen, watched = [], factor.watched
    monkeypatch.setattr(factor, "watched", lambda: seen.append(1) or watched())
    for kind, times in (("direct", 0), ("out-of-core", 1)):
        factor.Factor(operators(block).K, definite=True, solver=parsed(kind)).release()
        assert len(seen) == times
    monkeypatch.setenv("MUMPS_OOC_TMPDIR", str(tmp_path / "none"))
    with pytest.raises(ResourceError, match=f"cannot be kept in {tmp_path}/none: No such file"):
        factor.Factor(operators(block).K, definite=True, solver=parsed("out-of-core"))
