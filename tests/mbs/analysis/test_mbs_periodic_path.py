"""Paths of motions that repeat, against harmonic balance and the borders of stability."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.optimize import fsolve
from scipy.special import mathieu_a, mathieu_b

import rom
from cases.mbs.parts import ORIGIN, X, Z, on_guide, on_hinge
from cases.refusals import refused, refuses
from rom.components.orbits.family import Family
from rom.components.orbits.flow import Flow

FORCE, DAMPING, SPRING, FREE = 0.3, 0.1, 2.5, 0.8
ODD, N = np.array([1, 3, 5, 7, 9]), 256
E = np.exp(2j * np.pi / N * np.outer(np.arange(N), ODD))


def across(w):
    """A mass of 1 kg along x between two springs across: F = -2 k x (1 - l / sqrt(1 + x^2))."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mass, base = on_guide(mech), mech.ground.marker(ORIGIN)
    for side in (1, -1):
        end = mech.ground.marker((0, side, 0))
        mech.spring_damper(f"spring {side}", end, mass, stiffness=SPRING, free_length=FREE)
    mech.bushing("damper", base, mass, stiffness=np.zeros(6), damping=(DAMPING, 0, 0, 0, 0, 0))
    mech.force("push", mass, lambda t: (FORCE * np.cos(w * t), 0, 0))
    return mech


def amplitude(solution):
    return np.abs(solution.position("mass")[:, 0]).max()


def balance(u, phase):
    """Residual of harmonic balance for a frequency and a motion (6 coefficients, first at a phase).

    The unknowns are frequency, amplitude of the first harmonic, and the others.
    """
    w, c = u[0], np.r_[u[1] * np.exp(1j * phase), u[2::2] + 1j * u[3::2]]
    x = (E @ c).real
    f = 2 * SPRING * x * (1 - FREE / np.sqrt(1 + x**2))
    r = (-((w * ODD) ** 2) + 1j * DAMPING * w * ODD) * c + 2 / N * (E.conj().T @ f)
    r[0] -= FORCE
    return np.ravel([r.real, r.imag], order="F")


@pytest.fixture(scope="module")
def curve():
    return rom.periodic_path(across, (1.1, 1.9), period=lambda w: 2 * np.pi / w, steps=150)


@pytest.fixture(scope="module")
def exact():
    """Frequency and amplitude of the first harmonic by less its phase, which falls."""
    phases, found = np.linspace(-0.2, -3.08, 300), []
    u = np.r_[1.0, 0.6, np.zeros(2 * ODD.size - 2)]
    for phase in phases:
        u, _, _, message = fsolve(balance, u, (phase,), full_output=True, xtol=1e-13)
        assert np.abs(balance(u, phase)).max() < 1e-10, message
        found.append(u[:2])
    return CubicSpline(-phases, found)


def test_motions_and_folds_of_a_hardening_spring_are_those_of_harmonic_balance(curve, exact):
    """And the branch between the folds is unstable, and alone so."""
    for motion in curve.motions[::3]:
        s = motion.solution
        turning = np.exp(-2j * np.pi * s.t[:-1] / motion.period)
        c = 2 * np.mean(s.position("mass")[:-1, 0] * turning)
        w, a = exact(-np.angle(c))
        assert 2 * np.pi / motion.period == pytest.approx(w, rel=3e-3)
        assert abs(c) == pytest.approx(a, rel=3e-3)
    folds = exact(exact.derivative().roots(extrapolate=False)[0])[:, 0]
    folds = [w for w in folds if 1.1 < w < 1.9]
    assert [x.kind for x in curve.critical] == ["fold", "fold"] and len(folds) == 2
    assert_allclose([x.p for x in curve.critical], folds, rtol=2e-3)
    for x in curve.critical:
        assert np.abs(x.motion.multipliers[0] - 1.0) < 2e-2
    changes = np.flatnonzero(np.diff(curve.stable.astype(int)))
    assert len(changes) == 2 and curve.stable[0] and curve.stable[-1]
    assert_allclose(curve.p[changes], [x.p for x in curve.critical], rtol=0.02)
    a = curve.of(amplitude)
    assert np.all(np.diff(a[changes[0] + 1 : changes[1]]) < 0.0)


@pytest.mark.long
def test_the_way_back_meets_the_same_folds(curve):
    back = rom.periodic_path(across, (1.5, 1.1), period=lambda w: 2 * np.pi / w, steps=150, n=30)
    assert back.critical[0].kind == "fold"
    assert back.critical[0].p == pytest.approx(curve.critical[1].p, rel=1e-5)
    assert back.p[0] == 1.5 and back.stable[0] and not back.stable[-1]


