"""What the doctor finds and says, what it compiles for first uses, and what is left to compile."""

import importlib.util
import json
import os
import subprocess
import sys
import time
from importlib.metadata import PackageNotFoundError

import pytest

from benchmarks.benchmarks import start
from cases.command import environment, python
from cases.command import rom as command
from cases.long import few
from rom.cli.main import main
from rom.doctor import first_use, libraries
from rom.doctor.core import abilities, better, taken_for
from rom.doctor.libraries import blas, damaged_files, fenicsx
from rom.doctor.probes import compiled
from rom.fe import GMSH_LIBRARIES, HELPER_MODULE, WHEEL_PACKAGES

OPENBLAS = "/usr/lib/x86_64-linux-gnu/openblas-pthread/libblas.so.3"
REFERENCE = "/usr/lib/x86_64-linux-gnu/blas/libblas.so.3.11.0"
WHEEL = "/x/site-packages/numpy.libs/libscipy_openblas64_-8fb3d286.so"
MODULES = {"MPI": "mpi4py", "PETSc": "petsc4py", "SLEPc": "slepc4py", "dolfinx": "dolfinx",
           "gmsh": "gmsh", "h5py": "h5py"}  # fmt: skip


def examine(tmp_path, *options, fakes=None):
    """Findings by name, exit code and stderr of a doctor that sees some fake modules."""
    for name, text in (fakes or {}).items():
        (tmp_path / f"{name}.py").write_text(text)
    done = command("doctor", "--json", *options, env=environment(PYTHONPATH=str(tmp_path)))
    assert done.stdout, done.stderr
    found = {f["name"]: f for f in json.loads(done.stdout)["findings"]}
    return found, done.returncode, done.stderr


def test_the_doctor_is_right_about_this_machine_within_a_minute(tmp_path):
    start = time.perf_counter()
    found, code, stderr = examine(tmp_path)
    assert time.perf_counter() - start < 60
    for name, module in (MODULES | {"pyvista": "pyvista"}).items():
        there = importlib.util.find_spec(module) is not None
        assert found[name]["state"] == ("ok" if there else "missing"), found[name]
    assert (code, stderr) == (0, "")
    for name in ("python", "numpy", "scipy", "numba", "library", "memory", "cores"):
        assert found[name]["state"] in ("ok", "note")
        assert found[name]["value"]


@pytest.mark.fenicsx
def test_versions_are_those_the_libraries_report(tmp_path):
    dolfinx = pytest.importorskip("dolfinx", reason="dolfinx is not installed")
    from petsc4py import PETSc

    found, _, _ = examine(tmp_path)
    assert found["dolfinx"]["value"] == dolfinx.__version__
    version = ".".join(map(str, PETSc.Sys.getVersion()))
    assert found["PETSc"]["value"].startswith(f"{version} (float64")
    within = importlib.util.find_spec(HELPER_MODULE) is not None  # without a version
    assert found["MUMPS"]["value"] == "works" if within else found["MUMPS"]["value"][0] in "56"


def test_what_is_missing_is_named_and_what_crashes_takes_nothing_with_it(tmp_path):
    """Exit code 0: an environment without FEniCSx is a legal one."""
    gone = [*MODULES.values(), "pyvista", "vtk"]
    text = 'raise ModuleNotFoundError("No module named {0!r}", name={0!r})\n'
    found, code, _ = examine(tmp_path, fakes={name: text.format(name) for name in gone})
    assert code == 0
    for name, packages in libraries.PACKAGES.items():
        assert found[name]["state"] == "missing"
        assert found[name]["advice"].endswith(packages)  # of Debian or of pip
    assert found["pyvista"]["state"] == "missing" and "pip install" in found["pyvista"]["advice"]
    found, code, stderr = examine(tmp_path, fakes={"gmsh": "import os\nos.abort()\n"})
    assert code == 5
    assert found["gmsh"]["state"] == "broken" and found["gmsh"]["value"] == "crashed (SIGABRT)"
    assert "gmsh is broken: crashed" in stderr


GLU = "OSError: libGLU.so.1: cannot open shared object file"
SIZE = "ValueError: numpy.dtype size changed"


