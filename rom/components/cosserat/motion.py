"""Rods in motion: one rod as a `rom.Mechanism`, held and led as one of its own asks.

What has no mass or inertia gets some, too little to matter: a ten-thousandth of the heaviest
vertex, a hundredth of mass times square of the length of a segment.

Source:
    See docs/theory/rods.md.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from itertools import product
from typing import Annotated

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicHermiteSpline

from rom import rotation
from rom.arguments import Positive, Share, typed
from rom.components.cosserat.bodies import body
from rom.components.cosserat.energy import Rod, internal, work
from rom.components.cosserat.shapes import Shape, elastic_energy, reference
from rom.components.cosserat.statics import Loads, add_loads, fitting, loads
from rom.errors import ConfigError, RomError
from rom.mbs.connections.ends import enter
from rom.mbs.integrate.simulation import simulate as simulate_mechanism
from rom.mbs.kernels.system import ANGLE, NORMAL, POINT
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.joints import NO_VECTOR, Joint, Row
from rom.mbs.results.solution import Solution
from rom.model import Array, Mask

LEAST_COSINE = 0.1  # between an axis of a root that is led and its mean direction
LEAST_MASS_SHARE, LEAST_INERTIA_SHARE = 1e-4, 1e-2  # of what has none, see above

Placement = tuple[npt.ArrayLike, npt.ArrayLike, npt.ArrayLike, npt.ArrayLike]


@dataclass(frozen=True)
class Motion:
    """How a rod moved.

    Attributes:
        rod: the rod, with the mass and inertia that it had.
        t: (k,) instants [s].
        x: (k, N + 1, 3) positions [m].
        p: (k, N + 2, 4) quaternions of plate, segments, plate [1].
        v: (k, 6 N + 9) velocities: plate, x_0, segment, x_1, ... [m/s, rad/s]; angular ones in
            section axes.
        root: (k, 6) what holds the start: force in world axes [N], moment in section axes [N m],
            without the inertia of the held vertex itself.
        iterations: of all steps together.
    """

    rod: Rod
    t: Array
    x: Array
    p: Array
    v: Array
    root: Array
    iterations: int

    def shape(self, k: int) -> Shape:
        """The shape at an instant."""
        return Shape(self.x[k], self.p[k])

    def energies(self) -> Array:
        """(k, 2) kinetic and elastic energy [J]."""
        v = np.concatenate([self.v, np.zeros((len(self.t), 3))], axis=1).reshape(len(self.t), -1, 6)
        kinetic = 0.5 * np.einsum("tkc,kc,tkc->t", v[:, :, :3], self.rod.inertia, v[:, :, :3])
        kinetic += 0.5 * np.einsum("tkc,k,tkc->t", v[:, :-1, 3:], self.rod.mass, v[:, :-1, 3:])
        elastic = [elastic_energy(self.rod, self.shape(k)) for k in range(len(self.t))]
        return np.column_stack([kinetic, elastic])


@typed
def simulate(  # noqa: PLR0913  keywords of one run, all with defaults
    rod: Rod,
    t_end: Annotated[float, Positive("s")],
    dt: Annotated[float, Positive("s")],
    *,
    load: Loads | Callable[[float], Loads] | None = None,
    root: Callable[[float], Placement] | None = None,
    start: Shape | None = None,
    free: Mask | npt.ArrayLike | None = None,
    rho_inf: Share = 0.9,
    save_every: int = 1,
) -> Motion:
    """Motion of a rod from rest, or from the velocity of its root as a rigid body.

    Args:
        rod: the rod.
        t_end: end of the run [s].
        dt: step [s].
        load: dead forces and moments as of `statics.loads`, or a function of time that gives them.
        root: function of time that gives position (3,), quaternion (4,), velocity (3,) in world
            axes and angular velocity (3,) in section axes of the plate at the start; without it
            that plate stays where it is. The rod starts with the angular velocity of its root.
        start: shape at time zero; without it the one without stress.
        free: (6 N + 9,) which dofs may move [1], rotations in section axes; without it the plate at
            the start is held.
        rho_inf: damping of the highest frequencies in a step, 1 for none [1].
        save_every: steps between instants that are kept.

    Raises:
        ConfigError: for shapes of arrays that differ from those of the rod, or a section of which
            two rotations are free.
        ModelError: if the rod has no mass at all.
        SolverError: if a step has no solution; its ``solution`` is what came before.
    """
    constant = loads(rod) if load is None or callable(load) else load
    acting: Callable[[float], Loads] = cache(load) if callable(load) else lambda _: constant
    moving = fitting(rod, acting(0.0), free)[1]
    times = dt * np.arange(round(t_end / dt) + 1)
    rod, shape = _heavy(rod), reference(rod) if start is None else start
    mech = _at_start(rod, shape, root)
    if root is not None:
        _lead(mech, root, times)
    _hold(mech, moving, led=root is not None)
    _press(mech, acting, times if callable(load) else times[:1])
    try:
        found = simulate_mechanism(
            mech, t_end=float(times[-1]), dt=dt, rho_inf=rho_inf, save_every=save_every
        )
    except RomError as error:
        if isinstance(error.solution, Solution):
            error.solution = _motion(rod, error.solution, acting, moving)
        raise
    return _motion(rod, found, acting, moving)


def _at_start(rod: Rod, shape: Shape, root: Callable[[float], Placement] | None) -> Mechanism:
    """The rod at its start, with the velocity of its root."""
    x, p, v, w = (
        [shape.x[0], shape.p[0], np.zeros(3), np.zeros(3)]
        if root is None
        else (np.asarray(part, dtype=float) for part in root(0.0))
    )
    shape, spin = Shape(shape.x.copy(), shape.p.copy()), rotation.matrix(p) @ w
    shape.x[0], shape.p[0] = x, p
    mech = Mechanism(gravity=(0.0, 0.0, 0.0))
    mech.add_nonlinear("rod", body(rod, shape), velocity=v - np.cross(spin, x), omega=spin)
    return mech


def _heavy(rod: Rod) -> Rod:
    """The same with a little mass and inertia where there is none, as its body has them."""
    mass, inertia = rod.mass.copy(), rod.inertia.copy()
    mass[mass <= 0.0] = LEAST_MASS_SHARE * mass.max()
    own = LEAST_INERTIA_SHARE * 0.5 * (mass[1:] + mass[:-1]) * rod.h**2
    inner = inertia[1:-1]
    inertia[1:-1] = np.where(inner > 0.0, inner, own[:, None])
    rod = rod._replace(mass=mass, inertia=inertia)
    return rod._replace(inertia=body(rod).frames.inertia)


def _lead(mech: Mechanism, root: Callable[[float], Placement], times: Array) -> None:
    """Drives of place, of the angle about the axis that moves least, and of tilt against it."""
    x, p, v, w = (np.array(part, dtype=float) for part in zip(*map(root, times), strict=True))
    turned = np.array([rotation.matrix(one) for one in p])
    turning = turned @ np.array([rotation.skew(one) for one in w])
    world, _, own = np.linalg.svd(turned.mean(axis=0))
    seen, change = world.T @ turned @ own.T, world.T @ turning @ own.T
    if not seen[:, 0, 0].min() > LEAST_COSINE:
        text = "the root tumbles: none of its axes stays on one side of a plane."
        raise ConfigError(text, hint="Cut the run in two.")
    (c, s), (dc, ds) = (A[:, 1:, 1].T for A in (seen, change))
    angle, rate = np.unwrap(np.arctan2(s, c)), (c * ds - s * dc) / (c * c + s * s)
    values = np.column_stack([x, angle, seen[:, 0, 1:]])
    rates = np.column_stack([v, rate, change[:, 0, 1:]])
    rows = [Row(POINT, e, NO_VECTOR, NO_VECTOR) for e in np.eye(3)]
    rows += [Row(ANGLE, world[:, 1], own[1], world[:, 2])]
    rows += [Row(NORMAL, world[:, 0], b, NO_VECTOR) for b in own[1:]]
    ends = mech.ground.marker((0.0, 0.0, 0.0)), mech.nonlinear["rod"].marker("start")
    for k, row in enumerate(rows):
        enter(mech, Joint(f"root {k}", "guide", ends, (), row))
        way = CubicHermiteSpline(times, values[:, k], rates[:, k])
        mech.drive(f"way of root {k}", f"root {k}", way, rate=way.derivative())


def _hold(mech: Mechanism, free: Mask, *, led: bool) -> None:
    """Joints to the ground for what is held, but for a root that is led."""
    parts = mech.nonlinear["rod"].parts
    held = ~np.append(free, np.ones(3, dtype=bool)).reshape(-1, 2, 3)
    for k, part in enumerate(parts):
        if led and k == 0:
            continue
        A, turns = rotation.matrix(part.p), np.flatnonzero(held[k, 0])
        if turns.size == 1:
            text = f"section {k} is free to turn about two of its axes, which no joint leaves."
            raise ConfigError(text, hint="Free one, or all.")
        pairs = list(product(turns, np.flatnonzero(~held[k, 0])))
        pairs = list(zip(turns, np.roll(turns, -1), strict=True)) if turns.size == 3 else pairs
        rows = [Row(POINT, e, NO_VECTOR, NO_VECTOR) for e in np.eye(3)[held[k, 1]]]
        rows += [Row(NORMAL, A[:, a], np.eye(3)[c], NO_VECTOR) for a, c in pairs]
        if rows:
            ends = mech.ground.marker(part.at), part.marker((0.0, 0.0, 0.0))
            enter(mech, Joint(f"hold {k}", "hold", ends, tuple(rows)))


def _press(mech: Mechanism, acting: Callable[[float], Loads], times: Array) -> None:
    """Loads on the frames on which there are some at any of these times."""
    parts, constant = mech.nonlinear["rod"].parts, times.size == 1
    for kind, add in enumerate((mech.force, mech.torque)):
        ever = np.any([np.any(acting(float(t))[kind], axis=1) for t in times], axis=0)
        for k in np.flatnonzero(ever):
            name, marker = f"{('force', 'moment')[kind]} {k}", parts[k].marker((0.0, 0.0, 0.0))
            one = partial(lambda kind, k, t: acting(t)[kind][k], kind, k)
            add(name, marker, one(0.0) if constant else one)


def _motion(rod: Rod, found: Solution, acting: Callable[[float], Loads], free: Mask) -> Motion:
    """What the mechanism did, in the order of the rod."""
    q, v = found.q.reshape(len(found.t), -1, 7), found.v.reshape(len(found.t), -1, 6)
    x, p = q[:, :-1, :3].copy(), q[:, :, 3:].copy()
    v = np.roll(v, 3, axis=2).reshape(len(found.t), -1)[:, :-3]
    W, root = work(rod), np.zeros((len(found.t), 6))
    for k, t in enumerate(found.t):
        internal(rod, x[k], p[k], v[k], W)
        add_loads(p[k], *acting(float(t)), W)
        root[k] = np.roll(np.where(free[:6], 0.0, W.r[:6]), 3)
    return Motion(rod, found.t, x, p, v, root, int(found.statistics["iterations"]))
