"""Masses with springs or bars between them: two that turn, four that deflect far."""

from dataclasses import replace

import numpy as np

from cases.mbs.mechanisms import nodal_body
from rom.body.nonlinear.quartic import Quartic

# masses at +-REST on a spring [kg, m, N/m], and the hub that gives the body its other inertias
MASS, REST, SPRING, HUB, RADIUS = 0.5, 0.4, 1200.0, 0.3, 0.1
HUB_INERTIA = 2 * HUB * RADIUS**2  # about z
# four masses and six bars; seen from the first, the second moves on a line, the third in a plane
NODES = np.array([[0.0, 0, 0], [1.0, 0, 0], [0.3, 0.9, 0], [0.4, 0.3, 1.1]])
MASSES = np.array([0.7, 0.4, 0.5, 0.3])
BARS = [(0, 1, 40.0), (0, 2, 25.0), (0, 3, 60.0), (1, 2, 30.0), (1, 3, 20.0), (2, 3, 45.0)]
FREE = [(1, 0), (2, 0), (2, 1), (3, 0), (3, 1), (3, 2)]  # (node, axis) of the coordinates
START = np.array([0.15, -0.1, 0.2, 0.1, -0.2, 0.25])


def dumbbell():
    """Two masses on a spring along x with a hub that does not deform; markers on both masses."""
    ring = RADIUS * np.array([[0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1.0]])
    x = np.vstack([[[REST, 0, 0], [-REST, 0, 0]], ring])
    phi = np.zeros((1, 6, 3))
    phi[0, 0, 0], phi[0, 1, 0] = 1.0, -1.0
    masses = np.diag([MASS, MASS, *(HUB / 2,) * 4])
    masses[2, 2] = masses[3, 3] = HUB
    none = np.zeros((3, 1))
    markers = {name: (x[k], phi[:, k].T, none) for k, name in ((0, "right"), (1, "left"))}
    return nodal_body(x, masses, phi, np.array([[4 * SPRING]]), markers=markers)


def truss(**options):
    """Its elastic coordinates carry any deformation, so that nothing is approximate."""
    shapes = np.zeros((len(FREE), *NODES.shape))
    for k, place in enumerate(FREE):
        shapes[(k, *place)] = 1.0
    r, G = len(FREE), 0.0
    j, k = np.triu_indices(r)
    for a, b, stiffness in BARS:
        bar = NODES[b] - NODES[a]
        D, length = (shapes[:, b] - shapes[:, a]).T, np.linalg.norm(bar)
        Z = np.r_[bar @ D, (D.T @ D)[j, k]] / length
        G = G + stiffness * np.outer(Z, Z)
    energy = Quartic.from_gram(G, r)
    places = {f"n{i}": (x, shapes[:, i].T, np.zeros((3, r))) for i, x in enumerate(NODES)}
    places["mean"] = (NODES.mean(axis=0), shapes.mean(axis=1).T, np.zeros((3, r)))
    body = nodal_body(NODES, np.diag(MASSES), shapes, energy.K, markers=places, **options)
    fitted = covariance_of(NODES, np.moveaxis(shapes, 0, 2))
    body.markers["mean"] = replace(body.markers["mean"], covariance=fitted)
    return replace(body, quartic=energy)


def covariance_of(points, moved):
    """(3, 3, 1 + r) of points (n, 3) and displacements (n, 3, r), all of one weight."""
    X = points - points.mean(axis=0)
    moved = np.concatenate([X[..., None], moved], axis=2)
    return np.einsum("nak,nb->abk", moved, X) / (X**2).sum()


def bar_forces(x):
    """(4, 3) forces of the bars on the masses at x, and their energy."""
    f, U = np.zeros_like(x), 0.0
    for a, b, stiffness in BARS:
        d, length = x[b] - x[a], np.linalg.norm(NODES[b] - NODES[a])
        strain = (d @ d / length - length) / 2
        f[a] += stiffness * strain * d / length
        f[b] -= stiffness * strain * d / length
        U += stiffness * strain**2 / 2
    return f, U
