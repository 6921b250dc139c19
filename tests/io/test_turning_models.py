"""Structures whose nodes turn, from matrices of other programs: beams and plates as files.

The frame and the plate are assembled in `cases.structures.frames`; what is known of them from
outside is beam theory, Kirchhoff's plate, and the mass of what is drawn.
"""

import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.io import mmwrite
from scipy.sparse import block_diag, csr_matrix, diags

import rom
from cases.files.schema import answer
from cases.refusals import refuses
from cases.structures.frames import Section, cantilever, frame, interface, plate
from rom.eigen.verbs import mean_motion
from rom.errors import FileFormatError, ModelError, QualityGateError
from rom.io.matrices.dmig import write_dmig
from rom.io.matrices.matrix_files import write_abaqus_matrix
from rom.io.matrices.op4 import write_op4
from rom.io.matrices.read_model import read_model

RIGID = {"root": "rbe2", "tip": "rbe2"}
BENT = np.array([[0, 0, 0], [0.3, 0, 0], [0.6, 0.1, 0], [0.6, 0.4, 0.2], [0.5, 0.5, 0.6]])
SIDES = {"root": [11], "tip": [52]}


@pytest.fixture(scope="module")
def angle():
    """A bar that turns round two corners, five nodes."""
    bars = [(k, k + 1) for k in range(4)]
    return frame(BENT, bars, Section(0.03, 0.05), {"root": 0, "tip": 4})


LABELS = np.array([11, 20, 7, 33, 52])


def six_rows(model, axes=None):
    """K and M with six rows for each node, ascending labels, along axes (k, 3, 3) of the nodes."""
    n = len(model.points)
    order = np.concatenate([[*(3 * k + np.arange(3)), *(3 * (n + k) + np.arange(3))]
                            for k in np.argsort(LABELS)])  # fmt: skip
    found = [csr_matrix(A)[order][:, order] for A in (model.K, model.M)]
    if axes is None:
        return found
    Q = block_diag([Q for Q in axes[np.argsort(LABELS)] for _ in range(2)])
    return [csr_matrix(Q.T @ A @ Q) for A in found]


def rows():
    return np.column_stack([np.repeat(np.sort(LABELS), 6), np.tile(np.arange(1, 7), 5)])


def same(one, other, rtol=1e-8):
    """The same reduced body: frequencies in all supports, mass, inertia, and what mixes them."""
    assert_allclose(one.mass, other.mass, rtol=1e-9)
    assert_allclose(one.inertia, other.inertia, rtol=1e-9, atol=1e-9 * other.inertia.max())
    for fixed in ((), ("root",), ("tip",)):
        assert_allclose(one.frequencies(fixed=fixed), other.frequencies(fixed=fixed), rtol=rtol)
    for name in ("Ibar_kl", "S_kl"):  # up to the sign of each shape
        a, b = (np.abs(getattr(body, name)) for body in (one, other))
        assert_allclose(a, b, atol=1e-6 * b.max())


def written(kind, K, M, folder):
    if kind == "op4":
        path = write_op4({"K": K, "M": M}, folder / "a.op4")
        return (path, "K"), (path, "M")
    if kind == "mtx":
        for name, A in (("K", K), ("M", M)):
            mmwrite(str(folder / f"{name}.mtx"), A)
        return folder / "K.mtx", folder / "M.mtx"
    if kind == "dmig":
        path = write_dmig({"K": K, "M": M}, rows(), folder / "a.pch")
        return (path, "K"), (path, "M")
    paths = [write_abaqus_matrix(A, rows(), folder / f"{n}.mtx") for n, A in (("k", K), ("m", M))]
    return tuple(paths)


@pytest.mark.parametrize("kind", ["op4", "mtx", "dmig", "abaqus"])
def test_matrices_of_six_rows_a_node_are_the_model_they_came_from(angle, kind, tmp_path):
    K, M = written(kind, *six_rows(angle), tmp_path)
    model = read_model(K, M, nodes=(LABELS, BENT), interfaces=SIDES)
    assert model.n_dofs == 30 and model.mass() == pytest.approx(angle.mass(), rel=1e-8)
    method = rom.CraigBampton(6)
    found = (rom.reduce(m, method=method, interfaces=RIGID) for m in (model, angle))
    same(*found, rtol=1e-7 if kind == "dmig" else 1e-8)


