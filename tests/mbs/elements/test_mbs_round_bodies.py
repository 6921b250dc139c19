"""Round bodies that turn in frames which do not: against frames that turn, and closed forms."""

from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigvals

import rom
from cases.mbs.mechanisms import prepared
from cases.mbs.tangents import check_tangents
from cases.mbs.tubes import tube
from cases.refusals import refused, refuses
from rom.body.damping import damped
from rom.components.gear_mesh import GearPair
from rom.rotation import matrix

Z, ORIGIN = (0, 0, 1), (0, 0, 0)
MASS, ACROSS, ABOUT = 3.0, 0.03, 0.05
ECCENTRICITY, STIFF = 2e-4, 1.5e5


def rotor(way, speed, **more):
    """A rigid round body whose material or whose frame turns."""
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    body = mech.add_rigid("rotor", mass=MASS, inertia=(ACROSS, ACROSS, ABOUT), at=ORIGIN,
                          markers={"low": (0, 0, -0.1), "high": (0, 0, 0.15)},
                          **{way: (0, 0, speed)}, **more)  # fmt: skip
    return mech, body


def test_a_heavy_top_precesses_and_nods_alike_in_both_frames():
    """The frame of one of them goes along with the axis and does not turn about it."""
    lean = 0.4
    p = (np.cos(lean / 2), np.sin(lean / 2), 0, 0)
    found = []
    for way in ("omega", "spin"):
        mech, body = rotor(way, 40.0, orientation=p)
        place = mech.design_point(body.marker("low"))
        mech.spherical("tip", mech.ground.marker(place), "rotor.low")
        sol = rom.simulate(mech, t_end=0.5, dt=2e-4, save_every=50)
        found.append([matrix(q[3:7])[:, 2] for q in sol.q])
    assert sol.q[-1, 6] ** 2 + sol.q[-1, 3] ** 2 > 0.1
    assert np.ptp(found[0], axis=0).max() > 0.2
    assert_allclose(found[1], found[0], atol=2e-5)


def test_a_rigid_rotor_whirls_as_the_books_say_on_uneven_bearings():
    """M u'' + W G u' + K u = 0 with four coordinates."""
    mech, body = rotor("spin", 400.0)
    k = {"low": (3e6, 5e6), "high": (2e6, 1e6)}
    for name, (kx, ky) in k.items():
        mech.bushing(name, mech.ground.marker(body.points[name]), body.marker(name),
                     stiffness=(kx, ky, 1e6, 0, 0, 0))  # fmt: skip
    found = rom.linearize(mech).frequencies
    M, G, K = np.diag([MASS, MASS, ACROSS, ACROSS]), np.zeros((4, 4)), np.zeros((4, 4))
    G[2, 3], G[3, 2] = ABOUT, -ABOUT
    for name, (kx, ky) in k.items():
        z = body.points[name][2]
        for stiffness, row in ((kx, [1, 0, 0, z]), (ky, [0, 1, -z, 0])):
            K += stiffness * np.outer(row, row)
    A = np.block([[np.zeros((4, 4)), np.eye(4)],
                  [-np.linalg.solve(M, K), -np.linalg.solve(M, 400.0 * G)]])  # fmt: skip
    wanted = np.sort(eigvals(A).imag)[4:] / (2 * np.pi)
    axial = np.sqrt(2e6 / MASS) / (2 * np.pi)
    assert_allclose(found, np.sort([0.0, axial, *wanted]), rtol=1e-6, atol=1e-4)


@pytest.mark.parametrize("speed", [0.0, 20.0])
def test_a_top_that_sleeps_is_not_called_unstable(speed, recwarn):
    """It falls below sqrt(4 m g l A) / C of its inertias about the tip, 17 rad/s here."""
    mech, body = rotor("spin", speed)
    mech.bushing("tip", mech.ground.marker(body.points["low"]), body.marker("low"),
                 stiffness=(1e7, 1e7, 1e7, 0, 0, 1.0))  # fmt: skip
    state = rom.equilibrium(mech)
    assert rom.linearize(mech, state).stable == (speed > 0)
    assert any("unstable" in str(w.message) for w in recwarn) == (speed == 0)


@cache
def shaft(damping=0.0):
    body = rom.reduce(tube(0.01, 0.02, 0.3, (16, 1, 16)), method=rom.CraigBampton(12),
                      interfaces={"low": "rbe3", "high": "rbe3"}, reference="mean-axis",
                      certify=False)  # fmt: skip
    return damped(body, rom.Rayleigh(0.0, damping)) if damping else body


