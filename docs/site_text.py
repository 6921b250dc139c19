"""How text becomes HTML: formulas as MathML, docstrings as plain text, types by public names."""

import re
from functools import cache
from operator import attrgetter
from typing import Any

import numpy.typing as npt
from docutils import nodes
from latex2mathml.converter import convert
from site_tasks import NAMES
from sphinx.application import Sphinx
from sphinx.util.typing import stringify_annotation

import rom

CODE = re.compile(r"(``.+?``|`[^`]+`)", re.S)
EXAMPLE = re.compile(r"^ *>>> (?:.+\n?)+", re.M)  # up to the next blank line
MARKUP = re.compile(r"([*|])|(?<=\w)(_)(?!\w)")
# types as they are to be read: limits, whose units stand in the text, and aliases taken back
SHORTER = {
    re.escape(stringify_annotation(npt.ArrayLike, "smart")): "~numpy.typing.ArrayLike",
    r"~numpy\.ndarray\[.*?\]\]": "~numpy.ndarray",
    r"~typing\.Annotated\[((?:[^][]|\[[^][]*\])*?), ~rom\.arguments\.\w+\.\w+"
    r"(?:\(.*?error=~rom\.errors\.\w+[^)]*\))?\]": r"\1",
}


def plain(text: str) -> str:
    """A docstring without accidental markup; what stands in backquotes becomes code.

    Args:
        text: plain text; asterisks, bars and underscores mean themselves.

    Returns:
        The same in reStructuredText.
    """
    if examples := EXAMPLE.findall(text):
        around = [plain(part) for part in EXAMPLE.split(text)]
        return around[0] + "".join(a + b for a, b in zip(examples, around[1:], strict=True))
    parts = CODE.split(text)
    parts[::2] = [MARKUP.sub(r"\\\g<0>", part) for part in parts[::2]]
    parts[1::2] = [f"``{part.strip('`')}``" for part in parts[1::2]]
    return "".join(parts)


def _docstring(app: Sphinx, what: str, name: str, thing: Any, options: Any, lines: Any) -> None:
    # napoleon looks for a type in the first line; an escaped line end is nothing
    first = ["\\"] if what in ("attribute", "property") else []
    lines[:] = first + plain("\n".join(lines)).split("\n")


@cache
def _public_names() -> dict[str, str]:
    """{module and name of a class: the name under which users import it}."""
    things = {name: attrgetter(name.removeprefix("rom."))(rom) for name in NAMES}
    return {
        f"{thing.__module__}.{thing.__qualname__}": name
        for name, thing in things.items()
        if isinstance(thing, type)
    }


def _types(app: Sphinx, what: str, name: str, thing: Any, options: Any, *said: str) -> Any:
    """Arguments and result with short types, those of rom by their public names."""
    for long, short in SHORTER.items():
        said = tuple(text and re.sub(long, short, text) for text in said)
    public = _public_names()
    return tuple(
        text and re.sub(r"rom(?:\.\w+)+", lambda found: public.get(found[0], found[0]), text)
        for text in said
    )


def _skip(app: Sphinx, what: str, name: str, thing: Any, skip: bool, options: Any) -> bool | None:
    """Leave out fields of tuples, which the class has explained."""
    return True if str(thing.__doc__).startswith("Alias for field") else None


def mathml(formula: str, *, block: bool = False) -> str:
    """A formula as MathML; lines of a block are aligned where it says ``&``.

    Raises:
        ValueError: for a command that is not known, which would stand there as text.
    """
    if block and r"\\" in formula and r"\begin" not in formula:
        formula = rf"\begin{{align*}}{formula}\end{{align*}}"
    made = convert(formula, display="block" if block else "inline")
    if "\\" in made:
        raise ValueError(f"unknown command in the formula {formula}")
    for side in ("left", "right"):  # browsers take alignment from styles alone
        style = f'style="text-align: {side}; padding: 0.5ex 0"'
        made = made.replace(f'columnalign="{side}"', style)
    return made


def _inline(translator: Any, node: nodes.math) -> None:
    translator.body.append(mathml(node.astext()))
    raise nodes.SkipNode


def _block(translator: Any, node: nodes.math_block) -> None:
    translator.body.append(f'<div class="math">{mathml(node.astext(), block=True)}</div>')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Register with Sphinx; docstrings are taken before napoleon reads their sections."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    app.connect("autodoc-process-docstring", _docstring, priority=100)
    app.connect("autodoc-process-signature", _types)
    app.connect("autodoc-skip-member", _skip)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
