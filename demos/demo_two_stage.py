# # Two stages of gears on six oil films in a housing
#
# Three shafts and a housing, meshed with gmsh and reduced, as one mechanism: rims that deform under
# the teeth which travel around them, oil films between journals and seats that give way.
#
# Run: `python demos/demo_two_stage.py`
# Time: 40 s
# Writes: `two_stage.png` into `out/`; another folder with `--out`

import argparse
from pathlib import Path

from mpi4py import MPI

import numpy as np

import rom
from rom import view
from rom.components.gear_mesh import Correction, GearPair, stiffness_table
from rom.components.journal_bearing import Groove, JournalBearing

options = argparse.ArgumentParser(description="two stages of gears on oil films")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
first = MPI.COMM_WORLD.rank == 0
say = print if first and not options.quiet else lambda *_: None

# ## Geometry
#
# Shafts lie along y, side by side. 25 teeth drive 61, and on the same shaft 21 drive 54. Wheels are
# solid up to their root circles; their rims carry harmonics around times polynomials along
# the face.

MESHES = Path(__file__).parents[1] / "meshes"
STEEL = rom.Material(E=206e9, nu=0.3, rho=7850.0)
IRON = rom.Material(E=120e9, nu=0.26, rho=7200.0)
PAIRS = {
    "first stage": GearPair((25, 61), 3e-3, 0.03, centre_distance=0.13),
    "second stage": GearPair((21, 54), 4.5e-3, 0.045, centre_distance=0.17),
}
LENGTH, SEAT, HEIGHT, MIDDLE = 0.27, 0.03, 0.15, 0.135
PLACE = {"input": -0.15, "middle": -0.02, "output": 0.15}  # along x
DIAMETER = {"input": 0.04, "middle": 0.045, "output": 0.05}  # of shafts and journals
WHEELS = {  # teeth, module, width, place along the shaft
    "input": {"wheel": (25, 3e-3, 0.03, 0.105)},
    "middle": {"wheel": (61, 3e-3, 0.03, 0.105), "wheel_2": (21, 4.5e-3, 0.045, 0.17)},
    "output": {"wheel": (54, 4.5e-3, 0.045, 0.17)},
}
SIZES = {"input": 0.013, "middle": 0.018, "output": 0.02}  # of elements


def shaft(name, rim):
    """Reduced shaft with its wheels."""
    sizes = {"L": LENGTH, "z_a": 0.05, "z_b": 0.22, "l_j": SEAT, "d": DIAMETER[name],
             "lc": SIZES[name]}  # fmt: skip
    for wheel, (teeth, module, width, z) in WHEELS[name].items():
        end = "w" if wheel == "wheel" else "2"
        root = (teeth - 2.5) * module
        keys = ("D", "b") if end == "w" else ("D_2", "b_2")
        sizes |= {f"z_{end}": z} | dict(zip(keys, (root, width), strict=True))
    model = rom.fe.model(MESHES / "gear_shaft.geo", material=STEEL, parameters=sizes)
    rims = {wheel: rim for wheel in WHEELS[name]}
    seats = dict.fromkeys(("journal_a", "journal_b", "end_a"), "rbe3")
    return rom.reduce(model, method=rom.CraigBampton(4), interfaces=seats | rims,
                      reference="mean-axis", certify=False)  # fmt: skip


box = {"L": 0.6, "W": 0.2, "H": 0.28, "a": 0.13, "a_2": 0.17, "z_s": HEIGHT, "l_s": SEAT,
       "d_1": DIAMETER["input"], "d_m": DIAMETER["middle"], "d_2": DIAMETER["output"],
       "lc": 0.024}  # fmt: skip
housing_model = rom.fe.model(MESHES / "housing.geo", material=IRON, parameters=box)
seats = {f"{name}_{side}": "rbe3" for name in PLACE for side in ("front", "back")}
housing = rom.reduce(housing_model, method=rom.CraigBampton(6), interfaces=seats | {"feet": "rbe2"},
                     reference="feet", certify=False)  # fmt: skip
