"""Rockfall galleries against Hertz, Navier, Zener, modal superposition and finite elements."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad, solve_ivp, trapezoid
from scipy.linalg import eigh
from scipy.sparse.linalg import splu
from scipy.special import gamma

import rom
from cases.paths import ROOT
from cases.refusals import refused
from cases.solid import _interface, block, reduced
from rom.components.rockfall import Cushion, CushionForce, Gallery, Shear, Slab, sensitivity, strike
from rom.eigen.verbs import mean_motion
from rom.errors import ConfigError, ModelError, SolverError

CONCRETE = rom.Material(E=30e9, nu=0.2, rho=2500.0)
DOWN = (0, 0, -1)
RIGID = {"shear": Shear(1e11, damping=0.0), "slab": Slab.of_mass(1e3, 1e11, damping=0.0)}


def baseline(**change):
    """An illustration; no measured gallery."""
    parts = Cushion.of_sand(4000.0, 1e6), Shear(2e9), Slab.of_mass(6000.0, 1.2e8)
    return replace(Gallery(4000.0, 15.0, 2500.0, *parts, weight=False), **change)


def stiff(boulder, height, lame, recovery=1.0):
    """A gallery so stiff that the cushion alone gives way, elastic as Hertz has it."""
    cushion = Cushion.of_sand(boulder, lame, recovery=recovery)
    return Gallery(boulder, height, 1e3, cushion, weight=False, **RIGID)


def test_cushion_loads_unloads_and_does_not_pull():
    c = Cushion(2e6, recovery=0.25)
    assert c.force(-0.1) == c.force(0.0) == 0.0
    assert c.force(0.4) == pytest.approx(2e6 * 0.4**1.5)
    assert c.force(0.3, 0.4) == 0.0  # three quarters of the penetration stay
    assert c.force(0.35, 0.4) == pytest.approx(c.force(0.4) * 0.5**1.5)
    elastic = Cushion(2e6, recovery=1.0)
    assert elastic.force(0.3, 0.4) == pytest.approx(elastic.force(0.3))


COMPACTED = [Cushion(2e6, limit=0.5, hardening=x) for x in (1.0, 0.5)]


@pytest.mark.parametrize("c", [Cushion(2e6), Cushion(2e6, exponent=1.0), *COMPACTED])
def test_penetration_takes_up_the_energy(c):
    for energy in (1e3, 1e5):
        d = c.penetration(energy)
        assert quad(c.force, 0, d)[0] == pytest.approx(energy, rel=1e-6)
    assert c.limit > d
    assert c.force(0.4) >= 2e6 * 0.4**c.exponent


@pytest.mark.parametrize(("tonnes", "height", "expected"), [
    (1, 10, 610), (3, 10, 1268), (5, 20, 2701), (10, 30, 5469)])  # fmt: skip
def test_the_handbook_formula_is_hertz(tonnes, height, expected):
    """P = 2.108 (m g)^(2/3) lame^(2/5) H^(3/5) in t, m, kN, at lame = 1 MPa."""
    found = {}
    for rock in (2600.0, 2650.0):
        c = Cushion.of_sand(1e3 * tonnes, 1e6, rock=rock)
        found[rock] = c.force(c.penetration(1e3 * tonnes * 9.81 * height)) / 1e3
    unit = (tonnes * 9.81) ** (2 / 3) * 1000**0.4 * height**0.6
    assert found[2600.0] == pytest.approx(expected, abs=0.6)
    assert found[2600.0] / unit == pytest.approx(2.10804, abs=5e-6)
    assert found[2650.0] / unit == pytest.approx(2.10536, abs=5e-6)


def test_a_rigid_gallery_is_struck_as_hard_and_as_long_as_hertz_says():
    """Twice the integral of dx / v sqrt(1 - x^(5/2)): quadrature, Gamma function, motion."""
    by_depth = quad(lambda u: 4 * u / np.sqrt(1 - (1 - u * u) ** 2.5), 0, 1)[0]  # x = 1 - u^2
    assert by_depth == pytest.approx(0.8 * np.sqrt(np.pi) * gamma(0.4) / gamma(0.9), rel=1e-10)
    assert by_depth == pytest.approx(2.943275, abs=5e-7)
    assert by_depth * 1.25**0.4 == pytest.approx(3.218, abs=5e-4)
    for boulder, height in ((5e3, 2.0), (1e3, 10.0)):
        g = stiff(boulder, height, 1e6)
        got, v = strike(g, t_end=0.2, keep=10**5), g.speed
        contact = got.t[np.flatnonzero(got.forces[:, 0] > 0)[-1]]
        depth = (5 * boulder * v**2 / (4 * g.cushion.stiffness)) ** 0.4
        assert contact == pytest.approx(by_depth * depth / v, rel=1e-3)
        assert got.deepest == pytest.approx(depth, rel=1e-3)
        assert got.v[-1, 0] == pytest.approx(-v, rel=1e-3)
    assert got.peaks[0] == pytest.approx(609.524e3, rel=1e-3)
    assert got.t[got.forces[:, 0].argmax()] == pytest.approx(0.042274, rel=1e-3)


@pytest.mark.parametrize(("name", "power"), [("height", 0.6), ("boulder", 2 / 3), ("lame", 0.4)])
def test_peaks_scale_as_hertz_says(name, power):
    first = {"boulder": 1e3, "height": 10.0, "lame": 1e6}
    cases = first, first | {name: 4 * first[name]}
    peaks = [strike(stiff(**case)).peaks[0] for case in cases]
    assert peaks[1] / peaks[0] == pytest.approx(4.0**power, rel=2e-3)


@pytest.mark.parametrize("recovery", [1.0, 0.5, 0.1])
def test_the_square_of_the_rebound_is_what_the_cushion_gives_back(recovery):
    g = stiff(1e3, 10.0, 1e6, recovery=recovery)
    got = strike(g, t_end=0.1)
    assert got.v[-1, 0] == pytest.approx(-g.speed * np.sqrt(recovery), rel=3e-3)
    lost = got.energy[-1, 1] / got.energy[0, 0]
    assert lost == pytest.approx(1 - recovery, abs=5e-3)


def test_the_illustration_has_the_numbers_of_an_independent_program():
    """Another program, another integrator; it damps shear and bending alike."""
    got = strike(baseline())
    assert_allclose(got.peaks / 1e3, [1923, 1941, 2046], rtol=4e-4)
    assert got.deepest == pytest.approx(0.742, abs=5e-4)
    assert 1e3 * got.deflection == pytest.approx(17.0, abs=0.05)
    assert got.state == "whole" and got.plastic == 0.0


def test_three_springs_move_as_their_modes_say():
    k1, k2, k3 = 5e6, 2e9, 1.2e8
    springs = {"cushion": Cushion(k1, exponent=1.0, recovery=1.0), "shear": Shear(k2, damping=0.0)}
    g = baseline(**springs, slab=Slab.of_mass(6000.0, k3, damping=0.0))
    got = strike(g, t_end=0.08, dt=2e-6)
    K = np.array([[k1, -k1, 0], [-k1, k1 + k2, -k2], [0, -k2, k2 + k3]])
    M = np.diag([4000.0, 2500.0, 6000.0])
    lam, V = eigh(K, M)
    omega = np.sqrt(lam)
    start = V.T @ M @ [g.speed, 0, 0]
    exact = (start * np.sin(np.outer(got.t, omega)) / omega) @ V.T
    assert (exact[1:, 0] > exact[1:, 1]).all()  # still in touch
    assert_allclose(got.z, exact, atol=1e-6 * np.abs(exact).max())
    speeds = (start * np.cos(np.outer(got.t, omega))) @ V.T
    assert_allclose(got.v, speeds, atol=1e-5 * g.speed)


@pytest.mark.parametrize("weight", [False, True])
@pytest.mark.parametrize(
    "change",
    [
        {"shear": Shear(2e9, damping=0.0), "slab": Slab.of_mass(6e3, 1.2e8, damping=0.0)},
        {},
        {"cushion": Cushion.of_sand(4e3, 1e6, recovery=0.2, limit=1.2, hardening=1.0)},
        {"slab": Slab.of_mass(6e3, 1.2e8, capacity=1.2e6)},
        {"slab": Slab(np.array([0.01, -0.004, 0.008]), np.array([120.0, 300.0, 900.0]))},
    ],
)
def test_no_energy_comes_from_nowhere(change, weight):
    g = baseline(weight=weight, **change)
    errors = []
    for dt in (2e-5, 5e-6):
        got = strike(g, t_end=0.1, dt=dt)
        errors.append(np.abs(got.balance).max() / got.energy[0, 0])
    assert errors[1] < 2e-5
    assert errors[1] < 0.3 * errors[0]
    assert got.energy[0, 0] == pytest.approx(0.5 * 4000 * g.speed**2)


def test_impulses_are_changes_of_momentum():
    g = baseline(slab=Slab.of_mass(6000.0, 1.2e8, damping=0.0))
    got = strike(g, t_end=0.12, keep=10**5)
    J = trapezoid(got.forces, got.t, axis=0)
    momentum = np.array([4000.0, 2500.0, 6000.0]) * (got.v[-1] - got.v[0])
    assert_allclose([-J[0], J[0] - J[1], J[1] - J[2]], momentum, atol=2e-4 * 4000 * g.speed)


def test_modal_coordinates_of_the_slab_answer_its_force_and_add_up_to_its_deflection():
    slab = Slab(np.array([0.02, 0.015, 0.01]), np.array([150.0, 420.0, 900.0]), damping=0.0)
    got = strike(baseline(slab=slab), t_end=0.05)
    assert_allclose(got.modal @ slab.phi, got.z[:, 2], atol=1e-12)
    for k, (phi, omega) in enumerate(zip(slab.phi, slab.omega, strict=True)):
        late = omega * (got.t[-1] - got.t)
        duhamel = trapezoid(phi * got.forces[:, 1] * np.sin(late), got.t) / omega
        assert got.modal[-1, k] == pytest.approx(duhamel, rel=2e-3)


def test_a_yielding_slab_dissipates_its_capacity_times_what_stays():
    slab = Slab.of_mass(6000.0, 1.2e8, damping=0.0, capacity=1.2e6)
    got = strike(baseline(slab=slab), t_end=0.2)
    assert got.plastic > 0.005
    assert got.energy[-1, 5] == pytest.approx(1.2e6 * got.plastic, rel=1e-9)
    assert got.peaks[2] == pytest.approx(1.2e6, rel=1e-9)
    late = got.t > 0.15
    assert abs(got.z[late, 2].mean() - got.plastic) < 0.1 * got.deflection  # swings about it


def test_a_plastic_slab_stops_as_a_rigid_plastic_one():
    """One heavy mass thrown onto a slab without elasticity: way = m v^2 / 2 F_y."""
    slab = Slab.of_mass(10.0, 1e10, damping=0.0, capacity=1e6)
    cushion = Cushion(1e10, 1.0, recovery=1.0)
    got = strike(Gallery(1e3, 5.0, 10.0, cushion, Shear(1e10), slab, False), t_end=0.03)
    assert got.plastic == pytest.approx(1e3 * 9.81 * 5.0 / 1e6, rel=0.02)


def test_concrete_cracks_reinforcement_holds_or_fails():
    whole = strike(baseline())
    assert whole.peaks[1] > 1.5e6
    cracked = strike(baseline(shear=Shear(2e9, 1.5e6, reinforced=1e8)))
    assert cracked.state == "cracked"
    bent = cracked.z[:, 1] - cracked.z[:, 2]
    assert bent.max() > 10 * (whole.z[:, 1] - whole.z[:, 2]).max()
    after = cracked.t > cracked.t[np.argmax(bent > 1e-3)]  # it cracks at 0.75 mm
    assert_allclose(cracked.forces[after, 1], 1e8 * bent[after], rtol=1e-9)
    punched = strike(baseline(shear=Shear(2e9, 1.5e6, reinforced=1e8, ultimate=0.01)))
    assert punched.state == "punched"
    assert (punched.forces[-100:, 1] == 0.0).all()
    assert punched.z[-1, 1] > 0.1


def test_a_boulder_in_a_cushion_of_air_falls_freely():
    g = replace(stiff(1e3, 10.0, 1e6), cushion=Cushion(1e-9), weight=True)
    got = strike(g, t_end=0.05, dt=1e-5)
    assert_allclose(got.z[:, 0], g.speed * got.t + 0.5 * 9.81 * got.t**2, atol=1e-10)


def test_the_plug_rings_down_at_its_share_of_critical_damping():
    rigid = Slab.of_mass(1e6, 1e13, damping=0.0)
    g = Gallery(100.0, 1.0, 1e3, Cushion(1e9), Shear(1e8, damping=0.05), rigid, weight=False)
    z = strike(g, t_end=0.2, keep=10**5).z[:, 1]
    peaks = z[1:-1][(z[1:-1] > z[:-2]) & (z[1:-1] >= z[2:])]
    decrement = 2 * np.pi * 0.05 / np.sqrt(1 - 0.05**2)
    assert_allclose(np.log(peaks[1:-1] / peaks[2:]), decrement, rtol=5e-3)
    assert peaks.size > 5


def test_a_slab_yields_upwards_as_well():
    slab = Slab.of_mass(1e3, 1e8, damping=0.0, capacity=6e5)
    springs = Cushion(1e9, recovery=1.0), Shear(3e7, damping=0.0), slab
    g = Gallery(300.0, 1.0, 500.0, *springs, weight=False)
    got = strike(g, t_end=0.6, keep=10**4)
    assert got.forces[:, 2].min() == pytest.approx(-6e5, rel=1e-9)
    assert got.plastic < -2e-4
    assert got.energy[-1, 5] > 6e5 * abs(got.plastic)
    assert np.abs(got.balance).max() < 2e-3 * got.energy[0, 0]


def plate(side, rigidity, mass, n):
    """Navier's simply supported square plate struck at its centre, n half waves."""
    odd = np.arange(1, n + 1, 2)
    waves = np.add.outer(odd**2, odd**2).ravel()
    omega = np.pi**2 * waves / side * np.sqrt(rigidity / mass)
    return Slab(np.full(waves.size, 2 / np.sqrt(mass)), omega, damping=0.0)


