"""What lies in the folder one stands in is never run, by whatever name; children start one way.

The folder is full of modules and option files that leave a mark when they are read as a program.
"""

import fcntl
import json
import os
import shutil
import signal
import sys
import tempfile
import threading
import time
from functools import cache
from importlib.util import find_spec
from itertools import product
from pathlib import Path

import numpy as np
import pytest

import rom
from cases.boxes import BOX_GEO
from cases.command import ROOT, alive, environment, python, ran
from cases.long import ROM_LONG, few
from cases.solid import block, reduced
from rom.process import child

pytestmark = pytest.mark.once

MODULES = (
    "gmsh numpy pyvista vtk vtkmodules meshio matplotlib json typing subprocess h5py sitecustomize "
    "usercustomize scipy numba yaml re os io abc argparse tempfile dataclasses ctypes runpy "
    "pkgutil functools resource struct warnings collections enum contextlib pathlib signal "
    "threading dolfinx petsc4py slepc4py mpi4py ufl ffcx basix cffi pip venv imageio PIL __main__"
).split()
STEEL = ("--E", "210e9", "--nu", "0.3", "--rho", "7850")
REDUCE = ("box.geo", *STEEL, "-i", "root=rbe2", "-m", "4", "--reference", "root")
VERBS = {  # verb: a line that does what the verb is for
    "doctor": (),
    "demo": (),
    "open": ("--help",),
    "mesh": ("box.geo", "--save", "box.vtu"),
    "modes": ("box.geo", *STEEL, "-n", "4"),
    "reduce": (*REDUCE, "-o", "box.rom.npz"),
    "check": ("bar.rom.npz",),
    "export": ("bar.rom.npz", "bar.SID_FEM"),
    "simulate": ("bar.rom.npz", "--hinge", "root", "--t-end", "1e-5", "--dt", "1e-5", "-o", "out"),
    "view": ("bar.rom.npz", "-o", "bar.png"),
    "report": ("bar.rom.npz", "-o", "bar.html"),
    "swing": ("box.geo", "--hinge", "root", "-m", "4", "--t-end", "1e-4", "-o", "swing"),
    "update": ("--help",),
    "bench": ("--help",),
    "completion": ("bash",),
}
NEED_FE = ("mesh", "modes", "reduce", "swing")
MAY_FAIL = ("doctor", "reduce", "view", "report")  # by what this machine lacks, by a certificate
HAS_FE = find_spec("dolfinx") is not None  # imported here it would meet the traps
FORMS = {
    "python -m rom": [sys.executable, "-m", "rom"],
    "rom": [sys.executable, "-P", "-c", "import sys; from rom.__main__ import main; "
            "sys.exit(main())"],
}  # fmt: skip


@pytest.fixture(scope="module")
def body(tmp_path_factory):
    made = reduced(4, block(), reference="root")
    return rom.save(made, tmp_path_factory.mktemp("body") / "bar.rom.npz")


@pytest.fixture
def planted(tmp_path, monkeypatch, body):
    """A folder in which everything is a trap; what was run has left its name in `marks`."""
    folder, marks = tmp_path / "here", tmp_path / "marks"
    folder.mkdir()
    marks.mkdir()
    for name in MODULES:
        trap = f"open({str(marks / name)!r}, 'w').close()\nraise SystemExit('trapped by {name}')\n"
        (folder / f"{name}.py").write_text(trap)
    for name in (".petscrc", "petscrc"):
        (folder / name).write_text("-dll_append ./planted.so\n-planted 1\n")
    for name in ("dolfinx_jit_parameters.json", "ffcx_parameters.json"):
        (folder / name).write_text("trapped")
    (folder / ".numba_config.yaml").write_text(f"cache_dir: {marks}\n")
    (folder / "matplotlibrc").write_text("text.usetex: True\n")
    (folder / "petsc.cfg").write_text("PETSC_DIR = trapped\nPETSC_ARCH = trapped\n")
    (folder / "box.geo").write_text(BOX_GEO)
    shutil.copy(body, folder / "bar.rom.npz")
    monkeypatch.chdir(folder)
    return marks


def left(marks):
    return sorted(path.name for path in marks.iterdir())


# each verb in one form, each form with every other verb; with more time all pairs
SLOW = {"report", "swing", "view"}
PAIRS = [
    pair
    for k, pair in enumerate(product(VERBS, FORMS))
    if ROM_LONG or (k % 4 in (0, 3) and pair[0] not in SLOW)
]


