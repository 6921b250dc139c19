"""What a verb may overwrite: its own earlier files, others with --force, and never an input."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import rom
from cases.command import ROOT
from cases.solid import block, reduced
from rom.cli.main import main
from rom.cli.parser import build_parser, verb_modules
from rom.errors import ConfigError
from rom.io.export import FORMATS
from rom.io.files import check_writable
from rom.io.ours import FILE_SIGNS, SAME_KIND, check_replaceable, is_ours
from rom.names import MAX_FILE_NAME_BYTES, TEMPORARY_BYTES
from rom.report import pages

BEAM = str(ROOT / "meshes" / "beam.geo")
STEEL = ["--E", "210e9", "--nu", "0.3", "--rho", "7850"]
PENDULUM = ["simulate", "good.npz", "--hinge", "root", "--t-end", "2e-6", "--dt", "1e-6"]
NOTES = b"my notes\n1,2\n"
UNMARKED = {"op4", "radioss"}  # their formats have room for no mark
WRITERS = {  # case: (what to type, the file it writes)
    "export to vtu": (["export", "good.npz", "x.vtu"], "x.vtu"),
    "export to sid": (["export", "good.npz", "x.SID_FEM"], "x.SID_FEM"),
    "export to another body file": (["export", "good.npz", "x.npz"], "x.npz"),
    "pendulum": ([*PENDULUM, "-o", "out"], "out/good.csv"),
    "history": ([*PENDULUM, "--history", "csv", "-o", "out"], "out/good.history.csv"),
    "tree": ([*PENDULUM, "--history", "h5", "-o", "out"], "out/good.history.h5"),
    "film for ParaView": ([*PENDULUM, "--film", "vtkhdf", "-o", "out"], "out/good.vtkhdf"),
    "film": ([*PENDULUM, "--film", "glb", "-o", "out"], "out/good.glb"),
    "record": ([*PENDULUM, "-o", "out"], "out/run.json"),
    "scene": ([*PENDULUM, "-o", "out"], "out/scene.json"),
    "report": (["report", "good.npz", "-o", "x.html"], "x.html"),
}
OF_HDF5 = [case for case, (words, _) in WRITERS.items() if {"h5", "vtkhdf"} & set(words)]
MARKED_WRITERS = [
    pytest.param(case, marks=[pytest.mark.once] * (case in OF_HDF5)) for case in WRITERS
]
BEFORE_COMPUTING = {  # case: (what to type, the file it would write); nothing of it is there
    "mesh": (["mesh", "none.geo", "--save", "x.vtu"], "x.vtu"),
    "deck": (["mesh", "none.geo", "--save", "x.inp"], "x.inp"),
    "reduce": (["reduce", "none.geo", *STEEL, "-i", "a=rbe2", "-o", "x.npz"], "x.npz"),
    "view": (["view", "none.npz", "-o", "x.png"], "x.png"),
    "swing": (["swing", "part.step", "--hinge", "3", "-o", "out"], "out/part.png"),
    "swing film": (["swing", "part.step", "--hinge", "3", "--film", "-o", "out"], "out/part.gif"),
}


@pytest.fixture(scope="module")
def body():
    found = reduced(2, block(cells=(4, 1, 1)), name="good")
    return replace(found, provenance={"reduction": found.provenance["reduction"]})


@pytest.fixture
def folder(body, tmp_path, monkeypatch):
    rom.save(body, tmp_path / "good.npz")
    (tmp_path / "out").mkdir()
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("case", MARKED_WRITERS)
def test_a_file_of_the_user_is_kept_until_force_is_said(case, folder, capsys, monkeypatch):
    if case in OF_HDF5:
        pytest.importorskip("h5py", reason="h5py is not installed")
    monkeypatch.setattr(pages, "drawn", lambda *_: [])  # pictures take seconds
    words, name = WRITERS[case]
    Path(name).write_bytes(NOTES)
    before = sorted(os.listdir("out"))
    assert main(words) == 2
    said = capsys.readouterr().err
    assert f"{name} is there already" in said and "--force" in said
    assert Path(name).read_bytes() == NOTES and sorted(os.listdir("out")) == before
    assert main([*words, "--force"]) in (0, 5)
    ours = Path(name).read_bytes()
    assert ours != NOTES
    assert main(words) in (0, 5), "an earlier file of the same kind is replaced"
    capsys.readouterr()


@pytest.mark.parametrize("case", BEFORE_COMPUTING)
def test_it_is_said_before_anything_is_read(case, folder, capsys):
    words, name = BEFORE_COMPUTING[case]
    Path(name).write_bytes(NOTES)
    assert main(words) == 2
    assert f"{name} is there already" in capsys.readouterr().err
    assert Path(name).read_bytes() == NOTES


@pytest.mark.parametrize(
    "words", [[*PENDULUM, "--film", "mp4"], ["swing", "part.step", "--hinge", "3", "--mp4"]]
)
def test_a_film_without_encoder_is_refused_before_the_motion(words, folder, capsys, monkeypatch):
    monkeypatch.setenv("PATH", str(folder))
    monkeypatch.setattr(rom, "simulate", lambda *_, **__: pytest.fail("it was moved"))
    assert main([*words, "-o", "out"]) == rom.ResourceError.exit_code
    assert "ffmpeg" in capsys.readouterr().err and not os.listdir("out")


@pytest.mark.fenicsx
@pytest.mark.parametrize("name", ["x.vtu", "x.inp"])
def test_a_mesh_is_replaced_by_another_one_of_its_kind(name, folder, capsys):
    for coarse in ("0.2", "0.3"):
        assert main(["mesh", BEAM, "-p", f"lc={coarse}", "--save", name]) == 0
    rom.export(rom.load("good.npz"), "good.inp", to="abaqus")
    os.replace("good.inp", "x.inp")  # written by rom, but no mesh
    assert main(["mesh", BEAM, "--save", "x.inp"]) == 2
    assert "kind deck" in capsys.readouterr().err


INPUTS = [
    (["export", "good.npz", "{}", "--to", "npz"], "good.npz"),
    (["report", "x.html", "-o", "{}"], "x.html"),
    (["mesh", "x.vtu", "--save", "{}"], "x.vtu"),
    (["reduce", "k.npz:KAA", "--mass", "m.op4:MAA", "--nodes", "n.inp", "-i", "a=rbe2",
      "-o", "{}"], "k.npz"),
    (["reduce", "k.op4", "--mass", "m.npz:MAA", "--nodes", "n.inp", "-i", "a=rbe2",
      "-o", "{}"], "m.npz"),
    (["reduce", "part.toml", "-o", "{}"], "geometry.geo"),
]  # fmt: skip


@pytest.mark.parametrize(("words", "source"), INPUTS)
@pytest.mark.parametrize("alias", ["same", "hard link", "soft link", "roundabout"])
def test_an_input_is_never_written_whatever_it_is_called(words, source, alias, folder, capsys):
    if not Path(source).exists():
        Path(source).write_bytes(NOTES)
    Path("part.toml").write_text('[geometry]\nfile = "geometry.geo"\n[interfaces]\na = "rbe2"\n'
                                 '[material]\nE = 1\nnu = 0\nrho = 1\n')  # fmt: skip
    before = Path(source).read_bytes()
    name = f"alias{Path(source).suffix}"
    if alias == "hard link":
        os.link(source, name)
    elif alias == "soft link":
        os.symlink(source, name)
    else:
        name = source if alias == "same" else f"out/../{source}"
    for force in ([], ["--force"]):
        assert main([word.format(name) for word in words] + force) == 2
        assert "is read as an input" in capsys.readouterr().err
    assert Path(source).read_bytes() == before


def test_a_link_is_replaced_and_not_followed(folder, capsys):
    outside = folder / "outside.csv"
    outside.write_bytes(NOTES)
    os.symlink(outside, "out/good.csv")
    assert main([*PENDULUM, "-o", "out"]) == 2
    assert main([*PENDULUM, "-o", "out", "--force"]) in (0, 5)
    assert outside.read_bytes() == NOTES and not Path("out/good.csv").is_symlink()
    os.unlink("out/good.csv")
    os.symlink(folder / "nowhere.csv", "out/good.csv")  # leads to a file that is not there yet
    assert main([*PENDULUM, "-o", "out"]) == 2
    assert main([*PENDULUM, "-o", "out", "--force"]) in (0, 5)
    assert not (folder / "nowhere.csv").exists()
    capsys.readouterr()


def test_every_verb_that_writes_has_force():
    verbs = set(verb_modules())
    have, write = set(), set()
    for verb in verbs:
        (sub,) = [a.choices[verb] for a in build_parser()._actions if verb in (a.choices or ())]
        options = {a.dest for a in sub._actions}
        have |= {verb} if "force" in options else set()
        write |= {verb} if options & {"output", "save"} else set()
    named = {
        "demo",
        "open",
        "mesh",
        "reduce",
        "export",
        "simulate",
        "view",
        "report",
        "study",
        "swing",
        "update",
    }
    assert have == write == named


def exported(body, folder):
    guyan = rom.reduce(block(cells=(4, 1, 1)), method=rom.Guyan(), certify=False,
                       interfaces={"root": "rbe2", "tip": "rbe2"})  # fmt: skip
    found = {}
    for kind in FORMATS:
        held = ("root",) if kind.startswith("openfast") else ()
        if kind != "radioss":  # needs three interfaces, and has no mark
            found[kind] = rom.export(guyan if kind == "dmig" else body, folder / f"x.{kind}",
                                     to=kind, held=held)  # fmt: skip
    return found


def test_a_file_is_recognised_as_its_own_kind_and_no_other(body, tmp_path):
    found = exported(body, tmp_path)
    assert set(FORMATS) - UNMARKED <= FILE_SIGNS.keys() | SAME_KIND.keys()
    for kind, path in found.items():
        for other in (*FILE_SIGNS, *SAME_KIND):
            alike = SAME_KIND.get(other, other) == SAME_KIND.get(kind, kind)
            assert is_ours(path, other) == (alike and kind not in UNMARKED), (kind, other)


@pytest.mark.once
def test_pictures_are_recognised_and_those_of_others_are_not(tmp_path):
    pytest.importorskip("matplotlib")
    pytest.importorskip("PIL")
    from PIL import Image

    from rom.view.canvas import page
    from rom.view.canvas.films import Film

    ours = page.sheet(60, 40).save(tmp_path / "ours.png")
    Film(np.zeros((2, 8, 8, 3), np.uint8) + 7, 0.1).save(tmp_path / "ours.gif")
    assert is_ours(ours, "png") and is_ours(tmp_path / "ours.gif", "gif")
    for name in ("theirs.png", "theirs.gif"):
        Image.new("RGB", (60, 40)).save(tmp_path / name)
        assert not is_ours(tmp_path / name, name[-3:])


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("x.npz", b"PK\x03\x04 some other archive"),
        ("x.csv", b"t [s],u [V]\n0,1\n"),
        ("x.json", b'{"schema": "of another program"}'),
        ("x.html", b"<!DOCTYPE html><html><body>written by rom</body></html>"),
        ("x.vtu", b'<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid">'),
        ("x.glb", b"glTF"),
        ("x.h5", b"\x89HDF\r\n\x1a\n"),
        ("x.csv", b""),
        ("x.op4", b""),  # a format without room for a mark
    ],
)
def test_files_of_other_programs_are_not_ours(name, content, tmp_path):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(ConfigError, match="is there already"):
        check_replaceable(path, path.suffix[1:])
    assert check_replaceable(path, path.suffix[1:], force=True) == path


@pytest.mark.parametrize("name", ["a\0b.npz", "x" * 300 + ".npz", "\ud800.npz"])
def test_a_name_no_file_can_have_is_refused_before_the_computation(name, body, folder, capsys):
    before = sorted(os.listdir())
    with pytest.raises(ConfigError, match=r"no file can have the name|'a.x00b.npz' must be a path"):
        rom.save(body, name)
    assert main(["reduce", "none.geo", *STEEL, "-i", "a=rbe2", "-o", name]) == 2
    assert "no file can have the name" in capsys.readouterr().err
    assert sorted(os.listdir()) == before


def test_python_functions_replace_as_they_are_told(body, tmp_path):
    path = tmp_path / "x.npz"
    path.write_bytes(NOTES)
    rom.save(body, path)
    assert rom.save(rom.load(path), path) == path and rom.load(path).name == "good"


def test_the_longest_name_of_a_file_leaves_room_for_the_temporary_one(tmp_path):
    n = MAX_FILE_NAME_BYTES - TEMPORARY_BYTES
    assert check_writable(tmp_path / ("a" * n))
    with pytest.raises(ConfigError, match="no file can have the name"):
        check_writable(tmp_path / ("a" * (n + 1)))
