"""SIGTERM handled like Ctrl-C, so that whatever cleans up after the one does after the other.

Batch systems, `timeout` and process supervisors end a program by SIGTERM, on which Python leaves
at once: folders stay, child processes stay, and a motion that was computed is lost.
"""

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

RESEND_DELAY = 0.05  # [s] after which a signal that was lost is sent again


class Terminated(KeyboardInterrupt):
    """SIGTERM was received."""


def _raise(number: int, frame: FrameType | None) -> None:
    raise Terminated


@contextmanager
def terminable() -> Iterator[None]:
    """Raise `Terminated` inside when SIGTERM comes; if nobody catches it, the process ends by it.

    Ctrl-C raises inside too where a library has let it end the process at once, as gmsh does. Where
    SIGTERM has a handler already, or in another thread than the main one, nothing is changed.
    """
    main = threading.current_thread() is threading.main_thread()
    if not main or signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:
        yield
        return
    signal.signal(signal.SIGTERM, _raise)
    abrupt = signal.getsignal(signal.SIGINT) is signal.SIG_DFL
    if abrupt:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    except Terminated:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        os.kill(os.getpid(), signal.SIGTERM)
        raise
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        if abrupt:
            signal.signal(signal.SIGINT, signal.SIG_DFL)


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Do what is inside to its end; Ctrl-C and SIGTERM that come meanwhile count behind it."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    before = {n: signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)}
    before = {number: handler for number, handler in before.items() if callable(handler)}
    for number in before:
        signal.signal(number, lambda n, frame: came.append(n))
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        if came:
            signal.raise_signal(came[0])


def heed_lost_signals() -> None:
    """Send a signal again whose exception Python has dropped, for the rest of this process.

    Python raises where it happens to be; in a callback, such as those of its import machinery, it
    only prints that an exception was ignored, and goes on.
    """
    usual = sys.unraisablehook

    def hook(lost: "sys.UnraisableHookArgs") -> None:
        if not isinstance(lost.exc_value, KeyboardInterrupt):
            usual(lost)
            return
        number = signal.SIGTERM if isinstance(lost.exc_value, Terminated) else signal.SIGINT
        again = threading.Timer(RESEND_DELAY, os.kill, (os.getpid(), number))
        again.daemon = True
        again.start()

    sys.unraisablehook = hook
