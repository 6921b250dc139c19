"""An FMU that runs in a process of its own, where it may crash or hang; what it must be.

``python -m rom.components.co_simulation.running FILE`` takes lines of JSON: a time and values of
the inputs then, the first one also the time between, parameters and names; it answers the outputs,
or what went wrong.
"""

import json
import os
import sys
import zipfile
from pathlib import Path
from select import select
from typing import Any
from weakref import finalize

from rom.errors import FileFormatError, ResourceError, RomError, SolverError, in_file
from rom.io.archive import refuse_hostile
from rom.io.files import check_readable, library
from rom.process.child import GRACE_PERIOD, finish, python, scratch, start

MAX_BYTES = 2**30  # that an archive may unpack to
START_SECONDS = 60.0  # for the first answer at least, before which it is unpacked and loaded


def variables(path: str | Path) -> dict[str, str]:
    """{name: causality} of the real numbers of an FMU for co-simulation, if it can run here."""
    fmpy, path = library("fmpy"), check_readable(path, MAX_BYTES)
    with in_file(path):
        try:
            with zipfile.ZipFile(path) as archive:
                refuse_hostile(archive, MAX_BYTES, "Leave out what it can do without.")
                names = archive.namelist()
            found = fmpy.read_model_description(str(path), validate=False)
        except RomError:
            raise
        except Exception as error:  # of whatever kind fmpy and its parser raise
            raise FileFormatError(f"this is no FMU: {error}") from error
        version, model = found.fmiVersion, found.coSimulation
        if model is None or version[0] not in "23":
            text = f"this FMU of FMI {version} is not for co-simulation of FMI 2 or 3"
            raise FileFormatError(f"{text}; let its program write such a one.")
        place = fmpy.platform if version[0] == "2" else fmpy.platform_tuple
        needed = f"binaries/{place}/{model.modelIdentifier}{fmpy.sharedLibraryExtension}"
        if needed not in names:
            raise ResourceError(f"the FMU has no {needed}, which this machine needs.")
    numbers = (one for one in found.modelVariables if one.type in ("Real", "Float64"))
    return {one.name: one.causality for one in numbers if not one.dimensions}


class Running:
    """An FMU in its process; each answer may take so many seconds, then the process is ended."""

    def __init__(self, path: Path, seconds: float):
        self.seconds = seconds
        self.process = start(python("rom.components.co_simulation.running", str(path)), fed=True)
        finalize(self, finish, self.process, GRACE_PERIOD)

    def ask(self, *request: object) -> list[float]:
        """Values of the outputs."""
        stdin, stdout, late, line = self.process.stdin, self.process.stdout, False, b""
        assert stdin is not None and stdout is not None
        seconds = max(self.seconds, START_SECONDS) if len(request) > 2 else self.seconds
        try:
            stdin.write(json.dumps(request).encode() + b"\n")
            stdin.flush()
            late = not select([stdout], [], [], seconds)[0]
            line = b"" if late else stdout.readline()
        except BrokenPipeError:
            pass
        if not line:
            ended = finish(self.process, 1e-3 if late else GRACE_PERIOD)
            why = f"its process ended ({ended.signal or ended.last})"
            raise SolverError(f"it gave no answer within {seconds:g} s" if late else why)
        values: list[float] | str = json.loads(line)
        if isinstance(values, str):
            raise SolverError(values)
        return values


class Instance:
    """The FMU in that process."""

    def __init__(self, path: str, folder: Path, said: list[str]):
        import fmpy
        from fmpy.simulation import instantiate_fmu

        model, self.t = fmpy.read_model_description(path, validate=False), 0.0
        self.refs = {one.name: one.valueReference for one in model.modelVariables}
        fmpy.extract(path, str(folder))
        how = {"logger": lambda *words: said.append(words[-1].decode()), "require_functions": False}
        self.fmu = instantiate_fmu(str(folder), model, "CoSimulation", **how)
        self.three = model.fmiVersion.startswith("3")
        kind = "Float64" if self.three else "Real"
        self.set, self.get = (getattr(self.fmu, f"{verb}{kind}") for verb in ("set", "get"))

    def answer(self, t: float, values: list[float], *first: Any) -> list[float]:
        """Outputs at a time at which the inputs get these values."""
        if first:
            self.every, parameters, *names = first
            self.inputs, self.outputs = ([self.refs[x] for x in some] for some in names)
            self.set([self.refs[x] for x in parameters], list(parameters.values()))
            if not self.three:
                self.fmu.setupExperiment(startTime=t)
            self.fmu.enterInitializationMode(**({"startTime": t} if self.three else {}))
        elif (self.fmu.doStep(self.t, self.every) or (0, False))[1]:
            raise RuntimeError("it asks for the end of the motion")
        self.set(self.inputs, values)
        if first:
            self.fmu.exitInitializationMode()
        self.t = t
        return list(self.get(self.outputs))


def main(path: str) -> None:
    """Answer until there are no more requests; what the FMU prints is no answer."""
    answers, nowhere = os.fdopen(os.dup(1), "w"), os.open(os.devnull, os.O_WRONLY)
    said, one = list[str](), None
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    with scratch("fmu") as folder:
        for line in sys.stdin:
            try:
                one = one or Instance(path, folder, said)
                answer: list[float] | str = one.answer(*json.loads(line))
            except Exception as error:  # of whatever kind fmpy raises
                answer = ": ".join([f"{error}".rstrip("."), *said[-1:]])
            print(json.dumps(answer), file=answers, flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
