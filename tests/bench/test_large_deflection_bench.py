"""What is measured of bodies that bend far is what it is called."""

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from benchmarks import large_deflection as bench
from benchmarks.peers import compare, spin_up
from rom import rotation
from rom.components.cosserat import straight
from rom.components.wind.wind_turbine import ramp

pytestmark = pytest.mark.once


def test_rods_and_their_beams_are_the_bar_of_the_paper(monkeypatch):
    """Kane, Ryan and Banerjee: EA = 2.8e7 N, EI = 1.4e4 N m^2, 1.2 kg/m, 10 m."""
    given = spin_up.beams(4)
    assert given["stiffness"][0][0] == 2.8e7 and given["stiffness"][0][4:] == [1.4e4] * 2
    assert_allclose([sum(given["length"]), np.dot(given["mass"], given["length"])], [10, 12])
    along, across, _ = rotation.matrix(np.array(given["nodes"][2][3:])).T
    assert_allclose(given["nodes"][2][:3], [0, 5, 0])
    assert_allclose(along, [0, 1, 0], atol=1e-12)
    assert_allclose(across, [-1, 0, 0], atol=1e-12)
    made = {}
    monkeypatch.setattr(spin_up, "straight", lambda *a, **k: made.update(k) or straight(*a, **k))
    mech = bench.Mechanism()
    spin_up.rod(4)(mech)
    first = [2, 0, 1]
    assert np.array(made["stretch"])[first].tolist() == given["stiffness"][0][:3]
    assert np.array(made["bend"])[first].tolist() == given["stiffness"][0][3:]
    assert np.array(made["inertia"])[first].tolist() == given["inertia"][0]
    assert made["mass"] == given["mass"][0]
    assert_allclose(made["frame"][:, 2], [1, 0, 0])


def test_the_deflection_of_a_beam_is_read_from_the_places_of_its_tip(monkeypatch):
    """A stiff bar has none; one that lags by 0.2 m has that."""
    angle = ramp(spin_up.FINAL_SPEED, spin_up.RISE_TIME)[1]
    t = np.linspace(0.0, spin_up.RISE_TIME, 31)
    turned = [rotation.matrix(rotation.exp([angle(s), 0, 0])) for s in t]
    tip = np.array([A @ [0, 10.0, -0.2] for A in turned])
    assert_allclose(spin_up.lag(tip), -0.2, atol=1e-12)
    described = {}

    def answer(command):
        described.update(json.loads(Path(command[2]).read_text()))
        return {"tips": tip[:, None].tolist(), "seconds": 2.0, "version": "1"}

    monkeypatch.setattr(compare, "interpreter", lambda: "python")
    monkeypatch.setattr(compare, "answer_of", answer)
    assert_allclose(spin_up.by_exudyn(4)[1], 1 - 0.2 / 0.57379)
    assert described["steps"] == described["samples"] == 3000 and described["final"] == 6.0


def test_a_rod_spins_up_as_the_exact_beam_does():
    """The error falls with the square of the length of its segments."""
    errors = [spin_up.spun_up(spin_up.rod(n), t_end=7.0).error for n in (8, 16)]
    assert errors[1] < 1e-2 and 3 < errors[0] / errors[1] < 5


@pytest.mark.long
@pytest.mark.fenicsx
@pytest.mark.filterwarnings("ignore:Number of integration points")
def test_the_bar_of_a_few_cells_is_measured():
    stocky = {"L": 1.0, "b": 0.2, "h": 0.1, "lc": 0.1}
    rows = list(bench.measured(stocky, (8, 1), (10, 1), (8,), ()))
    assert all(row[2] >= 0 for row in rows)
    of_bodies = [row[2] for row in rows if "dofs by" in row[0] and "error" in row[1]]
    assert len(of_bodies) == 2 and max(of_bodies) < 1e-2
    assert len(rows) == 2 + 4 + 10 + 1 + 3