def shaken(border):
    """A pendulum shaken along z, upright or hanging, by its gravity over that at the border."""
    w, q = 20.0, 0.6
    squared = {"branch": -mathieu_a(0, q), "flip": mathieu_b(1, q)}[border]
    side = {"branch": 1.0, "flip": -1.0}[border]

    def build(factor):
        mech = rom.Mechanism(gravity=(0, 0, -factor * squared * w**2 / 4))
        cart = on_guide(mech, "cart", axis=Z, guide="lift")
        a = 0.5 * q
        mech.drive("shaker", "lift", lambda t: a * np.cos(w * t),
                   rate=lambda t: -a * w * np.sin(w * t),
                   acceleration=lambda t: -a * w**2 * np.cos(w * t))  # fmt: skip
        on_hinge(mech, side * Z, mass=1.0, inertia=(1e-9,) * 3, pivot=cart)
        return mech

    return build, 2 * np.pi / w


@pytest.mark.parametrize("border", ["branch", "flip"])
def test_where_a_shaken_pendulum_loses_its_stability_it_is_at_the_border_of_mathieu(border):
    build, T = shaken(border)
    path = rom.periodic_path(build, (0.95, 1.06), period=T, steps=400)
    assert [x.kind for x in path.critical] == [border]
    assert path.critical[0].p == pytest.approx(1.0, abs=1e-3)
    assert path.stable[0] and not path.stable[-1]


