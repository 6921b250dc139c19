"""Mechanisms as FMUs, run by fmpy as another program would run them."""

import os
import signal
import sys
import warnings
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import rom
from cases.mbs.fmu_instance import Instance, fmpy
from cases.mbs.mechanisms import random_body, simulate_quietly
from cases.mbs.parts import ORIGIN, on_axle, on_guide
from cases.mbs.trusses import truss
from cases.paths import ROOT
from cases.refusals import refuses
from rom.fmu.driven import Driven
from rom.io.fmu.description import structured

# two processes of which one has just compiled the kernels and the other read them from the cache
# differ in the last bit; of two that read them none does
SAME_CODE = 1e-12
CRANK = """
from cases.mbs.mechanisms import slider_crank

def mechanism():
    mech = slider_crank(gravity=9.81)
    mech.drives.clear()
    mech.rotational_spring("coil", "main", stiffness=3.0, damping=0.01)
    mech.force("gas", mech.parts["slider"].marker("b"), (0.0, 0.0, 0.0))
    return mech
"""
FLEXIBLE = """
from pathlib import Path
import rom

def mechanism():
    print("what a mechanism prints is no answer")
    mech = rom.Mechanism()
    body = rom.load(Path(__file__).with_name("one.rom.npz"))
    one = mech.add_flexible("one", body, omega=(1.0, 2.0, 3.0))
    place = mech.design_point(one.marker("a"))
    mech.spherical("hook", mech.ground.marker(place), one.marker("a"))
    mech.force("pull", one.marker("b"), (1.0, 2.0, 3.0), frame="body")
    return mech
"""
POSITION = [f"slider.b.position[{k}]" for k in (1, 2, 3)]
VELOCITY = [f"slider.b.velocity[{k}]" for k in (1, 2, 3)]


@pytest.fixture(autouse=True)
def python_with_rom(monkeypatch):
    """The process of an FMU finds this rom, and the mechanisms of the tests."""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), str(ROOT / "tests")]))
    monkeypatch.delenv("ROM_PYTHON", raising=False)


def written(folder, script, name="m", **options):
    (folder / "m.py").write_text(script)
    return rom.write_fmu(folder / "m.py", folder / f"{name}.fmu", **{"dt": 1e-3, **options})


@pytest.fixture(scope="module")
def crank(tmp_path_factory):
    folder, asked = tmp_path_factory.mktemp("crank"), {"outputs": ["slider.b", "main"]}
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(ROOT / "tests"))
        return written(folder, CRANK, "slider crank", inputs=["gas"], **asked)


def built(text, file=""):
    """The mechanism of a Python file, built here."""
    space = {"__file__": str(file)}
    exec(text, space)
    return space["mechanism"]()


def crank_by_hand(function=None):
    mech = built(CRANK)
    if function:
        mech.loads["gas"] = replace(mech.loads["gas"], function=function)
    return mech


def native(motion):
    return np.hstack([motion.position("slider", "b"), motion.velocity("slider", "b")])


@pytest.mark.once
def test_the_description_is_valid_and_names_no_place_of_this_machine(crank):
    assert fmpy.validation.validate_fmu(str(crank)) == []
    d = fmpy.read_model_description(str(crank))
    assert (d.modelName, d.coSimulation.modelIdentifier) == ("slider crank", "slider_crank")
    assert d.coSimulation.needsExecutionTool and d.coSimulation.canGetAndSetFMUstate
    units = {v.name: (v.causality, v.unit) for v in d.modelVariables}
    assert units["gas[1]"] == ("input", "N") and units["main.angle"] == ("output", "rad")
    assert units["main.angle_rate"] == ("output", "rad/s") and units["dt"] == ("parameter", "s")
    with zipfile.ZipFile(crank) as archive:
        for name in archive.namelist():
            assert str(crank.parent).encode() not in archive.read(name), name


@pytest.mark.once
def test_the_slider_crank_is_the_native_run(crank):
    """Two time steps in each communication step; the integrator keeps its memory in between."""
    motion = simulate_quietly(crank_by_hand(), t_end=0.1, dt=1e-3)
    found = fmpy.simulate_fmu(
        str(crank), stop_time=0.1, step_size=2e-3, output_interval=2e-3, fmi_type="CoSimulation",
        output=[*POSITION, *VELOCITY, "main.angle"],
    )  # fmt: skip
    slider = np.column_stack([found[name] for name in (*POSITION, *VELOCITY)])
    here = native(motion)[::2]
    assert_allclose(slider, here, rtol=0, atol=SAME_CODE * np.abs(here).max())
    # the last corrections of Newton have not reached the angle that the integrator remembers
    assert_allclose(found["main.angle"], motion.base[::2, 0], rtol=0, atol=1e-9)


