"""Statics and small motions by sparse matrices: as dense ones, as closed forms, none missed."""

import sys
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigvals
from scipy.optimize import brentq

import rom
from cases.beam import elastica
from cases.long import few
from cases.mbs.mechanisms import random_body, slider_crank
from cases.mbs.parts import ORIGIN, X, Y, Z, held_rod, on_axle, on_guide
from cases.refusals import refuses
from rom.errors import ConfigError, ModelError, ModesMissedError, RomWarning, SolverError
from rom.mbs.analysis import campbell as campbell_module
from rom.mbs.analysis import few_modes, local_equations, tangent
from rom.mbs.integrate.consistent_start import initial_state

SECTION = {"stretch": 1e5, "bend": (40.0, 60.0, 30.0), "mass": 1.0, "inertia": (1e-3, 2e-3, 3e-3)}


def rod_on(joint, n=20, gravity=(0, 0, -9.81), **more):
    return held_rod(n, joint=joint, gravity=gravity, **SECTION | more)[0]


def flexible_pair(seed=3):
    """Two bodies with modes of their own, hinged to each other and to the ground by springs."""
    rng = np.random.default_rng(seed)
    mech = rom.Mechanism(gravity=(0, 0, -1e-3))
    last = mech.ground.marker((0, 0, 0))
    for name in ("one", "two"):
        part = mech.add_flexible(name, random_body(rng, 12, damped=False))
        first, *_, end = part.flexible.markers
        stiffness = (1e3, 2e3, 3e3, 50.0, 60.0, 70.0)
        mech.bushing(f"to {name}", last, part.marker(first), stiffness=stiffness)
        last = part.marker(end)
    return mech


def links(n, *, slopes, ends=True, planar=False):
    """A chain of total length and mass one in the x-z plane, hinged by universal joints.

    A closed one of revolute joints has three constraints that repeat others.
    """
    mech, l = rom.Mechanism(gravity=(0, 0, -9.81)), 1.0 / n
    marks = {"a": (-l / 2, 0, 0), "b": (l / 2, 0, 0)}
    last, corner = mech.ground.marker((0, 0, 0)), np.zeros(3)
    for k, slope in enumerate(slopes):
        way = l * np.array([np.cos(slope), 0, -np.sin(slope)])
        turned = (np.cos(slope / 2), 0, np.sin(slope / 2), 0)
        link = mech.add_rigid(f"link {k}", mass=l, inertia=(l**3 / 12,) * 3, markers=marks,
                              at=corner + way / 2, orientation=turned)  # fmt: skip
        up = (np.sin(slope), 0, np.cos(slope))
        if planar:
            mech.revolute(f"pin {k}", last, link.marker("a"), axis=Y)
        else:
            mech.universal(f"pin {k}", last, link.marker("a"), axis1=Y, axis2=up)
        last, corner = link.marker("b"), corner + way
    if planar:
        mech.revolute("end", last, mech.ground.marker(tuple(corner)), axis=Y)
    elif ends:
        mech.spherical("end", last, mech.ground.marker(tuple(corner)))
    return mech, corner


def planar_links(n):
    return links(n, slopes=np.linspace(0.9, -0.9, n), planar=True)[0]


@pytest.fixture
def _sparse(monkeypatch):
    monkeypatch.setattr(local_equations, "MAX_DENSE", 0)
    monkeypatch.setattr(few_modes, "MIN_RATIO", 0)


FEW = {
    "a clamped rod": partial(rod_on, "fixed"),
    "a rod on a ball joint": partial(rod_on, "spherical"),
    "a free rod": partial(rod_on, None, gravity=(0, 0, 0)),
    "an upright rod that buckles": partial(rod_on, "fixed", 20, (-400, 0, 0)),
    "two flexible bodies": flexible_pair,
    "a chain": lambda: links(12, slopes=np.linspace(1.0, -1.0, 12))[0],
    "a chain in a plane": lambda: planar_links(16),
}


