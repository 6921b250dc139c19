"""A report in one HTML file that needs nothing else: text, tables, checks and pictures inside."""

import base64
import hashlib
import html
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from rom.arguments import one_each, typed
from rom.errors import ConfigError
from rom.io.files import write_whole
from rom.model import Report
from rom.names import ORIGIN_MARK, check_ending

SOURCE_FOLDER = Path(__file__).parent
PAGE_STYLE = (SOURCE_FOLDER / "page.css").read_text(encoding="utf-8")
SCRIPTS = ("vendor/three.min.js", "viewer.js")  # of figures that turn
ARRAY_ELEMENT = re.compile(
    r"<script type='application/octet-stream' id='(array-[0-9a-f]+)'>[^<]*</script>"
)
KINDS = {".png": "image/png", ".gif": "image/gif"}
FRAME_STYLE = "width: 100%; height: 43rem; border: 0"
MAX_FRAME_CHARACTERS = 4_000_000  # of a page in a notebook, which keeps it
MAX_PICTURE_BYTES = 20_000_000  # more makes a report that browsers cannot open


def paragraph(text: str) -> str:
    """A paragraph of plain text."""
    return f"<p>{html.escape(text)}</p>"


def source(text: str) -> str:
    """A command, or a file, as it was written."""
    return f"<pre>{html.escape(text)}</pre>"


def table(header: Sequence[str], rows: Iterable[Sequence[object]], caption: str) -> str:
    """A table; numbers are written with five digits."""
    lines = []
    for row in rows:
        one_each(f"cells of the row {row}", len(row), "columns of the header", len(header))
        lines.append("".join(f"<td>{_cell(value)}</td>" for value in row))
    return _table(header, lines, caption)


def checks(report: Report, caption: str) -> str:
    """A report of checks as a table, failures in red."""
    lines = []
    for row in report.rows:
        verdict = "ok" if row.ok else "failed"
        cells = (f"<td>{_cell(value)}</td>" for value in (row.quantity, row.value, row.limit))
        lines.append(f"{''.join(cells)}<td class='{verdict}'>{verdict}</td>")
    return _table(("quantity", "value", "limit", ""), lines, caption)


def _table(header: Sequence[str], lines: Iterable[str], caption: str) -> str:
    head = "".join(f"<th>{html.escape(name)}</th>" for name in header)
    rows = "".join(f"<tr>{cells}</tr>" for cells in lines)
    return (
        f"<table><caption>{html.escape(caption)}</caption><thead><tr>{head}</tr></thead>"
        f"<tbody>{rows}</tbody></table>"
    )


def picture(path: str | Path, caption: str) -> str:
    """A picture, .png or .gif, copied into the report."""
    words = html.escape(caption, quote=True)
    return f"<figure>{image(path, caption)}<figcaption>{words}</figcaption></figure>"


def image(path: str | Path, words: str) -> str:
    """A picture without a caption; words for those who do not see it. Raises as `picture`."""
    path = Path(path)
    if path.suffix.lower() not in KINDS or not path.is_file():
        raise ConfigError(f"{path} must be a picture of the kinds {', '.join(KINDS)}.")
    data = path.read_bytes()
    if len(data) > MAX_PICTURE_BYTES:
        raise ConfigError(f"{path} must have at most {MAX_PICTURE_BYTES} bytes, not {len(data)}.")
    code = base64.b64encode(data).decode("ascii")
    kind = KINDS[path.suffix.lower()]
    return f"<img alt='{html.escape(words, quote=True)}' src='data:{kind};base64,{code}'>"


@typed
def write_report(sections: dict[str, Sequence[str]], path: str | Path, title: str) -> Path:
    """Write a report.

    Args:
        sections: {heading: blocks} with blocks of the functions above.
        path: file to write, .html.
        title: heading.

    Raises:
        ConfigError: if the ending is another one or the folder cannot be written.
        ResourceError: if the disk is full.
    """
    path = check_ending(path, "a report", ".html")
    return write_whole(path, page(headed(sections, title), title).encode("utf-8"))


def headed(sections: Mapping[str, Sequence[str]], title: str) -> str:
    """What stands in a page: its title, and blocks under their headings."""
    told = (f"<h2>{html.escape(name)}</h2>{''.join(some)}" for name, some in sections.items())
    return f"<h1>{html.escape(title)}</h1>{''.join(told)}"


def page(body: str, title: str, script: str = "") -> str:
    """A whole page; a script of its own may ask the server that the page comes from."""
    turning = "<figure class='scene" in body
    scripts = [(SOURCE_FOLDER / name).read_text("utf-8") for name in SCRIPTS if turning]
    scripts += [script] if script else []
    policy = _policy(scripts) + ("; connect-src 'self'; frame-src 'self'" if script else "")
    name = html.escape(title)
    return (
        f"<!DOCTYPE html><html lang='en'><head><meta charset='utf-8'><title>{name}</title>"
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
        f"<meta name='generator' content='{ORIGIN_MARK}'>"
        f"<meta name='viewport' content='width=device-width, initial-scale=1'>"
        f"<style>{PAGE_STYLE}</style></head><body>{_once_each(body)}"
        f"{''.join(f'<script>{one}</script>' for one in scripts)}</body></html>\n"
    )


def framed(body: str, title: str) -> str:
    """A page in a frame that shares nothing with the notebook around it, or what to do instead."""
    text = html.escape(page(body, title))
    if len(text) > MAX_FRAME_CHARACTERS:
        return paragraph(
            f"{title}: {len(text) / 1e6:.1f} MB, too large here; see rom.write_report."
        )
    return f'<iframe sandbox="allow-scripts" style="{FRAME_STYLE}" srcdoc="{text}"></iframe>'


def _policy(scripts: Sequence[str]) -> str:
    """What the browser lets the page do: these scripts, this style, pictures inside, no network."""

    def only(texts: Sequence[str]) -> str:
        digests = [hashlib.sha256(text.encode("utf-8")).digest() for text in texts]
        return " ".join(f"'sha256-{base64.b64encode(d).decode('ascii')}'" for d in digests)

    return (
        f"default-src 'none'; script-src {only(scripts) or repr('none')}; "
        f"style-src {only([PAGE_STYLE])}; img-src data:; base-uri 'none'; form-action 'none'"
    )


def _once_each(body: str) -> str:
    """The page with each array that several figures use in the first of them only."""
    seen: set[str] = set()

    def first(found: re.Match[str]) -> str:
        kept = "" if found[1] in seen else found[0]
        seen.add(found[1])
        return kept

    return ARRAY_ELEMENT.sub(first, body)


def _cell(value: object) -> str:
    if isinstance(value, int | np.integer) and not isinstance(value, bool):
        return str(value)
    if isinstance(value, float | np.floating):
        return f"{value:.5g}"
    return html.escape(str(value))
