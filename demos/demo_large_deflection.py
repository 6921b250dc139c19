# # Slender solids bend far: a cantilever, a clamped beam that hardens, an arch that snaps
#
# Reduced solids are linear in their frame, for deflections of some per cent. With
# `rom.Geometric` the same mesh gives a body whose energy at finite strain is a polynomial of fourth
# order in a few coordinates: it bends to 70 degrees, stretches where it is held, and snaps.
#
# Run: `python demos/demo_large_deflection.py`
# Time: 20 s
# Writes: `large_deflection.png` into `out/`; another folder with `--out`

import argparse
from pathlib import Path

from mpi4py import MPI

import numpy as np

import rom
from rom import view

options = argparse.ArgumentParser(description="slender solids that bend far")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
first = MPI.COMM_WORLD.rank == 0
say = print if first and not options.quiet else lambda *_: None
E, MESHES = 210e9, Path(__file__).parents[1] / "meshes"


def reduced(geometry, end, force, *, nu, kept, parameters, **geometric):
    """A body on its root, for a force along z at the other end."""
    return rom.reduce(
        rom.fe.model(MESHES / f"{geometry}.geo", material=rom.Material(E=E, nu=nu, rho=7850.0),
                     degree=2, parameters=parameters),
        method=rom.CraigBampton(n_modes=kept),
        interfaces={"root": "rbe3", end: "rbe3"},
        reference="root",
        nonlinear=rom.Geometric(loads={end: (0, 0, force, 0, 0, 0)}, **geometric),
        certify=False,
    )  # fmt: skip


def side_view(body, q):
    """(2, k) the upper edge at the coordinates q, from the root on [m]."""
    points = body.surface.points
    edge = np.flatnonzero(np.isclose(points[:, 1], points[:, 1].min()))
    columns = np.round(points[edge, 0], 6)
    top = [edge[columns == x][np.argmax(points[edge[columns == x], 2])] for x in np.unique(columns)]
    return (points + (body.surface.shape @ q).reshape(-1, 3))[top][:, [0, 2]].T


# ## A cantilever
#
# A hundred times as long as thick, a force across its tip. The elastica, an inextensible line, has
# these slopes and deflections over its length.

LENGTH, THICK = 1.0, 0.01
EI = E * THICK**4 / 12
ELASTICA = {0.5: (0.244534, 0.162144), 1.0: (0.461352, 0.301721), 2.0: (0.781750, 0.493457),
            5.0: (1.215368, 0.713792)}  # fmt: skip
box = {"L": LENGTH, "b": THICK, "h": THICK, "hex": 1, "ny": 1, "nz": 1}
beam = reduced("beam", "tip", 5 * EI, nu=0.0, kept=4, parameters=box | {"nx": 40}, n_shapes=15)
bent = beam.equilibria({"tip": (0, 0, EI, 0, 0, 0)}, shares=tuple(ELASTICA))
tip = beam.marker("tip")
slope, deflection = -np.arcsin(tip.rotation[1] @ bent.T), tip.translation[2] @ bent.T
for load, one, two in zip(ELASTICA, np.degrees(slope), deflection, strict=True):
    say(f"P L^2 / EI = {load}: slope {one:.2f} degrees, deflection {two:.4f} L")

# ## A beam between clamps
#
# Half of it: its middle moves across alone. It has to grow longer, and hardens. With the tension N
# and k^2 = N / EI the deflection of a line obeys w' = (P / 2N) (1 - cosh k (x - l/2) / cosh(kl/2)).

HALF, PRESSED = LENGTH / 2, 30 * EI
middle = {"tip": "xyrxryrz"}
clamped = reduced("beam", "tip", PRESSED / 2, nu=0.0, kept=4,
                  parameters=box | {"L": HALF, "nx": 16}, fixed=middle)  # fmt: skip
shares = np.linspace(0.05, 1.0, 12)
pressed = clamped.equilibria({"tip": (0, 0, PRESSED / 2, 0, 0, 0)}, shares=shares, fixed=middle)
given = clamped.marker("tip").translation[2] @ pressed.T


def closed_form(kl):
    """Force in the middle [N] and deflection there [m] at a tension (kl)^2 EI / l^2."""
    k, N, t = kl / HALF, EI * (kl / HALF) ** 2, np.tanh(kl / 2)
    squares = HALF - 3 * t / k + HALF / (2 * np.cosh(kl / 2) ** 2)
    half = N * np.sqrt(2 * HALF * N / (E * THICK**2) / squares)
    return 2 * half, half / N * (HALF - 2 * t / k)


