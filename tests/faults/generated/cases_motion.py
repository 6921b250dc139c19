"""What was computed of a motion is kept, whatever ends it."""

import json
import os
import resource
import signal
import subprocess
import sys
import threading
import time

import numpy as np

import rom
from generated.case import Silent, Works, case, edit, require, write
from generated.stock import pendulum
from rom.cli.main import main
from rom.errors import (
    ConfigError,
    FileFormatError,
    InterruptedRun,
    ModelError,
    ResourceError,
    RomError,
    SolverError,
)

BROKEN = (SolverError, ModelError, ConfigError)
AFTER = 0.05  # s, when the laws below go wrong
LONG = "simulate pendulum.toml --t-end 2e3 --dt 1e-3 -o out"
SPOILT = {  # what a law in Python may do in the middle of a motion
    "raises ZeroDivisionError": lambda: 1 / 0,
    "raises KeyError": lambda: {}["spring"],
    "raises ValueError": lambda: float("stiff"),
    "raises RecursionError": lambda: (_ for _ in ()).throw(RecursionError("too deep")),
    "is not a number": lambda: np.nan,
    "is infinite": lambda: np.inf,
    "is text": lambda: "five",
    "is nothing": lambda: None,
    "is too long": lambda: np.ones(4),
}
STEPS = {
    "a step of 1e-18 s": ({"dt": 1e-18}, (ConfigError, ResourceError), "1e-18"),
    "a step of 5e-324 s": ({"dt": 5e-324}, (ConfigError, ResourceError), "dt"),
    "a million million steps": ({"dt": 1e-13}, (ConfigError, ResourceError), ("1e-13", "1e+12")),
    "no step": ({"dt": 0.0}, ConfigError, "dt"),
    "a step back": ({"dt": -0.01}, ConfigError, "dt"),
    "an end before the start": ({"dt": 0.01, "t_start": 1.0}, ConfigError, "t_end"),
    "a step that is no number": ({"dt": float("nan")}, ConfigError, "dt"),
}
RESUMED = {  # what is wrong with the folder from which a run goes on
    "no folder": (lambda folder: None, "out"),
    "an empty folder": (lambda folder: (folder / "out").mkdir(), "out"),
    "a file": (write("out", "mine"), "out"),
}


def late(f, before=0.0):
    """A law that goes wrong after a while."""
    return lambda t: f() if t > AFTER else before


def kept(run, error=SolverError):
    """The motion up to the failure is in the error."""
    try:
        return run()
    except RomError as raised:
        solution = raised.solution
        require(solution is not None, f"no motion in {raised!r}")
        require(len(solution.t) > 3 and np.isfinite(solution.q).all(), "a shorter motion")
        raise


def loaded(f):
    """A force that goes wrong."""

    def act(folder):
        mech = pendulum()
        marker, law = mech.part("bob").marker("pin"), late(f)
        mech.user_force("gust", lambda t, a: ((law(t), 0, 0), (0, 0, 0)), marker)
        return kept(lambda: rom.simulate(mech, t_end=0.2, dt=0.01))

    return act


def timed(f):
    """A component of a force as a function of time that goes wrong."""

    def act(folder):
        mech = pendulum()
        law = late(f)
        mech.force("push", mech.part("bob").marker("pin"), lambda t: (law(t), 0, 0))
        return kept(lambda: rom.simulate(mech, t_end=0.2, dt=0.01))

    return act


def driven(f):
    """A drive that goes wrong."""

    def act(folder):
        mech = pendulum()
        mech.drive("motor", "hinge", late(f), rate=lambda t: 0.0, acceleration=lambda t: 0.0)
        return kept(lambda: rom.simulate(mech, t_end=0.2, dt=0.01))

    return act


def interrupted(number):
    """A signal in the middle of a motion."""

    def act(folder):
        mech = pendulum()

        def gust(t, a):
            if t > AFTER:
                os.kill(os.getpid(), number)
            return (0, 0, 0), (0, 0, 0)

        mech.user_force("gust", gust, mech.part("bob").marker("pin"))
        return kept(lambda: rom.simulate(mech, t_end=0.2, dt=0.01))

    return act


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


def resumed(folder):
    """A run that was interrupted ends like one that was not, bit by bit."""
    sent = []

    def gust(t, a):
        if t > AFTER and not sent:
            sent.append(t)
            os.kill(os.getpid(), signal.SIGINT)
        return (0, 0, 0), (0, 0, 0)

    def moved(keep=None):
        mech = pendulum()
        mech.user_force("gust", gust, mech.part("bob").marker("pin"))
        return rom.simulate(mech, t_end=0.2, dt=0.01, keep=keep)

    try:
        moved(rom.Keeping(folder / "parts"))
    except InterruptedRun:
        rest = moved(rom.Keeping(folder / "parts", resume=True))
        require(sent and np.array_equal(rest.q, moved().q), "other bits")


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


def in_a_thread(folder):
    """A motion may run beside the main thread."""
    found = []
    thread = threading.Thread(
        target=lambda: found.append(rom.simulate(pendulum(), t_end=0.05, dt=0.01))
    )
    thread.start()
    thread.join()
    require(len(found) == 1 and len(found[0].t) == 6, "no motion")


def history(folder):
    rom.write_history(rom.simulate(pendulum(), t_end=0.5, dt=0.001), folder / "a.csv")


CASES = [
    *(case(f"a force {name}", loaded(f), BROKEN, "gust") for name, f in SPOILT.items()),
    *(case(f"a force of time {name}", timed(f), BROKEN, "push") for name, f in SPOILT.items()),
    *(case(f"a drive {name}", driven(f), BROKEN, "motor") for name, f in SPOILT.items()),
    case("Ctrl-C", interrupted(signal.SIGINT), InterruptedRun, "0.0"),
    case("SIGTERM to rom simulate", stopped(signal.SIGTERM, 7), Works),
    case("Ctrl-C to rom simulate", stopped(signal.SIGINT, 7), Works),
    *(case(name, stepped(numbers), accept, word) for name, (numbers, accept, word) in STEPS.items()),
    case("a step of 1e-18 s on the command line", "simulate pendulum.toml --dt 1e-18 -o out",
         (ConfigError, ResourceError), "1e-18"),
    case("a step of 1e-18 s in the file", "simulate pendulum.toml -o out", (ConfigError, ResourceError),
         "1e-18", given=edit("pendulum.toml", "dt = 0.01", "dt = 1e-18")),
    case("a step of 1e-18 s of a body", "simulate good.npz --hinge root --t-end 1 --dt 1e-18 -o out",
         (ConfigError, ResourceError), "1e-18"),
    case("a mechanism that locks", locked, Works),
    case("a mechanism that locks, by name", "simulate lock.toml -o out", SolverError, "rod", leaves=True),
    case("a run that goes on", resumed, Works),
    *(case(f"a run that goes on from {name}", "simulate pendulum.toml -o out --resume",
           (ConfigError, FileFormatError), word, given=given)
      for name, (given, word) in RESUMED.items()),
    case("a full disk for a table", full(history), ResourceError, "a.csv"),
    case("a full disk for a body", full(lambda folder: rom.save(rom.load("good.npz"), "a.npz")),
         ResourceError, "a.npz"),
    case("a full disk for rom simulate",
         full(lambda folder: require(main(["simulate", "pendulum.toml", "-q", "--dt", "1e-4", "-o", "out"]) == 6, "")),
         Works),
    case("a motion in a thread", in_a_thread, Silent),
]  # fmt: skip
