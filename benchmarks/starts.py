"""First uses, with nothing compiled and again: what is compiled, and what is left to wait for."""

import json
import os
from collections.abc import Iterator, Mapping, Sequence

from benchmarks.timing import Row
from rom.doctor.first_use import CASES, DEMO_CASES, MODULE_NAME
from rom.errors import SolverError
from rom.process import child


def started(
    cases: Sequence[str] = tuple(CASES), again: Sequence[str] = DEMO_CASES
) -> Iterator[Row]:
    """Case, quantity, value, unit and aim: each case in a process of its own.

    Args:
        cases: done first with nothing compiled, each over what those before it have left.
        again: done once more at the end, as after the set-up.
    """
    with child.scratch("start") as folder:
        variables = {"NUMBA_CACHE_DIR": str(folder), "OMP_NUM_THREADS": "1"}
        for name in cases:
            count, seconds = _of_process(name, variables)
            yield name, "functions compiled", count, "", ""
            yield name, "processor time", seconds, "s", ""
        for name in again:
            count, seconds = _of_process(name, variables)
            yield f"{name}, compiled before", "functions compiled", count, "", "0"
            yield f"{name}, compiled before", "processor time", seconds, "s", "below 3"
        yield "machine", "load", os.getloadavg()[0], "", ""


def _of_process(name: str, variables: Mapping[str, str]) -> tuple[int, float]:
    """Functions compiled and seconds of the processor.

    Raises:
        SolverError: if the process does not come to its end.
    """
    ended = child.run(child.python(MODULE_NAME, name), variables=variables)
    if ended.code:
        raise SolverError(f"{name}: {ended.last}")
    found = json.loads(ended.out)
    return found["functions"], found["seconds"]