def fed(c):
    """An oscillator that is pushed, with damping that may feed it."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mass = on_guide(mech)
    mech.motor("law", "guide", lambda t, x, v: -4.0 * x - c * v, compiled=False)
    mech.force("push", mass, lambda t: (np.cos(1.3 * t), 0, 0))
    return mech


def test_a_second_frequency_comes_in_where_damping_vanishes():
    path = rom.periodic_path(fed, (0.3, -0.2), period=2 * np.pi / 1.3, steps=60)
    assert [x.kind for x in path.critical] == ["Neimark-Sacker"]
    assert path.critical[0].p == pytest.approx(0.0, abs=2e-3)


def self_excited(mu):
    mech = rom.Mechanism(gravity=(0, 0, 0))
    on_guide(mech, at=2 * X, base=2 * X)
    mech.motor("law", "guide", lambda t, x, v: mu * (1 - (x + 2) ** 2) * v - x - 2, compiled=False)
    return mech


def test_limit_cycles_are_followed_with_their_periods():
    path = rom.periodic_path(self_excited, (1.0, 1.5), guess=6.6, steps=100, step=0.5)

    def rates(t, y):
        return [y[1], path.p[-1] * (1 - y[0] ** 2) * y[1] - y[0]]

    run = solve_ivp(rates, (0, 60), [2.0, 0.0], rtol=1e-10, atol=1e-12, events=lambda t, y: y[1])
    period = run.t_events[0][-1] - run.t_events[0][-3]
    assert path.p[-1] == pytest.approx(1.5)
    assert path.period[-1] == pytest.approx(period, rel=2e-3)
    assert path.stable.all() and all(x.free for x in path.motions) and not path.critical
    assert max(x.gap for x in path.motions) < 2e-5


def swinging(torque):
    """A pendulum of which a torque makes a swing, with moments of its pin."""
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    pin = on_hinge(mech, -Z, mass=1.0, inertia=(0.1, 0.1, 0.1)).marker("pin")
    loss = (0, 0, 0, 0, 0.5, 0)
    mech.bushing("loss", mech.ground.marker(ORIGIN), pin, stiffness=np.zeros(6), damping=loss)
    mech.torque("drive", pin, lambda t: (0, torque * np.cos(2.0 * t), 0))
    return mech


def family_at(p, span=0.5):
    """Motions of the pendulum near a torque, and the one there."""
    motion = rom.periodic_motion(swinging(p), period=np.pi, steps=60)
    scale = Flow(swinging(p), 0.0, np.pi, 60, 0.8).probe
    still = 0.0 * scale
    return Family(swinging, np.pi, motion, None, 60, 0.8, span, scale, still), motion


def test_motions_change_with_the_parameter_as_differences_of_them_do():
    (family, motion), d = family_at(3.0), 1e-4
    newton, slope = family.corrections(family.member(motion, 3.0), 3.0)
    one, two = (rom.periodic_motion(swinging(3.0 + x), period=np.pi, steps=60, start=motion).state
                for x in (-d, d))  # fmt: skip
    moved = family.flow(3.0, np.pi).apart(one, two) / (2 * d)
    faster = (two.v - one.v) / (2 * d) * np.pi / (2 * np.pi)
    turn, n = 4, moved.size  # about the hinge: the free one, of which the others follow
    assert_allclose(slope[:n] * family.scale, moved, atol=1e-4 * np.abs(moved).max())
    assert slope[n + turn] * family.scale[turn] == pytest.approx(faster[turn], rel=2e-3)
    assert np.abs(moved[turn]) > 0.05 and np.abs(faster[turn]) > 0.02
    assert np.abs(newton).max() < 1e-5 and slope[-1] == 0.0


def test_steps_count_in_sizes_of_the_motion():
    family, _ = family_at(3.0)
    family.unit, step = 0.2, np.array([0.1, -0.3, 0.0])
    assert family.size(step) == pytest.approx(1.5)
    assert family.inner(step, 2 * step) == pytest.approx(2 * (0.5**2 + 1.5**2))


@pytest.mark.parametrize("change", [-0.6, 1.2])
def test_a_step_that_halves_or_doubles_an_unknown_period_is_refused(change):
    motion = rom.periodic_motion(self_excited(1.0), guess=6.6, steps=60)
    scale = Flow(self_excited(1.0), 0.0, motion.period, 60, 0.8).probe
    family = Family(self_excited, None, motion, None, 60, 0.8, 1.0, scale, 0.0 * scale)
    step = np.zeros(2 * scale.size + 1)
    at = family.member(motion, 1.0)
    step[-1] = 0.1
    assert family.moved(at, step, 1.0).period == pytest.approx(1.1 * motion.period)
    step[-1] = change
    refuses(rom.SolverError, "period changes by too much", family.moved, at, step, 1.0)


def test_a_step_that_no_joint_allows_is_one_that_is_too_long(monkeypatch):
    """As the path is followed, where shorter ones are tried then."""
    family, motion = family_at(3.0)
    at = family.member(motion, 3.0)

    def torn(*_):
        raise rom.ModelError("joints contradict each other.")

    monkeypatch.setattr(Flow, "moved", torn)
    with pytest.raises(rom.SolverError, match="no start satisfies the joints: joints contradict"):
        family.moved(at, np.zeros(2 * family.scale.size + 1), 3.0)


@pytest.mark.parametrize(("x", "which"), [(0.0, 0), (1.0, -1)])
def test_which_of_two_stable_motions_is_followed_the_start_says(exact, x, which):
    w = 1.5
    begun = rom.simulate(across(w), t_end=1e-6, dt=1e-7).final
    q = begun.q + np.array([x, 0, 0, 0, 0, 0, 0])
    start = replace(begun, t=0.0, q=q, v=0 * begun.v, algorithmic=None, memory=None)
    path = rom.periodic_path(across, (w, 1.6), period=lambda w: 2 * np.pi / w, steps=100,
                             start=start, settle=25, n=2)  # fmt: skip
    phases = CubicSpline(exact.x, exact(exact.x)[:, 0] - w).roots(extrapolate=False)
    amplitudes = np.sort(exact(phases)[:, 1])
    assert len(amplitudes) == 3 and path.stable[0] and len(path.p) == 2
    assert path.of(amplitude)[0] == pytest.approx(amplitudes[which], rel=0.06)


test_wrong_arguments_of_a_path_are_named = refused(
    (lambda: rom.periodic_path(across, (1.0, 1.0), period=6.0), "needs two values"),
    (lambda: rom.periodic_path(across, (1.0, 2.0), period=lambda w: -w), "period"),
    error=rom.ConfigError,
)


def test_another_number_of_bodies_is_refused_and_what_was_found_is_kept():
    def build(w):
        mech = across(w)
        if w > 0.85:
            mech.add_rigid("more", mass=1.0, inertia=(1, 1, 1), at=(9, 0, 0))
        return mech

    with pytest.raises(rom.ConfigError, match=r"the bodies at 0.8") as caught:
        rom.periodic_path(build, (0.8, 1.2), period=lambda w: 2 * np.pi / w, steps=60)
    assert caught.value.solution.p.size >= 1


def test_the_error_of_a_lost_path_holds_it():
    def build(w):
        if w > 1.0:
            raise rom.SolverError("no such mechanism.")
        return across(w)

    with pytest.raises(rom.SolverError, match=r"lost behind 1: no such mechanism") as caught:
        rom.periodic_path(build, (0.8, 1.2), period=lambda w: 2 * np.pi / w, steps=60)
    assert caught.value.solution.p[-1] <= 1.0
