"""Shapes for large deflection: what bending drags along, for the loads that a body is to bear.

A beam that bends pulls its end back. Where no shape of the basis does that, the strain of second
order meets the stiffness of stretching, and the basis locks. The derivatives of shapes are what
two of them drag along::

    K theta_ij = -D^2 f [psi_i, psi_j],    interfaces held

Their products with the amplitudes of a load range are few: the model with all derivatives bears
its loads, and a proper orthogonal decomposition of its states in the norm of K says which.

Source:
    Idelsohn and Cardona, A reduction method for nonlinear structural dynamic analysis, Comput.
    Methods Appl. Mech. Eng. 49 (1985) 253; Rutzmoser, Model order reduction for nonlinear
    structural dynamics, dissertation, TU Munich (2018).
"""

from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import issparse

from rom import rotation
from rom.body.nonlinear.full import HeldSolid
from rom.body.nonlinear.quartic import Quartic
from rom.body.nonlinear.ranges import (
    Geometric,
    Load,
    axis_point,
    further_loads,
    held_motions,
    nodal_forces,
)
from rom.body.nonlinear.statics import Held, free_motions, newton, passages
from rom.body.recovery import with_elements
from rom.eigen.connection import Connection, Tie
from rom.eigen.verbs import (
    Operators,
    column_blocks,
    mean_motion,
    own_rows,
    quadratic,
    whole_clusters,
)
from rom.errors import ConfigError, InterfaceError, ModelError, ResourceError, warn
from rom.model import Array, Basis, FEModel, Index, Interface, refuse_springs
from rom.names import check_known

DEPENDENT_RTOL = 1e-10  # energy of a derivative, of the largest, that the others explain
# energy of a derivative over those of its two shapes, of the largest such, from which it is none;
# for slender bodies pull and bending differ by the square of the slenderness
ROUND_OFF_RTOL = 1e-18
EQUAL_RTOL = 1e-3  # of shares of energy: states of two planes of equal stiffness stay together
N_MODES = 4  # about each state that a range leads to, for which shapes are kept
# A mode loses 1e-4 of its stiffness if a hundredth of its energy norm is missed, states must not
# lose that much: at the usual tolerance of 1e-4 both are met.
MODE_SHARE = 1e-2
N_TURNS = 4  # of moments with the section on which they act, each by what the last one left
SNAPSHOT_SHARES = (0.5, 1.0)  # of the loads, at which the full model is solved
AFFINE_RTOL = 1e-6  # of affine motions of a section that its functions may miss
HELD_RTOL = 1e-6  # of K on modes, by which those of held interfaces are known
MOST_TURN_RAD = 1.4  # linear rotations are sines, which say little beyond
MAX_COORDINATES = 80
TENSOR_COPIES = 11  # of the Gram matrix while it is ordered into tensors
FLOP_RATE = 1e10  # of one core in a product of matrices [1/s]
# stretch at which the force of St. Venant-Kirchhoff material, proportional to F^3 - F, has its
# extremum: from there on a compressed layer gives way, and the equations are no longer elliptic
ELLIPTIC_STRETCH = 3.0**-0.5


@dataclass(frozen=True)
class Bent:
    """A reduction under way, and the range of loads by which the body is to bend far."""

    geometric: Geometric
    model: FEModel
    ops: Operators
    connection: Connection
    basis: Basis
    reference: str

    @property
    def held(self) -> list[Load]:
        """Each motion held beside the reference."""
        return held_motions(self.geometric, self.model.interfaces)

    def nodal(self, loads: list[Load]) -> Array:
        """(n_local, l) forces of loads on the nodes of this process [N]."""
        about = axis_point(self.geometric, self.model, self.reference)
        return nodal_forces(loads, self.model, self.ops, about)


@dataclass(frozen=True)
class Shapes:
    """A basis before it is cut, seen from a frame on the reference interface."""

    E: Array  # (n_local, r) nodal shapes, those that move an interface first
    loads: Array  # (r, l) forces of the components of the load range at their largest [N]
    further: Array  # (r, k) the same of all unit forces and moments on the interfaces of the range
    # {interface: (3, r)} rotations of those of the range, of small angles [1/m]
    turns: dict[str, Array]
    held: Array  # (h, r) motions that supports let vanish
    n_basis: int  # how many of them the basis has already
    sections: list["Section"]  # of the interfaces with moments


