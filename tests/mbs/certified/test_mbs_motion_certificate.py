"""Errors of a motion by modes left out, against the same mechanism with unreduced bodies."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.long import few
from cases.refusals import refuses
from cases.solid import KINDS, block
from rom.components.gear_mesh import GearPair
from rom.mbs.analysis.motion_certificate import usual_goals

ALL = 60  # modes: with constraint modes all of a block of eight bricks that have mass in a motion
Y = (0, 1, 0)


def beam(n_modes, size=(1.0, 0.03, 0.04), *, spare=True):
    """A beam from its root, along x; all shapes that inertia bends, unless without spare."""
    width, height = size[1:]
    model = block(size, (8, 1, 1), origin=(0.0, -width / 2, -height / 2))
    method = rom.CraigBampton(n_modes)
    return rom.reduce(
        model, method=rom.WithLoads(method) if spare else method, interfaces=KINDS, name="beam",
        reference="root", damping=rom.ModalDamping(0.01, fixed=("root",)), certify=False,
    )  # fmt: skip


def ramp(t, T):
    """From 0 to 1 in a time T, smooth to the third derivative."""
    s = np.clip(t / T, 0.0, 1.0)
    return s**4 * (35 - 84 * s + 70 * s**2 - 20 * s**3)


def crank(body, speed=60.0):
    """A crank of 0.1 m and the beam as rod; a heavy slider."""
    mech = rom.Mechanism()
    web = mech.add_rigid(
        "web", mass=2, inertia=(1e-2,) * 3, at=(0, 0, 0), markers={"pin": (0.1, 0, 0)}
    )
    rod = mech.add_flexible("rod", body, at=(0.1, 0, 0))
    end = mech.add_rigid(
        "slider", mass=3, inertia=(1e-2,) * 3, at=(1.1, 0, 0), markers={"pin": (0, 0, 0)}
    )
    mech.revolute("bearing", mech.ground.marker((0, 0, 0)), web.marker((0, 0, 0)), axis=Y)
    mech.revolute("pin", web.marker("pin"), rod.marker("root"), axis=Y)
    mech.revolute("wrist", rod.marker("tip"), end.marker("pin"), axis=Y)
    mech.prismatic("guide", mech.ground.marker((1.1, 0, 0)), end.marker("pin"), axis=(1, 0, 0))
    mech.drive("motor", "bearing", lambda t: speed * t * ramp(t, 0.1))
    return mech, 0.3


def four_bars(body):
    """The beam as coupler of four bars, driven at one side."""
    mech = rom.Mechanism()
    left = mech.add_rigid(
        "left", mass=1, inertia=(1e-2,) * 3, at=(0, 0, 0), markers={"pin": (0, 0, 0.2)}
    )
    rod = mech.add_flexible("rod", body, at=(0, 0, 0.2))
    right = mech.add_rigid(
        "right", mass=1, inertia=(2e-2,) * 3, at=(1, 0, -0.3), markers={"pin": (0, 0, 0.5)}
    )
    mech.revolute("one", mech.ground.marker((0, 0, 0)), left.marker((0, 0, 0)), axis=Y)
    mech.revolute("two", left.marker("pin"), rod.marker("root"), axis=Y)
    mech.revolute("three", rod.marker("tip"), right.marker("pin"), axis=Y)
    mech.revolute("four", mech.ground.marker((1, 0, -0.3)), right.marker((0, 0, 0)), axis=Y)
    mech.drive("motor", "one", lambda t: 50 * t * ramp(t, 0.1))
    return mech, 0.3


def arm(body, f=6.0, load=1.0, other=None):
    """Two beams, both joints driven, a load in the grip; no gravity that would begin at once."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    one = mech.add_flexible("one", body)
    two = mech.add_flexible("two", other or body, at=(1, 0, 0))
    held = mech.add_rigid("load", mass=load, inertia=(1e-3 * load,) * 3, at=(2, 0, 0))
    mech.revolute("shoulder", mech.ground.marker((0, 0, 0)), one.marker("root"), axis=Y)
    mech.revolute("elbow", one.marker("tip"), two.marker("root"), axis=Y)
    mech.fixed("grip", two.marker("tip"), held.marker((0, 0, 0)))
    mech.drive("first", "shoulder", lambda t: 0.2 * ramp(t, 1 / f) * np.sin(2 * np.pi * f * t))
    mech.drive("second", "elbow", lambda t: 0.3 * ramp(t, 1 / f) * np.sin(3.4 * np.pi * f * t))
    return mech, 0.4


