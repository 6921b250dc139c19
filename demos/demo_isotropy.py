# # Dynamic isotropy: postures in which two motors feel the same inertia
#
# A five-bar linkage carries a tool on two couplers; two motors on the base turn its cranks. In most
# postures an acceleration costs more torque in one direction than in another, and one motor
# disturbs the other. After Di Gregorio, Cammarata and Sinatra we look for the postures where it
# does not: where the generalised inertia is a multiple of the identity.
#
# Run: `python demos/demo_isotropy.py`
# Time: 15 s
# Writes: `isotropy.png` and `isotropy_compared.png` into `out/`; another folder with `--out`

import argparse
from pathlib import Path

from mpi4py import MPI

import numpy as np

import rom
from rom import view
from rom.components.linkages import (
    CrossSlides,
    FiveBar,
    PolarArm,
    SlideFiveBar,
    TwoLink,
    closed_loci,
    index_map,
    isotropic_configurations,
    isotropic_set,
    isotropy_index,
    reduced_link,
    rod,
    tool_isotropy,
)

options = argparse.ArgumentParser(description="isotropic postures of linkages")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
finite_elements = rom.fe.model  # PETSc starts here, on all processes together
if MPI.COMM_WORLD.rank > 0:
    raise SystemExit  # this is work for one process
say = (lambda *_: None) if options.quiet else print

# ## The linkage
#
# Base 0.7 m; cranks of 0.3 m and 2 kg, couplers of 0.8 m and 1 kg, uniform rods; a tool of 0.5 kg.
# The couplers are so long that the motors may turn freely: all postures form a torus.

crank, coupler, tool = rod(2.0, 0.3), rod(1.0, 0.8), 0.5
rigid = FiveBar(0.7, (crank, crank), (coupler, coupler), tool)

# The same with couplers of a gmsh geometry, forged aluminium rods with two eyes, the big one
# towards the crank: meshed, assembled with dolfinx and reduced to both bores and four modes. Their
# elastic coordinates are held, what slow motors feel, or vibrate with torques of some frequency.

model = finite_elements(
    Path(__file__).parents[1] / "meshes" / "connecting_rod.geo",
    material=rom.Material(E=70e9, nu=0.33, rho=2700.0), parameters={"L": 0.8, "lc": 0.02},
    comm=MPI.COMM_SELF,
)  # fmt: skip
body = rom.reduce(
    model, method=rom.CraigBampton(4), interfaces={"pin_a": "rbe2", "pin_b": "rbe2"},
    reference="pin_a", certify=False,
)  # fmt: skip
eyes = reduced_link(body, "pin_a", "pin_b")
solid = FiveBar(0.7, (crank, crank), (eyes, eyes), tool)


FAST = 50.0  # of torques [Hz]


def fast(q1, q2):
    return solid.inertia(q1, q2, elastic=2 * np.pi * FAST)


# ## Map, level curves, isotropic postures

LEVELS = {"rods": (0.5, 0.7, 0.9, 0.97, 0.995), "gmsh": (0.5, 0.7, 0.9, 0.97, 0.995)}
maps, loci, found = {}, {}, {}
for name, inertia in {"rods": rigid.inertia, "gmsh": solid.inertia}.items():
    maps[name] = index_map(inertia)
    loci[name] = {level: closed_loci(maps[name], level) for level in LEVELS[name]}
    curves = [curve for closed in loci[name].values() for curve in closed]
    found[name] = isotropic_configurations(inertia, n=200)
    say(f"couplers, {name}: index from {maps[name].min():.3f}, {len(curves)} closed curves")
    for q, a, w in zip(np.degrees(found[name].q), found[name].inertia, found[name].winding,
                       strict=True):  # fmt: skip
        say(f"  q = ({q[0]:9.5f}, {q[1]:9.5f}) deg, inertia {a:.6f} kg m^2, winding {w:+d}")
eased, slow = index_map(fast, n=60), index_map(solid.inertia, n=60)
say(f"at {FAST:g} Hz the couplers change the index by {np.abs(eased - slow).max():.3f} at most")

# ## Drives that slide
#
# Two slides of 1.3 kg on one rail, couplers of 0.6 m and 0.8 kg: the inertia depends on how far the
# slides are apart, so the isotropic postures fill a line, cot^2 of the couplers' slope =
# (4/3 mu + M) / (2/3 mu + M).

mu, reach = 0.8, 0.6
glide = SlideFiveBar(((0, 0, 0), (0, 0, 0)), (1.3, 1.3), (rod(mu, reach), rod(mu, reach)), tool)
stroke = ((0.0, 0.3), (0.85, 1.15))
glide_map = index_map(glide.inertia, stroke, n=200)
glide_loci = {level: closed_loci(glide_map, level, stroke) for level in (0.98, 0.995)}
on_line = isotropic_set(glide.inertia, stroke, n=60)
cot = np.sqrt((4 / 3 * mu + tool) / (2 / 3 * mu + tool))
apart = 2 * reach * cot / np.hypot(1, cot)
say(
    f"two slides on a rail: isotropic {on_line.kind}, "
    f"{np.ptp(on_line.q, axis=1).mean():.6f} m apart"
)

# ## Which mechanism is the most equal?
#
# Machines of 6 kg that move, of five topologies. The figure is the mean isotropy of the inertia
# which the tool feels over the area it reaches; a heavy tool makes all of them alike.

TURN = None


