"""From the described mechanism to the flat arrays of compiled code."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rom.errors import ConfigError, warn
from rom.mbs.equations.graph import graph_of
from rom.mbs.equations.packing_elements import (
    actions,
    bushings,
    contacts,
    integers,
    nonlinear,
    spread_loads,
    table,
)
from rom.mbs.kernels.stages import STAGE_ADDRESSES
from rom.mbs.kernels.system import (
    ALONG,
    LENGTHS,
    Bodies,
    Coordinates,
    Forces,
    Markers,
    Rows,
    System,
)
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.bodies import GROUND, Marker, Part
from rom.mbs.parts.joints import Joint, Row
from rom.mbs.parts.signals import Signal, clock_signal, drive_signal, load_signal
from rom.model import Array

FAR_JOINTS = 1e4  # sizes from the origin; reactions of a pendulum there miss 2e-5 of its weight


@dataclass(frozen=True)
class Packed:
    """A mechanism ready to run.

    Attributes:
        system: the arrays.
        names: bodies in the order of the arrays.
        markers: row of each marker.
        row_owner: (m,) joint or drive of each constraint row.
        signals: functions of time, in the order of the arrays.
        q, v: coordinates and velocities as given by the user.
        length: size of the mechanism [m].
        mass: total mass [kg].
    """

    system: System
    names: tuple[str, ...]
    markers: dict[Marker, int]
    row_owner: tuple[str, ...]
    signals: tuple[Signal, ...]
    q: Array
    v: Array
    length: float
    mass: float

    def rows_of(self, joint: str) -> Array:
        """Numbers of the constraint rows of a joint or drive."""
        return np.array([k for k, owner in enumerate(self.row_owner) if owner == joint], dtype=int)

    @property
    def row_scale(self) -> Array:
        """(m,) length of the mechanism for rows that measure lengths, one for the others."""
        rows = self.system.rows
        slides = [k >= 0 and self.system.coordinates.kind[k] == ALONG for k in rows.at[:, 0]]
        lengths = np.isin(rows.kind, LENGTHS) | np.array(slides, dtype=bool)
        return np.where(lengths, self.length, 1.0)

    @property
    def by_blocks(self) -> bool:
        """Whether the equations are stored and solved body by body, joint by joint."""
        return bool(self.system.graph.compact)

    def whole(self) -> "Packed":
        """The same with whole matrices, which constraints that repeat others need."""
        graph = graph_of(self.system, whole=True)
        return replace(self, system=self.system.replace(graph=graph))

    def row(self, marker: Marker) -> int:
        """Row of a marker in the arrays."""
        return self.markers[marker]


def pack(mechanism: Mechanism, *, whole: bool = False) -> Packed:
    """Write the mechanism into arrays.

    Args:
        mechanism: bodies, joints, forces.
        whole: store whole matrices (n, n) in any case, not the blocks of bodies and joints alone.

    Raises:
        ConfigError: if there is no body.
    """
    parts = tuple(mechanism.parts.values())
    if not parts:
        raise ConfigError("the mechanism has no body.", hint="Use add_rigid or add_flexible.")
    handles = _all_markers(mechanism, parts)
    index = {marker: k for k, marker in enumerate(handles)}
    coordinates = _Coordinates()
    rows, owners, signals = _rows(mechanism, index, coordinates)
    forces, loads = _forces(mechanism, index, len(signals), coordinates)
    spread, more = spread_loads(mechanism, len(signals) + len(loads), max(p.r for p in parts))
    loads += more
    clock = (clock_signal(),) if mechanism.motors else ()
    _doubt_place(mechanism, _length(parts))
    moved_by = actions(
        mechanism,
        coordinates,
        lambda joint: (owners.index(joint), owners.count(joint)),
        len(signals) + len(loads) if clock else -1,
    )
    R = max(part.r for part in parts)
    system = System(
        STAGE_ADDRESSES,
        _bodies(parts, R, np.asarray(mechanism.gravity)),
        _markers(mechanism, handles, R),
        rows,
        coordinates.packed(index),
        forces,
        moved_by,
        bushings(mechanism, index),
        contacts(mechanism, index),
        spread,
        nonlinear(mechanism),
    )
    return Packed(
        system.replace(graph=graph_of(system, whole=whole)),
        tuple(mechanism.parts),
        index,
        owners,
        (*signals, *loads, *clock),
        np.concatenate([np.r_[part.at, part.p, part.q] for part in parts]),
        np.concatenate([np.r_[part.velocity, part.omega, part.qd] for part in parts]),
        max([_length(parts), *(whole.reach for whole in mechanism.nonlinear.values())]),
        sum(part.mass for part in parts),
    )


def _all_markers(mechanism: Mechanism, parts: tuple[Part, ...]) -> list[Marker]:
    """Every named marker, every marker in use, and the origin of every body."""
    found = [Marker(part.name, name) for part in parts for name in part.names]
    found += [m for joint in mechanism.joints.values() for m in joint.markers]
    found += [m for s in mechanism.springs.values() for m in (s.i, s.j)]
    pairs: tuple[Any, ...] = (*mechanism.bushings.values(), *mechanism.contacts.values())
    for pair in pairs:
        found += [pair.i, pair.j]
    found += [load.marker for load in mechanism.loads.values()]
    for law in mechanism.user_forces.values():
        found += [law.i] if law.j is None else [law.i, law.j]
    return list(dict.fromkeys([*found, Marker(GROUND, (0.0, 0.0, 0.0))]))


def _length(parts: tuple[Part, ...]) -> float:
    """Largest reach of a body, or its radius of gyration."""
    reach = [np.sqrt(np.trace(part.second) / part.mass) for part in parts]
    for part in parts:
        reach += [np.linalg.norm(part.point(part.marker(name))) for name in part.names]
    return float(max(reach))


def _doubt_place(mechanism: Mechanism, length: float) -> None:
    """Warn if joints lie so far from the origin of the world that their gaps are round-off."""
    markers = [m for joint in mechanism.joints.values() for m in joint.markers]
    if not markers:
        return
    points = np.array([mechanism.design_point(marker) for marker in markers])
    size = max(length, float(np.ptp(points, axis=0).max()))
    distance = float(np.linalg.norm(points.mean(axis=0)))
    if distance > FAR_JOINTS * size:
        warn(
            f"the joints lie {distance:.4g} m from the origin of the world, {distance / size:.3g} "
            f"times the size {size:.4g} m of the mechanism: {np.log10(distance / size):.0f} of 16 "
            "digits of every gap are lost, and more of the reactions. Put the origin near them."
        )


def _bodies(parts: tuple[Part, ...], R: int, gravity: Array) -> Bodies:
    r = np.array([part.r for part in parts], dtype=np.int64)
    flexible = [part for part in parts if part.r]
    flex = np.zeros(len(parts), dtype=np.int64)
    kinds = {id(part.flexible): part for part in flexible}  # equal links share their tables
    flex[r > 0] = [list(kinds).index(id(part.flexible)) for part in flexible]
    flexible = list(kinds.values())
    tables = _flexible_tables(flexible, max(len(flexible), 1), R)
    return Bodies(
        _starts(7 + r),
        _starts(6 + r),
        r,
        flex,
        np.array([part.mass for part in parts]),
        np.array([part.first for part in parts]),
        np.array([part.second for part in parts]),
        *tables,
        np.array([bent(part) for part in parts], dtype=np.int64),
        *_second_order(flexible, max(len(flexible), 1), R),
        gravity,
    )


def _starts(lengths: Any) -> Any:
    return np.concatenate([[0], np.cumsum(lengths)[:-1]]).astype(np.int64)


def _flexible_tables(parts: list[Part], n: int, R: int) -> tuple[Array, ...]:
    S, S1, S2 = np.zeros((n, 3, R)), np.zeros((n, R, 9)), np.zeros((n, R, 9 * R))
    M, K, C = (np.zeros((n, R, R)) for _ in range(3))
    for f, part in enumerate(parts):
        body, r = part.flexible, part.r
        S[f, :, :r] = body.S
        S1[f, :r] = np.transpose(body.Ibar_kl, (2, 0, 1)).reshape(r, 9)
        S2[f, :r, : 9 * r] = np.transpose(body.S_kl, (2, 3, 0, 1)).reshape(r, 9 * r)
        M[f, :r, :r], K[f, :r, :r], C[f, :r, :r] = body.M, body.K, body.D
    return S, S1, S2, M, K, C


def bent(part: Part) -> bool:
    """Whether a body has displacements of second order, its geometric stiffness."""
    return bool(part.r and part.flexible.K_geo)


def _second_order(parts: list[Part], n: int, R: int) -> tuple[Array, Array]:
    """Tables T and T1 of `rom.mbs.kernels.system.Bodies`; empty when no body is stiffened."""
    R = R if any(map(bent, parts)) else 0
    T, T1 = np.zeros((n, R, 3 * R)), np.zeros((n, R, 9 * R))
    for f, part in enumerate(parts):
        if bent(part):
            psi, r = part.flexible.second_order(), part.r
            T[f, :r, : 3 * r] = np.transpose(psi.S, (1, 2, 0)).reshape(r, 3 * r)
            T1[f, :r, : 9 * r] = np.transpose(psi.Ibar, (2, 3, 0, 1)).reshape(r, 9 * r)
    return T, T1


def _bends(mechanism: Mechanism, handles: list[Marker], R: int) -> Array:
    """(k, 6, R, R) second-order motion of markers; empty when no body is stiffened."""
    bodies = {name: part for name, part in mechanism.parts.items() if bent(part)}
    motions = {name: part.flexible.second_order().markers for name, part in bodies.items()}
    bend = np.zeros((len(handles), 6, *2 * (R if bodies else 0,)))
    for k, marker in enumerate(handles):
        if marker.body in bodies and marker.place in motions[marker.body]:
            r = bodies[marker.body].r
            bend[k, :, :r, :r] = motions[marker.body][marker.place]
    return bend


def _markers(mechanism: Mechanism, handles: list[Marker], R: int) -> Markers:
    order = {name: b for b, name in enumerate(mechanism.parts)} | {GROUND: -1}
    shape, twist = np.zeros((len(handles), 3, R)), np.zeros((len(handles), 3, R))
    for k, marker in enumerate(handles):
        part = mechanism.part(marker.body)
        shape[k, :, : part.r], twist[k, :, : part.r] = part.shapes(marker)
    return Markers(
        np.array([order[m.body] for m in handles], dtype=np.int64),
        np.array([mechanism.part(m.body).point(m) for m in handles]),
        shape,
        twist,
        _bends(mechanism, handles, R),
    )


class _Coordinates:
    """Joint coordinates that something acts on, each once."""

    def __init__(self) -> None:
        self.found: list[tuple[tuple[Marker, Marker], Row]] = []

    def number(self, markers: tuple[Marker, ...], row: Row) -> int:
        """Number of the coordinate that ``row`` measures between two markers."""
        for k, (_, known) in enumerate(self.found):
            if known is row:
                return k
        self.found.append(((markers[0], markers[1]), row))
        return len(self.found) - 1

    def packed(self, index: dict[Marker, int]) -> Coordinates:
        """All of them as arrays."""
        rows = [row for _, row in self.found]
        return Coordinates(
            integers([row.kind for row in rows]),
            *(integers([index[m[side]] for m, _ in self.found]) for side in (0, 1)),
            *(table((getattr(row, axis) for row in rows), 3) for axis in "abc"),
            np.array([row.offset for row in rows], dtype=float),
        )


def _rows(
    mechanism: Mechanism, index: dict[Marker, int], coordinates: _Coordinates
) -> tuple[Rows, tuple[str, ...], list[Signal]]:
    entries, signals = [], list[Signal]()
    for pair, (name, joint) in enumerate(mechanism.joints.items()):
        entries += [(name, pair, joint, row, -1) for row in joint.rows]
    for name, drive in mechanism.drives.items():
        joint = mechanism.joints[drive.joint]
        pair = list(mechanism.joints).index(drive.joint)
        entries.append((name, pair, joint, joint.coordinate, len(signals)))
        signals.append(drive_signal(name, drive))
    sides = [[_marker(index, joint, row, k) for _, _, joint, row, _ in entries] for k in range(4)]
    joint_sides = [[index[j.markers[side]] for j in mechanism.joints.values()] for side in (0, 1)]
    rows = [row for _, _, _, row, _ in entries]
    terms = [_terms(joint, row, coordinates) for _, _, joint, row, _ in entries]
    packed = Rows(
        integers([row.kind for row in rows]),
        *(integers(side) for side in sides),
        *(table((getattr(row, axis) for row in rows), 3) for axis in "abc"),
        integers([at for at, _ in terms]).reshape(-1, 2),
        np.array([factor for _, factor in terms], dtype=float).reshape(-1, 2),
        np.array([row.offset for row in rows], dtype=float),
        integers([entry[4] for entry in entries]),
        integers([entry[1] for entry in entries]),
        integers(joint_sides[0]),
        integers(joint_sides[1]),
    )
    return packed, tuple(entry[0] for entry in entries), signals


def _marker(index: dict[Marker, int], joint: Joint, row: Row, k: int) -> int:
    """Marker of side k of a row; the two terms of a screw share the markers of their joint."""
    if k >= 2 and not row.terms:
        return -1
    return index[joint.markers[k % len(joint.markers)]]


def _terms(
    joint: Joint, row: Row, coordinates: _Coordinates
) -> tuple[tuple[int, int], tuple[float, float]]:
    """Joint coordinates of a coupling and their factors; the radius of a rolling row."""
    if not row.terms:
        return (-1, -1), (row.radius, 0.0)
    (one, f1), (two, f2) = row.terms
    markers = joint.markers
    at = coordinates.number(markers[:2], one), coordinates.number(markers[-2:], two)
    return at, (f1, f2)


def _forces(
    mechanism: Mechanism, index: dict[Marker, int], n_drives: int, coordinates: _Coordinates
) -> tuple[Forces, list[Signal]]:
    springs, loads, turns = mechanism.springs.values(), mechanism.loads, mechanism.turns.values()
    coiled = [mechanism.joints[t.joint] for t in turns]
    signals, at = list[Signal](), []
    for name, load in loads.items():
        at.append(n_drives + len(signals) if load.function else -1)
        signals += [load_signal(name, load.function)] if load.function else []
    forces = Forces(
        integers([index[s.i] for s in springs]),
        integers([index[s.j] for s in springs]),
        table([(s.stiffness, s.damping, s.free_length) for s in springs], 3),
        integers([index[load.marker] for load in loads.values()]),
        integers([load.kind for load in loads.values()]),
        table([load.vector for load in loads.values()], 3),
        integers(at),
        integers([coordinates.number(joint.markers, joint.turn) for joint in coiled]),
        table([(t.stiffness, t.damping, t.free_angle) for t in turns], 3),
    )
    return forces, signals
