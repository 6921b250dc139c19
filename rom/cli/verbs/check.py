"""Check a body file: checksums, consistency of its integrals, the certificate it carries.

A description, .toml, is read for mistakes; of any other file it is said what it is, and what to do
with it.
"""

import argparse
from pathlib import Path

import rom
from rom.cli.answer import Answer, failures, report_data
from rom.cli.described import described

SUMMARY = "check a body file and print its certificate"
EXAMPLES = """\
  rom check rod.rom.npz
  rom check rod.rom.npz --json
  rom check rod.SID_FEM          # which dialect, and whether its blocks agree
  rom check slider_crank.toml    # mistakes in a description, by line
  rom check part.step            # what it is, and the next command
"""
OTHERS = {  # endings: (what such a file is, next commands)
    ".step .stp": ("a part of a CAD program", "rom swing {}", "rom mesh {} --faces"),
    ".geo .py": ("a program of gmsh", "rom mesh {}", "rom modes {} --material steel"),
    ".msh .inp .bdf": ("a mesh", "rom mesh {}", "rom modes {} --material steel"),
    ".op4 .mtx .mm .pch .dmig .dat .sti .mas": (
        "a matrix of another program",
        "rom modes {} --mass MASS --nodes NODES",
        "rom reduce {} --mass MASS --nodes NODES -i NAME=rbe2",
    ),
    ".unv .uff": ("a vibration test", "rom update FAMILY {}"),
    ".json": ("the record or the scene of a run", "rom report FOLDER"),
}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    parser.add_argument("file", type=Path, help="body file, e.g. rod.rom.npz, or any other")


def run(args: argparse.Namespace) -> Answer:
    """Load and check."""
    from rom.io.native import load

    ending = args.file.suffix.lower()
    known = next((told for endings, told in OTHERS.items() if ending in endings.split()), None)
    if known or described(args):
        return _told(args.file, *known) if known else _description(args.file)
    if ending == ".sid_fem":
        record = rom.read_sid(args.file, ge="as_written")
        report, told = rom.io.check_sid(record), {"name": record.name, "dialect": record.dialect}
    else:
        body = load(args.file)
        report, told = rom.check(body), {"name": body.name}
    data = {"file": str(args.file), **told, "report": report_data(report)}
    return Answer(data, f"{args.file}\n{report}", failed=failures(report))


def _told(file: Path, what: str, *commands: str) -> Answer:
    from rom.io.files import check_readable

    if not check_readable(file).stat().st_size:
        raise rom.FileFormatError("the file is empty.", where=str(file))
    then = [command.format(file) for command in commands]
    text = "\n".join([f"{file} is {what}. Next, for example", *(f"  {x}" for x in then)])
    return Answer({"file": str(file), "kind": what, "next": then}, text)


def _description(file: Path) -> Answer:
    from rom.config.document import read_document

    if "bodies" in read_document(file).data:
        rom.read_mechanism(file)
        return _told(file, "a mechanism without mistakes", "rom simulate {}", "rom view {}")
    rom.read_component(file)
    return _told(file, "a component without mistakes", "rom reduce {}", "rom modes {}")
