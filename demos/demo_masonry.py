# # Dry masonry: the thinnest arch, a wall with an opening, a vault drawn in gmsh
#
# Stones press, rock and slip; nothing glues them. How thin may a semicircular arch be? Milankovitch
# answered by the line of thrust: 10.75 % of the radius of its centre line. Discontinuous
# deformation analysis, after Shi and, for masonry, Bagi, lets every stone move and agrees. A vault
# on buttresses is drawn in gmsh, and one of its stones is a reduced body of finite elements.
#
# Run: `python demos/demo_masonry.py`, or under `mpirun -n 2`
# Time: 1.5 min
# Writes: `masonry.png`, `masonry.gif` and `masonry_vault.png` into `out/`; another folder with
# `--out`

import argparse
from dataclasses import replace
from pathlib import Path

from mpi4py import MPI

import numpy as np

import rom
from rom import view
from rom.components.masonry import (
    PointLoad,
    Rock,
    arch,
    drawn,
    load_factor,
    minimum_thickness,
    ramp,
    reduced_stone,
    simulate,
    stands,
    wall,
)
from rom.fe import mesh as meshing

options = argparse.ArgumentParser(description="arches at their limit, and a wall with an opening")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
first = MPI.COMM_WORLD.rank == 0
say = print if first and not options.quiet else lambda *_: None

# ## Two arches
#
# Radius 5 m, stone of 10 GPa and 2000 kg/m^3, friction of 40 degrees. Each comes to rest as statics
# lets it for 0.2 s, and moves on for two seconds with a damping of 30 per second.

R = 5.0


def after_two_seconds(n, ratio):
    model = arch(n, R, ratio * R)
    still = simulate(model, t_end=0.2, dt=1e-3, damping=np.inf, save_every=200)
    return simulate(model, t_end=2.0, dt=1e-3, damping=30.0, save_every=500, q=still.q[-1])


speed = {}
for ratio in (0.1075, 0.10725):
    speed[ratio] = np.abs(after_two_seconds(10, ratio).v[1:]).max(axis=(1, 2))
    say(f"thickness {100 * ratio:.3f} % of the radius: speed",
        *(f"{v:.1e}" for v in speed[ratio]), "m/s")  # fmt: skip

resting = after_two_seconds(20, 0.115)
thin = arch(20, R, 0.1 * R)
falling = simulate(thin, t_end=0.96, dt=1e-3, save_every=30)


def thrust_of(k):
    """(21, 2) centres of pressure along the thin arch at a saved time, by one step from there."""
    one = simulate(thin, t_end=1e-3, dt=1e-3, q=falling.q[k], v=falling.v[k])
    joints = one.joints()
    return np.array([joints[k, k + 1][0] for k in range(21)])


# Where stones turn against each other a joint is a hinge: it opens on one side, and the line of
# thrust leaves the arch no more than to the corner that still touches.

lines = np.array([thrust_of(k) for k in range(1, falling.t.size)])
lines = np.concatenate([lines[:1], lines])
turns = np.degrees(np.diff(falling.q[..., 2], axis=1))
hinges = np.flatnonzero(np.abs(turns[-1]) > 5.0)
say("hinges at", *(f"{180 - 9 * k} degrees," for k in hinges), "from the right springing")

# ## The thinnest arch that friction allows
#
# Linear programming: do forces exist in all joints that press and stay within friction?

limit = minimum_thickness()
say(f"closed form: {limit.ratio:.6f}, hinges at {np.degrees(limit.hinge):.3f} degrees")


def thinnest(n, friction, accuracy=1e-5):
    low, high = 0.1, 0.25
    while high - low > accuracy:
        middle = (low + high) / 2
        able = stands(arch(n, R, middle * R, rock=Rock(friction=friction)))
        low, high = (low, middle) if able else (middle, high)
    return high


frictions = np.array(
    [0.311, 0.315, 0.32, 0.33, 0.34, 0.35, 0.36, 0.37, 0.38, 0.39, 0.395, 0.4, 0.43, 0.46]
)
needed = np.array([thinnest(40, mu, 1e-4) for mu in frictions])
for mu, ratio in zip(frictions, needed, strict=True):
    say(f"friction {mu:.3f}: {100 * ratio:.2f} % of the radius")

# ## A wall with an opening

