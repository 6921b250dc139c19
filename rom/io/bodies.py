"""Files of bodies, and of what fields make of bodies."""

from pathlib import Path
from typing import Any

from rom.arguments import AnyFamily, typed
from rom.body.flexible import FlexibleBody
from rom.fields import follow, names, taker
from rom.io import native
from rom.io.archive import MAX_BYTES


@typed
def save(body: FlexibleBody | AnyFamily, path: str | Path) -> Path:
    """Write a flexible body, or a family of them, whole or not at all, usually as ``.rom.npz``.

    Raises:
        ConfigError: if the folder is missing or not writable.
        QualityGateError: if an array holds a number that is not finite.
        ResourceError: if the disk is full.

    Example:
        >>> body = rom.load("beam.rom.npz")
        >>> file = rom.save(body, "copy.rom.npz")
        >>> rom.load("copy.rom.npz").n_modes == body.n_modes
        True
    """
    if isinstance(body, FlexibleBody):
        return native.save(body, path)
    written: Path = taker("save", body).save(body, path)
    return written


@typed
def load(path: str | Path, *, limit: int = MAX_BYTES) -> Any:
    """Read a flexible body, or a family of them.

    Args:
        path: file written by `save`.
        limit: bytes the arrays may take in memory.

    Raises:
        FileFormatError: if the file is missing, cut, changed, or no body file.
        UnsafeFileError: if it asks for more memory than the limit or holds anything but numbers.
        QualityGateError: if the numbers are not those of a body.

    Example:
        >>> round(rom.load("beam.rom.npz").mass, 6)  # steel, 1 m x 50 mm x 30 mm
        11.775
    """
    path = Path(path)
    loads = {name: place for name, place in names("takes").items() if name.startswith("load.")}
    others = {name.removeprefix("load."): follow(place) for name, place in loads.items()}
    versions = {name: module.VERSION for name, module in others.items()}
    body, manifest, arrays = native.read(path, versions, limit)
    other = others.get(manifest["schema"])
    return body if other is None else other.load(manifest, arrays, body, path)
