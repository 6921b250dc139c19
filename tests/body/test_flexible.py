"""A body by itself: what is made of one, damping in any frame, a certificate that fails."""

import pickle
import warnings
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.beam import stiffened_beam
from cases.long import few
from cases.refusals import refuses
from cases.solid import block, reduced
from rom.body.damping import damped
from rom.errors import ConfigError, InterfaceError, RomWarning
from rom.model import Report, Row


def test_what_is_made_of_a_body_is_a_flexible_body():
    body = stiffened_beam(n_modes=6)
    for made in (body.in_units("mm-t-s"), body.with_reference("tip"), replace(body, name="other"),
                 pickle.loads(pickle.dumps(body))):  # fmt: skip
        assert type(made) is rom.FlexibleBody and repr(made).startswith("FlexibleBody(")
        frequencies = (one.frequencies(3, fixed=("root",)) for one in (made, body))
        assert_allclose(*frequencies, rtol=1e-9)
    for name in ("mass", "remark"):  # neither a field nor anything else is set
        refuses(FrozenInstanceError, name, setattr, body, name, 1.0)


KINDS = {"root": "rbe2", "tip": "rbe3"}
FRAMES = ["root", "tip", "mean-axis", ("root", "tip")]
SUPPORTS = [(), ("root",), ("tip",), ("root", "tip"), ("root:xyz rx", "tip:yz")]


def random_body(rng):
    size = rng.uniform(0.05, 0.5, 3)
    model = block(size=size, cells=rng.integers(1, 4, 3), origin=rng.uniform(-1, 1, 3))
    n = int(rng.integers(0, 7))
    return rom.reduce(model, method=rom.CraigBampton(n), interfaces=KINDS, certify=False)


def random_damping(rng, body):
    """A law, and the ratios it means for modes omega in the support it names."""
    fixed = SUPPORTS[rng.integers(len(SUPPORTS))]
    kind = rng.integers(3)
    if kind == 0:
        low = 2 * np.pi * body.frequencies()[6]
        alpha, beta = rng.uniform(0, 0.02, 2) * (low, 1 / low)
        return rom.Rayleigh(alpha, beta), (), lambda w: (alpha / w + beta * w) / 2
    ratio = rng.uniform(1e-4, 0.2, body.n_modes) if kind == 1 else float(rng.uniform(1e-4, 0.2))
    return rom.ModalDamping(ratio, fixed), fixed, lambda w: np.full(body.n_modes, ratio)[: w.size]


def in_motion(body, fixed):
    """Eigenvalues of the elastic modes of a mechanism that holds the body, by imaginary part."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    part = mech.add_flexible("part", body)
    for name in fixed:
        ground = mech.ground.marker(tuple(body.marker(name).point))
        mech.fixed(f"wall {name}", ground, part.marker(name))
    roots = rom.linearize(mech).eigenvalues
    n = np.count_nonzero(body.frequencies(fixed=fixed))
    return sorted(roots[roots.imag > 0], key=np.imag)[-n:] if n else []


@pytest.mark.parametrize("seed", few(6, range(40)))
def test_a_law_of_damping_says_the_same_in_every_frame(seed):
    rng = np.random.default_rng(seed)
    body = random_body(rng)
    law, fixed, meant = random_damping(rng, body)
    omega = 2 * np.pi * body.frequencies(fixed=fixed)
    omega = omega[omega > 0]
    zeta = meant(omega)
    exact = omega * (-zeta + 1j * np.sqrt(1 - zeta**2))
    everywhere = {}
    for frame in FRAMES:
        one = damped(body.with_reference(frame), law)
        again = damped(body, law).with_reference(frame)
        assert_allclose(one.D, again.D, atol=1e-7 * np.abs(again.D).max())
        for support in SUPPORTS[:4]:
            roots = in_motion(one, support)
            assert_allclose(roots, everywhere.setdefault(support, roots), rtol=1e-7)
            if support == fixed:
                assert_allclose(roots, sorted(exact, key=np.imag), rtol=1e-6)


def test_the_certificate_has_the_ratio_of_each_mode_in_each_support():
    """Two per cent of the cantilever are other ratios of the free body, and that is told."""
    model = block(size=(0.6, 0.03, 0.04), cells=(6, 1, 1))
    damping = rom.ModalDamping(0.02, fixed=("root",))
    body = rom.reduce(model, method=rom.CraigBampton(12), interfaces=KINDS, damping=damping)
    rows = {row.quantity: row.value for row in body.certificate.rows}
    for support, fixed in {"free": (), "root held": ("root",), "tip held": ("tip",)}.items():
        roots = np.array(in_motion(body, fixed)[:3])
        found = [rows[f"{support}: damping ratio of mode {k}"] for k in (1, 2, 3)]
        expected = 0.02 if fixed == ("root",) else -roots.real / np.abs(roots)
        assert_allclose(found, expected, rtol=1e-6 if fixed == ("root",) else 0.1)
    assert rows["free: damping ratio of mode 1"] > 0.05
    plain = rom.reduce(model, method=rom.CraigBampton(12), interfaces=KINDS)
    assert not any("damping" in row.quantity for row in plain.certificate.rows)


def test_ratios_and_the_interfaces_where_they_are_meant_must_fit():
    body = random_body(np.random.default_rng(0))
    refuses(InterfaceError, "no interface 'wall'", rom.ModalDamping(0.02, ("wall",)).matrix, body)
    refuses(ConfigError, "negative", rom.ModalDamping, -0.1)
    refuses(ConfigError, "2 ratios of ModalDamping for", damped, body, rom.ModalDamping([0.1, 0.2]))
    refuses(ConfigError, "directions", rom.ModalDamping(0.02, fixed={"root": "q"}).matrix, body)


FAILS = r"certificate of body 'bar' fails in \d+ of 31 rows; worst is 'free: .*limit <= 0.001"


def made(n):
    return reduced(n, block(), name="bar", certify=True)


@pytest.fixture
def poor():
    with pytest.warns(RomWarning, match=FAILS):
        return made(2)


def silently(call, *given):
    with warnings.catch_warnings():
        warnings.simplefilter("error", RomWarning)
        return call(*given)


def test_it_is_said_once_however_often_the_body_is_used_and_to_whoever_reads_it(poor, tmp_path):
    mech, path = rom.Mechanism(), tmp_path / "bar.rom.npz"
    for frame in ("root", "tip"):
        seen = poor.with_reference(frame).in_units("mm-t-s")
        silently(mech.add_flexible, f"bar {frame}", seen)
    silently(rom.export, poor, tmp_path / "bar.vtu")
    rows = (Row("free: worst error of 6 frequencies", 0.66, "<= 0.001", False),)
    told = r"fails in 1 of 1 rows; .*: 0.66, limit <= 0.001. Motions"
    for number in (1, 2):  # it is told once for each certificate
        bad = replace(poor, certificate=Report(f"{number} of {tmp_path}", rows))
        rom.save(bad, path)
        with pytest.warns(RomWarning, match=told):
            if number == 1:
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
