"""Plans of several bodies against random and even layouts, and against updates by such tests."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.stats import chi2

import rom
from cases.long import few
from cases.solid import STEEL, composite
from rom.components.updating.family_model import family_model
from rom.components.updating.frf_data import noisy
from rom.components.updating.normal_equations import responses_at
from rom.updating import Channels, Responses, candidates, place

REGIONS = ("inner", "middle", "outer")
PARAMETERS = {f"E_{name}": rom.YoungsModulus(name, 0.4, 2.5) for name in REGIONS[::2]}
PARAMETERS |= {"rho_middle": rom.Density("middle", 0.5, 2.0)}
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
        model = composite(
            dict.fromkeys(REGIONS, STEEL), lambda c: REGIONS[int(3 * c[0]) // cells[0]], size, cells
        )
        self.family = rom.reduce_parametric(
            model, parameters=PARAMETERS, method=rom.CraigBampton(8), certify=False,
            interfaces={"root": "rbe2", "tip": "rbe2"},
        )  # fmt: skip
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


def some(channels, numbers):
    return Channels(np.asarray(channels.points)[numbers], np.asarray(channels.directions)[numbers])


def measures(plan):
    """Of the covariance of the parameters: root of the determinant per parameter, and trace."""
    C = plan.covariance[:3, :3]
    return np.array([np.linalg.det(C) ** (1 / 6), np.trace(C) ** 0.5])


def test_a_plan_beats_even_layouts_with_any_shaker(case):
    """Six channels each: two points far apart, all axes; the best of nine shakers is given."""
    best = measures(case.plan(case.offered, case.shakers))
    two = case.even(2)
    even = [measures(case.plan(two, some(case.shakers, [k]))) for k in range(9)]
    assert (np.min(even, axis=0) > 1.2 * best).all()
    assert (np.median(even, axis=0) > 2.0 * best).all()


@pytest.mark.parametrize("seed", range(4))
def test_a_plan_beats_random_layouts(case, seed):
    """Twelve layouts from the same candidates: each is worse, half of them by twice and more."""
    best = measures(case.plan(case.offered, case.shakers))
    rng = np.random.default_rng(seed)
    layouts = [
        measures(case.plan(some(case.offered, rng.permutation(24)[:N_SENSORS]),
                           some(case.shakers, [rng.integers(9)])))
        for _ in range(12)
    ]  # fmt: skip
    assert (np.median(layouts, axis=0) > 2.0 * best).all()
    assert (np.min(layouts, axis=0) > 1.05 * best).all()


def updates(case, plan, lines, n):
    """Updates by noisy tests with the channels of a plan, at factors of one."""
    channels = plan.sensors, plan.inputs
    rows = [c.rows(case.family.body, "channel") for c in channels]
    model = family_model(case.family, rows, {}, {}, case.fixed)
    exact = responses_at(model, np.zeros(3), np.array([0.01]), 2 * np.pi * lines)
    rng = np.random.default_rng(7)
    for _ in range(n):
        H = noisy(exact, np.sqrt(2) * NOISE, rng)
        coherence = 1 / (1 + 2 * 100 * NOISE**2)
        test = Responses(lines, H, *channels, coherence, 100)
        yield rom.update(case.family, test, fixed=case.fixed)


@pytest.mark.parametrize("case", few(1, ["cantilever", "free plate"]), indirect=True)
def test_updates_scatter_as_the_plan_foretells(case):
    """d^T C^-1 d over all draws is chi-square of three times their number, in all directions."""
    plan = case.plan(case.offered, case.shakers, floor=0.0, noise=NOISE)
    found = list(updates(case, plan, case.lines, DRAWS))
    d = np.log([[u.factors[name] for name in PARAMETERS] for u in found])
    C = plan.covariance[:3, :3]
    along = np.linalg.eigh(C)[1]
    size = np.square(d @ along) / np.diag(along.T @ C @ along)
    low, high = chi2.ppf([0.001, 0.999], DRAWS)
    assert ((size.sum(axis=0) > low) & (size.sum(axis=0) < high)).all(), size.mean(axis=0)
    for name in PARAMETERS:
        assert_allclose(np.mean([u.deviations[name] for u in found]), plan.deviations[name],
                        rtol=0.05)  # fmt: skip
    assert not plan.unseen and not any(u.unseen for u in found)


@pytest.mark.parametrize("case", ["cantilever"], indirect=True)
def test_what_a_plan_does_not_see_an_update_does_not_see(case):
    """Lines far below resonance: no inertia."""
    case.lines, before = np.array([0.5, 0.75, 1.0]), case.lines
    try:
        plan = case.plan(case.offered, case.shakers, floor=0.0, noise=NOISE)
        (found,) = updates(case, plan, case.lines, 1)
    finally:
        case.lines = before
    for unseen in (plan.unseen, found.unseen):
        assert max(abs(v.get("rho_middle", 0.0)) for v in unseen) > 0.9
        assert not any(abs(v.get("E_inner", 0.0)) > 0.5 for v in unseen)


@pytest.mark.parametrize("case", ["cantilever"], indirect=True)
def test_a_test_made_after_a_written_plan_is_read_and_updates(case, tmp_path):
    """The universal file gives the nodes, the table of the plan the directions."""
    plan = case.plan(case.offered, case.shakers, floor=0.0, noise=NOISE)
    (tmp_path / "plan.uff").write_text(plan.uff())
    rows = [line.split(",") for line in plan.csv().splitlines()[1:]]
    d = np.array([row[5:] for row in rows], dtype=float)
    axis = np.abs(d).argmax(axis=1)
    dofs = [
        f"{k}{'-+'[int(x[a] > 0)]}{'XYZ'[a]}"
        for k, (a, x) in enumerate(zip(axis, d, strict=True), 1)
    ]
    H = plan_responses(case, plan)
    names = [f"{dof}/{dofs[-1]} {part} [m/N]" for dof in dofs[:-1] for part in ("real", "imag")]
    values = np.column_stack([case.lines, H.view(float).reshape(len(H), -1)])
    text = [",".join(["Frequency [Hz]", *names])]
    text += [",".join(f"{x:.12g}" for x in row) for row in values]
    (tmp_path / "test.csv").write_text("\n".join(text))
    test = rom.io.read_responses(
        tmp_path / "test.csv", averages=100, coherence=0.95, points=tmp_path / "plan.uff"
    )
    for read, planned in ((test.sensors, plan.sensors), (test.inputs, plan.inputs)):
        assert_allclose(read.points, planned.points, atol=1e-5)
        assert_allclose(read.directions, planned.directions)
    found = rom.update(case.family, test, fixed=case.fixed, damping=0.02)
    assert_allclose([found.factors[name] for name in PARAMETERS], 1.0, atol=1e-3)


def plan_responses(case, plan):
    """(n_f, n_s) exact responses at factors of one [m/N]."""
    rows = [c.rows(case.family.body, "channel") for c in (plan.sensors, plan.inputs)]
    model = family_model(case.family, rows, {}, {}, case.fixed)
    H = responses_at(model, np.zeros(3), np.array([0.01]), 2 * np.pi * case.lines)
    return np.ascontiguousarray(H[:, :, 0])
