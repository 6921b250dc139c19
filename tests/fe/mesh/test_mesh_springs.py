"""Springs of decks: the stiffness that they give to one body, and what is no spring of it.

The numbers come from energies of springs between places whose motion is fitted by least squares,
from two bodies on a spring, from CalculiX where it is installed, and from the full model.
"""

import re
import shutil
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial import cKDTree

import rom
from cases.command import ran
from cases.files.cells import SIZE, bulk, ends, keywords, long, model_of, solid
from cases.files.damage import changed
from cases.files.schema import answer
from cases.ranks.environment import written_on_each
from cases.refusals import refuses
from rom.components.wheels.sector import stresses_of
from rom.errors import FileFormatError, ModelError, in_file
from rom.fe.mesh.sources import abaqus, nastran

pytestmark = [
    pytest.mark.fenicsx,
    pytest.mark.filterwarnings("ignore:cells with 100%:rom.errors.RomWarning"),
]

MESH = solid("hex8", (4, 1, 1), SIZE)
ROOT, TIP = (ends(MESH, name) for name in ("root", "tip"))
NODE = dict(enumerate(MESH.points, 1))
Q = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
Q = Q * np.linalg.det(Q)
A, B = np.array([0.45, 0.02, 0.01]), np.array([-0.03, 0.01, 0.02])
K = np.array([1e6, 2e6, 3e6, 400.0, 500.0, 600.0])
I3 = np.eye(3)


def words(*values):
    return ",".join(repr(float(v)) for v in np.ravel(values))


def lines(*values):
    """Fields behind the second, over as many lines as they need."""
    fields = words(*values).split(",")
    return f"{','.join(fields[:6])}\n,{','.join(fields[6:])}"


# 900 at A leads the tip; 901 at B leads the root, 902 at A, and 904 along the first axis from A
HEAD = [
    f"CORD2R,5,0,{lines(np.zeros(3), Q[:, 2], Q[:, 0])}",
    f"CORD2C,6,0,{lines(np.zeros(3), I3[2], I3[0])}",
    f"GRID,900,,{words(A)},5", f"GRID,901,,{words(B)},5", f"GRID,902,,{words(A)},5",
    f"GRID,903,,{words(0.1, 0.3, -0.2)}", f"GRID,904,,{words(A + 0.1 * Q[:, 0])},5",
    f"RBE2,7,900,123456,{long(TIP)}", f"RBE2,8,901,123456,{long(ROOT)},902\n,904",
]  # fmt: skip
PBUSH = f"PBUSH,60,K,{words(K)}"


def on_line(a, b, beside):
    """Axes of which the first leads from a to b and the second has the vector beside."""
    x = (b - a) / np.linalg.norm(b - a)
    y = beside - beside @ x * x
    y /= np.linalg.norm(y)
    return np.column_stack([x, y, np.cross(x, y)])


def around_z(x):
    r = np.array([x[0], x[1], 0.0]) / np.hypot(x[0], x[1])
    return np.column_stack([r, np.cross(I3[2], r), I3[2]])


