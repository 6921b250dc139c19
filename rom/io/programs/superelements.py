"""Bodies in the coordinates of their interfaces for Simscape Multibody and OpenRadioss."""

import io
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from scipy.io import savemat

from rom.body.flexible import FlexibleBody
from rom.errors import ConfigError
from rom.io.files import write_whole
from rom.io.matrices.dmig import write_dmig
from rom.io.programs.interface_form import interface_form
from rom.names import ORIGIN_MARK

MIN_POINTS = 3
COLLINEAR_RTOL = 1e-6  # second over first singular value of points on one line


def write_simscape(body: FlexibleBody, path: str | Path) -> Path:
    """Write a body for the block Reduced Order Flexible Solid (``.mat``, version 5).

    In MATLAB: ``rod = load("rod.mat")``, then ``rod.K`` and so on in the fields of the block, with
    the units of ``rod.units``: six rows for each frame (translation, rotation), then the modes,
    rigid motions included. All frames are parallel to the body.

    Raises:
        ConfigError: if an interface is not rigid or averaged, or the place is not writable.
        ModelError: if the shapes of the body do not let its interfaces move one by one.
    """
    form = interface_form(body)
    variables = {
        "K": form.K,
        "M": form.M,
        "C": form.D,
        "origins": np.array(list(form.points.values())),
        "quaternions": np.tile([1.0, 0.0, 0.0, 0.0], (len(form.names), 1)),
        "interfaces": np.array(form.names, dtype=object)[:, None],
        "frequencies": form.omega[:, None] / (2 * np.pi),  # interfaces held [Hz]
        "mass": body.mass,
        "centre": body.first_moment / body.mass,
        "units": "m, kg, s, rad; frequencies in Hz",
        "name": body.name,
    }
    memory = io.BytesIO()
    savemat(memory, variables)
    # the text at the head of a file has the date, which would make every file a new one
    content = f"MATLAB 5.0 MAT-file, {ORIGIN_MARK}".encode().ljust(116) + memory.getvalue()[116:]
    return write_whole(path, content)


def write_radioss(
    body: FlexibleBody, path: str | Path, *, nodes: Mapping[str, int] | None = None
) -> Path:
    """Write a statically reduced body as flexible body ``/FXBODY``, with ten digits.

    Its reader takes KAAX and MAAX as DMIG cards in fields of 16 characters and nothing else: no
    nodes, no damping, no modes. Every label is a node of its model; three must not lie on one line.

    Source:
        Radioss reference guide, /FXBODY; what OpenRadioss reads from each line.

    Args:
        body: reduced by `rom.Guyan`, with at least three interfaces of six coordinates.
        path: file to write, ending in ``.pch``.
        nodes: {interface: label of its node in OpenRadioss}; 1, 2, … in their order if not given.

    Raises:
        ConfigError: if the body keeps modes, has too few interfaces or all on a line, a label is
            missing or not a number of a node, or the place is not writable.
        ModelError: if the shapes of the body do not let its interfaces move one by one.
    """
    form = interface_form(body)
    if form.omega.size:
        text = f"body {body.name!r} has {form.omega.size} modes; OpenRadioss reads interfaces alone"
        raise ConfigError(f"{text}; reduce it with rom.Guyan().")
    points = np.array([form.points[k] for k in sorted(form.points)])
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if len(points) < MIN_POINTS or spread[1] < COLLINEAR_RTOL * spread[0]:
        text = f"body {body.name!r} has {len(points)} interfaces, {form.names}; OpenRadioss needs"
        raise ConfigError(f"{text} {MIN_POINTS} that do not lie on one line.")
    labels = dict(nodes) if nodes else {name: k for k, name in enumerate(form.names, 1)}
    if set(labels) != set(form.names) or len(set(labels.values())) < len(labels):
        raise ConfigError(f"nodes {labels} must be one label for each interface of {form.names}.")
    if not all(0 < label < 10**10 for label in labels.values()):
        raise ConfigError(f"labels of nodes must have 1 to 10 digits, got {labels}.")
    dofs = form.dofs.copy()
    dofs[:, 0] = np.repeat([labels[name] for name in form.names], 6)
    return write_dmig({"KAAX": form.K, "MAAX": form.M}, dofs, path)
