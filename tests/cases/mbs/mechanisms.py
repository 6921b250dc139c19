"""Bodies and mechanisms for the multibody tests, and kernels that let tests look inside."""

import warnings
from dataclasses import replace

import numpy as np
from numba import njit
from scipy.integrate import solve_ivp
from scipy.linalg import block_diag, eigh

import rom
from rom import rotation
from rom.body.records import Marker
from rom.body.stiffening import elastic_loads, known_loads
from rom.mbs.equations.equations import element_energy, evaluate, residual, tangents
from rom.mbs.equations.packing import pack
from rom.mbs.kernels.work import workspace

# Simeon, Modelling a flexible slider crank mechanism by a mixed system of DAEs and PDEs,
# Math. Modelling of Systems 2 (1996) 1; data as in the IVP test set, problem "crank".
CRANK = {"l1": 0.15, "l2": 0.30, "m1": 0.36, "m2": 0.151104, "m3": 0.075552, "J1": 0.002727}
CRANK |= {"J2": 0.0045339259, "E": 2e11, "h": 0.008, "rho": 7870.0, "speed": 150.0}


@njit
def residual_at(s, W, q, v, a, lam):
    evaluate(s, W, q, v)
    residual(s, W, q, v, a, lam)


@njit
def tangents_at(s, W, q, v, a, lam, c):
    evaluate(s, W, q, v)
    residual(s, W, q, v, a, lam)
    tangents(s, W, v, a, lam, c)


@njit
def stored_at(s, W, q, v):
    """Energy of all elements."""
    evaluate(s, W, q, v)
    return element_energy(s, W, q, v)


def nodal_body(x, Ms, phi, K=None, D=None, markers=None, name="body"):
    """Body of nodes x (N, 3), scalar mass matrix Ms (N, N), shapes phi (r, N, 3).

    Markers are {name: (point, translation (3, r), rotation (3, r))}.
    """
    r = phi.shape[0]
    Sxx = x.T @ Ms @ x
    M = np.einsum("kia,ij,lja->kl", phi, Ms, phi)
    K = np.zeros((r, r)) if K is None else K
    omega = np.sqrt(np.maximum(np.linalg.eigvals(np.linalg.solve(M, K)).real, 0)) if r else K[0]
    return rom.FlexibleBody(
        name=name,
        mass=float(Ms.sum()),
        first_moment=Ms.sum(axis=0) @ x,
        inertia=np.trace(Sxx) * np.eye(3) - Sxx,
        S=np.einsum("i,kia->ak", Ms.sum(axis=0), phi),
        Ibar_kl=np.einsum("ia,ij,kjb->abk", x, Ms, phi),
        S_kl=np.einsum("kia,ij,ljb->abkl", phi, Ms, phi),
        K=K,
        D=np.zeros((r, r)) if D is None else D,
        markers={
            key: Marker(key, *map(np.asarray, place), "rbe2", np.zeros((6, 6 + r)))
            for key, place in (markers or {}).items()
        },
        omega=np.sort(omega),
        labels=tuple(f"shape {k}" for k in range(r)),
    )


def nodal_residual(nodes, psi, state, a, gravity):
    """Equations of motion of nodes at x + phi q + psi q q / 2, by d'Alembert's principle."""
    x, Ms, phi, K, D = nodes
    q, qd, p, w = state
    A, r, n = rotation.matrix(p), len(phi), len(x)
    shape = phi + np.einsum("klia,l->kia", psi, q)
    P = x + np.einsum("k,kia->ia", q, 0.5 * (phi + shape))
    Pd = np.einsum("k,kia->ia", qd, shape)
    J = np.zeros((3 * n, 6 + r))
    for i in range(n):
        J[3 * i : 3 * i + 3, :3], J[3 * i : 3 * i + 3, 6:] = np.eye(3), A @ shape[:, i].T
        J[3 * i : 3 * i + 3, 3:6] = -A @ rotation.skew(P[i])
    curved = np.einsum("klia,k,l->ia", psi, qd, qd)
    conv = (np.cross(w, np.cross(w, P)) + 2 * np.cross(w, Pd) + curved) @ A.T
    found = J.T @ np.kron(Ms, np.eye(3)) @ (J @ a + conv.ravel() - np.tile(gravity, n))
    found[6:] += K @ q + D @ qd
    return found


