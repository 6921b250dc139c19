"""Mechanisms as plain data, so that two programs build the same one.

A mechanism is a dictionary that JSON can hold:

- ``gravity``: (3,) [m/s^2];
- ``bodies``: {name: {at, velocity, omega}} with the pose and the velocities of the body frame at
  the start, axes parallel to the world. A rigid body also has mass, inertia (3,) and markers
  {name: (3,)} from its mass centre; a body without them is the flexible one of the body file;
- ``joints``: [name, kind, (body, marker), (body, marker), axis], where the body "ground" has a
  point instead of a marker;
- ``watch``: (body, marker) whose path is compared.

No joint is redundant: other programs do not solve such equations.
"""

from typing import Any

import numpy as np

from rom.body.flexible import FlexibleBody
from rom.mbs.mechanism import Mechanism
from rom.model import Array

Described = dict[str, Any]
X, Y, Z, ORIGIN = [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]


def pendulum(body: FlexibleBody, gravity: float = 9.81, spin: float = 0.0) -> Described:
    """A bar along x on a ball joint, released level; spin [rad/s] about the vertical y."""
    link = _link(body, ORIGIN)
    root = body.markers["root"].point
    link["omega"] = [0.0, spin, 0.0]
    link["velocity"] = [-spin * root[2], 0.0, spin * root[0]]
    return {
        "gravity": [0.0, -gravity, 0.0],
        "bodies": {"bar 0": link},
        "joints": [["hook", "spherical", ["ground", ORIGIN], ["bar 0", "root"], None]],
        "watch": ["bar 0", "tip"],
    }


def chain(body: FlexibleBody, links: int, gravity: float = 9.81) -> Described:
    """Equal bars on hinges about z, released level."""
    reach = _span(body)
    names = [f"bar {k}" for k in range(links)]
    ends = [["ground", ORIGIN], *([name, "tip"] for name in names[:-1])]
    return {
        "gravity": [0.0, -gravity, 0.0],
        "bodies": {name: _link(body, (k * reach).tolist()) for k, name in enumerate(names)},
        "joints": [
            [f"hinge {k}", "revolute", end, [name, "root"], Z]
            for k, (end, name) in enumerate(zip(ends, names, strict=True))
        ],
        "watch": [names[-1], "tip"],
    }


def slider_crank(
    body: FlexibleBody, radius: float, speed: float, masses: tuple[float, float] = (1.0, 0.3)
) -> Described:
    """A bar as the rod of a free-running crank; no drive, so that no program calls Python.

    Args:
        body: the rod.
        radius: of the crank [m].
        speed: of the crank at the start [rad/s].
        masses: of crank and slider [kg].
    """
    reach, (heavy, light) = _span(body), masses
    rod, pin, spin = _link(body, [radius, 0.0, 0.0]), [0.0, speed * radius, 0.0], -speed * radius
    root = body.markers["root"].point
    turn = spin / float(reach[0])  # the small end does not go sideways
    rod["velocity"] = [turn * root[1], pin[1] - turn * root[0], 0.0]
    rod["omega"] = [0.0, 0.0, turn]
    crank = _rigid(heavy, radius, ORIGIN, {"o": ORIGIN, "pin": [radius, 0.0, 0.0]})
    crank["omega"] = [0.0, 0.0, speed]
    end = (np.array([radius, 0.0, 0.0]) + reach).tolist()
    slider = _rigid(light, radius, end, {"o": ORIGIN})
    slider["velocity"] = [-turn * float(reach[1]), 0.0, 0.0]
    return {
        "gravity": [0.0, -9.81, 0.0],
        "bodies": {"crank": crank, "rod": rod, "slider": slider},
        "joints": [
            ["main", "revolute", ["ground", ORIGIN], ["crank", "o"], Z],
            ["crank pin", "revolute", ["crank", "pin"], ["rod", "root"], Z],
            ["wrist pin", "point_on_line", ["slider", "o"], ["rod", "tip"], Z],
            ["guide", "prismatic", ["ground", end], ["slider", "o"], X],
        ],
        "watch": ["slider", "o"],
    }


def built(described: Described, body: FlexibleBody) -> Mechanism:
    """The mechanism for `rom.mbs.integrate.simulation.simulate`."""
    mech = Mechanism(gravity=described["gravity"])
    parts: dict[str, Any] = {"ground": mech.ground}
    for name, data in described["bodies"].items():
        if "mass" in data:
            parts[name] = mech.add_rigid(name, **data)
        else:
            parts[name] = mech.add_flexible(name, body, **data)
    for name, kind, *ends, axis in described["joints"]:
        markers = [parts[part].marker(place) for part, place in ends]
        getattr(mech, kind)(name, *markers, **({} if axis is None else {"axis": axis}))
    return mech


def _rigid(
    mass: float, radius: float, at: list[float], markers: dict[str, list[float]]
) -> dict[str, Any]:
    """A rigid body at rest with the inertia of a wheel of that radius about any axis."""
    still = {"velocity": ORIGIN, "omega": ORIGIN}
    return {
        "mass": mass,
        "inertia": [mass * radius**2 / 2] * 3,
        "at": at,
        "markers": markers,
    } | still


def _link(body: FlexibleBody, start: list[float]) -> dict[str, Any]:
    """A bar at rest whose root is at ``start``."""
    at = start - body.markers["root"].point
    return {"at": at.tolist(), "velocity": ORIGIN, "omega": ORIGIN}


def _span(body: FlexibleBody) -> Array:
    """(3,) from the root to the tip."""
    return body.markers["tip"].point - body.markers["root"].point
