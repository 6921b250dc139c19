# # A boulder falls on a gallery: which force arrives where?
#
# After Schellenberg, Kishi and Kon-No: a boulder, a plug and a slab as three masses; cushion, shear
# and bending as three springs. The slab of concrete is meshed and reduced as well, and its modes
# take the place of the last mass and spring. All parameters are chosen for illustration; no test is
# reproduced.
#
# Run: `python demos/demo_rockfall.py`, or under `mpirun -n 2`
# Writes: `rockfall.png` into `out/`; another folder with `--out`

import argparse
from dataclasses import replace
from pathlib import Path

from mpi4py import MPI

import numpy as np

import rom
from rom import view
from rom.components.rockfall import Cushion, Gallery, Shear, Slab, sensitivity, strike

options = argparse.ArgumentParser(description="forces in a rockfall gallery")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
first = MPI.COMM_WORLD.rank == 0
say = print if first and not options.quiet else lambda *_: None

# ## The slab
#
# 4.5 m x 3.5 m, 250 mm thick, held along two edges. The cushion presses on a square of 0.7 m; its
# mean motion is an interface, so that the static deflection under it is exact.

supports = ("support_left", "support_right")
kinds = {"impact": "rbe3"} | dict.fromkeys(supports, "rbe2")
model = rom.fe.model(
    Path(__file__).parents[1] / "meshes" / "gallery_slab.geo",
    material=rom.Material(E=30e9, nu=0.2, rho=2500.0),
)
body = rom.reduce(model, method=rom.CraigBampton(10), interfaces=kinds, certify=False)
full = rom.modes(model, 4, fixed=supports).frequencies
reduced = body.frequencies(4, fixed=supports)
say(f"{model.n_dofs} dofs, {body.n_modes} after reduction")
say("full", *(f"{f:.3f}" for f in full), "Hz, reduced", *(f"{f:.3f}" for f in reduced))

# ## The same blow on both
#
# The last of the three masses is the mode of the slab that yields most under the plug. One mode is
# too stiff: the deflection near the load is left out.

slab = Slab.of_body(body, "impact", supports)
k = int(np.argmax((slab.phi / slab.omega) ** 2))
m3 = slab.phi[k] ** -2.0
last = Slab.of_mass(m3, m3 * slab.omega[k] ** 2)
sand = Cushion.of_sand(1000.0, 5e6, recovery=0.3)
meshed = Gallery(boulder=1000.0, height=15.0, plug=500.0, cushion=sand, shear=Shear(2e9), slab=slab)
cases = {
    "three masses": replace(meshed, slab=last),
    "reduced slab": meshed,
    "three masses, yielding at 1.2 MN": replace(meshed, slab=replace(last, capacity=1.2e6)),
}
impacts = {name: strike(gallery, t_end=0.06) for name, gallery in cases.items()}
say(f"m_3 = {m3:.0f} kg of {body.mass:.0f} kg, k_3 = {last.stiffness / 1e6:.0f} MN/m; "
    f"slab {slab.stiffness / 1e6:.0f} MN/m")  # fmt: skip
for name, got in impacts.items():
    peaks = " ".join(f"{F / 1e3:7.0f}" for F in got.peaks)
    say(f"{name:34s} {peaks} kN in cushion, shear, bending; slab {1e3 * got.deflection:.2f} mm")

# ## What matters most
#
# Each parameter halved and doubled. The cushion is known worst, and decides.

changes = sensitivity(cases["three masses"], lambda g: strike(g).peaks[2], (0.5, 2.0))
ordered = sorted(changes.items(), key=lambda item: -np.ptp(item[1]))
for name, (low, high) in ordered:
    say(f"{name:26s} halved {100 * low:+6.1f} %, doubled {100 * high:+6.1f} %")

# ## The illustration of the tests
#
# The numbers of another program with another integrator, gravity off during the impact. A cushion
# twice as stiff raises the force nearly by 2^0.4, as for Hertz on rigid ground.

