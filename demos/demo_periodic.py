# # Motions that repeat: which are there, and which of them last?
#
# A simulation finds the motions that last, one at a time. `rom.periodic_motion` looks for a motion
# that ends after a period as it began, and `rom.periodic_path` follows it while a parameter
# changes, past folds and through motions that no simulation would show. First a mass between two
# springs across its way; then a pair of gears through its resonance, where teeth part.
#
# Run: `python demos/demo_periodic.py`
# Time: 1.5 min
# Writes: `periodic.png` into `out/`; another folder with `--out`

import argparse
from pathlib import Path

import numpy as np

import rom
from rom import view
from rom.components.gear_mesh import Correction, GearPair

options = argparse.ArgumentParser(description="paths of periodic motions")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
say = print if not options.quiet else lambda *_: None

# ## A spring that hardens
#
# A mass of 1 kg slides along x between two springs across its way, which are pressed together when
# it is in the middle: F = -2 k x (1 - l / sqrt(1 + x^2)).

k, free, damping, force = 2.5, 0.8, 0.1, 0.3


def between_springs(w):
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mass = mech.add_rigid("mass", mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0)).marker((0, 0, 0))
    base = mech.ground.marker((0, 0, 0))
    mech.prismatic("guide", base, mass, axis=(1, 0, 0))
    for side in (1, -1):
        end = mech.ground.marker((0, side, 0))
        mech.spring_damper(f"spring {side}", end, mass, stiffness=k, free_length=free)
    mech.bushing("damper", base, mass, stiffness=np.zeros(6), damping=(damping, 0, 0, 0, 0, 0))
    mech.force("push", mass, lambda t: (force * np.cos(w * t), 0, 0))
    return mech


def largest(solution):
    """Amplitude of the mass [m]."""
    return np.abs(solution.position("mass")[:, 0]).max()


curve = rom.periodic_path(between_springs, (0.7, 2.2), period=lambda w: 2 * np.pi / w)
amplitude, folds = curve.of(largest), [x.p for x in curve.critical]
say(f"{len(curve.p)} motions; the path turns back at {folds[0]:.4f} and {folds[1]:.4f} rad/s")

# A simulation that begins on the branch between the folds leaves it for one of the others.