def run_up(body):
    """A shaft with a wheel beside its axis, brought to a speed below its critical one."""
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    shaft = mech.add_flexible("shaft", body)
    wheel = mech.add_rigid(
        "wheel", mass=1, inertia=(2e-3, 1e-3, 1e-3), at=(1, 0, 1e-3), markers={"hub": (0, 0, -1e-3)}
    )
    mech.revolute("bearing", mech.ground.marker((0, 0, 0)), shaft.marker("root"), axis=(1, 0, 0))
    mech.fixed("seat", shaft.marker("tip"), wheel.marker("hub"))
    mech.drive("motor", "bearing", lambda t: 80 * t * ramp(t, 0.3))
    return mech, 0.5


def falling(body):
    """A beam held at its root whose free end falls on a plane."""
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    bar = mech.add_flexible("bar", body, omega=(0, 2.0, 0))
    mech.revolute("hinge", mech.ground.marker((0, 0, 0)), bar.marker("root"), axis=Y)
    law = rom.mbs.Impact(stiffness=2e6, restitution=0.5, impact_speed=2.0)
    mech.sphere_on_plane(
        "stop",
        mech.ground.marker((1, 0, -0.1)),
        bar.marker("tip"),
        law,
        normal=(0, 0, 1),
        radius=0.02,
    )
    return mech, 0.15


def housing(body):
    """A bracket carries the bearing of a driven pinion, in mesh with a wheel of some inertia."""
    pair, mech = GearPair((26, 40), 4e-3, 0.03), rom.Mechanism(gravity=(0, 0, 0))
    bracket, apart = mech.add_flexible("bracket", body), (1 + pair.distance, 0, 0)
    pinion = mech.add_rigid("pinion", mass=1, inertia=(1e-3,) * 3, at=(1, 0, 0))
    wheel = mech.add_rigid("wheel", mass=4, inertia=(2e-2,) * 3, at=apart)
    mech.fixed("foot", mech.ground.marker((0, 0, 0)), bracket.marker("root"))
    mech.revolute("seat", bracket.marker("tip"), pinion.marker((0, 0, 0)), axis=Y)
    mech.revolute("bearing", mech.ground.marker(apart), wheel.marker((0, 0, 0)), axis=Y)
    mech.torque("load", wheel.marker((0, 0, 0)), lambda t: (0, 200 * ramp(t, 0.1), 0))
    ends = pinion.marker((0, 0, 0)), wheel.marker((0, 0, 0))
    mech.gear_mesh("mesh", *ends, axis=Y, pair=pair, stiffness=1e10, damping=1e-5)
    mech.drive("motor", "seat", lambda t: 40 * t * ramp(t, 0.1))
    return mech, 0.2


MECHANISMS = {
    "slider-crank": crank, "four bars": four_bars, "robot arm": arm, "run-up": run_up,
    "impact": falling, "gear in a housing": housing,
}  # fmt: skip


def moved(build, body, dt=2e-4, **how):
    mech, t_end = build(body, **how)
    return rom.simulate(mech, t_end=t_end, dt=dt, rho_inf=0.8)


def flexible(motion):
    return [name for name, part in motion.mechanism.parts.items() if part.r]


def compared(build, less, more, whole, **how):
    """{goal: (estimated error, true error)}; goals of the certificate, of the unreduced motion."""
    motion, truth = (moved(build, body, **how) for body in (less, whole))
    pieces = 200 if "mesh" in motion.mechanism.elements else 25
    report = rom.certify_motion(motion, dict.fromkeys(flexible(motion), more), pieces=pieces)
    goals = dict(usual_goals(motion, truth, tuple(flexible(motion))))
    assert goals.keys() == report.curves.keys()
    step = round((motion.t.size - 1) / (report.motion.t.size - 1))
    found = {}
    for name, goal in goals.items():
        one, two = (goal(x).reshape(motion.t.size, -1)[::step] for x in (motion, truth))
        size = np.linalg.norm(two, axis=1).max()
        found[name] = report.curves[name].relative, np.linalg.norm(two - one, axis=1).max() / size
    return found


