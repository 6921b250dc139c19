# # A satellite turns by its reaction wheel, and its panels follow
#
# Nothing holds a satellite. When its wheel spins up one way, the rest turns the other way, and
# momentum stays what it was. Two solar panels, reduced from finite elements, bend on the way; their
# frequencies are not those of a panel clamped to a wall, because the hub gives way.
#
# Run: `python demos/demo_satellite.py`, or under `mpirun -n 2`
# Time: 1 min
# Writes: `satellite.png` and `satellite.gif` into `out/`; another folder with `--out`

import argparse
from pathlib import Path

from mpi4py import MPI

import numpy as np
from scipy.optimize import brentq

import rom
from rom import view

options = argparse.ArgumentParser(description="free-floating hub with panels and a wheel")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
first = MPI.COMM_WORLD.rank == 0
say = print if first and not options.quiet else lambda *_: None

# ## The panel
#
# A sandwich plate of 4 m, smeared over its thickness; without Poisson effect, so that the bending
# of a beam is its exact solution.

L, WIDTH, THICK, E, RHO = 4.0, 0.8, 0.04, 1.5e8, 100.0
model = rom.fe.model(
    Path(__file__).parents[1] / "meshes" / "beam.geo",
    material=rom.Material(E=E, nu=0.0, rho=RHO),
    parameters={"L": L, "b": WIDTH, "h": THICK, "hex": 1, "nx": 24, "ny": 2, "nz": 1},
)
panel = rom.reduce(
    model, method=rom.CraigBampton(n_modes=6), interfaces={"root": "rbe2", "tip": "rbe2"},
    reference="root", name="panel", certify=False,
)  # fmt: skip
clamped, m = panel.frequencies(1, fixed=("root",))[0], model.mass()
if not first:
    raise SystemExit  # a reduced mechanism is work for one process

# ## The satellite
#
# The wheel sits in the hub, its axis in the plane of the panels and across them. Its motor pushes
# one way, then the other, so that the satellite comes to rest after `SLEW` seconds.

HUB, EDGE = 150.0, 0.5  # mass of the cube [kg], half its size [m]
ROTOR, WHEEL = 20.0, 1.0  # mass [kg] and inertia [kg m^2] of the wheel
TORQUE, SLEW, END = 40.0, 6.0, 12.0
J_HUB = HUB * (2 * EDGE) ** 2 / 6
J = J_HUB + 2 * (m * (L**2 + THICK**2) / 12 + m * (EDGE + L / 2) ** 2)  # all but the wheel


def law(t, _angle, _rate):
    return TORQUE * np.sin(2 * np.pi * t / SLEW) if t < SLEW else 0.0


