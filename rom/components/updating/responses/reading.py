"""Tests of vibration from files: the reader is chosen by the ending.

See docs/theory/updating.md.
"""

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from rom.arguments import typed
from rom.components.updating.measured import MeasuredModes, Responses
from rom.components.updating.responses.grid import Bodies, side_by_side
from rom.errors import ConfigError, FileFormatError
from rom.model import Array

UNIVERSAL_ENDINGS, TABLE_ENDINGS, ARRAY_ENDINGS = (
    (".uff", ".unv", ".uf"),
    (".csv", ".txt"),
    (".h5", ".hdf5"),
)


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
    from rom.components.updating.responses.tables import functions_of
    from rom.components.updating.responses.universal_test import functions_and_points

    path = Path(path)
    ending = path.suffix.lower()
    if ending in ARRAY_ENDINGS:
        from rom.components.updating.responses.arrays import read

        if averages is not None or coherence is not None or points is not None:
            raise ConfigError(f"{path} says averages, coherence and points itself; leave them out.")
        with _of(path):
            return read(path)
    if ending not in UNIVERSAL_ENDINGS + TABLE_ENDINGS:
        raise _unknown(path, UNIVERSAL_ENDINGS + TABLE_ENDINGS + ARRAY_ENDINGS)
    if averages is None:
        raise ConfigError(
            "averages is missing: how many are behind the functions?",
            hint="Without it the coherence says nothing of random errors.",
        )
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
    from rom.components.updating.responses.universal_test import modes_of

    places, _ = _points(points)
    with _of(Path(path)):
        return modes_of(Path(path), places)


@typed
def write_responses(test: Responses, path: str | Path) -> Path:
    """Write measured responses as HDF5, whole or not at all.

    Args:
        test: what to write.
        path: file name, ending in .h5.

    Raises:
        ConfigError: for another ending, or if the folder is missing or not writable.
        ResourceError: if the disk is full, or h5py is missing.
    """
    from rom.components.updating.responses.arrays import written

    if Path(path).suffix.lower() not in ARRAY_ENDINGS:
        raise _unknown(Path(path), ARRAY_ENDINGS)
    return written(test, Path(path))


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
    from rom.components.updating.responses.tables import points_of
    from rom.components.updating.responses.universal_test import functions_and_points

    if path is None:
        return {}, {}
    path = Path(path)
    with _of(path):
        if path.suffix.lower() in TABLE_ENDINGS:
            return points_of(path)
        return functions_and_points(path)[1], {}


def _unknown(path: Path, known: tuple[str, ...]) -> ConfigError:
    return ConfigError(f"{path}: the ending must be one of {', '.join(known)}.")
