"""What a reduction would cost on 1 to 256 ranks, by counts of flops and bytes, not by a clock."""

from dataclasses import dataclass
from math import log2

import numpy as np

from rom.fe.costs import N_BORDER_SOLUTIONS, border_seconds, cost_of, factor_cost

# of MUMPS on the busiest of 3 to 16 ranks, per entry of the whole factor: 11 to 22
SHARED_BYTES = 15.0
SENT_BYTES = 20.0  # in such a factorisation, the busiest of 8 ranks, per entry: 18 and 23
# {ranks: dofs of the border, and of what an inside touches, over n^2/3; flops and entries of the
# largest inside, and of the border by MUMPS, over those of one factor}
BY_RANKS = {
    1: (0.0, 0.0, 1.0, 1.0, 0.0, 0.0),
    2: (0.45, 0.45, 0.58, 0.51, 0.005, 0.0085),
    3: (1.0, 0.94, 0.72, 0.42, 0.05, 0.07),
    4: (1.48, 0.95, 0.55, 0.31, 0.09, 0.095),
    8: (3.36, 0.93, 0.24, 0.145, 0.38, 0.215),
    16: (5.7, 0.83, 0.14, 0.076, 0.5, 0.33),
    32: (9.4, 0.8, 0.06, 0.035, 0.95, 0.62),
    64: (13.2, 0.56, 0.0163, 0.014, 1.1, 0.71),
    128: (17.8, 0.38, 0.0041, 0.0051, 1.26, 0.82),
    256: (23.4, 0.264, 0.001, 0.0019, 1.31, 0.93),
}


@dataclass(frozen=True, slots=True)
class SharedCost:
    """What the busiest of several ranks does, has and sends in a reduction."""

    inside_flops: float
    border: float  # dofs between all substructures
    border_flops: float
    memory: float  # of the factors [bytes]
    sent: float  # in the factorisation [bytes]
    seconds: float  # of the factorisation and the solutions, on cores of their own


def shared_cost(n: float, ranks: int) -> SharedCost:
    """The cost of a reduction of n dofs on 1 to 256 ranks, each with a substructure.

    Counted were bars of 54 468 and 208 683 dofs, whose numbers differ by a fifth as shares of n^2/3
    and of one factor: up to 8 ranks as dolfinx divides them, beyond as METIS does.
    """
    border, touched, *shares = (
        float(np.interp(log2(ranks), np.log2([*BY_RANKS]), column))
        for column in zip(*BY_RANKS.values(), strict=True)
    )
    one, m, t = factor_cost(n), border * n ** (2 / 3), touched * n ** (2 / 3)
    inside = cost_of(shares[0] * one.flops, shares[1] * one.entries)
    flops, entries = shares[2] * one.flops, shares[3] * one.entries
    together = border_seconds(flops, entries, max(ranks, 2))
    alone = border_seconds(m**3 / 3, m**2 / 2)
    shared = together < alone
    passes = N_BORDER_SOLUTIONS * inside.solution_seconds
    work = (flops / ranks) if shared else m**3 / 3
    memory = inside.memory + (24.0 * t**2 + SHARED_BYTES * entries if shared else 32.0 * m**2)
    sent = SENT_BYTES * entries if shared else 16.0 * m**2
    seconds = inside.seconds + passes + min(together, alone)
    return SharedCost(inside.flops, m, work, memory, sent, seconds)


def most_ranks(n: float) -> int:
    """How many ranks are the quickest, while none works more for the border than for its inside.

    MUMPS shares the whole factor beyond, of which nothing is said here. One of those counted.
    """
    costs = {ranks: shared_cost(n, ranks) for ranks in BY_RANKS}
    good = (r for r, cost in costs.items() if cost.border_flops <= cost.inside_flops)
    return min(good, key=lambda r: costs[r].seconds)
