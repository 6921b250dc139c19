"""Bodies of large deflection: the energy of shapes, their derivatives, and beams that bend far."""

import tracemalloc
from dataclasses import replace
from itertools import cycle
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation
from scipy.special import ellipk

import rom
from cases.long import COARSE, SHARED_BY, few
from cases.mbs.slender import STEEL, TIMBER, Full, assembled, cantilever, reduced, slender, tip_of
from cases.paths import RANKS
from cases.ranks.environment import written_on_each
from cases.refusals import refuses
from rom.body.nonlinear.full import rows_of
from rom.body.nonlinear.geometric import ELLIPTIC_STRETCH, Section, foreseen
from rom.body.nonlinear.quartic import Quartic, position
from rom.body.nonlinear.ranges import Load, nodal_forces
from rom.body.nonlinear.statics import follow
from rom.checks.deflection import DISPLACEMENT_RTOL as ALLOWED
from rom.checks.deflection import STEP_SHARES, Step, compare_deflections, load_cases
from rom.checks.draft import Draft
from rom.eigen.verbs import rigid_motions
from rom.errors import ConfigError, InterfaceError, ModelError, ResourceError, RomWarning

pytestmark = COARSE
# dead transverse load at the tip of an inextensible cantilever: P L^2 / EI, slope, shortening and
# deflection over L, integrals of the elastica found by quadrature
ELASTICA = np.array([
    [0.25, 0.124292, 0.004118, 0.082746],
    [0.5, 0.244534, 0.015919, 0.162144],
    [1.0, 0.461352, 0.056433, 0.301721],
    [2.0, 0.781750, 0.160642, 0.493457],
    [5.0, 1.215368, 0.387628, 0.713792],
])  # fmt: skip


def energy_of(model, E):
    r = E.shape[1]
    return Quartic.from_gram(model.stresses.large_strain().gram(E), r)


@pytest.mark.parametrize(
    "kind, degree, material",
    [("hexahedron", 2, STEEL), ("tetrahedron", 2, TIMBER), ("tetrahedron", 1, STEEL)],
)
def test_energy_force_and_tangent_are_those_of_the_finite_elements(kind, degree, material):
    import ufl
    from dolfinx import fem

    from rom.fe.compat import assemble_matrix, assembled_vector, compiled
    from rom.fe.forms.material import stress

    model = assembled(kind=kind, degree=degree, distorted=True, cells=(2, 1, 2), material=material)
    V, numbers = model.stresses.V, model.stresses.numbers
    rng = np.random.default_rng(1)
    E, q = 0.1 * rng.standard_normal((model.n_dofs, 4)), rng.standard_normal(4)
    u = fem.Function(V)
    u.x.array[:] = E @ q
    H = ufl.grad(u)
    strain = ufl.sym(H) + 0.5 * ufl.dot(H.T, H)
    rule = {"quadrature_degree": 4 * degree}
    U = 0.5 * ufl.inner(stress(strain, numbers), strain) * ufl.dx(metadata=rule)
    f = ufl.derivative(U, u)
    K = assemble_matrix(ufl.derivative(f, u))
    found = energy_of(model, E)
    assert_allclose(found.energy(q), fem.assemble_scalar(fem.form(U)), rtol=1e-10)
    force, tangent = E.T @ assembled_vector(compiled(f)), E.T @ (rows_of(K) @ E)
    assert_allclose(found.force(q), force, rtol=0, atol=1e-10 * np.abs(force).max())
    assert_allclose(found.tangent(q), tangent, rtol=0, atol=1e-10 * np.abs(tangent).max())


def test_a_body_that_turns_by_any_angle_inside_its_span_has_no_energy():
    """exp(w) - 1 = sin W + (1 - cos) W^2 is linear in two amplitudes: all orders must cancel."""
    model = assembled()
    axis = np.array([0.36, 0.48, 0.8])
    W = rigid_motions(model.points)[:, 3:] @ axis
    WW = np.cross(axis, W.reshape(-1, 3)).ravel()
    found = energy_of(model, np.column_stack([W, WW]))
    scale = found.energy(np.array([0.0, 1.0]))
    for angle in (0.3, 1.2, 2.9):
        q = np.array([np.sin(angle), 1 - np.cos(angle)])
        assert abs(found.energy(q)) < 1e-13 * scale
        assert np.abs(found.force(q)).max() < 1e-12 * scale
    assert found.energy(np.array([0.3, 0.0])) > 1e-4 * scale  # a linear rotation strains


