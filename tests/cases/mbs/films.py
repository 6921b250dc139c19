"""Rotors on oil films, for tests of films and of what oil does in time."""

import numpy as np

import rom

ORIGIN = (0.0, 0.0, 0.0)


def held_rotor(bearing, load, *, speed, oil, mass=10.0, moves=None, body=None, **more):
    """A rotor that a motor turns, free to move across its axis in one bearing.

    ``moves`` are two functions of time that drive it along X and Y instead. The bush is the ground,
    or the "bore" of a flexible body whose "rim" the ground holds.
    """
    mech = rom.Mechanism(gravity=ORIGIN)
    bush = mech.ground.marker(ORIGIN)
    if body is not None:
        part = mech.add_flexible("bush", body, at=ORIGIN)
        mech.fixed("seat", bush, part.marker("rim"))
        bush, more = part.marker("bore"), {"elastic_bush": True} | more
    x, y = (0.0, 0.0) if moves is None else (moves[0](0.0), moves[1](0.0))
    solid = {"mass": mass, "inertia": (0.1,) * 3}
    shaft = mech.add_rigid("shaft", at=(x, y, 0), omega=(0, 0, speed), **solid)
    light = {"mass": 1e-6 * mass, "inertia": (1e-6,) * 3}
    slider = mech.add_rigid("slider", at=(x, 0, 0), **light)
    carriage = mech.add_rigid("carriage", at=(x, y, 0), **light)
    ends = [part.marker(ORIGIN) for part in (mech.ground, slider, carriage, shaft)]
    mech.prismatic("x", *ends[:2], axis=(1, 0, 0))
    mech.prismatic("y", *ends[1:3], axis=(0, 1, 0))
    mech.revolute("turn", *ends[2:], axis=(0, 0, 1))
    mech.drive("motor", "turn", lambda t: speed * t)
    for name, start, move in zip("xy", (x, y), moves or (), strict=False):
        mech.drive(f"move {name}", name, lambda t, move=move, start=start: move(t) - start)
    mech.journal_bearing("film", ends[3], bush, axis=(0, 0, 1), bearing=bearing, oil=oil, **more)
    if np.any(load):
        mech.force("load", ends[3], (*load, 0.0))
    return mech


def resting(mech, speed):
    """The equilibrium, and stiffness and damping (2, 2) that the rotor feels in the world."""
    state = rom.equilibrium(mech, spin={"turn": speed})
    around = rom.linearize(mech, state, frame="world")
    back = np.linalg.inv(around.basis[:2])
    return state, back.T @ around.K @ back, back.T @ around.C @ back
