"""Superelements for OpenFAST's module ExtPtfm.

Six coordinates of the interface to the tower, translations then rotations, at the platform
reference point of OpenFAST and along its axes (z up), then modes with the interface held. The
weight of the superelement has to be in the file. Version 5 takes it as ``W_0 - K_W q`` in a frame
that follows a floating platform; versions 2.3 to 4 take a table of loads over time (FlexASCII).

Source:
    OpenFAST documentation, ExtPtfm, input files, of versions 4 and 5.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from rom.body.flexible import FlexibleBody
from rom.errors import ConfigError
from rom.io.files import write_whole
from rom.io.programs.interface_form import InterfaceForm, interface_form
from rom.io.programs.openfast_reading import LOADING_LINE, Superelement
from rom.model import Array
from rom.names import ORIGIN_MARK, check_known

VERSIONS = (4, 5)
LOAD_DURATION = 1e5  # [s]; how long the loads of version 4 are constant
GRAVITY = (0.0, 0.0, -9.81)
UNITS = {"Mass": "kg, m", "Stiffness": "N, m", "Damping": "N, m, s"}


def write_openfast(
    body: FlexibleBody,
    path: str | Path,
    *,
    held: Sequence[str] = (),
    gravity: npt.ArrayLike = GRAVITY,
    version: int = 5,
) -> Path:
    """Write a body with one free interface.

    Args:
        body: all its interfaces have six coordinates (rbe2, rbe3), z is up.
        path: file to write.
        held: interfaces that stand still, as the foot of a jacket; none for a floating platform.
        gravity: (3,) acceleration [m/s^2] whose loads are written.
        version: of OpenFAST: 5, or 4 for 2.3 to 4.

    Raises:
        ConfigError: if not exactly one interface is free, the version is unknown, or the place is
            not writable.
        ModelError: if the shapes do not let the interfaces move one by one.
        ResourceError: if the disk is full.
    """
    if version not in VERSIONS:
        raise ConfigError(f"version {version!r} of OpenFAST is unknown; known: {VERSIONS}.")
    found = superelement(body, held=held, gravity=gravity)
    lines = [f"! {body.name}, {ORIGIN_MARK}", *(_current(found) if version == 5 else _old(found))]
    return write_whole(path, ("\n".join(lines) + "\n").encode())


def superelement(
    body: FlexibleBody, *, held: Sequence[str] = (), gravity: npt.ArrayLike = GRAVITY
) -> Superelement:
    """The matrices and the weight, without a table of loads; see `write_openfast`.

    A held body keeps its weight whatever its small motions; in the frame of a floating one gravity
    turns, and its change with the modes is left out.
    """
    form = interface_form(body)
    rows = _rows(body, form, held)
    n_b = 6 * len(form.names)
    along = np.zeros((len(form.K), 3))
    along[:n_b] = np.tile(np.eye(6, 3), (len(form.names), 1))
    g, S = np.asarray(gravity, dtype=float), (form.M @ along)[rows]
    K, M, D = (A[np.ix_(rows, rows)] for A in (form.K, form.M, form.D))
    K_W = np.zeros_like(K)
    if not held:
        K_W[:, 3:6] = -S @ np.cross(g, np.eye(3)).T  # the frame sees the gravity g - theta x g
        K[:6], K[:, :6] = 0.0, 0.0  # round-off, which OpenFAST warns of
    n = rows.size
    return Superelement(M, K, D, S @ g, K_W, np.zeros(0), np.zeros((0, n)), np.zeros(0))


def _rows(body: FlexibleBody, form: InterfaceForm, held: Sequence[str]) -> npt.NDArray[np.int64]:
    """Rows of the free interface, then of the modes."""
    for name in held:
        check_known(name, form.names, f"{name!r} cannot be held; there are")
    free = [name for name in form.names if name not in held]
    if len(free) != 1:
        raise ConfigError(
            f"body {body.name!r} has {len(free)} free interfaces, {free}; OpenFAST takes one.",
            hint="Hold the others: held=(...), on the command line --held.",
        )
    first = 6 * form.names.index(free[0])
    return np.r_[first : first + 6, 6 * len(form.names) : len(form.K)]


def _current(found: Superelement) -> Iterator[str]:
    yield f"!Dimension: {len(found.M)}"
    for kind, A in zip(UNITS, (found.M, found.K, found.D), strict=True):
        yield f"!{kind} Matrix (Units ({UNITS[kind]}))"
        yield from map(_row, A)
    yield "!Weight constant (Units (N, m))"
    yield _row(found.weight)
    yield "!Weight stiffness (Units (N, m))"
    yield from map(_row, found.K_W)


def _old(found: Superelement) -> Iterator[str]:
    n = len(found.M)
    yield "! Flex 5 Format"
    yield f"!Dimension: {n}"
    yield f"!Time increment in simulation: {LOAD_DURATION:g}"
    yield f"!Total simulation time in file: {LOAD_DURATION:g}"
    for kind, A in zip(UNITS, (found.M, found.K, found.D), strict=True):
        yield f"!{kind} Matrix (Units ({UNITS[kind]}))"
        yield f"!Dimension: {n}"
        yield from map(_row, A)
    yield f"!{LOADING_LINE[1:].title()} (Units (N, m))"
    yield f"!Dimension: 1 time column - {n} force columns - 1 wave elevation column"
    yield from (_row(np.r_[t, found.weight, 0.0]) for t in (0.0, LOAD_DURATION))


def _row(values: Array) -> str:
    return " ".join(f"{v:.16e}" for v in values)
