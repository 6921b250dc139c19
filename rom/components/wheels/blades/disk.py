"""The disk of a substructured sector, condensed for each harmonic to the roots of its blades."""

import numpy as np
from scipy.linalg import block_diag, eigh

from rom.arguments import typed, whole
from rom.components.wheels.blades.bladed_wheel import BladedWheel
from rom.components.wheels.blades.substructured_sector import SubstructuredSector
from rom.components.wheels.modes import real_span
from rom.components.wheels.sector import Complex
from rom.model import Array

RIGID_SPAN_RTOL = 1e-6  # share of a rigid motion that the coordinates may miss


@typed
def bladed_wheel(
    sector: SubstructuredSector, n_waves: int, *, n_root: int | None = None
) -> BladedWheel:
    """The disk of a substructured sector, on which each blade may be another one.

    Args:
        sector: made by `rom.substructured_sector`.
        n_waves: number of waves of the disk for each number of nodal diameters, roots held.
        n_root: number of shapes of the roots for each, the lowest of the statically condensed
            tuned wheel (characteristic constraint modes); all of them unless given.

    Raises:
        ConfigError: if the disk has not so many.

    Source:
        Castanier, Tan and Pierre, Characteristic constraint modes for component mode synthesis,
        AIAA J. 39 (2001) 1182; see docs/theory/cyclic_symmetry.md.
    """
    j = np.arange(sector.n_sectors)
    own, given = np.r_[sector.root, sector.cantilever], {}
    for name in ("K", "M", "coriolis", "centrifugal"):  # the last two where it turns
        if (tuned := getattr(sector, name)) is not None:
            given[name] = tuned.toarray()
            given[name][np.ix_(own, own)] -= getattr(sector.blade, name)
    blocks: dict[str, list[list[Array]]] = {name: [] for name in given}
    roots, rigid = [], []
    for n in sector.diameters:
        standing = sector.standing(n)
        condensed, V = _condensed(sector, given, n, n_waves, n_root)
        for name, parts in condensed.items():
            blocks[name].append([_real(A, standing) for A in parts])
        moved = np.exp(1j * n * sector.angle * j)[:, None, None] * V
        size = np.sqrt((1 if standing else 2) / sector.n_sectors)
        roots += [size * part for part in (moved.real, moved.imag)[: 1 if standing else 2]]
        rigid.append(_rigid(sector, n, V))
    whole = {}
    for name, each in blocks.items():
        rr, rw, wr, ww = (block_diag(*part) for part in zip(*each, strict=True))
        whole[name] = np.block([[rr, rw], [wr, ww]])
    return BladedWheel(
        sector=sector, roots=np.concatenate(roots, axis=2), rigid=block_diag(*rigid), **whole
    )


def _real(A: Complex, standing: bool) -> Array:
    """Of a_n^H A b_n and its conjugate for -n, in (a', a'') of a_n = (a' - i a'') / sqrt(2)."""
    return A.real if standing else np.block([[A.real, A.imag], [-A.imag, A.real]])


def _rigid(sector: SubstructuredSector, n: int, V: Complex) -> Array:
    """Rigid motions that are waves with n nodal diameters, in real coordinates of the roots.

    Empty where the coordinates do not have them; the wheel is then stiffer than a free one.
    """
    R: Complex = sector.rigid(n)[sector.root]
    if sector.standing(n):
        R = real_span(R).astype(complex)
    a = np.linalg.lstsq(V, R, rcond=None)[0]
    if np.linalg.norm(V @ a - R) > RIGID_SPAN_RTOL * np.linalg.norm(R):
        a = a[:, :0]
    if sector.standing(n):
        return np.asarray(a.real)
    return np.block([[a.real, -a.imag], [-a.imag, -a.real]])


def _root_shapes(
    sector: SubstructuredSector, K: Complex, M: Complex, n_root: int | None
) -> Complex:
    """(r, c) shapes of the roots: all, or the lowest with the nominal blades on them."""
    r = len(K)
    if n_root is None:
        return np.eye(r, dtype=complex)
    whole("n_root", n_root, 1, r, reason="the shapes of a root")
    static = (A[:r, :r] for A in (sector.blade.K, sector.blade.M))
    V = eigh(*(A + own for A, own in zip((K, M), static, strict=True)))[1]
    return np.asarray(V[:, :n_root], dtype=complex)


def _condensed(
    sector: SubstructuredSector, disk: dict[str, Array], n: int, n_waves: int, n_root: int | None
) -> tuple[dict[str, list[Complex]], Complex]:
    """{name: blocks rr, rw, wr, ww} of roots and waves with roots held, and shapes of the roots."""
    kept = np.isin(sector.free, sector.cantilever, invert=True)
    T = sector.harmonic(n)[:, kept].toarray()
    root = np.searchsorted(sector.free[kept], sector.root)
    inner = np.setdiff1d(np.arange(T.shape[1]), root)
    whole("n_waves", n_waves, 0, inner.size, reason="the dofs of the disk with roots held")
    waves = {name: T.conj().T @ A @ T for name, A in disk.items()}
    K, M = waves["K"], waves["M"]
    K_ii = K[np.ix_(inner, inner)]
    C: Complex = np.zeros((T.shape[1], root.size), dtype=complex)
    C[root] = np.eye(root.size)
    C[inner] = -np.linalg.solve(K_ii, K[np.ix_(inner, root)])
    H = C.conj().T
    V = _root_shapes(sector, H @ K @ C, H @ M @ C, n_root)
    square, Phi = eigh(K_ii, M[np.ix_(inner, inner)])
    X, B = C @ V, np.zeros((T.shape[1], n_waves), dtype=complex)
    B[inner] = Phi[:, :n_waves]
    blocks = {
        name: [left.conj().T @ A @ right for left in (X, B) for right in (X, B)]
        for name, A in waves.items()
    }
    none = np.zeros((V.shape[1], n_waves))
    blocks["K"][1:] = [none, none.T, np.diag(square[:n_waves])]  # by orthogonality
    blocks["M"][3] = np.eye(n_waves)
    return blocks, V
