"""What the benchmarks measure is what they say they measure."""

import json
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

import rom
from benchmarks import benchmarks, two_stages, updating, wheel
from benchmarks import large_deflection as bench
from benchmarks.models import planetary_train, shaft_in_films
from benchmarks.peers import compare, ours, spin_up
from cases.command import ran
from cases.solid import block
from rom import rotation
from rom.components.cosserat import straight
from rom.components.wind.wind_turbine import ramp
from rom.eigen.verbs import rigid_motions

pytestmark = pytest.mark.once

SIZE = np.array([0.16, 0.02, 0.012])


@pytest.fixture(scope="module")
def bar():
    return benchmarks.bar(tuple(SIZE), (16, 2, 1))


def test_the_bar_has_the_inertia_the_energy_of_any_constant_strain_and_the_ends_of_a_bar(bar):
    m = 7850.0 * SIZE.prod()
    R = rigid_motions(bar.points - SIZE / 2)
    expected = np.diag([m, m, m, *(m / 12 * ((SIZE**2).sum() - SIZE**2))])
    assert_allclose(R.T @ (bar.M @ R), expected, atol=1e-12 * m)
    assert np.abs(bar.K @ R).max() < 1e-14 * abs(bar.K).max()
    A = np.random.default_rng(3).normal(size=(3, 3))
    e = 0.5 * (A + A.T)
    voigt = np.array([e[0, 0], e[1, 1], e[2, 2], 2 * e[1, 2], 2 * e[0, 2], 2 * e[0, 1]])
    u = (bar.points @ A.T).ravel()
    energy = SIZE.prod() * voigt @ benchmarks.STEEL.stiffness @ voigt
    assert_allclose(u @ (bar.K @ u), energy, rtol=1e-11)
    for name, x in (("root", 0.0), ("tip", SIZE[0])):
        face = bar.interfaces[name]
        assert_allclose(face.origin, [x, SIZE[1] / 2, SIZE[2] / 2], atol=1e-12)
        assert_allclose(face.area, SIZE[1] * SIZE[2], rtol=1e-12)
        y, z = face.points[:, 1], face.points[:, 2]
        exact = SIZE[1] ** 3 / 3 * SIZE[2] ** 2 / 2  # integral of y^2 z
        assert_allclose(y @ face.surface_mass @ (y * z), exact, rtol=1e-12)


def test_the_bar_vibrates_like_a_bar(bar):
    """Free bending about both axes below the slender beam, and close to it; stretching above."""
    f = rom.modes(bar, 13).frequencies[6:]
    slender = 22.373285 * benchmarks.STEEL.wave_speed * SIZE[[2, 1]] / np.sqrt(12) / SIZE[0] ** 2
    assert_allclose(f[:2], slender / (2 * np.pi), rtol=0.06)
    assert np.all(f[:2] < slender / (2 * np.pi))
    assert_allclose(f[6], benchmarks.STEEL.wave_speed / (2 * SIZE[0]), rtol=2e-3)


@pytest.mark.parametrize("kind", ["full", "polynomial:4"])
def test_a_bed_under_the_interfaces_is_that_of_the_full_model(bar, kind):
    """Ten frequencies of the bar with springs under both ends, from all its dofs by LAPACK."""
    K, M = bar.K.toarray(), bar.M.toarray()
    for face in bar.interfaces.values():
        bed = benchmarks.BED_STIFFNESS * np.kron(face.surface_mass.toarray(), np.eye(3))
        K[np.ix_(face.dofs, face.dofs)] += bed
    exact = np.sqrt(eigh(K, M, eigvals_only=True, subset_by_index=(0, 9))) / (2 * np.pi)
    kinds = dict.fromkeys(bar.interfaces, kind)
    body = rom.reduce(bar, method=rom.CraigBampton(40), interfaces=kinds, certify=False)
    f = benchmarks._on_a_bed(body, bar)
    assert np.all(f > exact * (1 - 1e-9))
    assert_allclose(f, exact, rtol=1e-3)


@pytest.mark.long
def test_a_planetary_train_is_timed_on_a_motion_that_is_right():
    mech, pair, _ = planetary_train()
    moved = rom.simulate(mech, t_end=0.02, dt=1e-5, save_every=100, progress=False)
    sun, carrier = (moved.joint(f"{name} axle").angle[-1] for name in ("sun", "carrier"))
    assert carrier == pytest.approx(sun / 4, rel=1e-2) and pair.teeth == (24, 24)


