"""Which node of one cyclic face is which of the other, and what to do when none is."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree

from rom.errors import InterfaceError
from rom.model import Array, Interface
from rom.rotation import exp, matrix

COINCIDENT_RTOL = 1e-6  # of the face's size
SECTOR_COUNT_ATOL = 1e-3  # distance of the number of sectors from a whole number
FACE_MATCH_RTOL = 0.02  # difference of area and spread of two faces cut into facets
MIN_CENTRE_RATIO = 0.05  # distance of a sector's centre from the axis, of that of its nodes
N_NEIGHBOURS = 15  # nodes that a node between them follows


@dataclass(frozen=True, slots=True)
class Pairing:
    """How the dofs of one cyclic face follow from those of the other."""

    n_sectors: int  # number N of sectors of the wheel
    step: int  # +1 if the slave turns into its master by one sector backwards, -1 by one forwards
    slave: Interface  # the face that follows; the finer one if the nodes differ
    master: Interface  # the face that leads
    weights: csr_matrix  # (k_slave, k_master) values at the nodes of the slave from the master's
    matching: bool  # True when each node has a partner


def turned(axis: Array, angle: float) -> Array:
    """(3, 3) rotation about a unit vector."""
    return matrix(exp(angle * axis))


def paired(low: Interface, high: Interface, axis: Array, at: Array) -> Pairing:
    """Pair two faces, in any order, that one sector turns into each other about a unit vector."""
    N, forward = _sectors(low, high, axis, at)
    finer = low.nodes.size > high.nodes.size
    slave, master = (low, high) if finer else (high, low)
    step = 1 if forward != finer else -1
    R = turned(axis, step * 2 * np.pi / N)
    image = (master.points - at) @ R.T + at
    size = float(np.ptp(master.points, axis=0).max())
    gap, partner = cKDTree(image).query(slave.points)
    k = slave.nodes.size
    if k == master.nodes.size == np.unique(partner).size and gap.max() < COINCIDENT_RTOL * size:
        W = csr_matrix((np.ones(k), (np.arange(k), partner)), shape=(k, k))
        return Pairing(N, step, slave, master, W, matching=True)
    _refuse_different(slave, master, image, gap, 360 / N)
    return Pairing(N, step, slave, master, interpolation(image, slave.points), matching=False)


def refuse_all_around(points: Array, axis: Array, at: Array) -> None:
    """Refuse nodes all around the axis: faces may also be images about one inside the sector."""
    x = points - at
    across = x - np.outer(x @ axis, axis)
    spread = np.sqrt((across**2).sum(axis=1).mean())
    if np.linalg.norm(across.mean(axis=0)) < MIN_CENTRE_RATIO * spread:
        text = f"the axis {np.round(axis, 6).tolist()} through {np.asarray(at).tolist()} m runs"
        raise InterfaceError(f"{text} through the middle of the sector; check axis=… and at=….")


def _sectors(low: Interface, high: Interface, axis: Array, at: Array) -> tuple[int, bool]:
    """Number of sectors, and whether the sector runs from low to high around the axis."""
    arms = []
    for face in (low, high):
        x = face.points - at
        across = x - np.outer(x @ axis, axis)
        size = np.ptp(x, axis=0).max()
        if on_axis := (np.linalg.norm(across, axis=1) < COINCIDENT_RTOL * size).sum():
            text = f"{on_axis} nodes of the cyclic face {face.name!r} lie on the axis of rotation"
            raise InterfaceError(f"{text}; leave a small bore.")
        weights = np.asarray(face.surface_mass.sum(axis=1)).ravel()
        arms.append(weights @ across / weights.sum())
    angle = np.arctan2(axis @ np.cross(*arms), arms[0] @ arms[1])
    share = 2 * np.pi / max(abs(angle), 1e-9)
    N = round(share)
    if N < 2 or abs(share - N) > SECTOR_COUNT_ATOL:
        text = f"cyclic faces {low.name!r} and {high.name!r} enclose {np.degrees(abs(angle)):.6g}"
        why = f"which does not divide the circle: 360 degrees hold {share:.6g} sectors"
        hint = "Check the sector angle of the geometry, and axis=… and at=…."
        raise InterfaceError(f"{text} degrees, {why}.", hint=hint)
    return N, bool(angle > 0)


def _refuse_different(
    slave: Interface, master: Interface, image: Array, gap: Array, angle: float
) -> None:
    shapes = [_spread(slave.surface_mass, slave.points), _spread(master.surface_mass, image)]
    scale = shapes[0][1:].max()
    apart = np.abs(shapes[0] - shapes[1]) / np.r_[shapes[0][0], np.full(6, scale)]
    if apart.max() > FACE_MATCH_RTOL:
        text = f"the cyclic faces {master.name!r} and {slave.name!r} do not match: turned by"
        areas = f"their areas are {shapes[1][0]:.6g} and {shapes[0][0]:.6g} m^2"
        text = f"{text} {angle:g} degrees, {areas} and their nodes up to {gap.max():.3g} m apart."
        raise InterfaceError(text, hint="Check which surfaces carry the names.")


def _spread(S: csr_matrix, points: Array) -> Array:
    """(7,) area, centroid and radii of gyration of a surface."""
    weights = np.asarray(S.sum(axis=1)).ravel()
    area = weights.sum()
    centre = weights @ points / area
    return np.r_[area, centre, np.sqrt(weights @ (points - centre) ** 2 / area)]


def interpolation(points: Array, targets: Array) -> csr_matrix:
    """(t, m) weights: values at (t, 3) points of a surface from those at scattered nodes (m, 3).

    Around each target a cubic polyharmonic spline with quadratic polynomials goes through the
    nearest nodes; linear and quadratic fields are exact, and a target on a node takes its value.

    Source:
        Flyer, Fornberg, Bayona and Barnett, On the role of polynomials in RBF-FD approximations,
        J. Comput. Phys. 321 (2016) 21.
    """
    k = min(N_NEIGHBOURS, points.shape[0])
    near = cKDTree(points).query(targets, k)[1].reshape(len(targets), k)
    weights = np.array([_weights(points[n] - x) for n, x in zip(near, targets, strict=True)])
    rows = np.repeat(np.arange(len(targets)), k)
    return csr_matrix((weights.ravel(), (rows, near.ravel())), (len(targets), len(points)))


def _weights(arms: Array) -> Array:
    """(k,) weights of nodes at these arms (k, 3) from the target."""
    plane = np.linalg.svd(arms - arms.mean(axis=0), full_matrices=False)[2][:2]
    xi = arms @ plane.T / np.abs(arms).max()
    x, y = xi.T
    P = np.column_stack([np.ones_like(x), x, y, x * x, x * y, y * y])
    r3 = np.linalg.norm(xi[:, None] - xi[None], axis=2) ** 3
    A = np.block([[r3, P], [P.T, np.zeros((6, 6))]])
    b = np.r_[np.linalg.norm(xi, axis=1) ** 3, 1.0, np.zeros(5)]
    return np.linalg.lstsq(A, b, rcond=1e-12)[0][: len(arms)]
