"""Placement of channels: exhaustive search, linear estimation, other layouts, and updates."""

from itertools import combinations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.stats import chi2

import rom
from cases.components.updating import PARAMETERS, exact_responses, family_of, model_of, refuse
from cases.long import few
from rom.components.updating.frf_data import noisy
from rom.components.updating.normal_equations import responses_at
from rom.components.updating.placement import eliminated, gain
from rom.errors import ModelError, ParameterError
from rom.updating import Channels, Responses, candidates, independent, place

LINES = np.linspace(20, 1400, 60)
SHAKERS = Channels([[1.0, 0, 0], [0.5, 0, 0], [0.25, 0, 0]], [[0, 1, 1]] * 3)
FLOOR = 0.02  # [m/s^2 per N]


@pytest.fixture(scope="module")
def family():
    return family_of(PARAMETERS, (12, 2, 2), 10)


def planned(family, offered, n, **options):
    options = {"floor": FLOOR, "fixed": ("root",), "n_sensors": n, **options}
    return place(family, offered, options.pop("shakers", SHAKERS), LINES, **options)


def volume(plan):
    """Standard deviation of a parameter, geometric mean over the three."""
    return np.linalg.det(plan.covariance[:3, :3]) ** (1 / 6)


def test_a_plan_and_effective_independence_find_what_an_exhaustive_search_finds(family):
    offered = candidates(family.body, 3, fixed=("root",))
    shaker = SHAKERS.some([0])
    plan = planned(family, offered, 3, shakers=shaker)
    sets = list(combinations(range(9), 3))
    plans = (planned(family, offered.some(list(c)), 3, shakers=shaker) for c in sets)
    trials = dict(zip(sets, map(volume, plans), strict=True))
    assert tuple(plan.sensor_numbers) == min(trials, key=trials.get)
    assert_allclose(volume(plan), min(trials.values()), rtol=1e-9)
    body, offered = family.body, candidates(family.body, 4, fixed=("root",))
    _, V = body.modes(fixed=("root",))
    Phi = offered.rows(body, "sensor") @ V[:, :3]
    sets = [list(c) for c in combinations(range(12), 4)]
    best = max(sets, key=lambda c: np.linalg.det(Phi[c].T @ Phi[c]))
    kept, table = independent(body, offered, 4, modes=3, fixed=("root",))
    assert_array_equal(kept, best)
    P = Phi[kept]
    for i, j in np.ndindex(3, 3):
        cosine = P[:, i] @ P[:, j] / np.linalg.norm(P[:, i]) / np.linalg.norm(P[:, j])
        assert_allclose(table[i, j], cosine**2, atol=1e-12)


def test_the_information_is_the_inverse_covariance_of_linear_estimation(family):
    """2000 noisy tests; derivatives by differences of responses, not by those of the plan."""
    offered = candidates(family.body, 2, fixed=("root",))
    plan = planned(family, offered, 6, n_inputs=2)
    model = model_of(family, (plan.sensors, plan.inputs), ("root",))
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
    offered = candidates(family.body, 4, fixed=("root",))
    H = exact_responses(model_of(family, (offered, offered), ("root",)), {}, LINES, 0.01)
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

    def plan(n=3, at=offered, **options):
        return planned(family, at, n, **options)

    def kept(n, at=offered):
        return independent(family.body, at, n, modes=3, fixed=("root",))

    along = offered.some(np.arange(0, 12, 3))
    one = Channels(np.repeat(np.asarray(along.points)[:1], 4, axis=0), along.directions)
    far = Channels([[9.0, 0, 0]], [[1, 0, 0]])
    refuse(
        (lambda: plan(1, far), "off the body"),
        (lambda: plan(13), "n_sensors = 13"),
        (lambda: plan(n_inputs=4), "n_inputs = 4"),
        (lambda: plan(floor=0.0), "one of them must be positive"),
        (lambda: plan(prior={"E": 1.0}), ParameterError, "no parameter 'E'"),
        (lambda: kept(2), "n = 2 "),
        (lambda: kept(4, one), ModelError, "modes apart"),
        (lambda: candidates(family.body, 5000), "n = 5000"),
    )


REGIONS = ("inner", "middle", "outer")
FACTORS = {f"E_{name}": rom.YoungsModulus(name, 0.4, 2.5) for name in REGIONS[::2]}
FACTORS |= {"rho_middle": rom.Density("middle", 0.5, 2.0)}
BEAM, PLATE = ((1.0, 0.1, 0.08), (6, 1, 1)), ((0.6, 0.4, 0.02), (6, 2, 1))
CASES = {  # body, what is held, highest line [Hz]: two or three modes lie below
    "cantilever": (BEAM, ("root",), 1400.0),
    "beam between walls": (BEAM, ("root", "tip"), 3000.0),
    "free plate": (PLATE, (), 600.0),
    "plate on a wall": (PLATE, ("root",), 400.0),
}
N_SENSORS, DRAWS, NOISE = 6, 80, 0.02


