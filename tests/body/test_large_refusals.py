"""What a body of large deflection cannot be made of, or asked for: refused by name, or right."""

import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
import rom.body.nonlinear.ranges
from cases.long import COARSE
from cases.mbs.slender import Full, assembled, reduced, slender
from rom.errors import ConfigError, InterfaceError, ModelError, RomError, RomWarning

pytest.importorskip("dolfinx", reason="dolfinx is not installed")
pytestmark = COARSE


@pytest.fixture(scope="module")
def beam():
    """A cantilever, its load, and where its finite elements are under it."""
    model, EI = slender(20, 6)
    load = np.array([0, EI, 0, 0, 0, 0])
    return model, load, Full(model).under(load)[6:9]


def snapshots(model):
    """Functions found from one state of bending, in which the section turns."""
    X = model.interfaces["tip"].points - model.interfaces["tip"].origin
    return rom.Snapshots(np.cross([0, 0, 0.1], X).reshape(-1, 1), n=6)


KINDS = {
    "rbe3": "rbe3",
    "full": "full",
    "affine": rom.Polynomial(1),
    "square": rom.Polynomial(2),
    "rigid": "rbe2",
    "found": snapshots,
}
WITH_MODES = (rom.CraigBampton, rom.BalancedTruncation, rom.Herting, rom.Rubin,
              rom.EnhancedCraigBampton, rom.FreeFree, rom.AssumedModes)  # fmt: skip
METHODS = {method.__name__: method(n_modes=4) for method in WITH_MODES}
METHODS |= {"Guyan": rom.Guyan(), "MomentMatching": rom.MomentMatching(order=1)}
FEW = {("rbe3", name) for name in METHODS} | {(name, "CraigBampton") for name in KINDS}


@pytest.mark.parametrize("kind, method", sorted(FEW))
def test_any_kind_of_interface_and_method_is_right_or_refused_by_name(beam, kind, method):
    model, load, known = beam
    of = KINDS[kind](model) if callable(KINDS[kind]) else KINDS[kind]
    try:
        body = reduced(model, load, method=METHODS[method], tip=of, active=2, n_steps=2)
    except RomError as error:
        assert any(word in str(error) for word in ("interface", "method", "coordinates")), error
        assert "equilibrium" not in str(error)
        assert (kind, method) not in {("rbe3", "CraigBampton"), ("affine", "CraigBampton")}
        return
    (q,) = body.equilibria({"tip": load})
    assert_allclose(body.marker("tip").translation @ q, known, rtol=0, atol=1e-2)


REFERENCES = ("free", "mean-axis", "buckens", ("root", "tip"), "hub", "")


@pytest.mark.parametrize("reference", REFERENCES)
def test_frames_that_are_no_interface_are_refused(beam, reference):
    model, load, _ = beam
    with pytest.raises((ConfigError, InterfaceError), match=r"reference|seen from|hub"):
        reduced(model, load, method=rom.Guyan(), reference=reference)


@pytest.mark.parametrize("size", [30.0, pytest.param(1e3, marks=pytest.mark.long), 1e5])
@pytest.mark.parametrize("component", range(6))
def test_a_load_beyond_what_one_body_carries_is_refused_or_fails_its_certificate(component, size):
    """Whatever it is, the load is named, and what helps; nothing is borne that is not certified."""
    model, EI = slender(20, 4)
    load = np.zeros(6)
    load[component] = size * EI
    try:
        options = {"active": 0, "n_steps": 2, "n_shapes": 6, "certify": True}
        body = reduced(model, load, method=rom.Guyan(), **options)
    except ModelError as error:
        assert "of the range" in str(error) and "smaller loads" in str(error)
        return
    name = rom.body.nonlinear.ranges.FORCES[component]
    failed = [row.quantity for row in body.certificate.failures if f"tip {name}" in row.quantity]
    assert failed
    table = body.provenance["large deflection"]
    assert min(case["holds to"] for case in table.values()) < 1.0


FAR = [((0, 0, 0, 0, 0, 3.0), 172), ((0, 25.0, 0, 0, 0, 0), 90), ((0, 0, 0, 0, 0, 1.3), 0)]


@pytest.mark.parametrize("load, degrees", [*FAR, ((0, 2.0, 0, 0, 0, 0), 0)])
def test_a_range_that_turns_farther_than_one_body_carries_names_pieces(load, degrees):
    """A moment as far as M L / EI, a force towards a right angle as the elastica does."""
    model, EI = slender(40, 5)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", RomWarning)
        reduced(model, EI * np.array(load), n_modes=2, active=2)
    turns = [str(w.message) for w in said if "turns by" in str(w.message)]
    assert bool(turns) == bool(degrees)
    assert all(f"turns by {degrees} degrees" in x and "rom.reduce_pieces" in x for x in turns)


def test_models_without_finite_elements_are_refused():
    model = assembled(cells=(2, 1, 1))
    bare = rom.FEModel(model.K, model.M, model.points, model.interfaces)
    with pytest.raises(ConfigError, match="no finite elements"):
        reduced(bare, (0, 1.0, 0, 0, 0, 0), method=rom.Guyan())
