"""What a factor costs, by the number of dofs before any matrix is there, by its own counts after.

Powers of n fitted to what MUMPS counted for beams of quadratic tetrahedra with 10 500 to 295 000
dofs; times are those of one thread that has a processor to itself.
"""

from dataclasses import dataclass
from math import log2

import numpy as np

FLOPS_LAW = (1.51, 2.119)  # of a factorisation: factor and exponent of n
ENTRIES_LAW = (2.82, 1.463)  # of one triangle of the factor
BYTES_PER_ENTRY = 10.0  # value, indices and work space; measured: 9.8 to 10.3
PEAK_RATE = 94e9  # flops of one thread in a second, products of dense matrices
SECONDS_PER_ENTRY = 35e-9  # of a factorisation, beside its flops
PASS_SECONDS = 2.2e-9  # of a solution with eight columns, per entry of the factor
PASS_COLUMNS = 8
PASSES_PER_MODE = 0.82  # of the search for 20 modes, measured
SEARCH_SECONDS = 20e-9  # per dof and mode squared, measured for 20: vectors made orthogonal
LEAST_SHARED_DOFS = 30_000  # one, two and three processes of two cores; above, sharing gains
PASSES_PER_SUPPORT = 9  # of a comparison of six modes with the full model, measured
MODES_PER_SUPPORT = 12  # that the search for them makes orthogonal, with rigid ones
LONG_COMPARISON = 60.0  # [s]; a shorter one is not weighed against the reduction
SHARED_RATE_RATIO = 0.3  # of each rank in a factor of MUMPS over ranks, over PEAK_RATE
WAIT_SECONDS = 3e-3  # of ranks for each other in such a solution, for each doubling of them
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
N_BORDER_SOLUTIONS = 18  # for 12 interface coordinates and 20 modes
REST_SECONDS = 4e-6  # per dof: interfaces, energies, the body


@dataclass(frozen=True, slots=True)
class FactorCost:
    """A factor of the stiffness of a body, and what is done with it in one process."""

    flops: float
    entries: float  # of one triangle of the factor
    memory: float  # [bytes]
    seconds: float  # of the factorisation
    solution_seconds: float  # of solving for eight columns


@dataclass(frozen=True, slots=True)
class SharedCost:
    """What the busiest of several ranks does, has and sends in a reduction."""

    inside_flops: float
    border: float  # dofs between all substructures
    border_flops: float
    memory: float  # of the factors [bytes]
    sent: float  # in the factorisation [bytes]
    seconds: float  # of the factorisation and the solutions, on cores of their own


def factor_cost(n: float) -> FactorCost:
    """The cost of one factor of a body of n dofs, a beam of 20 : 1 or what is as slender.

    A cube costs more, a plate less: its separators are larger or smaller. Exponents of two and
    four thirds are those of nested dissection of a cube.

    Source:
        George, Nested dissection of a regular finite element mesh, SIAM J. Numer. Anal. 10 (1973)
        345, for the powers; figures measured here.
    """
    return cost_of(*(factor * n**power for factor, power in (FLOPS_LAW, ENTRIES_LAW)))


def cost_of(flops: float, entries: float) -> FactorCost:
    """The cost of a factor with so many flops and entries of one triangle, of any body."""
    seconds = flops / PEAK_RATE + SECONDS_PER_ENTRY * entries
    return FactorCost(flops, entries, BYTES_PER_ENTRY * entries, seconds, PASS_SECONDS * entries)


def reduction_seconds(
    n: float, n_interface: int, n_modes: int, cost: FactorCost | None = None
) -> float:
    """Time of a reduction without certificate in one process [s].

    Each interface coordinate is a solution; without ``cost`` the factor is that of a beam.
    """
    cost = cost or factor_cost(n)
    n_passes = n_interface / PASS_COLUMNS + PASSES_PER_MODE * n_modes
    by_dof = SEARCH_SECONDS * n_modes**2 + REST_SECONDS
    return cost.seconds + n_passes * cost.solution_seconds + by_dof * n


def comparison_seconds(n: float, n_supports: int, cost: FactorCost | None = None) -> float:
    """Time of full modes in so many supports with the factor of the reduction [s]."""
    passes = PASSES_PER_SUPPORT * (cost or factor_cost(n)).solution_seconds
    return n_supports * (passes + SEARCH_SECONDS * MODES_PER_SUPPORT**2 * n)


def comparison_pays(
    n: float, n_supports: int, n_interface: int, n_modes: int, cost: FactorCost | None = None
) -> bool:
    """Whether full modes in all supports cost less than the reduction did, or little."""
    reduction = reduction_seconds(n, n_interface, n_modes, cost)
    return comparison_seconds(n, n_supports, cost) <= max(reduction, LONG_COMPARISON)


def border_seconds(flops: float, entries: float, ranks: int = 1) -> float:
    """Time of the border of substructures in a reduction, by so many ranks together [s]."""
    seconds = flops / PEAK_RATE + N_BORDER_SOLUTIONS * PASS_SECONDS * entries
    if ranks == 1:
        return seconds
    waits = N_BORDER_SOLUTIONS * WAIT_SECONDS * log2(ranks)
    return seconds / (SHARED_RATE_RATIO * ranks) + waits


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


def least_machines(n: float, memory: float) -> int:
    """How many machines of so much memory [bytes] hold the factor between them."""
    return int(-(-factor_cost(n).memory // memory))
