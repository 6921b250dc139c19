"""Modes of one support alone, or of none: right there, and refused where joints hold otherwise."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from benchmarks.models import KINDS, bar
from cases.refusals import refuses
from rom.errors import ConfigError, InterfaceError, ModelError

SIZE = (1.0, 0.03, 0.01)
UNIT = np.sqrt(210e9 * SIZE[2] ** 2 / (12 * 7850.0)) / (2 * np.pi)  # sqrt(EI / m) / L^2
PINNED = {"root": "xyz rx rz", "tip": "yz rx rz"}
MODEL = bar(SIZE, (16, 1, 1), rom.Material(E=210e9, nu=0.0, rho=7850.0))


def reduced(model, n, fixed=None, **more):
    method = rom.AssumedModes(n, fixed=fixed)
    return rom.reduce(model, method=method, interfaces=KINDS, **{"certify": False, **more})


@pytest.mark.parametrize(
    ("reference", "root"),
    [("root", 1.875104), ("tip", 1.875104), (("root", "tip"), np.pi), ("mean-axis", 4.730041)],
)
def test_the_reference_says_what_the_modes_obey(reference, root):
    """The frame at rest, its coordinates alone vibrate: the beam in that support."""
    body = reduced(MODEL, 3, reference=reference)
    assert_allclose(body.omega[0] / (2 * np.pi), root**2 * UNIT, rtol=2e-3)
    assert body.has_static_shapes == (reference != "mean-axis")


def test_shapes_obey_the_condition_and_the_frame_beside_it_is_free():
    clamped = reduced(MODEL, 4, ("root", "tip"))
    for name in ("root", "tip"):
        moved = clamped.with_reference("root").marker(name)
        assert np.abs(moved.translation).max() < 1e-9  # of shapes of about one
        assert np.abs(moved.rotation).max() < 1e-8
    one = reduced(MODEL, 6, PINNED, reference="root")
    other = reduced(MODEL, 6, PINNED)
    for fixed in ((), PINNED, ("root",)):
        f = [x.frequencies(4, fixed=fixed) for x in (one, other)]
        assert_allclose(f[0], f[1], rtol=1e-6)


@pytest.mark.parametrize("n", [4, 8, 12])
def test_a_twist_held_at_both_ends_is_held_once_by_modes_that_do_not_twist(n):
    """Few cantilever modes bend only: their twist is an error, and no condition for them."""
    body = reduced(MODEL, n, ("root",))
    f = [body.with_reference(r).frequencies(2, fixed=PINNED) for r in ("root", "tip", "mean-axis")]
    assert_allclose(f[1:], [f[0], f[0]], rtol=1e-9)
    assert np.pi**2 * UNIT < f[0][0] < 1.02 * np.pi**2 * UNIT


def test_a_repeated_frequency_is_kept_whole():
    assert reduced(bar((1.0, 0.02, 0.02), (8, 1, 1)), 1, ("root",)).n_modes == 2


def in_joints(model, body, motion=lambda t: 0.0 * t):
    """On a hinge and a support that slides, both on a table that a drive shakes."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    marks = {"centre": (0, 0, 0), "left": (0, 0, 0), "right": (1, 0, 0)}
    table = mech.add_rigid("table", mass=50, inertia=(9, 9, 9), at=(0, 0, 0), markers=marks)
    mech.prismatic("guide", mech.ground.marker((0, 0, 0)), table.marker("centre"), axis=(0, 0, 1))
    beam = mech.add_flexible("beam", body, at=-body.marker("root").point)
    mech.revolute("hinge", table.marker("left"), beam.marker("root"), axis=(0, 1, 0))
    mech.point_on_plane("slide", table.marker("right"), beam.marker("tip"), normal=(0, 0, 1))
    mech.drive("shaker", "guide", motion)
    return mech, beam.marker("root")


def sweep(t):
    begun = min(1.0, 5 * t)
    phase = 2 * np.pi * (20.0 * t + 4.0 * t**2)
    return 2e-4 * begun**3 * (10 - 15 * begun + 6 * begun**2) * np.sin(phase)


def test_one_resonance_in_time_and_by_linearisation():
    """Pinned and clamped modes, whose own frequencies differ by 2.8, and Craig-Bampton."""
    methods = (rom.AssumedModes(4, PINNED), rom.AssumedModes(24, ("root",)), rom.CraigBampton(4))
    how = {"interfaces": KINDS, "damping": rom.Rayleigh(0.0, 3e-4), "certify": False}
    bodies = [rom.reduce(MODEL, method=method, **how) for method in methods]
    found, slopes, answers = [], [], []
    for body in bodies:
        still, root = in_joints(MODEL, body)
        roots = rom.linearize(still).eigenvalues
        found.append(np.abs(roots[roots.imag > 0][0]) / (2 * np.pi))
        f = np.linspace(20.0, 28.0, 9)
        answers.append(rom.transmissibility(still, None, f, drive="shaker", motion=root)[:, 4])
        sol = rom.simulate(in_joints(MODEL, body, sweep)[0], t_end=0.8, dt=1e-3)
        slopes.append(sol.axes("beam", "root")[:, 0, 2])
    assert_allclose(found, np.pi**2 * UNIT, rtol=2e-3)
    for series in (slopes, answers):
        largest = np.abs(series[0]).max()
        assert largest > 1e-3
        for other in series[1:]:
            assert_allclose(other, series[0], atol=3e-3 * largest)


