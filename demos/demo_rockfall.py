# # A boulder falls on a gallery: which force arrives where?
#
# After Schellenberg, Kishi and Kon-No: a boulder, a plug and a slab as three masses; cushion, shear
# and bending as three springs. The slab of concrete is meshed by gmsh and reduced, and its modes
# take the place of the last mass and spring; the sand is a layer that spreads the load. One
# published test is calculated for a boulder inferred from its forces, and after adjustment; other
# parameters are for illustration.
#
# Run: `python demos/demo_rockfall.py`, or under `mpirun -n 2`
# Time: 1.5 min
# Writes: `rockfall.png`, `rockfall_capacity.png` and `rockfall.gif` into `out/`; another folder
# with `--out`

import argparse
from dataclasses import replace
from pathlib import Path

from mpi4py import MPI

import numpy as np

import rom
from rom import view
from rom.components.rockfall import (
    Cushion,
    Gallery,
    History,
    Layer,
    Shear,
    Slab,
    arriving,
    bearing_pressure,
    calibrate,
    capacity_heights,
    capacity_map,
    design_check,
    sensitivity,
    strike,
    wave_delay,
)

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

# ## The sand
#
# Sand under a boulder bears what it bears under a foundation, and spreads the load by 2:1. The
# depth that takes up the fall gives contact, spread, mass of the plug, and concrete in shear.

BOULDER, HEIGHT, DEPTH, CONCRETE, YIELDS = 4000.0, 15.0, 0.9, 0.25, 1.5e6  # kg, m, m, m, N
sand = Layer.of_sand(BOULDER, 10e6, DEPTH)
sand = replace(sand, strength=bearing_pressure(np.radians(42), sand.radius))
deep = sand.penetration(BOULDER * 9.81 * HEIGHT)
plug = sand.plug(deep, CONCRETE)
shear = sand.shear(deep, CONCRETE, modulus=12.5e9, strength=1.5e6, reinforced=2e8, ultimate=0.05)
say(
    f"taken up at {deep:.3f} m: contact {sand.contact(deep):.2f} m, on the slab "
    f"{sand.spread(deep):.2f} m; plug {plug:.0f} kg, cracks at {shear.capacity / 1e3:.0f} kN"
)

# ## The same blow on both
#
# The last of the three masses is the mode of the slab that yields most under the plug. One mode is
# too stiff: the deflection near the load is left out.

slab = Slab.of_body(body, "impact", supports, capacity=YIELDS)
k = int(np.argmax((slab.phi / slab.omega) ** 2))
m3 = slab.phi[k] ** -2.0
last = Slab.of_mass(m3, m3 * slab.omega[k] ** 2)
meshed = Gallery(BOULDER, HEIGHT, plug, sand, shear, slab)
cases = {
    "three masses": replace(meshed, slab=last),
    "reduced slab": replace(meshed, slab=replace(slab, capacity=np.inf)),
    "reduced slab, yielding": meshed,
}
impacts = {name: strike(gallery, keep=2000) for name, gallery in cases.items()}
say(f"m_3 = {m3:.0f} kg of {body.mass:.0f} kg, k_3 = {last.stiffness / 1e6:.0f} MN/m; "
    f"slab {slab.stiffness / 1e6:.0f} MN/m")  # fmt: skip
for name, got in impacts.items():
    assert got.rebound < 0.05
    peaks = " ".join(f"{F / 1e3:7.0f}" for F in got.peaks)
    say(f"{name:34s} {peaks} kN in cushion, shear, bending; slab {1e3 * got.deflection:.2f} mm")

# ## What matters most
#
# Each parameter by a factor of 0.8 and 1.25. The cushion is known worst, and decides with the fall.

changes = sensitivity(cases["three masses"], lambda g: strike(g).peaks[2], (0.8, 1.25))
ordered = sorted(changes.items(), key=lambda item: -np.ptp(item[1]))
for name, (low, high) in ordered:
    say(f"{name:26s} times 0.8 {100 * low:+6.1f} %, times 1.25 {100 * high:+6.1f} %")

# ## What the gallery bears
#
# A share above one fails. From which height a boulder may fall, whatever it weighs.

