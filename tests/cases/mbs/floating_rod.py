"""Rods in a floating frame: the same motion, seen from a frame that follows the rod.

Positions and axes are those of a frame (r, A) times relative ones, x_i = r + A xi_i and
R_n = A Theta_n. With z = (v, omega, relative velocities) and the velocities J z in space, the
equations of the rod become those of a flexible body in a floating frame,

    J^T M J dz + J^T (M c + gyroscopic moments - loads) + (0, g(xi, Theta)) + C^T lambda = 0,

where c are the accelerations at dz = 0: the energy of the rod does not notice a rigid motion, so
its forces g stand in the relative rows alone. Six reference conditions C z = 0 say which frame it
is; the motion in space does not depend on them.

Source:
    After Schulze, Dietz, Burgermeister, Tuganov, Lang, Linn, Arnold, Integration of nonlinear
    models of flexible body deformation in multibody system dynamics, J. Comput. Nonlinear Dyn. 9
    (2014) 011012.
"""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from rom import rotation
from rom.components.cosserat.energy import internal, work
from rom.components.cosserat.shapes import Shape, reference
from rom.components.cosserat.statics import add_loads
from rom.components.cosserat.vibration import lumped_mass
from rom.model import Array

FRAME_DOFS = 6  # of the origin in the world, angular in the frame's own axes


@dataclass(frozen=True)
class Instant:
    """A rod in a floating frame.

    Attributes:
        r, P: (3,) origin and (4,) quaternion of the frame.
        xi: (N + 1, 3) positions in the frame; theta: (N + 2, 4) quaternions to the frame.
        z: (6 + 6 N + 9,) velocities: of the frame; plate, x_0, segment, x_1, ... in it.
    """

    r: Array
    P: Array
    xi: Array
    theta: Array
    z: Array

    def packed(self):
        return np.concatenate([self.r, self.P, self.xi.ravel(), self.theta.ravel(), self.z])

    @classmethod
    def unpacked(cls, y, n):
        """From the numbers of a rod of n segments; quaternions brought to length one."""
        ends = np.cumsum([3, 4, 3 * (n + 1), 4 * (n + 2)])
        r, P, xi, theta, z = np.split(y, ends)
        theta = theta.reshape(-1, 4)
        theta = theta / np.linalg.norm(theta, axis=1)[:, None]
        return cls(r, P / np.linalg.norm(P), xi.reshape(-1, 3), theta, z)

    @property
    def shape(self):
        """Positions and quaternions in the world."""
        A = rotation.matrix(self.P)
        p = np.array([rotation.multiply(self.P, q) for q in self.theta])
        return Shape(self.r + self.xi @ A.T, p)

    @property
    def parts(self):
        """Velocities of the frame (3,), (3,), of vertices (N + 1, 3), of sections (N + 2, 3)."""
        pairs = np.append(self.z[FRAME_DOFS:], np.zeros(3)).reshape(-1, 6)
        return self.z[:3], self.z[3:6], pairs[:-1, 3:], pairs[:, :3]


def jacobian(now):
    """(n, 6 + n) velocities in space per velocity of frame and rod."""
    n = now.z.size - FRAME_DOFS
    J, A = np.zeros((n, FRAME_DOFS + n)), rotation.matrix(now.P)
    for i, xi in enumerate(now.xi):
        at = slice(6 * i + 3, 6 * i + 6)
        J[at, :3], J[at, 3:6] = np.eye(3), -A @ rotation.skew(xi)
        J[at, FRAME_DOFS + at.start : FRAME_DOFS + at.stop] = A
    for k, theta in enumerate(now.theta):
        at = slice(6 * k, 6 * k + 3)
        J[at, 3:6] = rotation.matrix(theta).T
        J[at, FRAME_DOFS + at.start : FRAME_DOFS + at.stop] = np.eye(3)
    return J


def convective(rod, now):
    """(n,) forces of inertia at dz = 0: mass times accelerations, and gyroscopic moments."""
    A = rotation.matrix(now.P)
    _, omega, rates, turning = now.parts
    h = np.zeros((len(rod.p), 6))
    a = np.cross(omega, np.cross(omega, now.xi) + 2 * rates)
    h[:-1, 3:] = rod.mass[:, None] * (a @ A.T)
    own = np.array([rotation.matrix(q).T @ omega for q in now.theta])
    total = own + turning
    h[:, :3] = rod.inertia * np.cross(own, turning) + np.cross(total, rod.inertia * total)
    return h.ravel()[:-3]


def at_start(rod, now):
    """Reference condition: the frame is fixed to the plate at the start of the rod."""
    C = np.zeros((6, now.z.size))
    C[:, FRAME_DOFS : FRAME_DOFS + 6] = np.eye(6)
    return C, np.zeros(6)


def chord(rod, now):
    """Reference condition: the first and last vertex stay on one line of the frame.

    The first one stays at its place, and the plate at the start does not turn about that line.
    """
    n = now.z.size
    along = rod.x[-1] - rod.x[0]
    along = along / np.linalg.norm(along)
    across = np.linalg.svd(along[None])[2][1:]
    C = np.zeros((6, n))
    C[:3, FRAME_DOFS + 3 : FRAME_DOFS + 6] = np.eye(3)
    C[3:5, -6:-3] = across
    C[5, FRAME_DOFS : FRAME_DOFS + 3] = along @ rotation.matrix(now.theta[0])
    return C, np.zeros(6)


