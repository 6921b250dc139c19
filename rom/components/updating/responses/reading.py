"""Tests of vibration from files: the reader is chosen by the ending.

HDF5 has the names of `rom.updating.Responses`: data sets are frequencies (n_f,), H (n_f, n_s, n_e)
complex, coherence (one number or as H), and sensors and inputs, groups with points and directions
(k, 3); attributes of the file are averages, quantity (of all sensors, or of each with commas
between), force_noise (zero where it is missing; of lines and inputs (n_f, n_e) a data set),
estimator (H1, H2 or Hv) and bodies of sensors and inputs (one name a line) where they are named,
units, always SI, and checksum, SHA-256 of the data sets, which is compared where it is there.
Headers of HDF5 1.8 have checksums of their own: without them, and by texts in its heap, a byte that
is wrong can end the process.

See docs/theory/updating.md.
"""

import io
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from rom.arguments import typed
from rom.components.updating.measured import Channels, MeasuredModes, Responses
from rom.components.updating.responses.grid import Bodies, side_by_side
from rom.components.updating.responses.tables import functions_of, points_of
from rom.components.updating.responses.universal_test import functions_and_points, modes_of
from rom.errors import ConfigError, FileFormatError, UnsafeFileError
from rom.io.files import check_readable, h5py, write_whole
from rom.model import Array
from rom.names import check_ending

if TYPE_CHECKING:
    import h5py as h5

UNIVERSAL_ENDINGS, TABLE_ENDINGS = (".uff", ".unv", ".uf"), (".csv", ".txt")
ARRAY_ENDINGS = (".h5", ".hdf5")
HEADERS = ("v108", "v108")  # oldest and newest version of HDF5 that is written
KINDS = {"fiu": "real numbers", "c": "complex numbers"}  # by the letters of NumPy
MAX_ARRAY_BYTES = 2**32  # of all arrays of a test
SIDES = ("sensors", "inputs")
PLACES = tuple(f"{side}/{what}" for side in SIDES for what in ("points", "directions"))
DATA_SETS = ("frequencies", "H", "coherence", *PLACES)
TEXTS = ("estimator", "bodies of sensors", "bodies of inputs")  # attributes that may be missing
FORCE_NOISE = "force_noise"  # a data set where it differs between lines


