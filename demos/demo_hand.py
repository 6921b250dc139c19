# # A light hand: joints of springs, closed by cables
#
# Every joint of this hand is a compression spring; a cable on the palm side bends three of them at
# once. A spring under a cable is pressed together and bent far, which no small-deflection formula
# covers, but a short rod with the four rigidities of the spring does. Two signals of muscles close
# it in time around a bar and a ball, which it holds by friction. The hand is ours, after an idea of
# Potratz, Yang, Abdel-Malek, Pena Pitarch and Grosland.
#
# Run: `python demos/demo_hand.py`
# Time: 3 min
# Writes: three pictures, `hand.png`, `hand_control.png` and `hand_grasp.png`, and the film
# `hand_grasp.gif` into `out/`; another folder with `--out`

import argparse
from dataclasses import replace
from pathlib import Path

from mpi4py import MPI

import numpy as np

import rom
from rom import view
from rom.components.cosserat import HelicalSpring
from rom.components.hand import (
    GROUPS,
    HAND_SPRING,
    INDEX_LENGTHS,
    SEATS,
    Chart,
    Finger,
    Held,
    close,
    contact_forces,
    deflections,
    envelope,
    grip,
    hand,
    hold,
    mass_budget,
    motor_force,
    moving_hand,
    muscle,
    parts_of_compliance,
    rest,
    shaft,
    shaft_moment,
    solid_finger,
    stress_budget,
    table,
    tip_compliance,
    winches,
)
from rom.view import Panel

options = argparse.ArgumentParser(description="fingers of springs, their stiffness and command")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
finite_elements = rom.fe.model  # PETSc starts here, on all processes together
if MPI.COMM_WORLD.rank > 0:
    raise SystemExit  # this is work for one process
options.out.mkdir(parents=True, exist_ok=True)
say = (lambda *_: None) if options.quiet else print
MM, MN, THICK = 1e-3, 1e-3, 5e-3  # half the thickness of a finger

# ## A finger closes

finger = Finger(n=12)
postures = [rest(finger)]
for tension in (0.5, 1.0, 1.5, 2.0, 2.5, 3.5):
    postures.append(close(finger, tension=tension, start=postures[-1]))


def built(posture, aside, side=1):
    """Phalanges, springs and cable of a finger, moved aside (3,); on the thumb's side if -1."""
    one, x = posture.finger, posture.shape.x
    links = [view.cylinder(x[t], x[t + 1], 2 * THICK) for *_, t, _ in one.joints]
    wires = [view.wound(x[b : t + 1], spring.diameter, spring.wire, turns=spring.coils)
             for spring, (b, _, t, _) in zip(one.springs, one.joints, strict=True)]  # fmt: skip
    cable = view.tube(one.tendon.points(posture.shape), 1.2 * MM)
    placed = [(p * (side, 1, 1) + np.array(aside), cells)
              for p, cells in (view.joined(links), view.joined(wires), cable)]  # fmt: skip
    return {"phalanges": placed[0], "springs": placed[1], "cable": placed[2]}


def fingers_as_things(kept):
    """{name: solids} of several fingers as one thing of each kind."""
    colours = {"phalanges": "#c3c9d0", "springs": "#2f7f9f", "cable": "#d1495b"}
    return {kind: view.Thing(*view.joined([parts[kind] for parts in kept]), colour)
            for kind, colour in colours.items()}  # fmt: skip


