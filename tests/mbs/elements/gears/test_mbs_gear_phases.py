"""Phases of meshes that share a wheel, from numbers of teeth and places alone."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.refusals import refuses
from rom.components.gear_mesh import GearPair
from rom.errors import ModelError

Z, ORIGIN, MODULE, WIDTH = (0, 0, 1), (0, 0, 0), 2e-3, 0.02
PLACES = {
    "3 in phase": ((24, 24, 72), np.arange(3) * 2 * np.pi / 3),
    "3 in turn": ((28, 26, 80), np.arange(3) * 2 * np.pi / 3),
    "4 against": ((30, 21, 72), np.round(np.arange(4) / 4 * 102) * 2 * np.pi / 102),
    "5 in turn": ((31, 24, 79), np.arange(5) * 2 * np.pi / 5),
}


def train(teeth, places, *, axis=1, thinning=0.0, turned=0.0, phase=None):
    """Sun, ring and planets at angles; the axis of the sun may point down."""
    sun, planet, ring = teeth
    mech, z = rom.Mechanism(gravity=ORIGIN), axis * np.array(Z)
    outer = GearPair((sun, planet), MODULE, WIDTH, thinning=thinning)
    inner = GearPair((planet, -ring), MODULE, WIDTH, thinning=thinning)
    body = {"mass": 1.0, "inertia": (1e-3,) * 3,
            "orientation": rom.rotation.matrix(rom.rotation.exp([0, 0, turned]))}  # fmt: skip
    law = {"stiffness": 1e10, "phase": phase}
    for name in ("sun", "ring"):
        mech.add_rigid(name, at=ORIGIN, **body)
    for k, angle in enumerate(places):
        at = outer.distance * np.array([np.cos(angle), np.sin(angle), 0])
        mech.add_rigid(f"planet {k}", at=at, **body)
        mech.gear_mesh(f"sun {k}", "sun", f"planet {k}", axis=z, pair=outer, **law)
        mech.gear_mesh(f"ring {k}", f"planet {k}", "ring", axis=-z, pair=inner, **law)
    return mech


def pitches(mech, name):
    """Turns of the mesh, in pitches, that its contact is behind the pitch point at the start."""
    mesh = mech.gear_meshes[name]
    return (mesh.pair.rb[0] * mesh.phase - mesh.pair.pitch_point) / mesh.pair.base_pitch


def apart(x):
    """Nearest whole number left out."""
    return (np.asarray(x) + 0.5) % 1 - 0.5


@pytest.mark.parametrize("axis", [1, -1])
@pytest.mark.parametrize("case", PLACES)
def test_planets_mesh_in_the_phases_of_parker_and_lin(case, axis):
    """z psi / (2 pi) at sun and ring against the first planet; they were all zero.

    Between sun and ring half a pitch for planets with an even number of teeth and none for an odd
    one, as halves of a standard tooth stand at both ends of a diameter.
    """
    (sun, planet, ring), places = PLACES[case]
    mech = train((sun, planet, ring), places, axis=axis, turned=0.3)
    at_sun = np.array([pitches(mech, f"sun {k}") for k in range(len(places))])
    at_ring = np.array([pitches(mech, f"ring {k}") for k in range(len(places))])
    step = places * axis / (2 * np.pi)  # driven about the axis, later where teeth come from
    assert_allclose(apart(at_sun - at_sun[0] + sun * step), 0.0, atol=1e-9)
    assert_allclose(apart(at_ring - at_ring[0] - ring * step), 0.0, atol=1e-9)
    assert_allclose(apart(at_ring - at_sun - 0.5 * (planet % 2 == 0)), 0.0, atol=1e-9)


def test_planets_in_turn_push_the_sun_where_planets_in_phase_do_not():
    """Three forces of one size cancel; those of teeth in turn leave a third of their ripple."""
    pushes = {}
    for case in ("3 in phase", "3 in turn"):
        mech = train(*PLACES[case])
        for k in range(3):  # all bodies held: the turn of the sun alone deflects the teeth
            place = mech.ground.marker(mech.part(f"planet {k}").at)
            mech.fixed(f"pin {k}", place, f"planet {k}")
        mech.fixed("ring held", "ground", "ring")
        mech.revolute("input", "ground", "sun", axis=Z)
        mech.drive("turn", "input", lambda t: t)
        sol = rom.simulate(mech, t_end=2e-5, dt=1e-5)
        forces = np.array([sol.element(f"sun {k}").force[-1, 0] for k in range(3)])
        pushes[case] = np.linalg.norm(forces.sum(axis=0)) / np.linalg.norm(forces, axis=1).max()
    assert pushes["3 in phase"] < 1e-3
    assert pushes["3 in turn"] > 0.2


def test_trains_that_cannot_be_put_together_are_refused():
    """(sun + ring) over the number of planets must be whole; a given phase leaves it alone."""
    teeth, places = (24, 21, 66), np.arange(4) * np.pi / 2
    refuses(ModelError, "'ring 1' miss each other's gaps by 0.500 of a pitch", train, teeth, places)
    train(teeth, places, phase=0.0)
    train((24, 24, 72), np.arange(3) * 2 * np.pi / 3, thinning=5e-5)  # backlash is no misfit


def test_a_wheel_between_two_others_takes_its_phase_along():
    """Against a chain closed by hand: the teeth of an idler are where its first mesh put them."""
    mech, pair = rom.Mechanism(gravity=ORIGIN), GearPair((25, 25), MODULE, WIDTH)
    for k in range(3):
        at = k * pair.distance, 0, 0
        mech.add_rigid(f"wheel {k}", mass=1.0, inertia=(1e-3,) * 3, at=at)
    mech.gear_mesh("a", "wheel 0", "wheel 1", axis=Z, pair=pair, stiffness=1e10)
    mech.gear_mesh("b", "wheel 1", "wheel 2", axis=(0, 0, -1), pair=pair, stiffness=1e10)
    assert mech.gear_meshes["a"].phase == 0.0
    assert_allclose(apart(pitches(mech, "b") - pitches(mech, "a")), 0.0, atol=1e-9)  # 25 is odd
