"""From the described mechanism to the flat arrays of compiled code."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from rom import rotation
from rom.errors import ConfigError, ModelError, warn
from rom.mbs.elements.family import Asked, Family, Places, Sampled, integers, rows_of, starts
from rom.mbs.equations import renewal
from rom.mbs.equations.graph import graph_of
from rom.mbs.kernels.element_calls import ROW_WORDS
from rom.mbs.kernels.stages import STAGE_ADDRESSES
from rom.mbs.kernels.system import ALONG, LENGTHS, ROLL, Bodies, Graph, Markers, Rows, System
from rom.mbs.kernels.tables import Table
from rom.mbs.kernels.work import Work
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.bodies import GROUND, Marker, Part, moving_start
from rom.mbs.parts.joints import Joint, Row
from rom.mbs.parts.signals import Signal, drive_signal
from rom.model import Array, Index
from rom.names import check_known

FAR_JOINTS = 1e4  # sizes from the origin; reactions of a pendulum there miss 2e-5 of its weight
# coordinates up to which whole matrices are quicker where constraints repeat
MAX_SHARING_WHOLE = 100


@dataclass(frozen=True)
class Packed:
    """A mechanism ready to run."""

    system: System
    # the same with the frames of bodies that move in another one as further markers, which answers
    # need and steps do not
    seen: System
    names: tuple[str, ...]  # bodies in the order of the arrays
    markers: dict[Marker, int]  # row of each marker
    row_owner: tuple[str, ...]  # (m,) joint or drive of each constraint row
    signals: tuple[Signal, ...]  # functions of time, in the order of the arrays
    q: Array  # coordinates as given by the user
    v: Array  # velocities likewise
    length: float  # size of the mechanism [m]
    mass: float  # of all bodies [kg]
    elements: dict[Family, Any]  # {family: its table}, in the order of the arrays
    element_names: dict[Family, tuple[str, ...]]  # {family: names of its elements}
    asked: tuple[Asked, ...]  # laws that stay in Python
    places: Places  # where the arrays have what elements speak of

    @property
    def followed(self) -> int:
        """Joint coordinates and memories of laws that go from one instant to the next."""
        return int(self.system.coordinates.kind.size + self.system.memory.size)

    @property
    def loaded_rows(self) -> Index:
        """Constraint rows whose multipliers forces depend on."""
        return loaded_by(self.elements)

    def told(self, hook: str, *given: object) -> dict[str, Any]:
        """What the hook of that name says of each element, of `rom.mbs.elements.family.Hooks`."""
        return {
            name: said
            for family, tell, table in hooked(self.elements, hook)
            for name, said in zip(self.element_names[family], tell(table, *given), strict=True)
        }

    def answers(self) -> dict[str, Array]:
        """What each law of a user answered last."""
        found = self.told("answers").items()
        return {name: np.array(answer, dtype=float) for name, answer in found}

    @property
    def broken_laws(self) -> str:
        """In words, the elements that gave no finite number when asked last."""
        broken = [name for name, x in self.answers().items() if not np.isfinite(x).all()]
        message = ""
        for family, own in self.element_names.items():
            names = [repr(name) for name in own if name in broken]
            message += f"; {family.hooks.lost.format(', '.join(names))}" if names else ""
        return message

    @property
    def by_rate(self) -> bool:
        """Whether forces depend on rates in a way that the tangents do not know completely."""
        return any(family.by_rate(table) for family, table in self.elements.items())

    @property
    def has_potential(self) -> bool:
        """Whether forces of elements, dampers aside, follow from a potential."""
        return all(family.hooks.potential for family in self.elements)

    @contextmanager
    def eased(self) -> Iterator[bool]:
        """Elements come to rest more easily, as long as this lasts; says whether some do."""
        with ExitStack() as stack:
            found = hooked(self.elements, "eased")
            yield any([stack.enter_context(ease(table)) for _, ease, table in found])

    @property
    def room(self) -> dict[str, float]:
        """Gaps of elements at the last residual, over those in the middle [1]."""
        return {name: float(left) for name, left in self.told("room").items()}

    @property
    def remembering(self) -> tuple[str, ...]:
        """Elements whose forces depend on the past, other than by angles that go on."""
        return tuple(name for name, does in self.told("remembers").items() if does)

    def kept(self, base: Array) -> Array:
        """(n_t,) energy that springs which slip keep of the work lost, for `Solution.base` [J]."""
        memory = base[:, self.system.coordinates.kind.size :]
        found = (keep(table, memory) for _, keep, table in hooked(self.elements, "kept"))
        return sum(found, np.zeros(len(base)))

    def phases(self, W: Work) -> dict[str, float]:
        """Numbers at the last residual that go on by whole ones in motions that repeat [1]."""
        return {name: float(phase) for name, phase in self.told("phases", W).items()}

    def rows_of(self, joint: str) -> Index:
        """Numbers of the constraint rows of a joint or drive."""
        return np.array([k for k, owner in enumerate(self.row_owner) if owner == joint], dtype=int)

    @cached_property
    def row_scale(self) -> Array:
        """(m,) length of the mechanism for rows that measure lengths, one for the others."""
        rows = self.system.rows
        slides = [k >= 0 and self.system.coordinates.kind[k] == ALONG for k in rows.at[:, 0]]
        lengths = np.isin(rows.kind, LENGTHS) | np.array(slides, dtype=bool)
        return np.where(lengths, self.length, 1.0)

    @cached_property
    def unit(self) -> Array:
        """(n,) motion of each coordinate by one rad, or by the length of the mechanism."""
        bodies, unit = self.system.bodies, np.ones(self.v.size)
        for b, (at, r) in enumerate(zip(bodies.v_at, bodies.r, strict=True)):
            modal = np.diag(bodies.M[bodies.flex[b]])[:r]
            unit[at : at + 3] = self.length
            unit[at + 6 : at + 6 + r] = self.length * np.sqrt(bodies.mass[b] / modal)
        return unit

    def apart(self, q: Array, other: Array) -> Array:
        """(n,) motion that leads from coordinates q (n_q,) to other ones, as `retract` takes it."""
        bodies, out = self.system.bodies, np.zeros(self.v.size)
        for at, to, r in zip(bodies.q_at, bodies.v_at, bodies.r, strict=True):
            turn = rotation.multiply(q[at + 3 : at + 7] * [1, -1, -1, -1], other[at + 3 : at + 7])
            out[to : to + 3] = other[at : at + 3] - q[at : at + 3]
            out[to + 3 : to + 6] = rotation.log(turn / np.linalg.norm(turn))
            out[to + 6 : to + 6 + r] = other[at + 7 : at + 7 + r] - q[at + 7 : at + 7 + r]
        return out

    @property
    def graph(self) -> Graph:
        """How the equations are stored and solved."""
        return self.system.graph

    @property
    def by_blocks(self) -> bool:
        """Whether the equations are stored and solved body by body, joint by joint."""
        return bool(self.graph.compact)

    @property
    def shares(self) -> bool:
        """Whether constraints in blocks may repeat others."""
        return bool(self.graph.shares)

    def whole(self) -> "Packed":
        """The same with whole matrices."""
        graph = graph_of(self.system, self.coupled(), whole=True)
        return replace(self, system=self.system.replace(graph=graph))

    def sharing(self) -> "Packed":
        """The same where constraints repeat others: of many coordinates still in blocks."""
        if self.v.size <= MAX_SHARING_WHOLE:
            return self.whole()
        return replace(self, system=self.system.replace(graph=self.graph.replace(shares=1)))

    def of_rank(self, rank: int) -> "Packed":
        """The same, ready for as many independent constraints as a start has found."""
        surely = not self.by_blocks or self.shares or rank == self.system.rows.kind.size
        return self if surely else self.sharing()

    def rows_solved(self, rank: int) -> int:
        """Number of constraints in the equations: in blocks all, whole the independent ones."""
        return int(self.system.rows.kind.size) if self.by_blocks else rank

    def coupled(self) -> list[Sequence[int]]:
        """Groups of bodies that elements couple."""
        return coupled_by(self.elements, self.system.markers.body)

    def refuse_rolling(self, message: str, hint: str = "") -> None:
        """Refuse joints that roll, naming the first, where positions alone may be bound."""
        rolls = self.system.rows.kind == ROLL
        if rolls.any():
            raise ModelError(message, where=self.row_owner[int(np.argmax(rolls))], hint=hint)

    def marker(self, place: str) -> Marker:
        """The marker "body.place"."""
        known = {f"{marker.body}.{marker.place}": marker for marker in self.markers}
        known |= {m.body: m for m in self.markers if m.place == (0.0, 0.0, 0.0)}
        check_known(place, known, "no such marker; there are")
        return known[place]

    def row(self, marker: Marker) -> int:
        """Row of a marker in the arrays."""
        return self.markers[marker]


def pack(
    mechanism: Mechanism,
    *,
    whole: bool = False,
    sampled: bool = False,
    watched: Sequence[tuple[str, Row]] = (),
) -> Packed:
    """Write the mechanism into arrays; whole matrices if wanted, else blocks where they pay.

    Laws that are ``sampled`` are refused where no samples are taken. ``watched`` are joints and
    coordinates to be followed in any case.
    """
    parts = tuple(mechanism.parts.values())
    if not parts:
        raise ConfigError("the mechanism has no body.", hint="Use add_rigid or add_flexible.")
    handles = _all_markers(mechanism, parts)
    seen = [*handles, *(part.own_frame for part in parts if part.own_frame)]
    index = {marker: k for k, marker in enumerate(seen)}
    R, number = max(part.r for part in parts), {name: b for b, name in enumerate(mechanism.parts)}
    places = Places(number, index, mechanism.joints, R)
    rows = _rows(mechanism, places)
    _doubt_place(mechanism, _length(parts))
    families = mechanism.families()
    elements = {family: family.pack(found, places) for family, found in families.items()}
    for one in (*mechanism.events.values(), *mechanism.fmus.values()):
        for joint, row in one.coordinates:
            places.coordinate(joint, row)
    needed = len(places.coordinates)
    for joint, row in watched:
        places.coordinate(joint, row)
    places.watched = len(places.coordinates) - needed
    asked = tuple(
        law
        for family, table in elements.items()
        for law in places.asked(family, families[family], table)
    )
    held = [law.name for law in asked if isinstance(law, Sampled)]
    if held and not sampled:
        text = f"{held[0]!r} is sampled: only in rom.simulate does it take values."
        hint = "Leave out every=, or rom.release a state of the mechanism without it into this one."
        raise ConfigError(text, hint=hint)
    markers = _markers(mechanism, handles, R)
    system = System(
        STAGE_ADDRESSES,
        _bodies(parts, R, np.asarray(mechanism.gravity, dtype=float)),
        markers,
        rows,
        places.packed_coordinates(),
        integers(family.row(table) for family, table in elements.items()).reshape(-1, ROW_WORDS),
        int(loaded_by(elements).size > 0),
        np.concatenate([np.zeros(0), *places.remembered.values()]),
        _renewed(elements, sum(6 + part.r for part in parts)),
    )
    system = system.replace(graph=graph_of(system, coupled_by(elements, markers.body), whole=whole))
    return Packed(
        system,
        system.replace(markers=_markers(mechanism, seen, R)),
        tuple(mechanism.parts),
        index,
        tuple(places.owners),
        tuple(places.signals),
        *map(np.concatenate, zip(*map(moving_start, parts), strict=True)),
        max([_length(parts), *(whole.reach for whole in mechanism.nonlinear.values())]),
        sum(part.mass for part in parts),
        elements,
        {family: tuple(found) for family, found in families.items()},
        asked,
        places,
    )


def hooked(elements: Mapping[Family, Table], hook: str) -> list[tuple[Family, Any, Table]]:
    """The families that have a hook of that name, with it and their tables."""
    found = ((family, getattr(family.hooks, hook), table) for family, table in elements.items())
    return [one for one in found if one[1] is not None]


def loaded_by(elements: Mapping[Family, Table]) -> Index:
    """Constraint rows whose multipliers forces depend on."""
    rows = [find(table) for _, find, table in hooked(elements, "loaded_rows")]
    return np.concatenate([np.zeros(0, dtype=np.int64), *rows])


def _renewed(elements: Mapping[Family, Any], n: int) -> Index:
    """(k, 2) markers of elements with tangents renewed in a step; none where it does not pay."""
    tables = [table for family, table in elements.items() if family.pair_tangents]
    pairs = [np.column_stack([table.i, table.j]) for table in tables]
    found = np.concatenate([np.zeros((0, 2), dtype=np.int64), *pairs])
    pays = n >= renewal.MIN_VELOCITIES and len(found) <= renewal.MAX_RENEWED
    return found if pays else found[:0]


def coupled_by(elements: dict[Family, Table], body: Index) -> list[Sequence[int]]:
    """Groups of bodies that elements couple, -1 for the ground."""
    return [group for family, table in elements.items() for group in family.couples(table, body)]


def _all_markers(mechanism: Mechanism, parts: tuple[Part, ...]) -> list[Marker]:
    """Every named marker, every marker in use, and the origin of every body."""
    found = [Marker(part.name, name) for part in parts for name in part.names]
    found += [m for joint in mechanism.joints.values() for m in joint.markers]
    found += [m for family, x in mechanism.elements.values() for m in family.ends(x)]
    found += [m for event in mechanism.events.values() for m in event.markers]
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
    kinds = {id(part.moving): part for part in flexible}  # equal links share their tables
    flex[r > 0] = [list(kinds).index(id(part.moving)) for part in flexible]
    flexible = list(kinds.values())
    tables = _flexible_tables(flexible, max(len(flexible), 1), R)
    return Bodies(
        starts(7 + r)[:-1],
        starts(6 + r)[:-1],
        r,
        flex,
        *(np.array([getattr(part, x) for part in parts]) for x in ("mass", "first", "second")),
        *tables,
        np.array([bent(part) for part in parts], dtype=np.int64),
        *_second_order(flexible, max(len(flexible), 1), R),
        gravity,
    )


def _flexible_tables(parts: list[Part], n: int, R: int) -> tuple[Array, ...]:
    S, S1, S2 = np.zeros((n, 3, R)), np.zeros((n, R, 9)), np.zeros((n, R, 9 * R))
    M, K, C = (np.zeros((n, R, R)) for _ in range(3))
    for f, part in enumerate(parts):
        body, r = part.moving, part.r
        S[f, :, :r] = body.S
        S1[f, :r] = np.transpose(body.Ibar_kl, (2, 0, 1)).reshape(r, 9)
        S2[f, :r, : 9 * r] = np.transpose(body.S_kl, (2, 3, 0, 1)).reshape(r, 9 * r)
        M[f, :r, :r], K[f, :r, :r], C[f, :r, :r] = body.M, body.K, body.D
    return S, S1, S2, M, K, C


def bent(part: Part) -> bool:
    """Whether a body has displacements of second order, its geometric stiffness."""
    return bool(part.r and part.moving.K_geo)


def _second_order(parts: list[Part], n: int, R: int) -> tuple[Index, Array, Array]:
    """Tables H_at, H and T1 of `rom.mbs.kernels.system.Bodies`; empty when no body is stiffened."""
    R = R if any(map(bent, parts)) else 0
    H_at, H, T1 = np.zeros(n, dtype=np.int64), [np.zeros(0)], np.zeros((n, R, 9 * R))
    for f, part in enumerate(parts):
        H_at[f] = sum(map(len, H))
        if bent(part):
            body, psi, r = part.moving, part.moving.second_order(), part.r
            share = np.linalg.solve(body.M, psi.N.reshape(r, -1)).reshape(r, r, r)
            remainder = psi.Ibar - np.einsum("abm,mkl->abkl", body.Ibar_kl, share)
            remainder = 0.5 * (remainder + remainder.swapaxes(0, 1))  # on mean axes nothing turns
            T1[f, :r, : 9 * r] = np.transpose(remainder, (2, 3, 0, 1)).reshape(r, 9 * r)
            H.append(np.transpose(share, (2, 0, 1)).ravel())
    return H_at, np.concatenate(H), T1


def _markers(mechanism: Mechanism, handles: list[Marker], R: int) -> Markers:
    order = {name: b for b, name in enumerate(mechanism.parts)} | {GROUND: -1}
    parts, n = [mechanism.part(marker.body) for marker in handles], len(handles)
    stiffened = {name: part.moving for name, part in mechanism.parts.items() if bent(part)}
    motions = {name: body.second_order().markers for name, body in stiffened.items()}
    shape, twist = np.zeros((n, 3, R)), np.zeros((n, 3, R))
    bend = np.zeros((n, 6, *2 * (R if motions else 0,)))
    fit, fitted = np.full(n, -1, dtype=np.int64), list[Array]()
    for k, (marker, part) in enumerate(zip(handles, parts, strict=True)):
        r = part.r
        shape[k, :, :r], twist[k, :, :r] = part.shapes(marker)
        if marker.place in motions.get(marker.body, ()):
            bend[k, :, :r, :r] = motions[marker.body][marker.place]
        covariance = part.covariance(marker)
        if covariance is not None:
            fit[k] = len(fitted)
            fitted.append(np.pad(covariance.reshape(9, -1), ((0, 0), (0, R - r))))
    body = integers(order[marker.body] for marker in handles)
    points = np.array([part.point(m) for m, part in zip(handles, parts, strict=True)])
    covariances = np.array(fitted).reshape(len(fitted), 9, 1 + R)
    return Markers(body, points, shape, twist, bend, fit, covariances)


def _rows(mechanism: Mechanism, places: Places) -> Rows:
    """The constraint rows; their owners and the functions of drives go to the places."""
    entries, index = [], places.marker
    for pair, (name, joint) in enumerate(mechanism.joints.items()):
        entries += [(name, pair, joint, row, -1) for row in joint.rows]
    for name, drive in mechanism.drives.items():
        joint = mechanism.joints[drive.joint]
        pair = list(mechanism.joints).index(drive.joint)
        entries.append((name, pair, joint, joint.coordinate, len(places.signals)))
        places.signals.append(drive_signal(name, drive))
    sides = [[_marker(index, joint, row, k) for _, _, joint, row, _ in entries] for k in range(4)]
    joints = mechanism.joints.values()
    rows = [row for _, _, _, row, _ in entries]
    terms = [_terms(joint, row, places) for _, _, joint, row, _ in entries]
    places.owners.extend(entry[0] for entry in entries)
    return Rows(
        integers([row.kind for row in rows]),
        *(integers(side) for side in sides),
        *(rows_of((getattr(row, axis) for row in rows), 3) for axis in "abc"),
        integers([at for at, _ in terms]).reshape(-1, 2),
        np.array([factor for _, factor in terms], dtype=float).reshape(-1, 2),
        np.array([row.offset for row in rows], dtype=float),
        *(integers(entry[k] for entry in entries) for k in (4, 1)),
        *(integers(index[joint.markers[side]] for joint in joints) for side in (0, 1)),
    )


def _marker(index: dict[Marker, int], joint: Joint, row: Row, k: int) -> int:
    """Marker of side k of a row; the two terms of a screw share the markers of their joint."""
    if k >= 2 and not row.terms:
        return -1
    return index[joint.markers[k % len(joint.markers)]]


def _terms(joint: Joint, row: Row, places: Places) -> tuple[tuple[int, int], tuple[float, float]]:
    """Joint coordinates of a coupling and their factors; the radius of a rolling row."""
    if not row.terms:
        return (-1, -1), (row.radius, 0.0)
    (one, f1), (two, f2) = row.terms
    markers = joint.markers
    return (places.between(markers[:2], one), places.between(markers[-2:], two)), (f1, f2)
