"""The mechanism as the user describes it: bodies, joints, drives and forces, by name."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from rom import rotation
from rom.arguments import AnyBody, finite, matrix33, number, positive, start_pose, typed
from rom.errors import ConfigError
from rom.mbs.connections import Connections, Drive, TimeFunction
from rom.mbs.elements.force_elements import Bushing, Contact, Elements, Spread
from rom.mbs.elements.joint_forces import Friction, JointForces, Motor, Stop
from rom.mbs.elements.nonlinear import Assembly, NonlinearBodies
from rom.mbs.elements.surface_contact import SurfaceContacts
from rom.mbs.parts.bodies import GROUND, Marker, Part, flexible_part, ground_part, rigid_part
from rom.mbs.parts.joints import Joint
from rom.model import Array
from rom.names import check_name, check_text
from rom.notebook import html_table, listed
from rom.plausible import DAMPING, GRAVITY, SPEED, STIFFNESS, warn_outside


@dataclass(frozen=True, slots=True)
class Spring:
    """Spring and damper between two markers, along the line that joins them."""

    i: Marker
    j: Marker
    stiffness: float
    damping: float
    free_length: float


@dataclass(frozen=True, slots=True)
class Turn:
    """Rotational spring and damper about the axis of a joint."""

    joint: str
    stiffness: float
    damping: float
    free_angle: float


@dataclass(frozen=True, slots=True)
class Load:
    """Force or torque on one marker: constant, or a function of time."""

    marker: Marker
    kind: int
    vector: Array
    function: TimeFunction | None


@dataclass(frozen=True, slots=True)
class UserForce:
    """Force and moment from a Python function of time and of the markers' motion."""

    function: Callable[..., Any]
    i: Marker
    j: Marker | None


@dataclass(frozen=True, slots=True)
class Event:
    """A function of the motion whose zeros are looked for."""

    function: Callable[..., Any]
    direction: int
    terminal: bool


