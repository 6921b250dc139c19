"""Files for ParaView, read back by VTK itself."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.solid import block, reduced
from rom.errors import ConfigError


@pytest.fixture(scope="module")
def body():
    return reduced(3, block())


@pytest.mark.fenicsx
def test_vtk_reads_points_triangles_and_shapes(body, tmp_path):
    pyvista = pytest.importorskip("pyvista", reason="VTK comes with the pictures")
    grid = pyvista.read(rom.export(body, tmp_path / "rod.vtu"))
    assert_allclose(grid.points, body.surface.points)
    assert_allclose(grid.cells.reshape(-1, 4)[:, 1:], body.surface.triangles)
    assert grid.n_arrays == body.n_modes
    second = grid.point_data[grid.array_names[1]]
    assert_allclose(second, body.surface.shape[:, 1].reshape(-1, 3))
    assert grid.array_names[0] == f"mode 1, mean-axis frame, {body.omega[0] / 2 / np.pi:.6g} Hz"


def test_an_unknown_ending_and_a_body_without_surface_are_named(body, tmp_path):
    from dataclasses import replace

    with pytest.raises(ConfigError, match=r"'.SID'; known: .npz, .vtu|ending '.sid'"):
        rom.export(body, tmp_path / "rod.SID")
    with pytest.raises(ConfigError, match="has no surface; to be drawn"):
        rom.export(replace(body, surface=None), tmp_path / "rod.vtu")