def held(way, speed, k=1e9, damping=0.0, inside=0.0):
    """The shaft on even bearings at its ends, with their damping and that of its material [s]."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    part = mech.add_flexible("shaft", shaft(inside), at=ORIGIN, **{way: (0, 0, speed)})
    for name, z in (("low", -0.15), ("high", 0.15)):
        loss = (damping, damping, 0, 0, 0, 0)
        mech.bushing(name, mech.ground.marker((0, 0, z)), part.marker(name),
                     stiffness=(k, k, 1e8, 0, 0, 0), damping=loss)  # fmt: skip
    return mech


def test_bending_of_a_solid_splits_as_in_a_frame_that_turns():
    """There pairs stand apart by twice the speed more; terms of its square are left out."""
    off = []
    for speed in (100.0, 200.0):
        mech = held("omega", speed)
        moving = rom.linearize(mech, rom.equilibrium(mech, spin=(0, 0, speed))).frequencies
        bend = rom.linearize(held("spin", speed)).frequencies
        still = rom.linearize(held("spin", 0.0)).frequencies
        pairs = [k for k in range(8) if still[k + 1] < 1.001 * still[k] and still[k] > 1]
        assert len(pairs) >= 2
        for k in pairs:
            split = 2 * np.pi * (bend[k + 1] - bend[k])
            assert 1e-3 * speed < split < 2.0 * speed
            back, forth = (2 * np.pi * bend[j] + way * speed for j, way in ((k, 1), (k + 1, -1)))
            off.append(max(np.abs(2 * np.pi * moving / w - 1).min() for w in (back, forth)))
    first, second = np.reshape(off, (2, -1))
    assert np.all(first < 2e-3)
    assert_allclose(second / first, 4.0, rtol=0.2)


@pytest.mark.parametrize("n", [2, 3])
def test_waves_of_a_turning_ring_travel_as_bryan_found(n):
    """In fixed axes the two waves of an inextensible ring differ by 2 n (n^2 - 1) / (n^2 + 1) W."""
    ring = tube(0.198, 0.202, 0.02, (48, 1, 3))
    body = rom.reduce(ring, method=rom.FreeFree(40), reference="mean-axis", certify=False)
    speed, mech = 5.0, rom.Mechanism(gravity=(0, 0, 0))
    mech.add_flexible("ring", body, at=ORIGIN, spin=(0, 0, speed))
    found = 2 * np.pi * rom.linearize(mech).frequencies
    wanted = 2 * n * (n**2 - 1) / (n**2 + 1) * speed
    gaps = np.diff(found[6:])
    assert np.abs(gaps / wanted - 1).min() < 0.02


def test_damping_inside_a_shaft_feeds_whirl_beyond_the_critical_speed():
    """From w (1 + c_e / c_i) on, as of Jeffcott's rotor, w that of the whirl with the rotation."""

    def growth(speed, **loss):
        values = rom.linearize(held("spin", speed, k=1e7, **loss)).eigenvalues
        bending = np.abs(values.imag) > 100.0
        first = np.abs(values.imag[bending]).min()
        near = np.abs(np.abs(values.imag) - first) < 0.2 * first
        return values.real[near].max(), np.abs(values.imag[near]).max()

    both = {"damping": 4.0, "inside": 3e-6}
    outer, inner = (-growth(0.0, **{name: both[name]})[0] for name in both)
    assert outer > 1
    assert inner > 1
    threshold = growth(growth(0.0)[1] * (1 + outer / inner))[1] * (1 + outer / inner)
    assert growth(0.98 * threshold, **both)[0] < 0 < growth(1.02 * threshold, **both)[0]
    assert growth(1.5 * threshold, damping=4.0)[0] < 0


def test_damping_inside_takes_from_what_turns_the_shaft():
    """Energy that whirl gains is booked as work of forces from outside, whose tangents go along."""
    mech = held("spin", 4000.0, k=1e7, damping=20.0, inside=3e-6)
    packed, W = prepared(mech)
    rest = packed.q, 0 * packed.v, 0 * packed.v, 0 * W.value
    check_tangents(packed, W, rest, np.eye(packed.v.size)[:, 6:], 1e-6)
    mech.force("push", mech.part("shaft").marker("low"), lambda t: (1e3 * (t < 1e-3), 0, 0))
    sol = rom.simulate(mech, t_end=5e-3, dt=5e-6)
    assert rom.audit(sol).ok, rom.audit(sol)


def spun(inertia, spin):
    rom.Mechanism().add_rigid("rotor", mass=1.0, inertia=inertia, at=ORIGIN, spin=spin)


def spun_shaft(spin=(0, 0, 5.0), **changed):
    rom.Mechanism().add_flexible("shaft", replace(shaft(), **changed), at=ORIGIN, spin=spin)


test_what_is_not_round_is_refused = refused(
    (lambda: spun((0.03, 0.031, 0.05), (0, 0, 9.0)), "only a round body can turn through a frame"),
    (lambda: spun((0.03, 0.03, 0.05), (9.0, 0, 0)), "only a round body can turn through a frame"),
    (lambda: spun_shaft((5.0, 0, 0)), "only a round body"),
    (lambda: spun_shaft(surface=None), "needs a surface"),
    # the force m e W^2 was left out of a flexible body up to 2 % of its size
    (
        lambda: spun_shaft(first_moment=shaft().first_moment + 5e-4 * shaft().mass * np.eye(3)[0]),
        "its mass centre lies 0.0005 m beside",
    ),
    error=rom.ModelError,
)


