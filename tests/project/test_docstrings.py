"""Docstrings of public callables say units, shapes, errors and sources where there are any.

Public is what the fronts name that users import from, with the public methods and properties of
its classes. What a callable must say follows from its code, and every part is looked for where it
belongs, so that one unit does not stand for five arguments:

- units: each argument, field or result whose annotation holds real or complex numbers says a unit
  in brackets in its own entry, [1] where it has none;
- shapes: each one that is an array says its shape in parentheses;
- errors: each error raised on purpose in the body, or in the body of a function or class of the
  project that is called there, is named below Raises;
- source: a function or class of a folder of methods names who published it and when, or the page
  of theory that does. `PLAIN` lists those that are no method.
"""

import ast
import importlib
import inspect
import re

import pytest

import rom
from cases.files.docstrings import (
    INSIDE,
    called_by,
    of_function,
    pages_and_demos,
    public,
    raised,
    raises_in,
)
from cases.paths import ROOT

pytestmark = pytest.mark.once

ENOUGH = 0.95
METHODS = ("rom.reduction.", "rom.mbs.integrate.", "rom.components.", "rom.assembly.")
PLAIN = {  # of these folders, and no published method
    "rom.assembly.condensed.CondensedAssembly": "the result",
    "rom.components.gear_mesh.gears.corrections.flank_map": "a file",
    "rom.components.gear_mesh.tooth_loads.tooth_loads": "a result",
    "rom.components.journal_bearing.films.bearing.multilobe": "a definition",
    "rom.components.journal_bearing.films.oil.iso_vg": "a table",
    "rom.components.journal_bearing.record.film_pressures": "a result",
    "rom.components.transmission.loaded.film_wall": "a picture",
    "rom.components.transmission.loaded.tooth_walls": "a picture",
    "rom.components.transmission.loaded.toothed_shaft": "a picture",
    "rom.components.gear_mesh.tooth_elements.element_table": "finite elements of the textbooks",
    "rom.components.gear_mesh.tooth_elements.tooth_model": "finite elements of the textbooks",
    "rom.components.hand.control_chart.muscle": "noise",
    "rom.components.hand.solid_finger.heavy_spring": "mass of a wire",
    "rom.components.hand.solid_finger.link_compliance": "a definition",
    "rom.components.hand.solid_finger.parts_of_compliance": "a sum",
    "rom.components.hand.solid_finger.solid_finger": "a mechanism",
    "rom.components.hand.solid_finger.tip_compliance": "a definition",
    "rom.components.linkages.two_dof_linkages.mechanism_inertia": "a definition",
    "rom.components.linkages.two_dof_linkages.reduced_link": "a link",
    "rom.components.linkages.two_dof_linkages.rigid_link": "a link",
    "rom.components.linkages.two_dof_linkages.rod": "a link",
    "rom.mbs.integrate.simulation.release": "a state",
    "rom.components.wheels.prestress.spin_up.held_solid": "a sector",
    "rom.reduction.bases.method.Method": "what methods have in common",
    "rom.reduction.full_model.mass_properties": "a definition",
    "rom.reduction.full_model.modes": "a definition",
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


# --- what each must say ---


def numeric(annotation):
    annotation = re.sub(r"Callable\[\[.*?\], [^\]]*\]*", "", annotation)
    return NUMBERS.search(WHOLE.sub("", annotation))


def array(annotation):
    return ARRAYS.search(re.sub(r"Callable\[\[.*?\], [^\]]*\]*", "", annotation))


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


def without_units(one):
    return without(one, numeric, UNITS, NO_UNIT)


def without_shapes(one):
    return without(one, array, SHAPE, LIKE)


def without_errors(one):
    kinds = raised(one.thing)
    for called, caught in called_by(one.thing):
        kinds = kinds | raised(called) - caught
    named = set(re.findall(r"\b[A-Z]\w+(?:Error|Run)\b", " ".join(one.raises_said)))
    return sorted(kinds - named) if kinds else None


def without_source(one):
    """Components are shown with the docstrings of their modules, where a source may stand."""
    if not (is_method(one) and one.name.startswith(METHODS)) or one.name in PLAIN:
        return None
    place = one.name.rpartition(".")[0]
    about = importlib.import_module(place).__doc__ if ".components." in place else ""
    return [] if source_in(one.text) or source_in(about) else ["source"]


def is_method(one):
    """A function of a module, or a class that reduces."""
    is_class_or_module = "basis" in vars(one.thing) if inspect.isclass(one.thing) else True
    return is_class_or_module and one.name.rpartition(".")[0].islower()


def source_in(text):
    section = re.search(r"^(Sources?:|See )(.*\n?)*", text, re.M)
    pages = re.findall(r"docs/theory/\w+\.md", text)
    return bool(section and SOURCE.search(section[0])) and all((ROOT / p).exists() for p in pages)


MEASURES = {"units": without_units, "shapes": without_shapes, "errors": without_errors,
            "source": without_source}  # fmt: skip


def measured(what):
    """{name: what it lacks} of all that need something."""
    found = {name: MEASURES[what](one) for name, one in public().items()}
    return {name: lacking for name, lacking in found.items() if lacking is not None}


@pytest.mark.parametrize("what", MEASURES)
def test_docstrings_say(what):
    found = measured(what)
    lacking = {name: lacks for name, lacks in found.items() if lacks}
    share = 1 - len(lacking) / len(found)
    assert share >= ENOUGH, f"{what} in {share:.1%} of {len(found)}: {lacking}"


def test_lists_of_exceptions_are_up_to_date():
    assert set(PLAIN) <= set(public()), "names in PLAIN that are gone"
    text = pages_and_demos()
    for package in INSIDE:
        assert (ROOT / package.replace(".", "/") / "__init__.pyi").exists()
        assert not re.search(rf"from {package} import", text), f"users import from {package}"


# --- examples of what is found ---


def bare(stiffness: float, x: rom.model.Array) -> rom.model.Array:
    """Force [N] of a spring.

    Args:
        stiffness: of the spring.
        x: elongations [from rest].
    """
    return stiffness * x


def short(a: rom.model.Array, b: rom.model.Array, c: rom.model.Array) -> rom.model.Array:
    """(n,) sum of all [m]."""
    return a + b + c


def test_the_measures_see_what_is_not_said():
    two, three = (of_function(f.__name__, f) for f in (bare, short))
    assert without_units(two) == ["stiffness", "x"] and without_shapes(two) == ["x", "result"]
    assert without_units(three) == without_shapes(three) == ["a", "b", "c", "result"]
    assert not UNITS.search("from 0 to 1 [a, b] [0, 1]") and UNITS.search("[N m/rad, 1/s^2]")


def test_the_measure_of_errors_follows_calls_and_handlers():
    source = "try:\n    raise ConfigError(1)\nexcept ConfigError:\n    raise MeshError(2)"
    assert list(raises_in(ast.parse(source))) == ["MeshError"]
    assert list(raises_in(ast.parse("raise reached(SolverError('x'), 1) from None"))) == [
        "SolverError"
    ]
    called = {function.__name__ for function, _ in called_by(rom.modes)}
    assert called >= {"whole", "connect", "by_name"}


def test_a_source_has_a_year_or_a_page_that_exists():
    assert source_in("Source:\n    Guyan, AIAA J. 3 (1965) 380.")
    assert source_in("Source:\n    See docs/theory/rods.md.")
    assert not source_in("Found in 1965.") and not source_in("Source:\n    A book.")
    assert not source_in("Source:\n    See docs/theory/nothing.md.")
