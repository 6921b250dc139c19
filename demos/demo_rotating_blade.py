# # Rotating blades: which modes does an engine meet while it runs up?
#
# Centrifugal force stiffens a blade, spin softening and Coriolis forces do the opposite. A beam has
# exact frequencies at every speed; with them known to be right, the same reduced body is made from
# a compressor blade and turned in a rotor, and its Campbell diagram shows the speeds to avoid.
#
# Run: `python demos/demo_rotating_blade.py`, or under `mpirun -n 2`
# Time: 1 min
# Writes: `rotating_beam.png` and `blade_campbell.png` into `out/`; another folder with `--out`

import argparse
from pathlib import Path

from mpi4py import MPI

import numpy as np
from scipy.sparse.linalg import eigsh, splu

import rom
from rom import view
from rom.cyclic import rotation_matrices

options = argparse.ArgumentParser(description="frequencies of rotating blades")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
first = MPI.COMM_WORLD.rank == 0
say = print if first and not options.quiet else lambda *_: None
MESHES = Path(__file__).parents[1] / "meshes"

# ## A beam with exact frequencies
#
# A slender bar, clamped on the axis of rotation. Across the plane of rotation it flaps, in the
# plane it lags. With eta the speed in units of sqrt(EI / rho A L^4), the exact frequencies of the
# Euler-Bernoulli beam follow from Wright, Smith, Thresher and Wang (J. Appl. Mech. 49, 1982, 197);
# those of lag are sqrt(flap^2 - eta^2).

E, rho, L, b, h = 70e9, 2700.0, 1.0, 0.024, 0.008
unit = np.sqrt(E * h**2 / (12 * rho * L**4))
FLAP = {
    0: (3.51601527, 22.0344916, 61.6972144), 1: (3.68164681, 22.1810112, 61.8417626),
    2: (4.13731957, 22.6149220, 62.2731841), 3: (4.79727853, 23.3202637, 62.9849675),
    5: (6.44954475, 25.4460804, 65.2050405), 8: (9.25683760, 29.9953819, 70.2929622),
    10: (11.2023278, 33.6403659, 74.6492946), 12: (13.1701505, 37.6031123, 79.6144785),
}  # fmt: skip


def reduced(model, interfaces, name):
    return rom.reduce(
        model, method=rom.CraigBampton(n_modes=16), interfaces=interfaces, name=name,
        reference=next(iter(interfaces)), stiffening=True, certify=False,
    )  # fmt: skip


beam_model = rom.fe.model(
    MESHES / "beam.geo", material=rom.Material(E=E, nu=0.0, rho=rho),
    parameters={"L": L, "b": b, "h": h, "hex": 1, "nx": 40, "ny": 1, "nz": 1},
)  # fmt: skip
beam = reduced(beam_model, {"root": "rbe2", "tip": "rbe2"}, "beam")


def beam_frequencies(eta, axis):
    """Three modes across the thin side h, in units; b is three times as wide."""
    found = 2 * np.pi * beam.rotating_frequencies(eta * unit, axis, fixed=("root",)) / unit
    exact = np.array(FLAP[eta]) if axis == FLAPPING else np.sqrt(np.square(FLAP[eta]) - eta**2)
    return np.array([found[np.argmin(abs(found - f))] for f in exact]), exact


FLAPPING, LAGGING = (0, 0, 1), (0, 1, 0)


def between(eta, axis):
    """The same at a speed of which no exact frequencies are known; their squares are near lines."""
    near = [
        np.interp(eta**2, np.square(list(FLAP)), np.square(f))
        for f in np.transpose(list(FLAP.values()))
    ]
    near = np.sqrt(np.array(near) - (0.0 if axis == FLAPPING else eta**2))
    found = 2 * np.pi * beam.rotating_frequencies(eta * unit, axis, fixed=("root",)) / unit
    return [found[np.argmin(abs(found - f))] for f in near]


table = {}
say(f"beam of {beam_model.n_dofs} dofs, {beam.n_modes} coordinates\n eta  flap 1..3 and lag 1")
for eta in FLAP:
    table[eta] = [beam_frequencies(eta, axis) for axis in (FLAPPING, LAGGING)]
    (flap, _), (lag, _) = table[eta]
    say(f"{eta:4d}", *(f"{f:10.5f}" for f in (*flap, lag[0])))
worst = {mode: max(abs(table[eta][0][0][mode] / FLAP[eta][mode] - 1) for eta in FLAP)
         for mode in range(3)}  # fmt: skip
