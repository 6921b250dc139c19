"""Pictures of natural modes on the deformed surface."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from rom.arguments import AnyBody, typed
from rom.errors import ConfigError
from rom.model import Array
from rom.view.canvas import page
from rom.view.canvas.corner import corner
from rom.view.canvas.offscreen import Image, render
from rom.view.canvas.scene import UNDEFORMED_COLOUR, Actor, Camera, aimed, sharp_edges

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PANEL_WIDTH = 740  # of one mode [pixel]
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
    if body.surface is None:
        raise ConfigError(f"body {body.name!r} has no surface to draw.")
    body = body.in_units("SI")
    omega, V = body.modes(fixed=fixed)
    elastic = np.flatnonzero(omega > 0)[:n]
    shapes = [displacement(body, V[:, k]) for k in elastic]
    images, camera = drawn(body.surface, shapes, view, up)
    support = f"{' and '.join(fixed)} held" if fixed else "free, its six rigid motions left out"
    words = (
        f"Lowest elastic modes of the reduced body {body.name} ({body.n_modes} elastic "
        f"coordinates), {support}."
    )
    with page.styled():
        names = [f"mode {i + 1}: {omega[k] / (2 * np.pi):.5g} Hz" for i, k in enumerate(elastic)]
        title = f"Mode shapes of {body.name}"
        return page.save(sheet(images, camera, names, title, words, "body"), path)


def displacement(body: Any, motion: Array) -> Array:
    """(s, 3) displacement of the surface for a motion (6 + r,): rigid coordinates first."""
    X = body.surface.points
    rigid = motion[:3] + np.cross(motion[3:6], X)
    return rigid + (body.surface.shape @ motion[6:]).reshape(-1, 3)


def drawn(surface: Any, shapes: list[Array], view: Any, up: Any) -> tuple[Image, Camera]:
    """One picture per shape, all from the same place, and that place."""
    X, size = surface.points, np.ptp(surface.points, axis=0).max()
    lengths = [np.linalg.norm(u, axis=1) for u in shapes]
    moved = [
        X + AMPLITUDE_RATIO * size * u / length.max()
        for u, length in zip(shapes, lengths, strict=True)
    ]
    camera = aimed(np.stack([X, *moved]), PANEL_WIDTH, view=view, up=up)
    edges, values = sharp_edges(X, surface.triangles), [v / v.max() for v in lengths]
    still = Actor(X[None], edges, colour=UNDEFORMED_COLOUR, width=1.0)
    actors = [still, Actor(np.stack(moved), surface.triangles, np.stack(values))]
    return render(actors, camera), camera


def sheet(images: Any, camera: Camera, names: list[str], title: str, words: str, what: str) -> Any:
    """A page of modes, two beside each other.

    Args:
        images: of `drawn`.
        camera: of `drawn`.
        names: of the modes.
        title: heading.
        words: caption, to which the meaning of displacements and grey lines is added.
        what: that whose size displacements are compared with.
    """
    columns = min(2, len(images))
    width = columns * (PANEL_WIDTH + 20) + 20
    rows, height = -(-len(images) // columns), images[0].shape[0] + 50
    caption = (
        f"{words} The largest displacement is drawn as {100 * AMPLITUDE_RATIO:g} % of the size of "
        f"the {what}; grey lines show the undeformed edges."
    )
    figure = page.titled(width, 80 + rows * height + 110, title, caption)
    for k, (image, name) in enumerate(zip(images, names, strict=True)):
        left, top = 20 + (k % columns) * (PANEL_WIDTH + 20), 80 + (k // columns) * height
        page.words(figure, name, left + 10, top + 10)
        page.place(figure, image, left, top + 40)
    top = 80 + rows * height
    label = "displacement / largest displacement of the mode"
    wide = min(500, width - 320)
    page.colour_bar(figure, (0.0, 1.0), label, ((width - wide) / 2, top + 35, wide, 18))
    corner(figure, camera, 15, width - 15, top)
    return figure
