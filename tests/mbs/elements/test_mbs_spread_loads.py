"""Loads spread over flexible bodies: virtual work, full statics, balances."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.mbs.mechanisms import nodal_body, prepared, random_nodes, random_pose, random_state
from cases.mbs.motions import swing
from cases.mbs.tangents import check_tangents, forces_at
from cases.refusals import refuses
from cases.solid import block
from rom import rotation
from rom.body.records import Surface
from rom.reduction.full_model import operators
from rom.reduction.interfaces.connection import connect

TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


def covered_body(rng):
    """A random body whose nodes are its surface, closed around the first four; and its nodes."""
    nodes = random_nodes(rng)
    x, phi = nodes[0], nodes[2]
    shape = phi.transpose(1, 2, 0).reshape(3 * len(x), -1)
    return replace(nodal_body(*nodes), surface=Surface(x, TETRAHEDRON, shape)), x, phi


@pytest.mark.parametrize("frame", ["body", "world"])
def test_spread_loads_do_the_work_of_their_forces(frame):
    """Residual times velocity, and power, against the sum over the nodes as they move."""
    rng = np.random.default_rng(5)
    body, x, phi = covered_body(rng)
    f = rng.normal(size=x.shape)
    mech = rom.Mechanism(gravity=(0, 0, 0))
    part = mech.add_flexible("one", body, **random_pose(rng))
    packed, W = prepared(mech)
    state = random_state(rng, packed)
    without = forces_at(packed, W, *state)
    mech.spread_load("wind", part, rom.surface_load(body, forces=f), 0.7, frame=frame)
    packed, W = prepared(mech)
    found = forces_at(packed, W, *state) - without
    q, v = state[:2]
    A = rotation.matrix(q[3:7])
    P = x + np.einsum("k,kia->ia", q[7:], phi)
    rates = v[:3] + (np.cross(v[3:6], P) + np.einsum("k,kia->ia", v[6:], phi)) @ A.T
    power = 0.7 * ((f @ A.T if frame == "body" else f) * rates).sum()
    assert_allclose(-found @ v, power, rtol=1e-10)
    assert_allclose(W.power[1], power, rtol=1e-10)


@pytest.mark.parametrize("frame", ["body", "world"])
def test_the_iteration_matrix_knows_spread_loads(frame):
    rng = np.random.default_rng(6)
    body, x, _ = covered_body(rng)
    mech = rom.Mechanism()
    part = mech.add_flexible("one", body, **random_pose(rng))
    load = 20.0 * rom.surface_load(body, forces=rng.normal(size=x.shape))
    mech.spread_load("wind", part, load, frame=frame)
    packed, W = prepared(mech)
    check_tangents(packed, W, random_state(rng, packed), np.eye(packed.v.size), 1e-6)


def outward_block():
    """A steel block whose triangles go counter-clockwise seen from outside."""
    model = block(cells=(10, 2, 2))
    points, mesh = model.points[model.surface.nodes], model.surface
    a, b, c = np.moveaxis(points[mesh.triangles], 1, 0)
    inward = (np.cross(b - a, c - a) * ((a + b + c) / 3 - points.mean(axis=0))).sum(axis=1) < 0
    triangles = np.where(inward[:, None], mesh.triangles[:, [0, 2, 1]], mesh.triangles)
    return replace(model, surface=replace(mesh, triangles=triangles))


def on_top(points):
    return points[:, 2] > 0.08 - 1e-9


def test_a_pressure_bends_a_block_as_the_full_statics_say():
    """All points of the surface; the body knows the shape of the answer by WithLoads."""
    model, pressure = outward_block(), 50.0
    F, kinds = np.zeros((model.n_dofs, 1)), {"root": "rbe2", "tip": "polynomial:1"}
    for corners in model.surface.nodes[model.surface.triangles]:
        a, b, c = model.points[corners]
        if on_top(model.points[corners]).all():
            F[3 * corners + 2, 0] -= pressure * np.linalg.norm(np.cross(b - a, c - a)) / 6
    assert_allclose(F.sum(), -pressure * 1.0 * 0.1)
    connection = connect(operators(model), model, kinds)
    held = connection.boundary[connection.parts["root"]]
    full = connection.ops.expand(connection.ops.hold(held)(connection.ops.restrict(F)))
    full = full.reshape(-1, 3)[model.surface.nodes]
    method = rom.WithLoads(rom.CraigBampton(4), F)
    body = rom.reduce(model, method=method, interfaces=kinds, certify=False)
    mech = rom.Mechanism(gravity=(0, 0, 0))
    part = mech.add_flexible("beam", body)
    mech.fixed("wall", mech.ground.marker(body.markers["root"].point), part.marker("root"))
    load = rom.surface_load(body, pressure=pressure, where=on_top)
    for frame in ("body", "world"):
        mech.spread_loads.clear()
        mech.spread_load("snow", part, load, frame=frame)
        q = rom.equilibrium(mech, steps=2).q
        bent = (body.surface.shape @ q[7:]).reshape(-1, 3)
        at = q[:3] + (body.surface.points + bent) @ rotation.matrix(q[3:7]).T
        moved = at - body.surface.points
        assert np.abs(full).max() > 1e-8
        assert_allclose(moved, full, atol=1e-6 * np.abs(full).max())


def test_a_pressure_all_around_pushes_nowhere():
    model = outward_block()
    body = rom.reduce(model, method=rom.CraigBampton(4), interfaces={"root": "full"}, certify=False)
    load = rom.surface_load(body, pressure=2.0)
    assert_allclose(load.force, 0, atol=1e-14)
    volume = 1.0 * 0.1 * 0.08
    assert_allclose(load.first, -2.0 * volume * np.eye(3), atol=1e-15)  # by the theorem of Gauss
    end = rom.surface_load(body, traction=(0, 3.0, 0), where="root")
    assert_allclose(end.force, [0, 3.0 * 0.1 * 0.08, 0], atol=1e-15)
    both = load + 2.0 * end
    assert_allclose(both.first, load.first + 2 * end.first)


def test_force_per_mass_is_gravity():
    g = np.array([0.4, -1.0, -9.0])
    heavy, pulled = swing(), swing()
    heavy.gravity, pulled.gravity = g, np.zeros(3)
    part = pulled.part("one")
    pulled.spread_load("weight", part, rom.mass_load(part.flexible, g), frame="world")
    sols = [rom.simulate(mech, t_end=0.1, dt=2e-3) for mech in (heavy, pulled)]
    assert_allclose(sols[1].q, sols[0].q, atol=1e-11 * np.abs(sols[0].q).max())
    rise = sols[0].energy.potential - sols[0].energy.potential[0]
    assert_allclose(sols[1].energy.forces - sols[0].energy.forces, -rise, atol=2e-3)


def test_energy_balances_under_a_load_in_time():
    rng = np.random.default_rng(8)
    body, x, _ = covered_body(rng)
    mech = rom.Mechanism(gravity=(0, 0, 0))
    part = mech.add_flexible("one", body, at=(0, 0, 0), omega=(0.3, 0, 1.0))
    load = rom.surface_load(body, forces=rng.normal(size=x.shape))
    mech.spread_load("push", part, load, lambda t: np.sin(20 * t))
    mech.spread_load("wind", part, load, lambda t: t, frame="world")
    coarse, fine = (rom.simulate(mech, t_end=0.3, dt=h) for h in (2e-3, 1e-3))
    misses = [np.abs(sol.energy.balance).max() for sol in (coarse, fine)]
    assert misses[1] < 1e-3 * np.ptp(fine.energy.forces)
    assert 3 < misses[0] / misses[1] < 5


def test_messages():
    body, _, _ = covered_body(np.random.default_rng(5))
    mech = rom.Mechanism()
    load = rom.mass_load(body, (0, 0, 1.0))
    inside_out = replace(body, surface=replace(body.surface, triangles=TETRAHEDRON[:3]))
    box = mech.add_rigid("box", mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0))
    for error, words, on, given in (
        (rom.ConfigError, "exactly one of pressure, traction and forces", body,
         {"pressure": 1.0, "traction": (0, 0, 1)}),
        (rom.ConfigError, "chooses no triangle of the 4", body,
         {"pressure": 1.0, "where": lambda points: points[:, 0] > 1e9}),
        (rom.ConfigError, "no deformable interface 'top'", body, {"pressure": 1.0, "where": "top"}),
        (rom.ConfigError, r"needed is \(7, 3\)", body, {"forces": np.zeros(3)}),
        (rom.ModelError, "do not tell its inside from its outside", inside_out, {"pressure": 1.0}),
        (rom.ModelError, "carries no surface", replace(body, surface=None), {"pressure": 1.0}),
    ):  # fmt: skip
        refuses(error, words, rom.surface_load, on, **given)
    refuses(rom.ConfigError, "is not one of body 'box'", mech.spread_load, "pull", box, load)