@pytest.mark.long
def test_a_shaft_in_films_is_timed_on_a_motion_that_is_right():
    mech = shaft_in_films("reynolds")
    moved = rom.simulate(mech, t_end=0.02, dt=1e-4, method="bdf", progress=False)
    both = [moved.journal_bearing(f"film {k}").motion[-1] for k in range(2)]
    assert both[0][:2] == pytest.approx(both[1][:2], abs=1e-9)
    assert rom.audit(moved).ok


def test_other_programs_reduce_the_same_model(bar, tmp_path):
    file = tmp_path / "matrices.npz"
    ours.save_matrices(bar, str(file), tuple(benchmarks.KINDS))
    words = compare.SCRIPT_FILE, file, "superlu", "rbe2", 8
    found = json.loads(ran(sys.executable, *words, timeout=600, check=True).stdout)
    body = rom.reduce(bar, method=rom.CraigBampton(8), interfaces=benchmarks.KINDS, certify=False)
    assert_allclose(found["frequencies"], body.frequencies()[6:16], rtol=1e-8)
    assert found["seconds"] > 0.0


def test_many_modes_are_the_same_both_ways(bar):
    pytest.importorskip("dolfinx", reason="the beam is meshed")
    rows = {figure.quantity: figure.value for figure in benchmarks.many_modes(3e3, (40,))}
    assert rows["largest difference"] < 1e-8
    assert 0.0 < rows["largest bound"] < 1e-6


@pytest.mark.fenicsx
@pytest.mark.parametrize("size", [30e3, 100e3])
def test_the_beam_comes_within_a_tenth_of_the_size_asked_for(size):
    from rom.fe.mesh.read import read_mesh

    solid = read_mesh(benchmarks.geometry("beam"), parameters=benchmarks._beam(size))
    edges = solid.cells[:, [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]]
    n_edges = len(np.unique(np.sort(edges.reshape(-1, 2), axis=1), axis=0))
    n_dofs = 3 * (len(np.unique(solid.cells[:, :4])) + n_edges)  # one node more on each edge
    assert_allclose(n_dofs, size, rtol=0.1)


@pytest.mark.fenicsx
@pytest.mark.long
def test_a_wheel_and_its_sector_are_measured_on_the_same_modes():
    coarse = wheel.WHEEL_SIZES | {"lc": 0.02, "lc_blade": 0.02}
    figures = {f.quantity.split(":")[0]: f.value for f in benchmarks.wheel(3, coarse)}
    assert 1e-8 < figures["reduced sector above sector"] < 1e-3
    assert figures["sector against wheel"] < 1e-8
    assert all(value > 0.0 for value in figures.values())


def test_an_update_is_timed_that_finds_the_truth():
    rows = {quantity: value for _, quantity, value, _, _ in updating.measured(block(), 200)}
    assert rows["largest error over its deviation"] < 4
    assert rows["processor time of an update"] > 0


@pytest.mark.long
def test_compiled_loops_are_timed_on_motions_that_are_right():
    figures = {
        f"{f.case.split(',')[0]}: {f.quantity}": f
        for f in benchmarks.loops(blocks=10, steps=400, cells=120, height=10)
    }
    aims = [f.aim for f in figures.values()][::2]
    assert aims == ["below 30", "below 5", "below 2", "below 20", "below 30", "below 60"]
    assert all(f.value > 0 for f in figures.values())
    assert figures["arch of 10 blocks: fastest stone"].value < 1e-4
    assert figures["five-bar linkage: best index of isotropy"].value == pytest.approx(1, abs=1e-3)
    assert 5.5 < figures["Taylor's bar: radius of its foot"].value < 7.1
    assert figures["gallery: largest error of them"].value < 0.01
    assert figures["power curve of the 5 MW turbine: largest power"].value == pytest.approx(5)


