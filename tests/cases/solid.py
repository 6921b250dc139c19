"""A small finite element block without FEniCSx: eight-node bricks, assembled in NumPy."""

from dataclasses import replace

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, identity, kron

import rom

STEEL = rom.Material(E=210e9, nu=0.3, rho=7850.0)
KINDS = {"root": "rbe2", "tip": "rbe2"}
GAUSS = np.array([-1.0, 1.0]) / np.sqrt(3.0)
CORNERS = np.array([[i, j, k] for k in (-1, 1) for j in (-1, 1) for i in (-1, 1)], dtype=float)


def shape_functions(xi):
    """Values (8,) and gradients (8, 3) of the trilinear functions on [-1, 1]^3."""
    factors = 1 + CORNERS * xi
    values = factors.prod(axis=1) / 8
    gradients = np.empty((8, 3))
    for a in range(3):
        gradients[:, a] = CORNERS[:, a] * np.delete(factors, a, axis=1).prod(axis=1) / 8
    return values, gradients


def brick(h, material):
    """Stiffness (24, 24) and scalar mass (8, 8) of a rectangular brick with edges h."""
    K, Ms, volume = np.zeros((24, 24)), np.zeros((8, 8)), h.prod() / 8
    for xi in np.array(np.meshgrid(GAUSS, GAUSS, GAUSS)).reshape(3, -1).T:
        N, dN = shape_functions(xi)
        g = dN * 2 / h
        B = np.zeros((6, 24))
        for n, (x, y, z) in enumerate(g):
            B[:, 3 * n : 3 * n + 3] = [
                [x, 0, 0], [0, y, 0], [0, 0, z], [0, z, y], [z, 0, x], [y, x, 0],
            ]  # fmt: skip
        K += B.T @ material.stiffness @ B * volume
        Ms += material.rho * np.outer(N, N) * volume
    return K, Ms


def block(size=(1.0, 0.1, 0.08), cells=(8, 2, 2), material=STEEL, origin=(0.0, 0.0, 0.0)):
    """FEModel of a block with the interfaces "root" (lowest x) and "tip" (highest x)."""
    size, cells = np.array(size, dtype=float), np.array(cells)
    axes = [np.linspace(o, o + s, c + 1) for o, s, c in zip(origin, size, cells, strict=True)]
    points = np.array(np.meshgrid(*axes, indexing="ij")).reshape(3, -1).T
    number = np.arange(points.shape[0]).reshape(cells + 1)
    steps = ((CORNERS + 1) / 2).astype(int)
    nodes = np.array([[number[tuple(np.array(c) + s)] for s in steps] for c in np.ndindex(*cells)])
    K_e, M_e = brick(size / cells, material)
    dofs = (3 * nodes[:, :, None] + np.arange(3)).reshape(len(nodes), -1)
    K = assembled(dofs, K_e, 3 * len(points))
    M = kron(assembled(nodes, M_e, len(points)), identity(3), format="csr")
    faces = {"root": number[0], "tip": number[-1]}
    cell = size[1:] / cells[1:]
    interfaces = {name: _interface(name, face, points, cell) for name, face in faces.items()}
    surface = surface_of(np.take(number, end, axis) for axis in range(3) for end in (0, -1))
    return rom.FEModel(0.5 * (K + K.T), M, points, interfaces, surface=surface)


def reduced(n_modes, model, **how):
    """A model between rigid ends "root" and "tip", with modes of the held one, uncertified."""
    how = {"interfaces": KINDS, "certify": False} | how
    return rom.reduce(model, method=rom.CraigBampton(n_modes), **how)


def composite(materials, region, size=(1.0, 0.1, 0.08), cells=(8, 2, 2), origin=(0.0, 0.0, 0.0)):
    """FEModel of a block of several materials; region(cell) names the one of a cell (i, j, k)."""
    plain = block(size, cells, STEEL, origin)
    number = np.arange(plain.n_dofs // 3).reshape(np.array(cells) + 1)
    steps = ((CORNERS + 1) / 2).astype(int)
    regions = {}
    for name, material in materials.items():
        own = [c for c in np.ndindex(*cells) if region(c) == name]
        nodes = np.array([[number[tuple(np.array(c) + s)] for s in steps] for c in own])
        dofs = (3 * nodes[:, :, None] + np.arange(3)).reshape(len(nodes), -1)
        K_e, M_e = brick(np.array(size) / cells, material)
        K = assembled(dofs, K_e, plain.n_dofs)
        M = kron(assembled(nodes, M_e, plain.n_dofs // 3), identity(3), format="csr")
        regions[name] = rom.Region(0.5 * (K + K.T), M)
    K, M = (sum(getattr(part, which) for part in regions.values()) for which in "KM")
    return replace(plain, K=K, M=M, regions=regions)


def assembled(dofs, blocks, n):
    """(n, n) sum of blocks (k, k) at dofs (e, k), or of one for each."""
    k = dofs.shape[1]
    rows, columns = np.repeat(dofs, k, axis=1).ravel(), np.tile(dofs, (1, k)).ravel()
    values = np.broadcast_to(blocks, (len(dofs), k, k)).ravel()
    return csr_matrix(coo_matrix((values, (rows, columns)), shape=(n, n)))


def _interface(name, face, points, cell):
    nodes = face.ravel()
    line = np.array([[2.0, 1.0], [1.0, 2.0]]) / 6
    quad = np.kron(line, line) * cell.prod()
    place = {n: k for k, n in enumerate(nodes)}
    quads = [
        [place[face[i + a, j + b]] for a in (0, 1) for b in (0, 1)]
        for i in range(face.shape[0] - 1)
        for j in range(face.shape[1] - 1)
    ]
    S = assembled(np.array(quads), quad, nodes.size)
    return rom.Interface(name, nodes, points[nodes], S, points[nodes].mean(axis=0))


def quads_of(face):
    """(k, 4) corners of the cells of a grid of nodes."""
    corners = face[:-1, :-1], face[1:, :-1], face[1:, 1:], face[:-1, 1:]
    return np.stack([x.ravel() for x in corners], axis=1)


def surface_of(faces):
    """The surface of grids of nodes, each cell in two triangles."""
    quads = np.vstack([quads_of(face) for face in faces])
    nodes = np.unique(quads)
    local = np.searchsorted(nodes, quads)
    return rom.SurfaceMesh(nodes, np.vstack([local[:, [0, 1, 2]], local[:, [0, 2, 3]]]))


def chain(n, k=4.0e4, m=0.25):
    """Free chain of n masses: K, M and the frequencies with both ends held [rad/s]."""
    K = np.diag(np.full(n, 2.0)) - np.eye(n, k=1) - np.eye(n, k=-1)
    K[0, 0] = K[-1, -1] = 1.0
    s = np.arange(1, n - 1)
    exact = 2 * np.sqrt(k / m) * np.sin(s * np.pi / (2 * (n - 1)))
    return csr_matrix(k * K), m * identity(n, format="csr"), exact
