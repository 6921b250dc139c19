# # A robot arm with two flexible links
#
# Two motors move a light arm from pick to place. They know the arm as a rigid one: torque for its
# weight, and a stiff return of each joint to its path. The joints arrive; the tool does not,
# because the links sag, and it swings on for a while. How much and how fast was known beforehand.
#
# Run: `python demos/demo_robot_arm.py`, or under `mpirun -n 2`
# Time: 40 s
# Writes: `robot_arm.png` and `robot_arm.gif` into `out/`; another folder with `--out`

import argparse
from pathlib import Path

from mpi4py import MPI

import numpy as np
from numba import njit

import rom
from rom import view

options = argparse.ArgumentParser(description="pick and place with flexible links")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
first = MPI.COMM_WORLD.rank == 0
say = print if first and not options.quiet else lambda *_: None

# ## The links
#
# Aluminium bars, thin in the plane of the motion; without Poisson effect, as in beam theory.

LENGTHS, THICK, DEPTH, E, RHO, g = (1.0, 0.8), 0.02, 0.04, 70e9, 2700.0, 9.81
models = [
    rom.fe.model(
        Path(__file__).parents[1] / "meshes" / "beam.geo",
        material=rom.Material(E=E, nu=0.0, rho=RHO),
        parameters={"L": L, "b": THICK, "h": DEPTH, "hex": 1, "nx": 12, "ny": 1, "nz": 1},
    )
    for L in LENGTHS
]
links = [
    rom.reduce(
        model, method=rom.CraigBampton(n_modes=3), interfaces={"root": "rbe2", "tip": "rbe2"},
        reference="root", damping=rom.ModalDamping(0.01, fixed=("root",)), name="link",
        certify=False,
    )
    for model in models
]  # fmt: skip
masses = [model.mass() for model in models]
if not first:
    raise SystemExit  # a reduced mechanism is work for one process

# ## Path and control
#
# Both angles, of the first link against the ground and of the second against the first, follow a
# polynomial that starts and ends without acceleration. A law sees the time and its own joint.

ELBOW, TOOL = 1.5, 2.0  # masses of the second motor and of what is carried [kg]
MOVE, END, STEP = 0.8, 3.0, 1e-3
PICK, PLACE = np.radians([-40.0, 70.0]), np.radians([50.0, -60.0])
STIFF, DAMP = (3e4, 1e4), (300.0, 60.0)
W1 = g * LENGTHS[0] * (masses[0] / 2 + ELBOW + masses[1] + TOOL)
W2 = g * LENGTHS[1] * (masses[1] / 2 + TOOL)


@njit
def wanted(t, k):
    """Angle of joint k and its rate."""
    x = min(max(t / MOVE, 0.0), 1.0)
    way = PLACE[k] - PICK[k]
    angle = PICK[k] + way * x**3 * (10 - 15 * x + 6 * x * x)
    return angle, way * 30 * x * x * (1 - x) ** 2 / MOVE


@njit
def torque(t, k, angle, rate):
    """Weight of the rigid arm on its path, and what drives the joint back to it."""
    (one, _), (two, _), (there, speed) = wanted(t, 0), wanted(t, 1), wanted(t, k)
    weight = W2 * np.cos(one + two) + (W1 * np.cos(one) if k == 0 else 0.0)
    return weight + STIFF[k] * (there - PICK[k] - angle) + DAMP[k] * (speed - rate)


def shoulder(t, angle, rate):
    return torque(t, 0, angle, rate)


def elbow(t, angle, rate):
    return torque(t, 1, angle, rate)


def ray(angle):
    return np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)


def robot(flexible):
    mech = rom.Mechanism(gravity=(0, -g, 0))
    last, at = mech.ground.marker((0, 0, 0)), np.zeros(3)
    ends = (("shoulder", shoulder, "motor", ELBOW), ("elbow", elbow, "tool", TOOL))
    for k, (joint, law, load, mass) in enumerate(ends):
        e, L = ray(PICK[: k + 1].sum()), LENGTHS[k]
        A = np.column_stack([e, np.cross([0, 0, 1], e), [0, 0, 1]])
        if flexible:
            link = mech.add_flexible(f"link {k + 1}", links[k], at=at, orientation=A)
        else:
            squares = np.array([THICK**2 + DEPTH**2, L**2 + DEPTH**2, L**2 + THICK**2])
            link = mech.add_rigid(
                f"link {k + 1}", mass=masses[k], inertia=masses[k] / 12 * squares,
                at=at + L / 2 * e, orientation=A,
                markers={"root": (-L / 2, 0, 0), "tip": (L / 2, 0, 0)},
            )  # fmt: skip
        mech.revolute(joint, last, link.marker("root"), axis=(0, 0, 1))
        mech.motor(f"{joint} motor", joint, law)
        at = at + L * e
        part = mech.add_rigid(
            load, mass=mass, inertia=(1e-3,) * 3, at=at, markers={"centre": (0, 0, 0)}
        )
        mech.fixed(f"{load} flange", link.marker("tip"), part.marker("centre"))
        last = part.marker("centre")
    return mech


runs = []
for flexible in (True, False):
    mech = robot(flexible)
    state = rom.equilibrium(mech)
    runs.append(rom.simulate(mech, t_end=END, dt=STEP, state=state))
    say(rom.audit(runs[-1]))
sol, stiff = runs
t = sol.t
path = np.array([[wanted(x, k)[0] for x in t] for k in (0, 1)])
aim = LENGTHS[0] * ray(path[0]) + LENGTHS[1] * ray(path.sum(axis=0))
miss, miss_rigid = (run.position("tool") - aim for run in runs)

