"""Mechanisms whose motion several tests follow."""

import json

import numpy as np

from benchmarks.models import rigid_chain
from cases.beam import stiffened_beam
from cases.mbs.mechanisms import random_body, simulate_quietly, slider_crank
from cases.mbs.parts import X, turned
from cases.paths import TESTS
from rom.mbs.mechanism import Mechanism

G = 9.81
PARTS = ("t", "q", "v", "a", "lam", "base")
TOP = json.loads((TESTS / "reference" / "heavy_top.json").read_text())


def ball(height=1.0, speed=0.0):
    mech = Mechanism(gravity=(0, 0, -G))
    mech.add_rigid("ball", mass=2.0, inertia=(1, 1, 1), at=(0, 0, height), velocity=(0.3, 0, speed))
    return mech


def falling(terminal=True):
    mech = ball()
    mech.event("floor", lambda t, x: x.position("ball")[2], direction=-1, terminal=terminal)
    return mech


def pendulum(angle=1.2):
    """A ball of 1 kg and 0.1 kg m^2 on a massless rod of 1 m, held by a hinge."""
    mech = Mechanism(gravity=(0, -G, 0))
    at = np.array([np.sin(angle), -np.cos(angle), 0])
    solid = {"mass": 1.0, "inertia": (0.1,) * 3, "markers": {"pin": -at, "tip": (0, 0, 0)}}
    bob = mech.add_rigid("bob", at=at, **solid)
    mech.revolute("hinge", mech.ground.marker((0, 0, 0)), bob.marker("pin"), axis=(0, 0, 1))
    return mech


def sampled():
    """A block on a spring under a sampled controller, which adds up places and counts its calls."""
    mech = Mechanism(gravity=(0, 0, 0))
    mech.add_rigid("block", mass=2, inertia=(1, 1, 1), at=(0, 0, 0), velocity=(1, 0, 0))
    mech.prismatic("guide", "ground", "block", axis=(1, 0, 0))
    mech.spring_damper("spring", mech.ground.marker((-1, 0, 0)), "block", stiffness=300.0)

    def servo(t, parameters, motion, memory, out):
        x, v = motion.position[0, 0], motion.velocity[0, 0]
        out.memory[:] = memory[0] + x, memory[1] + 1
        out.force[0, 0] = -400 * (x - 0.3) - 12 * v - 0.5 * out.memory[0]

    mech.law("servo", servo, "block", memory=[0.0, 0.0], every=1e-2)
    return mech


def swing():
    """A flexible body on a ball joint, pulled by a load and by a law in Python."""
    mech = Mechanism()
    shapes, omega = random_body(np.random.default_rng(3)), (1.0, 2.0, 3.0)
    start = np.cross(shapes.markers["a"].point, omega)
    body = mech.add_flexible("one", shapes, omega=omega, velocity=start)
    place = mech.design_point(body.marker("a"))
    mech.spherical("hook", mech.ground.marker(place), body.marker("a"))
    mech.force("pull", body.marker("b"), lambda t: (0.3 * t**3, 0, np.sin(t)))
    mech.user_force("drag", lambda t, a: (-0.1 * a.velocity, (0, 0, 0)), body.marker("b"))
    return mech


def wound_drive():
    """A crank whose drive has no derivatives, whose joints repeat each other, and a coil."""
    mech = slider_crank()
    mech.drives.clear()
    mech.drive("motor", "main", lambda t: 50 * t + 0.3 * t**3)
    mech.rotational_spring("coil", "main", stiffness=2.0)
    return mech


def heavy_top():
    mech = Mechanism(gravity=(0, 0, -TOP["gravity"]))
    centre, omega = np.array(TOP["centre"]), np.array(TOP["omega"])
    solid = {"mass": TOP["mass"], "inertia": TOP["inertia"], "markers": {"tip": -centre}}
    moving = {"at": centre, "velocity": np.cross(omega, centre), "omega": omega}
    top = mech.add_rigid("top", **solid, **moving)
    mech.spherical("tip", mech.ground.marker((0, 0, 0)), top.marker("tip"))
    return mech


def free_crank():
    mech = slider_crank(gravity=G)
    mech.drives.clear()
    return mech


def four_links():
    """Whose equations are eliminated by blocks."""
    return rigid_chain(4)


def hub_and_panel(frame="root"):
    """A free hub that turns, and a panel on a hinge and a coil; its body is in the frame."""
    mech, z = Mechanism(gravity=(0, 0, 0)), (0, 0, 1)
    panel = stiffened_beam(2.0, EI=300.0, rhoA=2.0, n_modes=12, stiffened=False)
    hub = mech.add_rigid("hub", mass=2, inertia=(0.1,) * 3, at=(0, 0, 0), omega=(0, 0, 10.0))
    moving = {"velocity": (0, 3.0, 0), "omega": (0, 0, 3.0)}
    wing = mech.add_flexible("panel", panel.with_reference(frame), at=(0.3, 0, 0), **moving)
    mech.revolute("hinge", hub.marker((0.3, 0, 0)), wing.marker("root"), axis=z)
    mech.rotational_spring("coil", "hinge", stiffness=200.0)
    return mech


def flexible_four_bar(coupler, rocker, bend, angle):
    """A driven crank of 0.2 m, two beams and the ground, one of the joints a ball."""
    mech, z, fold = Mechanism(gravity=(0, -G, 0)), (0, 0, 1), turned(bend)
    L, M = (body.marker("tip").point[0] for body in (coupler, rocker))
    pins = {"o": (-0.1, 0, 0), "a": (0.1, 0, 0)}
    crank = mech.add_rigid("crank", mass=1, inertia=(0.01,) * 3, at=(0.1, 0, 0), markers=pins)
    one = mech.add_flexible("coupler", coupler, at=0.2 * X)
    two = mech.add_flexible("rocker", rocker, at=(0.2 + L) * X, orientation=fold)
    feet = mech.ground.marker((0, 0, 0)), mech.ground.marker((0.2 + L) * X + M * fold @ X)
    mech.revolute("main", feet[0], crank.marker("o"), axis=z)
    mech.revolute("pin", crank.marker("a"), one.marker("root"), axis=z)
    mech.spherical("wrist", one.marker("tip"), two.marker("root"))
    mech.revolute("foot", feet[1], two.marker("tip"), axis=z)
    mech.drive("motor", "main", angle)
    return mech


def errors(sol, exact, names=("q", "v", "a", "lam")):
    return [np.abs(getattr(sol, x) - getattr(exact, x)).max() for x in names]


def order_of(build, t_end, steps, exact, options):
    """Order of a method in the errors of steps of two lengths, at ten instants that are exact."""
    table = []
    for h in steps:
        every = round(t_end / 10 / h)
        sol = simulate_quietly(build(), t_end=t_end, dt=h, save_every=every, **options)
        table.append(errors(sol, exact))
    return np.log2(np.array(table[0]) / table[1])
