# # A light hand: joints of springs, closed by cables
#
# Every joint of this hand is a compression spring; a cable on the palm side bends three of them at
# once. A spring under a cable is pressed together and bent far, which no small-deflection formula
# covers, but a short rod with the four rigidities of the spring does. The hand is ours, after an
# idea of Potratz, Yang, Abdel-Malek, Pena Pitarch and Grosland.
#
# Run: `python demos/demo_hand.py`
# Writes: `hand.png` and `hand_control.png` into `out/`; another folder with `--out`

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

import rom
from rom import view
from rom.bench.models import bar
from rom.components.cosserat import HelicalSpring
from rom.components.hand import (
    GROUPS,
    HAND_SPRING,
    INDEX_LENGTHS,
    Bar,
    Chart,
    Finger,
    close,
    envelope,
    grasp,
    hand,
    muscle,
    parts_of_compliance,
    rest,
)
from rom.view import Panel

options = argparse.ArgumentParser(description="fingers of springs, their stiffness and command")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
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
    f"Index finger under {', '.join(f'{p.tension:g}' for p in postures[::2])} N",
    fingers_as_things([built(p, (50 * MM * k, 0, 0)) for k, p in enumerate(postures[::2])]),
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

forces = np.linspace(-100, 100, 11)


def deflection(one, tension, axis):
    start = close(one, tension=tension)
    moved = [
        close(one, tension=tension, load=f * MN * np.eye(3)[axis], start=start).tip for f in forces
    ]
    return (np.array(moved) - start.tip)[:, axis] / MM


bending = {f"cable {T:g} N": (forces, deflection(finger, T, 0)) for T in (0.0, 1.0)}
sideways = {f"cable {T:g} N": (forces, deflection(finger, T, 1)) for T in (0.0, 1.0)}
sideways["cable 1 N, stiffeners"] = forces, deflection(replace(finger, stiffener=10.0), 1.0, 1)
C = rest(finger).tip_compliance()

column = HelicalSpring(MM, 10 * MM, 8, 40 * MM)
sturdy = replace(column, length=24 * MM)
share = np.linspace(0.0, 0.4, 81)
within = share < column.critical_compression(1.0)
columns = {"40 mm long": (100 * share[within], column.lateral_stiffness(share[within])),
           "24 mm long": (100 * share, sturdy.lateral_stiffness(share))}  # fmt: skip

# ## May phalanges be rigid?
#
# Square bars of polyamide, 12 mm thick, reduced: what they add to the compliance of the tip. With
# `solid_finger` they move in a mechanism; `meshes/phalanx.geo` is a bone with a bore for the cable.

polyamide = rom.Material(E=1.7e9, nu=0.4, rho=1010.0)
ends = {"root": "rbe3", "tip": "rbe3"}  # plates that leave the bars free to widen, as in beams
solids = [bar((link, 12 * MM, 12 * MM), (3, 2, 2), polyamide) for link in INDEX_LENGTHS]
bones = [rom.reduce(solid, interfaces=ends, method=rom.CraigBampton(n_modes=3), certify=False)
         for solid in solids]  # fmt: skip
upward = np.array([[0, 0, -1], [0, 1, 0], [1, 0, 0]])  # these bars lie along x
joints, links = parts_of_compliance(bones, (HAND_SPRING,) * 3, ends=tuple(ends), orientation=upward)
bone_share = 100 * links[0, 0] / (joints + links)[0, 0]
say(f"sideways compliance of the tip that is in the bones: {bone_share:.4f} %")

# ## A grasp of a bar of 40 mm from both sides

fingers = hand(n=8)
bar = Bar((26 * MM, 20 * MM), 20 * MM)
held = {name: grasp(f, bar, np.linspace(0.25, 2.5, 10))[-1] for name, f in fingers.items()}
grip = {name: bar.pressure(p)[0].sum() for name, p in held.items()}
say("pressed on the bar:", *(f"{name} {f:.2f} N" for name, f in grip.items()))
beside = {"index": 33.0, "middle": 11.0, "ring": -11.0, "little": -33.0}
seen = fingers_as_things(
    [
        built(p, (52 * MM, 0, 0), -1) if name == "thumb" else built(p, (0, beside[name] * MM, 0))
        for name, p in held.items()
    ]
)
(x, z), reach = bar.centre, 50 * MM
seen["bar"] = view.Thing(*view.cylinder((x, -reach, z), (x, reach, z), 2 * bar.radius), "#edae49")

