"""Stiffening of moving bodies: published beams, exact balances, and beams made of pieces."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

import rom
from cases.beam import FLAP, FLAP_ON_HUB, elastica, gauss_hermite, spin_up, stiffened_beam
from cases.mbs import mechanisms
from cases.mbs.mechanisms import nodal_body, random_body, random_pose, simulate_quietly
from cases.mbs.parts import X, Y, Z, on_axle
from cases.refusals import refuses
from rom.body.stiffening import SecondOrder
from rom.eigen.verbs import rigid_motions
from rom.errors import ConfigError, RomWarning
from rom.mbs.mechanism import Mechanism

EXACT = {"method": "dop853", "rtol": 1e-10, "atol": 1e-12}
# Kane, Ryan and Banerjee, Dynamics of a cantilever beam attached to a moving base, J. Guid. Control
# Dyn. 10 (1987) 139; the beam of Wu and Haug. Extremes from a spectral beam theory.
KRB = {"length": 10.0, "EI": 1.4e4, "rhoA": 1.2, "n_modes": 4}
WU = {"length": 8.0, "EI": 6.8952e10 * 8.2181e-9, "rhoA": 2766.67 * 7.2968e-5, "n_modes": 4}
# Dowell, Traybar, Hodges: An experimental-theoretical correlation study of nonlinear bending and
# torsion deformations of a cantilever beam (J. Sound Vib. 50, 1977, 533)
LENGTH, DEPTH, THIN, E = 0.508, 12.377e-3, 3.2024e-3, 71.7e9
STIFF, SOFT = E * THIN * DEPTH**3 / 12, E * DEPTH * THIN**3 / 12


@pytest.mark.parametrize("eta", FLAP)
def test_rotating_beam_has_the_published_frequencies(eta):
    """Flapwise about y, lag about z: the squares differ by that of the speed."""
    beam = stiffened_beam()
    flap = 2 * np.pi * beam.rotating_frequencies(eta, (0, 1, 0), fixed=("root",))
    assert_allclose(flap[:3], FLAP[eta][:3], rtol=5e-6)
    lag = 2 * np.pi * beam.rotating_frequencies(eta, (0, 0, 1), fixed=("root",))
    assert_allclose(lag[:3] ** 2, flap[:3] ** 2 - eta**2, rtol=1e-9)


@pytest.mark.parametrize("eta", FLAP_ON_HUB)
def test_a_hub_as_long_as_the_beam_stiffens_it_more(eta):
    beam = stiffened_beam()
    flap = 2 * np.pi * beam.rotating_frequencies(eta, (0, 1, 0), fixed=("root",), at=(-1, 0, 0))
    assert_allclose(flap[:2], FLAP_ON_HUB[eta], rtol=5e-6)


def test_supports_share_the_pull_of_a_body_between_them():
    """Held at both ends, and at both ends of a rotor as long as the beam: symmetric or not."""
    beam = stiffened_beam(n_modes=80)
    at_rest = 2 * np.pi * beam.rotating_frequencies(0, (0, 1, 0), fixed=("root", "tip"))
    assert_allclose(at_rest[:2], (22.37328, 61.67282), rtol=1e-5)
    # the tip gives no axial motion without axial shapes: all of the tension comes from the root
    held = 2 * np.pi * beam.rotating_frequencies(3, (0, 1, 0), fixed=("root", "tip"))
    assert at_rest[0] ** 2 < held[0] ** 2 < at_rest[0] ** 2 + 12.3 * 9 / 2


def test_spin_up_of_kane_ryan_and_banerjee():
    """Deflection and foreshortening of the geometrically exact beam, residual motion.

    The consistent linear theory bends to -0.57438 on axes of the root, to -0.57356 on mean axes.
    """
    sol, u, v = spin_up(stiffened_beam(**KRB | {"n_modes": 8}), 6.0, 18.0, dt=2.5e-3)
    assert_allclose(v.min(), -0.57379, atol=2.5e-4)
    assert_allclose(sol.t[v.argmin()], 6.76, atol=0.01)
    exact = (-0.15128, -0.46845, -0.55905, -0.36277, -0.11268, 0.00129)
    seen = [np.argmin(np.abs(sol.t - t)) for t in (2.5, 5.0, 7.5, 10.0, 12.5, 15.0)]
    assert_allclose(v[seen], exact, atol=2.5e-4)
    assert_allclose(v[sol.t > 15].max(), 3.64e-3, atol=3e-5)
    assert_allclose(u.min(), -0.01882, atol=1e-4)
    assert rom.audit(sol).ok, rom.audit(sol)


@pytest.mark.parametrize(
    ("speed", "extreme", "time", "atol"), [(6.0, -0.75062, 6.54, 8e-4), (2.0, -0.28015, 7.02, 1e-4)]
)
def test_spin_up_of_the_beam_of_wu_and_haug(speed, extreme, time, atol):
    """The geometrically exact beam, bent by 9 and 4 % of its length."""
    sol, _, v = spin_up(stiffened_beam(**WU), speed, 9.0, dt=0.01)
    assert_allclose(v.min(), extreme, atol=atol)
    assert_allclose(sol.t[v.argmin()], time, atol=0.03)


def test_without_geometric_stiffness_the_beam_goes_astray_and_says_so():
    """Where the exact one comes back, to -0.363 after 10 s, it bends on."""
    with pytest.warns(RomWarning) as said:
        sol, _, v = spin_up(stiffened_beam(stiffened=False, **KRB), 6.0, 10.0)
    assert v[-1] < 1.4 * -0.36277
    messages = "\n".join(str(w.message) for w in said)
    assert "at 3.8 rad/s centrifugal force has used up the stiffness" in messages
    failed = [row.quantity for row in rom.audit(sol).failures]
    assert "speed of beam / speed that softens it to nothing" in failed


def test_another_frame_is_stiffened_by_the_reaction_of_the_base():
    """Away from its base the beam feels the pull of the joint instead of the acceleration."""
    body = stiffened_beam(**KRB | {"n_modes": 3})
    _, u, v = spin_up(body, 6.0, 8.0, dt=0.02, save_every=5)
    free = body.with_reference("mean-axis")
    assert "root f_x" in free.K_geo and "a_x" not in free.K_geo
    _, u_free, v_free = spin_up(free, 6.0, 8.0, dt=0.02, save_every=5)
    assert_allclose(v_free, v, atol=1e-9)
    assert_allclose(u_free, u, atol=1e-9)


@pytest.mark.parametrize("tension", [-0.8, 2.0])
def test_a_force_at_the_tip_changes_the_frequency(tension):
    """Dead axial force, compression up to Euler's load: the marker moves by the foreshortening."""
    body, load = stiffened_beam(n_modes=3), tension * np.pi**2 / 4
    lam, V = eigh(body.K + load * body.K_geo["tip f_x"], body.M)
    mech = Mechanism(gravity=(0, 0, 0))
    beam = mech.add_flexible("beam", body, q=1e-4 * V[:, 0])
    mech.fixed("clamp", mech.ground.marker((0, 0, 0)), beam.marker("root"))
    mech.force("pull", beam.marker("tip"), (load, 0, 0))
    period = 2 * np.pi / np.sqrt(lam[0])
    exact = EXACT | {"rtol": 1e-12, "atol": 1e-15}
    sol = rom.simulate(mech, t_end=2 * period, dt=period / 100, **exact)
    assert_allclose(sol.position("beam", "tip")[:, 1],
                    1e-4 * V[:, 0] @ body.marker("tip").translation[1]
                    * np.cos(2 * np.pi * sol.t / period), atol=2e-9)  # fmt: skip
    e = sol.energy
    assert np.abs(e.balance).max() < 1e-6 * np.abs(e.forces).max()


