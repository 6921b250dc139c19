"""The hand as a mechanism: postures of the finger by itself, coils, friction, bad input."""

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose

import rom
from cases.refusals import refuses
from rom import rotation
from rom.components import hand as hands
from rom.components.cosserat.bodies import POSE_SIZE
from rom.components.cosserat.coils import add_bending, bend_of
from rom.components.hand.compliant_hand import LENGTHS, Finger, close, hand
from rom.components.hand.moving_hand import Build, Drive, Seat, moving_hand, one_finger
from rom.components.hand.winches import motor_force, shaft, shaft_moment
from rom.errors import ConfigError, ModelError, SolverError

MM = 1e-3
INDEX = {  # tension [N]: angle of a joint [deg], x, z of the tip, pull [mm]; machines by shooting
    0.5: (7.0250, 12.872, 61.210, 2.783),
    2.0: (28.6334, 40.801, 36.008, 11.331),
    2.5: (35.6785, 44.192, 24.965, 14.129),
}


def tip_of(solution, name="finger"):
    return solution.position(f"{name} phalanx 3", "distal")[-1]


def driven(finger, drive, name="index", seat=None):
    one = name.split()[0]
    return moving_hand({one: finger}, seats={one: seat or Seat()}, drives={name: drive})


def at_rest(mech):
    return rom.snapshot(mech, rom.equilibrium(mech))


def cable_steps(solution, name):
    """(n, 3) from station to station of a cable in the end."""
    stations = solution.mechanism.tendons[f"{name} cable"].stations
    return np.diff([solution.position(s.marker.body, s.marker)[-1] for s in stations], axis=0)


def angles_of(solution, name):
    """(3,) between the plates of each spring [rad]."""
    found = []
    for spring in (f"{name} spring {k}" for k in (1, 2, 3)):
        last = len(solution.mechanism.nonlinear[spring].parts) - 1
        a, b = (solution.axes(spring, at)[-1] for at in (0, last))
        found.append(np.arccos(0.5 * (np.trace(a.T @ b) - 1.0)))
    return np.array(found)


@pytest.mark.parametrize("tension", INDEX)
def test_a_finger_in_a_mechanism_has_the_postures_of_the_boundary_value_problem(tension):
    angle, x, z, pull = INDEX[tension]
    found = at_rest(one_finger(Finger(n=16), tension))
    assert_allclose(np.degrees(angles_of(found, "finger")), angle, rtol=3e-4)
    assert_allclose(tip_of(found) / MM, [x, 0, z], rtol=5e-4, atol=1e-9)
    length = np.linalg.norm(cable_steps(found, "finger"), axis=1).sum()
    assert_allclose(54 * MM - length, pull * MM, rtol=5e-4)


@pytest.mark.parametrize(("stiffener", "load"), [(1.0, (0.03, 0.01, 0.0)), (12.0, (0.0, 0.1, 0.0))])
def test_a_finger_in_a_mechanism_gives_way_as_by_itself(stiffener, load):
    finger = Finger(n=4, stiffener=stiffener)
    alone = close(finger, tension=1.5, load=load)
    found = at_rest(one_finger(finger, 1.5, load))
    assert_allclose(tip_of(found), alone.tip, atol=1e-6 * LENGTHS["index"])
    assert_allclose(angles_of(found, "finger"), alone.angles, rtol=1e-6)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_loads_on_the_tip_and_deflections_in_three_directions(axis):
    forces, finger = [-0.05, 0.05], Finger(n=4, stiffener=10.0)
    start, e = close(finger, tension=1.0), np.eye(3)[axis]
    alone = [close(finger, tension=1.0, load=f * e, start=start).tip - start.tip for f in forces]
    assert_allclose(hands.deflections(finger, e, forces, tension=1.0), alone, atol=1e-8)
    soft = hands.deflections(Finger(n=4), e, forces, tension=1.0)
    gain = np.abs(soft[1, axis]) / np.abs(alone[1][axis])
    assert gain > 8.0 if axis == 1 else abs(gain - 1.0) < 1e-3


@pytest.mark.parametrize("load", [(0.0, 0.0, 0.0), (0.0, 0.02, 0.0)])
def test_coils_that_touch_stop_a_moving_finger_where_they_stop_it_at_rest(load):
    """Beyond 2.65 N; with a load across, their plates turn about more than one axis."""
    finger, state = Finger(n=4), None
    for pulled in (2.5, 2.6, 2.7, 3.0, 3.5, 4.0):
        mech = one_finger(finger, pulled, load)
        state = rom.equilibrium(mech, state)
    alone = close(finger, tension=4.0, load=load)
    assert alone.bound.all()
    found = rom.snapshot(mech, state)
    assert_allclose(tip_of(found), alone.tip, atol=1e-6 * LENGTHS["index"])
    moving = one_finger(finger, lambda t: 4.0 * min(t / 0.2, 1.0), load)
    sol = rom.simulate(moving, t_end=1.2, dt=5e-4, rho_inf=0.5)
    assert_allclose(tip_of(sol), alone.tip, atol=1e-4 * LENGTHS["index"])
    assert rom.audit(sol).ok, rom.audit(sol)


