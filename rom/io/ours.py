"""What may be written: over files that rom has written before, in a folder nobody else writes in.

A file is recognised by its content, never by its name or place; two formats have room for no
mark, and are never recognised: op4 and the punch file of OpenRadioss.
"""

import fcntl
import os
import platform
import re
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from rom.errors import ConfigError, ResourceError
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
    "toml": rb"# [^\n]*" + MARK_BYTES + rb"\n",
    "csv": TABLE_HEAD + rb"[^\r\n]*\r?\n[0-9eE+.-]+,[0-9eE+.,-]*\r?\n",
    "h5": rb"\x89HDF\r\n.*rom-history",
    "glb": rb'glTF.{0,40}"asset": ?\{[^}]*"generator": ?"fenicsx-rom"',
    "vtkhdf": rb"\x89HDF\r\n.*" + MARK_BYTES,
    "json": rb'\{\s*"schema": ?"rom-(run|scene)"',
}
SAME_KIND = {"sid-pysid": "sid", "sid-geisler": "sid", "openfast-4": "openfast"}
LOCK_NAME = ".rom.lock"
MAX_OWNER_BYTES = 300


def check_replaceable(
    path: str | Path, kind: str, *, inputs: Iterable[str | Path] = (), force: bool = False
) -> Path:
    """The path, if a file of that name can be written and none of somebody else's is lost.

    Asked before a long computation. Kinds are keys of `FILE_SIGNS` or formats of `rom.export`.
    """
    path = check_writable(path)
    for source in inputs:
        if path.exists() and os.path.exists(source) and path.samefile(source):
            text = f"{path} is read as an input; it would be lost."
            raise ConfigError(text, hint="Choose another name.")
    if os.path.lexists(path) and not force and not is_ours(path, kind):
        what = (
            f"is no file of the kind {kind} that rom has written"
            if SAME_KIND.get(kind, kind) in FILE_SIGNS
            else f"files of the kind {kind} do not tell who has written them"
        )
        text = f"{path} is there already, and {what}"
        raise ConfigError(f"{text}; choose another name, or replace it with --force.")
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


@contextmanager
def claimed(folder: str | Path) -> Iterator[None]:
    """Keep other runs out of a folder, which is made if it is missing and goes if it stays empty.

    The lock is one of the system and ends with the process that holds it, however that ends. A file
    system without locks keeps nothing out.
    """
    folder = Path(folder)
    mode = 0
    with suppress(OSError):  # asked once, as other runs make and remove it
        mode = folder.stat().st_mode
    if mode and not stat.S_ISDIR(mode):
        raise ConfigError(f"{folder} is a file; a folder is needed.")
    try:
        handle = _locked(folder)
    except OSError as error:
        text = f"the folder {folder} is not writable: {error.strerror}."
        hint = "Choose another folder, or ask for the right to write there."
        raise ConfigError(text, hint=hint) from error
    try:
        yield
    finally:
        if handle is not None:
            (folder / LOCK_NAME).unlink(missing_ok=True)
            os.close(handle)
        if not mode:
            with suppress(OSError):  # something is in it, or another run has taken it
                folder.rmdir()


def _locked(folder: Path) -> int | None:
    """Descriptor of the lock, in a folder that exists then; None where locks do not work."""
    path = folder / LOCK_NAME
    while True:
        try:
            handle = os.open(path, os.O_CREAT | os.O_RDWR | os.O_NOFOLLOW, 0o666)
        except FileNotFoundError:  # not made yet, or removed by a run that has failed
            check_writable(folder.parent / LOCK_NAME)
            try:
                folder.mkdir()
            except FileExistsError:  # made by another run in between
                if folder.is_symlink():
                    raise
            continue
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            owner = os.pread(handle, MAX_OWNER_BYTES, 0).decode(errors="replace")
            os.close(handle)
            text = f"another run is writing into {folder}: {owner or 'it has just begun'}."
            raise ResourceError(text, hint="Wait for it, or choose another folder.") from None
        except OSError:
            os.close(handle)
            return None
        with suppress(FileNotFoundError):
            if os.path.samestat(path.stat(), os.fstat(handle)):
                break
        os.close(handle)  # its owner has removed it in between
    os.ftruncate(handle, 0)
    os.pwrite(handle, f"process {os.getpid()} on {platform.node()}".encode(), 0)
    return handle
