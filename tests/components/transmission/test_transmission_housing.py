"""Housings that give way under their bearings, against springs in series and rigid walls."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from benchmarks.models import KINDS, STEEL, bar
from cases.gear_unit import tilting, unit
from cases.refusals import refuses
from rom.components.transmission import Housing, linearised, mesh_response, rest, simulate
from rom.errors import ModelError

NODES = (0, 4)


def springs(stiffness, mass=1.0, stands=1e12):
    """Every bush on springs along X and Y of its own; (pinion, gear) stiffness [N/m]."""
    rows = [np.zeros((6, 8)) for _ in range(4)]
    for k, B in enumerate(rows):
        B[0, 2 * k] = B[1, 2 * k + 1] = 1.0
    bushes = [dict(zip(NODES, rows[2 * k : 2 * k + 2], strict=True)) for k in range(2)]
    pinion, gear = np.broadcast_to(stiffness, 2)
    K = np.diag([min(pinion, stands)] * 4 + [min(gear, stands)] * 4)
    return Housing(mass * np.eye(8), K, tuple(bushes))


@pytest.fixture(scope="module")
def rigid():
    return rest(unit())


@pytest.fixture(scope="module")
def soft():
    return rest(replace(unit(), housing=springs((8e7, 3e8))))


def test_a_rigid_housing_is_as_none(rigid):
    held = rest(replace(rigid.unit, housing=springs(1e14, stands=1e14)))
    n = rigid.q.size
    assert_allclose(held.q[:n], rigid.q, atol=1e-5 * np.abs(rigid.q).max())
    assert np.abs(held.q[n:]).max() < 1e-9
    responses = [mesh_response(s) for s in (rigid, held)]
    assert_allclose(responses[1].error, responses[0].error, rtol=1e-4)


def test_bushes_give_way_and_journals_rest_in_them_as_in_rigid_ones(soft, rigid):
    bushes, mirror = soft.q[soft.unit.parts[2]].reshape(4, 2), np.array([1.0, -1.0])
    for k, (u, f) in enumerate(zip(bushes, soft.forces.films, strict=True)):
        force = f.force[:2] * (mirror if k > 1 else 1.0)
        assert_allclose(u, -force / (8e7, 3e8)[k > 1], rtol=1e-7)
    given, taken, heat = soft.powers
    assert given - taken - heat == pytest.approx(tilting(soft), rel=0.03)
    for a, b in zip(soft.forces.films, rigid.forces.films, strict=True):
        assert_allclose(a.motion[:2], b.motion[:2], atol=2e-3 * a.bearing.clearance)
    pushed = soft.unit.rows(0, 0)[:2] @ soft.q - rigid.unit.rows(0, 0)[:2] @ rigid.q
    assert np.hypot(*pushed) > 1e-5
    run = simulate(soft, periods=0.4, steps=100)
    assert run.balance < 1e-6
    assert np.ptp(run.q[:, soft.unit.parts[2]], axis=0).max() > 1e-9


def test_films_and_housing_are_springs_in_series(soft):
    """Condensed to the journals: (K_film^-1 + K_housing^-1)^-1."""
    K = linearised(soft)[2]
    own, h = soft.unit.matrices[1], soft.unit.parts[2]
    with_films = K[h, h]
    felt = K - K[:, h] @ np.linalg.solve(with_films, K[h, :])
    for k, f in enumerate(soft.forces.films[:2]):
        at = np.r_[24 * k : 24 * k + 2]  # first and last node of the pinion
        film, spring = f.stiffness[:2, :2], 8e7 * np.eye(2)
        series = np.linalg.inv(np.linalg.inv(film) + np.linalg.inv(spring))
        got = (felt - own)[np.ix_(at, at)]
        assert_allclose(got, series, rtol=1e-9, atol=1e-6 * np.abs(series).max())
        assert np.abs(series).max() < 0.8 * np.abs(film).max()


def test_a_bearing_without_bush_is_named():
    house = springs(1e8)
    flat = {k: np.zeros((2, 8)) for k in NODES}
    for bushes, words in (({0: house.bushes[0][0]}, r"at nodes \[0, 4\]"), (flat, r"\(6, 8\)")):
        wrong = replace(house, bushes=(bushes, house.bushes[1]))
        refuses(ModelError, words, replace, unit(), housing=wrong)


def test_a_reduced_body_is_held_and_bends_as_a_cantilever():
    size, options = (0.4, 0.02, 0.03), {"interfaces": dict(KINDS), "certify": False}
    body = rom.reduce(bar(size, (8, 1, 1)), method=rom.CraigBampton(4), **options)
    names = dict.fromkeys(NODES, "tip")
    axes = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    made = partial(Housing.of_body, body, pinion=names, gear=names, fixed=("root",))
    house = made(axes=axes)
    B = house.bushes[1][4]
    soft = B @ np.linalg.solve(house.K, B.T)
    sections = (size[2], size[1]), (size[1], size[2])
    slender = [size[0] ** 3 / (3 * STEEL.E * b * h**3 / 12) for b, h in sections]
    assert_allclose(np.diag(soft)[:2], slender, rtol=0.03)  # the clamped end does not contract
    assert soft[2, 2] == pytest.approx(size[0] / (STEEL.E * size[1] * size[2]), rel=0.03)
    assert soft[0, 4] == pytest.approx(slender[0] * 1.5 / size[0], rel=0.03)  # u_x by phi_y
    assert soft[1, 3] == pytest.approx(-slender[1] * 1.5 / size[0], rel=0.03)
    first = np.sqrt(house.K[0, 0] / house.M[0, 0]) / (2 * np.pi)
    assert first == pytest.approx(body.frequencies(1, fixed=("root",))[0], rel=1e-6)
    refuses(ModelError, "orthonormal rows", made, axes=2 * axes)
