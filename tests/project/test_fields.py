"""Fields: asked for late, none needed by the core, brought by strangers too."""

import ast
import inspect
import pickle
from textwrap import dedent

import pytest

import rom
from cases.command import ROOT, environment, python
from cases.refusals import refuses
from rom import fields
from rom.components.gear_mesh import GearPair
from rom.fields import FIELDS, families, find, record

PENDULUM = """
import rom
mech = rom.Mechanism()
bob = mech.add_rigid("bob", mass=1.0, inertia=(1e-3,) * 3, at=(1, 0, 0), markers={"p": (-1, 0, 0)})
hinge = mech.ground.marker((0, 0, 0))
mech.revolute("pin", hinge, bob.marker("p"), axis=(0, 1, 0))
sol = rom.simulate(mech, t_end=0.01, dt=1e-3, progress=False)
"""
FILE = """
ground = { o = [0, 0, 0] }
bodies.bob = { mass = 1, inertia = [1, 1, 1], at = [1, 0, 0], markers = { p = [-1, 0, 0] } }
joints.pin = { kind = "revolute", between = ["ground.o", "bob.p"], axis = [0, 1, 0] }
simulation = { t_end = "1 ms", dt = "1 ms" }
"""
CORE = f"""{PENDULUM}
from pathlib import Path
from cases.mbs.trusses import truss
from rom.cli.main import main
body = mech.add_flexible("beam", truss())
mech.spring_damper("s", hinge, body.marker("mean"), stiffness=1.0)
print(rom.simulate(mech, t_end=2e-3, dt=1e-3, progress=False).elastic("beam").shape)
file = Path("fields.toml")
file.write_text({FILE!r})
rom.read_mechanism(file).simulate()
"""
NO_COMPONENTS = "import sys; sys.modules['rom.components'] = None\n"  # as if they were deleted


def run(code, *paths, cwd=None):
    path = ":".join(map(str, [*paths, environment()["PYTHONPATH"]]))
    done = python("-c", dedent(code), cwd=cwd, env=environment(PYTHONPATH=path), timeout=600)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr
    return done


@pytest.mark.parametrize("place", FIELDS)
def test_the_list_has_the_names_by_which_fields_are_asked(place):
    kinds = "methods", "bodies", "sections", "columns", "takes", "verbs", "first_use"
    given = {name for kind in kinds for name in getattr(record(place), kind)}
    words = set(FIELDS[place].split())
    own = given or {place.split(".")[2]}
    assert words == own if place.startswith("rom.components") else given and not words


def test_who_checks_types_sees_what_fields_give():
    tree = ast.parse((ROOT / "rom" / "components" / "methods.pyi").read_text())
    seen = {
        node.name: {getattr(x, "target", None) or x.targets[0] for x in node.body}
        for node in tree.body if isinstance(node, ast.ClassDef)
    }  # fmt: skip
    seen = {kind: {name.id for name in found} for kind, found in seen.items()}
    assert seen == {kind.capitalize(): set(fields.names(kind)) for kind in ("methods", "columns")}


def test_a_pendulum_imports_no_gears_films_races_or_tendons():
    said = run(
        PENDULUM + "import sys; print(*(m for m in sys.modules if m.split('.')[0] == 'rom'))"
    )
    loaded = said.stdout.split()
    assert "rom.mbs.integrate.generalized_alpha" in loaded and len(loaded) <= 120
    words = ("components", "contact", "solids", "springs", "bushings")
    assert not [name for name in loaded for word in words if word in name.split(".")]


def test_methods_of_fields_are_those_of_the_class():
    assert list(inspect.signature(rom.Mechanism.gear_mesh).parameters)[:4] == [
        "self", "name", "wheel_a", "wheel_b"
    ]  # fmt: skip
    assert {"tendon", "tendons", "force"} <= set(dir(rom.Mechanism)) & set(dir(rom.Mechanism()))
    assert "teeth" in rom.Mechanism.gear_mesh.__doc__.lower()
    assert "journal_bearing" in dir(rom.mbs.Solution)
    for thing in (rom.Mechanism(), rom.Mechanism):
        refuses(AttributeError, "gear_mash", getattr, thing, "gear_mash")
    assert find("methods", "gear_mash") is None
    refuses(ModuleNotFoundError, "springs_of", __import__, "rom.mbs.elements.springs_of_gears")


