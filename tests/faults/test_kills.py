"""Signals at any instant: no process is left behind, and no folder but by SIGKILL, for one run.

One seeded instant of each kind, and the instant that matters; ten with ROM_LONG=1.
"""

import random
import signal
import subprocess
import sys
import time
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

import pytest

from cases.boxes import BOX_GEO
from cases.command import alive, environment, wait_until
from cases.long import ROM_LONG, few

pytestmark = [
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc"),
    pytest.mark.fenicsx,
]
INSTANTS = 10 if ROM_LONG else 1
PATIENCE = 2.0  # seconds in which everything must be gone
SLOW = BOX_GEO.replace("= 1;", "= 0.05;") + "Sleep 20;\n"
FILM = """
from rom.process.interruption import heed_lost_signals
heed_lost_signals()
import numpy as np
from rom.view.canvas.offscreen import render
from rom.view.canvas.scene import Actor, Camera
rng = np.random.default_rng(0)
camera = Camera(np.zeros(3), np.eye(3)[2], np.eye(3)[1], 2.0, (400, 300))
render([Actor(rng.random((400, 300, 3)), rng.integers(0, 300, (4000, 3)))], camera)
open("film", "w").close()
"""
STEEL = ("--E", "210e9", "--nu", "0.3", "--rho", "7850")
WORK = {  # command, and seconds within which it is hit
    "mesh": (["-m", "rom", "mesh", "slow.geo", "--save", "x.vtu"], 2.0),
    "reduce": (["-m", "rom", "reduce", "slow.geo", *STEEL, "-i", "root=rbe2", "-o", "x.rom.npz"],
               3.0),
    "film": (["-P", "-c", FILM], 3.0),
}  # fmt: skip
NEEDS = {"mesh": "gmsh", "reduce": "dolfinx", "film": "pyvista"}
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)


def processes(mark):
    """Numbers of living processes that have the mark in their environment."""
    found = []
    for path in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            if alive(path.name) and mark in (path / "environ").read_bytes():
                found.append(int(path.name))
    return found


def meshes(pid):
    try:
        return "libgmsh" in Path(f"/proc/{pid}/maps").read_text()
    except OSError:
        return False


# each work and each signal once; with more time all pairs
HIT = [(work, number) for i, work in enumerate(WORK) for j, number in enumerate(SIGNALS)
       if ROM_LONG or i == j]  # fmt: skip


@pytest.mark.parametrize(("work", "number"), HIT)
def test_a_signal_at_any_instant_leaves_nothing(work, number, tmp_path):
    if find_spec(NEEDS[work]) is None:
        pytest.skip(f"{NEEDS[work]} is not installed")
    rng = random.Random(f"{work} {number}")
    command, longest = WORK[work]
    temporary = tmp_path / "tmp"
    temporary.mkdir()
    (tmp_path / "slow.geo").write_text(SLOW)
    for k in range(INSTANTS):
        mark = f"{tmp_path}-{k}"
        env = environment(TMPDIR=str(temporary), ROM_TEST_MARK=mark, PYTHONDONTWRITEBYTECODE="1")
        before = set(tmp_path.iterdir())
        # Python itself has its handler of Ctrl-C after its first tenth of a second
        wait = rng.uniform(0.3, longest)
        process = subprocess.Popen([sys.executable, *command], env=env, cwd=tmp_path,
                                   stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)  # fmt: skip
        time.sleep(wait)
        process.send_signal(number)
        process.communicate(timeout=20)
        wait_until(lambda mark=mark: not processes(mark.encode()), PATIENCE)
        if number != signal.SIGKILL:
            assert not list(temporary.glob("rom-*")), f"after {wait:.2f} s"
        assert len(list(temporary.glob("rom-*"))) <= 1, "the run before is not swept"
        assert process.returncode in (-number, 7, 0, 1)
        assert set(tmp_path.iterdir()) - {tmp_path / "film"} <= before


@pytest.mark.parametrize("number", few(1, SIGNALS), ids=lambda n: n.name)
def test_a_signal_while_the_mesher_works_is_survived_by_nobody(number, tmp_path):
    if find_spec("gmsh") is None:
        pytest.skip("gmsh is not installed")
    (tmp_path / "slow.geo").write_text(SLOW)
    mark = str(tmp_path)
    env = environment(TMPDIR=str(tmp_path), ROM_TEST_MARK=mark)
    command = [sys.executable, "-m", "rom", "mesh", "slow.geo"]
    process = subprocess.Popen(command, env=env, cwd=tmp_path, stdout=subprocess.DEVNULL,
                               stderr=subprocess.PIPE)  # fmt: skip
    wait_until(lambda: any(map(meshes, processes(mark.encode()))), 30)
    time.sleep(0.3)  # now it reads the script
    process.send_signal(number)
    _, said = process.communicate(timeout=20)
    killed = number == signal.SIGKILL
    assert process.returncode == (-number if killed else 7)
    assert (b"error: interrupted." in said) != killed and b"Traceback" not in said
    wait_until(lambda: not processes(mark.encode()), PATIENCE)
    assert len(list(tmp_path.glob("rom-mesh-*"))) == killed
    (tmp_path / "slow.geo").write_text(SLOW.replace("Sleep 20;", ""))
    assert subprocess.run(command, env=env, cwd=tmp_path, capture_output=True).returncode == 0
    assert not list(tmp_path.glob("rom-*"))