def test_one_mode_of_a_plate_is_an_eighth_too_stiff():
    """w = alpha P a^2 / D: what constraint modes are for."""
    side, D, mass = 5.0, 4e7, 1.5e4
    alpha = [D / side**2 / plate(side, D, mass, n).stiffness for n in (1, 401)]
    assert alpha == pytest.approx([0.010266, 0.011601], abs=1e-6)
    one = plate(side, D, mass, 1)
    assert one.phi[0] ** -2 == pytest.approx(mass / 4)
    assert one.omega[0] == pytest.approx(2 * np.pi**2 * np.sqrt(D * side**2 / mass) / side**2)


def test_a_wide_plate_is_a_dashpot_before_its_edges_answer():
    """Zener: under a force F a thin infinite plate gives way with the speed F / 8 sqrt(D rho h)."""
    side, D, mass = 8.0, 4.0e7, 8.0**2 * 625.0
    g = Gallery(500.0, 2.0, 1.0, Cushion(4e8, recovery=1.0), Shear(5e9, damping=0.0),
                plate(side, D, mass, 81), weight=False)  # fmt: skip
    got = strike(g, t_end=0.006)
    c = 8 * np.sqrt(D * 625.0)

    def rates(_, y):
        F = 4e8 * max(y[0] - y[1], 0.0) ** 1.5
        return [y[2], F / c, -F / 500.0]

    y = solve_ivp(rates, (0, 0.006), [0, 0, g.speed], t_eval=got.t, rtol=1e-9, atol=1e-12).y
    F = 4e8 * np.maximum(y[0] - y[1], 0) ** 1.5
    assert got.peaks[0] == pytest.approx(F.max(), rel=0.02)
    assert got.peaks[0] < 0.9 * 4e8 * g.cushion.penetration(500 * 9.81 * 2.0) ** 1.5
    assert_allclose(got.forces[:, 0], F, atol=0.03 * F.max())


