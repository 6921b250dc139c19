# # Arches that others loaded until they fell: predicted first, then compared
#
# Five bare rings of bricks and a bridge under its fill. What rigid stones bear that nothing glues,
# what they bear with mortar that gives way all at once, and what fill adds, was put down before the
# loads of the tests were opened; the records lie in `tests/measured/`. Nothing was adjusted
# afterwards.
#
# Run: `python demos/demo_measured_arches.py`, in a checkout; under `mpirun` one process works
# Time: 40 s
# Writes: `measured_arches.png` into `out/`; another folder with `--out`

import argparse
import sys
from dataclasses import replace
from pathlib import Path

from mpi4py import MPI

import numpy as np

from rom import view
from rom.components.masonry import ramp, simulate

RECORDS = Path(__file__).parents[1] / "tests"
if not RECORDS.exists():
    raise SystemExit("the records of predictions lie in tests/measured/ of a checkout")
sys.path.append(str(RECORDS))
from measured import arches, record

options = argparse.ArgumentParser(description="arches that others loaded until they fell")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
if MPI.COMM_WORLD.rank:
    raise SystemExit  # arches are work for one process
options.out.mkdir(parents=True, exist_ok=True)
say = (lambda *_: None) if options.quiet else print

# ## What was predicted, what the models give today, and what was measured

now = record.nominal(arches.ARCHES)[0]
verdicts = record.compare(arches.ARCHES)
drift = max(abs(now[name] / row.prediction.value - 1) for name, row in verdicts.items())
for name, row in verdicts.items():
    one = row.prediction
    say(f"{name:44s} {one.value:8.3f} ({one.low:.3f} to {one.high:.3f}), measured "
        f"{row.measured:7.2f}, {'inside' if row.inside else 'outside'}")  # fmt: skip
for name, load in arches.BRITTLE.items():
    say(f"{name:44s} {load:8.3f} with joints that break one by one")

# ## How much mortar would it take?
#
# Shear and flexural strength of the joints, varied afterwards: loads with joints that give way all
# at once. Without any, the arches of Oliveira hardly bear themselves.

LABELS = {
    "Carozzi U_A": "arch U_A",
    "Carozzi U_V": "vault U_V",
    "Oliveira US-1": "arches US-1, US-2",
    "Borri": "half circle",
}
BONDS = np.linspace(0.0, 6e5, 13)  # [Pa]


def with_bonds(name):
    """Loads of a bare arch with joints of these strengths [kN]."""
    what = arches.BARE[name]
    one = arches.ring(what, what.courses, 1.0, 1.0, 0.0, 1.0)
    load = [arches.at_part(one, what.at)]
    found = [arches.borne(arches.stones(one, 0.6, bond), load, []) for bond in BONDS]
    return 1e-3 * what.width * np.array(found)


borne = {name: with_bonds(name) for name in LABELS}
tests = {name: [verdicts[f"{other}, glued [kN]"].measured for other in
                ([name, "Oliveira US-2"] if "Oliveira" in name else [name])]
         for name in LABELS}  # fmt: skip
needed = {name: np.interp(tests[name], borne[name], BONDS) for name in LABELS}
for name, bond in needed.items():
    say(f"{name}: as measured with joints of", *(f"{1e-6 * b:.2f} MPa" for b in bond))

# ## How a bare arch falls
#
# A fifth more than what arch U_A bears without mortar: four hinges.

U_A = arches.BARE["Carozzi U_A"]
ring = arches.ring(U_A, U_A.courses, 1.0, 1.0, 0.0, 1.0)
bare, (load,) = arches.stones(ring, 0.6, 0.0), arches.points([arches.at_part(ring, U_A.at)])
force = 1.2e3 * now["Carozzi U_A, no tension [kN]"] / U_A.width
fall = simulate(bare, t_end=0.6, dt=5e-4, save_every=20,
                actions=[replace(load, force=(0.0, -force), history=ramp(0.2))])  # fmt: skip
