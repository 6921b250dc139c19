"""Lines of reports: a quantity, its value, its limit, and whether it holds."""

import numpy as np

from rom.model import Row

FREQUENCY_RTOL = 1e-3  # what a structural dynamicist accepts without asking
BELOW_FULL_RTOL = 1e-8  # round-off of a frequency, as `frequency_rows` has it
MIN_MAC = 0.99
N_COMPARED = 6  # lowest elastic modes that certificates compare


def row(quantity: str, value: float, limit: float, *, above: bool = False) -> Row:
    """A line that holds when the value stays below (or above) its limit; NaN never holds."""
    value = float(value)
    ok = value > limit if above else value <= limit
    return Row(quantity, value, f"{'>' if above else '<='} {limit:g}", bool(ok))


def frequency_rows(
    support: str,
    table: dict[str, list[float]],
    limit: float = FREQUENCY_RTOL,
    round_off: float = BELOW_FULL_RTOL,
) -> list[Row]:
    """Errors of frequencies, and of shapes where they are compared, against the full model.

    In a support, or of some modes: a table of "reduced" and "full" frequencies, and "mac" of the
    shapes, which may be empty; relative errors accepted, and the round-off below the full ones.
    """
    error = np.array(table["reduced"]) / np.array(table["full"]) - 1
    n = error.size
    rows = [
        row(f"{support}: worst error of {n} frequencies", np.abs(error).max(), limit),
        row(f"{support}: reduced never below full", error.min(), -round_off, above=True),
    ]
    if table.get("mac"):
        message = f"{support}: lowest MAC of {n} shapes"
        rows.append(row(message, min(table["mac"]), MIN_MAC, above=True))
    return rows