def test_families_keep_their_order_whatever_is_added_first():
    """It is that of tables, of memory in files of states, and of sums."""
    first = [family.name for family in families()]
    assert first.index("springs") < first.index("tendons") < first.index("gear_meshes")
    mech = rom.Mechanism()
    mech.tendon("t", [mech.ground.marker((k, 0, 0)) for k in (0, 1)], EA=1.0)
    mech.force("f", mech.ground.marker((0, 0, 0)), (1, 0, 0))
    mech.spring_damper("s", *(mech.ground.marker((k, 0, 0)) for k in (0, 1)), stiffness=1.0)
    assert [family.name for family in mech.families()] == ["springs", "loads", "tendons"]


def test_all_components_may_be_deleted(tmp_path):
    code = NO_COMPONENTS + CORE + dedent("""
    from rom.cli.parser import build_parser
    def told(call):
        try:
            call()
        except rom.errors.ConfigError as error:
            print(type(error).__name__, error, sep=": ")
    told(lambda: mech.gear_mesh)
    told(lambda: mech.add_rigid("r", mass=1, inertia=(1, 1, 1), at=(0, 0, 0), spin=(0, 0, 1)))
    told(lambda: rom.mbs.Pulley)
    file.write_text(file.read_text() + "[rods.r]\\nelements = 3\\n")
    told(lambda: rom.read_mechanism(file))
    told(lambda: build_parser().parse_args(["update", "test.uff"]))
    print(main(["--help"]) or 0, "rom.components" in str([m for m in sys.modules.values() if m]))
    """)  # fmt: skip
    said = run(code, ROOT / "tests", cwd=tmp_path).stdout
    whose = {"gear_mesh": "gear_mesh", "spin": "round_bodies", "Pulley": "tendons",
             "rods": "cosserat", "update": "updating"}  # fmt: skip
    for name, module in whose.items():
        sentence = f"'{name}' belongs to the field 'rom.components.{module}', which is not in"
        assert sentence in said
    assert said.count("pip install --force-reinstall fenicsx-rom") == 5
    assert "fields.toml:" in said and "VERB" in said


CAMS = {  # the package of a stranger
    "cams/__init__.py": "",
    "cams/field.py": """
        from rom.fields import Field
        FIELD = Field(
            families=("cams.cams:CAMS_FAMILY",),
            methods={"cam": "cams.cams:cam", "cams": "cams.cams:Cam"},
            sections={"cams": "cams.cams:SECTION"},
            symbols={"cams": "cams.cams:draw"},
            columns={"cam": "cams.cams:cam_record"},
            verbs={"cam": "cams.cams"},
        )
        """,
    "cams/cams.py": '''
        """Say how stiff a cam is."""
        from dataclasses import replace
        from rom.cli.answer import Answer
        from rom.arguments import Quantity
        from rom.config.keys import Key, Table
        from rom.config.mechanism_keys import BETWEEN, Section
        from rom.mbs.elements.springs import SPRINGS_FAMILY, Spring

        class Cam(Spring):
            """A spring of a cam."""

        CAMS_FAMILY = replace(SPRINGS_FAMILY, name="cams", record=Cam)

        def cam(self, name: str, i, j, *, stiffness: float) -> None:
            """Add a cam."""
            self.add(name, Cam(i, j, stiffness, 0.0, 0.5), CAMS_FAMILY)

        def cam_record(self, name: str):
            """Its force over time."""
            return self.element(name).along

        def draw(scenery, name, element):
            yield name

        keys = BETWEEN, Key("stiffness", Quantity("N/m"), "Stiffness.", ...)
        SECTION = Section("cams", Table("A cam.", keys),
                          lambda e: e.made.cam(e.name, *e.ends, **e.values))
        SUMMARY, EXAMPLES, SCHEMA = "say how stiff a cam is", "  rom cam", {
            "properties": {"stiffness": {"type": "number"}}, "required": ["stiffness"]}

        def add_options(parser):
            parser.add_argument("--of", type=float, default=1.0)

        def run(arguments):
            return Answer({"stiffness": arguments.of}, "stiff")
        ''',
    "cams-1.0.dist-info/METADATA": "Metadata-Version: 2.1\nName: cams-of-mine\nVersion: 1.0\n",
    "cams-1.0.dist-info/entry_points.txt": "[rom.fields]\ncams = cams.field:FIELD\n",
}
BROKEN = {  # one that fails when it is imported
    "broken/__init__.py": "raise RuntimeError('a disc is full')\n",
    "broken-1.0.dist-info/METADATA": "Metadata-Version: 2.1\nName: broken-field\nVersion: 1.0\n",
    "broken-1.0.dist-info/entry_points.txt": "[rom.fields]\nbroken = broken.field:FIELD\n",
}