@pytest.mark.parametrize("ratio", [0.6, 1.4])
@pytest.mark.parametrize("way", ["omega", "spin"])
def test_an_unbalance_turns_on_its_orbit_as_the_hint_says(way, ratio):
    """Jeffcott's rotor from rest: an orbit of e r^2 / (1 - r^2) and a whirl from its start."""
    mech, free = rom.Mechanism(gravity=ORIGIN), np.sqrt(STIFF / MASS)
    speed, e = ratio * free, ECCENTRICITY if way == "omega" else 0.0
    rotor = mech.add_rigid("rotor", mass=MASS, inertia=(ACROSS, ACROSS, ABOUT), at=(e, 0, 0),
                           velocity=(0, speed * e, 0), **{way: (0, 0, speed)})  # fmt: skip
    end, stiffness = rotor.marker((-e, 0, 0)), (STIFF, STIFF, 1e6, 0, 0, 0)
    mech.bushing("shaft", "ground", end, stiffness=stiffness)
    if way == "spin":
        pull = MASS * ECCENTRICITY * speed**2
        mech.force("unbalance", rotor.marker(ORIGIN),
                   lambda t: (pull * np.cos(speed * t), pull * np.sin(speed * t), 0))  # fmt: skip
    sol = rom.simulate(mech, t_end=1.5 * 2 * np.pi / speed, dt=2e-4)
    centre = sol.position("rotor") - [matrix(q[3:7]) @ [e, 0, 0] for q in sol.q]
    whirl = np.cos(free * sol.t) + 1j * ratio * np.sin(free * sol.t)
    wanted = ECCENTRICITY * ratio**2 / (1 - ratio**2) * (np.exp(1j * speed * sol.t) - whirl)
    assert_allclose(centre[:, :2] @ [1, 1j], wanted, atol=2e-3 * np.abs(wanted).max())


HOLDS = {
    "bushing": lambda m, a, b: m.bushing("held", a, b, stiffness=(1e6,) * 6),
    "spring": lambda m, a, b: m.spring_damper(
        "held", m.ground.marker((0, 0.1, 0)), b, stiffness=1e5),
    "joint": lambda m, a, b: m.spherical("held", a, b),
    "film": lambda m, a, b: m.journal_bearing(
        "held", b, a, axis=Z, oil=0.02, bearing=rom.mbs.JournalBearing(0.05, 0.03, 5e-4, [])),
    "balls": lambda m, a, b: m.rolling_bearing(
        "held", b, a, axis=Z, bearing=rom.mbs.BallBearing(9, 0.01, 0.05)),
    "teeth": lambda m, a, b: m.gear_mesh(
        "held", b, m.add_rigid("gear", mass=1, inertia=(1, 1, 1), at=(0.1, 0, 0)).marker(ORIGIN),
        axis=Z, pair=GearPair((25, 25), 4e-3, 0.03, centre_distance=0.1), stiffness=1e9),
}  # fmt: skip


@pytest.mark.parametrize("how", HOLDS)
def test_what_holds_a_spinning_body_beside_its_axis_is_refused(how):
    """The unbalance would be lost without a word; on the axis all of them are taken."""
    for beside in (True, False):
        mech = rom.Mechanism()
        x = ECCENTRICITY if beside else 0.0
        rotor = mech.add_rigid("rotor", mass=MASS, inertia=(ACROSS, ACROSS, ABOUT), at=(-x, 0, 0),
                               spin=(0, 0, 50.0))  # fmt: skip
        place = rotor.marker((x, 0, 0))
        if not beside:
            HOLDS[how](mech, "ground", place)
            continue
        with pytest.raises(rom.ModelError, match=r"0.0002 m beside the axis.*0.0006 kg m") as error:
            HOLDS[how](mech, "ground", place)
        assert "1.5 N at this speed" in error.value.hint
    mech.force("belt", rotor.marker((0.1, 0, 0)), (0, 1, 0))  # a place in space


def test_surfaces_of_spinning_bodies_that_slide_or_roll_are_refused():
    """Their friction would see a surface at rest."""
    mech, law = rom.Mechanism(), rom.mbs.Impact(stiffness=1e6, mu=0.2)
    mech.add_rigid("ball", mass=1, inertia=(1e-3,) * 3, at=(0, 0, 0.05), spin=(0, 9.0, 0))
    for add in (mech.rolling, partial(mech.sphere_on_plane, law=law)):
        given = {"normal": Z, "radius": 0.05}
        refuses(rom.ConfigError, "'ball', which spins", add, "touch", "ground", "ball", **given)
