# # What oil films do to the load on teeth
#
# After Fargere and Velex: a pinion drives a gear, both on films that conserve their oil and warm
# it, in a housing that is meshed with gmsh and reduced. Where oil comes in, how warm it is and how
# wide the clearance is decides where journals rest, and how hard teeth strike through the speeds.
# Parameters are for illustration.
#
# Run: `python demos/demo_oil_inlet.py`
# Time: 3 min
# Writes: `oil_inlet.png`, `oil_inlet_static.png`, `oil_inlet.gif` into `out/`; another folder with
# `--out`

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

from mpi4py import MPI

import numpy as np

import rom
from rom import view
from rom.components.gear_mesh import Correction, GearPair, Mesh, stiffness_table
from rom.components.journal_bearing import Groove, JournalBearing, iso_vg
from rom.components.transmission import Disc, Housing, Rotor, Transmission, rest, steady

options = argparse.ArgumentParser(description="oil inlets, oil and clearance, and tooth load")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
first = MPI.COMM_WORLD.rank == 0
say = print if first and not options.quiet else lambda *_: None

# ## The unit
#
# 26 teeth of module 4 mm drive 47, 40 mm wide, with relief on the tips; stiff shafts in bearings of
# 50 mm, 60 mm before the wheels and 140 mm behind them. The oil of each film comes from one groove,
# at an angle from its load in the sense in which the journal turns, and each film has the
# temperature that it keeps up itself.

TEETH, MODULE, FACE, TORQUE, BORE = (26, 47), 4e-3, 0.04, 200.0, 0.05
SEATS = {"near": -0.06, "far": 0.14}  # along the shafts, from the wheels
LOOSE = GearPair(TEETH, MODULE, FACE)
PAIR = replace(LOOSE, centre_distance=LOOSE.distance + 1e-4)
RELIEF = Correction((1e-5, 1e-5), (5e-3, 5e-3), power=2.0)
TABLE = stiffness_table(PAIR, force=TORQUE / PAIR.rb[0] / FACE)
LOAD = np.pi / 2 - PAIR.alpha  # direction of the force on the gear, from the line of centres
OIL, Z, DRIVE, LOSS, THRUST = iso_vg(46), np.array([0, 0, 1.0]), 1e5, 4e-6, 1e8

# ## The housing: geometry, matrices, reduction
#
# Grey iron, open at the top, on four feet that are held; the films fill the bores of its seats. In
# its own axes shafts lie along y.

HEIGHT, LONG = 0.115, 0.025  # of the shafts above the bottom, and length of the seats
SIDES = {"near": "back", "far": "front"}
AXES = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # rows: those of the unit in those of the box
box = {"L": 0.4, "W": SEATS["far"] - SEATS["near"] + LONG, "a": PAIR.distance, "z_s": HEIGHT,
       "d_1": BORE, "d_2": BORE, "l_s": LONG, "lc": 0.026}  # fmt: skip
housing_model = rom.fe.model(Path(__file__).parents[1] / "meshes" / "housing.geo", parameters=box,
                             material=rom.Material(E=120e9, nu=0.26, rho=7200.0))  # fmt: skip
SHAFTS = {"pinion": "input", "gear": "output"}
seats = {f"{shaft}_{side}": "rbe3" for shaft in SHAFTS.values() for side in SIDES.values()}
housing = rom.reduce(housing_model, method=rom.CraigBampton(4), reference="feet", certify=False,
                     interfaces=seats | {"feet": "rbe2"},
                     damping=rom.Rayleigh(beta=LOSS))  # fmt: skip
PLACE = (PAIR.distance / 2, -HEIGHT, sum(SEATS.values()) / 2)  # of its origin
say(f"housing: {housing.mass:.1f} kg, {housing_model.n_dofs} dofs, {housing.n_modes} coordinates")


@dataclass(frozen=True)
class Films:
    """Place of the groove from the load [deg], temperature of the inlet [C] and clearance [m].

    And whether the housing gives way.
    """

    groove: float = 180.0
    inlet: float = 60.0
    clearance: float = 5e-5
    law: str = "jfo"
    rigid: bool = False

    def bearing(self, load):
        """A bearing whose load points in that direction."""
        groove = Groove(load + np.radians(self.groove), np.radians(20))
        return JournalBearing(BORE, LONG, self.clearance, [groove], self.law, cells=(60, 4))


