"""Point masses and rigid elements of decks: what they are in the model, in both dialects.

The numbers come from points of mass, from least squares over nodes, from models built by hand, from
the cantilever of a textbook, and from CalculiX where it is installed.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial import cKDTree

import rom
from cases.files.cells import SIZE, bulk, ends, keywords, long, model_of, solid
from cases.files.damage import changed
from cases.files.schema import answer
from cases.refusals import refuses
from cases.solid import STEEL
from rom.cli.main import main
from rom.errors import FileFormatError, InterfaceError, MeshError
from rom.fe.mesh.input_deck import input_deck
from rom.fe.mesh.read import read_mesh
from rom.fe.mesh.sources import abaqus, nastran
from rom.reduction.full_model import mass_properties, operators

pytestmark = pytest.mark.fenicsx

REFERENCE = np.array([0.45, 0.02, 0.01])
# points of a rigid body beside the reference node: their masses, centre and tensor
CLOUD = np.random.default_rng(4).uniform(0.0, 0.1, (5, 3))
WEIGHTS = np.array([0.3, 0.9, 0.2, 0.5, 0.6])
CENTRE = WEIGHTS @ CLOUD / WEIGHTS.sum()
ARMS = CLOUD - CENTRE
SECOND = np.einsum("p,pi,pj->ij", WEIGHTS, ARMS, ARMS)  # integrals of x_i x_j
INERTIA = np.trace(SECOND) * np.eye(3) - SECOND
XX, YY, ZZ = np.diag(INERTIA)


TIED = ends(solid("hex8", (4, 1, 1), SIZE), "tip")
OFFSET = ",".join(repr(float(v)) for v in CENTRE)
MASS = repr(float(WEIGHTS.sum()))
BODY = [
    f"CONM2,8,900,0,{MASS},{OFFSET}",
    "," + ",".join(repr(float(v)) for v in (XX, SECOND[0, 1], YY, SECOND[0, 2], SECOND[1, 2], ZZ)),
]
RBE2 = f"RBE2,7,900,123456,{long(TIED)}"
HUNG = {900: REFERENCE.tolist()}.items()


def by_hand(folder, **body):
    """The model of the same box with an interface and an attachment."""
    body = rom.Attachment("spc_2", **body)
    return model_of(bulk(), folder, attachments=[body])


@pytest.mark.parametrize("degree", [1, 2])
def test_a_rigid_element_with_a_mass_is_an_interface_that_carries_it(degree, tmp_path):
    """In degree 2 nodes amid edges and faces of the end are tied as well."""
    model = model_of(bulk(RBE2, *BODY, nodes=HUNG), tmp_path, degree=degree)
    assert model.kinds == {"RBE2 7": "rbe2"}
    tie = model.interfaces["RBE2 7"]
    assert_allclose(tie.origin, REFERENCE)
    attached = rom.Attachment("spc_2", WEIGHTS.sum(), INERTIA, REFERENCE + CENTRE)
    plain = model_of(bulk(), tmp_path, degree=degree, attachments=[attached])
    assert_array_equal(np.sort(tie.nodes), np.sort(plain.interfaces["spc_2"].nodes))
    expected = rom.modes(plain, 6, fixed=("spc_1",), interfaces={"spc_2": "rbe2"})
    assert_allclose(rom.modes(model, 6, fixed=("spc_1",)).omega, expected.omega, rtol=1e-9)
    loose = rom.modes(plain, 6, fixed=("spc_1",))
    assert loose.omega[3] < 0.999 * expected.omega[3]  # the tie is felt


def test_mass_centre_and_inertia_are_those_of_the_points(tmp_path):
    found = mass_properties(model_of(bulk(RBE2, *BODY, nodes=HUNG), tmp_path))
    box = mass_properties(model_of(bulk(), tmp_path))
    x, m = np.vstack([box.centre, REFERENCE + CLOUD]), np.r_[box.mass, WEIGHTS]
    assert found.mass == pytest.approx(m.sum())
    centre = m @ x / m.sum()
    assert_allclose(found.centre, centre, rtol=1e-12)
    second = np.einsum("p,pi,pj->ij", m, x - centre, x - centre)
    J = box.inertia + np.trace(second) * np.eye(3) - second
    assert_allclose(found.inertia, J, atol=1e-10 * J.max())


def skew(x):
    return np.array([[0, -x[2], x[1]], [x[2], 0, -x[0]], [-x[1], x[0], 0]])


def as_matrix():
    """The 21 entries of a CONM1 that is the same body."""
    M = np.zeros((6, 6))
    for m, x in zip(WEIGHTS, CLOUD, strict=True):
        R = np.hstack([np.eye(3), -skew(x)])  # v + omega x r
        M += m * R.T @ R
    return ",".join(repr(float(v)) for v in M[np.tril_indices(6)])


def turned(axes, number=5):
    """CORD2R of these columns, and the same body in its coordinates."""
    rows = (np.zeros(3), axes[:, 2], axes[:, 0])
    system = ",".join(repr(float(v)) for row in rows for v in row).split(",")
    arm, J = axes.T @ CENTRE, axes.T @ SECOND @ axes
    I = np.trace(J) * np.eye(3) - J
    words = [*arm, "", I[0, 0], J[0, 1], I[1, 1], J[0, 2], J[1, 2], I[2, 2]]
    words = ["" if w == "" else repr(float(w)) for w in words]
    return [
        f"CORD2R,{number},0,{','.join(system[:6])}", "," + ",".join(system[6:]),
        f"CONM2,8,900,{number},{MASS},{','.join(words[:4])}", "," + ",".join(words[4:]),
    ]  # fmt: skip


Q = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
Q = Q * np.linalg.det(Q)
AT = ",".join(repr(float(v)) for v in REFERENCE + CENTRE)
HALF = as_matrix().split(",")
SPIDER = [f"RBAR,{40 + k},900,{node},123456" for k, node in enumerate(TIED)]
REVERSED = [f"RBAR,{40 + k},{node},900,,123456,123" for k, node in enumerate(TIED)]
FAR = {900: (0.45, 0.03, 0.01), 901: (0.45, 0.02, 0.01)}.items()
CARDS = {
    "CONM1": [RBE2, f"CONM1,8,900,0,{','.join(HALF[:5])}", *(
        "," + ",".join(HALF[k : k + 8]) for k in (5, 13))],
    "axes": [RBE2, *turned(Q)],
    "centre": [RBE2, BODY[0].replace("900,0", "900,-1").replace(OFFSET, AT), BODY[1]],
    "weights": ["PARAM,WTMASS,.5", RBE2, *(
        BODY[0].replace(MASS, repr(2 * float(WEIGHTS.sum()))),
        "," + ",".join(repr(2 * float(w)) for w in BODY[1].split(",")[1:])),
        "MAT1,1,2.1+11,,.3,15700."],
    "points": [RBE2, *(
        f"CONM2,{80 + k},900,,{float(m)!r},{','.join(repr(float(v)) for v in x)}"
        for k, (m, x) in enumerate(zip(WEIGHTS, CLOUD, strict=True)))],
    "displacements": [RBE2.replace("123456", "123"), *BODY],
    "expansion": [f"{RBE2},1.2-5", *BODY],
    "RBAR": [*SPIDER, *BODY],
    "RBAR, other end": [*REVERSED, *BODY],
    "two of one node": [f"RBE2,7,900,123,{long(TIED[:2])}", f"RBE2,9,900,123,{long(TIED[2:])}",
                        *BODY],
}  # fmt: skip


@pytest.mark.parametrize("card", CARDS)
def test_other_cards_say_the_same(card, tmp_path):
    text = bulk(*CARDS[card], nodes=HUNG)
    if card == "weights":
        text = text.replace("MAT1,1,2.1+11,,.3,7850.\n", "")
    same_motion(model_of(text, tmp_path), tmp_path)


def same_motion(model, folder, rtol=1e-9):
    """Properties and modes are those of the model that is built by hand."""
    (name,) = model.kinds
    attached = {"mass": WEIGHTS.sum(), "inertia": INERTIA, "at": REFERENCE + CENTRE}
    plain = by_hand(folder, **attached)
    one, other = mass_properties(model), mass_properties(plain)
    assert_allclose(one.inertia, other.inertia, atol=rtol * other.inertia.max())
    held = "root" if "root" in model.interfaces else "spc_1"
    expected = rom.modes(plain, 6, fixed=("spc_1",), interfaces={"spc_2": "rbe2"}).omega
    assert_allclose(rom.modes(model, 6, fixed=(held,)).omega, expected, rtol=rtol)
    assert name in model.interfaces


PLACES = {900: REFERENCE.tolist(), 901: (REFERENCE + CENTRE).tolist(), 902: (0.0, 0.0, 1.0)}.items()
TENSOR = ", ".join(repr(float(v)) for v in (XX, YY, ZZ, *(-SECOND)[[0, 0, 1], [1, 2, 2]]))
POINTS = f"""*ELEMENT, TYPE=MASS, ELSET=m
801, 901
*ELEMENT, TYPE=ROTARYI, ELSET=r
802, 901
*MASS, ELSET=m
{MASS}
*ROTARY INERTIA, ELSET=r
{TENSOR}
*MPC
BEAM, 901, 900
"""
TIES = {
    "RIGID BODY": "*RIGID BODY, NSET=TIP, REF NODE=900, ROT NODE=902",
    "PIN NSET": "*RIGID BODY, PIN NSET=tip, REF NODE=900",
    "COUPLING": "*COUPLING, CONSTRAINT NAME=c, REF NODE=900, SURFACE=FACE\n*KINEMATIC",
    "components": "*COUPLING, REF NODE=900, SURFACE=face\n*KINEMATIC\n1, 1\n2, 3",
    "node surface": "*SURFACE, NAME=points, TYPE=NODE\ntip,\n"
    "*COUPLING, REF NODE=900, SURFACE=points\n*KINEMATIC\n1, 6",
    "MPC": "*MPC\nBEAM, tip, 900",
}


@pytest.mark.parametrize("tie", TIES)
def test_the_other_dialect_says_the_same(tie, tmp_path):
    """The mass hangs on a node of its own, led by the reference node."""
    model = model_of(keywords(TIES[tie] + "\n" + POINTS, nodes=PLACES), tmp_path)
    same_motion(model, tmp_path)
    tied = model.interfaces[next(iter(model.kinds))]
    assert_allclose(tied.origin, REFERENCE)
    assert_allclose(tied.points[:, 0], SIZE[0])


def rigid_fit(points, weights, U, about):
    """Translation and rotation at a point of displacements U (3k,), by weighted least squares."""
    R = np.vstack([np.hstack([np.eye(3), -skew(x - about)]) for x in points])
    w = np.repeat(np.sqrt(weights), 3)
    return np.linalg.lstsq(w[:, None] * R, w * U, rcond=None)[0]


@pytest.mark.parametrize("degree", [1, 2])
def test_an_averaging_element_follows_the_least_squares_of_its_weights(degree, tmp_path):
    """Kinetic energy of what hangs on it, for any displacement; the nodes stay free."""
    a, b, c, d = TIED
    card = f"RBE3,7,,900,123456,2.,123,{a},{b}\n,.5,123,{c},1.5,123,{d},ALPHA,1.-5"
    model = model_of(bulk(card, *BODY, nodes=HUNG), tmp_path, degree=degree)
    assert model.kinds == {} and model.interfaces["RBE3 7"].nodes.size == 4
    nodes = cKDTree(model.points).query(solid("hex8", (4, 1, 1), SIZE).points[TIED - 1])[1]
    u = np.random.default_rng(0).normal(size=(model.n_dofs, 1))
    weights = np.array([2.0, 2.0, 0.5, 1.5])
    U = u.reshape(-1, 3)[nodes].ravel()
    v = rigid_fit(model.points[nodes], weights, U, REFERENCE)
    energy = sum(
        m * np.sum((v[:3] + np.cross(v[3:], x)) ** 2) for m, x in zip(WEIGHTS, CLOUD, strict=True)
    )
    ops = operators(model)
    added = (u.T @ ops.apply_M(u) - u.T @ (model.M @ u)).item()
    assert added == pytest.approx(energy, rel=1e-10)


def test_a_distributing_coupling_weighs_by_area(tmp_path):
    text = "*COUPLING, REF NODE=900, SURFACE=face\n*DISTRIBUTING\n" + POINTS.partition("*MPC")[0]
    model = model_of(keywords(text.replace(", 901", ", 900"), nodes=list(PLACES)[:1]), tmp_path)
    attached = {"mass": WEIGHTS.sum(), "inertia": INERTIA, "at": REFERENCE}
    plain = by_hand(tmp_path, **attached)
    expected = rom.modes(plain, 5, fixed=("spc_1",)).omega
    assert_allclose(rom.modes(model, 5, fixed=("root",)).omega, expected, rtol=1e-9)
    nodes = text.replace("SURFACE=face", "SURFACE=p").replace(", 901", ", 900")
    nodes = "*SURFACE, NAME=p, TYPE=NODE\ntip,\n" + nodes
    model = model_of(keywords(nodes, nodes=list(PLACES)[:1]), tmp_path)
    assert_allclose(model.interfaces["p"].surface_mass.toarray(), np.eye(4) / 4)


def test_a_mass_on_a_node_of_the_solid_is_a_point(tmp_path):
    text = bulk("CONM2,8,10,0,2.5", "CONM2,9,10,0,.5", "CONM2,11,3,0,0.")
    model = model_of(text, tmp_path)
    (body,) = model.attachments
    assert body.interface == "CONM2 8" and model.kinds == {}
    (node,) = model.interfaces["CONM2 8"].nodes
    expected = np.zeros(model.n_dofs)
    expected[3 * node : 3 * node + 3] = 3.0
    E = np.eye(model.n_dofs)
    added = operators(model).apply_M(E) - model.M @ E
    assert_allclose(added, np.diag(expected), atol=1e-14)
    reduced = rom.reduce(model, interfaces={"spc_1": "rbe2"}, stiffening=True)
    assert reduced.mass == pytest.approx(model.mass())
    heavier = rom.Attachment("CONM2 8", 3.0, at=model.points[node] + [0.0, 0.0, 1e-3])
    path = tmp_path / "a.bdf"
    turning = rom.fe.model(path, degree=1, attachments=[heavier])
    refuses(InterfaceError, "'CONM2 8' cannot turn", rom.modes, turning, 3, fixed=("spc_1",))


def test_ties_act_unnamed_and_are_supports(tmp_path):
    model = model_of(bulk(RBE2, *BODY, nodes=HUNG), tmp_path)
    body = rom.reduce(model, interfaces={"spc_1": "rbe2"})
    assert set(body.interface_names) == {"spc_1", "RBE2 7"}
    named = rom.reduce(model, interfaces={"spc_1": "rbe2", "RBE2 7": "rbe2"})
    assert_allclose(body.omega, named.omega, rtol=1e-12)
    held = rom.modes(model, 3, fixed={"RBE2 7": "xyz rx ry rz"}).omega
    plain = by_hand(tmp_path, mass=1.0)
    assert_allclose(held, rom.modes(plain, 3, fixed=("spc_2",)).omega, rtol=1e-9)
    shared = {"spc_2": "full"}
    refuses(InterfaceError, "model ties 'RBE2 7'", rom.modes, model, 3, interfaces=shared)
    more = rom.Attachment("RBE2 7", 1.5)
    again = model_of(bulk(RBE2, *BODY, nodes=HUNG), tmp_path, attachments=[more])
    assert again.mass() == pytest.approx(model.mass() + 1.5)


@pytest.mark.parametrize("kind", ["tet4", "tet10", "hex8", "hex20"])
def test_nodes_between_tied_ones_are_tied(kind, tmp_path):
    """At degree 2 the tie has the nodes of the surface, those amid edges listed or not."""
    mesh = solid("hex27" if kind == "hex20" else kind, (1, 1, 1), SIZE)
    name = {"tet4": "C3D4", "tet10": "C3D10", "hex8": "C3D8", "hex20": "C3D20"}[kind]
    text = input_deck(mesh, degree=mesh.kind.degree) if kind.startswith("tet") else None
    if text is None:
        used = np.unique(mesh.cells[:, :20])
        order = list(range(8)) + (
            [] if kind == "hex8" else [8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15]
        )
        cells = np.searchsorted(used, mesh.cells[:, order])
        rows = [
            f"{k}, {x!r}, {y!r}, {z!r}" for k, (x, y, z) in enumerate(mesh.points[used].tolist(), 1)
        ]
        at = [str(k) for k, x in enumerate(mesh.points[used], 1) if x[0] == SIZE[0]]
        cut = [", ".join(map(str, row + 1)).split(", ") for row in cells]
        table = [f"{k}, {', '.join(row[:10])}" + (f",\n{', '.join(row[10:])}" if row[10:] else "")
                 for k, row in enumerate(cut, 1)]  # fmt: skip
        text = "\n".join(["*NODE", *rows, f"*ELEMENT, TYPE={name}, ELSET=body", *table,
                          f"*NSET, NSET=tip\n{', '.join(at)}", ""])  # fmt: skip
    n = 9000
    text += f"*NODE\n{n}, .5, 0., 0.\n*RIGID BODY, NSET=tip, REF NODE={n}\n"
    (tmp_path / "a.inp").write_text(text)
    model = rom.fe.model(tmp_path / "a.inp", material=STEEL)
    tied = np.sort(model.interfaces["tip"].nodes)
    assert_array_equal(tied, np.flatnonzero(np.abs(model.points[:, 0] - SIZE[0]) < 1e-12))
    assert model.interfaces["tip"].area == pytest.approx(SIZE[1] * SIZE[2])  # of the surface
    if kind in ("tet10", "hex20"):
        refuses(MeshError, r"degree 1 .*Use degree=2", model_of, text, tmp_path, material=STEEL)
    refuses(MeshError, "degree 3", model_of, text, tmp_path, material=STEEL, degree=3)


def test_masses_have_units(tmp_path):
    """The same body in mm, t and s."""
    model = model_of(bulk(RBE2, *BODY, nodes=HUNG), tmp_path)
    mesh = solid("hex8", (4, 1, 1), tuple(1e3 * x for x in SIZE))
    far = {900: (1e3 * REFERENCE).tolist()}.items()
    numbers = [float(w) for w in BODY[1].split(",")[1:]]
    offset = ",".join(repr(float(1e3 * v)) for v in CENTRE)
    body = [f"CONM2,8,900,0,{float(WEIGHTS.sum() * 1e-3)!r},{offset}",
            "," + ",".join(repr(1e3 * v) for v in numbers)]  # fmt: skip
    text = bulk(RBE2, *body, mesh=mesh, nodes=far)
    text = text.replace("2.1+11,,.3,7850.", "2.1+5,,.3,7.85-9")
    found = model_of(text, tmp_path, units="mm-t-s")
    one, other = found.attachments[0], model.attachments[0]
    assert one.mass == pytest.approx(other.mass)
    assert_allclose(one.inertia, other.inertia)
    assert_allclose(one.at, other.at)
    assert_allclose(found.interfaces["RBE2 7"].origin, REFERENCE)
    refuses(FileFormatError, "no unit of the masses", model_of, text, tmp_path, scale=1e-3)


def test_what_would_lose_them_is_refused(tmp_path):
    (tmp_path / "a.bdf").write_text(bulk(RBE2, *BODY, nodes=HUNG))
    refuses(MeshError, "RBE2 7.*use rom.fe.model", rom.fe.pieces, tmp_path / "a.bdf", n=2,
            axis=(1, 0, 0), degree=1)  # fmt: skip
    mesh = solid("tet4", (1, 1, 1), SIZE)
    (tmp_path / "a.inp").write_text(input_deck(mesh, degree=1) + "*NODE\n900, .5, 0., 0.\n"
                                    "*RIGID BODY, NSET=tip, REF NODE=900\n")  # fmt: skip
    refuses(MeshError, "'tip'; these would be lost", input_deck, read_mesh(tmp_path / "a.inp"))


def test_a_tie_on_a_line_is_named(tmp_path):
    text = bulk(f"RBE2,7,900,123,{TIED[0]},{TIED[1]}", nodes=HUNG)
    refuses(InterfaceError, "'RBE2 7' lie on a line", model_of, text, tmp_path)


GOOD = bulk(RBE2, *BODY, "$", nodes=HUNG)
test_what_cannot_be_meant_is_named = changed(
    GOOD, "a.bdf", lambda path: nastran.read(str(path)),
    ("$", f"RBE2,9,901,123,{TIED[1]}\nGRID,901,,1.,0.,0.", r"RBE2 9: node \d+ depends on RBE2 7"),
    ("$", "RBE2,9,901,123456,900\nRBE2,11,900,123456,901\nGRID,901,,1.,0.,0.", "in a circle"),
    ("$", "RBE2,9,901,123,900\nGRID,901,,1.,0.,0.", "node 900 is a hinge: RBE2 9 only moves it"),
    ("$", "RBE2,7,901,123456,1,2\nGRID,901,,1.,0.,0.", "RBE2 7: another has this name"),
    ("$", "RBE2,9,901,123456,902\nGRID,901,,1.,0.,0.\nGRID,902,,2.,0.,0.", "RBE2 9: none of"),
    ("$", "RBE3,9,,900,123456,1.,123,1,2", "RBE3 9: .*900 moves with something else"),
    ("$", "RBE3,9,,2,123456,1.,123,1,3", "RBE3 9: .*2 moves with something else"),
    ("$", "RBE3,9,,901,123456,1.,123,1,900\nGRID,901,,1.,0.,0.", "its node 900 does not belong"),
    ("$", "RBE3,9,,901,123456,-1.,123,1,2\nGRID,901,,1.,0.,0.", "weight is -1, not above"),
    ("$", "RBE3,9,,901,123456,123,1,2\nGRID,901,,1.,0.,0.", "a node has no weight"),
    ("$", "CONM2,9,2,0,-1.", "CONM2 9: its mass is -1, below zero"),
    ("$", "CONM2,9,901,0,1.\nGRID,901,,1.,0.,0.", "CONM2 9: node 901 belongs neither"),
    ("$", "CONM2,9,903,0,1.", "CONM2 is not read: node 903 is not defined"),
    ("$", "CONM2,9,2,0,1.,.1", "CONM2 9: node 2 of the solid does not turn"),
    ("$", "CONM2,9,2,0,1.,,,,\n,1.", "CONM2 9: node 2 of the solid does not turn"),
    ("$", "CONM2,9,2,0,0.,,,,\n,1.", "CONM2 9: it has inertia and no mass"),
    ("$", "CONM2,9,2,6,1.", "coordinate system 6 is not defined"),
    ("$", "CONM1,9,900,0,1.,,2.", "CONM1 is not read: its matrix is not that of a rigid body"),
)  # fmt: skip
WORDS = keywords(TIES["RIGID BODY"] + "\n" + POINTS, nodes=PLACES)
test_what_cannot_be_meant_in_the_other_dialect_is_named = changed(
    WORDS, "a.inp", lambda path: abaqus.read(str(path)),
    ("REF NODE=900", "REF NODE=tip", "'tip' is 4 nodes instead of one"),
    ("NSET=TIP, ", "", r"\*RIGID BODY is not read: it has no set"),
    ("BEAM, 901, 900", "BEAM, 901", "a row is BEAM"),
    ("*MASS, ELSET=m", "*MASS, ELSET=r", "element 802 is not of its type"),
    ("*ROTARY INERTIA, ELSET=r\n", "**", "element 802 of the type ROTARYI has no"),
    ("BEAM, 901, 900", "BEAM, 902, 900", "ROTARYI 802: node 901|MASS 801: node 901"),
    (TIES["RIGID BODY"], TIES["COUPLING"].replace("=FACE", "=gone"), "surface 'gone' is unknown"),
)  # fmt: skip


def test_the_command_line_lists_them(tmp_path, capsys):
    (tmp_path / "a.bdf").write_text(bulk(RBE2, *BODY, nodes=HUNG))
    found = answer(capsys, "mesh", tmp_path / "a.bdf", "--units", "SI")
    assert found["ties"] == {"RBE2 7": TIED.size}
    assert found["masses"] == [{"interface": "RBE2 7", "mass": pytest.approx(WEIGHTS.sum())}]
    assert main(["mesh", str(tmp_path / "a.bdf"), "--units", "SI", "-q"]) == 0
    assert "mass of 2.5 kg on RBE2 7" in capsys.readouterr().out
