"""Shafts of beams against shafts of solid finite elements, reduced on their journals and wheel."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

import rom
from rom.components.transmission import Disc, Shaft

pytest.importorskip("gmsh", reason="gmsh is not installed")
pytestmark = pytest.mark.fenicsx
MESHES = Path(__file__).parents[1] / "meshes"
STEEL = rom.Material(E=206e9, nu=0.3, rho=7850.0)
SEATS = {"journal_a": 0.05, "wheel": 0.17, "journal_b": 0.35}
RING = {"outer": 0.16, "inner": 0.04, "width": 0.03}
FILM = 5e7  # stiffness of the films [N/m]


@pytest.fixture(scope="module")
def solid():
    model = rom.fe.model(
        MESHES / "gear_shaft.geo",
        material=STEEL,
        degree=2,
        parameters={"lc": 0.012, "b": 0.01, "l_j": 0.01},
        order=2,
    )
    kinds = dict.fromkeys(SEATS, rom.FourierLegendre(2, 3))
    method = rom.CraigBampton(n_modes=20)
    return rom.reduce(model, method=method, interfaces=kinds, reference="mean-axis", certify=False)


@pytest.fixture(scope="module")
def beam(solid):
    """As thick as the solid, whose straight edges cut the circle: the same mass."""
    z = np.unique([0.0, 0.4, *SEATS.values(), *np.linspace(0, 0.4, 21)])
    wheel = int(np.argmin(np.abs(z - SEATS["wheel"])))
    d = np.sqrt(solid.mass / (7850 * np.pi / 4 * 0.4))
    assert d == pytest.approx(0.04, rel=0.025)
    return z, Shaft(z, d, [Disc.of_ring(wheel, **RING)])


def rows(body, name):
    """(6, 6 + r) mean motion of a seat."""
    marker = body.marker(name)
    x, y, z = marker.point
    arm = np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])
    rigid = np.block([[np.eye(3), arm], [np.zeros((3, 3)), np.eye(3)]])
    return np.hstack([rigid, np.vstack([marker.translation, marker.rotation])])


def supported_solid(body):
    """Mass and stiffness with the ring and the films."""
    M, K = body.full_matrices()
    ring = Disc.of_ring(0, **RING)
    R = rows(body, "wheel")
    M = M + R.T @ np.diag([ring.mass] * 3 + [ring.diametral] * 2 + [ring.polar]) @ R
    for name in ("journal_a", "journal_b"):
        R = rows(body, name)[:2]
        K = K + FILM * R.T @ R
    return M, K


def supported_beam(z, shaft):
    M, K, _ = shaft.matrices()
    for name in ("journal_a", "journal_b"):
        i = 6 * int(np.argmin(np.abs(z - SEATS[name])))
        K[[i, i + 1], [i, i + 1]] += FILM
    return M, K


def test_beam_and_solid_have_the_same_frequencies(solid, beam):
    M, K = supported_solid(solid)
    three = np.sqrt(np.abs(eigh(K, M, eigvals_only=True)))
    one = np.sqrt(np.abs(eigh(*supported_beam(*beam)[::-1], eigvals_only=True)))
    assert three[1] < 1e-2 * three[2] and one[1] < 1e-2 * one[2]  # free to slide and to spin
    assert_allclose(three[2:10], one[2:10], rtol=5e-3)


def in_plane(body):
    """(6 + r, 6 + r) mass of the motion across the axis, which spinning about it softens."""
    m, d, J = body.mass, body.first_moment, body.inertia
    second = 0.5 * np.trace(J) * np.eye(3) - J  # integral of rho x x^T
    rigid = np.zeros((6, 6))
    rigid[0, 0] = rigid[1, 1] = m
    rigid[0, 4] = rigid[4, 0] = d[2]
    rigid[1, 3] = rigid[3, 1] = -d[2]
    rigid[3, 3] = rigid[4, 4] = second[2, 2]
    S, I = body.S, body.Ibar_kl
    elastic = np.vstack([S[0], S[1], 0 * S[0], -I[2, 1], I[2, 0], I[0, 1] - I[1, 0]])
    return np.block([[rigid, elastic], [elastic.T, body.S_kl[0, 0] + body.S_kl[1, 1]]])


@pytest.mark.parametrize("speed", [200.0, 600.0])
def test_beam_and_solid_respond_alike_to_unbalance(solid, beam, speed):
    """In axes that spin, an unbalanced solid is at rest; the beam whirls in axes that do not."""
    ring, force = Disc.of_ring(0, **RING), 1e-4 * speed**2  # 1e-4 kg m on the wheel
    M, K = supported_solid(solid)
    R = rows(solid, "wheel")
    soft = np.diag([ring.mass] * 2 + [0] + [ring.diametral - ring.polar] * 2 + [0])
    whole = K - speed**2 * (in_plane(solid) + R.T @ soft @ R)
    hold = rows(solid, "wheel")[[2, 5]]  # neither slides nor spins
    whole = whole + 1e9 * hold.T @ hold
    x = np.linalg.solve(whole, force * R[0])
    z, shaft = beam
    M, K = supported_beam(z, shaft)
    G = shaft.matrices()[2]
    wheel = 6 * int(np.argmin(np.abs(z - SEATS["wheel"])))
    f = np.zeros(shaft.n, dtype=complex)
    f[wheel], f[wheel + 1] = force, -1j * force
    K[wheel + 2, wheel + 2] += 1e9
    K[wheel + 5, wheel + 5] += 1e9
    y = np.linalg.solve(K + 1j * speed * speed * G - speed**2 * M, f)
    for name, at in SEATS.items():
        i = 6 * int(np.argmin(np.abs(z - at)))
        assert abs(y[i]) == pytest.approx(abs(y[i + 1]))
        assert (rows(solid, name) @ x)[0] == pytest.approx(y[i].real, rel=0.01)


def test_seats_that_overlap_are_refused():
    with pytest.raises(rom.RomError, match="must lie apart"):
        rom.fe.model(MESHES / "gear_shaft.geo", material=STEEL, parameters={"z_w": 0.06})
