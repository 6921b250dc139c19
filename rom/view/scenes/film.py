"""Films and series of instants of a moving mechanism."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from rom import rotation
from rom.arguments import AnyMechanism, AnySolution, typed
from rom.errors import ConfigError
from rom.model import Array
from rom.names import named, offered
from rom.view.canvas import page
from rom.view.canvas.gif import write_gif
from rom.view.canvas.offscreen import Image, render
from rom.view.canvas.scene import Actor, Camera, aimed, sharp_edges
from rom.view.canvas.solids import Mesh, cylinder

FILM_WIDTH, STILL_WIDTH = 900, 740  # of a film and of one instant in a series [pixel]
CLOCK_HEIGHT = 40  # of the strip with the time [pixel]
METAL_COLOURS = ("#9aa5b1", "#c3c9d0", "#7d8791")  # rigid bodies
SCALES = ((1.0, "m"), (1e3, "mm"), (1e6, "um"), (1e9, "nm"))  # per metre


@typed
def animate(  # noqa: PLR0913  keywords of one picture, all with defaults
    mechanism: AnyMechanism,
    solution: AnySolution,
    path: str | Path,
    *,
    shapes: dict[str, Mesh] | None = None,
    frames: int = 60,
    seconds: float = 4.0,
    magnify: float = 1.0,
    view: npt.ArrayLike | None = None,
    up: npt.ArrayLike | None = None,
) -> Path:
    """Film of the mechanism, flexible bodies deformed and coloured by their deformation.

    Args:
        mechanism: the mechanism.
        solution: its motion.
        path: film to write, .gif.
        shapes: {body: (points (n, 3), triangles (t, 3))} in the frame of a rigid body; without one
            it is drawn as bars between its markers.
        frames: number of pictures, evenly over the time of the solution.
        seconds: how long the film lasts [s].
        magnify: deformations are drawn so many times larger than they are [1].
        view: (3,) direction from the things to the eye [1]; None: mainly along the shortest extent.
        up: (3,) upright direction [1]; None: across the longest extent.

    Raises:
        ConfigError: for an unknown body, or if pictures cannot be made here.
    """
    path = page.checked(path, ".gif")
    steps = np.linspace(0, solution.t.size - 1, min(frames, solution.t.size)).round().astype(int)
    stage = _stage(mechanism, solution, steps, shapes or {}, magnify)
    camera = stage.camera(FILM_WIDTH, view, up)
    # many small pictures: as large as they are, the smooth edges that the driver has will do
    images = render(stage.actors, camera, limits=stage.limits, oversampling=1)
    with page.styled():
        blank = _film_sheet(stage, images.shape[1], magnify)
        clocks = np.stack([_clock(text) for text in clock_texts(solution.t[steps])])
    pages = np.repeat(blank[None], len(images), axis=0)
    pages[:, CLOCK_HEIGHT : CLOCK_HEIGHT + images.shape[1]] = images
    pages[:, :CLOCK_HEIGHT] = clocks
    write_gif(path, pages, seconds / len(images))
    return path


@typed
def instants(  # noqa: PLR0913  keywords of one picture, all with defaults
    mechanism: AnyMechanism,
    solution: AnySolution,
    path: str | Path | None = None,
    *,
    times: npt.ArrayLike,
    shapes: dict[str, Mesh] | None = None,
    magnify: float = 1.0,
    view: npt.ArrayLike | None = None,
    up: npt.ArrayLike | None = None,
) -> Path | page.Picture:
    """The mechanism at some instants (n,) [s], side by side; otherwise as `animate`.

    The path ends in .png; without one the `Picture` itself is given back.

    Raises:
        ConfigError: for an unknown body, or if pictures cannot be made here.
    """
    path = page.wanted(path)
    wanted = np.asarray(times, dtype=float).ravel()
    steps = np.array([int(np.argmin(np.abs(solution.t - t))) for t in wanted])
    stage = _stage(mechanism, solution, steps, shapes or {}, magnify)
    images = render(stage.actors, stage.camera(STILL_WIDTH, view, up), limits=stage.limits)
    with page.styled():
        return page.save(_series_sheet(stage, images, solution.t[steps], magnify), path)


@dataclass(frozen=True, slots=True)
class Stage:
    """What is seen, and what its colours mean.

    Attributes:
        actors: bodies and their edges.
        limits: (2,) deformation at the ends of the colours, in ``unit``.
        unit: unit of the colours.
        name: names of the flexible bodies.
    """

    actors: list[Actor]
    limits: tuple[float, float]
    unit: str
    name: str

    def camera(self, width: int, view: Any, up: Any) -> Camera:
        """A camera that sees all bodies all the time."""
        seen = np.concatenate([actor.points.reshape(-1, 3) for actor in self.actors])
        return aimed(seen, width, view=view, up=up)


def _stage(
    mechanism: Any, solution: Any, steps: Any, shapes: dict[str, Mesh], magnify: float
) -> Stage:
    unknown = set(shapes) - set(mechanism.parts)
    if unknown:
        raise ConfigError(
            f"shapes: no body {named(sorted(unknown))}; there are {offered(mechanism.parts)}."
        )
    actors: list[Actor] = []
    flexible: dict[str, int] = {}
    shades = shades_of(mechanism)
    for name, part in mechanism.parts.items():
        pose = _poses(solution, name, steps)
        surface = getattr(part.flexible, "surface", None)
        if surface is not None:
            flexible[name] = len(actors)
            u = _deformation(surface, solution.elastic(name)[steps])
            X, triangles, size = surface.points + magnify * u, surface.triangles, u
        else:
            X, triangles = shapes[name] if name in shapes else bars(part)
            X, size = np.asarray(X, dtype=float)[None], None
        points = placed(X, pose)
        values = None if size is None else np.linalg.norm(size, axis=2)
        actors.append(Actor(points, triangles, values, METAL_COLOURS[shades[name]]))
        edges = sharp_edges(X[0], triangles)
        actors.append(Actor(points, edges, colour="#3a414b", width=1.0))
    return _scaled(actors, flexible)


def shades_of(mechanism: Any) -> dict[str, int]:
    """Number of the grey of each body; all frames of a non-linear body have one."""
    whole = {part.name: name for name, all_ in mechanism.nonlinear.items() for part in all_.parts}
    things = dict.fromkeys(
        whole.get(name, name) for name, part in mechanism.parts.items() if part.flexible is None
    )
    number = {name: k for k, name in enumerate(things)}
    return {
        name: number.get(whole.get(name, name), 0) % len(METAL_COLOURS) for name in mechanism.parts
    }


def _scaled(actors: list[Actor], flexible: dict[str, int]) -> Stage:
    """Colours in a unit in which the largest deformation is between 1 and 1000."""
    if not flexible:
        return Stage(together(actors), (0.0, 1.0), "m", "")
    sizes = {k: v for k in flexible.values() if (v := actors[k].values) is not None}
    largest = max(float(v.max()) for v in sizes.values())
    factor, unit = next((s for s in SCALES if largest * s[0] >= 1.0), SCALES[-1])
    for k, v in sizes.items():
        scaled: Array = v * factor
        actors[k] = Actor(actors[k].points, actors[k].cells, scaled, actors[k].colour)
    limits = 0.0, max(largest * factor, 1e-12)
    return Stage(together(actors), limits, unit, " and ".join(flexible))


def together(actors: list[Actor]) -> list[Actor]:
    """The same picture with one actor for all things of one plain colour: far fewer to draw."""
    kept = [actor for actor in actors if actor.values is not None]
    plain: dict[Any, list[Actor]] = {}
    for actor in actors:
        if actor.values is None:
            look = actor.colour, actor.width, actor.opacity, actor.cells.shape[1]
            plain.setdefault(look, []).append(actor)
    for (colour, width, opacity, _), alike in plain.items():
        first = np.cumsum([0, *(actor.points.shape[1] for actor in alike)])
        cells = np.vstack([a.cells + n for a, n in zip(alike, first[:-1], strict=True)])
        points = np.concatenate([actor.points for actor in alike], axis=1)
        kept.append(Actor(points, cells, None, colour, width, opacity))
    return kept


def _poses(solution: Any, name: str, steps: Any) -> tuple[Array, Array]:
    """(f, 3) origins and (f, 3, 3) orientations of a body frame."""
    A = np.array([rotation.matrix(p) for p in solution.orientation(name)[steps]])
    return solution.position(name)[steps], A


def placed(X: Array, pose: tuple[Array, Array]) -> Array:
    """(f, n, 3) world positions of body points (1 or f, n, 3)."""
    r, A = pose
    return r[:, None] + np.einsum("fab,fnb->fna", A, np.broadcast_to(X, (len(r), *X.shape[1:])))


def _deformation(surface: Any, q: Array) -> Array:
    """(f, s, 3) elastic displacement of the surface in the body frame [m]."""
    return (q @ surface.shape.T).reshape(len(q), -1, 3)


def bars(part: Any) -> Mesh:
    """Round bars from the mass centre to the markers, or a small cube-like knot without any."""
    ends = [np.asarray(p) for p in part.points.values() if np.linalg.norm(p) > 0]
    reach = max((float(np.linalg.norm(p)) for p in ends), default=0.0)
    if not ends:
        reach = float(np.sqrt(np.trace(part.second) / part.mass)) or 1e-2
        ends = [np.array([reach, 0, 0]), np.array([-reach, 0, 0])]
    points, triangles, count = [], [], 0
    for end in ends:
        X, T = cylinder(np.zeros(3), end, 0.15 * reach, sides=24)
        points.append(X)
        triangles.append(T + count)
        count += len(X)
    return np.vstack(points), np.vstack(triangles)


def _words(stage: Stage, magnify: float) -> str:
    if not stage.name:
        return "Motion of the mechanism in true size."
    how = "true size" if magnify == 1.0 else f"{magnify:g} times larger"
    return (
        f"Motion of the mechanism, deformation of {stage.name} drawn {how}. Colours: "
        f"displacement relative to the floating frame, in {stage.unit}; grey bodies are rigid."
    )


def clock_texts(times: Array) -> list[str]:
    """The time in words, in milliseconds if the motion lasts less than ten seconds."""
    if np.ptp(times) >= 10.0:
        return [f"t = {t:.2f} s" for t in times]
    return [f"t = {t * 1e3:.3f} ms" for t in times]


def _clock(text: str) -> Image:
    """The strip above a picture of the film, with the time."""
    strip = page.sheet(FILM_WIDTH, CLOCK_HEIGHT)
    page.words(strip, text, 20, 8)
    return page.pixels(strip)


def _film_sheet(stage: Stage, height: int, magnify: float) -> Image:
    """What stays around the pictures of a film."""
    text, below = page.caption(_words(stage, magnify), FILM_WIDTH - 40)
    bar = 90 if stage.name else 10
    top = CLOCK_HEIGHT + height
    figure = page.sheet(FILM_WIDTH, top + bar + below + 20)
    _bar(figure, stage, FILM_WIDTH, top)
    page.words(figure, text, 20, top + bar, size=page.SMALL_SIZE)
    return page.pixels(figure)


def _series_sheet(stage: Stage, images: Image, times: Array, magnify: float) -> Any:
    columns = min(2, len(images))
    width, height = columns * (STILL_WIDTH + 20) + 20, images.shape[1] + 50
    rows = -(-len(images) // columns)
    text, below = page.caption(_words(stage, magnify), width - 60)
    bar = 90 if stage.name else 10
    figure = page.sheet(width, 20 + rows * height + bar + below + 30)
    for k, (image, t) in enumerate(zip(images, times, strict=True)):
        left, top = 20 + (k % columns) * (STILL_WIDTH + 20), 20 + (k // columns) * height
        page.words(figure, f"t = {t * 1e3:.4g} ms", left + 10, top)
        page.place(figure, image, left, top + 35)
    _bar(figure, stage, width, 20 + rows * height)
    page.words(figure, text, 30, 30 + rows * height + bar, size=page.SMALL_SIZE)
    return figure


def _bar(figure: Any, stage: Stage, width: int, top: int) -> None:
    if stage.name:
        label = f"deformation of {stage.name} [{stage.unit}]"
        page.colour_bar(figure, stage.limits, label, (width / 2 - 250, top + 30, 500, 16))
