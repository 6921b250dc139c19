"""Loads, moving supports and earthquakes on stones: statics, closed forms of pulses, limits."""

from functools import partial
from itertools import combinations, product

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from cases.components.masonry import GROUND, SOFT, G, box, on_the_ground
from cases.refusals import refused, refuses
from rom.components import masonry
from rom.components.masonry import PointLoad, SupportMotion, Wind, arch, ramp, simulate, stone
from rom.errors import ConfigError, FileFormatError, ModelError

on_ground = partial(on_the_ground, friction=0.84)


def alone(**options):
    return masonry.Masonry((stone(box(2.0, 1.0), **SOFT),), (), 1e10, 0.0, (0.0, 0.0), **options)


@pytest.mark.parametrize("at", [(0.3, 0.4), (0.3, 1.0), (1.0, 1.0)])
def test_ground_feels_weight_and_a_point_load_where_they_are(at):
    model, load = on_ground(stone(box(), **SOFT)), PointLoad(1, at, (0.0, -3e4))
    still = simulate(model, t_end=1.0, dt=0.02, actions=[load], damping=np.inf, save_every=50)
    ((centre, force),) = still.joints().values()
    weight = 2000 * G
    assert_allclose(force, [0, -weight - 3e4], atol=1.0)
    assert centre[0] == pytest.approx((0.5 * weight + 3e4 * at[0]) / (weight + 3e4), abs=1e-4)


def test_a_push_at_a_corner_moves_and_turns():
    """Momentum F t, angular momentum r x F t; a load that fades halves both."""
    F, t = np.array([30.0, -20.0]), 0.5
    for history, share in ((1.0, 1.0), (masonry.Table([0.0, t], [1.0, 0.0]), 0.5)):
        load = PointLoad(0, (2.0, 1.0), tuple(F), history)
        motion = simulate(alone(), t_end=t, dt=0.01, actions=[load])
        M = motion.masonry.stones[0].M
        assert_allclose(M[0, 0] * motion.v[-1, 0, :2], share * F * t, rtol=1e-9)
        moment = 1.0 * F[1] - 0.5 * F[0]
        assert M[2, 2] * motion.v[-1, 0, 2] == pytest.approx(share * moment * t, rel=1e-3)


@pytest.mark.parametrize(("factor", "stays"), [(0.97, True), (1.03, False)])
def test_wind_tips_a_block_at_its_closed_form(factor, stays):
    """p h h / 2 = rho g b h b / 2; the wall is 0.5 m thick out of the plane."""
    b, h = 0.5, 2.0
    one = stone(box(b, h), **SOFT, thickness=0.5)
    model = on_ground(one, thickness=0.5)
    edges = masonry.facing(model, (1.0, 0.0))
    assert edges == ((1, 3),)
    wind = Wind(lambda t: factor * 2000 * G * b**2 / h * ramp(1.0)(t), edges)
    motion = simulate(model, t_end=3.0, dt=5e-3, actions=[wind], damping=4.0, save_every=600)
    assert bool(abs(motion.q[-1, 1, 2]) < 1e-3) is stays
    assert masonry.stands(model, [wind], t=1.0) is stays


def test_wind_meets_what_faces_it_and_turns_with_its_stone_and_a_weight_does_not():
    """A block turned by 90 degrees: its left edge faces down, and wind on it lifts."""
    q = alone().start()
    q[0, 2] = -np.pi / 2
    for action, axis in ((Wind(10.0, ((0, 3),)), 1), (PointLoad(0, (0.0, 0.5), (10.0, 0.0)), 0)):
        v = simulate(alone(), t_end=0.01, dt=1e-3, actions=[action], q=q).v[-1, 0, :2]
        assert v[axis] == pytest.approx((-1 if axis else 1) * 10.0 * 0.01 / 4000, rel=1e-3)
        assert abs(v[1 - axis]) < 1e-3 * abs(v[axis])
    model = on_ground(*(stone(box(at=at), **SOFT) for at in ((0, 0), (2.0, 0.0), (2.0, 1.0))))
    assert masonry.facing(model, (1.0, 0.0)) == ((1, 3), (3, 3))
    assert masonry.facing(model, (-2.0, 0.0)) == ((2, 1), (3, 1))


