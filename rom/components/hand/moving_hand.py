"""The hand as a mechanism: palm, springs as rods, phalanges as bodies, cables as tendons.

A finger of `rom.components.hand.compliant_hand` gets a seat on the palm, a drive for its cable,
masses, and losses in its springs. Bodies are named "palm", "index spring 1" and "index phalanx 1",
markers of a phalanx "proximal" and "distal", cables "index cable", joints "index joint 1" (palm or
phalanx to spring) and "index plate 1" (spring to phalanx). A drive named "index" closes the whole
finger; one named "index joint 2" bends that joint alone, by a cable in a sleeve that ends at its
first plate.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from rom.arguments import finite, not_negative, number, one_given, positive
from rom.components.cosserat import RodBody, body
from rom.components.cosserat.coils import with_coils
from rom.components.cosserat.helical_spring import HelicalSpring
from rom.components.hand.compliant_hand import STOP_STIFFNESS_RATIO, Finger, hand
from rom.components.hand.solid_finger import STEEL_DENSITY, heavy_spring
from rom.errors import ConfigError, ModelError
from rom.mbs.analysis.equilibrium import equilibrium
from rom.mbs.analysis.local_equations import snapshot
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.bodies import Marker, Part
from rom.model import Array
from rom.names import check_known

Course = Callable[[float], float] | float  # over time, or a value that stays
PULL_SHARE = 0.9  # of the springs of a finger that a winch may take in
Load = npt.ArrayLike | Callable[[float], Array]
TRANSITION_SPEED = 1e-3  # of cables in their holes [m/s], a fortieth of that of the winches


@dataclass(frozen=True)
class Seat:
    """Where a finger sits.

    Attributes:
        at: (3,) middle of its first plate, in the world [m].
        along: (3,) direction of the straight finger [1].
        palmar: (3,) direction in which it closes, made normal to ``along`` [1].
    """

    at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    along: tuple[float, float, float] = (0.0, 0.0, 1.0)
    palmar: tuple[float, float, float] = (1.0, 0.0, 0.0)

    @property
    def axes(self) -> Array:
        """(3, 3) palmar direction, direction across, and along, as columns.

        Raises:
            ConfigError: if both directions are one.
        """
        z, x = finite("along", self.along, (3,)), finite("palmar", self.palmar, (3,))
        y = np.cross(z, x)
        if not np.linalg.norm(y) > 1e-6 * np.linalg.norm(z) * np.linalg.norm(x):
            text = f"a finger along {self.along} cannot close towards {self.palmar}"
            raise ConfigError(f"{text}; give a direction across it.")
        z, y = z / np.linalg.norm(z), y / np.linalg.norm(y)
        return np.column_stack([np.cross(y, z), y, z])


SEATS: Mapping[str, Seat] = {
    "thumb": Seat((54e-3, 20e-3, 0.0), palmar=(-1.0, -0.25, 0.0)),
    "index": Seat((0.0, 33e-3, 0.0)),
    "middle": Seat((0.0, 11e-3, 0.0)),
    "ring": Seat((0.0, -11e-3, 0.0)),
    "little": Seat((0.0, -33e-3, 0.0)),
}


@dataclass(frozen=True)
class Drive:
    """What draws a cable: a force, or a winch behind an elastic cable.

    Attributes:
        tension: force at the first end [N], or a function of time; or give the next.
        pull: length that the winch takes in [m], or a function of time.
        EA: force per strain of the cable of a winch [N].
        damping: of that cable [N s]; a cable that it keeps taut tightens with a jump of the force.
        sleeve: length of the cable of a winch in a sleeve before its first place, which bends
            freely and does not give way [m].
        conduit: places on the palm that the cable passes before the first hole, the first one that
            of the motor, in the world at the start [m].
        transition_speed: of the cable in its holes, over which friction turns [m/s].
    """

    tension: Course | None = None
    pull: Course | None = None
    EA: float = 2e3
    damping: float = 0.0
    sleeve: float = 0.0
    conduit: tuple[tuple[float, float, float], ...] = ()
    transition_speed: float = TRANSITION_SPEED


@dataclass(frozen=True)
class Build:
    """Of what the hand is made.

    Attributes:
        bone_density: of the phalanges [kg/m^3].
        thickness: half that of the phalanges, round bars with round ends [m].
        wire_density: of the springs [kg/m^3].
        loss: time over which the springs lose their strain, viscous over elastic rigidity [s].
        palm: mass [kg] of the palm, an even block.
        palm_size: (3,) of it [m]; it lies behind the first plates.
    """

    bone_density: float = 1200.0
    thickness: float = 5e-3
    wire_density: float = STEEL_DENSITY
    loss: float = 2e-3
    palm: float = 0.12
    palm_size: tuple[float, float, float] = (62e-3, 84e-3, 20e-3)


@dataclass(frozen=True)
class _Winch:
    """A pull that a winch can do, as a function of time."""

    name: str
    pull: Course
    most: float

    def __call__(self, t: float) -> float:
        """The pull [m]."""
        pull = float(self.pull(t) if callable(self.pull) else self.pull)
        if not -1e-9 <= pull <= self.most:
            text = f"the winch of {self.name!r} is to take in {pull:g} m at {t:g} s"
            raise ConfigError(f"{text}; its springs give way by 0 to {self.most:g} m.")
        return pull


def moving_hand(
    fingers: Mapping[str, Finger] | None = None,
    *,
    drives: Mapping[str, Drive] | None = None,
    seats: Mapping[str, Seat] | None = None,
    build: Build | None = None,
    gravity: npt.ArrayLike = (0.0, 0.0, 0.0),
    held: bool = True,
) -> Mechanism:
    """Fingers on a palm, straight at the start.

    Args:
        fingers: {name: finger}; None for the five of `hand` with four segments a spring.
        drives: {name: drive} of cables, of fingers or of joints; without one there is no cable.
        seats: {name: seat}; None for `SEATS`, a row of four and the thumb opposite, aslant.
        build: masses and losses; None for `Build()`.
        gravity: (3,) [m/s^2].
        held: whether the palm is fixed to the ground by the joint "wrist"; else give it one.

    Raises:
        ConfigError: for a name that is no finger, or has no seat, and for what no drive can do.

    Source:
        Fingers that are driven one by one or together, after the idea of Potratz, Yang,
        Abdel-Malek, Pena Pitarch and Grosland, J. Biomech. Eng. 127 (2005) 934; as mechanism ours.
    """
    fingers = hand(n=4) if fingers is None else fingers
    drives, seats = drives or {}, SEATS if seats is None else seats
    numbers = {name: range(1, len(one.springs) + 1) for name, one in fingers.items()}
    joints = {f"{name} joint {k}" for name, each in numbers.items() for k in each}
    for kind, names, known in (("drive", drives, {*fingers, *joints}), ("seat", fingers, seats)):
        for name in names:
            check_known(name, known, f"{kind} of {name!r}: there are")
    mech, build = Mechanism(gravity=gravity), build or Build()
    palm = _palm(mech, build, [seats[name] for name in fingers])
    if held:
        mech.fixed("wrist", mech.ground.marker((0.0, 0.0, 0.0)), palm.marker(-palm.at))
    for name, finger in fingers.items():
        path = _finger(mech, build, name, finger, seats[name])
        _cables(mech, name, finger, drives, path)
    return mech


def _palm(mech: Mechanism, build: Build, seats: list[Seat]) -> Part:
    """A block behind the first plates."""
    size = finite("palm_size", build.palm_size, (3,))
    middle = np.mean([seat.at for seat in seats], axis=0)
    along = np.mean([seat.axes[:, 2] for seat in seats], axis=0)
    mass = positive("palm", build.palm)
    inertia = mass / 12 * (size @ size - size**2)
    at = middle - 0.5 * size[2] * along
    return mech.add_rigid("palm", mass=mass, inertia=inertia, at=at)


def _finger(mech: Mechanism, build: Build, name: str, finger: Finger, seat: Seat) -> list[Marker]:
    """Springs and phalanges in turn; the holes of the cable."""
    if finger.phalanges[-1] <= 0.0:
        raise ModelError(f"finger {name!r} ends in a bare plate; give its last phalanx a length.")
    A, palm = seat.axes, mech.parts["palm"]
    at, hole = np.asarray(seat.at, dtype=float), np.array([finger.offset, 0.0, 0.0])
    before = _on_palm(palm, at)
    path = [_on_palm(palm, at + A @ hole)]
    pairs = zip(finger.springs, finger.phalanges, strict=True)
    for k, (spring, link) in enumerate(pairs, start=1):
        wire = spring_body(finger, spring, build)
        joint = mech.add_nonlinear(f"{name} spring {k}", wire, at=at, orientation=A)
        mech.fixed(f"{name} joint {k}", before, joint.marker("start"))
        at = at + spring.length * A[:, 2]
        bone = _phalanx(mech, build, f"{name} phalanx {k}", link, at, A)
        mech.fixed(f"{name} plate {k}", joint.marker("end"), bone.marker("proximal"))
        half = np.array([0.0, 0.0, 0.5 * link])
        path += [bone.marker(hole - half), bone.marker(hole + half)]
        at, before = at + link * A[:, 2], bone.marker("distal")
    return path[:-1]


def _on_palm(palm: Part, point: Array) -> Marker:
    return palm.marker(point - palm.at)


def spring_body(finger: Finger, spring: HelicalSpring, build: Build) -> RodBody:
    """One spring of a finger as a body of a mechanism: stiffeners, losses, coils that touch."""
    made = heavy_spring(spring, finger.n, build.wire_density)
    stretch, bend = made.stretch.copy(), made.bend.copy()
    stretch[:, 1] *= finger.stiffener
    bend[:, [0, 2]] *= finger.stiffener
    loss, made = build.loss, made._replace(stretch=stretch, bend=bend)
    made = made._replace(viscous_stretch=loss * stretch, viscous_bend=loss * bend)
    return with_coils(
        body(made),
        radius=0.5 * (spring.diameter + spring.wire),
        solid=spring.solid_length,
        stiffness=STOP_STIFFNESS_RATIO * spring.stiffness,
    )


def _phalanx(mech: Mechanism, build: Build, name: str, link: float, at: Array, A: Array) -> Part:
    """A round bar from a plate on."""
    half = np.array([0.0, 0.0, 0.5 * link])
    r = positive("thickness", build.thickness)
    mass = positive("bone_density", build.bone_density) * np.pi * r**2 * link
    across, at = mass * (link**2 / 12 + r**2 / 4), at + A @ half
    inertia = (across, across, 0.5 * mass * r**2)
    ends: dict[str, npt.ArrayLike] = {"proximal": -half, "distal": half}
    return mech.add_rigid(name, mass=mass, inertia=inertia, at=at, orientation=A, markers=ends)


def _cables(
    mech: Mechanism, name: str, finger: Finger, drives: Mapping[str, Drive], holes: list[Marker]
) -> None:
    """The tendon of a finger, and those of its joints."""
    lengths, palm = [spring.length for spring in finger.springs], mech.parts["palm"]
    if name in drives:
        conduit = [_on_palm(palm, finite("conduit", x, (3,))) for x in drives[name].conduit]
        limits = finger.friction, sum(lengths)
        _cable(mech, name, drives[name], [*conduit, *holes], limits)
    for k, length in enumerate(lengths, start=1):
        joint = f"{name} joint {k}"
        if joint in drives:
            if drives[joint].conduit:
                text = f"the cable of {joint!r} alone runs in a sleeve, not in a conduit"
                raise ConfigError(f"{text}; give its sleeve a length.")
            _cable(mech, joint, drives[joint], holes[2 * k - 2 : 2 * k], (0.0, length))


def _cable(
    mech: Mechanism, name: str, drive: Drive, path: list[Marker], limits: tuple[float, float]
) -> None:
    """One tendon; limits are the friction in its holes [1] and the length of its springs [m]."""
    one_given(f"the drive of {name!r}", tension=drive.tension, pull=drive.pull)
    friction, springs = limits
    sliding = drive.transition_speed if friction else None
    cable = partial(mech.tendon, f"{name} cable", path, friction=friction, transition_speed=sliding)
    if drive.pull is None:
        cable(tension=drive.tension)
        return
    pull = drive.pull if callable(drive.pull) else number("pull", drive.pull)
    pull = _Winch(name, pull, PULL_SHARE * springs)
    points = np.array([mech.design_point(marker) for marker in path])
    length = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    pull(0.0)
    not_negative(f"sleeve of {name!r}", drive.sleeve)
    EA = positive("EA", drive.EA) * length / (length + drive.sleeve)
    cable(EA=EA, damping=drive.damping, free_length=lambda t: length - pull(t))


def one_finger(finger: Finger, tension: float = 0.0, load: Load = (0.0, 0.0, 0.0)) -> Mechanism:
    """A finger as a mechanism, its cable under a tension [N] and a force (3,) on its tip [N]."""
    drives = {"finger": Drive(tension=tension)}
    mech = moving_hand({"finger": finger}, seats={"finger": Seat()}, drives=drives)
    mech.force("load", tip_marker(mech, finger), load)
    return mech


def tip_marker(mech: Mechanism, finger: Finger, name: str = "finger") -> Marker:
    """Marker of the tip of a finger."""
    return mech.parts[f"{name} phalanx {len(finger.phalanges)}"].marker("distal")


def deflections(
    finger: Finger, direction: npt.ArrayLike, forces: npt.ArrayLike, *, tension: float = 0.0
) -> Array:
    """(n, 3) way of the tip under forces (n,) [N] along a direction, from where it is without [m].

    The direction (3,) is in the world [1]; the tension of the cable is held [N].

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
