"""Outputs: motion of markers, joint coordinates, loads of drives."""

from collections.abc import Callable
from typing import Any

import numpy as np

from rom.io.fmu.variables import Variable, structured
from rom.mbs.elements.joint_laws import FRICTIONS_FAMILY
from rom.mbs.equations.packing import Packed
from rom.mbs.kernels.work import Work
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.bodies import Marker
from rom.model import Array
from rom.names import check_known, check_once
from rom.rotation import quaternion

# reads (W, lam, packed) at an instant
Reading = Callable[[Work, Array, Packed], Any]
MARKER_OUTPUTS = (
    ("position", 3, "m", "world"),
    ("velocity", 3, "m/s", "world"),
    ("quaternion", 4, "1", "marker to world, scalar first"),
    ("angular_velocity", 3, "rad/s", "world"),
)


def output_names(mechanism: Mechanism) -> list[str]:
    """All outputs there can be: markers with names, joints with a coordinate, drives."""
    markers = [
        f"{name}.{marker}" for name, part in mechanism.parts.items() for marker in part.names
    ]
    joints = [name for name, joint in mechanism.joints.items() if joint.coordinate is not None]
    return [*markers, *joints, *mechanism.drives]


class Outputs:
    """What an FMU tells of its mechanism.

    Args:
        mechanism: joints asked for get a friction of zero, which lets the integrator count their
            angles over whole turns.
        names: "body.marker", names of joints with a coordinate, or names of drives.

    Raises:
        ConfigError: for a name that nothing has, or twice the same.
    """

    def __init__(self, mechanism: Mechanism, names: tuple[str, ...]):
        self.variables: list[Variable] = []
        self.readings: list[Reading] = []
        places = {
            f"{part.name}.{place}": part.marker(place)
            for part in mechanism.parts.values()
            for place in part.names
        }
        check_once(names, "the output")
        for name in names:
            check_known(name, output_names(mechanism), f"no output {name!r}; there are")
            if name in places:
                self._marker(places[name])
            elif name in mechanism.joints:
                self._joint(mechanism, name)
            else:
                self._drive(mechanism, name)

    def values(self, W: Work, lam: Array, packed: Packed) -> Array:
        """(n,) all outputs after an evaluation of the mechanism."""
        found = [np.ravel(read(W, lam, packed)) for read in self.readings]
        return np.concatenate(found) if found else np.zeros(0)

    def _marker(self, marker: Marker) -> None:
        for what, count, unit, axes in MARKER_OUTPUTS:
            name = structured(marker.body, str(marker.place), what)
            self.variables += [
                Variable(f"{name}[{k}]", "output", unit, description=axes)
                for k in range(1, count + 1)
            ]
        self.readings += [
            lambda W, lam, packed: W.P[packed.row(marker)],
            lambda W, lam, packed: W.V[packed.row(marker), :3],
            lambda W, lam, packed: quaternion(W.E[packed.row(marker)]),
            lambda W, lam, packed: W.V[packed.row(marker), 3:],
        ]

    def _joint(self, mechanism: Mechanism, name: str) -> None:
        joint = mechanism.joints[name]
        ways: Any = (("angle", joint.turn, "rad"), ("way", joint.displacement, "m"))
        for what, row, unit in ways:
            if row is None:
                continue
            k = len(mechanism.frictions)
            mechanism.friction(f"{what} of {name}", name, transition_speed=1.0, coordinate=what)
            self.variables += [
                Variable(structured(name, what), "output", unit, description="from the start"),
                Variable(structured(name, f"{what}_rate"), "output", f"{unit}/s"),
            ]
            self.readings += [_coordinate("x", k), _coordinate("xd", k)]

    def _drive(self, mechanism: Mechanism, name: str) -> None:
        joint = mechanism.joints[mechanism.drives[name].joint]
        unit = "N.m" if joint.coordinate is joint.turn else "N"
        about = "that the drive supplies along its joint coordinate"
        self.variables.append(Variable(structured(name, "load"), "output", unit, None, about))
        self.readings.append(lambda W, lam, packed: -lam[packed.rows_of(name)[0]])


def _coordinate(what: str, k: int) -> Reading:
    """Coordinate or rate that friction k follows."""
    return lambda W, lam, packed: getattr(W, what)[packed.elements[FRICTIONS_FAMILY].at[k]]
