"""Sets of parameters on lines kept aside: by hand, and the right one is chosen."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.long import few
from cases.solid import STEEL, composite
from rom.components.updating.family_model import family_model
from rom.components.updating.frf_data import noisy
from rom.components.updating.normal_equations import responses_at
from rom.errors import ConfigError, ParameterError
from rom.updating import AddedMass, Channels, Comparison, Responses, compare

REGIONS = ("inner", "middle", "outer")
PARAMETERS = {f"E_{name}": rom.YoungsModulus(name, 0.4, 2.5) for name in REGIONS}
SENSORS = Channels(
    [[x, 0.1, 0.08] for x in (0.33, 0.67, 1.0)] * 2, [[0, 1, 0]] * 3 + [[0, 0, 1]] * 3
)
INPUTS = Channels([[1.0, 0.0, 0.0]], [[0, 1, 1]])
LINES, LEVEL, AVERAGES = np.linspace(30, 900, 83), 0.05, 60
HELD = {"root": "x y z rx ry rz"}
MASS = AddedMass("tip", 0.2, 0.1, 10)
SETS = {
    "one modulus": {"free": ("E_inner",)},
    "two moduli": {"free": ("E_inner", "E_outer")},
    "three moduli": {"free": tuple(PARAMETERS)},
    "two moduli and a mass": {"free": ("E_inner", "E_outer"), "attached": {"mass": MASS}},
}
COMMON = {"fixed": HELD, "damping": 0.02}


@pytest.fixture(scope="module")
def family():
    where = dict(zip(range(6), np.repeat(REGIONS, 2), strict=True))
    model = composite(dict.fromkeys(REGIONS, STEEL), lambda c: where[c[0]], cells=(6, 1, 1))
    return rom.reduce_parametric(
        model, parameters=PARAMETERS, method=rom.CraigBampton(4),
        interfaces={"root": "rbe2", "tip": "rbe2"}, certify=False,
    )  # fmt: skip


def measured(family, seed, true, **there):
    rows = (SENSORS.rows(family.body, "sensor"), INPUTS.rows(family.body, "input"))
    model = family_model(family, rows, there, {}, HELD)
    x = np.log([true.get(name, 1.0) for name in model.names])
    H = responses_at(model, x, np.array([0.02]), 2 * np.pi * LINES)
    H = noisy(H, LEVEL, np.random.default_rng(seed))
    return Responses(LINES, H, SENSORS, INPUTS, 1 / (1 + AVERAGES * LEVEL**2), AVERAGES)


def test_lines_are_foretold_by_the_update_of_all_others(family):
    """By hand, in thirds: |ln H - ln H_test|^2 over the variance of an average."""
    test = measured(family, 0, {"E_inner": 1.2})
    found = compare(family, test, {"one modulus": SETS["one modulus"]}, folds=3, **COMMON)
    for first in range(3):
        aside = np.arange(LINES.size) % 3 == first
        part = replace(test, frequencies=LINES[~aside], H=test.H[~aside])
        own = rom.update(family, part, free=("E_inner",), **COMMON)
        log = np.log(own.responses(LINES[aside]) / test.H[aside])
        variance = LEVEL**2 / 2 * AVERAGES / (AVERAGES - 1) * (1 + LEVEL**2 / 2)
        assert_allclose(found.by_line[0, aside], (np.abs(log) ** 2).sum(axis=(1, 2)) / variance,
                        rtol=1e-6)  # fmt: skip
    assert_allclose(found.expected, 2 * 6)
    assert_allclose(found.misfit["one modulus"], found.by_line.mean() / 12)


def test_noise_of_forces_follows_its_lines(family):
    test = replace(measured(family, 0, {"E_inner": 1.2}), force_noise=0.01, estimator="H1")
    each = replace(test, force_noise=np.full((LINES.size, test.H.shape[2]), 0.01))
    one, other = (
        compare(family, t, {"one modulus": SETS["one modulus"]}, folds=2, **COMMON)
        for t in (test, each)
    )
    assert_allclose(other.by_line, one.by_line, rtol=1e-9)


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
    """Four structures, four sets; noise alone is left of the right one."""
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
    with pytest.raises(ConfigError, match="at least one set"):
        compare(family, test, {}, **COMMON)
    with pytest.raises(ConfigError, match="folds = 1"):
        compare(family, test, SETS, folds=1, **COMMON)
    with pytest.raises(ConfigError, match="folds = 84"):
        compare(family, test, SETS, folds=84, **COMMON)
    with pytest.raises(ParameterError, match="no parameter 'E'"):
        compare(family, test, {"wrong": {"free": ("E",)}}, **COMMON)


def test_coherence_of_each_line_goes_with_it(family):
    """Every third line has none: not counted, wherever it is kept."""
    test = measured(family, 0, {"E_inner": 1.2})
    c = np.full(test.H.shape, float(test.coherence))
    c[::3] = 0.0
    found = compare(family, replace(test, coherence=c), {"one": SETS["one modulus"]}, **COMMON)
    assert not found.by_line[0, ::3].any() and not found.expected[::3].any()
    assert_allclose(found.misfit["one"], 1.0, atol=0.2)
