"""A hub from a geometry, meshed and reduced, in the turbine."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.paths import ROOT
from cases.refusals import refuses
from rom.components.wind.whole_turbine import turbine
from rom.errors import ConfigError

pytestmark = pytest.mark.fenicsx
RINGS = {name: "rbe2" for name in ("shaft", "blade_1", "blade_2", "blade_3")}


@cache
def hub(E=169e9, rho=7100.0):
    iron = rom.Material(E=E, nu=0.275, rho=rho)
    drawing, options = ROOT / "meshes" / "turbine_hub.geo", {"degree": 1, "parameters": {"lc": 0.7}}
    model = rom.fe.model(drawing, material=iron, **options)
    options = {"interfaces": RINGS, "reference": "shaft", "name": "hub", "certify": False}
    return rom.reduce(model, method=rom.CraigBampton(4), **options)


def frequencies(**choices):
    parked = turbine(8, tower_segments=6, damped=False, **choices)
    parked.turn_by(lambda t: 0.0, lambda t: 0.0)
    return rom.linearize(parked.mechanism, rom.equilibrium(parked.mechanism), n=10).frequencies


def test_rings_are_where_the_blades_and_the_shaft_end():
    markers, c, s = hub().markers, np.cos(np.radians(2.5)), np.sin(np.radians(2.5))
    for k in range(3):
        a = 2 * np.pi / 3 * k
        there = 1.5 * np.array([-s, -c * np.sin(a), c * np.cos(a)])
        assert_allclose(markers[f"blade_{k + 1}"].point, there, atol=5e-3)
    assert_allclose(markers["shaft"].point, [1.95, 0.0, 0.0], atol=1e-6)


def test_a_stiff_solid_is_the_rigid_hub_and_a_real_one_gives_way():
    bodies = {}, {"hub_body": hub(E=169e13)}, {"hub_body": hub()}
    rigid, stiff, iron = (frequencies(**choices) for choices in bodies)
    assert_allclose(stiff, rigid, rtol=2e-3)
    assert (iron < stiff).all()
    assert_allclose(iron, rigid, rtol=6e-3)
    parts = turbine(4, tower_segments=0, hub_body=hub()).mechanism.parts
    assert_allclose(parts["hub"].mass + parts["in the hub"].mass, 56_780.0)
    second = parts["hub"].second + parts["in the hub"].second
    assert_allclose(second[1, 1] + second[2, 2], 115_926.0)


def test_a_solid_that_is_no_hub_is_named():
    refuses(ConfigError, r"has 1\d+ kg .* 56780", lambda: turbine(4, hub_body=hub(rho=25_000.0)))
    few = replace(hub(), markers={k: v for k, v in hub().markers.items() if k != "blade_2"})
    refuses(ConfigError, r"'hub' needs the interfaces \['blade_2'\]", turbine, 4, hub_body=few)
