"""The mechanism as the user describes it: bodies, joints, drives and forces, by name."""

from collections.abc import Callable, Iterator, MutableMapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, Generic, Literal, TypeVar

import numpy as np
import numpy.typing as npt

from rom import rotation
from rom.arguments import AnyBody, finite, matrix33, start_pose, typed
from rom.arguments.quantities import Number, Omega, Orientation, Point, Positive, Velocity
from rom.errors import ConfigError
from rom.fields import Methods, Open, families, find
from rom.mbs.connections import drives as joint_drives
from rom.mbs.connections import lower_pairs, points
from rom.mbs.elements.family import Family
from rom.mbs.parts.bodies import GROUND, Marker, Part, flexible_part, ground_part, rigid_part
from rom.mbs.parts.joints import Joint, Row, coordinate_of
from rom.model import Array
from rom.names import check_known, check_name, check_text, offered
from rom.notebook import html_table, listed
from rom.plausible import GRAVITY, SPEED, warn_outside

Element = TypeVar("Element")


class ElementsOf(MutableMapping[str, Element]):
    """The elements of one kind in a mechanism, by name; they can be exchanged and removed."""

    def __init__(self, elements: dict[str, tuple[Family, Any]], record: type[Element]):
        self.elements, self.record = elements, record

    def __getitem__(self, name: str) -> Element:
        element: Element = self.elements[name][1]
        if not isinstance(element, self.record):
            raise KeyError(name)
        return element

    def __setitem__(self, name: str, element: Element) -> None:
        _ = self[name]  # only what is there can be exchanged
        self.elements[name] = self.elements[name][0], element

    def __delitem__(self, name: str) -> None:
        _ = self[name]  # of another kind it is not here
        del self.elements[name]

    def __iter__(self) -> Iterator[str]:
        return (name for name, (_, x) in self.elements.items() if isinstance(x, self.record))

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def __repr__(self) -> str:
        return repr(dict(self))


class Every(Generic[Element]):
    """Attribute of a mechanism: its elements of one kind."""

    def __init__(self, record: type[Element]):
        self.record = record

    def __get__(self, mechanism: "Mechanism | None", _: object = None) -> ElementsOf[Element]:
        return ElementsOf({} if mechanism is None else mechanism.elements, self.record)


def bound(found: type | Callable[..., object]) -> object:
    """What a field gives as an attribute: a method, or for a record its elements."""
    return Every(found) if isinstance(found, type) else typed(found)


@dataclass(frozen=True, slots=True)
class Event:
    """A function of the motion whose zeros are looked for."""

    function: Callable[..., object]  # of the time and an instant of the motion
    direction: int  # 1 for rising values, -1 for falling ones, 0 for both
    terminal: bool  # whether it ends the run
    markers: tuple[Marker, ...] = ()  # it asks for, beside those with names
    coordinates: tuple[tuple[str, Row], ...] = ()  # it asks for: joints and rows


