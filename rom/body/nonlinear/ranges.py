"""The loads under which a body is to deflect far, as forces on its nodes."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import combinations, product
from typing import Annotated, Any, ClassVar

import numpy as np

from rom.arguments import Between, Count, Modes, finite, typed
from rom.body.recovery import CENTRIFUGAL_LOADS, PRODUCTS, centrifugal
from rom.eigen.supports import DIRECTIONS, Fixed, supports
from rom.eigen.verbs import Operators, mean_motion, own_points, owned
from rom.errors import ConfigError
from rom.model import Array, FEModel

MOST_STEPS = 1000  # of load, at each of which there is a state
FORCES = ("f_x", "f_y", "f_z", "m_x", "m_y", "m_z")


@dataclass(frozen=True)
class Load:
    """A component of a range of loads."""

    interface: str  # where it acts; "" for centrifugal force, which acts everywhere
    component: int  # 0 to 5 of force and moment, or of the products of angular velocities
    largest: float = 1.0  # [N, N m, 1/s^2]

    @property
    def name(self) -> str:
        """What it is called in reports."""
        if not self.interface:
            return CENTRIFUGAL_LOADS[self.component]
        return f"{self.interface} {FORCES[self.component]}"

    @property
    def signs(self) -> tuple[int, ...]:
        """Those that it can have: the square of a speed has one."""
        return (1,) if not self.interface and self.component < 3 else (1, -1)


@typed
@dataclass(frozen=True)
class Geometric:
    """Large deflection under a range of loads, for `rom.reduce`.

    Attributes:
        loads: {interface: (6,) largest force [N] and moment [N m] of either sign, axes of the
            geometry}; they keep their direction, a moment as a pair of forces. Each component
            alone reaches its largest; of several at once the squares of their shares add up to
            one, so that for a skew load of two equal ones each is given 1.41 times as large.
        n_modes: how many of the lowest fixed-interface modes drag others along, beside the
            static shapes of the loads; a repeated frequency counts as a whole.
        tol: how much of the energy of the states may be left out, as the root of its share [1].
        n_shapes: alternatively, the number of shapes added to the basis. All are spent on the
            loads of the range: without it there are some for what else acts on their interfaces,
            as a torque on a beam that is bent.
        n_steps: of load on the way to its largest value, at each of which a state is taken.
        fixed: interfaces held in the mean beside the reference while the loads act, or
            {name: directions}: the far end of an arch, {"crown": "x rx ry rz"} at half of one.
        spin: (3,) largest angular velocity about each axis of the geometry [rad/s]: centrifugal
            force is a load beside the others.
        about: (3,) a point of the axis of rotation [m]; if missing the origin of the reference.

        snapshots: solve the full model at the largest loads, each alone and each two together, and
            let what is new in its states be shapes beside the derivatives: for third order.
        sampling: if given, the material is neo-Hookean with the same constants, and its energy that
            of a few weighted elements, whose forces differ by this share from those of all [1].

    Where the body snaps on the way to a load, its path is followed by arc length.

    Raises:
        ConfigError: for a range without any load, or a point without a spin.

    Example:
        >>> rom.Geometric(loads={"tip": (0, 200.0, 0, 0, 0, 0)}).n_steps
        4
    """

    TAKEN_BY: ClassVar[str] = "rom.reduce, rom.reduce_pieces and rom.certify_pieces"

    loads: Mapping[str, Any]
    n_modes: Modes = 4
    tol: Annotated[float, Between(0, 1, "()")] = 1e-4
    n_shapes: Annotated[int, Count(1)] | None = None
    n_steps: Annotated[int, Count(1, MOST_STEPS)] = 4
    fixed: Fixed = ()
    spin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    about: tuple[float, float, float] | None = None
    sampling: Annotated[float, Between(0, 1, "()")] | None = None
    snapshots: bool = False

    def __post_init__(self) -> None:
        for name, load in self.loads.items():
            if not finite(f"the range of loads at {name!r}", load, (6,)).any():
                raise ConfigError(f"the range of loads at {name!r} is {load!r}: it needs a force.")
        spins = finite("spin", self.spin, (3,)).any()
        if not self.loads and not spins:
            text = "no range of loads is given; name an interface"
            raise ConfigError(f'{text}, as in loads={{"tip": (0, 200.0, 0, 0, 0, 0)}}.')
        if self.about is not None:
            finite("about", self.about, (3,))
            if not spins:
                raise ConfigError(f"about = {self.about!r} needs a spin; leave it out without one.")

    def components(self) -> list[Load]:
        """The loads that are not zero: those of interfaces, then centrifugal ones."""
        of_interfaces = [
            Load(name, k, abs(float(x)))
            for name, load in self.loads.items()
            for k, x in enumerate(load)
            if x
        ]
        squares = [abs(float(self.spin[i] * self.spin[j])) for i, j in PRODUCTS]
        return of_interfaces + [Load("", k, x) for k, x in enumerate(squares) if x]

    def load_cases(self) -> Array:
        """(c, l) directions of the components together, each alone and each two of them [1]."""
        components = self.components()
        units = np.eye(len(components))
        alone = [s * unit for unit, load in zip(units, components, strict=True) for s in load.signs]
        for (one, u), (other, v) in combinations(zip(components, units, strict=True), 2):
            signs = product(one.signs, other.signs)
            alone += [(a * u + b * v) / np.sqrt(2) for a, b in signs]
        return np.array(alone)


def held_motions(geometric: Geometric, known: Iterable[str]) -> list[Load]:
    """Each motion held beside the reference, as the load that would move it."""
    return [
        Load(name, DIRECTIONS.index(direction))
        for name, directions in supports(geometric.fixed, known).items()
        for direction in directions or DIRECTIONS
    ]


def further_loads(geometric: Geometric, held: list[Load]) -> list[Load]:
    """Unit forces and moments on the interfaces of a range, but those on what is held."""
    every = (Load(name, k) for name in geometric.loads for k in range(len(FORCES)))
    return [load for load in every if load not in held]


def axis_point(geometric: Geometric, model: FEModel, reference: str) -> Array:
    """(3,) the point of the axis of rotation [m], for a body that is held at its reference."""
    about = geometric.about
    return np.asarray(model.interfaces[reference].origin if about is None else about)


def nodal_forces(loads: list[Load], model: FEModel, ops: Operators, about: Array) -> Array:
    """(n_local, l) nodal forces [N] of loads at their largest, (3,) about a point of the axis."""
    F = np.zeros((ops.n_local, len(loads)))
    field = centrifugal(own_points(ops, model.points) - about)
    for k, load in enumerate(loads):
        if not load.interface:
            F[:, k] = field[:, load.component]
            continue
        interface = model.interfaces[load.interface]
        mine = owned(ops, interface.dofs)
        at = interface.dofs[mine] - ops.first
        F[at, k] = load.largest * mean_motion(interface)[load.component, mine]
    turning = [k for k, load in enumerate(loads) if not load.interface]
    if turning:
        F[:, turning] = ops.apply_M(F[:, turning]) * [loads[k].largest for k in turning]
    return F
