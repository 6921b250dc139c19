"""Structures of which only reduced matrices are known become the bodies of their full models.

The reduction that other programs do is done here with NumPy: interface nodes and modes with these
held. Its span is that of the reduction in rom, so that both bodies are the same one.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.io import hb_write, mmwrite
from scipy.linalg import eigh
from scipy.sparse import csc_matrix, csr_matrix, tril

import rom
from cases.refusals import refuses
from cases.solid import block
from cases.structures.frames import Section, frame
from rom.cli.main import main
from rom.config.component import read_component
from rom.errors import ConfigError, FileFormatError, ModelError, QualityGateError
from rom.io.matrices.dmig import write_dmig
from rom.io.matrices.matrix_files import read_matrix, write_abaqus_matrix
from rom.io.matrices.node_files import read_dofs
from rom.io.matrices.op4 import write_op4
from rom.io.matrices.read_model import read_model
from rom.io.matrices.user_element import write_user_element
from rom.io.programs.interface_form import interface_form

ENDS = {"root": "rbe2", "tip": "rbe2"}
FULL = {"root": "full", "tip": "full"}
POINTS = np.array([[0.1, 0, 0], [0.3, 0, 0], [0.6, 0.1, 0], [0.6, 0.4, 0.2], [0.5, 0.5, 0.6]])
AXES = ("UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ")


@pytest.fixture(scope="module")
def bent():
    """A bar that turns round two corners, five nodes of six rows."""
    return frame(POINTS, [(k, k + 1) for k in range(4)], Section(0.03, 0.05), {"root": 0, "tip": 4})


class Superelement:
    """K, M and D of a model between its interface nodes, labelled 10, 20, … and modes 1001, …"""

    def __init__(self, model, m):
        n, k = model.n_dofs, len(model.points)
        nodes = np.concatenate([i.nodes for i in model.interfaces.values()])
        six = n > 3 * k
        b = np.concatenate([np.r_[3 * i + np.arange(3), (3 * (k + i) + np.arange(3))[: 3 * six]]
                            for i in nodes])  # fmt: skip
        i = np.setdiff1d(np.arange(n), b)
        K, M = (A.toarray() for A in (model.K, model.M))
        self.omega2, V = eigh(K[np.ix_(i, i)], M[np.ix_(i, i)], subset_by_index=(0, m - 1))
        T = np.zeros((n, b.size + m))
        T[b, np.arange(b.size)] = 1.0
        T[i, : b.size] = -np.linalg.solve(K[np.ix_(i, i)], K[np.ix_(i, b)])
        T[i, b.size :] = V
        self.K, self.M = (0.5 * (A + A.T) for A in (T.T @ X @ T for X in (K, M)))
        labels = 10 * (1 + np.arange(nodes.size))
        self.points, self.nodes = (
            model.points[nodes],
            dict(zip(labels, model.points[nodes], strict=True)),
        )
        at = np.column_stack([np.repeat(labels, 3 + 3 * six),
                              np.tile(np.arange(1, 4 + 3 * six), nodes.size)])  # fmt: skip
        self.modes = np.column_stack([1001 + np.arange(m), np.zeros(m, dtype=int)])
        self.dofs = np.concatenate([at, self.modes])
        ends = np.cumsum([0, *(j.nodes.size for j in model.interfaces.values())])
        parts = zip(model.interfaces, ends[:-1], ends[1:], strict=True)
        self.sides = {name: labels[a:b] for name, a, b in parts}

    @property
    def placed(self):
        return np.array(list(self.nodes)), self.points


@pytest.fixture(scope="module")
def reduced(bent):
    return Superelement(bent, 6)


def boeing(path, A, width=(14, 14, 25), per=(1, 1, 1), rhs=False, kind="RSA"):
    """As Ansys writes it: one number in a line; the lower triangle of a symmetric matrix."""
    A = csc_matrix(tril(A) if kind == "RSA" else A)
    A.sort_indices()
    tables = [A.indptr + 1, A.indices + 1, A.data]
    lines = []
    for table, w, n in zip(tables, width, per, strict=True):
        words = [f"{x:{w}d}" if table.dtype.kind == "i" else f"{x:{w}.15E}".replace("E", "D")
                 for x in table]  # fmt: skip
        lines.append(["".join(words[k : k + n]) for k in range(0, len(words), n)])
    counts = [sum(map(len, lines)), *map(len, lines)] + [A.shape[0]] * rhs
    head = [f"{'Stiffness':72}{'':8}", "".join(f"{c:14d}" for c in counts),
            f"{kind}{'':11}{A.shape[0]:14d}{A.shape[1]:14d}{A.nnz:14d}{0:14d}",
            f"{f'({per[0]}I{width[0]})':16}{f'({per[1]}I{width[1]})':16}"
            f"{f'({per[2]}D{width[2]}.15)':20}{'(1D25.15)':20}"]  # fmt: skip
    head += [f"F{'':13}{1:14d}{0:14d}"] * rhs
    behind = [f"{0.0:25.15E}"] * (A.shape[0] * rhs)
    path.write_text("\n".join([*head, *(line for part in lines for line in part), *behind, ""]))
    return path


def extrn(element):
    """Cards of a superelement of Nastran, as in its punch file."""
    pairs = {}
    for label, component in element.dofs.tolist():
        pairs[label] = pairs.get(label, "") + str(component)
    words = [w for label, c in pairs.items() for w in (str(label), c)]
    rows = ["".join(f"{w:>8}" for w in words[k : k + 8]) for k in range(0, len(words), 8)]
    grids = [f"GRID,{n},,{x!r},{y!r},{z!r}" for n, (x, y, z) in
             zip(element.nodes, element.points.tolist(), strict=True)]  # fmt: skip
    cards = ["BEGIN SUPER      101", "EXTRN   " + rows[0], *(" " * 8 + row for row in rows[1:])]
    return "\n".join([*cards, *grids, "SPOINT   1001    THRU 1006", "DTI     TUG1    0", ""])


def written(kind, e, folder):
    """Arguments of read_model for the files of a superelement, one kind of each program."""
    nodes = {"nodes": e.placed}
    order = np.lexsort(e.dofs.T[::-1])
    if kind == "dmig":
        path = write_dmig({"KAAX": e.K, "MAAX": e.M}, e.dofs, folder / "a.pch", nodes=e.nodes)
        other = "DMIG    PAX            0       9       2       0                       1\n"
        path.write_text(path.read_text() + other + "DMIG*   PAX                  1       0\n")
        return (path, "kaax"), (path, "maax"), {"nodes": path}
    if kind == "op4":
        K, M = (A[np.ix_(order, order)] for A in (e.K, e.M))
        path = write_op4({"KXX": K, "MXX": M}, folder / "a.op4")
        (folder / "a.pch").write_text(extrn(e))
        return (path, "KXX"), (path, "MXX"), {"nodes": folder / "a.pch"}
    if kind == "abaqus":
        matrices = {"STIFFNESS": e.K, "MASS": e.M}
        path = write_user_element(matrices, e.dofs, folder / "a.inp", nodes=e.nodes)
        return (path, "STIFFNESS"), (path, "MASS"), {"nodes": path}
    if kind == "internal":  # generalised coordinates on nodes with negative labels
        dofs = np.where(e.dofs > 1000, 1000 - e.dofs, e.dofs)
        dofs[dofs[:, 1] == 0, 1] = 1
        path = write_user_element({"STIFFNESS": e.K}, dofs, folder / "k.mtx", nodes=e.nodes)
        listed = "** NODE NUMBERS WHICH ARE NOT POSITIVE INDICATE INTERNAL NODES.\n1, 2, 3"
        path.write_text(path.read_text().replace("\n1, 2, 3", f"\n{listed}", 1))
        return path, write_abaqus_matrix(e.M, dofs, folder / "m.mtx"), nodes
    if kind == "coordinates":
        for name, A in (("k", e.K), ("m", e.M)):
            rows = [f"{i + 1}, {j + 1}, {A[i, j]:.17g}" for i, j in np.ndindex(A.shape) if j <= i]
            (folder / f"{name}.mtx").write_text("\n".join([*rows, ""]))
        table = [f"{label}, {component}" for label, component in e.dofs.tolist()]
        (folder / "dofs.csv").write_text("# label, component\n" + "\n".join([*table, ""]))
        nodes |= {"dofs": folder / "dofs.csv"}
        return folder / "k.mtx", folder / "m.mtx", nodes
    if kind == "market":
        for name, A in (("k", e.K), ("m", e.M)):
            mmwrite(str(folder / f"{name}.mtx"), csr_matrix(A), symmetry="symmetric")
        return folder / "k.mtx", folder / "m.mtx", nodes | {"dofs": e.dofs}
    at = e.dofs[e.dofs[:, 1] > 0]  # modes stand behind, in no line of the map
    lines = [f"{k:14d}{label:14d}   {AXES[c - 1]}" for k, (label, c) in enumerate(at.tolist(), 1)]
    path = folder / "k.mapping"
    path.write_text("\n".join(["    Matrix Eqn          Node   DOF", *lines[::-1], ""]))
    return (boeing(folder / "k.matrix", e.K), boeing(folder / "m.dat", e.M, (8, 8, 24), (10, 10, 3),
            rhs=True), nodes | {"dofs": path})  # fmt: skip


KINDS = ["dmig", "op4", "abaqus", "internal", "coordinates", "market", "ansys"]


def same(one, other, rtol=1e-8):
    """Frequencies in all supports, mass, inertia and momentum of the shapes."""
    assert_allclose(one.mass, other.mass, rtol=rtol)
    assert_allclose(one.inertia, other.inertia, rtol=rtol, atol=rtol * other.inertia.max())
    for fixed in ((), ("root",), ("tip",), ("root", "tip")):
        assert_allclose(one.frequencies(fixed=fixed), other.frequencies(fixed=fixed), rtol=rtol)
    size = max(np.abs(other.S).max(), 1e-3 * np.sqrt(other.mass))  # about mean axes there is none
    assert_allclose(np.abs(one.S), np.abs(other.S), atol=10 * rtol * size)


@pytest.mark.parametrize("kind", KINDS)
def test_a_superelement_is_the_body_of_its_full_model(bent, reduced, kind, tmp_path):
    K, M, given = written(kind, reduced, tmp_path)
    model = read_model(K, M, interfaces=reduced.sides, **given)
    assert (model.n_dofs, model.n_scalars) == (18, 6)
    how = {"method": rom.CraigBampton(6), "interfaces": ENDS, "reference": "root"}
    bodies = [rom.reduce(m, certify=False, **how) for m in (model, bent)]
    same(*bodies, rtol=1e-7 if kind == "dmig" else 1e-8)
    certificate = rom.reduce(model, **how).certificate
    assert certificate.ok, certificate  # to what was given nothing is missing
    row = certificate.rows[-1]
    assert "full is the superelement given" in row.quantity and row.limit == "information"
    assert 0.1 < row.value < 0.9
    assert "superelement" not in str(rom.reduce(bent, **how).certificate)


def test_all_modes_of_a_solid_are_its_full_model(tmp_path):
    solid = block((0.4, 0.1, 0.08), (3, 1, 1))
    element = Superelement(solid, 24)
    K, M, given = written("op4", element, tmp_path)
    model = read_model(K, M, interfaces=element.sides, **given)
    assert (model.n_dofs, model.n_scalars) == (48, 24)
    for kinds in (ENDS, FULL):
        how = {"method": rom.CraigBampton(24), "interfaces": kinds, "reference": "root",
               "certify": False}  # fmt: skip
        if kinds is FULL:
            how["reference"] = "mean-axis"
        same(*(rom.reduce(m, **how) for m in (model, solid)))


@pytest.mark.parametrize("to", ["dmig", "op4", "inp"])
def test_what_is_exported_comes_back_as_a_body(bent, to, tmp_path):
    how = {"method": rom.CraigBampton(6), "interfaces": ENDS, "certify": False}
    body = rom.reduce(bent, damping=rom.Rayleigh(0.0, 1e-5), **how)
    path = rom.export(body, tmp_path / f"bent.{to}")
    form = interface_form(body)
    given = {"interfaces": {"root": [1], "tip": [2]}, "nodes": path}
    names = ("KAAX", "MAAX", "BAAX")
    if to == "op4":
        given |= {"nodes": (list(form.points), list(form.points.values())), "dofs": form.dofs}
    if to == "inp":
        names = ("STIFFNESS", "MASS", None)
    K, M, D = ((path, name) if name else None for name in names)
    back = rom.reduce(read_model(K, M, D=D, **given), **how)
    same(back, body, rtol=1e-7 if to == "dmig" else 1e-8)
    damped = body.D if D else np.zeros_like(body.D)
    assert_allclose(np.abs(back.D), np.abs(damped), atol=1e-6 * body.D.max())


def test_options_and_keys_of_a_file_say_the_same(bent, reduced, tmp_path, capsys, monkeypatch):
    """Rows of modes on nodes of their own, which have a place, and damping of the deformation."""
    monkeypatch.chdir(tmp_path)
    write_op4({"K": reduced.K, "M": reduced.M, "B": 2e-5 * reduced.K}, tmp_path / "a.op4")
    dofs = np.where(reduced.dofs == 0, 1, reduced.dofs)
    (tmp_path / "dofs.csv").write_text("".join(f"{n}, {c}\n" for n, c in dofs))
    more = [(n, np.ones(3)) for n in reduced.modes[:, 0]]
    rows = [",".join(map(str, (n, *x.tolist()))) for n, x in [*reduced.nodes.items(), *more]]
    (tmp_path / "nodes.csv").write_text("\n".join(rows) + "\n")
    sides = {name: ",".join(map(str, labels)) for name, labels in reduced.sides.items()}
    options = "a.op4:K --mass a.op4:M --damping-matrix a.op4:B --nodes nodes.csv --dofs dofs.csv"
    given = [word for name, text in sides.items()
             for word in ("--set", f"{name}={text}", "-i", f"{name}=rbe2")]  # fmt: skip
    how = ["-m", "6", "--no-certificate", "-o", "by_options.rom.npz"]
    without = ["reduce", *options.split(), *given, *how]
    assert main(without) == 4 and "do not move along three axes" in capsys.readouterr().err
    assert main([*without, "--modal", "1001-1006"]) == 0
    text = """[matrices]\nstiffness = "a.op4:K"\nmass = "a.op4:M"\ndamping = "a.op4:B"
