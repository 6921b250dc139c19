"""Meshes cut into pieces along faces of their cells."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cases.files.cells import solid
from cases.refusals import refused, refuses
from rom.errors import ConfigError, MeshError, TagError
from rom.fe.mesh.cell_types import CELL_TYPES
from rom.fe.mesh.cut import cut
from rom.fe.mesh.validate import checked

pytestmark = pytest.mark.once
SIZE = (3.0, 1.0, 1.0)
LONG = solid("hex8", (4, 1, 1), SIZE)
CROSSED = replace(LONG, facets={"side": LONG.corners[:, np.array(LONG.kind.faces[1])]})


@pytest.mark.parametrize("kind", sorted(CELL_TYPES))
def test_pieces_share_the_surfaces_between_them(kind):
    whole = solid(kind, (3, 1, 1), SIZE)
    pieces = cut(whole, 3, (2.0, 0, 0))
    assert [sorted(piece.facets) for piece in pieces.values()] == [
        ["cut 1", "root"], ["cut 1", "cut 2"], ["cut 2", "tip"]
    ]  # fmt: skip
    assert sum(len(piece.cells) for piece in pieces.values()) == len(whole.cells)
    for k, piece in enumerate(pieces.values()):
        found = checked(piece)
        assert_allclose([found.points[:, 0].min(), found.points[:, 0].max()], [k, k + 1])
        for name, rows in found.facets.items():
            place = {"root": 0, "tip": 3}.get(name) or (int(name[4:]) if name[:3] == "cut" else 0)
            assert_allclose(found.points[rows][..., 0], place)
            assert rows.shape == (len(whole.facets["root"]), found.kind.nodes_per_face)
            x, n = found.points[rows], found.kind.corners_per_face
            for i, middle in enumerate(range(n, min(2 * n, rows.shape[1]))):  # nodes amid edges
                assert_allclose(x[:, middle], (x[:, i] + x[:, (i + 1) % n]) / 2)


def test_regions_are_pieces_with_their_own_materials():
    whole = solid("tet10", (2, 1, 1), (2.0, 1.0, 1.0))
    left = whole.points[whole.corners].mean(axis=1)[:, 0] < 1.0
    names = {4: "hub", 9: "blade"}
    hub, blade = cut(replace(whole, regions=np.where(left, 4, 9), region_names=names)).values()
    assert sorted(hub.facets) == ["hub-blade", "root"] and sorted(blade.facets) == [
        "hub-blade", "tip"
    ]  # fmt: skip
    assert hub.region_names == {4: "hub"} and set(blade.regions) == {9}


def cutting(n, axis, mesh=None):
    return lambda: cut(mesh or solid("hex8", (2, 1, 1), SIZE), n, axis)


test_cuts_that_cannot_be_made_are_refused_by_name = refused(
    (cutting(3, (1, 0, 0)), MeshError, "piece 2 of 3 .* no cells"),
    (cutting(2, (1, 0.4, 0), solid("tet4", (4, 1, 1), SIZE)), MeshError, "'cut 1' is not flat"),
    (cutting(None, None), TagError, "one region"),
    (cutting(2, None), ConfigError, "n = 2 and axis = None"),
    (cutting(None, (1, 0, 0)), ConfigError, "n = None and axis"),
    (cutting(1, (1, 0, 0)), ConfigError, "one piece is the whole"),
    (cutting(2, (0, 0, 0)), ConfigError, "say no cuts"),
    (cutting(2, (1, 0, 0), CROSSED), TagError, "'side' lies partly on piece '1'"),
)


def test_surfaces_with_the_name_or_the_place_of_a_cut_are_refused():
    mesh = solid("hex8", (2, 1, 1), SIZE)
    inside = cut(mesh, 2, (1, 0, 0))["1"].facets["cut 1"]
    for more, said in (
        ({"cut 1": mesh.facets["tip"]}, "'cut 1' has the name of a cut"),
        ({"seam": inside}, "'seam' lies on 'cut 1'"),
    ):
        named = replace(mesh, facets=mesh.facets | more)
        refuses(TagError, said, cut, named, 2, (1, 0, 0))
