# # Reference conditions: the floating frame is a choice
#
# O'Shea, Jayakumar, Mechergui, Shabana and Wang (J. Comput. Nonlinear Dynam. 13, 2018, 041007)
# argue that a reduced flexible body needs reference conditions, and that the choice decides what
# its shapes can represent. Each claim becomes a number here, on a solid beam meshed by gmsh and in
# a mechanism that shakes it through its resonance. `docs/theory/reference_conditions.md` has the
# table of claims.
#
# Run: `python demos/demo_reference_conditions.py`
# Time: 20 s
# Writes: `reference_conditions.png`, `reference_resonance.png` and `reference_statics.png` into
# `out/`; another folder with `--out`

import argparse
from pathlib import Path

from mpi4py import MPI

import numpy as np

import rom
from rom import view

options = argparse.ArgumentParser(description="claims about reference conditions, as numbers")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
first = MPI.COMM_WORLD.rank == 0
say = print if first and not options.quiet else lambda *_: None

# ## The beam
#
# Steel, 1 m x 30 mm x 10 mm, without lateral contraction so that beam theory is exact but for
# shear. Its ends are rigid interfaces; it bends along z.

DAMPING = rom.Rayleigh(0.0, 3e-4)
L, B, H, E, RHO = 1.0, 0.03, 0.01, 210e9, 7850.0
KINDS = {"root": "rbe2", "tip": "rbe2"}


def meshed(nx, degree=2):
    """The beam in nx bricks."""
    return rom.fe.model(
        Path(__file__).parents[1] / "meshes" / "beam.geo", degree=degree,
        material=rom.Material(E=E, nu=0.0, rho=RHO),
        parameters={"L": L, "b": B, "h": H, "hex": 1, "nx": nx, "ny": 1, "nz": 1},
    )  # fmt: skip


model = meshed(16)
EI, MASS = E * B * H**3 / 12, RHO * B * H
PINNED = {"root": "xyz rx rz", "tip": "yz rx rz"}
JOINTS = {"pinned at both ends": PINNED, "clamped at the root": ("root",)}
EXACT = {
    joint: rom.modes(model, 1, fixed=fixed, interfaces=KINDS).frequencies[0]
    for joint, fixed in JOINTS.items()
}
theory = np.array([np.pi**2, 1.875104069**2]) * np.sqrt(EI / MASS) / L**2 / (2 * np.pi)

# ## A square Craig-Bampton transformation changes nothing; without conditions it gives free modes
#
# With all fixed-interface modes kept the transformation is a similarity: the eigenvalues stay. With
# some of them, the free body keeps its six zeros and its elastic frequencies tend to those of the
# free-free modes; held by its interfaces it tends to what holds it.

coarse, n_inside = meshed(6, degree=1), 5 * 12
square = rom.reduce(coarse, method=rom.CraigBampton(n_inside), interfaces=KINDS, certify=False)
full = rom.modes(coarse, 12 + n_inside, interfaces=KINDS).frequencies
similarity = np.abs((square.frequencies()[6:] / full[6:]) ** 2 - 1).max()
say(f"all modes kept: eigenvalues differ by {similarity:.1e}")

free = rom.modes(model, 7, interfaces=KINDS).frequencies[6]
bampton = {}
for n in (0, 1, 2, 4, 8, 16):
    body = rom.reduce(model, method=rom.CraigBampton(n), interfaces=KINDS, certify=False)
    f = body.frequencies(7)
    bampton[n] = (
        f[6] / free - 1,
        *(body.frequencies(1, fixed=JOINTS[joint])[0] / EXACT[joint] - 1 for joint in JOINTS),
    )
    say(f"Craig-Bampton, {n:2d} modes: {np.count_nonzero(f == 0.0)} zeros, errors free "
        "{:8.1e}, pinned {:8.1e}, clamped {:8.1e}".format(*bampton[n]))  # fmt: skip

