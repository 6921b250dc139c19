"""Which files may be replaced: those that rom has written before, as files of the same kind.

A file is recognised by its content, never by its name or place; two formats have room for no
mark, and are never recognised: op4 and the punch file of OpenRadioss.
"""

import os
import re
from collections.abc import Iterable
from pathlib import Path

from rom.errors import ConfigError
from rom.io.files import check_writable
from rom.names import ORIGIN_MARK

HEAD_BYTES, TAIL_BYTES = 2**20, 64  # that are looked at
MARKED = ORIGIN_MARK.encode()
COMMENT = rb".{0,200}" + MARKED  # in the first lines
NAMED_X = rb'(t \[s\]),("[^"\r\n]* x \[m\]"|[^",\r\n]* x \[m\]),[^\r\n]* y \[m\]'


def _archive(schema: str) -> bytes:
    return rb'PK\x03\x04.{0,60}manifest\.npy.*"schema": "' + schema.encode() + rb'"'


SIGNS = {  # kind of file: how each that rom writes begins
    "npz": _archive("rom-body"),
    "vtu": rb"<VTKFile " + COMMENT,
    "sid": rb"\d+ \d+ :No\. nodes, No\. modes: [^\n]*; " + MARKED + rb"\n",
    "dmig": rb"\$ " + MARKED,
    "abaqus": rb"\*\* " + MARKED + rb"\n",
    "deck": rb"\*\* " + MARKED + rb": lengths",
    "exudyn": rb'"""A flexible body for Exudyn, ' + MARKED,
    "mbdyn": rb"\*\* MBDyn MODAL DATA FILE, " + MARKED,
    "simscape": rb"MATLAB 5\.0 MAT-file, " + MARKED,
    "fmu": rb"PK\x03\x04.*" + MARKED + rb"\Z",
    "openfast": rb"! [^\n]*, " + MARKED + rb"\n",
    "png": rb"\x89PNG\r\n\x1a\n.{0,200}tEXtSoftware\x00rom.{4}\x00",
    "gif": rb"GIF8.*\x21\xfe." + MARKED,
    "html": rb"<!DOCTYPE html>.*<meta name='generator' content='" + MARKED,
    "csv": NAMED_X + rb"[^\r\n]*\r?\n[0-9eE+.-]+,[0-9eE+.,-]*\r?\n",
    "h5": rb"\x89HDF\r\n.*rom-history",
    "glb": rb'glTF.{0,40}"asset": ?\{[^}]*"generator": ?"fenicsx-rom"',
    "vtkhdf": rb"\x89HDF\r\n.*" + MARKED,
    "json": rb'\{\s*"schema": "rom-run"',
}
SAME = {
    "sid-pysid": "sid",
    "sid-geisler": "sid",
    "openfast-4": "openfast",
}


def check_replaceable(
    path: str | Path, kind: str, *, inputs: Iterable[str | Path] = (), force: bool = False
) -> Path:
    """The path, if a file of that name can be written and none of somebody else's is lost.

    To be asked before a long computation.

    Args:
        path: file to write.
        kind: of what will be written: a key of `SIGNS`, or the name of a format of `rom.export`.
        inputs: files that are read; these are never written.
        force: replace whatever else is there.

    Raises:
        ConfigError: if there is a file that rom did not write as one of this kind, it is an input,
            or the place is not writable.
    """
    path = check_writable(path)
    for source in inputs:
        if path.exists() and os.path.exists(source) and path.samefile(source):
            raise ConfigError(
                f"{path} is read as an input; it would be lost.", hint="Choose another name."
            )
    if os.path.lexists(path) and not force and not is_ours(path, kind):
        what = (
            f"is no file of the kind {kind} that rom has written"
            if SAME.get(kind, kind) in SIGNS
            else f"files of the kind {kind} do not tell who has written them"
        )
        raise ConfigError(
            f"{path} is there already, and {what}.",
            hint="Choose another name, or replace it with --force.",
        )
    return path


def is_ours(path: Path, kind: str) -> bool:
    """Whether rom has written a file as one of a kind."""
    sign = SIGNS.get(SAME.get(kind, kind))
    if sign is None or not path.is_file():
        return False
    try:
        with path.open("rb") as file:
            head = file.read(HEAD_BYTES)
            file.seek(max(len(head), file.seek(0, os.SEEK_END) - TAIL_BYTES))
            content = head + file.read()
    except OSError:
        return False
    return re.match(sign, content, re.DOTALL) is not None
