"""Errors of a motion by modes left out, against the same mechanism with unreduced bodies."""

from dataclasses import replace

import numpy as np
import pytest
from mbs.certified.machines import (
    ALL,
    MECHANISMS,
    Y,
    arm,
    beam,
    crank,
    flexible,
    four_bars,
    moved,
    ramp,
    run_up,
)
from numpy.testing import assert_allclose
from scipy.linalg import expm

import rom
from cases.long import few
from cases.refusals import refuses
from cases.solid import block, reduced
from rom.mbs.analysis.motion_certificate import usual_goals
from rom.mbs.analysis.small_errors import answers


def compared(motion, truth, report):
    """{goal: (estimated error, true error, correlation of both)}, errors of the largest value."""
    goals = dict(usual_goals(motion, truth, tuple(flexible(motion))))
    assert goals.keys() == report.curves.keys()
    step = round((motion.t.size - 1) / (report.motion.t.size - 1))
    found = {}
    for name, goal in goals.items():
        one, two = (goal(x).reshape(motion.t.size, -1)[::step] for x in (motion, truth))
        error, told = two - one, report.curves[name].error.reshape(one.shape)
        true = np.linalg.norm(error, axis=1).max() / np.linalg.norm(two, axis=1).max()
        alike = float((error * told).sum() / np.sqrt((error**2).sum() * (told**2).sum()))
        found[name] = report.curves[name].relative, true, alike
    return found


@pytest.fixture(scope="module")
def beams():
    """With no mode and the constraint shapes, with four, with all."""
    return beam(1, spare=False), beam(4), beam(ALL)


@pytest.mark.parametrize("name", MECHANISMS)
def test_errors_are_those_of_the_mechanism_with_unreduced_bodies(name, beams):
    """Their size, and at every instant their direction; teeth ring longer than they are told."""
    less, more, whole = beams
    motion, truth = (moved(MECHANISMS[name], body) for body in (less, whole))
    pieces = 200 if "mesh" in motion.mechanism.elements else 25
    report = rom.certify_motion(motion, dict.fromkeys(flexible(motion), more), pieces=pieces)
    for goal, (told, true, alike) in compared(motion, truth, report).items():
        assert 0.8 < told / true < 1.5, goal
        assert true > 1e-3, goal  # there is something to find
        assert alike > (0.2 if "mesh" in motion.mechanism.elements else 0.8), goal


@pytest.mark.parametrize("speed", [160, 320])
def test_a_shaft_that_turns_nearly_as_fast_as_it_rings_is_told(speed, beams):
    """Coriolis and centrifugal forces of the error, and forces of joints that turn with it."""
    less, more, whole = beams
    motion, truth = (moved(run_up, body, speed=speed) for body in (less, whole))
    report = rom.certify_motion(motion, {"shaft": more})
    for goal, (told, true, alike) in compared(motion, truth, report).items():
        assert 0.8 < told / true < 1.2, goal
        assert alike > 0.9, goal


def test_the_corrected_motion_is_one(beams):
    """Its velocities and accelerations are rates, joints stay closed, and it is near the truth."""
    less, more, whole = beams
    motion, truth = (moved(arm, body) for body in (less, whole))
    better = rom.certify_motion(motion, dict.fromkeys(("one", "two"), more), every=1).motion
    u, v = (
        getattr(better, x)("two", "tip") - getattr(motion, x)("two", "tip")
        for x in ("position", "velocity")
    )
    size = np.abs(u).max()
    assert np.abs(better.position("two", "tip") - truth.position("two", "tip")).max() < 0.1 * size
    assert np.abs(better.gap).max() < 0.01 * size
    rates = np.gradient(u, motion.t, axis=0)
    assert np.abs(v - rates)[5:-5].max() < 0.12 * np.abs(v).max()
    one = better.packed.system.bodies.v_at[better.packed.names.index("two")]
    of_frame = slice(one, one + 3)
    seconds = np.gradient(better.v[:, of_frame] - motion.v[:, of_frame], motion.t, axis=0)
    gained = better.a[:, of_frame] - motion.a[:, of_frame]
    assert np.mean(np.abs(gained - seconds)[5:-5]) < 0.15 * np.mean(np.abs(gained))