class Case:
    """A family, its candidates, and plans with some of them."""

    def __init__(self, name):
        (size, cells), self.fixed, highest = CASES[name]
        self.family = family_of(FACTORS, cells, 8, REGIONS, size=size)
        self.lines = np.linspace(highest / 50, highest, 60)
        self.offered, self.shakers = (self.even(n) for n in (8, 3))

    def even(self, n):
        return candidates(self.family.body, n, fixed=self.fixed)

    def plan(self, sensors, inputs, **options):
        options = {"floor": 0.02, "n_sensors": N_SENSORS, "fixed": self.fixed} | options
        return place(self.family, sensors, inputs, self.lines, **options)


@pytest.fixture(scope="module", params=CASES)
def case(request):
    return Case(request.param)


def measures(plan):
    """Of the covariance of the parameters: root of the determinant per parameter, and trace."""
    C = plan.covariance[:3, :3]
    return np.array([np.linalg.det(C) ** (1 / 6), np.trace(C) ** 0.5])


def test_a_plan_beats_even_layouts_with_any_shaker(case):
    best = measures(case.plan(case.offered, case.shakers))
    two = case.even(2)
    even = [measures(case.plan(two, case.shakers.some([k]))) for k in range(9)]
    assert (np.min(even, axis=0) > 1.2 * best).all()
    assert (np.median(even, axis=0) > 2.0 * best).all()


@pytest.mark.parametrize("seed", range(4))
def test_a_plan_beats_random_layouts(case, seed):
    best = measures(case.plan(case.offered, case.shakers))
    rng = np.random.default_rng(seed)
    layouts = []
    for _ in range(12):
        sensors = case.offered.some(rng.permutation(24)[:N_SENSORS])
        layouts.append(measures(case.plan(sensors, case.shakers.some([rng.integers(9)]))))
    assert (np.median(layouts, axis=0) > 2.0 * best).all()
    assert (np.min(layouts, axis=0) > 1.05 * best).all()


@pytest.mark.parametrize("case", few(1, ["cantilever", "free plate"]), indirect=True)
def test_updates_scatter_as_the_plan_foretells(case):
    """d^T C^-1 d over all draws is chi-square of three times their number, in all directions."""
    plan = case.plan(case.offered, case.shakers, floor=0.0, noise=NOISE)
    channels, found, rng = (plan.sensors, plan.inputs), [], np.random.default_rng(7)
    exact = exact_responses(model_of(case.family, channels, case.fixed), {}, case.lines, 0.01)
    for _ in range(DRAWS):
        H, coherence = noisy(exact, np.sqrt(2) * NOISE, rng), 1 / (1 + 2 * 100 * NOISE**2)
        test = Responses(case.lines, H, *channels, coherence, 100)
        found.append(rom.update(case.family, test, fixed=case.fixed))
    d = np.log([[u.factors[name] for name in FACTORS] for u in found])
    C = plan.covariance[:3, :3]
    along = np.linalg.eigh(C)[1]
    size = np.square(d @ along) / np.diag(along.T @ C @ along)
    low, high = chi2.ppf([0.001, 0.999], DRAWS)
    assert ((size.sum(axis=0) > low) & (size.sum(axis=0) < high)).all(), size.mean(axis=0)
    for name in FACTORS:
        mean = np.mean([u.deviations[name] for u in found])
        assert_allclose(mean, plan.deviations[name], rtol=0.05)
    assert not plan.unseen and not any(u.unseen for u in found)


@pytest.mark.parametrize("case", ["cantilever"], indirect=True)
def test_a_test_made_after_a_written_plan_is_read_and_updates(case, tmp_path):
    plan = case.plan(case.offered, case.shakers, floor=0.0, noise=NOISE)
    (tmp_path / "plan.uff").write_text(plan.uff())
    rows = [line.split(",") for line in plan.csv().splitlines()[1:]]
    d = np.array([row[5:] for row in rows], dtype=float)
    axis = np.abs(d).argmax(axis=1)
    signed = enumerate(zip(axis, d, strict=True), 1)
    dofs = [f"{k}{'-+'[int(x[a] > 0)]}{'XYZ'[a]}" for k, (a, x) in signed]
    model = model_of(case.family, (plan.sensors, plan.inputs), case.fixed)
    H = np.ascontiguousarray(exact_responses(model, {}, case.lines, 0.01)[:, :, 0])
    names = [f"{dof}/{dofs[-1]} {part} [m/N]" for dof in dofs[:-1] for part in ("real", "imag")]
    values = np.column_stack([case.lines, H.view(float).reshape(len(H), -1)])
    text = [",".join(["Frequency [Hz]", *names])]
    text += [",".join(f"{x:.12g}" for x in row) for row in values]
    (tmp_path / "test.csv").write_text("\n".join(text))
    read = {"averages": 100, "coherence": 0.95, "points": tmp_path / "plan.uff"}
    test = rom.io.read_responses(tmp_path / "test.csv", **read)
    for read, planned in ((test.sensors, plan.sensors), (test.inputs, plan.inputs)):
        assert_allclose(read.points, planned.points, atol=1e-5)
        assert_allclose(read.directions, planned.directions)
    found = rom.update(case.family, test, fixed=case.fixed, damping=0.02)
    assert_allclose([found.factors[name] for name in FACTORS], 1.0, atol=1e-3)
