"""Placement of channels: exhaustive search, linear estimation, random and even layouts."""

from itertools import combinations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import rom
from cases.solid import STEEL, composite
from rom.components.updating.family_model import family_model
from rom.components.updating.normal_equations import responses_at
from rom.components.updating.placement import eliminated, gain
from rom.errors import ConfigError, ModelError, ParameterError
from rom.updating import Channels, candidates, independent, place

PARAMETERS = {
    "E_inner": rom.YoungsModulus("inner", 0.4, 2.5),
    "E_outer": rom.YoungsModulus("outer", 0.4, 2.5),
    "rho_outer": rom.Density("outer", 0.5, 2.0),
}
LINES = np.linspace(20, 1400, 60)
SHAKERS = Channels([[1.0, 0, 0], [0.5, 0, 0], [0.25, 0, 0]], [[0, 1, 1]] * 3)
FLOOR = 0.02  # [m/s^2 per N]


@pytest.fixture(scope="module")
def family():
    model = composite(
        {"inner": STEEL, "outer": STEEL}, lambda c: "inner" if c[0] < 6 else "outer",
        (1.0, 0.1, 0.08), (12, 2, 2),
    )  # fmt: skip
    return rom.reduce_parametric(
        model, parameters=PARAMETERS, method=rom.CraigBampton(10), certify=False,
        interfaces={"root": "rbe2", "tip": "rbe2"},
    )  # fmt: skip


def planned(family, offered, n, **options):
    options = {"floor": FLOOR, "fixed": ("root",), "n_sensors": n, **options}
    return place(family, offered, options.pop("shakers", SHAKERS), LINES, **options)


def some(channels, numbers):
    return Channels(np.asarray(channels.points)[numbers], np.asarray(channels.directions)[numbers])


def volume(plan):
    """Standard deviation of a parameter, geometric mean over the three."""
    return np.linalg.det(plan.covariance[:3, :3]) ** (1 / 6)


def test_the_best_three_of_nine_are_those_of_an_exhaustive_search(family):
    offered = candidates(family.body, 3, fixed=("root",))
    shaker = some(SHAKERS, [0])
    plan = planned(family, offered, 3, shakers=shaker)
    trials = {
        c: volume(planned(family, some(offered, list(c)), 3, shakers=shaker))
        for c in combinations(range(9), 3)
    }
    assert tuple(plan.sensor_numbers) == min(trials, key=trials.get)
    assert_allclose(volume(plan), min(trials.values()), rtol=1e-9)


def test_the_information_is_the_inverse_covariance_of_linear_estimation(family):
    """2000 noisy tests; derivatives by differences of responses, not by those of the plan."""
    offered = candidates(family.body, 2, fixed=("root",))
    plan = planned(family, offered, 6, n_inputs=2)
    rows = plan.sensors.rows(family.body, "sensor"), plan.inputs.rows(family.body, "input")
    model = family_model(family, rows, {}, {}, ("root",))
    omega, n = 2 * np.pi * LINES, len(plan.names)

    def at(q):
        H = responses_at(model, q[:3], np.exp(q[3:]), omega)
        return (H * omega[:, None, None] ** 2 / FLOOR).ravel()

    origin = np.r_[np.zeros(3), np.full(n - 3, np.log(0.01))]
    J = np.array([(at(origin + d) - at(origin - d)) / 2e-5 for d in 1e-5 * np.eye(n)]).T
    J = np.vstack([J.real, J.imag])
    prior = np.r_[[np.log(p.high / p.low) for p in PARAMETERS.values()], np.full(n - 3, 1.5)]
    rng = np.random.default_rng(3)
    e = rng.standard_normal((2000, len(J)))
    before = rng.standard_normal((2000, n)) / prior
    A = np.vstack([J, np.diag(1 / prior)])
    found = np.linalg.lstsq(A, np.hstack([e, before * prior]).T, rcond=None)[0]
    assert_allclose(np.linalg.inv(A.T @ A), plan.covariance, rtol=1e-5, atol=1e-9)
    ratio = np.linalg.solve(plan.covariance[:3, :3], np.cov(found)[:3, :3])
    assert_allclose(np.linalg.eigvals(ratio), 1.0, atol=0.12)


def test_the_plan_beats_random_and_even_layouts(family):
    """Six of sixty; also the shaker is chosen."""
    offered = candidates(family.body, 20, fixed=("root",))
    plan = planned(family, offered, 6)
    rng = np.random.default_rng(0)
    at_random = [
        volume(planned(family, some(offered, rng.permutation(60)[:6]), 6,
                       shakers=some(SHAKERS, [rng.integers(3)])))
        for _ in range(30)
    ]  # fmt: skip
    even = candidates(family.body, 2, fixed=("root",))
    assert np.median(at_random) > 1.4 * volume(plan)
    assert volume(plan) < min(at_random)
    assert volume(planned(family, even, 6, shakers=some(SHAKERS, [1]))) > 1.2 * volume(plan)