def random_nodes(rng, n=7, r=4):
    """Nodes, scalar mass with off-diagonal entries, shapes, stiffness, damping."""
    x, phi = rng.normal(size=(n, 3)), 0.3 * rng.normal(size=(r, n, 3))
    B = rng.normal(size=(n, n))
    Ms = B @ B.T / n + 0.5 * np.eye(n)
    Ck, Cd = rng.normal(size=(r, r)), rng.normal(size=(r, r))
    return x, Ms, phi, 20 * (Ck @ Ck.T + np.eye(r)), 0.3 * Cd @ Cd.T


def random_body(rng, r=4, *, damped=True, stiffened=False):
    """A body whose two markers move and turn with the elastic coordinates."""
    x, Ms, phi, K, D = random_nodes(rng, r=r)
    twists = 0.4 * rng.normal(size=(2, 3, r))
    markers = {key: (x[i], phi[:, i].T, twists[i]) for i, key in enumerate("ab")}
    body = nodal_body(x, Ms, phi, K, D if damped else 0 * D, markers)
    if not stiffened:
        return body
    shapes = {load: rng.normal(size=(r, r)) for load in known_loads(body)}
    # amplitudes of shapes that squares of others change by a tenth are large for a body
    size = {load: 0.03 if load in elastic_loads(r) else 0.3 for load in shapes}
    return replace(body, K_geo={load: size[load] * (A + A.T) for load, A in shapes.items()})


def random_pose(rng):
    p = rng.normal(size=4)
    return {
        "at": rng.normal(size=3),
        "orientation": p / np.linalg.norm(p),
        "velocity": rng.normal(size=3),
        "omega": rng.normal(size=3),
    }


def two_soft(rng, gravity=(0, 0, 0), *, damped=True, stiffened=False):
    """A mechanism of two flexible bodies, anywhere and in any motion, and both of them."""
    mech = rom.Mechanism(gravity=gravity)
    bodies = (("one", {"stiffened": stiffened}), ("two", {"r": 3}))
    return mech, *(
        mech.add_flexible(name, random_body(rng, damped=damped, **kind), **random_pose(rng))
        for name, kind in bodies
    )


def random_state(rng, packed):
    """Coordinates with unit quaternions, velocities, accelerations, multipliers."""
    q = packed.q.copy()
    B = packed.system.bodies
    for at, r in zip(B.q_at, B.r, strict=True):
        q[at : at + 3] += rng.normal(size=3)
        p = rng.normal(size=4)
        q[at + 3 : at + 7] = p / np.linalg.norm(p)
        q[at + 7 : at + 7 + r] = 0.3 * rng.normal(size=r)
    n, m = packed.v.size, packed.system.rows.kind.size
    return q, rng.normal(size=n), rng.normal(size=n), rng.normal(size=m)


def prepared(mechanism):
    packed = pack(mechanism, whole=True)
    return packed, workspace(packed.system, len(packed.signals))


def simeon_rod(axial_mass_divisor=1.0):
    """Rod of the test set: two bending shapes, one quadratic axial element, chord frame.

    The published solution belongs to an axial mass without the factor 1/15 of the quadratic
    element; 15 gives the physical rod.
    """
    c, pi = CRANK, 3.1415927  # pi of the published program: its digits move q by 2e-7
    l, h, m = c["l2"], c["h"], c["m2"]
    A = h * h
    rAl = c["rho"] * A * l
    M = rAl * block_diag(0.5, 0.5, np.array([[8.0, 1.0], [1.0, 2.0]]) / axial_mass_divisor)
    EAl = c["E"] * A / l
    bending = pi**4 / 24 * (h / l) ** 2 * np.array([1, 16])
    K = EAl * block_diag(*bending, np.array([[16, -8], [-8, 7]]) / 3)
    S = rAl * np.array([[0, 0, 2 / 3, 1 / 6], [2 / pi, 0, 0, 0], [0, 0, 0, 0]])
    B = np.zeros((4, 4))
    B[0, 2], B[0, 3], B[1, 3] = -16 / pi**3, 8 / pi**3 - 1 / pi, 1 / (2 * pi)
    B = rAl * (B - B.T)
    Ibar, S_kl = np.zeros((3, 3, 4)), np.zeros((3, 3, 4, 4))
    Ibar[0, :2] = rAl * l * np.array([[0, 0, 1 / 3, 1 / 6], [1 / pi, -1 / (2 * pi), 0, 0]])
    S_kl[0, 0, 2:, 2:], S_kl[1, 1, :2, :2] = M[2:, 2:], M[:2, :2]  # axial, bending
    # B holds integrals of phi_i x phi_k = -(bending i) (axial k)
    S_kl[1, 0, :2, 2:], S_kl[0, 1, 2:, :2] = -B[:2, 2:], -B[:2, 2:].T
    tip, zero = np.zeros((2, 3, 4))
    tip[0, 3] = 1.0
    return rom.FlexibleBody(
        name="rod",
        mass=m,
        first_moment=np.array([m * l / 2, 0, 0]),
        inertia=c["J2"] * np.diag([1e-3, 1, 1]),
        S=S,
        Ibar_kl=Ibar,
        S_kl=S_kl,
        K=K,
        D=0 * K,
        markers={
            "a": Marker("a", np.zeros(3), zero, zero, "rbe2", np.zeros((6, 10))),
            "b": Marker("b", np.array([l, 0, 0]), tip, zero, "rbe2", np.zeros((6, 10))),
        },
        omega=np.zeros(4),
        labels=("bending 1", "bending 2", "axial mid", "axial end"),
    )


