"""Stiffness of teeth in a mechanism, as wheels turn against each other under a torque."""

import numpy as np
import pytest

import rom
from cases.mbs.parts import on_axle
from rom.components.gear_mesh import GearPair, bending_table, stiffness_table

Z = (0, 0, 1)
LOAD = 3e5  # along the line of action, over the face [N/m]


def stiffness(pair, phase, law):
    """Force along the line of action over the approach of the teeth and the face [N/m^2].

    The gear is held, the pinion turns on its axle under a torque.
    """
    mech = rom.Mechanism(gravity=(0, 0, 0))
    pinion = on_axle(mech, "pinion", inertia=(1e-3,) * 3)
    ends = pinion, mech.ground.marker((pair.distance, 0, 0))
    mech.gear_mesh("mesh", *ends, axis=Z, pair=pair, phase=phase, entry=0.0, conservative=False,
                   **law)  # fmt: skip
    force = LOAD * pair.width
    mech.torque("load", pinion, (0, 0, force * pair.rb[0]))
    state = rom.equilibrium(mech)
    approach = pair.rb[0] * rom.mbs.snapshot(mech, state).joint("axle").angle[0]
    return force / approach / pair.width


def pair_of(degrees, width):
    return GearPair((50, 50), 3e-3, width, float(np.radians(degrees)))


@pytest.mark.parametrize("contact", ["linear", "hertz"])
def test_a_pair_of_teeth_softens_with_its_helix_as_in_iso_6336(contact):
    """c' is 14.1, 13.8 and 12.8 N/(mm um) at 0, 15 and 30 degrees; here spur teeth are the unit.

    The face is so narrow that one line bears over the whole of it at the pitch point.
    """
    found = []
    for degrees in (0, 15, 30):
        pair = pair_of(degrees, 4e-3)
        law = {"stiffness": stiffness_table(pair, force=LOAD)}
        if contact == "hertz":
            law = dict(zip(("stiffness", "hertz"), bending_table(pair), strict=True))
        found.append(stiffness(pair, pair.pitch_point / pair.rb[0], law))
    wanted = np.array([14.1, 13.8, 12.8])
    assert 14.1 / found[0] * np.array(found) == pytest.approx(wanted, rel=0.04)
    assert found[0] > 1.01 * found[1] > 1.05 * found[2]


def test_the_mean_over_a_mesh_falls_with_the_helix_as_in_iso_6336():
    """c_gamma is 22.0, 20.7 and 16.8; lines that overlap by one pitch bear evenly all the time."""
    found = []
    for degrees in (0, 15, 30):
        pair = pair_of(degrees, 0.02)
        if degrees:
            pair = pair_of(degrees, float(pair.base_pitch / np.tan(pair.base_helix)))
        law = {"stiffness": stiffness_table(pair, force=LOAD), "cells": 100}
        phases = pair.base_pitch / pair.rb[0] * (np.arange(8) + 0.37) / 8
        each = np.array([stiffness(pair, phase, law) for phase in phases])
        assert (np.ptp(each) < 1e-6 * each.mean()) == (degrees > 0)
        found.append(each.mean())
    assert 22.0 / found[0] * np.array(found) == pytest.approx([22.0, 20.7, 16.8], rel=0.02)
