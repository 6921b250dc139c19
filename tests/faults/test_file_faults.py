"""Damaged and hostile files: a typed error, a model or a mechanism, never a crash."""

import os
import shutil
from functools import partial

import numpy as np
import pytest
from scipy.io import mmwrite
from scipy.sparse import random as random_matrix

import rom
from cases.files.damage import ARCHIVES, damaged, outcome
from cases.files.decks import BY_HAND, DECK, IM, RE, X, binary, dataset
from cases.files.toml_files import ALL, CRANK, PENDULUM, SOLID
from cases.mbs.mechanisms import random_body
from cases.paths import TESTS
from cases.solid import block, reduced
from rom.io.matrices.matrix_files import write_abaqus_matrix
from rom.io.matrices.node_files import read_node_sets, read_nodes

HERE = TESTS / "reference" / "foreign"
MUTANTS = 60
UNIVERSAL = dataset(5, 0, [X, RE, IM]) + dataset(6, 1, [RE, IM])
pytestmark = pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")


def typed(text):
    return lambda folder: text.encode()


def market(folder, **how):
    A = random_matrix(6, 6, 0.4, random_state=np.random.default_rng(1))
    mmwrite(str(folder / "m.mtx"), A.toarray() if how else A + A.T)
    return (folder / "m.mtx").read_bytes()


def abaqus(folder):
    dofs = np.column_stack([np.repeat([3, 9], 3), np.tile([1, 2, 3], 2)])
    return write_abaqus_matrix(np.eye(6) + 1.0, dofs, folder / "m.mtx").read_bytes()


def exported(to, held=(), body=lambda: reduced(2, block(cells=(2, 1, 1)))):
    return lambda folder: rom.export(body(), folder / "export", to=to, held=held).read_bytes()


def sid(dialect):
    return exported(dialect, body=lambda: random_body(np.random.default_rng(1), r=2))


def whole(name):
    return lambda folder: (HERE / name).read_bytes()


TEXTS = {  # case: (file name, its content, reader)
    **{kind: ("x.npz", lambda folder, make=make: make(folder).read_bytes(), read)
       for kind, (make, read) in ARCHIVES.items()},
    "sid": ("x.SID_FEM", sid("sid"), lambda path: rom.read_sid(path, ge="as_written")),
    "sid-pysid": ("x.SID_FEM", sid("sid-pysid"), rom.io.read_body),
    "sid-geisler": ("x.sid_fem", sid("sid-geisler"), rom.io.read_body),
    "mbdyn": ("x.fem", exported("mbdyn", body=lambda: random_body(np.random.default_rng(1), r=2)),
              rom.io.read_body),
    "exudyn": ("x.py", exported("exudyn", body=lambda: random_body(np.random.default_rng(1), r=2)),
               rom.io.read_body),
    "op4 text": ("x.op4", whole("dense.op4"), rom.io.read_op4),
    "op4 sparse": ("x.op4", whole("nonbigmat_text.op4"), rom.io.read_op4),
    "op4 long": ("x.op4", whole("bigmat_text.op4"), rom.io.read_op4),
    "op4 binary": ("x.op4", whole("dense_binary.op4"), rom.io.read_op4),
    "op4 binary sparse": ("x.op4", whole("nonbigmat_binary.op4"), rom.io.read_op4),
    "op4 binary long": ("x.op4", whole("bigmat_binary.op4"), rom.io.read_op4),
    "dmig": ("x.dmig", whole("brick.dmig"), rom.io.read_dmig),
    "punch": ("x.pch", exported("dmig"), lambda path: rom.io.read_matrix((path, "KAAX"))),
    "grids": ("x.bdf", whole("brick.bdf"), rom.io.read_grids),
    "market": ("x.mtx", market, rom.io.read_matrix),
    "market dense": ("x.mtx", lambda folder: market(folder, dense=True), rom.io.read_matrix),
    "abaqus": ("x.mtx", abaqus, rom.io.read_matrix),
    "user element": ("x.mtx", typed(BY_HAND), rom.io.read_user_element),
    "substructure": ("x.mtx", whole("calculix.mtx"), rom.io.read_matrix),
    "user element of a body": ("x.inp", exported("abaqus"), rom.io.read_user_element),
    "openfast": ("x.dat", exported("openfast", ["root"]), rom.io.read_openfast),
    "openfast-4": ("x.dat", exported("openfast-4", ["root"]), rom.io.read_openfast),
    "universal": ("x.unv", typed(UNIVERSAL), rom.io.read_universal),
    "test": ("x.unv", whole("sdynpy_test.unv"), partial(rom.io.read_responses, averages=9)),
    "test binary": ("x.uff", whole("pyuff_test.uff"), partial(rom.io.read_responses, averages=9)),
    "modes": ("x.unv", whole("sdynpy_test.unv"), rom.io.read_modes),
    "universal binary": ("x.uff", lambda folder: binary(5, 1), rom.io.read_universal),
    "universal of another program": ("x.uff", whole("pyuff_binary.uff"), rom.io.read_universal),
    "nodes": ("x.inp", typed(DECK), read_nodes),
    "sets": ("x.inp", typed(DECK), lambda path: read_node_sets(path, ("root", "tip"))),
    "table of nodes": ("x.csv", typed("1, 0, 0, 1.5\n2, 1e-1, 0, 0\n3, 0, 1, 0\n"), read_nodes),
    "stiffness": ("calculix.sti", whole("calculix.sti"), rom.io.read_stored_matrix),
    "labels": ("calculix.dof", whole("calculix.dof"),
               lambda path: rom.io.read_stored_matrix(path.with_suffix(".sti"))),
}  # fmt: skip

