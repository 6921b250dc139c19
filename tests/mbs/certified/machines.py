"""Machines with a beam in them, for tests of how far its modes serve."""

import numpy as np

import rom
from cases.solid import KINDS, block
from rom.components.gear_mesh import GearPair

ALL = 60  # modes: with constraint modes all of a block of eight bricks that have mass in a motion
Y = (0, 1, 0)


def beam(n_modes, size=(1.0, 0.03, 0.04), *, spare=True):
    """A beam from its root, along x; all shapes that inertia bends, unless without spare."""
    width, height = size[1:]
    model = block(size, (8, 1, 1), origin=(0.0, -width / 2, -height / 2))
    method = rom.CraigBampton(n_modes)
    return rom.reduce(
        model, method=rom.WithLoads(method) if spare else method, interfaces=KINDS, name="beam",
        reference="root", damping=rom.ModalDamping(0.01, fixed=("root",)), certify=False,
    )  # fmt: skip


def ramp(t, T):
    """From 0 to 1 in a time T, smooth to the third derivative."""
    s = np.clip(t / T, 0.0, 1.0)
    return s**4 * (35 - 84 * s + 70 * s**2 - 20 * s**3)


def crank(body, speed=60.0):
    """A crank of 0.1 m and the beam as rod; a heavy slider."""
    mech = rom.Mechanism()
    web = mech.add_rigid(
        "web", mass=2, inertia=(1e-2,) * 3, at=(0, 0, 0), markers={"pin": (0.1, 0, 0)}
    )
    rod = mech.add_flexible("rod", body, at=(0.1, 0, 0))
    end = mech.add_rigid(
        "slider", mass=3, inertia=(1e-2,) * 3, at=(1.1, 0, 0), markers={"pin": (0, 0, 0)}
    )
    mech.revolute("bearing", mech.ground.marker((0, 0, 0)), web.marker((0, 0, 0)), axis=Y)
    mech.revolute("pin", web.marker("pin"), rod.marker("root"), axis=Y)
    mech.revolute("wrist", rod.marker("tip"), end.marker("pin"), axis=Y)
    mech.prismatic("guide", mech.ground.marker((1.1, 0, 0)), end.marker("pin"), axis=(1, 0, 0))
    mech.drive("motor", "bearing", lambda t: speed * t * ramp(t, 0.1))
    return mech, 0.3


def four_bars(body):
    """The beam as coupler of four bars, driven at one side."""
    mech = rom.Mechanism()
    left = mech.add_rigid(
        "left", mass=1, inertia=(1e-2,) * 3, at=(0, 0, 0), markers={"pin": (0, 0, 0.2)}
    )
    rod = mech.add_flexible("rod", body, at=(0, 0, 0.2))
    right = mech.add_rigid(
        "right", mass=1, inertia=(2e-2,) * 3, at=(1, 0, -0.3), markers={"pin": (0, 0, 0.5)}
    )
    mech.revolute("one", mech.ground.marker((0, 0, 0)), left.marker((0, 0, 0)), axis=Y)
    mech.revolute("two", left.marker("pin"), rod.marker("root"), axis=Y)
    mech.revolute("three", rod.marker("tip"), right.marker("pin"), axis=Y)
    mech.revolute("four", mech.ground.marker((1, 0, -0.3)), right.marker((0, 0, 0)), axis=Y)
    mech.drive("motor", "one", lambda t: 50 * t * ramp(t, 0.1))
    return mech, 0.3


def arm(body, f=6.0, load=1.0, other=None):
    """Two beams, both joints driven, a load in the grip; no gravity that would begin at once."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    one = mech.add_flexible("one", body)
    two = mech.add_flexible("two", other or body, at=(1, 0, 0))
    held = mech.add_rigid("load", mass=load, inertia=(1e-3 * load,) * 3, at=(2, 0, 0))
    mech.revolute("shoulder", mech.ground.marker((0, 0, 0)), one.marker("root"), axis=Y)
    mech.revolute("elbow", one.marker("tip"), two.marker("root"), axis=Y)
    mech.fixed("grip", two.marker("tip"), held.marker((0, 0, 0)))
    mech.drive("first", "shoulder", lambda t: 0.2 * ramp(t, 1 / f) * np.sin(2 * np.pi * f * t))
    mech.drive("second", "elbow", lambda t: 0.3 * ramp(t, 1 / f) * np.sin(3.4 * np.pi * f * t))
    return mech, 0.4


def run_up(body, speed=80.0):
    """A shaft with a wheel beside its axis, brought to a speed below its critical one."""
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    shaft = mech.add_flexible("shaft", body)
    wheel = mech.add_rigid(
        "wheel", mass=1, inertia=(2e-3, 1e-3, 1e-3), at=(1, 0, 1e-3), markers={"hub": (0, 0, -1e-3)}
    )
    mech.revolute("bearing", mech.ground.marker((0, 0, 0)), shaft.marker("root"), axis=(1, 0, 0))
    mech.fixed("seat", shaft.marker("tip"), wheel.marker("hub"))
    mech.drive("motor", "bearing", lambda t: speed * t * ramp(t, 0.3))
    return mech, 0.5


def falling(body):
    """A beam held at its root whose free end falls on a plane."""
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    bar = mech.add_flexible("bar", body, omega=(0, 2.0, 0))
    mech.revolute("hinge", mech.ground.marker((0, 0, 0)), bar.marker("root"), axis=Y)
    law = rom.mbs.Impact(stiffness=2e6, restitution=0.5, impact_speed=2.0)
    mech.sphere_on_plane(
        "stop",
        mech.ground.marker((1, 0, -0.1)),
        bar.marker("tip"),
        law,
        normal=(0, 0, 1),
        radius=0.02,
    )
    return mech, 0.15


def housing(body):
    """A bracket carries the bearing of a driven pinion, in mesh with a wheel of some inertia."""
    pair, mech = GearPair((26, 40), 4e-3, 0.03), rom.Mechanism(gravity=(0, 0, 0))
    bracket, apart = mech.add_flexible("bracket", body), (1 + pair.distance, 0, 0)
    pinion = mech.add_rigid("pinion", mass=1, inertia=(1e-3,) * 3, at=(1, 0, 0))
    wheel = mech.add_rigid("wheel", mass=4, inertia=(2e-2,) * 3, at=apart)
    mech.fixed("foot", mech.ground.marker((0, 0, 0)), bracket.marker("root"))
    mech.revolute("seat", bracket.marker("tip"), pinion.marker((0, 0, 0)), axis=Y)
    mech.revolute("bearing", mech.ground.marker(apart), wheel.marker((0, 0, 0)), axis=Y)
    mech.torque("load", wheel.marker((0, 0, 0)), lambda t: (0, 200 * ramp(t, 0.1), 0))
    ends = pinion.marker((0, 0, 0)), wheel.marker((0, 0, 0))
    mech.gear_mesh("mesh", *ends, axis=Y, pair=pair, stiffness=1e10, damping=1e-5)
    mech.drive("motor", "seat", lambda t: 40 * t * ramp(t, 0.1))
    return mech, 0.2


MECHANISMS = {
    "slider-crank": crank, "four bars": four_bars, "robot arm": arm, "run-up": run_up,
    "impact": falling, "gear in a housing": housing,
}  # fmt: skip


def moved(build, body, dt=2e-4, **how):
    mech, t_end = build(body, **how)
    return rom.simulate(mech, t_end=t_end, dt=dt, rho_inf=0.8)


def flexible(motion):
    return [name for name, part in motion.mechanism.parts.items() if part.r]