def test_forces_of_second_order_are_those_of_the_cubic_terms():
    model = assembled(cells=(2, 1, 1))
    E = 0.1 * np.random.default_rng(2).standard_normal((model.n_dofs, 3))
    T3, pairs = energy_of(model, E).by_pairs[0], np.array([[0, 1], [2, 2], [1, 2]])
    F = model.stresses.large_strain().second_forces(E, pairs)
    numbers = {(0, 1): 1, (2, 2): 5, (1, 2): 4}  # of the pairs (0, 0), (0, 1), ..., (2, 2)
    expected = np.array([6 * T3[numbers[i, j]] for i, j in pairs.tolist()]).T
    assert_allclose(E.T @ F, expected, rtol=1e-10, atol=1e-10 * np.abs(expected).max())


def test_energy_force_and_tangent_at_once_are_the_sums_over_all_indices():
    r, rng = 3, np.random.default_rng(3)
    K, T3, T4 = rng.standard_normal((r, r)), np.empty((r,) * 3), np.empty((r,) * 4)
    found = Quartic(K + K.T, rng.standard_normal(10), rng.standard_normal(15))
    for n, T in enumerate((T3, T4)):
        T[:] = (found.cubic, found.quartic)[n][position(np.moveaxis(np.indices(T.shape), 0, -1), r)]
    q = rng.standard_normal(r)
    energy, force, tangent = found.expansion(q)
    T3q, T4qq = T3 @ q, T4 @ q @ q
    assert_allclose(energy, q @ (found.K / 2 + T3q + T4qq) @ q)
    assert_allclose(force, (found.K + 3 * T3q + 4 * T4qq) @ q)
    assert_allclose(tangent, found.K + 6 * T3q + 12 * T4qq)


@pytest.mark.parametrize(
    "slenderness, cells, kinds",
    few(1, [(100, 40, "rbe3"), (50, 20, rom.Polynomial(1)),
            (100, 60, "rbe3"), (100, 40, rom.Polynomial(1))]),
)  # fmt: skip
def test_a_cantilever_follows_the_elastica(slenderness, cells, kinds):
    model, EI = slender(slenderness, cells)
    body = reduced(model, (0, 5 * EI, 0, 0, 0, 0), kinds=kinds, n_shapes=15, n_steps=2)
    assert body.n_modes <= (25 if kinds == "rbe3" else 31)
    loads = np.outer(ELASTICA[:, 0] * EI, body.marker("tip").translation[1])
    for q, (_, *expected) in zip(follow(body.quartic, loads), ELASTICA, strict=True):
        assert_allclose(tip_of(body, q), expected, rtol=2e-3)
    mech, part = cantilever(body)
    mech.force("load", part.marker("tip"), (0, ELASTICA[-1, 0] * EI, 0))
    assert_allclose(slope_of(mech, "beam", "tip"), ELASTICA[-1, 1], rtol=2e-3)


def slope_of(mech, name, marker):
    """Angle about z of a marker in equilibrium [rad]."""
    still = rom.snapshot(mech, rom.equilibrium(mech, steps=4))
    E = still.axes(name, marker)[0]
    return np.arctan2(E[1, 0], E[0, 0])


