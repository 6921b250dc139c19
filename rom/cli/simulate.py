"""Move the mechanism of a .toml file; or let a body swing about one of its interfaces.

The motion is written as a table, with pictures and films when they are asked for.
"""

import argparse
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

from rom.cli.answer import Answer, failures, report_data
from rom.cli.described import described, mechanism
from rom.cli.options import add_meshing, positive, vector
from rom.cli.output import add_force, checked, claim, files_in
from rom.cli.ranks import ranks
from rom.errors import ConfigError
from rom.names import inside

if TYPE_CHECKING:
    from rom.body.flexible import FlexibleBody
    from rom.model import Report

SUMMARY = "move a mechanism, or let a body swing as a pendulum"
EXAMPLES = """\
  rom simulate demos/slider_crank.toml -o out/
  rom simulate demos/slider_crank.toml --t-end 0.01 --film glb -o out/
  rom simulate rod.rom.npz --hinge pin_a --gravity 0,-9.81,0 --t-end 1 --dt 1e-3 -o out/
  rom simulate rod.rom.npz --hinge pin_a --axis=-1,0,0 --t-end 0.2 --dt 1e-4 -o out/
  rom simulate rod.rom.npz --hinge pin_a --t-end 1 --dt 1e-3 --film glb --history h5 -o out/
Mechanisms of several bodies are described in a file, or built in Python, see demos/.
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    parser.add_argument("file", type=Path, help="mechanism, .toml, or body, e.g. rod.rom.npz")
    parser.add_argument("--hinge", help="interface the body hangs on")
    parser.add_argument("--axis", type=vector, default=(0.0, 0.0, 1.0), help="default 0,0,1")
    parser.add_argument(
        "--gravity", type=vector, default=(0.0, -9.81, 0.0), help="[m/s^2], default 0,-9.81,0"
    )
    parser.add_argument("--t-end", type=positive, help="duration [s]")
    parser.add_argument("--dt", type=positive, help="time step [s]")
    parser.add_argument(
        "--film", choices=("glb", "vtkhdf"), help="film in space: for browsers, or for ParaView"
    )
    parser.add_argument(
        "--history", choices=("csv", "h5"), help="every marker, reaction and energy, too"
    )
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder, made if missing")
    add_force(parser)
    add_meshing(parser)


def run(args: argparse.Namespace) -> Answer:
    """Load, simulate, audit; the table is written at the end."""
    return _mechanism(args) if described(args) else _pendulum(args)


def _mechanism(args: argparse.Namespace) -> Answer:
    from rom import __version__
    from rom.config.run import paths_of
    from rom.config.run import run as move

    file = mechanism(args)
    for path in paths_of(file, claim(args)):
        checked(args, path, inputs=files_in(file.values))
    aloud = ranks()[0] == 0 and not args.quiet
    done = move(file, command=_command(args), version=__version__, progress=aloud)
    paths = done.paths(args.output)
    return _answer(done.solution, done.audit, paths, lambda: done.write(args.output))


def _answer(solution: Any, audit: "Report", paths: list[Path], write: Any) -> Answer:
    data = {
        "output": str(paths[0]),
        "also": [str(also) for also in paths[1:]],
        "steps": len(solution.t) - 1,
        "status": solution.status,
        "audit": report_data(audit),
    }
    text = f"{paths[0]}: {data['steps']} steps. {solution.status}\n\n{audit}"
    return Answer(data, text, write, failures(audit))


def _pendulum(args: argparse.Namespace) -> Answer:
    from rom import __version__
    from rom.config.run import RECORD, Record
    from rom.io.native import load

    needed = {"--hinge": args.hinge, "--t-end": args.t_end, "--dt": args.dt}
    if missing := [name for name, value in needed.items() if value is None]:
        raise ConfigError(f"the following arguments are required: {', '.join(missing)}.")
    if args.dt > args.t_end:
        raise ConfigError(f"--dt {args.dt:g} is longer than --t-end {args.t_end:g}.")
    if not any(args.axis):
        raise ConfigError("--axis 0,0,0 has no direction.")
    folder = claim(args)
    body = load(args.file)
    body.marker(args.hinge)
    path = inside(folder, body.name, ".csv")
    paths = [checked(args, each) for each in (path, *_more(path, args), folder / RECORD)]
    solution, audit = _swing(body, args)

    def write() -> None:
        _write_all(path, body, solution, args)
        Record(body.name, _command(args), __version__).write(paths, solution, audit)

    return _answer(solution, audit, paths, write)


def _command(args: argparse.Namespace) -> str:
    return f"rom {' '.join(map(quote, args.argv))}"


def _swing(body: "FlexibleBody", args: argparse.Namespace) -> tuple[Any, Any]:
    from rom.mbs.audit import audit
    from rom.mbs.integrate import simulate
    from rom.mbs.mechanism import Mechanism

    aloud = ranks()[0] == 0 and not args.quiet
    mechanism = Mechanism(gravity=args.gravity)
    part = mechanism.add_flexible(body.name, body, at=(0.0, 0.0, 0.0))
    hinge = mechanism.ground.marker(tuple(body.marker(args.hinge).point))
    mechanism.revolute("hinge", hinge, part.marker(args.hinge), axis=args.axis)
    solution = simulate(mechanism, t_end=args.t_end, dt=args.dt, progress=aloud)
    return solution, audit(solution)


def _more(path: Path, args: argparse.Namespace) -> list[Path]:
    """The film and the history asked for."""
    found = [path.with_suffix(f".{args.film}")] if args.film else []
    return found + ([path.with_suffix(f".history.{args.history}")] if args.history else [])


def _write_all(path: Path, body: "FlexibleBody", solution: Any, args: argparse.Namespace) -> None:
    _write(path, body, solution)
    for also in _more(path, args):
        if also.suffix in (".glb", ".vtkhdf"):
            from rom.view.motion import write_animation

            write_animation(solution, also)
        else:
            from rom.io.history import write_history

            write_history(solution, also)


def _write(path: Path, body: "FlexibleBody", solution: Any) -> None:
    """One line per time: positions of the interfaces [m], then elastic coordinates."""
    import numpy as np

    from rom.io.files import write_whole
    from rom.io.history import table

    places = {name: solution.position(body.name, name) for name in body.interface_names}
    names = ["t [s]", *(f"{name} {axis} [m]" for name in places for axis in "xyz")]
    names += [f"q{k + 1}" for k in range(body.n_modes)]
    values = np.column_stack([solution.t, *places.values(), solution.elastic(body.name)])
    content = table(names, values, "%.10g")
    write_whole(path, lambda file: file.write(content))
