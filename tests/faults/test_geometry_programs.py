"""Geometries are programs: what they may not do is refused, and is not done either.

Each case tries to leave a mark on the disk. Half of the tests look at the error for what the text
says; the other half take that look away, so that only the confinement of the process is left.
"""

import subprocess
import sys
import time
import warnings
from pathlib import Path

import pytest

import rom
from cases.boxes import BOX_GEO as BOX
from cases.command import rom as command
from cases.long import few
from cases.refusals import refuses
from rom.fe.mesh.read import read_mesh
from rom.process import child
from rom.process.memory import total_bytes

pytest.importorskip("gmsh", reason="gmsh is not installed")
pytestmark = pytest.mark.fenicsx
LINUX = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="what Linux offers")
TOUCH = 'SystemCall "touch pwned";\n'
# name: what the geometry and the files beside it say
STARTERS = {
    "directly": {"box.geo": BOX + TOUCH},
    "without waiting": {"box.geo": BOX + 'NonBlockingSystemCall "touch pwned";\n'},
    "by the short name": {"box.geo": BOX + "System 'touch pwned';\n"},
    "over two lines": {"box.geo": BOX + 'SystemCall /* now */ // so\n  "touch pwned";\n'},
    "behind a number": {"box.geo": BOX + 'x = 1;y = 1e5SystemCall "touch pwned";\n'},
    "with a text built": {"box.geo": BOX + 'SystemCall StrCat("touch ", "pwned");\n'},
    "with a text kept": {"box.geo": BOX + 'c = "touch pwned";\nSystemCall Str(c);\n'},
    "spelt from texts": {"box.geo": BOX + 'S2N[StrCat("System", "Call")] "touch pwned";\n'},
    "spelt at length": {"box.geo": BOX + 'StringToName["SystemCall"] "touch pwned";\n'},
    "in brackets": {"box.geo": BOX + 'SystemCall("touch pwned");\n'},
    "behind a text of slashes": {"box.geo": BOX + 'Printf("a // b"); ' + TOUCH},
    "in a branch": {"box.geo": BOX + f"If (1)\n{TOUCH}EndIf\n"},
    "in a loop": {"box.geo": BOX + f"For i In {{1:2}}\n{TOUCH}EndFor\n"},
    "in a macro": {"box.geo": BOX + f"Macro go\n{TOUCH}Return\nCall go;\n"},
    "by a name built": {"box.geo": BOX + f'Macro "go"\n{TOUCH}Return\nCall Str("g", "o");\n'},
    "included": {"box.geo": BOX + 'Include "part.geo";\n', "part.geo": TOUCH},
    "included as data": {"box.geo": BOX + 'Include "part.step";\n', "part.step": TOUCH},
    "included by the included": {
        "box.geo": BOX + 'Include "a/part.geo";\n',
        "a/part.geo": 'Include StrCat(CurrentDirectory, "b.geo");\n',
        "a/b.geo": TOUCH,
    },
    "merged": {"box.geo": BOX + 'Merge "part.geo";\n', "part.geo": TOUCH},
    "merged as a view": {"box.geo": BOX + 'Merge "part.pos";\n', "part.pos": TOUCH},
    "merged as a mesh": {"box.geo": BOX + 'Merge "part.msh";\n', "part.msh": TOUCH},
    "merged as a step": {"box.geo": BOX + 'Merge "part.Step";\n', "part.Step": TOUCH},
    "merged packed": {"box.geo": BOX + 'Merge "p; touch pwned; .gz";\n',
                      "p; touch pwned; .gz": "x"},
    "merged by a name built": {"box.geo": BOX + 'Merge Sprintf("part%g.geo", 1);\n',
                               "part1.geo": TOUCH},
    "beside the geometry": {"box.geo": BOX, "box.geo.opt": TOUCH},
    "beside what is merged": {"box.geo": BOX + 'Merge "part.pos";\n', "part.pos": 'View "a" {};\n',
                              "part.pos.opt": TOUCH},
    "by a client": {"box.geo": BOX + 'OnelabRun("x", "touch pwned");\n'},
    "by a client, as a command": {"box.geo": BOX + 'Solver.Executable0 = "touch pwned";\n'
                                  'Solver.Name0 = "x";\nOnelabRun("x");\n'},
    "by a field": {"box.geo": BOX + "Field[1] = ExternalProcess;\n"
                   'Field[1].CommandLine = "touch pwned";\nBackground Field = 1;\n'},
    "behind a text gmsh cuts": {"box.geo": BOX + f'x = "{1023 * "a"}; {TOUCH[:-2]}; ";\n'},
    "behind a quote gmsh skips": {
        "box.geo": BOX + "If (0)\nE\"\nEndIf\nSystemCall 'touch pwned';\n//\"\n"
    },
    "behind a comment gmsh skips": {"box.geo": BOX + f"If (0)\nE/*\nEndIf\n{TOUCH}//*/\n"},
    "behind a zero byte": {"box.geo": BOX + 'x = "\0"; ' + TOUCH},
    "disguised as a mesh": {"box.msh": TOUCH},
    "disguised as a mesh that starts well": {"box.msh": f"\n$MeshFormat;\n{TOUCH}$End\n"},
    "disguised as a step": {"box.step": TOUCH},
    "by Python": {"box.py": "open('pwned', 'w')\ndef build(gmsh):\n    pass\n"},
}  # fmt: skip
WRITERS = {
    "Printf": {"box.geo": BOX + 'Printf("pwned") > "pwned";\n'},
    "Printf with numbers": {"box.geo": BOX + 'Printf("%g", (1)) >> "pwned";\n'},
    "Printf to a name built": {"box.geo": BOX + 'Printf("a") > StrCat("pw", "ned");\n'},
    "Save": {"box.geo": BOX + 'Mesh 3;\nSave "pwned.msh";\n'},
    "Save over itself": {"box.geo": BOX + 'Save "box.geo";\n'},
    "Save of a view": {"box.geo": BOX + 'View "a" {SP(0, 0, 0){1};};\nSave View[0] "pwned.pos";\n'},
    "Print": {"box.geo": BOX + 'Print "pwned.geo_unrolled";\n'},
    "Print at home": {"box.geo": BOX + 'Print StrCat(GetEnv("HOME"), "/pwned.brep");\n'},
    "CreateDir": {"box.geo": BOX + 'CreateDir "pwned";\n'},
    "a plugin": {"box.geo": BOX + 'Plugin(Bubbles).OutputFile = "pwned";\nPlugin(Bubbles).Run;\n'},
}
HARMLESS = {
    "words in comments": '// SystemCall "x"; Save \'y\'\n/* Print "z"; */\n',
    "words in texts": 'Printf("Save the System, Print > it");\n',
    "variables of these names": "System = 3; Save = System + 1; x = 2 * Save;\n",
    "options of these names": "Print.Width = 100;\n",
    "comparisons in Printf": 'Printf("%g", 2 > 1);\n',
    "a parameter called E": 'DefineConstant[ E = {1, Name "E"}, R = {2, Name "in/R"} ];\n',
    "division by F and R": "F = 2; R = F/2; E=1/F; // end\n",
    "Include": 'Include "more.geo";\n',
    "Merge": 'Merge "more.pos";\n',
}