def test_what_is_welded_to_the_tip_turns_with_it_to_the_end_of_an_arc():
    """A moment on it bends the beam to a circle of the radius EI / M, by 57 degrees at L."""
    model, EI = slender(50, 12)
    body = reduced(model, (0, 0, 0, 0, 0, 3 * EI), n_shapes=18, n_steps=2)
    mech, part = cantilever(body)
    point, centre = part.point(part.marker("tip")), {"c": (0, 0, 0)}
    block = mech.add_rigid("block", mass=1.0, inertia=(1e-3,) * 3, at=point, markers=centre)
    mech.fixed("weld", part.marker("tip"), block.marker("c"))
    for angle in (0.3, 1.0):
        mech.elements.pop("moment", None)
        mech.torque("moment", block.marker("c"), (0, 0, angle * EI))
        assert_allclose(slope_of(mech, "block", "c"), angle, rtol=6e-3)
        still = rom.snapshot(mech, rom.equilibrium(mech, steps=4))
        x, y, _ = still.position("block", "c")[0] - body.marker("root").point
        arc = [1 - np.sin(angle) / angle, (1 - np.cos(angle)) / angle]
        assert_allclose([1 - x, y], arc, rtol=1e-2)


def test_moments_for_which_shapes_are_made_turn_with_their_section():
    """Their work on any motion: each node's force is turned, that of the moment turned back."""
    model, rng = assembled(cells=(2, 1, 1)), np.random.default_rng(0)
    ops, tip = model.operators, model.interfaces["tip"]
    R, X = Rotation.from_rotvec([0, 0.8, 0]).as_matrix(), model.points - tip.origin
    turned = (X @ R.T - X).ravel()
    E = np.column_stack([turned, rng.standard_normal((model.n_dofs, 3))])
    unit = nodal_forces([Load("tip", k) for k in (3, 4, 5)], model, ops, np.zeros(3))
    moments = rng.standard_normal((3, 2))
    found = Section.of(ops, unit, E, moments).difference(np.array([1.0, -2.0]), np.eye(4)[0])
    M = moments @ [1.0, -2.0]
    force = (unit @ (R.T @ M)).reshape(-1, 3) @ R.T - (unit @ M).reshape(-1, 3)
    assert_allclose(found, E.T @ force.ravel(), atol=1e-10)


def test_a_beam_between_immovable_hinges_hardens_as_the_elliptic_integral_says():
    """Half of it, from its middle, which moves across, to a hinge.

    Woinowsky-Krieger, J. Appl. Mech. 17 (1950) 35: one mode, no inertia along the beam,
    omega / omega_0 = pi sqrt(1 + b) / (2 K(m)), b = (a / rho)^2 / 4, m = b / (2 (1 + b)).
    """
    (model, EI), h = slender(50, 12), 1 / 50
    EA, rho = 12 * EI / h**2, h / np.sqrt(12)
    body = reduced(model, (0, 0.1 * EI, 0, 0, 0, 0))
    x, y = body.marker("tip").translation[:2]
    M = body.M - np.outer(body.S[1], y) - np.outer(y, body.S[1]) + body.mass * np.outer(y, y)
    held = replace(body.quartic, K=body.quartic.K + 1e5 * EA * np.outer(x, x))
    lam, V = eigh(held.K, M)
    omega, mode = np.sqrt(lam[0]), V[:, 0] / (y @ V[:, 0])
    assert_allclose(omega, (np.pi / 2) ** 2 * np.sqrt(EI / (7850 * h**2)), rtol=1e-3)
    m = mode @ M @ mode
    forces = m * omega**2 * rho * np.linspace(0.05, 11, 16)
    a = follow(held, np.outer(forces, M @ mode / m)) @ M @ mode / m
    assert a[-1] > 3 * rho
    k1, k3 = np.linalg.lstsq(np.array([a, a**3]).T / forces[:, None], np.ones(16), rcond=None)[0]
    for share in (0.5, 1.0, 1.5, 2.0, 3.0):
        A, b = share * rho, share**2 / 4

        def slowness(angle, A=A):  # dt / d(angle), for a = A sin(angle)
            return np.sqrt(2 * m / (2 * k1 + k3 * A**2 * (1 + np.sin(angle) ** 2)))

        found = np.pi / 2 / quad(slowness, 0, np.pi / 2)[0] / omega
        expected = np.pi * np.sqrt(1 + b) / (2 * ellipk(b / (2 * (1 + b))))
        assert_allclose(found, expected, rtol=1e-3)


