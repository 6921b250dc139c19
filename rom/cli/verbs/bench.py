"""Measure speed and memory as ratios within one run, so that the speed of the machine cancels."""

import argparse
import logging
from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from rom.cli.answer import Answer, table

if TYPE_CHECKING:
    from rom.bench.benchmarks import Figure

log = logging.getLogger("rom")
SUMMARY = "measure speed and memory"
EXAMPLES = """\
  rom bench --list
  rom bench reduction
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    parser.add_argument("names", metavar="NAME", nargs="*", help="benchmarks; all of them if none")
    parser.add_argument("--list", action="store_true", help="say what there is and leave")


def run(args: argparse.Namespace) -> Answer:
    """Run the benchmarks named, or list them."""
    from rom.bench.benchmarks import BENCHMARKS
    from rom.bench.benchmarks import run as measure

    if args.list:
        about = {name: (f.__doc__ or "").split("\n")[0] for name, f in BENCHMARKS.items()}
        return Answer({"benchmarks": about}, table(("benchmark", ""), about.items()))
    return _answer(list(_told(measure(tuple(args.names)))))


def _told(figures: "Iterator[Figure]") -> "Iterator[Figure]":
    """The figures, each said as soon as it is measured: a benchmark takes minutes."""
    for figure in figures:
        log.info("%s: %s %.4g %s", figure.case, figure.quantity, figure.value, figure.unit)
        yield figure


def _answer(figures: "list[Figure]") -> Answer:
    rows = [
        (f"{f.benchmark}, {f.case}: {f.quantity}", f"{f.value:.4g} {f.unit}".strip(), f.aim)
        for f in figures
    ]
    data: dict[str, Any] = {"figures": [asdict(f) for f in figures]}
    return Answer(data, table(("figure", "value", "aim"), rows))
