"""Teeth on rims that deform: against a finite element body with springs, energy, tangents."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose
from scipy.sparse.linalg import splu

import rom
from cases.mbs.mechanisms import prepared, residual_at
from cases.mbs.parts import on_axle
from cases.mbs.tangents import by_position, by_velocity, elastic_forces, shifted
from cases.mbs.tubes import tube
from cases.refusals import refuses
from rom.components.gear_mesh import GearPair, RackPair
from rom.components.gear_mesh.gears.meshes import GEAR_MESHES_FAMILY
from rom.components.round_bodies.cylinders import cylinder_of, pack_cylinders, set_basis
from rom.errors import ConfigError, RomWarning

PAIR, K, PHASE, TORQUE = GearPair((26, 57), 3e-3, 0.06), 15e9, 0.3, 300.0
CELLS, SLICES = (52, 2, 14), 20  # of the body, of the face
INNER, RIM, LENGTH = 0.012, 0.0345, 0.07


@cache
def pinion():
    """A wide-faced hollow pinion; its rim ends 5 mm before the ends of the body."""
    return tube(INNER, RIM, LENGTH, CELLS)


@cache
def reduced(functions, n_modes=3):
    kinds = {"rim": functions, "low": "rbe2"}
    return rom.reduce(pinion(), method=rom.CraigBampton(n_modes), interfaces=kinds,
                      reference="low", certify=False)  # fmt: skip


def driven(body, turned=0.0):
    """The pinion held at one end; the gear presses against its teeth."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    p = np.cos(turned / 2), 0, 0, np.sin(turned / 2)
    shaft = mech.add_flexible("pinion", body, at=(0, 0, 0), orientation=p)
    mech.fixed("end", mech.ground.marker((0, 0, -LENGTH / 2)), shaft.marker("low"))
    gear = on_axle(mech, "gear", mass=5.0, inertia=(0.01, 0.01, 0.02), at=(PAIR.distance, 0, 0))
    given = {"stiffness": K, "phase": PHASE, "entry": 0.0, "cells": SLICES}
    mech.gear_mesh("mesh", shaft.marker("rim"), gear, axis=(0, 0, 1), pair=PAIR, **given)
    mech.torque("load", gear, (0, 0, TORQUE))
    return mech


