"""A mechanism as its bodies are placed; films and series of instants of how it moves."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

import rom.mbs
from rom.arguments import AnyMechanism, AnySolution, typed
from rom.model import Array, Index
from rom.view.canvas import page
from rom.view.canvas.films import Film, wanted
from rom.view.canvas.scales import clock_texts, prefixed
from rom.view.canvas.scene import Actor, sharp_edges
from rom.view.canvas.solids import Mesh, joined
from rom.view.canvas.symbols import polyline
from rom.view.figures.things import (
    COLOURS,
    FILM_WIDTH,
    NO_LINES,
    STILL_WIDTH,
    Scene,
    Thing,
    as_thing,
    film,
    scene_page,
    seen,
    series_page,
)
from rom.view.scenes.connections import connections
from rom.view.scenes.places import Places, at_start, different, evenly, moving, placed
from rom.view.scenes.rigid import BOX_OPACITY, check_bodies, form_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Direction = npt.ArrayLike | None
N_INSTANTS = 4  # that are chosen where none are asked for
METAL_COLOURS = ("#9aa5b1", "#c3c9d0", "#7d8791")  # rigid bodies
EDGE_COLOUR, TRACE_COLOUR = "#3a414b", "#d1495b"
TRACE_POINTS = 1000
POSED_AMONG = 60  # instants of a motion from which the colours of one of them follow
START_WIDTH = 1200  # of the picture of a start [pixel]
MAX_LEGEND_BODIES = 16  # bodies in the legend


@typed
def animate(  # noqa: PLR0913  keywords of one picture, all with defaults
    mechanism: AnyMechanism,
    solution: AnySolution,
    path: str | Path | None = None,
    *,
    shapes: dict[str, Mesh] | None = None,
    frames: int = 60,
    seconds: float = 4.0,
    magnify: float = 1.0,
    symbols: bool = True,
    traces: tuple[str, ...] = (),
    view: npt.ArrayLike | None = None,
    up: npt.ArrayLike | None = None,
    title: str = "Motion of the mechanism",
) -> Film:
    """Film of the mechanism, flexible bodies deformed and coloured by their deformation.

    How much of it is drawn is shown on stderr, where that is a terminal.

    Args:
        mechanism: the mechanism.
        solution: its motion.
        path: film to write, .gif, or .mp4 by ffmpeg; None to write nothing.
        shapes: {body: (points (n, 3), triangles (t, 3))} in the frame of a rigid body; without one
            it is drawn as tubes from its mass centre to its markers, in the box of its inertia.
        frames: number of pictures, evenly over the time of the solution.
        seconds: how long the film lasts [s].
        magnify: deformations are drawn so many times larger than they are [1].
        symbols: draw joints, springs, planes of contact and the ground, too.
        traces: bodies whose origin leaves a line behind, all of its way.
        view: (3,) direction from the things to the eye [1]; None: mainly along the shortest extent.
        up: (3,) upright direction [1]; None: against gravity, or across the longest extent without.
        title: what is seen.

    Raises:
        ConfigError: for an unknown body, or if pictures cannot be made here.
        ResourceError: for .mp4 without ffmpeg.
    """
    path = wanted(path)
    steps = evenly(solution.t.size, min(frames, solution.t.size))
    look = Look(shapes or {}, magnify, symbols, traces, upright(mechanism, up))
    stage = _stage(mechanism, solution, steps, look)
    scene = stage.scene(title, view, look.up)
    words = _words(stage, magnify, coloured=seen(scene, FILM_WIDTH).coloured)
    return film(solution.t[steps], scene, path, seconds=seconds, caption=words)


@typed
@page.picture
def instants(  # noqa: PLR0913  keywords of one picture, all with defaults
    mechanism: AnyMechanism,
    solution: AnySolution,
    path: str | Path | None = None,
    *,
    times: npt.ArrayLike | None = None,
    shapes: dict[str, Mesh] | None = None,
    magnify: float = 1.0,
    symbols: bool = True,
    traces: tuple[str, ...] = (),
    view: npt.ArrayLike | None = None,
    up: npt.ArrayLike | None = None,
    caption: str = "",
) -> "Figure":
    """The mechanism at some instants (n,) [s], side by side; otherwise as `animate`.

    Without ``times`` the start and up to three more instants are drawn, at which the bodies are
    farthest from where they are in the others. The path ends in .png. What ``caption`` says of
    them stands before what is said of deformations.

    Raises:
        ConfigError: for an unknown body, or if pictures cannot be made here.
    """
    given = different(solution, N_INSTANTS) if times is None else np.asarray(times, dtype=float)
    steps = np.array([int(np.argmin(np.abs(solution.t - t))) for t in given.ravel()])
    look = Look(shapes or {}, magnify, symbols, traces, upright(mechanism, up))
    stage = _stage(mechanism, solution, steps, look)
    series = seen(stage.scene("", view, look.up), STILL_WIDTH)
    words = f"{caption} {_words(stage, magnify, coloured=series.coloured)}".lstrip()
    return series_page(series, clock_texts(solution.t[steps]), words)


@typed
def posed(  # noqa: PLR0913  keywords of one picture, all with defaults
    mechanism: AnyMechanism,
    solution: AnySolution,
    time: float,
    *,
    title: str = "",
    shapes: dict[str, Mesh] | None = None,
    magnify: float = 1.0,
    symbols: bool = True,
    traces: tuple[str, ...] = (),
    view: npt.ArrayLike | None = None,
    up: npt.ArrayLike | None = None,
) -> Scene:
    """The mechanism at an instant [s] as a `Scene`, to stand beside curves; otherwise as `animate`.

    The step nearest to the time is drawn. Colours, rails and planes are those of the whole motion.

    Raises:
        ConfigError: for an unknown body.
    """
    step = int(np.argmin(np.abs(solution.t - time)))
    steps = np.array([step, *evenly(solution.t.size, POSED_AMONG)])
    look = Look(shapes or {}, magnify, symbols, traces, upright(mechanism, up))
    stage = _stage(mechanism, solution, steps, look)
    scene = stage.scene(title, view, look.up, slice(1))
    return replace(scene, label=f"deformation [{stage.unit}]")


@dataclass(frozen=True, slots=True)
class Look:
    """How a mechanism is drawn; see `animate`."""

    shapes: dict[str, Mesh]
    magnify: float = 1.0
    symbols: bool = True
    traces: tuple[str, ...] = ()
    up: Direction = None


@dataclass(frozen=True, slots=True)
class Stage:
    """What is seen, and what its colours mean."""

    actors: list[Actor]  # bodies, their edges and the symbols between them
    limits: tuple[float, float]  # deformation at the ends of the colours, in the unit
    unit: str  # of the colours, in which the largest deformation is between 1 and 1000
    name: str  # names of the flexible bodies
    grey: str  # what has no colours

    def scene(
        self, title: str, view: Direction, up: Direction, frames: slice = slice(None)
    ) -> Scene:
        """Some of its pictures, in the colours of all of them."""
        things = {f"_{k}": as_thing(actor, frames) for k, actor in enumerate(self.actors)}
        label = f"deformation of {self.name} [{self.unit}]"
        return Scene(title, things, label, view, up, self.limits)


def _stage(
    mechanism: "rom.mbs.Mechanism", solution: "rom.mbs.Solution", steps: Index, look: Look
) -> Stage:
    check_bodies(mechanism, "shapes", look.shapes)
    check_bodies(mechanism, "traces", look.traces)
    places = moving(mechanism, solution, steps, look.magnify)
    drawn = {name: _body(places, name, look) for name in mechanism.parts}
    sizes = {name: v for name, (surface, *_) in drawn.items() if (v := surface.values) is not None}
    largest = max((float(v.max()) for v in sizes.values()), default=0.0)
    factor, unit = prefixed(largest, "m")
    bodies = [actor for actors in drawn.values() for actor in actors[:2]]
    scaled = [a if a.values is None else replace(a, values=a.values * factor) for a in bodies]
    more = [actor for actors in drawn.values() for actor in actors[2:]]
    more += symbols_of(places, look) if look.symbols else []
    more += [_trace(solution.position(name)) for name in look.traces]
    limits = 0.0, max(largest * factor, 1e-12)
    grey = "rigid bodies and rods" if mechanism.nonlinear else "rigid bodies"
    return Stage([*together(scaled), *together(more)], limits, unit, " and ".join(sizes), grey)


def _body(places: Places, name: str, look: Look) -> list[Actor]:
    """Surface and edges of a body, and what is seen through of a rigid one."""
    form, pose = form_of(places.mechanism, name, look.shapes), places.pose(name)
    colour = METAL_COLOURS[shades_of(places.mechanism)[name]]
    X, values = form.points[None], None
    if form.surface is not None:
        q = places.elastic[name]
        u = (q @ form.surface.shape.T).reshape(len(q), -1, 3)
        X, values = X + look.magnify * u, np.linalg.norm(u, axis=2)
    points = placed(X, pose)
    edges = Actor(points, sharp_edges(X[0], form.triangles), colour=EDGE_COLOUR, width=1.0)
    actors = [Actor(points, form.triangles, values, colour, opacity=form.opacity), edges]
    if form.block is not None:
        points = placed(form.block[0][None], pose)
        actors.append(Actor(points, form.block[1], colour=colour, opacity=BOX_OPACITY))
    return actors


def _trace(way: Array) -> Actor:
    """A line through at most `TRACE_POINTS` of the places (n_t, 3) where a point has been."""
    points, pairs = polyline(way[np.unique(evenly(len(way), TRACE_POINTS))])
    return Actor(points[None], pairs, colour=TRACE_COLOUR, width=1.6)


def symbols_of(places: Places, look: Look) -> list[Actor]:
    """Symbols of joints, springs, contacts and the ground."""
    forms = {name: form_of(places.mechanism, name, look.shapes) for name in places.mechanism.parts}
    drawn = {name: form.points for name, form in forms.items()}
    surfaces = {name for name, form in forms.items() if form.surface is not None} | {*look.shapes}
    up = np.array([0.0, 0.0, 1.0]) if look.up is None else np.asarray(look.up, dtype=float)
    return connections(places, drawn, surfaces, up)


def upright(mechanism: "rom.mbs.Mechanism", up: Direction = None) -> Direction:
    """(3,) what is asked for, or against gravity; None without."""
    gravity = np.asarray(mechanism.gravity, dtype=float)
    return -gravity if up is None and gravity.any() else up


def shades_of(mechanism: "rom.mbs.Mechanism") -> dict[str, int]:
    """Number of the grey of each body; all frames of a non-linear body have one."""
    whole = {part.name: name for name, all_ in mechanism.nonlinear.items() for part in all_.parts}
    owner = {name: whole.get(name, name) for name in mechanism.parts}
    rigid = dict.fromkeys(owner[n] for n, part in mechanism.parts.items() if part.flexible is None)
    number = {name: k % len(METAL_COLOURS) for k, name in enumerate(rigid)}
    return {name: number.get(thing, 0) for name, thing in owner.items()}


def together(actors: list[Actor]) -> list[Actor]:
    """The same picture with one actor for all things of one plain colour: far fewer to draw."""
    kept = [actor for actor in actors if actor.values is not None]
    plain: dict[tuple[object, ...], list[Actor]] = {}
    for actor in actors:
        if actor.values is None:
            look = actor.colour, actor.width, actor.opacity
            plain.setdefault((*look, actor.cells.shape[1], len(actor.points)), []).append(actor)
    for alike in plain.values():
        points, cells = joined([(actor.points, actor.cells) for actor in alike])
        kept.append(replace(alike[0], points=points, cells=cells))
    return kept


def _words(stage: Stage, magnify: float, *, coloured: bool = True) -> str:
    if not stage.name:
        return "Motion of the mechanism in true size."
    how = "true size" if magnify == 1.0 else f"{magnify:g} times larger"
    words = f"Motion of the mechanism, deformation of {stage.name} drawn {how}."
    if coloured:
        words += " Colours: displacement relative to the floating frame, in "
        words += f"{stage.unit}; grey are {stage.grey}."
    return words


@typed
@page.picture
def start(
    mechanism: AnyMechanism,
    path: str | Path | None = None,
    *,
    title: str = "Mechanism at its start",
    symbols: bool = True,
    view: npt.ArrayLike | None = None,
    up: npt.ArrayLike | None = None,
) -> "Figure":
    """Draw a mechanism before it moves: flexible bodies by their surface, rigid ones as tubes.

    Args:
        mechanism: a `Mechanism`.
        path: picture to write, .png; None to write nothing.
        title: heading.
        symbols: draw joints, springs, planes of contact and the ground, too.
        view: (3,) direction from the things to the eye [1]; None: mainly along the shortest extent.
        up: (3,) upright direction [1]; None: against gravity, or across the longest extent without.

    Raises:
        ConfigError: if pictures cannot be made here.
    """
    scene = start_scene(mechanism, title, symbols=symbols, view=view, up=up)
    words = (
        f"{len(mechanism.parts)} bodies as they are placed, before joints pull them together. "
        "Flexible bodies are drawn by their surface, rigid ones as tubes from the mass centre to "
        "their markers, in a block of the same mass and inertia."
    )
    return scene_page(seen(scene, START_WIDTH), words)


def start_scene(
    mechanism: "rom.mbs.Mechanism",
    title: str,
    *,
    symbols: bool = True,
    view: Direction = None,
    up: Direction = None,
) -> Scene:
    """A mechanism as its bodies are placed; arguments as of `start`."""
    up = upright(mechanism, up)
    places = at_start(mechanism)
    things: dict[str, Thing | Mesh] = {}
    for k, part in enumerate(mechanism.parts.values()):
        form, pose = form_of(mechanism, part.name, {}), places.pose(part.name)
        name, colour = part.name if k < MAX_LEGEND_BODIES else f"_{k}", COLOURS[k % len(COLOURS)]
        points = placed(form.points[None], pose)
        things[name] = Thing(points, form.triangles, colour, opacity=form.opacity)
        if form.block is not None:
            block = placed(form.block[0][None], pose), form.block[1]
            things[f"_block {k}"] = Thing(*block, colour, None, BOX_OPACITY, 1.0, NO_LINES)
    more = together(symbols_of(places, Look({}, up=up))) if symbols else []
    things |= {f"_symbol {k}": as_thing(actor) for k, actor in enumerate(more)}
    return Scene(title, things, view=view, up=up)
