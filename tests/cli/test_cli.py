"""The command line: verbs, answers for people and programs, exit codes, start-up time."""

import json
import logging
import resource
import shlex
import shutil
import subprocess
import sys
import warnings
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from benchmarks import benchmarks
from cases.command import ROOT, environment, ran
from cases.command import rom as command
from cases.files.cells import solid
from cases.files.schema import answer
from cases.files.step_parts import step_box, step_plate
from cases.long import few
from cases.solid import block, reduced
from rom.cli.answer import Answer, table, to_json
from rom.cli.main import main
from rom.cli.parser import build_parser, verb_modules
from rom.cli.verbs import check
from rom.fe.mesh.summary import cell_volumes, vtk_cells
from rom.io.fields.vtu import grid

STEEL = ("--E", "210e9", "--nu", "0.3", "--rho", "7850")
NAMES = list(verb_modules())


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    body = reduced(60, block(), reference="root", certify=True)
    assert body.certificate.ok
    return rom.save(body, tmp_path_factory.mktemp("body") / "rod.rom.npz")


@pytest.fixture
def geometry(monkeypatch):
    monkeypatch.chdir(ROOT)
    return "meshes/beam.geo"


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
@pytest.mark.parametrize(
    ("words", "expected"),
    [("rom ex", ["export"]), ("rom -q reduce --ref", ["--reference"]), ("rom check rod", [])],
)
def test_bash_completes_verbs_and_options_and_leaves_files_alone(words, expected, capsys, tmp_path):
    assert main(["completion", "bash"]) == 0
    (tmp_path / "rom.bash").write_text(capsys.readouterr().out)
    ask = f"source rom.bash; COMP_WORDS=({words}); COMP_CWORD={len(words.split()) - 1}; _rom"
    done = ran("bash", "-c", f'{ask}; echo "${{COMPREPLY[@]}}"', cwd=tmp_path, check=True)
    assert done.stdout.split() == expected


def test_help_answers_within_half_a_second():
    seconds = []
    for _ in range(3):
        start = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = command("--help")
        end = resource.getrusage(resource.RUSAGE_CHILDREN)
        seconds.append(end.ru_utime + end.ru_stime - start.ru_utime - start.ru_stime)
    assert done.returncode == 0
    for verb in NAMES:
        assert f"\n    {verb} " in done.stdout
    assert min(seconds) < 0.5


@pytest.mark.parametrize("verb", NAMES)
def test_help_of_a_verb_has_examples_that_parse(verb, capsys):
    with pytest.raises(SystemExit) as end:
        main([verb, "--help"])
    assert end.value.code == 0
    text = capsys.readouterr().out
    assert "exit codes:" in text and "--json" in text
    examples = text.partition("examples:\n")[2].replace("\\\n", " ").splitlines()
    commands = [line.partition("rom ")[2].partition("#")[0] for line in examples if "rom " in line]
    assert commands
    for line in commands:
        assert build_parser().parse_args(shlex.split(line)).verb == verb


def test_check_prints_the_certificate_and_its_numbers(file, capsys):
    assert main(["check", str(file)]) == 0
    out, err = capsys.readouterr()
    assert "free: worst error of 6 frequencies" in out and "FAILED" not in out
    assert err == ""
    report = rom.check(rom.load(file))
    rows = answer(capsys, "check", file)["report"]["rows"]
    assert [row["quantity"] for row in rows] == [row.quantity for row in report.rows]
    assert_allclose([row["value"] for row in rows], [row.value for row in report.rows])
    assert main(["--json", "-q", "check", str(file)]) == 0
    assert json.loads(capsys.readouterr().out)["ok"] is True


def test_a_failed_gate_is_exit_code_5_in_both_forms(tmp_path, capsys):
    """Three modes cannot carry six frequencies to 1e-3."""
    poor = reduced(1, block(), reference="root", certify=True)
    path = rom.save(poor, tmp_path / "poor.rom.npz")
    assert main(["check", str(path)]) == 5
    assert capsys.readouterr().err.startswith("error: free: worst error of 6 frequencies = ")
    found = answer(capsys, "check", path, codes=(5,))
    rows = {row["quantity"]: row["ok"] for row in found["report"]["rows"]}
    assert rows["free: worst error of 6 frequencies"] is False