@pytest.fixture(scope="module")
def beams():
    """With no mode and the constraint shapes, with four, with all."""
    return beam(1, spare=False), beam(4), beam(ALL)


@pytest.mark.parametrize("name", MECHANISMS)
def test_errors_are_those_of_the_mechanism_with_unreduced_bodies(name, beams):
    for goal, (estimated, true) in compared(MECHANISMS[name], *beams).items():
        assert 0.8 < estimated / true < 1.5, goal
        assert true > 1e-3, goal  # there is something to find


def drawn(seed):
    """{goal: estimated over true error} of an arm with beams, load and speed drawn at random."""
    rng = np.random.default_rng(seed)
    sizes = [(1.0, *rng.uniform(0.02, 0.06, 2)) for _ in range(2)]
    n, f, load = int(rng.integers(0, 3)), rng.uniform(2, 6), 10 ** rng.uniform(-1, 1)
    less, more, whole = (
        [beam(k, size, spare=s) for size in sizes]
        for k, s in ((n, False), (2 * n + 2, True), (ALL, True))
    )
    motion, truth = (moved(arm, one, f=f, load=load, other=two) for one, two in (less, whole))
    report = rom.certify_motion(motion, dict(zip(("one", "two"), more, strict=True)))
    goals = dict(usual_goals(motion, truth, ("one", "two")))
    found = {}
    for name, goal in goals.items():
        one, two = (goal(x).reshape(motion.t.size, -1) for x in (motion, truth))
        true = np.linalg.norm(two - one, axis=1).max() / np.linalg.norm(two, axis=1).max()
        found[name] = report.curves[name].relative / true, true
    return found


@pytest.mark.parametrize("seeds", few(1, [[1, 6, 14], [*range(30)]]))
def test_estimates_of_machines_drawn_at_random_are_near_the_truth(seeds):
    ratios = np.array([ratio for seed in seeds for ratio, _ in drawn(seed).values()])
    assert np.mean((ratios > 0.7) & (ratios < 2.0)) >= 0.95
    assert abs(np.median(ratios) - 1) < 0.05


