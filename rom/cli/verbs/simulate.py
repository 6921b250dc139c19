"""Move the mechanism of a .toml file; or let a body swing about one of its interfaces.

The motion is written as a table, with pictures and films when they are asked for.
"""

import argparse
import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

import rom
from rom.cli.answer import Answer, failures, report_data
from rom.cli.described import described, mechanism
from rom.cli.options import ACCELERATION, DURATION, add_meshing, option, require, vector
from rom.cli.output import add_force, checked, claim, files_in, typed_command, usual
from rom.cli.verbs.swing import pendulum
from rom.names import inside
from rom.process.launcher import ranks

log = logging.getLogger("rom")
PARTS_FOLDER = "motion.parts"  # where the motion is kept while the run lasts
MOST_TIMES = 10  # of an event that are told; all of them are in the record
SUMMARY = "move a mechanism, or let a body swing as a pendulum"
EXAMPLES = """\
  rom simulate demos/slider_crank.toml          # into slider_crank_motion/
  rom simulate demos/slider_crank.toml --t-end 0.01 --film glb -o out/
  rom simulate rod.rom.npz --hinge pin_a --gravity 0,-9.81,0 --t-end 1 --dt 1e-3 -o out/
  rom simulate rod.rom.npz --hinge pin_a --axis=-1,0,0 --t-end 0.2 --dt 1e-4 -o out/
  rom simulate rod.rom.npz --hinge pin_a --t-end 1 --dt 1e-3 --film glb --history h5 -o out/
  rom simulate demos/slider_crank.toml -o out/ --resume   # after anything that ended it
While a long run lasts, its motion is kept in motion.parts in the output folder. Add --resume to the
command of a run that was ended, by Ctrl-C, an error or a kill, to go on to the same bits; with a
--t-end before the time it had reached, the files of the motion up to there are written.
Mechanisms of several bodies are described in a file, or built in Python, see demos/.
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    parser.add_argument("file", type=Path, help="mechanism, .toml, or body, e.g. rod.rom.npz")
    option(parser, "--hinge", "interface the body hangs on", str)
    option(parser, "--axis", "default 0,0,1", vector, default=(0.0, 0.0, 1.0))
    about = "[m/s^2], default 0,-9.81,0"
    option(parser, "--gravity", about, ACCELERATION, default=(0.0, -9.81, 0.0))
    option(parser, "--t-end", "duration [s]", DURATION)
    option(parser, "--dt", "time step [s]", DURATION)
    about = "pictures, pictures by ffmpeg, to turn around in browsers, or for ParaView"
    option(parser, "--film", about, str, choices=("gif", "mp4", "glb", "vtkhdf"))
    about = "every marker, reaction and energy, too"
    option(parser, "--history", about, str, choices=("csv", "h5"))
    option(parser, "-o --output", "folder, made if missing (default: FILE_motion)", Path)
    add_force(parser)
    add_meshing(parser)
    option(parser, "--resume", "go on with the run that ended early in this folder")


def run(args: argparse.Namespace) -> Answer:
    """Load, simulate, audit; the table is written at the end."""
    args.output = usual(args, "_motion")
    return _mechanism(args) if described(args) else _pendulum(args)


def _mechanism(args: argparse.Namespace) -> Answer:
    from rom.report.run import Run, made_from, paths_of
    from rom.report.run import run as move

    file = mechanism(args)
    paths = paths_of(file, claim(args))
    for path in paths:
        checked(args, path, inputs=files_in(file.values))
    keep = _keeping(args, made_from(file))
    origin = {"command": typed_command(args), "version": rom.__version__}

    def rescue(solution: "rom.mbs.Solution", audit: rom.Report) -> Path:
        Run(file, solution, audit, **origin).write_motion([paths[0], paths[-1]])
        return paths[0]

    with _rescuing(args, keep, rescue):
        done = move(file, **origin, progress=_aloud(args), keep=keep)

    def write() -> None:
        with _finishing(args, keep):
            done.write(args.output)

    return _answer(done.solution, done.audit, paths, write)


def _aloud(args: argparse.Namespace) -> bool:
    return ranks()[0] == 0 and not args.quiet


def _keeping(args: argparse.Namespace, made_from: dict[str, str]) -> "rom.mbs.Keeping | None":
    """The folder of the motion under way; one rank writes it."""
    keep = rom.mbs.Keeping(args.output / PARTS_FOLDER, args.resume, made_from)
    if args.resume and not keep.state.exists() and (args.output / "run.json").exists():
        text = f"there is nothing to resume: the run in {args.output} came to its end"
        raise rom.ConfigError(f"{text}; leave out --resume to run it anew.")
    keep.check()
    return keep if ranks()[0] == 0 else None


@contextmanager
def _rescuing(
    args: argparse.Namespace,
    keep: "rom.mbs.Keeping | None",
    write: "Callable[[rom.mbs.Solution, rom.Report], Path]",
) -> Iterator[None]:
    """Write the motion up to whatever ends it inside, and say how to go on."""
    try:
        yield
    except BaseException as error:
        solution = getattr(error, "solution", None)
        if solution is None or keep is None:
            raise
        from rom.mbs.parts.foreign import KEPT_HINT

        if _aloud(args):
            words = "checking and writing the motion up to t = %.6g s; Ctrl-C leaves that out"
            log.info(words, solution.t[-1])
        try:
            place = f"is in {write(solution, rom.audit(solution))}"
        except rom.ResourceError as full:
            place = f"could not be written: {full.message.rstrip('.')}"
        if isinstance(error, rom.RomError):
            own = error.told_hint.replace(KEPT_HINT, "").strip()
            hints = (own, f"The motion up to there {place}.", _to_go_on(args, keep))
            error.hint = " ".join(hint for hint in hints if hint)
        raise


def _to_go_on(args: argparse.Namespace, keep: "rom.mbs.Keeping | None") -> str:
    """What to type after an end that was none of the motion's, if something of it is kept."""
    if keep is None or not keep.state.exists():
        return ""
    return f"To go on: {typed_command(args)}{'' if args.resume else ' --resume'}."


