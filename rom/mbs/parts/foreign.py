"""Functions that users hand over: forces, motor laws, drives, loads, events.

Whatever leaves such a function, an exception or a value that is none, becomes one error that names
the function, the time, and the line of the user's code.
"""

import inspect
import math
import traceback
from collections.abc import Callable
from types import TracebackType
from typing import Any, Protocol

import numpy as np

from rom.arguments import shortened
from rom.errors import ConfigError, RomError, SolverError
from rom.model import Array

Function = Callable[..., Any]  # of the user
KEPT_HINT = "The motion up to there is kept in error.solution."


class Entry(Protocol):
    """A function of C."""

    @property
    def address(self) -> int:
        """Where it is in memory."""


def ask(what: str, t: float, function: Function, *arguments: object) -> Any:
    """What a function of the user, by its name in the mechanism, answers at a time [s].

    ConfigError if it does not take these arguments, SolverError if it raised anything else, also
    SystemExit or for a lack of memory; an interruption passes, and a RomError with it in front.
    """
    try:
        return function(*arguments)
    except KeyboardInterrupt:
        raise
    except RomError as error:
        error.where = error.where or f"{what} at t = {t:.9g} s"
        raise
    except BaseException as error:
        raise _failure(what, t, error) from error


def in_python(what: str, law: Function, every: float | None, wanted: bool | None) -> bool | None:
    """Whether a law is to be compiled: one that is sampled is not, and cannot be in C."""
    if every and not callable(law):
        raise ConfigError(f"{what} is in C; every = {every:g} s is for laws of Python.")
    return False if every else wanted


def compiled_function(
    what: str, law: Function, make: Callable[[Function], Entry], wanted: bool | None, hint: str
) -> Entry | None:
    """What ``make`` compiles a function of the user to; None when it is left to Python.

    True to insist, False for Python, None for what works; the hint says what it may be made of.
    """
    if wanted is False:
        return None
    python = getattr(law, "py_func", law)
    try:
        if not inspect.isfunction(python):
            raise TypeError("not a plain function")
        return make(python)
    except Exception as error:  # Numba raises errors of many kinds for what it cannot compile
        if not wanted:
            return None
        lines = (line.strip() for line in str(error).splitlines())
        told = (line for line in lines if line and not line.startswith("Failed in"))
        why = next(told, type(error).__name__)
        raise ConfigError(f"{what} cannot be compiled: {why}", hint=hint) from error


def numbers(what: str, t: float, value: object, shape: tuple[int, ...], needed: str) -> Array:
    """What a function answers at a time [s], as finite numbers of a shape; ``needed`` words it."""
    A = real(what, t, value, shape, needed)
    if not np.isfinite(A).all():
        raise SolverError(f"{what} gives {A.tolist()} at t = {t:.9g} s.", hint=KEPT_HINT)
    return A


def real(what: str, t: float, value: object, shape: tuple[int, ...], needed: str) -> Array:
    """The same, finite or not."""
    A = _floats(value)
    if A is None or A.size != math.prod(shape) or (len(shape) > 1 and A.shape[0] != shape[0]):
        text = f"{what} returned {shortened(value)} at t = {t:.9g} s; needed is {needed}."
        raise ConfigError(text, hint=KEPT_HINT)
    return A.reshape(shape)


def _floats(value: object) -> Array | None:
    """A float array of real numbers; None of texts, None and complex numbers."""
    try:
        A = np.asarray(value)
        if A.dtype.kind == "O":  # numbers of other libraries, arrays of unequal lengths
            A = np.array([float(x) for x in A.ravel()]).reshape(A.shape)
        return A.astype(float) if A.dtype.kind in "biuf" else None
    except (TypeError, ValueError, OverflowError):
        return None


def _failure(what: str, t: float, error: BaseException) -> RomError:
    trace = error.__traceback__.tb_next if error.__traceback__ else None
    message = f"{type(error).__name__}: {error}".strip().removesuffix(":").rstrip(".")
    if trace is None and isinstance(error, TypeError):  # it was not even entered
        return ConfigError(f"{what} cannot be called at t = {t:.9g} s: {message}.", hint=KEPT_HINT)
    return SolverError(f"{what} failed at t = {t:.9g} s: {message}{_place(trace)}.", hint=KEPT_HINT)


def _place(trace: TracebackType | None) -> str:
    """File and line in the user's function, not in what it called in other files."""
    frames = traceback.extract_tb(trace)
    if not frames:
        return ""
    own = [frame for frame in frames if frame.filename == frames[0].filename]
    return f" ({own[-1].filename}, line {own[-1].lineno})"
