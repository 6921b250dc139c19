"""Fingers of springs and reduced solids: mechanism against sums of parts, rigid limit, share."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from benchmarks.models import bar
from cases.paths import ROOT
from cases.refusals import refuses
from cases.solid import reduced
from rom import rotation
from rom.components import hand
from rom.components.cosserat.helical_spring import HelicalSpring
from rom.components.hand.compliant_hand import HAND_SPRING, INDEX_LENGTHS, Finger, rest
from rom.components.hand.solid_finger import parts_of_compliance, solid_finger, tip_compliance
from rom.errors import InterfaceError, ModelError

ENDS = ("root", "tip")
UPWARD = np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]])  # bars lie along x
SOFT = rom.Material(E=2e6, nu=0.3, rho=1100.0)
SIDE = 6e-3
SPRINGS = (HAND_SPRING, HelicalSpring(0.8e-3, 8e-3, 4, 9e-3), HAND_SPRING)


def bars(material, lengths=INDEX_LENGTHS, kind="rbe2", cells=(2, 1, 1)):
    kinds = {"interfaces": dict.fromkeys(ENDS, kind)}
    sizes = ((length, SIDE, 0.8 * SIDE) for length in lengths)
    return [reduced(2, bar(size, cells, material), **kinds) for size in sizes]


def finger(solids, springs=SPRINGS, **more):
    mech = solid_finger(solids, springs, ends=ENDS, orientation=UPWARD, **more)
    return mech, mech.part(f"phalanx {len(solids)}").marker("tip")


def scaled(C, D):
    """Compliances relative to the motions of the second."""
    size = np.sqrt(np.outer(D.diagonal(), D.diagonal()))
    return C / size, D / size


def test_compliance_is_the_sum_of_springs_and_phalanges():
    solids = bars(SOFT)
    C = tip_compliance(*finger(solids))
    joints, links = parts_of_compliance(solids, SPRINGS, ends=ENDS, orientation=UPWARD)
    assert_allclose(*scaled(C, joints + links), atol=1e-6)
    assert (np.diag(links) > 0.02 * np.diag(C)).all()
    assert_allclose(C, C.T, atol=1e-9 * np.abs(C).max())


def test_compliance_of_one_link_is_that_of_a_beam():
    """Bending, shear and tension in closed form, for plates that leave the bar free to widen."""
    L, b, h = INDEX_LENGTHS[0], SIDE, 0.8 * SIDE
    E, G = 2e6, 2e6 / 2.6
    C = hand.link_compliance(bars(SOFT, INDEX_LENGTHS[:1], "rbe3", (6, 2, 2))[0], ENDS)
    bends = np.array([h * b**3, b * h**3]) / 12
    exact = [L / (E * b * h), *(L**3 / (3 * E * bends) + L / (5 / 6 * G * b * h))]
    assert_allclose(np.diag(C)[:3], exact, rtol=5e-3)
    assert_allclose(np.diag(C)[4:], L / (E * bends[::-1]), rtol=5e-3)
    assert_allclose([C[1, 5], C[2, 4]], L**2 / (2 * E * bends) * [1, -1], rtol=5e-3)


def test_stiff_phalanges_make_the_rigid_finger():
    """Tip of the finger of rigid links: 267.362 mm/N across, 2.2286 mm/N along."""
    C = tip_compliance(*finger(bars(rom.Material(E=200e9, nu=0.3, rho=7850.0)), (HAND_SPRING,) * 3))
    assert_allclose(1e3 * np.diag(C)[:3], [267.362, 267.362, 2.2286], rtol=1e-3)
    assert_allclose(*scaled(C, rest(Finger()).tip_compliance()), atol=1e-4)


def test_springs_weigh_as_much_as_their_wire_and_stretch_under_their_weight():
    """Steel wire of 0.7 mm, 5 coils of 7 mm: 0.332 g; a thin tube turns as its radius says."""
    rod = hand.heavy_spring(HAND_SPRING)
    wire = 7850 * np.pi / 4 * 0.7e-3**2 * 5 * np.hypot(np.pi * 7e-3, 8e-3 / 5)
    assert_allclose(rod.mass.sum(), wire, rtol=1e-12)
    assert_allclose(rod.inertia.sum(axis=0), wire * 3.5e-3**2 * np.array([0.5, 0.5, 1]))
    # each spring carries what hangs below it and half of its own weight
    solids = bars(rom.Material(E=200e9, nu=0.3, rho=1000.0))
    mech, _ = finger(solids, (HAND_SPRING,) * 3, gravity=(0, 0, 0.5))
    state = rom.equilibrium(mech)
    packed = rom.linearize(mech, state).packed
    own, below, drop = hand.heavy_spring(HAND_SPRING).mass.sum(), 0.0, 0.0
    for solid in reversed(solids):
        below += solid.mass
        drop += 0.5 * (below + own / 2) / HAND_SPRING.stiffness
        below += own
    at = packed.system.bodies.q_at[packed.names.index("phalanx 3")]
    start = mech.part("phalanx 3").at
    assert_allclose(state.q[at : at + 3] - start, [0, 0, drop], rtol=1e-5, atol=1e-12)


def test_what_does_not_fit_is_named():
    solids = bars(SOFT, INDEX_LENGTHS[:2])
    refuses(ModelError, "3 springs and 2 phalanges", solid_finger, solids, SPRINGS, ends=ENDS)
    refuses(ModelError, "3 springs", parts_of_compliance, solids, SPRINGS, ends=ENDS)
    refuses(InterfaceError, "proximal", solid_finger, solids, SPRINGS[:2])


@pytest.mark.long
@pytest.mark.fenicsx
def test_bones_of_polyamide_add_less_than_a_hundredth():
    """Solids of 18, 12 and 10 mm; PA12 is our choice. In every direction springs are the finger."""
    polyamide = rom.Material(E=1.7e9, nu=0.4, rho=1010.0)
    geometry = ROOT / "meshes" / "phalanx.geo"
    kinds = {"proximal": "rbe2", "distal": "rbe2", "pad": rom.Polynomial(1)}
    solids = []
    for L in INDEX_LENGTHS:
        model = rom.fe.model(geometry, material=polyamide, parameters={"L": L}, order=2)
        solids.append(reduced(4, model, interfaces=kinds))
    D, R, d = 0.014, 0.00125, 0.0015
    a = D / 2 - R
    rim = np.pi * (a**2 * R + a * np.pi * R**2 / 2 + 2 * R**3 / 3)
    lengths = np.array(INDEX_LENGTHS)
    between = np.pi * (D**2 * (lengths - 2 * R) - d**2 * lengths) / 4
    assert_allclose([solid.mass for solid in solids], 1010 * (between + 2 * rim), rtol=1.5e-3)
    mech = solid_finger(solids, (HAND_SPRING,) * 3)
    tip, pad = (mech.part("phalanx 3").marker(name) for name in ("distal", "pad"))
    C = tip_compliance(mech, tip)
    joints, links = parts_of_compliance(solids, (HAND_SPRING,) * 3)
    assert_allclose(*scaled(C, joints + links), atol=1e-6)
    share = np.diag(C - joints) / np.diag(C)
    assert_allclose(share, np.diag(links) / np.diag(C), rtol=1e-3)
    assert 5e-5 < share.min() and share.max() < 1.5e-4
    # of three links that bend and stretch while springs do not
    near = np.cumsum([0.0, *(lengths[::-1] + HAND_SPRING.length)])[:-1]
    cubes = ((near + lengths[::-1]) ** 3 - near**3).sum()
    across = cubes / (3 * polyamide.E * np.pi * (D**4 - d**4) / 64)
    along = lengths.sum() / (polyamide.E * np.pi * (D**2 - d**2) / 4)
    assert_allclose(np.diag(links)[:3], [across, across, along], rtol=0.15)
    move = np.eye(6)
    move[:3, 3:] = -rotation.skew(mech.design_point(pad) - mech.design_point(tip))
    assert_allclose(*scaled(tip_compliance(mech, pad), move @ joints @ move.T), atol=1e-3)
