"""Strain energy of a body at finite strain: a polynomial of fourth order in its coordinates.

    U = q K q / 2 + T3 q q q + T4 q q q q,    f = K q + 3 T3 q q + 4 T4 q q q,
    tangent K + 6 T3 q + 12 T4 q q

T3 and T4 are symmetric in all indices, and only entries with i <= j <= k <= l are kept.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import chain, combinations_with_replacement
from math import comb

import numpy as np

from rom.model import Array, Index

BLOCK_ENTRIES = 4_000_000  # products of coordinates at many instants that are held at once


class Energy:
    """Strain energy of elastic coordinates q (r,), known by its `expansion` about any of them."""

    K: Array
    expansion: Callable[[Array], tuple[float, Array, Array]]

    @property
    def n(self) -> int:
        """Number r of coordinates."""
        return len(self.K)

    def energy(self, q: Array) -> float:
        """Strain energy [J] at the coordinates (r,)."""
        return self.expansion(q)[0]

    def force(self, q: Array) -> Array:
        """(r,) derivative of the energy [N] at the coordinates (r,)."""
        return self.expansion(q)[1]

    def tangent(self, q: Array) -> Array:
        """(r, r) second derivative of the energy [N/m] at the coordinates (r,)."""
        return self.expansion(q)[2]


@dataclass(frozen=True)
class Quartic(Energy):
    """Strain energy of fourth order."""

    K: Array  # (r, r) stiffness without load [N/m]
    cubic: Array  # (r (r + 1) (r + 2) / 6,) entries of T3, i <= j <= k, the last index fastest
    quartic: Array  # (r (r + 1) (r + 2) (r + 3) / 24,) entries of T4, i <= j <= k <= l

    @classmethod
    def from_gram(cls, G: Array, r: int) -> "Quartic":
        """From the Gram matrix (N, N) of r strains, see `rom.fe.forms.large_strain`."""
        K, A, B = G[:r, :r], G[:r, r:], G[r:, r:]
        pair = pair_numbers(r)
        i, j, k = entries(r, 3).T
        cubic = (A[i, pair[j, k]] + A[j, pair[i, k]] + A[k, pair[i, j]]) / 6
        i, j, k, l = entries(r, 4).T
        quartic = B[pair[i, j], pair[k, l]] + B[pair[i, k], pair[j, l]] + B[pair[i, l], pair[j, k]]
        return cls(0.5 * (K + K.T), cubic, quartic / 24)

    def fits(self, r: int) -> bool:
        """Whether there are as many entries as r coordinates have."""
        shapes = self.K.shape, self.cubic.shape, self.quartic.shape
        return shapes == ((r, r), (n_entries(r, 3),), (n_entries(r, 4),))

    def energies(self, Q: Array) -> Array:
        """(t,) strain energies [J] at the coordinates (t, r)."""
        i, j = np.triu_indices(self.n)
        by_one, by_two = self.by_pairs
        weight, found = np.where(i == j, 1.0, 2.0), [np.zeros(0)]
        for q in np.array_split(Q, 1 + Q.shape[0] * i.size // BLOCK_ENTRIES):
            square = weight * q[:, i] * q[:, j]
            higher = q @ by_one.T + square @ by_two
            found.append((square * (0.5 * self.K[i, j] + higher)).sum(axis=1))
        return np.concatenate(found)

    def expansion(self, q: Array) -> tuple[float, Array, Array]:
        """Energy [J], force (r,) [N] and tangent (r, r) [N/m] at the coordinates (r,) at once."""
        i, j = np.triu_indices(self.n)
        square = np.where(i == j, 1.0, 2.0) * q[i] * q[j]
        by_one, by_two = self.by_pairs
        S3, S4 = (by_one @ q)[self._pair], (by_two @ square)[self._pair]
        energy = float(q @ (0.5 * self.K + S3 + S4) @ q)
        return energy, (self.K + 3 * S3 + 4 * S4) @ q, self.K + 6 * S3 + 12 * S4

    @cached_property
    def by_pairs(self) -> tuple[Array, Array]:
        """T3 as (r (r + 1) / 2, r) and T4 as a matrix of pairs, for fast contraction."""
        i, j = (x[:, None] for x in np.triu_indices(self.n))
        three = np.broadcast_arrays(i, j, np.arange(self.n))
        four = np.broadcast_arrays(i, j, i.T, j.T)
        T3, T4 = (position(np.stack(x, -1), self.n) for x in (three, four))
        return self.cubic[T3], self.quartic[T4]

    @cached_property
    def _pair(self) -> Index:
        return pair_numbers(self.n)


def entries(r: int, order: int) -> Index:
    """(e, order) indices i <= j <= ... < r of the entries that are kept, last one fastest."""
    every = chain.from_iterable(combinations_with_replacement(range(r), order))
    return np.fromiter(every, dtype=np.int64).reshape(-1, order)


def n_entries(r: int, order: int) -> int:
    """Number of entries of a symmetric tensor."""
    return comb(r + order - 1, order)


def position(indices: Index, r: int) -> Index:
    """Where the entries with these indices (..., order), in any sequence, are kept."""
    ordered, order = np.sort(indices, axis=-1), indices.shape[-1]
    at = np.full(ordered.shape[:-1], n_entries(r, order) - 1)
    for k in range(order):  # entries that come later, counted index by index
        behind = np.array([n_entries(r - 1 - i, order - k) for i in range(r)], dtype=np.int64)
        at = at - behind[ordered[..., k]]
    return at


def pair_numbers(r: int) -> Index:
    """(r, r) number of each pair among those with j <= k."""
    return position(np.moveaxis(np.indices((r, r)), 0, -1), r)