@contextmanager
def _finishing(args: argparse.Namespace, keep: "rom.mbs.Keeping | None") -> Iterator[None]:
    """Write results inside; what was kept of the motion goes with that, and stays if it fails."""
    try:
        yield
    except rom.ResourceError as error:
        if hint := _to_go_on(args, keep):
            error.hint = f"The motion is kept in {args.output / PARTS_FOLDER}. Make room. {hint}"
        raise
    if keep is not None:
        keep.remove()


def _answer(
    solution: "rom.mbs.Solution", audit: rom.Report, paths: list[Path], write: Callable[[], None]
) -> Answer:
    from rom.report.run import happened

    data = {
        "output": str(paths[0]),
        "also": [str(also) for also in paths[1:]],
        "steps": len(solution.t) - 1,
        "status": solution.status,
        "events": happened(solution),
        "audit": report_data(audit),
    }
    events = "".join(_occurred(*one) for one in happened(solution).items())
    text = f"{paths[0]}: {data['steps']} steps. {solution.status}\n{events}\n{audit}"
    return Answer(data, text, write, failures(audit))


def _occurred(name: str, times: list[float]) -> str:
    if not times:
        return f"Event {name!r} did not happen.\n"
    first = ", ".join(f"{t:.9g}" for t in times[:MOST_TIMES])
    more = ", ..." if len(times) > MOST_TIMES else ""
    often = "once" if len(times) == 1 else f"{len(times)} times"
    return f"Event {name!r} happened {often}, at {first}{more} s.\n"


def _pendulum(args: argparse.Namespace) -> Answer:
    from rom.io.native import load
    from rom.report.run import RECORD_FILE, SCENE_FILE, Record, file_digest, write_film

    require({"--hinge": args.hinge, "--t-end": args.t_end, "--dt": args.dt})
    if args.dt > args.t_end:
        raise rom.ConfigError(f"--dt {args.dt:g} must be at most --t-end {args.t_end:g}.")
    if not any(args.axis):
        raise rom.ConfigError("--axis 0,0,0 has no direction; give one, such as --axis 0,0,1.")
    folder = claim(args)
    body = load(args.file)
    body.marker(args.hinge)
    path = inside(folder, body.name, ".csv")
    films = [path.with_suffix(f".{args.film}")] if args.film else []
    tables = [path.with_suffix(f".history.{args.history}")] if args.history else []
    last = (folder / SCENE_FILE, folder / RECORD_FILE)
    paths = [checked(args, each) for each in (path, *films, *tables, *last)]
    hung = {"axis": args.axis, "gravity": args.gravity, "hinge": args.hinge}
    made_from = {f"--{name}": repr(value) for name, value in hung.items()}
    keep = _keeping(args, made_from | {str(args.file): file_digest(args.file)})
    record = Record(body.name, typed_command(args), rom.__version__)

    def rescue(solution: "rom.mbs.Solution", audit: rom.Report) -> Path:
        _write_motion(path, tables, body, solution)
        record.write([path, *tables, args.output / RECORD_FILE], solution, audit)
        return path

    with _rescuing(args, keep, rescue):
        mechanism = pendulum(body, args.hinge, axis=args.axis, gravity=args.gravity)
        steps = {"t_end": args.t_end, "dt": args.dt}
        solution = rom.simulate(mechanism, **steps, progress=_aloud(args), keep=keep)
        audit = rom.audit(solution)

    def write() -> None:
        from rom.report.scene import motion_scene, write_scene

        with _finishing(args, keep):
            _write_motion(path, tables, body, solution)
            record.write(paths, solution, audit)
            for film in films:
                write_film(solution, film)
            write_scene(motion_scene(solution, title=f"Motion of {body.name}"), paths[-2])

    return _answer(solution, audit, paths, write)


def _write_motion(
    path: Path, tables: list[Path], body: "rom.FlexibleBody", solution: "rom.mbs.Solution"
) -> None:
    """Positions of the interfaces [m] and elastic coordinates, one line per time; and histories."""
    from rom.io.files import write_whole
    from rom.io.history import table

    places = {name: solution.position(body.name, name) for name in body.interface_names}
    names = ["t [s]", *(f"{name} {axis} [m]" for name in places for axis in "xyz")]
    names += [f"q{k + 1}" for k in range(body.n_modes)]
    values = np.column_stack([solution.t, *places.values(), solution.elastic(body.name)])
    content = table(names, values, "%.10g")
    write_whole(path, lambda file: file.write(content))
    for history in tables:
        rom.write_history(solution, history)
