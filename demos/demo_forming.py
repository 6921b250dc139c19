# # Metal between tools: a billet that is upset, and a punch that finds its limit load
#
# A block from a gmsh geometry is pressed between platens with friction; a flat punch sinks into
# a half-space. Slip lines give the load of the punch, and show which triangles lock.
#
# Run: `python demos/demo_forming.py`
# Time: 30 s
# Writes: `forming.png` and `upsetting.gif` into `out/`; another folder with `--out`

import argparse
from pathlib import Path

from mpi4py import MPI

import numpy as np

from rom import view
from rom.components.assumed_strain import (
    Actions,
    Drive,
    Metal,
    Tool,
    quasi_static,
    rectangle,
    sheet,
)
from rom.fe import mesh as meshing

options = argparse.ArgumentParser(description="metal between tools")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
root = MPI.COMM_WORLD.rank == 0  # under mpirun each process does all of it
say = print if root and not options.quiet else lambda *_: None
MESHES = Path(__file__).resolve().parent.parent / "meshes"

# ## Upsetting
#
# A quarter of the section, in plane strain. The platen comes down by four of ten millimetres; its
# friction holds the metal back, so that the block bulges and its side folds against the platen.

mesh = meshing.read_triangles(
    MESHES / "billet.geo", parameters={"lc": 0.9, "radius": 0.5}, scale=1e-3
)
billet = sheet(mesh.points, mesh.triangles, element="F1", state="plane strain")
steel = Metal(200e9, 0.3, 7850.0, yield_stress=500e6, hardening=300e6)
held = np.r_[2 * mesh.nodes("axis"), 2 * mesh.nodes("middle") + 1]
SINK = 4e-3


def upset(friction):
    """The way of the block under a platen."""
    outline = [(-0.02, 0.01), (0.02, 0.01), (0.02, 0.013), (-0.02, 0.013)]
    platen = Tool("platen", outline, friction, ((0, 1), ((0, 0), (0, -SINK))))
    return quasi_static(billet, steel, Actions(held, tools=[platen]), np.linspace(0, 1, 41))


courses = {friction: upset(friction) for friction in (0.0, 0.15)}
k = 2 / np.sqrt(3)
flow_stress = k * (500e6 + 300e6 * k * np.log(1 / 0.6))
pressures = {}
for friction, course in courses.items():
    x = course.x[-1]
    wide = x[x[:, 1] > x[:, 1].max() - 1e-6, 0].max()
    pressures[friction] = -course.tool_forces[-1, 0, 1] / wide
    say(f"friction {friction}: {pressures[friction] / 1e6:.0f} MPa on {2e3 * wide:.1f} mm, "
        f"plastic strain up to {course.plastic[-1].max():.2f}")  # fmt: skip

# ## A punch
#
# Rough, flat and rigid, on metal that does not harden. Slip lines: (2 + pi) times its
# shear strength.


def graded(n):
    """Half of a deep block: n divisions below a punch of half-width 1, growing away from it."""
    growing = np.cumsum(1.25 ** np.arange(1, 40)) / n
    x = np.r_[np.linspace(0, 1, n + 1), 1 + growing[growing < 4.5]]
    y = -np.r_[0, growing[growing < 4.5]][::-1]
    last = len(x) - 1, len(y) - 1
    X, T = rectangle(last, [(0, 0), (last[0], 0), last, (0, last[1])])
    i, j = np.rint(X).astype(int).T
    return np.column_stack([x[i], y[j]]), T


def dofs(where, axes=(0, 1)):
    """Dof numbers along some axes of the nodes where a condition holds."""
    return (2 * np.flatnonzero(where)[:, None] + np.array(axes)).ravel()


def punched(n, element, sink=0.03):
    """Mean pressure over the shear strength at the end, and the block."""
    X, T = graded(n)
    body = sheet(X, T, element=element, state="plane strain")
    punch = (X[:, 1] > -1e-9) & (X[:, 0] < 1 + 1e-9)
    far = (X[:, 1] < X[:, 1].min() + 1e-9) | (X[:, 0] > X[:, 0].max() - 1e-9)
    still = np.r_[dofs(X[:, 0] < 1e-9, (0,)), dofs(far), dofs(punch, (0,))]
    drive = Drive(dofs(punch, (1,)), ((0, 1), (0, -sink)))
    weak = Metal(3000.0, 0.3, yield_stress=np.sqrt(3))
    course = quasi_static(body, weak, Actions(still, drives=[drive]), np.linspace(0, 1, 16))
    # a node at the end of the punch stands for half the next division as well
    return -course.reactions[-1, punch, 1].sum() / (1 + 0.5 / n), course, T