@njit
def bent(poses, K):
    angle, axis = bend_of(poses, 1)
    add_bending(2, angle, axis, 1.0, K)
    return axis


def test_the_axis_of_a_bend_turns_with_its_plates_as_differences_say():
    rng, h = np.random.default_rng(4), 1e-6
    p = [rotation.exp(phi) for phi in rng.normal(size=(2, 3))]

    def axis(turned, phi, K):
        q = [rotation.multiply(one, rotation.exp(phi * (k == turned))) for k, one in enumerate(p)]
        poses = np.zeros((2, POSE_SIZE))
        poses[:, 3:7] = q
        return np.array(bent(poses.ravel(), K))

    K, spare = np.zeros((12, 12)), np.zeros((12, 12))
    axis(0, np.zeros(3), K)
    for plate, columns in ((0, slice(3, 6)), (1, slice(9, 12))):
        slopes = [axis(plate, h * e, spare) - axis(plate, -h * e, spare) for e in np.eye(3)]
        assert_allclose(K[3:6, columns], np.array(slopes).T / (2 * h), atol=1e-8)
        assert_allclose(K[9:12, columns], -K[3:6, columns])


def test_the_work_of_a_winch_goes_into_springs_losses_and_friction():
    mu, lost = 0.3, []
    for friction in (0.0, mu):
        drive = Drive(pull=lambda t: 9 * MM * np.sin(np.pi / 2 * min(t / 0.3, 1.0)) ** 2, EA=2e3)
        mech = driven(Finger(n=2, friction=friction), drive)
        sol = rom.simulate(mech, t_end=0.3, dt=1e-4, rho_inf=0.8)
        assert np.abs(sol.energy.balance).max() < 1e-6 * sol.energy.drives[-1]
        lost.append(sol.energy.damping[-1])
    # where the cable turns by psi at each of five inner holes it loses 1 - exp(-mu psi) of its pull
    assert 0.05 * sol.energy.drives[-1] < lost[1] - lost[0] < mu * 2.0 * sol.energy.drives[-1]


def test_a_seat_turns_a_finger_and_nothing_else():
    finger = Finger(n=4)
    seat = Seat((0.1, -0.2, 0.3), along=(1.0, 2.0, -1.0), palmar=(0.5, 1.0, 3.0))
    found = at_rest(driven(finger, Drive(tension=1.0), "thumb", seat))
    alone = close(finger, tension=1.0).tip
    assert_allclose(seat.axes.T @ seat.axes, np.eye(3), atol=1e-14)
    assert_allclose(np.linalg.det(seat.axes), 1.0)
    assert_allclose(tip_of(found, "thumb"), seat.at + seat.axes @ alone, atol=1e-8)
    assert (seat.axes @ [1, 0, 0]) @ [0.5, 1.0, 3.0] > 0


def test_a_conduit_that_bends_takes_its_share_of_the_force():
    """Capstan, over the angles by which the cable turns in the motion that was found."""
    mu, R = 0.3, 20 * MM
    quarter = np.linspace(np.pi / 2, 0, 9)
    arc = [(4.5 * MM + R * (1 - np.cos(a)), 0.0, -10 * MM - R * np.sin(a)) for a in quarter]
    drive = Drive(tension=lambda t: 40.0 * t, conduit=tuple(arc), transition_speed=1e-8)
    mech = driven(Finger(n=3, friction=mu), drive)
    sol = rom.simulate(mech, t_end=0.01, dt=1e-4, rho_inf=0.5)
    force = np.linalg.norm(sol.element("index cable").force[-1], axis=1)
    steps = cable_steps(sol, "index")
    e = steps / np.linalg.norm(steps, axis=1)[:, None]
    turned = np.arccos(np.clip((e[1:] * e[:-1]).sum(axis=1), -1, 1))
    assert np.pi / 2 - 0.15 < turned[:8].sum() < np.pi / 2
    assert_allclose(force[0], 0.4, rtol=1e-12)
    assert_allclose(force[-1] / force[0], np.exp(-mu * turned.sum()), rtol=1e-6)


def test_a_joint_that_is_drawn_alone_bends_alone():
    found = at_rest(driven(Finger(n=16), Drive(tension=1.0), "index joint 2"))
    angles = angles_of(found, "index")
    assert_allclose(np.degrees(angles), [0, 14.2067, 0], rtol=3e-4, atol=1e-6)
    plate = found.position("index phalanx 2", "proximal")[-1]
    along = np.array([np.sin(angles[1]), 0, np.cos(angles[1])])
    assert_allclose(tip_of(found, "index"), plate + (12 + 8 + 10) * MM * along, atol=1e-8)


