"""A body for the block Reduced Order Flexible Solid of Simscape Multibody (``.mat``, version 5).

The block wants, for the same order of frames everywhere: origins of the interface frames, and K, M
and damping with six rows for each frame (translation, then rotation about x, y, z) before the
modes, rigid motions included.
"""

import io
from pathlib import Path

import numpy as np
from scipy.io import savemat

from rom.body.flexible import FlexibleBody
from rom.io.files import write_whole
from rom.io.programs.interface_form import interface_form
from rom.names import ORIGIN_MARK


def write_simscape(body: FlexibleBody, path: str | Path) -> Path:
    """Write the variables ``K``, ``M``, ``C``, ``origins``, ``quaternions``, ``interfaces``, ...

    In MATLAB: ``rod = load("rod.mat")``, then ``rod.K`` and so on in the fields of the block, with
    the units of ``rod.units``. The frames are parallel to the body: their quaternions are ones.

    Args:
        body: with interfaces of six coordinates each.
        path: file ending in ``.mat``.

    Raises:
        ConfigError: if an interface is not rigid or averaged, or the place is not writable.
        ModelError: if the shapes of the body do not let its interfaces move one by one.
        ResourceError: if the disk is full.
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
