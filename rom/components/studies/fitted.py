"""What a fit says: parameters, how surely they are known, and whether what is left is noise."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2, norm

from rom.components.studies.study import Study
from rom.components.updating.models import MAX_FALSE_REFUSAL, chi_row
from rom.model import Array, Report, Row
from rom.rows import row

SAME_GAIN = 0.1  # of chi-square over its expectation, within which two searches ended alike


@dataclass(frozen=True, eq=False)
class Fitted:
    """What measured histories say about parameters of a mechanism.

    Attributes:
        values: {parameter: value}.
        covariance: (p, p) of these values, in their units; no direction is less known than by a
            uniform distribution over the ranges.
        undetermined: directions, {parameter: share of its range [1]}, along which parameters may
            change together without a sign of it in the histories.
        verdict: whether noise alone explains what is left, and where it does not.
        predicted: {record: (n,) or (n, c) as measured}, of the mechanism fitted.
        residuals: {record: likewise}, predicted less measured, over the deviation [1].
        at_bound: names of parameters that lie at an end of their range.
        searches: starts and ends of all searches; a start that cannot be moved is a failed row.
    """

    values: dict[str, float]
    covariance: Array
    undetermined: tuple[dict[str, float], ...]
    verdict: Report
    predicted: dict[str, Array]
    residuals: dict[str, Array]
    at_bound: tuple[str, ...]
    searches: Study

    @property
    def deviations(self) -> dict[str, float]:
        """Standard deviation of each value, in its unit."""
        return dict(zip(self.values, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    @property
    def correlations(self) -> Array:
        """(p, p) correlation of the values [1]."""
        d = np.sqrt(np.diag(self.covariance))
        return self.covariance / np.outer(d, d)

    def __str__(self) -> str:
        good, ends = self.searches.good, self.searches.values
        known = zip(self.values.items(), self.deviations.values(), strict=True)
        lines = [f"  {name} = {x:.6g} +- {d:.2g}" for (name, x), d in known]
        for direction in self.undetermined:
            shares = ", ".join(f"{share:+.2f} {name}" for name, share in direction.items())
            lines.append(f"  not told by the data, in shares of ranges: {shares}")
        squares, n = np.sort(ends["chi-square"][good]), ends["residuals"].shape[1]
        other = squares[squares > squares[0] + SAME_GAIN * max(1.0, squares[0] / n)]
        same = f"{squares.size - other.size} of {len(self.searches.seconds)} searches end here"
        lines.append(f"  {same}" + (f", others at chi-square {other[0]:.4g}" if other.size else ""))
        moved, failed = (int(ends[name][good].sum()) for name in ("motions", "failed motions"))
        text = f"  {failed} of {moved} motions failed; steps there were taken back"
        lines += [text] * bool(failed)
        return "\n".join(["fitted parameters", *lines, str(self.verdict)])


def noise_rows(left: Mapping[str, Array], freedom: int) -> list[Row]:
    """Whether residuals of records are noise: of the size that was said, and without memory.

    Memory is the first serial correlation times the root of the number of pairs, normal for noise.

    Source:
        Box, Jenkins and Reinsel, Time series analysis (1994), 8.2.
    """
    total, text = sum(float(np.sum(x**2)) for x in left.values()), "chi-square of the records"
    least = chi2.ppf(MAX_FALSE_REFUSAL, freedom) / freedom
    pairs = {name: x[1:] * x[:-1] for name, x in left.items()}
    memory = {name: float(y.sum() / np.sqrt(max(y.size, 1)) / (np.mean(left[name] ** 2) or 1.0))
              for name, y in pairs.items()}  # fmt: skip
    off = {name: float(np.sum(x**2 - 1) / np.sqrt(2 * x.size)) for name, x in left.items()}
    worst, alike = (max(found, key=found.__getitem__) for found in (off, memory))
    x, most = left[worst], float(norm.isf(MAX_FALSE_REFUSAL / len(left)))
    return [
        chi_row(text, total, freedom, 1),
        row(f"{text}, no less than noise leaves", total / freedom, least, above=True),
        chi_row(f"worst record, {worst}", float(np.sum(x**2)), x.size, len(left)),
        row(f"memory of residuals, {alike} [deviations]", memory[alike], most),
    ]
