"""Motions as three-dimensional films that other programs play and turn around."""

from pathlib import Path

import numpy as np
import numpy.typing as npt

from rom import rotation
from rom.arguments import AnySolution, typed, unit_vector
from rom.errors import ConfigError
from rom.io.fields.gltf import MovingMesh, write_glb
from rom.io.fields.vtkhdf import write_vtkhdf
from rom.model import Array, Index
from rom.view.canvas.offscreen import checked
from rom.view.canvas.solids import Mesh, joined
from rom.view.scenes.film import shades_of, upright
from rom.view.scenes.places import evenly, placed
from rom.view.scenes.rigid import check_bodies, form_of

METAL_COLOURS = ((0.42, 0.48, 0.55), (0.62, 0.66, 0.70), (0.30, 0.34, 0.39))  # rigid bodies
ELASTIC_COLOURS = ((0.11, 0.44, 0.60), (0.82, 0.29, 0.36), (0.93, 0.68, 0.29), (0.40, 0.63, 0.51))


@typed
def write_animation(
    solution: AnySolution,
    path: str | Path,
    *,
    shapes: dict[str, Mesh] | None = None,
    frames: int = 200,
    seconds: float | None = 4.0,
    magnify: float = 1.0,
    up: npt.ArrayLike | None = None,
) -> Path:
    """Write a motion as a film in space.

    Args:
        solution: a `rom.mbs.results.solution.Solution`.
        path: ``.glb`` (glTF 2.0 binary) for browsers, slides and Blender; ``.vtkhdf`` for ParaView,
            with the displacement relative to the floating frame as a field.
        shapes: {body: (points (n, 3), triangles (t, 3))} in the frame of a rigid body; without one
            it is drawn as tubes from its mass centre to its markers.
        frames: number of instants, evenly over the saved ones.
        seconds: how long the ``.glb`` lasts [s]; None for the true time.
        magnify: deformations are drawn so many times larger than they are [1].
        up: (3,) upright direction [1]; None for against gravity, or z without gravity.

    Raises:
        ConfigError: for an unknown body or ending, a length of time or a number of frames that
            cannot be, a direction of length zero, or a place that is not writable.
        ResourceError: if h5py is missing for ``.vtkhdf``.
    """
    path = checked(path, ".glb", ".vtkhdf")
    shapes = shapes or {}
    check_bodies(solution.mechanism, "shapes", shapes)
    if min(frames, solution.t.size) < 2 or (seconds is not None and not 0 < seconds < np.inf):
        raise ConfigError(f"a film needs 2 frames in more than 0 s, got {frames} in {seconds} s.")
    steps = evenly(solution.t.size, min(frames, solution.t.size))
    bodies = _bodies(solution, steps, shapes, magnify)
    t = solution.t[steps]
    if path.suffix.lower() == ".vtkhdf":
        return _surfaces(bodies, t, path, magnify)
    times = t - t[0]
    if seconds is not None:
        times *= seconds / times[-1]
    title = "motion" if magnify == 1.0 else f"motion, deformation drawn {magnify:g} times larger"
    upward = upright(solution.mechanism, None if up is None else unit_vector("up", up))
    upward = np.eye(3)[2] if upward is None else np.asarray(upward, dtype=float)
    return write_glb(bodies, times, path, up=upward, title=title)


def _bodies(
    solution: AnySolution, steps: Index, shapes: dict[str, Mesh], magnify: float
) -> list[MovingMesh]:
    bodies, elastic, shades = [], 0, shades_of(solution.mechanism)
    for name in solution.mechanism.parts:
        form = form_of(solution.mechanism, name, shapes)
        modes, q = np.zeros((form.points.size, 0)), np.zeros((len(steps), 0))
        colour = METAL_COLOURS[shades[name]]
        if form.surface is not None:
            modes, q = magnify * form.surface.shape, solution.elastic(name)[steps]
            colour = ELASTIC_COLOURS[elastic % len(ELASTIC_COLOURS)]
            elastic += 1
        pose = solution.position(name)[steps], solution.orientation(name)[steps]
        mesh = form.points, np.asarray(form.triangles, dtype=np.int64)
        bodies.append(MovingMesh(name, *mesh, *pose, modes, q, colour))
    return bodies


def _surfaces(bodies: list[MovingMesh], t: Array, path: Path, magnify: float) -> Path:
    surfaces, moved, numbers = [], [], []
    for number, body in enumerate(bodies):
        u = (body.q @ body.shapes.T).reshape(len(t), -1, 3)
        turned = (body.origin, np.array([rotation.matrix(p) for p in body.orientation]))
        surfaces.append((placed(body.points + u, turned), body.triangles))
        moved.append(placed(u, (0 * body.origin, turned[1])) / magnify)
        numbers.append(np.full((len(t), len(body.points)), float(number)))
    fields = {"displacement [m]": np.hstack(moved), "body": np.hstack(numbers)}
    return write_vtkhdf(*joined(surfaces), t, path, fields=fields)
