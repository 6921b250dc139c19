"""The NREL 5 MW turbine as one mechanism, against its definition and other programs."""

from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.refusals import refuses
from rom.components.wind import whole_turbine, wind_turbine
from rom.components.wind.whole_turbine import GEAR_RATIO, WHEEL_INERTIA, turbine
from rom.components.wind.wind_turbine import RATED_SPEED, blade
from rom.errors import ConfigError

SPEED, ANGLE = wind_turbine.ramp(RATED_SPEED, 20.0)
on_a_stiff_tower = partial(turbine, tower_segments=0, gravity=0.0, tilt=0.0, cone=0.0)


def test_masses_geometry_and_yaw_are_those_of_the_definition():
    """Rotor 110 000, nacelle 240 000, tower 347 460 kg; blades as their stations give them."""
    whole = turbine(48)
    mass = {name: part.mass for name, part in whole.mechanism.parts.items()}
    blades = sum(x for name, x in mass.items() if name.startswith("blade"))
    assert_allclose(blades + mass["hub"], 110_000, rtol=5e-3)
    assert_allclose(mass["nacelle"] + mass["wheel"] + mass["generator"], 240_000)
    tower = sum(x for name, x in mass.items() if name.startswith("tower"))
    assert_allclose(tower, 347_460, rtol=3e-3)
    # hub height 90 m and overhang 5 m, both at the shaft of five degrees
    assert_allclose(whole.hub[2], 90.0, atol=2e-3)
    assert_allclose(whole.axis, [np.cos(np.radians(5)), 0, -np.sin(np.radians(5))])
    whole = turbine(4)
    for blade_ in whole.blades:
        arm = whole.mechanism.design_point(blade_.marker("end")) - whole.hub
        assert_allclose(arm @ whole.axis / np.linalg.norm(arm), -np.sin(np.radians(2.5)))
    parts = whole.mechanism.parts
    nacelle = parts["nacelle"]
    own = nacelle.second[0, 0] + nacelle.second[1, 1]  # about the third axis
    extra = 2000.0 * 1.9**2  # of wheel and generator, which are drawn elsewhere on the shaft
    assert_allclose(own + nacelle.mass * nacelle.at[0] ** 2 + extra, 2_607_890, rtol=1e-9)
    fast = turbine(4, speed=RATED_SPEED).mechanism.parts
    assert_allclose(fast["generator"].omega, GEAR_RATIO * RATED_SPEED * whole.axis)
    around = RATED_SPEED * np.cross(whole.axis, fast["blade 2.3"].at - whole.hub)
    assert_allclose(fast["blade 2.3"].velocity, around, atol=1e-12)


@pytest.mark.long
def test_driven_rotor_on_a_stiff_tower_runs_up_like_its_blades_alone():
    """Largest lag 0.25181 m at 10.07 s, flapping -0.0492 m, stretch 14.02 mm at speed."""
    whole = on_a_stiff_tower(48, damped=False, shaft=(1e14, 1e11))
    whole.turn_by(ANGLE, SPEED)
    sol = rom.simulate(whole.mechanism, t_end=22.0, dt=0.02, rho_inf=0.9)
    tips = [whole.tip(sol, k) for k in range(whole_turbine.N_BLADES)]
    alone = wind_turbine.run_up(blade(48), t_end=22.0, dt=0.02)
    assert_allclose(tips, 3 * [alone.tip], atol=1e-6)
    assert_allclose([tips[0][:, 1].max(), tips[0][:, 0].min()], [0.25181, -0.0492], rtol=1e-3)
    assert_allclose(sol.t[tips[0][:, 1].argmax()], 10.07, atol=0.15)
    assert_allclose(1e3 * tips[0][sol.t > 21.0, 2].mean(), 14.02, rtol=5e-3)
    assert rom.audit(sol).ok


def at_rest(**choices):
    """Frequencies of the published modes, gear locked [Hz]."""
    whole = turbine(48, tower_segments=32, damped=False, **choices)
    whole.turn_by(lambda t: 0.0, lambda t: 0.0)
    small = rom.linearize(whole.mechanism, rom.equilibrium(whole.mechanism), n=14)
    return small.frequencies[list(whole_turbine.PLACES)]


