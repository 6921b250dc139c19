"""Drawn mechanisms move the same whatever the reference conditions of their bodies are."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.beam import stiffened_beam
from cases.long import ROM_LONG, few
from cases.mbs.mechanisms import simulate_quietly
from cases.mbs.motions import flexible_four_bar, hub_and_panel
from cases.mbs.parts import Z, turned
from cases.mbs.slender import assembled
from cases.refusals import refuses
from rom import rotation
from rom.mbs.integrate.simulation import release, simulate

FRAMES = ("root", "tip", ("root", "tip"), "mean-axis", "buckens")
SEEDS = [0, 2, 1, *range(3, 100)]  # of the mechanisms drawn
RTOL = 1e-4


def beams(rng, frame, n):
    """Beams of 0.5 to 1.5 m; as flexible each that they bend by a hundredth in their motions."""
    sizes = rng.uniform(0.5, 1.5, n)
    given = {"n_modes": 3, "stiffened": False}
    made = (stiffened_beam(L, EI=150 * L**2, rhoA=1 / L, **given) for L in sizes)
    return [beam.with_reference(frame) for beam in made]


def chain(rng, frame):
    """One to three beams under a hinge, then ball joints; a spring holds the end."""
    mech, last, at = rom.Mechanism(gravity=(0, -9.81, 0)), None, np.zeros(3)
    for k, body in enumerate(beams(rng, frame, rng.integers(1, 4))):
        A = turned(rng.uniform(-1, 1))
        part = mech.add_flexible(f"beam {k}", body, at=at, orientation=A)
        at = at + A @ body.marker("tip").point
        if last is None:
            mech.revolute("hinge", mech.ground.marker((0, 0, 0)), part.marker("root"), axis=Z)
        else:
            mech.spherical(f"ball {k}", last, part.marker("root"))
        last = part.marker("tip")
    hook = mech.ground.marker(at + np.array([0, 0.4, 0.2]))
    mech.spring_damper("spring", hook, last, stiffness=rng.uniform(10, 40), damping=0.2)
    return mech


def loop(rng, frame):
    """Four-bar linkage of a driven crank, two beams and the ground."""
    coupler, rocker = beams(rng, frame, 2)
    bend, speed = -rng.uniform(0.8, 2.0), rng.uniform(2, 6)
    return flexible_four_bar(coupler, rocker, bend, lambda t: speed * t**2)


def hub(rng, frame):
    """A free hub that turns, with one or two panels on hinges and springs."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    turning = np.r_[rng.normal(size=2) * 0.3, rng.uniform(1, 4)]
    arms = {"right": (0.3, 0, 0), "left": (-0.3, 0, 0)}
    solid, velocity = {"mass": 5, "inertia": (0.4, 0.5, 0.6)}, rng.normal(size=3)
    mech.add_rigid("hub", **solid, at=(0, 0, 0), markers=arms, velocity=velocity, omega=turning)
    panels = zip(("right", "left"), (0, np.pi), beams(rng, frame, rng.integers(1, 3)), strict=False)
    for name, angle, body in panels:
        A, at = turned(angle), np.array(arms[name])
        moving = {"omega": A.T @ turning, "velocity": velocity + np.cross(turning, at)}
        mech.add_flexible(f"{name} panel", body, at=at, orientation=A, **moving)
        mech.revolute(f"{name} hinge", f"hub.{name}", f"{name} panel.root", axis=Z)
        mech.rotational_spring(f"{name} coil", f"{name} hinge", stiffness=rng.uniform(5, 50))
    return mech


def drawn(seed, frame):
    """The same mechanism for the same seed, its bodies in the frame."""
    return (chain, loop, hub)[seed % 3](np.random.default_rng(seed), frame)


def moved(mech, **options):
    """The loop holds its plane more than once."""
    return simulate_quietly(mech, t_end=0.2, assemble=False, **options)


def answers(sol):
    """Places, axes and reactions at the end, each with its size; nothing counted in a frame."""
    ends = [(name, part) for name, part in sol.mechanism.parts.items() if part.flexible is not None]
    names = [(name, marker) for name, part in ends for marker in part.names]
    loads = np.array([sol.reaction(joint)[-1] for joint in sol.mechanism.joints])
    return {
        "place": (np.array([sol.position(*n)[-1] for n in names]), 1.0),
        "axes": (np.array([sol.axes(*n)[-1] for n in names]), 1.0),
        "velocity": (np.array([sol.velocity(*n)[-1] for n in names]), 3.0),
        "reaction": (loads, np.abs(loads).max()),
    }


