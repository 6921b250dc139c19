"""Derivatives that come with the tangents of time steps, against differences of whole motions."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import block_diag

import rom
from benchmarks.units import as_mechanism
from cases.gear_unit import rigid_unit
from cases.mbs.parts import ORIGIN, Y, Z
from rom.components.orbits import motion as search
from rom.components.orbits.derivatives import by_differences, by_steps, confirmed, follows
from rom.components.orbits.flow import Flow
from rom.components.orbits.shooting import Return, Turns, turns_of

STIFFNESS, DAMPING, RATE = 4.0, 0.4, 1.3


def swung(mechanism, period, steps=40, turns=None):
    """A period from where bodies were added, after one that has brought the method there."""
    flow = Flow(mechanism, 0.0, period, steps, 0.8)
    start = flow.begun(flow.initial())
    turning = turns_of(mechanism, turns, start.state) if turns else Turns()
    return Return.of(flow, turning, Return.of(flow, turning, start).back)


def assert_same(one, two, atol=1e-5):
    size = np.abs(two.E).max(axis=0)
    assert_allclose(one.B, two.B, atol=1e-7)
    assert_allclose(one.E / size, two.E / size, atol=atol)


def chain(n=3, joint="spherical", again=False):
    """Links that tumble in space; joints on demand held twice."""
    mech, end = rom.Mechanism(gravity=(0, 0, -9.81)), None
    for k in range(n):
        link = mech.add_rigid(f"link {k}", mass=1.0, inertia=(0.02, 0.05, 0.06), at=(k, 0.1 * k, 0),
                              omega=(0.3, -1.0, 0.2 * k),
                              markers={"a": (-0.5, 0, 0), "b": (0.5, 0.1, 0)})  # fmt: skip
        end = mech.ground.marker((-0.5, 0, 0)) if end is None else end
        for twice in range(1 + again):
            pin = f"pin {k} {twice}"
            if joint == "spherical":
                mech.spherical(pin, end, link.marker("a"))
            else:
                mech.revolute(pin, end, link.marker("a"), axis=(Y, Z)[k % 2])
        end = link.marker("b")
    return mech


@pytest.mark.parametrize("more", [{}, {"joint": "revolute", "n": 5}, {"again": True}], ids=str)
def test_links_that_tumble_in_space_have_the_derivatives_of_differences(more):
    found = swung(chain(**more), 0.6)
    assert found.chart.size > 8
    assert_same(by_steps(found), by_differences(found))


def test_a_body_that_advances_is_turned_back_with_its_small_motions():
    mech = rom.Mechanism(gravity=(0, 0, 0))
    disc = mech.add_rigid("disc", mass=1.0, inertia=(0.2, 0.2, 0.3), at=(0.05, 0.02, 0),
                          omega=(0.1, 0.2, 9.0))  # fmt: skip
    mech.bushing("shaft", mech.ground.marker(ORIGIN), disc.marker(ORIGIN),
                 stiffness=(900, 700, 400, 0, 0, 0), damping=(3, 2, 4, 0, 0, 0))  # fmt: skip
    found = swung(mech, 0.3, turns={"disc": 9.0 * 0.3})
    assert found.chart.size == 12
    assert_same(by_steps(found), by_differences(found), atol=2e-4)


def test_films_and_teeth_have_the_derivatives_of_differences():
    """Films are so thin that differences have to be finer; teeth leave out how forces turn."""
    unit = rigid_unit(speed=400.0)
    mech = as_mechanism(unit)
    flow = Flow(mech, 0.0, unit.mesh_period, 60, 0.8)
    geared = Return.of(flow, Turns(), flow.begun(rom.equilibrium(mech)))
    wanted = by_differences(geared, 1e-8)
    assert_same(by_steps(geared), wanted, atol=0.03)
    found = np.sort(np.abs(confirmed(geared).multipliers))
    assert_allclose(found, np.sort(np.abs(wanted.multipliers)), atol=1e-4)
    assert follows(geared) and confirmed(geared).carried


def lagging(t, parameters, motion, memory, out):
    out.memory[0] = memory[0] + 0.2 * (motion.position[0, 0] - memory[0])
    out.force[0, 0] = -3.0 * memory[0]


def test_what_steps_do_not_know_is_noticed():
    """Memory goes on from step to step without a tangent: then all derivatives are differences."""
    mech = chain(2)
    found = swung(mech, 0.5)
    assert confirmed(found).carried
    mech.law("lag", lagging, mech.part("link 1").marker("b"), memory=(0.0,))
    found = swung(mech, 0.5)
    exact = by_differences(found)
    assert np.abs(by_steps(found).E - exact.E).max() > 0.03 * np.abs(exact.E).max()
    assert not confirmed(found).carried
    assert_allclose(confirmed(found).E, exact.E, atol=1e-5)


def test_films_that_remember_are_refused_by_name():
    """Their filling goes around with the oil, over revolutions; heat takes longer still."""
    unit = rigid_unit(speed=500.0)
    shafts = [
        replace(x, bearings={k: replace(b, cavitation="jfo") for k, b in x.bearings.items()})
        for x in (unit.pinion, unit.gear)
    ]
    filled = as_mechanism(replace(unit, pinion=shafts[0], gear=shafts[1]))
    for mech in (filled, as_mechanism(unit, oil=rom.mbs.iso_vg(46), inlet=50.0)):
        with pytest.raises(rom.ModelError, match="'pinion low' remembers its oil, its heat"):
            rom.periodic_motion(mech, period=unit.mesh_period, start=rom.equilibrium(mech))


@pytest.mark.parametrize("teeth", [1.1, 0.5])
def test_a_period_of_parts_of_teeth_is_refused(teeth):
    """Contact may be the same by chance wherever one looks."""
    unit = rigid_unit(speed=600.0, torque=30.0)
    mech = as_mechanism(unit)
    begin = {"period": teeth * unit.mesh_period, "start": rom.equilibrium(mech)}
    with pytest.raises(rom.ModelError, match=r"does not repeat|has gone on by 1\.1 teeth"):
        rom.periodic_motion(mech, **begin)


def test_corrections_and_motions_beside_say_what_derivatives_have_to_do():
    """The equation of the secant, after Broyden, and what was measured in its own directions."""
    one = swung(chain(2), 0.5)
    wrong = by_steps(one)
    wrong = replace(wrong, E=wrong.E + np.random.default_rng(3).normal(size=wrong.E.shape))
    y = 1e-6 * np.arange(1.0, len(wrong.B) + 1)
    two = Return.of(one.flow, one.turns, one.chart.moved(y), one.chart)
    better = wrong.followed(one, two)
    assert_allclose((better.E - better.B) @ y, two.gap - one.gap, atol=1e-9)
    assert not better.own and wrong.own
    Y = np.linalg.qr(np.random.default_rng(4).normal(size=(len(wrong.B), 2)))[0]
    measured, missed = wrong.measured(Y)
    right = by_differences(one)
    X = np.linalg.solve(right.B, Y)
    assert_allclose(measured.E @ X, right.E @ X, atol=1e-5 * np.abs(right.E).max())
    assert missed == pytest.approx(np.abs((right.E - wrong.E) @ X).max(), rel=1e-3)


def test_derivatives_of_a_neighbour_count_in_the_coordinates_of_a_motion():
    """Free motions may be given in any combination; those of other joints are of no use."""
    found = swung(chain(2), 0.5)
    right = by_steps(found)
    kept, k = right.kept, found.chart.Zq.shape[1]
    draws = (np.random.default_rng(seed).normal(size=(k, k)) for seed in (1, 2))
    mixed = block_diag(*(np.linalg.qr(draw)[0] for draw in draws))
    other = replace(kept, Zq=kept.Zq @ mixed[:k, :k], Zv=kept.Zv @ mixed[k:, k:],
                    B=mixed.T @ kept.B @ mixed, E=mixed.T @ kept.E @ mixed)  # fmt: skip
    again = other.around(found)
    assert_allclose(again.E, right.E, atol=1e-9 * np.abs(right.E).max())
    assert_allclose(again.B, right.B, atol=1e-9)
    assert not again.own
    stranger = swung(chain(2, joint="revolute", again=False), 0.5)
    assert kept.around(stranger) is None
    turned = replace(kept, Zq=np.roll(kept.Zq, 1, axis=0), Zv=np.roll(kept.Zv, 1, axis=0))
    assert turned.around(found) is None


def pushed(force=1.0):
    """A ball on springs in all directions, pushed along x."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    ball = mech.add_rigid("ball", mass=1.0, inertia=(1, 1, 1), at=ORIGIN).marker(ORIGIN)
    base, every = mech.ground.marker(ORIGIN), np.ones(6)
    mech.bushing("springs", base, ball, stiffness=STIFFNESS * every, damping=DAMPING * every)
    mech.force("push", ball, lambda t: (force * np.cos(RATE * t), 0, 0))
    return mech


