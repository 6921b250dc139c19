"""Python and the libraries beside it: which are installed, which work, what to type for the rest.

``python -m rom.doctor.libraries`` draws a sphere off-screen and says which window drew it.
"""

import json
import platform
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from time import perf_counter
from typing import Any

from rom.doctor.probes import Finding

PACKAGES = {
    "MPI": "python3-mpi4py",
    "PETSc": "python3-petsc4py",
    "MUMPS": "python3-petsc4py",
    "SLEPc": "python3-slepc4py",
    "dolfinx": "python3-dolfinx",
    "gmsh": "python3-gmsh",
    "meshio": "python3-meshio",
    "h5py": "python3-h5py",
}
OLD_NUMPY = 'pip install "numpy<1.25": the library was compiled for an older NumPy'
INSTALL_COMMAND = 'pip install pyvista matplotlib "vtk==9.5.2"'
SYSTEM_COMMAND = "sudo apt-get install libgl1 libegl1 libxrender1"
MIN_CONTRAST = 1.0  # standard deviation of grey levels; a lit sphere has about 50


def light() -> list[Finding]:
    """Python and the libraries everything needs; without them nothing of rom starts."""
    kind = "environment" if sys.prefix != sys.base_prefix else "system"
    found = [Finding("Python", "python", f"{platform.python_version()} ({kind}, {sys.prefix})")]
    for name in ("numpy", "scipy", "numba"):
        try:
            found.append(Finding("Python", name, version(name)))
        except PackageNotFoundError:
            found.append(Finding("Python", name, "", "broken", f"pip install {name}"))
    return found


def fenicsx(found: dict[str, dict[str, Any]], ending: str) -> list[Finding]:
    """One finding per library.

    Args:
        found: answers of the probe by name; a name that is missing was not reached.
        ending: how the probe ended, "" if well.
    """
    findings = [_finding(name, found.get(name), ending) for name in PACKAGES]
    if any(f.state == "missing" for f in findings):
        findings += _blind()
    return findings


def _finding(name: str, answer: dict[str, Any] | None, ending: str) -> Finding:
    if answer is None:
        return Finding("FEniCSx", name, ending or "no answer", "broken", "reinstall it")
    if answer.get("missing"):
        advice = f"sudo apt-get install {PACKAGES[name]}"
        return Finding("FEniCSx", name, "not installed", "missing", advice)
    if "error" in answer:
        binary = any(text in answer["error"] for text in ("dtype size", "NumPy 1.x", "multiarray"))
        advice = OLD_NUMPY if binary else f"sudo apt-get install --reinstall {PACKAGES[name]}"
        return Finding("FEniCSx", name, answer["error"], "broken", advice)
    return Finding("FEniCSx", name, answer["version"])


def _blind() -> list[Finding]:
    """Environments that cannot see what is installed in the system."""
    config = Path(sys.prefix, "pyvenv.cfg")
    text = config.read_text() if config.is_file() else ""
    if "include-system-site-packages = false" in text:
        advice = "/usr/bin/python3 -m venv --system-site-packages .venv"
        value = "does not see the packages of the system"
        return [Finding("FEniCSx", "environment", value, "note", advice)]
    if not Path(sys.base_prefix).samefile("/usr"):
        value = f"Debian's packages serve /usr/bin/python3, this is {sys.executable}"
        return [Finding("FEniCSx", "environment", value, "note")]
    return []


def pictures(found: dict[str, dict[str, Any]], ending: str) -> list[Finding]:
    """Versions, and whether a sphere could be drawn off-screen."""
    if "pyvista" not in found:
        state = "missing" if "No module named" in ending else "broken"
        value = "not installed" if state == "missing" else ending
        return [Finding("pictures", "pyvista", value, state, INSTALL_COMMAND), _matplotlib()]
    versions = [Finding("pictures", name, found[name]["version"]) for name in ("pyvista", "vtk")]
    return [*versions, _matplotlib(), _display(found.get("picture"), ending)]


def _matplotlib() -> Finding:
    try:
        return Finding("pictures", "matplotlib", version("matplotlib"))
    except PackageNotFoundError:
        return Finding("pictures", "matplotlib", "not installed", "missing", INSTALL_COMMAND)


def _display(picture: dict[str, Any] | None, ending: str) -> Finding:
    name = "drawing off-screen"
    if picture is None:
        return Finding("pictures", name, ending or "no answer", "broken", SYSTEM_COMMAND)
    if picture["contrast"] < MIN_CONTRAST:
        return Finding(
            "pictures", name, f"{picture['window']} draws blank", "broken", SYSTEM_COMMAND
        )
    return Finding("pictures", name, f"{picture['window']}, {picture['seconds']} s")


def draw() -> None:
    """Write one JSON line per thing found."""
    import pyvista
    import vtk

    _write("pyvista", version=pyvista.__version__)
    _write("vtk", version=vtk.vtkVersion().GetVTKVersion())
    began = perf_counter()
    plotter: Any = pyvista.Plotter(off_screen=True, window_size=[200, 200])
    plotter.add_mesh(pyvista.Sphere())
    contrast = float(plotter.screenshot(return_img=True).std())
    seconds = round(perf_counter() - began, 2)
    _write("picture", window=plotter.ren_win.GetClassName(), contrast=contrast, seconds=seconds)
    plotter.close()


def _write(name: str, **found: Any) -> None:
    sys.stdout.write(json.dumps({"name": name, **found}) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    draw()
