"""Figures that turn in the browser: a scene, and the still picture for those who see none."""

import hashlib
import html as escaping
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy.typing as npt

from rom.arguments import AnyBody, AnySolution, typed
from rom.body.flexible import FlexibleBody
from rom.report import html
from rom.report.scene import Scene, modes_scene, motion_scene
from rom.view.canvas.solids import Mesh

if TYPE_CHECKING:
    from rom.mbs.results.solution import Solution

NOTEBOOK_BYTES = 400_000  # of all shapes of a figure in a notebook, which keeps it
NEEDED_WORDS = "the browser needs JavaScript and WebGL 2, which are switched off or missing here."
MESSAGES = {
    True: f"This is a still picture: for one that turns and moves, {NEEDED_WORDS}",
    False: f"There is no still picture: for a figure that turns and moves, {NEEDED_WORDS}",
}
EYE_WORDS = "The bar below on the right is the scale, the arrows on the left are the axes"


@typed
def modes(body: AnyBody, still: str | Path | None = None, *, caption: str = "") -> str:
    """A figure of the modes of a body that swings and turns in the browser.

    Each support that the certificate compares has its modes, and each elastic coordinate is shown;
    colours tell the displacement, or the equivalent stress of a body reduced with ``stress=True``.

    Args:
        body: a `FlexibleBody` with a surface.
        still: picture, .png or .gif, for print and for browsers without WebGL.
        caption: what it shows; a sentence of its own if empty.

    Raises:
        ConfigError: if the body has no surface, or the picture is none.
    """
    return figure(modes_scene(body), _still(still), caption or modes_words(body.name))


@typed
def motion(
    solution: AnySolution,
    still: str | Path | None = None,
    *,
    caption: str = "",
    shapes: dict[str, Mesh] | None = None,
    magnify: float = 1.0,
    view: npt.ArrayLike | None = None,
    up: npt.ArrayLike | None = None,
) -> str:
    """A figure of a motion that plays and turns in the browser.

    Args:
        solution: a `rom.mbs.results.solution.Solution`.
        still: picture, .png or .gif, for print and for browsers without WebGL.
        caption: what it shows; a sentence of its own if empty.
        shapes: {body: (points (n, 3), triangles (t, 3))} in the frame of a rigid body; without one
            it is drawn as bars between its markers.
        magnify: deformations are drawn so many times larger than they are, at first.
        view: (3,) direction from the things to the eye; None: mainly along the shortest extent.
        up: (3,) upright direction; None: against gravity, or across the longest extent.

    Raises:
        ConfigError: for an unknown body, directions that are none, or if the picture is none.
    """
    scene = motion_scene(solution, shapes=shapes, magnify=magnify, view=view, up=up)
    return figure(scene, _still(still), caption or MOTION_WORDS)


def in_notebook(shown: "FlexibleBody | Solution") -> str:
    """The modes of a body or a motion, in a frame, on coarser surfaces than in a report."""
    if isinstance(shown, FlexibleBody):
        scene = modes_scene(shown, size=NOTEBOOK_BYTES)
    else:
        scene = motion_scene(shown, size=NOTEBOOK_BYTES)
    return html.framed(figure(scene, (), ""), scene["title"])


def modes_words(name: str) -> str:
    """What a stranger has to know of the figure of modes."""
    return (
        f"How {name} deforms in its natural modes, drawn far larger than it does; grey lines are "
        "its edges at rest. Choose a support and a mode, let it swing, turn it. Colours are the "
        "amplitude of each point; real modes swing as often a second as the list says. "
        f"{EYE_WORDS}."
    )


MOTION_WORDS = (
    "The computed motion. Deformations of flexible bodies are drawn so many times larger as the "
    "slider says; colours tell how far points are displaced relative to the moving frame of their "
    "body, or the equivalent stress of its elastic coordinates. Bodies in one colour are rigid, or "
    f"rods, drawn as bars between their markers where no shape is known. {EYE_WORDS} of the world."
)
START_WORDS = (
    "Bodies as they are placed, before joints pull them together, flexible ones by their surface, "
    f"rigid ones as bars from the mass centre to their markers. {EYE_WORDS} of the world."
)


def figure(scene: Scene, still: Sequence[str], caption: str) -> str:
    """A scene as a block of a report; in print, and where none can be drawn, the still blocks."""
    arrays: dict[str, str] = {}
    text = json.dumps(_referred(scene, arrays), separators=(",", ":"))
    text = text.replace("<", "\\u003c")  # nothing in a name may end the element
    pictured = any("<img" in block for block in still)
    data = "".join(
        f"<script type='application/octet-stream' id='{name}'>{code}</script>"
        for name, code in arrays.items()
    )
    return (
        f"<figure class='scene{' pictured' * pictured}'>"
        f"<div class='still'>{''.join(still)}</div>"
        f"<p class='message'>{escaping.escape(MESSAGES[pictured])}</p>"
        f"<figcaption>{escaping.escape(caption)}</figcaption>{data}"
        f"<script type='application/json' class='scene-data'>{text}</script></figure>"
    )


def _referred(value: Any, arrays: dict[str, str]) -> Any:
    """The scene with its arrays taken out, each under a name that follows from its content."""
    if isinstance(value, list):
        return [_referred(one, arrays) for one in value]
    if not isinstance(value, dict):
        return value
    if value.keys() == {"type", "data"}:
        name = f"array-{hashlib.sha256(value['data'].encode()).hexdigest()[:24]}"
        arrays[name] = value["data"]
        return {"type": value["type"], "ref": name}
    return {key: _referred(one, arrays) for key, one in value.items()}


def _still(path: str | Path | None) -> list[str]:
    return [] if path is None else [html.image(path, "The same as a still picture.")]
