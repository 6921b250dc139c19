# # A test bed like an aircraft: predicted, measured by many, corrected, and predicted again
#
# GARTEUR SM-AG19 went round a dozen laboratories: a fuselage, a wing with drums at its tips, fin and
# tailplane of aluminium; on the wing a strip on a sticky tape, which damps. Parts are meshed as
# solids, reduced and joined by thin contacts, which are hardly known. Frequencies of a copy without
# strip and of the original were predicted before the measured ones were opened. Then the contacts
# and four other unknowns are corrected by those of the original, and what two added masses do is
# foretold. The records lie in `tests/measured/`.
#
# Run: `python demos/demo_garteur.py`, in a checkout; under `mpirun` one process does the work
# Time: 50 s
# Writes: `garteur_shapes.png`, `garteur.png` into `out/`; another folder with `--out`

import argparse
import sys
from pathlib import Path

from mpi4py import MPI

import numpy as np

import rom
from rom import view
from rom.view import Panel, Scene, Thing

RECORDS = Path(__file__).parents[1] / "tests"
if not RECORDS.exists():
    raise SystemExit("the records of predictions lie in tests/measured/ of a checkout")
sys.path.append(str(RECORDS))
options = argparse.ArgumentParser(description="a test bed like an aircraft")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
finite_elements = rom.fe.model  # PETSc starts here, on all processes together
if MPI.COMM_WORLD.rank:
    raise SystemExit  # reduced parts are work for one process
from measured import garteur, garteur_update, record

options.out.mkdir(parents=True, exist_ok=True)
say = (lambda *_: None) if options.quiet else print
MESH = 50  # size of the elements [mm]
nominal = {name: value for name, (value, _) in garteur.SPREADS.items()}
drawing = {name: nominal[name] for name in ("E", "t", "b")} | {"rho": garteur.DENSITY}
elastic = drawing | {"contact": 10 ** nominal["contact"]}

# ## The parts, and the copy
#
# One element through each plate; two interfaces of a part meet as polynomials on their faces.

whole, tape = garteur.bed(MESH, strip=False, **elastic)
for name, body in whole.bodies.items():
    say(f"{name}: {body.mass:.3f} kg, {body.n_modes} coordinates, interfaces {[*body.markers]}")
mass = sum(body.mass for body in whole.bodies.values())
f, _, shapes = garteur.spectrum(whole, tape, heave=nominal["heave"])
names = garteur.paired(garteur.reference(False), garteur.seen(whole, shapes))
of_copy = dict(zip(garteur.SHAPES, names, strict=True))
copy, original = (record.compare(one) for one in (garteur.COPY, garteur.ORIGINAL))
for what, rows in (("copy", copy), ("original", original)):
    for name, row in rows.items():
        one = row.prediction
        say(f"{what}, {name:40s} {one.value:7.2f} ({one.low:.2f} to {one.high:.2f}), measured "
            f"{row.measured:7.2f}, off by {row.deviation:6.2f} %")  # fmt: skip

# ## Corrected by the frequencies of the original

found = garteur_update.original()
say(found)

# ## Two modifications, foretold

foretold = record.read("garteur_modified")
for name, one in foretold.items():
    say(f"{name:44s} {one.value:7.2f} ({one.low:.2f} to {one.high:.2f})")
