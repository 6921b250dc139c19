"""The test bed GARTEUR SM-AG19: parts by closed forms, the whole by beams, what was foretold."""

import numpy as np
import pytest
from measured import garteur, garteur_update, record
from measured.garteur import GAP, POWER, SHAPES, TAPE
from numpy.testing import assert_allclose

from rom.components.updating import airframe

GIVEN = {"E": 71e9, "rho": 2740.0, "t": 0.010, "b": 0.035}
NOMINAL = GIVEN | {"contact": 10**11.5}
EI, GJ = 71e9 * 0.1 * 0.01**3 / 12, 71e9 / 2.66 * 0.1 * 0.01**3 * 0.3123


def volumes(strip):
    """{part: its mass by hand} [kg]."""
    plate, steel = 2740.0 * 0.1 * 0.01, 7850.0
    angles = steel * 4 * 0.1 * (0.015 * 0.002 + 0.013 * 0.002)
    return {
        "fuselage": 2740.0 * 1.5 * 0.05 * 0.15 + steel * 0.13 * 0.07 * 0.016,
        "wing": 2 * plate + 2740.0 * 0.07 * 0.1 * GAP
        + strip * 1.7 * 0.0762 * (2740.0 * 0.0011 + 1000.0 * 5e-5),
        "left": 0.4 * plate + 2740.0 * 0.1 * 0.1 * GAP,
        "right": 0.4 * plate + 2740.0 * 0.1 * 0.1 * GAP,
        "fin": 0.3 * plate + angles + 2740.0 * 2 * 0.1 * 0.04 * GAP,
        "tailplane": 0.4 * plate,
    }  # fmt: skip


@pytest.mark.fenicsx
@pytest.mark.parametrize("name", garteur.PARTS)
def test_parts_weigh_what_they_should(name):
    body = garteur.reduced(name, {}, 100, strip=name == "wing", **NOMINAL)
    assert_allclose(body.mass, volumes(strip=True)[name], rtol=1e-9)


@pytest.mark.fenicsx
def test_a_wing_alone_bends_and_twists_as_a_free_strip():
    """Four bending frequencies by Euler, one twist by Saint-Venant; faces of 10 mm are thin."""
    f = garteur.reduced("wing", {}, 50, strip=False, **NOMINAL).frequencies(14)[6:]
    k = np.array([4.73004, 7.853205, 10.995608, 14.137165]) / 2.0
    bending = k**2 * np.sqrt(EI / (2740.0 * 0.1 * 0.01)) / 2 / np.pi
    polar = 2740.0 * 0.1 * 0.01 * (0.1**2 + 0.01**2) / 12
    twist = np.sqrt(GJ / polar) / 2 / 2.0
    found = np.array([f[np.abs(f / one - 1).argmin()] for one in (*bending, twist)])
    assert_allclose(found[:4], bending, rtol=0.006)
    assert_allclose(found[4], twist, rtol=0.018)  # cells of 50 mm across the chord of 100 mm


@pytest.mark.fenicsx
def test_the_strip_stiffens_and_damps_as_ross_kerwin_and_ungar_say():
    """A sandwich of a stiff layer on a soft one; the strip ends at 0.85 of the wing."""
    family = garteur.reduced("wing", {"tape": garteur.TAPES}, 50, strip=True, **NOMINAL)
    (T,) = (share.K for share in family.shares if share.region == "tape")
    K = sum(share.K for share in family.shares)
    lam, V = garteur.eigh(K, family.body.M)  # rigid motions have coordinates of their own
    share = np.einsum("in,ij,jn->n", V, T, V) / lam
    E_1, E_3, arm = 71e9 * 0.1 * 0.01, 71e9 * 0.0762 * 0.0011, 0.005 + 5e-5 + 0.00055
    Y = arm**2 * E_1 * E_3 / (E_1 + E_3) / EI
    k = np.array([4.73004, 7.853205, 10.995608]) / 2.0
    X = TAPE * 0.0762 / 5e-5 / k**2 * (1 / E_1 + 1 / E_3)
    loss = Y * X / (1 + (2 + Y) * X + (1 + Y) * X**2)  # of a sine; the first mode is far from one
    assert_allclose(share[1:3], loss[1:], rtol=0.15)
    stiff = EI * (1 + Y * X / (1 + X))
    heavy = 2740.0 * 0.1 * 0.01 + 0.85 * 0.0762 * (2740.0 * 0.0011 + 0.05)
    assert_allclose(np.sqrt(lam[:3]), k**2 * np.sqrt(stiff / heavy), rtol=0.04)


