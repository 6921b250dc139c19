"""Measure speed and memory as ratios within one run, so that the speed of the machine cancels."""

import argparse
import importlib
import logging
import sys
from dataclasses import asdict
from types import ModuleType

from rom.cli.answer import Answer, table
from rom.cli.options import option
from rom.errors import ConfigError
from rom.places import FOLDER_ABOVE

log = logging.getLogger("rom")
SOURCE_FILES = ("pyproject.toml", "benchmarks/benchmarks.py")  # beside the package
SUMMARY = "measure speed and memory"
EXAMPLES = """\
  rom bench --list
  rom bench reduction
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    parser.add_argument("names", metavar="NAME", nargs="*", help="benchmarks; all of them if none")
    option(parser, "--list", "say what there is and leave")


def run(args: argparse.Namespace) -> Answer:
    """Run the benchmarks named, or list them."""
    known = _of_the_source()
    if args.list:
        about = {name: (f.__doc__ or "").split("\n")[0] for name, f in known.BENCHMARKS.items()}
        return Answer({"benchmarks": about}, table(("benchmark", ""), about.items()))
    figures = []
    for f in known.run(tuple(args.names)):  # told one by one: a benchmark takes minutes
        log.info("%s: %s %.4g %s", f.case, f.quantity, f.value, f.unit)
        figures.append(f)
    rows = [
        (f"{f.benchmark}, {f.case}: {f.quantity}", f"{f.value:.4g} {f.unit}".strip(), f.aim)
        for f in figures
    ]
    data = {"figures": [asdict(f) for f in figures]}
    return Answer(data, table(("figure", "value", "aim"), rows))


def _of_the_source() -> ModuleType:
    if not all((FOLDER_ABOVE / file).is_file() for file in SOURCE_FILES):
        raise ConfigError(
            "Benchmarks come with the source of rom, not with the installed package.",
            hint="In a checkout of it, `make bench NAME=motion` sets up what they need.",
        )
    sys.path.insert(0, str(FOLDER_ABOVE))
    return importlib.import_module("benchmarks.benchmarks")
