# # Dynamic isotropy: postures in which two motors feel the same inertia
#
# A five-bar linkage carries a tool on two couplers; two motors on the base turn its cranks. In most
# postures an acceleration costs more torque in one direction than in another, and one motor
# disturbs the other. After Di Gregorio, Cammarata and Sinatra we look for the postures where it
# does not: where the generalised inertia is a multiple of the identity.
#
# Run: `python demos/demo_isotropy.py`
# Writes: `isotropy.png` into `out/`; another folder with `--out`

import argparse
from pathlib import Path

import numpy as np

from rom import view
from rom.components.linkages import (
    FiveBar,
    Link,
    angle_grid,
    closed_loci,
    isotropic_configurations,
    isotropy_index,
    rod,
)

options = argparse.ArgumentParser(description="isotropic postures of a five-bar linkage")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
say = (lambda *_: None) if options.quiet else print

# ## The linkage
#
# Base 0.7 m; cranks of 0.3 m and 2 kg, couplers of 0.8 m and 1 kg, uniform rods; a tool of 0.5 kg.
# The couplers are so long that the motors may turn freely: all postures form a torus.

crank, coupler, tool = rod(2.0, 0.3), rod(1.0, 0.8), 0.5
rigid = FiveBar(0.7, (crank, crank), (coupler, coupler), tool)

# The same with cranks that bend: one cantilever shape (3 s^2 - s^3) / 2, free to follow when the
# torque comes suddenly. A reduced body of finite elements would enter by `reduced_link`. The motors
# then hardly feel the tool, and since both cranks bend alike, the isotropic postures stay.

m, L = 2.0, 0.3
M = np.zeros((4, 4))
M[:3, :3] = crank.M
M[3] = M[:, 3] = [0.0, m * 3 / 8, m * L * 11 / 40, m * 33 / 140]
bending = Link(L, M, tip=np.array([[0.0], [1.0]]))
soft = FiveBar(0.7, (bending, bending), (coupler, coupler), tool)


def soft_inertia(q1, q2):
    return soft.inertia(q1, q2, elastic="free")


# ## Map, level curves, isotropic postures

LEVELS = {"rigid": (0.5, 0.7, 0.9, 0.97, 0.995), "bending": (0.9955, 0.997, 0.9985, 0.9997)}
maps, loci, found = {}, {}, {}
for name, inertia in {"rigid": rigid.inertia, "bending": soft_inertia}.items():
    maps[name] = isotropy_index(inertia(*angle_grid(400)))
    loci[name] = {level: closed_loci(maps[name], level) for level in LEVELS[name]}
    curves = [curve for closed in loci[name].values() for curve in closed]
    found[name] = isotropic_configurations(inertia, n=200)
    say(f"{name} cranks: index from {maps[name].min():.3f}, {len(curves)} closed curves")
    for q, a, w in zip(np.degrees(found[name].q), found[name].inertia, found[name].winding,
                       strict=True):  # fmt: skip
        say(f"  q = ({q[0]:9.5f}, {q[1]:9.5f}) deg, inertia {a:.6f} kg m^2, winding {w:+d}")

# ## The picture

worst = np.array(np.unravel_index(np.argmin(maps["rigid"]), (400, 400))) * 2 * np.pi / 400
best = found["rigid"].q[2]


def in_degrees(curves):
    """The curves where they lie and one turn aside, so that those on the seam are whole."""
    return [np.degrees(c) + 360.0 * np.array(s) for c in curves for s in np.ndindex(2, 2)] + [
        np.degrees(c) - 360.0 * np.array(s) for c in curves for s in np.ndindex(2, 2) if any(s)
    ]


def torus(name, title):
    q, w = np.degrees(found[name].q), found[name].winding
    return view.Drawing(
        title, "left crank [deg]", "right crank [deg]", (0.0, 360.0, 0.0, 360.0), maps[name],
        "isotropy index", levels={level: in_degrees(c) for level, c in loci[name].items()},
        points={"isotropic, winding +1": q[w > 0], "isotropic, winding -1": q[w < 0]},
    )  # fmt: skip


