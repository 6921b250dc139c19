"""rom report: one HTML file that says what something is, without network."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.files.reports import read
from cases.files.toml_files import laid_out
from cases.solid import block, reduced
from rom.cli.main import main
from rom.report.pages import of_body

ADDRESS, XML_NAME = re.compile(r"[a-z]*://[^\s\"'<]*"), "http://www.w3.org/1999/xhtml"


@pytest.fixture(scope="module")
def rod(tmp_path_factory):
    how = {"reference": "root", "name": "bar <1>", "certify": True}
    body = reduced(40, block(cells=(6, 1, 1)), **how)
    return rom.save(body, tmp_path_factory.mktemp("rod") / "rod.rom.npz")


@pytest.fixture
def folder(rod, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return laid_out(tmp_path, rod)


def reported(*words):
    """The report, after a look at what it links to: nothing but the data of its pictures."""
    assert main(["report", *words, "-o", "r.html", "-q"]) == 0
    reader = read(Path("r.html"))
    assert all(link.startswith("data:image/") for link in reader.links)
    assert set(ADDRESS.findall(Path("r.html").read_text())) <= {XML_NAME}
    return reader


@pytest.fixture
def bare(folder, monkeypatch):
    """The folder, where no picture can be drawn."""

    def refuse(package):
        raise rom.ResourceError(f"pictures need {package}, which is not installed.")

    for module in ("page", "offscreen"):
        monkeypatch.setattr(f"rom.view.canvas.{module}.require", refuse)
    return folder


def has(text, *words):
    assert [word for word in words if word not in text] == []


@pytest.mark.once
def test_a_body_is_described_with_its_numbers(folder):
    pytest.importorskip("pyvista", reason="VTK comes with the pictures")
    reader = reported("rod.rom.npz")
    body = rom.load("rod.rom.npz")
    assert len(reader.links) == 2  # modes, and errors of frequencies
    full = body.provenance["comparison"]["free"]["full"]
    has(reader.text, "bar <1>", f"{body.mass:.5g}", f"{full[0]:.5g}", "root", "tip", "rbe2",
        "rom report rod.rom.npz -o r.html", rom.__version__, "CraigBampton", "asymmetry of K",
        "has a certificate that holds")  # fmt: skip
    assert "FAILS" not in reader.text
    failed = rom.Report("certificate", (rom.model.Row("gap", 2.0, "<= 1", False),))
    _, sections = of_body(replace(body, certificate=failed), [])
    loud = "this yet: the certificate of bar &lt;1&gt; FAILS, most in gap"
    assert sections["What it is"][0].startswith(f"<p>Do not rely on {loud}")


def test_inertia_is_that_about_the_mass_centre(bare):
    """A bar of 1 m: m (a^2 + b^2) / 12 along each axis."""
    text = reported("rod.rom.npz").text
    m = 7850 * 1.0 * 0.1 * 0.08
    has(text, *(f"{m * x / 12:.5g}" for x in (0.1**2 + 0.08**2, 1 + 0.08**2, 1 + 0.1**2)))
    assert "No picture here: pictures need" in text


def test_a_mechanism_is_described_as_it_starts_and_moved_where_that_is_asked_for(bare, capsys):
    has(reported("crank.toml").text, "Mechanism crank", "3 bodies", "4 joints", "revolute",
        "crank.pin and rod.root", "drive", "main bearing", "ground.end",
        "[bodies.slider]")  # fmt: skip
    text = reported("pendulum.toml", "--move").text
    has(text, "Mechanism pendulum", "Reached t = 0.5 s.", "energy balance / energy")
    assert main(["report", "rod.rom.npz", "--move", "-o", "s.html"]) == 2
    assert "rod.rom.npz must be a mechanism file" in capsys.readouterr().err
    assert not (bare / "s.html").exists()


def test_finished_runs_of_mechanisms_and_bodies_are_described(bare):
    assert main(["simulate", "pendulum.toml", "--t-end", "0.1", "-q", "-o", "out"]) == 0
    text = reported("out").text
    record = json.loads((bare / "out" / "run.json").read_text())
    has(text, "pendulum", "200 steps", "Reached t = 0.1 s.", "pivot", "revolute", "[simulation]",
        "rom simulate pendulum.toml --t-end 0.1 -q -o out",
        *(row[0] for row in record["audit"]["rows"]))  # fmt: skip
    numbers = np.genfromtxt(bare / "out" / "motion.csv", delimiter=",", names=True)
    gained = float(numbers["kinetic_J"][-1])
    assert f"{gained:.5g}" in text
    assert_allclose(gained, 2 * 9.81 * -numbers["bob_position_y_m"][-1], rtol=1e-4)
    words = ["simulate", "rod.rom.npz", "--hinge", "root", "--t-end", "1e-3", "--dt", "1e-4"]
    assert main([*words, "-q", "-o", "swing"]) in (0, 5)
    said = reported("swing").text
    has(said, "Motion of bar <1>", "hinge", "revolute", "10 steps", "bar <1>.csv")


def test_what_is_no_run_is_refused(folder, capsys):
    (folder / "empty").mkdir()
    (folder / "broken").mkdir()
    (folder / "broken" / "run.json").write_text('{"schema": "rom-run", "version": [1, 0]}')
    for name, words in (("empty", "there is no run.json"), ("broken", "says nothing of name"),
                        ("nope.npz", "nope.npz")):  # fmt: skip
        assert main(["report", name, "-o", "r.html"]) == 3
        assert words in capsys.readouterr().err
    assert main(["report", "rod.rom.npz", "-o", "r.txt"]) == 2
    assert not (folder / "r.html").exists()
