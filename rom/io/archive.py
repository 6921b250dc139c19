"""Arrays and a manifest in one ``.npz`` without pickle, with a checksum of every array."""

import hashlib
import json
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tokenize import TokenError
from typing import IO, Any, NamedTuple

import numpy as np
from numpy.lib import format as npy

from rom.errors import ConfigError, FileFormatError, QualityGateError, UnsafeFileError, in_file
from rom.io.files import MAX_FILE_BYTES, check_readable, damaged, write_whole
from rom.model import Array
from rom.names import named

MESH_ADVICE = "rom.fe.model reads geometries and meshes; rom.reduce makes a body of what it gives."
MATRIX_ADVICE = (
    "rom.read_model reads stiffness and mass with their nodes; rom.reduce makes a body of it."
)
READER_ADVICE = {  # ending: what reads such a file
    **dict.fromkeys(".geo .msh .step .stp .brep .inp .bdf .cdb .med .py".split(), MESH_ADVICE),
    **dict.fromkeys(
        ".op4 .mtx .mm .pch .dmig .dat .sti .mas .op2 .full .mnf".split(), MATRIX_ADVICE
    ),
    **dict.fromkeys((".unv", ".uff"), "rom.io.read_responses and rom.io.read_modes read tests."),
    ".sid_fem": "rom.read_sid reads its blocks; rom export FILE.SID_FEM BODY.rom.npz makes a body.",
    ".fem": "rom export FILE.fem BODY.rom.npz makes a body of one of MBDyn.",
    ".toml": "rom.read_mechanism reads mechanisms, rom.read_component reads components.",
}
MAX_BYTES = 4 * 1024**3  # that the arrays may have in memory before reading is refused
LARGER_HINT = "If it is yours, pass a larger limit to load."


class Kind(NamedTuple):
    """What a file must be."""

    schemas: dict[str, tuple[int, int]]  # {schema: version} that can be read
    what: str  # what to call such a file
    needed: tuple[str, ...]  # arrays that must be there


def write_archive(
    path: str | Path, manifest: dict[str, Any], arrays: dict[str, Array], what: str
) -> Path:
    """Write a file, whole or not at all; messages say ``what`` the arrays are of."""
    for name, A in arrays.items():
        if not np.isfinite(A).all():
            raise QualityGateError(f"{name} of {what} must be finite; nothing was written.")
    manifest = manifest | {"sha256": {name: digest(A) for name, A in arrays.items()}}
    text = np.frombuffer(json.dumps(manifest, sort_keys=True).encode(), dtype=np.uint8)

    def write(file: IO[bytes]) -> None:
        with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
            for name, A in {"manifest": text, **arrays}.items():
                # a fixed date: the same content gives the same bytes
                info = zipfile.ZipInfo(f"{name}.npy", date_time=(1980, 1, 1, 0, 0, 0))
                with archive.open(info, "w", force_zip64=True) as member:
                    npy.write_array(member, np.ascontiguousarray(A), allow_pickle=False)

    return write_whole(path, write)


def read_archive(
    path: str | Path, kind: Kind, limit: int = MAX_BYTES
) -> tuple[dict[str, Any], dict[str, Array]]:
    """Manifest and arrays of a file of a kind, within a limit of memory, its checksums compared."""
    path = check_readable(path, max(limit, MAX_FILE_BYTES))
    try:
        with in_file(path), zipfile.ZipFile(path) as archive:
            refuse_hostile(archive, limit)
            manifest = _read_manifest(archive, kind)
            digests, there = _digests(manifest, kind), archive.namelist()
            if missing := [name for name in sorted(digests) if f"{name}.npy" not in there]:
                text = f"the file lacks the array {named(missing)} of its manifest."
                hint = "It may have been changed after writing; write or copy it again."
                raise FileFormatError(text, hint=hint)
            arrays = {name: read_array(archive, name) for name in sorted(digests)}
    except (zipfile.BadZipFile, OSError, EOFError, KeyError, RuntimeError) as e:
        cut = "It may have been cut in a transfer; write or copy it again."
        hint, what = READER_ADVICE.get(path.suffix.lower(), cut), f"a complete {kind.what} ({e})"
        raise FileFormatError(f"this is not {what}.", where=str(path), hint=hint) from e
    for name, A in arrays.items():
        if digests[name] != digest(A):
            raise FileFormatError(f"the array {name!r} was changed after writing.", where=str(path))
    return manifest, arrays


