"""What is said where: answers on stdout, progress, warnings and errors on stderr."""

import logging
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TextIO

from rom.cli.answer import Answer, to_json
from rom.errors import QualityGateError, RomError, RomWarning


@dataclass(frozen=True, slots=True)
class OutputOptions:
    """How to speak; the options of the same names."""

    json: bool = False
    quiet: bool = False
    verbose: bool = False
    strict: bool = False
    debug: bool = False


def output_options(argv: list[str]) -> OutputOptions:
    """The common options, read before the grammar: a usage error speaks the same way."""
    letters = {a[1:] for a in argv if a[:1] == "-" and a[1:2] != "-"}
    return OutputOptions(
        json="--json" in argv,
        quiet="--quiet" in argv or "q" in letters,
        verbose="--verbose" in argv or "v" in letters,
        strict="--strict" in argv,
        debug="--debug" in argv,
    )


def present(answer: Answer, remarks: list[str], options: OutputOptions) -> None:
    """Print an answer, and what failed."""
    if options.json:
        whole = {"ok": not answer.failed, **answer.data, "warnings": remarks}
        say(to_json(whole | ({"failed": answer.failed} if answer.failed else {})))
    elif answer.text:
        say(answer.text)
    if answer.failed:
        more = f", and {len(answer.failed) - 1} more" if len(answer.failed) > 1 else ""
        say(f"error: {answer.failed[0]}{more}.", sys.stderr)


def print_error(error: RomError, options: OutputOptions, rank: int = 0) -> None:
    """One line of cause and one line of hint; a rank that is alone with its error says so."""
    where = f"{error.where}: " if error.where else ""
    cause = " ".join(f"{where}{error.message}".split())
    if options.json:
        own = {"message": cause, "hint": error.hint, "exit_code": error.exit_code}
        say(to_json({"ok": False, "error": type(error).__name__, **own}))
    say("error: " + (f"rank {rank}: " if rank else "") + cause, sys.stderr)
    if error.told_hint:
        say(f"hint: {' '.join(error.told_hint.split())}", sys.stderr)


@contextmanager
def speaking(options: OutputOptions, *, verbose: bool) -> Iterator[list[str]]:
    """Progress and warnings on stderr, but for silent ranks; gives the list of the warnings."""
    remarks: list[str] = []

    def show(message: object, category: type, *_: object, **__: object) -> None:
        text = " ".join(str(message).split())
        if not issubclass(category, RomWarning) or text in remarks:
            return
        if options.strict:
            raise QualityGateError(text, hint="Without --strict this is a warning.")
        remarks.append(text)
        if verbose and not options.quiet:
            say(f"warning: {text}", sys.stderr)

    log, handler = logging.getLogger("rom"), logging.StreamHandler()
    level = logging.DEBUG if options.verbose else logging.INFO
    level = logging.ERROR if options.quiet else level
    before = log.level
    log.setLevel(level if verbose else logging.CRITICAL)
    log.addHandler(handler)
    log.propagate = False  # ffcx gives the root logger a handler of its own
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("always", RomWarning)
            warnings.showwarning = show
            yield remarks
    finally:
        log.removeHandler(handler)
        log.setLevel(before)
        log.propagate = True


def say(text: str, to: TextIO | None = None) -> None:
    """A line on stdout, or on another stream."""
    stream = to or sys.stdout
    stream.write(text + "\n")
    stream.flush()
