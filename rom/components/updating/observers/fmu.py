"""The FMU of a filter: samples of sensors in, estimates anywhere on the body out; no Python.

See docs/theory/tracking.md.
"""

import json
from pathlib import Path

import numpy as np

from rom.arguments import typed
from rom.components.updating.observers.parameter_tracking import LINEAR_REACH, ParameterTracker
from rom.components.updating.observers.tracking import Observer, named_values
from rom.io.files import check_writable
from rom.io.fmu.archive import write_archive
from rom.io.fmu.body import arrays
from rom.io.fmu.description import Content, Variable, structured


@typed
def write_observer_fmu(observer: Observer | ParameterTracker, path: str | Path) -> Path:
    """Write a filter as an FMU for co-simulation (FMI 2.0) that needs nothing where it runs.

    Inputs are the samples ``sensor.acceleration[1]`` and so on; outputs are estimates
    ``estimate.force[1]``, ``estimate.stress[1]`` and so on and their standard deviations
    ``deviation.stress[1]``. Those of an observer are for the end of the step that begins with the
    samples, as `Observer.run` has them. Those of a tracker of parameters, factors
    ``estimate.factor.joint`` among them, are for the time of the samples, as
    `ParameterTracker.run` has them; deviations of factors are relative. The communication step is
    that of the filter.

    Args:
        observer: from `Tracker.observer`, or a tracker of parameters.
        path: file ending in ``.fmu``.

    Raises:
        ConfigError: if the place is not writable.
        ResourceError: if there is no C compiler, it fails, or the disk is full.
    """
    path = check_writable(path)
    if isinstance(observer, Observer):
        o, dt, inputs, outputs = observer, observer.dt, observer.inputs, observer.outputs
        core, when = "observer.c", "one step after their samples"
        tables = {"DT": np.array([dt]), "CLOSED": o.A - o.A @ o.G @ o.C, "DRIVEN": o.A @ o.G}
        tables |= {"WANTED": o.W, "DEVIATIONS": o.deviations}
        n_v, n = o.W.shape
        text = f"enum {{ STATES = {n}, SENSORS = {len(o.C)}, VALUES = {n_v} }};\n" + arrays(tables)
    else:
        dt, (inputs, outputs), text = observer.assumed.dt, _names(observer), _changing(observer)
        core, when = "parameter_tracker.c", "at their samples, and of what changes"
    variables = [Variable(f"sensor.{name}", "input", unit, 0.0) for name, unit in inputs]
    for kind in ("estimate", "deviation"):
        variables += [Variable(f"{kind}.{name}", "output", unit) for name, unit in outputs]
    about = f"Estimates of {path.stem} from a few sensors, {when}."
    headers = ("filter.h", "shared.h")
    return write_archive(path, Content(path.stem, about, variables, dt, core, headers, text))


Names = tuple[tuple[str, str], ...]


def _names(tracker: ParameterTracker) -> tuple[Names, Names]:
    """Names and units of samples (n_y,), and of what is wanted, of forces and factors (n_v,)."""
    forces = [(f"force[{k}]", "N") for k in range(1, tracker.operation.driven.shape[1] + 1)]
    factors = [(structured("factor", name), "1") for name in tracker.names]
    return named_values(tracker.sensors), (*named_values(tracker.wanted), *forces, *factors)


def _changing(tracker: ParameterTracker) -> str:
    """Tables of a filter that linearises its equations again."""
    o, assumed, model = tracker.operation, tracker.assumed, tracker.operation.model
    drifts = tracker.drifts.values()
    tables = {"DT": np.array([assumed.dt]), "REACH": np.array([LINEAR_REACH])}
    tables |= {"SCALE": o.scale, "STIFFNESS": model.K, "MASS": model.M, "DAMPING": o.XI}
    tables |= {"DRIVEN": o.driven, "K_POWERS": model.k_powers, "M_POWERS": model.m_powers}
    tables["LOW"], tables["HIGH"] = model.ends
    tables |= {"WHITE": np.diag(assumed.white(o)), "VARIANCES": tracker.R}
    tables["WALKS"] = np.array([d.walk**2 * assumed.dt for d in drifts])
    tables["BEFORE"] = np.r_[np.diag(assumed.before(o)), [d.first**2 for d in drifts]]
    for name, rows in (("SEEN", o.seen), ("WANTED", o.wanted)):
        tables[f"{name}_STILL"], tables[f"{name}_CARRIED"] = rows.displacement, rows.carried
        tables[f"{name}_MOVING"], tables[f"{name}_PUSHED"] = rows.velocity, rows.acceleration
    m, n_e = o.driven.shape
    sizes = {"MODES": m, "FORCES": n_e, "PARAMETERS": len(model.names), "TERMS": len(model.K)}
    sizes |= {"SENSORS": len(tracker.R), "WANTED": len(o.wanted.displacement)}
    numbers = ", ".join(f"{name} = {size}" for name, size in sizes.items())
    names = ", ".join(json.dumps(name) for name in model.names)
    text = f"enum {{ {numbers} }};\nstatic const char *const NAMES[] = {{{names}}};\n"
    return text + arrays(tables)