ENDS = ("root", "tip")


@pytest.fixture(scope="module")
def slab_model():
    """A concrete strip on both ends with a patch in the middle of its top."""
    model = block((4.0, 1.0, 0.3), (8, 2, 2), CONCRETE)
    number = np.arange(len(model.points)).reshape(9, 3, 3)
    patch = _interface("impact", number[3:6, :, -1], model.points, np.array([0.5, 0.5]))
    return replace(model, interfaces=model.interfaces | {"impact": patch})


@pytest.fixture(scope="module")
def slab_body(slab_model):
    kinds = {"impact": "rbe3", "root": "rbe2", "tip": "rbe2"}
    return reduced(10, slab_model, interfaces=kinds)


def on_strip(slab):
    cushion = Cushion.of_sand(800.0, 4e6)
    return Gallery(800.0, 8.0, 300.0, cushion, Shear(5e8, damping=0.0), slab, weight=False)


def test_ten_modes_of_a_reduced_slab_bend_as_all_of_the_finite_elements(slab_model, slab_body):
    own = Slab.of_body(slab_body, "impact", ENDS, damping=0.02)
    held = sum(slab_model.interfaces[name].dofs.size for name in ENDS)
    modes = rom.modes(slab_model, slab_model.n_dofs - held, fixed=ENDS)
    at = slab_model.interfaces["impact"]
    full = Slab(-mean_motion(at)[2] @ modes.shapes[at.dofs], modes.omega, damping=0.02)
    assert own.stiffness == pytest.approx(full.stiffness, rel=1e-9)  # statics are exact
    ours, exact = (strike(on_strip(slab), t_end=0.06) for slab in (own, full))
    assert ours.deflection == pytest.approx(exact.deflection, rel=1e-3)
    assert_allclose(ours.peaks, exact.peaks, rtol=3e-3)
    few = Slab.of_body(slab_body, "impact", ENDS, n=10, damping=0.02)
    assert few.omega.size == 10
    assert strike(on_strip(few), t_end=0.06).deflection == pytest.approx(exact.deflection, rel=0.01)