def bridge():
    outlines = box(0.2, 1.0, (-0.1, -1.0)), box(0.2, 1.0, (3.9, -1.0)), box(4.0, 0.5)
    stones = tuple(stone(x, **SOFT) for x in outlines)
    return masonry.Masonry(stones, (0, 1), 10 * SOFT["E"], 0.5)


def test_a_load_that_rolls_over_a_beam_is_shared_by_the_lever():
    model, P, speed = bridge(), 1e4, 0.5
    for t in (2.0, 5.0):
        roll = masonry.MovingLoad((0.0, -P), speed, 0.0)
        motion = simulate(model, t_end=t, dt=0.02, actions=[roll], damping=np.inf, save_every=10)
        joints, weight = motion.joints(), 4.0 * 0.5 * 2000 * G
        x = speed * (t - 0.01)  # the middle of the last step
        (left, up), (right, down) = joints[0, 2], joints[1, 2]
        share = (right[0] - x) / (right[0] - left[0])
        exact = weight * (right[0] - 2.0) / (right[0] - left[0]) + P * share
        assert abs(up[1]) == pytest.approx(exact, rel=1e-3)
        assert abs(up[1]) + abs(down[1]) == pytest.approx(weight + P, rel=1e-6)
    passed = masonry.MovingLoad((0.0, -P), 100.0, -1000.0)
    gone = simulate(model, t_end=0.2, dt=0.02, damping=np.inf, actions=[passed])
    assert abs(gone.joints()[0, 2][1][1]) == pytest.approx(weight / 2, rel=1e-6)


def test_a_support_that_settles_turns_the_beam():
    settle = SupportMotion((1,), (0.0, -0.02), history=ramp(0.5))
    motion = simulate(bridge(), t_end=1.0, dt=5e-3, actions=[settle], damping=20.0, save_every=200)
    assert motion.q[-1, 1, 1] - motion.q[0, 1, 1] == pytest.approx(-0.02, rel=1e-12)
    assert motion.q[-1, 2, 2] == pytest.approx(-0.02 / 3.9, rel=1e-3)  # between edges that touch
    turn, one = SupportMotion((0,), (0.0, 0.0), 0.1, ramp(1.5)), on_ground(stone(box(), **SOFT))
    turned = simulate(one, t_end=2.0, dt=5e-3, actions=[turn], damping=20.0, save_every=400)
    assert_allclose(turned.q[-1, :, 2], 0.1, atol=1e-4)


def test_moving_the_ground_or_the_frame_is_the_same():
    model = on_ground(stone(box(), **SOFT), friction=0.2)
    a, T = 5.0, 0.8
    shift, w = a * (T / (2 * np.pi)) ** 2, 2 * np.pi / T
    way = SupportMotion((0,), (shift, 0.0), history=lambda t: w * t - np.sin(w * t))
    ways = way, masonry.BaseMotion(masonry.sine(a, T))
    moved, frame = (simulate(model, t_end=T, dt=1e-3, actions=[x]) for x in ways)
    slip = moved.q[:, 1, 0] - (moved.q[:, 0, 0] - moved.q[0, 0, 0])
    assert_allclose(slip - slip[0], frame.q[:, 1, 0] - frame.q[0, 1, 0], atol=2e-3 * 0.5)
    assert np.abs(slip - slip[0]).max() > 0.05


@pytest.mark.parametrize(("mu", "a", "width"), [(0.3, 8.0, 1.0), (1.5, 40.0, 4.0)])
def test_slip_under_a_pulse_is_that_of_newmark(mu, a, width):
    """Newmark (1965): V^2 / (2 mu g) (1 - mu g / a), V = a t, for a rectangular pulse."""
    t = 0.2
    model = on_ground(stone(box(width), **SOFT), friction=mu)
    settled = simulate(model, t_end=0.2, dt=0.01, damping=np.inf).q[-1]
    pulse = masonry.BaseMotion(masonry.rectangle(a, t))
    motion = simulate(model, t_end=1.5, dt=5e-4, actions=[pulse], q=settled, save_every=3000)
    V = a * t
    exact = V**2 / (2 * mu * G) * (1 - mu * G / a)
    assert motion.q[0, 1, 0] - motion.q[-1, 1, 0] == pytest.approx(exact, rel=0.01)


