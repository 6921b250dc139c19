"""Motions that repeat and their multipliers, against closed forms and independent integrations."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp, trapezoid
from scipy.optimize import fsolve
from scipy.special import ellipk

import rom
from cases.beam import stiffened_beam
from cases.mbs.parts import ORIGIN, RECORD, X, Y, Z, below, on_guide, on_hinge, slipping
from cases.refusals import refused, refuses
from rom.errors import ConfigError, ModelError, SolverError

STILL = {"gravity": (0, 0, 0)}
EXACT = {"rtol": 1e-12, "atol": 1e-13, "method": "DOP853"}
LENGTHS, MASSES, DAMPERS, TORQUE, SPEED = (1.0, 0.7), (1.0, 0.5), (0.6, 0.3), 1.5, 4.0


def slider(stiffness=4.0, damping=0.4, at=0.0):
    """A mass of 1 kg on a guide along x, by default on a spring and a damper."""
    mech = rom.Mechanism(**STILL)
    mass = on_guide(mech, at=(at, 0, 0))
    base, along = mech.ground.marker((at, 0, 0)), np.eye(6)[0]
    mech.bushing("spring", base, mass, stiffness=stiffness * along, damping=damping * along)
    return mech, mass


def pushed(w, force=1.0, **more):
    mech, mass = slider(**more)
    mech.force("push", mass, lambda t: (force * np.cos(w * t), 0, 0))
    return mech


def way(motion):
    return motion.solution.position("mass")[:, 0]


def linear_errors(steps, w=1.3):
    """Errors of multipliers and motion of a linear oscillator, and the multipliers."""
    found = rom.periodic_motion(pushed(w), period=2 * np.pi / w, steps=steps)
    poles = np.roots([1.0, 0.4, 4.0])
    exact = np.exp(poles * found.period)
    exact = exact[np.argsort(-exact.imag)]
    x = (np.exp(1j * w * found.solution.t) / (4 - w**2 + 0.4j * w)).real
    return found.multipliers - exact, np.abs(way(found) - x).max(), found.multipliers, exact


def test_a_linear_oscillator_has_the_closed_form_and_its_errors_fall_with_the_square_of_the_step():
    coarse, middle, fine = (linear_errors(n) for n in (100, 200, 400))
    assert fine[1] < 2e-5
    for one, two in ((coarse, middle), (middle, fine)):
        assert one[1] / two[1] == pytest.approx(4.0, rel=0.02)
        assert_allclose(np.abs(one[0]) / np.abs(two[0]), 4.0, rtol=0.02)
    better = fine[2] + (fine[2] - middle[2]) / 3
    assert_allclose(better, fine[3], rtol=1e-6)


def test_a_linear_motion_closes_at_once():
    w = 1.3
    found = rom.periodic_motion(pushed(w), period=2 * np.pi / w)
    assert found.passes <= 6 and found.stable and not found.free
    assert_allclose(found.solution.q[-1], found.solution.q[0], atol=1e-9)
    assert_allclose(found.solution.v[-1], found.solution.v[0], atol=1e-9)
    on = rom.simulate(found.solution.mechanism, state=found.solution.final, t_end=2 * found.period,
                      dt=found.period / 200, rho_inf=0.8)  # fmt: skip
    assert_allclose(on.position("mass")[:, 0], way(found), atol=1e-8)
    again = rom.periodic_motion(pushed(w), period=2 * np.pi / w, start=found)
    assert again.passes <= 2 and "stable" in repr(again)
    assert rom.periodic_motion(pushed(w), period=2 * np.pi / w, settle=20).passes <= 4


def test_a_motion_that_grows_is_found_and_called_unstable():
    """With damping below zero nothing else than Newton's method finds the motion."""
    w = 1.3
    mech = pushed(w, damping=0.0)
    mech.motor("feed", "guide", lambda t, x, v: 0.4 * v)
    found = rom.periodic_motion(mech, period=2 * np.pi / w, steps=400)
    amplitude = 1 / abs(4 - w**2 - 0.4j * w)
    assert np.ptp(way(found)) / 2 == pytest.approx(amplitude, rel=1e-4)
    assert not found.stable
    assert abs(found.multipliers[0]) == pytest.approx(np.exp(0.2 * found.period), rel=3e-4)