@pytest.mark.parametrize(
    ("name", "error", "debian", "python", "advice"),
    [
        ("gmsh", "", True, (3, 13), "sudo apt-get install python3-gmsh"),
        ("gmsh", "", False, (3, 12), "pip install gmsh"),
        ("gmsh", "", False, (3, 11), "sudo apt-get install python3-gmsh"),
        ("gmsh", GLU, False, (3, 12), f"sudo apt-get install {GMSH_LIBRARIES}"),
        ("gmsh", GLU, True, (3, 12), "sudo apt-get install --reinstall python3-gmsh"),
        ("h5py", SIZE, True, (3, 12), libraries.OLD_NUMPY),
        ("h5py", SIZE, False, (3, 12), "pip install --force-reinstall h5py"),
    ],
)
def test_what_to_type_fits_where_this_python_looks(
    monkeypatch, name, error, debian, python, advice
):
    """The wheels refuse an environment that sees Debian's petsc4py, and there is none for 3.11."""
    monkeypatch.setattr(libraries, "sees_debian", lambda: debian)
    monkeypatch.setattr(sys, "version_info", python)
    answers = {name: {"error": error} if error else {"missing": name}}
    found = {f.name: f for f in fenicsx(answers, "")}
    assert (found[name].state, found[name].advice) == ("broken" if error else "missing", advice)
    notes = " ".join(f.advice for f in found.values() if f.state == "note")
    if not error:
        assert (f"pip install {WHEEL_PACKAGES}" in notes) == (advice[:4] == "sudo")
        assert ("--system-site-packages" in notes) == (not debian)


@pytest.mark.parametrize(
    ("library", "beside", "told", "state", "words"),
    [("Open MPI v4.1.4, mpi4py 3", "", "Open MPI 4.1.4", "ok", "/usr/bin/mpirun, Open MPI 4.1.4"),
     ("MPICH 5.0.2, mpi4py 4", "", "MPICH 5.0.2", "ok", "/usr/bin/mpirun, MPICH 5.0.2"),
     ("MPICH 5.0.2, mpi4py 4", "", "Open MPI 4.1.4", "note", "Python loads MPICH, whose processes"),
     ("MPICH 5.0.2, mpi4py 4", "/e/bin/mpirun", "MPICH 5.0.2", "note", "starts is /usr/bin/mpirun"),
     ("", "", "Open MPI 4.1.4", "ok", "/usr/bin/mpirun, Open MPI 4.1.4"),
     ("MPICH 5.0.2, mpi4py 4", None, "", "missing", "not installed"),
     ("", None, "", "ok", "not installed")],
)  # fmt: skip
def test_the_launcher_is_that_of_the_mpi_that_is_loaded(
    monkeypatch, library, beside, told, state, words
):
    monkeypatch.setattr(libraries.shutil, "which", lambda name: "/usr/bin/mpirun")
    program = "" if beside is None else beside or "/usr/bin/mpirun"
    monkeypatch.setattr(libraries.mpirun, "found", lambda: program)
    monkeypatch.setattr(libraries.mpirun, "version", lambda program: told)
    found = {f.name: f for f in fenicsx({"MPI": {"version": library}} if library else {}, "")}
    assert found["mpirun"].state == state and words in found["mpirun"].value
    assert bool(found["mpirun"].advice) == (state != "ok")


@pytest.mark.parametrize(
    ("mapped", "state"),
    [([OPENBLAS], "ok"), ([REFERENCE], "note"), ([WHEEL], "ok"), ([WHEEL, REFERENCE], "note"),
     (["/usr/lib/x86_64-linux-gnu/libmkl_rt.so"], "ok")],
)  # fmt: skip
def test_the_slow_reference_blas_is_told_from_fast_ones(mapped, state):
    """With NumPy from a wheel it is PETSc's BLAS that counts."""
    library, *_, speed = blas(["/usr/lib/libc.so.6", *mapped])
    assert library.state == state
    assert ("libopenblas0-pthread" in library.advice) == (state == "note")
    assert float(speed.value.split()[0]) > 0.1
    own = blas(["/usr/lib/libc.so.6"])[0].value  # that of this process
    assert "blas" in own and "not found" not in own
    assert any(taken_for(file.partition(" (")[0]) for file in own.split(", ")) == (
        "openblas" in own
    )


@pytest.mark.parametrize(
    ("core", "flags", "wanted"),
    [("Prescott", "sse2 avx2 fma avx512f avx512bw avx512dq avx512vl", "SkylakeX"),
     ("Prescott", "sse2 avx2 fma avx512f", "Haswell"), ("Prescott", "sse2", ""),
     ("Zen", "sse2 avx2 fma", ""), ("", "sse2 avx2 fma", "")],
)  # fmt: skip
def test_a_processor_that_openblas_does_not_know_is_named(core, flags, wanted):
    assert better(core, set(flags.split())) == wanted