@pytest.fixture(scope="module")
def certified():
    model, EI = slender(50, 12, nu=0.3)
    loads = (0, 2 * EI, EI, 0, 0, 0)
    how = {"n_modes": 10, "active": 2, "n_steps": 2, "certify": True}
    return reduced(model, loads, **how), model, loads


def deflections_compared(body, *words):
    of = words or ("tip f",)
    return {r.quantity: r for r in body.certificate.rows if any(w in r.quantity for w in of)}


def test_the_certificate_compares_with_the_full_model_at_large_deflection(certified):
    body, *_ = certified
    assert body.certificate.ok, body.certificate
    rows, cases = deflections_compared(body), body.provenance["large deflection"]
    assert {"tip f_y: displacement", "-tip f_z: frequencies about it"} <= set(rows)
    alone = {f"{sign}tip f_{axis}" for sign in ("", "-") for axis in "yz"}
    assert set(cases) == alone | {"all, the first most", "all, the last most"}
    table = cases["tip f_y"]  # stored with the share up to which it holds
    assert table["share"] == list(STEP_SHARES) and table["holds to"] == 1.0
    load = certified[2][1] * body.marker("tip").translation[1]
    q = follow(body.quartic, np.outer([0.5, 1.0], load))[-1]
    assert_allclose(table["energy"], body.quartic.energy(q), rtol=1e-6)
    assert max(table["displacement"]) <= ALLOWED


def test_a_bent_body_yields_to_a_torque_beside_its_range_as_the_full_model_does(certified):
    """By differences of states; with shapes for the bending alone it is three times too stiff."""
    body, model, loads = certified
    EI, torque = loads[2], 1e-3 * loads[2]
    both, full = [(0, 2 * EI, 0, turn, 0, 0) for turn in (0, torque)], Full(model)
    (q,) = np.diff([body.equilibria({"tip": x})[0] for x in both], axis=0)
    (known,) = np.diff([full.under(x) for x in both], axis=0)
    assert_allclose(body.marker("tip").rotation[0] @ q, known[9], rtol=3e-2)


def test_a_basis_without_derivatives_locks_and_its_certificate_fails(monkeypatch):
    model, EI = slender(50, 6, nu=0.3)
    monkeypatch.setattr("rom.stages.deflection.enriched", lambda bent: bent.basis)
    body = reduced(model, (0, 2 * EI, 0, 0, 0, 0), n_modes=4, certify=True)
    assert not body.certificate.ok
    failed = deflections_compared(body)["tip f_y: displacement"]
    assert not failed.ok and 0.87 < failed.value < 0.95
    assert not deflections_compared(body)["tip f_y: compliance of interfaces about it"].ok
    why = next(r for r in body.certificate.rows if "too few shapes" in r.quantity)
    assert why.quantity.startswith("tip f_y: share of the full deflection")
    assert not why.ok and 0.05 < why.value < 0.13
    assert body.provenance["large deflection"]["tip f_y"]["holds to"] == 0.0


def test_no_load_of_the_certificate_together_with_others_is_one_of_the_shapes():
    """Neither sums nor differences of two: each makes an angle with every load that was borne."""
    for n, spin in ((2, 0.0), (3, 0.0), (1, 2.0), (2, 2.0)):
        geometric = rom.Geometric(loads={"tip": (1.0,) * n + (0,) * (6 - n)}, spin=(0, 0, spin))
        cases = {k: v for k, v in load_cases(geometric).items() if k.startswith("all")}
        assert len(cases) == 2
        cosines = np.abs(geometric.load_cases() @ np.array(list(cases.values())).T)
        assert cosines.max() < 0.93
        assert_allclose([v @ v for v in cases.values()], 1.0)
        first, last = cases.values()
        assert np.all(first[1:] * first[:-1] > 0)
        assert np.all(last[-1] > 0 if spin else last[1:] * last[:-1] < 0)


