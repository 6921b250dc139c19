"""Rods in a file: sections, curves through points, and the rods they make."""

from typing import TYPE_CHECKING, Any

import numpy as np

from rom.arguments import Positive, Quantity, Whole
from rom.config.component_keys import ISOTROPIC
from rom.config.connections import check_name, pose_of
from rom.config.declared import Declared
from rom.config.keys import Key, Place, Table, Variants
from rom.config.mechanism_keys import ORIENTATION, Section
from rom.errors import RomError

if TYPE_CHECKING:
    from rom.components.cosserat.energy import Rod
    from rom.config.connections import Entry
    from rom.model import Array

LENGTH_KIND = Positive("m")
THREE = ((3,),)
TUBE_KEYS = (
    Key("diameter", LENGTH_KIND, "Outer diameter.", ...),
    Key("thickness", LENGTH_KIND, "Of the wall.", ...),
)
RECTANGLE_KEYS = (
    Key("width", LENGTH_KIND, "Along the first axis.", ...),
    Key("height", LENGTH_KIND, "Along the second axis.", ...),
)
NUMBER_KEYS = (
    Key("stretch", Quantity("N", THREE), "GA1, GA2, EA.", ...),
    Key("bend", Quantity("N m^2", THREE), "EI1, EI2, GJ.", ...),
    Key("mass", Positive("kg/m"), "Per length.", ...),
    Key("inertia", Quantity("kg m", THREE), "Per length, about the axes.", ...),
)
SECTION_KINDS = {
    "circle": Table("A full circle.", (Key("diameter", LENGTH_KIND, "Diameter.", ...),)),
    "tube": Table("A circle with a bore.", TUBE_KEYS),
    "rectangle": Table("A full rectangle.", RECTANGLE_KEYS),
    "numbers": Table("A section by its rigidities; it takes no material.", NUMBER_KEYS),
}
AXIS = "Its axis without stress in its own frame: a line through two, a smooth curve through more."
NORMAL = "First axis of the section at the start, in its own frame; it turns only with the curve."
ROD_KEYS = (
    Key("points", Quantity("m", ((None, 3),)), AXIS, ...),
    Key("section", Variants(SECTION_KINDS), "Its section.", ...),
    Key("material", ISOTROPIC, "What it is made of."),
    Key("elements", Whole(1, 10000), "Number of segments, about equally long.", 20),
    Key("normal", Quantity("1", THREE), NORMAL),
    Key("viscosity", Quantity("s"), "Viscous over elastic rigidities.", 0.0),
)
Values = dict[str, Any]  # of the keys of an entry
MAX_POINTS = 10000
FINE_STEPS = 16  # of the curve per segment, to measure its length


def rod_of(values: Values, place: Place) -> "Rod":
    """The rod that an entry describes."""
    from rom.components.cosserat.shapes import rod

    rigidities = _rigidities(values, place)
    x, p = _curve(values, place)
    try:
        return rod(x, p, viscosity=values["viscosity"], **rigidities)
    except RomError as error:
        error.where = error.where or place.document.where(place.path)
        error.hint = error.hint.replace("Place stations more densely.", "Take more elements.")
        raise


def _rigidities(values: Values, place: Place) -> Values:
    """Rigidities, mass and inertia per length.

    Source:
        Cowper, J. Appl. Mech. 33 (1966) 335, for the share of a section that carries shear;
        Timoshenko, Goodier, Theory of Elasticity (1970), section 109, for rectangles in torsion.
    """
    from rom.model import Material

    section = dict(values["section"])
    kind, given = section.pop("kind"), "material" in values
    if given == (kind == "numbers"):
        what = "takes no material" if given else "needs a material"
        raise place.at("section").error(f"a section of kind {kind} {what}.")
    if kind == "numbers":
        return section
    material = Material(**values["material"])
    nu, G = material.nu, material.E / (2 * (1 + material.nu))
    if kind == "rectangle":
        A, I1, I2, J, share = _rectangle(**section, nu=nu)
    else:
        A, I1, I2, J, share = _ring(section, place, nu)
    return {
        "stretch": (share * G * A, share * G * A, material.E * A),
        "bend": (material.E * I1, material.E * I2, G * J),
        "mass": material.rho * A,
        "inertia": (material.rho * I1, material.rho * I2, material.rho * (I1 + I2)),
    }


