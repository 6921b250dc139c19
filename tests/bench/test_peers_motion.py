"""Motion against paths by Exudyn's ``ObjectFFRFreducedOrder``, and the bench of it."""

import json
import sys
import tracemalloc

import numpy as np
import pytest
from numpy.testing import assert_allclose

from benchmarks.benchmarks import motion
from benchmarks.models import bar
from benchmarks.peers import motion as peer
from benchmarks.peers import reference
from benchmarks.peers.mechanisms import built, pendulum
from cases.paths import TESTS
from rom.errors import ConfigError
from rom.mbs.integrate.simulation import simulate

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
    sol = simulate(mech, t_end=1e-3, dt=1e-4)
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
    monkeypatch.setattr(
        peer, "by_exudyn", lambda model, body, runs: [peer.by_rom(body, run) for run in runs]
    )
    figures = list(motion((0.02,), (2,)))
    cases = [f"{name}, 14 modes, 405 dofs" for name in ("pendulum", "slider-crank", "chain of 2")]
    assert [f.case for f in figures[::4]] == cases
    for theirs, ours, ratio, apart in zip(*(figures[k::4] for k in range(4)), strict=True):
        assert_allclose(ratio.value, ours.value / theirs.value)
        assert (theirs.unit, ratio.aim, apart.value) == ("steps/s", "above 10", 0.0)


def test_samples_that_do_not_divide_the_steps_are_refused(mesh):
    body = peer.reduced(mesh, 2)
    with pytest.raises(ConfigError, match="20 samples do not divide 30 steps"):
        peer.Run(pendulum(body), 1e-2, 30)


def test_steps_leave_no_memory_behind(mesh):
    """Thirty times as many steps between saved instants: not a number more is kept per step."""
    body = peer.reduced(mesh, 2)
    mech = built(pendulum(body), body)

    def held(steps):
        tracemalloc.start()
        before = sys.getallocatedblocks()
        sol = simulate(mech, t_end=steps * 1e-5, dt=1e-5, save_every=steps // 4)
        blocks, peak = sys.getallocatedblocks() - before, tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert (sol.statistics["steps"], len(sol.t)) == (steps, 5)
        return blocks, peak

    few, many = held(2_000), held(60_000)
    assert many[0] - few[0] < 58_000 // 20
    assert many[1] - few[1] < 8 * 58_000 * 3 // 4  # bytes; what a few thousand steps need at once
