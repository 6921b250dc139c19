"""Characteristic constraint modes: few functions for the interfaces of an assembly, computed.

The motions of an assembly split into those that hold its coupled interfaces (F) and those that
move them (C), chosen orthogonal to the first in the stiffness, C^T K F = 0: statics of the bodies
between their interfaces. The eigenproblem of the second part alone says which motions of the
interfaces matter at low frequency::

    C^T K C chi = lambda C^T M C chi

Source:
    Castanier, Tan and Pierre, Characteristic constraint modes for component mode synthesis, AIAA
    J. 39 (2001) 1182; for components of their own, Hong, Epureanu and Castanier, Next-generation
    parametric reduced-order models, Mech. Syst. Signal Process. 37 (2013) 403.
"""

import logging
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.linalg import block_diag, eigh, orth

from rom.arguments import lowest
from rom.body.flexible import FlexibleBody
from rom.eigen.verbs import modes_within, whole_clusters
from rom.model import Array, Modes, Report
from rom.reduction.bases.selection import reduced_modes

RANK_RTOL = 1e-10  # singular value, of the largest one, below which rows or functions are dependent
RIGID_RTOL = 1e-13  # eigenvalue of a motion without stiffness, of the largest one
log = logging.getLogger("rom")


@dataclass(frozen=True, slots=True)
class Partition:
    """Motions of a structure, with and without motion of its interfaces."""

    C: Array  # (n, c) motions that move the interfaces, K-orthogonal to F
    F: Array  # (n, f) motions that hold them, M-orthonormal
    lam: Array  # (c,) eigenvalues of the interface motions [rad^2/s^2], ascending
    chi: Array  # (c, c) their shapes in C: the characteristic constraint modes, all of them


@dataclass(frozen=True, slots=True)
class CondensedAssembly:
    """An assembly whose coupled interfaces follow few functions; its supports stay as chosen.

    Attributes:
        level: "system" or "local".
        n_interface: number of interface functions kept.
        interface_omega: (n_interface,) circular frequencies of the interface functions [rad/s],
            fixed-interface modes left out.
        basis: (n, m) motions kept, in units of the coordinates of all bodies, interface functions
            first.
        M: (m, m) mass, in units of that of the bodies.
        K: (m, m) stiffness, in units of that of the bodies.
        widths: {body: number of its coordinates}.
        n_rigid: rigid motions that the supports leave free.
        certificate: frequencies against the assembly with all its interface coordinates.
        assembly: the one that was reduced.
    """

    level: str
    n_interface: int
    interface_omega: Array
    basis: Array
    M: Array
    K: Array
    widths: dict[str, int]
    n_rigid: int
    certificate: Report
    assembly: Any = field(repr=False)

    def frequencies(self, n: int | None = None) -> Array:
        """(k,) natural frequencies [Hz], lowest first; None for all."""
        return self.modes(n).frequencies

    def modes(self, n: int | None = None) -> Modes:
        """Natural modes: omega (m,) [rad/s], and per body its shapes (6 + r, m)."""
        omega, V = natural_modes(self.M, self.K, self.n_rigid)
        kept = lowest(n)
        return Modes(omega[kept], per_body(self.widths, self.basis @ V[:, kept]))

    def body(self, name: str = "assembly", **options: Any) -> FlexibleBody:
        """One body with these interface functions, of an assembly without supports.

        Arguments and errors as of `Assembly.body`.
        """
        found: FlexibleBody = self.assembly.body(name, within=self.basis, **options)
        return found


def natural_modes(M: Array, K: Array, n_rigid: int) -> tuple[Array, Array]:
    """Frequencies (m,) [rad/s], exactly zero for rigid motions, and mass-normalised shapes."""
    if not M.size:
        return np.zeros(0), M
    lam, V = reduced_modes(K, M)
    omega = np.sqrt(np.maximum(lam, 0.0))
    omega[:n_rigid] = 0.0
    return omega, V


def per_body(widths: dict[str, int], shapes: Array) -> dict[str, Array]:
    """The rows of every body."""
    ends = np.cumsum(list(widths.values()))[:-1]
    return dict(zip(widths, np.split(shapes, ends), strict=True))


def partition(M: Array, K: Array, N: Array, H: Array, n_rigid: int) -> Partition:
    """Split motions N (n, m) by whether they move the interface coordinates H (h, n).

    N satisfies the supports, and has so many rigid motions.
    """
    N = N / np.sqrt(np.einsum("ij,ij->j", N, M @ N))
    rows = H @ N
    rows = rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-300)
    _, spectrum, Vt = np.linalg.svd(rows)
    c = int(np.count_nonzero(spectrum > RANK_RTOL * spectrum[0]))
    C, F = N @ Vt[:c].T, N @ Vt[c:].T
    if F.shape[1]:
        lam, F = modes_within(F, K, M)
        stiff = lam > RIGID_RTOL * lam[-1]
        C = C - F[:, stiff] @ ((F[:, stiff].T @ K @ C) / lam[stiff, None])
    lam, chi = eigh(C.T @ K @ C, C.T @ M @ C)
    lam[:n_rigid] = 0.0
    return Partition(C, F, np.maximum(lam, 0.0), chi)


def enough(lam: Array, n: int, where: str) -> int:
    """The number of functions kept: n, or more to keep a repeated eigenvalue whole."""
    m = whole_clusters(lam, n)
    if m > n:
        repeated = np.sqrt(lam[m - 1]) / (2 * np.pi)
        log.info("%s: %d functions instead of %d, %.4g Hz is repeated", where, m, n, repeated)
    return m


def local_traces(parts: Partition, n: int, rows: list[Array], where: str) -> list[Array]:
    """Interface motions of the n lowest characteristic constraint modes of one component, or all.

    Of the coordinates (h_j, n_b) of each coupled interface directions (h_j, m_j), scaled to one;
    modes that hold it are left out.
    """
    m = enough(parts.lam, min(n, parts.lam.size), f"interfaces of {where!r}")
    motion = parts.C @ parts.chi[:, :m]
    traces = [H @ motion for H in rows]
    sizes = [np.linalg.norm(T, axis=0) for T in traces]
    moves = [size > RANK_RTOL * np.max(sizes, axis=0) for size in sizes]
    return [T[:, k] / size[k] for T, k, size in zip(traces, moves, sizes, strict=True)]


def joint_functions(moved: Array, traces: list[list[Array]]) -> Array:
    """(c, m) interface motions of the assembly that contain those of the components.

    Both sides of an interface take the union of their functions, so that they stay compatible.
    Motions move the coordinates (h, c) of all interfaces, one below the other; traces are, per
    interface, the directions that its two components ask for.
    """
    unions = block_diag(*(orth(np.hstack(both), RANK_RTOL) for both in traces))
    return orth(np.linalg.lstsq(moved, unions, rcond=RANK_RTOL)[0], RANK_RTOL)