def moved(step, force, dt, end=0.1):
    """Position and velocity of the slider after steps with a force held over each."""
    driven = Driven(crank_by_hand(), inputs=("gas",), outputs=("slider.b",), dt=dt)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rom.RomWarning)
        driven.start(0.0)
        for k in range(round(end / step)):
            driven.set([2], [force(k * step)])
            driven.step(k * step, step)
    return driven.get([5, 8])


@pytest.mark.once
def test_the_error_falls_with_the_second_power_of_the_step():
    """Communication steps as long as the time step is allowed to be."""
    exact = native(simulate_quietly(crank_by_hand(), t_end=0.1, dt=2.5e-5))[-1, [0, 3]]
    errors = [np.abs(moved(h, lambda t: 0.0, dt=1.0) - exact) for h in (1e-3, 5e-4)]
    assert_allclose(errors[0] / errors[1], 4.0, rtol=0.1)


def test_a_smooth_input_costs_an_error_of_first_order_in_the_communication_step():
    """Its mean over a step is that of half a step earlier."""
    smooth = crank_by_hand(lambda t: (30 * np.sin(40 * t), 0.0, 0.0))
    exact = native(simulate_quietly(smooth, t_end=0.06, dt=5e-4))[-1, [0, 3]]
    ends = (moved(h, lambda t: 30 * np.sin(40 * t), 5e-4, end=0.06) for h in (2e-3, 1e-3))
    errors = [np.abs(end - exact) for end in ends]
    assert_allclose(errors[0] / errors[1], 2.0, rtol=0.15)


def test_a_jump_of_an_input_costs_no_order():
    """Without a jump of the accelerations the method feels each jump half a step late."""

    def square(t):
        return 50.0 if int(t / 0.02 + 1e-6) % 2 else -20.0

    a, b, c = (moved(0.02, square, dt) for dt in (2e-3, 1e-3, 5e-4))
    assert_allclose((a - b) / (b - c), 4.0, rtol=0.1)


def flywheel():
    """A wheel of 0.2 kg m^2 on an axle, a sledge of 2 kg on rails."""
    mech, marks = rom.Mechanism(gravity=ORIGIN), {"hub": ORIGIN, "rim": (0.5, 0, 0)}
    on_axle(mech, inertia=(0.1, 0.1, 0.2), markers=marks)
    on_guide(mech, "sledge", mass=2.0, guide="rails")
    return mech


def values(driven, names):
    order = [v.name for v in driven.variables]
    return driven.get(np.array([order.index(name) for name in names]))


def test_a_drive_follows_its_acceleration_without_jumps():
    mech = flywheel()
    mech.drive("turn", "axle", lambda t: 0.3 * t, rate=lambda t: 0.3, acceleration=lambda t: 0.0)
    driven = Driven(mech, inputs=("turn",), outputs=("axle", "turn", "wheel.rim"), dt=1e-3)
    named = [v.name for v in driven.variables]
    assert named[2:5] == ["turn.acceleration", "axle.angle", "axle.angle_rate"]
    driven.start(0.0)
    for k, a in enumerate((5.0, -2.0)):
        driven.set([2], [a])
        driven.step(0.5 * k, 0.5)
        assert_allclose(values(driven, ["turn.load"]), 0.2 * a, rtol=1e-6)
    x = 0.3 * 0.5 + 5 * 0.125 + (0.3 + 5 * 0.5) * 0.5 - 2 * 0.125
    rate = 0.3 + 5 * 0.5 - 2 * 0.5
    names = ["axle.angle", "axle.angle_rate", "wheel.rim.position[1]", "wheel.rim.velocity[2]"]
    expected = [x, rate, 0.5 * np.cos(x), 0.5 * rate * np.cos(x)]
    assert_allclose(values(driven, names), expected, rtol=1e-6)
    names = [f"wheel.rim.quaternion[{k}]" for k in (1, 4)] + ["wheel.rim.angular_velocity[3]"]
    assert_allclose(values(driven, names), [np.cos(x / 2), np.sin(x / 2), rate], rtol=1e-6)


