"""A wheel as one body: the wheel meshed whole and reduced, and the waves of its sector."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.long import MESHED
from cases.refusals import refuses
from cases.wheels import bladed_mesh, bladed_model, model_of
from rom.errors import ConfigError, InterfaceError

N, SPEED, SHIFT = 6, 900.0, np.array([0.3, -0.2, 0.1])
SIZES = {"cells": (2, 1, 2, 1), "blade": (0, 1)}  # lopsided: no plane of symmetry
pytestmark = [pytest.mark.fenicsx, *MESHED]


@cache
def made(shift=False, sectors=1):
    if not shift:
        return bladed_model(N, sectors, degree=1, **SIZES)
    mesh = bladed_mesh(N, sectors, **SIZES)
    return model_of(replace(mesh, points=mesh.points + SHIFT), degree=1)


@cache
def sector_of(shift=False):
    at = SHIFT if shift else np.zeros(3)
    sector = rom.CyclicSector.from_model(made(shift), fixed=("bore",), at=at)
    return rom.rotating_sector(sector, made(shift))


@cache
def all_modes(shift=False):
    """The body with every mode of the sector."""
    return rom.wheel_body(sector_of(shift), made(shift), sector_of(shift).free.size)


@cache
def in_one_piece(shift=False):
    """The whole wheel meshed, its bore rigid, with every fixed-interface mode."""
    model = made(shift, N)
    inner = model.n_dofs - model.interfaces["bore"].dofs.size
    how = {"interfaces": {"bore": "rbe2"}, "reference": "bore", "certify": False}
    return rom.reduce(model, method=rom.CraigBampton(inner), **how)


@pytest.mark.parametrize("shift", [False, True])
def test_with_every_mode_it_is_the_wheel_in_one_piece(shift):
    """Integrals of repeated modes turn with them; compared is what the turns leave alone."""
    found, expected = all_modes(shift), in_one_piece(shift)
    assert_allclose(found.mass, expected.mass, rtol=1e-10)
    assert_allclose(found.first_moment, expected.first_moment, atol=1e-10 * found.mass)
    assert_allclose(found.inertia, expected.inertia, atol=1e-10 * found.inertia.max())
    for fixed in ((), ("bore",)):
        known = expected.frequencies(40, fixed=fixed)
        assert_allclose(found.frequencies(40, fixed=fixed), known, rtol=1e-7, atol=1e-5)
    assert_allclose(found.marker("bore").point, SHIFT if shift else 0, atol=1e-12)
    for name in ("S", "Ibar_kl", "S_kl"):
        grams = []
        for body in (found, expected):
            axes = 9 if name != "S" else 3
            each = getattr(body, name).reshape(axes, -1)
            grams.append(each @ each.T)
        assert_allclose(*grams, atol=1e-9 * grams[1].max())
    traces = [np.einsum("abkk->ab", b.S_kl) for b in (found, expected)]
    assert_allclose(*traces, atol=1e-9 * found.n_modes)


@pytest.mark.parametrize("shift", [False, True])
def test_it_turns_with_the_waves_of_its_sector(shift):
    """Coriolis forces, softening and stiffening; of a reduced sector with all that it has."""
    small = rom.reduce_sector(sector_of(shift), n_modes=3, functions=rom.Polynomial(1))
    body = rom.wheel_body(small, made(shift), small.free.size)
    assert body.n_modes == N * small.free.size and body.K_geo.keys() == {"omega_z^2"}
    at = SHIFT if shift else np.zeros(3)
    found = body.rotating_frequencies(SPEED, (0, 0, 1), fixed=("bore",), at=at)
    exact = [rom.travelling_modes(small, d, 4, speed=SPEED).frequencies for d in small.diameters]
    exact = np.sort(np.concatenate(exact))[:12]
    assert_allclose(found[:12], exact, rtol=1e-8)
    still = body.frequencies(fixed=("bore",))[:12]
    assert abs(found[:12] / still - 1).max() > 1e-3


def test_a_few_modes_hold_the_lowest_frequencies_and_the_surface_is_closed():
    body = rom.wheel_body(sector_of(), made(), 6, name="rotor")
    assert body.name == "rotor" and body.n_modes == 6 * N and body.certificate.ok
    exact = in_one_piece().frequencies(12)
    assert_allclose(body.frequencies(12)[6:], exact[6:], rtol=0.03)
    assert (body.frequencies(12)[6:] >= exact[6:] * (1 - 1e-9)).all()
    assert_allclose(body.omega, np.sort(body.omega))
    sizes = [b.surface_areas().sum() for b in (body, in_one_piece())]
    assert_allclose(*sizes, rtol=1e-9)
    shape = body.surface.shape.reshape(-1, 3, body.n_modes)
    known = in_one_piece().surface
    place = {tuple(x): k for k, x in enumerate(known.points.round(7) + 0.0)}
    met = [place[tuple(x)] for x in body.surface.points.round(7) + 0.0]
    assert len(set(met)) == len(known.points)
    first = np.full(len(known.points), -1)
    first[met] = np.arange(len(met))
    assert_allclose(shape, shape[first[met]], atol=1e-7 * np.abs(shape).max())  # sectors meet
    other = rom.wheel_body(sector_of(), made(), 2, diameters=(0, 1)).labels
    assert len(other) == 6 and other[0].startswith("mode 1, ")


def test_a_wheel_that_a_drive_turns_in_a_mechanism_has_these_waves():
    body = rom.wheel_body(sector_of(), made(), 1)
    mech = rom.Mechanism(gravity=(0, 0, 0))
    part = mech.add_flexible("wheel", body, omega=(0, 0, SPEED))
    mech.revolute("shaft", mech.ground.marker((0, 0, 0)), part.marker("bore"), axis=(0, 0, 1))
    mech.drive("motor", "shaft", lambda t: SPEED * t)
    found = rom.linearize(mech, rom.equilibrium(mech, spin=(0, 0, SPEED))).frequencies
    assert_allclose(found, body.rotating_frequencies(SPEED, (0, 0, 1), fixed=("bore",)), rtol=1e-6)


def test_what_is_no_wheel_on_a_hub_is_refused():
    model, free = made(), rom.CyclicSector.from_model(made())
    for sector, words in (
        (free, "held at 'bore' alone"),
        (
            rom.supported_sector(sector_of(), model.interfaces["bore"], across=1e6),
            "without springs",
        ),
        (replace(sector_of(), points=None), "needs the model its sector"),
    ):
        refuses(ConfigError, words, rom.wheel_body, sector, model, 2)
    refuses(InterfaceError, "no interface 'hub'", rom.wheel_body, sector_of(), model, 2, hub="hub")
    heavy = replace(model, attachments=(rom.Attachment("bore", 1.0),))
    refuses(ConfigError, "carries 1 attachments", rom.wheel_body, sector_of(), heavy, 2)
