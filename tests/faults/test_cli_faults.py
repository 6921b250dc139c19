"""Bad command lines, files and circumstances: the class of error, the culprit, no traceback."""

import os
import time

import pytest

import rom
from cases.command import ROOT, python
from cases.command import rom as command
from cases.solid import block, reduced
from rom.cli.main import main
from rom.cli.verbs import check
from rom.process.mpirun import mpirun

A_HANG = 60.0  # s; on a loaded machine Python alone starts for ten
WORDS = {  # of the lines below
    "BEAM": str(ROOT / "meshes" / "beam.geo"), "STEEL": "--E 210e9 --nu 0.3 --rho 7850",
    "REDUCE": "reduce BEAM STEEL -i root=rbe2", "LONG": 300 * "x",
    "RUN": "simulate x.npz --hinge a --t-end 1 -o out",
}  # fmt: skip


def typed(line):
    for word in ("RUN", "REDUCE", "STEEL", "BEAM", "LONG"):
        line = line.replace(word, WORDS[word])
    return line.split()


USAGE = {
    "no verb": ("", "no verb was given"),
    "unknown verb": ("redcue BEAM", "'redcue' does not exist", "Did you mean reduce?"),
    "unknown option": ("modes BEAM STEEL --degre=1", "'--degre=1'", "Did you mean --degree?"),
    "full word for a symbol": ("modes BEAM STEEL --youngs-modulus 1", "--youngs-modulus", "--E"),
    "missing option": ("modes BEAM --E 210e9", "--nu, --rho"),
    "superfluous file": ("check a.npz b.npz", "'b.npz'"),
    "decimal comma": ("modes BEAM STEEL --nu 0,3", "'0,3' is not a number", "decimal point"),
    "negative scale": ("mesh BEAM --scale=-1", "-1 must be positive"),
    "two ways to choose modes": ("REDUCE -m 3 --f-max 3e3 -o x.npz", "not allowed with"),
    "parameter without value": ("mesh BEAM -p lc", "'lc' is not NAME=VALUE"),
    "parameter twice": ("mesh BEAM -p lc=1 -p lc=2", "-p 'lc' is given twice; use each"),
    "no interface": ("reduce BEAM STEEL -o x.npz", "needs an interface"),
    "axis of two numbers": ("RUN --axis 0,1 --dt 1", "'0,1' is not 3 numbers with commas"),
    "axis beginning with a minus": ("simulate x.npz --axis -1,0,0", "--axis", "Write --axis=-1"),
    "no direction": ("RUN --axis 0,0,0 --dt 1", "has no direction"),
    "step longer than the run": ("RUN --dt 2", "--dt 2 must be at most --t-end 1"),
    "damping of one number": ("REDUCE --rayleigh 0.1 -o x.npz", "--rayleigh 0.1"),
    "output in a missing folder": ("REDUCE -o missing/x.npz", "folder missing does not exist"),
    "output is a folder": ("REDUCE -o .", ". is a folder"),
    "folder is a file": ("simulate x.npz --hinge a --t-end 1 --dt 1 -o text.npz", "text.npz is a"),
    "mesh saved as something else": ("mesh BEAM --save x.stl", "written as .png, .vtu, .inp"),
    "material for a picture": ("mesh BEAM STEEL --save x.vtu", "--E needs --save FILE.inp"),
    "half a material": ("mesh BEAM --save x.inp --E 1", "--nu and --rho, got --E"),
    "face that is none": ("mesh x.step --face pin=here", "--face: 'here' is no face"),
    "hinge named as a face": ("swing BEAM --face hinge=1 --hinge 2 -o o", "'hinge' is given twice"),
    "face of a geometry": ("mesh BEAM --face pin=1", "['pin'] can be picked in a .step file only"),
    "face called face": ("mesh x.step --faces --face face=1", "none can be called"),
    "unknown benchmark": ("bench reducton", "'reducton'"),
}  # fmt: skip
FILES = {
    "missing mesh": (3, "mesh nope.geo", "nope.geo: there is no such file"),
    "mesh is a folder": (3, "mesh .", "is a folder"),
    "mesh of unknown kind": (2, "mesh text.npz", "no reader for the suffix '.npz'"),
    "body with a name too long": (3, "check LONG.npz", "xxx.npz: there is no such"),
    "text as body": (3, "check text.npz", "text.npz"),
    "device as body": (3, "check /dev/zero", "/dev/zero: there is no such file, but a"),
    "text as SID": (3, "check text.SID_FEM", "text.SID_FEM, line 1: "),
    "export of a folder": (3, "export . x.op4", ".: this is a folder"),
    "format in capitals": (2, "export good.npz x.op4 --to OP4", "'OP4' is none of "),
    "held for nothing": (2, "export good.npz x.op4 --held root", "op4 holds no interfaces"),
    "held misspelt": (2, "export good.npz x.dat --to openfast --held rot", "'rot'", "'root'"),
    "modes for a format without": (2, "export good.npz x.pch", "reads interfaces alone"),
    "export to an unknown format": (2, "export good.npz x.fbx", "'.fbx'"),
    "hinge misspelt": (4, "simulate good.npz --hinge rot --t-end 1 --dt 1e-3 -o out", "'rot'"),
}  # fmt: skip
PHYSICS = {
    "unknown parameter": (2, "mesh BEAM -p lcc=1", "no parameter 'lcc'; its parameters are"),
    "poisson": (4, "modes BEAM STEEL --nu 0.6", "nu = 0.6"),
    "massless": (4, "modes BEAM STEEL --rho 0", "rho = 0"),
    "units": (5, "modes BEAM STEEL --E 210 --strict", "0.1636 m/s"),
    "no modes": (2, "modes BEAM STEEL -n 0", "n = 0"),
    "interface misspelt": (4, "modes BEAM STEEL --fixed rot", "'rot'; there are"),
    "kind misspelt": (2, "modes BEAM STEEL -i root=rbe4", "rbe4"),
    "frame misspelt": (4, "REDUCE --reference tipp -m 2 -o x.npz", "'tipp'"),
}  # fmt: skip


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    body = reduced(4, block(cells=(4, 1, 1)))
    return rom.save(body, tmp_path_factory.mktemp("good") / "good.npz").read_bytes()