worst_lag = max(abs(table[eta][1][0][0] / table[eta][1][1][0] - 1) for eta in FLAP)

# ## A compressor blade in its rotor
#
# Titanium, held at the flanks of its dovetail, the platform at a radius of 250 mm. The mechanism is
# a rotor that carries the blade and turns as a whole; `rom.campbell` finds its equilibrium at each
# speed and follows the modes by their shapes.

R, TOP = 0.250, 2 * np.pi * 250
FLANKS = {"flank_left": "rbe2", "flank_right": "rbe2"}
given = {"path": MESHES / "compressor_blade.geo",
         "material": rom.Material(E=114e9, nu=0.33, rho=4430.0),
         "parameters": {"lc": 0.008, "lc_flank": 0.004}}  # fmt: skip
blade_model = rom.fe.model(**given)
blade = reduced(blade_model, FLANKS, "blade")
mech = rom.Mechanism(gravity=(0, 0, 0))
seats = {name: np.add(blade.marker(name).point, (0, 0, R)) for name in FLANKS}
rotor = mech.add_rigid("rotor", mass=500.0, inertia=(50.0, 25.0, 25.0), at=(0, 0, 0),
                       markers={"axle": (0, 0, 0), **seats})  # fmt: skip
seated = mech.add_flexible("blade", blade, at=(0, 0, R))
mech.revolute("axle", mech.ground.marker((0, 0, 0)), rotor.marker("axle"), axis=(1, 0, 0))
for name in FLANKS:
    mech.fixed(name, rotor.marker(name), seated.marker(name))
diagram = rom.campbell(mech, np.linspace(0.02, 1.0, 9) * TOP, n=4, axis=(1, 0, 0))
say(f"blade of {blade_model.n_dofs} dofs\n 1/min  frequencies [Hz]")
for speed, row in zip(diagram.speeds, diagram.frequencies, strict=True):
    say(f"{30 * speed / np.pi:6.0f}", *(f"{f:9.2f}" for f in row))

# From the body alone, in a frame that turns steadily, come those of the undeformed shape under the
# stress of centrifugal force. The mechanism has the shape that the blade takes at speed, too: it is
# twisted, and centrifugal force untwists it.
alone = np.array([
    blade.rotating_frequencies(speed, (1, 0, 0), fixed=tuple(FLANKS), at=(0, 0, -R))[:4]
    for speed in (0.0, *diagram.speeds)
])  # fmt: skip
gain = 100 * (diagram.frequencies[-1] / diagram.frequencies[0] - 1)
apart = np.abs(diagram.frequencies / alone[1:] - 1).max()
southwell = np.polyfit(np.r_[0.0, diagram.speeds] ** 2, (2 * np.pi * alone[:, 0]) ** 2, 1)[0]
say(f"with the undeformed shape they differ by {apart:.1e}; f1^2 grows by {southwell:.2f} n^2")
# And both from all finite elements, whole on each process, with spin softening and without Coriolis
# forces: with the stress at full speed, and in large displacements at half of it.
fe = blade_model if MPI.COMM_WORLD.size == 1 else rom.fe.model(**given, comm=MPI.COMM_SELF)
held = np.concatenate([fe.interfaces[name].dofs for name in FLANKS])
loose = np.setdiff1d(np.arange(fe.n_dofs), held)
pull = fe.M @ (np.add(fe.points, (0, 0, R)) * (0, 1, 1)).ravel()
u = np.zeros(fe.n_dofs)
u[loose] = TOP**2 * splu(fe.K[loose][:, loose].tocsc()).solve(pull[loose])
softening = rotation_matrices(fe.M, np.array([1.0, 0.0, 0.0]))[1]
at_speed = fe.K + fe.stresses.prestress(u) - TOP**2 * softening
K_ii, M_ii = (A[loose][:, loose].tocsc() for A in (at_speed, fe.M))
f_full = np.sqrt(np.sort(eigsh(K_ii, 4, M_ii, sigma=0.0)[0])) / (2 * np.pi)
from_full = np.abs(alone[-1] / f_full - 1).max()
say("all finite elements at full speed, undeformed:", *(f"{f:.2f}" for f in f_full), "Hz")

half, solid = diagram.speeds[4], fe.stresses.finite_strain()
u *= (half / TOP) ** 2
for _ in range(8):  # Newton
    tangent = solid.tangent(u) - half**2 * softening
    K_ii, out_of_balance = tangent[loose][:, loose].tocsc(), solid.force(u)
    out_of_balance -= half**2 * (pull + softening @ u)
    u[loose] -= splu(K_ii).solve(out_of_balance[loose])
