"""Bearing coefficients against a published row: what is compared with ROSS is the same bearing."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rom.bench.peers import films
from rom.components.journal_bearing import equilibrium
from rom.components.transmission import rest

pytestmark = pytest.mark.once


@pytest.fixture
def theirs(monkeypatch):
    """An answer as ROSS gives it, with the stiffness and damping of our own film, in SI."""
    bearing, load = films.two_groove()
    kept = {"speed": films.FILM_CASE["speed"], "viscosity": films.FILM_CASE["viscosity"]}
    f = equilibrium(bearing, (0.0, -load), **kept)
    found = {"seconds": 1.0, "stiffness": f.stiffness[:2, :2].tolist(),
             "damping": f.damping[:2, :2].tolist()}  # fmt: skip
    monkeypatch.setattr(films, "interpreter", lambda *_: "python")
    monkeypatch.setattr(films, "answer_of", lambda _: {"version": "2", "lund": found})
    return found


@pytest.mark.long
def test_both_programs_are_held_against_the_same_row(theirs):
    rows = {quantity: value for _, quantity, value, _, _ in films.coefficients_compared()}
    ours = rows["rom, coefficients off Lund and Thomsen"]
    assert 0 < ours < 0.03
    assert rows["ROSS 2, lund, coefficients off Lund and Thomsen"] == pytest.approx(ours, rel=1e-6)
    assert rows["ROSS 2, lund, over rom"] == pytest.approx(
        1e3 / rows["rom, rest and coefficients"], rel=1e-9
    )


def test_axes_are_turned_to_the_load():
    """A spring along a load against Y becomes one along x; y points along X."""
    assert_allclose(films.along_the_load(np.diag([2.0, 5.0])), np.diag([5.0, 2.0]), atol=1e-12)
    assert_allclose(films.along_the_load(np.array([[0, 1.0], [0, 0]])), [[0, 0], [-1.0, 0]])


@pytest.mark.long
def test_the_unit_that_runs_through_its_speeds_carries_its_load():
    state = rest(films.gear_unit(cells=(48, 4)))
    given, taken, heat = state.powers
    assert given - taken - heat == pytest.approx(0, abs=1e-8 * given)
    assert taken == pytest.approx(300 * 100 * np.pi)
    assert all(0.2 < f.eccentricity < 0.95 for f in state.forces.films)
