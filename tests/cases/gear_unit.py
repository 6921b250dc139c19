"""A small gear unit, and its motion step by step by a second program.

It knows nothing of mechanisms: the forces of `Transmission.forces`, Newmark, Newton and shooting.

Source:
    Newmark, A method of computation for structural dynamics, J. Eng. Mech. Div. 85 (1959) 67;
    Hilber, Hughes and Taylor, Earthq. Eng. Struct. Dyn. 5 (1977) 283.
"""

from dataclasses import replace

import numpy as np

from rom.components.gear_mesh import GearPair, Mesh
from rom.components.journal_bearing import Groove, JournalBearing
from rom.components.transmission import Disc, Rotor, Shaft, Transmission

CELLS = (60, 4)
FORCE_RTOL, MAX_ITERATIONS, MAX_PASSES = 1e-9, 30, 20


NODES = np.linspace(0, 0.2, 5)


def journal(direction, clearance=50e-6):
    """50 mm, 25 mm long, two grooves across the load."""
    grooves = [Groove(direction + side * np.pi / 2, np.radians(20)) for side in (1, -1)]
    return JournalBearing(0.05, 0.025, clearance, grooves, cells=CELLS)


def unit(torque=200.0, speed=100 * np.pi, helix=0.0, width=0.04, clearance=50e-6, **more):
    """26 to 157 teeth of module 4 on two equal shafts; torque of the pinion."""
    loose = GearPair((26, 157), 4e-3, width, helix)
    pair = replace(loose, centre_distance=loose.distance + 5e-5)
    n = np.array([np.sin(pair.alpha), np.cos(pair.alpha)])
    pushed = np.arctan2(-n[1], -n[0]), np.arctan2(-n[1], n[0])
    outer = 104e-3, 628e-3
    rotors = [
        Rotor(
            Shaft(NODES, 0.05, [Disc.of_ring(2, outer=d, inner=0.05, width=0.04)]), 2,
            {k: journal(a, clearance) for k in (0, 4)},
        )
        for d, a in zip(outer, pushed, strict=True)
    ]  # fmt: skip
    mesh = Mesh(pair, 15e9, damping=2e-6)
    return Transmission(*rotors, mesh, speed, torque * 157 / 26, 0.02, **more)


class Step:
    """Position and rates of a unit; alpha from -1/3 to 0 damps what steps do not resolve."""

    def __init__(self, unit, q, theta, v=None, *, alpha=0.0):
        self.alpha, self.beta, self.gamma = alpha, (1 - alpha) ** 2 / 4, 0.5 - alpha
        self.unit, self.q, self.v = unit, q, np.zeros(q.size) if v is None else v
        self.M, self.K, G = unit.matrices
        self.C = unit.loss * self.K + G
        self.now = unit.forces(q, self.v, theta)
        self.a = np.linalg.solve(self.M, self.forces(q, self.v))

    def forces(self, q, v):
        """(n,) all but inertia."""
        return self.unit.load + self.now.force - self.K @ q - self.C @ v

    def advance(self, dt, theta):
        """One step, to the drive's angle."""
        unit, before, q0 = self.unit, self.forces(self.q, self.v), self.q
        size = max(np.abs(self.K @ self.q).max(), np.abs(unit.load).max())
        self.last, ahead = self.now, dt * self.v + dt**2 / 4 * self.a
        q = q0 + unit.allowed(q0, ahead) * ahead
        for k in range(MAX_ITERATIONS):
            v, a = self.rates(dt, q - q0, self.v, self.a)
            self.now = unit.forces(q, v, theta, self.now.films)
            R = (1 + self.alpha) * self.forces(q, v) - self.alpha * before - self.M @ a
            if np.abs(R).max() < FORCE_RTOL * size:
                break
            d = np.linalg.solve(self.jacobian(dt), R)
            # where teeth or voids come and go, whole corrections may go round in a circle
            q = q + (1.0 if k < MAX_ITERATIONS // 2 else 0.5) * unit.allowed(q, d) * d
        else:
            raise AssertionError(f"{np.abs(R).max():.3g} N are left")
        self.q, self.v, self.a = q, v, a

    def rates(self, dt, moved, v, a):
        """Newmark's v and a after a step that moved so far, from those before it."""
        new = (moved - dt * v) / (self.beta * dt**2) - (0.5 / self.beta - 1) * a
        return v + dt * ((1 - self.gamma) * a + self.gamma * new), new

    def jacobian(self, dt):
        """(n, n) minus the derivative of what is not balanced, by q."""
        K = self.K + self.now.stiffness
        K = K + self.gamma / (self.beta * dt) * (self.C + self.now.damping)
        return self.M / (self.beta * dt**2) + (1 + self.alpha) * K

    def first_tangents(self):
        """(n, 2n) derivatives of q, v and a by q and v, where a motion starts."""
        n, C, K = self.q.size, self.C + self.now.damping, self.K + self.now.stiffness
        return np.eye(n, 2 * n), np.eye(n, 2 * n, n), -np.linalg.solve(self.M, np.hstack([K, C]))

    def carried(self, dt, D):
        """Derivatives of q, v and a after the last step, from those before it."""
        q, v, a = D
        still = self.rates(dt, np.zeros_like(q), v, a)
        C, K = self.C + self.now.damping, self.K + self.now.stiffness
        R = -(1 + self.alpha) * (K @ q + C @ still[0]) - self.M @ still[1]
        C, K = self.C + self.last.damping, self.K + self.last.stiffness
        R += self.alpha * (K @ q + C @ v)
        moved = np.linalg.solve(self.jacobian(dt), R)
        return q + moved, *self.rates(dt, moved, v, a)


def stepped(unit, q, v, theta, steps, n, alpha=0.0):
    """(n + 1, n_q) coordinates, (n + 1,) forces of the teeth, ends, (2n_q, 2n_q) derivatives."""
    step, dt = Step(unit, q, theta, v, alpha=alpha), unit.mesh_period / steps
    rows, teeth, D = [q], [step.now.mesh.load.sum()], step.first_tangents()
    for k in range(1, n + 1):
        step.advance(dt, theta + unit.speed * k * dt)
        rows.append(step.q)
        teeth.append(step.now.mesh.load.sum())
        D = step.carried(dt, D)
    return np.array(rows), np.array(teeth), np.concatenate([step.q, step.v]), np.vstack(D[:2])


def repeating(state, steps, alpha=-0.05, rtol=1e-6):
    """Coordinates and forces of teeth over a mesh period that ends as it began; multipliers."""
    unit, n = state.unit, state.q.size
    x = np.concatenate([state.q, np.zeros(n)])
    for _ in range(MAX_PASSES):
        q, teeth, end, F = stepped(unit, x[:n], x[n:], state.theta, steps, steps, alpha)
        gap = np.abs((end - x) * np.repeat([1.0, unit.mesh_period], n)).max()
        if gap < rtol * np.abs(q).max():
            values = np.linalg.eigvals(F)
            return q, teeth, values[np.argsort(-np.abs(values))]
        d = np.linalg.solve(np.eye(2 * n) - F, end - x)
        dt = unit.mesh_period / steps
        x = x + min(unit.allowed(x[:n], d[:n]), unit.allowed(x[:n], dt * d[n:])) * d
    raise AssertionError(f"the motion does not close by {gap:.3g}")