SLENDER = (0.2, 2.0)  # width, height [m]
ALPHA, P = np.arctan(0.1), np.sqrt(3 * G / (4 * np.hypot(0.1, 1.0)))


def shaken(acceleration, **run):
    rock = {"E": 1e10, "nu": 0.2, "rho": 2000.0}
    stones = stone(GROUND, **rock), stone(box(*SLENDER, at=(-0.1, 0)), **rock)
    model = masonry.Masonry(stones, (0,), 20e10, 2.0)
    settled = simulate(model, t_end=0.05, dt=1e-3, damping=np.inf).q[-1]
    return simulate(model, q=settled, actions=[masonry.BaseMotion(acceleration)], **run)


def tips(acceleration, t_end=4.0, dt=1e-3, damping=0.0):
    motion = shaken(acceleration, t_end=t_end, dt=dt, save_every=100, damping=damping)
    return bool(np.abs(motion.q[:, 1, 2]).max() > 2 * ALPHA)


@pytest.mark.parametrize("ratio", [1.5, 3.0])
def test_a_block_tips_under_the_pulse_that_housner_says(ratio):
    """Housner (1963), slender: cosh(p t) = 1 + 1 / (2 x (x - 1)), x = a / (g alpha)."""
    needed = np.arccosh(1 + 1 / (2 * ratio * (ratio - 1))) / P
    assert tips(masonry.rectangle(ratio * np.tan(ALPHA) * G, 1.03 * needed))
    assert not tips(masonry.rectangle(ratio * np.tan(ALPHA) * G, 0.97 * needed))


@pytest.mark.parametrize("dt", [1e-3, 2.5e-4])
def test_damping_delays_tipping_by_its_closed_form_whatever_the_step(dt):
    """theta'' + c theta' = p^2 (theta - alpha + x alpha); with c = 1 / s pulses are 20 % longer."""
    c, x = 1.0, 1.5
    grows, falls = (-c / 2 + sign * np.sqrt(c**2 / 4 + P**2) for sign in (1, -1))

    def left(T):
        A, B = (x - 1) * np.array([-falls, grows]) / (grows - falls)
        theta = A * np.exp(grows * T) + B * np.exp(falls * T) - (x - 1)
        speed = A * grows * np.exp(grows * T) + B * falls * np.exp(falls * T)
        return speed - falls * (theta - 1)

    needed = brentq(left, 1e-3, 5.0)
    assert needed * P == pytest.approx(1.2017 * np.arccosh(1 + 1 / (2 * x * (x - 1))), rel=1e-4)
    pulses = [masonry.rectangle(x * np.tan(ALPHA) * G, factor * needed) for factor in (1.03, 0.97)]
    assert [tips(pulse, 3.0, dt, c) for pulse in pulses] == [True, False]


def left_after_half_a_sine(x, omega):
    """theta' + p (theta - alpha) after a pulse without impact; tips if > 0 (Zhang and Makris)."""
    psi = np.arcsin(1 / x)
    t, k = (np.pi - psi) / omega, 1 / (1 + (omega / P) ** 2)
    # theta'' - p^2 theta = p^2 alpha (x sin(omega t + psi) - 1) while it turns to one side
    A = k * x * ALPHA * np.cos(psi) * omega / P
    B = k * x * ALPHA * np.sin(psi) - ALPHA
    forced = -k * x * ALPHA * np.sin(omega * t + psi) + ALPHA
    rate = -k * x * ALPHA * omega * np.cos(omega * t + psi)
    theta = A * np.sinh(P * t) + B * np.cosh(P * t) + forced
    speed = P * (A * np.cosh(P * t) + B * np.sinh(P * t)) + rate
    return speed + P * (theta - ALPHA)


@pytest.mark.parametrize("frequency", [3.0, 5.0])
def test_a_block_tips_under_half_a_sine_as_zhang_and_makris_say(frequency):
    omega = frequency * P
    x = brentq(lambda x: left_after_half_a_sine(x, omega), 1.01, 20.0)
    for factor, falls in ((1.03, True), (0.97, False)):
        pulse = masonry.sine(factor * x * np.tan(ALPHA) * G, 2 * np.pi / omega, cycles=0.5)
        assert tips(pulse) is falls


