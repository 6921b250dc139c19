"""Every method on beam, connecting rod and blade, by PETSc and by SciPy, against the full model."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from benchmarks.models import STEEL, TITANIUM
from cases.long import few
from cases.paths import ROOT

pytestmark = [pytest.mark.fenicsx, pytest.mark.filterwarnings("ignore:linear tetrahedra")]
COMPONENTS = {  # material, parameters, degree, interfaces
    "beam": (STEEL, {"hex": 1, "nx": 12, "ny": 1, "nz": 1}, 2, ("root", "tip")),
    "connecting_rod": (STEEL, {"lc": 0.009}, 1, ("pin_a", "pin_b")),
    "compressor_blade": (TITANIUM, {"lc": 0.012, "lc_flank": 0.005}, 1,
                         ("flank_left", "flank_right")),
}  # fmt: skip
METHODS = {  # what reduces, given a number of modes; kind of the second interface
    "Guyan": (lambda _: rom.Guyan(), "rbe2"),
    "Craig-Bampton": (rom.CraigBampton, "rbe2"),
    "averaged": (rom.CraigBampton, "rbe3"),
    "polynomials": (rom.CraigBampton, rom.Polynomial(2)),
    "enhanced": (rom.EnhancedCraigBampton, "rbe2"),
    "Rubin": (rom.Rubin, "rbe2"),
    "Herting": (rom.Herting, "rbe2"),
    "free-free": (rom.FreeFree, "rbe2"),
    "moments": (lambda n: rom.MomentMatching((0.0,), 1 + n // 8), "rbe2"),
    "balanced": (lambda n: rom.BalancedTruncation(n, pool=40), "rbe2"),
    "loads": (lambda n: rom.WithLoads(rom.CraigBampton(n)), "rbe2"),
    "characteristic": (lambda n: rom.Characteristic(rom.CraigBampton(n), 12), "full"),
    "Rubin coupled": ("rubin", "rbe2"),
    "MacNeal coupled": ("macneal", "rbe2"),
    "dual coupled": ("dual", "rbe2"),
}
WORST = {  # relative error of six frequencies with sixteen modes, on all components
    "Guyan": 30.0, "Craig-Bampton": 4e-3, "averaged": 4e-3, "polynomials": 4e-3,
    "enhanced": 1e-6, "Rubin": 1e-8, "Herting": 1e-8, "free-free": 1e-8, "moments": 1e-2,
    "balanced": 2e-2, "loads": 3e-3, "characteristic": 4e-3,
    "Rubin coupled": 3e-5, "MacNeal coupled": 2e-3, "dual coupled": 5e-5,
}  # fmt: skip
HELD = ("Rubin coupled", "MacNeal coupled", "dual coupled")  # compared with one interface held
FEW, MANY = 6, 16


@cache
def component(name):
    material, parameters, degree, _ = COMPONENTS[name]
    geometry = ROOT / f"meshes/{name}.geo"
    return rom.fe.model(geometry, material=material, parameters=parameters, degree=degree)


def kinds(name, method):
    first, second = COMPONENTS[name][3]
    return {first: "rbe2", second: METHODS[method][1]}


@cache
def reduced(name, method, implementation, n_modes):
    made, model = METHODS[method][0], component(name)
    if implementation == "scipy":
        model = replace(model, operators=None)
    if method in HELD:
        free = rom.substructure(model, n_modes=n_modes, interfaces=kinds(name, method))
        held = (("body", COMPONENTS[name][3][0]),)
        return rom.DualAssembly({"body": free}, ()).frequencies(6, kind=made, fixed=held)
    body = rom.reduce(model, method=made(n_modes), interfaces=kinds(name, method), certify=False)
    return body.frequencies(12)[6:]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", few(1, COMPONENTS))
def test_frequencies_lie_above_the_full_ones_and_fall_towards_them(name, method):
    fixed = COMPONENTS[name][3][:1] if method in HELD else ()
    exact = rom.modes(component(name), 12, fixed=fixed, interfaces=kinds(name, method)).frequencies
    exact = exact[0 if fixed else 6 :][:6]
    fewer, many = (reduced(name, method, "petsc", n) / exact - 1 for n in (FEW, MANY))
    assert np.abs(many).max() < WORST[method]
    if method != "MacNeal coupled":  # it leaves residual mass out: no Galerkin projection
        assert min(fewer.min(), many.min()) > -1e-8
    if method != "Guyan":
        assert np.abs(many).max() <= max(np.abs(fewer).max(), 1e-8)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", few(1, COMPONENTS))
def test_scipy_and_petsc_reduce_alike(name, method):
    """Blocks of a Krylov sequence are nearly dependent: their span has more of the round-off."""
    ours, theirs = (reduced(name, method, kind, MANY) for kind in ("petsc", "scipy"))
    assert_allclose(ours, theirs, rtol=1e-8 if method == "moments" else 1e-9)
