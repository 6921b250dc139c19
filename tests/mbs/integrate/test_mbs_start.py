"""A start that joints or drives move: told, refused where it is wrong, without a strain."""

import warnings
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.mbs.mechanisms import lattice, lattice_body, slider_crank
from cases.mbs.parts import on_guide
from cases.refusals import refuses

Z = (0, 0, 1)


def rod_on_a_pin(gap=0.0, angle=0.0, omega=0.0, rate=None):
    """A rod of 1 m, whose hinge is drawn open, and a drive that begins elsewhere."""
    mech = rom.Mechanism(gravity=(0, -9.81, 0))
    inertia, ends = (1e-3, 1 / 12, 1 / 12), {"a": (-0.5, 0, 0), "b": (0.5, 0, 0)}
    moving = {"at": (0.5 + gap, 0, 0), "velocity": (0, 0.5 * omega, 0), "omega": (0, 0, omega)}
    mech.add_rigid("rod", mass=1.0, inertia=inertia, markers=ends, **moving)
    mech.revolute("pin", "ground", "rod.a", axis=Z)
    if angle or rate is not None:
        mech.drive("turn", "pin", lambda t: angle + (rate or 0.0) * t)
    return mech


def moved(mech, **options):
    return rom.simulate(mech, t_end=1e-3, dt=1e-4, **options)


def response(mech, **options):
    return rom.frequency_response(mech, None, [1.0], force="rod.b", motion="rod.b", **options)


@pytest.mark.parametrize("asked", [moved, rom.linearize, rom.steady_motion, response])
def test_a_start_far_from_joints_or_drives_is_refused_unless_asked_for(asked):
    for fault, name in (({"gap": 0.0051}, "pin"), ({"angle": 0.3}, "turn")):
        with pytest.raises(rom.ModelError, match=rf"^{name}: the start contra.*open by .*=True"):
            asked(rod_on_a_pin(**fault))
        with warnings.catch_warnings(action="error", category=rom.RomWarning):
            asked(rod_on_a_pin(**fault | {"rate": 0.0}), assemble=True)


@pytest.mark.parametrize(("gap", "told"), [(1e-9, False), (1e-4, True), (0.0049, True)])
def test_a_small_gap_is_told_and_recorded(gap, told):
    with warnings.catch_warnings(record=True, action="always") as caught:
        sol = moved(rod_on_a_pin(gap))
    assert [("'pin' was open by" in str(w.message)) for w in caught] == [True] * told
    assert_allclose(sol.statistics["closed"], gap / 0.5, rtol=1e-6)


def test_statics_begin_where_drives_say_and_not_where_joints_are_open():
    state = rom.equilibrium(rod_on_a_pin(angle=0.3))
    assert_allclose(state.q[:2], 0.5 * np.array([np.cos(0.3), np.sin(0.3)]), atol=1e-12)
    sol = rom.inverse_dynamics(rod_on_a_pin(angle=0.3), [0.0, 1e-3])
    assert_allclose(sol.drive_load("turn")[0], 9.81 * 0.5 * np.cos(0.3), rtol=1e-6)
    for asked in (rom.equilibrium, partial(rom.inverse_dynamics, t=[0.0, 1.0]),
                  partial(rom.periodic_motion, period=0.1)):  # fmt: skip
        with pytest.raises(rom.ModelError, match=r"^pin: the start contradicts joints and drives"):
            asked(rod_on_a_pin(gap=0.05, angle=0.3, rate=0.0))


def test_a_state_that_new_joints_do_not_fit_is_refused_unless_asked_for():
    state = rom.equilibrium(rod_on_a_pin(angle=0.3))
    with pytest.raises(rom.ModelError, match=r"^turn: the start contradicts"):
        rom.release(rod_on_a_pin(angle=0.4), state)
    height = rom.release(rod_on_a_pin(angle=0.4), state, assemble=True).q[1]
    assert_allclose(height, 0.5 * np.sin(0.4), atol=1e-12)


@pytest.mark.parametrize(("omega", "rate", "told"), [
    (4.0, 4.0, ""), (4.0, 4.02, "0.005"), (0.0, 3.0, ""), (4.0, 3.0, "0.25"), (4.0, -4.0, "2")
])  # fmt: skip
def test_a_given_velocity_that_a_drive_contradicts_is_told_or_refused(omega, rate, told):
    """A rod that was given none has the one of its drive."""
    mech, said = rod_on_a_pin(omega=omega, rate=rate), f"the velocity of 'rod' changes by {told} of"
    if told and float(told) > 1e-2:
        refuses(rom.ModelError, f"^rod: the start contradicts .*{said}", moved, mech)
    with warnings.catch_warnings(record=True, action="always") as caught:
        sol = moved(mech, assemble=bool(told) and float(told) > 1e-2)
    assert [said in str(w.message) for w in caught] == [True] * (told == "0.005")
    assert_allclose(sol.omega("rod")[0, 2], rate, rtol=1e-6)


