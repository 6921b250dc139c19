"""Without the libraries one lacks, in circumstances one does not choose, and beside others."""

import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

import rom
from cases.command import python, ran
from generated.case import Works, case, require
from generated.stock import body, pendulum
from rom.cli.main import main

MISSING = {  # a library, and a command that needs it
    "h5py": "simulate pendulum.toml --history h5 -o out",
    "pyvista": "view good.npz -o a.png",
    "matplotlib": "view good.npz -o a.png",
    "dolfinx": "modes box.geo --E 210e9 --nu 0.3 --rho 7850",
}
NO = "/proc/none"
CIRCUMSTANCES = {  # of the environment: none of them changes what is computed
    "no HOME": {"HOME": None},
    "a HOME that is not there": {"HOME": "/nowhere"},
    "places nobody can write": {"HOME": NO, "XDG_CACHE_HOME": NO, "NUMBA_CACHE_DIR": NO},
    "a German locale": {"LC_ALL": "de_DE.UTF-8", "LANG": "de_DE.UTF-8"},
    "the locale C": {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii"},
    "a TMPDIR that is not there": {"TMPDIR": "/nowhere"},
    "no PATH": {"PATH": ""},
    "warnings as errors": {"PYTHONWARNINGS": "error"},
    "optimised": {"PYTHONOPTIMIZE": "2"},
    "an odd hash": {"PYTHONHASHSEED": "7", "TZ": "Asia/Kathmandu"},
}


def started(*words, **environment):
    """A finished process of rom, with some variables changed or taken away."""
    env = {k: v for k, v in (os.environ | environment).items() if v is not None}
    done = python("-m", "rom", *words, env=env, stdin=subprocess.DEVNULL)
    require(done.returncode == 0, f"exit code {done.returncode}: {done.stderr[-500:]!r}")


def without(library, words):
    """A command where a library is not installed, although it is here."""

    def act(folder):
        code = (
            f"import sys; sys.modules[{library!r}] = None; from rom.cli.main import main; "
            f"sys.exit(main({words.split()!r}))"
        )
        done = ran(sys.executable, "-P", "-c", code)
        require("Traceback" not in done.stderr, done.stderr[-500:])
        require(done.returncode == 6, f"exit code {done.returncode}: {done.stderr[-300:]}")
        raise rom.ResourceError(done.stderr)

    return act


def threads(work, n=4):

    def act(folder):
        with ThreadPoolExecutor(n) as pool:
            found = list(pool.map(lambda _: work(folder), range(n)))
        require(all(np.array_equal(found[0], x) for x in found), "threads disagree")

    return act


def written(folder):
    rom.save(body(), folder / "same.npz")
    return rom.load(folder / "same.npz").K


def in_a_gone_folder(call, wanted):
    """The working folder is deleted while one works in it."""

    def act(folder):
        inner = folder / "inner"
        inner.mkdir()
        os.chdir(inner)
        inner.rmdir()
        try:
            found = call(folder)
        finally:
            os.chdir(folder)
        require(found == wanted, found)

    return act


def same_bits(folder):
    """Two processes of different hash seeds compute the same bits."""
    for name, seed in (("a", "1"), ("b", "2")):
        started("simulate", "pendulum.toml", "-o", name, "-q", PYTHONHASHSEED=seed)
    one, other = ((folder / name / "motion.csv").read_bytes() for name in "ab")
    require(one == other, "bits")


def locked(folder):
    """A mechanism that locks leaves the motion until then."""
    code = main(["simulate", "lock.toml", "-o", "out", "-q"])
    require(code == 5, f"exit code {code}")
    rows = (folder / "out/motion.csv").read_text().splitlines()[1:]
    require(len(rows) >= 15, "most of the motion is lost")


def peak():
    """Most memory that was resident [kB]."""
    return int(re.search(r"VmHWM:\s*(\d+)", Path("/proc/self/status").read_text())[1])


def growth(folder):
    """Memory of many steps of which few are kept: below a kilobyte a step."""
    rom.simulate(pendulum(), t_end=1.0, dt=1e-3, save_every=100)
    Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
    before = peak()
    rom.simulate(pendulum(), t_end=50.0, dt=1e-3, save_every=10_000)
    grown = (peak() - before) / 50_000
    require(grown < 1, f"{grown} kB a step")


CASES = [
    # two of them need others, which the light environment has not either and names first
    *(case(f"without {name}", without(name, words), rom.ResourceError, name, leaves=True,
           fe=name in ("pyvista", "dolfinx"))
      for name, words in MISSING.items()),
    *(case(f"check with {name}", lambda folder, env=env: started("check", "good.npz", **env), Works)
      for name, env in CIRCUMSTANCES.items()),
    case("a German locale and a geometry",
         lambda folder: started("mesh", "box.geo", **CIRCUMSTANCES["a German locale"]), Works, fe=True),
    case("motions in threads", threads(lambda folder: rom.simulate(pendulum(), t_end=0.05, dt=0.01).q), Works),
    case("reductions in threads", threads(lambda folder: body().frequencies(8)), Works),
    case("one file from several threads", threads(written), Works),
    case("a folder that is gone", in_a_gone_folder(
        lambda folder: main(["check", str(folder / "good.npz"), "-q"]), 0), Works),
    case("a folder that is gone as output",
         in_a_gone_folder(lambda folder: rom.save(body(), "a.npz"), None), (rom.ConfigError, rom.ResourceError), ("a.npz", "folder")),
    case("two processes, the same bits", same_bits, Works),
    case("a mechanism that locks", locked, Works),
    case("a mechanism that locks, by name", "simulate lock.toml -o out", rom.SolverError, "rod", leaves=True),
    case("many steps", growth, Works),
]  # fmt: skip