def test_motors_torques_and_forces_follow_their_inputs():
    mech = flywheel()
    mech.motor("engine", "axle", lambda t, x, xd: -1e3 * x)
    mech.torque("brake", mech.parts["wheel"].marker("hub"), lambda t: (0.0, 0.0, 7.0))
    mech.force("pull", mech.parts["sledge"].marker(ORIGIN), (3.0, 0.0, 0.0), frame="body")
    driven = Driven(mech, inputs=("engine", "brake", "pull"), outputs=("axle", "rails"), dt=1e-2)
    assert_allclose(driven.get(np.arange(2, 9)), [0, 0, 0, 7, 3, 0, 0])
    driven.start(0.0)
    driven.set(range(2, 9), [4.0, 0.0, 0.0, -1.0, 6.0, 9.0, 0.0])
    driven.step(0.0, 1.0)
    names = ["axle.angle", "axle.angle_rate", "rails.way", "rails.way_rate"]
    assert_allclose(values(driven, names), [7.5, 15.0, 1.5, 3.0], rtol=1e-9)
    driven.set([2, 6], [0.0, 0.0])
    driven.step(1.0, 1.0)  # the brake alone
    expected = [7.5 + 15.0 - 2.5, 10.0, 1.5 + 3.0, 3.0]
    assert_allclose(values(driven, names), expected, rtol=1e-9)


def test_a_spread_load_follows_its_amplitude():
    """Its weight is taken from a body that would fall otherwise."""
    body = random_body(np.random.default_rng(3))
    mech = rom.Mechanism()
    part = mech.add_flexible("one", body)
    load = rom.mass_load(body, (0.0, 0.0, 9.81))
    mech.spread_load("lift", part, load, lambda t: 5.0, frame="world")
    driven = Driven(mech, inputs=("lift",), outputs=("one.a",), dt=1e-3)
    assert_allclose(driven.get([2]), 5.0)
    driven.start(0.0)
    before = driven.get(np.arange(3, 16))
    driven.set([2], [1.0])
    driven.step(0.0, 0.1)
    assert_allclose(driven.get(np.arange(3, 16)), before, atol=1e-8)


@pytest.fixture(scope="module")
def hanging(tmp_path_factory):
    folder, asked = tmp_path_factory.mktemp("hanging"), {"inputs": ["pull"], "outputs": ["one.b"]}
    body = rom.save(random_body(np.random.default_rng(3)), folder / "one.rom.npz")
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("PYTHONPATH", raising=False)
        return written(folder, FLEXIBLE, "hanging", dt=1e-2, files=[body], **asked)


FAR = """
from pathlib import Path
import rom

def mechanism():
    mech = rom.Mechanism()
    truss = mech.add_flexible("truss", rom.load(Path(__file__).with_name("truss.rom.npz")))
    place = mech.design_point(truss.marker("mean"))
    mech.revolute("hook", mech.ground.marker(place), truss.marker("mean"), axis=(0, 0, 1))
    mech.force("pull", truss.marker("n3"), (2.0, -3.0, 4.0))
    return mech
"""


@pytest.mark.once
def test_a_body_of_large_deflection_on_a_fitted_marker_moves_in_it_as_here(tmp_path):
    body = rom.save(truss(), tmp_path / "truss.rom.npz")
    asked = {"inputs": ["pull"], "outputs": ["truss.n3"]}
    file = written(tmp_path, FAR, dt=1e-2, files=[body], **asked)
    names = [f"truss.n3.position[{k}]" for k in (1, 2, 3)]
    one = Instance(file, tmp_path).begin(rho_inf=0.9)
    one.fmu.doStep(0.0, 0.3)
    there = rom.simulate(built(FAR, tmp_path / "m.py"), t_end=0.3, dt=1e-2, rho_inf=0.9)
    moved = there.position("truss", "n3")
    assert np.linalg.norm(moved[-1] - moved[0]) > 0.04
    assert_allclose(one.get(*names), moved[-1], rtol=SAME_CODE, atol=SAME_CODE)


