"""Bodies as FMUs without Python: the exact motion of their linear equations."""

import re
import subprocess
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.linalg import expm

import rom
from cases.mbs.fmu_instance import Instance, fmpy
from cases.mbs.mechanisms import random_body, simulate_quietly
from cases.solid import block, reduced
from rom.errors import ConfigError, InterfaceError

MOTION = ("displacement", "rotation", "velocity", "angular_velocity")


@pytest.fixture(autouse=True)
def no_python(monkeypatch):
    monkeypatch.setenv("ROM_PYTHON", "/nowhere/python")


@pytest.fixture(scope="module")
def body():
    """Two interfaces that move and turn, damping that couples the modes."""
    return random_body(np.random.default_rng(5), r=5)


@pytest.fixture(scope="module")
def free(body, tmp_path_factory):
    return rom.export(body, tmp_path_factory.mktemp("free") / "body.fmu")


@pytest.fixture(scope="module")
def rod():
    return reduced(4, block(cells=(4, 1, 1)), reference="root", damping=rom.Rayleigh(0, 1e-5))


def motion(one, name):
    """(12,) displacement, rotation, velocity, angular velocity of an interface."""
    return one.get(*(f"{name}.{what}[{k}]" for what in MOTION for k in (1, 2, 3)))


def load(one, name, wrench):
    for k, x in enumerate(wrench):
        one.set(f"{name}.{('force', 'torque')[k // 3]}[{k % 3 + 1}]", x)


def interface(body, name):
    """(6, 6 + r) displacement and rotation of an interface, written point by point."""
    m, columns = body.markers[name], np.eye(6 + body.n_modes)
    shift = [e[:3] + np.cross(e[3:6], m.point) + m.translation @ e[6:] for e in columns]
    return np.hstack([shift, [e[3:6] + m.rotation @ e[6:] for e in columns]]).T


def exact(body, history, gravity, steps):
    """Motion of all coordinates after wrenches {name: (6,)} held over a step each: (x, v)."""
    M, K = body.full_matrices()
    n, D = len(M), np.zeros_like(M)
    D[6:, 6:] = body.D
    state, zero, one = np.zeros(2 * n), np.zeros((n, n)), np.eye(n)
    for h, wrenches in zip(steps, history, strict=True):
        F = M[:, :3] @ gravity + sum(interface(body, k).T @ w for k, w in wrenches.items())
        A = np.block([[zero, one], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]])
        A = np.block([[A, np.r_[np.zeros(n), np.linalg.solve(M, F)][:, None]],
                      [np.zeros((1, 2 * n + 1))]])  # fmt: skip
        state = (expm(A * h) @ np.r_[state, 1.0])[:-1]
    return state[:n], state[n:]


def test_the_description_is_valid_and_needs_no_tool_and_the_library_no_python(free, tmp_path):
    assert fmpy.validation.validate_fmu(str(free)) == []
    d = fmpy.read_model_description(str(free))
    assert not d.coSimulation.needsExecutionTool and len(d.modelVariables) == 2 * 6 + 3 + 2 * 12
    with zipfile.ZipFile(free) as archive:
        named = set(re.findall(r'File name="(.*?)"', archive.read("modelDescription.xml").decode()))
        assert named == {"fmi2.c", "linear.c"}
        sources = {f"sources/{n}" for n in {*named, "model.h", "config.h", "tables.h"}}
        assert sources < {*archive.namelist()}
    units = {v.name: (v.causality, v.unit) for v in d.modelVariables}
    assert units["a.torque[2]"] == ("input", "N.m")
    assert units["b.angular_velocity[3]"] == ("output", "rad/s")
    one = Instance(free, tmp_path)
    library = f"{one.folder}/binaries/linux64/{one.description.coSimulation.modelIdentifier}.so"
    done = subprocess.run(["nm", "-D", "-u", library], capture_output=True, text=True, check=True)
    assert "Py" not in done.stdout and "malloc" in done.stdout


@pytest.mark.parametrize("steps", [(0.02,) * 4, (3.0,) * 4, (0.25, 0.25, 0.4, 0.1)])
def test_a_free_body_moves_as_its_equations_say(body, free, tmp_path, steps):
    rng = np.random.default_rng(1)
    history = [{name: rng.normal(size=6) for name in "ab"} for _ in range(4)]
    gravity = np.array([0.3, -0.2, 9.0])
    one = Instance(free, tmp_path).begin()
    one.fmu.doStep(0.0, 1.0)
    one.fmu.reset()  # nothing of it is left
    one.begin()
    for k, x in enumerate(gravity, 1):
        one.set(f"gravity[{k}]", x)
    for k, wrenches in enumerate(history):
        for name, wrench in wrenches.items():
            load(one, name, wrench)
        one.fmu.doStep(sum(steps[:k]), steps[k])
    x, v = exact(body, history, gravity, steps)
    for name in "ab":
        H = interface(body, name)
        expected = np.r_[H @ x, H @ v]
        assert_allclose(motion(one, name), expected, rtol=1e-10, atol=1e-11 * abs(expected).max())


