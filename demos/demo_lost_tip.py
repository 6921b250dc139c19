# # A blade that lost its tip: twelve blades, each a substructure of its own
#
# A bird or a bolt takes a fifth of one blade. No wave of the tuned wheel knows how the short blade
# moves, so the blades are cut off their disk: each brings a root, on which all have equal
# functions, and cantilever modes of its own. The disk is reduced once; blades are exchanged on it.
#
# Run: `python demos/demo_lost_tip.py`, or under `mpirun -n 2`
# Time: 15 s
# Writes: `lost_tip.png` into `out/`; another folder with `--out`

import argparse
from pathlib import Path

from mpi4py import MPI

import numpy as np
from scipy.sparse import block_diag, bmat, identity

import rom
from rom import view
from rom.eigen.scipy import SciPyOperators

options = argparse.ArgumentParser(description="a bladed disk with one short blade")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
first = MPI.COMM_WORLD.rank == 0
say = print if first and not options.quiet else lambda *_: None

# ## Two meshes
#
# The same sector with the whole and with the short blade, whose taper and twist end earlier.

N, KEEP = 12, 0.8
WHOLE = {"N": N, "width": 0.015, "chord": 0.014, "chord_tip": 0.010, "t": 0.003, "t_tip": 0.002,
         "stagger": 20, "twist": 10, "r_tip": 0.220, "lc": 0.018, "lc_blade": 0.007}  # fmt: skip
SHORT = WHOLE | {"r_tip": 0.15 + 0.07 * KEEP, "twist": 10 * KEEP,
                 "chord_tip": 0.014 - 0.004 * KEEP, "t_tip": 0.003 - 0.001 * KEEP}  # fmt: skip
model, damaged = (
    rom.fe.model(
        Path(__file__).parents[1] / "meshes" / "bladed_disk.geo", parameters=sizes,
        material=rom.Material(E=114e9, nu=0.33, rho=4430.0),
    )
    for sizes in (WHOLE, SHORT)
)  # fmt: skip
full, other = (
    rom.CyclicSector.from_model(m, fixed=("bore",), regions=("blade",)) for m in (model, damaged)
)
sector = rom.substructured_sector(
    full, model, n_modes=40, n_blade_modes=15, functions=rom.Polynomial(6), root=rom.Polynomial(4)
)
disk = rom.bladed_wheel(sector, 10, n_root=30)
short = rom.reduced_blade(sector, damaged, n_modes=15)
say(f"sector of {full.free.size} dofs reduced to {sector.free.size}; cantilever frequencies [Hz]")
for name, blade in (("whole", sector.blade), ("short", short)):
    say(f"{name:>8}", *(f"{f:9.1f}" for f in blade.omega[:4] / (2 * np.pi)))
worst = max(
    (rom.cyclic_modes(sector, n, 6).omega / rom.cyclic_modes(full, n, 6).omega).max()
    for n in sector.diameters
)
say(f"tuned wheel: six families at all diameters within {worst - 1:.1e}")

# ## The damaged wheel
#
# All blades scatter a little; blade 5 is the short one. Three struts ahead of the wheel push along
# the axis.

scatter = np.random.default_rng(1912).normal(0.0, 0.01, N)
blades = [sector.blade.varied(stiffness=s) for s in scatter]
blades[5] = short
omega, _ = disk.modes(blades)
share = disk.energies(blades, 2 * N)
alone = int(share[:, 5].argmax())
say(f"mode {alone + 1} at {omega[alone] / (2 * np.pi):.1f} Hz: {100 * share[alone, 5]:.1f} % of "
    "the energy of all blades is in the short one")  # fmt: skip
ORDER, ZETA = 3, 1e-3
drive = {"engine_order": ORDER, "damping": ZETA}
forces, rows = [], []
for j in range(N):
    tip = (damaged if j == 5 else model).interfaces["tip"]
    weights = np.asarray(tip.surface_mass.sum(axis=1)).ravel() / tip.area
    mean = np.zeros((3, len(blades[j].Psi)))
    mean[:, tip.dofs] = np.kron(weights, np.eye(3))
    forces.append(mean[2])  # 1 N along the axis, spread over the tip
    rows.append(mean)
