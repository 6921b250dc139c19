"""The control chart: a partition, no chatter, every class reached, five inputs for 15 joints."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cases.refusals import refuses
from rom.components.hand.control_chart import COUPLINGS, GROUPS, NO_GROUP, Chart, envelope, muscle
from rom.errors import ConfigError

DT = 1e-2


def ray(angle, effort, n=100):
    """A steady point of the square."""
    a = np.radians(angle)
    size = effort / max(np.cos(a), np.sin(a))
    return np.full(n, size * np.cos(a)), np.full(n, size * np.sin(a))


def followed(*rays):
    return Chart().follow(*(np.concatenate(part) for part in zip(*rays, strict=True)), DT)


def test_the_square_is_covered_once():
    x, y = np.meshgrid(np.linspace(0, 1, 201), np.linspace(0, 1, 201))
    groups = Chart().group(x, y)
    assert set(np.unique(groups)) == {NO_GROUP, 0, 1, 2, 3, 4}
    assert ((groups == NO_GROUP) == (np.maximum(x, y) < 0.12)).all()
    expected = np.clip(np.degrees(np.arctan2(y, x)) // 18.0000001, 0, 4)
    assert (groups == expected)[groups != NO_GROUP].mean() > 0.99


@pytest.mark.parametrize("group", range(5))
def test_every_group_is_reached_and_drawn(group):
    assert np.linalg.matrix_rank(COUPLINGS) == 4 and len(GROUPS) == 5
    commands = Chart().follow(*ray(18 * group + 9 if group != 2 else 38, 0.46), DT)
    assert commands.groups[-1] == group
    assert_allclose(commands.pulls[-1, group], 7e-3)
    assert (np.delete(commands.pulls[-1], group) == 0).all()
    assert ((commands.fingers()[-1] > 0) == (COUPLINGS[:, group] > 0)).all()


def test_pull_follows_effort_no_faster_than_allowed():
    chart = Chart()
    assert_allclose(chart.command([0.0, 0.12, 0.46, 0.8, 1.0]), [0, 0, 7e-3, 14e-3, 14e-3])
    pulls = chart.follow(*ray(5, 1.0), DT).pulls[:, 0]
    assert_allclose(np.diff(pulls).max(), 0.04 * DT)


def test_noise_on_a_border_does_not_chatter():
    rng = np.random.default_rng(5)
    angle = np.radians(36 + rng.uniform(-1, 1, 2000))
    commands = Chart().follow(0.5 * np.cos(angle), 0.5 * np.sin(angle), DT)
    assert (np.diff(commands.groups[1:]) == 0).all()


def test_a_group_is_left_only_after_a_while():
    first, short, long = ray(9, 0.5, 50), ray(60, 0.7, 14), ray(60, 0.7, 30)
    brief = followed(first, short, first)
    assert (brief.groups == 0).all()
    assert_allclose(brief.pulls[63], brief.pulls[49])  # nobody moves in doubt
    lasting = followed(first, long)
    assert lasting.groups[-1] == 3
    assert_allclose(lasting.pulls[-1, 0], lasting.pulls[49, 0])  # the first group holds


def test_weak_signals_hold_and_both_muscles_switch_to_opening():
    parts = (9, 0.8, 60), (9, 0.05, 20), (45, 0.9, 40), (9, 0.05, 5), (9, 0.5, 60)
    commands = followed(*(ray(*part) for part in parts))
    assert not commands.opening[79] and commands.opening[-1]
    assert np.diff(commands.opening.astype(int)).sum() == 1
    assert_allclose(commands.pulls[79, 0], 14e-3)
    assert commands.pulls[-1, 0] == 0.0


def test_envelope_of_noise_is_its_strength():
    rng = np.random.default_rng(6)
    activation = np.repeat([0.0, 0.4, 0.8], 8000)
    effort = envelope(muscle(activation, 1e-3, rng), 1e-3)
    means = [effort[k + 2000 : k + 8000].mean() for k in (0, 8000, 16000)]
    assert_allclose(means, [0.0, 0.4, 0.8], atol=0.03)


def test_signals_that_do_not_fit_are_refused():
    refuses(ConfigError, "2 samples", lambda: Chart().follow(np.zeros(3), np.zeros(2), DT))
    refuses(ConfigError, "miss 450 Hz", envelope, np.zeros(10), 2e-3)