bodies = {name: shaft(name, rom.FourierLegendre(1, 2)) for name in PLACE}
for name, body in bodies.items():
    say(f"{name} shaft: {body.mass:.2f} kg, {body.n_modes} coordinates")

# ## The machine
#
# At 3000 turns a minute with 40 N m on the input shaft. An elastic coupling drives; a constant
# torque brakes the output shaft. Frames of the shafts stand still, the material spins in them.

SPEED, TORQUE, COUPLING, G, OIL = 100 * np.pi, 40.0, 3e3, 9.81, 0.02
Y, ALONG_Y = np.array([0, 1.0, 0]), np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
RATIOS = np.array([1.0, -25 / 61, 25 * 21 / (61 * 54)])
SPINS = dict(zip(PLACE, SPEED * RATIOS, strict=True))
BUSHES = {
    name: JournalBearing(d, SEAT, 0.6e-3 * d, [Groove(0, 0.35), Groove(np.pi, 0.35)], cells=(60, 4))
    for name, d in DIAMETER.items()
}
FILMS = {f"{name} {side}": name for name in PLACE for side in ("front", "back")}


def machine(bodies):
    """The mechanism."""
    mech = rom.Mechanism(gravity=(0, 0, -G))
    case = mech.add_flexible("housing", housing)
    mech.fixed("feet", mech.ground.marker(housing.markers["feet"].point), case.marker("feet"))
    for name, body in bodies.items():
        part = mech.add_flexible(name, body, at=(PLACE[name], -MIDDLE, HEIGHT),
                                 orientation=ALONG_Y, spin=(0, 0, SPINS[name]))  # fmt: skip
        for journal, side in (("journal_a", "front"), ("journal_b", "back")):
            mech.journal_bearing(f"{name} {side}", part.marker(journal),
                                 case.marker(f"{name}_{side}"), axis=np.sign(SPINS[name]) * Y,
                                 reference=(1, 0, 0), bearing=BUSHES[name], oil=OIL)  # fmt: skip
        drive = COUPLING if name == "input" else 0.0
        end = part.marker("end_a")
        mech.bushing(f"end of {name}", mech.ground.marker(mech.design_point(end)), end,
                     stiffness=(0, 1e8, 0, 0, drive, 0),
                     damping=(0, 1e3, 0, 0, 1e-4 * drive, 0))  # fmt: skip
    ends = (("input", "wheel", "middle", "wheel", Y), ("middle", "wheel_2", "output", "wheel", -Y))
    for (stage, pair), (a, wheel, b, gear, axis), force in zip(
        PAIRS.items(), ends, (4e4, 5e4), strict=True
    ):
        relief = Correction((6e-6, 6e-6), (0.6 * pair.module, 0.6 * pair.module), power=2.0)
        mech.gear_mesh(stage, mech.part(a).marker(wheel), mech.part(b).marker(gear), axis=axis,
                       pair=pair, stiffness=stiffness_table(pair, force=force), damping=2e-6,
                       correction=relief, cells=12)  # fmt: skip
    mech.torque("load", mech.part("output").marker("end_a"), -TORQUE / RATIOS[2] * Y)
    return mech


mech = machine(bodies)
at_rest = rom.equilibrium(mech)
still = rom.mbs.snapshot(mech, at_rest)
films = {name: still.journal_bearing(name) for name in FILMS}
for name, x in films.items():
    ratio = np.hypot(*x.motion[0, :2]) / BUSHES[FILMS[name]].clearance
    say(f"film {name:12}: eccentricity {ratio:.3f}, thinnest {1e6 * x.thinnest[0]:4.1f} micrometres"
        f", {x.pressure[0] / 1e6:.2f} MPa, {x.power[0]:.1f} W")  # fmt: skip
