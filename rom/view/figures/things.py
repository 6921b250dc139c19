"""Things in space beside curves, and films of them: bodies, blocks, rods, meshes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from rom.arguments import one_each, typed
from rom.errors import ConfigError
from rom.model import Array, Index
from rom.view.canvas import page
from rom.view.canvas.films import Film, finished, wanted
from rom.view.canvas.offscreen import OVERSAMPLING, Image, render
from rom.view.canvas.scales import clock_texts, round_length, written
from rom.view.canvas.scene import HEIGHTS, TEXT_COLOUR, Actor, Camera, aimed, sharp_edges
from rom.view.canvas.solids import Mesh, extruded, joined

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# of things without one
COLOURS = ("#9aa5b1", "#2f7f9f", "#d1495b", "#edae49", "#66a182", "#8d6a9f", "#c3c9d0", "#5c636e")
EDGE_COLOUR = "#3a414b"
FILM_WIDTH, CLOCK_HEIGHT = 900, 40  # of a film, and of the strip with the time [pixel]
LEAST_COLOURED = 40  # of what shows values, the longer side, or its colours are not read [pixel]
ROW_HEIGHT = 32  # of names [pixel]
PAGE_TOP, STILL_WIDTH = 80, 740  # of a page with a heading; of one of several pictures [pixel]
NO_LINES = np.zeros((0, 2), dtype=int)
AXIS_COLOURS = ("#c0392b", "#3a8f4d", "#2f6fb0")  # of x, y and z
TRIAD_SIZE, BAR_SIZE = 96, 130  # of the square of the axes, and of the longest bar [pixel]
STRIP_HEIGHT = 100  # of the strip that holds both [pixel]
HIDDEN_LENGTH = 0.12  # of an axis towards the eye, which is a dot


@typed
@dataclass(frozen=True, slots=True)
class Thing:
    """Something to be seen.

    Attributes:
        points: (n, 3) places, or (f, n, 3) in f pictures of a film [m].
        cells: (m, 3) triangles, (m, 2) lines or (m, 1) dots.
        colour: as "#9aa5b1"; empty for the next one of the house.
        values: (n,), or (f, n), what its colours show, in units of the label of the scene; None for
            one colour.
        opacity: 0 to 1.
        width: of lines or dots [pixel].
        edges: (k, 2) lines between its points, drawn on it; None for its sharp edges.
    """

    points: npt.ArrayLike
    cells: npt.ArrayLike
    colour: str = ""
    values: npt.ArrayLike | None = None
    opacity: float = 1.0
    width: float = 3.0
    edges: npt.ArrayLike | None = None


@typed
@dataclass(frozen=True, slots=True)
class Scene:
    """Things in space, seen from one place; stands among the diagrams of `panels`, too.

    Attributes:
        title: what is seen.
        things: {name: thing, or its points (n, 3) and triangles (m, 3)}; without a square in the
            legend if the name starts with "_" or its colours show values.
        label: what the values of things are, with their unit.
        view: (3,) direction from the things to the eye [1]; None: mainly along the shortest extent.
        up: (3,) upright direction [1]; None: across the longest extent.
        limits: (2,) values at the ends of the colours, in units of the label; None for the largest.

    Example:
        >>> scene = rom.view.Scene("A block", {"steel": rom.view.box((0.1, 0.2, 0.1))})
        >>> list(scene.things)
        ['steel']
    """

    title: str
    things: Mapping[str, Thing | Mesh]
    label: str = ""
    view: npt.ArrayLike | None = None
    up: npt.ArrayLike | None = None
    limits: tuple[float, float] | None = None


@typed
def plates(
    outlines: Sequence[Sequence[npt.ArrayLike]],
    width: float,
    *,
    values: npt.ArrayLike | None = None,
    colour: str = "#d9d2c3",
) -> Thing:
    """Stones of a wall, or other plates upright in the plane of x and y, as they move.

    Args:
        outlines: of B plates in f pictures, (k, 2) corners each, counter-clockwise and in sight of
            their mean [m].
        width: along z, half of it on either side [m].
        values: (B,) what their colours show; None for one colour.
        colour: of all of them.

    Raises:
        ConfigError: if an outline is none, or there is not one value per plate.
    """
    frames = [[_plate(outline, width) for outline in still] for still in outlines]
    counts = [len(points) for points, _ in frames[0]] if frames else []
    if not counts or any([len(p) for p, _ in still] != counts for still in frames):
        raise ConfigError("at least one plate is needed, with as many corners in each picture.")
    of_points = None
    if values is not None:
        per_plate = np.atleast_1d(np.asarray(values, dtype=float))
        one_each("values", per_plate.shape, "plates", (len(counts),))
        of_points = np.repeat(per_plate, counts)
    points = np.stack([joined(still)[0] for still in frames])
    return Thing(points, joined(frames[0])[1], colour, values=of_points)


def _plate(outline: npt.ArrayLike, width: float) -> Mesh:
    corners = np.asarray(outline, dtype=float)
    middle = corners.mean(axis=0)
    points, triangles = extruded(corners - middle, width)
    return points + np.append(middle, 0.0), triangles


@typed
def film(
    times: npt.ArrayLike,
    scene: Scene,
    path: str | Path | None = None,
    *,
    seconds: float = 4.0,
    caption: str = "",
) -> Film:
    """Film of things whose places are known.

    Args:
        times: (f,) of the pictures [s].
        scene: things with places in f pictures, and others that stay.
        path: film to write, .gif or .mp4; None to write nothing.
        seconds: how long the film lasts [s].
        caption: what a stranger has to know.

    Raises:
        ConfigError: if lengths differ, or pictures cannot be made here.
        ResourceError: for .mp4 without ffmpeg.
    """
    path, t = wanted(path), np.asarray(times, dtype=float)
    view = seen(scene, FILM_WIDTH)
    frames = max(len(actor.points) for actor in view.actors)
    one_each("times", t.shape, f"pictures of {scene.title!r}", (frames,))
    images = view.drawn(oversampling=1)
    top, height = CLOCK_HEIGHT, images.shape[1]
    foot = top + height + below_height(scene, FILM_WIDTH)
    with page.styled():
        text, below = page.caption(caption, FILM_WIDTH - 40)
        figure = page.sheet(FILM_WIDTH, foot + below + 20)
        page.words(figure, scene.title, FILM_WIDTH - 20, 8, ha="right")
        below_view(figure, view, (0, FILM_WIDTH, top + height))
        page.words(figure, text, 20, foot + 5, size=page.SMALL_SIZE)
        pages = np.repeat(page.pixels(figure)[None], frames, axis=0)
        clocks = page.strips(clock_texts(t), FILM_WIDTH // 4, CLOCK_HEIGHT)
    pages[:, top : top + height] = images
    pages[:, :top, : FILM_WIDTH // 4] = clocks
    return finished(pages, seconds / frames, path)


def draw_scene(figure: "Figure", axes: "Axes", scene: Scene, among: Sequence[Scene] = ()) -> None:
    """Draw the first picture of a scene, among others, into axes; what stands below it, too."""
    wide, tall = figure.get_size_inches() * page.DPI
    place = axes.get_position()
    left, right, top = place.x0 * wide, place.x1 * wide, (1 - place.y1) * tall
    width = round(right - left)
    height = max(2, round(place.height * tall) - below_height(scene, width))
    highest = height / width
    view = seen(scene, width, (min(HEIGHTS[0], highest), highest), frames=slice(1), among=among)
    image = view.drawn()[0]
    axes.set_title(scene.title, size=page.BODY_SIZE, loc="left")
    axes.set_axis_off()
    axes.imshow(image, extent=(0, width, 0, len(image)), aspect="auto", interpolation="nearest")
    axes.set_ylim(len(image) - place.height * tall, len(image))
    below_view(figure, view, (left, right, top + len(image)))


@dataclass(frozen=True, slots=True)
class View:
    """A scene as it is seen: what is drawn, from where, and the values at the ends of colours."""

    scene: Scene
    actors: list[Actor]
    camera: Camera
    limits: tuple[float, float]

    @property
    def coloured(self) -> bool:
        """Whether colours show values."""
        return any(actor.values is not None for actor in self.actors)

    def drawn(self, oversampling: int = OVERSAMPLING) -> Image:
        """(f, height, width, 3) its pictures; see `render`."""
        return render(self.actors, self.camera, limits=self.limits, oversampling=oversampling)


def seen(
    scene: Scene,
    width: int,
    heights: tuple[float, float] = HEIGHTS,
    *,
    frames: slice = slice(None),
    among: Sequence[Scene] = (),
) -> View:
    """A scene on a picture of that width [pixel]; plain if too little of it shows values.

    Scenes ``among`` others that show the same things from the same side have one scale.
    """
    alike = [one for one in among if one is not scene and _side(one) == _side(scene)]
    actors, others = (
        [some(actor, frames) for one in scenes for actor in actors_of(one)]
        for scenes in ((scene,), alike)
    )
    whole = [*actors, *others]
    camera = aimed(_seen(whole), width, view=scene.view, up=scene.up, heights=heights)
    limits = scene.limits or _limits(whole)
    coloured = [actor for actor in actors if actor.values is not None]
    if coloured:
        sides = camera.metre * np.ptp(_seen(coloured, slice(1)) @ camera.axes[:, :2], axis=0)
        if sides.max() < LEAST_COLOURED:
            actors = [replace(actor, values=None) for actor in actors]
    return View(scene, actors, camera, limits)


def _side(scene: Scene) -> tuple[object, ...]:
    """What is seen from where; scenes in which it is the same are compared."""
    return [*scene.things], scene.label, *(np.asarray(x).tolist() for x in (scene.view, scene.up))


def below_height(scene: Scene, width: int) -> int:
    """Of what stands below a picture of that width [pixel]."""
    rows = page.packed(_legend(scene), width)
    return STRIP_HEIGHT + ROW_HEIGHT * (1 + max((row for row, _ in rows), default=-1))


def actors_of(scene: Scene) -> list[Actor]:
    """What is drawn: each thing, and its edges."""
    drawn = [thing_actors(name, scene.things[name], c) for name, c in _colours(scene).items()]
    if not drawn:
        raise ConfigError(f"there is nothing to draw in {scene.title!r}; give it a thing.")
    return [actor for several in drawn for actor in several]


def thing_actors(name: str, thing: Thing | Mesh, colour: str) -> list[Actor]:
    """A thing and its edges."""
    thing = thing if isinstance(thing, Thing) else Thing(*thing)
    points, cells = np.asarray(thing.points, dtype=float), np.asarray(thing.cells)
    points = points[None] if points.ndim == 2 else points
    spatial = points.ndim == 3 and points.shape[2] == 3
    _require(spatial, name, f"points must be (n, 3) or (f, n, 3), got {points.shape}")
    n = points.shape[1]
    fit = cells.ndim == 2 and 1 <= cells.shape[1] <= 3 and _between(cells, n)
    what = f"cells must be (m, 1), (m, 2) or (m, 3) from 0 to {n - 1}"
    _require(fit, name, f"{what}, got {cells.dtype} {cells.shape}")
    values = None if thing.values is None else np.atleast_2d(np.asarray(thing.values, dtype=float))
    if values is not None:
        each = values.shape in ((1, n), points.shape[:2])
        _require(each, name, f"has {values.shape} values, needed are {points.shape[:2]}")
        values = np.broadcast_to(values, points.shape[:2])
    body = Actor(points, cells, values, colour, thing.width, thing.opacity)
    return [body, *_edges(name, thing, points, cells)]


def some(actor: Actor, frames: slice) -> Actor:
    """An actor in some of its pictures."""
    values = None if actor.values is None else actor.values[frames]
    return replace(actor, points=actor.points[frames], values=values)


def as_thing(actor: Actor, frames: slice = slice(None)) -> Thing:
    """An actor as a thing without edges, or some of its pictures."""
    a = some(actor, frames)
    return Thing(a.points, a.cells, a.colour, a.values, a.opacity, a.width, NO_LINES)


def _edges(name: str, thing: Thing, points: Array, cells: Index) -> list[Actor]:
    if cells.shape[1] < 3:
        return []
    if thing.edges is None:
        return [Actor(points, sharp_edges(points[0], cells), colour=EDGE_COLOUR)]
    pairs = np.asarray(thing.edges).reshape(-1, 2)
    n = points.shape[1]
    _require(_between(pairs, n), name, f"edges must be pairs from 0 to {n - 1}")
    return [Actor(points, pairs, colour="#6b7480", width=0.6)] if len(pairs) else []


def _require(holds: bool, name: str, what: str) -> None:
    if not holds:
        raise ConfigError(f"{name!r}: {what}.")


def _between(numbers: Index, n: int) -> bool:
    whole = np.issubdtype(numbers.dtype, np.integer) or not numbers.size
    return bool(whole and (numbers >= 0).all() and (numbers < n).all())


def _colours(scene: Scene) -> dict[str, str]:
    """Of each thing: its own, or the next one of the house."""
    chosen: dict[str, str] = {}
    for name, thing in scene.things.items():
        taken = sum(colour in COLOURS for colour in chosen.values())
        chosen[name] = getattr(thing, "colour", "") or COLOURS[taken % len(COLOURS)]
    return chosen


def _legend(scene: Scene) -> list[str]:
    plain = (name for name, thing in scene.things.items() if getattr(thing, "values", None) is None)
    return [name for name in plain if not name.startswith("_")]


def _limits(actors: Sequence[Actor]) -> tuple[float, float]:
    values = [actor.values for actor in actors if actor.values is not None]
    low = min((float(v.min()) for v in values), default=0.0)
    low, high = min(0.0, low), max((float(v.max()) for v in values), default=1.0)
    return low, high if high > low else low + 1.0


def _seen(actors: Sequence[Actor], frames: slice = slice(None)) -> Array:
    """(n, 3) points of cells: others may belong to what is left out."""
    points = [actor.points[frames, np.unique(actor.cells)].reshape(-1, 3) for actor in actors]
    return np.concatenate(points)


def below_view(figure: "Figure", view: View, strip: tuple[float, float, float]) -> None:
    """Axes, colours and a length, and names below; the strip is its left, right and top."""
    (left, right, top), scene = strip, view.scene
    corner(figure, view.camera, left, right, top)
    if view.coloured:
        wide = min(500.0, right - left - TRIAD_SIZE - BAR_SIZE - 60)
        middle = (left + TRIAD_SIZE + right - BAR_SIZE) / 2
        page.colour_bar(figure, view.limits, scene.label, (middle - wide / 2, top + 38, wide, 16))
    colours, names = _colours(scene), _legend(scene)
    for name, (row, at) in zip(names, page.packed(names, right - left), strict=True):
        at, level = left + at, top + STRIP_HEIGHT + ROW_HEIGHT * row
        page.words(figure, "\u25a0", at, level - 3, color=colours[name], size=page.TITLE_SIZE)
        page.words(figure, name, at + 26, level, size=page.SMALL_SIZE)


def corner(figure: "Figure", camera: Camera, left: float, right: float, top: float) -> None:
    """Axes of the world at the left end of a strip, a round length at its right end [pixel]."""
    triad(page.area(figure, left, top, TRIAD_SIZE, TRIAD_SIZE), camera)
    length, wide = scale(camera)
    x = right - (BAR_SIZE + wide) / 2
    bar = page.area(figure, x, top + 52, wide, 10)
    bar.set_axis_off()
    bar.plot([0, 0, 0, 1, 1, 1], [0, 1, 0.5, 0.5, 1, 0], color=TEXT_COLOUR, lw=1.4, clip_on=False)
    bar.set(xlim=(0, 1), ylim=(0, 1))
    words, middle = written(length, "m"), right - BAR_SIZE / 2
    page.words(figure, words, middle, top + 24, size=page.SMALL_SIZE, ha="center")


def scale(camera: Camera) -> tuple[float, float]:
    """A round length [m] and how many pixels of the picture it takes."""
    length = round_length(BAR_SIZE / camera.metre)
    return length, length * camera.metre


def triad(axes: "Axes", camera: Camera) -> None:
    """The axes of the world as the camera sees them, the nearest one last."""
    axes.set_axis_off()
    axes.set(xlim=(-1.45, 1.45), ylim=(-1.45, 1.45))
    seen = camera.axes
    for k in np.argsort(seen[:, 2]):
        x, y = seen[k, :2]
        colour, long = AXIS_COLOURS[k], float(np.hypot(x, y))
        if long > HIDDEN_LENGTH:
            arrow = {"arrowstyle": "-|>", "color": colour, "lw": 1.6, "mutation_scale": 8}
            arrow |= {"shrinkA": 0, "shrinkB": 0}
            axes.annotate("", (x, y), (0, 0), arrowprops=arrow)
            x, y = x * (1 + 0.26 / long), y * (1 + 0.26 / long)
        else:  # it points at the reader, or away from him
            axes.plot(0, 0, "o", color=colour, ms=5)
            x, y = -0.3, -0.3
        axes.text(x, y, "xyz"[k], color=colour, size=page.SMALL_SIZE, ha="center", va="center")


def scene_page(view: View, caption: str) -> "Figure":
    """A page with the heading of a scene, its picture and what stands below it."""
    width, height = view.camera.size
    foot = PAGE_TOP + height + below_height(view.scene, width)
    figure = page.titled(width, foot + 20, view.scene.title, caption)
    page.place(figure, view.drawn()[0], 0, PAGE_TOP)
    below_view(figure, view, (20, width - 20, PAGE_TOP + height))
    return figure


def series_page(view: View, names: Sequence[str], caption: str) -> "Figure":
    """A page of the pictures of a scene, two beside each other, each with its name."""
    images, title = view.drawn(), view.scene.title
    columns = min(2, len(images))
    width, height = columns * (STILL_WIDTH + 20) + 20, images.shape[1] + 50
    head = PAGE_TOP if title else 20
    foot = head + -(-len(images) // columns) * height
    figure = page.titled(width, foot + STRIP_HEIGHT + 10, title, caption)
    for k, (image, name) in enumerate(zip(images, names, strict=True)):
        left, top = 20 + (k % columns) * (STILL_WIDTH + 20), head + (k // columns) * height
        page.words(figure, name, left + 10, top)
        page.place(figure, image, left, top + 35)
    below_view(figure, view, (15, width - 15, foot))
    return figure
