"""The machine, Python and libraries: what is installed, what works, what to type for the rest.

``python -m rom.doctor.libraries`` draws a sphere off-screen and says which window drew it.
"""

import os
import platform
import re
import shutil
import sys
import time
import timeit
from collections.abc import Iterator, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from rom.doctor.core import abilities, better, taken_for
from rom.doctor.probes import Answer, Finding, say
from rom.fe import GMSH_LIBRARIES, WHEEL_PACKAGES
from rom.places import PACKAGE
from rom.process import mpirun
from rom.process.memory import free_bytes, mapped_files

PACKAGES = {  # of Debian, and of pip
    "MPI": ("python3-mpi4py", "mpi4py mpich"),
    "PETSc": ("python3-petsc4py", "dolfinx-solver-real"),
    "MUMPS": ("python3-petsc4py", "dolfinx-solver-real"),
    "SLEPc": ("python3-slepc4py", "dolfinx-solver-real"),
    "dolfinx": ("python3-dolfinx", "dolfinx-solver-real"),
    "gmsh": ("python3-gmsh", "gmsh"),
    "h5py": ("python3-h5py", "h5py"),
}
LAUNCHERS = ("openmpi-bin", "mpich")
WHEELS_NEED = (3, 12)  # Python
OLD_NUMPY = 'pip install "numpy<1.25": the library was compiled for an older NumPy'
INSTALL_COMMAND = "pip install pyvista matplotlib"
BESIDE_DEBIAN = ' "vtk==9.5.2"'  # later ones abort beside its dolfinx
SYSTEM_COMMAND = "sudo apt-get install libgl1 libegl1 libxrender1"
MIN_CONTRAST = 1.0  # standard deviation of grey levels; a lit sphere has about 50
BLAS_FILE = re.compile(r"/lib(blas|openblas|scipy_openblas|mkl_rt|blis|flexiblas|cblas)[^/]*\.so")
FAST_BLAS = re.compile(r"openblas|mkl|blis|atlas", re.IGNORECASE)
SLOW_ADVICE = "5 to 9 times faster: sudo apt-get install libopenblas0-pthread"
REMOVE_COMMAND = "rom doctor --fix"
AT_WORK = 60.0  # seconds after which nobody is still writing a temporary file
END_OF_PICKLE = b"."


def light() -> list[Finding]:
    """Python and the libraries everything needs; without them nothing of rom starts."""
    kind = "environment" if sys.prefix != sys.base_prefix else "system"
    found = [Finding("Python", "python", f"{platform.python_version()} ({kind}, {sys.prefix})")]
    needed = ("numpy", "scipy", "numba")
    return found + [_package("Python", name, "broken", f"pip install {name}") for name in needed]


def _package(topic: str, name: str, otherwise: str, advice: str) -> Finding:
    """A package by its version, or the state of what lacks it."""
    try:
        return Finding(topic, name, version(name))
    except PackageNotFoundError:
        return Finding(topic, name, "not installed", otherwise, advice)


def fenicsx(found: dict[str, Answer], ending: str) -> list[Finding]:
    """One finding per library, of the answers of a probe that ended well, "", or otherwise."""
    findings = [_finding(name, found.get(name), ending) for name in PACKAGES]
    findings.insert(1, _launcher(found.get("MPI", {}).get("version", "")))
    if any(f.state == "missing" for f in findings):
        findings += _other_ways()
    return findings


def _finding(name: str, answer: Answer | None, ending: str) -> Finding:
    if answer is None:
        return Finding("FEniCSx", name, ending or "no answer", "broken", "reinstall it")
    if answer.get("missing"):
        return Finding("FEniCSx", name, "not installed", "missing", command(*PACKAGES[name]))
    if "error" in answer:
        return Finding("FEniCSx", name, answer["error"], "broken", _repair(name, answer["error"]))
    return Finding("FEniCSx", name, answer["version"])


def _repair(name: str, error: str) -> str:
    if name == "gmsh" and "cannot open shared object" in error and not sees_debian():
        return f"sudo apt-get install {GMSH_LIBRARIES}"
    if not sees_debian():
        return f"pip install --force-reinstall {PACKAGES[name][1]}"
    if any(text in error for text in ("dtype size", "NumPy 1.x", "multiarray")):
        return OLD_NUMPY
    return f"sudo apt-get install --reinstall {PACKAGES[name][0]}"


