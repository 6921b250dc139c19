"""The FMU of a filter: samples of sensors in, estimates anywhere on the body out; no Python."""

from functools import partial
from pathlib import Path

import numpy as np

from rom.arguments import typed
from rom.io.files import check_writable
from rom.io.fmu.archive import Content, write_archive
from rom.io.fmu.body import description, table
from rom.io.fmu.variables import Variable
from rom.updating.tracking import Observer


@typed
def write_observer_fmu(observer: Observer, path: str | Path) -> Path:
    """Write a filter as an FMU for co-simulation (FMI 2.0) that needs nothing where it runs.

    Inputs are the samples ``sensor.acceleration[1]`` and so on; outputs are estimates
    ``estimate.force[1]``, ``estimate.stress[1]`` and so on, one step after the samples, as
    `Observer.run` has them, and their standard deviations ``deviation.stress[1]``. The
    communication step is that of the filter.

    Args:
        observer: from `Tracker.observer`.
        path: file ending in ``.fmu``.

    Raises:
        ConfigError: if the place is not writable.
        ResourceError: if there is no C compiler, it fails, or the disk is full.
    """
    path = check_writable(path)
    o = observer
    tables = {
        "DT": np.array([o.dt]),
        "CLOSED": o.A - o.A @ o.G @ o.C,
        "DRIVEN": o.A @ o.G,
        "WANTED": o.W,
        "DEVIATIONS": o.deviations,
    }
    n_v, n = o.W.shape
    sizes = f"enum {{ STATES = {n}, SENSORS = {len(o.C)}, VALUES = {n_v} }};\n"
    text = sizes + "".join(table(name, A) for name, A in tables.items())
    variables = [Variable(f"sensor.{name}", "input", unit, 0.0) for name, unit in o.inputs]
    for kind in ("estimate", "deviation"):
        variables += [Variable(f"{kind}.{name}", "output", unit) for name, unit in o.outputs]
    about = f"Estimates of {path.stem} from a few sensors, one step after their samples."
    describe = partial(description, path.stem, about, variables, o.dt)
    return write_archive(path, Content(path.stem, "observer.c", describe, data=text))
