"""Compiling ahead what motions would else wait for."""

import json
import os
import subprocess
import time
from collections.abc import Iterator, Sequence

from rom.doctor.probes import Finding
from rom.process import child

LOOK_EVERY = 0.05  # [s] between looks at which process has ended
ONE_THREAD = {"OMP_NUM_THREADS": "1"}


def compiled(module: str, cases: Sequence[str]) -> Iterator[Finding]:
    """Let a module do its cases, each in a process of its own, as many at once as there are cores.

    Args:
        module: writes one JSON line for the case it is given, with functions and seconds.
        cases: names.

    Yields:
        One finding per case as soon as it has ended.
    """
    cores, waiting = len(os.sched_getaffinity(0)), list(cases)
    running: dict[str, subprocess.Popen[bytes]] = {}  # noqa: TID251  a type
    while waiting or running:
        while waiting and len(running) < cores:
            case = waiting.pop(0)
            running[case] = child.start(child.python(module, case), variables=ONE_THREAD)
        time.sleep(LOOK_EVERY)
        for case in [name for name, process in running.items() if process.poll() is not None]:
            yield _finding(case, child.finish(running.pop(case)))


def _finding(case: str, ended: child.Ended) -> Finding:
    if ended.code:
        ending = f"crashed ({ended.signal})" if ended.signal else f"failed: {ended.last}"
        return Finding("compiled", case, ending, "broken")
    done = json.loads(ended.out.splitlines()[-1])
    value = f"{done['functions']} functions in {done['seconds']:.1f} s of the processor"
    return Finding("compiled", case, value if done["functions"] else "was compiled before")