def test_grid_points_that_move_along_axes_of_their_own(angle, tmp_path):
    """Cylindrical and spherical systems; rows follow the directions at each point."""
    p, q = BENT - [0.1, -0.2, -0.3], BENT - [-0.5, 0.1, 0.3]
    phi, r = np.arctan2(p[:, 2], p[:, 1]), np.linalg.norm(q, axis=1)
    theta, psi = np.arccos(q[:, 2] / r), np.arctan2(q[:, 1], q[:, 0])
    axes = np.tile(np.eye(3), (5, 1, 1))
    for k in (1, 2):  # radial, tangential, along an axis that is x
        c, s = np.cos(phi[k]), np.sin(phi[k])
        axes[k] = [[0, 0, 1], [c, -s, 0], [s, c, 0]]
    for k in (3, 4):  # away from the centre, down from the pole, around it
        c, s, a, b = np.cos(theta[k]), np.sin(theta[k]), np.cos(psi[k]), np.sin(psi[k])
        axes[k] = np.array([[s * a, s * b, c], [c * a, c * b, -s], [-b, a, 0]]).T
    K, M = written("dmig", *six_rows(angle, axes), tmp_path)
    grids = [f"GRID,{n},,{x!r},{y!r},{z!r},{cd}" for n, (x, y, z), cd in
             zip(LABELS.tolist(), BENT.tolist(), ("", 5, 5, 6, 6), strict=True)]  # fmt: skip
    systems = ["CORD2C,5,,.1,-.2,-.3,1.1,-.2,-.3", ",.1,.8,-.3"]
    systems += ["CORD2S,6,,-.5,.1,.3,-.5,.1,1.3", ",.5,.1,.3"]
    (tmp_path / "a.bdf").write_text("\n".join([*systems, *grids, ""]))
    read = [read_model(K, M, nodes=nodes, interfaces=SIDES)
            for nodes in (tmp_path / "a.bdf", (LABELS, BENT, axes))]  # fmt: skip
    for model in read:
        assert_allclose(model.K.toarray(), _sorted(angle).toarray(), atol=1e-8 * abs(angle.K).max())
    refuses(QualityGateError, "a rigid motion meets", read_model, K, M, nodes=(LABELS, BENT),
            interfaces=SIDES)  # fmt: skip
    refuses(FileFormatError, "orthonormal columns", read_model, K, M,
            nodes=(LABELS, BENT, 2 * axes), interfaces=SIDES)  # fmt: skip


def _sorted(model):
    """The stiffness with nodes in the order of their labels."""
    k = np.argsort(LABELS)
    dofs = np.concatenate([(3 * k[:, None] + np.arange(3)).ravel() + 15 * turn for turn in (0, 1)])
    return model.K[dofs][:, dofs]


def test_a_plate_has_the_frequencies_of_kirchhoff(tmp_path, capsys):
    """Simply supported, pi / 2 sqrt(D / rho h) (m^2 / a^2 + n^2 / b^2); normals do not turn."""
    a, b, h = 0.5, 0.4, 2e-3
    model = plate((a, b), h, (16, 14), up=(0.2, -0.4, 1.0))
    K, M, points = model.K, model.M, model.points
    n = len(points)
    order = np.concatenate([[*(3 * k + np.arange(3)), *(3 * (n + k) + np.arange(3))]
                            for k in range(n)])  # fmt: skip
    path = write_op4({"K": K[order][:, order], "M": M[order][:, order]}, tmp_path / "p.op4")
    given = {"nodes": (np.arange(1, n + 1), points),
             "interfaces": {k: i.nodes + 1 for k, i in model.interfaces.items()}}  # fmt: skip
    words = rf"{n} nodes turn about an axis .* \(nodes 1, 2, 3, 4, 5, …\).*Give hold_drilling=True"
    refuses(ModelError, words, read_model, (path, "K"), (path, "M"), **given)
    held = read_model((path, "K"), (path, "M"), hold_drilling=True, **given)
    assert held.n_dofs == 5 * n and held.mass() == pytest.approx(7850 * a * b * h, rel=1e-9)
    rows = [f"{k + 1}, {x!r}, {y!r}, {z!r}" for k, (x, y, z) in enumerate(points.tolist())]
    (tmp_path / "n.csv").write_text("\n".join(rows) + "\n")
    options = (f"{path}:K", "--mass", f"{path}:M", "--nodes", tmp_path / "n.csv", "-n", 7)
    loose = answer(capsys, "modes", *options, "--hold-drilling")["frequencies"]
    assert_allclose(loose[6], rom.modes(held, 7).frequencies[6], rtol=1e-9)
    D = 210e9 * h**3 / 12 / (1 - 0.3**2)
    pairs = np.array([(i, j) for i in range(1, 5) for j in range(1, 5)])
    exact = np.sort(np.pi / 2 * np.sqrt(D / (7850 * h)) * ((pairs / [a, b]) ** 2).sum(axis=1))[:4]
    found = rom.modes(held, 4, fixed={"edge": "xyz"}).frequencies
    assert_allclose(found, exact, rtol=0.01)
    body = rom.reduce(held, method=rom.CraigBampton(f_max=1.5e3),
                      interfaces={"corner": "rbe2", "opposite": "rbe3"})  # fmt: skip
    assert body.certificate.ok, body.certificate
    flat = np.sort(np.linalg.eigvalsh(body.inertia - body.mass * _steiner(body)))
    assert_allclose(flat, body.mass / 12 * np.array([b**2, a**2, a**2 + b**2]), rtol=1e-3)


