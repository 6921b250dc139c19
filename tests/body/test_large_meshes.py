"""Meshes of bodies that bend far: right, or told to be too coarse."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.long import COARSE, few
from cases.mbs.slender import assembled, reduced, slender, tip_of

pytest.importorskip("dolfinx", reason="dolfinx is not installed")
pytestmark = COARSE
# slope, shortening and deflection over L of the elastica at P L^2 / EI = 5
AT_FIVE = np.array([1.215368, 0.387628, 0.713792])


@pytest.mark.parametrize(
    "kind, slenderness, cells, coarse",
    few(2, [("hexahedron", 100, 20, True), ("tetrahedron", 50, 24, False),
            ("hexahedron", 100, 30, False), ("tetrahedron", 100, 16, True),
            ("hexahedron", 50, 12, True), ("hexahedron", 50, 24, False)]),
)  # fmt: skip
def test_meshes_follow_the_elastica_or_are_told_to_be_too_coarse(kind, slenderness, cells, coarse):
    """To 70 degrees by 25 coordinates; what a mesh adds to the energy is what its error comes from.

    A cell that turns by a is strained by a^2 (x^2 / l^2 - 1 / 12) / 2, though a bent line is not.
    """
    model, EI = slender(slenderness, cells, kind=kind)
    body = reduced(model, (0, 5 * EI, 0, 0, 0, 0), n_shapes=15, certify=True)
    assert body.n_modes <= 25
    added = next(row for row in body.certificate.rows if "too coarse" in row.quantity)
    (q,) = body.equilibria({"tip": (0, 5 * EI, 0, 0, 0, 0)})
    error = np.abs(tip_of(body, q) / AT_FIVE - 1).max()
    assert added.ok != coarse
    assert error < 1e-3 + 3 * added.value
    assert (error > 5e-3) if coarse else (error < 3e-3)


def test_strain_that_cells_cannot_help_is_that_of_a_bent_line():
    """Of an arc whose middle line keeps its length at the nodes, and whose sections turn."""
    h, n, k = 0.05, 4, 0.1
    model = assembled((1.0, h, h), (n, 1, 1), material=rom.Material(E=1.0, nu=0.0, rho=1.0))
    x, _, z = model.points.T
    z = z - h / 2
    U = np.column_stack([np.sin(k * x) / k - x - z * np.sin(k * x), 0 * x,
                         (1 - np.cos(k * x)) / k - z * (1 - np.cos(k * x))])  # fmt: skip
    found = model.stresses.large_strain().unresolved(U.reshape(-1, 1))[0]
    assert_allclose(found, (k / n) ** 4 / 720 / (k * h) ** 2 * 12, rtol=2e-2)
