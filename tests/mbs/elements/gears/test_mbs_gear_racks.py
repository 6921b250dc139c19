"""A pinion on a rack."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.components.geared import ORIGIN, Z, free_wheels
from cases.gear_unit import PlaneMesh
from cases.long import few
from cases.mbs.mechanisms import prepared, residual_at
from cases.mbs.parts import on_guide
from cases.mbs.tangents import assert_forces_are_the_gradient, by_position, by_velocity, shifted
from cases.refusals import refuses
from rom.components.gear_mesh import Correction, GearPair, Hertz, Mesh, RackPair, stiffness_table
from rom.components.gear_mesh.gears.meshes import GEAR_MESHES_FAMILY

Y, K = (0, 1, 0), 1.3e10
LOSSES = {"damping": 1e-6, "friction": 0.1, "transition_speed": 0.1}
SPUR = RackPair(26, 4e-3, 0.03, thinning=5e-5)
HELICAL = RackPair(26, 4e-3, 0.04, helix=0.35, shift=0.1, thinning=5e-5)
FLANKS = Correction((15e-6, 10e-6), (4e-3, 3e-3), 1.5, 4e-6, 5e-6, run_out=((2e-6, 0.3), (0, 0)),
                    maps=(1e-6 * np.eye(3), 1e-6 * np.eye(4)))  # fmt: skip


def free(pair, **more):
    given = {"stiffness": K * np.array([0.6, 1.1, 0.7]), "entry": 0.1, "cells": 7}
    return free_wheels(pair, **given | more)


def pressed(packed, W, delta):
    """The mesh after motions (12,) of pinion and rack."""
    none = np.zeros(12)
    residual_at(packed.system, W, shifted(packed, packed.q, delta), none, none, np.zeros(0))
    return packed.elements[GEAR_MESHES_FAMILY]


def placed(packed, pair, back, seed):
    """Rolled, shifted, tilted and turned, working or back flanks loaded."""
    rng, delta = np.random.default_rng(seed), np.zeros(12)
    delta[[0, 1, 2, 6, 8]] = 2e-5 * rng.normal(size=5)
    delta[[3, 4, 9, 10, 11]] = 3e-4 * rng.normal(size=5)
    turn = 0.3 * rng.random()
    delta[5], delta[7] = turn, pair.r[0] * turn
    delta[5] += -1e-3 - pair.backlash / pair.rb[0] if back else 1e-3
    delta[5] += delta[11]
    return shifted(packed, packed.q, delta)


@pytest.mark.parametrize("pair", [SPUR, HELICAL], ids=["spur", "helical"])
@pytest.mark.parametrize("back", [False, True], ids=["working", "back"])
@pytest.mark.parametrize("more", [{}, {"correction": FLANKS, "hertz": Hertz((4e-3, 3e-3))}],
                         ids=["plain", "all"])  # fmt: skip
def test_forces_on_a_rack_are_the_gradient_of_the_energy(pair, back, more):
    packed, W = prepared(free(pair, **more))
    mesh = packed.elements[GEAR_MESHES_FAMILY]
    for seed in range(3):
        assert_forces_are_the_gradient(packed, W, mesh, placed(packed, pair, back, seed))


@pytest.mark.parametrize("pair", [SPUR, HELICAL], ids=["spur", "helical"])
def test_tangents_of_a_rack_are_differences(pair):
    packed, W = prepared(free(pair, **LOSSES))
    q = placed(packed, pair, False, 1)
    v = 1e-3 * np.random.default_rng(5).normal(size=12)
    found, stiff = by_position(packed, W, q, v)
    assert_allclose(found, stiff, atol=2e-3 * np.abs(stiff).max())
    found, loss = by_velocity(packed, W, q, v)
    assert_allclose(found, loss, atol=1e-6 * np.abs(loss).max())


@pytest.mark.parametrize("pair", [SPUR, HELICAL], ids=["spur", "helical"])
def test_a_rack_farther_away_has_the_backlash_of_a_gear_without_end(pair):
    gear = GearPair((26, 100_000), 4e-3, 0.03, pair.helix, shift=(pair.shift, 0.0), thinning=5e-5)
    away = replace(pair, centre_distance=pair.distance + 1e-3)
    apart = replace(gear, centre_distance=gear.distance + 1e-3)
    assert away.backlash == pytest.approx(apart.backlash, rel=1e-3)


@pytest.mark.parametrize("back", [False, True], ids=["working", "back"])
def test_lines_of_a_shifted_pinion_are_where_a_gear_without_end_has_them(back):
    """Path and places of lines on the flanks, by the load that a stiffness along the path gives."""
    pair = replace(SPUR, shift=0.3)
    gear = GearPair((26, 100_000), 4e-3, 0.03, shift=(0.3, 0.0), thinning=5e-5)
    assert_allclose(pair.path, gear.path, rtol=3e-4)
    turn = (-pair.backlash - 1e-5 if back else 1e-5) / pair.rb[0] * np.eye(12)[5]
    for phase in (0.0, 0.07, 0.14, 0.21):
        loads = [pressed(*prepared(free(x, phase=phase)), turn).load[0] for x in (pair, gear)]
        assert loads[0] == pytest.approx(loads[1], rel=1e-3)
        assert loads[0] > 1e3


def test_a_rack_that_leans_is_felt_however_far_it_has_travelled():
    """Turned by 1e-4 about the line of centres, 2 m from its middle; not by its other end."""
    packed, W = prepared(free(replace(HELICAL, thinning=2e-4)))
    mesh, loads, y = packed.elements[GEAR_MESHES_FAMILY], [], 2.0
    gap = 0.5e-4 * y * np.tan(HELICAL.base_helix)  # half of what it closes, in the plane
    mesh.start[0, 0] = (gap - y * np.cos(HELICAL.alpha)) / HELICAL.rb[0]  # turns before
    for lean in (1e-4, -1e-4):
        loads.append(pressed(packed, W, y * np.eye(12)[7] + lean * np.eye(12)[9]).load[0])
    depth = gap * np.cos(HELICAL.base_helix)
    assert min(loads) == 0.0
    assert 0.8 < max(loads) / (K * HELICAL.width * depth) < 2.2  # lines together, over the width


def test_a_rack_is_a_gear_without_end():
    """Path, backlash and forces as of a gear of 1e5 teeth; loads along it fall as 1 / z."""
    z = 100_000
    gear = GearPair((26, z), 4e-3, 0.03, thinning=5e-5)
    assert_allclose(SPUR.path, gear.path, rtol=3e-4)
    assert SPUR.contact_ratio == pytest.approx(gear.contact_ratio, rel=1e-4)
    packed, W = prepared(free(SPUR, phase=0.3))
    table = K * np.array([0.6, 1.1, 0.7])
    wanted = PlaneMesh(gear, table, cells=7)
    q = 1e-4 * np.eye(12)[5]
    mesh = pressed(packed, W, q)
    assert W.wrench[mesh.j[0], 1] == pytest.approx(wanted.forces(q, 0.3).force[7], rel=1e-3)
    assert W.wrench[mesh.j[0], 0] == pytest.approx(wanted.forces(q, 0.3).force[6], rel=1e-3)


def guided(pair, spin=0.0, **more):
    """A pinion on an axle, or held where it spins in its frame, and a rack in a guide along y."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_rigid("pinion", mass=1.0, inertia=(2e-3,) * 3, at=ORIGIN, spin=(0, 0, spin))
    if spin:
        mech.fixed("seat", "ground", "pinion")
    else:
        mech.revolute("axle", "ground", "pinion", axis=Z)
    at = pair.distance, 0, 0
    on_guide(mech, "rack", mass=2.0, at=at, base=at, axis=Y, velocity=(0, spin * pair.r[0], 0))
    mech.gear_mesh("mesh", "pinion", "rack", axis=Z, pair=pair, stiffness=K, **more)
    return mech


