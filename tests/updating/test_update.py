"""Updating of families by measured responses: derivatives, statistics of what is found, verdict."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh, solve_sylvester, sqrtm

import rom
from cases.components import updating
from cases.components.updating import PARAMETERS, family_of, refuse
from cases.solid import STEEL, composite
from rom.components.families.layers import Stretch
from rom.components.updating.estimate import _before, _Search
from rom.components.updating.family_model import family_model
from rom.components.updating.frf_data import noisy
from rom.components.updating.methods import receptance
from rom.components.updating.normal_equations import Data, responses_at, sums
from rom.errors import ParameterError, SolverError
from rom.updating import AddedMass, Channels, GroundSpring, Responses

CELLS = (12, 2, 2)
TRUE = {"E_inner": 1.3, "E_outer": 0.75, "rho_outer": 1.2}
GRID = [[x, 0.05 * k, 0.04 * m] for x in (0.25, 0.5, 0.75, 1.0) for k, m in ((0, 0), (2, 2))]
SENSORS = updating.crossed(GRID)
FEW = SENSORS.some(range(5, 11))
INPUTS = Channels([[1.0, 0.0, 0.0], [0.5, 0.1, 0.08]], [[0, 1, 1], [0, 1, -0.5]])
LINES = np.linspace(20, 1400, 150)
AVERAGES = 50
HELD = {"root": "x y z rx ry rz"}


@pytest.fixture(scope="module")
def family():
    return family_of(PARAMETERS, CELLS, 10)


def model_of(family, attached=None, candidates=None, fixed=HELD, sensors=SENSORS):
    return updating.model_of(family, (sensors, INPUTS), fixed, attached, candidates)


def synthetic(family, level=0.05, true=TRUE, lines=LINES, sensors=SENSORS, **made):
    how = {"level": level, "averages": AVERAGES, "fixed": HELD} | made
    return updating.noisy_test(family, true, (sensors, INPUTS), lines, **how)


def damped(K, M, zeta, omega, seen, driven):
    """S Z^-1 F with equal damping ratios: C = 2 zeta M (M^-1 K)^(1/2)."""
    C = 2 * zeta * M @ sqrtm(np.linalg.solve(M, K))
    Z = [K - w**2 * M + 1j * w * C for w in omega]
    return np.array([seen @ np.linalg.solve(z, driven.T) for z in Z])


def summed(model, x, amount=1.0):
    k, m = (np.prod(np.exp(x) ** p, axis=1) * amount for p in (model.k_powers, model.m_powers))
    return np.tensordot(k, model.K, 1), np.tensordot(m, model.M, 1)


def logarithmic(model, x, ratios, omega):
    """d ln H by all unknowns: gradients of residuals of one value, real and imaginary."""
    shape = (omega.size, len(model.sensors), len(model.driven))
    out = np.zeros((*shape, x.size + ratios.size), dtype=complex)
    log = np.log(responses_at(model, x, ratios, omega))
    for at in np.ndindex(shape):
        weight = np.zeros(shape)
        weight[at] = 1.0
        parts = [sums(model, x, ratios, Data(omega, log - c, weight)).gradient for c in (1, 1j)]
        out[at] = parts[0] + 1j * parts[1]
    return out


def test_the_model_of_a_complete_basis_is_the_finite_element_model():
    parts = {"inner": STEEL, "outer": STEEL}
    model = composite(parts, lambda c: "inner" if c[0] < 1 else "outer", cells=(3, 1, 1))
    kinds = {"interfaces": {"root": "full", "tip": "full"}, "certify": False}
    method = rom.CraigBampton(24)
    family = rom.reduce_parametric(model, parameters=PARAMETERS, method=method, **kinds)
    sides = (Channels(model.points[n], [[0, 1, 0]] * len(n)) for n in ([5, 9, 14], [13]))
    rows = [side.rows(family.body, "sensor") for side in sides]
    small = family_model(family, rows, {}, {}, ("root",))
    K, M = (getattr(model, name).toarray() for name in "KM")
    for E, rho, part in ((1.3, 1.0, "inner"), (0.75, 1.2, "outer")):
        K = K + (E - 1) * model.regions[part].K.toarray()
        M = M + (rho - 1) * model.regions[part].M.toarray()
    free = np.setdiff1d(np.arange(len(K)), model.interfaces["root"].dofs)
    K, M = K[np.ix_(free, free)], M[np.ix_(free, free)]
    S = np.eye(3 * len(model.points))[:, free]
    omega = 2 * np.pi * np.array([100.0, 700.0, 2500.0])
    full = damped(K, M, 0.02, omega, S[[16, 28, 43]], S[[40]])
    found = responses_at(small, np.log([1.3, 0.75, 1.2]), np.array([0.02]), omega)
    assert_allclose(found, full, atol=1e-8 * np.abs(full).max())


def test_derivatives_are_those_of_a_complex_step(family):
    """Without damping, where the step has the imaginary part for itself; of a candidate too."""
    spring = GroundSpring("tip", (1e5, 2e5, 3e5), 0.1, 10)
    model = model_of(family, {"k": spring}, {"m": AddedMass("tip", 1.0, 0.1, 10)})
    omega, x = 2 * np.pi * np.array([33.0, 260.0, 900.0]), np.array([0.2, -0.3, 0.1, 0.4, 0.0])
    none = np.array([1e-14])
    by_x = logarithmic(model, x, none, omega)[..., :-1]
    by_x = by_x * responses_at(model, x, none, omega)[..., None]
    for j in range(5):
        if j < 4:
            K, M = summed(model, x + 1e-30j * (np.arange(5) == j), model.amount)
        else:
            K, M = summed(model, x, model.amount + 1e-30j * (model.amount == 0))
        parts = [model.sensors @ np.linalg.solve(K - w**2 * M, model.driven.T) for w in omega]
        expected = np.array(parts).imag / 1e-30
        assert_allclose(by_x[..., j].real, expected, atol=1e-10 * np.abs(expected).max())


def test_derivatives_with_damping_are_those_of_the_square_root(family):
    """C = 2 zeta M X, X X = M^-1 K: dX by Sylvester's equation, no mode has to be followed."""
    model, zeta = model_of(family), 0.02
    omega, x = 2 * np.pi * np.array([33.0, 260.0, 900.0]), np.array([0.2, -0.3, 0.1])
    K, M = summed(model, x)
    V = eigh(K, M)[1]  # mass-normalised coordinates: numbers of equal size
    K, M, S, F = V.T @ K @ V, V.T @ M @ V, model.sensors @ V, model.driven @ V
    X = sqrtm(np.linalg.solve(M, K))
    found = logarithmic(model, x, np.full(2, zeta), omega)
    H = damped(K, M, zeta, omega, S, F)
    for j in range(4):
        dK, dM = np.zeros((2, *K.shape))
        if j < 3:
            dK, dM = (
                np.tensordot(p[:, j] * np.exp(p @ x), A, 1)
                for p, A in ((model.k_powers, model.K), (model.m_powers, model.M))
            )
            dK, dM = V.T @ dK @ V, V.T @ dM @ V
        dX = solve_sylvester(X, X, np.linalg.solve(M, dK - dM @ X @ X))
        dC = 2 * zeta * (dM @ X + M @ dX) + (j == 3) * 2 * zeta * M @ X
        expected = []
        for w in omega:
            Z, dZ = K - w**2 * M + 2j * w * zeta * M @ X, dK - w**2 * dM + 1j * w * dC
            expected.append(-S @ np.linalg.solve(Z, dZ @ np.linalg.solve(Z, F.T)))
        value = found[..., 3:].sum(axis=-1) if j == 3 else found[..., j]
        scale = np.abs(expected).max()
        assert_allclose(value * H, expected, atol=1e-8 * scale)


