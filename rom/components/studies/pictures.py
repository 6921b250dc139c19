"""Pictures of studies: what was measured over what varied, who decides, bands over time."""

from pathlib import Path
from typing import Any

import numpy as np

from rom import view
from rom.components.studies.study import Indices, Study
from rom.errors import ConfigError

LARGEST = 6  # rows and columns of diagrams on a sheet
BAND = (0.05, 0.5, 0.95)


def scatter_matrix(study: Study, path: str | Path | None = None) -> Any:
    """Draw each number that was measured (rows) over each parameter (columns); the figure."""
    numbers = {name: x for name, x in study.values.items() if x.ndim == 1}
    varied = {name: x for name, x in study.parameters.items() if x.dtype.kind != "U"}
    good = study.good
    if not numbers or not varied or not good.size:
        raise ConfigError("there is no number over a parameter to draw.")
    rows = [
        [
            view.Panel("", name[-30:], value[-36:] * (k == 0), points={"_": (x[good], y[good])})
            for k, (name, x) in enumerate(list(varied.items())[:LARGEST])
        ]
        for j, (value, y) in enumerate(list(numbers.items())[:LARGEST])
    ]
    caption = (
        f"Each point is one of {good.size} samples: a number that was measured (row) over a "
        "parameter that was varied (column), in SI units; all of them varied at the same time."
    )
    return view.panels(rows, path, title="What was measured over what was varied", caption=caption)


def tornado(indices: Indices, path: str | Path | None = None, *, of: str = "the result") -> Any:
    """Draw Sobol indices as bars, the parameter that decides most on top; the figure."""
    order = np.argsort(-indices.total)
    panels = [
        view.Panel(title, "share of the variance [1]", bars={
            indices.parameters[k]: (min(0.0, float(x[k])), max(0.0, float(x[k]))) for k in order
        })
        for title, x in (("Together with others", indices.total), ("Alone", indices.first))
    ]  # fmt: skip
    wide = float(np.abs(np.diff(indices.total_ends)).max() / 2)
    caption = (
        f"Shares of the variance of {of} that come from each parameter: with all that it does "
        "together with others (total Sobol index), and alone (first order). The samples leave "
        f"them uncertain by up to {wide:.2f}."
    )
    return view.panels([panels], path, title="Which parameter decides", caption=caption)


def bands(
    study: Study, name: str, path: str | Path | None = None, *, clock: str = "t", unit: str = ""
) -> Any:
    """Draw where 90 % of the histories of a value lie over time, and their median; the figure."""
    times, n = study.on_clock(name, clock), study.good.size
    quantiles, _ = study.quantiles(name, BAND)
    limits = zip(BAND, quantiles, strict=True)
    curves = {f"{share:.0%} of the samples below": (times, x) for share, x in limits}
    caption = f"At each time, {n} samples ordered by size; a curve is no sample, but a limit."
    panel = view.Panel("", "time [s]", f"{name} {unit}".strip(), curves=curves)
    return view.panels([[panel]], path, title=f"Bands of {name}", caption=caption)
