"""Files are looked at before they are read."""

import os
import stat
from pathlib import Path

from rom.errors import FileFormatError, UnsafeFileError

MAX_FILE_BYTES = 2**32  # of a file that is still read


def check_readable(path: str | Path, largest: int = MAX_FILE_BYTES) -> Path:
    """The path, if it is a file that may be read and is not too large."""
    path = Path(path)
    try:
        found = path.stat()
    except (OSError, ValueError) as error:  # also names that no file can have
        raise FileFormatError(
            "there is no such file.", where=str(path), hint="Relative paths start where you are."
        ) from error
    if stat.S_ISDIR(found.st_mode):
        raise FileFormatError("this is a folder, not a file.", where=str(path))
    if not stat.S_ISREG(found.st_mode):
        raise FileFormatError("there is no such file, but a pipe or device.", where=str(path))
    if not os.access(path, os.R_OK):
        raise FileFormatError("the file may not be read by you.", where=str(path))
    if found.st_size > largest:
        raise UnsafeFileError(f"the file is larger than {largest / 2**20:g} MiB.", where=str(path))
    return path
