"""Ways to solve: each gives the frequencies of the direct factor, and says when it cannot."""

import pytest

import rom
from cases.long import ROM_LONG
from cases.refusals import refuses
from cases.solid import KINDS, STEEL, reduced
from rom.errors import ConfigError, InterfaceError, SolverError
from rom.reduction.full_model import operators

pytestmark = pytest.mark.fenicsx
SOLVERS = ["low-rank", "out-of-core", "iterative", *["low-rank:1e-3"] * ROM_LONG]
BEAM = {"L": 1.0, "b": 0.2, "h": 0.1, "lc": 0.045}


def beam(solver):
    return rom.fe.model("meshes/beam.geo", material=STEEL, parameters=BEAM, solver=solver)


@pytest.fixture(scope="module")
def direct():
    return beam("direct")


@pytest.mark.long
@pytest.mark.parametrize("solver", SOLVERS)
def test_every_solver_gives_the_frequencies_of_the_direct_one(direct, solver):
    model = beam(solver)
    expected, found = (reduced(8, m).frequencies()[6:] for m in (direct, model))
    assert found == pytest.approx(expected, rel=1e-8)
    for fixed in ((), ("root",)):
        expected, found = (rom.modes(m, 10, fixed=fixed) for m in (direct, model))
        elastic = expected.omega > 0.0
        assert elastic.sum() == (10 if fixed else 4)
        assert found.omega[~elastic] == pytest.approx(0.0, abs=0.0)
        assert found.omega[elastic] == pytest.approx(expected.omega[elastic], rel=1e-8)


def test_iteration_refuses_a_body_that_can_move_and_says_when_it_fails(direct, monkeypatch):
    from rom.fe.operators.iterative import gradients

    model, one = beam("iterative"), direct.interfaces["root"].dofs[:3]
    refuses(InterfaceError, "leave a rigid motion free", operators(model).hold, one)
    monkeypatch.setattr(gradients, "MAX_ITERATIONS", 3)
    refuses(SolverError, "1 of 1 static solutions did not converge in 3", reduced, 8, model)


def test_an_unknown_solver_is_named():
    for name in ("fast", "low-rank:0", "low-rank:x", "low-rank+low-rank", "iterative+out-of-core"):
        refuses(ConfigError, "solver = ", beam, name)


@pytest.mark.long
def test_the_certificate_estimates_what_it_cannot_afford(direct):
    models = (direct, beam("iterative"))
    bodies = (rom.reduce(m, method=rom.CraigBampton(18), interfaces=KINDS) for m in models)
    known, estimated = ({r.quantity: r for r in b.certificate.rows} for b in bodies)
    assert not any("worst error" in quantity for quantity in estimated)
    assert estimated["dofs; full modes are too dear, errors estimated"].value == direct.n_dofs
    for support in ("free", "root held", "tip held"):
        name = f"{support}: estimated error of 6 frequencies"
        assert estimated[name].value == pytest.approx(known[name].value, rel=1e-6)
        truth = known[f"{support}: worst error of 6 frequencies"].value
        assert estimated[name].value == pytest.approx(truth, rel=0.1)


def test_modes_take_one_factor_and_one_to_count(direct):
    from petsc4py import PETSc

    PETSc.Log.begin()
    numeric = PETSc.Log.Event("MatCholFctrNum")
    before = numeric.getPerfInfo()["count"]
    rom.modes(direct, 10)
    assert numeric.getPerfInfo()["count"] - before == 2
