"""Models of the measured frames, beside closed forms."""

import numpy as np
import pytest
from measured import bumper, jim_beam, lanl, record
from numpy.testing import assert_allclose
from scipy.linalg import eigh

import rom

pytestmark = pytest.mark.fenicsx
E, T, W = 68.9e9, 6.35e-3, 0.0254


def sway_stiffness(clear, t=T):
    """Force per displacement of a column whose ends do not turn [N/m]."""
    body = lanl.column(2, t, E, 2700.0, clear, 3e-3)
    mech = rom.Mechanism(gravity=(0, 0, 0))
    part = mech.add_flexible("column", body)
    head = mech.design_point(part.marker("head"))
    mech.add_rigid("slide", mass=1e4, inertia=(1, 1, 1), at=head, markers={"centre": (0, 0, 0)})
    foot = part.marker("foot")
    mech.fixed("foot", mech.ground.marker(mech.design_point(foot)), foot)
    mech.fixed("head", part.marker("head"), mech.marker("slide.centre"))
    mech.prismatic("rail", mech.ground.marker(head), mech.marker("slide.centre"), axis=(1, 0, 0))
    return 1e4 * (2 * np.pi * rom.linearize(mech).frequencies[0]) ** 2


def test_a_column_sways_as_a_beam_a_little_longer_than_its_clear_height():
    """The cube root of the compliance grows with the length by that of 12 E I."""
    k = np.array([sway_stiffness(clear) for clear in (0.1524, 0.2286)])
    roots = (12 * E * W * T**3 / 12 / k) ** (1 / 3)
    assert_allclose(np.diff(roots), 0.0762, rtol=0.01)
    assert 0.1524 + 5e-3 < roots[0] < 0.1524 + 15e-3  # the clamp stiffens across, too


def test_the_frame_sways_as_four_masses_between_springs():
    """Its columns by what one of them takes; thin ones too, less than 1 % for what turns."""
    whole = lanl.frame(2, rails=1e-3)
    assert_allclose(sum(part.mass for part in whole.parts.values()),
                    2700 * (4 * 0.305**2 * 0.0254 + 12 * 0.1778 * T * W) + 0.8 + 0.253)  # fmt: skip
    full, thin = sway_stiffness(0.1524), sway_stiffness(0.1524, T / 2)
    assert_allclose(thin / full, 1 / 8, rtol=0.1)
    m = 2700 * 0.305**2 * 0.0254 + np.array([0.5, 0.1, 0.1, 0.353])
    links, columns = np.diff(np.eye(4), axis=0), {"S1": (0, 0, 0), "S5": (2, 0, 0), "S8": (0, 0, 1)}
    # columns that sway without turning at their ends, by the beam's own shape
    one, sums = 2700 * 0.1778 * T * W, np.abs(links)
    for name, few in columns.items():
        storeys = [4 * full - n * (full - thin) for n in few]
        own = np.diag([one * (4 - n / 2) for n in few])
        M = np.diag(m) + sums.T @ own @ sums / 4 + links.T @ own @ links * (13 / 35 - 1 / 4)
        lam = eigh(links.T @ np.diag(storeys) @ links, M, eigvals_only=True)[1:]
        for across in (False, True):
            found = lanl.state(2, name, across=across, rails=1e-3)
            assert_allclose(found, np.sqrt(lam) / 2 / np.pi, rtol=0.004 if name == "S1" else 0.01)


def test_a_mass_on_a_floor_lowers_frequencies_as_rayleigh_says():
    f, shapes = lanl.swaying(lanl.frame(2))
    m = bumper.masses(lanl.frame(2))
    for name, floor in (("S2", 0), ("S3", 1)):
        share = lanl.ADDED * shapes[floor] ** 2 / (m @ shapes**2)
        assert_allclose(lanl.state(2, name) / f, 1 / np.sqrt(1 + share), rtol=0.01)


def test_the_masses_on_the_rail_vibrate_as_the_whole_frame():
    lin, f = rom.linearize(bumper.chain()), lanl.swaying(lanl.frame(2))[0]
    assert_allclose(lin.frequencies[1:4], f, rtol=0.012)
    assert_allclose(lin.damping_ratios[1:4], (0.063, 0.020, 0.0097), rtol=0.2)


def test_a_pole_is_found_between_the_lines():
    f = np.arange(22, 90, 0.5)
    poles, ratios = np.array([30.13, 55.77]), (0.06, 0.02)
    shapes = np.array([[1, 0.4, -0.4, -1], [1, -1, -1, 1.0]])
    H = sum(
        np.outer(f**2 / (p**2 - f**2 + 2j * z * p * f), shape)
        for p, z, shape in zip(poles, ratios, shapes, strict=True)
    )
    assert_allclose(bumper.peaks(f, H, (30, 56)), poles, rtol=2e-3)


