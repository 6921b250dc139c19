"""A moving triangulated surface in one VTKHDF file, which ParaView plays.

Source:
    VTK documentation, VTKHDF file format, version 2.0, "Temporal data" of UnstructuredGrid.
"""

import io
from pathlib import Path

import numpy as np

from rom.io.fields.vtu import VTK_TRIANGLE
from rom.io.files import h5py, write_whole
from rom.model import Array, Index
from rom.names import ORIGIN_MARK


def write_vtkhdf(
    points: Array, triangles: Index, times: Array, path: str | Path, *, fields: dict[str, Array]
) -> Path:
    """Write a surface at several instants.

    Args:
        points: (f, n, 3) positions at each instant [m].
        triangles: (t, 3) corners, the same at all instants.
        times: (f,) [s].
        path: file ending in ``.vtkhdf``.
        fields: {name: (f, n) or (f, n, c) values at the points, in their own units}.

    Raises:
        ConfigError: if the place is not writable.
        ResourceError: if h5py is missing or clashes, or the disk is full.
    """
    f, n = points.shape[:2]
    every, zero = n * np.arange(f), np.zeros(f, dtype=np.int64)
    hdf5, memory = h5py(".glb"), io.BytesIO()
    with hdf5.File(memory, "w") as file:
        file.attrs["generator"] = ORIGIN_MARK
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = (2, 0)
        root.attrs.create("Type", b"UnstructuredGrid", dtype=hdf5.string_dtype("ascii", 16))
        root["NumberOfPoints"] = [n]  # one part, the same at all instants
        root["NumberOfCells"] = [len(triangles)]
        root["NumberOfConnectivityIds"] = [triangles.size]
        root["Points"] = points.reshape(-1, 3)
        root["Connectivity"] = triangles.ravel()
        root["Offsets"] = 3 * np.arange(len(triangles) + 1)
        root["Types"] = np.full(len(triangles), VTK_TRIANGLE, dtype=np.uint8)
        steps = root.create_group("Steps")
        steps.attrs["NSteps"] = f
        steps["Values"] = times
        steps["NumberOfParts"] = np.ones(f, dtype=np.int64)
        steps["PartOffsets"] = zero
        steps["PointOffsets"] = every
        steps["CellOffsets"] = steps["ConnectivityIdOffsets"] = zero[:, None]
        for name, values in fields.items():
            root[f"PointData/{name}"] = values.reshape(f * n, *values.shape[2:])
            steps[f"PointDataOffsets/{name}"] = every
    return write_whole(path, memory.getvalue())