def _steiner(body):
    c = body.first_moment / body.mass
    return c @ c * np.eye(3) - np.outer(c, c)


def test_units_scale_rotations_as_well(angle, tmp_path):
    """The angle in mm and t: stiffness in N/mm, N and N mm, mass in t, t mm and t mm^2."""
    L = diags(np.r_[np.ones(15), np.full(15, 1e3)])
    K, M = (csr_matrix(L @ A @ L * 1e-3) for A in (angle.K, angle.M))
    written_ = written("op4", *six_rows(replace(angle, K=K, M=M)), tmp_path)
    model = read_model(*written_, nodes=(LABELS, 1e3 * BENT), interfaces=SIDES, units="mm-t-s")
    method = rom.CraigBampton(6)
    same(*(rom.reduce(m, method=method, interfaces=RIGID) for m in (model, angle)))
    refuses(QualityGateError, "a rigid motion meets", read_model, *written_,
            nodes=(LABELS, BENT), interfaces=SIDES)  # fmt: skip


def test_what_no_structure_has_is_named(angle, tmp_path):
    K, M = six_rows(angle)
    keep = np.setdiff1d(np.arange(30), [7])  # y of node 11
    cut = [write_abaqus_matrix(A[keep][:, keep], rows()[keep], tmp_path / f"{n}.mtx")
           for n, A in (("k", K), ("m", M))]  # fmt: skip
    given = {"nodes": (LABELS, BENT), "interfaces": SIDES}
    refuses(ModelError, r"1 nodes do not move along three axes: node 11 has the components "
            r"\[1, 3, 4, 5, 6\]", read_model, *cut, **given)  # fmt: skip
    heavy = M.tolil()
    heavy[0, 0] += 1.0
    one = written("op4", K, csr_matrix(heavy), tmp_path)
    refuses(ModelError, "not the same along x, y and z", read_model, *one, **given)


@pytest.mark.parametrize("offset", [(0.0, 0.0, 0.0), (0.02, 0.01, -0.03)])
def test_a_disk_in_the_mass_is_a_disk_carried_by_its_node(offset):
    """A rigid body inside M, beside its node, has all integrals of one that is attached."""
    beam = cantilever(8, section=Section(0.03, 0.05), axis=(1, 2, 0.5))
    mass, r, n = 5.0, np.array(offset), beam.points.size
    J = np.array([[0.02, 0.003, 0], [0.003, 0.03, 0.003], [0, 0.003, 0.04]])
    R = np.cross(np.eye(3), r)  # of u + theta x r
    block = np.block([[mass * np.eye(3), mass * R.T], [mass * R, J + mass * R @ R.T]])
    d = np.r_[12 + np.arange(3), n + 12 + np.arange(3)]
    dM = csr_matrix((block.ravel(), (np.repeat(d, 6), np.tile(d, 6))), shape=beam.M.shape)
    at = interface("at", np.array([4]), beam.points, beam.rotations)
    carried = rom.Attachment("at", mass, J, beam.points[4] + r)
    models = (
        replace(beam, M=beam.M + dM),
        replace(beam, interfaces=beam.interfaces | {"at": at}, attachments=(carried,)),
    )
    one, other = (rom.reduce(m, method=rom.CraigBampton(8), interfaces=RIGID, certify=False)
                  for m in models)  # fmt: skip
    same(one, other)
    tips = [b.markers["tip"] for b in (one, other)]
    sign = [np.sign([0.9, 0.3, 1.0] @ m.translation + [0.05, 0.2, 0.1] @ m.rotation) for m in tips]
    assert_allclose(one.Ibar_kl * sign[0], other.Ibar_kl * sign[1], atol=1e-9)
    twos = (b.S_kl * s[:, None] * s for b, s in zip((one, other), sign, strict=True))
    assert_allclose(*twos, atol=1e-9)


