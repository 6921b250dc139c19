"""The verb update: what it prints is what `rom.update` finds, and the body it writes is updated."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.components.updating import BOLTS, assert_right, crossed, family_of, halves, noisy_test
from cases.files.schema import errors
from cases.long import ROM_LONG
from rom import updating
from rom.cli.main import main
from rom.cli.schemas import schema
from rom.parametric import FamilyAssembly

pytestmark = pytest.mark.once  # the environment without FEniCSx has no h5py
PARAMETERS = {name: rom.YoungsModulus(name, 0.4, 2.5) for name in ("inner", "outer")}
TRUE = {"inner": 1.3, "outer": 0.8}
SPRING = updating.GroundSpring("tip", (0.0, 2e5, 3e5), 0.1, 10.0)
MASS = updating.AddedMass("tip", 0.4, 0.1, 10.0)
WORDS = ["--family", "family.rom.npz", "--fixed", "root", "--damping", "0.02"]
ATTACHED = ["--spring", "soil=tip:0,2e5,3e5:0.1:10", "--mass", "cable=tip:0.4:0.1:10"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A family, two tests of it as HDF5, one with a sensor at the force, and a body alone."""
    pytest.importorskip("h5py", reason="h5py is not installed")
    path = tmp_path_factory.mktemp("update")
    family = family_of(PARAMETERS, (8, 1, 1), 8)
    rom.save(family, path / "family.rom.npz")
    rom.save(family.body, path / "body.rom.npz")
    sensors = crossed([[x, y, 0.08] for x in (0.5, 0.75, 1.0) for y in (0.0, 0.1)])
    own = np.delete(np.arange(12), 10)  # of two along y on the rigid face of the tip one is enough
    for name, seeing, force in (
        ("test.h5", sensors, updating.Channels([[0.75, 0.1, 0.0]], [[0, 1, 2]])),
        ("driven.h5", sensors.some(own), sensors.some([7])),
    ):
        how = {"level": np.sqrt(2) * 0.02, "averages": 50, "seed": 2, "fixed": ("root",)}
        test = noisy_test(family, TRUE, (seeing, force), np.linspace(20, 900, 80), **how)
        rom.io.write_responses(test, path / name)
    return path


@pytest.fixture(autouse=True)
def there(folder, monkeypatch):
    monkeypatch.chdir(folder)


def told(words, capsys, code=0):
    assert ended(words, capsys) == code
    found = json.loads(capsys.readouterr().out)
    assert errors(found, schema("update")) == []
    return found


def ended(words, capsys):
    """The exit code, of the parser or of the verb; what was written before is forgotten."""
    capsys.readouterr()
    try:
        return main(words)
    except SystemExit as end:
        return end.code


def answered(words, capsys, code=0, file="test.h5"):
    return told(["update", file, *WORDS, *words, "--json"], capsys, code)


def refused(words, message, capsys):
    assert ended(["update", *words], capsys) == 2
    assert message in capsys.readouterr().err


def updated(file="test.h5", **options):
    family, test = rom.load("family.rom.npz"), rom.io.read_responses(file)
    noise = {name: options.pop(name) for name in ("force_noise", "estimator") if name in options}
    return rom.update(family, replace(test, **noise), fixed=("root",), damping=0.02, **options)


def assert_same(found, same):
    assert found["factors"] == same.factors and found["deviations"] == same.deviations


def test_the_verb_finds_what_the_function_finds_and_writes_the_body(capsys):
    found = answered(["-o", "updated.rom.npz"], capsys)
    family, same = rom.load("family.rom.npz"), updated()
    assert_same(found, same)
    assert found["report"]["ok"] and "failed" not in found
    assert_right(same, TRUE)
    body = rom.load("updated.rom.npz")
    assert_allclose(body.modes(4).omega, family.at(**same.factors).modes(4).omega, rtol=1e-12)
    own = body.provenance["updating"]
    assert own["deviations"] == same.deviations and own["verdict holds"] is True
    assert own["lines"] == 80 and own["sensors"] == 12


def test_noise_of_forces_springs_masses_candidates_and_priors_are_taken(capsys):
    found = answered(["--force-noise", "0.03", "--estimator", "H1"], capsys)
    assert_same(found, updated(force_noise=0.03, estimator="H1"))
    found = answered([*ATTACHED, "--candidate", "cable", "--free", "inner",
                      "--prior", "inner=0.5"], capsys, code=5)  # fmt: skip
    options = {"free": ("inner",), "prior": {"inner": 0.5}}
    same = updated(attached={"soil": SPRING}, candidates={"cable": MASS}, **options)
    assert found["factors"] == same.factors and found["scores"] == same.scores
    assert set(found["scores"]) == {"outer", "cable"} and found["failed"]


