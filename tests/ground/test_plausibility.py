"""Numbers of another unit never pass in silence, and numbers of real machines always do."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.files.cells import solid as solid_mesh
from cases.files.step_parts import step_box
from cases.refusals import refuses
from cases.solid import STEEL, block, reduced
from rom.body.conversion import Factors
from rom.body.stiffening import known_loads
from rom.components.cosserat import HelicalSpring
from rom.components.gear_mesh import GearPair, RackPair
from rom.components.hand.cable import Hole, Tendon
from rom.eigen.attachments import carried_displacements
from rom.errors import ConfigError, ModelError, RomWarning
from rom.fe.mesh.validate import checked
from rom.io.matrices.op4 import write_op4
from rom.io.native import body_arrays
from rom.mbs import BallBearing, Groove, JournalBearing, Oil, Pulley, RollerBearing
from rom.mbs.elements.contact.impact import Impact
from rom.mbs.parts.signals import Examined
from rom.plausible import far_doubt, scaled_doubt
from rom.units import unit_system


def said(make):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        make()
    return [str(w.message) for w in caught if issubclass(w.category, RomWarning)]


WAYS = {
    "material": rom.Material,
    "orthotropic": lambda E, nu, rho: rom.Orthotropic((E,) * 3, (nu,) * 3, (E / 2.6,) * 3, rho),
    "replace": lambda E, nu, rho: replace(rom.Material(210e9, nu, 7850.0), E=E, rho=rho),
}
WRONG = {  # E, rho: what is said
    "E in MPa": (2.1e5, 7850.0, "5.172 m/s"),
    "rho in g/cm^3": (210e9, 7.85, "1.636e+05 m/s"),
    "mm, t, s": (2.1e5, 7.85e-9, "from_units('mm-t-s'"),
    "mm, kg, ms": (210.0, 7.85e-6, "from_units('mm-kg-ms'"),
    "rho in g/m^3": (210e9, 7.85e6, "7.85e+06 kg/m^3"),
    "MPa and g/cm^3": (2.1e5, 7.85, "7.85 kg/m^3"),
    "E in psi": (3.05e7, 7850.0, "62.33 m/s"),
    "ksi and lb/in^3": (3.05e4, 0.284, "0.284 kg/m^3"),
    "just too slow": (9.5e4, 1000.0, "9.747 m/s"),
    "just too fast": (4.1e11, 1000.0, "2.025e+04 m/s"),
}
RIGHT = {  # E, rho
    "steel": (210e9, 7850.0), "diamond": (1.2e12, 3510.0), "beryllium": (3.03e11, 1850.0),
    "rubber": (1e6, 1100.0), "gel": (2e5, 1000.0), "soft foam": (3e4, 30.0),
    "honeycomb": (1e9, 50.0), "aerogel": (1e4, 2.0), "tungsten": (4e11, 19300.0),
    "balsa": (3e9, 120.0), "osmium": (5.6e11, 22590.0), "lead": (1.6e10, 11340.0),
    "gold": (7.8e10, 19300.0), "polystyrene foam": (3e6, 15.0), "concrete": (3e10, 2400.0),
    "just not too slow": (1.05e5, 1000.0), "just not too fast": (3.9e11, 1000.0),
}  # fmt: skip


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("numbers", WRONG.values(), ids=WRONG)
def test_a_solid_that_does_not_exist_is_doubted_whichever_way_it_comes(way, numbers):
    E, rho, words = numbers
    found = said(lambda: WAYS[way](E, 0.3, rho))
    assert len(found) == 1 and words in found[0]
    assert f"{E}" in found[0] and f"rho = {rho:g}" in found[0]


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("numbers", RIGHT.values(), ids=RIGHT)
def test_a_solid_that_exists_is_taken_in_silence(way, numbers):
    E, rho = numbers
    assert said(lambda: WAYS[way](E, 0.3, rho)) == []


@pytest.mark.parametrize(
    ("units", "E", "rho"), [("SI", 210e9, 7850.0), ("mm-t-s", 2.1e5, 7.85e-9),
                            ("mm-kg-ms", 210.0, 7.85e-6)],
)  # fmt: skip
def test_limits_follow_the_units_that_are_declared(units, E, rho):
    made, three = [], {"E": (E,) * 3, "nu": (0.3,) * 3, "G": (E / 2.6,) * 3, "rho": rho}
    assert not said(lambda: made.append(rom.Material.from_units(units, E=E, nu=0.3, rho=rho)))
    assert not said(lambda: made.append(rom.Orthotropic.from_units(units, **three)))
    for solid in made:
        assert_allclose([np.max(solid.E), solid.rho], [210e9, 7850.0], rtol=1e-14)


@pytest.mark.parametrize("many", [False, True], ids=["one", "list"])
@pytest.mark.parametrize(
    ("ratio", "words"), [(2.0, "2 per cent"), (-0.01, "-0.01"), (1.01, "0.0101")]
)
def test_damping_that_no_structure_has_is_refused(ratio, words, many):
    refuses(ConfigError, f"ratio = .*{words}", rom.ModalDamping, [0.01, ratio] if many else ratio)


@pytest.mark.parametrize(("share", "n"), [(0.2, 0), (0.5, 1), (3.0, 1)])
def test_rayleigh_is_doubted_by_its_lowest_mode(part, share, n):
    beta = 2 * share / (2 * np.pi * part.frequencies()[6])
    found = said(lambda: rom.Rayleigh(beta=beta).matrix(part))
    assert len(found) == n and all(f"{share:.4g};" in text for text in found)


def test_the_line_of_a_damping_ratio_in_a_file_is_told(tmp_path):
    path = tmp_path / "part.toml"
    path.write_text('[geometry]\nfile = "part.geo"\n[damping]\nratio = 2.0\n')
    refuses(ConfigError, r"part.toml:\d.*= 2 is beyond", rom.read_component(path).damping)


def pendulum(at=(0.0, 0.0, 0.0)):
    mech = rom.Mechanism()
    bob = mech.add_rigid("bob", mass=1.0, inertia=(1e-2, 2e-2, 2e-2), at=np.add(at, (0.5, 0, 0)),
                         markers={"a": (-0.5, 0, 0)})  # fmt: skip
    mech.revolute("pin", mech.ground.marker(at), bob.marker("a"), axis=(0, 1, 0))
    return mech


def on_spring(**how):
    mech = pendulum()
    ends = mech.ground.marker((0, 0, 1)), mech.parts["bob"].marker("a")
    mech.spring_damper("soft", *ends, **{"stiffness": 5.0} | how)


def on_turning_spring(**how):
    pendulum().rotational_spring("soft", "pin", **{"stiffness": 5.0} | how)


def in_film(**how):
    mech = rom.Mechanism()
    rotor = mech.add_rigid("rotor", mass=1.0, inertia=(1e-2,) * 3, at=(0, 0, 0))
    ends = rotor.marker((0, 0, 0)), mech.ground.marker((0, 0, 0))
    mech.journal_bearing("low", *ends, axis=(0, 0, 1), **{
        "bearing": JournalBearing(0.05, 0.03, 5e-5)} | how)  # fmt: skip


def geared(**how):
    mech, pair = rom.Mechanism(), GearPair((26, 40), 4e-3, 0.03)
    ends = [mech.add_rigid(name, mass=1, inertia=(1, 1, 1), at=(x, 0, 0)).marker((0, 0, 0))
            for name, x in (("a", 0.0), ("b", pair.distance))]  # fmt: skip
    mech.gear_mesh("mesh", *ends, axis=(0, 0, 1), pair=pair, transition_speed=0.1, **how)


SLIPS = {  # what is made of a number, the number, the same in another unit, what is said of that
    "module": (lambda x: GearPair((26, 40), x, 0.03), 4e-3, 4.0, "mm: 4 mm are 0.004 m"),
    "face width": (lambda x: GearPair((26, 40), 4e-3, x), 0.03, 30.0, "mm: 30 mm are 0.03 m"),
    "rack": (lambda x: RackPair(26, x, 0.03), 4e-3, 4.0, "mm: 4 mm are 0.004 m"),
    "stiffness of teeth": (lambda x: geared(stiffness=x), 1.4e10, 14.0, "14 N/(mm um) are 1.4e+10"),
    "friction of teeth": (lambda x: geared(stiffness=1e10, friction=x), 0.7, 35.0, "35 degrees"),
    "pulley": (lambda x: Pulley(rom.Mechanism().ground.marker((0, 0, 0)), 0.1, (0, 0, 1),
                                friction=x), 0.3, 30.0, "Thirty per cent"),
    "tendon in a hand": (lambda x: Tendon((Hole(0, 0, (0, 0, 0)),) * 2, x), 0.3, 30.0, "per cent"),
    "viscosity": (lambda x: in_film(oil=x), 0.02, 20.0, "mPa s: 20 mPa s are 0.02 Pa s"),
    "inlet": (lambda x: in_film(oil=Oil(46.0, 6.8), inlet=x), 40.0, 313.0, "in K 273 more"),
    "lobes": (lambda x: JournalBearing(0.05, 0.03, 5e-5, preload=0.4, lobes=x), np.pi / 2, 90,
              "degrees: 90 degrees are 1.571 rad"),
    "journal": (lambda x: JournalBearing(x, x, 1e-3 * x), 0.05, 50.0, "mm: 50 mm are 0.05 m"),
    "groove": (lambda x: Groove(x), 7.6, 180.0, "degrees: 180 degrees are 3.142 rad"),
    "oil pressure": (lambda x: Groove(0.0, pressure=x), 2e5, 2.0, "bar: 2 bar are 2e+05 Pa"),
    "oil": (lambda x: Oil(46.0, 6.8, density=x), 870.0, 0.87, "g/cm^3 are 870 kg/m^3"),
    "heat": (lambda x: Oil(46.0, 6.8, heat=x), 2000.0, 2.0, "2 kJ/(kg K) are 2000"),
    "balls": (lambda x: BallBearing(9, 8e-3, 0.04, E=x), 206e9, 206.0, "GPa: 206 GPa are 2.06e+11"),
    "pitch circle": (lambda x: BallBearing(9, 0.2 * x, x), 0.04, 40.0, "40 mm are 0.04 m"),
    "rollers": (lambda x: RollerBearing(14, x, x, 8 * x), 8e-3, 8.0, "8 mm are 0.008 m"),
    "wire": (lambda x: HelicalSpring(x, 8 * x, 6.0, 20 * x), 2e-3, 2.0, "2 mm are 0.002 m"),
}  # fmt: skip


@pytest.mark.parametrize("case", SLIPS)
def test_components_doubt_what_looks_like_another_unit(case):
    make, meant, slipped, words = SLIPS[case]
    assert not [text for text in said(lambda: make(meant)) if "looks like" in text or "; " in text]
    found = said(lambda: make(slipped))
    assert any(f"{slipped:g}" in text and words in text for text in found), found


def rigid(**how):
    rom.Mechanism().add_rigid("bob", **{"mass": 1.0, "inertia": (1, 1, 1), "at": (0, 0, 0)} | how)


def carrying(inertia, at=None):
    carried = rom.Attachment("tip", 1.0, inertia * np.eye(3), at)
    rom.mass_properties(replace(block(cells=(2, 1, 1)), attachments=(carried,)))


def mesh_of(size=1.0, shift=0.0):
    mesh = solid_mesh()
    checked(replace(mesh, points=(mesh.points / mesh.size + [shift, 0, 0]) * size))


DOUBTED = {  # what is made of a number, numbers taken in silence, numbers doubted, what is said
    "modulus": (lambda x: rom.YoungsModulus("web", 0.5, x), (4.0, 1e3), (210e9, 7850.0),
                "{:.4g}", "web"),
    "density": (lambda x: rom.Density("web", 0.5, x), (4.0, 1e3), (210e9, 7850.0), "{:.4g}", "web"),
    "ratio": (rom.ModalDamping, (0.0, 1e-4, 0.02, 0.3, [0.01, 1.0]), (0.5, [0.01, 0.5]), "0.5"),
    "ratio of each": (rom.ModalDamping, (), (1, 1.0, [1.0, 1.0]), "per cent as 0.02"),
    "gravity": (lambda g: rom.Mechanism(gravity=(0, 0, -g)), (9.81, 25.0, 100.0), (9810.0, 981.0),
                "gravity is {:.4g} m/s^2"),
    "inertia": (lambda x: rigid(inertia=(x,) * 3, markers={"a": (0.1, 0, 0)}), (0.01,), (1e4,),
                "1000", "'bob'"),  # kg mm^2
    "point": (lambda x: rigid(inertia=(x,) * 3, markers={"a": (1, 0, 0)}), (1e-9,), ()),
    "inertia alone": (lambda x: rigid(inertia=(x,) * 3, markers={"a": (0, 0, 0)}), (), (1e12,),
                      "1e+06 m", "'bob'"),
    "spring": (lambda x: on_spring(stiffness=x), (5.0, 0.0), (-5.0,), "stiffness of 'soft' is -5;"),
    "turn": (lambda x: on_turning_spring(stiffness=x), (5.0, 0.0), (-5.0,), "'soft' is -5;"),
    "damper": (lambda x: on_spring(damping=x), (0.0, 1.0), (-2.0,), "damping of 'soft' is -2;"),
    "turn that damps": (lambda x: on_turning_spring(damping=x), (0.0, 1.0), (-2.0,), "is -2;"),
    "friction of a stop": (lambda mu: Impact(stiffness=1e5, mu=mu), (0.0, 0.3, 2.0), (30.0,),
                           "friction", "is 30;"),
    "friction": (lambda mu: pendulum().friction("rub", "pin", mu=mu, radius=0.01,
                                                transition_speed=0.01),
                 (0.0, 0.3, 2.0), (30.0,), "friction", "is 30;"),
    "speed": (lambda v: rigid(velocity=(v, 0, 0)), (0.0, 7.8e3, 7e4), (3e6,), "'bob' is 3e+06 m/s"),
    "attachment": (carrying, (0.1,), (1e5,), "the attachment on 'tip'"),
    "attachment far away": (lambda x: carrying(0.1, (x, 0, 0)), (2.0,), (1500.0,),
                            "the attachment on 'tip'"),
    "joints far away": (lambda x: rom.simulate(pendulum(at=(x, 0, 0)), t_end=2e-3, dt=1e-3),
                        (0.0, 1e3), (1e6,), "1e+06 m from the origin"),
    "size of a mesh": (mesh_of, (1.0, 1e-5, 3e3), (1e-8, 1e5), "the size of the mesh"),
    "mesh far away": (lambda x: mesh_of(shift=x), (50.0,), (1e6,), "12 of 16 digits"),
    "mesh away": (lambda x: mesh_of(shift=x), (), (3e3,), "7 of 16 digits"),
}  # fmt: skip


@pytest.mark.parametrize("case", DOUBTED)
def test_numbers_of_no_machine_are_doubted_and_those_of_machines_are_not(case):
    make, silent, doubted, *words = DOUBTED[case]
    assert [said(lambda x=x: make(x)) for x in silent] == [[]] * len(silent)
    for x in doubted:
        (text,) = set(said(lambda x=x: make(x)))
        assert not [word for word in words if word.format(x) not in text], text


@pytest.mark.parametrize(
    ("value", "default", "n"),
    [(6.0, 0.006, 1), (6e-6, 0.006, 1), (0.06, 0.006, 0), (0.006, 0.006, 0), (0.0, 0.006, 0),
     (30.0, 0.0, 0), ("a", "b", 0), (True, 1, 0), (-6.0, 0.006, 1)],
)  # fmt: skip
def test_a_parameter_in_millimetres_is_doubted(value, default, n):
    text = scaled_doubt("bore", value, default)
    assert bool(text) == bool(n)
    assert not n or (f"bore = {value:g}" in text and f"default {default:g}" in text)


BUILDER = """
def build(gmsh, L=0.1, lc=0.05):
    gmsh.model.occ.addBox(0, 0, 0, L, 0.1, 0.1)
    gmsh.model.occ.synchronize()
    gmsh.model.setPhysicalName(3, gmsh.model.addPhysicalGroup(3, [1]), "body")
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.1 * max(1.0, L))
"""
GEO = """SetFactory("OpenCASCADE");
DefineConstant[ L = {0.1, Name "L"} ];
Box(1) = {0, 0, 0, L, 0.1, 0.1};
Physical Volume("body") = {1};
Mesh.MeshSizeMax = 0.1 * (1 + L);
"""


@pytest.mark.fenicsx
@pytest.mark.parametrize(("name", "text"), [("a.geo", GEO), ("b.py", BUILDER)])
@pytest.mark.parametrize(("L", "n"), [(0.2, 0), (20.0, 1)])
def test_geometries_compare_parameters_with_their_defaults(name, text, L, n, tmp_path):
    from rom.fe.mesh.read import read_mesh

    path = tmp_path / name
    path.write_text(text)
    found = said(lambda: read_mesh(path, parameters={"L": L}, trust=path.suffix == ".py"))
    assert len([text for text in found if "L = 20 is 200 times its default 0.1" in text]) == n


@pytest.mark.fenicsx
@pytest.mark.parametrize(("scale", "n"), [(1.0, 0), (1e-3, 1)])
def test_a_step_file_that_is_scaled_on_top_of_its_unit_is_doubted(scale, n, tmp_path):
    from rom.fe.mesh.read import read_mesh

    path = tmp_path / "box.step"
    step_box(path, 100.0, 50.0, 50.0)
    found = said(lambda: read_mesh(path, scale=scale))
    assert [("scale=0.001" in text and "0.0001225 m" in text) for text in found] == [True] * n


def matrices(folder, *, k=1.0, m=1.0, x=1.0, material=STEEL, units="SI"):
    """A block as matrix files with numbers times k and m, and its nodes times x."""
    model = block(material=material)
    write_op4({"KAA": model.K.toarray() * k, "MAA": model.M.toarray() * m}, folder / "bar.op4")
    labels = np.arange(1, len(model.points) + 1)
    K, M = ((folder / "bar.op4", name) for name in ("KAA", "MAA"))
    root = {"root": labels[model.interfaces["root"].nodes]}
    return rom.read_model(K, M, nodes=(labels, model.points * x), interfaces=root, units=units)


MATRICES = {
    "SI": ({}, ""),
    "mm, t, s as said": ({"k": 1e-3, "m": 1e-3, "x": 1e3, "units": "mm-t-s"}, ""),
    "mm, t, s read as SI": ({"k": 1e-3, "m": 1e-3, "x": 1e3}, "the speed of sound"),
    "nodes in mm": ({"x": 1e3}, "the speed of sound"),
    "nodes in km": ({"x": 1e-3}, "the mass over the volume"),
    "E in MPa": ({"k": 1e-6}, "the speed of sound"),
    "mass in g": ({"m": 1e3}, "the mass over the volume"),
    "rubber": ({"material": rom.Material(1e6, 0.45, 1100.0)}, ""),
}


@pytest.mark.parametrize("case", MATRICES.values(), ids=MATRICES)
def test_matrices_of_other_units_are_doubted(case, tmp_path):
    numbers, words = case
    found = said(lambda: matrices(tmp_path, **numbers))
    assert bool(found) == bool(words)
    assert not words or any(words in text and "bar.op4" in text for text in found)


@pytest.fixture(scope="module")
def part():
    kinds = {"root": "rbe2", "tip": rom.Polynomial(2)}
    body = reduced(4, block(cells=(4, 2, 2)), interfaces=kinds)
    rng = np.random.default_rng(7)
    drawn = {load: rng.normal(size=body.K.shape) for load in known_loads(body)}
    return replace(body, K_geo={load: A + A.T for load, A in drawn.items()}, D=1e-4 * body.K)


UNITS = ("mm-t-s", "mm-kg-ms")


@pytest.mark.parametrize("units", UNITS)
def test_a_body_comes_back_from_other_units(part, units):
    there = part.in_units(units)
    again, first = body_arrays(there.in_units("SI")), body_arrays(part)
    for name, A in first.items():
        assert_allclose(again[name], A, rtol=1e-14, atol=1e-14 * np.abs(A).max(initial=0.0))
    assert there.units == units
    assert there.inertia.max() > 1e2 * part.inertia.max()


def test_the_conversion_of_a_body_is_that_of_its_model():
    """The same beam meshed in mm, with MPa and t/mm^3."""
    kinds = {"root": "rbe2", "tip": rom.Polynomial(1)}
    si = block(size=(1.0, 0.1, 0.06), cells=(4, 1, 1))
    with pytest.warns(RomWarning, match="mm-t-s"):
        material = rom.Material(210e9 * 1e-6, 0.3, 7850.0 * 1e-12)
    mm = block(size=(1e3, 100.0, 60.0), cells=(4, 1, 1), material=material)
    body, native = (reduced(3, model, interfaces=kinds, reference="root") for model in (si, mm))
    found = body.in_units("mm-t-s")
    for name in ("mass", "first_moment", "inertia", "omega", "K"):
        A = np.asarray(getattr(native, name))
        assert_allclose(getattr(found, name), A, rtol=1e-7, atol=1e-9 * np.abs(A).max())
    for name in ("S", "Ibar_kl"):
        A = np.abs(getattr(native, name))
        assert_allclose(np.abs(getattr(found, name)), A, rtol=1e-5, atol=1e-6 * A.max())
    for one, other in ((found.markers[n], native.markers[n]) for n in kinds):
        assert_allclose(one.point, other.point, atol=1e-9)
        for name in ("translation", "rotation"):
            A = np.abs(getattr(other, name))
            assert_allclose(np.abs(getattr(one, name)), A, rtol=1e-5, atol=1e-6 * A.max() + 1e-9)
        A = np.abs(other.hold)
        assert_allclose(np.abs(one.hold), A, rtol=1e-5, atol=1e-6 * A.max())


@pytest.mark.parametrize("units", UNITS)
@pytest.mark.parametrize("fixed", [(), ("root",), ("tip",), ("root", "tip")])
def test_frequencies_in_hertz_do_not_depend_on_units(part, units, fixed):
    wanted = part.frequencies(12, fixed=fixed)
    assert_allclose(part.in_units(units).frequencies(12, fixed=fixed), wanted, rtol=1e-8)


def test_geometric_stiffness_keeps_its_meaning_in_other_units(part):
    """Stiffened by rotation: mm-t-s has the same time, so that Hz and rad/s are the same."""

    def hertz(body, length=1.0):
        at = length * np.array([2.0, 1.0, 3.0])
        return rom.body.rotating_frequencies(body, 3.0, (0.0, 0.6, 0.8), fixed=("root",), at=at)

    stiff = replace(part, K_geo={load: 1e3 * A for load, A in part.K_geo.items()})
    wanted = hertz(stiff)
    assert_allclose(hertz(stiff.in_units("mm-t-s"), 1e3), wanted, rtol=1e-4)
    plain = hertz(replace(part, K_geo={"a_x": 0 * part.K}))
    assert np.abs(plain / wanted - 1).max() > 1e-2


@pytest.mark.parametrize("units", UNITS)
def test_the_motion_does_not_depend_on_the_units_of_the_body(part, units):
    def motion(body):
        mech = rom.Mechanism()
        mech.add_flexible("beam", replace(body, K_geo={}).with_reference("root"), at=(0, 0, 0))
        beam = mech.parts["beam"]
        mech.revolute("pin", mech.ground.marker((0, 0.05, 0.04)), beam.marker("root"),
                      axis=(0, 1, 0))  # fmt: skip
        sol = rom.simulate(mech, t_end=0.01, dt=1e-4)
        return sol.position("beam", "tip"), sol.reaction("pin")

    for found, wanted in zip(motion(part.in_units(units)), motion(part), strict=True):
        scale = np.abs(np.asarray(wanted)).max()
        assert_allclose(np.asarray(found), np.asarray(wanted), atol=1e-6 * scale)


@pytest.mark.parametrize("units", UNITS)
def test_amplitudes_of_second_order_move_the_tip_alike_in_any_units(part, units):
    """phi M^-1 (integral of rho phi psi) q q at q = K^-1 phi^T f, for a force f in newtons."""
    there = part.in_units(units)
    f, moved = Factors.between(unit_system("SI"), unit_system(units)), []
    for body, newton in ((part, 1.0), (there, f.force)):
        tip = body.marker("tip").translation
        q = np.linalg.solve(body.K, tip.T @ (newton * np.ones(3)))
        y = np.linalg.solve(body.M, np.einsum("mkl,k,l", body.second_order().N, q, q))
        moved.append(tip @ y)
    assert_allclose(moved[1], moved[0] * f.length, rtol=1e-9)


def test_bodies_of_different_units_meet_in_si(part):
    half = block(cells=(4, 2, 2), origin=(1.0, 0.0, 0.0))
    kinds = {"root": rom.Polynomial(2), "tip": "rbe2"}
    right = reduced(4, half, interfaces=kinds)
    pair = (("left", "tip"), ("right", "root"))
    both = {"left": part, "right": right}
    wanted = rom.Assembly(both, (pair,)).frequencies(12)
    mixed = {"left": part.in_units("mm-t-s"), "right": right.in_units("mm-kg-ms")}
    assert_allclose(rom.Assembly(mixed, (pair,)).frequencies(12)[6:], wanted[6:], rtol=1e-8)


def steps(f, rate=None, span=(0.0, 1.0), n=500):
    """What is said of a drive, and where it ends, over a run of n steps."""
    drive, ends = Examined("motor", f, rate, span[0]), []
    found = said(
        lambda: ends.extend(drive.up_to(t, (span[1] - span[0]) / n)
                            for t in np.linspace(*span, n // 50 + 1))
    )  # fmt: skip
    return found, ends[-1]


SMOOTH = {
    "constant": lambda t: 1.0 + 0 * t, "zero": lambda t: 0.0 * t, "steady": lambda t: 1e4 * t,
    "fast": lambda t: np.sin(2 * np.pi * 400 * t), "steep": lambda t: np.tanh(1e4 * (t - 0.5)),
    "from rest": lambda t: np.maximum(0.0, t - 0.5) ** 2, "offset": lambda t: 1e3 + 1e-3 * t**2,
    "cycloid": lambda t: np.minimum(t, 0.4) - np.sin(2 * np.pi * np.minimum(t, 0.4) / 0.4)
    * 0.4 / (2 * np.pi),
}  # fmt: skip
JUMPS = {  # function, time, size
    "step": (lambda t: 1.0 * (t > 1 / 3), 1 / 3, 1.0),
    "wrapped": (lambda t: (20 * t) % (2 * np.pi), 2 * np.pi / 20, -2 * np.pi),
    "small on steady": (lambda t: 100 * t + 0.01 * (t >= 0.5), 0.5, 0.01),
    "back": (lambda t: t - 0.2 * (t > 0.9999), 0.9999, -0.2),
}
KINKS = {  # function, time, size
    "halt": (lambda t: np.minimum(t, 0.5), 0.5, -1.0),
    "start": (lambda t: np.maximum(t - 0.25, 0.0), 0.25, 1.0),
    "turn": (lambda t: np.abs(t - 0.7), 0.7, 2.0),
}


@pytest.mark.parametrize("f", SMOOTH.values(), ids=SMOOTH)
def test_smooth_drives_are_not_blamed_however_fast(f):
    assert steps(f) == ([], None)


@pytest.mark.parametrize("case", JUMPS.values(), ids=JUMPS)
def test_a_drive_that_jumps_is_refused_with_time_and_size(case):
    f, time, size = case
    _, (found, error) = steps(f)
    assert isinstance(error, ModelError) and found == pytest.approx(time, abs=1e-6)
    assert f"'motor' jumps by {size:.4g} at t = {time:.5g}"[:26] in str(error)


@pytest.mark.parametrize("case", KINKS.values(), ids=KINKS)
def test_a_drive_whose_velocity_jumps_is_doubted_once(case):
    f, time, size = case
    found, end = steps(f)
    assert len(found) == 1 and end is None
    assert f"'motor' jumps by {size:.4g} at t = {time:.6g} s" in found[0]


@pytest.mark.parametrize(("factor", "n"), [(1.0, 0), (1.001, 0), (9.55, 1), (-1.0, 1)])
def test_a_rate_that_is_not_that_of_the_value_is_doubted(factor, n):
    found, _ = steps(lambda t: np.sin(3 * t), lambda t: factor * 3 * np.cos(3 * t))
    assert len(found) == n and all("the rate given for drive 'motor'" in text for text in found)


@pytest.mark.parametrize("method", ["generalized-alpha", "bdf", "dop853"])
def test_the_motion_before_a_jump_is_kept(method):
    mech = pendulum()
    mech.drive("motor", "pin", lambda t: 0.1 * t + 1.0 * (t > 0.0333))
    with pytest.raises(ModelError, match=r"'motor' jumps by 1 at t = 0.0333") as caught:
        rom.simulate(mech, t_end=0.1, dt=1e-3, method=method)
    assert caught.value.solution.t[-1] <= 0.0333


def test_loads_may_jump():
    mech = pendulum()
    push = mech.parts["bob"].marker("a")
    mech.force("push", push, lambda t: np.array([0.0, 0.0, 5.0 * (t > 0.0333)]))
    assert said(lambda: rom.simulate(mech, t_end=0.05, dt=1e-3)) == []


def test_digits_lost_are_two_for_each_factor_of_ten():
    assert not far_doubt(99.0, 1.0, "it")
    assert "about 6 of 16" in far_doubt(1e3, 1.0, "it")
    assert "about 12 of 16" in far_doubt(1e6, 1.0, "it")


@pytest.mark.parametrize(("ratio", "told"), [(99.0, 0), (101.0, 1)])
def test_mass_is_carried_within_a_hundred_sizes_of_the_model(ratio, told):
    model = block(size=(1.0, 0.1, 0.1))
    place = model.interfaces["tip"].origin + np.array([0.0, 0.0, ratio])
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        carried_displacements(rom.Attachment("tip", 1.0, at=place), model)
    assert len(said) == told
