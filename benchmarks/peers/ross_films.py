"""Coefficients of a journal bearing by ROSS's PlainJournal; run by ROSS's own Python, without rom.

``python ross_films.py CASE``, with the case in JSON, prints {"version", method: {"seconds",
"stiffness", "damping"}}, seconds of the processor. The oil does not thin with heat. A first, coarse
bearing compiles what is to be compiled.
"""

import json
import sys
from importlib.metadata import version
from time import process_time
from typing import Any

import numpy as np
from ross.bearings.lubricants import lubricants_dict
from ross.bearings.plain_journal import PlainJournal

METHODS = ("lund", "perturbation")


def bearing(case: dict[str, Any], cells: list[int], method: str) -> PlainJournal:
    """Two pads between axial grooves at the ends of a level line; the load points down."""
    mu = case["viscosity"]
    oil = lubricants_dict["ISOVG32"] | {
        "liquid_viscosity1": mu * (1 + 1e-9),
        "liquid_viscosity2": mu,
    }
    return PlainJournal(
        n=0, axial_length=case["length"], journal_radius=case["diameter"] / 2,
        radial_clearance=case["clearance"], elements_circumferential=cells[0],
        elements_axial=cells[1], n_pad=2, pad_arc_length=180 - case["groove_deg"], preload=0,
        geometry="circular", reference_temperature=50, frequency=np.array([case["speed"]]),
        fxs_load=0, fys_load=-case["load"], lubricant=oil, initial_guess=case["guess"],
        method=method, groove_factor=[0.5, 0.5], operating_type="flooded", oil_supply_pressure=0,
        oil_flow_v=1e-3,
    )  # fmt: skip


def main(text: str) -> None:
    """Time every method and print what it found."""
    case = json.loads(text)
    found: dict[str, Any] = {"version": version("ross-rotordynamics")}
    for method in METHODS:
        bearing(case, [8, 3], method)
        start = process_time()
        made = bearing(case, case["cells"], method)
        found[method] = {"seconds": process_time() - start}
        for name, letter in (("stiffness", "k"), ("damping", "c")):
            rows = [[getattr(made, letter + a + b) for b in "xy"] for a in "xy"]
            found[method][name] = np.array(rows, dtype=float).reshape(2, 2).tolist()
    sys.stdout.write("\n" + json.dumps(found) + "\n")


if __name__ == "__main__":
    main(sys.argv[1])
