"""One reduced sector for all nodal diameters: exact limits, Ritz bounds, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import identity

import rom
from cases.refusals import refuses
from cases.solid import block
from cases.wheels import mass_ring
from rom.components.wheels.reduced import distance, face_functions, fading
from rom.eigen.verbs import rigid_motions
from rom.errors import ConfigError, InterfaceError


def periodic_bar(N=8, held=False):
    """A bar that closes in itself, as the wheel of an infinite radius: C = I."""
    model = block((0.3, 0.1, 0.08), (3, 2, 2))
    root, tip = model.interfaces["root"], model.interfaces["tip"]
    bottom = np.flatnonzero(model.points[:, 2] == 0.0)
    dofs = (3 * bottom[:, None] + np.arange(3)).ravel() if held else np.zeros(0, dtype=np.int64)
    return rom.CyclicSector(
        N, model.K, model.M, tip.dofs, root.dofs, identity(root.dofs.size, format="csr"),
        face=root, held=dofs,
    )  # fmt: skip


@pytest.mark.parametrize("held", [False, True])
def test_all_functions_and_all_modes_change_nothing(held):
    bar = periodic_bar(held=held)
    inner = bar.n - np.union1d(np.union1d(bar.slave, bar.master), bar.held).size
    square = rom.reduce_sector(bar, n_modes=inner, functions=rom.Polynomial(4))
    assert square.free.size == bar.free.size
    assert square.supported is held
    for n in (1, 3):
        full, found = (rom.cyclic_modes(s, n, 12) for s in (bar, square))
        assert_allclose(found.omega, full.omega, rtol=1e-9)
        U, V = square.expand(found.shapes), full.shapes
        assert_allclose(abs(np.sum(V.conj() * (bar.M @ U), axis=0)), np.ones(12), rtol=1e-6)
        assert not U[bar.held].any()


@pytest.mark.parametrize("n", [0, 2, 4])
def test_reduced_frequencies_fall_to_those_of_the_full_wheel(n):
    """Ritz: never below, and lower with every function and every mode added."""
    bar = periodic_bar(held=True)
    exact = rom.cyclic_modes(bar, n, 5).omega
    before = np.inf
    for order, n_modes in ((1, 4), (2, 4), (2, 8), (3, 16), (4, 24)):
        small = rom.reduce_sector(bar, n_modes=n_modes, functions=rom.Polynomial(order))
        found = rom.cyclic_modes(small, n, 5).omega
        assert np.all(found >= exact * (1 - 1e-9))
        assert np.all(found <= before * (1 + 1e-9))
        before = found
    assert_allclose(before, exact, rtol=1e-3)


def test_a_sector_is_reduced_like_a_body():
    bar, functions = periodic_bar(held=True), rom.Polynomial(2)
    exact = rom.reduce_sector(bar, n_modes=8, functions=functions)
    small = rom.reduce(bar, method=rom.CraigBampton(8), interfaces={"cyclic": functions})
    assert (small.K != exact.K).nnz == 0 and (small.M != exact.M).nnz == 0
    default = rom.reduce(bar, method=rom.CraigBampton(8))
    assert (default.K != rom.reduce_sector(bar, n_modes=8).K).nnz == 0
    for options, words in (
        ({"interfaces": {"root": "rbe2"}}, "no interface 'root'; there are"),
        ({"stress": True}, "belong to bodies in motion"),
        ({"method": rom.CraigBampton(f_max=10.0)}, "fixed-interface modes, not None, CraigB"),
        ({"method": rom.Rubin(3)}, "must be of type CraigBampton"),
    ):
        refuses(ConfigError, words, rom.reduce, bar, **{"method": rom.CraigBampton(8)} | options)
    refuses(ConfigError, "number of fixed-interface modes, not None", rom.reduce_sector, bar)
    bar = periodic_bar()
    refuses(ConfigError, "geometry", rom.reduce_sector, mass_ring(5), n_modes=0)
    still = replace(bar, held=np.union1d(bar.slave, bar.master))
    refuses(InterfaceError, "'root' are held", rom.reduce_sector, still, n_modes=2)
    refuses(ConfigError, "must be a whole number from", rom.reduce_sector, bar, n_modes=10_000)


def test_a_certificate_tells_good_from_poor_and_wrong():
    bar = periodic_bar(held=True)
    good = rom.reduce_sector(bar, n_modes=24, functions=rom.Polynomial(4))
    assert good.certificate.ok and good.certificate is good.certificate  # solved once
    worst = [abs(rom.cyclic_modes(good, n, 6).omega / rom.cyclic_modes(bar, n, 6).omega - 1).max()
             for n in (0, 1, 2, 4)]  # fmt: skip
    said = [line.value for line in good.certificate.rows if "worst error" in line.quantity]
    assert_allclose(said, worst, rtol=1e-6)
    poor = rom.reduce_sector(bar, n_modes=2, functions=rom.Polynomial(1)).certificate
    failed = {line.quantity.split(": ")[1] for line in poor.failures}
    assert failed == {"worst error of 6 frequencies"}
    wrong = replace(good, K=0.98 * good.K).certificate
    assert any("never below full" in line.quantity for line in wrong.failures)


def test_rigid_motions_survive():
    """Linear functions carry them exactly: what a translation is in full coordinates."""
    bar = periodic_bar()
    free = replace(bar, motions=rigid_motions(block((0.3, 0.1, 0.08), (3, 2, 2)).points))
    small = rom.reduce_sector(free, n_modes=3, functions=rom.Polynomial(1))
    assert_allclose(small.expand(small.motions), free.motions, atol=1e-9)
    assert rom.cyclic_modes(small, 0, 3).omega[0] == 0.0


def test_functions_fade_out_where_the_face_is_held_and_shapes_expand_to_the_whole_wheel():
    bar = periodic_bar(held=True)
    Q = face_functions(bar, rom.Polynomial(2))
    at_rest = bar.face.points[:, 2] == 0.0
    assert not Q[at_rest].any()
    assert_allclose(Q.T @ bar.face.surface_mass @ Q, np.eye(Q.shape[1]), atol=1e-10)
    bar = periodic_bar(4)
    small = rom.reduce_sector(bar, n_modes=10, functions=rom.Polynomial(2))
    U, (_, M) = rom.cyclic_modes(small, 1, 4).on_wheel(), bar.wheel()
    Phi = U[:, bar.free].reshape(-1, 4)
    assert_allclose(Phi.T @ M @ Phi, np.eye(4), atol=1e-9)


def test_functions_rise_from_a_held_edge_within_half_the_thickness():
    """On a strip of thickness h, held at s = 0: s / (s + h / 2), also beside and between nodes."""
    h, L = 0.2, 3.0
    s, t = (x.ravel() for x in np.meshgrid(np.linspace(0, L, 61), np.linspace(0, h, 41)))
    at_rest = (s == 0.0) & (np.arange(41).repeat(61) % 10 == 0)
    points = np.column_stack([0.6 * s, 0.8 * s, t])
    face = rom.model.Interface("strip", np.arange(s.size), points, identity(s.size), points[0])
    assert_allclose(distance(points, points[at_rest]), s, atol=1e-12)
    assert_allclose(fading(face, at_rest), s / (s + h / 2), rtol=0.03, atol=1e-12)
    assert_allclose(distance(points, points[:1]), np.hypot(s, t), atol=1e-12)
