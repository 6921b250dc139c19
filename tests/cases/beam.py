"""Planar beams of Hermite elements, a body made of one, and its spin-up; the elastica."""

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import brentq
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

from rom.body.flexible import FlexibleBody
from rom.body.records import Marker
from rom.mbs.integrate.simulation import simulate
from rom.mbs.mechanism import Mechanism

N = 40  # elements


def hermite_beam(n=N):
    """K and M (2 n + 2 dofs: w, theta per node) of the free beam with L = EI = m = 1."""
    h = 1.0 / n
    k = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]]) / h**3
    m = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]])
    lengths = np.outer([1, h, 1, h], [1, h, 1, h])
    K, M = np.zeros((2 * n + 2,) * 2), np.zeros((2 * n + 2,) * 2)
    for e in range(n):
        dofs = slice(2 * e, 2 * e + 4)
        K[dofs, dofs] += k * lengths
        M[dofs, dofs] += m * lengths * h / 420
    return K, M


ENDS = [0, 1, 2 * N, 2 * N + 1]
FREE_FREE = 22.37328
CANTILEVER = 3.516015
PINNED = 9.869604
FLAP = {  # Southwell's beam: exact flapwise frequencies by speed, in sqrt(EI / m L^3)
    0: (3.51601527, 22.0344916, 61.6972144),
    1: (3.68164681, 22.1810112, 61.8417626, 121.050922),
    5: (6.44954475, 25.4460804, 65.2050405, 124.566421),
    12: (13.1701505, 37.6031123, 79.6144785, 140.534354),
}
FLAP_ON_HUB = {1: (3.8888235, 22.3750143), 10: (16.6063628, 44.3682239)}  # as long as itself


def gauss_hermite(n, length):
    """Points x (g,), weights (g,), slopes (g, 2 n + 2) and values of the beam functions."""
    xi, weight = np.polynomial.legendre.leggauss(5)
    xi, h = 0.5 * (xi + 1), length / n
    x = np.concatenate([(e + xi) * h for e in range(n)])
    values, slopes = np.zeros((x.size, 2 * n + 2)), np.zeros((x.size, 2 * n + 2))
    H = np.array([1 - 3 * xi**2 + 2 * xi**3, h * (xi - 2 * xi**2 + xi**3),
                  3 * xi**2 - 2 * xi**3, h * (xi**3 - xi**2)])  # fmt: skip
    dH = np.array([6 * xi**2 - 6 * xi, h * (1 - 4 * xi + 3 * xi**2),
                   6 * xi - 6 * xi**2, h * (3 * xi**2 - 2 * xi)]) / h  # fmt: skip
    for e in range(n):
        block = (slice(5 * e, 5 * e + 5), slice(2 * e, 2 * e + 4))
        values[block], slopes[block] = H.T, dH.T
    return x, np.tile(0.5 * weight * h, n), values, slopes


