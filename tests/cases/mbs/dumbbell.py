"""Two masses on a spring that turn."""

import numpy as np

from cases.mbs.mechanisms import nodal_body

# masses at +-REST on a spring [kg, m, N/m], and the hub that gives the body its other inertias
MASS, REST, SPRING, HUB, RADIUS = 0.5, 0.4, 1200.0, 0.3, 0.1


HUB_INERTIA = 2 * HUB * RADIUS**2  # about z


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
