"""Constants say quantity and kind, and one thing has one word."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent
while not (ROOT / "pyproject.toml").exists():
    ROOT = ROOT.parent
MODULES = sorted((ROOT / "rom").rglob("*.py"))

MAX_ONE_WORD = 40
# constants of one word that are clear: what they are, by name
CLEAR = {
    "DPI": "unit of the resolution of pictures",
    "EXAMPLES": "of every verb, read by the parser",
    "GRAVITY": "the standard one [m/s^2]",
    "GREY": "a colour",
    "GROUND": "name of the body that does not move",
    "OVERSAMPLING": "of pictures",
    "ALPHA": "symbol of the method",
    "EXECUTE": "flag of the kernel of Linux",
    "SUMMARY": "of every verb, read by the parser",
    "TRUNCATE": "flag of the kernel of Linux",
}
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


def one_word_constants(tree):
    """Names and lines of the constants of a module that are one word in capitals."""
    for node in tree.body:
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
            continue
        target = node.targets[0] if isinstance(node, ast.Assign) else node.target
        pairs = [(target, node.value)]
        if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
            pairs = list(zip(target.elts, node.value.elts, strict=False))
            if all(isinstance(v, ast.Constant) and isinstance(v.value, int) for _, v in pairs):
                continue  # an enumeration
        for name, value in pairs:
            if isinstance(name, ast.Name) and re.fullmatch("[A-Z][A-Z0-9]*", name.id):
                if scalar(value):
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


def places(found, path):
    return [f"{path.relative_to(ROOT)}:{line} {name}" for name, line in found]


TREES = {path: ast.parse(path.read_text()) for path in MODULES}


def test_constants_say_quantity_and_kind():
    found = [
        (name, f"{path.relative_to(ROOT)}:{line} {name}")
        for path, tree in TREES.items()
        for name, line in one_word_constants(tree)
    ]
    odd = [place for name, place in found if name not in CLEAR]
    assert not odd, f"call them MAX_..., ..._RTOL, ..._SIZE and the like: {odd}"
    assert len(found) < MAX_ONE_WORD
    assert {name for name, _ in found} == set(CLEAR), "names in CLEAR that are gone"


@pytest.mark.parametrize(("word", "say", "where"), RETIRED, ids=[w for w, _, _ in RETIRED])
def test_retired_words_do_not_come_back(word, say, where):
    bad = []
    for path, tree in TREES.items():
        parts = set(path.relative_to(ROOT / "rom").with_suffix("").parts)
        if not where or parts & set(where.split()):
            bad += places([(n, line) for n, line in names_bound(tree) if n == word], path)
    assert not bad, f"say {say}: {bad}"


def test_the_count_sees_a_constant_and_spares_enumerations():
    tree = ast.parse("SAME = 1e-6\nCAP, TIMES = 0.2, 80\nOPEN, SHUT = 0, 1\nTIME_LIMIT = 3\n")
    assert [name for name, _ in one_word_constants(tree)] == ["SAME", "CAP", "TIMES"]


def test_the_search_sees_every_kind_of_name():
    source = "def said(told, *, aloud):\n    rest = x.push\n    a.shown = [way for way in rest]\n"
    assert {name for name, _ in names_bound(ast.parse(source))} == {
        "said", "told", "aloud", "rest", "shown", "way",
    }  # fmt: skip
