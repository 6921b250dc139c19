# # Spin-up: a bar that rotation stiffens
#
# Kane, Ryan and Banerjee (J. Guidance, Control and Dynamics 10, 1987, 139) turned a flexible bar
# about its base, from rest to 6 rad/s within 15 s. Multibody programs of the day let it bend
# without limit: they knew that rotation softens a bar, not that the pull of centrifugal force
# stiffens it. Here the bar is a solid, reduced once with and once without its geometric stiffness.
# On mean axes, where rom integrates every body, most of the pull acts on their turning against the
# base, which is exact: without geometric stiffness the bar no longer runs away, but is wrong.
#
# Run: `python demos/demo_spin_up.py`, or under `mpirun -n 2`
# Time: 15 s
# Writes: `spin_up.png` into `out/`; another folder with `--out`

import argparse
import warnings
from pathlib import Path

from mpi4py import MPI

import numpy as np

import rom
from rom import view

options = argparse.ArgumentParser(description="a bar that rotation stiffens")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
first = MPI.COMM_WORLD.rank == 0
say = print if first and not options.quiet else lambda *_: None

# ## The bar
#
# Length 10 m, EA = 2.8e7 N, EI = 1.4e4 N m^2, 1.2 kg/m: a square section of 77 mm. Quadratic
# hexahedra without Poisson effect, as in beam theory. `stiffening=True` adds the stress of
# centrifugal force and of unit forces on the interfaces; it needs no mode that stretches the bar.

L, EA, EI, rhoA = 10.0, 2.8e7, 1.4e4, 1.2
side = np.sqrt(12 * EI / EA)
model = rom.fe.model(
    Path(__file__).parents[1] / "meshes" / "beam.geo",
    material=rom.Material(E=EA / side**2, nu=0.0, rho=rhoA / side**2),
    parameters={"L": L, "b": side, "h": side, "hex": 1, "nx": 40, "ny": 1, "nz": 1},
)
stiff = rom.reduce(
    model, method=rom.CraigBampton(n_modes=12), interfaces={"root": "rbe2", "tip": "rbe2"},
    reference="root", name="bar", stiffening=True,
)  # fmt: skip
f_rest = stiff.frequencies(1, fixed=("root",))[0]
say(f"{model.n_dofs} dofs, {len(stiff.K_geo)} unit loads, at rest {2 * np.pi * f_rest:.4f} rad/s")

# ## Frequencies of the rotating bar
#
# Seen in the rotating frame, vibrations across the plane of rotation become faster with the speed,
# those in the plane less so: there spin softening takes off the square of the speed. Without
# geometric stiffness only the softening is left.

soft = rom.reduce(
    model, method=rom.CraigBampton(n_modes=12), interfaces={"root": "rbe2", "tip": "rbe2"},
    reference="root", name="bar", certify=False,
)  # fmt: skip
unit = np.sqrt(EI / rhoA) / L**2
say("speed  in and across the plane  [rad/s]")
for eta in (0, 1, 3, 5):
    lag, flap = 2 * np.pi * stiff.rotating_frequencies(eta * unit, (0, 0, 1), fixed=("root",))[:2]
    say(f"{eta * unit:5.2f} {lag:9.4f} {flap:9.4f}")

# ## Spin-up
#
# The base is driven; deflection and axial displacement of the tip are seen in its frame.

END, SPEED, RATE = 15.0, 6.0, 2 * np.pi / 15.0


def angle(t):
    if t >= END:
        return SPEED * (t - END / 2)
    return SPEED / END * (t**2 / 2 + (np.cos(RATE * t) - 1) / RATE**2)


