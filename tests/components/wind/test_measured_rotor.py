"""Torque and thrust of a rotor that was measured in a wind tunnel, and profiles that turn."""

import numpy as np
from numpy.testing import assert_allclose

from cases.refusals import refuses
from rom.components.wind import Blading, profile, profiles, rotor_load
from rom.errors import ConfigError

# Hand and others, NREL/TP-500-29955 (2001), table A-1: radius [m], chord [m], twist [deg] against
# the place at three quarters; tips were pitched by 3 degrees. If that place was instead, thrust at
# 7 m/s is 12 % above what was measured
BLADE = np.array([
    [1.2575, 0.737, 20.040], [1.343, 0.728, 18.074], [1.51, 0.711, 14.292], [1.648, 0.697, 11.909],
    [1.952, 0.666, 7.979], [2.257, 0.636, 5.308], [2.562, 0.605, 3.425], [2.867, 0.574, 2.083],
    [3.172, 0.543, 1.150], [3.476, 0.512, 0.494], [3.781, 0.482, -0.015], [4.086, 0.451, -0.475],
    [4.391, 0.42, -0.920], [4.696, 0.389, -1.352], [5.0, 0.358, -1.775], [5.029, 0.3551, -1.815],
])  # fmt: skip
TIP_RADIUS, TIP_PITCH, AIR = BLADE[-1, 0], np.radians(3.0 - BLADE[-1, 2]), 1.24
# the same report, tables, as github.com/mttbrbr/single-actuator-line has them: angle of
# attack [deg], lift, drag of S809 at a Reynolds number of a million
S809 = np.array([
    [-14.1, -0.79, 0.079], [-12.1, -0.7, 0.055], [-10.2, -0.63, 0.075], [-8.2, -0.58, 0.027],
    [-6.2, -0.61, 0.019], [-4.1, -0.4, 0.013], [-2.1, -0.16, 0.009], [0.0, 0.07, 0.009],
    [2.1, 0.3, 0.009], [4.1, 0.55, 0.009], [6.1, 0.79, 0.009], [8.2, 0.9, 0.017],
    [10.1, 0.94, 0.049], [11.2, 0.93, 0.052], [12.2, 0.97, 0.064], [13.3, 1.0, 0.07],
    [14.2, 1.02, 0.083], [15.2, 1.03, 0.108], [16.2, 1.01, 0.143], [17.2, 0.95, 0.17],
    [18.1, 0.9, 0.185], [19.2, 0.78, 0.347], [20.0, 0.67, 0.321], [22.1, 0.7, 0.37],
    [24.0, 0.77, 0.435], [26.1, 0.91, 0.536],
])  # fmt: skip
# Unsteady Aerodynamics Experiment, phase VI, sequence H without yaw, means of data that have the
# doi 10.21947/WDH-DAP/1910052: wind [m/s], speed [1/min], torque of the shaft [N m], thrust by the
# pressure on its blades [N]
MEASURED = np.array([
    [7, 71.878, 789.86, 1132.07], [10, 72.107, 1291.59, 1631.82], [13, 72.091, 1297.22, 1986.93],
    [15, 72.062, 1269.73, 2247.89], [20, 72.084, 1240.72, 3152.37], [25, 72.208, 1580.41, 4028.63],
])  # fmt: skip


def over_measured(rotating, n=24):
    """(6, 2) torque and thrust over what was measured, less one."""
    edges = np.linspace(BLADE[0, 0], TIP_RADIUS, n + 1)
    r = (edges[1:] + edges[:-1]) / 2
    chord, twist = (np.interp(r, BLADE[:, 0], x) for x in BLADE.T[1:])
    flat = profile("S809", np.radians(S809[:, 0]), S809[:, 1], S809[:, 2])
    used = [flat.rotating(c / x) if rotating else flat for c, x in zip(chord, r, strict=True)]
    strips = r, np.diff(edges), chord, np.radians(twist), tuple(used)
    blades, found = Blading(*strips, TIP_RADIUS, 0.508, 2, 0.0, 0.0, AIR), []
    for V, speed in MEASURED[:, :2]:
        load = rotor_load(blades, V, speed * np.pi / 30, TIP_PITCH, n_azimuths=1)
        found.append([load.torque, load.thrust])
    return np.array(found) / MEASURED[:, 2:] - 1


def test_a_measured_rotor_turns_as_predicted_until_it_stalls_and_then_with_profiles_that_turn():
    """Nothing is adjusted: attached at 7 m/s, on the verge at 10; in stall torque is missing."""
    off = over_measured(rotating=False)
    assert_allclose(off[:2], [[-0.018, 0.012], [-0.059, -0.078]], atol=0.005)
    stalled = [[-0.27, -0.16], [-0.56, -0.20], [-0.77, -0.22], [-0.64, -0.18]]
    assert_allclose(off[2:], stalled, atol=0.01)
    off = over_measured(rotating=True)  # with Snel's factor as published
    assert_allclose(off[:, 0], [-0.014, 0.10, 0.09, -0.01, 0.20, 0.20], atol=0.02)
    assert np.abs(off[:, 1]).max() < 0.075


def test_a_profile_that_turns_has_a_share_of_what_lacks_to_potential_flow():
    flat = profile("S809", np.radians(S809[:, 0]), S809[:, 1], S809[:, 2])
    wide, at = flat.rotating(0.3), np.radians([-5.0, 5.0, 20.0, 29.0, 40.0, 50.0, 90.0])
    lift, was = (np.interp(at, p.angle, p.lift) for p in (wide, flat))
    lacking = 2 * np.pi * (at - np.radians(-0.07 * 2.1 / 0.23)) - was
    assert lacking[1] < 0 < lacking[2:].min()
    share = 3 * 0.3**2 * np.array([0.0, 0, 1, 1, 0.5, 0, 0])
    assert_allclose(lift, was + share * lacking, atol=2e-3)
    assert_allclose(np.interp(at, wide.angle, wide.drag), np.interp(at, flat.angle, flat.drag))
    assert_allclose(flat.rotating(9.0).lift[wide.angle == at[2]], 2 * np.pi * at[2], rtol=0.05)
    round_root = next(iter(profiles().values()))
    assert round_root.rotating(0.5) is round_root
    assert_allclose(flat.rotating(0.0).lift, np.interp(wide.angle, flat.angle, flat.lift))
    refuses(ConfigError, r"chord_over_radius = -0\.1", lambda: profiles()["NACA64"].rotating(-0.1))