@typed
@dataclass
class Mechanism(Methods, metaclass=Open, kind="methods", bound=bound):
    """Rigid and flexible bodies, connected and loaded.

    Joints are defined in the position in which the bodies are added, flexible bodies
    undeformed: axes are given in the world there, and joint coordinates count from there.

    Args:
        gravity: (3,) acceleration of gravity [m/s^2].

    Raises:
        ConfigError: if gravity is not three finite numbers; of all methods, for a name in use, a
            marker or joint that is not there, a body connected with itself, or no direction.
        ModelError: of joints with moments, if a body has free-free modes only, which carry none.

    Warns:
        RomWarning: for numbers legal but strange: gravity beyond that of all planets, an inertia
            far too large for the markers, stiffness or damping below zero.

    Example:
        >>> mech = rom.Mechanism(gravity=(0, 0, -9.81))
        >>> bob = mech.add_rigid("bob", mass=2.0, inertia=(1e-3,) * 3, at=(0.5, 0, 0))
        >>> list(mech.parts)
        ['bob']
    """

    gravity: Annotated[npt.ArrayLike, Number("m/s^2", (3,))] = (0.0, 0.0, -9.81)
    parts: dict[str, Part] = field(default_factory=dict, init=False)
    joints: dict[str, Joint] = field(default_factory=dict, init=False)
    drives: dict[str, joint_drives.Drive] = field(default_factory=dict, init=False)
    elements: dict[str, tuple[Family, Any]] = field(default_factory=dict, init=False)
    events: dict[str, Event] = field(default_factory=dict, init=False)
    fmus: dict[str, Any] = field(default_factory=dict, init=False)

    revolute = lower_pairs.revolute
    cylindrical = lower_pairs.cylindrical
    prismatic = lower_pairs.prismatic
    spherical = lower_pairs.spherical
    universal = points.universal
    fixed = lower_pairs.fixed
    planar = lower_pairs.planar
    screw = lower_pairs.screw
    point_on_line = points.point_on_line
    point_on_plane = points.point_on_plane
    distance = points.distance
    rolling = points.rolling
    gear = joint_drives.gear
    drive = joint_drives.drive

    def __post_init__(self) -> None:
        self.gravity = finite("gravity", self.gravity, (3,))
        warn_outside(GRAVITY, float(np.linalg.norm(self.gravity)))
        self.ground = ground_part()

    def __repr__(self) -> str:
        return f"Mechanism(bodies {listed(self.parts)}; joints {listed(self.joints)})"

    def _repr_html_(self) -> str:
        rows: list[tuple[object, ...]] = []
        for name, part in self.parts.items():
            kind = f"flexible, {part.r} elastic coordinates" if part.r else "rigid"
            rows.append((name, kind, part.mass, listed(part.names)))
        for name, joint in self.joints.items():
            markers = listed(f"{m.body}.{m.place}" for m in joint.markers)
            rows.append((name, joint.kind, "", markers))
        title = f"Mechanism of {len(self.parts)} bodies and {len(self.joints)} joints"
        return html_table(title, ("name", "kind", "mass [kg]", "markers"), rows)

    def add_rigid(  # noqa: PLR0913  one keyword per property of a body
        self,
        name: str,
        mass: Annotated[float, Positive("kg")],
        inertia: Annotated[npt.ArrayLike, Number("kg m^2", (3,), (3, 3))],
        at: Point,
        *,
        orientation: Orientation | None = None,
        markers: dict[str, Point] | None = None,
        velocity: Velocity | None = None,
        omega: Omega | None = None,
        spin: Omega | None = None,
    ) -> Part:
        """Add a rigid body; its frame sits at the mass centre.

        Args:
            name: name of the body.
            mass: mass [kg].
            inertia: (3,) or (3, 3) about the mass centre, body frame [kg m^2].
            at: (3,) mass centre at the start, world [m].
            orientation: (3, 3) matrix or (4,) quaternion [1], body to world; None for parallel.
            markers: {name: (3,) point from the mass centre, body frame [m]}.
            velocity: (3,) of the mass centre, world [m/s].
            omega: (3,) angular velocity, body frame [rad/s].
            spin: (3,) angular velocity in its frame, which stands, as in `add_flexible` [rad/s].

        Raises:
            ModelError: if mass or inertia are of no real body, or a body that spins is not round.

        Example:
            >>> mech = rom.Mechanism()
            >>> ends = {"a": (-0.1, 0, 0), "b": (0.1, 0, 0)}  # from the mass centre
            >>> solid = {"mass": 1.0, "inertia": (1e-5, 3e-3, 3e-3)}
            >>> rod = mech.add_rigid("rod", **solid, at=(1, 0, 0), markers=ends)
            >>> mech.design_point(rod.marker("b"))
            array([1.1, 0. , 0. ])
        """
        pose = start_pose(at, orientation, velocity, omega)
        places = {
            check_text(key, "a marker"): finite(f"marker {key}", x, (3,))
            for key, x in (markers or {}).items()
        }
        part = rigid_part(name, mass, matrix33("inertia", inertia), pose, places)
        return self._enter(part, spin)

    def add_flexible(  # noqa: PLR0913  one keyword per property of a body
        self,
        name: str,
        body: AnyBody,
        *,
        at: Point = (0.0, 0.0, 0.0),
        orientation: Orientation | None = None,
        velocity: Velocity | None = None,
        omega: Omega | None = None,
        q: Annotated[npt.ArrayLike, Number("1", (None,))] | None = None,
        qd: Annotated[npt.ArrayLike, Number("1", (None,))] | None = None,
        spin: Omega | None = None,
    ) -> Part:
        """Add a flexible body.

        Args:
            name: name of the body in this mechanism.
            body: with r elastic coordinates; one of other units is converted to SI.
            at: (3,) origin of its frame at the start, world [m].
            orientation: (3, 3) matrix or (4,) quaternion [1], body to world; None for parallel.
            velocity: (3,) of the origin, world [m/s].
            omega: (3,) angular velocity of the frame, body frame [rad/s].
            q: (r,) elastic coordinates at the start, in units of the shapes; None for undeformed.
            qd: (r,) their rates, in the units of q per second.
            spin: (3,) angular velocity [rad/s] with which the material of a round body turns
                through the frame, which does not: shafts that bend under a load rest, whirl and
                vibrate in it as in space. Something outside keeps that speed. Gyroscopic forces
                are those of small displacements; films, teeth and rolling bearings know of it.

        Raises:
            ModelError: if the mass matrix of the body is singular: rigid motions left in it; or a
                body that spins is not round, or one of large deflection, or such a one has
                geometric stiffness.

        Example:
            >>> mech = rom.Mechanism()
            >>> beam = mech.add_flexible("beam", rom.load("beam.rom.npz"))
            >>> round(beam.mass, 6)
            11.775
        """
        if getattr(body, "certificate", None) is not None:
            body.certificate.warn_of_failures(f"the certificate of body {body.name!r}")
        body = body.in_units("SI") if getattr(body, "units", "SI") != "SI" else body
        r = body.K.shape[0]
        elastic = (
            finite("q", np.zeros(r) if q is None else q, (r,)),
            finite("qd", np.zeros(r) if qd is None else qd, (r,)),
        )
        pose = start_pose(at, orientation, velocity, omega)
        # as it is integrated, one for all parts that are the same body
        same = (part.moving for part in self.parts.values() if part.flexible is body)
        moving = next(same, None) or body.on_mean_axes()
        return self._enter(flexible_part(name, body, moving, pose, elastic), spin)

    def add(self, name: str, element: object, family: Family) -> None:
        """Add an element of any family, one of your own too.

        Args:
            name: name of the element.
            element: of the class that the family has for one of its elements.
            family: see `rom.mbs.elements.family`.

        Raises:
            ConfigError: for a name in use, a marker that does not exist, or another family.
            ModelError: if it holds a body that spins beside its axis.
        """
        self.check_new(name)
        if not isinstance(element, family.record):
            wanted = f"of type {family.record.__name__}, as all {family.name}"
            raise ConfigError(f"element = {element!r} of {name!r} must be {wanted}.")
        ends = family.ends(element)
        self.check_markers(name, *ends)
        for marker in ends if len(ends) > 1 else ():  # a load acts at a place in space
            self.part(marker.body).check_on_axis(name, marker)
        self.elements[name] = family, element

    def families(self) -> dict[Family, dict[str, Any]]:
        """The families that occur, in the order of `rom.fields`, with their elements by name."""
        found: dict[Family, dict[str, Any]] = {}
        for name, (family, element) in self.elements.items():
            found.setdefault(family, {})[name] = element
        known = families(loaded=True) if len(found) > 1 else ()
        return {family: found.pop(family) for family in known if family in found} | found

    def event(
        self,
        name: str,
        function: Callable[..., object],
        *,
        direction: Literal[-1, 0, 1] = 0,
        terminal: bool = False,
        follow: Sequence[Marker | str | tuple[str, str]] = (),
    ) -> None:
        """Look for the times at which ``function(t, instant)`` passes through zero.

        Args:
            name: key of ``solution.events``.
            function: of the time and of an `rom.mbs.integrate.events.Instant`, which knows
                positions and velocities; looked at after every step, so that two zeros within one
                step are not seen.
            direction: 1 counts rising values only, -1 falling ones, 0 both.
            terminal: end the run there.
            follow: what the function asks the instant for beyond markers with names and markers in
                use: markers, joints, or pairs of a joint and its "angle" or "displacement".

        Raises:
            ConfigError: for a marker, joint or coordinate that is not there.
        """
        self.check_new(name)
        markers = tuple(one for one in follow if isinstance(one, Marker))
        self.check_markers(name, *markers)
        named = [(one, None) if isinstance(one, str) else one for one in follow]
        rows = tuple(
            (joint, coordinate_of(self.joints, joint, which, f"event {name!r}"))
            for joint, which in (one for one in named if not isinstance(one, Marker))
        )
        self.events[name] = Event(function, int(direction), bool(terminal), markers, rows)

    def design_point(self, marker: Marker) -> Array:
        """(3,) position of a marker where its body was added, undeformed [m].

        Raises:
            ConfigError: if the body is unknown.
        """
        part = self.part(marker.body)
        return part.at + rotation.matrix(part.p) @ part.point(marker)

    def marker(self, place: str) -> Marker:
        """The marker "body.place", as files name it; "body" or "ground" is the origin of its frame.

        Every method that takes a marker takes such a text too.

        Raises:
            ConfigError: if there is no such body, or the body has no such marker.

        Example:
            >>> mech = rom.Mechanism()
            >>> ball = mech.add_rigid("ball", mass=1, inertia=(1, 1, 1), at=(0, 0, 0),
            ...                       markers={"hook": (0, 0, 0.1)})
            >>> mech.spherical("hung", "ground", "ball.hook")
            >>> mech.marker("ball.hook")
            Marker(body='ball', place='hook')
        """
        bodies = {GROUND: self.ground} | self.parts
        body = max((b for b in bodies if f"{place}.".startswith(f"{b}.")), key=len, default="")
        if body:
            return bodies[body].marker(place[len(body) + 1 :] or (0.0, 0.0, 0.0))
        body, _, where = place.partition(".")
        if body in self.nonlinear:
            return self.nonlinear[body].marker(int(where) if where.isdecimal() else where)
        return self.part(body).marker(where)

    def part(self, name: str) -> Part:
        """The body of a name.

        Raises:
            ConfigError: listing the names that exist.
        """
        if name == GROUND:
            return self.ground
        check_known(name, self.parts, f"no body {name!r}; the mechanism has")
        return self.parts[name]

    def _enter(self, part: Part, spin: npt.ArrayLike | None) -> Part:
        self.check_new(part.name)
        warn_outside(SPEED, float(np.linalg.norm(part.velocity)), f"body {part.name!r}")
        part = part if spin is None else replace(part, spin=finite("spin", spin, (3,)))
        large = getattr(part.flexible, "quartic", None) is not None
        kinds = ["deflection"] * large + ["spin"] * bool(part.spin.any())
        more = {f"{kind} of {part.name}": find("bodies", kind)(part) for kind in kinds}
        self.parts[part.name] = part
        for name, element in more.items():
            self.add(name, *element)
        return part

    def check_new(self, name: str) -> None:
        """Refuse a name that is no name, or in use.

        Raises:
            ConfigError: listing the names in use.
        """
        check_name(name, "a part of the mechanism")
        taken = [GROUND, *self.parts, *self.joints, *self.drives, *self.elements, *self.events]
        taken += self.fmus
        if name in taken:
            raise ConfigError(f"name {name!r} is used twice; in use are {offered(taken, name)}.")

    def check_markers(self, name: str, *markers: Marker) -> None:
        """Refuse markers of bodies that are not in this mechanism, or of places they have not.

        Raises:
            ConfigError: naming what there is.
        """
        for marker in markers:
            self.part(marker.body).point(marker)

    def check_apart(self, name: str, m1: Marker, m2: Marker) -> None:
        """Refuse to connect a body with itself; markers as `check_markers`.

        Raises:
            ConfigError: naming the body.
        """
        self.check_markers(name, m1, m2)
        if m1.body == m2.body:
            text = f"{name!r} connects body {m1.body!r} with itself"
            raise ConfigError(f"{text}; give another one, such as mech.ground.marker((0, 0, 0)).")
