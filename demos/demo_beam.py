# # A steel beam: how many modes, which support, which frame?
#
# A beam is reduced to its two end faces plus m fixed-interface modes. One reduced body serves every
# support: free, clamped at one end, clamped at both. Its floating frame can be chosen afterwards;
# that changes the coordinates and no frequency.
#
# Run: `python demos/demo_beam.py`, or under `mpirun -n 2`
# Time: 15 s
# Writes: `beam_modes.png` and `beam_frequencies.png` into `out/`; another folder with `--out`

import argparse
from pathlib import Path

from mpi4py import MPI

import numpy as np

import rom
from rom import view

options = argparse.ArgumentParser(description="a reduced beam in three supports")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
first = MPI.COMM_WORLD.rank == 0
say = print if first and not options.quiet else lambda *_: None

# ## The body
#
# Length 1 m, section 50 mm x 30 mm, quadratic tetrahedra. `root` and `tip` are the physical
# surfaces of `meshes/beam.geo`; rbe2 makes each of them rigid.

L, b, h, E, rho = 1.0, 0.05, 0.03, 210e9, 7850.0
model = rom.fe.model(
    Path(__file__).parents[1] / "meshes" / "beam.geo",
    material=rom.Material(E=E, nu=0.3, rho=rho),
    parameters={"L": L, "b": b, "h": h, "lc": 0.02},
)
kinds = {"root": "rbe2", "tip": "rbe2"}
supports = {"free": (), "cantilever": ("root",), "clamped at both ends": ("root", "tip")}
full = {
    name: rom.modes(model, 10, fixed=fixed, interfaces=kinds).frequencies
    for name, fixed in supports.items()
}
say(f"{model.n_dofs} dofs, {model.mass():.4f} kg")

# ## One reduced body, three supports
#
# The error falls with every mode, and reduced frequencies are never below full ones.

worst = {}
for m in (0, 4, 8, 24):
    body = rom.reduce(
        model, method=rom.CraigBampton(n_modes=m), interfaces=kinds, reference="root",
        name="beam", certify=m == 24,
    )  # fmt: skip
    for name, fixed in supports.items():
        n_rigid = 0 if fixed else 6
        reduced = body.frequencies(n_rigid + 4, fixed=fixed)[n_rigid:]
        reference = full[name][n_rigid : n_rigid + reduced.size]
        worst[m, name] = np.abs(reduced / reference - 1).max() if reduced.size else np.inf
        say(f"m = {m:2d}, {name:20s}: worst error of {reduced.size} modes {worst[m, name]:8.1e}")

# ## The frame is a choice
#
# With the frame held still each reference condition has other frequencies: those of the beam
# clamped at the root, on pins, or seen from its mean axes. Supports of the body do not care.

frames = {label: body.with_reference(label) for label in ("root", "mean-axis", ("root", "tip"))}
for label, seen in frames.items():
    held = seen.omega[:3] / (2 * np.pi)
    say(f"frame {label!s:20s}: held still", *(f"{f:8.2f}" for f in held), "Hz")
cantilever = np.array([seen.frequencies(4, fixed=("root",)) for seen in frames.values()])

if first:
    options.out.mkdir(parents=True, exist_ok=True)
    view.mode_shapes(body, options.out / "beam_modes.png", fixed=("root",))
    view.frequencies(
        body.provenance["comparison"],
        options.out / "beam_frequencies.png",
        title="Beam, 24 fixed-interface modes",
        beside=view.Scene("Its mesh and interfaces", view.meshed(model), view=(-0.5, 0.4, 0.9)),
    )

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.
# Closed forms are those of Euler and Bernoulli; shear and rotary inertia lower them by less than a
# per cent at this slenderness.

root_EI = np.sqrt(E * h**2 / (12 * rho)) / (2 * np.pi * L**2)
results = {
    "mass [kg]": (model.mass(), rho * L * b * h, 1e-9),
    "first frequency, free [Hz]": (full["free"][6], 4.730041**2 * root_EI, 0.01),
    "first frequency, cantilever [Hz]": (full["cantilever"][0], 1.875104**2 * root_EI, 0.01),
    "first frequency, clamped at both ends [Hz]": (
        full["clamped at both ends"][0], 4.730041**2 * root_EI, 0.02),
    "worst frequency ratio, m = 24": (1 + max(worst[24, s] for s in supports), 1.0, 1e-3),
    "cantilever seen from three frames": (np.ptp(cantilever, axis=0).max() + 1, 1.0, 1e-6),
}  # fmt: skip
if first:
    for name, (value, expected, tolerance) in results.items():
        print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