def test_what_moves_a_light_body_counts_as_much_as_what_moves_a_heavy_one():
    """Speeds are compared, not momenta; a body next to rest is compared with the fastest."""
    for mass, slow, refused in ((1e3, 0.0, True), (1e-6, 0.0, True), (1.0, 3.999, False)):
        mech = rod_on_a_pin(omega=4.0)
        given = {"mass": mass, "at": (0, 0, 1), "base": (0, 0, 1), "guide": "rail"}
        on_guide(mech, "light", **given, velocity=(slow or 2.0, 0, 0))
        mech.drive("push", "rail", lambda t: 4.0 * t)
        if refused:
            refuses(rom.ModelError, r"^light: .*'light' changes by [\d.]+ of", moved, mech)
        else:
            with pytest.warns(rom.RomWarning, match="the velocity of 'light' changes by 0.000"):
                moved(mech)


def flexible(gaps, fixed=("n0",)):
    body = lattice_body(lattice(stiffness=4e4))
    mech = rom.Mechanism(gravity=(0, -9.81, 0))
    rod = mech.add_flexible("rod", body)
    for name, gap in zip(fixed, gaps, strict=True):
        place = mech.design_point(rod.marker(name)) + np.array([gap, 0, 0])
        mech.spherical(name, mech.ground.marker(place), rod.marker(name))
    return mech


def test_closing_a_gap_does_not_strain_a_body_that_can_follow():
    drawn, opened = (moved(flexible([gap]), assemble=True) for gap in (0.0, 0.1))
    assert np.abs(opened.elastic("rod")[0]).max() < 1e-15
    assert_allclose(opened.reaction("n0")[0, :3], drawn.reaction("n0")[0, :3], atol=1e-9)


def test_a_strain_that_closing_needs_is_told():
    held, gaps = ("n0", "n1", "n12"), (0.0, 0.0, 1e-3)
    with pytest.warns(rom.RomWarning, match="it bends 'rod' by"):
        sol = moved(flexible(gaps, held))
    assert_allclose(sol.position("rod", "n12")[0, 0], 1.0 + 1e-3, atol=1e-12)


def geared_disc(speed, rate=None, body=None):
    """A disc that turns in a ring on springs, by a drive if it has a rate."""
    mech, axis = rom.Mechanism(gravity=(0, 0, 0)), Z if body is None else (1, 0, 0)
    made = {"at": (0, 0, 0), "omega": speed * np.array(axis)}
    if body is None:
        pin = mech.add_rigid("disc", mass=9, inertia=(0.2, 0.2, 0.3), **made).marker((0, 0, 0))
    else:
        pin = mech.add_flexible("disc", body, **made).marker("n0")
    place = mech.design_point(pin)
    ring = mech.add_rigid("ring", mass=1, inertia=(0.1,) * 3, at=place)
    spring = {"stiffness": (1e6, 2e6, 1e6, 1e4, 2e4, 1e4)}
    mech.bushing("springs", mech.ground.marker(place), ring.marker((0, 0, 0)), **spring)
    mech.revolute("axle", ring.marker((0, 0, 0)), pin, axis=axis)
    if rate is not None:
        mech.drive("motor", "axle", lambda t: rate * t)
    return mech


def test_speeds_of_spins_and_diagrams_are_those_that_drives_prescribe():
    with pytest.raises(rom.ModelError, match=r"^motor: the velocities of joints and drives contra"):
        rom.equilibrium(geared_disc(0.0, 100.0), spin={"axle": 50.0})
    assert rom.equilibrium(geared_disc(0.0, 50.0), spin={"axle": 50.0}).v[5] == 50.0
    with pytest.warns(rom.RomWarning, match="no body turns at the speed 50 rad/s"):
        rom.campbell(lambda speed: geared_disc(100.0), [50.0, 100.0], frame="world")


@pytest.mark.parametrize("asked", [rom.linearize, rom.steady_motion])
def test_a_reduced_body_that_spins_is_not_counted_in_axes_of_the_world(asked):
    """Its shapes turn: 443.6 and 557.5 Hz were said of a shaft of 511.4 and 512.0 Hz."""
    mech = geared_disc(50.0, body=lattice_body(lattice(stiffness=4e4)))
    with pytest.raises(rom.ModelError, match=r"^disc: it spins at .* rad.s and its shapes turn"):
        asked(mech, frame="world", assemble=True)


def test_bodies_that_were_given_no_velocity_are_led_by_those_that_were():
    """The crank keeps its 10 rad/s; rod and slider, as heavy, move as the linkage makes them."""
    mech = slider_crank(l1=0.1, l2=0.3, speed=0.0)
    mech.drives.clear()
    crank = mech.parts["crank"]
    mech.parts["crank"] = replace(crank, omega=np.array([0.0, 0.0, 10.0]))
    with warnings.catch_warnings():
        warnings.filterwarnings("error", message=".*start")
        sol = moved(mech)
    assert_allclose(sol.omega("crank")[0], [0, 0, 10.0], atol=1e-7)
    assert_allclose(sol.omega("rod")[0, 2], -10.0 / 3, rtol=1e-7)
    assert_allclose(sol.velocity("slider")[0], 0.0, atol=1e-7)
