"""``python -m rom.fmu <resources>``: serve one instance of an FMU over the socket at stdin.

With a file name behind, write the variables of the FMU there, as JSON.
"""

import json
import os
import socket
import sys
import warnings
from dataclasses import asdict
from pathlib import Path

from rom.errors import RomError, RomWarning
from rom.fmu.driven import driven, serve


def main(resources: Path, *description: str) -> int:
    """Serve or describe; returns the exit code."""
    os.dup2(2, 1)  # what the mechanism prints is not an answer
    if not description:
        with socket.socket(fileno=os.dup(0)) as connection:
            serve(connection, lambda: driven(resources))
        return 0
    found: dict[str, object]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", RomWarning)
        try:
            found = {"variables": [asdict(variable) for variable in driven(resources).variables]}
        except RomError as error:
            found = {"error": error.message, "hint": error.hint}
    told = (warning for warning in caught if issubclass(warning.category, RomWarning))
    found["warnings"] = [str(warning.message) for warning in told]
    Path(description[0]).write_text(json.dumps(found))
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), *sys.argv[2:]))
