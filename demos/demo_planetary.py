# # A planetary gear: teeth, ball bearings, and what a heavy load does to them
#
# A sun drives three planets inside a ring that is held; they carry an arm round, which is braked.
# The arm is meshed with gmsh and reduced, and its pins give way. All teeth touch on both flanks,
# with backlash; the arm runs on two ball bearings. In a second run a tooth of one planet stands out
# on the flank that the sun drives.
#
# Run: `python demos/demo_planetary.py`
# Time: 40 s
# Writes: `planetary_motion.png` and `planetary.png` into `out/`; another folder with `--out`

import argparse
from pathlib import Path

from mpi4py import MPI

import numpy as np

import rom
from rom import rotation, view
from rom.components.gear_mesh import Correction, GearPair, stiffness_table

options = argparse.ArgumentParser(description="a planetary gear on ball bearings")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
first = MPI.COMM_WORLD.rank == 0
say = print if first and not options.quiet else lambda *_: None

# ## Wheels
#
# Teeth of module 2 mm; an internal gear has a negative number of them. A pair of external teeth
# bends as Weber and Banaschek say; the ring is taken to be as stiff. Tips are relieved.

SUN, PLANET, RING, WIDTH, MODULE = 24, 24, -72, 0.02, 2e-3
outer = GearPair((SUN, PLANET), MODULE, WIDTH, thinning=2e-5)
inner = GearPair((PLANET, RING), MODULE, WIDTH, thinning=2e-5)
table = stiffness_table(outer, force=1e5)
relief = {"relief": (8e-6, 8e-6), "extent": (1.5e-3, 1.5e-3), "power": 2.0}
balls = rom.mbs.BallBearing(9, 12.7e-3, 65e-3, clearance=-4e-6)
SPEED, TORQUE = 1500 * 2 * np.pi / 60, 600.0
ERROR = 8e-6  # by which one tooth of the first planet stands out [m]
NAMES = ("all teeth alike", "a tooth stands out")
arm, Z, O = outer.distance, (0, 0, 1), (0, 0, 0)
carrier_speed = SUN / (SUN - RING)  # Willis, of the speed of the sun

# ## The carrier: geometry, matrices, reduction
#
# A disc with the pins of the planets on its front, and a hollow shaft behind it.

model = rom.fe.model(Path(__file__).parents[1] / "meshes" / "carrier.geo",
                     material=rom.Material(E=206e9, nu=0.3, rho=7850.0),
                     parameters={"a": arm, "lc": 8e-3})  # fmt: skip
PINS, JOURNALS = [f"pin_{k + 1}" for k in range(3)], ("front", "back")
arms = rom.reduce(model, method=rom.CraigBampton(3), reference="mean-axis", certify=False,
                  interfaces=dict.fromkeys(PINS, "rbe3") | dict.fromkeys(JOURNALS, "rbe2"),
                  damping=rom.Rayleigh(beta=1e-6))  # fmt: skip
say(f"carrier: {arms.mass:.2f} kg, {model.n_dofs} dofs, {arms.n_modes} coordinates")