force, known = np.array([closed_form(x) for x in np.linspace(0.05, 8, 400)]).T

# ## A shallow arch
#
# Half of one between clamps, pressed at its crown. Its range of loads leads through the snap; the
# shares at which its stiffness vanishes are those at which it snaps, and comes back.

RISE, CROWN = 0.03, 600.0
top = {"crown": "xyrxryrz"}
arch = reduced("arch", "crown", -CROWN, nu=0.3, kept=10, parameters={"nx": 16}, n_modes=7,
               tol=1e-5, fixed=top)  # fmt: skip
press = {"crown": (0, 0, -CROWN, 0, 0, 0)}
snaps = CROWN * arch.critical_loads(press, fixed=top)
up = np.r_[np.linspace(0.05, 0.85, 9), 1.0]
down = np.r_[1.0, 0.9, 0.8, 0.7, 0.6, 0.55]
down_again = arch.equilibria(press, shares=np.r_[1.0, down], fixed=top)[1:]
before = arch.equilibria(press, shares=up[:-1], fixed=top)
crown = -1e3 * arch.marker("crown").translation[2]
say(f"arch: snaps at {snaps[0]:.1f} N, comes back at {snaps[1]:.1f} N")

if first:
    options.out.mkdir(parents=True, exist_ok=True)
    beams = {f"P L^2 / EI = {load}": side_view(beam, q)
             for load, q in zip(ELASTICA, bent, strict=True)}  # fmt: skip
    arches = {f"{CROWN * share:.0f} N": 1e3 * side_view(arch, q) for share, q in (
        (0.0, 0 * before[0]), (up[-2], before[-1]), (1.0, down_again[0]))}  # fmt: skip
    view.panels(
        [[
            view.Panel("A cantilever", "x [m]", "z [m]", curves=beams, equal=True,
                       points={"tip of the elastica": tuple(
                           np.array([[1 - 0.015919, 0.162144], [1 - 0.056433, 0.301721],
                                     [1 - 0.160642, 0.493457], [1 - 0.387628, 0.713792]]).T)}),
            view.Panel("Middle of a clamped beam", "deflection over thickness [1]", "force [N]",
                       curves={"line with tension": (known / THICK, force),
                               "without": (known / THICK, 192 * EI * known / LENGTH**3)},
                       points={"reduced body": (given / THICK, PRESSED * shares)}),
        ], [
            view.Panel("Half of an arch, upper edge", "x [mm]", "z [mm]", curves=arches),
            view.Panel("Load on the arch", "deflection of the crown [mm]", "load [N]",
                       curves={"load grows": (crown @ before.T, CROWN * up[:-1]),
                               "load falls again": (crown @ down_again.T, CROWN * down),
                               f"snaps at {snaps[0]:.0f} N": ([0, 50], [snaps[0]] * 2),
                               f"comes back at {snaps[1]:.0f} N": ([0, 50], [snaps[1]] * 2)}),
        ]],
        options.out / "large_deflection.png",
        title="Slender solids that bend far",
        caption="Each is one reduced body with an energy of fourth order in its coordinates. "
        "Above: a cantilever 1 m long and 10 mm thick under a force across its tip, upper edges "
        "against the tip of the elastica; a beam 1 m long between clamps pressed in its middle, "
        "which hardens as its tension grows. Below: a clamped arch of steel with a span of 1 m, "
        "30 mm high and 10 mm thick, pressed at its crown: shapes of one half, and its stable "
        "states before it snaps and after, while the load falls again.",
    )  # fmt: skip

# ## What to remember
#
# A load range says how far a body is to bend, and its shapes are chosen for that. Numbers of the
# arch are those of the finite elements, their crown pushed down in steps.
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.

results = {
    "slope of the cantilever at P L^2 / EI = 5 [rad]": (slope[-1], ELASTICA[5.0][0], 3e-3),
    "its deflection [m]": (deflection[-1], ELASTICA[5.0][1], 3e-3),
    "deflection of the clamped beam [m]": (
        given[-1], np.interp(PRESSED, force, known), 0.01,
    ),
    "load at which the arch snaps [N]": (snaps[0], 515.4, 0.01),
    "load at which it comes back [N]": (snaps[1], 308.7, 0.02),
}  # fmt: skip
if first:
    for name, (value, expected, tolerance) in results.items():
        print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