@pytest.mark.parametrize("name", FEW)
@pytest.mark.usefixtures("_sparse")
def test_few_modes_are_those_of_dense_matrices(name):
    """To 1e-9, and where stiff bodies leave less in dense matrices, to their round-off."""
    mech = FEW[name]()
    state = rom.equilibrium(mech) if name in STATICS else None
    whole, part = rom.linearize(mech, state), rom.linearize(mech, state, n=8)
    assert part.basis.shape[1] == 8
    squares, exact = (np.real(x.eigenvalues[:8] ** 2) for x in (part, whole))
    lost = 1e-14 * np.abs(whole.eigenvalues).max() ** 2
    assert_allclose(squares, exact, rtol=1e-9, atol=lost)
    assert part.shapes.shape == (whole.shapes.shape[0], 8)
    assert part.stable == whole.stable
    now = local_equations.instant(mech, 0.0)
    mass = now.gradient(whole.state.q, whole.state.v)[2]
    assert_allclose(part.basis.T @ mass @ part.basis, np.eye(8), atol=1e-10)


@pytest.mark.usefixtures("_sparse")
def test_damped_modes_are_those_of_dense_matrices_without_the_overdamped():
    mech = rod_on("fixed", viscosity=1e-3)
    every, part = rom.linearize(mech).eigenvalues, rom.linearize(mech, n=5)
    swinging = every[every.imag > 1.0]
    assert_allclose(part.eigenvalues, swinging[:5], rtol=1e-9)
    band = swinging[[0, 2]].imag / (2 * np.pi)
    inside = rom.linearize(mech, band=(0.9 * band[0], 1.001 * band[1])).eigenvalues
    assert_allclose(inside, swinging[:3], rtol=1e-9)


@pytest.mark.usefixtures("_sparse")
def test_modes_of_a_turning_rod_are_those_of_dense_matrices():
    """Gyroscopic, with one motion that is thrown outwards and one that is free."""
    mech = rod_on("revolute", axis=X)
    state = rom.equilibrium(mech, spin=(9.0, 0, 0))
    every, part = rom.linearize(mech, state), rom.linearize(mech, state, n=6)
    assert part.basis.shape[1] < 12 < every.basis.shape[1]
    assert_allclose(part.eigenvalues, every.eigenvalues[:6], rtol=1e-9, atol=1e-8)
    common = np.abs(np.sum(part.shapes.conj() * every.shapes[:, :6], axis=0)) ** 2
    norms = [np.sum(np.abs(x) ** 2, axis=0) for x in (part.shapes, every.shapes[:, :6])]
    assert_allclose(common / norms[0] / norms[1], 1.0, atol=1e-8)


def test_a_band_has_all_its_modes_and_none_beside():
    mech = rod_on("fixed", 40)
    f = rom.linearize(mech, n=20).frequencies
    inside = rom.linearize(mech, band=(0.5 * (f[3] + f[4]), 0.5 * (f[11] + f[12]))).frequencies
    assert_allclose(inside, f[4:12], rtol=1e-8)


def test_a_mode_that_lanczos_leaves_out_is_missed(monkeypatch):
    mech, near = rod_on("fixed", 40), few_modes.Pencil.near

    def all_but_the_second(self, shift, k):
        squares, U = near(self, shift, k)
        return np.delete(squares, 1), np.delete(U, 1, axis=1)

    monkeypatch.setattr(few_modes.Pencil, "near", all_but_the_second)
    refuses(ModesMissedError, "but there are", rom.linearize, mech, n=6)


def test_wrong_wishes_are_refused():
    rod = rod_on("fixed", 5)
    refuses(ConfigError, "from 1 to 33: the motions that the joints", rom.linearize, rod, n=500)
    refuses(ConfigError, "n or band, not both", rom.linearize, rod, n=3, band=(1, 2))
    refuses(ConfigError, "two growing frequencies", rom.linearize, rod, band=(3.0, 2.0))
    for n in (5, 40):
        low = rom.linearize(rod_on("fixed", n)).frequencies
        empty = (low[1] + 0.1, low[2] - 0.1)
        with pytest.raises(ModelError, match=r"no mode lies between .* near are"):
            rom.linearize(rod_on("fixed", n), band=empty)


