"""Stress of a body at large deflection, by the gradient of its displacement."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rom.arguments import finite
from rom.body.recovery import von_mises
from rom.errors import ConfigError, ModelError
from rom.model import PAIRS, Array, Index
from rom.process.memory import check_memory

MAX_BYTES = 2e9  # of the gradients of a body; as much again is taken while they are found


@dataclass(frozen=True, slots=True)
class CauchyRecovery:
    """Stress on the outer surface at finite strain.

    The gradient H of the displacement is linear in the elastic coordinates. From it follow, with
    nothing left out, F = 1 + H, Green's strain (F^T F - 1) / 2, the second Piola-Kirchhoff stress
    S = C : E of St. Venant-Kirchhoff material, and the stress in the deformed body F S F^T / det F.
    The gradient at a point is the mean of what its cells say, material by material, not weighted,
    and so is the stress where materials meet. At small deflection it is that of `StressRecovery`.

    Source:
        Bonet and Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, Cambridge
        (2008), chapters 4 and 5.
    """

    points: Array  # (p, 3) undeformed positions [m]
    # (9 s, r) displacement gradient at the samples per unit of each elastic coordinate [1/m]; row
    # 9 * sample + 3 a + b is the derivative of component a along b
    gradient: Array
    stiffness: Array  # (m, 6, 6) Hooke's law of each material, shear strains doubled [Pa]
    node: Index  # (s,) number of the point of each sample
    material: Index  # (s,) number of its material
    share: Array  # (s,) share of the point that it stands for [1]
    inertial: ClassVar[None] = None  # no correction for modes left out is known at large deflection

    @property
    def n_modes(self) -> int:
        """Number r of elastic coordinates."""
        return self.gradient.shape[1]

    def field(self, q: Array, accelerations: Array | None = None) -> Array:
        """(p, 6) stress xx, yy, zz, yz, xz, xy [Pa] in the deformed body, axes of its frame."""
        if accelerations is not None:
            text = "accelerations: no stress of modes left out is known at large deflection"
            raise ConfigError(f"{text}; keep as many modes as the loads excite.")
        H = self._gradient(q)
        F = np.eye(3) + H
        J = np.linalg.det(F)
        if J.min(initial=1.0) <= 0:
            place = self.points[self.node[np.argmin(J)]].tolist()
            text = f"the coordinates turn the material at {place} inside out: its volume is"
            hint = "Stay within the range of loads that the body was reduced for."
            raise ModelError(f"{text} {J.min():.3g} of that at rest.", hint=hint)
        sigma = F @ self._second_piola(H) @ F.swapaxes(1, 2) / J[:, None, None]
        return self._at_points(sigma)

    def second_piola(self, q: Array) -> Array:
        """(p, 6) second Piola-Kirchhoff stress xx, yy, zz, yz, xz, xy [Pa], left by rotation."""
        return self._at_points(self._second_piola(self._gradient(q)))

    def von_mises(self, q: Array, accelerations: Array | None = None) -> Array:
        """(p,) equivalent stress [Pa]; see `field`."""
        return von_mises(self.field(q, accelerations))

    def fits(self, r: int) -> bool:
        """Whether the arrays belong together, to r coordinates and to points that exist."""
        p, s, m = len(self.points), len(self.node), len(self.stiffness)
        shapes = (self.points.shape, self.gradient.shape, self.stiffness.shape)
        if shapes != ((p, 3), (9 * s, r), (m, 6, 6)):
            return False
        if not self.node.shape == self.material.shape == self.share.shape == (s,):
            return False
        return all(
            numbers.dtype.kind == "i" and numbers.size and 0 <= numbers.min() <= numbers.max() < n
            for numbers, n in ((self.node, p), (self.material, m))
        ) and np.allclose(np.bincount(self.node, self.share, p), 1.0)

    def _gradient(self, q: Array) -> Array:
        """(s, 3, 3) displacement gradient H at the samples [1]."""
        q = finite("q", q, (self.n_modes,))
        return (self.gradient @ q).reshape(-1, 3, 3)

    def _second_piola(self, H: Array) -> Array:
        """(s, 3, 3) second Piola-Kirchhoff stress of displacement gradients [Pa]."""
        E, (a, b) = 0.5 * (H + H.swapaxes(1, 2) + H.swapaxes(1, 2) @ H), np.transpose(PAIRS)
        strain, S = np.ascontiguousarray(E[:, a, b] * np.where(a == b, 1, 2)), np.empty_like(E)
        S[:, a, b] = np.einsum("sij,sj->si", self.stiffness[self.material], strain)
        S[:, b, a] = S[:, a, b]
        return S

    def _at_points(self, stress: Array) -> Array:
        """(p, 6) means of the samples (s, 3, 3)."""
        out = np.zeros((len(self.points), 6))
        six = np.stack([stress[:, a, b] for a, b in PAIRS], 1)
        np.add.at(out, self.node, self.share[:, None] * six)
        return out


def refuse_many(n_points: int, r: int) -> None:
    """Say what the gradients of r coordinates at so many points would take, if that is too much."""
    needed = 9 * 8 * n_points * r
    what = f"the stress of {r} coordinates at {n_points} points at large deflection"
    hint = "Ask for fewer shapes, mesh the surface coarser, or reduce with stress=False."
    check_memory(what, needed, MAX_BYTES, hint)
