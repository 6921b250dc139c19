# # A bladed wheel on its shaft, with a gear: one mechanism
#
# Which modes of a bladed wheel does its shaft feel? One sector is meshed and reduced; the whole
# wheel becomes one flexible body, `rom.wheel_body`, and stands on a shaft of solid finite elements
# with a gear: first at rest, on springs, then at 9000 turns a minute on oil films. Blades that bend
# alike in all sectors twist the shaft against the teeth, waves with one nodal diameter bend it, and
# all others stay in the wheel.
#
# Run: `python demos/demo_bladed_rotor.py`; under `mpirun` one process does the work
# Time: 40 s
# Writes: `bladed_rotor.png` into `out/`; another folder with `--out`

import argparse
from pathlib import Path

from mpi4py import MPI

import numpy as np

import rom
from rom import view
from rom.components.gear_mesh import GearPair, stiffness_table
from rom.components.journal_bearing import JournalBearing, equilibrium

options = argparse.ArgumentParser(description="a bladed wheel on a geared shaft")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
finite_elements = rom.fe.model  # PETSc starts here, on all processes together
if MPI.COMM_WORLD.rank:
    raise SystemExit  # a reduced mechanism is work for one process
say = (lambda *_: None) if options.quiet else print
MESHES = Path(__file__).parents[1] / "meshes"

# ## The wheel
#
# Twelve titanium blades on a disk. The sector is reduced once; three modes with each number of
# nodal diameters make a body of 36 elastic coordinates on a rigid hub.

sizes = {"N": 12, "r_bore": 0.025, "r_rim": 0.07, "r_tip": 0.13, "width": 0.016, "chord": 0.012,
         "chord_tip": 0.01, "t": 0.003, "t_tip": 0.002, "lc": 0.012, "lc_blade": 0.008}  # fmt: skip
model = finite_elements(
    MESHES / "bladed_disk.geo", material=rom.Material(E=114e9, nu=0.33, rho=4430.0),
    parameters=sizes, comm=MPI.COMM_SELF,
)  # fmt: skip
full = rom.rotating_sector(rom.CyclicSector.from_model(model, fixed=("bore",)), model)
sector = rom.reduce_sector(full, n_modes=40, functions=rom.Polynomial(6))
wheel = rom.wheel_body(sector, model, 3)
say(wheel)

# Spinning on a rigid shaft it has the waves of its sector, forward and backward.

SPEED = 2 * np.pi * 150
spinning = wheel.rotating_frequencies(SPEED, (0, 0, 1), fixed=("bore",))
waves = [rom.travelling_modes(sector, n, 2, speed=SPEED).frequencies for n in sector.diameters]
low = [wave[0] for wave in waves]
apart = max(np.abs(spinning / f - 1).min() for f in low)
say(f"waves at {30 * SPEED / np.pi:.0f} 1/min:", *(f"{f:.1f}" for f in low), f"Hz, to {apart:.0e}")

# ## The shaft
#
# Steel; its gear, 48 teeth, meshes with a pinion on a generator that keeps its speed. Where the
# wheel stands, and at the gear, the shaft is rigid. At rest springs hold both journals, at speed
# two plain bearings of 40 micrometres.

L, Z_WHEEL, Z_GEAR, JOURNALS = 0.30, 0.21, 0.11, {"journal_a": 0.04, "journal_b": 0.26}
PAIR, TORQUE, LOSS, Z = GearPair((24, 48), 2.5e-3, 0.02), 60.0, 2e-6, np.array([0, 0, 1.0])
TEETH = stiffness_table(PAIR, force=TORQUE / PAIR.rb[0] / PAIR.width)
FILM = JournalBearing(0.05, 0.02, 4e-5, cavitation="reynolds", cells=(60, 4))
OIL, GRAVITY = 0.02, np.array([0, -9.81, 0])  # viscosity [Pa s]
shaft = rom.reduce(
    finite_elements(
        MESHES / "gear_shaft.geo", material=rom.Material(E=206e9, nu=0.3, rho=7850.0),
        parameters={"L": L, "d": 0.05, "z_a": JOURNALS["journal_a"], "z_w": Z_GEAR, "b": 0.02,
                    "D": 0.1137, "z_2": Z_WHEEL, "b_2": 0.016, "z_b": JOURNALS["journal_b"],
                    "l_j": 0.02, "lc": 0.02},
        comm=MPI.COMM_SELF,
    ),
    method=rom.CraigBampton(6), name="shaft", certify=False,
    interfaces=dict.fromkeys(JOURNALS, "rbe3") | {"wheel": "rbe2", "wheel_2": "rbe2"},
)  # fmt: skip