def test_simulate_lets_the_body_fall_about_its_hinge(file, tmp_path, capsys):
    """Tip of a stiff pendulum released at rest: y = -alpha L t^2 / 2, alpha = m g c / I.

    Valid while the angle is small, 0.012 rad here; the bar of 1 m also sags by up to 2e-4 m.
    """
    folder = tmp_path / "out"
    found = answer(
        capsys, "simulate", file, "--hinge", "root", "--axis=0,0,-1", "--gravity=0,-9.81,0",
        "--t-end", 0.04, "--dt", 4e-4, "-q", "-o", folder,
    )  # fmt: skip
    assert found["audit"]["ok"] and found["steps"] == 100
    lines = (folder / "body.csv").read_text().splitlines()
    assert lines[0].startswith("t [s],root x [m],root y [m],root z [m],tip x [m],tip y [m]")
    table_ = np.genfromtxt(lines[1:], delimiter=",")
    body = rom.load(file)
    assert table_.shape == (101, 7 + body.n_modes)
    lever, reach = body.first_moment[0], body.marker("tip").point[0] - body.marker("root").point[0]
    fall = -0.5 * 9.81 * lever / body.inertia[2, 2] * reach * table_[:, 0] ** 2
    assert_allclose(table_[:, 5] - table_[0, 5], fall, atol=2e-4)
    assert fall[-1] < -0.01
    assert_allclose(table_[:, 1:4] - table_[0, 1:4], 0.0, atol=1e-12)


def test_bench_prints_figures_with_their_aims(capsys, monkeypatch):
    def one():
        """One."""
        yield benchmarks.Figure("one", "30 dofs", "ratio", 2.5, "", "below 3")

    monkeypatch.setattr(benchmarks, "BENCHMARKS", {"one": one})
    assert main(["bench"]) == 0
    shown = capsys.readouterr().out.splitlines()[1]
    assert shown.split() == "one, 30 dofs: ratio 2.5 below 3".split()


def warned(monkeypatch, text="E looks like GPa."):
    def run(args):
        warnings.warn(text, rom.RomWarning, stacklevel=1)
        warnings.warn(text, rom.RomWarning, stacklevel=1)
        return Answer({"value": float("nan"), "array": np.arange(2)}, "done")

    monkeypatch.setattr(check, "run", run)


STRICT = "error: E looks like GPa.\nhint: Without --strict this is a warning.\n"


@pytest.mark.parametrize(("option", "code", "said"), [
    ("--debug", 0, ("done\n", "warning: E looks like GPa.\n")),
    ("-q", 0, ("done\n", "")),
    ("--strict", 5, ("", STRICT)),
])  # fmt: skip
def test_warnings_are_said_once_or_not_at_all_or_end_it(option, code, said, monkeypatch, capsys):
    warned(monkeypatch)
    assert main(["check", "x", option]) == code
    assert capsys.readouterr() == said