bricks = wall(4.0, 10, openings=[(1.5, 2.5, 3, 7)])
standing = simulate(bricks, t_end=0.4, dt=4e-3, damping=np.inf, save_every=100)
pressure = -standing.stress()[1:, 1] / 1e3
joints = standing.joints()
weight = sum(s.M[0, 0] for s in bricks.stones[1:]) * 9.81
carried = sum(np.abs(f[1]) for (i, _), (_, f) in joints.items() if i == 0)
say(f"{len(bricks.stones) - 1} stones, largest mean pressure {pressure.max():.1f} kPa")

# ## A vault on buttresses, drawn in gmsh
#
# Every plane surface of the geometry is a stone. How narrow may the buttresses be? At the limit
# hinges open at the crown, in the haunches and at their outer feet: virtual work of one half gives
# the thrust and the width, linear programming must find the same.

MESHES = Path(__file__).parents[1] / "meshes"
THICK, HIGH, CROWN, DEEP = 0.8, 4.0, 8, 1.0  # thickness, springing [m]; stone left of the crown


def vault(width):
    mesh = meshing.read_triangles(MESHES / "buttressed_vault.geo", parameters={"b": width})
    return drawn(mesh.points, mesh.triangles, mesh.surfaces, held=("ground",))


def narrowest():
    """Width at which weight of half a vault and its buttress balance the largest thrust [m]."""
    inner, outer = R - THICK / 2, R + THICK / 2
    half = vault(2.4).stones[CROWN + 1 : 2 * CROWN + 1]
    W, x = np.array([s.M[0, 0] for s in half]), np.array([s.centre[0] for s in half])
    angle = np.arange(1, CROWN + 1) * np.pi / (2 * CROWN)
    moment = np.cumsum(W) * inner * np.sin(angle) - np.cumsum(W * x)
    thrust = (moment / (outer - inner * np.cos(angle))).max()
    a, b, c = Rock().rho * HIGH / 2, W.sum(), (W * (inner - x)).sum() - thrust * (HIGH + outer)
    return (-b + np.sqrt(b**2 - 4 * a * c)) / (2 * a)


def on_crown(history=1.0):
    return PointLoad(CROWN, (0.0, HIGH + R + THICK / 2), (0.0, -1e3), history)


low, high = THICK, 2.4
while high - low > 1e-3:
    middle = (low + high) / 2
    low, high = (low, middle) if stands(vault(middle)) else (middle, high)
widths = np.linspace(high, 2.6, 8)
borne = np.array([load_factor(vault(b), [on_crown()]) for b in widths])
say(f"buttresses of {high:.3f} m, {narrowest():.3f} m by virtual work, bear the vault; of "
    f"{widths[-1]:.1f} m a load of {borne[-1]:.1f} kN on its crown")  # fmt: skip

# ## One stone of it in space
#
# The stone left of the crown once more, as a solid: meshed by gmsh, assembled with dolfinx and
# reduced to its joints, six modes and what forces on its corners do. It takes the place of the
# stone of uniform strain, and carries half the load that the vault bears.

DRAWN = vault(2.4)
rock = Rock()
solid = rom.fe.model(
    MESHES / "voussoir.geo", degree=2, material=rom.Material(rock.E, rock.nu, rock.rho),
    parameters={"k": float(CROWN)}, comm=MPI.COMM_SELF,
)  # fmt: skip
corners = DRAWN.stones[CROWN].outline