@pytest.mark.parametrize(("verb", "form"), PAIRS)
def test_no_verb_runs_what_lies_in_the_folder(verb, form, planted):
    if verb in NEED_FE and not HAS_FE:
        pytest.skip("dolfinx is not installed")
    if form == "python -m rom":
        for name in loaded_by_python():
            Path(f"{name}.py").unlink(missing_ok=True)
    # rom itself comes from its folder, named in full; the installed form needs no such thing
    done = ran(*FORMS[form], verb, *VERBS[verb], env=environment())
    assert left(planted) == []
    assert "trapped" not in done.stdout + done.stderr
    assert done.returncode == 0 or verb in MAY_FAIL, done.stderr


@cache
def loaded_by_python():
    """Modules that `python -m` itself loads from there, before any package can forestall it."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "shown.py").write_text("import sys\nprint(*sys.modules)\n")
        done = python("-m", "shown", cwd=folder, check=True)
    return frozenset(done.stdout.split())


LIBRARIES = ("matplotlib", "numba", "petsc4py.PETSc", "pyvista", "gmsh", "dolfinx.jit", "meshio")
LOADED = f"""
import importlib, importlib.util, os, sys
def heard(event, given):
    if event == "open" and isinstance(given[0], str):
        place = os.path.abspath(given[0])
        if place.startswith({{folder!r}}) and os.path.isfile(place):
            print("read", given[0])
sys.addaudithook(heard)
import rom.__main__
for name in {LIBRARIES}:
    if importlib.util.find_spec(name.split(".")[0]):
        importlib.import_module(name)
