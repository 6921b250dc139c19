"""The same reduction by rom, in a process of its own or under mpirun.

``python -m benchmarks.peers.ours LC KIND N_MODES [matrices.npz]`` prints {"seconds", "processor",
"dofs", "frequencies"}, time by the clock and of the processor. With a file name it leaves the
matrices there.
"""

import json
import sys
from time import perf_counter, process_time
from typing import Any

import numpy as np

from benchmarks.models import STEEL, geometry
from rom.model import FEModel
from rom.reduction.bases.method import CraigBampton
from rom.workflow import reduce

INTERFACES = ("pin_a", "pin_b")


def main(lc: float, kind: str, n_modes: int, path: str = "") -> None:
    """Reduce a connecting rod and say how long it took."""
    from rom.fe import model as read_model

    model = read_model(geometry("connecting_rod"), material=STEEL, parameters={"lc": lc})
    if path:
        save_matrices(model, path)
    start, cpu = perf_counter(), process_time()
    body = reduce(
        model,
        method=CraigBampton(n_modes),
        interfaces=dict.fromkeys(INTERFACES, kind),
        certify=False,
    )
    seconds, cpu = perf_counter() - start, process_time() - cpu
    if model.operators.first == 0:
        found: dict[str, Any] = {"seconds": seconds, "processor": cpu, "dofs": model.n_dofs}
        found["frequencies"] = body.frequencies()[6:16].tolist()
        sys.stdout.write(json.dumps(found) + "\n")


def save_matrices(model: FEModel, path: str, names: tuple[str, ...] = INTERFACES) -> None:
    """What another program needs of a model, on one process."""
    arrays = {f"interface_{k}": model.interfaces[name].nodes for k, name in enumerate(names)}
    for name, A in (("K", model.K), ("M", model.M)):
        arrays |= {f"{name}_{part}": getattr(A, part) for part in ("data", "indices", "indptr")}
    np.savez(path, points=model.points, **arrays)


if __name__ == "__main__":
    main(float(sys.argv[1]), sys.argv[2], int(sys.argv[3]), *sys.argv[4:])