@dataclass(frozen=True)
class Section:
    """How moments on an interface turn with it: as tractions that are linear over the section."""

    turn: Array  # (3, r) its rotation, of small angles, per unit of each shape [1/m]
    moments: Array  # (3, l) components of the load range at their largest [N m]
    # (r, 3, 3, 3) forces on the shapes, [:, a, b, k], where the part b of the tractions of a unit
    # moment about axis k acts along axis a
    tractions: Array

    @classmethod
    def of(cls, ops: Operators, F: Array, E: Array, moments: Array) -> "Section":
        """That of shapes E (n_local, r), from the nodal forces F (n_local, 3) of unit moments."""
        return cls(ops.gram(F, E), moments, ops.gram(E, _turnable(F)).reshape(-1, 3, 3, 3))

    def difference(self, case: Array, q: Array) -> Array:
        """(r,) forces of the moments of a load case, turned with the section, less as at rest."""
        sine, moment = self.turn @ q, self.moments @ case
        size = max(float(np.linalg.norm(sine)), 1e-30)
        R = rotation.matrix(rotation.exp(np.arcsin(min(size, 1.0)) / size * sine))
        turned = np.einsum("rabk,ab,k->r", self.tractions, R, R.T @ moment)
        return np.asarray(turned - np.einsum("raak,k->r", self.tractions, moment))


def enriched(bent: Bent) -> Basis:
    """The basis with the shapes of its load range, in which there are stable equilibria."""
    _refuse(bent)
    geometric, ops, basis = bent.geometric, bent.ops, bent.basis
    energy = bent.model.stresses.large_strain()
    shapes, theta = _with_derivatives(bent, energy)
    quartic = Quartic.from_gram(energy.gram(shapes.E, exact=False), shapes.E.shape[1])
    passed = _states(geometric, quartic, shapes)
    states = np.vstack(passed)
    _refuse_collapse(geometric, energy.least_stretch(shapes.E @ states.T), list(map(len, passed)))
    _warn_of_turns(geometric, quartic, shapes, states)
    small = _small_motions(states, quartic, quadratic(ops, ops.apply_M, shapes.E), shapes)
    added = theta @ _principal(geometric, *(q[:, shapes.n_basis :].T for q in (states, *small)))
    labels = tuple(f"deflection {k + 1}" for k in range(added.shape[1]))
    return replace(basis, Psi=np.hstack([basis.Psi, added]), labels=(*basis.labels, *labels))


def _refuse(bent: Bent) -> None:
    """Say what does not go together with large deflection."""
    geometric, model, connection = bent.geometric, bent.model, bent.connection
    basis, reference = bent.basis, bent.reference
    with_elements(model, "large strain")
    refuse_springs(model, "large deflection knows elements alone")
    modes_held = basis.held is not None
    if modes_held and basis.omega.size:
        K = quadratic(connection.ops, connection.ops.apply_K, _normal(basis))
        expected = np.diag(basis.omega**2)
        modes_held = bool(np.abs(K - expected).max() <= HELD_RTOL * expected.max())
    if not modes_held:
        text = "large deflection needs modes with the interfaces held, which this method has not"
        raise ConfigError(f"{text}; use rom.CraigBampton or rom.Guyan.")
    others = [name for name in connection.parts if name != reference]
    text = f"reference = {reference!r}: large deflection is seen from an interface, one of"
    check_known(reference, connection.parts, text)
    for name in geometric.loads:
        known = (
            f"the range of loads names {name!r}; beside the reference {reference!r} the body has"
        )
        check_known(name, others, known, InterfaceError)
    held = held_motions(geometric, others)
    for load in geometric.components():
        if replace(load, largest=1.0) in held:
            text = f"the range has a load {load.name} where the body is held"
            raise ConfigError(f"{text}; leave it out, or that direction of fixed.")
    for name in others:
        tie = connection.ties[name]
        if not _turns(tie, model.interfaces[name]):
            rigid = tie.label == "rbe2"
            what = "is rigid" if rigid else f"has functions ({tie.label}) that hold it"
            text = f"interface {name!r} {what}, and grows as it turns: far too stiff"
            raise InterfaceError(f'{text}; give it the kind "rbe3" or rom.Polynomial(1).')


def _turns(tie: Tie, interface: Interface) -> bool:
    """Whether a section can turn far: it averages, has all dofs, or any affine motion."""
    if not tie.removed.size or tie.kept.size:
        return True
    X = interface.points - interface.origin
    affine = np.einsum("ac,nb->ncab", np.eye(3), X).reshape(-1, 9)
    shapes = tie.by_masters.toarray() if issparse(tie.by_masters) else np.asarray(tie.by_masters)
    missed = affine - shapes @ np.linalg.lstsq(shapes, affine, rcond=None)[0]
    return bool(np.linalg.norm(missed) <= AFFINE_RTOL * np.linalg.norm(affine))


