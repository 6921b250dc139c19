"""Tangents renewed within a step: the linear algebra by NumPy, and motions without it."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from rom.mbs.analysis.local_equations import instant
from rom.mbs.equations import equations, linear_solve, packing, renewal
from rom.mbs.equations.renewal import add_renewed, keep_pair_tangents, renew_pair_tangents
from rom.mbs.kernels.constraints import constraint_gradient

Z = (0, 0, 1)
STEP = 1e-4


def shaft(cavitation="reynolds"):
    """A heavy shaft on two films, whose bushes hang in springs."""
    mech = rom.Mechanism(gravity=(0, -9.81, 0))
    solid = {"mass": 40.0, "inertia": (1.0, 1.05, 0.1), "at": (0, 0, 0)}
    body = mech.add_rigid("shaft", **solid, omega=(0, 0, 300.0))
    film = rom.mbs.JournalBearing(0.1, 0.05, 1e-4, [rom.mbs.Groove(np.pi / 2, 0.35)], cells=(36, 4),
                          cavitation=cavitation)  # fmt: skip
    for k, side in enumerate((-0.2, 0.3)):
        mech.add_rigid(f"bush {k}", mass=5.0, inertia=(0.1,) * 3, at=(0, 0, side))
        ground = mech.ground.marker((0, 0, side))
        stiffness, rate = (1e8, 1e8, 1e8, 1e5, 1e5, 1e5), (1e3, 1e3, 1e3, 1.0, 1.0, 1.0)
        seat = {"axes": np.eye(3), "stiffness": stiffness, "damping": rate}
        mech.bushing(f"seat {k}", ground, f"bush {k}", **seat)
        ends = body.marker((0, 0, side)), f"bush {k}"
        mech.journal_bearing(f"film {k}", *ends, axis=Z, bearing=film, oil=0.03)
    return mech


@pytest.fixture(autouse=True)
def _small(monkeypatch):
    monkeypatch.setattr(renewal, "MIN_VELOCITIES", 0)


def matrix(now, v, factors):
    """Iteration matrix at the start with those velocities, dense."""
    s, W, q, still = now.packed.system, now.W, now.packed.q, np.zeros(v.size)
    none = np.zeros(W.G.shape[0])
    equations.evaluate(s, W, q, v)
    equations.residual(s, W, q, v, still, none)
    equations.tangents(s, W, v, still, none, factors)
    W.S[:] += W.Kt
    return W.S.copy()


def solutions(mech, factors):
    """Of the matrix at the start, renewed at other velocities, and of the one there by NumPy.

    Reactions follow the velocities.
    """
    now = instant(mech, 0.0)
    s, W, q, start = now.packed.system, now.W, now.packed.q, now.packed.v
    n, rank = start.size, W.G.shape[0]
    fast, none = start.copy(), np.zeros(rank)
    fast[[0, 1, 6, 13]] += 0.02, -0.05, 0.03, 0.01  # nothing turns otherwise
    matrix(now, start, factors)
    constraint_gradient(s, W)
    W.UG[:], W.UGT[:] = W.G, W.G
    assert linear_solve.factorise_bordered(s, W, rank)
    keep_pair_tangents(s, W, factors[2], factors[1])
    load, x = np.random.default_rng(1).standard_normal(n + rank), np.zeros(n + rank)
    equations.evaluate(s, W, q, fast)
    equations.residual(s, W, q, fast, np.zeros(n), none)
    assert renew_pair_tangents(s, W, factors[2], factors[1], rank)
    W.rhs[:n], W.part[:] = load[:n], load[n:]
    linear_solve.solve_bordered(s, W, rank, x[:n], x[n:])
    old = x.copy()
    add_renewed(s, W, x[:n], x[n:])
    S, G = matrix(now, fast, factors), W.G
    return old, x, np.linalg.solve(np.block([[S, G.T], [G, np.zeros((rank, rank))]]), load)


def test_reactions_are_renewed_with_the_velocities():
    mech = shaft()
    mech.spherical("pivot", mech.ground.marker((0, 0, -0.2)), mech.marker("bush 0"))
    old, renewed, new = solutions(mech, (1.0, 0.5 * STEP, 0.0))
    assert np.abs(old - new)[-3:].max() > 0.05 * np.abs(new[-3:]).max()
    assert_allclose(renewed[:-3], new[:-3], atol=1e-12 * np.abs(new[:-3]).max())
    assert_allclose(renewed[-3:], new[-3:], atol=1e-12 * np.abs(new[-3:]).max())


def test_renewed_damping_is_that_of_the_new_matrix():
    old, renewed, new = solutions(shaft(), (1.0, 0.5 * STEP, 0.0))
    assert np.abs(old - new).max() > 0.05 * np.abs(new).max()
    assert_allclose(renewed, new, atol=1e-12 * np.abs(new).max())


@pytest.mark.parametrize("cavitation", ["none", "reynolds"])
def test_renewed_stiffness_lacks_only_what_turns_with_the_shaft(cavitation):
    old, renewed, new = solutions(shaft(cavitation), (1.0, 0.5 * STEP, 0.25 * STEP**2))
    assert np.abs(renewed - new).max() < 0.02 * np.abs(old - new).max()


def test_renewed_stiffness_is_not_its_transpose():
    """Films push across the way of the journal: alone their stiffness is not symmetric."""
    old, renewed, new = solutions(shaft(), (1.0, 0.0, 0.25 * STEP**2))
    assert np.abs(old - new).max() > 1e-3 * np.abs(new).max()
    assert np.abs(renewed - new).max() < 0.02 * np.abs(old - new).max()


@pytest.mark.parametrize("cavitation", ["reynolds", "jfo"])
def test_motions_are_those_without_renewal(cavitation, monkeypatch):
    renewed = rom.simulate(shaft(cavitation), t_end=0.02, dt=STEP)
    monkeypatch.setattr(renewal, "MIN_VELOCITIES", 100)
    plain = rom.simulate(shaft(cavitation), t_end=0.02, dt=STEP)
    assert renewed.statistics["iterations"] != plain.statistics["iterations"]
    assert_allclose(renewed.q, plain.q, atol=1e-10)


def test_a_run_goes_on_to_the_bit_from_its_middle():
    mech = shaft()
    whole = rom.simulate(mech, t_end=0.02, dt=STEP)
    half = rom.simulate(mech, t_end=0.01, dt=STEP)
    rest = rom.simulate(mech, state=half.final, t_end=0.02, dt=STEP)
    assert np.array_equal(rest.q[-1], whole.q[-1])


def test_only_large_mechanisms_with_few_films_are_renewed(monkeypatch):
    monkeypatch.setattr(renewal, "MIN_VELOCITIES", 18)
    assert len(packing.pack(shaft()).system.renewed) == 2
    monkeypatch.setattr(renewal, "MIN_VELOCITIES", 19)
    assert len(packing.pack(shaft()).system.renewed) == 0
    monkeypatch.setattr(renewal, "MIN_VELOCITIES", 0)
    monkeypatch.setattr(renewal, "MAX_RENEWED", 1)
    assert len(packing.pack(shaft()).system.renewed) == 0
