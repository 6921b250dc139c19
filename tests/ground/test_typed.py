"""Arguments: what stands for the same thing is taken, the rest is refused by name and value."""

import inspect
from collections.abc import Mapping
from pathlib import Path
from timeit import timeit
from types import MappingProxyType, SimpleNamespace
from typing import Literal

import numpy as np
import pytest
from scipy.sparse import csr_matrix

import rom
from cases.refusals import refused, refuses
from rom.arguments import between, finite, not_negative, one_each, symmetric, typed
from rom.errors import ConfigError, FileFormatError, ModelError, QualityGateError
from rom.model import Array
from rom.names import check_ending, check_once

NO_NUMBERS = np.zeros(0)


@typed
def taken(  # noqa: PLR0913  one of each kind
    x: float = 0.0,
    n: int = 0,
    names: tuple[str, ...] = (),
    rows: "list[float] | None" = None,
    far: "Unknown | None" = None,
    numbers: Array = NO_NUMBERS,
    *rest: int,
    path: str | Path = "",
    way: Literal["up", "down"] = "up",
    parts: "Mapping[str, Unknown] | None" = None,
    **more: float,
):
    return SimpleNamespace(**locals())


class Unknown(SimpleNamespace):
    """A class that the annotation above does not know."""


def test_what_stands_for_the_same_thing_becomes_it():
    got = taken(np.float64(1.5), np.int32(3), "root", (1, 2.0), Unknown(), [1, 2], path=Path("x"))
    assert (got.x, got.n, got.names, got.rows) == (1.5, 3, ("root",), [1, 2.0])
    assert type(got.n) is int and got.numbers.dtype == float and got.path == Path("x")
    assert taken(names=(name for name in "ab")).names == ("a", "b")
    assert taken(x=np.array(2.0)).x == 2.0 and taken(k=1.0).more == {"k": 1.0}


class Asked(Mapping):
    """Makes its values when they are asked for, which takes long."""

    def __getitem__(self, name):
        raise AssertionError(name)

    def __iter__(self):
        return iter(["one"])

    def __len__(self):
        return 1


def test_values_that_are_made_when_they_are_asked_for_are_not_asked_for():
    parts = Asked()
    assert taken(parts=parts).parts is parts
    for wrong in ({"one": 2.0}, MappingProxyType({"one": 2.0})):
        refuses(rom.errors.ConfigError, r"parts\['one'\] = 2.0 must be", taken, parts=wrong)


test_what_does_not_is_refused_by_name_and_value = refused(
    (lambda: taken(x=True), "x = True"),
    (lambda: taken(x=1e200), r"x = 1e\+200"),
    (lambda: taken(n=3.0), "n = 3.0"),
    (lambda: taken(names=b"x"), "names = b'x'"),
    (lambda: taken(rows=[1.0, np.nan]), r"rows\[1\] = nan"),
    (lambda: taken(far=SimpleNamespace()), "far = .* Unknown or None"),
    (lambda: taken(numbers=[[1], [1, 2]]), "numbers = "),
    (lambda: taken(numbers=["1"]), "numbers = "),
    (lambda: taken(path=3), "path = 3"),
    (lambda: taken(path="a\0b"), "path = "),
    (lambda: taken(way="left"), "way = 'left' must be 'up' or 'down'"),
    (lambda: taken(way=np.array(["up", "down"])), "way = "),
    (lambda: taken(way=np.zeros(2)), "way = "),
    (lambda: taken(k="x"), "k = 'x'"),
    (lambda: taken(0.0, 0, (), None, None, np.zeros(1), 1, "x"), "rest = 'x'"),
    (lambda: taken(x="long " * 1000), r"(?s)\A.{,149}\Z"),
    error=ConfigError,
)


def test_a_typed_function_keeps_its_signature_and_costs_microseconds():
    assert list(inspect.signature(rom.load).parameters) == ["path", "limit"]
    assert rom.load.__doc__.startswith("Read")
    times = [timeit(lambda: taken(1.0, 2, ("a", "b"), path="x"), number=2000) for _ in range(5)]
    assert min(times) / 2000 < 1e-4


SKEW = np.array([[2.0, 1.0], [0.0, 4.0]])


@pytest.mark.once
@pytest.mark.parametrize("ends", ["[]", "[)", "(]", "()"])
@pytest.mark.parametrize("x", [-1.0, 0.0, 0.5, 1.0, 2.0])
def test_an_interval_has_the_ends_that_its_brackets_say(ends, x):
    if 0.0 < x < 1.0 or (x == 0.0 and ends[0] == "[") or (x == 1.0 and ends[1] == "]"):
        assert between("x", x, 0, 1, ends) == x
        return
    refuses(ConfigError, f"x = {x:g} must be", between, "x", x, 0, 1, ends)


@pytest.mark.once
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


test_what_is_refused_is_named_in_the_class_that_is_asked_for = refused(
    (lambda: not_negative("x", -0.5, error=ModelError), ModelError, "x = -0.5"),
    (lambda: between("x", np.nan, 0, 1, error=ModelError), ModelError, "x = nan"),
    (lambda: not_negative("x", True), "x = True"),
    (lambda: finite("x", np.ones(3), (None, 3)), r"x has shape \(3,\), needed is \(n, 3\)"),
    (lambda: finite("x", np.ones((2, 2)), (None, 3), error=ModelError), ModelError, "x has shape"),
    (lambda: finite("x", [[1], [1, 2]], None), r"x = \[\[1\], \[1, 2\]\]"),
    (lambda: one_each("names", 2, "modes", 3), "2 names for 3 modes"),
    (lambda: one_each("names", 2, "modes", 3, error=ModelError), ModelError, "2 names for 3 modes"),
    (lambda: symmetric("K", SKEW, 0.24, where="f"), QualityGateError, "f: K is not .* 0.25"),
    (lambda: symmetric("S", csr_matrix(SKEW), 0.24, error=ModelError), ModelError, "S is not"),
    (lambda: check_ending("a/b.txt", "a picture", ".png", ".gif"), "a/b.txt: a picture"),
    (lambda: check_once(["a", "b", "a"], "the input", FileFormatError), FileFormatError, "'a'"),
    error=ConfigError,
)
