# # A compressor blade: how many numbers does a dovetail need?
#
# The flanks of a dovetail carry hundreds of nodes. With all their dofs as interface coordinates a
# reduced blade is large, and slow to make. Carassale and Maurici (J. Eng. Gas Turbines Power 140,
# 2018) choose orthogonal functions on the interface before anything is solved. Every kind of
# interface meets the same question here: a blade whose flanks sit on an elastic disk.
#
# Run: `python demos/demo_compressor_blade.py`, or under `mpirun -n 2`; `--crown 0.03` for curved
# flanks, `--lc-flank 0.0036` for a third of a minute
# Time: 2 min
# Writes: `compressor_blade.png` into `out/`; another folder with `--out`

import argparse
import ctypes
import gc
from pathlib import Path
from time import process_time

from mpi4py import MPI

import numpy as np
from scipy.linalg import eigh, null_space
from scipy.sparse import coo_matrix, identity, kron
from scipy.sparse.linalg import eigsh, splu

import rom
from rom import view
from rom.eigen import rigid_motions

options = argparse.ArgumentParser(description="kinds of interfaces on a compressor blade")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("--crown", type=float, default=0.0, help="radius of the flanks [m]; 0: plane")
options.add_argument("--lc-flank", type=float, default=0.0028, help="size of elements there [m]")
options.add_argument("--lc", type=float, default=0.008, help="size elsewhere [m]")
options.add_argument("--degree", type=int, default=2, help="of the elements")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
first = MPI.COMM_WORLD.rank == 0
say = print if first and not options.quiet else lambda *_: None

# ## The blade
#
# Titanium, 120 mm of airfoil. Under both flanks the disk is a bed of springs as soft as 10 mm of
# titanium, so that the flanks move and deform. Held flanks would prove nothing: every kind of
# interface is exact there.

E, rho = 114e9, 4430.0
BED = E / 0.010  # N/m^3
FLANKS = ("flank_left", "flank_right")
given = {
    "path": Path(__file__).parents[1] / "meshes" / "compressor_blade.geo",
    "material": rom.Material(E=E, nu=0.33, rho=rho),
    "parameters": {"lc": options.lc, "lc_flank": options.lc_flank, "crown": options.crown},
    "degree": options.degree,
    "order": options.degree,  # on crowned flanks, nodes between corners lie on the cylinder as well
}
model = rom.fe.model(**given)
n_b = sum(model.interfaces[name].dofs.size for name in FLANKS)
say(f"{model.n_dofs} dofs, {n_b} of them on the flanks, {1e3 * model.mass():.1f} g")

# ## What the finite elements say
#
# SciPy solves the blade on its bed with all its dofs, whole on each process.

alone = model if MPI.COMM_WORLD.size == 1 else rom.fe.model(**given, comm=MPI.COMM_SELF)
K_bed = alone.K.tocsc()
for name in FLANKS:
    interface = alone.interfaces[name]
    S, dofs = kron(interface.surface_mass, identity(3), "coo"), interface.dofs
    S = coo_matrix((S.data, (dofs[S.row], dofs[S.col])), shape=K_bed.shape)
    K_bed = K_bed + BED * S.tocsc()
lam, shapes = eigsh(K_bed, 10, alone.M.tocsc(), sigma=0.0)
exact = {"seated": np.sqrt(lam) / (2 * np.pi), "free": rom.modes(model, 16).frequencies[6:]}
outer = shapes[(3 * alone.surface.nodes[:, None] + np.arange(3)).ravel()]
say("seated", *(f"{f:.1f}" for f in exact["seated"]), "Hz")

# ## The same ten modes from reduced blades
#
# What the bed feels of the coordinates of a flank depends on their kind: all dofs press with the
# mass matrix of the surface, six rigid ones as a plate, orthonormal functions each for itself.
# Seconds are processor time; MB is what the process takes at most beyond what it had before.


def felt(name, kind, n):
    interface = model.interfaces[name]
    S = kron(interface.surface_mass, identity(3), "csr")
    R = rigid_motions(interface.points - interface.origin)
    return {"full": S, "rbe2": R.T @ (S @ R), "rbe3": R.T @ (S @ R)}.get(kind, identity(n))


def bed(body):
    """Stiffness of the bed in the coordinates of a body."""
    found = 0.0
    for name in FLANKS:
        H = body.marker(name).hold
        found = found + BED * H.T @ (felt(name, body.marker(name).kind, len(H)) @ H)
    return found


table = {}
say("kind of the flanks          coordinates  solutions  seconds   MB     free   seated  1 - MAC")


