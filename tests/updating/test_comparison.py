"""Which parameters: sets on lines kept aside, and a wrong model whose fault is named."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.components import updating
from cases.components.updating import family_of, noisy_test, refuse
from cases.long import few
from rom.errors import ParameterError
from rom.updating import AddedMass, Channels, Comparison, GroundSpring, compare

REGIONS = ("inner", "middle", "outer")
PARAMETERS = {f"E_{name}": rom.YoungsModulus(name, 0.4, 2.5) for name in REGIONS}
MODULI, ONE = tuple(PARAMETERS), {"one modulus": {"free": ("E_inner",)}}
PARAMETERS |= {f"rho_{name}": rom.Density(name, 0.4, 2.5) for name in REGIONS}
EDGE = [[x, 0.1, 0.08] for x in (0.33, 0.67, 1.0)]
SENSORS = Channels(EDGE * 2, [[0, 1, 0]] * 3 + [[0, 0, 1]] * 3)
INPUTS = Channels([[1.0, 0.0, 0.0]], [[0, 1, 1]])
LINES, LEVEL, AVERAGES = np.linspace(30, 900, 83), 0.05, 60
HELD = {"root": "x y z rx ry rz"}
MASS = AddedMass("tip", 0.2, 0.1, 10)
SETS = {
    **ONE,
    "two moduli": {"free": ("E_inner", "E_outer")},
    "three moduli": {"free": MODULI},
    "two moduli and a mass": {"free": ("E_inner", "E_outer"), "attached": {"mass": MASS}},
}
COMMON = {"fixed": HELD, "damping": 0.02}


@pytest.fixture(scope="module")
def family():
    return family_of(PARAMETERS, (6, 1, 1), 4, REGIONS)


def measured(family, seed, true, **there):
    how = {"level": LEVEL, "averages": AVERAGES, "seed": seed, "attached": there, "fixed": HELD}
    return noisy_test(family, true, (SENSORS, INPUTS), LINES, **how)


def test_lines_are_foretold_by_the_update_of_all_others(family):
    """By hand, in thirds: |ln H - ln H_test|^2 over the variance of an average."""
    test = measured(family, 0, {"E_inner": 1.2})
    found = compare(family, test, ONE, folds=3, **COMMON)
    for first in range(3):
        aside = np.arange(LINES.size) % 3 == first
        part = replace(test, frequencies=LINES[~aside], H=test.H[~aside])
        own = rom.update(family, part, free=("E_inner",), **COMMON)
        log = np.log(own.responses(LINES[aside]) / test.H[aside])
        variance = LEVEL**2 / 2 * AVERAGES / (AVERAGES - 1) * (1 + LEVEL**2 / 2)
        expected = (np.abs(log) ** 2).sum(axis=(1, 2)) / variance
        assert_allclose(found.by_line[0, aside], expected, rtol=1e-6)
    assert_allclose(found.expected, 2 * 6)
    assert_allclose(found.misfit["one modulus"], found.by_line.mean() / 12)


def test_noise_of_forces_and_coherence_of_each_line_go_with_it(family):
    test = measured(family, 0, {"E_inner": 1.2})
    one = replace(test, force_noise=0.01, estimator="H1")
    each = replace(one, force_noise=np.full((LINES.size, test.H.shape[2]), 0.01))
    same, other = (compare(family, t, ONE, folds=2, **COMMON) for t in (one, each))
    assert_allclose(other.by_line, same.by_line, rtol=1e-9)
    c = np.full(test.H.shape, float(test.coherence))
    c[::3] = 0.0
    found = compare(family, replace(test, coherence=c), ONE, **COMMON)
    assert not found.by_line[0, ::3].any() and not found.expected[::3].any()
    assert_allclose(found.misfit["one modulus"], 1.0, atol=0.2)


@pytest.mark.parametrize("seed", few(1, range(2)))
@pytest.mark.parametrize(
    ("true", "there", "best"),
    [
        ({"E_inner": 1.2}, {}, "one modulus"),
        ({"E_inner": 1.2, "E_outer": 0.8}, {}, "two moduli"),
        ({"E_middle": 1.3}, {}, "three moduli"),
        ({"E_outer": 0.8, "mass": 0.7}, {"mass": MASS}, "two moduli and a mass"),
    ],
)
def test_the_set_that_is_right_and_no_larger_one_is_chosen(family, true, there, best, seed):
    found = compare(family, measured(family, seed, true, **there), SETS, folds=3, **COMMON)
    assert found.best == best, str(found)
    assert_allclose(found.misfit[best], 1.0, atol=0.2)
    too_few = {"two moduli": ["one modulus"], "three moduli": ["one modulus", "two moduli"],
               "two moduli and a mass": ["one modulus", "two moduli"]}  # fmt: skip
    for name in too_few.get(best, []):
        assert found.misfit[name] > 1.3 and found.worse[name] > 4
    assert f"enough: {best}" in str(found)


def test_a_set_is_worse_by_its_paired_difference():
    """Ten lines; 1 and 3 more by turns have the mean 2 and deviation 1: 20 over sqrt(10)."""
    base = np.arange(10.0)
    more = base + np.tile([1.0, 3.0], 5)
    found = Comparison(("a", "b"), np.array([2, 1]), np.array([base, more]), np.full(10, 2.0))
    assert_allclose(found.worse["b"], 20 / np.sqrt(10))
    assert found.worse["a"] == 0 and found.best == "a"
    one = base + np.where(base == 3, 100.0, 0.0)  # all on a line: of noise, sqrt(2 20)
    found = Comparison(("a", "b"), np.array([2, 1]), np.array([base, one]), np.full(10, 2.0))
    assert_allclose(found.worse["b"], 100 / np.sqrt(40))
    near = Comparison(("a", "b"), np.array([2, 1]), np.array([base, base[::-1]]), np.full(10, 2.0))
    assert near.best == "b"


def test_what_cannot_be_compared_is_named(family):
    test = measured(family, 0, {})
    wrong = {"wrong": {"free": ("E",)}}
    refuse(
        (lambda: compare(family, test, {}, **COMMON), "at least one set"),
        (lambda: compare(family, test, SETS, folds=1, **COMMON), "folds = 1"),
        (lambda: compare(family, test, SETS, folds=84, **COMMON), "folds = 84"),
        (lambda: compare(family, test, wrong, **COMMON), ParameterError, "no parameter 'E'"),
    )


POINTS = [[x, 0.1, 0.08] for x in (0.33, 0.5, 0.67, 1.0)]
EIGHT = Channels(POINTS * 2, [[0, 1, 0]] * 4 + [[0, 0, 1]] * 4)
SHAKERS = Channels([[1.0, 0.0, 0.0], [0.5, 0.1, 0.08]], [[0, 1, 1], [0, 1, -0.5]])
BAND = np.linspace(30, 700, 120)
HINGE = {"root": "x y z rx rz"}  # the clamp about y is a spring of the model
CLAMP = GroundSpring("root", (0, 0, 0, 0, 4e6, 0), 0.1, 10)
OFFERED = {
    "joint at the tip": GroundSpring("tip", (0, 0, 1e5), 0.1, 10),
    "twist at the tip": GroundSpring("tip", (0, 0, 0, 1e3, 0, 0), 0.1, 10),
    "turn at the root": GroundSpring("root", (0, 0, 0, 0, 4e6, 0), 0.1, 10),
    "mass at the tip": AddedMass("tip", 1.0, 0.1, 10),
}


def found(family, true, seed, on_force=0.0, **there):
    """Update of moduli alone, by a test of a structure that has more to it."""
    channels, more = (EIGHT, SHAKERS), {"fixed": HINGE, "attached": {"clamp": CLAMP} | there}
    test = noisy_test(family, true, channels, BAND, level=0.03, averages=100, seed=seed, **more)
    if on_force:
        H = updating.exact_responses(updating.model_of(family, channels, **more), true, BAND)
        rng = np.random.default_rng(seed)
        test = updating.averaged(H, channels, BAND, rng, noise=(on_force, 0.1), n=50)
    options = {"fixed": HINGE, "attached": {"clamp": CLAMP}, "prior": {"clamp": 1e-4}}
    return rom.update(family, test, free=MODULI, candidates=OFFERED, damping=0.02, **options)


WRONG = [
    ({"joint": 0.3}, {"joint": OFFERED["joint at the tip"]}, "joint at the tip", 1),
    ({"clamp": 0.85}, {}, "turn at the root", -1),
    ({"rho_middle": 1.03}, {}, "rho_middle", 1),
    ({"mass": 0.15}, {"mass": OFFERED["mass at the tip"]}, "mass at the tip", 1),
]


# noise that sensors share as large as their own and three times: limits are wider then
DRAWN = [(0, 0.0), (1, 0.0), (2, 0.0), (1, 0.1), (1, 0.3)]


@pytest.mark.parametrize(("seed", "on_force"), DRAWN)
@pytest.mark.parametrize(("true", "there", "name", "sign"), WRONG)
def test_the_largest_score_names_what_is_wrong(family, true, there, name, sign, seed, on_force):
    update = found(family, true, seed, on_force, **there)
    assert not update.verdict.ok
    assert max(update.scores, key=lambda k: abs(update.scores[k])) == name, update.scores
    assert sign * update.scores[name] > (6 if on_force else 10)
    if name in ("joint at the tip", "turn at the root") and not on_force:  # they bend along z
        assert np.argmax(update.by_sensor) >= 4
    if not on_force:
        assert any(f"largest score, {name}" in row.quantity for row in update.verdict.failures)


@pytest.mark.parametrize(("seed", "on_force"), DRAWN)
def test_of_a_right_model_nothing_is_named(family, seed, on_force):
    update = found(family, {"E_middle": 1.1}, seed, on_force)
    assert update.verdict.ok, str(update.verdict)
    assert on_force or max(abs(score) for score in update.scores.values()) < 4