# ## Different conditions, one resonance
#
# Assumed modes: the lowest modes of the body in one support, and no static shapes. The supports
# have frequencies of their own that are far apart. The joints of the mechanism then hold the body:
# shapes whose limit contains the motion sought lead to the same resonance, whatever the condition;
# clamped-clamped shapes have no slope at the joints and never do.

SETS = {"free-free": (), "pinned-pinned": PINNED, "cantilever": ("root",),
        "clamped-clamped": ("root", "tip")}  # fmt: skip
NUMBERS = (1, 2, 4, 8, 16, 32)


def assumed(name, n, reference="mean-axis"):
    """A body of assumed modes; of free-free ones too, which joints refuse."""
    body = rom.reduce(model, method=rom.AssumedModes(n, fixed=SETS[name]), interfaces=KINDS,
                      reference=reference, damping=DAMPING, certify=False)  # fmt: skip
    body.provenance["reduction"]["static shapes"] = True
    return body


own, bodies, error = {}, {}, {}
for name in SETS:
    own[name] = rom.reduce(model, method=rom.AssumedModes(1, fixed=SETS[name]), interfaces=KINDS,
                           reference="root" if name == "cantilever" else "mean-axis",
                           certify=False).provenance  # fmt: skip
    own[name] = own[name]["reduction"]["frequencies of the modes kept [Hz]"][0]
    for n in NUMBERS:
        bodies[name, n] = body = assumed(name, n)
        for joint, fixed in JOINTS.items():
            f = body.frequencies(1, fixed=fixed)
            error[joint, name, n] = f[0] / EXACT[joint] - 1 if f.size else np.nan
for joint in JOINTS:
    for name in SETS:
        row = " ".join(f"{100 * error[joint, name, n]:9.3f}" for n in NUMBERS)
        say(f"{joint:20s} {name:16s} (own {own[name]:5.1f} Hz) {row}  per cent")

# The frame is a choice beside that: seen from another one the same shapes span the same motions.

seen = [bodies["cantilever", 8].with_reference(r).frequencies(3, fixed=PINNED)
        for r in ("mean-axis", "root", "tip", ("root", "tip"))]  # fmt: skip
frames = np.ptp(seen, axis=0).max() / seen[0][0]
say(f"four frames: frequencies differ by {frames:.1e}")

# ## In motion: a table that shakes the beam through its resonance
#
# The beam has a hinge on a table at its root and slides on it at its tip; a drive shakes the table,
# its frequency growing from 17 to 29 Hz. The answer is the slope of the beam at its root.

LOW, HIGH, TIME, SHAKE = 17.0, 29.0, 2.0, 2e-4


def sweep(t):
    """Displacement of the table, which begins gently."""
    begun = min(1.0, 5 * t)
    phase = 2 * np.pi * (LOW * t + (HIGH - LOW) / TIME * t**2 / 2)
    return SHAKE * begun**3 * (10 - 15 * begun + 6 * begun**2) * np.sin(phase)


def shaken(body, motion):
    """The mechanism, and the marker at the root of the beam."""
    mech, at = rom.Mechanism(gravity=(0, 0, 0)), {"at": (0, 0, 0)}
    marks = {"centre": (0, 0, 0), "left": (0, 0, 0), "right": (L, 0, 0)}
    table = mech.add_rigid("table", mass=50, inertia=(9, 9, 9), markers=marks, **at)
    mech.prismatic("guide", mech.ground.marker((0, 0, 0)), table.marker("centre"), axis=(0, 0, 1))
    beam = mech.add_flexible("beam", body, at=-body.marker("root").point)
    mech.revolute("left hinge", table.marker("left"), beam.marker("root"), axis=(0, 1, 0))
    mech.point_on_plane("support", table.marker("right"), beam.marker("tip"), normal=(0, 0, 1))
    mech.drive("shaker", "guide", motion)
    return mech, beam.marker("root")