turned = np.degrees(fall.q[..., 2])
still = np.abs(turned).max(axis=1) < 8.0
last = int(np.flatnonzero(still)[-1])
turns = np.diff(turned[last])
arrow = np.array([(0, 0.02, 0), (0, 0.4, 0), (-0.06, 0.12, 0), (0.06, 0.12, 0)], dtype=float)
arrow[:, :2] += fall.outlines(last)[load.stone].max(axis=0)
hinges = np.flatnonzero(np.abs(turns) > 0.25 * np.abs(turns).max())

# ## The picture

bars = {
    name.removeprefix("Prestwood, ").removesuffix(" [kN]"): row.prediction
    for name, row in verdicts.items() if "Prestwood" in name
}  # fmt: skip
KINDS = {"no tension": "nothing glues", "glued": "glued, gives way all at once"}


def of(kind):
    """Rows of all bare arches, each test once."""
    return [row for name, row in verdicts.items() if f", {kind} " in name and "quarter" not in name]


def parity(kind):
    """Measured loads, and those predicted."""
    return [row.measured for row in of(kind)], [row.prediction.value for row in of(kind)]


def whiskers(kind):
    """Bands, over what was measured."""
    rows = of(kind)
    low = [(row.measured, max(row.prediction.low, 5e-3)) for row in rows]
    high = [(row.measured, row.prediction.high) for row in rows]
    lines = [end for pair in zip(low, high, strict=True) for end in (*pair, (np.nan, np.nan))]
    return tuple(np.array(lines).T)


brittle = ([tests[name][0] for name in LABELS], [arches.BRITTLE[name] for name in LABELS])
figure = [
    [view.Panel("Bare arches", "measured [kN]", "predicted [kN]",
                {"as measured": ([0.3, 2.5], [0.3, 2.5])}
                | {f"_{kind}": whiskers(kind) for kind in KINDS},
                {label: parity(kind) for kind, label in KINDS.items()}
                | {"glued, joints break one by one": brittle},
                notes={"vault U_V": (0.37, 0.75), "half circle": (0.62, 2.6), "US-1": (1.34, 1.05),
                       "US-2": (1.8, 1.05), "arch U_A": (1.75, 2.9)}, log=True),
     view.Panel("Afterwards: mortar that would do", "shear and flexural strength [MPa]",
                "load [kN]",
                {label: (1e-6 * BONDS, borne[name]) for name, label in LABELS.items()},
                {"measured": (1e-6 * np.concatenate([*needed.values()]),
                              np.concatenate([*tests.values()]))})],
    [view.Scene("Arch U_A that nothing glues, under 1.2 times its load",
                {"stones": view.plates([fall.outlines(last)], U_A.width),
                 "load": view.Thing(arrow, [(0, 1), (0, 2), (0, 3)], "#d1495b", width=5.0)},
                view=(0.25, 0.15, 1.0), up=(0, 1, 0)),
     view.Panel("Prestwood bridge: bands, and what it bore", "load [kN]",
                bars={kind: (one.low, one.high) for kind, one in bars.items()},
                curves={"measured": ([228.0, 228.0], [-0.5, len(bars) - 0.5])})],
]  # fmt: skip
view.panels(
    figure, options.out / "measured_arches.png", title="Arches that others loaded until they fell",
    caption="Above, left: loads of bare arches of bricks, predicted before the tests were opened; "
    "thin lines are bands, those that end at 0.005 kN reach zero. Rigid stones that nothing glues "
    "bear a hundredth to two fifths of what was measured. Right: loads with joints of some "
    "strength that give way all at once, and with which of them the arches bear what was measured "
    "(rings). Below, left: four hinges open. Right: a bridge of 6.55 m, its ring alone, and with "
    "fill that weighs, pushes back, or yields.",
)  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.

results = {
    "1 + drift of the models since they foretold": (1 + drift, 1.0, 1e-3),
    "hinges of the arch that falls": (float(len(hinges)), 4.0, 0.0),
}
for name, (value, expected, tolerance) in results.items():
    print(f"{name}: {value:.6g}, expected {expected:.6g} within {tolerance:g}")
