"""Files for other programs, by the ending of their name."""

from pathlib import Path
from typing import Any

from rom.body.flexible import FlexibleBody
from rom.errors import ConfigError
from rom.io.native import save
from rom.io.vtu import write_vtu

WRITERS: dict[str, Any] = {".npz": save, ".vtu": write_vtu}


def export(body: FlexibleBody, path: str | Path) -> Path:
    """Write a body in the format its file name asks for.

    Args:
        body: the body.
        path: ``.vtu`` for ParaView, ``.npz`` for the native body file.

    Raises:
        ConfigError: if the ending is not known or the place is not writable.
    """
    ending = Path(path).suffix.lower()
    if ending not in WRITERS:
        raise ConfigError(f"{path} has the ending {ending!r}; known: {', '.join(sorted(WRITERS))}.")
    return WRITERS[ending](body, path)
