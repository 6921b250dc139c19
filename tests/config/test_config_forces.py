"""Forces, control laws and events of a mechanism file, against closed forms and Python."""

import json
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.interpolate import PchipInterpolator
from scipy.special import ellipk

import rom
from cases.command import ROOT
from cases.files.schema import answer
from cases.files.toml_files import PENDULUM
from cases.refusals import refuses
from rom.cli.main import main
from rom.errors import ConfigError, UnsafeFileError
from rom.mbs.elements.formulas.codes import DIV, FUNCTIONS, NUMBER, SUB, X
from rom.mbs.elements.formulas.lines import line_law
from rom.mbs.elements.formulas.programs import formula

BLOCK = """
gravity = [0, 0, 0]
[ground]
wall = [0, 0, 0]
[bodies.block]
mass = "2 kg"
inertia = [1, 1, 1]
at = ["1.1 m", 0, 0]
markers = { p = [0, 0, 0] }
[joints.guide]
kind = "prismatic"
between = ["ground.wall", "block.p"]
axis = [1, 0, 0]
"""
RUN = "[simulation]\nt_end = {}\ndt = {}\nrho_inf = 1\n"


def file_of(tmp_path, text, t_end=1.0, dt=1e-3, **how):
    (tmp_path / "m.toml").write_text(text + RUN.format(t_end, dt))
    return rom.read_mechanism(tmp_path / "m.toml", **how)


def block_in_python():
    mech = rom.Mechanism(gravity=(0, 0, 0))
    solid = {"mass": 2.0, "inertia": (1, 1, 1), "markers": {"p": (0, 0, 0)}}
    block = mech.add_rigid("block", at=(1.1, 0, 0), **solid)
    wall = mech.ground.marker((0, 0, 0))
    mech.prismatic("guide", wall, block.marker("p"), axis=(1, 0, 0))
    return mech, wall, block.marker("p")


DUFFING = """
[laws.spring]
between = ["ground.wall", "block.p"]
expression = "-k*(x - L) - c*(x - L)^3"
constants = { k = "50 N/m", c = 4e4, L = "1 m" }
[events.middle]
kind = "distance"
between = ["ground.wall", "block.p"]
value = "1 m"
"""


@pytest.mark.once
def test_a_duffing_oscillator_has_the_period_of_the_elliptic_integral(tmp_path):
    """x = A cn(W t, m) with W^2 = (k + c A^2) / mass, m = c A^2 / 2 / (k + c A^2)."""
    A, k, c, mass = 0.1, 50.0, 4e4, 2.0
    stiff = k + c * A**2
    quarter = ellipk(c * A**2 / 2 / stiff) / np.sqrt(stiff / mass)
    file = file_of(tmp_path, BLOCK + DUFFING, t_end=6 * quarter, dt=quarter / 400)
    made = file.mechanism()
    assert rom.check_law(made, "spring").ok
    sol = file.simulate(made)
    assert_allclose(sol.events["middle"].t, quarter * np.array([1, 3, 5]), rtol=1e-5)
    x = sol.position("block")[:, 0] - 1
    potential = k * x**2 / 2 + c * x**4 / 4
    assert_allclose(sol.law("spring").energy, potential - potential[0], atol=1e-13)
    assert rom.audit(sol).ok


@pytest.mark.parametrize(
    ("expression", "lost"),
    [("-800*(x - 1)", None), ("-800*(x - 1) - 5*v", 5.0), ("800*max(0, 1.05 - x)", None),
     ("100*sign(1 - x)", None), ("40/(x - 0.5)^1.4 - 60", None), ("-3*v*abs(v)", None)],
)  # fmt: skip
def test_forces_of_length_and_rate_balance_their_energy(expression, lost, tmp_path):
    law = f'[laws.s]\nbetween = ["ground.wall", "block.p"]\nexpression = "{expression}"\n'
    file = file_of(tmp_path, BLOCK + law, t_end=0.3)
    made = file.mechanism()
    assert rom.check_law(made, "s").ok and made.laws["s"].stores
    sol = rom.simulate(made, t_end=0.3, dt=2e-3)
    if lost is not None:
        rate = sol.velocity("block")[:, 0]
        assert_allclose(sol.law("s").lost, lost * rate**2, atol=1e-12)


