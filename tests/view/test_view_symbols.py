"""Symbols of machine drawings are where joints, springs and the ground are, at all instants."""

import sys
from types import ModuleType

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.mbs.drawn import lattice_bar, swinging
from cases.mbs.parts import ORIGIN, on_guide, on_hinge
from cases.refusals import refuses
from rom import view
from rom.components.gear_mesh import RackPair
from rom.view.canvas import symbols
from rom.view.canvas.scene import HEIGHTS, aimed
from rom.view.figures.things import BAR_SIZE, scale, seen
from rom.view.scenes.connections import SPRING_COLOUR, connections, stretched
from rom.view.scenes.film import Look, _stage
from rom.view.scenes.ground import GROUND_COLOUR, JOINT_COLOUR, PLANE_OPACITY
from rom.view.scenes.places import at_start, different, moving
from rom.view.scenes.rigid import bars, block_of, ends_of, form_of

UP = np.array([0.0, 0.0, 1.0])
STEEL = rom.mbs.Impact(stiffness=1e5)


def rod(mech, name="rod", at=(0.5, 0, 0), **more):
    markers = {"a": (-0.5, 0, 0), "b": (0.5, 0, 0)}
    return mech.add_rigid(name, mass=1.0, inertia=(1e-3, 0.1, 0.1), at=at, markers=markers, **more)


def turned_by(vector):
    return rom.rotation.matrix(rom.rotation.exp(np.array(vector)))


def drawn(mech, surfaces=None):
    shapes = {name: bars(part, ends_of(mech, name))[0] for name, part in mech.parts.items()}
    return connections(at_start(mech), shapes | (surfaces or {}), set(surfaces or ()), UP)


def of(actors, colour, opacity=1.0):
    solid = (a for a in actors if a.colour == colour and a.cells.shape[1] == 3)
    return [a for a in solid if a.opacity == opacity]


def middle(actor):
    points = actor.points[0]
    return 0.5 * (points.min(axis=0) + points.max(axis=0))


KINDS = {
    "revolute": lambda m, a, b: m.revolute("j", a, b, axis=(0, 1, 0)),
    "cylindrical": lambda m, a, b: m.cylindrical("j", a, b, axis=(0, 1, 0)),
    "screw": lambda m, a, b: m.screw("j", a, b, axis=(0, 1, 0), pitch=0.01),
    "prismatic": lambda m, a, b: m.prismatic("j", a, b, axis=(0, 1, 0)),
    "spherical": lambda m, a, b: m.spherical("j", a, b),
    "universal": lambda m, a, b: m.universal("j", a, b, axis1=(1, 0, 0), axis2=(0, 1, 0)),
    "fixed": lambda m, a, b: m.fixed("j", a, b),
    "point on line": lambda m, a, b: m.point_on_line("j", a, b, axis=(0, 1, 0)),
    "point on plane": lambda m, a, b: m.point_on_plane("j", a, b, normal=(0, 0, 1)),
}  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("turned", [False, True])
def test_a_joint_is_drawn_at_its_point_and_along_its_axis(kind, turned):
    A = turned_by((0.4, -0.3, 0.8)) if turned else np.eye(3)
    mech = rom.Mechanism()
    one, two = (rod(mech, name, at=at, orientation=A)
                for name, at in (("one", A @ (0.5, 0, 0)), ("two", A @ (1.5, 0, 0))))  # fmt: skip
    KINDS[kind](mech, one.marker("b"), two.marker("a"))
    (joint,) = of(drawn(mech), JOINT_COLOUR)
    assert_allclose(middle(joint), A @ (1.0, 0, 0), atol=1e-12)
    if kind in ("revolute", "cylindrical", "screw", "prismatic"):
        size = np.ptp(joint.points[0], axis=0)
        assert size[1] > 1.2 * size[0] and size[1] > 1.2 * size[2]
    if kind == "universal":  # its arms along x and y
        size = np.ptp(joint.points[0], axis=0)
        assert size[0] == pytest.approx(size[1], rel=1e-2) and size[2] < 0.6 * size[0]


