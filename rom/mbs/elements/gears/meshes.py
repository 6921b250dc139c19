"""Gear meshes as elements: what users describe, their arrays and kernels."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from rom.arguments import finite, number, positive
from rom.errors import ConfigError
from rom.mbs.elements.cylinders import Cylinder, cylinder_of, pack_cylinders
from rom.mbs.elements.family import Family, Places, integers, rows_of
from rom.mbs.elements.gears.corrections import Correction
from rom.mbs.elements.gears.geometry import GearPair
from rom.mbs.elements.gears.teeth import Meshes, mesh_energy, mesh_tangents, mesh_wrenches
from rom.mbs.parts.bodies import Marker, Part
from rom.mbs.parts.whole import Whole
from rom.model import Array
from rom.plausible import FRICTION, warn_outside
from rom.rotation import matrix

DISTANCE_RTOL = 1e-3  # of the module: by which bodies may stand elsewhere than the pair says
FACE_RTOL = 1e-2  # of the width: by which faces may be beside each other
MAX_CELLS = 1000
MAX_ENTRY = 0.5  # of the base pitch


@dataclass(frozen=True, slots=True)
class GearMesh:
    """Two wheels in mesh; axes (4, 3) and start (2,) as in `Meshes`."""

    i: Marker
    j: Marker
    pair: GearPair
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


def gear_mesh(  # noqa: PLR0913  one keyword per property
    self: Whole,
    name: str,
    wheel_a: Marker,
    wheel_b: Marker,
    *,
    axis: npt.ArrayLike,
    pair: GearPair,
    stiffness: npt.ArrayLike,
    correction: Correction | None = None,
    damping: float = 0.0,
    friction: float = 0.0,
    transition_speed: float | None = None,
    cells: int = 21,
    phase: float = 0.0,
    entry: float = 0.02,
) -> None:
    """Involute teeth of two wheels in contact, on both flanks, with backlash and loss of contact.

    Where the bodies were added the working flanks just touch without load; they are those with
    which a pinion that turns in the positive sense about the axis drives. The wheels may turn and
    move as their bodies do: the pressure angle follows their distance. Bearings and shafts hold
    them; the teeth bend as said here, wheels as their bodies do.

    Args:
        name: name of the mesh.
        wheel_a: middle of the face of the pinion, on its axis.
        wheel_b: that of the gear.
        axis: (3,) of the pinion, in the world at the start.
        pair: `rom.components.gear_mesh.GearPair`, at whose distance the wheels stand.
        stiffness: of one pair of teeth per length of contact line [N/m^2]: a number, or (n,) values
            from first to last contact, as `rom.components.gear_mesh.stiffness_table` has them.
        correction: `rom.components.gear_mesh.Correction` of the working flanks.
        damping: force per rate over force per deflection of a slice [s]; its force is never more
            than the elastic one.
        friction: coefficient between the flanks [1].
        transition_speed: of sliding flanks, over which friction turns [m/s].
        cells: slices across the face.
        phase: angle that the pinion has turned from where a line of contact begins at the tangent
            point of its base circle [rad].
        entry: share of the base pitch over which a pair of teeth takes up its load as it comes, and
            gives it off as it goes; with 0 at once, which implicit steps do not like [1].

    Raises:
        ConfigError: for a name in use, unknown markers, wheels that do not stand as the pair says,
            or numbers no mesh has.
    """
    if not all(float(z).is_integer() for z in pair.teeth):
        raise ConfigError(f"the wheels of mesh {name!r} have {pair.teeth} teeth: whole numbers.")
    self.check_markers(name, wheel_a, wheel_b)
    if wheel_a.body == wheel_b.body:
        raise ConfigError(f"mesh {name!r} is of body {wheel_a.body!r} with itself.")
    z = finite("axis", axis, (3,))
    if not np.linalg.norm(z) > 0.0:
        raise ConfigError(f"the axis of mesh {name!r} is zero.")
    z = z / np.linalg.norm(z)
    D = self.design_point(wheel_b) - self.design_point(wheel_a)
    _check_place(name, pair, D, z)
    c = np.sign(pair.distance) * (D - (D @ z) * z) / np.linalg.norm(D - (D @ z) * z)
    turned = [matrix(self.part(wheel.body).p) for wheel in (wheel_a, wheel_b)]
    axes = np.array([z @ turned[0], c @ turned[0], z @ turned[1], -c @ turned[1]])
    numbers = _law(name, damping, friction, transition_speed)
    if not 1 <= cells <= MAX_CELLS:
        raise ConfigError(f"cells = {cells} of mesh {name!r}: it has from 1 to {MAX_CELLS}.")
    if not 0.0 <= number("entry", entry) <= MAX_ENTRY:
        raise ConfigError(f"entry = {entry:g} of mesh {name!r} is a share from 0 to {MAX_ENTRY}.")
    stiffness = _stiffness(name, stiffness)
    flanks = Correction() if correction is None else correction
    _check_correction(name, pair, flanks)
    mesh = GearMesh(
        wheel_a, wheel_b, pair, stiffness, flanks, numbers, cells, axes, np.array([0.0, np.pi]),
        float(D @ z), number("phase", phase), entry * pair.base_pitch,
        _rims((self.part(wheel_a.body), self.part(wheel_b.body)), (wheel_a, wheel_b), axes, pair),
    )  # fmt: skip
    self.add(name, mesh, GEAR_MESHES_FAMILY)


def _rims(
    parts: tuple[Part, Part], wheels: tuple[Marker, Marker], axes: Array, pair: GearPair
) -> tuple[tuple[Cylinder, float] | None, ...]:
    """How the rims of flexible wheels deform, and the angle that a tooth takes on each [rad]."""
    found = []
    for side in range(2):
        rim = cylinder_of(parts[side], wheels[side], *axes[2 * side : 2 * side + 2])
        found.append(None if rim is None else (rim, np.pi / abs(pair.teeth[side])))
    return tuple(found)


def _check_place(name: str, pair: GearPair, D: Array, z: Array) -> None:
    """Refuse wheels that do not stand as the pair says."""
    distance = float(np.linalg.norm(D - (D @ z) * z))
    if not abs(distance - abs(pair.distance)) <= DISTANCE_RTOL * pair.module:
        raise ConfigError(
            f"the wheels of mesh {name!r} stand {distance * 1e3:.6g} mm apart, those of its pair "
            f"{abs(pair.distance) * 1e3:.6g} mm.",
            hint="Move a body, or give the pair this centre_distance.",
        )
    if not abs(float(D @ z)) <= FACE_RTOL * pair.width:
        raise ConfigError(
            f"the faces of mesh {name!r} are {abs(D @ z) * 1e3:.4g} mm beside each other: wheel_a "
            "and wheel_b are the middles of the common face.",
        )


def _law(name: str, damping: Any, friction: Any, speed: Any) -> tuple[float, ...]:
    """Damping, friction and transition speed."""
    for what, value in (("damping", damping), ("friction", friction)):
        if number(what, value) < 0.0:
            raise ConfigError(f"{what} of mesh {name!r} is {value:g}: it must not drive.")
    warn_outside(FRICTION, friction, repr(name))
    if friction and speed is None:
        raise ConfigError(
            f"mesh {name!r} has friction, but no transition_speed.",
            hint="Take a hundredth of the speed with which its flanks slide.",
        )
    return (
        float(damping),
        float(friction),
        1.0 if speed is None else positive("transition_speed", speed),
    )


def _stiffness(name: str, given: Any) -> Array:
    """(n,) stiffness from first to last contact [N/m^2]."""
    k = np.atleast_1d(np.asarray(given, dtype=float))
    if not (k.ndim == 1 and k.size and np.isfinite(k).all() and (k > 0.0).all()):
        raise ConfigError(f"stiffness of the teeth of {name!r} must be positive numbers [N/m^2].")
    return k


def _check_correction(name: str, pair: GearPair, correction: Correction) -> None:
    """Refuse pitch errors of another number of teeth."""
    for errors, z in zip(correction.pitch, pair.teeth, strict=True):
        if len(errors) not in (0, abs(z)):
            raise ConfigError(
                f"{len(errors)} pitch errors of {name!r} for {z} teeth: one per tooth."
            )


def pack(meshes: Mapping[str, GearMesh], places: Places) -> Meshes:
    """The meshes as arrays."""
    found = list(meshes.values())
    tables = [mesh.stiffness for mesh in found]
    pitches = [_from_lowest(errors) for mesh in found for errors in mesh.correction.pitch]
    return Meshes(
        integers(places.marker[mesh.i] for mesh in found),
        integers(places.marker[mesh.j] for mesh in found),
        rows_of((mesh.axes.ravel() for mesh in found), 12),
        rows_of((_sizes(mesh) for mesh in found), 13),
        rows_of((_flanks(mesh.correction) for mesh in found), 7),
        rows_of((mesh.numbers for mesh in found), 3),
        integers(mesh.cells for mesh in found),
        np.cumsum([0, *(table.size for table in tables)]),
        np.concatenate(tables),
        np.cumsum([0, *(errors.size for errors in pitches)]),
        np.concatenate(pitches),
        integers(places.memory(name, mesh.start) for name, mesh in meshes.items()),
        rows_of((mesh.start for mesh in found), 2),
        np.zeros(len(found)),
        np.zeros((len(found), max(map(_most_slices, found)), 5)),
        np.zeros(len(found)),
        pack_cylinders([mesh.rims for mesh in found], places.R),
        np.zeros(2),
        np.zeros((2, 12, 12)),
    )


def _most_slices(mesh: GearMesh) -> int:
    """As many as can bear at once on both flanks, of wheels a little closer than they are cut."""
    pair = mesh.pair
    along = 1.5 * (pair.path[1] - pair.path[0]) + mesh.entry
    lines = (along + pair.width * np.tan(abs(pair.base_helix))) / pair.base_pitch + 3
    return 2 * mesh.cells * int(np.ceil(lines))


def _from_lowest(errors: Any) -> Array:
    """Pitch errors as gaps, the tooth that touches first without one."""
    found = np.asarray(errors, dtype=float)
    return found - found.min() if found.size else found


def _sizes(mesh: GearMesh) -> list[float]:
    pair = mesh.pair
    return [
        *pair.rb, *pair.ra, pair.base_helix, pair.base_pitch, pair.base_thickness[0], pair.backlash,
        pair.alpha, pair.width, mesh.offset, mesh.phase, mesh.entry,
    ]  # fmt: skip


def _flanks(correction: Correction) -> list[float]:
    c = correction
    return [*c.relief, *c.extent, c.power, c.crowning, c.slope]


GEAR_MESHES_FAMILY = Family(
    "gear_meshes", GearMesh, pack, mesh_wrenches, mesh_tangents, mesh_energy,
    by_rate=lambda meshes: meshes.law[:, :2].any(), answers=lambda meshes: meshes.load,
    lost="the wheels of {} are so close that they have no common tangent",
)  # fmt: skip
