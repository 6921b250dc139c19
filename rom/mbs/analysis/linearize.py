"""Small motions around any state of a mechanism: frequencies, damping, shapes."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated, Any, NamedTuple

import numpy as np
from scipy.sparse import csr_matrix

from rom.arguments import Count, typed
from rom.errors import ConfigError, warn
from rom.mbs.analysis.few_modes import Pencil, Wanted, modes, phases
from rom.mbs.analysis.local_equations import (
    Instant,
    consistent,
    free_motions,
    instant,
    of_instant,
    of_unit_mass,
)
from rom.mbs.analysis.rotors.blades import Blades
from rom.mbs.analysis.rotors.moving_axes import Axes, chosen, small_motions
from rom.mbs.analysis.tangent import load_stiffness, sizes
from rom.mbs.equations.packing import Packed
from rom.mbs.equations.sparse_solve import Matrix
from rom.mbs.integrate.consistent_start import fitting_velocity, with_accelerations
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.bodies import Marker
from rom.mbs.results.audit import pressed
from rom.mbs.results.state import State
from rom.model import Array
from rom.names import check_known

PROBE_ANGLE = 1e-3  # by which the joints are moved to see how their free motions change [rad]
STEADY_RTOL = 1e-11  # change of free motions that do not change
ZERO_FREQUENCY_RTOL = 2e-7  # round-off of a frequency, of the highest one
DIFFERENCED_ZERO_RTOL = 1e-5  # the same where tangents are differences
RESTING_TOL = 1e-6  # distance to balance that counts as rest, in rad or lengths of the mechanism
AXES = ("x", "y", "z", "rx", "ry", "rz")
DRIFT_RTOL = 1e-3  # change of the matrices in a radian from which they count as periodic


@typed
@dataclass(frozen=True)
class Linearization:
    """Linear equations M y'' + C y' + K y = f of the motions that the joints allow.

    Attributes:
        state: where.
        M, C, K: (f, f) mass, damping with gyroscopic terms, stiffness with geometric and
            centrifugal terms, for the coordinates y of the free motions; M is the unit matrix [1],
            so that C is [1/s] and K [1/s^2].
        basis: (n, f) variation of all coordinates, counted as in `State.v`, per y.
        test: (n, f) virtual motions that project forces, in units of the basis; the basis unless
            there is friction.
        round_off: share of the highest frequency below which others count as zero [1].
        scale: (n,) small motion of each coordinate [m, rad], as many rad as sizes of the mechanism.
        packed: the arrays of the mechanism.
        H: (k, 6, 6 + R) twist of all markers per velocity of their body [1, m, 1/m].
        known: eigenvalues (k,), vectors (f, k) and all eigenvalues, where the motions y are a
            part of all that hold k modes; None: computed when asked for.
        pressed: by body, the force that presses two of its interfaces together over what buckles it
            there [1]; zero with geometric stiffness, left out where the body does not know.
    """

    state: State
    M: Array
    C: Array
    K: Array
    basis: Array
    test: Array
    round_off: float
    scale: Array
    packed: Packed
    H: Array
    known: Any = None
    pressed: dict[str, float] = field(default_factory=dict)

    @cached_property
    def _modes(self) -> tuple[Array, Array, Array]:
        roots, V, every = self.known or modes(self.C, self.K, self.round_off)
        return roots, V * phases(self.basis @ V / self.scale[:, None]), every

    @property
    def eigenvalues(self) -> Array:
        """(f,) complex, one per mode [rad/s]; of a pair of real ones the larger."""
        return self._modes[0]

    @property
    def frequencies(self) -> Array:
        """(f,) ascending [Hz]; 0 for motions that are free, or do not oscillate.

        Below the share ``round_off`` of the highest one nothing can be told from zero.
        """
        return self.eigenvalues.imag / (2 * np.pi)

    @property
    def damping_ratios(self) -> Array:
        """(f,) share of critical damping [1], negative where a motion grows; 0 for free motions."""
        size = np.abs(self.eigenvalues)
        return -self.eigenvalues.real / np.where(size > 0, size, 1.0)

    @property
    def shapes(self) -> Array:
        """(n, f) modes in all coordinates, counted as in `State.v`; unit modal mass.

        Complex where damping or rotation shifts phases. The largest part, in rad
        or sizes of the mechanism, is real and positive.
        """
        return self.basis @ self.vectors

    @property
    def vectors(self) -> Array:
        """(f, f) modes in the coordinates y, in units of these."""
        return self._modes[1]

    @property
    def stable(self) -> bool:
        """Whether no motion grows exponentially."""
        every = self._modes[2]
        return bool(every.real.max(initial=0.0) <= self.round_off * np.abs(every).max(initial=0.0))

    def motion(self, marker: Marker) -> Array:
        """(6, f) small translation [m] and rotation [rad] of a marker in the world, per coordinate.

        The coordinates are y, those of the free motions.

        Raises:
            ConfigError: if the marker is not one of the mechanism.
        """
        return self.jacobian(marker) @ self.basis

    def jacobian(self, marker: Marker) -> Array:
        """(6, n) small translation [m] and rotation [rad] of a marker in the world, per coordinate.

        Raises:
            ConfigError: if the marker is not one of the mechanism.
        """
        return jacobian(self.packed, self.H, marker)

    def to_statespace(
        self, inputs: tuple[str, ...], outputs: tuple[str, ...]
    ) -> tuple[Array, Array, Array, Array]:
        """A, B, C, D of x' = A x + B u, y = C x + D u, as python-control and SciPy take them.

        The states are the free motions and their rates: (2 f,).

        Args:
            inputs: forces [N] and moments [N m], each a marker and an axis of the world, as
                "arm.tip z" or "arm.tip rz".
            outputs: translations [m] and rotations [rad] in the same words, with " rate" behind
                for their rates.

        Raises:
            ConfigError: for a marker that is not one of the mechanism, or another axis.

        Example:
            >>> mech = rom.Mechanism(gravity=(0, 0, 0))
            >>> mass = mech.add_rigid("mass", mass=2, inertia=(1, 1, 1), at=(0, 0, 0))
            >>> mech.prismatic("rail", "ground", "mass", axis=(1, 0, 0))
            >>> A, B, C, D = rom.linearize(mech).to_statespace(["mass x"], ["mass x rate"])
            >>> round(float((C @ B)[0, 0]), 9)  # acceleration by one newton
            0.5
        """
        f = len(self.K)
        B = np.zeros((2 * f, len(inputs)))
        for k, name in enumerate(inputs):
            B[f:, k] = self._row(name) @ self.test
        C = np.zeros((len(outputs), 2 * f))
        for k, name in enumerate(outputs):
            rate = name.endswith(" rate")
            C[k, f * rate : f * rate + f] = self._row(name.removesuffix(" rate")) @ self.basis
        A = np.block([[np.zeros((f, f)), np.eye(f)], [-self.K, -self.C]])
        return A, B, C, np.zeros((len(outputs), len(inputs)))

    def _row(self, name: str) -> Array:
        """(n,) motion of a marker along or about an axis of the world, per coordinate."""
        place, _, axis = name.rpartition(" ")
        check_known(axis, AXES, f"{name!r} ends in no axis of the world; there are")
        return np.asarray(self.jacobian(self.packed.marker(place))[AXES.index(axis)])

    def __str__(self) -> str:
        lines = ["mode  frequency [Hz]  damping ratio"]
        for k, (f, d) in enumerate(zip(self.frequencies, self.damping_ratios, strict=True)):
            lines.append(f"{k + 1:4d}  {f:14.6g}  {d:13.4g}")
        return "\n".join(lines)


def jacobian(packed: Packed, H: Array, marker: Marker) -> Array:
    """(6, n) motion of a marker per coordinate, from those of all markers H (k, 6, 6 + R)."""
    if packed.markers.get(marker, len(H)) >= len(H):
        hint = "Name it when the body is added, and take it from the part: part.marker(...)."
        raise ConfigError(f"{marker!r} is not a marker of the mechanism.", hint=hint)
    k = packed.row(marker)
    J, b = np.zeros((6, packed.v.size)), packed.system.markers.body[k]
    if b >= 0:
        at, r = packed.system.bodies.v_at[b], packed.system.bodies.r[b]
        J[:, at : at + 6 + r] = H[k, :, : 6 + r]
    return J


@typed
def linearize(  # noqa: PLR0913  keywords of the one entry, all have defaults
    mechanism: Mechanism,
    state: State | None = None,
    *,
    t: float | None = None,
    frame: object = "body",
    n: Annotated[int, Count(1)] | None = None,
    band: tuple[float, float] | None = None,
    blades: object = None,
    assemble: bool = False,
) -> Linearization:
    """Linearise the equations of motion around a state, at rest or moving.

    Variations of the state that satisfy the joints obey M y'' + C y' + K y = 0. K holds the
    stiffness of bodies and forces, the geometric stiffness of joints and loads, and what
    rotation and acceleration add; C holds dampers and gyroscopic terms. Around a state that moves,
    the coefficients are constant if everything turns as one in the axes of ``frame``.

    Args:
        mechanism: bodies, joints, forces.
        state: coordinates and velocities, from `equilibrium`, ``sol.final`` or None for the start;
            accelerations and reactions are computed.
        t: time at which drives and loads are taken [s]; None for that of the state.
        frame: axes in which small motions of a body are counted: "body" for what turns as a whole
            (blades), "world" for axisymmetric rotors of rigid bodies or rods that spin in bearings,
            not of reduced bodies, whose shapes turn with them; or {body: frame}.
        n: number of modes, the lowest; None for all. Cost and memory are then those of some steps
            in time, for thousands of bodies too, and M, C, K are those of these modes.
        band: (2,) modes between two frequencies [Hz] instead.
        blades: three or more identical blades of a rotor on a support, one after the other around
            its axis: each a body, a list of bodies or a non-linear body, by name or as added. What
            they do is counted together, in axes that do not turn (multi-blade coordinates), so
            that the coefficients are constant; what else turns needs the frame "world".
        assemble: see `rom.simulate`.

    Undamped modes asked for by ``n`` or ``band`` are counted by the signature of the stiffness, so
    that none is missed; damped and gyroscopic ones are those nearest to zero, or to the middle of
    the band, and are not counted.

    Raises:
        ConfigError: for a state of another mechanism, a wrong frame, more modes than there are.
        ModelError: naming the joint that the state does not satisfy, or one that rolls while it
            moves; or if the band has no mode.
        SolverError: if the equations are singular there.
        ModesMissedError: if other modes were found than there are.

    Warns:
        RomWarning: if the coefficients change with time: frequencies are then those of an instant;
            if a body without geometric stiffness is pressed by a tenth of what buckles it.

    Source:
        Variation of the equations of motion on R^3 x SO(3) x R^r, as in Bruels and Cardona,
        Mech. Mach. Theory 48 (2012) 121, projected on the tangent space of the constraints.

    Example:
        >>> mech = rom.Mechanism(gravity=(0, 0, -9.81))
        >>> at = {"at": (0, 0, 0), "markers": {"top": (0, 0, 1)}}
        >>> bob = mech.add_rigid("bob", mass=1, inertia=(1e-9,) * 3, **at)
        >>> mech.revolute("pivot", mech.ground.marker((0, 0, 1)), bob.marker("top"), axis=(1, 0, 0))
        >>> found = rom.linearize(mech, rom.equilibrium(mech)).frequencies
        >>> round(float(found[0] / (np.sqrt(9.81) / (2 * np.pi))), 6)  # that of a pendulum
        1.0
    """
    time = (0.0 if state is None else state.t) if t is None else t
    wanted = Wanted.of(n, band)
    now = instant(mechanism, time, sparse=wanted is not None)
    axes = chosen(frame, now.packed.names)
    state = consistent(now, state, assemble)
    refuse_rolling(now.packed, state)
    if blades is not None:
        axes = replace(axes, blades=Blades.of(blades, now.packed, state))
    still = of_instant(mechanism, now, state)
    few = _few(now, state, axes, wanted) if wanted else None
    if wanted and not few:
        return _part(linearize(mechanism, state, t=t, frame=frame, blades=blades), wanted)
    found = few or _reduced(now, state, axes)
    shares = {name: pressed(still, name) for name, part in mechanism.parts.items() if part.r}
    return replace(found, pressed={name: x for name, x in shares.items() if x is not None})


def _few(now: Instant, state: State, axes: Axes, wanted: Wanted) -> Linearization | None:
    """The modes wanted from sparse matrices; None where whole ones are needed or cheaper."""
    found = sparse_equations(now, state, axes)
    if found is None or not found.now.affords(wanted):
        return None
    pencil, known = found.now, None
    if pencil.symmetric:
        squares, Q = pencil.wanted(wanted)
        K, C = np.diag(squares), np.zeros((squares.size, squares.size))
    else:
        roots, Y, Q = pencil.wanted_damped(wanted)
        known = roots, Y, np.concatenate([roots, roots.conj()])
        K, C = pencil.seen_in(Q)
    if state.v.any():
        _warn_of_drift((K, C), found.later.seen_in(Q), found.rate)
    now.evaluate(state.q, state.v)
    basis, M = pencil.basis @ Q, np.eye(len(K))
    seen = now.probe(), now.packed, now.W.H.copy()
    return Linearization(state, M, C, K, basis, basis, ZERO_FREQUENCY_RTOL, *seen, known)


class SparseEquations(NamedTuple):
    """Small motions by sparse matrices: now, a little later, and the speed [rad/s]."""

    now: Pencil
    later: Pencil
    rate: float


def sparse_equations(now: Instant, state: State, axes: Axes) -> SparseEquations | None:
    """Small motions of a large mechanism; None where whole matrices are needed.

    Only whole matrices know reactions that friction depends on, and joints whose directions change
    in the axes of the bodies.
    """
    if now.packed.loaded_rows.size:
        return None
    pencil = _pencil(now, state, axes)
    path = _Path(now, state, axes, np.zeros((state.v.size, 0)))

    def answer(added: float, load: Array) -> Array:
        return pencil.inverse(pencil.even + added * pencil.M).solve(load)[0]

    rests = _rests(now, state, pencil.basis, answer)
    later = pencil if rests else _pencil(now, path.later().state, axes)
    return SparseEquations(pencil, later, path.rate) if pencil.allows(later) else None


def _pencil(now: Instant, state: State, axes: Axes) -> Pencil:
    return Pencil.of(now, state, small_motions(now.packed, state, axes))


def _rests(
    now: Instant, state: State, basis: Matrix, solve: Callable[[float, Array], Array]
) -> bool:
    """Whether a state has no velocity, and is so near to balance that its accelerations vanish.

    Light pieces of stiff bodies turn round-off of forces into accelerations of any size. ``solve``
    gives the motions in the basis, of unit mass, for a stiffness added [1/s^2] and a load.
    """
    if state.v.any() or not state.a.any():
        return not state.v.any()
    now.residual(state.q, state.v, state.a, state.lam)
    added = load_stiffness(now, state)
    load = basis.T @ (now.gradient(state.q, state.v)[2] @ state.a)
    return sizes(now.packed, basis @ solve(added, load))[0] <= RESTING_TOL


def _part(around: Linearization, wanted: Wanted) -> Linearization:
    """Some of all modes."""
    roots, V, _ = around._modes
    kept = wanted.among(roots)
    known = roots[kept], V[:, kept], np.concatenate([roots[kept], roots[kept].conj()])
    return replace(around, known=known)


def _reduced(now: Instant, state: State, axes: Axes) -> Linearization:
    """Matrices for the motions the joints leave, and a warning if they change with time."""
    T, scale = small_motions(now.packed, state, axes)[0], now.probe()
    _, G, M = now.gradient(state.q, state.v)
    Z = of_unit_mass(free_motions(G @ T, scale, state.rank), T.T @ M @ T)
    path = _Path(now, state, axes, Z)
    found = _matrices(now, state, axes, path)
    if state.v.any():
        later = path.later()
        moved_on = _matrices(now, later.state, axes, later)
        _warn_of_drift((found.K, found.C), (moved_on.K, moved_on.C), path.rate)
    return found


def _warn_of_drift(now: tuple[Array, Array], later: tuple[Array, Array], rate: float) -> None:
    """Warn if stiffness and damping change within `PROBE_ANGLE`."""

    def largest(K: Array, C: Array) -> float:
        return float(max(np.abs(K).max(initial=0.0), rate * np.abs(C).max(initial=0.0)))

    size, change = max(largest(*now), rate**2), largest(later[0] - now[0], later[1] - now[1])
    if change > DRIFT_RTOL * PROBE_ANGLE * size:
        warn(
            f"the linear equations change with time, by {change / PROBE_ANGLE / size:.2g} of "
            "their size per radian: these frequencies are those of one instant."
        )


@dataclass(frozen=True)
class _Path:
    """The free motions, of unit mass, and how they follow the joints as these move."""

    now: Instant
    state: State
    axes: Axes
    Z: Array

    @cached_property
    def rate(self) -> float:
        """Speed of the mechanism in radians, or sizes, per second."""
        return self.now.rate(self.state)

    def ahead(self, h: float) -> Array:
        """Coordinates a time h later."""
        return self.now.shifted(self.state.q, h * self.state.v + 0.5 * h * h * self.state.a)

    def at(self, h: float) -> tuple[Array, Array]:
        """Coordinates a time h later, and the free motions there nearest to the present ones."""
        q = self.ahead(h)
        _, G, M = self.now.gradient(q, self.state.v)
        there = replace(self.state, q=q)
        T = small_motions(self.now.packed, there, self.axes)[0]
        mass = T.T @ M @ T
        N = of_unit_mass(free_motions(G @ T, self.now.probe(), self.state.rank), mass)
        U, _, V = np.linalg.svd(N.T @ mass @ self.Z)
        return q, N @ (U @ V)

    def rates(self) -> tuple[Array, Array]:
        """First and second time derivative of the free motions."""
        if self.rate > 0.0 and self.Z.size:
            h = PROBE_ANGLE / self.rate
            before, after = self.at(-h)[1], self.at(h)[1]
            change = max(np.abs(after - self.Z).max(), np.abs(before - self.Z).max())
            if change >= STEADY_RTOL * np.abs(self.Z).max():
                return (after - before) / (2 * h), (after - 2 * self.Z + before) / h**2
        return 0 * self.Z, 0 * self.Z

    def later(self) -> "_Path":
        """The same a little later."""
        h = PROBE_ANGLE / self.rate
        q, Z = self.at(h) if self.Z.size else (self.ahead(h), self.Z)
        v = fitting_velocity(self.now.packed, self.now.W, q, self.state.v + h * self.state.a)
        self.now.evaluate(q, v)
        state = with_accelerations(self.now.packed, self.now.W, replace(self.state, q=q, v=v))
        return replace(self, state=state, Z=Z)


def _matrices(now: Instant, state: State, axes: Axes, path: _Path) -> Linearization:
    T, T1, T2, T3 = small_motions(now.packed, state, axes)
    M, Cv, Kq = map(csr_matrix, now.matrices(state))
    H, basis, Z = now.W.H.copy(), T @ path.Z, path.Z
    test = _virtual(now, state, basis)
    C2 = test.T @ (M @ (T2 @ Z) + Cv @ basis)
    K2 = test.T @ (M @ (T3 @ Z) + Cv @ (T1 @ Z) + Kq @ basis)

    def answer(added: float, load: Array) -> Array:
        return np.linalg.solve(K2 + added * np.eye(len(K2)), load)

    if test is not basis or not _rests(now, state, basis, answer):
        Zd, Zdd = path.rates()
        C2 += test.T @ (M @ (2 * T @ Zd))
        K2 += test.T @ (M @ (T @ Zdd + T2 @ Zd) + Cv @ (T @ Zd))
    if test is not basis:  # else the motions are of unit mass
        M2 = test.T @ M @ basis
        test = np.linalg.solve(M2, test.T).T
        C2, K2 = np.linalg.solve(M2, C2), np.linalg.solve(M2, K2)
    M2, noise = np.eye(len(K2)), ZERO_FREQUENCY_RTOL if now.exact(state) else DIFFERENCED_ZERO_RTOL
    return Linearization(state, M2, C2, K2, basis, test, noise, now.probe(), now.packed, H)


def _virtual(now: Instant, state: State, basis: Array) -> Array:
    """Motions in which the reactions do no work; friction adds to what reactions do."""
    if not now.packed.loaded_rows.size:
        return basis
    R = now.reactions(state)
    return basis - np.linalg.lstsq(R.T, R.T @ basis, rcond=1e-9)[0]


def refuse_rolling(packed: Packed, state: State) -> None:
    """At rest, what rolls without sliding is held like by any other joint."""
    if state.v.any():
        packed.refuse_rolling(
            "a rolling joint binds velocities, not positions: it can be linearised at rest only.",
            "rom.steady_motion has the eigenvalues of steady rolling.",
        )
