"""Derivatives of equilibria, eigenvalues and motions against closed forms."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq

import rom
from cases.mbs.parts import ORIGIN, X, Z, on_guide, on_hinge
from cases.refusals import refuses

G = 9.81
BAR = {"length": 1.0, "mass": 2.0, "lean": 0.3, "coil": 30.0}


def hung(mass=1.3, stiffness=200.0, damping=4.0):
    """A mass on a vertical slide, a spring above it and a damper."""
    mech = rom.Mechanism(gravity=(0, 0, -G))
    centre, law = on_guide(mech, "box", mass=mass, axis=Z), {"damping": damping, "free_length": 1.0}
    mech.spring_damper("coil", mech.ground.marker(Z), centre, stiffness=stiffness, **law)
    return mech


def bar(length=1.0, mass=2.0, lean=0.3, coil=30.0):
    """A slender bar on a hinge with a coil that has no moment at the angle `lean` from above."""
    mech = rom.Mechanism(gravity=(0, -G, 0))
    inertia = mass * length**2 / 12
    moments = (1e-3, inertia, inertia)
    on_hinge(mech, length / 2 * X, "bar", mass=mass, inertia=moments, axis=Z)
    mech.rotational_spring("coil", "hinge", stiffness=coil, free_angle=lean)
    return mech


def angle_of(mechanism, state):
    """Angle of the bar against the x axis."""
    return 2 * np.arctan2(state.q[6], state.q[3])


def test_a_bar_on_a_coil_turns_as_the_implicit_function_says():
    """coil (a - lean) + m g l/2 cos a = 0 for large angles; all parameters, joint moved too."""
    p, found = BAR, rom.equilibrium_sensitivity(bar, BAR, angle_of)
    a, moment = float(found.value), p["mass"] * G * p["length"] / 2
    assert_allclose(p["coil"] * (a - p["lean"]) + moment * np.cos(a), 0, atol=1e-8)
    curve = p["coil"] - moment * np.sin(a)
    wanted = {
        "length": -moment * np.cos(a) / p["length"] / curve,
        "mass": -moment * np.cos(a) / p["mass"] / curve,
        "lean": p["coil"] / curve,
        "coil": -(a - p["lean"]) / curve,
    }
    for name, slope in wanted.items():
        assert_allclose(found[name], slope, rtol=1e-6, err_msg=name)


def guyed(place):
    """A box on a vertical slide at a place along x, held by a spring to (0.5, 0, 0.8)."""
    mech = rom.Mechanism(gravity=(0, 0, -G))
    at = (place, 0, 0)
    centre = on_guide(mech, "box", at=at, base=at, axis=Z)
    guy = mech.ground.marker((0.5, 0, 0.8))
    mech.spring_damper("guy", guy, centre, stiffness=60.0, free_length=0.4)
    return mech


def test_a_joint_that_moves_takes_the_forces_with_it():
    """k (1 - 0.4 / L) (0.8 - z) = m g with L^2 = (0.5 - x)^2 + (0.8 - z)^2."""

    def miss(z, x):
        return 60 * (1 - 0.4 / np.hypot(0.5 - x, 0.8 - z)) * (0.8 - z) - G

    found = rom.equilibrium_sensitivity(guyed, {"place": 0.1}, lambda mech, state: state.q[2])
    heights = [brentq(miss, -2.0, 0.5, args=(0.1 + step,), xtol=1e-14) for step in (-1e-4, 1e-4)]
    assert_allclose(found["place"], (heights[1] - heights[0]) / 2e-4, rtol=1e-6)
    assert abs(found["place"]) > 0.05


def test_reactions_have_derivatives_too():
    weight = {"output": lambda mech, state: np.linalg.norm(state.lam[:3])}
    found = rom.equilibrium_sensitivity(bar, {"mass": 2.0, "coil": 30.0}, **weight)
    assert_allclose([found["mass"], found["coil"]], [G, 0], atol=1e-6)


def test_a_damped_oscillator_has_the_derivatives_of_its_root():
    """s = -c/2m + i sqrt(k/m - c^2/4m^2)."""
    p = {"mass": 1.3, "stiffness": 200.0, "damping": 4.0}
    found = rom.frequency_sensitivity(hung, p)
    m, k, c = p.values()
    w = np.sqrt(k / m - c**2 / (4 * m**2))
    assert_allclose(found.value, [-c / (2 * m) + 1j * w], rtol=1e-9)
    slopes = {
        "mass": c / (2 * m**2) + 1j * (-k / m**2 + c**2 / (2 * m**3)) / (2 * w),
        "stiffness": 1j / (2 * m * w),
        "damping": -1 / (2 * m) - 1j * c / (4 * m**2 * w),
    }
    for name, slope in slopes.items():
        assert_allclose(found[name], [slope], rtol=1e-6, err_msg=name)


def test_the_frequency_of_a_bar_changes_with_the_equilibrium_that_moves():
    """I w^2 = coil - m g l/2 sin a(p): both the matrices and the angle count."""
    p, found = BAR, rom.frequency_sensitivity(bar, BAR)
    turn = rom.equilibrium_sensitivity(bar, BAR, angle_of)
    a, inertia, moment = float(turn.value), 2.0 / 3, G
    w = np.sqrt((30.0 - moment * np.sin(a)) / inertia)
    assert_allclose(found.value, [1j * w], rtol=1e-9)
    direct = {"length": -moment * np.sin(a), "mass": -moment * np.sin(a) / 2, "coil": 1, "lean": 0}
    heavy = {"length": 2 * w**2, "mass": w**2 / 2, "coil": 0, "lean": 0}  # w^2 dI/dp over I
    for name in p:
        square = (direct[name] - moment * np.cos(a) * float(turn[name])) / inertia - heavy[name]
        assert_allclose(found[name], [1j * square / (2 * w)], rtol=2e-6, err_msg=name)


def two_masses(stiffness=100.0, coupling=50.0):
    """Two masses on a line, springs to the walls and between."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    ends = [on_guide(mech, f"{m}", mass=m, at=(m, 0, 0), guide=f"slide {m}") for m in (1.0, 2.0)]
    mech.spring_damper("left", mech.ground.marker(ORIGIN), ends[0], stiffness=stiffness)
    mech.spring_damper("middle", *ends, stiffness=coupling)
    mech.spring_damper("right", ends[1], mech.ground.marker((3, 0, 0)), stiffness=2 * stiffness)
    return mech