def test_a_hinge_on_the_ground_stands_on_it_and_one_that_carries_hangs_from_it():
    for at, side in (((0.5, 0, 0), -1), ((0, 0, -0.5), 1)):
        mech = rom.Mechanism()
        on_hinge(mech, at, inertia=(1e-3, 0.1, 0.1))
        (ground,) = of(drawn(mech), GROUND_COLOUR)
        assert middle(ground)[2] * side > 0 and abs(middle(ground)[0]) < 1e-12
    assert not of(drawn(swinging(lattice_bar())[0]), "none")


def test_what_slides_on_the_ground_has_a_rail_below_all_of_its_way():
    mech, place = rom.Mechanism(gravity=ORIGIN), {"at": (1, 0, 0.2), "velocity": (2, 0, 0)}
    on_guide(mech, "block", base=(0, 0, 0.2), **place)
    sol = rom.simulate(mech, t_end=0.5, dt=0.05)
    shape = view.box((0.2, 0.3, 0.1))
    stage = _stage(mech, sol, np.array([0, 5, 10]), Look({"block": shape}, up=UP))
    (rails,) = of(stage.actors, GROUND_COLOUR)
    low, high = rails.points[0].min(axis=0), rails.points[0].max(axis=0)
    assert low[0] < 0.9 and high[0] > 2.1  # from 1 to 2, and half of the block
    assert high[2] == pytest.approx(0.15)  # the lower face of the block
    assert (low[1], high[1]) == pytest.approx((-0.15, 0.15))


def test_bearings_are_around_the_nearer_end_and_walls_behind_the_foot():
    mech = rom.Mechanism()
    on_hinge(mech, ORIGIN, "shaft", inertia=(1e-2,) * 3)
    shaft = view.cylinder((0, -0.3, 0), (0, 0.8, 0), 0.1)[0]
    actors = drawn(mech, {"shaft": shaft})
    bush = next(a for a in of(actors, JOINT_COLOUR) if abs(middle(a)[2]) < 1e-6)
    assert middle(bush)[1] < -0.3 < bush.points[0][:, 1].max()
    assert np.ptp(bush.points[0][:, 0]) > 0.1
    mech = rom.Mechanism()
    part = rod(mech)
    mech.fixed("j", mech.ground.marker(ORIGIN), part.marker("a"))
    (plate,) = of(drawn(mech, {"rod": view.box((1.0, 0.4, 0.2))[0]}), GROUND_COLOUR)
    low, high = plate.points[0].min(axis=0), plate.points[0].max(axis=0)
    assert high[0] == pytest.approx(0.0, abs=1e-12) and low[0] < 0
    assert min(high[1] - 0.2, high[2] - 0.1, -0.2 - low[1], -0.1 - low[2]) > 0.02


def test_springs_stretch_between_their_markers_and_stay_right_handed():
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    ball = mech.add_rigid("ball", mass=1.0, inertia=(1e-3,) * 3, at=(0, 0, -0.5))
    ends = mech.ground.marker(ORIGIN), ball.marker(ORIGIN)
    mech.spring_damper("s", *ends, stiffness=50.0, damping=1.0)
    sol = rom.simulate(mech, t_end=0.2, dt=0.02)
    stage = _stage(mech, sol, np.array([0, 5, 10]), Look({}, up=UP))
    coil = next(a for a in stage.actors if a.colour == SPRING_COLOUR)
    assert_allclose(coil.points[:, 0], 0.0, atol=1e-12)
    assert_allclose(coil.points[:, -1], sol.position("ball")[[0, 5, 10]], atol=1e-12)
    wide = np.linalg.norm(coil.points[..., :2], axis=2).max(axis=1)
    assert_allclose(wide, wide[0])  # it grows longer, not wider
    assert coil.points[2, -1, 2] < coil.points[0, -1, 2] - 0.05
    ends = np.zeros((2, 3)), np.array([[0.0, 2, 0], [1, 1, 1]])
    local = np.array([[0.1, 0, 0], [0, 0.1, 0], [0, 0, 1.0]])
    x, y, z = np.moveaxis(stretched((local, np.array([[0, 1]])), ends, "#000000").points, 1, 0)
    assert_allclose(z, ends[1])
    assert (np.einsum("fa,fa->f", np.cross(x, y), z) > 0).all()
    assert_allclose(np.linalg.norm(x, axis=1), 0.1)


