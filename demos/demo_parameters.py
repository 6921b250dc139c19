# # A sandwich panel: what does its core decide?
#
# Reduced once, a panel of two faces and a core is swept over the modulus and the thickness of its
# core, a hundred panels each. Stiffness and mass are sums of terms with known factors, so that no
# sweep returns to the finite elements. Beside the curves stand models meshed and assembled anew.
#
# Run: `python demos/demo_parameters.py`, or under `mpirun -n 2`
# Time: 20 s
# Writes: `parameters.png` into `out/`; another folder with `--out`

import argparse
from dataclasses import replace
from pathlib import Path
from time import perf_counter

from mpi4py import MPI

import numpy as np

import rom
from rom import view

options = argparse.ArgumentParser(description="a sandwich panel swept over its core")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
first = MPI.COMM_WORLD.rank == 0
say = print if first and not options.quiet else lambda *_: None

# ## The panel
#
# 400 mm x 100 mm, a foam core of 20 mm between aluminium faces of 2 mm; `core` and `faces` are the
# physical volumes of `meshes/sandwich.geo`. Both ends are rigid, the root is clamped.

FOAM, ALLOY = rom.Material(E=70e6, nu=0.3, rho=60.0), rom.Material(E=70e9, nu=0.33, rho=2700.0)
kinds, clamped, n = {"root": "rbe2", "tip": "rbe2"}, ("root",), 4


def panel(E=1.0, t=1.0):
    """The full model for a core of E times the modulus and t times the thickness."""
    return rom.fe.model(
        Path(__file__).parents[1] / "meshes" / "sandwich.geo",
        material={"core": replace(FOAM, E=E * FOAM.E), "faces": ALLOY},
        parameters={"nx": 6, "ny": 2, "core": 0.02 * t},
    )


# ## One reduction

start = perf_counter()
family = rom.reduce_parametric(
    panel(),
    parameters={
        "E": rom.YoungsModulus("core", 0.2, 20.0),
        "t": rom.Thickness("core", 0.5, 2.0),
    },
    method=rom.CraigBampton(16),
    interfaces=kinds,
    name="panel",
    tol=5e-3,
    certify=False,
)
say(f"{family}\nreduced in {perf_counter() - start:.1f} s")

# ## Two hundred panels, and some of them meshed anew

start = perf_counter()
E, t = np.geomspace(0.2, 20.0, 100), np.linspace(0.5, 2.0, 100)
over_E = np.array([family.frequencies(n, fixed=clamped, E=x) for x in E])
over_t = np.array([family.frequencies(n, fixed=clamped, t=x) for x in t])
say(f"{E.size + t.size} panels in {perf_counter() - start:.1f} s")

points = [{"E": 0.4}, {"E": 8.0}, {"t": 0.6}, {"t": 1.8}, {"E": 3.0, "t": 1.4}]
worst, above = 0.0, np.inf
for point in points:
    full = rom.modes(panel(**point), n, fixed=clamped, interfaces=kinds).frequencies
    error = family.frequencies(n, fixed=clamped, **point) / full - 1
    worst, above = max(worst, np.abs(error).max()), min(above, error.min())
    say(f"{point}: full {np.round(full, 2)} Hz, errors", *(f"{e:.1e}" for e in error))

# ## The picture


def layers(core, face):
    """Core and faces of a panel that ends in a clamp."""
    size, outside = (0.4, 0.1), (core + face) / 2
    faces = [view.box((*size, face), (0.2, 0, z)) for z in (-outside, outside)]
    return {
        "foam": view.Thing(*view.box((*size, core), (0.2, 0, 0)), "#edae49"),
        "aluminium": view.Thing(*view.joined(faces), "#c3c9d0"),
        "clamp": view.Thing(*view.box((0.03, 0.13, 0.06), (-0.015, 0, 0)), "#5c636e"),
    }


if first:
    options.out.mkdir(parents=True, exist_ok=True)
    names = [f"mode {k + 1}" for k in range(n)]
    view.history(
        t * 20.0,
        [
            ("frequency [Hz]", dict(zip(names, over_t.T, strict=True))),
            ("frequency / that of a 20 mm core", dict(zip(names, (over_t / family.frequencies(
                n, fixed=clamped)).T, strict=True))),
        ],
        options.out / "parameters.png",
        over="thickness of the core [mm]",
        beside=view.Scene("The panel with a core of 20 mm", layers(0.02, 0.002),
                          view=(1.0, -0.8, 0.7), up=(0, 0, 1)),
        title="A sandwich panel, one end clamped, swept over the thickness of its core",
        caption="Natural frequencies of a hundred panels of 400 mm x 100 mm, one end clamped, "
        "a core of foam between faces of aluminium of 2 mm, from one reduced model: in hertz, and "
        "as multiples of those of the nominal panel. Modes are numbered by frequency; curves kink "
        "where two of them change places.",
    )  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.
# Mass and inertia are those of boxes at any thickness; frequencies are never below full ones.

body = family.at(t=1.5)
core, faces = 0.4 * 0.1 * 0.030 * 60.0, 0.4 * 0.1 * 0.004 * 2700.0
square = core * 0.03**2 / 12 + faces * (0.034**3 - 0.03**3) / 0.004 / 12
results = {
    "mass [kg]": (body.mass, core + faces, 1e-10),
    "inertia about the long axis [kg m^2]": (
        body.inertia[0, 0], (core + faces) * 0.1**2 / 12 + square, 1e-9),
    "worst ratio to panels meshed anew": (1 + worst, 1.0, 5e-3),
    "reduced never below full": (1 + min(above, 0.0), 1.0, 1e-7),
    "a stiffer core never lowers the first frequency": (
        float(np.mean(np.diff(over_E[:, 0]) > 0)), 1.0, 1e-12),
}  # fmt: skip
if first:
    for name, (value, expected, tolerance) in results.items():
        print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