def train(*, error):
    """The mechanism; one tooth of its first planet stands out by the error, towards the sun."""
    mech = rom.Mechanism(gravity=(0, -9.81, 0))
    ground = mech.ground.marker
    bodies = {
        name: mech.add_rigid(name, mass=mass, inertia=(J, J, 2 * J), at=O, omega=(0, 0, speed))
        for name, mass, J, speed in (
            ("sun", 0.4, 6e-5, SPEED), ("ring", 2.3, 7e-3, 0.0),
        )
    }  # fmt: skip
    carrier = mech.add_flexible("carrier", arms, omega=(0, 0, SPEED * carrier_speed))
    mech.revolute("input", ground(O), bodies["sun"].marker(O), axis=Z)
    mech.drive("motor", "input", lambda t: SPEED * t, rate=lambda t: SPEED + 0 * t)
    held = {"stiffness": (2e8, 2e8, 2e8, 1e6, 1e6, 2e6), "damping": (2e3, 2e3, 2e3, 5, 5, 20)}
    mech.bushing("housing", ground(O), bodies["ring"].marker(O), **held)
    for side in JOURNALS:
        journal = carrier.marker(side)
        mech.rolling_bearing(f"{side} bearing", journal, ground(mech.design_point(journal)),
                             axis=Z, bearing=balls, damping=2.0)  # fmt: skip
    mech.torque("brake", carrier.marker("back"), (0, 0, -TORQUE))
    for k, pin in enumerate(PINS):
        at = mech.design_point(carrier.marker(pin))
        spin = SPEED * (carrier_speed - (1 - carrier_speed) * SUN / PLANET)
        planet = mech.add_rigid(
            f"planet {k}", mass=0.4, inertia=(6e-5, 6e-5, 1.2e-4), at=at, omega=(0, 0, spin),
            velocity=SPEED * carrier_speed * np.cross(Z, at),
        )  # fmt: skip
        mech.revolute(f"pin {k}", carrier.marker(pin), planet.marker(O), axis=Z)
        teeth = np.where(np.arange(PLANET) == 5, 0.0, error if k == 0 else 0.0)
        law = {"stiffness": table, "damping": 2e-6}
        with_sun, with_ring = Correction(**relief, pitch=((), teeth)), Correction(**relief)
        mech.gear_mesh(f"sun and planet {k}", bodies["sun"].marker(O), planet.marker(O), axis=Z,
                       pair=outer, correction=with_sun, **law)  # fmt: skip
        mech.gear_mesh(f"planet {k} and ring", planet.marker(O), bodies["ring"].marker(O),
                       axis=(0, 0, -1), pair=inner, correction=with_ring, **law)  # fmt: skip
    return mech


# ## At 1500 revolutions per minute, under 600 N m
#
# The train starts at its speed; what is shown begins when the first vibrations have died out.

motions = {error: rom.simulate(train(error=error), t_end=0.2, dt=1e-5, save_every=4,
                               progress=not options.quiet)
           for error in (0.0, ERROR)}  # fmt: skip
smooth, rough = motions.values()
late = smooth.t > 0.05
turned = smooth.joint("input").angle[late]
carried = np.unwrap(np.arctan2(*smooth.position("planet 0")[late, 1::-1].T))
ratio = np.ptp(carried) / np.ptp(turned)
torque = {NAMES[k]: sol.drive_load("motor")[late] for k, sol in enumerate((smooth, rough))}
shares = [np.linalg.norm(smooth.element(f"sun and planet {k}").force[late, 0], axis=1)
          for k in range(3)]  # fmt: skip


def spectrum(x):
    """Frequencies [Hz] and amplitudes of a signal."""
    window = np.hanning(x.size)
    size = np.abs(np.fft.rfft((x - x.mean()) * window)) * 2 / window.sum()
    return np.fft.rfftfreq(x.size, smooth.t[1] - smooth.t[0]), size


frequency = {name: spectrum(x) for name, x in torque.items()}
mesh = SUN * (1 - carrier_speed) * SPEED / (2 * np.pi)  # teeth that pass per second
f = frequency[NAMES[0]][0]
near = np.abs(f - mesh * np.maximum(np.round(f / mesh), 1)) < 10.0
passing = {name: (size[near] ** 2).sum() / (size**2).sum() for name, (_, size) in frequency.items()}
say(
    f"tooth frequency {mesh:.1f} Hz; of the shaking torque its multiples are "
    + ", ".join(f"{100 * x:.1f} % ({name})" for name, x in passing.items())
)