def test_a_force_of_the_time_is_an_applied_force(tmp_path):
    """m x'' = F sin(w t) from rest: x = F (w t - sin w t) / m w^2."""
    law = f'{LINE}expression = "3*sin(20*t)"\n'
    file = file_of(tmp_path, BLOCK + law, t_end=0.5, dt=5e-4)
    made = file.mechanism()
    assert not made.laws["s"].stores and rom.check_law(made, "s").ok
    sol = file.simulate(made)
    wanted = 1.1 + 3.0 * (20 * sol.t - np.sin(20 * sol.t)) / 2 / 400
    assert_allclose(sol.position("block")[:, 0], wanted, rtol=0, atol=1e-6)


def test_formulas_are_the_springs_and_drives_that_say_the_same(tmp_path):
    swinging = BLOCK[: BLOCK.index("[joints")] + 'velocity = [0, "1 m/s", "0.5 m/s"]\n'
    swinging = swinging.replace("markers =", "markers.p = [0, 0.1, 0]\n#")
    line = 'between = ["ground.wall", "block.p"]\n'
    forms = (
        '[laws.s]\nexpression = "-200*(x - 1) - 7*v"\n',
        '[springs.s]\nstiffness = "200 N/m"\ndamping = "7 N s/m"\nfree_length = 1\n',
    )
    ways = [file_of(tmp_path, swinging + form + line, t_end=1.0).simulate() for form in forms]
    assert_allclose(ways[0].q, ways[1].q, atol=1e-11)
    assert_allclose(ways[0].energy.damping, ways[1].energy.damping, atol=1e-11)
    assert ways[0].statistics["iterations"] == ways[1].statistics["iterations"]
    laws = (
        '{ expression = "30*sin(2*pi*t/0.5)", unit = "deg" }',
        '{ kind = "harmonic", amplitude = "30 deg", frequency = "2 Hz" }',
    )
    runs = []
    for law in laws:
        (tmp_path / "p.toml").write_text(PENDULUM + f'[drives.d]\njoint = "pivot"\nlaw = {law}\n')
        runs.append(rom.read_mechanism(tmp_path / "p.toml").simulate())
    assert_allclose(runs[0].q, runs[1].q, atol=1e-12)
    loads = [run.reaction("d") for run in runs]
    assert_allclose(loads[0], loads[1], atol=1e-5 * np.abs(loads[1]).max())


@pytest.mark.parametrize("interpolation", ["monotone", "cubic"])
def test_a_curve_through_points_goes_on_straight_and_knows_its_energy(interpolation, tmp_path):
    x, F = np.array([0.9, 1.0, 1.05, 1.2]), np.array([300.0, 0.0, -60.0, -400.0])
    law = (
        '[laws.s]\nbetween = ["ground.wall", "block.p"]\nx = ["90 cm", 1, 1.05, 1.2]\n'
        f'values = [300, 0, -60, "-0.4 kN"]\ninterpolation = "{interpolation}"\n'
    )
    file = file_of(tmp_path, BLOCK + law, t_end=0.6, dt=5e-4)
    made = file.mechanism()
    assert rom.check_law(made, "s").ok
    sol = rom.simulate(made, t_end=0.6, dt=5e-4)
    said, way = sol.law("s"), sol.position("block")[:, 0]
    force = said.force[:, 1, 0]
    inside = (way > x[0]) & (way < x[-1])
    assert way.min() < 1.0 < 1.05 < way.max()
    if interpolation == "monotone":
        assert_allclose(force[inside], PchipInterpolator(x, F)(way[inside]), atol=1e-9)
    change = sol.energy.kinetic + said.energy
    assert_allclose(change, change[0], atol=2e-4 * sol.energy.kinetic.max())


def test_beyond_its_points_a_table_is_a_line(tmp_path):
    law = '[laws.s]\nbetween = ["ground.wall", "block.p"]\nx = [2, 3]\nvalues = [5, 3]\n'
    made = file_of(tmp_path, BLOCK + law).mechanism()
    sol = rom.simulate(made, t_end=1e-6, dt=1e-6)
    assert_allclose(sol.law("s").force[0, 1, 0], 5.0 + 0.9 * 2.0)


def test_a_force_with_a_pole_on_its_way_has_no_energy():
    mech, wall, p = block_in_python()
    code = ((NUMBER, 1.0), (NUMBER, 1.0), (X, 0.0), (SUB, 0.0), (DIV, 0.0))
    line_law(mech, "s", wall, p, formula(code))
    report = rom.check_law(mech, "s", samples=40)
    assert not report.ok and report.rows[0].value > 0


