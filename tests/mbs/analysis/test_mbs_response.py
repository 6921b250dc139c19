"""Harmonic response and Campbell diagrams against closed forms."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.mbs.mechanisms import rotor
from cases.mbs.parts import ORIGIN, X, Y, Z, on_axle, on_guide, on_hinge
from cases.refusals import refuses
from rom.errors import ConfigError, ModelError, RomWarning, SolverError
from rom.mbs.analysis.campbell import Campbell

M1, M2, K1, K2, C1, C2 = 3.0, 1.0, 400.0, 150.0, 2.0, 0.5


def absorber(*, damped=1.0, shaken=False):
    """A mass on springs that carries a second one, along x; on a base that a drive may shake."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    base = "ground"
    if shaken:
        base = on_guide(mech, "table", mass=7.0, guide="slide")
        mech.drive("shaker", "slide", lambda t: 0.0 * t)
    for k, (m, stiffness, c) in enumerate(((M1, K1, C1), (M2, K2, C2))):
        cart = on_guide(mech, f"cart {k}", mass=m, at=(k + 1.0, 0, 0), guide=f"rail {k}")
        mech.spring_damper(f"spring {k}", base, cart, stiffness=stiffness, damping=damped * c)
        base = cart
    return mech


def closed_form(f, load):
    """(2, n) motion of both masses, x = (K - w^2 M + i w C)^-1 load."""
    w = 2 * np.pi * f
    k1, k2 = K1 + 1j * w * C1, K2 + 1j * w * C2
    a, b, d = k1 + k2 - w**2 * M1, -k2, k2 - w**2 * M2
    p, q = load(k1)
    return np.array([d * p - b * q, a * q - b * p]) / (a * d - b * b)


def test_response_of_two_masses_to_a_force():
    mech, f = absorber(), np.linspace(0.0, 5.0, 40)
    exact = closed_form(f, lambda k1: (1.0, 0.0))
    for k in (0, 1):
        found = rom.frequency_response(mech, None, f, force="cart 0", motion=f"cart {k}")
        assert_allclose(found.receptance[:, 0, 0], exact[k], rtol=1e-8)
        assert_allclose(found.accelerance[:, 0, 0], -((2 * np.pi * f) ** 2) * exact[k], rtol=1e-8)
        assert_allclose(found.mobility[:, 0, 0], 2j * np.pi * f * exact[k], rtol=1e-8)
        assert_allclose(found.receptance[:, 1:], 0, atol=1e-12)


def test_the_response_to_a_couple_and_of_an_angle():
    """An undamped pendulum: angle per moment 1 / (J (w0^2 - w^2)), its bob L times as far."""
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    bob = on_hinge(mech, -Z / 2, inertia=(0.2, 0.3, 0.2))
    f, J = np.array([0.0, 0.4, 1.7]), 0.3 + 2.0 * 0.25
    ends = {"force": bob.marker("c"), "motion": bob.marker("c")}
    found = rom.frequency_response(mech, rom.equilibrium(mech), f, **ends).receptance
    angle = 1 / (2.0 * 9.81 * 0.5 - J * (2 * np.pi * f) ** 2)
    assert_allclose(found[:, 4, 4], angle, rtol=1e-8)
    for i, j, share in ((0, 4, -0.5), (4, 0, -0.5), (0, 0, 0.25)):
        assert_allclose(found[:, i, j], share * angle, rtol=1e-8)


def test_transmissibility_of_two_masses_on_a_shaken_base():
    mech, f = absorber(shaken=True), np.linspace(0.0, 5.0, 40)
    exact = closed_form(f, lambda k1: (k1, 0.0))
    for k in (0, 1):
        found = rom.transmissibility(mech, None, f, drive="shaker", motion=f"cart {k}")
        assert_allclose(found[:, 0], exact[k], rtol=1e-8)
        assert_allclose(found[:, 1:], 0, atol=1e-12)
    table = rom.transmissibility(mech, None, f, drive="shaker", motion="table")
    assert_allclose(table[:, 0], 1.0, rtol=1e-12)


def turned_crank(speed):
    """A crank of length 0.5 about z that a drive turns."""
    mech = rom.Mechanism()
    crank = on_hinge(mech, X / 2, "crank", mass=1.0, inertia=(1, 1, 1), axis=Z)
    mech.drive("motor", "hinge", lambda t: speed * t)
    return mech, crank.marker("c")


def test_a_mechanism_that_its_drive_moves_alone_follows_it_and_does_not_vibrate():
    mech, end = turned_crank(speed=0.0)
    found = rom.transmissibility(mech, None, [1.0, 5.0], drive="motor", motion=end)
    assert_allclose(found, [[0, 0.5, 0, 0, 0, 1]] * 2, atol=1e-12)
    still = rom.linearize(turned_crank(speed=2.0)[0])
    assert still.frequencies.size == 0 and still.shapes.shape == (6, 0) and still.stable


def test_infinite_responses_and_wrong_arguments_are_named():
    mech = absorber(damped=0.0)
    ends = {"force": "cart 0", "motion": "cart 1"}
    resonance = rom.linearize(mech).frequencies[1]
    unknown = {"force": "cart 0", "motion": mech.parts["cart 1"].marker((0, 0, 1))}
    respond, shake = rom.frequency_response, rom.transmissibility
    refuses(SolverError, f"at {resonance:.6g}", respond, mech, None, [1.0, resonance], **ends)
    refuses(ConfigError, "from zero on", respond, mech, None, [-1.0], **ends)
    refuses(ConfigError, "is not a marker of the mechanism", respond, mech, None, [1.0], **unknown)
    said = r"no drive 'belt'; the mechanism has \[\]"
    refuses(ConfigError, said, shake, mech, None, [1.0], drive="belt", motion="cart 1")
    for speeds in ([1.0], [2.0, 1.0]):
        refuses(ConfigError, "2 or more numbers that ascend", rom.campbell, rotor, speeds)
    shaken = absorber(shaken=True)
    shaken.fixed("bolt", "ground", "table")
    with pytest.warns(RomWarning), pytest.raises(ModelError, match="do not let this drive move"):
        shake(shaken, None, [1.0], drive="shaker", motion="cart 1")


