"""Wrong arguments: all public callables, argument by argument, with values that do not belong.

Either a call works, because the value is legal, or it raises a RomError with an exit code of a
user's mistake that names the argument. Missing and unknown arguments are a TypeError of Python, as
everywhere.
"""

import inspect
import signal
import warnings
from collections import Counter
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from border_calls import calls

from rom.errors import RomError

SECONDS = 5.0  # a wrong argument is refused before work starts
WRONG = {
    "None": None,
    "text": "no such name",
    "-1": -1,
    "0": 0,
    "1.5": 1.5,
    "nan": np.nan,
    "inf": np.inf,
    "million": 10**6,
    "1e300": 1e300,
    "10**400": 10**400,
    "True": True,
    "complex": 1j,
    "bytes": b"x",
    "empty list": [],
    "empty dict": {},
    "a dict": {"root": 3},
    "object": object(),
    "function": lambda *_: None,
    "ragged": [[1, 2], [3]],
    "five numbers": np.zeros(5),
    "numbers with nan": [np.nan, 0.0, 1.0],
    "texts": ["no", "such"],
    "a matrix": np.ones((40, 40)),
}
COUNTED = Counter()


class TooSlow(Exception):
    """A call took longer than it may."""


@contextmanager
def limited(seconds):
    """Raise `TooSlow` inside after some time."""

    def stop(number, frame):
        raise TooSlow

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def outcome(call, wrong, argument):
    """What is wrong with the answer to a wrong value, or nothing."""
    function, given = call.make()
    COUNTED["cases"] += 1
    try:
        with limited(SECONDS), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            function(**given | {argument: wrong})
    except RomError as error:
        COUNTED["refused"] += 1
        COUNTED["named"] += argument in str(error)
        return f"exit code 1: {error}" if error.exit_code == 1 else None
    except TooSlow:
        return f"still busy after {SECONDS:g} s"
    except Exception as error:
        frames = inspect.getinnerframes(error.__traceback__)
        place = f"{Path(frames[-1].filename).name}:{frames[-1].lineno}"
        return f"{type(error).__name__}: {error} ({place})"
    COUNTED["legal"] += 1
    return None


@pytest.mark.parametrize("label", calls())
def test_a_wrong_argument_is_a_mistake_of_the_user_and_named(label, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    call = calls()[label]
    COUNTED["callables"] += 1
    found = {}
    for argument in call.arguments:
        for kind, wrong in WRONG.items():
            if (argument, kind) not in call.skipped:
                found[f"{argument}={kind}"] = outcome(call, wrong, argument)
    bad = [f"{label}: {case}: {what}" for case, what in found.items() if what]
    assert not bad, "\n".join(bad)
