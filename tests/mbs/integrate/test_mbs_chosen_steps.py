"""Chosen steps follow what moves places, not vibrations far above it, and meet their tolerance."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.beam import stiffened_beam
from cases.long import few
from cases.mbs.mechanisms import simeon_crank, simulate_quietly
from cases.mbs.motions import flexible_four_bar, four_links, heavy_top, hub_and_panel, pendulum
from cases.mbs.parts import ORIGIN, X, Z, on_guide
from rom.components import cosserat

STEEL_BAR = {"EI": 2800.0, "rhoA": 3.1, "n_modes": 5, "stiffened": False}  # 20 mm square
INSTANTS = 40


def four_bar():
    """Driven at 6 rad/s; its bars bend by less than a thousandth, at 50 Hz and far more."""
    coupler, rocker = stiffened_beam(1.0, **STEEL_BAR), stiffened_beam(0.8, **STEEL_BAR)
    return flexible_four_bar(coupler, rocker, -2.0, lambda t: 6 * t)


def arm():
    """Two elastic links, the first driven; at every tolerance its steps once became too small."""
    mech = rom.Mechanism(gravity=(0, -9.81, 0))
    link = stiffened_beam(1.0, EI=500.0, rhoA=1.0, n_modes=4, stiffened=False)
    one, two = mech.add_flexible("one", link), mech.add_flexible("two", link, at=X)
    mech.revolute("shoulder", mech.ground.marker(ORIGIN), one.marker("root"), axis=Z)
    mech.revolute("elbow", one.marker("tip"), two.marker("root"), axis=Z)
    mech.drive("motor", "shoulder", lambda t: 0.5 * np.sin(4 * t))
    mech.rotational_spring("coil", "elbow", stiffness=30.0, damping=0.5)
    return mech


def rod(n):
    """A steel rod of 1 m and 10 mm on a hinge, let go as it lies; inertias of plates are small."""
    along = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    section = {"stretch": (5e6, 5e6, 1.6e7), "bend": (98.0, 98.0, 75.0), "mass": 0.61}
    one = cosserat.straight(1.0, n, frame=along, inertia=(3.8e-6, 3.8e-6, 7.7e-6), **section)
    one = one._replace(inertia=cosserat.body(one).frames.inertia)
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    part = mech.add_nonlinear("rod", cosserat.body(one))
    mech.revolute("hinge", mech.ground.marker(ORIGIN), part.marker("start"), axis=(0, 1, 0))
    return mech


# builder, duration, fixed steps by which its reference is computed
MECHANISMS = {
    "arm": (arm, 1.0, 40_000),
    "rod of 10": (lambda: rod(10), 0.5, 20_000),
    "pendulum": (pendulum, 2.0, 40_000),
    "chain": (four_links, 1.5, 80_000),
    "top": (heavy_top, 0.5, 80_000),
    "crank": (simeon_crank, 0.1, 40_000),
    "four-bar": (four_bar, 1.0, 80_000),
    "hub and panel": (hub_and_panel, 2.0, 160_000),
    "rod of 40": (lambda: rod(40), 0.5, 10_000),
    "rod of 100": (lambda: rod(100), 0.5, 5_000),
}


def seen(mech, t_end, n=None, **options):
    """Places and turns of all markers at instants of a run, by n fixed steps if given."""
    if n:
        options |= {"dt": t_end / n, "save_every": n // INSTANTS}
    sol = simulate_quietly(mech, t_end=t_end, tolerance=1e-9, **options)
    sol = sol if n else sol.at(np.linspace(0, t_end, INSTANTS + 1))
    ends = [(name, m) for name, part in sol.mechanism.parts.items() for m in part.names or ()]
    found = [(sol.position(*end)[:, None], sol.axes(*end)) for end in ends]
    return np.array([np.concatenate(x, axis=1) for x in found] or sol.q), sol.statistics["steps"]


@pytest.mark.parametrize("name", few(2, MECHANISMS))
def test_chosen_steps_meet_their_tolerance_and_are_few(name):
    """A third of them, all of one length, are less accurate."""
    build, t_end, n = MECHANISMS[name]
    exact, _ = seen(build(), t_end, n)
    found, steps = seen(build(), t_end, rtol=1e-4)
    off = np.abs(found - exact).max()
    assert off < 2e-4  # in metres and rad, where the tolerance weighs by mass
    fixed, _ = seen(build(), t_end, steps // (3 * INSTANTS) * INSTANTS)
    assert np.abs(fixed - exact).max() > off


def test_finer_rods_take_no_more_steps():
    counts = [seen(rod(n), 0.5, rtol=1e-3)[1] for n in (10, 40)]
    assert counts[1] < 1.5 * counts[0]


def test_a_step_does_not_leap_to_another_equilibrium():
    """A spring whose mass has come to rest has one on its other side, too."""
    mech, end = rom.Mechanism(gravity=(0, 0, 0)), 1e5
    law = {"stiffness": 1e8, "damping": 1.8e4, "free_length": 1.0}
    mech.spring_damper("spring", mech.ground.marker(ORIGIN), on_guide(mech, at=1.2 * X), **law)
    sol = rom.simulate(mech, t_end=end, rtol=0.5)
    assert_allclose(sol.position("mass")[-1], X, atol=1e-3)
