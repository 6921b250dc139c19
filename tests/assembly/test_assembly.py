"""Reduced bodies coupled on interfaces, whatever the meshes there, against the whole."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import identity

import rom
from cases.halves import COUPLED, FULL, ROOT, half, halves, joined, study, whole
from cases.long import few
from cases.measures import surface
from cases.refusals import refuses
from cases.solid import block, reduced
from rom.assembly.coupling import projected_rows
from rom.body.records import Marker, Patch
from rom.eigen.verbs import rigid_motions
from rom.errors import ConfigError, InterfaceError, RomWarning
from rom.model import Interface, Row


@pytest.mark.parametrize("fixed", [(), (ROOT,), (ROOT, ("right", "tip"))])
def test_two_halves_with_all_modes_are_the_whole(fixed):
    names = tuple(interface for _, interface in fixed)
    found = joined("full").frequencies(12, fixed=fixed)
    assert_allclose(found, whole(fixed=names), rtol=1e-8, atol=1e-6)
    assert np.count_nonzero(found == 0.0) == (0 if fixed else 6)


def test_shapes_meet_at_the_cut_and_are_the_same_when_asked_again_whatever_was_done_to_them():
    assembly = joined("polynomial:2", n_modes=10)
    omega, shapes = assembly.modes(8, fixed=(ROOT,))
    left, right = (assembly.bodies[name] for name in ("left", "right"))
    ends = [left.marker("tip").hold @ shapes["left"], right.marker("root").hold @ shapes["right"]]
    assert_allclose(ends[0], ends[1], atol=1e-9 * np.abs(ends[0]).max())
    assert_allclose(left.marker("root").hold @ shapes["left"], 0, atol=1e-9 * np.abs(ends[0]).max())
    omega, shapes = assembly.modes(8)
    before = omega.copy(), shapes["left"].copy()
    omega[:] = shapes["left"][:] = 7.0
    again = assembly.modes(8)
    assert (again.omega == before[0]).all() and (again.shapes["left"] == before[1]).all()
    held = assembly.frequencies(8, fixed=(ROOT,))
    assert (held > 0).all() and (again.omega[:6] == 0).all()


def test_errors_are_one_sided_and_fall_with_the_order_of_the_functions():
    exact = whole()
    steps = np.array([joined(f"polynomial:{p}", n_modes=30).frequencies(12, fixed=(ROOT,))
                      for p in (1, 2, 4)])  # fmt: skip
    assert (steps >= exact * (1 - 1e-9)).all()
    assert (np.diff(steps, axis=0) <= 1e-9 * exact).all()
    assert_allclose(steps[-1], exact, rtol=2e-3)


def test_a_chain_of_four_is_coupled_in_any_order():
    bodies = {}
    for k in range(4):
        model = block(size=(0.25, 0.1, 0.08), cells=(3, 2, 2), origin=(0.25 * k, 0, 0))
        ends = {"root": "full" if k else "rbe2", "tip": "full"}
        bodies[f"part {k}"] = reduced(15, model, interfaces=ends)
    couplings = tuple(((f"part {k}", "tip"), (f"part {k + 1}", "root")) for k in range(3))
    root = (("part 0", "root"),)
    forward = rom.Assembly(bodies, couplings).frequencies(6, fixed=root)
    shuffled = dict(reversed(bodies.items()))
    backward = rom.Assembly(shuffled, couplings[::-1]).frequencies(6, fixed=root)
    assert_allclose(backward, forward, rtol=1e-9)
    model = block(size=(1.0, 0.1, 0.08), cells=(12, 2, 2))
    exact = rom.modes(model, 6, fixed=("root",)).frequencies
    assert_allclose(forward, exact, rtol=1e-3)
    assert (forward >= exact * (1 - 1e-9)).all()


def test_messages_for_couplings_that_cannot_be():
    bodies = {side: half(side, "full") for side in ("left", "right")}
    other = {"right": half("right", "polynomial:1")}
    for error, says, coupling, change in (
        (ConfigError, "no body 'middle'", (("middle", "tip"), ("right", "root")), {}),
        (InterfaceError, "no interface 'top'", (("left", "top"), ("right", "root")), {}),
        (ConfigError, r"ings\[0\] = .* must be a row of 2", ("left", "tip", "right", "root"), {}),
        (InterfaceError, r"full with 27 .* polynomial:1 with 9: they", *COUPLED, other),
        (InterfaceError, "lie 1 m apart", (("left", "root"), ("right", "tip")), {}),
    ):
        refuses(error, says, rom.Assembly, bodies | change, (coupling,))


STUDY = {
    "polynomial:1": (2.31e-2, 2.47e-3),
    "polynomial:2": (2.94e-3, 3.3e-5),
    "polynomial:3": (2.93e-3, 3.4e-6),
    "polynomial:4": (3.00e-4, 3.4e-6),
    "full": (2.98e-4, 9.0e-8),
}


@pytest.mark.fenicsx
@pytest.mark.parametrize("kind", STUDY)
def test_study_of_interface_orders_on_two_blocks(kind):
    bodies, couplings = study(kind)
    assembly = rom.Assembly(bodies, couplings)
    error = assembly.frequencies(10, fixed=(("left", "x0"),)) / FULL - 1
    worst, first = STUDY[kind]
    assert_allclose(error.max(), worst, rtol=5e-3)
    assert_allclose(error[0], first, atol=6e-7, rtol=5e-3)  # digits of the full frequency


def test_certificates_of_an_assembly_and_of_its_few_functions():
    assembly = joined("full", n_modes=12)
    assert not assembly.certificate.ok  # its bodies were reduced without
    good = rom.Report("certificate", (Row("mass", 0.0, "<= 1e-09", True),))
    bodies = {name: replace(body, certificate=good) for name, body in assembly.bodies.items()}
    own = rom.Assembly(bodies, assembly.couplings)
    rows = own.certificate.rows
    assert own.certificate.ok
    assert {line.quantity.partition(":")[0] for line in rows[:-1]} == {"left", "right"}
    assert rows[-1].quantity.startswith("gap of coupled interfaces") and rows[-1].value > 0
    assert assembly.reduced(20).certificate.ok
    (poor,) = assembly.reduced(2, fixed=(ROOT,)).certificate.failures
    assert poor.quantity == "2 interface functions: worst error of 6 frequencies"


@pytest.mark.filterwarnings("ignore:.*fixed-interface modes are kept")
@pytest.mark.parametrize("seed", few(1, range(4)))
def test_enhanced_bodies_are_wrong_in_assemblies_and_that_is_said(seed):
    """Their correction is that of one body. Two or three blocks in a row."""
    rng = np.random.default_rng(seed)
    height, width, step = rng.uniform(0.05, 0.15, 3)
    cells = rng.integers(4, 7, rng.integers(2, 4))
    ends = np.r_[0, np.cumsum(cells)] * step
    parts = [block((n * step, height, width), (n, 2, 2), origin=(x, 0, 0))
             for n, x in zip(cells, ends[:-1], strict=True)]  # fmt: skip
    whole = block((ends[-1], height, width), (cells.sum(), 2, 2))
    full = rom.modes(whole, 9).frequencies[6:]

    def error(method):
        bodies, couplings = {}, []
        for i, part in enumerate(parts):
            touched = (["root"] if i else []) + (["tip"] if i < len(parts) - 1 else [])
            kinds = dict.fromkeys(touched, "full")
            bodies[f"part {i}"] = rom.reduce(part, method=method, interfaces=kinds, certify=False)
            if i:
                couplings.append(((f"part {i - 1}", "tip"), (f"part {i}", "root")))
        row = rom.Assembly(bodies, tuple(couplings))
        return np.abs(row.frequencies()[6:9] / full - 1).max()

    with warnings.catch_warnings():
        warnings.simplefilter("error", RomWarning)
        moments = error(rom.MomentMatching((0.0,), 2))
    with pytest.warns(RomWarning, match=r"part 0.*enhanced .* off by per cents"):
        enhanced = error(rom.EnhancedCraigBampton(8))
    plain = error(rom.CraigBampton(8))
    assert moments < 1e-4 and moments < plain < 5e-3 and 5 * plain < enhanced


COARSE, FINE = (4, 2, 2), (4, 3, 3)


def turned(model, name, order):
    """The model with the nodes of one interface in another order."""
    i = model.interfaces[name]
    S = i.surface_mass.tocsr()[order][:, order]
    i = replace(i, nodes=i.nodes[order], points=i.points[order], surface_mass=S)
    return replace(model, interfaces=model.interfaces | {name: i})


def bare(interface):
    """A full interface whose coordinates are its displacements."""
    n, patch = interface.dofs.size, Patch(interface.points, interface.surface_mass)
    return Marker("s", interface.origin, *np.zeros((2, 3, n)), "full", np.eye(n), patch)


def right_half(model, kind, n_modes=10):
    return reduced(n_modes, model, interfaces={"root": kind, "tip": "rbe2"})


@pytest.mark.parametrize("kind", ["full", "polynomial:2"])
def test_nodes_are_paired_by_position_whatever_their_order(kind):
    expected = joined(kind, n_modes=10).frequencies(12)
    model = block(size=(0.5, 0.1, 0.08), cells=COARSE, origin=(0.5, 0, 0))
    model = turned(model, "root", np.random.default_rng(4).permutation(9))
    i, moved = model.interfaces["root"], 1e-9  # round-off of another mesher
    faces = model.interfaces | {"root": replace(i, points=i.points + moved)}
    right = right_half(replace(model, points=model.points + moved, interfaces=faces), kind)
    bodies = {"left": half("left", kind, n_modes=10), "right": right}
    assert_allclose(rom.Assembly(bodies, COUPLED).frequencies(12), expected, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize(
    ("shape", "order", "n"),
    [("plane", 1, 3), ("plane", 3, 10), ("cylinder", 1, 4), ("cylinder", 3, 16), ("wave", 2, 10)],
)
def test_displacements_of_the_functions_pass_without_error(shape, order, n):
    """Patch test on any two meshes of a surface: up to the order, not beyond."""
    one, other = surface(shape, 300), surface(shape, 200)
    A, B = projected_rows(bare(one), bare(other), rom.Polynomial(order))
    assert A.shape[0] == B.shape[0] == 3 * n
    assert np.linalg.matrix_rank(A) == np.linalg.matrix_rank(B) == 3 * n

    def gap(field):
        a, b = (A @ field(one.points).reshape(-1), B @ field(other.points).reshape(-1))
        return np.abs(a - b).max() / np.abs(a).max()

    centre, rng = one.points.mean(axis=0), np.random.default_rng(5)
    for degree in range(1, order + 1):
        C = rng.normal(size=(3, 3))
        assert gap(lambda x, C=C, d=degree: ((x - centre) @ C / 0.05) ** d) < 1e-10
    for k in range(6):
        assert gap(lambda x, k=k: rigid_motions(x)[:, k]) < 1e-10
    assert gap(lambda x: ((x - centre) @ np.ones((3, 3)) / 0.05) ** (order + 1)) > 1e-3


def faceted(n, turn=0.0):
    """Cylinder of n flat facets around, with nodes in the middle of their edges."""
    angle = turn + 2 * np.pi * np.arange(n) / n
    corner = np.column_stack([np.cos(angle), np.sin(angle)])
    ring = np.vstack([corner, 0.5 * (corner + np.roll(corner, -1, axis=0))])
    x = np.vstack([np.column_stack([ring, np.full(2 * n, z)]) for z in np.linspace(-1, 1, 7)])
    return Interface("ring", np.arange(len(x)), x, identity(len(x), format="csr") / n, np.zeros(3))


@pytest.mark.parametrize("order", [2, 3])
def test_facets_are_not_taken_for_functions(order):
    """On the cylinder they stand for there are (p+1)^2 polynomials; x^2 + y^2 is a constant."""
    one, other = faceted(8), faceted(20, turn=0.1)
    A, B = projected_rows(bare(one), bare(other), rom.Polynomial(order))
    assert A.shape[0] == B.shape[0] == 3 * (order + 1) ** 2
    for k in range(6):
        a, b = (L @ rigid_motions(i.points)[:, k] for L, i in ((A, one), (B, other)))
        assert_allclose(a, b, atol=1e-10 * np.abs(a).max())


def test_equal_coefficients_mean_that_moments_of_the_difference_vanish():
    """On one plane, with exact integrals: (1, y, z) on bilinear faces."""
    one, other = (block(cells=cells).interfaces["root"] for cells in (COARSE, FINE))
    A, B = projected_rows(bare(one), bare(other), rom.Polynomial(1))
    moments = []
    for i in (one, other):
        V = np.column_stack([np.ones(len(i.points)), i.points[:, 1:]])
        moments.append(np.kron(V.T @ i.surface_mass.toarray(), np.eye(3)))
    mix = np.linalg.lstsq(moments[0].T, A.T, rcond=None)[0].T
    assert_allclose(mix @ moments[0], A, atol=1e-12 * np.abs(A).max())
    assert_allclose(mix @ moments[1], B, atol=1e-10 * np.abs(A).max())


def test_moments_tend_from_below_to_coupling_node_by_node(monkeypatch):
    """The same matching meshes, once with, where a projection is none, once without knowing it."""
    bodies = halves("full", n_modes=20)
    projected = rom.Assembly(bodies, COUPLED, projection=rom.Polynomial(1))
    assert projected.n_conditions == rom.Assembly(bodies, COUPLED).n_conditions == (27,)
    exact = rom.Assembly(bodies, COUPLED).frequencies(10, fixed=(ROOT,))
    assert_allclose(projected.frequencies(10, fixed=(ROOT,)), exact, rtol=1e-12)
    monkeypatch.setattr("rom.assembly.coupling._same_nodes", lambda *_: None)
    pairs = [rom.Assembly(bodies, COUPLED, projection=rom.Polynomial(p)) for p in (1, 2, 3, 4)]
    found = np.array([pair.frequencies(10, fixed=(ROOT,)) for pair in pairs])
    assert [pair.n_conditions[0] for pair in pairs] == [9, 18, 24, 27]
    assert (np.diff(found, axis=0) >= -1e-9 * exact).all()
    assert (found[0] < exact * (1 - 1e-4)).any()
    # nine nodes have nine functions: x^i y^j, i, j < 3
    assert_allclose(found[-1], exact, rtol=1e-9)


def test_meshes_that_do_not_match_lie_between_the_matching_ones():
    coarse, fine = whole((8, 2, 2))[:6], whole((8, 3, 3))[:6]
    low, high = np.minimum(coarse, fine), np.maximum(coarse, fine)
    assert (np.abs(fine / coarse - 1) < 0.1).all()
    by_functions = joined("polynomial:2", (COARSE, FINE), n_modes=40)
    found = by_functions.frequencies(6, fixed=(ROOT,))
    assert (found > low).all() and (found < 1.001 * high).all()
    bodies = halves("full", (COARSE, FINE), n_modes=40)
    pairs = [rom.Assembly(bodies, COUPLED, projection=rom.Polynomial(p)) for p in (1, 2, 3, 4, 6)]
    found = np.array([pair.frequencies(6, fixed=(ROOT,)) for pair in pairs])
    # also beyond the degrees that three nodes along a side can tell apart
    assert_allclose(found[2:], found[[1, 1, 1]], rtol=1e-3)
    assert (found > low * 0.999).all() and (found < high * 1.001).all()


def test_meshes_that_do_not_match_move_rigidly_and_are_reduced_like_any_interface():
    bodies = halves("full", (COARSE, FINE), n_modes=20)
    pair = rom.Assembly(bodies, COUPLED, projection=rom.Polynomial(2))
    omega, shapes = pair.modes(7)
    assert (omega[:6] == 0.0).all() and omega[6] > 100.0
    motions = [shapes[name][:, :6] for name in ("left", "right")]
    for name, motion in zip(("left", "right"), motions, strict=True):
        _, K = bodies[name].full_matrices()
        assert np.abs(motion.T @ K @ motion).max() < 1e-9 * omega[6] ** 2
    assert_allclose(motions[0][:6], motions[1][:6], atol=1e-6 * np.abs(motions[0]).max())
    exact = pair.frequencies(10, fixed=(ROOT,))
    for level in ("system", "local"):
        found = [pair.reduced(n, level=level, fixed=(ROOT,)).frequencies(10) for n in (9, 18)]
        assert (found[0] >= exact * (1 - 1e-9)).all()
        assert_allclose(found[1], exact, rtol=1e-9)


def test_functions_of_unequal_surfaces_need_a_projection():
    """Facets of two meshes have other areas: equal coefficients would not be one rigid motion."""
    model = block(size=(0.5, 0.1, 0.08), cells=FINE, origin=(0.5, 0, 0))
    i = model.interfaces["root"]
    wider = replace(i, surface_mass=1.05 * i.surface_mass)
    model = replace(model, interfaces=model.interfaces | {"root": wider})
    bodies = {"left": half("left", "polynomial:2", n_modes=10)}
    bodies["right"] = right_half(model, "polynomial:2")
    said = r"has 9 nodes, .* has 16, .* do not coincide"
    refuses(InterfaceError, said, rom.Assembly, bodies, COUPLED)
    expected = joined("polynomial:2", (COARSE, FINE), n_modes=10).frequencies(8, fixed=(ROOT,))
    pair = rom.Assembly(bodies, COUPLED, projection=rom.Polynomial(2))
    assert_allclose(pair.frequencies(8, fixed=(ROOT,)), expected, rtol=1e-3)


def test_a_saved_body_is_coupled_like_the_one_it_was(tmp_path):
    model = block(size=(0.5, 0.1, 0.08), cells=FINE, origin=(0.5, 0, 0))
    model = turned(model, "root", np.random.default_rng(6).permutation(16))
    for kind in ("full", "polynomial:2"):
        bodies = {"left": half("left", kind, n_modes=10), "right": right_half(model, kind)}
        read = {n: rom.load(rom.save(b, tmp_path / f"{n}.npz")) for n, b in bodies.items()}
        before, after = (b["right"].marker("root").patch for b in (bodies, read))
        assert_allclose(after.surface_mass.toarray(), before.surface_mass.toarray(), rtol=1e-15)
        assert (after.points == before.points).all()
        assert (after.shapes is None) == (kind == "full")
        assert read["left"].marker("root").patch is None
        pairs = [rom.Assembly(b, COUPLED, projection=rom.Polynomial(2)) for b in (bodies, read)]
        assert_allclose(pairs[1].frequencies(9), pairs[0].frequencies(9), rtol=1e-9, atol=1e-6)


def test_messages_for_surfaces_that_do_not_meet():
    bodies = halves("full", (COARSE, FINE), n_modes=4)
    said = "has 9 nodes, .* has 16, and they do not coincide"
    refuses(InterfaceError, said, rom.Assembly, bodies, COUPLED)
    refuses(ConfigError, "projection = 4 gives no", rom.Assembly, bodies, COUPLED, projection=4)
    for size, origin, words in (
        ((0.5, 0.1, 0.08), (0.5, 0.02, 0), r"lie 0\.02 m apart"),
        ((0.5, 0.12, 0.1), (0.5, -0.01, -0.01), r"area of 0\.008, .* of 0\.012: they do not cover"),
    ):
        bodies["right"] = right_half(block(size=size, cells=FINE, origin=origin), "full", 4)
        by = {"projection": rom.Polynomial(2)}
        refuses(InterfaceError, words, rom.Assembly, bodies, COUPLED, **by)


@pytest.mark.long
@pytest.mark.fenicsx
def test_moments_of_quadratic_blocks_converge_to_the_matching_study():
    """Three against two elements, and six against four: never softer with order."""
    bodies, couplings = study("full")
    fixed = (("left", "x0"),)
    matching = rom.Assembly(bodies, couplings).frequencies(10, fixed=fixed)
    fine = bodies | {"right": study("full", (10, 6, 3))[0]["right"]}
    worst = []
    for p in (1, 2, 3, 4, 6):
        pair = rom.Assembly(fine, couplings, projection=rom.Polynomial(p))
        worst.append(np.abs(pair.frequencies(10, fixed=fixed) / matching - 1).max())
    assert worst[0] < 1e-2
    assert (np.diff(worst) <= 1e-4).all()
    assert worst[3] < 2e-3  # the finer mesh itself lowers the frequencies by a thousandth
