"""Picture of a finite element mesh with its interfaces."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from rom.arguments import typed
from rom.errors import ConfigError
from rom.model import FEModel
from rom.view.canvas import page
from rom.view.canvas.scene import Camera, directed_edges
from rom.view.figures.things import NO_LINES, Scene, Thing, scene_page, seen

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAGE_WIDTH = 1500  # [pixel]
PART_COLOUR = "#c9d1da"
# one per interface
MARK_COLOURS = ("#d1495b", "#2f7f9f", "#edae49", "#66a182", "#8d6a9f", "#00798c")


@typed
@page.picture
def mesh(
    model: FEModel,
    path: str | Path | None = None,
    *,
    title: str = "Mesh",
    view: npt.ArrayLike | None = None,
    up: npt.ArrayLike | None = None,
) -> "Figure":
    """Draw the outer surface of a model, its elements and, in colour, its interfaces.

    Args:
        model: the model.
        path: picture to write, .png; None to write nothing.
        title: heading.
        view: (3,) direction from the body to the eye [1]; None: mainly along its shortest extent.
        up: (3,) upright direction [1]; None: across its longest extent.

    Raises:
        ConfigError: if the model has no surface, or pictures cannot be made here.
    """
    camera = seen(Scene(title, meshed(model), view=view, up=up), PAGE_WIDTH).camera
    hidden = [name for name in model.interfaces if not in_sight(model, name, camera)]
    told = {name: f"{name} (turned away)" for name in hidden}
    things = {told.get(name, name): thing for name, thing in meshed(model).items()}
    whole = seen(Scene(title, things, view=view, up=up), PAGE_WIDTH)
    size = np.ptp(model.points, axis=0) * 1e3
    words = (
        f"Finite element mesh: {model.n_dofs} displacement dofs, "
        f"{size[0]:.4g} mm x {size[1]:.4g} mm x {size[2]:.4g} mm. Lines join neighbouring nodes of "
        "the outer surface; coloured surfaces are the interfaces, through which the body touches "
        "the rest of the mechanism."
    )
    return scene_page(whole, words)


@typed
def meshed(model: FEModel) -> dict[str, Thing]:
    """The outer surface with its elements, and its interfaces by name, as things of a `Scene`.

    Raises:
        ConfigError: if the model has no surface.
    """
    surface = surface_of(model)
    points, triangles = model.points[surface.nodes], surface.triangles
    edges = np.unique(np.sort(directed_edges(triangles)[0], axis=1), axis=0)
    things = {"_surface": Thing(points, triangles, PART_COLOUR, edges=edges)}
    for k, (name, interface) in enumerate(model.interfaces.items()):
        on = np.isin(surface.nodes, interface.nodes)
        patch = triangles[on[triangles].all(axis=1)]
        colour = MARK_COLOURS[k % len(MARK_COLOURS)]
        things[name] = Thing(points, patch, colour, edges=NO_LINES)
    return things


def surface_of(thing: Any) -> Any:
    """The surface of a body or a model."""
    if thing.surface is None:
        raise ConfigError(
            f"{getattr(thing, 'name', 'the model')} has no surface to draw.",
            hint="Take it from rom.fe.model, which gives one; matrices alone have none.",
        )
    return thing.surface


def in_sight(model: FEModel, name: str, camera: Camera) -> bool:
    """Whether some triangle of an interface is turned towards the eye, as far as the mesh tells."""
    things = meshed(model)
    X, whole = np.asarray(things["_surface"].points), np.asarray(things["_surface"].cells)
    around, _ = directed_edges(whole)
    volume = np.einsum("ti,ti->", X[whole[:, 0]], np.cross(X[whole[:, 1]], X[whole[:, 2]])) / 6
    if len(np.unique(around, axis=0)) < len(around) or volume <= 0.0:
        return True
    a, b, c = np.moveaxis(X[np.asarray(things[name].cells)], 1, 0)
    return bool((np.cross(b - a, c - a) @ camera.toward > 0).any())
