"""Universal files and files for ParaView: known numbers come back, broken files are named."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.files.decks import IM, RE, X, binary, dataset
from cases.paths import TESTS
from cases.refusals import refuses
from cases.solid import block, reduced
from rom.errors import ConfigError, FileFormatError
from rom.io.fields.universal import read_universal

HERE = TESTS / "reference" / "foreign"


@pytest.mark.parametrize("spacing", [0, 1])
@pytest.mark.parametrize("kind", [2, 4, 5, 6])
def test_all_eight_forms_of_numbers_are_read(kind, spacing, tmp_path):
    parts = [RE, IM] if kind > 4 else [RE]
    (tmp_path / "a.unv").write_text(dataset(kind, spacing, ([] if spacing else [X]) + parts))
    (f,) = read_universal(tmp_path / "a.unv")
    assert_allclose(f.x, X, rtol=1e-12)
    assert_allclose(f.y, RE + 1j * IM if kind > 4 else RE, rtol=1e-12)
    assert (f.response, f.reference, f.kind) == ((7, 3), (11, -3), 4)
    assert f.labels[0] == "wing tip"


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("kind", [5, 6])
def test_binary_datasets_are_read_in_both_byte_orders(kind, order, tmp_path):
    (tmp_path / "b.uff").write_bytes(binary(kind, order))
    (f,) = read_universal(tmp_path / "b.uff")
    assert_allclose(f.y, RE + 1j * IM, rtol=1e-6)
    assert_allclose(f.x, X)


@pytest.mark.parametrize("name", ["pyuff_text.uff", "pyuff_binary.uff"])
def test_files_of_another_program_are_read(name):
    """Written by pyuff 2.5.8 from these numbers, real parts times 5 and 9.

    Its binary files announce 40 bytes for 80, and close the dataset without an end of line.
    """
    found = read_universal(HERE / name)
    assert [f.response for f in found] == [(5, 2), (9, 2)]
    for f, k in zip(found, (5, 9), strict=True):
        assert_allclose(f.x, X, rtol=1e-12)
        assert_allclose(f.y, k * RE + 1j * IM, rtol=1e-11)
        assert (f.reference, f.numerator, f.denominator) == ((11, -3), 12, 13)


def test_other_datasets_and_line_ends_do_not_disturb_accelerations_of_displacements(tmp_path):
    other = f"{-1:6d}\n   151\nname\n{-1:6d}\n"
    content = other + dataset(6, 1, [RE, IM]) + other + dataset(5, 1, [RE, IM], response=(8, 1))
    (tmp_path / "c.unv").write_bytes(content.replace("\n", "\r\n").encode())
    found = read_universal(tmp_path / "c.unv")
    assert [f.response for f in found] == [(7, 3), (8, 1)]
    assert_allclose(found[0].y, RE + 1j * IM)
    assert_allclose(found[0].receptance(), -(RE + 1j * IM) / (2 * np.pi * X) ** 2)


def test_broken_files_are_named(tmp_path):
    path, data = tmp_path / "x.unv", (HERE / "pyuff_binary.uff").read_bytes()
    # fewer bytes than the numbers need, and no closing mark where they would end
    for bad in (data[:-30], data[:-7], data[:940] + data[944:]):
        path.write_bytes(bad)
        refuses(FileFormatError, r"x\.unv: dataset \d is cut", read_universal, path)
    whole = dataset(6, 1, [RE, IM])
    for bad in (whole[: len(whole) // 2], whole.replace("E+00", "Q+00"), whole[:-40] + whole[-7:]):
        path.write_text(bad)
        refuses(FileFormatError, r"x\.unv: dataset 1", read_universal, path)
    path.write_text("no universal file")
    refuses(FileFormatError, "holds no function", read_universal, path)


@pytest.mark.fenicsx
def test_vtk_reads_points_triangles_and_shapes(tmp_path):
    pyvista = pytest.importorskip("pyvista", reason="VTK comes with the pictures")
    body = reduced(3, block())
    grid = pyvista.read(rom.export(body, tmp_path / "rod.vtu"))
    assert_allclose(grid.points, body.surface.points)
    assert_allclose(grid.cells.reshape(-1, 4)[:, 1:], body.surface.triangles)
    assert grid.n_arrays == body.n_modes
    second = grid.point_data[grid.array_names[1]]
    assert_allclose(second, body.surface.shape[:, 1].reshape(-1, 3))
    assert grid.array_names[0] == f"mode 1, mean-axis frame, {body.omega[0] / 2 / np.pi:.6g} Hz"


def test_an_unknown_ending_and_a_body_without_surface_are_named(tmp_path):
    body = reduced(3, block())
    bare = replace(body, surface=None)
    refuses(ConfigError, r"'.SID'; known|ending '.sid'", rom.export, body, tmp_path / "rod.SID")
    refuses(ConfigError, "has no surface; to be drawn", rom.export, bare, tmp_path / "rod.vtu")