def test_a_block_follows_the_exact_rocking_motion_under_a_sine():
    a, T = 0.2 * G, 0.5
    motion = shaken(masonry.sine(a, T), t_end=0.4, dt=2.5e-4)
    start = T / (2 * np.pi) * np.arcsin(np.tan(ALPHA) * G / a)

    def rate(t, y):
        # turning to the left of the picture, about the left corner, is positive here
        push = a / G * np.sin(2 * np.pi * t / T)
        return y[1], P**2 * (push * np.cos(ALPHA - y[0]) - np.sin(ALPHA - y[0]))

    exact = solve_ivp(rate, (start, 0.4), (0.0, 0.0), rtol=1e-9, atol=1e-12, dense_output=True)
    late = motion.t > start + 0.05
    theta = motion.q[late, 1, 2]
    assert_allclose(theta, exact.sol(motion.t[late])[0], atol=0.02 * np.abs(theta).max())


def overturns(a, T):
    """Whether a rigid slender block tips under a cycle of a sine, and impacts before (Housner)."""
    t, y, side, impacts = T / (2 * np.pi) * np.arcsin(np.tan(ALPHA) * G / a), (0.0, 0.0), 1.0, 0

    def rate(t, y, side):
        pulse = a / G * np.sin(2 * np.pi * t / T) * (t <= T)
        lever = side * ALPHA - y[0]
        return y[1], P**2 * (pulse * np.cos(lever) - np.sin(lever))

    def lands(t, y, side):
        return side * y[0] + 1e-9

    def falls(t, y, side):
        return abs(y[0]) - 2 * ALPHA

    lands.terminal, lands.direction, falls.terminal = True, -1, True
    while impacts < 8:
        how = {"rtol": 1e-8, "atol": 1e-11, "max_step": 0.02, "args": (side,)}
        course = solve_ivp(rate, (t, 6.0), y, events=[lands, falls], **how)
        if not len(course.t_events[0]):
            return len(course.t_events[1]) > 0, impacts
        t, side, impacts = course.t[-1], -side, impacts + 1
        y = (side * 1e-9, course.y[1, -1] * (1 - 1.5 * np.sin(ALPHA) ** 2))
    return False, impacts


@pytest.mark.parametrize("frequency", [4.0, 5.0, 6.0])
def test_a_block_tips_after_an_impact_as_housner_loses_speed(frequency):
    T, low, high = 2 * np.pi / (frequency * P), 1.3, 4.0
    while high - low > 5e-3:
        x = (low + high) / 2
        low, high = (low, x) if overturns(x * np.tan(ALPHA) * G, T)[0] else (x, high)
    assert overturns(high * np.tan(ALPHA) * G, T) == (True, 1)
    for factor, falls in ((1.04, True), (0.96, False)):
        assert tips(masonry.sine(factor * high * np.tan(ALPHA) * G, T, cycles=1)) is falls


def test_a_support_that_parts_lets_its_stone_fall_and_catches_it():
    """Drawn away at 2 g for 0.2 s: free fall by g t^2 / 2, then it lies on the support again."""
    model, T = on_ground(stone(box(), **SOFT)), 0.2
    away = SupportMotion((0,), (0.0, -G * T**2), history=lambda t: np.minimum(t / T, 1.0) ** 2)
    motion = simulate(model, t_end=2.0, dt=1e-3, actions=[away], damping=0.0)
    flight = (motion.t > 0.05) & (motion.t < 0.28)
    fallen = motion.q[0, 1, 1] - motion.q[:, 1, 1]
    assert_allclose(fallen[flight], G * motion.t[flight] ** 2 / 2, atol=2e-3)
    assert fallen[-1] == pytest.approx(G * T**2, abs=0.01)


def four_hinges(model, x, n):
    """Smallest factor of a weight on joint x among mechanisms of four hinges, by virtual work."""
    best, stones = np.inf, model.stones[1:-1]
    corners = [s.outline for s in stones]
    face = {True: [*(c[1] for c in corners), corners[-1][0]]}  # outside
    face[False] = [*(c[2] for c in corners), corners[-1][3]]
    weight, centre = np.array([s.M[0, 0] * G for s in stones]), np.array([s.centre for s in stones])
    for outside, joints in product((False, True), combinations(range(n + 1), 4)):
        sides = [outside, not outside, outside, not outside]
        h = [face[s][k] for s, k in zip(sides, joints, strict=True)]
        best = min(best, _factor(h, joints, sides, weight, centre, x))
    return best


