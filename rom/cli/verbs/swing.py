"""Mesh a part, reduce it, hang it on one of its faces and show how it swings, in one go.

The part is released at rest, as it is drawn, with gravity across it. On a bore, and whatever else
the geometry knows as a cylinder, it turns about the axis of that; on another face about the
horizontal axis across. Without a face to hang on, those of the part are listed and drawn. Of its
certificate the rows without support do not count here, for the hinge holds it. For everything else
there are the single verbs: mesh, reduce, check, simulate, view, report.
"""

import argparse
import logging
import shlex
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from math import pi, sqrt
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

import rom
from rom.cli.answer import Answer, Data, failures, report_data
from rom.cli.described import component, described
from rom.cli.options import (
    ACCELERATION,
    DURATION,
    add_geometry,
    add_solid,
    count,
    face,
    material,
    option,
    positive,
    reading,
    unique,
)
from rom.cli.output import add_force, checked, claim, typed_command, usual
from rom.fe.mesh.picks import is_pick
from rom.model import Array
from rom.names import inside
from rom.process.child import end, python, start
from rom.process.launcher import ranks
from rom.view.canvas.scales import round_length

if TYPE_CHECKING:
    from rom.reduction.full_model import MassProperties

log = logging.getLogger("rom")
SUMMARY = "show a part of yours, reduced and swinging, in one go"
EXAMPLES = """\
  rom swing part.step             # its faces, listed and drawn
  rom swing part.step --hinge 3
  rom swing part.step --hinge radius:0.006 --E 200GPa -o out
  rom swing part.step --hinge 0,0,0.01 --material aluminium --gravity 0,0,-9.81 --film -o out
"""
OWN_OPTIONS = "hinge gravity t_end magnify film mp4".split()  # that say nothing of the part
USUAL = "steel"
TABLE_FILE = "motion.csv"
N_STEPS, N_INSTANTS = 240, 4  # of the motion; shown in the picture
FAR_SWING = 1.18034  # period of a swing from the horizontal over that of a small one
LEAST_LEVER = 3e-3  # of gravity about the hinge, of the radius of gyration
DRAWN_DEFORMATION_RATIO = 0.05  # largest deformation as drawn, of the body's size


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    add_geometry(parser)
    about = (
        "face it hangs on: a name, or in a .step file what --face takes, e.g. 12 or radius:0.006"
    )
    option(parser, "--hinge FACE", about, str)
    add_solid(parser, usual=USUAL)
    option(parser, "-m --modes", "modes kept (default: as many as are needed)", count)
    about = "[m/s^2], default 9.81 along the axis most across the part and across its bore"
    option(parser, "--gravity", about, ACCELERATION)
    option(parser, "--t-end", "duration [s], default one swing", DURATION)
    option(parser, "--magnify", "of deformations, default so that they are seen", positive)
    option(parser, "--film", "a film, too; half a second a picture")
    option(parser, "--mp4", "a film as .mp4, by ffmpeg")
    option(parser, "-o --output", "folder, made if missing (default PART_swing)", Path)
    add_force(parser)


def run(args: argparse.Namespace) -> Answer:
    """Mesh, reduce, simulate; files are written at the end."""
    args.output = usual(args, "_swing")
    if args.hinge is None:
        return _faces(args)
    files = _files(args)
    hinge, faces = hinge_of(args.hinge)
    part = component(args, *OWN_OPTIONS) if described(args) else None
    full = part.model() if part else _model(args, faces)
    from rom.reduction.interfaces.connection import found

    (at,), rigid = found(full, [hinge]), rom.mass_properties(full)
    log.info("%s: %d dofs, %.4g kg", args.file, full.n_dofs, rigid.mass)
    swing = planned(rigid, at.origin, args.gravity, args.t_end, axis=at.axis)
    with _compiling():
        body = part.body(full) if part else _reduced(args, full, hinge)
        log.info("%s hangs on %s and swings for %.3g s", body.name, args.hinge, swing.t_end)
        hung = pendulum(body, hinge, axis=swing.axis, gravity=swing.gravity)
        dt = swing.t_end / N_STEPS
        solution = rom.simulate(hung, t_end=swing.t_end, dt=dt, rho_inf=0.5)
    magnify = args.magnify or magnification(body, solution.elastic(body.name))
    data = {
        "files": [str(path) for path in files.values()],
        "mass": body.mass,
        "gravity": list(swing.gravity),
        "axis": list(swing.axis),
        "t_end": swing.t_end,
        "magnify": magnify,
        "frequencies": body.frequencies(6, fixed=(hinge,)).tolist(),
        "certificate": report_data(body.certificate),
    }
    failed = tuple(text for text in failures(body.certificate) if not text.startswith("free:"))
    write = partial(_write, files, body, solution, magnify, typed_command(args))
    return Answer(data, _text(body, hinge, data), write, failed)


