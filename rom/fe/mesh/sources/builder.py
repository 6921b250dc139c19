"""Geometries built by a Python file; runs in the child process."""

import inspect
import sys
import traceback
from collections.abc import Callable, Iterable
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import ModuleType

from rom.errors import ConfigError, FileFormatError, MeshError, RomError
from rom.fe.mesh.solid import Made, Notes, Request
from rom.names import named


def make(gmsh: ModuleType, path: Path, request: Request) -> Made:
    """Call ``build(gmsh, **parameters)`` of the file; the parameters used, and their defaults."""
    build = getattr(_load(path), "build", None)
    if not callable(build):
        raise FileFormatError(f"{path.name} has no function build(gmsh, **parameters).")
    gmsh.model.add(path.stem)
    values, defaults = _arguments(build, request["parameters"], path)
    try:
        build(gmsh, **values)
    except (RomError, MemoryError):
        raise
    except Exception as error:
        raise MeshError(
            f"build failed at {_place(error, path)}: {error}.", hint="Mend that line of the script."
        ) from error
    plain = {name: value for name, value in values.items() if isinstance(value, str | int | float)}
    return plain, {name: x for name, x in defaults.items() if name in plain}


def _load(path: Path) -> ModuleType:
    sys.path.insert(0, str(path.parent))
    loader = SourceFileLoader(path.stem, str(path))
    module = ModuleType(path.stem)
    try:
        loader.exec_module(module)
    except MemoryError:
        raise
    except Exception as error:
        where = f"line {error.lineno}" if isinstance(error, SyntaxError) else _place(error, path)
        raise FileFormatError(
            f"the builder cannot be loaded, {where}: {type(error).__name__}: {error}."
        ) from error
    return module


def _arguments(build: Callable[..., object], given: Notes, path: Path) -> tuple[Notes, Notes]:
    """All that is handed to a builder, and its defaults."""
    known = list(inspect.signature(build).parameters.values())[1:]
    names = [p.name for p in known if p.kind is not p.VAR_KEYWORD]
    if len(names) == len(known):
        check_parameters(path, given, names)
    defaults = {p.name: p.default for p in known if p.default is not p.empty}
    if missing := sorted(set(names) - defaults.keys() - given.keys()):
        raise ConfigError(f"{path.name} needs a value for the parameter {named(missing)}.")
    return defaults | given, defaults


def check_parameters(
    path: Path, given: Iterable[str], known: Iterable[str], *, hint: str = ""
) -> None:
    """Refuse parameters that a geometry does not have, of whatever kind it is."""
    if unknown := sorted(set(given) - set(known)):
        text = f"{path.name} has no parameter {named(unknown)}; its parameters are {sorted(known)}."
        raise ConfigError(text, hint=hint)


def _place(error: Exception, path: Path) -> str:
    lines = [f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == str(path)]
    return f"{path.name}, line {lines[-1]}" if lines else path.name


def unmeshable(how: str, *, given: bool) -> MeshError:
    """What is said of a geometry without a mesh: it is a program and does what its values ask for.

    ``how`` gmsh ended, by a crash or in its own words, with the parameters ``given`` or its own.
    """
    cause = "with these parameters" if given else "with the values it holds"
    return MeshError(
        f"gmsh ended without a mesh ({how}): the geometry cannot be meshed {cause}.",
        hint="Check the element size (lc = 0?), lengths that vanish and volumes that overlap.",
    )