def test_rotations_without_inertia_are_condensed():
    """Lumped masses: Euler and Bernoulli's cantilever, whose 200 elements are close."""
    beam = cantilever(200, section=Section(0.03, 0.05))
    x = np.ones(201)
    x[[0, -1]] = 0.5
    masses, twist = beam.mass() / 200 * np.repeat(x, 3), np.zeros((201, 3))
    twist[:, 0] = 1e-6 * x  # a bar that could twist without inertia would be infinitely fast
    lumped = replace(beam, M=csr_matrix(diags(np.r_[masses, twist.ravel()])))
    found = rom.modes(lumped, 8, fixed=("root",)).frequencies
    stiff = np.sqrt(210e9 / 7850 / 12)
    roots = np.array([1.8751041, 4.6940911, 7.8547574]) ** 2 / (2 * np.pi)
    exact = np.sort(np.concatenate([roots * stiff * h for h in (0.03, 0.05)]))
    assert_allclose(found[:3], exact[:3], rtol=5e-3)
    small = replace(lumped, **{k: getattr(cantilever(20, section=Section(0.03, 0.05)), k)
                               for k in ("K", "points", "rotations", "interfaces")},
                    M=csr_matrix(diags(np.r_[_tenth(masses), _tenth(twist.ravel())])))  # fmt: skip
    body = rom.reduce(small, interfaces=RIGID)
    assert body.certificate.ok, body.certificate
    dense = rom.modes(small, 5, fixed=("root",)).frequencies
    assert_allclose(body.frequencies(5, fixed=("root",)), dense, rtol=1e-3)
    bare = replace(small, M=csr_matrix(diags(np.r_[_tenth(masses), np.zeros(63)])))
    leaning = replace(cantilever(20, section=Section(0.03, 0.05), axis=(1, 2, 0.5)), M=bare.M)
    refuses(ModelError, "'tip rbe2 ry' has stiffness and no mass", rom.reduce, leaning,
            interfaces=RIGID, method=rom.CraigBampton(8))  # fmt: skip
    for how in ({}, {"method": rom.CraigBampton(8)}):
        refuses(ModelError, "has stiffness and no mass", rom.reduce, bare, interfaces=RIGID, **how)


def test_what_does_not_go_with_nodes_that_turn_is_refused_by_name(angle):
    beam = cantilever(4, section=Section(0.03, 0.05))
    lumped = replace(beam, M=csr_matrix(diags(np.r_[np.ones(15), np.zeros(15)])))
    refuses(ModelError, "some motions have no mass", rom.modes, lumped, f_max=500.0,
            fixed=("root",))  # fmt: skip
    for option in ("stress", "stiffening"):
        refuses(rom.ConfigError, "the model has no finite elements", rom.reduce, beam,
                interfaces=RIGID, **{option: True})  # fmt: skip
    refuses(rom.InterfaceError, "functions only displace", rom.reduce, beam,
            interfaces={"root": rom.Polynomial(1)})  # fmt: skip
    refuses(rom.ConfigError, "those of the model turn", rom.CyclicSector.from_model, beam,
            low="root", high="tip")  # fmt: skip


def test_a_wire_beside_a_beam_keeps_its_rotations(tmp_path):
    """However little stiffness they have beside the others: 1e-13 of it here."""
    points, nodes = BENT[:3], [1, 2, 3]
    beam = frame(points, [(0, 1)], Section(0.03, 0.05), {"root": 0})
    wire = frame(points, [(1, 2)], Section(2e-5, 2e-5), {"root": 0})
    order = np.concatenate([[*(3 * k + np.arange(3)), *(9 + 3 * k + np.arange(3))]
                            for k in range(3)])  # fmt: skip
    K, M = ((A + B)[order][:, order] for A, B in ((beam.K, wire.K), (beam.M, wire.M)))
    path = write_op4({"K": K, "M": M}, tmp_path / "w.op4")
    model = read_model((path, "K"), (path, "M"), nodes=(nodes, points), interfaces={"root": [1]})
    assert model.n_dofs == 18


def _tenth(values):
    """Of nodal values (3 k,) every tenth node, with ten times the mass."""
    return 10 * values.reshape(-1, 3)[::10].ravel()


