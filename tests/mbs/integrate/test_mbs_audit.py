"""The audit of a motion: quiet when it is right, red in the right line when it is not."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

import rom
from cases.mbs.mechanisms import lattice, lattice_body, simulate_quietly, slider_crank
from rom.mbs.elements import bushings, family


def failures(solution, **changed):
    """What fails in the audit of a motion, some of which is changed."""
    seen = replace(solution, **changed, _tracks={}) if changed else solution
    return [row.quantity for row in rom.audit(seen).failures]


def test_good_motions_pass_and_what_is_wrong_in_them_is_seen():
    crank = simulate_quietly(slider_crank(gravity=9.81), t_end=0.1, dt=1e-4)
    mech = rom.Mechanism(gravity=(0, 0, 0))  # a flexible bar thrown into empty space
    mech.add_flexible("bar", lattice_body(lattice(stiffness=2e5)), omega=(1.0, 2.0, 5.0))
    free = rom.simulate(mech, t_end=0.05, dt=1e-5, rho_inf=1.0)
    assert rom.audit(crank).ok, rom.audit(crank)
    assert rom.audit(free).ok, rom.audit(free)
    names = [row.quantity for row in rom.audit(free).rows]
    assert "change of angular momentum" in names
    assert "largest deformation of bar / size" in names
    q, free_q, v = crank.q.copy(), free.q.copy(), free.v.copy()
    q[500, 14] += 1e-8  # the slider leaves its wrist pin
    assert failures(crank, q=q) == ["largest gap in a joint / size"]
    assert "energy balance / energy" in failures(crank, work=crank.work * 1.05)
    slow = 0.04 * np.ptp(crank.energy.drives) * crank.t / crank.t[-1]
    work = crank.work + np.outer(slow, [1, 0, 0])
    assert "drift of energy / energy" in failures(crank, work=work)
    v[-1, 2] += 1e-4
    assert "change of linear momentum" in failures(free, v=v)
    free_q[10, 3:7] *= 1 + 1e-9
    assert failures(free, q=free_q) == ["quaternion length - 1"]
    toil = crank.statistics | {"iterations": 9 * crank.statistics["steps"]}
    assert failures(crank, statistics=toil) == ["Newton corrections per step"]


def test_forces_inside_what_starts_at_rest_change_no_momentum():
    """Nothing but round-off: a share of itself would be one."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    ball = {"mass": 1.0, "inertia": (1, 2, 3), "at": (0, 0, 0)}
    hub, wheel = (mech.add_rigid(name, **ball) for name in ("hub", "wheel"))
    axle = (part.marker((0.3, 0.1, 0.2)) for part in (hub, wheel))
    mech.revolute("axle", *axle, axis=(1, 2, 2))
    mech.motor("motor", "axle", lambda t, angle, rate: 3.0)
    sol = rom.simulate(mech, t_end=0.2, dt=1e-3)
    assert sol.energy.kinetic[-1] > 0.01
    assert rom.audit(sol).ok, rom.audit(sol)


def test_deformations_beyond_linear_elasticity_are_seen():
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_flexible("bar", lattice_body(lattice(stiffness=100.0)), omega=(0.0, 0.0, 25.0))
    sol = rom.simulate(mech, t_end=0.5, dt=1e-3)
    assert "largest deformation of bar / size" in failures(sol)


def weight_on_a_spring(**steps):
    """4 Hz, 0.1 m."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_rigid("ball", mass=1.0, inertia=(1, 1, 1), at=(0.6, 0, 0))
    law = {"stiffness": (8 * np.pi) ** 2, "free_length": 0.5}
    mech.spring_damper("spring", "ground", "ball", **law)
    return rom.simulate(mech, t_end=1.0, **steps)


def test_a_run_tells_itself_what_the_audit_finds_wrong():
    """Steps of a fifth of a period take its energy; one sentence names the rows."""
    with pytest.warns(rom.RomWarning, match="its audit: energy balance / energy .*; drift") as told:
        sol = weight_on_a_spring(dt=0.05, rho_inf=0.5)
    assert len(told) == 1
    assert all(what in str(told[0].message) for what in failures(sol)) and failures(sol)
    with warnings.catch_warnings(action="error"):
        assert rom.audit(weight_on_a_spring(dt=0.002)).ok


def test_an_element_from_outside_says_itself_what_it_cannot_bear():
    """No list of elements in the core: the family answers for its own."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_rigid("ball", mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0), omega=(0, 0, 7.0))
    mech.bushing("rubber", "ground", "ball", stiffness=(1e3, 1e3, 1e3, 0, 0, 1e-3))
    mine = replace(bushings.BUSHINGS_FAMILY, hooks=family.Hooks(beyond=lambda name, _e, t, axes: (
        f"{name} after {t[-1]:g} s at {axes('ball')[-1, 0, 0]:.3f}")))  # fmt: skip
    mech.elements["rubber"] = mine, mech.elements["rubber"][1]
    with pytest.warns(rom.RomWarning, match=r"^rubber after 0\.01 s at 0\.998$"):
        rom.simulate(mech, t_end=0.01, dt=1e-3)


@pytest.mark.parametrize("gravity", [0.0, 9.81])
def test_what_rests_passes_whatever_its_round_off_is(gravity):
    """A rod that a drive holds level: all energies are round-off, their balance is another one."""
    mech = rom.Mechanism(gravity=(0, -gravity, 0))
    rod = mech.add_rigid("rod", mass=1.0, inertia=(1e-3, 0.1, 0.1), at=(0.51, 0, 0))
    mech.revolute("pin", mech.ground.marker((0.01, 0, 0)), rod.marker((-0.5, 0, 0)), axis=(0, 0, 1))
    mech.drive("turn", "pin", lambda t: 0.3 + 0.0 * t)
    sol = rom.simulate(mech, t_end=1e-3, dt=1e-4, assemble=True)
    assert sol.energy.kinetic.max() < 1e-20
    assert rom.audit(sol).ok, rom.audit(sol)