teeth = {stage: rom.mbs.tooth_loads(still, stage)[0] for stage in PAIRS}
vibration = rom.linearize(mech, at_rest)
swings = vibration.frequencies[vibration.frequencies > 1.0]
say(f"stable: {vibration.stable}; {', '.join(f'{f:.1f}' for f in swings[:12])} ... Hz")

# ## More functions on the rim, and none
#
# The pinion of the first stage once more, with more functions of its rim, and with a rim that stays
# round and straight under the teeth.


def across(loads, stage):
    """Places along the shafts [mm] and load on them over its mean."""
    pair, n = PAIRS[stage], 12
    even = np.mean([x.across_face(pair.width, n) for x in loads], axis=0)
    y = 1e3 * pair.width * ((np.arange(n) + 0.5) / n - 0.5)
    return (y, even) if stage == "first stage" else (y, even[::-1])


def pinion(rim):
    """Load across the face of the first stage with another rim of its pinion."""
    other = machine(bodies | {"input": shaft("input", rim)})
    at_rest = rom.mbs.snapshot(other, rom.equilibrium(other))
    return across(rom.mbs.tooth_loads(at_rest, "first stage"), "first stage")


faces = {stage: across([x], stage) for stage, x in teeth.items()}
finer, stiff = pinion(rom.FourierLegendre(2, 3)), pinion("rbe3")
say("largest load over its mean, first stage: "
    f"{faces['first stage'][1].max():.4f}, with more functions {finer[1].max():.4f}, with none "
    f"{stiff[1].max():.4f}")  # fmt: skip

# ## Through some mesh periods

period = 2 * np.pi / (SPEED * 25)
motion = rom.simulate(mech, state=at_rest, t_end=12 * period, dt=period / 32,
                      progress=first and not options.quiet)  # fmt: skip
moving = {stage: rom.mbs.tooth_loads(motion, stage) for stage in PAIRS}
loads = {stage: np.array([x.force.sum() for x in found]) for stage, found in moving.items()}
late = motion.t > 4 * period
for stage, F in loads.items():
    ratio = F[late].max() / F[late].mean()
    say(f"{stage}: mean {F[late].mean():.0f} N, largest over mean {ratio:.2f}")
say(rom.audit(motion))

# All shafts on the coupling, by hand.
inertia = sum(bodies[name].inertia[2, 2] * x**2 for name, x in zip(PLACE, RATIOS, strict=True))
twist = np.pi * 0.04**4 / 32 * STEEL.E / (2 * (1 + STEEL.nu)) / 0.09  # from end to wheel
coupled = np.sqrt(1 / (1 / COUPLING + 1 / twist) / inertia) / (2 * np.pi)

# ## The pictures