def test_a_controlled_pendulum_swings_as_its_equation_says(tmp_path):
    """Without gravity I a'' = -P a - D a' from a(0) = 0, a'(0) = w: a damped oscillator."""
    inertia, P, D, w = 0.025 + 2 * 0.5**2, 200.0, 5.0, 3.0
    text = PENDULUM.replace('"-9.81 m/s^2"', "0").replace(
        "markers", f"omega = [0, 0, {w}]\nvelocity = [0, {0.5 * w}, 0]\nmarkers"
    )
    law = '[motors.servo]\njoint = "pivot"\nlaw = { expression = "-P*x - D*v", unit = "N m", '
    law += 'constants = { P = "200 N m/rad", D = 5 } }\n'
    (tmp_path / "p.toml").write_text(text + law)
    sol = rom.read_mechanism(tmp_path / "p.toml").simulate()
    decay = D / 2 / inertia
    omega = np.sqrt(P / inertia - decay**2)
    wanted = w / omega * np.exp(-decay * sol.t) * np.sin(omega * sol.t)
    assert_allclose(sol.joint("pivot").angle, wanted, atol=3e-5)


FALLING = """
[bodies.ball]
mass = 1
inertia = [1, 1, 1]
at = [0, 0, "1 m"]
omega = [0, 0, "600 rpm"]
markers = { p = [0, 0, 0] }
[joints.lift]
kind = "cylindrical"
between = [{ ground = [0, 0, 0] }, { ball = [0, 0, 0] }]
axis = [0, 0, 1]
[events]
floor = { kind = "position", marker = { ball = [0, 0, 0] }, axis = [0, 0, 2], terminal = true }
half = { kind = "distance", between = [{ ground = [0, 0, 0] }, "ball.p"], value = "50 cm" }
turns = { kind = "coordinate", joint = "lift", coordinate = "angle", value = "3 rev" }
up = { kind = "coordinate", joint = "lift", coordinate = "displacement", value = "-0.5 m" }
fast = { kind = "position", marker = "ball.p", axis = [0, 0, -1], expression = "v - 3*1 - 0*t" }
down = { kind = "position", marker = "ball.p", axis = [0, 0, 1], value = 0.3 }
[events.never]
kind = "position"
marker = "ball.p"
axis = [0, 0, 1]
value = 0.3
direction = "rising"
"""


@pytest.mark.parametrize("method", ["generalized-alpha", "dop853", "bdf"])
def test_events_happen_when_they_must(method, tmp_path):
    text = FALLING.replace("[0, 0, 2], terminal", "[0, 0, 2], value = 0, terminal")
    file = file_of(tmp_path, text, t_end=1.0, dt=5e-3)
    sol = rom.simulate(file.mechanism(), t_end=1.0, dt=5e-3, method=method)
    fall = {"floor": 1.0, "half": 0.5, "up": 0.5, "down": 0.7}
    wanted = {name: np.sqrt(2 * h / 9.81) for name, h in fall.items()}
    wanted |= {"turns": 0.3, "fast": 3 / 9.81}
    for name, t in wanted.items():
        assert_allclose(sol.events[name].t, [t], rtol=2e-9, err_msg=name)
    assert sol.events["never"].t.size == 0
    assert sol.status.startswith("Stopped by event 'floor'")


def test_a_run_that_goes_on_counts_the_turns_of_the_first(tmp_path):
    file = file_of(tmp_path, FALLING.replace("[0, 0, 2], terminal = true", "[0, 0, 1], value = -9"))
    first = rom.simulate(file.mechanism(), t_end=0.25, dt=1e-3)
    second = rom.simulate(file.mechanism(), t_end=0.4, dt=1e-3, state=first.final)
    assert first.events["turns"].t.size == 0
    assert_allclose(second.events["turns"].t, [0.3], rtol=1e-9)
    back = replace(second.final, v=-second.final.v)  # from four turns to three again
    third = rom.simulate(file.mechanism(), t_end=0.55, dt=1e-3, state=back)
    assert_allclose(third.events["turns"].t, [0.5], rtol=1e-9)


def test_the_command_tells_when_events_happened(tmp_path, capsys):
    file_of(tmp_path, FALLING.replace('[0, 0, 2], terminal', '[0, 0, 2], value = 0, terminal'),
            dt=5e-3)  # fmt: skip
    out = str(tmp_path / "out")
    told = answer(capsys, "simulate", tmp_path / "m.toml", "-o", out, "-q")["events"]
    assert told["turns"] == pytest.approx([0.3]) and told["never"] == []
    assert json.loads((tmp_path / "out" / "run.json").read_text())["events"] == told
    assert main(["simulate", str(tmp_path / "m.toml"), "-o", out, "--force"]) == 0
    said = capsys.readouterr().out
    assert "Event 'turns' happened once, at 0.3 s." in said
    assert "Event 'never' did not happen." in said