V = np.array([0.2, 0.9, -0.3])
ONE, FOUR = K * (np.arange(6) == 0), K * np.isin(np.arange(6), (0, 3))
ROTATION = K[0] * (np.arange(6) == 3)
END = NODE[ROOT[0]], NODE[TIP[-1]]
# cards, ends, the place of the spring, its axes and its stiffness
CARDS = {
    "CID": (["CBUSH,50,60,900,901,,,,5", PBUSH], ("tip", "root"), (A + B) / 2, Q, K),
    "S": (["CBUSH,50,60,900,901,,,,5\n,.25", PBUSH], ("tip", "root"), A + (B - A) / 4, Q, K),
    "basic": (["CBUSH,50,60,900,901,,,,0", PBUSH], ("tip", "root"), (A + B) / 2, I3, K),
    "around": (["CBUSH,50,60,900,901,,,,6", PBUSH], ("tip", "root"), (A + B) / 2, around_z(A), K),
    "vector": ([f"CBUSH,50,60,900,901,{words(V)}", PBUSH], ("tip", "root"), (A + B) / 2,
               on_line(A, B, Q @ V), K),
    "third": (["CBUSH,50,60,900,901,903", PBUSH], ("tip", "root"), (A + B) / 2,
              on_line(A, B, np.array([0.1, 0.3, -0.2]) - A), K),
    "line": (["CBUSH,50,60,900,901", f"PBUSH,60,K,{K[0]},,,{K[3]}"], ("tip", "root"), (A + B) / 2,
             on_line(A, B, V), FOUR),
    "number": (["CBUSH,60,,900,902,,,,5", PBUSH], ("tip", "root"), A, Q, K),
    "stress": (["CBUSH,60,,900,902,,,,5", "PBUSH,60,RCV,1.,1.,,,,,\n,K," + words(K)],
               ("tip", "root"), A, Q, K),
    "component": ([f"CELAS2,50,{K[0]},900,2,902,2"], ("tip", "root"), A, Q[:, [1, 2, 0]], ONE),
    "along": ([f"CELAS2,50,{K[0]},900,1,904,1"], ("tip", "root"), A, Q, ONE),
    "rotation": (["CELAS1,50,9,900,5,901,5", f"PELAS,4,1.,,,9,{K[0]}"], ("tip", "root"), A,
                 Q[:, [1, 2, 0]], ROTATION),
    "own number": ([f"CELAS1,50,,900,2,902,2\nPELAS,50,{K[0]}"], ("tip", "root"), A,
                   Q[:, [1, 2, 0]], ONE),
    "nodes": ([f"CELAS2,50,{K[0]},{ROOT[0]},1,{TIP[0]},1"], (ROOT[0], TIP[0]), A, I3, ONE),
    "across": ([f"CBUSH,50,60,{ROOT[0]},{TIP[-1]}\nPBUSH,60,K,{K[0]}"], (ROOT[0], TIP[-1]), END[0],
               on_line(*END, V), ONE),
    "one of each": ([f"CBUSH,50,60,900,7,,,,5\n,1.\nPBUSH,60,K,{words(K[:3])}"], ("tip", 7),
                    NODE[7], Q, K * (np.arange(6) < 3)),
}  # fmt: skip


def skew(x):
    return np.array([[0, -x[2], x[1]], [x[2], 0, -x[0]], [-x[1], x[0], 0]])


def motion(model, end, at, weights=None):
    """(6, n) motion of a place with nodes that fit it best, or of the displacement of a node."""
    nodes = {"root": ROOT, "tip": TIP}.get(end, [end])
    here = cKDTree(model.points).query([NODE[n] for n in nodes])[1]
    out = np.zeros((6, model.n_dofs))
    dofs = (3 * here[:, None] + np.arange(3)).ravel()
    if len(nodes) == 1:
        out[:3, dofs] = I3
        return out
    R = np.vstack([np.hstack([I3, -skew(x - at)]) for x in model.points[here]])
    w = np.repeat(np.ones(len(nodes)) if weights is None else weights, 3)
    out[:, dofs] = np.linalg.solve(R.T @ (w[:, None] * R), R.T * w)
    return out


def stiffness(model, places, at, axes, k, **weights):
    """(n, n) of a spring."""
    one, other = (motion(model, end, at, **weights) for end in places)
    q = np.kron(np.eye(2), axes).T @ (other - one)
    return q.T @ np.diag(k) @ q


def added(model, plain):
    assert plain.springs == () and np.array_equal(model.points, plain.points)
    return (model.K - plain.K).toarray()


def same(found, expected, rtol=1e-9):
    """Whether two matrices of springs are one, beside that of the elements they stand in."""
    assert_allclose(found, expected, atol=rtol * np.abs(expected).max() + 1e-4)


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    return model_of(bulk(*HEAD, mesh=MESH), tmp_path_factory.mktemp("plain"))