def test_sums_do_not_depend_on_blocks(family, monkeypatch):
    model, data = model_of(family), Data.of(synthetic(family))
    x, ratios = np.zeros(3), np.full(4, 0.02)
    whole = sums(model, x, ratios, data)
    monkeypatch.setattr("rom.components.updating.methods.BLOCK_LINES", 7)
    pieces = sums(model, x, ratios, data)
    for name in ("normal", "gradient", "squares"):
        expected = getattr(whole, name)
        scale = np.abs(expected).max()
        assert_allclose(getattr(pieces, name), expected, atol=1e-11 * scale)


def test_responses_of_many_lines_take_their_own_memory():
    """And that of a block: of all lines and modes at once it would be 192 MB."""
    rng = np.random.default_rng(0)
    seen, driven, g = (rng.normal(size=(n, 200)) for n in (20, 3, 3000))
    g = g + 1j
    tracemalloc.start()
    H = receptance(seen, g, driven)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < H.nbytes + 40e6
    assert_allclose(H, np.einsum("sn,fn,en->fse", seen, g, driven, optimize=True), rtol=1e-9)


def test_the_right_model_passes_held_or_free_and_its_report_says_so(family):
    found = rom.update(family, synthetic(family), fixed=HELD)
    assert found.verdict.ok and not found.unseen and not found.at_bound
    for values in (found.by_sensor, found.by_line):
        assert_allclose(np.mean(values), 1.0, atol=0.15)
    for name, value in TRUE.items():
        assert_allclose(found.factors[name], value, rtol=2e-3)
    assert_allclose(found.zeta[:4], 0.02, rtol=0.05)
    assert_allclose(found.body.mass, family.at(**found.factors).mass)
    assert "E_inner = 1." in str(found)
    test = synthetic(family, 0.0)
    assert_allclose(found.responses(LINES), test.H, atol=0.02 * np.abs(test.H).max())
    found = rom.update(family, synthetic(family, fixed=()), damping=0.02)
    assert found.model.n_rigid == 6 and found.verdict.ok
    for name, value in TRUE.items():
        assert_allclose(found.factors[name], value, rtol=2e-3)


