"""Compliance of a gear tooth by finite elements: one tooth on a disc that is clamped at its bore.

Biquadratic quadrilaterals, plane strain. Contact is left out: the tooth is loaded on its flank, and
its axis at the height of the load tells how far it gave way.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import interp1d
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.linalg import SuperLU, splu

from rom.arguments import between
from rom.components.gear_mesh import compliance
from rom.components.gear_mesh.gears.geometry import GearPair
from rom.errors import ModelError
from rom.model import Array, Index

GAUSS_POINTS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(3)


@dataclass(frozen=True)
class ToothModel:
    """A tooth and its body, divided and factored.

    Attributes:
        pair, gear: which.
        points: (n, 2) nodes; the axis of the tooth is y, from the centre of the wheel [m].
        cells: (c, 9) nodes, along the thickness first.
        axis, flank: (k,), (m,) nodes on the axis of the tooth and on the flank of positive x, root
            to tip.
        free: (f,) coordinates that are not clamped.
        factor: of the stiffness for E = 1, with a method ``solve``.
    """

    pair: GearPair
    gear: int
    points: Array
    cells: Index
    axis: Index
    flank: Index
    free: Index
    factor: SuperLU

    def compliance(self, radius: float) -> float:
        """E times the deflection of the axis along the line of action per force and width [1].

        The load is on the involute, at this radius [m].

        Raises:
            ModelError: if the flank has no such radius.
        """
        flank, axis = self.points[self.flank], self.points[self.axis]
        r = np.hypot(*flank.T)
        between("radius on the flank", radius, r[0], r[-1] * (1 + 1e-9), error=ModelError)
        x, y = (float(interp1d(r, flank[:, k])(min(radius, r[-1]))) for k in (0, 1))
        turn = np.arccos(min(self.pair.rb[self.gear] / radius, 1.0)) - np.arctan2(x, y)
        n = np.array([-np.cos(turn), -np.sin(turn)])  # the mate pushes into the flank
        f = np.zeros(self.points.size)
        k = int(np.clip(np.searchsorted(r, radius) - 1, 0, len(r) - 2))
        share = (radius - r[k]) / (r[k + 1] - r[k])
        for node, part in ((self.flank[k], 1 - share), (self.flank[k + 1], share)):
            f[2 * node : 2 * node + 2] += part * n
        u = np.zeros(f.size)
        u[self.free] = self.factor.solve(f[self.free])
        height = y - x * np.tan(turn)  # where the line of action meets the axis
        moved = u.reshape(-1, 2)[self.axis]
        return float(sum(n[k] * np.interp(height, axis[:, 1], moved[:, k]) for k in (0, 1)))


def tooth_model(
    pair: GearPair, gear: int, *, bore: float = 0.35, fine: int = 4, nu: float = 0.3
) -> ToothModel:
    """Divide a tooth and its body and factor the stiffness, for E = 1.

    Args:
        pair: spur gears.
        gear: 0 for the pinion, 1 for the gear.
        bore: diameter of the bore over that of the reference circle [1].
        fine: elements across half of the thickness of the tooth.
        nu: Poisson's ratio [1].

    Raises:
        ModelError: if the bore leaves no body.
    """
    inner = bore * pair.r[gear]
    between("bore", bore, 0, 0.98 * pair.rf[gear] / pair.r[gear], "()", error=ModelError)
    points, cells, clamped, axis, flank = _mesh(pair, gear, inner, fine)
    K = _stiffness(points, cells, nu)
    fixed = np.concatenate([2 * clamped, 2 * clamped + 1])
    free = np.setdiff1d(np.arange(points.size), fixed)
    factor = splu(K[free][:, free].tocsc())
    return ToothModel(pair, gear, points, cells, axis, flank, free, factor)


def element_table(
    pair: GearPair, *, force: float, bore: float = 0.35, n: int = 41, E: float = 206e9
) -> Array:
    """(n,) stiffness of one pair of teeth per length of contact line, first to last [N/m^2].

    Teeth and bodies of finite elements, contact between them in closed form; helical teeth bend as
    those of their normal section.

    The normal force is per length of contact line [N/m], E is Young's modulus [Pa], and the bore as
    of `tooth_model`.

    Raises:
        ModelError: if the bore leaves no body.
    """
    teeth = compliance.normal_section(pair)
    models = [tooth_model(teeth, gear, bore=bore) for gear in (0, 1)]
    table = []
    for s in compliance.places_of_contact(pair, n):
        radii, rho = compliance.in_normal_section(pair, s)
        own = sum(model.compliance(r) for model, r in zip(models, radii, strict=True))
        depths = [compliance.tooth_compliance(teeth, g, float(radii[g]))[2] for g in (0, 1)]
        table.append(E / (own + compliance.contact_compliance(rho, depths, force, E)))
    return np.array(table)


def _mesh(
    pair: GearPair, gear: int, inner: float, fine: int
) -> tuple[Array, Index, Index, Index, Index]:
    """Points, cells, clamped nodes, nodes of the axis and of one flank."""
    rf, (y, t) = pair.rf[gear], compliance.profile(pair, gear)
    across, x0 = 4 * fine, t[0] / 2  # intervals between nodes
    xi = np.linspace(-1, 1, across + 1)
    arc = np.arcsin(xi * x0 / rf)
    side = np.linspace(-1, 1, 16 * fine + 1)
    away = np.sign(side) * (1 - _graded(1 - np.abs(side)))
    angle = np.concatenate([arc, np.pi + (np.pi - arc[-1]) * away[1:-1]])
    radius = rf - (rf - inner) * _graded(np.linspace(1, 0, 10 * fine + 1))
    ring = np.stack([np.outer(radius, np.sin(angle)), np.outer(radius, np.cos(angle))], axis=-1)
    height = 8 * fine
    v = np.linspace(0, 1, height + 1)
    ys = y[0] + (y[-1] - y[0]) * v
    half = np.interp(ys, y, t / 2)
    sag = np.sqrt(rf**2 - (xi * x0) ** 2) - y[0]
    tooth = np.stack([np.outer(half, xi), ys[:, None] + np.outer((1 - v) ** 2, sag)], axis=-1)
    n_ring, n_angle = ring.shape[0] * len(angle), len(angle)
    numbers = np.arange(n_ring).reshape(-1, n_angle)
    above = n_ring + np.arange(height * (across + 1)).reshape(height, -1)
    teeth = np.vstack([numbers[-1, : across + 1], above])
    points = np.concatenate([ring.reshape(-1, 2), tooth[1:].reshape(-1, 2)])
    wrapped = np.hstack([numbers, numbers[:, :1]])
    cells = np.vstack([_patches(wrapped), _patches(teeth)])
    return points, cells, numbers[0], teeth[:, across // 2], teeth[:, -1]


def _graded(x: Array) -> Array:
    """From 0 to 1, finely divided near 0."""
    return np.expm1(4 * x) / np.expm1(4)


def _patches(grid: Index) -> Index:
    """(c, 9) nodes of the cells of a grid of nodes, every second line between cells."""
    i, j = (np.arange(0, n - 1, 2) for n in grid.shape)
    corner = [grid[np.ix_(i + a, j + b)].ravel() for a in range(3) for b in range(3)]
    return np.stack(corner, axis=1)


def _stiffness(points: Array, cells: Index, nu: float) -> csr_matrix:
    """Stiffness of plane strain, E = 1."""
    D = np.array([[1 - nu, nu, 0], [nu, 1 - nu, 0], [0, 0, 0.5 - nu]]) / ((1 + nu) * (1 - 2 * nu))
    X, Ke = points[cells], np.zeros((len(cells), 18, 18))
    for a, wa in zip(GAUSS_POINTS, GAUSS_WEIGHTS, strict=True):
        for b, wb in zip(GAUSS_POINTS, GAUSS_WEIGHTS, strict=True):
            (Na, da), (Nb, db) = _line(a), _line(b)
            dN = np.stack([np.outer(da, Nb).ravel(), np.outer(Na, db).ravel()])
            J = dN @ X
            g = np.linalg.solve(J, np.broadcast_to(dN, (len(cells), 2, 9)))
            B = np.zeros((len(cells), 3, 18))
            B[:, 0, 0::2], B[:, 1, 1::2] = g[:, 0], g[:, 1]
            B[:, 2, 0::2], B[:, 2, 1::2] = g[:, 1], g[:, 0]
            size = wa * wb * np.abs(np.linalg.det(J))
            Ke += np.einsum("c,cia,ij,cjb->cab", size, B, D, B, optimize=True)
    dofs = (2 * cells[:, :, None] + np.arange(2)).reshape(len(cells), 18)
    rows, columns = np.repeat(dofs, 18, axis=1), np.tile(dofs, (1, 18))
    n = points.size
    return coo_matrix((Ke.ravel(), (rows.ravel(), columns.ravel())), shape=(n, n)).tocsr()


def _line(x: float) -> tuple[Array, Array]:
    """Quadratic shape functions of a line and their slopes."""
    N = np.array([x * (x - 1) / 2, 1 - x * x, x * (x + 1) / 2])
    return N, np.array([x - 0.5, -2 * x, x + 0.5])
