# # A bladed disk: one sector in the computer, the whole wheel in the diagrams
#
# 24 titanium blades on a disk. Only one sector is meshed; the wheel falls apart into waves with n
# nodal diameters, each a problem of the size of a sector, and after reduction of 168 dofs.
# Rotation adds stress, spin softening and Coriolis forces. The Campbell diagram then says which
# speeds to avoid, and the interference (SAFE) diagram which resonances really answer: a disturbance
# with E lobes around the circumference meets only waves with E nodal diameters.
#
# Run: `python demos/demo_bladed_disk.py`, or under `mpirun -n 2`
# Time: 30 s
# Writes: `bladed_disk_modes.png` and `bladed_disk_diagrams.png` into `out/`; another folder with
# `--out`

import argparse
from pathlib import Path
from time import perf_counter

from mpi4py import MPI

import numpy as np

import rom
from rom import view

options = argparse.ArgumentParser(description="waves, Campbell and SAFE diagram of a bladed disk")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
first = MPI.COMM_WORLD.rank == 0
say = print if first and not options.quiet else lambda *_: None

# ## The sector
#
# Its number of sectors follows from the angle between its cyclic faces. Rotation needs the stress
# of centrifugal force, from the finite elements; everything else follows from the mass matrix.

model = rom.fe.model(
    Path(__file__).parents[1] / "meshes" / "bladed_disk.geo",
    material=rom.Material(E=114e9, nu=0.33, rho=4430.0),
    parameters={"width": 0.016, "chord": 0.015, "chord_tip": 0.012, "t": 0.003, "t_tip": 0.002,
                "stagger": 20, "lc": 0.010, "lc_blade": 0.0065},
)  # fmt: skip
full = rom.CyclicSector.from_model(model, fixed=("bore",))
full = rom.rotating_sector(full, model)
clock = perf_counter()
sector = rom.reduce_sector(full, n_modes=60, functions=rom.Polynomial(7))
say(f"{full.n_sectors} sectors of {full.n} dofs, wheel of {full.n_wheel}; reduced to "
    f"{sector.free.size} per sector in {perf_counter() - clock:.1f} s")  # fmt: skip

# ## Families of modes
#
# The sector is reduced once for all nodal diameters. The ten lowest frequencies of each are
# compared with the full sector, whose inertia counts prove that no mode is missing; processes share
# the diameters.

F, TEN = 4, 10
ten = np.array([modes.frequencies for modes in rom.wheel_modes(sector, TEN)])
at_rest = ten[:, :F]
ratio = ten / [modes.frequencies for modes in rom.wheel_modes(full, TEN)]
worst, lowest = ratio.max(), ratio.min()
say("diameters  frequencies at rest [Hz]          error of the reduction, ten families")
for n in sector.diameters:
    say(f"{n:9d}", *(f"{f:9.2f}" for f in at_rest[n]), f"{ratio[n].max() - 1:12.1e}")

# ## Speed
#
# Waves with and against the rotation, seen from the wheel, for three numbers of nodal diameters;
# from speed to speed each is the one whose shape is most like it, so that lines may cross.

TOP = 2 * np.pi * 300
speeds = np.linspace(0.0, TOP, 7)
waves = {}
for n in (1, 2, 3):
    found = rom.wheel_campbell(sector, n, 4, speeds=speeds)
    waves[n, "forward"], waves[n, "backward"] = found.forward, found.backward
say(f"at {30 * TOP / np.pi:.0f} 1/min  forward and backward [Hz]")
for n in (1, 2, 3):
    ahead, back = (waves[n, label][-1] for label in ("forward", "backward"))
    say(f"{n:9d}", *(f"{f:9.2f} {b:9.2f}" for f, b in zip(ahead, back, strict=True)))
whole, small = (rom.travelling_modes(one, 2, 4, speed=TOP) for one in (full, sector))
spinning = np.abs(small.omega / whole.omega - 1).max()

# ## Interference
#
# At running speed a disturbance with E lobes has the frequency E Omega and the wave number E, which
# the blades see as n = E, N - E, E - N, ...: the line folds back at N / 2. Where it hits a family
# at the right n, the wheel resonates.

RUN = 2 * np.pi * 180
N, half = full.n_sectors, full.n_sectors // 2
running = np.array([modes.frequencies for modes in rom.wheel_modes(sector, F, speed=RUN)])
orders = np.arange(N + 1)
folded = half - np.abs(half - orders)
gap = running[folded, :] / np.maximum(orders * RUN / (2 * np.pi), 1e-9)[:, None] - 1
danger = [(E, folded[E], k + 1, running[folded[E], k])
          for E, k in zip(*np.nonzero(np.abs(gap) < 0.05), strict=True)]  # fmt: skip
