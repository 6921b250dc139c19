"""Where the teeth of wheels stand: phases of meshes that share a wheel.

The working flanks of a mesh have their origins on the base circles at angles from the line of
centres about the axis of the pinion::

    gamma_1 = p - alpha,   gamma_2 = (T - r_b1 p) / r_b2 - alpha,

p the phase and T the distance of the points of tangency. Half of a tooth behind them lies its
middle, which a second mesh of the same wheel finds at the same place, on whichever flank it bears.
Around one circle phases then step as z psi / (2 pi) of a pitch over the angles psi of the planets.

Source:
    Parker and Lin, Mesh phasing relationships in planetary and epicyclic gears, J. Mech. Des. 126
    (2004) 365.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np

from rom.errors import ModelError

SAME_AXIS = 1e-6  # sine of the angle between two axes of one wheel
MAX_MISFIT = 0.02  # of a pitch, beyond the backlash, by which teeth may miss the gaps of a circle


def phase_from(name: str, mesh: Any, others: Iterable[tuple[str, Any]]) -> float:
    """Phase of a mesh from those that its wheels have already, 0 if they have none [rad].

    Args:
        name: of the new mesh.
        mesh: the `GearMesh`.
        others: names and `GearMesh` of the mechanism.

    Raises:
        ModelError: if the teeth of both wheels do not fit: a planet that cannot be put in.
    """
    pair, found = mesh.pair, dict[int, tuple[float, str]]()
    for other, known in others:
        for side in (0, 1) if pair.teeth[1] else (0,):
            at = _middle(mesh, side, known)
            if side not in found and at is not None:
                found[side] = at, other
    pitch = pair.base_pitch / pair.rb[0]
    phases = {side: (_phase(pair, side, at) % pitch, other) for side, (at, other) in found.items()}
    if not phases:
        return 0.0
    if len(phases) == 2:
        (one, first), (two, second) = phases.values()
        misfit = abs((one - two + 0.5 * pitch) % pitch - 0.5 * pitch) * pair.rb[0]
        if misfit > MAX_MISFIT * pair.base_pitch + abs(pair.backlash):
            raise ModelError(
                f"the teeth of mesh {name!r} miss each other's gaps by "
                f"{misfit / pair.base_pitch:.3f} of a pitch: by meshes {first!r} and {second!r} "
                "the wheels stand otherwise, so that no such train can be put together.",
                where=name,
                hint="Planets in equal steps need a sum of the teeth of sun and ring that their "
                "number divides. To leave that alone give phase=...",
            )
    return phases[min(phases)][0]


def _phase(pair: Any, side: int, middle: float) -> float:
    """Of the mesh whose wheel has the middle of a tooth at an angle from the line of centres."""
    origin = middle + pair.base_thickness[side] / (2 * pair.rb[side]) + pair.alpha
    return float(origin if side == 0 else (pair.tangents - pair.rb[1] * origin) / pair.rb[0])


def _middle(mesh: Any, side: int, known: Any) -> float | None:
    """Angle of the middle of a tooth on wheel ``side`` of a mesh, from one that is known."""
    marker, teeth = (mesh.i, mesh.j)[side], mesh.pair.teeth[side]
    for other, place in enumerate((known.i, known.j)):
        z, e, towards = mesh.axes[2 * side], mesh.axes[2 * side + 1], known.axes[2 * other + 1]
        turned = float(z @ known.axes[2 * other])
        same = place == marker and known.pair.teeth[other] == teeth
        if same and abs(turned) > 1 - SAME_AXIS:
            pair = known.pair
            at = known.phase
            at = at if other == 0 else (pair.tangents - pair.rb[0] * at) / pair.rb[1]
            middle = at - pair.alpha - pair.base_thickness[other] / (2 * pair.rb[other])
            between = np.arctan2(z @ np.cross(e, towards), e @ towards)
            return float(between + np.sign(turned) * middle)
    return None