def answer(q):
    """Accelerations that torques of one size in all directions cause, over their mean."""
    angle = np.linspace(0, 2 * np.pi, 181)
    a = np.linalg.solve(rigid.inertia(*q), np.array([np.cos(angle), np.sin(angle)]))
    return (a / np.linalg.norm(a, axis=0).mean()).T


def machine(q, aside):
    """Links with their pins in one posture, and motors below the cranks."""
    P = np.column_stack([rigid.posture(*q), np.zeros(5)]) + np.array([aside, 0, 0])
    up = np.array([0, 0, 0.03])
    heights = (0, 1, 2, 0)  # cranks below, couplers above each other
    links = [view.cylinder(a + h * up, b + h * up, 0.035)
             for a, b, h in zip(P, P[1:], heights, strict=False)]  # fmt: skip
    pins = [view.cylinder(p - up, p + 3 * up, 0.05) for p in P]
    motors = [view.cylinder(p - 8 * up, p - up, 0.14) for p in (P[0], P[-1])]
    return view.joined(links + pins), view.joined(motors)


lowest = maps["rigid"].min()
names = {"isotropic, index 1": best, f"worst, index {lowest:.2f}": worst}
things = {}
for (name, q), colour, aside in zip(names.items(), ("#2f7f9f", "#d1495b"), (0.0, 1.1), strict=True):
    links, motors = machine(q, aside)
    things |= {name: view.Thing(*links, colour), f"_motors, {name}": view.Thing(*motors, "#9aa5b1")}
options.out.mkdir(parents=True, exist_ok=True)
view.plane(
    [
        torus("rigid", "Rigid cranks"),
        torus("bending", "Cranks that bend under sudden torque"),
        view.Scene("The linkage in two postures", things, view=(0.35, 0.3, 1.0), up=(0, 1, 0)),
        view.Drawing("Accelerations caused by torques of equal size", "left motor, over the mean",
                     "right motor, over the mean",
                     curves={f"_{name}": [answer(q)] for name, q in names.items()}),
    ],
    options.out / "isotropy.png",
    title="Where two motors of a five-bar linkage feel the same inertia",
    caption="Top: isotropy index 2 sqrt(det A) / tr A of the generalised inertia A over the angles "
    "of both cranks; left and right edges belong together, as do top and bottom. Level curves are "
    "all closed. Marks: the isotropic postures, index 1, where A is a multiple of the "
    "identity; the vector (a11 - a22, 2 a12) turns once to the left or to the right around them, "
    "as often one as the other. Bottom left: motors grey, the tool at the top. "
    "Bottom right: torques of the same size in all directions (both motors together, or one "
    "against the other) accelerate an isotropic posture equally, on a circle.",
)  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.
# In four postures the tool does not move at first whatever the motors do; each motor then feels
# (m1 + m2) l1^2 / 3.

still = (2.0 + 1.0) * 0.3**2 / 3
values = np.sort(found["rigid"].inertia)
results = {
    "isotropic postures, rigid cranks": (len(found["rigid"].q), 8, 0.0),
    "1 + sum of windings, rigid cranks": (1 + found["rigid"].winding.sum(), 1, 0.0),
    "1 + sum of windings, bending cranks": (1 + found["bending"].winding.sum(), 1, 0.0),
    "inertia with the tool at rest [kg m^2]": (values[:4].max(), still, 1e-9),
    "largest isotropic inertia [kg m^2]": (values[-1], 0.224984, 3e-6),
    "loci that close": (
        np.mean([np.allclose(np.exp(1j * c[0]), np.exp(1j * c[-1])) for c in
                 [curve for closed in loci["rigid"].values() for curve in closed]]),
        1.0, 1e-12),
    "1 + largest shift of postures by bending [rad]": (
        1 + np.abs(found["bending"].q - found["rigid"].q).max(), 1.0, 1e-8),
    "index of the isotropic postures": (isotropy_index(rigid.inertia(*best)), 1.0, 1e-12),
}  # fmt: skip
for name, (value, expected, tolerance) in results.items():
    print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