print("end")
"""


def test_no_library_reads_a_file_of_the_folder_though_the_traps_work(planted):
    code = LOADED.format(folder=os.getcwd())
    env = environment(MPLCONFIGDIR="settings", MATPLOTLIBRC=".", NUMBA_CACHE_DIR=".")
    done = python("-P", "-c", code, env=env, timeout=120)
    assert done.stdout.split() == ["end"], done.stdout + done.stderr
    assert left(planted) == [] and not Path("settings").exists()
    code = "import rom, numba.core.config as c; print(repr(c.CACHE_DIR))"
    env = {k: v for k, v in environment().items() if k != "NUMBA_CACHE_DIR"}  # the user's own word
    done = python("-P", "-c", code, env=env, check=True)
    assert done.stdout.strip() == "''"
    assert np.array_equal(left(planted), [])
    ran(sys.executable, "-c", "import gmsh")
    assert left(planted) == ["gmsh"]


def test_a_child_imports_where_no_settings_lie(planted, tmp_path):
    """Those of the folder would let matplotlib start LaTeX."""
    module = tmp_path / "shown.py"
    module.write_text("import matplotlib as m\nprint(m.rcParams['text.usetex'])\n")
    if find_spec("matplotlib") is None:  # imported here it would read them itself
        pytest.skip("matplotlib is not installed")
    done = child.run(child.python("shown"), variables={"PYTHONPATH": f"{ROOT}:{tmp_path}"})
    assert (done.code, done.out) == (0, "False\n"), done.err


STARTERS = {
    "mesh": "import rom.fe.mesh as m; m.read_mesh('box.geo')",
    "film": "import rom; b = rom.load('bar.rom.npz'); from rom.view import mode_shapes; "
    "mode_shapes(b, 'modes.png', n=1)",
    "window": "import rom; b = rom.load('bar.rom.npz'); from rom.view.scenes.window import *; "
    "show(mode_scenes(b, 1))",
    "body FMU": "import rom; rom.write_body_fmu(rom.load('bar.rom.npz'), 'bar.fmu')",
    "FMU": "import rom; open('empty.py', 'w').write('import rom\\ndef mechanism():\\n"
    "    return rom.Mechanism()\\n'); rom.write_fmu('m.fmu', 'empty.py', dt=1e-3)",
    "probes": "from rom.doctor.probes import start; print(start('rom.doctor.libraries').answer())",
    "peers": "from rom.process import child; from benchmarks.peers.compare import answer_of; "
    "answer_of(child.python('benchmarks.peers.ours', '1'))",
}


@pytest.mark.parametrize("function", few(3, STARTERS))
def test_no_function_that_starts_a_process_runs_what_lies_in_the_folder(function, planted):
    if function == "mesh" and not HAS_FE:
        pytest.skip("gmsh is not installed")
    python("-P", "-c", STARTERS[function], timeout=120)
    assert left(planted) == []


@pytest.mark.fenicsx
def test_petsc_reads_no_option_file_of_the_folder_but_its_variable(planted):
    if not HAS_FE:
        pytest.skip("dolfinx is not installed")
    code = "import rom.fe.jit; from petsc4py import PETSc; print(sorted(PETSc.Options().getAll()))"
    done = python("-P", "-c", code, env=environment(PETSC_OPTIONS="-mine 1"), check=True)
    options = "['mine', 'no_signal_handler', 'skip_petscrc']"
    assert done.stdout.splitlines()[0] == options  # 3.25 adds a remark


def test_a_child_is_told_no_path_but_full_ones(monkeypatch, tmp_path):
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(["", ".", "lib", str(tmp_path)]))
    monkeypatch.setenv("OMPI_COMM_WORLD_SIZE", "2")
    code = "import json, os, sys; "
    code += "print(json.dumps([sys.path, sys.flags.safe_path, dict(os.environ)]))"
    done = child.run([sys.executable, "-c", code], folder=tmp_path)
    path, safe, variables = json.loads(done.out)
    assert safe and variables["PYTHONSAFEPATH"] == "1"
    assert path[:2] == [str(ROOT), str(tmp_path)]
    assert {entry for entry in path if not os.path.isabs(entry)} <= {
        p for p in sys.path if "hook" in p
    }
    assert "OMPI_COMM_WORLD_SIZE" not in variables
    foreign = child.environment(own=False)
    assert foreign["PYTHONPATH"] == str(tmp_path)


def test_limits_of_a_child_hold_also_of_its_own_children(tmp_path):
    spin = [sys.executable, "-c", "while True: pass"]
    began = time.monotonic()
    done = child.run(spin, limits=child.Limits(seconds=0.5))
    assert done.overtime and done.signal == "SIGTERM"
    assert child.run(spin, limits=child.Limits(processor=1)).signal in ("SIGXCPU", "SIGKILL")
    hoard = [sys.executable, "-c", "x = bytearray(2**30)"]
    assert "MemoryError" in child.run(hoard, limits=child.Limits(memory=2**29)).err
    assert child.run(hoard).code == 0
    assert time.monotonic() - began < 60
    code = (
        "import os, signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); os.fork(); "
        f"open(os.path.join({str(tmp_path)!r}, str(os.getpid())), 'w').close(); time.sleep(60)"
    )
    assert child.run([sys.executable, "-c", code], limits=child.Limits(seconds=1.0)).overtime
    pids = [int(path.name) for path in tmp_path.iterdir()]
    time.sleep(0.2)
    assert len(pids) == 2 and not any(map(alive, pids))


def test_only_abandoned_folders_of_our_own_are_swept(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    code = "from rom.process import child; import os, signal\n"
    code += "with child.scratch('dead') as f: (f / 'x').touch(); os.kill(os.getpid(), 9)"
    env = environment(TMPDIR=str(tmp_path))
    done = ran(sys.executable, "-c", code, env=env)
    assert done.returncode == -signal.SIGKILL
    (dead,) = tmp_path.glob("rom-dead-*")
    other = tmp_path / "rom-results"
    wide, kept = tmp_path / "rom-wide.scratch", tmp_path / "kept"
    for path, mode in ((other, 0o700), (wide, 0o755), (kept, 0o700)):
        path.mkdir(mode=mode)
        (path / "x").touch()
    link = tmp_path / "rom-link.scratch"
    link.symlink_to(kept)
    with child.scratch("live") as outer, child.scratch("live") as inner:
        child.sweep()
        assert not dead.exists()
        assert all(path.exists() for path in (outer, inner, other, wide, link, kept / "x"))
        if os.geteuid() == 0:
            os.chown(wide, 12345, -1)
            wide.chmod(0o700)
            child.sweep()
            assert wide.exists()
    assert not outer.exists() and not inner.exists()


@pytest.mark.parametrize("held", [0.0, 0.2])
def test_a_folder_that_another_process_sweeps_before_it_is_locked_is_made_anew(
    tmp_path, monkeypatch, held
):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    make, made = tempfile.mkdtemp, []

    def made_and_swept(**words):
        made.append(Path(make(**words)))
        if len(made) == 1:
            descriptor = os.open(made[0], os.O_RDONLY | os.O_DIRECTORY)
            fcntl.flock(descriptor, fcntl.LOCK_EX)
            timer = threading.Timer(held, lambda: (made[0].rmdir(), os.close(descriptor)))
            timer.start()
            if not held:
                timer.join()
        return str(made[-1])

    monkeypatch.setattr(tempfile, "mkdtemp", made_and_swept)
    with child.scratch("late") as folder:
        assert folder == made[1] and folder.is_dir() and not made[0].exists()
