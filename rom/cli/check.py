"""Check a body file: checksums, consistency of its integrals, and the certificate it carries."""

import argparse
from pathlib import Path

from rom.cli.answer import Answer, failures, report_data

SUMMARY = "check a body file and print its certificate"
EXAMPLES = """\
  rom check rod.rom.npz
  rom check rod.rom.npz --json
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    parser.add_argument("file", type=Path, help="body file, e.g. rod.rom.npz")


def run(args: argparse.Namespace) -> Answer:
    """Load and check."""
    from rom.checks import check
    from rom.io.native import load

    body = load(args.file)
    report = check(body)
    data = {"file": str(args.file), "name": body.name, "report": report_data(report)}
    return Answer(data, f"{args.file}\n{report}", failed=failures(report))
