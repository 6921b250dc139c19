"""Which parameters a test supports: sets of them, judged on lines that were kept aside.

Source:
    Stone, Cross-validatory choice and assessment of statistical predictions, J. R. Stat. Soc. B 36
    (1974) 111.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rom.arguments import typed, whole
from rom.components.updating.estimate import update
from rom.components.updating.family_model import Family
from rom.components.updating.measured import Responses
from rom.components.updating.normal_equations import Data, sums
from rom.errors import ConfigError
from rom.model import Array, Index

MAX_WORSE = 2.0  # standard deviations by which a smaller set may foretell worse than the best


@dataclass(frozen=True, slots=True)
class Comparison:
    """How well sets of parameters foretell lines that they were not updated by.

    Attributes:
        names: of the sets.
        n_unknowns: (k,) of each set, damping ratios too.
        by_line: (k, n_f) squared residuals of each line, in the update of all others [1].
        expected: (n_f,) of these squares, by noise alone [1].
    """

    names: tuple[str, ...]
    n_unknowns: Index
    by_line: Array
    expected: Array

    @property
    def misfit(self) -> dict[str, float]:
        """Mean squared residual over its expectation; one where noise alone is left [1]."""
        mean = self.by_line.sum(axis=1) / self.expected.sum()
        return dict(zip(self.names, mean.tolist(), strict=True))

    @property
    def worse(self) -> dict[str, float]:
        """How much a set is worse than the best, in standard deviations of their difference [1].

        The smaller one counts of that over lines, and of chi-square of noise: few lines with
        a large misfit have a large deviation too.
        """
        total = self.by_line.sum(axis=1)
        more = self.by_line - self.by_line[total.argmin()]
        spread = more.std(axis=1) * np.sqrt(np.count_nonzero(self.expected))
        noise = np.sqrt(2 * self.expected.sum())
        found = more.sum(axis=1) / np.minimum(np.where(spread > 0, spread, np.inf), noise)
        return dict(zip(self.names, found.tolist(), strict=True))

    @property
    def best(self) -> str:
        """The set of fewest unknowns that is worse than the best by two deviations at most."""
        enough = [k for k, name in enumerate(self.names) if self.worse[name] <= MAX_WORSE]
        return self.names[min(enough, key=lambda k: (self.n_unknowns[k], self.by_line[k].sum()))]

    def __str__(self) -> str:
        lines = [
            f"  {name}: {n} unknowns, lines kept aside {self.misfit[name]:.4g} of noise, "
            f"{self.worse[name]:.1f} deviations worse than the best"
            for name, n in zip(self.names, self.n_unknowns, strict=True)
        ]
        return "\n".join(["sets of parameters", *lines, f"enough: {self.best}"])


@typed
def compare(
    family: Family,
    test: Responses,
    sets: Mapping[str, Mapping[str, Any]],
    *,
    folds: int = 5,
    **common: Any,
) -> Comparison:
    """Update by each set, with every fifth line kept aside in turn, and foretell these lines.

    Args:
        family: see `rom.update`.
        test: see `rom.update`.
        sets: {name: arguments of `rom.update` that differ, e.g. ``free`` or ``attached``}.
        folds: number of updates of each set; every so many-th line is kept aside.
        common: arguments of `rom.update` that all sets share.

    Raises:
        ConfigError, SolverError: as `rom.update`; also without sets, or for more folds than lines.
    """
    n_f = len(test.frequencies)
    whole("folds", folds, 2, n_f, reason="lines")
    if not sets:
        raise ConfigError("at least one set of parameters to compare is needed.")
    data, by_line, n_unknowns = Data.of(test), np.zeros((len(sets), n_f)), []
    for k, own in enumerate(sets.values()):
        for first in range(folds):
            aside = np.arange(first, n_f, folds)
            others = _some(test, np.setdiff1d(np.arange(n_f), aside))
            found = update(family, others, **{**common, **own})
            left = sums(found.model, found.logarithms, found.zeta, data.lines(aside))
            by_line[k, aside] = left.squares.sum(axis=(1, 2))
        n_unknowns.append(len(found.names))
    expected = 2.0 * np.count_nonzero(data.weight, axis=(1, 2))
    return Comparison(tuple(sets), np.array(n_unknowns), by_line, expected)


def _some(test: Responses, lines: Index) -> Responses:
    names = ("frequencies", "H", "coherence", "force_noise")
    of_lines: dict[str, Any] = {name: np.asarray(getattr(test, name)) for name in names}
    return replace(test, **{name: A[lines] for name, A in of_lines.items() if A.ndim})