def test_energy_and_momentum_of_a_stiffened_free_body_are_exact():
    rng = np.random.default_rng(3)
    body = random_body(rng, damped=False, stiffened=True)
    mech = Mechanism(gravity=(0, 0, 0))
    mech.add_flexible(
        "one", body, velocity=(1, 2, -1), omega=(2.0, -1.0, 1.0), q=0.05 * rng.normal(size=4),
        qd=rng.normal(size=4),
    )  # fmt: skip
    sol = simulate_quietly(mech, t_end=1.0, dt=0.05, assemble=False, **EXACT)
    assert np.ptp(sol.energy.strain) > 1e-2 * sol.energy.kinetic[0]
    assert np.ptp(sol.energy.total) < 1e-8 * sol.energy.kinetic[0]
    for momentum in sol.momentum:
        assert_allclose(momentum, momentum[[0]].repeat(len(sol.t), axis=0), atol=1e-7)


def without_rigid(nodes, fields):
    """Fields (..., n, 3) of nodes without their mean motion, weighted with the mass."""
    x, Ms = nodes[:2]
    M, R = np.kron(Ms, np.eye(3)), rigid_motions(x)
    flat = fields.reshape(-1, x.size)
    mean = np.linalg.solve(R.T @ M @ R, R.T @ M @ flat.T)
    return (flat - (R @ mean).T).reshape(fields.shape)


def on_curved_paths(nodes, psi):
    """The body of nodes at x + phi q + psi q q / 2, both without mean motion."""
    x, Ms, phi = nodes[:3]
    second = SecondOrder(
        np.einsum("ij,klia->akl", Ms, psi),
        np.einsum("ia,ij,kljb->abkl", x, Ms, psi),
        np.einsum("mia,ij,klja->mkl", phi, Ms, psi),
        {},
    )
    return replace(nodal_body(*nodes), K_geo=second.matrices())


