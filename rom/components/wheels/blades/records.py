"""Records of blades and of sectors whose blade is cut off."""

from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from rom.arguments import typed, vector
from rom.components.wheels.reduced import ReducedSector
from rom.components.wheels.sector import NO_DOFS
from rom.errors import ConfigError
from rom.model import Array, Index


@typed
@dataclass(frozen=True)
class ReducedBlade:
    """One blade in r coordinates of its root, then m cantilever modes.

    Attributes:
        K: (r + m, r + m) stiffness [N/m; 1/s^2].
        M: (r + m, r + m) mass [kg; 1].
        Psi: (n, r + m) displacement shapes on the dofs of the model the blade comes from [1;
            kg^-1/2].
        n_root: number r of root coordinates.
        coriolis: (r + m, r + m) skew-symmetric Coriolis matrix per rad/s [kg], or None.
        centrifugal: (r + m, r + m) change of K per (rad/s)^2: geometric stiffness of centrifugal
            stress less spin softening [kg]; None for a blade at rest.
    """

    K: Array
    M: Array
    Psi: Array
    n_root: int
    coriolis: Array | None = None
    centrifugal: Array | None = None

    @property
    def n_modes(self) -> int:
        """Number m of cantilever modes."""
        return len(self.K) - self.n_root

    @property
    def omega(self) -> Array:
        """(m,) circular frequencies of the cantilever blade [rad/s]."""
        modes = slice(self.n_root, None)
        return np.sqrt(self.K.diagonal()[modes] / self.M.diagonal()[modes])

    def varied(
        self, *, stiffness: float = 0.0, density: float = 0.0, cantilever: npt.ArrayLike = ()
    ) -> "ReducedBlade":
        """The blade with other parameters.

        Centrifugal stress follows from equilibrium: it grows with the density, not the stiffness.

        Args:
            stiffness: relative deviation of the stiffness of the blade [1].
            density: relative deviation of its density [1].
            cantilever: (k,) relative deviations of its first k cantilever frequencies [1], beyond
                what the two others do; shapes and root keep theirs.

        Raises:
            ConfigError: for a deviation not above -1, or of a mode the blade does not have.
        """
        delta = vector("cantilever", cantilever) if np.size(cantilever) else np.zeros(0)
        all_of_them = np.r_[stiffness, density, delta]
        if all_of_them.min() <= -1.0:
            raise ConfigError(f"deviations {all_of_them}: each must be a number above -1.")
        if delta.size > self.n_modes:
            raise ConfigError(
                f"{delta.size} deviations of cantilever frequencies; the blade has {self.n_modes} "
                "cantilever modes."
            )
        K = (1.0 + stiffness) * self.K
        modes = self.n_root + np.arange(delta.size)
        K[modes, modes] *= (1.0 + delta) ** 2
        heavier = 1.0 + density
        return replace(
            self,
            K=K,
            M=heavier * self.M,
            coriolis=None if self.coriolis is None else heavier * self.coriolis,
            centrifugal=None if self.centrifugal is None else heavier * self.centrifugal,
        )


@dataclass(frozen=True)
class SubstructuredSector(ReducedSector):
    """Coordinates: two cyclic faces, the root, modes of the disk, cantilever modes of the blade.

    Attributes:
        blade: the nominal blade, in its root coordinates and its cantilever modes.
        root: (r,) which coordinates are those of the root.
        cantilever: (m,) which are cantilever modes.
        root_points: (k, 3) nodes of the root [m].
        root_functions: (k, r / 3) functions on it [1], alike for the three directions.
        root_moved: (k, 3) displacement of the root in a wheel at 1 rad/s [m]; None at rest.
    """

    blade: ReducedBlade | None = None
    root: Index = field(default_factory=lambda: NO_DOFS)
    cantilever: Index = field(default_factory=lambda: NO_DOFS)
    root_points: Array | None = None
    root_functions: Array | None = None
    root_moved: Array | None = None
