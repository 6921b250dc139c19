# # A flexible connecting rod in a slider-crank
#
# A crank turns at 300 rad/s and drives a slider through a steel connecting rod. The rod is meshed
# with gmsh, assembled with dolfinx, reduced to 20 fixed-interface modes and its two bores, and put
# into a mechanism. The same mechanism with a rigid rod runs beside it.
#
# Run: `python demos/demo_slider_crank.py`, or under `mpirun -n 2`
# Time: 1 min
# Writes: pictures, a film, the body file and `report.html` into `out/`; another folder with `--out`

import argparse
import logging
from pathlib import Path
from time import perf_counter

from mpi4py import MPI

import numpy as np

import rom
from rom import report, view

options = argparse.ArgumentParser(description="flexible slider-crank: pictures and a report")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no progress")
options = options.parse_args()
first = MPI.COMM_WORLD.rank == 0  # with several processes, one speaks and writes
aloud = first and not options.quiet
if aloud:
    logging.basicConfig(level=logging.INFO, format="%(message)s")
if first:
    options.out.mkdir(parents=True, exist_ok=True)
meshes = Path(__file__).parents[1] / "meshes"
timings = {}
clock = perf_counter()


def done(what):
    """Note how long the last part took."""
    global clock
    timings[what] = perf_counter() - clock
    clock = perf_counter()
    if aloud:
        print(f"{what}: {timings[what]:.1f} s", flush=True)


# ## Geometry, mesh, finite elements
#
# `pin_a` and `pin_b` are the bores of the rod, `shaft` and `pin` the journals of the crank: named
# physical surfaces of the geometries.

steel = rom.Material(E=210e9, nu=0.3, rho=7850.0)
rod_model = rom.fe.model(meshes / "connecting_rod.geo", material=steel)
crank_model = rom.fe.model(meshes / "crank.geo", material=steel, parameters={"lc": 5e-3})
done("mesh and assemble rod and crank")

# ## Reduction, with the evidence
#
# Pins connect the bores rigidly (rbe2). The frame of the rod sits on `pin_a` and points to `pin_b`,
# so that deformations are counted from the line between the pins.

pins = ("pin_a", "pin_b")
choices = {
    "interfaces": dict.fromkeys(pins, "rbe2"),
    "reference": pins,
    "damping": rom.ModalDamping(0.01, fixed=("pin_a:xyz rx", "pin_b:yz")),
    "name": "rod",
}
rod = rom.reduce(rod_model, method=rom.CraigBampton(n_modes=20), **choices)
comparison = rod.provenance["comparison"]
worst = max(
    reduced / full - 1
    for table in comparison.values()
    for full, reduced in zip(table["full"], table["reduced"], strict=True)
)
more_modes = rom.WithLoads(rom.CraigBampton(n_modes=40))  # and shapes into which inertia bends it
richer = rom.reduce(rod_model, method=more_modes, certify=False, **choices)
crank, rigid_rod = rom.mass_properties(crank_model), rom.mass_properties(rod_model)
done("reduce the rod and compare it with the full model")
if not first:
    raise SystemExit  # a reduced mechanism is work for one process

# ## The mechanism, with the flexible rod and with a rigid one
#
# The crank is rigid: mass, mass centre and inertia come from its mesh. The motor starts softly
# within one turn. Four joints of a planar mechanism repeat some constraints; rom says which.

speed, turns, slider_mass = 300.0, 6, 0.3
turn = 2 * np.pi / speed
shaft, pin = (crank_model.interfaces[name].origin for name in ("shaft", "pin"))
radius, length = pin[0], rod.marker("pin_b").point[0] - rod.marker("pin_a").point[0]


def angle(t):
    """Crank angle [rad]: from rest to full speed within one turn, without a jolt."""
    s = np.minimum(t, turn)
    start = s**2 / (2 * turn) + turn / (2 * np.pi) ** 2 * (np.cos(2 * np.pi * s / turn) - 1)
    return speed * (start + t - s)