low, high = (np.linspace(0.97, 1.03, 401) * w for w in (sector.blade.omega[0], omega[alone]))
answers = disk.response(blades, forces, omega=np.r_[low, high], at=rows, **drive)
answers = np.linalg.norm(answers, axis=-1).reshape(2, low.size, N)
factor = disk.amplification(blades, forces, omega=low, at=rows, **drive)
say(f"below, the worst blade moves {factor:.2f} times as far as those of the tuned wheel")

# ## Is it true?
#
# The whole wheel of finite elements: eleven sectors of one mesh, each with its own stiffness, and
# one of the other. Slave faces follow the master faces of the next sector.

parts = [other if j == 5 else full for j in range(N)]
maps = [[None] * N for _ in range(N)]
for j, part in enumerate(parts):
    k = (j + part.step) % N
    moves = ~np.isin(part.slave, part.held)
    one, lead = (identity(p.n, format="csr") for p in (part, parts[k]))
    follow = part.coupling.tocsr()[moves] @ lead[parts[k].master][:, parts[k].free]
    maps[j][j], maps[j][k] = one[:, part.free], one[:, part.slave[moves]] @ follow
T = bmat(maps, format="csr")
change = np.where(np.arange(N) == 5, 0.0, scatter)
K = block_diag([p.K + d * p.regions["blade"] for p, d in zip(parts, change, strict=True)])
M = block_diag([p.M for p in parts])
ops = SciPyOperators(T.T @ K @ T, T.T @ M @ T)
exact, _ = ops.modes(ops.hold([]), 2 * N)
apart = omega[: 2 * N] / exact
say(f"{2 * N} frequencies of {omega.size} coordinates within {abs(apart - 1).max():.1e} of those "
    f"of {ops.n} dofs")  # fmt: skip

if first:
    options.out.mkdir(parents=True, exist_ok=True)
    drawn = []
    for title, w, u in (("First family: the eleven whole blades", low, answers[0]),
                        ("Above it: the short blade, alone", high, answers[1])):  # fmt: skip
        hz = w / (2 * np.pi)
        curves = {f"_blade {j}": (hz, 1e3 * u[:, j]) for j in range(N) if j != 5}
        curves["short blade"] = (hz, 1e3 * u[:, 5])
        drawn.append(view.Panel(title, "frequency [Hz]", "amplitude of the tip [mm]", curves))
    models = [damaged if j == 5 else model for j in range(N)]
    others = view.wheel(models, sectors=[j for j in range(N) if j != 5])
    seen = {"whole blades": others, "sector of the short one": view.wheel(models, sectors=[5])}
    wheel = view.Scene("The wheel", seen, view=(0.3, -0.4, 1.0))
    view.panels(
        [[wheel, *drawn]], options.out / "lost_tip.png",
        title=f"One of {N} blades has lost a fifth of its length",
        caption=f"Titanium wheel of {ops.n} dofs; disk and blades are substructures, {omega.size} "
        f"coordinates in all. 1 N per blade, engine order {ORDER}, {100 * ZETA:g} % damping; "
        "stiffnesses scatter by 1 %. Thin lines are whole blades. Middle: they answer each at "
        "its own frequency, the short one stands still. Right: the short blade answers where the "
        "wheel had no mode.",
    )  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.
# Bending frequencies of a beam fall with the square of its length; taper and twist change that a
# little.

solid = np.pi * (0.15**2 - 0.06**2) * 0.015 + N * 0.07 * (0.012 * 0.0025 + 0.004 * 0.001 / 12)
results = {
    "mass [kg]": (N * model.mass(), 4430.0 * solid, 1e-4),
    "six families of the tuned wheel": (worst, 1.0, 1e-3),
    "worst frequency of the damaged wheel": (apart.max(), 1.0, 1e-3),
    "short blade, first cantilever frequency": (short.omega[0] / sector.blade.omega[0], KEEP**-2,
                                                0.05),
    "its mode is its own": (share[alone, 5], 1.0, 0.02),
    "and at its cantilever frequency": (omega[alone] / short.omega[0], 1.0, 0.04),
}  # fmt: skip
if first:
    for name, (value, expected, tolerance) in results.items():
        print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
