"""A driven flexible body against unreduced solid finite elements with finite rotations."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.sparse.linalg import splu

import rom
from cases.solid import CORNERS, GAUSS, block, shape_functions
from rom.mbs.integrate.simulation import simulate
from rom.mbs.mechanism import Mechanism
from rom.model import Material

SIZE, CELLS = np.array([1.0, 0.15, 0.12]), np.array([6, 1, 1])
ANGLE, T_TURN, T_END = 0.3, 0.4, 0.5  # the hinge turns so far [rad] in so long [s]
TIMES = np.linspace(0.0, T_END, 26)


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
        self.nodes = np.array(
            [[number[tuple(np.array(c) + s)] for s in steps] for c in np.ndindex(*CELLS)]
        )
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
    mech = Mechanism(gravity=(0, 0, 0))
    bar = mech.add_flexible("bar", body, at=-body.marker("root").point)
    mech.revolute("hinge", mech.ground.marker((0, 0, 0)), bar.marker("root"), axis=(0, 0, 1))
    mech.drive("motor", "hinge", lambda t: turning(t)[0])
    mech.spring_damper("probe", mech.ground.marker((0, 0, 0)), bar.marker("tip"), stiffness=0.0)
    return simulate(mech, t_end=T_END, dt=1e-4, save_every=200).position("bar", "tip")


def test_small_displacements_have_the_linear_forces():
    solid = Solid(Material(E=2e7, nu=0.3, rho=1000.0))
    u = 1e-7 * np.random.default_rng(5).normal(size=solid.model.points.shape)
    assert_allclose(solid.forces(u).ravel(), solid.model.K @ u.ravel(), rtol=1e-4, atol=1e-5)


@pytest.fixture(scope="module")
def gaps():
    """Largest difference of the tip, and its largest elastic motion, for two stiffnesses [m]."""
    found = []
    for E in (2e7, 8e7):
        solid = Solid(Material(E=E, nu=0.3, rho=1000.0))
        full, ours = solid.moved(), reduced_motion(solid.model)
        phi = np.array([turning(t)[0] for t in TIMES])
        rigid = np.column_stack([np.cos(phi), np.sin(phi), 0 * phi])
        found.append((np.abs(ours - full).max(), np.abs(full - rigid).max()))
    return np.array(found)


@pytest.mark.long
@pytest.mark.once
def test_a_driven_bar_moves_like_its_finite_elements(gaps):
    """What is left is of second order: four times stiffer, at least eight times less."""
    (soft, bent), (stiff, _) = gaps
    assert bent > 0.01
    assert soft < 0.05 * bent
    assert stiff < 1.1 * soft / 4**1.5