def rotor(body, speed=0.0):
    """Shaft, gear and bearings, with a wheel: flexible, or of its mass alone."""
    mech, loss = rom.Mechanism(gravity=GRAVITY), LOSS if speed else 0.0
    ground, part = mech.ground.marker, mech.add_flexible("shaft", shaft, omega=speed * Z)
    held = np.array([0, 0, 2e7, 0, 0, 0]) if speed else np.array([5e7, 5e7, 2e7, 0, 0, 0])
    for end in JOURNALS:
        seat = part.marker(end)
        bush = ground(mech.design_point(seat))
        mech.bushing(f"seat of {end}", bush, seat, stiffness=held, damping=loss * held)
        if speed:
            mech.journal_bearing(end, seat, bush, axis=Z, bearing=FILM, oil=OIL)
    beside = (-PAIR.distance, 0, Z_GEAR)
    pinion = mech.add_rigid("pinion", mass=0.5, inertia=(3e-4, 3e-4, 2e-4), at=beside,
                            omega=-2 * speed * Z).marker((0, 0, 0))  # fmt: skip
    mech.revolute("generator", ground(beside), pinion, axis=Z)
    mech.drive("keeps speed", "generator", lambda t: -2 * speed * t,
               rate=lambda t: -2 * speed + 0 * t)  # fmt: skip
    mech.gear_mesh("teeth", pinion, part.marker("wheel"), axis=Z, pair=PAIR, stiffness=TEETH,
                   damping=loss)  # fmt: skip
    at = (0, 0, Z_WHEEL)
    if body is None:
        turbine = mech.add_rigid("wheel", mass=wheel.mass, inertia=wheel.inertia, at=at)
        seat = turbine.marker((0, 0, 0))
    else:
        seat = mech.add_flexible("wheel", body, at=at, omega=speed * Z).marker("bore")
    mech.fixed("shrink fit", part.marker("wheel_2"), seat)
    mech.torque("gas", part.marker("wheel_2"), 2 * TORQUE * Z)
    return mech


# ## What the shaft feels
#
# The twelve waves of the first family on a hub at rest, and the modes of the mechanism. Waves with
# two and more nodal diameters leave the hub without force, and stay as they are.

mech, stiff = rotor(wheel), rotor(None)
whole = rom.linearize(mech, rom.equilibrium(mech), n=24).frequencies
rigid = rom.linearize(stiff, rom.equilibrium(stiff), n=8).frequencies
held = wheel.frequencies(12, fixed=("bore",))
diameters = np.array([int(label.split()[2]) for label in wheel.labels[:12]])
apart_from = np.array([np.abs(whole / f - 1).min() for f in held])
say("with a rigid wheel [Hz]:", *(f"{f:.1f}" for f in rigid))
say("with a flexible one:", *(f"{f:.1f}" for f in whole))
for n in range(7):
    away = apart_from[diameters == n].max()
    say(f"{n} nodal diameters: the nearest mode of the mechanism is {away:.0e} away")

# ## At speed, on films
#
# The gas begins to blow at 9000 turns a minute, while the journals stand amid their bushes. They
# come to rest where films carry the teeth and the weight; the blades ring, in axes that turn with
# them: all as one, and in a wave with one nodal diameter, otherwise than on a hub at rest. A wave
# with two is hardly there, and keeps its frequency.

motion = rom.simulate(rotor(wheel, SPEED), t_end=0.08, dt=2e-5, progress=not options.quiet)
late = motion.t > 0.06
teeth = -motion.element("teeth").force[late, 0].mean(axis=0)  # on the gear
loads = [(teeth, Z_GEAR), (shaft.mass * GRAVITY, shaft.first_moment[2] / shaft.mass),
         (wheel.mass * GRAVITY, Z_WHEEL + wheel.first_moment[2] / wheel.mass)]  # fmt: skip