@pytest.mark.once
def test_a_flexible_body_travels_inside_and_states_can_be_taken_back(hanging, tmp_path):
    one = Instance(hanging, tmp_path).begin(rho_inf=0.8)
    names = [f"one.b.position[{k}]" for k in (1, 2, 3)]
    one.fmu.doStep(0.0, 0.05)
    begun = one.get(*names)
    state = one.fmu.getFMUstate()
    one.set("pull[1]", -4.0)
    one.fmu.doStep(0.05, 0.05)
    first = one.get(*names)
    one.set("pull[1]", 50.0)
    one.fmu.doStep(0.1, 0.05)
    one.fmu.setFMUstate(state)
    assert_allclose(one.get("pull[1]"), 1.0)
    one.set("pull[1]", -4.0)
    one.fmu.doStep(0.05, 0.05)
    assert_array_equal(one.get(*names), first)
    one.fmu.freeFMUstate(state)
    assert "this state was freed" in one.fails(one.fmu.setFMUstate, state)
    rom.save(random_body(np.random.default_rng(3)), tmp_path / "one.rom.npz")
    mech = built(FLEXIBLE, tmp_path / "hanging.py")
    half = simulate_quietly(mech, t_end=0.05, dt=1e-2, rho_inf=0.8)
    assert_allclose(begun, half.position("one", "b")[-1], atol=SAME_CODE)
    mech.loads["pull"] = replace(mech.loads["pull"], vector=np.array([-4.0, 2.0, 3.0]))
    end = simulate_quietly(mech, t_end=0.1, dt=2e-4, rho_inf=0.8, state=replace(
        half.final, algorithmic=None, memory=None))  # fmt: skip
    assert_allclose(first, end.position("one", "b")[-1], atol=2e-3)
    assert np.linalg.norm(first - half.position("one", "b")[-1]) > 0.02
    one.fmu.reset()
    one.begin()
    assert_allclose(one.get("rho_inf", "pull[1]"), [0.9, 1.0])
    one.fmu.terminate()
    one.fmu.freeInstance()


@pytest.mark.once
def test_what_is_wrong_is_told_and_the_instance_goes_on(hanging, tmp_path):
    one = Instance(hanging, tmp_path)
    assert "before its initialisation" in one.fails(one.fmu.doStep, 0.0, 0.1)
    assert "dt = -1 must be positive" in one.fails(one.set, "dt", -1.0)
    assert "must be at least 0 and at most 1" in one.fails(one.set, "rho_inf", 1.5)
    one.begin()
    assert "pull[2] = nan is not finite" in one.fails(one.set, "pull[2]", np.nan)
    place = "one.b.position[1]"
    assert f"the output {place!r} cannot be set" in one.fails(one.set, place, 0.0)
    assert "value reference 99 cannot be set" in one.fails(one.fmu.setReal, [99], [0.0])
    assert "no variable has the value reference 99" in one.fails(one.fmu.getReal, [99])
    assert "fmi2GetInteger is not offered" in one.fails(one.fmu.getInteger, [0])
    assert "a step from t = 5 s" in one.fails(one.fmu.doStep, 5.0, 0.1)
    assert "must be positive" in one.fails(one.fmu.doStep, 0.0, -0.1)
    one.fmu.doStep(0.0, 0.1)
    assert "must be set before the first step" in one.fails(one.set, "dt", 1e-3)
    before = one.get(place)
    one.set("pull[1]", 1e200)
    assert "at t = 0.11 s" in one.fails(one.fmu.doStep, 0.1, 0.1)
    one.set("pull[1]", 1.0)
    assert_array_equal(one.get(place), before)
    one.fmu.doStep(0.1, 0.1)
    one.fmu.terminate()
    assert "after its end" in one.fails(one.fmu.doStep, 0.2, 0.1)
    one.fmu.freeInstance()


@pytest.mark.once
def test_a_warning_is_logged_once(crank, tmp_path):
    """That constraints repeat each other does not stop a run."""
    one = Instance(crank, tmp_path).begin()
    (text,) = one.log
    assert "3 of 20 constraints repeat others" in text
    one.fmu.reset()
    one.begin()
    one.fmu.doStep(0.0, 1e-3)
    assert len(one.log) == 1
    one.fmu.freeInstance()