def on_edges():
    """Forces along x and y at each corner of the outline, the same all along its edge in depth."""
    x, columns = solid.points, []
    for corner in corners:
        edge = np.flatnonzero(np.linalg.norm(x[:, :2] - corner, axis=1) < 1e-9)
        edge = edge[np.argsort(x[edge, 2])]
        shares = np.r_[1, np.tile((4, 2), len(edge) // 2)[:-1], 1]  # Simpson's, of degree 2
        for axis in range(2):
            force = np.zeros_like(x)
            force[edge, axis] = shares / shares.sum()
            columns.append(force.ravel())
    return np.column_stack(columns)


body = rom.reduce(
    solid, method=rom.WithLoads(rom.CraigBampton(6), on_edges()), stress=True, certify=False,
    interfaces={"left": "rbe3", "right": "rbe3"},
).with_reference("mean-axis")  # fmt: skip
space = replace(DRAWN, stones=tuple(
    reduced_stone(body, corners) if k == CROWN else s for k, s in enumerate(DRAWN.stones)
))  # fmt: skip
half = 0.5 * load_factor(DRAWN, [on_crown()])
loaded = [
    simulate(
        m,
        t_end=3.0,
        dt=2e-3,
        damping=15.0,
        save_every=1500,
        actions=[on_crown(lambda t: half * ramp(0.5)(t))],
    )
    for m in (DRAWN, space)
]
felt = -body.stress.field(loaded[1].q[-1, CROWN, 3:])[:, 0] / 1e6
heavy = [m.joints()[CROWN - 1, CROWN][1][1] for m in loaded]

# ## The picture

DEPTH = {"arch": 1.5, "wall": 0.5}  # of the stones, for the picture
level = frictions[[0, -1]], [limit.ratio] * 2
thrust = np.array([x for x, _ in resting.joints().values()])
seen = {"view": (0.45, 0.3, 1.0), "up": (0, 1, 0)}


def in_front(points, depth):
    """A line, or lines that move, on the face of the stones that is turned to the reader."""
    line = np.concatenate([points, np.full((*points.shape[:-1], 1), 0.505 * depth)], axis=-1)
    k = np.arange(line.shape[-2] - 1)
    return view.Thing(line, np.column_stack([k, k + 1]), "#d1495b", width=4.0)


def opened(frames, depth, radius=0.16):
    """A ball for each joint of the thin arch, as large as it has turned, up to 5 degrees."""
    ball, cells = view.ellipsoid((1.0,) * 3, (0.0, 0.0, 0.0))
    size = radius * np.clip(np.abs(turns[frames]) / 5.0, 1e-3, 1.0)
    middle = np.concatenate([lines[frames], np.full((*size.shape, 1), 0.505 * depth)], axis=-1)
    points = middle[:, :, None] + size[:, :, None, None] * ball
    cells = np.concatenate([cells + k * len(ball) for k in range(size.shape[1])])
    return view.Thing(points.reshape(len(points), -1, 3), cells, "#2f7f9f")


def stones(motion, frames, depth, **look):
    """All stones of a motion but the ground of a wall."""
    first = 1 if look else 0
    return view.plates([motion.outlines(k)[first:] for k in frames], depth, **look)


if first:
    options.out.mkdir(parents=True, exist_ok=True)
    ground = view.box((5.0, 0.25, 1.0), (2.0, -0.125, 0.0))
    fallen = f"Thickness 10 %: after {falling.t[-1]:.2f} s"
    at_rest = {"stones": stones(resting, [-1], DEPTH["arch"]),
               "line of thrust": in_front(thrust, DEPTH["arch"])}  # fmt: skip
    folded = {"stones": stones(falling, [-1], DEPTH["arch"]),
              "line of thrust": in_front(lines[-1], DEPTH["arch"]),
              "hinges": opened([-1], DEPTH["arch"])}  # fmt: skip
    view.panels(
        [
            [view.Scene("Thickness 11.5 % of the radius: at rest", at_rest, **seen),
             view.Scene(fallen, folded, **seen)],
            [view.Scene("Wall with an opening under a long lintel",
                        {"ground": ground,
                         "wall": stones(standing, [-1], DEPTH["wall"], values=pressure)},
                        "mean vertical pressure [kPa]", **seen),
             view.Panel("Thinnest arch that stands", "coefficient of friction",
                        "thickness / radius", {"linear programming": (frictions, needed),
                                               "hinges alone, Milankovitch: 0.10748": level})],
        ],
        options.out / "masonry.png",
        title="Arches and walls of stones that nothing glues",
        caption="Top left: a semicircular arch carries its weight if a line of thrust, through the "
        "centres of pressure of all joints, fits between its faces. Top right: in a thinner one "
        "no line fits, and it folds into a mechanism: the line, with inertia, runs through the "
        "corners that still touch, hinges at crown, haunches and springings. Bottom left: weight "
        "finds its way around an opening; colours are the uniform vertical strain of each stone "
        "as a pressure. Bottom right: forty stones; enough friction leaves only hinges to fear, "
        "and their limit; below 0.395 stones slip and the arch must be thicker. Statics and motion "
        "are those of a section; its depth is chosen for the picture.",
    )  # fmt: skip
    around = np.array([x for x, _ in loaded[1].joints().values()])
    around = around[np.argsort(around[:, 0])]
    plain = [o for k, o in enumerate(loaded[1].outlines()) if k not in (0, CROWN)]
    base = view.box((13.0, 0.4, 1.4), (0.0, -0.2, 0.0))
    stone_in_space = (body.surface.points, body.surface.triangles)
    arrow = np.array([(0, 0.1, 0), (0, 2, 0), (-0.3, 0.6, 0), (0.3, 0.6, 0)], dtype=float)
    arrow[:, 1] += HIGH + R + THICK / 2
    view.panels(
        [
            [view.Scene(f"A vault on buttresses, with {half:.1f} kN on its crown",
                        {"stones": view.plates([plain], DEEP),
                         "stone of finite elements": view.Thing(*stone_in_space, "#2f7f9f"),
                         "ground": view.Thing(*base, "#9aa5b1"),
                         "line of thrust": in_front(around, DEEP),
                         "load": view.Thing(arrow, [(0, 1), (0, 2), (0, 3)], "#edae49", width=5.0)},
                        **seen),
             view.Scene("The stone left of the crown, reduced",
                        {"stone": view.Thing(*stone_in_space, values=felt)},
                        "horizontal pressure [MPa]",
                        limits=tuple(np.percentile(felt, (0, 95))), **seen)],
            [view.Panel("What the vault bears on its crown", "width of the buttresses [m]",
                        "load [kN]", {"linear programming": (widths, borne)},
                        {"virtual work, without load": ([narrowest()], [0.0])})],
        ],
        options.out / "masonry_vault.png",
        title="A vault drawn in gmsh, one stone of it with its stress",
        caption="Left: section of a half circle of sixteen voussoirs on two buttresses of "
        "courses, one metre deep, with half the load that it bears (arrow); the line joins the "
        "centres of pressure of the joints. Right: the stone left of the crown is a solid of "
        "finite elements, reduced to 20 coordinates. Its neighbours touch it along its edges, "
        "where the thrust enters; one node in twenty presses more than the colours show. "
        "Below: the wider the buttresses, the more the vault bears, until hinges in the "
        "vault alone decide.",
    )  # fmt: skip
    view.film(
        falling.t,
        view.Scene("An arch too thin to stand",
                   {"stones": stones(falling, range(falling.t.size), DEPTH["arch"]),
                    "line of thrust": in_front(lines, DEPTH["arch"]),
                    "hinges": opened(range(falling.t.size), DEPTH["arch"])}, **seen),
        options.out / "masonry.gif",
        caption="A semicircular arch of twenty stones, its thickness 10 % of its radius of 5 m, "
        "under its own weight. Hinges open at the crown, the haunches and the springings; the line "
        "of thrust runs through them.",
    )  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.

results = {
    "limit thickness over radius, closed form": (limit.ratio, 0.107478, 1e-5),
    "angle of the hinges [deg]": (np.degrees(limit.hinge), 54.484, 1e-5),
    "limit by linear programming, ten stones": (thinnest(10, 0.84), 0.107460, 1e-4),
    "limit with friction 0.35, forty stones": (needed[frictions == 0.35][0], 0.15185, 0.01),
    "10.75 % rests: 1 + speed [m/s]": (1 + speed[0.1075][-1], 1.0, 1e-9),
    "10.725 % gathers speed": (float((np.diff(speed[0.10725]) > 0).all()), 1.0, 0.0),
    "weight that reaches the ground [N]": (carried, weight, 1e-4),
    "line of thrust inside the arch": (
        float((np.abs(np.linalg.norm(thrust, axis=1) - R) < 0.0575 * R + 1e-6).all()), 1.0, 0.0),
    "hinges of the falling arch: springings, haunches, crown": (float(len(hinges)), 5.0, 0.0),
    "width of buttresses that bear the vault [m]": (high, narrowest(), 1e-3),
    "mass of the stone in space [kg]": (solid.mass(), DRAWN.stones[CROWN].M[0, 0], 1e-9),
    "weight and load between two stones [N]": (heavy[1], heavy[0], 1e-3),
}  # fmt: skip
if first:
    for name, (value, expected, tolerance) in results.items():
        print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