compared = {"free-free": 16, "pinned-pinned": 4, "cantilever": 32, "clamped-clamped": 32}
frequencies, slopes, answers, peaks, modes = np.linspace(LOW, HIGH, 121), {}, {}, {}, {}
chosen = {f"{name}, {n} modes": bodies[name, n] for name, n in compared.items()}
chosen["Craig-Bampton, 4 modes"] = rom.reduce(
    model, method=rom.CraigBampton(4), interfaces=KINDS, damping=DAMPING,
    certify=False,
)  # fmt: skip
for name, body in chosen.items():
    sol = rom.simulate(shaken(body, sweep)[0], t_end=TIME, dt=1e-3)
    slopes[name] = np.arctan2(sol.axes("beam", "root")[:, 0, 2], sol.axes("beam", "root")[:, 0, 0])
    mech, root = shaken(body, lambda t: 0.0 * t)
    found = rom.transmissibility(mech, None, frequencies, drive="shaker", motion=root)
    answers[name] = np.abs(found[:, 4]) * SHAKE
    roots = rom.linearize(mech).eigenvalues
    modes[name] = np.abs(roots[roots.imag > 0][0]) / (2 * np.pi)
    peaks[name] = np.abs(slopes[name]).max()
    say(f"{name:26s} resonance {modes[name]:8.3f} Hz, largest slope {1e3 * peaks[name]:7.3f} mrad")

# ## What Craig-Bampton improves, and what not
#
# The same number of elastic coordinates, on a beam that a joint clamps: constraint modes make
# static answers exact. They cost six coordinates per interface, which higher modes would use: in
# the support that the modes know, plain assumed modes of equal size are better.

SIZES = (8, 12, 16, 24, 32)
static, higher = {}, {}


def deflection(body):
    """Of the tip under a unit force there, the root clamped [m]."""
    body = body.with_reference("root")
    tip, hold = body.marker("tip").translation[2], body.marker("root").hold[:, 6:]
    K = np.block([[body.K, hold.T], [hold, np.zeros((6, 6))]])
    u = np.linalg.lstsq(K, np.r_[tip, np.zeros(6)], rcond=1e-12)[0]
    return tip @ u[: len(tip)]


exact = deflection(rom.reduce(model, method=rom.Guyan(), interfaces=KINDS, certify=False))
for name in ("Craig-Bampton", "cantilever", "free-free", "pinned-pinned"):
    for n in SIZES:
        if name == "Craig-Bampton":
            body = rom.reduce(model, method=rom.CraigBampton(n - 6), interfaces=KINDS,
                              certify=False)  # fmt: skip
        else:
            body = assumed(name, n)
        static[name, n] = abs(deflection(body) / exact - 1)
        f = body.frequencies(8, fixed=("root",))
        higher[name, n] = f
true = rom.modes(model, 8, fixed=("root",), interfaces=KINDS).frequencies
worst = {key: np.abs(f / true - 1).max() if f.size == 8 else np.nan for key, f in higher.items()}
for name in ("Craig-Bampton", "cantilever", "free-free", "pinned-pinned"):
    row = " ".join(f"{static[name, n]:8.1e} {worst[name, n]:8.1e}" for n in SIZES)
    say(f"{name:16s} {row}  (tip deflection, worst of eight frequencies)")