@pytest.mark.parametrize("card", CARDS)
def test_a_card_adds_the_energy_of_its_spring(card, plain, tmp_path):
    cards, *expected = CARDS[card]
    model = model_of(bulk(*HEAD, *cards, mesh=MESH), tmp_path)
    assert len(model.springs) == 1
    dK = added(model, plain)
    same(dK, stiffness(model, *expected))
    R = model.rigid_motions()
    assert np.abs(dK @ R).max() < 1e-9 * np.abs(dK).max() and rom.check(model).ok
    assert model.operators.K.norm() == pytest.approx(np.sqrt((model.K.data**2).sum()))


def test_a_spring_on_an_averaging_element_acts_on_its_mean(tmp_path):
    a, b, c, d = TIP
    tie = f"RBE3,7,,900,123456,2.,123,{a},{b}\n,.5,123,{c},1.5,123,{d}"
    head = [*HEAD[:-2], tie]
    spring = ["CBUSH,50,60,900,1,,,,5\n,1.", f"PBUSH,60,K,{words(K[:3])}"]
    plain = model_of(bulk(*head, mesh=MESH), tmp_path)
    model = model_of(bulk(*head, *spring, mesh=MESH), tmp_path)
    one = motion(model, "tip", NODE[1], weights=np.array([2.0, 2.0, 0.5, 1.5]))
    q = Q.T @ (motion(model, 1, NODE[1]) - one)[:3]
    same(added(model, plain), q.T @ np.diag(K[:3]) @ q)


MASSES, J = (2.0, 3.0), (np.array([2e-3, 3e-3, 4e-3]), np.array([5e-3, 4e-3, 6e-3]))
SOFT = "MAT1,1,2.1+3,,.3,7.85-5"  # a hundred millionth of steel, which sounds alike


def two_bodies(*cards):
    """Both ends heavy, their mass centres at A, and next to nothing between."""
    bodies = zip((900, 902), MASSES, J, strict=True)
    heavy = [f"CONM2,{80 + n},{n},0,{m},,,,\n,{x},,{y},,,{z}" for n, m, (x, y, z) in bodies]
    text = bulk(*HEAD, *heavy, *cards, mesh=MESH)
    return text.replace("MAT1,1,2.1+11,,.3,7850.", SOFT)


@pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")
def test_two_bodies_swing_on_their_spring(tmp_path):
    """f = sqrt(k (1/m1 + 1/m2)) / 2 pi, and with moments of inertia of the rotations."""
    model = model_of(two_bodies("CBUSH,50,60,900,902,,,,0", PBUSH), tmp_path)
    inverse = np.r_[np.full(3, 1 / MASSES[0] + 1 / MASSES[1]), 1 / J[0] + 1 / J[1]]
    expected = np.sort(np.sqrt(K * inverse)) / (2 * np.pi)
    assert_allclose(rom.modes(model, 12).frequencies[6:], expected, rtol=1e-4)
    body = rom.reduce(model, certify=False)
    assert_allclose(body.omega[:6] / (2 * np.pi), expected, rtol=1e-4)
    assert "spring" not in str(body.provenance.get("buckling loads"))


