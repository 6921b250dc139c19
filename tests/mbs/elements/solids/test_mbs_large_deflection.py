"""Large deflection: markers with the axes of their surface, bodies with the energy of bars."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import rom
from cases.mbs import tangents
from cases.mbs.mechanisms import prepared, random_body, random_pose, random_state
from cases.mbs.tangents import check_tangents, difference, forces_at, shifted
from cases.mbs.trusses import FREE, MASSES, NODES, START, bar_forces, covariance_of, truss
from cases.refusals import refuses
from rom import rotation
from rom.body.nonlinear.quartic import Quartic, n_entries
from rom.body.nonlinear.statics import follow
from rom.errors import ModelError, RomWarning
from rom.mbs.equations.equations import evaluate, linearize_constraints
from rom.mbs.kernels.algebra import row
from rom.mbs.kernels.markers import nearest_rotation


def fitted(body, rng, flat=True):
    """The same body, its markers fitted to surfaces of random motion; they turn by about a rad."""
    for name, marker in body.markers.items():
        X = rng.normal(size=(9, 3)) * ([1, 0.7, 0] if flat else [1, 0.7, 1.2])
        X = X @ Rotation.random(random_state=3).as_matrix()
        found = covariance_of(X, 4 * rng.normal(size=(9, 3, body.n_modes)))
        body.markers[name] = replace(marker, covariance=found)
    return body


@njit
def nearest(B):
    return nearest_rotation(row(B, 0, 0), row(B, 1, 0), row(B, 2, 0))


@pytest.mark.parametrize("rank", [2, 3])
@pytest.mark.parametrize("angle", [1e-9, 0.4, 1.7, 3.1])
def test_the_rotation_is_that_of_the_least_squares(rank, angle):
    """Kabsch's, by singular values: points that turn, stretch, and slide in other ways."""
    rng = np.random.default_rng(2)
    X = rng.normal(size=(12, 3)) * [1.0, 0.6, 0.8 * (rank - 2)]
    R = Rotation.from_rotvec(angle * np.array([0.6, 0.0, 0.8])).as_matrix()
    B = (X + 0.1 * rng.normal(size=X.shape)) @ R.T
    B = B.T @ X
    U, s, Vt = np.linalg.svd(B)
    expected = U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt
    found = np.array(nearest(B))
    assert_allclose(found, expected, atol=1e-13)
    assert_allclose(found @ found.T, np.eye(3), atol=1e-14)
    assert_allclose(found.T @ B, B.T @ found, atol=1e-13 * s[0])


def joined(rng, flat):
    """A body with fitted markers on joints to others, with moments on its markers."""
    mech = rom.Mechanism(gravity=(0.3, -9.0, 2.0))
    one = mech.add_flexible("one", fitted(random_body(rng), rng, flat), **random_pose(rng))
    two = mech.add_flexible("two", random_body(rng, 3), **random_pose(rng))
    rigid = mech.add_rigid("rigid", mass=1.3, inertia=(1.0, 1.2, 1.5), markers={"c": (0.1, 0, 0.3)},
                           **random_pose(rng))  # fmt: skip
    mech.revolute("hinge", one.marker("a"), rigid.marker("c"), axis=(1, 2, 2))
    mech.fixed("weld", two.marker("b"), one.marker("b"))
    mech.torque("twist", one.marker("b"), (2.0, -3.0, 1.5))
    return mech


