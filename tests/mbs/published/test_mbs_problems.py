"""Reference problems of multibody dynamics against published numbers and Lagrange's equations.

A01 to A05 are those of the benchmark library of IFToMM (Gonzalez, Dopico, Lugris, Cuadrado: A
benchmarking system for MBS simulation software, Multibody Syst. Dyn. 16, 2006, 179).
"""

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import ellipj, ellipk

import rom
from cases.mbs.lagrange import jacobian, lagrange, potential_force
from cases.mbs.mechanisms import simulate_quietly
from cases.mbs.parts import X, Y, Z, slender, turned

g = 9.81
# A04, Bricard's linkage: six links of 1 m, each hinge normal to both and to its neighbours: no
# degree of freedom by count, one in fact. Of three-fold symmetry: angles of hinges alternate, the
# loop closes where cos phi + cos theta + cos phi cos theta = 0. It starts as six edges of a cube.
WIDTH = 0.1  # of the square section
TWIST = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # a quarter turn about x


def rod_points(a, b, mass=1.0):
    """What moves of a slender rod: its kinetic energy is m / 6 (va^2 + va vb + vb^2)."""
    return np.sqrt(mass / 6) * np.concatenate([a, b, a + b])


@pytest.mark.parametrize(("options", "limit"), [({"method": "dop853", "dt": 0.05}, 1e-8),
                                                ({"dt": 1e-3}, 3e-4)])  # fmt: skip
def test_a_simple_pendulum_from_the_horizontal_for_ten_seconds(options, limit):
    """A01: sin(theta / 2) = k cd(omega t, k) from an amplitude of 90 degrees, k = sin 45."""
    mech = rom.Mechanism(gravity=(0, -g, 0))
    mech.add_rigid("bob", mass=1.0, inertia=(1, 1, 1), at=-X)
    mech.distance("rod", "ground", "bob")
    sol = rom.simulate(mech, t_end=10.0, **options)
    sn, _, _, _ = ellipj(ellipk(0.5) - np.sqrt(g) * sol.t, 0.5)
    theta = -2 * np.arcsin(np.sqrt(0.5) * sn)
    path = np.column_stack([np.sin(theta), -np.cos(theta), 0 * theta])
    assert_allclose(sol.position("bob"), path, atol=limit)
    assert np.abs(sol.energy.balance).max() < 10 * limit
    pull = np.linalg.norm(sol.reaction("rod")[:, :3], axis=1)
    assert_allclose(pull, 3 * g * np.cos(theta), atol=100 * limit)


# 1.9 ms: with 2 ms a step of four ends so near to the singular position that Newton's iteration is
# left without a direction on some processors, whose round-off differs
@pytest.mark.parametrize(("n", "dt"), [(2, 2e-3), (4, 1.9e-3)])
def test_four_bars_in_a_row_pass_their_singular_positions(n, dt):
    """A02: 2 n + 1 rods of 1 m and 1 kg, upright; the upper ends start with 1 m/s."""

    def points(q):
        up = np.array([np.sin(q[0]), np.cos(q[0])])
        return np.concatenate([rod_points(0 * up, up)] * (n + 1) + [up] * n)

    weight = potential_force(lambda q: g * np.cos(q[0]) * ((n + 1) / 2 + n))
    mech, last = rom.Mechanism(gravity=(0, -g, 0)), None
    for k in range(n + 1):
        crank = slender(mech, f"crank {k}", (k, 0.0), (k, 1.0), velocity=X / 2, omega=-Z)
        mech.revolute(f"A{k}", mech.ground.marker((k, 0, 0)), crank.marker("a"), axis=Z)
        if last is not None:
            bar = slender(mech, f"bar {k}", (k - 1, 1.0), (k, 1.0), velocity=X)
            mech.revolute(f"B{k}", last.marker("b"), bar.marker("a"), axis=Z)
            mech.revolute(f"C{k}", bar.marker("b"), crank.marker("b"), axis=Z)
        last = crank
    sol = simulate_quietly(mech, t_end=4.0, dt=dt, rho_inf=1.0)
    angle = lagrange(points, weight, np.zeros(1), np.ones(1), sol.t)[0]
    assert angle[-1] > 3 * np.pi  # the horizontal is passed three times
    path = np.column_stack([np.sin(angle), np.cos(angle)])
    for k in range(n + 1):
        assert_allclose(sol.position(f"crank {k}", "b")[:, :2] - [k, 0], path, atol=4e-4)
    assert_allclose(sol.energy.total, sol.energy.total[0], rtol=2e-4)


