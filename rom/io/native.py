"""The body file: one ``.npz`` without pickle, with a manifest that says what is inside.

The manifest is a JSON text stored as bytes: schema and version, units, names, provenance,
certificate, and the SHA-256 of every array. A reader needs NumPy and this page only.
"""

import hashlib
import json
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np
from numpy.lib import format as npy
from scipy.sparse import coo_matrix, csr_matrix

from rom.body.flexible import FlexibleBody, Marker, Patch, Surface
from rom.body.recovery import STATES, StressRecovery
from rom.errors import FileFormatError, QualityGateError, UnsafeFileError
from rom.io.files import write_whole
from rom.model import Array, Report, Row
from rom.units import SYSTEMS

SCHEMA = "rom-body"
VERSION = (1, 3)  # a new major number breaks readers, a new minor number only adds
LIMIT = 4 * 1024**3  # bytes a body may have in memory before reading is refused
FIELDS = ("first_moment", "inertia", "S", "Ibar_kl", "S_kl", "K", "D", "omega")


def save(body: FlexibleBody, path: str | Path) -> Path:
    """Write a flexible body, whole or not at all.

    Args:
        body: what to write.
        path: file name, usually ending in ``.rom.npz``.

    Raises:
        ConfigError: if the folder is missing or not writable.
        QualityGateError: if an array holds a number that is not finite.
        ResourceError: if the disk is full.
    """
    return write_archive(path, body_manifest(body), body_arrays(body), f"body {body.name!r}")


def write_archive(
    path: str | Path, manifest: dict[str, Any], arrays: dict[str, Array], what: str
) -> Path:
    """Write a manifest and arrays, whole or not at all; see `save` for what is raised."""
    for name, A in arrays.items():
        if not np.isfinite(A).all():
            raise QualityGateError(f"{name} of {what} is not finite; nothing was written.")
    manifest = manifest | {"sha256": {name: _digest(A) for name, A in arrays.items()}}
    text = np.frombuffer(json.dumps(manifest, sort_keys=True).encode(), dtype=np.uint8)

    def write(file: Any) -> None:
        with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
            for name, A in {"manifest": text, **arrays}.items():
                # a fixed date: the same body gives the same bytes
                info = zipfile.ZipInfo(f"{name}.npy", date_time=(1980, 1, 1, 0, 0, 0))
                with archive.open(info, "w", force_zip64=True) as member:
                    npy.write_array(member, np.ascontiguousarray(A), allow_pickle=False)

    write_whole(path, write)
    return Path(path)


def load(path: str | Path, *, limit: int = LIMIT) -> FlexibleBody:
    """Read a flexible body.

    Args:
        path: file written by `save`.
        limit: bytes the arrays may take in memory.

    Raises:
        FileFormatError: if the file is missing, cut, changed, or no body file.
        UnsafeFileError: if it asks for more memory than the limit or holds anything but numbers.
        QualityGateError: if the numbers are not those of a body.
    """
    path = Path(path)
    manifest, arrays = read_archive(path, {SCHEMA: VERSION}, limit)
    with stated(path):
        body = body_of(manifest, arrays)
    verify(body, path)
    return body


def read_archive(
    path: Path, schemas: dict[str, tuple[int, int]], limit: int
) -> tuple[dict[str, Any], dict[str, Array]]:
    """The manifest and the arrays of a file, every array as it was written.

    Args:
        path: the file.
        schemas: {schema: version} that can be read.
        limit: bytes the arrays may take in memory.

    Raises:
        FileFormatError, UnsafeFileError, QualityGateError: see `load`.
    """
    if not path.is_file():
        raise FileFormatError("there is no such file.", where=str(path))
    try:
        with zipfile.ZipFile(path) as archive:
            _refuse_oversize(archive, path, limit)
            manifest = _read_manifest(archive, path, schemas)
            arrays = {n: _read(archive, n, path) for n in sorted(_digests(manifest, path))}
    except (
        zipfile.BadZipFile,
        OSError,
        EOFError,
        KeyError,
        RuntimeError,
        NotImplementedError,
    ) as e:
        raise FileFormatError(
            f"this is not a complete body file ({e}).",
            where=str(path),
            hint="It may have been cut in a transfer; write or copy it again.",
        ) from e
    for name, A in arrays.items():
        if manifest["sha256"][name] != _digest(A):
            raise FileFormatError(f"the array {name!r} was changed after writing.", where=str(path))
        if not np.isfinite(A).all():
            raise QualityGateError(f"{name} holds a number that is not finite.", where=str(path))
    return manifest, arrays


@contextmanager
def stated(path: Path) -> Iterator[None]:
    """Turn what a wrong manifest causes into an error that names the file."""
    try:
        yield
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        raise FileFormatError(
            f"the manifest lacks or misstates {error}.", where=str(path)
        ) from error


