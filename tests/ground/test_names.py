"""Names: one alphabet, and no way from a name to a file in another folder or to foreign text."""

import ast
import csv
import json
import os
import re
import unicodedata
import xml.etree.ElementTree as ET
import zipfile
from dataclasses import replace

import pytest

import rom
from cases.refusals import refuses
from cases.solid import block, reduced
from rom.cli.main import main
from rom.errors import ConfigError, FileFormatError, InterfaceError, RomError
from rom.io.archive import write_archive
from rom.io.native import body_arrays, body_manifest
from rom.names import MAX_CHARACTERS, check_name, check_text, file_name, inside

UNSEEN = ["a\0b", "a\nb", "a\rb", "a\x1b[2Jb", "\u202egnp.x", "a\u200bb", "a\u2028b", "\ud800",
          "x" * 300, "", " "]  # fmt: skip
ELSEWHERE = ["../../x", "/etc/x", "a/b", "..", ".", "~root/x", "-rf", "a\\b", ".x", "x ", " x"]
HARMLESS = ["$(touch x)", "`touch x`", "~root", "CON", "a;b", "50% (a+b), #3", "Kolben №1", "ピン",
            "=1+1", "x" * MAX_CHARACTERS, "%s{0}", '"""; open("x", "w"); """',
            "'); open('x', 'w'); ('"]  # fmt: skip
INJECTED = 'a"""<b>&\'],;=x'


def test_names_are_visible_and_lead_nowhere_else(tmp_path):
    for name in (*UNSEEN, 5, None, b"x"):
        for check in (check_text, check_name):
            refuses(ConfigError, "name", check, name, "a body")
    for name in ELSEWHERE:  # which may be read but not given
        assert check_text(name, "a body") == name
        refuses(ConfigError, re.escape(repr(name)), check_name, name, "a body")
        refuses(ConfigError, re.escape(repr(name)), file_name, name)
    for name in HARMLESS:
        assert check_name(name, "a body") == name
        path = inside(tmp_path, name, ".csv")
        path.touch()
        assert os.listdir(tmp_path) == [f"{name}.csv"]
        path.unlink()
    refuses(ConfigError, "shorter name", file_name, "ピ" * MAX_CHARACTERS, ".rom.npz")


def test_every_character_of_unicode_is_either_visible_or_refused():
    for code in range(0x3000):
        name = f"a{chr(code)}b"
        hidden = unicodedata.category(chr(code))[0] == "C" or code in (0x2028, 0x2029)
        try:
            check_text(name, "a body")
        except ConfigError as error:
            assert hidden and f"U+{code:04X}" in error.message and name not in error.message
        else:
            assert not hidden


@pytest.fixture(scope="module")
def body():
    return reduced(2, block(cells=(4, 1, 1)))


def listing(folder):
    return sorted(str(path) for path in folder.rglob("*"))


