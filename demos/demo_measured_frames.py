# # Frames that others measured: predicted first, then compared, then corrected
#
# A U of thick sheet, free, and a frame of three storeys on rails, with added masses, thin columns
# and a stop that knocks. Each number was predicted with its band and put down before the
# measurement was opened; the records lie in `tests/measured/`. What was off is looked for by
# varying one thing at a time; what one or two corrected numbers foretell of other modes and states
# is put down in turn.
#
# Run: `python demos/demo_measured_frames.py`, in a checkout; one process of `mpirun` does the work
# Time: 20 s
# Writes: `measured_frames.png` into `out/`; another folder with `--out`

import argparse
import sys
from pathlib import Path

from mpi4py import MPI
from slepc4py import SLEPc  # noqa: F401  begins on all processes, of which one goes on

import numpy as np

import rom
from rom import view
from rom.view import Panel

RECORDS = Path(__file__).parents[1] / "tests"
if not RECORDS.exists():
    raise SystemExit("the records of predictions lie in tests/measured/ of a checkout")
sys.path.append(str(RECORDS))
from measured import bumper, jim_beam, lanl, record

options = argparse.ArgumentParser(description="frames that others measured")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
if MPI.COMM_WORLD.rank:
    raise SystemExit  # small models are work for one process
options.out.mkdir(parents=True, exist_ok=True)
say = (lambda *_: None) if options.quiet else print

# ## What was predicted, and what was measured

ALL = (jim_beam.JIM_BEAM, jim_beam.JIM_CORNERS, lanl.LANL, lanl.LANL_FITTED, lanl.LANL_RAILS,
       bumper.BUMPER)  # fmt: skip
kept = {one.name: record.read(one.name) for one in ALL}
verdicts = {one.name: record.compare(one) for one in ALL}
for name, rows in verdicts.items():
    for what, row in rows.items():
        one = row.prediction
        say(f"{name:17s} {what:38s} {one.value:8.5g} ({one.low:.4g} to {one.high:.4g}), measured "
            f"{row.measured:8.5g}, off by {row.deviation:6.2f} %, "
            f"{'inside' if row.inside else 'outside'}")  # fmt: skip

# ## The models today, on coarse meshes
#
# The U as it was drawn, and the frame with the modulus of its columns and the stiffness that holds
# its base, both of which the reference state S1 alone determines.

model = jim_beam.solid(1)
u = rom.reduce(model, method=rom.CraigBampton(40), interfaces={"tip": "rbe3"}, certify=False)
drawn = u.frequencies(19)[6:]
given = {name: value for name, (value, _) in lanl.LANL_RAILS.parameters.items()}
given = {name: value for name, value in given.items() if name not in ("turned", "again")}
anew = {name: lanl.state(2, name, **given) for name in ("S1", "S5")}
say("S1 and S5, coarse mesh:", anew)

# ## One run with the stop
#
# Four masses on the rail, shaken at random; the peaks are those of one pole each.

near = rom.linearize(bumper.chain()).frequencies[1:4]
free, knocking = (bumper.peaks(*bumper.response(1, gap, force=20.0), near) for gap in (None, 0.05))
say("peaks without the stop and with a gap of 0.05 mm:", free, knocking)

# ## Pictures
#
# Lines are predictions, thin ones the ends of their bands, rings what was measured.


def lines(name, rows, unit=1.0):
    """Prediction and band of a record over x, in a unit or one for each."""
    one = [kept[name][what] for what in rows.values()]
    unit, x = np.broadcast_to(unit, len(one)), [*rows]
    value, low, high = ([getattr(p, end) for p in one] / unit for end in ("value", "low", "high"))
    return (x, value), ([*x, np.nan, *x], np.r_[low, np.nan, high])


def rings(name, rows, unit=1.0):
    """What was measured over x."""
    unit = dict(zip(rows, np.broadcast_to(unit, len(rows)), strict=True))
    found = {x: verdicts[name][what] for x, what in rows.items() if what in verdicts[name]}
    return [*found], [row.measured / unit[x] for x, row in found.items()]


