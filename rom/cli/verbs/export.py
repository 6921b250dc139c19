"""Write a body in the format of another program; the ending of the file name chooses it."""

import argparse
from pathlib import Path

from rom.cli.answer import Answer
from rom.cli.options import names
from rom.cli.output import add_force, checked

SUMMARY = "write a body for another program"
EXAMPLES = """\
  rom export rod.rom.npz rod.vtu        # mode shapes for ParaView
  rom export rod.rom.npz rod.SID_FEM    # Standard Input Data for Simpack
  rom export rod.rom.npz rod.sid --to sid-geisler
  rom export jacket.rom.npz jacket.dat --to openfast --held foot
  rom export rod.SID_FEM rod.rom.npz    # and back, without geometric stiffness
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    parser.add_argument("file", type=Path, help="body file, e.g. rod.rom.npz, or .SID_FEM")
    parser.add_argument("output", type=Path, help="file to write")
    parser.add_argument("--to", metavar="FORMAT", help="format, if the ending does not tell")
    parser.add_argument(
        "--held", metavar="NAME,...", type=names, default=(), help="interfaces held, for openfast"
    )
    add_force(parser)


def run(args: argparse.Namespace) -> Answer:
    """Load; the file is written at the end."""
    from rom.io.export import export, format_of, read_body
    from rom.io.files import check_writable

    check_writable(args.output)
    kind = format_of(args.output, args.to)
    checked(args, args.output, kind)
    body = read_body(args.file)
    data = {"file": str(args.file), "output": str(args.output), "format": kind}
    text = f"{args.output}: body {body.name} as {kind}"
    return Answer(data, text, lambda: export(body, args.output, to=kind, held=args.held))
