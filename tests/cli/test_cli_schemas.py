"""What --json prints is what its schema says, for answers, failures and errors of every verb."""

import json
from dataclasses import asdict

import pytest

import rom
import rom.places
from benchmarks.benchmarks import Figure
from cases.files.schema import answer, errors
from cases.files.toml_files import PENDULUM
from cases.solid import block, reduced
from rom.cli.main import main
from rom.cli.parser import verb_modules
from rom.cli.schemas import schema
from rom.doctor.probes import Finding

NAMES = list(verb_modules())
ANSWERS = {
    "check, with a failed gate": ["check", "poor.rom.npz"],
    "check of another format": ["check", "rod.SID_FEM"],
    "export": ["export", "rod.rom.npz", "x.vtu"],
    "simulate": ["simulate", "rod.rom.npz", "--hinge", "root", "--t-end", "1e-3", "--dt", "1e-4",
                 "--history", "csv", "-o", "out"],
    "report": ["report", "out_of_before", "-o", "r.html"],
    "bench": ["bench", "--list"],
    "demo": ["demo"],
    "completion": ["completion", "bash"],
}  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("schemas")
    for name, m in (("rod", 24), ("poor", 1)):
        body = reduced(m, block(cells=(4, 1, 1)), reference="root", certify=True)
        rom.save(body, path / f"{name}.rom.npz")
    rom.export(body, path / "rod.SID_FEM")
    (path / "pendulum.toml").write_text(PENDULUM)
    arguments = ["simulate", path / "pendulum.toml", "--t-end", "0.01", "-q", "-o"]
    assert main([*map(str, arguments), str(path / "out_of_before")]) == 0
    return path


@pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")
@pytest.mark.parametrize("case", ANSWERS)
def test_an_answer_is_as_its_schema_says(case, folder, capsys, monkeypatch):
    monkeypatch.chdir(folder)
    found = answer(capsys, *ANSWERS[case], "-q", codes=(0, 5))
    assert "error" not in found and found["ok"] is ("failed" not in found)
    assert ("failed" in found) >= ("failed gate" in case)


DEMO = """import pathlib, sys
out = pathlib.Path(sys.argv[2])
(out / "a.png").write_text("picture")
results = {"right": (1.01, 1.0, 0.1), "wrong": (2.0, 1.0, 0.1)}; print("spoken")
"""


def test_a_demo_is_run_as_a_program_and_judged_by_its_numbers(tmp_path, capsys, monkeypatch):
    (tmp_path / "demos").mkdir()
    (tmp_path / "demos" / "demo_two.py").write_text(DEMO)
    monkeypatch.setattr(rom.places, "EXAMPLES", tmp_path)
    found = answer(capsys, "demo", "two", "-o", tmp_path / "out", codes=(5,))
    assert found["failed"] == ["wrong = 2, expected 1 within 0.1"]
    assert found["files"] == [str(tmp_path / "out" / "a.png")]
    assert main(["demo", "two", "-o", str(tmp_path / "out")]) == 2  # the picture is not of rom


def test_the_checker_takes_records_that_take_long_to_make_and_finds_what_is_wrong(capsys):
    finding = asdict(Finding("topic", "name", "1.0", "missing", "install it"))
    figure = asdict(Figure("reduction", "30 dofs", "ratio", 1.5))
    for verb, data in (
        ("doctor", {"rom": "1", "findings": [finding]}),
        ("bench", {"figures": [figure]}),
    ):
        assert errors({"ok": True, **data, "warnings": []}, schema(verb)) == []
    good = {"ok": True, "shell": "bash", "text": "x", "warnings": []}
    assert errors(good, schema("completion")) == []
    for wrong in ({"shell": 3}, {"more": 1}, {"ok": None}, {"warnings": [1]}):
        assert errors(good | wrong, schema("completion"))
    assert errors({key: x for key, x in good.items() if key != "text"}, schema("completion"))


@pytest.mark.parametrize("verb", NAMES)
def test_every_verb_prints_its_schema_and_its_errors_fit(verb, capsys):
    with pytest.raises(SystemExit) as end:
        main([verb, "--json-schema"])
    assert end.value.code == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == schema(verb)
    assert main([verb, "--json", "--no-such-option"]) == 2
    error = json.loads(capsys.readouterr().out)
    assert errors(error, printed) == [] and error["exit_code"] == 2
    parts = list(printed["anyOf"])
    while parts:  # every key is explained
        part = parts.pop()
        assert part.get("description"), part
        parts += filter(None, (*part.get("properties", {}).values(), part.get("items")))