def test_a_reduced_slab_yields_at_its_capacity(slab_body):
    bounded = Slab.of_body(slab_body, "impact", ENDS, damping=0.0, capacity=2e5)
    got = strike(on_strip(bounded))
    assert got.peaks[2] == pytest.approx(2e5, rel=1e-9)
    assert got.energy[-1, 5] == pytest.approx(2e5 * got.plastic, rel=1e-9) and got.plastic > 0
    assert strike(on_strip(replace(bounded, capacity=np.inf))).peaks[2] > 4e5


def test_three_masses_are_the_first_mode_of_the_slab(slab_body):
    all_modes = Slab.of_body(slab_body, "impact", ENDS)
    k = int(np.argmax((all_modes.phi / all_modes.omega) ** 2))
    m3 = all_modes.phi[k] ** -2.0
    one = Slab.of_mass(m3, m3 * all_modes.omega[k] ** 2)
    assert 0.3 * slab_body.mass < m3 < 0.6 * slab_body.mass
    assert one.stiffness > all_modes.stiffness
    three, all_ = (strike(on_strip(slab), t_end=0.06) for slab in (one, all_modes))
    assert three.deflection == pytest.approx(all_.deflection, rel=0.25)
    assert three.deflection < all_.deflection


def thrown(mech, law, plug, boulder, speed):
    """A boulder on its way to a plug: mass and place of both, a law between them; the plug."""
    centre, fall = {"c": (0, 0, 0)}, (0, 0, -speed)
    (m, x), (M, y) = plug, boulder
    plug = mech.add_rigid("plug", mass=m, inertia=(50,) * 3, at=x, markers=centre)
    how = {"at": y, "velocity": fall, "markers": centre}
    boulder = mech.add_rigid("boulder", mass=M, inertia=(100,) * 3, **how)
    mech.user_force("cushion", law, boulder.marker("c"), plug.marker("c"))
    return plug


