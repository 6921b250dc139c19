"""Responses in HDF5, under the names of `rom.updating.Responses`.

Data sets are frequencies (n_f,), H (n_f, n_s, n_e) complex, coherence (one number or as H), and
sensors and inputs, groups with points and directions (k, 3); attributes of the file are averages,
quantity (of all sensors, or of each with commas between), force_noise (zero where it is missing; of
lines and inputs (n_f, n_e) a data set), estimator (H1, H2 or Hv) and bodies of sensors and inputs
(one name a line) where they are named, units, always SI, and checksum, SHA-256 of the data sets,
which is compared where it is there.
Headers of HDF5 1.8 have checksums of their own: without them, and by texts in its heap, a byte that
is wrong can end the process.
"""

import io
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from rom.components.updating.measured import Channels, Responses
from rom.errors import FileFormatError, UnsafeFileError
from rom.io.files import check_readable, write_whole
from rom.io.hdf5 import h5py

HEADERS = ("v108", "v108")  # oldest and newest version of HDF5 that is written
KINDS = {"fiu": "real numbers", "c": "complex numbers"}  # by the letters of NumPy
MAX_ARRAY_BYTES = 2**32  # of all arrays of a test
DATA_SETS = ("frequencies", "H", "coherence", "sensors/points", "sensors/directions",
          "inputs/points", "inputs/directions")  # fmt: skip
FORCE_NOISE = "force_noise"  # a data set where it differs between lines


def written(test: Responses, path: Path) -> Path:
    """Write a test, whole or not at all.

    Raises:
        ConfigError: if the folder is missing or not writable.
        ResourceError: if the disk is full, or h5py is missing.
    """
    values: tuple[Any, ...]
    values = (test.frequencies, test.H, test.coherence, test.sensors.points,
              test.sensors.directions, test.inputs.points, test.inputs.directions)  # fmt: skip
    data = io.BytesIO()
    with h5py(".uff").File(data, "w", libver=HEADERS) as file:
        for name, value in zip(DATA_SETS, values, strict=True):
            file[name] = np.asarray(value)
        file.attrs["averages"] = test.averages
        if np.ndim(test.force_noise):
            file[FORCE_NOISE] = np.asarray(test.force_noise)
            values = (*values, test.force_noise)
        else:
            file.attrs[FORCE_NOISE] = test.force_noise
        texts = {
            "quantity": ",".join(test.quantities),
            "units": "SI",
            "checksum": _checksum(values),
        }
        for side, channels in (("sensors", test.sensors), ("inputs", test.inputs)):
            if channels.bodies is not None:
                texts[f"bodies of {side}"] = "\n".join(channels.bodies)
        if test.estimator is not None:
            texts["estimator"] = test.estimator
        for name, text in texts.items():
            file.attrs[name] = np.bytes_(text.encode())
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
            return _test(file)
    except (OSError, RuntimeError, KeyError, TypeError, ValueError) as error:
        raise FileFormatError(f"this is no whole HDF5 file: {error}.") from error


def _test(file: Any) -> Responses:
    h5 = h5py(".uff")
    if missing := [name for name in DATA_SETS if not isinstance(file.get(name), h5.Dataset)]:
        raise FileFormatError(f"there is no data set {missing[0]!r}.")
    if missing := [name for name in ("averages", "quantity", "units") if name not in file.attrs]:
        raise FileFormatError(f"the file has no attribute {missing[0]!r}.")
    if (units := _text(file.attrs["units"])) != "SI":
        raise FileFormatError(f"units are {units!r}, not 'SI'.")
    names = (*DATA_SETS, *[FORCE_NOISE] * isinstance(file.get(FORCE_NOISE), h5.Dataset))
    if sum(file[name].nbytes for name in names) > MAX_ARRAY_BYTES:
        raise UnsafeFileError("its arrays take more than 4 GiB.")
    for name in names:
        kinds = "c" if name == "H" else "fiu"
        if file[name].dtype.kind not in kinds:
            raise FileFormatError(f"{name!r} holds no {KINDS[kinds]}.")
    f, H, c, *where = values = [file[name][()] for name in names]
    if "checksum" in file.attrs and _text(file.attrs["checksum"]) != _checksum(values):
        raise FileFormatError(
            "the arrays are not those of its checksum: it was damaged or changed."
        )
    bodies = [_bodies(file, side) for side in ("sensors", "inputs")]
    sensors = Channels(where[0], where[1], bodies[0])
    inputs = Channels(where[2], where[3], bodies[1])
    averages = _number(file, "averages")
    if averages != int(averages):
        raise FileFormatError(f"averages = {averages} is no whole number.")
    noise = (
        _number(file, FORCE_NOISE) if FORCE_NOISE in file.attrs else where[4] if where[4:] else 0.0
    )
    estimator = _text(file.attrs["estimator"]) if "estimator" in file.attrs else None
    text = _text(file.attrs["quantity"])
    quantity = tuple(text.split(",")) if "," in text else text
    return Responses(f, H, sensors, inputs, c, int(averages), quantity, noise, estimator)


def _checksum(values: Sequence[Any]) -> str:
    """SHA-256 of the bytes of all arrays, one after another."""
    whole = sha256()
    for value in values:
        whole.update(np.ascontiguousarray(value).tobytes())
    return whole.hexdigest()


def _bodies(file: Any, side: str) -> tuple[str, ...] | None:
    """Names of the bodies of channels, where they are given."""
    name = f"bodies of {side}"
    return tuple(_text(file.attrs[name]).split("\n")) if name in file.attrs else None


def _text(value: Any) -> str:
    """An attribute of fixed or free length."""
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def _number(file: Any, name: str) -> float:
    value = np.asarray(file.attrs[name])
    if value.shape or value.dtype.kind not in "fiu" or not np.isfinite(value):
        raise FileFormatError(f"{name} = {file.attrs[name]} is no number.")
    return float(value)