def body_arrays(body: FlexibleBody) -> dict[str, Array]:
    """The arrays of a body by their names in the file."""
    arrays = {name: getattr(body, name) for name in FIELDS}
    arrays["mass"] = np.array(body.mass)
    for name, A in body.K_geo.items():
        arrays[f"K_geo/{name}"] = A
    for i, marker in enumerate(body.markers.values()):
        for part in ("point", "translation", "rotation", "hold"):
            arrays[f"marker/{i}/{part}"] = getattr(marker, part)
        arrays |= {f"marker/{i}/{part}": A for part, A in _patch_arrays(marker.patch).items()}
    if body.surface is not None:
        for part in ("points", "triangles", "shape"):
            arrays[f"surface/{part}"] = getattr(body.surface, part)
    if body.stress is not None:
        for part in ("points", "operator"):
            arrays[f"stress/{part}"] = getattr(body.stress, part)
        if body.stress.inertial is not None:
            arrays["stress/inertial"] = body.stress.inertial
    return {
        n: np.asarray(A, dtype=np.int64 if A.dtype.kind == "i" else float)
        for n, A in arrays.items()
    }


def _patch_arrays(patch: Patch | None) -> dict[str, Array]:
    if patch is None:
        return {}
    S = coo_matrix(patch.surface_mass)
    arrays = {"points": patch.points, "area": S.data, "area_nodes": np.array([S.row, S.col])}
    return arrays if patch.shapes is None else arrays | {"shapes": patch.shapes}


def _patch(arrays: dict[str, Array], place: str) -> Patch | None:
    """The surface of an interface; files of version 1.0 have none."""
    if f"{place}/points" not in arrays:
        return None
    points, nodes = arrays[f"{place}/points"], arrays[f"{place}/area_nodes"]
    S = csr_matrix((arrays[f"{place}/area"], tuple(nodes)), shape=(len(points),) * 2)
    return Patch(points, S, arrays.get(f"{place}/shapes"))


def body_manifest(body: FlexibleBody) -> dict[str, Any]:
    """What the file says of a body in words."""
    return {
        "schema": SCHEMA,
        "version": list(VERSION),
        "name": body.name,
        "units": body.units,
        "reference": body.reference,
        "labels": list(body.labels),
        "markers": [{"name": m.name, "kind": m.kind} for m in body.markers.values()],
        "geometric_stiffness": list(body.K_geo),
        "surface": body.surface is not None,
        "provenance": body.provenance,
        "certificate": None if body.certificate is None else asdict(body.certificate),
    }


def body_of(manifest: dict[str, Any], arrays: dict[str, Array]) -> FlexibleBody:
    """The body that a file describes."""
    markers = {
        m["name"]: Marker(
            name=m["name"],
            kind=m["kind"],
            **{p: arrays[f"marker/{i}/{p}"] for p in ("point", "translation", "rotation", "hold")},
            patch=_patch(arrays, f"marker/{i}"),
        )
        for i, m in enumerate(manifest["markers"])
    }
    parts: Any = (arrays[f"surface/{part}"] for part in ("points", "triangles", "shape"))
    surface = Surface(*parts) if manifest["surface"] else None
    stress = None  # bodies whose stress is not recovered have none, and so have older files
    if "stress/points" in arrays:
        stress = StressRecovery(
            arrays["stress/points"], arrays["stress/operator"], arrays.get("stress/inertial")
        )
    report = manifest["certificate"]
    if report is not None:
        report = Report(report["title"], tuple(Row(**row) for row in report["rows"]))
    return FlexibleBody(
        name=manifest["name"],
        mass=arrays["mass"].item(),
        **{name: arrays[name] for name in FIELDS},
        K_geo={name: arrays[f"K_geo/{name}"] for name in manifest["geometric_stiffness"]},
        markers=markers,
        surface=surface,
        stress=stress,
        labels=tuple(manifest["labels"]),
        reference=manifest["reference"],
        units=manifest["units"],
        provenance=manifest["provenance"],
        certificate=report,
    )


def _digest(A: Array) -> str:
    A = np.ascontiguousarray(A)
    return hashlib.sha256(f"{A.dtype.str}{A.shape}".encode() + A.tobytes()).hexdigest()


def _refuse_oversize(archive: zipfile.ZipFile, path: Path, limit: int) -> None:
    total = sum(info.file_size for info in archive.infolist())
    if total > limit:
        raise UnsafeFileError(
            f"the file unpacks to {total / 1e9:.2f} GB, above the limit of {limit / 1e9:.2f} GB.",
            where=str(path),
            hint="If it is yours, pass a larger limit to load.",
        )


def _read(archive: zipfile.ZipFile, name: str, path: Path) -> Array:
    """One array; the header is compared with the size of the member before memory is taken."""
    info = archive.getinfo(f"{name}.npy")
    try:
        with archive.open(info) as member:
            version = npy.read_magic(member)
            read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
            shape, fortran, dtype = read(member)
    except (ValueError, SyntaxError, TypeError, TokenError) as error:
        raise FileFormatError(
            f"the array {name!r} has a broken header.", where=str(path)
        ) from error
    if dtype.str not in ("<f8", "<i8", "|u1"):
        raise UnsafeFileError(
            f"the array {name!r} has the type {dtype.str}; a body file holds 8-byte numbers.",
            where=str(path),
        )
    n_bytes = int(np.prod(shape, dtype=object)) * dtype.itemsize
    if fortran or n_bytes > info.file_size:
        raise UnsafeFileError(
            f"the array {name!r} claims {n_bytes} bytes but has {info.file_size}.", where=str(path)
        )
    with archive.open(info) as member:
        try:
            return npy.read_array(member, allow_pickle=False)
        except ValueError as error:
            raise FileFormatError(
                f"the array {name!r} is cut: {error}.", where=str(path)
            ) from error