STATICS = {
    "a clamped rod": partial(rod_on, "fixed"),
    "a rod that hangs": partial(rod_on, "revolute", 20, (3.0, 0, -9.81), axis=Y),
    "two flexible bodies": flexible_pair,
    "a chain": lambda: links(12, slopes=np.linspace(0.9, -1.0, 12))[0],
    "a chain in a plane": lambda: planar_links(16),
    "a slider-crank": lambda: with_spring(slider_crank(speed=0.0, gravity=9.81)),
}


def with_spring(mech):
    end = mech.parts["slider"].marker("b")
    mech.spring_damper("spring", mech.ground.marker((0.5, 0, 0.2)), end, stiffness=300.0)
    return mech


@pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")
@pytest.mark.parametrize("name", STATICS)
def test_large_statics_are_those_of_dense_matrices(name, monkeypatch):
    exact = rom.equilibrium(STATICS[name]())
    monkeypatch.setattr(local_equations, "MAX_DENSE", 0)
    state = rom.equilibrium(STATICS[name]())
    assert_allclose(state.q, exact.q, atol=1e-11)
    assert_allclose(state.lam, exact.lam, atol=1e-8 * max(1.0, np.abs(exact.lam).max(initial=0.0)))


def test_chains_that_begin_almost_on_their_heads_fall_to_where_they_hang(monkeypatch):
    monkeypatch.setattr(local_equations, "MAX_DENSE", 0)
    mech, _ = links(6, slopes=np.full(6, -np.pi / 2 + 0.05), ends=False)
    state = rom.equilibrium(mech)
    assert_allclose(state.q[2::7], -(np.arange(6) + 0.5) / 6, atol=1e-12)


@pytest.mark.parametrize("many", [False, True])
def test_what_stands_on_its_head_falls_although_what_almost_hangs_weighs_more(many, monkeypatch):
    """Newton's correction, downhill as a whole, would raise the light one."""
    monkeypatch.setattr(local_equations, "MAX_DENSE", 0 if many else 10**6)
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    for name, mass, slope in (("heavy", 5.0, np.pi / 2 - 0.2), ("light", 0.1, -np.pi / 2 + 0.1)):
        turned = (np.cos(slope / 2), 0, np.sin(slope / 2), 0)
        solid = {"mass": mass, "inertia": (mass / 3,) * 3, "at": (np.cos(slope), 0, -np.sin(slope))}
        link = mech.add_rigid(name, **solid, orientation=turned)
        mech.revolute(f"pin of {name}", mech.ground.marker(ORIGIN), link.marker(-X), axis=Y)
    assert_allclose(rom.equilibrium(mech).q[2::7], -1.0, atol=1e-12)


def test_reactions_balance_best_as_those_of_dense_matrices():
    mech = links(8, slopes=np.linspace(0.5, -0.8, 8))[0]
    changes = []
    for sparse in (False, True):
        now = local_equations.instant(mech, 0.0, sparse=sparse)
        state = initial_state(now.packed)
        state = replace(state, a=0 * state.a, lam=np.cos(np.arange(state.lam.size)))
        left, change = tangent.best_reactions(now, state)
        changes.append(state.lam + change)
        assert np.abs(left).max() < 2.0
    assert np.sign(changes[1][0]) == np.sign(changes[0][0])  # weighed by masses, not by sizes
    assert_allclose(np.linalg.norm(changes[1]), np.linalg.norm(changes[0]), rtol=0.5)


