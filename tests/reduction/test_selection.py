"""The number of modes for a band and an accuracy."""

import numpy as np
import pytest

import rom
from cases.refusals import refused, refuses
from cases.solid import KINDS, STEEL, block, reduced
from rom.errors import ConfigError
from rom.reduction.bases.method import judged_in

BODIES = [  # size [m], cells
    ((1.0, 0.1, 0.08), (10, 2, 2)), ((1.0, 0.3, 0.05), (10, 4, 2)), ((0.3, 0.3, 0.3), (4, 4, 4)),
    ((1.0, 0.05, 0.05), (16, 1, 1)), ((0.6, 0.4, 0.02), (8, 6, 1)), ((0.2, 0.5, 0.1), (3, 6, 2)),
    ((0.5, 0.02, 0.01), (14, 2, 1)), ((2.0, 0.5, 0.5), (9, 3, 3)), ((0.4, 0.2, 0.2), (6, 3, 3)),
    ((0.1, 0.1, 0.4), (3, 3, 7)),
]  # fmt: skip


def worst_error(model, exact, n_modes):
    """Largest relative error of the frequencies in the band; one when some are missing."""
    found = reduced(n_modes, model).frequencies()[6 : 6 + exact.size]
    return np.abs(found / exact - 1).max() if found.size == exact.size else 1.0


@pytest.mark.once
@pytest.mark.parametrize(("size", "cells"), BODIES)
@pytest.mark.parametrize(("count", "tol"), [(6, 1e-3), (10, 1e-2), (12, 1e-4)])
def test_band_and_tolerance_are_met_with_few_modes(size, cells, count, tol):
    """And two thirds of the modes would not do."""
    model = block(size=size, cells=cells)
    exact = rom.modes(model, 6 + count, interfaces=KINDS).frequencies[6:]
    method = rom.CraigBampton(f_max=1.001 * exact[-1], tol=tol)
    body = rom.reduce(model, method=method, interfaces=KINDS, certify=False)
    n = body.n_modes - 6
    assert worst_error(model, exact, n) <= tol
    assert worst_error(model, exact, int(n / 1.5) - 1) > tol


ALL_KINDS = [KINDS, {"root": "rbe3", "tip": "rbe2"}, {"root": "rbe2"}, {"root": "full"},
             {"root": "rbe2", "tip": "polynomial:2"}]  # fmt: skip


def errors_in_all_supports(model, kinds, method):
    """Of the lowest six elastic frequencies, {support: (6,)}; missing ones are wrong by one."""
    body = rom.reduce(model, method=method, interfaces=kinds, certify=False)
    found = {}
    for fixed in ((), *((name,) for name in kinds)):
        rigid = 0 if fixed else 6
        exact = rom.modes(model, rigid + 6, fixed=fixed, interfaces=kinds).frequencies[rigid:]
        few = body.frequencies(fixed=fixed)[rigid:][:6]
        found[fixed] = np.abs(np.r_[few, 2 * exact[few.size :]] / exact - 1)
    return found, body.n_modes


@pytest.mark.once
@pytest.mark.parametrize("kinds", ALL_KINDS, ids=str)
@pytest.mark.parametrize(("size", "cells"), BODIES[::3])
def test_without_a_number_the_frequencies_of_every_support_are_accurate(size, cells, kinds):
    """To half the limit of certificates; half of the modes would not do."""
    model = block(size=size, cells=cells)
    errors, n = errors_in_all_supports(model, kinds, rom.CraigBampton())
    assert max(e.max() for e in errors.values()) <= 5e-4
    half = (n - reduced(1, model, interfaces=kinds).n_modes) // 2
    fewer, _ = errors_in_all_supports(model, kinds, rom.CraigBampton(half))
    assert max(e.max() for e in fewer.values()) > 5e-4


