"""The file of a family of bodies: the body file with one more set of arrays per term."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from rom.arguments import typed
from rom.body.damping import ModalDamping, Rayleigh
from rom.body.flexible import FlexibleBody
from rom.body.inertia import InertiaIntegrals
from rom.body.recovery import StressRecovery
from rom.errors import FileFormatError
from rom.io import native
from rom.io.archive import MAX_BYTES, Kind, stated, write_archive
from rom.model import Array
from rom.parametric.family import BodyFamily, Share
from rom.parametric.layers import Stretch
from rom.parametric.parameters import read, written

SCHEMA_NAME = "rom-family"
VERSION = (1, 1)  # counts like that of the body file
INTEGRALS = InertiaIntegrals.__slots__


@typed
def save(body: FlexibleBody | BodyFamily, path: str | Path) -> Path:
    """Write a flexible body, or a family of them, whole or not at all.

    Args:
        body: what to write.
        path: file name, usually ending in ``.rom.npz``.

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
    arrays = native.body_arrays(body.body)
    for i, share in enumerate(body.shares):
        found = {name: getattr(share.integrals, name) for name in INTEGRALS} | {"K": share.K}
        if share.stress is not None:
            found["stress"] = share.stress
        arrays |= {f"share/{i}/{name}": np.asarray(A, dtype=float) for name, A in found.items()}
    if body.stretch is not None:
        arrays["stretch/rigid"] = np.asarray(body.stretch.rigid, dtype=float)
    damping, numbers = _damping(body.damping)
    arrays |= numbers
    manifest = native.body_manifest(body.body) | {
        "schema": SCHEMA_NAME,
        "version": list(VERSION),
        "parameters": written(body.parameters),
        "shares": [{"region": s.region, "fixed": s.fixed} for s in body.shares],
        "frame": body.reference,
        "damping": damping,
        "stretch": _layers(body.stretch),
        "provenance": body.provenance,
        "certificate": None if body.certificate is None else asdict(body.certificate),
    }
    return write_archive(path, manifest, arrays, f"family {body.body.name!r}")


@typed
def load(path: str | Path, *, limit: int = MAX_BYTES) -> Any:
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

    Example:
        >>> round(rom.load("beam.rom.npz").mass, 6)  # steel, 1 m x 50 mm x 30 mm
        11.775
    """
    path = Path(path)
    known = Kind(
        {native.SCHEMA_NAME: native.VERSION, SCHEMA_NAME: VERSION}, "body file", native.FIELDS
    )
    manifest, arrays = native.read_finite(path, known, limit)
    with stated(path):
        body = native.body_of(manifest, arrays)
    native.verify(body, path)
    if manifest["schema"] == native.SCHEMA_NAME:
        return body
    with stated(path):
        family = _family(manifest, arrays, body)
    _verify(family, path)
    return family


def _family(manifest: dict[str, Any], arrays: dict[str, Array], body: FlexibleBody) -> BodyFamily:
    frame = manifest["frame"]
    return BodyFamily(
        body,
        read(manifest["parameters"]),
        tuple(_share(i, entry, arrays) for i, entry in enumerate(manifest["shares"])),
        reference=frame if isinstance(frame, str) else tuple(frame),
        damping=_damping_of(manifest["damping"], arrays),
        provenance=manifest["provenance"],
        certificate=native.report_of(manifest["certificate"]),
        stretch=_stretch(manifest["stretch"], arrays),
    )


def _layers(stretch: Stretch | None) -> dict[str, Any] | None:
    if stretch is None:
        return None
    return {
        "axis": stretch.axis,
        "regions": list(stretch.regions),
        "layers": [[list(ends) for ends in layers] for layers in stretch.layers],
    }


def _stretch(entry: dict[str, Any] | None, arrays: dict[str, Array]) -> Stretch | None:
    if entry is None:
        return None
    layers = tuple(tuple((low, high) for low, high in part) for part in entry["layers"])
    return Stretch(entry["axis"], tuple(entry["regions"]), layers, arrays["stretch/rigid"])


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
        fixed = damping.fixed  # from 1.1 on
        words = {"kind": "modal", "fixed": dict(fixed) if isinstance(fixed, dict) else list(fixed)}
        return words, {"damping/ratio": np.asarray(damping.ratio, dtype=float)}
    return None, {}


def _damping_of(
    entry: dict[str, Any] | None, arrays: dict[str, Array]
) -> Rayleigh | ModalDamping | None:
    if entry is None:
        return None
    if entry["kind"] == "Rayleigh":
        return Rayleigh(entry["alpha"], entry["beta"])
    ratio, fixed = arrays["damping/ratio"], entry.get("fixed", ())
    fixed = fixed if isinstance(fixed, dict) else tuple(fixed)
    return ModalDamping(ratio.item() if ratio.size == 1 else ratio, fixed)


def _verify(family: BodyFamily, path: Path) -> None:
    """Shares that fit the body."""
    r, stretch = family.body.n_modes, family.stretch
    n = r if stretch is None else len(stretch.rigid) + 6 + r
    expected: dict[str, tuple[int, ...]] = {
        "first_moment": (3,), "inertia": (3, 3), "S": (3, n), "Ibar_kl": (3, 3, n),
        "S_kl": (3, 3, n, n), "K": (r, r) if stretch is None else (3, 6 + r, 6 + r),
    }  # fmt: skip
    if isinstance(family.body.stress, StressRecovery):
        expected["stress"] = family.body.stress.operator.shape
    found = [
        (f"{name} of term {i}", getattr(share, name, getattr(share.integrals, name, None)), shape)
        for i, share in enumerate(family.shares)
        for name, shape in expected.items()
    ]
    if stretch is not None:
        found.append(("rigid", stretch.rigid, (2 + len(stretch.regions), 6 + r, 6)))
    for name, A, shape in found:
        if A is not None and np.shape(A) != shape:
            raise FileFormatError(
                f"{name} has the shape {np.shape(A)}, expected {shape}.", where=str(path)
            )
    if not family.shares or not family.parameters:
        raise FileFormatError("the family has no terms or no parameters.", where=str(path))
