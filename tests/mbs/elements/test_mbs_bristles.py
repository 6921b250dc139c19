"""Friction that holds by springs along the surfaces: rest, slip, loops, energy, momenta."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import trapezoid

import rom
from cases.mbs.mechanisms import prepared, tangents_at
from cases.mbs.parts import ORIGIN, X, Y, Z, on_guide
from cases.mbs.tangents import forces_at
from cases.refusals import refused, refuses
from rom.rotation import exp, matrix, multiply

g, MASS, HEIGHT, MU, STIFFNESS = 9.81, 2.0, 0.05, 0.5, 2e4
LAW = rom.mbs.Impact(1e5, exponent=1.0, damping=30.0, mu=MU, tangential_stiffness=STIFFNESS,
             tangential_damping=100.0)  # fmt: skip
FEET = {f"foot {k}": (0.1 * np.cos(a), 0.1 * np.sin(a), -HEIGHT)
        for k, a in enumerate(2 * np.pi / 3 * np.arange(3))}  # fmt: skip


def block(angle, law=LAW, speed=0.0):
    """A block on three points, on an incline down along x."""
    mech = rom.Mechanism(gravity=(g * np.sin(angle), 0, -g * np.cos(angle)))
    sink = MASS * g * np.cos(angle) / 3 / law.stiffness
    mech.add_rigid("block", mass=MASS, inertia=(0.01,) * 3, at=(0, 0, HEIGHT + 1e-6 - sink),
                   velocity=(speed, 0, 0), markers=FEET)  # fmt: skip
    for foot in FEET:
        mech.sphere_on_plane(foot, "ground", f"block.{foot}", law, normal=Z, radius=1e-6)
    return mech


def gone(sol):
    """(n_t,) mean way of the feet down the incline."""
    x = sum(sol.position("block", foot)[:, 0] for foot in FEET) / len(FEET)
    return x - x[0]


@pytest.mark.parametrize("how", [{"dt": 1e-3}, {"dt": 4e-3, "method": "bdf"},
                                 {"dt": 1e-2, "method": "dop853"}, {"rtol": 1e-5}])  # fmt: skip
def test_a_block_below_the_angle_of_friction_rests(how):
    """It gives way by m g sin(a) / (3 k) on points as feet, and does not creep."""
    angle = 0.15
    sol = rom.simulate(block(angle), t_end=0.6, **how)
    assert_allclose(gone(sol)[-1], MASS * g * np.sin(angle) / (3 * STIFFNESS), rtol=1e-5)
    # chosen steps limit the errors of places only
    assert_allclose(sol.velocity("block")[-1], 0.0, atol=1e-6 if "rtol" in how else 1e-8)


def test_equilibria_rest_where_springs_are_remembered():
    """From where bodies were added, the same place; from the end of a run, that end; pushed from
    there, further by force over stiffness."""
    mech, push = block(0.15), 1.0
    mech.force("push", mech.part("block").marker((0, 0, -HEIGHT)),
               lambda t: (push if t > 2.0 else 0.0, 0.0, 0.0))  # fmt: skip
    sol = rom.simulate(mech, t_end=0.6, dt=1e-3)
    for start in (None, sol.final):
        assert_allclose(rom.equilibrium(mech, state=start).q[:3], sol.q[-1, :3], atol=2e-9)
    sliding = replace(sol.final, v=np.append(0.2, sol.v[-1][1:]), memory=None)
    moved = rom.simulate(mech, state=sliding, t_end=1.2, dt=1e-3)
    assert_allclose([moved.energy.damping[0], moved.energy.balance[0]], 0.0, atol=1e-15)
    slid = moved.final
    again = rom.equilibrium(mech, state=slid)
    assert slid.q[0] > 1e-3
    assert_allclose(again.q[:3], slid.q[:3], atol=1e-9)
    pushed = rom.snapshot(mech, rom.equilibrium(mech, state=slid, t=3.0))
    way = sum(pushed.position("block", foot) - moved.position("block", foot)[-1] for foot in FEET)
    assert_allclose(way[0, 0] / 3, push / (3 * STIFFNESS), rtol=1e-4)
    lowest = rom.linearize(mech, again).frequencies[0]
    assert lowest > 5.0  # held in all directions


def test_above_the_angle_it_slides_with_the_acceleration_of_coulomb():
    angle = 0.7
    sol = rom.simulate(block(angle), t_end=0.5, dt=1e-3)
    late = sol.t > 0.3
    slope = np.polyfit(sol.t[late], sol.velocity("block")[late, 0], 1)[0]
    assert_allclose(slope, g * (np.sin(angle) - MU * np.cos(angle)), rtol=1e-5)


def test_a_block_that_slides_sticks_after_its_braking_way():
    """v^2 / (2 mu g); energy: what it had is lost but for what its springs keep."""
    speed = 0.5
    sol = rom.simulate(block(0.0, speed=speed), t_end=0.4, dt=2e-4)
    assert_allclose(gone(sol)[-1], speed**2 / (2 * MU * g), rtol=0.02)
    assert_allclose(sol.velocity("block")[-1], 0.0, atol=1e-8)
    e = sol.energy
    assert_allclose(e.damping[-1], 0.5 * MASS * speed**2, rtol=1e-3)
    assert_allclose(e.balance, 0.0, atol=2e-5 * e.kinetic[0])


def sled(law, load, x=0.0):
    """A ball that slides along x, pressed on a plane by ``load``."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    sink = (load / law.stiffness) ** (1.0 / law.exponent)
    place = (x, 0, 0.01 - sink)
    made = on_guide(mech, "sled", mass=MASS, at=place, base=place, guide="way")
    mech.sphere_on_plane("pad", mech.ground.marker(ORIGIN), made, law, normal=Z, radius=0.01)
    return mech