@pytest.mark.parametrize("recovery", [1.0, 0.3])
def test_a_mechanism_of_bodies_says_the_same(slab_body, recovery):
    slab = Slab.of_body(slab_body, "impact", ENDS, damping=0.0)
    g = on_strip(slab)
    g = replace(g, cushion=replace(g.cushion, recovery=recovery))
    mech = rom.Mechanism(gravity=(0, 0, 0))
    strip = mech.add_flexible("strip", slab_body)
    for name in ENDS:
        at = slab_body.marker(name).point
        mech.fixed(name, mech.ground.marker(at), strip.marker(name))
    at = slab_body.marker("impact").point
    law = CushionForce(g.cushion, DOWN, gap=1.0)
    rise = np.array([0, 0, 0.5])
    plug = thrown(mech, law, (g.plug, at + rise), (g.boulder, at + 3 * rise), g.speed)
    mech.spring_damper("shear", strip.marker("impact"), plug.marker("c"), stiffness=5e8)
    sol = rom.simulate(mech, t_end=0.05, dt=2e-5)
    got = strike(g, t_end=0.05, dt=1e-6, keep=50_000)
    z = np.column_stack([np.interp(sol.t, got.t, column) for column in got.z.T])
    places = sol.position("boulder"), sol.position("plug"), sol.position("strip", "impact")
    found = np.column_stack([p[0, 2] - p[:, 2] for p in places])
    for k in range(3):
        assert_allclose(found[:, k], z[:, k], atol=3e-3 * np.abs(z[:, k]).max())
    assert law.deepest == pytest.approx(got.deepest, rel=1e-3)
    assert found[:, 2].max() == pytest.approx(got.deflection, rel=2e-3)


