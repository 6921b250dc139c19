"""Reduced bodies coupled on shared interfaces, against the whole in one piece."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.halves import COUPLED, FULL, ROOT, half, joined, study, whole
from cases.long import few
from cases.refusals import refuses
from cases.solid import block, reduced
from rom.errors import ConfigError, InterfaceError, RomWarning
from rom.model import Row


@pytest.mark.parametrize("fixed", [(), (ROOT,), (ROOT, ("right", "tip"))])
def test_two_halves_with_all_modes_are_the_whole(fixed):
    """Conforming meshes, every dof of the cut kept."""
    names = tuple(interface for _, interface in fixed)
    found = joined("full").frequencies(12, fixed=fixed)
    assert_allclose(found, whole(fixed=names), rtol=1e-8, atol=1e-6)
    assert np.count_nonzero(found == 0.0) == (0 if fixed else 6)


def test_shapes_of_both_halves_meet_at_the_cut():
    assembly = joined("polynomial:2", n_modes=10)
    omega, shapes = assembly.modes(8, fixed=(ROOT,))
    assert omega.shape == (8,)
    left, right = (assembly.bodies[name] for name in ("left", "right"))
    ends = [left.marker("tip").hold @ shapes["left"], right.marker("root").hold @ shapes["right"]]
    assert_allclose(ends[0], ends[1], atol=1e-9 * np.abs(ends[0]).max())
    assert_allclose(left.marker("root").hold @ shapes["left"], 0, atol=1e-9 * np.abs(ends[0]).max())


def test_modes_asked_for_again_are_the_same_whatever_was_done_to_them():
    """And those with supports are others: they are kept apart."""
    assembly = joined("polynomial:2", n_modes=10)
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


def test_meshes_that_do_not_match_are_coupled_by_their_functions():
    """Two and three cells across the cut: between the whole on either mesh, or 0.1 % above."""
    coarse, fine = whole((8, 2, 2)), whole((8, 3, 3))
    assembly = joined("polynomial:2", ((4, 2, 2), (4, 3, 3)), n_modes=40)
    found = assembly.frequencies(6, fixed=(ROOT,))
    assert (found > np.minimum(coarse, fine)[:6]).all()
    assert (found < 1.001 * np.maximum(coarse, fine)[:6]).all()
    assert (np.abs(fine / coarse - 1)[:6] < 0.1).all()


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


def random_row(rng):
    """Two or three blocks in a row, and the three lowest elastic frequencies of the whole."""
    height, width, step = rng.uniform(0.05, 0.15, 3)
    cells = rng.integers(4, 7, rng.integers(2, 4))
    ends = np.r_[0, np.cumsum(cells)] * step
    parts = [block((n * step, height, width), (n, 2, 2), origin=(x, 0, 0))
             for n, x in zip(cells, ends[:-1], strict=True)]  # fmt: skip
    whole = block((ends[-1], height, width), (cells.sum(), 2, 2))
    return parts, rom.modes(whole, 9).frequencies[6:]


def in_a_row(parts, method):
    bodies, couplings = {}, []
    for i, part in enumerate(parts):
        touched = (["root"] if i else []) + (["tip"] if i < len(parts) - 1 else [])
        kinds = dict.fromkeys(touched, "full")
        bodies[f"part {i}"] = rom.reduce(part, method=method, interfaces=kinds, certify=False)
        if i:
            couplings.append(((f"part {i - 1}", "tip"), (f"part {i}", "root")))
    return rom.Assembly(bodies, tuple(couplings))


@pytest.mark.filterwarnings("ignore:.*fixed-interface modes are kept")
@pytest.mark.parametrize("seed", few(1, range(4)))
def test_enhanced_bodies_are_wrong_in_assemblies_and_that_is_said(seed):
    """Their correction is that of one body."""
    parts, full = random_row(np.random.default_rng(seed))

    def error(method):
        return np.abs(in_a_row(parts, method).frequencies()[6:9] / full - 1).max()

    with warnings.catch_warnings():
        warnings.simplefilter("error", RomWarning)
        moments = error(rom.MomentMatching((0.0,), 2))
    with pytest.warns(RomWarning, match=r"part 0.*enhanced .* off by per cents"):
        enhanced = error(rom.EnhancedCraigBampton(8))
    plain = error(rom.CraigBampton(8))
    assert moments < 1e-4 and moments < plain < 5e-3 and 5 * plain < enhanced