def test_centrifugal_force_is_a_load_that_is_certified_and_never_pushes():
    """About a point beside the body: the load at each node is its mass times speed^2 x."""
    model, EI = slender(50, 8)
    speed = 8 * np.sqrt(EI / (7850 / 2500))
    body = reduced(model, (0, 0.2 * EI, 0, 0, 0, 0), n_modes=8, active=2, n_steps=2,
                   certify=True, spin=(0, 0, speed), about=(-0.3, 0, 0))  # fmt: skip
    rows = deflections_compared(body, "tip f", "omega")
    assert body.certificate.ok, body.certificate
    assert rows["omega_z^2: displacement"].value < 5e-4
    assert rows["omega_z^2: frequencies about it"].value < 1e-3
    assert not [name for name in rows if "-omega" in name]
    about, w = np.array([0.1, -0.2, 0.3]), np.array([1.0, 2.0, 3.0])
    geometric = rom.Geometric(loads={}, spin=tuple(w))
    loads = geometric.components()
    assert [x.name for x in loads][:2] == ["omega_x^2", "omega_y^2"]
    assert len(geometric.load_cases()) == 3 + 2 * 3 + 3 + 2 * 9 + 4 * 3
    F = nodal_forces(loads, model, model.operators, about).sum(axis=1)
    a = -np.cross(w, np.cross(w, model.points - about))
    assert_allclose(F, model.operators.apply_M(a.reshape(-1, 1))[:, 0], atol=1e-9)


GOOD, FAR, SLACK = Step(1e-3, 1.0, 1e-3), Step(6e-3, 1.0, 1e-3), Step(1e-3, 1.0, 3e-2)
# steps, how many hold, how many are found; what holds again further out does not count
STEPS = [
    ((GOOD, GOOD, GOOD), 3, 3), ((GOOD, GOOD, FAR), 2, 3), ((GOOD, SLACK, GOOD), 1, 3),
    ((FAR, GOOD, GOOD), 0, 3), ((GOOD, GOOD, None), 2, 2), ((GOOD, None, GOOD), 1, 1),
    ((None, GOOD, GOOD), 0, 0),
]  # fmt: skip


@pytest.mark.parametrize("steps, holds, n_found", STEPS)
def test_a_range_holds_to_the_last_step_that_does(certified, monkeypatch, steps, holds, n_found):
    body, model, loads = certified
    geometric = rom.Geometric(loads={"tip": loads})
    W = nodal_forces(geometric.components(), model, model.operators, np.zeros(3))
    E = np.linalg.pinv(W.T) @ np.outer(loads[1:3], [1.0] * 3 + [0.0] * (body.n_modes - 3)) * 1e-3
    after = cycle(steps[: n_found + 1] if n_found < 3 else steps)
    known = SimpleNamespace(whole=np.asarray, state=lambda *given: next(after))  # the full model
    monkeypatch.setattr("rom.body.nonlinear.full.HeldSolid.of", lambda *given, **law: known)
    monkeypatch.setattr("rom.checks.deflection._compared", lambda *given: given[-1][-1])
    draft = Draft(model=model, nonlinear=geometric)
    draft.connection, draft.body, draft.E = None, replace(body, provenance={}), E
    compare_deflections(draft)
    table = draft.body.provenance["large deflection"]
    one, shares = table["-tip f_z"], (0.0, *STEP_SHARES)
    assert one["holds to"] == shares[holds]
    assert one["share"] == list(STEP_SHARES[:n_found])
    assert one["frequencies"] == [step.frequencies for step in steps[:n_found]]
    load = -loads[2] * np.array([1.0] * 3 + [0.0] * (body.n_modes - 3)) * 1e-3
    path = follow(body.quartic, np.outer(STEP_SHARES, load))
    energies = [0.0, *map(body.quartic.energy, path)]
    assert_allclose(one["energy"], energies[holds], rtol=1e-6)
    assert all(r.ok for r in draft.rows) == (holds == 3)