def test_equations_are_taken_with_their_rank_and_a_prior(capsys):
    words = ["--residual", "equations", "--rank", "7", "--prior", "inner=0.01"]
    found = answered(words, capsys, code=5, file="driven.h5")
    assert_same(found, updated("driven.h5", residual="equations", rank=7, prior={"inner": 0.01}))
    free = answered(words[:4], capsys, code=5, file="driven.h5")
    unbiased = answered(["--residual", "response-function"], capsys, file="driven.h5")
    assert unbiased["factors"]["inner"] == pytest.approx(TRUE["inner"], rel=0.01)
    assert found["deviations"]["inner"] < 0.01 and found["factors"] != free["factors"]


@pytest.mark.parametrize("ending", ["csv", "uff"])
def test_a_test_is_planned(capsys, ending):
    words = ["--plan", "5,2", "--lines", "20:900", "--noise", "0.02", "--prior", "inner=0.3",
             *ATTACHED[:2], "-o", f"plan.{ending}"]  # fmt: skip
    found = told(["update", *WORDS, *words, "--force", "--json"], capsys)
    family = rom.load("family.rom.npz")
    offered = updating.candidates(family.body, 20, fixed=("root",))
    same = updating.place(
        family, offered, offered, np.linspace(20, 900, 100), n_sensors=5, n_inputs=2, noise=0.02,
        fixed=("root",), attached={"soil": SPRING}, damping=0.02, prior={"inner": 0.3},
    )  # fmt: skip
    assert Path(f"plan.{ending}").read_text() == getattr(same, ending)()
    assert found["deviations"] == same.deviations
    points = np.hstack([same.sensors.points, same.sensors.directions])
    assert_allclose(found["plan"]["sensors"], points)
    assert_allclose(np.array(found["plan"]["inputs"])[:, :3], same.inputs.points)


def test_a_plan_is_drawn_and_has_a_size_of_its_own(capsys):
    words = ["--plan", "--lines", "20:900", "--floor", "0.02", "-o", "plan.png"]
    found = told(["update", *WORDS, *words, "--force", "--json"], capsys)
    assert [len(found["plan"][name]) for name in ("sensors", "inputs")] == [8, 1]
    assert Path("plan.png").read_bytes()[:4] == b"\x89PNG"
    # without a floor antiresonances tell too much
    quiet = told(["update", *WORDS, *words[:4], "0", "--json"], capsys)
    for name in TRUE:
        assert found["deviations"][name] > 2 * quiet["deviations"][name]


def test_points_are_drawn_also_where_they_are_off_the_body(capsys, monkeypatch):
    drawn = []
    monkeypatch.setattr("rom.view.plane", lambda scenes, path, **k: drawn.append((scenes, path, k)))
    test = rom.io.read_responses("test.h5")
    points = np.array(test.sensors.points)
    points[3, 2] += 0.5
    off = replace(test, sensors=updating.Channels(points, test.sensors.directions))
    rom.io.write_responses(off, "off.h5")
    refused(["off.h5", *WORDS, "--picture", "points.png"], "sensor 3", capsys)
    ((scenes, path, words),) = drawn
    assert str(path) == "points.png" and len(scenes) == 2
    assert "Largest distance of the 13 points from one of the surface: 0.5 m" in words["caption"]
    assert np.ptp(scenes[0].things["sensors"][0][:, 2]) > 0.5
    picture = ["--picture", "points.svg"]
    refused(["off.h5", *WORDS, *picture], "picture is written as .png", capsys)


LINES = ["--lines", "20:900"]
PLAN = ["--plan", "5,1", *LINES]
WRONG_WORDS = (
    ([], "required: file"),
    (["--plan", "5,1"], "required: --lines"),
    (["test.h5", "--plan", *LINES], "neither a test nor"),
    (["--plan", "5", *LINES], "is not two whole numbers"),
    (["--plan", "5,1", "--lines", "900:20"], "does not ascend"),
    (["test.h5", *PLAN], "neither a test nor"),
    ([*PLAN, "-o", "plan.txt"], "written as .csv, .uff, .png"),
    (["--plan", "500,1", *LINES], "n_sensors = 500"),
    (["test.h5", "--spring", "soil=tip:2e5:0.1"], "must be written INTERFACE:VALUE:LOW:HIGH"),
    (["test.h5", "--mass", "cable=tip:heavy:0.1:10"], "--mass: 'heavy' is not a number"),
    (["test.h5", *ATTACHED[:2], "--mass", "soil=tip:1:0.1:10"], "--mass soil needs a name"),
    (["test.h5", "--rank", "3"], "rank needs residual="),
    (["test.h5", "--residual", "equations"], "input 0 has no sensor at its point"),
    (["test.h5", "--candidate", "cable"], "--candidate cable must name a --spring"),
    (["test.h5", "--family", "body.rom.npz"], "--family family.rom.npz, body.rom.npz:"),
    (["test.h5", "--joint", "j=a.tip,b.tip:1,1,1:0.1:1"], "need an assembly"),
    (["test.h5", "--force-noise", "0.1"], "the estimator of H is not named"),
    (["test.h5", "-o", "family.rom.npz"], "family.rom.npz"),
)


HALVES = ["--family", "frame=frame.rom.npz", "--family", "arm=arm.rom.npz",
          "--fixed", "frame.root", "--damping", "0.02"]  # fmt: skip
