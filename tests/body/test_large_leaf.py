"""A leaf that guides a stage: its elastica, and mistakes in the tensors, which it must notice.

A body of large deflection relies on two sets of numbers, those of third and of fourth order. Every
factor and every index of the few lines that make and contract them is changed here, one at a time.
"""

import ast
import inspect
import textwrap

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq

from cases.beam import elastica, load_at
from cases.long import COARSE
from cases.mbs.slender import reduced, slender
from rom.body.nonlinear import quartic
from rom.body.nonlinear.quartic import Quartic
from rom.body.nonlinear.statics import follow
from rom.errors import ModelError

pytest.importorskip("dolfinx", reason="dolfinx is not installed")
pytestmark = COARSE
GUIDED = {"tip": "rxryrz"}
STEEPEST = 0.5  # slope half way [rad]
RTOL = 3e-3


def exact_leaf(slope):
    """Force times L^2 / EI, deflection and shortening over L of a guided leaf, by its slope.

    Half of it is a cantilever under a force across its end.
    """
    load = load_at(slope)
    _, along, across = elastica(load)
    return 4 * load, across, 1 - along


def stored(slope):
    """Work of the force on the way, over EI / L."""
    F, across, _ = np.array([exact_leaf(x) for x in np.linspace(1e-6, slope, 200)]).T
    return np.sum(0.5 * (F[1:] + F[:-1]) * np.diff(across))


@pytest.fixture(scope="module")
def leaf():
    """The body, what its energy was made from, and forces and known motions at two slopes."""
    model, EI = slender(50, 32)
    made = []
    whole = Quartic.from_gram.__func__

    def kept(cls, G, r):
        made.append((G, r))
        return whole(cls, G, r)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Quartic, "from_gram", classmethod(kept))
        known = np.array([exact_leaf(slope) for slope in (STEEPEST / 2, STEEPEST)])
        work = [EI * stored(slope) for slope in (STEEPEST / 2, STEEPEST)]
        body = reduced(model, (0, known[-1, 0] * EI, 0, 0, 0, 0), n_modes=4, active=4,
                       fixed=GUIDED, tol=1e-5)  # fmt: skip
    return body, made[-1], known[:, 0] * EI, np.column_stack([known[:, 1:], work])


def guided(leaf, law):
    """(2, 3) deflection, shortening and energy at rest, the energy by a class."""
    body, gram, forces, _ = leaf
    energy = law.from_gram(*gram)
    along, across = body.marker("tip").translation[:2]
    q = follow(energy, np.outer(forces, across), body.mean_rows(GUIDED))
    return np.column_stack([q @ across, -(q @ along), [energy.energy(x) for x in q]])


def test_a_guided_leaf_hardens_and_comes_back_as_its_elastica_says(leaf):
    found = guided(leaf, Quartic)
    assert_allclose(found, leaf[3], rtol=RTOL)
    linear = leaf[2] / 12 / leaf[2][0] * exact_leaf(STEEPEST / 2)[0]
    assert linear[1] / found[1, 0] > 1.08  # a linear leaf is softer
    slope = brentq(lambda s: exact_leaf(s)[1] - 1e-3, 1e-4, 0.1)
    assert_allclose(exact_leaf(slope)[2], 0.6e-6, rtol=1e-4)


class Change(ast.NodeTransformer):
    """Changes one place: a factor is doubled or trebled, or an index becomes its neighbour."""

    def __init__(self, which, times):
        self.left, self.times, self.inside = which, times, 0

    def visit_Subscript(self, node):
        self.inside += 1
        node.slice = self.visit(node.slice)
        self.inside -= 1
        return node

    def visit_Call(self, node):
        """Sizes of arrays are left as they are."""
        return node if getattr(node.func, "id", "") == "entries" else self.generic_visit(node)

    def visit_Name(self, node):
        if self.inside and node.id in "ijkl" and self.times == 2 and self._here():
            node.id = "ijkli"["ijkl".index(node.id) + 1]
        return node

    def visit_Constant(self, node):
        number = isinstance(node.value, int | float) and not isinstance(node.value, bool)
        if number and not self.inside and node.value and self.times and self._here():
            node.value *= self.times
        return node

    def _here(self):
        self.left -= 1
        return self.left == -1


def mutants(name):
    """Laws in which one place of a method is changed, and what that reads like."""
    method = inspect.getattr_static(Quartic, name)
    text = textwrap.dedent(inspect.getsource(getattr(method, "__func__", method)))
    for times in (2, 3):
        for which in range(200):
            change = Change(which, times)
            tree = change.visit(ast.parse(text))
            if change.left >= 0:
                break
            scope = dict(vars(quartic))
            exec(compile(ast.fix_missing_locations(tree), name, "exec"), scope)
            yield type("Changed", (Quartic,), {name: scope[name]}), ast.unparse(tree)


@pytest.mark.parametrize("name", ["from_gram", "expansion"])
def test_any_factor_or_index_that_is_wrong_is_noticed(leaf, name):
    """Newton's method finds other states then, or none."""
    survived = []
    for law, text in mutants(name):
        try:
            found = guided(leaf, law)
        except (ModelError, ArithmeticError, LookupError, NameError, ValueError):
            continue
        if np.allclose(found, leaf[3], rtol=RTOL, atol=0):
            survived.append(text)
    assert not survived, "\n\n".join(survived)
