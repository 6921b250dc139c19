"""Rods at rest: derivatives, objectivity, order, and beams that others have bent before."""

from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

import rom
from cases.components.rods import moved, slopes
from cases.long import few
from cases.refusals import refuses
from rom import rotation
from rom.components import cosserat
from rom.components.cosserat import along, equilibrium, linearised, loads, reference, rod, straight
from rom.components.cosserat.linear_pieces import bend_in_pieces, cut
from rom.components.wind.wind_turbine import blade
from rom.errors import ConfigError, ModelError, SolverError

STIFF = 1e6  # against bending rigidities of one: neither shear nor stretch


def crooked(rng, n=4):
    x = np.cumsum(rng.normal(size=(n + 1, 3)), axis=0)
    p = np.array([rotation.exp(0.7 * rng.normal(size=3)) for _ in range(n + 2)])
    return rod(x, p, stretch=rng.uniform(1, 2, (n, 3)), bend=rng.uniform(1, 2, (n + 1, 3)))


def test_forces_and_tangent_are_derivatives_of_the_energy():
    rng = np.random.default_rng(0)
    one = crooked(rng)
    n = 6 * one.h.size + 9
    shape = moved(reference(one), 0.3 * rng.normal(size=n))
    load = rng.normal(size=one.x.shape), rng.normal(size=(len(one.p), 3))
    r, _ = linearised(one, shape)
    by_shape = slopes(lambda d: cosserat.elastic_energy(one, moved(shape, d)), n)
    assert_allclose(r, by_shape, atol=1e-8)
    by_shape = slopes(lambda d: linearised(one, moved(shape, d), load)[0], n)
    assert_allclose(linearised(one, shape, load)[1], by_shape, atol=1e-8)


def test_reference_has_no_stress_and_a_rigid_motion_changes_nothing():
    one = crooked(np.random.default_rng(1))
    assert_allclose(linearised(one, reference(one))[0], 0, atol=1e-14)
    assert cosserat.elastic_energy(one, reference(one)) < 1e-28
    rng = np.random.default_rng(2)
    one = crooked(rng)
    shape = moved(reference(one), 0.3 * rng.normal(size=6 * one.h.size + 9))
    turn, away = rotation.exp([1.0, -2.0, 0.5]), [3.0, -1.0, 2.0]
    A = rotation.matrix(turn)
    carried_p = np.array([rotation.multiply(turn, p) for p in shape.p])
    carried = cosserat.Shape(shape.x @ A.T + away, carried_p)
    r, _ = linearised(one, shape)
    there, _ = linearised(one, carried)
    size = np.append(r, np.zeros(3)).reshape(-1, 6)
    other = np.append(there, np.zeros(3)).reshape(-1, 6)
    assert_allclose(other[:, :3], size[:, :3], atol=1e-12)
    assert_allclose(other[:, 3:], size[:, 3:] @ A.T, atol=1e-12)
    assert_allclose(size[:, 3:].sum(axis=0), 0, atol=1e-12)
    moments = [shape.frame(k) @ size[k, :3] for k in range(len(size))]
    lever = np.cross(shape.x, size[:-1, 3:]).sum(axis=0)
    assert_allclose(np.sum(moments, axis=0) + lever, 0, atol=1e-12)


@pytest.mark.parametrize(
    ("alpha", "deflection", "shortening", "angle"),
    [(1, 0.301721, 0.056433, 0.461352), (2, 0.493457, 0.160642, 0.781750),
     (5, 0.713792, 0.387628, 1.215368), (10, 0.810609, 0.554996, 1.430286)],
)  # fmt: skip
def test_elastica(alpha, deflection, shortening, angle):
    """Elliptic integrals of the cantilever that neither stretches nor shears."""
    one = straight(1.0, 80, stretch=STIFF, bend=1.0)
    shape = equilibrium(one, loads(one, tip=(alpha, 0, 0)))
    assert_allclose([shape.x[-1, 0], 1 - shape.x[-1, 2]], [deflection, shortening], rtol=4e-4)
    assert_allclose(np.arctan2(shape.frame(-1)[0, 2], shape.frame(-1)[2, 2]), angle, rtol=2e-4)


