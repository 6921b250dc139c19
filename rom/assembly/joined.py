"""One body for a mechanism, of bodies that are coupled; no finite elements involved.

In a shape of the whole a member moves by R X + Phi Y, a rigid motion and its own shapes Phi. The
integrals of such fields are combinations of those that it has of 1, x and Phi; their sums over all
members are those of the whole. The shapes are free-free modes within the motions that close the
couplings. Fewer of them are a Craig-Bampton basis of the whole, whose statics stay exact::

    constraint motions of the interfaces kept, C^T K F = 0, and lowest modes F that hold them
"""

from collections import Counter
from dataclasses import replace
from functools import reduce
from operator import add

import numpy as np
from scipy.linalg import null_space

from rom.arguments import whole
from rom.assembly.condensed import partition, per_body
from rom.assembly.coupling import Coupling, Place
from rom.body.flexible import FlexibleBody
from rom.body.frame import mode_labels, recombined
from rom.body.inertia import fields_of, of_body
from rom.body.recovery import StressRecovery, one_stress
from rom.body.reference import moved_frame, rigid_elastic, rigid_mass
from rom.body.surface import one_surface
from rom.eigen.verbs import modes_within, whole_clusters
from rom.errors import ConfigError, ModelError, warn
from rom.model import Array, Row
from rom.names import check_once, named
from rom.rows import row

Bodies = dict[str, FlexibleBody]
Limits = tuple[int | None, float | None]  # of modes: their number, a frequency [Hz]
RIGID_RTOL = 1e-6  # share of a rigid motion that motions may miss
LOOSE_RTOL = 1e-7  # of the largest: conditions that are none on rigid motions
MATRIX_RTOL = 1e-8  # between integrals and matrices of the coupled members


def interface_places(
    bodies: Bodies,
    couplings: tuple[Coupling, ...],
    given: tuple[Place, ...] | dict[str, Place] | None,
) -> dict[str, Place]:
    """{name: place} of interfaces as asked, or of all that nothing is coupled to.

    Two of one name have their bodies in front, as in "left.bore".
    """
    if isinstance(given, dict):
        return given
    coupled = {tuple(place) for coupling in couplings for place in coupling}
    places = [(body, m) for body, members in bodies.items() for m in members.markers]
    chosen = [place for place in places if place not in coupled] if given is None else given
    check_once(chosen, "interfaces of one body:")
    count = Counter(interface for _, interface in chosen)
    return {m if count[m] == 1 else f"{body}.{m}": (body, m) for body, m in chosen}


def refuse_loose(bodies: Bodies, conditions: Array) -> None:
    """Refuse bodies that couplings, zero conditions (c, n), let move rigidly against each other.

    Raises:
        ModelError: naming those that move against the first.
    """
    widths = {name: 6 + body.n_modes for name, body in bodies.items()}
    size = max(body.size for body in bodies.values())
    scale = np.r_[np.ones(3), np.full(3, 1 / size)]
    rigid = np.hstack([C.T[:, :6] * scale for C in per_body(widths, conditions.T).values()])
    Z = null_space(rigid, rcond=LOOSE_RTOL) if rigid.any() else np.eye(6 * len(bodies))
    motion = dict(zip(bodies, Z.reshape(len(bodies), 6, -1), strict=True))
    first = next(iter(bodies))
    if loose := [b for b, Z in motion.items() if np.abs(Z - motion[first]).max() > LOOSE_RTOL]:
        text = f"{named(loose)} can move against {first!r} without strain"
        hint = "Couple more, or make them bodies of a rom.Mechanism with joints between."
        raise ModelError(f"{text}, and one body is no mechanism.", hint=hint)


def kept_motions(
    N: Array, H: Array, matrices: tuple[Array, Array], n_rigid: int, most: Limits
) -> Array:
    """(n, m) statics of interfaces with coordinates H (h, n), and lowest modes that hold them.

    Among motions N (n, k) of bodies with that mass and stiffness. The limit is a number of modes,
    beside the rigid motions that interfaces leave, or a frequency [Hz]; all of N without either.
    """
    n_modes, f_max = most
    if n_modes is None and f_max is None:
        return N
    M, K = matrices
    parts = partition(M, K, N, H, 0) if len(H) else None
    C, F = (parts.C, parts.F) if parts else (N[:, :0], N)
    lam, F = modes_within(F, K, M)
    if f_max is not None:
        n = int(np.count_nonzero(lam <= (2 * np.pi * f_max) ** 2))
    else:
        left = lam.size - n_rigid
        n = whole("n_modes", n_modes, 0, left, reason="modes that hold the interfaces") + n_rigid
        n = whole_clusters(lam, n) if n else 0
    return np.hstack([C, F[:, :n]])


