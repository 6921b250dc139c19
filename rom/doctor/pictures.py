"""Drawing without a screen, as `rom.doctor.drawing` found it."""

from importlib.metadata import PackageNotFoundError, version
from typing import Any

from rom.doctor.finding import Finding

INSTALL_COMMAND = 'pip install pyvista matplotlib "vtk==9.5.2"'
SYSTEM_COMMAND = "sudo apt-get install libgl1 libegl1 libxrender1"
MIN_CONTRAST = 1.0  # standard deviation of grey levels; a lit sphere has about 50


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
