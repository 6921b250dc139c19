"""Cell types of a solid mesh: node order, faces, and the Jacobian of the geometry.

Node order is that of gmsh. Every node is the mean of the corners it is supported by, so that one
table of corner sets gives reference coordinates, face nodes and shape functions.

Source:
    gmsh reference manual, section "Node ordering".
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from rom.model import Array, Index, Integers

TET_CORNERS = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
TET_FACES = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
TET_EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (2, 3), (1, 3))
HEX_CORNERS = tuple((x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)))
HEX_FACES = ((0, 3, 2, 1), (0, 1, 5, 4), (0, 4, 7, 3), (1, 2, 6, 5), (2, 3, 7, 6), (4, 5, 6, 7))
HEX_EDGES = (
    *((0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3)),
    *((2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7)),
)
# nodes amid edges in the order of Abaqus and VTK, which gmsh does not follow
LOWER_EDGES, UPPER_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0)), ((4, 5), (5, 6), (6, 7), (7, 4))
UPRIGHT_EDGES = ((0, 4), (1, 5), (2, 6), (3, 7))
DECK_EDGES = {
    "tet10": ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
    "hex20": (*LOWER_EDGES, *UPPER_EDGES, *UPRIGHT_EDGES),
}


@dataclass(frozen=True)
class CellType:
    """One kind of cell."""

    name: str  # e.g. "tet10"
    shape: str  # "tetrahedron" or "hexahedron"
    degree: int  # polynomial degree of the geometry
    corners: tuple[tuple[int, ...], ...]  # (n_corners, 3) reference coordinates of the corners
    # corner numbers of each face, seen from outside counter-clockwise
    faces: tuple[tuple[int, ...], ...]
    supports: tuple[tuple[int, ...], ...]  # for each node the corners whose mean it is

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return len(self.supports)

    @property
    def n_corners(self) -> int:
        """Number of corners; they come first among the nodes."""
        return len(self.corners)

    @property
    def corners_per_face(self) -> int:
        """Number of corners of a face."""
        return len(self.faces[0])

    @property
    def straight(self) -> "CellType":
        """The kind of the same shape with straight edges."""
        return CELL_TYPES["tet4" if self.shape == "tetrahedron" else "hex8"]

    @cached_property
    def nodes(self) -> Array:
        """(n_nodes, 3) reference coordinates."""
        corners = np.array(self.corners, dtype=float)
        return np.array([corners[list(s)].mean(axis=0) for s in self.supports])

    @cached_property
    def nodes_per_face(self) -> int:
        """Number of nodes of a face."""
        return sum(set(s) <= set(self.faces[0]) for s in self.supports)

    @cached_property
    def face_nodes(self) -> tuple[tuple[int, ...], ...]:
        """Node numbers of each face, in the order of gmsh: corners, edges around, the middle."""
        return tuple(
            self.among((*_alone(face), *zip(face, (*face[1:], face[0]), strict=True), face))
            for face in self.faces
        )

    def among(self, wanted: Iterable[tuple[int, ...]]) -> tuple[int, ...]:
        """Numbers of the nodes amid these corners, of those that there are, in their order."""
        number = {frozenset(s): k for k, s in enumerate(self.supports)}
        return tuple(number[frozenset(s)] for s in wanted if frozenset(s) in number)

    @cached_property
    def mirrored(self) -> tuple[int, ...]:
        """Node order of the same cell seen in a mirror: swaps the sign of its volume."""
        flipped = self.nodes[:, [1, 0, 2]]
        return tuple(int(np.abs(self.nodes - x).sum(axis=1).argmin()) for x in flipped)

    @cached_property
    def _exponents(self) -> Integers:
        powers = np.array(list(product(range(self.degree + 1), repeat=3)))
        return powers if self.shape == "hexahedron" else powers[powers.sum(axis=1) <= self.degree]

    def gradients(self, at: Array) -> Array:
        """(q, n_nodes, 3) reference gradients of the shape functions at (q, 3) points."""
        e = self._exponents
        coefficients = np.linalg.inv(_monomials(self.nodes, e))
        lowered = (np.maximum(e - one, 0) for one in np.eye(3, dtype=int))
        found = [e[:, a] * _monomials(at, low) @ coefficients for a, low in enumerate(lowered)]
        return np.stack(found, axis=-1)

    @cached_property
    def quadrature(self) -> tuple[Array, Array]:
        """Gauss points (q, 3) and weights (q,), exact for displacements of this degree squared."""
        x, w = np.polynomial.legendre.leggauss(self.degree + 1)
        points = np.array(list(product((x + 1) / 2, repeat=3)))
        weights = np.prod(list(product(w / 2, repeat=3)), axis=1)
        if self.shape == "hexahedron":
            return points, weights
        u, v, w = points.T  # cube collapsed onto the tetrahedron, with its determinant
        collapsed = np.column_stack([u, v * (1 - u), w * (1 - u) * (1 - v)])
        return collapsed, weights * (1 - u) ** 2 * (1 - v)


def _monomials(x: Array, exponents: Integers) -> Array:
    return np.prod(x[:, None, :] ** exponents, axis=2)


def _alone(corners: Iterable[int]) -> tuple[tuple[int, ...], ...]:
    return tuple((i,) for i in corners)


_TET4_NODES, _HEX8_NODES = _alone(range(4)), _alone(range(8))
_HEX20_NODES = (*_HEX8_NODES, *HEX_EDGES)
_HEX27_NODES = (*_HEX20_NODES, *HEX_FACES, tuple(range(8)))

CELL_TYPES = {
    kind.name: kind
    for kind in (
        CellType("tet4", "tetrahedron", 1, TET_CORNERS, TET_FACES, _TET4_NODES),
        CellType("tet10", "tetrahedron", 2, TET_CORNERS, TET_FACES, (*_TET4_NODES, *TET_EDGES)),
        CellType("hex8", "hexahedron", 1, HEX_CORNERS, HEX_FACES, _HEX8_NODES),
        CellType("hex27", "hexahedron", 2, HEX_CORNERS, HEX_FACES, _HEX27_NODES),
    )
}
# files have them; their mid-face and middle nodes are added by `rom.fe.mesh.repair`
SERENDIPITY = CellType("hex20", "hexahedron", 2, HEX_CORNERS, HEX_FACES, _HEX20_NODES)
READ_TYPES = CELL_TYPES | {"hex20": SERENDIPITY}


def jacobians(x: Array, gradients: Array) -> Array:
    """(m, q) determinants of the geometry map, of nodes x (m, k, 3) [m] and gradients (q, k, 3)."""
    # one tangent vector per reference direction: (m, 3, q)
    a, b, c = (np.einsum("mkx,qk->xmq", x, gradients[:, :, i], optimize=True) for i in range(3))
    return (
        a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
    )


def over_blocks(cells: Index, of: Callable[[Index], Array], size: int = 20_000) -> Array:
    """(m,) what a function makes of some cells (m, k) together, which bounds the memory."""
    found = [of(cells[i : i + size]) for i in range(0, len(cells), size)]
    return np.concatenate(found) if found else np.empty(0)