def _factor(h, joints, sides, weight, centre, load):
    """Turning rates w1, w2, w3 of the three parts: velocities fit at the hinges."""
    r = [h[1] - h[0], h[2] - h[1], h[3] - h[2]]
    N = np.linalg.svd(np.array(r).T)[2][-1]  # w1 r1 + w2 r2 + w3 r3 = 0
    turn = np.r_[0.0, N, 0.0]
    # a joint with its hinge outside opens inside: its right part turns counterclockwise
    signs = np.diff(turn) * np.where(sides, 1.0, -1.0)
    if (signs < -1e-12).all():
        turn, signs = -turn, -signs
    if not (signs > 1e-12).all():
        return np.inf
    lower = np.zeros(2)
    work, push = 0.0, 0.0
    for part in range(3):
        w, pivot = turn[part + 1], h[part]
        for k in range(joints[part], joints[part + 1]):
            work += -weight[k] * (lower[1] + w * (centre[k] - pivot)[0])
            if k == load[0]:
                push = -(lower[1] + w * (load[1] - pivot)[0])
        lower = lower + w * np.array([-r[part][1], r[part][0]])
    return -work / push if push > 1e-12 else np.inf


def assert_stays(stays, model, action, t_end):
    motion = simulate(model, t_end=t_end, dt=1e-3, actions=[action], damping=30.0, save_every=500)
    speed = np.abs(motion.v[:, 1:-1]).max(axis=(1, 2))
    assert speed[-1] < 1e-6 if stays else speed[-1] > max(1e-3, speed[3])


def test_load_on_an_arch_is_carried_until_four_hinges_open_and_stones_move_beyond():
    """Lower bound by linear programming, upper bound by trying all mechanisms: they meet."""
    n = 16
    model = arch(n, 5.0, 0.8)
    for k in (8, 5):
        at = model.stones[k].outline[:2].mean(axis=0)
        limit = masonry.load_factor(model, [PointLoad(k, tuple(at), (0.0, -1.0))])
        assert limit == pytest.approx(four_hinges(model, (k - 1, at), n), rel=1e-6)
    for factor, stays in ((0.96, True), (1.04, False)):
        assert_stays(stays, model, PointLoad(5, at, (0.0, -factor * limit), ramp(0.5)), 3.0)


def test_an_arch_in_an_earthquake_opens_at_the_acceleration_of_oppenheim():
    """Oppenheim (1992): seven voussoirs over 157.5 degrees, t / R = 0.15, need 0.37 g."""
    model = arch(7, 10.0, 1.5, half_angle=np.radians(78.75))
    limit = masonry.load_factor(model, [masonry.BaseMotion(G)])
    assert limit == pytest.approx(0.37, abs=5e-4)
    for factor, stays in ((0.97, True), (1.04, False)):
        shake = masonry.BaseMotion(lambda t, a=factor * limit * G: a * ramp(0.5)(t))
        assert_stays(stays, model, shake, 2.5)


@pytest.mark.parametrize("degrees", [100, 110, 120])
def test_horseshoe_arches_obey_closed_form_and_linear_programming(degrees):
    limit = masonry.minimum_thickness(half_angle=np.radians(degrees)).ratio
    for factor, answer in ((1.001, True), (0.998, False)):
        model = arch(150, 1.0, factor * limit, half_angle=np.radians(degrees))
        assert masonry.stands(model) is answer, factor
    run = {"t_end": 2.0, "dt": 1e-3, "damping": 30.0, "save_every": 1000}
    arches = (arch(22, 5.0, 5 * f * limit, half_angle=np.radians(degrees)) for f in (1.1, 0.9))
    thick, thin = (simulate(model, **run) for model in arches)
    assert np.abs(thick.v[-1]).max() < 1e-5 < 1e-3 < np.abs(thin.v[-1]).max()


def test_records_come_from_files(tmp_path):
    path = tmp_path / "quake.txt"
    path.write_text("# t [s], a [g]\n0.0, 0.0\n0.1, 0.1\n0.2, -0.1\n0.3, 0.0\n")
    assert_allclose(masonry.read_record(path, scale=G)(np.array([0.05, 0.2])), [0.05 * G, -0.1 * G])
    path.write_text("0 0 0\n")
    refuses(FileFormatError, "has 3 columns", masonry.read_record, path)
    path.write_text("zero\n")
    refuses(FileFormatError, "is no record", masonry.read_record, path)


