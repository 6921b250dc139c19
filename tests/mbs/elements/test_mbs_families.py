"""A family and a law that are in no list of the package take part in everything."""

import os
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.integrate import trapezoid

import rom
from cases.long import few
from cases.mbs.mechanisms import simulate_quietly
from cases.paths import ROOT
from rom.mbs.elements.family import Family, integers, rows_of
from rom.mbs.kernels import constraints, element_calls, tables
from rom.mbs.kernels.algebra import row, sub

K, C, MASS, LENGTH = 200.0, 3.0, 2.0, 0.3


@dataclass(frozen=True)
class Cord:
    """Pulls one marker to another in all directions, with a force proportional to the gap."""

    i: rom.mbs.Marker
    j: rom.mbs.Marker
    stiffness: float
    damping: float


@tables.table
class Cords(tables.Table):
    i: tables.Index1
    j: tables.Index1
    law: tables.Array2


def pack(cords, places):
    return Cords(
        integers(places.marker[c.i] for c in cords.values()),
        integers(places.marker[c.j] for c in cords.values()),
        rows_of(((c.stiffness, c.damping) for c in cords.values()), 2),
    )


@element_calls.residuals.of(Cords)
def cord_wrenches(_s, W, cords, _q, _v, _lam):
    for k in range(cords.i.size):
        i, j = cords.i[k], cords.j[k]
        gap, slide = sub(row(W.P, j, 0), row(W.P, i, 0)), sub(row(W.V, j, 0), row(W.V, i, 0))
        for p in range(3):
            force = cords.law[k, 0] * gap[p] + cords.law[k, 1] * slide[p]
            W.wrench[i, p] += force
            W.wrench[j, p] -= force
            W.power[2] += cords.law[k, 1] * slide[p] ** 2


@element_calls.tangents.of(Cords)
def cord_tangents(s, W, cords, _lam, ck, cc):
    for k in range(cords.i.size):
        i, j = cords.i[k], cords.j[k]
        for c, S in ((ck * cords.law[k, 0], W.Kt), (cc * cords.law[k, 1], W.S)):
            W.Q[:] = 0.0
            for p in range(3):
                e = (1.0 if p == 0 else 0.0, 1.0 if p == 1 else 0.0, 1.0 if p == 2 else 0.0)
                constraints.place_relative(W.Q, 0, p, c, e)
            constraints.pair_stiffness(s, W, i, j, S)


@element_calls.energy.of(Cords)
def cord_energy(_s, W, cords, _q, _v):
    total = 0.0
    for k in range(cords.i.size):
        gap = sub(row(W.P, cords.j[k], 0), row(W.P, cords.i[k], 0))
        total += 0.5 * cords.law[k, 0] * (gap[0] ** 2 + gap[1] ** 2 + gap[2] ** 2)
    return total


FAMILY = Family("cords", Cord, pack, cord_wrenches, cord_tangents, cord_energy)


def cord_law(t, parameters, motion, memory, out):
    """The same as a law of the user."""
    gap = motion.position[1] - motion.position[0]
    slide = motion.velocity[1] - motion.velocity[0]
    force = parameters[0] * gap + parameters[1] * slide
    out.force[0], out.force[1] = force, -force
    out.energy[0] = 0.5 * parameters[0] * np.sum(gap**2)
    out.lost[0] = parameters[1] * np.sum(slide**2)
    out.outputs[0] = np.sqrt(np.sum(force**2))


def add_family(mech, i, j):
    mech.add("cord", Cord(i, j, K, C), FAMILY)


def add_law(mech, i, j, **options):
    mech.law("cord", cord_law, i, j, parameters=(K, C), outputs=("tension",),
             **{"energy": True, "compiled": True} | options)  # fmt: skip


def add_python_law(mech, i, j):
    add_law(mech, i, j, compiled=False)


WAYS = [add_family, add_law, add_python_law]
COMPILED = WAYS[:2]


def bob(add, *, gravity=(0, 0, -9.81), **more):
    """A mass on a cord of no free length: three oscillators."""
    mech = rom.Mechanism(gravity=gravity)
    start = {"mass": MASS, "inertia": (0.1, 0.2, 0.25), "at": (LENGTH, 0, 0)} | more
    part = mech.add_rigid("bob", **start, markers={"c": (0, 0, 0)})
    add(mech, mech.ground.marker((0, 0, 0)), part.marker("c"))
    return mech


