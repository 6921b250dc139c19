"""Tests with faults drawn at random: each is refused, or fails its verdict, by name and place."""

from dataclasses import replace

import numpy as np
import pytest

import rom
from cases.components.updating import assert_right, crossed, family_of
from cases.long import ROM_LONG
from rom.components.updating.family_model import family_model
from rom.components.updating.frf_data import noisy
from rom.components.updating.normal_equations import responses_at
from rom.errors import RomError
from rom.updating import Channels, Responses

PARAMETERS = {name: rom.YoungsModulus(name, 0.5, 2.0) for name in ("inner", "outer")}
GRID = [[k / 6, y, 0.08] for k in (2, 3, 4, 5) for y in (0.0, 0.1)]
SENSORS = crossed(GRID)
INPUTS = Channels([[1.0, 0.0, 0.0], [0.5, 0.1, 0.08]], [[0, 1, 1], [0, 1, -0.5]])
LINES = np.linspace(20, 700, 80)
AVERAGES, LEVEL, HELD = 50, 0.05, ("root",)
COHERENCE = 1 / (1 + AVERAGES * LEVEL**2)


def reduced(length=1.0):
    return family_of(PARAMETERS, (6, 1, 1), 16, size=(length, 0.1, 0.08))


@pytest.fixture(scope="module")
def family():
    return reduced()


def measured(family, rng, lines=LINES, factor=None):
    """A test of the family at factors near one, or of which one is given."""
    rows = [side.rows(family.body, "channel", 0.5) for side in (SENSORS, INPUTS)]
    model = family_model(family, rows, {}, {}, HELD)
    x = rng.uniform(-0.2, 0.2, 2)
    if factor:
        x[0] = np.log(factor)
    H = noisy(responses_at(model, x, np.array([0.02]), 2 * np.pi * lines), LEVEL, rng)
    return Responses(lines, H, SENSORS, INPUTS, COHERENCE, AVERAGES)


SCALES = [9.80665, 1 / 9.80665, 1000.0, 0.001]


def one_of(number, factors, words, *before):
    """A fault: the responses of one channel times a factor."""

    def fault(family, test, rng):
        k, H = rng.integers(number), test.H.copy()
        H[:, *before, k] *= rng.choice(factors)
        return replace(test, H=H), [words.format(k)]

    return fault


def without_a_signal(family, test, rng):
    k, H = rng.integers(16), test.H.copy()
    phases = np.exp(2j * np.pi * rng.random((len(H), 2)))
    H[:, k] = np.abs(H[:, k]).mean(axis=0) * phases
    return replace(test, H=H), [f"sensor {k}", f"sensor, {k}"]


def moved_off(family, test, rng):
    k, points = rng.integers(16), np.array(SENSORS.points)
    points[k] += [0, *rng.choice([-1, 1], 2) * rng.uniform(0.15, 3.0, 2)]
    return replace(test, sensors=Channels(points, SENSORS.directions)), [f"sensor {k} at"]


def along_another_axis(family, test, rng):
    k, d = rng.integers(16), np.array(SENSORS.directions, dtype=float)
    d[k] = d[k][[0, 2, 1]]
    words = [f"sensor {k}", f"sensors {k} of", f"sensors {k ^ 1} of", f"sensor, {k}"]
    return replace(test, sensors=Channels(SENSORS.points, d)), words


def exchanged(family, test, rng):
    """Two cables: one sensor along y and one along z."""
    k, m = 2 * rng.integers(8), 2 * rng.integers(8) + 1
    order = np.arange(16)
    order[[k, m]] = m, k
    some = [f"sensor{comma} {n}" for n in (k, m) for comma in ("", ",")]
    return replace(test, H=test.H[:, order]), some


def in_millimetres(family, test, rng):
    points = rng.choice([1000.0, 100.0]) * np.asarray(SENSORS.points)
    words = ["millimetres taken", "centimetres taken"]
    return replace(test, sensors=Channels(points, SENSORS.directions)), words


def above_the_band(family, test, rng):
    f = LINES * rng.uniform(20, 60)
    return replace(measured(family, rng, f), frequencies=f), ["the band of the basis"]


def too_few(family, test, rng):
    one = test.sensors.some([3]), test.inputs.some([0])
    few = Responses(LINES[:1], test.H[:1, 3:4, :1], *one, COHERENCE, AVERAGES)
    return few, ["usable numbers for"]


