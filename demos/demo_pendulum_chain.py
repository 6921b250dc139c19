# # Chains of 1 to 1000 flexible links: what a step costs, and how a folded chain falls
#
# Bodies and joints are eliminated one after the other, from the free end to the support. A step of
# a chain therefore costs as much as it has links; solved as one matrix it would cost the cube.
#
# The chain that falls is folded: it hangs from a support, turns round and comes back up beside
# itself. Let go, its free end falls faster than a stone, because the fold hands the energy of the
# links that come to rest to those that still fall (Calkin and March, Am. J. Phys. 57, 1989, 154).
#
# Run: `python demos/demo_pendulum_chain.py`
# Time: 30 s
# Writes: `pendulum_chain.png` into `out/`; another folder with `--out`

import argparse
from pathlib import Path

from mpi4py import MPI

import numpy as np
from scipy.integrate import quad

import rom
from rom import view

options = argparse.ArgumentParser(description="chains of flexible links")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
first = MPI.COMM_WORLD.rank == 0
say = print if first and not options.quiet else lambda *_: None

# ## The link
#
# A steel bar, reduced to its two ends and four modes between them: ten elastic coordinates.

LENGTH, WIDTH, HEIGHT, RHO, G = 0.5, 0.02, 0.01, 7850.0, 9.81
model = rom.fe.model(
    Path(__file__).parents[1] / "meshes" / "beam.geo",
    material=rom.Material(E=210e9, nu=0.3, rho=RHO),
    parameters={"L": LENGTH, "b": WIDTH, "h": HEIGHT, "hex": 1, "nx": 8, "ny": 1, "nz": 1},
)
link = rom.reduce(
    model, method=rom.CraigBampton(n_modes=4), interfaces={"root": "rbe2", "tip": "rbe2"},
    reference="root", name="link",
)  # fmt: skip
root = link.marker("root").point
mass = model.mass()


def chain(angles, body=link):
    """Links in a row, each at an angle to the x axis, hinged to the ground and to each other."""
    mech = rom.Mechanism(gravity=(0, -G, 0))
    before, end = mech.ground.marker((0, 0, 0)), np.zeros(3)
    for k, angle in enumerate(angles):
        c, s = np.cos(angle), np.sin(angle)
        turn = {"orientation": (np.cos(angle / 2), 0, 0, np.sin(angle / 2))}
        if body is None:
            half = LENGTH / 2 * np.array([c, s, 0])
            one = mech.add_rigid(
                f"link {k}", mass=mass, inertia=(1e-4, *2 * [mass * LENGTH**2 / 12]),
                at=end + half, markers={"root": (-LENGTH / 2, 0, 0), "tip": (LENGTH / 2, 0, 0)},
                **turn,
            )  # fmt: skip
        else:
            at = end - np.array([c * root[0] - s * root[1], s * root[0] + c * root[1], root[2]])
            one = mech.add_flexible(f"link {k}", body, at=at, **turn)
        mech.revolute(f"pin {k}", before, one.marker("root"), axis=(0, 0, 1))
        before, end = one.marker("tip"), end + LENGTH * np.array([c, s, 0])
    return mech


# ## What a step costs
#
# Chains let go from the horizontal: the time of a step, and the numbers in the factor of the
# iteration matrix. Short chains keep one matrix.

