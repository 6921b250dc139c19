"""A slender body as several reduced ones in a chain or tree, each in a floating frame of its own.

The rotation that one frame carries is limited by its shapes; pieces share it. Sections between two
pieces are welded in the mean: their centres and axes are one, and what the loads of a rod do to
them, warping and lateral strain, stays free. A piece is trained for the loads that reach it: those
of the whole, moved to its far section, and turned, because its frame turns::

    f,   m + arm x f    at the section, of each the largest of either sign

See docs/theory/pieces.md.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product, takewhile
from typing import Any

import numpy as np

from rom import rotation
from rom.arguments import start_pose, typed
from rom.body.damping import ModalDamping, Rayleigh
from rom.body.flexible import FlexibleBody
from rom.body.nonlinear.ranges import Geometric
from rom.errors import ConfigError, InterfaceError, ModelError
from rom.model import Array, FEModel, Mask, Report
from rom.names import check_all_known, check_known, check_name, named
from rom.reduction.bases.method import Method
from rom.workflow import ENOUGH_MODES, reduce

SAME_RTOL = 1e-9  # of places and matrices of pieces that repeat each other


@typed
@dataclass(frozen=True)
class Pieces:
    """Reduced bodies that are one body, for a mechanism.

    Attributes:
        bodies: by name of the piece.
        joints: {interface: the two pieces that meet there}.
        places: {piece: (3,) its origin in the coordinates of the whole [m]}, zero if missing.
        certificate: evidence that together they stand for the whole, see `rom.certify_pieces`.
    """

    bodies: dict[str, FlexibleBody]
    joints: dict[str, tuple[str, str]]
    places: dict[str, Array] = field(default_factory=dict)
    certificate: Report | None = None

    def __repr__(self) -> str:
        n = sum(body.n_modes for body in self.bodies.values())
        return f"Pieces({len(self.bodies)} bodies with {n} coordinates, {len(self.joints)} welds)"

    @property
    def mass(self) -> float:
        """Mass of the whole [kg]."""
        return float(sum(body.mass for body in self.bodies.values()))

    def add_to(self, mech: Any, name: str, **pose: Any) -> dict[str, Any]:
        """Add all bodies to a mechanism, welded to each other.

        They are called "name piece" there, the welds "name interface". Given back are
        {interface: its marker} of the interfaces that are no welds.

        Args:
            mech: the `rom.Mechanism`.
            name: of the whole.
            pose: ``at``, ``orientation``, ``velocity`` and ``omega`` of the whole at the start, see
                `rom.Mechanism.add_flexible`.

        Raises:
            ConfigError: see `rom.Mechanism.add_flexible`; for elastic coordinates, which each
                piece has of its own.

        Example:
            >>> beam = {"material": rom.Material(E=2e11, nu=0, rho=7850), "parameters": {"lc": 0.1}}
            >>> halves = rom.fe.pieces("meshes/beam.geo", n=2, axis=(1, 0, 0), **beam)
            >>> pieces = rom.reduce_pieces(halves, reference="root")
            >>> markers = pieces.add_to(mech := rom.Mechanism(), "beam")
            >>> markers["tip"].body, list(mech.joints)
            ('beam 2', ['beam cut 1'])
        """
        if not hasattr(mech, "add_flexible"):
            raise ConfigError(f"mech = {mech!r:.60} is no Mechanism; give one of rom.Mechanism.")
        check_name(name, "a body")
        check_all_known(pose, ("at", "orientation", "velocity", "omega"), "pieces take no")
        added, pose_of = mech.add_flexible, self._pose_of
        parts = {k: added(f"{name} {k}", x, **pose_of(k, pose)) for k, x in self.bodies.items()}
        for joint, (one, other) in self.joints.items():
            mech.fixed(f"{name} {joint}", parts[one].marker(joint), parts[other].marker(joint))
        owner = {interface: key for key, body in self.bodies.items() for interface in body.markers}
        return {i: parts[key].marker(i) for i, key in owner.items() if i not in self.joints}

    def _pose_of(self, key: str, pose: dict[str, Any]) -> dict[str, Any]:
        """The pose of one piece where the whole has another."""
        place = self.places.get(key, np.zeros(3))
        if not np.any(place):
            return pose
        moving = (pose.get(of) for of in ("orientation", "velocity", "omega"))
        at, p, velocity, omega = start_pose(pose.get("at", (0.0, 0.0, 0.0)), *moving)
        A = rotation.matrix(p)
        velocity = velocity + A @ np.cross(omega, place)
        return {"at": at + A @ place, "orientation": p, "velocity": velocity, "omega": omega}


@dataclass(frozen=True)
class Repeated:
    """A piece that is another one elsewhere."""

    of: str  # name of the other one
    shift: Array  # (3,) from its place to this one [m]
    interfaces: dict[str, str]  # {interface: that of the other one}

    @classmethod
    def found(
        cls, key: str, others: Iterable[str], models: Mapping[str, FEModel], tree: "Tree"
    ) -> "Repeated | None":
        """The first of the pieces before it that a piece repeats in nodes and matrices."""
        model, seen = models[key], tree.reference
        for name in takewhile(lambda name: name != key, others):
            other = models[name]
            if other.points.shape != model.points.shape or model.attachments or other.attachments:
                continue
            shift = (model.points - other.points).mean(axis=0)
            gaps = np.abs(model.points - other.points - shift).max()
            pairs = product(model.interfaces.values(), other.interfaces.values())
            same = {a.name: b.name for a, b in pairs if np.array_equal(a.nodes, b.nodes)}
            paired = len(same) == len(model.interfaces) == len(other.interfaces)
            near = gaps <= SAME_RTOL * np.ptp(model.points)
            if not (near and paired and same[seen[key]] == seen[name]):
                continue
            if _equal(model.K, other.K) and _equal(model.M, other.M):
                return cls(name, shift, same)
        return None


def _equal(A: Any, B: Any) -> bool:
    """Whether two sparse matrices of one process are the same but for round-off."""
    if not (hasattr(A, "tocsr") and hasattr(B, "tocsr")):
        return False
    return bool(abs(A - B).max() <= SAME_RTOL * abs(A).max())


@dataclass(frozen=True)
class Tree:
    """Pieces in the order in which they hang on the one with the reference."""

    reference: dict[str, str]  # {piece: interface on which its frame sits}, parents first
    # {interface: its two pieces, the nearer one to the reference first}
    joints: dict[str, tuple[str, str]]

    @classmethod
    def of(cls, models: Mapping[str, FEModel], reference: str) -> "Tree":
        """That of pieces which meet in interfaces of one name."""
        if len(models) < 2:
            hint = 'Cut it: rom.fe.pieces("beam.geo", n=4, axis=(1, 0, 0), material=steel).'
            raise ConfigError(f"{len(models)} pieces are no body cut into pieces.", hint=hint)
        owners: dict[str, list[str]] = {}
        for key, model in models.items():
            for interface in model.interfaces:
                owners.setdefault(interface, []).append(key)
        for interface, keys in owners.items():
            if len(keys) > 2:
                raise InterfaceError(f"{interface!r} is of {named(keys)}; at most two pieces meet.")
        free = [interface for interface, keys in owners.items() if len(keys) == 1]
        what = f"reference = {reference!r} is no interface of one piece alone; they have"
        check_known(reference, free, what, InterfaceError)
        found, joints = {owners[reference][0]: reference}, dict[str, tuple[str, str]]()
        waiting = [owners[reference][0]]
        while waiting:
            here = waiting.pop(0)
            for interface in models[here].interfaces:
                if len(owners[interface]) == 1 or interface in joints:
                    continue
                (there,) = (key for key in owners[interface] if key != here)
                if there in found:
                    text = f"the pieces form a ring that closes at {interface!r}"
                    hint = "Reduce each by rom.reduce with loads of its own, and weld them."
                    raise ModelError(f"{text}: which loads pass there is unknown.", hint=hint)
                found[there], joints[interface] = interface, (here, there)
                waiting.append(there)
        if loose := [key for key in models if key not in found]:
            text = f"piece {named(loose)} does not hang on that with {reference!r}"
            raise InterfaceError(f"{text}; give interfaces that meet one name in both models.")
        return cls(found, joints)

    def beyond(self, joint: str) -> list[str]:
        """Names of the pieces that hang on a joint."""
        found = [self.joints[joint][1]]
        for one, other in self.joints.values():  # nearer ones come first
            if one in found:
                found.append(other)
        return found

    def ranges(
        self, geometric: Geometric, models: Mapping[str, FEModel]
    ) -> dict[str, Geometric | None]:
        """{piece: the loads of the whole that reach it}, None for a piece that none reaches."""
        if geometric.fixed:
            text = f"fixed = {geometric.fixed!r}: not known with supports beside the reference"
            raise ConfigError(f"{text}; name as loads what they bear at most, and leave fixed out.")
        if np.any(geometric.spin):
            text = f"spin = {geometric.spin!r}: which centrifugal force pulls where is not known"
            raise ConfigError(f"{text}; name it as a load of the interface farthest out.")
        owner = {interface: key for key, model in models.items() for interface in model.interfaces}
        owner = {interface: key for interface, key in owner.items() if interface not in self.joints}
        for name in geometric.loads:
            what = f"the range of loads names {name!r}; the pieces have"
            check_known(name, owner, what, InterfaceError)
        largest = {name: np.abs(np.asarray(x, dtype=float)) for name, x in geometric.loads.items()}
        loads: dict[str, dict[str, Array]] = {key: {} for key in self.reference}
        for name, load in largest.items():
            loads[owner[name]][name] = load
        for joint, (one, _) in self.joints.items():
            beyond, at = self.beyond(joint), models[one].interfaces[joint].origin
            far = [name for name in largest if owner[name] in beyond]
            arms = (models[owner[name]].interfaces[name].origin - at for name in far)
            moved = (_moved(largest[name], arm) for name, arm in zip(far, arms, strict=True))
            loads[one][joint] = sum(moved, start=np.zeros(6))
        turning = sum((six[3:] for of in loads.values() for six in of.values()), np.zeros(3)) > 0
        first = next(iter(self.reference))
        found: dict[str, Geometric | None] = {}
        for key, of in loads.items():
            own = {name: six for name, six in of.items() if six.any()}
            if key != first:
                own = {name: _turned(six, turning) for name, six in own.items()}
            found[key] = replace(geometric, loads=own) if own else None
        return found

    def repeated(
        self, models: Mapping[str, FEModel], kinds: Mapping[str, Any]
    ) -> dict[str, Repeated]:
        """{piece: the one that it repeats} for those that repeat another, interfaces alike."""
        found = dict[str, Repeated]()
        for key in self.reference:
            one = Repeated.found(key, [k for k in self.reference if k not in found], models, self)
            if one and all(kinds.get(a) == kinds.get(b) for a, b in one.interfaces.items()):
                found[key] = one
        return found


def together(
    own: Geometric | None, copies: Iterable[tuple[Geometric | None, Repeated]]
) -> Geometric | None:
    """The largest loads of a piece and of those that repeat it, None for none."""
    loads = {} if own is None else dict(own.loads)
    for range_, one in copies:
        for name, six in ({} if range_ is None else range_.loads).items():
            at = one.interfaces[name]
            loads[at] = np.maximum(six, loads.get(at, 0.0))
            own = own or range_
    return None if own is None else replace(own, loads=loads)


@typed
def reduce_pieces(
    models: Mapping[str, FEModel],
    *,
    reference: str,
    method: Method = ENOUGH_MODES,
    interfaces: dict[str, Any] | None = None,
    nonlinear: Geometric | None = None,
    damping: Rayleigh | ModalDamping | None = None,
    certify: bool = True,
) -> Pieces:
    """Reduced bodies of the pieces of one solid, for rotations beyond what one frame carries.

    Args:
        models: {name: piece} of `rom.fe.pieces`, or any others that have an interface of one name
            where they meet.
        reference: interface at which the whole is held, or that turns least; each piece is seen
            from its section towards it.
        method: how to reduce each of them.
        interfaces: {name: kind}; "rbe3" for all that are not named.
        nonlinear: the loads of the whole under which it is to deflect far; each piece is made for
            those that reach its sections. Pieces that repeat each other are reduced once, for the
            largest loads of any of them.
        damping: structural damping of each.
        certify: compare each piece with its full model.

    Raises:
        RomError: for pieces that do not hang together, or form a ring; see `reduce`.

    Example:
        >>> beam = {"n": 2, "axis": (1, 0, 0), "material": rom.Material(E=2e11, nu=0, rho=7850.0)}
        >>> beam["parameters"] = {"hex": 1, "nx": 8, "ny": 1, "nz": 1}
        >>> models = rom.fe.pieces("meshes/beam.geo", **beam)
        >>> rom.reduce_pieces(models, reference="root", method=rom.CraigBampton(n_modes=2))
        Pieces(2 bodies with 16 coordinates, 1 welds)
    """
    tree = Tree.of(models, reference)
    ranges = dict.fromkeys(models) if nonlinear is None else tree.ranges(nonlinear, models)
    every = {interface: "rbe3" for model in models.values() for interface in model.interfaces}
    kinds, bodies = every | (interfaces or {}), dict[str, FlexibleBody]()
    for name in kinds:
        check_known(name, every, f"there is no interface {name!r}; the pieces have", InterfaceError)
    repeated = tree.repeated(models, kinds)
    reduced = partial(reduce, method=method, damping=damping, certify=certify)
    for name, seen_from in tree.reference.items():
        if name in repeated:
            continue
        copies = [(ranges[key], one) for key, one in repeated.items() if one.of == name]
        loads = together(ranges[name], copies)
        own = {key: kinds[key] for key in models[name].interfaces}
        bodies[name] = reduced(
            models[name], name=name, reference=seen_from, nonlinear=loads, interfaces=own
        )
    for key, one in repeated.items():
        body, own = bodies[one.of], {old: name for name, old in one.interfaces.items()}
        markers = {name: replace(body.markers[old], name=name) for old, name in own.items()}
        bodies[key] = replace(body, name=key, markers=markers, reference=own[body.reference])
    places = {key: one.shift for key, one in repeated.items()}
    return Pieces({name: bodies[name] for name in models}, tree.joints, places)


def _moved(load: Array, arm: Array) -> Array:
    """(6,) largest force and moment at a point from those (6,) that act at an arm from it."""
    x, y, z = np.abs(arm)
    cross = np.array([[0, z, y], [z, 0, x], [y, x, 0]])
    return np.concatenate([load[:3], load[3:] + cross @ load[:3]])


def _turned(load: Array, turning: Mask) -> Array:
    """Largest force and moment (6,) in a frame that turns about some of the axes (3,)."""
    if np.count_nonzero(turning) > 1:
        return np.repeat([np.linalg.norm(load[:3]), np.linalg.norm(load[3:])], 3)
    found, across = load.copy(), np.flatnonzero(~turning)
    found[across] = np.linalg.norm(load[across])
    return found