for E, n, k, f in danger:
    say(f"engine order {E} meets family {k} with {n} nodal diameters at {f:.0f} Hz")

# ## Pictures

if first:
    options.out.mkdir(parents=True, exist_ok=True)
    drawn = {}
    for n, k in ((2, 0), (2, 1), (3, 1), (8, 2)):
        modes = rom.cyclic_modes(sector, n, F)
        name = f"{n} nodal diameters, family {k + 1}: {modes.frequencies[k]:.4g} Hz"
        drawn[name] = modes.on_wheel()[:, :, k]
    view.wheel_modes(
        model, drawn, options.out / "bladed_disk_modes.png", view=(0.5, -0.6, 1.0),
        title=f"Modes of a bladed disk of {N} sectors",
        caption=f"Waves of a titanium wheel held at its bore, from one sector of "
        f"{sector.free.size} coordinates.",
    )  # fmt: skip
    turns = 30 * speeds / np.pi
    curves = {f"family {k + 1}, {n} diameters": (turns, waves[n, "backward"][:, k])
              for k, n in ((0, 2), (1, 2), (1, 3))}  # fmt: skip
    rays = {f"_{E}": (turns, E * speeds / (2 * np.pi)) for E in (1, 2, 3, 4)}
    campbell = view.Panel(
        "Campbell diagram, backward waves seen from the wheel", "speed [1/min]", "frequency [Hz]",
        curves=rays | curves,
    )  # fmt: skip
    split = view.Panel(
        "Splitting of the second family", "speed [1/min]", "backward - forward [Hz]",
        curves={f"n = {n}": (turns, waves[n, "backward"][:, 1] - waves[n, "forward"][:, 1])
                for n in (1, 2, 3)},
    )  # fmt: skip
    families = {f"family {k + 1}": (np.arange(half + 1), running[:, k]) for k in range(F)}
    line = {"_up": (orders[: half + 1], orders[: half + 1] * RUN / (2 * np.pi)),
            "_back": (folded[half:], orders[half:] * RUN / (2 * np.pi))}  # fmt: skip
    hits = {"within 5 %": ([n for _, n, _, _ in danger], [f for *_, f in danger])}
    safe = view.Panel(
        f"Interference diagram at {30 * RUN / np.pi:.0f} 1/min", "nodal diameters",
        "frequency [Hz]", curves=line | families, points=hits,
    )  # fmt: skip
    wave = rom.cyclic_modes(sector, 2, F).on_wheel()[:, :, 1]
    wheel = view.Scene("A wave of two nodal diameters", {"wheel": view.wheel(
        [model] * N, shape=list(wave), magnify=0.03 / abs(wave).max(),
        scale=1 / np.linalg.norm(wave.reshape(-1, 3), axis=1).max())},
        "displacement / largest", view=(0.5, -0.6, 1.0))  # fmt: skip
    view.panels(
        [[wheel, campbell], [split, safe]], options.out / "bladed_disk_diagrams.png",
        title=f"A bladed disk of {N} sectors: {full.n_wheel} dofs from {sector.free.size}",
        caption="Top left: a wave of the second family, magnified. Top right: thin rays are "
        "disturbances at rest with 1 to 4 lobes; centrifugal stress lifts all waves. Bottom left: "
        "Coriolis forces part waves that run with the rotation (forward) from those against it, n "
        "being the number of nodal diameters. Bottom right: the thin line folds the engine orders "
        "0 to 24 back at half the number of blades; rings mark families that it meets within 5 % "
        "at the right number of nodal diameters.",
    )  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.
# Mass: that of an annulus and of blades that taper linearly.

volume = np.pi * (0.15**2 - 0.06**2) * 0.016
share = np.linspace(0.0, 1.0, 2001)[1::2]
volume += N * 0.07 * ((0.015 - 0.003 * share) * (0.003 - 0.001 * share)).mean()
results = {
    "mass [kg]": (N * model.mass(), 4430.0 * volume, 5e-3),
    "sectors": (N, 24, 0.0),
    "worst reduced frequency, ten families, all diameters": (worst, 1.0, 1e-3),
    "none below that of the full sector": (min(lowest, 1.0), 1.0, 1e-9),
    "worst reduced wave at speed": (1 + spinning, 1.0, 1e-3),
    "share of the dofs, 5 % at most": (max(0.05, sector.free.size / full.free.size), 0.05, 1e-9),
    "splitting of family 2 grows with speed, n = 1": (
        (waves[1, "backward"] - waves[1, "forward"])[-1, 1]
        / (waves[1, "backward"] - waves[1, "forward"])[3, 1], 2.0, 0.1),
}  # fmt: skip
if first:
    for name, (value, expected, tolerance) in results.items():
        print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
