# # A rotor with two discs: a published table, beams, and a solid that spins
#
# A steel shaft of 1.5 m on two bearings carries two discs. The tilting discs are gyroscopes: each
# frequency at rest parts into a forward whirl, which runs with the rotation and rises with it, and
# a backward whirl, which falls. Example 5.9.1 of Friswell, Penny, Garvey and Lees, Dynamics of
# Rotating Machines (Cambridge 2010), prints both. The same rotor of solid finite elements shows
# what beams leave out: discs seventy millimetres wide stiffen the shaft they sit on.
#
# Run: `python demos/demo_rotor.py`, or under `mpirun -n 2`
# Time: 20 s
# Writes: `rotor_whirl.png` and `rotor_modes.png` into `out/`; another folder with `--out`

import argparse
from pathlib import Path

from mpi4py import MPI

import numpy as np

import rom
from rom import view
from rom.components.transmission import Disc, Shaft, Support, critical_speeds, shaft_whirl

options = argparse.ArgumentParser(description="whirl of a rotor, beams and solid")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
first = MPI.COMM_WORLD.rank == 0
say = print if first and not options.quiet else lambda *_: None

# ## Beams
#
# Six elements as in the book. Bearings of 1 MN/m at both ends push back alike in all directions.

E, G, rho = 211e9, 81.2e9, 7810.0
STEEL = (E, E / (2 * G) - 1, rho)
D, L, WIDE, DISCS, K = 0.05, 1.5, 0.07, {0.5: 0.28, 1.0: 0.35}, 1e6
FAST = 4000 * np.pi / 30
PRINTED = {0.0: (86.66, 86.66, 274.31, 274.31, 716.78, 716.78),
           FAST: (85.39, 87.80, 251.78, 294.71, 600.18, 827.08)}  # fmt: skip
ends = {0: Support(K), 6: Support(K)}
plain = Shaft(
    np.linspace(0, L, 7), D,
    [Disc.of_ring(round(4 * at), outer=d, inner=D, width=WIDE, rho=rho) for at, d in DISCS.items()],
    STEEL,
)  # fmt: skip
speeds = np.linspace(0.0, 4500 * np.pi / 30, 19)
beam = np.array([shaft_whirl(plain, ends, s, n=6).omega for s in speeds])
tables = {s: shaft_whirl(plain, ends, s, n=6) for s in PRINTED}
say("whirl of the beams [rad/s] at 0 and 4000 1/min, below it what the book prints")
for s, found in tables.items():
    say(*(f"{w:9.2f}" for w in found.omega), "\n", *(f"{w:8.2f} " for w in PRINTED[s]))
critical, way = critical_speeds(plain, ends)
say("critical speeds [1/min]:", *(f"{30 * s / np.pi:.1f}" for s in critical[:4]))

# ## The solid
#
# One of 24 sectors, on springs spread over the ends of the shaft. Whirl has one nodal diameter.
# Seen from the rotor, forward whirl has the frequency w - Omega, which is negative above the
# critical speed: it seems to run back. What an observer at rest sees is w again.

MESH = Path(__file__).parents[1] / "meshes" / "rotor.geo"
model = rom.fe.model(MESH, material=rom.Material(*STEEL))
sector = rom.rotating_sector(rom.CyclicSector.from_model(model), model)
for end in ("left", "right"):
    sector = rom.supported_sector(sector, model.interfaces[end], across=K)


def whirl(speed):
    """Six frequencies seen at rest [rad/s], backward and forward in turn."""
    if speed == 0.0:
        return np.repeat(rom.cyclic_modes(sector, 1, 3).omega, 2)
    waves = rom.travelling_modes(sector, 1, 7, speed=speed)
    return np.sort(abs(2 * np.pi * waves.at_rest))[:6]


few = speeds[::3]
solid = np.array([whirl(s) for s in few])


def hubs(diameter):
    """Whirl at the high speed of beams that are so thick inside the discs."""
    z = np.unique(np.round([*np.linspace(0, L, 31),
                            *(at + s * WIDE / 2 for at in DISCS for s in (-1, 1))], 9))  # fmt: skip
    middle = (z[1:] + z[:-1]) / 2
    inside = np.any([abs(middle - at) < WIDE / 2 for at in DISCS], axis=0)
    rings = [Disc.of_ring(int(np.argmin(abs(z - at))), outer=d, inner=diameter, width=WIDE, rho=rho)
             for at, d in DISCS.items()]  # fmt: skip
    shaft = Shaft(z, np.where(inside, diameter, D), rings, STEEL, bore=0.004)
    return shaft_whirl(shaft, {0: Support(K), z.size - 1: Support(K)}, FAST, n=6).omega


