"""What is drawn and from where: actors, cameras, and the edges that show a shape."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rom.arguments import finite, shortened
from rom.errors import ConfigError
from rom.model import Array, Index

SHARP_COSINE = np.cos(np.deg2rad(35.0))  # cosine of the angle from which an edge is drawn
TEXT_COLOUR, UNDEFORMED_COLOUR = "#20242a", "#7c828c"
MARGIN_RATIO = 0.03  # of the view, left free on every side
HEIGHTS = (0.2, 0.85)  # bounds of the height of a picture, of its width


@dataclass(frozen=True, slots=True)
class Actor:
    """One thing in a picture, still or moving."""

    points: Array  # (f, n, 3) positions in f frames [m]; f = 1 for a thing that stays
    cells: Index  # (m, 3) triangles, (m, 2) lines or (m, 1) dots
    values: Array | None = None  # (f, n) what the colour map shows; None for a plain colour
    colour: str = "#9aa5b1"
    width: float = 1.0  # of lines, or size of dots, in pixels of the finished picture
    opacity: float = 1.0  # 0 to 1
    lit: bool = True  # light and shade fall on it; without, triangles have their colour exactly


@dataclass(frozen=True, slots=True)
class Camera:
    """Parallel projection."""

    focus: Array  # (3,) point in the middle of the picture [m]
    toward: Array  # (3,) unit vector from there to the eye
    up: Array  # (3,) unit vector that is upright in the picture
    height: float  # of the picture [m]
    size: tuple[int, int]  # width and height [pixel]

    @property
    def axes(self) -> Array:
        """(3, 3) columns: to the right, upwards, and towards the eye."""
        return np.column_stack([np.cross(self.up, self.toward), self.up, self.toward])

    @property
    def metre(self) -> float:
        """How many pixels of the picture it takes."""
        return self.size[1] / self.height


def aimed(
    points: Array,
    width: int,
    *,
    view: npt.ArrayLike | None = None,
    up: npt.ArrayLike | None = None,
    heights: tuple[float, float] = HEIGHTS,
) -> Camera:
    """A camera that sees all points (..., 3) [m] with little space wasted.

    Width [pixel] and bounds of the height, as shares of it, are those of the picture. Without
    ``view`` it looks mainly along the shortest extent; without ``up`` the longest lies across.
    """
    points = np.asarray(points, dtype=float).reshape(-1, 3)
    toward, upright = _directions(points, view, up)
    axes = np.column_stack([np.cross(upright, toward), upright, toward])
    seen = points @ axes
    low, high = seen.min(axis=0), seen.max(axis=0)
    extent = np.maximum(high - low, 1e-6 * np.ptp(seen) + 1e-12)
    wide, tall = extent[:2] + 2 * MARGIN_RATIO * extent[:2].max()
    pixels = 2 * round(width * float(np.clip(tall / wide, *heights)) / 2)
    focus, height = axes @ (0.5 * (low + high)), max(tall, wide * pixels / width)
    return Camera(focus, toward, upright, height, (width, pixels))


def _directions(
    points: Array, view: npt.ArrayLike | None, up: npt.ArrayLike | None
) -> tuple[Array, Array]:
    axes = np.eye(3)[np.argsort(np.ptp(points, axis=0), kind="stable")]
    short, middle, long = axes
    toward = short + 0.5 * middle - 0.35 * long if view is None else _direction("view", view)
    upright = middle if up is None else _direction("up", up)
    if up is None and np.linalg.norm(np.cross(toward, upright)) < 1e-3 * np.linalg.norm(toward):
        upright = long
    across = upright - toward * (upright @ toward) / max(toward @ toward, 1e-300)
    if not (toward.any() and np.linalg.norm(across) > 1e-6 * np.linalg.norm(upright) > 0):
        raise ConfigError(
            f"view = {shortened(view)} and up = {shortened(up)} are no two directions.",
            hint="Give two that are not zero and not along one line, e.g. (1, -1, 0.5) and "
            "(0, 0, 1), or leave one out.",
        )
    return toward / np.linalg.norm(toward), across / np.linalg.norm(across)


def _direction(name: str, value: npt.ArrayLike) -> Array:
    """A direction (3,) somebody gave, of size 1 or so; zero stays."""
    try:
        found = finite(name, value, (3,))
    except ConfigError as error:
        hint = "A direction is three numbers, e.g. (0, 0, 1)."
        raise ConfigError(error.message, hint=hint) from None
    return found / (np.abs(found).max() or 1.0)


def sharp_edges(points: Array, triangles: Index) -> Index:
    """(m, 2) edges where a surface bends by more than 35 degrees, or ends."""
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    pairs, owner = directed_edges(triangles)
    edges, place, count = np.unique(
        np.sort(pairs, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    total = np.zeros((len(edges), 3))
    np.add.at(total, place.ravel(), normals[owner])
    # two unit normals under the angle theta add up to the length 2 cos(theta / 2)
    flat = (count == 2) & (np.linalg.norm(total, axis=1) > np.sqrt(2 + 2 * SHARP_COSINE))
    return edges[~flat]


def directed_edges(triangles: Index) -> tuple[Index, Index]:
    """(3 t, 2) edges of all triangles and (3 t,) the triangle of each."""
    pairs = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    return pairs, np.repeat(np.arange(len(triangles)), 3)


def boundary(triangles: Index) -> Index:
    """(m, 2) edges that belong to one triangle."""
    pairs = np.sort(directed_edges(triangles)[0], axis=1)
    edges, count = np.unique(pairs, axis=0, return_counts=True)
    return edges[count == 1]