def test_warnings_go_into_the_json(monkeypatch, capsys):
    warned(monkeypatch)
    assert main(["check", "x", "-q", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["warnings"] == ["E looks like GPa."]
    assert found["value"] is None and found["array"] == [0, 1]


@pytest.mark.parametrize(
    ("option", "seen"), [("-q", []), ("", ["info"]), ("-v", ["info", "debug"])]
)
def test_progress_goes_to_stderr(option, seen, monkeypatch, capsys):
    def run(args):
        logging.getLogger("rom").info("info")
        logging.getLogger("rom").debug("debug")
        return Answer({}, "done")

    monkeypatch.setattr(check, "run", run)
    assert main(list(filter(None, ["check", "x", option]))) == 0
    out, err = capsys.readouterr()
    assert (out, err.split()) == ("done\n", seen)


def test_a_closed_pipe_is_silent():
    code = "import sys; from rom.cli.speech import say; from rom.cli.verbs import check\n"
    code += "from rom.cli.answer import Answer; from rom.cli.main import main\n"
    code += "check.run = lambda args: Answer({}, 'done')\nsys.exit(main(['check', 'x']))"
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    process = subprocess.Popen([sys.executable, "-c", code], env=environment(), **pipes)
    process.stdout.close()  # long before the answer
    assert process.wait(timeout=180) == 0
    assert process.stderr.read() == b""


def test_tables_are_aligned_and_json_is_strict():
    text = table(("name", "value"), [("a", "1.5"), ("long name", "22")])
    assert text.splitlines() == ["name       value", "a            1.5", "long name     22"]
    given = {"a": [np.inf, np.float64(2.5)], "b": np.array([1.0, np.nan]), 3: "µ"}
    assert json.loads(to_json(given)) == {"a": [None, 2.5], "b": [1.0, None], "3": "µ"}


@pytest.mark.fenicsx
def test_mesh_says_what_is_inside(geometry, tmp_path, capsys):
    """The beam is 1 m x 0.05 m x 0.03 m; flat faces, so that its volume is exact."""
    found = answer(capsys, "mesh", geometry, "-p", "lc=0.04", "--save", tmp_path / "b.vtu")
    assert_allclose(found["volume"], 1.5e-3, rtol=1e-12)
    assert_allclose(found["box"], [[0, 1], [-0.025, 0.025], [-0.015, 0.015]], atol=1e-12)
    assert set(found["interfaces"]) == {"root", "tip"}
    assert found["regions"]["body"]["cells"] == found["cells"]
    pyvista = pytest.importorskip("pyvista", reason="VTK comes with the pictures")
    grid = pyvista.read(tmp_path / "b.vtu")
    assert (grid.n_cells, grid.n_points) == (found["cells"], found["nodes"])
    assert_allclose(grid.volume, 1.5e-3, rtol=1e-6)
    assert set(grid.cell_data["region"]) == {1}


@pytest.mark.fenicsx
def test_mesh_lists_and_picks_faces_of_a_step_file_in_its_unit(tmp_path, capsys):
    step_box(tmp_path / "box.step", 20, 10, 10)
    data = answer(capsys, "mesh", tmp_path / "box.step", "-p", "lc=0.01", "--faces")
    found = data["interfaces"]
    for face in data["faces"]:
        assert face["kind"] == "plane" and face["name"] == f"face {face['number']}"
        assert_allclose(face["middle"], found[face["name"]]["middle"], atol=1e-12)
        k = int(np.argmax(np.abs(face["normal"])))
        assert face["normal"][k] == (1 if face["middle"][k] > 1e-6 else -1)
        assert face["area"] == pytest.approx(1e-4 if k == 0 else 2e-4, rel=1e-12)
    assert sorted(found) == [f"face {k}" for k in range(1, 7)]
    middles = sorted(tuple(round(x, 9) for x in face["middle"]) for face in found.values())
    assert middles == [(0.0, 0.005, 0.005), (0.01, 0.0, 0.005), (0.01, 0.005, 0.0),
                       (0.01, 0.005, 0.01), (0.01, 0.01, 0.005), (0.02, 0.005, 0.005)]  # fmt: skip
    # A box of 20 x 10 x 10 mm; STEP files carry their unit, so that no scale is needed
    command = ("mesh", tmp_path / "box.step", "-p", "lc=0.005", "--face", "end=0.02,0.005,0.005")
    found = answer(capsys, *command)
    assert_allclose(found["volume"], 2e-6, rtol=1e-9)
    assert list(found["interfaces"]) == ["end"] and found["interfaces"]["end"]["facets"] > 4
    assert_allclose(answer(capsys, *command[:4], "--scale", "2")["volume"], 16e-6, rtol=1e-9)


@pytest.mark.fenicsx
def test_faces_of_a_plate_are_picked_in_a_file_in_the_same_words_and_drawn(tmp_path, capsys):
    step_plate(tmp_path / "plate.step")
    file = tmp_path / "plate.toml"
    lines = ["[geometry]", 'file = "plate.step"', "[geometry.faces]", 'pin = "radius:0.006"',
             "left = 1", "right = [0.1, 0.03, 0.005]", ""]  # fmt: skip
    file.write_text("\n".join(lines))
    found = answer(capsys, "mesh", "--face", "bore=radius:0.01", file)["interfaces"]
    assert list(found) == ["pin", "left", "right", "bore"]
    assert_allclose(found["bore"]["point"], (0.07, 0.03, 0.005), atol=1e-14)
    assert "axis" not in found["left"]
    file.write_text("\n".join([*lines[:4], 'left = "radius:6 mm"', ""]))
    assert main(["mesh", str(file)]) == 2
    said = capsys.readouterr().err
    assert "plate.toml:5" in said and "'radius:6 mm' is no face" in said
    pytest.importorskip("pyvista", reason="pictures need pyvista")
    picture = tmp_path / "faces.png"
    assert main(["mesh", str(tmp_path / "plate.step"), "--faces", "--face", "pin=radius:0.006",
                 "--save", str(picture)]) == 0  # fmt: skip
    lines = capsys.readouterr().out.splitlines()
    rows = [line.split() for line in lines if " cylinder " in line]
    assert [row[2] for row in rows] == ["0.006", "0.01", "0.01"]
    assert rows[0][4:] == ["0.03,0.03,0.005", "0,0,1", "pin"] and rows[1][5:] == ["0,0,1"]
    assert any(line.split()[0] == "pin" and line.endswith("0,0,1") for line in lines if line)
    assert picture.read_bytes()[:4] == b"\x89PNG"


@pytest.mark.fenicsx
@pytest.mark.parametrize("kind", ["tet4", "tet10", "hex8", "hex27"])
def test_volumes_and_vtk_order_of_every_cell_type(kind, tmp_path):
    """VTK's own volume of each cell is the one computed here only with the right node order."""
    pyvista = pytest.importorskip("pyvista", reason="VTK comes with the pictures")
    mesh = solid(kind, (2, 1, 1), (2.0, 1.0, 1.5))
    (tmp_path / "b.vtu").write_text(grid(mesh.points, *vtk_cells(mesh)))
    read = pyvista.read(tmp_path / "b.vtu")
    ours = cell_volumes(mesh)
    assert_allclose(ours.sum(), 3.0, rtol=1e-12)
    assert_allclose(read.compute_cell_sizes()["Volume"], ours, rtol=1e-6)
    spans = np.ptp(mesh.points[mesh.cells], axis=1).max(axis=1)
    assert_allclose([np.ptp(c.points, axis=0).max() for c in read.cell], spans, rtol=1e-6)


@pytest.mark.fenicsx
def test_a_curved_cell_has_its_exact_volume():
    """One brick with the middle of its top face lifted by h: h times the integral of the bubble.

    The shape function of that node integrates to (2/3)^2 over the face of the unit cube, times 1/6
    through the height.
    """
    cube = solid("hex27", (1, 1, 1), (1.0, 1.0, 1.0))
    points = cube.points.copy()
    top = np.argmin(np.abs(points - [0.5, 0.5, 1.0]).sum(axis=1))
    points[top, 2] += 0.1
    lifted = cell_volumes(replace(cube, points=points)).sum()
    assert_allclose(lifted, 1 + 0.1 * (2 / 3) ** 2, rtol=1e-12)


@pytest.mark.fenicsx
def test_modes_prints_the_frequencies_of_the_model(geometry, capsys):
    """Cantilever of Euler and Bernoulli, weak axis: 25.0 Hz within one per cent."""
    found = answer(capsys, "modes", geometry, *STEEL, "-n", 3, "--fixed", "root")
    height, rate = 0.03, 1.8751040687119611**2
    beam = rate / (2 * np.pi) * height * np.sqrt(210e9 / 12 / 7850.0)
    assert_allclose(found["frequencies"][0], beam, rtol=0.01)
    assert_allclose(found["mass"], 7850 * 1.5e-3, rtol=1e-10)


@pytest.mark.fenicsx
def test_supports_in_part_by_option_and_by_file(geometry, tmp_path, capsys):
    """A beam held at the root that slides at its tip: 3.9266^2 and not 4.7300^2 in bending."""
    held = ("--fixed", "root,tip:yz")
    found = answer(capsys, "modes", geometry, *STEEL, "-n", 3, *held)["frequencies"]
    file = tmp_path / "beam.toml"
    file.write_text(
        f'[geometry]\nfile = "{rom.places.FOLDER_ABOVE / geometry}"\n'
        "[material]\nE = 210e9\nnu = 0.3\nrho = 7850.0\n"
        '[modes]\nnumber = 3\nfixed = ["root", "tip:yz"]\n'
    )
    assert_allclose(answer(capsys, "modes", file)["frequencies"], found, rtol=1e-9)
    model = rom.fe.model(geometry, material=rom.Material(E=210e9, nu=0.3, rho=7850.0))
    python = rom.modes(model, 3, fixed={"root": "xyz", "tip": "zy"}).frequencies
    assert_allclose(found, python, rtol=1e-9)
    held = ("--fixed", "root", "--spring", "tip=0,0,1e5")
    found = answer(capsys, "modes", geometry, *STEEL, "-n", 3, *held)["frequencies"]
    python = rom.modes(model, 3, fixed=("root",), springs={"tip": [0, 0, 1e5]}).frequencies
    assert_allclose(found, python, rtol=1e-9)
    file.write_text(file.read_text().replace('"tip:yz"]', ']\nspring = "tip=0,0,1e5"'))
    assert_allclose(answer(capsys, "modes", file)["frequencies"], found, rtol=1e-9)
    assert main(["modes", geometry, *STEEL, "--spring", "tip=1,2,x"]) == 2
    assert "'x' is not a number" in capsys.readouterr().err
    assert main(["modes", geometry, *STEEL, "--fixed", "tip:q"]) == 2
    assert "'tip' is held in 'q'" in capsys.readouterr().err


@pytest.mark.fenicsx
def test_reduce_by_assumed_modes(geometry, tmp_path, capsys):
    path = tmp_path / "beam.rom.npz"
    arguments = ("-i", "root=rbe2", "-i", "tip=rbe2", "-m", 3, "--reference", "root", "-o", path)
    assert main(["reduce", geometry, *STEEL, "--method", "assumed", *map(str, arguments)]) == 5
    found = answer(capsys, "modes", geometry, *STEEL, "-n", 3, "--fixed", "root")["frequencies"]
    assert_allclose(rom.load(path).omega / (2 * np.pi), found, rtol=1e-3)


@pytest.mark.fenicsx
def test_reduce_then_check_then_export(geometry, tmp_path, capsys):
    path = tmp_path / "beam.rom.npz"
    found = answer(
        capsys, "reduce", geometry, *STEEL, "-i", "root=rbe2", "-i", "tip=rbe3", "-m", 24,
        "--reference", "root,tip", "--damping-ratio", 0.01, "--damping-fixed", "root:xyz rx,tip:yz",
        "--name", "beam", "-o", path,
    )  # fmt: skip
    body = rom.load(path)
    assert found["certificate"]["ok"] and answer(capsys, "check", path)["report"]["ok"]
    assert (body.name, body.reference) == ("beam", "pins root tip")
    assert_allclose(np.diag(body.D), 0.02 * body.omega, rtol=1e-9)
    assert_allclose(found["frequencies"], body.omega / (2 * np.pi))
    found = answer(capsys, "export", path, tmp_path / "beam.vtu")
    assert found["output"] == str(tmp_path / "beam.vtu")
    assert (tmp_path / "beam.vtu").read_text().startswith("<VTKFile")


@pytest.mark.fenicsx
@pytest.mark.mpi
def test_two_ranks_print_one_answer_with_the_same_numbers(geometry):
    arguments = ("modes", geometry, *STEEL, "-n", 8, "--fixed", "root", "--json", "-q")
    one, two = (command(*arguments, n=n) for n in (1, 2))
    assert one.returncode == two.returncode == 0, two.stderr
    a, b = json.loads(one.stdout), json.loads(two.stdout)
    assert_allclose(b["frequencies"], a["frequencies"], rtol=1e-9)


def test_fixed_interfaces_may_be_written_with_blanks():
    args = build_parser().parse_args(["modes", "x.geo", *STEEL, "--fixed", "a, b,"])
    assert args.fixed == ("a", "b")


METHODS = (
    ("--method rubin -m 30", "free 30", 15 + 30),
    ("--method herting -m 25", "free 25", 15 + 25),
    ("--f-max 700 --tol 1e-3", "fixed-interface", None),
    ("--method moment-matching --at 0,300 -m 1", "moment", None),
    ("--method balanced -m 12 --gravity-shapes", "balanced", 9 + 12 + 3),
)


@pytest.mark.fenicsx
@pytest.mark.parametrize(("options", "label", "n_modes"), few(2, METHODS))
def test_reduce_takes_a_method_or_a_tolerance(geometry, tmp_path, capsys, options, label, n_modes):
    """A rigid end and one with linear functions: 6 and 9 coordinates."""
    path = tmp_path / "beam.rom.npz"
    more = f"-i root=rbe2 -i tip=polynomial:1 --no-certificate -o {path} {options}".split()
    found = answer(capsys, "reduce", geometry, *STEEL, *more)
    body = rom.load(path)
    assert body.provenance["reduction"]["columns"][-1].startswith(label)
    assert n_modes is None or found["n_modes"] == n_modes
    # the ends are hardly stiffer than those of the full model
    full = answer(capsys, "modes", geometry, *STEEL, "-n", 7)["frequencies"]
    assert body.frequencies(7)[6] == pytest.approx(full[6], rel=1e-3)


@pytest.mark.parametrize("options", ["--method guyan -m 3", "--method rubin --f-max 10", "--at 5",
                                     "--tol 1e-3 -m 4", "--characteristic 8"])  # fmt: skip
def test_options_that_contradict_each_other_are_refused(options, tmp_path, capsys):
    words = f"reduce meshes/beam.geo -i root=rbe2 -o {tmp_path}/b.npz {options}".split()
    assert main([*words, *STEEL]) == 2
    assert capsys.readouterr().err.startswith("error: ")