def test_moment_rolls_a_beam_up_into_a_circle():
    error = []
    for n in (20, 40, 80):
        one = straight(10.0, n, stretch=STIFF, bend=100.0)
        shape = equilibrium(one, loads(one, tip_moment=(0, 20 * np.pi, 0)))
        a, k = cosserat.strain(one, shape)
        assert_allclose(a, 0, atol=1e-9)
        angle = np.arcsin(2 * np.pi / 10 * one.l)  # where M = B k cos(angle / 2)
        assert_allclose(k[:, 1], 2 * np.sin(angle / 2) / one.l, rtol=1e-8)
        error.append(np.linalg.norm(shape.x[-1]))
    assert_allclose(error, [0.170, 0.0415, 0.0103], rtol=5e-3)
    assert_allclose(np.log2(error[:2]) - np.log2(error[1:]), 2.0, atol=0.1)


def bend_of_45_degrees(n, J, k):
    def place(s):
        c, d = np.cos(s), np.sin(s)
        return [100 * d, 100 * (1 - c), 0], np.array([[-d, 0, c], [c, 0, d], [0, 1, 0]])

    return along(place, np.linspace(0, np.pi / 4, n + 1), stretch=[k * 5e6, k * 5e6, 1e7],
                 bend=[1e7 / 12, 1e7 / 12, 5e6 * J])  # fmt: skip


@pytest.mark.parametrize(
    ("J", "k", "P", "tip"),
    [(1 / 6, 5 / 6, 300, (58.7789, 22.2447, 40.1924)),
     (1 / 6, 5 / 6, 450, (52.2383, 18.5081, 48.5035)),
     (1 / 6, 5 / 6, 600, (47.1501, 15.6847, 53.4755)),
     (0.141, 1.0, 600, (46.8968, 15.5603, 53.6049))],
)  # fmt: skip
def test_bend_of_45_degrees_under_a_force_out_of_its_plane(J, k, P, tip):
    """Bathe and Bolourchi 1979; numbers of a shooting method for both torsion constants in use."""
    one = bend_of_45_degrees(80, J, k)
    shape = equilibrium(one, loads(one, tip=(0, 0, P)))
    assert_allclose(shape.x[-1], tip, rtol=3e-4)
    if J == 0.141:  # Ibrahimbegovic 1995, eight elements of three nodes
        assert_allclose(shape.x[-1] - one.x[-1], (-23.814, -13.729, 53.605), rtol=1e-3)


def shooting(turn, curvature, length, rigidities, force):
    """End of a rod from its differential equations, by the moment at the root that leaves none."""
    C, B = np.array(rigidities[:3]), np.array(rigidities[3:])

    def rates(_, y, n):
        R = rotation.matrix(y[3:7])
        along = R @ (R.T @ n / C + [0, 0, 1])
        bend = R.T @ y[7:] / B + curvature
        return np.concatenate([along, rotation.multiply(y[3:7], np.append(0, bend)) / 2,
                               -np.cross(along, n)])  # fmt: skip

    def end(moment, n):
        start = np.concatenate([np.zeros(3), turn, moment])
        way = solve_ivp(rates, (0, length), start, "DOP853", args=(n,), rtol=1e-9, atol=1e-9)
        return way.y[:, -1]

    moment = np.zeros(3)
    for share in np.linspace(0.5, 1, 2):
        n = share * np.asarray(force, dtype=float)
        moment = fsolve(lambda m, n=n: end(m, n)[7:], moment, xtol=1e-9)
    return end(moment, n)[:3]


