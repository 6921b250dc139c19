"""Responses in HDF5, under the names of `rom.updating.Responses`.

Data sets are frequencies (n_f,), H (n_f, n_s, n_e) complex, coherence (one number or as H), and
sensors and inputs, groups with points and directions (k, 3); attributes of the file are averages,
quantity, force_noise (zero where it is missing) and units, always SI.
"""

import io
from pathlib import Path
from typing import Any

import numpy as np

from rom.errors import FileFormatError, UnsafeFileError
from rom.io.files import check_readable, write_whole
from rom.io.hdf5 import h5py
from rom.updating.measured import Channels, Responses

MAX_ARRAY_BYTES = 2**32  # of all arrays of a test
DATA_SETS = ("frequencies", "H", "coherence", "sensors/points", "sensors/directions",
          "inputs/points", "inputs/directions")  # fmt: skip


def written(test: Responses, path: Path) -> Path:
    """Write a test, whole or not at all.

    Raises:
        ConfigError: if the folder is missing or not writable.
        ResourceError: if the disk is full, or h5py is missing.
    """
    values = (test.frequencies, test.H, test.coherence, test.sensors.points,
              test.sensors.directions, test.inputs.points, test.inputs.directions)  # fmt: skip
    data = io.BytesIO()
    with h5py(".uff").File(data, "w") as file:
        for name, value in zip(DATA_SETS, values, strict=True):
            file[name] = np.asarray(value)
        file.attrs["averages"] = test.averages
        file.attrs["quantity"] = test.quantity
        file.attrs["force_noise"] = test.force_noise
        file.attrs["units"] = "SI"
    write_whole(path, lambda out: out.write(data.getvalue()))
    return path


def read(path: Path) -> Responses:
    """Read a test.

    Raises:
        FileFormatError: if an array is missing, or units are not SI.
        UnsafeFileError: if arrays take more memory than 4 GiB.
        ConfigError: as `Responses`.
        ResourceError: if h5py is missing.
    """
    try:
        with h5py(".uff").File(check_readable(path), "r") as file:
            return _test(path, file)
    except OSError as error:
        raise FileFormatError(f"this is no HDF5 file: {error}.", where=str(path)) from error


def _test(path: Path, file: Any) -> Responses:
    h5 = h5py(".uff")
    if missing := [name for name in DATA_SETS if not isinstance(file.get(name), h5.Dataset)]:
        raise FileFormatError(f"there is no data set {missing[0]!r}.", where=str(path))
    if missing := [name for name in ("averages", "quantity", "units") if name not in file.attrs]:
        raise FileFormatError(f"the file has no attribute {missing[0]!r}.", where=str(path))
    if file.attrs["units"] != "SI":
        raise FileFormatError(f"units are {file.attrs['units']!r}, not 'SI'.", where=str(path))
    if sum(file[name].nbytes for name in DATA_SETS) > MAX_ARRAY_BYTES:
        raise UnsafeFileError("its arrays take more than 4 GiB.", where=str(path))
    if wrong := [name for name in DATA_SETS if file[name].dtype.kind not in "fciu"]:
        raise FileFormatError(f"{wrong[0]!r} holds no numbers.", where=str(path))
    f, H, c, *where = (file[name][()] for name in DATA_SETS)
    sensors, inputs = Channels(*where[:2]), Channels(*where[2:])
    averages, quantity = int(file.attrs["averages"]), str(file.attrs["quantity"])
    noise = float(file.attrs.get("force_noise", 0.0))
    return Responses(f, H, sensors, inputs, c, averages, quantity, noise)
