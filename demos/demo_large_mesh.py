# # A large mesh: the housing of a gear unit on several processes
#
# A thin-walled housing with four bearing seats and four feet is reduced twice, on a coarse and on
# a fine mesh. The fine one is what `mpirun` is for: rows of the matrices, of the factor and of the
# modes live on different processes. `--million` makes a million dofs of it.
#
# Run: `python demos/demo_large_mesh.py`, or `mpirun -n 2 python demos/demo_large_mesh.py --million`
# Time: 1.5 min
# Writes: `housing_mesh.png` and `housing_modes.png` into `out/`; another folder with `--out`

import argparse
import resource
from math import pi
from pathlib import Path
from time import perf_counter

from mpi4py import MPI

import numpy as np

import rom
from rom import view

parser = argparse.ArgumentParser(description="a gear housing on a coarse and on a fine mesh")
parser.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
parser.add_argument("--lc", type=float, nargs=2, default=(0.016, 0.012), help="element sizes [m]")
parser.add_argument("--million", action="store_true", help="a million dofs; 16 GB and some minutes")
parser.add_argument("--solver", default="auto", help="of the fine mesh, see rom.fe.model")
parser.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = parser.parse_args()
comm = MPI.COMM_WORLD
first = comm.rank == 0
say = print if first and not options.quiet else lambda *_: None

# ## One geometry, two meshes
#
# Grey cast iron. Each bearing seat becomes a rigid ring (rbe2); the four feet together follow
# linear functions, so that the ground may also strain them.

GREY_IRON = rom.Material(E=110e9, nu=0.27, rho=7200.0)
SEATS = ("input_front", "input_back", "output_front", "output_back")
KINDS = {seat: "rbe2" for seat in SEATS} | {"feet": rom.Polynomial(1)}
GEOMETRY = Path(__file__).parents[1] / "meshes" / "housing.geo"


def gigabytes() -> float:
    """Peak memory of all processes."""
    return comm.allreduce(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss) / 1024**2


bodies = {}
for mesh, lc, solver in (
    ("coarse", options.lc[0], "direct"),
    ("fine", 0.00475 if options.million else options.lc[1], options.solver),
):
    clock = perf_counter()
    model = rom.fe.model(GEOMETRY, material=GREY_IRON, parameters={"lc": lc}, solver=solver)
    meshed = perf_counter()
    bodies[mesh] = rom.reduce(
        model, method=rom.CraigBampton(60), interfaces=KINDS, name="housing", certify=False
    )
    done = perf_counter()
    say(
        f"{mesh:6s}: {model.n_dofs} dofs, {meshed - clock:.1f} s to mesh and assemble, "
        f"{done - meshed:.1f} s to reduce to {bodies[mesh].n_modes} coordinates, "
        f"{gigabytes():.1f} GiB at most on {comm.size} process(es)"
    )

# ## Full against reduced
#
# The same support, the same kinds of interfaces, another eigensolver.

clock = perf_counter()
full = rom.modes(model, 6, fixed=("feet",), interfaces=KINDS).frequencies
reduced = {mesh: body.frequencies(6, fixed=("feet",)) for mesh, body in bodies.items()}
say(f"full modes on the feet: {perf_counter() - clock:.1f} s, {gigabytes():.1f} GiB at most")
say("mode  coarse [Hz]    fine [Hz]  fine, full [Hz]   reduced over full - 1")
for k, f in enumerate(full):
    say(f"{k + 1:4d} {reduced['coarse'][k]:12.4f} {reduced['fine'][k]:12.4f} {f:16.4f}"
        f" {reduced['fine'][k] / f - 1:20.1e}")  # fmt: skip

if first:
    options.out.mkdir(parents=True, exist_ok=True)
    look = {"view": (0.5, -1.0, 1.1), "up": (0, 0, 1)}
    view.mesh(model, options.out / "housing_mesh.png", title="Gear housing, fine mesh", **look)
    view.mode_shapes(bodies["fine"], options.out / "housing_modes.png", fixed=("feet",), **look)

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.
# The volume is that of the drawing; the meshes cut the corners of its circles.

L, W, H, t, z_s, l_s, t_r, b_f, h_f = 0.36, 0.20, 0.20, 0.008, 0.11, 0.030, 0.008, 0.040, 0.012
volume = L * W * H - (L - 2 * t) * (W - 2 * t) * (H - t) + 4 * b_f**2 * (h_f + 0.75 * t)
for bore in (0.052, 0.072):
    radius = bore / 2 + 0.012
    half = t_r / 2  # of a rib; it ends where the seat begins
    segment = half * np.sqrt(radius**2 - half**2) + radius**2 * np.arcsin(half / radius)
    below = t_r * (z_s - t) - segment
    volume += 2 * (l_s - t) * (pi * radius**2 + below) - 2 * l_s * pi * bore**2 / 4
properties = rom.mass_properties(model)
results = {
    "mass [kg]": (model.mass(), GREY_IRON.rho * volume, 5e-3),
    "mass centre off the middle, y [m], + 1": (1 + properties.centre[1], 1.0, 1e-4),
    "worst of six frequencies on the feet, reduced over full": (
        (reduced["fine"] / full).max(), 1.0, 1e-3),
    "reduced never below full": ((reduced["fine"] / full).min().clip(max=1.0), 1.0, 1e-8),
    "first frequency, coarse over fine": (reduced["coarse"][0] / reduced["fine"][0], 1.0, 0.02),
}  # fmt: skip
if first:
    for name, (value, expected, tolerance) in results.items():
        print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