def test_campbell_diagram_of_a_rotor_with_its_critical_speeds():
    """(kx - A w^2)(ky - A w^2) = (C W w)^2; w = W where (kx - A W^2)(ky - A W^2) = (C W^2)^2."""
    speeds = np.linspace(0.0, 60.0, 41)
    found = rom.campbell(rotor, speeds, frame={"disc": "world"})
    A, C, kx, ky = 0.3, 0.5, 300.0, 500.0
    b = A * (kx + ky) + (C * speeds) ** 2
    root = np.sqrt(b**2 - 4 * A**2 * kx * ky)
    exact = np.sqrt(np.array([b - root, b + root]) / (2 * A**2)).T
    assert_allclose(2 * np.pi * found.frequencies, exact, rtol=2e-6)
    assert_allclose(found.damping_ratios, 0, atol=1e-7)
    assert found.mac.min() > 0.5
    # roots of (C^2 - A^2) W^4 + A (kx + ky) W^2 - kx ky = 0
    critical = np.sqrt(max(np.roots([C**2 - A**2, A * (kx + ky), -kx * ky]).real))
    assert [k for k, _ in found.crossings()] == [0]
    assert_allclose(found.crossings()[0][1], critical, rtol=1e-3)


def crossing(speed):
    """Two bobs on a turning shaft, one swings outwards, one sideways with a coil."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    turn = np.array([0, 0, speed])
    marks, shaft = {"pin": (-0.5, 0, 0)}, on_axle(mech, "shaft", inertia=(1, 1, 1), omega=turn)
    mech.drive("motor", "axle", lambda t: speed * t, rate=lambda t: speed)
    for name, axis, k in (("lag", Z, 60.0), ("flap", Y, 20.0)):
        bob = mech.add_rigid(name, mass=2.0, inertia=(1e-6,) * 3, at=(0.5, 0, 0), markers=marks,
                             velocity=np.cross(turn, (0.5, 0, 0)), omega=turn)  # fmt: skip
        mech.revolute(f"hinge {name}", shaft, bob.marker("pin"), axis=axis)
        mech.rotational_spring(f"coil {name}", f"hinge {name}", stiffness=k)
    return mech


def test_modes_that_cross_keep_their_column():
    """Hinged in the axis: lag stays at sqrt(k / m L^2), flap^2 grows by W^2."""
    speeds = np.linspace(0.0, 16.0, 9)
    found = rom.campbell(crossing, speeds)
    J = 2.0 * 0.25
    exact = np.sqrt(np.array([20.0 / J + speeds**2, 60.0 / J + 0 * speeds])).T
    assert_allclose(2 * np.pi * found.frequencies, exact, rtol=1e-5)
    assert found.mac.min() > 0.99
    assert {k for k, _ in found.crossings(1.0)} == {1}


def test_crossings_are_interpolated():
    speeds = np.array([0.0, 10.0, 20.0])
    found = Campbell(speeds, 1j * np.array([[12.0, 30.0], [13.0, 31.0], [14.0, 32.0]]), speeds)
    assert_allclose(found.crossings(), [(0, 10 + 10 * 3 / 9)])
    assert_allclose(found.crossings(2.0), [(0, 10 * 12 / 19), (1, 10 + 10 * 11 / 19)])


def test_a_mechanism_as_a_whole_takes_its_equilibrium_at_each_speed():
    """A slider on a spring in a turning slot moves out to k r0 / (k - m W^2).

    The slot turns freely: at constant momentum omega^2 = k / m - W^2 + 4 W^2 m r^2 / (J + m r^2).
    """
    k, m, rest, J = 200.0, 0.5, 0.4, 0.3
    mech = rom.Mechanism(gravity=(0, 0, 0))
    slot = on_axle(mech, "slot", inertia=(J, J, J))
    ball = mech.add_rigid("ball", mass=m, inertia=(1e-6,) * 3, at=(rest, 0, 0)).marker(ORIGIN)
    mech.prismatic("groove", slot, ball, axis=X)
    mech.spring_damper("rope", slot, ball, stiffness=k)
    speeds = np.array([2.0, 7.0, 12.0])
    r = k * rest / (k - m * speeds**2)
    for speed, radius in zip(speeds, r, strict=True):
        state = rom.equilibrium(mech, spin=(0, 0, speed))
        assert_allclose(np.hypot(*state.q[7:9]), radius, rtol=1e-10)
    found = 2 * np.pi * rom.campbell(mech, speeds).frequencies
    square = k / m - speeds**2 + 4 * speeds**2 * m * r**2 / (J + m * r**2)
    assert_allclose(found[:, 0], np.sqrt(square), rtol=1e-5)


def test_damping_over_speed_is_that_of_the_formula():
    """c / (2 sqrt(k m)), whatever the speed."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    on_guide(mech, "mass", mass=2.0)
    mech.bushing("coil", "ground", "mass", stiffness=(50.0,) * 6, damping=(4.0,) * 6)
    found = rom.campbell(lambda speed: mech, [1.0, 2.0]).damping_ratios
    assert_allclose(found, 4.0 / (2 * np.sqrt(50.0 * 2.0)), rtol=1e-9)