def test_a_pinion_drives_its_rack_with_its_rolling_circle():
    """v = omega d / 2, over three turns, against a brake."""
    pair = replace(HELICAL, centre_distance=HELICAL.distance + 1e-4)
    mech = guided(pair, damping=2e-5)
    mech.drive("speed", "axle", lambda t: 60.0 * t, rate=lambda t: 60.0 + 0 * t)
    r = 26 * 4e-3 / np.cos(0.35) / 2  # whatever the distance
    mech.motor("brake", "guide", lambda t, x, v: -2000.0 - 1000.0 * (v - 60.0 * r))
    sol = rom.simulate(mech, t_end=6 * np.pi / 60, dt=5e-5, progress=False, save_every=5)
    turned, travel = sol.joint("axle").angle, sol.joint("guide").displacement
    assert turned[-1] == pytest.approx(6 * np.pi)
    assert travel[-1] == pytest.approx(6 * np.pi * r, abs=2e-5)
    late = slice(len(sol.t) // 2, None)
    assert sol.velocity("rack")[late, 1].mean() == pytest.approx(60.0 * r, rel=1e-4)
    assert abs(sol.drive_load("speed")[late].mean()) == pytest.approx(2000.0 * r, rel=1e-2)


@pytest.mark.parametrize("helix", [0.0, 0.35, -0.35])
@pytest.mark.parametrize("torque", [40.0, -40.0])
def test_a_torque_rests_on_the_rack_along_the_normal_of_its_teeth(helix, torque):
    """Along the rack T / r, across it |T| / r tan(alpha_t), along the axis -T / r tan(beta)."""
    pair = replace(SPUR, helix=helix, thinning=0.0, centre_distance=None)
    mech = guided(pair, phase=0.2, entry=0.0, conservative=False)
    mech.torque("motor", "pinion", (0, 0, torque))
    mech.spring_damper("brake", mech.ground.marker((pair.distance, -1, 0)), "rack", stiffness=1e7)
    still = rom.mbs.snapshot(mech, rom.equilibrium(mech))
    along = torque / (26 * 4e-3 / np.cos(helix) / 2)
    across, slope = np.tan(np.radians(20)) / np.cos(helix), np.tan(helix)
    wanted = np.array([abs(along) * across, along, -along * slope])
    load = still.element("mesh").force
    assert_allclose(load[0, 1], wanted, atol=1e-6 * abs(along))
    assert_allclose(load[0, 0], -wanted, atol=1e-6 * abs(along))
    held = still.reaction("guide")[0, :3]
    assert_allclose(held, [-wanted[0], 0.0, -wanted[2]], atol=1e-6 * abs(along))


@pytest.mark.parametrize("losses", few(1, [LOSSES, {}]))
@pytest.mark.parametrize("pair", [SPUR, HELICAL], ids=["spur", "helical"])
def test_a_pinion_and_a_rack_that_hit_and_part_keep_energy_and_momentum(pair, losses):
    given = {"inertia": (2e-3, 2e-3, 3e-3), "omega": (40.0, 0.0), "entry": 0.02, "phase": 0.1}
    mech = free(pair, correction=FLANKS, **given, **losses)
    mech.parts["gear"].velocity[1] = 1.9
    exact = {"method": "dop853", "rtol": 1e-12, "atol": 1e-14}  # for loads that set in and part
    sol = rom.simulate(mech, t_end=6e-4, dt=2e-6, progress=False, **exact)
    force = np.linalg.norm(sol.element("mesh").force[:, 0], axis=1)
    assert force.max() > 300
    assert (force == 0).any()
    assert np.abs(sol.energy.balance).max() < 1e-6 * sol.energy.strain.max()
    for of_all in sol.momentum:
        assert np.ptp(of_all, axis=0).max() < 1e-12
    assert rom.audit(sol).ok, rom.audit(sol)


def test_a_pinion_that_spins_in_its_frame_drives_its_rack():
    """Its frame stands still; the rack follows its material, and what spins it does the work."""
    r, speed = SPUR.r[0], 30.0
    mech = guided(SPUR, speed, entry=0.2)
    mech.motor("brake", "guide", lambda t, x, v: -500.0 - 1000.0 * (v - speed * r))
    sol = rom.simulate(mech, t_end=0.1, dt=2e-5, progress=False, save_every=5)
    assert sol.joint("guide").displacement[-1] == pytest.approx(speed * r * 0.1, abs=2e-5)
    assert np.abs(sol.energy.balance).max() < 1e-4 * 500.0 * speed * r * 0.1


def test_what_a_rack_does_not_have_is_refused():
    off = Correction(run_out=((0, 0), (1e-6, 0)))
    refuses(rom.ConfigError, "rack of 'mesh' does not turn", free, SPUR, correction=off)
    refuses(rom.ModelError, "racks are for elements", Mesh, SPUR, K)
    refuses(rom.ModelError, "racks and internal teeth", stiffness_table, SPUR, force=1e5)