def cycling(mu, at=2.0):
    mech = rom.Mechanism(**STILL)
    mech.law("van der Pol", van_der_pol, on_guide(mech, at=(at, 0, 0)), parameters=(mu,))
    return mech


def van_der_pol(t, parameters, motion, memory, out):
    x, v = motion.position[0, 0], motion.velocity[0, 0]
    out.force[0, 0] = parameters[0] * (1.0 - x * x) * v - x


def test_the_limit_cycle_of_van_der_pol():
    """Period 6.6632868593 at mu = 1; the other multiplier is the exponential of the divergence."""
    mech = cycling(1.0)
    coarse, fine = (rom.periodic_motion(mech, guess=6.0, steps=n) for n in (200, 400))
    period = fine.period + (fine.period - coarse.period) / 3
    assert period == pytest.approx(6.6632868593, rel=5e-8)
    assert fine.free and fine.stable and fine.deviations.size == 1
    assert_allclose(fine.multipliers[0], 1.0, atol=2e-5)
    run = solve_ivp(lambda t, y: [y[1], (1 - y[0] ** 2) * y[1] - y[0]], (0, 40), [2.0, 0], **EXACT)
    cycle = solve_ivp(lambda t, y: [y[1], (1 - y[0] ** 2) * y[1] - y[0], 1 - y[0] ** 2],
                      (0, 6.6632868593), [*run.y[:, -1], 0.0], **EXACT)  # fmt: skip
    assert abs(fine.deviations[0]) == pytest.approx(np.exp(cycle.y[2, -1]), rel=2e-3)
    assert_allclose(cycle.y[:2, -1], run.y[:, -1], atol=1e-8)


@pytest.mark.parametrize("guess", [5.0, 10.0])
def test_a_period_that_is_guessed_badly_is_approached_in_parts(guess):
    """Whole corrections would make it negative."""
    motion = rom.periodic_motion(cycling(1.0), guess=guess, steps=100)
    assert motion.period == pytest.approx(6.6632868593, rel=1e-3)


def pendulum(angle=0.0, shaken=None, damping=0.0, gravity=9.81):
    """A point mass on a rod of 1 m, its pivot shaken along z by a function."""
    mech = rom.Mechanism(gravity=(0, 0, -gravity))
    pivot = None
    if shaken is not None:
        pivot = on_guide(mech, "cart", axis=Z, guide="lift")
        mech.drive("shaker", "lift", *shaken[:1], rate=shaken[1], acceleration=shaken[2])
    on_hinge(mech, below(angle), mass=1.0, inertia=(1e-9,) * 3, pivot=pivot)
    if damping:
        mech.rotational_spring("damper", "hinge", stiffness=0.0, damping=damping)
    return mech


def test_a_free_pendulum_has_the_period_of_the_elliptic_integral():
    found = rom.periodic_motion(pendulum(1.5), guess=2.2, steps=800, conservative=True)
    exact = 4 * ellipk(np.sin(0.75) ** 2) / np.sqrt(9.81)
    assert found.period == pytest.approx(exact, rel=4e-5)
    bob = found.solution.position("bob")
    assert np.arctan2(bob[:, 0], -bob[:, 2]).max() == pytest.approx(1.5, abs=2e-4)


def shaken_by(a, w):
    return (lambda t: a * np.cos(w * t), lambda t: -a * w * np.sin(w * t),
            lambda t: -a * w * w * np.cos(w * t))  # fmt: skip


def test_kapitza_s_pendulum_stands_where_it_is_shaken_fast_enough():
    """Upright and stable for a^2 w^2 > 2 g l, with damping; slow shaking lets it fall."""
    a = 0.05
    for speed, stable in ((1.1, True), (0.9, False)):
        w = speed * np.sqrt(2 * 9.81) / a
        mech = pendulum(np.pi, shaken_by(a, w), damping=0.2)
        assert rom.periodic_motion(mech, period=2 * np.pi / w).stable == stable