def lay(files, folder):
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(content)
    return next(iter(files))


@pytest.fixture
def here(tmp_path, monkeypatch):
    """The folder one stands in; also home, so that marks left there are seen."""
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("case", few(12, [*STARTERS, *WRITERS]))
def test_a_geometry_that_does_more_is_refused(case, here):
    files = (STARTERS | WRITERS)[case]
    name = lay(files, here)
    with pytest.raises(rom.FileFormatError) as caught:
        read_mesh(name)
    if name != "box.step":  # there the wrong start is told, and gmsh does not see it
        assert isinstance(caught.value, rom.UnsafeFileError)
    assert "tries to start" not in str(caught.value)  # gmsh has not seen it
    assert str(here / next(reversed(files))) in str(caught.value) or name in str(caught.value)
    assert not list(here.rglob("pwned*"))
    assert (here / name).read_text() == files[name]


def be_blind(monkeypatch, more=""):
    code = "import sys, rom.fe.mesh.sources.gmsh_session as g, rom.fe.mesh.child as c\n"
    code += f"g.check_script = lambda path: None\n{more}\nc.main(sys.argv[1])"
    monkeypatch.setattr(child, "python", lambda _, folder: [sys.executable, "-c", code, folder])


@LINUX
@pytest.mark.parametrize("case", few(6, [*STARTERS, *WRITERS]))
def test_what_the_text_hides_the_process_cannot_do(case, here, monkeypatch):
    files = (STARTERS | WRITERS)[case]
    name = lay(files, here)
    if name == "box.py":
        return
    be_blind(monkeypatch, "g.MSH_START = (b'',)")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rom.RomWarning)
        try:
            read_mesh(name, time_limit=20)
        except rom.RomError as error:
            killed = "tries to start a process" in str(error)
            assert not killed or isinstance(error, rom.UnsafeFileError)
    assert not list(here.rglob("pwned*"))
    assert (here / name).read_text() == files[name]


