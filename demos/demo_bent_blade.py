# # A bent fan blade: rotation straightens it, heat softens it
#
# Centrifugal force on a straight blade is tension, and the stress of the linear solid says how much
# it stiffens. A bent blade is straightened, by a third of its length here: its shape, the stress in
# it and its vibrations then follow from large displacements. Heat between two supports does the
# opposite of tension, until the blade buckles.
#
# Run: `python demos/demo_bent_blade.py`, or under `mpirun -n 2`
# Time: 1 min
# Writes: `bent_blade.png` into `out/`; another folder with `--out`

import argparse
from pathlib import Path

from mpi4py import MPI

import numpy as np

import rom
from rom import view
from rom.components import cosserat

options = argparse.ArgumentParser(description="prestress of a bent blade")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
first = MPI.COMM_WORLD.rank == 0
say = print if first and not options.quiet else lambda *_: None
MESHES = Path(__file__).parents[1] / "meshes"

# ## The blade
#
# A strip of aluminium, bent by 60 degrees out of the plane of rotation, clamped at a radius of
# 100 mm. `rom.spin_up` brings it to its speed in nine steady states; between them the full solid
# finds its own state, and the reduced one interpolates.

E, rho, R, L, b, h = 70e9, 2700.0, 0.1, 0.5, 0.03, 0.004
TOP = 2 * np.pi * 22
model = rom.fe.model(
    MESHES / "bent_blade.geo", material=rom.Material(E=E, nu=0.0, rho=rho),
    parameters={"r": R, "L": L, "bend": 60, "b": b, "h": h, "nl": 24}, comm=MPI.COMM_SELF,
)  # fmt: skip
blade = rom.held_solid(model, fixed=("root",), axis=(0, 0, 1))
linear = rom.rotating_sector(blade, model)
run_up = rom.spin_up(blade, model, speed=TOP, n_states=9)
small = run_up.reduced(8)
say(f"{model.n_dofs} dofs, {small.sectors[0].n} reduced; between states off by {small.error:.1e}")

# The same blade as a geometrically exact rod, a model that shares nothing with the solid.

radius, thin, wide = L / np.radians(60), b * h**3 / 12, h * b**3 / 12


def place(s):
    c, t = np.cos(s / radius), np.sin(s / radius)
    return (R + radius * t, 0, radius * (1 - c)), np.array([[t, 0, -c], [0, 1, 0], [c, 0, t]]).T


rod = cosserat.along(
    place, np.linspace(0, L, 41), stretch=E * b * h * np.array([5 / 12, 5 / 12, 1]),
    bend=(E * wide, E * thin, E / 2 * 4 * thin * (1 - 0.63 * h / b)), mass=rho * b * h,
    inertia=(rho * wide, rho * thin, rho * (thin + wide)),
)  # fmt: skip
speeds = np.linspace(0.0, 1.0, 7)[1:] * TOP
table, tips = [], []
say(" 1/min  first frequency [Hz]: rod, solid, reduced, linear stress; tip moved [mm]")
for speed in speeds:
    spin = (0, 0, speed)
    shape = cosserat.equilibrium(rod, cosserat.loads(rod), spin=spin)
    exact = cosserat.modes(rod, shape, 3, spin=spin).frequencies
    found = [exact, *(wave.frequencies for wave in (
        run_up.waves(3, speed=speed), small.waves(3, speed=speed),
        rom.travelling_modes(linear, 0, 3, speed=speed)))]  # fmt: skip
    u = run_up.displacement(speed).reshape(-1, 3)[model.interfaces["tip"].nodes].mean(axis=0)
    table.append(found)
    tips.append((np.linalg.norm(u), np.linalg.norm(shape.x[-1] - rod.x[-1])))
    say(f"{30 * speed / np.pi:6.0f}", *(f"{f[0]:9.3f}" for f in found), f"{1e3 * tips[-1][0]:9.1f}")
table, tips = np.array(table), np.array(tips)  # (speeds, models, modes)

# ## Heat between two supports
#
# Held at both ends and heated, a straight bar buckles at P_cr = 4 pi^2 E I / L^2 with
# P = E A alpha dT; the square of its lowest frequency falls to zero there.

ALPHA, T = 23e-6, 0.006
bar = rom.fe.model(
    MESHES / "beam.geo", material=rom.Material(E=E, nu=0.0, rho=rho), comm=MPI.COMM_SELF,
    parameters={"L": L, "b": b, "h": T, "hex": 1, "nx": 30, "ny": 1, "nz": 1},
)  # fmt: skip
ends = ("root", "tip")
critical = rom.thermal_buckling(bar, rom.Heat(ALPHA, 1.0), fixed=ends)
shares = np.array([-0.5, 0.0, 0.2, 0.5, 0.8, 0.95, 0.999])
heats = [rom.Heat(ALPHA, share * critical) for share in shares]
warm = [rom.modes(rom.heated(bar, heat, fixed=ends), 1, fixed=ends).frequencies[0]
        for heat in heats]  # fmt: skip
