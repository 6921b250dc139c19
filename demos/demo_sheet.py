# # A triangle that asks its neighbours: sheets that bend and metal that flows
#
# Linear triangles are too stiff: one strain must do for the whole element. Flores takes the metric
# at the middle of each side from the two triangles that share it. The unknowns stay the same. With
# one averaged point per element (F1) metal can flow without locking; with three (F3) frequencies
# are best.
#
# Run: `python demos/demo_sheet.py`
# Time: 20 s
# Writes: `sheet.png`, `strip.png` and `taylor_bar.gif` into `out/`; another folder with `--out`

import argparse
from pathlib import Path
from time import perf_counter

from mpi4py import MPI

import numpy as np
from scipy.sparse.linalg import eigsh, spsolve

import rom
from rom import view
from rom.components.assumed_strain import Metal, fly, in_space, mass, rectangle, sheet, tangent

options = argparse.ArgumentParser(description="assumed-strain triangles")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
first = MPI.COMM_WORLD.rank == 0
say = print if first and not options.quiet else lambda *_: None
MESHES, STEEL = Path(__file__).parents[1] / "meshes", (210e9, 0.3, 7850.0)
ELEMENTS = {"CST": "ordinary (CST)", "F3": "three points (F3)", "F1": "one point (F1)"}


def dofs(where, axes=(0, 1)):
    """Dof numbers along some axes of the nodes where a condition holds."""
    return (2 * np.flatnonzero(where)[:, None] + np.array(axes)).ravel()


# ## A strip of steel as a solid
#
# 390 mm x 40 mm x 2 mm of bricks in FEniCSx, reduced: what a sheet is measured by below.

KINDS, SIZES = {"root": "rbe2", "tip": "rbe2"}, {"L": 0.39, "b": 0.04, "h": 0.002}
bricks = rom.fe.model(MESHES / "beam.geo", degree=2, material=rom.Material(*STEEL),
                      parameters=SIZES | {"hex": 1, "nx": 30, "ny": 4, "nz": 1})  # fmt: skip
solid = rom.reduce(bricks, method=rom.CraigBampton(12), interfaces=KINDS, reference="root",
                   certify=False)  # fmt: skip
if not first:
    raise SystemExit  # what follows is work for one process

# ## Cook's membrane
#
# A tapered panel, held on the left and sheared by a unit force on the right; plane stress.

membrane = {}
for element in ELEMENTS:
    for n in (2, 4, 8, 16, 32):
        X, T = rectangle((n, n), [(0, 0), (48, 44), (48, 60), (0, 44)])
        body, right = sheet(X, T, element=element), np.flatnonzero(np.isclose(X[:, 0], 48))
        f, free = np.zeros_like(X), dofs(X[:, 0] > 1e-9)
        f[right, 1] = 1 / n
        f[right[[0, -1]], 1] /= 2
        K, u = tangent(body, Metal(1.0, 1 / 3), X)[free][:, free], np.zeros(2 * len(X))
        u[free] = spsolve(K.tocsc(), f.ravel()[free])
        tip = np.abs(X - [48, 52]).sum(axis=1).argmin()
        membrane[element, n] = X, T, u.reshape(-1, 2), u[2 * tip + 1]
    say(f"{element}: " + ", ".join(f"{membrane[element, n][3]:.3f}" for n in (2, 4, 8, 16, 32)))

# ## The strip as a sheet, reduced
#
# Mass and stiffness are ordinary matrices. Triangles by gmsh go through the same chain as any other
# body: two ends as interfaces, thirty modes, a certificate. In a mechanism strip and solid are let
# go in their clamps.