def test_the_reduced_body_has_it_as_the_full_model_does(tmp_path):
    """Interfaces unnamed, named, and held; the certificate compares with the full model."""
    cards = CARDS["S"][0]
    model = model_of(bulk(*HEAD, *cards, mesh=MESH), tmp_path)
    loose = model_of(bulk(*HEAD, mesh=MESH), tmp_path)
    free, without = (rom.modes(m, 12).frequencies[6:] for m in (model, loose))
    assert np.abs(free / without - 1).max() > 1e-2
    for kinds in (None, {"RBE2 7": "rbe2", "RBE2 8": "rbe2"}, {"RBE2 7": "rbe2"}):
        body = rom.reduce(model, method=rom.CraigBampton(20), interfaces=kinds)
        assert body.certificate.ok
        assert_allclose(body.omega[:6] / (2 * np.pi), free, rtol=1e-4)
    held = rom.modes(model, 4, fixed={"RBE2 8": "xyz rx ry rz"}).frequencies
    assert (held > 1.001 * rom.modes(loose, 4, fixed={"RBE2 8": "xyz rx ry rz"}).frequencies).any()
    many = rom.modes(model, f_max=1.01 * free[3]).frequencies
    assert_allclose(many[6:], free[:4], rtol=1e-3)


def test_it_has_units(plain, tmp_path):
    """The same body in mm, t and s: N/mm and N mm/rad."""
    cards = CARDS["S"][0]
    mesh = replace(MESH, points=1e3 * MESH.points)
    head = [re.sub(r"(GRID,\d+,,)([^,]*),([^,]*),([^,]*)", lambda m: m[1] + words(
        [1e3 * float(m[k]) for k in (2, 3, 4)]), card) for card in HEAD]  # fmt: skip
    other = [cards[0], f"PBUSH,60,K,{words(K * np.repeat([1e-3, 1e3], 3))}"]
    text = bulk(*head, *other, mesh=mesh).replace("2.1+11,,.3,7850.", "2.1+5,,.3,7.85-9")
    found = model_of(text, tmp_path, units="mm-t-s")
    same(found.K.toarray() - plain.K.toarray(), stiffness(found, *CARDS["S"][1:]), rtol=1e-7)
    refuses(FileFormatError, "no unit of the masses and springs", model_of, text, tmp_path,
            scale=1e-3)  # fmt: skip


UNDER_MPI = """import sys
from mpi4py import MPI
import numpy as np
import rom
model = rom.fe.model(sys.argv[1], degree=1)
body = rom.reduce(model, method=rom.CraigBampton(24))
free, ok = rom.modes(model, 12).omega[6:], body.certificate.ok
if MPI.COMM_WORLD.rank == 0:
    np.savez(sys.argv[2], free=free, reduced=body.omega, ok=ok, springs=model.springs)
"""


@pytest.mark.mpi
def test_ranks_agree(tmp_path):
    """A spring between reference nodes, whose ties lie on several ranks, and one between nodes."""
    fine = solid("hex8", (9, 2, 2), SIZE)
    root, tip = (ends(fine, name) for name in ("root", "tip"))
    a, b = (f"GRID,{n},,{words(x)}" for n, x in ((990, A), (991, B)))
    ties = [f"RBE2,{7 + k},{990 + k},123456,{long(nodes[:5])}\n,{','.join(map(str, nodes[5:]))}"
            for k, nodes in enumerate((tip, root))]  # fmt: skip
    springs = ["CBUSH,90,60,990,991,,,,0", PBUSH, f"CELAS2,91,1.+7,{root[0] + 9},1,{tip[0] - 9},1"]
    path = tmp_path / "a.bdf"
    path.write_text(bulk(a, b, *ties[:1], *springs, ties[1], mesh=fine))
    found = written_on_each((1, 3), tmp_path, "-c", UNDER_MPI, path)
    one, other = (found[n] for n in (1, 3))
    assert other["ok"] and list(other["springs"]) == ["CELAS2 91", "CBUSH 90"]
    for name in ("free", "reduced"):
        assert_allclose(other[name], one[name], rtol=1e-9)


