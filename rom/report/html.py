"""A report in one HTML file that needs nothing else: text, tables, checks and pictures inside."""

import base64
import html
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rom.arguments import typed
from rom.deprecated import path_came_first
from rom.errors import ConfigError
from rom.io.files import write_whole
from rom.model import Report
from rom.names import ORIGIN_MARK

PAGE_STYLE = """
body { font: 16px/1.5 "DejaVu Sans", "Segoe UI", Arial, sans-serif; color: #20242a;
       max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.7rem; } h2 { font-size: 1.2rem; margin-top: 2.5rem; }
table { border-collapse: collapse; margin: 0.8rem 0; font-size: 0.9rem; }
th, td { padding: 0.25rem 0.8rem; border-bottom: 1px solid #dfe3e8; text-align: right; }
th:first-child, td:first-child { text-align: left; }
thead th { border-bottom: 2px solid #5c636e; }
td.ok { color: #2c7a4b; } td.failed { color: #b3261e; font-weight: bold; }
pre { background: #f4f6f8; padding: 0.6rem 0.9rem; font-size: 0.85rem; overflow-x: auto; }
figure { margin: 1rem 0; } img { max-width: 100%; height: auto; }
figcaption, caption { font-size: 0.9rem; color: #4a515b; text-align: left; caption-side: bottom; }
"""
KINDS = {".png": "image/png", ".gif": "image/gif"}
MAX_PICTURE_BYTES = 20_000_000  # more makes a report that browsers cannot open


def paragraph(text: str) -> str:
    """A paragraph of plain text."""
    return f"<p>{html.escape(text)}</p>"


def source(text: str) -> str:
    """A command, or a file, as it was written."""
    return f"<pre>{html.escape(text)}</pre>"


def table(header: Sequence[str], rows: Iterable[Sequence[Any]], caption: str) -> str:
    """A table; numbers are written with five digits.

    Raises:
        ConfigError: if a row is not as long as the header.
    """
    lines = []
    for row in rows:
        if len(row) != len(header):
            raise ConfigError(f"a row of {len(row)} cells under a header of {len(header)}: {row}.")
        lines.append("<tr>" + "".join(f"<td>{_cell(value)}</td>" for value in row) + "</tr>")
    head = "".join(f"<th>{html.escape(name)}</th>" for name in header)
    return (
        f"<table><caption>{html.escape(caption)}</caption><thead><tr>{head}</tr></thead>"
        f"<tbody>{''.join(lines)}</tbody></table>"
    )


def checks(report: Report, caption: str) -> str:
    """A report of checks as a table, failures in red."""
    lines = []
    for row in report.rows:
        verdict = "ok" if row.ok else "failed"
        cells = f"<td>{html.escape(row.quantity)}</td><td>{_cell(row.value)}</td>"
        cells += f"<td>{html.escape(row.limit)}</td><td class='{verdict}'>{verdict}</td>"
        lines.append(f"<tr>{cells}</tr>")
    head = "<tr><th>quantity</th><th>value</th><th>limit</th><th></th></tr>"
    return (
        f"<table><caption>{html.escape(caption)}</caption><thead>{head}</thead>"
        f"<tbody>{''.join(lines)}</tbody></table>"
    )


def picture(path: str | Path, caption: str) -> str:
    """A picture, .png or .gif, copied into the report.

    Raises:
        ConfigError: if it is missing, of another kind, or too large.
    """
    path = Path(path)
    if path.suffix.lower() not in KINDS or not path.is_file():
        raise ConfigError(f"{path} is no picture of the kinds {', '.join(KINDS)}.")
    data = path.read_bytes()
    if len(data) > MAX_PICTURE_BYTES:
        raise ConfigError(
            f"{path} has {len(data)} bytes; pictures up to {MAX_PICTURE_BYTES} are embedded."
        )
    code = base64.b64encode(data).decode("ascii")
    words = html.escape(caption, quote=True)
    return (
        f"<figure><img alt='{words}' src='data:{KINDS[path.suffix.lower()]};base64,{code}'>"
        f"<figcaption>{words}</figcaption></figure>"
    )


@path_came_first(2, 0, 1)
@typed
def write_report(sections: dict[str, Sequence[str]], path: str | Path, title: str) -> Path:
    """Write a report.

    Args:
        sections: {heading: blocks} with blocks of the functions above.
        path: file to write, .html.
        title: heading.

    Returns:
        The path.

    Raises:
        ConfigError: if the ending is another one or the folder cannot be written.
        ResourceError: if the disk is full.
    """
    path = Path(path)
    if path.suffix.lower() != ".html":
        raise ConfigError(f"{path}: a report is written as .html.")
    body = "".join(
        f"<h2>{html.escape(heading)}</h2>{''.join(blocks)}" for heading, blocks in sections.items()
    )
    name = html.escape(title)
    text = (
        f"<!DOCTYPE html><html lang='en'><head><meta charset='utf-8'><title>{name}</title>"
        f"<meta name='generator' content='{ORIGIN_MARK}'>"
        f"<meta name='viewport' content='width=device-width, initial-scale=1'>"
        f"<style>{PAGE_STYLE}</style></head><body><h1>{name}</h1>{body}</body></html>\n"
    )
    write_whole(path, lambda file: file.write(text.encode("utf-8")))
    return path


def _cell(value: Any) -> str:
    if isinstance(value, int | np.integer) and not isinstance(value, bool):
        return str(value)
    if isinstance(value, float | np.floating):
        return f"{value:.5g}"
    return html.escape(str(value))
