"""Whatever a mechanism can do in Python, its file can say; refusals there have file and line."""

import inspect
import re
from functools import wraps

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import rom
from cases.files.toml_files import PENDULUM
from cases.solid import block, reduced

# elements of any family, by what others make in Python
OF_OTHERS = {"add", "check_apart", "check_markers"}


def adding_methods():
    """Methods whose first argument is the name of what they add."""
    found = set()
    for name in dir(rom.Mechanism):
        method = getattr(rom.Mechanism, name)
        if inspect.isfunction(method) and not name.startswith("_"):
            arguments = list(inspect.signature(method).parameters)
            if arguments[1:2] == ["name"] and len(arguments) > 2:
                found.add(name)
    return found - OF_OTHERS


BASE = """
[ground]
o = [0, 0, 0]
[bodies.a]
mass = 1
inertia = [1, 1, 1]
at = [0, 0, 0]
markers = { p = [0, 0, 0], q = [0, 0, 1] }
[bodies.soft]
file = "soft.rom.npz"
at = [3, 0, 0]
[joints.turn]
kind = "revolute"
between = ["ground.o", "a.p"]
axis = [0, 0, 1]
[joints.other]
kind = "cylindrical"
between = ["ground.o", "soft.root"]
axis = [0, 0, 1]
[simulation]
t_end = 1
"""
ENDS = 'between = ["ground.o", "a.q"]\n'
IMPACT = "stiffness = 1e6\n"


def joint(kind, more=""):
    return f'[joints.new]\nkind = "{kind}"\n{ENDS}{more}\n'


def contact(kind, *more):
    return f'[contacts.new]\nkind = "{kind}"\n{"".join(more)}{IMPACT}'


