"""Layers that change their thickness against models meshed with that thickness."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.sparse import csr_matrix

import rom
from cases.components.updating import refuse
from cases.long import ROM_LONG, SHARED_BY
from cases.panels import KINDS, LAYERS, family_of_layers, layered_panel
from cases.paths import RANKS
from cases.ranks.environment import written_on_each
from cases.refusals import refuses
from cases.solid import STEEL, block, reduced
from rom.body.reference import rigid_elastic
from rom.components.families.affine import StretchedModel
from rom.components.families.layers import Stretch
from rom.eigen.verbs import rigid_motions
from rom.errors import FileFormatError, ParameterError

AXES = "xyz"


def layered(material, axis, size, cells, origin):
    """A block with its stiffness split by three stretched blocks: a t^2 + b t + c = t K(t)."""
    model = block(size, cells, material, origin)

    def K(t):
        long = np.array(size)
        long[axis] *= t
        return block(tuple(long), cells, material).K

    t = np.array([1.0, 2.0, 4.0])
    inverse = np.linalg.inv(np.vander(t, 3))  # K_t, K_1, K_1/t from t K(t) at three t
    at_t = [x * K(x) for x in t]
    parts = [csr_matrix(sum(c * A for c, A in zip(row, at_t, strict=True))) for row in inverse]
    ends = ((origin[axis], origin[axis] + size[axis]),)

    def stretched(along):
        assert along == axis
        return rom.Layered(ends, *parts)

    region = rom.Region(model.K, model.M, stretched=stretched)
    return replace(model, regions={"all": region})


def family_of(model, parameters, n_modes, **options):
    method, options = rom.CraigBampton(n_modes), {"interfaces": KINDS} | options
    return rom.reduce_parametric(model, parameters=parameters, method=method, **options)


@pytest.mark.parametrize("axis", [1, 2])
def test_a_block_of_another_thickness(axis):
    """Plain matrices, away from the origin; inertia in closed form, frequencies of a new block."""
    size, cells, origin = (1.0, 0.1, 0.08), (8, 2, 2), (0.3, -0.02, 0.01)
    model = layered(STEEL, axis, size, cells, origin)
    parameters = {
        "t": rom.Thickness("all", 0.5, 2.0, axis=AXES[axis]),
        "E": rom.YoungsModulus("all", 0.5, 2.0),
    }
    family = family_of(model, parameters, 40)
    assert family.certificate.ok, family.certificate
    for t, E in ((0.55, 1.0), (1.0, 1.3), (1.9, 0.6)):
        length, low = np.array(size), np.array(origin)
        length[axis] *= t
        if low[axis] < 0:  # else the body lies beyond the plane of the origin, which stays
            low[axis] *= t
        body = family.at(t=t, E=E)
        m, x = 7850.0 * length.prod(), low + length / 2
        assert_allclose(body.mass, m, rtol=1e-12)
        assert_allclose(body.first_moment, m * x, rtol=1e-10)
        a, b, c = length
        inertia = np.diag([b * b + c * c, a * a + c * c, a * a + b * b]) * m / 12
        inertia += m * (x @ x * np.eye(3) - np.outer(x, x))
        assert_allclose(body.inertia, inertia, rtol=1e-10, atol=1e-12 * inertia.max())
        again = block(tuple(length), cells, replace(STEEL, E=E * STEEL.E), tuple(low))
        for fixed in ((), ("root",), ("root", "tip")):
            n = 5 if fixed else 11
            full = rom.modes(again, n, fixed=fixed, interfaces=KINDS).frequencies
            found = body.frequencies(n, fixed=fixed)
            assert_allclose(found, full, rtol=1e-3, atol=1e-3)
            assert np.all(found >= full - 1e-5)
        assert_allclose(body.surface.points.max(axis=0), low + length, rtol=1e-12)
        size_ = np.abs(body.surface.shape).max()
        assert_allclose(rigid_elastic(body), 0, atol=1e-9 * m * size_)
        seen = family.with_reference("root").at(t=t, E=E)
        assert_allclose(seen.marker("root").rotation, 0, atol=1e-9 * size_)
        assert_allclose(seen.frequencies(10)[6:], body.frequencies(10)[6:], rtol=1e-8)


@pytest.mark.parametrize("reference", ["mean-axis", "root"])
def test_with_all_modes_every_integral_is_that_of_the_stretched_block(reference):
    """Two square bases span the same; sums over mass-normalised coordinates do not see which."""
    size, cells, origin = (0.6, 0.1, 0.08), (3, 1, 1), (0.1, -0.03, -0.02)
    model = layered(STEEL, 2, size, cells, origin)
    t, thickness = 1.6, {"t": rom.Thickness(None, 0.5, 2.0)}
    family = family_of(model, thickness, 24, reference=reference, certify=False)
    again = block((0.6, 0.1, 0.08 * t), cells, STEEL, (0.1, -0.03, -0.02 * t))
    full, body = reduced(24, again, reference=reference), family.at(t=t)
    assert_allclose(body.omega, full.omega, rtol=1e-7)
    for one, other in zip(invariants(body), invariants(full), strict=True):
        assert_allclose(one, other, atol=1e-7)


def invariants(body):
    S, X = body.S / np.sqrt(body.mass), body.Ibar_kl / np.sqrt(body.mass * body.size**2)
    yield np.einsum("ak,bk->ab", S, S)
    yield np.einsum("abk,cdk->abcd", X, X)
    yield np.einsum("abk,ck->abc", X, S)
    yield np.einsum("abkl,cdkl->abcd", body.S_kl, body.S_kl)


def test_shapes_and_markers_are_those_of_the_thickness_it_has():
    """Bodies that move with an interface: the marker follows the nodes, rigid at its thickness."""
    size, cells, origin = (1.0, 0.1, 0.08), (6, 2, 2), (0.0, -0.03, -0.04)
    model = layered(STEEL, 2, size, cells, origin)
    family = family_of(model, {"t": rom.Thickness(None, 0.5, 2.0)}, 6, certify=False)
    body = family.at(t=1.7)
    for name, x in (("root", 0.0), ("tip", 1.0)):
        marker = body.marker(name)
        assert_allclose(marker.point, [x, 0.02, 0.0], atol=1e-12)
        on_face = np.isclose(body.surface.points[:, 0], x)
        points = body.surface.points[on_face]
        moved = body.surface.shape.reshape(-1, 3, body.n_modes)[on_face].reshape(-1, body.n_modes)
        motion = np.vstack([marker.translation, marker.rotation])
        rigid = rigid_motions(points - marker.point) @ motion
        assert_allclose(moved, rigid, atol=1e-9 * np.abs(body.surface.shape).max())
        assert marker.kind == "rbe2" and marker.hold.shape == (6, 6 + body.n_modes)


def test_points_follow_their_layers():
    stretch = Stretch(2, ("core", "faces"), (((-1.0, 1.0),), ((-1.5, -1.0), (1.0, 1.5))))
    points = np.array([[1.0, 2.0, z] for z in (-2.0, -1.25, -1.0, 0.0, 0.4, 1.5, 1.8)])
    parameters = {
        "all": rom.Thickness(None, 0.5, 2.0),
        "core": rom.Thickness("core", 0.5, 2.0),
        "faces": rom.Thickness("faces", 0.5, 2.0),
    }
    w = stretch.weights(parameters, {"all": 1.0, "core": 2.0, "faces": 0.6})
    z = [-2.0 - 0.3 - 0.5, -2.0 - 0.15, -2.0, 0.0, 0.8, 2.0 + 0.3, 2.0 + 0.3 + 0.3]
    mapped = stretch.mapped(points, w)
    assert_allclose(mapped, np.column_stack([np.ones(7), 2 * np.ones(7), z]), atol=1e-12)
    assert_allclose(sum(c * R for c, R in zip(w, stretch.motions(points), strict=True)),
                    rigid_motions(mapped), atol=1e-12)  # fmt: skip
    w = stretch.weights(parameters, {"all": 0.5, "core": 1.0, "faces": 1.0})
    assert_allclose(stretch.mapped(points, w), points * [1, 1, 0.5], atol=1e-12)


def test_what_thickness_does_not_go_with_is_named():
    model = layered(STEEL, 2, (1.0, 0.1, 0.08), (4, 1, 1), (0.0, 0.0, 0.0))
    half = {"t": rom.Thickness(None, 0.5, 1.0)}
    carrying = replace(model, attachments=(rom.Attachment("tip", 1.0),))
    bare, more = replace(model, regions={}), replace(model, K=2 * model.K)
    rib = lambda _: rom.Layered(((0.0, 0.02),), *[model.K] * 3)  # noqa: E731
    part = rom.Region(model.K, model.M, stretched=rib)
    beside = replace(model, regions=model.regions | {"rib": part})
    rib = {"t": rom.Thickness("rib", 0.5, 1.0)}
    both = half | {"u": rom.Thickness(None, 0.5, 1.0, axis="x")}
    full = KINDS | {"tip": "full"}
    refuse(
        (lambda: family_of(model, half, 2, interfaces=full), "'tip' has the kind 'full'"),
        (lambda: family_of(model, half, 2, stress=True), "stress is not recovered"),
        (lambda: family_of(carrying, half, 2), "attached masses"),
        (lambda: family_of(bare, half, 2), "do not tell how they are stretched"),
        (lambda: family_of(more, half, 2), "are not the whole model"),
        (lambda: StretchedModel(beside, rib), "'rib' is no layer of its own: 'all' lies beside it"),
        (lambda: rom.Thickness(None, 0.5, 1.0, axis="w"), "body = 'w' is none of 'x', 'y', 'z'"),
        (lambda: family_of(model, both, 2), "choose one axis"),
        error=ParameterError,
    )


def test_a_family_with_layers_travels(tmp_path):
    model = layered(STEEL, 2, (1.0, 0.1, 0.08), (4, 1, 1), (0.0, 0.0, 0.0))
    family = family_of(model, {"t": rom.Thickness("all", 0.5, 2.0)}, 4, reference="root")
    again = rom.load(rom.save(family, tmp_path / "family.npz"))
    one, other = again.at(t=1.3), family.at(t=1.3)
    for name in ("mass", "first_moment", "inertia", "S", "Ibar_kl", "S_kl", "K", "omega"):
        assert_array_equal(getattr(one, name), getattr(other, name))
    assert_array_equal(one.surface.shape, other.surface.shape)
    cut = replace(family, stretch=replace(family.stretch, rigid=family.stretch.rigid[:, 1:]))
    refuses(FileFormatError, "rigid has the shape", rom.load, rom.save(cut, tmp_path / "cut.npz"))
    moved = rom.load(rom.save(one, tmp_path / "body.npz"))
    assert_array_equal(moved.frequencies(), one.frequencies())


POINT = {"t_core": 1.5, "t_faces": 0.8}


@pytest.mark.long
@pytest.mark.fenicsx
def test_core_and_faces_of_a_panel_change_their_thickness():
    """The mesh of another thickness is the same mesh stretched."""
    body, full = family_of_layers(layered_panel()).at(**POINT), layered_panel(**POINT)
    core, faces = 0.4 * 0.1 * 0.03 * 60.0, 0.4 * 0.1 * 0.0032 * 2700.0
    assert_allclose(body.mass, core + faces, rtol=1e-11)
    assert_allclose(body.first_moment, [0.2 * (core + faces), 0, 0], rtol=1e-10, atol=1e-12)
    square = core * 0.03**2 / 12 + faces * (0.0332**3 - 0.03**3) / 0.0032 / 12  # of z
    J = (core + faces) * 0.1**2 / 12 + square
    assert_allclose(body.inertia[0, 0], J, rtol=1e-10)
    for fixed in ((), ("root",), ("root", "tip")):
        n = 5 if fixed else 11
        expected = rom.modes(full, n, fixed=fixed, interfaces=KINDS).frequencies
        found = body.frequencies(n, fixed=fixed)
        assert_allclose(found, expected, rtol=3e-3, atol=1e-3)
        assert np.all(found >= expected - 1e-5)


@pytest.mark.long
@pytest.mark.fenicsx
def test_faces_of_one_thickness_move_with_the_core():
    """Nothing stretches the faces, but the rigid motions of the whole change."""
    family = family_of(layered_panel(), {"t": rom.Thickness("core", 0.7, 1.8)}, 16, certify=False)
    body, full = family.at(t=1.5), layered_panel(t_core=1.5)
    expected = rom.modes(full, 4, fixed=("root",), interfaces=KINDS).frequencies
    assert_allclose(body.frequencies(4, fixed=("root",)), expected, rtol=3e-3)
    assert_allclose(body.mass, full.mass(), rtol=1e-12)


@pytest.mark.fenicsx
def test_the_terms_of_the_stiffness_are_those_of_the_stretched_mesh():
    parameters = LAYERS | {"E": rom.YoungsModulus("core", 0.5, 2.0)}
    model, full = StretchedModel(layered_panel(), parameters), layered_panel(**POINT, E=1.6)
    ops = model.bare(POINT | {"E": 1.6})
    X = np.random.default_rng(2).standard_normal((full.n_dofs, 3))
    assert_allclose(model.model_at(POINT | {"E": 1.6}).points, full.points, atol=1e-12)
    for found, A in ((ops.apply_K(X), full.K), (ops.apply_M(X), full.M)):
        assert_allclose(found, A @ X, atol=1e-11 * np.abs(A @ X).max())
    assert_allclose(model.stretch.layers[1], [[-0.012, -0.01], [0.01, 0.012]], atol=1e-12)


@pytest.mark.fenicsx
@pytest.mark.mpi
@pytest.mark.slow
@pytest.mark.skipif(not ROM_LONG, reason="half a minute; families of regions are shared above all")
def test_layers_are_blind_to_the_number_of_processes(tmp_path):
    words = (RANKS / "family_under_mpi.py", "thickness")
    families = written_on_each((1, *SHARED_BY), tmp_path, *words, load=rom.load)
    one, *others = ([family.at(**p).frequencies(14)[6:] for p in ({}, POINT)]
                    for family in families.values())  # fmt: skip
    for many in others:
        assert_allclose(many, one, rtol=1e-9)
