"""Reduced bodies coupled where they touch: modes of the whole from its parts."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import block_diag, eigh, null_space

from rom.body.flexible import FlexibleBody, Marker
from rom.errors import ConfigError, InterfaceError
from rom.model import Array

Place = tuple[str, str]  # body, interface
SAME_PLACE = 1e-6  # distance of two interfaces, of the size of the bodies, that still meet


@dataclass(frozen=True)
class Assembly:
    """Bodies that share interfaces, in the position in which they were modelled.

    Interfaces are coupled by their coordinates: all dofs of conforming meshes ("full"), rigid or
    mean motions, or the coefficients of orthogonal functions, which two surfaces have in common
    even when their meshes do not match.

    Attributes:
        bodies: {name: body}, all in one system of coordinates.
        couplings: ((body, interface), (body, interface)) pairs that move together.

    Raises:
        ConfigError: if a body is unknown or a coupling is no pair of places.
        InterfaceError: if two interfaces are of different kind or size, or lie apart.
    """

    bodies: dict[str, FlexibleBody]
    couplings: tuple[tuple[Place, Place], ...]

    def __post_init__(self) -> None:
        for coupling in self.couplings:
            try:
                one, other = (self._marker(place) for place in coupling)
            except (TypeError, ValueError) as error:
                raise ConfigError(
                    f"coupling {coupling!r} is not a pair of (body, interface)."
                ) from error
            _check_pair(coupling, one, other, max(b.size for b in self.bodies.values()))

    def frequencies(self, n: int | None = None, *, fixed: tuple[Place, ...] = ()) -> Array:
        """Natural frequencies of the assembly [Hz].

        Args:
            n: how many, lowest first; None for all.
            fixed: (body, interface) pairs that are held.

        Raises:
            InterfaceError: if an interface is unknown.
        """
        return self.modes(n, fixed=fixed)[0] / (2 * np.pi)

    def modes(
        self, n: int | None = None, *, fixed: tuple[Place, ...] = ()
    ) -> tuple[Array, dict[str, Array]]:
        """Natural modes: omega (m,) [rad/s], and per body its shapes (6 + r, m)."""
        M, K = (block_diag(*parts) for parts in zip(*self._matrices(), strict=True))
        N = self._free(fixed)
        if not N.size:
            return np.zeros(0), {name: np.zeros((w, 0)) for name, w in self._widths().items()}
        M_n = N.T @ M @ N
        scale = 1 / np.sqrt(np.diag(M_n))
        lam, V = eigh(scale[:, None] * (N.T @ K @ N) * scale, scale[:, None] * M_n * scale)
        omega = np.sqrt(np.maximum(lam, 0.0))
        omega[: self._n_rigid(fixed)] = 0.0
        shapes = N @ (scale[:, None] * V)
        ends = np.cumsum(list(self._widths().values()))[:-1]
        split = dict(zip(self.bodies, np.split(shapes[:, :n], ends), strict=True))
        return omega[:n], split

    def _matrices(self) -> list[tuple[Array, Array]]:
        return [body.full_matrices() for body in self.bodies.values()]

    def _widths(self) -> dict[str, int]:
        return {name: 6 + body.n_modes for name, body in self.bodies.items()}

    def _marker(self, place: Place) -> Marker:
        body, interface = place
        if body not in self.bodies:
            raise ConfigError(f"no body {body!r}; the assembly has {sorted(self.bodies)}.")
        return self.bodies[body].marker(interface)

    def _free(self, fixed: tuple[Place, ...]) -> Array:
        """(n, m) motions of all bodies that satisfy couplings and supports."""
        size = max(body.size for body in self.bodies.values())
        scale = np.concatenate(
            [np.r_[np.ones(3), np.full(3, 1 / size), np.ones(b.n_modes)]
             for b in self.bodies.values()]
        )  # fmt: skip
        C = self._rows(fixed) * scale
        if not C.size:
            return np.diag(scale)
        C = C / np.maximum(np.linalg.norm(C, axis=1, keepdims=True), 1e-300)
        return scale[:, None] * null_space(C, rcond=1e-10)

    def _rows(self, fixed: tuple[Place, ...]) -> Array:
        """(c, n) what is zero: differences of coupled interfaces, coordinates of held ones."""
        widths = self._widths()
        starts = dict(zip(widths, np.cumsum([0, *widths.values()])[:-1], strict=True))
        rows = [np.zeros((0, sum(widths.values())))]
        terms: list[tuple[tuple[Any, float], ...]] = [
            ((one, 1.0), (other, -1.0)) for one, other in self.couplings
        ]
        terms += [((place, 1.0),) for place in fixed]
        for term in terms:
            block = np.zeros((self._marker(term[0][0]).hold.shape[0], rows[0].shape[1]))
            for place, sign in term:
                hold, start = self._marker(place).hold, starts[place[0]]
                block[:, start : start + hold.shape[1]] += sign * hold
            rows.append(block)
        return np.vstack(rows)

    def _n_rigid(self, fixed: tuple[Place, ...]) -> int:
        """Rigid motions of the whole that supports leave free."""
        size = max(body.size for body in self.bodies.values())
        held = [self._marker(place).hold[:, :6] for place in fixed]
        rows = np.vstack([np.zeros((1, 6)), *held]) * np.r_[np.ones(3), np.full(3, 1 / size)]
        return 6 - int(np.linalg.matrix_rank(rows, tol=1e-9))


def _check_pair(coupling: Any, one: Marker, other: Marker, size: float) -> None:
    if one.kind != other.kind or one.hold.shape[0] != other.hold.shape[0]:
        raise InterfaceError(
            f"{coupling[0]} is {one.kind} with {one.hold.shape[0]} coordinates, {coupling[1]} is "
            f"{other.kind} with {other.hold.shape[0]}: they cannot move together.",
            hint="Reduce both bodies with the same kind; on meshes that do not match, with "
            "Polynomial of the same order.",
        )
    gap = np.linalg.norm(one.point - other.point)
    if gap > SAME_PLACE * size:
        raise InterfaceError(
            f"{coupling[0]} and {coupling[1]} lie {gap:.3g} m apart.",
            hint="Model the bodies in the position in which they are assembled.",
        )