def dragged(path, law, load, **how):
    mech = sled(law, load)
    mech.drive("motor", "way", path)
    return rom.simulate(mech, **how)


def test_the_loop_of_a_spring_and_slider_has_the_area_of_jenkins():
    """4 mu N (A - mu N / k) a cycle; it is the work of the drive and what is lost, both."""
    load, A, k = 10.0, 2e-3, 5e3
    law = replace(LAW, tangential_stiffness=k, tangential_damping=0.0)
    sol = dragged(lambda t: A * (np.cos(2 * np.pi * t) - 1), law, load, t_end=3.0, dt=2e-4)
    f, x = sol.element("pad").force[:, 1, 0], sol.position("sled")[:, 0]
    last = sol.t >= 2.0 - 1e-9
    area = 4 * MU * load * (A - MU * load / k)
    assert_allclose(np.abs(f).max(), MU * load, rtol=1e-8)
    assert_allclose(-trapezoid(f[last], x[last]), area, rtol=1e-5)
    e = sol.energy
    for work in (e.drives, e.damping):
        assert_allclose(work[last][-1] - work[last][0], area, rtol=1e-5)
    said = sol.element("pad")
    assert_allclose(trapezoid(said.lost[last], sol.t[last]), area, rtol=1e-3)
    elastic = law.stiffness * (load / law.stiffness) ** 2 / 2
    assert_allclose(said.energy - elastic, f**2 / (2 * k), atol=1e-12)


def test_below_the_limit_a_spring_gives_back_all_and_its_damper_takes_its_share():
    """pi c omega A^2 a cycle."""
    load, A, c = 10.0, 0.5e-3, 20.0
    law = replace(LAW, tangential_stiffness=5e3, tangential_damping=c)
    sol = dragged(lambda t: A * (1 - np.cos(2 * np.pi * t)), law, load, t_end=2.0, dt=5e-4)
    e, last = sol.energy, sol.t >= 1.0 - 1e-9
    assert_allclose(np.ptp(e.damping[last]), np.pi * c * 2 * np.pi * A**2, rtol=1e-4)
    assert_allclose(np.ptp(e.strain), 0.5 * 5e3 * (2 * A) ** 2, rtol=1e-6)
    assert_allclose(np.diff(e.damping).min(), 0.0, atol=1e-9)