def test_draws_spread_as_the_covariance_says(family):
    """ln|H| of another point, to first order: J C J^T with J by differences; the median is H."""
    found = rom.update(family, synthetic(family, 0.02), fixed=HELD, damping=0.02)
    there = Channels([[1.0, 0.1, 0.08]], [[0, 0.2, 1]])
    pushed, f = Channels([[0.5, 0.1, 0.08]], [[0, 1, 0.3]]), [300.0, 700.0]
    level = np.log(np.abs(found.drawn(f, there, pushed, n=400)[:, :, 0, 0]))
    model = updating.model_of(family, (there, pushed), HELD)
    theta = np.r_[np.log(list(found.factors.values())), np.log(found.zeta)]

    def at(q):
        return np.log(np.abs(responses_at(model, q[:3], np.exp(q[3:]), 2 * np.pi * np.array(f))))

    steps = 1e-5 * np.eye(theta.size)
    J = np.array([(at(theta + h) - at(theta - h))[:, 0, 0] / 2e-5 for h in steps]).T
    expected = np.sqrt(np.diag(J @ found.covariance @ J.T))
    assert_allclose(level.std(axis=0), expected, rtol=0.15)
    assert (np.abs(np.median(level, axis=0) - at(theta)[:, 0, 0]) < 0.2 * expected).all()


TIP = {"tip mass": AddedMass("tip", 1.0, 0.1, 10)}
TIP["tip spring"] = GroundSpring("tip", (0, 3e5, 3e5), 0.1, 10)


@pytest.mark.parametrize("name", TIP)
def test_a_wrong_model_is_refused(family, name):
    missing = {name: TIP[name]}
    candidates = TIP | {"tip twist": GroundSpring("tip", (0, 0, 0, 1e3, 0, 0), 0.1, 10)}
    test, options = synthetic(family, attached=missing), {"fixed": HELD, "damping": 0.02}
    found = rom.update(family, test, candidates=candidates, free=("E_inner", "E_outer"), **options)
    assert not found.verdict.ok
    assert found.factors["tip mass"] == 0.0
    cured = rom.update(family, test, attached=missing, free=tuple(PARAMETERS), **options)
    assert cured.verdict.ok
    assert abs(np.log(cured.factors[name])) < 4 * cured.deviations[name]


