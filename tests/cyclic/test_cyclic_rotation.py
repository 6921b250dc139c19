"""Rotating wheels: Bryan's ring, Lamb and Southwell's disc, rigid motions, and the whole wheel."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eig, eigh
from scipy.sparse import block_diag, csr_matrix, diags, identity

import rom
from cases.long import MESHED
from cases.refusals import refuses
from cases.wheels import beam_ring, bladed_model, gathered, mass_ring
from rom.components.wheels.rotation import divergence_speed, rotation_matrices
from rom.components.wheels.sector import CyclicSector
from rom.errors import ConfigError, ModelError, ModesMissedError

N, SPEED = 6, 900.0
ALUMINIUM = rom.Material(E=70e9, nu=0.3, rho=2700.0)
SIZES = {"degree": 1, "cells": (4, 2, 2, 2), "material": ALUMINIUM}
needs_fenicsx = pytest.mark.fenicsx
pytestmark = MESHED[1:]  # of which some have finite elements


@pytest.mark.parametrize("n", [2, 3, 5])
@pytest.mark.parametrize("speed", [0.05, -0.05])
def test_waves_of_a_ring_split_as_bryan_found(n, speed):
    """Seen from the ring by 4 n Omega / (n^2 + 1); those that run back are the faster ones."""
    waves = rom.travelling_modes(beam_ring(24, 12, EA=1e6, rotary=1e-6), n, 2, speed=speed)
    assert list(waves.direction) == [1, -1]
    assert_allclose(np.diff(waves.omega), 4 * n * abs(speed) / (n**2 + 1), rtol=3e-3)
    assert waves.forward[0] < waves.backward[0]
    split = np.diff(waves.at_rest * 2 * np.pi)  # an observer at rest sees the others faster
    assert_allclose(split, -2 * n * abs(speed) + np.diff(waves.omega), rtol=1e-9)


def test_lumped_waves_are_the_spectrum_of_the_whole_ring():
    held = replace(beam_ring(6, 4, EA=1e3, rotary=0.1), held=np.array([0, 1]))
    K, M, G = (A.toarray() for A in held.wheel(held.coriolis))
    speed, one, zero = 0.8, np.eye(K.shape[0]), np.zeros(K.shape)
    companion = np.block([[zero, one], [-K, -speed * G]])
    whole = eig(companion, np.block([[one, zero], [zero, M]]), right=False)
    exact = np.sort(whole.imag[whole.imag > 0])
    found = [rom.travelling_modes(held, d, 8, speed=speed) for d in held.diameters]
    found = np.sort(np.concatenate([waves.omega for waves in found]))[:16]
    assert_allclose(found, exact[:16], rtol=1e-9)


def test_a_wheel_whose_support_softens_diverges():
    """Springs k against Omega^2 m: stiffness ends at sqrt(k / m)."""
    ring = mass_ring(6, k=4.0e4, m=0.4)
    at_rest = replace(ring, centrifugal=-ring.M, coriolis=csr_matrix((2, 2)))
    for n in (0, 2):
        exact = np.sqrt((4.0e4 + 4 * 0.7e5 * np.sin(np.pi * n / 6) ** 2) / 0.4)
        assert_allclose(divergence_speed(at_rest, n), exact, rtol=1e-9)
    assert divergence_speed(replace(at_rest, centrifugal=ring.M), 0) == np.inf
    slow, fast = 0.99 * np.sqrt(1e5), 1.01 * np.sqrt(1e5)
    assert rom.travelling_modes(at_rest, 0, 1, speed=slow).omega[0] > 0
    assert rom.cyclic_modes(at_rest, 0, 1, speed=slow).omega[0] > 0
    for call in (rom.travelling_modes, rom.cyclic_modes):
        said = r"319\.\d+ rad/s .*(instability|softening)"
        refuses(ModelError, said, call, at_rest, 0, 1, speed=fast)


@pytest.fixture(scope="module")
def model():
    return bladed_model(N, **SIZES)


@pytest.fixture(scope="module")
def whole():
    return bladed_model(N, N, **SIZES)


@needs_fenicsx
def test_a_free_wheel_floats_nods_and_precesses(model, whole):
    """Seen from the wheel, what rests in space circles back; the axis precesses as Euler says."""
    free = rom.rotating_sector(rom.CyclicSector.from_model(model), model)
    waves = rom.travelling_modes(free, 1, 4, speed=SPEED)
    A, _, C = np.sort(np.diag(rom.mass_properties(whole).inertia))
    assert_allclose(waves.omega[0], (C / A - 1) * SPEED, rtol=1e-5)
    assert list(waves.direction) == [1, -1, -1, -1]
    assert_allclose(waves.omega[1:], SPEED, rtol=1e-5)
    assert_allclose(waves.at_rest[2], 0.0, atol=1e-5 * SPEED)


@needs_fenicsx
def test_coriolis_and_cyclic_symmetry_are_the_whole_wheel(model, whole):
    """The whole wheel meshed; its stress and its motion from its own matrices."""
    sector = rom.rotating_sector(rom.CyclicSector.from_model(model, fixed=("bore",)), model)
    x, held = whole.points * (1, 1, 0), whole.interfaces["bore"].dofs
    free_dofs = np.setdiff1d(np.arange(whole.n_dofs), held)
    u = whole.operators.hold(held)((whole.M @ x.ravel())[:, None])[:, 0]
    G, soft = rotation_matrices(whole.M, np.array([0.0, 0.0, 1.0]))
    C = whole.stresses.prestress(u) - soft
    M, G, K = (A[free_dofs][:, free_dofs].toarray()
               for A in (whole.M, SPEED * G, whole.K + SPEED**2 * C))  # fmt: skip
    lam, Phi = eigh(K, M, subset_by_index=(0, 60))  # 60 modes hold the lowest waves to 1e-5
    G = Phi.T @ G @ Phi
    one, zero = np.eye(lam.size), np.zeros((lam.size, lam.size))
    exact = eig(np.block([[zero, one], [-np.diag(lam), -G]]), right=False).imag
    exact = np.sort(exact[exact > 0])[:18]
    found = [rom.travelling_modes(sector, d, 8, speed=SPEED).omega for d in sector.diameters]
    found = np.sort(np.concatenate(found))[:18]
    assert_allclose(found, exact, rtol=2e-5)
    assert_allclose(gathered(sector, 6, speed=SPEED)[:18], np.sqrt(lam[:18]), rtol=1e-9)


@needs_fenicsx
def test_a_reduced_wheel_rotates_like_the_full_one(model):
    sector = rom.rotating_sector(rom.CyclicSector.from_model(model, fixed=("bore",)), model)
    small = rom.reduce_sector(sector, n_modes=40, functions=rom.Polynomial(3))
    for n in (0, 1, 3):
        full, found = (rom.travelling_modes(s, n, 4, speed=5e3) for s in (sector, small))
        assert_allclose(found.omega, full.omega, rtol=2e-3)
        assert_allclose(found.direction, full.direction)


@needs_fenicsx
def test_a_membrane_spins_as_lamb_and_southwell_found():
    """omega^2 / Omega^2 for n diameters and s circles; a disc of 1/1000 has little else."""
    E, rho, nu = 200e9, 7800.0, 0.3
    speed = 0.05 * np.sqrt(E / rho)
    sizes = {"bore": 0.02, "rim": 1.0, "tip": 1.0, "width": 0.001, "cells": (3, 4, 0, 1)}
    model = bladed_model(8, material=rom.Material(E=E, nu=nu, rho=rho), **sizes)
    disc = rom.rotating_sector(rom.CyclicSector.from_model(model), model)
    for n, s, tolerance in ((0, 1, 0.01), (2, 0, 0.003), (3, 0, 0.01), (1, 1, 0.02)):
        exact = ((n + 2 * s) * (n + 2 * s + 2) * (3 + nu) - n**2 * (1 + 3 * nu)) / 8
        found = (rom.travelling_modes(disc, n, 8, speed=speed).omega / speed) ** 2
        assert_allclose(found[np.argmin(abs(found - exact))], exact, rtol=tolerance)


@needs_fenicsx
def test_only_solids_that_are_known_can_rotate(model):
    sector = rom.CyclicSector.from_model(model)
    bare, heavy = {"stresses": None}, {"attachments": (rom.Attachment("bore", 1.0),)}
    for change, words in ((bare, "no finite elements"), (heavy, "carries 1 attachments")):
        refuses(ConfigError, words, rom.rotating_sector, sector, replace(model, **change))


def test_a_missed_wave_is_noticed():
    from rom.components.wheels.travelling import _verify

    held = replace(beam_ring(6, 4, EA=1e3, rotary=0.1), held=np.array([0, 1]))
    T = held.harmonic(1)
    M, G, K = (csr_matrix(T.conj().T @ A @ T) for A in (held.M, held.coriolis, held.K))
    lam = np.array([1j, -1j]) * rom.travelling_modes(held, 1, 1, speed=1.0).omega[0]
    lam = np.r_[lam, lam * 30]
    shapes = np.eye(M.shape[0], 4, dtype=complex)
    refuses(ModesMissedError, "does not agree with", _verify, M, G, K, lam, shapes, 2)


C = 3.0
SPEEDS = np.linspace(0.0, 400.0, 9)


def two_rings():
    """Masses of 0.4 kg on springs, twice; centrifugal stress stiffens the softer ones."""
    rings = [mass_ring(N, k=3e5), mass_ring(N, k=4e5)]
    return CyclicSector(
        N, *(csr_matrix(block_diag([getattr(r, a) for r in rings])) for a in "KM"),
        np.array([1, 3]), np.array([0, 2]), identity(2, format="csr"), sprung=True,
        coriolis=csr_matrix((4, 4)), centrifugal=csr_matrix(diags([0.5 * C, 0.5 * C, 0.0, 0.0])),
    )  # fmt: skip


@pytest.mark.parametrize("n", [0, 2, 3])
def test_waves_that_cross_keep_their_columns(n):
    """omega^2 = (k + 4 c sin^2(pi n / N) + C Omega^2) / m of one ring, constant of the other."""
    waves = 2 if n in (0, 3) else 4
    found = rom.wheel_campbell(two_rings(), n, waves, speeds=SPEEDS)
    join = 4 * 0.7e5 * np.sin(np.pi * n / N) ** 2
    softer = np.sqrt((3e5 + join + C * SPEEDS**2) / 0.4)
    stiffer = np.sqrt((4e5 + join) / 0.4) + 0 * SPEEDS
    assert softer[0] < stiffer[0] and softer[-1] > stiffer[-1]
    exact = np.column_stack([softer, stiffer])
    both = [2 * np.pi * s for s in (found.forward, found.backward)]
    for side in [found.omega] if waves == 2 else both:
        assert_allclose(side, exact, rtol=1e-9)
    assert_allclose(found.mac, 1.0, rtol=1e-6)
    assert np.any(np.diff(found.omega[-1]) < 0)


def test_directions_start_together_and_part():
    ring = replace(beam_ring(6, 4, EA=1e3, rotary=0.1), held=np.array([0, 1]))
    found = rom.wheel_campbell(ring, 2, 4, speeds=[0.0, 0.05, 0.1])
    assert_allclose(found.forward[0], found.backward[0])
    last = rom.travelling_modes(ring, 2, 4, speed=0.1)
    assert_allclose(found.forward[-1], last.forward, rtol=1e-9)
    assert_allclose(found.backward[-1], last.backward, rtol=1e-9)
    assert abs(found.forward[-1] - found.backward[-1]).max() > 1e-4


def test_wrong_arguments_are_named():
    ring = beam_ring(6, 4)
    refuses(ConfigError, r"at rest use cyclic_modes", rom.travelling_modes, ring, 2, 2, speed=0.0)
    refuses(ConfigError, "n = 49", rom.travelling_modes, ring, 2, 49, speed=1.0)
    refuses(ConfigError, "no matrices", rom.travelling_modes, mass_ring(6), 2, 1, speed=1.0)
    loose = replace(mass_ring(6, k=0.0), centrifugal=csr_matrix((2, 2)))
    refuses(ModelError, "nothing holds", divergence_speed, loose, 0)
    for diameter, n, speeds, words in (
        (1, 2, [0.0, -1.0], "speeds = -1 must not be negative"),
        (1, 5, [0.0], "n = 5 must be a whole number from 1 to 4"),
        (4, 1, [0.0], "diameter = 4 must be a whole number from 0 to 3"),
    ):
        refuses(ConfigError, words, rom.wheel_campbell, two_rings(), diameter, n, speeds=speeds)