def test_a_mass_on_a_spring_loses_two_limits_of_its_amplitude_each_half_swing():
    """Released at 5.5 mu N / K it turns at 3.5 and 1.5, and sticks at 0.5 for good."""
    load, K = 10.0, 1e3
    d = MU * load / K
    law = replace(LAW, tangential_stiffness=1e6, tangential_damping=300.0)
    mech = sled(law, load, x=5.5 * d)
    hook = mech.ground.marker((-1.0, 0, mech.part("sled").at[2]))
    mech.spring_damper("spring", hook, "sled", stiffness=K, free_length=1.0)
    sol = rom.simulate(mech, t_end=0.6, dt=5e-5)
    x, e = sol.position("sled")[:, 0] / d, sol.energy
    assert_allclose([x[0], x.min()], [5.5, -3.5], rtol=1e-3)
    assert_allclose(x[sol.t > 0.45], 0.5, atol=5e-3)
    assert_allclose(x[sol.t > 0.58], x[-1], atol=1e-8)
    assert_allclose(e.damping[-1], 0.5 * K * d**2 * (5.5**2 - 0.5**2), rtol=1e-3)
    assert_allclose(e.balance, 0.0, atol=1e-6 * e.strain[0])


def test_a_ball_rolls_down_an_incline_with_five_sevenths():
    """Friction is 2/7 m g sin(a), which stretches the spring; the touching point runs around."""
    m, radius, angle = 0.5, 0.05, 0.2
    mech = rom.Mechanism(gravity=(g * np.sin(angle), 0, -g * np.cos(angle)))
    law = replace(LAW, tangential_damping=5.0)
    sink = m * g * np.cos(angle) / law.stiffness
    J = 0.4 * m * radius**2
    mech.add_rigid("ball", mass=m, inertia=(J,) * 3, at=(0, 0, radius - sink))
    mech.sphere_on_plane("floor", "ground", "ball", law, normal=Z, radius=radius)
    sol = rom.simulate(mech, t_end=1.0, dt=5e-4)
    assert_allclose(sol.velocity("ball")[-1, 0], 5 / 7 * g * np.sin(angle), rtol=1e-4)
    force = 2 / 7 * m * g * np.sin(angle)
    said = sol.element("floor")
    assert_allclose(said.force[-1, 1, 0], -force, rtol=1e-3)
    normal = m * g * np.cos(angle)
    stored = said.energy[-1] - normal**2 / (2 * law.stiffness)
    assert_allclose(stored, force**2 / (2 * STIFFNESS), rtol=5e-3)
    assert sol.omega("ball")[-1, 1] * radius > 0.99 * sol.velocity("ball")[-1, 0]
    assert_allclose(sol.energy.balance, 0.0, atol=1e-6 * sol.energy.kinetic.max())


