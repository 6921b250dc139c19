"""The variables of an FMU, and the reading of them by one number."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Variable:
    """A real variable; its place in the list is its value reference.

    Attributes:
        name: e.g. ``rod.b.position[1]``.
        causality: "parameter", "input" or "output".
        unit: e.g. "m/s".
        start: value at the start; None for outputs, which follow from the others.
        description: one phrase.
    """

    name: str
    causality: str
    unit: str
    start: float | None = None
    description: str = ""


def structured(*parts: str) -> str:
    """A name of the structured naming convention: what is no identifier is put in quotes."""
    return ".".join(part if _plain(part) else _quoted(part) for part in parts)


def _plain(part: str) -> bool:
    return part.isascii() and part.isidentifier()


def _quoted(part: str) -> str:
    kept = "".join(c if c.isascii() and c.isprintable() else "_" for c in part)
    for mark in ("\\", "'", '"'):
        kept = kept.replace(mark, "\\" + mark)
    return f"'{kept}'"