f_half = np.sqrt(np.sort(eigsh(K_ii, 4, M_ii, sigma=0.0)[0])) / (2 * np.pi)
from_half, undeformed = (np.abs(f / f_half - 1).max() for f in (diagram.frequencies[4], alone[5]))
say("in large displacements at half speed:", *(f"{f:.2f}" for f in f_half), "Hz,")
say(f"the mechanism differs by {from_half:.1e}, the undeformed shape by {undeformed:.1e}")
met = sorted((30 * speed / np.pi, k + 1, order) for order in (1, 2, 3, 4, 6, 8)
             for k, speed in diagram.crossings(order))  # fmt: skip
for speed, mode, order in met:
    say(f"mode {mode} meets {order} per revolution at {speed:.0f} 1/min")

if first:
    options.out.mkdir(parents=True, exist_ok=True)
    axes = {"bar": (beam.surface.points, beam.surface.triangles)}
    for name, axis, colour in (("axis: flap", (0, 0, 0.25), "#66a182"),
                               ("axis: lag", (0, 0.25, 0), "#edae49")):  # fmt: skip
        ends = np.array([-0.5, 0.5])[:, None] * axis
        axes[name] = view.Thing(*view.cylinder(*ends, 0.01), colour)
    etas = np.array(list(FLAP), dtype=float)
    fine = np.linspace(0.0, etas[-1], 49)
    flaps, lags = (np.array([between(eta, axis) for eta in fine]) for axis in (FLAPPING, LAGGING))
    exact = [np.array([table[eta][k][1] for eta in FLAP]) for k in (0, 1)]
    names = ("reduced solid", "exact beam")
    view.history(
        fine,
        [(f"flap {mode + 1} / unit", dict(zip(names, (flaps[:, mode], (etas, exact[0][:, mode])),
                                              strict=True))) for mode in range(3)]
        + [("lag 1 / unit", dict(zip(names, (lags[:, 0], (etas, exact[1][:, 0])), strict=True)))],
        options.out / "rotating_beam.png",
        over="speed of rotation / unit",
        beside=view.Scene("The bar and its axes of rotation", axes, view=(0.2, -0.8, 0.6),
                          up=(1, 0, 0)),
        title="A rotating cantilever: reduced solid and exact beam",
        caption=f"A clamped bar of {beam_model.n_dofs} dofs, reduced to {beam.n_modes} "
        "coordinates with the geometric stiffness of centrifugal force, turns about its root. "
        "The unit of frequencies and speeds is sqrt(EI / rho A L^4). Across the plane of "
        "rotation (flap) tension stiffens it; in the plane (lag) spin softening takes off the "
        f"square of the speed. Largest error {100 * max(*worst.values(), worst_lag):.2f} %: the "
        "solid knows shear, the beam does not.",
    )  # fmt: skip
    view.campbell(
        diagram, options.out / "blade_campbell.png", orders=(1, 2, 3, 4, 6, 8),
        beside=view.Scene("The blade; its flanks are held", view.meshed(blade_model),
                          view=(0.9, -1.0, 0.35), up=(0, 0, 1)),
        title="Campbell diagram of a compressor blade on its rotor",
        caption=f"Titanium blade of {blade_model.n_dofs} dofs, reduced to {blade.n_modes} "
        "coordinates, its platform at a radius of 250 mm. Frequencies are seen from the blade; "
        "rays are the multiples of the speed at which a disturbance at rest excites it, rings the "
        "speeds at which one meets a mode. Centrifugal force doubles the lowest frequency; the "
        f"others gain {gain.min():.0f} to {gain[1:].max():.0f} %.",
    )  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.

results = {
    "mass [kg]": (beam_model.mass(), rho * L * b * h, 1e-9),
    "flap 1, worst over eight speeds": (1 + worst[0], 1.0, 5e-3),
    "flap 2": (1 + worst[1], 1.0, 5e-3),
    "flap 3": (1 + worst[2], 1.0, 5e-3),
    "lag 1": (1 + worst_lag, 1.0, 5e-3),
    "blade alone at full speed, all finite elements": (1 + from_full, 1.0, 1e-3),
    "blade at half speed, large displacements": (1 + from_half, 1.0, 1e-3),
    "blade, likeness of shapes followed": (diagram.mac.min(), 1.0, 0.05),
}
if first:
    for name, (value, expected, tolerance) in results.items():
        print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
