# # A shallow arch snaps through: both limit points, and the way out sideways
#
# A load that grows in steps ends where the arch has no neighbouring equilibrium any more: there it
# jumps. `rom.continuation` follows the equilibria by their arc length instead. The load may then
# fall again, unstable shapes are passed like stable ones, and every place where a stiffness
# vanishes is found: limit points, at which the load turns back, and bifurcations, at which the
# arch can leave its symmetric shape.
#
# Run: `python demos/demo_snap_through.py`
# Time: 20 s
# Writes: `snap_through.png` into `out/`; another folder with `--out`

import argparse
from pathlib import Path

from mpi4py import MPI

import numpy as np

import rom
from rom import view
from rom.components.cosserat import along, body

options = argparse.ArgumentParser(description="a shallow arch that snaps through")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
first = MPI.COMM_WORLD.rank == 0
say = print if first and not options.quiet else lambda *_: None

# ## The arch
#
# A strip of steel, bent to a half wave of the sine and pinned at both ends. The load on it is a
# half wave, too; time is the load, in newtons.

SPAN, RISE, WIDTH, SEGMENTS = 1.0, 0.010, 0.020, 24
HEIGHT = RISE * np.sqrt(12 / 30)  # rise^2 = 30 I / A
E, NU, RHO = 210e9, 0.3, 7850.0
EA, EI = E * WIDTH * HEIGHT, E * WIDTH * HEIGHT**3 / 12
GA, sideways = EA / (2 + 2 * NU), E * HEIGHT * WIDTH**3 / 12


def place(s):
    """Point and axes of the section at a station."""
    tangent = np.array([1.0, 0.0, RISE * np.pi / SPAN * np.cos(np.pi * s / SPAN)])
    tangent /= np.linalg.norm(tangent)
    axes = np.column_stack([np.cross((0, 1, 0), tangent), (0, 1, 0), tangent])
    return (s, 0.0, RISE * np.sin(np.pi * s / SPAN)), axes


strip = along(
    place, np.linspace(0.0, SPAN, SEGMENTS + 1), stretch=(GA, GA, EA), bend=(sideways, EI, EI),
    mass=RHO * WIDTH * HEIGHT, inertia=RHO * WIDTH**3 * HEIGHT / 12,
)  # fmt: skip
mech = rom.Mechanism(gravity=(0, 0, 0))
arch = mech.add_nonlinear("arch", body(strip))
mech.revolute("left", mech.ground.marker((0, 0, 0)), arch.marker("start"), axis=(0, 1, 0))
mech.revolute("right", mech.ground.marker((SPAN, 0, 0)), arch.marker("end"), axis=(0, 1, 0))
marks = {k: mech.parts[f"arch.{k}"].marker((0, 0, 0)) for k in range(1, SEGMENTS)}
share = {k: np.sin(np.pi * strip.x[k, 0] / SPAN) for k in marks}
total = sum(share.values())
for k, mark in marks.items():
    mech.force(f"load {k}", mark, lambda t, part=share[k] / total: (0, 0, -part * t))

# ## The path
#
# Q is the amplitude of the load times the span; shape f / f0 = x obeys Q / Q0 = 1 - x + c x (1 -
# x^2) with Q0 = EI (pi / L)^4 f0 L and c = f0^2 A / (4 I), as long as it stays symmetric
# (Timoshenko and Gere, Theory of Elastic Stability, section 7.7). The sum of the load is 2 Q / pi.

C = RISE**2 * EA / EI / 4
FULL = EI * (np.pi / SPAN) ** 4 * RISE * SPAN * 2 / np.pi


def load(x):
    """Sum of the load [N] at a rise x, relative to the one at the start."""
    return FULL * (1 - x + C * x * (1 - x**2))


top, side = np.sqrt((C - 1) / (3 * C)), np.sqrt(1 - 4 / C)  # of limit points and bifurcations
path = rom.continuation(mech, (0.0, 1.3 * load(top)))
rise = path.position(marks[SEGMENTS // 2])[:, 2] / RISE
say(f"{len(path.t)} equilibria")
for critical in path.critical:
    say(f"{critical.kind} at {critical.state.t:.1f} N")

# At the bifurcation another path leaves: there the arch gives way sideways, at less than its limit
# load. It is the one that a real arch, never quite symmetric, comes close to.

start = path.critical[0]
branch = rom.continuation(mech, (0.0, path.t[-1]), state=start.state, along=start.motion, n=60)
lean = branch.position(marks[SEGMENTS // 2])[:, 2] / RISE
found = {kind: [x.state.t for x in path.critical if x.kind == kind]
         for kind in ("limit", "bifurcation")}  # fmt: skip
joins = np.argmin(np.abs(branch.t - found["bifurcation"][1]))

if first:
    options.out.mkdir(parents=True, exist_ok=True)
    shapes, shown = {}, [0, *np.searchsorted(-rise, [-0.55, 0.0, 0.55]), len(rise) - 1]
    for k in shown:
        x = np.array([s[:3] for s in path.states[k].q.reshape(-1, 7)])
        shapes[f"{path.t[k]:.0f} N"] = (x[:, 0], 1e3 * x[:, 2])
    bent = branch.states[len(branch.states) // 4].q.reshape(-1, 7)
    shapes[f"sideways, {branch.t[len(branch.states) // 4]:.0f} N"] = (bent[:, 0], 1e3 * bent[:, 2])
    stable = path.unstable == 0
    inside = stable & np.roll(stable, 1) & np.roll(stable, -1)
    parts = {"stable": np.where(stable, path.t, np.nan),
             "unstable": np.where(inside, np.nan, path.t)}  # fmt: skip
    x = np.linspace(rise.min(), 1.0, 30)
    view.panels(
        [[
            view.Panel("Shapes on the path", "x [m]", "height [mm]", curves=shapes),
            view.Panel(
                "Load over rise", "rise of the crown, of that at the start [1]", "load [N]",
                curves={**{name: (rise, part) for name, part in parts.items()},
                        "sideways, unstable": (lean[:joins], branch.t[:joins])},
                points={"closed form of symmetric shapes": (x, load(x))},
            ),
        ]],
        options.out / "snap_through.png",
        title="A shallow arch snaps through",
        caption=f"A pinned strip of steel, {SPAN:g} m long, {1e3 * HEIGHT:.1f} mm high, that rises "
        f"by {1e3 * RISE:g} mm, under a load in the form of a half wave. Left: its equilibria as "
        "the load grows, falls and grows again, and one of those that are not symmetric. Right: "
        "the sum of the load against the rise of its crown, lines as found by arc length: "
        f"limit points at {found['limit'][0]:.0f} N and {found['limit'][1]:.0f} N, bifurcations at "
        f"{found['bifurcation'][0]:.0f} N and {found['bifurcation'][1]:.0f} N. Between these the "
        "symmetric arch is unstable and gives way sideways.",
    )  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.

results = {
    "upper limit load [N]": (found["limit"][0], load(top), 0.01),
    "lower limit load [N]": (found["limit"][1], load(-top), 0.02),
    "load at which it gives way sideways [N]": (found["bifurcation"][0], load(side), 0.01),
    "load at which it comes back [N]": (found["bifurcation"][1], load(-side), 0.02),
    "where the branch ends, of that load": (
        branch.t[joins] / found["bifurcation"][1], 1.0, 0.05,
    ),
}  # fmt: skip
if first:
    for name, (value, expected, tolerance) in results.items():
        print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
