"""A window to turn things around in; its process never loads dolfinx.

Run as ``python -m rom.view.scenes.window FOLDER`` it shows the scenes that `show` has left there:
the arrow keys go from one to the next, the mouse turns them, q closes the window.
"""

import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rom.arguments import AnyBody, AnyMechanism, typed, whole
from rom.errors import ConfigError
from rom.model import FEModel
from rom.process.child import scratch
from rom.view.canvas import draw, offscreen
from rom.view.canvas.draw import Plotter, aim, read
from rom.view.canvas.offscreen import require, write_scene
from rom.view.canvas.scene import UNDEFORMED_COLOUR, sharp_edges
from rom.view.figures.things import NO_LINES, Scene, Thing, seen
from rom.view.scenes.film import start_scene
from rom.view.scenes.meshes import meshed, surface_of
from rom.view.scenes.mode_shapes import AMPLITUDE_RATIO, elastic_shapes

WINDOW_WIDTH = 1200  # [pixel]
PHASES = tuple(2 * np.pi * np.arange(24) / 24)  # of the frames of a mode [rad]
FRAME_PAUSE = 40  # between frames [ms]
KEYS_HELP = "arrow keys: next and last; mouse: turn; q: close"


def has_display() -> bool:
    """Whether a window can be opened: on Linux by what the desktop says."""
    if sys.platform.startswith("linux"):
        return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    return True


def mode_scenes(
    body: AnyBody, n: int, fixed: tuple[str, ...] = (), phases: Sequence[float] = PHASES
) -> list[Scene]:
    """The lowest elastic modes of a body, moving."""
    body = body.in_units("SI")
    surface = surface_of(body)
    X, size = surface.points, np.ptp(surface.points, axis=0).max()
    still = Thing(X, sharp_edges(X, surface.triangles), UNDEFORMED_COLOUR, width=1.0)
    scenes = []
    for name, u in elastic_shapes(body, n, fixed).items():
        length = np.linalg.norm(u, axis=1)
        moved = X + AMPLITUDE_RATIO * size / length.max() * np.multiply.outer(np.sin(phases), u)
        moving = Thing(moved, surface.triangles, values=length / length.max(), edges=NO_LINES)
        things = {"moving": moving, "_still": still}
        scenes.append(Scene(f"{body.name}, {name}", things, limits=(0.0, 1.0)))
    return scenes


@typed
def plotter(thing: AnyBody | FEModel | AnyMechanism, *, n: int = 1) -> Any:
    """A plotter of pyvista with a body, a model or a mechanism in it, to add to and turn around.

    VTK does not live together with dolfinx: this works where dolfinx was not imported, e.g. with
    bodies from files. All else of `rom.view` draws in a process of its own and needs no care.

    Args:
        thing: flexible body with a surface, in its n-th mode; model; or mechanism at its start.
        n: number of the elastic mode of a body, from 1.

    Returns:
        A ``pyvista.Plotter``: ``plotter.show()`` opens it.

    Raises:
        ConfigError: if dolfinx is loaded here, there is nothing to draw, or no such mode.
        ResourceError: if pyvista is missing.
    """
    if "dolfinx" in sys.modules:
        text = "dolfinx is loaded in this process, in which VTK may abort"
        raise ConfigError(f"{text}; save the body with rom.save and load it in another process.")
    require("pyvista")
    import pyvista

    shown = _shown(thing, n)
    made: Plotter = pyvista.Plotter(window_size=[WINDOW_WIDTH, 3 * WINDOW_WIDTH // 4])
    made.set_background("white")
    with scratch("view") as folder:
        _leave(folder, shown)
        scene, arrays = read(folder)
    draw.show(made, scene, arrays)
    aim(made, scene, arrays)
    made.add_axes()
    return made


def _shown(thing: AnyBody | FEModel | AnyMechanism, n: int) -> Scene:
    if isinstance(thing, FEModel):
        return Scene("mesh", meshed(thing))
    if hasattr(thing, "parts"):
        return start_scene(thing, "start")
    scenes = mode_scenes(thing, n, phases=(np.pi / 2,))
    whole("n", n, 1, len(scenes), reason=f"the elastic modes of body {thing.name!r}")
    return scenes[n - 1]


def show(scenes: Sequence[Scene]) -> None:
    """Open a window and wait until it is closed."""
    require("pyvista")
    with scratch("view") as folder:
        leave(scenes, folder)
        offscreen.show("rom.view.scenes.window", folder)


def leave(scenes: Sequence[Scene], folder: Path) -> None:
    """Write the scenes where the process of the window finds them."""
    for k, scene in enumerate(scenes):
        (folder / str(k)).mkdir()
        _leave(folder / str(k), scene)
    (folder / "titles.json").write_text(json.dumps([scene.title for scene in scenes]))


def _leave(folder: Path, scene: Scene) -> None:
    view = seen(scene, WINDOW_WIDTH)
    write_scene(folder, view.actors, view.camera, view.limits)


class Window:
    """The scenes of a folder on a plotter of pyvista."""

    def __init__(self, folder: Path, *, off_screen: bool = False) -> None:
        import pyvista

        self.folder, self.at, self.frame = folder, 0, 0
        self.titles = json.loads((folder / "titles.json").read_text())
        self.plotter: Plotter = pyvista.Plotter(
            off_screen=off_screen, window_size=[WINDOW_WIDTH, 3 * WINDOW_WIDTH // 4]
        )
        self.plotter.background_color = pyvista.Color("white")
        self.go(0)

    def go(self, step: int) -> None:
        """Show the scene so many further on."""
        self.at, self.frame = (self.at + step) % len(self.titles), 0
        self.scene, self.arrays = read(self.folder / str(self.at))
        self.plotter.clear_actors()
        draw.show(self.plotter, self.scene, self.arrays)
        text = self.titles[self.at] + f"\n{KEYS_HELP}" * (len(self.titles) > 1)
        self.plotter.add_text(text, font_size=10, color="#20242a", name="title", render=False)
        if not step:
            aim(self.plotter, self.scene, self.arrays)

    def tick(self, *_: object) -> None:
        """Show the next frame of what moves."""
        self.frame += 1
        draw.show(self.plotter, self.scene, self.arrays, self.frame)
        self.plotter.render()

    def open(self) -> None:
        """Until it is closed."""
        self.plotter.add_key_event("Right", lambda: self.go(1))
        self.plotter.add_key_event("Left", lambda: self.go(-1))
        self.plotter.add_timer_event(max_steps=10**9, duration=FRAME_PAUSE, callback=self.tick)
        self.plotter.show()


if __name__ == "__main__":
    Window(Path(sys.argv[1])).open()
