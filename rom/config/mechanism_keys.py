"""The keys of a mechanism file."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import cache
from typing import Any, NamedTuple

from rom.arguments import Ascending, NotNegative, Number, Positive, Quantity, shortened
from rom.config.declared import Declared
from rom.config.expressions import FormulaTable, formula_keys, formula_kind
from rom.config.keys import (
    Either,
    Flag,
    Key,
    Kind,
    Named,
    Place,
    Plain,
    Table,
    Text,
    Variants,
    file_path,
    read_value,
    words,
    written,
)
from rom.config.laws import ByCoordinate, law_kind
from rom.config.python_files import PYTHON_KEYS
from rom.errors import UnknownNameError
from rom.fields import find, names

POINT, DIRECTION = Quantity("m", ((3,),)), Quantity("1", ((3,),))


@written('"body.marker", or { body = [x, y, z] } for a point of the ground or a rigid body')
def marker_name(value: object, place: Place) -> tuple[str, object]:
    """Name of the body, and name or coordinates of the marker."""
    if isinstance(value, Mapping) and len(value) == 1:
        ((body, point),) = value.items()
        return body, read_value(POINT, point, place.at(body))
    if isinstance(value, str) and "." in value.strip("."):
        body, _, marker = value.partition(".")
        return body, marker
    raise place.error(
        f"{place.name} = {shortened(value)} is no marker.",
        'Write "body.marker", or { ground = [x, y, z] }.',
    )


def Markers(*, two: bool = False) -> Plain:
    """Markers of any bodies, at least one; or two of different bodies."""

    @written(f"list of {'two ' * two}markers" + ', each "body.marker" or { body = [x, y, z] }')
    def read(value: object, place: Place) -> list[tuple[str, object]]:
        if not isinstance(value, list) or not value or (two and len(value) != 2):
            needed = "two markers are" if two else "a list of markers is"
            place.refuse(value, f": {needed} needed")
        return [marker_name.read(item, place) for item in value]

    return read


ANGLE = Key("angle", Quantity("rad"), "Angle, right-handed.", ...)
ROTATION = Table("A rotation.", (Key("axis", DIRECTION, "Axis.", ...), ANGLE))
TURNED = "Body to world: quaternion (scalar first), matrix, or { axis, angle }."
ORIENTATION = Key("orientation", Either(Number("1", (4,), (3, 3)), ROTATION), TURNED)
RIGID = Declared(
    "add_rigid",
    ORIENTATION,
    Key("markers", Named(POINT, "points"), "Points from the mass centre, body frame.", {}),
)
FROM_FILE = Declared(
    "add_flexible",
    Key("file", file_path, "A body file `.rom.npz`, or a component file `.toml`.", ...),
    Key("rigid", Flag(), "Take mass, inertia and interfaces of it only.", False),
    Key("reference", words, "Another floating frame, see the component file."),
    ORIENTATION,
    about="A body from a file; its frame is that of its geometry.",
)


BODY = Variants({"rigid": RIGID, "from a file": FROM_FILE}, {"file": "from a file"}, "rigid")
BETWEEN = Key(
    "between",
    Markers(two=True),
    "Its markers; forces and coordinates are those of the second.",
    ...,
)
JOINT = Key("joint", Text(), "Name of the joint.", ...)
MOVING = "revolute cylindrical prismatic spherical universal fixed planar screw point_on_line"
JOINTS = {
    kind: Declared(kind, BETWEEN) for kind in f"{MOVING} point_on_plane distance rolling".split()
} | {
    "gear": Declared(
        "gear",
        Key("joint1", Text(), "Driving joint.", ...),
        Key("joint2", Text(), "Driven joint.", ...),
    ),
}
WHICH = Key("coordinate", Text(("angle", "displacement", "way")), "Which, where it has two.")
WAY = ByCoordinate(Quantity("rad"), Quantity("m"))
PASSED = Key("value", WAY, "Value.")
SPEED = ByCoordinate(Positive("rad/s"), Positive("m/s"))
IMPACT = "rom.mbs.elements.contact.impact:Impact"
MASSIVE = Key("body", Text(), "Flexible body.", ...)
FLEXIBLE = Key("body", Text(), "Flexible body that carries a surface.", ...)
WHERE = Key("where", Text(), "Deformable interface that is the part of it; all of it if missing.")
ON_MARKERS = "sphere_on_plane disc_on_plane sphere_on_sphere sphere_on_cylinder capsule_on_capsule"
CONTACTS = {kind: Declared(f"{kind} {IMPACT}", BETWEEN) for kind in ON_MARKERS.split()} | {
    kind: Declared(
        f"{kind} {IMPACT}",
        Key("marker", marker_name, "Where the other surface is.", ...),
        FLEXIBLE,
        WHERE,
    )
    for kind in ("surface_on_plane", "surface_on_sphere", "surface_on_cylinder")
}
MARKER = Key("marker", marker_name, "Where it acts.", ...)
FACTOR = Key("factor", law_kind("1"), "A law that multiplies the vector; constant if missing.")
MOTION = ("t", "x", "v")
PRESSURE = Key("pressure", Quantity("Pa"), "Pressure.", ...)
TRACTION = Key("traction", Quantity("Pa", ((3,),)), "Force per area.", ...)
PER_MASS = Key("acceleration", Quantity("m/s^2", ((3,),)), "Force per mass.", ...)
AXES = Key("frame", Text(("body", "world")), "Axes in which it keeps its direction.", "body")
SPREAD_LOADS = {
    kind: Table(about, (*keys, FACTOR, AXES))
    for kind, about, *keys in (
        ("pressure", "A pressure on the surface, pushing inwards.", FLEXIBLE, PRESSURE, WHERE),
        ("traction", "A force per area on the surface.", FLEXIBLE, TRACTION, WHERE),
        ("acceleration", "A force per mass on all of a body.", MASSIVE, PER_MASS),
    )
}
MANY = Key("markers", Markers(), "On which it acts.", ...)
SPREAD_BY = {kind: kind for kind in SPREAD_LOADS}  # by their own keys
ALONG_LINE = (
    "A force along the line between two markers, positive when it pushes them apart: x is its "
    "length, v its rate."
)
CURVES = "Nowhere beyond neighbours, or of continuous curvature."
POINTS = (
    BETWEEN,
    Key("x", Ascending("m"), "Lengths.", ...),
    Key("values", Quantity("N", ((None,),)), "Forces there.", ...),
    Key("interpolation", Text(("monotone", "cubic")), CURVES, "monotone"),
)
SAMPLED = Key("every", Positive("s"), "Time between two samples; asked at all times if missing.")
USER_FORCE = (MANY, *PYTHON_KEYS, SAMPLED)
LAW = (
    *USER_FORCE,
    Key("memory", Quantity("1", ((None,),)), "Numbers it remembers, at the start.", []),
    Key("outputs", words, "Names of its own outputs.", ()),
    Key("energy", Flag(), "Whether it tells stored energy and lost power.", False),
)
LAWS = {
    "line": formula_kind("N", MOTION, ALONG_LINE, BETWEEN),
    "points": Table("The same by points; it goes on straight beyond them.", POINTS),
    "python": Table("A law in Python between any markers, as `mechanism.law` takes it.", LAW),
    "user_force": Table("A force and moment in Python, as `user_force` takes it.", USER_FORCE),
}
LAW_BY = {"expression": "line", "values": "points", "function": "python"}
ZEROS = (
    "Formula of t, the measured x and its rate v whose zeros are looked for, in place of a value."
)
WHEN = (
    Key("direction", Text(("rising", "falling", "both")), "Which way it passes.", "both"),
    Key("terminal", Flag(), "Whether the run ends there.", False),
)
(CONSTANTS,) = (key for key in formula_keys("1", MOTION) if key.name == "constants")
PASSES = (CONSTANTS, Key("expression", Text(), ZEROS), *WHEN)
MEASURED = Key("axis", DIRECTION, "Along which its position is measured, in the world.", ...)
POSITION, DISTANCE = (Key("value", Quantity("m"), f"{what}.") for what in ("Position", "Distance"))
ASKED = Key("markers", Markers(), "It asks for, beyond those with names.")
EVENTS: dict[str, Table] = {
    kind: FormulaTable(about, (*keys, *PASSES), MOTION)
    for kind, about, *keys in (
        ("coordinate", "A joint coordinate passes a value.", JOINT, WHICH, PASSED),
        ("position", "A marker passes a plane.", MARKER, MEASURED, POSITION),
        ("distance", "Two markers are so far apart.", BETWEEN, DISTANCE),
    )
}
IN_PYTHON = "A function of (t, instant) in Python, as `mechanism.event` takes it."
EVENTS["python"] = Table(IN_PYTHON, (ASKED, *PYTHON_KEYS, *WHEN))


def pushing(kind: str, unit: str) -> Declared:
    """The keys of a force or a torque on a marker."""
    vector = Key("vector", Number(unit, (3,)), f"The {kind}.", ...)
    return Declared(kind, MARKER, vector, FACTOR, about=f"A {kind} on a marker.")


class Section(NamedTuple):
    """A section of a mechanism file."""

    about: str  # what its entries are
    kind: Kind  # how they are written
    # what an `Entry` of it does, see `rom.config.connections`
    connect: Callable[[Any], None] | None = None
    bodies: bool = False  # whether they are bodies, which markers name
    summary: str = ""  # a sentence about them, where there is more to say
    single: bool = False  # whether it is one table, for whoever asks for it

    def key(self, name: str) -> Key:
        """The section as a key of the file."""
        summary = self.summary or f"{self.about.capitalize()}."
        kind = self.kind if self.single else Named(self.kind, self.about)
        return Key(name, kind, summary, None if self.single else {})


BEFORE_FIELDS: dict[str, tuple[str, Kind]] = {  # connections and forces: what, and how
    "joints": ("joints", Variants(JOINTS)),
    "drives": ("prescribed joint coordinates", Table("A joint coordinate prescribed in time.", (
        JOINT,
        Key("law", ByCoordinate(law_kind("rad"), law_kind("m")), "Coordinate over time.", ...),
    ))),
    "motors": ("forces along joint coordinates", Declared(
        "motor",
        JOINT,
        Key("law", ByCoordinate(law_kind("N m", MOTION), law_kind("N", MOTION)),
            "Force over time; formulas and Python also by coordinate x and rate v.", ...),
        about="A torque or force along a coordinate.",
        without="compiled",
    )),
    "springs": (
        "springs and dampers between markers",
        Declared("spring_damper", BETWEEN, defaults={"stiffness": 0.0}),
    ),
    "rotational_springs": (
        "springs about joints", Declared("rotational_spring", JOINT, defaults={"stiffness": 0.0}),
    ),
    "bushings": ("bushings", Declared(
        "bushing",
        BETWEEN,
        Key("stiffness", Number("N/m", (3,)), "Along x, y, z.", ...),
        Key("turning_stiffness", Number("N m/rad", (3,)), "About them.", [0.0, 0.0, 0.0]),
        Key("damping", Number("N s/m", (3,)), "Along them.", [0.0, 0.0, 0.0]),
        Key("turning_damping", Number("N m s/rad", (3,)), "About them.", [0.0, 0.0, 0.0]),
        without="curves",
    )),
}  # fmt: skip
BEHIND_FIELDS: dict[str, tuple[str, Kind]] = {
    "forces": ("forces", pushing("force", "N")),
    "torques": ("torques", pushing("torque", "N m")),
    "frictions": (
        "friction in joints",
        Declared(
            "friction",
            JOINT,
            transition_speed=SPEED,
            coulomb=ByCoordinate(NotNegative("N m"), NotNegative("N")),
            stribeck_speed=SPEED,
            viscous=ByCoordinate(NotNegative("N m s/rad"), NotNegative("N s/m")),
        ),
    ),
    "stops": ("stops of joints", Declared(f"stop {IMPACT}", JOINT, lower=WAY, upper=WAY)),
    "contacts": ("contacts", Variants(CONTACTS)),
    "spread_loads": ("loads spread over bodies", Variants(SPREAD_LOADS, SPREAD_BY)),
    "laws": ("laws of force", Variants(LAWS, LAW_BY)),
    "events": ("events", Variants(EVENTS, {"function": "python"})),
}
SIMULATION = Declared(
    "rom.mbs.integrate.simulation:simulate",
    about="How it is moved.",
    without="atol progress t_start state keep",
    t_end=Positive("s"),
)
FORMS = "Form of the table of all motions, loads and energies."
FILMS = "A film: pictures, pictures by ffmpeg, to turn around in browsers, ParaView."
WRITTEN = (
    Key("history", Text(("csv", "h5")), FORMS, "csv"),
    Key("film", Text(("gif", "mp4", "glb", "vtkhdf")), FILMS),
    Key("picture", Flag(), "A picture of four instants.", False),
    Key("plot", words, "Columns of the table to draw over time, without their unit.", ()),
    Key("magnify", Positive("1"), "Deformations are drawn so much larger.", 1.0),
    Key("view", DIRECTION, "Direction to the eye."),
    Key("up", DIRECTION, "Upright direction."),
)
OUTPUT = Table("What `rom simulate` writes beside the table `motion.csv`.", WRITTEN)
BEFORE_BODIES = (
    Key("name", Text(), "Its name; that of the file if missing."),
    Key("gravity", Quantity("m/s^2", ((3,),)), "Acceleration of gravity.", [0.0, 0.0, -9.81]),
    Key("bodies", Named(BODY, "bodies"), "What moves, beside rods.", {}),
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
    first = {name: Section(*one) for name, one in BEFORE_FIELDS.items()}
    return first | of_fields | {name: Section(*one) for name, one in BEHIND_FIELDS.items()}


@cache
def mechanism_table() -> Table:
    """All keys of a mechanism file."""
    bodies = [one.key(name) for name, one in sections().items() if one.bodies]
    others = [one.key(name) for name, one in sections().items() if not one.bodies]
    return Table("A mechanism.", (*BEFORE_BODIES, *bodies, GROUND_POINTS, *others, *HOW))
