"""Frequencies of finite element models against closed forms and published benchmarks."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh
from scipy.optimize import brentq
from scipy.sparse.linalg import eigsh

import rom
from cases.boxes import box, faces_held
from cases.long import few
from cases.solid import STEEL
from rom.eigen.verbs import rigid_motions

pytest.importorskip("dolfinx", reason="dolfinx is not installed")
pytestmark = [pytest.mark.fenicsx, pytest.mark.filterwarnings("ignore:linear tetrahedra")]

from rom.fe.elasticity import assemble, model  # noqa: E402

NAFEMS = rom.Material(E=200e9, nu=0.3, rho=8000.0)  # all benchmarks below
PLATE = {"x0": (1, 2), "x1": (1, 2), "y0": (0, 2), "y1": (0, 2)}  # simply supported as a solid


def hertz(finite_elements, held, m):
    omega, Phi = finite_elements.operators.modes(held, m)
    return omega / (2 * np.pi), Phi


@pytest.mark.parametrize(
    ("degree", "cells", "rtol"), few(1, [(2, (16, 16, 2), 3e-4), (3, (8, 8, 2), 1e-6)])
)
def test_thick_plate_has_the_exact_frequencies_of_elasticity(degree, cells, rtol):
    """Separation in sines and cosines, spectral over the thickness: exact in three dimensions."""
    exact = [45.97121156, *[109.85686161] * 2, *[155.04341824] * 2, 168.8192942]
    exact += [*[205.86461205] * 2, 219.26450483]
    mesh, _ = box((10.0, 10.0, 1.0), cells)
    plate = assemble(mesh, material=NAFEMS, degree=degree)
    found, _ = hertz(plate, faces_held(plate, PLATE), 9)
    assert_allclose(found[0], exact[0], rtol=rtol)
    assert_allclose(found, exact, rtol=100 * rtol if degree == 3 else 5 * rtol)
    assert np.all(found > np.array(exact) * (1 - 1e-9))  # conforming elements are too stiff


@pytest.mark.parametrize(("degree", "cells", "order"), [(1, (4, 8, 12), 2.0), (2, (2, 3, 4), 4.0)])
def test_eigenvalues_converge_with_twice_the_degree(degree, cells, order):
    """Mode u_x = sin(pi y) of a supported cube: lambda = (G / rho) pi^2, on tetrahedra."""
    exact = NAFEMS.stiffness[3, 3] / NAFEMS.rho * np.pi**2
    errors = []
    for n in cells:
        mesh, _ = box((1.0, 1.0, 1.0), (n, n, n), "tetrahedron")
        cube = assemble(mesh, material=NAFEMS, degree=degree)
        lam = cube.operators.modes(faces_held(cube, PLATE), 6)[0] ** 2
        errors.append(lam[lam > exact * (1 - 1e-9)].min() / exact - 1)
    slope = -np.polyfit(np.log(cells), np.log(errors), 1)[0]
    assert_allclose(slope, order, atol=0.1 * order)


def test_tapered_membrane_fv32():
    """NAFEMS FV32 with its converged three-dimensional values; u_z = 0 on the bottom face."""
    mesh, _ = box((10.0, 1.0, 0.05), (16, 8, 1))
    x = mesh.geometry.x
    x[:, 1] = (x[:, 1] - 0.5) * (5.0 - 0.4 * x[:, 0])
    membrane = assemble(mesh, material=NAFEMS)
    nodes = np.flatnonzero(np.abs(membrane.points[:, 0]) < 1e-9)
    flat = 3 * np.flatnonzero(np.abs(membrane.points[:, 2]) < 1e-9) + 2
    held = np.union1d(flat, (3 * nodes[:, None] + np.arange(2)).ravel())
    expected = [44.618, 130.013, 162.690, 245.992, 379.729, 391.405]
    assert_allclose(hertz(membrane, held, 6)[0], expected, rtol=1e-3)


def fraction_in(finite_elements, Phi, fields):
    """(m,) share of the mass-normalised modes that lies in the span of some fields."""
    M = finite_elements.M
    lam, U = eigh(fields.T @ (M @ fields))
    kept = lam > 1e-10 * lam[-1]
    basis = fields @ (U[:, kept] / np.sqrt(lam[kept]))
    return ((basis.T @ (M @ Phi)) ** 2).sum(axis=0)


CYLINDER = """
R = DefineNumber[1.8];
Point(1) = {1.8, 0, 0}; Point(2) = {2.2, 0, 0}; Line(1) = {1, 2};
s[] = Extrude {{0, 0, 1}, {0, 0, 0}, Pi/2} { Line{1}; Layers{6}; Recombine; };
v[] = Extrude {0, 0, 5} { Surface{s[1]}; Layers{14}; Recombine; };
Physical Volume("body") = {v[1]};
"""


@pytest.mark.parametrize(("order", "rtol"), [(2, 2e-4), (1, 6e-3)])
def test_axisymmetric_modes_of_a_free_cylinder_fv41(tmp_path, order, rtol):
    """NAFEMS FV41, values of converged axisymmetric elements; a quarter of half the cylinder."""
    # modes even and odd about the middle by a support each; odd ones can slide: negative shift
    path = tmp_path / "cylinder.geo"
    path.write_text(CYLINDER)
    quarter = model(path, material=NAFEMS, order=order)
    assert quarter.provenance["cells"] == {"hexahedron": 84}
    R, volume = rigid_motions(quarter.points), np.pi / 4 * (2.2**2 - 1.8**2) * 5
    assert np.abs(quarter.K @ R).max() < 1e-10 * abs(quarter.K).max()
    assert order == 1 or quarter.mass() == pytest.approx(8000.0 * volume, rel=1e-5)
    x, y, z = quarter.points.T
    r = np.hypot(x, y)
    radial = np.column_stack([x / r, y / r, 0 * z]).ravel()
    axial = np.column_stack([0 * x, 0 * y, 1 + 0 * z]).ravel()
    scalars = [np.repeat(((r - 2) ** i) * np.cos(k * np.pi * z / 10), 3)
               for i in range(3) for k in range(14)]  # fmt: skip
    scalars += [np.repeat(((r - 2) ** i) * np.sin(k * np.pi * z / 10), 3)
                for i in range(3) for k in range(1, 14)]  # fmt: skip
    fields = np.array([d * s for d in (radial, axial) for s in scalars]).T
    found = []
    even = faces_held(quarter, {"x0": (0,), "y0": (1,), "z0": (2,)})
    odd = faces_held(quarter, {"x0": (0,), "y0": (1,), "z0": (0, 1)})
    free = np.setdiff1d(np.arange(quarter.n_dofs), odd)
    K, M = (A[free][:, free].tocsc() for A in (quarter.K, quarter.M))
    lam, U = eigsh(K, 30, M, sigma=-1e5)
    sliding = np.zeros((quarter.n_dofs, 30))
    sliding[free] = U
    odd_modes = np.sqrt(np.abs(lam)) / (2 * np.pi), sliding
    for frequency, Phi in (hertz(quarter, even, 30), odd_modes):
        found += list(frequency[fraction_in(quarter, Phi, fields) > 0.98])
    assert_allclose(np.sort(found)[0], 0.0, atol=1e-2)
    expected = [243.4955, 377.3851, 394.2119, 397.8363, 405.3223]
    assert_allclose(np.sort(found)[1:6], expected, rtol=rtol)
    assert order == 2 or np.abs(np.sort(found)[1:6] / expected - 1).max() > 5e-3


SPHERE = """
SetFactory("OpenCASCADE");
Sphere(1) = {0, 0, 0, 6.0, 0, Pi/2, Pi/2};
Sphere(2) = {0, 0, 0, 1.8, 0, Pi/2, Pi/2};
BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
Mesh.CharacteristicLengthMax = 0.85;
Mesh.CharacteristicLengthMin = 0.85;
Physical Volume("body") = {3};
"""


def radial_frequencies_of_a_hollow_sphere(a, b, material, n):
    """First n radial frequencies [Hz]: u = d/dr of (A sin kr + B cos kr)/r, free inside and out."""
    C = material.stiffness
    lam, mu = C[0, 1], C[3, 3]

    def traction(k, r):
        kr = k * r
        j = np.array([np.sin(kr), np.cos(kr)]) / kr
        dj = np.array([np.cos(kr) / kr - np.sin(kr) / kr**2, -np.sin(kr) / kr - np.cos(kr) / kr**2])
        # sigma_rr = (lam + 2 mu) u' + 2 lam u / r with u = j', j'' = -j - 2 j'/kr
        return (lam + 2 * mu) * (-j - 2 * dj / kr) + 2 * lam * dj / kr

    def determinant(k):
        return np.linalg.det([traction(k, a), traction(k, b)])

    speed, roots = np.sqrt((lam + 2 * mu) / material.rho), []
    grid = np.linspace(0.05, 6.0, 2000)
    values = [determinant(k) for k in grid]
    for left, right, f, g in zip(grid[:-1], grid[1:], values[:-1], values[1:], strict=True):
        if f * g < 0:
            roots.append(brentq(determinant, left, right, xtol=1e-13))
    return np.array(roots[:n]) * speed / (2 * np.pi)


def test_radial_modes_of_a_hollow_sphere_fv42(tmp_path):
    """NAFEMS FV42: 369.943, 838.033 Hz exactly; an octant of curved quadratic tetrahedra."""
    exact = radial_frequencies_of_a_hollow_sphere(1.8, 6.0, NAFEMS, 5)
    assert_allclose(exact, [369.943, 838.033, 1451.192, 2116.956, 2795.814], rtol=2e-6)
    path = tmp_path / "sphere.geo"
    path.write_text(SPHERE)
    octant = model(path, material=NAFEMS, order=2)
    r = np.linalg.norm(octant.points, axis=1)
    unit = octant.points / r[:, None]
    fields = np.array([(unit * (r / 6.0)[:, None] ** i).ravel() for i in range(-2, 6)]).T
    frequency, Phi = hertz(octant, faces_held(octant, {"x0": (0,), "y0": (1,), "z0": (2,)}), 40)
    radial = frequency[fraction_in(octant, Phi, fields) > 0.95]
    assert_allclose(radial[:2], exact[:2], rtol=1e-3)


L, H = 1.0, 0.05
EULER = np.sqrt(STEEL.E * H**2 / 12 / STEEL.rho) / (2 * np.pi * L**2)  # f = (beta L)^2 EULER


@pytest.fixture(scope="module")
def beam():
    mesh, tags = box((L, H, H), (20, 2, 2))
    return assemble(mesh, None, tags, material=STEEL)


def test_free_beam_and_cantilever(beam):
    f = rom.modes(beam, 12).frequencies
    assert_allclose(f[:6], 0.0, atol=0.0)
    assert_allclose(f[6:8], 22.373285 * EULER, rtol=0.01)  # Euler-Bernoulli, L/h = 20
    assert f[6] < 22.373285 * EULER  # shear and rotary inertia only lower it
    axial = STEEL.wave_speed / (2 * L)
    assert np.min(np.abs(rom.modes(beam, 20).frequencies / axial - 1)) < 1e-3
    f = rom.modes(beam, 4, fixed=("x0",)).frequencies
    assert_allclose(f[:2], 3.5160153 * EULER, rtol=5e-3)
    assert_allclose(f[2:], 22.0344916 * EULER, rtol=0.02)


def test_pinned_beam_follows_timoshenko(beam):
    """Ends held across the axis, the middle node along it, where bending has no axial motion."""
    ends = faces_held(beam, {"x0": (1, 2), "x1": (1, 2)})
    middle = np.argmin(np.linalg.norm(beam.points - [L / 2, H / 2, H / 2], axis=1))
    f, _ = hertz(beam, np.union1d(ends, [3 * middle]), 6)
    c, i2, s = STEEL.rho / STEEL.E, H**2 / 12, 2.6 / 0.85  # s: E over G and the shear factor
    for n in (1, 2, 3):
        k = n * np.pi / L  # (rho/E)^2 i2 s w^4 - (rho/E)(1 + k^2 i2 (1 + s)) w^2 + k^4 i2 = 0
        w2 = np.roots([c**2 * i2 * s, -c * (1 + k**2 * i2 * (1 + s)), k**4 * i2])
        assert_allclose(f[2 * n - 2 : 2 * n], np.sqrt(w2.min()) / (2 * np.pi), rtol=2e-3)


@pytest.mark.filterwarnings("ignore:the speed of sound")
@pytest.mark.parametrize("change", ["millimetres", "rotation", "translation", "far away", "scale"])
def test_frequencies_do_not_depend_on_units_or_place(change):
    mesh, _ = box((0.4, 0.1, 0.06), (8, 2, 2))
    reference = rom.modes(assemble(mesh, material=STEEL), 12).frequencies[6:]
    material, x = STEEL, mesh.geometry.x
    if change == "millimetres":  # tonnes, millimetres, seconds
        x *= 1e3
        material = rom.Material(STEEL.E * 1e-6, STEEL.nu, STEEL.rho * 1e-12)
    elif change == "rotation":
        x[:] = x @ np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    elif change == "scale":
        x *= 1e-6
        reference *= 1e6
    else:
        x += 400.0 if change == "translation" else 4e5
    found = rom.modes(assemble(mesh, material=material), 12).frequencies
    assert_allclose(found[:6], 0.0, atol=0.0)
    assert_allclose(found[6:], reference, rtol=1e-6 if change == "far away" else 1e-8)
