"""The machine whose steps are measured carries its load through both stages."""

from functools import cache

import pytest

import rom
from benchmarks import two_stages

pytestmark = [pytest.mark.fenicsx, pytest.mark.long]


@pytest.fixture(scope="module")
def bodies():
    """Of coarse meshes, once for each kind of rims."""
    with pytest.MonkeyPatch.context() as coarse:
        for sizes in (two_stages.HOUSING_SIZES, *two_stages.SHAFT_SIZES.values()):
            coarse.setitem(sizes, "lc", 1.6 * sizes["lc"])
        yield cache(two_stages.bodies)


@pytest.mark.parametrize("tabulated", [False, True])
def test_two_stages_carry_the_torque_and_the_weight(tabulated, bodies):
    """Moments about the shafts are as the numbers of teeth, but for what the films take."""
    mech = two_stages.machine(bodies("rbe3"), (60, 4), tabulated=tabulated)
    still = rom.mbs.snapshot(mech, rom.equilibrium(mech))
    films = sum(still.journal_bearing(name).power[0] for name in mech.journal_bearings)
    output, ratio = two_stages.INPUT_TORQUE, 1.0
    for name, pair in zip(mech.gear_meshes, two_stages.WHEEL_PAIRS.values(), strict=True):
        force = rom.mbs.tooth_loads(still, name)[0].force.sum()
        ratio *= pair.teeth[0] / pair.teeth[1]
        moment = force * pair.rb[1] * ratio
        lost = films / two_stages.SHAFT_SPEED
        assert -1e-6 * output < moment - output < lost
    assert 10.0 < films < 2000.0
