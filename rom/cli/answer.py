"""What a verb gives back: the same content for people and for programs."""

import json
import math
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, field
from typing import Any

from rom.model import Report

Data = dict[str, Any]  # for ``--json``: plain numbers, texts, lists, dictionaries


@dataclass(frozen=True, slots=True)
class Answer:
    """Result of a verb; nothing is printed or written before the verb has come to its end."""

    data: Data
    text: str  # for people
    write: Callable[[], object] | None = None  # makes the output files, on one rank
    failed: tuple[str, ...] = field(default=())  # what did not hold: exit code 5


def table(header: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Columns of text, the first flush left and the others flush right."""
    lines = [list(header), *map(list, rows)]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return "\n".join(
        "  ".join(
            cell.ljust(w) if k == 0 else cell.rjust(w)
            for k, (cell, w) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in lines
    )


def report_data(report: Report) -> Data:
    """A report for ``--json``."""
    return {"title": report.title, "ok": report.ok, "rows": [asdict(row) for row in report.rows]}


def failures(report: Report) -> tuple[str, ...]:
    """The rows that do not hold, as sentences."""
    return tuple(f"{r.quantity} = {r.value:.5g}, limit {r.limit}" for r in report.failures)


def to_json(data: object) -> str:
    """Strict JSON: numbers that are not finite become null."""
    return json.dumps(_strict(data), indent=2, ensure_ascii=False, default=_plain)


def _strict(value: object) -> object:
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, dict):
        return {str(key): _strict(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_strict(item) for item in value]
    return value


def _plain(value: object) -> object:
    return _strict(value.tolist()) if hasattr(value, "tolist") else str(value)
