"""`typed` takes what stands for the same thing as it, and refuses the rest by name and value."""

import inspect
from collections.abc import Mapping
from pathlib import Path
from timeit import timeit
from types import MappingProxyType, SimpleNamespace
from typing import Literal

import numpy as np
import pytest

import rom
from rom.arguments import typed
from rom.model import Array

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
    """What a typed function gets."""
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
        with pytest.raises(rom.errors.ConfigError, match=r"parts\['one'\] = 2.0 must be"):
            taken(parts=wrong)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"x": True}, "x = True must be a finite number"),
        ({"x": 1e200}, "x = 1e+200 must be a number of at most 1e+150"),
        ({"n": 3.0}, "n = 3.0 must be a whole number"),
        ({"names": b"x"}, "names = b'x' must be names"),
        ({"rows": [1.0, np.nan]}, "rows[1] = nan must be a finite number"),
        ({"far": SimpleNamespace()}, "must be of type Unknown or None"),
        ({"numbers": [[1], [1, 2]]}, "must be an array of numbers"),
        ({"numbers": ["1"]}, "must be an array of numbers"),
        ({"path": 3}, "path = 3 must be a path"),
        ({"path": "a\0b"}, "must be a path"),
        ({"way": "left"}, "way = 'left' must be 'up' or 'down'"),
        ({"k": "x"}, "k = 'x' must be a finite number"),
    ],
)
def test_what_does_not_is_refused_in_words(given, words):
    with pytest.raises(rom.ConfigError) as caught:
        taken(**given)
    assert words in str(caught.value)


def test_further_places_are_looked_at_and_long_values_shortened():
    with pytest.raises(rom.ConfigError, match="rest = 'x' must be a whole number"):
        taken(0.0, 0, (), None, None, np.zeros(1), 1, "x")
    with pytest.raises(rom.ConfigError) as caught:
        taken(x="long " * 1000)
    assert len(str(caught.value)) < 150


def test_a_typed_function_keeps_its_signature_and_costs_microseconds():
    assert list(inspect.signature(rom.load).parameters) == ["path", "limit"]
    assert rom.load.__doc__.startswith("Read")
    calls_made = 2000
    seconds = min(
        timeit(lambda: taken(1.0, 2, ("a", "b"), path="x"), number=calls_made) for _ in range(5)
    )
    assert seconds / calls_made < 1e-4