def test_a_search_without_end_names_what_is_missing_or_is_an_error(family, monkeypatch):
    """Everything is free and 1 kg is missing: 12 steps are not enough, its score is the largest."""
    monkeypatch.setattr("rom.components.updating.estimate.MAX_STEPS", 12)
    test = synthetic(family, attached={"tip mass": TIP["tip mass"]})
    found = rom.update(family, test, fixed=HELD, candidates=TIP, damping=0.02)
    failed = [row.quantity for row in found.verdict.failures]
    assert "steps of the search, which has not ended" in failed
    assert "largest score, tip mass [deviations]" in failed and found.scores["tip mass"] > 4
    assert "Offer springs, masses" in str(found) and "Free fewer parameters" in str(found)
    monkeypatch.setattr("rom.components.updating.estimate.MAX_MISFIT", np.inf)
    monkeypatch.setattr("rom.components.updating.estimate.MAX_STEPS", 2)
    with pytest.raises(SolverError, match="did not settle in 2 steps"):
        rom.update(family, synthetic(family), fixed=HELD)


def test_data_of_another_body_are_named(family):
    """Of one that carries 5 kg at its tip, half as much as itself: half the responses differ."""
    test = synthetic(family, attached={"m": AddedMass("tip", 5.0, 0.1, 10)})
    found = rom.update(family, test, fixed=HELD, damping=0.02)
    (unlike,) = (row for row in found.verdict.failures if "median FRAC" in row.quantity)
    a, b = found.responses(LINES), test.H
    squares = [np.abs((one * two.conj()).sum(axis=0)) for one, two in ((a, b), (a, a), (b, b))]
    frac = squares[0] ** 2 / squares[1] / squares[2]
    assert_allclose(unlike.value, 1 - np.median(frac), atol=1e-12)
    assert "whether the data are of this body" in str(found)


def test_lines_above_the_band_of_the_basis_are_named(family):
    """Of 34 elastic modes the lower 17 are trusted; lines without coherence do not count."""
    lines = np.r_[LINES, 7000.0, 9000.0]
    test = synthetic(family, lines=lines)
    found = rom.update(family, test, fixed=HELD, damping=0.02)
    (above,) = (row for row in found.verdict.failures if "the band" in row.quantity)
    omega, _ = found.body.modes(fixed=HELD)
    assert omega.size == 34
    assert_allclose(above.value, 9000 * 2 * np.pi / omega[16], rtol=1e-9)
    assert f"over {omega[16] / (2 * np.pi):.4g} Hz" in above.quantity
    assert "Leave these lines out" in str(found)
    c = np.where(lines > 1400, 0.0, float(test.coherence))[:, None, None] * np.ones(test.H.shape)
    H = test.H.copy()
    H[:20], c[:20] = np.nan, 0.0
    found = rom.update(family, replace(test, H=H, coherence=c), fixed=HELD, damping=0.02)
    assert found.verdict.ok and np.isnan(found.by_line[:20]).all()


def test_a_sensor_with_noise_of_its_own_is_located(family):
    test = synthetic(family)
    H = test.H.copy()
    H[:, 5] *= 1.03
    found = rom.update(family, replace(test, H=H), fixed=HELD, damping=0.02)
    assert not found.verdict.ok and np.nanargmax(found.by_sensor) == 5
    assert any("worst sensor, 5" in row.quantity for row in found.verdict.failures)
    H = test.H.copy()
    H[50:70] *= 1.05
    found = rom.update(family, replace(test, H=H), fixed=HELD, damping=0.02)
    assert 50 <= np.nanargmax(np.convolve(found.by_line, np.ones(9), "same")) < 70


