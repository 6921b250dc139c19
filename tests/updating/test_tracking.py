"""Kalman filter of a body: Riccati, chi-square, forces found, stress where nothing is measured."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad_vec
from scipy.linalg import expm, solve_discrete_are
from scipy.stats import chi2

import rom
from cases.components.updating import fed, refuse
from cases.mbs.fmu_instance import Instance, fmpy
from cases.solid import STEEL, block, reduced
from rom.body.recovery import StressRecovery
from rom.body.surface import strain_rows
from rom.components.updating.observers.operation import discrete, stress_rows
from rom.components.updating.observers.tracking import steady
from rom.errors import ModelError
from rom.updating import Channels, Sensors, tracker

DT, WALK = 5e-4, 400.0
TIP = Channels([[1.0, 0, 0]], [[0, 0, 1]])
FEW = (
    Sensors(Channels([[0.5, 0, 0]], [[0, 0, 1]]), "displacement", 1e-6),
    Sensors(Channels([[1.0, 0.1, 0], [0.75, 0, 0]], [[0, 0, 1]] * 2), "acceleration", 0.5),
)
MODEL = block(cells=(8, 2, 2))
GAUGE = [[0.125, 0.05, 0.08], [0.25, 0.05, 0.08]]
WANTED = (Sensors(Channels(GAUGE[:1], [[1, 0, 0]]), "stress"), Sensors(TIP, "displacement"))


@pytest.fixture(scope="module")
def body():
    body = reduced(4, MODEL, reference="root", damping=rom.ModalDamping(0.02))
    # strain between two points of the surface, along x, stands for the stress of a gauge
    surface = body.surface
    a, b = (int(np.linalg.norm(surface.points - x, axis=1).argmin()) for x in GAUGE)
    operator = np.zeros((6, body.n_modes))
    operator[0] = STEEL.E / 0.125 * (surface.shape[3 * b] - surface.shape[3 * a])
    return replace(body, stress=StressRecovery(surface.points[[a]], operator))


@pytest.fixture(scope="module")
def filter_(body):
    return made(body)


def made(body, sensors=FEW, forces=TIP, wanted=WANTED, **options):
    options = {"dt": DT, "walk": WALK, "fixed": ("root",), "unmodelled": 1e-3, **options}
    return tracker(body, sensors, forces, wanted, **options)


def walked(t, rng, n_t=400):
    """One record of what a filter assumes: states (n_t, n) and samples (n_t, n_y)."""
    root = np.linalg.cholesky(t.Q + 1e-14 * np.diag(np.diag(t.Q)) + 1e-300 * np.eye(len(t.Q)))
    x = np.sqrt(np.diag(t.P)) * rng.standard_normal(len(t.P))
    states = []
    for _ in range(n_t):
        states.append(x)
        x = t.A @ x + root @ rng.standard_normal(len(x))
    states = np.array(states)
    return states, states @ t.C.T + np.sqrt(t.R) * rng.standard_normal((n_t, len(t.C)))


def test_noise_of_a_step_is_its_integral():
    """Quadrature of exp(As) W exp(A's), for steps short and long beside the periods."""
    rng = np.random.default_rng(0)
    A, w = rng.normal(size=(4, 4)) - 3 * np.eye(4), np.diag([0.0, 1.0, 2.0, 0.5])
    for h in (0.01, 2.0):
        step, Q = discrete(A, w, h)
        assert_allclose(step, expm(A * h), rtol=1e-10, atol=1e-13)
        integral = quad_vec(lambda s: expm(A * s) @ w @ expm(A.T * s), 0, h, epsrel=1e-11)[0]
        assert_allclose(Q, integral, rtol=1e-9, atol=1e-12)


def test_the_filter_settles_where_the_riccati_equation_says(filter_):
    """And by another program, of a rough system and of the body in coordinates of equal size."""
    t = filter_
    found = t.run(np.zeros((3000, len(t.C))))
    o = t.observer()
    P = t.A @ found.covariance @ t.A.T + t.Q  # before the next sample
    gain = P @ t.C.T @ np.linalg.inv(t.C @ P @ t.C.T + np.diag(t.R))
    assert_allclose(o.W @ gain, o.W @ o.G, rtol=1e-5, atol=1e-7 * np.abs(o.W @ o.G).max())
    size = np.sqrt(np.einsum("ij,ij->i", o.W @ P, o.W))
    assert_allclose(size, o.deviations, rtol=1e-6)
    rng = np.random.default_rng(8)
    A, B = 0.4 * rng.normal(size=(5, 5)), rng.normal(size=(5, 3))
    C, R = rng.normal(size=(2, 5)), np.array([0.3, 2.0])
    found = steady(A, C, B @ B.T, R)
    assert_allclose(found, solve_discrete_are(A.T, C.T, B @ B.T, np.diag(R)), rtol=1e-8)
    P = steady(t.A, t.C, t.Q, t.R)
    size = np.sqrt(np.diag(P))
    A, C, Q = t.A * size / size[:, None], t.C * size / np.sqrt(t.R)[:, None], t.Q
    scaled = solve_discrete_are(A.T, C.T, Q / np.outer(size, size), np.eye(len(C)))
    assert_allclose(np.diag(scaled), 1.0, rtol=1e-6)


def test_errors_and_innovations_are_as_large_as_the_filter_says(filter_):
    t, rng = filter_, np.random.default_rng(2)
    error, surprise = [], []
    for _ in range(60):
        states, y = walked(t, rng)
        found = t.run(y, DT * np.arange(len(y)))
        error.append(((found.values[-1] - states[-1] @ t.W.T) / found.deviations[-1]) ** 2)
        surprise.append(found.surprise.sum())
    n = 60 * 400 * len(t.C)
    assert chi2.ppf(1e-3, n) < np.sum(surprise) < chi2.ppf(1 - 1e-3, n)
    for total in np.sum(error, axis=0):
        assert chi2.ppf(1e-3, 60) < total < chi2.ppf(1 - 1e-3, 60)


def test_force_and_stress_of_the_full_model_are_found(body):
    modes = rom.modes(MODEL, MODEL.n_dofs - MODEL.interfaces["root"].dofs.size, fixed=("root",))
    omega, shapes = modes.omega, modes.shapes
    where = {tuple(np.round(x, 9)): 3 * k for k, x in enumerate(MODEL.points)}
    n_t, F = 600, 50.0
    load = np.zeros(MODEL.n_dofs)
    load[where[1.0, 0.0, 0.0] + 2] = F
    g, wd = shapes.T @ load, omega * np.sqrt(1 - 0.02**2)
    times = DT * np.arange(n_t)[:, None]
    decay = np.exp(-0.02 * omega * times)
    y = g / omega**2 * (1 - decay * (np.cos(wd * times) + 0.02 * omega / wd * np.sin(wd * times)))
    a = g * decay * (np.cos(wd * times) - 0.02 * omega / wd * np.sin(wd * times))
    rng = np.random.default_rng(4)
    dofs = [where[0.5, 0.0, 0.0] + 2, where[1.0, 0.1, 0.0] + 2, where[0.75, 0.0, 0.0] + 2]
    low = omega < 2 * np.pi * 3000  # what an amplifier lets through
    clean = np.column_stack([y @ shapes[dofs[0]], a[:, low] @ shapes[dofs[1:]][:, low].T])
    noise = np.array([1e-6, 0.5, 0.5])
    samples = clean + noise * rng.standard_normal(clean.shape)
    near, far = (where[tuple(x)] for x in GAUGE)
    stress = STEEL.E / 0.125 * y @ (shapes[far] - shapes[near])
    t = made(body, unmodelled=0.05)
    t_late = slice(n_t // 2, None)
    found = t.run(samples, times[:, 0])
    assert_allclose(found.forces[t_late].mean(), F, rtol=0.03)
    late = found.values[t_late]
    assert_allclose(late[:, 0].mean(), stress[t_late].mean(), rtol=0.03)
    tip = y @ shapes[where[1.0, 0.0, 0.0] + 2]
    # the tip is rigid in the body, and gives way below the force in the full model
    assert_allclose(late[:, 1].mean(), tip[t_late].mean(), rtol=0.02)
    inside = np.abs(found.values[20:, 0] - stress[20:]) < 3 * found.deviations[20:, 0]
    assert inside.mean() > 0.97


def test_the_fmu_says_what_python_says(filter_, tmp_path):
    o = filter_.observer()
    path = rom.io.write_observer_fmu(o, tmp_path / "tip.fmu")
    assert fmpy.validation.validate_fmu(str(path)) == []
    _, y = walked(filter_, np.random.default_rng(1))
    expected = o.run(y[:100])
    one = Instance(path, tmp_path).begin()
    sensors, names = ([name for name, _ in side] for side in (o.inputs, o.outputs))
    found = fed(one, sensors, y[:100], [f"estimate.{name}" for name in names], DT)
    scale = np.abs(expected).max(axis=0)
    assert_allclose(found / scale, expected / scale, rtol=0, atol=1e-10)
    assert_allclose(one.get(*(f"deviation.{name}" for name in names)), o.deviations, rtol=1e-15)
    assert "must be the 0.0005 s" in one.fails(one.fmu.doStep, 100 * DT, 2 * DT)
    assert "not a finite" in one.fails(one.set, "sensor.displacement[1]", np.nan)


def test_a_missing_sample_is_left_out(filter_):
    t = filter_
    _, y = walked(t, np.random.default_rng(7))
    gone = y.copy()
    gone[:, 1] = np.nan
    rest = replace(t, C=t.C[[0, 2]], R=t.R[[0, 2]])
    assert_allclose(t.run(gone).values, rest.run(y[:, [0, 2]]).values, rtol=1e-8, atol=1e-12)
    assert (t.run(gone).deviations[-1] > t.run(y).deviations[-1]).all()


def test_stress_turns_with_its_direction_and_modes_left_out_follow_the_accelerations(body):
    """Normal stress along d is d sigma d; shear counts twice."""
    rng = np.random.default_rng(3)
    s = rng.normal(size=(6, body.n_modes))
    odd = replace(body, stress=StressRecovery(np.array(GAUGE[:1]), s))
    d = np.array([0.6, 0.0, 0.8])
    q = rng.normal(size=body.n_modes)
    xx, yy, zz, yz, xz, xy = s @ q
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    row, _ = stress_rows(odd, Channels(GAUGE[:1], [5 * d]), "sensor")
    assert_allclose(row[0] @ q, d @ tensor @ d)
    rng, r = np.random.default_rng(6), body.n_modes
    own = StressRecovery(np.array(GAUGE[:1]), rng.normal(size=(6, r)), rng.normal(size=(6, 12 + r)))
    at = Channels(GAUGE[:1], [[0, 1, 0]])
    static, inertial = stress_rows(replace(body, stress=own), at, "sensor")
    q, a = rng.normal(size=r), rng.normal(size=6 + r)
    expected = own.field(q, own.accelerations(a[:3], a[3:6], np.zeros(3), a[6:]))[0, 1]
    assert_allclose(static[0] @ q + inertial[0] @ a, expected)


def test_strain_gauges_read_hooke_and_poisson_and_the_gradient_of_their_triangle(body):
    """F / EA along a bar in tension, -nu of it across, and (1 - nu) / 2 under 45 degrees."""
    F, area = 1e4, 0.1 * 0.08
    omega, V = body.modes(fixed=("root",))
    load = F * body.marker("tip").translation[0] @ V[6:]
    q = V[6:] @ (load / omega**2)  # under a force along x on the tip
    axes = [[1, 0, 0], [0, 1, 0], [1, 1, 0], [2, 0, 0.1]]
    found = strain_rows(body, [[0.52, 0.03, 0.08]] * 4, axes, "sensor") @ q
    nu = STEEL.nu
    expected = F / STEEL.E / area * np.array([1, -nu, (1 - nu) / 2, 1])
    assert_allclose(found, expected, rtol=2e-3)
    side = strain_rows(body, [[0.52, 0.1, 0.03]], [[0, 0, 1]], "sensor") @ q
    assert_allclose(side, [-nu * F / STEEL.E / area], rtol=5e-3)
    G = np.random.default_rng(5).normal(size=(3, 3))
    points = body.surface.points
    linear = replace(body, surface=replace(body.surface, shape=(points @ G.T).reshape(-1, 1)))
    for x, d in (([0.3, 0.0, 0.0], [3, 1, 0]), ([1.0, 0.02, 0.05], [0, 1, 2]),
                 ([0.3, 0.0, 0.0], [3, 0, 1])):  # fmt: skip
        d = np.array(d) / np.linalg.norm(d)
        assert_allclose(strain_rows(linear, [x], [d], "sensor")[0], [d @ G @ d], rtol=1e-12)


def test_a_gauge_and_accelerations_find_a_force_that_stays(body):
    """Accelerations alone do not see it; the gauge of the root does."""
    gauge = Channels([[0.1, 0.05, 0.08]], [[1, 0, 0]])
    t = made(body, sensors=(Sensors(gauge, "strain", 1e-8), FEW[1]))
    assert t.inputs[0] == ("strain[1]", "1")
    rng = np.random.default_rng(9)
    bent = np.linalg.solve(np.eye(len(t.A) - 1) - t.A[:-1, :-1], t.A[:-1, -1] * 50.0)
    y = np.tile(t.C @ np.r_[bent, 50.0], (1500, 1))
    found = t.run(y + np.sqrt(t.R) * rng.standard_normal(y.shape))
    late = found.forces[1000:, 0]
    assert abs(late.mean() - 50.0) < 4 * found.force_deviations[-1, 0]


def test_what_cannot_be_tracked_is_named(body, filter_):
    def few(channels):
        return (replace(FEW[0], channels=channels),)

    two = Channels([[1, 0, 0], [0.5, 0, 0]], [[0, 0, 1]] * 2)
    stands, away = Channels(GAUGE[:1], [[0, 0, 1]]), Channels([[0.3, 0.05, 0.2]], [[1, 0, 0]])
    gauges = [(Sensors(channels, "strain", 1e-8), *FEW) for channels in (stands, away)]
    stress = (replace(WANTED[0], channels=TIP),)
    uneven = [0.0, DT, 3 * DT]
    refuse(
        (lambda: made(body, sensors=FEW[1:]), ModelError, "do not see 'force 0'"),
        (lambda: made(body, sensors=FEW[:1], forces=two), "1 sensors for 2 unknown forces"),
        (lambda: made(body, sensors=(replace(FEW[0], noise=0.0),)), "no noise"),
        (lambda: made(body, sensors=few(Channels([[3, 0, 0]], [[0, 0, 1]]))), "off the body"),
        (lambda: made(body, wanted=stress), "off the body"),
        (lambda: made(body, sensors=gauges[0]), "lies on no face"),
        (lambda: made(body, sensors=gauges[1]), "lies on no face"),
        (lambda: made(body, fixed=(), sensors=FEW[:1]), ModelError, "drift"),
        (lambda: filter_.run(np.zeros((4, 2))), r"samples \(4, 2\)"),
        (lambda: filter_.observer().run(np.full((2, 3), np.nan)), "finite"),
        (lambda: filter_.run(np.zeros((3, 3)), uneven), r"step after t = 0\.0005 s is 0.001 s"),
        (lambda: made(replace(body, stress=None)), ModelError, "carries no stress"),
    )
