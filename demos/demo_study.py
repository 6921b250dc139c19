# # Which of six parameters decides a force: a study of a machine, sample by sample
#
# A mechanism file says which of its keys vary and what is kept of each motion. All cores move the
# samples; each is kept in a file as soon as it is there, so that a study that was ended goes on.
#
# From samples of a special design follow Sobol indices: the share of the variance that a parameter
# explains alone, and with all that it does together with others. First for a function whose indices
# are known, then for the pin force of a slider-crank, which closed formulas give, too.
#
# Run: `python demos/demo_study.py`
# Time: 30 s
# Writes: `study.png` and `study_force.png` into `out/`; another folder with `--out`

import argparse
from pathlib import Path

import numpy as np

import rom
from rom.components.studies import Study, bands, indices_design, tornado

options = argparse.ArgumentParser(description="a study of a slider-crank")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options.add_argument("-n", type=int, default=32, help="samples; the design has 8 times as many")
options = options.parse_args()
say = (lambda *_: None) if options.quiet else print
rng = np.random.default_rng(1)

# ## A function whose indices are known
#
# Ishigami and Homma (1990): y = sin x1 + 7 sin^2 x2 + 0.1 x3^4 sin x1, all from -pi to pi. x3 alone
# explains nothing, but a quarter of the variance together with x1.


def ishigami(x1, x2, x3):
    return {"y": np.sin(x1) + 7 * np.sin(x2) ** 2 + 0.1 * x3**4 * np.sin(x1)}


X = indices_design({f"x{k}": (-np.pi, np.pi) for k in (1, 2, 3)}, 2048, rng=rng)
known = rom.study(ishigami, X, workers=0, progress=False).indices("y", rng=rng)
v1, v2, v13 = 0.5 * (1 + 0.1 * np.pi**4 / 5) ** 2, 49 / 8, 0.01 * np.pi**8 * 8 / 225
variance = v1 + v2 + v13
say(f"the function of Ishigami and Homma:\n{known}")

# ## The machine
#
# A crank at a steady rate drives a slider against a spring and a damper; see the file.

FILE = Path(__file__).with_name("return_spring.toml")
MASS, RATE = "bodies.{}.mass", "drives.motor.law.rate"
ranges = {
    MASS.format("crank"): (0.2, 0.6), MASS.format("rod"): (0.2, 0.4),
    MASS.format("slider"): (0.2, 0.4), RATE: (200.0, 300.0),
    "springs.return.stiffness": (1e4, 3e4), "springs.return.damping": (10.0, 50.0),
}  # fmt: skip
KEEP = "max(abs(crank pin force))"
samples = indices_design(ranges, options.n, rng=rng)
found = rom.study(
    FILE, samples, keep=[KEEP, "abs(crank pin force)", "t"], progress=not options.quiet
)
peak = found.values[KEEP]
who = found.indices(KEEP, rng=rng)
say(f"largest force in the crank pin:\n{who}")

# The same force by d'Alembert: the slider's force along its guide and the moment of the rod about
# the crank pin give the force at the wrist pin, the sum of forces on the rod that at the crank pin.
r, L, I, gap = 0.04, 0.2, 1e-3, 0.2
t = np.arange(0.0, 0.032 + 1e-9, 5e-5)[:, None]


def pin_force(crank, rod, slider, rate, stiffness, damping):
    """(n_t, n) force on the rod at the crank pin, whatever the mass of the crank."""
    a = rate * t
    b = np.arcsin(r / L * np.sin(a))  # between rod and guide
    b1 = r / L * rate * np.cos(a) / np.cos(b)
    b2 = (-r / L * rate**2 * np.sin(a) + b1**2 * np.sin(b)) / np.cos(b)
    v = -r * rate * np.sin(a) - L * b1 * np.sin(b)
    w = -r * rate**2 * np.cos(a) - L * (b2 * np.sin(b) + b1**2 * np.cos(b))
    x = r * np.cos(a) + L * np.cos(b) - (r + L)
    middle = np.array([  # acceleration of the middle of the rod
        -r * rate**2 * np.cos(a) - L / 2 * (b2 * np.sin(b) + b1**2 * np.cos(b)),
        -r * rate**2 * np.sin(a) / 2,
    ])  # fmt: skip
    Bx = -(slider * w + stiffness * x + damping * v)  # of the slider on the rod
    arm = np.array([np.cos(b), -np.sin(b)])  # along the rod, from the crank pin
    moment = -I * b2 + rod * L / 2 * (arm[0] * middle[1] - arm[1] * middle[0])
    By = (moment / L + arm[1] * Bx) / arm[0]
    return np.hypot(rod * middle[0] - Bx, rod * middle[1] - By)


def peaks(many):
    """(n,) largest forces of many samples, some hundred at a time."""
    parts = range(0, len(many[RATE]), 512)
    return np.concatenate([
        pin_force(*(x[k : k + 512] for x in many.values())).max(axis=0) for k in parts
    ])  # fmt: skip


exact = peaks(samples)
many = indices_design(ranges, 4096, rng=rng)
n = len(many[RATE])
formula = Study(many, {KEEP: peaks(many)}, {}, {}, np.zeros(n)).indices(KEEP, rng=rng)
say(f"the same by the formula, {n} samples:\n{formula}")

options.out.mkdir(parents=True, exist_ok=True)
tornado(who, options.out / "study.png", of="the largest force in the crank pin")
bands(found, "abs(crank pin force)", options.out / "study_force.png", unit="[N]")

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.

worst = np.abs(peak / exact - 1).max()
order = np.argsort(-who.total)
results = {
    "first index of x1 of the known function": (known.first[0], v1 / variance, 0.05),
    "first index of x2": (known.first[1], v2 / variance, 0.05),
    "total index of x3, which alone decides nothing": (known.total[2], v13 / variance, 0.05),
    "samples that failed": (len(found.failed) + 1, 1, 1e-12),
    "largest error of a peak against the formula, plus one": (1 + worst, 1.0, 1e-3),
    "total index of the rate": (who.total[3], formula.total[3], 0.3),
    "index of the crank's mass, which decides nothing, plus one": (1 + who.total[0], 1.0, 1e-6),
    "the parameter that decides most": (int(order[0]), int(np.argmax(formula.total)), 1e-12),
}
for name, (value, expected, tolerance) in results.items():
    print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
