"""Corrections, errors and measured shapes of tooth flanks."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

from rom.arguments import Number, Positive, typed
from rom.errors import ModelError
from rom.model import Array

Each = tuple[Any, Any]  # arrays or sequences, of pinion and gear


@typed
@dataclass(frozen=True, slots=True)
class Correction:
    """What is taken off the flanks of a pair.

    Tooth 0 of both wheels are those that touch along line 0, which begins at the tangent point of
    the pinion when it has turned by no phase; teeth count against the sense in which it drives.

    Attributes:
        relief: (2,) depth at the tips of pinion and gear [m].
        extent: (2,) length of the relief along the path of contact [m].
        power: 1 for linear, 2 for parabolic relief [1].
        crowning: at both ends of the face [m].
        slope: of the lead, gap at z = +width/2 less gap at -width/2 [m].
        pitch: errors of the teeth of pinion and gear [m]; positive leaves a gap.
        maps: of the working flanks of pinion and gear, (n_profile, n_lead) for all teeth or (teeth,
            n_profile, n_lead): material that is missing along the normal [m], at places even in
            roll length from where flanks begin to touch to their tips, and from z = -width/2 to
            +width/2. Between them it is bilinear; None for a perfect flank.
        back_maps: those of the back flanks.
        run_out: (amount [m], direction [rad]) by which the teeth of pinion and gear stand off the
            axis, from where the wheels mesh at the start, in the sense of the axis.
    """

    relief: Annotated[tuple[float, float], Number("m", (2,))] = (0.0, 0.0)
    extent: Annotated[tuple[float, float], Number("m", (2,))] = (0.0, 0.0)
    power: Annotated[float, Positive()] = 1.0
    crowning: Annotated[float, Number("m")] = 0.0
    slope: Annotated[float, Number("m")] = 0.0
    pitch: Each = ((), ())
    maps: Each = (None, None)
    back_maps: Each = (None, None)
    run_out: Each = ((0.0, 0.0), (0.0, 0.0))

    @property
    def measured(self) -> bool:
        """Whether there are maps or run-out."""
        given = any(m is not None for m in (*self.maps, *self.back_maps))
        return given or any(float(amount) != 0.0 for amount, _ in self.run_out)


def flank_map(path: str | Path) -> Array:
    """(teeth, n_profile, n_lead) map of flanks from a file of numbers with commas [m].

    A line has the places along the lead at one place of the profile, from the root to the tip;
    empty lines are between teeth. A file without them is one map for all teeth.

    Raises:
        ModelError: for what is no number, and teeth that are not of one size.
    """
    text = Path(path).read_text(encoding="utf-8").strip()
    blocks = [block for block in text.replace("\r", "").split("\n\n") if block.strip()]
    try:
        teeth = ([line.split(",") for line in block.strip().split("\n")] for block in blocks)
        return np.array([[list(map(float, line)) for line in one] for one in teeth], dtype=float)
    except ValueError as error:
        hint = "Lines have numbers with commas; all teeth, with empty lines between, have as many."
        raise ModelError(f"{path} is no map of flanks: {error}.", hint=hint) from error


def checked_map(given: npt.ArrayLike | None, teeth: int, what: str) -> Array:
    """(teeth or 1, n_profile, n_lead) map, empty for none [m], of what a user gave for a wheel."""
    if given is None:
        return np.zeros((0, 0, 0))
    found, wheel = np.asarray(given, dtype=float), abs(teeth)
    found = found[None] if found.ndim == 2 else found
    if found.ndim != 3 or not found.size or found.shape[0] not in (1, wheel):
        hint = f"Needed is (n_profile, n_lead) or ({wheel}, n_profile, n_lead)."
        fault = f"shape {np.shape(given)}"
    elif n := int((~np.isfinite(found)).sum()):
        hint = "Fill places that were not measured from their neighbours."
        fault = f"{n} values that are no finite numbers"
    else:
        return found
    raise ModelError(f"{what} has {fault}.", hint=hint)
