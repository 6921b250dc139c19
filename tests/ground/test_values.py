"""Shared checks of values: what they let through, and what they say of the rest."""

import numpy as np
import pytest
from scipy.sparse import csr_matrix

from rom.arguments import between, finite, not_negative, one_each, symmetric
from rom.errors import ConfigError, FileFormatError, ModelError, QualityGateError
from rom.names import check_ending, check_once

pytestmark = pytest.mark.once
SKEW = np.array([[2.0, 1.0], [0.0, 4.0]])


@pytest.mark.parametrize("ends", ["[]", "[)", "(]", "()"])
@pytest.mark.parametrize("x", [-1.0, 0.0, 0.5, 1.0, 2.0])
def test_an_interval_has_the_ends_that_its_brackets_say(ends, x):
    inside = 0.0 < x < 1.0 or (x == 0.0 and ends[0] == "[") or (x == 1.0 and ends[1] == "]")
    if inside:
        assert between("x", x, 0, 1, ends) == x
        return
    low = "at least 0" if ends[0] == "[" else "above 0"
    high = "at most 1" if ends[1] == "]" else "below 1"
    with pytest.raises(ConfigError) as caught:
        between("x", x, 0, 1, ends)
    assert str(caught.value) == f"x = {x:g} must be {low} and {high}."


def test_what_is_taken_is_a_float():
    assert type(between("x", np.int64(1), 0, 1)) is float and between("x", 1, 0, 1) == 1.0
    assert not_negative("x", 0) == 0.0
    assert finite("x", np.zeros((4, 3)), (None, 3)).shape == (4, 3)
    assert check_ending("a.b.PNG", "a picture", ".png").name == "a.b.PNG"
    for A in (SKEW + SKEW.T, csr_matrix(SKEW + SKEW.T), np.zeros((0, 0)), csr_matrix((3, 3))):
        symmetric("A", A, 0.0)
    symmetric("A", SKEW, 0.25)  # 1 of 4: the difference of the halves over the largest entry
    one_each("names", 3, "modes", 3)
    check_once(["a", "b"], "the input")


WRONG = {  # what is said: call, class
    "x = -0.5 must not be negative": (
        lambda: not_negative("x", -0.5, error=ModelError), ModelError),
    "x = nan is not finite; give finite numbers": (
        lambda: between("x", np.nan, 0, 1, error=ModelError), ModelError),
    "x = True is not made of numbers, needed is shape ()": (
        lambda: not_negative("x", True), ConfigError),
    "x has shape (3,), needed is (n, 3)": (lambda: finite("x", np.ones(3), (None, 3)), ConfigError),
    "x has shape (2, 2), needed is (n, 3)": (
        lambda: finite("x", np.ones((2, 2)), (None, 3), error=ModelError), ModelError),
    "x = [[1], [1, 2]] is not made of numbers, needed is finite numbers": (
        lambda: finite("x", [[1], [1, 2]], None), ConfigError),
    "2 names for 3 modes; give one for each": (
        lambda: one_each("names", 2, "modes", 3), ConfigError),
    "2 names for (3, 2) modes; give one for each": (
        lambda: one_each("names", (2,), "modes", (3, 2), error=ModelError), ModelError),
    "f: K is not symmetric: its halves differ by 0.25 of its largest entry": (
        lambda: symmetric("K", SKEW, 0.24, where="f"), QualityGateError),
    "S is not symmetric: its halves differ by 0.25": (
        lambda: symmetric("S", csr_matrix(SKEW), 0.24, error=ModelError), ModelError),
    "a/b.txt: a picture is written as .png, .gif. Write b.png": (
        lambda: check_ending("a/b.txt", "a picture", ".png", ".gif"), ConfigError),
    "the input 'a' is given twice; use each once": (
        lambda: check_once(["a", "b", "a"], "the input", FileFormatError), FileFormatError),
}  # fmt: skip


@pytest.mark.parametrize("said", WRONG)
def test_what_is_refused_is_said_with_what_is_wanted(said):
    call, kind = WRONG[said]
    with pytest.raises(kind) as caught:
        call()
    assert type(caught.value) is kind and said in str(caught.value)