def test_bend_converges_with_second_order_to_the_solution_of_the_differential_equations():
    """A boundary value problem solved by shooting has no segments to be wrong about."""
    one = bend_of_45_degrees(80, 1 / 6, 5 / 6)
    stiff = (*one.stretch[0], *one.bend[0])
    tip = shooting(one.p[0], [0, 0.01, 0], 25 * np.pi, stiff, (0, 0, 600))
    assert_allclose(tip, (47.1501, 15.6847, 53.4755), rtol=2e-6)
    assert_allclose(equilibrium(one, loads(one, tip=(0, 0, 600))).x[-1], tip, rtol=3e-4)
    ends = []
    for n in (10, 20, 40):
        one = bend_of_45_degrees(n, 1 / 6, 5 / 6)
        ends.append(equilibrium(one, loads(one, tip=(0, 0, 600))).x[-1])
    error = np.linalg.norm(np.array(ends) - (47.1501, 15.6847, 53.4755), axis=1)
    assert_allclose(np.log2(error[:-1] / error[1:]), 2.0, atol=0.1)


def test_twisted_beam():
    """Pretwist of 90 degrees couples the directions; shooting, and published solid elements."""

    def place(s):
        angle = np.pi / 2 * s / 10
        return [0, 0, s], rotation.matrix(rotation.exp([0, 0, angle]))

    one = along(place, np.linspace(0, 10, 81), stretch=[8.2604167e9, 8.2604167e9, 25e9],
                bend=[0.520833e9, 0.130208e9, 0.141872656e9])  # fmt: skip
    shape = equilibrium(one, loads(one, tip=(0, -4000e3, 0)))
    u = shape.x[-1] - one.x[-1]
    assert_allclose(u, (-1.718053, -3.593213, -1.141526), rtol=5e-4)
    assert_allclose(u[1:], (-3.584232, -1.134192), rtol=0.01)  # solid elements


ANGLES = (0, 15, 30, 45, 60, 75, 90)
PRINCETON = {  # flapwise and edgewise displacement [mm], twist [deg] by a shooting method
    4.448: [(0, 20.8084, 39.9599, 56.0635, 68.1319, 75.5690, 78.0773),
            (5.3582, 5.2112, 4.7576, 3.9764, 2.8742, 1.5106, 0),
            (0, 0.2347, 0.4027, 0.4592, 0.3928, 0.2248, 0)],
    8.896: [(0, 42.1924, 79.5474, 109.1131, 129.9579, 142.2182, 146.2524),
            (10.7128, 10.6436, 10.2076, 8.9792, 6.7420, 3.6220, 0),
            (0, 0.9562, 1.5937, 1.7533, 1.4525, 0.8135, 0)],
    13.345: [(0, 64.7342, 118.1795, 156.7746, 182.0038, 196.1387, 200.6840),
             (16.0612, 16.5777, 16.9898, 15.6211, 11.9635, 6.4703, 0),
             (0, 2.2161, 3.5135, 3.6671, 2.9159, 1.5929, 0)],
}  # fmt: skip


def princeton(force, angle, **section):
    b, t, E = 12.3777e-3, 3.2024e-3, 71.7e9
    G, soft, stiff = E / 2.62, b * t**3 / 12, t * b**3 / 12
    one = straight(0.508, 80, stretch=[G * b * t, G * b * t, E * b * t],
                   bend=[E * stiff, E * soft, 0.198 * G * (soft + stiff)], **section)  # fmt: skip
    beta = np.radians(angle)
    return one, force * np.array([np.sin(beta), -np.cos(beta), 0])


def check_princeton(force, angle, tip, A):
    twist = np.degrees(np.arctan2(A[0, 1], A[1, 1]))
    flap, edge, turned = np.array(PRINCETON[force])[:, ANGLES.index(angle)]
    assert_allclose(1e3 * tip[:2], (flap, -edge), rtol=2e-3, atol=1e-6)
    assert_allclose(twist, turned, rtol=2e-3, atol=1e-6)


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("force", PRINCETON)
def test_princeton_beam(force, angle):
    """Large displacement in both planes; a wrong state twisted by -156 degrees is near."""
    one, load = princeton(force, angle)
    shape = equilibrium(one, loads(one, tip=load))
    check_princeton(force, angle, shape.x[-1], shape.frame(-1))


