"""What laws of the user said along a motion, asked again at its instants."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rom.mbs.elements import laws
from rom.mbs.results.interface_loads import at_instants
from rom.model import Array


@dataclass(frozen=True)
class LawRecord:
    """One law over time.

    Attributes:
        t: (n_t,) times [s].
        force, moment: (n_t, K, 3) on each of its markers, about it, world [N, N m].
        energy: (n_t,) stored [J]; lost: (n_t,) power turned into heat [W].
        memory: (n_t, m) what it remembers.
        outputs: {name: (n_t,)} its own outputs.
    """

    t: Array
    force: Array
    moment: Array
    energy: Array
    lost: Array
    memory: Array
    outputs: dict[str, Array]


def law_record(solution: Any, name: str) -> LawRecord:
    """Ask a law again at all instants of a motion."""
    law = solution.mechanism.laws[name]
    table = solution.packed.elements[laws.FAMILY]
    e = list(solution.mechanism.families()[laws.FAMILY]).index(name)
    mine = slice(*table.answer_at[e : e + 2])
    rows = np.array([table.answer[mine].copy() for _ in at_instants(solution)])
    n, m, _ = law.sizes
    said = [laws.answer_of(row, n, m) for row in rows]
    force, moment, energy, lost, memory, outputs = (np.array(x) for x in zip(*said, strict=True))
    own = dict(zip(law.outputs, outputs.T, strict=True))
    return LawRecord(solution.t, force, moment, energy[:, 0], lost[:, 0], memory, own)
