"""Fingers of springs: joints and fingers against a boundary value solver, friction, stops."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cases.components.rods import moved, slopes
from cases.refusals import refuses
from rom import rotation
from rom.components.cosserat import Shape, elastic_energy, linearised, reference, straight
from rom.components.cosserat.helical_spring import HelicalSpring, plate_compliance, spring_rod
from rom.components.hand import compliant_hand
from rom.components.hand.cable import Hole, Tendon
from rom.components.hand.compliant_hand import PHALANX_RIGIDITY_RATIO, Finger, close, rest
from rom.errors import ConfigError, ModelError, SolverError

MM = 1e-3
BENCH = HelicalSpring(1 * MM, 10 * MM, 6, 15 * MM, total_coils=0.0)  # coils pass each other


def bench(n=16, **options):
    return Finger((BENCH,), (0.0,), offset=6 * MM, n=n, **options)


JOINT = {  # tension [N]: angle [deg], x, z of the tip, cable in the joint, pull [mm]
    0.5: (3.8457, 0.49274, 14.67697, 14.28260, 0.71740),
    1: (7.7834, 0.97496, 14.33182, 13.55049, 1.44951),
    2: (15.8745, 1.89293, 13.57672, 12.05098, 2.94902),
    4: (32.4152, 3.44391, 11.84815, 8.98910, 6.01090),
    8: (63.1370, 4.98309, 8.10987, 3.23625, 11.76375),
    10: (76.0641, 5.01960, 6.41739, 0.75412, 14.24588),
}


def test_one_joint_under_tension():
    """Planar boundary value problem of the same rod, solved by shooting."""
    posture = rest(bench())
    for tension, (angle, x, z, cable, pull) in JOINT.items():
        posture = close(bench(), tension=tension, start=posture)
        assert_allclose(np.degrees(posture.angles), [angle], rtol=1e-3)
        assert_allclose(posture.tip / MM, [x, 0, z], rtol=2e-3, atol=1e-9)
        length = posture.finger.tendon.length(posture.shape)
        assert_allclose(length / MM, cable, rtol=1e-3, atol=5e-3)
        assert_allclose(posture.pull / MM, pull, rtol=1e-3)


def test_work_of_the_cable_is_the_energy_of_the_spring():
    finger, posture, work = bench(), rest(bench()), 0.0
    for tension in np.linspace(0, 8, 33)[1:]:
        new = close(finger, tension=tension, start=posture)
        work += (new.tension + posture.tension) / 2 * (new.pull - posture.pull)
        posture = new
    assert_allclose(work, elastic_energy(finger.rod, posture.shape), rtol=1e-3)
    assert_allclose(work, 0.0463955, rtol=2e-3)


INDEX = {  # tension [N]: angle of a joint [deg], x, z of the tip, pull, inner length [mm]
    0.5: (7.0250, 12.872, 61.210, 2.783, 7.16),
    1: (14.2067, 24.630, 55.182, 5.623, 6.30),
    2: (28.6334, 40.801, 36.008, 11.331, 4.59),
    2.5: (35.6785, 44.192, 24.965, 14.129, 3.75),
}


def test_index_finger_closes_until_coils_touch():
    """All joints feel the tension alone and bend alike; beyond 2.65 N the pull hardly grows."""
    postures = [rest(Finger())]
    for tension, (angle, x, z, pull, inner) in INDEX.items():
        posture = close(Finger(), tension=tension, start=postures[-1])
        assert_allclose(np.degrees(posture.angles), 3 * [angle], rtol=3e-4)
        assert_allclose(posture.tip / MM, [x, 0, z], rtol=5e-4, atol=1e-9)
        assert_allclose(posture.pull / MM, pull, rtol=3e-4)
        length = posture.finger.clearances(posture.shape) / MM + 3.5
        assert_allclose(length, 3 * [inner], rtol=8e-3)
        assert not posture.bound.any()
        postures.append(posture)
    by_pull = close(Finger(), pull=postures[3].pull)
    assert_allclose(by_pull.tension, 2.0, rtol=1e-8)
    assert_allclose(by_pull.shape.x, postures[3].shape.x, atol=1e-10)
    last = close(Finger(), tension=4.0, start=posture)
    assert last.bound.all()
    assert (last.finger.clearances(last.shape) > -0.1 * MM).all()
    assert_allclose(np.degrees(last.angles.sum()), 113, atol=8)
    assert 0 < last.pull - posture.pull < 1.5 * MM


def test_compliance_of_the_tip():
    finger = Finger()
    C = rest(finger).tip_compliance()
    assert_allclose([C[0, 0], C[1, 1]], 0.267362, rtol=2e-4)
    assert_allclose(C[2, 2], 2.2286e-3, rtol=2e-4)
    joint = plate_compliance(spring_rod(finger.springs[0], finger.n), (0, 0, 8 * MM))
    total, away = np.zeros((6, 6)), 0.0
    for link in reversed(finger.phalanges):
        away += link
        move = np.eye(6)
        move[:3, 3:] = -rotation.skew([0, 0, away])
        total += move @ joint @ move.T
        total[:3, :3] += link / (PHALANX_RIGIDITY_RATIO * finger.springs[0].axial) * np.eye(3)
        away += 8 * MM
    # between the last phalanx and the plate at the tip lies half of it, as stiff as phalanges are
    rigidity = PHALANX_RIGIDITY_RATIO * finger.springs[-1].bending
    total[3:, 3:] += finger.phalanges[-1] / 2 / rigidity * np.eye(3)
    size = np.sqrt(np.outer(total.diagonal(), total.diagonal()))
    assert_allclose(C / size, total / size, atol=1e-8)


def test_a_finger_is_symmetric_about_its_plane_and_a_stiffener_leaves_flexion_alone():
    finger = Finger(n=8)
    left, right = (close(finger, tension=1.0, load=(0, side, 0)) for side in (0.02, -0.02))
    assert left.tip[1] > 1 * MM
    assert_allclose(left.tip * [1, -1, 1], right.tip, atol=1e-9)
    plain, stiff = (close(Finger(n=6, stiffener=s), tension=1.0) for s in (1.0, 20.0))
    assert_allclose(stiff.tip, plain.tip, atol=1e-9)
    assert stiff.tip_compliance()[1, 1] < plain.tip_compliance()[1, 1] / 15


def test_stiffness_of_the_tip_is_the_slope_of_load_and_deflection():
    finger = Finger(n=8)
    posture = close(finger, tension=1.0)
    C = posture.tip_compliance()
    for axis in range(3):
        d = 1e-4 * np.eye(3)[axis]
        slope = [close(finger, tension=1.0, load=s * d, start=posture).tip for s in (1, -1)]
        assert_allclose((slope[0] - slope[1]) / 2e-4, C[:3, axis], rtol=1e-4, atol=1e-7)


def loop(friction):
    """Work lost in drawing 8 mm in and letting it out, and tensions at 4 mm both ways."""
    finger = Finger(n=6, friction=friction)
    posture, lost, at = rest(finger), 0.0, []
    inward, outward = np.linspace(0, 8 * MM, 9)[1:], np.linspace(8 * MM, 0, 9)[1:-1]
    for way, pulls in ((1.0, inward), (-1.0, outward)):
        for pull in pulls:
            new = close(finger, pull=pull, start=posture, way=way)
            lost += (new.tension + posture.tension) / 2 * (new.pull - posture.pull)
            posture = new
            if abs(pull - 4 * MM) < 1e-9:
                at.append(new.tension)
    lost -= posture.tension / 2 * posture.pull
    return lost, at


def test_friction_makes_a_loop_of_tension_over_pull():
    lost, (inward, outward) = loop(0.2)
    assert lost > 1e-4 and inward > outward
    lost, (inward, outward) = loop(0.0)
    assert abs(lost) < 1e-5
    assert_allclose(inward, outward, rtol=1e-8)


def test_capstan():
    n, mu = 9, 0.3
    angle = np.linspace(0, np.pi / 2, n)
    x = np.column_stack([np.sin(angle), np.zeros(n), 1 - np.cos(angle)])
    tendon = Tendon(tuple(Hole(i, 0, (0, 0, 0)) for i in range(n)), mu, 2.0)
    shape = Shape(x, np.tile([1.0, 0, 0, 0], (n + 1, 1)))
    turned = (n - 2) * (angle[1] - angle[0])
    assert_allclose(tendon.turns(shape).sum(), turned)
    assert_allclose(tendon.tensions(shape)[-1], np.exp(-mu * turned))
    assert_allclose(tendon.tensions(shape, way=-1)[-1], np.exp(mu * turned))
    assert_allclose(tendon.actuator(5.0), 5 * np.exp(0.6))


def test_forces_of_a_cable_are_derivatives_of_its_length():
    rng = np.random.default_rng(7)
    rod = straight(1.0, 3, stretch=1.0, bend=1.0)
    holes = Hole(0, 0, (0.2, 0.1, 0)), Hole(2, 3, (0.1, -0.2, 0.1)), Hole(3, 4, (0.3, 0.1, 0.2))
    tendon = Tendon(holes)
    start = reference(rod)
    p = [rotation.multiply(q, rotation.exp(0.4 * rng.normal(size=3))) for q in start.p]
    shape = Shape(start.x + 0.1 * rng.normal(size=start.x.shape), np.array(p))
    r, K = tendon.forces(rod, shape)
    assert_allclose(r, slopes(lambda d: tendon.length(moved(shape, d)), r.size), atol=1e-9)
    by_shape = slopes(lambda d: tendon.forces(rod, moved(shape, d))[0], r.size)
    assert_allclose(K, by_shape, atol=1e-8)


def test_the_hand_has_fifteen_joints():
    fingers = compliant_hand.hand()
    assert sum(len(f.springs) for f in fingers.values()) == 15
    assert_allclose([f.rod.x[-1, 2] / MM for f in fingers.values()], [49.5, 64, 70.7, 65.5, 53.3])


def test_what_no_finger_can_do_is_named():
    finger = Finger(n=4)
    refuses(ConfigError, "tension or pull, not both", close, finger, tension=1.0, pull=1.0)
    refuses(ModelError, "3 springs and 2 phalanges", Finger, phalanges=(1.0, 1.0))
    refuses(ModelError, "the last >= 0", Finger, phalanges=(0.0, 1.0, 1.0))
    refuses(ModelError, "a tendon of 1 holes", lambda: Tendon((Hole(0, 0, (0, 0, 0)),)))
    holes = Hole(0, 0, (0, 0, 0)), Hole(1, 1, (0, 0, 0))
    refuses(ModelError, "must not be negative", Tendon, holes, friction=-0.1)
    refuses(ConfigError, r"0\.5 must .* below 0\.0216", close, finger, pull=0.5)

    def lost(shape):
        r, K = finger.stops(shape)
        return (r, K) if shape.x[-1, 0] < 5 * MM else (r * np.nan, K)

    with pytest.raises(SolverError, match="no posture beyond") as error:
        close(finger, tension=2.0, extra=lost)
    assert 0 < error.value.solution.tip[0] < 5 * MM


def test_contact_with_a_bar_has_its_tangent_and_balances():
    finger, bar = Finger(n=4), compliant_hand.Bar((26 * MM, 34 * MM), 20 * MM)
    postures = compliant_hand.grasp(finger, bar, np.linspace(0.25, 2.5, 10))
    last = postures[-1]
    pressure, normals = bar.pressure(last)
    assert pressure.max() > 0.05
    assert bar.gaps(finger, last.shape)[0].min() > -0.5 * MM
    assert last.pull < close(finger, tension=2.5).pull
    contact = bar.contact(finger)
    r, K = contact(last.shape)
    pull = last.tension * finger.tendon.forces(finger.rod, last.shape)[0]
    total = linearised(finger.rod, last.shape)[0] + pull
    assert_allclose(total[[3, 5]], -pressure @ normals, atol=1e-7)
    d = np.zeros((len(last.shape.p), 6))
    d[:-1, 3:] = 1e-8 * np.random.default_rng(8).normal(size=last.shape.x.shape)
    there, back = (Shape(last.shape.x + s * d[:-1, 3:], last.shape.p) for s in (1, -1))
    change = (contact(there)[0] - contact(back)[0]) / 2
    assert_allclose(K @ d.ravel()[:-3], change, rtol=1e-4, atol=1e-9 * np.abs(r).max())
    close_by = compliant_hand.Bar((20 * MM, 34 * MM), 20 * MM)
    refuses(ConfigError, r"0\.005 m into", compliant_hand.grasp, finger, close_by, [1.0])
    assert bar.pressure(rest(finger))[0].max() == 0.0