AXIS, NORMAL, RADIUS = "axis = [0, 0, 1]\n", "normal = [0, 0, 1]\n", "radius = 0.1\n"
COVER = 'body = "soft"\nmarker = "ground.o"\n'
RADII, BAR = "radius1 = 0.1\nradius2 = 0.1\n", "axis1 = [1, 0, 0]\nlength1 = 0.5\n"
ENTRIES = {  # method: an entry that calls it
    "add_rigid": "[bodies.new]\nmass = 1\ninertia = [1, 1, 1]\nat = [0, 0, 0]\n",
    "add_flexible": '[bodies.new]\nfile = "soft.rom.npz"\nq = [0, 0, 0, 0, 0, 0, 1e-6]\n'
    "qd = [0, 0, 0, 0, 0, 0, 2e-6]\n",
    "add_nonlinear": '[rods.new]\npoints = [[0, 0, 0], [1, 0, 0]]\nelements = 3\n'
    'section = { kind = "circle", diameter = "1 cm" }\n'
    'material = { E = "210 GPa", nu = 0.3, rho = 7850 }\n',
    **{kind: joint(kind, AXIS) for kind in
       ("revolute", "cylindrical", "prismatic", "point_on_line")},
    "spherical": joint("spherical"),
    "fixed": joint("fixed"),
    "distance": joint("distance"),
    "universal": joint("universal", "axis1 = [1, 0, 0]\naxis2 = [0, 1, 0]"),
    "planar": joint("planar", NORMAL),
    "point_on_plane": joint("point_on_plane", NORMAL),
    "screw": joint("screw", AXIS + 'pitch = "1 mm"'),
    "rolling": joint("rolling", NORMAL + "radius = 1"),
    "gear": '[joints.new]\nkind = "gear"\njoint1 = "turn"\njoint2 = "other"\nratio = 2\n',
    "drive": '[drives.new]\njoint = "turn"\nlaw = { expression = "sin(t)" }\n',
    "motor": '[motors.new]\njoint = "turn"\nlaw = { expression = "-x - v" }\n',
    "spring_damper": f"[springs.new]\n{ENDS}stiffness = 1\n",
    "rotational_spring": '[rotational_springs.new]\njoint = "turn"\nstiffness = 1\n',
    "bushing": f"[bushings.new]\n{ENDS}stiffness = [1, 1, 1]\n",
    "rolling_bearing": '[rolling_bearings.new]\nbetween = ["a.p", "ground.o"]\n'
    'axis = [0, 0, 1]\nballs = 9\nball_diameter = "12.7 mm"\npitch_diameter = "65 mm"\n',
    "journal_bearing": '[journal_bearings.new]\nbetween = ["a.p", "ground.o"]\n'
    'axis = [0, 0, 1]\noil = { grade = 46 }\ninlet = 40\n[journal_bearings.new.bearing]\n'
    'diameter = "100 mm"\nlength = "50 mm"\nclearance = "0.1 mm"\ncells_around = 40\n'
    'grooves = { top = { angle = "90 deg", width = "20 deg" } }\n',
    "gear_mesh": '[gear_meshes.new]\nbetween = ["a.p", { ground = [0.06, 0, 0] }]\n'
    'axis = [0, 0, 1]\nstiffness = "13 GPa"\n[gear_meshes.new.pair]\nteeth = [30, 30]\n'
    'module = "2 mm"\nwidth = "10 mm"\n',
    "tendon": '[tendons.new]\npath = ["ground.o", "a.q", "soft.root"]\nEA = "1 kN"\n'
    'pulleys = { "a.q" = { radius = "5 cm", axis = [0, 1, 0], turns = 1 } }\n',
    "force": '[forces.new]\nmarker = "a.q"\nvector = [1, 0, 0]\n',
    "torque": '[torques.new]\nmarker = "a.q"\nvector = [1, 0, 0]\n',
    "friction": '[frictions.new]\njoint = "turn"\ntransition_speed = 1\ncoulomb = 1\n',
    "stop": f'[stops.new]\njoint = "turn"\nupper = 1\n{IMPACT}',
    "law": f'[laws.new]\n{ENDS}expression = "-100*(x - 1) - v"\n',
    "user_force": '[laws.new]\nkind = "user_force"\nmarkers = ["a.q"]\nfile = "f.py"\n'
    'function = "none"\n',
    "sphere_on_plane": contact("sphere_on_plane", ENDS, NORMAL, RADIUS),
    "disc_on_plane": contact("disc_on_plane", ENDS, NORMAL, RADIUS, "axis = [1, 0, 0]\n"),
    "sphere_on_sphere": contact("sphere_on_sphere", ENDS, RADII),
    "sphere_on_cylinder": contact("sphere_on_cylinder", ENDS, AXIS, RADII),
    "capsule_on_capsule": contact("capsule_on_capsule", ENDS, RADII, BAR),
    "surface_on_plane": contact("surface_on_plane", COVER, NORMAL),
    "surface_on_sphere": contact("surface_on_sphere", COVER, RADIUS),
    "surface_on_cylinder": contact("surface_on_cylinder", COVER, AXIS, RADIUS, "inside = true\n"),
    "spread_load": '[spread_loads.new]\nbody = "soft"\ntraction = [0, "1 kPa", 0]\n'
    'factor = { expression = "2*t" }\nframe = "world"\n',
    "event": '[events.new]\nkind = "coordinate"\njoint = "turn"\nvalue = "1 rev"\n',
}  # fmt: skip


@pytest.fixture(scope="module")
def soft(tmp_path_factory):
    body = reduced(1, block(cells=(3, 1, 1)), reference="root")
    return rom.save(body, tmp_path_factory.mktemp("soft") / "soft.rom.npz")


def test_every_method_that_adds_something_has_an_entry():
    assert adding_methods() == set(ENTRIES)


@pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")  # its joints are anywhere
@pytest.mark.parametrize("method", ENTRIES)
def test_an_entry_calls_the_method(method, soft, tmp_path, monkeypatch):
    (tmp_path / "soft.rom.npz").symlink_to(soft)
    (tmp_path / "f.py").write_text("def none(t, a):\n    return (0, 0, 0), (0, 0, 0)\n")
    (tmp_path / "m.toml").write_text(BASE + ENTRIES[method])
    calls, plain = [], getattr(rom.Mechanism, method)

    @wraps(plain)
    def noted(self, name, *arguments, **named):
        calls.append(name)
        return plain(self, name, *arguments, **named)

    monkeypatch.setattr(rom.Mechanism, method, noted)
    made = rom.read_mechanism(tmp_path / "m.toml", trust=True).mechanism()
    assert "new" in calls
    assert any(name.startswith("new") for name in (*made.parts, *made.joints, *made.drives,
                                                    *made.elements, *made.events))  # fmt: skip


def made_of(soft, tmp_path, more):
    if not (tmp_path / "soft.rom.npz").exists():
        (tmp_path / "soft.rom.npz").symlink_to(soft)
    text = BASE[: BASE.index("[joints")] + more + "[simulation]\nt_end=1\n"
    (tmp_path / "m.toml").write_text(text)
    return rom.read_mechanism(tmp_path / "m.toml").mechanism()