SPRINGS = f"""*ELEMENT, TYPE=SPRINGA, ELSET=sa
51, {ROOT[0]}, {TIP[-1]}
*ELEMENT, TYPE=SPRING2, ELSET=sb
52, {ROOT[1]}, {TIP[1]}
*SPRING, ELSET=sa

1.e8
*SPRING, ELSET=sb
1, 1
2.e8
"""
STEP = "*STEP\n*FREQUENCY\n8\n*BOUNDARY\nroot, 1, 3\n*NODE FILE\nU\n*END STEP\n"
PLACES = {900: A.tolist(), 901: B.tolist()}.items()
TIES = "*RIGID BODY, NSET=tip, REF NODE=900\n*RIGID BODY, NSET=root, REF NODE=901\n"


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not installed")
def test_frequencies_are_those_of_calculix(tmp_path):
    """To the seven digits that it prints; both springs are felt."""
    text = keywords(SPRINGS, mesh=MESH).replace("*SURFACE, NAME=face, TYPE=ELEMENT\n4, S4", "**")
    model = model_of(text, tmp_path)
    assert model.springs == ("SPRINGA 51", "SPRING2 52")
    (tmp_path / "job.inp").write_text(text + STEP)
    done = ran("ccx", "job", cwd=tmp_path)
    assert done.returncode == 0 and "WARNING" not in done.stdout, done.stdout[-2000:]
    table = (tmp_path / "job.dat").read_text().partition("P A R T I C I P")[0].splitlines()
    theirs = [
        float(row.split()[3]) for row in table if row.split()[:1] and row.split()[0].isdecimal()
    ]
    ours = rom.modes(model, 8, fixed=("root",)).frequencies
    assert_allclose(ours, theirs, rtol=2e-7)
    without = rom.modes(model_of(keywords("", mesh=MESH), tmp_path), 8, fixed=("root",)).frequencies
    assert ours[0] > 1.01 * without[0] and ours[5] > 1.05 * without[5]


def test_the_other_dialect_has_reference_nodes(tmp_path):
    text = TIES + SPRINGS.replace(f"{ROOT[0]}, {TIP[-1]}", "900, 901")
    text = text.replace(f"{ROOT[1]}, {TIP[1]}", "901, 900").replace("1, 1\n", "5, 5\n")
    plain = model_of(keywords(TIES, nodes=PLACES, mesh=MESH), tmp_path)
    model = model_of(keywords(text, nodes=PLACES, mesh=MESH), tmp_path)
    expected = stiffness(
        model, ("tip", "root"), A, on_line(A, B, V), np.array([1e8, 0, 0, 0, 0, 0])
    )
    expected += stiffness(model, ("root", "tip"), A, I3, np.array([0, 0, 0, 0, 2e8, 0]))
    same(added(model, plain), expected)


def read(dialect):
    def call(path):
        with in_file(path):
            return dialect.read(str(path))

    return call