def spin_up(body, t_end):
    mech = rom.Mechanism(gravity=(0, 0, 0))
    bar = mech.add_flexible("bar", body)
    mech.revolute("base", mech.ground.marker((0, 0, 0)), bar.marker("root"), axis=(0, 0, 1))
    mech.drive(
        "motor", "base", angle,
        rate=lambda t: SPEED / END * (t - np.sin(RATE * t) / RATE) if t < END else SPEED,
        acceleration=lambda t: SPEED / END * (1 - np.cos(RATE * t)) if t < END else 0.0,
    )  # fmt: skip
    sol = rom.simulate(mech, t_end=t_end, dt=5e-3)
    x, y, _ = sol.position("bar", "tip").T
    psi = np.array([angle(t) for t in sol.t])
    return sol, np.cos(psi) * x + np.sin(psi) * y - L, np.cos(psi) * y - np.sin(psi) * x


sol, u, v = spin_up(stiff, 18.0)
say(rom.audit(sol))
with warnings.catch_warnings(record=True) as said:
    warnings.simplefilter("always")
    sol_soft, _, v_soft = spin_up(soft, 18.0)
for warning in said:
    say(f"without stiffening: {warning.message}")

# Extreme of a geometrically exact beam, and its deflection at some instants.
EXACT = {2.5: -0.15128, 5.0: -0.46845, 6.76: -0.57379, 7.5: -0.55905, 10.0: -0.36277,
         12.5: -0.11268, 15.0: 0.00129}  # fmt: skip

if first:
    options.out.mkdir(parents=True, exist_ok=True)
    omega = sol.omega("bar")[:, 2]
    at = {f"after {sol.t[v.argmin()]:.1f} s": (stiff, sol, v.argmin(), "#2f7f9f"),
          f"without, {sol.t[v_soft.argmin()]:.1f} s": (soft, sol_soft, v_soft.argmin(), "#d1495b"),
          "at rest": (stiff, sol, 0, "#c3c9d0")}  # fmt: skip
    seen = {"base": view.cylinder((0, 0, -0.3), (0, 0, 0.3), 0.5)}  # seen along the axis
    for name, (body, motion, k, colour) in at.items():
        bent = (body.surface.shape @ motion.elastic("bar")[k]).reshape(-1, 3)
        seen[name] = view.Thing(body.surface.points + bent, body.surface.triangles, colour)
    view.history(
        sol.t,
        [
            ("deflection of the tip [m]", {
                "with geometric stiffness": v, "without": v_soft,
                "geometrically exact beam": (list(EXACT), list(EXACT.values())),
            }),
            ("axial displacement of the tip [mm]", {"": 1e3 * u}),
            ("speed of the base [rad/s]", {
                "base": omega, "frequency of the bar at rest": 0 * omega + 2 * np.pi * f_rest,
            }),
        ],
        options.out / "spin_up.png",
        beside=view.Scene("The bar, turned with its base", seen,
                          view=(0, 0, 1), up=(1, 0, 0)),
        title="Spin-up of a flexible bar: 10 m, from rest to 6 rad/s",
        caption="Right: the bar in true size. The base accelerates and the tip lags behind; after "
        "15 s the bar turns steadily. "
        "Points: spectral solution of a geometrically exact beam. Without geometric stiffness the "
        "bar bends a fifth too far and comes back too late. Bending draws the tip towards the "
        "base; in the end centrifugal force stretches the bar by half a millimetre.",
    )  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.

results = {
    "mass [kg]": (model.mass(), rhoA * L, 1e-9),
    "frequency at rest [rad/s]": (2 * np.pi * f_rest, 3.51601527 * unit, 1e-3),
    "across the plane at 5 units of speed [rad/s]": (flap, 6.44954475 * unit, 1e-3),
    "in the plane [rad/s]": (lag, 4.073896 * unit, 1e-3),
    "extreme deflection [m]": (v.min(), -0.57379, 1.5e-3),
    "time of the extreme [s]": (sol.t[v.argmin()], 6.76, 2e-3),
    "largest axial displacement [m]": (u.min(), -0.01882, 3e-3),
    "stretch in the end [m]": (u[sol.t > END].mean(), 5.1395e-4, 5e-3),
    "extreme without stiffening, of that with it": (v_soft.min() / v.min(), 1.19, 5e-3),
}
if first:
    for name, (value, expected, tolerance) in results.items():
        print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
