"""Equilibria past limit points and onto branches, against closed forms."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import ellipk

import rom
from cases.long import few
from cases.mbs.parts import ORIGIN, X, Y, Z, held_rod, on_guide, on_hinge
from cases.refusals import refuses
from rom.components import cosserat


def column(mech, name="column", x=0.0, half=1.0):
    """The top of a stiff column on a hinge about y at its foot."""
    part = mech.add_rigid(name, mass=1, inertia=(1, 1, 1), at=(x, 0, half))
    foot = part.marker((0, 0, -half))
    mech.revolute(f"hinge of {name}", mech.ground.marker((x, 0, 0)), foot, axis=Y)
    return part.marker((0, 0, half))


def hinged_column(mech=None, name="column", x=0.0, stiffness=10.0):
    """A column of length 2 m with a spring in its hinge [N m/rad], under a dead load."""
    mech = mech or rom.Mechanism(gravity=ORIGIN)
    top = column(mech, name, x)
    mech.rotational_spring(f"spring of {name}", f"hinge of {name}", stiffness=stiffness)
    mech.force(f"load of {name}", top, lambda t: (0, 0, -t))
    return mech, top


def test_two_columns_that_buckle_in_one_step_are_told_apart():
    mech = rom.Mechanism(gravity=(0, 0, 0))
    for k, stiffness in enumerate((10.0, 10.02, 12.0)):
        hinged_column(mech, f"{k}", k, stiffness)
    path = rom.continuation(mech, (0.0, 20.0))
    assert_allclose(loads(path), [5.0, 5.01, 6.0], rtol=1e-9)
    for k, critical in enumerate(path.critical):
        assert np.argmax(np.abs(critical.motion)) // 6 == k
    assert path.unstable[-1] == 3


def test_a_branch_that_crosses_at_an_angle_is_the_closed_form():
    """A column held by a sloping spring (Koiter): P = k (s0 / s - 1) L cos(a) / sin(a)."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    top = column(mech, half=0.5)
    mech.spring_damper("spring", mech.ground.marker((1, 0, 0)), top, stiffness=10.0)
    mech.force("load", top, lambda t: (0, 0, -t))
    start = rom.continuation(mech, (0.0, 20.0)).critical[0]
    # at a crossing at an angle equations fix the column to the root of round-off, 1e-8, and its
    # critical load follows in proportion
    assert_allclose(start.state.t, 5.0, rtol=1e-7)
    for sign in (1, -1):
        leaves = {"state": start.state, "along": sign * start.motion}
        branch = rom.continuation(mech, (0.0, 8.0), **leaves, n=12)
        x = branch.position(top)[1:]
        a = np.arctan2(x[:, 0], x[:, 2])
        load = 10.0 * (np.sqrt(2) / np.sqrt(2 - 2 * np.sin(a)) - 1) / np.tan(a)
        assert sign * a[-1] > 0.1
        assert_allclose(branch.t[1:], load, rtol=1e-9)
        assert np.all(branch.unstable[1:] == (branch.t[1:] < 5.0))


def kinds(path):
    return [x.kind for x in path.critical]


def loads(path):
    return [x.state.t for x in path.critical]


def test_a_hinged_column_buckles_and_its_branch_is_the_closed_form():
    """P L sin(a) = k a, and before it buckles vibrations of omega^2 = (k - P L) / I."""
    mech, top = hinged_column()
    path = rom.continuation(mech, (0.0, 20.0))
    assert path.t[-1] == pytest.approx(20.0, rel=1e-12)
    assert kinds(path) == ["bifurcation"]
    assert_allclose(loads(path), [5.0], rtol=1e-9)
    assert_allclose(path.unstable, path.t > 5.0 + 1e-9)
    for state in path.states[:5]:
        squares = rom.linearize(mech, state).eigenvalues ** 2
        assert_allclose(-squares.real, (10.0 - 2.0 * state.t) / 2.0, rtol=1e-9)
    start = path.critical[0]
    for sign in (1, -1):
        branch = rom.continuation(mech, (0.0, 9.0), state=start.state, along=sign * start.motion)
        x = branch.position(top)
        a = np.arctan2(x[:, 0], x[:, 2])
        assert sign * a[-1] > 1.5
        assert_allclose(branch.t[1:], 5.0 * a[1:] / np.sin(a[1:]), rtol=1e-12)
        assert not branch.unstable.any()
        assert not branch.critical


