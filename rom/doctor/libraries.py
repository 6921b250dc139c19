"""FEniCSx and the libraries beside it, as `rom.fe.probe` found them."""

import sys
from pathlib import Path
from typing import Any

from rom.doctor.finding import Finding

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
