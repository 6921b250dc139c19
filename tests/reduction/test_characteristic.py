"""Interface functions computed from the constraint modes of an assembly, or of one body."""

import logging

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

import rom
from cases.halves import COUPLED, FULL, ROOT, half, joined, study
from cases.long import few
from cases.refusals import refuses
from cases.solid import block, reduced
from rom.errors import ConfigError, InterfaceError

LEVELS = ("system", "local")
BOTH = {"root": "full", "tip": "full"}


@pytest.fixture(scope="module")
def assembly():
    return joined("full", n_modes=20)


@pytest.mark.parametrize("n", [5, 9, 27])
def test_system_level_functions_are_those_of_the_book(n):
    """By dense matrices of the whole: lowest n constraint modes of the cut, every interior dof."""
    model = block(size=(1.0, 0.1, 0.08), cells=(8, 2, 2))
    x = model.points[:, 0]
    free = np.flatnonzero(np.repeat(x > 1e-9, 3))
    K, M = (A[free][:, free].toarray() for A in (model.K, model.M))
    b = np.flatnonzero(np.isclose(np.repeat(x, 3)[free], 0.5))
    i = np.setdiff1d(np.arange(free.size), b)
    Psi = np.zeros((free.size, b.size))
    Psi[b] = np.eye(b.size)
    Psi[i] = -np.linalg.solve(K[np.ix_(i, i)], K[np.ix_(i, b)])
    _, chi = eigh(Psi.T @ K @ Psi, Psi.T @ M @ Psi)
    T = np.hstack([Psi @ chi[:, :n], np.eye(free.size)[:, i]])
    exact = np.sqrt(eigh(T.T @ K @ T, T.T @ M @ T, eigvals_only=True)[:12]) / (2 * np.pi)
    bodies = {}
    for side, origin in (("left", 0.0), ("right", 0.5)):
        model = block(size=(0.5, 0.1, 0.08), cells=(4, 2, 2), origin=(origin, 0, 0))
        kinds = {"root": "full"} if side == "right" else {"root": "full", "tip": "full"}
        held = sum(model.interfaces[name].dofs.size for name in kinds)
        bodies[side] = reduced(model.n_dofs - held, model, interfaces=kinds)
    condensed = rom.Assembly(bodies, COUPLED).reduced(n, fixed=(ROOT,))
    assert condensed.n_interface == n
    assert_allclose(condensed.frequencies(12), exact, rtol=1e-8)


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("fixed", [(), (ROOT,), (ROOT, ("right", "tip"))])
def test_errors_are_one_sided_and_fall_to_nothing(assembly, level, fixed):
    exact = assembly.frequencies(14, fixed=fixed)
    steps = [assembly.reduced(n, level=level, fixed=fixed) for n in (6, 9, 14, 27)]
    found = np.array([step.frequencies(14) for step in steps])
    assert (found >= exact * (1 - 1e-9)).all()
    assert (np.diff(found, axis=0) <= 1e-9 * exact).all()
    assert (found[0] > exact * (1 + 1e-6)).any()
    assert_allclose(found[-1], exact, rtol=1e-9, atol=1e-6)
    assert (np.count_nonzero(found == 0.0, axis=1) == (0 if fixed else 6)).all()
    sizes = [step.n_interface for step in steps]
    assert sizes[-1] == 27 and sizes == sorted(sizes)
    if level == "system":
        assert sizes[:3] == [6, 9, 14]


@pytest.mark.parametrize("level", LEVELS)
def test_both_sides_move_together_and_supports_hold(assembly, level):
    _, shapes = assembly.reduced(9, level=level, fixed=(ROOT,)).modes(8)
    left, right = (assembly.bodies[name] for name in ("left", "right"))
    ends = [left.marker("tip").hold @ shapes["left"], right.marker("root").hold @ shapes["right"]]
    size = np.abs(ends[0]).max()
    assert_allclose(ends[0], ends[1], atol=1e-9 * size)
    assert_allclose(left.marker("root").hold @ shapes["left"], 0, atol=1e-9 * size)