# A03, Andrews' squeezer: Schiehlen, Multibody Systems Handbook (1990) 10; Hairer, Wanner, Solving
# Ordinary Differential Equations II, VII.7; IVP test set, problem "andrews", whose names these are.
S = {
    "m": (0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498),
    "I": (2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5),
    "A": np.array([-0.06934, -0.00227]), "B": np.array([-0.03635, 0.03273]),
    "C": np.array([0.014, 0.072]), "c0": 4530.0, "l0": 0.07785, "mom": 0.033,
    "d": 0.028, "da": 0.0115, "e": 0.02, "ea": 0.01421, "rr": 0.007, "ra": 0.00092, "ss": 0.035,
    "sa": 0.01874, "sb": 0.01043, "sc": 0.018, "sd": 0.02, "ta": 0.02308, "tb": 0.00916,
    "u": 0.04, "ua": 0.01228, "ub": 0.00449, "zf": 0.02, "zt": 0.04, "fa": 0.01421,
}  # fmt: skip
# beta, theta, gamma, phi, delta, omega, epsilon at the start and after 0.03 s
SQUEEZER_START = np.array([
    -0.0617138900142764496, 0.0, 0.455279819163070380, 0.222668390165885885, 0.487364979543842550,
    -0.222668390165885885, 1.23054744454982119,
])  # fmt: skip
SQUEEZER_END = np.array([
    15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948,
    0.5244099658805304, 0.5347301163226948, 1.048080741042263,
])  # fmt: skip


def ray(angle):
    return np.array([np.cos(angle), np.sin(angle)])


def normal(angle):
    return np.array([-np.sin(angle), np.cos(angle)])


def squeezer_angles(q):
    """(7,) angle of each body in the plane."""
    beta, theta, gamma, phi, delta, omega, epsilon = q
    return np.array([beta, beta + theta, gamma, phi + delta, delta, omega + epsilon, epsilon])


def squeezer_geometry(q):
    """(7, 2) mass centres, and points: crank pin, the common point F thrice, G, H, spring end D."""
    b, bt, gamma, pd, delta, oe, eps = squeezer_angles(q)
    pin, A, B = S["rr"] * ray(b), S["A"], S["B"]
    F = pin - S["d"] * ray(bt)
    G, H = A + S["zt"] * ray(delta), A - S["u"] * normal(eps)
    centres = [
        S["ra"] * ray(b), pin - S["da"] * ray(bt),
        B + S["sa"] * ray(gamma) + S["sb"] * normal(gamma),
        G - (S["e"] - S["ea"]) * normal(pd), A + S["ta"] * ray(delta) + S["tb"] * normal(delta),
        H + (S["zf"] - S["fa"]) * ray(oe), A + S["ua"] * ray(eps) - S["ub"] * normal(eps),
    ]  # fmt: skip
    others = (B - S["ss"] * normal(gamma), G - S["e"] * normal(pd), H + S["zf"] * ray(oe))
    D = B + S["sd"] * ray(gamma) - S["sc"] * normal(gamma)
    return np.array(centres), pin, F, others, G, H, D


def squeezer():
    centres, pin, F, _, G, H, D = squeezer_geometry(SQUEEZER_START)
    angles = squeezer_angles(SQUEEZER_START)
    points = {1: {"O": np.zeros(2), "pin": pin}, 2: {"pin": pin, "F": F},
              3: {"B": S["B"], "F": F, "D": D}, 4: {"G": G, "F": F}, 5: {"A": S["A"], "G": G},
              6: {"H": H, "F": F}, 7: {"A": S["A"], "H": H}}  # fmt: skip
    mech = rom.Mechanism(gravity=(0, 0, 0))
    for k, places in points.items():
        J, R = S["I"][k - 1], turned(angles[k - 1])
        mech.add_rigid(
            f"K{k}", mass=S["m"][k - 1], inertia=(J, J, J), at=(*centres[k - 1], 0), orientation=R,
            markers={n: R.T @ (*(x - centres[k - 1]), 0) for n, x in places.items()},
        )  # fmt: skip
    ground = mech.ground
    for k, name in ((1, "O"), (3, "B"), (5, "A"), (7, "A")):
        at = {"O": np.zeros(2)} | S
        mech.revolute(f"{name}{k}", ground.marker((*at[name], 0)), f"K{k}.{name}", axis=Z)
    pairs = {(1, 2): "pin", (2, 3): "F", (2, 4): "F", (2, 6): "F", (4, 5): "G", (6, 7): "H"}
    for (i, j), name in pairs.items():
        mech.revolute(f"{name}{i}{j}", f"K{i}.{name}", f"K{j}.{name}", axis=Z)
    law = {"stiffness": S["c0"], "free_length": S["l0"]}
    mech.spring_damper("spring", ground.marker((*S["C"], 0)), "K3.D", **law)
    mech.motor("motor", "O1", lambda t, angle, rate: 0.033)
    return mech


