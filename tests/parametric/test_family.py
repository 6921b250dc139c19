"""Bodies with parameters against closed forms and against models made with other materials."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.optimize import brentq

import rom
from cases.components.updating import refuse
from cases.refusals import refuses
from cases.solid import KINDS, STEEL, block, composite
from rom.body.reference import rigid_elastic
from rom.components.families.affine import AffineModel
from rom.errors import ConfigError, FileFormatError, ParameterError, RomWarning

ALLOY = rom.Material(E=70e9, nu=0.33, rho=2700.0)
CELLS, SIZE, ORIGIN = (10, 2, 3), (1.0, 0.1, 0.08), (0.3, -0.2, 0.1)
PARAMETERS = {
    "E_web": rom.YoungsModulus("web", 0.5, 2.0),
    "rho_all": rom.Density(None, 0.8, 1.2),
    "rho_web": rom.Density("web", 0.5, 1.5),
}
POINTS = [
    {"E_web": 1.0, "rho_all": 1.0, "rho_web": 1.0},
    {"E_web": 0.5, "rho_all": 1.2, "rho_web": 1.5},
    {"E_web": 1.83, "rho_all": 0.93, "rho_web": 0.61},
    {"E_web": 0.71, "rho_all": 0.81, "rho_web": 1.37},
]
TOL = 1e-3


def scaled(material, E, rho):
    return replace(material, E=E * material.E, rho=rho * material.rho)


def made(E_web=1.0, rho_all=1.0, rho_web=1.0):
    """The block itself: four tenths of steel, six of alloy."""
    materials = {"web": scaled(STEEL, E_web, rho_all * rho_web), "rest": scaled(ALLOY, 1, rho_all)}
    return composite(materials, lambda c: "web" if c[0] < 4 else "rest", SIZE, CELLS, ORIGIN)


def family_of(parameters, n_modes, model=None, **options):
    model, method = made() if model is None else model, rom.CraigBampton(n_modes)
    options = {"method": method, "interfaces": KINDS} | options
    return rom.reduce_parametric(model, parameters=parameters, **options)


@pytest.fixture(scope="module")
def family():
    return family_of(PARAMETERS, 24, tol=TOL)


@pytest.mark.parametrize("point", POINTS)
def test_mass_centre_and_inertia_are_those_of_two_boxes(family, point):
    mass, first, inertia = 0.0, np.zeros(3), np.zeros((3, 3))
    for low, length, rho in ((0.3, 0.4, 7850.0 * point["rho_web"]), (0.7, 0.6, 2700.0)):
        m, (a, b, c) = point["rho_all"] * rho * length * 0.1 * 0.08, (length, 0.1, 0.08)
        x = np.array([low + length / 2, -0.15, 0.14])
        mass, first = mass + m, first + m * x
        inertia = inertia + np.diag([b * b + c * c, a * a + c * c, a * a + b * b]) * m / 12
        inertia = inertia + m * (x @ x * np.eye(3) - np.outer(x, x))
    body = family.at(**point)
    assert_allclose(body.mass, mass, rtol=1e-12)
    assert_allclose(body.first_moment, first, rtol=1e-11)
    assert_allclose(body.inertia, inertia, rtol=1e-10, atol=1e-12 * inertia.max())


@pytest.mark.parametrize("point", POINTS)
@pytest.mark.parametrize("fixed", [(), ("root",), ("tip",), ("root", "tip")])
def test_frequencies_are_those_of_a_model_made_with_that_material(family, point, fixed):
    n = 6 if fixed else 12
    full = rom.modes(made(**point), n, fixed=fixed, interfaces=KINDS).frequencies
    reduced = family.at(**point).frequencies(n, fixed=fixed)
    assert_allclose(reduced, full, rtol=TOL, atol=1e-3)
    assert np.all(reduced >= full - 1e-6)
    assert_allclose(family.frequencies(n, fixed=fixed, **point)[6:], reduced[6:], rtol=1e-9)


def test_the_terms_are_products_of_the_matrices_with_the_shapes():
    model, rng = made(), np.random.default_rng(3)
    E, point = rng.standard_normal((model.n_dofs, 5)), POINTS[2]
    direct = next(AffineModel(made(**point), {"x": rom.Density(None, 1, 1)}).shares(E, None))
    affine = AffineModel(model, PARAMETERS)
    shares = {share.region: share for share in affine.shares(E, None)}
    assert set(shares) == {"web", None}
    web, rest = shares["web"], shares[None]
    for name in direct.integrals.__slots__:
        found = 0.93 * (0.61 * getattr(web.integrals, name) + getattr(rest.integrals, name))
        expected = np.asarray(getattr(direct.integrals, name))
        assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())
    assert_allclose(1.83 * web.K + rest.K, direct.K, atol=1e-12 * np.abs(direct.K).max())
    ops = affine.at(point)
    assert_allclose(E.T @ ops.apply_K(E), direct.K, atol=1e-12 * np.abs(direct.K).max())


def test_two_rods_in_a_row_ring_as_the_closed_form_says():
    """Clamped and free: E1 k1 cot(k1 L1) = E2 k2 tan(k2 L2) per area, k = omega sqrt(rho / E)."""
    soft, hard = rom.Material(3e9, 0.0, 1200.0), rom.Material(70e9, 0.0, 2700.0)
    size, cells = (1.0, 0.02, 0.02), (80, 1, 1)
    model = composite({"pad": soft, "rod": hard}, lambda c: ("pad", "rod")[c[0] >= 32], size, cells)
    parameters = {"E": rom.YoungsModulus("pad", 0.5, 4.0), "rho": rom.Density("rod", 0.5, 2.0)}
    family = family_of(parameters, 40, model, certify=False)
    for E, rho in ((0.6, 0.7), (1.0, 1.0), (3.5, 1.7)):
        k1, k2 = np.sqrt(1200.0 / (E * 3e9)), np.sqrt(rho * 2700.0 / 70e9)

        def balance(w, E=E, k1=k1, k2=k2):
            pull = E * 3e9 * k1 * np.cos(k1 * w * 0.4) * np.cos(k2 * w * 0.6)
            return pull - 70e9 * k2 * np.sin(k2 * w * 0.6) * np.sin(k1 * w * 0.4)

        omega = brentq(balance, 1.0, np.pi / 2 / (0.4 * k1))  # below it the pad alone resonates
        body = family.at(E=E, rho=rho)
        along = int(np.argmax(body.effective_mass(fixed="root")[:, 0]))
        assert_allclose(2 * np.pi * body.frequencies(fixed="root")[along], omega, rtol=5e-4)


def test_all_moduli_times_s_raise_frequencies_by_its_root():
    parameters = {"E": rom.YoungsModulus(None, 0.1, 10.0), "rho": rom.Density(None, 0.1, 10.0)}
    family = family_of(parameters, 8)
    assert len(family.provenance["reduction"]["points sampled"]) == 1
    nominal = family.at().frequencies()[6:]
    for s in (0.1, 0.37, 7.0):
        assert_allclose(family.at(E=s).frequencies()[6:], np.sqrt(s) * nominal, rtol=1e-10)
        assert_allclose(family.at(rho=s).frequencies()[6:], nominal / np.sqrt(s), rtol=1e-10)
        assert_allclose(family.at(E=s, rho=s).frequencies()[6:], nominal, rtol=1e-10)
    single = rom.reduce(made(), method=rom.CraigBampton(8), interfaces=KINDS, certify=False)
    assert_allclose(nominal, single.frequencies()[6:], rtol=1e-9)


@pytest.mark.parametrize("reference", ["mean-axis", "root", ("root", "tip")])
def test_the_frame_follows_its_condition_at_every_point(family, reference):
    """The mean axis depends on the mass, and with it on the densities."""
    bodies = [family.with_reference(reference).at(**point) for point in POINTS]
    for body in bodies:
        size = np.abs(body.surface.shape).max()
        if reference == "mean-axis":
            assert_allclose(rigid_elastic(body), 0, atol=1e-9 * body.mass * size)
        else:
            assert_allclose(body.marker("root").translation, 0, atol=1e-9 * size)
        assert_allclose(body.M, np.eye(body.n_modes), atol=1e-8)
        assert_allclose(np.sqrt(np.diag(body.K)), body.omega, rtol=1e-12)
    assert np.abs(bodies[1].omega[:6] / bodies[0].omega[:6] - 1).max() > 0.05


def test_what_interfaces_carry_keeps_its_mass():
    carried = rom.Attachment("tip", 3.0, np.diag([0.01, 0.02, 0.03]), at=(1.35, -0.15, 0.14))
    model = replace(made(), attachments=(carried,))
    family = family_of({"rho": rom.Density(None, 0.5, 2.0)}, 24, model)
    assert family.certificate.ok, family.certificate
    for rho in (0.5, 1.4):
        body, other = family.at(rho=rho), replace(made(rho_all=rho), attachments=(carried,))
        assert_allclose(body.mass, other.mass(), rtol=1e-12)
        expected = rom.reduce(other, method=rom.Guyan(), interfaces=KINDS, certify=False)
        assert_allclose(body.first_moment, expected.first_moment, rtol=1e-10)
        size = np.abs(expected.inertia).max()
        assert_allclose(body.inertia, expected.inertia, rtol=1e-10, atol=1e-12 * size)
        full = rom.modes(other, 5, fixed=("root",), interfaces=KINDS).frequencies
        assert_allclose(body.frequencies(5, fixed=("root",)), full, rtol=TOL)


def test_damping_is_made_anew_at_every_point(family):
    point = POINTS[2]
    body = replace(family, damping=rom.Rayleigh(3.0, 1e-5)).at(**point)
    assert_allclose(body.D, 3.0 * body.M + 1e-5 * body.K, rtol=1e-12, atol=1e-12)
    body = replace(family, damping=rom.ModalDamping(0.02)).at(**point)
    assert_allclose(np.diag(body.D), 0.04 * family.at(**point).omega, rtol=1e-12)


def test_the_certificate_compares_away_from_the_points_sampled(family):
    assert family.certificate.ok, family.certificate
    tables = family.provenance["comparison"]
    sampled = family.provenance["reduction"]["points sampled"]
    assert len(tables) == 9 and len(sampled) >= 5  # three points, each free and on two supports
    for where in tables:
        assert all(f"E_web = {point['E_web']:.4g}," not in where for point in sampled[:5])
    assert not family_of(PARAMETERS, 2, tol=TOL).certificate.ok


def test_points_between_join_where_the_estimate_says_so(monkeypatch):
    """Without the corners one basis must not do for a range of a million."""
    monkeypatch.setattr(rom.components.families.reduce, "corners", lambda *_: [])
    wide = {"E": rom.YoungsModulus("web", 1e-3, 1e3)}
    coarse, fine = (family_of(wide, 30, tol=tol, certify=False) for tol in (0.99, TOL))
    points = [len(f.provenance["reduction"]["points sampled"]) for f in (coarse, fine)]
    assert points[0] == 1 and points[1] > 1
    E = fine.provenance["reduction"]["points sampled"][-1]["E"]
    full = rom.modes(made(E_web=E), 12, interfaces=KINDS).frequencies[6:]
    assert_allclose(fine.frequencies(12, E=E)[6:], full, rtol=TOL)
    assert np.abs(coarse.frequencies(12, E=E)[6:] / full - 1).max() > 10 * TOL


def test_factors_outside_the_range_are_refused_or_announced(family):
    refuses(ParameterError, r"E_web = 2\.5 is outside 0\.5 to 2", family.at, E_web=2.5)
    with pytest.warns(RomWarning, match=r"E_web = 2\.5 is outside"):
        body = family.at(E_web=2.5, extrapolate=True)
    assert body.provenance["parameters"] == {"E_web": 2.5, "rho_all": 1.0, "rho_web": 1.0}
    refuses(ParameterError, r"no parameter 'E_wbe'; there are \['E_web'", family.at, E_wbe=1.0)
    none, far = "E_web = .* must be positive", {"extrapolate": True}
    for wrong in (0.0, -1.0):
        refuses(ParameterError, none, family.at, E_web=wrong, **far)
    for wrong in (np.nan, np.inf, "1", True, [1.0]):
        refuses(ConfigError, "E_web = .* a finite number", family.at, E_web=wrong, **far)


def test_wrong_parameters_are_named():
    half, other = ({"rho": rom.Density(name, 0.5, 1.0)} for name in ("web", "wbe"))
    refuse(
        (lambda: rom.YoungsModulus("web", 2.0, 1.0), "YoungsModulus of web: needed is"),
        (lambda: rom.Density(None, np.nan, 1.0), "low of Density of the whole body = nan"),
        (lambda: family_of({"2rho": half["rho"]}, 2), "'2rho' names no parameter"),
        (lambda: family_of(other, 2), r"no region 'wbe', .* the model has \['rest', 'web'\]"),
        (lambda: family_of(half, 2, block()), r"no region 'web', .* the model has \[\]"),
        (lambda: family_of({}, 2), ConfigError, "needs a parameter"),
        (lambda: family_of(half, 2, method=rom.FreeFree(4)), ConfigError, "does not keep"),
        error=ParameterError,
    )


def test_a_family_read_equals_the_one_written(family, tmp_path):
    damped = replace(family.with_reference(("root", "tip")), damping=rom.Rayleigh(1.0, 1e-6))
    path = rom.save(damped, tmp_path / "family.rom.npz")
    again = rom.load(path)
    assert again.parameters == damped.parameters and again.certificate == damped.certificate
    assert str(again) == str(damped)
    one, other = again.at(**POINTS[3]), damped.at(**POINTS[3])
    for name in ("mass", "first_moment", "inertia", "S", "Ibar_kl", "S_kl", "K", "D", "omega"):
        assert_array_equal(getattr(one, name), getattr(other, name))
    assert rom.save(again, tmp_path / "again.npz").read_bytes() == path.read_bytes()
    for fixed in ((), ("root",), {"root": "xyz rx", "tip": "yz"}):
        modal = replace(family, damping=rom.ModalDamping(0.01, fixed=fixed))
        again = rom.load(rom.save(modal, tmp_path / "modal.npz"))
        assert again.damping == modal.damping
        assert_array_equal((body := again.at()).D, modal.at().D)
    single = rom.load(rom.save(body, tmp_path / "body.npz"))
    assert_array_equal(single.K, body.K)
    share = family.shares[0]
    cut = replace(family, shares=(replace(share, K=share.K[:-1]), *family.shares[1:]))
    file = rom.save(cut, tmp_path / "cut.npz")
    refuses(FileFormatError, "K of term 0 has the shape", rom.load, file)


def test_a_thousand_points_need_no_full_model(family, tmp_path, monkeypatch):
    """The family of a file, when operators and sparse solvers are gone."""

    def gone(*arguments, **options):
        raise AssertionError("the full model was asked")

    ends = [rom.modes(made(E_web=e), 1, fixed=("root",), interfaces=KINDS) for e in (0.5, 2.0)]
    mass, path = made().mass(), rom.save(family, tmp_path / "family.npz")
    operators = rom.eigen.scipy.SciPyOperators
    for name in [name for name, thing in vars(operators).items() if callable(thing)]:
        monkeypatch.setattr(operators, name, gone)
    monkeypatch.setattr(rom.eigen.scipy, "splu", gone)
    read, E = rom.load(path), np.geomspace(0.5, 2.0, 1000)
    found = [read.frequencies(8, fixed="root", E_web=e)[0] for e in E]
    assert np.all(np.diff(found) > 0), "stiffer is higher"
    assert_allclose(found[::999], [modes.frequencies[0] for modes in ends], rtol=TOL)
    assert read.at(E_web=E[100]).mass == pytest.approx(mass, rel=1e-12)