verdict = design_check(meshed, ductility=2.0)
say(f"cushion {verdict.cushion:.2f}, shear {verdict.shear:.2f}, bending {verdict.bending:.2f}")
stones, falls = np.linspace(500.0, 8000.0, 16), np.linspace(1.0, 30.0, 20)
verdicts = capacity_map(meshed, stones, falls, ductility=2.0)
shares = np.array([[min(v.share, 2.0) for v in row] for row in verdicts])
borne = {
    "all limits": capacity_heights(meshed, stones, ductility=2.0),
    "cushion alone": capacity_heights(
        replace(meshed, shear=replace(shear, capacity=np.inf),
                slab=replace(slab, capacity=np.inf)), stones[::5]),
}  # fmt: skip
for name, heights in borne.items():
    say(f"{name}: heights [m]", *(f"{h:.1f}" for h in heights))

# ## Waves in the sand
#
# The cushion of the model has no mass, so that the force of the boulder arrives as it is. In sand
# it runs down as a wave and is thrown back: a pulse that is short against the way of the wave
# arrives doubled, a long one as it is. Measured are 1.1 to 2 times. Sand cannot pull, so that
# what follows the first pull of the column is left out.

blow = impacts["reduced slab, yielding"]
layers = {f"{E / 1e6:g} MPa": wave_delay(replace(sand, modulus=E)) for E in (100e6, 25e6, 2.5e6)}
below = {name: arriving(blow.t, blow.forces[:, 0], delay) for name, delay in layers.items()}
for name, F in below.items():
    say(f"sand of {name:8s} delay {1e3 * layers[name]:5.1f} ms, {F.max() / blow.peaks[0]:.2f} of "
        "the force on top")  # fmt: skip
lengths = np.linspace(0.02, 0.4, 191)  # of a wave's delay in the duration of a half sine
s = np.linspace(0.0, 3.0, 6001)
half_sine = np.where(s < 1.0, np.sin(np.pi * s), 0.0)
doubled = np.array([arriving(s, half_sine, x).max() for x in lengths])

# ## A published test
#
# Weights on a rock shed of full size with gravel: about 7500 kN, a half sine of about 50 ms. That
# they had 10 t and 20 m is inferred. Blind: very dense gravel has 45 degrees. Then the strength
# is fitted to the pulse; a fifth of a second of computing.

RIGID = {"shear": Shear(1e11, damping=0.0), "slab": Slab.of_mass(1e3, 1e11, damping=0.0)}
gravel = Layer(30e6, 0.972, 0.9, strength=bearing_pressure(np.radians(45), 0.972))
shed = Gallery(1e4, 20.0, 1e3, gravel, **RIGID)
ms = np.linspace(0, 0.05, 101)
pulse = History(ms, 7.5e6 * np.sin(np.pi * ms / 0.05))
fitted = calibrate(shed, {"force in the cushion": pulse}, ["strength of the cushion"])
rule = replace(shed, cushion=Cushion.of_sand(1e4, 1e6))
tests = {"45 degrees": strike(shed), "adjusted": strike(fitted.gallery),
         "handbook, 1 MPa": strike(rule)}  # fmt: skip
factor, spread = (d["strength of the cushion"] for d in (fitted.factors, fitted.deviations))
for name, i in tests.items():
    say(f"{name:18s} {i.peaks[0] / 1e3:5.0f} kN, {1e3 * i.t[i.forces[:, 0].argmax()]:.0f} ms")
say(f"strength {factor:.2f} times, give or take {100 * spread:.0f} %")

# ## The illustration of the tests
#
# The numbers of another program with another integrator, gravity off during the impact. A cushion
# twice as stiff raises the force nearly by 2^0.4, as for Hertz on rigid ground.

known = Gallery(4000.0, 15.0, 2500.0, Cushion.of_sand(4000.0, 1e6), Shear(2e9),
                Slab.of_mass(6000.0, 1.2e8), weight=False)  # fmt: skip
got, stiffer = strike(known), strike(replace(known, cushion=Cushion.of_sand(4000.0, 2e6)))
lost = max(np.abs(i.balance).max() / i.energy[0, 0] for i in impacts.values())

# ## The picture


MAGNIFY = 20.0  # of the motion of plug and slab
LINES = ("#2f7f9f", "#d1495b", "#edae49")  # of the three forces
PARTS = {"rock": "#8b7d6b", "sand": "#e6d7a8", "plug": "#d1495b", "walls": "#9aa5b1"}