def test_modes_clamped_at_both_ends_never_bend_in_hinges():
    """With no slope at the ends the beam stays as stiff as clamped: (4.730 / pi)^2."""
    for n in (1, 12):
        f = reduced(MODEL, n, ("root", "tip")).frequencies(1, fixed=PINNED)[0]
        assert_allclose(f, 4.730041**2 * UNIT, rtol=8e-3)


def test_craig_bampton_of_equal_size_is_exact_in_statics_and_no_better_in_its_modes():
    """Tip of a clamped beam, L^3 / 3 EI; assumed modes miss the part of those left out."""
    missed = {}
    for n in (8, 16):
        bampton = rom.reduce(MODEL, method=rom.CraigBampton(n - 6), interfaces=KINDS,
                             reference="root", certify=False)  # fmt: skip
        plain = reduced(MODEL, n, reference="root")
        for name, body in (("bampton", bampton), ("plain", plain)):
            tip = body.marker("tip").translation[2]
            compliance = tip @ np.linalg.solve(body.K, tip)
            missed[name, n] = 1 - compliance / (1 / (3 * 210e9 * 0.03 * 0.01**3 / 12))
        f = rom.modes(MODEL, 4, fixed=("root",), interfaces=KINDS).frequencies
        assert_allclose(plain.frequencies(4, fixed=("root",)), f, rtol=1e-7)
        assert np.abs(bampton.frequencies(4, fixed=("root",)) / f - 1).max() > 1e-5
    assert abs(missed["bampton", 8] - missed["bampton", 16]) < 1e-9
    assert 1e-4 < missed["plain", 8] - missed["bampton", 8] < 1e-3
    assert 0 < missed["plain", 16] - missed["bampton", 8] < 2e-4


def test_the_certificate_says_where_such_a_body_is_right():
    rows = {row.quantity: row for row in
            reduced(MODEL, 6, reference="root", certify=True).certificate.rows}  # fmt: skip
    assert rows["root held: worst error of 6 frequencies"].ok
    assert rows["root held: lowest MAC of 6 shapes"].ok
    assert not any("estimated" in quantity for quantity in rows)  # it needs constraint modes
    assert not rows["tip held: worst error of 6 frequencies"].ok
    assert not rows["root held: static flexibility of the interfaces"].ok


def test_wrong_wishes_are_refused():
    clamped, three = {"reference": "root"}, ("root", "tip", "root")
    many = "n_modes = 100000 must be .* the dofs that supports leave"
    refuses(ConfigError, many, reduced, MODEL, 10**5, **clamped)
    refuses(InterfaceError, "'foot'", reduced, MODEL, 2, {"foot": "x"})
    refuses(InterfaceError, "of six motions to the body", reduced, MODEL, 2, {"root": "xyz"})
    refuses(ConfigError, "does not say what the modes", reduced, MODEL, 2, reference=three)
    refuses(ModelError, "free-free modes only", in_joints, MODEL, reduced(MODEL, 2))


THIN = (1.0, 0.02, 0.01)


@pytest.fixture(scope="module")
def body():
    return rom.reduce(bar(THIN, (20, 1, 1)), method=rom.FreeFree(4), interfaces=KINDS)


def test_a_free_body_has_its_frequencies_and_a_certificate(body, tmp_path):
    full = rom.modes(bar(THIN, (20, 1, 1)), 10, interfaces=KINDS).frequencies
    assert body.frequencies()[:6] == pytest.approx(0.0)
    assert body.frequencies()[6:] == pytest.approx(full[6:], rel=1e-8)
    assert body.certificate.ok, body.certificate
    # Euler and Bernoulli: (4.730041)^2 sqrt(E I / (m L^4)), bending about the thin side first
    bending = 4.730041**2 * np.sqrt(210e9 * THIN[2] ** 2 / (12 * 7850.0)) / (2 * np.pi)
    assert body.frequencies()[6] == pytest.approx(bending, rel=0.01)
    refuses(ModelError, "free-free modes only; with 'root' held", body.frequencies, fixed=("root",))
    rom.save(body, tmp_path / "free.rom.npz")
    assert not rom.load(tmp_path / "free.rom.npz").has_static_shapes


@pytest.mark.parametrize("joint", ["fixed", "revolute", "cylindrical", "prismatic"])
def test_joints_that_transmit_moments_are_refused(body, joint):
    mech = rom.Mechanism()
    bar = mech.add_flexible("bar", body)
    axis = {} if joint == "fixed" else {"axis": (0, 0, 1)}
    clamp, said = ("clamp", mech.ground.marker((0, 0, 0)), bar.marker("root")), "transmits moments"
    refuses(ModelError, f"{joint} joint 'clamp' {said}", getattr(mech, joint), *clamp, **axis)
    mech.spherical(*clamp)