def test_rods_and_their_beams_are_the_bar_of_the_paper(monkeypatch):
    """Kane, Ryan and Banerjee: EA = 2.8e7 N, EI = 1.4e4 N m^2, 1.2 kg/m, 10 m."""
    given = spin_up.beams(4)
    assert given["stiffness"][0][0] == 2.8e7 and given["stiffness"][0][4:] == [1.4e4] * 2
    assert_allclose([sum(given["length"]), np.dot(given["mass"], given["length"])], [10, 12])
    along, across, _ = rotation.matrix(np.array(given["nodes"][2][3:])).T
    assert_allclose(given["nodes"][2][:3], [0, 5, 0])
    assert_allclose(along, [0, 1, 0], atol=1e-12)
    assert_allclose(across, [-1, 0, 0], atol=1e-12)
    made = {}
    monkeypatch.setattr(spin_up, "straight", lambda *a, **k: made.update(k) or straight(*a, **k))
    mech = bench.Mechanism()
    spin_up.rod(4)(mech)
    first = [2, 0, 1]
    assert np.array(made["stretch"])[first].tolist() == given["stiffness"][0][:3]
    assert np.array(made["bend"])[first].tolist() == given["stiffness"][0][3:]
    assert np.array(made["inertia"])[first].tolist() == given["inertia"][0]
    assert made["mass"] == given["mass"][0]
    assert_allclose(made["frame"][:, 2], [1, 0, 0])


def test_the_deflection_of_a_beam_is_read_from_the_places_of_its_tip(monkeypatch):
    angle = ramp(spin_up.FINAL_SPEED, spin_up.RISE_TIME)[1]
    t = np.linspace(0.0, spin_up.RISE_TIME, 31)
    turned = [rotation.matrix(rotation.exp([angle(s), 0, 0])) for s in t]
    tip = np.array([A @ [0, 10.0, -0.2] for A in turned])
    assert_allclose(spin_up.lag(tip), -0.2, atol=1e-12)
    described = {}

    def answer(command):
        described.update(json.loads(Path(command[2]).read_text()))
        return {"tips": tip[:, None].tolist(), "seconds": 2.0, "version": "1"}

    monkeypatch.setattr(compare, "interpreter", lambda: "python")
    monkeypatch.setattr(compare, "answer_of", answer)
    assert_allclose(spin_up.by_exudyn(4)[1], 1 - 0.2 / 0.57379)
    assert described["steps"] == described["samples"] == 3000 and described["final"] == 6.0


def test_a_rod_spins_up_as_the_exact_beam_does():
    errors = [spin_up.spun_up(spin_up.rod(n), t_end=7.0).error for n in (8, 16)]
    assert errors[1] < 1e-2 and 3 < errors[0] / errors[1] < 5


@pytest.mark.long
@pytest.mark.fenicsx
@pytest.mark.filterwarnings("ignore:Number of integration points")
def test_the_bar_of_a_few_cells_is_measured():
    stocky = {"L": 1.0, "b": 0.2, "h": 0.1, "lc": 0.1}
    rows = list(bench.measured(stocky, (8, 1), (10, 1), (8,), ()))
    assert all(row[2] >= 0 for row in rows)
    of_bodies = [row[2] for row in rows if "dofs by" in row[0] and "error" in row[1]]
    assert len(of_bodies) == 2 and max(of_bodies) < 1e-2
    assert len(rows) == 2 + 4 + 10 + 1 + 3


@pytest.fixture(scope="module")
def bodies():
    """Of coarse meshes, once for each kind of rims."""
    with pytest.MonkeyPatch.context() as coarse:
        for sizes in (two_stages.HOUSING_SIZES, *two_stages.SHAFT_SIZES.values()):
            coarse.setitem(sizes, "lc", 1.6 * sizes["lc"])
        yield cache(two_stages.bodies)


@pytest.mark.fenicsx
@pytest.mark.long
@pytest.mark.parametrize("tabulated", [False, True])
def test_two_stages_carry_the_torque_and_the_weight(tabulated, bodies):
    """Moments about the shafts are as the numbers of teeth, but for what the films take."""
    mech = two_stages.machine(bodies("rbe3"), (60, 4), tabulated=tabulated)
    still = rom.mbs.snapshot(mech, rom.equilibrium(mech))
    films = sum(still.journal_bearing(name).power[0] for name in mech.journal_bearings)
    output, ratio = two_stages.INPUT_TORQUE, 1.0
    for name, pair in zip(mech.gear_meshes, two_stages.WHEEL_PAIRS.values(), strict=True):
        force = rom.mbs.tooth_loads(still, name)[0].force.sum()
        ratio *= pair.teeth[0] / pair.teeth[1]
        moment = force * pair.rb[1] * ratio
        lost = films / two_stages.SHAFT_SPEED
        assert -1e-6 * output < moment - output < lost
    assert 10.0 < films < 2000.0