def test_answers_are_exponential_between_instants():
    """Against exp of the matrix with the load and its rise beside it; stiff ones rest on theirs."""
    rng = np.random.default_rng(3)
    t, A = np.linspace(0, 1, 401), -np.hstack([np.diag([30.0, 90.0]), np.diag([0.3, 0.2])])
    A += 0.5 * rng.normal(size=A.shape)
    f, start = rng.normal(size=(t.size, 2)), np.array([1.0, -1.0, 2.0, 0.5])
    whole = np.zeros((8, 8))
    whole[:4, :4] = np.vstack([np.eye(2, 4, 2), A])
    whole[2:4, 4:6], whole[4:6, 6:] = np.eye(2), np.eye(2)
    E, y = expm(whole * t[1]), start
    for k in range(t.size - 1):
        y = (E @ np.r_[y, f[k], (f[k + 1] - f[k]) / t[1]])[:4]
    assert_allclose(answers(A, start, t, f)[-1], y, rtol=1e-5)
    stiff = answers(np.array([[-1e12, -1.0]]), np.zeros(2), t, np.ones((t.size, 1)))
    assert_allclose(stiff[-50:, 0], 1e-12, rtol=1e-3)


def drawn(seed):
    """What is told and what is true of an arm with beams, load and speed drawn at random."""
    rng = np.random.default_rng(seed)
    sizes = [(1.0, *rng.uniform(0.02, 0.06, 2)) for _ in range(2)]
    n, f, load = int(rng.integers(0, 3)), rng.uniform(2, 6), 10 ** rng.uniform(-1, 1)
    less, more, whole = (
        [beam(k, size, spare=s) for size in sizes]
        for k, s in ((n, False), (2 * n + 2, True), (ALL, True))
    )
    motion, truth = (moved(arm, one, f=f, load=load, other=two) for one, two in (less, whole))
    report = rom.certify_motion(motion, dict(zip(("one", "two"), more, strict=True)))
    return compared(motion, truth, report)


@pytest.mark.parametrize("seeds", few(1, [[1, 6, 14], [*range(30)]]))
def test_estimates_of_machines_drawn_at_random_are_near_the_truth(seeds):
    ratios = np.array(
        [
            ratio
            for seed in seeds
            for ratio in (told / true for told, true, _ in drawn(seed).values())
        ]
    )
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
        row = report.rows[-1]
        assert not report.ok and row.value > 0.8 and f"the mode at {f:.4g} Hz" in row.quantity
    assert rom.certify_motion(shaken(more, 0.2 * held[1]), {"bar": beam(16)}).ok


def test_interfaces_that_are_not_rigid_are_found():
    """A short block under a jolt: as stiff ends as "rbe2" are 8 % of its deformation."""
    model = block((0.3, 0.1, 0.1), (4, 2, 2), origin=(0, -0.05, -0.05))

    def short(kind, n_modes):
        kinds = dict.fromkeys(("root", "tip"), kind)
        return reduced(n_modes, model, interfaces=kinds, damping=rom.ModalDamping(0.01))

    def jolted(body):
        mech = rom.Mechanism(gravity=(0, 0, 0))
        bar, at = mech.add_flexible("bar", body), (0.3, 0, 0)
        load = mech.add_rigid("load", mass=5, inertia=(2e-2,) * 3, at=at)
        mech.fixed("wall", mech.ground.marker((0, 0, 0)), bar.marker("root"))
        mech.fixed("grip", bar.marker("tip"), load.marker((0, 0, 0)))
        push, once = np.array([1e4, 0, 1e4]), 5e-3
        mech.force("push", load.marker((0, 0, 0)), lambda t: push * ramp(t, once))
        return rom.simulate(mech, t_end=0.02, dt=4e-5, rho_inf=0.9)

    soft, motion = short(rom.Polynomial(2), 6), jolted(short("rbe2", 6))
    assert rom.certify_motion(motion, {"bar": short("rbe2", 12)}).ok
    report = rom.certify_motion(motion, {"bar": soft})
    told, true, alike = compared(motion, jolted(soft), report)["bar: deformation"]
    assert true > 0.05 and abs(told / true - 1) < 0.02 and alike > 0.999
    assert "interfaces that deform" in report.rows[-1].quantity and report.rows[-1].value > 0.9


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
    mech = rom.Mechanism(gravity=(0, 0, 0))
    bar = mech.add_flexible("bar", less)
    mech.spread_load("wind", bar, rom.surface_load(less, traction=(0, 0, 1.0)))
    blown = rom.simulate(mech, t_end=1e-3, dt=1e-4)
    refuses(rom.ConfigError, "'wind' acts on the shapes of body 'bar'", of, blown, {"bar": more})