def test_a_pair_of_times_and_values_is_a_history_that_holds_its_ends():
    model, still = on_ground(stone(box(), **SOFT)), []
    for history in (((0.0, 0.1), (0.0, 1.0)), masonry.Table([0, 0.1, 9], [0, 1, 1])):
        load = PointLoad(1, (0.5, 1.0), (2e4, -3e4), history)
        still.append(simulate(model, t_end=0.2, dt=0.02, actions=[load]).q)
    assert np.array_equal(*still)


STONE = (1, (0.5, 0.5), (0.0, -1.0))
ONE = masonry.Masonry((stone(box(), **SOFT),), (), 1e9, 0.5)
BRIEF_TABLE, BRIEF = masonry.Table([0.0, 0.05], [0.0, 1.0]), dict(t_end=0.1, dt=0.01)


def acted(*actions):
    return lambda: simulate(on_ground(stone(box(), **SOFT)), **BRIEF, actions=actions)


STONES = stone(GROUND, **SOFT), stone(box(), **SOFT), stone(box(at=(0, 5.0)), **SOFT)
FAR = masonry.Masonry(STONES, (0, 2), 1e10, 0.5)

test_what_is_no_masonry_and_no_action_is_named_where_it_is_made = refused(
    (acted(PointLoad(1, (1.4, 0.5), (0.0, -1.0), name="crane")), "crane at .* lies 0.4 m outside"),
    (acted(PointLoad(0, (0.0, 0.0), (0.0, -1.0))), "acts on stone 0, which is held"),
    (acted(PointLoad(7, (0.0, 0.0), (0.0, -1.0))), "stone of point load = 7"),
    (acted(STONE), r"actions\[0\] = .* must be of type PointLoad"),
    (acted(PointLoad(*STONE, history=BRIEF_TABLE)), "from 0 s to 0.05 s; asked"),
    (acted(PointLoad(*STONE, history=lambda t: np.full(t.shape, np.inf))), "load: .*inf. at t ="),
    (acted(PointLoad(*STONE, history=lambda t: 1.0)), "point load: times of the shape"),
    (acted(masonry.MovingLoad((0.0, -1.0), 1.0, 11.0)), "never comes upon the stones"),
    (acted(Wind(1.0, ((1, 4),))), "edge of stone 1 for wind = 4 must be"),
    (acted(Wind(1.0, ())), "blows on no edge"),
    (acted(SupportMotion((1,), (0.1, 0.0))), "moves 1, which must be of the held"),
    (acted(SupportMotion((0,), (0.1, 0.0), history=1.0)), "begins away from where"),
    (acted(SupportMotion((0,), (0.1, 0.0), history=masonry.rectangle(1.0, 1.0))), "begins away"),
    (acted(SupportMotion((0,), (50.0, 0.0), history=lambda t: t)), "support 0 moves by .* in the"),
    (acted(SupportMotion((0,), (0.1, 0.0)), SupportMotion((0,), (0.1, 0.0))), "0 is given twice"),
    (lambda: masonry.Table("a", "b"), "made of numbers"),
    (lambda: masonry.Table([0.0, 1.0], [0.0, np.nan]), "history: value 1 is .nan.*gaps"),
    (lambda: masonry.Table([0.0, 0.0], [0.0, 1.0]), "must grow: 0.0 s comes before 0.0 s"),
    (lambda: masonry.Table([0.0], [1.0]), "two or more of each"),
    (lambda: masonry.recorded([0.0, 0.1, 0.2, 0.5, 0.6], np.zeros(5)), "gap from 0.2 s to 0.5 s"),
    (lambda: masonry.minimum_thickness(half_angle=np.radians(140)), "nor so far round"),
    (lambda: stone([0, 1, 2], **SOFT), ModelError, r"outline of a stone has shape \(3,\)"),
    (lambda: stone(box()[[0, 0, 1, 2, 3]], **SOFT), ModelError, "corner 0 is listed twice"),
    (lambda: masonry.Masonry((), (), 1e9, 0.5), "all of 0 stones are held"),
    (lambda: masonry.Masonry(ONE.stones, (0,), 1e9, 0.5), "all of 1 stones are held"),
    (lambda: simulate(ONE, **BRIEF, v=np.full((1, 6), np.nan)), "v = .* must be finite"),
    (lambda: simulate(FAR, **BRIEF, actions=[SupportMotion((2,), (0.1, 0.0))]),
     "moves stone 2, which must support"),
    (lambda: simulate(ONE, **BRIEF, actions=[masonry.BaseMotion(1.0)]), "a stone must be held"),
    (lambda: masonry.load_factor(arch(10, 5.0, 0.4), [masonry.BaseMotion(1.0)]), "not stand by"),
    (lambda: masonry.facing(FAR, (0.0, 0.0)), "needs a direction"),
    error=ConfigError,
)  # fmt: skip