def slider_crank(flexible=None):
    """The mechanism in the plane of the rod, z = height of the crank pin; rigid without a body."""
    mech = rom.Mechanism(gravity=(0.0, -9.81, 0.0))
    web = mech.add_rigid(
        "crank",
        mass=crank.mass,
        inertia=crank.inertia,
        at=crank.centre,
        markers={"shaft": shaft - crank.centre, "pin": pin - crank.centre},
    )
    at = pin - rod.marker("pin_a").point
    if flexible:
        bar = mech.add_flexible("rod", flexible, at=at)
    else:
        bar = mech.add_rigid(
            "rod",
            mass=rigid_rod.mass,
            inertia=rigid_rod.inertia,
            at=at + rigid_rod.centre,
            markers={name: rod.marker(name).point - rigid_rod.centre for name in pins},
        )
    end = at + rod.marker("pin_b").point
    slider = mech.add_rigid(
        "slider", mass=slider_mass, inertia=(1e-4,) * 3, at=end, markers={"pin": (0, 0, 0)}
    )
    z = (0, 0, 1)
    mech.revolute("main bearing", mech.ground.marker(shaft), web.marker("shaft"), axis=z)
    mech.revolute("crank pin", web.marker("pin"), bar.marker("pin_a"), axis=z)
    mech.revolute("wrist pin", bar.marker("pin_b"), slider.marker("pin"), axis=z)
    mech.prismatic("guide", mech.ground.marker(end), slider.marker("pin"), axis=(1, 0, 0))
    mech.drive("motor", "main bearing", angle)
    return mech


flexible, rigid = slider_crank(rod), slider_crank()
settings = {"t_end": turns * turn, "dt": turn / 1000, "rho_inf": 0.8, "progress": aloud}
moved = rom.simulate(flexible, **settings)
stiff = rom.simulate(rigid, **settings)
audit = rom.audit(moved)
done(f"move the mechanism {turns} turns, flexible and rigid")

# ## The evidence for the motion
#
# The certificate of the rod holds at rest. What the rod with twice the modes would do beside this
# motion follows from what the motion leaves in its equations; nothing is integrated again.

proof = rom.certify_motion(moved, {"rod": richer})
done("certify the motion")

# ## What the flexibility does

t = moved.t
slider, slider_rigid = (sol.position("slider", "pin")[:, 0] for sol in (moved, stiff))
stretch = np.linalg.norm(moved.position("rod", "pin_b") - moved.position("rod", "pin_a"), axis=1)
stretch -= length
force, force_rigid = (
    np.linalg.norm(sol.reaction("crank pin")[:, :3], axis=1) for sol in (moved, stiff)
)

# The rigid mechanism in closed form. The nodes of a bore lie on its cylinder, but no mesh is as
# regular as that: their centres lie a little beside the axes of the geometry.

throw, arm = pin - shaft, rod.marker("pin_b").point - rod.marker("pin_a").point
pin_x = throw[0] * np.cos(angle(t)) - throw[1] * np.sin(angle(t))
pin_y = throw[0] * np.sin(angle(t)) + throw[1] * np.cos(angle(t))
height = throw[1] + arm[1]
closed = shaft[0] + pin_x + np.sqrt(arm[0] ** 2 + arm[1] ** 2 - (height - pin_y) ** 2)

# ## The frame is a choice
#
# The same rod, its frame fixed to one bore or the other, on the line of the pins, or on the mean
# axes: no finite elements are solved again. Deformations are counted from other places and look
# different; the motion, integrated on mean axes, is the same.

frames = {"on pin_a": "pin_a", "on pin_b": "pin_b", "line of the pins": pins, "mean axes": "free"}
across, ends = {}, {}
for name, reference in frames.items():
    body = rod.with_reference(reference)
    sol = rom.simulate(slider_crank(body), t_end=3 * turn, dt=turn / 1000, rho_inf=0.8)
    across[name] = sol.elastic("rod") @ body.marker("pin_b").translation[1]
    ends[name] = sol.position("slider", "pin")[:, 0]