@pytest.mark.parametrize(
    ("load", "deflection", "shortening"),
    few(1, [(1.0, 0.30172, 0.05643), (2.0, 0.49346, 0.16064), (5.0, 0.71379, 0.38763),
            (10.0, 0.81061, 0.55500)]),
)  # fmt: skip
def test_mattiassons_table_of_the_elastica(load, deflection, shortening):
    """Mattiasson, Int. J. Numer. Meth. Eng. 17 (1981) 145, and the elliptic integrals."""
    assert_allclose(elastica(load)[1:], (1 - shortening, deflection), atol=6e-6)
    mech, rod = held_rod(400, stretch=1e7, bend=1.0, mass=1.0, inertia=1e-4)
    mech.force("tip", rod.marker("end"), (load, 0, 0))
    tip = rom.equilibrium(mech).q[-7:-4]
    assert_allclose((tip[2], tip[0]), elastica(load)[1:], atol=8e-6)


@pytest.mark.parametrize("many", [False, True])
def test_slender_rods_need_no_more_corrections_than_stocky_ones(many, monkeypatch):
    """What they are stretched by finite corrections looks like buckling, and is none."""
    monkeypatch.setattr(local_equations, "MAX_DENSE", 0 if many else 10**6)
    counted, needed, moved = [], [], local_equations.Instant.moved
    count = lambda *given: counted.append(1) or moved(*given)  # noqa: E731
    monkeypatch.setattr(local_equations.Instant, "moved", count)
    for stretch in (1e4, 1e7):
        mech, rod = held_rod(30, stretch=stretch, bend=1.0, mass=1.0, inertia=1e-4)
        mech.force("tip", rod.marker("end"), (10.0, 0, 0))
        counted.clear()
        tip = rom.equilibrium(mech).q[-7:-4]
        assert_allclose((tip[2], tip[0]), elastica(10.0)[1:], atol=3e-3)
        needed.append(len(counted))
    assert needed[1] < 1.5 * needed[0] < 60


def catenary_of(n, slack):
    """Slopes of n links of weight one in all whose horizontal force is slack times 3 N."""
    weight = 9.81 / n * (n / 2 - 0.5 - np.arange(n))
    return np.arctan(weight / (3.0 * slack))


@pytest.mark.parametrize("n", [300, pytest.param(10_000, marks=pytest.mark.long)])
def test_a_chain_of_thousands_hangs_in_the_polygon_of_forces(n):
    """It starts in another one; span and length say which it has to find."""
    mech, end = links(n, slopes=catenary_of(n, 0.9))
    force = 3.0 * brentq(lambda x: np.cos(catenary_of(n, x)).sum() / n - end[0], 0.3, 3.0)
    assert_allclose(force, 2.7, rtol=1e-12)
    mech, end = links(n, slopes=0.98 * catenary_of(n, 0.9))
    x = brentq(lambda x: np.cos(catenary_of(n, x)).sum() / n - end[0], 0.3, 3.0)
    state, slope = rom.equilibrium(mech), catenary_of(n, x)
    heights = -np.cumsum(np.sin(slope)) / n + 0.5 * np.sin(slope) / n
    assert_allclose(state.q[2::7], heights, atol=1e-12)
    assert_allclose(state.lam[-3:], (3.0 * x, 0.0, 9.81 / 2), atol=1e-8)


def test_hanging_links_swing_as_bessels_chain():
    """2 omega sqrt(L / g) is a zero of J0; so many links are a chain to 1 / n."""
    n = 200
    mech, _ = links(n, slopes=np.full(n, np.pi / 2), ends=False)
    f = rom.linearize(mech, rom.equilibrium(mech), n=6).frequencies
    zeros = np.array([2.404825557695773, 5.520078110286311, 8.653727912911013])
    assert_allclose(f[::2], zeros / 2 * np.sqrt(9.81) / (2 * np.pi), rtol=5e-3)
    assert_allclose(f[1::2], f[::2], rtol=1e-5)  # in both planes


def test_modes_about_a_bent_shape_need_no_whole_matrices():
    """Round-off of its balance accelerates the light pieces of a fine rod, and yet it rests."""
    found = []
    for n in (150, 600):
        mech, rod = held_rod(n, stretch=1e6, bend=100.0, mass=1.0, inertia=1e-3)
        mech.force("tip", rod.marker("end"), (200.0, 0, 0))
        around = rom.linearize(mech, rom.equilibrium(mech), n=4)
        assert around.basis.shape[1] == 4
        found.append(around.frequencies)
    assert_allclose(*found, rtol=5e-4)