@pytest.mark.parametrize(("sleeve", "EA", "pull"), [(0.0, 2e2, 4), (0.3, 2e2, 4), (0.0, 1e5, 8)])
def test_a_winch_draws_in_what_cable_and_finger_give(sleeve, EA, pull):
    """The cable in a sleeve is a spring before the finger: tension times length over EA."""
    finger, pull = Finger(n=4), pull * MM
    found = at_rest(driven(finger, Drive(pull=pull, EA=EA, sleeve=sleeve)))
    pulled, length = motor_force(found, "index")[0], 54 * MM
    stretch = pulled / EA * (length - pull) * (length + sleeve) / length
    held = close(finger, pull=pull - stretch)
    assert_allclose(pulled, held.tension, rtol=1e-6)
    assert_allclose(tip_of(found, "index"), held.tip, atol=1e-6 * LENGTHS["index"])
    assert held.tension < close(finger, pull=pull).tension


def test_five_fingers_close_in_time():
    fingers = hand(n=2)
    drives = {name: Drive(tension=lambda t: 1.2 * min(t / 0.2, 1.0)) for name in fingers}
    mech = moving_hand(fingers, drives=drives, build=Build(loss=0.02))
    sol = rom.simulate(mech, t_end=0.8, dt=5e-4, rho_inf=0.5)
    for name in fingers:
        alone, seat = close(fingers[name], tension=1.2).tip, hands.SEATS[name]
        assert_allclose(tip_of(sol, name), seat.at + seat.axes @ alone, atol=1e-6)
    assert np.abs(sol.energy.balance).max() < 1e-5 * sol.energy.forces[-1]


def test_one_shaft_draws_five_cables():
    fingers = hand(n=2)
    radii = {"thumb": 3 * MM, "index": 4 * MM, "middle": 5 * MM, "ring": 4.5 * MM, "little": 2 * MM}
    turn = lambda t: 1.5 * np.sin(np.pi / 2 * min(t / 0.5, 1.0)) ** 2  # noqa: E731
    drives = shaft(turn, radii, drive=Drive(EA=1e5))
    mech = moving_hand(fingers, drives=drives, build=Build(loss=0.02))
    sol = rom.simulate(mech, t_end=1.0, dt=1e-3, rho_inf=0.5)
    alone = {name: close(fingers[name], pull=1.5 * r) for name, r in radii.items()}
    moment = sum(r * alone[name].tension for name, r in radii.items())
    found = shaft_moment(sol, radii)
    assert_allclose(found[-1], moment, rtol=1e-3)  # the cables stretch by a few hundredths of a mm
    work = np.sum(0.5 * (found[1:] + found[:-1]) * np.diff([turn(t) for t in sol.t]))
    assert_allclose(work, sol.energy.drives[-1], rtol=1e-4)
    kept = sol.energy.strain[-1] + sol.energy.damping[-1] + sol.energy.kinetic[-1]
    assert_allclose(kept, sol.energy.drives[-1], rtol=1e-5)


def test_what_no_hand_can_do_is_named():
    finger, force = {"index": Finger(n=2)}, {"tension": 1.0}
    for words, drives in (
        ("drive of 'toe'", {"toe": Drive(**force)}),
        ("exactly one of tension and pull", {"index": Drive()}),
        ("exactly one of tension and pull", {"index": Drive(**force, pull=1 * MM)}),
        (r"winch of 'index' is to take in 0\.03 m", {"index": Drive(pull=30 * MM)}),
        ("'index cable' are at one point", {"index": Drive(**force, conduit=2 * ((0, 0, -0.1),))}),
        ("not in a conduit", {"index joint 1": Drive(**force, conduit=((0, 0, -0.1),))}),
        ("drive of 'index joint 4'", {"index joint 4": Drive(**force)}),
        (r"sleeve of 'index' = -0.1 must", {"index": Drive(pull=0.0, sleeve=-0.1)}),
    ):
        refuses(ConfigError, words, moving_hand, finger, drives=drives)
    refuses(ConfigError, "seat of 'toe'", lambda: moving_hand({"toe": Finger(n=2)}))
    aside = {"index": Seat(palmar=(0.0, 0.0, 2.0))}
    refuses(ConfigError, "cannot close towards", moving_hand, finger, seats=aside)
    bare = {"index": Finger(phalanges=(0.02, 0.02, 0.0), n=2)}
    refuses(ModelError, "'index' ends in a bare plate", moving_hand, bare)
    refuses(ConfigError, "thickness = 0", lambda: moving_hand(finger, build=Build(thickness=0.0)))
    mech = moving_hand(finger, drives={"index": Drive(pull=lambda t: 400.0 * t * t)})
    errors, words = (ConfigError, SolverError), r"winch of 'index' is to take in 0\.02"
    refuses(errors, words, rom.simulate, mech, t_end=0.1, dt=1e-3)
