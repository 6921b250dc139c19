"""The NREL 5 MW reference turbine as one mechanism: rods, rigid bodies, gear and shaft.

The foot of the tower is the origin, the first axis points downwind and the third one up. Tower and
blades are rods of `rom.components.wind.wind_turbine`; nacelle, hub and generator are rigid. The
shaft between hub and gear twists; the gear drives the generator.

Source:
    Jonkman, Butterfield, Musial, Scott, Definition of a 5-MW reference wind turbine for offshore
    system development, NREL/TP-500-38060, 2009.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
from numba import carray

from rom import rotation
from rom.arguments import Count, typed
from rom.body import FlexibleBody
from rom.components.cosserat import RodBody, body
from rom.components.wind.blade_element import in_wind
from rom.components.wind.blading import Pitch
from rom.components.wind.control import CUT_OUT_WIND, Controller, advance
from rom.components.wind.wake import NEVER_BEFORE, entry_of, in_late_wind, over_time
from rom.components.wind.wind_turbine import (
    CONE_ANGLE,
    GEAR_RATIO,
    GENERATOR_INERTIA,
    HUB_INERTIA,
    HUB_OVERHANG,
    N_BLADES,
    SHAFT_DAMPING,
    SHAFT_HEIGHT,
    SHAFT_STIFFNESS,
    SHAFT_TILT,
    TOWER_HEIGHT,
    blade,
    tower,
)
from rom.errors import ConfigError
from rom.mbs.analysis.equilibrium import equilibrium
from rom.mbs.elements.law_calls import LAW_TYPES
from rom.mbs.elements.nonlinear import Assembly
from rom.mbs.kernels.compiled import inner
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.bodies import Marker, Part
from rom.mbs.results.solution import Solution
from rom.mbs.results.state import State
from rom.model import Array

HUB_MASS = 56_780.0  # kg
NACELLE_MASS, NACELLE_CENTRE = 240_000.0, (1.9, 0.0, 1.75)  # kg, m from the top of the tower
NACELLE_YAW = 2_607_890.0  # kg m^2 about the axis of the tower
# kg; gear wheel and generator are part of the nacelle, which is lighter by as much
WHEEL_MASS, GENERATOR_MASS = 1000.0, 1000.0
WHEEL_INERTIA = 500.0  # kg m^2: of no weight beside the generator's 5e6 on the slow side
NO_VELOCITY = (0.0, 0.0, 0.0)
Pose = tuple[Array, Array, float, float, float]  # of all blades: lean, hub, cone, pitch, speed
# natural frequencies at standstill, gear locked, of two programs [Hz]: table 9-1 of the definition
PUBLISHED_FREQUENCIES = {
    "tower sideways": (0.3120, 0.3164),
    "tower fore-aft": (0.3240, 0.3195),
    "shaft twists": (0.6205, 0.6094),
    "blades flap, yawing": (0.6664, 0.6296),
    "blades flap, pitching": (0.6675, 0.6686),
    "blades flap together": (0.6993, 0.7019),
    "blades edgewise, pitching": (1.0793, 1.0740),
    "blades edgewise, yawing": (1.0898, 1.0877),
    "second flap, yawing": (1.9337, 1.6507),
    "second flap, pitching": (1.9223, 1.8558),
    "second flap together": (2.0205, 1.9601),
    "second of the tower fore-aft": (2.9003, 2.8590),
    "second of the tower sideways": (2.9361, 2.9408),
}
# places of these among the modes of the turbine; the table leaves out the one in which all blades
# swing edgewise against the shaft
PLACES = (*range(11), 12, 13)


@dataclass(frozen=True)
class Turbine:
    """A turbine as a mechanism.

    Attributes:
        mechanism: all of it; `slow`, the joint of gear wheel and nacelle, turns about the shaft.
        blades: three rods.
        tower: a rod, None for a stiff one.
        axis: (3,) of the shaft, downwind [1].
        hub: (3,) its centre [m].
    """

    mechanism: Mechanism
    blades: tuple[Assembly, ...]
    tower: Assembly | None
    axis: Array
    hub: Array

    def turn_by(self, angle: Callable[[float], float], speed: Callable[[float], float]) -> None:
        """Prescribe the angle [rad] and the speed [rad/s] of the gear wheel over time."""
        self.mechanism.drive("speed", "slow", angle, rate=speed)

    def turning(self, speed: float) -> State:
        """The steady motion at a speed [rad/s], which then is prescribed.

        Raises:
            ConfigError: if gravity pulls at the blades: no motion is steady then.
        """
        if np.any(self.mechanism.gravity):
            text = "blades that turn under gravity have no steady motion."
            raise ConfigError(text, hint="turbine(gravity=0.0, ...)")
        self.turn_by(lambda t: speed * t, lambda t: speed)
        return equilibrium(self.mechanism, spin={"slow": speed, "fast": GEAR_RATIO * speed})

    def turn_with(self, torque: Callable[[float, float, float], float]) -> None:
        """Let a torque [N m] of (time, angle, speed) on the slow side turn the rotor."""
        self.mechanism.motor("torque", "slow", torque)

    def tip(self, solution: Solution, k: int) -> Array:
        """(t, 3) deflection of the tip of blade k in axes of the hub [m].

        Downwind, against the motion, outward.
        """
        start, end = self.blades[k].marker("start"), self.blades[k].marker("end")
        A = rotation.matrix(self.blades[k].parts[0].p)
        home = self.mechanism.design_point(end) - self.mechanism.design_point(start)
        out = home / np.linalg.norm(home)
        behind = np.cross(out, self.axis)
        basis = np.array([np.cross(behind, out), behind, out]) @ A
        arm = solution.position(end.body) - solution.position(start.body)
        axes = solution.axes(start.body, start.place)
        seen = np.einsum("tji,tj->ti", axes, arm) - A.T @ home
        return seen @ basis.T


@typed
def turbine(  # noqa: PLR0913  one keyword per choice, all with defaults
    segments: Annotated[int, Count(1)] = 48,
    *,
    tower_segments: Annotated[int, Count()] = 16,
    gravity: float = 9.80665,
    tilt: float = SHAFT_TILT,
    cone: float = CONE_ANGLE,
    damped: bool = True,
    wind: npt.ArrayLike | None = None,
    late_wake: bool = False,
    controlled: bool = False,
    pitch: Pitch = 0.0,
    speed: float = 0.0,
    shaft: tuple[float, float] = (SHAFT_STIFFNESS, SHAFT_DAMPING),
    hub_body: FlexibleBody | None = None,
    shear: float = 1.0,
    torsion: float = 1.0,
) -> Turbine:
    """The turbine, its first blade up.

    Args:
        segments: of a blade.
        tower_segments: of the tower; 0 for a stiff one.
        gravity: its acceleration [m/s^2].
        tilt: of the shaft, nose up [rad].
        cone: of the blades, upwind [rad].
        damped: whether blades have the viscosity of the definition.
        wind: its speed along the first axis [m/s], see `rom.components.wind.blade_element`; with a
            late wake also (k, 2) instants [s] and speeds, see `in_late_wind`; None: still. The
            tower dams it.
        late_wake: whether the wake has a memory; else it is as in steady flow at each instant.
        controlled: whether the published controller brakes the generator and pitches the blades, as
            the law "control".
        pitch: of all blades at the start, leading edge into the wind [rad].
        speed: with which the rotor starts to turn [rad/s].
        shaft: torsional stiffness [N m/rad] and damping [N m s/rad].
        hub_body: a reduced solid for the hub with interfaces "shaft", "blade_1" to "blade_3", as of
            ``meshes/turbine_hub.geo``; what it lacks of the mass of the hub sits in its centre.
            None: rigid.
        shear: factor of this rigidity of blades and tower [1]; with a thousand they are the
            Euler-Bernoulli beams of other programs.
        torsion: factor of this rigidity likewise; some programs know no twist.

    Raises:
        ConfigError: for a solid that is no hub, a wind that changes without a late wake, or one in
            which no controller works.
        ModelError: if a rod is none, see `cosserat.rod`.
    """
    if controlled and wind is not None and (most := over_time(wind)[:, 1].max()) > CUT_OUT_WIND:
        text = f"no controller works in a wind of {most:g} m/s, above 25 m/s."
        raise ConfigError(text, hint="Stand in it without: controlled=False.")
    mech = Mechanism(gravity=(0.0, 0.0, -gravity))
    factors = {"shear": shear, "torsion": torsion}
    top, standing = _tower(mech, tower_segments, factors)
    lean = rotation.matrix(rotation.exp([0.0, tilt, 0.0]))
    axis, hub = lean @ [1.0, 0.0, 0.0], np.array([0.0, 0.0, TOWER_HEIGHT + SHAFT_HEIGHT])
    hub = hub - HUB_OVERHANG * axis
    nacelle = _nacelle(mech, top)
    way = nacelle.at - hub
    bearing = nacelle.marker(axis * (axis @ way) - way)  # on the axis of the shaft
    turning = _hub(mech, hub_body, hub, lean, speed)
    _train(mech, bearing, axis, shaft, speed)
    one = body(blade(segments, damped=damped, **factors))
    if wind is not None and not late_wake:
        if not isinstance(wind, int | float):
            raise ConfigError("a wind that changes meets a late wake.", hint="late_wake=True")
        one = in_wind(one, (wind, 0.0, 0.0), axis=axis, cone=cone, tower=True)
    place = lean, hub, cone, pitch, speed
    blades = tuple(_blade(mech, k, one, place) for k in range(N_BLADES))
    if wind is not None and late_wake:
        for each in blades:
            in_late_wind(mech, each, wind, axis=axis, cone=cone, tower=True)
    ends = [_mount(mech, k, turning, each, controlled) for k, each in enumerate(blades)]
    if controlled:
        generator = mech.part("generator").marker(NO_VELOCITY)
        markers = bearing, generator, *(m for pair in ends for m in pair)
        add_control(mech, markers, axis, (speed, pitch))
    return Turbine(mech, blades, standing, axis, hub)


def _tower(
    mech: Mechanism, segments: int, factors: dict[str, float]
) -> tuple[Marker, Assembly | None]:
    """The marker on top of the tower, and the tower."""
    if segments == 0:
        return mech.ground.marker((0.0, 0.0, TOWER_HEIGHT)), None
    standing = mech.add_nonlinear("tower", body(tower(segments, **factors)))
    mech.fixed("foot", mech.ground.marker(NO_VELOCITY), standing.marker("start"))
    return standing.marker("end"), standing


def _nacelle(mech: Mechanism, top: Marker) -> Part:
    """Nacelle without gear wheel and generator, fixed on the tower.

    Of its inertia only that about the tower is published; the others are the least a body can have.
    """
    mass = NACELLE_MASS - WHEEL_MASS - GENERATOR_MASS
    at = np.array([0.0, 0.0, TOWER_HEIGHT]) + NACELLE_CENTRE
    yaw = NACELLE_YAW - NACELLE_MASS * (NACELLE_CENTRE[0] ** 2 + NACELLE_CENTRE[1] ** 2)
    part = mech.add_rigid("nacelle", mass=mass, inertia=(yaw / 2, yaw / 2, yaw), at=at)
    mech.fixed("yaw", top, part.marker(-np.array(NACELLE_CENTRE)))
    return part


def _hub(mech: Mechanism, solid: FlexibleBody | None, at: Array, lean: Array, speed: float) -> Part:
    """The hub, which carries the blades, rigid or a solid with what else is in it."""
    pose: dict[str, Any] = {"at": at, "orientation": lean, "omega": (speed, 0.0, 0.0)}
    if solid is None:
        return mech.add_rigid("hub", mass=HUB_MASS, inertia=(HUB_INERTIA,) * 3, **pose)
    missing = {"shaft", *(f"blade_{k + 1}" for k in range(N_BLADES))} - set(solid.markers)
    if missing:
        raise ConfigError(f"the hub {solid.name!r} needs the interfaces {sorted(missing)}.")
    part = mech.add_flexible("hub", solid, **pose)
    own = float(part.second[1, 1] + part.second[2, 2])
    if not (part.mass < HUB_MASS and own < HUB_INERTIA):
        has, whole = f"{part.mass:g} kg and {own:g} kg m^2", f"{HUB_MASS:g} and {HUB_INERTIA:g}"
        raise ConfigError(f"the hub {solid.name!r} has {has}; all of the hub has {whole}.")
    pose |= {"mass": HUB_MASS - part.mass, "inertia": (HUB_INERTIA - own,) * 3}
    inside = mech.add_rigid("in the hub", **pose)
    flange = part.marker("shaft")
    mech.fixed("drives", flange, inside.marker(part.point(flange)))
    return part


def _train(
    mech: Mechanism, bearing: Marker, axis: Array, shaft: tuple[float, float], speed: float
) -> None:
    """Gear wheel and generator, and the shaft to the hub."""
    at, hub = mech.design_point(bearing), mech.part("hub")
    for name, turns, mass, inertia, omega in (
        ("wheel", "slow", WHEEL_MASS, WHEEL_INERTIA, speed * axis),
        ("generator", "fast", GENERATOR_MASS, GENERATOR_INERTIA, GEAR_RATIO * speed * axis),
    ):
        part = mech.add_rigid(name, mass=mass, inertia=(inertia,) * 3, at=at, omega=omega)
        mech.revolute(turns, bearing, part.marker(NO_VELOCITY), axis=axis)
    mech.gear("gear", "slow", "fast", ratio=GEAR_RATIO)
    end = hub.marker(NO_VELOCITY if hub.flexible is None else "shaft")
    mech.revolute("shaft", mech.part("wheel").marker(mech.design_point(end) - at), end, axis=axis)
    mech.rotational_spring("twist", "shaft", stiffness=shaft[0], damping=shaft[1])


def _blade(mech: Mechanism, k: int, one: RodBody, place: Pose) -> Assembly:
    """Blade k where the hub carries it."""
    lean, centre, cone, pitch, speed = place
    round_ = rotation.matrix(rotation.exp([2 * np.pi / N_BLADES * k, 0.0, 0.0]))
    A = lean @ round_ @ rotation.matrix(rotation.exp([0.0, -cone, 0.0]))
    A = A @ rotation.matrix(rotation.exp([0.0, 0.0, -pitch]))
    turning = A.T @ lean @ [speed, 0.0, 0.0]
    return mech.add_nonlinear(f"blade {k + 1}", one, at=centre, orientation=A, omega=turning)


def _mount(mech: Mechanism, k: int, hub: Part, rod: Assembly, turns: bool) -> tuple[Marker, Marker]:
    """Bolt blade k to the hub, or set it on a bearing along its axis; both ends."""
    root = rod.marker("start")
    arm = rotation.matrix(hub.p).T @ (mech.design_point(root) - hub.at)
    flange = hub.marker(arm if hub.flexible is None else f"blade_{k + 1}")
    if turns:
        axis = rotation.matrix(rod.parts[0].p)[:, 2]
        mech.revolute(f"root {k + 1}", flange, root, axis=axis)
    else:
        mech.fixed(f"root {k + 1}", flange, root)
    return flange, root


# between the pitch that is asked for and that of a blade [N m/rad, N m s/rad]: 30 Hz and two
# percent of critical damping with the inertia of a blade
PITCH_STIFFNESS, PITCH_DAMPING = 971.35e6, 0.206e6
CONTROLLER_SIZE = 5  # remembered: filtered speed, integral, pitch, torque, and the instant
# markers: nacelle, generator, and flange and root of each blade; numbers of the axis, the first
# pitch, and two directions of each blade without further pitch
N_MARKERS, N_NUMBERS = 2 + 2 * N_BLADES, 4 + 6 * N_BLADES


@inner
def turn_of_blade(flange, root, given, out):
    """How far a blade has pitched further [rad], positive as the controller counts.

    ``flange`` and ``root`` have axes (3, 3); ``given`` (6,) the first two axes of the root at the
    start, in axes of the flange. Fills (3,) the axis of the bearing.
    """
    along = beside = 0.0
    for i in range(3):
        out[i] = root[3 * i + 2]
        for j in range(3):
            along += root[3 * i] * flange[3 * i + j] * given[j]
            beside += root[3 * i] * flange[3 * i + j] * given[3 + j]
    return math.atan2(-beside, along)


def control(t, parameters, motion, memory, out):
    """Torque of the generator and moments of the actuators, a law of N_MARKERS markers."""
    n = N_MARKERS
    given, known = carray(parameters, (N_NUMBERS,)), carray(memory, (CONTROLLER_SIZE,))
    moved, answer = carray(motion, (18 * n,)), carray(out, (6 * n + 2 + CONTROLLER_SIZE + 2,))
    axes, omega = moved[3 * n : 12 * n], moved[15 * n : 18 * n]
    moment, kept = answer[3 * n : 6 * n], answer[6 * n + 2 :]
    axis, state, speed = np.empty(3), np.empty(4), 0.0
    for i in range(3):
        axis[i] = axes[3 * i] * given[0] + axes[3 * i + 1] * given[1] + axes[3 * i + 2] * given[2]
        speed += (omega[3 + i] - omega[i]) * axis[i]
    for i in range(4):
        state[i] = known[i]
    if known[4] > NEVER_BEFORE and t > known[4]:
        advance(state, speed, t - known[4])
    for i in range(4):
        kept[i] = state[i]
    kept[4] = max(t, known[4])
    kept[5], kept[6] = state[2], state[3]
    for i in range(3):
        moment[i] = state[3] * axis[i]
        moment[3 + i] = -state[3] * axis[i]
    for k in range(N_BLADES):
        a, b = 2 + 2 * k, 3 + 2 * k
        flange, root = axes[9 * a : 9 * a + 9], axes[9 * b : 9 * b + 9]
        angle = given[3] + turn_of_blade(flange, root, given[4 + 6 * k : 10 + 6 * k], axis)
        rate = 0.0
        for i in range(3):
            rate -= (omega[3 * b + i] - omega[3 * a + i]) * axis[i]
        held = PITCH_STIFFNESS * (state[2] - angle) - PITCH_DAMPING * rate
        for i in range(3):
            moment[3 * b + i] = -held * axis[i]
            moment[3 * a + i] = held * axis[i]


def add_control(
    mechanism: Mechanism, markers: tuple[Marker, ...], axis: Array, start: tuple[float, float]
) -> None:
    """Let the published controller work as the law "control".

    It measures the speed of the generator, remembers what a `Controller` does from one accepted
    step to the next, brakes the generator against the nacelle, and turns each blade on its bearing
    to the pitch that is asked for, by a spring and a damper. Markers are those of nacelle and
    generator, then of hub and root of each blade; it starts at a speed of the rotor and a pitch.
    """
    speed, pitch = start
    axes = [rotation.matrix(mechanism.part(m.body).p) for m in markers]
    one = Controller.at(GEAR_RATIO * speed, pitch)
    turned = [(A.T @ B)[:, :2].T.ravel() for A, B in zip(axes[2::2], axes[3::2], strict=True)]
    mechanism.law(
        "control",
        entry_of(control, LAW_TYPES),
        *markers,
        parameters=np.concatenate([axes[0].T @ axis, [pitch], *turned]),
        memory=[one.filtered, one.integral, one.pitch, one.torque, NEVER_BEFORE],
        outputs=["pitch", "torque"],
    )
