# # A frame from its parts: how many interface coordinates do bodies need?
#
# Two round columns stand in the bores of a cross beam. Each part is meshed and reduced alone, then
# the parts are coupled on the cylinders where they meet. Every dof of the cylinders is exact and
# expensive; polynomials chosen beforehand and characteristic constraint modes computed afterwards
# need a tenth. At last one column gets a mesh that does not match its bore.
#
# Run: `python demos/demo_assembly.py`; under `mpirun` one process does the work
# Time: 1 min
# Writes: `assembly_errors.png` into `out/`; another folder with `--out`

import argparse
from dataclasses import replace
from pathlib import Path

from mpi4py import MPI

import numpy as np
from scipy.sparse import block_diag, csr_matrix

import rom
from rom import view

options = argparse.ArgumentParser(description="a frame assembled from reduced parts")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
finite_elements = rom.fe.model  # PETSc starts here, on all processes together
if MPI.COMM_WORLD.rank:
    raise SystemExit  # small dense matrices are work for one process
say = (lambda *_: None) if options.quiet else print

# ## The parts
#
# `part` picks a column or the beam. Seats and bores have regular meshes with the same nodes.

L, H, R, t, w, a = 0.40, 0.30, 0.020, 0.050, 0.070, 0.035
names = ("left", "beam", "right")


def meshed(part, **numbers):
    """Finite element model of one part, or of the whole frame."""
    return finite_elements(
        Path(__file__).parents[1] / "meshes" / "frame.geo",
        material=rom.Material(E=210e9, nu=0.3, rho=7850.0),
        parameters={"part": part, "L": L, "H": H, "R": R, "t": t, "w": w, "a": a} | numbers,
        comm=MPI.COMM_SELF,
    )


models = {name: meshed(part) for part, name in enumerate(names, start=1)}
monolith = meshed(0)
mass = sum(model.mass() for model in models.values())
for name, model in models.items():
    sizes = {i.name: i.dofs.size for i in model.interfaces.values()}
    say(f"{name}: {model.n_dofs} dofs, on interfaces {sizes}")

# ## What is exact
#
# The matrices of the parts, added where nodes coincide: the full model on the same meshes. Another
# mesh of the frame in one piece tells what the meshes themselves are worth.

points = np.vstack([model.points for model in models.values()])
_, kept, number = np.unique(points.round(9), axis=0, return_index=True, return_inverse=True)
dofs = (3 * number[:, None] + np.arange(3)).ravel()
T = csr_matrix((np.ones(dofs.size), (np.arange(dofs.size), dofs)))
K, M = (
    csr_matrix(T.T @ block_diag([getattr(model, matrix) for model in models.values()]) @ T)
    for matrix in "KM"
)
feet, first = {}, 0
for name, model in models.items():
    if "foot" in model.interfaces:
        foot, label = model.interfaces["foot"], f"foot_{name}"
        feet[label] = replace(foot, name=label, nodes=number[first + foot.nodes])
    first += len(model.points)
whole = rom.FEModel(K, M, points[kept], feet)
held = {"fixed": tuple(feet), "interfaces": dict.fromkeys(feet, "rbe2")}
exact = rom.modes(whole, 10, **held).frequencies
other_mesh = np.abs(rom.modes(monolith, 10, **held).frequencies / exact - 1).max()
say("frequencies [Hz]:", *(f"{f:.2f}" for f in exact), f"; another mesh: {other_mesh:.1e}")

# ## The same interfaces in four ways
#
# Fixed-interface modes: 20 per part. Errors come from both, modes and interfaces; with every dof
# kept only the first kind is left.

couplings = ((("left", "seat"), ("beam", "bore_left")), (("right", "seat"), ("beam", "bore_right")))
feet = (("left", "foot"), ("right", "foot"))


def reduced(name, model, kind):
    """One part; its foot is rigid, its cylinders are of that kind."""
    kinds = {i: "rbe2" if i == "foot" else kind for i in model.interface_names}
    return rom.reduce(
        model, method=rom.CraigBampton(20), interfaces=kinds, name=name, certify=False
    )


def worst(frequencies):
    """Largest relative error of ten frequencies."""
    return np.abs(frequencies / exact - 1).max()


full = {name: reduced(name, model, "full") for name, model in models.items()}
assembly = rom.Assembly(full, couplings)
n_full = sum(models[name].interfaces["seat"].dofs.size for name in ("left", "right"))
all_dofs = assembly.frequencies(10, fixed=feet)
errors = {"every dof": ([n_full], [worst(all_dofs)])}
below = (all_dofs / exact).min()
for p in (1, 2, 3, 4):
    bodies = {name: reduced(name, model, f"polynomial:{p}") for name, model in models.items()}
    found = rom.Assembly(bodies, couplings).frequencies(10, fixed=feet)
    size = sum(bodies[name].marker("seat").hold.shape[0] for name in ("left", "right"))
    sizes, values = errors.setdefault("polynomials of order 1 to 4", ([], []))
    sizes.append(size)
    values.append(worst(found))
    below = min(below, (found / exact).min())
