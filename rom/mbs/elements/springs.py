"""Springs and dampers along the line between two markers."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from rom.arguments import NotNegative, Number
from rom.mbs.elements.family import Family, Places, integers, rows_of
from rom.mbs.kernels.algebra import add, dot, put, row, scale, sub, unit
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.constraints import pair_stiffness, place_relative
from rom.mbs.kernels.element_calls import energy, residuals, tangents
from rom.mbs.kernels.tables import Array2, Index1, Table, table
from rom.mbs.parts.bodies import Marker
from rom.mbs.parts.joints import Whole
from rom.plausible import DAMPING, STIFFNESS, warn_outside


@dataclass(frozen=True, slots=True)
class Spring:
    """Spring and damper between two markers, along the line that joins them."""

    i: Marker
    j: Marker
    stiffness: float
    damping: float
    free_length: float


def spring_damper(
    self: Whole,
    name: str,
    m1: Marker,
    m2: Marker,
    *,
    stiffness: Annotated[float, Number("N/m")],
    damping: Annotated[float, Number("N s/m")] = 0.0,
    free_length: Annotated[float, NotNegative("m")] | None = None,
) -> None:
    """Spring [N/m] and damper [N s/m] along the line between two markers.

    Args:
        stiffness: [N/m].
        damping: [N s/m].
        free_length: length without force [m]; None for the length at the start.
    """
    if free_length is None:
        free_length = float(np.linalg.norm(self.design_point(m2) - self.design_point(m1)))
    doubt(name, stiffness, damping)
    self.add(name, Spring(m1, m2, stiffness, damping, free_length), SPRINGS_FAMILY)


def doubt(name: str, stiffness: float, damping: float) -> None:
    """Warn of numbers of a spring that would drive the motion."""
    warn_outside(STIFFNESS, stiffness, repr(name))
    warn_outside(DAMPING, damping, repr(name))


@table
class Springs(Table):
    """All springs."""

    i: Index1  # (s,) marker
    j: Index1  # (s,) other marker
    law: Array2  # (s, 3) stiffness [N/m], damping [N s/m], free length [m]


def pack(springs: Mapping[str, Spring], places: Places) -> Springs:
    """The springs as arrays."""
    return Springs(
        integers(places.marker[s.i] for s in springs.values()),
        integers(places.marker[s.j] for s in springs.values()),
        rows_of(((s.stiffness, s.damping, s.free_length) for s in springs.values()), 3),
    )


@inner
def spring_state(springs, k, W):
    """Length, direction, relative velocity, rate of length and tension of spring k."""
    i, j, law = springs.i[k], springs.j[k], springs.law[k]
    gap, slide = sub(row(W.P, j, 0), row(W.P, i, 0)), sub(row(W.V, j, 0), row(W.V, i, 0))
    length = math.sqrt(dot(gap, gap))
    e = scale(1.0 / length, gap) if length > 0.0 else (0.0, 0.0, 0.0)
    rate = dot(e, slide)
    return length, e, slide, rate, law[0] * (length - law[2]) + law[1] * rate


@residuals.of(Springs)
def spring_wrenches(_s, W, springs, _q, _v, _lam):
    """Add the springs to the wrenches on the markers; add up the power lost."""
    for k in range(springs.i.size):
        _, e, _, rate, tension = spring_state(springs, k, W)
        put(W.wrench[springs.i[k]], 0, scale(tension, e))
        put(W.wrench[springs.j[k]], 0, scale(-tension, e))
        W.power[2] += springs.law[k, 1] * rate * rate


@tangents.of(Springs)
def spring_tangents(s, W, springs, _lam, ck, cc):
    """Add ck times the stiffness to W.Kt and cc times the damping to W.S."""
    for k in range(springs.i.size):
        length, e, slide, rate, tension = spring_state(springs, k, W)
        if length == 0.0:
            continue
        stiffness, damping = springs.law[k, 0], springs.law[k, 1]
        across = sub(slide, scale(rate, e))
        W.Q[:] = 0.0
        for p in range(3):
            radial = scale(stiffness * e[p] + damping * across[p] / length, e)
            lateral = scale(tension / length, sub(unit(p), scale(e[p], e)))
            place_relative(W.Q, 0, p, ck, add(radial, lateral))
        pair_stiffness(s, W, springs.i[k], springs.j[k], W.Kt)
        if damping != 0.0:
            W.Q[:] = 0.0
            for p in range(3):
                place_relative(W.Q, 0, p, cc * damping * e[p], e)
            pair_stiffness(s, W, springs.i[k], springs.j[k], W.S)


@energy.of(Springs)
def spring_energy(_s, W, springs, _q, _v):
    """Energy stored in springs."""
    total = 0.0
    for k in range(springs.i.size):
        total += 0.5 * springs.law[k, 0] * (spring_state(springs, k, W)[0] - springs.law[k, 2]) ** 2
    return total


KERNELS = spring_wrenches, spring_tangents, spring_energy
SPRINGS_FAMILY = Family("springs", Spring, pack, *KERNELS, by_rate=lambda s: s.law[:, 1].any())