@pytest.mark.once
def test_the_end_of_its_process_is_an_error_and_no_crash(hanging, tmp_path):
    """Nor the signal for a broken pipe, which Python ignores and other programs do not."""
    one, other = (Instance(hanging, tmp_path / name).begin() for name in ("one", "other"))
    commands = {int(p.parent.name): p.read_bytes() for p in Path("/proc").glob("[0-9]*/cmdline")}
    (pid,) = (k for k, words in commands.items() if str(tmp_path / "one").encode() in words)
    os.kill(pid, signal.SIGKILL)
    usual = signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    assert "has ended" in one.fails(one.fmu.doStep, 0.0, 0.1)
    assert "has ended" in one.fails(one.set, "pull[1]", 0.1)
    signal.signal(signal.SIGPIPE, usual)
    one.fmu.freeInstance()
    other.fmu.doStep(0.0, 0.1)
    other.fmu.freeInstance()


def why_not(*given, **more):
    log = []
    refuses(Exception, "instantiate", Instance, *given, log=log, **more)
    return log[0]


@pytest.mark.parametrize(
    ("python", "guid", "message"),
    [
        ("/nowhere/python", None, "/nowhere/python cannot be started: No such file"),
        ("false", None, "false ended at once. Set ROM_PYTHON to a Python that has rom"),
        (sys.executable, "another", "the GUID of the model description is another"),
    ],
)
def test_an_fmu_that_cannot_start_says_why(hanging, tmp_path, monkeypatch, python, guid, message):
    monkeypatch.setenv("ROM_PYTHON", python)
    assert message in why_not(hanging, tmp_path, guid=guid)


def test_where_its_writer_is_gone_the_usual_python_runs_it(hanging, tmp_path, monkeypatch):
    folder = fmpy.extract(str(hanging), str(tmp_path / "a folder"))
    assert (Path(folder) / "resources" / "python").read_text() == sys.executable
    (Path(folder) / "resources" / "python").write_text("/nowhere/python")
    (tmp_path / "python3").write_text("#!/bin/sh\nexit 1\n")
    (tmp_path / "python3").chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    monkeypatch.setattr(fmpy, "extract", lambda *a: folder)
    assert "python3 ended at once" in why_not(hanging, tmp_path)


@pytest.mark.long
@pytest.mark.once
def test_a_mechanism_that_cannot_start_says_why(tmp_path, monkeypatch):
    path = written(tmp_path, CRANK, outputs=["slider.b"])
    folder = fmpy.extract(str(path), str(tmp_path / "a folder"))
    (Path(folder) / "resources" / "model" / "m.py").unlink()
    monkeypatch.setattr(fmpy, "extract", lambda *a: folder)
    why = why_not(path, tmp_path)
    assert "FileNotFoundError" in why and "m.py" in why


@pytest.mark.once
@pytest.mark.parametrize(
    ("script", "options", "message"),
    [
        (CRANK, {"inputs": ["gass"]}, "m.py: no input 'gass'; the loads, motors and drives are"),
        (CRANK, {"dt": 0.0}, "must be positive"),
        (CRANK, {"files": ["nothing.npz"]}, "there is no file"),
        ("mechanism = 3", {}, r"m.py needs a function mechanism\(\)"),
        ("def mechanism(): return 3", {}, "gave 3; it must return a Mechanism"),
        ("open('rod.npz')", {}, "holds only it and the files named: FileNotFoundError"),
    ],
)
def test_what_cannot_be_written_is_refused(tmp_path, script, options, message):
    refuses(rom.ConfigError, message, written, tmp_path, script, **options)
    assert not (tmp_path / "m.fmu").exists()


def test_unknown_names_are_refused():
    crank, end = crank_by_hand(), "no output 'slider.c'; there are .'crank.a', 'crank.o', 'guide'"
    for inputs, outputs, message in (
        (("gas", "gas"), (), "the input 'gas' is given twice"),
        ((), ("slider.c",), end),
        ((), ("pin", "pin"), "the output 'pin' is given twice"),
    ):
        refuses(rom.ConfigError, message, Driven, crank, inputs=inputs, outputs=outputs, dt=1e-3)


def test_an_fmu_ends_in_fmu_and_needs_a_compiler(tmp_path, monkeypatch):
    with pytest.raises(rom.ConfigError, match=r"is written as \.fmu"):
        rom.write_fmu("m.py", tmp_path / "m.zip", dt=1.0)
    monkeypatch.setenv("PATH", str(tmp_path))
    refuses(rom.ResourceError, "needs a C compiler", written, tmp_path, CRANK)


def test_names_that_are_no_identifiers_are_quoted():
    assert structured("rod", "pin_a", "position") == "rod.pin_a.position"
    assert structured("the 'rod'", "größe") == r"'the \'rod\''.'gr__e'"