def mean_axis(rod, now):
    """Tisserand's condition: the relative motion has no momentum."""
    C = np.zeros((6, now.z.size))
    for i, (m, xi) in enumerate(zip(rod.mass, now.xi, strict=True)):
        at = slice(FRAME_DOFS + 6 * i + 3, FRAME_DOFS + 6 * i + 6)
        C[:3, at], C[3:, at] = m * np.eye(3), m * rotation.skew(xi)
    rate = np.zeros(6)
    for k, (J, q) in enumerate(zip(rod.inertia, now.theta, strict=True)):
        at = slice(FRAME_DOFS + 6 * k, FRAME_DOFS + 6 * k + 3)
        R, w = rotation.matrix(q), now.parts[3][k]
        C[3:, at] += R * J
        rate[3:] += R @ np.cross(w, J * w)
    return C, rate


REFERENCES = {"start": at_start, "chord": chord, "mean-axis": mean_axis}


def accelerations(rod, now, load, conditions):
    """(6 + n,) rates of the velocities z, and (6,) reactions of the reference conditions.

    The reactions vanish: conditions choose a frame, they do not hold the rod.
    """
    J, (C, rate), M = jacobian(now), conditions(rod, now), lumped_mass(rod)
    W = work(rod)
    internal(rod, now.xi, now.theta, now.z[FRAME_DOFS:], W)
    f = np.zeros((len(rod.p), 6))
    f[:-1, 3:] = load[0]
    sections = now.shape.p
    f[:, :3] = [rotation.matrix(p).T @ moment for p, moment in zip(sections, load[1], strict=True)]
    right = J.T @ (f.ravel()[:-3] - convective(rod, now))
    right[FRAME_DOFS:] -= W.r
    left = np.block([[J.T * M @ J, C.T], [C, np.zeros((6, 6))]])
    solution = np.linalg.solve(left, np.append(right, -rate))
    return solution[:-6], solution[-6:]


def rates(rod, now, load, conditions):
    """Rates of all numbers of `Instant.packed`."""
    v, omega, speeds, turning = now.parts
    theta = [_rate(q, w) for q, w in zip(now.theta, turning, strict=True)]
    dz, _ = accelerations(rod, now, load, conditions)
    return np.concatenate([v, _rate(now.P, omega), speeds.ravel(), np.ravel(theta), dz])


def _rate(q, w):
    """Rate of a quaternion whose axes turn with w in their own frame."""
    return rotation.multiply(q, np.append(0.0, 0.5 * w))


def simulate(rod, t, *, reference_condition, load, velocity, omega):
    """Motion at instants of a free rod from its shape without stress, in a floating frame.

    Plates have inertia, too; loads are dead ones as of `statics.loads`; velocity of the origin and
    angular velocity are those of the rod as a whole at the start.
    """
    conditions, shape, n = REFERENCES[reference_condition], reference(rod), rod.h.size
    z = np.concatenate([velocity, omega, np.zeros(6 * n + 9)])
    begun = Instant(np.zeros(3), np.array([1.0, 0, 0, 0]), shape.x, shape.p, z)
    found = solve_ivp(
        lambda _, y: rates(rod, Instant.unpacked(y, n), load, conditions),
        (0.0, t[-1]), begun.packed(), "DOP853", t, rtol=1e-11, atol=1e-11,
    )  # fmt: skip
    assert found.success, found.message
    return [Instant.unpacked(y, n) for y in found.y.T]


def swing(rod, t, load, free):
    """Shape of a rod with mass, held to the ground, after a load has acted on it.

    Each dof by itself, since masses are lumped: no mechanism, no frame, no elimination.
    """
    W, M, n = work(rod), lumped_mass(rod), rod.x.size

    def parts(y):
        p = y[n : -M.size].reshape(-1, 4)
        return y[:n].reshape(-1, 3), p / np.linalg.norm(p, axis=1)[:, None], y[-M.size :]

    def rates(_, y):
        x, p, v = parts(y)
        rows = np.append(v, np.zeros(3)).reshape(-1, 6)
        internal(rod, x, p, v, W)
        add_loads(p, *load, W)
        spin = np.zeros_like(rows)
        spin[:, :3] = np.cross(rows[:, :3], rod.inertia * rows[:, :3])
        a = np.where(free, -(W.r + spin.ravel()[:-3]) / M, 0.0)
        w = np.insert(rows[:, :3], 0, 0.0, axis=1)
        turning = [0.5 * rotation.multiply(q, one) for q, one in zip(p, w, strict=True)]
        return np.concatenate([rows[:-1, 3:].ravel(), np.ravel(turning), a])

    start = np.concatenate([rod.x.ravel(), rod.p.ravel(), np.zeros(M.size)])
    end = solve_ivp(rates, (0.0, t), start, "DOP853", rtol=1e-9, atol=1e-9).y[:, -1]
    return Shape(*parts(end)[:2])
