"""gmsh, opened with settings that give the same mesh every time; runs in the child process."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from types import ModuleType

from rom.errors import ConfigError, FileFormatError, MeshError, RomError, UnsafeFileError
from rom.fe.mesh.picks import EVERY_FACE
from rom.fe.mesh.solid import PROGRAMS, Made, Notes, Read, Request
from rom.fe.mesh.sources import builder, step
from rom.fe.mesh.sources.cad_faces import axes, faces, pick
from rom.fe.mesh.sources.gmsh_groups import check_declared, collect, triangles, version
from rom.fe.mesh.sources.script import check_script, confine
from rom.plausible import scaled_doubt

HIGHEST_ORDER = 2  # of cells, see `rom.fe.mesh.sources.gmsh_groups.SOLIDS`
HXT_ALGORITHM = 10  # Mesh.Algorithm3D whose meshes differ from run to run
NO_MEMORY = re.compile("Out of memory|bad_alloc")
# gmsh hands a file without this start to its script parser, which can run shell commands
MSH_START = (b"$MeshFormat", b"$Comments")


def run(request: Request) -> Read:
    """Answer a request for ``.geo``, ``.py``, ``.step``, ``.msh`` or ``.unv``, see `child.read`."""
    import gmsh

    path, reader = Path(request["path"]), request["reader"]
    with session(gmsh):
        if reader not in PROGRAMS:
            confine(Path(request["folder"]))
        declared = Path(request["folder"], "declared.msh")
        with complaints(gmsh):
            values, defaults = MAKERS[reader](gmsh, path, request)
        if request.get("flat"):
            return _flat(gmsh, request, values)
        if reader in ("msh", "unv"):
            declared = path
        else:
            _generate(gmsh, request, declared)
        picked = pick(gmsh, request["faces"], path.name)
        repeated = reader == "msh" and version(path) == 2
        arrays, notes = collect(
            gmsh, declared, strict=reader not in ("step", "unv"), repeated=repeated
        )
        notes["axes"] = {name: asdict(axis) for name, axis in axes(gmsh).items()}
        if EVERY_FACE in request["faces"].values():
            notes["faces"] = [asdict(face) for face in faces(gmsh)]
        notes["provenance"] = _provenance(gmsh, values) | ({"faces": picked} if picked else {})
        doubts = (scaled_doubt(name, values[name], x) for name, x in defaults.items())
        notes["warnings"] = [*notes["warnings"], *filter(None, doubts)]
        return arrays, notes


@contextmanager
def session(gmsh: ModuleType) -> Iterator[None]:
    """Run gmsh without the user's own settings, silent, on one thread."""
    gmsh.initialize([], False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("General.NumThreads", 1)
        gmsh.option.setNumber("Mesh.Algorithm3D", 1)
        gmsh.logger.start()
        yield
    finally:
        gmsh.finalize()


@contextmanager
def complaints(gmsh: ModuleType, kind: type[RomError] = FileFormatError) -> Iterator[None]:
    """Turn gmsh's exceptions into errors with its own words, file and line."""
    try:
        yield
    except (RomError, MemoryError):
        raise
    except Exception as error:  # gmsh raises bare Exception
        text = _complaint(gmsh, error)
        text = f"gmsh says: {text}." if text else "gmsh cannot read it: the file is damaged."
        raise kind(text, hint="Open the file in gmsh to see more.") from error


def _complaint(gmsh: ModuleType, error: Exception) -> str:
    """First words of gmsh on an error, without folders."""
    message = (_log(gmsh, "Error") or [str(error)])[0]
    if NO_MEMORY.search(message):
        raise MemoryError from error
    return re.sub(r"'[^']*/([^'/]*)'", r"'\1'", message).rstrip(".")


def _log(gmsh: ModuleType, kind: str) -> list[str]:
    lines = [line for line in gmsh.logger.get() if line.startswith(kind)]
    return [line.partition(":")[2].strip() for line in lines[:20]]


def _geo(gmsh: ModuleType, path: Path, request: Request) -> Made:
    if not path.read_bytes().endswith((b"\n", b"\r")):
        raise FileFormatError(
            "the last line does not end, and gmsh would drop it in silence.",
            hint="Add a newline at the end of the file.",
        )
    check_script(path)
    gmsh.open(str(path))
    known = geo_parameters(gmsh)
    chosen = {_full_name(name, known, path): v for name, v in request["parameters"].items()}
    for name, value in chosen.items():
        _set(gmsh, name, value, path, as_text=isinstance(known[name], str))
    if chosen:
        gmsh.clear()
        # the file was readable with its own values, so the new ones are at fault
        with complaints(gmsh, ConfigError):
            gmsh.open(str(path))
    values = geo_parameters(gmsh)
    return values, {name: known[name] for name in chosen if name in values}


def geo_parameters(gmsh: ModuleType) -> Notes:
    """Parameters of the open geometry that can be set from outside, with their values."""
    names = [n for n in gmsh.onelab.getNames() if not n.startswith(("Gmsh", "ONELAB", "0Modules"))]
    values = {}
    for name in sorted(names):
        found = list(gmsh.onelab.getNumber(name)) or gmsh.onelab.getString(name)
        values[name] = found[0] if len(found) else None
    return values


def _full_name(name: str, known: Notes, path: Path) -> str:
    """Name as gmsh knows it; ``L`` also finds ``Geometry/L`` when there is only one."""
    ends = [full for full in known if full.rpartition("/")[2] == name]
    full = ends[0] if name not in known and len(ends) == 1 else name
    cure = 'A .geo parameter can be set only if it has a name: x = {1.0, Name "x"}.'
    builder.check_parameters(path, [full], known, hint=cure)
    return full


def _set(gmsh: ModuleType, name: str, value: object, path: Path, *, as_text: bool) -> None:
    """Give a parameter a value of its kind."""
    if as_text and isinstance(value, str):
        gmsh.onelab.setString(name, [value])
    elif not as_text and isinstance(value, bool | int | float) and value - value == 0:
        gmsh.onelab.setNumber(name, [float(value)])
    else:
        kind = "text" if as_text else "finite number"
        raise ConfigError(f"parameter {name!r} of {path.name} must be a {kind}, got {value!r}.")


def _msh(gmsh: ModuleType, path: Path, request: Request) -> Made:
    with path.open("rb") as stream:
        start = stream.read(512)
        stream.seek(max(path.stat().st_size - 512, 0))
        end = stream.read().rstrip()
    if not start.startswith(MSH_START):
        kind = UnsafeFileError if start else FileFormatError
        raise kind(
            f"is not a gmsh mesh: it does not start with $MeshFormat but with {start[:20]!r}.",
            hint="gmsh would run it as a script.",
        )
    if not end.splitlines()[-1].strip().startswith(b"$End"):
        raise FileFormatError("is cut: the last section has no end.", hint="Write it again.")
    # parts of a version 2 file would become volumes of their own, without groups
    gmsh.option.setNumber("Mesh.PartitionConvertMsh2", 0)
    return _merged(gmsh, path, request)


def _unv(gmsh: ModuleType, path: Path, request: Request) -> Made:
    found = set(re.findall(r"^ +-1\s+(\d+)\s*$", path.read_text("latin1"), re.MULTILINE))
    if "2412" not in found:
        text = f"is no universal file with a mesh: it has the datasets {sorted(found)}, not 2412."
        raise FileFormatError(text)
    return _merged(gmsh, path, request)


def _merged(gmsh: ModuleType, path: Path, request: Request) -> Made:
    # gmsh would also execute a file of the same name with .opt; beside this link there is none
    link = Path(request["folder"], path.name)
    link.symlink_to(path)
    gmsh.merge(str(link))
    return {}, {}


def _flat(gmsh: ModuleType, request: Request, values: Notes) -> Read:
    """Triangles of the surfaces, meshed here unless the file is a mesh."""
    if request["reader"] != "msh":
        gmsh.option.setNumber("Mesh.ElementOrder", 1)
        with complaints(gmsh, MeshError):
            gmsh.model.mesh.generate(2)
    arrays, notes = triangles(gmsh)
    return arrays, notes | {"provenance": _provenance(gmsh, values)}


def _provenance(gmsh: ModuleType, values: Notes) -> Notes:
    number = gmsh.option.getString("General.Version")
    return {"gmsh": number, "parameters": values, "gmsh_warnings": _log(gmsh, "Warning")}


def _generate(gmsh: ModuleType, request: Request, declared: Path) -> None:
    """Mesh the geometry, after noting the names of all its groups."""
    if not gmsh.model.getEntities(3):
        raise MeshError("the geometry has no volume: a solid is needed.")
    gmsh.option.setNumber("General.NumThreads", 1)
    if gmsh.option.getNumber("Mesh.Algorithm3D") == HXT_ALGORITHM:
        gmsh.option.setNumber("Mesh.Algorithm3D", 1)
    if (wanted := gmsh.option.getNumber("Mesh.ElementOrder")) > HIGHEST_ORDER:
        # cells of high order take minutes to make, and no element here has them
        raise MeshError(
            f"Mesh.ElementOrder = {wanted:g}: cells have first or second order.",
            hint="Leave the order out, or write Mesh.ElementOrder = 2.",
        )
    order = request["order"] or HIGHEST_ORDER
    gmsh.option.setNumber("Mesh.ElementOrder", order)
    gmsh.write(str(declared))
    check_declared(gmsh, declared)
    if not any(len(tags) for tags in gmsh.model.mesh.getElements(3)[1]):
        try:
            gmsh.model.mesh.generate(3)
        except Exception as error:  # gmsh raises bare Exception
            given = bool(request["parameters"])
            raise builder.unmeshable(_complaint(gmsh, error), given=given) from error
    else:  # the geometry has made its mesh itself
        gmsh.model.mesh.setOrder(order)


MAKERS = {"geo": _geo, "builder": builder.make, "step": step.make, "msh": _msh, "unv": _unv}
