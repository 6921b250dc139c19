"""Turns of processes, and what a user who waits is told."""

import logging
import os
import subprocess
import sys
import time

import pytest

from cases.command import environment
from rom.process import patience
from rom.process.patience import LOCK_FILE, Patience, Turns

HOLD = """
import sys, time
from pathlib import Path
from rom.process.patience import Turns
turns = Turns()
for name in sys.argv[1].split(","):
    print(turns.take(Path(name)), flush=True)
    input()
"""


def hold(*paths):
    """A process that takes turns, the next with every line it is sent; the first is taken."""
    command = [sys.executable, "-c", HOLD, ",".join(map(str, paths))]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    process = subprocess.Popen(command, text=True, env=environment(), **pipes)
    assert process.stdout.readline() == "True\n"
    return process


def test_a_turn_ends_with_its_process_or_when_it_is_over(tmp_path):
    turns, path = Turns(), tmp_path / "made"
    with hold(path) as other:
        assert not turns.take(path, wait=False)
        assert turns.take(tmp_path / "another", wait=False)
        began = time.perf_counter()
        os.kill(other.pid, 9)
        assert turns.take(path)
    assert time.perf_counter() - began < 60
    turns, paths = Turns(), [tmp_path / name for name in "abc"]
    assert all(turns.take(path) for path in paths[1:])
    with hold(*paths) as other:
        other.stdin.write("\n")
        other.stdin.flush()
        time.sleep(0.3)
        turns.end(paths[1])
        assert other.stdout.readline() == "True\n"
        other.stdin.write("\n")
        other.stdin.flush()
        time.sleep(0.3)
        turns.end_all()
        assert other.stdout.readline() == "True\n"
        assert not any(turns.take(path, wait=False) for path in paths)
        other.kill()


def test_processes_that_would_wait_for_each_other_do_not(tmp_path):
    turns, (a, b) = Turns(), (tmp_path / "a", tmp_path / "b")
    assert turns.take(b)
    with hold(a, b) as other:
        other.stdin.write("\n")  # now it waits for b
        other.stdin.flush()
        time.sleep(0.5)
        assert not turns.take(a)
        other.kill()


def test_turns_leave_one_file_in_the_folder_and_nobody_waits_where_there_is_none(tmp_path):
    turns = Turns()
    assert turns.take(tmp_path / "a") and turns.take(tmp_path / "b") and turns.take(tmp_path / "a")
    turns.end_all()
    assert os.listdir(tmp_path) == [LOCK_FILE]
    (tmp_path / "file").touch()
    for folder in ("missing", "file"):
        assert not turns.take(tmp_path / folder / "made")
    turns.end_all()


class Clock:
    """Seconds that pass only when a test says so."""

    now = 0.0

    def __call__(self):
        return self.now


@pytest.fixture()
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(patience, "perf_counter", clock)
    return clock


def work(clock, parts, each):
    """Do parts that take so many seconds each, where one is usual."""
    waiting = Patience(1e-3)
    for k in range(parts):
        waiting.begin()
        clock.now += each
        waiting.advance(1000, lambda k=k: 1000 * (parts - k - 1), "{} s".format)
        waiting.end()
        clock.now += 100.0  # of something else


@pytest.mark.parametrize(
    ("parts", "each", "said"),
    [
        (40, 1.0, ["40 s"]),  # after two seconds, 38 are to come
        (40, 0.5, ["25 s"]),  # twice as fast as foretold: (2 + 2) s / (4 + 2) parts, 36 to come
        (40, 2.5, ["60 s"]),  # and slower: 4.5 s / 3 parts, 39 to come
        (2, 5.0, ["5 s"]),
        (4, 1.0, []),  # two seconds are left
        (1000, 1e-3, []),
    ],
)
def test_long_waits_are_foretold_from_what_was_done(clock, caplog, parts, each, said):
    work(clock, parts, each)
    assert caplog.messages == said


def test_a_wait_far_beyond_what_was_foretold_is_foretold_anew(clock, caplog):
    """Ten seconds come, then each part takes ten times as long."""
    waiting = Patience(1e-3)
    waiting.begin()
    for k in range(12):
        clock.now += 1.0 if k < 2 else 10.0
        waiting.advance(1000, lambda k=k: 1000 * (11 - k), "{}".format)
    first, again = map(float, caplog.messages)
    assert first == 10.0
    assert 30.0 <= again <= 80.0


@pytest.mark.parametrize("how", ["another rank", "quiet"])
def test_nothing_is_said_where_nobody_wants_to_hear_it(clock, caplog, monkeypatch, how):
    if how == "quiet":
        caplog.set_level(logging.ERROR, logger="rom")
    else:
        monkeypatch.setenv("OMPI_COMM_WORLD_RANK", "1")
        monkeypatch.setenv("OMPI_COMM_WORLD_SIZE", "2")
    work(clock, 40, 1.0)
    monkeypatch.setattr(patience, "SHORT_WAIT", 0.01)
    with Patience(1.0).blocked("waiting"):
        time.sleep(0.1)
    assert not caplog.messages


def test_waiting_for_another_process_is_said_once_and_only_if_it_is_long(caplog, monkeypatch):
    monkeypatch.setattr(patience, "SHORT_WAIT", 0.1)
    waiting = Patience(1.0)
    with waiting.blocked("waiting"):
        pass
    time.sleep(0.2)
    assert not caplog.messages
    for _ in range(2):
        with waiting.blocked("waiting"):
            time.sleep(0.2)
    assert caplog.messages == ["waiting"]
