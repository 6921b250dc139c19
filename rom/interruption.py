"""SIGTERM handled like Ctrl-C, so that whatever cleans up after the one does after the other.

Batch systems, `timeout` and process supervisors end a program by SIGTERM, on which Python leaves
at once: folders stay, child processes stay, and a motion that was computed is lost.
"""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class Terminated(KeyboardInterrupt):
    """SIGTERM was received."""


def _raise(number: int, frame: FrameType | None) -> None:
    raise Terminated


@contextmanager
def terminable() -> Iterator[None]:
    """Raise `Terminated` inside when SIGTERM comes; outside, SIGTERM means what it did before.

    A `Terminated` that leaves the outermost block ends the process by SIGTERM, as whoever sent it
    expects. Where SIGTERM has a handler already, or in another thread than the main one, nothing
    is changed. May be nested.
    """
    main = threading.current_thread() is threading.main_thread()
    if not main or signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:
        yield
        return
    signal.signal(signal.SIGTERM, _raise)
    try:
        yield
    except Terminated:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        os.kill(os.getpid(), signal.SIGTERM)
        raise
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
