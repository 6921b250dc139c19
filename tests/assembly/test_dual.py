"""Substructures coupled by forces against the whole in one piece; both implementations."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.halves import COUPLED, ROOT
from cases.halves import whole as whole_block
from cases.operators import KINDS
from cases.refusals import refuses
from cases.solid import block
from rom.assembly.dual import free_substructure
from rom.errors import ConfigError, InterfaceError
from rom.reduction.interfaces.connection import connect


def half(side, cells=(5, 2, 2)):
    return block((0.5, 0.1, 0.08), cells, origin=(0.0 if side == "left" else 0.5, 0.0, 0.0))


def joined(n_modes, make=None, inner="full", cells=(5, 2, 2)):
    bodies = {}
    for side in ("left", "right"):
        model = half(side, cells)
        kinds = {"root": "rbe2", "tip": inner} if side == "left" else {"root": inner, "tip": "rbe2"}
        if make is None:
            bodies[side] = rom.substructure(model, n_modes=n_modes, interfaces=kinds)
        else:
            connection = connect(make(model), model, kinds)
            origins = {name: model.interfaces[name].origin for name in kinds}
            bodies[side] = free_substructure(connection, origins, n_modes)
    return rom.DualAssembly(bodies, COUPLED)


def whole(n, fixed=("root",)):
    return whole_block((10, 2, 2), fixed, n)


@pytest.mark.parametrize("make", KINDS)
@pytest.mark.parametrize("kind", ["macneal", "rubin", "dual"])
def test_frequencies_converge_to_the_whole(make, kind):
    exact = whole(8)
    worst = []
    for n_modes in (4, 8, 16):
        found = joined(n_modes, make).frequencies(8, kind=kind, fixed=(ROOT,))
        worst.append(np.abs(found[:6] / exact[:6] - 1).max())
    assert worst[0] > worst[1] > worst[2]
    assert worst[2] < {"macneal": 2e-3, "rubin": 2e-5, "dual": 2e-5}[kind]


def test_rubin_is_an_upper_bound_and_macneal_lies_above_it():
    exact = whole(8)
    assembly = joined(8)
    rubin, macneal = (assembly.frequencies(8, kind=k, fixed=(ROOT,)) for k in ("rubin", "macneal"))
    assert (rubin >= exact * (1 - 1e-9)).all()
    assert (macneal >= rubin * (1 - 1e-12)).all()  # the same stiffness, less mass
    assert np.abs(macneal / exact - 1)[:6].max() > 5 * np.abs(rubin / exact - 1)[:6].max()


@pytest.mark.parametrize("kind", ["macneal", "rubin", "dual"])
def test_a_free_assembly_moves_rigidly(kind):
    found = joined(10).frequencies(12, kind=kind)
    assert np.count_nonzero(found == 0.0) == 6
    assert_allclose(found[6:9], whole(9, fixed=())[6:], rtol=5e-4)


def test_a_dual_assembly_has_as_many_negative_eigenvalues_as_forces_and_those_of_macneal():
    assembly = joined(6)
    n_forces = 3 * 9 + 6  # the cut has nine nodes, the root six coordinates
    lam = assembly.eigenvalues(kind="dual", fixed=(ROOT,))
    assert np.count_nonzero(lam < 0) == n_forces
    assert assembly.frequencies(kind="dual", fixed=(ROOT,)).size == 2 * (6 + 6)
    # without residual mass forces are those of MacNeal
    K, M = assembly.matrices(kind="dual", fixed=(ROOT,))
    n = 2 * (6 + 6)
    condensed = K[:n, :n] - K[:n, n:] @ np.linalg.solve(K[n:, n:], K[n:, :n])
    K_m, M_m = assembly.matrices(kind="macneal", fixed=(ROOT,))
    assert_allclose(condensed, K_m, atol=1e-8 * np.abs(K_m).max())
    assert_allclose(M[:n, :n], M_m, atol=1e-14)


def test_a_certificate_tells_good_from_missing_and_wrong():
    assembly = joined(8)
    report = assembly.certificate
    assert report.ok and report is assembly.certificate  # computed once
    assert {row.quantity.partition(":")[0] for row in report.rows} == {"left", "right", "dual"}
    held = rom.modes(half("left"), 6, fixed=("tip",), interfaces={"root": "rbe2"}).frequencies
    alone = rom.DualAssembly({"left": assembly.bodies["left"]}, ())
    error = alone.frequencies(6, kind="rubin", fixed=(("left", "tip"),)) / held - 1
    found = {row.quantity: row.value for row in report.rows}
    assert_allclose(found["left: tip held: worst error of 6 frequencies"], error.max(), rtol=1e-4)
    left = assembly.bodies["left"]
    unknown, weak = (
        rom.DualAssembly(assembly.bodies | {"left": other}, assembly.couplings).certificate
        for other in (replace(left, certificate=None), replace(left, mass=100 * left.mass))
    )
    assert not unknown.ok
    assert [row.quantity.partition(":")[0] for row in weak.failures] == ["dual"]
    kinds = {"root": "rbe2", "tip": "full"}
    poor = rom.substructure(half("left"), n_modes=1, interfaces=kinds).certificate
    assert not poor.ok and all("worst error" in row.quantity for row in poor.failures)


def test_all_modes_are_the_whole():
    """Nothing is left to the residual: the forces become constraints."""
    n = half("left", (2, 1, 1)).n_dofs - (12 - 6)  # rbe2 replaces the twelve dofs of an end
    assembly = joined(n - 6, cells=(2, 1, 1))
    found = assembly.frequencies(20, kind="rubin", fixed=(ROOT,))
    assert_allclose(found, whole_block((4, 1, 1), n=20), rtol=1e-8)
    refuses(InterfaceError, "find no residual flexibility", assembly.frequencies, kind="dual")


def test_a_slender_beam_of_two_halves_bends_as_euler_and_bernoulli_say():
    """Free: (4.730041)^2 sqrt(E I / (rho A L^4)) for the thin side, from two bodies."""
    from benchmarks.models import bar

    ends = {"root": "full", "tip": "full"}
    left = rom.substructure(bar((0.5, 0.02, 0.01), (8, 1, 1)), n_modes=12, interfaces=ends)
    shifted = {name: x + np.array([0.5, 0.0, 0.0]) for name, x in left.origins.items()}
    bodies = {"left": left, "right": replace(left, origins=shifted)}
    found = rom.DualAssembly(bodies, COUPLED).frequencies(7)
    exact = 4.730041**2 * np.sqrt(210e9 * 0.01**2 / (12 * 7850.0)) / (2 * np.pi)
    assert found[6] == pytest.approx(exact, rel=3e-3)


def test_messages():
    assembly = joined(4)
    refuses(ConfigError, "none of 'macneal', 'rubin', 'dual'", assembly.frequencies, kind="craig")
    refuses(ConfigError, "no body 'middle'", assembly.frequencies, fixed=(("middle", "root"),))
    side = {"fixed": (("left", "side"),)}
    refuses(InterfaceError, "has no interface 'side'", assembly.frequencies, **side)
    for end, says in (("tip", r"27 coordinates and .* has 6"), ("root", "lie 1 m apart")):
        couplings = ((("left", end), ("right", "tip")),)
        refuses(InterfaceError, says, rom.DualAssembly, assembly.bodies, couplings)