def diagram(title, xlabel, ylabel, things, unit=1.0):
    """Things are {label: (name of the record, {x: row})}; the last one has the rings."""
    drawings = {label: lines(*thing, unit) for label, thing in things.items()}
    return Panel(title, xlabel, ylabel,
                 {label: one[0] for label, one in drawings.items()}
                 | {f"_{label}": one[1] for label, one in drawings.items()},
                 {"measured": rings(*[*things.values()][-1], unit)})  # fmt: skip


modes = {k: f"mode {k} [Hz]" for k in range(1, jim_beam.N_MODES + 1)}
of_drawing = [one.value for one in kept["jim_beam"].values()]
u_picture = diagram(
    "U of thick sheet, free", "mode", "frequency over that as predicted [1]",
    {"as drawn": ("jim_beam", modes), "corners by the first four": ("jim_beam_corners", modes)},
    of_drawing,
)  # fmt: skip
scene = view.Scene("The U, 150 mm wide", {"sheets": (u.surface.points, u.surface.triangles)},
                   view=(0.7, -1.0, 0.5), up=(0, 0, 1))  # fmt: skip
frames, stops = [], []
for k in (1, 2, 3):
    states = {float(name[1:]): f"{name}, mode {k} [Hz]" for name in lanl.STATES}
    frames.append(diagram(
        f"Frame of three storeys, mode {k}", "state", f"mode {k} [Hz]",
        {"one number by state 1": ("lanl_fitted", states),
         "base held, too": ("lanl_rails", states)},
    ))  # fmt: skip
    gaps = {gap: f"{name} over S1, mode {k} [1]" for name, gap in bumper.GAPS.items()}
    stops.append(diagram(
        f"The frame with a stop, mode {k}", "gap [mm]", "frequency over state 1 [1]",
        {"predicted": ("lanl_bumper", gaps)},
    ))  # fmt: skip
view.panels(
    [[scene, u_picture], frames, stops], options.out / "measured_frames.png",
    title="Frames that others measured",
    caption="Lines: predictions, thin ones the band. Rings: measured. Above: 13 modes of a free U "
    "of aluminium, 10 mm thick (the Jim beam); four were opened, then two numbers corrected. "
    "Middle: frame of Los Alamos on rails; states 2 and 3 carry 1.2 kg, 4 to 9 have one or two "
    "columns half as thick; 6 to 9 were not opened. One number: modulus of the columns; a spring "
    "holds the base, too. Below: a column that hangs from the top floor knocks on a stop on the "
    "floor below; peaks of responses to a random force.",
)  # fmt: skip

# ## What to remember
#
# The first mode of the frame is that of its rails: what holds the base moves it by more than losing
# two columns. The other modes, over those of the first state, were foretold within 0.7 %, with the
# stop within 1.5 %. Corners of the U are ten times as soft as a piece.


def off(structure, quantity, measure=max):
    """A measure of the sizes of the deviations of some rows [%]."""
    rows = verdicts[structure].items()
    return float(measure([abs(row.deviation) for name, row in rows if quantity in name]))


upper = [off("lanl_frame", f"over S1, mode {k}") for k in (2, 3)]
stopped = [off("lanl_bumper", f"mode {k}") for k in (2, 3)]
ratio = anew["S5"] / anew["S1"]
results = {
    "U as drawn, largest [%]": (off("jim_beam", "mode"), 12.2, 0.01),
    "U, its first frequency on a coarse mesh [Hz]": (drawn[0], 70.45, 0.001),
    "frame, modes 2 and 3 over those of S1, largest [%]": (max(upper), 0.70, 0.02),
    "the same with a stop [%]": (max(stopped), 1.47, 0.02),
    "frame, mode 1 with one number fitted, largest [%]": (off("lanl_fitted", "mode 1"), 11.1, 0.02),
    "S5 over S1, mode 2, columns half as thick": (ratio[1], 47.0 / 54.2, 0.01),
    "peak of mode 2 over that without the stop": (knocking[1] / free[1], 57.6 / 54.2, 0.02),
}
for name, (value, expected, tolerance) in results.items():
    print(f"{name}: {value:.6g}, expected {expected:.6g} within {tolerance:g}")