bending = np.abs(across["on pin_a"]).max()
straight = ends.pop("line of the pins")
apart = {name: end - straight for name, end in ends.items()}
furthest = max(np.abs(difference).max() for difference in apart.values())
done("move the mechanism with the rod in four frames")

# ## Pictures and report

out = options.out
look = {"view": (-0.35, 0.3, 1.0), "up": (0.0, 1.0, 0.0)}
scene = look | {
    "magnify": 50.0,
    "shapes": {
        "crank": (
            crank_model.points[crank_model.surface.nodes] - crank.centre,
            crank_model.surface.triangles,
        ),
        "slider": view.box((0.045, 0.04, 0.03)),
    },
}
rom.save(rod, out / "rod.rom.npz")
rom.export(rod, out / "rod.vtu")
view.mesh(rod_model, out / "rod_mesh.png", title="Connecting rod", **look)
view.mesh(crank_model, out / "crank_mesh.png", title="Crank", view=(0.4, 1.0, -0.6), up=(0, 0, 1))
view.mode_shapes(rod, out / "rod_modes.png", **look)
view.frequencies(
    comparison,
    out / "rod_frequencies.png",
    title="Reduced against full rod",
    beside=view.Scene("Connecting rod", view.meshed(rod_model), **look),
)
view.history(
    t,
    [
        (
            "slider position [mm]",
            {"flexible rod": 1e3 * slider, "rigid rod": 1e3 * slider_rigid},
        ),
        ("flexible - rigid [µm]", {"slider": 1e6 * (slider - slider_rigid)}),
        ("stretch [µm]", {"distance of the pins": 1e6 * stretch}),
        ("crank pin force [N]", {"flexible rod": force, "rigid rod": force_rigid}),
    ],
    out / "motion.png",
    title="Slider-crank with a flexible connecting rod",
    beside=[
        view.posed(flexible, moved, share * turn, title=f"After {share:g} turns", **scene)
        for share in (5.0, 5.25, 5.75)
    ],
    caption=f"Crank radius {1e3 * radius:.0f} mm, distance of the pins {1e3 * length:.0f} mm, "
    f"slider {slider_mass:g} kg. The motor brings the crank to {speed:g} rad/s within the "
    "first turn. From top to bottom: position of the slider, how far the flexible rod "
    "displaces it, change of the distance of the pins, force in the crank pin. Beside them: the "
    "mechanism, deformation of the rod drawn 50 times larger.",
)
view.history(
    sol.t,
    [
        ("pin_b across the rod [µm]", {name: 1e6 * u for name, u in across.items()}),
        ("slider, difference [nm]", {name: 1e9 * u for name, u in apart.items()}),
    ],
    out / "frames.png",
    title="One rod in four floating frames",
    caption="The first three turns. Above: where the far bore is in the axes of the rod, by the "
    "place of the frame: fixed to a bore, through both pins, on the mean axes. Below: "
    "position of the slider against that with the frame through the pins. The bending seen "
    f"depends on the frame, up to {1e6 * bending:.0f} µm; the motion differs by "
    f"{1e9 * furthest:.2g} nm, round-off.",
)
instants = (turns - 1 + np.array([0.0, 0.25, 0.5, 0.75])) * turn
view.instants(flexible, moved, out / "instants.png", times=instants, **scene)
last = rom.simulate(
    flexible, t_end=(turns + 1) * turn, dt=turn / 1000, rho_inf=0.8, state=moved.final
)
view.animate(
    flexible,
    last,
    out / "slider_crank.gif",
    frames=60,
    title="A slider-crank whose rod bends",
    **scene,
)
done("draw")
frequencies = [
    (support, k + 1, full, reduced, f"{reduced / full - 1:.1e}", mac)
    for support, rows in comparison.items()
    for k, (full, reduced, mac) in enumerate(
        zip(*(rows[key] for key in ("full", "reduced", "mac")), strict=True)
    )
]
report.write_report(
    {
        "Summary": [
            report.paragraph(
                f"A connecting rod of {rod_model.n_dofs} displacement degrees of freedom was "
                f"reduced to {rod.n_modes} elastic coordinates; its frequencies deviate by at "
                f"most {worst:.1e} from the full model in {len(comparison)} supports. In a "
                f"slider-crank at {speed:g} rad/s it stretches by up to "
                f"{1e6 * np.abs(stretch).max():.1f} µm and loads the crank pin with up to "
                f"{force.max():.0f} N ({force_rigid.max():.0f} N with a rigid rod)."
            ),
            report.motion(last, out / "slider_crank.gif", **scene),
        ],
        "Geometry and mesh": [
            report.picture(out / "rod_mesh.png", "The rod."),
            report.picture(out / "crank_mesh.png", "The crank, rigid in the mechanism."),
            report.table(
                ("body", "dofs", "mass [kg]", "centre x [m]", "inertia zz [kg m^2]"),
                [
                    (
                        "rod",
                        rod_model.n_dofs,
                        rigid_rod.mass,
                        rigid_rod.centre[0],
                        rigid_rod.inertia[2, 2],
                    ),
                    (
                        "crank",
                        crank_model.n_dofs,
                        crank.mass,
                        crank.centre[0],
                        crank.inertia[2, 2],
                    ),
                ],
                "Mass properties from the finite element meshes, inertia about the centre.",
            ),
        ],
        "Frequencies, full against reduced": [
            report.modes(rod, out / "rod_modes.png"),
            report.picture(out / "rod_frequencies.png", "Errors of the reduced frequencies."),
            report.table(
                ("support", "mode", "full [Hz]", "reduced [Hz]", "error", "MAC"),
                frequencies,
                "Natural frequencies with rigid bores, rigid motions left out.",
            ),
        ],
        "Certificate": [
            report.checks(rod.certificate, "Evidence that the body stands for the full model.")
        ],
        "Motion": [
            report.picture(out / "motion.png", "Flexible and rigid rod."),
            report.picture(out / "instants.png", "Four instants of the last turn."),
            report.checks(audit, "Is the computed motion believable?"),
            report.checks(proof, "How far it is from that of a rod with twice the modes."),
            report.picture(out / "frames.png", "Other reference conditions, the same motion."),
        ],
        "Timings": [
            report.table(
                ("part", "seconds"),
                [*timings.items()],
                f"Wall-clock times, {MPI.COMM_WORLD.size} process(es); the integrator made "
                f"{moved.statistics['steps_per_second']:.0f} steps a second.",
            )
        ],
    },
    out / "report.html",
    title="Slider-crank with a flexible connecting rod",
)
done("report")

