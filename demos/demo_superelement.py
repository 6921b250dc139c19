# # A structure of which only reduced matrices are known
#
# A supplier sends a frame as a superelement of Nastran: stiffness and mass between two grid points
# and six modes, as DMIG cards. It becomes a flexible body, which a servo swings about a hinge, a
# load at a corner. The same frame as full matrices, which the supplier kept, says what was lost.
#
# Run: `python demos/demo_superelement.py`
# Time: 10 s
# Writes: `frame.pch`, `frame.op4` and `superelement.png` into `out/`; another folder with `--out`

import argparse
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.linalg import eigh

import rom
from rom import view
from rom.io import write_dmig, write_op4

options = argparse.ArgumentParser(description="a frame from reduced matrices, in a mechanism")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
options.out.mkdir(parents=True, exist_ok=True)
say = print if not options.quiet else lambda *_: None

# ## At the supplier: a ladder of steel tubes
#
# Two rails of 0.8 m, 0.2 m apart, and three rungs, in beams of Euler and Bernoulli. The hinge is
# the middle of the first rung, the load the end of one rail, so that the frame bends and twists.

E, NU, RHO, OUTER, WALL, STEP = 210e9, 0.3, 7850.0, 0.016, 0.001, 0.05
AREA = np.pi * (OUTER**2 - (OUTER - 2 * WALL) ** 2) / 4
SECOND = np.pi * (OUTER**4 - (OUTER - 2 * WALL) ** 4) / 64
lines = [((0, s, 0), (0.8, s, 0)) for s in (-0.1, 0.1)]
lines += [((x, -0.1, 0), (x, 0.1, 0)) for x in (0.0, 0.4, 0.8)]
chains = [np.linspace(a, b, round(np.linalg.norm(np.subtract(b, a)) / STEP) + 1) for a, b in lines]
points, number = np.unique(np.vstack(chains).round(6), axis=0, return_inverse=True)
numbers = np.split(number.ravel(), np.cumsum([len(chain) for chain in chains])[:-1])
bars = [pair for chain in numbers for pair in pairwise(chain)]