def body(teeth):
    """Mass, inertia across and about the axis of a shaft with its wheel."""
    wheel = Disc.of_ring(1, outer=teeth * MODULE, inner=BORE, width=FACE)
    length = 0.3
    m = 7850 * np.pi / 4 * BORE**2 * length
    return (wheel.mass + m, wheel.diametral + m * (BORE**2 / 16 + length**2 / 12),
            wheel.polar + m * BORE**2 / 8)  # fmt: skip


def unit(speed, films, *, oil=OIL, inlet=None):
    """The mechanism at a speed of the pinion [rad/s]."""
    mech = rom.Mechanism(gravity=(0, -9.81, 0))
    spins, loads = (speed, -speed * TEETH[0] / TEETH[1]), (LOAD + np.pi, -LOAD)
    for k, (name, teeth) in enumerate(zip(SHAFTS, TEETH, strict=True)):
        mass, across, about = body(teeth)
        mech.add_rigid(
            name, mass=mass, inertia=(across, across, about), at=(k * PAIR.distance, 0, 0),
            markers={"middle": (0, 0, 0)} | {end: (0, 0, z) for end, z in SEATS.items()},
            spin=spins[k] * Z,
        )  # fmt: skip
    case = mech.add_flexible("housing", housing, at=PLACE, orientation=AXES)
    feet = case.marker("feet")
    mech.fixed("feet", mech.ground.marker(mech.design_point(feet)), feet)
    for k, (name, shaft) in enumerate(SHAFTS.items()):
        part, x = mech.part(name), k * PAIR.distance
        for end, side in SIDES.items():
            seat = case.marker(f"{shaft}_{side}")
            bush = mech.ground.marker(mech.design_point(seat)) if films.rigid else seat
            mech.journal_bearing(f"{name} {end}", part.marker(end), bush, axis=(1 - 2 * k) * Z,
                                 reference=(1, 0, 0), bearing=films.bearing(loads[k]), oil=oil,
                                 inlet=inlet)  # fmt: skip
        turn = DRIVE if name == "pinion" else 0.0
        ground = mech.ground.marker((x, 0, SEATS["near"]))
        mech.bushing(f"end of {name}", ground, part.marker("near"),
                     stiffness=(0, 0, THRUST, 0, 0, turn),
                     damping=(0, 0, LOSS * THRUST, 0, 0, LOSS * turn))  # fmt: skip
    pinion, gear = (mech.part(name) for name in ("pinion", "gear"))
    mech.gear_mesh("teeth", pinion.marker("middle"), gear.marker("middle"), axis=Z,
                   pair=PAIR, stiffness=TABLE, correction=RELIEF, damping=2e-6,
                   cells=11)  # fmt: skip
    mech.torque("load", gear.marker("near"), TORQUE * TEETH[1] / TEETH[0] * Z)
    return mech


# ## Teeth in time
#
# Simulated until the mesh repeats; the load factor is the largest over the mean force. At rest,
# tilted shafts press harder on one end of the face.

PERIODS, KEPT, STEPS, STRIPS = 14, 4, 80, 11
SHOWN = slice(-STEPS - 1, -1, 4)  # a mesh period of each run


@dataclass(frozen=True)
class Run:
    """What was found at a speed."""

    still: object
    F: object  # between the teeth, through the last mesh periods [N]
    t: object  # of what is shown [s]
    loads: list  # on the teeth then

    @property
    def load_factor(self):
        return self.F.max() / self.F.mean()

    @property
    def face_factor(self):
        return rom.mbs.tooth_loads(self.still, "teeth")[0].across_face(FACE, STRIPS).max()

    def journal(self, name):
        """(2,) where it rests, in the axes of the world [m]."""
        x, y = self.still.journal_bearing(name).motion[0, :2]
        return np.array([x, y if name.startswith("pinion") else -y])

    @property
    def apart(self):
        """How much farther apart the wheels stand than the bushes do [m]."""
        return (self.still.q[0, 7] - self.still.q[0, 0]) - PAIR.distance


def run(speed, films, start=None, **oil):
    """The unit at rest, and through some mesh periods, after a run at another speed."""
    mech = unit(speed, films, **(oil or {"inlet": films.inlet}))
    period = 2 * np.pi / (speed * TEETH[0])
    at_rest = rom.equilibrium(mech, state=start.still.final if start else None)
    motion = rom.simulate(mech, state=at_rest, t_end=PERIODS * period, dt=period / STEPS,
                          rho_inf=0.6)  # fmt: skip
    loads = rom.mbs.tooth_loads(motion, "teeth")
    F = np.array([x.force.sum() for x in loads[-KEPT * STEPS :]])
    return Run(rom.mbs.snapshot(mech, at_rest), F, motion.t[SHOWN] - motion.t[SHOWN][0],
               loads[SHOWN])  # fmt: skip


