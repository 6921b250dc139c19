"""The film between journal and bush in SI units: its pressure, and what it does.

Source:
    Reynolds, Phil. Trans. R. Soc. 177 (1886) 157; cavitation by complementarity as in
    Giacopini, Fowell, Dini and Strozzi, J. Tribol. 132 (2010) 041702.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from rom.components.journal_bearing.films.bearing import JournalBearing, four
from rom.components.journal_bearing.films.bearing import thickness as gap
from rom.components.journal_bearing.films.cells import N_MOTIONS, cells_of
from rom.components.journal_bearing.films.slopes import solve_film
from rom.errors import ModelError, SolverError
from rom.model import Array, Index


def film(
    bearing: JournalBearing,
    motion: npt.ArrayLike,
    rate: npt.ArrayLike = (0.0, 0.0, 0.0, 0.0),
    *,
    speed: float,
    viscosity: float,
    warm: Index | None = None,
) -> "Film":
    """Solve for the pressure in the film.

    Args:
        bearing: the bearing.
        motion: (2,) or (4,) ex, ey, phi_x, phi_y of the journal in the bush [m, rad].
        rate: (2,) or (4,) its velocity [m/s, rad/s].
        speed: of rotation [rad/s], positive.
        viscosity: dynamic, of the oil [Pa s].
        warm: (nt, nz) `Film.active` of a film nearby, which saves iterations.

    Raises:
        ModelError: if the journal touches the bush, or tilts in an aligned bearing.
        SolverError: if no film was found.
    """
    m, v = four(motion) / bearing.scale, four(rate) / (bearing.scale * speed)
    if not (speed > 0 and viscosity > 0):
        text = f"speed {speed} rad/s and viscosity {viscosity} Pa s must be positive"
        raise ModelError(f"{text}; see a shaft that turns otherwise from its other end.")
    if bearing.aligned and np.any([m[2:], v[2:]]):
        raise ModelError("the journal tilts, but the bearing is aligned; give it aligned=False.")
    if not bearing.thinnest(motion) > 0:
        text = f"the journal touches the bush at {np.asarray(motion) * 1e6} (micrometres, -radians"
        raise ModelError(f"{text}); its clearance is {bearing.clearance * 1e6:.3g} micrometres.")
    shape = bearing.grid.fixed.shape
    films = cells_of([bearing])
    films.state[0, : 2 * N_MOTIONS + 1] = *m, *v, 1.0
    if warm is not None:
        films.active[0] = warm.ravel()
    n = solve_film(films, 0, viscosity * speed)
    P, fill, active = (x[0].reshape(shape) for x in (films.P, films.fill, films.active))
    F, dF = films.answer[0, :N_MOTIONS], films.slope[0, :N_MOTIONS, : 2 * N_MOTIONS]
    if n < 0 or not np.isfinite(F).all():
        text = f"the cavitated region of the film does not settle at {m[:2]} clearances."
        raise SolverError(text, hint="Use more cells, or cavitation 'reynolds'.")
    moved = m * bearing.scale, v * bearing.scale * speed
    return Film(bearing, *moved, speed, viscosity, P, fill, active, F, dF, n)


@dataclass(frozen=True)
class Film:
    """Pressure in a film and what it does.

    Attributes:
        motion, rate: (4,) of the journal [m, rad; per second].
        speed, viscosity: [rad/s], [Pa s].
        P: (nt, nz) pressure in units of viscosity speed (R/c)^2.
        fill: (nt, nz) share of the gap that is oil [1].
        active: (nt, nz) 1 where the film carries pressure.
        F, dF: (4,), (4, 8) dimensionless forces and their derivatives [1].
        iterations: changes of the cavitated region, and one more.
    """

    bearing: JournalBearing
    motion: Array
    rate: Array
    speed: float
    viscosity: float
    P: Array
    fill: Array
    active: Index
    F: Array
    dF: Array
    iterations: int

    @property
    def unit(self) -> float:
        """Force that dimensionless forces are measured in [N]."""
        b = self.bearing
        return self.viscosity * self.speed * b.radius * b.length * (b.radius / b.clearance) ** 2

    @property
    def pressure(self) -> Array:
        """(nt, nz) [Pa]."""
        b = self.bearing
        return self.P * self.viscosity * self.speed * (b.radius / b.clearance) ** 2

    @property
    def force(self) -> Array:
        """(4,) force [N] and moment about the middle [N m] of the film on the journal."""
        return self.unit * self.F * self.bearing.clearance / self.bearing.scale

    @property
    def stiffness(self) -> Array:
        """(4, 4) minus the derivative of the force by the motion [N/m, N, N m]."""
        d = self.bearing.scale
        return -self.unit * self.bearing.clearance * self.dF[:, :4] / np.outer(d, d)

    @property
    def damping(self) -> Array:
        """(4, 4) minus the derivative of the force by the rate of motion [N s/m, N s, N m s]."""
        d = self.bearing.scale * self.speed
        return -self.unit * self.bearing.clearance * self.dF[:, 4:] / np.outer(d / self.speed, d)

    @cached_property
    def thickness(self) -> Array:
        """(nt, nz) [m]."""
        m = self.motion / self.bearing.scale
        return self.bearing.clearance * gap(self.bearing.grid, m, self.bearing.grid.Z)[0]

    @property
    def eccentricity(self) -> float:
        """Distance of the centres in clearances [1]."""
        return float(np.hypot(*self.motion[:2])) / self.bearing.clearance

    @property
    def sommerfeld(self) -> float:
        """Viscosity times revolutions times L D / W (R/c)^2 [1]."""
        return float(self.unit / (np.pi * np.hypot(*self.force[:2])))

    @cached_property
    def friction_torque(self) -> float:
        """That brakes the journal [N m]: shear of the oil there is, and pressure on its slope."""
        b = self.bearing
        size = self.viscosity * self.speed * b.radius**3 * b.length / b.clearance
        return size * self._drag(self.fill)

    def friction(self, streamers: bool = True) -> float:
        """Friction over load times R/c [1]; with streamers also of the oil where it cavitates."""
        return self._drag(1.0 if streamers else self.fill) / float(np.hypot(*self.F[:2]))

    @property
    def dissipated(self) -> float:
        """Power that turns into heat [W]."""
        return self.friction_torque * self.speed - float(self.force @ self.rate)

    @property
    def side_flow(self) -> float:
        """Oil that leaves at both ends [m^3/s]."""
        b, grid = self.bearing, self.bearing.grid
        ends = [(grid.Z.size - 1, -1)] if b.aligned else [(0, 0), (grid.Z.size - 1, -1)]
        m, out = self.motion / b.scale, 0.0
        for cell, face in ends:
            H = gap(grid, m, grid.Z_face[face : face + 1 or None])[0, :, 0]
            out += float(np.sum(H**3 * self.P[:, cell])) * (2 if b.aligned else 1)
        dZ, dtheta = np.diff(grid.Z_face)[0], 2 * np.pi / len(self.P)
        return self._flow * out * 2 * grid.slender * dtheta / dZ

    @property
    def flow_around(self) -> Array:
        """(nt,) oil that passes the faces behind the columns [m^3/s]."""
        H = gap(self.bearing.grid, self.motion / self.bearing.scale, self.bearing.grid.Z)[1]
        drop = np.roll(self.P, -1, axis=0) - self.P
        around = 6 * self.fill * H - H**3 * drop * len(H) / (2 * np.pi)
        return self._flow * self._width * around.sum(axis=1)

    @property
    def _width(self) -> float:
        """Width of a cell, with its image."""
        return float(np.diff(self.bearing.grid.Z_face)[0]) * (2 if self.bearing.aligned else 1)

    @property
    def _flow(self) -> float:
        b = self.bearing
        return self.speed * b.clearance * b.radius * b.length / 12

    def _drag(self, fill: Array | float) -> float:
        """Torque of oil that is sheared and of pressure on the slope of the film [1]."""
        grid = self.bearing.grid
        H, behind = gap(grid, self.motion / self.bearing.scale, grid.Z)
        shear = np.sum(fill / H) * 2 * np.pi / len(H)
        rise = behind - np.roll(behind, 1, axis=0)
        return self._width * float(shear - 0.5 * np.sum(self.P * rise))
