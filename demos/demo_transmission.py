# # Geared shafts on oil films
#
# After Fargere and Velex: a pinion drives a gear, their shafts turn in hydrodynamic bearings, and
# teeth and films share the load together. The numbers of teeth are those of a known rig; all other
# parameters are chosen for illustration, no measurement is reproduced.
#
# Run: `python demos/demo_transmission.py`
# Writes: `transmission.png`, `transmission_fields.png` into `out/`; another folder with `--out`

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from rom import view
from rom.components.gear_mesh import Correction, GearPair, Mesh, iso_stiffness, stiffness_table
from rom.components.journal_bearing import (
    Groove,
    JournalBearing,
    equilibrium,
    iso_vg,
    threshold_speed,
)
from rom.components.transmission import Disc, Rotor, Shaft, Transmission, mesh_response, rest

options = argparse.ArgumentParser(description="geared shafts on oil films")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
say = print if not options.quiet else lambda *_: None

# ## The unit
#
# 26 and 157 teeth of module 4 mm, 40 mm wide; 200 mm between bearings with two grooves across the
# load. The gear turns six times as slowly, and its bearings have to be larger.

C, OIL, WIDE = 50e-6, iso_vg(46), np.radians(20)
Z = np.linspace(0.0, 0.2, 9)
TEETH, MODULE, FACE = (26, 157), 4e-3, 0.04
BUSHES = ((0.05, 0.025, C), (0.09, 0.06, 8e-5))  # diameter, length and clearance
DISTANCE = GearPair(TEETH, MODULE, FACE).distance + 1e-4


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
    k = 15e9 if helix else stiffness_table(pair, force=torque / pair.rb[0] / pair.width)
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

# ## Where oil comes in
#
# One bearing of the pinion at 200 N m; its oil comes from one groove. A film that conserves oil
# feels a groove behind the load, and none carries the load from a groove in its middle.

W = (rests[3].forces.mesh.load.sum() / 2, 0.0)
run = {"speed": 100 * np.pi, "viscosity": 0.02}
places = {"90 deg before the load": -90, "opposite to it": 180, "90 deg behind it": 90}
inlets = {
    name: equilibrium(
        JournalBearing(0.05, 0.025, C, [Groove(np.radians(a), WIDE)], "jfo", cells=(120, 12)),
        W, **run,
    )
    for name, a in places.items()
}  # fmt: skip
for name, f in inlets.items():
    say(f"groove {name}: eccentricity {f.eccentricity:.3f}, filled "
        f"{100 * f.fill.mean():.0f} %, whirl from {threshold_speed(f):.2f} sqrt(g/c)")  # fmt: skip
straight = equilibrium(replace(journal(0.0), cells=(180, 12), aligned=True), (4093 / 2, 0), **run)

# ## Load on the teeth
#
# Helical teeth, without and with 10 micrometres of crowning, through a mesh period.


def field(correction):
    """Force per length on the base plane, over face and path of contact [N/mm]."""
    state = rest(unit(500, 3000, np.radians(12.5), correction=correction))
    pair = state.unit.mesh.pair
    s, z = np.linspace(*pair.path, 61), np.linspace(-0.02, 0.02, 22)
    total, seen = (np.zeros((60, 21)) for _ in range(2))
    for theta in 2 * np.pi / 26 * np.arange(60) / 60:
        state = rest(state.unit, theta, start=state.q)
        got = state.forces.mesh
        use = ~got.slices.back
        place = (got.slices.s[use], got.slices.z[use])
        total += np.histogram2d(*place, (s, z), weights=got.load[use] / got.slices.length[use])[0]
        seen += np.histogram2d(*place, (s, z))[0]
    return pair, np.where(seen > 0, total / np.maximum(seen, 1), np.nan) / 1e3


fields = {
    "as cut": field(None),
    "crowned by 10 micrometres": field(Correction(crowning=1e-5)),
}

# ## Transmission error against speed
#
# Linear about the equilibrium of each speed. A path of relief on the tips takes most of it away.

speeds = np.concatenate(  # where teeth come with an eigenfrequency or half of it, close together
    [np.arange(500, 2000, 250), np.arange(2000, 4500, 100), np.arange(4500, 6001, 50)]
)


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

# ## The pictures

options.out.mkdir(parents=True, exist_ok=True)


def wheel(k):
    """Gear, shaft and bushes of the pinion, 0, or of the gear, 1, as they stand in space."""
    diameter, length, _ = BUSHES[k]
    x, middle = k * DISTANCE, (Z[0] + Z[-1]) / 2
    points, triangles = view.gear(TEETH[k], MODULE, FACE)
    shaft = view.cylinder((x, 0, Z[0] - 0.06), (x, 0, Z[-1] + 0.06), diameter)
    rings = [view.ring((x, 0, z - length / 2), (x, 0, z + length / 2), diameter, 1.7 * diameter)
             for z in (Z[0], Z[-1])]  # fmt: skip
    return (points + np.array([x, 0, middle]), triangles), shaft, view.joined(rings)


