# # Geared shafts on oil films
#
# After Fargere and Velex: a pinion drives a gear, their shafts turn in hydrodynamic bearings, and
# teeth and films share the load. Shafts are beams, in a unit that stands ready, and then solids,
# meshed with gmsh and reduced, as a mechanism. Numbers of teeth are those of a known rig; all else
# is for illustration, no measurement is reproduced.
#
# Run: `python demos/demo_transmission.py`
# Time: 1 min
# Writes: `transmission.png` into `out/`; another folder with `--out`

import argparse
from dataclasses import replace
from pathlib import Path

from mpi4py import MPI

import numpy as np

import rom
from rom import view
from rom.components.gear_mesh import Correction, GearPair, Mesh, iso_stiffness, stiffness_table
from rom.components.journal_bearing import Groove, JournalBearing, equilibrium, iso_vg
from rom.components.transmission import Disc, Rotor, Shaft, Transmission, mesh_response, rest

options = argparse.ArgumentParser(description="geared shafts on oil films")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
first = MPI.COMM_WORLD.rank == 0
say = print if first and not options.quiet else lambda *_: None

# ## The unit
#
# 26 and 157 teeth of module 4 mm, 40 mm wide; 200 mm between bearings with two grooves across the
# load. The gear turns six times as slowly, and its bearings have to be larger.

C, OIL, WIDE = 50e-6, iso_vg(46), np.radians(20)
Z, TEETH, MODULE, FACE = np.linspace(0.0, 0.2, 9), (26, 157), 4e-3, 0.04
BUSHES = ((0.05, 0.025, C), (0.09, 0.06, 8e-5))  # diameter, length and clearance


def journal(load, size=BUSHES[0]):
    """A bearing of that diameter, length and clearance whose load points in that direction."""
    grooves = [Groove(load + side * np.pi / 2, WIDE) for side in (1, -1)]
    return JournalBearing(*size, grooves, cells=(60, 4))


def unit(torque, rpm, helix=0.0, celsius=60.0, correction=None):
    """The torque is that of the pinion [N m]."""
    pair = GearPair(TEETH, MODULE, FACE, helix)
    pair = replace(pair, centre_distance=pair.distance + 1e-4)
    load = np.pi / 2 - pair.alpha  # the line of action, from X
    rotors = [
        Rotor(
            Shaft(Z, size[0], [Disc.of_ring(4, outer=z * MODULE, inner=size[0], width=FACE)]), 4,
            {0: journal(way, size), 8: journal(way, size)},
        )
        for z, way, size in zip(TEETH, (load + np.pi, -load), BUSHES, strict=True)
    ]  # fmt: skip
    k = stiffness_table(pair, force=torque / pair.rb[0] / pair.width)
    mesh = Mesh(pair, k, correction or Correction(), damping=2e-6)
    viscosity = float(OIL.viscosity(celsius))
    return Transmission(*rotors, mesh, rpm * np.pi / 30, torque * TEETH[1] / TEETH[0], viscosity)


# ## Journals travel farther than teeth bend
#
# Up to 500 N m on the pinion; beyond, the bent shaft wipes the ends of its bushes.

torques = [25, 50, 100, 200, 300, 400, 500]
rests = [rest(unit(T, 3000)) for T in torques]
for T, r in zip(torques, rests, strict=True):
    films, given = r.forces.films, r.powers
    teeth, k = r.forces.mesh.load.sum(), r.forces.mesh.stiffness[5, 5]
    bent = teeth * r.unit.mesh.pair.rb[0] ** 2 / k
    say(f"{T:5d} N m: eccentricity {films[0].eccentricity:.3f} and {films[2].eccentricity:.3f}, "
        f"journal {1e6 * films[0].eccentricity * C:.1f}, teeth {1e6 * bent:.1f} micrometres, "
        f"heat {given[2]:.0f} W of {given[0] / 1e3:.1f} kW")  # fmt: skip
balance = max(abs(1 - sum(r.powers[1:]) / r.powers[0]) for r in rests)

# ## The same unit of solids
#
# Shafts and wheels in one piece, solid up to the roots of the teeth, with rims that deform. Films
# and teeth are those of the beams. What bearings carry is statics, and journals rest in the same
# places; but the wheel stiffens its shaft, and they tilt less.


def solid(k):
    """Reduced shaft and wheel of the pinion, 0, or of the gear, 1."""
    diameter, length, _ = BUSHES[k]
    sizes = {"L": 0.28, "z_a": 0.04, "z_w": 0.14, "z_b": 0.24, "l_j": length, "d": diameter,
             "b": FACE, "D": (TEETH[k] - 2.5) * MODULE, "lc": (0.013, 0.03)[k]}  # fmt: skip
    model = rom.fe.model(Path(__file__).parents[1] / "meshes" / "gear_shaft.geo", parameters=sizes,
                         material=rom.Material(E=206e9, nu=0.3, rho=7850.0))  # fmt: skip
    seats = dict.fromkeys(("journal_a", "journal_b", "end_a"), "rbe3")
    return rom.reduce(model, method=rom.CraigBampton(4), reference="mean-axis", certify=False,
                      interfaces=seats | {"wheel": rom.FourierLegendre(1, 1)})  # fmt: skip