def truss(height=0.3, stiffness=1000.0):
    """Two springs that lean on each other (von Mises), and the load at a height z."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    at = (0, 0, height)
    top = on_guide(mech, "top", at=at, base=at, axis=Z)
    for side in (-1, 1):
        foot = mech.ground.marker((side, 0, 0))
        mech.spring_damper(f"bar {side}", foot, top, stiffness=stiffness)
    mech.force("load", top, lambda t: (0, 0, -t))
    long = np.hypot(1, height)
    return mech, top, lambda z: 2 * stiffness * (long / np.hypot(1, z) - 1) * z


@pytest.mark.parametrize("dense", few(1, [500, 0]))
def test_a_truss_snaps_through_both_limit_points(dense, monkeypatch):
    monkeypatch.setattr("rom.components.orbits.equilibria.MAX_DENSE", dense)
    mech, top, load = truss()
    path = rom.continuation(mech, (0.0, 100.0))
    z = path.position(top)[:, 2]
    assert_allclose(path.t, load(z), atol=1e-10)
    assert z[-1] < -0.3
    chords = np.diff([np.sqrt(0.5) * z / 0.3, path.t / 100.0], axis=1)
    chords /= np.linalg.norm(chords, axis=0)
    assert np.sum(chords[:, 1:] * chords[:, :-1], axis=0).min() > 0.8
    limit = np.sqrt(np.hypot(1, 0.3) ** (2 / 3) - 1)
    assert kinds(path) == ["limit", "limit"]
    assert_allclose(loads(path), [load(limit), load(-limit)], rtol=1e-10)
    assert_allclose(path.unstable, np.abs(z) < limit)
    assert np.argmax(np.abs(path.critical[0].motion)) == 2


def test_a_path_goes_either_way_and_ends_as_far_behind_its_beginning():
    mech, top, load = truss()
    path = rom.continuation(mech, (0.0, -20.0))
    assert not path.critical
    assert_allclose(path.t, load(path.position(top)[:, 2]), atol=1e-10)
    assert path.t[-1] == pytest.approx(-20.0, rel=1e-12)
    back = rom.continuation(mech, (9.0, 10.5))
    assert back.t[-1] == pytest.approx(7.5, rel=1e-12)
    assert len(rom.continuation(mech, (0.0, 100.0), n=7).states) == 7


@pytest.mark.parametrize("dense", few(1, [0, 500]))
def test_a_crank_longer_than_its_rod_turns_back_at_its_dead_point(dense, monkeypatch):
    """The time of a drive turns back as loads do: at sin(angle) = rod / crank."""
    monkeypatch.setattr("rom.components.orbits.equilibria.MAX_DENSE", dense)
    mech = rom.Mechanism(gravity=(0, 0, 0))
    solid = {"mass": 1.0, "inertia": (1, 1, 1)}
    crank = on_hinge(mech, X, "crank", **solid, axis=Z)
    rod = mech.add_rigid("rod", **solid, at=(2.5, 0, 0), markers={"a": (-0.5, 0, 0), "b": X / 2})
    slider = on_guide(mech, "slider", at=3 * X, base=3 * X)
    mech.revolute("pin", crank.marker(X), rod.marker("a"), axis=Z)
    mech.spherical("end", rod.marker("b"), slider)
    mech.drive("angle", "hinge", lambda t: t)
    path = rom.continuation(mech, (0.0, 1.0), n=60)
    assert kinds(path)[:1] == ["limit"]
    assert_allclose(loads(path)[0], np.pi / 6, rtol=1e-9)
    x = path.position(slider)[:, 0]
    assert_allclose((x - 2 * np.cos(path.t)) ** 2, 1 - (2 * np.sin(path.t)) ** 2, atol=1e-9)
    assert x.min() < 1.5


def shallow_arch(n, slenderness, rise=0.01):
    """A pinned arch of sinusoidal shape and load, rise^2 = slenderness I / A; time: Q / Q0."""
    stretch = 1.0e4
    bend = stretch * rise**2 / slenderness

    def place(s):
        tangent = np.array([1, 0, rise * np.pi * np.cos(np.pi * s)])
        tangent /= np.linalg.norm(tangent)
        axes = np.column_stack([np.cross(Y, tangent), Y, tangent])
        return (s, 0, rise * np.sin(np.pi * s)), axes

    section = {"stretch": stretch, "bend": (1e3 * bend, bend, 1e3 * bend), "mass": 1.0}
    rod = cosserat.along(place, np.linspace(0, 1, n + 1), **section, inertia=1e-3)
    mech = rom.Mechanism(gravity=(0, 0, 0))
    arch = mech.add_nonlinear("arch", cosserat.body(rod))
    mech.revolute("a", mech.ground.marker((0, 0, 0)), arch.marker("start"), axis=Y)
    mech.revolute("b", mech.ground.marker((1, 0, 0)), arch.marker("end"), axis=Y)
    for k in range(1, n):
        share = bend * np.pi**4 * rise * np.sin(np.pi * rod.x[k, 0]) / n
        piece = mech.parts[f"arch.{k}"].marker(ORIGIN)
        mech.force(f"load {k}", piece, lambda t, share=share: (0, 0, -share * t))
    return mech


@pytest.mark.parametrize(("slenderness", "n"), few(1, [(12, 14), (30, 14), (30, 40)]))
def test_a_shallow_arch_passes_its_limit_points_and_where_it_gives_way_sideways(slenderness, n):
    """Q / Q0 = (1 - x) + c x (1 - x^2), x = f / f0, c = slenderness / 4; two half waves at its
    thrust of 4 pi^2 EI / L^2 (Timoshenko, Gere, Theory of Elastic Stability, section 7.7)."""
    path = rom.continuation(shallow_arch(n, slenderness), (0.0, 6.0))
    c = slenderness / 4
    x = np.sqrt((c - 1) / (3 * c))
    expected = {"limit": [(1 - y) + c * y * (1 - y * y) for y in (x, -x)], "bifurcation": []}
    if slenderness > 22:
        x = np.sqrt(1 - 4 / c)
        expected["bifurcation"] = [(1 - y) + c * y * (1 - y * y) for y in (x, -x)]
    for kind, values in expected.items():
        found = [x.state.t for x in path.critical if x.kind == kind]
        # chords instead of a curve; a higher arch gives way in shorter waves
        assert_allclose(found, values, rtol=(4.0 if slenderness == 12 else 7.0) / n**2)
    assert path.unstable[0] == path.unstable[-1] == 0


def upright(n=16, weak=1.0, stiff=50.0):
    section = {"stretch": 1e5, "bend": (stiff, weak, stiff), "mass": 1.0, "inertia": 1e-3}
    mech, rod = held_rod(n, **section)
    return mech, rod.marker("end")


@pytest.mark.parametrize("dense", few(1, [500, 0]))
def test_eulers_column_and_the_elastica_behind_it(dense, monkeypatch):
    """P / Pcr = (2 K(sin(a / 2)) / pi)^2 at the slope a of the tip."""
    monkeypatch.setattr("rom.components.orbits.equilibria.MAX_DENSE", dense)
    mech, tip = upright()
    mech.force("load", tip, lambda t: (0, 0, -t))
    path = rom.continuation(mech, (0.0, 3.0))
    assert kinds(path) == ["bifurcation"]
    assert_allclose(loads(path), [np.pi**2 / 4], rtol=2e-3)
    start = path.critical[0]
    branch = rom.continuation(mech, (0.0, 3.4), state=start.state, along=start.motion, step=0.3)
    axes = branch.states[-1].q[-4:]
    slope = 2 * np.arctan2(np.linalg.norm(axes[1:]), abs(axes[0]))
    factor = (2 * ellipk(np.sin(slope / 2) ** 2) / np.pi) ** 2
    assert slope > 1.0
    assert_allclose(branch.t[-1] / start.state.t, factor, rtol=3e-3)
    assert not branch.unstable.any()


def test_a_narrow_cantilever_twists_away_under_a_load_in_its_plane():
    """P = 4.0126 sqrt(EI GJ) / L^2 (Prandtl 1899), for a beam that hardly bends before."""
    mech, rod = held_rod(30, stretch=1e6, bend=(1.0, 1e4, 2.0), mass=1.0, inertia=1e-3)
    mech.force("load", rod.marker("end"), lambda t: (t, 0, 0))
    path = rom.continuation(mech, (0.0, 7.0))
    assert kinds(path) == ["bifurcation"]
    assert_allclose(loads(path), [4.0126 * np.sqrt(2.0)], rtol=2e-3)


def test_loads_that_turn_with_a_column_do_not_buckle_it():
    """Beck's column never has a second equilibrium; at 20.05 EI / L^2 it flutters."""
    mech, tip = upright(12)
    mech.force("load", tip, lambda t: (0, 0, -t), frame="body")
    path = rom.continuation(mech, (0.0, 19.0), step=0.5)
    assert not path.critical
    assert not path.unstable.any()


