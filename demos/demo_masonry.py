# # Dry masonry: the thinnest arch, its line of thrust, and a wall with an opening
#
# Stones press, rock and slip; nothing glues them. How thin may a semicircular arch be? Milankovitch
# answered by the line of thrust: 10.75 % of the radius of its centre line. Discontinuous
# deformation analysis, after Shi and, for masonry, Bagi, lets every stone move and agrees.
#
# Run: `python demos/demo_masonry.py`
# Writes: `masonry.png` into `out/`; another folder with `--out`

import argparse
from pathlib import Path

import numpy as np

from rom import view
from rom.components.masonry import Rock, arch, minimum_thickness, simulate, stands, wall

options = argparse.ArgumentParser(description="arches at their limit, and a wall with an opening")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
say = (lambda *_: None) if options.quiet else print

# ## Two arches
#
# Radius 5 m, stone of 10 GPa and 2000 kg/m^3, friction of 40 degrees. Each comes to rest as statics
# lets it for 0.2 s, and moves on for two seconds with 3 % of its speed lost a millisecond.

R = 5.0


def after_two_seconds(n, ratio):
    model = arch(n, R, ratio * R)
    still = simulate(model, t_end=0.2, dt=1e-3, keep=0.0, save_every=200)
    return simulate(model, t_end=2.0, dt=1e-3, keep=0.97, save_every=500, q=still.q[-1])


speed = {}
for ratio in (0.1075, 0.10725):
    speed[ratio] = np.abs(after_two_seconds(10, ratio).v[1:]).max(axis=(1, 2))
    say(f"thickness {100 * ratio:.3f} % of the radius: speed",
        *(f"{v:.1e}" for v in speed[ratio]), "m/s")  # fmt: skip

resting = after_two_seconds(20, 0.115)
falling = simulate(arch(20, R, 0.1 * R), t_end=1.05, dt=1e-3, save_every=150)

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

bricks = wall(4.0, 10, opening=(1.5, 2.5, 3, 7))
standing = simulate(bricks, t_end=0.4, dt=4e-3, keep=0.0, save_every=100)
pressure = -standing.stress()[1:, 1] / 1e3
joints = standing.joints()
weight = sum(s.M[0, 0] for s in bricks.stones[1:]) * 9.81
carried = sum(np.abs(f[1]) for (i, _), (_, f) in joints.items() if i == 0)
say(f"{len(bricks.stones) - 1} stones, largest mean pressure {pressure.max():.1f} kPa")

# ## The picture

angle = np.linspace(-np.pi / 2, np.pi / 2, 200)
arc = np.column_stack([np.sin(angle), np.cos(angle)]) * R
level = np.array([[mu, limit.ratio] for mu in frictions[[0, -1]]])
thrust = np.array([x for x, _ in resting.joints().values()])
options.out.mkdir(parents=True, exist_ok=True)
view.plane(
    [
        view.Drawing("Thickness 11.5 % of the radius: at rest", "x [m]", "y [m]",
                     polygons=resting.outlines(), curves={"line of thrust": [thrust]}),
        view.Drawing(f"Thickness 10 %: after {falling.t[-1]:.2f} s", "x [m]", "y [m]",
                     polygons=falling.outlines(), curves={"centre line at the start": [arc]}),
        view.Drawing("Wall with an opening under a long lintel", "x [m]", "y [m]",
                     polygons=standing.outlines()[1:], values=pressure,
                     label="mean vertical pressure [kPa]"),
        view.Drawing("Thinnest arch that stands", "tangent of the angle of friction",
                     "thickness over radius", equal=False,
                     curves={"linear programming": [np.column_stack([frictions, needed])],
                             "Milankovitch, 0.10748": [level]}),
    ],
    options.out / "masonry.png",
    height=400,
    title="Arches and walls of stones that nothing glues",
    caption="Top left: a semicircular arch carries its weight if a line of thrust, through the "
    "centres of pressure of all joints, fits between its faces. Top right: in a thinner one no "
    "line fits, and it folds into a mechanism of hinges at crown, haunches and springings. Bottom "
    "left: weight finds its way around an opening; colours are the uniform vertical strain of "
    "each stone as a pressure. Bottom right: forty stones; enough friction leaves only hinges to "
    "fear, and their limit; below 0.395 stones slip and the arch must be thicker.",
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
}  # fmt: skip
for name, (value, expected, tolerance) in results.items():
    print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
