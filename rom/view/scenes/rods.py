"""Bodies of a rod in a mechanism as boxes, for films."""

from typing import Any

import numpy as np
import numpy.typing as npt

from rom.arguments import typed
from rom.errors import ConfigError
from rom.view.canvas.solids import Mesh, box


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
