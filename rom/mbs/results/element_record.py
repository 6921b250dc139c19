"""What a single force element, or law of the user, does along a motion: asked again."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rom.arguments import AnySolution
from rom.errors import ConfigError
from rom.mbs.elements.family import Family, Places, apply_laws
from rom.mbs.elements.law_calls import answer_of
from rom.mbs.elements.laws import LAWS_FAMILY
from rom.mbs.equations.equations import element_energy
from rom.mbs.kernels.compiled import copy, inner, kernel
from rom.mbs.kernels.element_calls import residuals
from rom.mbs.kernels.system import ALONG
from rom.mbs.kernels.work import workspace
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.bodies import Marker
from rom.mbs.parts.signals import sample_all
from rom.mbs.results.recomputed import at_instants, evaluate_at
from rom.model import Array, Index
from rom.names import check_known

INSTANT_SPACING = 1e-6  # of differences of drives about a single instant [s]


@dataclass(frozen=True)
class ElementRecord:
    """One spring, motor, contact, load or other force element over time.

    Attributes:
        t: (n_t,) times [s].
        markers: the K markers it acts on; of an element on a joint, those of the joint.
        force, moment: (n_t, K, 3) on each of them, about it, world [N, N m].
        along: (n_t,) of an element on a joint, the torque [N m] or force [N] along its coordinate;
            of one between two markers, the force with which it pulls them together [N]; None for
            others.
        along_unit: "N m" along an angle, else "N".
        on_joint: whether it acts along the coordinate of a joint.
        energy: (n_t,) stored [J].
        lost: (n_t,) power turned into heat [W].
    """

    t: Array
    markers: tuple[Marker, ...]
    force: Array
    moment: Array
    along: Array | None
    along_unit: str
    on_joint: bool
    energy: Array
    lost: Array


@dataclass(frozen=True)
class LawRecord:
    """One law over time.

    Attributes:
        t: (n_t,) times [s].
        force, moment: (n_t, K, 3) on each of its markers, about it, world [N, N m].
        energy: (n_t,) stored [J]; lost: (n_t,) power turned into heat [W].
        memory: (n_t, m) what it remembers.
        outputs: {name: (n_t,)} its own outputs; they and the losses follow from what it remembered
            at the saved instant before.
    """

    t: Array
    force: Array
    moment: Array
    energy: Array
    lost: Array
    memory: Array
    outputs: dict[str, Array]


def law_record(solution: AnySolution, name: str) -> LawRecord:
    """Ask a law again at all instants of a motion."""
    law = solution.mechanism.laws[name]
    table = solution.packed.elements[LAWS_FAMILY]
    e = list(solution.mechanism.families()[LAWS_FAMILY]).index(name)
    mine = slice(*table.answer_at[e : e + 2])
    c, base = solution.packed.system.coordinates.kind.size, solution.base.copy()
    base[1:, c:] = solution.base[:-1, c:]
    n, m, _ = law.sizes
    force, moment, energy, _, memory, _ = _said(solution, table, mine, (n, m))
    _, _, _, lost, _, outputs = _said(replace(solution, base=base), table, mine, (n, m))
    own = dict(zip(law.outputs, outputs.T, strict=True))
    return LawRecord(solution.t, force, moment, energy[:, 0], lost[:, 0], memory, own)


def _said(solution: AnySolution, table: Any, mine: slice, sizes: tuple[int, int]) -> list[Array]:
    """The fields of the answers at all instants."""
    rows = [table.answer[mine].copy() for _ in at_instants(solution)]
    answers = (answer_of(row, *sizes) for row in rows)
    return [np.array(field) for field in zip(*answers, strict=True)]


def element_record(solution: AnySolution, name: str) -> ElementRecord:
    """Evaluate one element along a motion."""
    mechanism = solution.mechanism
    check_known(name, mechanism.elements, f"no element {name!r}; there are")
    family, element = mechanism.elements[name]
    markers = markers_of(mechanism, family, element)
    if not markers:
        text = f"{name!r} of the {family.name} acts on whole bodies, not on markers"
        raise ConfigError(f"{text}; see interface_loads for what acts on interfaces.")
    rows = np.array([solution.packed.row(marker) for marker in markers])
    if family is not LAWS_FAMILY:
        return _alone(solution, name, markers, rows)
    law = law_record(solution, name)
    along = pull(np.array([W.P[rows] for W in at_instants(solution)]), law.force)
    loads = law.force, law.moment, along, "N", False
    return ElementRecord(solution.t, markers, *loads, law.energy, law.lost)


def markers_of(mechanism: Mechanism, family: Family, element: object) -> tuple[Marker, ...]:
    """The markers an element acts on, its own or those of its joint."""
    joint = mechanism.joints.get(getattr(element, "joint", ""))
    return tuple(family.ends(element)) or (() if joint is None else tuple(joint.markers))


def _alone(
    solution: AnySolution, name: str, markers: tuple[Marker, ...], rows: Index
) -> ElementRecord:
    """The element as the only one of its mechanism, in the motion of the whole."""
    packed, places = solution.packed, solution.packed.places.copy()
    family, element = solution.mechanism.elements[name]
    table = family.pack({name: element}, places)
    asked = tuple(places.asked(family, {name: element}, table))
    system = packed.system.replace(elements=np.array([family.row(table)], dtype=np.int64))
    W = workspace(system, len(places.signals))
    signals = np.concatenate([solution.signals, _sampled(solution, places)], axis=1)
    joint = solution.mechanism.joints.get(getattr(element, "joint", ""))
    row = None if joint is None else getattr(element, "row", joint.turn)
    c = -1 if row is None else places.coordinate(element.joint, row)
    n = solution.t.size
    # wrenches and positions of the markers; energy, power lost, force along the joint coordinate
    found = tuple(np.zeros(x) for x in ((n, rows.size, 6), (n, rows.size, 3), (n, 3)))
    base = places.before(solution.base)
    motion = (solution.q, solution.v, solution.lam, base, signals)
    for k in range(n) if asked else ():
        answered = tuple(x[k : k + 1] for x in motion)
        evaluate_at(system, W, solution.q[k], solution.v[k], base[k], signals[k])
        apply_laws(asked, W, float(solution.t[k]))
        track_element(system, W, answered, rows, c, tuple(x[k : k + 1] for x in found))
    if not asked:
        track_element(system, W, motion, rows, c, found)
    (wrench, position, scalars), unit = found, "N" if row is None or row.kind == ALONG else "N m"
    force, moment, (energy, lost, along) = wrench[..., :3], wrench[..., 3:], scalars.T
    along = pull(position, force) if row is None else along
    loads = force, moment, along, unit, row is not None
    return ElementRecord(solution.t, markers, *loads, energy, lost)


@kernel
def track_element(s, W, motion, rows, c, out):
    """Fill the tracks of a system of one element, which acts along coordinate c if there is one."""
    Q, V, L, base, signals = motion
    wrench, position, scalars = out
    for k in range(Q.shape[0]):
        evaluate_at(s, W, Q[k], V[k], base[k], signals[k])
        W.wrench[:] = 0.0
        W.power[:] = 0.0
        W.driven[0] = 0.0
        for e in range(s.elements.shape[0]):
            residuals(s, e, W, Q[k], V[k], L[k])
        scalars[k, 0] = element_energy(s, W, Q[k], V[k])
        scalars[k, 1] = W.power[2]
        for m in range(rows.size):
            copy(W.wrench[rows[m]], wrench[k, m])
            copy(W.P[rows[m]], position[k, m])
        if c >= 0:
            scalars[k, 2] = along_coordinate(wrench[k], W.xg[c])


@inner
def along_coordinate(wrench, gradient):
    """The generalised force of wrenches (2, 6), which are its multiples of the gradient (12,)."""
    force, size = 0.0, 0.0
    for side in range(2):
        for p in range(6):
            force += wrench[side, p] * gradient[6 * side + p]
            size += gradient[6 * side + p] ** 2
    return force / size


def _sampled(solution: AnySolution, places: Places) -> Array:
    """(n_t, s, 3) the functions of time that were asked for once more."""
    t, new = solution.t, tuple(places.signals[len(solution.packed.signals) :])
    if t.size == 1:
        return sample_all(new, t, (-np.inf, np.inf), INSTANT_SPACING)
    span = (float(t.min()), float(t.max()))
    return sample_all(new, t, span, 0.01 * (span[1] - span[0]) / (t.size - 1))


def pull(position: Array, force: Array) -> Array | None:
    """(n_t,) part of the forces (n_t, 2, 3) that pulls two markers together; None for others."""
    if position.shape[1] != 2:
        return None
    gap = position[:, 1] - position[:, 0]
    length = np.linalg.norm(gap, axis=1)
    e = gap / np.where(length > 0, length, 1.0)[:, None]
    return np.asarray(0.5 * ((force[:, 0] - force[:, 1]) * e).sum(axis=1))