COMPLETE = {  # case: bytes at the end that no reader needs
    "body": 0, "family": 0, "state": 0,
    "sid": 1, "sid-pysid": 1, "sid-geisler": 1, "mbdyn": 0,
    "op4 text": 24, "op4 sparse": 24, "op4 long": 24,
    "op4 binary": 0, "op4 binary sparse": 0, "op4 binary long": 0, "market": 0, "market dense": 0,
    "user element of a body": 0, "substructure": 0, "openfast": 22, "openfast-4": 22,
    "stiffness": 0, "labels": 0,
}  # fmt: skip


@pytest.fixture
def file(request, tmp_path):
    """(path, content, reader) of a case; the other files of CalculiX stand beside."""
    name, content, read = TEXTS[request.param]
    for part in (".sti", ".dof"):
        shutil.copy(HERE / f"calculix{part}", tmp_path)
    data, path = content(tmp_path), tmp_path / name
    path.write_bytes(data)
    assert outcome(read, path) is None
    return path, data, read


@pytest.mark.parametrize("file", TEXTS, indirect=True)
def test_damage_is_refused_or_harmless(file):
    path, data, read = file
    found = []
    for _, content in damaged(data, np.random.default_rng(3), MUTANTS):
        path.write_bytes(content)
        found.append(outcome(read, path))
    assert sum(error is not None for error in found) > MUTANTS // 5


@pytest.mark.parametrize("file", COMPLETE, indirect=True)
def test_a_cut_is_noticed_wherever_it_is(file, request):
    path, data, read = file
    end = len(data) - COMPLETE[request.node.callspec.params["file"]]
    rng = np.random.default_rng(4)
    for at in {*rng.integers(1, end, 30), *range(end - 12, end)}:
        path.write_bytes(data[:at])
        assert outcome(read, path) is not None, f"cut at {at} of {len(data)} and not noticed"


@pytest.mark.parametrize("file", TEXTS, indirect=True)
def test_what_is_no_file_is_named(file, monkeypatch):
    path, data, read = file
    for make, words in (
        (lambda: None, "no such file"),
        (lambda: path.symlink_to(path.name), "no such file"),  # a circle
        (lambda: path.symlink_to("/dev/zero"), "pipe or device"),
        (lambda: os.mkfifo(path), "pipe or device"),  # reading it would wait for ever
    ):
        path.unlink(missing_ok=True)
        make()
        assert words in str(outcome(read, path))
    path.unlink()
    path.mkdir()
    assert "folder" in str(outcome(read, path))
    path.rmdir()
    path.write_bytes(b"")
    assert outcome(read, path) is not None or path.suffix in (".bdf", ".inp", ".csv")
    path.write_bytes(data)
    refused = {str(path), str(path.with_suffix(".sti"))}
    monkeypatch.setattr(os, "access", lambda name, mode: str(name) not in refused)
    assert "may not be read" in str(outcome(read, path))  # even by root


def part(path):
    component = rom.read_component(path)
    assert component.mesh and component.material()


@pytest.mark.parametrize(
    ("text", "read"),
    [(SOLID, part), (PENDULUM, lambda path: rom.read_mechanism(path).mechanism()),
     (CRANK, rom.read_mechanism), (ALL, rom.read_mechanism)],
    ids=["component", "pendulum", "crank", "everything"],
)  # fmt: skip
def test_damage_of_a_description_is_refused_or_harmless(text, read, tmp_path):
    path, found = tmp_path / "x.toml", []
    for _, data in damaged(text.encode(), np.random.default_rng(8), 200):
        path.write_bytes(data)
        found.append(outcome(read, path, memory=None))
    assert sum(isinstance(x, rom.ConfigError) for x in found) > 50 and None in found
