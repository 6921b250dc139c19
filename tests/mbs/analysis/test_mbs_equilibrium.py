"""Statics against closed forms, spinning equilibria, and mechanisms that nothing holds."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq

import rom
from cases.beam import stiffened_beam
from cases.long import few
from cases.mbs.mechanisms import slider_crank
from cases.mbs.parts import ORIGIN, X, Y, Z, below, on_axle, on_guide, on_hinge
from cases.refusals import refuses
from rom.errors import ConfigError, ModelError, RomWarning, SolverError
from rom.mbs.analysis.tangent import Tangent

g = 9.81


def pendulum(angle, length=0.7):
    mech = rom.Mechanism(gravity=(0, 0, -g))
    on_hinge(mech, below(angle, length), inertia=(0.1, 0.2, 0.2))
    return mech


@pytest.mark.parametrize("angle", [0.5, 2.0, 3.1])
def test_a_pendulum_hangs_down_from_wherever_it_starts(angle):
    state = rom.equilibrium(pendulum(angle))
    assert_allclose(state.q[:3], [0, 0, -0.7], atol=1e-12)
    assert not state.v.any() and not state.a.any()
    reaction = rom.simulate(pendulum(angle), t_end=1e-3, dt=1e-3, state=state).reaction("hinge")
    assert_allclose(reaction[0, :3], [0, 0, 2.0 * g], atol=1e-9)


@pytest.mark.parametrize("angle", few(1, [1.7, 0.7, 1.3]))  # of half a turn
def test_a_moment_about_an_axis_fixed_in_space_bends_further_than_is_stable(angle):
    """It has no potential: a chain weak in twist would leave the plane; it bends by M n / k."""
    mech, n, springs = rom.Mechanism(gravity=ORIGIN), 4, (0.3, 4.0, 4.0)
    half, tip, solid = X / (2 * n), "ground", {"mass": 0.1, "inertia": (1e-3,) * 3}
    for i in range(n):
        link = mech.add_rigid(f"link {i}", **solid, at=(2 * i + 1) * half)
        ends = tip, link.marker(-half)
        mech.spherical(f"joint {i}", *ends)
        mech.bushing(f"spring {i}", *ends, stiffness=(0, 0, 0, *springs))
        tip = link.marker(half)
    mech.torque("moment", tip, (0, -np.pi * angle, 0))
    with pytest.warns(RomWarning, match="unstable: body 'link 3' turns about its own axis"):
        still = rom.snapshot(mech, rom.equilibrium(mech, steps=8))
    A = still.axes(tip.body, tip.place)[0]
    assert_allclose(A[:, 0], [np.cos(np.pi * angle), 0, np.sin(np.pi * angle)], atol=1e-9)


def test_on_its_head_it_is_said_to_be_unstable():
    with pytest.warns(RomWarning, match="unstable: body 'bob' turns about its own axis"):
        state = rom.equilibrium(pendulum(np.pi))
    assert_allclose(state.q[2], 0.7)


@pytest.mark.parametrize("steps", [1, 4])
@pytest.mark.parametrize("by_law", [False, True])
def test_a_pendulum_pulled_aside(steps, by_law):
    """tan(angle) = F / m g, the force given by a function of time or by a law in Python."""
    mech = pendulum(0.1)
    bob, wind = mech.parts["bob"].marker("c"), lambda t: (10.0 * t, 0, 0)
    if by_law:
        mech.user_force("wind", lambda t, a: (wind(t), (0, 0, 0)), bob)
    else:
        mech.force("wind", bob, wind)
    state = rom.equilibrium(mech, t=3.0, steps=steps)
    assert state.t == 3.0
    assert_allclose(np.arctan2(state.q[0], -state.q[2]), np.arctan(30.0 / (2.0 * g)), rtol=1e-11)


def test_a_cantilever_sags_by_its_weight():
    """rho A g L^4 / 8 E I at the tip, less what 20 modes do not see."""
    length, EI, rhoA = 2.0, 30.0, 0.5
    body = stiffened_beam(length, EI, rhoA, stiffened=False)
    mech = rom.Mechanism(gravity=(0, -1e-2, 0))
    beam = mech.add_flexible("beam", body)
    mech.fixed("clamp", mech.ground.marker((0, 0, 0)), beam.marker("root"))
    state = rom.equilibrium(mech)
    tip = body.marker("tip").translation[1] @ state.q[7:]
    assert_allclose(tip, -rhoA * 1e-2 * length**4 / (8 * EI), rtol=1e-7)
    found = rom.linearize(mech, state)
    assert_allclose(found.frequencies, body.frequencies(fixed=("root",)), rtol=1e-7)


@pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")
def test_the_torque_that_holds_a_slider_crank():
    """Virtual work: torque of the drive = piston force times dx/dphi."""
    l1, l2, phi, push = 0.1, 0.3, 0.8, 200.0
    mech = slider_crank(l1, l2, speed=1.0)
    mech.force("gas", mech.parts["slider"].marker("b"), (-push, 0, 0))
    state = rom.equilibrium(mech, t=phi)
    s = l1 / l2 * np.sin(phi)
    slope = -l1 * np.sin(phi) * (1 + l1 / l2 * np.cos(phi) / np.sqrt(1 - s**2))
    assert_allclose(abs(state.lam[-1]), abs(push * slope), rtol=1e-9)
    assert_allclose(state.q[14], l1 * np.cos(phi) + l2 * np.sqrt(1 - s**2), rtol=1e-10)


@pytest.mark.long
@pytest.mark.once
def test_statics_are_where_a_damped_motion_ends():
    mech = rom.Mechanism(gravity=(0, 0, -g))
    link = on_hinge(mech, X / 4, "link", mass=1.0, inertia=(0.01, 0.02, 0.02))
    end = link.marker(X / 4)
    body = stiffened_beam(0.5, 40.0, 1.0, n_modes=2)
    turned = np.array([1.0, 1.0, 0, 0]) / np.sqrt(2)  # it bends in the plane of the motion
    damped = replace(body, D=0.02 * body.K)
    arm = mech.add_flexible("arm", damped, at=(0.5, 0, 0), orientation=turned)
    mech.revolute("two", end, arm.marker("root"), axis=Y)
    mech.rotational_spring("coil", "two", stiffness=8.0, damping=1.0)
    rope = mech.ground.marker((0.5, 0, 0.6))
    mech.spring_damper("rope", rope, end, stiffness=60.0, damping=8.0)
    state = rom.equilibrium(mech)
    rest = rom.simulate(mech, t_end=15.0, dt=0.02, rho_inf=0.5).final
    assert_allclose(state.q, rest.q, atol=1e-7)
    assert_allclose(state.lam, rest.lam, atol=1e-5)
    still = rom.simulate(mech, t_end=0.2, dt=0.02, state=state)
    assert np.abs(still.q - state.q).max() < 1e-9


@pytest.mark.parametrize("speed", [5.0, 9.0])
def test_a_pendulum_on_a_turning_shaft(speed):
    """cos(angle) = g / (L W^2) of a point mass, and omega^2 = W^2 sin^2: Watt's governor."""
    length = 0.7
    mech = rom.Mechanism(gravity=(0, 0, -g))
    shaft = on_axle(mech, "shaft", inertia=(1, 1, 1))
    mech.drive("motor", "axle", lambda t: speed * t, rate=lambda t: speed)
    on_hinge(mech, below(0.4, length), inertia=(1e-7,) * 3, pivot=shaft)
    state = rom.equilibrium(mech, spin=(0, 0, speed))
    cosine = g / (length * speed**2)
    assert_allclose(-state.q[9] / length, cosine, rtol=1e-6)
    found = rom.linearize(mech, state)
    assert_allclose(2 * np.pi * found.frequencies, [speed * np.sqrt(1 - cosine**2)], rtol=1e-6)