def test_the_glued_bed_is_a_little_stiffer_than_beams():
    """Beams meet in points; here drums and plate stiffen 100 and 70 mm of the wing."""
    kept = record.read("garteur_copy")
    bed = airframe(0.05, material=garteur.rom.Material(71e9, 0.33, 2740.0))
    K, M = sum(bed.K.values()), sum(bed.M.values())
    beams = np.sqrt(garteur.eigh(K, M, eigvals_only=True)[6:14]) / 2 / np.pi
    f = np.sort([one.value for name, one in kept.items() if name.startswith("glued")])[:8]
    assert ((f / beams > 0.995) & (f / beams < 1.09)).all(), f / beams


@pytest.mark.long
@pytest.mark.fenicsx
def test_loss_is_how_much_frequencies_follow_the_tape():
    """Strain energy of the tape against a difference; frequencies move with a tape that moves."""
    whole = garteur.bed(50, strip=True, **NOMINAL)
    _, loss, _ = garteur.spectrum(*whole, heave=2.3)
    low, high = (garteur.spectrum(*whole, heave=2.3, factor=c)[0] for c in (0.999, 1 / 0.999))
    follows = 2 * np.log(high / low) / (2 * np.log(1 / 0.999))
    assert_allclose(follows * (1 - POWER * loss / 2), loss, rtol=0.02, atol=1e-5)


@pytest.mark.long
@pytest.mark.fenicsx
def test_a_heavy_bed_heaves_at_its_frequency(monkeypatch):
    """Bungees that are ten times softer leave a rigid body, with the frequency of heave."""
    monkeypatch.setattr(garteur, "SUSPENDED", 0.15)
    whole = garteur.bed(50, strip=False, **NOMINAL)
    f = garteur.spectrum(*whole, heave=0.23, n=4)[0]
    assert np.abs(f / 0.23 - 1).min() < 0.02


@pytest.mark.long
@pytest.mark.fenicsx
def test_shapes_in_the_file_are_those_of_the_bed():
    for strip in (False, True):
        kept, now = garteur.reference(strip), garteur.reference_anew(strip)
        assert ((kept * now).sum(axis=0) ** 2 > 0.99).all()


@pytest.mark.long
@pytest.mark.fenicsx
def test_frequencies_follow_their_derivatives():
    """Central differences by each unknown, the tape as stiff as it is at each frequency."""
    x = {"mass": 0.5, "tips": 0.1, "E": 0.02, "tape": -0.3}
    J = garteur_update.modes(x)[3]
    for k, name in enumerate(garteur_update.SOUGHT):
        low, high = (
            np.log(garteur_update.modes(x | {name: x.get(name, 0.0) + step})[0])
            for step in (-0.01, 0.01)
        )
        assert_allclose(J[:, k], (high - low) / 0.02, atol=1e-4)


@pytest.mark.long
@pytest.mark.fenicsx
def test_an_update_finds_what_was_changed():
    """Exact frequencies with small errors lead back to their factors, whatever was known before."""
    true = {"E": 0.02, "root": 0.5, "tail": -0.4, "tape": 0.3, "mass": 0.7}
    f = dict(zip(SHAPES, garteur_update.modes(true)[0], strict=True))
    found = garteur_update.updated(f, 1e-5, free=tuple(true), steps=10)
    assert_allclose([*found.sought.values()], [*true.values()], atol=0.01)
    assert found.misfit[1] < 1 < found.misfit[0]


@pytest.mark.long
@pytest.mark.fenicsx
def test_verdicts_name_a_mass_on_the_tail():
    """As docs/measured.md has it: misfit with and without, and what is found."""
    without, found = map(garteur_update.original, (garteur_update.WITHOUT, garteur_update.AFTER))
    assert_allclose([*without.misfit, found.misfit[1]], [4.96, 1.82, 0.90], rtol=0.02)
    factors = {name: np.exp(x) for name, x in found.sought.items()}
    assert_allclose([0.1 * factors[name] for name in ("mass", "tail", "root", "tape")],
                    [0.40, 0.044, 0.166, 0.074], rtol=0.03)  # fmt: skip


def test_modifications_move_frequencies_in_the_order_that_is_told():
    """Brass moves what moves the tail, a heavy tip the torsion of its own wing."""
    kept = record.read("garteur_modified")
    change = {
        which: {s: kept[f"{which}, {s}, change [%]"].value for s in SHAPES[:10]}
        for which in ("brass", "heavy tip")
    }
    first = {which: sorted(rows, key=rows.get)[:3] for which, rows in change.items()}
    assert first["brass"] == ["fuselage rotation", "tailplane yaws", "three-node bending"]
    assert first["heavy tip"] == [
        "antisymmetric torsion", "two-node bending", "in plane, fuselage turns",
    ]  # fmt: skip
    assert all(x < 0 for rows in change.values() for x in rows.values())  # a mass never raises one
