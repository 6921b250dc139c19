"""How text becomes HTML: formulas as MathML, docstrings as the plain text they are."""

import re
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx

CODE = re.compile(r"(``.+?``|`[^`]+`)", re.S)
EXAMPLE = re.compile(r"^ *>>> (?:.+\n?)+", re.M)  # up to the next blank line
MARKUP = re.compile(r"([*|])|(?<=\w)(_)(?!\w)")


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
    app.connect("autodoc-skip-member", _skip)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