def install(folder, package):
    for name, text in package.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(dedent(text))


def test_a_stranger_brings_a_field_in_three_files_beside_one_that_fails(tmp_path):
    install(tmp_path, CAMS)
    install(tmp_path, BROKEN)
    code = PENDULUM + dedent("""
    import inspect, sys
    from pathlib import Path
    from rom.cli.main import main
    assert "cams" not in sys.modules
    ends = mech.ground.marker((0, 0, 1)), bob.marker("p")
    mech.cam("c", *ends, stiffness=2.0)
    same = rom.Mechanism(); same.parts.update(mech.parts); same.joints.update(mech.joints)
    same.spring_damper("c", *ends, stiffness=2.0, free_length=0.5)
    one, two = (rom.simulate(m, t_end=0.01, dt=1e-3, progress=False) for m in (mech, same))
    assert (one.q == two.q).all() and (one.cam("c") == two.element("c").along).all()
    assert list(mech.cams) == ["c"] and "cam" in dir(mech)
    assert mech.families().popitem()[0].name == "cams" and "stiffness" in str(
        inspect.signature(rom.Mechanism.cam))
    try:
        mech.cam("d", *ends, stiffness="soft")
    except rom.errors.ConfigError as error:
        print("told:", error)
    from rom.fields import find
    assert list(find("symbols", "cams")(None, "c", None)) == ["c"]
    file = Path(FOLDER) / "cam.toml"
    file.write_text(FILE + '[cams.c]\\nstiffness = 2\\nbetween = ["ground.o", "bob.p"]\\n')
    assert list(rom.read_mechanism(file).mechanism().cams) == ["c"]
    print(main(["cam", "--of", "3", "--json"]))
    try:
        mech.cogwheel
    except AttributeError as error:
        print(error)
    try:
        main(["--help"])
    except SystemExit:
        pass
    """).replace("FILE", repr(FILE)).replace("FOLDER", repr(str(tmp_path)))  # fmt: skip
    done = run(code, tmp_path)
    assert '"stiffness": 3.0' in done.stdout and "say how stiff a cam is" in done.stdout
    assert "told: Mechanism.cam 'd': stiffness = 'soft'" in done.stdout
    assert done.stderr.count("the field 'broken'") == 1
    assert "RuntimeError: a disc is full" in done.stderr
    assert "pip install --force-reinstall broken-field" in done.stderr


@pytest.mark.parametrize(
    ("thing", "now", "before"),
    [(GearPair((20, 30), 2e-3, 0.02), "gear_mesh.gears.geometry", "mbs.elements.gears.geometry"),
     (rom.updating.Sensors, "updating.observers.operation", "updating.operation"),
     (rom.updating.Responses, "updating.measured", "updating.measured"),
     (rom.mbs.PeriodicMotion, "orbits.motion", "mbs.analysis.periodic.motion"),
     (rom.CyclicSector, "wheels.sector", "cyclic.sector"),
     (rom.SpinUp, "wheels.prestress.spin_up", "prestress.speed_table"),
     (rom.BodyFamily, "families.family", "parametric.family"),
     (rom.io.read_responses, "updating.responses.reading", "io.responses.reading")],
)  # fmt: skip
def test_what_was_pickled_under_the_names_before_is_read(thing, now, before):
    now, before = f"rom.components.{now}\n".encode(), f"rom.{before}\n".encode()
    written = pickle.dumps(thing, protocol=0)
    assert now in written
    assert pickle.loads(written.replace(now, before)) == thing
