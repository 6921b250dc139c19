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
MARK_BYTES = ORIGIN_MARK.encode()
MARK_IN_COMMENT = rb".{0,200}" + MARK_BYTES  # in the first lines
TABLE_HEAD = rb'(t \[s\]),("[^"\r\n]* x \[m\]"|[^",\r\n]* x \[m\]),[^\r\n]* y \[m\]'
FILE_SIGNS = {  # kind of file: how each that rom writes begins
    "npz": rb'PK\x03\x04.{0,60}manifest\.npy.*"schema": "rom-body"',
    "vtu": rb"<VTKFile " + MARK_IN_COMMENT,
    "sid": rb"\d+ \d+ :No\. nodes, No\. modes: [^\n]*; " + MARK_BYTES + rb"\n",
    "dmig": rb"\$ " + MARK_BYTES,
    "abaqus": rb"\*\* " + MARK_BYTES + rb"\n",
    "deck": rb"\*\* " + MARK_BYTES + rb": lengths",
    "exudyn": rb'"""A flexible body for Exudyn, ' + MARK_BYTES,
    "mbdyn": rb"\*\* MBDyn MODAL DATA FILE, " + MARK_BYTES,
    "simscape": rb"MATLAB 5\.0 MAT-file, " + MARK_BYTES,
    "fmu": rb"PK\x03\x04.*" + MARK_BYTES + rb"\Z",
    "openfast": rb"! [^\n]*, " + MARK_BYTES + rb"\n",
    "png": rb"\x89PNG\r\n\x1a\n.{0,200}tEXtSoftware\x00rom.{4}\x00",
    "gif": rb"GIF8.*\x21\xfe." + MARK_BYTES,
    "mp4": rb".{4}ftyp.*" + MARK_BYTES,
    "html": rb"<!DOCTYPE html>.*<meta name='generator' content='" + MARK_BYTES,
    "csv": TABLE_HEAD + rb"[^\r\n]*\r?\n[0-9eE+.-]+,[0-9eE+.,-]*\r?\n",
    "h5": rb"\x89HDF\r\n.*rom-history",
    "glb": rb'glTF.{0,40}"asset": ?\{[^}]*"generator": ?"fenicsx-rom"',
    "vtkhdf": rb"\x89HDF\r\n.*" + MARK_BYTES,
    "json": rb'\{\s*"schema": ?"rom-(run|scene)"',
}
SAME_KIND = {
    "sid-pysid": "sid",
    "sid-geisler": "sid",
    "openfast-4": "openfast",
}


def check_replaceable(
    path: str | Path, kind: str, *, inputs: Iterable[str | Path] = (), force: bool = False
) -> Path:
    """The path, if a file of that name can be written and none of somebody else's is lost.

    To be asked before a long computation. What will be written is of a kind, a key of `FILE_SIGNS`
    or a format of `rom.export`; inputs are never written, whatever else is there if forced.
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
            if SAME_KIND.get(kind, kind) in FILE_SIGNS
            else f"files of the kind {kind} do not tell who has written them"
        )
        raise ConfigError(
            f"{path} is there already, and {what}.",
            hint="Choose another name, or replace it with --force.",
        )
    return path


def is_ours(path: Path, kind: str) -> bool:
    """Whether rom has written a file as one of a kind."""
    sign = FILE_SIGNS.get(SAME_KIND.get(kind, kind))
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