def test_small_motions_are_those_of_the_multibody_integrator(body, free, tmp_path):
    """Its equations are not linear and its signs are its own."""
    small = 1e-5
    force, torque = np.array([1.0, -2.0, 0.5]) * small, np.array([0.3, 0.2, -0.4]) * small
    mech = rom.Mechanism(gravity=(0.0, 0.0, 0.0))
    part = mech.add_flexible("one", body)
    mech.force("f", part.marker("b"), force)
    mech.torque("t", part.marker("b"), torque)
    sol = simulate_quietly(mech, t_end=0.5, dt=1e-3)
    one = Instance(free, tmp_path).begin()
    load(one, "b", [*force, *torque])
    one.fmu.doStep(0.0, 0.5)
    for name in "ab":
        found, place = motion(one, name), sol.position("one", name)
        moved = place[-1] - place[0]
        assert_allclose(found[:3], moved, atol=2e-5 * abs(moved).max())
        spun = sol._seen("one", name).twist[-1]
        assert_allclose(found[6:], spun, atol=1e-3 * abs(spun).max())


def test_a_cantilever_comes_to_rest_where_statics_has_it(rod, tmp_path):
    path = rom.write_body_fmu(rod, tmp_path / "rod.fmu", fixed=("root",))
    one = Instance(path, tmp_path).begin()
    M, K = rod.full_matrices()
    H, hold = interface(rod, "tip"), interface(rod, "root")
    N = np.linalg.svd(hold)[2][6:].T
    wrench = np.array([0.0, 0.0, 5.0, 0.0, 0.3, 0.0])
    load(one, "tip", wrench)
    load(one, "root", 1e3 * np.ones(6))
    one.fmu.doStep(0.0, 1e3)
    rest = N @ np.linalg.solve(N.T @ K @ N, N.T @ (H.T @ wrench))
    assert_allclose(motion(one, "tip")[:6], H @ rest, rtol=1e-6, atol=1e-9 * abs(H @ rest).max())
    assert_allclose(motion(one, "root"), 0.0, atol=1e-9 * abs(H @ rest).max())
    load(one, "tip", np.zeros(6))
    one.set("gravity[3]", -9.81)
    one.fmu.doStep(1e3, 1e3)
    rest = N @ np.linalg.solve(N.T @ K @ N, N.T @ M[:, :3] @ [0.0, 0.0, -9.81])
    assert_allclose(motion(one, "tip")[2], (H @ rest)[2], rtol=1e-6)


def test_damping_that_does_not_couple_modes_is_written_as_a_diagonal(rod, free, tmp_path):
    """Round-off beside the diagonal would fill the propagator and cost minutes for many modes."""

    def filled(path):
        with zipfile.ZipFile(path) as archive:
            text = archive.read("sources/tables.h").decode()
        numbers = re.search(r"XI\[\d+\] = \{(.*?)\}", text, re.S).group(1).split(",")
        return sum(float.fromhex(x.strip()) != 0.0 for x in numbers)

    elastic = rod.n_modes
    assert filled(rom.export(rod, tmp_path / "rod.fmu")) == elastic
    assert filled(free) == 5 * 5


def test_states_can_be_taken_back(free, tmp_path):
    one = Instance(free, tmp_path).begin()
    load(one, "a", np.arange(6.0))
    one.fmu.doStep(0.0, 0.1)
    state = one.fmu.getFMUstate()
    one.fmu.doStep(0.1, 0.1)
    first = motion(one, "b")
    one.fmu.setFMUstate(state)
    one.fmu.doStep(0.1, 0.1)
    assert_array_equal(motion(one, "b"), first)
    one.fmu.freeFMUstate(state)
    one.fmu.terminate()
    one.fmu.freeInstance()


def test_what_is_wrong_is_told_and_the_instance_goes_on(free, tmp_path):
    one = Instance(free, tmp_path).begin()
    assert "value reference 0 = nan is not a finite" in one.fails(one.set, "a.force[1]", np.nan)
    assert "value reference 20 cannot be set" in one.fails(one.fmu.setReal, [20], [0.0])
    assert "no variable has the value reference 39" in one.fails(one.fmu.getReal, [39])
    assert "from t = 5 s is asked for, the body is at 0 s" in one.fails(one.fmu.doStep, 5.0, 0.1)
    for h in (0.0, -1.0, np.inf, np.nan):
        assert "must be positive and finite" in one.fails(one.fmu.doStep, 0.0, h)
    one.set("a.force[1]", 1e308)
    assert "not finite after t = 0 s" in one.fails(one.fmu.doStep, 0.0, 1e5)
    one.set("a.force[1]", 0.0)
    one.fmu.doStep(0.0, 0.1)
    assert_array_equal(motion(one, "b"), 0.0)


def test_bodies_that_cannot_be_written_are_refused(body, rod, tmp_path):
    path = tmp_path / "x.fmu"
    with pytest.raises(ConfigError, match="has no interface; an FMU needs interfaces and SI units"):
        rom.write_body_fmu(replace(body, markers={}), path)
    with pytest.raises(ConfigError, match="has the units mm-t-s"):
        rom.write_body_fmu(replace(body, units="mm-t-s"), path)
    with pytest.raises(InterfaceError, match="nose"):
        rom.write_body_fmu(rod, path, fixed=("nose",))
    assert not path.exists()
