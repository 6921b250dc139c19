"""Wheels of equal sectors: closed forms, the assembled wheel, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh
from scipy.sparse import csr_matrix, identity

import rom
from cases.refusals import refuses
from cases.solid import block
from cases.wheels import beam_ring, gathered, mass_ring, ring_frequency
from rom.components.wheels.faces import interpolation, paired, turned
from rom.errors import ConfigError, InterfaceError
from rom.model import Interface

SOFT = {"EA": 1e3, "rotary": 0.1}  # frequencies close together, so that all have many digits
Z, ORIGIN = np.array([0.0, 0.0, 1.0]), np.zeros(3)


@pytest.mark.parametrize("N", [2, 3, 7, 12])
def test_a_ring_of_masses_has_the_frequencies_of_its_waves(N):
    ring = mass_ring(N)
    for n in ring.diameters:
        exact = np.sqrt((3.0e5 + 4 * 0.7e5 * np.sin(np.pi * n / N) ** 2) / 0.4)
        assert_allclose(rom.cyclic_modes(ring, n, 1).omega, [exact], rtol=1e-12)


@pytest.mark.parametrize("n", [2, 3, 5, 8])
def test_a_thin_ring_vibrates_as_love_says(n):
    """192 straight beams, masses in their nodes: 1e-3 from the smooth ring."""
    found = rom.cyclic_modes(beam_ring(), n, 1).omega[0]
    assert_allclose(found, ring_frequency(n, 1.0, 1.0, 1.0), rtol=4e-4)


@pytest.mark.parametrize("N", [2, 5, 6])
def test_sectors_know_all_frequencies_of_the_wheel(N):
    ring = beam_ring(N, per_sector=5, **SOFT)
    K, M = (A.toarray() for A in ring.wheel())
    whole = np.sqrt(np.maximum(eigh(K, M, eigvals_only=True), 0.0))
    found = gathered(ring, ring.free.size)
    assert found.size == whole.size == ring.n_wheel
    assert_allclose(found[3:], whole[3:], rtol=1e-8)
    assert found[:3].max() < 1e-5 * found[3]


def test_shapes_are_modes_of_the_wheel():
    """Expanded to all sectors they are orthonormal, a quarter wave apart as well."""
    ring = beam_ring(5, per_sector=4, **SOFT)
    K, M = ring.wheel()
    for n in (0, 1, 2):
        modes = rom.cyclic_modes(ring, n, 6)
        waves = [modes.on_wheel(phase) for phase in (0.0, np.pi / 2)[: modes.multiplicity]]
        Phi = np.hstack([u[:, ring.free].reshape(-1, 6) for u in waves])
        lam = np.tile(modes.omega**2, modes.multiplicity)
        assert_allclose(Phi.T @ M @ Phi, np.eye(Phi.shape[1]), atol=1e-9)
        assert_allclose(K @ Phi, M @ Phi * lam, atol=1e-7 * lam.max() * abs(M @ Phi).max())
        T = ring.harmonic(n)
        assert_allclose(T @ modes.shapes[ring.free], modes.shapes, atol=1e-12)


def test_the_slave_may_be_either_face():
    ring = beam_ring(6, per_sector=4, **SOFT)
    turned_round = {"slave": ring.master, "master": ring.slave, "step": -1}
    other = replace(ring, coupling=csr_matrix(ring.coupling.T), **turned_round)
    for n in ring.diameters:
        one, two = (rom.cyclic_modes(r, n, 5).omega for r in (ring, other))
        assert_allclose(one, two, rtol=1e-9, atol=1e-5)


def test_held_dofs_stay_on_both_faces():
    """A ring held at one node of each sector is N clamped arcs, alike for all diameters."""
    ring = replace(beam_ring(6, per_sector=4, **SOFT), held=np.array([0, 1, 2]))
    clamped = [rom.cyclic_modes(replace(ring, held=np.r_[0:3, 12:15]), n, 4).omega for n in (0, 3)]
    for n in ring.diameters:
        modes = rom.cyclic_modes(ring, n, 4)
        assert_allclose(modes.omega, clamped[0], rtol=1e-9)
        assert not modes.shapes[[0, 1, 2, 12, 13, 14]].any()
    assert_allclose(*clamped, rtol=1e-9)


def face(name, angle, n=6, size=(0.1, 0.05), about=Z, at=ORIGIN):
    """A radial face of n x n nodes from radius 0.2, turned about the axis."""
    r, z = np.meshgrid(np.linspace(0.2, 0.2 + size[0], n), np.linspace(0.0, size[1], n))
    points = np.column_stack([r.ravel(), 0 * r.ravel(), z.ravel()])
    points = points @ turned(about, np.radians(angle)).T + at
    weights = np.outer(*[np.r_[0.5, np.ones(n - 2), 0.5]] * 2).ravel() / (n - 1) ** 2
    S = csr_matrix(np.diag(weights * size[0] * size[1]))
    return Interface(name, np.arange(n * n) + (0 if name == "low" else 1000), points, S, points[0])


@pytest.mark.parametrize(("angle", "N"), [(30.0, 12), (-45.0, 8), (180.0, 2), (10.0, 36)])
def test_the_number_of_sectors_follows_from_the_faces(angle, N):
    pair = paired(face("low", 0.0), face("high", angle), Z, ORIGIN)
    assert (pair.n_sectors, pair.matching) == (N, True)
    assert (pair.weights != identity(36)).nnz == 0


@pytest.mark.parametrize("finer", ["low", "high"])
@pytest.mark.parametrize("angle", [30.0, -30.0])
def test_the_finer_face_follows_the_coarser(finer, angle):
    n = {"low": 6, "high": 6} | {finer: 9}
    faces = [face("low", 0.0, n["low"]), face("high", angle, n["high"])]
    pair = paired(*faces, Z, ORIGIN)
    assert (pair.slave.name, pair.matching) == (finer, False)
    R = turned(Z, pair.step * np.pi / 6)
    assert_allclose(pair.weights @ pair.master.points @ R.T, pair.slave.points, atol=1e-12)


def test_interpolation_is_exact_for_quadratic_fields_on_any_plane():
    rng = np.random.default_rng(1)
    frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    nodes, targets = (rng.uniform(-1, 1, (k, 2)) @ frame[:2] for k in (60, 30))
    x = frame[:2].T
    field = lambda p: 1 + (p @ x)[:, 0] - 2 * (p @ x)[:, 1] ** 2 + (p @ x).prod(axis=1)  # noqa: E731
    assert_allclose(interpolation(nodes, targets) @ field(nodes), field(targets), atol=1e-9)
    assert_allclose(interpolation(nodes, nodes).toarray(), np.eye(60), atol=1e-9)


def test_faces_that_cannot_close_a_wheel_and_wrong_arguments_are_named():
    for high, message in (
        (face("high", 37.0), r"enclose 37 degrees, .* 360 degrees hold 9\.72973 sectors"),
        (face("high", 0.0), "does not divide the circle"),
        (face("high", 30.0, size=(0.1, 0.08)), "areas are 0.005 and 0.008 m"),
        (face("high", 30.0, at=np.array([0, 0, 0.02])), "do not match"),
        (face("high", 30.0, at=np.array([-0.2 * 0.75**0.5, -0.1, 0])), "lie on the axis"),
    ):
        refuses(InterfaceError, message, paired, face("low", 0.0), high, Z, ORIGIN)
    ring, model = mass_ring(6), block()
    refuses(ConfigError, "diameter = 4 must", rom.cyclic_modes, ring, 4, 1)
    refuses(ConfigError, "n = 2 must be a whole number from 1 to 1", rom.cyclic_modes, ring, 1, 2)
    refuses(ConfigError, "no matrices of rotation", rom.cyclic_modes, ring, 1, 1, speed=10.0)
    refuses(ConfigError, "n_sectors = 1 must be a whole number of 2", mass_ring, 1)
    refuses(InterfaceError, "both cyclic faces", replace, ring, slave=np.array([0]))
    refuses(ConfigError, "coupling has shape", lambda: replace(ring, coupling=identity(2)))
    refuses(InterfaceError, "no interface 'cyclic_low'", rom.CyclicSector.from_model, model)
    made, faces = rom.CyclicSector.from_model, {"low": "root", "high": "tip"}
    refuses(ConfigError, "length zero", made, model, **faces, axis=(0, 0, 0))
    refuses(InterfaceError, "does not divide", made, model, **faces, at=(0.3, -2.0, 0))