@typed
def read_responses(
    path: str | Path,
    *,
    averages: int | None = None,
    coherence: float | None = None,
    points: str | Path | None = None,
    bodies: Collection[str] = (),
) -> Responses:
    """Measured frequency responses, with their points and units.

    Args:
        path: universal file (.uff, .unv) with functions, datasets 58, and nodes, 15 or 2411, in
            units of dataset 164; table of a spectrum analyser (.csv, .txt), its columns named
            ``12+Z/3-Y real [m/s^2/N]``; or .h5 of `write_responses`.
        averages: number of them behind all functions; .h5 says so itself.
        coherence: of all values [1]; None where the file has it.
        points: another file with the nodes, universal or a table ``node, x [m], y [m], z [m]``;
            a last column ``body`` names bodies of an assembly.
        bodies: of an assembly: names to which the entities belong that universal files give with
            the nodes of a function, in their first ten characters. Where no entity is one of them
            each channel belongs to the nearest body. A table of points and .h5 say so themselves.

    Raises:
        FileFormatError: naming function, column or node that is missing or contradicts another.
        UnsafeFileError: if the file is too large.
        ConfigError: for an ending that is unknown, or without averages.
        ResourceError: if h5py is missing.

    Source:
        SDRC, Universal file datasets, as published by the University of Cincinnati.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending in ARRAY_ENDINGS:
        if averages is not None or coherence is not None or points is not None:
            raise ConfigError(f"{path} says averages, coherence and points itself; leave them out.")
        with _of(path):
            try:
                with h5py(".uff").File(check_readable(path), "r") as file:
                    return _test(file)
            except (OSError, RuntimeError, KeyError, TypeError, ValueError) as error:
                raise FileFormatError(f"this is no whole HDF5 file: {error}.") from error
    check_ending(path, "a test", *UNIVERSAL_ENDINGS, *TABLE_ENDINGS, *ARRAY_ENDINGS)
    if averages is None:
        text = "averages is missing: how many are behind the functions?"
        raise ConfigError(text, hint="Without it the coherence says nothing of random errors.")
    more, owners = _points(points)
    with _of(path):
        table = ending in TABLE_ENDINGS
        functions, nodes = (functions_of(path), {}) if table else functions_and_points(path)
        where = nodes | more
        return side_by_side(functions, where, averages, coherence, Bodies(owners, bodies))


@typed
def read_modes(path: str | Path, *, points: str | Path | None = None) -> MeasuredModes:
    """Modes of a test from the datasets 55 of a universal file.

    Args:
        path: the file, with nodes in dataset 15 or 2411.
        points: another file with the nodes, see `read_responses`.

    Raises:
        FileFormatError: if the file holds no mode, or a node without coordinates.
        UnsafeFileError: if it is larger than 1 GiB.

    Source:
        SDRC, Universal file datasets, as published by the University of Cincinnati.
    """
    places, _ = _points(points)
    with _of(Path(path)):
        return modes_of(Path(path), places)


@typed
def write_responses(test: Responses, path: str | Path) -> Path:
    """Write measured responses as HDF5, to a file that ends in .h5, whole or not at all.

    Raises:
        ConfigError: for another ending, or if the folder is missing or not writable.
        ResourceError: if the disk is full, or h5py is missing.
    """
    path = check_ending(path, "a test", *ARRAY_ENDINGS)
    sides = list(zip(SIDES, (test.sensors, test.inputs), strict=True))
    places = (x for _, channels in sides for x in (channels.points, channels.directions))
    values = (test.frequencies, test.H, test.coherence, *places)
    arrays = dict(zip(DATA_SETS, map(np.asarray, values), strict=True))
    texts = {"quantity": ",".join(test.quantities), "units": "SI"}
    texts |= {f"bodies of {k}": "\n".join(x.bodies) for k, x in sides if x.bodies is not None}
    if test.estimator is not None:
        texts["estimator"] = test.estimator
    numbers = {"averages": test.averages, FORCE_NOISE: test.force_noise}
    if np.ndim(test.force_noise):
        arrays[FORCE_NOISE] = np.asarray(numbers.pop(FORCE_NOISE))
    texts["checksum"] = _checksum(list(arrays.values()))
    data = io.BytesIO()
    with h5py(".uff").File(data, "w", libver=HEADERS) as file:
        for name, value in arrays.items():
            file[name] = value
        for name, text in texts.items():
            file.attrs[name] = np.bytes_(text.encode())
        file.attrs.update(numbers)
    write_whole(path, lambda out: out.write(data.getvalue()))
    return path


@contextmanager
def _of(path: Path) -> Iterator[None]:
    """Errors name the file, also where wrong values cause them."""
    try:
        yield
    except (ConfigError, FileFormatError) as error:
        if error.where.startswith(str(path)):
            raise
        kind = type(error) if isinstance(error, FileFormatError) else FileFormatError
        where = ": ".join(filter(None, (str(path), error.where)))
        raise kind(error.message, where=where, hint=error.hint) from error


def _points(path: str | Path | None) -> tuple[dict[int, Array], dict[int, str]]:
    if path is None:
        return {}, {}
    path = Path(path)
    with _of(path):
        if path.suffix.lower() in TABLE_ENDINGS:
            return points_of(path)
        return functions_and_points(path)[1], {}


def _test(file: "h5.File") -> Responses:
    dataset = h5py(".uff").Dataset
    if missing := [name for name in DATA_SETS if not isinstance(file.get(name), dataset)]:
        raise FileFormatError(f"there is no data set {missing[0]!r}.")
    if missing := [name for name in ("averages", "quantity", "units") if name not in file.attrs]:
        raise FileFormatError(f"the file has no attribute {missing[0]!r}.")
    if (units := _text(file.attrs["units"])) != "SI":
        raise FileFormatError(f"units are {units!r}, not 'SI'.")
    names = (*DATA_SETS, *[FORCE_NOISE] * isinstance(file.get(FORCE_NOISE), dataset))
    if sum(file[name].nbytes for name in names) > MAX_ARRAY_BYTES:
        raise UnsafeFileError("its arrays take more than 4 GiB.")
    for name in names:
        kinds = "c" if name == "H" else "fiu"
        if file[name].dtype.kind not in kinds:
            raise FileFormatError(f"{name!r} holds no {KINDS[kinds]}.")
    f, H, c, *where = values = [file[name][()] for name in names]
    if "checksum" in file.attrs and _text(file.attrs["checksum"]) != _checksum(values):
        text = "the arrays are not those of its checksum: it was damaged or changed."
        raise FileFormatError(text)
    texts: dict[str, Any] = {name: _text(file.attrs[name]) for name in TEXTS if name in file.attrs}
    bodies = [tuple(texts[k].split("\n")) if k in texts else None for k in TEXTS[1:]]
    sensors = Channels(where[0], where[1], bodies[0])
    inputs = Channels(where[2], where[3], bodies[1])
    averages = _number(file, "averages")
    if averages != int(averages):
        raise FileFormatError(f"averages = {averages} is no whole number.")
    noise = where[4] if where[4:] else 0.0
    if FORCE_NOISE in file.attrs:
        noise = _number(file, FORCE_NOISE)
    quantity: list[Any] = _text(file.attrs["quantity"]).split(",")
    each = tuple(quantity) if quantity[1:] else quantity[0]
    estimator = texts.get("estimator")
    return Responses(f, H, sensors, inputs, c, int(averages), each, noise, estimator)


def _checksum(values: Sequence[npt.ArrayLike]) -> str:
    """SHA-256 of the bytes of all arrays, one after another."""
    whole = sha256()
    for value in values:
        whole.update(np.ascontiguousarray(value).tobytes())
    return whole.hexdigest()


def _text(value: object) -> str:
    """An attribute of fixed or free length."""
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def _number(file: "h5.File", name: str) -> float:
    value = np.asarray(file.attrs[name])
    if value.shape or value.dtype.kind not in "fiu" or not np.isfinite(value):
        raise FileFormatError(f"{name} = {file.attrs[name]} is no number.")
    return float(value)