def _rectangle(width: float, height: float, nu: float) -> tuple[float, ...]:
    """Area, second moments, torsion constant, and share that carries shear."""
    a, b = max(width, height), min(width, height)
    n = np.arange(1, 100, 2)
    series = float((np.tanh(n * np.pi * a / (2 * b)) / n**5).sum())
    J = a * b**3 / 3 * (1 - 192 / np.pi**5 * b / a * series)
    share = 10 * (1 + nu) / (12 + 11 * nu)
    return width * height, width * height**3 / 12, height * width**3 / 12, J, share


def _ring(section: dict[str, float], place: Place, nu: float) -> tuple[float, ...]:
    """The same of a circle, with or without a bore."""
    outer = section["diameter"] / 2
    inner = outer - section.get("thickness", outer)
    if inner < 0.0:
        text = f"thickness = {section['thickness']:g} m is more than the radius {outer:g} m."
        raise place.at("section").error(text, 'A full section has kind = "circle".')
    I, square = np.pi / 4 * (outer**4 - inner**4), (inner / outer) ** 2
    full = (1 + square) ** 2
    share = 6 * (1 + nu) * full / ((7 + 6 * nu) * full + (20 + 12 * nu) * square)
    return np.pi * (outer**2 - inner**2), I, I, 2 * I, share


def _curve(values: Values, place: Place) -> tuple["Array", "Array"]:
    """(N + 1, 3) vertices, and (N + 2, 4) quaternions of plates and segments."""
    from scipy.interpolate import CubicSpline

    points = np.array(values["points"])
    if not 2 <= len(points) <= MAX_POINTS:
        raise place.at("points").error(f"{len(points)} points must be 2 to {MAX_POINTS} of a rod.")
    chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
    if chords.min() <= 0.0:
        k = int(np.argmin(chords))
        raise place.at("points").error(f"points {k} and {k + 1} are one.", "Take one of them out.")
    u, n = np.concatenate([[0.0], np.cumsum(chords)]), values["elements"]
    along, end = CubicSpline(u, points), float(u[-1])
    fine = np.linspace(0.0, end, FINE_STEPS * max(n, len(points)) + 1)
    lengths = np.linalg.norm(np.diff(along(fine), axis=0), axis=1)
    s = np.concatenate([[0.0], np.cumsum(lengths)])
    stations = np.interp(np.linspace(0.0, s[-1], 2 * n + 1), s, fine)
    vertices = along(stations[::2])
    at = np.concatenate([[0.0], stations[1::2], [end]])
    slopes = along(at, 1)
    slopes /= np.linalg.norm(slopes, axis=1)[:, None]
    return vertices, _frames(along(at), slopes, values.get("normal"), place)


def _frames(x: "Array", tangents: "Array", normal: list[float] | None, place: Place) -> "Array":
    """(N + 2, 4) quaternions of sections that turn about their tangent as little as possible.

    Source:
        Wang et al., ACM Trans. Graph. 27 (2008) 2, double reflection.
    """
    from rom.rotation import quaternion

    t = tangents[0]
    first = np.eye(3)[np.argmin(np.abs(t))] if normal is None else np.array(normal)
    first = first - (first @ t) * t
    size = float(np.linalg.norm(first))
    if size <= 1e-9 * (1.0 if normal is None else float(np.linalg.norm(normal))):
        raise place.at("normal").error(f"normal = {normal} must not lie along the rod.")
    found, r = [], first / size
    for k, t in enumerate(tangents):
        if k:
            step = x[k] - x[k - 1]
            r, before = (a - 2 * (step @ a) / (step @ step) * step for a in (r, tangents[k - 1]))
            turn = t - before
            r = r - 2 * (turn @ r) / (turn @ turn) * turn
        found.append(quaternion(np.column_stack([r, np.cross(t, r), t])))
    return np.array(found)


def add_rod(entry: "Entry") -> None:
    """A rod of an entry."""
    from rom.components.cosserat.bodies import body

    check_name(entry.name)
    pose = pose_of(entry.values)
    entry.made.add_nonlinear(entry.name, body(rod_of(entry.values, entry.place)), **pose)


ROD = Declared(
    "add_nonlinear",
    *ROD_KEYS,
    ORIENTATION,
    about="A geometrically exact rod. Markers are its ends, `rod.start` and `rod.end`, and its "
    "frames by number, `rod.0`, `rod.1`, ...",
)
SECTION = Section("rods", ROD, add_rod, bodies=True, summary="Slender bodies of any deflection.")