fast, soft, stiff = whirl(FAST), hubs(D), hubs(min(DISCS.values()))
say("at 4000 1/min: discs on a point, solid, rigid hubs [rad/s]")
for row in zip(soft, fast, stiff, strict=True):
    say(*(f"{w:9.2f}" for w in row))

# ## Pictures

if first:
    options.out.mkdir(parents=True, exist_ok=True)
    turns = 30 * speeds / np.pi
    names = [f"{way} whirl {i}" for i in (1, 2, 3) for way in ("backward", "forward")]
    dots = {"printed": ([30 * s / np.pi for s in PRINTED for _ in range(6)],
                        [w / (2 * np.pi) for row in PRINTED.values() for w in row])}  # fmt: skip
    gap = np.full((1, 3), np.nan)
    curves = {name: (np.tile([*turns, np.nan], 3),
                     np.vstack([beam[:, k::2] / (2 * np.pi), gap]).T.ravel())
              for k, name in enumerate(("backward whirl", "forward whirl"))}  # fmt: skip
    metal = [view.cylinder((0, 0, 0), (0, 0, L), D)]
    metal += [view.cylinder((0, 0, at - WIDE / 2), (0, 0, at + WIDE / 2), d)
              for at, d in DISCS.items()]  # fmt: skip
    springs = [view.coil((s * x, s * y, z), (s * (x + 0.12 * (x > 0)), s * (y + 0.12 * (y > 0)), z),
                         0.03, 0.004) for z in (0.01, L - 0.01) for s in (-1, 1)
               for x, y in ((D / 2, 0), (0, D / 2))]  # fmt: skip
    machine = view.Scene(
        "The rotor on its springs", {"steel": view.joined(metal), "springs": view.joined(springs)},
        view=(1.0, 0.5, 0.4), up=(0, 1, 0),
    )  # fmt: skip
    upper = view.Panel(
        "Beams, discs on a point", "speed [1/min]", "frequency [Hz]",
        curves={"_speed": (turns, turns / 60)} | curves, points=dots,
        notes={"speed of rotation": (turns[6], 66.0)},
    )  # fmt: skip
    lower = view.Panel(
        "Solid over beams", "speed [1/min]", "frequency, solid over beams",
        curves={name: (30 * few / np.pi, solid[:, k] / beam[::3, k])
                for k, name in enumerate(names)},
    )  # fmt: skip
    view.panels(
        [[machine, upper], [lower]], options.out / "rotor_whirl.png",
        title="A shaft with two discs on two bearings",
        caption="Rings: Friswell et al., Dynamics of Rotating Machines, example 5.9.1. The thin "
        "line is the speed of rotation; where it meets a whirl, unbalance resonates. Below: discs "
        "70 mm wide stiffen a solid shaft, which beams with discs on a point leave out.",
    )  # fmt: skip
    still = rom.cyclic_modes(sector, 1, 4)
    view.wheel_modes(
        model, {f"whirl {k + 1} at rest: {f:.4g} Hz": still.on_wheel()[:, :, k]
         for k, f in enumerate(still.frequencies)},
        options.out / "rotor_modes.png",
        view=(1.0, 0.5, 0.4), title="Whirl of the solid rotor",
        caption="Modes with one nodal diameter of a rotor on springs, from one of 24 sectors.",
    )  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.
volume = np.pi / 4 * ((D**2 - 0.004**2) * L + WIDE * sum(d**2 - D**2 for d in DISCS.values()))
results = {
    "mass [kg]": (24 * model.mass(), rho * volume, 2e-5),
    "solid frequencies between point and rigid hub": (
        np.count_nonzero((soft < fast) & (fast < stiff)), 6, 0.0),
    "critical speeds are whirl speeds": (
        np.min(abs(shaft_whirl(plain, ends, critical[1]).omega / critical[1] - 1)) + 1, 1.0, 1e-9),
} | {
    f"whirl {k + 1} at {30 * s / np.pi:.0f} 1/min [rad/s]": (tables[s].omega[k], printed[k], 8e-5)
    for s, printed in PRINTED.items() for k in range(6)
}  # fmt: skip
if first:
    for name, (value, expected, tolerance) in results.items():
        print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
