"""What laws of the user said along a motion, asked again at its instants."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rom.mbs.elements import laws
from rom.mbs.elements.law_calls import answer_of
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
        outputs: {name: (n_t,)} its own outputs; they and the losses follow from what it remembered
            at the saved instant before.
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
    table = solution.packed.elements[laws.LAWS_FAMILY]
    e = list(solution.mechanism.families()[laws.LAWS_FAMILY]).index(name)
    mine = slice(*table.answer_at[e : e + 2])
    c, base = solution.packed.system.coordinates.kind.size, solution.base.copy()
    base[1:, c:] = solution.base[:-1, c:]
    n, m, _ = law.sizes
    force, moment, energy, _, memory, _ = _said(solution, table, mine, (n, m))
    _, _, _, lost, _, outputs = _said(replace(solution, base=base), table, mine, (n, m))
    own = dict(zip(law.outputs, outputs.T, strict=True))
    return LawRecord(solution.t, force, moment, energy[:, 0], lost[:, 0], memory, own)


def _said(solution: Any, table: Any, mine: slice, sizes: tuple[int, int]) -> list[Array]:
    """The fields of the answers at all instants."""
    rows = [table.answer[mine].copy() for _ in at_instants(solution)]
    answers = (answer_of(row, *sizes) for row in rows)
    return [np.array(field) for field in zip(*answers, strict=True)]
