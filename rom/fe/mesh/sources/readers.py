"""The readers, by name; runs in the child process of `rom.fe.mesh.child`."""

from collections.abc import Callable
from importlib import import_module
from typing import Any

from rom.errors import FileFormatError, ResourceError, RomError
from rom.fe import GMSH_LIBRARIES
from rom.fe.mesh.solid import GEOMETRIES, Read


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
            hint=f"On Debian: apt-get install python3-{error.name}; else pip install {error.name}.",
        ) from error
    except OSError as error:
        if request["reader"] not in GEOMETRIES or ".so" not in str(error):
            raise
        raise ResourceError(
            f"gmsh cannot be loaded: {error}.", hint=f"On Debian: apt-get install {GMSH_LIBRARIES}."
        ) from error
    except Exception as error:  # parsers raise whatever the broken line provokes
        if request["reader"] in GEOMETRIES:
            raise
        raise FileFormatError(
            f"is not a readable {request['reader']} file ({type(error).__name__}: {error})."
        ) from error


def _reader(name: str) -> Callable[[dict[str, Any]], Read]:
    """The reading function; only its own libraries are loaded."""
    if name in ("abaqus", "nastran"):
        read_deck = import_module(f"rom.fe.mesh.sources.{name}").read
        return lambda request: read_deck(request["path"])
    from rom.fe.mesh.sources.gmsh_session import run

    return run
