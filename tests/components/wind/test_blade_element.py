"""Wind on a rotor: a strip against angles and the rotor against the sum of its strips."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.mbs.mechanisms import residual_at, tangents_at
from rom import rotation
from rom.components import cosserat
from rom.components.wind.blade_element import (
    CHORD,
    DRAG_COEFFICIENT,
    LIFT_SLOPE,
    RADIUS,
    ZERO_LIFT,
    in_wind,
    strips,
)
from rom.components.wind.whole_turbine import N_BLADES, turbine
from rom.components.wind.wind_turbine import RATED_SPEED, blade
from rom.errors import ConfigError
from rom.mbs.equations.equations import retract
from rom.mbs.equations.packing import pack
from rom.mbs.kernels.work import workspace

WIND = 11.4


def a_blade(n=6, **options):
    return in_wind(cosserat.body(blade(n)), (WIND, 0.0, 0.0), **options)


def test_strips_cover_the_blade():
    area, lifting = strips(a_blade(96))
    span = np.gradient(RADIUS)
    assert_allclose(area.sum(), np.sum(span * CHORD), rtol=0.02)
    assert 12 < (~lifting).sum() < 14  # ten metres of circles


def forces(packed, W, v):
    residual_at(packed.system, W, packed.q, v, np.zeros_like(v), np.zeros(3))
    return W.residual.copy()


@pytest.fixture
def resting():
    """A blade in its shape without stress: what is left are forces of the wind."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_nonlinear("blade", a_blade())
    packed = pack(mech, whole=True)
    return packed, workspace(packed.system, 0)


def test_a_strip_has_lift_across_and_drag_along_the_wind(resting):
    """Angle of attack, coefficients and directions by trigonometry, on a section that moves."""
    packed, W = resting
    v = np.zeros(packed.v.size)
    b = 5
    t = packed.system.bodies.v_at[b]
    v[t : t + 3] = (0.5, -55.0, 2.0)
    found = -forces(packed, W, v)[t : t + 3]
    R = rotation.matrix(packed.q[7 * b + 3 : 7 * b + 7])
    u = (R.T @ (np.array([2 / 3 * WIND, 0, 0]) - v[t : t + 3]))[:2]
    angle = np.arctan2(u[0], u[1])
    area = strips(a_blade())[0][b]
    q = 0.5 * 1.225 * area * (u @ u)
    lift = q * LIFT_SLOPE * np.sin(angle - ZERO_LIFT) * np.array([np.cos(angle), -np.sin(angle)])
    drag = q * DRAG_COEFFICIENT * u / np.linalg.norm(u)
    assert_allclose(found, R @ np.append(lift + drag, 0.0), rtol=1e-12)
    assert found[0] > 0  # thrust
    assert found[1] < 0  # which drives the rotor: blades move against the second axis
    assert_allclose(W.power[2], -found @ v[t : t + 3], rtol=1e-10)


