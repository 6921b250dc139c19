"""Draws scenes in a child process, because VTK does not live together with dolfinx.

With what all pictures need: packages, a look, and a place to be written.
"""

import json
from collections.abc import Sequence
from contextlib import AbstractContextManager
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import numpy.typing as npt

from rom.errors import ConfigError, ResourceError
from rom.io.files import check_writable
from rom.process.child import python, run, scratch
from rom.process.progress import followed
from rom.view.canvas.draw import COUNT_FILE
from rom.view.canvas.draw import Image as Image
from rom.view.canvas.scene import TEXT_COLOUR, Actor, Camera

COLOUR_MAP = "viridis"
OVERSAMPLING = 2  # smooth edges on every driver
INSTALL_COMMAND = "pip install pyvista matplotlib"
PAGE_STYLE = {"font.family": "DejaVu Sans", "axes.edgecolor": "#5c636e", "axes.linewidth": 0.8} | {
    key: TEXT_COLOUR for key in ("text.color", "axes.labelcolor", "xtick.color", "ytick.color")
}


def render(
    actors: Sequence[Actor],
    camera: Camera,
    *,
    limits: tuple[float, float] = (0.0, 1.0),
    oversampling: int = OVERSAMPLING,
) -> Image:
    """(f, height, width, 3) pixels; limits are of the colours, and what has one frame stays."""
    require("pyvista")
    with scratch("view") as folder:
        write_scene(folder, actors, camera, limits, oversampling)
        n, count = max(len(actor.points) for actor in actors), folder / COUNT_FILE
        label = f"drawing {n} pictures"
        with followed(n, label, lambda: count.stat().st_size if count.exists() else 0):
            show("rom.view.canvas.draw", folder)
        return np.load(folder / "pictures.npy", allow_pickle=False)


def require(package: str) -> None:
    """Make sure that a package for pictures is there."""
    if find_spec(package) is None:
        what = f"pictures need {package}, which is not installed."
        raise ResourceError(what, hint=f"{INSTALL_COMMAND}.")


def styled() -> AbstractContextManager[None]:
    """Context in which axes and words get the look of the house."""
    require("matplotlib")
    from matplotlib import rc_context

    return rc_context(PAGE_STYLE)


def checked(path: str | Path, *endings: str) -> Path:
    """The path, if pictures of that ending are made and it can be written."""
    path = check_writable(path)
    if path.suffix.lower() not in endings:
        known = " or ".join(endings)
        raise ConfigError(f"{path}: the ending {path.suffix!r} is unknown.", hint=f"Use {known}.")
    return path


def write_scene(
    folder: Path,
    actors: Sequence[Actor],
    camera: Camera,
    limits: tuple[float, float],
    oversampling: int = OVERSAMPLING,
) -> None:
    """Leave a scene where a child process finds it."""
    arrays: dict[str, npt.ArrayLike]
    arrays = {"focus": camera.focus, "toward": camera.toward, "up": camera.up}
    for k, actor in enumerate(actors):
        arrays |= {f"points {k}": actor.points.astype(np.float32), f"cells {k}": actor.cells}
        if actor.values is not None:
            arrays[f"values {k}"] = actor.values.astype(np.float32)
    np.savez(folder / "arrays.npz", **arrays)
    style = [{k: getattr(a, k) for k in ("colour", "width", "opacity", "lit")} for a in actors]
    scene = {"height": camera.height, "size": camera.size, "oversampling": oversampling}
    scene |= {"limits": limits, "actors": style}
    (folder / "scene.json").write_text(json.dumps(scene | {"colours": COLOUR_MAP}))


def show(module: str, folder: Path) -> None:
    """Let a module that draws do so with what it finds in a folder, to its good end."""
    done = run(python(module, str(folder)))
    if done.code:
        how = f"signal {-done.code}" if done.code < 0 else f"code {done.code}"
        raise ConfigError(
            f"the process that draws ended with {how}: {done.last}.",
            hint="`rom doctor` tests drawing without a screen and says what to install.",
        )
