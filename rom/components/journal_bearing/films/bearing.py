"""A plain, grooved or two-lobed journal bearing and the cells its film is divided into.

The journal turns from X to Y. Motions of the journal are measured in the bush from its centre:
ex, ey [m] and the tilt phi_x, phi_y [rad]; the film is
h = c bore - (ex + z phi_y) cos theta - (ey - z phi_x) sin theta.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from rom.arguments import Angle, Between, Number, Size, typed
from rom.errors import ModelError
from rom.model import Array, Index

FULL, REYNOLDS, JFO = 0, 1, 2  # no cavitation; oil from nowhere; oil is conserved
Cavitation = Literal["none", "reynolds", "jfo"]
LAWS = {"none": FULL, "reynolds": REYNOLDS, "jfo": JFO}


class Grid(NamedTuple):
    """Cells of an unwrapped bearing; column i is centred at angle i dtheta."""

    angle: Array  # (2, nt, 2) cosine and sine at the centres [0] and behind them at the faces [1]
    bore: Array  # (2, nt) film of the centred journal there, in clearances
    Z: Array  # (nz,) centres of the cells along the width
    Z_face: Array  # (nz + 1,) their faces
    fixed: Index  # (nt, nz) 1 where the pressure is that of the inlet
    inlet: Array  # (nt, nz) pressure there [Pa]
    slender: float  # (R/L)^2
    half: float  # 1.0 if the cells cover half the width, the other half being its image; else 0.0


@typed
@dataclass(frozen=True, slots=True)
class Groove:
    """An axial groove full of oil.

    Attributes:
        angle: of its middle from X in the direction of rotation [rad].
        width: how far it extends around the bush [rad]; at least one column of cells.
        pressure: of the oil in it [Pa].
        share: of the width of the bearing, about its middle [1].
    """

    angle: Angle
    width: Angle = 0.0
    pressure: Annotated[float, Number("Pa")] = 0.0
    share: float = 1.0


@typed
@dataclass(frozen=True)
class JournalBearing:
    """A bearing and the cells its film is divided into.

    ``cavitation``: "reynolds" lets pressure end without slope, where oil may come from nowhere;
    "jfo" (Jakobsson, Floberg, Olsson) conserves oil and needs a groove; "none" lets oil pull.

    Attributes:
        diameter, length: of the journal [m].
        clearance: radius of the bush less radius of the journal [m]; of a lobe, if preloaded.
        grooves: inlets of oil.
        cavitation: what happens where oil would have to pull.
        preload: of a lobed bore; its arcs are moved together by so many clearances [1].
        lobes: angle of the line along which two arcs are moved [rad].
        cells: around the bearing, along its width.
        aligned: the journal never tilts, and the cells cover half the width.
        bore: film of the centred journal over the clearance [1] as a function of angles (n,) [rad],
            in place of lobes, as `multilobe` makes one.

    Raises:
        ModelError: for numbers that no bearing has, or grooves that its cavitation needs and lacks.
    """

    diameter: Size
    length: Size
    clearance: Size
    grooves: Sequence[Groove] = ()
    cavitation: Cavitation = "reynolds"
    preload: Annotated[float, Between(0.0, 1.0, "[)", error=ModelError)] = 0.0
    lobes: float = 0.0
    cells: tuple[int, int] = (120, 8)
    aligned: bool = False
    bore: Callable[[Array], Array] | None = None
    grid: Grid = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        for fault, hint in self._faults():
            raise ModelError(fault, hint=hint)

    def _faults(self) -> Iterator[tuple[str, str]]:
        """Why it is no bearing, the first first, and what to do; divides the film into cells."""
        if self.clearance > 0.05 * self.diameter:
            size = f"diameter {self.diameter} m, length {self.length} m"
            text = f"no bearing has {size} and clearance {self.clearance} m: a film is thin against"
            hint = "Give all three in metres; the clearance is about 0.001 of the diameter."
            yield f"{text} the journal.", hint
        if self.bore is not None and self.preload:
            yield "a bearing takes a preload of lobes or a bore of its own, not both.", ""
        if self.cavitation == "jfo" and not self.grooves:
            yield "a mass-conserving film without a groove has no oil.", "Add a Groove."
        if min(self.cells) < 2 or self.cells[0] < 12:
            yield f"{self.cells} cells are too few; at least 12 around and 2 along.", ""
        object.__setattr__(self, "grid", _grid(self))
        if not (np.isfinite(self.grid.bore).all() and self.grid.bore.min() > 0.0):
            yield "the bore must be > 0 all around, to leave a centred journal room.", ""

    @property
    def radius(self) -> float:
        """Of the journal [m]."""
        return self.diameter / 2

    @property
    def scale(self) -> Array:
        """(4,) motions that change the film by a clearance [m, m, rad, rad]."""
        c = self.clearance
        return np.array([c, c, c / self.length, c / self.length])

    @property
    def oiled(self) -> tuple["JournalBearing", ...]:
        """For one that conserves its oil: with oil everywhere, with its grooves and without.

        These films carry on any way to an equilibrium, and where they rest it is not far.
        """
        if self.cavitation != "jfo":
            return ()
        grooved = replace(self, cavitation="reynolds")
        return grooved, replace(grooved, grooves=())

    def thinnest(self, motion: npt.ArrayLike) -> float:
        """Smallest film of the cells [m] at a motion (2,) or (4,) of the journal [m, rad]."""
        m = four(motion) / self.scale
        edges = np.zeros(1) if self.aligned else np.array([-0.5, 0.5])
        return self.clearance * float(np.min(thickness(self.grid, m, edges)))


def multilobe(lobes: int, preload: float, *, first: float = 0.0) -> Callable[[Array], Array]:
    """A bore of several equal arcs, each moved towards the middle along its own middle.

    The preload is in clearances [1], the angle ``first`` that of the middle of an arc [rad].

    Raises:
        ModelError: for no arcs, or a preload that leaves no room.
    """
    if lobes < 1 or not 0 <= preload < 1:
        raise ModelError(f"lobes = {lobes} must be at least 1, preload = {preload} 0 to 1.")
    half = np.pi / lobes

    def bore(angles: Array) -> Array:
        return 1 - preload * np.cos((angles - first + half) % (2 * half) - half)

    return bore


def four(values: npt.ArrayLike) -> Array:
    """A motion or rate of two or four components as one of four."""
    given = np.asarray(values, dtype=float)
    return np.concatenate([given, np.zeros(4 - given.size)])


def thickness(grid: Grid, m: Array, Z: Array) -> Array:
    """(2, nt, len(Z)) film in clearances at centres and faces behind them."""
    c, s = grid.angle[..., :1], grid.angle[..., 1:]
    return grid.bore[..., None] - (m[0] + Z * m[3]) * c - (m[1] - Z * m[2]) * s


def _grid(bearing: JournalBearing) -> Grid:
    nt, nz = bearing.cells
    dtheta = 2 * np.pi / nt
    theta = dtheta * np.arange(nt)
    both = np.stack([theta, theta + dtheta / 2])
    Z_face = np.linspace(0.0 if bearing.aligned else -0.5, 0.5, nz + 1)
    Z = (Z_face[1:] + Z_face[:-1]) / 2
    fixed, inlet = np.zeros((nt, nz), dtype=np.int64), np.zeros((nt, nz))
    for groove in bearing.grooves:
        apart = np.abs((theta - groove.angle + np.pi) % (2 * np.pi) - np.pi)
        wet = (apart <= max(groove.width / 2, apart.min()) + 1e-9)[:, None]
        wet = wet & (np.abs(Z) <= max(groove.share / 2, np.abs(Z).min()) + 1e-9)
        fixed[wet], inlet[wet] = 1, groove.pressure
    if bearing.bore is None:
        bore = 1 - bearing.preload * np.abs(np.cos(both - bearing.lobes))
    else:
        bore = np.array([bearing.bore(angles) for angles in both], dtype=float).reshape(2, nt)
    angle = np.stack([np.cos(both), np.sin(both)], axis=-1)
    slender = (bearing.radius / bearing.length) ** 2
    return Grid(angle, bore, Z, Z_face, fixed, inlet, slender, float(bearing.aligned))
