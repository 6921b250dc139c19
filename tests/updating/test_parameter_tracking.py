"""Parameters that change in operation: exact derivatives, another filter, chi-square both ways."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.stats import chi2

import rom
from cases.components.updating import assert_alike, family_of, fed, refuse, stepped, walked
from cases.mbs.fmu_instance import Instance, fmpy
from cases.refusals import refuses
from rom import updating
from rom.body.recovery import StressRecovery
from rom.components.updating.observers import parameter_tracking
from rom.components.updating.observers.parameter_tracking import LINEAR_REACH
from rom.errors import ParameterError, SolverError
from rom.updating import Channels, Drift, Sensors

DT = 1e-3
PARAMETERS = {
    "E_inner": rom.YoungsModulus("inner", 0.4, 2.5),
    "rho_outer": rom.Density("outer", 0.5, 2.0),
}
TIP = Channels([[1.0, 0, 0]], [[0, 0, 1]])
GAUGE = Channels([[0.1, 0.05, 0.08]], [[1, 0, 0]])
FEW = (
    Sensors(GAUGE, "strain", 2e-7),
    Sensors(Channels([[0.5, 0.1, 0], [1.0, 0.1, 0]], [[0, 0, 1]] * 2), "acceleration", 0.5),
)
SENSORS = ("strain[1]", "acceleration[1]", "acceleration[2]")
WANTED = (Sensors(TIP, "displacement"), Sensors(GAUGE, "stress"))
SPRING = {"clamp": updating.GroundSpring("tip", (0.0, 0.0, 4e6), 0.2, 5.0)}
DRIFTS = {"E_inner": Drift(0.05, 0.02), "clamp": Drift(0.05, 0.02)}


@pytest.fixture(scope="module")
def family():
    family = family_of(PARAMETERS, (8, 1, 1), 2, reference="root")
    # bricks recover no stress: any shares of it will do
    rng, r = np.random.default_rng(0), family.body.n_modes
    shares = [replace(s, stress=rng.normal(size=(6, r))) for s in family.shares]
    stress = StressRecovery(np.array(GAUGE.points), sum(s.stress for s in shares))
    return replace(family, shares=tuple(shares), body=replace(family.body, stress=stress))


@pytest.fixture(scope="module")
def filter_(family):
    return made(family)


def made(family, **options):
    channels = options.pop("sensors", FEW), options.pop("forces", TIP), WANTED
    usual = {"dt": DT, "walk": 3000.0, "fixed": ("root",), "unmodelled": 1e-3}
    options = usual | {"parameters": DRIFTS, "attached": SPRING} | options
    return updating.parameter_tracker(family, *channels, **options)


def test_derivatives_are_those_of_differences(filter_):
    x, h = np.array([0.2, -0.3]), 1e-5
    at = filter_.operation.at(x)
    _, steps, _ = filter_.at(x)
    for j, d in enumerate(h * np.eye(2)):
        up, down = (filter_.operation.at(x + s * d) for s in (1, -1))
        for name in ("A", "C", "W"):
            expected = (getattr(up, name) - getattr(down, name)) / (2 * h)
            size = np.abs(expected).max() + 1e-300
            assert_allclose(getattr(at, f"d{name}")[j] / size, expected / size, atol=1e-7)
        expected = (filter_.at(x + d)[1].A - filter_.at(x - d)[1].A) / (2 * h)
        assert_allclose(steps.dA[j], expected, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize(
    ("factors", "damping"), [({}, 0.02), ({"E_inner": 1.5, "rho_outer": 0.7}, 0.0)]
)
def test_held_factors_are_those_of_the_body_there(family, factors, damping):
    drifts = {name: Drift(0.1) for name in PARAMETERS}
    askew = replace(FEW[1].channels, directions=[[1, 2, 3]] * 2)
    few = FEW[0], replace(FEW[1], channels=askew)  # all motions are seen
    force = replace(TIP, directions=[[1, 2, 3]])
    given = {"sensors": few, "forces": force, "parameters": drifts, "attached": None}
    held = made(family, **given, unmodelled=0.0, damping=damping).held(**factors)
    body = family.at(**factors)
    held_ratios = rom.ModalDamping(damping, fixed=("root",))
    body = replace(body, D=held_ratios.matrix(body))
    own = updating.tracker(body, few, force, WANTED, dt=DT, walk=3000.0, fixed=("root",))
    y = 50 * np.sqrt(held.R) * np.random.default_rng(1).standard_normal((300, 3))
    assert_alike(held.run(y), own.run(y), ("values", "deviations", "forces"), 1e-6)


def test_the_filter_is_an_extended_one_linearised_at_every_step(filter_, monkeypatch):
    """Written out in NumPy; a point that stays within reach leaves a fraction of a deviation."""
    t, rng = filter_, np.random.default_rng(5)
    _, _, y = walked(t, rng, 300)
    n = len(t.assumed.before(t.operation))
    z = np.zeros(n + 2)
    P = np.zeros((n + 2,) * 2)
    P[:n, :n] = t.assumed.before(t.operation)
    P[n:, n:] = 0.05**2 * np.eye(2)
    for k, sample in enumerate(y):
        if k:
            _, at, Q = t.at(z[n:])
            F = np.eye(n + 2)
            F[:n, :n] = at.A
            F[:n, n:] = (at.dA @ z[:n]).T
            z[:n] = at.A @ z[:n]
            P = F @ P @ F.T + Q
        for i, r in enumerate(t.R):
            at = t.operation.at(z[n:])
            c = np.r_[at.C[i], at.dC[:, i] @ z[:n]]
            g = P @ c / (c @ P @ c + r)
            z, P = z + g * (sample[i] - at.C[i] @ z[:n]), P - np.outer(g, c @ P)
    size = np.sqrt(np.diag(P))[n:]
    for reach, share in ((0.0, 0.08), (LINEAR_REACH, 0.4)):
        monkeypatch.setattr(parameter_tracking, "LINEAR_REACH", reach)
        found = t.run(y)
        assert (np.abs(np.log(found.factors[-1]) - z[n:]) < share * size).all()
        assert_allclose(found.factor_deviations[-1], size, rtol=0.03)
    assert size.min() < 0.3 * 0.05  # the record says something
    assert abs(np.log(found.factors)).max() > 3 * LINEAR_REACH


def totals(t, assumed, n_draws, n_t, seed):
    """Normalised squares of innovations, of logarithms of factors, and of what is wanted."""
    rng, sums = np.random.default_rng(seed), [0.0, 0.0, 0.0]
    for _ in range(n_draws):
        factors, values, y = walked(t, rng, n_t)
        found = assumed.run(y)
        own = found.covariance[-2:, -2:]
        e = np.log(found.factors[-1]) - factors[-1]
        wanted = ((found.values[-1] - values[-1]) / found.deviations[-1]) ** 2
        parts = found.surprise.sum(), e @ np.linalg.solve(own, e), wanted
        sums = [a + b for a, b in zip(sums, parts, strict=True)]
    return sums


def test_errors_are_as_large_as_the_filter_says(filter_):
    n, n_t = 20, 300
    surprise, factors, wanted = totals(filter_, filter_, n, n_t, 11)
    for total, freedom in ((surprise, 3 * n * n_t), (factors, 2 * n), *((x, n) for x in wanted)):
        assert chi2.ppf(1e-3, freedom) < total < chi2.ppf(1 - 1e-3, freedom)


@pytest.mark.parametrize(("noise", "side"), [(1.1, -1), (0.9, 1)])
def test_noise_wrong_by_a_tenth_leaves_the_band(filter_, noise, side):
    """A filter that thinks too little of sensors and forces fails as one that thinks too much."""
    n, n_t, assumed = 8, 300, filter_.assumed
    walk, white = noise * assumed.walk, noise * assumed.unmodelled
    assumed = replace(assumed, walk=walk, unmodelled=white, first=assumed.walk)
    wrong = replace(filter_, R=filter_.R * noise**2, assumed=assumed)
    surprise, _, _ = totals(filter_, wrong, n, n_t, 12)
    low, high = chi2.ppf([1e-3, 1 - 1e-3], 3 * n * n_t)
    assert surprise < low if side < 0 else surprise > high


def test_a_joint_that_loosens_is_followed(family):
    t = made(family, parameters={"clamp": Drift(0.02, 0.5)})
    rng, n_t = np.random.default_rng(3), 3000
    true = np.log(0.5) * np.clip((np.arange(n_t) // 50 * 50 - 500) / 1000, 0, 1)
    x, y = np.zeros(len(t.assumed.before(t.operation))), []
    for k in range(n_t):
        if k % 50 == 0:
            at, step, root = stepped(t, true[k : k + 1])
        y.append(at.C @ x)
        x = step @ x + root @ rng.standard_normal(len(x))
    y = np.array(y) + np.sqrt(t.R) * rng.standard_normal((n_t, 3))
    found = t.run(y, DT * np.arange(n_t))
    error = np.log(found.factors[:, 0]) - true
    assert abs(found.factors[1500:, 0].mean() - 0.5) < 0.05
    assert abs(error[-1]) < 3 * found.factor_deviations[-1, 0] < 0.6
    assert (np.abs(error) < 3 * found.factor_deviations[:, 0]).mean() > 0.98
    stays = t.held().run(y)  # a filter that does not follow is surprised
    assert stays.surprise[1500:].sum() > chi2.ppf(1 - 1e-6, 3 * 1500)
    assert found.surprise[1500:].sum() < chi2.ppf(1 - 1e-6, 3 * 1500)


def test_the_fmu_follows_as_python_does(family, tmp_path):
    t = made(family, parameters=DRIFTS | {"rho_outer": Drift(0.05, 0.02)})
    _, _, y = walked(t, np.random.default_rng(1), 400)
    path = rom.io.write_observer_fmu(t, tmp_path / "joint.fmu")
    assert fmpy.validation.validate_fmu(str(path)) == []
    one, expected = Instance(path, tmp_path).begin(), t.run(y)
    assert np.ptp(np.log(expected.factors), axis=0).min() > 2 * LINEAR_REACH
    wanted = ("displacement[1]", "stress[1]", "force[1]", *(f"factor.{name}" for name in t.names))
    names = [f"{kind}.{name}" for kind in ("estimate", "deviation") for name in wanted]
    found = [fed(one, SENSORS, y[:100], names, DT)]
    kept = one.fmu.getFMUState()
    fed(one, SENSORS, y[100:120], names, DT, 100)
    one.fmu.setFMUState(kept)
    found.append(fed(one, SENSORS, y[100:], names, DT, 100))  # the same again, and on
    parts = ("values", "forces", "factors", "deviations", "force_deviations", "factor_deviations")
    same = np.hstack([getattr(expected, part) for part in parts])
    scale = np.abs(same).max(axis=0)
    assert_allclose(np.vstack(found) / scale, same / scale, rtol=0, atol=1e-10)


def test_the_fmu_names_the_parameter_that_leaves_its_range(family, tmp_path):
    narrow = {"clamp": replace(SPRING["clamp"], low=0.97, high=1.03)}
    t = made(family, attached=narrow)
    _, _, y = walked(made(family), np.random.default_rng(2), 400)
    refuses(SolverError, "'clamp' has reached", t.run, y)
    one = Instance(rom.io.write_observer_fmu(t, tmp_path / "joint.fmu"), tmp_path).begin()
    refuses(fmpy.fmi1.FMICallException, "status 3", fed, one, SENSORS, y, (), DT)
    assert "parameter 'clamp' has reached the factor" in one.log[-1]
    assert "from 0.97 to 1.03" in one.log[-1]


def test_what_cannot_be_followed_is_named(family, filter_):
    wide = {name: Drift(0.3) for name in DRIFTS}
    _, _, y = walked(replace(filter_, drifts=wide), np.random.default_rng(0), 200)
    narrow = {"clamp": replace(SPRING["clamp"], low=0.98, high=1.02)}
    lost, left = made(family, parameters=wide, attached=narrow), r"has reached .* 0\.98 to 1\.02"
    unknown = {"E_outer": Drift(0.1)}
    assert filter_.run(np.zeros((0, 3))).factors.shape == (0, 2)
    refuse(
        (lambda: made(family, parameters=unknown), "no parameter 'E_outer'.*clamp"),
        (lambda: made(family, parameters={}), "no parameter changes"),
        (lambda: filter_.run(np.zeros((5, 2))), r"samples \(5, 2\)"),
        (lambda: filter_.held(E=1.0), ParameterError, "'E' must be one of .'E_inner'"),
        (lambda: lost.run(y), SolverError, f"'clamp' {left}"),
    )