def test_the_default_passes_its_certificate():
    model = block(size=(1.0, 0.3, 0.05), cells=(10, 4, 2))
    body = rom.reduce(model, interfaces=KINDS)
    assert body.certificate.ok, body.certificate
    parts = (np.arange(6), np.arange(6, 12))
    assert judged_in(rom.WithLoads(rom.CraigBampton()), parts).method.supports == parts
    loaded = rom.reduce(model, method=rom.WithLoads(rom.CraigBampton()), interfaces=KINDS)
    assert loaded.certificate.ok and loaded.n_modes > body.n_modes
    finer = rom.reduce(model, method=rom.CraigBampton(tol=1e-5), interfaces=KINDS, certify=False)
    assert finer.n_modes > body.n_modes
    assert not rom.reduce(model, method=rom.CraigBampton(1), interfaces=KINDS).certificate.ok


def meshed(size, cells):
    from cases.boxes import box
    from rom.fe.elasticity import assemble

    mesh, tags = box(size, cells)
    return assemble(mesh, None, tags, material=STEEL)


@pytest.mark.fenicsx
def test_the_selection_works_on_meshes_too():
    model = meshed((1.0, 0.1, 0.08), (10, 2, 2))
    kinds = {"x0": "rbe3", "x1": "polynomial:1"}
    exact = rom.modes(model, 12, interfaces=kinds).frequencies[6:]
    method = rom.CraigBampton(f_max=1.001 * exact[-1], tol=1e-3)
    body = rom.reduce(model, method=method, interfaces=kinds)
    assert np.abs(body.frequencies(12)[6:] / exact - 1).max() <= 1e-3
    assert body.n_modes < 60


@pytest.mark.fenicsx
@pytest.mark.long
def test_the_order_is_chosen_on_meshes_too():
    model = meshed((0.3, 0.2, 0.1), (4, 3, 2))
    kinds = {"x0": "rbe3", "x1": rom.Polynomial()}
    exact = rom.modes(model, 12, interfaces={"x0": "rbe3"}).frequencies[6:]
    method = rom.CraigBampton(f_max=1.001 * exact[-1], tol=1e-3)
    error, body = surface_error(model, kinds, exact, method)
    assert error <= 1e-3
    assert body.marker("x1").kind in ("polynomial:2", "polynomial:3", "polynomial:4")


def asked(**options):
    return lambda: rom.CraigBampton(**options)


test_wishes_that_exclude_each_other_are_refused = refused(
    (asked(n_modes=3, f_max=1e3), "n_modes or f_max, not both"),
    (asked(n_modes=3, tol=1e-3), "n_modes or tol, not both"),
    (asked(f_max=1e3, search="arnoldi"), "search"),
    (asked(n_modes=3, search="substructures"), "needs f_max"),
    (asked(f_max=1e3, tol=1e-3, search="substructures"), "takes no tol"),
    error=ConfigError,
)


def surface_error(model, kinds, exact, method):
    body = rom.reduce(model, method=method, interfaces=kinds, certify=False)
    found = body.frequencies()[6 : 6 + exact.size]
    return np.abs(found / exact - 1).max(), body


@pytest.mark.once
@pytest.mark.parametrize("tol", [3e-2, 3e-3])
@pytest.mark.parametrize(("size", "cells"), BODIES)
def test_the_order_of_a_surface_is_the_lowest_that_meets_the_tolerance(size, cells, tol):
    """Against the model whose tip keeps all its dofs; two orders less would not do."""
    model = block(size=size, cells=cells)
    exact = rom.modes(model, 12, interfaces={"root": "rbe2"}).frequencies[6:]
    method = rom.CraigBampton(f_max=1.001 * exact[-1], tol=tol)
    error, body = surface_error(model, {"root": "rbe2", "tip": "polynomial"}, exact, method)
    assert error <= tol
    order = int(body.marker("tip").kind.split(":")[1])
    if order > 2:
        kinds = {"root": "rbe2", "tip": rom.Polynomial(order - 2)}
        assert surface_error(model, kinds, exact, rom.CraigBampton(60))[0] > tol


def test_an_open_order_needs_an_accuracy():
    model = block(cells=(4, 2, 2))
    kinds = {"root": "rbe2", "tip": rom.Polynomial()}
    for method in (rom.CraigBampton(5), rom.CraigBampton(f_max=1e3), rom.Rubin(5)):
        how = {"method": method, "interfaces": kinds}
        refuses(ConfigError, "states no accuracy", rom.reduce, model, **how)
    refuses(ConfigError, "is open", rom.modes, model, 8, interfaces=kinds)
