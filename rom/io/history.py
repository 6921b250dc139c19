"""Histories of a motion: a table (CSV, pandas), a tree of arrays (HDF5), a data set (xarray)."""

import io
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from operator import attrgetter, itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from rom.arguments import AnySolution, typed, whole
from rom.errors import ConfigError
from rom.io.files import check_writable, h5py, library, write_whole
from rom.model import Array
from rom.names import csv_cell, offered

AXIS_LETTERS = ("x", "y", "z")
QUATERNION_PARTS = ("p0", "p1", "p2", "p3")
DIMENSION_NAMES = {AXIS_LETTERS: "axis", QUATERNION_PARTS: "quaternion"}  # of data sets
FORCE, MOMENT = itemgetter(np.s_[:, :3]), itemgetter(np.s_[:, 3:])
ENERGIES = ("kinetic", "strain", "potential", "drives", "forces", "damping", "total")


@dataclass(frozen=True)
class Channel:
    """One quantity over time."""

    path: tuple[str, ...]  # outermost first, e.g. ("bodies", "rod", "position")
    unit: str  # a comma separates those of columns that differ
    columns: tuple[str, ...]  # their names
    take: Callable[[], Array]  # its values, which cost as much as some steps of the motion

    @cached_property
    def values(self) -> Array:
        """(n_t, c), or (n_t,) of a single column."""
        return self.take()

    @property
    def said(self) -> str:
        """What it is, in words."""
        return " ".join(self.path[1:]).replace(" markers ", " ")

    @property
    def names(self) -> list[str]:
        """Of the columns as a table has them, without units."""
        return [f"{' '.join(self.path[1:])} {x}".strip() for x in self.columns]


@typed
def write_history(solution: AnySolution, path: str | Path, *, every: int = 1) -> Path:
    """Write the motion of every body and marker, the reactions and the energies.

    Positions and velocities are of the world, angular velocities of the body frame; a reaction
    acts on the second body of its joint, its moment about the second marker. Joints that leave an
    angle or a displacement have these, too. Force elements have their force along the coordinate
    of their joint, others force and moment on their last marker.

    Args:
        solution: a `rom.mbs.results.solution.Solution` with n_t instants.
        path: ``.csv`` for one table with a line per instant, or ``.h5`` (``.hdf5``) for a tree of
            arrays with their units as attributes.
        every: take every so many instants.

    Raises:
        ConfigError: for another ending, or a place that is not writable.
        ResourceError: if h5py is missing or clashes for ``.h5``, or the disk is full.
    """
    ending = Path(path).suffix.lower()
    if ending not in WRITERS:
        raise ConfigError(f"{path} has the ending {ending!r}; known: {', '.join(sorted(WRITERS))}.")
    path = check_writable(path)
    return write_whole(path, WRITERS[ending](solution, *_every(solution, every)))


def _every(solution: Any, every: int) -> tuple[Array, tuple[Channel, ...]]:
    whole("every", every, 1)
    rows = slice(None, None, every)
    t = solution.t[rows]
    return t, tuple(replace(c, take=partial(_thinned, c, rows, len(t))) for c in channels(solution))


def data_frame(solution: Any, *, every: int = 1) -> Any:
    """The table as a pandas DataFrame, indexed by time; columns are named as in the file."""
    pandas = library("pandas")
    t, found = _every(solution, every)
    values = np.hstack([c.values for c in found])
    return pandas.DataFrame(values, pandas.Index(t, name="t [s]"), _head(found))


def data_set(solution: Any, *, every: int = 1) -> Any:
    """The quantities as an xarray Dataset over "t", each with its unit as an attribute."""
    xarray = library("xarray")
    t, found = _every(solution, every)
    variables = {}
    for c in found:
        name = " ".join(c.path[1:])
        if c.columns == ("",):
            variables[name] = xarray.DataArray(c.values[:, 0], dims="t", attrs={"units": c.unit})
            continue
        across = DIMENSION_NAMES.get(c.columns, f"{name} coordinate")
        coordinates = {across: list(c.columns)}
        variables[name] = xarray.DataArray(
            c.values, coordinates, ("t", across), attrs={"units": c.unit}
        )
    return xarray.Dataset(variables, {"t": ("t", t, {"units": "s"})}, {"status": solution.status})


