"""Paths by Exudyn of three mechanisms of one soft bar, for tests where it cannot be installed.

``python -m benchmarks.peers.reference FILE.json`` writes them, each with two steps.
"""

import json
import sys
from pathlib import Path

from benchmarks.models import bar
from benchmarks.peers.mechanisms import chain, pendulum, slider_crank
from benchmarks.peers.motion import Run, by_exudyn, reduced, with_all_nodes
from rom.body.flexible import FlexibleBody
from rom.model import FEModel, Material

SOFT_SOLID = Material(E=2e9, nu=0.3, rho=1000.0)
STEPS = (2000, 4000)
T_END = 0.4  # [s]
NAMES = ("pendulum", "chain of 2", "slider-crank")


def mesh() -> FEModel:
    """A bar of 1 m that bends by a centimetre under its own weight."""
    return with_all_nodes(bar((1.0, 0.04, 0.03), (4, 1, 1), SOFT_SOLID))


def case(name: str, model: FEModel) -> tuple[FlexibleBody, list[Run]]:
    """The body, and its runs with each step."""
    body = reduced(model, 2)
    mechanism = {
        "pendulum": lambda: pendulum(body, spin=2.0),
        "chain of 2": lambda: chain(body, 2),
        "slider-crank": lambda: slider_crank(body, 0.3, 10.0),
    }[name]()
    return body, [Run(mechanism, T_END, steps) for steps in STEPS]


def main(path: str) -> None:
    """Write the paths [m] of the points watched, by mechanism and number of steps."""
    model, paths, version = mesh(), {}, ""
    for name in NAMES:
        body, runs = case(name, model)
        found = by_exudyn(model, body, runs)
        version = found[0].version
        paths[name] = {
            str(run.steps): [[float(f"{x:.12g}") for x in at] for at in moved.positions]
            for run, moved in zip(runs, found, strict=True)
        }
    made = {"program": f"Exudyn {version}, ObjectFFRFreducedOrder", "script": __spec__.name}
    Path(path).write_text(json.dumps(made | {"paths": paths}, indent=0) + "\n")


if __name__ == "__main__":
    main(sys.argv[1])