# what is left to two programs [%], whose beams have no shear; FAST has two given shapes for each
# and no twist, so that what yaws with the tower is 4 to 15 % stiffer
ADAMS_LEFT = (0.2, -0.1, 0.4, 1.3, 0.0, 0.2, 0.4, 0.4, 3.3, 0.1, 0.2, -1.0, 2.6)
FAST_LEFT = (-0.2, -3.3, -1.2, 0.1, 1.7, 0.3, 0.4, 0.5, -4.1, 1.1, -2.7, -2.7, 3.2)


KNOWN = [(1, {"gravity": 0.0}, ADAMS_LEFT), (0, {"torsion": 1e3}, FAST_LEFT)]


@pytest.mark.parametrize(("program", "choices", "left"), KNOWN)
def test_frequencies_at_rest_are_those_of_programs_that_know_as_much(program, choices, left):
    published = np.array(list(whole_turbine.PUBLISHED_FREQUENCIES.values()))[:, program]
    deviation = 100 * (at_rest(shear=1e3, **choices) / published - 1)
    assert_allclose(deviation, left, atol=0.06)
    assert np.median(np.abs(deviation)) < 1.3


def test_shear_weight_and_twist_explain_the_rest():
    """Weight softens a tower like that of a point mass; twist of the tower what yaws with it."""
    names, f = list(whole_turbine.PUBLISHED_FREQUENCIES), at_rest()
    light, stiff = at_rest(gravity=0.0), at_rest(torsion=1e3)
    assert_allclose(f[:2] / light[:2], 0.33071 / 0.33645, rtol=3e-3)
    yawing = [names.index(f"{n}flap, yawing") for n in ("blades ", "second ")]
    assert_allclose(stiff[yawing] / f[yawing], [1.040, 1.079], atol=0.005)
    still = [k for k in range(3) if k not in yawing]
    assert_allclose(stiff[still] / f[still], 1.0, atol=5e-3)
    edge = [k for k, name in enumerate(names) if "edgewise" in name]
    assert_allclose(at_rest(shear=1e3)[edge] / f[edge], 1.027, atol=3e-3)


def test_blades_whirl_on_a_stiff_tower_as_one_of_them_swings():
    """Backward and forward a turn less and more than a blade alone: 0.7229 and 1.0655 Hz."""
    whole = on_a_stiff_tower(48, damped=False, shaft=(1e14, 0.0))
    state = whole.turning(RATED_SPEED)
    small = rom.linearize(whole.mechanism, state, n=6, frame="world", blades=whole.blades)
    f, turn = small.frequencies, RATED_SPEED / (2 * np.pi)
    flap, edge = f[[0, 1, 3]], f[[2, 4, 5]]
    assert_allclose(flap - flap[1], [-turn, 0.0, turn], atol=1e-6)
    assert_allclose(edge - edge[1], [-turn, 0.0, turn], atol=2e-5)  # the shaft twists a little
    assert_allclose([flap[1], edge[1]], [0.7229, 1.0655], rtol=4e-3)  # of 96 segments
    refuses(ConfigError, "no steady motion", turbine(4).turning, RATED_SPEED)  # with its weight


def test_torque_gives_momentum_and_energy():
    """From rest, without weight, about the shaft; the generator has its own times the gear."""
    whole = on_a_stiff_tower(16)
    whole.turn_with(lambda t, x, v: 2e6 * min(t / 2.0, 1.0))
    sol = rom.simulate(whole.mechanism, t_end=12.0, dt=0.01, rho_inf=0.9)
    one = blade(16)
    blades = whole_turbine.N_BLADES * (one.mass @ one.x[:, 2] ** 2 + one.inertia[:, :2].sum() / 2)
    fast = GEAR_RATIO**2 * wind_turbine.GENERATOR_INERTIA
    still = wind_turbine.HUB_INERTIA + WHEEL_INERTIA + fast
    speed = sol.omega("wheel")[:, 0]
    assert_allclose(sol.omega("generator")[:, 0], GEAR_RATIO * speed, rtol=1e-7, atol=1e-7)
    late = sol.t > 6.0
    slope = np.polyfit(sol.t[late], speed[late], 1)[0]
    assert_allclose(slope, 2e6 / (blades + still), rtol=5e-3)
    assert sol.energy.drives[-1] > 1e6
    assert np.abs(sol.energy.balance).max() < 1e-3 * sol.energy.kinetic.max()
    assert rom.audit(sol).ok
