# # A box with a removable component: what a bolted joint makes of a prediction
#
# A square tube, cut along one wall, carries two channels, and these a beam: the box whose
# vibration test others published (BARC). Four solids of a gmsh geometry are reduced one by one,
# then joined in three ways that were predicted before the test was opened: glued on whole faces,
# and on squares as wide as the heads of the bolts, rigid or averaged. Then all bolts get one
# stiffness, which three measured modes tell; the others are foretold with it, and the verdict on
# the model is read.
#
# Run: `python demos/demo_barc.py`, in a checkout; under `mpirun` one process does the work
# Time: 45 s
# Writes: `barc.png` and `barc_modes.png` into `out/`; another folder with `--out`

import argparse
import sys
import warnings
from pathlib import Path

from mpi4py import MPI

import numpy as np

import rom
from rom import view
from rom.updating import Channels
from rom.view import Drawing, Scene

RECORDS = Path(__file__).parents[1] / "tests"
if not RECORDS.exists():
    raise SystemExit("the records of predictions lie in tests/measured/ of a checkout")
sys.path.append(str(RECORDS))
from measured import barc, record

options = argparse.ArgumentParser(description="a box with a removable component")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
_ = rom.fe.model  # PETSc starts here, on all processes together
if MPI.COMM_WORLD.rank:
    raise SystemExit  # small solids are work for one process
warnings.simplefilter("ignore", rom.RomWarning)  # of slender cells beside the squares
options.out.mkdir(parents=True, exist_ok=True)
say = (lambda *_: None) if options.quiet else print
MESH = 10  # [mm]; frequencies are 1 to 3 % above those of the records, which are extrapolated

# ## Three joints, predicted before the test was opened
#
# Parts on a coarse mesh, beside what was put down, and what was measured.

verdicts = record.compare(barc.BARC) | record.compare(barc.BARC_JOINT)
kept = record.read("barc") | record.read("barc_joint")
measured = np.array([verdicts[f"bolted, mode {k} [Hz]"].measured for k in range(1, 7)])
found = {}
for joint, (kind, squares) in barc.JOINTS.items():
    whole = barc.joined(barc.parts(MESH, kind, **squares))
    found[joint] = whole.frequencies(18)[6:]
    say(f"{joint}, {sum(body.n_modes for body in whole.bodies.values())} coordinates:",
        *(f"{f:.1f}" for f in found[joint][:6]), "Hz")  # fmt: skip

# ## One stiffness of all bolts, by three measured modes
#
# Squares are as wide as cones of pressure; springs of one unknown factor stand between them. The
# test tells modes, not responses: these are rebuilt beside the first three, with sizes of the
# model. One of 30 places is left out, of which below.

bodies = barc.parts(MESH, "rbe2", **barc.CONES)
families, springs = barc.families(bodies), barc.bolts(bodies)
every = barc.Shapes.read()
shapes = every.trusted
update = rom.update(
    families, barc.rebuilt(families, shapes, measured[:3]), free=(), attached={"bolts": springs},
    damping=0.03,
)  # fmt: skip
factor = update.factors["bolts"]
say(update)
say("scores:", *(f"{name} {score:.0f}" for name, score in update.scores.items()))
say(f"stiffness of a bolt: {factor * barc.BOLT[0]:.2g} N/m")
omega, V = barc.bolted(bodies, factor, shapes.channels.rows(bodies, "sensor"))
found["bolted"] = omega[6:24] / (2 * np.pi)
ahead = {joint: [kept[f"{joint}, mode {k} [Hz]"].value for k in range(1, len(f) + 1)]
         for joint, f in found.items()}  # fmt: skip
for k, f in enumerate(measured):
    told = ", ".join(f"{joint} {100 * (ahead[joint][k] / f - 1):+.1f} %" for joint in found)
    say(f"mode {k + 1}, measured {f:.1f} Hz; predicted {told}")

# ## Shapes
#
# Modal assurance criterion at 29 places, in the directions that were measured.

mac = shapes.mac(V[:, 6:14])
say("MAC:", *(f"{x:.2f}" for x in np.diag(mac)))

# The place left out moves as no model has it; its twelve numbers are those of a place on the beam,
# where the row of measured places has a gap.

full = barc.bolted(bodies, factor)[1][:, 6:12]
sizes = np.array([(v @ u) / (v @ v) for v, u in zip(V.T[6:12], shapes.values.T, strict=True)])
full = full * sizes
told = every.values[every.doubtful]
along = np.asarray(every.channels.directions)[every.doubtful]
moves = {
    words: Channels([place] * 2, along, name).rows(bodies, "place") @ full
    for words, place, name in (
        ("model, at the cut", barc.DOUBTFUL, "box"), ("model, on the beam", barc.ELSEWHERE, "beam"),
    )
}  # fmt: skip
off = {words: np.linalg.norm(x - told) / np.linalg.norm(told) for words, x in moves.items()}
say("the place left out, off by", *(f"{words} {100 * x:.0f} %," for words, x in off.items()))

# ## Damping
#
# Aluminium gives a few hundredths of a per cent at most; the rest is in the joints. Yet one loss
# factor of all bolts, by the share of the energy in them, does not give what was measured.

zeta, share = barc.damping(), barc.shares(bodies, factor)[:6]
loss = np.exp(np.mean(np.log(2 * zeta / share)))
lossy = loss * share / 2
say("damping [%]:", *(f"{100 * x:.2f}" for x in zeta), "measured;",
    *(f"{100 * x:.2f}" for x in lossy), f"by a loss factor of {loss:.2f}")  # fmt: skip