def gallery(impact, steps):
    """Boulder, sand, plug, slab and walls at some steps of the impact on the reduced slab."""
    motion = impact.modal[steps] @ body.modes(fixed=supports).shapes.T
    X = body.surface.points
    u = motion[:, None, :3] + np.cross(motion[:, None, 3:6], X)
    u += (motion[:, 6:] @ body.surface.shape.T).reshape(u.shape)
    top, down = X[:, 2].max(), impact.z[steps][:, :, None, None] * [0, 0, -1]
    ball, triangles = view.ellipsoid((sand.radius,) * 3, (0, 0, top + DEPTH + sand.radius))
    block, faces = view.box((0.7, 0.7, 0.25), (0, 0, top + 0.125))
    walls = [view.box((0.15, 3.5, 1.2), (x, 0, -0.6)) for x in (-2.175, 2.175)]
    return {
        "boulder": view.Thing(ball + down[:, 0], triangles, PARTS["rock"]),
        "sand": view.Thing(*view.box((4.5, 3.5, DEPTH), (0, 0, top + DEPTH / 2)), PARTS["sand"],
                           opacity=0.35),
        "plug": view.Thing(block + MAGNIFY * down[:, 1], faces, PARTS["plug"]),
        "slab": view.Thing(X + MAGNIFY * u, body.surface.triangles, values=-1e3 * u[..., 2]),
        "walls": view.Thing(*view.joined(walls), PARTS["walls"]),
    }  # fmt: skip


def chain():
    """Three masses on three springs, from top to bottom in the colours of their forces."""
    ball, plate = view.ellipsoid((0.45,) * 3, (0, 0, 2.95)), view.box((4.5, 1.6, 0.2), (0, 0, 0.7))
    springs = [view.coil((0, 0, low), (0, 0, high), 0.4, 0.06, turns=4)
               for low, high in ((1.8, 2.5), (0.8, 1.4), (0.0, 0.6))]  # fmt: skip
    names = ("spring of the cushion", "in shear", "in bending")
    masses = {
        "_boulder": (ball, "rock"),
        "_plug": (view.box((0.7, 0.7, 0.4), (0, 0, 1.6)), "sand"),
        "_slab": (plate, "walls"),
        "_ground": (view.box((4.8, 1.9, 0.1), (0, 0, -0.05)), "walls"),
    }
    return ({n: view.Thing(*mesh, PARTS[part]) for n, (mesh, part) in masses.items()}
            | {n: view.Thing(*mesh, colour)
               for n, mesh, colour in zip(names, springs, LINES, strict=True)})  # fmt: skip


def forces(name, title):
    i = impacts[name]
    names, early = ("in the cushion", "in shear", "in bending"), i.t < blow.t[-1]
    curves = {n: (1e3 * i.t[early], F[early] / 1e6)
              for n, F in zip(names, i.forces.T, strict=True)}  # fmt: skip
    return view.Panel(title, "time [ms]", "force [MN]", curves)


def pressed(F):
    """A force until it pulls."""
    return np.where(np.cumsum(F < -1e-9 * F.max()) == 0, F, np.nan)


def published():
    """Measured pulse and three predictions."""
    curves = {"measured, as described": (1e3 * ms, pulse.values / 1e6)}
    for name, i in tests.items():
        early = i.t < 0.12
        curves[name] = 1e3 * i.t[early], i.forces[early, 0] / 1e6
    return view.Panel("Gravel on a rock shed of full size", "time [ms]",
                      "force on the shed [MN]", curves)  # fmt: skip


