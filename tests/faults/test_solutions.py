"""What fails on its way leaves what it reached, under one name."""

from dataclasses import replace

import numpy as np
import pytest

import rom
from cases.files.border_calls import FENICSX
from cases.gear_unit import unit
from cases.sheets import rectangle
from rom.components import transmission
from rom.components.assumed_strain import Metal, equilibrium, fly, sheet
from rom.components.masonry import motion as masonry_motion
from rom.components.masonry import stones
from rom.mbs.results.state import State

SOLID = {"mass": 1.0, "inertia": (1, 1, 1), "at": (0, 0, 0), "markers": {"c": (0, 0, 0)}}


def pushed(_):
    """A slider that a force pushes away."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    block = mech.add_rigid("block", **SOLID)
    mech.prismatic("rail", mech.ground.marker((0, 0, 0)), block.marker("c"), axis=(1, 0, 0))
    mech.force("push", block.marker("c"), lambda t: (1.0, 0, 0))
    return rom.equilibrium(mech)


def torn(monkeypatch):
    """A driven bar whose force of Python fails half-way."""
    mech = rom.Mechanism()
    bar = mech.add_rigid("bar", **SOLID)
    mech.revolute("pin", mech.ground.marker((0, 0, 0)), bar.marker("c"), axis=(0, 0, 1))
    mech.drive("turn", "pin", lambda t: 0.1 * t)

    def law(t, _):
        if t > 0.45:
            raise ValueError("torn")
        return (0, 0, 0), (0, 0, 0)

    mech.user_force("rope", law, bar.marker("c"))
    return rom.inverse_dynamics(mech, np.linspace(0.0, 1.0, 11))


def small_sheet():
    return sheet(*rectangle((2, 2), [(0, 0), (1, 0), (1, 1), (0, 1)]), state="plane strain")


def crushed(_):
    body, load = small_sheet(), np.zeros((9, 2))
    load[-3:, 1] = -1e4
    return equilibrium(body, Metal(1.0, 0.3), load, range(6), steps=1000)


def flown(_):
    body = small_sheet()
    v = np.zeros_like(body.points)
    v[-3:, 1] = -1e60
    return fly(body, Metal(1.0, 0.3, 1.0), v, range(6), 0.1)


def stone(monkeypatch):
    """Stones whose contacts do not settle in the third picture."""
    calls, advance = [], masonry_motion.advance

    def failing(*arguments):
        calls.append(1)
        return advance(*arguments) if len(calls) < 3 else np.nan

    monkeypatch.setattr(masonry_motion, "advance", failing)
    one = stones.stone([[0, 0], [1, 0], [1, 1], [0, 1]], E=1e9, nu=0.2, rho=2e3)
    wall = stones.Masonry((one,), (), 1e10, 0.0, reach=10.0)
    return masonry_motion.simulate(wall, t_end=0.1, dt=0.01, save_every=2)


def gears_at_rest(_):
    return transmission.rest(replace(unit(torque=800.0), viscosity=2e-4))


def gears(monkeypatch):
    """A run whose third step fails."""
    from rom.components.transmission import motion

    def failing(*arguments):
        mech = whole(*arguments)
        mech.user_force("rope", law, mech.part("pinion").marker("node 2"))
        return mech

    def law(t, _):
        if t > 2.5 / 50 * state.unit.mesh_period:
            raise ValueError("torn")
        return (0, 0, 0), (0, 0, 0)

    state, whole = transmission.rest(unit()), motion.mechanism_of
    monkeypatch.setattr(motion, "mechanism_of", failing)
    return transmission.simulate(state, periods=1, steps=50)


def shaft(_):
    model = rom.fe.model(
        "meshes/beam.geo", material=rom.Material(E=70e9, nu=0.0, rho=2700.0),
        parameters={"L": 1.0, "b": 0.03, "h": 0.02, "hex": 1, "nx": 4, "ny": 1, "nz": 1},
    )  # fmt: skip
    held = rom.held_solid(model, fixed=("root",), axis=(1.0, 0.0, 0.0))
    limit = rom.cyclic_modes(held, 0, 1).omega[0]
    return rom.spin_up(held, model, speed=1.1 * limit, n_states=5)


NEEDS_FENICSX = [pytest.mark.fenicsx, pytest.mark.skipif(not FENICSX, reason="needs dolfinx"),
                 pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")]  # fmt: skip
CASES = [  # what fails, the numbers it leaves, how many instants or states at least
    (pushed, lambda found: found.q, 7),
    (torn, lambda found: found.q, 5),
    (crushed, lambda found: found.x[-1], 9),
    (flown, lambda found: found.x, 2),
    (stone, lambda found: found.q, 3),
    (gears_at_rest, lambda found: found.q, 2),
    (gears, lambda found: found.q, 3),
    pytest.param(shaft, lambda found: found.displacements.T, 3, marks=NEEDS_FENICSX),
]


@pytest.mark.parametrize(("fail", "numbers", "least"), CASES)
def test_what_was_reached_is_kept_with_the_error(fail, numbers, least, monkeypatch):
    with pytest.raises(rom.RomError) as caught:
        fail(monkeypatch)
    found = numbers(caught.value.solution)
    assert len(found) >= least and np.isfinite(found).all()


def test_it_has_the_form_of_what_the_function_gives(monkeypatch):
    for fail, kind in ((pushed, State), (torn, rom.mbs.Solution), (stone, masonry_motion.Motion)):
        with monkeypatch.context() as patch, pytest.raises(rom.RomError) as caught:
            fail(patch)
        assert isinstance(caught.value.solution, kind)
    motion = caught.value.solution
    assert motion.t.tolist() == [0.0, 0.02, 0.04]
    assert {len(rows) for rows in (motion.q, motion.v, motion.energy)} == {3}
