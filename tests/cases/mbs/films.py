"""Rotors on oil films, for tests of films and of what oil does in time."""

import numpy as np

import rom
from cases.mbs.mechanisms import prepared, residual_at

ORIGIN, NONE = (0.0, 0.0, 0.0), np.zeros(0)
VISCOSITY, SPEED = 0.03, 100.0
MOTION = np.array([0.4e-4, 0.3e-4, 1e-4, -2e-4])
RATE = np.array([5e-4, 2e-4, -0.3e-2, 0.4e-2])
UPRIGHT, STILL = np.eye(3), np.zeros(6)


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


def on_ground(bearing, *, oil=VISCOSITY, name="film", turning=SPEED, way=ORIGIN, at=ORIGIN, **more):
    """A shaft that turns and goes its way in a bush on the ground."""
    mech = rom.Mechanism(gravity=ORIGIN)
    shaft = mech.add_rigid("shaft", mass=1.0, inertia=(0.1,) * 3, at=at, omega=(0, 0, turning),
                           velocity=way)  # fmt: skip
    given = {"axis": (0, 0, 1), "bearing": bearing, "oil": oil} | more
    mech.journal_bearing(name, shaft.marker(ORIGIN), mech.ground.marker(ORIGIN), **given)
    return mech


def resting(mech, speed):
    """The equilibrium, and stiffness and damping (2, 2) that the rotor feels in the world."""
    state = rom.equilibrium(mech, spin={"turn": speed})
    around = rom.linearize(mech, state, frame="world")
    back = np.linalg.inv(around.basis[:2])
    return state, back.T @ around.K @ back, back.T @ around.C @ back


def leaning(motion):
    """(3, 3) axes of a journal, with the slopes that the motion says."""
    a, b = motion[3], -motion[2]
    n = np.array([a, b, 1.0]) / np.linalg.norm([a, b, 1.0])
    x = np.array([1.0, 0.0, 0.0]) - n[0] * n
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(n, x), n])


class Pair:
    """Journal and bush free in space; the journal moves in the bush as told."""

    def __init__(self, b, A=UPRIGHT, at=ORIGIN, motion=MOTION, along=0.0, **more):
        mech = rom.Mechanism(gravity=ORIGIN)
        own = {"mass": 2.0, "inertia": (0.01, 0.02, 0.03)}
        self.A, self.at, self.B = A, np.asarray(at), A @ leaning(motion)
        self.arm = A @ [*motion[:2] + along * motion[[3, 2]] * [1, -1], along]
        journal = mech.add_rigid("journal", at=at + self.arm, orientation=self.B, **own)
        bush = mech.add_rigid("bush", at=at, orientation=A, **own)
        given = {"axis": A[:, 2], "reference": A[:, 0], "bearing": b, "oil": VISCOSITY} | more
        mech.journal_bearing("film", journal.marker(ORIGIN), bush.marker(ORIGIN), **given)
        # the axis of the journal is not that of the bush: as if the bodies had come there later
        element = mech.journal_bearings["film"]
        element.axes[0] = [0.0, 0.0, 1.0]
        self.mech, self.motion, self.along = mech, motion, along
        self.packed, self.W = prepared(mech)
        (self.table,) = self.packed.elements.values()

    def velocities(self, rate=RATE, spin=SPEED, bush=STILL):
        """(12,) of journal and bush, the latter with (6,) velocity and angular velocity."""
        n, da, db = self.B[:, 2], rate[3], -rate[2]
        slope = np.array([self.motion[3], -self.motion[2], 1.0])
        dn = np.array([da, db, 0.0]) - (slope @ [da, db, 0.0]) / (slope @ slope) * slope
        omega = np.cross(n, self.A @ dn / np.linalg.norm(slope))
        omega += (spin - omega @ self.A[:, 2]) / (n @ self.A[:, 2]) * n
        move = self.A @ [*rate[:2] + self.along * np.array([da, db]), 0.0]
        v, w = bush[:3], bush[3:]
        move, omega = v + np.cross(w, self.arm) + move, w + omega
        return np.concatenate([move, self.B.T @ omega, v, self.A.T @ w])

    def loads(self, v):
        """(2, 6) loads on journal and bush, world, and the power lost."""
        residual_at(self.packed.system, self.W, self.packed.q, v, 0 * v, NONE)
        return self.W.wrench[[self.table.i[0], self.table.j[0]]].copy(), self.W.power[2]
