# # Reference conditions: the floating frame is a choice
#
# O'Shea, Jayakumar, Mechergui, Shabana and Wang (J. Comput. Nonlinear Dynam. 13, 2018, 041007)
# argue that a reduced flexible body needs reference conditions, and that the choice decides what
# its shapes can represent. Each claim becomes a number here, on a uniform planar beam with
# L = EI = m = 1, whose frequencies are known in closed form.
#
# Run: `python demos/demo_reference_conditions.py`
# Writes: `reference_conditions.png` into `out/`; another folder with `--out`

import argparse
from pathlib import Path

import numpy as np
from scipy.linalg import eigh, null_space

import rom
from rom import view

options = argparse.ArgumentParser(description="claims about reference conditions, as numbers")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
say = (lambda *_: None) if options.quiet else print

# ## The beam
#
# Forty Hermite elements, deflection w and slope per node; nothing is held.

N = 40
h = 1.0 / N
k_e = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]]) / h**3
m_e = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]])
unit = np.outer([1, h, 1, h], [1, h, 1, h])
K, M = np.zeros((2, 2 * N + 2, 2 * N + 2))
for e in range(N):
    dofs = slice(2 * e, 2 * e + 4)
    K[dofs, dofs] += k_e * unit
    M[dofs, dofs] += m_e * unit * h / 420
W0, S0, W1, S1 = ends = [0, 1, 2 * N, 2 * N + 1]
x = np.linspace(0, 1, N + 1)
rigid = np.zeros((2 * N + 2, 2))
rigid[0::2, 0], rigid[0::2, 1], rigid[1::2, 1] = 1.0, x, 1.0
FREE, CANTILEVER, PINNED = 4.730040745**2, 1.875104069**2, np.pi**2


def omega(K, M):
    """Frequencies, ascending; motions without stiffness come out as zero."""
    lam = eigh(K, M, eigvals_only=True)
    return np.sqrt(np.where(lam > 1e-6, lam, 0.0))


def project(basis):
    return basis.T @ K @ basis, basis.T @ M @ basis


# ## A square Craig-Bampton transformation changes nothing
#
# With all fixed-interface modes kept the transformation is a similarity.

square = rom.craig_bampton(K, M, ends, 2 * N - 2)
full, same = omega(K, M)[2:], omega(square.project(K), square.project(M))[2:]
similarity = np.abs((same / full) ** 2 - 1).max()
say(f"all modes kept: eigenvalues differ by {similarity:.1e}")

# ## Without reference conditions, Craig-Bampton gives the free-free modes
#
# Two zero frequencies stay, and the first elastic one tends to that of the free beam. Conditions on
# the boundary coordinates turn it into that boundary-value problem.

counts = (0, 1, 2, 4, 8)
free, held, pinned = {}, {}, {}
for n in counts:
    basis = rom.craig_bampton(K, M, ends, n)
    K_r, M_r = basis.project(K), basis.project(M)
    free[n] = omega(K_r, M_r)[2] / FREE - 1
    for found, dropped, exact in ((held, [0, 1], CANTILEVER), (pinned, [0, 2], PINNED)):
        kept = np.setdiff1d(np.arange(len(K_r)), dropped)
        found[n] = omega(K_r[np.ix_(kept, kept)], M_r[np.ix_(kept, kept)])[0] / exact - 1
    say(f"{n} modes: free {free[n]:8.1e}, cantilever {held[n]:8.1e}, pinned {pinned[n]:8.1e}")

# ## Different conditions, one resonance
#
# The body floats: two rigid motions of its frame and k shapes that obey a reference condition. The
# joints of the mechanism then hold it. Shapes whose limit contains the motion sought lead to the
# same resonance, whatever the condition; clamped-clamped shapes vanish with their slope at both
# ends and never do.

sets = {"free-free": [], "pinned-pinned": [W0, W1], "cantilever": [W0, S0], "clamped-clamped": ends}
shapes = {}
for name, zero in sets.items():
    kept = np.setdiff1d(np.arange(2 * N + 2), zero)
    V = eigh(K[np.ix_(kept, kept)], M[np.ix_(kept, kept)])[1]
    shapes[name] = np.zeros((2 * N + 2, kept.size))
    shapes[name][kept] = V
shapes["free-free"] = shapes["free-free"][:, 2:]
numbers = (1, 2, 3, 4, 6, 8, 12, 20)
joints = {"pinned at both ends": ([W0, W1], PINNED), "clamped at one end": ([W0, S0], CANTILEVER)}
error = {}
for joint, (zero, exact) in joints.items():
    for name in sets:
        for k in numbers:
            floating = np.hstack([rigid, shapes[name][:, :k]])
            error[joint, name, k] = omega(*project(floating @ null_space(floating[zero])))[0]
            error[joint, name, k] = error[joint, name, k] / exact - 1
        row = " ".join(f"{100 * error[joint, name, k]:9.4f}" for k in numbers)
        say(f"{joint:20s} {name:16s} {row}  per cent")

# ## Where free-free modes fail
#
# A clamped joint with a unit load at the tip: free-free shapes have no curvature at their ends, so
# the stress recovered at the clamp is zero for any number of them, and the deflection converges as
# slowly as 1/k.