def double_pendulum():
    """Two point masses, damped hinges, the first driven by a periodic moment."""
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    pivot, depth = mech.ground.marker(ORIGIN), 0.0
    for k, (length, mass) in enumerate(zip(LENGTHS, MASSES, strict=True)):
        depth += length
        bob = mech.add_rigid(f"bob {k}", mass=mass, inertia=(1e-9,) * 3, at=(0, 0, -depth),
                             markers={"top": (0, 0, length), "low": ORIGIN})  # fmt: skip
        mech.revolute(f"hinge {k}", pivot, bob.marker("top"), axis=-Y)
        mech.rotational_spring(f"damper {k}", f"hinge {k}", stiffness=0.0, damping=DAMPERS[k])
        if not k:
            mech.torque("drive", bob.marker("top"), lambda t: (0, -TORQUE * np.cos(SPEED * t), 0))
        pivot = bob.marker("low")
    return mech


def double_pendulum_rates(t, y):
    """Lagrange's equations in the angles against the vertical."""
    (l1, l2), (m1, m2), (c1, c2), g = LENGTHS, MASSES, DAMPERS, 9.81
    a, b, u, w = y
    M = np.array([[(m1 + m2) * l1**2, m2 * l1 * l2 * np.cos(a - b)],
                  [m2 * l1 * l2 * np.cos(a - b), m2 * l2**2]])  # fmt: skip
    f = [TORQUE * np.cos(SPEED * t) - c1 * u + c2 * (w - u) - (m1 + m2) * g * l1 * np.sin(a)
         - m2 * l1 * l2 * w**2 * np.sin(a - b),
         -c2 * (w - u) - m2 * g * l2 * np.sin(b) + m2 * l1 * l2 * u**2 * np.sin(a - b)]  # fmt: skip
    return [u, w, *np.linalg.solve(M, f)]


def test_a_driven_double_pendulum_has_the_multipliers_of_lagrange_s_equations():
    T = 2 * np.pi / SPEED

    def after(y):
        return solve_ivp(double_pendulum_rates, (0, T), y, **EXACT).y[:, -1]

    y = fsolve(lambda y: after(y) - y, np.zeros(4), xtol=1e-12)
    steps = 1e-5 * np.eye(4)
    J = np.array([(after(y + e) - after(y - e)) / 2e-5 for e in steps]).T
    exact = np.linalg.eigvals(J)
    exact = exact[np.lexsort((-exact.imag, -np.round(np.abs(exact), 9)))]
    coarse, fine = (rom.periodic_motion(double_pendulum(), period=T, steps=n) for n in (200, 400))
    assert_allclose(fine.solution.joint("hinge 0").angle[0], y[0], rtol=1e-3)
    better = fine.multipliers + (fine.multipliers - coarse.multipliers) / 3
    assert_allclose(better, exact, atol=2e-6)
    rough = rom.periodic_motion(double_pendulum(), period=T, steps=40).solution
    assert_allclose(rough.v[-1], rough.v[0], atol=1e-9)  # across the joints, too
    s = fine.solution
    assert_allclose(s.reaction("hinge 0")[-1], s.reaction("hinge 0")[0], atol=1e-4)
    assert np.abs(fine.multipliers - exact).max() < 2e-3


