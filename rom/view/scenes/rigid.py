"""What bodies of a mechanism are drawn by: a surface, a given shape, or tubes to their markers.

Those of a rod are boxes.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

import rom.mbs
from rom.arguments import typed
from rom.errors import ConfigError
from rom.model import Array, Index
from rom.names import named, offered
from rom.view.canvas.solids import Mesh, box, cylinder, ellipsoid, joined

TUBE_RATIO = 0.07  # diameter of a tube, of the reach of the body
BOX_OPACITY, BLOCK_OPACITY = 0.22, 0.5  # of a box around tubes, and of one that is alone
MAX_BOX_RATIO = 3.0  # of the reach of a body with markers; larger boxes say nothing of its shape


@dataclass(frozen=True, slots=True)
class Form:
    """What a body is drawn by, in its frame."""

    points: Array  # (n, 3) [m]
    triangles: Index  # (m, 3) between them
    surface: Any = None  # of a flexible body whose points these are
    block: Mesh | None = None  # of its mass and inertia, to be seen through, beside tubes
    opacity: float = 1.0  # 0 to 1


def form_of(mechanism: "rom.mbs.Mechanism", name: str, shapes: Mapping[str, Mesh]) -> Form:
    """The surface of a flexible body; of others a given shape, or else tubes to their markers."""
    part = mechanism.parts[name]
    surface = getattr(part.flexible, "surface", None)
    if surface is not None and len(surface.triangles):
        return Form(surface.points, surface.triangles, surface)
    if name in shapes:
        points, triangles = shapes[name]
        return Form(np.asarray(points, dtype=float), np.asarray(triangles))
    ends, block = ends_of(mechanism, name), inertia_box(part)
    if not ends:
        return Form(*block, opacity=BLOCK_OPACITY)
    reach = max(float(np.linalg.norm(p)) for p in ends)
    telling = np.ptp(block[0], axis=0).max() <= MAX_BOX_RATIO * reach
    return Form(*bars(part, ends), block=block if telling else None)


def check_bodies(mechanism: "rom.mbs.Mechanism", what: str, names: Collection[str]) -> None:
    """Refuse names of bodies that a mechanism does not have."""
    if unknown := set(names) - set(mechanism.parts):
        there = offered(mechanism.parts)
        raise ConfigError(f"{what}: no body {named(sorted(unknown))}; there are {there}.")


def ends_of(mechanism: "rom.mbs.Mechanism", name: str) -> list[Array]:
    """(k) points (3,) of a rigid body beside its mass centre, named or held by something [m]."""
    part = mechanism.parts[name]
    held = [marker for joint in mechanism.joints.values() for marker in joint.markers]
    held += [m for family, element in mechanism.elements.values() for m in family.ends(element)]
    points = [*part.points.values(), *(part.point(m) for m in held if m.body == name)]
    far = {tuple(np.asarray(p).tolist()) for p in points if np.linalg.norm(p) > 0}
    return [np.array(p) for p in sorted(far)]


def bars(part: "rom.mbs.Part", ends: list[Array]) -> Mesh:
    """Tubes from the mass centre to some points; without any a box of the inertia of the body."""
    if not ends:
        return inertia_box(part)
    wide = TUBE_RATIO * max(float(np.linalg.norm(p)) for p in ends)
    tubes = [cylinder(np.zeros(3), end, wide, sides=24) for end in ends]
    knots = [ellipsoid((0.75 * wide,) * 3, end, sides=16) for end in (np.zeros(3), *ends)]
    return joined([*tubes, *knots])


def inertia_box(part: "rom.mbs.Part") -> Mesh:
    """The even block with the mass and the inertia of a body, in its frame."""
    size, axes = block_of(np.asarray(part.second, dtype=float), part.mass)
    points, triangles = box(size)
    return points @ axes.T, triangles


def block_of(second: Array, mass: float) -> tuple[Array, Array]:
    """(3,) edges [m] and (3, 3) axes, as columns, of a block with such second moments [kg m^2]."""
    moments, axes = np.linalg.eigh(second)
    edges = np.sqrt(12 * np.maximum(moments, 0.0) / mass)
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    return np.maximum(edges, 1e-3 * edges.max()), axes


@typed
def sleeves(rod: Any, widths: npt.ArrayLike) -> dict[str, Mesh]:
    """Boxes around the segments of a rod, as ``shapes`` of `animate` and `save_motion`.

    Args:
        rod: what `rom.Mechanism.add_nonlinear` returned for a rod.
        widths: (2,) or (N, 2) of the segments along the first two axes of their sections [m].

    Returns:
        {body: (points, triangles)}; the plates at the ends are leaves of no thickness.

    Raises:
        ConfigError: for widths of another shape or that are not positive.
    """
    along = np.linalg.norm(np.diff(rod.body.rod.x, axis=0), axis=1)
    try:
        sides = np.broadcast_to(np.asarray(widths, dtype=float), (along.size, 2))
    except ValueError:
        sides = np.zeros((1, 2))
    if not (sides > 0.0).all():
        raise ConfigError(f"widths must be (2,) or ({along.size}, 2) and positive, got {widths!r}.")
    lengths = np.concatenate([[0.0], along, [0.0]])
    sides = np.vstack([sides[:1], sides, sides[-1:]])
    return {
        part.name: box((*side, max(h, 1e-6 * side.max())), (0.0, 0.0, -h / 2))
        for part, side, h in zip(rod.parts, sides, lengths, strict=True)
    }
