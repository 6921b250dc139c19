"""Let a body swing about one of its interfaces under gravity, and write the motion as a table."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rom.cli.answer import Answer, failures, report_data
from rom.cli.options import positive, vector
from rom.cli.ranks import ranks
from rom.errors import ConfigError

if TYPE_CHECKING:
    from rom.body.flexible import FlexibleBody

SUMMARY = "let a body swing as a pendulum"
EXAMPLES = """\
  rom simulate rod.rom.npz --hinge pin_a --gravity 0,-9.81,0 --t-end 1 --dt 1e-3 -o out/
  rom simulate rod.rom.npz --hinge pin_a --axis=-1,0,0 --t-end 0.2 --dt 1e-4 -o out/
  rom simulate rod.rom.npz --hinge pin_a --t-end 1 --dt 1e-3 --film glb --history h5 -o out/
Mechanisms of several bodies are built in Python, see demos/.
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    parser.add_argument("file", type=Path, help="body file, e.g. rod.rom.npz")
    parser.add_argument("--hinge", required=True, help="interface the body hangs on")
    parser.add_argument("--axis", type=vector, default=(0.0, 0.0, 1.0), help="default 0,0,1")
    parser.add_argument(
        "--gravity", type=vector, default=(0.0, -9.81, 0.0), help="[m/s^2], default 0,-9.81,0"
    )
    parser.add_argument("--t-end", type=positive, required=True, help="duration [s]")
    parser.add_argument("--dt", type=positive, required=True, help="time step [s]")
    parser.add_argument(
        "--film", choices=("glb", "vtkhdf"), help="film in space: for browsers, or for ParaView"
    )
    parser.add_argument(
        "--history", choices=("csv", "h5"), help="every marker, reaction and energy, too"
    )
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder, made if missing")


def run(args: argparse.Namespace) -> Answer:
    """Load, simulate, audit; the table is written at the end."""
    from rom.io.native import load

    if args.dt > args.t_end:
        raise ConfigError(f"--dt {args.dt:g} is longer than --t-end {args.t_end:g}.")
    if not any(args.axis):
        raise ConfigError("--axis 0,0,0 has no direction.")
    _check_folder(args.output)
    body = load(args.file)
    body.marker(args.hinge)
    solution, audit = _swing(body, args)
    path = args.output / f"{body.name}.csv"
    data = {
        "output": str(path),
        "also": [str(also) for also in _more(path, args)],
        "steps": len(solution.t) - 1,
        "status": solution.status,
        "audit": report_data(audit),
    }
    return Answer(
        data,
        f"{path}: {data['steps']} steps. {solution.status}\n\n{audit}",
        lambda: _write_all(path, body, solution, args),
        failures(audit),
    )


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


def _check_folder(folder: Path) -> None:
    from rom.io.files import check_writable

    if folder.exists() and not folder.is_dir():
        raise ConfigError(f"{folder} is a file; a folder is needed.")
    check_writable(folder / "motion.csv" if folder.is_dir() else folder)


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

    path.parent.mkdir(exist_ok=True)
    places = {name: solution.position(body.name, name) for name in body.interface_names}
    names = ["t [s]", *(f"{name} {axis} [m]" for name in places for axis in "xyz")]
    names += [f"q{k + 1}" for k in range(body.n_modes)]
    values = np.column_stack([solution.t, *places.values(), solution.elastic(body.name)])
    write_whole(
        path,
        lambda file: np.savetxt(file, values, "%.10g", ",", header=",".join(names), comments=""),
    )