def differences(seed, frames=FRAMES[1:] if ROM_LONG else FRAMES[1:2], **options):
    """The largest difference of each answer from that with frames on the roots, over its size."""
    first = answers(moved(drawn(seed, FRAMES[0]), **options))
    others = [answers(moved(drawn(seed, frame), **options)) for frame in frames]
    return {name: max(np.abs(found[name][0] - x).max() for found in others) / size
            for name, (x, size) in first.items()}  # fmt: skip


@pytest.mark.parametrize("seed", few(3, SEEDS))
def test_fixed_steps_see_the_same_equations_in_every_frame(seed):
    """To the round-off of positions, divided by the step in velocities."""
    off = differences(seed, dt=1e-3)
    assert max(off.values()) < 1e-4 and max(off["place"], off["velocity"]) < 1e-6, off


@pytest.mark.parametrize("seed", few(2, SEEDS))
def test_chosen_steps_keep_their_tolerance_in_every_frame(seed):
    """All but multipliers, which it is not kept of."""
    off = differences(seed, rtol=RTOL)
    assert max(off["place"], off["axes"], off["velocity"] / 10) < 2 * RTOL, off


@pytest.mark.parametrize("frame", FRAMES)
def test_a_hinged_panel_leaves_the_momentum_of_its_hub(frame):
    """Integrated on its root it drifted by 1e-4 of it, on its tip Newton's method failed."""
    sol = simulate(hub_and_panel(frame), t_end=0.3, dt=1e-3)
    for momentum in sol.momentum:
        assert np.ptp(momentum, axis=0).max() < 2e-5 * np.abs(momentum).max()


def test_a_state_of_an_older_file_is_refused_where_frames_have_changed(tmp_path, monkeypatch):
    for frame in ("root", "mean-axis"):
        mech = drawn(0, frame)
        state = moved(mech, dt=1e-2).final
        with monkeypatch.context() as patched:
            patched.setattr("rom.mbs.results.state.VERSION", (2, 0))
            rom.save_state(state, tmp_path / "old.state.npz")
        old = rom.load_state(tmp_path / "old.state.npz")
        goes_on = {
            "simulate": lambda m, s: simulate(m, t_end=0.21, dt=1e-2, state=s),
            "release": release, "linearize": rom.linearize,
            "equilibrium": lambda m, s: rom.equilibrium(m, state=s),
        }  # fmt: skip
        for name, go_on in goes_on.items():
            if frame == "mean-axis" and name in ("simulate", "release"):
                go_on(mech, old)
            elif frame == "root":
                refuses(rom.ConfigError, r"'beam 0'.*on mean axes", go_on, mech, old)


def test_loads_count_in_the_frame_of_the_user():
    body = stiffened_beam(EI=30.0, n_modes=6, stiffened=False)
    found = {}
    for frame in ("root", "tip"):
        mech = rom.Mechanism(gravity=(0, -9.81, 0))
        beam = mech.add_flexible("beam", body.with_reference(frame))
        mech.fixed("wall", mech.ground.marker((0, 0, 0)), beam.marker("root"))
        sol = moved(mech, dt=1e-2)
        world = sol.interface_loads("beam")["root"]
        axes = np.array([rotation.matrix(p) for p in sol.orientation("beam")])
        body_axes = np.einsum("nba,nsb->nsa", axes, world.reshape(-1, 2, 3)).reshape(-1, 6)
        assert_allclose(sol.interface_loads("beam", frame="body")["root"], body_axes, atol=1e-9)
        found[frame] = axes
    assert_allclose(found["root"], np.broadcast_to(np.eye(3), found["root"].shape), atol=1e-9)
    assert np.abs(found["tip"] - found["root"]).max() > 1e-2


@pytest.mark.fenicsx
def test_stress_with_its_inertial_part_is_the_same_in_any_frame():
    body = rom.reduce(
        assembled((1.0, 0.02, 0.02), (6, 1, 1)), method=rom.CraigBampton(n_modes=2),
        interfaces={"root": "rbe2", "tip": "rbe2"}, stress=True, certify=False,
    )  # fmt: skip
    fields = []
    for frame in ("mean-axis", "root", "tip"):
        mech = rom.Mechanism(gravity=(0, -9.81, 0))
        bar = mech.add_flexible("bar", body.with_reference(frame))
        mech.revolute("hinge", mech.ground.marker((0, 0, 0)), bar.marker("root"), axis=Z)
        fields.append(moved(mech, dt=1e-3).stress("bar", -1))
    assert_allclose(fields[1:], [fields[0]] * 2, atol=1e-3 * np.abs(fields[0]).max())
