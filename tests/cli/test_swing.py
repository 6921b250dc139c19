"""From STEP files to pictures of parts and to a report that turns, by few commands."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.command import rom as run_rom
from cases.files.browser import PROGRAM, REASON, WITH_WEBGL, browser
from cases.files.machine_parts import PARTS
from cases.files.schema import errors
from cases.files.step_parts import step_box, step_plate
from cases.refusals import refuses
from cases.solid import block, reduced
from rom.cli.schemas import schema
from rom.cli.verbs import swing

L, B, H = 1.0, 0.1, 0.08


def period(inertia_over_mass, arm):
    """Of a pendulum let go from the horizontal: 4 K(sin 45°) sqrt(I / m g arm)."""
    return 4 * 1.854074677 * np.sqrt(inertia_over_mass / (9.81 * arm))


@pytest.fixture(scope="module")
def solid():
    return block(size=(L, B, H))


@pytest.fixture(scope="module")
def rigid(solid):
    return rom.mass_properties(solid), solid.interfaces["root"].origin


@pytest.fixture(scope="module")
def bar(solid):
    return reduced(6, solid, interfaces={"root": "rbe2"}, reference="root", certify=True)


def test_a_bar_swings_as_the_rigid_pendulum_does_where_gravity_lets_it(rigid):
    plan = swing.planned(*rigid)
    assert plan.gravity == (0.0, 0.0, -9.81)
    assert_allclose(np.abs(plan.axis), (0, 1, 0), atol=1e-12)
    assert plan.t_end == pytest.approx(period((L**2 + H**2) / 12 + L**2 / 4, L / 2), rel=1e-5)
    plan = swing.planned(*rigid, (0, -1.62, 0), 0.5)
    assert plan.t_end == 0.5 and plan.gravity == (0, -1.62, 0)
    assert_allclose(np.abs(plan.axis), (0, 0, 1), atol=1e-12)
    refuses(rom.ConfigError, "nothing would swing", swing.planned, *rigid, (9.81, 0, 0))


def test_on_a_bore_it_turns_about_the_axis_of_that(rigid):
    plan = swing.planned(*rigid, axis=np.array([0.0, 0.0, 1.0]))
    assert plan.gravity == (0.0, -9.81, 0.0)
    assert_allclose(np.abs(plan.axis), (0, 0, 1), atol=1e-12)
    assert plan.t_end == pytest.approx(period((L**2 + B**2) / 12 + L**2 / 4, L / 2), rel=1e-5)
    oblique = np.array([0.0, 1.0, 1.0]) / np.sqrt(2)
    plan = swing.planned(*rigid, axis=oblique)
    assert_allclose(plan.gravity, 9.81 * np.array([0.0, 1.0, -1.0]) / np.sqrt(2), atol=1e-12)
    assert_allclose(np.cross(plan.axis, oblique), 0, atol=1e-12)
    for along, gravity in (("x", None), ("z", (0, 0, -9.81)), ("z", (9.81, 0, 0))):
        axis = np.array([along == "x", 0, along == "z"], dtype=float)
        refuses(rom.ConfigError, "nothing would swing", swing.planned, *rigid, gravity, axis=axis)


def test_a_single_stiff_interface_has_a_certificate_without_gaps(bar):
    """Its constraint modes are rigid motions, whose stiffness is round-off of either sign."""
    assert all(np.isfinite(row.value) for row in bar.certificate.rows)
    assert not any("in K" in row.quantity for row in bar.certificate.failures)


def test_deformations_are_magnified_until_they_are_seen(bar):
    q = np.zeros((3, bar.n_modes))
    largest = np.linalg.norm(bar.surface.shape[:, 0].reshape(-1, 3), axis=1).max()
    for drawn, factor in ((0.04, 1.0), (0.02, 2.0), (0.0099, 5.0), (2e-5, 2000.0), (0.2, 1.0)):
        q[1, 0] = drawn * L / largest
        assert swing.magnification(bar, q) == factor


def test_a_hinge_is_what_picks_a_face_or_a_name():
    for text in ("12", "0,0.5,-1", "radius:6e-3"):
        assert swing.hinge_of(text) == ("hinge", {"hinge": text})
    assert swing.hinge_of("pin_a") == ("pin_a", {})
    refuses(rom.ConfigError, "--hinge", swing.hinge_of, "0,1")


@pytest.mark.long
@pytest.mark.fenicsx
@pytest.mark.slow
@pytest.mark.filterwarnings(f"ignore::{rom.RomWarning.__module__}.RomWarning")
def test_a_step_file_swings_on_the_face_chosen(tmp_path):
    """A cantilever of 200 x 20 x 10 mm; Euler and Bernoulli are 1 % low, for the hinge is stiff."""
    pytest.importorskip("pyvista", reason="pictures need pyvista")
    step_box(tmp_path / "bar.step", 200, 20, 10)
    found = done(tmp_path, "swing", "bar.step", "--hinge", "0,0.01,0.005", "--material",
                 "aluminium", "-m", 8, "--t-end", "0.02", "-o", "out")  # fmt: skip
    assert errors(found, schema("swing")) == []
    assert found["mass"] == pytest.approx(2700 * 4e-5, rel=1e-9)
    thin = 1.875104**2 / (2 * np.pi) * np.sqrt(70e9 * 0.01**2 / (12 * 2700)) / 0.2**2
    assert found["frequencies"][0] == pytest.approx(thin, rel=0.02)
    assert found["gravity"] == [0, 0, -9.81]
    left = {path.name for path in (tmp_path / "out").iterdir()}
    assert left == {Path(f).name for f in found["files"]}


@pytest.mark.fenicsx
@pytest.mark.slow
@pytest.mark.filterwarnings(f"ignore::{rom.RomWarning.__module__}.RomWarning")
def test_a_step_file_swings_about_its_bore(tmp_path):
    """A plate with two bores, on the small one: a compound pendulum, released flat."""
    pytest.importorskip("pyvista", reason="pictures need pyvista")
    step_plate(tmp_path / "plate.step")
    found = done(tmp_path, "swing", "plate.step", "-p", "lc=0.006", "--face", "pin=radius:0.006",
                 "--hinge", "pin", "-m", 4, "-o", "out")  # fmt: skip
    assert errors(found, schema("swing")) == []
    assert_allclose(np.abs(found["axis"]), (0, 0, 1), atol=1e-12)
    assert found["gravity"] == [0, -9.81, 0]
    body = rom.load(tmp_path / "out" / "plate.rom.npz")
    assert_allclose(body.marker("pin").point, (0.03, 0.03, 0.005), rtol=0, atol=1e-13)
    parts = [(0.1 * 0.06, 0.05, (0.1**2 + 0.06**2) / 12)]  # area, middle, square of the inertia arm
    parts += [(-np.pi * r**2, x, r**2 / 2) for r, x in ((0.006, 0.03), (0.01, 0.07))]
    area, moment = (sum(a * x**k for a, x, _ in parts) for k in (0, 1))
    inertia = sum(a * ((x - 0.03) ** 2 + square) for a, x, square in parts)
    arm = moment / area - 0.03
    assert found["mass"] == pytest.approx(7850 * 0.01 * area, rel=5e-3)
    assert found["t_end"] == pytest.approx(period(inertia / area, arm), rel=1e-2)


RHO = 7850.0
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
    pytest.importorskip("pyvista", reason="pictures need pyvista")
    return tmp_path_factory.mktemp("parts")


def done(folder, *words):
    ended = run_rom(*words, "--json", cwd=folder, timeout=900)
    assert ended.returncode == 0, ended.stderr
    return json.loads(ended.stdout)


@pytest.mark.fenicsx
@pytest.mark.long
@pytest.mark.parametrize("part", PARTS)
def test_a_part_becomes_a_report_by_three_commands(folder, part):
    volume = PARTS[part](folder / f"{part}.step")
    n_faces, chosen = FACES[part]
    listed = done(folder, "mesh", f"{part}.step", "--faces", "--save", f"{part}.png")
    assert [face["number"] for face in listed["faces"]] == list(range(1, n_faces + 1))
    assert (folder / f"{part}.png").stat().st_size > 20_000
    picks = [f"--face={name}={face}" for name, (face, _) in chosen.items()]
    kinds = [f"-i={name}={kind}" for name, (_, kind) in chosen.items()]
    how = ("--material", "steel", "--reference", next(iter(chosen)), "-o", f"{part}.rom.npz")
    reduced = done(folder, "reduce", f"{part}.step", *picks, *kinds, *how)
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
