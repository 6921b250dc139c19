"""The hand as a mechanism: postures of the finger by itself, coils, friction, bad input."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from rom.components.hand.compliant_hand import LENGTHS, Finger, close, hand
from rom.components.hand.moving_hand import Build, Drive, Seat, moving_hand
from rom.components.hand.tip_loads import deflections, one_finger
from rom.errors import ConfigError, ModelError, SolverError

MM = 1e-3
INDEX = {  # tension [N]: angle of a joint [deg], x, z of the tip, pull [mm]; machines by shooting
    0.5: (7.0250, 12.872, 61.210, 2.783),
    2.0: (28.6334, 40.801, 36.008, 11.331),
    2.5: (35.6785, 44.192, 24.965, 14.129),
}


def tip_of(solution, name="finger"):
    return solution.position(f"{name} phalanx 3", "distal")[-1]


def cable_length(solution, name="finger"):
    """(n_t,) of the cable along its path."""
    stations = solution.mechanism.tendons[f"{name} cable"].stations
    x = [solution.position(one.marker.body, one.marker) for one in stations]
    return np.linalg.norm(np.diff(x, axis=0), axis=2).sum(axis=0)


def angle_of(solution, name, k):
    """Between the plates of a spring [rad]."""
    last = len(solution.mechanism.nonlinear[f"{name} spring {k}"].parts) - 1
    a, b = (solution.axes(f"{name} spring {k}", at)[-1] for at in (0, last))
    return np.arccos(0.5 * (np.trace(a.T @ b) - 1.0))


@pytest.mark.parametrize("tension", INDEX)
def test_a_finger_in_a_mechanism_has_the_postures_of_the_boundary_value_problem(tension):
    angle, x, z, pull = INDEX[tension]
    mech = one_finger(Finger(n=16), tension)
    found = rom.snapshot(mech, rom.equilibrium(mech))
    assert_allclose([np.degrees(angle_of(found, "finger", k)) for k in (1, 2, 3)], 3 * [angle],
                    rtol=3e-4)  # fmt: skip
    assert_allclose(tip_of(found) / MM, [x, 0, z], rtol=5e-4, atol=1e-9)
    straight = 64 * MM - 3e-2 + 1e-2 - 1e-2  # holes: from the palm to the third phalanx
    assert_allclose(cable_length(found)[-1], straight - (pull - 20.0 + 10.0 - 10.0 + 20.0) * MM,
                    atol=np.inf)  # fmt: skip
    assert_allclose(54 * MM - cable_length(found)[-1], pull * MM, rtol=5e-4)


@pytest.mark.parametrize(("stiffener", "load"), [(1.0, (0.03, 0.01, 0.0)), (12.0, (0.0, 0.1, 0.0))])
def test_a_finger_in_a_mechanism_gives_way_as_by_itself(stiffener, load):
    finger = Finger(n=4, stiffener=stiffener)
    alone = close(finger, tension=1.5, load=load)
    mech = one_finger(finger, 1.5, load)
    found = rom.snapshot(mech, rom.equilibrium(mech))
    assert_allclose(tip_of(found), alone.tip, atol=1e-6 * LENGTHS["index"])
    angles = [angle_of(found, "finger", k) for k in (1, 2, 3)]
    assert_allclose(angles, alone.angles, rtol=1e-6)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_loads_on_the_tip_and_deflections_in_three_directions(axis):
    forces, finger = [-0.05, 0.05], Finger(n=4, stiffener=10.0)
    start, e = close(finger, tension=1.0), np.eye(3)[axis]
    alone = [close(finger, tension=1.0, load=f * e, start=start).tip - start.tip for f in forces]
    assert_allclose(deflections(finger, e, forces, tension=1.0), alone, atol=1e-8)
    soft = deflections(Finger(n=4), e, forces, tension=1.0)
    gain = np.abs(soft[1, axis]) / np.abs(alone[1][axis])
    assert gain > 8.0 if axis == 1 else abs(gain - 1.0) < 1e-3


def test_coils_that_touch_stop_a_moving_finger_where_they_stop_it_at_rest():
    """Beyond 2.65 N, drawn in time until all is at rest."""
    finger = Finger(n=4)
    mech = one_finger(finger, lambda t: 4.0 * min(t / 0.2, 1.0))
    sol = rom.simulate(mech, t_end=0.8, dt=5e-4, rho_inf=0.5)
    alone = close(finger, tension=4.0)
    assert alone.bound.all()
    assert_allclose(tip_of(sol), alone.tip, atol=1e-5 * LENGTHS["index"])
    assert rom.audit(sol).ok, rom.audit(sol)


def test_a_winch_draws_in_what_the_finger_gives():
    finger = Finger(n=4)
    alone = close(finger, pull=8 * MM)
    mech = moving_hand({"index": finger}, seats={"index": Seat()},
                       drives={"index": Drive(pull=8 * MM, EA=1e5)})  # fmt: skip
    found = rom.snapshot(mech, rom.equilibrium(mech))
    tension = np.linalg.norm(found.element("index cable").force[-1, 0])
    stretch = tension / 1e5 * (54 - 8) * MM
    at = close(finger, pull=8 * MM - stretch)
    assert_allclose(tension, at.tension, rtol=1e-6)
    assert_allclose(tip_of(found, "index"), at.tip, atol=1e-6 * LENGTHS["index"])
    assert stretch < 1e-3 * MM + 1e-5 and at.tension < alone.tension


def test_a_seat_turns_a_finger_and_nothing_else():
    finger = Finger(n=4)
    seat = Seat((0.1, -0.2, 0.3), along=(1.0, 2.0, -1.0), palmar=(0.5, 1.0, 3.0))
    mech = moving_hand({"thumb": finger}, seats={"thumb": seat},
                       drives={"thumb": Drive(tension=1.0)})  # fmt: skip
    found = rom.snapshot(mech, rom.equilibrium(mech))
    alone = close(finger, tension=1.0).tip
    assert_allclose(seat.axes.T @ seat.axes, np.eye(3), atol=1e-14)
    assert_allclose(np.linalg.det(seat.axes), 1.0)
    assert_allclose(tip_of(found, "thumb"), seat.at + seat.axes @ alone, atol=1e-8)
    assert (seat.axes @ [1, 0, 0]) @ [0.5, 1.0, 3.0] > 0


def test_a_conduit_that_bends_takes_its_share_of_the_force():
    """Capstan: a quarter turn in eight bends before a straight finger."""
    mu, R = 0.3, 20 * MM
    angle = np.linspace(0, np.pi / 2, 9)[:-1]
    arc = np.column_stack([4.5 * MM + R * (1 - np.sin(angle)), 0 * angle, -R * np.cos(angle) + 0 *
                           angle])[:0]  # fmt: skip
    arc = [(4.5 * MM + R * (1 - np.cos(a)), 0.0, -10 * MM - R * np.sin(a))
           for a in np.linspace(np.pi / 2, 0, 9)]  # fmt: skip
    finger = Finger(n=3, friction=mu)
    mech = moving_hand(
        {"index": finger}, seats={"index": Seat()},
        drives={"index": Drive(tension=lambda t: 40.0 * t, conduit=tuple(arc),
                               transition_speed=1e-6)},
    )  # fmt: skip
    sol = rom.simulate(mech, t_end=0.01, dt=1e-4, rho_inf=0.5)
    force = sol.element("index cable").force[-1]
    ratio = np.linalg.norm(force[-1]) / np.linalg.norm(force[0])
    turned = np.pi / 2 - np.pi / 2 / 8 / 2 * 0
    first = np.array(arc[1]) - arc[0]
    last = np.array([0.0, 0.0, 1.0])
    turned = np.arccos(first @ last / np.linalg.norm(first))
    assert_allclose(ratio, np.exp(-mu * turned), rtol=5e-3)


def test_five_fingers_close_in_time():
    """Each as its tension says; the energy of the cables goes where it is booked."""
    fingers = hand(n=2)
    drives = {name: Drive(tension=lambda t: 1.2 * min(t / 0.2, 1.0)) for name in fingers}
    mech = moving_hand(fingers, drives=drives)
    sol = rom.simulate(mech, t_end=1.0, dt=1e-3, rho_inf=0.5)
    for name in ("index", "little"):
        alone = close(fingers[name], tension=1.2).tip
        base = np.array([0.0, 33 * MM if name == "index" else -33 * MM, 0.0])
        assert_allclose(tip_of(sol, name), base + alone, atol=1e-4 * LENGTHS[name])
    thumb = close(fingers["thumb"], tension=1.2).tip
    assert_allclose(tip_of(sol, "thumb"), [52 * MM - thumb[0], 0, thumb[2]], atol=1e-5)
    assert rom.audit(sol).ok, rom.audit(sol)


def test_what_no_hand_can_do_is_named():
    finger = {"index": Finger(n=2)}
    with pytest.raises(ConfigError, match="drive of 'toe'"):
        moving_hand(finger, drives={"toe": Drive(tension=1.0)})
    with pytest.raises(ConfigError, match="seat of 'toe'"):
        moving_hand({"toe": Finger(n=2)})
    with pytest.raises(ConfigError, match="either a tension or a pull"):
        moving_hand(finger, drives={"index": Drive()})
    with pytest.raises(ConfigError, match="either a tension or a pull"):
        moving_hand(finger, drives={"index": Drive(tension=1.0, pull=1 * MM)})
    with pytest.raises(ConfigError, match=r"winch of 'index' is to take in 0\.03 m"):
        moving_hand(finger, drives={"index": Drive(pull=30 * MM)})
    with pytest.raises(ConfigError, match="cannot close towards"):
        moving_hand(finger, seats={"index": Seat(palmar=(0.0, 0.0, 2.0))})
    with pytest.raises(ConfigError, match="'index cable' are at one point: it would be a knot"):
        moving_hand(finger, drives={"index": Drive(tension=1.0, conduit=2 * ((0.0, 0.0, -0.1),))})
    with pytest.raises(ModelError, match="'index' ends in a bare plate"):
        moving_hand({"index": Finger(phalanges=(0.02, 0.02, 0.0), n=2)})
    with pytest.raises(ConfigError, match="thickness = 0"):
        moving_hand(finger, build=Build(thickness=0.0))
    mech = moving_hand(finger, drives={"index": Drive(pull=lambda t: 40.0 * t * t)})
    with pytest.raises((ConfigError, SolverError), match=r"winch of 'index' is to take in 0\.02"):
        rom.simulate(mech, t_end=0.1, dt=1e-3)
