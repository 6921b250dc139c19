"""SIGTERM ends a program after it has cleaned up, and ends it by SIGTERM."""

import os
import signal
import threading
import time

import pytest

from cases.command import python
from rom.process.interruption import Terminated, terminable


def test_sigterm_is_raised_inside_and_restored_outside():
    with pytest.raises(Terminated):
        interrupted_inside()
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


def interrupted_inside():
    """The outermost block would end this very process; it is caught one block further in."""
    with terminable():
        try:
            with terminable():
                os.kill(os.getpid(), signal.SIGTERM)
                signal.pause()
        except Terminated as error:
            caught = error
    raise caught


def test_a_handler_of_the_user_is_left_alone():
    heard = []
    signal.signal(signal.SIGTERM, lambda *_: heard.append(1))
    try:
        with terminable():
            os.kill(os.getpid(), signal.SIGTERM)
        assert heard == [1]
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


def test_ctrl_c_raises_inside_though_a_library_lets_it_end_the_process():
    before = signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        with pytest.raises(KeyboardInterrupt), terminable():
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(1.0)
        assert signal.getsignal(signal.SIGINT) is signal.SIG_DFL
    finally:
        signal.signal(signal.SIGINT, before)


def test_another_thread_changes_nothing():
    seen = []

    def work():
        with terminable():
            seen.append(signal.getsignal(signal.SIGTERM))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [signal.SIG_DFL]


def test_the_process_cleans_up_and_ends_by_sigterm():
    code = (
        "import os, signal\nfrom rom.process.interruption import terminable\n"
        "with terminable():\n    try:\n        os.kill(os.getpid(), signal.SIGTERM)\n"
        "        signal.pause()\n    finally:\n        print('clean', flush=True)\n"
    )
    done = python("-c", code, timeout=60)
    assert (done.returncode, done.stdout) == (-signal.SIGTERM, "clean\n"), done.stderr


@pytest.mark.parametrize("number", ["SIGINT", "SIGTERM"])
def test_a_signal_dropped_in_a_callback_comes_again(number):
    code = (
        "import os, signal, time\n"
        "from rom.process.interruption import heed_lost_signals, terminable\n"
        "heed_lost_signals()\n"
        "class Last:\n"
        f"    def __del__(self): os.kill(os.getpid(), signal.{number}); time.sleep(0.01)\n"
        "with terminable():\n    x = Last(); del x\n    time.sleep(20)"
    )
    done = python("-c", code, timeout=15)
    assert done.returncode == -getattr(signal, number), done.stderr
