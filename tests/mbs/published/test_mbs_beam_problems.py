"""Slender bodies in large motion: a bending pendulum, and the Princeton beam made of pieces."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.beam import elastica, gauss_hermite, stiffened_beam
from cases.mbs.mechanisms import nodal_body
from rom.mbs.mechanism import Mechanism

X, Y, Z = np.eye(3)


def test_a_pendulum_that_bends_swings_as_its_exact_beam():
    """Released in the horizontal; tip of a spectral, geometrically exact beam, good to 1e-4 m."""
    width, height, E, rho = 0.02, 0.01, 2e9, 1200.0
    body = stiffened_beam(1.0, E * width * height**3 / 12, rho * width * height, n_modes=8)
    mech = Mechanism(gravity=(0, -9.81, 0))
    beam = mech.add_flexible("beam", body)
    mech.revolute("pin", mech.ground.marker((0, 0, 0)), beam.marker("root"), axis=Z)
    sol = rom.simulate(mech, t_end=1.5, dt=5e-4)
    exact = {0.2: (0.95753, -0.28832), 0.3: (0.79539, -0.60609), 0.5: (-0.08883, -0.99605),
             1.0: (-0.99997, -0.0066), 1.5: (0.2640, -0.9645)}  # fmt: skip
    for t, tip in exact.items():
        assert_allclose(sol.position("beam", "tip")[round(t / 5e-4), :2], tip, atol=2e-4)


def hinged_blade(eta, axis):
    """A beam on a hinge about z, on the axle of a hub that turns with the speed eta."""
    mech = Mechanism(gravity=(0, 0, 0))
    turn = eta * axis
    blade = mech.add_flexible("blade", stiffened_beam(), omega=turn)
    hub = mech.add_rigid("hub", mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0), omega=turn)
    mech.revolute("axle", mech.ground.marker((0, 0, 0)), hub.marker((0, 0, 0)), axis=axis)
    mech.revolute("hinge", hub.marker((0, 0, 0)), blade.marker("root"), axis=Z)
    mech.drive("motor", "axle", lambda t: eta * t, rate=lambda t: eta, acceleration=lambda t: 0)
    return 2 * np.pi * rom.linearize(mech).frequencies


@pytest.mark.parametrize(
    ("eta", "second"), [(1, 15.6242415), (5, 19.9196616), (10, 29.4439267), (12, 33.7603013)]
)
def test_a_hinged_blade_flaps_once_a_turn_and_bends_faster(eta, second):
    """Centrifugal force returns a rigid motion about the hinge with the speed itself.

    In the plane of rotation nothing returns it, and bending loses the square of the speed.
    """
    flap = hinged_blade(eta, Y)
    assert_allclose(flap[:2], [eta, second], rtol=2e-5)
    lag = hinged_blade(eta, Z)
    assert_allclose(lag[1] ** 2, second**2 - eta**2, rtol=4e-5)
    assert lag[0] < 1e-4 * eta


# Dowell, Traybar, Hodges: An experimental-theoretical correlation study of nonlinear bending and
# torsion deformations of a cantilever beam (J. Sound Vib. 50, 1977, 533)
LENGTH, DEPTH, THIN, E = 0.508, 12.377e-3, 3.2024e-3, 71.7e9
STIFF, SOFT = E * THIN * DEPTH**3 / 12, E * DEPTH * THIN**3 / 12


def piece(length, EI):
    """A beam along x that bends along y, its frame on the root: two cubic shapes, exact statics."""
    x, weight, values, _ = gauss_hermite(1, length)
    phi = np.zeros((2, x.size, 3))
    phi[:, :, 1] = values[:, 2:].T
    K = EI / length**3 * np.array([[12, -6 * length], [-6 * length, 4 * length**2]])
    T, R, none = np.zeros((3, 2)), np.zeros((3, 2)), np.zeros((3, 2))
    T[1, 0], R[2, 1] = 1.0, 1.0
    points = np.column_stack([x, 0 * x, 0 * x])
    points[:, 2] = 1e-3 * (-1.0) ** np.arange(x.size)
    markers = {"root": (0 * X, none, none), "tip": (length * X, T, R)}
    return nodal_body(points, np.diag(weight), phi, K, markers=markers)


def pieces_under_load(n, EI, load):
    """(2,) deflection of the tip across and along of a cantilever of n pieces."""
    mech = Mechanism(gravity=(0, 0, 0))
    last, body = mech.ground.marker((0, 0, 0)), piece(LENGTH / n, EI)
    for k in range(n):
        part = mech.add_flexible(f"piece {k}", body, at=LENGTH * k / n * X)
        mech.fixed(f"joint {k}", last, part.marker("root"))
        last = part.marker("tip")
    mech.force("load", last, lambda t: (0.0, load * t, 0.0))
    state = rom.equilibrium(mech, t=1.0, steps=4)
    run = rom.simulate(mech, t_end=1.0 + 1e-6, dt=1e-6, state=state)
    return run.position(f"piece {n - 1}", "tip")[0, [1, 0]] - [0, LENGTH]


@pytest.mark.filterwarnings("ignore:.*left the range of small elastic deformation")
@pytest.mark.parametrize(
    ("EI", "load", "published"),
    [(SOFT, 8.896, 0.146246), (SOFT, 13.345, 0.200678), (STIFF, 8.896, 0.010714)],
)
def test_the_princeton_beam_of_one_piece_is_linear_and_of_many_is_not(EI, load, published):
    """A reduced body is linear; in series they converge with order two to large deflections."""
    assert_allclose(
        pieces_under_load(1, EI, load), [load * LENGTH**3 / (3 * EI), 0.0], rtol=1e-9, atol=1e-12
    )
    _, along, across = elastica(load * LENGTH**2 / EI)
    exact = LENGTH * np.array([across, along - 1.0])
    four, eight = (pieces_under_load(n, EI, load) for n in (4, 8))
    assert_allclose(exact[0], published, rtol=6e-4)  # published with shear
    assert_allclose((four - exact) / (eight - exact), [4.0, 4.0], atol=0.5)
    assert_allclose((4 * eight - four) / 3, exact, atol=3e-4 * LENGTH)
