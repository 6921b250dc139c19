"""The file of a family of bodies: the body file with one more set of arrays per term."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from rom.body.damping import ModalDamping, Rayleigh
from rom.body.family import BodyFamily, Share
from rom.body.flexible import FlexibleBody
from rom.body.inertia import InertiaIntegrals
from rom.errors import FileFormatError
from rom.io import native
from rom.model import Array, Report, Row
from rom.parameters import read, written

SCHEMA = "rom-family"
VERSION = (1, 0)  # counts like that of the body file
INTEGRALS = InertiaIntegrals.__slots__


def save(body: FlexibleBody | BodyFamily, path: str | Path) -> Path:
    """Write a flexible body, or a family of them, whole or not at all.

    Args:
        body: what to write.
        path: file name, usually ending in ``.rom.npz``.

    Raises:
        ConfigError: if the folder is missing or not writable.
        QualityGateError: if an array holds a number that is not finite.
        ResourceError: if the disk is full.
    """
    if isinstance(body, FlexibleBody):
        return native.save(body, path)
    arrays = native.body_arrays(body.body)
    for i, share in enumerate(body.shares):
        found = {name: getattr(share.integrals, name) for name in INTEGRALS} | {"K": share.K}
        if share.stress is not None:
            found["stress"] = share.stress
        arrays |= {f"share/{i}/{name}": np.asarray(A, dtype=float) for name, A in found.items()}
    damping, numbers = _damping(body.damping)
    arrays |= numbers
    manifest = native.body_manifest(body.body) | {
        "schema": SCHEMA,
        "version": list(VERSION),
        "parameters": written(body.parameters),
        "shares": [{"region": s.region, "fixed": s.fixed} for s in body.shares],
        "frame": body.reference,
        "damping": damping,
        "provenance": body.provenance,
        "certificate": None if body.certificate is None else asdict(body.certificate),
    }
    return native.write_archive(path, manifest, arrays, f"family {body.body.name!r}")


def load(path: str | Path, *, limit: int = native.LIMIT) -> Any:
    """Read a flexible body, or a family of them.

    Args:
        path: file written by `save`.
        limit: bytes the arrays may take in memory.

    Returns:
        FlexibleBody or BodyFamily.

    Raises:
        FileFormatError: if the file is missing, cut, changed, or no body file.
        UnsafeFileError: if it asks for more memory than the limit or holds anything but numbers.
        QualityGateError: if the numbers are not those of a body.
    """
    path = Path(path)
    known = {native.SCHEMA: native.VERSION, SCHEMA: VERSION}
    manifest, arrays = native.read_archive(path, known, limit)
    with native.stated(path):
        body = native.body_of(manifest, arrays)
    native.verify(body, path)
    if manifest["schema"] == native.SCHEMA:
        return body
    with native.stated(path):
        family = _family(manifest, arrays, body)
    _verify(family, path)
    return family


def _family(manifest: dict[str, Any], arrays: dict[str, Array], body: FlexibleBody) -> BodyFamily:
    report, frame = manifest["certificate"], manifest["frame"]
    if report is not None:
        report = Report(report["title"], tuple(Row(**row) for row in report["rows"]))
    return BodyFamily(
        body,
        read(manifest["parameters"]),
        tuple(_share(i, entry, arrays) for i, entry in enumerate(manifest["shares"])),
        reference=frame if isinstance(frame, str) else tuple(frame),
        damping=_damping_of(manifest["damping"], arrays),
        provenance=manifest["provenance"],
        certificate=report,
    )


def _share(i: int, entry: dict[str, Any], arrays: dict[str, Array]) -> Share:
    numbers: dict[str, Any] = {name: arrays[f"share/{i}/{name}"] for name in INTEGRALS}
    integrals = InertiaIntegrals(**numbers | {"mass": numbers["mass"].item()})
    K, stress = arrays[f"share/{i}/K"], arrays.get(f"share/{i}/stress")
    return Share(entry["region"], integrals, K, stress, bool(entry["fixed"]))


def _damping(
    damping: Rayleigh | ModalDamping | None,
) -> tuple[dict[str, Any] | None, dict[str, Array]]:
    if isinstance(damping, Rayleigh):
        return {"kind": "Rayleigh", **asdict(damping)}, {}
    if isinstance(damping, ModalDamping):
        return {"kind": "modal"}, {"damping/ratio": np.asarray(damping.ratio, dtype=float)}
    return None, {}


def _damping_of(
    entry: dict[str, Any] | None, arrays: dict[str, Array]
) -> Rayleigh | ModalDamping | None:
    if entry is None:
        return None
    if entry["kind"] == "Rayleigh":
        return Rayleigh(entry["alpha"], entry["beta"])
    ratio = arrays["damping/ratio"]
    return ModalDamping(ratio.item() if ratio.size == 1 else ratio)


def _verify(family: BodyFamily, path: Path) -> None:
    """Shares that fit the body."""
    body = family.body
    for i, share in enumerate(family.shares):
        pairs = {name: (getattr(share.integrals, name), getattr(body, name)) for name in INTEGRALS}
        pairs["K"] = (share.K, body.K)
        if body.stress is not None and share.stress is not None:
            pairs["stress"] = (share.stress, body.stress.operator)
        for name, (part, whole) in pairs.items():
            if np.shape(part) != np.shape(whole):
                raise FileFormatError(
                    f"{name} of term {i} has the shape {np.shape(part)}, "
                    f"expected {np.shape(whole)}.",
                    where=str(path),
                )
    if not family.shares or not family.parameters:
        raise FileFormatError("the family has no terms or no parameters.", where=str(path))