def test_functions_of_the_whole_come_out_as_its_interface_modes(assembly):
    condensed = assembly.reduced(8, fixed=(ROOT,))
    more = assembly.reduced(20, fixed=(ROOT,)).interface_omega
    assert_allclose(condensed.interface_omega, more[:8], rtol=1e-9)
    # statics between the interfaces instead of all motions: never below the frequencies of all
    assert (more >= 2 * np.pi * assembly.frequencies(20, fixed=(ROOT,)) * (1 - 1e-9)).all()


def test_a_chain_of_three_is_reduced_on_both_cuts():
    shape = {"size": (0.3, 0.1, 0.08), "cells": (3, 2, 2)}
    parts = [block(origin=(0.3 * k, 0, 0), **shape) for k in range(3)]
    bodies = {f"part {k}": reduced(15, part, interfaces=BOTH) for k, part in enumerate(parts)}
    couplings = tuple(((f"part {k}", "tip"), (f"part {k + 1}", "root")) for k in range(2))
    chain = rom.Assembly(bodies, couplings)
    root = (("part 0", "root"),)
    exact = chain.frequencies(6, fixed=root)
    for level, n, size in (("system", 24, 24), ("local", 12, 48)):
        condensed = chain.reduced(n, level=level, fixed=root)
        assert condensed.n_interface <= size
        assert_allclose(condensed.frequencies(6), exact, rtol=2e-3)


def test_a_repeated_frequency_is_kept_whole_and_said_so(caplog):
    """A square section bends alike in two directions."""
    shape = {"size": (0.5, 0.1, 0.1), "cells": (4, 2, 2)}
    bodies = {side: reduced(10, block(origin=(x, 0, 0), **shape), interfaces=BOTH)
              for side, x in (("left", 0.0), ("right", 0.5))}  # fmt: skip
    square = rom.Assembly(bodies, COUPLED)
    with caplog.at_level(logging.INFO, logger="rom"):
        condensed = square.reduced(1, fixed=(ROOT,))
    assert condensed.n_interface == 2
    assert_allclose(*condensed.interface_omega, rtol=1e-6)
    assert "2 functions instead of 1" in caplog.text
    first = condensed.frequencies(2)
    assert_allclose(first[0], first[1], rtol=1e-6)
    caplog.clear()
    square.reduced(2, fixed=(ROOT,))
    assert not caplog.text
    assert square.reduced(3).n_interface == 6  # rigid motions are never cut


def test_messages_for_functions_that_cannot_be(assembly):
    for how in ({"fixed": (ROOT,)}, {"level": "local"}):
        refuses(ConfigError, "n_interface = 28 must .* from 1 to 27", assembly.reduced, 28, **how)
    refuses(ConfigError, "nothing is coupled", rom.Assembly(assembly.bodies, ()).reduced, 6)
    twice = rom.Assembly(assembly.bodies, (*COUPLED, *COUPLED))
    refuses(ConfigError, r"\('left', 'tip'\).* is given twice", twice.reduced, 6, level="local")
    assert_allclose(twice.reduced(9).frequencies(9), assembly.reduced(9).frequencies(9), atol=1e-6)
    refuses(InterfaceError, "no interface 'side'", assembly.reduced, 6, fixed=(("left", "side"),))


# The two blocks of `study`: n asked for, functions found, largest error of ten frequencies.
TABLE = {
    "system": [(6, 6, 3.6e-2), (9, 9, 4.6e-3), (18, 18, 6.8e-4), (30, 30, 3.1e-4)],
    "local": [(6, 12, 9.1e-3), (9, 18, 4.5e-3), (15, 30, 2.8e-3), (24, 48, 8.8e-4)],
}


