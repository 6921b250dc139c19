"""What a gallery bears: shares of its capacities, and the falls it stops.

Source:
    Limits after the three failures of Schellenberg, On the design of rockfall protection
    galleries, ETH Zurich (2009): the cushion pressed through, punching, bending. The numbers
    allowed are the user's.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from scipy.optimize import brentq

from rom.arguments import Between, Positive, typed
from rom.components.rockfall.impact import Gallery, strike
from rom.components.rockfall.laws import Mass
from rom.components.rockfall.layer import Layer
from rom.errors import ConfigError, SolverError
from rom.model import Array

MAX_FALL = 300.0  # m; no boulder falls freely from further up onto a gallery
HEIGHT_XTOL = 1e-3  # m


@dataclass(frozen=True, slots=True)
class Verdict:
    """Shares of what is allowed; above one the gallery fails.

    Attributes:
        cushion: deepest penetration over what is allowed of the limit of the cushion [1].
        shear: largest force in shear, if the plug did not crack, over the capacity [1].
        bending: largest deflection over what is allowed of that at yielding [1].
        state: "whole", "cracked", "punched", or "through" for a cushion that is pressed through.
    """

    cushion: float
    shear: float
    bending: float
    state: str

    @property
    def share(self) -> float:
        """The largest of the three [1]."""
        return max(self.cushion, self.shear, self.bending)

    @property
    def decides(self) -> str:
        """Which of the three is the largest."""
        shares = {"cushion": self.cushion, "shear": self.shear, "bending": self.bending}
        return max(shares, key=lambda name: shares[name])


@typed
def design_check(
    g: Gallery,
    *,
    ductility: Annotated[float, Positive()] = 1.0,
    depth: Annotated[float, Between(0.0, 1.0, "(]")] = 1.0,
) -> Verdict:
    """Strike and compare with what cushion, plug and slab bear.

    A plug that has cracked carries less, so the force in shear is that of one that does not.

    Args:
        g: the gallery; without a limit, a capacity in shear or one in bending its share is zero.
        ductility: deflection allowed, in multiples of that at yielding [1].
        depth: penetration allowed, as a share of the limit of the cushion [1].
    """
    try:
        got = strike(replace(g, shear=replace(g.shear, capacity=np.inf)))
    except (ConfigError, SolverError) as error:  # the first: no such cushion takes up the fall
        if isinstance(error, SolverError) and not error.solution.through(g):
            raise
        return Verdict(np.inf, np.inf, np.inf, "through")
    shear = float(got.peaks[1]) / g.shear.capacity
    return Verdict(
        got.deepest / (depth * g.cushion.limit),
        shear,
        got.deflection * g.slab.stiffness / (ductility * g.slab.capacity),
        strike(g).state if shear > 1 else "whole",
    )


@typed
def with_boulder(g: Gallery, boulder: Mass, height: float | None = None) -> Gallery:
    """The gallery under another boulder of the same shape and density.

    Its radius goes by the cube root of the mass [kg]: that of a `Layer`, or, under its square root,
    the stiffness of a `Cushion` after Hertz. It falls from a height [m]; None for that of g.

    Raises:
        ConfigError: for a height that is not positive.
    """
    ratio, c = (boulder / g.boulder) ** (1 / 3), g.cushion
    name, power = ("radius", 1.0) if isinstance(c, Layer) else ("stiffness", 0.5)
    cushion = replace(c, **{name: getattr(c, name) * ratio**power})
    height = g.height if height is None else height
    return replace(g, boulder=boulder, cushion=cushion, height=height)


def capacity_map(
    g: Gallery, boulders: Sequence[float], heights: Sequence[float], **allowed: float
) -> list[list[Verdict]]:
    """(b, h) verdicts on boulders (b,) [kg] from heights (h,) [m]; allowed is as of `design_check`.

    Raises:
        ConfigError: for a mass or a height that is not positive.
    """
    return [[design_check(with_boulder(g, m, h), **allowed) for h in heights] for m in boulders]


def capacity_heights(g: Gallery, boulders: Sequence[float], **allowed: float) -> Array:
    """(b,) heights [m] from which boulders [kg] take all that is allowed; inf beyond 300 m.

    Allowed is as of `design_check`.

    Raises:
        ConfigError: for a mass that is not positive, or a gallery that bears anything.
    """
    if not (g.cushion.limit < np.inf or g.shear.capacity < np.inf or g.slab.capacity < np.inf):
        raise ConfigError("the gallery bears anything: it needs a limit or a capacity.")

    def excess(h: float, m: float) -> float:
        return min(design_check(with_boulder(g, m, h), **allowed).share, 2.0) - 1

    def height(m: float) -> float:
        if excess(MAX_FALL, m) < 0:
            return np.inf
        if excess(HEIGHT_XTOL, m) > 0:
            return 0.0
        return float(brentq(excess, HEIGHT_XTOL, MAX_FALL, (m,), xtol=HEIGHT_XTOL))

    return np.array([height(m) for m in boulders])