PYTHON = """
import numpy as np


def pull(t, x, v, k, c):
    return -k * x - c * v


def constant(t):
    return 2.0


def spring(t, parameters, motion, memory, out):
    gap = motion.position[1, 0] - motion.position[0, 0] - 1
    out.force[1, 0] = -parameters[0] * gap
    out.force[0, 0] = parameters[0] * gap
    out.energy[0] = parameters[0] * gap**2 / 2


def drag(t, a, c):
    return -c * a.velocity, np.zeros(3)


def late(t, instant):
    return t - 0.25


def wrong(t):
    raise ValueError("no such thing")


number = 3
"""
IN_PYTHON = """
[laws.spring]
markers = ["ground.wall", "block.p"]
file = "laws.py"
function = "spring"
parameters = [800]
energy = true
[laws.drag]
kind = "user_force"
markers = ["block.p"]
file = "laws.py"
function = "drag"
parameters = [5]
[motors.pull]
joint = "guide"
law = { file = "laws.py", function = "pull", parameters = [10, 1] }
[forces.push]
marker = "block.p"
vector = ["3 N", 0, 0]
factor = { file = "laws.py", function = "constant" }
[events.late]
file = "laws.py"
function = "late"
"""


def test_functions_of_a_python_file_run_when_they_are_trusted_and_again_when_it_changes(tmp_path):
    (tmp_path / "laws.py").write_text(PYTHON)
    file = file_of(tmp_path, BLOCK + IN_PYTHON)
    with pytest.raises(UnsafeFileError) as refused:
        file.mechanism()
    assert "m.toml:17: laws.spring.file" in str(refused.value)
    assert "run it with --trust or trust=True" in refused.value.hint
    file = file_of(tmp_path, BLOCK + IN_PYTHON, trust=True)
    made = file.mechanism()
    assert rom.check_law(made, "spring").ok
    sol = file.simulate(made)
    mech, wall, p = block_in_python()
    # spring, drag and motor act along one line: -800*(x - 1) - 5*v - 10*(x - 1.1) - v
    mech.spring_damper("s", wall, p, stiffness=810.0, damping=6.0, free_length=1.0 + 1 / 810)
    mech.force("push", p, (6.0, 0, 0))
    same = rom.simulate(mech, t_end=1.0, dt=1e-3, rho_inf=1.0)
    assert_allclose(sol.q, same.q, atol=1e-7)
    assert_allclose(sol.events["late"].t, [0.25])
    (tmp_path / "laws.py").write_text(PYTHON + "\nprint('run')\n")
    text = BLOCK + IN_PYTHON
    first = file_of(tmp_path, text, trust=True).mechanism()
    (tmp_path / "laws.py").write_text(PYTHON.replace("2.0", "7.0"))
    second = file_of(tmp_path, text, trust=True).mechanism()
    assert [m.loads["push"].function(0.0)[0] for m in (first, second)] == [6.0, 21.0]


PYTHON_MISTAKES = {
    "no such function": ("pull", "pul", "has no function 'pul'. Did you mean pull?"),
    "what it imports": ("pull", "np", "has no function 'np'"),
    "no Python": ("laws.py", "m.toml", "is no Python file"),
    "a file that fails": ("laws.py", "bad.py", "cannot be run: ZeroDivisionError"),
    "a file that leaves": ("laws.py", "exit.py", "cannot be run: SystemExit: 3, line 1"),
}  # fmt: skip


@pytest.mark.parametrize("case", PYTHON_MISTAKES)
def test_what_is_wrong_with_a_python_file_is_told(case, tmp_path):
    old, new, message = PYTHON_MISTAKES[case]
    for name, text in (("laws", PYTHON), ("bad", "1 / 0"), ("exit", "raise SystemExit(3)")):
        (tmp_path / f"{name}.py").write_text(text)
    law = '[motors.pull]\njoint = "guide"\nlaw = { file = "laws.py", function = "pull" }\n'
    text = BLOCK + law.replace(old, new, 1 + (old == "pull"))
    with pytest.raises(rom.RomError) as refused:
        file_of(tmp_path, text, trust=True).mechanism()
    assert message in str(refused.value)