def test_a_wall_in_the_wind_falls_stone_by_stone():
    model = masonry.wall(1.0, 6, brick=(0.5, 0.25), rock=masonry.Rock(friction=0.6))
    edges = masonry.facing(model, (1.0, 0.0))
    assert len(edges) == 6
    limit = masonry.load_factor(model, [Wind(1.0, edges)])
    for factor, stays in ((0.95, True), (1.06, False)):
        wind = Wind(lambda t, p=factor * limit: p * ramp(0.5)(t), edges)
        motion = simulate(model, t_end=2.0, dt=2e-3, actions=[wind], damping=15.0, save_every=1000)
        assert bool(np.abs(motion.v[-1]).max() < 1e-4) is stays


def test_contacts_that_turn_back_within_a_step_stick():
    """Sliding one way, then the other, in turns, never ends: steps were cut 281 times."""
    shaking = masonry.BaseMotion(masonry.sine(1.0, 0.5))
    motion = simulate(arch(40, 5.0, 0.6), t_end=0.4, dt=1e-3, actions=[shaking], damping=1.0)
    assert motion.cuts < 40 and np.abs(motion.v).max() > 0.01


@pytest.mark.parametrize(("mu", "cuts"), [(0.6, 5), (1.0, 10), (1.5, 220), (2.0, 280), (3.0, 260)])
def test_steps_settle_with_friction_of_one_and_more(mu, cuts):
    """Steps were cut 766 and 1222 times from one on; 245, 1682, 5589 times at 1.5, 2 and 3."""
    model = masonry.wall(2.0, 8, brick=(0.5, 0.25), rock=masonry.Rock(friction=mu))
    shaking = masonry.BaseMotion(masonry.sine(4.0, 0.4))
    motion = simulate(model, t_end=0.5, dt=1e-3, actions=[shaking], save_every=500)
    assert motion.cuts < cuts


def test_a_dead_load_holds_a_block_down_and_is_not_multiplied():
    """F h = (W + D) b / 2 with D in the middle; F h = W b / 2 + D b / 4 at a quarter."""
    b, h, D = 0.5, 2.0, 3e3
    model = on_ground(stone(box(b, h), **SOFT), friction=4.0)
    load, W = PointLoad(1, (0.0, h), (1.0, 0.0)), 2000 * b * h * G
    for x in (b / 2, 3 * b / 4):
        dead = [PointLoad(1, (x, h), (0.0, -D))]
        needed = (W * b / 2 + D * (b - x)) / h
        assert masonry.load_factor(model, [load], dead=dead) == pytest.approx(needed, rel=1e-6)
    pushed = [PointLoad(1, (0.0, h), (W, 0.0))]
    with pytest.raises(ConfigError, match="not stand by"):
        masonry.load_factor(model, [load], dead=pushed)


@pytest.mark.parametrize(("y", "force"), [(2.0, 1.0), (2.0, -1.0), (0.4, 1.0)])
def test_a_horizontal_force_tips_a_block_by_its_lever_about_the_ground(y, force):
    """F y = W b / 2, on whatever side and below or above the mass centre; friction of 4 holds."""
    b, h = 0.5, 2.0
    model = on_ground(stone(box(b, h), **SOFT), friction=4.0)
    load = PointLoad(1, (0.0 if force > 0 else b, y), (force, 0.0))
    needed = 2000 * b * h * G * b / 2 / y
    assert masonry.load_factor(model, [load]) == pytest.approx(needed, rel=1e-6)
