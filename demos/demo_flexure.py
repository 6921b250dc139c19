# # A stage on two leaves, cut from one plate
#
# Two leaves guide a stage across without play or friction. It does not go straight: as they keep
# their length, it comes back towards its base, and a linear body does not know that. With
# `rom.Geometric` the reduced plate does, and its certificate says how far out it may be believed.
#
# Run: `python demos/demo_flexure.py`, or under `mpirun -n 2`
# Time: 40 s
# Writes: `flexure.png` into `out/`; another folder with `--out`

import argparse
from pathlib import Path

from mpi4py import MPI

import numpy as np
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

import rom
from rom import view
from rom.checks.deflection import DISPLACEMENT_RTOL, TANGENT_RTOL

options = argparse.ArgumentParser(description="a parallel-guiding stage of two leaf flexures")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
first = MPI.COMM_WORLD.rank == 0
say = print if first and not options.quiet else lambda *_: None

# ## What a line says of it
#
# A leaf is held at its root and guided at its end. For small deflections d its force is
# 12 E I d / L^3, its end comes back by 0.6 d^2 / L, and at its root the stress is 3 E t d / L^2;
# 13/35 of its mass move with the stage. At any deflection it is two cantilevers of half its length,
# end to end, whose elastica is one of elliptic integrals.

E, rho = 71.7e9, 2810.0  # of aluminium 7075 [Pa, kg/m^3]
L, t, b = 0.05, 0.001, 0.005  # length and thickness of the leaves, thickness of the plate [m]
s, w, a = 0.024, 0.008, 0.008  # distance of the leaves, blocks along them, width of the tongue [m]
EI = E * b * t**3 / 12
FAR = 0.1 * L  # how far the stage is to go [m]
stiffness = 24 * EI / L**3
leaf, stage = rho * b * t * L, rho * b * (w * (s + t) + a * L / 2)
guiding = np.sqrt(stiffness / (stage + 2 * 13 / 35 * leaf)) / (2 * np.pi)


def elastica(slope):
    """Force on two leaves [N], deflection and shortening [m], by their slope half way [rad]."""
    m = (1 + np.sin(slope)) / 2
    start = np.arcsin(np.sqrt(0.5 / m))
    c = ellipk(m) - ellipkinc(start, m)  # squared: force on a half, times its length^2 / EI
    across = 1 - 2 * (ellipe(m) - ellipeinc(start, m)) / c
    along = 2 * np.sqrt(m) * np.cos(start) / c
    return 2 * EI * (2 * c / L) ** 2, across * L, (1 - along) * L


# ## The plate as a body
#
# It is held at the back of its base and pushed at the end of its tongue, half way along the leaves,
# where a force across does not pitch the stage.

plate = rom.fe.model(Path(__file__).parents[1] / "meshes" / "flexure.geo", degree=2,
                     material=rom.Material(E=E, nu=0.33, rho=rho),
                     parameters={"L": L, "t": t, "b": b, "s": s, "w": w, "a": a})  # fmt: skip
push = stiffness * FAR
body = rom.reduce(
    plate,
    method=rom.CraigBampton(n_modes=16),
    interfaces={"base": "rbe3", "drive": "rbe3"},
    reference="base",
    nonlinear=rom.Geometric(loads={"drive": (0, push, 0, 0, 0, 0)}, n_modes=4, tol=1e-5),
    stress=True,
    name="plate",
)
say(f"{plate.n_dofs} dofs, {body.n_modes} coordinates")
say(body.certificate)
compared = body.provenance["large deflection"]["drive f_y"]

# ## Through its range
#
# The force grows to its largest value, and at each step the mechanism comes to rest. The linear
# body is the same one without its energy of higher order.

mech = rom.Mechanism(gravity=(0, 0, 0))
part = mech.add_flexible("plate", body)
mech.fixed("bench", mech.ground.marker(part.point(part.marker("base"))), part.marker("base"))
mech.force("push", part.marker("drive"), lambda share: (0, push * share, 0))
shares = np.r_[1e-2, np.linspace(0.1, 1.0, 10)]
states, state = [], None
for share in shares:
    state = rom.equilibrium(mech, state, t=share)
    states.append(state)
drive = body.marker("drive")
q = np.array([state.q[7:] for state in states])
place = np.array([rom.snapshot(mech, state).position("plate", "drive")[0] for state in states])
back, across, _ = (place - drive.point).T * [[-1], [1], [1]]
force = push * shares
line = np.array([elastica(x) for x in np.linspace(1e-3, 0.151, 60)]).T
hardens = force / across * across[0] / force[0]
frequency = [rom.linearize(mech, state, n=1).frequencies[0] for state in states]
say("force [N]  deflection [mm]  back [mm]  frequency [Hz]")
for row in zip(force, 1e3 * across, 1e3 * back, frequency, strict=True):
    say("{:9.3f} {:15.3f} {:10.4f} {:15.2f}".format(*row))

# ## A pull along the leaves
#
# The range does not name it. At rest the leaves bear it by stretching alone; pushed across, the
# stage slides along its arc x = -f(d), which adds f'(d)^2 over the stiffness across.


def softness(q):
    """Motion along per force along [m/N], about the body at rest at the coordinates q."""
    along = drive.translation[0]
    return along @ np.linalg.solve(body.energy().tangent(q), along)


of_line = [np.interp(across[-1], line[1], np.gradient(line[k], line[1])) for k in (2, 0)]
softer, slides = softness(q[-1]), softness(0 * q[-1]) + of_line[0] ** 2 / of_line[1]
say(f"along it is {softer / softness(0 * q[-1]):.1f} times as soft as at rest")

