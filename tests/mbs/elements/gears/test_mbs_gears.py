"""Gear meshes between bodies: forces of the plane model, kinematics, energy, loss of contact."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import root

import rom
from cases.components.geared import ORIGIN, Z, free_wheels
from cases.gear_unit import PlaneMesh
from cases.mbs.mechanisms import prepared, random_body, residual_at, tangents_at
from cases.mbs.parts import on_axle
from cases.mbs.tangents import by_position, by_velocity, elastic_forces, shifted
from cases.refusals import refuses
from rom import rotation
from rom.components.gear_mesh import Correction, GearPair, Mesh, stiffness_table
from rom.components.gear_mesh.gears.meshes import GEAR_MESHES_FAMILY
from rom.components.gear_mesh.gears.table import PHASE
from rom.errors import ConfigError, ModelError, SolverError

SPUR = GearPair((26, 40), 4e-3, 0.03, thinning=5e-5)
HELICAL = GearPair((26, 40), 4e-3, 0.05, helix=0.35, thinning=5e-5)
FLANKS = Correction(relief=(15e-6, 10e-6), extent=(2e-3, 3e-3), power=1.5, crowning=4e-6,
                    slope=5e-6, pitch=(1e-6 * np.arange(26) % 7, ()))  # fmt: skip
K = 1.3e10
STILL = np.zeros(12)
LAW = {"stiffness": K, "entry": 0.0, "conservative": False}
SUN = GearPair((24, 24), 2e-3, 0.02, thinning=2e-5)
RING = GearPair((24, -72), 2e-3, 0.02, thinning=2e-5)


def wheels(pair=SPUR, turned=None, **more):
    return free_wheels(pair, turned=turned, **LAW | more)


def wrench(packed, W, moved, v=STILL):
    """(12,) forces and moments of the teeth on both wheels, which moved (12,) from the datum."""
    residual_at(packed.system, W, shifted(packed, packed.q, moved), v, 0 * v, np.zeros(0))
    teeth = packed.elements[GEAR_MESHES_FAMILY]
    return W.wrench[[teeth.i[0], teeth.j[0]]].ravel()


@pytest.mark.parametrize("pair", [SPUR, HELICAL], ids=["spur", "helical"])
@pytest.mark.parametrize("phase", [0.0, 0.13, 0.7, 40.2])
def test_forces_in_the_plane_are_those_of_the_plane_model(pair, phase):
    """Wheels that move and turn in their plane: the same physics, in another frame."""
    table = stiffness_table(pair, force=3e5)
    mesh = PlaneMesh(pair, table, FLANKS, damping=2e-6)
    law = {"stiffness": table, "correction": FLANKS, "damping": 2e-6}
    packed, W = prepared(wheels(pair, **law, phase=phase))
    teeth, rng = packed.elements[GEAR_MESHES_FAMILY], np.random.default_rng(1)
    for side in (1.0, -1.0):
        q, v = np.zeros(12), np.zeros(12)
        for at in (0, 1, 6, 7):
            q[at], v[at] = 2e-5 * rng.normal(), 1e-3 * rng.normal()
        q[5], q[11], v[5], v[11] = 0.3 + side * 1.2e-3, -0.3 * 26 / 40, 1e-2, 3e-3
        wanted = mesh.forces(q, phase, v)
        found = wrench(packed, W, q, v)
        assert np.abs(wanted.force).max() > 1e3
        assert_allclose(found, wanted.force, atol=1e-8 * np.abs(wanted.force).max())
        assert W.power[2] == pytest.approx(wanted.lost, rel=1e-7)
        assert teeth.load[0] == pytest.approx(np.maximum(wanted.load, 0).sum(), rel=1e-8)
        there = shifted(packed, packed.q, q)
        tangents_at(packed.system, W, there, v, 0 * v, np.zeros(0), (0.0, 0.0, 1.0))
        size = np.abs(wanted.stiffness).max()
        assert_allclose(teeth.tangent[0], wanted.stiffness, atol=1e-8 * size)
        W.power[:] = 0.0


@pytest.mark.parametrize("pair", [SPUR, HELICAL], ids=["spur", "helical"])
def test_shifts_along_the_axis_and_tilts_add_what_they_do_in_first_order(pair):
    mesh = PlaneMesh(pair, K)
    packed, W = prepared(wheels(pair, phase=0.4))
    q = 1e-9 * np.random.default_rng(2).normal(size=12)
    q[[5, 11]] += 1e-4
    wanted = mesh.forces(q, 0.4).force
    found = wrench(packed, W, q)
    bare = np.zeros(12)
    bare[[5, 11]] = q[[5, 11]]
    change = wanted - mesh.forces(bare, 0.4).force
    assert_allclose(found - wanted, 0.0, atol=1e-3 * np.abs(change).max())


@pytest.mark.parametrize("helix", [0.35, -0.35, 0.0])
@pytest.mark.parametrize("turn", [3e-4, -3e-3])
def test_forces_of_helical_teeth_are_those_of_the_textbook(helix, turn):
    """ISO 21771: axial over tangential force tan(beta), radial tan(alpha_n) / cos(beta)."""
    pair = GearPair((26, 40), 4e-3, 0.05, helix=helix, thinning=5e-5)
    packed, W = prepared(wheels(pair, phase=0.4))
    q = turn * np.eye(12)[5]
    found = wrench(packed, W, q)
    r1, r2 = (z * 4e-3 / (2 * np.cos(helix)) for z in (26, 40))
    along = found[5] / r1
    assert along * turn < 0.0
    assert abs(along) > 1e4
    wanted = [-abs(along) * np.tan(np.radians(20.0)) / np.cos(helix), along, -along * np.tan(helix)]
    assert_allclose(found[:3], wanted, atol=1e-3 * abs(along))
    assert_allclose(found[6:9], -found[:3], atol=1e-9 * abs(along))
    assert_allclose(found[11] / r2, along, rtol=1e-3)


@pytest.mark.parametrize(("teeth", "helix", "b"), [((26, 40), 0.35, 0.05), ((20, 40), 0.0, 0.02)])
def test_contact_ratios_are_those_of_the_textbook(teeth, helix, b):
    """ISO 21771: paths outside both pitch points over the pitch, and b sin(beta) / (pi m_n)."""
    m, a_n = 4e-3, np.radians(20.0)
    pair = GearPair(teeth, m, b, helix=helix)
    a_t = np.arctan(np.tan(a_n) / np.cos(helix))
    r = np.array(teeth) * m / np.cos(helix) / 2
    beyond = np.sqrt((r + m) ** 2 - (r * np.cos(a_t)) ** 2) - r * np.sin(a_t)
    ratio = beyond.sum() * np.cos(helix) / (np.pi * m * np.cos(a_t))
    assert pair.contact_ratio == pytest.approx(ratio, rel=1e-9)
    assert pair.overlap == pytest.approx(b * np.sin(helix) / (np.pi * m), rel=1e-9)
    assert 1.2 < pair.contact_ratio < 2.0  # standard teeth of twenty degrees


def test_forces_turn_with_the_whole():
    turned = np.array([0.5, -0.3, 0.7, 0.2])
    turned = turned / np.linalg.norm(turned)
    A, found = rotation.matrix(turned), []
    q = np.zeros(12)
    q[[5, 11, 0, 7]] = 3e-4, 2e-4, 1e-5, -2e-5
    for how in (None, turned):
        packed, W = prepared(wheels(HELICAL, how, phase=0.2, correction=FLANKS))
        part = q.reshape(4, 3).copy()
        if how is not None:  # translations in the world, rotations in the body
            part[[0, 2]] = part[[0, 2]] @ A.T
        found.append(wrench(packed, W, part.ravel()).reshape(4, 3))
    assert np.abs(found[0]).max() > 100
    assert_allclose(found[1], found[0] @ A.T, atol=1e-8 * np.abs(found[0]).max())


@pytest.mark.parametrize("damping", [1e-5, 1.0], ids=["damped", "saturated"])
def test_tangents_are_derivatives_but_for_the_turning_of_forces(damping):
    packed, W = prepared(wheels(HELICAL, damping=damping, friction=0.1, transition_speed=0.1))
    q, v = np.zeros(12), 1e-4 * np.random.default_rng(0).normal(size=12)
    q[[5, 11]] = 1e-4, 0.0
    at = shifted(packed, packed.q, q)
    found, stiff = by_position(packed, W, at, v)
    assert_allclose(found, stiff, atol=3e-3 * np.abs(stiff).max())
    found, loss = by_velocity(packed, W, at, v)
    assert_allclose(found, loss, atol=1e-6 * np.abs(loss).max())


def geared(pair=SPUR, inertia=(2e-3, 9e-3), **more):
    mech = rom.Mechanism(gravity=(0, 0, 0))
    ends = [
        on_axle(mech, name, inertia=(J, J, J), axle=f"{name} axle", at=(x, 0, 0))
        for name, x, J in zip(("pinion", "gear"), (0.0, pair.distance), inertia, strict=True)
    ]
    mech.gear_mesh("mesh", *ends, axis=Z, pair=pair, **LAW | more)
    return mech


def test_the_mesh_vibrates_as_a_spring_along_the_line_of_action():
    """omega^2 = k (r_b1^2 / J_1 + r_b2^2 / J_2), k of all lines that touch under load."""
    J, pair = (2e-3, 9e-3), HELICAL
    mech = geared(pair, J)
    mech.torque("drive", mech.parts["pinion"].marker(ORIGIN), (0, 0, 50.0))
    mech.rotational_spring("coil", "gear axle", stiffness=1e5)
    state = rom.equilibrium(mech)
    angle = [rom.snapshot(mech, state).joint(f"{n} axle").angle[0] for n in ("pinion", "gear")]
    small = PlaneMesh(pair, K).forces(np.eye(12)[[5, 11]].T @ angle, 0.0).stiffness
    k = small[5, 5] / pair.rb[0] ** 2
    A = k * np.outer(pair.rb, pair.rb) + np.diag([0.0, 1e5])
    wanted = np.sqrt(np.linalg.eigvals(A / np.array(J)[:, None]))
    found = np.sort(rom.linearize(mech, state).frequencies) * 2 * np.pi
    assert_allclose(found, np.sort(wanted), rtol=1e-6)


def test_many_turns_keep_the_ratio_of_the_teeth_and_the_torque():
    mech = geared(damping=2e-5, correction=Correction(relief=(1e-5, 1e-5), extent=(2e-3, 2e-3)))
    mech.drive("speed", "pinion axle", lambda t: 60.0 * t, rate=lambda t: 60.0 + 0 * t)
    mech.motor("brake", "gear axle", lambda t, x, v: 80.0 - 2.0 * (v + 60.0 * 26 / 40))
    moved_ = rom.simulate(mech, t_end=2 * np.pi / 60 * 10, dt=2e-5, progress=False, save_every=20)
    first, second = (moved_.joint(f"{n} axle").angle for n in ("pinion", "gear"))
    assert first[-1] == pytest.approx(20 * np.pi)
    assert second[-1] + first[-1] * 26 / 40 == pytest.approx(0.0, abs=5e-4)
    late = slice(len(moved_.t) // 2, None)
    torque = moved_.drive_load("speed")[late].mean()
    assert abs(torque) == pytest.approx(80.0 * 26 / 40, rel=2e-2)


def test_teeth_that_lose_contact_hit_the_other_flank_and_keep_the_energy():
    """A pinion thrown through the backlash: no force between the flanks, no energy lost."""
    mech = geared(phase=0.12, entry=0.02, conservative=None)
    mech.parts["pinion"].omega[:] = 0, 0, -0.5
    sol = rom.simulate(mech, t_end=0.02, dt=1e-5, method="dop853", rtol=1e-10, progress=False)
    force = np.linalg.norm(sol.element("mesh").force[:, 0], axis=1)
    across = SPUR.backlash / (0.5 * SPUR.rb[0])  # time through the backlash
    assert (force[(sol.t > 1e-5) & (sol.t < 0.98 * across)] == 0).all() and force.max() > 100
    assert np.abs(sol.energy.balance).max() < 1e-6 * sol.energy.total[0]
    # after the stroke: elastic impact along the line of action
    J, rb = np.array([2e-3, 9e-3]), SPUR.rb
    m = J / rb**2
    closing = -0.5 * rb[0] * np.array([(m[0] - m[1]) / m.sum(), 2 * m[0] / m.sum()])
    after = np.argmax((force == 0) & (sol.t > 1.1 * across))
    found = [sol.omega("pinion")[after, 2] * rb[0], -sol.omega("gear")[after, 2] * rb[1]]
    assert_allclose(found, closing, rtol=1e-3)


@pytest.mark.parametrize("turn", [1e-3, -3e-3])
@pytest.mark.parametrize("away", [0.0, 2e-4, -5e-5])
def test_how_deep_rigid_flanks_are_in_each_other(turn, away):
    """Flanks in front, or behind by the backlash; wheels that stand apart open both."""
    packed, W = prepared(wheels())
    q = np.zeros(12)
    q[5], q[6] = turn, away
    wrench(packed, W, q)
    one, two = (np.arccos(SPUR.rb.sum() / (SPUR.distance + x)) for x in (0.0, away))
    opened = SPUR.rb.sum() * (np.tan(two) - two - np.tan(one) + one)
    closed = max(SPUR.rb[0] * turn, -SPUR.rb[0] * turn - SPUR.backlash)
    found = packed.elements[GEAR_MESHES_FAMILY].approach[0]
    assert found == pytest.approx(closed - opened, rel=1e-9)


def test_wheels_pressed_into_each_other_are_named():
    mech = wheels()
    for name, part in mech.parts.items():
        mech.prismatic(f"{name} slides", mech.ground.marker(part.at), name, axis=(1, 0, 0))
    mech.drive("press", "gear slides", lambda t: -t, rate=lambda t: -1.0 + 0 * t)
    mech.drive("hold", "pinion slides", lambda t: 0.0 * t)
    refuses(SolverError, "wheels of 'mesh' are so close", rom.simulate, mech, t_end=0.1, dt=1e-3)


def test_what_is_no_mesh_is_refused():
    mech = rom.Mechanism()
    a, b = (mech.add_rigid(n, mass=1.0, inertia=(1e-3,) * 3, at=(x, 0, 0)).marker(ORIGIN)
            for n, x in (("a", 0.0), ("b", SPUR.distance)))  # fmt: skip
    given, late = {"axis": Z, "pair": SPUR, "stiffness": K}, Correction(pitch=((0.0, 1.0), ()))
    for other, more, words in ((b, {"axis": (0, 0, 0)}, "axis of mesh has length zero"),
                               (b, {"stiffness": []}, "stiffness of the teeth of 'mesh'"),
                               (b, {"correction": late}, "pitch errors of 'mesh' has shape"),
                               (a, {}, "connects body 'a' with itself")):  # fmt: skip
        refuses(ConfigError, words, mech.gear_mesh, "mesh", a, other, **given | more)
    assert not mech.gear_meshes


def test_an_internal_gear_is_one_of_negative_radii():
    """By hand: r_b2 - r_b1 = a cos(alpha), and the path ends at the tips."""
    rb, ra = 72e-3 * np.cos(np.radians(20)), 70e-3
    assert RING.distance == pytest.approx(-0.048) and RING.alpha == pytest.approx(np.radians(20))
    tangents = 0.048 * np.sin(np.radians(20))  # the point of tangency of the ring is behind T1
    first = np.sqrt(ra**2 - rb**2) - tangents
    last = np.sqrt(26e-3**2 - (24e-3 * np.cos(np.radians(20))) ** 2)
    assert_allclose(RING.path, [first, last], rtol=1e-12)
    assert RING.backlash == pytest.approx(2e-5)
    refuses(ModelError, "not known; give numbers", stiffness_table, RING, force=1e5)
    refuses(ModelError, r"use Mechanism\.gear_mesh", Mesh, RING, K)


def gaps_behind(z1, z2, addendum):
    """Between the corner of a tooth and the ring it leaves, after its last touch [rad]."""

    def involute_at(radius, z):
        beta = np.arccos(np.clip(z / 2 * np.cos(np.pi / 9) / radius, None, 1.0))
        return np.tan(beta) - beta - np.tan(np.pi / 9) + np.pi / 9

    tip, inside, a = z1 / 2 + addendum, z2 / 2 - addendum, (z2 - z1) / 2
    turn = np.linspace(0.0, 1.5, 200_001)
    corner = tip * np.exp(1j * (turn - involute_at(tip, z1))) + a
    radius = np.abs(corner)
    end = np.argmax(radius < inside)
    flank = turn * z1 / z2 - involute_at(radius, z2)
    gap = (flank - np.angle(corner))[:end]
    last = np.tan(np.arccos(z1 / 2 * np.cos(np.pi / 9) / tip)) - np.tan(np.pi / 9)
    return gap[turn[:end] > last + 1e-3]


@pytest.mark.parametrize("addendum", [0.8, 1.0])
@pytest.mark.parametrize("z1", [30, 40, 60])
def test_tips_inside_a_ring_pass_each_other_or_are_refused(z1, addendum):
    """Followed along the path of a corner, in modules."""
    seen = set()
    for more in range(6, 13):
        gaps = gaps_behind(z1, z1 + more, addendum)
        try:
            pair = GearPair((z1, -z1 - more), 1.0, 1.0, addendum=addendum)
        except ModelError as refused:
            assert "interfere" in str(refused) or "no involute" in str(refused)
            assert gaps.min() < 0 or "away from the path" not in str(refused)
            seen.add("away from the path" in str(refused))
        else:
            assert gaps.min() > 0
            assert pair.tip_clearance == pytest.approx(gaps[-1], abs=2e-5)
            seen.add(None)
    assert {True, None} <= seen


def planetary():
    """Sun driven, ring held by a stiff coil, planets on a carrier that is braked."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    for name, J in (("sun", 1e-4), ("ring", 2e-3), ("carrier", 5e-4)):
        on_axle(mech, name, mass=0.2, inertia=(J, J, J), axle=f"{name} axle")
    mech.rotational_spring("housing", "ring axle", stiffness=1e6, damping=20.0)
    law = {"stiffness": 1.3e10, "damping": 2e-5}
    for k, angle in enumerate(2 * np.pi / 3 * np.arange(3)):
        at, planet = 0.048 * np.array([np.cos(angle), np.sin(angle), 0.0]), f"planet {k}"
        mech.add_rigid(planet, mass=0.2, inertia=(5e-5,) * 3, at=at)
        mech.revolute(f"pin {k}", mech.part("carrier").marker(at), planet, axis=Z)
        mech.gear_mesh(f"sun {k}", "sun", planet, axis=Z, pair=SUN, phase=angle, **law)
        mech.gear_mesh(f"ring {k}", planet, "ring", axis=(0, 0, -1), pair=RING, phase=0.1, **law)
    mech.drive("motor", "sun axle", lambda t: 80.0 * t, rate=lambda t: 80.0 + 0 * t)
    wanted = 80.0 * 24 / (24 + 72)
    mech.motor("brake", "carrier axle", lambda t, x, v: -40.0 - 1.0 * (v - wanted))
    return mech