def distance(body, nodes, psi, state, a, pose):
    """Largest distance between the residuals of a body and of its nodes."""
    q, qd = state
    gravity = np.array([0.3, -9.0, 2.0])
    mech = Mechanism(gravity=gravity)
    mech.add_flexible("body", body, q=q, qd=qd, **pose)
    packed, W = mechanisms.prepared(mech)
    mechanisms.residual_at(packed.system, W, packed.q, packed.v, a, np.zeros(0))
    state = q, qd, pose["orientation"], pose["omega"]
    exact = mechanisms.nodal_residual(nodes, psi, state, a, gravity)
    return np.abs(W.residual - exact).max()


@pytest.fixture
def nodes():
    """Random nodes, whose shapes have no mean motion."""
    x, Ms, phi, K, D = mechanisms.random_nodes(np.random.default_rng(8))
    return x, Ms, without_rigid((x, Ms), phi), K, D


def test_stiffened_equations_are_those_of_nodes_on_curved_paths(nodes):
    """Small vibrations of a frame in any motion, strongly accelerated: the rest is second order."""
    rng = np.random.default_rng(8)
    psi = rng.normal(size=(4, 4, 7, 3))
    psi = without_rigid(nodes, psi + psi.transpose(1, 0, 2, 3))
    bodies, pose = (nodal_body(*nodes), on_curved_paths(nodes, psi)), random_pose(rng)
    a = rng.normal(size=10)
    for body, falls in zip(bodies, (10, 100), strict=True):
        state = rng.normal(size=(2, 4))
        one, other = (distance(body, nodes, psi, size * state, a, pose) for size in (1e-3, 1e-4))
        assert_allclose(one / other, falls, rtol=0.1)


def test_paths_that_shapes_combine_to_are_followed_to_any_order(nodes):
    rng = np.random.default_rng(9)
    psi = np.einsum("klm,mia->klia", rng.normal(size=(4, 4, 4)), nodes[2])
    psi = psi + psi.transpose(1, 0, 2, 3)
    body, a = on_curved_paths(nodes, psi), rng.normal(size=10)
    state = 0.2 * rng.normal(size=(2, 4))
    assert distance(body, nodes, psi, state, a, random_pose(rng)) < 1e-11
    assert distance(nodal_body(*nodes), nodes, psi, state, a, random_pose(rng)) > 0.1


def test_matrices_and_second_order_say_the_same():
    body = random_body(np.random.default_rng(2), stiffened=True)
    again = SecondOrder.of(body).matrices()
    assert set(again) == set(body.K_geo)
    for load, A in body.K_geo.items():
        assert_allclose(again[load], A, atol=1e-14, err_msg=load)


def test_a_wrong_geometric_stiffness_is_named():
    body = stiffened_beam(n_modes=3)
    for K_geo, message in (
        ({"spin": np.eye(3)}, "unknown load 'spin'"),
        ({"a_x": np.eye(2)}, r"needed is \(3, 3\)"),
        ({"a_x": np.tri(3)}, "is not symmetric"),
    ):
        refuses(ConfigError, message, Mechanism().add_flexible, "beam", replace(body, K_geo=K_geo))


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
    blade = mech.add_flexible("blade", stiffened_beam(), omega=eta * axis)
    hub = on_axle(mech, "hub", inertia=(1, 1, 1), axis=axis, omega=eta * axis)
    mech.revolute("hinge", hub, blade.marker("root"), axis=Z)
    mech.drive("motor", "axle", lambda t: eta * t, rate=lambda t: eta, acceleration=lambda t: 0)
    return 2 * np.pi * rom.linearize(mech).frequencies


@pytest.mark.parametrize("eta", [1, 5, 10, 12])
def test_a_hinged_blade_flaps_once_a_turn_and_bends_faster(eta):
    """Centrifugal force returns a rigid motion about the hinge with the speed itself.

    In the plane of rotation nothing returns it, and bending loses the square of the speed.
    """
    second = {1: 15.6242415, 5: 19.9196616, 10: 29.4439267, 12: 33.7603013}[eta]
    flap = hinged_blade(eta, Y)
    assert_allclose(flap[:2], [eta, second], rtol=2e-5)
    lag = hinged_blade(eta, Z)
    assert_allclose(lag[1] ** 2, second**2 - eta**2, rtol=4e-5)
    assert lag[0] < 1e-4 * eta


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
    linear = [load * LENGTH**3 / (3 * EI), 0.0]
    assert_allclose(pieces_under_load(1, EI, load), linear, rtol=1e-9, atol=1e-12)
    _, along, across = elastica(load * LENGTH**2 / EI)
    exact = LENGTH * np.array([across, along - 1.0])
    four, eight = (pieces_under_load(n, EI, load) for n in (4, 8))
    assert_allclose(exact[0], published, rtol=6e-4)  # published with shear
    assert_allclose((four - exact) / (eight - exact), [4.0, 4.0], atol=0.5)
    assert_allclose((4 * eight - four) / 3, exact, atol=3e-4 * LENGTH)