def exact(t):
    """Damped oscillation of the height and of the way aside, from rest."""
    w, d = np.sqrt(K / MASS), C / (2 * MASS)
    r = np.sqrt(w * w - d * d)
    swing = np.exp(-d * t) * (np.cos(r * t) + d / r * np.sin(r * t))
    return np.column_stack([LENGTH * swing, 0 * t, -9.81 * MASS / K * (1 - swing)])


@pytest.mark.parametrize("add", WAYS)
@pytest.mark.parametrize("method", ["generalized-alpha", "bdf", "dop853"])
def test_it_moves_as_the_closed_form(add, method):
    sol = simulate_quietly(bob(add), t_end=0.5, dt=1e-3, method=method)
    np.testing.assert_allclose(sol.position("bob"), exact(sol.t), atol=6e-5)


@pytest.mark.parametrize("add", WAYS)
def test_its_energy_and_losses_balance(add):
    sol = simulate_quietly(bob(add), t_end=0.5, dt=5e-4)
    assert rom.audit(sol).ok
    if add in COMPILED:
        x = sol.position("bob")
        np.testing.assert_allclose(sol.energy.strain, 0.5 * K * (x**2).sum(axis=1), rtol=1e-9)
        speed = sol.velocity("bob")
        heat = trapezoid(C * (speed**2).sum(axis=1), sol.t)
        assert sol.energy.damping[-1] == pytest.approx(heat, rel=1e-5)


@pytest.mark.parametrize("add", WAYS)
def test_it_stands_where_it_carries_the_weight_and_swings_with_the_frequency_of_the_mass(add):
    mech = bob(add, at=(0, 0, -0.01))
    mech.prismatic("guide", "ground", "bob.c", axis=(0, 0, 1))
    state = rom.equilibrium(mech)
    np.testing.assert_allclose(state.q[:3], [0, 0, -9.81 * MASS / K], atol=1e-10)
    found = rom.linearize(mech, state)
    np.testing.assert_allclose([found.M, found.C, found.K], [[[1]], [[C / MASS]], [[K / MASS]]],
                               rtol=1e-7)  # fmt: skip


def pair(add):
    mech = rom.Mechanism(gravity=(0, 0, 0))
    bodies = [
        mech.add_rigid(name, mass=m, inertia=(0.1,) * 3, at=at, velocity=v, markers={"c": p})
        for name, m, at, v, p in (("a", 1.0, (0, 0, 0), (0, 1, 0), (0.1, 0, 0)),
                                  ("b", 3.0, (1, 0, 0), (0, -0.5, 0.2), (0, 0.2, 0)))
    ]  # fmt: skip
    add(mech, *(body.marker("c") for body in bodies))
    return mech


@pytest.mark.parametrize("add", WAYS)
def test_between_bodies_it_keeps_the_momentum(add):
    linear, _ = simulate_quietly(pair(add), t_end=0.4, dt=1e-3).momentum
    np.testing.assert_allclose(linear, np.tile(linear[0], (len(linear), 1)), atol=1e-9)


def test_the_audit_counts_on_momentum_where_a_family_says_so():
    for mech, counts in ((pair(add_family), True), (bob(add_family), False)):
        rows = rom.audit(simulate_quietly(mech, t_end=0.1, dt=1e-3)).rows
        assert ("change of linear momentum" in [row.quantity for row in rows]) == counts


@pytest.mark.parametrize("add", COMPILED)
def test_a_wrong_tangent_would_cost_newton_passes(add):
    sol = simulate_quietly(bob(add), t_end=0.2, dt=1e-2)
    assert sol.statistics["iterations"] <= 2.5 * sol.statistics["steps"]


@pytest.mark.once
@pytest.mark.parametrize("name", few(1, ["add_family", "add_law", "add_python_law"]))
def test_it_moves_inside_an_fmu(name, tmp_path, monkeypatch):
    fmpy = pytest.importorskip("fmpy", reason="fmpy is not installed")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), str(ROOT / "tests")]))
    script = tmp_path / "bob.py"
    text = "from test_mbs_families import bob, {0}\ndef mechanism():\n    return bob({0})\n"
    script.write_text(text.format(name))
    archive = rom.write_fmu(script, tmp_path / "bob.fmu", outputs=["bob.c"], dt=1e-3,
                            files=[__file__])  # fmt: skip
    output = [f"bob.c.position[{k}]" for k in (1, 2, 3)]
    found = fmpy.simulate_fmu(str(archive), stop_time=0.1, step_size=1e-2, output_interval=1e-2,
                              fmi_type="CoSimulation", output=output)  # fmt: skip
    place = np.column_stack([found[name] for name in output])
    np.testing.assert_allclose(place, exact(found["time"]), atol=6e-5)
