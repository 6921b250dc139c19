"""Compiled code kept on disk, and what killed runs have left there."""

import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rom.doctor.finding import Finding
from rom.places import PACKAGE

REMOVE_COMMAND = "rom doctor --fix"
AT_WORK = 60.0  # seconds after which nobody is still writing a temporary file
END_OF_PICKLE = b"."


def caches(forms: dict[str, Any], *, fix: bool) -> list[Finding]:
    """State of the cache of compiled forms and of Numba's.

    Args:
        forms: what the probe says about the cache of forms; empty without dolfinx.
        fix: remove damaged files; those of forms have been removed by the probe.
    """
    found = [_forms(forms, fix)] if "path" in forms else []
    damaged = [path for folder in numba_folders() for path in damaged_files(folder)]
    if fix:
        for path in damaged:
            path.unlink(missing_ok=True)
    return [*found, _finding("compiled by Numba", "", damaged, fix)]


def _forms(forms: dict[str, Any], fix: bool) -> Finding:
    if not forms["writable"]:
        value = f"{forms['path']} cannot be written; forms are compiled in every run"
        return Finding("caches", "compiled forms", value, "note", f"chown it: {forms['path']}")
    return _finding("compiled forms", forms["path"], forms["stale"], fix)


def _finding(name: str, where: str, damaged: list[Any], fix: bool) -> Finding:
    if not damaged:
        return Finding("caches", name, f"{where} healthy".strip())
    if fix:
        return Finding("caches", name, f"{len(damaged)} damaged files removed {where}".strip())
    value = f"{len(damaged)} damaged files, e.g. {damaged[0]}"
    return Finding("caches", name, value, "note", REMOVE_COMMAND)


def numba_folders() -> Iterator[Path]:
    """Where Numba may keep what it compiled for rom."""
    own = os.environ.get("NUMBA_CACHE_DIR")
    if own:
        yield Path(own)
    yield PACKAGE


def damaged_files(folder: Path) -> Iterator[Path]:
    """Index and code files that end in the middle, and temporary ones nobody writes any more."""
    for path in sorted(folder.rglob("*.nb[ic]*")):
        try:
            if ".tmp." in path.name:
                damaged = time.time() - path.stat().st_mtime > AT_WORK
            else:
                damaged = path.read_bytes()[-1:] != END_OF_PICKLE
        except OSError:
            continue
        if damaged:
            yield path
