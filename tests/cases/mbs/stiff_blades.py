"""A blade of a turbine that does not bend, and the rotor of the strips of its vertices."""

import numpy as np

from rom.components import cosserat
from rom.components.wind.blade_element import strips
from rom.components.wind.blading import (
    ELEMENT_LENGTH,
    ELEMENT_PROFILE,
    ELEMENT_TWIST,
    RADIUS,
    Blading,
)
from rom.components.wind.profiles import profiles
from rom.components.wind.wind_turbine import blade


def stiff_body(n):
    """A blade of three hundred times its rigidity, as a body."""
    one = blade(n, damped=True)
    return cosserat.body(one._replace(stretch=300 * one.stretch, bend=300 * one.bend))


def on_driven_hub(mech, part, speed, axis=(1.0, 0.0, 0.0)):
    """A hub that turns about an axis of the world and carries the blade."""
    turning = speed * np.asarray(axis)
    hub = mech.add_rigid("hub", mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0), omega=turning)
    mech.revolute("shaft", mech.ground.marker((0, 0, 0)), hub.marker((0, 0, 0)), axis=axis)
    mech.drive("speed", "shaft", lambda t: speed * t, rate=lambda t: speed)
    root = mech.design_point(part.marker("start"))
    mech.fixed("root", hub.marker(root), part.marker("start"))


def same_strips(body, used=slice(None), *, tilt=0.0, cone=0.0):
    """A rotor of the strips of the vertices of a rod, or of some."""
    middles, length, chord, _ = (x[used] for x in strips(body))
    at = np.searchsorted(1.5 + np.cumsum(ELEMENT_LENGTH), middles)
    given = profiles()
    twist = np.radians(np.interp(middles, RADIUS, ELEMENT_TWIST))
    names = [ELEMENT_PROFILE[min(k, len(ELEMENT_PROFILE) - 1)] for k in at]
    return Blading(middles, length, chord, twist, tuple(given[x] for x in names), tilt=tilt,
                   cone=cone)  # fmt: skip