def with_gaps(family, test, rng):
    line, H = rng.integers(LINES.size), test.H.copy()
    H[line, rng.integers(16), rng.integers(2)] = rng.choice([np.nan, np.inf, 0.0])
    return (lambda: replace(test, H=H)), [f"{LINES[line]:.5g} Hz"]


def of_another_body(family, test, rng):
    other = measured(reduced(rng.uniform(1.4, 2.0)), rng)
    return other, ["chi-square of all", "FRAC", "responses are", "gives"]


def noisier_forces_than_all(family, test, rng):
    noise = rng.uniform(3, 40) * LEVEL * np.sqrt(AVERAGES)  # a percentage taken for a ratio
    return replace(test, force_noise=noise, estimator="H1"), ["force_noise alone has"]


FAULTS = {
    "moved off": moved_off,
    "in millimetres": in_millimetres,
    "of another scale": one_of(16, SCALES, "sensor {} gives"),
    "all of another scale": lambda family, test, rng: (
        replace(test, H=rng.choice(SCALES) * test.H),
        ["all responses are"],
    ),
    "turned": one_of(16, [-1], "sensor {} moves against"),
    "input turned": one_of(2, [-1], "input {} moves against", slice(None)),
    "along another axis": along_another_axis,
    "exchanged": exchanged,
    "above the band": above_the_band,
    "too few": too_few,
    "with gaps": with_gaps,
    "out of range": lambda family, test, rng: (
        measured(family, rng, factor=rng.choice([0.3, 3.5])),
        ["inner inside", "chi-square of all"],
    ),
    "of another body": of_another_body,
    "of a wrong coherence": lambda family, test, rng: (
        lambda: replace(test, coherence=rng.choice([-0.1, 1.0, 1.3, np.nan])),
        ["coherence"],
    ),
    "noisier forces than all": noisier_forces_than_all,
    "lines out of order": lambda family, test, rng: (
        lambda: replace(test, frequencies=LINES[np.r_[:4, 40, 5:40, 4, 41:80]]),
        ["must ascend"],
    ),
    "a quarter less": one_of(16, [0.75], "worst sensor, {}"),
    "without a signal": without_a_signal,
}


@pytest.mark.parametrize("residual", ["responses", "response-function"])
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_named_with_its_place(family, fault, residual):
    for seed in range(4 if ROM_LONG else 2):
        rng = np.random.default_rng([seed, list(FAULTS).index(fault)])
        test, words = FAULTS[fault](family, measured(family, rng), rng)
        try:
            found = rom.update(family, test() if callable(test) else test, fixed=HELD,
                               damping=0.02, residual=residual)  # fmt: skip
        except RomError as error:
            message = str(error)
        else:
            assert not found.verdict.ok, f"{fault}, seed {seed}: {found}"
            message = str(found)
        assert any(word in message for word in words), f"{words}, seed {seed}: {message}"


@pytest.mark.parametrize("seed", range(4))
def test_without_a_fault_nothing_is_refused(family, seed):
    assert rom.update(family, measured(family, np.random.default_rng(seed)), fixed=HELD).verdict.ok


def test_lines_beside_poles_that_are_wrong_can_count_less(family):
    rng = np.random.default_rng(5)
    test = measured(family, rng, factor=1.15)
    poles = rom.update(family, test, fixed=HELD).body.frequencies(6, fixed=HELD)
    # a record too short: resonances too low within some half bandwidths of 2 %
    far = (LINES[:, None] - poles) / (0.02 * poles)
    left = 1 - 0.4 * np.exp(-0.5 * (far / 2) ** 2).sum(axis=1)
    lost = replace(test, H=test.H * np.clip(left, 0.2, 1.0)[:, None, None])
    assert not rom.update(family, lost, fixed=HELD, damping=0.02).verdict.ok
    for c in (COHERENCE, np.full(lost.H.shape, COHERENCE)):  # known, or of the same records
        near = replace(lost, coherence=c)
        found = rom.update(family, near, fixed=HELD, damping=0.02, beside_poles=60.0)
        assert found.verdict.ok, found
    right = rom.update(family, test, fixed=HELD, damping=0.02, beside_poles=60.0)
    assert_right(right, {"inner": 1.15})
    assert right.deviations["inner"] > rom.update(family, test, fixed=HELD).deviations["inner"]