@pytest.mark.long
@pytest.mark.once
def test_andrews_squeezer_ends_where_it_was_published():
    def points(q):
        centres = squeezer_geometry(q)[0] * np.sqrt(S["m"])[:, None]
        return np.concatenate([centres.ravel(), squeezer_angles(q) * np.sqrt(S["I"])])

    def closed(q):
        _, _, F, others, *_ = squeezer_geometry(q)
        return np.concatenate([F - x for x in others])

    def spring(q):
        stretch = np.sqrt(((squeezer_geometry(q)[-1] - S["C"]) ** 2).sum()) - S["l0"]
        return 0.5 * S["c0"] * stretch**2 - S["mom"] * q[0]

    t = np.linspace(0, 0.03, 4)
    force, start = potential_force(spring), SQUEEZER_START
    found = lagrange(points, force, start, 0 * start, t, closed=closed, rtol=1e-8)
    assert_allclose(found[:7, -1], SQUEEZER_END, atol=1e-7)
    sol = simulate_quietly(squeezer(), t_end=0.03, dt=1e-5, rho_inf=1.0, save_every=1000)
    assert sol.statistics["redundant"] == 9
    for k in range(7):
        p, exact = sol.orientation(f"K{k + 1}"), [squeezer_angles(x)[k] for x in found[:7].T]
        assert_allclose(ray(2 * np.arctan2(p[:, 3], p[:, 0])), ray(np.array(exact)), atol=2e-4)
    assert sol.base[-1, 0] == pytest.approx(SQUEEZER_END[0] - SQUEEZER_START[0], abs=2e-4)


def bricard_links(q):
    """Place and orientation of the five moving links, the first one held along x."""
    p, R = X, TWIST
    for k in range(1, 6):
        R = R @ turned(q[k % 2])
        yield p, R
        p = p + R[:, 0]
        R = R @ (TWIST.T if k % 2 else TWIST)


@pytest.mark.long
def test_bricards_linkage_moves_although_it_is_overconstrained():
    def points(q):
        moment = np.sqrt([1 / 12, WIDTH**2 / 12, WIDTH**2 / 12])
        links = bricard_links(q)
        return np.concatenate([x for p, R in links for x in (p + 0.5 * R[:, 0], *(R * moment).T)])

    def closed(q):
        c = np.cos(q)
        return np.array([c[0] + c[1] + c[0] * c[1]])

    height = potential_force(lambda q: g * sum(p[1] + 0.5 * R[1, 0] for p, R in bricard_links(q)))
    mech, start = rom.Mechanism(gravity=(0, -g, 0)), np.array([1.0, 1.0]) * np.pi / 2
    last, across = mech.ground.marker(X), 1 / 12 + WIDTH**2 / 12
    for k, (p, R) in enumerate(bricard_links(start)):
        solid = {"mass": 1.0, "inertia": (WIDTH**2 / 6, across, across)}
        link = mech.add_rigid(f"link {k}", **solid, at=p + 0.5 * R[:, 0], orientation=R)
        mech.revolute(f"hinge {k}", last, link.marker(-X / 2), axis=R[:, 2])
        last = link.marker(X / 2)
    mech.revolute("hinge 5", last, mech.ground.marker((0, 0, 0)), axis=Z)
    with pytest.warns(rom.RomWarning, match="1 of 30 constraints"):
        sol = rom.simulate(mech, t_end=3.0, dt=2e-3, rho_inf=1.0)
    q = lagrange(points, height, start, 0 * start, sol.t, closed=closed)[:2]
    links = np.array([[p + R[:, 0] for p, R in bricard_links(x)] for x in q.T])
    assert np.ptp(q, axis=1).min() > np.pi
    for k in range(5):
        assert_allclose(sol.position(f"link {k}", X / 2), links[:, k], atol=4e-4)
    assert rom.audit(sol).ok, rom.audit(sol)