LINE = '[laws.s]\nbetween = ["ground.wall", "block.p"]\n'
MOTOR = '[motors.m]\njoint = "guide"\nlaw = '
EVENT = '[events.e]\nkind = "coordinate"\njoint = "guide"\nvalue = 1\n'
SPREAD = '[spread_loads.p]\nbody = "block"\nacceleration = [0, 0, 1]\n'
COVER = '[contacts.k]\nkind = "surface_on_plane"\nbody = "block"\nmarker = "ground.wall"\n'
MISTAKES = {
    "unknown name": (MOTOR + '{ expression = "3*y" }\n', "there is no 'y'.\n    3*y\n      ^"),
    "x in a drive": (MOTOR.replace("motors", "drives") + '{ expression = "x" }\n', "no 'x'"),
    "function": (MOTOR + '{ expression = "1", constants = { sin = 2 } }\n', "'sin' cannot be a"),
    "law without force": (LINE, "kind is missing in [laws.s]"),
    "line without length": (
        LINE.replace('"ground.wall"', "{ ground = [1.1, 0, 0] }") + 'expression = "x"\n',
        "one place",
    ),
    "falling lengths": (LINE + "x = [2, 1]\nvalues = [1, 2]\n", "that ascend"),
    "lengths and values": (LINE + "x = [1, 2]\nvalues = [1]\n", "needs as many values"),
    "event of nothing": (EVENT.replace("value = 1\n", ""), "has no value it passes"),
    "event of two": (EVENT + 'expression = "x"\n', "has both a value and an expression"),
    "unknown joint": (EVENT.replace("guide", "guid"), "no joint 'guid'. Did you mean guide?"),
    "spread over a rigid body": (SPREAD, "no flexible body 'block'"),
    "surface of a rigid body": (COVER + "normal = [0, 0, 1]\nstiffness = 1\n", "no flexible body"),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_a_mistake_of_a_law_or_event_is_told(case, tmp_path):
    more, message = MISTAKES[case]
    with pytest.raises(ConfigError) as refused:
        file_of(tmp_path, BLOCK + more).mechanism()
    assert message in str(refused.value)
    assert refused.value.where.partition("m.toml:")[2] in map(str, range(14, 20))


@pytest.mark.long
@pytest.mark.once
def test_an_fmu_has_formulas_and_python_functions(tmp_path, monkeypatch):
    fmpy = pytest.importorskip("fmpy", reason="fmpy is not installed")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    (tmp_path / "laws.py").write_text(PYTHON)
    file = file_of(tmp_path, BLOCK + IN_PYTHON + DUFFING.replace("laws.spring", "laws.more"),
                   t_end=0.2, trust=True)  # fmt: skip
    fmu = rom.write_mechanism_fmu(file, tmp_path / "m.fmu", outputs=["block.p"])
    sol = file.simulate()
    (tmp_path / "laws.py").unlink()
    (tmp_path / "m.toml").unlink()
    found = fmpy.simulate_fmu(str(fmu), stop_time=0.2, step_size=1e-3, output_interval=1e-3,
                              fmi_type="CoSimulation", output=["block.p.position[1]"])  # fmt: skip
    assert_allclose(found["block.p.position[1]"], sol.position("block")[:, 0], atol=1e-9)
    with zipfile.ZipFile(fmu) as archive:
        assert any(name.endswith("laws.py") for name in archive.namelist())


def test_an_event_that_ends_the_run_cannot_go_into_an_fmu(tmp_path):
    file = file_of(tmp_path, BLOCK + DUFFING + "terminal = true\n")
    refuses(ConfigError, "event 'middle' ends", rom.write_mechanism_fmu, file, tmp_path / "m.fmu")
    assert not (tmp_path / "m.fmu").exists()


def test_an_event_of_its_own_follows_what_it_asks_for():
    mech, *_ = block_in_python()
    refuses(ConfigError, "no joint 'guid'", mech.event, "far", lambda t, now: 1.0, follow=["guid"])
    assert not mech.events
    mech.event("far", lambda t, now: now.joint("guide")[0] - 1)
    refuses(ConfigError, "'guide' is not followed", rom.simulate, mech, t_end=0.1, dt=0.01)


def test_the_file_of_the_page_about_laws_moves(tmp_path):
    page = (ROOT / "docs" / "laws.md").read_text()
    (tmp_path / "m.toml").write_text(page.split("```toml\n")[1].split("```")[0])
    file = rom.read_mechanism(tmp_path / "m.toml")
    made = file.mechanism()
    assert rom.check_law(made, "spring").ok and rom.check_law(made, "bump").ok
    sol = file.simulate(made)
    assert sol.events["middle"].t.size > 1 and rom.audit(sol).ok
    assert all(f" {name}" in page.replace("`", " ") for name in FUNCTIONS)