def stiffened_beam(length=1.0, EI=1.0, rhoA=1.0, *, n_modes=20, stiffened=True):
    """Cantilever along x that bends along y, its frame on the root; modes as shapes.

    The geometric stiffness of a load with the tension N(x) is the integral of N w_k' w_l'.
    """
    n, r = 40, n_modes
    K, M = (A[2:, 2:] for A in hermite_beam(n))
    D = np.tile([1.0, length], n)  # the slope of a beam of unit length
    K, M = EI / length**3 * K * np.outer(D, D), rhoA * length * M * np.outer(D, D)
    lam, V = eigh(K, M, subset_by_index=(0, r - 1))
    x, weight, values, slopes = gauss_hermite(n, length)
    w, dw = values[:, 2:] @ V, slopes[:, 2:] @ V
    line = rhoA * weight
    S, Ibar, S_kl = np.zeros((3, r)), np.zeros((3, 3, r)), np.zeros((3, 3, r, r))
    S[1], Ibar[0, 1], S_kl[1, 1] = line @ w, (line * x) @ w, (w.T * line) @ w
    tension = {
        "omega_y^2": 0.5 * rhoA * (length**2 - x**2),
        "omega_z^2": 0.5 * rhoA * (length**2 - x**2),
        "a_x": -rhoA * (length - x),
        "tip f_x": np.ones_like(x),
    }
    K_geo = {load: (dw.T * (weight * N)) @ dw for load, N in tension.items()}
    tip, turn = np.zeros((3, r)), np.zeros((3, r))
    tip[1], turn[2] = V[-2], V[-1]
    mass, hold = rhoA * length, np.zeros((6, 6 + r))
    hold[:, :6] = np.eye(6)
    arm = hold.copy()
    arm[1, 5], arm[2, 4], arm[1, 6:], arm[5, 6:] = length, -length, V[-2], V[-1]
    zero = np.zeros((3, r))
    return FlexibleBody(
        name="beam",
        mass=mass,
        first_moment=np.array([mass * length / 2, 0, 0]),
        inertia=mass * length**2 / 3 * np.diag([1e-6, 1.0, 1.0]),
        S=S,
        Ibar_kl=Ibar,
        S_kl=S_kl,
        K=np.diag(lam),
        D=np.zeros((r, r)),
        markers={
            "root": Marker("root", np.zeros(3), zero, zero, "rbe2", hold),
            "tip": Marker("tip", np.array([length, 0, 0]), tip, turn, "rbe2", arm),
        },
        omega=np.sqrt(lam),
        labels=tuple(f"bending {k + 1}" for k in range(r)),
        reference="root",
        K_geo={k: 0.5 * (A + A.T) for k, A in K_geo.items()} if stiffened else {},
    )


def spin_up(body, speed, t_end, *, duration=15.0, **options):
    """The base turns from rest to a speed; tip deflection (u, v) in the frame of the base."""
    rate = 2 * np.pi / duration
    mech = Mechanism(gravity=(0, 0, 0))
    beam = mech.add_flexible("beam", body)
    mech.revolute("base", mech.ground.marker((0, 0, 0)), beam.marker("root"), axis=(0, 0, 1))

    def angle(t):
        if t >= duration:
            return speed * (t - duration / 2)
        return speed / duration * (t**2 / 2 + (np.cos(rate * t) - 1) / rate**2)

    def velocity(t):
        return speed / duration * (t - np.sin(rate * t) / rate) if t < duration else speed

    def acceleration(t):
        return speed / duration * (1 - np.cos(rate * t)) if t < duration else 0.0

    mech.drive("motor", "base", angle, rate=velocity, acceleration=acceleration)
    sol = simulate(mech, t_end=t_end, **{"dt": 5e-3, "rho_inf": 0.9} | options)
    psi = np.array([angle(t) for t in sol.t])
    tip, arm = sol.position("beam", "tip"), body.marker("tip").point - body.marker("root").point
    u = np.cos(psi) * tip[:, 0] + np.sin(psi) * tip[:, 1] - arm[0]
    return sol, u, np.cos(psi) * tip[:, 1] - np.sin(psi) * tip[:, 0]


def load_at(slope):
    """P L^2 / EI at a slope of the tip [rad]."""
    m = (1 + np.sin(slope)) / 2
    return (ellipk(m) - ellipkinc(np.arcsin(np.sqrt(0.5 / m)), m)) ** 2


def elastica(load):
    """Slope of the tip [rad], and its place along and across over the length, under P L^2 / EI.

    A cantilever that is thin, inextensible and pushed across. With the slope a of the tip,
    k^2 = (1 + sin a) / 2 and sin b = 1 / (k sqrt 2): sqrt(load) = K(k) - F(b, k), along
    x / L = sqrt(2 sin a / load), across z / L = 1 - 2 (E(k) - E(b, k)) / sqrt(load).
    Bisshopp, Drucker, Large deflection of cantilever beams, Quart. Appl. Math. 3 (1945) 272.
    """
    slope = brentq(lambda a: load_at(a) - load, 1e-9, np.pi / 2 - 1e-12, xtol=1e-15)
    m = (1 + np.sin(slope)) / 2
    bent = ellipe(m) - ellipeinc(np.arcsin(np.sqrt(0.5 / m)), m)
    return slope, np.sqrt(2 * np.sin(slope) / load), 1 - 2 * bent / np.sqrt(load)