GOOD = bulk(*HEAD, "CBUSH,50,60,900,901,,,,5", PBUSH, "$", mesh=MESH)
BUSH, OTHER = "CBUSH,50,60,900,901,,,,5", "CELAS2,70,1.+6"
test_what_is_no_spring_of_the_body_is_named = changed(
    GOOD, "a.bdf", read(nastran),
    ("$", f"{OTHER},900,1", "CELAS2 70: an end of it is at ground.*in the mechanism"),
    ("$", f"{OTHER},900,1,902,0", "CELAS2 70: an end of it is at ground"),
    ("$", f"{OTHER},,,902,1", "CELAS2 70: an end of it is at ground"),
    (BUSH, "CBUSH,50,60,900,,,,,5", "CBUSH 50: an end of it is at ground"),
    ("$", f"{OTHER},900,1,902,2", "CELAS2 70: it would hold the body"),
    ("$", f"{OTHER},900,2,902,5", "CELAS2 70: it would hold the body"),
    ("$", f"{OTHER},900,12,902,12", "CELAS2 70: .*or without direction"),
    ("$", f"{OTHER},900,1,7,1", "CELAS2 70: it would hold the body"),  # in other axes
    ("$", f"{OTHER},900,2,904,2", "CELAS2 70: it would hold the body.*Use a CBUSH"),
    ("$", f"{OTHER},{ROOT[0]},2,{TIP[0]},2", "CELAS2 70: it would hold the body"),
    ("$", f"{OTHER},{ROOT[0]},4,{TIP[0]},4", "CELAS2 70: .*or turn a node of the solid"),
    ("$", f"CBUSH,70,60,{ROOT[0]},{TIP[0]},,,,0", "CBUSH 70: .*turn a node of the solid.*rigid"),
    ("$", f"CBUSH,70,61,900,{TIP[0]},,,,0\nPBUSH,61,K,,1.", "CBUSH 70: .*or turn a node"),
    ("$", "CELAS2,70,-5.,900,1,902,1", "CELAS2 70: its stiffness is -5, not above zero"),
    (PBUSH, "PBUSH,60,B,1.", "CBUSH 50: its stiffness is 0, not above zero"),
    (PBUSH, f"PBUSH,60,K,1.,{-K[1]}", "CBUSH 50: its stiffness is -2e.06"),
    ("$", "CBUSH,70,61,900,901,,,,5", "PBUSH 61 is used but not defined"),
    ("$", "CELAS1,70,61,900,1,902,1", "no property of a CELAS1 is defined"),
    ("$", "CELAS1,70,60,900,1,902,1\nPELAS,60,1.,,,60,1.", "PELAS 60 is defined twice"),
    ("$", "CELAS2,50,1.,900,1,902,1", "element 50 is defined twice"),
    ("$", "CELAS2,1,1.,900,1,902,1", "element 1 is defined twice"),
    ("$", "CBUSH,70,60,900,999,,,,5", "CBUSH is not read: node 999 is not defined"),
    ("$", f"{OTHER},900,1,999,1", "CELAS2 is not read: node 999 is not"),
    ("$", f"{OTHER},903,4,7,4", "CELAS2 70: node 903 belongs neither"),
    ("$", "CBUSH,70,60,900,903,,,,5", "CBUSH 70: node 903 belongs neither"),
    ("$", "CBUSH,70,60,900,901", "CBUSH 70: it has more than K1 and K4"),
    ("$", "CBUSH,70,60,900,902", "CBUSH 70: its nodes lie in one place, so it needs a CID"),
    ("$", "CBUSH,70,60,900,901,,,,9", "system 9 is not defined"),
    ("$", f"CBUSH,70,60,900,901,{words(Q.T @ (B - A))}", "points of a coordinate system lie on"),
    ("$", "CBUSH,70,60,900,901,,,,5\n,,0,1.", r"CBUSH, OCID \(1, .*Springs"),
    (PBUSH, f"{PBUSH}\n,M,1.", r"PBUSH, M \(1, .*Springs: linear ones"),
    ("$", "PBUSHT,60,K,1", r"PBUSHT \(1, .*Springs"),
)  # fmt: skip
WORDS = keywords(TIES + SPRINGS, nodes=PLACES, mesh=MESH)
test_what_is_no_spring_in_the_other_dialect_is_named = changed(
    WORDS, "a.inp", read(abaqus),
    ("TYPE=SPRINGA", "TYPE=SPRING1", r"TYPE=SPRING1 .*to ground, stand in the mechanism"),
    ("TYPE=SPRINGA", "TYPE=CONN3D2", r"\*ELEMENT, TYPE=CONN3D2"),
    ("*SPRING, ELSET=sa", "*SPRING, ELSET=sa, NONLINEAR", r"\*SPRING, NONLINEAR .*linear ones"),
    ("*SPRING, ELSET=sb", "*SPRING, ELSET=sb, ORIENTATION=o", r"\*SPRING, ORIENTATION"),
    ("*SPRING, ELSET=sb\n1, 1\n2.e8\n", "", "element 52 of the type SPRING2 has no .SPRING"),
    ("*SPRING, ELSET=sb", "*SPRING, ELSET=sa", "element 51 is not of its type, or has one"),
    ("1.e8", "1.e8\n2.e8, , 20.", "element 51: it has 2 rows, not those of one stiffness"),
    ("1.e8", "0.", "SPRINGA 51: its stiffness is 0"),
    ("1, 1\n2.e8", "2.e8", "element 52: it has 1 rows"),
    ("1, 1\n", "1, 2\n", "SPRING2 52: it would hold the body"),
    ("1, 1\n", "2, 2\n", "SPRING2 52: it would hold the body"),
    ("1, 1\n", "0, 0\n", "SPRING2 52: an end of it is at ground"),
    ("52, ", "51, ", "element 51 is defined twice"),
    ("52, ", "3, ", "element 3 is defined twice"),
    (f"51, {ROOT[0]}, {TIP[-1]}", f"51, {ROOT[0]}, {ROOT[0]}", "SPRINGA 51: .*without direction"),
    (f"51, {ROOT[0]}, {TIP[-1]}", f"51, {ROOT[0]}", "a line is cut"),
)  # fmt: skip