nodes = "nodes.csv"\ndofs = "dofs.csv"\nmodal = [1001, 1002, 1003, 1004, 1005, 1006]
[matrices.sets]\n""" + "".join(f"{name} = [{labels}]\n" for name, labels in sides.items())
    text += '[interfaces]\nroot = "rbe2"\ntip = "rbe2"\n[reduction]\nmodes = 6\n'
    (tmp_path / "part.toml").write_text(text + "certificate = false\n")
    bodies = [rom.load("by_options.rom.npz"), read_component("part.toml").body()]
    direct = rom.reduce(bent, method=rom.CraigBampton(6), interfaces=ENDS, certify=False)
    for body in bodies:
        same(body, direct)
        assert_allclose(body.D, 2e-5 * body.K, atol=1e-9 * body.D.max())


def test_damping_is_that_of_the_deformation(bent, reduced, tmp_path):
    """Stiffness-proportional D gives zeta = beta omega / 2; with mass in it, motions meet it."""
    tables = {"K": reduced.K, "M": reduced.M, "B": 2e-5 * reduced.K, "A": 3.0 * reduced.M}
    path = write_op4(tables, tmp_path / "a.op4")
    given = {"nodes": reduced.placed, "interfaces": reduced.sides, "dofs": reduced.dofs}
    model = read_model((path, "K"), (path, "M"), D=(path, "B"), **given)
    how = {"method": rom.CraigBampton(6), "interfaces": ENDS, "certify": False}
    body = rom.reduce(model, reference="tip", **how)
    assert_allclose(body.D, 2e-5 * body.K, atol=1e-9 * body.D.max())
    told = rom.reduce(model, damping=rom.ModalDamping(0.01), **how)
    assert_allclose(np.diag(told.D), 0.02 * told.omega)
    refuses(QualityGateError, "meets the damping .* rom.Rayleigh", read_model, (path, "K"),
            (path, "M"), D=(path, "A"), **given)  # fmt: skip
    crash = read_model((path, "K"), (path, "M"), D=(path, "B"), units="mm-kg-ms", **given)
    assert_allclose(crash.D.toarray(), 2e-8 * crash.K.toarray(), atol=1e-9 * abs(crash.D).max())


def test_one_interface_that_carries_all_stiffness(reduced, tmp_path):
    """Nodes tied to one point leave modes alone: its own motions have no stiffness at all."""
    K, M, given = written("op4", reduced, tmp_path)
    model = read_model(K, M, interfaces={"all": [10, 20]}, **given)
    body = rom.reduce(model, method=rom.CraigBampton(6), interfaces={"all": "rbe2"})
    assert body.certificate.ok, body.certificate
    held = body.frequencies(fixed=("all",))
    assert_allclose(held, np.sqrt(reduced.omega2) / (2 * np.pi), rtol=1e-8)


def test_what_no_superelement_has_is_named(reduced, tmp_path):
    e, path = reduced, tmp_path / "a.op4"
    given = {"nodes": e.placed, "interfaces": e.sides, "dofs": e.dofs}

    def read(K=e.K, M=e.M, **other):
        write_op4({"K": K, "M": M}, path)
        return read_model((path, "K"), (path, "M"), **given | other)

    grounded, negative, tied = e.K.copy(), e.M.copy(), np.zeros((19, 19))
    grounded[0, 0] += 1e6
    negative[14, 14] = -1.0
    tied[:18, :18], tied[18, [0, 6]], tied[[0, 6], 18] = e.K, (1, -1), (1, -1)
    heavy, more = np.zeros((19, 19)), np.r_[e.dofs, [[-1, 1]]]
    heavy[:18, :18] = e.M
    for error, words, other in (
        (QualityGateError, r"meets the stiffness .* Write K without boundary", {"K": grounded}),
        (ModelError, "1 entries on the diagonal of the mass are negative", {"M": negative}),
        (ModelError, "1 rows .* as those of Lagrange multipliers.* hybrid",
         {"K": tied, "M": heavy, "dofs": more}),
        (QualityGateError, "check nodes, axes, units and labels of modes",
         {"modal": [20], "interfaces": {"root": [10]}}),
        (ModelError, r"modal names \[7\], which no row", {"modal": [7]}),
        (QualityGateError, "meets the stiffness", {"nodes": (e.placed[0], 1e3 * e.points)}),
        (QualityGateError, "meets the stiffness",
         {"M": e.M, "nodes": (e.placed[0], 1e3 * e.points), "units": "mm-t-s"}),
        (FileFormatError, r"a\.op4 K: it has 18 rows; the table of dofs has 19.* leave it out",
         {"dofs": more}),
        (FileFormatError, r"dofs: dofs are .* \[10, 1\] comes twice",
         {"dofs": np.r_[e.dofs[:1], e.dofs[:-1]]}),
        (FileFormatError, "a component is another", {"dofs": np.r_[e.dofs[:-1], [[3, 7]]]}),
        (ModelError, "2 nodes do not move along three axes: node 1003 has the components .1, 2.",
         {"dofs": np.r_[e.dofs[:12], np.column_stack([[1003, 1003, 1004, 1004, 1005, 1006],
                                                      [1, 2, 1, 2, 0, 0]])]}),
    ):  # fmt: skip
        refuses(error, words, read, **other)
    lone = np.r_[e.dofs[:12], [[30, 2]], e.dofs[13:]]
    at = (np.r_[e.placed[0], 30], np.r_[e.points, [[1.0, 1.0, 0.0]]])
    refuses(ModelError, r"node 30 has the components \[2\] alone", read, dofs=lone, nodes=at)
    assert read(dofs=lone, nodes=at, modal=[30]).n_scalars == 6


def test_tables_of_dofs_that_do_not_fit(tmp_path):
    for name, text, error, words in (
        ("a.txt", "1, 1\n", ConfigError, "dofs must come from .csv, .mapping, or bulk data"),
        ("a.csv", "1, 1\n2\n", FileFormatError, r"a\.csv, line 2: a line is label, component"),
        ("a.csv", "1, x\n", FileFormatError, "'x' is no whole number"),
        ("a.mapping", "1 10 UX\n3 10 UY\n", FileFormatError, "a row is missing"),
        ("a.mapping", "1 10 TEMP\n", FileFormatError, "line 1: a line is row, node, UX to ROTZ"),
        ("a.pch", "EXTRN   1       x\n", FileFormatError, "this EXTRN is not read: field 3"),
        ("b.csv", None, FileFormatError, "there is no such"),
    ):  # fmt: skip
        if text is not None:
            (tmp_path / name).write_text(text)
        refuses(error, words, read_dofs, tmp_path / name)
    (tmp_path / "a.pch").write_text("GRID,1,,1.,2.,3.\n")
    assert read_dofs(tmp_path / "a.pch") is None


def test_boeing_files_that_are_damaged(tmp_path):
    rng = np.random.default_rng(3)
    A = rng.normal(size=(5, 5))
    path = boeing(tmp_path / "a.hb", A, (3, 3, 22), (3, 4, 2), rhs=True, kind="RUA")
    assert_allclose(read_matrix(path).A.toarray(), A, rtol=1e-14)
    hb_write(str(tmp_path / "b.hb"), csc_matrix(A))
    assert_allclose(read_matrix(tmp_path / "b.hb").A.toarray(), A, rtol=1e-14)
    lines = path.read_text().splitlines()
    for change, words in (
        ({2: lines[2].replace("RUA", "CUA")}, "a matrix CUA is not real, square and assembled"),
        ({2: lines[2].replace(f"{25:14d}", f"{10**9:14d}")}, "1000000000 entries do not fit"),
        ({2: lines[2].replace(f"{25:14d}", f"{24:14d}")}, "25 numbers where 24 are announced"),
        ({5: lines[5].replace(" 6", "16")}, "columns do not ascend"),
        ({7: lines[7].replace(" 2", " 9")}, "a row is none of 5"),
        ({-12: lines[-12].replace("D", "x")}, "is no finite number"),
    ):  # fmt: skip
        changed = list(lines)
        for k, line in change.items():
            assert changed[k] != line
            changed[k] = line
        path.write_text("\n".join([*changed, ""]))
        refuses(rom.RomError, words, read_matrix, path)
    path.write_text("\n".join(lines[:-12]))
    refuses(FileFormatError, "the last line is cut", read_matrix, path)


def test_files_that_need_another_format(tmp_path):
    (tmp_path / "a.op2").write_bytes(b"\4\0\0\0")
    refuses(ConfigError, r"ending '\.op2'.* DMIGPCH, or MATOP4", read_matrix, tmp_path / "a.op2")
    head = "DMIG    PAX            0       9       4       0                       1\n"
    (tmp_path / "a.pch").write_text(head)
    refuses(FileFormatError, "no DMIG matrix that is square and real; PAX are not", read_matrix,
            tmp_path / "a.pch")  # fmt: skip
    for text, words in (("1, 1, 2.0\n1, 1, 1, 1, 2.0\n", "line 2: this is no entry"),
                        ("0, 1, 2.0\n", "is no place in a matrix"),
                        ("1, 99999999, 2.0\n", "is no place in a matrix")):  # fmt: skip
        (tmp_path / "a.mtx").write_text(text)
        refuses(FileFormatError, words, read_matrix, tmp_path / "a.mtx")


def test_stored_matrices_of_six_rows_a_node(bent, tmp_path):
    """CalculiX has six rows at the nodes of its user elements, labelled 1 to 6."""
    n = len(POINTS)
    order = [3 * (k + n * turn) + a for k in range(n) for turn in (0, 1) for a in range(3)]
    for ending, A in (("sti", bent.K), ("mas", bent.M)):
        A = A[order][:, order].toarray()
        rows = [f"{i + 1} {j + 1} {A[i, j]:.17e}" for i, j in np.ndindex(A.shape)
                if i == j or (i < j and A[i, j])]  # fmt: skip
        (tmp_path / f"b.{ending}").write_text("\n".join([*rows, ""]))
    labels = [f"{k + 1}.{c}" for k in range(n) for c in range(1, 7)]
    (tmp_path / "b.dof").write_text("\n".join([*labels, ""]))
    model = read_model(tmp_path / "b.sti", tmp_path / "b.mas", nodes=(np.arange(n) + 1, POINTS),
                       interfaces={"root": [1], "tip": [5]})  # fmt: skip
    how = {"method": rom.CraigBampton(4), "interfaces": ENDS, "certify": False}
    same(*(rom.reduce(m, **how) for m in (model, bent)))
