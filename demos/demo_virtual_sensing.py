# # Two sensors on a connecting rod: the force on it, and the stress where nothing is measured
#
# A rod of a gmsh geometry is held in its big eye; something unknown pushes and bends the small one.
# A plan says where sensors tell its modes apart. Then a displacement and two accelerations
# with noise are enough for the force and for the stress in the shank, each with its bounds.
# The record is simulated with a basis four times as rich, so that the truth is known.
#
# Run: `python demos/demo_virtual_sensing.py`
# Time: 15 s
# Writes: `virtual_sensing.png` into `out/`; another folder with `--out`

import argparse
from pathlib import Path

from mpi4py import MPI

import numpy as np

import rom
from rom import view
from rom.updating import Channels, Sensors, candidates, independent, tracker

options = argparse.ArgumentParser(description="stress of a rod from a few sensors elsewhere")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
root = MPI.COMM_WORLD.rank == 0  # under mpirun each process does all of it
say = print if root and not options.quiet else lambda *_: None

# ## The body

model = rom.fe.model(
    Path(__file__).parents[1] / "meshes" / "connecting_rod.geo",
    material=rom.Material(E=70e9, nu=0.33, rho=2700.0), parameters={"L": 0.8, "lc": 0.02},
    comm=MPI.COMM_SELF,
)  # fmt: skip
big, small = list(model.interfaces)
body, rich = (
    rom.reduce(
        model, method=rom.CraigBampton(n), interfaces={big: "rbe2", small: "rbe2"}, reference=big,
        damping=rom.ModalDamping(0.02, fixed=(big,)), stress=True, certify=False,
    )
    for n in (8, 32)
)  # fmt: skip
held = (big,)
omega, V = body.modes(fixed=held)
say(f"{model.n_dofs} dofs, {body.n_modes} coordinates; modes from {omega[0] / (2 * np.pi):.4g} Hz")

# ## Before: where sensors tell three modes apart

offered = candidates(body, 25, fixed=held)
kept, auto = independent(body, offered, 3, modes=3, fixed=held)
points, directions = (np.asarray(x)[kept] for x in (offered.points, offered.directions))
beside = (auto - np.eye(3)).max()
say(f"sensors at\n{points}\nlargest auto-MAC beside the diagonal {beside:.3f}")

# ## The record
#
# A force on the small eye along the softest direction: two pushes and a swell.

surface = body.surface.points
eye = surface[np.linalg.norm(surface - body.marker(small).point, axis=1).argmin()]
soft = body.marker(small).translation @ V[6:, 0]
force = Channels([eye], [soft])
stressed = body.stress.points
far = np.linalg.norm(stressed - body.marker(big).point, axis=1)
along = body.marker(small).point - body.marker(big).point
shank = np.flatnonzero((far > 0.3 * np.linalg.norm(along)) & (far < 0.5 * np.linalg.norm(along)))
strong = body.stress.field(V[6:, 0] / omega[0])
spot = stressed[shank[np.abs(strong[shank] @ np.r_[1, 1, 1, 0, 0, 0]).argmax()]]

dt, n_t = 2e-4, 1500
t = dt * np.arange(n_t)
f = 60 * np.exp(-(((t - 0.06) / 0.008) ** 2)) - 40 * np.exp(-(((t - 0.12) / 0.02) ** 2))
f += 30 * np.sin(2 * np.pi * 12 * t) * (t > 0.17)
sensors = (
    Sensors(Channels(points[:1], directions[:1]), "displacement", 2e-6),
    Sensors(Channels(points[1:], directions[1:]), "acceleration", 2.0),
)
wanted = (
    Sensors(Channels([spot], [along]), "stress"),
    Sensors(Channels([eye], [soft]), "displacement"),
)
noise = {"dt": dt, "walk": 150.0, "fixed": held, "unmodelled": 0.02}
filter_, truth = (tracker(b, sensors, force, wanted, **noise) for b in (body, rich))

# The rich body is driven by the force; its own state equations are exact for steps of it.

x, states = np.zeros(len(truth.A)), []
for value in f:
    x[-1] = value
    states.append(x)
    x = truth.A @ x
states = np.array(states)
exact, clean = states @ truth.W.T, states @ truth.C.T
rng = np.random.default_rng(3)
samples = clean + np.sqrt(truth.R) * rng.standard_normal(clean.shape)

# ## After: what the sensors tell

track = filter_.run(samples, t)
stress, bound = track.values[:, 0] / 1e6, 2 * track.deviations[:, 0] / 1e6
true = exact[:, 0] / 1e6
inside = np.mean(np.abs(stress - true) < bound)
off = np.sqrt(np.mean((stress - true) ** 2) / np.mean(true**2))
off_force = np.sqrt(np.mean((track.forces[:, 0] - f) ** 2) / np.mean(f**2))
say(f"stress off by {100 * off:.2g} %, force by {100 * off_force:.2g} %; {inside:.1%} inside")

options.out.mkdir(parents=True, exist_ok=True)
radius = 0.012 * np.ptp(surface, axis=0).max()
balls = {
    "sensors": points,
    "unknown force": eye[None],
    "stress wanted": spot[None],
}
things = {"rod": (surface, body.surface.triangles)} | {
    name: view.joined([view.ellipsoid((radius,) * 3, p, sides=12) for p in where])
    for name, where in balls.items()
}
ms = 1e3 * t


def curves(values):
    return [np.column_stack([ms, values])]


def within(middle, bound):
    """The area within a bound about a curve."""
    low, high = (curves(middle + sign * bound)[0] for sign in (-1, 1))
    return [np.vstack([low, high[::-1]])]


force_found, force_bound = track.forces[:, 0], 2 * track.force_deviations[:, 0]


view.plane(
    [
        view.Scene("The rod, held in its big eye", things, view=(0.4, -0.7, 1.0), up=(0, 0, 1)),
        view.Drawing(
            "Force on the small eye", "time [ms]", "force [N]", equal=False,
            polygons=within(force_found, force_bound),
            curves={"estimated": curves(force_found), "true": curves(f)},
        ),
        view.Drawing(
            "Stress in the shank, where there is no sensor", "time [ms]", "stress [MPa]",
            equal=False,
            polygons=within(stress, bound),
            curves={"estimated": curves(stress), "true": curves(true)},
        ),
        view.Drawing(
            "Error of that stress and its bounds", "time [ms]", "stress [MPa]", equal=False,
            polygons=within(0.0, bound), curves={"error": curves(stress - true)},
        ),
    ],
    options.out / "virtual_sensing.png",
    title="A displacement, two accelerations, and the stress elsewhere",
    caption="Sensors are where effective independence keeps three of 75 candidates. A Kalman "
    "filter with the reduced rod and a force of unknown history, a random walk, gives force and "
    "stress; shaded: two standard deviations about them. A richer basis made the record.",
)  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.

results = {
    "error of the force, plus one": (1 + off_force, 1.0, 0.25),
    "error of the stress, plus one": (1 + off, 1.0, 0.15),
    "share inside two deviations": (inside, 0.98, 0.03),
    "auto-MAC beside the diagonal, plus one": (1 + beside, 1.0, 0.3),
    "surprise per sample": (track.surprise.mean() / 3, 1.0, 0.1),
}
for name, (value, expected, tolerance) in results.items() if root else ():
    print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
