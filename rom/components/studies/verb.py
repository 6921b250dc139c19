"""Move the mechanism of a .toml file at many samples of some of its keys, on all cores.

Each sample is a line of the study's file as soon as it is there; with --resume a study that was
ended goes on and repeats none. A sample that fails is a row with its error.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np

import rom
from rom.cli.answer import Answer, table
from rom.cli.options import add_meshing, assignment, count, meshing, option, typed_number, unique
from rom.cli.output import usual
from rom.cli.schemas import FILE, OUTPUT, by_name, each, number, record, text, whole
from rom.components.studies.described import MotionOf, key_path, reduced
from rom.components.studies.samples import KINDS, design
from rom.components.studies.study import study
from rom.io.files import check_writable
from rom.process.launcher import ranks

SUMMARY = "move a mechanism at many samples of its keys"
SHARES = (0.05, 0.5, 0.95)
EXAMPLES = """\
  rom study demos/slider_crank.toml --vary bodies.slider.mass=0.2:0.4 -n 20 \\
      --keep "max(abs(crank pin force))"
  rom study arm.toml --vary joints.\\"main bearing\\".damping=0.01:1:log -n 64 -j 4 \\
      --keep "range(tip position z)" --keep "last(arm omega z)" -o arm.study
  rom study arm.toml ... -o arm.study --resume   # after anything that ended it
"""
SCHEMA = record(
    "what was measured at the samples",
    file=FILE,
    output=OUTPUT,
    samples=whole("of the design"),
    failed=by_name(text("class of the error, and its text"), "samples that failed, by number"),
    values=by_name(each(number("quantile"), "5, 50 and 95 %"), "what was kept"),
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    parser.add_argument("file", type=Path, help="mechanism, .toml")
    about = "a key of the file and its range; may be repeated"
    option(parser, "--vary KEY=LOW:HIGH[:log]", about, assignment)
    about = 'of each motion, as "max(abs(crank pin force))"; may be repeated'
    option(parser, "--keep EXPRESSION", about, str, action="append")
    option(parser, "-n --samples", "number of them; of a grid, for each key", count, default=16)
    option(parser, "--design", "of the samples", str, choices=KINDS, default=KINDS[0])
    option(parser, "--seed", "of the samples, default 1", count, default=1)
    option(parser, "-j --workers", "processes (default: one on each core)", count)
    option(parser, "-o --output", "file of the study (default: FILE.study)", Path)
    option(parser, "--resume", "go on with that file")
    add_meshing(parser)


def run(args: argparse.Namespace) -> Answer:
    """Sample, move, keep."""
    if ranks()[1] > 1:
        raise rom.ConfigError("a study starts its own processes; leave out mpirun.")
    if not args.vary or not args.keep:
        raise rom.ConfigError("--vary and --keep are needed.", hint="See rom study --help.")
    path = check_writable(usual(args, ".study"))
    trust = bool(meshing(args).get("trust"))
    ranges = {key: _range(words) for key, words in unique(args.vary, "--vary").items()}
    log = [key for key, (*_, scale) in ranges.items() if scale]
    rng = np.random.default_rng(args.seed)
    samples = design({key: ends[:2] for key, ends in ranges.items()}, args.samples, args.design,
                     log=log, rng=rng)  # fmt: skip
    first = {key_path(key): x[0] for key, x in samples.items()}
    file = rom.read_mechanism(args.file, first, **meshing(args))
    with tempfile.TemporaryDirectory() as folder:
        measure = MotionOf(str(args.file), tuple(args.keep), reduced(file, Path(folder)), trust)
        found = study(measure, samples, workers=args.workers, into=path, resume=args.resume,
                      progress=not args.quiet)  # fmt: skip
    numbers = {name: x for name, x in found.values.items() if x.ndim == 1}
    quantiles = {name: found.quantiles(name, SHARES)[0].tolist() for name in numbers}
    rows = [(name, *(f"{x:.6g}" for x in row)) for name, row in quantiles.items()]
    data = {
        "file": str(args.file),
        "output": str(path),
        "samples": len(found.seconds),
        "failed": {str(k): text for k, text in found.failed.items()},
        "values": quantiles,
    }
    head = f"{path}: {len(found.seconds)} samples, {len(found.failed)} failed"
    return Answer(data, f"{head}\n{table(('', '5 %', '50 %', '95 %'), rows)}")


def _range(words: str) -> tuple[float, float, bool]:
    low, _, rest = words.partition(":")
    high, _, scale = rest.partition(":")
    if scale not in ("", "log"):
        raise rom.ConfigError(f"--vary {words!r} must be LOW:HIGH or LOW:HIGH:log.")
    return typed_number("--vary", low), typed_number("--vary", high), bool(scale)
