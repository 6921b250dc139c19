"""Surfaces of flexible bodies against primitives: weight, friction, pressure of a sphere."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.solid import block, reduced
from rom import rotation
from rom.errors import ConfigError, ModelError
from rom.mbs.elements.contact.impact import Impact
from rom.mbs.parts.bodies import Marker, surface_place

SIZE, G = (0.4, 0.3, 0.2), 9.81
WEIGHT = 7850.0 * 0.4 * 0.3 * 0.2 * G
LAW = Impact(stiffness=4e8, exponent=1.0, damping=20.0, mu=0.3, transition_speed=1e-3)


def below(points):
    return points[:, 2] < 1e-9


@pytest.fixture(scope="module")
def brick():
    model = block(size=SIZE, cells=(3, 2, 2))
    return reduced(2, model)


def on_floor(brick, law=LAW, **start):
    mech = rom.Mechanism(gravity=(0, 0, -G))
    part = mech.add_flexible("brick", brick, **start)
    floor = mech.ground.marker((0.0, 0.0, 0.0))
    mech.surface_on_plane("floor", floor, part, law, normal=(0, 0, 1), where=below)
    return mech, part


def guide(mech, part):
    """Let one end go up and down only."""
    place = mech.design_point(part.marker("root"))
    mech.prismatic("guide", mech.ground.marker(place), part.marker("root"), axis=(0, 0, 1))


def test_the_areas_of_the_points_are_those_of_the_face(brick):
    areas = brick.surface_areas(below)
    assert_allclose(areas.sum(), 0.4 * 0.3)
    assert (brick.surface.points[areas > 0, 2] < 1e-9).all()
    assert_allclose(brick.surface_areas().sum(), 2 * (0.12 + 0.08 + 0.06))


def test_points_of_the_surface_move_with_its_shapes(brick):
    rng = np.random.default_rng(4)
    q = 1e-3 * rng.normal(size=brick.n_modes)
    mech, _ = on_floor(brick, at=(0.1, 0, 1.0), orientation=(0.6, 0, 0.8, 0), q=q)
    sol = rom.simulate(mech, t_end=1e-6, dt=1e-6)
    bent = brick.surface.points + (brick.surface.shape @ q).reshape(-1, 3)
    wanted = [0.1, 0, 1.0] + bent @ rotation.matrix([0.6, 0, 0.8, 0]).T
    for k in np.flatnonzero(brick.surface_areas(below)):
        at = sol.position("brick", Marker("brick", surface_place(int(k))))[0]
        assert_allclose(at, wanted[k], atol=1e-12)


def test_a_brick_sinks_into_its_foundation_by_its_weight(brick):
    """A steel brick on a soft foundation stays flat: depth W / (k A) everywhere."""
    mech, part = on_floor(brick)
    guide(mech, part)
    state = rom.equilibrium(mech)
    sol = rom.simulate(mech, t_end=1e-3, dt=1e-4, state=state)
    depth = WEIGHT / (4e8 * 0.12)
    corners = np.flatnonzero(brick.surface_areas(below))
    for k in corners:
        height = sol.position("brick", Marker("brick", surface_place(int(k))))[:, 2]
        assert_allclose(height, -depth, rtol=0.02)
    load = sol.interface_loads("ground")[(0.0, 0.0, 0.0)]
    assert_allclose(load[0, 2], -WEIGHT, rtol=1e-9)
    assert_allclose(sol.v, 0, atol=1e-9)


def test_a_sliding_brick_slows_down_by_friction(brick):
    """Deceleration mu g while it slides, whatever the share of each point."""
    mech, part = on_floor(brick)
    guide(mech, part)
    q = rom.equilibrium(mech).q
    mech, _ = on_floor(brick, at=q[:3], orientation=q[3:7], q=q[7:], velocity=(1.0, 0, 0))
    sol = rom.simulate(mech, t_end=0.1, dt=5e-4, rho_inf=0.5)
    speed = sol.velocity("brick", "root")[:, 0]
    assert_allclose(np.polyfit(sol.t, speed, 1)[0], -0.3 * G, rtol=0.01)
    load = sol.interface_loads("ground")[(0.0, 0.0, 0.0)]
    assert_allclose(load[:, 0].mean(), 0.3 * WEIGHT, rtol=0.01)
    lost = sol.energy.damping[-1]
    assert_allclose(lost, 0.5 * WEIGHT / G * (1 - speed[-1] ** 2), rtol=0.01)


def test_a_brick_pushed_along_the_floor_rests_by_springs_per_area(brick):
    """Their way, averaged over the area, is F / (k_t A), however it tilts."""
    mech, part = on_floor(brick)
    guide(mech, part)
    q, F = rom.equilibrium(mech).q, 0.1 * WEIGHT
    law = replace(LAW, tangential_stiffness=2e8, tangential_damping=1e6)
    mech, part = on_floor(brick, law, at=q[:3], orientation=q[3:7], q=q[7:])
    mech.force("push", part.marker("root"), (F, 0.0, 0.0))
    areas, start = brick.surface_areas(below), rom.simulate(mech, t_end=1e-9, dt=1e-9)
    found = rom.snapshot(mech, rom.equilibrium(mech))
    way = sum(
        areas[k] * (sol.position("brick", Marker("brick", surface_place(int(k))))[0, 0] * sign)
        for sol, sign in ((found, 1), (start, -1)) for k in np.flatnonzero(areas)
    ) / areas.sum()  # fmt: skip
    assert_allclose(way, F / (2e8 * 0.12), rtol=1e-4)
    dropped = rom.simulate(mech, t_end=0.1, dt=5e-4, rho_inf=0.5)
    assert_allclose(dropped.velocity("brick")[-1], 0.0, atol=1e-6)


@pytest.mark.parametrize("kind", ["sphere", "cylinder", "bore"])
def test_a_round_thing_presses_as_the_sum_over_the_points(brick, kind):
    """Against the sum of k a_i depth_i^1.5 along the normals, from the positions alone."""
    mech = rom.Mechanism(gravity=(0, 0, -G))
    part = mech.add_flexible("brick", brick)
    guide(mech, part)
    law = Impact(stiffness=5e9, exponent=1.5)
    radius, centre = 1.0, np.array([0.2, 0.15, -0.97])
    if kind == "bore":
        centre = np.array([0.2, 0.15, 0.98])
    m1, axis = mech.ground.marker(tuple(centre)), np.array([0, 1.0, 0])
    if kind == "sphere":
        mech.surface_on_sphere("round", m1, part, law, radius=radius, where=below)
    else:
        inside = {"axis": axis, "inside": kind == "bore"}
        mech.surface_on_cylinder("round", m1, part, law, radius=radius, where=below, **inside)
    state = rom.equilibrium(mech)
    sol = rom.simulate(mech, t_end=1e-5, dt=1e-5, state=state)
    areas, total = brick.surface_areas(below), np.zeros(3)
    for k in np.flatnonzero(areas):
        at = sol.position("brick", Marker("brick", surface_place(int(k))))[0] - centre
        across = at if kind == "sphere" else at - axis * at[1]
        far = np.linalg.norm(across)
        depth = max(radius - far if kind != "bore" else far - radius, 0.0)
        sign = -1 if kind == "bore" else 1
        total += sign * 5e9 * areas[k] * depth**1.5 * across / far
    load = sol.interface_loads("ground")[tuple(centre)]
    assert_allclose(load[0, :3], -total, rtol=1e-8, atol=1e-8 * WEIGHT)
    assert_allclose(total[2], WEIGHT, rtol=1e-8)


def test_messages(brick):
    mech, part = on_floor(brick)
    floor = mech.ground.marker((0, 0, 0))
    with pytest.raises(ConfigError, match="used twice"):
        mech.surface_on_plane("floor", floor, part, LAW, normal=(0, 0, 1), where=below)
    box = mech.add_rigid("box", mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0))
    with pytest.raises(ConfigError, match="body 'box' is rigid, it has no surface"):
        mech.surface_on_sphere("ball", floor, box, LAW, radius=1.0)
    with pytest.raises(ConfigError, match="with itself"):
        mech.surface_on_sphere("ball", part.marker("root"), part, LAW, radius=1.0)
    with pytest.raises(ConfigError, match="is flexible; use its markers"):
        part.marker((0.0, 0.0, 0.0))
    bare = rom.Mechanism()
    bald = bare.add_flexible("brick", replace(brick, surface=None))
    with pytest.raises(ModelError, match="carries no surface"):
        bare.surface_on_sphere("ball", floor, bald, LAW, radius=1.0)
