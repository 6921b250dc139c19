"""Docstrings of public callables say units, shapes, errors and sources where there are any.

What a callable must say follows from its code: each argument, field or result of real or complex
numbers a unit in brackets in its own entry, [1] where it has none; each array its shape; each error
raised on purpose below Raises; a module of methods who published them, or its page of theory.
"""

import importlib
import inspect
import re

import pytest

from cases.files.docstrings import public, raised
from cases.paths import ROOT

pytestmark = pytest.mark.once

ENOUGH = 0.95
METHODS = ("rom.reduction.", "rom.mbs.integrate.", "rom.components.", "rom.assembly.")
PLAIN = {  # modules of these folders without a published method: definitions, tables, pictures
    "rom.reduction.full_model",
    "rom.components.gear_mesh.gears.corrections",
    "rom.components.gear_mesh.tooth_elements",
    "rom.components.gear_mesh.tooth_loads",
    "rom.components.hand.solid_finger",
    "rom.components.journal_bearing.films.bearing",
    "rom.components.journal_bearing.films.oil",
    "rom.components.journal_bearing.record",
    "rom.components.linkages.two_dof_linkages",
    "rom.components.masonry.drawings",
    "rom.components.transmission.loaded",
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
SHAPE = re.compile(r"\((?:\.\.\.|[\w+\-*/ .]+)?,(?: ?(?:\.\.\.|[\w+\-*/ .]+),?)*\)|\bscalar\b")
LIKE = re.compile(r"\b(?:as|see|like|likewise)(?: in| of| for)? `[\w.]+|\bas in the class\b", re.I)
COUNTED = re.compile(r"\b(?:labels|dof numbers|numbers of (?:points|nodes))\b")
SOURCE = re.compile(r"\b1[789]\d\d\b|\b20[0-2]\d\b|\bAfter [A-Z]\w+|docs/theory/\w+\.md")


MADE_BY_CALLS = re.compile(r"Callable\[\[.*?\], [^\]]*\]*")


def numeric(annotation):
    return NUMBERS.search(WHOLE.sub("", MADE_BY_CALLS.sub("", annotation)))


def array(annotation):
    return ARRAYS.search(MADE_BY_CALLS.sub("", annotation))


def without(one, wanted, pattern, instead):
    """Arguments, fields and the result that need a pattern and lack it; None if none needs it.

    What has no entry of its own is looked for in the first lines, where one unit or shape may
    serve an argument and the result, and no more.
    """
    needed = [k for k, annotation in one.items.items() if wanted(annotation)]
    said = {k: one.said_of(k) for k in needed}
    if wanted(one.result):
        said["result"] = one.said_of_result
    lacking = [k for k, text in said.items() if not (pattern.search(text) or instead.search(text))]
    first = " ".join(one.sections[""].split())
    alone = [k for k, text in said.items() if text == first]
    if not instead.search(first) and len(pattern.findall(first)) < len(alone) - 1:
        lacking += [k for k in alone if k not in lacking]
    return lacking if said else None


NO_UNIT = re.compile(f"{SYSTEM.pattern}|{LIKE.pattern}|{COUNTED.pattern}", re.I)


def without_errors(one):
    kinds = raised(one.thing)
    named = set(re.findall(r"\b[A-Z]\w+(?:Error|Run)\b", " ".join(one.raises_said)))
    return sorted(kinds - named) if kinds else None


def is_method(one):
    """A function of a module, or a class that reduces."""
    reduces = not inspect.isclass(one.thing) or hasattr(one.thing, "basis")
    return reduces and one.name.rpartition(".")[0].islower()


def source_in(text):
    """Whether a docstring names a year or a page that exists."""
    section = re.search(r"^(Sources?:|See )(.*\n?)*", text, re.M)
    pages = re.findall(r"docs/theory/\w+\.md", text)
    return bool(section and SOURCE.search(section[0])) and all((ROOT / p).exists() for p in pages)


MEASURES = {
    "units": lambda one: without(one, numeric, UNITS, NO_UNIT),
    "shapes": lambda one: without(one, array, SHAPE, LIKE),
    "errors": without_errors,
}


@pytest.mark.parametrize("what", MEASURES)
def test_docstrings_say(what):
    found = {name: MEASURES[what](one) for name, one in public().items()}
    found = {name: lacks for name, lacks in found.items() if lacks is not None}
    lacking = {name: lacks for name, lacks in found.items() if lacks}
    share = 1 - len(lacking) / len(found)
    assert share >= ENOUGH, f"{what} in {share:.1%} of {len(found)}: {lacking}"


def test_modules_of_methods_name_their_sources():
    texts = {}
    for name, one in public().items():
        if name.startswith(METHODS) and is_method(one):
            module = name.rpartition(".")[0]
            texts.setdefault(module, [importlib.import_module(module).__doc__]).append(one.text)
    assert {m for m, said in texts.items() if not any(map(source_in, said))} == PLAIN