def elastic_modes(N: Array, R: Array, matrices: tuple[Array, Array]) -> tuple[Array, Array]:
    """Frequencies (r,) [rad/s] and mass-normalised modes (n, r) without rigid motions R (n, 6).

    Among motions N (n, k) of bodies with that mass and stiffness.

    Raises:
        ConfigError: if the rigid motions are not among them.
    """
    M, K = matrices
    N = N / np.sqrt(np.einsum("ij,ij->j", N, M @ N))
    R = R / np.sqrt(np.diag(R.T @ M @ R))
    missed = np.abs(R - N @ np.linalg.lstsq(N, R, rcond=None)[0]).max() / np.abs(R).max()
    if missed > RIGID_RTOL:
        text = f"these motions hold the whole: a rigid one is missed by {missed:.1e}"
        raise ConfigError(f"{text}; reduce the assembly with fixed=(), and hold its body.")
    lam, V = modes_within(N @ null_space(R.T @ M @ N), K, M)
    V = V * np.sign(V[np.argmax(np.abs(V), axis=0), np.arange(lam.size)])
    return np.sqrt(np.maximum(lam, 0.0)), V


def joined(
    name: str, bodies: Bodies, omega: Array, V: Array, places: dict[str, Place]
) -> FlexibleBody:
    """The body on mean axes whose modes V (n, r) are rigid and elastic motions of its members."""
    if stiffened := [b for b, body in bodies.items() if body.K_geo]:
        text = f"{named(stiffened)} has geometric stiffness, and body {name!r} goes without: stress"
        warn(f"{text} under a load would be that of forces between its parts, too.")
    shapes = per_body({b: 6 + body.n_modes for b, body in bodies.items()}, V)
    wanted = {b: {m for owner, m in places.values() if owner == b} for b in bodies}
    parts = {b: _moved(body, shapes[b], wanted[b]) for b, body in bodies.items()}
    integrals = reduce(add, (of_body(part) for part in parts.values()))
    markers = {new: replace(parts[b].markers[m], name=new) for new, (b, m) in places.items()}
    made = {b: body.provenance for b, body in bodies.items()}
    statics = all(body.has_static_shapes for body in bodies.values())
    method = f"Assembly of {', '.join(bodies)}"
    return FlexibleBody(
        name=name,
        **fields_of(integrals),
        K=np.diag(omega**2),
        D=reduce(add, (part.D for part in parts.values())),
        markers=markers,
        omega=omega,
        labels=mode_labels(omega.size, "mean-axis"),
        surface=one_surface([part.surface for part in parts.values()]),
        stress=one_stress([part.stress for part in parts.values()]),
        provenance={"reduction": {"method": method, "static shapes": statics}, "bodies": made},
    )


def _moved(body: FlexibleBody, shapes: Array, wanted: set[str]) -> FlexibleBody:
    """A member with shapes (6 + r_i, r) of the whole, and the markers that are wanted."""
    markers = {name: body.markers[name] for name in body.markers if name in wanted}
    X, Y = shapes[:6], shapes[6:]
    part = moved_frame(recombined(replace(body, markers=markers, K_geo={}), Y), -X)
    stress = part.stress.moved(-X) if isinstance(part.stress, StressRecovery) else None
    return replace(part, stress=stress)


def matrix_rows(body: FlexibleBody, R: Array, V: Array, M: Array) -> list[Row]:
    """Integrals of a body on mean axes against the mass M (n, n) of its coupled members."""
    size = np.r_[np.ones(3), np.full(3, body.size)]
    apart = np.abs((rigid_mass(body) - R.T @ M @ R) / np.outer(size, size)).max() / body.mass
    still = np.abs(rigid_elastic(body) / size[:, None]).max(initial=0.0) / np.sqrt(body.mass)
    unit = np.abs(body.M - V.T @ M @ V).max(initial=0.0)
    return [
        row("mass, centre, inertia: body against its parts", apart, 1e-9),
        row("momentum of the shapes", still, MATRIX_RTOL),
        row("mass of the shapes: body against its parts", unit, MATRIX_RTOL),
    ]