def test_a_mechanism_that_nothing_holds_is_refused_and_a_head_that_stands_is_said(monkeypatch):
    monkeypatch.setattr(local_equations, "MAX_DENSE", 0)
    with pytest.raises(ModelError, match=r"1 free motions\): there is no unique"):
        rom.equilibrium(rod_on("spherical"))
    with pytest.warns(RomWarning, match="unstable"):
        rom.equilibrium(links(5, slopes=np.full(5, -np.pi / 2), ends=False)[0])


def shaken_rod(viscosity=1e-3, n=12):
    """A rod on a table that a drive may shake along x."""
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    table = on_guide(mech, "table", mass=7.0)
    mech.drive("shaker", "guide", lambda t: 0.0 * t)
    _, rod = held_rod(n, on=(mech, table), **SECTION, viscosity=viscosity)
    return mech, rod.marker("end")


def shaken_body():
    """A flexible body bolted to such a table, whose own mass takes part in what the drive does."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    on_guide(mech, "table", mass=7.0)
    mech.drive("shaker", "guide", lambda t: 0.0 * t)
    part = mech.add_flexible("body", random_body(np.random.default_rng(4), 12))
    first, *_, end = (part.marker(name) for name in part.flexible.markers)
    mech.fixed("bolt", mech.parts["table"].marker(part.point(first)), first)
    return mech, end


def test_responses_of_large_mechanisms_are_those_of_dense_matrices(monkeypatch):
    f, (rod, tip), pair = np.array([0.0, 0.7, 3.1, 25.0]), shaken_rod(), flexible_pair()
    bolted, end = shaken_body()
    marks = [pair.parts[k].marker(list(pair.parts[k].flexible.markers)[-1]) for k in ("one", "two")]
    answers = []
    for size in (200, 0):
        monkeypatch.setattr(local_equations, "MAX_DENSE", size)
        state, other = rom.equilibrium(rod), rom.equilibrium(pair)
        answers.append((
            rom.frequency_response(rod, state, f, force=tip, motion=tip).receptance,
            rom.frequency_response(pair, other, f, force=marks[0], motion=marks[1]).receptance,
            *(rom.transmissibility(rod, state, f, drive="shaker", motion=at)
              for at in (tip, "table")),
            rom.transmissibility(bolted, None, f, drive="shaker", motion=end),
        ))  # fmt: skip
    assert_allclose(answers[1][3][:, 0], 1.0, rtol=1e-9)  # the table moves as its drive does
    for whole, sparse in zip(*answers, strict=True):
        assert np.abs(whole).max() > 0.0
        assert_allclose(sparse, whole, rtol=1e-7, atol=1e-9 * np.abs(whole).max())


def test_a_rod_of_thousands_of_unknowns_answers_as_its_closed_form():
    """Tip of a clamped beam under a harmonic force: (sin ch - cos sh) / (EI k^3 (1 + cos ch))."""
    mech, rod = held_rod(150, stretch=1e6, bend=1.0, mass=1.0, inertia=1e-9)
    tip, k = rod.marker("end"), np.array([1.0, 2.5, 4.0])
    f = k**2 / (2 * np.pi)
    found = rom.frequency_response(mech, None, f, force=tip, motion=tip).receptance[:, 0, 0]
    exact = (np.sin(k) * np.cosh(k) - np.cos(k) * np.sinh(k)) / (1 + np.cos(k) * np.cosh(k)) / k**3
    assert_allclose(found, exact, rtol=2e-5, atol=2e-5)


def test_an_infinite_response_of_a_large_mechanism_is_named(monkeypatch):
    monkeypatch.setattr(local_equations, "MAX_DENSE", 0)
    mech, tip = shaken_rod(viscosity=0.0)
    resonance = rom.linearize(mech, n=2).frequencies[1]
    ends = {"force": tip, "motion": tip}
    near = rom.frequency_response(mech, None, 1.01 * resonance, **ends)
    assert np.isfinite(near.receptance).all()
    with pytest.raises(SolverError, match=f"at {resonance:.9g} Hz"):
        rom.frequency_response(mech, None, resonance, **ends)
    free = rod_on(None, gravity=(0, 0, 0))
    end = free.nonlinear["rod"].marker("end")
    with pytest.raises(SolverError, match="at 0 Hz is infinite"):
        rom.frequency_response(free, None, 0.0, force=end, motion=end)
    mech.fixed("bolt", "ground", "table")
    with pytest.warns(RomWarning), pytest.raises(ModelError, match="do not let this drive move"):
        rom.transmissibility(mech, None, 1.0, drive="shaker", motion=tip)


def test_a_campbell_diagram_of_some_modes_is_that_of_all(monkeypatch):
    mech = rom.Mechanism(gravity=(0, 0, 0))
    hub = on_axle(mech, "hub", inertia=(1, 1, 1), axis=X)
    held_rod(12, on=(mech, hub), **SECTION)
    speeds, found = (2.0, 8.0, 20.0), []
    for size in (200, 0):
        monkeypatch.setattr(local_equations, "MAX_DENSE", size)
        monkeypatch.setattr(campbell_module, "MAX_DENSE", size)
        found.append(rom.campbell(mech, speeds, n=4, axis=X))
    assert found[1].frequencies.shape == (3, 4)
    assert_allclose(found[1].frequencies, found[0].frequencies, rtol=1e-8)
    assert_allclose(found[1].mac, found[0].mac, rtol=1e-6)


def test_a_row_of_cranks_swings_as_one_whose_joints_repeat_each_other():
    """One motion of 234 coordinates, 19 constraints that repeat others: a compound pendulum."""
    n, mech, before = 20, rom.Mechanism(gravity=(0, 0, -9.81)), None
    solid = {"mass": 1.0, "inertia": (0.1, 0.1, 0.1)}
    for k in range(n):
        crank = mech.add_rigid(f"crank {k}", **solid, at=(k, 0, -0.5))
        mech.revolute(f"hinge {k}", mech.ground.marker((k, 0, 0)), crank.marker(Z / 2), axis=Y)
        if before:
            rod = mech.add_rigid(f"rod {k}", **solid, at=(k - 0.5, 0, -1))
            mech.spherical(f"ball {k}", before, rod.marker(-X / 2))
            mech.revolute(f"pin {k}", rod.marker(X / 2), crank.marker(-Z / 2), axis=Y)
        before = crank.marker(-Z / 2)
    with pytest.warns(RomWarning, match="19 of 252 constraints repeat others"):
        state = rom.equilibrium(mech)
    found = rom.linearize(mech, state, n=1).frequencies
    square = (0.5 * n + (n - 1)) * 9.81 / (n * (0.1 + 0.25) + (n - 1))
    assert_allclose(found, np.sqrt(square) / (2 * np.pi), rtol=1e-9)


def test_all_modes_at_rest_are_those_of_one_symmetric_problem(monkeypatch):
    """Free motions are not followed to a later instant, and nothing damps but round-off."""
    section = {"stretch": (5e5, 5e5, 1e6), "bend": (1e3, 2e3, 1.5e3), "mass": 1.0,
               "inertia": (1e-2, 2e-2, 3e-2)}  # fmt: skip
    along = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    mech, _ = held_rod(8, gravity=(0, 0, -9.81), length=10.0, frame=along, **section)
    monkeypatch.setattr(sys.modules[rom.linearize.__module__]._Path, "at", None)
    found = rom.linearize(mech, rom.equilibrium(mech))
    assert not found.C.any()
    general = np.sqrt(np.sort(eigvals(found.K).real)) / (2 * np.pi)
    assert_allclose(found.frequencies, general, rtol=1e-7)
    few_of_them = rom.linearize(mech, found.state, n=2).frequencies
    assert_allclose(found.frequencies[:2], few_of_them, rtol=1e-7)