mesh = rom.fe.mesh.read_triangles(MESHES / "strip.geo")
X, T = mesh.points, mesh.triangles
ends = {"root": np.flatnonzero(X[:, 0] < 0.0101), "tip": np.flatnonzero(X[:, 0] > 0.3899)}
model = in_space(sheet(X, T, thickness=0.002), Metal(*STEEL), ends)
full = rom.modes(model, 8, fixed=("root",), interfaces=KINDS).frequencies
strip = rom.reduce(model, method=rom.CraigBampton(30), interfaces=KINDS, reference="root")
error = np.abs(strip.frequencies(8, fixed=("root",)) / full - 1).max()
apart = np.abs(strip.frequencies(8, fixed=("root",)) / solid.frequencies(8, fixed=("root",)) - 1)
say(f"strip: {model.n_dofs} dofs to {strip.n_modes}, worst of eight frequencies {error:.1e}; "
    f"from the solid of {bricks.n_dofs} dofs {apart.max():.1e}")  # fmt: skip


def let_go(body):
    """Mechanism of a clamp and a body, and its motion under its own weight.

    Markers of the sheet sit in the middles of its ends, 5 mm from where they leave the strip.
    """
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    clamped = mech.add_flexible("strip", body, at=-np.asarray(body.marker("root").point))
    mech.fixed("clamp", mech.ground.marker((0, 0, 0)), clamped.marker("root"))
    return mech, rom.simulate(mech, t_end=0.25, dt=5e-4)


def sag(x, L=0.39):
    """Of a clamped beam under its weight at a distance from the clamp [m]."""
    w = 12 * 7850 * 9.81 / (210e9 * 0.002**2)  # weight per length over bending stiffness
    return -w * x**2 * (6 * L**2 - 4 * L * x + x**2) / 24


swings = {name: let_go(body) for name, body in (("sheet", strip), ("solid", solid))}
tips = {name: sol.position("strip", "tip")[:, 2] for name, (_, sol) in swings.items()}
for name, z in tips.items():
    say(f"{name}: lowest {1e3 * z.min():.3f} mm")
X, T = rectangle((40, 4), [(0, 0), (100, 0), (100, 10), (0, 10)])
cantilever, free = {}, dofs(X[:, 0] > 1e-9)
for element in ELEMENTS:
    body, metal = sheet(X, T, element=element), Metal(2.1e4, 0.3, 8e-10)
    K, M = (A[free][:, free] for A in (tangent(body, metal, X), mass(body, metal)))
    cantilever[element] = np.sqrt(eigsh(K, 2, M, sigma=0.0)[0]) / (2 * np.pi)
    say(f"cantilever, {element}:", *(f"{f:8.1f}" for f in cantilever[element]), "Hz")

# ## Taylor's bar
#
# A copper cylinder, 32.4 mm long, hits a rigid wall at 227 m/s. Half of it is computed, axially
# symmetric; explicit steps, no friction at the wall.

R, L, speed = 3.2e-3, 32.4e-3, 227.0
X, T = rectangle((5, 50), [(0, 0), (R, 0), (R, L), (0, L)])
copper = Metal(117e9, 0.35, 8930.0, yield_stress=400e6, hardening=100e6)
body = sheet(X, T, element="F1", state="axisymmetric")
held = np.concatenate([dofs(X[:, 0] < 1e-9, (0,)), dofs(X[:, 1] < 1e-9, (1,))])
clock = perf_counter()
flight = fly(body, copper, np.tile([0.0, -speed], (len(X), 1)), held, 80e-6)
end, strain = flight.x[-1], flight.plastic[..., 0]
say(f"Taylor bar: {flight.steps} steps in {perf_counter() - clock:.1f} s; "
    f"{1e3 * end[:, 1].max():.3f} mm long, foot of {1e3 * end[:, 0].max():.3f} mm, "
    f"plastic strain up to {strain.max():.2f}")  # fmt: skip


other = np.where(X[:, 0] > 1e-9, len(X), 0) + np.arange(len(X))  # the axis belongs to both halves