if first:
    options.out.mkdir(parents=True, exist_ok=True)
    small, back = view.gear(SUN, MODULE, WIDTH, bore=0.016), -0.5 * WIDTH
    c, s = np.cos(np.pi / PLANET), np.sin(np.pi / PLANET)  # half a pitch, so that teeth meet gaps
    planet = small[0] @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]), small[1]
    shapes = {"sun": small, **{f"planet {k}": planet for k in range(3)},
              "ring": view.ring((0, 0, back), (0, 0, -back), 0.1475, 0.165)}  # fmt: skip
    view.instants(train(error=0.0), smooth, options.out / "planetary_motion.png", shapes=shapes,
                  times=[0.0, 0.012, 0.024, 0.036], view=(0.3, 0.2, 1.0), up=(0, 1, 0),
                  symbols=False,
                  caption=f"Planetary train seen from the motor: a sun of {SUN} teeth drives three "
                  f"planets of {PLANET} inside a ring of {abs(RING)}, drawn without its teeth; the "
                  "carrier behind them, meshed and reduced, is braked and carried round; its pins "
                  "give way.")  # fmt: skip
    t = smooth.t[late]
    out = np.linalg.norm(rough.element("sun and planet 0").force[late, 0], axis=1)
    some = np.arange(t.size) < 300
    some = np.roll(some, np.clip(np.argmax(abs(out - shares[0])) - 150, 0, t.size - 300))
    forces = {name: (1e3 * t[some], x[some])
              for name, x in ((NAMES[1], out),
                              ("all teeth alike", shares[0]))}  # fmt: skip
    low = f < 2500
    view.panels(
        [[
            view.Panel("Between sun and first planet", "time [ms]", "force of the teeth [N]",
                       curves=forces),
            view.Panel("Torque at the sun", "frequency [Hz]", "amplitude [N m]",
                       curves={name: (f[low], size[low])
                               for name, (f, size) in frequency.items()}),
        ]],
        options.out / "planetary.png",
        title="A planetary gear at 1500 revolutions per minute",
        caption=f"A sun of {SUN} teeth drives three planets in a ring of {-RING} that is held; the "
        f"arm that they carry runs on two ball bearings and is braked by {TORQUE:g} N m. Left: the "
        "force between the sun and one of the planets, which share the load, while a tooth of it "
        f"passes that stands out by {1e6 * ERROR:g} micrometres: it is struck as it comes into "
        f"contact and as it leaves. Right: the torque at the sun has lines at the {mesh:.0f} Hz at "
        "which teeth pass and at multiples; the tooth shakes the train between them, most where it "
        "vibrates by itself.",
    )  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.

# Statics of the arm: what planets do to its pins, in its own axes, against the brake.
A = np.array([rotation.matrix(p) for p in smooth.orientation("carrier")[late]])
back = arms.markers["back"].rotation[2]
load, around = -TORQUE * back, -back
for k, pin in enumerate(arms.markers[name] for name in PINS):
    on_planet = smooth.reaction(f"pin {k}")[late].reshape(-1, 2, 3)
    F, M = -np.einsum("nji,nkj->ki", A, on_planet) / late.sum()
    load = load + F @ pin.translation + M @ pin.rotation
    around = around + np.cross(Z, pin.point) @ pin.translation / 3 / arm**2
moved = smooth.elastic("carrier")[late].mean(axis=0), np.linalg.solve(arms.K, load)
results = {
    "turn of the pins against the shaft [rad], by statics": (*(around @ q for q in moved), 1e-3),
    "speed of the arm over that of the sun": (ratio, carrier_speed, 1e-4),
    "mean torque at the sun [N m]": (torque[NAMES[0]].mean(), TORQUE * carrier_speed, 0.02),
    "share of the tooth frequency and its multiples, all alike": (passing[NAMES[0]], 1.0, 0.05),
    "load of a planet, of the mean": (shares[0].mean() / np.mean(shares), 1.0, 0.05),
}  # fmt: skip
if first:
    for name, (value, expected, tolerance) in results.items():
        print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
