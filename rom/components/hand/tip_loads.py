"""How far the tip of a moving finger gives way: loads against deflections, by statics."""

from typing import Any

import numpy as np
import numpy.typing as npt

from rom.components.hand.compliant_hand import Finger
from rom.components.hand.moving_hand import Drive, Seat, moving_hand
from rom.mbs.analysis.equilibrium import equilibrium
from rom.mbs.analysis.local_equations import snapshot
from rom.mbs.mechanism import Mechanism
from rom.model import Array


def one_finger(finger: Finger, tension: float = 0.0, load: Any = (0.0, 0.0, 0.0)) -> Mechanism:
    """A finger as a mechanism, its cable under a tension [N] and a force (3,) on its tip [N].

    Args:
        finger: the finger.
        tension: of the cable [N].
        load: (3,) force on the tip, world [N], or a function of time.
    """
    drives = {"finger": Drive(tension=tension)}
    mech = moving_hand({"finger": finger}, seats={"finger": Seat()}, drives=drives)
    mech.force("load", tip_marker(mech, finger), load)
    return mech


def tip_marker(mech: Mechanism, finger: Finger, name: str = "finger") -> Any:
    """Marker of the tip of a finger."""
    return mech.parts[f"{name} phalanx {len(finger.phalanges)}"].marker("distal")


def deflections(
    finger: Finger, direction: npt.ArrayLike, forces: npt.ArrayLike, *, tension: float = 0.0
) -> Array:
    """(n, 3) way of the tip under forces (n,) [N] along a direction, from where it is without [m].

    Args:
        finger: the finger.
        direction: (3,) of the force, world [1].
        forces: (n,) [N].
        tension: of the cable, held [N].

    Source:
        In three directions as Potratz and others measured, J. Biomech. Eng. 127 (2005) 934.
    """
    e, sizes = np.asarray(direction, dtype=float), np.asarray(forces, dtype=float)
    times = np.arange(sizes.size, dtype=float)
    mech = one_finger(finger, tension, lambda t: np.interp(t, times, sizes) * e)
    marker, found, state = tip_marker(mech, finger), [], None
    for t in times:
        state = equilibrium(mech, state, t=t)
        found.append(snapshot(mech, state).position(marker.body, "distal")[-1])
    start = snapshot(mech, equilibrium(one_finger(finger, tension)))
    return np.array(found) - start.position(marker.body, "distal")[-1]