def test_a_flexible_beam_answers_a_harmonic_force_as_its_frequency_response():
    beam = stiffened_beam(n_modes=4, stiffened=False)
    mech = rom.Mechanism(**STILL)
    part = mech.add_flexible("beam", beam)
    root, tip = (part.marker(name) for name in part.names)
    mech.fixed("clamp", "ground", root)
    damping = {"stiffness": np.zeros(6), "damping": 0.5 * np.eye(6)[1]}
    mech.bushing("damper", mech.ground.marker(X), tip, **damping)
    w = 3.0
    H = rom.frequency_response(mech, None, [w / 2 / np.pi], force=tip, motion=tip).receptance
    F = 1e-3
    mech.force("shaker", tip, lambda t: (0, F * np.cos(w * t), 0))
    ends = []
    for steps in (200, 400):
        found = rom.periodic_motion(mech, period=2 * np.pi / w, steps=steps)
        ends.append(found.solution.position("beam", tip.place)[0, 1])
    exact = F * H[0, 1, 1].real
    assert ends[1] + (ends[1] - ends[0]) / 3 == pytest.approx(exact, rel=1e-4)
    assert ends[1] == pytest.approx(exact, rel=1e-2)
    assert found.stable and found.multipliers.size == 8


def test_what_a_law_remembers_repeats_too():
    """The loop of a spring in a row with dry friction takes up 4 R (x - R / k) per period."""
    w, k, limit = 1.7, 30.0, 0.3
    mech = pushed(w, stiffness=4.0, damping=0.1)
    mech.law("slip", slipping, "ground", "mass", parameters=(k, limit), memory=(0.0,), **RECORD)
    found = rom.periodic_motion(mech, period=2 * np.pi / w, steps=800)
    memory = found.solution.law("slip").memory[:, 0]
    assert memory[-1] == pytest.approx(memory[0], abs=1e-9) and np.ptp(memory) > 0.05
    x, v = way(found), found.solution.velocity("mass")[:, 0]
    put_in = trapezoid(np.cos(w * found.solution.t) * v, found.solution.t)
    lost = 0.1 * trapezoid(v**2, found.solution.t)
    loop = 4 * limit * (np.ptp(x) / 2 - limit / k)
    assert put_in == pytest.approx(lost + loop, rel=1e-4)


def asked(mech=None, **more):
    """Ask for a motion that repeats, by default of a mass that is pushed once a second."""
    return lambda: rom.periodic_motion(mech or pushed(2 * np.pi), **more)


test_what_has_no_such_motion_is_refused_by_name = refused(
    (asked(period=1.0, conservative=True), ConfigError, "nothing drives"),
    (asked(period=1.0, turns={"giude": 1.0}), ConfigError, "no joint or body 'giude'"),
    (asked(period=1.0, turns={"guide": 1.0}), ConfigError, "'guide' is prismatic; take a revolute"),
    (
        lambda: asked(period=1.0, start=rom.equilibrium(double_pendulum()))(),
        ConfigError,
        r"the state has 14 coordinates.*this mechanism has 7",
    ),
    (asked(period=1.2), ModelError, "'push' does not repeat with the period 1.2 s"),
    (asked(guess=1.0), ModelError, "'push' changes with time, so that the period is not"),
    (asked(slider()[0], guess=3.0), SolverError, "state of rest, not a motion"),
    # resonance without damping
    (asked(pushed(2.0, damping=0.0), period=np.pi, rho_inf=1.0), SolverError, "no motion repeats"),
)


def timed(t, parameters, motion, memory, out):
    out.force[0, 0] = np.cos(parameters[0] * t)


def test_a_law_that_does_not_repeat_is_named_by_its_body():
    mech, mass = slider()
    mech.law("clock", timed, mass, parameters=(2 * np.pi,))
    assert rom.periodic_motion(mech, period=1.0).stable
    with pytest.raises(ModelError, match=r"forces on 'mass' does not repeat with the period 1.2 s"):
        rom.periodic_motion(mech, period=1.2)
    refuses(ModelError, "forces on 'mass' changes with time", rom.periodic_motion, mech, guess=1.0)


def pulse(t, parameters, motion, memory, out):
    phase = (t / parameters[0]) % 1.0
    if 1e-6 < phase < 0.1:
        out.force[0, 0] = np.sin(np.pi * phase / 0.1)


