"""Ends a process that waits for room on a disk which another has filled; run beside it.

``python -m rom.process.disk_watch FOLDER BYTES PID``. MUMPS writes in a thread of its own, and when
that fails it waits for ever, so that nothing in the process itself can end it.
"""

import os
import signal
import sys
from contextlib import suppress
from pathlib import Path
from time import sleep

LOOK_PERIOD = 0.1  # between two looks [s]
N_LOOKS = 20  # one after another at a full disk: what waits no longer says by itself what is wrong
GRACE_PERIOD = 1.0  # [s] between SIGTERM and SIGKILL


def main(folder: str, least: int, pid: int) -> None:
    """Look until less than the least stays free; then say so where PID complains, end it."""
    n_full = 0
    while n_full < N_LOOKS:
        disk = os.statvfs(folder)
        free = disk.f_frsize * (disk.f_bavail if os.geteuid() else disk.f_bfree)  # for this user
        n_full = n_full + 1 if free < least else 0
        sleep(LOOK_PERIOD)
    with suppress(OSError), Path(f"/proc/{pid}/fd/2").open("a") as its_error:
        its_error.write(
            f"ResourceError: the disk of {folder} filled while a factor was written there: {free} "
            "bytes are free. Name a folder on a larger disk in MUMPS_OOC_TMPDIR, or use "
            'solver="iterative" (no factor).\n'
        )
    for number in (signal.SIGTERM, signal.SIGKILL):  # it may wait where it hears only the second
        os.kill(pid, number)
        sleep(GRACE_PERIOD)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
