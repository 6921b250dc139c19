"""What was computed of a motion is kept, whatever ends it."""

import json
import resource
import signal
import subprocess
import sys
import time

import rom
from generated.case import Works, case, edit, require, write
from generated.stock import pendulum
from rom.cli.main import main
from rom.errors import (
    ConfigError,
    FileFormatError,
    ResourceError,
    SolverError,
)

LONG = "simulate pendulum.toml --t-end 2e3 --dt 1e-3 -o out"
STEPS = {
    "no step": ({"dt": 0.0}, "dt"),
    "a step back": ({"dt": -0.01}, "dt"),
    "an end before the start": ({"dt": 0.01, "t_start": 1.0}, "t_end"),
    "a step that is no number": ({"dt": float("nan")}, "dt"),
}
RESUMED = {  # what is wrong with the folder from which a run goes on
    "no folder": (lambda folder: None, "out"),
    "an empty folder": (lambda folder: (folder / "out").mkdir(), "out"),
    "a file": (write("out", "mine"), "out"),
}


def stepped(numbers):
    return lambda folder: rom.simulate(pendulum(), **({"t_end": 0.1} | numbers))


def rows(folder):
    """Lines of the table that was left, without the first."""
    require((folder / "out/motion.csv").is_file(), "the motion is lost")
    return (folder / "out/motion.csv").read_text().splitlines()[1:]


def stopped(number, code):
    """`rom simulate` that gets a signal leaves with a code, and with what it computed."""

    def act(folder):
        run = subprocess.Popen([sys.executable, "-m", "rom", *LONG.split(), "-q"])
        while run.poll() is None and not (folder / "out/motion.parts/state.npz").exists():
            time.sleep(0.05)
        run.send_signal(number)
        require(run.wait(30) == code, f"exit code {run.returncode}")
        reached = json.loads((folder / "out/run.json").read_text())["t_end"]
        last = float(rows(folder)[-1].split(",")[0])
        require(last > 0.01 and abs(last - reached) < 1e-9, f"{last} s of {reached} s are there")

    return act


def locked(folder):
    """A mechanism that locks leaves the motion until then."""
    code = main(["simulate", "lock.toml", "-o", "out", "-q"])
    require(code == 5, f"exit code {code}")
    require(len(rows(folder)) >= 15, "most of the motion is lost")


def full(line):
    """A disk that takes no more than some kilobytes: the old limit holds again afterwards."""

    def act(folder):
        before = resource.getrlimit(resource.RLIMIT_FSIZE)
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
        try:
            line(folder)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)

    return act


def history(folder):
    rom.write_history(rom.simulate(pendulum(), t_end=0.5, dt=0.001), folder / "a.csv")


CASES = [
    case("SIGTERM to rom simulate", stopped(signal.SIGTERM, 7), Works),
    case("Ctrl-C to rom simulate", stopped(signal.SIGINT, 7), Works),
    *(case(name, stepped(numbers), ConfigError, word) for name, (numbers, word) in STEPS.items()),
    case("a step of 1e-18 s on the command line", "simulate pendulum.toml --dt 1e-18 -o out",
         (ConfigError, ResourceError), "1e-18"),
    case("a step of 1e-18 s in the file", "simulate pendulum.toml -o out", (ConfigError, ResourceError),
         "1e-18", given=edit("pendulum.toml", "dt = 0.01", "dt = 1e-18")),
    case("a step of 1e-18 s of a body", "simulate good.npz --hinge root --t-end 1 --dt 1e-18 -o out",
         (ConfigError, ResourceError), "1e-18"),
    case("a mechanism that locks", locked, Works),
    case("a mechanism that locks, by name", "simulate lock.toml -o out", SolverError, "rod", leaves=True),
    *(case(f"a run that goes on from {name}", "simulate pendulum.toml -o out --resume",
           (ConfigError, FileFormatError), word, given=given)
      for name, (given, word) in RESUMED.items()),
    case("a full disk for a table", full(history), ResourceError, "a.csv"),
    case("a full disk for a body", full(lambda folder: rom.save(rom.load("good.npz"), "a.npz")),
         ResourceError, "a.npz"),
    case("a full disk for rom simulate",
         full(lambda folder: require(main(["simulate", "pendulum.toml", "-q", "--dt", "1e-4", "-o", "out"]) == 6, "")),
         Works),
]  # fmt: skip