@contextmanager
def _compiling() -> Iterator[None]:
    """Meanwhile another process compiles what a first motion needs, where nobody has yet."""
    from rom.doctor.first_use import MODULE_NAME
    from rom.mbs.compiler.cache import CODE_FILES
    from rom.mbs.integrate.generalized_alpha import advance

    code = CODE_FILES.get(advance.kernel.py_func)
    if code is None or code.full() or ranks()[1] > 1:
        yield
        return
    process = start(python(MODULE_NAME, "slider-crank"))
    try:
        yield
    finally:
        end(process)


def _faces(args: argparse.Namespace) -> Answer:
    """What the part may hang on, with the command that does it."""
    from rom.cli.verbs import mesh

    drawn, is_step = claim(args) / "faces.png", args.file.suffix.lower() in (".step", ".stp")
    asked = vars(args) | {"faces": is_step, "save": drawn, "E": None, "nu": None, "rho": None}
    found = mesh.run(argparse.Namespace(**asked))
    bores = [face["number"] for face in found.data.get("faces", ()) if face["kind"] == "cylinder"]
    hinge = str((*bores, 1)[0]) if is_step else next(iter(found.data["interfaces"]), "FACE")
    command = f"{typed_command(args)} --hinge {shlex.quote(hinge)}"
    text = f"{found.text}\n\n{drawn} shows them. Choose one for --hinge, for example\n  {command}"
    data = {"files": [str(drawn)], "faces": found.data.get("faces", []), "next": [command]}
    return replace(found, data=data, text=text)


def _files(args: argparse.Namespace) -> dict[str, Path]:
    """What will be written, by its ending; refused before the computation."""
    from rom.report.run import RECORD_FILE, SCENE_FILE

    folder = claim(args)
    films = [kind for kind, asked in ((".gif", args.film), (".mp4", args.mp4)) if asked]
    kinds = (".rom.npz", ".png", *films, ".html")
    paths = {kind: inside(folder, args.file.stem, kind) for kind in kinds}
    paths |= {name: folder / name for name in (TABLE_FILE, SCENE_FILE, RECORD_FILE)}
    return {kind: checked(args, path) for kind, path in paths.items()}


def hinge_of(text: str) -> tuple[str, dict[str, str]]:
    """Name of the interface, and the face to pick for it if it has none."""
    return ("hinge", {"hinge": face(text, "--hinge")}) if is_pick(text) else (text, {})


def _model(args: argparse.Namespace, faces: dict[str, str]) -> "rom.FEModel":
    how = reading(args)  # refused before dolfinx is loaded
    how["faces"] = unique([*how["faces"].items(), *faces.items()], "--face")
    from rom.fe.elasticity import model

    return model(args.file, material=material(args, USUAL), **how)


def _reduced(args: argparse.Namespace, full: "rom.FEModel", hinge: str) -> "rom.FlexibleBody":
    return rom.reduce(
        full,
        method=rom.CraigBampton(args.modes),
        interfaces={hinge: "rbe2"},
        reference=hinge,
        damping=rom.ModalDamping(0.01, fixed=(hinge,)),
        name=args.file.stem,
    )


@dataclass(frozen=True, slots=True)
class Swing:
    """Gravity (3,) [m/s^2], axis (3,) of the hinge, duration [s]."""

    gravity: tuple[float, ...]
    axis: tuple[float, ...]
    t_end: float


def planned(
    rigid: "MassProperties",
    point: Array,
    gravity: npt.ArrayLike | None = None,
    t_end: float | None = None,
    *,
    axis: Array | None = None,
) -> Swing:
    """The swing of a body from rest, for one period of the rigid pendulum if nobody says how long.

    About the hinge at a point (3,) [m] and its unit axis (3,), or the one across gravity (3,)
    [m/s^2]; this is 9.81 along the coordinate axis most across the body if not given.
    """
    arm = rigid.centre - point
    g = _across(arm, axis) if gravity is None else np.asarray(gravity, dtype=float)
    torque = np.cross(arm, g)  # per unit of mass
    if axis is not None:
        torque = np.outer(axis, axis) @ torque
    lever = np.linalg.norm(torque) / max(float(np.linalg.norm(g)), 1e-300)
    gyration = sqrt(0.5 * np.trace(rigid.inertia) / rigid.mass)
    if lever < LEAST_LEVER * gyration:
        turning = "" if axis is None else f", which turns about {np.round(axis, 6).tolist()}"
        raise rom.ConfigError(
            f"gravity {g.tolist()} passes {lever:.2g} m beside the hinge{turning}: nothing would "
            "swing.",
            hint="Choose another --hinge, or --gravity across the part and across its axis.",
        )
    n = torque / np.linalg.norm(torque)
    inertia = n @ rigid.inertia @ n + rigid.mass * float(arm @ arm - (arm @ n) ** 2)
    period = 2 * pi * sqrt(inertia / (rigid.mass * float(np.linalg.norm(g)) * lever))
    return Swing(tuple(g.tolist()), tuple(n.tolist()), t_end or FAR_SWING * period)