drawn = {f"friction {mu:g}": loop(mu) for mu in (0.2, 0.0)}
view.panels(
    [
        [closing,
         Panel("Cable drawn in and let out", "pull [mm]", "tension [N]", curves=drawn)],
        [Panel("Fingertip in the plane of flexion", "force [mN]", "deflection [mm]",
               curves=bending),
         Panel("Fingertip sideways", "force [mN]", "deflection [mm]", curves=sideways)],
        [Panel("Sideways stiffness of a spring", "compression [%]", "stiffness [N/m]",
               curves=columns),
         view.Scene("Five fingers around a bar of 40 mm", seen, view=(-0.5, -1.0, 0.45),
                    up=(0, 0, 1))],
    ],
    options.out / "hand.png",
    title="Fingers whose joints are springs",
    caption="Phalanges are 10 mm thick. Top: beyond 2.65 N coils touch on the palm "
    "side; friction of the cable opens a loop. Middle: the slack finger is as soft sideways as in "
    "flexion, stiffeners in the joints cure that. Bottom: a long spring loses its sideways "
    "stiffness under compression and buckles at 20 %; fingers and thumb close with 2.5 N each.",
)  # fmt: skip

# ## Commands from two muscles

dt, n = 1e-3, 9000
t = dt * np.arange(n)
plan = [(0.0, 0.0), (0.5, 0.08), (0.0, 0.0), (0.35, 0.25), (0.0, 0.0), (0.1, 0.6)]
steps = np.repeat(np.array(plan), n // len(plan), axis=0)
rng = np.random.default_rng(1)
effort = [envelope(muscle(steps[:, k], dt, rng), dt) for k in (0, 1)]
commands = Chart().follow(effort[0][::10], effort[1][::10], 10 * dt)
pulls = np.repeat(commands.fingers(), 10, axis=0) / MM
view.history(
    t, [
        ("effort, share of the largest", {"flexor": effort[0], "extensor": effort[1]}),
        ("selected group", {"": np.repeat([(*GROUPS, "none")[k] for k in commands.groups], 10)}),
        ("pull [mm]", dict(zip(("thumb", "index", "middle", "ring", "little"), pulls.T,
                               strict=True))),
    ],
    options.out / "hand_control.png",
    title="From two muscles to five fingers",
    caption="Top: envelopes of two synthetic muscle signals. Their ratio selects a group, in "
    "sectors of 18 degrees, their strength how far it closes. Middle: a group is kept through rest "
    "and noise. Bottom: fingers hold what they reached; middle, ring and little finger move "
    "together.",
)  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.

at = postures[4]
results = {
    "angle of a joint at 2 N [deg]": (np.degrees(at.angles[0]), 28.6334, 1e-3),
    "pull at 2 N [mm]": (at.pull / MM, 11.331, 1e-3),
    "tip at 2 N, towards the palm [mm]": (at.tip[0] / MM, 40.801, 1e-3),
    "sideways compliance of the slack tip [mm/N]": (C[0, 0] / MM, 267.362, 1e-3),
    "share of the bones in it, as beams [%]": (bone_share, 0.00627, 3e-3),
    "flexion at which coils touch [deg]": (np.degrees(postures[-1].angles.sum()), 113, 0.07),
    "buckling at a compression of": (column.critical_compression(1.0), 0.1986, 1e-3),
    "fingers that press the bar": (float(sum(f > 0.1 for f in grip.values())), 5.0, 0.0),
    "last selected group": (float(commands.groups[-1]), 4.0, 0.0),
}  # fmt: skip
for name, (value, expected, tolerance) in results.items():
    print(f"{name}: {value:.6g}, expected {expected:.6g} within {tolerance:g}")
