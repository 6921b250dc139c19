"""Rods in floating frames: the motion in space is that of the absolute form, whatever the frame."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.mbs import floating_rod as floating
from cases.structures.frames import Section, cantilever
from rom import rotation
from rom.components import cosserat
from rom.components.cosserat import energy

LOAD = {"tip": (30.0, -20.0, 10.0), "tip_moment": (10.0, 20.0, -15.0), "weight": (0, 0, -9.81)}
VELOCITY, OMEGA = (1.0, 2.0, 0.0), (1.0, -2.0, 3.0)
T = (0.1, 0.2)


@pytest.fixture(scope="module")
def rod():
    one = cosserat.straight(2.0, 2, stretch=(400, 500, 600), bend=(20, 30, 25), mass=1.0,
                            inertia=(0.2, 0.3, 0.4), viscosity=1e-3)  # fmt: skip
    return one._replace(inertia=cosserat.body(one).frames.inertia)


@pytest.fixture(scope="module")
def absolute(rod):
    """The same rod in a mechanism, by the explicit method with its tolerance of 1e-12."""
    mech = rom.Mechanism(gravity=LOAD["weight"])
    part = mech.add_nonlinear("rod", cosserat.body(rod), velocity=VELOCITY, omega=OMEGA)
    mech.force("force", part.marker("end"), LOAD["tip"])
    mech.torque("moment", part.marker("end"), LOAD["tip_moment"])
    sol = rom.simulate(mech, t_end=T[-1], dt=1e-2, method="dop853", save_every=10)
    return [cosserat.shape_of(sol, "rod", k) for k in (1, 2)]


@pytest.fixture(scope="module", params=list(floating.REFERENCES))
def motion(rod, request):
    given = {"load": cosserat.loads(rod, **LOAD), "velocity": VELOCITY, "omega": OMEGA}
    return request.param, floating.simulate(rod, T, reference_condition=request.param, **given)


def test_motion_in_space_and_forces_do_not_notice_the_frame(rod, absolute, motion):
    _, instants = motion
    for now, shape in zip(instants, absolute, strict=True):
        assert_allclose(now.shape.x, shape.x, atol=1e-9)
        assert_allclose(np.abs(np.sum(now.shape.p * shape.p, axis=1)), 1.0, atol=1e-12)
    assert np.abs(instants[-1].xi - rod.x).max() > 5e-3  # it bends
    W = energy.work(rod)
    still = np.zeros(W.r.size)
    energy.internal(rod, now.xi, now.theta, still, W)
    seen = np.append(W.r, np.zeros(3)).reshape(-1, 6)
    force = seen[:-1, 3:]
    turned = [rotation.matrix(q) @ m for q, m in zip(now.theta, seen[:, :3], strict=True)]
    assert_allclose(force.sum(axis=0), 0.0, atol=1e-11)
    assert_allclose(np.cross(now.xi, force).sum(axis=0) + np.sum(turned, axis=0), 0.0, atol=1e-11)
    energy.internal(rod, now.shape.x, now.shape.p, still, W)
    world = np.append(W.r, np.zeros(3)).reshape(-1, 6)
    assert_allclose(world[:-1, 3:], force @ rotation.matrix(now.P).T, atol=1e-11)
    assert_allclose(world[:, :3], seen[:, :3], atol=1e-11)


def test_a_frame_of_beams_swings_as_a_rod_does():
    """Timoshenko beams with nodes that turn, reduced, against rods of 20 and 40 segments.

    The rod errs by the square of its segments, by 6e-4 of its length; extrapolated it is nearer.
    """
    s = Section(0.02, 0.03, E=70e9, rho=2700.0)
    y = np.cross([0.1, 0.2, 1.0], [1.0, 0.0, 0.0])  # along the breadth, as of its frames
    y /= np.linalg.norm(y)
    axes = rotation.quaternion(np.column_stack([y, np.cross([1.0, 0.0, 0.0], y), [1.0, 0.0, 0.0]]))
    second = np.array(s.second_moments)
    section = {"stretch": (5 / 6 * s.G * s.A, 5 / 6 * s.G * s.A, s.E * s.A),
               "bend": (*s.E * second, s.G * s.torsion), "mass": s.rho * s.A,
               "inertia": s.rho * np.append(second, second.sum())}  # fmt: skip

    def tip(add, ends):
        mech = rom.Mechanism()
        part = add(mech)
        root, tip = (part.marker(end) for end in ends)
        mech.revolute("hinge", mech.ground.marker((0, 0, 0)), root, axis=(0, 1, 0))
        mech.force("side wind", tip, (0.0, 3.0, 0.0))
        found = rom.simulate(mech, t_end=0.5, dt=2.5e-4, save_every=400)
        return found.position("rod", ends[1])

    def swung(n):
        x = np.linspace(0.0, 1.0, n + 1)[:, None] * [1.0, 0.0, 0.0]
        one = cosserat.body(cosserat.rod(x, np.tile(axes, (n + 2, 1)), **section))
        return tip(lambda mech: mech.add_nonlinear("rod", one), ("start", "end"))

    kinds = {"root": "rbe2", "tip": "rbe2"}
    body = rom.reduce(cantilever(16, section=s), interfaces=kinds, reference="root")
    found = tip(lambda mech: mech.add_flexible("rod", body), ("root", "tip"))
    coarse, fine = swung(20), swung(40)
    assert np.abs(found[:, 1]).max() > 1e-3  # the wind bends it sideways
    assert_allclose(found, fine + (fine - coarse) / 3, atol=1e-4)


def test_absolute_frames_couple_neighbours_alone():
    """Numbers in the factor of an iteration; a floating frame couples all coordinates."""
    numbers = []
    for n in (50, 100):
        mech = rom.Mechanism(gravity=LOAD["weight"])
        one = cosserat.straight(1.0, n, stretch=1e5, bend=40.0, mass=1.0, inertia=1e-3)
        rod = mech.add_nonlinear("rod", cosserat.body(one))
        mech.fixed("clamp", mech.ground.marker((0, 0, 0)), rod.marker("start"))
        sol = rom.simulate(mech, t_end=2e-3, dt=1e-3)
        numbers.append(sol.packed.system.graph.plan.memory[0])
    coordinates = 6 + 6 * 102
    assert_allclose(numbers[1], 2 * numbers[0], rtol=0.05)
    assert 15 * numbers[1] < coordinates * (coordinates + 1) / 2


def test_the_frames_are_what_they_are_called_and_hold_nothing(rod, motion):
    name, instants = motion
    now = instants[-1]
    if name == "start":
        assert_allclose(now.xi[0], rod.x[0], atol=1e-9)
        assert_allclose(now.theta[0], rod.p[0], atol=1e-9)
    elif name == "chord":
        assert_allclose(now.xi[[0, -1]][:, :2], 0.0, atol=1e-9)
    else:
        assert_allclose(rod.mass @ now.xi, rod.mass @ rod.x, atol=1e-9)
        _, _, speeds, turning = now.parts
        spin = np.cross(now.xi, rod.mass[:, None] * speeds).sum(axis=0)
        for q, J, w in zip(now.theta, rod.inertia, turning, strict=True):
            spin = spin + rotation.matrix(q) @ (J * w)
        assert_allclose(spin, 0.0, atol=1e-9)
    # reactions of reference conditions are zero for a free rod: they choose a frame
    load = cosserat.loads(rod, **LOAD)
    dz, reaction = floating.accelerations(rod, instants[-1], load, floating.REFERENCES[name])
    assert np.abs(dz).max() > 1.0
    assert_allclose(reaction, 0.0, atol=1e-10)