# ## Stress in a leaf
#
# Along the middle of its outer face it falls from the root to nothing half way. Within a thickness
# or two of the root the blocks keep the leaf as wide as it was, which lowers von Mises stress by up
# to the factor sqrt(1 - nu + nu^2), and the corner is sharp. What the leaf says further out is
# therefore drawn out to the root.

points, sigma = body.stress.points, body.stress.von_mises(q[-1])
face = np.flatnonzero(
    np.isclose(points[:, 1], (s + t) / 2) & np.isclose(points[:, 2], 0)
    & (points[:, 0] > -1e-9) & (points[:, 0] < L + 1e-9)
)  # fmt: skip
face = face[np.argsort(points[face, 0])]
x = points[face, 0]
falls = 1 - 2 * x / L
inner = (np.abs(falls) > 0.3) & (np.abs(falls) < 0.8)
root = np.abs(falls[inner]) @ sigma[face][inner] / (falls[inner] @ falls[inner])
at_root = 3 * E * t * across[-1] / L**2
say(f"stress at the root {1e-6 * root:.1f} MPa, of a line {1e-6 * at_root:.1f} MPa")

if first:
    options.out.mkdir(parents=True, exist_ok=True)
    surface, moved = body.surface, (body.surface.shape @ q[-1]).reshape(-1, 3)
    d = np.linspace(0, across[-1], 40)
    view.panels(
        [[
            view.Scene(
                f"Pushed by {force[-1]:.1f} N, in true size", {
                    "at rest": view.Thing(surface.points, surface.triangles, "#c9d1da",
                                          opacity=0.35),
                    "pushed": view.Thing(surface.points + moved, surface.triangles,
                                         values=1e-6 * sigma),
                }, label="von Mises stress [MPa]", view=(0.25, -0.5, 1.0), up=(0, 1, 0)),
            view.Panel(
                "Stress along a leaf, outer face", "distance from the root [mm]",
                "von Mises stress [MPa]",
                curves={"3 E t d (1 - 2 x / L) / L^2": (1e3 * x, 1e-6 * at_root * np.abs(falls))},
                points={"reduced body": (1e3 * x, 1e-6 * sigma[face])}),
        ], [
            view.Panel(
                "Force", "deflection of the stage [mm]", "force [N]",
                curves={"24 E I d / L^3": (1e3 * d, stiffness * d),
                        "linear body": (1e3 * (drive.translation[1] @ np.linalg.solve(
                            body.K, body.forces_on({"drive": (0, push, 0, 0, 0, 0)}))) * shares,
                            force)},
                points={"reduced body": (1e3 * across, force)}),
            view.Panel(
                "Parasitic motion", "deflection of the stage [mm]", "towards the base [mm]",
                curves={"0.6 d^2 / L": (1e3 * d, 600 * d**2 / L),
                        "linear body": (1e3 * d, 0 * d)},
                points={"reduced body": (1e3 * across, 1e3 * back)}),
        ], [
            view.Panel(
                "The leaves harden", "deflection of the stage [mm]",
                "force over deflection, at rest = 1",
                curves={"elastica": (1e3 * line[1], line[0] / (stiffness * line[1])),
                        "small deflections": (1e3 * d, 0 * d + 1)},
                points={"reduced body": (1e3 * across, hardens)}),
            view.Panel(
                "Certificate of the range", "share of the largest force [1]",
                "error against the full model [1]",
                curves={"displacement": (compared["share"], compared["displacement"]),
                        "frequencies about it": (compared["share"], compared["frequencies"]),
                        "limit of displacement": ([0.3, 1], [DISPLACEMENT_RTOL] * 2),
                        "limit of frequencies": ([0.3, 1], [TANGENT_RTOL] * 2)}, log=True),
        ]],
        options.out / "flexure.png",
        title="A stage on two leaves, cut from one plate",
        caption=f"A plate of aluminium, {1e3 * b:.0f} mm thick, with leaves {1e3 * L:.0f} mm long "
        f"and {1e3 * t:.0f} mm thick, held at the back of its base and pushed across at its "
        f"tongue, as one reduced body of {body.n_modes} coordinates in a mechanism. Top right: von "
        "Mises stress along the middle of the upper leaf; near the roots the blocks hinder it from "
        "changing its width, which lowers it. Below: force, motion towards the base and hardening "
        "against thin lines; a linear body goes straight. Bottom right: the reduced body against "
        "the finite elements at three loads, and what is allowed.",
    )  # fmt: skip

# ## What to remember
#
# The closed forms of small deflections hold within a per cent or two to a tenth of the length.
# Along its leaves the stage is twenty times softer there than at rest, and the body knows that too,
# although its range is one of a force across.
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.

results = {
    "mass [kg]": (body.mass, stage + 2 * leaf + rho * b * w * (s + t), 1e-9),
    "stiffness of the stage [N/m]": (force[0] / across[0], stiffness, 0.01),
    "its frequency [Hz]": (frequency[0], guiding, 0.01),
    "force over the linear one at the end": (
        hardens[-1],
        np.interp(across[-1], line[1], line[0] / (stiffness * line[1])), 2e-3),
    "motion towards the base [m]": (back[-1], np.interp(across[-1], line[1], line[2]), 0.02),
    "the same against 0.6 d^2 / L": (back[-1], 0.6 * across[-1] ** 2 / L, 0.02),
    "softness along the leaves at the end [m/N]": (softer, slides, 0.02),
    "stress at the root [Pa]": (root, at_root, 0.03),
    "share of the range that is certified": (compared["holds to"], 1.0, 1e-12),
}  # fmt: skip
if first:
    for name, (value, expected, tolerance) in results.items():
        print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
