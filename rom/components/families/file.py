"""The file of a family of bodies: the body file with one more set of arrays per term."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from rom.body.damping import ModalDamping, Rayleigh
from rom.body.flexible import FlexibleBody
from rom.body.inertia import InertiaIntegrals
from rom.body.recovery import StressRecovery
from rom.components.families.family import BodyFamily, Share
from rom.components.families.layers import Stretch
from rom.components.families.parameters import read, written
from rom.errors import FileFormatError
from rom.io import native
from rom.io.archive import stated, write_archive
from rom.model import Array

SCHEMA_NAME = "rom-family"
VERSION = (1, 1)  # counts like that of the body file
INTEGRALS = InertiaIntegrals.__slots__
STRETCH = ("axis", "regions", "layers")  # of a manifest; its rigid motions are an array
Damping = Rayleigh | ModalDamping
Entry = dict[str, Any]  # of a manifest: names, numbers and lists, as JSON has them


def save(family: BodyFamily, path: str | Path) -> Path:
    """Write a family; see `rom.save`."""
    arrays = native.body_arrays(family.body)
    for i, share in enumerate(family.shares):
        found = {name: getattr(share.integrals, name) for name in INTEGRALS} | {"K": share.K}
        if share.stress is not None:
            found["stress"] = share.stress
        arrays |= {f"share/{i}/{name}": np.asarray(A, dtype=float) for name, A in found.items()}
    if (stretch := family.stretch) is not None:
        arrays["stretch/rigid"] = np.asarray(stretch.rigid, dtype=float)
    damping, numbers = _damping(family.damping)
    arrays |= numbers
    manifest = native.body_manifest(family.body) | {
        "schema": SCHEMA_NAME,
        "version": list(VERSION),
        "parameters": written(family.parameters),
        "shares": [{"region": s.region, "fixed": s.fixed} for s in family.shares],
        "frame": family.reference,
        "damping": damping,
        "stretch": None if stretch is None else {name: getattr(stretch, name) for name in STRETCH},
        "provenance": family.provenance,
        "certificate": None if family.certificate is None else asdict(family.certificate),
    }
    return write_archive(path, manifest, arrays, f"family {family.body.name!r}")


def load(manifest: Entry, arrays: dict[str, Array], body: FlexibleBody, path: Path) -> BodyFamily:
    """The family of which a file holds a body; see `rom.load`."""
    with stated(path):
        frame = manifest["frame"]
        family = BodyFamily(
            body,
            read(manifest["parameters"]),
            tuple(_share(i, entry, arrays) for i, entry in enumerate(manifest["shares"])),
            reference=frame if isinstance(frame, str) else tuple(frame),
            damping=_damping_of(manifest["damping"], arrays),
            provenance=manifest["provenance"],
            certificate=native.report_of(manifest["certificate"]),
            stretch=_stretch(manifest["stretch"], arrays),
        )
    _verify(family, path)
    return family


def _stretch(entry: Entry | None, arrays: dict[str, Array]) -> Stretch | None:
    if entry is None:
        return None
    layers = tuple(tuple((low, high) for low, high in part) for part in entry["layers"])
    return Stretch(entry["axis"], tuple(entry["regions"]), layers, arrays["stretch/rigid"])


def _share(i: int, entry: Entry, arrays: dict[str, Array]) -> Share:
    numbers = {name: arrays[f"share/{i}/{name}"] for name in INTEGRALS if name != "mass"}
    integrals = InertiaIntegrals(mass=arrays[f"share/{i}/mass"].item(), **numbers)
    K, stress = arrays[f"share/{i}/K"], arrays.get(f"share/{i}/stress")
    return Share(entry["region"], integrals, K, stress, bool(entry["fixed"]))


def _damping(damping: Damping | None) -> tuple[Entry | None, dict[str, Array]]:
    if isinstance(damping, Rayleigh):
        return {"kind": "Rayleigh", **asdict(damping)}, {}
    if isinstance(damping, ModalDamping):
        fixed = damping.fixed  # from 1.1 on
        words = {"kind": "modal", "fixed": dict(fixed) if isinstance(fixed, dict) else list(fixed)}
        return words, {"damping/ratio": np.asarray(damping.ratio, dtype=float)}
    return None, {}


def _damping_of(entry: Entry | None, arrays: dict[str, Array]) -> Damping | None:
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
    expected: dict[str, tuple[int, ...]] = {"first_moment": (3,), "inertia": (3, 3), "S": (3, n)}
    expected |= {"Ibar_kl": (3, 3, n), "S_kl": (3, 3, n, n)}
    expected["K"] = (r, r) if stretch is None else (3, 6 + r, 6 + r)
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
            text = f"{name} has the shape {np.shape(A)}, expected {shape}."
            raise FileFormatError(text, where=str(path))
    if not family.shares or not family.parameters:
        raise FileFormatError("the family has no terms or no parameters.", where=str(path))