LOOSE = {"frame.E": 1.2, "arm.E": 0.9, "bolts": 0.5}
JOINT = ["--joint", "bolts=frame.tip,arm.root:4e8,4e8,4e8,2e5,1e5,1e5:0.1:10"]


@pytest.fixture(scope="module")
def bolted(folder):
    """Two families in files, their assembly, and a test of it in which a sensor names its body."""
    families = halves(8)
    for name, family in families.items():
        rom.save(family, folder / f"{name}.rom.npz")
    points = [[x, y, 0.08] for x in (0.25, 0.5, 0.75, 1.0) for y in (0.0, 0.1)]
    sensors = crossed(points, ("frame",) * 8 + ("arm",) * 8)
    channels = sensors, updating.Channels([[0.75, 0.1, 0]], [[0, 1, 2]])
    whole, f = FamilyAssembly(families), np.linspace(20, 900, 100)
    how = {"level": 0.03, "averages": 50, "seed": 4, "fixed": (("frame", "root"),)}
    test = noisy_test(whole, LOOSE, channels, f, attached={"bolts": BOLTS}, **how)
    rom.io.write_responses(test, folder / "bolted.h5")
    return whole


def test_families_on_a_joint_are_updated_and_written_one_by_one(bolted, capsys):
    words = ["bolted.h5", *HALVES, *JOINT, "-o", "new.rom.npz", "--json"]
    found = told(["update", *words], capsys)
    test = rom.io.read_responses("bolted.h5")
    assert test.sensors.bodies == ("frame",) * 8 + ("arm",) * 8 and test.inputs.bodies is None
    options = {"fixed": (("frame", "root"),), "damping": 0.02}
    same = rom.update(bolted, test, attached={"bolts": BOLTS}, **options)
    assert_same(found, same)
    assert_right(same, LOOSE)
    for name, body in same.assembly.bodies.items():
        written = rom.load(f"new.{name}.rom.npz")
        assert_allclose(written.frequencies(4), body.frequencies(4), rtol=1e-12)


def test_a_coupled_assembly_is_planned(bolted, capsys, monkeypatch):
    monkeypatch.setattr("rom.components.updating.verb.PLAN_POINTS", 6)
    words = ["--plan", "4,1", "--lines", "20:900", "--couple", "frame.tip=arm.root", *HALVES]
    found = told(["update", *words, "-o", "halves.png", "--force", "--json"], capsys)
    assert {"frame.E", "arm.E"} <= set(found["deviations"])
    assert Path("halves.png").read_bytes()[:4] == b"\x89PNG"


WRONG = ("", "nan", "-1", "0", "1e400", "x", "1:2", "a=b", "a=b:c:d:e", "tip:1:1:1", "no.npz",
         "frame.knee", "leg.tip", "q=frame.tip:1,1,1:0:1", "q=frame.tip:1,1,1:2:1",
         "q=frame.tip,arm.root:1,1:1:2", "q=frame.tip:1,1,1:1:2")  # fmt: skip
OPTIONS = (
    "--family", "--averages", "--coherence", "--force-noise", "--estimator", "--points", "--fixed",
    "--free", "--spring", "--mass", "--joint", "--couple", "--candidate", "--prior", "--residual",
    "--rank", "--beside-poles", "--damping", "--tolerance", "--picture", "--plan", "--lines",
    "--noise", "--floor", "-o",
)  # fmt: skip


@pytest.mark.parametrize("option", OPTIONS)
def test_a_wrong_value_of_an_option_is_named(bolted, capsys, option):
    for value in WRONG if ROM_LONG else WRONG[OPTIONS.index(option) % 2 :: 2]:
        words = ["update", "bolted.h5", *HALVES, *JOINT, option, value]
        code = ended(words, capsys)
        out, err = capsys.readouterr()
        assert code in (0, 2, 3, 4, 5), f"{words}: {code}\n{err}"
        assert "Traceback" not in out + err
        if code:
            assert err.startswith(("error:", "usage:")), err
        else:
            assert option == "-o" or value not in ("nan", "1e400"), f"{words}: {out}"


def test_what_is_wrong_with_options_and_families_is_said(bolted, capsys):
    for words, message in WRONG_WORDS:
        refused([*WORDS, *words], message, capsys)
    for words, message in (
        (HALVES[:2] * 2, "--family 'frame' is given twice"),
        ([*HALVES, *JOINT, "--spring", "q=tip:1,1,1:1:2"], "'tip' must be BODY.INTERFACE"),
        ([*HALVES[:4], "--fixed", "root"], "--fixed 'root' must be BODY.INTERFACE, of"),
        ([*HALVES, "--joint", "q=frame.tip:1,1,1:1:2"], "names 1 places, needed are 2"),
        ([*HALVES, "--mass", "q=frame.tip:1,1:1:2"], "a mass must be one number"),
        (["--family", "a=body.rom.npz"], "body.rom.npz holds one body, without parameters"),
    ):
        refused(["bolted.h5", *words], message, capsys)
