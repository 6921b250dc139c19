# # A rolling wheel: how fast must it roll, and what do integrators keep of it?
#
# A coin that rolls slowly falls over, a fast one wobbles and stays up. Rolling binds velocities,
# not positions, so that there are no equations of second order; `rom.steady_motion` has the
# eigenvalues all the same. Then the wobbling wheel is integrated: with BDF of all orders, and with
# the velocity of the contact kept to round-off or not.
#
# Run: `python demos/demo_rolling_wheel.py`
# Time: 15 s
# Writes: `rolling_wheel.png` into `out/`; another folder with `--out`

import argparse
from pathlib import Path

import numpy as np

import rom
from rom import view

options = argparse.ArgumentParser(description="stability and integration of a rolling wheel")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
say = print if not options.quiet else lambda *_: None

# ## The wheel
#
# Radius 0.3 m. In units of m r^2 the moments of inertia about a diameter (A) and about the axle (C)
# are 1/4 and 1/2 for a disc, 1/2 and 1 for a hoop.

g, r, mass = 9.81, 0.3, 2.0
kinds = {"disc": (0.25, 0.5), "hoop": (0.5, 1.0)}


def wheel(kind, speed, wobble=0.0):
    A, C = (share * mass * r**2 for share in kinds[kind])
    mech = rom.Mechanism(gravity=(0, 0, -g))
    body = mech.add_rigid(
        "wheel", mass=mass, inertia=(A, C, A), at=(0, 0, r), velocity=(speed, -wobble * r, 0),
        omega=(wobble, speed / r, 0), markers={"c": (0, 0, 0)},
    )  # fmt: skip
    floor = mech.ground.marker((0, 0, 0))
    mech.rolling("roll", floor, body.marker("c"), normal=(0, 0, 1), radius=r, axis=(0, 1, 0))
    return mech


# ## How fast must it roll?
#
# The lean obeys (A + 1) s^2 + C (C + 1) W^2 / A - g/r = 0 with the speed of rotation W = v/r: the
# disc is stable for v^2 > g r / 3, the hoop for v^2 > g r / 4.


def lean(kind, speed):
    A, C = kinds[kind]
    return np.sqrt((g / r - C * (C + 1) * (speed / r) ** 2 / A) / (A + 1) + 0j)


speeds, every, found = np.linspace(0.1, 2.0, 20), np.linspace(0.1, 2.0, 500), {}
for kind in kinds:
    motions = [rom.steady_motion(wheel(kind, v)) for v in speeds]
    found[kind] = np.array([motion.eigenvalues.real.max() for motion in motions])
    first = speeds[[motion.stable for motion in motions].index(True)]
    say(f"{kind}: falls over at {first - 0.1:.1f} m/s, rolls upright at {first:.1f} m/s")
fast = rom.steady_motion(wheel("disc", 2.0)).eigenvalues

# ## What do integrators keep?
#
# The disc rolls at 2 m/s with a wobble of 0.5 rad/s. Errors are those of the place of its centre at
# the end, against dop853; the gap is the velocity with which its lowest point leaves the floor.

t_end, steps = 0.6, np.array([0.02, 0.01, 0.005, 0.0025])
true = rom.simulate(wheel("disc", 2.0, 0.5), t_end=t_end, dt=t_end, method="dop853")


def lift_off(sol):
    axes = sol.axes("wheel", "c")
    axle, omega = axes[:, :, 1], np.einsum("nab,nb->na", axes, sol.omega("wheel"))
    c, rate = axle[:, 2], np.cross(omega, axle)[:, 2]
    return np.abs(sol.velocity("wheel")[:, 2] + r * c * rate / np.sqrt(1 - c**2))


errors = {}
for order in range(1, 6):
    how = {"method": "bdf", "order": order, "stabilised": True, "tolerance": 1e-12}
    ends = [rom.simulate(wheel("disc", 2.0, 0.5), t_end=t_end, dt=h, **how) for h in steps]
    places = np.array([sol.position("wheel")[-1] for sol in ends])
    errors[order] = np.linalg.norm(places - true.position("wheel")[-1], axis=1)
    say(f"BDF {order}: errors", *(f"{e:.2e}" for e in errors[order]), "m")
gaps = {}
for name, stabilised in (("positions only", False), ("stabilised", True)):
    sol = rom.simulate(wheel("disc", 2.0, 0.5), t_end=t_end, dt=0.005, stabilised=stabilised)
    gaps[name] = (sol.t[1:], lift_off(sol)[1:])
    say(f"{name}: the lowest point leaves the floor with {gaps[name][1].max():.1e} m/s")

options.out.mkdir(parents=True, exist_ok=True)
growth = view.Panel(
    "Growth of the lean", "speed [m/s]", "s [1/s]",
    curves={f"{kind}, closed form": (every, lean(kind, every).real) for kind in kinds},
    points={"computed": (np.tile(speeds, 2), np.concatenate(list(found.values())))},
)  # fmt: skip
orders = view.Panel(
    "Error of BDF", "step [s]", "error [m]", log=True,
    curves={f"order {k}": (steps, e) for k, e in errors.items()},
)  # fmt: skip
contact = view.Panel("Velocity gap of the contact", "time [s]", "gap [m/s]", gaps)
spokes = [view.cylinder((0, 0, 0), r * np.array([np.sin(a), 0, np.cos(a)]), 0.01)
          for a in np.pi / 4 * np.arange(8)]  # fmt: skip
shapes = {"wheel": view.joined([view.ring((0, -0.01, 0), (0, 0.01, 0), 1.8 * r, 2 * r), *spokes])}
slow = rom.simulate(wheel("hoop", 0.5, 0.2), t_end=0.7, dt=1e-3)
falling = view.posed(slow.mechanism, slow, slow.t[-1], title="A hoop at 0.5 m/s, after 0.7 s",
                     shapes=shapes, traces=("wheel",), view=(1.0, -1.6, 0.8))  # fmt: skip
view.panels(
    [[falling, growth], [orders, contact]], options.out / "rolling_wheel.png",
    title="A wheel of 0.3 m that rolls without slip",
    caption="Above: a hoop that is pushed a little at too low a speed falls over; the red line is "
    "the way of its centre. Lean grows with exp(s t), and where s is positive the upright wheel "
    "falls: a disc needs 0.99 m/s, a hoop 0.86 m/s. Below, left: a disc wobbles at 2 m/s for 0.6 "
    "s; its error falls with the order of the method. Right: the lowest point of the wheel should "
    "not leave the floor; generalised-alpha with steps of 5 ms, without and with constraints of "
    "the velocities.",
)  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.

slope = {k: np.log2(e[-2] / e[-1]) for k, e in errors.items()}
results = {
    "growth of a slow disc [1/s]": (found["disc"][3], lean("disc", speeds[3]).real, 1e-5),
    "growth of a slow hoop [1/s]": (found["hoop"][3], lean("hoop", speeds[3]).real, 1e-5),
    "wobble of a fast disc [rad/s]": (fast.imag.max(), lean("disc", 2.0).imag, 1e-5),
    "wobble of a fast disc does not grow": (1 + fast.real.max() / fast.imag.max(), 1.0, 3e-4),
    **{f"order of BDF {k}": (slope[k], k, 0.1) for k in slope},
    "velocity gap, stabilised": (1 + gaps["stabilised"][1].max(), 1.0, 1e-12),
}
for name, (value, expected, tolerance) in results.items():
    print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
