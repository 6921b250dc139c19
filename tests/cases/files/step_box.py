"""A box as a STEP file."""

import pytest


def step_box(path, *edges):
    """Write a box with edges in mm."""
    gmsh = pytest.importorskip("gmsh", reason="gmsh is not installed")
    gmsh.initialize([], False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.occ.addBox(0, 0, 0, *edges)
        gmsh.model.occ.synchronize()
        gmsh.write(str(path))
    finally:
        gmsh.finalize()