@pytest.mark.long
@pytest.mark.fenicsx
@pytest.mark.parametrize("level", few(1, LEVELS))
def test_study_of_characteristic_modes_on_two_blocks(level):
    bodies, couplings = study("full")
    assembly = rom.Assembly(bodies, couplings)
    fixed = (("left", "x0"),)
    unreduced, before = assembly.frequencies(10, fixed=fixed), np.inf
    for n, size, expected in TABLE[level]:
        condensed = assembly.reduced(n, level=level, fixed=fixed)
        found = condensed.frequencies(10)
        assert condensed.n_interface == size
        assert_allclose((found / FULL - 1).max(), expected, rtol=0.02)
        assert (found >= unreduced * (1 - 1e-9)).all()
        assert (found <= before * (1 + 1e-9)).all()
        before = found


def body(kinds, n=None, m=15, **options):
    method = rom.CraigBampton(m) if n is None else rom.Characteristic(rom.CraigBampton(m), n)
    options = {"certify": False} | options
    return rom.reduce(block(cells=(6, 3, 3)), method=method, interfaces=kinds, **options)


def test_functions_of_one_body_lead_to_its_full_interfaces():
    exact = body(BOTH).frequencies(12)
    steps = [body(BOTH, n) for n in (6, 8, 12, 24, 48)]
    found = np.array([step.frequencies(12) for step in steps])
    assert (found[:, :6] == 0.0).all()
    assert (found[:, 6:] >= exact[6:] * (1 - 1e-9)).all()
    assert (np.diff(found[:, 6:], axis=0) <= 1e-9 * exact[6:]).all()
    assert found[0, 6:].max() / exact[6:].max() > 1 + 1e-4
    assert_allclose(found[-1, 6:], exact[6:], rtol=1e-9)
    assert steps[2].marker("tip").kind == "characteristic:12"
    assert steps[2].marker("tip").hold.shape[0] == 12
    # they beat polynomials of the same number
    bodies = body(BOTH, 18), body(dict.fromkeys(BOTH, "polynomial:2"))
    computed, polynomials = ((b.frequencies(12)[6:] / exact[6:] - 1).max() for b in bodies)
    assert computed < 0.01 * polynomials


def test_interfaces_of_characteristic_functions_can_be_held():
    """Functions of each interface, not of all together: one can rest while the other moves."""
    for kinds in (BOTH, BOTH | {"tip": "rbe2"}):
        exact, found = body(kinds, m=40), body(kinds, 14, m=40, certify=True)
        assert found.certificate.ok and found.certificate.rows, found.certificate
        for name in kinds:
            held, known = (one.frequencies(5, fixed=(name,)) for one in (found, exact))
            assert_allclose(held, known, rtol=2e-3)
        assert found.provenance["reduction"]["method"].startswith("Characteristic(method=Craig")


def test_a_repeated_frequency_of_one_body_is_kept_whole(caplog):
    model, kinds = block((1.0, 0.1, 0.1), (6, 2, 2)), {"root": "full", "tip": "rbe2"}
    method = rom.Characteristic(rom.CraigBampton(4), 10)
    with caplog.at_level(logging.INFO, logger="rom"):
        made = rom.reduce(model, method=method, interfaces=kinds, certify=False)
    assert made.marker("root").hold.shape[0] == 11
    assert "more than 10 functions" in caplog.text


def test_bodies_with_functions_of_their_own_are_not_coupled_and_without_any_not_reduced():
    refuses(ConfigError, "n = 49 must be .* 0 to 48: .* interface 'root'", body, BOTH, 49)
    refuses(ConfigError, "reduces full interfaces, and none", body, dict.fromkeys(BOTH, "rbe2"), 8)
    method, bodies = rom.Characteristic(rom.CraigBampton(4), 9), {}
    for side, origin, length in (("left", 0.0, 0.5), ("right", 0.5, 0.3)):
        model = block((length, 0.1, 0.08), (4, 2, 2), origin=(origin, 0, 0))
        bodies[side] = rom.reduce(model, method=method, interfaces=BOTH, certify=False)
    said = "share 9 nodes, but .* functions of its own"
    refuses(InterfaceError, said, rom.Assembly, bodies, COUPLED)
    assert half("left", "full").marker("tip").patch is not None
