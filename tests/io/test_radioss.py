"""A flexible body of OpenRadioss, read as its starter does: by columns of each line."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import rom
from cases.solid import block
from rom.errors import ConfigError
from rom.io.matrices.matrix_files import read_matrix
from rom.io.programs.interface_form import interface_form
from rom.io.programs.radioss import write_radioss
from rom.model import Interface

KINDS = {"root": "rbe2", "tip": "rbe2", "side": "rbe2"}


@pytest.fixture(scope="module")
def model():
    """A block with a third interface off its axis."""
    model = block(size=(1.0, 0.3, 0.2), cells=(4, 2, 1))
    X = model.points
    nodes = np.flatnonzero((X[:, 1] > 0.29) & (np.abs(X[:, 0] - 0.5) < 0.26))
    side = Interface("side", nodes, X[nodes], np.eye(nodes.size) / nodes.size**2,
                     X[nodes].mean(axis=0))  # fmt: skip
    model.interfaces["side"] = side
    return model


@pytest.fixture(scope="module")
def body(model):
    return rom.reduce(model, method=rom.Guyan(), interfaces=KINDS, certify=False)


def fixed_columns(text):
    """{name: (entries, 5) node, component, node, component, value} in the widths of the starter."""
    lines, found = text.splitlines(), {}
    assert lines[0].startswith("DMIG ")  # the first line is a header, or nothing is read
    for line in lines:
        if line.startswith("DMIG "):
            form, kind = int(line[24:32]), int(line[32:40])
            assert form == 6 and kind < 3
        elif line.startswith("DMIG*"):
            name, column = line[8:24].strip(), [int(line[24:40]), int(line[40:56])]
            assert name in ("KAAX", "MAAX")
        else:
            assert line[0] == "*"
            row = [int(line[8:24]), int(line[24:40]), float(line[40:56].replace("D", "E"))]
            found.setdefault(name, []).append([*column, *row])
    return {name: np.array(rows) for name, rows in found.items()}


def test_the_starter_finds_stiffness_and_mass_at_its_nodes(body, tmp_path):
    nodes = {"root": 70, "tip": 9, "side": 1234567890}
    path = write_radioss(body, tmp_path / "b.pch", nodes=nodes)
    form = interface_form(body)
    for name, A in (("KAAX", form.K), ("MAAX", form.M)):
        table = fixed_columns(path.read_text())[name]
        assert set(table[:, 0]) == set(nodes.values()) and set(table[:, 1]) == set(range(1, 7))
        start = {nodes[key]: 6 * k for k, key in enumerate(form.names)}
        i, j = ([start[n] + int(c) - 1 for n, c in table[:, s : s + 2]] for s in (0, 2))
        B = np.zeros_like(A)
        B[i, j] = B[j, i] = table[:, 4]
        assert_allclose(B, A, atol=1e-9 * np.abs(A).max())
    rigid = np.tile(np.eye(6, 3), (3, 1))
    assert_allclose(rigid.T @ B @ rigid, body.mass * np.eye(3), atol=1e-8 * body.mass)


def test_labels_count_from_one_and_matrices_come_back(body, tmp_path):
    path = rom.export(body, tmp_path / "b.pch")
    found = read_matrix((path, "KAAX"))
    assert_array_equal(found.dofs[::6, 0], [1, 2, 3])
    assert_allclose(found.A.toarray(), np.tril(interface_form(body).K), rtol=1e-9)
    assert "BAAX" not in path.read_text() and "GRID" not in path.read_text()


def test_what_openradioss_does_not_take_is_named(model, body, tmp_path):
    path = tmp_path / "b.pch"
    modal = rom.reduce(model, method=rom.CraigBampton(2), interfaces=KINDS, certify=False)
    with pytest.raises(ConfigError, match=r"has 2 modes; .*Reduce it with rom\.Guyan"):
        rom.export(modal, path)
    two = {name: KINDS[name] for name in ("root", "tip")}
    with pytest.raises(ConfigError, match="has 2 interfaces"):
        rom.export(rom.reduce(model, method=rom.Guyan(), interfaces=two, certify=False), path)
    with pytest.raises(ConfigError, match="must be one label for each interface"):
        write_radioss(body, path, nodes={"root": 1, "tip": 2})
    with pytest.raises(ConfigError, match="must be one label for each interface"):
        write_radioss(body, path, nodes={"root": 1, "tip": 2, "side": 2})
    with pytest.raises(ConfigError, match="1 to 10 digits"):
        write_radioss(body, path, nodes={"root": 1, "tip": 2, "side": -3})
    assert not path.exists()


def test_interfaces_on_a_line_are_refused(model, tmp_path):
    root, tip = model.interfaces["root"], model.interfaces["tip"]
    nodes = np.flatnonzero(np.abs(model.points[:, 0] - 0.5) < 1e-9)
    middle = Interface("middle", nodes, model.points[nodes], np.eye(nodes.size) / nodes.size**2,
                       0.5 * (root.origin + tip.origin))  # fmt: skip
    line = block(size=(1.0, 0.3, 0.2), cells=(4, 2, 1))
    line.interfaces["middle"] = middle
    kinds = {"root": "rbe2", "tip": "rbe2", "middle": "rbe2"}
    body = rom.reduce(line, method=rom.Guyan(), interfaces=kinds, certify=False)
    with pytest.raises(ConfigError, match="3 that do not lie on one line"):
        rom.export(body, tmp_path / "b.pch")