def channels(solution: Any) -> Iterator[Channel]:
    """All quantities of a motion: bodies, joints, force elements, energies."""
    for name, part in solution.mechanism.parts.items():
        yield from _of_body(solution, name, part)
    for joint in sorted(set(solution.packed.row_owner)):
        place, loads = ("joints", joint), cache(partial(solution.reaction, joint))
        yield Channel((*place, "force"), "N", AXIS_LETTERS, partial(_got, loads, FORCE))
        yield Channel((*place, "moment"), "N m", AXIS_LETTERS, partial(_got, loads, MOMENT))
        known = solution.mechanism.joints.get(joint)
        if known is None or known.coordinate is None:
            continue
        motion = cache(partial(solution.joint, joint))
        angle, way = ("angle", known.turn, "rad"), ("displacement", known.displacement, "m")
        for what, row, unit in (angle, way):
            if row is not None:
                for told, per in ((what, ""), (f"{what} rate", "/s")):
                    take = partial(_got, motion, attrgetter(told.replace(" ", "_")))
                    yield Channel((*place, told), f"{unit}{per}", ("",), take)
    for element in solution.elements:
        place, found = ("elements", element), solution.element(element)
        if found.on_joint:
            along = partial(np.asarray, found.along)
            yield Channel((*place, "along"), found.along_unit, ("",), along)
            continue
        for what, unit in (("force", "N"), ("moment", "N m")):
            last = partial(np.asarray, getattr(found, what)[:, -1])
            yield Channel((*place, what), unit, AXIS_LETTERS, last)
    for name in ENERGIES:
        energy = partial(getattr, solution, "energy")
        yield Channel(("energy", name), "J", ("",), partial(_got, energy, attrgetter(name)))


def _got(take: Callable[[], Any], part: Callable[[Any], Array]) -> Array:
    return part(take())


def _thinned(channel: Channel, rows: slice, n: int) -> Array:
    return channel.values[rows].reshape(n, -1)


def asked(solution: Any, names: Sequence[str]) -> list[Channel]:
    """The quantities of a motion that names ask for, as "slider", "crank pin" or "pivot angle"."""
    known, chosen = list(channels(solution)), list[Channel]()
    words = [c.said for c in known]
    for name in names or [f"{body} position" for body in solution.mechanism.parts]:
        wanted = name.replace(".", " ")
        found = [c for c, said in zip(known, words, strict=True)
                 if f"{said} ".startswith(f"{wanted} ")]  # fmt: skip
        if not found:
            text = f"the motion has no {name!r}; near are"
            raise ConfigError(f"{text} {offered(words, name)}.")
        if wanted in solution.mechanism.parts:
            found = [c for c in found if c.path[2:] in (("position",), ("velocity",))]
        chosen += found
    return chosen


def _of_body(solution: Any, name: str, part: Any) -> Iterator[Channel]:
    place, of = ("bodies", name), solution
    yield Channel((*place, "position"), "m", AXIS_LETTERS, partial(of.position, name))
    yield Channel((*place, "orientation"), "1", QUATERNION_PARTS, partial(of.orientation, name))
    yield Channel((*place, "velocity"), "m/s", AXIS_LETTERS, partial(of.velocity, name))
    yield Channel((*place, "omega"), "rad/s", AXIS_LETTERS, partial(of.omega, name))
    if part.r:
        labels = tuple(f"q{k + 1}" for k in range(part.r))
        normalised = np.allclose(part.flexible.M, np.eye(part.r), rtol=0, atol=1e-6)
        unit = "m sqrt(kg)" if normalised else "per shape"
        yield Channel((*place, "elastic"), unit, labels, partial(of.elastic, name))
    for marker in part.names:
        at, whose = (*place, "markers", marker), (name, marker)
        yield Channel((*at, "position"), "m", AXIS_LETTERS, partial(of.position, *whose))
        yield Channel((*at, "velocity"), "m/s", AXIS_LETTERS, partial(of.velocity, *whose))


def _table(solution: Any, t: Array, found: tuple[Channel, ...]) -> bytes:
    columns = np.column_stack([t, *(c.values for c in found)])
    return table(["t [s]", *_head(found)], columns, "%.17g")


def _head(found: tuple[Channel, ...]) -> list[str]:
    return [f"{name} [{c.unit}]" for c in found for name in c.names]


def table(head: list[str], values: Array, number: str) -> bytes:
    """Text of a table (n, c) below its head, with commas and quotes in names as CSV has them."""
    text = io.StringIO()
    text.write(",".join(map(csv_cell, head)) + "\n")
    np.savetxt(text, values, number, ",")
    return text.getvalue().encode()


def _tree(solution: Any, t: Array, found: tuple[Channel, ...]) -> bytes:
    hdf5, memory = h5py(".csv"), io.BytesIO()
    with hdf5.File(memory, "w", track_order=True) as file:
        file.attrs["schema"], file.attrs["version"] = "rom-history", (1, 0)
        file.attrs["status"] = solution.status
        file["time"] = t
        file["time"].attrs["unit"] = "s"
        for c in found:
            place = "/".join(quoted(word) for word in c.path)
            file[place] = c.values[:, 0] if c.columns == ("",) else c.values
            file[place].attrs["unit"] = c.unit
            if c.columns != ("",):
                file[place].attrs["columns"] = c.columns
    return memory.getvalue()


def quoted(name: str) -> str:
    """A name as a part of an HDF5 path, where a slash separates and a single dot stays."""
    return name.replace("%", "%25").replace("/", "%2F") if name.strip(".") else "%2E" * len(name)


WRITERS = {".csv": _table, ".h5": _tree, ".hdf5": _tree}