def test_a_plane_of_contact_holds_all_that_moves_on_it():
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    ball = mech.add_rigid("ball", mass=1.0, inertia=(1e-3,) * 3, at=(0, 0, 0.1), velocity=(3, 1, 0))
    pair = mech.ground.marker(ORIGIN), ball.marker(ORIGIN)
    mech.sphere_on_plane("c", *pair, STEEL, normal=(0, 0, 1), radius=0.1)
    sol = rom.simulate(mech, t_end=0.5, dt=1e-3)
    stage = _stage(mech, sol, np.arange(0, 501, 50), Look({}, up=UP))
    (plate,) = of(stage.actors, GROUND_COLOUR, PLANE_OPACITY)
    assert plate.points[0][:, 2].max() == pytest.approx(0.0, abs=1e-12)
    corners = plate.points[0][np.isclose(plate.points[0][:, 2], 0.0, atol=1e-12)][:, :2]
    centre = corners.mean(axis=0)
    along = np.array([3.0, 1.0]) / np.sqrt(10)
    half = np.abs((corners - centre) @ along).max()
    way = (sol.position("ball")[:, :2] - centre) @ along
    assert np.abs(way).max() + 0.1 < half < np.abs(way).max() + 0.5


def test_bodies_without_a_shape_are_blocks_of_their_inertia_with_tubes_to_joints():
    """m / 12 (b^2 + c^2) and so on, turned into other axes."""
    size, mass = np.array([0.3, 0.2, 0.5]), 7.0
    R = rom.rotation.matrix(rom.rotation.exp(np.array([0.2, 0.9, -0.4])))
    edges, axes = block_of(R @ np.diag(mass / 12 * size**2) @ R.T, mass)
    assert_allclose(edges, np.sort(size), rtol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert_allclose(np.abs(R.T @ axes)[[1, 0, 2], [0, 1, 2]], 1.0, rtol=1e-12)
    mech = rom.Mechanism()
    part = mech.add_rigid("body", mass=1.0, inertia=(1e-2,) * 3, at=ORIGIN)
    assert ends_of(mech, "body") == []
    mech.spherical("j", mech.ground.marker((0, 0.4, 0)), part.marker((0, 0.4, 0)))
    assert_allclose(ends_of(mech, "body"), [(0, 0.4, 0)])
    assert np.ptp(bars(part, ends_of(mech, "body"))[0][:, 1]) > 0.4


def test_a_block_stands_beside_tubes_unless_it_is_far_larger():
    """A cube of edge a has m a^2 / 6 about each axis; three times the reach is the most."""
    mech = rom.Mechanism()
    for name, arm in (("alone", 0.0), ("beside", 0.1), ("hidden", 0.07)):
        how = {"inertia": (0.24**2 / 6,) * 3, "markers": {"a": (arm, 0, 0)}}
        mech.add_rigid(name, mass=1.0, at=ORIGIN, **how)
    alone, beside, hidden = (form_of(mech, name, {}) for name in mech.parts)
    assert (alone.opacity, beside.opacity, hidden.opacity) == (0.5, 1.0, 1.0)
    assert alone.block is None and hidden.block is None
    for points in (alone.points, beside.block[0]):
        assert_allclose(np.ptp(points, axis=0), 0.24)
    assert np.ptp(hidden.points, axis=0).max() < 0.1


def test_symbols_and_traces_are_drawn_where_they_are_asked_for():
    for wanted in (False, True):
        actors = _stage(*swinging(lattice_bar()), np.array([0]), Look({}, symbols=wanted)).actors
        assert [bool(of(actors, c)) for c in (JOINT_COLOUR, GROUND_COLOUR)] == [wanted] * 2
    mech, sol = swinging(lattice_bar())
    stage = _stage(mech, sol, np.array([0]), Look({}, traces=("bar",)))
    line = stage.actors[-1]
    assert_allclose(line.points[0], sol.position("bar"), atol=1e-12)
    refuses(rom.ConfigError, "traces: no body 'baar'", view.animate, mech, sol, traces=("baar",))


def test_instants_that_are_chosen_differ():
    mech = rom.Mechanism()
    on_hinge(mech, (0.5, 0, 0), "rod", mass=1.0, inertia=(1e-3, 0.1, 0.1))
    sol = rom.simulate(mech, t_end=3.4, dt=0.01)
    times = different(sol, 4)
    tip = np.array([2 * sol.position("rod")[np.argmin(np.abs(sol.t - t))] for t in times])
    apart = np.linalg.norm(tip[:, None] - tip, axis=2)[np.triu_indices(4, 1)]
    assert times.size == 4 and times[0] == 0.0 and (np.diff(times) > 0).all()
    assert apart.min() > 0.5
    still = rom.Mechanism(gravity=ORIGIN)
    rod(still)
    assert different(rom.simulate(still, t_end=1.0, dt=0.1), 4).tolist() == [0.0]


def test_the_camera_holds_all_instants_wastes_little_and_has_a_true_length():
    mech, sol = swinging(lattice_bar())
    stage = _stage(mech, sol, np.arange(0, 101, 5), Look({}, symbols=False))
    camera = seen(stage.scene("", (0, 0, 1), (0, 1, 0)), 900).camera
    points = np.concatenate([a.points.reshape(-1, 3) for a in stage.actors])
    right = np.cross(camera.up, camera.toward)
    reach = np.abs((points - camera.focus) @ np.column_stack([right, camera.up])).max(axis=0)
    half = 0.5 * camera.height * np.array([camera.size[0] / camera.size[1], 1.0])
    assert (reach < half).all() and (reach > 0.9 * half).any()
    assert HEIGHTS[0] <= camera.size[1] / camera.size[0] <= HEIGHTS[1]
    camera = aimed(np.array([[0.0, 0, 0], [0.9, 0.5, 0.2]]), 700, view=(0, -1, 0), up=(0, 0, 1))
    length, wide = scale(camera)
    assert wide == pytest.approx(length * camera.size[1] / camera.height)
    assert BAR_SIZE / 2.6 < wide <= BAR_SIZE and length == pytest.approx(0.1)
    assert_allclose(camera.axes, [[1, 0, 0], [0, 0, -1], [0, 1, 0]], atol=1e-12)


def test_ground_is_hatched_all_around():
    (points, triangles), (lines, pairs) = symbols.ground_plate(2.0, 1.0, 0.1)
    assert points[:, 2].max() == 0.0 and points[:, 2].min() == pytest.approx(-0.1)
    ends = lines[pairs]
    slanted = ends[np.abs(np.diff(ends[..., 2], axis=1)[:, 0]) > 0.05]
    far = np.isclose(np.abs(slanted[..., :2]), (1.0, 0.5))
    sides = far.all(axis=1).sum(axis=0)
    assert min(sides) >= 6 and sum(sides) >= len(slanted)
    assert len(triangles) == 12


@pytest.mark.once
def test_a_plotter_is_had_where_dolfinx_is_not_loaded_only(monkeypatch):
    monkeypatch.setitem(sys.modules, "dolfinx", ModuleType("dolfinx"))
    refuses(rom.ConfigError, "dolfinx is loaded in this process", view.plotter, lattice_bar())


def test_cables_pinions_and_bearings_are_lines_and_circles_at_all_instants():
    mech = rom.Mechanism(gravity=ORIGIN)
    held = rod(mech, "held", at=ORIGIN, orientation=turned_by((0.4, -0.3, 0.8)))
    mech.fixed("stand", mech.ground.marker(ORIGIN), held.marker(ORIGIN))
    wheel = rom.mbs.Pulley(held.marker(ORIGIN), 0.2, (0, 1, 0))
    place = {"at": (0.2, 0, -1.0), "velocity": (0, 0, 1.0)}
    load = on_guide(mech, "rod", axis=UP, base=(0.2, 0, -1.0), **place)
    mech.tendon("rope", [mech.ground.marker((-0.2, 0, -1.0)), wheel, load], EA=1)
    moved = rom.simulate(mech, t_end=0.5, dt=0.01, progress=False)
    places = moving(mech, moved, [0, 50], 1.0)
    drawn = {"rod": np.array([[-0.5, 0, 0], [0.5, 0, 0]])}
    *_, line, circle = connections(places, drawn, set(), UP)
    x = line.points
    for f, end in enumerate((-1.0, -0.5)):
        assert_allclose(x[f, 0], [-0.2, 0, -1.0])
        assert_allclose(x[f, -1], [0.2, 0, end], atol=1e-9)
        assert_allclose(np.linalg.norm(x[f, 1:-1], axis=1), 0.2)
        assert_allclose(x[f, [1, -2]], [[-0.2, 0, 0], [0.2, 0, 0]], atol=1e-12)
        assert_allclose(x[f, len(x[f]) // 2], [0, 0, 0.2], atol=1e-12)
    assert_allclose(np.linalg.norm(circle.points, axis=2), 0.2)
    pair = RackPair(26, 4e-3, 0.03, shift=0.3)
    r, where = 0.052, (0.2 + pair.distance, 0, 0)
    mech = rom.Mechanism(gravity=ORIGIN)
    pinion = mech.add_rigid("pinion", mass=1.0, inertia=(1e-3,) * 3, at=(0.2, 0, 0))
    rack = mech.add_rigid("rack", mass=1.0, inertia=(1e-3,) * 3, at=where, velocity=(0, 0.4, 0))
    ends = pinion.marker(ORIGIN), rack.marker(ORIGIN)
    mech.gear_mesh("mesh", *ends, axis=(0, 0, 1), pair=pair, stiffness=1e-9)
    moved = rom.simulate(mech, t_end=0.1, dt=0.05, progress=False)
    *_, circle, line = connections(moving(mech, moved, [0, 2], 1.0), {}, set(), UP)
    assert_allclose(np.linalg.norm(circle.points - [0.2, 0, 0], axis=2), r)
    for f, y in enumerate((0.0, 0.04)):
        ends = [[0.2 + r, y + side * np.pi * r, 0] for side in (-1, 1)]
        assert_allclose(line.points[f], ends, atol=1e-6)
    mech = rom.Mechanism(gravity=ORIGIN)
    shaft = mech.add_rigid("shaft", mass=1.0, inertia=(1e-3,) * 3, at=(0.1, 0, 0))
    ends = mech.ground.marker((0.1, 0, 0)), shaft.marker(ORIGIN)
    row, film = rom.mbs.BallBearing(8, 8e-3, 40e-3), rom.mbs.JournalBearing(0.03, 0.02, 3e-5)
    mech.rolling_bearing("row", *ends, axis=(0, 0, 1), bearing=row)
    mech.journal_bearing("film", *ends[::-1], axis=(0, 0, 1), bearing=film, oil=0.02)
    circles = connections(at_start(mech), {}, set(), UP)
    radii = [np.linalg.norm(one.points - [0.1, 0, 0], axis=2) for one in circles]
    for found, expected in zip(radii, (20e-3, 15e-3, 15e-3), strict=True):
        assert_allclose(found, expected)