def memory(which):
    """Of the process [MB]: "VmRSS" now, "VmHWM" at most since `reduced` began to count."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(1.024e-3 * float(line.split()[1]) for line in lines if line.startswith(which))


def compare(label, body, T, n, solutions, cost):
    """Keep and print what a body is worth in the coordinates T (all, some); cost in s and MB."""
    M, K = body.full_matrices()
    free, on_bed, M = T.T @ K @ T, T.T @ (K + bed(body)) @ T, T.T @ M @ T
    loose = eigh(free, M, eigvals_only=True, subset_by_index=(6, 15))
    lam, V = eigh(on_bed, M, subset_by_index=(0, 9))
    f, V = [np.sqrt(x) / (2 * np.pi) for x in (loose, lam)], T @ V
    U = rigid_motions(body.surface.points) @ V[:6] + body.surface.shape @ V[6:]
    agreement = (outer.T @ U) ** 2 / np.outer((outer**2).sum(axis=0), (U**2).sum(axis=0))
    row = {"coordinates": n, "solutions": solutions, "seconds": cost[0], "MB": cost[1],
           "free": np.abs(f[0] / exact["free"] - 1).max(),
           "seated": np.abs(f[1] / exact["seated"] - 1).max(),
           "lost": 1 - agreement.max(axis=1).min()}  # fmt: skip
    table[label] = row
    say(f"{label:27s} {n:11d} {solutions:10d} {cost[0]:8.2f} {cost[1]:4.0f} {row['free']:8.1e} "
        f"{row['seated']:8.1e} {row['lost']:8.1e}")  # fmt: skip


def reduced(label, kinds, more=0, before=0.0):
    """A blade with these kinds of flanks; `more` solutions had to be found before."""
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)  # what earlier reductions have freed goes back
    Path("/proc/self/clear_refs").write_text("5")  # the largest memory is counted anew
    had, clock = memory("VmRSS"), process_time()
    body = rom.reduce(model, method=rom.CraigBampton(60), interfaces=kinds, certify=False)
    cost = before + process_time() - clock, memory("VmHWM") - had
    n = sum(len(body.marker(name).hold) for name in FLANKS)
    T = np.eye(len(body.full_matrices()[0]))
    compare(label, body, T, n, n + more, cost)
    return body


for kind in ("rbe2", "rbe3", *(f"polynomial:{p}" for p in range(1, 6))):
    reduced(kind, dict.fromkeys(FLANKS, kind))

# Fourier-Legendre functions are made for seats around an axis. About the long axis of a plane flank
# the angle has two values, so that its halves move each for itself.

for n in (1, 2, 4):
    reduced(f"Fourier-Legendre {n} {n}", dict.fromkeys(FLANKS, rom.FourierLegendre(n, n)))

# ## Functions that are found by solving first
#
# Snapshots are what the flanks do under forces on the airfoil, at random: the bed has to be known
# and factorised. Characteristic constraint modes are the lowest modes of the flanks after all of
# their dofs have been solved for: of both flanks on the bed ("system"), of each flank on the bed
# with the other one held ("local"), or of both without a bed ("alone", as `rom.Characteristic`
# takes them), beside the six rigid motions. Z are fixed-interface modes, which all of them have.

SOME = (12, 24, 36, 60)
clock, rng = process_time(), np.random.default_rng(2018)
loads = np.zeros((model.n_dofs, 60))
aloft = alone.surface.nodes[alone.points[alone.surface.nodes, 2] > 0.02]
loads[(3 * aloft[:, None] + np.arange(3)).ravel()] = rng.normal(size=(3 * aloft.size, 60))
moved = splu(K_bed).solve(loads)
spent = process_time() - clock
for n in SOME[1:]:
    kinds = {name: rom.Snapshots(moved[alone.interfaces[name].dofs], n=n // 2) for name in FLANKS}
    reduced(f"snapshots {n}", kinds, loads.shape[1], spent)

full = reduced("all dofs", dict.fromkeys(FLANKS, "full"))
clock = process_time()
M, K = full.full_matrices()
H = np.vstack([full.marker(name).hold for name in FLANKS])
Z = null_space(H)
C = null_space(Z.T @ K)
C = np.linalg.solve((H @ C).T, C.T).T  # one column moves one dof of the flanks
halves = np.split(np.arange(len(H)), 2)


def lowest(on, dofs, first_one, n):
    """n modes of some dofs of the flanks, the others held, from the given one on."""
    some = C[:, dofs]
    few = (first_one, first_one + n - 1)
    return some @ eigh(some.T @ on @ some, some.T @ M @ some, subset_by_index=few)[1]


def modes_of_flanks(level, n):
    """(all, n) characteristic constraint modes."""
    if level == "local":
        return np.hstack([lowest(K + bed(full), half, 0, n // 2) for half in halves])
    on, first_one = {"system": (K + bed(full), 0), "alone": (K, 6)}[level]
    return lowest(on, np.arange(len(H)), first_one, n)


for level in ("system", "local", "alone"):
    for n in SOME:
        T = np.hstack([np.eye(len(K), 6), modes_of_flanks(level, n - 6), Z])
        spent = table["all dofs"]["seconds"] + process_time() - clock
        compare(f"characteristic, {level} {n}", full, T, n, n_b, (spent, table["all dofs"]["MB"]))
        clock = process_time()

# ## The picture

SERIES = {
    "polynomials of order 1 to 5": "polynomial", "Fourier-Legendre": "Fourier",
    "snapshots": "snapshots", "characteristic, of both flanks on the bed": "characteristic, system",
    "characteristic, of each flank": "characteristic, local",
    "characteristic, of the blade alone": "characteristic, alone", "rigid (rbe2)": "rbe2",
    "mean motion (rbe3)": "rbe3", "all dofs": "all",
}  # fmt: skip


def curves(key):
    """Of every kind of interface, over the coordinates."""
    found = {label: [row for name, row in table.items() if name.startswith(start)]
             for label, start in SERIES.items()}  # fmt: skip
    return {label: ([row["coordinates"] for row in rows], [row[key] for row in rows])
            for label, rows in found.items() if rows}  # fmt: skip


if first:
    options.out.mkdir(parents=True, exist_ok=True)
    view.convergence(
        [
            ("worst frequency error", curves("seated")),
            ("worst 1 - MAC of mode shapes", curves("lost")),
            ("processor time to reduce [s]", curves("seconds")),
        ],
        options.out / "compressor_blade.png",
        beside=view.Scene(
            "The blade and its flanks", view.meshed(model), view=(0.9, -1.0, 0.35), up=(0, 0, 1)
        ),
        xlabel="interface coordinates of both flanks",
        title="A dovetailed compressor blade: how its interface is reduced",
        caption=f"Titanium blade of {model.n_dofs} dofs whose two dovetail flanks, "
        f"{'crowned' if options.crown else 'plane'}, with {n_b} dofs, sit on an elastic bed as "
        "soft as 10 mm of titanium. Top: worst relative error of its first ten natural "
        "frequencies against the full finite element model; middle: worst disagreement of the "
        "mode shapes, MAC being their modal assurance criterion, 1 for equal ones; bottom: "
        "processor time of the whole reduction. All keep 60 fixed-interface modes. Polynomials are "
        "chosen before anything is solved; snapshots need the bed and loads, characteristic modes "
        "one solution for each dof of the flanks. "
        f"Order 3 reaches {100 * table['polynomial:3']['seated']:.2f} % with "
        f"{table['polynomial:3']['coordinates']} "
        "coordinates. A rigid flank is too stiff; one that the bed moves only in the mean is too "
        "soft.",
    )

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.
# The volume follows from the description of the geometry: parabolic profiles, platform, dovetail,
# whose fillets add above the flanks what they take below; crowns add little.

z = np.linspace(0.0, 1.0, 2001)[1::2]
chord, thick, edge = 0.045 - 0.005 * z, 0.0045 - 0.0021 * z, 0.0010
airfoil = 0.120 * (chord * (edge + 2 / 3 * (thick - edge))).mean()
beta, wide = np.radians(50), (0.012, 0.024)
depth = (wide[1] - wide[0]) / 2 / np.tan(beta)
root = 0.044 * (0.004 * sum(wide) + depth * sum(wide) / 2)
results = {
    "mass [kg]": (model.mass(), rho * (airfoil + 0.052 * 0.032 * 0.005 + root), 3e-3),
    "worst ratio of ten frequencies, free, order 3": (
        1 + table["polynomial:3"]["free"], 1.0, 1e-3),
    "worst ratio of ten frequencies, seated, order 3": (
        1 + table["polynomial:3"]["seated"], 1.0, 1e-3),
    "worst ratio of ten frequencies, seated, all dofs": (
        1 + table["all dofs"]["seated"], 1.0, 1e-4),
    "the same, 60 characteristic modes of blade and bed": (
        1 + table["characteristic, system 60"]["seated"], 1.0, 1e-3),
    "lowest MAC, seated, order 3": (1 - table["polynomial:3"]["lost"], 1.0, 1e-4),
    "seated, 60 characteristic modes of each flank": (
        1 + table["characteristic, local 60"]["seated"], 1.0, 1e-4),
    "share of the interface dofs, order 3, at least a tenth": (
        max(table["polynomial:3"]["coordinates"] / n_b, 0.1), 0.1, 1e-12),
}  # fmt: skip
if first:
    for name, (value, expected, tolerance) in results.items():
        print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