@LINUX
def test_a_process_killed_for_starting_another_is_called_unsafe(here, monkeypatch):
    lay(STARTERS["directly"], here)
    be_blind(monkeypatch)
    refuses(rom.UnsafeFileError, r"^box\.geo: tries to start a process", read_mesh, "box.geo")


@LINUX
def test_a_confined_process_has_threads_and_its_folder_and_nothing_else(tmp_path):
    code = f"""
import os, socket, subprocess, threading
from pathlib import Path
from rom.fe.mesh.sources.script import confine
folder, outside = Path({str(tmp_path)!r}, "in"), Path({str(tmp_path)!r}, "out")
folder.mkdir()
confine(folder)
done = []
thread = threading.Thread(target=lambda: done.append(1))
thread.start(); thread.join()
(folder / "a").write_text("a"); (folder / "a").rename(folder / "b"); (folder / "b").unlink()
open(os.devnull, "w").close()
for act in (lambda: outside.write_text(""), outside.mkdir, socket.socket,
            lambda: os.truncate({str(tmp_path / "kept")!r}, 0),
            Path({str(tmp_path / "kept")!r}).unlink):
    try:
        act()
    except OSError:
        done.append(1)
print(len(done), flush=True)
subprocess.run(["true"])
"""
    (tmp_path / "kept").write_text("kept")
    done = child.run([sys.executable, "-c", code])
    assert (done.out, done.signal) == ("6\n", "SIGSYS"), done.err
    assert (tmp_path / "kept").read_text() == "kept"


@pytest.mark.parametrize("case", few(6, HARMLESS))
def test_a_geometry_that_makes_a_geometry_is_meshed(case, here):
    files = {"box.geo": BOX + HARMLESS[case], "more.geo": "x = 1;\n", "more.pos": 'View "a" {};\n'}
    assert len(read_mesh(lay(files, here)).cells) == 24


@pytest.mark.parametrize("length", [1, 2, 3])
@pytest.mark.parametrize("verb", ["Include", "Merge"])
def test_a_geometry_that_includes_itself_is_named(length, verb, here):
    chain = ["box.geo", "a.geo", "b.geo"][:length]
    for name, other in zip(chain, [*chain[1:], chain[0]], strict=True):
        (here / name).write_text(f'{BOX if name == "box.geo" else ""}{verb} "{other}";\n')
    with pytest.raises(rom.FileFormatError, match=r"box\.geo.*includes itself") as caught:
        read_mesh("box.geo")
    assert all(name in str(caught.value) for name in chain)


ENDLESS = {
    "a macro that calls itself": "Macro go\nx = 1;\nCall go;\nReturn\nCall go;\n",
    "a loop of 1e15 turns": "For i In {1:1e15}\nx = i;\nEndFor\n",
    "sleep": "Sleep 1e5;\n",
    "an element size of nothing": "Mesh.MeshSizeMax = 1e-7;\nMesh.MeshSizeMin = 1e-7;\n",
}


