# # An aircraft on the test stand: what does the noise leave to be known?
#
# The beam model of a test bed like an aircraft is wrong: the wing twists too easily, the drums are
# heavier than drawn. A vibration test gives noisy frequency responses. Following Berriet,
# Fillod and Bouhaddi, modal damping joins the unknowns, every value is weighted by its error, and
# the model is condensed to the sensors. The test is simulated, so that the truth is known.
#
# Run: `python demos/demo_updating.py`
# Time: 10 s
# Writes: `updating.png` into `out/`; another folder with `--out`

import argparse
from pathlib import Path
from time import perf_counter

import numpy as np

from rom import view
from rom.components.updating import (
    PARTS,
    AtSensors,
    Measurement,
    ParametricModel,
    airframe,
    modal,
    noisy,
    parametric_basis,
    responses,
    update_by_input,
    update_by_output,
)

options = argparse.ArgumentParser(description="updating of a test bed like an aircraft")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("--noise", type=float, default=0.05, help="relative noise on each value")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
say = (lambda *_: None) if options.quiet else print

# ## The model and what may be wrong with it
#
# Four kinds of stiffness and two masses, each relative to the drawing.

bed = airframe(0.1)
K, M = sum(bed.K.values()), sum(bed.M.values())
stiffness = {
    "wing bending": [("wing", "bending")], "wing torsion": [("wing", "torsion")],
    "wing in-plane": [("wing", "sideways")], "fin bending": [("fin", "bending")],
}  # fmt: skip
masses = {"mass of the drums": ["left drum", "right drum"], "mass of the tailplane": ["tailplane"]}
nothing = np.zeros_like(K)
dK = np.array([sum(bed.K[key] for key in keys) for keys in stiffness.values()] + [nothing] * 2)
dM = np.array([nothing] * 4 + [sum(bed.M[key] for key in keys) for keys in masses.values()])

# ## The test
#
# Nineteen accelerometers; shakers at a wing tip and a tip of the
# tailplane. Eight modes in the band, 240
# lines; the test object itself is not condensed.

wing = [y for y in bed.points[np.isclose(bed.points[:, 2], 0.096), 1] if 0.3 < abs(y) < 0.7]
sensors = [((x, y, 0.106), 2) for y in (0.95, -0.95) for x in (0.2, -0.2)]
sensors += [((0, y, 0.096), 0) for y in (0.95, -0.95)] + [((0, y, 0.096), 2) for y in wing[::2]]
sensors += [((x, 0, 0), axis) for x in (0.6, -0.9) for axis in (1, 2)] + [((0.6, 0, 0), 0)]
sensors += [((-0.85, 0, 0.35), 1)] + [((-0.85, y, 0.355), 2) for y in (0.2, -0.2)]
sensors += [((-0.85, 0.2, 0.355), 0)]
inputs = (0, next(k for k, s in enumerate(sensors) if s == ((-0.85, 0.2, 0.355), 2)))
seen = np.array([bed.sensor(point, axis) for point, axis in sensors])
model = ParametricModel(K, M, dK, dM, seen, n_rigid=6)

true = np.array([0.20, -0.30, 0.25, -0.35, 0.40, -0.30])
zeta = np.array([0.8, 1.2, 1.0, 1.0, 1.5, 1.1, 0.9, 1.3]) / 100
f = np.linspace(4.0, 62.0, 240)
omega, start, guess = 2 * np.pi * f, np.zeros(6), np.full(8, 0.01)
exact = responses(model, true, zeta, omega, inputs)
test = Measurement(omega, noisy(exact, options.noise, np.random.default_rng(7)), inputs)
for name, p in (("test object", true), ("drawing", start)):
    found = np.sqrt(modal(model.at(p), []).lam[6:14]) / (2 * np.pi)
    say(f"{name:12s}", *(f"{x:7.2f}" for x in found), "Hz")

