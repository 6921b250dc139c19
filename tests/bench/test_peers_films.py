"""Bearing coefficients against a published row: what is compared with ROSS is the same bearing."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from benchmarks.peers import films
from benchmarks.units import RigidShaft
from cases.gear_unit import tilting
from rom.components.journal_bearing import equilibrium
from rom.components.transmission import Shaft, rest

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
    assert given - taken - heat == pytest.approx(tilting(state), rel=0.03)
    assert taken == pytest.approx(300 * 100 * np.pi)
    assert all(0.2 < f.eccentricity < 0.95 for f in state.forces.films)


@pytest.mark.long
def test_the_unit_of_rigid_shafts_is_the_same_by_both_programs():
    """They find the same largest forces on teeth but for what 60 steps leave."""
    rows = {quantity: value for _, quantity, value, _, _ in films.programs_compared(2, (40, 4))}
    own, mechanism = (
        rows[f"a speed of a sweep {how}"] for how in ("by its own program", "as a mechanism")
    )
    assert rows["mechanism over its own program"] == pytest.approx(mechanism / own)
    assert 0 < rows["load factors apart, middle of all speeds"] < 0.02
    assert rows["rest as a mechanism"] > 0
    assert rows["to make the tables"] > 0 and rows["steady motion at 2 speeds"] > 0
    assert 1.0 < rows["largest load factor"] < 3.0


def test_a_shaft_without_elasticity_keeps_its_inertia():
    """A steel rod of 50 mm and 200 mm length: pi / 4 d^2 L rho; m d^2 / 8; m (d^2 / 16 + L^2 / 12).

    Beams of four elements have their mass at the nodes but for a part, which the middle feels.
    """
    found = RigidShaft.of(Shaft(np.linspace(0.1, 0.3, 5), 0.05))
    mass = np.pi / 4 * 0.05**2 * 0.2 * 7850
    assert found.mass == pytest.approx(mass, rel=1e-9) and found.span == pytest.approx(0.2)
    assert found.about == pytest.approx(mass * 0.05**2 / 8, rel=1e-9)
    assert found.across == pytest.approx(mass * (0.05**2 / 16 + 0.2**2 / 12), rel=1e-3)
