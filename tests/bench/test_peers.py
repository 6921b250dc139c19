"""Comparisons with other programs: rods, films and motions that are the same on both sides."""

import ast
import json
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from benchmarks.benchmarks import motion
from benchmarks.models import bar
from benchmarks.peers import compare, films, reference, rods
from benchmarks.peers import motion as peer
from benchmarks.peers.mechanisms import built, pendulum
from benchmarks.units import RigidShaft
from cases.gear_unit import tilting
from cases.paths import TESTS
from rom import rotation
from rom.components import journal_bearing, transmission
from rom.components.cosserat import body, straight
from rom.components.wind.wind_turbine import RATED_SPEED, blade, ramp, run_up

STORED = json.loads((TESTS / "reference" / "exudyn_motion.json").read_text())


@pytest.fixture(scope="module")
def mesh():
    return reference.mesh()


@pytest.mark.parametrize("name", reference.NAMES)
def test_paths_differ_from_those_of_exudyn_by_the_error_of_the_step(mesh, name):
    """Half the step, a quarter of the difference; nothing is left when both are extrapolated."""
    body, runs = reference.case(name, mesh)
    coarse, fine = (peer.by_rom(body, run).positions for run in runs)
    theirs = [np.array(STORED["paths"][name][str(run.steps)]) for run in runs]
    gaps = [np.abs(ours - path).max() for ours, path in zip((coarse, fine), theirs, strict=True)]
    assert 3.5 < gaps[0] / gaps[1] < 5.0
    limit, their_limit = ((4 * x[1] - x[0]) / 3 for x in ((coarse, fine), theirs))
    assert np.abs(limit - their_limit).max() < 1e-9
    assert np.ptp(fine, axis=0).max() > 0.5  # metres
    assert np.abs(coarse - fine).max() > 1e-6  # the step matters


@pytest.mark.parametrize("name", reference.NAMES)
def test_no_joint_of_the_mechanisms_is_redundant(mesh, name):
    body, runs = reference.case(name, mesh)
    mech = built(runs[0].mechanism, body)
    sol = rom.simulate(mech, t_end=1e-3, dt=1e-4)
    assert sol.statistics["redundant"] == 0
    assert np.abs(sol.gap).max() < 1e-9
    # they start as they are described: no velocity is corrected
    for part, data in runs[0].mechanism["bodies"].items():
        assert_allclose(sol.velocity(part)[0], data["velocity"], atol=1e-12)


def test_the_file_for_other_programs_averages_nodes_to_the_markers(mesh, tmp_path):
    peer.save_for_exudyn(mesh, str(tmp_path / "M.npz"))
    body = peer.reduced(mesh, 2)
    assert len(body.surface.points) == len(mesh.points)
    with np.load(tmp_path / "M.npz") as data:
        for k, name in enumerate(data["names"]):
            nodes, weights = data[f"interface_{k}"], data[f"weights_{k}"]
            marker = body.marker(str(name))
            assert_allclose(weights @ mesh.points[nodes], marker.point, atol=1e-12)
            shape = body.surface.shape.reshape(-1, 3, body.n_modes)[nodes]
            mean = np.einsum("n,nik->ik", weights, shape)
            assert_allclose(mean, marker.translation, atol=1e-9 * np.abs(shape).max())


def test_figures_say_rates_ratio_and_difference(monkeypatch):
    """With our own runs in the place of Exudyn's: no difference, and an aim for each ratio."""
    monkeypatch.setattr(peer, "N_TIMED_STEPS", 1)
    monkeypatch.setattr(peer, "rod", lambda lc: bar((0.3, 0.02, 0.012), (7, 1, 1)))
    ours = lambda _, body, runs: [peer.by_rom(body, run) for run in runs]  # noqa: E731
    monkeypatch.setattr(peer, "by_exudyn", ours)
    figures = list(motion((0.02,), (2,)))
    cases = [f"{name}, 14 modes, 405 dofs" for name in ("pendulum", "slider-crank", "chain of 2")]
    assert [f.case for f in figures[::4]] == cases
    for theirs, ours, ratio, apart in zip(*(figures[k::4] for k in range(4)), strict=True):
        assert_allclose(ratio.value, ours.value / theirs.value)
        assert (theirs.unit, ratio.aim, apart.value) == ("steps/s", "above 10", 0.0)


def test_samples_that_do_not_divide_the_steps_are_refused(mesh):
    body = peer.reduced(mesh, 2)
    with pytest.raises(rom.ConfigError, match="20 samples do not divide 30 steps"):
        peer.Run(pendulum(body), 1e-2, 30)