@pytest.mark.long
@pytest.mark.fenicsx
def test_the_slab_of_dolfinx_bends_as_its_unreduced_elements():
    sizes = {"lc": 0.5, "patch": 1.0}
    model = rom.fe.model(ROOT / "meshes/gallery_slab.geo", material=CONCRETE, parameters=sizes)
    supports = ("support_left", "support_right")
    kinds = {"impact": "rbe3"} | dict.fromkeys(supports, "rbe2")
    body = rom.reduce(model, method=rom.CraigBampton(10), interfaces=kinds, certify=False)
    assert body.mass == pytest.approx(4.5 * 3.5 * 0.25 * 2500, rel=1e-9)
    slab = Slab.of_body(body, "impact", supports, damping=0.0)
    got = strike(baseline(slab=slab), t_end=0.06, keep=3000)
    h = 1e-4
    t = h * np.arange(601)
    F = np.interp(t, got.t, got.forces[:, 1])
    patch = model.interfaces["impact"]
    held = np.concatenate([model.interfaces[name].dofs for name in supports])
    free = np.setdiff1d(np.arange(model.n_dofs), held)
    C = np.zeros(model.n_dofs)
    C[patch.dofs] = -mean_motion(patch)[2]
    C, K, M = C[free], *(A.tocsr()[free][:, free] for A in (model.K, model.M))
    assert slab.stiffness == pytest.approx(1 / (C @ splu(K.tocsc()).solve(C)), rel=1e-8)
    solve = splu((M + h**2 / 4 * K).tocsc()).solve
    u, v, a = np.zeros((3, free.size))
    deflection = []
    for force in F[1:]:
        u, v = u + h * v + h**2 / 4 * a, v + h / 2 * a
        a = solve(C * force - K @ u)
        u, v = u + h**2 / 4 * a, v + h / 2 * a
        deflection.append(C @ u)
    assert max(deflection) == pytest.approx(got.deflection, rel=0.01)


def test_parameters_are_varied_one_at_a_time_and_the_cushion_decides_over_the_peaks():
    found = sensitivity(baseline(), lambda g: strike(g, t_end=0.1).peaks[0], (0.5, 2.0))
    cushion = np.ptp(found["stiffness of the cushion"])
    assert_allclose(found["stiffness of the cushion"], [0.5**0.4 - 1, 2**0.4 - 1], atol=0.05)
    for name in ("mass of the plug", "stiffness in shear", "stiffness in bending"):
        assert np.ptp(found[name]) < 0.15 * cushion
    assert np.ptp(found["damping of the slab"]) < 0.15 * cushion
    assert np.ptp(found["height of the fall"]) > cushion
    seen = sensitivity(baseline(), lambda g: g.slab.stiffness, (0.5, 2.0))
    assert_allclose(seen.pop("stiffness in bending"), [-0.5, 1.0], rtol=1e-12)
    assert all((np.abs(change) < 1e-12).all() for change in seen.values())


test_messages_name_what_is_wrong = refused(
    (lambda: Slab(np.zeros(2), np.ones(2)), ModelError, "moves under the plug"),
    (lambda: Slab(np.array([np.nan]), np.ones(1)), ModelError, "not finite"),
    (lambda: Slab(np.ones(2), np.array([0.0, 1.0])), ModelError, "supports that hold it"),
    (lambda: strike(baseline(), dt=0.01, t_end=20.0), SolverError, "grows without bound"),
    (lambda: Cushion(1.0).penetration(-3.0), ConfigError, "energy = -3 must not be negative"),
    (lambda: CushionForce(Cushion(1.0), (0, 0, 0), gap=1.0), ConfigError, "down"),
)


def struck_aside(aside, **more):
    """A boulder that falls onto a plug at rest, so far aside of its middle [m]."""
    mech, place = rom.Mechanism(gravity=(0, 0, 0)), (0.6 * aside, 0.8 * aside, 1)
    law = CushionForce(Cushion.of_sand(1e3, 1e6), DOWN, gap=0.9, **more)
    thrown(mech, law, (5e3, (0, 0, 0)), (1e3, place), 10.0)
    return rom.simulate(mech, t_end=0.03, dt=5e-4).velocity("boulder")[-1, 2]


def test_a_boulder_beside_the_slab_is_named():
    inside = struck_aside(1.9, reach=2.0)
    assert inside > -9.9
    assert inside == struck_aside(1.9)
    with pytest.raises(ConfigError, match=r"down 2\.1 m aside at t = 0\.01\d* s, beyond the slab"):
        struck_aside(2.1, reach=2.0)