def machines(load):
    """Mechanism and ranges of its drives by name, for the mass of the tool [kg]."""
    two = TwoLink(rod(3.5, 0.5), rod(2.5, 0.5), load)
    five = FiveBar(0.7, (crank, crank), (coupler, coupler), load)
    slide = SlideFiveBar(((0, 0, 0), (0, 0, 0)), (2.0, 2.0), (rod(1.0, reach),) * 2, load)
    polar = PolarArm(guide=3.0 * 0.6**2 / 3, slide=3.0 + load, spin=3.0 * 0.3**2 / 12)
    return {
        "2R, chain": (two, (TURN, (0.2, 2.9))), "5R, two cranks": (five, (TURN, TURN)),
        "PRRRP, one rail": (slide, stroke), "RP, polar": (polar, (TURN, (0.2, 0.7))),
        "PP, cross slides": (CrossSlides((4.0, 2.0 + load)), ((0, 0.5), (0, 0.5))),
    }  # fmt: skip


loads = np.union1d(np.geomspace(0.1, 8.0, 24), 2.0)
figures = {name: [] for name in machines(1.0)}
for load in loads:
    for name, (one, span) in machines(load).items():
        figures[name].append(tool_isotropy(one.inertia, one.tip, span, n=40).mean)
for name, values in figures.items():
    say(f"{name:18s} isotropy at the tool " + " ".join(f"{v:.3f}" for v in values[::4]))

# ## The picture

worst = np.array(np.unravel_index(np.argmin(maps["rods"]), (400, 400))) * 2 * np.pi / 400
best = found["rods"].q[2]


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


lowest = maps["rods"].min()
names = {"isotropic, index 1": best, f"worst, index {lowest:.2f}": worst}
things = {}
for (name, q), colour, aside in zip(names.items(), ("#2f7f9f", "#d1495b"), (0.0, 1.1), strict=True):
    links, motors = machine(q, aside)
    things |= {name: view.Thing(*links, colour), f"_motors, {name}": view.Thing(*motors, "#9aa5b1")}
options.out.mkdir(parents=True, exist_ok=True)
view.plane(
    [
        torus("rods", "Couplers that are rods"),
        torus("gmsh", "Couplers from gmsh, reduced"),
        view.Drawing("Two slides on one rail", "left slide [m]", "right slide [m]",
                     (*stroke[0], *stroke[1]), glide_map, "isotropy index",
                     levels=glide_loci | {1.0: [on_line.q[np.argsort(on_line.q[:, 0])]]}),
        view.Drawing(f"Couplers from gmsh at {FAST:g} Hz", "left crank [deg]",
                     "right crank [deg]", (0.0, 360.0, 0.0, 360.0), eased, "isotropy index"),
        view.Scene("The linkage in two postures", things, view=(0.35, 0.3, 1.0), up=(0, 1, 0)),
        view.Drawing("Accelerations caused by torques of equal size", "left motor, over the mean",
                     "right motor, over the mean",
                     curves={f"_{name}": [answer(q)] for name, q in names.items()}),
    ],
    options.out / "isotropy.png",
    title="Where two motors of a linkage feel the same inertia",
    caption="Top: isotropy index 2 sqrt(det A) / tr A of the generalised inertia A over the angles "
    "of both cranks of a five-bar; left and right edges belong together, as do top and bottom. "
    "Level curves of cranks are all closed. Marks: the isotropic postures, where the vector "
    "(a11 - a22, 2 a12) turns once to the left or to the right, as often one as the other. With "
    "two slides on a rail these postures fill a line. In the linkage motors are grey, the tool is "
    "at the top. Torques of the same size in all directions accelerate an isotropic posture "
    "equally, on a circle. At 50 Hz elastic couplers vibrate with the torques.",
)  # fmt: skip
view.panels(
    [[
        view.Panel("Isotropy at the tool", "mass of the tool [kg]", "figure of merit",
                   {name: (loads, np.array(v)) for name, v in figures.items()}),
    ]],
    options.out / "isotropy_compared.png",
    title="Which mechanism treats all directions most alike?",
    caption="Five mechanisms of two drives and 6 kg. The figure is the isotropy index of the "
    "inertia that the tool feels, averaged over the area it reaches with the strokes chosen here; "
    "it has no unit and does not depend on coordinates, gears or size.",
)  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.
# In four postures the tool does not move at first whatever the motors do; each motor then feels
# (m1 + m2) l1^2 / 3.

still = (2.0 + 1.0) * 0.3**2 / 3
values = np.sort(found["rods"].inertia)
results = {
    "isotropic postures, couplers that are rods": (len(found["rods"].q), 8, 0.0),
    "1 + sum of windings, couplers that are rods": (1 + found["rods"].winding.sum(), 1, 0.0),
    "1 + sum of windings, couplers from gmsh": (1 + found["gmsh"].winding.sum(), 1, 0.0),
    "mass of a coupler [kg]": (eyes.M[0, 0], model.mass(), 1e-9),
    "distance of the slides on the line [m]": (np.ptp(on_line.q, axis=1).mean(), apart, 1e-8),
    "loci of two slides that run from limit to limit": (
        np.mean([np.isclose(c[[0, -1], :, None], np.array(stroke)).any(axis=2).any(axis=1).all()
                 for c in [c for curves in glide_loci.values() for c in curves]]), 1.0, 1e-12),
    "figure of cross slides, tool 2 kg": (
        figures["PP, cross slides"][np.argmin(abs(loads - 2.0))], 2 * np.sqrt(4 * 8) / 12, 1e-9),
    "inertia with the tool at rest [kg m^2]": (values[:4].max(), still, 1e-9),
    "largest isotropic inertia [kg m^2]": (values[-1], 0.224984, 3e-6),
    "loci that close": (
        np.mean([np.allclose(np.exp(1j * c[0]), np.exp(1j * c[-1])) for c in
                 [curve for closed in loci["rods"].values() for curve in closed]]),
        1.0, 1e-12),
    "index of the isotropic postures": (isotropy_index(rigid.inertia(*best)), 1.0, 1e-12),
}  # fmt: skip
for name, (value, expected, tolerance) in results.items():
    print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