def test_steps_leave_no_memory_behind(mesh):
    """Thirty times as many steps between saved instants: not a number more is kept per step."""
    body = peer.reduced(mesh, 2)
    mech = built(pendulum(body), body)

    def held(steps):
        tracemalloc.start()
        before = sys.getallocatedblocks()
        sol = rom.simulate(mech, t_end=steps * 1e-5, dt=1e-5, save_every=steps // 4)
        blocks, peak = sys.getallocatedblocks() - before, tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert (sol.statistics["steps"], len(sol.t)) == (steps, 5)
        return blocks, peak

    few, many = held(2_000), held(60_000)
    assert many[0] - few[0] < 58_000 // 20
    assert many[1] - few[1] < 8 * 58_000 * 3 // 4  # bytes; what a few thousand steps need at once


@pytest.mark.once
@pytest.mark.long
def test_both_programs_are_held_against_the_same_row(monkeypatch):
    """An answer as ROSS gives it, with the stiffness and damping of our own film, in SI."""
    bearing, load = films.two_groove()
    kept = {"speed": films.FILM_CASE["speed"], "viscosity": films.FILM_CASE["viscosity"]}
    f = journal_bearing.equilibrium(bearing, (0.0, -load), **kept)
    K, C = (x[:2, :2].tolist() for x in (f.stiffness, f.damping))
    found = {"seconds": 1.0, "stiffness": K, "damping": C}
    monkeypatch.setattr(films, "interpreter", lambda *_: "python")
    monkeypatch.setattr(films, "answer_of", lambda _: {"version": "2", "lund": found})
    rows = {quantity: value for _, quantity, value, _, _ in films.coefficients_compared()}
    ours = rows["rom, coefficients off Lund and Thomsen"]
    assert 0 < ours < 0.03
    assert rows["ROSS 2, lund, coefficients off Lund and Thomsen"] == pytest.approx(ours, rel=1e-6)
    ratio = 1e3 / rows["rom, rest and coefficients"]
    assert rows["ROSS 2, lund, over rom"] == pytest.approx(ratio, rel=1e-9)


@pytest.mark.once
def test_axes_are_turned_to_the_load():
    """A spring along a load against Y becomes one along x; y points along X."""
    assert_allclose(films.along_the_load(np.diag([2.0, 5.0])), np.diag([5.0, 2.0]), atol=1e-12)
    assert_allclose(films.along_the_load(np.array([[0, 1.0], [0, 0]])), [[0, 0], [-1.0, 0]])


@pytest.mark.once
@pytest.mark.long
def test_the_unit_that_runs_through_its_speeds_carries_its_load():
    state = transmission.rest(films.gear_unit(cells=(48, 4)))
    given, taken, heat = state.powers
    assert given - taken - heat == pytest.approx(tilting(state), rel=0.03)
    assert taken == pytest.approx(300 * 100 * np.pi)
    assert all(0.2 < f.eccentricity < 0.95 for f in state.forces.films)


@pytest.mark.once
@pytest.mark.long
def test_the_unit_of_rigid_shafts_is_the_same_by_both_programs():
    """They find the same largest forces on teeth but for what 60 steps leave."""
    rows = {quantity: value for _, quantity, value, _, _ in films.programs_compared(2, (40, 4))}
    ways = "by its own program", "as a mechanism"
    own, mechanism = (rows[f"a speed of a sweep {how}"] for how in ways)
    assert rows["mechanism over its own program"] == pytest.approx(mechanism / own)
    assert 0 < rows["load factors apart, middle of all speeds"] < 0.02
    assert rows["rest as a mechanism"] > 0
    assert rows["to make the tables"] > 0 and rows["steady motion at 2 speeds"] > 0
    assert 1.0 < rows["largest load factor"] < 3.0


@pytest.mark.once
def test_a_shaft_without_elasticity_keeps_its_inertia():
    """A steel rod of 50 mm and 200 mm length: pi / 4 d^2 L rho; m d^2 / 8; m (d^2 / 16 + L^2 / 12).

    Beams of four elements have their mass at the nodes but for a part, which the middle feels.
    """
    found = RigidShaft.of(transmission.Shaft(np.linspace(0.1, 0.3, 5), 0.05))
    mass = np.pi / 4 * 0.05**2 * 0.2 * 7850
    assert found.mass == pytest.approx(mass, rel=1e-9) and found.span == pytest.approx(0.2)
    assert found.about == pytest.approx(mass * 0.05**2 / 8, rel=1e-9)
    assert found.across == pytest.approx(mass * (0.05**2 / 16 + 0.2**2 / 12), rel=1e-3)


def test_beams_have_the_sections_of_the_blade():
    one = blade(48, azimuth=2.0)
    described = {name: np.array(value) for name, value in rods.beams(one).items()}
    assert_allclose(described["mass"] @ described["length"], one.mass.sum(), rtol=1e-12)
    lumped = np.zeros(49)
    lumped[:-1] += described["mass"] * one.h / 2
    lumped[1:] += described["mass"] * one.h / 2
    assert_allclose(lumped, one.mass, rtol=1e-12)
    # along: EA, two shear rigidities, GJ, bending about first and second axis of a section
    assert_allclose(described["stiffness"][:, :3], one.stretch[:, [2, 0, 1]])
    around = (described["stiffness"][24:40, 3:] + described["stiffness"][25:41, 3:]) / 2
    assert_allclose(around, one.bend[25:41][:, [2, 0, 1]], rtol=0.06)
    damped = blade(48, damped=True)
    ratio = described["damping"] / described["stiffness"]
    seen = damped.viscous_stretch / damped.stretch, damped.viscous_bend[1:] / damped.bend[1:]
    assert_allclose(ratio[:, :3], seen[0][:, [2, 0, 1]])
    assert_allclose(ratio[:, 3:], seen[1][:, [2, 0, 1]])
    assert_allclose(described["inertia"][:, 0], described["inertia"][:, 1:].sum(axis=1))
    for k, node in enumerate(described["nodes"]):
        A = rotation.matrix(node[3:])
        assert_allclose(A[:, 0], one.x[-1] / np.linalg.norm(one.x[-1]), atol=1e-12)
        assert_allclose(node[:3], one.x[k])
        before, after = (rotation.matrix(one.p[j])[:, 0] for j in (k, k + 1))
        between = before + after
        assert_allclose(A[:, 1], between / np.linalg.norm(between), atol=2e-2)


@pytest.mark.long
@pytest.mark.once
def test_the_rotor_here_is_the_run_up_of_its_blades(monkeypatch):
    monkeypatch.setattr(rods, "RISE_TIME", 4.0)
    seconds, tip = rods.by_rom(8)
    one = blade(8, damped=True)
    one = one._replace(inertia=body(one).frames.inertia)  # plates have some in a mechanism
    alone = run_up(one, t_end=4.0, dt=rods.TIME_STEP, rise=4.0)
    assert seconds > 0
    every = round(4.0 / rods.TIME_STEP) // rods.N_SAMPLES
    assert_allclose(tip[:, :2], alone.tip[::every, :2], atol=1e-5)
    assert np.abs(tip[:, 1]).max() > 0.03


def test_both_programs_turn_the_hub_alike():
    """The script knows nothing of rom; its law of the angle is read from its text."""
    source = Path(rods.SCRIPT_FILE).read_text()
    law = next(f for f in ast.parse(source).body if getattr(f, "name", "") == "angle")
    scope = {"sin": np.sin, "pi": np.pi}
    exec(compile(ast.Module([law], []), "beams", "exec"), scope)
    for t in (0.3, 7.0, 19.9, 25.0):
        ours = ramp(RATED_SPEED, 20.0)[1](t)
        assert_allclose(scope["angle"](t, RATED_SPEED, 20.0), ours, rtol=1e-14)


def test_the_cantilever_is_the_elastica_and_the_one_handed_over(monkeypatch):
    """Mattiasson, Int. J. Numer. Meth. Eng. 17 (1981) 145: P L^2 / EI = 2, less what shear adds."""
    ours = rods.bent_by_rom(100)
    assert_allclose(ours["tip"], (1 - 0.16064, 0.0, -0.49346), atol=3e-4)
    twist = np.sqrt(100.0 / 1e-3) / 4  # Hz, a bar clamped at one end
    assert np.abs(ours["frequencies"] / twist - 1).min() < 1e-3
    monkeypatch.setattr(compare, "interpreter", lambda: "python")
    echo = lambda command: json.loads(Path(command[2]).read_text())  # noqa: E731
    monkeypatch.setattr(compare, "answer_of", echo)
    given = rods.bent_by_exudyn(100)
    one = straight(1.0, 100, **rods.CANTILEVER_SECTION)
    assert_allclose(given["stiffness"], np.concatenate([one.stretch[50], one.bend[50]]))
    assert_allclose(given["inertia"], one.inertia[50] * 100)
    assert_allclose((given["mass"], given["length"]), (one.mass.sum(), one.h.sum()))
    assert given["force"] == [0.0, 0.0, -200.0]
