"""Mode shapes on the surface of a body, for ParaView (VTK XML, unstructured grid)."""

import base64
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from rom.body.flexible import FlexibleBody
from rom.errors import ConfigError
from rom.io.files import write_whole

TRIANGLE = 5  # VTK's number of this cell
TYPES = {"<f8": "Float64", "<i8": "Int64", "|u1": "UInt8"}


def write_vtu(body: FlexibleBody, path: str | Path) -> Path:
    """Write the outer surface with one displacement field per elastic coordinate.

    Args:
        body: a body with a surface.
        path: file ending in ``.vtu``.

    Raises:
        ConfigError: if the body has no surface, or the place is not writable.
    """
    if body.surface is None:
        raise ConfigError(f"body {body.name!r} has no surface to draw.")
    text = _document(body)
    write_whole(path, lambda file: file.write(text.encode()))
    return Path(path)


def _document(body: FlexibleBody) -> str:
    surface = body.surface
    assert surface is not None
    n, t = surface.points.shape[0], surface.triangles.shape[0]
    shapes = surface.shape.reshape(n, 3, -1)
    fields = [
        _array(f"{label}, {omega / (2 * np.pi):.6g} Hz", shapes[:, :, k])
        for k, (label, omega) in enumerate(zip(body.labels, body.omega, strict=True))
    ]
    cells = [
        _array("connectivity", surface.triangles.ravel()),
        _array("offsets", 3 * np.arange(1, t + 1)),
        _array("types", np.full(t, TRIANGLE, dtype=np.uint8)),
    ]
    return "\n".join(
        [
            '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" '
            'header_type="UInt64">',
            f'<UnstructuredGrid><Piece NumberOfPoints="{n}" NumberOfCells="{t}">',
            "<Points>",
            _array("points", surface.points),
            "</Points>",
            "<Cells>",
            *cells,
            "</Cells>",
            "<PointData>",
            *fields,
            "</PointData>",
            "</Piece></UnstructuredGrid></VTKFile>",
            "",
        ]
    )


def _array(name: str, values: Any) -> str:
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
