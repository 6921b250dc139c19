"""What a worker does: one sample after the other, within limits, and whatever it raises is told.

Nothing is imported here that the measure does not import itself: a worker is there in tenths of a
second.
"""

import ctypes
import os
import pickle
import resource
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from time import perf_counter
from types import FrameType
from typing import Any

from rom.errors import RANKS, ConfigError, InterruptedRun, RomWarning
from rom.process.spreading import SEND

PR_SET_PDEATHSIG = 1
GRACE = 1.2  # of the limit of time, from where on a worker that does not listen is ended
UNKNOWN = "unknown measure"
# "values", them, warnings; "failed", class, text; "refused", class, text; and seconds
Answer = tuple[str, Any, Any, float]
_measures: dict[str, Callable[..., Any]] = {}


class Overtime(Exception):
    """A sample took longer than it may."""


class Unmeasurable(ConfigError):
    """What is asked for is in no sample."""


def begin(parent: int) -> None:
    """End with the parent, whatever ends that one; leave Ctrl-C to it."""
    if sys.platform.startswith("linux"):
        ctypes.CDLL(None, use_errno=True).prctl(PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:
        os._exit(1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def ready() -> bool:
    """Whether a worker is there."""
    return True


def know(key: str, measure: Callable[..., Any]) -> None:
    """Have a measure under a key; a worker writes and warns by itself, also as one of MPI."""
    os.environ.update(dict.fromkeys(set(RANKS) & os.environ.keys(), "0"))
    _measures[key] = measure


def measured(
    key: str, payload: bytes | None, given: Mapping[str, Any], seconds: float, memory: int
) -> Answer | str:
    """What the measure of a key says of a sample; `UNKNOWN` where it has not come here yet.

    Limits are those of one sample, by the clock [s], and of the whole process [bytes]; 0 for none.
    """
    if key not in _measures:
        if payload is None:
            return UNKNOWN
        try:
            know(key, pickle.loads(payload))
        except Exception as error:  # of whatever the modules of the measure raise
            text = f"the measure cannot be loaded by workers: {error}. {SEND}"
            return ("refused", type(error).__name__, text, 0.0)
    clock = perf_counter()
    try:
        with _limited(seconds, memory), warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", RomWarning)
            values = _plain(_measures[key](**given))
    except InterruptedRun:  # of this process
        raise
    except Exception as error:  # a row of the table, whatever it is
        kind, told = "refused" if isinstance(error, Unmeasurable) else "failed", str(error)
        if isinstance(error, MemoryError):
            told = "it needs more memory than it may take"
        elif isinstance(error, Overtime):
            told = f"it takes longer than {seconds:g} s"
        return (kind, type(error).__name__, told, perf_counter() - clock)
    own = (str(one.message) for one in caught if issubclass(one.category, RomWarning))
    return ("values", values, list(dict.fromkeys(own)), perf_counter() - clock)


def _plain(values: Any) -> dict[str, Any]:
    """Named numbers and arrays, each finite."""
    import numpy as np

    if not isinstance(values, Mapping) or not values:
        raise TypeError(f"a measure returns named numbers, {{'peak': 1.0}}; this is {values!r:.60}")
    found = {}
    for name, value in values.items():
        array = np.asarray(value, dtype=float)
        if not np.isfinite(array).all():
            raise ArithmeticError(f"{name!r} is not finite")
        found[str(name)] = array
    return found


@contextmanager
def _limited(seconds: float, memory: int) -> Iterator[None]:
    """Raise inside when the time is over; end the process where nothing hears that."""
    if memory:
        resource.setrlimit(resource.RLIMIT_AS, (memory, resource.getrlimit(resource.RLIMIT_AS)[1]))
    if not seconds:
        yield
        return
    if threading.current_thread() is not threading.main_thread():
        raise Unmeasurable("these workers run samples in threads, whose time cannot be limited.")

    def over(number: int, frame: FrameType | None) -> None:
        raise Overtime

    before = signal.signal(signal.SIGALRM, over)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    signal.setitimer(signal.ITIMER_PROF, GRACE * seconds + 1.0)  # SIGPROF ends a process
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGALRM, before)