euler = 4 * np.pi**2 * T**2 / (12 * L**2) / ALPHA
cold = warm[1]
say(f"the bar buckles {critical:.2f} K above the temperature it was clamped at; Euler: {euler:.2f}")
body = rom.reduce(
    rom.heated(bar, heats[2], fixed=ends), method=rom.CraigBampton(n_modes=12),
    interfaces=dict.fromkeys(ends, "rbe2"), certify=False,
)  # fmt: skip
reduced_warm = body.frequencies(fixed=ends)[0]

if first:
    options.out.mkdir(parents=True, exist_ok=True)
    turns = 30 * speeds / np.pi
    fine = np.linspace(speeds[0], TOP, 40)
    between = [small.waves(1, speed=speed).frequencies[0] for speed in fine]
    tip = model.interfaces["tip"].nodes
    way = [np.linalg.norm(run_up.displacement(s).reshape(-1, 3)[tip].mean(axis=0)) for s in fine]
    campbell = view.Panel(
        "First frequency, seen from the blade", "speed [1/min]", "frequency [Hz]",
        curves={"large displacement": (30 * fine / np.pi, between),
                "linear stress": (turns, table[:, 3, 0])},
        points={"geometrically exact rod": (turns, table[:, 0, 0])},
    )  # fmt: skip
    moved = view.Panel(
        "Displacement of the tip", "speed [1/min]", "displacement [mm]",
        curves={"solid": (30 * fine / np.pi, 1e3 * np.array(way))},
        points={"geometrically exact rod": (turns, 1e3 * tips[:, 1])},
    )  # fmt: skip
    heated = view.Panel(
        "Clamped bar, heated", "temperature change [K]", "square of frequency, cold = 1",
        curves={"1 - dT / dT_cr": (shares * critical, 1 - shares)},
        points={"solid": (shares * critical, np.square(warm) / cold**2)},
    )  # fmt: skip
    X, faces = model.points[model.surface.nodes], model.surface.triangles
    away = run_up.displacement(speeds[-1]).reshape(-1, 3)[model.surface.nodes]
    turning = view.Scene(
        "The blade and its axis", {
            "at rest": view.Thing(X, faces, "#9aa5b1"),
            f"at {turns[-1]:.0f} 1/min": view.Thing(X + away, faces, "#2f7f9f"),
            "axis": view.Thing(*view.cylinder((0, 0, -0.05), (0, 0, 0.3), 0.02), "#5c636e"),
        }, view=(0.25, -1.0, 0.25), up=(0, 0, 1))  # fmt: skip
    view.panels(
        [[turning, campbell], [moved, heated]], options.out / "bent_blade.png",
        title="A bent blade that rotation straightens, and a bar that heat buckles",
        caption=f"An aluminium strip of {1e3 * L:.0f} x {1e3 * b:.0f} x {1e3 * h:.0f} mm, bent by "
        "60 degrees, turns with its root 100 mm from the axis. Top left: in true size. Top "
        "right: its first frequency by the solid about its true steady state, by the stress of "
        "the linear solid, and by a rod. Bottom left: how far its tip has moved from where it "
        "rests. Bottom right: a bar held at both ends; the line is exact for a beam that buckles "
        "in the shape it vibrates in, which a clamped one nearly does.",
    )  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.

rod_1, solid_1, reduced_1, linear_1 = table[:, :, 0].T
results = {
    "mass [kg]": (model.mass(), rho * b * h * L, 1e-3),
    "frequency 1, worst against the rod": (1 + np.abs(solid_1 / rod_1 - 1).max(), 1.0, 5e-3),
    "frequency 3, worst against the rod": (
        1 + np.abs(table[:, 1, 2] / table[:, 0, 2] - 1).max(), 1.0, 1e-2),
    "displacement of the tip against the rod": (tips[-1, 0], tips[-1, 1], 5e-3),
    "frequency 1, reduced against full": (1 + np.abs(reduced_1 / solid_1 - 1).max(), 1.0, 5e-4),
    "what linear stress finds of frequency 1 at the top": (linear_1[-1] / rod_1[-1], 0.75, 0.05),
    "buckling temperature of the bar [K]": (critical, euler, 5e-3),
    "square of its frequency at half of that": (np.square(warm[3] / cold), 0.5, 0.03),
    "reduced warm bar": (reduced_warm, warm[2], 1e-4),
}  # fmt: skip
if first:
    for name, (value, expected, tolerance) in results.items():
        print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