def simeon_crank(axial_mass_divisor=1.0, start=None):
    """The slider-crank of the test set with its initial values (or others: q and qd)."""
    c = CRANK
    q, qd = start or (
        [0.0, 0.0, 1.03339863e-5, 1.69327969e-5],
        [0.444896112581599, 4.634339319238670e-3, -1.78591076e-6, -2.68938672e-6],
    )
    mech, speed, l1 = rom.Mechanism(gravity=(0, 0, 0)), c["speed"], c["l1"]
    half, across = np.array([l1 / 2, 0, 0]), c["J1"] - c["m1"] * l1**2 / 4
    solid = {"mass": c["m1"], "inertia": (1e-4, across, across), "at": half}
    moving = {"velocity": (0, speed * l1 / 2, 0), "omega": (0, 0, speed)}
    mech.add_rigid("crank", **solid, markers={"o": -half, "a": half}, **moving)
    moving = {"velocity": (0, speed * l1, 0), "omega": (0, 0, -74.99576703969453)}
    mech.add_flexible("rod", simeon_rod(axial_mass_divisor), at=(l1, 0, 0), **moving, q=q, qd=qd)
    solid = {"mass": c["m3"], "inertia": (1e-5,) * 3, "at": (l1 + c["l2"] + q[3], 0, 0)}
    mech.add_rigid("slider", **solid, markers={"b": (0, 0, 0)}, velocity=(qd[3], 0, 0))
    return joined_crank(mech, speed)


def joined_crank(mech, speed):
    """A crank that is driven, a rod and a slider on a guide, joined."""
    z = (0, 0, 1)
    mech.revolute("main", "ground", "crank.o", axis=z)
    mech.revolute("pin", "crank.a", "rod.a", axis=z)
    mech.revolute("wrist", "rod.b", "slider.b", axis=z)
    mech.prismatic("guide", "ground", "slider.b", axis=(1, 0, 0))
    mech.drive("motor", "main", lambda t: speed * t, rate=lambda t: speed, acceleration=lambda t: 0)
    return mech


def simulate_quietly(mechanism, **options):
    """Simulate a mechanism whose redundant constraints, and start beside its joints, are known."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rom.RomWarning)
        return rom.simulate(mechanism, **{"assemble": True} | options)


def slider_crank(l1=0.1, l2=0.3, speed=50.0, gravity=0.0, rod=None):
    """Driven slider-crank in the xy plane with a rigid rod, or a flexible one in the rod frame."""
    mech = rom.Mechanism(gravity=(0, -gravity, 0))
    start = {"velocity": (0, speed * l1, 0), "omega": (0, 0, -speed * l1 / l2)}
    solid = {"mass": 1.0, "inertia": (1e-3, 1e-3, 2e-3), "at": (0, 0, 0), "omega": (0, 0, speed)}
    mech.add_rigid("crank", **solid, markers={"o": (0, 0, 0), "a": (l1, 0, 0)})
    if rod is None:
        start["velocity"] = (0, speed * l1 / 2, 0)
        solid = {"mass": 0.5, "inertia": (1e-4, 4e-3, 4e-3), "at": (l1 + l2 / 2, 0, 0)}
        ends = {"a": (-l2 / 2, 0, 0), "b": (l2 / 2, 0, 0)}
        mech.add_rigid("rod", **solid, markers=ends, **start)
    else:
        at = np.array([l1, 0, 0]) - rod.marker("a").point  # whatever its frame is
        mech.add_flexible("rod", rod, at=at, **start)
    solid = {"mass": 0.4, "inertia": (1e-4,) * 3, "at": (l1 + l2, 0, 0)}
    mech.add_rigid("slider", **solid, markers={"b": (0, 0, 0)})
    return joined_crank(mech, speed)


def crank_torque(angle, l1=0.1, l2=0.3, speed=50.0, gravity=0.0):
    """Of the drive of `slider_crank`: Lagrange's equation, its derivatives by complex step."""
    step = 1e-30
    angle = angle + 1j * step
    sine = -l1 / l2 * np.sin(angle)
    cosine = np.sqrt(1 - sine**2)
    turn = -l1 / l2 * np.cos(angle) / cosine  # of the rod, per radian
    x = -l1 * np.sin(angle) - l2 / 2 * sine * turn
    y = l1 * np.cos(angle) + l2 / 2 * cosine * turn
    slide = -l1 * np.sin(angle) - l2 * sine * turn
    inertia = 2e-3 + 0.5 * (x**2 + y**2) + 4e-3 * turn**2 + 0.4 * slide**2
    height = 0.5 * gravity * (l1 * np.sin(angle) + l2 / 2 * sine)
    return (0.5 * inertia.imag * speed**2 + height.imag) / step


