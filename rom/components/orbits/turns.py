"""What advances while the motion repeats: states are compared after it was turned back."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from rom import rotation
from rom.errors import ConfigError, ModelError
from rom.mbs.kernels.system import ANGLE
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.bodies import GROUND, Part
from rom.mbs.parts.joints import Joint
from rom.mbs.results.state import State
from rom.model import Array
from rom.names import offered

SYMMETRY_RTOL = 1e-8  # of inertia: by which a body may look different after its turn
WHOLE_TURN_TOL = 1e-9  # [rad]
FULL_TURN = 2 * np.pi


@dataclass(frozen=True)
class Turn:
    """A body that advances about an axis of its own.

    Attributes:
        name: joint in which it turns, or the body where there is none.
        body: its number.
        axis: (3,) in its frame [1].
        angle: by which it advances in a period about the axis [rad]; None for whatever it does.
        prescribed: the same as the angle of the joint counts.
        first, first_velocity: its places in q and v.
    """

    name: str
    body: int
    axis: Array
    angle: float | None
    prescribed: float | None
    first: int
    first_velocity: int

    def advanced(self, one: State, two: State) -> float:
        """Angle about the axis from one state to another [rad], within half a turn."""
        at = slice(self.first + 3, self.first + 7)
        turn = rotation.multiply(one.q[at] * [1.0, -1.0, -1.0, -1.0], two.q[at])
        return 2 * float(np.arctan2(turn[1:] @ self.axis, turn[0]))

    def back(self, state: State, angle: float) -> State:
        """The state with the frame of the body turned back about its axis.

        What looks the same after the turn has then moved nowhere: its frame is another one, in
        which the same angular velocity has other components.
        """
        q, rows = state.q.copy(), slice(self.first_velocity + 3, self.first_velocity + 6)
        at = slice(self.first + 3, self.first + 7)
        q[at] = rotation.multiply(q[at], rotation.exp(-angle * self.axis))
        R = rotation.matrix(rotation.exp(angle * self.axis))
        rates = {}
        for name in ("v", "a", "algorithmic"):
            value = getattr(state, name)
            if value is not None:
                rates[name] = value.copy()
                rates[name][rows] = R @ value[rows]
        return replace(state, q=q, **rates)


@dataclass(frozen=True)
class Turns:
    """All that advances."""

    every: tuple[Turn, ...] = ()

    def angles(self, one: State, two: State) -> tuple[float, ...]:
        """By how much each advances from one state to another [rad]."""
        return tuple(
            turn.advanced(one, two) if turn.angle is None else turn.angle for turn in self.every
        )

    def back(self, state: State, angles: tuple[float, ...]) -> State:
        """The state with all turned back."""
        for turn, angle in zip(self.every, angles, strict=True):
            state = turn.back(state, angle)
        return state

    @property
    def prescribed(self) -> bool:
        """Whether all angles are given."""
        return all(turn.angle is not None for turn in self.every)

    def turned(self, change: Array, angles: tuple[float, ...]) -> Array:
        """(n, f) small motions or changes of velocities after all was turned back."""
        found = change.copy()
        for turn, angle in zip(self.every, angles, strict=True):
            rows = slice(turn.first_velocity + 3, turn.first_velocity + 6)
            found[rows] = rotation.matrix(rotation.exp(angle * turn.axis)) @ found[rows]
        return found

    def of(self, joint: str) -> float | None:
        """Angle by which the drive of a joint may advance; zero for others, None for any."""
        found = [turn.prescribed for turn in self.every if turn.name == joint]
        return found[0] if found else 0.0


def turns_of(mechanism: Mechanism, turns: Mapping[str, float | None] | None, state: State) -> Turns:
    """What the user says advances.

    Raises:
        ConfigError: for a name that is neither a joint nor a body, or no angle.
        ModelError: for a body that looks different after its turn, or has no axis of its own.
    """
    numbers = {name: k for k, name in enumerate(mechanism.parts)}
    found, places = [], _places(mechanism)
    for given, angle in (turns or {}).items():
        name = _joint_of(mechanism, given)
        body, axis, point, sign = _hinged(mechanism, name, state, places)
        if (
            angle is not None
            and abs(np.remainder(angle + np.pi, FULL_TURN) - np.pi) < WHOLE_TURN_TOL
        ):
            continue  # the same place
        part = mechanism.parts[body]
        _refuse_unequal(name, part, axis, point, angle)
        signed = None if angle is None else sign * angle
        found.append(Turn(name, numbers[body], axis, signed, angle, *places[body]))
    return Turns(tuple(found))


def _places(mechanism: Mechanism) -> dict[str, tuple[int, int]]:
    """Places of each body in q and v."""
    found, q, v = {}, 0, 0
    for name, part in mechanism.parts.items():
        found[name] = (q, v)
        q, v = q + 7 + part.r, v + 6 + part.r
    return found


def _joint_of(mechanism: Mechanism, name: str) -> str:
    """The only joint with an angle in which a body turns; else what the user named."""
    joints = mechanism.joints.values()
    found = [x.name for x in joints if x.turn and name in [m.body for m in x.markers]]
    return found[0] if name in mechanism.parts and len(found) == 1 else name


def _hinged(
    mechanism: Mechanism, name: str, state: State, places: dict[str, tuple[int, int]]
) -> tuple[str, Array, Array, float]:
    """Body, axis and a point of it in the frame of the body, and the sign of its angle."""
    if name in mechanism.joints:
        return _of_joint(mechanism, mechanism.joints[name])
    if name not in mechanism.parts:
        known = [*(n for n, j in mechanism.joints.items() if j.turn), *mechanism.parts]
        raise ConfigError(f"turns: no joint or body {name!r}; there are {offered(known, name)}.")
    at = places[name][1]
    return name, _own_axis(mechanism.parts[name], state.v[at + 3 : at + 6]), np.zeros(3), 1.0


def _of_joint(mechanism: Mechanism, joint: Joint) -> tuple[str, Array, Array, float]:
    if joint.turn is None or joint.turn.kind != ANGLE:
        raise ConfigError(f"turns: {joint.name!r} is {joint.kind}; take a revolute joint.")
    one, two = joint.markers[:2]
    marker, sign = (one, -1.0) if two.body == GROUND else (two, 1.0)
    base, part = mechanism.part(one.body), mechanism.part(marker.body)
    axis = rotation.matrix(base.p) @ np.cross(joint.turn.a, joint.turn.c)
    return part.name, rotation.matrix(part.p).T @ axis, part.point(marker), sign


def _own_axis(part: Part, spin: Array) -> Array:
    """(3,) axis about which the inertia of a body is the same all round, along its spin.

    Raises:
        ModelError: if there is none, or the body does not spin.
    """
    values, axes = np.linalg.eigh(part.second)
    size = SYMMETRY_RTOL * values.max()
    equal = [abs(values[k - 2] - values[k - 1]) <= size for k in range(3)]
    if not any(equal) or not spin.any():
        raise ModelError(
            f"no axis of its own is known about which {part.name!r} advances.",
            where=part.name,
            hint="Name the joint it turns in, or let it spin at the start.",
        )
    axis = spin / np.linalg.norm(spin) if all(equal) else axes[:, equal.index(True)]
    return axis if axis @ spin > 0.0 else -axis


def _refuse_unequal(name: str, part: Part, axis: Array, point: Array, angle: float | None) -> None:
    """Refuse a body that looks different after its turn."""
    how = "any angle" if angle is None else f"{angle:.6g} rad"
    if part.r:
        raise ModelError(
            f"turns: {name!r} turns the flexible body {part.name!r} by {how}, after which its "
            "elastic coordinates describe other shapes.",
            where=part.name,
            hint="Take a period of whole revolutions of this body.",
        )
    R = rotation.matrix(rotation.exp((1.0 if angle is None else angle) * axis))
    size = max(float(np.trace(part.second)), 1e-300)
    away = float(np.linalg.norm(np.cross(axis, point + 0.0 * axis)))
    moved = float(np.abs(R @ part.second @ R.T - part.second).max())
    if moved > SYMMETRY_RTOL * size or part.mass * away**2 > SYMMETRY_RTOL * size:
        what = "its mass centre is beside the axis" if moved <= SYMMETRY_RTOL * size else (
            "its inertia is not the same about axes across the one it turns about")  # fmt: skip
        raise ModelError(
            f"turns: after {how} the body {part.name!r} is another one: {what}.",
            where=part.name,
            hint="Take a period of whole revolutions of this body.",
        )