def test_tangents_of_the_wind_are_derivatives(resting):
    packed, W = resting
    rng = np.random.default_rng(9)
    n = packed.v.size
    q = packed.q.copy()
    retract(packed.system, packed.q, 0.2 * rng.normal(size=n), q)
    v, a, lam = 20 * rng.normal(size=n), np.zeros(n), np.zeros(3)

    def difference(d, turn):
        out = []
        for sign in (1, -1):
            there, speed = q.copy(), v + (0 if turn else sign * 1e-5) * d
            if turn:
                retract(packed.system, q, sign * 1e-6 * d, there)
            residual_at(packed.system, W, there, speed, a, lam)
            out.append(W.residual.copy())
        return (out[0] - out[1]) / (2e-6 if turn else 2e-5)

    tangents_at(packed.system, W, q, v, a, lam, (0.0, 1.0, 1.0))
    C, K = W.S.copy(), W.Kt.copy()
    for _ in range(3):
        d = rng.normal(size=n)
        assert_allclose(C @ d, difference(d, False), atol=1e-6 * np.abs(C @ d).max())
        d[:] = 0.0
        d.reshape(-1, 6)[:, 3:] = rng.normal(size=(n // 6, 3))
        assert_allclose(K @ d, difference(d, True), atol=2e-6 * np.abs(K @ d).max())


def stiff_blade(n):
    """One blade of three hundred times its rigidity on a driven hub."""
    one, mech = blade(n, damped=True), rom.Mechanism(gravity=(0, 0, 0))
    one = one._replace(stretch=300 * one.stretch, bend=300 * one.bend)
    part = mech.add_nonlinear("blade", in_wind(cosserat.body(one), (WIND, 0.0, 0.0)),
                              omega=(RATED_SPEED, 0.0, 0.0))  # fmt: skip
    hub = mech.add_rigid(
        "hub", mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0), omega=(RATED_SPEED, 0, 0)
    )
    mech.revolute("shaft", mech.ground.marker((0, 0, 0)), hub.marker((0, 0, 0)), axis=(1, 0, 0))
    mech.drive("speed", "shaft", lambda t: RATED_SPEED * t, rate=lambda t: RATED_SPEED)
    root = mech.design_point(part.marker("start"))
    mech.fixed("root", hub.marker(root), part.marker("start"))
    return mech


def test_a_stiff_rotor_takes_the_power_of_its_strips():
    """Torque and thrust of the strips by angles; below the limit of Betz."""
    n = 24
    sol = rom.simulate(stiff_blade(n), t_end=3.0, dt=0.02, rho_inf=0.3)
    late = sol.t > 2.0
    torque = -sol.drive_load("speed")[late].mean()
    area, lifting = strips(a_blade(n))
    r, rod = 1.5 + 61.5 * np.linspace(0, 1, n + 1), blade(n)
    axes = [rotation.matrix(p)[:, 1] for p in rod.p[:-1]]  # towards the trailing edge
    twist = np.array([np.arctan2(abs(y[0]), abs(y[1])) for y in axes])
    u = np.column_stack([np.full(n + 1, 2 / 3 * WIND), RATED_SPEED * r])
    flow = np.arctan2(u[:, 0], u[:, 1])
    q = 0.5 * 1.225 * area * (u**2).sum(axis=1)
    lift = np.where(lifting, LIFT_SLOPE * np.sin(flow - twist - ZERO_LIFT), 0.0)
    drag = np.where(lifting, DRAG_COEFFICIENT, 0.5)
    assert_allclose(torque, (q * r) @ (lift * np.sin(flow) - drag * np.cos(flow)), rtol=5e-3)
    thrust = sol.reaction("shaft")[late][:, 0].mean()
    assert_allclose(abs(thrust), q @ (lift * np.cos(flow) + drag * np.sin(flow)), rtol=5e-3)
    share = N_BLADES * torque * RATED_SPEED / (0.5 * 1.225 * np.pi * 63**2 * WIND**3)
    assert 0.38 < share < 16 / 27


@pytest.mark.long
@pytest.mark.once
def test_the_wind_bends_the_blades_of_the_turbine_downwind():
    """Metres, as in published runs at 11.4 m/s, where the tip goes 5 to 6 m."""
    whole = turbine(16, tower_segments=8, wind=WIND, speed=RATED_SPEED)
    whole.turn_by(lambda t: RATED_SPEED * t, lambda t: RATED_SPEED)
    sol = rom.simulate(whole.mechanism, t_end=20.0, dt=0.02, rho_inf=0.6, save_every=5)
    late = sol.t > 15.0
    assert 3.0 < whole.tip(sol, 0)[late, 0].mean() < 8.0
    assert rom.audit(sol).ok


def test_wind_that_cannot_blow_is_named():
    with pytest.raises(ConfigError, match="no velocity of three"):
        in_wind(cosserat.body(blade(4)), 11.4)
    with pytest.raises(ConfigError, match="induction 1 in air"):
        a_blade(induction=1.0)
    with pytest.raises(ConfigError, match="in air of 0 kg"):
        a_blade(density=0.0)