def lattice(sections=5, stiffness=4e3, length=1.0, mass=1.0):
    """Nodes (N, 3), pairs (s, 2) on springs, stiffness (s,), point masses (N,): three a section."""
    angles = 2 * np.pi * np.arange(3) / 3
    ring = 0.15 * np.column_stack([np.zeros(3), np.cos(angles), np.sin(angles)])
    along = np.array([length / (sections - 1), 0, 0])
    x = np.concatenate([ring + k * along for k in range(sections)])
    n = x.shape[0]
    pairs = np.array([(i, j) for i in range(n) for j in range(i + 1, n) if j // 3 - i // 3 <= 1])
    return x, pairs, np.full(len(pairs), stiffness), np.full(n, mass / n)


def lattice_body(lattice_data):
    """All elastic modes of the lattice, mean-axis frame at the world origin; markers n0, n1, ..."""
    x, pairs, k, masses = lattice_data
    n = x.shape[0]
    K = np.zeros((3 * n, 3 * n))
    for (i, j), stiffness in zip(pairs, k, strict=True):
        e = (x[j] - x[i]) / np.linalg.norm(x[j] - x[i])
        b = np.zeros(3 * n)
        b[3 * i : 3 * i + 3], b[3 * j : 3 * j + 3] = -e, e
        K += stiffness * np.outer(b, b)
    lam, V = eigh(K, np.diag(np.repeat(masses, 3)))
    assert lam[5] < 1e-8 * lam[-1] < lam[6]
    phi = V[:, 6:].T.reshape(-1, n, 3)
    none = np.zeros((3, phi.shape[0]))
    markers = {f"n{i}": (x[i], phi[:, i].T, none) for i in range(n)}
    return nodal_body(x, np.diag(masses), phi, np.diag(lam[6:]), markers=markers, name="lattice")


def lattice_motion(lattice_data, times, y0, v0, outer, held=()):
    """Positions (n_t, N, 3) of nodes under springs that turn with their ends and forces (t, y)."""
    x, pairs, k, masses = lattice_data
    n, (i, j) = x.shape[0], pairs.T
    rest = np.linalg.norm(x[j] - x[i], axis=1)

    def rhs(t, state):
        y, v = state.reshape(2, n, 3)
        gap = y[j] - y[i]
        now = np.linalg.norm(gap, axis=1)
        pull = (k * (now - rest) / now)[:, None] * gap
        f = np.array(outer(t, y))
        np.add.at(f, i, pull)
        np.add.at(f, j, -pull)
        a = f / masses[:, None]
        a[list(held)] = 0.0
        return np.concatenate([v, a]).ravel()

    start = np.concatenate([y0, v0]).ravel()
    y = solve_ivp(rhs, (0.0, times[-1]), start, "DOP853", times, rtol=1e-9, atol=1e-11).y
    return y.T.reshape(-1, 2, n, 3)[:, 0]


def rotor(speed, *, across=0.3, along=0.5, kx=300.0, ky=500.0):
    """A disc on a ball joint, turning about z, two springs against its tilt."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    marks = {"c": (0, 0, 0), "tip": (0, 0, 1)}
    disc = mech.add_rigid("disc", mass=4.0, inertia=(across, across, along), at=(0, 0, 0),
                          omega=(0, 0, speed), markers=marks)  # fmt: skip
    mech.spherical("ball", mech.ground.marker((0, 0, 0)), disc.marker("c"))
    for name, k, far in (("x", kx, (3, 0, 1)), ("y", ky, (0, 3, 1))):
        mech.spring_damper(name, mech.ground.marker(far), disc.marker("tip"), stiffness=k)
    return mech