known = Gallery(4000.0, 15.0, 2500.0, Cushion.of_sand(4000.0, 1e6), Shear(2e9),
                Slab.of_mass(6000.0, 1.2e8), weight=False)  # fmt: skip
got, stiffer = strike(known), strike(replace(known, cushion=Cushion.of_sand(4000.0, 2e6)))
lost = max(np.abs(i.balance).max() / i.energy[0, 0] for i in impacts.values())

# ## The picture


def sketch():
    """Circle, blocks and springs, {name: (x, y)}, apart by NaN."""
    turn, gap = np.linspace(0, 2 * np.pi, 60), [np.nan]
    wide = np.array([-1, 1, 1, -1, -1]) / 2
    tall = np.array([-1, -1, 1, 1, -1]) / 2
    zigzag = np.array([0, 0, 1, -1, 1, -1, 1, 0, 0]) * 0.25
    steps = np.linspace(0, 1, 9)
    parts = {
        "boulder on cushion": (0.8 * np.cos(turn), 5.3 + 0.8 * np.sin(turn), 3.3, 4.5),
        "plug in shear": (1.6 * wide, 2.9 + 0.8 * tall, 1.5, 2.5),
        "slab in bending": (4.4 * wide, 1.3 + 0.4 * tall, 0.0, 1.1),
    }
    return {
        name: (np.concatenate([x, gap, zigzag]), np.concatenate([y, gap, a + (b - a) * steps]))
        for name, (x, y, a, b) in parts.items()
    }


def forces(name, title):
    i = impacts[name]
    names = ("in the cushion", "in shear", "in bending")
    curves = {n: (1e3 * i.t, F / 1e6) for n, F in zip(names, i.forces.T, strict=True)}
    return view.Panel(title, "time [ms]", "force [MN]", curves)


if first:
    options.out.mkdir(parents=True, exist_ok=True)
    bent = {name: (1e3 * i.t, 1e3 * i.z[:, 2]) for name, i in impacts.items()}
    bars = {name: tuple(100 * np.sort(change)) for name, change in ordered}
    view.panels(
        [
            [view.Panel("Three masses, three springs", "", "", sketch(), equal=True),
             forces("three masses", "Forces, three masses"),
             forces("reduced slab", "Forces, slab of finite elements")],
            [view.Panel("Deflection of the slab", "time [ms]", "deflection [mm]", bent),
             view.Panel("Each parameter halved and doubled", "change of the bending force [%]",
                        bars=bars)],
        ],
        options.out / "rockfall.png",
        title="A boulder falls on a rockfall gallery",
        caption="A tonne of rock falls 15 m onto a sand cushion over a concrete slab, 4.5 m x "
        "3.5 m x 0.25 m, held along two edges; parameters for illustration. The boulder presses "
        "the cushion (blue), a plug of cushion and concrete is pushed into the slab (red), the "
        "slab bends (yellow). Top: the force in each spring when the slab is one mass, and when it "
        f"is a reduced finite element model of {model.n_dofs} dofs. Bottom left: one mode alone is "
        "too stiff; where the slab yields, a deflection stays. Bottom right: how much the largest "
        "force in the slab changes. The fall and the cushion decide; plug and shear hardly matter. "
        "A prediction is as good as what is known of the cushion.",
    )  # fmt: skip

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.

results = {
    "mass [kg]": (body.mass, 2500.0 * 4.5 * 3.5 * 0.25, 1e-9),
    "first frequency, reduced [Hz]": (reduced[0], full[0], 1e-3),
    "illustration, cushion [kN]": (got.peaks[0] / 1e3, 1923.0, 4e-4),
    "illustration, shear [kN]": (got.peaks[1] / 1e3, 1941.0, 4e-4),
    "illustration, bending [kN]": (got.peaks[2] / 1e3, 2046.0, 4e-4),
    "energy from nowhere, 1 + share": (1 + lost, 1.0, 1e-4),
    "cushion twice as stiff, ratio of forces": (stiffer.peaks[0] / got.peaks[0], 2**0.4, 0.035),
}  # fmt: skip
if first:
    for name, (value, expected, tolerance) in results.items():
        print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