(pinion, slow), shafts, bushes = zip(*map(wheel, (0, 1)), strict=True)
machine = view.Scene(
    "Pinion and gear on four oil films",
    {"pinion": pinion, "gear": slow, "shafts": view.joined(shafts), "bushes": view.joined(bushes)},
    view=(-0.5, 0.4, 1.0), up=(0, 1, 0),
)  # fmt: skip
turn = np.linspace(0, 2 * np.pi, 100)


def journey(name, films, mirror, clearance):
    """Where a journal rests under each torque."""
    x, y = np.transpose([film.motion[:2] for film in films]) / clearance
    return view.Panel(
        f"Journals of the {name}", "x / clearance", "y / clearance",
        {"_clearance": (np.cos(turn), np.sin(turn)), "_path": (x, mirror * y)},
        points={"_rest": (x, mirror * y)}, equal=True,
        notes={f"{torques[k]}": (x[k], mirror * (y[k] + 0.09 * (k == 0))) for k in (0, 2, 6)},
    )  # fmt: skip


loci = [
    journey("pinion", [r.forces.films[0] for r in rests], 1, C),
    journey("gear", [r.forces.films[2] for r in rests], -1, BUSHES[1][2]),
]
theta = np.arange(-60, 60) * 3.0
around = {name: (theta, np.roll(f.pressure[:, 6], 60) / 1e6) for name, f in inlets.items()}
view.panels(
    [[machine, *loci],
     [view.Panel("Pressure around a bush with one groove", "angle from the load [deg]",
                 "pressure [MPa]", around),
      view.Panel("Transmission error, spur gears, 300 N m", "speed of the pinion [1/min]",
                 "root mean square [\u00b5m]", curves)]],
    options.out / "transmission.png",
    title="Geared shafts on oil films",
    caption="A pinion of 26 teeth drives a gear of 157; both shafts turn in plain bearings with 50 "
    "and 80 micrometres of clearance, ISO VG 46 at 60 degrees Celsius. Top right: where the "
    "journals rest when the torque of the pinion grows from 25 to 500 N m, at 3000 turns a minute; "
    "numbers are that torque in N m, the circle is the clearance. They travel farther than the "
    "teeth bend. Below, left: pressure in the middle of a bearing of the pinion at 200 N m, its "
    "oil from one groove: fed from behind the load, the film begins late and has to press harder. "
    "Right: what the teeth excite, linear about the equilibrium of each speed; it peaks where a "
    "multiple of the mesh frequency meets a natural one. Relief is 10 micrometres deep and 7 mm "
    "long. Parameters are for illustration.",
)  # fmt: skip
highest = max(np.nanmax(values) for _, values in fields.values())
drawings = [
    view.Drawing(f"Teeth {name}", "along the path of contact [mm]", "across the face [mm]",
                 extent=(1e3 * p.path[0], 1e3 * p.path[1], -20, 20), shade=values,
                 label="load [N/mm]", limits=(0.0, highest), equal=False)
    for name, (p, values) in fields.items()
]  # fmt: skip
view.plane(
    drawings, options.out / "transmission_fields.png", title="Load on the teeth",
    caption="Force per length of contact line on the base plane of helical gears, 12.5 degrees, at "
    "500 N m on the pinion, swept through a mesh period. Left: shafts and films tilt, and one end "
    "of the face carries more. Right: crowning takes the load off both ends.",
)  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.

x, y = straight.motion[:2]
relieved, plain = (curves[name][1] for name in ("60 \u00b0C, tips relieved",
                                                "oil of 40 \u00b0C"))  # fmt: skip
results = {
    "eccentricity at 200 N m, by another program": (straight.eccentricity, 0.7328, 0.003),
    "attitude there, by another program [degrees]": (np.degrees(np.arctan2(y, x)), 35.35, 0.01),
    "torque of gear over pinion": (rests[3].unit.torque / rests[3].input_torque, 157 / 26, 0.01),
    "power, 1 + what is missing": (1 + balance, 1.0, 1e-6),
    "ISO 6336, mesh stiffness [N/mm/um]": (
        iso_stiffness(GearPair(TEETH, MODULE, FACE))[2] / 1e9, 22.30, 1e-3),
    "speeds at which relief more than halves the error": (
        np.sum(relieved < 0.5 * plain), speeds.size, 1e-9),
}  # fmt: skip
for name, (value, expected, tolerance) in results.items():
    print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
