"""Ctrl-C, SIGTERM and kill -9 at random instants of `rom simulate`: the motion stays and goes on."""

import json
import os
import random
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from command import environment

from rom.cli.main import main

KILLS = 10 if os.environ.get("ROM_LONG") else 3
MECHANISM = """
gravity = [0, 0, -9.81]
ground.place = [0, 0, 0]
[bodies.one]
mass = 1.0
inertia = [0.1, 0.1, 0.1]
at = [0.5, 0, 0]
markers = { a = [-0.5, 0, 0], b = [0.5, 0, 0] }
[bodies.two]
mass = 1.0
inertia = [0.1, 0.1, 0.1]
at = [1.5, 0, 0]
markers = { a = [-0.5, 0, 0] }
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
save_every = 300
"""
# parts are written more often than a run of a few seconds would have them
OFTEN = (
    "import sys\nfrom rom.mbs import keeping\nkeeping.INTERVAL = keeping.PATIENCE = 0.02\n"
    "from rom.cli.main import main\nsys.exit(main(sys.argv[1:]))"
)
RUN = ("simulate", "pendulum.toml", "-o", "out")


def started(*arguments):
    return subprocess.Popen(
        [sys.executable, "-c", OFTEN, *arguments],
        env=environment(OMP_NUM_THREADS="1"), stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True,
    )  # fmt: skip


def files(folder):
    """Content of the files of a run; without the command line, which `--resume` changes."""
    found = {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}
    record = json.loads(found["run.json"])
    return found | {"run.json": {k: v for k, v in record.items() if k != "command"}}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The mechanism file, and the files of a run that nothing interrupts."""
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
    """Start a run and end it some time after its first part; None if it was faster."""
    process, state = started(*RUN, *more), folder / "out" / "motion.parts" / "state.npz"
    before = state.stat().st_mtime_ns if state.exists() else None
    end = time.monotonic() + 60
    while process.poll() is None and (not state.exists() or state.stat().st_mtime_ns == before):
        assert time.monotonic() < end
        time.sleep(0.005)
    time.sleep(rng.uniform(0.0, 0.3))
    process.send_signal(number)
    out, err = process.communicate(timeout=60)
    return process.returncode, out, err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_run_that_is_killed_goes_on_to_the_same_bits(number, whole, folder, capsys):
    rng, more = random.Random(int(number)), ()
    for _ in range(KILLS):
        code, _, err = kill_within(folder, number, rng, *more)
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
    assert sorted(os.listdir("out")) == ["motion.csv", "run.json"]
    if more:
        assert main([*RUN, "--resume"]) == 2
        assert "came to its end" in capsys.readouterr().err


def test_after_a_kill_the_motion_up_to_the_last_part_can_be_read(whole, folder, capsys):
    assert kill_within(folder, signal.SIGKILL, random.Random(3))[0] == -signal.SIGKILL
    with np.load("out/motion.parts/part-000001.npz") as part:
        reached = part["t"][-1]
    assert 0.0 < reached < 1.0
    assert main([*RUN, "--resume", "--t-end", repr(float(reached)), "-q"]) == 0
    motion = (folder / "out" / "motion.csv").read_bytes()
    assert len(motion) > 1000 and whole["motion.csv"].startswith(motion)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("--dt", "8e-6"), "another dt"),
        (("--gravity", "0,0,-1"), "another gravity"),
        (("mass = 1.0", "mass = 2.0"), "another bodies 'one'"),
        (("save_every = 300", "save_every = 3"), "another save_every"),
        (("--t-end", "1.000001"), "would change the steps"),
    ],
)
def test_another_run_is_refused_by_the_name_of_what_differs(change, words, folder, capsys):
    kill_within(folder, signal.SIGKILL, random.Random(4))
    if change[0].startswith("--"):
        more = change
    else:
        (folder / "pendulum.toml").write_text(MECHANISM.replace(*change, 1))
        more = ()
    assert main([*RUN, "--resume", *more]) == 2
    assert words in " ".join(capsys.readouterr().err.split())
    assert main([*RUN, *more]) == 2
    assert "did not come to its end" in capsys.readouterr().err
    assert (folder / "out" / "motion.parts" / "state.npz").exists()


def test_where_there_is_nothing_to_resume_it_says_so(folder, capsys):
    assert main([*RUN, "--resume"]) == 2
    assert "nothing to resume" in capsys.readouterr().err
    assert not (folder / "out").exists()
