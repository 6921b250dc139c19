"""What was computed of a motion is kept, whatever ends it."""

import resource
import signal

import rom
from generated.case import Works, case, require
from generated.stock import pendulum
from rom.cli.main import main
from rom.errors import ResourceError, SolverError


def rows(folder):
    """Lines of the table that was left, without the first."""
    require((folder / "out/motion.csv").is_file(), "the motion is lost")
    return (folder / "out/motion.csv").read_text().splitlines()[1:]


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
    case("a mechanism that locks", locked, Works),
    case("a mechanism that locks, by name", "simulate lock.toml -o out", SolverError, "rod", leaves=True),
    case("a full disk for a table", full(history), ResourceError, "a.csv"),
    case("a full disk for a body", full(lambda folder: rom.save(rom.load("good.npz"), "a.npz")),
         ResourceError, "a.npz"),
]  # fmt: skip