def test_every_mode_of_several_has_its_own_derivative():
    found = rom.frequency_sensitivity(two_masses, {"stiffness": 100.0, "coupling": 50.0})

    def exact(k, c):
        K = np.array([[k + c, -c], [-c, 2 * k + c]])
        return np.sqrt(np.linalg.eigvals(np.diag([1.0, 0.5]) @ K))

    w = np.sort(exact(100.0, 50.0).real)
    assert_allclose(found.value.imag, w, rtol=1e-9)
    step = 1e-3
    for name, dk, dc in (("stiffness", step, 0), ("coupling", 0, step)):
        ends = [np.sort(exact(100.0 + s * dk, 50.0 + s * dc).real) for s in (-1, 1)]
        slope = (ends[1] - ends[0]) / (2 * step)
        assert_allclose(found[name].imag, slope, rtol=1e-6, atol=1e-9)


def swung(length, gravity):
    """Angle of a pendulum released level, after 0.4 s; its inertia is 1.1 m l^2."""
    mech = rom.Mechanism(gravity=(0, -gravity, 0))
    on_hinge(mech, length * X, mass=1.0, inertia=(0.1 * length**2,) * 3, axis=Z)
    sol = rom.simulate(mech, t_end=0.4, dt=0.4, method="dop853", rtol=1e-11)
    return np.arctan2(*sol.position("bob")[-1, [1, 0]])


def test_the_end_of_a_motion_changes_as_its_equation_says():
    """The angle depends on t sqrt(g/l) alone: l da/dl = -t a'/2, g da/dg = t a'/2."""
    found = rom.motion_sensitivity(swung, {"length": 0.7, "gravity": G})
    rate = -np.sqrt(2 * G / 0.7 / 1.1 * -np.sin(float(found.value)))
    assert_allclose(0.7 * found["length"], -0.2 * rate, rtol=1e-6)
    assert_allclose(G * found["gravity"], 0.2 * rate, rtol=1e-6)
    assert (found.error < 1e-5).all()


def test_wrong_questions_are_refused():
    motion, rest = rom.motion_sensitivity, rom.equilibrium_sensitivity
    refuses(rom.ConfigError, r"must be \{name: value\}", motion, lambda: 0.0, {})
    jumps = lambda x: np.zeros(1 + (x > 1))  # noqa: E731
    refuses(rom.ConfigError, "must have the same shape", motion, jumps, {"x": 1.0})
    found = motion(lambda x: x**3, {"x": 2.0})
    assert_allclose(found["x"], 12.0, rtol=1e-9)
    refuses(rom.ConfigError, r"no parameter 'y'.*'x'", found.__getitem__, "y")
    with pytest.raises(rom.ConfigError, match="bodies and joints must be the same"):
        rest(_sometimes_two, {"x": 1.0}, lambda mech, state: 0.0)
    with pytest.raises(rom.ModelError, match="two eigenvalues are equal"):
        rom.frequency_sensitivity(lambda k: two_masses(k, 0.0), {"k": 100.0})


def _sometimes_two(x):
    mech = hung()
    if x > 1.0:
        mech.add_rigid("more", mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0))
    return mech