def satellite(flexible, spin=(0.0, 0.0, 0.0), drift=(0.0, 0.0, 0.0)):
    """The satellite, at the start turning by ``spin`` and drifting."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    sides = {"right": np.array([EDGE, 0, 0]), "left": np.array([-EDGE, 0, 0])}
    start = {"at": (0, 0, 0), "velocity": drift, "omega": spin}
    hub = mech.add_rigid("hub", mass=HUB, inertia=(J_HUB,) * 3, markers=sides, **start)
    wheel = mech.add_rigid(
        "wheel", mass=ROTOR, inertia=(WHEEL / 2, WHEEL, WHEEL / 2), markers={"axle": (0, 0, 0)},
        **start,
    )  # fmt: skip
    mech.revolute("bearing", hub.marker((0, 0, 0)), wheel.marker("axle"), axis=(0, 1, 0))
    mech.motor("motor", "bearing", law)
    for (side, at), sign in zip(sides.items(), (1, -1), strict=True):
        turned = np.diag([sign, sign, 1.0])  # the left panel points the other way
        centre = at if flexible else at + sign * np.array([L / 2, 0, 0])
        start = {"at": centre, "orientation": turned, "omega": turned @ spin,
                 "velocity": drift + np.cross(spin, centre)}  # fmt: skip
        if flexible:
            wing = mech.add_flexible(side, panel, **start)
        else:
            squares = (WIDTH**2 + THICK**2, L**2 + THICK**2, L**2 + WIDTH**2)
            inertia = m / 12 * np.array(squares)
            ends = {"root": (-L / 2, 0, 0)}
            wing = mech.add_rigid(side, mass=m, inertia=inertia, markers=ends, **start)
        mech.fixed(f"{side} hinge", hub.marker(side), wing.marker("root"))
    return mech


# ## Frequencies: clamped and free-floating
#
# A beam on a hub: where both panels bend alike the hub moves aside, where they bend against each
# other it turns. In closed form w = c1 cos bx + c2 sin bx + c3 cosh bx + c4 sinh bx, free at the
# end; at the root it moves with the hub, which obeys Newton or Euler.

EI, LINE = E * WIDTH * THICK**3 / 12, RHO * WIDTH * THICK


def determinant(z, turning):
    """Of the conditions at root and end; z = b L."""
    b, c, s, C, S = z / L, np.cos(z), np.sin(z), np.cosh(z), np.sinh(z)
    w, dw, ddw, dddw = [1, 0, 1, 0], [0, b, 0, b], [-b * b, 0, b * b, 0], [0, -(b**3), 0, b**3]
    w, dw, ddw, dddw = map(np.array, (w, dw, ddw, dddw))
    lam = EI / LINE * b**4
    if turning:  # moment and force of two panels turn the hub about its centre
        root = [w - EDGE * dw, J_HUB * lam * dw + 2 * EI * (ddw - EDGE * dddw)]
    else:
        root = [dw, (HUB + ROTOR) * lam * w - 2 * EI * dddw]
    end = [[-c, -s, C, S], [s, -c, S, C]]
    return np.linalg.det(np.array([*root, *end]) / np.array([[1], [1e3], [1], [1]]))


def in_hz(z):
    return z**2 * np.sqrt(EI / LINE) / L**2 / (2 * np.pi)


found = rom.linearize(satellite(flexible=True), t=END).frequencies
floating = found[found > 0.1 * clamped]
alike, against = (brentq(determinant, a, b, (t,)) for a, b, t in ((1.5, 2.4, 0), (2.0, 3.9, 1)))
say(f"panel clamped {clamped:.4f} Hz; free-floating, alike {floating[0]:.4f}, against each other "
    f"{floating[1]:.4f} Hz; closed form {in_hz(alike):.4f}, {in_hz(against):.4f} Hz")  # fmt: skip

# ## The slew
#
# Rigid panels first: momentum of satellite and wheel stays zero, J theta' + I (theta' + alpha') =
# 0, so that the attitude is a fixed share of the angle of the wheel. Elastic panels lag behind,
# then run ahead, and swing on after the manoeuvre about the same mean.

sol, stiff = (rom.simulate(satellite(kind), t_end=END, dt=2e-3) for kind in (True, False))
say(rom.audit(sol))
t, after = sol.t, sol.t > SLEW


def attitude(run):
    p = run.orientation("hub")
    return 2 * np.arctan2(p[:, 2], p[:, 0])


theta, rigid = attitude(sol), attitude(stiff)
share = -WHEEL / (J + WHEEL)
final = -TORQUE * SLEW**2 / (2 * np.pi * J)
deflection = {}
for side in ("right", "left"):
    arm = sol.position(side, "tip") - sol.position("hub")
    deflection[side] = np.einsum("tj,tj->t", arm, sol.axes("hub", "right")[:, :, 2])

# Once more, tumbling and drifting: the eighth-order method shows what rounding leaves of momentum.

spin, drift = np.array([0.2, -0.1, 0.3]), np.array([0.5, 0.2, -0.1])
tumbling = rom.simulate(satellite(True, spin, drift), t_end=1.0, dt=0.1, method="dop853")
p, L_total = (np.abs(x - x[0]).max() / np.abs(x).max() for x in tumbling.momentum)
axis = tumbling.axes("hub", "right")[:, :, 0]
turned = np.degrees(np.arccos((axis @ axis[0]).min()))
say(f"tumbling: momentum changes by {p:.1e}, angular momentum by {L_total:.1e}, "
    f"x axis turned by up to {turned:.0f} degrees")  # fmt: skip

# ## Pictures

options.out.mkdir(parents=True, exist_ok=True)
look = {
    "view": (0.3, -1.0, 0.8), "up": (0, 0, 1),
    "shapes": {"hub": view.box((1, 1, 1)),
               "wheel": view.cylinder((0, -0.55, 0), (0, 0.55, 0), 0.3)},
}  # fmt: skip
view.history(
    t,
    [
        ("attitude [deg]", {"flexible panels": np.degrees(theta), "rigid": np.degrees(rigid)}),
        ("flexible - rigid [deg]", {"": np.degrees(theta - rigid)}),
        ("tips against hub [mm]", {k: 1e3 * x for k, x in deflection.items()}),
        ("speed of the wheel [rad/s]", {"": sol.omega("wheel")[:, 1]}),
    ],
    options.out / "satellite.png",
    title="A satellite turns by sixty degrees and stays there",
    beside=[view.posed(satellite(True), sol, time, title=f"After {time:g} s", **look)
            for time in (0.0, 1.5, 4.5)],
    caption=f"Hub of {HUB:g} kg, two panels of {L:g} m and {m:.1f} kg, a wheel that gains and "
    f"loses {TORQUE * SLEW / np.pi:.0f} N m s within {SLEW:g} s. From top to bottom: angle of the "
    "hub, its deviation from a satellite with rigid panels, deflection of both tips out of the "
    "plane of the panels, which lag behind as the hub turns, and speed of the wheel. Afterwards "
    f"the panels swing against each other at {floating[1]:.2f} Hz, faster than at {clamped:.2f} Hz "
    "on a wall, because the hub turns the other way.",
)  # fmt: skip
view.animate(satellite(True), sol, options.out / "satellite.gif", frames=72, seconds=6.0,
             title="A satellite turns by its wheel", **look)  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.

z = 1.875104069
results = {
    "mass [kg]": (m, RHO * WIDTH * THICK * L, 1e-9),
    "panel clamped [Hz]": (clamped, in_hz(z), 1e-3),
    "free-floating, panels alike [Hz]": (floating[0], in_hz(alike), 1e-3),
    "free-floating, against each other [Hz]": (floating[1], in_hz(against), 1e-3),
    "attitude, rigid panels [rad]": (rigid[-1], final, 1e-6),
    "the same from the angle of the wheel": (rigid[-1], share * stiff.base[-1, 0], 1e-6),
    "mean attitude, flexible panels [rad]": (theta[after].mean(), final, 1e-3),
    "1 + change of momentum": (1 + p, 1.0, 1e-10),
    "1 + change of angular momentum": (1 + L_total, 1.0, 1e-10),
}
for name, (value, expected, tolerance) in results.items():
    print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
