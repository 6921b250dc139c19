"""The keys of a mechanism file."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar, NamedTuple

from rom.arguments import Positive, Quantity, Whole
from rom.config.expressions import FormulaTable, formula_keys, formula_kind
from rom.config.keys import (
    Either,
    FilePath,
    Flag,
    Key,
    Kind,
    Named,
    Place,
    Table,
    Text,
    Variants,
    Words,
    as_text,
    read_value,
)
from rom.config.laws import ByCoordinate, law_kind
from rom.config.python_files import PYTHON_KEYS
from rom.errors import UnknownNameError
from rom.fields import find, names

POINT, DIRECTION = Quantity("m", ((3,),)), Quantity("1", ((3,),))


@dataclass(frozen=True, slots=True)
class MarkerName:
    """A marker: "body.marker", or a point of a rigid body or the ground."""

    summary: str = (
        '"body.marker", or { body = [x, y, z] } for a point of the ground or a rigid body'
    )

    def read(self, value: Any, place: Place) -> tuple[str, Any]:
        """Name of the body, and name or coordinates of the marker."""
        if isinstance(value, Mapping) and len(value) == 1:
            ((body, point),) = value.items()
            return body, read_value(POINT, point, place.at(body))
        if isinstance(value, str) and "." in value.strip("."):
            body, _, marker = value.partition(".")
            return body, marker
        raise place.error(
            f"{place.name} = {as_text(value)} is no marker.",
            'Write "body.marker", or { ground = [x, y, z] }.',
        )


@dataclass(frozen=True, slots=True)
class Markers:
    """Markers of any bodies, at least one; or two of different bodies."""

    two: bool = False

    @property
    def summary(self) -> str:
        """How they are written."""
        many = "list of two markers" if self.two else "list of markers"
        return many + ', each "body.marker" or { body = [x, y, z] }'

    def read(self, value: Any, place: Place) -> list[tuple[str, Any]]:
        """All of them."""
        if not isinstance(value, list) or not value or (self.two and len(value) != 2):
            what = "two markers are" if self.two else "a list of markers is"
            raise place.error(f"{place.name} = {as_text(value)}: {what} needed.")
        return [MarkerName().read(item, place) for item in value]


POSE = (
    Key("orientation", Either(Quantity("1", ((4,), (3, 3))), Table("A rotation.", (
        Key("axis", DIRECTION, "Axis.", ...),
        Key("angle", Quantity("rad"), "Angle, right-handed.", ...),
    ))), "Body to world: quaternion (scalar first), matrix, or { axis, angle }; none if missing."),
    Key("velocity", Quantity("m/s", ((3,),)), "At the start, in the world; at rest if missing."),
    Key("omega", Quantity("rad/s", ((3,),)), "Angular velocity at the start, in the body frame."),
)  # fmt: skip
SPIN = Key(
    "spin", Quantity("rad/s", ((3,),)),
    "Angular velocity of a round body in its frame, which does not turn with it.",
)  # fmt: skip
RIGID = Table("A rigid body by its numbers; its frame sits at the mass centre.", (
    Key("mass", Positive("kg"), "Mass.", ...),
    Key("inertia", Quantity("kg m^2", ((3,), (3, 3))), "About the mass centre, body frame.", ...),
    Key("at", POINT, "Mass centre at the start.", ...),
    *POSE,
    SPIN,
    Key("markers", Named(POINT, "points"), "Points from the mass centre, body frame.", {}),
))  # fmt: skip
FROM_FILE = Table("A body from a file; its frame is that of its geometry.", (
    Key("file", FilePath(), "A body file `.rom.npz`, or a component file `.toml`.", ...),
    Key("rigid", Flag(), "Take mass, inertia and interfaces of it only.", False),
    Key("reference", Words(), "Another floating frame, see the component file."),
    Key("at", POINT, "Origin of its frame at the start.", [0.0, 0.0, 0.0]),
    *POSE,
    SPIN,
    Key("q", Quantity("1", ((None,),)), "Elastic coordinates at the start; zero if missing."),
    Key("qd", Quantity("1", ((None,),)), "Their rates at the start; zero if missing."),
))  # fmt: skip


@dataclass(frozen=True, slots=True)
class Body:
    """A body: rigid by its numbers, or from a file."""

    parts: ClassVar[dict[str, Table]] = {"rigid": RIGID, "from a file": FROM_FILE}
    summary: str = "table with a file, or with mass and inertia"

    def read(self, value: Any, place: Place) -> dict[str, Any]:
        """Its values."""
        from_file = isinstance(value, Mapping) and "file" in value
        return (FROM_FILE if from_file else RIGID).read(value, place)


BETWEEN = Key(
    "between",
    Markers(two=True),
    "Its markers; forces and coordinates are those of the second.",
    ...,
)
AXIS = Key("axis", DIRECTION, "In the world at the start.", ...)
NORMAL = Key("normal", DIRECTION, "In the world at the start.", ...)
COORDINATES = ("angle", "displacement", "way")  # the last is the earlier name of the second
JOINTS = {
    "revolute": Table("A hinge.", (BETWEEN, AXIS)),
    "cylindrical": Table("Turns about and slides along an axis.", (BETWEEN, AXIS)),
    "prismatic": Table("Slides along an axis.", (BETWEEN, AXIS)),
    "spherical": Table("A ball joint.", (BETWEEN,)),
    "universal": Table("A Cardan joint.", (
        BETWEEN,
        Key("axis1", DIRECTION, "On the first body.", ...),
        Key("axis2", DIRECTION, "On the second body, perpendicular.", ...),
    )),
    "fixed": Table("A weld.", (BETWEEN,)),
    "planar": Table("Slides in a plane and turns about its normal.", (BETWEEN, NORMAL)),
    "screw": Table("Advances as it turns.", (
        BETWEEN, AXIS, Key("pitch", Quantity("m"), "Advance per turn.", ...),
    )),
    "point_on_line": Table("A point on a line of the first body.", (BETWEEN, AXIS)),
    "point_on_plane": Table("A point in a plane of the first body.", (BETWEEN, NORMAL)),
    "distance": Table("A massless rod.", (
        BETWEEN,
        Key("length", Positive("m"), "That at the start if missing."),
    )),
    "rolling": Table("A ball or wheel that rolls on a plane.", (
        BETWEEN, NORMAL,
        Key("radius", Positive("m"), "Of ball or wheel.", ...),
        Key("axis", DIRECTION, "Of a wheel; none for a ball."),
    )),
    "gear": Table("Couples the coordinates of two joints.", (
        Key("joint1", Text(), "Driving joint.", ...),
        Key("joint2", Text(), "Driven joint.", ...),
        Key("ratio", Quantity(), "Coordinate 2 over coordinate 1 [rad/rad, m/rad, ...].", ...),
        Key("coordinate1", Text(COORDINATES), "Which, where a joint has two."),
        Key("coordinate2", Text(COORDINATES), "Likewise."),
    )),
}  # fmt: skip
JOINT = Key("joint", Text(), "Name of the joint.", ...)
WHICH = Key("coordinate", Text(COORDINATES), "Which, where the joint has two.")
LEVEL = ByCoordinate(Quantity("N m"), Quantity("N"))
SPEED = ByCoordinate(Positive("rad/s"), Positive("m/s"))
WAY = ByCoordinate(Quantity("rad"), Quantity("m"))
IMPACT = (
    Key("stiffness", Positive("1"),
        "Force per depth^exponent, a plain number in SI.", ...),
    Key("exponent", Positive("1"), "1 for linear, 1.5 for Hertz.", 1.5),
    Key("damping", Quantity("s/m"), "Force grows by this factor of the closing speed.", 0.0),
    Key("restitution", Positive("1"), "In place of damping, with impact_speed."),
    Key("impact_speed", Positive("m/s"), "At which restitution holds."),
    Key("mu", Quantity("1"), "Coefficient of friction.", 0.0),
    Key("transition_speed", Positive("m/s"), "Over which friction turns.", 1e-3),
    Key("tangential_stiffness", Positive("1"),
        "Of a spring by which friction holds, in SI; friction by the speed alone if missing."),
    Key("tangential_damping", Quantity("1"), "Of that spring, a plain number in SI.", 0.0),
)  # fmt: skip
RADIUS = Positive("m")
STEEL = (
    Key("E", Positive("Pa"), "Young's modulus.", 206e9),
    Key("nu", Quantity(), "Poisson's ratio.", 0.3),
)
FLEXIBLE = Key("body", Text(), "Flexible body that carries a surface.", ...)
WHERE = Key("where", Text(), "Deformable interface that is the part of it; all of it if missing.")
COVER = (
    Key("marker", MarkerName(), "Where the other surface is.", ...), FLEXIBLE, WHERE,
    Key("stiffness", Positive("1"),
        "Pressure per depth^exponent, a plain number in SI.", ...),
    *IMPACT[1:],
)  # fmt: skip
CONTACTS = {
    "sphere_on_plane": Table("A sphere about the second marker, a plane through the first.", (
        BETWEEN, NORMAL, Key("radius", RADIUS, "Of the sphere.", ...), *IMPACT,
    )),
    "disc_on_plane": Table("The rim of a disc about the second marker on such a plane.", (
        BETWEEN, NORMAL, AXIS, Key("radius", RADIUS, "Of the disc.", ...), *IMPACT,
    )),
    "sphere_on_sphere": Table("Spheres about both markers.", (
        BETWEEN, Key("radius1", RADIUS, "First one.", ...),
        Key("radius2", RADIUS, "Second one.", ...), *IMPACT,
    )),
    "sphere_on_cylinder": Table("A sphere about the second marker, a cylinder about the first.", (
        BETWEEN, AXIS, Key("radius1", RADIUS, "Of the cylinder.", ...),
        Key("radius2", RADIUS, "Of the sphere.", ...),
        Key("inside", Flag(), "Whether it is in the bore.", False), *IMPACT,
    )),
    "capsule_on_capsule": Table("Round bars with round ends about both markers, or spheres.", (
        BETWEEN, Key("radius1", RADIUS, "First one.", ...),
        Key("radius2", RADIUS, "Second one.", ...),
        Key("axis1", DIRECTION, "Of the first one, world at the start; missing for a sphere."),
        Key("axis2", DIRECTION, "Of the second one."),
        Key("length1", Quantity("m"), "Between the middles of its ends.", 0.0),
        Key("length2", Quantity("m"), "Of the second one.", 0.0), *IMPACT,
    )),
    "surface_on_plane": Table("The surface of a body on a plane through the marker.", (
        *COVER, Key("normal", DIRECTION, "Towards the body, world at the start.", ...),
    )),
    "surface_on_sphere": Table("The surface of a body on a sphere about the marker.", (
        *COVER, Key("radius", RADIUS, "Of the sphere.", ...),
    )),
    "surface_on_cylinder": Table("The surface of a body on a cylinder about the marker.", (
        *COVER, AXIS, Key("radius", RADIUS, "Of the cylinder.", ...),
        Key("inside", Flag(), "Whether it is in the bore.", False),
    )),
}  # fmt: skip
MARKER = Key("marker", MarkerName(), "Where it acts.", ...)
FRAME = Key("frame", Text(("world", "body")), "Axes of the vector.", "world")
FACTOR = Key("factor", law_kind("1"), "A law that multiplies the vector; constant if missing.")
MOTION = ("t", "x", "v")
SPREAD_LOADS = {
    "pressure": Table("A pressure on the surface of a body, pushing inwards.", (
        FLEXIBLE, Key("pressure", Quantity("Pa"), "Pressure.", ...), WHERE,
    )),
    "traction": Table("A force per area on the surface of a body.", (
        FLEXIBLE, Key("traction", Quantity("Pa", ((3,),)), "Force per area.", ...), WHERE,
    )),
    "acceleration": Table("A force per mass on all of a body.", (
        Key("body", Text(), "Flexible body.", ...),
        Key("acceleration", Quantity("m/s^2", ((3,),)), "Force per mass.", ...),
    )),
}  # fmt: skip
SPREAD_KEYS = (
    FACTOR,
    Key("frame", Text(("body", "world")), "Axes in which it keeps its direction.", "body"),
)
MANY = Key("markers", Markers(), "On which it acts.", ...)
LAWS = {
    "line": formula_kind("N", MOTION, "A force along the line between two markers, positive when "
                         "it pushes them apart: x is its length, v its rate.", BETWEEN),
    "points": Table("The same by points; it goes on straight beyond them.", (
        BETWEEN,
        Key("x", Quantity("m", ((None,),)), "Lengths, ascending.", ...),
        Key("values", Quantity("N", ((None,),)), "Forces there.", ...),
        Key("interpolation", Text(("monotone", "cubic")), "Nowhere beyond neighbours, or of "
            "continuous curvature.", "monotone"),
    )),
    "python": Table("A law in Python between any markers, as `mechanism.law` takes it.", (
        MANY, *PYTHON_KEYS,
        Key("memory", Quantity("1", ((None,),)), "Numbers it remembers, at the start.", []),
        Key("outputs", Words(), "Names of its own outputs.", ()),
        Key("energy", Flag(), "Whether it tells stored energy and lost power.", False),
    )),
    "user_force": Table("A force and moment in Python, as `mechanism.user_force` takes it.", (
        MANY, *PYTHON_KEYS,
    )),
}  # fmt: skip
PASSES = (
    *(key for key in formula_keys("1", MOTION) if key.name == "constants"),
    Key("expression", Text(), "Formula of t, the measured x and its rate v whose zeros are looked "
        "for, in place of a value."),
)  # fmt: skip
WHEN = (
    Key("direction", Text(("rising", "falling", "both")), "Which way it passes.", "both"),
    Key("terminal", Flag(), "Whether the run ends there.", False),
)  # fmt: skip
EVENTS = {
    "coordinate": FormulaTable("A joint coordinate passes a value.", (
        JOINT, WHICH, Key("value", WAY, "Value."), *PASSES, *WHEN,
    ), MOTION),
    "position": FormulaTable("A marker passes a plane.", (
        MARKER, Key("axis", DIRECTION, "Along which its position is measured, in the world.", ...),
        Key("value", Quantity("m"), "Position."), *PASSES, *WHEN,
    ), MOTION),
    "distance": FormulaTable("Two markers are so far apart.", (
        BETWEEN, Key("value", Quantity("m"), "Distance."), *PASSES, *WHEN,
    ), MOTION),
    "python": Table("A function of (t, instant) in Python, as `mechanism.event` takes it.", (
        Key("markers", Markers(), "It asks for, beyond those with names."), *PYTHON_KEYS, *WHEN,
    )),
}  # fmt: skip


class Section(NamedTuple):
    """A section of a mechanism file.

    Attributes:
        about: what its entries are.
        kind: how they are written.
        connect: what an `Entry` of it does, see `rom.config.connections`.
        bodies: whether they are bodies, which markers name.
        summary: a sentence about them, where there is more to say.
    """

    about: str
    kind: Kind
    connect: Callable[[Any], None] | None = None
    bodies: bool = False
    summary: str = ""

    def key(self, name: str) -> Key:
        """The section as a key of the file."""
        summary = self.summary or f"{self.about.capitalize()}."
        return Key(name, Named(self.kind, self.about), summary, {})


BEFORE_FIELDS: dict[str, tuple[str, Kind]] = {  # connections and forces: what, and how
    "joints": ("joints", Variants(JOINTS)),
    "drives": ("prescribed joint coordinates", Table("A joint coordinate prescribed in time.", (
        JOINT,
        Key("law", ByCoordinate(law_kind("rad"), law_kind("m")), "Coordinate over time.", ...),
    ))),
    "motors": ("forces along joint coordinates", Table("A torque or force along a coordinate.", (
        JOINT, WHICH,
        Key("law", ByCoordinate(law_kind("N m", MOTION), law_kind("N", MOTION)),
            "Force over time; formulas and Python also by coordinate x and rate v.", ...),
    ))),
    "springs": ("springs and dampers between markers", Table("A spring and damper.", (
        BETWEEN,
        Key("stiffness", Quantity("N/m"), "Stiffness.", 0.0),
        Key("damping", Quantity("N s/m"), "Damping.", 0.0),
        Key("free_length", Quantity("m"), "Length without force; that at the start if missing."),
    ))),
    "rotational_springs": ("springs about joints", Table("A spring and damper about a joint.", (
        JOINT,
        Key("stiffness", Quantity("N m/rad"), "Stiffness.", 0.0),
        Key("damping", Quantity("N m s/rad"), "Damping.", 0.0),
        Key("free_angle", Quantity("rad"), "Angle without torque.", 0.0),
    ))),
    "bushings": ("bushings", Table("Six springs and dampers between two markers.", (
        BETWEEN,
        Key("stiffness", Quantity("N/m", ((3,),)), "Along x, y, z.", ...),
        Key("turning_stiffness", Quantity("N m/rad", ((3,),)), "About them.", [0.0, 0.0, 0.0]),
        Key("damping", Quantity("N s/m", ((3,),)), "Along them.", [0.0, 0.0, 0.0]),
        Key("turning_damping", Quantity("N m s/rad", ((3,),)), "About them.", [0.0, 0.0, 0.0]),
        Key("axes", Quantity("1", ((4,), (3, 3))), "Axes to world at the start; world if missing."),
    ))),
}  # fmt: skip
BEHIND_FIELDS: dict[str, tuple[str, Kind]] = {
    "forces": ("forces", Table("A force on a marker.", (
        MARKER, Key("vector", Quantity("N", ((3,),)), "The force.", ...), FACTOR, FRAME,
    ))),
    "torques": ("torques", Table("A torque on a marker.", (
        MARKER, Key("vector", Quantity("N m", ((3,),)), "The torque.", ...), FACTOR, FRAME,
    ))),
    "frictions": ("friction in joints", Table("Dry and viscous friction along a coordinate.", (
        JOINT, WHICH,
        Key("transition_speed", SPEED, "Over which it changes its sign.", ...),
        Key("coulomb", LEVEL, "Level that is always there."),
        Key("mu", Quantity(), "Coefficient of friction, times the force in the joint.", 0.0),
        Key("radius", RADIUS, "Of the pin, for mu on an angle."),
        Key("static", Quantity(), "Level at rest over that of fast motion.", 1.0),
        Key("stribeck_speed", SPEED, "Over which this fades."),
        Key("viscous", ByCoordinate(Quantity("N m s/rad"), Quantity("N s/m")), "Viscous part."),
    ))),
    "stops": ("stops of joints", Table("Compliant limits of a joint coordinate.", (
        JOINT, WHICH, Key("lower", WAY, "Lower limit."), Key("upper", WAY, "Upper limit."), *IMPACT,
    ))),
    "contacts": ("contacts", Variants(CONTACTS)),
    "spread_loads": ("loads spread over bodies", Variants({
        kind: Table(table.about, (*table.keys, *SPREAD_KEYS))
        for kind, table in SPREAD_LOADS.items()
    }, {kind: kind for kind in SPREAD_LOADS})),
    "laws": ("laws of force", Variants(LAWS, {
        "expression": "line", "values": "points", "function": "python",
    })),
    "events": ("events", Variants(EVENTS, {"function": "python"})),
}  # fmt: skip
SIMULATION = Table("How it is moved.", (
    Key("t_end", Positive("s"), "End.", ...),
    Key("dt", Positive("s"), "Step, or interval of dop853; by rtol if missing."),
    Key("method", Text(("generalized-alpha", "bdf", "dop853")), "Integrator.", "generalized-alpha"),
    Key("rho_inf", Quantity(), "Spectral radius at infinite frequency, 0 to 1.", 0.9),
    Key("tolerance", Positive("1"), "Of the Newton iteration.", 1e-9),
    Key("rtol", Positive("1"), "Relative tolerance of variable steps."),
    Key("save_every", Whole(1), "Keep every so many steps.", 1),
    Key("order", Whole(1, 5), "Of bdf.", 2),
    Key("stabilised", Flag(), "Keep constraints of the velocities, too.", False),
    Key("assemble", Flag(), "Move the start to where joints and drives want it.", False),
))  # fmt: skip
OUTPUT = Table("What `rom simulate` writes beside the table `motion.csv`.", (
    Key("history", Text(("csv", "h5")), "Form of the table of all motions, loads and energies.",
        "csv"),
    Key("film", Text(("gif", "mp4", "glb", "vtkhdf")),
        "A film: pictures, pictures by ffmpeg, to turn around in browsers, ParaView."),
    Key("picture", Flag(), "A picture of four instants.", False),
    Key("plot", Words(), "Columns of the table to draw over time, without their unit.", ()),
    Key("magnify", Positive("1"), "Deformations are drawn so much larger.", 1.0),
    Key("view", DIRECTION, "Direction to the eye."),
    Key("up", DIRECTION, "Upright direction."),
))  # fmt: skip
BEFORE_BODIES = (
    Key("name", Text(), "Its name; that of the file if missing."),
    Key("gravity", Quantity("m/s^2", ((3,),)), "Acceleration of gravity.", [0.0, 0.0, -9.81]),
    Key("bodies", Named(Body(), "bodies"), "What moves, beside rods.", {}),
)
GROUND_POINTS = Key("ground", Named(POINT, "points"), "Named points of the ground.", {})
HOW = (
    Key("simulation", SIMULATION, "How it is moved.", ...),
    Key("output", OUTPUT, "What is written.", {}),
)


@cache
def sections() -> dict[str, Section]:
    """Sections of the core and, between them, those of all fields that are here."""
    of_fields = {}
    for name in names("sections"):
        with suppress(UnknownNameError):  # told where a file has the section
            of_fields[name] = find("sections", name)
    first, last = ({name: Section(*one) for name, one in some.items()}
                   for some in (BEFORE_FIELDS, BEHIND_FIELDS))  # fmt: skip
    return first | of_fields | last


@cache
def mechanism_table() -> Table:
    """All keys of a mechanism file."""
    bodies, others = ([one.key(name) for name, one in sections().items() if one.bodies is which]
                      for which in (True, False))  # fmt: skip
    return Table("A mechanism.", (*BEFORE_BODIES, *bodies, GROUND_POINTS, *others, *HOW))