def test_a_direction_that_the_data_do_not_see_is_named(family):
    """At one line far below resonance, without mass, compliance alone is seen: not the density."""
    test = synthetic(family, lines=np.linspace(0.5, 1.0, 4))
    found = rom.update(family, test, fixed=HELD, damping=0.02)
    assert any(abs(v.get("rho_outer", 0.0)) > 0.9 for v in found.unseen)
    assert found.deviations["rho_outer"] > 0.5
    held = rom.update(family, test, fixed=HELD, damping=0.02, prior={"rho_outer": 0.05})
    assert_allclose(held.deviations["rho_outer"], 0.05, rtol=0.01)
    assert not any("rho_outer" in v for v in held.unseen)


def test_the_gradient_is_that_of_the_cost_with_its_prior(family):
    """Differences of half the cost, away from the prior; 8 modes lie below 2100 Hz."""
    test = synthetic(family, lines=LINES[::5], sensors=FEW)
    model = model_of(family, sensors=FEW)
    before = _before({"E_inner": 1e-3, "rho_outer": 0.1}, model)
    search = _Search.begun(model, test, np.ones(3, bool), 0.01, before)
    assert search.zeta.size == 9
    search.theta = search.theta + 0.1 * np.random.default_rng(0).standard_normal(12)
    search.sums, _ = search.at(search.theta)
    ends = [[search.at(search.theta + h)[1] for h in s * 1e-5 * np.eye(12)] for s in (1, -1)]
    expected = (np.array(ends[0]) - ends[1]) / 4e-5
    assert_allclose(search.posterior()[1], expected, atol=1e-5 * np.abs(expected).max(), rtol=1e-4)


def test_two_tests_with_two_supports_say_more_than_one(family):
    held = rom.update(family, synthetic(family, lines=LINES[:60]), fixed=HELD, damping=0.02)
    loose = synthetic(family, fixed=(), seed=1, lines=LINES[::2])
    alone = rom.update(family, loose, damping=0.02)
    both = rom.update(family, loose, damping=0.02, prior=held)
    assert both.verdict.ok, both
    one, other = (np.linalg.inv(u.covariance[:3, :3]) for u in (held, alone))
    first, second = (np.log(list(u.factors.values())) for u in (held, alone))
    C = np.linalg.inv(one + other)
    mean = C @ (one @ first + other @ second)
    assert_allclose(both.covariance[:3, :3], C, rtol=0.05, atol=0.05 * np.diag(C).min())
    assert_allclose(np.log(list(both.factors.values())), mean, atol=0.2 * np.sqrt(np.diag(C)).min())
    A = np.random.default_rng(0).normal(size=(len(held.names),) * 2)
    _, tied, _ = _before(replace(held, covariance=A @ A.T), held.model)  # to damping: left open
    assert_allclose(np.linalg.inv(tied), (A @ A.T)[:3, :3], rtol=1e-9)
    other = synthetic(family, fixed=(), seed=1, lines=LINES[::2], true=TRUE | {"E_inner": 1.35})
    torn = rom.update(family, other, damping=0.02, prior=held)
    assert any("distance from the test before" in row.quantity for row in torn.verdict.failures)
    kept = rom.update(family, loose, damping=0.02, prior=held, free=("E_outer",))
    assert kept.factors["E_inner"] == pytest.approx(held.factors["E_inner"])
    alien = replace(held, names=("zeta 1",))
    refuse(
        (lambda: rom.update(family, loose, prior=held, residual="equations"), "prior needs resid"),
        (lambda: rom.update(family, loose, prior=alien), "found none of 'E_inner'"),
    )


