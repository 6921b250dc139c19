"""Check a body file: checksums, consistency of its integrals, the certificate it carries."""

import argparse
from pathlib import Path

from rom.cli.answer import Answer, Data, failures, report_data

SUMMARY = "check a body file and print its certificate"
EXAMPLES = """\
  rom check rod.rom.npz
  rom check rod.rom.npz --json
  rom check rod.SID_FEM          # which dialect, and whether its blocks agree
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    parser.add_argument("file", type=Path, help="body file, e.g. rod.rom.npz, or .SID_FEM")


def run(args: argparse.Namespace) -> Answer:
    """Load and check."""
    from rom.checks.gates import check
    from rom.io.native import load

    data: Data = {"file": str(args.file)}
    if args.file.suffix.lower() == ".sid_fem":
        from rom.io.sid.dialect import check_sid, read_sid

        record = read_sid(args.file, ge="as_written")
        report = check_sid(record)
        data |= {"name": record.name, "dialect": record.dialect}
    else:
        body = load(args.file)
        report = check(body)
        data |= {"name": body.name}
    data |= {"report": report_data(report)}
    return Answer(data, f"{args.file}\n{report}", failed=failures(report))
