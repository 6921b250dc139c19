"""Shafts of beams against shafts of solid finite elements, reduced on their journals and wheel."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

import rom
from cases.gear_unit import tilting
from cases.paths import ROOT
from cases.refusals import refuses
from rom.components import transmission
from rom.components.gear_mesh import GearPair, Mesh
from rom.components.journal_bearing import Groove, JournalBearing
from rom.components.transmission import Disc, Rotor, Shaft, SolidShaft, Transmission, rest
from rom.components.transmission.housing import motion_of
from rom.components.transmission.shaft import vibrations
from rom.errors import ModelError

pytestmark = pytest.mark.fenicsx
GEOMETRY = ROOT / "meshes" / "gear_shaft.geo"
STEEL = rom.Material(E=206e9, nu=0.3, rho=7850.0)
SEATS = {"journal_a": 0.05, "wheel": 0.17, "journal_b": 0.35}
RING = {"outer": 0.16, "inner": 0.04, "width": 0.03}
FILM = 5e7  # stiffness of the films [N/m]


@pytest.fixture(scope="module")
def solid():
    sizes = {"lc": 0.012, "b": 0.01, "l_j": 0.01}
    how = {"material": STEEL, "degree": 2, "order": 2, "parameters": sizes}
    model = rom.fe.model(GEOMETRY, **how)
    kinds = dict.fromkeys(SEATS, rom.FourierLegendre(2, 3))
    method = rom.CraigBampton(n_modes=20)
    return rom.reduce(model, method=method, interfaces=kinds, reference="mean-axis", certify=False)


@pytest.fixture(scope="module")
def beam(solid):
    """As thick as the solid, whose straight edges cut the circle: the same mass."""
    z = np.unique([0.0, 0.4, *SEATS.values(), *np.linspace(0, 0.4, 21)])
    wheel = seats_of(z)[1]
    d = np.sqrt(solid.mass / (7850 * np.pi / 4 * 0.4))
    assert d == pytest.approx(0.04, rel=0.025)
    return z, Shaft(z, d, [Disc.of_ring(wheel, **RING)])


def supported_solid(body):
    M, K = body.full_matrices()
    ring, R = Disc.of_ring(0, **RING), motion_of(body, "wheel")
    M = M + R.T @ np.diag([ring.mass] * 3 + [ring.diametral] * 2 + [ring.polar]) @ R
    R = np.vstack([motion_of(body, name)[:2] for name in ("journal_a", "journal_b")])
    return M, K + FILM * R.T @ R


def seats_of(z):
    return [int(np.argmin(np.abs(z - at))) for at in SEATS.values()]


def supported_beam(z, shaft):
    M, K, _ = shaft.matrices()
    for node in seats_of(z)[::2]:
        i = 6 * node
        K[[i, i + 1], [i, i + 1]] += FILM
    return M, K


@pytest.mark.long
def test_beam_and_solid_have_the_same_frequencies(solid, beam):
    M, K = supported_solid(solid)
    three = np.sqrt(np.abs(eigh(K, M, eigvals_only=True)))
    one = np.sqrt(np.abs(eigh(*supported_beam(*beam)[::-1], eigvals_only=True)))
    assert three[1] < 1e-2 * three[2] and one[1] < 1e-2 * one[2]  # free to slide and to spin
    assert_allclose(three[2:10], one[2:10], rtol=5e-3)


@pytest.mark.long
@pytest.mark.parametrize("speed", [200.0, 600.0])
def test_beam_and_solid_respond_alike_to_unbalance(solid, beam, speed):
    """In axes that spin, an unbalanced solid is at rest; the beam whirls in axes that do not."""
    ring, force = Disc.of_ring(0, **RING), 1e-4 * speed**2  # 1e-4 kg m on the wheel
    M, K = supported_solid(solid)
    R = motion_of(solid, "wheel")
    soft = np.diag([ring.mass] * 2 + [0] + [ring.diametral - ring.polar] * 2 + [0])
    # (6 + r, 6 + r) mass of the motion across the axis, which spinning about it softens
    d, J, S, I = solid.first_moment, solid.inertia, solid.S, solid.Ibar_kl
    rigid = np.zeros((6, 6))
    rigid[0, 0] = rigid[1, 1] = solid.mass
    rigid[0, 4] = rigid[4, 0] = d[2]
    rigid[1, 3] = rigid[3, 1] = -d[2]
    rigid[3, 3] = rigid[4, 4] = 0.5 * np.trace(J) - J[2, 2]  # integral of rho z^2
    elastic = np.vstack([S[0], S[1], 0 * S[0], -I[2, 1], I[2, 0], I[0, 1] - I[1, 0]])
    in_plane = np.block([[rigid, elastic], [elastic.T, solid.S_kl[0, 0] + solid.S_kl[1, 1]]])
    whole = K - speed**2 * (in_plane + R.T @ soft @ R)
    whole = whole + 1e9 * R[[2, 5]].T @ R[[2, 5]]  # neither slides nor spins
    x = np.linalg.solve(whole, force * R[0])
    z, shaft = beam
    M, K = supported_beam(z, shaft)
    G = shaft.matrices()[2]
    wheel = 6 * seats_of(z)[1]
    f = np.zeros(shaft.n, dtype=complex)
    f[wheel], f[wheel + 1] = force, -1j * force
    K[wheel + 2, wheel + 2] += 1e9
    K[wheel + 5, wheel + 5] += 1e9
    y = np.linalg.solve(K + 1j * speed * speed * G - speed**2 * M, f)
    for name, node in zip(SEATS, seats_of(z), strict=True):
        i = 6 * node
        assert abs(y[i]) == pytest.approx(abs(y[i + 1]))
        assert (motion_of(solid, name) @ x)[0] == pytest.approx(y[i].real, rel=0.01)


@pytest.fixture(scope="module")
def still(solid):
    return SolidShaft(solid, tuple(SEATS), [Disc.of_ring(1, **RING)])


def test_a_solid_shaft_knows_its_rigid_motions(solid, still):
    M, K, G = still.matrices()
    R = still.rigid()
    assert_allclose(K @ R, 0, atol=1e-9 * np.abs(K).max())
    for k, (name, z) in enumerate(SEATS.items()):
        expected = np.eye(6)
        expected[0, 4], expected[1, 3] = z, -z
        assert_allclose(still.rows(k) @ R, expected, atol=1e-6)
        assert solid.marker(name).point[2] == pytest.approx(z, abs=1e-6)
    ring = Disc.of_ring(1, **RING)
    J = R.T @ M @ R
    assert_allclose(np.diag(J)[:3], solid.mass + ring.mass, rtol=1e-9)
    polar = solid.inertia[2, 2] + ring.polar
    assert J[5, 5] == pytest.approx(polar, rel=1e-9)
    assert (R.T @ G @ R)[3, 4] == pytest.approx(polar, rel=2e-3)  # as a spinning disc
    assert_allclose(G, -G.T)


def test_a_solid_spins_as_a_beam_in_axes_that_do_not_spin(still, beam):
    z, shaft = beam
    found = []
    for model, nodes in ((still, range(3)), (shaft, seats_of(z))):
        M, K, G = model.matrices()
        for node in (nodes[0], nodes[2]):
            R = model.rows(node)[:2]
            K = K + FILM * R.T @ R
        values = np.sort(vibrations(M, 8000.0 * G, K)[0].imag)
        found.append(values[values > 100.0][:8])
    assert_allclose(found[0], found[1], rtol=5e-3)
    assert found[1][1] / found[1][0] > 1.02


def unit(shafts, nodes):
    loose = GearPair((24, 36), 4e-3, 0.03)
    pair = replace(loose, centre_distance=loose.distance + 5e-5)
    a, wheel, b = nodes
    loads, rotors = (np.pi / 2 - pair.alpha + np.pi, pair.alpha - np.pi / 2), []
    for shaft, load in zip(shafts, loads, strict=True):
        grooves = [Groove(load + side * np.pi / 2, np.radians(20)) for side in (1, -1)]
        held = JournalBearing(0.04, 0.025, 4e-5, grooves, cells=(60, 4))
        rotors.append(Rotor(shaft, wheel, {a: held, b: held}, end=a))
    return Transmission(*rotors, Mesh(pair, 15e9, damping=2e-6), 300.0, 60.0 * 36 / 24, 0.03)


def test_solids_rest_on_films_and_teeth_and_respond_to_the_mesh_as_beams_do(still, beam):
    z, shaft = beam
    states = rest(unit((shaft, shaft), seats_of(z))), rest(unit((still, still), range(3)))
    one, three = states
    for a, b in zip(one.forces.films, three.forces.films, strict=True):
        assert_allclose(b.force[:2], a.force[:2], rtol=0.01)
        assert_allclose(b.motion[:2], a.motion[:2], atol=0.005 * 4e-5)
    moved = [s.unit.wheels @ s.q for s in states]
    for at in ([0, 1, 6, 7], [5, 11]):
        assert_allclose(moved[1][at], moved[0][at], atol=0.01 * np.abs(moved[0][at]).max())
    given, taken, heat = three.powers
    # seats of solids move as rigid ones within 1e-6, see above
    assert given - taken - heat == pytest.approx(tilting(three), abs=2e-8 * given)
    one, three = (transmission.mesh_response(s, harmonics=3) for s in states)
    assert three.error_rms == pytest.approx(one.error_rms, rel=0.01)
    assert three.load_factor == pytest.approx(one.load_factor, rel=0.01)
    growth = [transmission.whirl(s).values[0] for s in states]
    assert growth[1].imag == pytest.approx(growth[0].imag, rel=0.01)
    assert transmission.simulate(states[1], periods=0.2, steps=100).balance < 1e-6


def test_a_body_that_is_not_round_and_a_disc_beyond_the_seats_are_refused(solid):
    bent = replace(solid, K=solid.K * np.where(np.arange(solid.n_modes) == 0, 1.2, 1.0))
    shaft, beyond = SolidShaft(bent, tuple(SEATS)), [Disc.of_ring(3, **RING)]
    refuses(ModelError, "is not round about its Z axis", shaft.matrices)
    refuses(ModelError, "from 0 to 2", SolidShaft, solid, tuple(SEATS), beyond)