def test_a_law_is_not_refused_for_the_digits_of_a_late_time():
    """A million million periods later round-off alone has led into the pulse."""
    period = next(T for T in 0.5 + 0.01 * np.arange(1, 99) if 1e-6 < (1e12 * T / T) % 1.0 < 1e-3)
    mech, mass = slider()
    mech.law("pulse", pulse, mass, parameters=(period,))
    assert rom.periodic_motion(mech, period=period).stable


def test_where_no_motion_repeats_the_gap_is_told_and_the_last_attempt_kept():
    mech, mass = slider(stiffness=0.0, damping=0.0)
    mech.force("push", mass, (1.0, 0, 0))
    with pytest.raises(SolverError, match="no motion repeats with the period 1 s") as caught:
        rom.periodic_motion(mech, period=1.0)
    assert caught.value.solution.t[-1] - caught.value.solution.t[0] == pytest.approx(1.0)


def test_an_oscillator_with_gaps_has_the_motion_of_its_pieces():
    """Kahraman and Singh: x'' + 2 z x' + f(x) = F + A cos wt, f the force of a gap."""
    z, F, A, w, gap, k = 0.05, 0.1, 0.05, 0.8, 0.1, 1.0
    mech, mass = slider(stiffness=0.0, damping=2 * z)
    mech.force("load", mass, lambda t: (F + A * np.cos(w * t), 0, 0))
    x = np.array([-10, -gap, gap, 10.0])
    at = np.concatenate([[x[0]], [x[1] - 1e-7, x[1]], [x[2], x[2] + 1e-7], [x[3]]])
    force = k * np.sign(at) * np.maximum(np.abs(at) - gap, 0)
    mech.bushing("teeth", "ground", mass, stiffness=np.zeros(6), curves={"x": (at, force)})
    T = 2 * np.pi / w
    found = rom.periodic_motion(mech, period=T, steps=800, settle=40)

    def rates(t, y):
        f = k * np.sign(y[0]) * max(abs(y[0]) - gap, 0.0)
        return [y[1], F + A * np.cos(w * t) - 2 * z * y[1] - f]

    run = solve_ivp(rates, (0, 60 * T), [found.solution.q[0, 0], found.solution.v[0, 0]],
                    rtol=1e-9, atol=1e-11, max_step=T / 50, dense_output=True)  # fmt: skip
    exact = run.sol(59 * T + found.solution.t)[0]
    assert_allclose(way(found), exact, atol=2e-4)
    assert way(found).min() < gap < way(found).max()


def test_a_ball_that_rolls_has_more_free_positions_than_velocities():
    """Seven fifths of its mass swing on a spring: rolling binds velocities alone."""
    w, k, c, r = 1.3, 4.0, 0.4, 0.1
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    mech.add_rigid("mass", mass=1.0, inertia=(0.4 * r**2,) * 3, at=(0, 0, r))
    mech.rolling("roll", "ground", "mass", normal=Z, radius=r)
    for name, side in (("west", -X), ("east", X), ("south", -Y), ("north", Y)):
        end = mech.ground.marker(np.array([0, 0, r]) + 1e3 * side)
        mech.spring_damper(name, end, "mass", stiffness=k / 2, damping=c / 2)
    mech.force("push", "mass", lambda t: (0.02 * np.cos(w * t), 0, 0))
    found = rom.periodic_motion(mech, period=2 * np.pi / w, steps=400)
    amplitude = 0.02 / abs(k - 1.4 * w**2 + 1j * c * w)
    assert np.ptp(way(found)) / 2 == pytest.approx(amplitude, rel=1e-3)
    assert found.multipliers.size == 5 + 3
    decay = np.exp(-c / 2.8 * found.period)
    assert_allclose(np.sort(np.abs(found.multipliers))[:4], decay, rtol=3e-4)
    # where it is turned, and its spin about the normal: one follows the other, so that errors of
    # differences move both apart by their root, and not in the mean
    ones = found.multipliers[np.argsort(np.abs(found.multipliers))[4:]]
    assert_allclose(ones, 1.0, atol=5e-3)
    assert ones.mean() == pytest.approx(1.0, abs=3e-5)
