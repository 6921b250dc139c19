"""Teeth and films of bodies that spin in their frames: as of those whose frames turn."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.mbs.parts import on_axle
from cases.refusals import refuses
from rom.components.gear_mesh import Correction, GearPair
from rom.mbs import Groove, JournalBearing
from rom.mbs.analysis.equilibrium import _Search

ORIGIN, Z = (0, 0, 0), (0, 0, 1)
PAIR = GearPair((26, 40), 4e-3, 0.03, helix=0.2, thinning=5e-5)
FLANKS = Correction(relief=(15e-6, 10e-6), extent=(2e-3, 3e-3),
                    pitch=(2e-6 * (np.arange(26) % 5), 1e-6 * (np.arange(40) % 7)))  # fmt: skip
SPEED = 120.0


def geared(way, speed=SPEED, torque=60.0):
    """Two wheels on soft bearings with pitch errors, relief, damping and friction."""
    mech = rom.Mechanism(gravity=ORIGIN)
    speeds = {"pinion": speed, "gear": -speed * 26 / 40}
    for name, x, inertia in (("pinion", 0.0, 4e-3), ("gear", PAIR.distance, 1.5e-2)):
        ends = {"low": (0, 0, -0.06), "high": (0, 0, 0.05)}
        wheel = mech.add_rigid(name, mass=4.0, inertia=(inertia, inertia, inertia), at=(x, 0, 0),
                               markers=ends, **{way: (0, 0, speeds[name])})  # fmt: skip
        for end, place in ends.items():
            both = mech.ground.marker((x, *place[1:])), wheel.marker(end)
            mech.bushing(f"{end} of {name}", *both, stiffness=(2e7, 3e7, 1e8, 0, 0, 0),
                         damping=(9e3, 9e3, 9e3, 0, 0, 0))  # fmt: skip
        mech.torque(f"torque of {name}", name, (0, 0, torque * (1 if x == 0 else 40 / 26)))
    mech.gear_mesh("mesh", *speeds, axis=Z, pair=PAIR, stiffness=1.3e10, correction=FLANKS, cells=9,
                   damping=1e-5, friction=0.06, transition_speed=0.05)  # fmt: skip
    return mech


def test_teeth_of_spinning_wheels_bear_as_those_of_turning_frames():
    found = []
    for way in ("omega", "spin"):
        sol = rom.simulate(geared(way), t_end=0.012, dt=4e-6, save_every=20)
        assert rom.audit(sol).ok, rom.audit(sol)
        loads = [one.force.sum() for one in rom.mbs.tooth_loads(sol, "mesh")]
        found.append((sol.position("pinion"), sol.position("gear"), np.array(loads)))
    assert np.ptp(found[0][2][20:]) > 0.05 * found[0][2][20:].mean()
    for one, other in zip(*found, strict=True):
        assert_allclose(other, one, atol=3e-5 * np.abs(one).max())


def test_speeds_that_teeth_cannot_have_are_named():
    mech = rom.Mechanism()
    for name, x, speed in (("a", 0, 30.0), ("b", PAIR.distance, 19.5)):
        mech.add_rigid(name, mass=1, inertia=(1, 1, 1), at=(x, 0, 0), spin=(0, 0, speed))
    mesh = {"axis": Z, "pair": PAIR, "stiffness": 1e10}
    words = r"teeth 26 and 40 need 30 and -19.5"
    refuses(rom.ConfigError, words, mech.gear_mesh, "mesh", "a", "b", **mesh)
    balls = {"axis": (1, 0, 0), "bearing": rom.mbs.BallBearing(9, 0.01, 0.05)}
    refuses(rom.ConfigError, "both must be one", mech.rolling_bearing, "x", "a", "ground", **balls)


def carried(way, speed):
    """A rotor in two films under its weight."""
    grooves = [Groove(0.0, 0.3), Groove(np.pi, 0.3)]
    bearing = JournalBearing(0.05, 0.03, 5e-5, grooves, cells=(40, 4))
    mech, ends = rom.Mechanism(gravity=(0, -9.81, 0)), {"a": (0, 0, -0.1), "b": (0, 0, 0.1)}
    mech.add_rigid("rotor", mass=30.0, inertia=(0.4, 0.4, 0.1), at=ORIGIN,
                   markers=ends, **{way: (0, 0, speed)})  # fmt: skip
    film = {"axis": Z, "bearing": bearing, "oil": 0.02}
    for name, at in ends.items():
        mech.journal_bearing(name, f"rotor.{name}", mech.ground.marker(at), **film)
    mech.bushing("thrust", "ground", "rotor", stiffness=(0, 0, 1e6, 0, 0, 0))
    return mech


@pytest.mark.parametrize("speed", [200.0, -200.0])
def test_films_of_a_spinning_rotor_carry_as_those_of_a_turning_frame(speed):
    """Both fall into their films from the middle of the bush; friction slows the turning one."""
    found = []
    for way in ("omega", "spin"):
        mech = carried(way, speed)
        hub = "ground"
        if way == "omega":  # kept at its speed, as what spins is
            light = {"mass": 1e-3, "inertia": (1e-6,) * 3}
            hub = on_axle(mech, "hub", **light, axle="motor", omega=(0, 0, speed))
            mech.drive("speed", "motor", lambda t: speed * t, rate=lambda t: speed)
        mech.bushing("coupling", hub, "rotor", stiffness=(0, 0, 0, 0, 0, 1e4))
        sol = rom.simulate(mech, t_end=0.02, dt=2e-5, save_every=10)
        assert rom.audit(sol).ok, rom.audit(sol)
        found.append(sol.position("rotor"))
    assert np.abs(found[0]).max() > 1e-6
    assert_allclose(found[1], found[0], atol=1e-6 * np.abs(found[0]).max())


@pytest.mark.parametrize(("build", "most"), [
    (lambda: carried("spin", 200.0), 50),  # 1851 before, or as many as 4214 by round-off
    (lambda: carried("spin", -90.0), 50),
    (lambda: dragged(0.5), 100),  # 602 before
])  # fmt: skip
def test_a_rotor_that_nothing_holds_against_its_drag_is_named_soon(build, most, monkeypatch):
    """Once around it has met all forces there are."""
    tangents, count = _Search.tangent, []
    monkeypatch.setattr(_Search, "tangent", lambda *x: count.append(1) or tangents(*x))
    refuses(rom.RomError, r"'rotor' turns about its own axis \(0, 0, 1\)", rom.equilibrium, build())
    assert len(count) < most


def dragged(moment, around=0.0):
    """A rotor on a bushing that may hold it against turning, under a moment."""
    mech = rom.Mechanism(gravity=ORIGIN)
    rotor = on_axle(mech, "rotor", mass=2.0, inertia=(0.01, 0.01, 0.02))
    mech.torque("drag", rotor, (0, 0, -moment))
    if around:
        mech.rotational_spring("spring", "axle", stiffness=around)
    return mech


def test_a_spring_may_be_wound_up_many_times():
    """Its potential curves upwards: 20 rad are no turning without end."""
    state = rom.equilibrium(dragged(40.0, around=2.0))
    assert_allclose(2 * np.arctan2(state.q[6], state.q[3]) % (2 * np.pi), -20.0 % (2 * np.pi))