tip, root = {}, {}
load = np.zeros(2 * N + 2)
load[W1] = 1.0
for name in ("free-free", "cantilever"):
    for k in (1, 2, 4, 8, 16, 32):
        floating = np.hstack([rigid, shapes[name][:, :k]])
        allowed = floating @ null_space(floating[[W0, S0]])
        u = allowed @ np.linalg.solve(allowed.T @ K @ allowed, allowed.T @ load)
        tip[name, k] = u[W1] * 3.0  # exact deflection 1 / 3
        # second derivative of the Hermite interpolation at x = 0, exact value F (L - x) = 1
        root[name, k] = (-6 * u[0] - 4 * h * u[1] + 6 * u[2] - 2 * h * u[3]) / h**2
    say(f"{name}: tip", *(f"{tip[name, k]:.4f}" for k in (1, 2, 4, 8, 16, 32)),
        f"root moment with 8 shapes {root[name, 8]:.4f}")  # fmt: skip

# ## Rigid motion left in the shapes
#
# The frame already describes it: the mass matrix of frame and shapes is singular.

doubled = np.hstack([rigid, eigh(K, M)[1][:, :6]])
spectrum = np.linalg.svd(project(doubled)[1], compute_uv=False)
singular = spectrum[-1] / spectrum[0]
say(f"rigid modes kept beside the frame: singular value ratio {singular:.1e}")

# ## The picture

options.out.mkdir(parents=True, exist_ok=True)
x, wedge = np.linspace(0, 1, N + 1), view.extruded([(-0.06, -0.08), (0.06, -0.08), (0, 0.02)], 0.1)
wall = view.box((0.04, 0.3, 0.2), (-0.02, 0, 0))


def held_beam(joint, supports):
    """The beam in its joints, bent as in its first mode."""
    zero = joints[joint][0]
    kept = np.setdiff1d(np.arange(2 * N + 2), zero)
    mode = np.zeros(2 * N + 2)
    mode[kept] = eigh(K[np.ix_(kept, kept)], M[np.ix_(kept, kept)])[1][:, 0]
    w = 0.15 * mode[::2] / np.abs(mode[::2]).max()
    bent, still = (np.column_stack([x, y, 0 * x]) for y in (w, 0 * w))
    lines = np.arange(N)[:, None] + np.arange(2)
    things = {"first mode": view.tube(bent, 0.03), "joints": view.joined(supports),
              "_still": view.Thing(still, lines, "#23282f")}  # fmt: skip
    title = f"{joint[0].upper()}{joint[1:]}"
    return view.Scene(title, things, view=(0.25, 0.35, 1.0), up=(0, 1, 0))


supports = {"pinned at both ends": [wedge, (wedge[0] + np.array([1, 0, 0]), wedge[1])],
            "clamped at one end": [wall]}  # fmt: skip
view.convergence(
    [
        (
            f"error, {joint}",
            {name: (numbers, [error[joint, name, k] for k in numbers]) for name in sets},
        )
        for joint in joints
    ],
    options.out / "reference_conditions.png",
    xlabel="number of shapes beside the rigid motion of the frame",
    title="One resonance from different reference conditions",
    beside=[held_beam(joint, metal) for joint, metal in supports.items()],
    caption="First natural frequency of a uniform beam held by joints, relative error against the "
    "closed form. The floating frame carries shapes that obey four different reference "
    "conditions. Clamped-clamped shapes cannot represent the motion and stay wrong; free-free "
    "shapes converge slowly in a clamped joint. Shapes that obey the conditions of the joints are "
    "left with the error of the forty finite elements.",
)

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.
# In pinned joints one free-free shape gives 22.3733 / sqrt(5).

results = {
    "square transformation, 1 + change": (1 + similarity, 1.0, 1e-8),
    "Guyan, first free frequency": ((1 + free[0]) * FREE, np.sqrt(720), 1e-6),
    "eight modes, first free frequency": ((1 + free[8]) * FREE, 22.37387, 1e-5),
    "eight modes, cantilever": ((1 + held[8]) * CANTILEVER, 3.516016, 1e-6),
    "Guyan, pinned": ((1 + pinned[0]) * PINNED, np.sqrt(120), 1e-6),
    "pinned joints, one free-free shape": (
        (1 + error["pinned at both ends", "free-free", 1]) * PINNED, FREE / np.sqrt(5), 1e-6),
    "pinned joints, 20 cantilever shapes, per cent": (
        100 * error["pinned at both ends", "cantilever", 20], 0.0017, 0.035),
    "pinned joints, clamped-clamped shapes, per cent": (
        100 * error["pinned at both ends", "clamped-clamped", 20], 126.7, 1e-3),
    "clamped joint, 20 free-free shapes, per cent": (
        100 * error["clamped at one end", "free-free", 20], 3.98, 2e-3),
    "clamped joint, 8 pinned shapes, per cent": (
        100 * error["clamped at one end", "pinned-pinned", 8], 5.11, 2e-3),
    "tip deflection, 8 free-free shapes": (tip["free-free", 8], 0.869, 1e-3),
    "root moment, 8 cantilever shapes": (root["cantilever", 8], 0.9969, 5e-3),
    "root moment, 8 free-free shapes, 1 + value": (1 + abs(root["free-free", 8]), 1.0, 0.05),
    "rigid modes kept, 1 + singular value ratio": (1 + singular, 1.0, 1e-12),
}  # fmt: skip
for name, (value, expected, tolerance) in results.items():
    print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