CASES = {
    "place of the groove": {"90\u00b0 before the load": Films(groove=-90), "opposite": Films(),
               "90\u00b0 behind the load": Films(groove=90)},
    "oil at the inlet": {f"{T:g} \u00b0C": Films(inlet=T) for T in (40.0, 60.0, 80.0)},
    "clearance": {f"{1e6 * c:.0f} \u00b5m": Films(clearance=c) for c in (3e-5, 5e-5, 1e-4)},
    "housing": {"gives way": Films(), "rigid": Films(rigid=True)},
}  # fmt: skip
RPM = np.array([*range(1000, 4000, 500), *range(4000, 5500, 250), 5500, 6000])
MIDDLE = 4  # 3000 of them
runs = {}
for films in dict.fromkeys(films for case in CASES.values() for films in case.values()):
    found = runs[films] = []
    for w in RPM * np.pi / 30:
        found.append(run(w, films, found[-1] if found else None))
    there = found[MIDDLE]
    warm = there.still.journal_bearing("pinion near").temperature[0]
    say(f"groove {films.groove:+4.0f} deg, oil {films.inlet:g} C, {1e6 * films.clearance:.0f} "
        f"micrometres{', rigid housing' if films.rigid else ''}: at 3000 turns a minute "
        f"{warm:.1f} C, {1e6 * there.apart:+.1f} micrometres farther apart, load across the face "
        f"{there.face_factor:.3f}; in motion {there.load_factor:.3f}, at most "
        f"{max(x.load_factor for x in found):.3f}")  # fmt: skip

# ## The other program
#
# `rom.components.transmission` has such units ready, of shafts that only move a little in axes that
# do not spin. It finds the motion that repeats; its films have one viscosity, and no memory.


@dataclass(frozen=True)
class Stiff:
    """A shaft that does not bend, as that program wants it: nodes are seats and wheel."""

    size: tuple  # mass, inertia across and about
    places: tuple = (SEATS["near"], 0.0, SEATS["far"])
    nodes: int = 3
    n: int = 6

    def rows(self, node):
        found, z = np.eye(6), self.places[node]
        found[0, 4], found[1, 3] = z, -z
        return found

    def rigid(self):
        return np.eye(6)

    def matrices(self):
        m, across, about = self.size
        G = np.zeros((6, 6))
        G[3, 4], G[4, 3] = about, -about
        return np.diag([m, m, m, across, across, about]), np.zeros((6, 6)), G


def other(speed, films):
    """The same unit there."""
    rotors, nodes = [], {0: SIDES["near"], 2: SIDES["far"]}
    bushes = {name: {node: f"{shaft}_{side}" for node, side in nodes.items()}
              for name, shaft in SHAFTS.items()}  # fmt: skip
    case = Housing.of_body(housing, **bushes, fixed=("feet",), axes=AXES)
    for teeth, load in zip(TEETH, (LOAD + np.pi, -LOAD), strict=True):
        seat = films.bearing(load)
        rotors.append(Rotor(Stiff(body(teeth)), 1, {0: seat, 2: seat}))
    mesh = Mesh(PAIR, TABLE, RELIEF, damping=2e-6, cells=11)
    return Transmission(*rotors, mesh, speed, TORQUE * TEETH[1] / TEETH[0], 0.02,
                        gravity=(0.0, -9.81), housing=case)  # fmt: skip


plain, apart = replace(Films(), law="reynolds"), []
for w in np.array([3000, 4000, 5000, 6000]) * np.pi / 30:
    here, stands = run(w, plain, oil=0.02), rest(other(w, plain))
    there = steady(stands, steps=STEPS)
    apart.append(here.load_factor / there.load_factor - 1)
    say(f"{30 * w / np.pi:.0f} turns a minute: load factor {here.load_factor:.4f}, "
        f"by the other program {there.load_factor:.4f}")  # fmt: skip

# ## Through a mesh period, at 3000 turns a minute


def error(films):
    """Share of the mesh period and error of transmission at rest about its mean [micrometres]."""
    w, place, found = RPM[MIDDLE] * np.pi / 30, np.arange(16) / 16, []
    mech, state = unit(w, films, inlet=films.inlet), runs[films][MIDDLE].still.final
    for share in place:
        state = rom.equilibrium(mech, state=state, t=share * 2 * np.pi / (w * TEETH[0]))
        pinion, gear = (2 * np.arctan2(state.q[7 * k + 6], state.q[7 * k + 3]) for k in (0, 1))
        found.append(1e6 * (PAIR.rb[0] * pinion + PAIR.rb[1] * gear))
    return place, np.array(found) - np.mean(found)