solids = {"pinion": solid(0), "gear": solid(1)}


def machine(unit):
    """The unit as a mechanism of solids."""
    mech, z = rom.Mechanism(gravity=(0, 0, 0)), np.array([0, 0, 1.0])
    rotors, motors = (unit.pinion, unit.gear), (unit.motor, 0.0)
    for k, (name, body) in enumerate(solids.items()):
        part = mech.add_flexible(name, body, at=(k * unit.mesh.pair.distance, 0, 0),
                                 spin=unit.spins[k] * z)  # fmt: skip
        for side, bearing in zip("ab", rotors[k].bearings.values(), strict=True):
            seat = part.marker(f"journal_{side}")
            bush = mech.ground.marker(mech.design_point(seat))
            mech.journal_bearing(f"{name} {side}", seat, bush, axis=(1 - 2 * k) * z,
                                 bearing=bearing, oil=unit.viscosity)  # fmt: skip
        end, drive = part.marker("end_a"), np.array([0, 0, 1e8, 0, 0, motors[k]])
        mech.bushing(f"end of {name}", mech.ground.marker(mech.design_point(end)), end,
                     stiffness=drive, damping=unit.loss * drive)  # fmt: skip
    wheels, mesh = [mech.part(name).marker("wheel") for name in solids], unit.mesh
    mech.gear_mesh("teeth", *wheels, axis=z, pair=mesh.pair, stiffness=mesh.stiffness,
                   damping=mesh.damping, correction=mesh.correction)  # fmt: skip
    mech.torque("load", mech.part("gear").marker("end_a"), unit.torque * z)
    return mech


beams = rests[3]
mech = machine(beams.unit)
still = rom.mbs.snapshot(mech, rom.equilibrium(mech))
films = {name: still.journal_bearing(f"{name} a") for name in solids}
load = rom.mbs.tooth_loads(still, "teeth")[0]
for name, x, film in zip(solids, films.values(), beams.forces.films[::2], strict=True):
    tilts = [1e6 * np.hypot(*motion[2:]) for motion in (x.motion[0], film.motion)]
    say(f"{name}, {solids[name].mass:.1f} kg: tilt {tilts[0]:.1f}, of beams {tilts[1]:.1f} microrad"
        f"; {x.pressure[0] / 1e6:.2f} and {film.pressure.max() / 1e6:.2f} MPa")  # fmt: skip

# ## Transmission error against speed
#
# Linear about the equilibrium of each speed. A path of relief on the tips takes most of it away.

speeds = np.r_[500:2000:250, 2000:4500:100, 4500:6001:50]  # closer together at resonances


def sweep(torque=300, **more):
    """Mesh frequencies [Hz] and transmission errors [micrometres] below the threshold of whirl."""
    found, start = [], None
    for rpm in speeds:
        state = rest(unit(torque, rpm, **more), start=start)
        found.append((rpm, 1e6 * mesh_response(state, positions=48).error_rms))
        start = state.q
    return tuple(np.transpose(found))


tips = Correction((1e-5, 1e-5), (7e-3, 7e-3))
curves = {f"oil of {T:.0f} \u00b0C": sweep(celsius=T) for T in (40.0, 80.0)}
curves["60 \u00b0C, tips relieved"] = sweep(celsius=60.0, correction=tips)

# ## Load on the teeth of the solids
#
# Step by step from rest. Spur gears as cut and with that relief; then helical ones, which tilt each
# other, without and with 10 micrometres of crowning.


def moving(*conditions, **more):
    """Times [ms] and loads on the teeth, after some mesh periods."""
    one = unit(*conditions, **more)
    mech, period = machine(one), one.mesh_period
    motion = rom.simulate(mech, state=rom.equilibrium(mech), t_end=12 * period, dt=period / 60,
                          progress=False)  # fmt: skip
    loads = rom.mbs.tooth_loads(motion, "teeth")[-240:]
    return 1e3 * (motion.t[-240:] - motion.t[-240]), loads


def force(correction=None):
    """Between spur gears at 300 N m [kN] over time."""
    t, loads = moving(300, 3000, correction=correction)
    return t, [1e-3 * x.force.sum() for x in loads]


def across(correction=None):
    """Mean over time of the load on helical gears at 500 N m over its mean, over the face [mm]."""
    loads = moving(500, 3000, np.radians(12.5), correction=correction)[1]
    mean = np.mean([x.across_face(FACE, 21) for x in loads], axis=0)
    return 1e3 * FACE * ((np.arange(21) + 0.5) / 21 - 0.5), mean