def test_the_mean_motion_of_nodes_on_a_line_weighs_their_rotations():
    """As displacements at their mean distance L: (sum x v + L^2 sum theta) / sum (x^2 + L^2)."""
    beam = cantilever(2, length=0.4)
    line = interface("line", np.arange(3), beam.points, beam.rotations)
    v, theta = np.array([0.3, -0.1, 0.7]), np.array([0.2, 0.5, -0.4])
    u = np.zeros(18)
    u[1:9:3], u[9 + 2 :: 3] = v, theta
    x, L = np.array([-0.2, 0.0, 0.2]), 0.4 / 3
    turn = (x @ v + L**2 * theta.sum()) / (x**2 + L**2).sum()
    assert_allclose(mean_motion(line) @ u, [0, v.mean(), 0, 0, 0, turn], atol=1e-12)
    twist = np.zeros(18)
    twist[9::3] = theta
    assert_allclose(mean_motion(line) @ twist, [0, 0, 0, theta.mean(), 0, 0], atol=1e-12)


def ladder(x, backwards=False):
    """Two rails with rungs at x, its ends the interfaces "root" and "tip"."""
    points = np.array([[at, y, 0.1 * y] for at in x for y in (0.0, 0.2)])
    m = len(points)
    rails = [(k, k + 2) for k in range(m - 2)] + [(k, k + 1) for k in range(0, m, 2)]
    number = np.arange(m)[::-1] if backwards else np.arange(m)
    ends = {"root": number[[0, 1]], "tip": number[[m - 2, m - 1]]}
    return frame(points[number], number[np.array(rails)], Section(0.02, 0.03), ends)


def test_full_interfaces_couple_rotations_too():
    """Two ladders whose nodes are numbered from either end are one that is twice as long.

    Where they meet both have a rung: the whole has two, as thick as the other rungs.
    """
    x = np.linspace(0.0, 0.6, 4)
    whole, rung = ladder(np.linspace(0.0, 1.2, 7)), ladder(x[:1])
    n = whole.points.size
    at = np.r_[18:24, n + 18 : n + 24]
    for name in "KM":
        A = getattr(whole, name).tolil()
        A[np.ix_(at, at)] += getattr(rung, name).toarray()
        whole = replace(whole, **{name: csr_matrix(A)})
    kinds = {"root": "full", "tip": "full"}
    right = ladder(x + 0.6, backwards=True)
    root = right.interfaces["root"]
    root = replace(root, nodes=root.nodes[::-1], points=root.points[::-1],
                   rotations=right.rotations.of(root.nodes[::-1]))  # fmt: skip
    right.interfaces["root"] = root
    low, high = (rom.reduce(m, method=rom.CraigBampton(20), interfaces=kinds, certify=False)
                 for m in (ladder(x), right))  # fmt: skip
    assert low.markers["tip"].kind == "full:2" and low.n_modes == 24 + 20 - 6
    both = rom.Assembly({"low": low, "high": high}, ((("low", "tip"), ("high", "root")),))
    assert both.n_conditions == (12,)
    assert_allclose(both.frequencies(16)[6:], rom.modes(whole, 16).frequencies[6:], rtol=1e-4)
    held = both.frequencies(4, fixed=(("low", "root"),))
    assert_allclose(held, rom.modes(whole, 4, fixed=("root",)).frequencies, rtol=1e-5)
    mm = low.in_units("mm-t-s")
    for rows, columns in ((slice(0, 6), slice(0, 3)), (slice(6, 12), slice(3, 6))):
        own = [body.markers["tip"].hold[rows, columns] for body in (mm, low)]
        assert_allclose(*own, atol=1e-12)  # of unit motions, whatever the unit
    assert_allclose(mm.frequencies(fixed={"root": "xyz rx ry rz"}),
                    low.frequencies(fixed=("root",)), rtol=1e-9)  # fmt: skip


def test_a_body_whose_nodes_turn_is_kept_in_its_file(angle, tmp_path):
    body = rom.reduce(angle, method=rom.CraigBampton(6), interfaces={"root": "full", "tip": "rbe2"},
                      certify=False)  # fmt: skip
    again = rom.load(rom.save(body, tmp_path / "a.rom.npz"))
    assert_allclose(again.markers["root"].hold, body.markers["root"].hold, rtol=0)
    assert_allclose(again.S_kl, body.S_kl, rtol=0)