def _launcher(library: str) -> Finding:
    """The program that starts ranks; whether it is of the MPI that Python loads, by its words."""
    program = mpirun.found()
    if not program:
        told = ("missing", command(*LAUNCHERS)) if library else ()
        return Finding("FEniCSx", mpirun.PROGRAM_NAME, "not installed", *told)
    launcher = mpirun.version(program)
    value = f"{program}, {launcher or 'of which MPI is not known'}"
    kinds = [kind for kind in mpirun.KINDS if library.startswith(kind)]
    if launcher and kinds and not launcher.startswith(kinds[0]):
        value += f"; Python loads {kinds[0]}, whose processes it cannot bring together"
        return Finding("FEniCSx", mpirun.PROGRAM_NAME, value, "note", command(*LAUNCHERS))
    typed = shutil.which(mpirun.PROGRAM_NAME)
    if library and typed != program:
        value += f"; what {mpirun.PROGRAM_NAME} alone starts is {typed or 'nothing'}"
        return Finding("FEniCSx", mpirun.PROGRAM_NAME, value, "note", f"{program} -n 2 rom ...")
    return Finding("FEniCSx", mpirun.PROGRAM_NAME, value)


def command(debian: str, pip: str) -> str:
    """What to type for a library: of Debian where this Python looks for packages, else of pip."""
    if not sees_debian() and sys.version_info >= WHEELS_NEED:
        return f"pip install {pip}"
    return f"sudo apt-get install {debian}"


def sees_debian() -> bool:
    """Whether this Python looks where Debian installs its packages."""
    config = Path(sys.prefix, "pyvenv.cfg")
    closed = config.is_file() and "include-system-site-packages = false" in config.read_text()
    return not closed and Path(sys.base_prefix).samefile("/usr")


def _other_ways() -> list[Finding]:
    """Where this Python does not look, and what the other of both ways in needs."""
    wheels = f"pip install {WHEEL_PACKAGES}"
    newer = ".".join(map(str, WHEELS_NEED))
    if sees_debian():
        value = f"or by pip alone, in a venv of its own with Python {newer} or later"
        return [Finding("FEniCSx", "other way", value, "note", wheels)]
    value = "does not see the packages of the system"
    if not Path(sys.base_prefix).samefile("/usr"):
        value = f"Debian's packages serve /usr/bin/python3, this is {sys.executable}"
    advice = "/usr/bin/python3 -m venv --system-site-packages .venv"
    found = [Finding("FEniCSx", "environment", value, "note", advice)]
    if sys.version_info < WHEELS_NEED:
        value = f"by pip alone with Python {newer} or later, this is {platform.python_version()}"
        found.append(Finding("FEniCSx", "other way", value, "note", wheels))
    return found


def pictures(found: dict[str, Answer], ending: str) -> list[Finding]:
    """Versions, and whether a sphere could be drawn off-screen."""
    advice = INSTALL_COMMAND + (BESIDE_DEBIAN if sees_debian() else "")
    matplotlib = _package("pictures", "matplotlib", "missing", advice)
    if "pyvista" not in found:
        state = "missing" if "No module named" in ending else "broken"
        value = "not installed" if state == "missing" else ending
        return [Finding("pictures", "pyvista", value, state, advice), matplotlib]
    versions = [Finding("pictures", name, found[name]["version"]) for name in ("pyvista", "vtk")]
    name, picture = "drawing off-screen", found.get("picture")
    value = f"{picture['window']} draws blank" if picture else ending or "no answer"
    display = Finding("pictures", name, value, "broken", SYSTEM_COMMAND)
    if picture and picture["contrast"] >= MIN_CONTRAST:
        display = Finding("pictures", name, f"{picture['window']}, {picture['seconds']} s")
    return [*versions, matplotlib, display]