def test_a_planetary_train_turns_by_willis_and_shares_its_torque():
    """Ring held: carrier / sun = z_s / (z_s + z_r); torques as 1 : 4 : 3."""
    mech = planetary()
    sol = rom.simulate(mech, t_end=0.2, dt=1e-5, progress=False, save_every=20)
    sun, carrier = (sol.joint(f"{n} axle").angle for n in ("sun", "carrier"))
    assert carrier[-1] == pytest.approx(sun[-1] * 24 / 96, abs=2e-3)
    turned = sol.joint("pin 0").angle[-1]  # against the carrier: minus that of the sun against it
    assert turned == pytest.approx(-(sun[-1] - carrier[-1]), abs=5e-3)
    late = slice(len(sol.t) // 2, None)
    drive = sol.drive_load("motor")[late].mean()
    assert abs(drive) == pytest.approx(40.0 / 4, rel=2e-2)
    held = sol.element("housing").along[late].mean()
    assert abs(held) == pytest.approx(40.0 * 3 / 4, rel=2e-2)
    meshes = [sol.element(f"sun {k}").force[late, 0] for k in range(3)]
    shares = [np.linalg.norm(force, axis=1).mean() for force in meshes]
    assert np.ptp(shares) < 0.1 * np.mean(shares)
    assert np.mean(shares) * 3 * SUN.rb[0] == pytest.approx(10.0, rel=2e-2)


def flank(centre, radius, start, length, turn):
    """Points of an involute and its normals by the angle where the string leaves the circle.

    At the angle ``start`` the string is so long; then the wheel turns.
    """

    def at(psi):
        e = np.array([np.cos(psi + turn), np.sin(psi + turn)])
        string = np.array([-e[1], e[0]])
        return centre + radius * e + (length - radius * (psi - start)) * string, string

    return at


def approach_of_curves(pair, s, moved_to, turns):
    """How far two involutes that touch at s from T1 overlap along their common normal [m]."""
    alpha, r1, r2 = pair.alpha, pair.rb[0], abs(pair.rb[1])
    behind = pair.tangents if not pair.internal else -abs(pair.tangents)
    start, length = (-alpha, s - behind) if pair.internal else (np.pi - alpha, behind - s)
    one = flank(np.zeros(2), r1, -alpha, s, turns[0])
    two = flank(np.array([pair.distance, 0.0]) + moved_to, r2, start, length, turns[1])

    def off(angles):
        (P1, n1), (P2, n2) = one(angles[0]), two(angles[1])
        D = P2 - P1
        return [D[0] * n1[1] - D[1] * n1[0], 1e-3 * (n1[0] * n2[1] - n1[1] * n2[0])]

    angles = root(off, [-alpha - turns[0], start - turns[1]], tol=1e-14).x
    (P1, n1), (P2, _) = one(angles[0]), two(angles[1])
    return -float((P2 - P1) @ n1)


@pytest.mark.parametrize("pair", [SPUR, RING], ids=["external", "internal"])
@pytest.mark.parametrize("seed", range(4))
def test_the_approach_is_that_of_two_involute_curves(pair, seed):
    rng = np.random.default_rng(seed)
    A, B = pair.path
    s = A + (0.45 + 0.1 * rng.random()) * (B - A)
    packed, W = prepared(wheels(pair, phase=s / pair.rb[0]))
    q = np.zeros(12)
    q[6:8] = 2e-4 * rng.normal(size=2)
    q[6] = abs(q[6])  # back flanks apart
    q[11] = 1e-3 * rng.normal()
    q[5] = (1e-5 - approach_of_curves(pair, s, q[6:8], (0.0, q[11]))) / pair.rb[0]
    overlap = approach_of_curves(pair, s, q[6:8], (q[5], q[11]))
    assert overlap == pytest.approx(1e-5, rel=0.1)
    wrench(packed, W, q)
    load = packed.elements[GEAR_MESHES_FAMILY].load[0]
    lines = round(load / (K * pair.width * overlap))  # all of them overlap alike
    assert lines in (1, 2)
    assert load == pytest.approx(lines * K * pair.width * overlap, rel=1e-7)


def test_teeth_take_up_their_load_evenly_and_bear_as_much_as_at_once():
    """Over a pitch the mean force is the same; the largest step of it falls with the entry."""
    pair, q, phases = SPUR, np.zeros(12), np.linspace(0, 2 * np.pi / 26, 2000, endpoint=False)
    q[5] = 1e-4
    loads = {}
    for entry in (0.0, 0.1):
        found, (packed, W) = [], prepared(wheels(pair, entry=entry))
        mesh = packed.elements[GEAR_MESHES_FAMILY]
        for phase in phases:
            mesh.size[0, PHASE] = phase
            wrench(packed, W, q)
            found.append(mesh.load[0])
        loads[entry] = np.array(found)
    one = K * pair.width * 1e-4 * pair.rb[0]  # of a line
    assert loads[0.1].mean() == pytest.approx(loads[0.0].mean(), rel=1e-3)
    steps = {entry: np.abs(np.diff(load)).max() for entry, load in loads.items()}
    assert steps[0.0] == pytest.approx(one, rel=1e-9)
    assert steps[0.1] == pytest.approx(one / (0.1 * 2000), rel=1e-2)


# Lin and Parker, Analytical characterization of the unique properties of planetary gear free
# vibration, J. Vib. Acoust. 121 (1999) 316: masses and inertias over squared radii [kg]
PUBLISHED = {
    "sun": (0.4, 0.39), "ring": (2.35, 3.0), "carrier": (5.43, 6.29), "planet": (0.66, 0.61),
}  # fmt: skip
FREQUENCIES = {  # number of planets -> [Hz]: rotational modes, then pairs of translational ones
    3: ((1475.7, 1930.3, 2658.3, 7462.8, 11775.3), (743.2, 1102.4, 1896, 2276.4, 6986.3, 9647.9)),
    4: ((1536.6, 1970.6, 2625.7, 7773.6, 13071.1), (727, 1091, 1892.8, 2342.5, 7189.9, 10437.6)),
}
BODIES = ("sun", "ring", "carrier")


def lumped(planets, alpha, mesh=5e8, support=1e8, held=(0.0, 1e9, 0.0)):
    """Mass and stiffness of plane bodies with coordinates (x, y, u = r theta), planets last."""
    n = 3 * (3 + planets)
    K, rows = np.zeros((n, n)), []
    for k, hold in enumerate(held):
        rows += [(support, {3 * k: 1.0}), (support, {3 * k + 1: 1.0}), (hold, {3 * k + 2: 1.0})]
    sun, ring, carrier = 0, 3, 6
    for p in range(planets):
        angle, at = 2 * np.pi * p / planets, 9 + 3 * p
        c, t = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
        out = np.sin(alpha) * c + np.cos(alpha) * t
        inn = np.sin(alpha) * c - np.cos(alpha) * t
        rows.append((mesh, {sun: out[0], sun + 1: out[1], sun + 2: 1.0,
                            at: -out[0], at + 1: -out[1], at + 2: 1.0}))  # fmt: skip
        rows.append((mesh, {at: inn[0], at + 1: inn[1], at + 2: -1.0,
                            ring: -inn[0], ring + 1: -inn[1], ring + 2: 1.0}))  # fmt: skip
        for d in range(2):
            rows.append((support, {carrier + d: 1.0, carrier + 2: t[d], at + d: -1.0}))
    for k, row in rows:
        v = np.zeros(n)
        v[list(row)] = list(row.values())
        K += k * np.outer(v, v)
    sizes = [PUBLISHED[name] for name in (*BODIES, *planets * ["planet"])]
    M = np.array([x for mass, inertia in sizes for x in (mass, mass, inertia)])
    return M, K


def frequencies_of(M, K):
    lam = np.linalg.eigvals(K / M[:, None]).real
    return np.sqrt(np.maximum(np.sort(lam), 0)) / (2 * np.pi)


@pytest.mark.parametrize("planets", [3, 4])
def test_the_lumped_planetary_train_is_that_of_lin_and_parker(planets):
    found = frequencies_of(*lumped(planets, np.radians(24.6)))
    turning, moving = FREQUENCIES[planets]
    single = [1808.2, 5963.8, 6981.7] * (planets - 3)  # modes of planets alone
    wanted = np.sort([0.0, *turning, *np.repeat(moving, 2), *single])
    assert_allclose(found, wanted, rtol=2e-4, atol=1.0)


@pytest.mark.parametrize("planets", [3, 4])
def test_a_planetary_train_vibrates_as_its_lumped_model(planets):
    """All plane modes under a light load, with the masses and springs of Lin and Parker."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    radius = {"sun": SUN.rb[0], "ring": abs(RING.rb[1]), "carrier": 0.048, "planet": SUN.rb[1]}

    def body(name, at=ORIGIN):
        mass, inertia = PUBLISHED[name.split()[0]]
        J = inertia * radius[name.split()[0]] ** 2
        mech.add_rigid(name, mass=mass, inertia=(J, J, J), at=at)
        mech.planar(f"{name} plane", mech.ground.marker(at), name, normal=Z)

    held = {"sun": 0.0, "ring": 1e9 * radius["ring"] ** 2, "carrier": 1e6 * radius["carrier"] ** 2}
    for name, turning in held.items():
        body(name)
        mech.bushing(f"{name} support", "ground", name, stiffness=(1e8, 1e8, 0, 0, 0, turning))
    law = LAW | {"stiffness": 5e8 / SUN.width}
    for k in range(planets):
        angle, planet = 2 * np.pi * k / planets, f"planet {k}"
        at = 0.048 * np.array([np.cos(angle), np.sin(angle), 0.0])
        body(planet, at)
        pin = mech.part("carrier").marker(at)
        mech.bushing(f"pin {k}", pin, planet, stiffness=(1e8, 1e8, 0, 0, 0, 0))
        mech.gear_mesh(f"sun {k}", "sun", planet, axis=Z, pair=SUN, phase=one_line(SUN), **law)
        phase = one_line(RING)
        mech.gear_mesh(f"ring {k}", planet, "ring", axis=(0, 0, -1), pair=RING, phase=phase, **law)
    mech.torque("drive", "sun", (0, 0, 0.1))
    found = np.sort(rom.linearize(mech, rom.equilibrium(mech)).frequencies)
    wanted = frequencies_of(*lumped(planets, np.radians(20), held=(0.0, 1e9, 1e6)))
    assert_allclose(found, wanted, rtol=1e-5)


def one_line(pair):
    """Phase at which one pair of teeth touches, in the middle of its path."""
    return 0.5 * sum(pair.path) / pair.rb[0]


def test_flexible_wheels_feel_their_teeth_in_all_their_shapes():
    """Forces are the gradient of the energy, to the first order in which shapes tilt wheels."""
    rng, pair = np.random.default_rng(6), SPUR
    mech, ends = rom.Mechanism(gravity=(0, 0, 0)), []
    for name, x in (("pinion", 0.0), ("gear", pair.distance)):
        body = random_body(rng, r=3, damped=False)
        at = np.array([x, 0.0, 0.0]) - body.marker("a").point
        ends.append(mech.add_flexible(name, body, at=at).marker("a"))
    mech.gear_mesh("mesh", *ends, axis=Z, pair=pair, phase=one_line(pair), **LAW)
    packed, W = prepared(mech)
    q = shifted(packed, packed.q, 1e-7 * rng.normal(size=packed.v.size))
    turned = 1e-4 * np.eye(packed.v.size)[5]  # working flanks close by the turn of the pinion
    q = shifted(packed, q, turned)
    stiffness = packed.elements[GEAR_MESHES_FAMILY].stiffness
    gradient, found = elastic_forces(packed, W, q, stiffness, step=1e-8)
    assert np.abs(gradient[6:9]).max() > 1e-2 * np.abs(gradient).max()
    assert_allclose(found, gradient, atol=1e-4 * np.abs(gradient).max())


def test_what_falls_beside_gears_is_called_unstable():
    """Teeth have a potential: statics say what stands on its head."""
    mech = geared()
    rod = mech.add_rigid("rod", mass=1.0, inertia=(0.01,) * 3, at=(1, 1, 0))
    mech.gravity = (0, -9.81, 0)
    mech.revolute("hinge", mech.ground.marker((1, 0, 0)), rod.marker((0, -1, 0)), axis=Z)
    for name in ("pinion", "gear"):
        mech.rotational_spring(f"spring of {name}", f"{name} axle", stiffness=10.0)
    with pytest.warns(rom.RomWarning, match="the equilibrium is unstable: body 'rod'"):
        rom.equilibrium(mech)
