"""Blades as substructures of a wheel that turns or floats: the whole wheel of finite elements."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigvals
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import eigsh, splu

import rom
from cases.long import COARSE
from cases.refusals import refuses
from cases.wheels import bladed_model, tip_of
from rom.components.wheels.rotation import arms, rotation_matrices
from rom.components.wheels.sector import region
from rom.eigen.scipy import SciPyOperators
from rom.errors import ConfigError, ModelError

pytestmark = COARSE
N, ORDER, SPEED = 5, 2, 1500.0
SIZES = {"cells": (7, 2, 4, 1), "blade": (3, 4), "width": 0.01, "tip": 0.18}
ROOM = {"n_modes": 40, "n_blade_modes": 25, "functions": rom.Polynomial(6),
        "root": rom.Polynomial(4)}  # fmt: skip


@pytest.fixture(scope="module")
def model():
    return bladed_model(N, **SIZES)


@pytest.fixture(scope="module")
def full(model):
    return rom.rotating_sector(rom.CyclicSector.from_model(model, fixed=("bore",)), model)


@pytest.fixture(scope="module")
def small(full, model):
    return rom.substructured_sector(full, model, **ROOM)


@pytest.fixture(scope="module")
def disk(small):
    return rom.bladed_wheel(small, 12)


@pytest.fixture(scope="module")
def short():
    return bladed_model(N, **SIZES | {"tip": 0.17})


@pytest.fixture(scope="module")
def blades(small, short):
    soft, dense = small.blade.varied(stiffness=-0.2), small.blade.varied(density=0.15)
    return [small.blade, soft, dense, small.blade, rom.reduced_blade(small, short, n_modes=25)]


@pytest.fixture(scope="module")
def whole(model, full, short):
    """K at speed, M and G of all finite elements with these blades, and the stress of all."""
    own = {"plain": model, "short": short}
    parts = {name: {r: region(m, r) for r in ("disk", "blade")} for name, m in own.items()}
    names, stiff, dense = ["plain"] * 4 + ["short"], [1.0, 0.8, 1.0, 1.0, 1.0], [1, 1, 1.15, 1, 1]
    Ks, Ms = ([parts[m]["disk"][i] + x * parts[m]["blade"][i]
               for m, x in zip(names, (stiff, dense)[i], strict=True)] for i in (0, 1))  # fmt: skip
    # displacement of all sectors under centrifugal force, each in its own axes
    loads = [M @ arms(full, own[m].points).ravel() for M, m in zip(Ms, names, strict=True)]
    (before, after), (K,) = full.parts(), full.wheel(Ks)[2:]
    ahead, behind = ([(j + s * full.step) % N for j in range(N)] for s in (1, -1))
    f = [before.T @ loads[j] + after.T @ loads[behind[j]] for j in range(N)]
    a = splu(csc_matrix(K)).solve(np.concatenate(f)).reshape(N, -1)
    u = np.array([before @ a[j] + after @ a[ahead[j]] for j in range(N)])
    Gs, Cs = [], []
    for u_j, M, m, stiffness in zip(u, Ms, names, stiff, strict=True):
        G, softening = rotation_matrices(M, full.axis)
        stress = own[m].regions
        K_geo = stress["disk"].stresses.prestress(u_j)
        Cs.append(K_geo + stiffness * stress["blade"].stresses.prestress(u_j) - softening)
        Gs.append(G)
    _, _, K, M, G, C = full.wheel(Ks, Ms, Gs, Cs)
    return K + SPEED**2 * C, M, G


@pytest.mark.long
def test_equal_blades_are_the_travelling_waves_of_the_sector(model, small):
    n_waves = small.free.size - small.root.size - small.cantilever.size
    disk = rom.bladed_wheel(small, n_waves)
    omega, _ = disk.waves([small.blade] * N, speed=SPEED)
    found = [rom.travelling_modes(small, n, 12, speed=SPEED).omega for n in small.diameters]
    exact = np.sort(np.concatenate(found))
    assert_allclose(omega[:20], exact[:20], rtol=1e-8)
    waves = rom.travelling_modes(small, ORDER, 6, speed=SPEED)
    met, not_met = waves.backward[1], waves.forward[1]
    assert met / not_met > 1.0005
    sweep = 2 * np.pi * np.array([met, not_met])
    drive = {"engine_order": ORDER, "damping": 1e-6, "at": [tip_of(model)], "speed": SPEED}
    along = np.eye(1, model.n_dofs, tip_of(model) + 1)[0]
    found = abs(disk.response([small.blade] * N, along, omega=sweep, **drive))[:, 0, 0]
    assert found[0] > 100 * found[1]  # struts at rest seem to run back


@pytest.mark.long
def test_waves_of_a_wheel_of_different_blades_at_speed(disk, blades, whole):
    K, M, G = whole
    omega, Phi = SciPyOperators(K, M).modes(SciPyOperators(K, M).hold([]), 150)
    g, one = SPEED * (Phi.T @ (G @ Phi)), np.eye(150)
    lam = eigvals(np.block([[0 * one, one], [-np.diag(omega**2), -g]]))
    exact = np.sort(lam.imag[lam.imag > 0])
    found = disk.waves(blades, speed=SPEED)[0]
    assert_allclose(found[:20], exact[:20], rtol=2e-3)
    without = disk.modes(blades, speed=SPEED)[0]
    assert_allclose(without[:15] / found[:15], omega[:15] / exact[:15], rtol=3e-6)
    assert abs(without[:15] / found[:15] - 1).max() > 9e-4
    assert (without[:20] / disk.modes(blades)[0][:20] - 1).max() > 0.05


def test_forces_that_travel_around_a_turning_wheel(model, full, disk, blades, whole):
    """Undamped, below and between resonances: sparse solutions of the whole wheel."""
    K, M, G = whole
    force, at = np.zeros(full.n), tip_of(model) + np.arange(3)
    force[at] = 0.3, 0.2, 1.0
    rows = np.searchsorted(full.free, at)
    omega = disk.waves(blades, speed=SPEED)[0]
    sweep = np.r_[0.5 * omega[0], 0.5 * (omega[4] + omega[5])]
    drive = {"omega": sweep, "damping": 1e-12, "at": at, "speed": SPEED}
    for order in (ORDER, -ORDER):
        load = np.kron(np.exp(1j * order * full.angle * np.arange(N)), force[full.free])
        exact = [splu(csc_matrix(K - w**2 * M + 1j * w * SPEED * G)).solve(load) for w in sweep]
        exact = np.array(exact).reshape(sweep.size, N, -1)[:, :, rows]
        found = disk.response(blades, force, engine_order=order, **drive)
        assert_allclose(found[0], exact[0], atol=5e-3 * abs(exact[0]).max())
        assert_allclose(found[1], exact[1], atol=3e-2 * abs(exact[1]).max())
    near = drive | {"omega": omega[:1], "engine_order": ORDER}
    a, b = (disk.response(blades, force, **near | {"damping": z}) for z in (1e-4, 2e-4))
    assert_allclose(abs(a).max(), 2 * abs(b).max(), rtol=0.01)


def test_motion_at_rest_is_the_limit_of_slow_rotation(model, small, disk, blades):
    force = np.eye(1, model.n_dofs, tip_of(model) + 2)[0]
    drive = {"omega": disk.modes(blades)[0][:3], "damping": 1e-3, "at": [tip_of(model) + 2]}
    drive["engine_order"] = 1
    rest, slow = (disk.response(blades, force, speed=s, **drive) for s in (0.0, 1e-3))
    assert_allclose(slow, rest, rtol=1e-5)
    assert disk.amplification([small.blade] * N, force, speed=SPEED, **drive) == 1.0


def test_a_free_wheel_moves_rigidly_without_stiffness(model, full):
    """Six frequencies that are zero and not merely small; the others of the whole wheel."""
    free = rom.CyclicSector.from_model(model)
    small = rom.substructured_sector(free, model, **ROOM)
    disk = rom.bladed_wheel(small, 12)
    blades = [small.blade.varied(stiffness=-0.2)] + [small.blade] * (N - 1)
    omega, Phi = disk.modes(blades)
    assert np.all(omega[:6] == 0.0) and omega[6] > 1.0
    K, M = disk.matrices(blades)
    assert_allclose(Phi.T @ M @ Phi, np.eye(omega.size), atol=1e-8)
    assert_allclose(Phi.T @ K @ Phi, np.diag(omega**2), atol=1e-6 * omega[6] ** 2)
    fewer = rom.bladed_wheel(small, 12, n_root=20).modes(blades)[0]
    assert np.all(fewer[:6] == 0.0)
    assert_allclose(fewer[6:24], omega[6:24], rtol=1e-3)
    dK = -0.2 * region(model, "blade")[0]
    _, _, K, M = free.wheel([free.K + dK] + [free.K] * (N - 1), free.M)
    lam = np.sort(eigsh(K, 24, M, sigma=-1e6, return_eigenvectors=False))
    assert_allclose(omega[6:24], np.sqrt(lam[6:]), rtol=1e-3)
    assert rom.bladed_wheel(small, 12, n_root=1).rigid.shape[1] < 6
    words = "free wheel .* no modes at speed.*hold the disk"
    refuses(ConfigError, words, disk.modes, blades, speed=SPEED)


def test_wheels_that_cannot_turn_are_named(model, full, small, disk, short):
    alike, fast = [small.blade] * N, {"speed": SPEED}
    at_rest = replace(small.blade, coriolis=None, centrifugal=None)
    says, still = "has no matrices of rotation", replace(disk, coriolis=None)
    two = [*alike[:2], at_rest, *alike[3:]]
    refuses(ConfigError, f"the blade 2 {says}", disk.modes, two, **fast)
    refuses(ConfigError, f"the disk {says}", still.waves, alike, **fast)
    refuses(ConfigError, "speed = inf", disk.modes, alike, speed=np.inf)
    stressed, own = replace(full, K=1.001 * full.K), "of its finite elements: .*heated_sector"
    refuses(ConfigError, own, rom.substructured_sector, stressed, model, **ROOM)
    softer = replace(disk, centrifugal=-disk.M)
    refuses(ModelError, r"at 50000 rad/s .* above its instability", softer.modes, alike, speed=5e4)
    bare = replace(short, regions={"blade": replace(short.regions["blade"], stresses=None)})
    refuses(ConfigError, "blade has no finite elements", rom.reduced_blade, small, bare, n_modes=2)
