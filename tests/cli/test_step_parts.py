"""Five parts from the file of a CAD program to a report that turns, by three commands each."""

import json
import re

import pytest

from cases.command import rom as run_rom
from cases.files.browser import PROGRAM, REASON, WITH_WEBGL, browser
from cases.files.machine_parts import PARTS
from cases.files.step_parts import in_inches

RHO, INCH = 7850.0, 0.0254
STEEL = ("--E", "210e9", "--nu", "0.3", "--rho", str(RHO))
FACES = {  # number of faces; faces by number, point, radius and normal, and the kind of interface
    "bracket": (14, {"foot": ("10+11+12+13", "rbe2"), "bore": ("radius:0.0125", "rbe2")}),
    "crank": (9, {"bore": ("0.012,0,0.008", "rbe2"), "pin": ("radius:0.01", "rbe2")}),
    "wheel": (13, {"bore": ("13", "rbe2")}),
    "cover": (39, {"screws": ("radius:0.0025", "rbe2")}),
    "rack": (200, {"left": ("normal:-1,0,0", "rbe2"), "bolts": ("199+200", "rbe2")}),
}
PICKED = {"bracket": {"foot": [10, 11, 12, 13], "bore": [14]}, "crank": {"bore": [6], "pin": [8]}}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    pytest.importorskip("dolfinx", reason="the parts are made of finite elements")
    pytest.importorskip("pyvista", reason="pictures need pyvista")
    return tmp_path_factory.mktemp("parts")


def done(folder, *words):
    """The answer of a command that is to succeed with nothing to complain of."""
    ended = run_rom(*words, "--json", cwd=folder, timeout=900)
    assert ended.returncode == 0, ended.stderr
    return json.loads(ended.stdout)


@pytest.mark.fenicsx
@pytest.mark.long
@pytest.mark.parametrize("part", PARTS)
def test_a_part_becomes_a_report_by_three_commands(folder, part):
    """Nothing is said but faces: sizes and numbers of modes are found, the certificate holds."""
    volume = PARTS[part](folder / f"{part}.step")
    n_faces, chosen = FACES[part]
    listed = done(folder, "mesh", f"{part}.step", "--faces", "--save", f"{part}.png")
    assert [face["number"] for face in listed["faces"]] == list(range(1, n_faces + 1))
    assert (folder / f"{part}.png").stat().st_size > 20_000
    picks = [f"--face={name}={face}" for name, (face, _) in chosen.items()]
    kinds = [f"-i={name}={kind}" for name, (_, kind) in chosen.items()]
    reduced = done(folder, "reduce", f"{part}.step", *STEEL, *picks, *kinds, "--reference",
                   next(iter(chosen)), "-o", f"{part}.rom.npz")  # fmt: skip
    assert reduced["certificate"]["ok"]
    assert reduced["mass"] == pytest.approx(RHO * volume, rel=2e-4)
    assert reduced["provenance"]["faces"] == PICKED.get(part, reduced["provenance"]["faces"])
    done(folder, "report", f"{part}.rom.npz", "-o", f"{part}.html")
    page = (folder / f"{part}.html").read_text(encoding="utf-8")
    assert "It has a certificate that holds." in page and "None" not in re.sub("<.*?>", "", page)
    if PROGRAM is None:
        pytest.skip(REASON)
    with browser(*WITH_WEBGL) as shown:
        shown.open(folder / f"{part}.html", (640, 560))
        assert not shown.complaints
        assert (shown.pixels()[..., 3] > 200).sum() > 5000


@pytest.mark.fenicsx
@pytest.mark.long
def test_a_part_in_inches_is_as_large_as_it_says(folder):
    volume = PARTS["bracket"](folder / "metric.step")
    in_inches(folder / "metric.step", folder / "inch.step")
    listed = done(folder, "mesh", "inch.step", "--faces")
    assert listed["volume"] == pytest.approx(volume * (INCH / 1e-3) ** 3, rel=2e-4)
    bore = next(face for face in listed["faces"] if face["number"] == 14)
    assert bore["radius"] == pytest.approx(12.5 * INCH, rel=1e-9)
    wrong = run_rom("mesh", "inch.step", "--face=bore=radius:0.0125", cwd=folder)
    assert wrong.returncode == 3 and "0.3175 (1 face)" in wrong.stderr
