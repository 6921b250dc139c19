"""Trains of two stages on soft bearings: frequencies of a lumped model, ratio, torque."""

import numpy as np
from numpy.testing import assert_allclose
from scipy.linalg import eigh

import rom
from rom.components.gear_mesh import GearPair

K, Z = 12e9, np.array([0.0, 0.0, 1.0])
ONE = GearPair((23, 61), 2.5e-3, 0.03, helix=0.3)
TWO = GearPair((19, 58), 4e-3, 0.05)
FOLDED = np.radians(115)  # between the planes of the stages
MESHES = (  # wheels, pair, phase at which lines lie inside their paths, axis, shafts
    ("one", ONE, 0.4, Z, "input", "middle"),
    ("two", TWO, 0.33, -Z, "middle", "output"),
)
# mass, moments across and about the axis, heights of the wheels and of both bearings
SHAFTS = {
    "input": (2.0, 6e-3, 1.5e-3, {"one": 0.01}, (-0.06, 0.08)),
    "middle": (5.0, 2e-2, 1.2e-2, {"one": 0.02, "two": -0.045}, (-0.09, 0.07)),
    "output": (21.0, 9e-2, 1.5e-1, {"two": -0.03}, (-0.07, 0.09)),
}
BEARING = np.array([2e8, 1.2e8, 4e7])
COUPLING, TORQUE, STRIPS = 4e3, 0.02, 4000
RATIO = 61 * 58 / (23 * 19)


def centres():
    """(3,) mass centres of the shafts, so that the faces of each pair are at one height."""
    middle = np.array([ONE.distance, 0.0, SHAFTS["input"][3]["one"] - SHAFTS["middle"][3]["one"]])
    way = np.array([np.cos(FOLDED), np.sin(FOLDED), 0.0])
    height = SHAFTS["middle"][3]["two"] - SHAFTS["output"][3]["two"]
    return {"input": np.zeros(3), "middle": middle,
            "output": middle + TWO.distance * way + height * Z}  # fmt: skip


def approach(pair, phase, axis, line):
    """Stiffness (m,) and rows V (m, 12) of strips of all lines: how both wheels come together."""
    c, rb, alpha = line, pair.rb[0], pair.alpha
    t, slant = np.cross(axis, c), np.tan(pair.base_helix)
    along = np.sin(alpha) * c + np.cos(alpha) * t
    n = np.cos(pair.base_helix) * along - np.sin(pair.base_helix) * axis
    z = pair.width * ((np.arange(STRIPS) + 0.5) / STRIPS - 0.5)
    x = rb * phase + np.arange(-9, 9)[:, None] * pair.base_pitch + slant * z
    inside = (pair.path[0] <= x) & (x < pair.path[1])
    foot = rb * (np.cos(alpha) * c - np.sin(alpha) * t)
    arm = foot + x[inside][:, None] * along + np.tile(z, (18, 1))[inside][:, None] * axis
    far, e = arm - pair.distance * c, np.broadcast_to(n, arm.shape)
    rows = np.hstack([e, np.cross(arm, n), -e, -np.cross(far, n)])
    return np.full(len(rows), K * pair.width / STRIPS * np.hypot(1, slant)), rows


def lumped():
    """Frequencies [Hz] of three rigid shafts with six coordinates each, teeth as they touch."""
    at, names = centres(), list(SHAFTS)
    M, S, load = np.zeros(18), np.zeros((18, 18)), np.zeros(18)

    def motion(name, z):
        """(6, 18) motion of a point of the axis and rotation."""
        found, k = np.zeros((6, 18)), 6 * names.index(name)
        found[:3, k : k + 3] = found[3:, k + 3 : k + 6] = np.eye(3)
        found[0, k + 4], found[1, k + 3] = z, -z
        return found

    for k, (mass, across, about, _, bearings) in enumerate(SHAFTS.values()):
        M[6 * k : 6 * k + 6] = mass, mass, mass, across, across, about
        for z in bearings:
            rows = motion(names[k], z)[:3]
            S += rows.T @ np.diag(BEARING) @ rows
    S[5, 5] += COUPLING
    load[17] = -RATIO * TORQUE
    springs, strips = [], []
    for wheel, pair, phase, axis, pinion, gear in MESHES:
        heights = (SHAFTS[name][3][wheel] for name in (pinion, gear))
        both = np.vstack([motion(*x) for x in zip((pinion, gear), heights, strict=True)])
        gap = at[gear] - at[pinion]
        k, rows = approach(pair, phase, axis, (gap - gap @ Z * Z) / pair.distance)
        springs.append(k), strips.append(rows @ both)
    k, V = np.concatenate(springs), np.vstack(strips)
    touch, before = np.ones(len(k), dtype=bool), None
    while before is None or (touch != before).any():
        before, whole = touch, S + (V[touch].T * k[touch]) @ V[touch]
        touch = V @ np.linalg.solve(whole, load) > 0
    lam = eigh(whole, np.diag(M), eigvals_only=True)
    return np.sqrt(np.maximum(lam, 0.0)) / (2 * np.pi)


def test_two_stages_vibrate_as_a_lumped_model():
    """All 18 motions in space, of helical and spur teeth on stages that are folded."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    for name, at in centres().items():
        mass, across, about, wheels, bearings = SHAFTS[name]
        points = {wheel: (0, 0, z) for wheel, z in wheels.items()}
        points |= {f"bearing {k}": (0, 0, z) for k, z in enumerate(bearings)}
        inertia = across, across, about
        mech.add_rigid(name, mass=mass, inertia=inertia, at=at, markers=points)
        for k, z in enumerate(bearings):
            ends = mech.ground.marker(at + z * Z), f"{name}.bearing {k}"
            mech.bushing(f"{name} {k}", *ends, stiffness=(*BEARING, 0, 0, 0))
    law = {"stiffness": K, "entry": 0.0, "cells": 40}
    for name, pair, phase, axis, *shafts in MESHES:
        ends = (f"{shaft}.{name}" for shaft in shafts)
        mech.gear_mesh(name, *ends, axis=axis, pair=pair, phase=phase, **law)
    mech.bushing("coupling", "ground", "input", stiffness=(0, 0, 0, 0, 0, COUPLING))
    mech.torque("load", "output.two", (0, 0, -RATIO * TORQUE))
    found = np.sort(rom.linearize(mech, rom.equilibrium(mech)).frequencies)
    assert_allclose(found, lumped(), rtol=5e-5)