def test_a_mistaken_openblas_is_reported_with_its_cure(monkeypatch, tmp_path):
    told = tmp_path / "cpuinfo"
    told.write_text("processor\t: 0\nflags\t\t: fma avx2\n\nprocessor\t: 1\nflags\t\t: sse\n")
    assert abilities(told) == {"fma", "avx2"} and abilities(tmp_path / "nothing") == set()
    monkeypatch.setattr(libraries, "taken_for", lambda file: "Prescott")
    monkeypatch.setattr(libraries, "abilities", lambda: {"avx2", "fma"})
    note = next(finding for finding in blas([OPENBLAS]) if finding.name == "processor")
    assert (note.state, note.advice[-7:]) == ("note", "Haswell")


def test_a_missing_light_library_is_essential(monkeypatch):
    def version(name):
        if name == "numba":
            raise PackageNotFoundError(name)
        return "1.0"

    monkeypatch.setattr("rom.doctor.libraries.version", version)
    states = {f.name: f.state for f in libraries.light()}
    assert states["numba"] == "broken" and states["numpy"] == "ok"


@pytest.mark.parametrize(
    ("picture", "ending", "state"),
    [({"window": "vtkEGLRenderWindow", "contrast": 50.0, "seconds": 1.0}, "", "ok"),
     ({"window": "vtkEGLRenderWindow", "contrast": 0.0, "seconds": 1.0}, "", "broken"),
     (None, "crashed (SIGSEGV)", "broken")],
)  # fmt: skip
def test_a_blank_picture_or_a_crash_is_a_broken_display(picture, ending, state):
    answers = {"pyvista": {"version": "1"}, "vtk": {"version": "9"}}
    found = libraries.pictures(answers | ({"picture": picture} if picture else {}), ending)
    assert found[-1].name == "drawing off-screen" and found[-1].state == state


def old(path, data=b"x", age=3600):
    path.write_bytes(data)
    then = time.time() - age
    os.utime(path, (then, then))
    return path


@pytest.mark.long
@pytest.mark.fenicsx
def test_forms_left_by_a_killed_compilation_are_found_and_removed(tmp_path):
    cache = tmp_path / "fenics"
    cache.mkdir()
    stale = old(cache / "libffcx_forms_dead.c")
    done = old(cache / "libffcx_forms_done.c")
    old(cache / "libffcx_forms_done.c.cached")
    young = old(cache / "libffcx_forms_young.c", age=0)
    settings = environment(XDG_CACHE_HOME=str(tmp_path))

    def forms(*options):
        found = json.loads(command("doctor", "--json", *options, env=settings).stdout)["findings"]
        return next(f for f in found if f["name"] == "compiled forms")

    first = forms()
    assert first["state"] == "note" and first["value"] == f"1 damaged files, e.g. {stale}"
    assert first["advice"] == "rom doctor --fix" and stale.exists()
    young.unlink()
    assert "1 damaged files removed" in forms("--fix")["value"]
    assert not stale.exists() and done.exists()
    assert forms()["state"] == "ok"


