"""Pictures of natural modes on the deformed surface."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from rom.arguments import AnyBody, typed
from rom.model import Array
from rom.view.canvas import page
from rom.view.canvas.scene import UNDEFORMED_COLOUR, sharp_edges
from rom.view.figures.things import NO_LINES, STILL_WIDTH, Scene, Thing, seen, series_page
from rom.view.scenes.meshes import surface_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

AMPLITUDE_RATIO = 0.08  # largest displacement shown, of the body's size


@typed
def mode_shapes(
    body: AnyBody,
    path: str | Path | None = None,
    *,
    n: int = 6,
    fixed: tuple[str, ...] = (),
    view: npt.ArrayLike | None = None,
    up: npt.ArrayLike | None = None,
) -> "Figure":
    """Draw the lowest elastic modes of a flexible body.

    Args:
        body: a `FlexibleBody` with a surface.
        path: picture to write, .png; None to write nothing.
        n: number of modes.
        fixed: names of the interfaces held; the body is free when there are none.
        view: (3,) direction from the body to the eye [1]; None: mainly along its shortest extent.
        up: (3,) upright direction [1]; None: across its longest extent.

    Raises:
        ConfigError: if the body has no surface, or pictures cannot be made here.
        InterfaceError: if an interface is unknown.
    """
    path = page.wanted(path)
    surface_of(body)
    body = body.in_units("SI")
    omega, V = body.modes(fixed=fixed)
    elastic = np.flatnonzero(omega > 0)[:n]
    shapes = {f"mode {i}: {omega[k] / (2 * np.pi):.5g} Hz": displacement(body, V[:, k])
              for i, k in enumerate(elastic, start=1)}  # fmt: skip
    support = f"{' and '.join(fixed)} held" if fixed else "free, its six rigid motions left out"
    words = (
        f"Lowest elastic modes of the reduced body {body.name} ({body.n_modes} elastic "
        f"coordinates), {support}."
    )
    title = f"Mode shapes of {body.name}"
    figure = modes_page(body.surface, shapes, title, words, what="body", view=view, up=up)
    return page.save(figure, path)


def displacement(body: Any, motion: Array) -> Array:
    """(s, 3) displacement of the surface for a motion (6 + r,): rigid coordinates first."""
    X = body.surface.points
    rigid = motion[:3] + np.cross(motion[3:6], X)
    return rigid + (body.surface.shape @ motion[6:]).reshape(-1, 3)


def modes_page(
    surface: Any, shapes: Mapping[str, Array], title: str, words: str, *, what: str, **look: Any
) -> Any:
    """A page of modes on a deformed surface, all seen from the same place.

    Args:
        surface: of the body.
        shapes: {name of a mode: (s, 3) displacements of the surface}.
        title: heading.
        words: caption, to which the meaning of displacements and grey lines is added.
        what: that whose size displacements are compared with.
        look: from where it is seen, as a `Scene` wants it.
    """
    X, size = surface.points, np.ptp(surface.points, axis=0).max()
    lengths = np.array([np.linalg.norm(u, axis=1) for u in shapes.values()])
    largest = lengths.max(axis=1, keepdims=True)
    moved = X + AMPLITUDE_RATIO * size * np.array([*shapes.values()]) / largest[..., None]
    still = Thing(X, sharp_edges(X, surface.triangles), UNDEFORMED_COLOUR, width=1.0)
    body = Thing(moved, surface.triangles, values=lengths / largest, edges=NO_LINES)
    label = "displacement / largest displacement of the mode"
    scene = Scene(title, {"_still": still, "body": body}, label, limits=(0.0, 1.0), **look)
    caption = (
        f"{words} The largest displacement is drawn as {100 * AMPLITUDE_RATIO:g} % of the size of "
        f"the {what}; grey lines show the undeformed edges."
    )
    view = seen(scene, STILL_WIDTH)
    with page.styled():
        return series_page(view, list(shapes), caption)