numbers, seconds, factor = np.array([1, 2, 4, 16, 64, 256, 1000]), [], []
for n in numbers:
    started = rom.simulate(chain(np.zeros(n)), t_end=2e-3, dt=1e-3)
    t_end = 2e-3 + 1e-3 * max(10, 400 // n)
    sol = rom.simulate(chain(np.zeros(n)), t_end=t_end, dt=1e-3, state=started.final)
    seconds.append(1 / sol.statistics["steps_per_second"])
    factor.append(sol.packed.system.graph.plan.memory[0])
    say(f"{n:5d} links: {1e3 * seconds[-1]:8.2f} ms a step, {factor[-1]} numbers in the factor")

# Rigid links: at the first instant the forces in the hinges of a long chain alternate and fall by
# 2 - sqrt(3) from one to the next; the support carries 1 / (2 sqrt(3)) of the weight of one link.
rigid = rom.simulate(chain(np.zeros(1000), None), t_end=1e-4, dt=1e-4)
support = rigid.reaction("pin 0")[0, 1] / (mass * G)

# ## The folded chain
#
# With the drop x of the free end, the falling part is (L - x) / 2 long. Without loss of energy
# its speed is v^2 = g x (2 L - x) / (L - x).

ROWS = 20
total = (2 * ROWS + 1) * LENGTH


def fall_time(share):
    """Time in which the free end drops by a share of the length."""
    return np.sqrt(total / G) * quad(lambda s: 2 * np.sqrt((1 - s * s) / (2 - s * s)), 0,
                                     np.sqrt(share))[0]  # fmt: skip


fold = chain(np.r_[np.full(ROWS, -np.pi / 2), 0.0, np.full(ROWS, np.pi / 2)])
sol = rom.simulate(fold, t_end=fall_time(0.85), dt=2e-3)
say(f"audit of the fall: {'ok' if rom.audit(sol).ok else 'failed'}")
drop = -sol.position(f"link {2 * ROWS}", "tip")[:, 1]
speed = -sol.velocity(f"link {2 * ROWS}", "tip")[:, 1]
SHARE = 0.75
reached = np.interp(SHARE * total, drop, sol.t)

if first:
    options.out.mkdir(parents=True, exist_ok=True)
    shown = sol.at(np.linspace(0.0, sol.t[-1], 6))
    pins = [np.zeros((6, 3))] + [shown.position(name, "tip") for name in fold.parts]
    aside, gap = 3.5 * np.arange(6), np.full((1, 6), np.nan)  # no line from picture to picture
    x, y, _ = np.moveaxis(np.array(pins), -1, 0)
    strobe = (np.r_[x + aside, gap].T.ravel(), np.r_[y, gap].T.ravel())
    stone = (aside + 2.0, -G / 2 * shown.t**2)
    line = seconds[-1] * numbers / numbers[-1]
    short = rom.simulate(chain(np.zeros(4)), t_end=0.35, dt=1e-3)
    falling = view.posed(short.mechanism, short, 0.35, view=(0.4, 0.3, 1.0),
                         title="Four links, 0.35 s after their release")  # fmt: skip
    view.panels(
        [[
            view.Panel(
                "A folded chain of 41 links", "x [m], pictures side by side", "height [m]",
                curves={"chain": strobe}, points={"stone": stone}, equal=True,
            ),
            falling,
            view.Panel(
                "Cost of a step", "links", "time of a step [ms]", log=True,
                curves={"proportional to the links": (numbers, 1e3 * line)},
                points={"measured": (numbers, 1e3 * np.array(seconds))},
            ),
        ]],
        options.out / "pendulum_chain.png",
        title="Chains of flexible links",
        caption=f"Left: a chain of {total:g} m that hangs from the top and comes back up beside "
        f"itself is let go; pictures from 0 to {sol.t[-1]:.2f} s in equal steps, next to a stone "
        "dropped with it. The free end falls faster than the stone. Middle: steel bars of 0.5 m, "
        "20 mm and 10 mm on hinges, let go from the horizontal. Right: time of a step of such "
        "chains, ten elastic coordinates per link, against the number of links, on this machine.",
    )  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.

v_expected = np.sqrt(G * SHARE * total * (2 - SHARE) / (1 - SHARE))
results = {
    "mass [kg]": (mass, RHO * LENGTH * WIDTH * HEIGHT, 1e-9),
    "force of the support at the start, 1000 rigid links [weights of one]": (
        support, 1 / (2 * np.sqrt(3)), 1e-6,
    ),
    "numbers in the factor per link, 1000 links over 256": (
        factor[-1] / factor[-2] * 256 / 1000, 1.0, 0.01,
    ),
    "time to fall by 3/4 of the length [s]": (reached, fall_time(SHARE), 0.02),
    "the same over that of a stone": (
        reached / np.sqrt(2 * SHARE * total / G),
        fall_time(SHARE) / np.sqrt(2 * SHARE * total / G), 0.02,
    ),
    "speed of the free end then [m/s]": (np.interp(reached, sol.t, speed), v_expected, 0.05),
}  # fmt: skip
if first:
    for name, (value, expected, tolerance) in results.items():
        print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
