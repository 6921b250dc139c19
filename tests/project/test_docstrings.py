"""Docstrings of public callables say units, shapes and sources where there are any.

What a callable must say follows from its code: each argument, field or result of real or complex
numbers a unit in brackets, [1] where it has none; each array its shape; a module of methods who
published them, or its page of theory.
"""

import importlib
import inspect
import re

import pytest

from cases.files.docstrings import public
from cases.paths import ROOT

pytestmark = pytest.mark.once

ENOUGH = 0.97
METHODS = ("rom.reduction.", "rom.mbs.integrate.", "rom.components.", "rom.assembly.")
# modules of these folders without a published method: definitions, tables, pictures
PLAIN = {"rom.reduction.full_model"} | {
    f"rom.components.{name}"
    for name in """
gear_mesh.gears.corrections gear_mesh.tooth_elements gear_mesh.tooth_loads hand.solid_finger
journal_bearing.films.bearing journal_bearing.films.oil journal_bearing.record
linkages.two_dof_linkages masonry.drawings studies.pictures transmission.loaded
""".split()
}

NUMBERS = re.compile(r"\b(float|complex|Complex|Array|ArrayLike|NDArray|ndarray|Temperature)\b")
ARRAYS = re.compile(r"\b(Array|Index|Mask|Integers|Complex|ArrayLike|NDArray|ndarray)\b")
WHOLE = re.compile(r"NDArray\[np\.(int|bool|uint)\w*\]")
UNIT = (r"(?:[kmMGµn]?(?:m|s|g|N|Pa|J|W|Hz|K|t)|kg|rad|deg|degrees(?: Celsius)?|rpm|dB|min|h|%|1"
        r"|turns?|bytes?|pixels?|\((?:rad|m)/s\))")  # fmt: skip
POWER = r"(?:\^?\(?[-+]?(?:[\d.]+(?:/\d+)?|[a-z]|exponent)\)?)?"
PRODUCT = rf"(?:sqrt\()?{UNIT}{POWER}\)?(?:[ /*·]\(?{UNIT}{POWER}\)?)*"
UNITS = re.compile(rf"\[{PRODUCT}(?:(?:,|;)?(?: or| and| per)? (?:{PRODUCT}|second))*\]")
SYSTEM = re.compile(r"\bunits? (?:of|as)\b|\bin (?:the|its|their|consistent) (?:own )?units?\b")
SHAPE = re.compile(r"\([\w+\-*/ .]*,(?:[\w+\-*/ .]+,)*[\w+\-*/ .]*\)|\bscalar\b")
LIKE = re.compile(r"\b(?:as|see|like|likewise)(?: in| of| for)? `[\w.]+|\bas in the class\b", re.I)
COUNTED = re.compile(r"\b(?:labels|dof numbers|numbers of (?:points|nodes))\b")
SOURCE = re.compile(r"\b1[789]\d\d\b|\b20[0-2]\d\b|\bAfter [A-Z]\w+|docs/theory/\w+\.md")


MADE_BY_CALLS = re.compile(r"Callable\[\[.*?\], [^\]]*\]*")


def numeric(annotation):
    return NUMBERS.search(WHOLE.sub("", MADE_BY_CALLS.sub("", annotation)))


def array(annotation):
    return ARRAYS.search(MADE_BY_CALLS.sub("", annotation))


NO_UNIT = re.compile(f"{SYSTEM.pattern}|{LIKE.pattern}|{COUNTED.pattern}", re.I)


def is_method(one):
    reduces = not inspect.isclass(one.thing) or hasattr(one.thing, "basis")
    return reduces and one.name.rpartition(".")[0].islower()


def source_in(text):
    section = re.search(r"^(Sources?:|See )(.*\n?)*", text, re.M)
    pages = re.findall(r"docs/theory/\w+\.md", text)
    return bool(section and SOURCE.search(section[0])) and all((ROOT / p).exists() for p in pages)


MEASURES = {"units": (numeric, UNITS, NO_UNIT), "shapes": (array, SHAPE, LIKE)}


@pytest.mark.parametrize("what", MEASURES)
def test_docstrings_say(what):
    """One for each argument, field or result that needs it; one may serve two of them."""
    wanted, pattern, instead = MEASURES[what]
    needed, lacking = 0, []
    for one in public().values():
        n = sum(bool(wanted(kind)) for kind in (*one.items.values(), one.result))
        needed += bool(n)
        if n and not instead.search(one.whole) and len(pattern.findall(one.whole)) < max(1, n - 1):
            lacking.append(one.name)
    share = 1 - len(lacking) / needed
    assert share >= ENOUGH, f"{what} in {share:.1%} of {needed}: {lacking}"


def test_modules_of_methods_name_their_sources():
    texts = {}
    for name, one in public().items():
        if name.startswith(METHODS) and is_method(one):
            module = name.rpartition(".")[0]
            texts.setdefault(module, [importlib.import_module(module).__doc__]).append(one.text)
    assert {m for m, said in texts.items() if not any(map(source_in, said))} == PLAIN