for level, counts in (("system", (6, 9, 12, 18, 30, 48)), ("local", (6, 9, 12, 18, 30, 48))):
    for n in counts:
        condensed = assembly.reduced(n, level=level, fixed=feet)
        found = condensed.frequencies(10)
        label = f"characteristic modes of the {'whole' if level == 'system' else 'parts'}"
        sizes, values = errors.setdefault(label, ([], []))
        sizes.append(condensed.n_interface)
        values.append(worst(found))
        below = min(below, (found / exact).min())
for label, (sizes, values) in errors.items():
    for size, value in zip(sizes, values, strict=True):
        say(f"{label:36s} {size:4d} coordinates: {value:8.1e}")

# ## Meshes that do not match
#
# Five instead of three elements along the right seat. The nodes of column and bore differ; what
# they have in common are moments with functions. Moments tie the cylinders too loosely, and the
# frequencies rise towards the exact ones; rigid motion passes without error.

loose = full | {"right": reduced("right", meshed(3, n_along=5), "full")}
families = {
    "polynomials of order 1 to 7": [rom.Polynomial(p) for p in (1, 2, 3, 5, 7)],
    "Fourier-Legendre functions": [rom.FourierLegendre(n, n) for n in (1, 2, 3, 4)],
}
projected = {}
for label, family in families.items():
    projected[label] = ([], [])
    for functions in family:
        pair = rom.Assembly(loose, couplings, projection=functions)
        projected[label][0].append(pair.n_conditions[1])
        projected[label][1].append(worst(pair.frequencies(10, fixed=feet)))
        say(f"{functions!r:36s} {pair.n_conditions[1]:4d} moments: {projected[label][1][-1]:8.1e}")
free = pair.frequencies(7)

# ## The picture

options.out.mkdir(parents=True, exist_ok=True)
apart = np.array([[-0.06, 0, 0], [0, 0, 0.1], [0.06, 0, 0]])
view.convergence(
    [("error, meshes match", errors), ("error, right seat does not match", projected)],
    options.out / "assembly_errors.png",
    xlabel="coordinates of both seats (above), moments coupled on the right seat (below)",
    title="A frame from three reduced parts",
    beside=[
        view.Scene(
            "The parts, moved apart",
            {
                name: (model.points[model.surface.nodes] + aside, model.surface.triangles)
                for (name, model), aside in zip(models.items(), apart, strict=True)
            },
            view=(0.4, -1.0, 0.4),
            up=(0, 0, 1),
        ),
        view.Scene(
            "The mesh of a column, lying",
            view.meshed(models["right"]),
            view=(0.3, -1.0, -0.4),
            up=(1, 0, 0),
        ),
    ],
    caption="Largest relative error of the ten lowest frequencies of a portal frame with clamped "
    "feet, against the full model on the same meshes. Above: cylinders that move by all their "
    "dofs, by polynomials, or by characteristic constraint modes of the whole frame or of its "
    "parts; 20 fixed-interface modes per part limit the error to that of every dof. Below: the "
    "right column has another mesh than its bore, and moments of common functions couple them.",
)

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.

volume = 2 * np.pi * R**2 * (H - t) + (L + 2 * a) * w * t
results = {
    "mass [kg]": (mass, 7850.0 * volume, 5e-4),
    "worst frequency ratio, another mesh": (1 + other_mesh, 1.0, 1e-3),
    "worst frequency ratio, every dof": (1 + worst(all_dofs), 1.0, 1e-3),
    "lowest ratio of all reduced models": (min(below, 1.0), 1.0, 1e-9),
    "polynomials of order 3": (1 + errors["polynomials of order 1 to 4"][1][2], 1.0, 2e-3),
    "18 characteristic modes of the whole": (
        1 + errors["characteristic modes of the whole"][1][3], 1.0, 1e-3),
    "12 characteristic modes per part": (
        1 + errors["characteristic modes of the parts"][1][2], 1.0, 2e-3),
    "another mesh at a seat, order 7": (
        1 + projected["polynomials of order 1 to 7"][1][-1], 1.0, 3e-3),
    "rigid motions of the free frame": (float(np.count_nonzero(free == 0.0)), 6.0, 0.0),
}  # fmt: skip
for name, (value, expected, tolerance) in results.items():
    print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