@pytest.mark.parametrize("case", few(1, ENDLESS))
def test_an_endless_geometry_ends_by_the_limit(case, here):
    lay({"box.geo": BOX + ENDLESS[case]}, here)
    began = time.perf_counter()
    words = r"box\.geo: meshing did not end within the limit of 2 s.*--time-limit"
    refuses(rom.ResourceError, words, read_mesh, "box.geo", time_limit=2)
    assert time.perf_counter() - began < 30


def test_the_limit_of_the_command_line_ends_with_exit_code_6(here):
    lay({"box.geo": BOX + ENDLESS["a loop of 1e15 turns"]}, here)
    done = command("mesh", "box.geo", "--time-limit", "2")
    assert (done.returncode, done.stdout) == (6, "") and "limit of 2 s" in done.stderr


@pytest.mark.parametrize("script", few(1, ["box.py", "box.geo"]))
def test_memory_beyond_the_limit_is_a_resource_error(script, here):
    loop = "l[] = LinSpace[0, 1, 1e9];\n"
    hoard = "def build(gmsh):\n    x = [0]\n    while True:\n        x = x + x\n"
    lay({"box.geo": BOX + loop, "box.py": hoard}, here)
    with pytest.raises(rom.ResourceError, match=rf"{script}: meshing needs more than .* 1\.5 GB"):
        read_mesh(script, trust=True, memory_limit=1.5e9, time_limit=60)


def test_no_limit_is_no_limit_and_others_are_positive(here):
    from rom.fe.mesh.child import _limits

    for none in (0, 0.0, float("inf")):
        assert _limits("geo", 1, none, none) == child.Limits()
    usual = _limits("geo", 1, None, None)
    assert usual.seconds == 1800 and 0 < usual.memory <= 0.8 * total_bytes()
    lay({"box.geo": BOX}, here)
    for name in ("time_limit", "memory_limit"):
        for wrong in (-1, float("nan")):
            refuses(rom.ConfigError, name, read_mesh, "box.geo", **{name: wrong})


def test_python_is_run_only_when_trusted(here):
    lay({"box.py": 'open("ran", "w")\ndef build(gmsh):\n    gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)'
         "\n    gmsh.model.occ.synchronize()\n",
         "box.toml": '[geometry]\nfile = "box.py"\ntrust = true\n'}, here)  # fmt: skip
    assert command("mesh", "box.toml").returncode == 2
    (here / "box.toml").write_text('[geometry]\nfile = "box.py"\n')
    for file in ("box.py", "box.toml"):
        done = command("mesh", file)
        assert (done.returncode, done.stdout) == (3, "")
        assert "is a Python program" in done.stderr and "--trust" in done.stderr
    refuses(rom.UnsafeFileError, "trust=True", read_mesh, "box.py", trust=False)
    assert not Path("ran").exists()
    for file in ("box.py", "box.toml"):
        done = command("mesh", file, "--trust")
        assert done.returncode == 0, done.stderr
        Path("ran").unlink()


def test_the_original_geometry_commands_do_leave_marks(here):
    """Without this the tests above would show nothing: gmsh by itself runs what they refuse."""
    alone = """
import gmsh, os, sys
for folder in sys.argv[1:]:
    child = os.fork()  # some of them bring gmsh down
    if not child:
        os.chdir(folder)
        gmsh.initialize([], False)
        gmsh.option.setNumber("General.Terminal", 0)
        try:
            gmsh.open("box.geo")
        finally:
            os._exit(0)
    os.waitpid(child, 0)
"""
    folders = []
    for case, files in (STARTERS | WRITERS).items():
        if "box.geo" in files and "client" not in case and "field" not in case:
            folders.append(here / case.replace(" ", "_"))
            folders[-1].mkdir()
            lay(files, folders[-1])
    subprocess.run([sys.executable, "-c", alone, *folders], timeout=60, check=False)
    assert sum(bool(list(folder.rglob("pwned*"))) for folder in folders) > 20