def test_wrong_data_and_families_are_named(family):
    test = synthetic(family)

    def updated(**fields):
        more = {k: fields.pop(k) for k in ("free", "prior", "attached") if k in fields}
        return rom.update(family, replace(test, **fields), fixed=HELD, **more)

    still = np.array(SENSORS.points)
    still[4, 0] = 0.0
    still = Channels(still, SENSORS.directions)
    mass, input_ = AddedMass("tip", 1, 0.5, 2), "responses to input %d are .*1000: millim"
    odd = replace(family, body=replace(family.body, units="mm-t-s"))
    layered = replace(family, stretch=Stretch(2, ("outer",), (((0.0, 0.08),),)))
    refuse(
        (lambda: rom.update(odd, test, fixed=HELD), "mm-t-s; use SI units"),
        (lambda: rom.update(layered, test, fixed=HELD), "parameter of thickness cannot be updated"),
        (lambda: updated(H=test.H * [1000.0, 1.0]), input_ % 0),
        (lambda: updated(H=test.H * [1.0, 1000.0]), input_ % 1),
        (lambda: updated(H=-test.H), "all responses run against the model"),
        (lambda: updated(sensors=still), "sensor 4 moves by .* a support"),
        (lambda: updated(free=("E_web",)), ParameterError, "no parameter 'E_web'"),
        (lambda: updated(prior={"E": 1.0}), ParameterError, "prior: no parameter 'E'; there are"),
        (lambda: updated(attached={"E_inner": mass}), ParameterError, "names two"),
        (lambda: replace(test, H=test.H[:, :3]), "H is"),
        (lambda: Channels([[0, 0, 0]], [[0, 0, 0]]), "length zero"),
    )


def test_velocities_and_accelerations_are_taken(family):
    test, s = synthetic(family), 2j * np.pi * LINES[:, None, None]
    same = list(rom.update(family, test, fixed=HELD, damping=0.02).factors.values())
    for quantity, H in (("velocity", s * test.H), ("acceleration", s**2 * test.H)):
        found = rom.update(family, replace(test, H=H, quantity=quantity), fixed=HELD, damping=0.02)
        assert_allclose(list(found.factors.values()), same, rtol=1e-9)


GAUGES = Channels([[0.6, 0.0, 0.04], [0.3, 0.05, 0.08]], [[1, 0, 0]] * 2)
AXIAL = Channels([[1.0, 0.05, 0.04]], [[1, 0, 0]])


@pytest.mark.once
def test_gauges_are_sensors(family, tmp_path):
    """A pull at the tip, far below resonance, strains a bar by F / EA; mixed with accelerations."""
    directions = np.vstack([GAUGES.directions, SENSORS.directions])
    sensors = Channels(np.vstack([GAUGES.points, SENSORS.points]), directions)
    quantity = ("strain",) * 2 + ("acceleration",) * 16
    true = np.log([TRUE[name] for name in PARAMETERS])
    both = []
    for force, lines in ((AXIAL, np.array([1.0])), (INPUTS, LINES)):
        rows = (sensors.rows(family.body, "sensor", gauges=[q == "strain" for q in quantity]),
                force.rows(family.body, "input"))  # fmt: skip
        model = family_model(family, rows, {}, {}, HELD)
        both.append(responses_at(model, true, np.array([0.02]), 2 * np.pi * lines))
    for k, name in ((0, "E_outer"), (1, "E_inner")):
        assert_allclose(both[0][0, k, 0].real * 0.1 * 0.08 * 210e9 * TRUE[name], 1.0, rtol=0.02)
    s = 2j * np.pi * LINES[:, None, None]
    H = noisy(both[1], 0.05, np.random.default_rng(0))
    H[:, 2:] *= s**2
    test = Responses(LINES, H, sensors, INPUTS, 1 / (1 + AVERAGES * 0.05**2), AVERAGES, quantity)
    found = rom.update(family, test, fixed=HELD, damping=0.02)
    assert found.verdict.ok, found
    updating.assert_right(found, TRUE)
    assert max(found.deviations[name] for name in TRUE) < 0.01 / 4
    across = np.where(np.arange(18)[:, None] == 1, [0, 0, 1], sensors.directions)
    off = replace(test, sensors=Channels(sensors.points, across))
    refuse(
        (lambda: rom.update(family, off, fixed=HELD), "sensor 1 .* lies on no face"),
        (lambda: replace(test, quantity=quantity[1:]), "17 quantities for 18 sensors"),
    )
    pytest.importorskip("h5py", reason="h5py is not installed")
    rom.io.write_responses(test, tmp_path / "test.h5")
    assert rom.io.read_responses(tmp_path / "test.h5").quantity == quantity