def test_the_range_says_how_far_an_interface_turns_and_who_leaves_it_is_told(certified):
    body, _, loads = certified
    tip = body.marker("tip")
    cases = body.provenance["large deflection"]
    turns = {name: np.degrees(case["turn"]) for name, case in cases.items()}
    (q,) = body.equilibria({"tip": (0, loads[1], 0, 0, 0, 0)})
    assert_allclose(turns["tip f_y"], np.degrees(np.arcsin((tip.rotation @ q)[2])), rtol=2e-2)
    assert 40 < turns["tip f_y"] < 50 and turns["tip f_z"] < 0.7 * turns["tip f_y"]
    row = next(r for r in body.certificate.rows if "turn" in r.quantity)
    assert_allclose(row.value, max(turns.values()))
    with pytest.warns(RomWarning, match=r"leaves the range of its certificate at 1\.04 of these"):
        body.equilibria({"tip": (0, loads[1], 0, 0, 0, 0)}, shares=(1.0, 1.04, 1.4))


def test_a_file_and_other_units_keep_the_energy(certified, tmp_path):
    body, *_ = certified
    assert_allclose(body.quartic.tangent(0 * body.omega), np.diag(body.omega**2), rtol=0, atol=1e-9)
    read = rom.load(rom.save(body, tmp_path / "body.rom.npz"))
    for name, marker in body.markers.items():
        assert_allclose(read.marker(name).covariance, marker.covariance, rtol=0, atol=0)
    q = 1e-3 * np.random.default_rng(0).standard_normal(body.n_modes)
    assert read.quartic.energy(q) == body.quartic.energy(q)
    other, tip = body.in_units("mm-t-s"), body.marker("tip").translation
    same = q * 1e3 * tip[0, 0] / other.marker("tip").translation[0, 0]  # 1 m is 1000 mm
    joule = 1e3  # t mm^2/s^2
    assert_allclose(other.quartic.energy(same), joule * body.quartic.energy(q))
    back = other.in_units("SI").certified_energy
    assert_allclose([other.certified_energy / joule, back], body.certified_energy)
    turned = [b.marker("tip").covariance @ np.r_[1.0, x] for b, x in ((body, q), (other, same))]
    assert_allclose(*turned, atol=1e-12)
    energy = replace(body.quartic, quartic=body.quartic.quartic[1:])
    short = replace(body.marker("tip"), covariance=body.marker("tip").covariance[..., 1:])
    shorter = {"markers": body.markers | {"tip": short}}
    for wrong, says in ((shorter, "of marker 'tip'"), ({"quartic": energy}, "does not fit")):
        file = rom.save(replace(body, **wrong), tmp_path / "cut.rom.npz")
        refuses(rom.errors.FileFormatError, says, rom.load, file)
    old = {name: replace(m, covariance=None) for name, m in body.markers.items()}  # version 1.5
    read = rom.load(rom.save(replace(body, markers=old), tmp_path / "old.rom.npz"))
    assert read.marker("tip").covariance is None


def test_markers_turn_at_first_as_their_linear_rotation_says(certified):
    """The rotation of the covariance is that of the least squares, of which it is the slope."""
    body, *_ = certified
    q = 1e-6 * np.random.default_rng(1).standard_normal(body.n_modes)
    q /= np.abs(body.marker("tip").rotation).max()
    for name in ("root", "tip"):
        marker = body.marker(name)
        U, _, Vt = np.linalg.svd(marker.covariance @ np.r_[1.0, q])
        R = U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt
        turn = [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]
        assert_allclose(np.array(turn) / 2, marker.rotation @ q, rtol=0, atol=1e-11)
    assert np.abs(body.marker("tip").rotation @ q).max() > 1e-7


NOT_TOGETHER = [
    ({"interfaces": {"root": "rbe3", "tip": "rbe2"}}, InterfaceError, "'tip' is rigid"),
    ({"reference": "mean-axis"}, ConfigError, "seen from an interface"),
    ({"method": rom.FreeFree(n_modes=4)}, ConfigError, "this method has not"),
    ({"method": rom.Rubin(n_modes=4)}, ConfigError, "this method has not"),
    ({"method": rom.Herting(n_modes=4)}, ConfigError, "modes with the interfaces held"),
    ({"method": rom.EnhancedCraigBampton(n_modes=4)}, ConfigError, "with the interfaces held"),
    ({"stiffening": True}, ConfigError, "small deflection"),
    ({"nonlinear": {"hub": (1, 0, 0, 0, 0, 0)}}, InterfaceError, "names 'hub'"),
    ({"nonlinear": {"root": (1, 0, 0, 0, 0, 0)}}, InterfaceError, "names 'root'"),
    ({"modes": 12}, ResourceError, r"more than 80 .* take [\d.]+ GB and about [\d.]+ min"),
]


