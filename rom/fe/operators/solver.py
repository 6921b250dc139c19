"""How the equations of a model are solved: by a factor, by a compressed one, or by iteration."""

from dataclasses import dataclass

from rom.errors import ConfigError

KNOWN_SOLVERS = (
    '"auto", "direct", "low-rank", "low-rank:1e-8", "out-of-core", "iterative", '
    '"low-rank+out-of-core"'
)
LOW_RANK_RTOL = 1e-8  # of a block's norm: what a compressed factor drops


@dataclass(frozen=True, slots=True)
class Solver:
    """A choice among ways to solve."""

    # blocks of vectors and algebraic multigrid, no factor; whether modes are missing is then asked
    # of random loads, not of an inertia
    iterative: bool = False
    # tolerance to which blocks of the factor are compressed; 0 for an exact factor. What is lost
    # comes back by conjugate gradients on top
    low_rank: float = 0.0
    out_of_core: bool = False  # the factor is on disk, in the folder of MUMPS_OOC_TMPDIR or in /tmp
    automatic: bool = False  # the first of direct, out-of-core and iterative that fits


DIRECT_SOLVER = Solver()
WHOLE_WORDS = {
    "direct": DIRECT_SOLVER,
    "iterative": Solver(iterative=True),
    "auto": Solver(automatic=True),
}


def parsed(text: str) -> Solver:
    """The solver named in words; a ConfigError lists those that are known."""
    if text in WHOLE_WORDS:
        return WHOLE_WORDS[text]
    low_rank, out_of_core = 0.0, False
    for word in str(text).split("+"):
        name, colon, number = word.partition(":")
        if name == "low-rank" and not low_rank:
            low_rank = _tolerance(number, text) if colon else LOW_RANK_RTOL
        elif word == "out-of-core" and not out_of_core:
            out_of_core = True
        else:
            raise ConfigError(f"solver = {text!r} is unknown; known are {KNOWN_SOLVERS}.")
    return Solver(low_rank=low_rank, out_of_core=out_of_core)


def _tolerance(number: str, text: str) -> float:
    try:
        value = float(number)
    except ValueError:
        value = 0.0
    if not 0.0 < value <= 1e-2:
        raise ConfigError(f"solver = {text!r}: the tolerance must lie between 0 and 0.01.")
    return value
