"""Steady rotation: of a mechanism as a whole, or of the bodies behind some of its joints."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_matrix, lil_matrix

from rom import rotation
from rom.arguments import finite, number
from rom.errors import ConfigError
from rom.mbs.analysis.local_equations import Instant
from rom.mbs.analysis.rotors.moving_axes import IN_BODIES, small_motions
from rom.mbs.kernels.system import COUPLING
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.bodies import GROUND
from rom.mbs.parts.joints import coordinate_of
from rom.mbs.results.state import State
from rom.model import Array


@dataclass(frozen=True)
class Turning:
    """Bodies that turn together about the axis of a joint, which what carries it may move."""

    marker: int  # number of the marker of the joint on what carries it
    axis: Array  # (3,) of the joint in the axes of that marker [1]
    speed: float  # [rad/s]
    bodies: tuple[int, ...]  # their numbers


@dataclass(frozen=True)
class Spins:
    """What turns steadily."""

    whole: Array  # (3,) angular velocity of all bodies, world [rad/s]
    about: Array  # (3,) a point on its axis [m]
    turning: tuple[Turning, ...] = ()  # instead, the bodies behind some joints

    @classmethod
    def of(cls, mechanism: Mechanism, now: Instant, spin: object, about: npt.ArrayLike) -> "Spins":
        """What the caller of `equilibrium` says."""
        found = cls(np.zeros(3), finite("about", about, (3,)))
        if isinstance(spin, Mapping):
            found = replace(found, turning=_turning(mechanism, now, spin))
        elif spin is not None:
            found = replace(found, whole=finite("spin", spin, (3,)))
        if found.any:
            now.packed.refuse_rolling(
                "what rolls has no equilibrium while it spins; use rom.simulate instead."
            )
        return found

    @property
    def any(self) -> bool:
        """Whether anything turns."""
        return bool(self.whole.any() or any(one.speed for one in self.turning))

    def steady(self, now: Instant, state: State) -> State:
        """The state with the velocities and accelerations of the steady rotation."""
        bodies, v, a = now.packed.system.bodies, 0 * state.v, 0 * state.a
        for b, omega, centre in self._each(now, state):
            q_at, at = bodies.q_at[b], bodies.v_at[b]
            v[at : at + 3] = np.cross(omega, state.q[q_at : q_at + 3] - centre)
            a[at : at + 3] = np.cross(omega, v[at : at + 3])
            v[at + 3 : at + 6] = rotation.matrix(state.q[q_at + 3 : q_at + 7]).T @ omega
        return replace(state, t=now.t, v=v, a=a, algorithmic=None)

    def _each(self, now: Instant, state: State) -> Iterator[tuple[int, Array, Array]]:
        """Number, angular velocity (3,) and a point (3,) on the axis of each body that turns."""
        if self.whole.any():
            for b in range(now.packed.system.bodies.mass.size):
                yield b, self.whole, self.about
        for one in self.turning:
            now.evaluate(state.q, 0 * state.v)
            omega = one.speed * now.W.E[one.marker] @ one.axis
            centre = now.W.P[one.marker].copy()
            for b in one.bodies:
                yield b, omega, centre

    def motions(self, now: Instant, state: State) -> tuple[csr_matrix, csr_matrix, csr_matrix]:
        """Matrices (n, n) of small steady motions p to variations T p, velocities, accelerations.

        Bodies that turn carry their p with them; an axis goes along with what carries its joint.
        """
        T, T1, _, T3 = small_motions(now.packed, state, IN_BODIES)
        if not self.turning:
            return T, T1, T3
        V, A = self._carried(now, state)
        return T, T1 + V @ T, T3 + A @ T

    def _carried(self, now: Instant, state: State) -> tuple[csr_matrix, csr_matrix]:
        """(n, n) velocities and accelerations by motions of what carries the joints."""
        packed, bodies = now.packed, now.packed.system.bodies
        V, A = (lil_matrix((state.v.size, state.v.size)) for _ in range(2))
        turns = list(self._each(now, state))
        for one in self.turning:
            carrier = packed.system.markers.body[one.marker]
            if carrier < 0:
                continue
            at, r = bodies.v_at[carrier], bodies.r[carrier]
            columns = slice(at, at + 6 + r)
            shift, turn = np.split(now.W.H[one.marker, :, : 6 + r].copy(), 2)
            for b, omega, centre in (x for x in turns if x[0] in one.bodies):
                q_at, row = bodies.q_at[b], bodies.v_at[b]
                arm, W = state.q[q_at : q_at + 3] - centre, rotation.skew(omega)
                tilt = -W @ turn  # change of omega
                move = -W @ shift - rotation.skew(arm) @ tilt
                V[row : row + 3, columns] = move
                axes = rotation.matrix(state.q[q_at + 3 : q_at + 7])
                V[row + 3 : row + 6, columns] = axes.T @ tilt
                A[row : row + 3, columns] = W @ move - rotation.skew(W @ arm) @ tilt
        return V.tocsr(), A.tocsr()


AT_REST = Spins(np.zeros(3), np.zeros(3))


def _turning(mechanism: Mechanism, now: Instant, spin: Mapping[str, float]) -> tuple[Turning, ...]:
    """The bodies behind each joint: what joints and elements connect with its second side."""
    for name in spin:
        coordinate_of(mechanism.joints, name, "angle", "spin")
    joints = [mechanism.joints[name] for name in spin]
    packed = now.packed
    number_of = {name: b for b, name in enumerate(packed.names)} | {GROUND: -1}
    fixed = [
        {number_of[m.body] for m in joint.markers}
        for name, joint in mechanism.joints.items()
        if name not in spin and all(row.kind != COUPLING for row in joint.rows)
    ]
    fixed += [{number_of[p.name] for p in whole.parts} for whole in mechanism.nonlinear.values()]
    sides = [tuple(number_of[m.body] for m in joint.markers) for joint in joints]
    groups = [_joined({-1, *(carrier for carrier, _ in sides)}, fixed)]
    for joint, (_, turned) in zip(joints, sides, strict=True):
        groups.append(_joined({turned}, fixed))
        for other in groups[:-1]:
            if both := groups[-1] & other:
                held = [packed.names[b] if b >= 0 else GROUND for b in sorted(both)]
                text = f"spin: what joint {joint.name!r} turns is held elsewhere, too: {held}."
                hint = "Name all joints about which it turns, from what rests to what turns."
                raise ConfigError(text, hint=hint)
    _take_along(groups, [set(map(int, x)) for x in packed.coupled()], fixed, packed.names)
    return tuple(
        Turning(
            packed.row(joint.markers[0]),
            np.cross(joint.turn.a, joint.turn.c),
            number(f"spin of {joint.name}", spin[joint.name]),
            tuple(sorted(group)),
        )
        for joint, group in zip(joints, groups[1:], strict=True)
        if joint.turn is not None
    )


def _joined(bodies: set[int], links: list[set[int]]) -> set[int]:
    """All bodies that links lead to."""
    reached, more = set(bodies), True
    while more:
        size = len(reached)
        for link in links:
            if link & reached:
                reached |= link
        more = len(reached) > size
    return reached


def _take_along(
    groups: list[set[int]], soft: list[set[int]], fixed: list[set[int]], names: tuple[str, ...]
) -> None:
    """Add bodies that no joint holds to the group that force elements hold them in."""
    left = set(range(len(names))) - set().union(*groups)
    while left:
        inside = [link & left for link in (*soft, *fixed) if link & left]
        piece = _joined({min(left)}, inside)
        holding = [g for g in groups if any(link & piece and link & g for link in soft)]
        if len(holding) > 1:
            text = f"spin: only forces hold body {names[min(piece)]!r}, to what turns and rests."
            raise ConfigError(
                text, hint="Hold it by a joint, with a spring along what that leaves."
            )
        (holding or groups)[0].update(piece)
        left -= piece
