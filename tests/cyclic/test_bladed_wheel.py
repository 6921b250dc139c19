"""Blades as substructures: the whole wheel of finite elements with the same blades."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import csr_matrix

import rom
from cases.long import MESHED
from cases.refusals import refuses
from cases.wheels import bladed_model, gathered, response_of, tip_of
from rom.components.wheels.blades.substructured_sector import cut, region, root_of
from rom.eigen.scipy import SciPyOperators
from rom.eigen.verbs import dofs_of
from rom.errors import ConfigError, InterfaceError, ModelError

pytestmark = MESHED
N, ORDER, ZETA = 6, 2, 2e-3
SIZES = {"cells": (6, 2, 3, 2), "blade": (2, 4)}


@pytest.fixture(scope="module")
def model():
    return bladed_model(N, **SIZES)


@pytest.fixture(scope="module")
def full(model):
    return rom.CyclicSector.from_model(model, fixed=("bore",), regions=("blade",))


@pytest.fixture(scope="module")
def small(full, model):
    room = {"n_modes": 40, "n_blade_modes": 25}
    room |= {"functions": rom.Polynomial(6), "root": rom.Polynomial(4)}
    return rom.substructured_sector(full, model, **room)


@pytest.fixture(scope="module")
def disk(small):
    return rom.bladed_wheel(small, 12)


def whole_wheel(full, changes, n_modes):
    """Lowest modes of all finite elements, {sector: (dK, dM)} added to those that differ."""
    nothing = (0 * full.K, 0 * full.M)
    dK, dM = zip(*(changes.get(j, nothing) for j in range(N)), strict=True)
    _, _, K, M = full.wheel([full.K + A for A in dK], [full.M + A for A in dM])
    ops = SciPyOperators(K, M)
    return ops.modes(ops.hold([]), n_modes)


def peaks(u):
    return np.linalg.norm(u, axis=-1).max(axis=0)


def test_disk_and_blade_make_the_tuned_sector(full, small):
    assert small.free.size < 0.2 * full.free.size
    assert small.root_functions.shape[1] < small.root_points.shape[0]
    for n in full.diameters:
        exact, found = (rom.cyclic_modes(s, n, 10).omega for s in (full, small))
        assert_allclose(found, exact, rtol=1e-3)
        assert np.all(found > exact * (1 - 1e-9))


def test_equal_blades_are_the_tuned_wheel_and_certificates_notice_weak_ones(small, disk):
    """With all waves of the disk nothing is lost between sector and wheel; with few, little."""
    n_waves = small.free.size - small.root.size - small.cantilever.size
    omega, Phi = rom.bladed_wheel(small, n_waves).modes([small.blade] * N)
    exact = gathered(small, 8)[:30]
    assert Phi.shape[0] == N * small.free.size
    assert_allclose(omega[:30], exact, rtol=1e-8)
    few = disk.modes([small.blade] * N)[0][:30]
    assert_allclose(few, exact, rtol=5e-4)
    assert np.all(few > exact * (1 - 1e-9))
    fewer = rom.bladed_wheel(small, 12, n_root=18)
    assert fewer.roots.shape == (N, small.root.size, N * 18)
    fewest = fewer.modes([small.blade] * N)[0][:30]
    assert_allclose(fewest, few, rtol=3e-4)
    assert np.all(fewest > few * (1 - 1e-9))
    assert small.certificate.ok and disk.certificate.ok
    weak = replace(small.blade, K=0.5 * small.blade.K)
    assert not replace(disk, sector=replace(small, blade=weak)).certificate.ok


@pytest.mark.long
def test_every_blade_may_be_another_one(model, full, small, disk):
    short = bladed_model(N, tip=0.15, **SIZES)
    (K, M), (K_short, M_short) = region(model, "blade"), region(short, "blade")
    changes = {1: (-0.2 * K, 0 * M), 3: (0.05 * K, 0.1 * M), 4: (K_short - K, M_short - M)}
    omega, Phi = whole_wheel(full, changes, 48)
    blades = [small.blade] * N
    blades[1] = small.blade.varied(stiffness=-0.2)
    blades[3] = small.blade.varied(stiffness=0.05, density=0.1)
    blades[4] = rom.reduced_blade(small, short, n_modes=25)
    found = disk.modes(blades)[0]
    assert_allclose(found[:36], omega[:36], rtol=1e-3)
    assert np.all(found[:36] > omega[:36] * (1 - 1e-9))
    fewer = rom.bladed_wheel(small, 12, n_root=18).modes(blades)[0]
    assert_allclose(fewer[:36], omega[:36], rtol=1e-3)
    at, force = tip_of(model) + np.arange(3), np.zeros(full.n)
    force[at] = 0.3, 0.2, 1.0
    sweep = np.linspace(0.9, 1.1, 801) * omega[2]
    drive = {"engine_order": ORDER, "damping": ZETA, "at": at}
    exact = response_of(full, (omega, Phi), force, sweep, **drive)
    drive["omega"] = sweep
    seen = disk.response(blades, force, **drive)
    assert_allclose(peaks(seen), peaks(exact), rtol=5e-3)
    again = disk.response(blades, [force] * N, **drive | {"at": [np.eye(full.n)[at]] * N})
    assert_allclose(again, seen, rtol=1e-9)
    tuned = peaks(disk.response([small.blade] * N, force, **drive))
    assert_allclose(tuned, tuned[0], rtol=1e-6)
    assert_allclose(disk.amplification(blades, force, **drive), peaks(seen).max() / tuned[0])


def test_cantilever_frequencies_that_deviate(model, full, small, disk):
    """K + g d(omega^2) g^T of all finite elements, with eta = g^T u: roots leave eta alone."""
    K, M = region(model, "blade")
    inner, nodes = cut(full.K, K, "blade")
    delta = np.array([0.04, -0.06, 0.0, 0.03])
    blade = small.blade.varied(cantilever=delta)
    assert_allclose(blade.omega[:4], (1 + delta) * small.blade.omega[:4])
    assert_allclose(blade.omega[4:], small.blade.omega[4:])
    root, phi = dofs_of(nodes), small.blade.Psi[:, small.root.size :][:, :4]
    follow = np.linalg.solve(K[inner][:, inner].toarray(), K[inner][:, root].toarray())
    G = np.zeros((full.n, 4))
    G[inner] = M[inner][:, inner] @ phi[inner]
    G[root] = follow.T @ G[inner]
    d = small.blade.omega[:4] ** 2 * ((1 + delta) ** 2 - 1)
    omega, _ = whole_wheel(full, {2: (csr_matrix(G * d @ G.T), 0 * M)}, 24)
    blades = [small.blade] * N
    blades[2] = blade
    assert_allclose(disk.modes(blades)[0][:24], omega, rtol=1e-3)
    tuned = disk.modes([small.blade] * N)[0]
    assert abs(omega / tuned[:24] - 1).max() > 0.01


@pytest.mark.long
def test_a_blade_that_lost_most_of_its_stiffness(full, small, disk):
    """Tuned modes do not contain what it does: a substructure does, and shows where it moves."""
    delta = np.zeros(N)
    delta[4] = -0.8
    omega, _ = whole_wheel(full, {4: (-0.8 * full.regions["blade"], 0 * full.M)}, 18)
    blades = [small.blade] * N
    blades[4] = small.blade.varied(stiffness=-0.8)
    apart = abs(disk.modes(blades)[0][:18] / omega - 1).max()
    by_tuned_modes = abs(rom.mistuned_wheel(full, 3).modes(delta)[0][:18] / omega - 1).max()
    assert apart < 3e-4
    assert by_tuned_modes > 0.03
    share = disk.energies(blades, 3)
    assert_allclose(share.sum(axis=1), 1.0)
    assert share[0, 4] > 0.9


def test_a_blade_of_another_mesh_fits_on_the_root(model, small, disk):
    finer = bladed_model(N, cells=(6, 2, 3, 3), blade=(2, 4))
    other = rom.reduced_blade(small, finer, n_modes=25)
    assert_allclose(other.omega[:8], small.blade.omega[:8], rtol=5e-3)
    tuned = disk.modes([small.blade] * N)[0]
    assert_allclose(disk.modes([other] * N)[0][:12], tuned[:12], rtol=2e-3)
    K, M = region(model, "blade")
    inner, nodes = cut(model.K, K, "blade")
    mine = np.union1d(inner, dofs_of(nodes))
    places = np.searchsorted(mine[::3] // 3, nodes)
    alone = rom.FEModel(K[mine][:, mine], M[mine][:, mine], model.points[mine[::3] // 3])
    alone = replace(alone, interfaces={"root": root_of(alone, places)})
    found = rom.reduced_blade(small, alone, n_modes=25, blade=None, root="root")
    for A, B in ((found.K, small.blade.K), (found.M, small.blade.M)):
        assert_allclose(abs(A), abs(B), atol=1e-6 * abs(B).max())
    assert_allclose(disk.modes([found] * N)[0], tuned, rtol=1e-6)


def test_wrong_arguments_are_named(model, full, small, disk):
    few, moved = {"n_modes": 2, "n_blade_modes": 2}, replace(model, points=model.points + 0.01)
    cut_off = partial(rom.substructured_sector, full, model, **few)
    refuses(ConfigError, r"no region 'wing'; it has \['blade', 'disk'\]", cut_off, blade="wing")
    refuses(ConfigError, "need the full sector", rom.substructured_sector, small, model, **few)
    refuses(InterfaceError, "'disk' reaches a cyclic face", cut_off, blade="disk")
    alone = {"n_modes": 2, "blade": None, "root": "foot"}
    refuses(InterfaceError, "no interface 'foot'", rom.reduced_blade, small, model, **alone)
    refuses(InterfaceError, r"root .* up to 0\.01 m", rom.reduced_blade, small, moved, n_modes=2)
    refuses(ConfigError, "each must be a number above -1", small.blade.varied, stiffness=-1.0)
    refuses(ConfigError, "26 deviations", small.blade.varied, cantilever=np.zeros(26))
    refuses(ConfigError, r"5 blades with .* not 6 of 57", disk.modes, [small.blade] * 5)
    refuses(ConfigError, "n_waves = 1000", rom.bladed_wheel, small, 1000)
    refuses(ConfigError, "n_root = 58", rom.bladed_wheel, small, 2, n_root=58)
    drive = {"engine_order": 1, "omega": [1.0], "damping": 1e-3, "at": [0]}
    alike, force = [small.blade] * N, np.zeros(full.n)
    for words, pushed in (
        ("not those of blade 0", force),
        ("3 forces on blade 0 for", np.ones(3)),
        ("2 forces or places for 6 blades", [force, force]),
        ("dofs of the disk", force + 1.0),
    ):
        refuses(ConfigError, words, disk.response, alike, pushed, **drive)
    there = drive | {"at": [tip_of(model)]}
    refuses(ConfigError, "does not move the tuned", disk.amplification, alike, force, **there)
    soft = replace(small.blade, K=-small.blade.K)
    refuses(ModelError, "without stiffness", disk.modes, [soft] * N)
