"""The FMU of a body: forces on its interfaces in, their motion out, without Python.

The FMU is the C code of the linear equations, with their matrices inside. It is for small motions
about the place in which the body was meshed: of a body that is held, of one on soft springs that
the other program knows, or of a free one as long as its rotation stays small. Bodies that turn
belong into a mechanism, see `rom.fmu`.
"""

from pathlib import Path

import numpy as np

from rom.arguments import typed
from rom.body.flexible import FlexibleBody
from rom.body.reference import marker_motion
from rom.errors import ConfigError
from rom.io.files import check_writable
from rom.io.fmu.archive import write_archive
from rom.io.fmu.description import Content, Variable, components, structured
from rom.model import Array

INPUTS = (("force", "N"), ("torque", "N.m"))
OUTPUTS = (
    ("displacement", "m"),
    ("rotation", "rad"),
    ("velocity", "m/s"),
    ("angular_velocity", "rad/s"),
)
ROUND_OFF = 1e-12  # share of the damping of two modes below which they count as not coupled
STEPS_PER_PERIOD = 20  # communication steps proposed for the period of the first vibration


@typed
def write_body_fmu(body: FlexibleBody, path: str | Path, *, fixed: tuple[str, ...] = ()) -> Path:
    """Write a body as an FMU for co-simulation (FMI 2.0) that needs nothing where it runs.

    Inputs are ``interface.force[1..3]`` [N] and ``interface.torque[1..3]`` [N m] of each interface,
    and ``gravity[1..3]`` [m/s^2], minus the acceleration of the ground for a body that is held;
    outputs are small ``displacement`` [m], ``rotation`` [rad], ``velocity`` and
    ``angular_velocity`` of each interface, all in the axes of the geometry. The body starts at rest
    and undeformed. Inputs are held over a communication step, which then is exact, whatever its
    length; a smooth input costs an error of the order of the step.

    The archive holds a library for this kind of machine, compiled by gcc, and its C source.

    Args:
        body: with at least one interface, in SI units.
        path: file ending in ``.fmu``.
        fixed: interfaces that are held; they take loads too, which do not move them.

    Raises:
        ConfigError: if the body has no interface or other units, or the place is not writable.
        InterfaceError: if a fixed interface is unknown.
        ModelError: if an interface of a basis of free-free modes alone is held.
        ResourceError: if there is no C compiler, it fails, or the disk is full.
    """
    path = check_writable(path)
    if not body.markers or body.units != "SI":
        what = f"has the units {body.units}" if body.markers else "has no interface"
        raise ConfigError(f"body {body.name!r} {what}; an FMU needs interfaces and SI units.")
    omega, V = body.modes(fixed=fixed)
    if not omega.size:
        raise ConfigError(f"body {body.name!r} cannot move with {fixed!r} held; leave one free.")
    first = omega[omega > 0.0][:1] / (2 * np.pi)
    step = 1.0 / (STEPS_PER_PERIOD * float(first[0])) if first.size else 1e-3
    about = f"Small motions of the flexible body {path.stem}, inputs held over a step."
    headers, tables = ("shared.h",), _tables(body, omega, V)
    inside = _variables(body), step, "linear.c", headers, tables
    return write_archive(path, Content(path.stem, about, *inside))


def _tables(body: FlexibleBody, omega: Array, V: Array) -> str:
    motions = [marker_motion(marker, body.n_modes) for marker in body.markers.values()]
    motion = np.vstack([np.hstack(parts) for parts in motions]) @ V
    fall = body.full_matrices()[0][:, :3]
    tables = {
        "OMEGA": omega,
        "XI": _modal_damping(body, omega, V),
        "LOADS": np.hstack([motion.T, V.T @ fall]),
        "MOTION": motion,
    }
    sizes = f"enum {{ MODES = {omega.size}, INTERFACES = {len(body.markers)} }};\n"
    return sizes + arrays(tables)


def _modal_damping(body: FlexibleBody, omega: Array, V: Array) -> Array:
    """(m, m) damping of the modes, without the round-off that would fill the propagator."""
    XI: Array = V[6:].T @ body.D @ V[6:]
    size = np.where(omega > 0.0, np.sqrt(np.abs(np.diag(XI))), 0.0)  # rigid motion is not damped
    pairs = np.outer(size, size)
    return np.where((pairs > 0.0) & (np.abs(XI) > ROUND_OFF * pairs), XI, 0.0)


def arrays(tables: dict[str, Array]) -> str:
    """Arrays of C; of nothing, one zero."""
    text = ""
    for name, A in tables.items():
        numbers = [float(x).hex() for x in np.ravel(A)] or ["0.0"]
        text += f"static const double {name}[{len(numbers)}] = {{\n" + ",\n".join(numbers) + "};\n"
    return text


def _variables(body: FlexibleBody) -> list[Variable]:
    names = body.interface_names
    wanted = [(structured(name, what), "input", unit) for name in names for what, unit in INPUTS]
    wanted.append(("gravity", "input", "m/s2"))
    wanted += [(structured(name, what), "output", unit) for name in names for what, unit in OUTPUTS]
    starts: dict[str, list[float | None]] = {"input": [0.0] * 3, "output": [None] * 3}
    return [v for name, kind, unit in wanted for v in components(name, kind, unit, starts[kind])]