errors = {name: error(films) for name, films in CASES["clearance"].items()}

# ## The pictures

BASE = runs[Films()][MIDDLE]


def rolled(teeth):
    """Angle of half a tooth at the base circle and of half a pitch [rad]."""
    a = PAIR.pressure_angle
    return np.pi / (2 * teeth) + np.tan(a) - a + np.pi / teeth


def wheels(times):
    """{name: thing} of both shafts as they turn, (f,) times, flanks where contact is."""
    first = (-PAIR.alpha - rolled(TEETH[0]),
             np.pi - PAIR.alpha + PAIR.tangents / PAIR.rb[1] - rolled(TEETH[1]))  # fmt: skip
    colours = {"pinion": "#9aa5b1", "gear": "#2f7f9f"}
    for k, (name, colour) in enumerate(colours.items()):
        teeth = TEETH[k]
        spin = 2 * np.pi * RPM[MIDDLE] / 60 * (1 if k == 0 else -TEETH[0] / TEETH[1])
        ends = [(0, 0, SEATS["near"] - 0.03), (0, 0, SEATS["far"] + 0.03)]
        points, cells = view.joined([view.gear(teeth, MODULE, FACE), view.cylinder(*ends, BORE)])
        angle = first[k] + spin * times
        c, s, o, l = np.cos(angle), np.sin(angle), 0 * angle, 1 + 0 * angle
        R = np.array([[c, s, o], [-s, c, o], [o, o, l]]).transpose(2, 0, 1)
        yield name, view.Thing(points @ R + (k * PAIR.distance, 0, 0), cells, colour, opacity=0.4)


def walls(loads, lines=3):
    """Walls on the lines of contact as high as the load on them, one (k, 3) and its triangles."""
    s, c = np.sin(PAIR.alpha), np.cos(PAIR.alpha)
    n, start = np.array([s, c, 0]), PAIR.rb[0] * np.array([c, -s, 0])
    z = ((np.arange(STRIPS) + 0.5) / STRIPS - 0.5) * FACE
    found = []
    for place in [*np.unique(loads.place.round(8)), *[PAIR.path[0]] * lines][:lines]:
        use = abs(loads.place - place) < 1e-7
        height = np.zeros(STRIPS)
        strip = (STRIPS * (loads.height[use] / FACE + 0.5)).astype(int)
        height[strip] = loads.force[use] / loads.length[use]
        line = start + place * n + z[:, None] * [0, 0, 1]
        found.append((line, line + 1e-6 * height[:, None] * [0, 1, 0]))
    k = np.arange(STRIPS - 1)
    quads = np.vstack([np.column_stack([k, k + 1, k + STRIPS]),
                       np.column_stack([k + 1, k + STRIPS + 1, k + STRIPS])])  # fmt: skip
    return view.joined([(np.vstack(pair), quads) for pair in found])


def scene(title, times, loads):
    """The unit with its load on the teeth at some times."""
    case = view.meshed(housing_model)["_surface"]
    drawn = [walls(x) for x in loads]
    load = view.Thing(np.array([points for points, _ in drawn]), drawn[0][1], "#d1495b")
    return view.Scene(
        title,
        dict(wheels(times))
        | {"load on the teeth": load,
           "housing": view.Thing(PLACE + case.points @ AXES.T, case.cells, "#edae49", opacity=0.35,
                                 edges=np.zeros((0, 2), dtype=int))},
        view=(-0.6, 0.75, 0.9), up=(0, 1, 0),
    )  # fmt: skip


def against_speed(title, what, ylabel):
    """A diagram over the speed of each case."""
    return [
        view.Panel(title.format(name), "speed [1/min]", ylabel,
                   {label: (RPM, np.array([what(x) for x in runs[films]]))
                    for label, films in case.items()})
        for name, case in CASES.items()
    ]  # fmt: skip


def path(films):
    """Where the near journal of the pinion rests, from slow to fast, in clearances."""
    return tuple(np.transpose([x.journal("pinion near") for x in runs[films]]) / films.clearance)


