"""What a factor costs, by the number of dofs before any matrix is there, by its own counts after.

Powers of n fitted to what MUMPS counted for beams of quadratic tetrahedra with 10 500 to 295 000
dofs; times are those of one thread that has a processor to itself.
"""

from dataclasses import dataclass
from math import log2

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