@typed
@dataclass
class Mechanism(Connections, JointForces, Elements, SurfaceContacts, NonlinearBodies):
    """Rigid and flexible bodies, connected and loaded.

    Joints are defined in the position in which the bodies are added, flexible bodies
    undeformed: axes are given in the world there, and joint coordinates count from there.

    Args:
        gravity: (3,) acceleration of gravity [m/s^2].

    Warns:
        RomWarning: for numbers legal but strange: gravity beyond that of all planets, an inertia
            far too large for the markers, stiffness or damping below zero.
    """

    gravity: npt.ArrayLike = (0.0, 0.0, -9.81)
    parts: dict[str, Part] = field(default_factory=dict, init=False)
    nonlinear: dict[str, Assembly] = field(default_factory=dict, init=False)
    joints: dict[str, Joint] = field(default_factory=dict, init=False)
    drives: dict[str, Drive] = field(default_factory=dict, init=False)
    springs: dict[str, Spring] = field(default_factory=dict, init=False)
    turns: dict[str, Turn] = field(default_factory=dict, init=False)
    loads: dict[str, Load] = field(default_factory=dict, init=False)
    user_forces: dict[str, UserForce] = field(default_factory=dict, init=False)
    events: dict[str, Event] = field(default_factory=dict, init=False)
    motors: dict[str, Motor] = field(default_factory=dict, init=False)
    frictions: dict[str, Friction] = field(default_factory=dict, init=False)
    stops: dict[str, Stop] = field(default_factory=dict, init=False)
    bushings: dict[str, Bushing] = field(default_factory=dict, init=False)
    contacts: dict[str, Contact] = field(default_factory=dict, init=False)
    spread_loads: dict[str, Spread] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        self.gravity = finite("gravity", self.gravity, (3,))
        warn_outside(GRAVITY, float(np.linalg.norm(self.gravity)))
        self.ground = ground_part()

    def __repr__(self) -> str:
        return f"Mechanism(bodies {listed(self.parts)}; joints {listed(self.joints)})"

    def _repr_html_(self) -> str:
        kinds = [(name, f"flexible, {p.r} elastic coordinates" if p.r else "rigid", p.mass,
                  listed(p.names)) for name, p in self.parts.items()]  # fmt: skip
        ends = [(name, j.kind, "", listed(f"{m.body}.{m.place}" for m in j.markers))
                for name, j in self.joints.items()]  # fmt: skip
        title = f"Mechanism of {len(self.parts)} bodies and {len(self.joints)} joints"
        return html_table(title, ("name", "kind", "mass [kg]", "markers"), [*kinds, *ends])

    def add_rigid(  # noqa: PLR0913  one keyword per property of a body
        self,
        name: str,
        *,
        mass: float,
        inertia: npt.ArrayLike,
        at: npt.ArrayLike,
        orientation: npt.ArrayLike | None = None,
        markers: dict[str, npt.ArrayLike] | None = None,
        velocity: npt.ArrayLike | None = None,
        omega: npt.ArrayLike | None = None,
    ) -> Part:
        """Add a rigid body; its frame sits at the mass centre.

        Args:
            name: name of the body.
            mass: mass [kg].
            inertia: (3,) or (3, 3) about the mass centre, body frame [kg m^2].
            at: (3,) mass centre at the start, world [m].
            orientation: (3, 3) matrix or (4,) quaternion, body to world; None for parallel.
            markers: {name: (3,) point from the mass centre, body frame [m]}.
            velocity: (3,) of the mass centre, world [m/s].
            omega: (3,) angular velocity, body frame [rad/s].

        Raises:
            ConfigError: for a name in use, a wrong shape or a number that is not finite.
            ModelError: if mass or inertia are not those of a real body.
        """
        pose = start_pose(at, orientation, velocity, omega)
        points = {
            check_text(key, "a marker"): finite(f"marker {key}", x, (3,))
            for key, x in (markers or {}).items()
        }
        part = rigid_part(name, positive("mass", mass), matrix33("inertia", inertia), pose, points)
        return self._enter(part)

    def add_flexible(  # noqa: PLR0913  one keyword per property of a body
        self,
        name: str,
        body: AnyBody,
        *,
        at: npt.ArrayLike = (0.0, 0.0, 0.0),
        orientation: npt.ArrayLike | None = None,
        velocity: npt.ArrayLike | None = None,
        omega: npt.ArrayLike | None = None,
        q: npt.ArrayLike | None = None,
        qd: npt.ArrayLike | None = None,
    ) -> Part:
        """Add a flexible body.

        Args:
            name: name of the body in this mechanism.
            body: a ``FlexibleBody`` with r elastic coordinates; one of other units is converted
                to SI, in which a mechanism is.
            at: (3,) origin of its frame at the start, world [m].
            orientation: (3, 3) matrix or (4,) quaternion, body to world; None for parallel.
            velocity: (3,) of the origin, world [m/s].
            omega: (3,) angular velocity of the frame, body frame [rad/s].
            q: (r,) elastic coordinates at the start; None for undeformed.
            qd: (r,) their rates.

        Raises:
            ConfigError: for no body, a name in use, a wrong shape or a number that is not finite.
            ModelError: if the mass matrix of the body is singular: rigid motions left in it.
        """
        body = body.in_units("SI") if getattr(body, "units", "SI") != "SI" else body
        r = body.K.shape[0]
        elastic = (
            finite("q", np.zeros(r) if q is None else q, (r,)),
            finite("qd", np.zeros(r) if qd is None else qd, (r,)),
        )
        return self._enter(
            flexible_part(name, body, start_pose(at, orientation, velocity, omega), elastic)
        )

    def spring_damper(
        self,
        name: str,
        m1: Marker,
        m2: Marker,
        *,
        stiffness: float,
        damping: float = 0.0,
        free_length: float | None = None,
    ) -> None:
        """Spring [N/m] and damper [N s/m] along the line between two markers.

        Args:
            name: name of the spring.
            m1: one end.
            m2: other end.
            stiffness: [N/m].
            damping: [N s/m].
            free_length: length without force [m]; None for the length at the start.
        """
        self._check_new(name)
        self._check_markers(name, m1, m2)
        gap = self.design_point(m2) - self.design_point(m1)
        free = np.linalg.norm(gap) if free_length is None else number("free_length", free_length)
        k, c = self._stiffness_and_damping(name, stiffness, damping)
        if free < 0.0:
            raise ConfigError(f"free_length of {name!r} = {free:g} m: a length is not negative.")
        self.springs[name] = Spring(m1, m2, k, c, float(free))

    def rotational_spring(
        self,
        name: str,
        joint: str,
        *,
        stiffness: float,
        damping: float = 0.0,
        free_angle: float = 0.0,
    ) -> None:
        """Spring [N m/rad] and damper [N m s/rad] about the axis of a revolute joint."""
        self._check_new(name)
        if self._joint_with_axis(joint, "rotational spring").turn is None:
            raise ConfigError(f"joint {joint!r} does not turn: no rotational spring {name!r}.")
        k, c = self._stiffness_and_damping(name, stiffness, damping)
        self.turns[name] = Turn(joint, k, c, number("free_angle", free_angle))

    def force(self, name: str, marker: Marker, vector: Any, *, frame: str = "world") -> None:
        """Force at a marker: (3,) [N], or a function of time; axes of the world or the marker."""
        self._load(name, marker, vector, frame, 0)

    def torque(self, name: str, marker: Marker, vector: Any, *, frame: str = "world") -> None:
        """Torque at a marker: (3,) [N m], or a function of time; axes of world or marker."""
        self._load(name, marker, vector, frame, 2)

    def user_force(
        self, name: str, function: Callable[..., Any], m1: Marker, m2: Marker | None = None
    ) -> None:
        """Force law in Python: ``function(t, a)`` or ``function(t, a, b)``.

        ``a`` and ``b`` are `rom.mbs.equations.python_laws.MarkerMotion`. The function returns
        (force, moment) in the world that act on the first marker; the reaction, at the same place
        in space, acts on the body of the second one, so that momentum is conserved whatever the
        law.
        """
        self._check_new(name)
        self._check_markers(name, m1, *(() if m2 is None else (m2,)))
        self.user_forces[name] = UserForce(function, m1, m2)

    def event(
        self,
        name: str,
        function: Callable[..., Any],
        *,
        direction: int = 0,
        terminal: bool = False,
    ) -> None:
        """Look for the times at which ``function(t, instant)`` passes through zero.

        Args:
            name: key of ``solution.events``.
            function: of the time and of an `rom.mbs.integrate.events.Instant`, which knows
                positions and velocities; looked at after every step, so that two zeros within one
                step are not seen.
            direction: 1 counts rising values only, -1 falling ones, 0 both.
            terminal: end the run there.
        """
        self._check_new(name)
        if direction not in (-1, 0, 1):
            raise ConfigError(f"direction of event {name!r} is {direction!r}; it is -1, 0 or 1.")
        self.events[name] = Event(function, int(direction), bool(terminal))

    def design_point(self, marker: Marker) -> Array:
        """(3,) position of a marker where its body was added, undeformed [m]."""
        part = self.part(marker.body)
        return part.at + rotation.matrix(part.p) @ part.point(marker)

    def part(self, name: str) -> Part:
        """The body of a name.

        Raises:
            ConfigError: listing the names that exist.
        """
        if name == GROUND:
            return self.ground
        if name not in self.parts:
            raise ConfigError(f"no body {name!r}; the mechanism has {sorted(self.parts)}.")
        return self.parts[name]

    def _enter(self, part: Part) -> Part:
        self._check_new(part.name)
        warn_outside(SPEED, float(np.linalg.norm(part.velocity)), f"body {part.name!r}")
        self.parts[part.name] = part
        return part

    def _load(self, name: str, marker: Marker, vector: Any, frame: str, kind: int) -> None:
        self._check_new(name)
        self._check_markers(name, marker)
        if frame not in ("world", "body"):
            raise ConfigError(f"frame of {name!r} is {frame!r}; it is 'world' or 'body'.")
        function = vector if callable(vector) else None
        constant = np.zeros(3) if function else finite(f"vector of {name}", vector, (3,))
        self.loads[name] = Load(marker, kind + (frame == "body"), constant, function)

    def _stiffness_and_damping(
        self, name: str, stiffness: Any, damping: Any
    ) -> tuple[float, float]:
        k, c = number("stiffness", stiffness), number("damping", damping)
        warn_outside(STIFFNESS, k, repr(name))
        warn_outside(DAMPING, c, repr(name))
        return k, c

    def _check_new(self, name: str) -> None:
        check_name(name, "a part of the mechanism")
        taken = [
            *(GROUND, *self.parts, *self.nonlinear, *self.joints, *self.drives, *self.springs),
            *(*self.turns, *self.loads, *self.user_forces, *self.motors, *self.frictions),
            *(*self.stops, *self.bushings, *self.contacts, *self.spread_loads, *self.events),
        ]
        if name in taken:
            raise ConfigError(f"the name {name!r} is used twice; in use are {sorted(taken)}.")

    def _check_markers(self, name: str, *markers: Marker) -> None:
        for marker in markers:
            self.part(marker.body).point(marker)