def meshed(body, place="rim", at=(0, 0, 0), pair=PAIR, **more):
    """A free pinion of a reduced body in mesh with a rigid gear, or rack."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    wheel = mech.add_flexible("pinion", body, at=at)
    other = mech.add_rigid("gear", mass=1.0, inertia=(1.0,) * 3, at=(pair.distance, 0, 0))
    mech.gear_mesh("mesh", wheel.marker(place), other.marker((0, 0, 0)), axis=(0, 0, 1), pair=pair,
                   stiffness=K, **more)  # fmt: skip
    return mech


def rest(mech):
    """Turn of the gear [rad], and force of each slice over their mean, line by line."""
    state = rom.equilibrium(mech)
    loads = rom.mbs.tooth_loads(rom.mbs.snapshot(mech, state), "mesh")[0]
    order = np.lexsort((loads.height, loads.place))
    force = loads.force[order].reshape(-1, SLICES)
    assert force.sum() * PAIR.rb[1] == pytest.approx(TORQUE, rel=1e-6)
    return 2 * np.arcsin(state.q[-1]), force / force.mean()


@cache
def full():
    """The same of all nodes of the body: springs of the slices on it, and a lever to the teeth.

    A slice is carried by the rim over the angle of a tooth; that its force acts above the rim
    turns the rim as a whole, by its mean rotation.
    """
    model, (n, n_r, n_z) = pinion(), CELLS
    number = np.arange(model.n_dofs // 3).reshape(n, n_r + 1, n_z + 1)
    z_nodes, alpha, rb = model.points[number[0, 0], 2], PAIR.alpha, PAIR.rb[0]
    normal = np.array([np.sin(alpha), np.cos(alpha), 0.0])
    x = rb * PHASE + PAIR.base_pitch * np.arange(-9, 9)
    x = x[(x >= PAIR.path[0]) & (x < PAIR.path[1])]
    places = rb * np.array([np.cos(alpha), -np.sin(alpha), 0.0]) + x[:, None] * normal
    heights = PAIR.width * ((np.arange(SLICES) + 0.5) / SLICES - 0.5)
    turn, rows = mean_rotation(model.interfaces["rim"], model.n_dofs), []
    for place in places:
        for z in heights:
            share = (np.arange(400) + 0.5) / 400 - 0.5
            around = (np.arctan2(place[1], place[0]) + np.pi / 26 * share) * n / (2 * np.pi) % n
            one, k = around.astype(int), int(np.searchsorted(z_nodes, z)) - 1
            up = (z - z_nodes[k]) / (z_nodes[k + 1] - z_nodes[k])
            row, at = np.zeros(model.n_dofs), np.zeros(3)
            for i, w in ((one, 1 + one - around), ((one + 1) % n, around - one)):
                for j, u in ((k, 1 - up), (k + 1, up)):
                    nodes = number[i, n_r, j]
                    at += (w * u) @ model.points[nodes] / 400
                    for axis in range(3):
                        np.add.at(row, 3 * nodes + axis, w * u * normal[axis] / 400)
            rows.append(row + np.cross(place + z * np.eye(3)[2] - at, normal) @ turn)
    free = np.setdiff1d(np.arange(model.n_dofs), 3 * number[:, :, 0, None] + np.arange(3))
    P = np.array(rows)[:, free]
    C = P @ splu(model.K[free][:, free].tocsc()).solve(P.T)
    force = np.linalg.solve(np.eye(len(C)) * SLICES / (K * PAIR.width) + C, np.ones(len(C)))
    turned = TORQUE / PAIR.rb[1] ** 2 / force.sum()
    return turned, (force / force.mean()).reshape(-1, SLICES)


def mean_rotation(rim, n_dofs):
    """(3, n) rotation of the rigid motion that is nearest to that of a surface."""
    R = np.zeros((rim.nodes.size, 3, 6))
    R[:, range(3), range(3)] = 1
    for axis in range(3):
        R[:, :, 3 + axis] = np.cross(np.eye(3)[axis], rim.points)
    R, S = R.reshape(-1, 6), np.kron(rim.surface_mass.toarray(), np.eye(3))
    found = np.zeros((3, n_dofs))
    found[:, (3 * rim.nodes[:, None] + np.arange(3)).ravel()] = np.linalg.solve(
        R.T @ S @ R, R.T @ S)[3:]  # fmt: skip
    return found


def test_a_force_is_spread_over_the_angle_of_a_tooth():
    """Compiled functions are means of those of NumPy over that angle."""
    width, mech = np.pi / 26, rom.Mechanism()
    part = mech.add_flexible("pinion", reduced(rom.FourierLegendre(3, 2)), at=(0, 0, 0))
    rim = cylinder_of(part, part.marker("rim"), np.eye(3)[2], np.eye(3)[0])
    rim = replace(rim, middle=0.003)
    rims = pack_cylinders([((rim, width), None)], part.r, 1)
    place = njit(lambda rims, theta, z: set_basis(rims, 0, (0, 0), theta, z))
    for theta, z in ((0.3, 0.01), (-2.5, -0.02)):
        place(rims, theta, z)
        around = theta + width * ((np.arange(500) + 0.5) / 500 - 0.5)
        wanted = rim.functions(around, np.full(500, z)).mean(axis=0)
        assert_allclose(rims.basis[0, 0], wanted, atol=1e-6)
        assert np.abs(wanted - rim.functions(np.array([theta]), np.array([z]))[0]).max() > 1e-3


def test_load_across_a_wide_face_converges_to_that_on_a_finite_element_body():
    """Its driven end carries half more than the mean, the free one a quarter less."""
    turned, shares = full()
    assert shares.max() > 1.4 > 0.8 > shares.min()
    errors = []
    for numbers in ((1, 1), (2, 2), (4, 4), (8, 6)):
        found, load = rest(driven(reduced(rom.FourierLegendre(*numbers))))
        errors.append((abs(found / turned - 1), np.abs(load - shares).max()))
    by_turn, by_share = np.array(errors).T
    assert np.all(np.diff(by_turn) < 0)
    assert by_turn[0] > 0.1 and np.all(by_turn[1:] < (0.04, 0.015, 0.005))
    assert by_share[0] > 0.1 and by_share[3] < 0.02


def test_a_rigid_pinion_bears_evenly():
    """What is left where the body is as stiff as can be: twist and bending are what is uneven."""
    steel = tube(INNER, RIM, LENGTH, (26, 1, 6), rom.Material(E=210e15, nu=0.3, rho=7850.0))
    body = rom.reduce(steel, method=rom.CraigBampton(3), reference="low", certify=False,
                      interfaces={"rim": rom.FourierLegendre(2, 2), "low": "rbe2"})  # fmt: skip
    assert rest(driven(body))[1] == pytest.approx(np.ones((2, SLICES)), abs=1e-3)


@pytest.mark.parametrize("tooth", [1, 7, 13])
def test_teeth_travel_around_a_round_rim_without_a_trace(tooth):
    """No node lies under them; the body has 52 nodes around for 26 teeth."""
    body, angle = reduced(rom.FourierLegendre(4, 4)), 2 * np.pi / 26 * tooth
    first, load = rest(driven(body))
    found, other = rest(driven(body, angle))
    assert found == pytest.approx(first, rel=1e-6)
    assert other == pytest.approx(load, rel=1e-5)
    between = rest(driven(body, angle + np.pi / 26 / 3))[0]
    assert between == pytest.approx(first, rel=2e-3)  # corners of the polygon


def soft_wheels(method, reference, others=(), omega=(0.0, 0.0), **mesh):
    """Two flexible wheels in mesh; other interfaces than their rims are rigid."""
    mech, wheels = rom.Mechanism(gravity=(0, 0, 0)), []
    kinds = {"rim": rom.FourierLegendre(2, 1)} | dict.fromkeys(others, "rbe2")
    for name, x, w in zip(("pinion", "gear"), (0.0, PAIR.distance), omega, strict=True):
        given = {"interfaces": kinds, "reference": reference, "certify": False}
        body = rom.reduce(tube(INNER, RIM, LENGTH, (16, 1, 4)), method=method, **given)
        wheels.append(mech.add_flexible(name, body, at=(x, 0, 0), omega=(0, 0, w)).marker("rim"))
    mech.gear_mesh("mesh", *wheels, axis=(0, 0, 1), pair=PAIR, phase=PHASE, cells=5, **mesh)
    return mech


def pressed(**losses):
    """Two flexible wheels that move anyhow, teeth under load; coordinates and velocities."""
    mech = soft_wheels(rom.CraigBampton(2), "low", ["low"], stiffness=K, entry=0.0, **losses)
    packed, W = prepared(mech)
    rng, n = np.random.default_rng(3), packed.v.size
    delta = 1e-6 * rng.normal(size=n)
    delta[5] = 3e-4
    r = packed.system.bodies.r[0]
    delta[6 : 6 + r], delta[12 + r :] = 1e-9 * rng.normal(size=(2, r))
    return packed, W, shifted(packed, packed.q, delta), 1e-3 * rng.normal(size=n)


def test_forces_on_rims_are_the_gradient_of_the_energy():
    packed, W, q, _ = pressed()
    stiffness, r = packed.elements[GEAR_MESHES_FAMILY].stiffness, packed.system.bodies.r[0]
    gradient, found = elastic_forces(packed, W, q, stiffness, step=1e-8)
    assert np.abs(gradient).max() > 1e3
    for part in (slice(6, 6 + r), slice(12 + r, None)):
        assert_allclose(found[part], gradient[part], atol=1e-5 * np.abs(gradient[part]).max())
    # around the wheels the place of the contact moves along with the motion
    assert_allclose(found, gradient, atol=2e-3 * np.abs(gradient).max())


@pytest.mark.parametrize("rub", [{}, {"friction": 0.1, "transition_speed": 0.1}], ids=str)
def test_tangents_of_rims_are_differences_of_their_forces(rub):
    packed, W, q, v = pressed(damping=1e-5, **rub)
    (K, stiff), (D, loss) = by_position(packed, W, q, v), by_velocity(packed, W, q, v)
    packed.elements[GEAR_MESHES_FAMILY].stiffness[:] = 0.0
    K_body, D_body = by_position(packed, W, q, v)[0], by_velocity(packed, W, q, v)[0]
    teeth = np.abs(K - K_body).max()
    assert teeth > 1e6
    assert_allclose(K, stiff, atol=5e-3 * teeth)
    assert_allclose(D, loss, atol=1e-5 * np.abs(D - D_body).max())


def test_a_rack_presses_a_rim_as_a_gear_without_end_does():
    found = []
    for pair in (RackPair(26, 3e-3, 0.06), GearPair((26, 100_000), 3e-3, 0.06)):
        body = reduced(rom.FourierLegendre(2, 2))
        packed, W = prepared(meshed(body, pair=pair, phase=PHASE, cells=5))
        delta = np.zeros(packed.v.size)
        r = packed.system.bodies.r[0]
        delta[5], delta[6 : 6 + r] = 3e-4, 1e-9 * np.random.default_rng(3).normal(size=r)
        q = shifted(packed, packed.q, delta)
        residual_at(packed.system, W, q, 0 * delta, 0 * delta, np.zeros(0))
        found.append(W.residual[: 6 + r].copy())
    assert np.abs(found[0]).max() > 1e3
    for part in (slice(0, 6), slice(6, None)):
        assert_allclose(found[0][part], found[1][part], atol=1e-3 * np.abs(found[1][part]).max())


def test_free_wheels_with_soft_rims_keep_momentum_and_energy():
    losses = {"damping": 1e-6, "friction": 0.1, "transition_speed": 0.1}
    mech = soft_wheels(rom.Guyan(), "mean-axis", omega=(20.0, 1.0), stiffness=1e9, **losses)
    sol = rom.simulate(mech, t_end=2e-4, method="dop853", rtol=1e-8, atol=1e-10)
    loads = [one.force.sum() for one in rom.mbs.tooth_loads(sol, "mesh")]
    assert max(loads) > 1000
    assert sol.energy.strain.max() > 1e-3 * sol.energy.kinetic[0]
    assert rom.audit(sol).ok, rom.audit(sol)


def test_surfaces_that_teeth_cannot_travel_are_named():
    mech = meshed(reduced(rom.FourierLegendre(2, 2)))
    motion, words = rom.simulate(mech, t_end=1e-6, dt=1e-6), r"no gear mesh 'bearing'; .*\['mesh'\]"
    refuses(ConfigError, words, rom.mbs.tooth_loads, motion, "bearing")
    flat = rom.reduce(pinion(), method=rom.Guyan(), certify=False, reference="mean-axis",
                      interfaces={"high": rom.Polynomial(1)})  # fmt: skip
    place = "high", (0, 0, -LENGTH / 2)
    refuses(ConfigError, "'high' of 'pinion' is flat across the axis", meshed, flat, *place)


def test_functions_that_miss_the_deformation_are_told():
    """All nodes of a rim may move, more than harmonics and polynomials can follow."""
    body = rom.reduce(tube(INNER, RIM, LENGTH, (8, 1, 14)), method=rom.Guyan(), certify=False,
                      interfaces={"rim": "full"}, reference="mean-axis")  # fmt: skip
    with pytest.warns(RomWarning, match=r"of interface 'rim' of body 'pinion' is in no harmonic"):
        meshed(body)


@pytest.mark.fenicsx
def test_rims_of_meshed_geometries_keep_all_of_their_deformation(recwarn):
    """The centroid of a meshed rim lies beside the axis, and its functions hold a trace of that."""
    steel = rom.Material(E=210e9, nu=0.3, rho=7850.0)
    sizes = {"L": 0.27, "z_w": 0.105, "z_a": 0.05, "z_b": 0.22, "l_j": 0.03, "D": 0.066, "lc": 0.02}
    model = rom.fe.model("meshes/gear_shaft.geo", material=steel, parameters=sizes)
    body = rom.reduce(model, method=rom.Guyan(), reference="mean-axis", certify=False,
                      interfaces={"wheel": rom.FourierLegendre(1, 2)})  # fmt: skip
    part = rom.Mechanism().add_flexible("shaft", body, at=(0, 0, 0))
    rim = cylinder_of(part, part.marker("wheel"), np.eye(3)[2], np.eye(3)[0])
    assert rim.missed < 1e-5
    assert not [w for w in recwarn if "harmonic" in str(w.message)]
