"""Ctrl-C, SIGTERM and kill -9 at random instants of a run: its motion stays and goes on."""

import json
import os
import random
import signal
import sys
import time
from pathlib import Path

import pytest

import rom
from cases.long import ROM_LONG, few
from rom.cli.main import main
from rom.mbs.integrate import keeping

pytestmark = pytest.mark.once

KILLS = 10 if ROM_LONG else 2
MECHANISM = """
gravity = [0, 0, -9.81]
ground.place = [0, 0, 0]
[bodies.one]
mass = 1.0
inertia = [0.1, 0.1, 0.1]
at = [0.5, 0, 0]
markers = { a = [-0.5, 0, 0], b = [0.5, 0, 0] }
[bodies]
two = { mass = 1.0, inertia = [0.1, 0.1, 0.1], at = [1.5, 0, 0], markers = { a = [-0.5, 0, 0] } }
[joints]
hinge = { kind = "revolute", between = ["ground.place", "one.a"], axis = [0, 1, 0] }
knee = { kind = "revolute", between = ["one.b", "two.a"], axis = [0, 1, 0] }
[forces.push]
marker = "two.a"
vector = [0, 0, 1]
factor = { kind = "harmonic", amplitude = 1.0, frequency = 3.0 }
[simulation]
t_end = 1.0
dt = 4e-6
save_every = 250
"""
RUN = ("simulate", "pendulum.toml", "-o", "out")


def started(*arguments):
    """A process of its own that has everything loaded already, and writes parts often."""
    child = os.fork()
    if child:
        return child
    code = 99
    try:
        with Path("said.txt").open("w") as sys.stderr, Path(os.devnull).open("w") as sys.stdout:
            keeping.MIN_INTERVAL = keeping.WRITE_TIME_FACTOR = 0.02
            code = main(list(arguments))
    finally:
        os._exit(code)


def files(folder):
    """Content of the files of a run; without the command line, which `--resume` changes."""
    found = {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}
    record = json.loads(found["run.json"])
    return found | {"run.json": {k: v for k, v in record.items() if k != "command"}}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    (folder / "pendulum.toml").write_text(MECHANISM)
    assert main(["simulate", str(folder / "pendulum.toml"), "-o", str(folder / "out"), "-q"]) == 0
    return files(folder / "out")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "pendulum.toml").write_text(MECHANISM)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def kill_within(folder, number, rng, *more):
    """Start a run, end it some time after it wrote a part; its exit code, and what it said."""
    state = folder / "out" / "motion.parts" / "state.npz"
    before = state.stat().st_mtime_ns if state.exists() else 0
    child, end, ended = started(*RUN, *more), time.monotonic() + 100, 0
    while not ended and not (state.exists() and state.stat().st_mtime_ns > before):
        assert time.monotonic() < end
        time.sleep(0.002)
        ended, status = os.waitpid(child, os.WNOHANG)
    if not ended:
        time.sleep(rng.uniform(0.0, 0.2))
        os.kill(child, number)
        _, status = os.waitpid(child, 0)
    return os.waitstatus_to_exitcode(status), (folder / "said.txt").read_text()


@pytest.mark.long
@pytest.mark.parametrize("number", few(1, [signal.SIGKILL, signal.SIGINT, signal.SIGTERM]))
def test_a_run_that_is_killed_goes_on_to_the_same_bits(number, whole, folder, capsys):
    rng, more = random.Random(int(number)), ()
    for _ in range(KILLS):
        code, err = kill_within(folder, number, rng, *more)
        if code == 0:
            break  # it was faster than the signal
        more = ("--resume",)
        if number == signal.SIGKILL:
            assert code == -signal.SIGKILL
            continue
        assert code == 7, err
        assert "error: " in err and "interrupted at t = " in err and "Traceback" not in err
        assert "--resume" in err.splitlines()[-1]
        record = json.loads((folder / "out" / "run.json").read_text())
        assert record["status"].startswith("interrupted at t = ")
        motion = (folder / "out" / "motion.csv").read_bytes()
        assert whole["motion.csv"].startswith(motion[: motion.rindex(b"\n", 0, -1)])
    assert main([*RUN, *more, "-q"]) == 0, capsys.readouterr().err
    assert files(folder / "out") == whole
    assert sorted(os.listdir("out")) == ["motion.csv", "run.json", "scene.json"]
    if more:
        assert main([*RUN, "--resume"]) == 2
        assert "came to its end" in capsys.readouterr().err


def test_after_a_kill_the_motion_up_to_the_last_part_can_be_read(whole, folder, capsys):
    code, reached = 0, 0.0
    while reached < 0.01:  # the first part may hold the start alone
        more = ("--resume",) if (folder / "out").exists() else ()
        code, _ = kill_within(folder, signal.SIGKILL, random.Random(3), *more)
        reached = rom.load_state("out/motion.parts/state.npz").t
    assert code == -signal.SIGKILL and reached < 1.0
    assert main([*RUN, "--resume", "--t-end", repr(reached), "-q"]) == 0
    motion = (folder / "out" / "motion.csv").read_bytes()
    assert len(motion) > 1000 and whole["motion.csv"].startswith(motion)


CHANGES = [
    (("--dt", "8e-6"), "another dt"),
    (("--gravity", "0,0,-1"), "another gravity"),
    (("mass = 1.0", "mass = 2.0"), "another bodies 'one'"),
    (("save_every = 250", "save_every = 3"), "another save_every"),
    (("--t-end", "1.000001"), "would change the steps"),
]


def test_a_run_that_is_another_or_not_there_is_not_resumed(folder, capsys):
    assert main([*RUN, "--resume"]) == 2
    assert "nothing to resume" in capsys.readouterr().err
    assert not (folder / "out").exists()
    kill_within(folder, signal.SIGKILL, random.Random(4))
    for change, words in CHANGES:
        more = change if change[0].startswith("--") else ()
        text = MECHANISM if more else MECHANISM.replace(*change, 1)
        (folder / "pendulum.toml").write_text(text)
        assert main([*RUN, "--resume", *more]) == 2
        assert words in " ".join(capsys.readouterr().err.split())
        assert main([*RUN, *more]) == 2
        assert "did not come to its end" in capsys.readouterr().err
    assert (folder / "out" / "motion.parts" / "state.npz").exists()


def test_a_film_that_is_interrupted_takes_nothing_away(folder, monkeypatch, capsys):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    short = [*RUN, "--t-end", "0.01", "-q"]
    with monkeypatch.context() as patch:
        patch.setattr("rom.view.scenes.animation_files.write_animation", interrupted)
        assert main([*short, "--film", "glb"]) == 7
    assert sorted(os.listdir("out")) == ["motion.csv", "run.json"]
    before = files(folder / "out")
    with monkeypatch.context() as patch:
        patch.setattr("rom.mbs.integrate.run.Record.pause", interrupted)
        patch.setattr("rom.io.history.write_whole", interrupted)
        assert main(short) == 7
    assert files(folder / "out") == before
    assert sorted(os.listdir("out/motion.parts")) == ["part-000001.npz", "state.npz"]
    assert main([*short, "--resume"]) == 0
    found = files(folder / "out")
    assert found.keys() - before.keys() == {"scene.json"}
    assert {name: found[name] for name in before if name != "run.json"} == {
        name: content for name, content in before.items() if name != "run.json"
    }
