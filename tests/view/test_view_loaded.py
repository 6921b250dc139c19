"""Toothed shafts whose teeth stand in each other, and walls where loads are and as high as they."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from benchmarks.units import as_mechanism
from cases.gear_unit import rigid_unit
from cases.refusals import refused, refuses
from rom import view
from rom.components.gear_mesh import GearPair
from rom.components.gear_mesh.gears.meshes import middle_of_tooth
from rom.components.journal_bearing import film, iso_vg
from rom.components.transmission.loaded import _lines
from rom.view.canvas.solids import gear_outline

SCALE = 1e-6


@cache
def still(**more):
    unit = rigid_unit()
    mech = as_mechanism(unit, **more)
    return unit, mech, rom.mbs.snapshot(mech, rom.equilibrium(mech))


def placed(pair, side, phase):
    """(n, 2) outline of a wheel beside the other, the axis of the pinion in the origin."""
    turn = side * np.pi + middle_of_tooth(pair, side, phase) - np.pi / pair.teeth[side]
    c, s = np.cos(turn), np.sin(turn)
    outline = gear_outline(pair.teeth[side], pair.module, pair.pressure_angle, 40)
    return outline @ np.array([[c, s], [-s, c]]) + (side * pair.distance, 0)


def inside(points, outline):
    """(n,) how many of the points lie inside a polygon, by crossings of a ray."""
    a, b = outline, np.roll(outline, -1, axis=0)
    y = points[:, 1, None]
    crosses = (a[:, 1] > y) != (b[:, 1] > y)
    x = a[:, 0] + (y - a[:, 1]) / np.where(crosses, b[:, 1] - a[:, 1], 1.0) * (b[:, 0] - a[:, 0])
    return (crosses & (points[:, 0, None] < x)).sum(axis=1) % 2 == 1


def overlap(pair, pinion, gear, angle):
    """Whether two outlines (n, 2) share points when the gear turns on by an angle."""
    c, s = np.cos(angle), np.sin(angle)
    turned = (gear - (pair.distance, 0)) @ np.array([[c, s], [-s, c]]) + (pair.distance, 0)
    one, two = (x[np.linalg.norm(x - (pair.r[0], 0), axis=1) < 0.02] for x in (pinion, turned))
    return inside(two, pinion).any() or inside(one, turned).any()


@pytest.mark.parametrize("phase", [0.0, 0.05, 0.17])
def test_teeth_touch_with_their_working_flanks_and_nowhere_else(phase):
    """Turned by its backlash, and by a little more, the gear is in the teeth of the pinion.

    The pinion turns counter-clockwise and drives the gear clockwise.
    """
    loose = GearPair((26, 57), 4e-3, 0.04)
    pair = GearPair((26, 57), 4e-3, 0.04, centre_distance=loose.distance + 2e-4)
    wheels, fine = (placed(pair, 0, phase), placed(pair, 1, phase)), 3e-5
    slack = pair.backlash / pair.rb[1]
    assert not overlap(pair, *wheels, -fine) and overlap(pair, *wheels, fine)
    assert not overlap(pair, *wheels, fine - slack) and overlap(pair, *wheels, -fine - slack)


def test_wheels_of_shafts_stand_in_each_other():
    """Of few points on each flank: chords are inside the teeth."""
    unit, mech, _ = still()
    pair, outlines = unit.mesh.pair, []
    for k, name in enumerate(("pinion", "gear")):
        points = view.toothed_shaft(mech, name)[0]
        rim = np.linalg.norm(points[:, :2] - (k * pair.distance, 0), axis=1) > 0.03
        outlines.append(points[rim & np.isclose(points[:, 2], 0.08), :2])
    slack = pair.backlash / pair.rb[1]
    assert not overlap(pair, *outlines, -slack / 2)
    assert overlap(pair, *outlines, slack) and overlap(pair, *outlines, -2 * slack)


def test_a_shaft_is_as_long_as_its_markers_and_has_its_wheel_where_it_stands():
    unit, mech, _ = still()
    pair = unit.mesh.pair
    for k, name in enumerate(("pinion", "gear")):
        points, triangles = view.toothed_shaft(mech, name)
        beside = np.linalg.norm(points[:, :2] - (k * pair.distance, 0), axis=1)
        assert beside.max() == pytest.approx(pair.ra[k], rel=1e-9)
        assert (points[:, 2].min(), points[:, 2].max()) == pytest.approx((0, 0.2))
        rim = points[beside > 0.051 / 2, 2]
        assert (rim.min(), rim.max()) == pytest.approx((0.08, 0.12))
        journals = points[np.abs(points[:, 2] - 0.1) > 0.021]
        beside = np.linalg.norm(journals[:, :2] - (k * pair.distance, 0), axis=1)
        assert beside.max() == pytest.approx(0.025)
        assert triangles.max() == len(points) - 1


def area(wall):
    """Of a mesh [m^2]."""
    points, triangles = wall
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()


def towards_gear(unit):
    """(2,) the pinion turns counter-clockwise and pushes the gear up and away along this."""
    return np.array([np.sin(unit.mesh.pair.alpha), np.cos(unit.mesh.pair.alpha)])


def test_walls_on_teeth_stand_on_the_path_of_contact_and_have_the_area_of_the_force():
    unit, _, sol = still()
    pair, n = unit.mesh.pair, towards_gear(unit)
    loads = rom.mbs.tooth_loads(sol, "mesh")[0]
    wall = view.tooth_walls(sol, "mesh", scale=SCALE, direction=(0, 2.0, 0))
    assert area(wall) == pytest.approx(SCALE * loads.force.sum(), rel=1e-9)
    walls = np.split(wall[0], np.unique(loads.place.round(9)).size)
    for wall in walls:
        foot, top = np.split(wall, 2)
        assert_allclose(np.cross(foot[:, :2], n), pair.rb[0], rtol=1e-3)
        assert (foot[:, :2] @ n > pair.path[0]).all() and (foot[:, :2] @ n < pair.path[1]).all()
        assert (foot[:, 2].min(), foot[:, 2].max()) == pytest.approx((0.08, 0.12))
        assert (top[:, 1] > foot[:, 1]).all()
        assert_allclose(top[:, [0, 2]], foot[:, [0, 2]], atol=1e-12)


@pytest.mark.parametrize("name", ["pinion low", "gear high"])
def test_walls_around_journals_are_as_high_as_the_pressure(name):
    unit, _, sol = still()
    record, k = sol.journal_bearing(name), int(name == "gear high")
    bearing = next(iter((unit.pinion, unit.gear)[k].bearings.values()))
    wanted = film(bearing, record.motion[0], speed=abs(unit.spins[k]), viscosity=unit.viscosity)
    found = rom.mbs.film_pressures(sol, name)[0]
    assert_allclose(found, wanted.pressure, atol=1e-6 * wanted.pressure.max())
    points = view.film_wall(sol, name, scale=1e-8, gap=2e-3, shift=0.01)[0]
    middle = (k * unit.mesh.pair.distance, 0.0, 0.2 * k + 0.01 * (1 - 2 * k))
    foot, top = np.split(points - middle, 2)
    assert_allclose(foot[:, 2], 0, atol=1e-12)
    assert_allclose(np.linalg.norm(foot, axis=1), 0.027)
    height = np.linalg.norm(top, axis=1) - 0.027
    assert_allclose(height[:-1], 1e-8 * wanted.pressure[:, 2], atol=1e-8)
    press = -(height[:-1, None] * foot[:-1, :2]).sum(axis=0)
    assert_allclose(press / np.linalg.norm(press), (1 - 2 * k) * towards_gear(unit), atol=0.01)


def test_walls_are_those_of_the_instant_that_is_asked_for():
    unit, mech, sol = still()
    dt = unit.mesh_period / 20
    moving = rom.simulate(mech, state=sol.final, t_end=16 * dt, dt=dt, progress=False)
    pressures = rom.mbs.film_pressures(moving, "gear low")
    forces = [x.force.sum() for x in rom.mbs.tooth_loads(moving, "mesh")]
    hardest = int(np.argmax(forces))
    assert forces[hardest] > 1.1 * forces[0]
    for at in (0, hardest, hardest - len(forces)):
        wall = view.tooth_walls(moving, "mesh", scale=SCALE, direction=(0, 1, 0), at=at)
        assert area(wall) == pytest.approx(SCALE * forces[at], rel=1e-9)
        foot, top = np.split(view.film_wall(moving, "gear low", scale=1e-8, at=at)[0], 2)
        height = np.linalg.norm(top - foot, axis=1)[:-1]
        assert_allclose(height, 1e-8 * pressures[at, :, 2], rtol=1e-6, atol=1e-12)


def test_pressures_are_those_of_each_film_in_the_middle_of_aligned_ones():
    mech = as_mechanism(rigid_unit(), oil=iso_vg(46), inlet=40.0)
    sol = rom.mbs.snapshot(mech, rom.equilibrium(mech))
    for name in ("pinion low", "gear high"):
        wanted = sol.journal_bearing(name).pressure[0]
        assert rom.mbs.film_pressures(sol, name).max() == pytest.approx(wanted, rel=1e-9)
    unit = rigid_unit()
    for name in ("pinion", "gear"):
        rotor = getattr(unit, name)
        aligned = {k: replace(b, aligned=True) for k, b in rotor.bearings.items()}
        unit = replace(unit, **{name: replace(rotor, bearings=aligned)})
    mech = as_mechanism(unit)
    sol = rom.mbs.snapshot(mech, rom.equilibrium(mech))
    foot, top = np.split(view.film_wall(sol, "pinion low", scale=1e-8)[0], 2)
    highest = rom.mbs.film_pressures(sol, "pinion low")[0].max()
    assert np.linalg.norm(top - foot, axis=1).max() == pytest.approx(1e-8 * highest, rel=1e-9)


def test_lines_of_back_flanks_are_those_of_working_flanks_in_a_mirror():
    pair, axes, ones = rigid_unit().mesh.pair, tuple(np.eye(3)), np.ones(3)
    place, back = np.array([0.02, 0.02, 0.02]), np.array([False, True, True])
    height = np.array([0.0, 0.0, 0.01])
    loads = rom.mbs.ToothLoads(place, height, 0.01 * ones, ones, back)
    (working, _), (behind, _) = _lines(pair, loads, axes)
    assert_allclose(behind[0], working[0] * (1, -1, 1), atol=1e-12)
    assert len(working) == 3 and len(behind) == 4 and working[0][1] * behind[0][1] < 0


def test_walls_in_a_ring_stand_where_its_pinion_is_nearest():
    pair, z = GearPair((24, -60), 3e-3, 0.02), (0, 0, 1)
    mech = rom.Mechanism(gravity=(0, 0, 0))
    turned = abs(pair.distance)
    ends, solid = [], {"mass": 1.0, "inertia": (0.01,) * 3, "markers": {"middle": (0, 0, 0)}}
    for name, at in (("pinion", (turned, 0, 0)), ("ring", (0, 0, 0))):
        ends.append(mech.add_rigid(name, at=at, **solid).marker("middle"))
    mech.revolute("of pinion", mech.ground.marker((turned, 0, 0)), ends[0], axis=z)
    mech.fixed("of ring", mech.ground.marker((0, 0, 0)), ends[1])
    mech.gear_mesh("mesh", *ends, axis=z, pair=pair, stiffness=1e10)
    mech.torque("drive", ends[0], (0, 0, 10.0))
    sol = rom.mbs.snapshot(mech, rom.equilibrium(mech))
    points = view.tooth_walls(sol, "mesh", scale=1e-12, direction=z)[0]
    assert (points[:, 0] > turned).all()
    assert_allclose(np.hypot(*points[:, :2].T), abs(pair.r[1]), atol=1.5 * pair.module)
    refuses(rom.ConfigError, "turns in no journal bearing", view.toothed_shaft, mech, "pinion")


def walls(name, direction):
    return view.tooth_walls(still()[2], name, scale=SCALE, direction=direction)


test_what_has_no_teeth_or_no_film_is_refused = refused(
    (lambda: view.toothed_shaft(still()[1], "shaft"), "'shaft' turns in no journal bearing"),
    (lambda: walls("low", (0, 1, 0)), "no gear mesh 'low'"),
    (lambda: walls("mesh", (0, 0, 0)), "direction has length zero"),
    (lambda: rom.mbs.film_pressures(still()[2], "mesh"), "no journal bearing 'mesh'"),
    (lambda: view.film_wall(still(tabulated=True)[2], "pinion low", scale=1e-8), "'pinion low' is"),
    (lambda: view.toothed_shaft(as_mechanism(rigid_unit(helix=0.2)), "gear"), "'mesh' must be"),
    error=rom.ConfigError,
)


def test_lines_of_helical_teeth_lie_on_the_base_plane_at_the_base_helix():
    unit = rigid_unit(helix=0.2)
    mech, pair = as_mechanism(unit), unit.mesh.pair
    sol = rom.mbs.snapshot(mech, rom.equilibrium(mech))
    points = view.tooth_walls(sol, "mesh", scale=SCALE, direction=(0, 1, 0))[0]
    n, begins = towards_gear(unit), []
    for wall in np.split(points, 2):
        foot = wall[: len(wall) // 2]
        assert_allclose(np.cross(foot[:, :2], n), pair.rb[0], rtol=1e-3)
        s, z = foot[:, :2] @ n, foot[:, 2] - 0.1
        assert (z[0], z[-1]) == pytest.approx((-0.02, 0.02), rel=1e-2)
        begin = s - np.tan(pair.base_helix) * z
        assert np.ptp(begin) < 1e-3 * pair.base_pitch
        begins.append(begin.mean())
    assert begins[1] - begins[0] == pytest.approx(pair.base_pitch, rel=1e-3)
