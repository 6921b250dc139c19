"""A small gear unit, and second programs: of its motion step by step, of teeth in one position.

They know nothing of mechanisms. That of motions has the films of `Transmission.forces`, teeth in
their plane, Newmark, Newton and shooting. In helical gears contact lines run as
s = r_b1 theta + k p_b + z tan(beta_b), whose normal is cos(beta_b) n_t - sin(beta_b) e_z.

Source:
    Newmark, A method of computation for structural dynamics, J. Eng. Mech. Div. 85 (1959) 67;
    Hilber, Hughes and Taylor, Earthq. Eng. Struct. Dyn. 5 (1977) 283; teeth: Velex and Maatar, J.
    Sound Vib. 191 (1996) 629.
"""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.units import RigidShaft, with_shafts
from rom.components.gear_mesh import GearPair, Mesh, MeshForce, Slices
from rom.components.gear_mesh.gears.geometry import involute, path_of_contact
from rom.components.journal_bearing import Groove, JournalBearing
from rom.components.transmission import Disc, Rotor, Shaft, Transmission, rest

CELLS = (60, 4)
FORCE_RTOL, MAX_ITERATIONS, MAX_PASSES = 1e-9, 30, 20
LOADS, MAX_CORRECTIONS, MAX_STEP = (0.01, 0.03, 0.1, 0.25, 0.5, 1.0), 80, 0.1
NODES = np.linspace(0, 0.2, 5)
SPAN = 0.2
SIZES = ((9.0, 6e-2, 1.3e-2), (60.0, 1.6, 3.0))  # mass, inertia across and about, if rigid


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


def rigid_unit(**more):
    return with_shafts(unit(**more), tuple(RigidShaft(*size, SPAN) for size in SIZES))


def plane(unit):
    mesh = unit.mesh
    own = PlaneMesh(mesh.pair, mesh.stiffness, mesh.correction, mesh.damping, mesh.cells)
    return replace(unit, mesh=own)


def allowed(unit, q, step):
    """Share of a step that keeps films: no journal moves far, or loses half of its film."""
    share = 1.0
    for inside, bearing, _ in unit.journals:
        at, d = inside[:4] @ q, inside[:4] @ step
        share = min(share, MAX_STEP * bearing.clearance / max(np.hypot(*d[:2]), 1e-30))
        while bearing.thinnest(at + share * d) < 0.5 * bearing.thinnest(at):
            share /= 2
    return share


def resting(unit, theta=0.0):
    """Equilibrium by Newton's method, the load raised from where teeth touch: (n,) coordinates."""
    unit = plane(unit)
    K, f, films = unit.matrices[1], unit.load, None
    q = (1e-7 + unit.mesh.least_gap(theta)) / unit.mesh.pair.rb[1] * unit.rigid[1][:, 5]
    x, y = unit.mesh.forces(unit.wheels @ q, theta).force[:2]
    ahead = 5e-6 * np.array([-y, x]) / max(np.hypot(x, y), 1e-300)
    q = q + (unit.rigid[0] + unit.rigid[1])[:, :2] @ ahead  # where films begin to carry
    for share in LOADS:
        for _ in range(MAX_CORRECTIONS):
            now = unit.forces(q, 0.0 * q, theta, films)
            R, films = share * f + now.force - K @ q, now.films
            if np.abs(R).max() < 1e-10 * np.abs(share * f).max():
                break
            step = np.linalg.solve(K + now.stiffness, R)
            q = q + allowed(unit, q, step) * step
        else:
            raise AssertionError(f"{np.abs(R).max():.3g} N are left")
    return q


def tilting(state):
    """Power of moments about axes that are tilted and turned, seen along Z, to second order [W].

    Turns phi are vectors of rotation. On phi_z works M_z - (phi x M)_z / 2, along the axis of the
    shaft, about which it spins, M_z + M (phi x e_z): the difference is (M x phi)_z / 2.
    """
    u, teeth = state.unit, state.forces.mesh.force.reshape(2, 2, 3)[:, 1, :2]
    wheels = (u.wheels @ state.q).reshape(2, 2, 3)[:, 1, :2]
    journals = [(inside @ state.q)[2:4] for inside, _, _ in u.journals]
    spins = [*u.spins, *(abs(u.spins[0 if turn > 0 else 1]) for _, _, turn in u.journals)]
    M = np.array([*teeth, *(film.force[2:] for film in state.forces.films)])
    phi = np.array([*wheels, *journals])
    return 0.5 * float(spins @ (M[:, 0] * phi[:, 1] - M[:, 1] * phi[:, 0]))