def test_what_does_not_go_together_is_refused_by_name():
    model, _ = slender(20, 4)
    usual = {"method": rom.CraigBampton(n_modes=12), "reference": "root",
             "interfaces": {"root": "rbe3", "tip": "rbe3"}, "certify": False}  # fmt: skip
    for change, error, says in NOT_TOGETHER:
        how = usual | change
        loads = how.pop("nonlinear", {"tip": (0, 1.0, 0, 0, 0, 0)})
        range_ = rom.Geometric(loads=loads, n_modes=how.pop("modes", 2))
        refuses(error, says, rom.reduce, model, nonlinear=range_, **how)


def test_ranges_that_are_none_or_out_of_all_proportion_are_refused():
    usual, one = {"loads": {"tip": (0, 1.0, 0, 0, 0, 0)}}, {"n_modes": 1, "active": 0, "n_steps": 1}
    spun = {"loads": {}, "spin": (0, 0, 1), "about": (0, 0)}
    loads = ({"tip": x} for x in ((1, 2, 3), (0,) * 6, (0, np.nan, 0, 0, 0, 0)))
    for wrong in ({"loads": {}}, {"about": (0, 0, 1)}, spun, *({"loads": x} for x in loads)):
        refuses(ConfigError, None, rom.Geometric, **usual | wrong)
    far = ((0, 1e140, 0, 0, 0, 0), 0), ((0, 0, 0, 1e20, 0, 0), 0), ((1, 0, 0, 0, 0, 0), 1e60)
    said = "no stable equilibrium|compresses the material"
    for load, spin in far:
        refuses(ModelError, said, reduced, slender(20, 3)[0], load, spin=(0, 0, spin), **one)


def test_a_range_in_which_the_body_buckles_or_its_material_gives_way_is_refused():
    """Euler's load of a cantilever is pi^2 / 4 EI / L^2."""
    model, EI = slender(20, 4)
    said, load = r"load \[-1.0\] of the range: no stable", (3 * EI, 0, 0, 0, 0, 0)
    refuses(ModelError, said, reduced, model, load, n_modes=2, active=2)
    assert reduced(model, (2 * EI, 0, 0, 0, 0, 0), n_modes=2, active=2).quartic is not None
    model, EI = slender(2, 2)
    says = r"load [+-]1 tip m_z of the range compresses the material to 0\.\d{3} .* from 0\.577 on"
    refuses(ModelError, says, reduced, model, (0, 0, 0, 0, 0, 3 * EI), n_modes=2, active=2)
    assert reduced(model, (0, 0, 0, 0, 0, EI), n_modes=2, active=2).quartic is not None


def test_a_layer_gives_way_at_the_stretch_that_is_refused():
    """Uniaxial strain, for any Poisson's ratio: the force F^3 - F has its extremum at 1/sqrt(3)."""
    model = assembled(distorted=True)
    pressed = np.zeros((model.n_dofs, 1))
    pressed[::3, 0] = model.points[:, 0]
    found = energy_of(model, pressed)
    at = np.array([ELLIPTIC_STRETCH - 1])
    scale = found.K[0, 0]
    assert abs(found.tangent(at)[0, 0]) < 1e-12 * scale
    assert found.tangent(at - 0.01)[0, 0] < 0 < found.tangent(at + 0.01)[0, 0]


def test_the_least_stretch_is_that_of_a_turned_body_too():
    model = assembled(distorted=True)
    R = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix()
    stretches = ([1.2, 0.6, 1.1], [1.0, 1.3, 1.5], [0.45, 1.0, 1.0])
    gradients = [R @ np.diag(s) @ R.T @ R - np.eye(3) for s in stretches]
    U = np.array([(model.points @ H.T).ravel() for H in gradients]).T
    assert_allclose(model.stresses.large_strain().least_stretch(U), [0.6, 1.0, 0.45])