journals, carried, turn = {}, [], np.linspace(0, 2 * np.pi, 100)
for end, own in JOURNALS.items():
    (other,) = JOURNALS.keys() - {end}
    share = sum(force * (z - JOURNALS[other]) / (own - JOURNALS[other]) for force, z in loads)
    rest = equilibrium(FILM, share[:2], speed=SPEED, viscosity=OIL)
    journals[end] = motion.journal_bearing(end).motion[:, :2].T / FILM.clearance
    carried.append(np.hypot(*journals[end][:, late].mean(axis=1)) / rest.eccentricity)
    say(f"{end}: {np.hypot(*share[:2]):.0f} N, eccentricity {rest.eccentricity:.3f} by statics, "
        f"of the motion {carried[-1]:.4f} of that")  # fmt: skip
ringing, peaks, sizes = {}, [], []
for n, column in enumerate((0, 1, 3)):  # of the first wave with n nodal diameters
    signal = motion.elastic("wheel")[motion.t > 0.002, column]
    window = np.hanning(signal.size)
    size = np.abs(np.fft.rfft((signal - signal.mean()) * window, 8 * signal.size))
    f = np.fft.rfftfreq(8 * signal.size, motion.t[1] - motion.t[0])
    near = (f > 700) & (f < 860)
    peaks.append(f[near][size[near].argmax()])
    sizes.append(size[near].max())
    ringing[f"{n} nodal diameters" if n != 1 else "1 nodal diameter"] = (
        f[near], n + 0.9 * size[near] / size[near].max()
    )  # fmt: skip
say("waves on films ring at", *(f"{f:.1f}" for f in peaks), "Hz,")
say("on a hub at rest at", *(f"{f:.1f}" for f in low[:3]), "Hz; their sizes are as 1,",
    *(f"{size / sizes[0]:.0e}" for size in sizes[1:]))  # fmt: skip

# ## The picture

options.out.mkdir(parents=True, exist_ok=True)
seen = {
    name: (body.surface.points + np.array([0, 0, z]), body.surface.triangles)
    for name, body, z in (("steel", shaft, 0.0), ("titanium", wheel, Z_WHEEL))
}
near = whole[(whole > 700) & (whole < 860)]
lines = np.tile([0.0, 6.0, np.nan], near.size), np.repeat(near, 3)
view.panels(
    [
        [
            view.Scene("The rotor", seen, view=(1.0, 0.6, 0.5), up=(0, 1, 0)),
            view.Panel(
                "The first family, at rest on springs", "nodal diameters", "frequency [Hz]",
                curves={"in the mechanism": lines}, points={"hub at rest": (diameters, held)},
            ),
        ],
        [
            view.Panel(
                "Journals in their films", "x / clearance", "y / clearance",
                {"_clearance": (np.cos(turn), np.sin(turn))} | journals, equal=True,
            ),
            view.Panel(
                "The first family on films, at 9000 / min", "frequency [Hz]",
                "size / largest, raised by nodal diameters",
                ringing | {"_hub": (np.repeat([*low[:3], np.nan], 2)[:2], [0, 3])},
            ),
        ],
    ],
    options.out / "bladed_rotor.png", title="A bladed wheel on a geared shaft",
    caption="Twelve titanium blades on a steel shaft with a gear; one sector meshed. Above: on "
    "springs; dots are waves of the wheel on a hub at rest, lines modes of the mechanism. Waves "
    "with two and more nodal diameters do not meet the shaft; the others part from its bending and "
    "twist. Below: on oil films, from the moment when the gas begins to blow with 120 N m. The "
    "journals go from the middle to where films carry the teeth; the blades ring, seen from axes "
    "that turn with them. Thin: the wave of zero nodal diameters on a hub at rest.",
)  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.

results = {
    "mass of the wheel, over that of its sectors": (wheel.mass / (12 * model.mass()), 1.0, 1e-9),
    "waves at speed, worst ratio to those of the sector": (1 + apart, 1.0, 1e-3),
    "waves of two and more nodal diameters on the shaft": (
        1 + apart_from[diameters > 1].max(), 1.0, 1e-9),
    "modes below 1 kHz: of the rotor, and twelve waves": (
        float((whole < 1e3).sum()), (rigid < 1e3).sum() + 12.0, 0.0),
    "first frequency, over that with a rigid wheel": (whole[0] / rigid[0], 1.0, 2e-3),
    "first journal, over where its film carries the load": (carried[0], 1.0, 5e-3),
    "second journal, over where its film carries the load": (carried[1], 1.0, 2e-2),
    "wave of two nodal diameters on films, over a hub at rest": (peaks[2] / low[2], 1.0, 1e-3),
}  # fmt: skip
for name, (value, expected, tolerance) in results.items():
    print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