def test_damping_of_springs_is_told(tmp_path):
    path = tmp_path / "a.bdf"
    cards = ["CBUSH,50,60,900,901,,,,5", f"{PBUSH}\n,GE,.1\n,B,5.", "CELAS2,51,1.,900,1,902,1,.1",
             "CELAS1,52,9,900,1,902,1", "PELAS,9,1.,.05"]  # fmt: skip
    path.write_text(bulk(*HEAD, *cards, mesh=MESH))
    (told,) = (text for text in nastran.read(str(path))[1]["warnings"] if "left aside" in text)
    assert all(
        f"{name} (1, " in told for name in ("PBUSH, GE", "PBUSH, B", "CELAS2, GE", "PELAS, GE")
    )


def test_what_knows_small_motions_alone_is_refused_beyond(tmp_path):
    model = model_of(bulk(*HEAD, *CARDS["S"][0], mesh=MESH), tmp_path)
    refuses(ModelError, "springs of a deck, .*CBUSH 50.*stiffening=False", rom.reduce, model,
            stiffening=True)  # fmt: skip
    bent = rom.Geometric(loads={"RBE2 7": (0, 0, 1e2, 0, 0, 0)})
    refuses(ModelError, "CBUSH 50.* large deflection", rom.reduce, model, nonlinear=bent,
            reference="RBE2 8", interfaces={"RBE2 8": "rbe2", "RBE2 7": "rbe2"})  # fmt: skip
    refuses(ModelError, "CBUSH 50.* rotation and heat", stresses_of, model)
    for parameter in (rom.YoungsModulus(None, 0.5, 2.0), rom.Thickness("property_1", 0.5, 2.0)):
        asked = {"parameters": {"p": parameter}, "method": rom.CraigBampton(2), "interfaces": {}}
        refuses(
            ModelError,
            "CBUSH 50.* (factor of YoungsModulus of the whole|thickness)",
            rom.reduce_parametric,
            model,
            **asked,
        )


def test_a_family_of_regions_keeps_the_spring(tmp_path):
    text = bulk(*HEAD, *CARDS["S"][0], mesh=MESH)
    stiff = rom.YoungsModulus("property_1", 0.5, 2.0)
    family = rom.reduce_parametric(
        model_of(text, tmp_path),
        parameters={"E": stiff},
        method=rom.CraigBampton(20),
        interfaces={"RBE2 7": "rbe2", "RBE2 8": "rbe2"},
    )
    other = model_of(text.replace("2.1+11", "4.2+11"), tmp_path)
    expected = rom.modes(other, 10).omega[6:]
    assert_allclose(family.at(E=2.0).omega[:4], expected, rtol=1e-3)


def test_the_command_line_lists_springs(tmp_path, capsys):
    (tmp_path / "a.bdf").write_text(GOOD)
    assert answer(capsys, "mesh", tmp_path / "a.bdf", "--units", "SI")["springs"] == ["CBUSH 50"]
