"""Flexible bodies in motion, against unreduced models, conservation laws, and other frames."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.linalg import eigh, null_space
from scipy.sparse.linalg import splu

import rom
from cases.mbs import mechanisms
from cases.mbs.mechanisms import lattice, lattice_body
from cases.solid import CORNERS, GAUSS, block, reduced, shape_functions
from rom import rotation

EXACT = {"method": "dop853", "rtol": 1e-9, "atol": 1e-11}
GRAVITY = np.array([0.0, 0.0, -9.81])
SIZE, CELLS = np.array([1.0, 0.15, 0.12]), np.array([6, 1, 1])
ANGLE, T_TURN, T_END = 0.3, 0.4, 0.5  # the hinge turns so far [rad] in so long [s]
TIMES = np.linspace(0.0, T_END, 26)


def pendulum(data):
    """The lattice hung by its first node, released level."""
    mech = rom.Mechanism(gravity=GRAVITY)
    bar = mech.add_flexible("bar", lattice_body(data))
    mech.spherical("hook", mech.ground.marker(tuple(data[0][0])), bar.marker("n0"))
    return mech


def difference_of_the_pendulum(stiffness):
    """Largest distance of a tip node, frame model against point masses and turning springs."""
    data = lattice(stiffness=stiffness)
    x, _, _, masses = data
    times = np.linspace(0, 0.5, 26)
    weight = masses[:, None] * GRAVITY
    full = mechanisms.lattice_motion(data, times, x, 0 * x, lambda t, y: weight, held=(0,))
    sol = rom.simulate(pendulum(data), t_end=0.5, dt=0.02, **EXACT)
    tip = sol.position("bar", "n14")
    return np.abs(tip - full[:, 14]).max(), full[:, 14], data


def rigid_tip(data, times):
    """The tip node of the same pendulum with the springs replaced by rigid bars."""
    x, _, _, masses = data
    arm = x - x[0]
    J = np.einsum("i,iab->ab", masses, [a @ a * np.eye(3) - np.outer(a, a) for a in arm])
    centre = masses @ arm

    def rhs(t, y):
        A, w = rotation.matrix(y[:4]), y[4:]
        torque = np.cross(centre, A.T @ GRAVITY) - np.cross(w, J @ w)
        e0, e = y[0], y[1:4]
        rate = 0.5 * np.r_[-e @ w, e0 * w + np.cross(e, w)]
        return np.r_[rate, np.linalg.solve(J, torque)]

    y0 = np.r_[1.0, np.zeros(6)]
    out = solve_ivp(rhs, (0, times[-1]), y0, "DOP853", times, rtol=1e-10, atol=1e-12).y
    return np.array([x[0] + rotation.matrix(p / np.linalg.norm(p)) @ arm[14] for p in out[:4].T])


@pytest.mark.long
@pytest.mark.once
def test_flexible_pendulum_follows_the_unreduced_nonlinear_model():
    """What is left is of second order: ten times stiffer, at least thirty times less.

    Loads stiffen the lattice by a share 1/k of its own stiffness; linear elasticity does not see
    it. Vibrations of the amplitude 1/k shift in phase by that share times their number, sqrt(k).
    """
    soft, full, data = difference_of_the_pendulum(2e4)
    stiff, _, _ = difference_of_the_pendulum(2e5)
    bent = np.abs(full - rigid_tip(data, np.linspace(0, 0.5, 26))).max()
    assert bent > 1e-3
    assert soft < 0.04 * bent
    assert stiff < 1.1 * soft / 10**1.5


def test_spinning_bar_stretches_as_the_unreduced_model_does():
    """A free bar started rigidly at 40 rad/s about z swings out; frequency and stretch agree."""
    data = lattice(stiffness=2e5)
    x, _, _, masses = data
    centre, spin = masses @ x / masses.sum(), np.array([0.0, 0.0, 40.0])
    times = np.linspace(0, 0.05, 51)
    v0 = np.cross(spin, x - centre)
    full = mechanisms.lattice_motion(data, times, x, v0, lambda t, y: 0.0 * y)
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_flexible("bar", lattice_body(data), omega=spin, velocity=np.cross(spin, -centre))
    # nodes as joints of nothing: springs without stiffness make them markers of the run
    mech.spring_damper("probe", "bar.n0", "bar.n14", stiffness=0.0)
    sol = rom.simulate(mech, t_end=0.05, dt=1e-3, **EXACT)
    length = np.linalg.norm(sol.position("bar", "n14") - sol.position("bar", "n0"), axis=1)
    wanted = np.linalg.norm(full[:, 14] - full[:, 0], axis=1)
    stretch = np.ptp(wanted)
    assert stretch > 1e-3
    assert_allclose(length, wanted, atol=0.02 * stretch)
    assert_allclose(sol.position("bar", "n14"), full[:, 14], atol=0.02 * stretch)


def chain_of_two(gravity=(0.0, 0.0, -9.81), turn=None, shift=(0.0, 0.0, 0.0)):
    """Flexible bar on a hook with a rigid ball at its end, in any place and orientation."""
    data = lattice(stiffness=2e4)
    A = np.eye(3) if turn is None else turn
    shift, tip = np.asarray(shift), data[0][14]
    mech = rom.Mechanism(gravity=A @ gravity)
    moving = {"omega": (0.5, 0, 1.0), "velocity": A @ np.cross((0.5, 0, 1.0), -data[0][0])}
    mech.add_flexible("bar", lattice_body(data), at=shift, orientation=A, **moving)
    placed = {"at": shift + A @ (tip + np.array([0.1, 0, 0])), "orientation": A}
    solid = {"mass": 0.5, "inertia": (1e-3, 2e-3, 2.5e-3), "markers": {"c": (-0.1, 0, 0)}}
    mech.add_rigid("ball", **solid, **placed)
    mech.spherical("hook", mech.ground.marker(tuple(shift + A @ data[0][0])), "bar.n0")
    mech.revolute("hinge", "bar.n14", "ball.c", axis=A @ [0, 1.0, 0])
    return mech


def test_energy_does_not_drift_over_ten_thousand_steps():
    """rho_inf = 1: balance within 1e-6 of what is exchanged, no trend; joints stay closed."""
    sol = rom.simulate(chain_of_two(), t_end=1.0, dt=1e-4, rho_inf=1.0, save_every=10)
    energy = sol.energy
    exchanged = np.ptp(energy.potential)
    assert sol.statistics["steps"] == 10_000
    assert exchanged > 1.0
    assert np.abs(energy.balance).max() < 1e-6 * exchanged
    assert np.abs(sol.gap).max() < 1e-10 * 1.1
    for name in ("bar", "ball"):
        assert_allclose(np.linalg.norm(sol.orientation(name), axis=1), 1.0, atol=1e-12)


def test_a_turned_and_shifted_mechanism_moves_turned_and_shifted():
    A = rotation.matrix(rotation.exp(np.array([0.7, -1.1, 0.4])))
    shift = np.array([3.0, -2.0, 5.0])
    here = rom.simulate(chain_of_two(), t_end=0.2, dt=1e-3)
    there = rom.simulate(chain_of_two(turn=A, shift=shift), t_end=0.2, dt=1e-3)
    assert_allclose(there.position("ball"), shift + here.position("ball") @ A.T, atol=1e-9)
    size = np.abs(here.elastic("bar")).max()
    assert size > 1e-4
    assert_allclose(there.elastic("bar"), here.elastic("bar"), atol=1e-9 * size)
    force = here.reaction("hook")[:, :3]
    assert_allclose(there.reaction("hook")[:, :3], force @ A.T, atol=1e-7 * np.abs(force).max())


def test_momentum_gets_better_with_the_step_down_to_the_smallest():
    """Second order, 1e-8 at last; increments that stop at the round-off of positions leave 1e-6."""
    drift = []
    for dt in (1e-3, 1e-4, 1e-5):
        mech = rom.Mechanism(gravity=(0, 0, 0))
        rng = np.random.default_rng(11)
        body = mechanisms.random_body(rng, damped=False)
        mech.add_flexible(
            "one", body, at=(0.1, 0.2, 0.3), velocity=(1, 2, -1),
            omega=(1.0, -0.5, 0.3), q=0.01 * rng.normal(size=4), qd=0.1 * rng.normal(size=4),
        )  # fmt: skip
        sol = rom.simulate(mech, t_end=0.2, dt=dt, rho_inf=1.0, save_every=20)
        drift.append([np.abs(p - p[0]).max() / np.abs(p).max() for p in sol.momentum])
    drift = np.array(drift)
    assert (drift[1] < drift[0] / 50).all()
    assert (drift[1:] < 1e-8).all()


@pytest.fixture(scope="module")
def beam():
    """A slender block on the hinge side "root", reduced to rigid ends and ten modes."""
    return reduced(4, block(size=(1.0, 0.02, 0.02), cells=(16, 1, 1)), reference="root")


def hinged(length, add):
    """What ``add`` makes a bar, on a hinge about z with a ball at its tip, gravity across."""
    mech = rom.Mechanism(gravity=(0, -9.81, 0))
    add(mech)
    mech.add_rigid("ball", mass=0.5, inertia=(1e-4,) * 3, at=length)
    mech.revolute("hinge", "ground", "bar.root", axis=(0, 0, 1))
    mech.fixed("weld", "bar.tip", "ball")
    return mech


def test_small_swings_have_the_frequencies_of_the_hinged_body(beam):
    """Bending vibration of the bar on its hinge, from zero crossings, against the eigenvalue."""
    hold = beam.marker("root").hold
    M, K = beam.full_matrices()
    N = null_space(hold[:5])  # all motions but the rotation about z are held at the root
    lam, V = eigh(N.T @ K @ N, N.T @ M @ N)
    omega, shape = np.sqrt(np.maximum(lam, 0.0)), N @ V
    tip = beam.marker("tip")  # its deflection along y
    sway = shape[1] + np.cross(shape[3:6].T, tip.point)[:, 1] + tip.translation[1] @ shape[6:]
    k = 1 + np.flatnonzero(np.abs(sway[1:]) > 1e-3)[0]
    amplitude = 1e-6
    mech = rom.Mechanism(gravity=(0, 0, 0))
    start = amplitude * shape[:, k]
    place = {"at": start[:3] - beam.marker("root").point, "orientation": rotation.exp(start[3:6])}
    mech.add_flexible("bar", beam, **place, q=start[6:])
    mech.revolute("hinge", "ground", "bar.root", axis=(0, 0, 1))
    mech.spring_damper("probe", "bar.root", "bar.tip", stiffness=0.0)
    period = 2 * np.pi / omega[k]
    sol = rom.simulate(mech, t_end=3 * period, dt=period / 200, rho_inf=1.0)
    y = sol.position("bar", "tip")[:, 1]
    i = np.flatnonzero(np.diff(np.sign(y)))
    crossings = sol.t[i] - y[i] * (sol.t[i + 1] - sol.t[i]) / (y[i + 1] - y[i])
    assert_allclose(2 * np.diff(crossings).mean(), period, rtol=1e-3)


def test_the_stiff_limit_is_the_rigid_body(beam):
    """Modulus times 1e6: the trajectory of the same mechanism with a rigid bar to 1e-5."""
    stiff = replace(beam, K=1e6 * beam.K, omega=1e3 * beam.omega)
    root, tip = beam.marker("root").point, beam.marker("tip").point
    mech = hinged(tip - root, lambda mech: mech.add_flexible("bar", stiff, at=-root))
    flexible = rom.simulate(mech, t_end=0.3, dt=1e-3, rho_inf=0.5)
    c = beam.first_moment / beam.mass
    central = beam.inertia - beam.mass * (c @ c * np.eye(3) - np.outer(c, c))
    solid = {"mass": beam.mass, "inertia": central, "at": c - root}
    ends = {"root": root - c, "tip": tip - c}
    mech = hinged(tip - root, lambda mech: mech.add_rigid("bar", **solid, markers=ends))
    rigid = mechanisms.simulate_quietly(mech, t_end=0.3, dt=1e-3, rho_inf=0.5)
    assert_allclose(flexible.position("ball"), rigid.position("ball"), atol=1e-5)
    assert np.abs(rigid.position("ball")[-1] - rigid.position("ball")[0]).max() > 0.1


def turning(t):
    """Angle of the hinge and its acceleration: from rest to rest, without a jump."""
    x = min(t / T_TURN, 1.0)
    angle = ANGLE * (x - np.sin(2 * np.pi * x) / (2 * np.pi))
    return angle, ANGLE / T_TURN**2 * 2 * np.pi * np.sin(2 * np.pi * x)


class Solid:
    """Trilinear bricks of a Saint-Venant-Kirchhoff material, displacements from the start."""

    def __init__(self, material):
        self.model, self.C = block(SIZE, CELLS, material), material.stiffness
        number = np.arange(self.model.n_dofs // 3).reshape(CELLS + 1)
        steps = ((CORNERS + 1) / 2).astype(int)
        self.nodes = np.array([[number[tuple(c + s)] for s in steps] for c in np.ndindex(*CELLS)])
        h = SIZE / CELLS
        points = np.array(np.meshgrid(GAUSS, GAUSS, GAUSS)).reshape(3, -1).T
        self.dN = np.array([shape_functions(xi)[1] * 2 / h for xi in points])
        self.volume = h.prod() / 8

    def forces(self, u):
        """(N, 3) internal forces of the displacements u (N, 3)."""
        F = np.eye(3) + np.einsum("eni,gnj->egij", u[self.nodes], self.dN)
        E = 0.5 * (np.einsum("egki,egkj->egij", F, F) - np.eye(3))
        lam, mu = self.C[0, 1], self.C[3, 3]
        S = lam * np.einsum("egkk->eg", E)[..., None, None] * np.eye(3) + 2 * mu * E
        f = np.zeros_like(u)
        np.add.at(f, self.nodes, self.volume * np.einsum("egik,egkj,gnj->eni", F, S, self.dN))
        return f

    def moved(self):
        """(n_t, 3) mean of the tip face while the root face turns about z through its centre."""
        X, root = self.model.points, self.model.interfaces["root"]
        free = np.setdiff1d(np.arange(len(X)), root.nodes)
        M = self.model.M[::3, ::3].tocsc()
        held, inverse = M[free][:, root.nodes], splu(M[free][:, free]).solve
        arm = X[root.nodes] - root.origin
        n = free.size

        def face(t):
            """Displacement and acceleration of the root face, from rotation in the xy plane."""
            phi, pull = turning(t)
            c, s = np.cos(phi), np.sin(phi)
            R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
            dR = np.array([[-s, -c, 0], [c, -s, 0], [0, 0, 0]])
            rate = ANGLE / T_TURN * (1 - np.cos(2 * np.pi * min(t / T_TURN, 1.0)))
            flat = np.diag([1.0, 1.0, 0.0])
            return arm @ (R - np.eye(3)).T, arm @ (pull * dR - rate**2 * R @ flat).T

        def rhs(t, y):
            u = np.empty_like(X)
            u[root.nodes], pulled = face(t)
            u[free] = y[: 3 * n].reshape(-1, 3)
            force = -self.forces(u)[free] - held @ pulled
            return np.concatenate([y[3 * n :], inverse(force).ravel()])

        y = solve_ivp(rhs, (0, T_END), np.zeros(6 * n), "DOP853", TIMES, rtol=1e-6, atol=1e-8).y
        tip = self.model.interfaces["tip"]
        weights = np.asarray(tip.surface_mass.sum(axis=1)).ravel() / tip.area
        at = np.searchsorted(free, tip.nodes)
        u = y[: 3 * n].T.reshape(TIMES.size, n, 3)[:, at]
        return tip.origin - root.origin + np.einsum("n,tni->ti", weights, u)


def reduced_motion(model):
    """The same by a body with all shapes that matter on a driven hinge, frame on the root."""
    body = rom.reduce(
        model, method=rom.CraigBampton(30), interfaces={"root": "rbe2", "tip": "rbe3"},
        reference="root", certify=False,
    )  # fmt: skip
    mech = rom.Mechanism(gravity=(0, 0, 0))
    bar = mech.add_flexible("bar", body, at=-body.marker("root").point)
    mech.revolute("hinge", mech.ground.marker((0, 0, 0)), bar.marker("root"), axis=(0, 0, 1))
    mech.drive("motor", "hinge", lambda t: turning(t)[0])
    mech.spring_damper("probe", mech.ground.marker((0, 0, 0)), bar.marker("tip"), stiffness=0.0)
    return rom.simulate(mech, t_end=T_END, dt=1e-4, save_every=200).position("bar", "tip")


def test_small_displacements_have_the_linear_forces():
    solid = Solid(rom.Material(E=2e7, nu=0.3, rho=1000.0))
    u = 1e-7 * np.random.default_rng(5).normal(size=solid.model.points.shape)
    assert_allclose(solid.forces(u).ravel(), solid.model.K @ u.ravel(), rtol=1e-4, atol=1e-5)


@pytest.mark.long
@pytest.mark.once
def test_a_driven_bar_moves_like_its_finite_elements():
    """What is left is of second order: four times stiffer, at least eight times less."""
    found, phi = [], np.array([turning(t)[0] for t in TIMES])
    rigid = np.column_stack([np.cos(phi), np.sin(phi), 0 * phi])
    for E in (2e7, 8e7):
        solid = Solid(rom.Material(E=E, nu=0.3, rho=1000.0))
        full, ours = solid.moved(), reduced_motion(solid.model)
        found.append((np.abs(ours - full).max(), np.abs(full - rigid).max()))
    (soft, bent), (stiff, _) = found
    assert bent > 0.01
    assert soft < 0.05 * bent
    assert stiff < 1.1 * soft / 4**1.5
