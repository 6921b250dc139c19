"""Bodies whose energy is a quartic in a mechanism: bars of quadratic strain."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

import rom
from cases.mbs.mechanisms import (
    prepared,
    random_body,
    random_pose,
    random_state,
)
from cases.mbs.tangents import check_tangents, energy_gradient, forces_at
from cases.mbs.trusses import FREE, MASSES, NODES, START, bar_forces, truss
from rom import rotation
from rom.body.nonlinear.quartic import Quartic, n_entries
from rom.body.nonlinear.statics import follow
from rom.errors import ModelError, RomWarning


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
    at = [int(x) for x in packed.system.bodies.v_at]
    found, linear = forces_at(packed, W, q, 0 * v, lam=lam), rom.Mechanism(gravity=mech.gravity)
    for part in mech.parts.values():
        plain = replace(part.flexible, quartic=None)
        linear.add_flexible(part.name, plain, at=part.at, orientation=part.p)
    other, W2 = prepared(linear)
    found = found - forces_at(other, W2, q, 0 * v, lam=lam)
    slope = energy_gradient(packed, W, q)
    assert_allclose(found, slope, atol=1e-7 * np.abs(slope).max())
    for name, t in zip(mech.parts, at, strict=True):
        body = mech.parts[name].flexible
        here = q[int(packed.system.bodies.q_at[at.index(t)]) + 7 :][: body.n_modes]
        expected = body.quartic.force(here) - body.K @ here
        assert_allclose(slope[t + 6 : t + 6 + body.n_modes], expected, rtol=1e-5, atol=1e-5)
        assert_allclose(found[t + 6 : t + 6 + body.n_modes], expected, rtol=1e-11, atol=1e-11)


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
    with pytest.raises(ModelError, match=r"large deflection.*rom\.linearize"):
        truss().rotating_frequencies(3.0, (0, 0, 1), fixed=("n0",))


def test_a_motion_that_leaves_the_range_of_the_certificate_says_so_with_body_and_time():
    """From rest at a node that is pulled: by its energy, which is that of the bars."""
    body = truss()
    mech = rom.Mechanism(gravity=(0, 0, 0))
    part = mech.add_flexible("truss", body)
    mech.fixed("held", mech.ground.marker((0, 0, 0)), part.marker("n0"))
    mech.force("pull", part.marker("n3"), (2.0, -3.0, 4.0))
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
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        rom.simulate(mech, t_end=0.2, dt=0.01)


def test_a_rest_beyond_the_range_of_the_certificate_says_so_with_the_body():
    """Of two bodies, the one that is pulled; its energy is known from its own coordinates."""
    body, still = truss(), truss()
    mech = rom.Mechanism(gravity=(0, 0, 0))
    for name, one, x in (("still", still, 0.0), ("pulled", body, 5.0)):
        part = mech.add_flexible(name, one, at=(x, 0, 0))
        mech.fixed(f"{name} held", mech.ground.marker((x, 0, 0)), part.marker("n0"))
    mech.force("pull", part.marker("n3"), (2.0, -3.0, 4.0))
    energy = float(body.quartic.energy(rom.equilibrium(mech).q[-6:]))
    still.provenance["large deflection"] = {"n3 f_z": {"energy": 1e-9}}
    body.provenance["large deflection"] = {"n3 f_z": {"energy": 0.9 * energy}}
    says = rf"body 'pulled' is beyond the range .* energy is {energy:.3g} J.* {0.9 * energy:.3g} J"
    with pytest.warns(RomWarning, match=says) as said:
        rom.equilibrium(mech)
    assert len(said) == 1
    body.provenance["large deflection"] = {"n3 f_z": {"energy": energy}}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        rom.equilibrium(mech)


def test_interfaces_that_turn_far_are_told_with_body_and_time():
    body = truss()
    turning = replace(body.markers["n3"], rotation=np.eye(3, 6))
    body = replace(body, markers=body.markers | {"n3": turning})
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_flexible("truss", body, q=2 * START)
    with pytest.warns(RomWarning, match=r"'n3' of body 'truss' turned by more than 0.3 rad .* 0 s"):
        rom.simulate(mech, t_end=0.01, dt=0.01)