# ## Sag and vibration, known beforehand
#
# Beam theory gives the sag at the end: the first link carries force and moment of the second one.
# The arm with its controllers, linearised about that rest, gives frequency and damping of what the
# tool does after the stop. Here they are read from the motion: samples that are sums of decaying
# waves obey a recurrence, whose roots are the waves (Prony).

EI, line = E * DEPTH * THICK**3 / 12, RHO * THICK * DEPTH * g
a1, a2 = PLACE[0], PLACE.sum()
L1, L2 = LENGTHS
P2, P1 = TOOL * g * np.cos(a2), (TOOL + masses[1] + ELBOW) * g * np.cos(a1)
M1, w1, w2 = W2 * np.cos(a2), line * np.cos(a1), line * np.cos(a2)
down2 = (P2 * L2**3 / 3 + w2 * L2**4 / 8) / EI
down1 = (P1 * L1**3 / 3 + M1 * L1**2 / 2 + w1 * L1**4 / 8) / EI
turn1 = (P1 * L1**2 / 2 + M1 * L1 + w1 * L1**3 / 6) / EI
sag = -down1 * ray(a1 + np.pi / 2) - (turn1 * L2 + down2) * ray(a2 + np.pi / 2)

rest = rom.equilibrium(robot(True), state=sol.final, t=END)
linear = rom.linearize(robot(True), rest)


def slowest_wave(y, spacing, waves=2):
    """Frequency [Hz] and damping ratio of the slowest of some decaying waves in samples y."""
    rows = np.lib.stride_tricks.sliding_window_view(y, 2 * waves + 1)
    recurrence = np.linalg.lstsq(rows[:, :-1], rows[:, -1], rcond=None)[0]
    roots = np.log(np.roots(np.r_[1.0, -recurrence[::-1]])) / spacing
    root = min(roots, key=abs)
    return abs(root) / (2 * np.pi), -root.real / abs(root)


after = np.flatnonzero(t >= MOVE + 0.1)[::10]
still = rest.q[-7:-4]  # the tool is the last body
frequency, damping = slowest_wave((sol.position("tool") - still)[after, 1], 10 * STEP)
bending = np.flatnonzero(linear.damping_ratios < 0.9)[0]
say(f"the tool sags by {1e3 * np.linalg.norm(sag):.1f} mm and swings with {frequency:.4f} Hz, "
    f"{100 * damping:.2f} % of critical damping")  # fmt: skip

# ## Pictures

energy = sol.energy
spent = energy.total - energy.total[0] + energy.damping
options.out.mkdir(parents=True, exist_ok=True)
look = {
    "view": (0.3, 0.3, 1.0), "up": (0, 1, 0), "traces": ("motor", "tool"),
    "shapes": {"motor": view.box((0.1, 0.1, 0.1)), "tool": view.box((0.12, 0.12, 0.12))},
}  # fmt: skip
view.history(
    t,
    [
        ("joints [deg]", {"shoulder": np.degrees(sol.base[:, 0] + PICK[0]),
                          "elbow": np.degrees(sol.base[:, 1] + PICK[1])}),
        ("miss, sideways [mm]", {"flexible": 1e3 * miss[:, 0], "rigid": 1e3 * miss_rigid[:, 0]}),
        ("miss, upwards [mm]", {"flexible": 1e3 * miss[:, 1], "rigid": 1e3 * miss_rigid[:, 1]}),
        ("power [W]", {"of the motors": np.gradient(energy.drives, t),
                       "into energy and losses": np.gradient(spent, t)}),
    ],
    options.out / "robot_arm.png",
    title="Pick and place with a light arm",
    beside=[view.posed(robot(True), sol, time, title=f"After {time:g} s", **look)
            for time in (0.0, 0.26, END)],
    caption=f"Links of {L1:g} m and {L2:g} m, {masses[0]:.1f} kg and {masses[1]:.1f} kg, carry an "
    f"elbow motor of {ELBOW:g} kg and a tool of {TOOL:g} kg through {MOVE:g} s of motion. From top "
    "to bottom: angles of both joints, which follow their path; how far the tool is from where a "
    "rigid arm on this path would hold it; what both motors spend, and where it goes. Red lines: "
    f"paths of motor and tool. The tool hangs {1e3 * abs(sag[1]):.0f} mm too low in the end, and "
    f"swings at {frequency:.2f} Hz although its joints stand almost still.",
)  # fmt: skip
view.animate(robot(True), sol, options.out / "robot_arm.gif", frames=75, seconds=6.0,
             title="A robot arm with two flexible links", **look)  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.

turnover = np.ptp(energy.drives)
results = {
    "mass [kg]": (sum(masses), RHO * THICK * DEPTH * sum(LENGTHS), 1e-9),
    "sag of the tool at rest [m]": (
        np.linalg.norm(still - aim[-1]), np.linalg.norm(sag), 1e-2),
    "1 + miss of the rigid arm in the end [m]": (1 + np.abs(miss_rigid[-1]).max(), 1.0, 1e-9),
    "frequency after the stop [Hz]": (frequency, linear.frequencies[bending], 1e-3),
    "its damping ratio": (damping, linear.damping_ratios[bending], 2e-2),
    "1 + open power balance / work": (1 + np.abs(energy.balance).max() / turnover, 1.0, 1e-4),
    "audit holds": (float(all(rom.audit(run).ok for run in runs)), 1.0, 0.0),
}  # fmt: skip
for name, (value, expected, tolerance) in results.items():
    print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