@pytest.fixture
def folder(good, tmp_path, monkeypatch):
    for name, data in {"good": good, "text": b"hello\n"}.items():
        (tmp_path / f"{name}.npz").write_bytes(data)
    (tmp_path / "text.SID_FEM").write_text("hello\n")
    monkeypatch.chdir(tmp_path)
    before = set(os.listdir())
    yield tmp_path
    assert set(os.listdir()) == before, "something was left behind"


def refused(capsys, code, arguments, *words):
    """One line of cause with all words, at most one of hint, nothing on stdout."""
    assert main(list(arguments)) == code
    out, err = capsys.readouterr()
    lines = [line for line in err.splitlines() if line[:6] in ("error:", "hint: ")]
    assert out == "" and "Traceback" not in err
    assert err.rstrip().endswith((".", "?")), err
    assert [line[:6] for line in lines] in (["error:"], ["error:", "hint: "])
    assert not [word for word in words if word not in err], err
    return lines


WRONG = {name: (2, *row) for name, row in USAGE.items()} | FILES | PHYSICS


@pytest.mark.parametrize(
    "case", [*USAGE, *FILES, *(pytest.param(name, marks=pytest.mark.fenicsx) for name in PHYSICS)]
)
def test_a_wrong_command_line_file_or_model_is_named(case, folder, capsys):
    code, line, *words = WRONG[case]
    refused(capsys, code, typed(line), *words)