@pytest.mark.parametrize(
    ("force", "angle"), few(2, [(13.345, 45), (13.345, 75), *product(PRINCETON, ANGLES)])
)
def test_princeton_beam_in_a_mechanism(force, angle):
    one, load = princeton(force, angle, mass=0.1, inertia=1e-5)
    mech = rom.Mechanism(gravity=(0, 0, 0))
    beam = mech.add_nonlinear("beam", cosserat.body(one))
    mech.fixed("clamp", mech.ground.marker((0, 0, 0)), beam.marker("start"))
    mech.force("tip", beam.marker("end"), load)
    pose = rom.equilibrium(mech).q[-7:]
    check_princeton(force, angle, pose[:3], rotation.matrix(pose[3:]))


@pytest.mark.parametrize("speed", [30.0, 100.0])
def test_a_spinning_rim_grows_until_its_tension_holds_it(speed):
    """EA e = m W^2 R^2 (1 + e), e up to 11 %; the hub guides it and turns with it."""
    EA, mass, R, n = 1e5, 1.0, 1.0, 24

    def place(s):
        out, tangent = np.array([np.cos(s), np.sin(s), 0]), np.array([-np.sin(s), np.cos(s), 0])
        return R * out, np.column_stack([out, np.cross(tangent, out), tangent])

    section = {"stretch": EA, "bend": 1e-4 * EA, "mass": mass, "inertia": 1e-4}
    mech, ring = rom.Mechanism(gravity=(0, 0, 0)), np.linspace(0, 2 * np.pi, n + 1)
    rim = mech.add_nonlinear("rim", cosserat.body(along(place, ring, **section)))
    hub = mech.add_rigid("hub", mass=1, inertia=(1, 1, 1), at=(0, 0, 0),
                         markers={"axle": (0, 0, 0), "spoke": (R, 0, 0)})  # fmt: skip
    mech.revolute("axle", mech.ground.marker((0, 0, 0)), hub.marker("axle"), axis=(0, 0, 1))
    mech.fixed("seam", rim.marker("start"), rim.marker("end"))
    mech.prismatic("spoke", hub.marker("spoke"), rim.marker("start"), axis=(1, 0, 0))
    x = rom.equilibrium(mech, spin=(0, 0, speed)).q[: 7 * (n + 1)].reshape(-1, 7)[:, :3]
    pull = mass * (speed * R) ** 2 / EA
    assert_allclose(np.linalg.norm(x, axis=1) / R - 1, pull / (1 - pull), rtol=1e-8)


@pytest.mark.parametrize("tip", [(50, 0, 0), (200, 0, 0)])
def test_one_large_step_finds_the_same_equilibrium(tip):
    """Rotations of an iteration are capped; without that Newton leaps to another state."""
    one = straight(1.0, 80, stretch=STIFF, bend=1.0)
    once, slowly = (equilibrium(one, loads(one, tip=tip), steps=n) for n in (1, 20))
    assert_allclose(once.x, slowly.x, atol=1e-8)


def test_small_loads_bend_as_timoshenko_says():
    EI, GA, L = 2.0, 50.0, 1.5
    one = straight(L, 200, stretch=[GA, GA, 80.0], bend=EI)
    shape = equilibrium(one, loads(one, tip=(1e-4, 0, 1e-4)))
    assert_allclose(shape.x[-1, 0], 1e-4 * (L**3 / (3 * EI) + L / GA), rtol=5e-5)
    assert_allclose(shape.x[-1, 2] - L, 1e-4 * L / 80, rtol=1e-3)


def test_buckling_load_of_a_column():
    """Euler with shear and shortening by the modified formula of Engesser and Haringx."""
    EI, GA, EA, L = 1.0, 400.0, 1e5, 1.0
    one = straight(L, 80, stretch=[GA, GA, EA], bend=EI)

    def lowest(P):
        load = loads(one, tip=(0, 0, -P))
        shape = equilibrium(one, load)
        free = cosserat.clamped(one)
        return np.linalg.eigvalsh(linearised(one, shape, load)[1][np.ix_(free, free)])[0]

    # P (1 + P / GA - P / EA) = P_E, the length shortens by P / EA
    P = max(np.roots([1 / GA - 1 / EA, 1.0, -(np.pi**2) / 4]))
    assert lowest(0.999 * P) > 0 > lowest(1.001 * P)