def test_random_force_has_its_size_in_its_band():
    x = bumper.excitation(20.0, np.random.default_rng(0))
    power, f = np.abs(np.fft.rfft(x)) ** 2, np.fft.rfftfreq(x.size, 1 / bumper.RATE)
    assert_allclose(np.sqrt(np.mean(x**2)), 20.0)
    assert power[(f >= 20) & (f <= 150)].sum() > (1 - 1e-12) * power.sum()


def test_a_stop_raises_peaks_the_more_the_smaller_its_gap():
    """Far apart the floors do not touch; always in touch they are joined by half of the stop."""
    near = rom.linearize(bumper.chain()).frequencies[1:4]
    f1, f2, f3 = (
        bumper.peaks(*bumper.response(1, gap, force=20.0), near) for gap in (None, 50.0, 0.05)
    )
    assert_allclose(f1, near, rtol=0.006)
    assert_allclose(f1, f2, rtol=1e-9)
    assert (f3 > 1.001 * f1).all()


def test_the_u_is_a_plane_frame_as_euler_and_bernoulli_have_it():
    """Beams along the middle of the sheets, corners included: modes in the plane of the U."""
    modulus, A, inertia, rho = 70e9, 0.15 * 0.01, 0.15 * 0.01**3 / 12, 2745.0
    x = np.vstack([
        [(0, z) for z in np.linspace(0.305, 0, 32)],
        [(x, 0) for x in np.linspace(0, 0.11, 12)][1:],
        [(0.11, z) for z in np.linspace(0, 0.305, 32)][1:],
    ])  # fmt: skip
    K, M = np.zeros((2, 3 * len(x), 3 * len(x)))
    for i, d in enumerate(np.diff(x, axis=0)):
        h = np.hypot(*d)
        c, s = d / h
        a, b = modulus * A / h, modulus * inertia / h**3
        k, m = np.zeros((2, 6, 6))
        k[np.ix_([0, 3], [0, 3])] = a * np.array([[1, -1], [-1, 1]])
        m[np.ix_([0, 3], [0, 3])] = rho * A * h / 6 * np.array([[2, 1], [1, 2]])
        across = np.ix_([1, 2, 4, 5], [1, 2, 4, 5])
        k[across] = b * np.array([
            [12, 6 * h, -12, 6 * h], [6 * h, 4 * h**2, -6 * h, 2 * h**2],
            [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h**2, -6 * h, 4 * h**2]])  # fmt: skip
        m[across] = rho * A * h / 420 * np.array([
            [156, 22 * h, 54, -13 * h], [22 * h, 4 * h**2, 13 * h, -3 * h**2],
            [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h**2, -22 * h, 4 * h**2]])  # fmt: skip
        R = np.kron(np.eye(2), [[c, s, 0], [-s, c, 0], [0, 0, 1]])
        some = np.ix_(np.arange(3 * i, 3 * i + 6), np.arange(3 * i, 3 * i + 6))
        K[some] += R.T @ k @ R
        M[some] += R.T @ m @ R
    beam = np.sqrt(eigh(K, M, eigvals_only=True)[3:7]) / 2 / np.pi
    kept = [one.value for one in record.read("jim_beam").values()]
    # sheets as wide as half of their length bend as plates, by up to 1 / sqrt(1 - nu^2)
    rise = np.array([kept[k] for k in (0, 2, 4, 6)]) / beam
    assert ((rise > 1.01) & (rise < 1.06)).all()
    mass = jim_beam.solid(1).M.sum() / 3
    assert_allclose(mass, rho * 0.15 * 0.01 * (2 * 0.31 + 0.1), rtol=1e-9)


@pytest.mark.long
def test_two_factors_do_not_explain_the_u_and_the_verdict_says_so():
    """Corners as stiff as a tenth, by rom.update; shapes agree, frequencies within 3 %."""
    family = jim_beam.family()
    found = rom.update(family, jim_beam.responses(family.at(corners=0.3)), damping=0.008)
    assert not found.verdict.ok
    assert_allclose([found.factors[name] for name in ("corners", "sheets")], (0.085, 0.959),
                    rtol=0.03)  # fmt: skip
    off = found.body.frequencies(10)[6:] / jim_beam.MEASURED - 1
    assert_allclose(100 * off, (2.3, -2.7, -0.7, 0.9), atol=0.3)
    for body in (family.at(), found.body):
        U, V = jim_beam.measured_shapes(), jim_beam.seen(body)[:, :4]
        mac = (U.T @ V) ** 2 / np.outer((U**2).sum(axis=0), (V**2).sum(axis=0))
        assert_allclose(np.diag(mac), (1.0, 0.999, 0.992, 0.998), atol=0.002)
        assert (mac - np.diag(np.diag(mac)) < 0.02).all()
