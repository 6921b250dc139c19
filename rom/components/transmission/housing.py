"""A housing that gives way under its bearings: a reduced body whose bushes move.

Journals move in their bushes: a film feels the motion of the journal less that of the bush and acts
on both. The datum is the housing as it stands, under its own weight.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rom.arguments import orthonormal
from rom.body.flexible import FlexibleBody
from rom.body.reference import marker_motion
from rom.errors import ModelError
from rom.model import Array

Bushes = Mapping[int, Array]


@dataclass(frozen=True)
class Housing:
    """Matrices of a housing that is held somewhere, and how its bushes move.

    Attributes:
        M, K: (n, n) mass and stiffness, in units of the coordinates of the body.
        bushes: of pinion and gear, {node of the shaft: (6, n)} motion of the bush u_x, u_y, u_z,
            phi_x, phi_y, phi_z per coordinate, in the axes of the unit.
    """

    M: Array
    K: Array
    bushes: tuple[Bushes, Bushes]

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return len(self.M)

    @classmethod
    def of_body(
        cls,
        body: FlexibleBody,
        *,
        pinion: Mapping[int, str],
        gear: Mapping[int, str],
        fixed: tuple[str, ...],
        axes: npt.ArrayLike = ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    ) -> "Housing":
        """A reduced body held at some interfaces.

        Args:
            body: the housing.
            pinion: {node of the shaft: interface of its bush}.
            gear: the same of the gear.
            fixed: interfaces that do not move.
            axes: (3, 3) rows: X, Y and Z of the unit in the axes of the body [1].

        Raises:
            InterfaceError: if the body has no such interface.
            ModelError: if axes are not orthonormal, or the interfaces do not hold the body.
        """
        A = orthonormal("axes of the unit", axes, error=ModelError)
        omega, V = body.modes(fixed=fixed)
        if omega[0] ** 2 < 1e-9 * omega[-1] ** 2:
            text = f"the housing {body.name!r} moves as a whole although {fixed} are held"
            raise ModelError(f"{text}; hold an interface that stops all six rigid motions.")
        N = np.sqrt(body.mass) * V
        turn = np.kron(np.eye(2), A)
        left, right = (
            {node: turn @ motion_of(body, name) @ N for node, name in where.items()}
            for where in (pinion, gear)
        )
        return cls(body.mass * np.eye(omega.size), np.diag(body.mass * omega**2), (left, right))

    def check(self, *bearings: Mapping[int, object]) -> None:
        """See that every bearing has a bush.

        Raises:
            ModelError: naming what is missing, or does not fit.
        """
        if self.M.shape != self.K.shape or self.M.shape != (self.n, self.n):
            raise ModelError(f"M {self.M.shape} and K {self.K.shape} must be ({self.n}, {self.n}).")
        for name, held, there in zip(("pinion", "gear"), bearings, self.bushes, strict=True):
            if set(held) != set(there):
                text = f"the {name} has bearings at nodes {sorted(held)}, the housing has bushes"
                raise ModelError(f"{text} for {sorted(there)}; name one per bearing.")
            if any(np.shape(rows) != (6, self.n) for rows in there.values()):
                raise ModelError(f"a bush of the {name} needs rows of shape (6, {self.n}).")


def motion_of(body: FlexibleBody, name: str) -> Array:
    """(6, 6 + r) mean motion of an interface per rigid and elastic coordinate."""
    return np.hstack(marker_motion(body.marker(name), body.n_modes))
