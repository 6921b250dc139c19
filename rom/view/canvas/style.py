"""How pages look, and where they may be written."""

from pathlib import Path
from typing import Any

from rom.errors import ConfigError
from rom.io.files import check_writable
from rom.view.canvas.offscreen import require
from rom.view.canvas.scene import TEXT_COLOUR

PAGE_STYLE = {
    "font.family": "DejaVu Sans",
    "text.color": TEXT_COLOUR,
    "axes.labelcolor": TEXT_COLOUR,
    "axes.edgecolor": "#5c636e",
    "xtick.color": TEXT_COLOUR,
    "ytick.color": TEXT_COLOUR,
    "axes.linewidth": 0.8,
}


def styled() -> Any:
    """Context in which axes and words get the look of the house."""
    require("matplotlib")
    from matplotlib import rc_context

    return rc_context(PAGE_STYLE)


def checked(path: str | Path, *endings: str) -> Path:
    """The path, if pictures of that ending are made and it can be written.

    Raises:
        ConfigError: naming the endings, or what is wrong with the folder.
    """
    path = check_writable(path)
    if path.suffix.lower() not in endings:
        known = " or ".join(endings)
        raise ConfigError(f"{path}: the ending {path.suffix!r} is unknown.", hint=f"Use {known}.")
    return path
