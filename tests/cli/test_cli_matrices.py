"""The verbs on matrices of another program: the same answers as from Python, errors by name.

The files are those of test_foreign_matrices.py and test_calculix.py.
"""

import pytest
from numpy.testing import assert_allclose

import rom
from cases.files.schema import answer
from cases.paths import TESTS
from cases.refusals import refuses
from rom.cli.main import main
from rom.cli.matrices import labels
from rom.config.component import source

DIR = TESTS / "reference" / "foreign"
CALCULIX = (DIR / "calculix.sti", "--mass", DIR / "calculix.mas", "--nodes", DIR / "calculix.inp")
NASTRAN = (f"{DIR / 'dense.op4'}:KAA", "--mass", f"{DIR / 'dense.op4'}:maa", "--nodes",
           DIR / "brick.bdf")  # fmt: skip
SETS = ("--set", "root=3,7,12,20", "--set", "tip=41, 55,60-60,101")
KINDS = {"root": "rbe2", "tip": "rbe2"}
INTERFACES = ("-i", "root=rbe2", "-i", "tip=rbe2")


def test_frequencies_of_matrices_with_node_sets_and_units(capsys):
    found = answer(capsys, "modes", *CALCULIX, "--fixed", "root", "-n", 3)
    model = rom.read_model(CALCULIX[0], CALCULIX[2], nodes=CALCULIX[4], interfaces=["root"])
    expected = rom.modes(model, 3, fixed=("root",)).frequencies
    assert_allclose(found["frequencies"], expected, rtol=1e-12)
    assert found["mass"] == pytest.approx(47.1) and found["n_dofs"] == 24
    options = ("modes", *NASTRAN, "-n", 7)
    si, mm = (answer(capsys, *options, *more) for more in ((), ("--units", "mm-t-s")))
    assert mm["mass"] == pytest.approx(1e3 * si["mass"])
    assert mm["frequencies"][6] == pytest.approx(si["frequencies"][6])


def test_a_body_of_matrices_with_labels(capsys, tmp_path):
    path = tmp_path / "brick.rom.npz"
    found = answer(capsys, "reduce", *NASTRAN, *SETS, *INTERFACES, "--method", "guyan", "-o", path)
    assert found["certificate"]["ok"] and found["name"] == "dense"
    model = rom.read_model(
        (DIR / "dense.op4", "KAA"), (DIR / "dense.op4", "MAA"), nodes=DIR / "brick.bdf",
        interfaces={"root": [3, 7, 12, 20], "tip": [41, 55, 60, 101]},
    )  # fmt: skip
    expected = rom.reduce(model, method=rom.Guyan(), interfaces=KINDS, certify=False)
    assert_allclose(rom.load(path).frequencies(), expected.frequencies(), rtol=1e-9)


FAULTS = {
    "no nodes": (CALCULIX[:3], "--mass needs --nodes"),
    "nodes without mass": ((CALCULIX[0], *CALCULIX[3:]), "--nodes needs --mass"),
    "material twice": ((*CALCULIX, "--rho", "1"), "--rho is for geometries"),
    "scale": ((*CALCULIX, "--scale", "1e-3"), "--scale is for geometries"),
    "no set": ((*NASTRAN, "--fixed", "root"), "which nodes are the interface 'root'?",
               "--set root=11-14,20"),
    "set of nobody": ((*CALCULIX, "--set", "pin=12"), "--set pin is no interface"),
    "modes without mass": ((CALCULIX[0], "--modal", "3"), "--modal needs --mass"),
    "drilling without mass": ((CALCULIX[0], "--hold-drilling"), "--hold-drilling needs --mass"),
    "modes": ((*CALCULIX, "--modal", "3-"), "--modal: '3-' must be a label"),
    "label": ((*CALCULIX, "--set", "a=3-x", "--fixed", "a"), "'3-x' must be a label"),
    "which": ((DIR / "dense.op4", *NASTRAN[1:]), "Name one, ", "FILE:NAME"),
}  # fmt: skip


@pytest.mark.parametrize("case", FAULTS)
def test_what_does_not_fit_is_named(case, capsys):
    words, *messages = FAULTS[case]
    code = main(["modes", *map(str, words)])
    assert 2 <= code <= 4
    said = capsys.readouterr().err
    assert all(message in said for message in messages), said


def test_names_stand_behind_a_colon(tmp_path):
    (tmp_path / "a:b.op4").touch()
    assert source(str(tmp_path / "a:b.op4")) == str(tmp_path / "a:b.op4")
    assert source("a.op4:KAA") == ("a.op4", "KAA") and source("a.mtx") == "a.mtx"
    assert labels("--set", "11-13, 20") == [11, 12, 13, 20]
    refuses(rom.ConfigError, "at most 10000000 nodes", labels, "--modal", "1-99999999999")