def assert_closed_form(motion, force=1.0):
    """The amplitude of a driven linear oscillator."""
    wanted = force / np.hypot(STIFFNESS - RATE**2, DAMPING * RATE)
    found = np.abs(motion.solution.position("ball")[:, 0]).max()
    assert found == pytest.approx(wanted, rel=2e-3) and motion.gap < 1e-10


def far(derivatives, factor):
    """Derivatives with which corrections are longer by a factor, or lead away."""
    B, E = derivatives.B, derivatives.E
    return replace(derivatives, E=B + (E - B) / factor)


def test_derivatives_of_steps_that_lead_away_give_way_to_differences(monkeypatch):
    asked = []

    def wrong(found):
        asked.append(found)
        return far(by_steps(found), -1.0)

    monkeypatch.setattr(search, "by_steps", wrong)
    assert_closed_form(rom.periodic_motion(pushed(), period=2 * np.pi / RATE, steps=100))
    assert len(asked) == 1


def limited(longest):
    """Motions whose start cannot be moved by more, as where no state satisfies the joints."""
    lengths, moved_by = [], search.moved_by

    def move(found, y):
        lengths.append(float(np.abs(y).max()))
        if lengths[-1] > longest:
            raise rom.ModelError("too far.")
        return moved_by(found, y)

    return lengths, move