@contextmanager
def stated(path: str | Path) -> Iterator[None]:
    """Turn what a wrong manifest causes into an error that names the file."""
    with in_file(path):
        try:
            yield
        except ConfigError as error:
            raise FileFormatError(error.message, hint=error.hint) from error
        except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
            raise FileFormatError(f"the manifest lacks or misstates {error}.") from error


def digest(A: Array) -> str:
    """SHA-256 of type, shape and content."""
    A = np.ascontiguousarray(A)
    return hashlib.sha256(f"{A.dtype.str}{A.shape}".encode() + A.tobytes()).hexdigest()


def refuse_hostile(archive: zipfile.ZipFile, limit: int, hint: str = LARGER_HINT) -> None:
    """What fills the memory, or is written elsewhere by whoever unpacks it by other means."""
    total = sum(info.file_size for info in archive.infolist())
    if total > limit:
        text = f"the file unpacks to {total / 1e9:.2f} GB, above the limit of {limit / 1e9:.2f} GB."
        raise UnsafeFileError(text, hint=hint)
    for name in archive.namelist():
        if name.startswith("/") or "\\" in name or ".." in name.split("/"):
            raise UnsafeFileError(f"the member {name[:60]!r} leads elsewhere.")


def read_array(archive: zipfile.ZipFile, name: str, *, any_order: bool = False) -> Array:
    """One array, by rows or in any order; its header is checked before memory is taken."""
    info = archive.getinfo(f"{name}.npy")
    try:
        with archive.open(info) as member:
            if npy.read_magic(member) == (1, 0):
                shape, fortran, dtype = npy.read_array_header_1_0(member)
            else:
                shape, fortran, dtype = npy.read_array_header_2_0(member)
    except (ValueError, SyntaxError, TypeError, TokenError) as error:
        raise FileFormatError(f"the array {name!r} has a broken header.") from error
    if dtype.str not in ("<f8", "<i8", "|u1"):
        raise UnsafeFileError(
            f"the array {name!r} has the type {dtype.str}; such a file holds 8-byte numbers."
        )
    n_bytes = int(np.prod(shape, dtype=object)) * dtype.itemsize
    if (fortran and not any_order) or n_bytes > info.file_size:
        what = f"claims {n_bytes} bytes but has {info.file_size}"
        raise UnsafeFileError(f"the array {name!r} {what}.")
    with archive.open(info) as member, damaged(f"the array {name!r} is cut"):
        return npy.read_array(member, allow_pickle=False)


def _read_manifest(archive: zipfile.ZipFile, kind: Kind) -> dict[str, Any]:
    if "manifest.npy" not in archive.namelist():
        raise FileFormatError(f"this archive is not a {kind.what}: it has no manifest.")
    try:
        manifest = json.loads(read_array(archive, "manifest").tobytes())
        schema, (major, minor) = manifest["schema"], manifest["version"]
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise FileFormatError(f"the manifest cannot be read: {error}.") from error
    known = kind.schemas.get(schema) if isinstance(schema, str) else None
    numbers = type(major) is int and type(minor) is int and minor >= 0
    if known is None or major != known[0] or not numbers:
        each = " or ".join(f"{name!r} {list(version)}" for name, version in kind.schemas.items())
        text = f"the file has the schema {schema!r} {manifest['version']}; it was to be {each}."
        raise FileFormatError(text, hint="Newer files need a newer program." if known else "")
    return manifest


def _digests(manifest: dict[str, Any], kind: Kind) -> dict[str, str]:
    digests = manifest.get("sha256")
    if not isinstance(digests, dict):
        raise FileFormatError(f"the manifest does not list the arrays of a {kind.what}.")
    if missing := [name for name in kind.needed if name not in digests]:
        raise FileFormatError(f"the manifest of the {kind.what} lists no array {named(missing)}.")
    return digests
