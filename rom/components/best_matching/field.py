"""What best matching has for the doctor."""

import numpy as np

from rom.fields import Field

FIELD = Field(first_use={"best_matching": "rom.components.best_matching.field:first_use"})


def first_use() -> None:
    """Three bodies that move, and their shape."""
    from rom.components.best_matching import Bodies, ShapeSphere

    bodies, x = Bodies(np.ones(3)), np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    sphere = ShapeSphere(bodies)
    bodies.move(x, 0.1 * x[::-1], np.array([0.0, 1e-3]))
    n = sphere.shape(x)
    sphere.move(n, sphere.momentum(x, 0.1 * x[::-1]), np.array([0.0, 1e-3]))