inside = int(np.flatnonzero(~curve.stable)[len(np.flatnonzero(~curve.stable)) // 2])
lost = curve.motions[inside]
fate = rom.simulate(lost.solution.mechanism, state=lost.state, t_end=60 * lost.period,
                    dt=lost.period / 200)  # fmt: skip
late = fate.t > 58 * lost.period
last = np.abs(fate.position("mass")[late, 0]).max()
say(f"at {curve.p[inside]:.3f} rad/s: {amplitude[inside]:.3f} m does not last, {last:.3f} m does")

# ## Teeth that part
#
# The pinion of 26 teeth runs at constant speed and drives the gear of 40 against a torque. After
# one tooth both wheels look as before, so that a period is the time of a tooth, and the wheels are
# compared after they were turned back.

pair = GearPair((26, 40), 4e-3, 0.03, thinning=5e-5)
base_radius = 0.5 * 4e-3 * 40 * np.cos(np.deg2rad(20.0))
turns = {"pinion axle": 2 * np.pi / 26, "gear axle": -2 * np.pi / 40}


def geared(speed):
    mech, ends = rom.Mechanism(gravity=(0, 0, 0)), []
    wheels = ("pinion", 0.0, 2e-3, speed), ("gear", pair.distance, 9e-3, -speed * 26 / 40)
    for name, x, J, spin in wheels:
        wheel = mech.add_rigid(name, mass=1.0, inertia=(0.6 * J, 0.6 * J, J), at=(x, 0, 0),
                               omega=(0, 0, spin)).marker((0, 0, 0))  # fmt: skip
        mech.revolute(f"{name} axle", mech.ground.marker((x, 0, 0)), wheel, axis=(0, 0, 1))
        ends.append(wheel)
    mech.gear_mesh("mesh", *ends, axis=(0, 0, 1), pair=pair, stiffness=1.3e10, damping=5e-6,
                   entry=0.05, correction=Correction(relief=(1e-5, 1e-5),
                                                     extent=(2e-3, 2e-3)))  # fmt: skip
    mech.drive("speed", "pinion axle", lambda t: speed * t, rate=lambda t: speed + 0 * t,
               acceleration=lambda t: 0 * t)  # fmt: skip
    mech.torque("brake", ends[1], (0, 0, 80.0))
    return mech


def vibration(motion, speed):
    """Peak to peak of the error of transmission [micrometre]."""
    s = motion.solution
    return 1e6 * base_radius * np.ptp(s.joint("gear axle").angle + speed * 26 / 40 * s.t)


def swept(first, last):
    path = rom.periodic_path(
        geared, (first, last), period=lambda w: 2 * np.pi / 26 / w, turns=turns, steps=100,
        settle=20, step=0.2,
    )  # fmt: skip
    errors = np.array([vibration(*x) for x in zip(path.motions, path.p, strict=True)])
    apart = path.of(lambda s: np.linalg.norm(s.reaction("gear axle")[:, :3], axis=1).min()) < 1.0
    return path, errors, apart


down, error_down, apart_down = swept(1100.0, 400.0)
up, error_up, apart_up = swept(400.0, 1100.0)
for name, path, parted in (("down", down, apart_down), ("up", up, apart_up)):
    say(f"{name}: {len(path.p)} motions, teeth part in {parted.sum()} of them,",
        *(f"{x.kind} at {x.p:.1f} rad/s" for x in path.critical))  # fmt: skip

options.out.mkdir(parents=True, exist_ok=True)


def branches(p, y, stable):
    """Stable and unstable parts of a curve."""
    parts = {}
    for word, shown in (("stable", stable), ("unstable", ~stable)):
        near = shown | np.r_[False, shown[:-1]] | np.r_[shown[1:], False]
        parts[word] = (p, np.where(shown if word == "stable" else near, y, np.nan))
    return parts


spring = view.Panel(
    "A spring that hardens", "frequency of the force [rad/s]", "amplitude [m]",
    curves=branches(curve.p, amplitude, curve.stable),
    points={"folds": (folds, [largest(x.motion.solution) for x in curve.critical])},
)  # fmt: skip
teeth = view.Panel(
    "A pair of gears", "speed of the pinion [rad/s]", "error of transmission [micrometre]",
    curves={"from above, stable": branches(down.p, error_down, down.stable)["stable"],
            "unstable": branches(up.p, error_up, up.stable)["unstable"],
            "from below, stable": branches(up.p, error_up, up.stable)["stable"]},
    points={"teeth part": (np.r_[down.p[apart_down], up.p[apart_up]],
                           np.r_[error_down[apart_down], error_up[apart_up]])},
)  # fmt: skip
view.panels(
    [[spring, teeth]], options.out / "periodic.png", title="Motions that repeat",
    caption="Left: a mass between two springs across its way, driven by a harmonic force; between "
    "the folds the motion of middle amplitude is unstable. Right: a spur pair of 26 and 40 teeth "
    "through the resonance of its mesh, from high speed and from low; error of transmission is the "
    "vibration of the gear on its base circle, peak to peak. Where teeth part (circles) the mesh "
    "is softer on average: the curve leans to lower speeds and is unstable between two that last.",
)  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.
# The folds are those of harmonic balance with the harmonics 1 to 9.


def lasting(path, near):
    """Error of transmission of a motion of a path near a speed, and after 40 teeth in time."""
    j = int(np.argmin(np.where(path.stable, np.abs(path.p - near), np.inf)))
    motion, speed = path.motions[j], path.p[j]
    sol = rom.simulate(motion.solution.mechanism, state=motion.state, rho_inf=0.8,
                       t_end=40 * motion.period, dt=motion.period / 100)  # fmt: skip
    angle = sol.joint("gear axle").angle + speed * 26 / 40 * sol.t
    return 1e6 * base_radius * np.ptp(angle[-101:]), vibration(motion, speed)


above, below = lasting(down, 550.0), lasting(up, 550.0)
say(f"at 550 rad/s the error is {above[1]:.3g} or {below[1]:.3g} micrometre")
results = {
    "upper fold [rad/s]": (folds[0], 1.66929, 3e-4),
    "lower fold [rad/s]": (folds[1], 1.38211, 3e-4),
    "motions of the unstable branch in one piece": (np.abs(np.diff(curve.stable)).sum(), 2, 1e-9),
    "error of transmission from above, simulated": (*above, 1e-2),
    "error of transmission from below, simulated": (*below, 1e-2),
    "teeth part on the way down": (float(apart_down.any()), 1.0, 1e-9),
    "fold of the way up": (float([x.kind for x in up.critical] == ["fold"]), 1.0, 1e-9),
}
for name, (value, expected, tolerance) in results.items():
    print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
