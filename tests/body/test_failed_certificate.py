"""A certificate that fails is said where the body is made, moved and handed on, and once."""

import warnings

import numpy as np
import pytest

import rom
from cases.solid import block, reduced
from rom.errors import RomWarning
from rom.model import Report, Row

FAILS = r"certificate of body 'bar' fails in \d+ of 31 rows; worst is 'free: .*limit <= 0.001"


def made(n):
    return reduced(n, block(), name="bar", certify=True)


@pytest.fixture
def poor():
    """A body with two modes, whose maker was told."""
    with pytest.warns(RomWarning, match=FAILS):
        return made(2)


def silently(call, *given):
    with warnings.catch_warnings():
        warnings.simplefilter("error", RomWarning)
        return call(*given)


def test_it_is_said_once_however_often_the_body_is_used(poor, tmp_path):
    mech = rom.Mechanism()
    for frame in ("root", "tip"):
        seen = poor.with_reference(frame).in_units("mm-t-s")
        silently(mech.add_flexible, f"bar {frame}", seen)
    silently(rom.export, poor, tmp_path / "bar.vtu")


@pytest.mark.parametrize("use", ["mechanism", "export"])
def test_whoever_gets_the_body_from_a_file_is_told(use, tmp_path):
    rows = (Row("free: worst error of 6 frequencies", 0.66, "<= 0.001", False),)
    body = reduced(2, block(cells=(2, 1, 1)))
    path = tmp_path / "bar.rom.npz"
    object.__setattr__(body, "certificate", Report(f"of {tmp_path}", rows))
    rom.save(body, path)
    with pytest.warns(RomWarning, match=r"fails in 1 of 1 rows; .*: 0.66, limit <= 0.001. Motions"):
        if use == "mechanism":
            rom.Mechanism().add_flexible("any", rom.load(path))
        else:
            rom.export(rom.load(path), tmp_path / "bar.SID_FEM")


def test_the_audit_of_its_motion_fails_with_the_worst_row(poor):
    mech = rom.Mechanism()
    silently(mech.add_flexible, "bar", poor)
    report = rom.audit(rom.simulate(mech, t_end=1e-3, dt=1e-4))
    (failed,) = report.failures
    assert failed.value == len(poor.certificate.failures) and not report.ok
    assert f"of bar that fail, worst: {poor.certificate.worst.quantity}" in failed.quantity
    errors = [row.value for row in poor.certificate.failures if row.limit == "<= 0.001"]
    assert poor.certificate.worst.excess == pytest.approx(max(np.abs(errors)) / 1e-3 - 1)


def test_a_certificate_that_holds_is_silent():
    mech = rom.Mechanism()
    silently(mech.add_flexible, "bar", silently(made, 30))
    rows = rom.audit(rom.simulate(mech, t_end=1e-3, dt=1e-4)).rows
    assert [row.ok for row in rows if "certificate of bar" in row.quantity] == [True]


@pytest.mark.parametrize(
    ("value", "limit", "excess"),
    [(0.5, "<= 1", 0.0), (3.0, "<= 1", 2.0), (0.5, "> 0.99", 0.49 / 0.99), (1.0, "> 0.99", 0.0),
     (-1e-3, "> -1e-08", 1e5 - 1), (1.0, "<= 0", np.inf), (np.nan, "<= 1", np.inf),
     (np.nan, "information", np.inf), (1e9, "--", 0.0), (0.0, "== 0", 0.0)],
)  # fmt: skip
def test_how_far_a_row_is_beyond_its_limit(value, limit, excess):
    assert Row("it", value, limit, True).excess == pytest.approx(excess)