# ## Three ways to compare
#
# The reduced model holds Craig-Bampton bases of four parameter sets: small, and still parametric.
# Twenty modes of each would do for the picture, and leave a bias of four standard deviations.
# The static condensation to the sensors is smaller, and biased whatever the noise. The residual of
# the equations of motion is linear in what is sought; it is condensed once more, together with the
# test, to as many directions as there are modes in the band, six of them rigid.

clock = perf_counter()
samples = np.vstack([start, np.random.default_rng(1).uniform(-0.35, 0.35, (3, 6))])
small, condensed = model.in_basis(parametric_basis(model, 40, samples)), AtSensors(model)
found = {
    "responses, reduced": update_by_output(small, test, start, guess),
    "responses, condensed": update_by_output(condensed, test, start, guess),
    "equations, condensed": update_by_input(condensed, test, start, guess, rank=14),
}
say(f"{len(K)} dofs reduced to {len(small.K)}; three updates in {perf_counter() - clock:.1f} s")
worst = {name: np.abs(update.p - true).max() for name, update in found.items()}
for name, update in found.items():
    say(f"{name:28s}: worst change wrong by {worst[name]:.4f}; residual {update.residual:.4f}")

best = found["responses, reduced"]
fine = np.linspace(f[0], f[-1], 2000)
before, after = (
    responses(model, *x, 2 * np.pi * fine, inputs)[:, 2, 0]
    for x in ((start, guess), (best.p, best.zeta))
)
names = [*(f"{name} stiffness" for name in stiffness), *masses]
things = {"aluminium": view.joined(
    [view.bar(part.path[0], part.path[-1], part.size, part.broad) for part in PARTS]
)}  # fmt: skip
for name, which, radius in (("sensors", range(len(sensors)), 0.025), ("exciters", inputs, 0.035)):
    balls = [view.ellipsoid((radius,) * 3, sensors[k][0], sides=16) for k in which]
    things[name] = view.joined(balls)
options.out.mkdir(parents=True, exist_ok=True)
view.updating(
    f,
    {
        f"test, {100 * options.noise:g} % noise": test.H[:, 2, 0],
        "model as drawn": (fine, before),
        "model updated": (fine, after),
    },
    {n: x for n, *x in zip(names, true, best.p, best.deviation, strict=False)},
    options.out / "updating.png",
    structure=view.Scene("The test bed", things, view=(1.0, 0.9, 0.8), up=(0, 0, 1)),
    label="displacement per force [m/N]",
    title="An aircraft-like test bed: six errors of the model, found from noisy responses",
    caption="Top: vertical motion of one wing tip due to a force at the other one. Each peak is a "
    "natural mode; the model as drawn has them in the wrong places. Bottom left: how the test "
    f"object differs from the drawing, and what the update finds from {f.size} frequencies, "
    f"{len(sensors)} sensors and two exciters, damping of eight modes being unknown as well. "
    "Bottom middle: what is left of the error, with the scatter that the update expects from "
    "the noise. Bottom right: fuselage, wing with drums at its tips, fin and tailplane.",
)  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.
# Noise averages out over many lines; the bias of a condensation does not.

along = np.linalg.lstsq(bed.T, np.tile([1.0, 0, 0, 0, 0, 0], len(bed.points)), rcond=None)[0]
spread = (best.p - true) / best.deviation[:6]
results = {
    "mass [kg]": (along @ M @ along, 2700 * (0.15 * 0.05 * 1.5 + 0.1 * 0.01 * 3.5), 1e-9),
    "worst change found, plus one": (1 + worst["responses, reduced"], 1.0, 0.005),
    "worst damping ratio found over true": (1 + np.abs(best.zeta / zeta - 1).max(), 1.0, 0.1),
    "bias of the condensation over noise, at least 3": (
        min(worst["responses, condensed"] / worst["responses, reduced"], 3.0), 3.0, 1e-12),
    "errors in standard deviations, at most 2.5": (max(np.abs(spread).max(), 2.5), 2.5, 1e-12),
    "residual over noise": (best.residual * np.sqrt(2) / options.noise, 1.0, 0.03),
}  # fmt: skip
for name, (value, expected, tolerance) in results.items():
    print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
