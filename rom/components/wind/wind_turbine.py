"""Blade and tower of the NREL 5 MW reference turbine as rods, and the run-up of its rotor.

The rotor turns about the first axis of the world, which points downwind; blades start along the
third one, up. A point of a blade then moves against the second axis. Section axes of a blade are
flapwise (downwind where it has no twist), edgewise (towards the trailing edge), along.

Source:
    Jonkman, Butterfield, Musial, Scott, Definition of a 5-MW reference wind turbine for offshore
    system development, NREL/TP-500-38060, 2009.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from rom import rotation
from rom.components.cosserat import Motion, Rod, along, equilibrium, loads, rod, simulate
from rom.mbs.parts import signals
from rom.model import Array

STATIONS = Path(__file__).parent / "nrel5mw_blade.csv"
COLUMNS = "eta twist_deg mass EI_flap EI_edge GJ EA kGA inertia_edge inertia_flap".split()
BLADE_LENGTH, HUB_RADIUS = 61.5, 1.5  # m
MASS_FACTOR = 1.04536  # brings the mass to that of the definition; inertias stay as they are
VISCOSITY_TIMES = (1e-3, 1e-3, 1e-3, 1.4e-3, 2.2e-3, 2.2e-3)  # s, as in the files of BeamDyn
RATED_SPEED = 12.1 * np.pi / 30  # rad/s
TOWER_HEIGHT = 87.6  # m
TUBE_SIZES = {"diameter": (6.0, 3.87), "wall": (0.0351, 0.0247)}  # m, at foot and top
N_BLADES = 3
HUB_OVERHANG = 5.0191  # from the axis of the tower to the hub [m]
SHAFT_HEIGHT = 1.96256  # from the top of the tower [m]
SHAFT_TILT = float(np.radians(5.0))  # nose up [rad]
CONE_ANGLE = float(np.radians(2.5))  # blades upwind, away from the tower [rad]
HUB_INERTIA = 115_926.0  # kg m^2, about the rotor axis
GEAR_RATIO = 97.0
GENERATOR_INERTIA = 534.116  # about the fast shaft [kg m^2]
SHAFT_STIFFNESS, SHAFT_DAMPING = 8.67637e8, 6.215e6  # N m/rad and N m s/rad, of the slow shaft
STEEL = {"E": 210e9, "G": 80.8e9, "rho": 8500.0}  # with paint, bolts and flanges


def stations() -> dict[str, Array]:
    """{name: (49,)} properties of the blade along its length, in units of SI; twist [deg]."""
    return dict(zip(COLUMNS, np.loadtxt(STATIONS, delimiter=",").T, strict=True))


def _places(n: int) -> tuple[Array, Array, Array]:
    """Vertices, middles of segments, and of what bends at a vertex, along a length of one."""
    s = np.linspace(0, 1, n + 1)
    return s, (s[1:] + s[:-1]) / 2, np.concatenate(([s[1] / 4], s[1:-1], [1 - s[1] / 4]))


def blade(
    n: int = 48,
    *,
    azimuth: float = 0.0,
    damped: bool = False,
    shear: float = 1.0,
    torsion: float = 1.0,
) -> Rod:
    """One blade on a rigid hub whose centre is the origin.

    Args:
        n: number of segments, of equal length.
        azimuth: turned about the rotor axis from upright [rad].
        damped: with viscosity in proportion to the rigidities.
        shear: factor of the shear rigidity [1]; a thousand makes an Euler-Bernoulli beam.
        torsion: factor of the torsional rigidity [1]; a thousand keeps sections from turning.
    """
    table = stations()
    eta, middles, cells = _places(n)
    turn = rotation.matrix(rotation.exp([azimuth, 0, 0]))

    def at(name: str, where: float | Array) -> Array:
        return np.interp(where, table["eta"], table[name])

    def place(s: float) -> tuple[Array, Array]:
        twist = float(np.radians(at("twist_deg", s)))  # leading edge into the wind
        axes = turn @ rotation.matrix(rotation.exp([0, 0, -twist]))
        return turn @ [0, 0, HUB_RADIUS + BLADE_LENGTH * s], axes

    edge, flap = at("inertia_edge", middles), at("inertia_flap", middles)
    return along(
        place,
        eta,
        stretch=np.column_stack([shear * at("kGA", middles)] * 2 + [at("EA", middles)]),
        bend=np.column_stack(
            [at("EI_edge", cells), at("EI_flap", cells), torsion * at("GJ", cells)]
        ),
        mass=MASS_FACTOR * at("mass", middles),
        inertia=np.column_stack([edge, flap, edge + flap]),
        viscosity=VISCOSITY_TIMES if damped else 0.0,
    )


def tower(n: int = 40, *, top: float = 0.0, shear: float = 1.0, torsion: float = 1.0) -> Rod:
    """The tower, a conical tube along the third axis.

    It has n segments of equal length and a mass on its top [kg]; factors of its rigidities for
    shear and torsion [1] are as of `blade`.
    """
    s, middles, cells = _places(n)

    def tube(where: Array) -> tuple[Array, Array]:
        """Area, and second moment of area about a diameter."""
        D, t = (end[0] + where * (end[1] - end[0]) for end in TUBE_SIZES.values())
        d = D - 2 * t
        return np.pi / 4 * (D**2 - d**2), np.pi / 64 * (D**4 - d**4)

    (A, I), (_, bent) = tube(middles), tube(cells)
    GA, EI = shear * STEEL["G"] * A / 2, STEEL["E"] * bent
    rod = along(
        lambda at: (np.array([0, 0, TOWER_HEIGHT * at]), np.eye(3)),
        s,
        stretch=np.column_stack([GA, GA, STEEL["E"] * A]),
        bend=np.column_stack([EI, EI, 2 * torsion * STEEL["G"] * bent]),
        mass=STEEL["rho"] * A,
        inertia=STEEL["rho"] * np.column_stack([I, I, 2 * I]),
    )
    mass = rod.mass.copy()
    mass[-1] += top
    return rod._replace(mass=mass)


def ramp(final: float, rise: float) -> tuple[Callable[[float], float], Callable[[float], float]]:
    """Speed and angle over time, from rest to a final speed [rad/s] without a jerk.

    The speed is final (t / rise - sin(2 pi t / rise) / 2 pi) until ``rise`` [s].
    """
    angle, speed, _ = signals.run_up(final, rise)
    return speed, angle


@dataclass(frozen=True)
class RunUp:
    """A blade while the rotor is driven to its speed.

    Attributes:
        motion: of the blade in the world.
        angle: (k,) of the rotor [rad].
        speed: (k,) of the rotor [rad/s].
        tip: (k, 3) deflection of the tip in axes that turn with the rotor: downwind, against the
            motion, outward [m].
        torque: (k,) about the rotor axis that drives this blade [N m].
    """

    motion: Motion
    angle: Array
    speed: Array
    tip: Array
    torque: Array

    @property
    def t(self) -> Array:
        """(k,) instants [s]."""
        return self.motion.t


def run_up(
    rod: Rod,
    *,
    t_end: float = 30.0,
    dt: float = 0.02,
    final: float = RATED_SPEED,
    rise: float = 20.0,
    gravity: float = 0.0,
    **options: Any,
) -> RunUp:
    """Drive the root of a blade about the rotor axis from rest to a speed.

    Args:
        rod: a `blade`.
        t_end: end of the run [s].
        dt: step [s].
        final: speed that is reached [rad/s].
        rise: when it is reached [s], see `ramp`.
        gravity: acceleration of gravity, down [m/s^2]; the blade starts at rest under its weight.
        options: more for `cosserat.simulate`.

    Raises:
        ConfigError: for a step or an end that is not positive.
        SolverError: if a step has no solution.
    """
    speed, angle = ramp(final, rise)
    home = rod.x[0].copy(), rod.p[0].copy()
    axis = rotation.matrix(home[1]).T @ [1.0, 0, 0]  # rotor axis in the axes of the root

    def root(t: float) -> tuple[Array, Array, Array, Array]:
        turn = rotation.exp([angle(t), 0, 0])
        x = rotation.matrix(turn) @ home[0]
        return x, rotation.multiply(turn, home[1]), np.cross([speed(t), 0, 0], x), speed(t) * axis

    weight = loads(rod, weight=(0, 0, -gravity))
    start = equilibrium(rod, weight) if gravity else None
    motion = simulate(rod, t_end, dt, root=root, **{"load": weight, "start": start} | options)
    angles = np.array([angle(t) for t in motion.t])
    outward = rod.x[-1] / np.linalg.norm(rod.x[-1])
    basis = np.array([[1.0, 0, 0], np.cross(outward, [1.0, 0, 0]), outward])
    back = [rotation.matrix(rotation.exp([-a, 0, 0])) for a in angles]
    ends = [A @ x - rod.x[-1] for A, x in zip(back, motion.x[:, -1], strict=True)]
    held = zip(motion.x[:, 0], motion.p[:, 0], motion.root, strict=True)
    about = [np.cross(x, r[:3]) + rotation.matrix(p) @ r[3:] for x, p, r in held]
    speeds = np.array([speed(t) for t in motion.t])
    return RunUp(motion, angles, speeds, np.array(ends) @ basis.T, np.array(about)[:, 0])


SLOW_GENERATOR_INERTIA = GENERATOR_INERTIA * GEAR_RATIO**2  # kg m^2, on the slow side of the gear
RIGID_STIFFNESS = 1e12  # [N], [N m^2] of what does not bend; the root of a blade has 2e10


@dataclass(frozen=True)
class Rotor:
    """One third of generator, shaft and hub, and one blade: a rotor that a torque drives.

    Without gravity the three blades move alike. All of it is one rod: the generator is the plate at
    its start, the shaft twists, the hub is a corner and a link that do not bend.

    Attributes:
        rod: generator plate, two segments of shaft along the first axis, hub link, blade.
        free: (6 N + 9,) which dofs may move: generator and hub stay on the axis.
    """

    rod: Rod
    free: npt.NDArray[np.bool_]

    def torque(self, total: float) -> tuple[Array, Array]:
        """Loads (N + 1, 3), (N + 2, 3) of a torque of the whole rotor on the generator [N m]."""
        moment = np.zeros((len(self.rod.p), 3))
        moment[0, 0] = total / N_BLADES
        return np.zeros_like(self.rod.x), moment

    def speeds(self, motion: Motion) -> Array:
        """(k, 2) angular velocity of generator and hub about the axis [rad/s]."""
        turning = zip(motion.p[:, 3], motion.v[:, 18:21], strict=True)
        hub = [rotation.matrix(p)[0] @ w for p, w in turning]
        return np.column_stack([motion.v[:, 2], hub])

    def momentum(self, motion: Motion) -> Array:
        """(k,) angular momentum of the whole rotor about its axis [kg m^2/s]."""
        v = np.concatenate([motion.v, np.zeros((len(motion.t), 3))], axis=1)
        v = v.reshape(len(motion.t), -1, 6)
        x, u, mass = motion.x, v[:, :-1, 3:], self.rod.mass
        orbital = (mass * (x[:, :, 1] * u[:, :, 2] - x[:, :, 2] * u[:, :, 1])).sum(axis=1)
        own = self.rod.inertia * v[:, :, :3]
        first = [[rotation.matrix(p)[0] for p in row] for row in motion.p]
        return N_BLADES * (orbital + np.einsum("tkc,tkc->t", np.array(first), own))


def rotor(n: int = 24, *, blade_rod: Rod | None = None) -> Rotor:
    """The rotor of the NREL 5 MW turbine.

    Its blade has n segments, or is another one, upright, whose root is on the hub.

    Raises:
        ModelError: as `cosserat.rod`.
    """
    one = blade(n) if blade_rod is None else blade_rod
    n = one.h.size
    along = rotation.quaternion(np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]))  # third axis: x
    x = np.concatenate([[[-HUB_OVERHANG, 0, 0], [-HUB_OVERHANG / 2, 0, 0], [0, 0, 0]], one.x])
    p = np.concatenate([[along] * 3, one.p[:1], one.p[1:]])
    # of the half and the whole segment that twist
    twist = 0.75 * HUB_OVERHANG * SHAFT_STIFFNESS / N_BLADES
    stiff = [RIGID_STIFFNESS] * 3
    stretch = np.concatenate([[stiff] * 3, one.stretch])
    bend = np.concatenate([[[RIGID_STIFFNESS, RIGID_STIFFNESS, twist]] * 2, [stiff], one.bend])
    whole = rod(x, p, stretch=stretch, bend=bend, bends=[True, True, False] + [True] * n)
    inertia = np.concatenate([np.zeros((4, 3)), one.inertia[1:]])
    inertia[0, 2] = SLOW_GENERATOR_INERTIA / N_BLADES
    inertia[3, :2] = HUB_INERTIA / N_BLADES  # both, since the sections of the root are turned
    viscous = np.concatenate([np.zeros((3, 3)), one.viscous_bend])
    viscous[:2, 2] = twist * SHAFT_DAMPING / SHAFT_STIFFNESS
    stretched = np.concatenate([np.zeros((3, 3)), one.viscous_stretch])
    whole = whole._replace(mass=np.concatenate([np.zeros(3), one.mass]), inertia=inertia)
    whole = whole._replace(viscous_bend=viscous, viscous_stretch=stretched)
    free = np.ones(6 * (n + 3) + 9, dtype=bool)
    free[[0, 1]] = free[3:6] = free[15:18] = False  # generator and hub centre
    return Rotor(whole, free)