closing = view.Scene(
    "Index finger under {:g} and {:g} N, below {:g} and {:g} N".format(
        *(p.tension for p in postures[::2])),
    fingers_as_things([built(p, (65 * MM * (k % 2), 0, -80 * MM * (k // 2)))
                       for k, p in enumerate(postures[::2])]),
    view=(0.2, -1.0, 0.25), up=(0, 0, 1),
)  # fmt: skip


def loop(friction):
    """Tension over pull, drawn in and let out."""
    one, posture, path = Finger(n=8, friction=friction), rest(Finger(n=8)), []
    posture = replace(posture, finger=one)
    for way, pulls in ((1.0, np.linspace(0.5, 12, 24)), (-1.0, np.linspace(11.9, 1, 23))):
        for pull in pulls:
            posture = close(one, pull=pull * MM, start=posture, way=way)
            path.append((pull, posture.tension))
    return tuple(np.array(path).T)


# ## How stiff is the fingertip, and what does compression do to a spring?
#
# The finger as a mechanism, a force on its tip in three directions, with and without stiffeners
# that keep joints from bending sideways and from twisting.

forces = np.linspace(-100, 100, 9)
stiff = replace(finger, n=4, stiffener=10.0)
soft = replace(stiff, stiffener=1.0)
kinds = {"cable slack": (soft, 0.0), "cable 1 N": (soft, 1.0),
         "cable 1 N, stiffeners": (stiff, 1.0)}  # fmt: skip
directions = ("towards the palm", "sideways", "along the finger")
gives = [
    Panel(f"Fingertip {where}", "force [mN]", "deflection [mm]",
          {name: (forces, deflections(one, e, forces * MN, tension=T)[:, axis] / MM)
           for name, (one, T) in kinds.items()})
    for axis, (where, e) in enumerate(zip(directions, np.eye(3), strict=True))
]  # fmt: skip
C = rest(finger).tip_compliance()

column = HelicalSpring(MM, 10 * MM, 8, 40 * MM)
sturdy = replace(column, length=24 * MM)
share = np.linspace(0.0, 0.4, 81)
within = share < column.critical_compression(1.0)
columns = {"40 mm long": (100 * share[within], column.lateral_stiffness(share[within])),
           "24 mm long": (100 * share, sturdy.lateral_stiffness(share))}  # fmt: skip

# ## May phalanges be rigid?
#
# Bones of polyamide with round edges and a bore for the cable: drawn in gmsh, assembled with
# dolfinx and reduced to their end plates, they take the place of rigid phalanges between the same
# springs. What they add to the compliance of the tip says whether the moving hand below may leave
# them rigid.

polyamide = rom.Material(E=1.7e9, nu=0.4, rho=1010.0)
BONE = Path(__file__).parents[1] / "meshes" / "phalanx.geo"
solids = [finite_elements(BONE, degree=2, material=polyamide, parameters={"L": link},
                          comm=MPI.COMM_SELF) for link in INDEX_LENGTHS]  # fmt: skip
bones = [rom.reduce(solid, interfaces={"proximal": "rbe2", "distal": "rbe2"}, certify=False,
                    method=rom.CraigBampton(n_modes=3)) for solid in solids]  # fmt: skip
springs = (HAND_SPRING,) * 3
boned = solid_finger(bones, springs)
whole = tip_compliance(boned, boned.part("phalanx 3").marker("distal"))
joints, links = parts_of_compliance(bones, springs)
bone_share = 100 * (whole - joints)[0, 0] / whole[0, 0]
say(f"compliance of the tip in flexion that is in the bones: {bone_share:.4f} %")


def as_beams():
    """The same share of beams after Timoshenko, thinner at their round edges [%]."""
    D, R, E, G, shear = 14 * MM, 1.25 * MM, 1.7e9, 1.7e9 / 2.8, 8.4 / 9.4
    x = (np.arange(2000) + 0.5) / 2000
    beyond = total = 0.0
    for link in reversed(INDEX_LENGTHS):
        from_end = np.minimum(np.minimum(x, 1 - x) * link, R)
        r = D / 2 - R + np.sqrt(R**2 - (R - from_end) ** 2)
        bends = (beyond + link * (1 - x)) ** 2 / (E * np.pi / 4 * r**4)
        total += link * (bends + 1 / (shear * G * np.pi * r**2)).mean()
        beyond += link + HAND_SPRING.length
    return 100 * total / (joints[0, 0] + total)


drawn = {f"friction {mu:g}": loop(mu) for mu in (0.2, 0.0)}
view.panels(
    [[closing,
      Panel("Cable drawn in and let out", "pull [mm]", "tension [N]", curves=drawn),
      Panel("Sideways stiffness of a spring", "compression [%]", "stiffness [N/m]",
            curves=columns)],
     gives],
    options.out / "hand.png",
    title="Fingers whose joints are springs",
    caption="Phalanges are 10 mm thick. Top: beyond 2.65 N coils touch on the palm side; friction "
    "of the cable opens a loop; a long spring loses its sideways stiffness under compression and "
    "buckles at 20 %. Below: the index finger with a force on its tip. Slack it is as soft "
    "sideways as in flexion; stiffeners in the joints cure that, and do nothing in flexion.",
)  # fmt: skip

# ## Commands from two muscles
#
# The ratio of both efforts selects a group of fingers, their strength how far it closes. For the
# bar all five hang on one shaft; for the ball each has a motor, and index, middle finger and thumb
# close one after the other.

dt, t_end, leaves = 1e-3, 2.2, 1.7
t = dt * np.arange(round(t_end / dt) + 1)
plans = {  # from when on [s]: activation of flexor and extensor
    "bar": {0.0: (0.0, 0.0), 0.1: (0.05, 0.75), 0.9: (0.0, 0.0)},
    "ball": {0.0: (0.0, 0.0), 0.1: (0.75, 0.35), 0.45: (0.7, 0.7), 1.1: (0.7, 0.02),
             1.6: (0.0, 0.0)},
}  # fmt: skip
rng = np.random.default_rng(1)


def effort_of(plan):
    """(2, n) envelopes of two synthetic signals."""
    at = np.searchsorted(list(plan), t, side="right") - 1
    active = np.array(list(plan.values()))[at]
    return np.array([envelope(muscle(x, dt, rng), dt, tau=0.1) for x in active.T])


efforts = {what: effort_of(plan) for what, plan in plans.items()}
commands = {what: Chart(rate=0.05).follow(*effort, dt) for what, effort in efforts.items()}

# ## The hand closes
#
# Cables run from motors below the wrist in conduits that bend through the palm, and rub in them.
# The object stands on a table, which goes away; then friction alone carries it.

fingers, g, DRUM = hand(friction=0.05, n=2), 9.81, 5 * MM
held = {
    "bar": Held((26 * MM, 0.0, 28 * MM), 20 * MM, 0.08, axis=(0, 1, 0), length=0.1),
    "ball": Held((26 * MM, 22 * MM, 32 * MM), 20 * MM, 0.03),
}
wrist = np.array([20 * MM, 0.0, -70 * MM])


def conduit(name):
    """Places on a parabola from the wrist to the first hole of a finger."""
    seat, x = SEATS[name], np.linspace(0.0, 1.0, 6)[:-1, None]
    hole = seat.at + seat.axes @ (fingers[name].offset, 0.0, 0.0)
    start = wrist * (1, 0, 1) + np.array(seat.at) * (0, 0.25, 0)
    bend = hole - 40 * MM * seat.axes[:, 2]
    return tuple(map(tuple, (1 - x) ** 2 * start + 2 * x * (1 - x) * bend + x**2 * hole))


def driven(what):
    """Drives of all fingers: one shaft for the bar, a motor each for the ball."""
    pulls = commands[what].fingers()
    if what == "bar":
        motor = winches(pulls[:, :1], dt, names=("shaft",))["shaft"]
        drives = shaft(lambda t: motor.pull(t) / DRUM, dict.fromkeys(fingers, DRUM))
    else:
        drives = winches(pulls, dt)
    return {name: replace(one, conduit=conduit(name), transition_speed=5e-3)
            for name, one in drives.items()}  # fmt: skip


motions = {}
for what, thing in held.items():
    mech = moving_hand(fingers, drives=driven(what), gravity=(0, -g, 0))
    hold(mech, what, thing)
    table(mech, what, thing, leaves=leaves)
    motions[what] = rom.simulate(mech, t_end=t_end, dt=1e-3, rho_inf=0.5, save_every=2)
    forces = {name: f[-1] for name, f in grip(motions[what], what, fingers).items()}
    say(f"pressed on the {what}:", *(f"{name} {f:.2f} N" for name, f in forces.items()))
mass = mass_budget(mech, most=0.3)
stress = stress_budget(motions["bar"], fingers, motor=15.0, bone=50e6)
say(mass)
say(stress)


def tubes(lines, make):
    """Points (f, n, 3) and cells of what is drawn about lines (f, k, 3)."""
    made = [make(line) for line in lines]
    return np.array([points for points, _ in made]), made[0][1]


def rounded(ends, radius):
    """A bar with round ends, or a ball about a single point."""
    balls = [view.ellipsoid((radius,) * 3, end) for end in ends]
    bars = [view.cylinder(*ends, 2 * radius, sides=24)] if len(ends) == 2 else []
    return view.joined([*bars, *balls])


def lines_of(sol, markers, steps):
    """(f, k, 3) places of markers."""
    return np.stack([sol.position(m.body, m)[steps] for m in markers], axis=1)


def together(parts):
    """Solids that move, as one."""
    first = np.cumsum([0, *(points.shape[1] for points, _ in parts)])
    cells = [c + n for (_, c), n in zip(parts, first[:-1], strict=True)]
    return np.concatenate([points for points, _ in parts], axis=1), np.vstack(cells)


ASIDE = 220 * MM * np.array([0.51, 0.0, -0.86])  # to the right, as seen


def things_of(what, steps, aside=(0.0, 0.0, 0.0)):
    """Hand, object and table at some steps, moved aside (3,)."""
    sol, thing = motions[what], held[what]
    mech, parts = sol.mechanism, {"phalanges": [], "springs": [], "cables": []}
    for name, finger in fingers.items():
        for k, spring in enumerate(finger.springs, start=1):
            frames = [part.name for part in mech.nonlinear[f"{name} spring {k}"].parts[:-1]]
            X = np.stack([sol.position(frame)[steps] for frame in frames], axis=1)
            parts["springs"].append(tubes(X, lambda x, s=spring: view.wound(
                x, s.diameter, s.wire, turns=s.coils)))  # fmt: skip
            bone = [mech.parts[f"{name} phalanx {k}"].marker(at) for at in ("proximal", "distal")]
            parts["phalanges"].append(
                tubes(lines_of(sol, bone, steps), lambda x: rounded(x, THICK))
            )
        stations = [one.marker for one in mech.tendons[f"{name} cable"].stations]
        parts["cables"].append(
            tubes(lines_of(sol, stations, steps), lambda x: view.tube(x, 1.2 * MM))
        )
    ends = [mech.parts[what].marker(end) for end in thing.ends]
    parts[what] = [tubes(lines_of(sol, ends, steps), lambda x: rounded(x, thing.radius))]
    top = sol.position("table")[steps]
    plate = view.box((28 * MM, 4 * MM, 28 * MM), (0, -2 * MM, 0))
    parts["table"] = [(top[:, None] + plate[0], plate[1])]
    palm = view.box((75 * MM, 90 * MM, 20 * MM), mech.parts["palm"].at)
    parts["palm"] = [(np.repeat(palm[0][None], len(steps), axis=0), palm[1])]
    return {kind: (points + np.array(aside), cells)
            for kind, (points, cells) in ((k, together(p)) for k, p in parts.items())}  # fmt: skip


COLOURS = {"phalanges": "#c3c9d0", "springs": "#2f7f9f", "cables": "#d1495b", "bar": "#edae49",
           "ball": "#edae49", "table": "#8d6a9f", "palm": "#9aa5b1"}  # fmt: skip


def scene(title, things):
    """Things with the colours of their kinds."""
    drawn = {kind: view.Thing(*mesh, COLOURS[kind], opacity=0.5 if kind == "palm" else 1.0)
             for kind, mesh in things.items()}  # fmt: skip
    return view.Scene(title, drawn, view=(1.0, 0.5, 0.6), up=(0, 1, 0))


last = motions["bar"].t.size - 1
shown = {"bar": (0.0, 0.6, 1.6, 2.2), "ball": (0.0, 0.6, 1.2, 2.2)}  # s
beside = {what: [scene(f"{what} at {time:g} s", things_of(what, np.searchsorted(
                 motions[what].t, [time - 0.5 * dt]))) for time in times]
          for what, times in shown.items()}  # fmt: skip


def rows(what):
    """Curves from the muscles to the object."""
    sol, (x, y) = motions[what], efforts[what]
    pick = np.searchsorted(t, sol.t - 0.5 * dt)
    groups = np.array([(*GROUPS, "none")[k] for k in commands[what].groups])[pick]
    pulls = dict(zip(fingers, commands[what].fingers()[pick].T / MM, strict=True))
    height = {name: (sol.position(name) - sol.position(name)[0])[:, 1] / MM
              for name in (what, "table")}  # fmt: skip
    return [
        ("effort [1]", {"flexor": x[pick], "extensor": y[pick]}),
        ("selected group", {"": groups}),
        ("command: pull [mm]", pulls if what == "ball" else {"all on one shaft": pulls["index"]}),
        ("tension at the motor [N]", {name: motor_force(sol, name) for name in fingers}),
        (f"force on the {what} [N]", grip(sol, what, fingers)),
        ("height [mm]", height),
    ]


view.history(
    motions["ball"].t, rows("ball"), options.out / "hand_control.png", beside=beside["ball"],
    title="From two muscles to a ball in the hand",
    caption="From top to bottom: envelopes of two synthetic muscle signals; the group of fingers "
    "that their ratio selects, in sectors of 18 degrees; the pull commanded to each motor, more "
    "with more effort, never less until both muscles say so; tension; forces of the phalanges; the "
    f"table leaves at {leaves:g} s.",
)  # fmt: skip
view.history(
    motions["bar"].t, rows("bar"), options.out / "hand_grasp.png", beside=beside["bar"],
    title="Five cables on one shaft close around a bar",
    caption=f"The extensor alone selects all fingers, which one motor draws. The bar of "
    f"{1e3 * held['bar'].mass:.0f} g stands on a table, which leaves at {leaves:g} s; friction of "
    "the skin carries it, and holds it where it is.",
)  # fmt: skip
steps = np.linspace(0, last, 36).round().astype(int)
both = [things_of("bar", steps), things_of("ball", steps, ASIDE)]
moving = {kind: together([one[kind] for one in both if kind in one]) for kind in COLOURS}
view.film(
    motions["bar"].t[steps], scene("A bar and a ball", moving), options.out / "hand_grasp.gif",
    seconds=6.0,
    caption="Left: one motor closes five fingers around a bar. Right: three motors close index, "
    "middle finger and thumb around a ball. Then the tables leave.",
)  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.

at = postures[4]
carried = {
    what: sum(contact_forces(sol, what).values())[-1, 1] / (held[what].mass * g)
    for what, sol in motions.items()
}
results = {
    "angle of a joint at 2 N [deg]": (np.degrees(at.angles[0]), 28.6334, 1e-3),
    "pull at 2 N [mm]": (at.pull / MM, 11.331, 1e-3),
    "tip at 2 N, towards the palm [mm]": (at.tip[0] / MM, 40.801, 1e-3),
    "sideways compliance of the slack tip [mm/N]": (C[0, 0] / MM, 267.362, 1e-3),
    "share of the bones in flexion, as beams [%]": (bone_share, as_beams(), 0.08),
    "flexion at which coils touch [deg]": (np.degrees(postures[-1].angles.sum()), 113, 0.07),
    "buckling at a compression of": (column.critical_compression(1.0), 0.1986, 1e-3),
    "fingers that press the bar": (float(sum(f[-1] > 0.1 for f in grip(
        motions["bar"], "bar", fingers).values())), 5.0, 0.0),
    "held weight of the bar [1]": (carried["bar"], 1.0, 1e-3),
    "held weight of the ball [1]": (carried["ball"], 1.0, 0.03),
    "last selected group": (float(commands["ball"].groups[-1]), 0.0, 0.0),
    "mass [kg]": (mass.rows[-1].value, 0.1433, 1e-3),
    "moment of the shaft over sum of tensions [mm]": (
        shaft_moment(motions["bar"], dict.fromkeys(fingers, DRUM))[-1]
        / sum(motor_force(motions["bar"], name)[-1] for name in fingers) / MM, 5.0, 1e-9),
}  # fmt: skip
for name, (value, expected, tolerance) in results.items():
    print(f"{name}: {value:.6g}, expected {expected:.6g} within {tolerance:g}")