def pair(law, shove=0.0, spin=(0.0, 0.0, 0.0)):
    """Two bars across each other, free in space, drawn together by a spring of no length."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    turning = np.array(spin)
    for name, z, v in (("one", 0.0, 0.0), ("two", 0.0199, shove)):
        mech.add_rigid(name, mass=0.1, inertia=(1e-5,) * 3, at=(0, 0, z), omega=turning,
                       velocity=np.cross(turning, (0, 0, z)) + v * X)  # fmt: skip
    sizes = dict.fromkeys(("radius1", "radius2"), 0.01) | dict.fromkeys(("length1", "length2"), 0.1)
    mech.capsule_on_capsule("touch", "one", "two", law, axis1=X, axis2=Y, **sizes)
    mech.spring_damper("clamp", "one", "two", stiffness=1e3, free_length=0.01)
    return mech


def test_bars_that_rub_keep_their_momenta_and_energy():
    law = replace(LAW, tangential_damping=2.0, damping=5.0)
    sol = rom.simulate(pair(law, shove=0.05, spin=(1.0, 2.0, 3.0)), t_end=0.3, dt=5e-5)
    linear, angular = sol.momentum
    assert_allclose(linear, linear[:1].repeat(len(linear), 0), atol=1e-12)
    assert_allclose(angular, angular[:1].repeat(len(angular), 0), atol=1e-8)
    e = sol.energy
    assert e.damping[-1] > 1e-5
    assert_allclose(e.balance, 0.0, atol=1e-6 * e.total[0])
    assert rom.audit(sol).ok, rom.audit(sol)


def remembered(mech):
    """Its memory after the bodies touched where they were added, and its coordinates there."""
    packed, W = prepared(mech)
    looked_at(packed, W, packed.q)
    return packed, W, packed.q.copy()


def looked_at(packed, W, q, *, keep=True, v=None):
    """The residual, of bodies at rest unless they move, which is remembered."""
    lam = np.zeros(W.value.size)
    found = forces_at(packed, W, q, np.zeros(packed.v.size) if v is None else v, lam=lam)
    if keep:
        W.base[W.x.size :] = W.fresh
    return found


def test_springs_turn_with_the_bodies():
    packed, W, q = remembered(pair(LAW))
    q[7:9] += 2e-6, -1e-6  # the second one aside
    force, clamp = looked_at(packed, W, q, keep=False)[6:9], 1e3 * (0.0199 - 0.01) / 0.0199
    assert_allclose(force[:2], (STIFFNESS + clamp) * np.array([2e-6, -1e-6]), rtol=1e-6)
    p = exp(np.array([0.3, -1.0, 0.7]))
    for at in (0, 7):
        q[at : at + 3] = matrix(p) @ q[at : at + 3]
        q[at + 3 : at + 7] = multiply(p, q[at + 3 : at + 7])
    assert_allclose(looked_at(packed, W, q)[6:9], matrix(p) @ force, rtol=1e-9)


def test_what_parts_forgets():
    """Lifted and put down elsewhere it is drawn by the clamp alone; not lifted, by friction too."""
    for lift, held in ((1e-3, 0.0), (0.0, STIFFNESS)):
        packed, W, q = remembered(pair(LAW))
        for up, aside in ((lift, 0.0), (-lift, 2e-6)):
            q[[7, 9]] += aside, up
            force = looked_at(packed, W, q)
        clamp = 1e3 * (0.0199 - 0.01) / 0.0199
        assert_allclose(force[6], 2e-6 * (held + clamp), rtol=1e-6)
        assert_allclose(packed.kept(W.base[None]), 0.5 * held * 2e-6**2, rtol=1e-6, atol=1e-30)
        q[9] += 1e-3
        looked_at(packed, W, q)
        assert packed.kept(W.base[None]) == 0.0


def test_what_slid_to_the_limit_sticks_there_when_it_is_looked_at_again():
    """Stiff whichever way it slid; and the same force."""
    for angle in np.linspace(0.0, 6.0, 30):
        packed, W, q = remembered(pair(LAW))
        q[7:9] += 2e-3 * np.array([np.cos(angle), np.sin(angle)])
        slid, none = looked_at(packed, W, q), np.zeros(packed.v.size)
        tangents_at(packed.system, W, q, none, none, np.zeros(0), (0.0, 0.0, 1.0))
        assert_allclose(W.residual, slid, rtol=1e-12, atol=1e-14)
        assert np.linalg.eigvalsh(W.Kt[6:8, 6:8])[0] > 0.9 * STIFFNESS


def test_the_limit_is_that_of_the_whole_pressure_while_bodies_meet():
    """mu k depth (1 + damping v), on a ball that comes down while it slides."""
    load, v = 10.0, 0.1
    packed, W, q = remembered(sled(LAW, load))
    q[0] += 1e-2
    pressure, force = load * (1 + LAW.damping * v), looked_at(packed, W, q, v=-v * np.eye(6)[2])
    assert_allclose(force[:3], [MU * pressure, 0.0, -pressure], rtol=1e-9, atol=1e-9)


test_wrong_springs_are_refused = refused(
    (lambda: replace(LAW, tangential_stiffness=None), "tangential_damping = 100 needs a tang"),
    (lambda: replace(LAW, mu=0.0), "without friction holds nothing"),
    error=rom.ConfigError,
)


def test_periodic_motions_have_no_memory_of_it():
    mech = sled(LAW, 10.0)
    mech.drive("motor", "way", lambda t: 1e-3 * np.sin(2 * np.pi * t))
    refuses(rom.ModelError, "'pad' remembers", rom.periodic_motion, mech, period=1.0)
