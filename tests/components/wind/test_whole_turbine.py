"""The NREL 5 MW turbine as one mechanism, against its definition and other programs."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from rom.components.wind.whole_turbine import (
    GEAR_RATIO,
    GENERATOR_INERTIA,
    HUB_INERTIA,
    N_BLADES,
    WHEEL_INERTIA,
    turbine,
)
from rom.components.wind.wind_turbine import RATED_SPEED, blade, ramp, run_up
from rom.errors import ConfigError

SPEED, ANGLE = ramp(RATED_SPEED, 20.0)


def test_masses_are_those_of_the_definition():
    """Rotor 110 000, nacelle 240 000, tower 347 460 kg; blades as their stations give them."""
    whole = turbine(48)
    mass = {name: part.mass for name, part in whole.mechanism.parts.items()}
    blades = sum(x for name, x in mass.items() if name.startswith("blade"))
    assert_allclose(blades + mass["hub"], 110_000, rtol=5e-3)
    assert_allclose(mass["nacelle"] + mass["wheel"] + mass["generator"], 240_000)
    assert_allclose(sum(x for name, x in mass.items() if name.startswith("tower")), 347_460,
                    rtol=3e-3)  # fmt: skip
    # hub height 90 m and overhang 5 m, both at the shaft of five degrees
    assert_allclose(whole.hub[2], 90.0, atol=2e-3)
    assert_allclose(whole.axis, [np.cos(np.radians(5)), 0, -np.sin(np.radians(5))])


def test_geometry_and_yaw_are_those_of_the_definition():
    """Blades lean upwind by 2.5 degrees; the nacelle has 2 607 890 kg m^2 about the tower."""
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
    assert_allclose(fast["blade 2.3"].velocity, RATED_SPEED * np.cross(
        whole.axis, fast["blade 2.3"].at - whole.hub), atol=1e-12)  # fmt: skip


@pytest.mark.long
@pytest.mark.once
def test_driven_rotor_on_a_stiff_tower_runs_up_like_its_blades_alone():
    """Largest lag 0.25181 m at 10.07 s, flapping -0.0492 m, stretch 14.02 mm at speed."""
    whole = turbine(48, tower_segments=0, gravity=0.0, tilt=0.0, cone=0.0, damped=False,
                    shaft=(1e14, 1e11))  # fmt: skip
    whole.turn_by(ANGLE, SPEED)
    sol = rom.simulate(whole.mechanism, t_end=22.0, dt=0.02, rho_inf=0.9)
    tips = [whole.tip(sol, k) for k in range(N_BLADES)]
    alone = run_up(blade(48), t_end=22.0, dt=0.02)
    for tip in tips:
        assert_allclose(tip, alone.tip, atol=1e-6)
    assert_allclose([tips[0][:, 1].max(), tips[0][:, 0].min()], [0.25181, -0.0492], rtol=1e-3)
    assert_allclose(sol.t[tips[0][:, 1].argmax()], 10.07, atol=0.15)
    assert_allclose(1e3 * tips[0][sol.t > 21.0, 2].mean(), 14.02, rtol=5e-3)
    assert rom.audit(sol).ok


@pytest.mark.long
@pytest.mark.once
def test_frequencies_of_the_turbine_at_rest():
    """FAST and ADAMS with modes and coarse elements say tower 0.31 to 0.32, flap 0.70 Hz.

    Blades of many segments are 3 % softer in flap than theirs.
    """
    whole = turbine(24, damped=False)
    whole.turn_by(lambda t: 0.0, lambda t: 0.0)
    f = rom.linearize(whole.mechanism, rom.equilibrium(whole.mechanism)).frequencies
    f = f[f > 1e-3]
    assert_allclose(f[:2], [0.3164, 0.3195], rtol=0.03)
    assert_allclose(f[5], 0.7019, rtol=0.03)  # all blades flap together
    assert_allclose(f[3], 0.6288, rtol=0.02)  # they flap about the tower
    light = turbine(24, damped=False, gravity=0.0)
    light.turn_by(lambda t: 0.0, lambda t: 0.0)
    g = rom.linearize(light.mechanism, rom.equilibrium(light.mechanism)).frequencies
    # weight softens the tower as it does under a point mass: 0.33071 against 0.33645 Hz
    assert_allclose(f[:2] / g[g > 1e-3][:2], 0.33071 / 0.33645, rtol=3e-3)


@pytest.fixture(scope="module")
def driven():
    """Two meganewton metres, from rest, without weight."""
    whole = turbine(16, tower_segments=0, gravity=0.0, tilt=0.0, cone=0.0)
    whole.turn_with(lambda t, x, v: 2e6 * min(t / 2.0, 1.0))
    return whole, rom.simulate(whole.mechanism, t_end=12.0, dt=0.01, rho_inf=0.9)


@pytest.mark.long
def test_momentum_is_the_impulse_of_the_torque(driven):
    """About the shaft; the generator stores its own times the ratio of the gear."""
    _, sol = driven
    one = blade(16)
    blades = N_BLADES * (one.mass @ one.x[:, 2] ** 2 + one.inertia[:, :2].sum() / 2)
    still = HUB_INERTIA + WHEEL_INERTIA + GEAR_RATIO**2 * GENERATOR_INERTIA
    speed = sol.omega("wheel")[:, 0]
    assert_allclose(sol.omega("generator")[:, 0], GEAR_RATIO * speed, rtol=1e-7, atol=1e-7)
    late = sol.t > 6.0
    slope = np.polyfit(sol.t[late], speed[late], 1)[0]
    assert_allclose(slope, 2e6 / (blades + still), rtol=5e-3)


def test_work_of_the_torque_is_the_energy(driven):
    _, sol = driven
    assert sol.energy.drives[-1] > 1e6
    assert np.abs(sol.energy.balance).max() < 1e-3 * sol.energy.kinetic.max()
    assert rom.audit(sol).ok


def test_a_turbine_without_blades_is_refused():
    with pytest.raises(ConfigError, match="0 segments of a blade"):
        turbine(0)
