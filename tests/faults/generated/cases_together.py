"""Without the libraries one lacks, in circumstances one does not choose, and beside others."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np

import rom
from cases.command import python, ran
from generated.case import Works, case, require
from generated.stock import KINDS, STEEL, body, model, pendulum
from rom.cli.main import main
from rom.errors import ConfigError, ResourceError, RomError

MISSING = {  # a library, a command that needs it, and a word of the refusal
    "h5py": "simulate pendulum.toml --history h5 -o out",
    "pyvista": "view good.npz -o a.png",
    "matplotlib": "view good.npz -o a.png",
    "dolfinx": f"modes box.geo {STEEL}",
}
LIGHT = {
    "check": ["check", "good.npz"],
    "export": ["export", "good.npz", "a.vtu"],
    "simulate": ["simulate", "pendulum.toml", "-o", "out", "-q"],
    "reduce": ["reduce", "part.toml", "-o", "a.npz"],
}
CIRCUMSTANCES = {  # of the environment: none of them changes what is computed
    "no HOME": {"HOME": None},
    "a HOME that is not there": {"HOME": "/nowhere"},
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
    return python("-m", "rom", *words, env=env, stdin=subprocess.DEVNULL)


def beginning(*words):
    return subprocess.Popen([sys.executable, "-m", "rom", *words], stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE)  # fmt: skip


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
        raise ResourceError(done.stderr)

    return act


def in_circumstances(environment, words):
    def act(folder):
        done = started(*words, **environment)
        require(done.returncode == 0, f"exit code {done.returncode}: {done.stderr[-500:]!r}")

    return act


def several(n, words, output):
    """The same command at the same time: each ends well, or says what is in its way."""

    def act(folder):
        runs = [beginning(*words) for _ in range(n)]
        ended = [(*run.communicate(timeout=60), run.returncode) for run in runs]
        codes = [code for *_, code in ended]
        require(set(codes) <= {0, 2, 6} and 0 in codes, f"{codes}: {ended[0][1][-300:]!r}")
        require(not [err for _, err, _ in ended if b"Traceback" in err], "a traceback")
        output(folder)

    return act


def threads(work, n=4):
    """The same call in several threads."""

    def act(folder):
        with ThreadPoolExecutor(n) as pool:
            found = list(pool.map(lambda k: work(folder, k), range(n)))
        require(all(np.array_equal(found[0], x) for x in found), "threads disagree")

    return act


def motion(folder, k):
    return rom.simulate(pendulum(), t_end=0.05, dt=0.01).q


def frequencies(folder, k):
    return body().frequencies(8)


def written(folder, k):
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
        done = started("simulate", "pendulum.toml", "-o", name, "-q", PYTHONHASHSEED=seed)
        require(done.returncode == 0, done.stderr[-300:])
    one, other = ((folder / name / "motion.csv").read_bytes() for name in "ab")
    require(one == other, "bits")


def again(folder):
    """An error in one call leaves the next one alone."""
    for _ in range(3):
        try:
            rom.reduce(model(), method=rom.CraigBampton(99), interfaces=KINDS)
        except RomError:
            pass
    require(np.isfinite(body().frequencies(8)).all(), "no frequencies")


CASES = [
    # two of them need others, which the light environment has not either and names first
    *(case(f"without {name}", without(name, words), ResourceError, name, leaves=True,
           fe=name in ("pyvista", "dolfinx"))
      for name, words in MISSING.items()),
    *(case(f"{what} with {name}", in_circumstances(environment, LIGHT[what]), Works)
      for name, environment in CIRCUMSTANCES.items()
      for what in (("simulate",) if name in ("no HOME",) else ("check",))),
    case("a German locale and a geometry", in_circumstances(CIRCUMSTANCES["a German locale"], ["mesh", "box.geo"]),
         Works, fe=True),
    case("three meshes at once", several(3, ["mesh", "box.geo"], lambda folder: None), Works, fe=True),
    case("motions in threads", threads(motion), Works),
    case("reductions in threads", threads(frequencies), Works),
    case("one file from several threads", threads(written), Works),
    case("a folder that is gone", in_a_gone_folder(
        lambda folder: main(["check", str(folder / "good.npz"), "-q"]), 0), Works),
    case("a folder that is gone as output",
         in_a_gone_folder(lambda folder: rom.save(body(), "a.npz"), None), (ConfigError, ResourceError), ("a.npz", "folder")),
    case("two processes, the same bits", same_bits, Works),
    case("a call after an error", again, Works),
]  # fmt: skip
