"""Write a body in the format of another program; the ending of the file name chooses it."""

import argparse
from pathlib import Path

from rom.cli.answer import Answer

SUMMARY = "write a body for another program"
EXAMPLES = """\
  rom export rod.rom.npz rod.vtu        # mode shapes for ParaView
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    parser.add_argument("file", type=Path, help="body file, e.g. rod.rom.npz")
    parser.add_argument("output", type=Path, help="file to write")


def run(args: argparse.Namespace) -> Answer:
    """Load; the file is written at the end."""
    from rom.io.export import export
    from rom.io.files import check_writable
    from rom.io.native import load

    check_writable(args.output)
    body = load(args.file)
    data = {"file": str(args.file), "output": str(args.output)}
    return Answer(data, f"{args.output}: body {body.name}", lambda: export(body, args.output))
