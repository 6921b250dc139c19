"""A body without geometric stiffness says how near the load on its interfaces is to buckling it."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.mbs.slender import E_STEEL, assembled, cantilever
from cases.solid import reduced
from rom.errors import RomWarning

pytestmark = pytest.mark.fenicsx
L, B, H = 1.0, 0.05, 0.01
EULER = np.pi**2 * E_STEEL * B * H**3 / 12 / L**2


@pytest.fixture(scope="module")
def bodies():
    steel = rom.Material(E=E_STEEL, nu=0.0, rho=7850.0)
    model = assembled((L, B, H), (12, 1, 1), material=steel)
    return {known: reduced(6, model, stiffening=known, reference="root") for known in (False, True)}


def hinged(body, share):
    """The bar between a hinge and a hinged slide, pressed by a cable between its own ends."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    beam = mech.add_flexible("beam", body)
    root, tip = (tuple(beam.point(beam.marker(name))) for name in ("root", "tip"))
    shoe = mech.add_rigid("shoe", mass=1e-3, inertia=(1e-6,) * 3, at=tip, markers={"o": (0, 0, 0)})
    mech.revolute("A", mech.ground.marker(root), beam.marker("root"), axis=(0, 1, 0))
    mech.prismatic("S", mech.ground.marker(tip), shoe.marker("o"), axis=(1, 0, 0))
    mech.revolute("B", shoe.marker("o"), beam.marker("tip"), axis=(0, 1, 0))
    ends = [beam.marker("root"), beam.marker("tip")]
    mech.tendon("cable", ends, EA=1e5, pretension=share * EULER)
    return mech


def small_motions(mech):
    return rom.linearize(mech, rom.equilibrium(mech))


def test_the_load_that_buckles_is_that_of_euler(bodies, tmp_path):
    """In any frame, from a file, and in other units."""
    body = bodies[False]
    saved, others = rom.save(body, tmp_path / "bar.rom.npz"), ("mm-t-s", "mm-kg-ms")
    seen = (body, body.with_reference("mean-axis"), rom.load(saved), *map(body.in_units, others))
    for one, newton in zip(seen, (1, 1, 1, 1, 1e-3), strict=True):
        [(*ends, load)] = one.provenance["buckling loads"]
        assert ends == ["root", "tip"]
        assert_allclose(load, newton * EULER, rtol=1e-2)


@pytest.mark.parametrize("share", [0.05, 0.5])
def test_a_pressed_bar_is_warned_of_from_a_tenth_on(bodies, share, recwarn):
    """f = f0 sqrt(1 - P / P_cr); without geometric stiffness f0, which is said."""
    free, stiffened = small_motions(hinged(bodies[False], share)), None
    said = [str(w.message) for w in recwarn if issubclass(w.category, RomWarning)]
    assert len(said) == (share > 0.1)
    assert all("'beam' is pressed by 0.5 of the load that buckles it" in x for x in said)
    assert_allclose(free.pressed["beam"], share, rtol=1e-2)
    stiffened = small_motions(hinged(bodies[True], share))
    assert stiffened.pressed["beam"] == 0.0
    ratio = stiffened.frequencies[0] / free.frequencies[0]
    assert_allclose(ratio, np.sqrt(1 - free.pressed["beam"]), rtol=2e-3)


@pytest.mark.filterwarnings("ignore:.*is pressed by")
def test_a_motion_is_audited_for_it(bodies):
    known, stiffened, rows, reports = bodies[False], bodies[True], {}, {}
    old = replace(known, provenance={})
    for name, one in {"known": known, "old": old, "stiffened": stiffened}.items():
        reports[name] = rom.audit(rom.simulate(hinged(one, 0.5), t_end=1e-3, dt=1e-4))
        rows[name] = [row for row in reports[name].rows if "buckles it" in row.quantity]
        assert reports[name].ok == (name != "known")
    [row] = rows["known"]
    assert_allclose(row.value, 0.5, rtol=1e-2)
    assert "stiffening=True" in reports["known"].advice[0]
    [row] = rows["old"]
    assert row.quantity.endswith("unknown") and row.limit == "information"
    assert not rows["stiffened"]


def test_tension_and_bending_press_nothing(bodies):
    mech, beam = cantilever(bodies[False])
    mech.force("pull", beam.marker("tip"), (0.5 * EULER, 0.0, 1.0))
    assert small_motions(mech).pressed["beam"] < 1e-3
