"""Bodies with parameters from finite elements: named regions, stress, any number of processes."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import csr_matrix

import rom
from cases.long import SHARED_BY
from cases.panels import ALLOY, FOAM, KINDS, PARAMETERS, panel
from cases.paths import RANKS
from cases.ranks.environment import written_on_each
from cases.solid import reduced
from rom.components.families.affine import AffineModel
from rom.eigen.scipy import SciPyOperators
from rom.eigen.verbs import rigid_motions
from rom.reduction.full_model import mesh_operators

pytestmark = pytest.mark.fenicsx
WOOD = rom.Orthotropic((11e9, 0.9e9, 0.5e9), (0.4, 0.4, 0.5), (0.7e9, 0.7e9, 0.05e9), 450.0)
CARBON = rom.Orthotropic((120e9, 9e9, 9e9), (0.3, 0.3, 0.4), (5e9, 5e9, 3e9), 1500.0)
POINT = {"E_core": 2.9, "E_all": 0.87, "rho_core": 1.6}


@pytest.fixture(scope="module")
def model():
    return panel()


@pytest.fixture(scope="module")
def family(model):
    return family_of(model, stress=True)


def family_of(model, **options):
    method, options = rom.CraigBampton(30), {"interfaces": KINDS, "tol": 5e-3} | options
    return rom.reduce_parametric(model, parameters=PARAMETERS, method=method, **options)


@pytest.mark.long
def test_a_panel_of_two_regions_at_a_point_of_its_range(family):
    body, full = family.at(**POINT), panel(**POINT)
    core, faces = 0.4 * 0.1 * 0.02 * 60.0 * 1.6, 0.4 * 0.1 * 0.004 * 2700.0
    assert_allclose(body.mass, core + faces, rtol=1e-12)
    assert_allclose(body.first_moment, [0.2 * (core + faces), 0, 0], rtol=1e-11, atol=1e-12)
    square = core * 0.02**2 / 12 + faces * (0.024**3 - 0.02**3) / 0.004 / 12  # of z
    J = (core + faces) * 0.1**2 / 12 + square
    assert_allclose(body.inertia[0, 0], J, rtol=1e-11)
    assert family.certificate.ok, family.certificate
    for fixed in ((), ("root",)):
        expected = rom.modes(full, 12, fixed=fixed, interfaces=KINDS).frequencies
        assert_allclose(body.frequencies(12, fixed=fixed), expected, rtol=5e-3, atol=1e-3)


@pytest.mark.parametrize("solids", [(FOAM, ALLOY), (WOOD, CARBON), (FOAM, CARBON), (FOAM, FOAM)])
def test_matrices_and_stress_are_sums_over_the_regions(solids):
    core, faces = solids
    model, full = panel(core=core, faces=faces), panel(**POINT, core=core, faces=faces)
    affine = AffineModel(model, PARAMETERS)
    X = np.random.default_rng(1).standard_normal((model.n_dofs, 3))
    ops = affine.at(POINT)
    for found, A in ((ops.apply_K(X), full.K), (ops.apply_M(X), full.M)):
        assert_allclose(found, A @ X, atol=1e-12 * np.abs(A @ X).max())
    nodes = model.surface.nodes
    plain = model.stresses.at_nodes(X, nodes).reshape(6 * nodes.size, -1)
    shares = {share.region: share for share in affine.shares(X, plain)}
    assert set(shares) == {"core", None}
    found = 0.87 * (2.9 * shares["core"].stress + shares[None].stress)
    expected = full.stresses.at_nodes(X, nodes).reshape(6 * nodes.size, -1)
    assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())


@pytest.mark.long
def test_stress_of_the_body_is_that_of_its_material(family):
    """Modes of the stress recovery: the first bending mode, clamped at the root."""
    body, full = family.at(**POINT), panel(**POINT)
    single = reduced(40, full, stress=True)
    peaks = []
    for each in (body, single):
        shape = each.modes(1, fixed=("root",))[1][6:, 0]
        tip = each.markers["tip"].translation @ shape
        peaks.append(np.sort(each.stress.von_mises(shape))[-20:] / np.linalg.norm(tip))
    assert_allclose(peaks[0], peaks[1], rtol=5e-3)
    assert not np.allclose(peaks[0], peaks[1] * 0.87, rtol=5e-3)


def test_petsc_and_scipy_say_the_same(model, family):
    regions = {}
    for name in ("core", "faces"):
        parts = (getattr(model.regions[name], which).getValuesCSR() for which in "KM")
        regions[name] = rom.Region(*(csr_matrix(A[::-1], (model.n_dofs,) * 2) for A in parts))
    plain = replace(model, operators=None, regions=regions, stresses=None)
    assert isinstance(mesh_operators(plain), SciPyOperators)
    assert np.abs(regions["core"].K @ rigid_motions(model.points)).max() < 1e-3
    other = family_of(plain, certify=False)
    found, expected = (f.at(**POINT).frequencies(16)[6:] for f in (other, family))
    assert_allclose(found, expected, rtol=1e-8)


@pytest.mark.long
@pytest.mark.mpi
@pytest.mark.slow
def test_a_family_is_blind_to_the_number_of_processes(tmp_path):
    words = (RANKS / "family_under_mpi.py", "material")
    families = written_on_each((1, *SHARED_BY), tmp_path, *words, load=rom.load)
    one, points = families[1], ({}, POINT, {"E_core": 0.2, "rho_core": 2.0})
    for n, point in product(SHARED_BY, points):
        assert families[n].body.n_modes == one.body.n_modes
        a, b = one.at(**point), families[n].at(**point)
        assert_allclose(b.mass, a.mass, rtol=1e-12)
        assert_allclose(b.inertia, a.inertia, rtol=1e-9, atol=1e-12)
        for fixed in ((), ("root",)):
            f, g = (body.frequencies(20, fixed=fixed) for body in (a, b))
            assert_allclose(g[6:], f[6:], rtol=1e-9)