def _across(arm: Array, axis: Array | None) -> Array:
    """Gravity along the coordinate axis most across the arm, less what pulls along the hinge."""
    if axis is None:
        return -9.81 * np.eye(3)[2 - int(np.argmin(np.abs(arm[::-1]).round(12)))]
    # of equals the last, and never the axis itself
    preferred = 1e-9 * (np.linalg.norm(arm) or 1.0) * (1 - axis**2) * (1.0, 1.1, 1.2)
    down = -np.eye(3)[int(np.argmax(np.abs(np.cross(arm, axis)) + preferred))]
    down = down - (down @ axis) * axis
    return 9.81 * down / np.linalg.norm(down) + 0.0


def pendulum(
    body: "rom.FlexibleBody", hinge: str, *, axis: npt.ArrayLike, gravity: npt.ArrayLike
) -> "rom.Mechanism":
    """A body that hangs on one of its interfaces where it was drawn."""
    mechanism = rom.Mechanism(gravity=gravity)
    part = mechanism.add_flexible(body.name, body)
    place = mechanism.ground.marker(tuple(body.marker(hinge).point))
    mechanism.revolute("hinge", place, part.marker(hinge), axis=axis)
    return mechanism


def magnification(body: "rom.FlexibleBody", q: Array) -> float:
    """A round factor, at least 1, with which the largest deformation by q (n_t, r) is seen."""
    shape = body.surface.shape
    largest = max(float(np.linalg.norm((shape @ x).reshape(-1, 3), axis=1).max()) for x in q)
    wanted = DRAWN_DEFORMATION_RATIO * body.size / max(largest, 1e-12 * body.size)
    return max(1.0, round_length(wanted))


def _write(
    files: dict[str, Path],
    body: "rom.FlexibleBody",
    solution: "rom.mbs.Solution",
    magnify: float,
    command: str,
) -> None:
    from rom.report.pages import of_body, of_run
    from rom.report.run import RECORD_FILE, SCENE_FILE, Record
    from rom.report.scene import motion_scene, write_scene

    rom.save(body, files[".rom.npz"])
    rom.write_history(solution, files[TABLE_FILE])
    mechanism, times = solution.mechanism, np.linspace(0, 0.5 * solution.t[-1], N_INSTANTS)
    up = -np.asarray(mechanism.gravity, dtype=float)
    rom.view.instants(mechanism, solution, files[".png"], times=times, magnify=magnify, up=up)
    for path in (files[kind] for kind in (".gif", ".mp4") if kind in files):
        rom.view.animate(mechanism, solution, path, magnify=magnify, up=up, frames=40)
    scene = motion_scene(solution, title=f"{body.name} swings", magnify=magnify, up=up)
    write_scene(scene, files[SCENE_FILE])
    record = Record(body.name, command, rom.__version__)
    written = [path for path in files.values() if path.suffix != ".html"]
    record.write(written, solution, rom.audit(solution))
    title, sections = of_run(files[RECORD_FILE].parent)
    sections |= {f"The body: {name.lower()}": told for name, told in of_body(body, [])[1].items()}
    rom.write_report(sections, files[".html"], title=title)


def _text(body: "rom.FlexibleBody", hinge: str, data: Data) -> str:
    full = body.provenance["reduction"]["full dofs"]
    held = ", ".join(f"{f:.5g}" for f in data["frequencies"])
    axis, down = (",".join(f"{x:.4g}" for x in data[key]) for key in ("axis", "gravity"))
    return (
        f"{body.name}: {body.mass:.4g} kg, {full} dofs reduced to 6 + {body.n_modes}\n"
        f"held at {hinge}: {held} Hz\n"
        f"turning about {axis} under gravity {down} m/s^2\n"
        f"deformations drawn {data['magnify']:g} times larger\n" + "\n".join(data["files"])
    )