def with_inlets(unit, beyond):
    """The unit with films that conserve their oil, from one inlet each: angle [deg] from the load.

    It counts in the direction of rotation.
    """
    push, rotors = rest(unit).forces.mesh.force, []
    for rotor, side in ((unit.pinion, 1), (unit.gear, -1)):
        at = np.arctan2(push[1], side * push[0]) + np.radians(beyond)
        inlet = [Groove(at, np.radians(20))]
        films = {k: replace(b, grooves=inlet, cavitation="jfo") for k, b in rotor.bearings.items()}
        rotors.append(replace(rotor, bearings=films))
    return replace(unit, pinion=rotors[0], gear=rotors[1])


class Step:
    """Position and rates of a unit; alpha from -1/3 to 0 damps what steps do not resolve."""

    def __init__(self, unit, q, theta, v=None, *, alpha=0.0):
        self.alpha, self.beta, self.gamma = alpha, (1 - alpha) ** 2 / 4, 0.5 - alpha
        self.unit = unit = plane(unit)
        self.q, self.v = q, np.zeros(q.size) if v is None else v
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
        q = q0 + allowed(unit, q0, ahead) * ahead
        for k in range(MAX_ITERATIONS):
            v, a = self.rates(dt, q - q0, self.v, self.a)
            self.now = unit.forces(q, v, theta, self.now.films)
            R = (1 + self.alpha) * self.forces(q, v) - self.alpha * before - self.M @ a
            if np.abs(R).max() < FORCE_RTOL * size:
                break
            d = np.linalg.solve(self.jacobian(dt), R)
            # where teeth or voids come and go, whole corrections may go round in a circle
            q = q + (1.0 if k < MAX_ITERATIONS // 2 else 0.5) * allowed(unit, q, d) * d
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
        x = x + min(allowed(unit, x[:n], d[:n]), allowed(unit, x[:n], dt * d[n:])) * d
    raise AssertionError(f"the motion does not close by {gap:.3g}")


class PlaneMesh(Mesh):
    """Two wheels whose flanks approach to the first order of shifts along the axis and tilts."""

    def gap(self, slices, path):
        """(n,) normal gap of the unloaded flanks at the datum [m]."""
        c, b, e = self.correction, self.pair.width, np.zeros(slices.s.size)
        starts = (slices.s - path[1] + c.extent[0], path[0] + c.extent[1] - slices.s)
        for depth, extent, beyond in zip(c.relief, c.extent, starts, strict=True):
            if extent > 0:
                e += depth * np.clip(beyond / extent, 0.0, None) ** c.power
        e += c.crowning * (2 * slices.z / b) ** 2 + c.slope * slices.z / b
        e += abs(c.slope) / 2
        for errors in c.pitch:
            if len(errors):
                lowest = np.asarray(errors, dtype=float)
                e += (lowest - lowest.min())[(-slices.line) % len(errors)]
        back = self.pair.backlash * np.cos(self.pair.base_helix)
        return np.where(slices.back, back, e)

    def forces(self, q, theta, rate=None):
        q = np.asarray(q, dtype=float)
        line = Line.of(self.pair, q)
        path = path_of_contact(self.pair, line.alpha)
        slices = contact_lines(self.pair, line, theta + q[5], self.cells, path)
        V = structural_vectors(self.pair, line, slices)
        d = approach(self.pair, line, slices, V, q) - self.gap(slices, path)
        k = self.pair_stiffness(slices.s, path) * slices.length * (d > 0)
        v = np.zeros(d.size) if rate is None else V @ np.asarray(rate, dtype=float)
        load = k * (d + self.damping * v)
        K = (V * k[:, None]).T @ V
        return MeshForce(
            -V.T @ load, K, self.damping * K, 0.5 * float(k @ d**2),
            self.damping * float(k @ v**2), slices, load,
        )  # fmt: skip


@dataclass(frozen=True)
class Line:
    """The line of action of wheels whose centres moved."""

    alpha: float  # pressure angle [rad]
    turn: float  # of the line of centres [rad]
    datum: float  # pressure angle at the datum [rad]

    @classmethod
    def of(cls, pair, q):
        """Where the middles of the faces are."""
        x, y = pair.distance + q[6] - q[0], q[7] - q[1]
        cosine = float(pair.rb.sum() / np.hypot(x, y))
        return cls(float(np.arccos(cosine)), float(np.arctan2(y, x)), pair.alpha)


def contact_lines(pair, line, theta, cells, path):
    """Contact lines of working and back flanks, cut where they leave the field of contact."""
    slant, rb = float(np.tan(pair.base_helix)), float(pair.rb[0])
    forward = rb * (theta + line.alpha - line.datum - line.turn)
    behind = float(pair.base_thickness[0]) + 2 * rb * line.alpha - forward
    both = [_cut(pair, start, t, cells, path) for start, t in ((forward, slant), (behind, -slant))]
    s, z, length, number = (np.concatenate(columns) for columns in zip(*both, strict=True))
    return Slices(s, z, length, number, np.repeat([False, True], [len(b[0]) for b in both]))


def structural_vectors(pair, line, slices):
    """(n, 12) approach of the flanks per motion of the wheels."""
    side = np.where(slices.back, -1.0, 1.0)
    c, s = np.cos(line.turn), np.sin(line.turn)
    A = np.array([[c, -s], [s, c]])
    beta = pair.base_helix
    t = np.stack([np.full(side.size, np.sin(line.alpha)), side * np.cos(line.alpha)])
    start = pair.rb[0] * np.stack([np.full(side.size, np.cos(line.alpha)),
                                   -side * np.sin(line.alpha)])  # fmt: skip
    M = A @ (start + slices.s * t)
    centre = A @ np.array([pair.rb.sum() / np.cos(line.alpha), 0.0])
    n = np.vstack([np.cos(beta) * (A @ t), -side * np.sin(beta)]).T
    arms = [np.vstack([M - off[:, None], slices.z]).T for off in (np.zeros(2), centre)]
    return np.hstack([n, np.cross(arms[0], n), -n, -np.cross(arms[1], n)])


def approach(pair, line, slices, V, q):
    """(n,) normal approach of the flanks; exact for wheels that move and turn in their plane."""
    rb, sum_rb, side = pair.rb, float(pair.rb.sum()), np.where(slices.back, -1.0, 1.0)
    opened = sum_rb * float(involute(line.alpha) - involute(line.datum))
    rolled = rb[0] * q[5] + rb[1] * q[11] - sum_rb * line.turn
    plane = np.cos(pair.base_helix) * (side * rolled - opened)
    out_of_plane = np.array([2, 3, 4, 8, 9, 10])
    return plane + V[:, out_of_plane] @ q[out_of_plane]


def _cut(pair, start, slant, cells, path):
    """Pieces of the lines s = start + k p_b + slant z within path and face."""
    A, B = path
    edges, p = np.linspace(-pair.width / 2, pair.width / 2, cells + 1), pair.base_pitch
    reach = abs(slant) * pair.width / 2
    k = np.arange(np.floor((A - start - reach) / p), np.ceil((B - start + reach) / p) + 1)
    s0 = start + k[:, None] * p
    if slant == 0.0:
        low, high = np.broadcast_arrays(edges[:-1], np.where((s0 >= A) & (s0 < B), edges[1:], -1))
    else:
        ends = np.sort(np.stack([(A - s0) / slant, (B - s0) / slant]), axis=0)
        low, high = np.maximum(edges[:-1], ends[0]), np.minimum(edges[1:], ends[1])
    row, column = np.nonzero(high - low > 1e-15)
    a, b = low[row, column], high[row, column]
    z = (a + b) / 2
    return s0[row, 0] + slant * z, z, (b - a) / np.cos(np.arctan(slant)), k[row].astype(np.int64)