def test_half_written_files_of_numba_are_found(tmp_path):
    numba = pytest.importorskip("numba")
    source = tmp_path / "compiled.py"
    source.write_text("import numba\n@numba.njit(cache=True)\ndef f(x):\n    return x\nf(1.0)\n")
    subprocess.run([sys.executable, source], check=True, timeout=60,
                   env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)})  # fmt: skip
    made = sorted(tmp_path.rglob("*.nb[ic]"))
    assert len(made) == 2, numba.__version__
    assert not list(damaged_files(tmp_path))
    for path in made:
        whole = path.read_bytes()
        for part in (whole[:-1], whole[: len(whole) // 2], b""):
            path.write_bytes(part)
            assert list(damaged_files(tmp_path)) == [path]
        path.write_bytes(whole)
    left = old(tmp_path / "f.1.nbc.tmp.0a1b")
    (tmp_path / "g.1.nbc.tmp.0a1c").write_bytes(b"")
    assert list(damaged_files(tmp_path)) == [left]


USED = """
import importlib, pkgutil
import rom.components, rom.mbs
from rom.doctor.first_use import CASES
from rom.mbs.compiler.cache import CODE_FILES
modules = [importlib.import_module(module.name) for package in (rom.mbs, rom.components)
           for module in pkgutil.walk_packages(package.__path__, package.__name__ + ".")]
for case in CASES.values():
    case()
found = [getattr(x, "kernel", x) for module in modules for x in vars(module).values()]
made = {x.py_func: x for x in found if type(x).__name__ == "CPUDispatcher"}
called = {getattr(f.__globals__.get(name), "py_func", None)
          for f in CODE_FILES for name in f.__code__.co_names}
first = {f: x for f, x in made.items() if f in CODE_FILES and f not in called}
print(len(first), *sorted(f.__qualname__ for f, x in first.items() if not x.overloads))
"""


@pytest.mark.long
@pytest.mark.once
def test_cases_of_first_use_ask_for_all_that_can_be_compiled():
    done = python("-c", USED, timeout=900)
    assert done.returncode == 0, done.stderr
    count, *unused = done.stdout.split()
    assert int(count) > 30 and not unused


FIRST_MOTIONS = """
import numba, numpy as np
from numba.core import event
import rom
from benchmarks.models import KINDS, bar, slider_crank

class Compiled(event.Listener):
    names = []
    def on_start(self, event):
        self.names.append(event.data["dispatcher"].__name__)
    def on_end(self, event):
        pass

event.register("numba:compile", Compiled())
pendulum = rom.Mechanism(gravity=(0, 0, -9.81))
bob = pendulum.add_rigid("bob", mass=2.0, inertia=(1e-3, 2e-3, 2e-3), at=(0.5, 0, 0),
                         markers={"pin": (-0.5, 0, 0)})
pendulum.revolute("hinge", pendulum.ground.marker((0, 0, 0)), bob.marker("pin"), axis=(0, 1, 0))
motion = rom.simulate(pendulum, t_end=0.05, dt=1e-3)
rom.audit(motion)
rod = rom.reduce(bar((0.16, 0.02, 0.012), (4, 1, 1)), method=rom.CraigBampton(6), interfaces=KINDS,
                 reference=tuple(KINDS), certify=False)
for reference in ("root", "free"):
    motion = rom.simulate(slider_crank(rod.with_reference(reference)), t_end=1e-3, dt=1e-5)
    motion.reaction("crank pin"), motion.position("slider"), motion.elastic("rod")
rom.audit(motion)
print(len(Compiled.names), *Compiled.names)
numba.njit(lambda x: x)(1.0)
print(len(Compiled.names))
"""


def test_after_the_set_up_first_motions_compile_nothing():
    """As Numba counts, which then counts a function of another kind."""
    done = command("doctor", "--compile", "demo", timeout=600)
    assert done.returncode == 0, done.stderr
    quiet = environment(PYTHONWARNINGS="ignore")
    done = python("-c", FIRST_MOTIONS, env=quiet, timeout=120)
    assert (done.stdout.split(), done.stderr) == (["0", "1"], "")


@pytest.mark.long
@pytest.mark.once
def test_first_uses_are_measured_with_nothing_compiled_and_again():
    figures = start(cases=("best_matching",), again=("best_matching",))
    first, seconds, again, short, load = (figure.value for figure in figures)
    assert (first, again) == (3, 0)
    assert short < seconds and load > 0


@pytest.mark.once
@pytest.mark.parametrize("how", few(1, ["aloud", "--quiet"]))
def test_the_doctor_says_what_it_compiles_unless_asked_not_to(how):
    more = [] if how == "aloud" else [how]
    env = environment(NUMBA_DISABLE_JIT="1")
    done = command("doctor", "--compile", "demo", "--json", *more, env=env)
    assert done.returncode == 0
    found = json.loads(done.stdout)["findings"]
    assert [f["name"] for f in found] == list(first_use.DEMO_CASES)
    assert {(f["state"], f["value"]) for f in found} == {("ok", "was compiled before")}
    said = done.stderr.splitlines()
    assert len(said) == (2 if how == "aloud" else 0)
    assert all(line.startswith(f"{k} of 2, ") for k, line in enumerate(said, 1))


MEETING = """
import json, pathlib, sys, time
here, case = pathlib.Path(__file__).parent, sys.argv[1]
(here / f"{case}.met").touch()
end = time.monotonic() + 30
while len(list(here.glob("*.met"))) < 2 and time.monotonic() < end:
    time.sleep(0.01)
if case == "crash":
    import os
    os.abort()
print(json.dumps({"name": case, "functions": int(time.monotonic() < end), "seconds": 1.25}))
"""


@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="there is one core")
def test_cases_are_compiled_side_by_side_and_one_that_crashes_takes_none_with_it(
    tmp_path, monkeypatch
):
    (tmp_path / "meeting.py").write_text(MEETING)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    found = {f.name: f for f in compiled("meeting", ("one", "crash", "two"))}
    assert found["one"].value == found["two"].value == "1 functions in 1.2 s of the processor"
    assert (found["crash"].state, found["crash"].value) == ("broken", "crashed (SIGABRT)")


def test_what_cannot_be_compiled_is_an_error(monkeypatch, capsys):
    monkeypatch.setattr(first_use, "CASES", {"no such case": None})
    assert main(["doctor", "--compile"]) == 5
    said = capsys.readouterr()
    assert "no such case is broken: failed: KeyError: 'no such case'" in said.err
    assert "broken: failed" in said.out
