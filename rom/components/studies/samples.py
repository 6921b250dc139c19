"""Tables of parameters: grids, designs that fill a box, draws from distributions."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Annotated, Any

import numpy as np

from rom.arguments import Count, one_of, typed
from rom.errors import ConfigError
from rom.model import Array
from rom.names import check_all_known

KINDS = ("latin", "sobol", "random", "grid")
Range = Any  # (lowest, highest), or a distribution of scipy.stats


@typed
def design(
    ranges: Mapping[str, Range],
    n: Annotated[int, Count(1)],
    kind: str = "latin",
    *,
    log: Sequence[str] = (),
    rng: np.random.Generator | None = None,
) -> dict[str, Array]:
    """Samples of parameters within their ranges.

    Args:
        ranges: {parameter: (lowest, highest)}, or a frozen distribution of `scipy.stats`.
        n: number of samples; of a grid, along each parameter.
        kind: "latin" (hypercube), "sobol" (best for powers of two), "random" (Monte Carlo), or
            "grid", with the ends of all ranges.
        log: parameters whose logarithms are sampled evenly.
        rng: generator, for all but grids.

    Returns:
        {parameter: (n,) values}, of a grid of k parameters n^k of them, the last one fastest.

    Raises:
        ConfigError: for a range upside down, or below zero on a scale of logarithms.
    """
    one_of("kind", kind, KINDS)
    check_ranges(ranges, log)
    k = len(ranges)
    if kind == "grid":
        if drawn := [name for name, given in ranges.items() if hasattr(given, "ppf")]:
            raise ConfigError(f"a grid has no ends for the distribution of {drawn[0]!r}.")
        axes = np.meshgrid(*k * [np.linspace(0.0, 1.0, n)], indexing="ij")
        return _scaled(np.stack(axes, axis=-1).reshape(-1, k), ranges, log)
    rng = _generator(rng)
    if kind == "random":
        return _scaled(rng.random((n, k)), ranges, log)
    from scipy.stats import qmc  # which takes most of a second to import

    made = qmc.LatinHypercube if kind == "latin" else qmc.Sobol
    return _scaled(made(k, seed=rng).random(n), ranges, log)


@typed
def indices_design(
    ranges: Mapping[str, Range],
    n: Annotated[int, Count(1)],
    *,
    log: Sequence[str] = (),
    rng: np.random.Generator | None = None,
) -> dict[str, Array]:
    """The n (k + 2) samples of k parameters from which `Study.indices` tells who decides.

    First n of them, then n others, then for each parameter the first n with this parameter of the
    others; from a scrambled Sobol sequence, best for n a power of two. Arguments as of `design`.

    Source:
        Saltelli et al., Comput. Phys. Comm. 181 (2010) 259.
    """
    check_ranges(ranges, log)
    from scipy.stats import qmc

    k = len(ranges)
    U = qmc.Sobol(2 * k, seed=_generator(rng)).random(n)
    A, B = U[:, :k], U[:, k:]
    mixed = [np.where(np.arange(k) == j, B, A) for j in range(k)]
    return _scaled(np.vstack([A, B, *mixed]), ranges, log)


def range_of(text: str) -> tuple[float, float, bool]:
    """Ends of a range as it is written, LOW:HIGH or LOW:HIGH:log, and whether it has a scale so."""
    low, _, rest = text.partition(":")
    high, _, scale = rest.partition(":")
    with suppress(ValueError):
        if scale in ("", "log"):
            return float(low), float(high), bool(scale)
    raise ConfigError(f"the range {text!r} must be LOW:HIGH or LOW:HIGH:log.")


def _generator(rng: np.random.Generator | None) -> np.random.Generator:
    if rng is None:
        raise ConfigError("give rng=numpy.random.default_rng(1), so that samples come again.")
    return rng


def check_ranges(ranges: Mapping[str, Range], log: Sequence[str]) -> None:
    """Refuse ranges upside down, and logarithms of what they do not have."""
    if not ranges:
        raise ConfigError("there is no parameter to vary.")
    check_all_known(log, ranges, "log= names no parameter")
    for name, given in ranges.items():
        if hasattr(given, "ppf"):
            if name in log:
                raise ConfigError(f"{name!r} has a distribution; leave it out of log=.")
            continue
        ends = np.asarray(given, dtype=float) if np.ndim(given) == 1 else np.zeros(0)
        if ends.shape != (2,) or not np.isfinite(ends).all() or ends[0] >= ends[1]:
            text = f"the range of {name!r} is {given!r}"
            raise ConfigError(f"{text}; give (lowest, highest), or a distribution of scipy.stats.")
        if name in log and ends[0] <= 0:
            raise ConfigError(f"the range of {name!r} begins at {ends[0]:g}: no logarithm there.")


def _scaled(U: Array, ranges: Mapping[str, Range], log: Sequence[str]) -> dict[str, Array]:
    """Values of parameters at places in the unit cube."""
    found = {}
    for u, (name, given) in zip(U.T, ranges.items(), strict=True):
        if hasattr(given, "ppf"):
            found[name] = np.asarray(given.ppf(u), dtype=float)
            continue
        low, high = np.log(given) if name in log else given
        x = low + u * (high - low)
        found[name] = np.exp(x) if name in log else x
    return found
