"""Mechanisms with parameters to fit, where other processes can import them, and closed forms."""

import numpy as np

import rom


def oscillator(stiffness=200.0, damping=1.0, mass=1.5, idle=0.0, coulomb=0.0):
    """A mass on a guide, let go 0.1 m beside the place where its spring rests."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_rigid("mass", mass, (1e-3,) * 3, (0.3, 0, 0), markers={"p": (0, 0, 0)})
    mech.prismatic("guide", "ground", "mass.p", axis=(1, 0, 0))
    ends, law = (mech.ground.marker((0, 0, 0)), "mass.p"), {"stiffness": stiffness}
    mech.spring_damper("spring", *ends, **law, damping=damping, free_length=0.2)
    if coulomb:
        mech.friction("pad", "guide", transition_speed=1e-3, coulomb=coulomb)
    return mech


def free(mass, idle, stiffness):
    """The same without damping, and with a parameter that does nothing."""
    return oscillator(stiffness, 0.0, mass, idle)


def weak(stiffness):
    """The same, refused from a stiffness on."""
    if stiffness > 250.0:
        raise rom.ModelError("it breaks")
    return oscillator(stiffness)


def place(t, k, c, m=1.5):
    """(n,) of the mass at times (n,), by the closed form."""
    d = c / (2 * m)
    w = np.sqrt(k / m - d * d)
    return 0.2 + 0.1 * np.exp(-d * t) * (np.cos(w * t) + d / w * np.sin(w * t))


def rubbed(t, k, coulomb, m=1.5):
    """(n,) with dry friction alone: half waves about middles that change sides, while it moves."""
    w = np.sqrt(k / m)
    half, slip = (w * t / np.pi).astype(int), coulomb / k
    size = 0.1 - (2 * half + 1) * slip
    assert (size > 0).all()
    return 0.2 + (-1.0) ** half * slip + size * np.cos(w * t)


def crank(stiffness, damping, mass):
    """A slider-crank on a spring and a damper at its slider, let go with the crank upright."""
    mech, (l1, l2), z = rom.Mechanism(gravity=(0, -9.81, 0)), (0.1, 0.3), (0, 0, 1)
    solid = {"mass": 1.0, "inertia": (1e-3, 1e-3, 2e-3), "at": (0, 0, 0)}
    mech.add_rigid("crank", **solid, markers={"o": (0, 0, 0), "a": (0, l1, 0)})
    cos, sin = np.sqrt(1 - (l1 / l2) ** 2), -l1 / l2
    turned = {"at": (l2 / 2 * cos, l1 / 2, 0), "orientation": [[cos, -sin, 0], [sin, cos, 0], z]}
    ends = {"a": (-l2 / 2, 0, 0), "b": (l2 / 2, 0, 0)}
    mech.add_rigid("rod", mass=0.5, inertia=(1e-4, 4e-3, 4e-3), markers=ends, **turned)
    solid = {"mass": mass, "inertia": (1e-4,) * 3, "at": (l2 * cos, 0, 0)}
    mech.add_rigid("slider", **solid, markers={"b": (0, 0, 0)})
    mech.revolute("main", "ground", "crank.o", axis=z)
    mech.revolute("pin", "crank.a", "rod.a", axis=z)
    mech.revolute("wrist", "rod.b", "slider.b", axis=z)
    mech.prismatic("guide", "ground", "slider.b", axis=(1, 0, 0))
    law = {"stiffness": stiffness, "damping": damping, "free_length": 0.35}
    mech.spring_damper("spring", mech.ground.marker((0.7, 0, 0)), "slider.b", **law)
    return mech