@pytest.mark.parametrize("flat", [True, False])
def test_motion_of_fitted_markers_is_the_derivative_of_their_place(flat):
    rng = np.random.default_rng(5)
    packed, W = prepared(joined(rng, flat))
    s, (q, v, *_) = packed.system, random_state(rng, packed)
    rows = np.flatnonzero(s.markers.fit >= 0)
    assert rows.size == 2

    def turned(delta):
        evaluate(s, W, shifted(packed, q, delta), v)
        return np.concatenate([W.E[k].ravel() for k in rows])

    def twist(delta):
        evaluate(s, W, shifted(packed, q, delta), v)
        return np.concatenate([W.V[k] for k in rows])

    rate = difference(lambda x: turned(x[0] * v), 1)[:, 0].reshape(-1, 3, 3)
    conv = difference(lambda x: twist(x[0] * v), 1)[:, 0]
    evaluate(s, W, q, v)
    angles = [Rotation.from_matrix(W.A[0].T @ W.E[k]).magnitude() for k in rows]
    assert max(angles) > 0.5
    for k, found in zip(rows, rate, strict=True):
        assert_allclose(W.E[k] @ W.E[k].T, np.eye(3), atol=1e-14)
        spin = found @ W.E[k].T
        assert_allclose([spin[2, 1], spin[0, 2], spin[1, 0]], W.V[k, 3:], atol=1e-7)
    assert_allclose(np.concatenate([W.conv[k] for k in rows]), conv, atol=1e-6)


@pytest.mark.parametrize("flat", [True, False])
def test_constraints_and_tangents_at_fitted_markers_are_exact(flat):
    """Not for small rotations only, as those of other markers are."""
    rng = np.random.default_rng(6)
    packed, W = prepared(joined(rng, flat))
    packed.system.markers.twist[packed.system.markers.fit < 0] *= 1e-4
    s, state = packed.system, random_state(rng, packed)
    q, v, *_ = state
    G, _ = tangents.constraint_derivatives(packed, W, q, v)
    linearize_constraints(s, W, q, v)
    assert_allclose(W.G, G, atol=2e-8 * np.abs(G).max())
    check_tangents(packed, W, state, np.eye(v.size), 1e-6)


@pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")
def test_a_rotor_on_a_marker_that_turns_far_keeps_energy_and_momentum():
    """On a hinge with a spring: they drift if axes, rates and moments are not of one kind."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    part = mech.add_flexible("truss", truss(), omega=(0.4, -1.0, 0.7), q=START)
    middle = part.point(part.marker("mean"))
    solid = {"mass": 0.4, "inertia": (0.03, 0.05, 0.04), "markers": {"c": (0, 0, 0)}}
    rotor = mech.add_rigid("rotor", **solid, at=middle)
    mech.revolute("hinge", part.marker("mean"), rotor.marker("c"), axis=(0, 0, 1))
    mech.rotational_spring("coil", "hinge", stiffness=0.6)
    solution = rom.simulate(mech, t_end=2.0, dt=0.02, method="dop853", assemble=True)
    total, (_, angular) = solution.energy.total, solution.momentum
    assert_allclose(total, total[0], rtol=1e-8)
    assert_allclose(angular, np.tile(angular[0], (len(angular), 1)), atol=1e-8)
    turn = np.einsum("tij,tik->tjk", solution.axes("truss", "mean"), solution.axes("rotor", "c"))
    assert_allclose(turn[:, 2, 2], 1.0, atol=1e-9)
    assert np.ptp(solution.joint("hinge").angle) > 0.1


def test_a_truss_tumbles_as_its_masses_do():
    """Newton's law for the masses in the world knows no frame: strains reach 0.3.

    The implicit integrator loses energy by the square of its step.
    """
    mech, moving = rom.Mechanism(gravity=(0, 0, 0)), {"velocity": (0.3, 0, -0.2), "q": START}
    part = mech.add_flexible("truss", truss(), omega=(0.5, -2.0, 1.5), **moving)
    with warnings.catch_warnings(action="error"):  # deformations beyond a tenth are its purpose
        solution = rom.simulate(mech, t_end=2.0, dt=0.1, method="dop853")
    x0 = NODES.copy()
    for value, place in zip(START, FREE, strict=True):
        x0[place] += value
    v0 = np.array(part.velocity) + np.cross(part.omega, x0)

    def rate(_t, y):
        x, v = y.reshape(2, 4, 3)
        return np.r_[v.ravel(), (bar_forces(x)[0] / MASSES[:, None]).ravel()]

    known = solve_ivp(
        rate, (0.0, 2.0), np.r_[x0.ravel(), v0.ravel()], "DOP853", solution.t, rtol=1e-12,
        atol=1e-12,
    )  # fmt: skip
    for i in range(4):
        found = solution.position("truss", f"n{i}")
        assert_allclose(found, known.y[3 * i : 3 * i + 3].T, atol=1e-8)
    total = solution.energy.total
    assert_allclose(total, total[0], rtol=1e-9)
    assert_allclose(solution.momentum[1], solution.momentum[1][:1].repeat(21, 0), atol=1e-8)
    kinetic = 0.5 * MASSES @ (v0**2).sum(axis=1)
    assert_allclose(total[0], kinetic + bar_forces(x0)[1], rtol=1e-12)
    lost = []
    for dt in (2e-3, 1e-3):
        total = rom.simulate(mech, t_end=2.0, dt=dt, rho_inf=1.0).energy.total
        lost.append(np.abs(total / total[0] - 1).max())
    assert lost[1] < 2e-4 and lost[0] == pytest.approx(4 * lost[1], rel=0.05)


def with_quartic(body, seed):
    rng, r = np.random.default_rng(seed), body.n_modes
    cubic, quartic = (rng.standard_normal(n_entries(r, k)) for k in (3, 4))
    return replace(body, quartic=Quartic(body.K, cubic, quartic))


def test_forces_are_slopes_of_the_energy_and_tangents_those_of_the_forces():
    """Of two bodies of four coordinates with one energy, and one of six, turned in space."""
    rng, mech = np.random.default_rng(4), rom.Mechanism()
    same = with_quartic(random_body(rng), 5)
    for name, body in (("a", same), ("b", with_quartic(random_body(rng, 6), 6)), ("c", same)):
        mech.add_flexible(name, body, **random_pose(rng))
    packed, W = prepared(mech)
    q, v, a, lam = random_state(rng, packed)
    check_tangents(packed, W, (q, v, a, lam), np.eye(v.size), 1e-6)
    at = [int(x) for x in packed.system.bodies.v_at]
    found, linear = forces_at(packed, W, q, 0 * v, lam=lam), rom.Mechanism(gravity=mech.gravity)
    for part in mech.parts.values():
        plain = replace(part.flexible, quartic=None)
        linear.add_flexible(part.name, plain, at=part.at, orientation=part.p)
    other, W2 = prepared(linear)
    found = found - forces_at(other, W2, q, 0 * v, lam=lam)
    slope = tangents.energy_gradient(packed, W, q)
    assert_allclose(found, slope, atol=1e-7 * np.abs(slope).max())
    for name, t in zip(mech.parts, at, strict=True):
        body = mech.parts[name].flexible
        here = q[int(packed.system.bodies.q_at[at.index(t)]) + 7 :][: body.n_modes]
        expected = body.quartic.force(here) - body.K @ here
        assert_allclose(slope[t + 6 : t + 6 + body.n_modes], expected, rtol=1e-5, atol=1e-5)
        assert_allclose(found[t + 6 : t + 6 + body.n_modes], expected, rtol=1e-11, atol=1e-11)


def test_equilibrium_in_a_mechanism_is_that_of_the_body():
    body, force = truss(), np.array([2.0, -3.0, 4.0])
    expected = follow(body.quartic, np.array([force @ body.markers["n3"].translation]))[0]
    A = rotation.matrix(np.array([0.5, 0.5, -0.5, 0.5]))
    mech = rom.Mechanism(gravity=(0, 0, 0))
    part = mech.add_flexible("truss", body, at=(1, 2, 3), orientation=A)
    mech.fixed("held", mech.ground.marker((1, 2, 3)), part.marker("n0"))
    mech.force("pull", part.marker("n3"), A @ force)
    assert_allclose(rom.equilibrium(mech).q[7:], expected, rtol=1e-8)


def test_steady_rotation_stretches_it_as_its_masses_say():
    """Held at the first node and turned: bars bear m omega^2 rho at each of the others."""
    body, speed = truss(), 3.0
    mech = rom.Mechanism(gravity=(0, 0, 0))
    part = mech.add_flexible("truss", body)
    mech.fixed("held", mech.ground.marker((0, 0, 0)), part.marker("n0"))
    q = rom.equilibrium(mech, spin=(0, 0, speed)).q[7:]
    x = NODES.copy()
    for value, place in zip(q, FREE, strict=True):
        x[place] += value
    pull = MASSES[:, None] * speed**2 * x * [1, 1, 0]
    out_of_balance = (bar_forces(x)[0] + pull)[tuple(np.array(FREE).T)]
    assert np.abs(q).max() > 0.05
    assert_allclose(out_of_balance, 0.0, atol=1e-8)


def test_what_would_be_wrong_is_refused_by_name():
    mech = rom.Mechanism()
    refuses(ModelError, "does not spin", mech.add_flexible, "truss", truss(), spin=(0, 0, 3.0))
    with pytest.raises(ModelError, match="counted twice"):
        mech.add_flexible("truss", replace(truss(), K_geo={"n1 f_x": np.eye(6)}))
    with pytest.raises(ModelError, match=r"large deflection.*rom\.linearize"):
        truss().rotating_frequencies(3.0, (0, 0, 1), fixed=("n0",))


def pulled(**bodies):
    """Trusses side by side, each held at its first node, the last of them pulled."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    for k, (name, body) in enumerate(bodies.items()):
        part = mech.add_flexible(name, body, at=(5.0 * k, 0, 0))
        mech.fixed(f"{name} held", mech.ground.marker((5.0 * k, 0, 0)), part.marker("n0"))
    mech.force("pull", part.marker("n3"), (2.0, -3.0, 4.0))
    return mech


