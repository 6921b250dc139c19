"""The errors a user can meet, each with the exit code of the command line.

A message says what happened, with the number and the name of the culprit, what it means in
mechanics, and what to do. Codes: 2 usage, 3 input file or mesh, 4 physics or model, 5 solver or
quality gate, 6 resources, 7 interrupted; 1 is kept for our own bugs.
"""

import os
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

RANKS = ("OMPI_COMM_WORLD_RANK", "PMI_RANK")  # as launchers of parallel programs name them
PACKAGE_FOLDER = str(Path(__file__).parent) + os.sep


class RomError(Exception):
    """Base of every error raised on purpose.

    Args:
        message: what happened, with the number and the name of the culprit.
        where: file, body, joint or interface the message is about; printed in front.
        hint: what to do; printed behind. Without one, and without `advice`, it is the last clause
            of the message, which then says what is wanted or what there is.
        solution: the part of a motion, or the last state, that was reached before it failed, as
            the function that failed would have returned it; None where nothing was reached.
    """

    exit_code = 1
    advice = ""  # where no hint is given
    solution: Any = None

    def __init__(self, message: str, *, where: str = "", hint: str = "", solution: Any = None):
        self.message, self.where = message, where
        self.hint = hint or self.advice or message.strip().replace("; ", ". ").rpartition(". ")[2]
        self.solution = solution
        super().__init__(message, where, hint)

    def __str__(self) -> str:
        head = f"{self.where}: " if self.where else ""
        return f"{head}{self.message} {self.told_hint}".rstrip()

    @property
    def told_hint(self) -> str:
        """The hint where it says more than the message."""
        return "" if self.hint in self.message else self.hint

    def __reduce__(self) -> tuple[Any, ...]:
        """Rebuild with keywords, so that an error survives a broadcast between ranks."""
        return partial(type(self), where=self.where, hint=self.hint), (self.message,)


@contextmanager
def reached(found: Callable[[], Any]) -> Iterator[None]:
    """Errors from within carry what was found before, as the function would have returned it."""
    try:
        yield
    except RomError as error:
        error.solution = found()
        raise


@contextmanager
def in_file(path: str | Path) -> Iterator[None]:
    """Errors from within name this file where they name no place."""
    try:
        yield
    except RomError as error:
        error.where = error.where or str(path)
        raise


class ConfigError(RomError):
    """A wrong argument, option or configuration file."""

    exit_code = 2


class UnknownNameError(ConfigError, AttributeError):
    """A name that a record does not have."""


class ParameterError(ConfigError):
    """A parameter of a family of bodies that is unknown or outside its range."""


class FileFormatError(RomError):
    """A file that is missing, cut, or not what its name promises."""

    exit_code = 3
    advice = "It may have been cut or edited; write it again."


class UnsafeFileError(FileFormatError):
    """A file that could run code or exhaust the machine when read."""

    advice = "No program writes such a file of this size; look at where it comes from."


class MeshError(RomError):
    """A mesh that is not one connected solid of valid cells."""

    exit_code = 3


class TagError(RomError):
    """A physical group that is missing, doubled or ambiguous."""

    exit_code = 3


class MaterialError(RomError):
    """Material numbers no real solid can have."""

    exit_code = 4


class InterfaceError(RomError):
    """An interface that is unknown, empty, overlapping, or cannot carry what is asked."""

    exit_code = 4


class ModelError(RomError):
    """A mechanism or body that contradicts itself: inconsistent joints, singular mass."""

    exit_code = 4


class SolverError(RomError):
    """A linear, eigenvalue or time integration solver that did not deliver."""

    exit_code = 5
    advice = "Look for a motion without inertia or stiffness, and for a joint too many."


class ModesMissedError(SolverError):
    """The eigenvalue solver skipped modes; the inertia count tells how many."""


class QualityGateError(RomError):
    """A quality figure beyond its limit."""

    exit_code = 5


class ResourceError(RomError):
    """Not enough memory or disk, predicted or met."""

    exit_code = 6
    advice = "Free memory or disk, or choose another place."


class ParallelError(RomError):
    """Another rank failed, or a call needs another number of ranks."""

    exit_code = 6


class InterruptedRun(RomError):
    """Stopped by the user; what was computed so far has been kept."""

    exit_code = 7


class RomWarning(UserWarning):
    """Something legal that a careful user wants to know."""


def warn(sentence: str, kind: type[Warning] = RomWarning) -> None:
    """Warn once: on the first of several ranks, at the line outside the package that caused it.

    Nothing happens without a sentence.
    """
    rank = next((int(os.environ[name]) for name in RANKS if name in os.environ), 0)
    if not sentence or rank:
        return
    level, frame = 2, sys._getframe(1)
    while frame.f_back and frame.f_code.co_filename.startswith((PACKAGE_FOLDER, "<string>")):
        level, frame = level + 1, frame.f_back
    warnings.warn(kind(sentence), stacklevel=level)
