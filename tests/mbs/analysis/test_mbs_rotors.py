"""Rotors of blades on supports, with constant coefficients: closed forms and motion in time."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from numpy.testing import assert_allclose

import rom
from cases.mbs.parts import ORIGIN, Y, Z
from cases.refusals import refused
from rom import rotation
from rom.mbs.analysis.local_equations import instant
from rom.mbs.analysis.rotors.spins import Spins

HUB_RADIUS, ARM = 0.4, 1.5  # of the hinges; from the hinge to the centre of a blade [m]
BLADE_MASS, BLADE_INERTIA, THIN, HUB_MASS = 3.0, 2.0, 0.1, 40.0
NACELLE_MASS, SUPPORT, LAG_SPRING = 60.0, 2.0e4, 40.0
S, I = BLADE_MASS * ARM, BLADE_INERTIA + BLADE_MASS * ARM**2  # about the hinge


def turning(n, speed, *, hinge, damping=0.0, azimuth=0.3):
    """Blades hinged to a hub that turns on a nacelle on springs, and their steady motion."""
    mech = rom.Mechanism(gravity=ORIGIN)
    mech.add_rigid("nacelle", mass=NACELLE_MASS, inertia=(5.0,) * 3, at=ORIGIN)
    mech.planar("table", "ground", "nacelle", normal=Z)
    mech.bushing("support", "ground", "nacelle", stiffness=(SUPPORT, SUPPORT, 0, 0, 0, 1e6))
    hub = mech.add_rigid("hub", mass=HUB_MASS, inertia=(1.0, 1.0, 2.0), at=ORIGIN)
    mech.revolute("bearing", "nacelle", "hub", axis=Z)
    mech.drive("speed", "bearing", lambda t: speed * t, rate=lambda t: speed)
    for k in range(n):
        axis = Z if hinge == "lag" else Y
        add_blade(mech, hub, k, 2 * np.pi * k / n + azimuth, axis, (-ARM, 0, 0))
        if hinge == "lag":
            spring = {"stiffness": LAG_SPRING, "damping": damping}
            mech.rotational_spring(f"spring {k}", f"hinge {k}", **spring)
    return mech, rom.equilibrium(mech, spin={"bearing": speed})


def add_blade(mech, hub, k, azimuth, axis, root, centre=ORIGIN):
    """One on a hinge at its root (3,), as everything here in its own axes, to a hub at a place."""
    A = rotation.matrix(rotation.exp([0, 0, azimuth]))
    out, inertia = A @ [HUB_RADIUS, 0, 0], (THIN, BLADE_INERTIA, BLADE_INERTIA)
    one = mech.add_rigid(f"blade {k}", mass=BLADE_MASS, inertia=inertia, orientation=A,
                         at=np.add(centre, out) - A @ root)  # fmt: skip
    mech.revolute(f"hinge {k}", hub.marker(out), one.marker(root), axis=A @ axis)


def blades(n):
    return [f"blade {k}" for k in range(n)]


def coleman_feingold(n, speed, damping=0.0):
    """Rates s = i w of hub and lagging blades.

    (K - M w^2)(k + i c (w - W) - I (w - W)^2) = n S^2 w^4 / 2, from Lagrange's equations of the
    hub, x + i y, and of the complex sum of all lag angles.
    """
    w = Polynomial([0, 1])
    mass = NACELLE_MASS + HUB_MASS + n * BLADE_MASS
    lag = LAG_SPRING + HUB_RADIUS * S * speed**2 + (1j * damping - I * (w - speed)) * (w - speed)
    roots = ((SUPPORT - mass * w**2) * lag - 0.5 * n * S**2 * w**4).roots()
    rates = 1j * np.asarray(roots, dtype=complex)
    return np.where(rates.imag < 0, rates.conj(), rates)


@pytest.mark.parametrize("n", [3, 4, 5])
@pytest.mark.parametrize(("speed", "damping"), [(5.0, 0.0), (17.0, 0.0), (26.0, 0.0), (26.0, 4.0),
                                                (35.0, 9.0)])  # fmt: skip
def test_ground_resonance_has_the_rates_of_coleman_and_feingold(n, speed, damping):
    """The support sways at 13 rad/s, a blade lags at about half the speed: unstable around 26."""
    mech, state = turning(n, speed, hinge="lag", damping=damping)
    small = rom.linearize(mech, state, frame="world", blades=blades(n))
    expected = coleman_feingold(n, speed, damping)
    for rate in expected:
        assert np.abs(small.eigenvalues - rate).min() < 1e-6 * speed
    assert small.stable == (expected.real.max() < 1e-9)


def test_ground_resonance_grows_as_fast_in_time():
    speed = 26.0
    mech, state = turning(3, speed, hinge="lag")
    growth = rom.linearize(mech, state, frame="world", blades=blades(3)).eigenvalues.real.max()
    push = state.v.copy()
    push[0] += 1e-6
    sol = rom.simulate(mech, state=replace(state, v=push), t_end=10.0, dt=1e-3)
    sway = np.linalg.norm(sol.position("nacelle")[:, :2], axis=1)
    late = [sway[(sol.t >= a) & (sol.t < a + 2.0)].max() for a in (4.0, 8.0)]
    assert_allclose(np.log(late[1] / late[0]) / 4.0, growth, rtol=2e-3)


@pytest.mark.parametrize("n", [3, 4])
def test_flapping_blades_whirl_at_their_own_frequency_more_and_less_than_the_speed(n):
    """Hinged blades: alike nu W, backward (nu - 1) W, forward (nu + 1) W, +- in turn nu W."""
    speeds = np.array([6.0, 6.5, 7.0])
    given = {"frame": "world", "blades": blades(n)}
    found = rom.mbs.campbell(lambda w: turning(n, w, hinge="flap"), speeds, **given)
    nu = np.sqrt((BLADE_INERTIA - THIN + BLADE_MASS * ARM**2 + HUB_RADIUS * S) / I)
    sway = np.sqrt(SUPPORT / (NACELLE_MASS + HUB_MASS + n * BLADE_MASS))
    rates = {"alike": nu, "backward": nu - 1, "forward": nu + 1}
    turn = 1j * speeds[:, None]
    near = {k: np.isclose(found.eigenvalues, r * turn, rtol=1e-7) for k, r in rates.items()}
    for k, name in enumerate(rates):
        assert near[name].all(axis=0).sum() == (2 if n == 4 and name == "alike" else 1)
        if n == 3 or name != "alike":  # of four, two motions share the frequency
            assert_allclose(found.waves[:, near[name].all(axis=0), k], 1.0, atol=1e-9)
    assert np.isclose(found.eigenvalues, 1j * sway, rtol=1e-7).sum(axis=1).tolist() == [2] * 3


def leaning(speed, springs=300.0):
    """Flapping blades on a nacelle that a force and a moment push out of its place."""
    mech = rom.Mechanism(gravity=ORIGIN)
    nacelle = mech.add_rigid("nacelle", mass=50.0, inertia=(5.0,) * 3, at=(0.2, 0.1, 0))
    stiff = (3e4, 4e4, 5e4, 2e4, 3e4, 4e4)
    mech.bushing("support", "ground", nacelle.marker((-0.2, -0.1, 0)), stiffness=stiff)
    mech.force("push", nacelle.marker(ORIGIN), (1800.0, -1000.0, 2000.0))
    hub = mech.add_rigid("hub", mass=20.0, inertia=(1.0, 1.0, 2.0), at=(0.2, 0.1, 0.5))
    mech.revolute("bearing", nacelle.marker((0, 0, 0.5)), hub.marker(ORIGIN), axis=Z)
    mech.drive("speed", "bearing", lambda t: speed * t, rate=lambda t: speed)
    for k in range(3):
        add_blade(mech, hub, k, 2 * np.pi * k / 3, Y, (-1.5, 0, -0.4), (0.2, 0.1, 0.5))
        mech.rotational_spring(f"spring {k}", f"hinge {k}", stiffness=springs)
    return mech


@pytest.mark.parametrize("speed", [2.0, 9.0, 60.0])
def test_a_rotor_turns_steadily_about_an_axis_that_its_support_leans(speed):
    """Blades take their place against springs; the nacelle stays where it is, below and above its
    own frequencies of 14 to 30 rad/s."""
    mech = leaning(speed)
    state = rom.equilibrium(mech, spin={"bearing": speed})
    tilt = 2 * np.arccos(abs(state.q[3]))
    assert tilt > 0.015
    sol = rom.simulate(mech, state=state, t_end=2 * np.pi / speed, dt=2e-3 / speed)
    stays = np.abs(sol.position("nacelle") - sol.position("nacelle")[0]).max()
    angles = np.array([sol.joint(f"hinge {k}").angle for k in range(3)])
    assert stays < 2e-7
    assert np.ptp(angles) < 1e-6
    assert abs(angles[0, 0]) > 1e-3  # centrifugal forces have turned the blades down


def test_what_turns_as_a_whole_may_be_told_either_way():
    mech = leaning(7.0)
    for name in ("support", "push"):
        del mech.elements[name]
    mech.fixed("support", mech.ground.marker((0.2, 0.1, 0)), "nacelle")
    whole = rom.equilibrium(mech, spin=(0, 0, 7.0), about=(0.2, 0.1, 0))
    behind = rom.equilibrium(mech, spin={"bearing": 7.0})
    assert_allclose(behind.q, whole.q, atol=1e-12)


def adrift():
    """A disc that springs alone hold, to a rotor and to its support."""
    mech = leaning(1.0)
    mech.add_rigid("disc", mass=1.0, inertia=(0.1,) * 3, at=(0, 0, 2))
    for name in ("nacelle", "hub"):
        mech.bushing(f"to {name}", name, "disc", stiffness=(1e3,) * 6)
    return mech


def counted(named):
    return lambda: rom.linearize(*turning(4, 5.0, hinge="lag"), blades=named)


def spun(mech, spin):
    return lambda: rom.equilibrium(mech(), spin=spin)


test_spins_and_blades_that_are_none_are_refused = refused(
    (spun(lambda: leaning(1.0), {"bearings": 1.0}), "no joint 'bearings'"),
    (spun(lambda: leaning(1.0), {"bearing": 1.0, "hinge 0": 1.0}), "held elsewhere, too: .'hub'"),
    (spun(adrift, {"bearing": 1.0}), "only forces hold body 'disc'"),
    (counted(blades(2)), "3 or more"),
    (counted("blade"), "3 or more"),
    (counted(["blade 0", "blade 1", "blade 9"]), "no body 'blade 9'"),
    (counted(["blade 0", "blade 1", "blade 1"]), "'blade 1' is given twice"),
    (counted(["blade 0", "blade 1", "hub"]), "alike"),
    (counted([["blade 0", "hub"], ["blade 1"], ["blade 2"]]), "alike"),
    (counted([f"blade {k}" for k in (0, 2, 1, 3)]), "does not stand"),  # across, not around
    error=rom.ConfigError,
)


def test_the_order_of_blades_may_be_either_sense():
    found = [
        rom.mbs.campbell(lambda w: turning(3, w, hinge="flap"), [6.0, 6.5], frame="world",
                         blades=[f"blade {k}" for k in order])
        for order in ((0, 1, 2), (1, 0, 2))
    ]  # fmt: skip
    assert_allclose(found[0].eigenvalues, found[1].eigenvalues, rtol=1e-9)
    assert_allclose(found[0].waves, found[1].waves, atol=1e-6)


def test_steady_velocities_change_as_small_motions_say():
    """What moves the nacelle moves the axis, and with it all that turns: central differences."""
    mech, speed, rng = leaning(9.0), 9.0, np.random.default_rng(3)
    now = instant(mech, 0.0)
    spins = Spins.of(mech, now, {"bearing": speed}, ORIGIN)
    state = spins.steady(now, rom.equilibrium(mech, spin={"bearing": speed}))
    T, T1, T3 = spins.motions(now, state)
    for _ in range(4):
        p = 1e-6 * rng.normal(size=state.v.size)
        moved = (replace(state, q=now.shifted(state.q, sign * (T @ p))) for sign in (-1, 1))
        sides = [spins.steady(now, there) for there in moved]
        for change, of in ((T1 @ p, "v"), (T3 @ p, "a")):
            seen = (getattr(sides[1], of) - getattr(sides[0], of)) / 2
            assert_allclose(change, seen, atol=1e-8 * np.abs(seen).max())


def test_coefficients_that_stay_periodic_are_told():
    """On a support that is stiffer in one direction; blades counted together have constant ones."""
    mech = leaning(9.0)
    state = rom.equilibrium(mech, spin={"bearing": 9.0})
    with pytest.warns(rom.RomWarning, match="change with time"):
        rom.linearize(mech, state)
    rom.linearize(mech, state, frame="world", blades=blades(3))
