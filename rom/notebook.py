"""How records show themselves in notebooks: short tables, everything escaped, figures in frames."""

import html
from collections.abc import Iterable, Sequence
from typing import Any

from rom.errors import RomError
from rom.fields import follow

MAX_ROWS = 20  # rows shown


def html_table(title: str, header: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """A title and a table in HTML; beyond `MAX_ROWS` rows it says how many there are."""
    listed = list(rows)
    lines = [_line("td", row) for row in listed[:MAX_ROWS]]
    if len(listed) > MAX_ROWS:
        more = f"and {len(listed) - MAX_ROWS} more"
        lines.append(f"<tr><td colspan='{len(header)}'>{more}</td></tr>")
    head = f"<thead>{_line('th', header)}</thead>" if any(header) else ""
    return (
        f"<div><b>{html.escape(title)}</b>"
        f"<table>{head}<tbody>{''.join(lines)}</tbody></table></div>"
    )


def with_figure(shown: object, table: str) -> str:
    """The table of a body or a motion, below its figure that turns where there is one."""
    try:
        return f"{follow('rom.report.viewer:in_notebook')(shown)}{table}"
    except (ImportError, RomError):  # a library is missing, or the body has no surface
        return table


def _line(tag: str, cells: Sequence[Any]) -> str:
    return "<tr>" + "".join(f"<{tag}>{_text(cell)}</{tag}>" for cell in cells) + "</tr>"


def _text(value: Any) -> str:
    number = hasattr(value, "__float__") and not isinstance(value, int | bool)
    return html.escape(f"{float(value):.5g}" if number else str(value))


def listed(names: Iterable[str]) -> str:
    """Names with commas, the first eight of them."""
    words = [str(name) for name in names]
    more = f", and {len(words) - 8} more" if len(words) > 8 else ""
    return ", ".join(words[:8]) + more if words else "none"
