"""Free-free modes alone: right for a free body, refused where a joint would clamp it."""

import numpy as np
import pytest

import rom
from benchmarks.models import KINDS
from benchmarks.models import bar as bar_of
from rom.errors import ModelError

SIZE = (1.0, 0.02, 0.01)


@pytest.fixture(scope="module")
def model():
    return bar_of(SIZE, (20, 1, 1))


@pytest.fixture(scope="module")
def body(model):
    return rom.reduce(model, method=rom.FreeFree(4), interfaces=KINDS)


def test_a_free_body_has_its_frequencies_and_a_certificate(model, body):
    full = rom.modes(model, 10, interfaces=KINDS).frequencies
    assert body.frequencies()[:6] == pytest.approx(0.0)
    assert body.frequencies()[6:] == pytest.approx(full[6:], rel=1e-8)
    assert body.certificate.ok, body.certificate
    # Euler and Bernoulli: (4.730041)^2 sqrt(E I / (m L^4)), bending about the thin side first
    bending = 4.730041**2 * np.sqrt(210e9 * SIZE[2] ** 2 / (12 * 7850.0)) / (2 * np.pi)
    assert body.frequencies()[6] == pytest.approx(bending, rel=0.01)


def test_holding_an_interface_is_refused(body):
    with pytest.raises(ModelError, match="free-free modes only; with 'root' held"):
        body.frequencies(fixed=("root",))


def test_the_body_file_remembers(body, tmp_path):
    rom.save(body, tmp_path / "free.rom.npz")
    assert not rom.load(tmp_path / "free.rom.npz").has_static_shapes


@pytest.mark.parametrize("joint", ["fixed", "revolute", "cylindrical", "prismatic"])
def test_joints_that_transmit_moments_are_refused(body, joint):
    mech = rom.Mechanism()
    bar = mech.add_flexible("bar", body)
    axis = {} if joint == "fixed" else {"axis": (0, 0, 1)}
    with pytest.raises(ModelError, match=f"{joint} joint 'clamp' transmits moments"):
        getattr(mech, joint)("clamp", mech.ground.marker((0, 0, 0)), bar.marker("root"), **axis)
    mech.spherical("clamp", mech.ground.marker((0, 0, 0)), bar.marker("root"))
