"""Mode shapes on the surface of a body, and meshes, for ParaView (VTK XML, unstructured grid)."""

import base64
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated
from xml.sax.saxutils import quoteattr

import numpy as np
import numpy.typing as npt

from rom.arguments import AnySolution, Count, typed
from rom.body.flexible import FlexibleBody
from rom.body.records import Surface
from rom.body.recovery import von_mises
from rom.errors import ConfigError
from rom.io.files import write_whole
from rom.model import Array, Index
from rom.names import ORIGIN_MARK, check_ending

VTK_TRIANGLE = 5  # number of this cell type
Values = npt.NDArray[np.generic]
Fields = Mapping[str, Values]
TYPES = {"<f8": "Float64", "<i8": "Int64", "|u1": "UInt8"}


def write_vtu(body: FlexibleBody, path: str | Path) -> Path:
    """Write the outer surface with one displacement field per elastic coordinate, as ``.vtu``.

    Raises:
        ConfigError: if the body has no surface, or the place is not writable.
    """
    if body.surface is None:
        raise ConfigError(f"body {body.name!r} has no surface; to be drawn it needs a meshed one.")
    surface = body.surface
    shapes = surface.shape.reshape(surface.points.shape[0], 3, -1)
    modes = zip(body.labels, body.omega / (2 * np.pi), strict=True)
    fields = {f"{name}, {f:.6g} Hz": shapes[:, :, k] for k, (name, f) in enumerate(modes)}
    return write_whole(path, _drawn(surface, fields))


@typed
def write_stress(
    body: FlexibleBody, q: Array, path: str | Path, *, accelerations: Array | None = None
) -> Path:
    """Write the outer surface with displacement, stress and von Mises stress.

    Args:
        body: a body reduced with ``stress=True``.
        q: (r,) elastic coordinates, in units of the body's shapes.
        path: file ending in ``.vtu``.
        accelerations: (6 + r,) see `rom.body.recovery.StressRecovery`; None for statics.

    Raises:
        ConfigError: if the stress of the body cannot be recovered, q has another length, or the
            place is not writable.
    """
    if body.stress is None or body.surface is None:
        text = f"the stress of body {body.name!r} cannot be recovered"
        raise ConfigError(f"{text}; reduce it with stress=True.")
    return write_whole(path, _stressed(body.surface, q, body.stress.field(q, accelerations)))


@typed
def write_stress_history(
    solution: AnySolution, body: str, path: str | Path, *, every: Annotated[int, Count(1)] = 1
) -> Path:
    """Write stress and displacement of a moving body as a series for ParaView.

    In the axes of the body. The series is written last, so that it never names a missing file.

    Args:
        solution: a `rom.mbs.results.solution.Solution`.
        body: name of a body reduced with ``stress=True``.
        path: file ending in ``.pvd``; its instants go into a folder beside it with its stem.
        every: take every so many instants.

    Raises:
        ConfigError: if the stress of the body cannot be recovered, or the place is not writable.
    """
    path = check_ending(path, "a motion", ".pvd")
    part = solution.mechanism.part(body)
    folder, lines = path.with_suffix(""), []
    for k in range(0, solution.t.size, every):
        stress = solution.stress(body, k)
        folder.mkdir(parents=True, exist_ok=True)
        file = folder / f"{folder.name}_{k:06d}.vtu"
        write_whole(file, _stressed(part.flexible.surface, solution.elastic(body)[k], stress))
        name = quoteattr(f"{folder.name}/{file.name}")
        lines.append(f'<DataSet timestep="{float(solution.t[k])!r}" file={name}/>')
    series = "\n".join(
        ['<VTKFile type="Collection" version="1.0"><Collection>', *lines, "</Collection></VTKFile>"]
    )
    return write_whole(path, f"{series}\n".encode())


def _stressed(surface: Surface, q: Array, stress: Array) -> bytes:
    motion = (surface.shape @ np.asarray(q, dtype=float)).reshape(-1, 3)
    fields = {
        "stress xx yy zz yz xz xy [Pa]": stress,
        "von Mises stress [Pa]": von_mises(stress),
        "displacement [m]": motion,
    }
    return _drawn(surface, fields)


def _drawn(surface: Surface, fields: Fields) -> bytes:
    return grid(surface.points, surface.triangles, VTK_TRIANGLE, at_points=fields).encode()


def grid(
    points: Array,
    cells: Index,
    kind: int,
    *,
    at_points: Fields | None = None,
    at_cells: Fields | None = None,
) -> str:
    """Text of a file with cells (m, k) of one kind, VTK's number and order of it.

    Values are {name: (n,) or (n, c)} at points, {name: (m,) or (m, c)} at cells.
    """
    m, k = cells.shape
    topology = {
        "connectivity": cells.ravel(),
        "offsets": k * np.arange(1, m + 1),
        "types": np.full(m, kind, dtype=np.uint8),
    }
    head = (
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" '
        'header_type="UInt64">'
    )
    return "\n".join(
        [
            head,
            f"<!-- {ORIGIN_MARK} -->",
            f'<UnstructuredGrid><Piece NumberOfPoints="{len(points)}" NumberOfCells="{m}">',
            *_section("Points", {"points": points}),
            *_section("Cells", topology),
            *_section("PointData", at_points or {}),
            *_section("CellData", at_cells or {}),
            "</Piece></UnstructuredGrid></VTKFile>",
            "",
        ]
    )


def _section(name: str, arrays: Fields) -> list[str]:
    return [f"<{name}>", *(_array(key, values) for key, values in arrays.items()), f"</{name}>"]


def _array(name: str, values: Values) -> str:
    values = np.ascontiguousarray(values)
    values = values.astype(values.dtype.newbyteorder("<"))
    data = values.tobytes()
    coded = base64.b64encode(len(data).to_bytes(8, "little") + data).decode()
    kind = TYPES[values.dtype.str]
    components = values.shape[1] if values.ndim == 2 else 1
    return (
        f'<DataArray type="{kind}" Name={quoteattr(name)} NumberOfComponents="{components}" '
        f'format="binary">{coded}</DataArray>'
    )