def test_a_correction_whose_start_cannot_be_moved_is_halved(monkeypatch):
    lengths, move = limited(0.05)
    monkeypatch.setattr(search, "moved_by", move)
    assert_closed_form(rom.periodic_motion(pushed(), period=2 * np.pi / RATE, steps=100))
    assert lengths[0] > 0.1 and lengths[1] == pytest.approx(lengths[0] / 2)


def test_derivatives_of_a_neighbour_that_lead_to_no_motion_are_renewed(monkeypatch):
    T = 2 * np.pi / RATE
    near = rom.periodic_motion(pushed(), period=T, steps=100)
    near = replace(near, derivatives=far(near.derivatives, 1e6))
    lengths, move = limited(1.0)
    monkeypatch.setattr(search, "moved_by", move)
    assert_closed_form(rom.periodic_motion(pushed(1.5), period=T, steps=100, start=near), 1.5)
    assert min(lengths[: search.MAX_SHORTENINGS]) > 1.0


@pytest.mark.parametrize("factor", [1.0, -1.0])
def test_derivatives_of_a_neighbour_serve_as_long_as_they_lead_closer(monkeypatch, factor):
    """Those of another force are exact, as springs are straight; then those of steps come first."""
    asked, T = [], 2 * np.pi / RATE
    near = rom.periodic_motion(pushed(), period=T, steps=100)
    for name in ("by_steps", "by_differences"):
        way = getattr(search, name)
        monkeypatch.setattr(search, name, lambda x, way=way: asked.append((way, x.open)) or way(x))
    start = replace(near, derivatives=far(near.derivatives, factor))
    assert_closed_form(rom.periodic_motion(pushed(1.5), period=T, steps=100, start=start), 1.5)
    assert asked[0][0] is by_steps
    assert (asked[0][1] < 1e-5) == (factor == 1.0)