def _normal(basis: Basis) -> Array:
    """(n_local, m) the modes of a basis with the interfaces held, its last columns."""
    return basis.Psi[:, basis.Psi.shape[1] - basis.omega.size :]


def _with_derivatives(bent: Bent, energy: Any) -> tuple[Shapes, Array]:
    """All shapes as nodal displacements, and the derivatives in interface coordinates."""
    geometric, ops, connection, basis = bent.geometric, bent.ops, bent.connection, bent.basis
    n_b, interfaces = connection.boundary.size, bent.model.interfaces
    Psi = connection.ops.expand(basis.Psi)
    root = interfaces[bent.reference]
    still = mean_motion(root) @ ops.rows(Psi[:, :n_b], root.dofs)
    N = free_motions(still)
    moving = Psi[:, :n_b] @ N
    K = quadratic(ops, ops.apply_K, moving)
    components, every = geometric.components(), further_loads(geometric, bent.held)
    turning = [Load("", load.component) for load in components if not load.interface]

    def forces(loads: list[Load], E: Array) -> Array:
        return ops.gram(E, bent.nodal(loads))

    F = free_motions(forces(bent.held, moving).T)
    borne = F @ np.linalg.solve(F.T @ K @ F, F.T @ forces(every + turning, moving))
    # what turns bears its own load along the way: interfaces held, and K-orthogonal to their motion
    along = basis.held(connection.ops.restrict(bent.nodal(turning)))
    static = moving @ borne
    static[:, len(every) :] += connection.ops.expand(along)
    turned = [name for name, load in geometric.loads.items() if np.any(load[3:])]
    units = [bent.nodal([Load(name, k) for k in (3, 4, 5)]) for name in turned]
    squeezed = [basis.held(connection.ops.restrict(_turnable(F))) for F in units]
    n_modes = min(geometric.n_modes, basis.omega.size)
    if n_modes:
        n_modes = whole_clusters(basis.omega**2, n_modes)
    normal = Psi[:, Psi.shape[1] - basis.omega.size :]
    active = np.hstack([static, normal[:, :n_modes]])
    n_basis, n_active = moving.shape[1] + n_modes, active.shape[1]
    n_further = len(turning) + geometric.snapshots * 2 * len(geometric.load_cases())
    _refuse_many(n_basis + n_further + n_active * (n_active + 1) // 2, energy)
    size = np.diag(quadratic(ops, ops.apply_K, active))
    further = [along, *squeezed]
    if geometric.snapshots:
        further.append(_snapshots(bent))
    theta = _derivatives(bent, energy, (active, size), further)
    E = np.hstack([moving, active[:, static.shape[1] :], connection.ops.expand(theta)])
    moments = [_moments(name, components) for name in turned]
    sections = [Section.of(ops, F, E, of) for F, of in zip(units, moments, strict=True)]
    loads, still = forces(components, E), forces(bent.held, E).T
    # a given number of shapes is spent on the loads of the range alone
    beside = forces(every if geometric.n_shapes is None else [], E)
    loaded = {name: one for name, one in interfaces.items() if name in geometric.loads}
    turns = {name: mean_motion(one)[3:] @ ops.rows(E, one.dofs) for name, one in loaded.items()}
    return Shapes(E, loads, beside, turns, still, n_basis, sections), theta


def _snapshots(bent: Bent) -> Array:
    """(n_local, c) full states at the largest loads, in interface coordinates at rest there."""
    geometric, connection = bent.geometric, bent.connection
    full = HeldSolid.of(bent.model, connection, bent.reference, bent.held)
    units = full.whole(bent.nodal(geometric.components()))
    n_b, found = connection.boundary.size, []
    for case, share in product(geometric.load_cases(), SNAPSHOT_SHARES):
        a = full.state(np.zeros(len(units)), share * units @ case)
        if a is None:
            where = f"load {np.round(case, 3).tolist()} of the range"
            text = "the full model finds no equilibrium; ask for smaller loads, or no snapshots."
            raise ModelError(text, where=where)
        static = bent.basis.Psi[:, :n_b] @ a[connection.boundary]
        found.append(own_rows(connection.ops, a) - static)
    return np.array(found).T


def _moments(interface: str, components: list[Load]) -> Array:
    """(3, l) moments about the axes of the components of a range on an interface [N m]."""
    found = np.zeros((6, len(components)))
    for k, load in enumerate(components):
        found[load.component, k] = load.largest * (load.interface == interface)
    return found[3:]


def _turnable(F: Array) -> Array:
    """(n_local, 27) forces along each axis a of the part b of forces (n_local, 3) of moments k."""
    return np.asarray(np.einsum("ac,nbk->ncabk", np.eye(3), F.reshape(-1, 3, 3)).reshape(-1, 27))


def _refuse_many(n: int, energy: Any) -> None:
    if n > MAX_COORDINATES:
        memory, time = foreseen(n, energy.n_points)
        text = f"{n} coordinates of loads and modes are more than {MAX_COORDINATES} that are taken"
        takes = f"they take {memory / 1e9:.2g} GB and about {time / 60:.2g} minutes"
        raise ResourceError(f"{text}: {takes}.", hint="Name fewer loads, or ask for fewer modes.")


def foreseen(n: int, n_points: int) -> tuple[float, float]:
    """Memory [B] and time [s] for the tensors of n coordinates from so many quadrature points."""
    N = n + n * (n + 1) / 2
    return TENSOR_COPIES * 8 * N**2, 6 * n_points * N**2 / FLOP_RATE


def _refuse_collapse(geometric: Geometric, stretches: Array, counts: list[int]) -> None:
    """Say which load case compresses the material too far, by least stretches (s,) of states."""
    k = int(np.argmin(stretches))
    if stretches[k] > ELLIPTIC_STRETCH:
        return
    load = int(np.searchsorted(np.cumsum(counts), k, side="right"))
    case, step = divmod(load, geometric.n_steps)
    signs = zip(geometric.load_cases()[case], geometric.components(), strict=True)
    parts = [f"{x:+.2g} {load.name}" for x, load in signs if x]
    text = f"load {', '.join(parts)} of the range compresses the material to {stretches[k]:.3f} of"
    when = f"its length at {(step + 1) / geometric.n_steps:.2g} of it"
    why = f"from {ELLIPTIC_STRETCH:.3f} on St. Venant-Kirchhoff material loses ellipticity"
    raise ModelError(f"{text} {when}; {why}.", hint="Ask for smaller loads, or sampling.")


def _derivatives(
    bent: Bent, energy: Any, dragging: tuple[Array, Array], further: list[Array]
) -> Array:
    """(n_local, p) derivatives in interface coordinates, orthonormal in K and to normal modes.

    Two shapes that drag nothing along, as pull and twist of a prism, have round-off as their
    derivative, which must not become a shape: it differs from run to run. Dragging are nodal shapes
    (n_local, a), with (a,) twice their energies [J]; further shapes (n_local, t) of the same span
    are in interface coordinates; of each kind those with much less energy are round-off.
    """
    (active, size), ops, basis = dragging, bent.connection.ops, bent.basis
    i, j = np.triu_indices(active.shape[1])
    pairs: Index = np.column_stack([i, j])
    theta = np.zeros((ops.n_local, len(pairs)))
    for some in column_blocks(len(pairs)):
        theta[:, some] = -basis.held(ops.restrict(energy.second_forces(active, pairs[some])))
    theta = np.hstack([*further, theta])
    normal = _normal(basis)
    theta -= normal @ (ops.gram(normal, ops.apply_K(theta)) / basis.omega[:, None] ** 2)
    K = quadratic(ops, ops.apply_K, theta)
    *shares, share = np.split(np.diag(K), np.cumsum([X.shape[1] for X in further]))
    shares = [x > DEPENDENT_RTOL * x.max(initial=0.0) for x in shares]
    share = share / (size[i] * size[j])
    real = np.concatenate([*shares, share > ROUND_OFF_RTOL * share.max()])
    theta, K = theta[:, real], K[np.ix_(real, real)]
    scale = 1 / np.sqrt(np.diag(K))
    lam, V = np.linalg.eigh(0.5 * (K + K.T) * np.outer(scale, scale))
    kept = lam > DEPENDENT_RTOL * lam[-1]
    return theta @ (scale[:, None] * V[:, kept] / np.sqrt(lam[kept]))


def _states(geometric: Geometric, quartic: Quartic, shapes: Shapes) -> list[Array]:
    """For each load case and step of it the states (k, r) on the way there, itself the last."""
    share = np.arange(1, geometric.n_steps + 1) / geometric.n_steps
    found = list[Array]()
    for case in geometric.load_cases():
        try:
            passed = passages(quartic, np.outer(share, shapes.loads @ case), shapes.held)
            pairs = zip(share, passed, strict=True)
            found += [_turned(quartic, shapes, x * case, states) for x, states in pairs]
        except ModelError as error:
            error.where = error.where or f"load {np.round(case, 3).tolist()} of the range"
            raise
    return found


def _turned(quartic: Quartic, shapes: Shapes, case: Array, states: Array) -> Array:
    """States (k, r) on the way to a load case, and before them that with moments that follow.

    A moment as a pair of dead forces squeezes a section that has turned.
    """
    bent = [section for section in shapes.sections if (section.moments @ case).any()]
    if not bent:
        return states
    body, q = Held(quartic, free_motions(shapes.held)), states[-1]
    for _ in range(N_TURNS):
        load = shapes.loads @ case + sum(section.difference(case, q) for section in bent)
        near = newton(body, q @ body.N, load @ body.N)
        if near is None:
            return states
        q = body.N @ near
    return np.vstack([q, states])


def _warn_of_turns(geometric: Geometric, quartic: Quartic, shapes: Shapes, states: Array) -> None:
    """Say which interface turns farther than one frame carries.

    Dead forces turn a section by the sine in its states. Moments of a mechanism turn with it, as
    far as small ones would; beside forces, whose arms become shorter, they are bounds.
    """
    N = free_motions(shapes.held)
    small = N @ np.linalg.solve(N.T @ quartic.K @ N, N.T @ shapes.loads)
    pushed = {name for name, load in geometric.loads.items() if np.any(load[:3])} | {""}
    moments = [load.interface not in pushed for load in geometric.components()]
    for name, turn in shapes.turns.items():
        sines = np.linalg.norm(turn @ states.T, axis=0)
        by_moments = np.linalg.norm(turn @ small[:, moments], axis=0)
        most = max(np.arcsin(min(sines.max(), 1.0)), by_moments.max(initial=0.0))
        if most > MOST_TURN_RAD:
            warn(
                f"interface {name!r} turns by {np.degrees(most):.0f} degrees against the reference "
                f"under the loads of the range; one body is for {np.degrees(MOST_TURN_RAD):.0f}. "
                "Cut the body: rom.fe.pieces with rom.reduce_pieces, the pieces of which share the "
                "turning; or ask for smaller loads."
            )


def _small_motions(
    states: Array, quartic: Quartic, M: Array, shapes: Shapes
) -> tuple[Array, Array]:
    """(s m, r) lowest modes about each state (s, r), (s l, r) what further loads do, of energy 1/2.

    A beam bent in one plane needs companions of bending in the other and of twisting as well.
    Where it snaps, without stiffness, a mode is no larger than at rest.
    """
    N = free_motions(shapes.held)
    mass = N.T @ M @ N
    softest = eigh(N.T @ quartic.K @ N, mass, eigvals_only=True, subset_by_index=(0, 0))[0]
    modes, yielding = [], []
    for q in states:
        lam, V = eigh(N.T @ quartic.tangent(q) @ N, mass)
        lam = np.maximum(lam, 0.1 * softest)
        amplitudes = (V / lam).T @ (N.T @ shapes.further)
        modes.append((N @ V[:, :N_MODES] / np.sqrt(lam[:N_MODES])).T)
        yielding.append((N @ V @ (amplitudes / np.sqrt(lam @ amplitudes**2))).T)
    return np.vstack(modes), np.vstack(yielding)


def _principal(geometric: Geometric, Y: Array, modes: Array, yielding: Array) -> Array:
    """(p, k) directions of most energy in states (p, s), modes (p, m) and what further loads do.

    The coordinates have the energy 1/2. A mode weighs `MODE_SHARE` of all states together. What
    further loads (p, l) do comes on top: among the others it would take the place of modes.
    """
    share = MODE_SHARE * np.linalg.norm(Y)
    Y = np.hstack([Y, share * modes])
    least = float(geometric.tol * np.linalg.norm(Y))
    U = _leading(Y, least, geometric.n_shapes)
    left = share * (yielding - U @ (U.T @ yielding))
    return np.hstack([U, _leading(left, least)])


def _leading(Y: Array, least: float, k: int | None = None) -> Array:
    """(p, k) leading directions of columns (p, s), as many as leave no more than the least out."""
    U, s, _ = np.linalg.svd(Y, full_matrices=False)
    missed = np.sqrt(np.cumsum(s[::-1] ** 2)[::-1])  # with those from k on left out
    k = int(np.count_nonzero(missed > least)) if k is None else min(k, s.size)
    while 0 < k < s.size and s[k] > (1 - EQUAL_RTOL) * s[k - 1]:
        k += 1
    return np.asarray(U[:, :k])