def test_what_makes_no_path_is_named():
    mech, _ = hinged_column()
    state, other = rom.equilibrium(mech), rom.equilibrium(truss()[0])
    foreign = "joint coordinates that forces act on"
    for wish, why in (
        ({"span": (1.0, 1.0)}, "needs two values that differ"),
        ({"span": (0.0, 1.0), "along": np.ones(6)}, "a branch leaves a state"),
        ({"span": (0.0, 1.0), "along": np.ones(5), "state": state}, "along"),
        ({"span": (0.0, 1.0), "along": np.zeros(6), "state": state}, "along needs a motion"),
        ({"span": (5.0, 6.0), "along": np.ones(6), "state": state}, "it must be in the span"),
        ({"span": (0.0, 1.0), "along": np.ones(6), "state": other}, foreign),
    ):
        refuses(rom.ConfigError, why, rom.continuation, mech, **wish)
    for ask in (rom.equilibrium, rom.linearize):
        refuses(rom.ConfigError, foreign, ask, mech, other)
    free = rom.Mechanism(gravity=(0, 0, 0))
    free.add_rigid("stone", mass=1, inertia=(1, 1, 1), at=(0, 0, 0))
    refuses(rom.ModelError, "there is no unique equilibrium", rom.continuation, free, (0.0, 1.0))
    place, stray = rom.continuation(mech, (0.0, 1.0)).position, mech.ground.marker((0, 0, 7))
    refuses(rom.ConfigError, "must be a marker", place, stray)


def test_a_path_that_is_lost_leaves_what_was_found():
    mech, top = hinged_column()
    mech.force("end", top, lambda t: (0, 0, 0.0 if t < 1.0 else np.nan))
    with pytest.raises(rom.SolverError) as caught:
        rom.continuation(mech, (0.0, 3.0))
    path = caught.value.solution
    assert 0.9 < path.t[-1] < 1.0
    assert path.unstable.size == len(path.states)
