"""A bent cantilever, and the run-up of a rotor of three rods, here and by Exudyn's exact beams.

The same sections, numbers of segments and elements; for the rotor the same law of the speed, step
and spectral radius. Processor time, one thread, without set-up.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.peers.compare import answer_to
from benchmarks.timing import Row, timed
from rom import rotation
from rom.components.cosserat import Rod, body, straight
from rom.components.wind.wind_turbine import (
    N_BLADES,
    RATED_SPEED,
    VISCOSITY_TIMES,
    blade,
    ramp,
    run_up,
    stations,
)
from rom.mbs.analysis.equilibrium import equilibrium
from rom.mbs.analysis.linearize import linearize
from rom.mbs.integrate.simulation import simulate
from rom.mbs.mechanism import Mechanism
from rom.model import Array

SCRIPT_FILE = Path(__file__).with_name("beams.py")
CANTILEVER_FILE = Path(__file__).with_name("cantilever.py")
CANTILEVER_SECTION = {"stretch": 1e6, "bend": 100.0, "mass": 1.0, "inertia": 1e-3}  # one metre
TIP_FORCE, N_BENT_MODES = 200.0, 10  # bends it by 60 degrees [N]
RISE_TIME, TIME_STEP, RHO_INF, N_SAMPLES = 20.0, 0.02, 0.9, 200
N_REFERENCE_SEGMENTS = 192  # of the blade whose lag is the reference
FROM_SECTION = [2, 0, 1]  # first axis along the beam there, third along the rod here
ORIGIN = (0.0, 0.0, 0.0)


def rotor(segments: int) -> Mechanism:
    """A hub that is driven about the first axis of the world, and three blades."""
    mech = Mechanism(gravity=ORIGIN)
    hub = mech.add_rigid("hub", mass=1.0, inertia=(1.0, 1.0, 1.0), at=ORIGIN)
    mech.revolute("shaft", mech.ground.marker(ORIGIN), hub.marker(ORIGIN), axis=(1, 0, 0))
    speed, angle = ramp(RATED_SPEED, RISE_TIME)
    mech.drive("motor", "shaft", angle, rate=speed)
    one = body(blade(segments, damped=True))
    for k in range(N_BLADES):
        turn = rotation.exp([2 * np.pi / N_BLADES * k, 0.0, 0.0])
        part = mech.add_nonlinear(f"blade {k}", one, orientation=turn)
        root = mech.design_point(part.marker("start"))
        mech.fixed(f"root {k}", hub.marker(root), part.marker("start"))
    return mech


def by_rom(segments: int) -> tuple[float, Array]:
    """Processor time of the steps [s], and (samples + 1, 3) deflection of the first tip."""
    mech, every = rotor(segments), round(RISE_TIME / TIME_STEP) // N_SAMPLES
    options: dict[str, Any] = {"dt": TIME_STEP, "rho_inf": RHO_INF, "save_every": every}
    simulate(mech, t_end=every * TIME_STEP, **options)  # reads the compiled kernels
    setup, _ = timed(simulate, mech, t_end=every * TIME_STEP, **options)
    seconds, sol = timed(simulate, mech, t_end=RISE_TIME, **options)
    last = max(mech.nonlinear["blade 0"].parts, key=lambda part: float(part.at[2]))
    seen = deflection(sol.position(last.name), last.at)
    return (seconds - setup) * N_SAMPLES / (N_SAMPLES - 1), seen


def deflection(tip: Array, home: Array) -> Array:
    """(k, 3) positions of a tip [m] as seen from the rotor, less its place at rest."""
    t = np.linspace(0.0, RISE_TIME, len(tip))
    angle = ramp(RATED_SPEED, RISE_TIME)[1]
    back = [rotation.matrix(rotation.exp([-angle(s), 0.0, 0.0])) for s in t]
    return np.array([A @ x - home for A, x in zip(back, tip, strict=True)])


def by_exudyn(segments: int) -> tuple[float, Array, str]:
    """The same by Exudyn, and its version."""
    described = {
        "blades": [
            beams(blade(segments, azimuth=2 * np.pi / N_BLADES * k)) for k in range(N_BLADES)
        ],
        "final": RATED_SPEED, "rise": RISE_TIME, "t_end": RISE_TIME,
        "steps": round(RISE_TIME / TIME_STEP), "samples": N_SAMPLES, "rho_inf": RHO_INF,
    }  # fmt: skip
    found = answer_to(SCRIPT_FILE, described)
    tip = np.array(found["tips"])[:, 0]
    return found["seconds"], deflection(tip, tip[0]), found["version"]


def beams(rod: Rod) -> dict[str, Any]:
    """Nodes and sections of a blade with elements between its vertices."""
    table, eta = stations(), np.linspace(0.0, 1.0, len(rod.x))
    twist = np.radians(np.interp(eta, table["eta"], table["twist_deg"]))
    root = rotation.matrix(rod.p[0]) @ _about_third(twist[0])
    frames = [(root @ _about_third(-a))[:, FROM_SECTION] for a in twist]
    nodes = np.column_stack([rod.x, [rotation.quaternion(A) for A in frames]])
    middle = (eta[1:] + eta[:-1]) / 2
    named = ("EA", "kGA", "kGA", "GJ", "EI_edge", "EI_flap")
    stiffness = np.column_stack([np.interp(middle, table["eta"], table[x]) for x in named])
    viscosity = np.array(VISCOSITY_TIMES)[[2, 0, 1, 5, 3, 4]]
    J = rod.inertia[1:-1] / rod.h[:, None]
    mass = np.array(_segment_masses(rod)) / rod.h
    return {"nodes": nodes.tolist(), "length": rod.h.tolist(), "stiffness": stiffness.tolist(),
            "damping": (viscosity * stiffness).tolist(), "inertia": J[:, FROM_SECTION].tolist(),
            "mass": mass.tolist()}  # fmt: skip


def _about_third(angle: float) -> Array:
    return rotation.matrix(rotation.exp([0.0, 0.0, angle]))


def _segment_masses(rod: Rod) -> list[float]:
    """Masses of the segments [kg], halves of which are lumped at the vertices."""
    masses: list[float] = []
    for lumped in rod.mass[:-1]:
        masses.append(2 * (lumped - (masses[-1] / 2 if masses else 0.0)))
    return masses


def measured(segments: int = 48) -> Iterator[Row]:
    """Case, quantity, value, unit and aim of each figure; see `benchmarks.benchmarks.rods`."""
    case = f"run-up, {N_BLADES} blades, {round(RISE_TIME / TIME_STEP)} steps"
    fine = (
        run_up(blade(N_REFERENCE_SEGMENTS, damped=True), t_end=RISE_TIME, dt=TIME_STEP)
        .tip[:, 1]
        .max()
    )
    theirs, beam, version = by_exudyn(segments)
    yield case, f"Exudyn {version}, {segments} elements", theirs, "s of the processor", ""
    error = abs(np.abs(beam[:, 1]).max() / fine - 1)
    yield case, f"their lag against {N_REFERENCE_SEGMENTS} segments", error, "", ""
    for n, aim in ((segments, "below 0.01"), (2 * segments, "below 0.002")):
        seconds, tip = by_rom(n)
        yield case, f"rom, {n} segments", seconds, "s of the processor", ""
        yield case, f"Exudyn over rom, {n} segments", theirs / seconds, "", "above 1"
        error = abs(np.abs(tip[:, 1]).max() / fine - 1)
        yield case, f"lag of {n} against {N_REFERENCE_SEGMENTS} segments", error, "", aim
    apart = np.abs(tip - beam).max() / np.abs(tip).max()
    yield case, "difference of the tips", apart, "of the deflection", "below 0.01"


def bent(segments: int = 400) -> Iterator[Row]:
    """Case, quantity, value, unit and aim of each figure: statics of a cantilever, modes about it.

    Args:
        segments: also four times as many, without Exudyn, whose matrices would be full.
    """
    bent_by_rom(segments)  # links what is compiled
    ours, many = bent_by_rom(segments), bent_by_rom(4 * segments)
    theirs = bent_by_exudyn(segments)
    case = f"{segments} segments, bent"
    for what in ("equilibrium", "modes"):
        yield case, what, ours[what], "s of the processor", "both below 1"
        ratio = theirs[what] / ours[what]
        yield case, f"Exudyn {theirs['version']} over rom, {what}", ratio, "", ""
        yield f"to {4 * segments} segments", what, many[what] / ours[what], "", "below 6"
    apart = np.abs(np.array(theirs["tip"]) - ours["tip"]).max()
    yield case, "difference of the tips", float(apart), "of the length", "below 1e-4"
    gap = np.abs(np.array(theirs["frequencies"]) / ours["frequencies"] - 1).max()
    yield case, "difference of ten frequencies", float(gap), "", "below 1e-3"


def bent_by_rom(segments: int) -> dict[str, Any]:
    """Processor times [s] of statics and modes, (3,) tip [m] and frequencies [Hz]."""
    mech = Mechanism(gravity=ORIGIN)
    along = rotation.matrix(rotation.exp([0.0, np.pi / 2, 0.0]))  # third axis to the first
    rod = mech.add_nonlinear(
        "rod", body(straight(1.0, segments, frame=along, **CANTILEVER_SECTION))
    )
    mech.fixed("clamp", mech.ground.marker(ORIGIN), rod.marker("start"))
    mech.force("tip", rod.marker("end"), (0.0, 0.0, -TIP_FORCE))
    statics, state = timed(equilibrium, mech)
    modes, f = timed(lambda: linearize(mech, state, n=N_BENT_MODES).frequencies)
    return {"equilibrium": statics, "modes": modes, "tip": state.q[-7:-4], "frequencies": f}


def bent_by_exudyn(segments: int) -> dict[str, Any]:
    """The same by Exudyn, and its version."""
    section = CANTILEVER_SECTION
    described = {
        "length": 1.0, "segments": segments, "force": [0.0, 0.0, -TIP_FORCE],
        "stiffness": [section["stretch"]] * 3 + [section["bend"]] * 3,
        "inertia": [section["inertia"]] * 3, "mass": section["mass"],
    }  # fmt: skip
    return answer_to(CANTILEVER_FILE, described)
