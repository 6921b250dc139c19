"""Linkages of two drives as bodies and joints of the multibody core."""

import numpy as np

import rom
from rom import rotation

Z = (0.0, 0.0, 1.0)


def still(t):
    return 0.0


def link_of_the_core(mech, name, body, at, angle):
    """Add a link at a place (2,): a rod (mass, length), or a flexible body with pins root, tip."""
    A = rotation.matrix(np.array([np.cos(angle / 2), 0, 0, np.sin(angle / 2)]))
    place = np.array([*at, 0.0])
    if isinstance(body, tuple):
        mass, length = body
        J, half = mass * length**2 / 12, np.array([length / 2, 0, 0])
        return mech.add_rigid(
            name, mass=mass, inertia=(J / 100, J, J), at=place + A @ half, orientation=A,
            markers={"root": -half, "tip": half},
        )  # fmt: skip
    return mech.add_flexible(name, body, at=place - A @ body.marker("root").point, orientation=A)


def pinned(mech, name, body, at, angle, first):
    """Add a link as `link_of_the_core` on a pin at a marker."""
    part = link_of_the_core(mech, name, body, at, angle)
    mech.revolute(f"{name} pin", first, part.marker("root"), axis=Z)
    return part


def ball(mech, name, mass, at, inertia=1e-9):
    return mech.add_rigid(name, mass=mass, inertia=(inertia,) * 3, at=(*at, 0.0))


def direction(arm):
    return float(np.arctan2(arm[1], arm[0]))


def five_bar_of_the_core(q, cranks, couplers, posture):
    """The five-bar with a tool of 0.5 kg, drives "left" and "right" on its base joints."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    tips = []
    for k, (pivot, elbow) in enumerate(((0, 1), (4, 3))):
        o = mech.ground.marker((*posture[pivot], 0.0))
        end = pinned(mech, f"crank {k}", cranks[k], posture[pivot], q[k], o).marker("tip")
        turn = direction(posture[2] - posture[elbow])
        coupler = pinned(mech, f"coupler {k}", couplers[k], posture[elbow], turn, end)
        tips.append(coupler.marker("tip"))
        mech.drive(("left", "right")[k], f"crank {k} pin", still)
    mech.revolute("tip", *tips, axis=Z)
    mech.fixed("held", tips[0], ball(mech, "ball", 0.5, posture[2]).marker((0, 0, 0)))
    return mech


def cross_slides_of_the_core(masses, angle):
    """PP: drives "x" along x and "y" at an angle to it."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    for name, mass in zip("ab", masses, strict=True):
        ball(mech, name, mass, (0, 0), 0.01 * mass)
    mech.prismatic("low", "ground", "a", axis=(1, 0, 0))
    mech.prismatic("high", "a", "b", axis=(np.cos(angle), np.sin(angle), 0))
    mech.drive("x", "low", still)
    mech.drive("y", "high", still)
    return mech


def slide_arm_of_the_core(slide, arm, angle):
    """PR: a slide on a rail along x, drive "x", and a rod on it at an angle, drive "turn"."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    ball(mech, "slide", slide, (0, 0))
    mech.prismatic("rail", "ground", "slide", axis=(1, 0, 0))
    pinned(mech, "arm", arm, (0, 0), angle, "slide")
    mech.drive("x", "rail", still)
    mech.drive("turn", "arm pin", still)
    return mech


def two_link_of_the_core(first, second, q):
    """2R: two rods, drives "shoulder" on the ground and "elbow" between them."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    upper = pinned(mech, "upper", first, (0, 0), q[0], mech.ground.marker((0, 0, 0)))
    elbow = first[1] * np.array([np.cos(q[0]), np.sin(q[0])])
    pinned(mech, "lower", second, elbow, q[0] + q[1], upper.marker("tip"))
    mech.drive("shoulder", "upper pin", still)
    mech.drive("elbow", "lower pin", still)
    return mech


def rail_of_the_core(slide, coupler, payload, spread):
    """PRRRP on one rail along x: slides at 0 and at the spread, drives "left" and "right"."""
    mech, tips = rom.Mechanism(gravity=(0, 0, 0)), []
    tip = np.array([spread / 2, np.sqrt(coupler[1] ** 2 - spread**2 / 4)])
    for name, x in (("left", 0.0), ("right", spread)):
        base = ball(mech, f"{name} slide", slide, (x, 0)).marker((0, 0, 0))
        mech.prismatic(f"{name} rail", mech.ground.marker((x, 0, 0)), base, axis=(1, 0, 0))
        turn = direction(tip - [x, 0])
        rod = pinned(mech, f"{name} coupler", coupler, (x, 0), turn, base)
        tips.append(rod.marker("tip"))
        mech.drive(name, f"{name} rail", still)
    mech.revolute("tip", *tips, axis=Z)
    mech.fixed("held", tips[0], ball(mech, "tool", payload, tip).marker((0, 0, 0)))
    return mech