# ## Pictures

modes = np.arange(1, 7)


def over(values, measures=measured):
    """Deviations [%] over modes."""
    return np.column_stack([modes, 100 * (np.array(values[:6]) / measures - 1)])


band = [kept[f"bolted, mode {k} [Hz]"] for k in modes]
outline = np.vstack([over([x.low for x in band]), over([x.high for x in band])[::-1]])
line = np.array([-1.2, 1.2])
view.plane(
    [
        Drawing(
            "Shapes, bolts with their stiffness: MAC", "mode of the test", "mode of the model",
            extent=(0.5, 6.5, 0.5, 8.5), shade=mac, label="modal assurance criterion",
            limits=(0.0, 1.0),
        ),
        Drawing(
            "One corner of the cut, six modes, y and z", "measured [1], largest of each mode 1",
            "model [1]", equal=False,
            points={how: np.column_stack([told.ravel(), x.ravel()]) for how, x in moves.items()},
            curves={"_alike": [np.column_stack([line, line])]},
        ),
        Drawing(
            "Frequencies, predicted less measured", "mode", "deviation [%]", equal=False,
            polygons=[outline],
            points={joint.replace(" squares", ""): over(values) for joint, values in ahead.items()},
            curves={"_zero": [np.array([[1.0, 0], [6, 0]])]},
        ),
        Drawing(
            "Damping", "mode", "damping ratio [%]", equal=False,
            points={"measured": np.column_stack([modes, 100 * zeta]),
                    "one loss factor in the bolts": np.column_stack([modes, 100 * lossy])},
        ),
    ],
    options.out / "barc.png", title="A box with a removable component: joints against the test",
    caption="A cut square tube of aluminium with two bolted channels and a beam. Above, left: "
    "shapes at 29 places. Right: a thirtieth, at a corner of the cut, does not move as there; its "
    "numbers are those of a place on the beam. Below, left: three joints, predicted before the "
    "test was opened (glued; squares at bolts, rigid or averaged), and one stiffness of ten bolts "
    "by which modes 1 to 3 are fitted and 4 to 6 foretold; shaded: the band of these, by material, "
    "walls, masses of bolts and stiffness. Right: damping, and what one loss factor makes of the "
    "energy in the bolts.",
)  # fmt: skip
ends = np.cumsum([6 + body.n_modes for body in bodies.values()])
points, directions = (np.asarray(x) for x in (shapes.channels.points, shapes.channels.directions))
places, of = np.unique(points, axis=0, return_inverse=True)
MAGNIFIED = 0.02  # [m] of the largest measured component


def seen(k):
    """A mode of the model, with places of the test where these were measured to move."""
    things = {}
    for (name, body), end in zip(bodies.items(), ends, strict=True):
        surface, own = body.surface, full[end - 6 - body.n_modes : end, k]
        moved = own[:3] + np.cross(own[3:6], surface.points)
        moved = moved + (surface.shape @ own[6:]).reshape(-1, 3)
        things[name] = surface.points + MAGNIFIED * moved, surface.triangles
    at = places.copy()
    np.add.at(at, of.ravel(), MAGNIFIED * directions * shapes.values[:, [k]])
    balls = [view.ellipsoid((0.0045,) * 3, p, sides=10) for p in at]
    title = f"Mode {k + 1}: {measured[k]:.1f} Hz, predicted {ahead['bolted'][k]:.1f} Hz"
    return Scene(
        title, things | {"measured": view.joined(balls)}, view=(0.5, 0.7, 1.0), up=(0, 1, 0)
    )


view.plane(
    [seen(k) for k in range(6)], options.out / "barc_modes.png", columns=3, height=420,
    title="Six modes of the box, and where its test saw them",
    caption="Bodies: shapes of the model with one stiffness of its bolts, scaled to the test and "
    "magnified until the largest measured component is 20 mm. Balls: places of the test, moved as "
    "it says in the directions that were measured, at rest in others.",
)  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.
# One stiffness brings six modes to 2.6 %, three ways of joining without one to 5, 10 and 10 %. It
# does not bring them to 2 %: mode 5 hardly knows of the joint. The verdict says that this model
# is not that of the test, and docs/measured.md what was looked into.


def most(joint):
    """Largest deviation of a prediction [%]."""
    return max(abs(verdicts[f"{joint}, mode {k} [Hz]"].deviation) for k in modes)


coarse = [np.array(f)[:6] / ahead[joint][:6] for joint, f in found.items()]
results = {
    "glued, largest deviation [%]": (most("glued"), 9.96, 0.01),
    "rigid squares, largest deviation [%]": (most("rigid squares"), 5.35, 0.01),
    "averaged squares, largest deviation [%]": (most("averaged squares"), 10.5, 0.01),
    "bolts with one stiffness, largest deviation [%]": (most("bolted"), 2.57, 0.01),
    "coarse mesh over what was predicted, largest": (float(np.max(coarse)), 1.02, 0.03),
    "the same, smallest": (float(np.min(coarse)), 1.0, 0.02),
    "verdict refuses": (float(not update.verdict.ok), 1.0, 0.0),
    "smallest MAC of six modes": (float(np.diag(mac).min()), 0.96, 0.01),
    "the place left out, off as a place of the beam": (off["model, on the beam"], 0.2, 0.5),
}
for name, (value, expected, tolerance) in results.items():
    print(f"{name}: {value:.6g}, expected {expected:.6g} within {tolerance:g}")
