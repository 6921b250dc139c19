"""Bodies whose energy is a quartic in a mechanism: bars of quadratic strain."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

import rom
from cases.mbs.mechanisms import (
    nodal_body,
    prepared,
    random_body,
    random_pose,
    random_state,
    residual_at,
    stored_at,
)
from cases.mbs.tangents import check_tangents, difference, shifted
from rom import rotation
from rom.body.nonlinear.quartic import Quartic, n_entries
from rom.body.nonlinear.statics import follow
from rom.errors import ModelError, RomWarning

# four masses and six bars; seen from the first, the second moves on a line, the third in a plane
NODES = np.array([[0.0, 0, 0], [1.0, 0, 0], [0.3, 0.9, 0], [0.4, 0.3, 1.1]])
MASSES = np.array([0.7, 0.4, 0.5, 0.3])
BARS = [(0, 1, 40.0), (0, 2, 25.0), (0, 3, 60.0), (1, 2, 30.0), (1, 3, 20.0), (2, 3, 45.0)]
FREE = [(1, 0), (2, 0), (2, 1), (3, 0), (3, 1), (3, 2)]  # (node, axis) of the coordinates
START = np.array([0.15, -0.1, 0.2, 0.1, -0.2, 0.25])


def truss(**options):
    """Its elastic coordinates carry any deformation, so that nothing is approximate."""
    shapes = np.zeros((len(FREE), *NODES.shape))
    for k, place in enumerate(FREE):
        shapes[(k, *place)] = 1.0
    r, G = len(FREE), 0.0
    j, k = np.triu_indices(r)
    for a, b, stiffness in BARS:
        bar = NODES[b] - NODES[a]
        D, length = (shapes[:, b] - shapes[:, a]).T, np.linalg.norm(bar)
        Z = np.r_[bar @ D, (D.T @ D)[j, k]] / length
        G = G + stiffness * np.outer(Z, Z)
    energy = Quartic.from_gram(G, r)
    places = {f"n{i}": (x, shapes[:, i].T, np.zeros((3, r))) for i, x in enumerate(NODES)}
    body = nodal_body(NODES, np.diag(MASSES), shapes, energy.K, markers=places, **options)
    return replace(body, quartic=energy)


def bar_forces(x):
    """(4, 3) forces of the bars on the masses at x, and their energy."""
    f, U = np.zeros_like(x), 0.0
    for a, b, stiffness in BARS:
        d, length = x[b] - x[a], np.linalg.norm(NODES[b] - NODES[a])
        strain = (d @ d / length - length) / 2
        f[a] += stiffness * strain * d / length
        f[b] -= stiffness * strain * d / length
        U += stiffness * strain**2 / 2
    return f, U


@pytest.fixture(scope="module")
def tumbling():
    mech = rom.Mechanism(gravity=(0, 0, 0))
    part = mech.add_flexible(
        "truss", truss(), omega=(0.5, -2.0, 1.5), velocity=(0.3, 0, -0.2), q=START
    )
    return mech, part


def test_a_truss_tumbles_as_its_masses_do(tumbling):
    """Newton's law for the masses in the world knows no frame: strains reach 0.3."""
    mech, part = tumbling
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # of deformations beyond a tenth: they are what it is for
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


def test_the_implicit_integrator_loses_energy_by_the_square_of_its_step(tumbling):
    lost = []
    for dt in (2e-3, 1e-3):
        total = rom.simulate(tumbling[0], t_end=2.0, dt=dt, rho_inf=1.0).energy.total
        lost.append(np.abs(total / total[0] - 1).max())
    assert lost[1] < 2e-4 and lost[0] == pytest.approx(4 * lost[1], rel=0.05)


def with_quartic(body, seed):
    rng, r = np.random.default_rng(seed), body.n_modes
    cubic, quartic = (rng.standard_normal(n_entries(r, k)) for k in (3, 4))
    return replace(body, quartic=Quartic(body.K, cubic, quartic))


def several():
    """Two bodies of four coordinates with one energy, and one of six, turned in space."""
    rng, mech = np.random.default_rng(4), rom.Mechanism()
    same = with_quartic(random_body(rng), 5)
    for name, body in (("a", same), ("b", with_quartic(random_body(rng, 6), 6)), ("c", same)):
        mech.add_flexible(name, body, **random_pose(rng))
    return mech, rng


def test_forces_are_slopes_of_the_energy_and_tangents_those_of_the_forces():
    mech, rng = several()
    packed, W = prepared(mech)
    q, v, a, lam = random_state(rng, packed)
    check_tangents(packed, W, (q, v, a, lam), np.eye(v.size), 1e-6)
    none = np.zeros(v.size)
    residual_at(packed.system, W, q, none, none, lam)
    at = [int(x) for x in packed.system.bodies.v_at]
    found, linear = W.residual.copy(), rom.Mechanism(gravity=mech.gravity)
    for part in mech.parts.values():
        plain = replace(part.flexible, quartic=None)
        linear.add_flexible(part.name, plain, at=part.at, orientation=part.p)
    other, W2 = prepared(linear)
    residual_at(other.system, W2, q, none, none, lam)
    slope = difference(
        lambda d: np.array([stored_at(packed.system, W, shifted(packed, q, d), none)]), v.size
    )[0]
    assert_allclose(found - W2.residual, slope, atol=1e-7 * np.abs(slope).max())
    for name, t in zip(mech.parts, at, strict=True):
        body = mech.parts[name].flexible
        here = q[int(packed.system.bodies.q_at[at.index(t)]) + 7 :][: body.n_modes]
        expected = body.quartic.force(here) - body.K @ here
        assert_allclose(slope[t + 6 : t + 6 + body.n_modes], expected, rtol=1e-5, atol=1e-5)
        assert_allclose(
            (found - W2.residual)[t + 6 : t + 6 + body.n_modes], expected, rtol=1e-11, atol=1e-11
        )


def test_equilibrium_in_a_mechanism_is_that_of_the_body():
    """Wherever its frame is put: the first node held, a dead force on the last one."""
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
    with pytest.raises(ModelError, match="does not spin"):
        mech.add_flexible("truss", truss(), spin=(0, 0, 3.0))
    with pytest.raises(ModelError, match="counted twice"):
        mech.add_flexible("truss", replace(truss(), K_geo={"n1 f_x": np.eye(6)}))


def test_interfaces_that_turn_far_are_told_with_body_and_time():
    body = truss()
    turning = replace(body.markers["n3"], rotation=np.eye(3, 6))
    body = replace(body, markers=body.markers | {"n3": turning})
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_flexible("truss", body, q=2 * START)
    with pytest.warns(RomWarning, match=r"'n3' of body 'truss' turned by more than 0.3 rad .* 0 s"):
        rom.simulate(mech, t_end=0.01, dt=0.01)