@pytest.mark.long
@pytest.mark.once
def test_a_flyball_governor_with_stiff_couplers():
    """A05: arms of 1 m at 30 degrees to the shaft, balls of 5 kg, a slider of 3 kg, 1 turn/s."""
    m, ball, slide, width, k, c, rest = 0.3, 5.0, 3.0, 0.01, 8e5, 4e4, 0.5
    slim = np.sqrt(m * width**2 / 12)
    speed, lean = 2 * np.pi, np.pi / 6

    def arm(psi, alpha):
        """Directions along the arm, of its hinge, and normal to both."""
        out = np.array([np.cos(psi), 0 * psi, -np.sin(psi)])
        side = np.array([np.sin(psi), 0 * psi, np.cos(psi)])
        along = np.sin(alpha) * out - np.cos(alpha) * Y
        return along, side, np.cos(alpha) * out + np.sin(alpha) * Y

    def points(q):
        along, side, across = arm(q[0], q[1])
        one = [0.5 * np.sqrt(m) * along, np.sqrt(m / 12) * along, np.sqrt(ball) * along]
        one += [slim * side, slim * across]
        turning = np.sqrt(slide * 0.1**2 / 6 + m * width**2 / 6) * q[:1]
        return np.concatenate([*one, *one, np.sqrt(slide) * q[2:], turning])

    def coupler(q):
        return np.sqrt((0.5 * np.sin(q[1:2])) ** 2 + (q[2:] - 0.5 * np.cos(q[1:2])) ** 2)

    def force(q, v):
        stretch, slope = coupler(q)[0] - rest, jacobian(coupler, q)[0]
        pull = k * stretch + c * slope @ v
        weight = -2 * g * (0.5 * m + ball) * np.sin(q[1]) * np.array([0, 1, 0])
        return weight + np.array([0, 0, slide * g]) - 2 * pull * slope

    mech = rom.Mechanism(gravity=(0, -g, 0))
    J = m / 12
    mech.add_rigid("shaft", mass=m, inertia=(J, m * width**2 / 6, J), at=-0.5 * Y,
                   markers={"top": 0.5 * Y}, omega=speed * Y)  # fmt: skip
    mech.revolute("bearing", "ground", "shaft.top", axis=Y)
    start = np.array([0.0, lean, np.cos(lean)])
    turning = {"inertia": (slide * 0.1**2 / 6,) * 3, "omega": speed * Y}
    mech.add_rigid("slider", mass=slide, at=-start[2] * Y, **turning)
    mech.prismatic("guide", "shaft.top", "slider", axis=-Y)
    centre, whole = (0.5 * m + ball) / (m + ball), m + ball
    moment = m / 3 + m * width**2 / 12 + ball - whole * centre**2
    for side in (0, 1):
        R = np.column_stack(arm(np.pi * side, lean)).T[[0, 2, 1]].T
        R[:, 2] = np.cross(R[:, 0], R[:, 1])
        mech.add_rigid(
            f"arm {side}", mass=whole, inertia=(m * width**2 / 6, moment, moment),
            at=centre * R[:, 0], orientation=R, omega=R.T @ (speed * Y),
            velocity=np.cross(speed * Y, centre * R[:, 0]),
            markers={"top": -centre * X, "middle": (0.5 - centre) * X, "ball": (1 - centre) * X},
        )  # fmt: skip
        mech.revolute(f"hinge {side}", "shaft.top", f"arm {side}.top", axis=R[:, 2])
        law = {"stiffness": k, "damping": c, "free_length": rest}
        mech.spring_damper(f"coupler {side}", f"arm {side}.middle", "slider", **law)
    sol = rom.simulate(mech, t_end=2.0, dt=2e-3)
    q = lagrange(points, force, start, speed * np.array([1.0, 0, 0]), sol.t[::100],
                 method="LSODA", rtol=1e-9)  # fmt: skip
    assert np.ptp(q[2]) > 0.2 and np.ptp(q[3]) > 3.0
    assert_allclose(sol.position("slider")[::100, 1], -q[2], atol=3e-5)
    assert_allclose(sol.position("arm 0", "ball")[::100, 1], -np.cos(q[1]), atol=3e-5)
    assert_allclose(sol.omega("shaft")[::100, 1], q[3], atol=6e-4)


@pytest.mark.long
@pytest.mark.once
def test_a_folded_chain_falls():
    n, length = 8, 0.25
    start = np.array([0.05] * (n // 2) + [np.pi - 0.05] * (n // 2))

    def joints(q):
        steps = length * np.column_stack([np.sin(q), -np.cos(q)])
        return np.cumsum(np.vstack([[0 * q[0], 0 * q[0]], steps]), axis=0)

    def points(q):
        P = joints(q)
        return np.concatenate([rod_points(a, b) for a, b in pairwise(P)])

    def height(q):
        P = joints(q)[:, 1]
        return g * 0.5 * (P[:-1] + P[1:]).sum()

    mech = rom.Mechanism(gravity=(0, -g, 0))
    P, last = joints(start), mech.ground.marker((0, 0, 0))
    for k in range(n):
        link = slender(mech, f"link {k}", P[k], P[k + 1])
        mech.revolute(f"pin {k}", last, link.marker("a"), axis=Z)
        last = link.marker("b")
    sol = rom.simulate(mech, t_end=0.45, dt=5e-4, rho_inf=1.0)
    q = lagrange(points, potential_force(height), start, np.zeros(n), sol.t[::30])[:n]
    path = np.array([joints(x)[1:] for x in q.T])
    assert np.ptp(path[:, -1, 1]) > 0.6
    for k in range(n):
        assert_allclose(sol.position(f"link {k}", "b")[::30, :2], path[:, k], atol=5e-5)