def test_a_wrong_command_line_is_refused_before_anything_heavy_is_loaded(folder):
    heavy = {"dolfinx", "gmsh", "matplotlib", "numba", "pyvista", "slepc4py"}
    code = "import sys\nfrom rom.cli.main import main\n"
    code += f"codes = {{main(words) for words in {[typed(line) for line, *_ in USAGE.values()]}}}\n"
    code += f"print(codes, sorted({heavy} & set(sys.modules)))"
    done = python("-c", code, timeout=60)
    assert done.stdout == "{2} []\n", done.stderr


def test_a_read_only_folder_is_found_before_the_computation(folder, capsys, monkeypatch):
    locked = folder / "locked"
    locked.mkdir()
    locked.chmod(0o555)
    if os.access(locked, os.W_OK):  # root may write everywhere
        monkeypatch.setattr(os, "access", lambda path, mode: "locked" not in str(path))
    refused(capsys, 2, ["export", "good.npz", "locked/x.vtu"], "locked is not writable")
    refused(capsys, 2, typed("REDUCE -o locked/x.npz"), "locked is not writable")
    locked.rmdir()


@pytest.mark.parametrize(
    ("raised", "code", "words"),
    [
        (KeyboardInterrupt(), 7, ["interrupted", "half written"]),
        (MemoryError(), 6, ["memory ran out"]),
        (ModuleNotFoundError("No module named 'dolfinx'", name="dolfinx"), 6,
         ["dolfinx is not installed", "rom doctor"]),
        (PermissionError(13, "Permission denied", "x.op4"), 3, ["x.op4: Permission denied."]),
        (RecursionError("too deep"), 1, ["RecursionError: too deep", "please report"]),
        (AssertionError("a\nb"), 1, ["AssertionError: a b (test_cli_faults.py, line"]),
        (rom.RomError("several\n lines.", where="x.npz"), 1, ["error: x.npz: several lines.\n"]),
    ],
)  # fmt: skip
def test_every_exception_becomes_one_line(raised, code, words, monkeypatch, capsys):
    def run(args):
        raise raised

    monkeypatch.setattr(check, "run", run)
    refused(capsys, code, ["check", "x"], *words)
    assert main(["check", "x", "--debug"]) == code
    assert "Traceback" in capsys.readouterr().err


@pytest.mark.fenicsx
@pytest.mark.mpi
@pytest.mark.parametrize(
    ("line", "code", "words"),
    [
        ("modes BEAM STEEL --degre 1", 2, "unknown option"),
        ("modes nope.geo STEEL", 3, "nope.geo: there is no such file"),
        ("modes BEAM STEEL --fixed rot", 4, "no interface 'rot'"),
        ("modes BEAM STEEL --E 210 --strict", 5, "0.1636 m/s"),
    ],
)
def test_two_ranks_complain_once_and_end_within_seconds(line, code, words, folder):
    start = time.perf_counter()
    done = command(*typed(line), n=2)
    assert done.returncode == code, done.stderr
    assert done.stderr.count("error: ") == 1 and words in done.stderr
    assert done.stdout == "" and "Traceback" not in done.stderr
    assert time.perf_counter() - start < A_HANG


@pytest.mark.fenicsx
@pytest.mark.mpi
def test_a_rank_that_is_alone_with_its_error_ends_all(folder):
    (folder / "alone.py").write_text(
        "import sys\nfrom mpi4py import MPI\nfrom rom.cli.verbs import check\n"
        "from rom.cli.main import main\nfrom rom.errors import MaterialError\n"
        "def run(args):\n"
        "    if MPI.COMM_WORLD.rank == 1:\n        raise MaterialError('rho = 0.')\n"
        "    MPI.COMM_WORLD.Barrier()\n"
        "    MPI.COMM_WORLD.Barrier()\n"
        "check.run = run\nsys.exit(main(['check', 'x']))\n"
    )
    start = time.perf_counter()
    done = python("alone.py", launcher=mpirun(2), timeout=60)
    assert done.returncode == 4
    assert "error: rank 1: rho = 0." in done.stderr
    assert time.perf_counter() - start < A_HANG
    (folder / "alone.py").unlink()