def test_what_is_no_rod_or_cannot_be_cut_or_found_is_named_and_the_last_shape_is_kept():
    section = {"stretch": 1.0, "bend": 1.0}
    turned = np.tile([1.0, 0, 0, 0], (4, 1))
    refuses(ModelError, "segment 1", rod, [[0, 0, 0], [0, 0, 1], [0, 0, 1]], turned, **section)
    refuses(ModelError, "segment 0", straight, 1.0, 2, stretch=[[1, 1, 0], [1, 1, 1]], bend=1.0)
    weak = [[1, 1, 1], [1, -1, 1], [1, 1, 1]]
    refuses(ModelError, "vertex 1 .* a bending rig", straight, 1.0, 2, stretch=1.0, bend=weak)
    back = turned.copy()
    back[2:] = [0, 1, 0, 0]
    refuses(ModelError, "vertex 1", rod, [[0, 0, 0], [0, 0, 1], [0, 0, 0]], back, **section)
    refuses(ModelError, "N segments have", rod, [[0, 0, 0], [0, 0, 1]], turned, **section)
    one = straight(1.0, 4, **section)
    refuses(ConfigError, "needed are", equilibrium, one, (np.zeros((4, 3)), np.zeros((6, 3))))
    one = straight(1.0, 4, stretch=1e4, bend=1.0)
    assert [piece.h.size for piece in cut(one, 3)] == [1, 2, 1]
    refuses(ConfigError, "5 pieces of a rod of 4 segments", cut, one, 5)
    load = np.outer([0, 0, 0, 0, 1.0], [30.0, 0, -60.0])
    refuses(SolverError, "2 linear pieces found no equilibrium", bend_in_pieces, one, 2, load)
    one = straight(1.0, 10, stretch=10.0, bend=1.0)
    free = np.ones_like(cosserat.clamped(one))
    with pytest.raises(SolverError, match="no equilibrium beyond 0 % of the load") as error:
        equilibrium(one, loads(one, tip=(1.0, 0, 0)), free=free)
    assert error.value.share == 0.0 and np.isfinite(error.value.solution.x).all()


def test_a_small_load_does_not_see_the_cuts():
    one = blade(16)
    force = np.outer(np.linspace(0, 1e-3, 17), [1.0, 0.5, 0])
    free = cosserat.clamped(one)
    K = linearised(one, reference(one))[1][np.ix_(free, free)]
    full = np.zeros((18, 6))
    full[:-1, 3:] = force
    u = np.zeros((18, 6))
    u.ravel()[6:-3] = np.linalg.solve(K, full.ravel()[6:-3])
    for k in (1, 2, 5, 16):
        assert_allclose(bend_in_pieces(one, k, force) - one.x, u[:-1, 3:], rtol=1e-4, atol=1e-12)


def test_more_linear_bodies_come_closer_to_the_rod():
    """267 kN on a blade: one body misses that the tip comes in, eight are within 2 %."""
    one = blade(48)
    eta = np.linspace(0, 1, 49)
    share = eta * np.append(np.ones(48), 0.5)
    force = np.outer(267e3 * share / share.sum(), [1.0, 0, 0])
    exact = equilibrium(one, loads(one, force=force)).x[-1]
    tip = np.array([bend_in_pieces(one, k, force)[-1] for k in (1, 2, 4, 8, 16)])
    error = np.linalg.norm(tip - exact, axis=1)
    assert (np.diff(error) < 0).all()
    assert abs(tip[0, 2] - one.x[-1, 2]) < 0.02  # no shortening at all
    assert error[3] < 0.02 * np.linalg.norm(exact - one.x[-1])
    assert_allclose(np.log2(error[2:-1] / error[3:]), 2.0, atol=0.3)
