"""Supports that hold some directions: roots of beams, halves of symmetric bodies, loose ones."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh
from scipy.optimize import brentq

import rom
from cases.beam import N, gauss_hermite, hermite_beam
from cases.paths import ROOT
from cases.refusals import refuses
from cases.solid import KINDS, reduced
from rom.eigen.supports import supports
from rom.errors import ConfigError, InterfaceError
from rom.prestress import held_solid

X, _, Z = np.eye(3)
pytestmark = pytest.mark.fenicsx
STEEL = rom.Material(E=210e9, nu=0.0, rho=7850.0)
L, B, H = 1.0, 0.03, 0.02
UNIT = np.sqrt(210e9 * H**2 / 12 / 7850.0) / L**2 / (2 * np.pi)  # sqrt(EI / m) / L^2, bent along z
PIN, GUIDE = "rx rz", "rx ry rz"  # rotations held
ROOTS = {  # at the root, at the tip, (k L)^2 of the lowest bending along z
    "clamped, pinned": ("xyz" + GUIDE, "yz" + PIN, 3.926602**2),
    "clamped, guided": ("xyz" + GUIDE, "y" + GUIDE, 2.365020**2),
    "pinned, pinned": ("xyz" + PIN, "yz" + PIN, np.pi**2),
    "pinned, guided": ("xyz" + PIN, "y" + GUIDE, np.pi**2 / 4),
}


def beam(length=L, nx=20):
    return rom.fe.model(
        ROOT / "meshes" / "beam.geo", material=STEEL, degree=2,
        parameters={"L": length, "b": B, "h": H, "hex": 1, "nx": nx, "ny": 1, "nz": 1},
    )  # fmt: skip


@pytest.fixture(scope="module")
def model():
    return beam()


@pytest.fixture(scope="module")
def body(model):
    return reduced(12, model)


@pytest.mark.parametrize("name", ROOTS)
def test_beams_have_the_roots_of_their_ends_whole_and_reduced(name, model, body):
    root, tip, factor = ROOTS[name]
    fixed = {"root": root, "tip": tip}
    found = rom.modes(model, 4, fixed=fixed, interfaces=KINDS)
    sizes = np.linalg.norm(found.shapes.reshape(-1, 3, 4), axis=0)
    k = np.argmax(sizes[2] > 10 * sizes[1])  # the first mode that bends along z
    assert_allclose(found.frequencies[k], factor * UNIT, rtol=2e-3)  # and shear of slender beams
    assert_allclose(body.frequencies(4, fixed=fixed), found.frequencies, rtol=5e-4)
    words = tuple(f"{end}:{held}" for end, held in fixed.items())
    assert np.array_equal(body.frequencies(4, fixed=words), body.frequencies(4, fixed=fixed))
    moved = body.with_reference("root")
    assert_allclose(moved.frequencies(4, fixed=fixed), body.frequencies(4, fixed=fixed), rtol=1e-9)


def test_halves_on_planes_of_symmetry_have_the_modes_of_the_whole(model):
    """Normal displacement zero for the symmetric half, tangential for the other."""
    whole = rom.modes(model, 10, fixed=("root", "tip")).frequencies
    half = beam(L / 2, nx=10)
    parts = [rom.modes(half, 7, fixed={"root": "xyz", "tip": held}).frequencies
             for held in ("x", "yz")]  # fmt: skip
    assert_allclose(np.sort(np.concatenate(parts))[:10], whole, rtol=1e-9)


def test_a_body_that_stays_loose_is_refused_whole_and_has_zeros_reduced(model, body):
    guides, hinge = {"root": "xy" + GUIDE, "tip": "y" + GUIDE}, {"tip": "xyz" + PIN}
    for fixed, said in (
        (guides, r"leave 1 of six motions .* slides along \(0, 0, 1\)"),
        (hinge, r"turns about \(0, 1, 0\) through \(1, 0, 0\) m"),
        ({"root": "xy" + PIN}, r"leave 2 of six .* slides along \(0, 0, 1\)"),
        ({"tip": "yz"}, "leave 4 of six motions"),
    ):
        kinds = {name: "rbe2" for name in fixed}
        refuses(InterfaceError, said, rom.modes, model, 3, fixed=fixed, interfaces=kinds)
    f = body.frequencies(3, fixed=guides)
    assert f[0] == 0.0 < f[1]
    assert np.count_nonzero(body.frequencies(8, fixed=hinge) == 0.0) == 1


def test_rotating_and_parametric_bodies_take_the_same_supports(model, body):
    fixed = {"root": "xyz" + GUIDE, "tip": "yz" + PIN}
    still = body.rotating_frequencies(0.0, (0, 0, 1), fixed=fixed)
    assert_allclose(still[:6], body.frequencies(6, fixed=fixed), rtol=1e-7)
    with pytest.raises(ConfigError, match="'root' is held in part"):
        body.rotating_frequencies(10.0, (0, 0, 1), fixed={"root": "xyz"})
    family = rom.reduce_parametric(
        model, parameters={"E": rom.YoungsModulus(None, 0.5, 2.0)}, method=rom.CraigBampton(12),
        interfaces=KINDS, certify=False,
    )  # fmt: skip
    for E in (0.5, 2.0):
        f = family.frequencies(6, fixed=fixed, E=E)
        assert_allclose(f, np.sqrt(E) * body.frequencies(6, fixed=fixed), rtol=1e-6)


@pytest.mark.parametrize(("tip", "tension"), [("yz" + GUIDE, 1.0), ("xyz" + GUIDE, 1 / 3)])
def test_a_beam_between_supports_that_turn_is_pulled_by_what_they_carry(model, tip, tension):
    """Flapping: N(x) = m W^2 (tension L^2 - x^2) / 2, with a tip that slides or is held."""
    body = reduced(12, model, stiffening=True, reference="root")
    square = 200.0  # of W, times m L^4 / EI
    speed = np.sqrt(square) * 2 * np.pi * UNIT
    K, M = hermite_beam()
    x, weight, _, slopes = gauss_hermite(N, 1.0)
    K = K + square * (slopes.T * (weight * (tension - x**2) / 2)) @ slopes
    inner = slice(2, -2)
    exact = np.sqrt(eigh(K[inner, inner], M[inner, inner], eigvals_only=True)[0]) * UNIT
    fixed = {"root": "xyz" + GUIDE, "tip": tip}
    found = body.rotating_frequencies(speed, (0, 0, 1), fixed=fixed, at=body.marker("root").point)
    assert np.abs(found / exact - 1).min() < 3e-3


def test_solids_that_turn_or_are_heated_take_them_too(model):
    held = held_solid(model, fixed={"root": "xyz", "tip": "yz"}).held
    tip = model.interfaces["tip"].dofs
    assert set(held) == set(model.interfaces["root"].dofs) | set(tip[tip % 3 != 0])
    expands = rom.heated(model, rom.Heat(1e-5, 100.0), fixed={"root": "xyz", "tip": "yz"})
    tight = rom.heated(model, rom.Heat(1e-5, 100.0), fixed=("root", "tip"))
    free, pressed = (rom.modes(x, 1, fixed=("root", "tip")).omega[0] for x in (expands, tight))
    assert pressed < 0.97 * free


@pytest.mark.parametrize("stiffness", [0.5, 3.0, 30.0, 1e6])
def test_a_spring_at_the_tip_of_a_clamped_beam(model, body, stiffness):
    """b^3 (1 + cos b cosh b) + s (sin b cosh b - cos b sinh b) = 0 across, b cot b + s = 0."""
    EI, EA = 210e9 * B * H**3 / 12, 210e9 * B * H

    def bent(b):
        support = np.sin(b) * np.cosh(b) - np.cos(b) * np.sinh(b)
        return b**3 * (1 + np.cos(b) * np.cosh(b)) + stiffness * support

    across = brentq(bent, 1.8, 3.93) ** 2 * UNIT
    axial = brentq(lambda b: b * np.cos(b) + stiffness * np.sin(b), np.pi / 2, np.pi - 1e-9)
    axial *= np.sqrt(210e9 / 7850.0) / L / (2 * np.pi)
    ends = {"interfaces": KINDS, "fixed": ("root",)}
    for k, exact in ((stiffness * EI / L**3 * Z, across), (stiffness * EA / L * X, axial)):
        whole = rom.modes(model, 16, springs={"tip": k}, **ends).frequencies
        assert np.abs(whole / exact - 1).min() < 3e-3
        found = body.frequencies(6, fixed=("root",), springs={"tip": k})
        assert_allclose(found, whole[:6], rtol=2e-3)
        family_like = body.with_reference("tip").frequencies(6, fixed=("root",), springs={"tip": k})
        round_off = 2e-16 * stiffness * EA * L**2 / EI  # the spring over the beam that bends
        assert_allclose(family_like, found, rtol=1e-7 + 4 * round_off)


def test_a_body_on_soft_springs_swings_as_a_rigid_one(model, body):
    """sqrt(k / m) along each axis; motions without a spring stay free."""
    k = np.array([2.0, 3.0, 5.0]) * 100.0
    springs = {"root": k / 2, "tip": k / 2}
    exact = np.sqrt(k / (7850.0 * L * B * H)) / (2 * np.pi)
    whole = rom.modes(model, 6, springs=springs).frequencies
    for f in (whole, body.frequencies(6, springs=springs)):
        for one in exact:
            assert np.abs(f / one - 1).min() < 2e-3
    assert np.count_nonzero(body.frequencies(8, springs=springs) == 0.0) == 1  # about its axis
    assert np.count_nonzero(body.frequencies(8, springs={"root": np.ones(6)}) == 0.0) == 0
    assert np.count_nonzero(body.frequencies(8, springs={"tip": [0, 0, 1.0]}) == 0.0) == 5


WRONG = [
    ({"springs": {"tip": [1.0, 2.0]}}, ConfigError, r"\(2,\) must be 3 or 6 numbers"),
    ({"springs": {"tip": [1.0, -2.0, 0.0]}}, ConfigError, "and positive or zero"),
    ({"springs": {"tip": np.eye(6) + np.eye(6, k=1)}}, ConfigError, "must be symmetric"),
    ({"springs": {"tip": np.zeros(3)}}, ConfigError, r"springs\['tip'\] must not be zero"),
    ({"springs": {"tip": [np.nan, 1.0, 1.0]}}, ConfigError, "springs"),
    ({"springs": {"foot": np.ones(3)}}, InterfaceError, "no interface 'foot'"),
    ({"fixed": {"root": "w"}}, ConfigError, "'root' is held in 'w'"),
    ({"fixed": {"root": ""}}, ConfigError, "is held in ''"),
    ({"fixed": {"root": "xx"}}, ConfigError, "each once"),
    ({"fixed": {"root": "xyz q"}}, ConfigError, "directions are some of x, y, z, rx, ry, rz"),
    ({"fixed": ("root", "root:y")}, ConfigError, "'root' is given twice"),
    ({"fixed": {"foot": "x"}}, InterfaceError, "no interface 'foot'"),
    ({"fixed": ("root:yz", "foot")}, InterfaceError, "no interface 'foot'"),
]


def test_wrong_springs_and_supports_are_named(model, body):
    for held, error, why in WRONG:
        refuses(error, why, rom.modes, model, 2, **held)
        refuses(error, why, body.frequencies, **held)
    full = {"springs": {"tip": np.ones(3)}, "interfaces": {"tip": "full"}}
    refuses(InterfaceError, "'tip' has the kind 'full'", rom.modes, model, 2, **full)
    turned = {"root": "xyz rx"}
    refuses(InterfaceError, "kind 'full' and no rotation rx", rom.modes, model, 2, fixed=turned)


def test_a_name_may_have_a_colon_itself():
    known = ["foot", "foot:x", "a:b"]
    assert supports(("foot:x", "foot"), known) == {"foot:x": (), "foot": ()}
    assert supports(("a:b:yz", "foot:z"), known) == {"a:b": ("y", "z"), "foot": ("z",)}
    assert supports({"foot": "xyz, rx"}, known) == {"foot": ("x", "y", "z", "rx")}
