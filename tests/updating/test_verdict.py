"""What the data say, against least squares on numbers of their own; one mistake turns one red."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom.components.updating.frf_data as frf
from rom.components.updating.models import likeness
from rom.components.updating.normal_equations import Data, Sums
from rom.components.updating.verdict import chi_row, scores, unseen_directions, verdict

SHAPE = (6, 2, 1)


def data_of(weight):
    return Data(2 * np.pi * np.arange(1.0, 7.0), np.zeros(SHAPE, complex), weight)


def test_scores_are_those_of_one_more_column_in_least_squares():
    """A column more with the estimate b +- s has the score b / s; all others are sought again."""
    rng = np.random.default_rng(0)
    J, r = rng.standard_normal((40, 3)), rng.standard_normal(40)
    J[:, 2] += 0.8 * J[:, 0] - 0.5 * J[:, 1]
    found = scores(J.T @ J, J.T @ r, np.array([0, 1]), ("a", "b", "c"))
    change, covariance = -np.linalg.lstsq(J, r, rcond=None)[0], np.linalg.inv(J.T @ J)
    assert list(found) == ["c"]
    assert_allclose(found["c"], change[2] / np.sqrt(covariance[2, 2]), rtol=1e-10)
    J = np.array([[1.0, 2.0], [2.0, 4.0], [3.0, 6.0]])
    assert scores(J.T @ J, J.T @ np.ones(3), np.array([0]), ("a", "b")) == {}


@pytest.mark.parametrize(("width", "named"), [(3.9, True), (4.1, False)])
def test_a_direction_is_seen_from_half_its_range_on(width, named):
    """Standard deviation 2: half of 4. The other one is known to 0.01 of a range of 1."""
    found = unseen_directions(np.diag([0.25, 1e4]), np.array([width, 1.0]), ("a", "b"))
    assert [list(direction) for direction in found] == [["a"]] * named


def test_each_row_is_over_its_own_expectation_and_the_worst_sensor_is_so_by_its_deviations():
    """Ten values of twelve count: 20 numbers less 3; bands and sensors by theirs."""
    weight = np.ones(SHAPE)
    weight[5] = 0.0
    squares = 2.0 * weight
    squares[3, 1] += 5.0
    sums = Sums(np.eye(3), np.zeros(3), squares, 0 * np.eye(3))
    report = verdict(sums, data_of(weight), 3, {}, [])
    values = [row.value for row in report.rows]
    assert_allclose(values, [25 / 17, 15 / 10, 9 / 4])
    assert [row.quantity.split(",")[0] for row in report.rows[1:]] == ["worst sensor", "worst band"]
    assert "worst sensor, 1" in report.rows[1].quantity and "4 to 4 Hz" in report.rows[2].quantity
    # of two numbers 12 are 5 deviations too much, of ten 24 are 3.1: 14 more, but less rare
    weight = np.ones(SHAPE)
    weight[1:, 0] = 0.0
    weight[5] = 0.0
    squares = weight * [[12.0], [4.8]]
    report = verdict(Sums(np.eye(1), np.zeros(1), squares), data_of(weight), 0, {}, [])
    assert "worst sensor, 0" in report.rows[1].quantity


def test_limits_are_those_of_all_trials_and_allow_for_what_is_not_known_of_variances():
    """0.001 of a right model; 0.0005 for each of two sensors. Chi-square of two: -2 ln P / 2."""
    weight = np.zeros(SHAPE)
    weight[0] = 1.0
    report = verdict(Sums(np.eye(1), np.zeros(1), 2 * weight), data_of(weight), 0, {}, [])
    assert report.rows[1].limit == f"<= {-np.log(0.0005):g}"
    # half the freedom: chi-square of two; a scale that varies by a half: F of two and four
    half = chi_row("x", 1.0, 4.0, 1, known=0.5)
    assert half.limit == f"<= {-np.log(0.001):g}"
    scaled = chi_row("x", 1.0, 2.0, 1, scale=0.5)
    assert scaled.limit == f"<= {2 * (0.001**-0.5 - 1):g}"


def test_noise_has_the_level_of_both_parts_together():
    H = frf.noisy(np.full(200_000, 3.0 + 4.0j), 0.1, np.random.default_rng(0))
    assert_allclose(np.sqrt(np.mean(np.abs(H / (3 + 4j) - 1) ** 2)), 0.1, rtol=0.01)


@pytest.mark.filterwarnings("error")
def test_a_sensor_that_does_not_count_is_no_part_of_the_likeness():
    """Two of three FRAC stay: one, and that of lines in quadrature to half of the others."""
    used = np.ones((2, 3, 1), dtype=bool)
    used[:, 2] = False
    H, G = np.ones((2, 3, 1), dtype=complex), np.ones((2, 3, 1), dtype=complex)
    G[0, 1] = 0.0  # |1 + 0|^2 / (2 1)
    G[:, 2] = np.nan
    assert_allclose(likeness(H, G, used).value, 1 - (1.0 + 0.5) / 2)
