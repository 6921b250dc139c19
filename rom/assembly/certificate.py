"""What shows that an assembly stands for the whole: the certificates of its parts, put together."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from rom.model import Row

MISSING_ROWS = (Row("certificate", 0.0, "> 0", False),)  # of a body that has none


def rows_of_parts(bodies: Mapping[str, Any]) -> list[Row]:
    """The lines of the certificates of all bodies, each with the name of its body in front."""
    return [
        replace(line, quantity=f"{name}: {line.quantity}")
        for name, body in bodies.items()
        for line in (MISSING_ROWS if body.certificate is None else body.certificate.rows)
    ]
