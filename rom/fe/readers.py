"""The readers, by name; runs in the child process of `rom.fe.child`."""

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from rom.errors import FileFormatError, ResourceError, RomError
from rom.model import Array, Integers

GEOMETRIES = ("geo", "builder", "step")
Arrays = dict[str, npt.NDArray[Any]]
Read = tuple[Arrays, dict[str, Any]]  # arrays and notes
Made = tuple[dict[str, Any], dict[str, Any]]  # parameters used, defaults of some of them


def read(request: dict[str, Any]) -> Read:
    """Read or make the mesh a request asks for.

    Returns:
        Arrays ``points``, ``cells``, ``regions``, ``cell_ids`` and ``facets 0``, ``facets 1``, ...;
        notes ``cell_type``, ``region_names``, ``facet_names``, ``provenance``, ``warnings``.
    """
    try:
        return _reader(request["reader"])(request)
    except (RomError, MemoryError):
        raise
    except ModuleNotFoundError as error:
        raise ResourceError(
            f"reading this file needs {error.name}, which is not installed.",
            hint=f"On Debian: apt-get install python3-{error.name}.",
        ) from error
    # parsers raise whatever the broken line provokes, and meshio leaves the process
    except (Exception, SystemExit) as error:
        if request["reader"] in GEOMETRIES:
            raise
        raise FileFormatError(
            f"is not a readable {request['reader']} file ({type(error).__name__}: {error})."
        ) from error


def _reader(name: str) -> Callable[[dict[str, Any]], Read]:
    """The reading function; only its own libraries are loaded."""
    if name == "abaqus":
        from rom.fe import abaqus

        return lambda request: abaqus.read(request["path"])
    if name == "nastran":
        from rom.fe import nastran

        return lambda request: nastran.read(request["path"])
    from rom.fe import gmsh_session

    return gmsh_session.run


def packed(
    points: Array,
    cells: Integers,
    cell_type: str,
    regions: Integers,
    cell_ids: Integers,
    **notes: Any,
) -> Read:
    """Arrays and notes in the form of `read`; ``facets`` and ``region_names`` among the notes."""
    facets = notes.pop("facets")
    arrays: Arrays = {
        "points": np.asarray(points, dtype=float),
        "cells": np.asarray(cells, dtype=np.int64),
        "regions": np.asarray(regions, dtype=np.int64),
        "cell_ids": np.asarray(cell_ids, dtype=np.int64),
    }
    for i, rows in enumerate(facets.values()):
        arrays[f"facets {i}"] = np.asarray(rows, dtype=np.int64)
    return arrays, notes | {"cell_type": cell_type, "facet_names": list(facets)}