def test_elastic_coordinates_surfaces_and_spread_loads_are_those_of_python(soft, tmp_path):
    more = ENTRIES["add_flexible"] + ENTRIES["spread_load"].replace("new", "spread")
    more += ENTRIES["surface_on_plane"].replace("new", "k") + "exponent = 1\n"
    more += "mu = 0.2\ntangential_stiffness = 2e6\ntangential_damping = 1e3\n"
    made = made_of(soft, tmp_path, more)
    body, mech = rom.load(soft), rom.Mechanism()
    mech.add_rigid("a", mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0),
                   markers={"p": (0, 0, 0), "q": (0, 0, 1)})  # fmt: skip
    part = mech.add_flexible("soft", body, at=(3, 0, 0))
    q = np.zeros(7)
    q[6] = 1e-6
    mech.add_flexible("new", body, q=q, qd=2 * q)
    law = rom.mbs.Impact(stiffness=1e6, exponent=1.0, mu=0.2, tangential_stiffness=2e6,
                         tangential_damping=1e3)  # fmt: skip
    mech.surface_on_plane("k", mech.ground.marker((0, 0, 0)), part, law, normal=(0, 0, 1))
    load = rom.surface_load(body, traction=(0, 1e3, 0))
    mech.spread_load("spread", part, load, lambda t: 2 * t, frame="world")
    assert_array_equal(made.parts["new"].q, q)
    assert_array_equal(made.parts["new"].qd, 2 * q)
    laws = [next(iter(m.contacts.values())).law for m in (made, mech)]
    assert laws[0] == laws[1]
    sol, same = (rom.simulate(m, t_end=2e-3, dt=1e-4) for m in (made, mech))
    assert_allclose(sol.q, same.q, rtol=0, atol=1e-12)
    assert np.abs(sol.elastic("soft")).max() > 1e-9


@pytest.mark.parametrize(("more", "message"), [
    ("q = [1]\n", "q"),
    ("rigid = true\nq = [0]\n", "a rigid body has no elastic coordinates"),
    ("qd = [0, 0, 0, 0, 0, 0, 0, 1]\n", "qd"),
])  # fmt: skip
def test_elastic_coordinates_must_fit(more, message, soft, tmp_path):
    with pytest.raises(rom.RomError) as refused:
        made_of(soft, tmp_path, f'[bodies.new]\nfile = "soft.rom.npz"\n{more}')
    assert message in str(refused.value) and "m.toml:12" in refused.value.where


MECHANISM = PENDULUM + '[drives.motor]\njoint = "pivot"\nlaw = 1.0\n'
WRONG = ('"text"', "-1.0", "[]", "true", "[1.0]", "1e999", "nan", '"3 furlong"', "{ a = 1 }")


def mutants():
    """One mistake each: another value, no value, no line, an unknown key, a name that is none."""
    lines = MECHANISM.splitlines()
    for k, line in enumerate(lines):
        key, _, value = line.partition(" = ")
        changes = [f"{key} = {wrong}" for wrong in WRONG] if value else []
        changes += [line.replace(key, f"{key}x", 1), f"{key} ="] if value else []
        changes += ["", line.replace('"pivot"', '"pivto"'), line.replace("bob.top", "bob.tpo")]
        changes += [line.replace("[joints.pivot]", "[bodies.bob]"), line.replace("]", "", 1)]
        for change in dict.fromkeys(changes):
            if change != line:
                yield k + 1, change, "\n".join([*lines[:k], change, *lines[k + 1 :]]) + "\n"


@pytest.mark.once
def test_every_refusal_of_a_mechanism_file_has_file_line_and_cure(tmp_path):
    path = tmp_path / "crank.toml"
    refused, taken = 0, []
    for k, change, text in mutants():
        path.write_text(text)
        key, _, value = change.partition(" = ")
        try:
            rom.read_mechanism(path).mechanism()
        except rom.RomError as error:
            refused += 1
            assert re.search(r"crank\.toml:\d+", error.where), (k, change, str(error))
            assert error.hint, (k, change, str(error))
            assert value not in WRONG or key in str(error), (k, change, str(error))
        else:
            taken.append(change)
    free = {"", "law = -1.0", 'name = "text"', 'name = "3 furlong"'}
    assert set(taken) == free and refused > 170