def beam(L):
    """(12, 12) stiffness and mass of a tube along its own x, six rows for each end."""
    K, M = np.zeros((2, 12, 12))
    m, twist = RHO * AREA * L, 2 * SECOND / AREA
    for rows, k, j in (((0, 6), E * AREA, m), ((3, 9), E * SECOND / (1 + NU), m * twist)):
        K[np.ix_(rows, rows)] = k / L * np.array([[1, -1], [-1, 1]])
        M[np.ix_(rows, rows)] = j / 6 * np.array([[2, 1], [1, 2]])
    stiff = [[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]]
    heavy = [[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]
    for rows, s in (((1, 5, 7, 11), L), ((2, 4, 8, 10), -L)):  # turning about y moves z down
        turn = np.outer([1, s, 1, s], [1, s, 1, s])
        K[np.ix_(rows, rows)] = E * SECOND / L**3 * turn * stiff
        M[np.ix_(rows, rows)] = m / 420 * turn * heavy
    return K, M


K, M = np.zeros((2, 6 * len(points), 6 * len(points)))
for a, b in bars:
    x = (points[b] - points[a]) / (L := np.linalg.norm(points[b] - points[a]))
    axes = np.kron(np.eye(4), [x, np.cross((0, 0, 1), x), (0, 0, 1)])
    rows = np.r_[6 * a : 6 * a + 6, 6 * b : 6 * b + 6]
    for A, part in zip((K, M), beam(L), strict=True):
        A[np.ix_(rows, rows)] += axes.T @ part @ axes

# Craig and Bampton keep the six motions of both grid points, and six modes with them held.

HINGE, LOAD, N_MODES = (0.0, 0.0, 0.0), (0.8, 0.1, 0.0), 6
ends = [int(np.linalg.norm(points - p, axis=1).argmin()) for p in (HINGE, LOAD)]
kept = np.concatenate([6 * k + np.arange(6) for k in ends])
inside = np.setdiff1d(np.arange(len(K)), kept)
K_ii, M_ii = (A[np.ix_(inside, inside)] for A in (K, M))
T = np.zeros((len(K), 12 + N_MODES))
T[kept, np.arange(12)] = 1.0
T[inside, :12] = -np.linalg.solve(K_ii, K[np.ix_(inside, kept)])
T[inside, 12:] = eigh(K_ii, M_ii, subset_by_index=(0, N_MODES - 1))[1]
dofs = np.array([(label, c) for label in (1, 2) for c in range(1, 7)]
                + [(1001 + k, 0) for k in range(N_MODES)])  # fmt: skip
sent = write_dmig({"KAAX": T.T @ K @ T, "MAAX": T.T @ M @ T}, dofs, options.out / "frame.pch",
                  nodes={1: points[ends[0]], 2: points[ends[1]]})  # fmt: skip
whole = write_op4({"K": K, "M": M}, options.out / "frame.op4")

# ## What arrives becomes a body
#
# The certificate compares with what was given, the superelement, and says so in its last line.

KINDS = {"hinge": "rbe2", "load": "rbe2"}
labels = np.arange(len(points)) + 1
models = {
    "superelement": rom.read_model(
        (sent, "KAAX"), (sent, "MAAX"), nodes=sent, interfaces={"hinge": [1], "load": [2]}
    ),
    "full matrices": rom.read_model(
        (whole, "K"), (whole, "M"), nodes=(labels, points),
        interfaces={"hinge": [labels[ends[0]]], "load": [labels[ends[1]]]},
    ),
}  # fmt: skip
bodies = {
    name: rom.reduce(models[name], method=rom.CraigBampton(n), interfaces=KINDS, name="frame")
    for name, n in (("superelement", N_MODES), ("full matrices", 40))
}
say(bodies["superelement"].certificate)
hung = {name: body.frequencies(4, fixed=("hinge",)) for name, body in bodies.items()}
for name, model in models.items():
    say(f"{name:14s} {model.n_dofs:4d} dofs, clamped at the hinge",
        *(f"{f:7.2f}" for f in hung[name]), "Hz")  # fmt: skip

# ## In the mechanism
#
# A servo turns the hinge by 60 degrees in 0.5 s and stops; the load at the corner goes on swinging.

MASS, INERTIA, ANGLE, BUSY, TIME = 0.5, 2e-4, np.pi / 3, 0.5, 1.2


def turned(t):
    """Angle of the hinge [rad], with speeds and accelerations that begin and end at zero."""
    x = np.clip(t / BUSY, 0.0, 1.0)
    return ANGLE * x**3 * (10 - 15 * x + 6 * x**2)


path, bent = {}, {}
for name, body in bodies.items():
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    frame = mech.add_flexible("frame", body)
    load = mech.add_rigid("load", MASS, (INERTIA,) * 3, LOAD, markers={"centre": (0, 0, 0)})
    mech.revolute("hinge", mech.ground.marker(HINGE), frame.marker("hinge"), axis=(0, 1, 0))
    mech.drive("servo", "hinge", turned)
    mech.fixed("clamp", frame.marker("load"), load.marker("centre"))
    sol = rom.simulate(mech, t_end=TIME, dt=5e-4)
    path[name], A = sol.position("frame", "load"), sol.axes("frame", "hinge")
    bent[name] = 1e3 * np.einsum("tj,tj->t", path[name], A[:, :, 2])  # across, seen from the hinge
apart = 1e3 * np.linalg.norm(path["superelement"] - path["full matrices"], axis=1)
bending = np.ptp(bent["full matrices"])
say(f"the load swings over {bending:.2f} mm; the models are at most {apart.max():.4f} mm apart")

places = {}
for instant in (0.0, 0.2, 0.28, 0.5):
    Q = A[np.searchsorted(sol.t, instant - 1e-9)]
    tubes = [view.tube(np.array(line) @ Q.T, OUTER) for line in lines]
    places[f"after {instant:g} s"] = view.joined(tubes)
view.history(
    sol.t,
    [
        ("height of the load [m]", {name: x[:, 2] for name, x in path.items()}),
        ("bending at the load [mm]", bent),
        ("distance of the two [mm]", {"": apart}),
    ],
    options.out / "superelement.png",
    title="A frame of which only reduced matrices are known, swung by a servo",
    beside=view.Scene("The frame; 0.5 kg at its far corner", places, view=(0.5, -1.0, 0.35),
                      up=(0, 0, 1)),
    caption=f"A ladder of steel tubes, {len(K)} rows, arrives as DMIG cards: two grid points and "
    f"{N_MODES} modes, {len(dofs)} rows. Above and middle: the body made of them, and the one "
    "made of full matrices; bending is seen from the hinge and goes on when the servo has stopped "
    "after 0.5 s. Below: how far the loads of the two are apart. Right: the frame at four "
    "instants, its bending left out.",
)  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.
# The ringing is that of all rows with the load, the hinge held. The models are apart while the
# frame turns fast, and as far with 6 modes of the full matrices: what a superelement lacks is where
# the mass of its modes is, which centrifugal force asks for.

late = sol.t > BUSY
ringing = bent["superelement"][late] - bent["superelement"][late].mean()
(ups,) = np.nonzero((ringing[:-1] < 0) & (ringing[1:] >= 0))
crossed = ups - ringing[ups] / (ringing[ups + 1] - ringing[ups])
M[kept[6:], kept[6:]] += np.r_[np.full(3, MASS), np.full(3, INERTIA)]
free = np.setdiff1d(np.arange(len(K)), kept[:6])
lam = eigh(K[np.ix_(free, free)], M[np.ix_(free, free)], eigvals_only=True)
length = sum(np.linalg.norm(np.subtract(b, a)) for a, b in lines)
results = {
    "mass of the frame [kg]": (bodies["superelement"].mass, RHO * AREA * length, 1e-8),
    "worst of four frequencies": (
        1 + np.abs(hung["superelement"] / hung["full matrices"] - 1).max(), 1.0, 2e-3,
    ),
    "ringing of the load [Hz]": (
        (len(ups) - 1) / (crossed[-1] - crossed[0]) / 5e-4, np.sqrt(lam[0]) / (2 * np.pi), 0.02,
    ),
    "distance of the models over the bending": (1 + apart.max() / bending, 1.0, 0.01),
}  # fmt: skip
for name, (value, expected, tolerance) in results.items():
    print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