def us3_deck(points, triangles, h):
    """Flat triangles of six dofs a node, CalculiX's user element US3."""
    nodes = (f"{k},{x:.12g},{y:.12g},{z:.12g}" for k, (x, y, z) in enumerate(points, 1))
    cells = (f"{k},{a + 1},{b + 1},{c + 1}" for k, (a, b, c) in enumerate(triangles, 1))
    return "\n".join([
        "*NODE, NSET=ALL", *nodes, "*USER ELEMENT,TYPE=US3,NODES=3,INTEGRATION POINTS=3,MAXDOF=6",
        "*ELEMENT, TYPE=US3, ELSET=E", *cells, "*MATERIAL, NAME=S", "*ELASTIC", "210e9, 0.3",
        "*DENSITY", "7850", "*USER SECTION, ELSET=E, MATERIAL=S, CONSTANTS=1", f"{h}", "*STEP",
    ])  # fmt: skip


def tube(side, length, around, along):
    """Points and triangles of a square tube along x, closed by no plates."""
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * side / 2
    ring = [c + (d - c) * k / around for c, d in zip(corners, np.roll(corners, -1, 0), strict=True)
            for k in range(around)]  # fmt: skip
    x = np.linspace(0.0, length, along + 1)
    points = np.array([[at, *c] for at in x for c in ring])
    m, cells = len(ring), []
    for i in range(along):
        for k in range(m):
            a, b = i * m + k, i * m + (k + 1) % m
            cells += [(a, a + m, b + m), (a, b + m, b)]
    return points, cells


def strip(size, cells):
    """Points and triangles of a rectangle in the plane of x and y."""
    x, y = (np.linspace(0.0, s, c + 1) for s, c in zip(size, cells, strict=True))
    points, m = np.array([[a, b, 0.0] for a in x for b in y]), cells[1] + 1
    squares = [(i * m + j, (i + 1) * m + j) for i in range(cells[0]) for j in range(cells[1])]
    return points, [t for a, b in squares for t in ((a, b, b + 1), (a, b + 1, a + 1))]


@pytest.mark.skipif(not shutil.which("ccx"), reason="CalculiX is not installed")
@pytest.mark.parametrize("shape", ["plate", "box beam"])
def test_shells_of_calculix_vibrate_as_it_says(shape, tmp_path):
    """Free frequencies by its own search; reduced on its ends, mass and inertia as drawn."""
    h = 2e-3
    points, cells = strip((0.5, 0.2), (12, 5)) if shape == "plate" else tube(0.06, 0.8, 2, 12)
    deck = us3_deck(points, cells, h)
    (tmp_path / "s.inp").write_text(deck + "\n*FREQUENCY, SOLVER=MATRIXSTORAGE\n*END STEP\n")
    (tmp_path / "f.inp").write_text(deck + "\n*FREQUENCY\n16\n*END STEP\n")
    for job in "sf":
        subprocess.run(["ccx", job], cwd=tmp_path, check=True, capture_output=True)
    lines = (tmp_path / "f.dat").read_text().split("E I G E N V A L U E   O U T P U T")[1]
    rows = [line.split() for line in lines.splitlines()]
    exact = np.array([float(row[3]) for row in rows if len(row) == 5 and row[0].isdigit()])[6:]
    ends = {"root": np.flatnonzero(points[:, 0] == 0.0) + 1,
            "tip": np.flatnonzero(points[:, 0] == points[:, 0].max()) + 1}  # fmt: skip
    model = read_model(tmp_path / "s.sti", tmp_path / "s.mas", nodes=tmp_path / "s.inp",
                       interfaces=ends)  # fmt: skip
    assert_allclose(rom.modes(model, 16).frequencies[6:], exact, rtol=1e-6)
    area = 0.5 * 0.2 if shape == "plate" else 4 * 0.06 * 0.8
    body = rom.reduce(model, interfaces={"root": "rbe2", "tip": "rbe3"})
    assert body.mass == pytest.approx(7850 * h * area, rel=1e-6)
    assert body.certificate.ok, body.certificate
    R = model.rigid_motions()
    assert_allclose(body.inertia, (R.T @ model.M @ R)[3:, 3:], rtol=1e-9, atol=1e-12)
    kinds = {"root": "rbe2", "tip": "rbe3"}
    every = rom.reduce(model, method=rom.CraigBampton(150), interfaces=kinds, certify=False)
    full = rom.modes(model, 12, interfaces=kinds).frequencies
    assert_allclose(every.frequencies(12)[6:], full[6:], rtol=1e-6)