def test_what_nothing_holds_is_named():
    mech = rom.Mechanism(gravity=(0, 0, -g))
    on_guide(mech, "cart")
    said = r"'cart' slides along \(1, 0, 0\) and no force opposes"
    refuses(ModelError, said, rom.equilibrium, mech)


@pytest.mark.parametrize(("law", "error", "said", "most"), [
    (lambda x: 1.0, ModelError, "'cart' slides along .*, pushed by forces that nothing", 150),
    (lambda x: -np.sign(x) * np.sqrt(abs(x)), SolverError, "'cart' stays out of balance", 400),
])  # fmt: skip
def test_a_search_that_leads_nowhere_is_given_up(law, error, said, most, monkeypatch):
    """By nothing at all; and where Newton's corrections go to and fro for ever, x to -x."""
    found, tangents = Tangent.of.__func__, []

    def counted(cls, *arguments):
        tangents.append(arguments)
        return found(cls, *arguments)

    monkeypatch.setattr(Tangent, "of", classmethod(counted))
    mech = rom.Mechanism(gravity=(0, 0, 0))
    cart = on_guide(mech, "cart", at=0.1 * X)
    mech.user_force("push", lambda t, a: (law(a.position[0]) * X, 0 * X), cart)
    refuses(error, said, rom.equilibrium, mech)
    assert len(tangents) < most


@pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")
def test_wrong_arguments_are_named():
    mech, other = pendulum(0.3), rom.equilibrium(slider_crank(), t=0.1)
    refuses(ConfigError, "this mechanism has 7, 6 and 5", rom.equilibrium, mech, state=other)


@pytest.mark.long
@pytest.mark.once
@pytest.mark.parametrize("height", [-1e-5, 0.0, 0.5])
def test_a_ball_falls_on_a_floor_and_rests_on_hertzs_contact(height):
    """depth = (m g / k)^(2/3), and small vibrations with 3/2 k sqrt(depth)."""
    mech, k = rom.Mechanism(gravity=(0, 0, -g)), 1e8
    ball = on_guide(mech, "ball", mass=2.0, at=(0, 0, 0.1 + height), axis=Z)
    law = rom.mbs.Impact(stiffness=k, exponent=1.5)
    mech.sphere_on_plane("floor", mech.ground.marker(ORIGIN), ball, law, normal=Z, radius=0.1)
    state, depth = rom.equilibrium(mech), (2.0 * g / k) ** (2 / 3)
    assert_allclose(0.1 - state.q[2], depth, rtol=1e-9)
    found = rom.linearize(mech, state)
    assert_allclose(2 * np.pi * found.frequencies, np.sqrt(1.5 * k * np.sqrt(depth) / 2), rtol=1e-9)


@pytest.mark.once
def test_a_body_sags_in_its_bushing():
    """m g / k down, m g a / k_r about y; the overhang turns with it."""
    mech, k, turn, arm = rom.Mechanism(gravity=(0, 0, -g)), 5e3, 400.0, 0.2
    box = mech.add_rigid("box", mass=2.0, inertia=(0.1,) * 3, at=(arm, 0, 0))
    foot, stiffness = box.marker((-arm, 0, 0)), (k, k, k, turn, turn, turn)
    mech.bushing("rubber", mech.ground.marker(ORIGIN), foot, stiffness=stiffness)
    state = rom.equilibrium(mech)
    angle = brentq(lambda x: turn * x - 2.0 * g * arm * np.cos(x), 0, 1)
    height = -2.0 * g / k - arm * np.sin(angle)
    assert_allclose(state.q[:3], [arm * np.cos(angle), 0, height], atol=1e-10)