def whole(k):
    """Both halves of the bar in picture k."""
    half, mirror = flight.x[k], np.array([-1.0, 1.0])
    return view.Shape(
        f"Taylor's bar after {1e6 * flight.t[k]:.0f} \u00b5s",
        np.vstack([half, half * mirror]), np.vstack([T, other[T]]),
        np.vstack([X, X * mirror]), np.tile(strain[k], 2), "plastic strain", 300,
    )  # fmt: skip


options.out.mkdir(parents=True, exist_ok=True)
mech, sol = swings["sheet"]
view.panels(
    [[view.posed(mech, sol, sol.t[tips["sheet"].argmin()], title="At its lowest",
                 magnify=10.0),
      view.Panel("Swing of the tip", "time [s]", "height [mm]",
                 {name: (sol.t, 1e3 * z) for name, z in tips.items()})]],
    options.out / "strip.png", title="A strip of steel in a clamp",
    caption="390 mm x 40 mm x 2 mm, let go at rest under its weight; left the deflection ten times "
    "larger. Sheet: triangles by gmsh, bending after Morley, thirty-six coordinates. Solid: bricks "
    "by FEniCSx, reduced as well.",
)  # fmt: skip
X_c, T_c, u, _ = membrane["F3", 8]
sizes = (2, 4, 8, 16, 32)
view.deformed(
    {name: (sizes, [membrane[e, n][3] for n in sizes]) for e, name in ELEMENTS.items()},
    [view.Shape("Cook's membrane, 8 x 8", X_c + u, T_c, X_c), whole(-1)],
    options.out / "sheet.png",
    limit=("converged", 23.965),
    xlabel="divisions of each side",
    ylabel="deflection of the tip [unit of length]",
    title="Triangles that ask their neighbours",
    heading="Deflection of Cook's membrane, by mesh",
    caption="Left: deflection of a tapered panel, 48 units of length wide, held on its left and "
    "sheared by a unit force on its right, for the same unknowns; ordinary triangles are far too "
    "stiff on coarse meshes. Middle: that panel, drawn to scale; dashed: before. Right: the "
    "section of a copper bar, 32.4 mm long and 6.4 mm thick, after it hit a wall at 227 m/s, "
    "computed with F1 on half its section; its foot has flowed to more than twice its radius.",
)
view.flow(
    flight.t,
    [whole(k) for k in range(len(flight.t))],
    options.out / "taylor_bar.gif",
    caption="Section of a copper cylinder, 32.4 mm long, that hits a rigid wall at 227 m/s; "
    "drawn to scale, dashed: before.",
)

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.
# F1 for plastic flow, F3 for elastic and modal work; F1 frequencies are too low.

results = {
    "tip of Cook's membrane, F3, 32 divisions": (membrane["F3", 32][3], 23.9035, 5e-5),
    "tip of Cook's membrane, F1, 8 divisions": (membrane["F1", 8][3], 23.965, 0.01),
    "first frequency, F3 [Hz], quadratic elements": (cantilever["F3"][0], 822.10, 0.01),
    "second frequency, F3 [Hz], quadratic elements": (cantilever["F3"][1], 4931.8, 0.01),
    "worst frequency ratio of the reduced strip": (1 + error, 1.0, 1e-3),
    "worst frequency of sheet over solid": (1 + apart.max(), 1.0, 0.012),
    "deepest swing, sheet over solid": (
        tips["sheet"].min() / tips["solid"].min(), sag(0.385) / sag(0.39), 0.01),
    "deepest swing over twice the deflection at rest": (
        tips["sheet"].min() / (2 * sag(0.385)), 1.0, 0.01),
    "length of Taylor's bar [mm]": (1e3 * end[:, 1].max(), 21.4, 0.01),
    "radius of its foot [mm]": (1e3 * end[:, 0].max(), 6.9, 0.03),
    "energy of the impact that was spent": (
        flight.work / (0.5 * mass(body, copper).sum() / 2 * speed**2), 1.0, 0.02),
}  # fmt: skip
for name, (value, expected, tolerance) in results.items():
    print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
