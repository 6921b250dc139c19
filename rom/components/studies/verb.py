"""Move the mechanism of a .toml file at many samples of some of its keys, on all cores.

Each sample is a line of the study's file as soon as it is there; with --resume a study that was
ended goes on and repeats none. A sample that fails is a row with its error.
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from rom.cli.answer import Answer, table
from rom.cli.options import assignment, count, option, unique
from rom.cli.output import add_force, checked, usual
from rom.cli.schemas import FILE, OUTPUT, by_name, each, number, record, text, whole
from rom.components.studies.samples import KINDS, design, range_of
from rom.config.mechanism import read_mechanism
from rom.errors import ConfigError
from rom.io.files import check_writable
from rom.names import check_ending
from rom.process.launcher import ranks

SUMMARY = "move a mechanism at many samples of its keys"
SHARES = (0.05, 0.5, 0.95)
USUAL = {"vary": {}, "keep": (), "samples": 16, "design": KINDS[0], "seed": 1}
EXAMPLES = """\
  rom study demos/return_spring.toml            # what its table [study] says
  rom study demos/slider_crank.toml --vary bodies.slider.mass=0.2:0.4 -n 20 \\
      --keep "max(abs(crank pin force))"
  rom study demos/slider_crank.toml --vary bodies.rod.mesh.t_web=0.003:0.006 -n 64 -j 2 \\
      --vary bodies.rod.damping.ratio=0.001:0.05:log --keep "max(abs(crank pin force))" \\
      -o rod.study --picture rod.png
  rom study demos/return_spring.toml --resume   # after anything that ended it
"""
SCHEMA = record(
    "what was measured at the samples",
    file=FILE,
    output=OUTPUT,
    samples=whole("of the design"),
    failures=by_name(text("class of the error, and its text"), "samples that failed, by number"),
    values=by_name(each(number("quantile"), "5, 50 and 95 %"), "what was kept"),
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    parser.add_argument("file", type=Path, help="mechanism, .toml; its table [study] says the same")
    about = "a key of the file and its range; may be repeated"
    option(parser, "--vary KEY=LOW:HIGH[:log]", about, assignment)
    about = 'of each motion, as "max(abs(crank pin force))"; may be repeated'
    option(parser, "--keep EXPRESSION", about, str, action="append", default=[])
    option(parser, "-n --samples", "number of them; of a grid, for each key", count)
    option(parser, "--design", "of the samples", str, choices=KINDS)
    option(parser, "--seed", "of the samples, default 1", count)
    option(parser, "-j --workers", "processes (default: one on each core)", count)
    option(parser, "--picture", "of what was kept over what varies, .png", Path)
    add_force(parser)
    option(parser, "-o --output", "file of the study (default: FILE.study)", Path)
    option(parser, "--resume", "go on with that file")
    option(parser, "--trust", "run .py files; read them first")


def run(args: argparse.Namespace) -> Answer:
    """Sample, move, keep."""
    if ranks()[1] > 1:
        raise ConfigError("a study starts its own processes; leave out mpirun.")
    how = _asked(args)
    if args.picture:
        checked(args, check_ending(args.picture, "a picture", ".png"))
    path = check_writable(usual(args, ".study"))
    samples = design(
        {key: ends[:2] for key, ends in how["vary"].items()},
        how["samples"],
        how["design"],
        log=[key for key, ends in how["vary"].items() if ends[2]],
        rng=np.random.default_rng(how["seed"]),
    )
    asked = {"keep": how["keep"], "trust": args.trust, "workers": args.workers}
    from rom.components.studies.study import study

    asked |= {"resume": args.resume, "progress": not args.quiet}
    found = study(args.file, samples, into=path, **asked)
    if args.picture and found.good.size:
        from rom.components.studies.pictures import scatter_matrix

        scatter_matrix(found, args.picture)
    numbers = {name: x for name, x in found.values.items() if x.ndim == 1 and found.good.size}
    quantiles = {name: found.quantiles(name, SHARES)[0].tolist() for name in numbers}
    rows = [(name, *(f"{x:.6g}" for x in row)) for name, row in quantiles.items()]
    data = {
        "file": str(args.file),
        "output": str(path),
        "samples": len(found.seconds),
        "failures": {str(k): text for k, text in found.failed.items()},
        "values": quantiles,
    }
    head = f"{path}: {len(found.seconds)} samples, {len(found.failed)} failed"
    said = f"{head}\n{table(('', '5 %', '50 %', '95 %'), rows)}"
    failed = () if found.good.size else ("every sample failed",)
    return Answer(data, said if rows else head, failed=failed)


def _asked(args: argparse.Namespace) -> dict[str, Any]:
    """What the file and, in place of that, options say."""
    given = {name: getattr(args, name) for name in ("samples", "design", "seed", "keep")}
    given["vary"] = {key: range_of(text) for key, text in unique(args.vary, "--vary").items()}
    read = read_mechanism(args.file, trust=args.trust).values.get("study", USUAL)
    how = read | {name: value for name, value in given.items() if value not in (None, [], {})}
    if not how["vary"] or not how["keep"]:
        raise ConfigError("--vary and --keep are needed.", hint="See rom study --help.")
    return how