def _read_manifest(
    archive: zipfile.ZipFile, path: Path, schemas: dict[str, tuple[int, int]]
) -> dict[str, Any]:
    if "manifest.npy" not in archive.namelist():
        raise FileFormatError(
            "this archive is not a body file: it has no manifest.", where=str(path)
        )
    try:
        manifest = json.loads(_read(archive, "manifest", path).tobytes())
        schema, (major, _) = manifest["schema"], manifest["version"]
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise FileFormatError(f"the manifest cannot be read: {error}.", where=str(path)) from error
    if schema not in schemas or major != schemas[schema][0]:
        known = " and ".join(f"{name!r} {list(version)}" for name, version in schemas.items())
        raise FileFormatError(
            f"the file has the schema {schema!r} {manifest['version']}; it was to be {known}.",
            where=str(path),
            hint="Newer files need a newer program, families rom.load.",
        )
    if manifest.get("units") not in SYSTEMS:
        raise FileFormatError(
            f"the unit system {manifest.get('units')!r} is unknown; known: {sorted(SYSTEMS)}.",
            where=str(path),
        )
    return manifest


def _digests(manifest: dict[str, Any], path: Path) -> dict[str, str]:
    digests = manifest.get("sha256")
    if not isinstance(digests, dict) or not set(FIELDS) <= set(digests):
        raise FileFormatError("the manifest does not list the arrays of a body.", where=str(path))
    return digests


def verify(body: FlexibleBody, path: Path) -> None:
    """Shapes that belong together and matrices a body can have."""
    r = body.K.shape[0] if body.K.ndim == 2 else -1
    shapes = {
        "first_moment": (3,), "inertia": (3, 3), "S": (3, r), "Ibar_kl": (3, 3, r),
        "S_kl": (3, 3, r, r), "K": (r, r), "D": (r, r), "omega": (r,),
    }  # fmt: skip
    for name, shape in shapes.items():
        if getattr(body, name).shape != shape:
            raise FileFormatError(
                f"{name} has the shape {getattr(body, name).shape}, expected {shape}.",
                where=str(path),
            )
    for m in body.markers.values():
        parts = (m.point.shape, m.translation.shape, m.rotation.shape, m.hold.shape[1:])
        if parts != ((3,), (3, r), (3, r), (6 + r,)):
            raise FileFormatError(
                f"marker {m.name!r} does not fit {r} coordinates.", where=str(path)
            )
        _verify_patch(m, path)
    if body.stress is not None:
        n, A = body.stress.points.shape[0], body.stress.inertial
        fits = body.stress.points.shape == (n, 3) and body.stress.operator.shape == (6 * n, r)
        if not fits or (A is not None and A.shape != (6 * n, STATES + r)):
            raise FileFormatError("the stress recovery does not fit the body.", where=str(path))
    if body.surface is not None:
        n = body.surface.points.shape[0]
        triangles = body.surface.triangles
        if body.surface.shape.shape != (3 * n, r) or not (
            triangles.size == 0 or (triangles.min() >= 0 and triangles.max() < n)
        ):
            raise FileFormatError("the surface does not fit the body.", where=str(path))
    _verify_stiffening(body, path)
    for name, A in (("K", body.K), ("D", body.D), ("inertia", body.inertia)):
        if np.abs(A - A.T).max(initial=0.0) > 1e-10 * np.abs(A).max(initial=1e-300):
            raise QualityGateError(f"{name} is not symmetric.", where=str(path))
    if body.mass <= 0 or (r and np.linalg.eigvalsh(body.M)[0] <= 0):
        raise QualityGateError("the mass is not positive definite.", where=str(path))


def _verify_stiffening(body: FlexibleBody, path: Path) -> None:
    for load, A in body.K_geo.items():
        if A.shape != body.K.shape:
            raise FileFormatError(
                f"the geometric stiffness {load!r} has the shape {A.shape}, expected "
                f"{body.K.shape}.",
                where=str(path),
            )
        if not np.allclose(A, A.T, rtol=0, atol=1e-10 * np.abs(A).max(initial=0.0)):
            raise QualityGateError(
                f"the geometric stiffness {load!r} is not symmetric.", where=str(path)
            )


def _verify_patch(marker: Marker, path: Path) -> None:
    if marker.patch is None:
        return
    dofs, n_c = 3 * marker.patch.points.shape[0], marker.hold.shape[0]
    shapes = marker.patch.shapes
    if (n_c != dofs) if shapes is None else (shapes.shape != (dofs, n_c)):
        raise FileFormatError(
            f"the surface of marker {marker.name!r} does not fit {n_c} coordinates.",
            where=str(path),
        )
