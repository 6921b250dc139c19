"""Chains, trees and loops eliminated body by body: the whole solution, at linear cost."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.mbs.lagrange import lagrange, potential_force
from cases.mbs.mechanisms import random_body, simeon_rod
from rom.errors import ModelError, RomWarning
from rom.mbs.equations import equations, graph, linear_solve
from rom.mbs.equations.packing import pack
from rom.mbs.integrate.consistent_start import factorised, initial_state
from rom.mbs.integrate.step_memory import across
from rom.mbs.kernels.work import workspace

Z, GRAVITY = (0, 0, 1), 9.81


@cache
def rod():
    """A flexible rod with four planar shapes."""
    return simeon_rod(15.0)


def add_link(mech, name, at, flexible=True, **moving):
    """A link of 0.3 m along x, with the ends a and b."""
    if flexible:
        return mech.add_flexible(name, rod(), at=at, **moving)
    return mech.add_rigid(
        name, mass=0.15, inertia=(1e-5, 1.2e-3, 1.2e-3), at=np.add(at, (0.15, 0, 0)),
        markers={"a": (-0.15, 0, 0), "b": (0.15, 0, 0)}, **moving,
    )  # fmt: skip


def chain(n, *, flexible=True, held=True, gravity=GRAVITY, moving=None):
    """Links in a row, hinged to each other and to the ground; velocities of each, if any."""
    mech = rom.Mechanism(gravity=(0, -gravity, 0))
    before = mech.ground.marker((0, 0, 0)) if held else None
    for k in range(n):
        given = moving[k] if moving else {}
        link = add_link(mech, f"link {k}", (0.3 * k, 0, 0), flexible, **given)
        if before is not None:
            mech.revolute(f"pin {k}", before, link.marker("a"), axis=Z)
        before = link.marker("b")
    return mech


def tied_chain(n=8):
    """A chain with springs between links far apart and to the ground, and a damped hinge."""
    mech = chain(n)
    for k in range(0, n - 4, 2):
        ends = f"link {k}.b", f"link {k + 4}.b"
        mech.spring_damper(f"tie {k}", *ends, stiffness=30.0, damping=0.1, free_length=1.0)
    hook = mech.ground.marker((0.5, 1, 0))
    mech.spring_damper("rope", hook, f"link {n - 1}.b", stiffness=10.0)
    mech.rotational_spring("coil", "pin 3", stiffness=2.0, damping=0.02)
    return mech


def tree(generations=3):
    """Flexible bodies that branch in space, with ball joints, universal joints and bushings."""
    rng = np.random.default_rng(11)
    mech, body = rom.Mechanism(gravity=(0, 0, -GRAVITY)), random_body(rng)
    a, b = (np.asarray(body.markers[key].point) for key in "ab")
    tips = [mech.ground.marker((0, 0, 0))]
    places, made = [np.zeros(3)], 0
    for generation in range(generations):
        grown, where = [], []
        for tip, place in zip(tips, places, strict=True):
            for _ in range(2 if generation else 1):
                part = mech.add_flexible(f"body {made}", body, at=place - a)
                if made % 3 == 2:
                    soft = {"stiffness": [900.0] * 3 + [80.0] * 3, "damping": [2.0] * 3 + [1.0] * 3}
                    mech.bushing(f"joint {made}", tip, part.marker("a"), **soft)
                else:
                    mech.spherical(f"joint {made}", tip, part.marker("a"))
                grown.append(part.marker("b"))
                where.append(place - a + b)
                made += 1
        tips, places = grown, where
    return mech


def loops(cells=3):
    """Triangles of flexible links that close, one behind the other, each on the one before."""
    mech = rom.Mechanism(gravity=(0, -GRAVITY, 0))
    before = mech.ground.marker((0, 0, 0))
    for k in range(cells):
        x = 0.6 * k
        one = add_link(mech, f"one {k}", (x, 0, 0))
        two = add_link(mech, f"two {k}", (x + 0.3, 0, 0))
        strut = mech.add_rigid(
            f"strut {k}", mass=0.2, inertia=(1e-3,) * 3, at=(x + 0.1, 0.2, 0.1),
            markers={"low": (-0.1, -0.2, -0.1), "high": (0.1, 0.15, -0.1)},
        )  # fmt: skip
        mech.revolute(f"pin {k}", before, one.marker("a"), axis=Z)
        mech.revolute(f"knee {k}", one.marker("b"), two.marker("a"), axis=Z)
        mech.revolute(f"foot {k}", one.marker("a"), strut.marker("low"), axis=Z)
        mech.distance(f"tie {k}", strut.marker("high"), two.marker("b"))
        before = two.marker("b")
    return mech


def pinned(n=6):
    """A chain that hangs between two points; ball joints, so that nothing repeats."""
    rng = np.random.default_rng(5)
    mech, body = rom.Mechanism(gravity=(0, 0, -GRAVITY)), random_body(rng)
    a, b = (np.asarray(body.markers[key].point) for key in "ab")
    before, at = mech.ground.marker((0, 0, 0)), -a
    for k in range(n):
        part = mech.add_flexible(f"body {k}", body, at=at)
        mech.spherical(f"ball {k}", before, part.marker("a"))
        before, at = part.marker("b"), at + b - a
    mech.spherical("end", before, mech.ground.marker(at + a))
    return mech


def driven():
    """A free chain, one of its hinges with friction that grows with its load, another driven."""
    mech = chain(5, held=False)
    mech.friction("rub", "pin 2", mu=0.2, radius=0.01, transition_speed=0.05)
    mech.drive("motor", "pin 4", lambda t: 0.4 * np.sin(9 * t))
    return mech


def geared():
    """Two chains on the ground whose first hinges are coupled."""
    mech, _ = side_by_side(4, flexible=lambda k: k % 2 == 0)
    mech.gear("gear", "pin 0", "hinge 0", ratio=-2.0)
    return mech


def side_by_side(n, flexible=lambda k: True):
    """Two chains on the ground, and the ends of the links of the second."""
    mech = chain(n)
    ends = [mech.ground.marker((0, 0.5, 0))]
    for k in range(n):
        link = add_link(mech, f"other {k}", (0.3 * k, 0.5, 0), flexible(k))
        mech.revolute(f"hinge {k}", ends[-1], link.marker("a"), axis=Z)
        ends.append(link.marker("b"))
    return mech, ends[1:]


def bridge():
    """Two bodies on universal joints of their own, and a ball joint between them."""
    mech = rom.Mechanism(gravity=(0, 0, -GRAVITY))
    add_link(mech, "one", (0, 0, 0), flexible=False)
    two = add_link(mech, "two", (0.3, 0, 0), flexible=False)
    mech.universal("left", "ground", "one.a", axis1=Z, axis2=(0, 1, 0))
    ends = mech.ground.marker((0.5, 0.1, 0)), two.marker((0.05, 0.1, 0))
    mech.universal("right", *ends, axis1=(1, 0, 0), axis2=Z)
    mech.spherical("ball", "one.b", "two.a")
    return mech


CASES = {"chain": chain, "tied": tied_chain, "tree": tree, "loops": loops, "pinned": pinned,
         "driven": driven, "geared": geared, "bridge": bridge}  # fmt: skip


def made(case):
    return CASES[case](6) if case == "chain" else CASES[case]()


@pytest.fixture
def solved(monkeypatch):
    """A run by blocks or with whole matrices, whatever is quicker."""

    def run(mechanism, *, blocks, **options):
        monkeypatch.setattr(graph, "BLOCK_GAIN", 1e-12 if blocks else np.inf)
        assert pack(mechanism).by_blocks == blocks
        return rom.simulate(mechanism, **options)

    return run


def assert_same_motion(one, other, limits):
    """Each array to its limit, relative to the largest entry; everything accelerates."""
    assert one.packed.by_blocks and not other.packed.by_blocks
    assert np.abs(other.a).max() > 1.0
    for name, limit in limits.items():
        expected = getattr(other, name)
        size = np.abs(expected).max()
        assert_allclose(getattr(one, name), expected, atol=limit * size, rtol=0, err_msg=name)


def test_the_smallest_pivot_of_a_joint_is_looked_at():
    """With unit masses no pivot of a body is below one; joints that share a body have smaller."""
    packed = pack(chain(12, flexible=False))
    W = workspace(packed.system, 0)
    equations.linearize_constraints(packed.system, W, packed.q, packed.v)
    W.S[:] = 0.0
    for row in packed.system.graph.x[packed.system.graph.own]:
        W.S[row : row + 6] = np.eye(6)
    passed = [factorised(packed, W, pivot) for pivot in (0.0, 1e-3, 0.999, 1e3)]
    assert passed == [True, True, False, False]


@pytest.mark.parametrize("case", CASES)
def test_the_motion_is_that_of_whole_matrices(case, solved):
    """Round-off of positions is divided by the step in velocities, and again in accelerations."""
    options = {"t_end": 0.03, "dt": 1e-3, "tolerance": 1e-12}
    one, other = (solved(made(case), blocks=blocks, **options) for blocks in (True, False))
    assert_same_motion(one, other, {"q": 1e-10, "v": 1e-9, "a": 1e-6, "lam": 1e-6})
    options["tolerance"] = 1e-8  # where no correction is a matter of round-off
    pair = (solved(made(case), blocks=blocks, **options) for blocks in (True, False))
    counted = [sol.statistics["iterations"] for sol in pair]
    assert abs(counted[0] - counted[1]) <= 1, "the iteration matrix is another one"


@pytest.mark.parametrize("method", ["generalized-alpha", "bdf"])
def test_steps_of_chosen_length_end_where_whole_matrices_do(method, solved):
    one, other = (solved(driven(), blocks=blocks, t_end=4e-3, method=method) for blocks in (1, 0))
    assert_same_motion(one.at(4e-3), other.at(4e-3), {"q": 1e-7, "v": 1e-5})


@pytest.mark.parametrize("case", CASES)
def test_accelerations_and_reactions_are_those_of_whole_matrices(case, solved):
    """Of the explicit method, which solves for them in every instant."""
    options = {"t_end": 2e-4, "dt": 1e-4, "method": "dop853"}
    one, other = (solved(made(case), blocks=blocks, **options) for blocks in (True, False))
    assert_same_motion(one, other, dict.fromkeys(("q", "v", "a", "lam"), 1e-10))


def test_a_pendulum_of_rods_swings_as_lagrange_has_it(solved):
    """Six rods of 0.3 m and 0.15 kg, thrown and let fall, against the equations in their angles."""
    n, t_end = 6, 0.5
    speeds = np.array([2.0, -3.0, 1.0, 4.0, -2.0, 3.0])
    ends = 0.3 * np.cumsum(np.r_[0, speeds[:-1]])
    moving = [{"velocity": (0, v + 0.15 * w, 0), "omega": (0, 0, w)}
              for v, w in zip(ends, speeds, strict=True)]  # fmt: skip
    mech = chain(n, flexible=False, moving=moving)
    sol = solved(mech, blocks=True, t_end=t_end, dt=t_end, method="dop853")

    def centres(phi):
        steps = 0.3 * np.array([np.cos(phi), np.sin(phi), 0 * phi])
        return np.cumsum(steps, axis=1) - 0.5 * steps

    def points(phi):
        return np.r_[np.sqrt(0.15) * centres(phi).ravel(), np.sqrt(1.2e-3) * phi]

    weight = potential_force(lambda phi: 0.15 * GRAVITY * centres(phi)[1].sum())
    angles = lagrange(points, weight, np.zeros(n), speeds, (0.0, t_end))[:n, -1]
    assert np.ptp(angles) > 1.0
    found = [sol.position(name)[-1] for name in mech.parts]
    assert_allclose(found, centres(angles).T, atol=1e-9)


def test_a_free_chain_keeps_momentum_and_energy(solved):
    moving = [{}] * 3 + [{"velocity": (0, 2, 0)}] + [{}] * 2 + [{"omega": (0, 0, 20)}, {}]
    mech = chain(8, held=False, gravity=0.0, moving=moving)
    sol = solved(mech, blocks=True, t_end=0.1, dt=2e-4, rho_inf=1.0, assemble=True)
    report = rom.audit(sol)
    assert report.ok, report
    kept = [row.quantity for row in report.rows]
    assert {"change of linear momentum", "change of angular momentum"} <= set(kept)


def lengths(mech):
    """Numbers in the factor, operations of a factorisation, and numbers in all working memory."""
    packed = pack(mech)
    assert packed.by_blocks
    plan = packed.system.graph.plan
    d, c = plan.size.astype(float), plan.wide.astype(float)
    W = workspace(packed.system, len(packed.signals))
    small = sum(x.size for name, x in W.items() if name != "lu")
    return np.array([plan.memory[0], (d**3 * 2 / 3 + 2 * d * d * c + 2 * d * c * c).sum(), small])


def ladder(n):
    """Two chains side by side with a spring from each link to its neighbour."""
    mech, ends = side_by_side(n)
    for k, end in enumerate(ends):
        mech.spring_damper(f"rung {k}", mech.parts[f"link {k}"].marker("b"), end, stiffness=9.0)
    return mech


def star(n):
    mech = rom.Mechanism()
    hub = mech.add_rigid("hub", mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0), markers={"c": (0, 0, 0)})
    for k in range(n):
        link = add_link(mech, f"link {k}", (0, 0, 0))
        mech.revolute(f"pin {k}", hub.marker("c"), link.marker("a"), axis=Z)
    return mech


@pytest.mark.parametrize("made", [chain, loops, ladder, star])
def test_work_and_memory_grow_with_the_number_of_bodies_only(made):
    """Three lengths on a straight line: what n more bodies add does not depend on those there."""
    least = 30 if made is star else 20
    one, two, three = (lengths(made(k * least)) for k in (1, 2, 3))
    assert_allclose(three - two, two - one, rtol=0.02)
    assert np.all(three < 3.3 * one)


@pytest.mark.parametrize("case", ["chain", "loops", "geared"])
def test_motions_across_the_constraints_are_those_of_whole_matrices(case, monkeypatch):
    """The part of each of three velocities that opens the joints, with the least kinetic energy."""
    found = []
    for worth in (1e-12, np.inf):
        monkeypatch.setattr(graph, "BLOCK_GAIN", worth)
        packed = pack(made(case))
        shift = np.random.default_rng(4).normal(size=(packed.v.size, 3))
        run = SimpleNamespace(packed=packed), workspace(packed.system, 0), initial_state(packed)
        found.append(np.array([across(*run, x) for x in shift.T.copy()]))
    assert_allclose(found[0], found[1], atol=1e-10 * np.abs(found[1]).max())
    assert np.abs(found[0]).max() > 0.1


def test_a_few_bodies_keep_whole_matrices():
    assert not pack(chain(3)).by_blocks
    assert pack(chain(16)).by_blocks


def test_joints_that_repeat_others_are_found_in_a_long_chain(solved):
    mech = chain(7, flexible=False)
    add_link(mech, "one", (1.8, 0.3, 0), flexible=False)
    side = {"mass": 0.1, "inertia": (1e-3,) * 3, "markers": {"a": (0, -0.15, 0), "b": (0, 0.15, 0)}}
    mech.add_rigid("left", at=(1.8, 0.15, 0), **side)
    mech.add_rigid("right", at=(2.1, 0.15, 0), **side)
    corners = "link 6.a", "left.a", "left.b", "one.a", "one.b", "right.b", "right.a", "link 6.b"
    for k in range(4):
        mech.revolute(f"corner {k}", *corners[2 * k : 2 * k + 2], axis=Z)
    found = []
    for blocks in (True, False):
        with pytest.warns(RomWarning, match="3 of 55 constraints repeat others; joints corner 0"):
            found.append(solved(mech, blocks=blocks, t_end=0.02, dt=1e-3))
    assert found[0].statistics["redundant"] == found[1].statistics["redundant"] == 3
    assert_allclose(found[0].q[-1], found[1].q[-1], rtol=0, atol=1e-12)


def test_a_chain_that_cannot_be_closed_is_refused(monkeypatch):
    monkeypatch.setattr(graph, "BLOCK_GAIN", 1e-12)
    mech = chain(5)
    mech.distance("rope", mech.ground.marker((9, 0.1, 0)), "link 4.b", length=1.0)
    with pytest.raises(ModelError, match="cannot be assembled"):
        initial_state(pack(mech))


def test_gaps_are_closed_by_the_least_motion_of_whole_matrices(monkeypatch):
    starts = []
    for worth in (1e-12, np.inf):
        monkeypatch.setattr(graph, "BLOCK_GAIN", worth)
        packed = pack(chain(6))
        rng = np.random.default_rng(2)
        q, v = packed.q.copy(), rng.normal(size=packed.v.size)
        for at in packed.system.bodies.q_at:
            q[at : at + 3] += 0.02 * rng.normal(size=3)
        starts.append(initial_state(replace(packed, q=q, v=v), assemble=True))
    for name in ("q", "v"):
        assert_allclose(getattr(starts[0], name), getattr(starts[1], name), atol=1e-11)
    assert np.abs(starts[0].v).max() > 0.1


def random_blocks(case, monkeypatch, weak=()):
    """Graph and memory with random blocks, not symmetric, and the whole matrix they stand for.

    Bodies in ``weak`` have three motions without any mass or stiffness.
    """
    monkeypatch.setattr(graph, "BLOCK_GAIN", 1e-12)
    packed, rng = pack(made(case)), np.random.default_rng(1)
    s, n, m = packed.system, packed.v.size, packed.system.rows.kind.size
    W, Y, size = workspace(s, len(packed.signals)), s.graph, 6 + s.bodies.r
    A = np.zeros((n + m, n + m))
    for b, t in enumerate(s.bodies.v_at):
        for e in range(Y.first[b], Y.first[b + 1]):
            c, u = Y.other[e], s.bodies.v_at[Y.other[e]]
            block = 0.03 * rng.normal(size=(size[b], size[c])) + (b == c) * np.eye(size[b], size[c])
            if b in weak or c in weak:
                part = rng.normal(size=(size[b], size[c] - 3))
                block = float(b == c) * part @ part.T
            W.S[Y.x[e] : Y.x[e] + size[b], : size[c]] = block
            A[t : t + size[b], u : u + size[c]] = block
    for k in range(m):
        for b, at in zip(Y.body[k], Y.at[k], strict=True):
            for row, out in ((W.UG[k], A.T), (W.UGT[k], A)) if b >= 0 else ():
                row[at : at + size[b]] = rng.normal(size=size[b])
                t = s.bodies.v_at[b]
                out[n + k, t : t + size[b]] = row[at : at + size[b]]
        W.UGT[k] = W.UG[k] + 0.03 * W.UGT[k]
    A[n:, :n] = A[:n, n:].T + 0.03 * A[n:, :n]
    return s, W, A


@pytest.mark.parametrize(("case", "weak"), [*((case, ()) for case in CASES), ("pinned", (3,))])
def test_random_blocks_are_solved_like_their_whole_matrix(case, weak, monkeypatch):
    """And by it where a body has no stiffness of its own: joints hold it from both sides."""
    s, W, A = random_blocks(case, monkeypatch, weak)
    b = np.random.default_rng(2).normal(size=len(A))
    n, m = W.residual.size, W.value.size
    W.rhs[:n], W.part[:] = b[:n], b[n:]
    x, lam = np.zeros(n), np.zeros(m)
    assert linear_solve.factorise_bordered(s, W, m) and W.by_blocks[0] == (not weak)
    linear_solve.solve_bordered(s, W, m, x, lam)
    assert_allclose(np.r_[x, lam], np.linalg.solve(A, b), atol=1e-10 * np.abs(lam).max())


def test_a_thousand_links_move():
    """Without a matrix of their size anywhere; the mass centre falls as the reaction lets it."""
    sol = rom.simulate(chain(1000, flexible=False), t_end=5e-3, dt=1e-3)
    assert sol.packed.by_blocks and sol.q.shape[1] == 7000
    packed = sol.packed
    at = packed.system.bodies.v_at
    held = sol.a[:, at + 1] @ packed.system.bodies.mass + GRAVITY * packed.mass
    assert_allclose(sol.reaction("pin 0")[:, 1], held, rtol=1e-6)
