"""The body file: one ``.npz`` without pickle, with a manifest that says what is inside.

The manifest is a JSON text stored as bytes: schema and version, units, names, provenance,
certificate, and the SHA-256 of every array. A reader needs NumPy and this page only.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix

from rom.arguments import symmetric
from rom.body.flexible import FlexibleBody
from rom.body.nonlinear.cauchy import CauchyRecovery
from rom.body.nonlinear.quartic import Quartic
from rom.body.nonlinear.sampled import Sampled
from rom.body.records import Marker, Patch, Surface
from rom.body.recovery import StressRecovery
from rom.errors import ConfigError, FileFormatError, QualityGateError, in_file
from rom.io.archive import MAX_BYTES, Kind, read_archive, stated, write_archive
from rom.model import FILE_FRAME, Array, Report, Row
from rom.names import named
from rom.units import SYSTEMS

SCHEMA_NAME = "rom-body"
VERSION = (1, 7)  # a new major number breaks readers, a new minor number only adds
FIELDS = ("first_moment", "inertia", "S", "Ibar_kl", "S_kl", "K", "D", "omega")
MARKER_ARRAYS = ("point", "translation", "rotation", "hold")  # arrays of each
SURFACE_ARRAYS = ("points", "triangles", "shape")
QUARTIC_ARRAYS = ("cubic", "quartic")
SIX_KINDS = ("rbe2", "rbe3")  # interfaces of six coordinates
KINDS = (*SIX_KINDS, "full", "polynomial", "fourier", "snapshots", "characteristic")
FRAMES = ("mean-axis", "buckens", FILE_FRAME, "as in its SID")  # beside interfaces, pins and 3-2-1
LIMIT_DIGITS = 1e-5  # to which limits are written
CAUCHY_ARRAYS = ("points", "gradient", "stiffness", "node", "material", "share")


def save(body: FlexibleBody, path: str | Path) -> Path:
    """Write a flexible body; see `rom.save`."""
    return write_archive(path, body_manifest(body), body_arrays(body), f"body {body.name!r}")


def load(path: str | Path, *, limit: int = MAX_BYTES) -> FlexibleBody:
    """Read a flexible body, and no family; see `rom.load`."""
    return read(Path(path), {}, limit)[0]


def read(
    path: Path, others: dict[str, tuple[int, int]], limit: int
) -> tuple[FlexibleBody, dict[str, Any], dict[str, Array]]:
    """The body of a file, whose schema may be one of others, its manifest and arrays."""
    kind = Kind({SCHEMA_NAME: VERSION} | others, "body file", FIELDS)
    manifest, arrays = read_archive(path, kind, limit)
    with in_file(path):
        _check_numbers(manifest, arrays)
        with stated(path):
            body = body_of(manifest, arrays)
        _verify(body)
    return body, manifest, arrays


def _check_numbers(manifest: dict[str, Any], arrays: dict[str, Array]) -> None:
    if (units := manifest.get("units")) not in list(SYSTEMS):
        raise FileFormatError(f"the unit system {units!r} is unknown; known: {sorted(SYSTEMS)}.")
    for name, A in arrays.items():
        with np.errstate(over="ignore"):
            squares = np.square(A, dtype=float)
        if not np.isfinite(squares).all():
            what = "whose square is not" if np.isfinite(A).all() else "that is not"
            text = f"{name} holds a number {what} finite."
            hint = "Look where the body was computed: no force or motion follows from it."
            raise QualityGateError(text, hint=hint)


def body_arrays(body: FlexibleBody) -> dict[str, Array]:
    """The arrays of a body by their names in the file."""
    if isinstance(body.quartic, Sampled):
        text = f"body {body.name!r} has the energy of sampled elements, which no file holds"
        raise ConfigError(f"{text}; reduce it where it is used, or leave sampling out.")
    arrays = _parts("", body, (*FIELDS, "mass"))
    arrays |= {f"K_geo/{name}": A for name, A in body.K_geo.items()}
    arrays |= _parts("quartic/", body.quartic, QUARTIC_ARRAYS)
    for i, marker in enumerate(body.markers.values()):
        place = f"marker/{i}/"
        arrays |= _parts(place, marker, MARKER_ARRAYS) | _patch_arrays(place, marker.patch)
        arrays |= _parts(place, marker, ("covariance",))
    arrays |= _parts("surface/", body.surface, SURFACE_ARRAYS)
    stress = CAUCHY_ARRAYS if isinstance(body.stress, CauchyRecovery) else ("points", "operator")
    arrays |= _parts("stress/", body.stress, (*stress, "inertial"))
    whole = {name: A.dtype.kind == "i" for name, A in arrays.items()}
    return {name: np.asarray(A, np.int64 if whole[name] else float) for name, A in arrays.items()}


def _parts(place: str, thing: Any, names: Sequence[str]) -> dict[str, Array]:
    """Arrays of a record by their names in the file, of those that it has."""
    found = ((name, getattr(thing, name, None)) for name in names)
    return {f"{place}{name}": np.asarray(A) for name, A in found if A is not None}


def _patch_arrays(place: str, patch: Patch | None) -> dict[str, Array]:
    if patch is None:
        return {}
    S = coo_matrix(patch.surface_mass)
    area = {f"{place}area": S.data, f"{place}area_nodes": np.array([S.row, S.col])}
    return _parts(place, patch, ("points",)) | area | _parts(place, patch, ("shapes",))


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
        "schema": SCHEMA_NAME,
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
    for fault in _faults(manifest, arrays):
        raise ValueError(fault)
    markers = {
        m["name"]: Marker(
            name=m["name"],
            kind=m["kind"],
            **{part: arrays[f"marker/{i}/{part}"] for part in MARKER_ARRAYS},
            patch=_patch(arrays, f"marker/{i}"),
            covariance=arrays.get(f"marker/{i}/covariance"),  # of large deflection, from 1.6 on
        )
        for i, m in enumerate(manifest["markers"])
    }
    parts: Any = (arrays[f"surface/{part}"] for part in SURFACE_ARRAYS)
    surface = Surface(*parts) if manifest["surface"] else None
    quartic = None  # bodies of small deflection have none, and so have older files
    if "quartic/cubic" in arrays:
        quartic = Quartic(arrays["K"], *(arrays[f"quartic/{part}"] for part in QUARTIC_ARRAYS))
    return FlexibleBody(
        name=manifest["name"],
        mass=arrays["mass"].item(),
        **{name: arrays[name] for name in FIELDS},
        K_geo={name: arrays[f"K_geo/{name}"] for name in manifest["geometric_stiffness"]},
        quartic=quartic,
        markers=markers,
        surface=surface,
        stress=_stress(arrays),
        labels=tuple(manifest["labels"]),
        reference=manifest["reference"],
        units=manifest["units"],
        provenance=manifest["provenance"],
        certificate=report_of(manifest["certificate"]),
    )


def report_of(entry: dict[str, Any] | None) -> Report | None:
    """The report of a manifest, each row judged anew by its value and its limit."""
    if entry is None:
        return None
    rows = tuple(Row(**row) for row in entry["rows"])
    for row in rows:
        words = row.quantity, row.limit, entry["title"]
        plain = all(isinstance(word, str) for word in words) and isinstance(row.ok, bool)
        if not plain or type(row.value) not in (int, float) or not row.limited:
            raise ValueError(f"the row {row.quantity!r:.60}: {row.value!r:.30}, {row.limit!r:.30}")
    judged = (replace(row, ok=row.ok and row.excess <= LIMIT_DIGITS) for row in rows)
    return Report(entry["title"], tuple(judged))


def _stress(arrays: dict[str, Array]) -> StressRecovery | CauchyRecovery | None:
    """Bodies whose stress is not recovered have none; at large deflection, from 1.7 on."""
    if "stress/points" not in arrays:
        return None
    if "stress/gradient" in arrays:
        parts: Any = {part: arrays[f"stress/{part}"] for part in CAUCHY_ARRAYS}
        return CauchyRecovery(**parts)
    operator, inertial = arrays["stress/operator"], arrays.get("stress/inertial")
    return StressRecovery(arrays["stress/points"], operator, inertial)


def _faults(manifest: dict[str, Any], arrays: dict[str, Array]) -> Iterator[str]:
    """Arrays that are promised and missing, and words of another type or meaning; see `stated`."""
    markers, loads = manifest["markers"], manifest["geometric_stiffness"]
    needed = [f"marker/{i}/{part}" for i in range(len(markers)) for part in MARKER_ARRAYS]
    needed += [f"K_geo/{name}" for name in loads]
    needed += [f"surface/{part}" for part in SURFACE_ARRAYS] if manifest["surface"] else []
    if missing := [name for name in needed if name not in arrays]:
        yield f"the array {named(missing)}"
    wanted = {"name": str, "reference": str, "labels": list, "surface": bool, "provenance": dict}
    for name, kind in wanted.items():
        if not isinstance(manifest[name], kind):
            yield f"{name} = {manifest[name]!r}"
    labels, r = manifest["labels"], arrays["K"].shape[-1]
    if len(labels) != r or not all(isinstance(label, str) for label in labels):
        yield f"labels = {labels!r}"
    still = manifest["provenance"].get("reduction", {}).get("static shapes", True)
    if type(still) is not bool:
        yield f"static shapes = {still!r}"
    names, reference = [m["name"] for m in markers], manifest["reference"]
    for known in (names, loads):
        if len(set(known)) < len(known) or not all(isinstance(name, str) for name in known):
            yield f"names {known!r}"
    name = f"({'|'.join(map(re.escape, names))})"  # with blanks, perhaps
    held = names and re.fullmatch(f"pins {name} {name}|3-2-1 {name} {name} {name}", reference)
    if reference not in (*FRAMES, *names) and not held:
        yield f"reference = {reference!r}, which must be {named(FRAMES)}, or of {names}"
    for kind in (m["kind"] for m in markers):
        if kind.split(":")[0] not in KINDS:
            yield f"the kind of interface {kind!r}, none of {', '.join(KINDS)}"


def _verify(body: FlexibleBody) -> None:
    """Shapes that belong together and matrices a body can have."""
    for misfit in _misfits(body, body.K.shape[0] if body.K.ndim == 2 else -1):
        raise FileFormatError(f"{misfit}.")
    matrices = {f"the geometric stiffness {load!r}": A for load, A in body.K_geo.items()}
    for name, A in ({"K": body.K, "D": body.D, "inertia": body.inertia} | matrices).items():
        symmetric(name, A, 1e-10)
    if body.omega.min(initial=0.0) < 0.0:
        raise QualityGateError("each frequency of the coordinates must be >= 0.")
    if body.mass <= 0 or (body.n_modes and np.linalg.eigvalsh(body.M)[0] <= 0):
        raise QualityGateError("the mass must be positive definite.")


def _misfits(body: FlexibleBody, r: int) -> Iterator[str]:
    shapes = {
        "first_moment": (3,), "inertia": (3, 3), "S": (3, r), "Ibar_kl": (3, 3, r),
        "S_kl": (3, 3, r, r), "K": (r, r), "D": (r, r), "omega": (r,),
    }  # fmt: skip
    arrays = {name: (getattr(body, name), shape) for name, shape in shapes.items()}
    for load, A in body.K_geo.items():
        arrays[f"the geometric stiffness {load!r}"] = A, (r, r)
    for name, (A, shape) in arrays.items():
        if A.shape != shape:
            yield f"{name} has the shape {A.shape}, expected {shape}"
    for m in body.markers.values():
        yield from _marker_misfits(m, r)
    if body.stress is not None and not body.stress.fits(r):
        yield "the stress recovery does not fit the body"
    if (surface := body.surface) is not None:
        n, corners = len(surface.points), surface.triangles
        fits = (surface.shape.shape, corners.shape[1:]) == ((3 * n, r), (3,))
        if not fits or corners.min(initial=0) < 0 or corners.max(initial=-1) >= n:
            yield "the surface does not fit the body"
    if body.quartic is not None and not body.quartic.fits(r):
        yield f"the energy at large deflection does not fit {r} coordinates"


def _marker_misfits(m: Marker, r: int) -> Iterator[str]:
    parts = (m.point.shape, m.translation.shape, m.rotation.shape, m.hold.shape[1:])
    n_c = len(m.hold)
    six = m.kind not in SIX_KINDS or n_c >= 6  # families hold more of theirs
    if not six or parts != ((3,), (3, r), (3, r), (6 + r,)):
        yield f"marker {m.name!r} does not fit {r} coordinates"
    if m.covariance is not None and m.covariance.shape != (3, 3, 1 + r):
        yield f"the covariance of marker {m.name!r} does not fit {r} coordinates"
    if m.patch is not None:
        dofs, shapes = 3 * len(m.patch.points), m.patch.shapes
        most = 2 * dofs if m.kind.startswith("full:") else dofs
        if not dofs <= n_c <= most if shapes is None else shapes.shape != (dofs, n_c):
            yield f"the surface of marker {m.name!r} does not fit {n_c} coordinates"