def test_a_motion_that_leaves_the_range_of_the_certificate_says_so_with_body_and_time():
    """From rest at a node that is pulled: by its energy, which is that of the bars."""
    body = truss()
    mech = pulled(truss=body)
    free = rom.simulate(mech, t_end=0.2, dt=0.01)
    q = free.elastic("truss")
    energy = body.quartic.energies(q)
    assert_allclose(energy, [body.quartic.energy(x) for x in q], rtol=1e-13)
    assert np.all(np.diff(energy[:16]) > 0)
    for k in (10, 15):
        most = float(energy[k] * (1 - 1e-6))
        table = {"low": {"energy": 0.5 * most}, "n3 f_z": {"energy": most}}
        body.provenance["large deflection"] = table
        says = rf"body 'truss' left the range of its certificate at {free.t[k]:.4g} s"
        with pytest.warns(RomWarning, match=says):
            rows = rom.audit(rom.simulate(mech, t_end=0.2, dt=0.01)).failures
        assert [row.value for row in rows] == [pytest.approx(energy.max() / most)]
    table["n3 f_z"]["energy"] = float(energy.max() * 1.01)
    with warnings.catch_warnings(action="error"):
        rom.simulate(mech, t_end=0.2, dt=0.01)


def test_a_rest_beyond_the_range_of_the_certificate_says_so_with_the_body():
    """Of two bodies, the one that is pulled; its energy is known from its own coordinates."""
    body, still = truss(), truss()
    mech = pulled(still=still, pulled=body)
    energy = float(body.quartic.energy(rom.equilibrium(mech).q[-6:]))
    still.provenance["large deflection"] = {"n3 f_z": {"energy": 1e-9}}
    body.provenance["large deflection"] = {"n3 f_z": {"energy": 0.9 * energy}}
    says = rf"body 'pulled' is beyond the range .* energy is {energy:.3g} J.* {0.9 * energy:.3g} J"
    with pytest.warns(RomWarning, match=says) as said:
        rom.equilibrium(mech)
    assert len(said) == 1
    body.provenance["large deflection"] = {"n3 f_z": {"energy": energy}}
    with warnings.catch_warnings(action="error"):
        rom.equilibrium(mech)


def test_interfaces_that_turn_far_are_told_with_body_and_time():
    body = truss()
    turning = replace(body.markers["n3"], rotation=np.eye(3, 6))
    body = replace(body, markers=body.markers | {"n3": turning})
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_flexible("truss", body, q=2 * START)
    with pytest.warns(RomWarning, match=r"'n3' of body 'truss' turned by more than 0.3 rad .* 0 s"):
        rom.simulate(mech, t_end=0.01, dt=0.01)
