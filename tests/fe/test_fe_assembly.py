"""Stiffness, mass, interfaces and surface that come out of dolfinx."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import csr_matrix

import rom
from cases.boxes import box, distort
from cases.refusals import refuses
from cases.solid import STEEL, block
from rom.eigen.verbs import rigid_motions
from rom.errors import ConfigError, InterfaceError, MaterialError, RomWarning, TagError

pytest.importorskip("dolfinx", reason="dolfinx is not installed")


from dolfinx.mesh import compute_midpoints, meshtags

from rom.fe.elasticity import assemble
from rom.fe.forms import region
from rom.fe.jit import cache_directory

ELEMENTS = [(kind, degree) for kind in ("tetrahedron", "hexahedron") for degree in (1, 2)]
every_element = pytest.mark.parametrize(("kind", "degree"), ELEMENTS)
pytestmark = [pytest.mark.fenicsx, pytest.mark.filterwarnings("ignore:linear tetrahedra")]


@every_element
def test_constant_strain_leaves_no_force_inside(kind, degree):
    mesh, _ = box((1.0, 0.8, 0.6), (3, 3, 3), kind)
    model = assemble(distort(mesh, 0.05), material=STEEL, degree=degree)
    A = np.random.default_rng(1).normal(size=(3, 3))
    x = model.points
    inside = np.all((x > 1e-9) & (x < np.array([1.0, 0.8, 0.6]) - 1e-9), axis=1)
    forces = (model.K @ (x @ A.T).ravel()).reshape(-1, 3)
    assert inside.sum() >= 8
    assert np.abs(forces[inside]).max() < 1e-12 * np.abs(forces).max()


AXES = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0].tolist()
PLY = rom.Orthotropic((140e9, 10e9, 9e9), (0.3, 0.25, 0.4), (5e9, 4e9, 3e9), 1600.0, axes=AXES)


@pytest.mark.parametrize("material", [STEEL, PLY], ids=["isotropic", "orthotropic"])
@every_element
def test_energy_of_constant_strain_is_that_of_the_material(kind, degree, material):
    mesh, _ = box((1.0, 0.8, 0.6), (2, 2, 2), kind)
    model = assemble(distort(mesh), material=material, degree=degree)
    A = np.random.default_rng(2).normal(size=(3, 3))
    e = 0.5 * (A + A.T)
    voigt = np.array([e[0, 0], e[1, 1], e[2, 2], 2 * e[1, 2], 2 * e[0, 2], 2 * e[0, 1]])
    u = (model.points @ A.T).ravel()
    assert_allclose(u @ (model.K @ u), 0.48 * voigt @ material.stiffness @ voigt, rtol=1e-12)


@every_element
def test_matrices_are_symmetric_with_the_mass_and_the_free_motions_of_the_box(kind, degree):
    size = np.array([1.0, 0.8, 0.6])
    mesh, _ = box(size, (3, 2, 2), kind)
    model = assemble(distort(mesh, 0.1), material=STEEL, degree=degree)
    m, centre = 7850.0 * size.prod(), size / 2
    R = rigid_motions(model.points - centre)
    expected = np.diag([m, m, m, *(m / 12 * ((size**2).sum() - size**2))])
    assert_allclose(R.T @ (model.M @ R), expected, atol=1e-10 * m)
    assert_allclose(model.mass(), m, rtol=1e-12)
    assert model.K.shape == (model.n_dofs, model.n_dofs)
    assert abs(model.K - model.K.T).max() == 0.0
    assert abs(model.M - model.M.T).max() == 0.0
    R = rigid_motions(model.points)
    assert np.abs(model.K @ R).max() < 1e-12 * abs(model.K).max()


def test_trilinear_brick_agrees_with_one_written_in_numpy():
    mesh, _ = box(kind="hexahedron")
    model, other = assemble(mesh, material=STEEL, degree=1), block(cells=(8, 2, 2))
    places = [np.lexsort(np.round(m.points, 9).T) for m in (model, other)]
    d, e = ((3 * p[:, None] + np.arange(3)).ravel() for p in places)
    assert_allclose(model.points[places[0]], other.points[places[1]], atol=1e-12)
    for ours, theirs in ((model.K, other.K), (model.M, other.M)):
        scale = abs(theirs).max()
        assert_allclose(ours[d][:, d].toarray(), theirs[e][:, e].toarray(), atol=1e-12 * scale)


@every_element
def test_interface_has_the_area_centroid_and_order_of_its_face(kind, degree):
    mesh, tags = box((1.0, 0.1, 0.08), (4, 2, 3), kind)
    model = assemble(mesh, None, tags, material=STEEL, degree=degree)
    face = model.interfaces["x1"]
    assert_allclose(face.area, 0.1 * 0.08, rtol=1e-12)
    assert_allclose(face.origin, [1.0, 0.05, 0.04], atol=1e-12)
    assert_allclose(face.points, model.points[face.nodes], atol=0)
    steps = np.round(face.points, 9)
    assert np.array_equal(np.lexsort(steps.T[::-1]), np.arange(len(steps)))
    assert len(face.nodes) == (2 * degree + 1) * (3 * degree + 1)
    y = face.points[:, 1]
    assert_allclose(y @ face.surface_mass @ y, 0.08 * 0.1**3 / 3, rtol=1e-12)  # integral of y^2
    assert abs(face.surface_mass - face.surface_mass.T).max() < 1e-18


def test_two_interfaces_may_share_facets():
    mesh, tags = box()
    both = np.union1d(tags["x1"].indices, tags["y1"].indices).astype(np.int32)
    tags["corner"] = meshtags(mesh, 2, both, np.ones(both.size, dtype=np.int32))
    model = assemble(mesh, None, tags, material=STEEL, degree=1)
    area = {name: face.area for name, face in model.interfaces.items()}
    assert_allclose(area["corner"], area["x1"] + area["y1"], rtol=1e-12)


@every_element
def test_surface_is_closed_and_seen_from_outside(kind, degree):
    mesh, _ = box((1.0, 0.8, 0.6), (2, 2, 2), kind)
    model = assemble(mesh, material=STEEL, degree=degree)
    a, b, c = np.moveaxis(model.points[model.surface.nodes][model.surface.triangles], 1, 0)
    normal = np.cross(b - a, c - a) / 2
    assert_allclose(np.linalg.norm(normal, axis=1).sum(), 2 * (0.8 + 0.6 + 0.48), rtol=1e-12)
    assert_allclose((normal * (a + b + c)).sum() / 9, 0.48, rtol=1e-12)  # divergence theorem
    edges = np.sort(np.concatenate([model.surface.triangles[:, [i, i - 1]] for i in range(3)]))
    assert np.all(np.unique(edges, axis=0, return_counts=True)[1] == 2)


def stretched(model, sides=("x0", "x1")):
    """Mean elongation [m] of a bar under one pascal at its ends, supported without reaction."""
    places = np.array([[0, 0, 0], [0, 0.1, 0], [0, 0, 0.08]])
    corner, aside, above = 3 * np.linalg.norm(model.points[:, None] - places, axis=2).argmin(axis=0)
    held = [corner, corner + 1, corner + 2, aside, aside + 2, above]
    F = np.zeros((model.n_dofs, 1))
    for name, sign in zip(sides, (-1.0, 1.0), strict=True):
        face = model.interfaces[name]
        F[3 * face.nodes, 0] += sign * np.asarray(face.surface_mass.sum(axis=1)).ravel()
    u = model.operators.hold(held)(F).reshape(-1, 3)

    def mean(face):
        weights = np.asarray(face.surface_mass.sum(axis=0)).ravel()
        return weights @ u[face.nodes, 0] / weights.sum()

    return mean(model.interfaces[sides[1]]) - mean(model.interfaces[sides[0]])


@pytest.mark.parametrize("angle", [0.0, 0.3, 0.9, np.pi / 2])
def test_off_axis_modulus_of_an_orthotropic_bar(angle):
    """1/E_x = c^4/E1 + s^4/E2 + (1/G12 - 2 nu12/E1) s^2 c^2 (Jones, Mechanics of Composites)."""
    c, s = np.cos(angle), np.sin(angle)
    ply = replace(PLY, axes=[[c, s, 0], [-s, c, 0], [0, 0, 1]])
    mesh, tags = box(cells=(4, 1, 1), kind="tetrahedron")
    model = assemble(mesh, None, tags, material=ply, degree=1)
    compliance = c**4 / 140e9 + s**4 / 10e9 + (1 / 5e9 - 2 * 0.3 / 140e9) * s**2 * c**2
    assert_allclose(stretched(model), compliance, rtol=1e-9)


def regions_of(mesh, limit=0.25):
    n = mesh.topology.index_map(3).size_local + mesh.topology.index_map(3).num_ghosts
    cells = np.arange(n, dtype=np.int32)
    middle = compute_midpoints(mesh, 3, cells)
    return meshtags(mesh, 3, cells, np.where(middle[:, 0] < limit, 4, 9).astype(np.int32))


SOFT = rom.Material(E=3e9, nu=0.0, rho=1200.0)
HARD = rom.Material(E=70e9, nu=0.0, rho=2700.0)
NAMES = {"pad": 4, "shank": 9}
HARD_BUT_FULL = rom.Orthotropic((70e9,) * 3, (0.0,) * 3, (35e9,) * 3, 2700.0)


@pytest.mark.parametrize("second", [HARD, HARD_BUT_FULL], ids=["isotropic", "orthotropic"])
def test_two_materials_in_series_stretch_like_two_springs(second):
    mesh, tags = box(cells=(4, 1, 1))
    solids = {"pad": SOFT, "shank": second}
    model = assemble(mesh, regions_of(mesh), tags, material=solids, regions=NAMES, degree=2)
    assert_allclose(stretched(model), 0.25 / 3e9 + 0.75 / 70e9, rtol=1e-9)
    assert_allclose(model.mass(), 0.008 * (0.25 * 1200.0 + 0.75 * 2700.0), rtol=1e-12)
    along = np.tile([1.0, 0.0, 0.0], len(model.points))
    moment = along @ (model.M @ (along * np.repeat(model.points[:, 0], 3)))
    assert_allclose(moment, 0.008 * (1200.0 * 0.25**2 + 2700.0 * (1 - 0.25**2)) / 2, rtol=1e-12)
    assert model.provenance["material"]["pad"]["E"] == 3e9


def test_regions_are_assembled_when_they_are_asked_for_and_no_sooner(monkeypatch):
    """Each has matrices as large as those of the whole body, which few ask for."""
    mesh, tags = box(cells=(4, 1, 1))
    made, assembled = [], region.assemble_matrix
    monkeypatch.setattr(region, "assemble_matrix", lambda form: made.append(1) or assembled(form))
    model = assemble(mesh, regions_of(mesh), tags, material=HARD, regions=NAMES)
    model = replace(model, provenance={})
    assert not made and list(model.regions) == list(NAMES)
    parts = [model.regions[name].M for name in NAMES]
    n = model.n_dofs
    total = sum(csr_matrix(A.getValuesCSR()[::-1], shape=(n, n)) for A in parts)
    assert len(made) == 4 and np.abs(total - model.M).max() < 1e-12 * np.abs(model.M).max()


def test_regions_materials_interfaces_and_attachments_that_do_not_fit_are_named():
    mesh, tags = box(cells=(4, 1, 1))
    cells, named, none = regions_of(mesh), {"regions": NAMES}, np.zeros(0, dtype=np.int32)
    lost = {"material": STEEL, "attachments": [rom.Attachment("tip", 2.0)]}
    pin = tags | {"pin_a": meshtags(mesh, 2, none, none)}
    for error, said, regions, facets, given in (
        (MaterialError, r"'shnk'; the mesh has \['pad', 'shank'\]", cells, tags,
         {"material": {"shnk": HARD}} | named),
        (TagError, "'shank' has no material", cells, tags, {"material": {"pad": HARD}} | named),
        (TagError, "named without cells", None, tags, {"material": HARD} | named),
        (TagError, "cells belong to none of the regions", cells, tags,
         {"material": HARD, "regions": {"pad": 4, "rest": 5}}),
        (ConfigError, "degree = 4", None, tags, {"material": STEEL, "degree": 4}),
        (InterfaceError, "'pin_a' has no facet", None, pin, {"material": STEEL}),
        (InterfaceError, "2 kg hangs on 'tip'", None, tags, lost),
    ):  # fmt: skip
        refuses(error, said, assemble, mesh, regions, facets, **given)


@pytest.mark.filterwarnings("default:linear tetrahedra")
@pytest.mark.parametrize(
    ("size", "kind", "degree", "material", "words"),
    [
        ((150.0, 10.0, 10.0), "hexahedron", 1, STEEL, "millimetres, give scale=1e-3"),
        ((1.0, 0.1, 0.1), "tetrahedron", 1, STEEL, "linear tetrahedra lock in bending"),
        ((1.0, 0.1, 0.1), "hexahedron", 1, rom.Material(1e9, 0.4999, 1e3), "incompressible"),
    ],
)
def test_unusual_input_is_worth_a_warning(size, kind, degree, material, words):
    mesh, _ = box(size, (2, 1, 1), kind)
    with pytest.warns(RomWarning, match=words):
        model = assemble(mesh, material=material, degree=degree)
    assert any(words in text for text in model.provenance["warnings"])


def test_provenance_tells_how_the_model_was_made_and_other_numbers_are_not_compiled_anew():
    mesh, tags = box(cells=(2, 1, 1))
    model = assemble(mesh, None, tags, material=STEEL)
    assert set(model.provenance["versions"]) == {"dolfinx", "PETSc", "SLEPc"}
    told = {
        "material": {"solid": {"E": 210e9, "nu": 0.3, "rho": 7850.0}},
        "cells": {"hexahedron": 2}, "degree": 2, "units": "SI", "warnings": [],
    }  # fmt: skip
    assert model.provenance | told == model.provenance
    before = sorted(cache_directory().glob("*.c"))
    assemble(mesh, material=rom.Material(70.1234e9, 0.31, 2711.0))
    assert sorted(cache_directory().glob("*.c")) == before


GEOMETRY = """
SetFactory("OpenCASCADE");
DefineConstant[ L = {0.5, Name "L"} ];
Box(1) = {0, 0, 0, L, 0.1, 0.08};
Physical Volume("bar") = {1};
Physical Surface("root") = {1};
Physical Surface("tip") = {2};
Mesh.CharacteristicLengthMax = 0.08;
"""


def test_a_geometry_file_becomes_a_model(tmp_path):
    path = tmp_path / "bar.geo"
    path.write_text(GEOMETRY)
    how = {"parameters": {"L": 0.7}, "attachments": [rom.Attachment("tip", 3.0)], "scale": 2.0}
    model = rom.fe.model(path, material={"bar": STEEL}, **how)
    assert model.interface_names == ("root", "tip")
    assert_allclose(model.interfaces["tip"].origin, [1.4, 0.1, 0.08], atol=1e-12)
    assert_allclose(model.mass(), 7850.0 * 0.0056 * 8 + 3.0, rtol=1e-10)
    made = model.provenance
    assert (made["parameters"]["L"], len(made["sha256"]), made["degree"]) == (0.7, 64, 2)
    said = r"no region 'rod'; the mesh has \['bar'\]"
    refuses(MaterialError, said, rom.fe.model, path, material={"rod": STEEL})