# ## What to remember
#
# `tests/project/test_demos.py` checks the numbers below: value, expected value, relative tolerance.
# The mass of the crank is that of two discs with their hull, a journal and a pin.

inclination = np.arcsin((0.028 - 0.022) / 0.04)
web = (np.pi / 2 + inclination) * 0.028**2 + (np.pi / 2 - inclination) * 0.022**2
web += 0.04 * np.cos(inclination) * (0.028 + 0.022)
volume = 0.014 * web + np.pi * (0.018**2 * 0.05 + 0.015**2 * 0.026)
results = {
    "crank mass [kg]": (crank.mass, steel.rho * volume, 1e-4),
    "worst frequency ratio, reduced over full": (1 + worst, 1.0, 1e-3),
    "certificate and audit hold": (float(rod.certificate.ok and audit.ok), 1.0, 0.0),
    "errors of the motion by shapes left out hold": (float(proof.ok), 1.0, 0.0),
    "rigid rod against closed form [m]": (
        length + np.abs(slider_rigid - closed).max(), length, 1e-8),
    "slider in four frames, farthest apart [m]": (length + furthest, length, 1e-10),
    "largest force, flexible over rigid rod": (force.max() / force_rigid.max(), 1.0, 0.05),
}  # fmt: skip
for name, (value, expected, tolerance) in results.items():
    print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
print(f"look at {out / 'report.html'}")
