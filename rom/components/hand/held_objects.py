"""Bars and balls that a moving hand holds: contacts with all phalanges and the palm, a table below.

An object is free in space. Every phalanx is a round bar with round ends; the palm is a plane.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from typing import Annotated

import numpy as np

from rom.arguments import Length, Positive, finite, typed, unit_vector
from rom.errors import ConfigError
from rom.mbs.elements.contact.impact import Impact
from rom.mbs.elements.contact.points import distance
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.bodies import Marker, Part
from rom.mbs.results.solution import Solution
from rom.model import Array
from rom.rotation import matrix

# silicone of 0.6 MPa on round bars of 5 mm and 15 mm, after Hertz; along the surface two thirds of
# its stiffness under 1 N, after Mindlin, and a third of the critical damping of a phalanx of 2 g
SKIN_CONTACT = Impact(5e4, damping=5.0, mu=0.8, tangential_stiffness=1.4e3, tangential_damping=1.0)
FOOT_RADIUS = 1e-3  # of the feet on which a bar stands [m]
FEET_SHARE = 0.8  # of its radius, at which they are
UPRIGHT_COSINE = 0.9  # between axis and gravity of a bar that stands
TABLE_MASS = 0.1  # [kg]; its motion is given
RAMP_TIME = 0.1  # over which the table gathers speed [s]


@typed
@dataclass(frozen=True)
class Held:
    """A ball, or a round bar with round ends.

    Attributes:
        centre: (3,) at the start [m].
        radius: [m].
        mass: [kg].
        axis: (3,) of a bar [1]; None for a ball.
        length: of a bar between the middles of its ends [m].
    """

    centre: tuple[float, float, float]
    radius: Length
    mass: Annotated[float, Positive("kg")]
    axis: tuple[float, float, float] | None = None
    length: float = 0.0

    @property
    def inertia(self) -> Array:
        """(3, 3) of an even ball, or even cylinder as long as the bar with its ends [kg m^2]."""
        if self.axis is None:
            return 0.4 * self.mass * self.radius**2 * np.eye(3)
        e = unit_vector("axis", self.axis)
        along = 0.5 * self.mass * self.radius**2
        across = 0.5 * along + self.mass * (self.length + 2 * self.radius) ** 2 / 12
        return across * np.eye(3) + (along - across) * np.outer(e, e)

    @property
    def ends(self) -> Array:
        """(1 or 2, 3) middles of the ends from the centre [m]."""
        if self.axis is None:
            return np.zeros((1, 3))
        half = 0.5 * self.length * unit_vector("axis", self.axis)
        return np.array([-half, half])


def hold(
    mech: Mechanism, name: str, held: Held, *, law: Impact = SKIN_CONTACT, thickness: float = 5e-3
) -> Part:
    """Put an object into a hand, with contacts named "index phalanx 1 on bar" and "palm on bar 1".

    Args:
        mech: such as `rom.components.hand.moving_hand` makes.
        name: of the object.
        held: the object.
        law: of its contacts.
        thickness: half that of the phalanges [m].

    Raises:
        ConfigError: for an object that reaches into the hand or that no finger reaches, or a
            mechanism without fingers.

    Source:
        Force of the contacts: Hunt and Crossley, J. Appl. Mech. 42 (1975) 440; stiffness along the
        surface: Mindlin, J. Appl. Mech. 16 (1949) 259.
    """
    phalanges = [part for part in mech.parts.values() if "distal" in part.points]
    if not phalanges:
        raise ConfigError(f"nothing holds {name!r}: the mechanism needs fingers of `moving_hand`.")
    axes = [matrix(bone.p)[:, 2] for bone in phalanges]
    halves = [float(np.linalg.norm(bone.points["distal"])) for bone in phalanges]
    pieces = list(zip(phalanges, axes, halves, strict=True))
    face, normal = _palm_face(mech)
    ends = np.asarray(held.centre) + held.ends
    depths = {one.name: thickness - _far(held, one.at, axis, half) for one, axis, half in pieces}
    depths["palm"] = -((ends - mech.design_point(face)) @ normal).min()
    for other, depth in depths.items():
        inside = 1e3 * (depth + held.radius)
        if inside > 0.0:
            raise ConfigError(f"{name!r} reaches {inside:.3g} mm into {other!r}; move it away.")
    _check_reach(mech, phalanges, name, held)
    made = mech.add_rigid(name, mass=held.mass, inertia=held.inertia, at=held.centre)
    middle = made.marker((0.0, 0.0, 0.0))
    meet = partial(mech.capsule_on_capsule, radius1=thickness, radius2=held.radius)
    meet = partial(meet, axis2=held.axis, length2=held.length)
    for bone, axis, half in pieces:
        both = bone.marker((0.0, 0.0, 0.0)), middle
        meet(f"{bone.name} on {name}", *both, law, axis1=axis, length1=2.0 * half)
    press = partial(mech.sphere_on_plane, normal=normal, radius=held.radius)
    for k, end in enumerate(held.ends, start=1):
        press(f"palm on {name} {k}", face, made.marker(end), law)
    return made


def _palm_face(mech: Mechanism) -> tuple[Marker, Array]:
    """A point of the plane through the first plates, and its normal (3,)."""
    first = [joint.markers for key, joint in mech.joints.items() if key.endswith(" joint 1")]
    points = np.array([mech.design_point(pair[0]) for pair in first])
    axes = [matrix(mech.part(pair[1].body).p)[:, 2] for pair in first]
    palm = mech.parts["palm"]
    return palm.marker(points.mean(axis=0) - palm.at), unit_vector("palm", np.mean(axes, axis=0))


def _far(held: Held, place: Array, axis: Array, half: float) -> float:
    """Distance of the middle line of an object from a straight piece [m]."""
    e = np.array([0.0, 0.0, 1.0]) if held.axis is None else unit_vector("axis", held.axis)
    gap = np.asarray(held.centre) - place
    return float(distance(gap, axis, e, half, 0.5 * held.length))


def _check_reach(mech: Mechanism, bones: list[Part], name: str, held: Held) -> None:
    """Refuse an object that no finger reaches, however it bends."""
    over = []
    for key, joint in mech.joints.items():
        if key.endswith(" joint 1"):
            root = mech.design_point(joint.markers[0])
            own = [one for one in bones if one.name.startswith(key.removesuffix("joint 1"))]
            tips = [mech.design_point(one.marker("distal")) for one in own]
            length = max(np.linalg.norm(tip - root) for tip in tips)
            over.append(_far(held, root, np.array([1.0, 0.0, 0.0]), 0.0) - held.radius - length)
    if min(over) > 0.0:
        raise ConfigError(f"{name!r} is {min(over) * 1e3:.3g} mm beyond the reach; move it closer.")


def table(
    mech: Mechanism,
    name: str,
    held: Held,
    *,
    leaves: float,
    speed: float = 0.1,
    law: Impact = SKIN_CONTACT,
) -> Part:
    """A table below an object, that goes down from a time on.

    Args:
        mech: with the object, and gravity.
        name: of the object.
        held: the object.
        leaves: when it begins to go [s].
        speed: that it reaches within 0.1 s [m/s].
        law: of the contact.

    Raises:
        ConfigError: if there is no gravity.
    """
    gravity = finite("gravity", mech.gravity, (3,))
    if not np.linalg.norm(gravity) > 0.0:
        raise ConfigError(f"{name!r} on a table needs gravity.")
    up = -gravity / np.linalg.norm(gravity)
    feet, radius = _feet(held, up)
    low = min(float(foot @ up) for foot in feet) - radius
    top = np.asarray(held.centre) + low * up
    made = mech.add_rigid("table", mass=TABLE_MASS, inertia=(1e-4,) * 3, at=top)
    middle = made.marker((0.0, 0.0, 0.0))
    mech.prismatic("table guide", mech.ground.marker(top), middle, axis=up)
    way, rate = (partial(one, leaves, speed) for one in (_way, _rate))
    mech.drive("table motor", "table guide", way, rate=rate)
    rest = partial(mech.sphere_on_plane, normal=up, radius=radius)
    for k, foot in enumerate(feet, start=1):
        rest(f"table on {name} {k}", middle, mech.parts[name].marker(foot), law)
    return made


def _way(leaves: float, speed: float, t: float) -> float:
    """Way of a table that goes down from a time on, with a smooth ramp of the speed; negative."""
    gone = t - leaves
    s = min(max(gone / RAMP_TIME, 0.0), 1.0)
    return -speed * (RAMP_TIME * (s**3 - 0.5 * s**4) + max(gone - RAMP_TIME, 0.0))


def _rate(leaves: float, speed: float, t: float) -> float:
    s = min(max((t - leaves) / RAMP_TIME, 0.0), 1.0)
    return -speed * s * s * (3.0 - 2.0 * s)


def _feet(held: Held, up: Array) -> tuple[list[Array], float]:
    """Middles of the balls on which an object rests, from its centre, and their radius [m]."""
    if held.axis is None or abs(unit_vector("axis", held.axis) @ up) < UPRIGHT_COSINE:
        return list(held.ends), held.radius
    e = unit_vector("axis", held.axis)
    e = e if e @ up > 0.0 else -e
    x = np.cross(e, np.eye(3)[np.argmin(np.abs(e))])
    x /= np.linalg.norm(x)
    turns = 2 * np.pi / 3 * np.arange(3)
    bottom = -(0.5 * held.length + held.radius - FOOT_RADIUS) * e
    outwards = (np.cos(a) * x + np.sin(a) * np.cross(e, x) for a in turns)
    return [bottom + FEET_SHARE * held.radius * one for one in outwards], FOOT_RADIUS


def contacts_of(mech: Mechanism, name: str) -> list[str]:
    """Names of the contacts of an object."""
    return [key for key, one in mech.contacts.items() if one.j.body == name]


def contact_forces(solution: Solution, name: str) -> dict[str, Array]:
    """{contact: (n_t, 3) force on the object, world [N]}."""
    return {key: solution.element(key).force[:, 1] for key in contacts_of(solution.mechanism, name)}


def grip(solution: Solution, name: str, fingers: Iterable[str]) -> dict[str, Array]:
    """{finger: (n_t,) sizes of the forces of its phalanges on an object, added up [N]}."""
    sizes = {k: np.linalg.norm(f, axis=1) for k, f in contact_forces(solution, name).items()}
    none, found = np.zeros(solution.t.size), {}
    for one in fingers:
        found[one] = sum((f for key, f in sizes.items() if key.startswith(f"{one} phalanx")), none)
    return found
