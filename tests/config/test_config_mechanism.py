"""Mechanism files: the motion is that of the same words in Python, and of closed forms."""

import json
import re
import zipfile

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.special import ellipk

import rom
from cases.command import ROOT
from cases.files.schema import answer
from cases.files.toml_files import ALL, CRANK, PENDULUM, laid_out
from cases.long import few
from cases.refusals import refuses
from cases.solid import block, reduced
from rom.cli.main import main
from rom.config.document import parsed
from rom.config.keys import Place
from rom.config.laws import law_kind, law_of
from rom.config.mechanism_fmu import _numbers


@pytest.fixture(scope="module")
def rod(tmp_path_factory):
    body = reduced(4, block(cells=(6, 1, 1)), reference="root", damping=rom.ModalDamping(0.01))
    return rom.save(body, tmp_path_factory.mktemp("rod") / "rod.rom.npz")


@pytest.fixture
def folder(rod, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return laid_out(tmp_path, rod)


def test_the_pendulum_reaches_the_bottom_when_it_must(folder):
    """From the horizontal at rest: after K(1/2) sqrt(I / m g L), with 2 m g L = I omega^2."""
    inertia, moment = 0.025 + 2 * 0.5**2, 2 * 9.81 * 0.5
    quarter = ellipk(0.5) * np.sqrt(inertia / moment)
    changes = {("simulation", "t_end"): quarter, ("simulation", "dt"): "0.1 ms"}
    file = rom.read_mechanism("pendulum.toml", changes)
    sol = file.simulate()
    assert_allclose(sol.position("bob")[-1], [0.0, -0.5, 0.0], atol=2e-7)
    assert_allclose(sol.omega("bob")[-1, 2], -np.sqrt(2 * moment / inertia), rtol=1e-6)


def in_python(rod):
    mech = rom.Mechanism(gravity=(0, -9.81, 0))
    crank = mech.add_rigid("crank", mass=1.0, inertia=(1e-3, 1e-3, 2e-3), at=(0.05, 0, 0),
                           markers={"shaft": (-0.05, 0, 0), "pin": (0.05, 0, 0)})  # fmt: skip
    bar = mech.add_flexible("rod", rom.load(rod), at=(0.1, -0.05, -0.04))
    slider = mech.add_rigid("slider", mass=0.3, inertia=(1e-4,) * 3, at=(1.1, 0, 0),
                            markers={"pin": (0, 0, 0)})  # fmt: skip
    z, T, speed = (0, 0, 1), 0.02, 40 * np.pi
    ground = mech.ground
    mech.revolute("main bearing", ground.marker((0, 0, 0)), crank.marker("shaft"), axis=z)
    mech.revolute("crank pin", crank.marker("pin"), bar.marker("root"), axis=z)
    mech.revolute("wrist pin", bar.marker("tip"), slider.marker("pin"), axis=z)
    mech.prismatic("guide", ground.marker((1.1, 0, 0)), slider.marker("pin"), axis=(1, 0, 0))
    w = 2 * np.pi / T
    mech.drive(
        "motor", "main bearing",
        lambda t: speed * (t**2 / 2 / T + (np.cos(w * t) - 1) / w / (2 * np.pi)),
        rate=lambda t: speed * (t / T - np.sin(w * t) / (2 * np.pi)),
        acceleration=lambda t: speed / T * (1 - np.cos(w * t)),
    )  # fmt: skip
    mech.force("gas", slider.marker("pin"), lambda t: np.array([-50.0 * np.sin(speed * t), 0, 0]))
    return mech


def test_the_slider_crank_is_that_of_python(folder, rod):
    sol = rom.read_mechanism("crank.toml").simulate()
    same = rom.simulate(in_python(rod), t_end=0.01, dt=1e-4, rho_inf=0.8)
    assert_array_equal(sol.t, same.t)
    for name in ("crank", "rod", "slider"):
        assert_allclose(sol.position(name), same.position(name), rtol=0, atol=1e-12)
    assert_allclose(sol.elastic("rod"), same.elastic("rod"), rtol=0, atol=1e-12)
    scale = np.abs(same.reaction("crank pin")).max()
    assert_allclose(sol.reaction("crank pin"), same.reaction("crank pin"), atol=1e-8 * scale)


def test_simulate_leaves_a_folder_that_says_how_it_came_about(folder, capsys):
    words = "simulate pendulum.toml --t-end 0.1 --gravity=0,-1.62,0 -o out -q".split()
    found = answer(capsys, *words)
    assert found["output"] == "out/motion.csv" and found["steps"] == 200
    assert found["also"] == ["out/scene.json", "out/run.json"]
    head, *rows = (folder / "out" / "motion.csv").read_text().splitlines()
    assert head.startswith("t [s],bob position x [m],bob position y [m]") and len(rows) == 201
    fall = float(rows[-1].split(",")[2])  # y = -g m L^2 / I t^2 / 2 as long as it is level
    assert_allclose(fall, -0.5 * 1.62 * 2 * 0.25 / (0.025 + 0.5) * 0.1**2, rtol=1e-3)
    record = json.loads((folder / "out" / "run.json").read_text())
    assert record["command"].startswith("rom simulate pendulum.toml --t-end 0.1")
    assert record["versions"]["rom"] == rom.__version__ and record["source"] == PENDULUM
    assert record["joints"] == {"pivot": "revolute"} and record["bodies"]["bob"]["mass"] == 2.0


@pytest.mark.once
def test_a_film_and_another_form_of_the_table_when_the_file_asks(folder):
    pytest.importorskip("h5py", reason="h5py is not installed")
    text = CRANK + '[output]\nfilm = "glb"\nhistory = "h5"\nmagnify = 20\n'
    (folder / "c.toml").write_text(text)
    assert main(["simulate", "c.toml", "--t-end", "2e-3", "-q", "-o", "out"]) in (0, 5)
    assert {path.name for path in (folder / "out").iterdir()} == {
        "motion.h5", "motion.glb", "scene.json", "run.json",
    }  # fmt: skip
    assert (folder / "out" / "motion.glb").read_bytes()[:4] == b"glTF"


def test_a_column_to_plot_is_looked_for_before_the_run(folder, capsys):
    text = PENDULUM + '[output]\nplot = ["bob position x", "pivto force x"]\n'
    (folder / "p.toml").write_text(text)
    assert main(["simulate", "p.toml", "-o", "out", "-q"]) == 2
    err = capsys.readouterr().err
    assert "p.toml:20: there is no column 'pivto force x' to plot" in err
    assert "Did you mean pivot force x?" in err and not (folder / "out").exists()


@pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")  # its joints are anywhere
def test_every_section_reaches_the_mechanism(folder):
    (folder / "all.toml").write_text(ALL)
    mech = rom.read_mechanism("all.toml").mechanism()
    body = rom.load("rod.rom.npz")
    a, c = mech.parts["a"], body.first_moment / body.mass
    assert a.r == 0 and a.mass == body.mass
    assert_allclose(a.at, [-c[1], c[0], c[2]], atol=1e-12)  # turned by a quarter about z
    assert_allclose(a.velocity, 2 * np.pi * np.array([-c[0], -c[1], 0]), atol=1e-12)
    inertia = np.trace(a.second) * np.eye(3) - a.second  # of a box 1 m x 0.1 m x 0.08 m
    box = a.mass / 12 * np.array([0.1**2 + 0.08**2, 1 + 0.08**2, 1 + 0.1**2])
    assert_allclose(inertia, np.diag(box), rtol=1e-9, atol=1e-9)
    assert_allclose(a.points["tip"], body.marker("tip").point - c, atol=1e-12)
    x = body.marker("tip").point
    assert_allclose(mech.design_point(a.marker("tip")), [-x[1], x[0], x[2]], atol=1e-12)
    kinds = {"turn": "revolute", "slide": "prismatic", "ball": "distance", "gear": "coupling"}
    assert {n: j.kind for n, j in mech.joints.items()} == kinds
    assert_array_equal(mech.parts["c"].spin, [0, 0, 500])
    assert "spin of c" in mech.elements
    assert mech.springs["s"].stiffness == 2000 and mech.springs["s"].free_length == 0.1
    assert mech.springs["s"].damping == 3 and mech.turns["r"].free_angle == np.pi
    assert mech.motors["t"].law(0.0, 0.0, 0.0) == 7.0
    assert mech.motors["f"].law(0.5, 0.0, 0.0) == pytest.approx(1000.0)
    assert_array_equal(np.diag(mech.bushings["u"].stiffness), [1e3, 2e3, 3e3, 1, 2, 3])
    assert_array_equal(mech.loads["w"].vector, [0, 0, 1])
    cable = mech.tendons["rope"]
    assert cable.numbers == (2e3, 3.0, 0.0, 1e-3) and cable.function(2.0) == pytest.approx(3.8)
    assert [(one.radius, one.friction) for one in cable.stations[1:]] == [(0.02, 0.1), (0.0, 0.2)]
    assert mech.frictions["d"].laws[0][0] == 4 and mech.frictions["d"].laws[0][-1] == 1e-3
    assert mech.stops["e"].limits == ((1, np.pi / 4),)
    assert mech.contacts["k"].radius[0] == 0.05 and mech.contacts["k"].law.exponent == 1.5
    (folder / "all.toml").write_text(ALL.replace('pulleys."a.tip"]', 'pulleys."a.tap"]'))
    made = rom.read_mechanism("all.toml").mechanism
    refuses(rom.ConfigError, r"'a.tap' is no marker of the path.*a\.tip", made)


def law(text, unit):
    place = Place(parsed(f"law = {text}", "x"))
    return law_of(law_kind(unit).read(place.document.data["law"], place.at("law")), place)


@pytest.mark.parametrize(
    "text",
    [
        '{ kind = "steady", rate = "60 rpm", start = "90 deg" }',
        '{ kind = "run-up", rate = "60 rpm", duration = "0.5 s" }',
        '{ kind = "ramp", from = 1, to = 3, start = 0.2, duration = 0.9 }',
        '{ kind = "harmonic", amplitude = 2, frequency = "3 Hz", phase = 1, mean = 4 }',
        '{ kind = "table", t = [0, 0.4, 1, 2], values = [0, 2, -1, 5] }',
    ],
)
def test_rates_and_accelerations_are_derivatives(text):
    """Else a drive does work its constraint knows nothing of."""
    f, t, h = law(text, "rad"), np.linspace(0.03, 1.37, 29), 1e-4
    assert_allclose(f.rate(t), (f.value(t + h) - f.value(t - h)) / (2 * h), rtol=1e-5, atol=2e-5)
    second = (f.value(t + h) - 2 * f.value(t) + f.value(t - h)) / h**2
    assert_allclose(f.acceleration(t), second, rtol=1e-4, atol=2e-3)


def test_laws_have_the_values_they_say():
    steady = law('{ kind = "steady", rate = "60 rpm", start = "90 deg" }', "rad")
    assert_allclose(steady.value(2.0), 4.5 * np.pi)
    up = law('{ kind = "run-up", rate = 10, duration = 0.5 }', "rad")
    assert_allclose([up.rate(0.0), up.rate(0.5), up.value(1.5)], [0.0, 10.0, 12.5], atol=1e-14)
    ramp = law('{ kind = "ramp", to = "3 N", start = 1, duration = 2 }', "N")
    assert_allclose([ramp.value(0.0), ramp.value(2.0), ramp.value(9.0)], [0.0, 1.5, 3.0])
    points = law('{ kind = "table", t = [0, 1, 2], values = ["1 mm", "2 mm", 0] }', "m")
    assert_allclose([points.value(0.0), points.value(1.0)], [1e-3, 2e-3])
    assert law('"3 kN"', "N").value(7.0) == 3000.0


DRIVE = '[drives.m]\njoint = "pivot"\nlaw = '
TABLE = DRIVE + '{ kind = "table", t = [0, %s], values = [0, 1, 2] }\n'
MISTAKES = {  # what stands in the file, or nothing; what instead, or behind it; line, and culprit
    "unknown marker": ('"bob.top"', '"bob.topp"', 12, "'topp'. Did you mean top?"),
    "unknown body": ('"bob.top"', '"bo.top"', 12, "'bo'. Did you mean bob? Known: ground, bob."),
    "no marker": ('"bob.top"', '"bob"', 12, "joints.pivot.between = 'bob' is no marker."),
    "three markers": ('"bob.top"]', '"bob.top", "bob.top"]', 12, "two markers are needed"),
    "axis of two": ("[0, 0, 1]", "[0, 1]", 13, "needed is a list 3"),
    "no length": ("[0, 0, 1]", "[0, 0, 0]", 10, "axis of pivot has length zero"),
    "inertia": ('["0.01 kg m^2", 0.02, 0.025]', "[1, 1, 9]", 4, "bob: inertia has principal mom"),
    "name with a dot": ("[bodies.bob]", '[bodies."b.c"]', 4, "'b.c' is no name for a body"),
    "rho": ("rho_inf = 1", "rho_inf = 7", 18, "rho_inf"),
    "unknown section": ("[simulation]", "[springy.x]\n[simulation]", 15, "Did you mean springs?"),
    "unknown joint": ("", DRIVE.replace("pivot", "pivto") + "1\n", 20, "'pivto'. Did you mean"),
    "a way for an angle": ("", DRIVE + '"1 m"\n', 21, "drives.m.law: '1 m' is a length; an angle"),
    "short table": ("", TABLE % "0.05, 0.1", 21, "of drives.m.law cover 0 s to 0.1 s; the run"),
    "table that falls": ("", TABLE % "2, 1", 21, "law.t = [0, 2, 1] must be 2 or more numbers"),
    "stop": ("", '[stops.m]\njoint = "pivot"\nstiffness = 1\n', 19, "stop 'm' has no limit"),
    "missing file": ("", '[bodies.x]\nfile = "nope.rom.npz"\n', 19, "nope.rom.npz"),
    "no bodies": (PENDULUM, "[simulation]\nt_end = 1.0\n", 2, "bodies is missing"),
    "a component": (PENDULUM, '[geometry]\nfile = "x.geo"\n', 2, "this is a component"),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_a_mistake_is_told_with_file_and_line(case, tmp_path):
    old, new, line, culprit = MISTAKES[case]
    assert old in PENDULUM
    (tmp_path / "p.toml").write_text(PENDULUM.replace(old, new) if old else PENDULUM + new)
    with pytest.raises(rom.RomError) as refused:
        rom.read_mechanism(tmp_path / "p.toml").simulate()
    assert f"p.toml:{line}" in refused.value.where and culprit in str(refused.value)


def test_markers_far_apart_are_warned_of(tmp_path):
    (tmp_path / "p.toml").write_text(PENDULUM.replace('"-500 mm"', '"-400 mm"'))
    with pytest.warns(rom.errors.RomWarning, match=r"p.toml:10: .* 'pivot' are 0.1 m apart"):
        rom.read_mechanism(tmp_path / "p.toml").mechanism()


@pytest.mark.long
@pytest.mark.fenicsx
def test_the_sample_is_the_mechanism_of_the_demo(tmp_path):
    for folder in ("meshes", "demos"):
        (tmp_path / folder).mkdir()
    for name in ("connecting_rod", "crank"):
        (tmp_path / "meshes" / f"{name}.geo").symlink_to(ROOT / "meshes" / f"{name}.geo")
        text = re.sub('lc = "[^"]*"', 'lc = "9 mm"', (ROOT / "meshes" / f"{name}.toml").read_text())
        text = text.replace("modes = 20", "modes = 20\ncertificate = false")
        (tmp_path / "meshes" / f"{name}.toml").write_text(text)
    sample = tmp_path / "demos" / "slider_crank.toml"
    sample.write_text((ROOT / "demos" / "slider_crank.toml").read_text())
    sol = rom.read_mechanism(sample, {("simulation", "t_end"): "0.4 ms"}).simulate()
    steel = rom.Material(E=210e9, nu=0.3, rho=7850.0)
    model = rom.fe.model(ROOT / "meshes" / "crank.geo", material=steel, parameters={"lc": 9e-3})
    crank = rom.mass_properties(model)
    assert_allclose(sol.mechanism.parts["crank"].mass, crank.mass, rtol=1e-12)
    assert_allclose(sol.mechanism.parts["crank"].at, crank.centre, atol=1e-12)
    pins = sol.position("rod", "pin_b") - sol.position("rod", "pin_a")
    assert_allclose(np.linalg.norm(pins, axis=1), 0.2, atol=1e-4)  # bores are polygons


FMU_CASES = {
    "as it is": {},
    "another frame": {("bodies", "rod", "reference"): ["tip"]},
    "a rigid rod, pushed, and another that flies": {
        ("bodies", "rod", "rigid"): True, ("bodies", "rod", "velocity"): ["1 mm/s", 0, 0],
        ("bodies", "free"): {
            "file": "rod.rom.npz", "rigid": True, "at": [1.0, 2.0, 3.0], "velocity": [3.0, 0, 1.0],
            "orientation": {"axis": [1, 2, 3], "angle": "40 deg"}, "omega": [1.0, 20.0, -5.0],
        },
    },
}  # fmt: skip


@pytest.mark.long
@pytest.mark.once
@pytest.mark.parametrize("case", few(1, FMU_CASES))
def test_an_fmu_of_a_file_moves_as_the_file(case, folder, monkeypatch):
    fmpy = pytest.importorskip("fmpy", reason="fmpy is not installed")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.delenv("ROM_PYTHON", raising=False)
    file = rom.read_mechanism("crank.toml", FMU_CASES[case])
    free = ["free.tip"] if ("bodies", "free") in FMU_CASES[case] else []
    names = ["slider.pin", "main bearing", *free] if case != "as it is" else None
    rom.write_mechanism_fmu(file, "crank.fmu", outputs=names)
    sol = file.simulate()
    (folder / "rod.rom.npz").unlink()
    (folder / "crank.toml").unlink()
    place, tip = ([f"{x}.position[{k}]" for k in (1, 2, 3)] for x in ("slider.pin", "free.tip"))
    output = [*place, *(tip if free else []), "'main bearing'.angle"]
    found = fmpy.simulate_fmu("crank.fmu", stop_time=0.01, step_size=1e-4, output_interval=1e-4,
                              fmi_type="CoSimulation", output=output)  # fmt: skip
    moved = np.column_stack([found[name] for name in place])
    assert_allclose(moved, sol.position("slider", "pin"), atol=1e-9)
    if free:
        flown = np.column_stack([found[name] for name in tip])
        assert_allclose(flown, sol.position("free", "tip"), atol=1e-9)
    assert_allclose(found["'main bearing'.angle"], sol.joint("main bearing").angle, atol=1e-8)


def test_a_rigid_body_of_a_file_goes_into_an_fmu_by_numbers_that_make_it_again():
    turned, inertia = (0.8, 0.0, 0.6, 0.0), np.diag([0.3, 0.2, 0.4]) + 0.01
    moving = {"velocity": (1, 2, 3), "omega": (4, 5, 6), "markers": {"a": (0.1, 0, 0)}}
    how = {"mass": 2.0, "inertia": inertia, "at": (7, 8, 9), "orientation": turned, **moving}
    made = _numbers(rom.Mechanism().add_rigid("b", **how))
    for key in ("mass", "inertia", "at", "orientation", "velocity", "omega"):
        assert_allclose(made[key], how[key], atol=1e-15)
    assert made["markers"] == {"a": [0.1, 0.0, 0.0]} and not any(made["spin"])


@pytest.mark.once
def test_the_command_line_writes_fmus_of_mechanisms(folder, capsys):
    assert answer(capsys, *"export pendulum.toml p.fmu --dt 1e-3".split())["format"] == "fmu"
    with zipfile.ZipFile("p.fmu") as archive:
        settings = json.loads(archive.read("resources/fmu.json"))
    assert settings["dt"] == 1e-3 and settings["outputs"] == ["bob.top", "pivot"]
    assert settings["rho_inf"] == 1.0


@pytest.mark.once
@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["crank.toml", "c.fmu", "--inputs", "gass"], "no input 'gass'"),
        (["crank.toml", "c.fmu", "--outputs", "slider.pine"], "no output 'slider.pine'"),
        (["crank.toml", "c.vtu"], "a unit is written as .fmu"),
        (["crank.toml", "c.fmu", "--held", "root"], "--held does not go with a .toml file"),
        (["rod.rom.npz", "c.fmu", "--inputs", "gas"], "--inputs needs the .toml file of a"),
        (["still.toml", "c.fmu"], "gives no dt, which an FMU needs"),
    ],
)
def test_what_cannot_become_an_fmu_is_named(words, message, folder, capsys):
    still = PENDULUM.replace('dt = "0.5 ms"', 'method = "dop853"').replace("rho_inf = 1", "")
    (folder / "still.toml").write_text(still)
    assert main(["export", *words]) in (2, 4)
    assert message in capsys.readouterr().err
    assert not (folder / "c.fmu").exists() and not (folder / "c.vtu").exists()
