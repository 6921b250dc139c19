"""The script that plants errors in kernels finds all of them, and plants what it says."""

import ast
import sys

import pytest

from cases.paths import ROOT

sys.path.insert(0, str(ROOT / ".ci"))
import plant

pytestmark = pytest.mark.once

SOURCE = """
@inner
def f(x, k, out):
    out[k + 1] += 2.0 * x - x[k - 1] / 3.0
    return k + 1

def g(x):
    return x + x

def law(x):
    return x - 0.5

compiled_law(law)
"""


def test_it_plants_one_sign_or_factor_of_compiled_functions_alone():
    signs, factors = plant.places(SOURCE)
    found = [[ast.unparse(node) for node in nodes] for nodes in (signs, factors)]
    assert found == [
        ["out[k + 1] += 2.0 * x - x[k - 1] / 3.0", "2.0 * x - x[k - 1] / 3.0", "x - 0.5"],
        ["2.0 * x", "x[k - 1] / 3.0"],
    ]
    changed = [plant.planted(SOURCE, node) for node in (*signs[:2], *factors)]
    assert [text.splitlines()[3].strip() for text in changed] == [
        "out[k + 1] -= (2.0 * x - x[k - 1] / 3.0)",
        "out[k + 1] += ((2.0 * x) + (x[k - 1] / 3.0))",
        "out[k + 1] += (2.0 * (2.0 * x)) - x[k - 1] / 3.0",
        "out[k + 1] += 2.0 * x - (2.0 * (x[k - 1] / 3.0))",
    ]


@pytest.mark.long
def test_what_it_plants_is_python_and_has_tests():
    for path in plant.files():
        text, name = path.read_text(), str(path.relative_to(ROOT))
        for nodes in plant.places(text):
            for node in nodes[:1] + nodes[-1:]:
                changed = ast.parse(plant.planted(text, node))
                assert ast.dump(changed) != ast.dump(ast.parse(text)), name
        assert all((ROOT / test).exists() for test in plant.tests_of(name)), name