def shaken(body, f):
    """The beam in a wall, its end pushed sideways at a frequency."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    bar = mech.add_flexible("bar", body)
    mech.fixed("wall", mech.ground.marker((0, 0, 0)), bar.marker("root"))
    mech.force(
        "shaker", bar.marker("tip"), lambda t: (0, 0, ramp(t, 0.02) * np.sin(2 * np.pi * f * t))
    )
    return rom.simulate(mech, t_end=0.1, dt=5e-5, rho_inf=0.9)


def test_a_mode_left_out_that_a_load_excites_is_named():
    """Of constraint modes alone: the load meets modes with both ends held, which are not there."""
    less, more = beam(0, spare=False), beam(8)
    held = more.frequencies(fixed=("root", "tip"))
    for f in held[[1, 3]]:  # upright, as the load
        report = rom.certify_motion(shaken(less, f), {"bar": more})
        row = next(row for row in report.rows if "share" in row.quantity)
        assert not report.ok and row.value > 0.8 and f"the mode at {f:.4g} Hz" in row.quantity
    assert rom.certify_motion(shaken(more, 0.2 * held[1]), {"bar": beam(16)}).ok


def test_a_motion_that_began_at_rest_under_its_loads_is_judged_from_there():
    """In equilibrium nothing moves: the error is that of statics, which constraint modes have."""
    less, more = beam(0, spare=False), beam(4)
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    bar = mech.add_flexible("bar", less)
    mech.fixed("wall", mech.ground.marker((0, 0, 0)), bar.marker("root"))
    motion = rom.simulate(mech, t_end=0.1, dt=1e-3, state=rom.equilibrium(mech))
    found = (
        rom.certify_motion(motion, {"bar": more}).motion.elastic("bar")
        @ more.on_mean_axes().marker("tip").translation[2]
    )
    other = rom.Mechanism(gravity=(0, 0, -9.81))
    bar = other.add_flexible("bar", more)
    other.fixed("wall", other.ground.marker((0, 0, 0)), bar.marker("root"))
    rest = (
        rom.snapshot(other, rom.equilibrium(other)).elastic("bar")[0]
        @ more.on_mean_axes().marker("tip").translation[2]
    )
    assert_allclose(found, rest, rtol=1e-3)


def test_the_error_of_the_steps_stands_beside_that_of_the_modes(beams):
    """Of a method of second order, a third of the difference to steps twice as long."""
    less, more, _ = beams
    fine, coarse, finest = (moved(crank, less, dt) for dt in (2e-4, 4e-4, 5e-5))
    report = rom.certify_motion(fine, {"rod": more}, coarser=coarse)
    steps = {row.quantity: row.value for row in report.rows if "time steps" in row.quantity}
    goals = dict(usual_goals(fine, fine, ("rod",)))
    for name in ("rod: strain energy", "wrist: force"):
        one, two = (goals[name](x).reshape(x.t.size, -1) for x in (fine, finest.at(fine.t)))
        true = np.linalg.norm(two - one, axis=1).max() / np.linalg.norm(two, axis=1).max()
        assert 0.8 < steps[f"{name}, error by time steps"] / true < 1.25


def test_goals_of_ones_own_are_judged(beams):
    less, more, _ = beams
    goals = {"slider": lambda motion: motion.position("slider", "pin")[:, 0]}
    motion = moved(crank, less)
    report = rom.certify_motion(motion, {"rod": more}, goals=goals, tol=1e-6)
    ((name, curve),) = report.curves.items()
    assert name == "slider" and curve.value.shape == curve.error.shape == report.motion.t.shape
    assert 0 < curve.relative < 1e-3
    assert_allclose(curve.error, report.motion.position("slider", "pin")[:, 0] - curve.value)


def test_long_motions_are_thinned_out_and_pieces_do_not_matter(beams):
    less, more, _ = beams
    motion = moved(crank, less, 1e-4)
    whole, thin = (
        rom.certify_motion(motion, {"rod": more}, every=k, pieces=p) for k, p in ((1, 200), (3, 25))
    )
    assert motion.t.size == whole.motion.t.size == 3 * thin.motion.t.size - 2
    for name, curve in whole.curves.items():
        assert_allclose(thin.curves[name].relative, curve.relative, rtol=0.05)


def test_laws_in_python_are_asked_too(beams):
    """A spring of one's own is the spring that is compiled."""
    less, more, _ = beams

    def held(own):
        mech = rom.Mechanism(gravity=(0, 0, 0))
        bar = mech.add_flexible("bar", less, omega=(0, 1.0, 0))
        mech.revolute("hinge", mech.ground.marker((0, 0, 0)), bar.marker("root"), axis=Y)
        if own:
            mech.motor("spring", "hinge", lambda t, x, rate: -3e3 * x)
        else:
            mech.rotational_spring("spring", "hinge", stiffness=3e3)
        return rom.certify_motion(rom.simulate(mech, t_end=0.1, dt=2e-4), {"bar": more})

    for one, two in zip(held(True).curves.values(), held(False).curves.values(), strict=True):
        assert_allclose(one.error, two.error, rtol=1e-5, atol=1e-7 * np.abs(two.error).max())


def test_what_is_no_richer_body_is_refused(beams):
    less, more, _ = beams
    motion = moved(four_bars, less)
    of = rom.certify_motion
    refuses(rom.ConfigError, "no body 'beam'; there are", of, motion, {"beam": more})
    refuses(rom.ConfigError, "'left' is rigid", of, motion, {"left": more})
    refuses(
        rom.ModelError,
        "are not among those of the richer one",
        of,
        motion,
        {"rod": beam(4, (1.0, 0.04, 0.03))},
    )
    refuses(
        rom.ModelError,
        "need the surface of one mesh",
        of,
        motion,
        {"rod": replace(more, surface=None)},
    )
    refuses(
        rom.ModelError,
        "misses its own equations",
        of,
        motion,
        {"rod": replace(more, S_kl=1.1 * more.S_kl)},
    )
    refuses(
        rom.ConfigError,
        "goal 'x' gives shapes",
        of,
        motion,
        {"rod": more},
        goals={"x": lambda motion: 1.0},
    )
    refuses(rom.ConfigError, "tol", of, motion, {"rod": more}, tol=0.0)