def blas(mapped: list[str]) -> list[Finding]:
    """Which BLAS a process with PETSc has mapped, or else this one, and how fast NumPy's is."""
    theirs, own = ({f for f in some if BLAS_FILE.search(f)} for some in (mapped, mapped_files()))
    files = sorted(theirs or own)
    slow = [f for f in files if not FAST_BLAS.search(f)]
    about = _told_by_threadpoolctl()
    named = ", ".join(f + about.get(f, "") for f in slow or files) or "not found in the memory map"
    told = (f"reference, {named}", "note", SLOW_ADVICE) if slow else (named,)
    found = [Finding("BLAS", "library", *told)]
    for core in dict.fromkeys(taken_for(file) for file in files):
        if wanted := better(core, abilities()):
            advice = f"several times faster: export OPENBLAS_CORETYPE={wanted}"
            found.append(Finding("BLAS", "processor", f"taken for a {core}", "note", advice))
    A = np.ones((400, 400))
    seconds = timeit.repeat(lambda: A @ A, number=1, repeat=2)[1]  # the first one wakes it up
    return [*found, Finding("BLAS", "matrix product", f"{2e-9 * 400**3 / seconds:.1f} GFlop/s")]


def _told_by_threadpoolctl() -> dict[str, str]:
    """{file: version, processor and threads} of what this process has loaded, where it is there."""
    try:
        from threadpoolctl import threadpool_info
    except ImportError:
        return {}
    told = " (version {version}, {architecture}, threads: {num_threads})".format
    return {one["filepath"]: told(**{"architecture": "any", **one}) for one in threadpool_info()}


def machine() -> list[Finding]:
    """Memory and cores."""
    total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    free = free_bytes() / 2**30
    cores = len(os.sched_getaffinity(0))
    threads = os.environ.get("OMP_NUM_THREADS", "not set")
    return [
        Finding("machine", "memory", f"{total:.1f} GiB, of which {free:.1f} GiB may be taken"),
        Finding("machine", "cores", f"{cores}, OMP_NUM_THREADS {threads}"),
    ]


def caches(forms: Answer, *, fix: bool) -> list[Finding]:
    """State of the cache of forms, by what the probe says and removed, and of that of Numba."""
    found = []
    if "path" in forms and forms["writable"]:
        found = [_cache("compiled forms", forms["path"], forms["stale"], fix)]
    elif "path" in forms:
        value = f"{forms['path']} cannot be written; forms are compiled in every run"
        advice = f"chown it: {forms['path']}"
        found = [Finding("caches", "compiled forms", value, "note", advice)]
    own = os.environ.get("NUMBA_CACHE_DIR")  # where Numba may keep what it compiled for rom
    folders = [Path(own), PACKAGE] if own else [PACKAGE]
    damaged = [path for folder in folders for path in damaged_files(folder)]
    if fix:
        for path in damaged:
            path.unlink(missing_ok=True)
    return [*found, _cache("compiled by Numba", "", damaged, fix)]


def _cache(name: str, where: str, damaged: Sequence[object], fix: bool) -> Finding:
    if not damaged:
        return Finding("caches", name, f"{where} healthy".strip())
    if fix:
        return Finding("caches", name, f"{len(damaged)} damaged files removed {where}".strip())
    value = f"{len(damaged)} damaged files, e.g. {damaged[0]}"
    return Finding("caches", name, value, "note", REMOVE_COMMAND)


def damaged_files(folder: Path) -> Iterator[Path]:
    """Index and code files that end in the middle, and temporary ones nobody writes any more."""
    for path in sorted(folder.rglob("*.nb[ic]*")):
        try:
            if ".tmp." in path.name:
                damaged = time.time() - path.stat().st_mtime > AT_WORK
            else:
                damaged = path.read_bytes()[-1:] != END_OF_PICKLE
        except OSError:
            continue
        if damaged:
            yield path


def draw() -> None:
    """Write one JSON line per thing found."""
    import pyvista
    from vtkmodules.vtkCommonCore import vtkVersion  # all of vtk is twice the work

    say("pyvista", version=pyvista.__version__)
    say("vtk", version=vtkVersion().GetVTKVersion())
    began = time.perf_counter()
    plotter: Any = pyvista.Plotter(off_screen=True, window_size=[200, 200])
    plotter.add_mesh(pyvista.Sphere())
    contrast = float(plotter.screenshot(return_img=True).std())
    seconds = round(time.perf_counter() - began, 2)
    say("picture", window=plotter.ren_win.GetClassName(), contrast=contrast, seconds=seconds)
    plotter.close()


if __name__ == "__main__":
    draw()