arc = np.radians(np.linspace(-100, -65, 100))
ways = CASES["place of the groove"] | {
    x: CASES["clearance"][x] for x in ("30 \u00b5m", "100 \u00b5m")
}
paths = {label: path(films) for label, films in ways.items()}
if first:
    options.out.mkdir(parents=True, exist_ok=True)
    in_motion = against_speed("Load factor: {}", lambda x: x.load_factor, "largest / mean force")
    view.panels(
        [[scene("The unit at rest", np.zeros(1), rom.mbs.tooth_loads(BASE.still, "teeth")),
          view.Panel("Near journal of the pinion", "x / clearance", "y / clearance",
                     paths | {"_clearance": (np.cos(arc), np.sin(arc))}, equal=True,
                     points={f"_{k}": tuple(np.stack(list(paths.values()))[..., k].T)
                             for k in (0, -1)}),
          in_motion.pop()],
         in_motion],
        options.out / "oil_inlet.png", title="Oil films and the load on teeth",
        caption=f"A pinion of {TEETH[0]} teeth, {TORQUE:g} N m, drives a gear of {TEETH[1]}, in a "
        "housing of grey iron that is meshed and reduced; each bearing gets ISO VG 46 from one "
        "groove and warms it. What is not said otherwise: groove opposite to the load, 60 "
        "\u00b0C, 50 \u00b5m. Above, left, drawn as of glass: the wall is as high as the load on "
        "the line of contact. Middle: where a journal rests, from 1000 (low, near the bush) to "
        "6000 turns a minute; the grey arc is the clearance. Right and below: largest over mean "
        "force between the teeth in motion. It peaks where teeth pass as fast as wheels and "
        "housing vibrate, or at a part of that speed; a rigid housing has its peaks elsewhere. "
        "Inlet, oil and clearance change them by less than a tenth.",
    )  # fmt: skip
    faces = against_speed("Load across the face: {}", lambda x: x.face_factor, "largest / mean")[:3]
    view.panels(
        [faces,
         [view.Panel("Bushes and wheels", "speed [1/min]", "wheels farther apart [\u00b5m]",
                     {label: (RPM, np.array([1e6 * x.apart for x in runs[films]]))
                      for label, films in CASES["clearance"].items()}),
          view.Panel("Error of transmission", "share of the mesh period",
                     "about its mean [\u00b5m]", errors),
          view.Panel("Temperature of the film", "speed [1/min]", "pinion, near [\u00b0C]",
                     {label: (RPM, np.array([x.still.journal_bearing("pinion near").temperature[0]
                                             for x in runs[films]]))
                      for label, films in CASES["place of the groove"].items()})]],
        options.out / "oil_inlet_static.png", title="Tooth load at rest in the films",
        caption="The same units at rest. Above: the bearing that is nearer to the wheels carries "
        "more, its journal travels farther, and tilted shafts load one end of the faces: more "
        "where clearance is wide, and less with the groove behind the load, where the oil gets "
        "hot and both journals lie deep. Below, left: journals travel, and the wheels move apart. "
        "Middle: error of transmission through a mesh period at 3000 turns a minute, of several "
        "clearances. Right: a film that begins late has little oil to carry its heat off.",
    )  # fmt: skip
    view.film(BASE.t, scene("Load on the teeth", BASE.t, BASE.loads),
              options.out / "oil_inlet.gif", seconds=3.0,
              caption="A mesh period at 3000 turns a minute, wheels and housing as of glass: "
              "the wall on each line of contact is as high as its load.")  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.

films = {name: BASE.still.journal_bearing(name) for name in BASE.still.mechanism.journal_bearings}
carried = sum(BASE.still.element(name).force[0, 0, 1] for name in films)
drag = sum(films[f"gear {end}"].power[0] for end in SEATS) * TEETH[1] / TEETH[0]
drag /= RPM[MIDDLE] * np.pi / 30
hot = films["pinion near"]
rise = 0.9 * 0.5 * hot.power[0] / (OIL.density * OIL.heat * hot.side_flow[0])
theirs = stands.forces.films[2].motion[:2]  # of the gear, from the other end
results = {
    "journal of the gear, 1 + way to that of the other program / clearance": (
        1 + np.linalg.norm(here.journal("gear near") - theirs * (1, -1)) / 5e-5, 1.0, 2e-3),
    "load factor over that of the other program, worst": (1 + max(apart, key=abs), 1.0, 0.02),
    "films carry the shafts [N]": (carried, 9.81 * sum(body(z)[0] for z in TEETH), 1e-6),
    "mean force between the teeth [N]": (
        BASE.F.mean(), (TORQUE * TEETH[1] / TEETH[0] + drag) / PAIR.rb[1], 2e-3),
    "rise of the oil that leaves and half of it felt [K]": (hot.temperature[0] - 60.0, rise, 1e-6),
}  # fmt: skip
if first:
    for name, (value, expected, tolerance) in results.items():
        print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
