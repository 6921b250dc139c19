"""Gear meshes as elements: what users describe, their arrays and kernels.

Phases say where teeth stand. The working flanks of a mesh have their origins on the base circles at
angles from the line of centres about the axis of the pinion::

    gamma_1 = p - alpha,   gamma_2 = (T - r_b1 p) / r_b2 - alpha,

p the phase and T the distance of the points of tangency. Half of a tooth behind them lies its
middle, which a second mesh of the same wheel finds at the same place, on whichever flank it bears.
Around one circle phases then step as z psi / (2 pi) of a pitch over the angles psi of the planets.

Source:
    Parker and Lin, Mesh phasing relationships in planetary and epicyclic gears, J. Mech. Des. 126
    (2004) 365.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rom import arguments
from rom.arguments import Angle, Between, Count, Direction, NotNegative, Positive
from rom.components.gear_mesh.gears import table as col
from rom.components.gear_mesh.gears.corrections import Correction, checked_map
from rom.components.gear_mesh.gears.geometry import GearPair
from rom.components.gear_mesh.gears.hertz import Hertz
from rom.components.gear_mesh.gears.racks import RackPair
from rom.components.gear_mesh.gears.table import Meshes
from rom.components.gear_mesh.gears.teeth import mesh_energy, mesh_tangents, mesh_wrenches
from rom.components.round_bodies.cylinders import Cylinder, cylinder_of, pack_cylinders
from rom.errors import ConfigError, ModelError
from rom.mbs.elements.family import Family, Hooks, Places, integers, rows_of
from rom.mbs.kernels.work import Work
from rom.mbs.parts.bodies import Marker, Part
from rom.mbs.parts.joints import Whole
from rom.model import Array
from rom.plausible import USUAL, Range
from rom.rotation import matrix

DISTANCE_RTOL = 1e-3  # of the module: by which bodies may stand elsewhere than the pair says
FACE_RTOL = 1e-2  # of the width: by which faces may be beside each other
SPIN_RATIO_RTOL = 1e-6  # by which the speeds of spinning wheels may miss the ratio of the teeth
SAME_AXIS = 1e-6  # sine of the angle between two axes of one wheel
MAX_MISFIT = 0.02  # of a pitch, beyond the backlash, by which teeth may miss the gaps of a circle
MAX_CELLS = 1000
MAX_APPROACH = 0.1  # of the base pitch: a hundred times the deflection of loaded teeth
MAX_ENTRY = 0.5  # of the base pitch
MAX_RUN_OUT = 0.1  # of the module: by which an involute is what it is to first order
NO_ERRORS = np.zeros(0)

TOOTH_STIFFNESS_LIMITS = 1e6, 1e13, "N/m^2", "teeth of steel have about 1e10 per width"
USUAL["gear_mesh.stiffness"] = Range("'stiffness'", *TOOTH_STIFFNESS_LIMITS, "")


@dataclass(frozen=True, slots=True)
class GearMesh:
    """Two wheels in mesh; axes (4, 3) and start (2,) as in `Meshes`."""

    i: Marker
    j: Marker
    pair: GearPair | RackPair
    stiffness: Array
    correction: Correction
    numbers: tuple[float, ...]
    cells: int
    axes: Array
    start: Array
    offset: float
    phase: float
    entry: float
    rims: tuple[tuple[Cylinder, float] | None, ...]
    hertz: Hertz | None = None
    spins: tuple[float, float] = (0.0, 0.0)


def gear_mesh(  # noqa: PLR0913  one keyword per property
    self: Whole,
    name: str,
    wheel_a: Marker,
    wheel_b: Marker,
    *,
    axis: Direction,
    pair: GearPair | RackPair,
    stiffness: Annotated[npt.ArrayLike, Positive("N/m^2", (), (None,))],
    correction: Correction | None = None,
    damping: Annotated[float, NotNegative("s")] = 0.0,
    friction: Annotated[float, NotNegative()] = 0.0,
    transition_speed: Annotated[float, Positive("m/s")] | None = None,
    cells: Annotated[int, Count(1, MAX_CELLS)] = 21,
    phase: Angle | None = None,
    entry: Annotated[float, Between(0, MAX_ENTRY)] = 0.02,
    conservative: bool | None = None,
    hertz: Hertz | None = None,
    coupling: Annotated[float, NotNegative("m")] = 0.0,
) -> None:
    """Involute teeth of two wheels in contact, on both flanks, with backlash and loss of contact.

    Where the bodies were added the working flanks just touch without load; they are those with
    which a pinion that turns in the positive sense about the axis drives. The wheels may turn and
    move as their bodies do: the pressure angle follows their distance. Bearings and shafts hold
    them; the teeth bend as said here, wheels as their bodies do.

    Args:
        name: name of the mesh.
        wheel_a: middle of the face of the pinion, on its axis.
        wheel_b: that of the gear, or the point of the reference line of a rack opposite to it.
        axis: (3,) of the pinion, in the world at the start.
        pair: `rom.components.gear_mesh.GearPair`, at whose distance the wheels stand, or
            `rom.components.gear_mesh.RackPair`, whose rack runs across axis and distance.
        stiffness: of one pair of teeth per length of contact line [N/m^2]: a number, or (n,) values
            from first to last contact, as `rom.components.gear_mesh.stiffness_table` has them.
        correction: `rom.components.gear_mesh.Correction` of the working flanks.
        damping: force per rate over force per deflection of a slice [s]; its force is never more
            than the elastic one.
        friction: coefficient between the flanks [1].
        transition_speed: of sliding flanks, over which friction turns [m/s].
        cells: slices across the face.
        phase: angle that the pinion has turned from where a line of contact begins at the tangent
            point of its base circle [rad]; None for the one at which teeth of wheels that other
            meshes have already stand in gaps, and 0 for the first.
        entry: share of the base pitch over which a pair of teeth takes up its load as it comes, and
            gives it off as it goes; with 0 at once, which implicit steps do not like [1].
        conservative: whether forces are the gradient of the energy also where lines move along
            the path and over the face: relieved flanks press along their own normal, and what
            lines bring and take as they come and go is work of the wheels. Else they follow the
            normal of the involutes, and the balance of energy lacks that work. None for yes, unless
            spur teeth take up their load at once, which is a jump of energy.
        hertz: `rom.components.gear_mesh.Hertz`, contact that gives way by its load; then
            `stiffness` is that of the teeth without it, see
            `rom.components.gear_mesh.bending_table`.
        coupling: length over which slices of a line carry each other, by a foundation after
            Pasternak that shears [m].

    Raises:
        ConfigError: for a name in use, unknown markers, wheels that do not stand as the pair says,
            or numbers no mesh has.
        ModelError: for maps and contact that the wheels cannot have, or a planet whose teeth find
            no gaps.
    """
    if not all(float(z).is_integer() for z in pair.teeth):
        raise ConfigError(f"wheels of {name!r} have {pair.teeth} teeth, needed are whole ones.")
    self.check_apart(name, wheel_a, wheel_b)
    z = arguments.unit_vector(f"axis of {name}", axis)
    D = self.design_point(wheel_b) - self.design_point(wheel_a)
    _check_place(name, pair, D, z)
    c = np.sign(pair.distance) * (D - (D @ z) * z) / np.linalg.norm(D - (D @ z) * z)
    wheels, start = (wheel_a, wheel_b), np.array([0.0, np.pi])
    parts = self.part(wheel_a.body), self.part(wheel_b.body)
    turned = [matrix(part.p) for part in parts]
    along = np.cross(z, c) if isinstance(pair, RackPair) else -c
    axes = np.array([z @ turned[0], c @ turned[0], z @ turned[1], along @ turned[1]])
    follows = _follows_energy(name, pair, entry, conservative)
    if friction and transition_speed is None:
        text = f"mesh {name!r} has friction, but no transition_speed"
        raise ConfigError(f"{text}; take a hundredth of the speed with which its flanks slide.")
    arguments.between(f"coupling [m] of mesh {name!r} and its width", coupling, 0, pair.width)
    soft = hertz.compliance if hertz else 0.0
    numbers = (damping, friction, transition_speed or 1.0, follows, coupling, soft)
    stiffness = arguments.vector(f"stiffness of the teeth of {name!r}", stiffness)
    flanks = correction or Correction()
    _check_correction(name, pair, flanks)
    if hertz:
        hertz.constants(pair)
    place = axes, start, float(D @ z), phase or 0.0, entry * pair.base_pitch
    seen = _rims(parts, wheels, axes, pair), hertz, _spins(name, parts, axes, pair)
    mesh = GearMesh(*wheels, pair, stiffness, flanks, numbers, cells, *place, *seen)
    if phase is None:
        others = [(n, x) for n, (_, x) in self.elements.items() if isinstance(x, GearMesh)]
        mesh = replace(mesh, phase=phase_from(name, mesh, others))
    self.add(name, mesh, GEAR_MESHES_FAMILY)


def phase_from(name: str, mesh: GearMesh, others: Iterable[tuple[str, GearMesh]]) -> float:
    """Phase of a new `GearMesh` from others that its wheels have, 0 if they have none [rad]."""
    pair, phases = mesh.pair, dict[int, tuple[float, str]]()
    pitch = pair.base_pitch / pair.rb[0]
    for other, known in others:
        for side in (0, 1) if pair.teeth[1] else (0,):
            if (at := _middle(mesh, side, known)) is not None:
                phases.setdefault(side, (_phase(pair, side, at) % pitch, other))
    if not phases:
        return 0.0
    if len(phases) == 2:
        (one, first), (two, second) = phases.values()
        misfit = abs((one - two + 0.5 * pitch) % pitch - 0.5 * pitch) * pair.rb[0]
        if misfit > MAX_MISFIT * pair.base_pitch + abs(pair.backlash):
            text = f"the teeth of mesh {name!r} miss each other's gaps by"
            other = f"by meshes {first!r} and {second!r} the wheels stand otherwise"
            hint = "Planets in equal steps divide the sum of teeth of sun and ring; or give phase=."
            far = f"{misfit / pair.base_pitch:.3f} of a pitch"
            raise ModelError(f"{text} {far}: {other}.", where=name, hint=hint)
    return phases[min(phases)][0]


def _phase(pair: GearPair | RackPair, side: int, middle: float) -> float:
    """Of the mesh whose wheel has the middle of a tooth at an angle from the line of centres."""
    origin = middle + pair.base_thickness[side] / (2 * pair.rb[side]) + pair.alpha
    return float(origin if side == 0 else (pair.tangents - pair.rb[1] * origin) / pair.rb[0])


def _middle(mesh: GearMesh, side: int, known: GearMesh) -> float | None:
    """Angle of the middle of a tooth on wheel ``side`` of a mesh, from one that is known."""
    marker, teeth = (mesh.i, mesh.j)[side], mesh.pair.teeth[side]
    for other, place in enumerate((known.i, known.j)):
        z, e, towards = mesh.axes[2 * side], mesh.axes[2 * side + 1], known.axes[2 * other + 1]
        turned = float(z @ known.axes[2 * other])
        same = place == marker and known.pair.teeth[other] == teeth
        if same and abs(turned) > 1 - SAME_AXIS:
            middle = middle_of_tooth(known.pair, other, known.phase)
            apart = np.arctan2(z @ np.cross(e, towards), e @ towards)
            return float(apart + np.sign(turned) * middle)
    return None


def middle_of_tooth(pair: GearPair | RackPair, side: int, phase: float) -> float:
    """Angle of one of the pinion, 0, or gear, 1, from the line of centres to the other wheel."""
    at = phase if side == 0 else (pair.tangents - pair.rb[0] * phase) / pair.rb[1]
    return float(at - pair.alpha - pair.base_thickness[side] / (2 * pair.rb[side]))


def _rims(
    parts: tuple[Part, Part], wheels: tuple[Marker, Marker], axes: Array, pair: GearPair
) -> tuple[tuple[Cylinder, float] | None, ...]:
    """How the rims of flexible wheels deform, and the angle that a tooth takes on each [rad]."""
    sides = zip(parts, wheels, np.split(axes, 2), pair.teeth, strict=True)
    rims = [cylinder_of(part, wheel, *two) if z else None for part, wheel, two, z in sides]
    both = zip(rims, pair.teeth, strict=True)
    return tuple(None if rim is None else (rim, np.pi / abs(z)) for rim, z in both)


def _spins(
    name: str, parts: tuple[Part, Part], axes: Array, pair: GearPair | RackPair
) -> tuple[float, float]:
    """Of both wheels in the frames of their bodies, about the axis of the pinion [rad/s]."""
    one, two = (part.spin_about(name, axes[2 * k]) for k, part in enumerate(parts))
    z, w = pair.teeth
    if two and not w:
        raise ConfigError(f"the rack of {name!r} spins at {two:.9g} rad/s; give it no spin.")
    if one and two and abs(z * one + w * two) > SPIN_RATIO_RTOL * abs(z * one):
        spins = f"spin at {one:.9g} and {two:.9g} rad/s about its axis"
        needed = f"teeth {z} and {w} need {one:.9g} and {-one * z / w:.9g}"
        raise ConfigError(f"the wheels of mesh {name!r} {spins}: {needed}.")
    return one, two


def _follows_energy(
    name: str, pair: GearPair | RackPair, entry: float, conservative: bool | None
) -> float:
    """1 for forces that follow the energy along the path, 0 for those along involutes."""
    jumps = entry == 0.0 and pair.helix == 0.0
    if conservative and jumps:
        text = f"the energy of mesh {name!r} would jump: lines come at once with entry = 0."
        raise ConfigError(text, hint="Take an entry of 0.02, or give conservative=False.")
    return float(not jumps if conservative is None else conservative)


def _check_place(name: str, pair: GearPair | RackPair, D: Array, z: Array) -> None:
    distance = float(np.linalg.norm(D - (D @ z) * z))
    if not abs(distance - abs(pair.distance)) <= DISTANCE_RTOL * pair.module:
        text = f"the wheels of mesh {name!r} stand {distance * 1e3:.6g} mm apart, those of its pair"
        hint = "Move a body (the marker of a rack), or give the pair this centre_distance."
        raise ConfigError(f"{text} {abs(pair.distance) * 1e3:.6g} mm.", hint=hint)
    if not abs(float(D @ z)) <= FACE_RTOL * pair.width:
        text = f"the faces of mesh {name!r} are {abs(D @ z) * 1e3:.4g} mm beside each other"
        raise ConfigError(f"{text}; wheel_a and wheel_b must be the middles of the common face.")


def _check_correction(name: str, pair: GearPair | RackPair, correction: Correction) -> None:
    for errors, z in zip(correction.pitch, pair.teeth, strict=True):
        if len(errors):
            arguments.finite(f"pitch errors of {name!r}", errors, (abs(z),))
    if isinstance(pair, RackPair) and correction.run_out[1][0] != 0.0:
        raise ConfigError(f"the rack of {name!r} does not turn; give it no run-out.")
    for amount, _ in arguments.finite("run_out", correction.run_out, (2, 2)):
        if not abs(amount) <= MAX_RUN_OUT * pair.module:
            text = f"run-out {amount:g} m of {name!r} is more than {MAX_RUN_OUT} modules"
            raise ConfigError(f"{text}: no involutes about their axis; move the marker.")
    _maps(pair, correction, name)


def _maps(pair: GearPair | RackPair, correction: Correction, name: str) -> list[Array]:
    """Maps of the working flanks of pinion and gear, and of their back flanks."""
    kinds = ("working", correction.maps), ("back", correction.back_maps)
    return [
        checked_map(given, z, f"the map of the {kind} flanks of the {wheel} of {name!r}")
        for kind, both in kinds
        for given, z, wheel in zip(both, pair.teeth, ("pinion", "gear"), strict=True)
    ]


def pack(meshes: Mapping[str, GearMesh], places: Places) -> Meshes:
    """The meshes as arrays."""
    found, n = list(meshes.values()), col.COORDINATES
    maps = [m for name, mesh in meshes.items() for m in _maps(mesh.pair, mesh.correction, name)]
    pitch = [np.array(each, dtype=float) for mesh in found for each in mesh.correction.pitch]
    markers = ([places.marker[getattr(mesh, side)] for mesh in found] for side in "ij")
    return Meshes(
        *map(integers, markers),
        rows_of((mesh.axes.ravel() for mesh in found), 12),
        rows_of((_sizes(mesh) for mesh in found), 15),
        rows_of((_flanks(mesh, maps[4 * k : 4 * k + 4]) for k, mesh in enumerate(found)), 13),
        rows_of((mesh.numbers for mesh in found), 6),
        rows_of((mesh.spins for mesh in found), 2),
        integers([places.clock()]),
        integers(mesh.cells for mesh in found),
        *_joined([mesh.stiffness for mesh in found]),
        *_joined([mesh.hertz.constants(mesh.pair) if mesh.hertz else NO_ERRORS for mesh in found]),
        *_joined([late - late.min(initial=np.inf) for late in pitch]),  # gaps; the first has none
        *_joined([m.ravel() for m in maps]),
        np.array([m.shape for m in maps], dtype=np.int64).reshape(-1, 3),
        integers(places.memory(name, mesh.start) for name, mesh in meshes.items()),
        rows_of((mesh.start for mesh in found), 2),
        *np.zeros((2, len(found))),
        np.zeros((len(found), max(map(_most_slices, found)), 5)),
        np.zeros(len(found)),
        pack_cylinders([mesh.rims for mesh in found], places.R, max(mesh.cells for mesh in found)),
        np.zeros(2),
        np.zeros((max(mesh.cells for mesh in found), col.SLICE_COLUMNS)),
        *(np.zeros(shape) for shape in (n, n, (2, n, n), (n, 12), (2, 12), (2, 12, 12))),
    )


def _joined(rows: list[Array]) -> tuple[Array, Array]:
    """Where each row begins, and all of them."""
    return np.cumsum([0, *(row.size for row in rows)]), np.concatenate([NO_ERRORS, *rows])


def _most_slices(mesh: GearMesh) -> int:
    """As many as can bear at once on both flanks, of wheels a little closer than they are cut."""
    pair = mesh.pair
    along = 1.5 * (pair.path[1] - pair.path[0]) + mesh.entry
    lines = (along + pair.width * np.tan(abs(pair.base_helix))) / pair.base_pitch + 3
    return 2 * mesh.cells * int(np.ceil(lines))


def _sizes(mesh: GearMesh) -> list[float]:
    pair = mesh.pair
    rack = (pair.distance, pair.tip) if isinstance(pair, RackPair) else (0.0, 0.0)
    tips = (pair.wheel.ra[0], 0.0) if isinstance(pair, RackPair) else pair.ra
    flanks = pair.base_helix, pair.base_pitch, pair.base_thickness[0], pair.backlash, pair.alpha
    return [*pair.rb, *tips, *flanks, pair.width, mesh.offset, mesh.phase, mesh.entry, *rack]


def _flanks(mesh: GearMesh, maps: list[Array]) -> list[float]:
    """Corrections, eccentricities and the least gaps of working and back flanks."""
    c, pair, lead = mesh.correction, mesh.pair, np.cos(mesh.pair.base_helix)
    amounts, towards = zip(*((float(e), float(angle)) for e, angle in c.run_out), strict=True)
    if pair.internal:  # wheels mesh on one side of both centres
        towards = (towards[0], towards[1] + np.pi)
    off = lead * float(np.abs(amounts).sum())
    least = [sum(float(m.min(initial=0.0)) for m in two) - off for two in (maps[:2], maps[2:])]
    least[0] += sum(min(x, 0.0) for x in (*c.relief, c.crowning))
    least[1] += lead * pair.backlash
    return [*c.relief, *c.extent, c.power, c.crowning, c.slope, *amounts, *towards, *least]


def _room(meshes: Meshes) -> Array:
    """(k,) share of the depth that is left which no teeth reach, and a correction must not."""
    return 1.0 - np.asarray(meshes.approach / (MAX_APPROACH * meshes.size[:, col.PITCH]))


def _passed(meshes: Meshes, W: Work) -> Array:
    """(k,) teeth of the pinions that have gone by."""
    turned = W.fresh[meshes.remembered] + meshes.spin[:, 0] * W.signal[meshes.clock[0], 0]
    teeth: Array = meshes.size[:, col.RB_1] / meshes.size[:, col.PITCH] * turned
    return teeth


FORCES = mesh_wrenches, mesh_tangents, mesh_energy
LOST = "the wheels of {} are so close that they have no common tangent"
GEAR_MESHES_FAMILY = Family(
    "gear_meshes",
    GearMesh,
    pack,
    *FORCES,
    by_rate=lambda meshes: meshes.law[:, col.DAMPING : col.SPEED].any(),
    hooks=Hooks(answers=lambda meshes: meshes.load, room=_room, phases=_passed, lost=LOST),
)