if first:
    options.out.mkdir(parents=True, exist_ok=True)
    bent = {name: (1e3 * i.t[i.t < blow.t[-1]], 1e3 * i.z[i.t < blow.t[-1], 2])
            for name, i in impacts.items()}  # fmt: skip
    elastic = impacts["three masses"]
    again = elastic.forces[elastic.t > blow.t[-1], 2].max() / 1e6
    bars = {name: tuple(100 * np.array(change)) for name, change in ordered}
    meshed_impact = impacts["reduced slab, yielding"]
    deepest = [int(meshed_impact.z[:, 2].argmax())]
    look = {"label": "deflection of the slab [mm]", "view": (0.6, -1.0, 0.35), "up": (0, 0, 1)}
    view.panels(
        [
            [view.Scene(f"The gallery after {1e3 * meshed_impact.t[deepest[0]]:.0f} ms",
                        gallery(meshed_impact, deepest), **look),
             view.Scene("Its model: three masses, three springs", chain(), view=(0.6, -1.0, 0.2),
                        up=(0, 0, 1))],
            [forces("three masses", "Forces, three masses"),
             forces("reduced slab, yielding", "Forces, slab of finite elements that yields")],
            [view.Panel("Deflection of the slab", "time [ms]", "deflection [mm]", bent),
             view.Panel("Each parameter by itself", "change of the bending force [%]", bars=bars,
                        ends=("times 0.8", "times 1.25"))],
            [published(),
             view.Panel("Force that arrives below the sand", "time [ms]", "force on the floor [MN]",
                        {"on top": (1e3 * blow.t, blow.forces[:, 0] / 1e6)}
                        | {f"below, {n}": (1e3 * blow.t, pressed(F) / 1e6)
                           for n, F in below.items()})],
        ],
        options.out / "rockfall.png",
        title="A boulder falls on a rockfall gallery",
        caption="Top left: four tonnes of rock fell 15 m onto 0.9 m of sand over a concrete slab, "
        "4.5 m x 3.5 m x 0.25 m, held along two edges; deflections drawn "
        f"{MAGNIFY:g} times larger, parameters for illustration. Top right: the boulder presses "
        "the cushion, a plug of cushion and concrete is pushed into the slab, the slab bends. "
        "Middle: the force in each spring when the slab is one mass, and when it is a reduced "
        f"finite element model of {model.n_dofs} dofs, which yields. A slab that does not yield "
        f"throws the boulder up; where it falls again, the sand is dense, and {again:.1f} MN bend "
        "the one mass. Then: one mode alone is too "
        "stiff; where the slab yields, a deflection stays; and how much the largest force in "
        "the slab changes: the fall and the cushion decide. Bottom left: a published test, "
        "predicted from the friction of gravel alone, after adjustment, and by the handbook; mass "
        "and height of it are inferred. Bottom right: the force of the boulder after it ran "
        "through sand of three stiffnesses as a wave, on a floor that does not give way.",
    )  # fmt: skip
    edge = np.array([stones[1] - stones[0], falls[1] - falls[0]]) / 2
    (left, low), (right, high) = (np.array([stones[k], falls[k]]) + x * edge
                                  for k, x in ((0, -1), (-1, 1)))  # fmt: skip
    view.plane(
        [view.Drawing(
            "Load over what the gallery bears", "boulder [t]",
            "height of the fall [m]", (left / 1e3, right / 1e3, low, high), shares,
            "load / what is borne, up to 2; it fails above 1", equal=False,
            levels={1.0: [np.column_stack([stones / 1e3, borne["all limits"]])]}),
         view.Drawing(
            "A half sine below a column of sand", "way of the wave / duration of the pulse",
            "largest force below / on top", (0.0, 0.4, 0.9, 2.1),
            curves={"column": [np.column_stack([lengths, doubled])],
                    "published: 1.1 and 2": [np.array([[0.0, y], [0.4, y]]) for y in (1.1, 2.0)]},
            equal=False)],
        options.out / "rockfall_capacity.png", title="What a gallery bears, and what arrives",
        caption="Left: boulders that fall onto the gallery of the other picture; the largest of "
        "its shares in the cushion, in shear and in bending, where twice the deflection at "
        "yielding is allowed. Right: how much a force grows on its "
        "way through sand that does not spread it, onto a floor that does not give way.",
    )  # fmt: skip
    steps = np.linspace(0, meshed_impact.t.size - 1, 40).round().astype(int)
    view.film(
        meshed_impact.t[steps],
        view.Scene("Boulder on a gallery", gallery(meshed_impact, steps), **look),
        options.out / "rockfall.gif",
        caption="Four tonnes of rock meet the sand over a slab of concrete at 17 m/s. The boulder "
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
    "gravel, 45 degrees over measured force": (tests["45 degrees"].peaks[0] / 7.5e6, 0.89, 0.02),
    "gravel, adjusted over measured force": (tests["adjusted"].peaks[0] / 7.5e6, 1.06, 0.02),
    "energy from nowhere, 1 + share": (1 + lost, 1.0, 1e-4),
    "below sand of 2.5 MPa over on top": (below["2.5 MPa"].max() / blow.peaks[0], 2.0, 0.01),
    "half sine of ten delays, below over on top": (
        doubled[np.abs(lengths - 0.1).argmin()], 2 * np.sin(np.pi / 5), 1e-4),
    "cushion twice as stiff, ratio of forces": (stiffer.peaks[0] / got.peaks[0], 2**0.4, 0.035),
}  # fmt: skip
if first:
    for name, (value, expected, tolerance) in results.items():
        print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
