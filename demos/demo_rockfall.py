# # A boulder falls on a gallery: which force arrives where?
#
# After Schellenberg, Kishi and Kon-No: a boulder, a plug and a slab as three masses; cushion, shear
# and bending as three springs. The slab of concrete is meshed and reduced as well, and its modes
# take the place of the last mass and spring. All parameters are chosen for illustration; no test is
# reproduced.
#
# Run: `python demos/demo_rockfall.py`, or under `mpirun -n 2`
# Writes: `rockfall.png` and `rockfall.gif` into `out/`; another folder with `--out`

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


DEPTH, RADIUS, MAGNIFY = 0.5, (3e3 / (4 * np.pi * 2650.0)) ** (1 / 3), 20.0  # of sand, rock [m]
LINES = ("#2f7f9f", "#d1495b", "#edae49")  # of the three forces
PARTS = {"rock": "#8b7d6b", "sand": "#e6d7a8", "plug": "#d1495b", "walls": "#9aa5b1"}


def gallery(impact, steps):
    """Boulder, sand, plug, slab and walls at some steps of the impact on the reduced slab."""
    motion = impact.modal[steps] @ body.modes(fixed=supports).shapes.T
    X = body.surface.points
    u = motion[:, None, :3] + np.cross(motion[:, None, 3:6], X)
    u += (motion[:, 6:] @ body.surface.shape.T).reshape(u.shape)
    top, down = X[:, 2].max(), impact.z[steps][:, :, None, None] * [0, 0, -1]
    ball, triangles = view.ellipsoid((RADIUS,) * 3, (0, 0, top + DEPTH + RADIUS))
    plug, faces = view.box((0.7, 0.7, 0.25), (0, 0, top + 0.125))
    walls = [view.box((0.15, 3.5, 1.2), (x, 0, -0.6)) for x in (-2.175, 2.175)]
    return {
        "boulder": view.Thing(ball + down[:, 0], triangles, PARTS["rock"]),
        "sand": view.Thing(*view.box((4.5, 3.5, DEPTH), (0, 0, top + DEPTH / 2)), PARTS["sand"],
                           opacity=0.35),
        "plug": view.Thing(plug + MAGNIFY * down[:, 1], faces, PARTS["plug"]),
        "slab": view.Thing(X + MAGNIFY * u, body.surface.triangles, values=-1e3 * u[..., 2]),
        "walls": view.Thing(*view.joined(walls), PARTS["walls"]),
    }  # fmt: skip


def chain():
    """Three masses on three springs, from top to bottom in the colours of their forces."""
    ball, plate = view.ellipsoid((0.45,) * 3, (0, 0, 4.55)), view.box((2.4, 1.6, 0.25), (0, 0, 1.2))
    springs = [view.coil((0, 0, low), (0, 0, high), 0.4, 0.06, turns=4)
               for low, high in ((3.0, 4.1), (1.32, 2.5), (0.0, 1.08))]  # fmt: skip
    names = ("spring of the cushion", "in shear", "in bending")
    masses = {
        "_boulder": (ball, "rock"),
        "_plug": (view.box((0.7, 0.7, 0.5), (0, 0, 2.75)), "sand"),
        "_slab": (plate, "walls"),
        "_ground": (view.box((2.8, 2.0, 0.1), (0, 0, -0.05)), "walls"),
    }
    return ({n: view.Thing(*mesh, PARTS[part]) for n, (mesh, part) in masses.items()}
            | {n: view.Thing(*mesh, colour)
               for n, mesh, colour in zip(names, springs, LINES, strict=True)})  # fmt: skip


def forces(name, title):
    i = impacts[name]
    names = ("in the cushion", "in shear", "in bending")
    curves = {n: (1e3 * i.t, F / 1e6) for n, F in zip(names, i.forces.T, strict=True)}
    return view.Panel(title, "time [ms]", "force [MN]", curves)


if first:
    options.out.mkdir(parents=True, exist_ok=True)
    bent = {name: (1e3 * i.t, 1e3 * i.z[:, 2]) for name, i in impacts.items()}
    bars = {name: tuple(100 * np.sort(change)) for name, change in ordered}
    meshed_impact = impacts["reduced slab"]
    deepest = [int(meshed_impact.z[:, 2].argmax())]
    look = {"label": "deflection of the slab [mm]", "view": (0.6, -1.0, 0.35), "up": (0, 0, 1)}
    view.panels(
        [
            [view.Scene(f"The gallery after {1e3 * meshed_impact.t[deepest[0]]:.0f} ms",
                        gallery(meshed_impact, deepest), **look),
             view.Scene("Its model: three masses, three springs", chain(), view=(0.6, -1.0, 0.2),
                        up=(0, 0, 1))],
            [forces("three masses", "Forces, three masses"),
             forces("reduced slab", "Forces, slab of finite elements")],
            [view.Panel("Deflection of the slab", "time [ms]", "deflection [mm]", bent),
             view.Panel("Each parameter halved and doubled", "change of the bending force [%]",
                        bars=bars)],
        ],
        options.out / "rockfall.png",
        title="A boulder falls on a rockfall gallery",
        caption="Top left: a tonne of rock fell 15 m onto a sand cushion over a concrete slab, "
        "4.5 m x 3.5 m x 0.25 m, held along two edges; deflections drawn "
        f"{MAGNIFY:g} times larger, "
        "parameters and the depth of the sand for illustration. Top right: the boulder presses the "
        "cushion, a plug of cushion and concrete is pushed into the slab, the slab bends. "
        "Middle: the force in each spring when the slab is one mass, and when it is a reduced "
        f"finite element model of {model.n_dofs} dofs. Bottom left: one mode alone is too stiff; "
        "where the slab yields, a deflection stays. Bottom right: how much the largest force in "
        "the slab changes. The fall and the cushion decide; plug and shear hardly matter. A "
        "prediction is as good as what is known of the cushion.",
    )  # fmt: skip
    steps = np.linspace(0, meshed_impact.t.size - 1, 40).round().astype(int)
    view.film(
        meshed_impact.t[steps],
        view.Scene("Boulder on a gallery", gallery(meshed_impact, steps), **look),
        options.out / "rockfall.gif",
        caption="A tonne of rock meets the sand over a slab of concrete at 17 m/s. The boulder "
        f"moves in true size, plug and slab {MAGNIFY:g} times as far as they do.",
    )

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
