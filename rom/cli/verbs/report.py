"""Write a report of a body, a component, a mechanism or a finished run: one HTML file.

Modes and motions turn, swing and play in the browser, without network; still pictures are inside
for print and for browsers without WebGL. Where no picture can be drawn it says why.
"""

import argparse
from pathlib import Path

import rom
from rom.cli.answer import Answer
from rom.cli.options import add_meshing, meshing, option
from rom.cli.output import add_force, checked, typed_command, usual
from rom.names import check_ending

SUMMARY = "write a report as one HTML file"
EXAMPLES = """\
  rom report rod.rom.npz              # writes rod.html
  rom report meshes/connecting_rod.toml -o rod.html   # meshes and reduces it first
  rom report demos/slider_crank.toml -o crank.html    # as it starts
  rom report demos/slider_crank.toml --move -o crank.html   # and as it moves
  rom report out                                      # what rom simulate left
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    parser.add_argument("file", type=Path, help="body file, .toml file, or folder of a run")
    option(parser, "-o --output", "report, .html (default: as the file)", Path)
    option(parser, "--move", "move the mechanism of a file, and show the motion")
    add_force(parser)
    add_meshing(parser)


def run(args: argparse.Namespace) -> Answer:
    """Describe; the file is written at the end."""
    from rom.report.pages import describe

    args.output = usual(args, ".html")
    check_ending(args.output, "a report", ".html")
    checked(args, args.output)
    title, sections = describe(
        args.file,
        command=typed_command(args),
        version=rom.__version__,
        move=args.move,
        progress=not args.quiet,
        **meshing(args),
    )
    data = {
        "file": str(args.file),
        "output": str(args.output),
        "title": title,
        "sections": list(sections),
    }
    text = f"{args.output}: {title}"
    return Answer(data, text, lambda: rom.write_report(sections, args.output, title=title))
