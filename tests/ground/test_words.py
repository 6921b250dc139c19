"""Constants say quantity and kind, and one thing has one word."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

pytestmark = pytest.mark.once

ROOT = Path(__file__).resolve().parent
while not (ROOT / "pyproject.toml").exists():
    ROOT = ROOT.parent
MODULES = sorted((ROOT / "rom").rglob("*.py"))

MAX_ONE_WORD = 40
# constants of one word that are clear: what they are, by name
CLEAR = {
    "ADMITTED": "share of a contact in a kernel",
    "ALUMINIUM": "a material",
    "CHORD": "of a blade, in a kernel",
    "DPI": "unit of the resolution of pictures",
    "EXECUTE": "flag of the kernel of Linux",
    "GRAVITY": "the standard one [m/s^2]",
    "GREY": "a colour",
    "GROUND": "name of the body that does not move",
    "ORIGIN": "the point",
    "OVERSAMPLING": "of pictures",
    "PACKAGE": "folder of rom, which kernels ask for",
    "STEEL": "a material",
    "TRUNCATE": "flag of the kernel of Linux",
    "VERSION": "of the schema of a file",
    "WORK": "entries of the work in kernels",
    "X": "the axis",
    "Y": "the axis",
    "Z": "the axis",
    "ZERO": "three zeros in kernels",
}
# names that are a convention of their own: what every verb has, variables of types, and files in
# which a name is that of the key, dimension, range or field that it describes
OF_VERBS = {"SUMMARY", "EXAMPLES", "SCHEMA", "FIELD", "SECTION"}  # and every field
OF_TYPES = {"ParamSpec", "TypeVar"}
DESCRIPTIONS = {
    "cli/schemas.py", "config/component_keys.py", "config/mechanism_keys.py", "plausible.py",
    "units.py", *(path.relative_to(ROOT / "rom").as_posix()
                  for path in (ROOT / "rom" / "components").glob("*/keys.py")),
}  # fmt: skip
# words for which there is a better one: the word, what to say, and the folders and modules it is
# looked for in; elsewhere it may be the right one, as the lift of a wing
RETIRED = [
    ("Manner", "OutputOptions", ""),
    ("aloud", "verbose", ""),
    ("complain", "print_error", ""),
    ("linearise", "linearize", ""),
    ("manner", "options", ""),
    ("generalised", "generalized", ""),
    ("jerk", "second_order", "kinematics markers"),
    ("lift", "a_minus_g", "mbs rotating"),
    ("push", "the force or product it is", ""),
    ("rest", "residual or remainder", "mbs eigen workflow affine config units"),
    ("said", "summary, message or label", ""),
    ("shown", "html_table, as_text", ""),
    ("spur", "minus_trace", ""),
    ("swirl", "convective_angular", ""),
    ("told", "outputs, messages or groups", ""),
    ("way", "displacement", "mbs config"),
    ("whirl", "second_order_angular", "mbs"),
]


def scalar(node):
    """Numbers, texts and what is computed of them."""
    if isinstance(node, ast.BinOp):
        return scalar(node.left) and scalar(node.right)
    if isinstance(node, ast.UnaryOp):
        return scalar(node.operand)
    return isinstance(node, ast.Constant) and isinstance(node.value, int | float | str)


def counts(target, value):
    """Numbers of an enumeration: OPEN, SHUT = 0, 1."""
    if isinstance(value, ast.Call):
        return isinstance(value.func, ast.Name) and value.func.id == "range"
    return isinstance(target, ast.Tuple) and all(
        isinstance(one, ast.Constant) and isinstance(one.value, int)
        for one in getattr(value, "elts", [value])
    )


def clear_by_itself(name, value):
    """A table with the plural of what it lists, or a name that is a convention."""
    made = value.func.id if isinstance(value, ast.Call) and hasattr(value.func, "id") else ""
    table = name.endswith("S") and len(name) > 2 and not scalar(value)
    return table or name in OF_VERBS or made in OF_TYPES


def one_word_constants(tree):
    """Names and lines of the constants of a module that are one word in capitals."""
    for node in tree.body:
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
            continue
        target = node.targets[0] if isinstance(node, ast.Assign) else node.target
        if counts(target, node.value):
            continue
        names = target.elts if isinstance(target, ast.Tuple) else [target]
        several = isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple)
        values = node.value.elts if several else [node.value] * len(names)
        for name, value in zip(names, values, strict=True):
            if isinstance(name, ast.Name) and re.fullmatch("_?[A-Z][A-Z0-9]*", name.id):
                if not clear_by_itself(name.id, value):
                    yield name.id, node.lineno


def names_bound(tree):
    """Names that a module gives to variables, parameters, functions, classes and attributes."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id, node.lineno
        elif isinstance(node, ast.arg):
            yield node.arg, node.lineno
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name, node.lineno
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            yield node.attr, node.lineno


@cache
def trees():
    return {path: ast.parse(path.read_text()) for path in MODULES}


def test_constants_say_quantity_and_kind():
    found = [
        (name, f"{path.relative_to(ROOT)}:{line} {name}")
        for path, tree in trees().items()
        if path.relative_to(ROOT / "rom").as_posix() not in DESCRIPTIONS
        for name, line in one_word_constants(tree)
    ]
    odd = [place for name, place in found if name not in CLEAR]
    assert not odd, f"call them MAX_..., ..._RTOL, ..._SIZE and the like: {odd}"
    assert len(found) < MAX_ONE_WORD
    assert {name for name, _ in found} == set(CLEAR), "names in CLEAR that are gone"


def test_retired_words_do_not_come_back():
    retired = {word: (say, set(where.split())) for word, say, where in RETIRED}
    bad = []
    for path, tree in trees().items():
        parts = set(path.relative_to(ROOT / "rom").with_suffix("").parts)
        for name, line in names_bound(tree):
            say, where = retired.get(name, ("", None))
            if say and (not where or parts & where):
                bad.append(f"{path.relative_to(ROOT)}:{line} {name}: say {say}")
    assert not bad, "\n".join(bad)


def test_the_count_sees_a_constant_and_spares_enumerations():
    tree = ast.parse("SAME = 1e-6\nCAP, TIMES = 0.2, 80\nOPEN, SHUT = 0, 1\nTIME_LIMIT = 3\n"
                     "LOST = {'a'}\nUNITS = {'m': 1}\nTHIN, WIDE = range(2)\nT = TypeVar('T')\n"
                     "FAST = compile('x')\n")  # fmt: skip
    found = [name for name, _ in one_word_constants(tree)]
    assert found == ["SAME", "CAP", "TIMES", "LOST", "FAST"]


def test_the_search_sees_every_kind_of_name():
    source = "def said(told, *, aloud):\n    rest = x.push\n    a.shown = [way for way in rest]\n"
    assert {name for name, _ in names_bound(ast.parse(source))} == {
        "said", "told", "aloud", "rest", "shown", "way",
    }  # fmt: skip