SIZES = (4, 8, 16)
loads = {(element, n): punched(n, element) for element in ("CST", "F1") for n in SIZES}
for (element, n), (pressure, _, _) in loads.items():
    say(f"punch, {element}, {n} divisions: {pressure:.3f} of 2 + pi = {2 + np.pi:.3f}")


def mirrored(x, start, T, values, axes):
    """A section with what lies beyond its planes of symmetry: positions, before, triangles."""
    for axis in axes:
        sign, n = np.where(np.arange(2) == axis, -1.0, 1.0), len(x)
        other = np.arange(n) + np.where(np.abs(start[:, axis]) < 1e-12, 0, n)
        x, start = np.vstack([x, x * sign]), np.vstack([start, start * sign])
        T, values = np.vstack([T, other[T]]), np.tile(values, 2)
    return x, start, T, values


def whole(j, width=330):
    """The block between its platens at an instant."""
    course = courses[0.15]
    x, before, T, strain = mirrored(
        course.x[j], billet.points, billet.triangles, course.plastic[j, :, 0], (0, 1)
    )
    z = 0.01 - SINK * course.t[j]
    above = np.array([(-0.019, z), (0.019, z), (0.019, z + 0.003), (-0.019, z + 0.003)])
    return view.Shape("Upset with friction 0.15", x, T, before, strain, "plastic strain", width,
                      (above, above * [1, -1]))  # fmt: skip


def indented():
    """The block below the punch, both halves, near the punch."""
    _, course, T = loads["F1", 16]
    near = np.all((course.x[0][T] * [1, -1]) < [2.6, 2.2], axis=(1, 2))
    used, T = np.unique(T[near], return_inverse=True)
    strain = np.minimum(course.plastic[-1, near, 0], 0.04)
    x, before, both, values = mirrored(
        course.x[-1, used], course.x[0, used], T.reshape(-1, 3), strain, (0,)
    )
    z = -0.03
    punch = np.array([(-1, z), (1, z), (1, z + 0.35), (-1, z + 0.35)])
    label = "plastic strain, 0.04 and more"
    return view.Shape("Below the punch", x, both, before, values, label, 330, (punch,))


options.out.mkdir(parents=True, exist_ok=True)
view.deformed(
    {name: (SIZES, [loads[element, n][0] for n in SIZES])
     for element, name in (("CST", "ordinary (CST)"), ("F1", "one point (F1)"))},
    [indented(), whole(-1)],
    options.out / "forming.png",
    limit=("slip lines, 2 + \u03c0", 2 + np.pi),
    xlabel="divisions under half the punch",
    ylabel="pressure over shear strength [1]",
    title="Metal between tools",
    heading="Pressure of a punch, by mesh",
    caption="Left: pressure of a rough flat punch that has sunk by 1.5 % of its width; ordinary "
    "triangles lock and go on rising. Middle: the plastic wedge and fans below the punch. Right: "
    "section of a block, 20 mm wide and 20 mm high, upset to 12 mm between platens; dashed: "
    "before. Grey: tools.",
)  # fmt: skip
view.flow(
    1e3 * SINK * courses[0.15].t,
    [whole(j) for j in range(len(courses[0.15].t))],
    options.out / "upsetting.gif",
    caption="Section of a steel block, 20 mm wide and 20 mm high, pressed between platens with "
    "friction 0.15 in plane strain, each by a millimetre a second; dashed: before.",
)

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.

slab = 0.15 * 2 * wide / (2 * (0.01 - SINK))  # friction times width over height
results = {
    "punch, F1, 16 divisions, over 2 + pi": (loads["F1", 16][0] / (2 + np.pi), 1.0, 0.05),
    "upset without friction, pressure over flow stress": (pressures[0.0] / flow_stress, 1.0, 0.06),
    "upset with friction, pressure over that without, slab method": (
        pressures[0.15] / pressures[0.0], np.expm1(slab) / slab, 0.08),
    "height, shared by both [mm]": (1e3 * courses[0.15].x[-1, :, 1].max(), 6.0, 1e-3),
}  # fmt: skip
for name, (value, expected, tolerance) in results.items() if root else ():
    print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