forces = {"as cut": force(), "tips relieved": force(tips)}
faces = {"as cut": across(), "crowned": across(Correction(crowning=1e-5))}

# ## The pictures

turn, paths = np.linspace(0, 2 * np.pi, 100), {}
for name, k, sign, c in (("_pinion", 0, 1, BUSHES[0][2]), ("_gear", 2, -1, BUSHES[1][2])):
    x, y = np.transpose([r.forces.films[k].motion[:2] for r in rests]) / c
    paths[name] = (x, sign * y)
journals = view.Panel(
    "Where journals rest", "x / clearance", "y / clearance",
    {"_clearance": (np.cos(turn), np.sin(turn))} | paths, points=paths, equal=True,
    notes={"pinion, 25 N m": (-0.6, -0.22), "500 N m": (-0.42, -0.82),
           "gear, 25 N m": (-0.5, 0.02), "500 N m ": (0.1, 0.55)},
)  # fmt: skip
if first:
    options.out.mkdir(parents=True, exist_ok=True)
    walls = view.tooth_walls(still, "teeth", scale=3e-6, direction=(0, 1, 0))
    oil = [view.film_wall(still, f"{name} {side}", scale=2e-8, gap=2e-3)
           for name in solids for side in "ab"]  # fmt: skip
    scene = view.Scene(
        "The machine of solids at rest, 200 N m",
        {name: view.toothed_shaft(mech, name) for name in solids}
        | {"load on the teeth": view.Thing(*walls, "#edae49"),
           "oil pressure": view.Thing(*view.joined(oil), "#66a182")},
        view=(-0.8, 0.4, 1.0), up=(0, 1, 0),
    )  # fmt: skip
    view.panels(
        [[scene, journals],
         [view.Panel("Transmission error", "speed of the pinion [1/min]",
                     "root mean square [\u00b5m]", curves),
          view.Panel("Force between spur gears", "time [ms]", "force [kN]", forces),
          view.Panel("Load on helical gears", "across the face [mm]", "load / mean", faces)]],
        options.out / "transmission.png", title="Geared shafts on oil films",
        caption="A pinion of 26 teeth drives a gear of 157; both shafts turn in plain bearings, "
        "ISO VG 46, 3000 turns a minute, 60 degrees Celsius. Above, left: solids, meshed and "
        "reduced, at 200 N m on the pinion; walls on the lines of contact are as high as the load "
        f"on the teeth, up to {(load.force / load.length).max() / 1e3:.0f} N/mm, those around the "
        f"journals as the pressure of the oil, up to {films['pinion'].pressure[0] / 1e6:.1f} MPa. "
        "Right: where the journals of beams rest as the torque of the pinion grows; the circle is "
        "the clearance. They travel farther than the teeth bend. Below, left: what spur teeth of "
        "beams excite at 300 N m, linear about the equilibrium of each speed; it peaks where a "
        "multiple of the mesh frequency meets a natural one. Middle: those of the solids step by "
        "step. Right: helical teeth of the solids at 500 N m tilt the shafts, and one end of the "
        "face carries more; crowning takes the load off both ends. Relief and crowning are 10 "
        "micrometres deep, relief 7 mm long. Parameters are for illustration.",
    )  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.

straight = equilibrium(replace(journal(0.0), cells=(180, 12), aligned=True), (4093 / 2, 0),
                       speed=100 * np.pi, viscosity=0.02)  # fmt: skip
attitude = np.degrees(np.arctan2(*straight.motion[1::-1]))
plain, _, relieved = (error for _, error in curves.values())
on_beams = [film.eccentricity for film in beams.forces.films[::2]]
pinion, gear = (np.hypot(*x.motion[0, :2]) / size[2]
                for x, size in zip(films.values(), BUSHES, strict=True))  # fmt: skip
results = {
    "eccentricity at 200 N m, by another program": (straight.eccentricity, 0.7328, 0.003),
    "attitude there, by another program [degrees]": (attitude, 35.35, 0.01),
    "load on the teeth, solids and beams [N]": (
        load.force.sum(), beams.forces.mesh.load.sum(), 1e-6),
    "eccentricity of the pinion, solids and beams": (pinion, on_beams[0], 2e-3),
    "eccentricity of the gear, solids and beams": (gear, on_beams[1], 1e-3),
    "torque of gear over pinion": (beams.unit.torque / beams.input_torque, 157 / 26, 0.01),
    "power, 1 + what is missing": (1 + balance, 1.0, 1e-6),
    "ISO 6336, mesh stiffness [N/mm/um]": (
        iso_stiffness(GearPair(TEETH, MODULE, FACE))[2] / 1e9, 22.30, 1e-3),
    "speeds at which relief more than halves the error": (
        np.sum(relieved < 0.5 * plain), speeds.size, 1e-9),
}  # fmt: skip
if first:
    for name, (value, expected, tolerance) in results.items():
        print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