def forged(body, path, name, marker="root"):
    """A body file as a stranger would write it, its checksums right."""
    manifest = body_manifest(body) | {"name": name}
    manifest["markers"][0]["name"] = marker
    manifest.pop("sha256", None)
    return write_archive(path, manifest, body_arrays(body), "a body")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A working folder deep inside; what a name could reach is seen from above."""
    place = tmp_path / "one" / "two" / "here"
    place.mkdir(parents=True)
    monkeypatch.chdir(place)
    return place


@pytest.mark.parametrize("name", UNSEEN + ELSEWHERE + HARMLESS)
def test_a_body_file_with_that_name_writes_below_its_folder_only(name, body, folder, capsys):
    forged(body, folder / "b.npz", name)
    before = set(listing(folder.parents[1]))
    code = main(["simulate", "b.npz", "--hinge", "root", "--t-end", "2e-6", "--dt", "1e-6",
                 "-o", "out", "--history", "csv"])  # fmt: skip
    new = set(listing(folder.parents[1])) - before
    said = capsys.readouterr().err
    if name in HARMLESS:
        assert code in (0, 5), said
        wanted = {f"out/{name}.csv", f"out/{name}.history.csv", "out/run.json", "out/scene.json"}
        wanted.add("out")
        assert new == {str(folder / path) for path in wanted}
    else:
        assert code == (3 if name in UNSEEN else 2) and not new, said
        assert "name" in said and "Traceback" not in said


@pytest.mark.parametrize("name", UNSEEN)
def test_a_body_file_with_an_unseen_name_is_not_read(name, body, tmp_path):
    for changed in ({"name": name}, {"name": "b", "marker": name}):
        path = forged(body, tmp_path / "b.npz", **changed)
        refuses(FileFormatError, r"b\.npz: the name", rom.load, path)
    assert rom.load(forged(body, tmp_path / "b.npz", "b", "pin/a")).interface_names[0] == "pin/a"


@pytest.mark.parametrize("name", UNSEEN + ELSEWHERE)
def test_no_thing_is_given_such_a_name(name, body):
    mech = rom.Mechanism()
    ground, root = mech.ground.marker((0, 0, 0)), mech.add_flexible("b", body).marker("root")
    for give in (
        lambda: reduced(0, block(cells=(1, 1, 1)), name=name),
        lambda: mech.add_rigid(name, mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0)),
        lambda: mech.add_flexible(name, body),
        lambda: mech.fixed(name, ground, root),
        lambda: mech.force(name, root, (0, 0, 1.0)),
    ):
        refuses(ConfigError, "name", give)


@pytest.mark.parametrize("name", UNSEEN)
def test_what_is_read_has_visible_names(name, body):
    with pytest.raises(ConfigError):
        replace(body, name=name)
    with pytest.raises(InterfaceError):
        replace(block(cells=(1, 1, 1)).interfaces["root"], name=name)
    with pytest.raises(ConfigError):
        rom.Mechanism().add_rigid("b", mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0),
                                  markers={name: (0, 0, 0)})  # fmt: skip


@pytest.mark.parametrize("name", ["../../x", "a\nb", ".x"])
def test_the_command_line_refuses_it_before_the_computation(name, folder, capsys):
    before = listing(folder.parents[1])
    arguments = ["reduce", "missing.geo", "--E", "1", "--nu", "0", "--rho", "1", "-i", "root=rbe2"]
    assert main([*arguments, "--name", name, "-o", "b.npz"]) == 2
    assert "of a body" in capsys.readouterr().err
    (folder / "m.toml").write_text(
        f'[bodies.{json.dumps(name)}]\nmass = "1 kg"\ninertia = [1, 1, 1]\nat = [0, 0, 0]\n'
        '[simulation]\nt_end = "1 s"\ndt = "0.1 s"\n'
    )
    assert main(["simulate", "m.toml", "-o", "out"]) == 2
    assert "name" in capsys.readouterr().err
    (folder / "m.toml").unlink()
    assert listing(folder.parents[1]) == before


def test_names_do_not_break_out_of_xml_tables_and_programs(body, tmp_path, folder):
    tip = replace(body.markers["tip"], name=INJECTED)
    marked = replace(body, name=INJECTED, markers={"root": body.markers["root"], INJECTED: tip})
    labelled = replace(marked, labels=(INJECTED,) * marked.n_modes)
    root = ET.parse(rom.export(labelled, tmp_path / "x.vtu")).getroot()
    fields = [e.get("Name") for e in root.iterfind(".//PointData/DataArray")]
    assert fields and all(name.startswith(INJECTED) for name in fields)
    with zipfile.ZipFile(rom.export(marked, tmp_path / "x.fmu")) as archive:
        names = archive.namelist()
        told = ET.fromstring(archive.read("modelDescription.xml"))
    assert not [name for name in names if name.startswith("/") or ".." in name]
    assert any("<b>" in v.get("name") for v in told.iter("ScalarVariable"))
    rom.save(marked, folder / "b.npz")
    assert main(["simulate", "b.npz", "--hinge", "root", "--t-end", "2e-6", "--dt", "1e-6",
                 "-o", "out", "--history", "csv"]) in (0, 5)  # fmt: skip
    for path in folder.glob("out/*.csv"):
        with path.open(newline="") as file:
            head, *rows = csv.reader(file)
        assert {len(row) for row in rows} == {len(head)}
        assert any(name.startswith(INJECTED) for name in head)
    tree = ast.parse(rom.export(marked, folder / "x.py").read_text())
    assert not [node for node in ast.walk(tree) if isinstance(node, ast.Call)
                and getattr(node.func, "id", "") in ("exec", "eval", "system")]  # fmt: skip
    space = {}
    exec(compile(tree, "x.py", "exec"), space)
    assert space["INTERFACES"] == ["root", INJECTED]


@pytest.mark.parametrize("name", HARMLESS)
@pytest.mark.parametrize("to", ["npz", "vtu", "sid", "exudyn", "mbdyn", "openfast", "simscape"])
def test_every_format_takes_every_name_that_may_be_given(to, name, body, tmp_path):
    held = ("root",) if to == "openfast" else ()
    path = rom.export(replace(body, name=name), tmp_path / "x.out", to=to, held=held)
    assert os.listdir(tmp_path) == ["x.out"] and path.stat().st_size


def test_all_that_is_missing_is_named(body, tmp_path):
    model = block(cells=(1, 1, 1))
    with pytest.raises(InterfaceError, match="'a', 'b'; there are"):
        rom.reduce(model, method=rom.Guyan(), interfaces={"a": "rbe2", "root": "rbe2", "b": "full"})
    refuses(InterfaceError, "'a', 'b'; there are", body.frequencies, 3, fixed=("a", "root", "b"))
    arrays = body_arrays(body)
    for gone in (("K", "D"), ("marker/0/hold", "marker/1/point", "surface/shape")):
        left = {name: A for name, A in arrays.items() if name not in gone}
        path = write_archive(tmp_path / "b.npz", body_manifest(body), left, "a body")
        with pytest.raises(RomError) as caught:
            rom.load(path)
        assert not [name for name in gone if repr(name) not in caught.value.message]
        assert caught.value.where == str(path)


def test_a_body_that_is_none_of_hundreds_is_answered_in_one_line():
    mech = rom.Mechanism(gravity=(0, 0, 0))
    for k in range(150):
        mech.add_rigid(f"stone {k}", mass=1.0, inertia=(1, 1, 1), at=(k, 0, 0))
    with pytest.raises(ConfigError, match=r"no body 'stone_77'; the mechanism has \['stone 77',"):
        mech.part("stone_77")
    with pytest.raises(ConfigError, match=r"used twice; in use are \['stone 3',.* and 14\d more"):
        mech.add_rigid("stone 3", mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0))