def test_effective_independence_finds_what_an_exhaustive_search_finds(family):
    body = family.body
    offered = candidates(body, 4, fixed=("root",))
    _, V = body.modes(fixed=("root",))
    Phi = offered.rows(body, "sensor") @ V[:, :3]
    best = max(
        combinations(range(12), 4), key=lambda c: np.linalg.det(Phi[list(c)].T @ Phi[list(c)])
    )
    kept, table = independent(body, offered, 4, modes=3, fixed=("root",))
    assert_array_equal(kept, best)
    P = Phi[kept]
    for i, j in np.ndindex(3, 3):
        cosine = P[:, i] @ P[:, j] / np.linalg.norm(P[:, i]) / np.linalg.norm(P[:, j])
        assert_allclose(table[i, j], cosine**2, atol=1e-12)


def test_damping_is_sought_too():
    """Information on one parameter, a second one unknown: n11 - n12^2 / n22."""
    N = np.array([[4.0, 2.0], [2.0, 3.0]])
    assert_allclose(gain(N, 1), np.log(4 - 4 / 3))
    blocks = np.array([np.diag([1.0, 9.0]), np.diag([2.0, 0.0]), np.diag([1.5, 1.0])])
    assert eliminated(np.eye(2), blocks, 1, 1) == [1]


def test_what_is_not_seen_is_named(family):
    """Far below resonance there is compliance alone, not mass."""
    tip = Channels([[1.0, 0, 0]], [[0, 1, 1]])
    offered = candidates(family.body, 6, fixed=("root",))
    low = {"n_sensors": 6, "noise": 0.05, "fixed": ("root",)}
    plan = place(family, offered, tip, [0.5, 1.0], **low)
    assert any(abs(v.get("rho_outer", 0.0)) > 0.9 for v in plan.unseen)
    assert "not seen" in str(plan) and plan.deviations["rho_outer"] > 0.5
    known = place(family, offered, tip, [0.5, 1.0], prior={"rho_outer": 0.05}, **low)
    assert_allclose(known.deviations["rho_outer"], 0.05, rtol=0.01)
    assert not any("rho_outer" in v for v in known.unseen)


def test_the_floor_is_a_thousandth_of_the_largest_response(family):
    """Accelerations per force of the finest peak among the candidates, at factors of one."""
    offered = candidates(family.body, 4, fixed=("root",))
    rows = offered.rows(family.body, "candidate")
    H = responses_at(family_model(family, (rows, rows), {}, {}, ("root",)), np.zeros(3),
                     np.array([0.01]), 2 * np.pi * LINES)  # fmt: skip
    largest = ((2 * np.pi * LINES) ** 2 * np.abs(H).max(axis=(1, 2))).max()
    same = planned(family, offered, 3, shakers=offered, noise=0.05, floor=1e-3 * largest)
    found = planned(family, offered, 3, shakers=offered, noise=0.05, floor=None)
    assert_allclose(found.covariance, same.covariance, rtol=1e-9)


def test_the_plan_is_written(family):
    offered = candidates(family.body, 4, fixed=("root",))
    plan = planned(family, offered, 3, n_inputs=2)
    rows = [line.split(",") for line in plan.csv().splitlines()]
    assert [row[0] for row in rows] == ["kind", *["sensor"] * 3, *["input"] * 2]
    assert_allclose(np.array(rows[1:4])[:, 2:5].astype(float), plan.sensors.points)
    assert_allclose(np.array(rows[4], dtype=object)[5:].astype(float), [0, 0.5**0.5, 0.5**0.5])
    lines = plan.uff().splitlines()
    assert [lines[k].strip() for k in (0, 1, -1)] == ["-1", "15", "-1"]
    points = np.array([[float(x) for x in line[40:].split()] for line in lines[2:-1]])
    assert_allclose(points, np.vstack([plan.sensors.points, plan.inputs.points]), atol=1e-5)


def test_wrong_plans_are_named(family):
    offered = candidates(family.body, 4, fixed=("root",))

    def refused(words, call, kind=ConfigError):
        with pytest.raises(kind, match=words):
            call()

    refused("off the body", lambda: planned(family, Channels([[9.0, 0, 0]], [[1, 0, 0]]), 1))
    refused("n_sensors = 13", lambda: planned(family, offered, 13))
    refused("n_inputs = 4", lambda: planned(family, offered, 3, n_inputs=4))
    refused("one of them must be positive", lambda: planned(family, offered, 3, floor=0.0))
    refused(
        "above zero", lambda: place(family, offered, SHAKERS, [0.0, 1.0], n_sensors=2, noise=0.1)
    )
    refused(
        "no parameter 'E'", lambda: planned(family, offered, 3, prior={"E": 1.0}), ParameterError
    )
    refused("must be positive", lambda: planned(family, offered, 3, prior={"E_inner": 0.0}))
    refused("n = 2 ", lambda: independent(family.body, offered, 2, modes=3, fixed=("root",)))
    along = some(offered, np.arange(0, 12, 3))
    one = Channels(np.repeat(np.asarray(along.points)[:1], 4, axis=0), along.directions)
    refused(
        "modes apart",
        lambda: independent(family.body, one, 4, modes=3, fixed=("root",)),
        ModelError,
    )
    refused("n = 5000", lambda: candidates(family.body, 5000))