if first:
    options.out.mkdir(parents=True, exist_ok=True)
    walls = [view.tooth_walls(still, stage, scale=3e-6, direction=(0, 0, 1)) for stage in PAIRS]
    oil = [view.film_wall(still, f"{name} {side}", scale=0.018e-6, gap=0.002,
                          shift=out * np.sign(SPINS[name]))
           for name in PLACE for side, out in (("front", -0.016), ("back", 0.016))]  # fmt: skip
    case = view.meshed(housing_model)["_surface"]
    things = {
        **{f"{name} shaft": view.toothed_shaft(mech, name) for name in PLACE},
        "housing": view.Thing(
            case.points, case.cells, "#c9d1da", opacity=0.35, edges=np.zeros((0, 2), dtype=int)
        ),
        "load on the teeth": view.Thing(*view.joined(walls), "#edae49"),
        "oil pressure": view.Thing(*view.joined(oil), "#66a182"),
    }
    scene = view.Scene("The machine at rest in its films", things, view=(0.55, -0.8, 0.5),
                       up=(0, 0, 1))  # fmt: skip
    turn = np.linspace(0, 2 * np.pi, 100)
    place = [x.motion[0, :2] / BUSHES[FILMS[name]].clearance * (1, -np.sign(SPINS[FILMS[name]]))
             for name, x in films.items()]  # fmt: skip
    journals = view.Panel(
        "Journals in their bushes", "x / clearance", "z / clearance",
        {"_clearance": (np.cos(turn), np.sin(turn))},
        points={f"{name} shaft": tuple(np.transpose(place[2 * k : 2 * k + 2]))
                for k, name in enumerate(PLACE)}, equal=True,
    )  # fmt: skip
    some = motion.t > 8 * period
    ms = 1e3 * (motion.t[some] - motion.t[some][0])
    low = (vibration.frequencies > 1.0) & (vibration.frequencies < 700.0)
    modes = vibration.frequencies[low], vibration.damping_ratios[low]
    named = {name: tuple(x[np.argmin(abs(modes[0] - f))] for x in modes)
             for name, f in (("half-speed whirl", 25.0), ("coupling", coupled))}  # fmt: skip
    highest = max(x.pressure[0] for x in films.values()) / 1e6
    strongest = max((x.force / x.length).max() for x in teeth.values()) / 1e3
    view.panels(
        [[scene, journals,
          view.Panel("Natural vibrations", "frequency [Hz]", "damping / critical",
                     points={"_modes": modes}, notes=named)],
         [view.Panel("Load across the face", "along the shafts [mm]", "load / mean",
                     {stage: across([x for x, y in zip(found, late, strict=True) if y], stage)
                      for stage, found in moving.items()}),
          view.Panel("Force between the teeth", "time [ms]", "force [kN]",
                     {stage: (ms, 1e-3 * F[some]) for stage, F in loads.items()})]],
        options.out / "two_stage.png", title="Two stages of gears on six oil films",
        caption="Three solid shafts and a housing, meshed and reduced, at 3000 turns a minute with "
        f"{TORQUE:g} N m on the input shaft. Above, left, the housing drawn as of glass: walls on "
        f"the lines of contact are as high as the load on the teeth, up to {strongest:.0f} N/mm, "
        "those around the journals as the pressure of the oil, up to "
        f"{highest:.1f} MPa. Middle: where both journals of each shaft rest; the circle is the "
        "clearance. Right: journals that bear little whirl at half the speed of their shaft, 25 "
        "Hz, but damped. Below, left: mean over time of the load across the faces; shafts, films "
        "and housing give way, and one end carries more. Right: tips are relieved, and teeth "
        "still shake each other.",
    )  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.

carried = sum(still.element(name).force[0, 0, 2] for name in FILMS)
heat = {name: x.power[0] for name, x in films.items()}
given = abs(still.element("end of input").moment[0, 1, 1]) * SPEED
one, two = PAIRS.values()
F, P = (teeth[stage].force.sum() for stage in PAIRS)
drag = (heat["middle front"] + heat["middle back"]) / abs(SPINS["middle"])
f = vibration.frequencies
half = f[np.argsort(abs(f - 25.0))[:2]]
results = {
    "films carry the shafts [N]": (carried, G * sum(body.mass for body in bodies.values()), 1e-6),
    "power of load and films over that of the drive": (
        (TORQUE * SPEED + sum(heat.values())) / given, 1.0, 1e-3),
    "moments of both stages and oil on the middle shaft": (
        (P * two.rb[0] + drag) / (F * one.rb[1]), 1.0, 1e-3),
    "all shafts on the coupling [Hz], by hand": (f[np.argmin(abs(f - coupled))], coupled, 0.03),
    "whirl of the input shaft over its speed": (half.mean() / 50.0, 0.5, 0.06),
    "face load of the first stage, more functions": (faces["first stage"][1].max(),
                                                     finer[1].max(), 0.01),
}  # fmt: skip
if first:
    for name, (value, expected, tolerance) in results.items():
        print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