def test_memory_for_tensors_is_foreseen():
    r = 40
    N = r + r * (r + 1) // 2
    G = np.ones((N, N))
    tracemalloc.start()
    assert Quartic.from_gram(G, r).by_pairs
    peak = tracemalloc.get_traced_memory()[1] + G.nbytes
    tracemalloc.stop()
    memory, time = foreseen(r, 1000)
    assert 0.7 < peak / memory < 1.4
    assert_allclose(time, 6 * 1000 * 860.0**2 / 1e10)


def test_a_body_of_large_deflection_keeps_its_frame_and_its_programs(certified, tmp_path):
    body, *_ = certified
    refuses(ModelError, "'root' for good", body.with_reference, "mean-axis")
    refuses(ConfigError, "'beam' has the energy", rom.Assembly, {"beam": body}, ())
    refuses(ConfigError, "large deflection", rom.export, body, tmp_path / "beam.SID_FEM")


@pytest.mark.mpi
@pytest.mark.long
def test_energy_and_body_are_the_same_on_any_number_of_processes(tmp_path):
    script = RANKS / "large_strain_under_mpi.py"
    found = written_on_each((1, *SHARED_BY), tmp_path, script, timeout=300)
    for n in SHARED_BY:
        assert found[1]["errors"].shape == (2, 2, 3)  # displacement and frequencies at three steps
        assert_allclose(found[n]["errors"], found[1]["errors"], rtol=0, atol=1e-8)
        exact = [(name, 1e-12) for name in ("G", "F", "resisted", "least", "unresolved")]
        for name, rtol in (*exact, ("tip", 1e-9), ("stress", 1e-8)):
            one, other = found[1][name], found[n][name]
            assert_allclose(other, one, rtol=0, atol=rtol * np.abs(one).max(), err_msg=name)


@pytest.mark.parametrize(
    "kind, slenderness, cells, coarse",
    few(2, [("hexahedron", 100, 20, True), ("tetrahedron", 50, 24, False),
            ("hexahedron", 100, 30, False), ("tetrahedron", 100, 16, True),
            ("hexahedron", 50, 12, True), ("hexahedron", 50, 24, False)]),
)  # fmt: skip
def test_meshes_follow_the_elastica_or_are_told_to_be_too_coarse(kind, slenderness, cells, coarse):
    """To 70 degrees by 25 coordinates; what a mesh adds to the energy is what its error comes from.

    A cell that turns by a is strained by a^2 (x^2 / l^2 - 1 / 12) / 2, though a bent line is not.
    """
    model, EI = slender(slenderness, cells, kind=kind)
    body = reduced(model, (0, 5 * EI, 0, 0, 0, 0), n_shapes=15, n_steps=2, certify=True)
    assert body.n_modes <= 25
    added = next(row for row in body.certificate.rows if "too coarse" in row.quantity)
    (q,) = body.equilibria({"tip": (0, 5 * EI, 0, 0, 0, 0)})
    error = np.abs(tip_of(body, q) / ELASTICA[-1, 1:] - 1).max()
    assert added.ok != coarse
    assert error < 1e-3 + 3 * added.value
    assert (error > 5e-3) if coarse else (error < 3e-3)


def test_strain_that_cells_cannot_help_is_that_of_a_bent_line():
    """Of an arc whose middle line keeps its length at the nodes, and whose sections turn."""
    h, n, k = 0.05, 4, 0.1
    model = assembled((1.0, h, h), (n, 1, 1), material=rom.Material(E=1.0, nu=0.0, rho=1.0))
    x, _, z = model.points.T
    z = z - h / 2
    U = np.column_stack([np.sin(k * x) / k - x - z * np.sin(k * x), 0 * x,
                         (1 - np.cos(k * x)) / k - z * (1 - np.cos(k * x))])  # fmt: skip
    found = model.stresses.large_strain().unresolved(U.reshape(-1, 1))[0]
    assert_allclose(found, (k / n) ** 4 / 720 / (k * h) ** 2 * 12, rtol=2e-2)
