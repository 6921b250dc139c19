"""Time of other programs over ours, on the same matrices in one run.

Processor time, which a busy machine changes little; one process against two by the clock.
"""

import json
import os
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.timing import Row
from rom.errors import ResourceError
from rom.process import child
from rom.process.mpirun import mpirun

# scikit-sparse builds on the CHOLMOD of Debian 12, and for NumPy 1
PACKAGES = ("exudyn==1.13.6", "scikit-sparse<0.4.13", "scipy<1.14", "numpy<2")
# not in the working folder, whose programs somebody else may have put there
CACHE_FOLDER = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "rom"
PEER_FOLDER = CACHE_FOLDER / "peers"
N_MODES = 20
RBE3_DOFS = 40_000  # beyond, Exudyn's rbe3 runs out of memory
FREQUENCY_RTOL = 1e-6  # difference of frequencies of the same model
SCRIPT_FILE = Path(__file__).with_name("craig_bampton.py")


def compared(lc: float) -> Iterator[Row]:
    """Case, quantity, value, unit and aim of each figure for one mesh.

    Raises:
        ResourceError: if a program cannot be installed, or fails.
    """
    python = interpreter()
    with child.scratch("peers") as folder:
        file = str(folder / "matrices.npz")
        rod = child.python("benchmarks.peers.ours", str(lc))
        ours = answer_of([*rod, "rbe2", str(N_MODES), file])
        case = f"{ours['dofs']} dofs, rbe2"
        yield case, "rom, one process", ours["processor"], "s of the processor", ""
        two = answer_of([*mpirun(2), *rod, "rbe2", str(N_MODES)])
        yield case, "one process over two", ours["seconds"] / two["seconds"], "", "above 1"
        for work, gain in machine_gain().items():
            yield "the machine", f"two processes over one, {work}", gain, "", ""
        for program, aim in (("superlu", ""), ("cholmod", "above 1"), ("exudyn", "above 10")):
            theirs = answer_of([python, str(SCRIPT_FILE), file, program, "rbe2", str(N_MODES)])
            yield case, f"{program} over rom", theirs["seconds"] / ours["processor"], "", aim
            gap = np.abs(np.array(theirs["frequencies"]) / ours["frequencies"] - 1).max()
            yield (
                case,
                f"{program}: difference of ten frequencies",
                gap,
                "",
                f"below {FREQUENCY_RTOL:g}",
            )
        if ours["dofs"] <= RBE3_DOFS:
            mean = answer_of([*rod, "rbe3", str(N_MODES)])
            theirs = answer_of([python, str(SCRIPT_FILE), file, "exudyn", "rbe3", str(N_MODES)])
            ratio = theirs["seconds"] / mean["processor"]
            yield f"{ours['dofs']} dofs, rbe3", "exudyn over rom", ratio, "", "above 10"


def machine_gain() -> dict[str, float]:
    """What two processes at the same time do over what one does, of each kind of work.

    Raises:
        ResourceError: if a process fails.
    """
    probe = child.python("benchmarks.peers.machine")
    one = answer_of(probe)
    with ThreadPoolExecutor() as side_by_side:
        two = list(side_by_side.map(answer_of, [probe, probe]))
    return {work: sum(rates[work] for rates in two) / alone for work, alone in one.items()}


def interpreter(environment: Path | None = None, packages: tuple[str, ...] = ()) -> str:
    """The Python of the environment in which the other programs live; made if missing.

    Args:
        environment: its folder; by default that of Exudyn and CHOLMOD.
        packages: what is installed there.

    Raises:
        ResourceError: if a package cannot be installed.
    """
    if environment is None:
        environment, packages = PEER_FOLDER, PACKAGES
    python = environment / "bin" / "python"
    done = environment / "complete"
    if not done.exists():
        for command in (
            child.python("venv", "--clear", str(environment)),
            [str(python), "-m", "pip", "install", "--quiet", *packages],
        ):
            made = child.run(command)
            if made.code:
                raise ResourceError(
                    f"the environment {environment} could not be made: {made.last}.",
                    hint="It needs the package index and, for CHOLMOD, apt-get install "
                    "libsuitesparse-dev.",
                )
        done.touch()
    return str(python)


def answer_of(command: list[str]) -> dict[str, Any]:
    """The answer of a process with one thread; scripts of other programs find each other.

    Raises:
        ResourceError: if it fails.
    """
    one = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    allow = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    foreign = {} if sys.executable in command else {"PYTHONPATH": str(SCRIPT_FILE.parent)}
    done = child.run(command, variables=one | allow | foreign)
    if done.code:
        raise ResourceError(f"{' '.join(command[:4])} ended with {done.code}: {done.last}.")
    return json.loads(done.out.strip().splitlines()[-1])


def answer_to(script: Path, described: dict[str, Any]) -> dict[str, Any]:
    """The answer of a script of another program to what is described for it.

    Raises:
        ResourceError: if it fails.
    """
    with child.scratch("peers") as folder:
        file = folder / "described.json"
        file.write_text(json.dumps(described))
        return answer_of([interpreter(), str(script), str(file)])