if first:
    options.out.mkdir(parents=True, exist_ok=True)
    view.convergence(
        [
            (f"error, {joint} [1]", {
                f"{name}, alone {own[name]:.1f} Hz": (
                    NUMBERS, [max(error[joint, name, n], 1e-9) for n in NUMBERS])
                for name in SETS
            })
            for joint in JOINTS
        ],
        options.out / "reference_conditions.png",
        xlabel="number of assumed modes",
        title="One resonance from different reference conditions",
        caption="First natural frequency of a steel beam held by joints, relative error against "
        "the full finite element model. Its floating frame carries modes that obey four reference "
        "conditions, whose own first frequencies are in the legend. Clamped-clamped modes cannot "
        "represent the motion in pinned joints; free-free modes converge slowly in a clamped one.",
    )  # fmt: skip
    swept = np.linspace(0, TIME, len(next(iter(slopes.values()))))
    view.panels(
        [[
            view.Panel(
                "By linearisation", "frequency of the drive [Hz]", "slope at the root [mrad]",
                curves={name: (frequencies, 1e3 * answer) for name, answer in answers.items()},
            ),
            view.Panel(
                "In time", "frequency of the drive [Hz]", "slope at the root [mrad]",
                curves={name: (LOW + (HIGH - LOW) * swept / TIME, 1e3 * slope)
                        for name, slope in slopes.items()},
            ),
        ]],
        options.out / "reference_resonance.png",
        title="A beam on a table that shakes through its resonance",
        caption=f"A table moves up and down by {1e3 * SHAKE:g} mm and carries a beam on a "
        "hinge and a support that slides. Left: amplitude of the slope at its root, linearised. "
        f"Right: the same slope in a motion of {TIME:g} s in which the frequency grows. Modes of "
        "different conditions have one resonance; those clamped at both ends stay without slope.",
    )  # fmt: skip
    view.convergence(
        [
            ("error of the tip deflection [1]",
             {name: (SIZES, [max(static[name, n], 1e-12) for n in SIZES]) for name in
              ("Craig-Bampton", "cantilever", "free-free", "pinned-pinned")}),
            ("worst error of eight frequencies [1]",
             {name: (SIZES, [max(worst[name, n], 1e-12) for n in SIZES]) for name in
              ("Craig-Bampton", "cantilever", "free-free", "pinned-pinned")}),
        ],
        options.out / "reference_statics.png",
        xlabel="elastic coordinates",
        title="What static shapes improve, and what not",
        caption="A beam clamped at its root, by Craig-Bampton and by plain assumed modes of equal "
        "size. Above: deflection under a force at the tip. Below: its eight "
        "lowest frequencies against the full model; modes that obey the condition of the joint "
        "are exact there.",
    )  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.

pinned, clamped = JOINTS
results = {
    "pinned beam by finite elements [Hz]": (EXACT[pinned], theory[0], 2e-3),
    "clamped beam by finite elements [Hz]": (EXACT[clamped], theory[1], 2e-3),
    "square transformation, 1 + change": (1 + similarity, 1.0, 1e-8),
    "Guyan, first free frequency, of pi^2": (
        (1 + bampton[0][0]) * free / theory[0] * np.pi**2, np.sqrt(720), 5e-3),
    "sixteen modes, first free frequency, 1 + error": (1 + bampton[16][0], 1.0, 1e-4),
    "pinned joints, 32 cantilever modes, 1 + error": (
        1 + error[pinned, "cantilever", 32], 1.0, 1e-3),
    "pinned joints, 32 clamped modes, over the truth": (
        1 + error[pinned, "clamped-clamped", 32], (4.730041 / np.pi) ** 2, 6e-3),
    "clamped joint, 32 free-free modes, 1 + error": (
        1 + error[clamped, "free-free", 32], 1.044, 2e-3),
    "four frames, 1 + change": (1 + frames, 1.0, 1e-9),
    "resonance of the mechanism, pinned-pinned [Hz]": (
        modes["pinned-pinned, 4 modes"], EXACT[pinned], 1e-3),
    "the same, cantilever [Hz]": (modes["cantilever, 32 modes"], EXACT[pinned], 1e-3),
    "the same, free-free [Hz]": (modes["free-free, 16 modes"], EXACT[pinned], 1e-3),
    "largest slope in time, cantilever over pinned": (
        peaks["cantilever, 32 modes"] / peaks["pinned-pinned, 4 modes"], 1.0, 1e-3),
    "tip deflection of a cantilever, finite elements [m/N]": (exact, L**3 / (3 * EI), 2e-3),
    "tip deflection by Craig-Bampton, 1 + error": (1 + static["Craig-Bampton", 8], 1.0, 1e-8),
    "tip deflection by 32 free-free modes, missing": (static["free-free", 32], 0.063, 0.05),
    "tip deflection by 8 cantilever modes, missing": (static["cantilever", 8], 3e-4, 0.5),
}  # fmt: skip
if first:
    for name, (value, expected, tolerance) in results.items():
        print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
