"""First act of every child process; run by its path, before anything of rom is imported.

``python -P child_entry.py PARENT SECONDS BYTES COMMAND...`` ties the process to its parent, limits
it, and becomes the command. Threads forbid to do this between fork and exec in the parent.
"""

import ctypes
import os
import resource
import runpy
import signal
import sys

PR_SET_PDEATHSIG = 1


def main(parent: int, seconds: int, size: int, command: list[str]) -> None:
    """Become the command: a module of this Python in this process, any other program by exec."""
    module = command[:3] == [sys.executable, "-P", "-m"]
    # a launcher such as mpirun must hear of it, to end what it has started itself
    _die_with(parent, signal.SIGKILL if module else signal.SIGTERM)
    _limit(resource.RLIMIT_CORE, 0)
    if seconds:
        _limit(resource.RLIMIT_CPU, seconds)
    if size:
        _limit(resource.RLIMIT_AS, size)
    if not module:
        os.execvp(command[0], command)
    from rom.process.seclusion import leave_working_folder_alone

    leave_working_folder_alone()
    sys.argv = command[3:]
    runpy.run_module(command[3], run_name="__main__", alter_sys=True)


def _die_with(parent: int, number: int) -> None:
    """Receive a signal when the parent dies; where there is no such call, it must end us."""
    if sys.platform.startswith("linux"):
        ctypes.CDLL(None, use_errno=True).prctl(PR_SET_PDEATHSIG, number, 0, 0, 0)
    if os.getppid() != parent:  # it died before
        os._exit(1)


def _limit(kind: int, value: int) -> None:
    """Lower a limit as far as the one that holds already allows."""
    hard = resource.getrlimit(kind)[1]
    value = value if hard == resource.RLIM_INFINITY else min(value, hard)
    resource.setrlimit(kind, (value, value))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), sys.argv[4:])
